/* SPDX-License-Identifier: MIT */
/*
 * test_pilot - a vehicle that goes no faster than the daemon says collides with nothing: some short drives in worlds
 * drawn at random, with another place, sonar and navigation each (tests/pilot). `make pilot` has more and longer ones.
 */
#include "tests/lib/sanitized.h"
#include "tests/lib/test.h"

#include "tests/pilot/rover.h"
#include "tests/pilot/run.h"

#define DRIVES  6
#define DRIVE_S 20

/* Straight for the goal, whatever stands in the way: six drives have each place, and all sonars and poses. */
static struct pilot_case short_case(uint64_t seed, unsigned i)
{
    struct pilot_case c;
    pilot_draw_case(seed, i, &c);
    c.sonar = (enum pilot_sonar)(i % PILOT_SONARS);
    c.nav = (enum pilot_nav)((i + i / PILOT_SONARS) % PILOT_NAVS);
    c.fault = (enum pilot_fault)(i % PILOT_FAULTS);
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
        char name[PILOT_NAME_SIZE];
        if (!pilot_run(&c, &r, NULL))
            continue;
        driven++;
        went += r.share[PILOT_GOING] > 0.2;
        printf("# %s: least clearance %.2f m\n", pilot_name(&c, name), r.nearest_m);
        if (r.collided)
            printf("collided at %.2f m/s after %.1f s\n", r.touched_mps, r.end_s);
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

/* In the first world of a place that has a way to the goal, with sound instruments and a chart. */
static bool arrives(enum pilot_place place, enum pilot_sonar sonar, enum pilot_nav nav, enum pilot_setup setup)
{
    struct pilot_result r;
    struct pilot_case c = {.place = place,
                           .sonar = sonar,
                           .nav = nav,
                           .setup = setup,
                           .chart = true,
                           .limit_s = 40,
                           .seed = 20260101};
    while (!pilot_run(&c, &r, NULL))
        c.seed++;
    return r.arrived && !r.collided;
}

TEST(a_vehicle_set_up_as_documented_arrives)
{
    CHECK(arrives(PILOT_BASIN, PILOT_PING360, PILOT_POSITION, PILOT_LEVEL));
    CHECK(arrives(PILOT_OPEN, PILOT_FAN, PILOT_ATTITUDE, PILOT_LEVEL));
}

TEST(a_sonar_that_looks_up_and_down_needs_no_promise)
{
    CHECK(sanitized() || arrives(PILOT_OPEN, PILOT_MATRIX, PILOT_POSITION, PILOT_BARE));
    CHECK(sanitized() || arrives(PILOT_HARBOUR, PILOT_MATRIX, PILOT_POSITION, PILOT_BARE));
}

/* Or a collision would be no fault of the answers. */
TEST(instruments_are_as_wrong_as_is_allowed_for)
{
    const uint64_t seed = test_seed();
    struct pilot_instruments n;
    struct pilot_vehicle v = {.place_m = {10, -5, 0}, .velocity_mps = {0.5, 0.2}, .heading_rad = 1};
    for (unsigned i = 0; i < 1000; i++) {
        const double t_s = i * 0.1;
        struct pose p;
        double heading_rad;
        if (i % 100 == 0)
            pilot_instruments_init(&n, 1, dice_of(seed, i));
        pilot_instruments_read(&n, &v, POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY | POSE_POSITION, t_s, &p,
                               &heading_rad);
        CHECK(hypot(p.position_m[0] - 10, p.position_m[1] + 5) < 0.01 * hypot(10, 5) + 0.03);
        CHECK(hypot(p.velocity_mps[0] - 0.5, p.velocity_mps[1] - 0.2) < 0.05 * hypot(0.5, 0.2) + 0.02);
        CHECK(fabs(heading_rad - 1) < geo_rad(0.01) * t_s + 0.006);
    }
}

/*
 * Level, with equal thrusters, no tether, and moved along one of its axes at a time a vehicle goes through the water as
 * it is told to. Who steers leaves a force of less than 0.2 N out and corrects an error by 2 / s: of the lightest
 * vehicle, 9.75 kg, an error of 0.01 m/s stays, and as much again by thrusters that lag and start late. He knows of no
 * tilt, no lost propeller and no tether, and reckons each axis by itself, although thrust is no linear function of the
 * pulse: what they do to the speed has no bound.
 */
TEST(a_vehicle_that_nothing_else_moves_goes_as_it_is_told)
{
    static const double wanted_mps[][2] = {{0, 0}, {0.4, 0}, {0, 0}, {0, -0.2}, {-0.1, 0}, {0, 0}};
    const uint64_t seed = test_seed();
    for (int turn = 0; turn < 4; turn++) {
        const double current_mps[2] = {0.05, -0.03};
        double off_mps = 0;
        struct rover r;
        rover_start(&r, seed + (uint64_t)turn, current_mps, 0.08);
        r.rov.tether_ns2pm2 = 0;
        r.rov.righting_nm = 50;
        for (int k = 0; k < 8; k++)
            r.rov.share[k] = 1;
        for (int n = 0; n < 6 * 400; n++) {
            const double *command_mps = wanted_mps[n / 400];
            double is_mps[3];
            rover_step(&r, command_mps, turn * GEO_PI / 2, 0.02);
            rov_velocity(&r.rov, is_mps);
            if (n % 400 >= 300)
                off_mps = fmax(off_mps, hypot(is_mps[0] - command_mps[0] - current_mps[0],
                                              is_mps[1] - command_mps[1] - current_mps[1]));
        }
        CHECK(off_mps < 0.02);
    }
}

/* With attitude alone any vehicle goes no farther than its thrusters allow, even one that turns over or is pulled. */
TEST(thrusters_bound_a_vehicle_that_nobody_measures)
{
    static const double wanted_mps[][2] = {{0.4, 0}, {0, 0}, {0, -0.2}, {0.1, 0.1}, {0, 0}};
    const uint64_t seed = test_seed();
    for (uint64_t of = seed; of < seed + 4; of++) {
        const double current_mps[2] = {0.05, -0.03};
        struct rover r;
        double was_m[2] = {0}, sure_m = 0, went_m = 0;
        rover_start(&r, of, current_mps, 0.08);
        const double *place_m = r.rov.place_m;
        for (int n = 0; n < 5 * 500; n++) {
            const bool sampled = rover_step(&r, wanted_mps[n / 500], 0.002 * n, 0.02);
            went_m += hypot(place_m[0] - was_m[0], place_m[1] - was_m[1]);
            memcpy(was_m, place_m, sizeof was_m);
            sure_m += sampled ? (r.mps[0] + 0.08) * ROV_BOUND_S : 0;
            CHECK(!sampled || went_m <= sure_m);
        }
    }
}

/* A diver who swims against the vehicle is not what it ran into. */
TEST(what_stands_still_is_told_from_what_swims)
{
    const double start_m[3] = {0};
    const struct place w = place_of_pilot(PILOT_DIVER, 20260101, &pilot_hull, 1);
    const struct place still = place_still(&w);
    const struct place_shape *diver = w.shape;
    for (int i = 0; !place_moves(diver); i++, diver++)
        CHECK(still.shape[i].kind == diver->kind);
    CHECK(diver[1].kind == PLACE_END && still.shape[diver - w.shape].kind == PLACE_END);
    const double meets_s = -diver->p[1] / diver->v[1], there_m[3] = {diver->p[0] + diver->v[0] * meets_s, 0, 0};
    CHECK(place_clearance(&w, there_m, &pilot_hull, meets_s) < 0);
    CHECK(place_clearance(&w, start_m, &pilot_hull, 0) > 0);
    CHECK(place_clearance(&still, there_m, &pilot_hull, meets_s) >
          place_clearance(&w, there_m, &pilot_hull, meets_s));
}

/* When a diver was last in a beam says whether the daemon could know of him. */
TEST(a_head_points_at_a_diver_once_in_a_revolution)
{
    const struct mount mount = mount_identity;
    const double north_m[2] = {5, 0}, east_m[2] = {0, 5};
    struct pilot_shot shot = {.mount = &mount};
    unsigned pointed = 0;
    for (shot.number = 1; shot.number <= 200; shot.number++) /* 1.8 degrees */
        pointed += pilot_sonar_points_at(PILOT_PING360, &shot, east_m, 0.3);
    CHECK(pointed >= 4 && pointed <= 6); /* 2 and twice 3.4 degrees */
    CHECK(pilot_sonar_points_at(PILOT_FAN, &shot, north_m, 0.3));
    CHECK(!pilot_sonar_points_at(PILOT_FAN, &shot, east_m, 0.3));
}

int main(void)
{
    RUN(no_drive_ends_in_a_collision);
    RUN(a_vehicle_that_heeds_nothing_collides);
    RUN(a_vehicle_set_up_as_documented_arrives);
    RUN(a_sonar_that_looks_up_and_down_needs_no_promise);
    RUN(instruments_are_as_wrong_as_is_allowed_for);
    RUN(a_vehicle_that_nothing_else_moves_goes_as_it_is_told);
    RUN(thrusters_bound_a_vehicle_that_nobody_measures);
    RUN(what_stands_still_is_told_from_what_swims);
    RUN(a_head_points_at_a_diver_once_in_a_revolution);
    return test_end();
}
