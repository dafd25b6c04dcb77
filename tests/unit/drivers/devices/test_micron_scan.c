/* SPDX-License-Identifier: MIT */
/*
 * test_micron_scan - the stretches of a steered Micron, with a head that steps within the limits it was told: all of
 * the circle is seen, what it is steered to more often, and all within the time that was set.
 */
#include "tests/lib/test.h"

#include "drivers/devices/micron.h"
#include "drivers/devices/micron_scan.h"

#define STEP    32u /* 1.8 degrees */
#define ARCS    (MICRON_TURN / STEP)
#define PING_NS 50000000ull

static struct micron_scan scan;
static unsigned bearing, left, right, count[ARCS];
static bool limited, backward;
static uint64_t now_ns, seen_ns[ARCS], longest_ns;

/* One step of the motor: back and forth between limits; from outside to the left one. */
static void turn(void)
{
    const unsigned span = (right + MICRON_TURN - left) % MICRON_TURN,
                   at = (bearing + MICRON_TURN - left) % MICRON_TURN;
    if (!limited) {
        bearing = (bearing + STEP) % MICRON_TURN;
    } else if (at > span) {
        bearing = left;
        backward = false;
    } else if (backward ? at < STEP : at + STEP > span) {
        backward = !backward;
    } else {
        bearing = (bearing + (backward ? MICRON_TURN - STEP : STEP)) % MICRON_TURN;
    }
}

static void pings(unsigned n)
{
    for (unsigned i = 0; i < n; i++) {
        turn();
        now_ns += PING_NS;
        const unsigned arc = bearing / STEP;
        if (seen_ns[arc] && now_ns - seen_ns[arc] > longest_ns)
            longest_ns = now_ns - seen_ns[arc];
        seen_ns[arc] = now_ns;
        count[arc]++;
        if (micron_scan_ping(&scan, bearing, now_ns))
            limited = micron_scan_limits(&scan, &left, &right);
    }
}

static void start(uint64_t circle_ns, unsigned from)
{
    memset(count, 0, sizeof count);
    memset(seen_ns, 0, sizeof seen_ns);
    limited = backward = false;
    bearing = from;
    now_ns = 1000;
    longest_ns = 0;
    micron_scan_init(&scan, STEP, circle_ns);
}

static unsigned ahead(void)
{
    unsigned n = 0;
    for (unsigned a = MICRON_AHEAD / STEP - 10; a <= MICRON_AHEAD / STEP + 10; a++)
        n += count[a];
    return n;
}

TEST(half_goes_ahead_and_all_of_the_circle_is_seen_wherever_it_begins)
{
    uint64_t seed = test_seed();
    for (int round = 0; round < 200; round++) {
        start(0, (unsigned)(test_random(&seed) % ARCS) * STEP);
        micron_scan_steer(&scan, geo_rad(-20), geo_rad(20), false);
        pings(6 * ARCS);
        for (unsigned a = 0; a < ARCS; a++)
            CHECK(count[a] >= 1);
        CHECK(ahead() > 2 * ARCS);
        CHECK(longest_ns < 3 * ARCS * PING_NS);
        if (test_case_failed)
            break;
    }
}

TEST(a_set_time_is_kept)
{
    const uint64_t circle_ns = ARCS * PING_NS * 3 / 2;
    start(circle_ns, 0);
    micron_scan_steer(&scan, geo_rad(-20), geo_rad(20), false);
    pings(20 * ARCS);
    printf("# longest wait %.3f of the time set, %u pings ahead of %u\n", (double)longest_ns / (double)circle_ns,
           ahead(), 20 * ARCS);
    CHECK(longest_ns <= circle_ns);
    CHECK(2 * ahead() > 7 * ARCS); /* a plain scan gives a tenth of 20 turns: 2 */
    start(ARCS * PING_NS / 2, 0);  /* no time for it */
    micron_scan_steer(&scan, geo_rad(-20), geo_rad(20), false);
    pings(20 * ARCS);
    CHECK(2 * ahead() < 5 * ARCS);
}

TEST(without_anything_to_attend_it_goes_round_and_round)
{
    start(0, 0);
    pings(ARCS);
    CHECK(!limited);
    micron_scan_steer(&scan, geo_rad(-20), geo_rad(20), false);
    pings(100);
    CHECK(limited);
    micron_scan_steer(&scan, 0, 0, false);
    pings(200);
    CHECK(!limited);
}

TEST(one_sector_alone_is_looked_at_and_then_the_circle_again)
{
    start(0, 0);
    pings(ARCS);
    micron_scan_steer(&scan, geo_rad(-20), geo_rad(20), true);
    pings(100);
    memset(count, 0, sizeof count);
    pings(460);
    CHECK(ahead() > 400); /* 21 of 23 bearings, some more than once */
    CHECK_INT(count[0], 0);
    micron_scan_steer(&scan, 0, 0, false);
    pings(2 * ARCS);
    CHECK(!limited);
    for (unsigned a = 0; a < ARCS; a++)
        CHECK(count[a] >= 1);
}

TEST(a_head_that_never_comes_there_is_not_waited_for)
{
    start(0, 0);
    micron_scan_steer(&scan, geo_rad(-20), geo_rad(20), false);
    unsigned stretches = 0;
    for (int i = 0; i < 1000; i++)
        stretches += micron_scan_ping(&scan, 0, now_ns += PING_NS);
    CHECK(stretches > 10);
}

int main(void)
{
    RUN(half_goes_ahead_and_all_of_the_circle_is_seen_wherever_it_begins);
    RUN(a_set_time_is_kept);
    RUN(without_anything_to_attend_it_goes_round_and_round);
    RUN(one_sector_alone_is_looked_at_and_then_the_circle_again);
    RUN(a_head_that_never_comes_there_is_not_waited_for);
    return test_end();
}
