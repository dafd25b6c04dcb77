/* SPDX-License-Identifier: MIT */
/*
 * test_pilot - a vehicle that goes no faster than the daemon says collides with nothing: some short drives in worlds
 * drawn at random, with another place, sonar and navigation each (tests/pilot). `make pilot` has more and longer ones.
 */
#include "tests/lib/sanitized.h"
#include "tests/lib/test.h"

#include "tests/pilot/run.h"

#define DRIVES  6
#define DRIVE_S 20

/* Straight for the goal, whatever stands in the way. */
static struct pilot_case short_case(uint64_t seed, unsigned i)
{
    struct pilot_case c;
    pilot_draw_case(seed, 7 * i, &c); /* 7: places, sonars and navigations all differ from one to the next */
    c.sonar = (enum pilot_sonar)(i % PILOT_SONARS);
    c.nav = (enum pilot_nav)((i + i / PILOT_SONARS) % PILOT_NAVS);
    c.chart = false;
    c.current_mps = fmin(c.current_mps, 0.08);
    c.limit_s = DRIVE_S;
    return c;
}

static unsigned drives(void)
{
    return sanitized() ? DRIVES / 3 : DRIVES;
}

TEST(no_drive_ends_in_a_collision)
{
    const uint64_t seed = test_seed();
    unsigned driven = 0, went = 0;
    for (unsigned i = 0; i < drives(); i++) {
        const struct pilot_case c = short_case(seed, i);
        struct pilot_result r;
        char name[128];
        if (!pilot_run(&c, &r, NULL))
            continue;
        driven++;
        went += r.share[PILOT_GOING] > 0.2;
        printf("# %s: least clearance %.2f m\n", pilot_name(&c, name), r.nearest_m);
        if (r.collided)
            printf("collided at %.2f m/s after %.1f s\n", r.touched_mps, r.touched_s);
        CHECK(!r.collided);
    }
    CHECK(driven > 0);
    CHECK(getenv("SONARD_SEED") || went > 0);
}

/* Or the drives would prove nothing. */
TEST(a_vehicle_that_heeds_nothing_collides)
{
    struct pilot_case c = short_case(20260101, PILOT_DEAD_END);
    struct pilot_result r;
    c.place = PILOT_DEAD_END;
    c.sonar = PILOT_FAN;
    c.nav = PILOT_POSITION;
    c.heedless = true;
    CHECK(pilot_run(&c, &r, NULL) && r.collided);
}

int main(void)
{
    RUN(no_drive_ends_in_a_collision);
    RUN(a_vehicle_that_heeds_nothing_collides);
    return test_end();
}
