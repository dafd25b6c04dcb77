/* SPDX-License-Identifier: MIT */
/*
 * test_mavlink_thrusters - a virtual BlueROV2 (rov.h) whose messages come late, are lost, doubled and out of order, and
 * whose parameters are wrong, missing or changed: the bound that comes out is never less than it goes, and
 * there is none where it cannot be known.
 */
#include "client/mavlink/mavlink_thrusters.h"
#include "tests/lib/rov.h"
#include "tests/lib/test.h"

#define MS 1000000ull

static uint64_t seed;
static struct mavlink_thrusters t;

static void param(const char *name, double value)
{
    struct mavlink_param_value m = {.param_value = (float)value};
    memcpy(m.param_id, name, strnlen(name, sizeof m.param_id));
    mavlink_thrusters_param(&t, &m);
}

/* What a Heavy's autopilot answers, by its own directions. */
static void answer(const struct rov *r)
{
    char id[MAVLINK_PARAM_ID + 1] = {0};
    for (int i = 0; i < 2 * MAVLINK_THRUSTERS_PARAMS && mavlink_thrusters_ask(&t, true, id); i++) {
        int n;
        if (sscanf(id, "MOT_%d", &n) == 1)
            param(id, r ? r->direction[n - 1] : 1);
        else if (sscanf(id, "SERVO%d", &n) == 1)
            param(id, n <= 8 ? 32 + n : n == 12 || n == 13 ? 59 : 0); /* and lights */
        else
            param(id, 2);
    }
    CHECK(!mavlink_thrusters_ask(&t, true, id));
}

static void begin(void)
{
    const struct mavlink_heartbeat sub = {.type = 12, .autopilot = 3, .base_mode = 209};
    mavlink_thrusters_init(&t, &(struct mavlink_thrusters_conf){{0}, 0});
    mavlink_thrusters_heartbeat(&t, &sub);
}

static void pulses(const int us[8], uint64_t t_ns, uint64_t now_ns)
{
    struct mavlink_servo_output_raw m = {0};
    for (int k = 0; k < 8; k++)
        m.servo[k] = (uint16_t)us[k];
    mavlink_thrusters_servo(&t, &m, t_ns, now_ns);
}

static const int still[8] = {1500, 1500, 1500, 1500, 1500, 1500, 1500, 1500};

/* Twenty a second, from *ms on for so long; the last bound, negative: none came. */
static double run(const int us[8], uint64_t *ms, uint64_t for_ms)
{
    double mps[2], last = -1;
    for (const uint64_t end_ms = *ms + for_ms; *ms < end_ms; *ms += 50) {
        uint64_t t_ns;
        mavlink_thrusters_attitude(&t, (const double[]){1, 0, 0, 0}, *ms * MS);
        pulses(us, *ms * MS, *ms * MS);
        last = mavlink_thrusters_take(&t, &t_ns, mps) && t_ns == *ms * MS ? mps[0] : -1;
    }
    return last;
}

/* All four level thrusters of a vectored frame push ahead by the same pulse, two of them turned the other way. */
TEST(which_way_they_push_is_told)
{
    static const struct {
        int us[8];
        double ahead_n, right_n; /* of what four push at 45 degrees */
    } row[] = {{{1400, 1400, 1600, 1600, 1500, 1500, 1500, 1500}, 1, 0},
               {{1600, 1600, 1400, 1400, 1500, 1500, 1500, 1500}, -1, 0},
               {{1600, 1400, 1600, 1400, 1500, 1500, 1500, 1500}, 0, 1},
               {{1600, 1400, 1400, 1600, 1500, 1500, 1500, 1500}, 0, 0}, /* turns */
               {{1500, 1500, 1500, 1500, 1600, 1600, 1500, 1500}, 0, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint64_t ms = 1000;
        begin();
        answer(NULL);
        CHECK(run(row[i].us, &ms, 1000) > 0);
        CHECK_NEAR(t.push_n[0] / 16.2, row[i].ahead_n, 0, 0.05);
        CHECK_NEAR(t.push_n[1] / 16.2, row[i].right_n, 0, 0.05);
    }
}

TEST(without_parameters_there_is_none)
{
    uint64_t ms = 1000;
    begin();
    CHECK(run(still, &ms, 1000) < 0);
    CHECK_INT(mavlink_thrusters_why(&t, ms * MS), MAVLINK_NO_PARAMETERS);
    answer(NULL);
    CHECK(run(still, &ms, 60000) > 0 && t.mps[0] < 0.15);
    CHECK_INT(mavlink_thrusters_why(&t, ms * MS), MAVLINK_BOUND);
    /* silence, and a rate that says too little */
    CHECK_INT(mavlink_thrusters_why(&t, ms * MS + 500 * MS), MAVLINK_NO_MESSAGES);
    CHECK(!mavlink_thrusters_slow(&t));
    for (int i = 0; i < 10; i++) {
        uint64_t t_ns;
        double mps[2];
        ms += 500;
        pulses(still, ms * MS, ms * MS);
        CHECK(!mavlink_thrusters_take(&t, &t_ns, mps));
        CHECK_INT(mavlink_thrusters_why(&t, ms * MS), MAVLINK_NO_RATE);
    }
    CHECK_INT(mavlink_thrusters_why(&t, (ms + 1900) * MS), MAVLINK_NO_RATE);
    CHECK_INT(mavlink_thrusters_why(&t, (ms + 2100) * MS), MAVLINK_NO_MESSAGES);
    CHECK(mavlink_thrusters_slow(&t));
    CHECK(run(still, &ms, 1100) > 2); /* nothing is known of the time before */
    CHECK(!mavlink_thrusters_slow(&t));
}

/* Who does not go up or down is not driven aside by what weighs it down. */
TEST(a_climb_that_is_known_says_more)
{
    uint64_t ms = 1000;
    begin();
    answer(NULL);
    const double unknown_mps = run(still, &ms, 60000);
    for (int i = 0; i < 300; i++) {
        mavlink_thrusters_climb(&t, i % 2 ? 0.01 : -0.01, ms * MS);
        run(still, &ms, 200);
    }
    CHECK(mavlink_thrusters_climb_known(&t, ms * MS));
    CHECK(run(still, &ms, 200) < 0.8 * unknown_mps);
    for (int i = 0; i < 50; i++) { /* zeros measure nothing */
        mavlink_thrusters_climb(&t, 0, ms * MS);
        run(still, &ms, 200);
    }
    CHECK(!mavlink_thrusters_climb_known(&t, ms * MS));
}

TEST(what_cannot_be_known_is_no_bound)
{
    static const struct {
        const char *name;
        double value;
        enum mavlink_no_bound why;
    } row[] = {{"FRAME_CONFIG", 7, MAVLINK_NO_FRAME},       {"FRAME_CONFIG", NAN, MAVLINK_NO_FRAME},
               {"FRAME_CONFIG", -1, MAVLINK_NO_FRAME},      {"FRAME_CONFIG", 1, MAVLINK_NO_MOTORS},
               {"MOT_3_DIRECTION", 0, MAVLINK_NO_MOTORS},   {"SERVO2_FUNCTION", 0, MAVLINK_NO_MOTORS},
               {"SERVO2_FUNCTION", 53, MAVLINK_NO_STICKS},  {"SERVO2_FUNCTION", 60, MAVLINK_NO_MOTORS},
               {"SERVO2_FUNCTION", 66, MAVLINK_NO_MOTORS},  {"SERVO14_FUNCTION", 56, MAVLINK_NO_STICKS},
               {"SERVO14_FUNCTION", 51, MAVLINK_NO_STICKS}, {"SERVO9_FUNCTION", 33, MAVLINK_NO_MOTORS},
               {"SERVO9_FUNCTION", 82, MAVLINK_NO_MOTORS}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        uint64_t ms = 1000;
        begin();
        answer(NULL);
        CHECK(run(still, &ms, 1000) > 0);
        param(row[i].name, row[i].value);
        CHECK(run(still, &ms, 1000) < 0);
        CHECK_INT(mavlink_thrusters_why(&t, ms * MS), row[i].why);
    }
}

TEST(pulses_and_times_that_cannot_be)
{
    int us[8] = {1500, 1500, 1500, 1500, 1500, 1500, 1500, 1500};
    static const int wrong[] = {1099, 1901, 0, 65535};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        uint64_t ms = 1000;
        begin();
        answer(NULL);
        CHECK(run(still, &ms, 60000) > 0);
        us[3] = wrong[i];
        CHECK(run(us, &ms, 1000) < 0);
        CHECK_INT(mavlink_thrusters_why(&t, ms * MS), MAVLINK_NO_PULSES);
        CHECK(run(still, &ms, 1000) > 1); /* what it did meanwhile nobody knows */
    }
    uint64_t ms = 61000;
    begin();
    answer(NULL);
    run(still, &ms, 60000);
    /* doubled and overtaken messages change nothing */
    pulses(still, (ms - 50) * MS, ms * MS);
    pulses(still, (ms - 100) * MS, ms * MS);
    CHECK(run(still, &ms, 500) > 0 && t.mps[0] < 0.15);
    /* another one under the same id, then one that has started again */
    pulses(still, (ms - 1000) * MS, ms * MS);
    CHECK_INT(mavlink_thrusters_why(&t, ms * MS), MAVLINK_NO_CLOCK);
    CHECK(run(still, &ms, 1000) > 1);
    pulses(still, 1000 * MS, ms * MS);
    CHECK_INT(mavlink_thrusters_why(&t, ms * MS), MAVLINK_NO_PARAMETERS);
    /* disarmed it may send no pulses at all */
    const struct mavlink_heartbeat disarmed = {.type = 12, .autopilot = 3, .base_mode = 81};
    static const int none[8] = {0};
    begin();
    answer(NULL);
    CHECK(run(none, &ms, 1000) < 0);
    mavlink_thrusters_heartbeat(&t, &disarmed);
    CHECK(run(none, &ms, 60000) > 0 && t.mps[0] < 0.15);
    /* and what is no submarine has no such bound */
    mavlink_thrusters_heartbeat(&t, &(struct mavlink_heartbeat){.type = 2, .autopilot = 3});
    CHECK_INT(mavlink_thrusters_why(&t, ms * MS), MAVLINK_NO_VEHICLE);
}

/* Bounds that come and do not: what each covers is never less than it went. */
TEST(messages_that_are_lost_and_late)
{
    for (int dive = 0; dive < 20; dive++) {
        static struct rov r;
        struct rov_sticks sticks = {.levels = true, .heads = true, .deep = true, .depth_m = 5};
        double was_m[3] = {0}, mps[2];
        uint64_t t_ns, was_ns = 0;
        int bounds = 0;
        rov_start(&r, test_random(&seed), true, 0);
        begin();
        answer(&r);
        for (uint64_t ms = 1000; ms < 61000; ms += 10) {
            if (ms % 20 == 0)
                rov_steer(&r, &sticks);
            if (test_uniform(&seed) < 0.005)
                sticks.axis[2 + (int)(test_uniform(&seed) * 3.99)] =
                    test_uniform(&seed) < 0.5 ? 0 : 2 * test_uniform(&seed) - 1;
            rov_step(&r, 0.01);
            if (test_uniform(&seed) < 0.5)
                mavlink_thrusters_attitude(&t, r.q, ms * MS);
            if (ms % 50 != 0 || test_uniform(&seed) < 0.15)
                continue;
            double ground[3];
            rov_velocity(&r, ground);
            if (dive % 2 && ms % 200 == 0)
                mavlink_thrusters_climb(&t, -ground[2] + 0.02 * (test_uniform(&seed) - 0.5), ms * MS);
            pulses(r.pulse_us, ms * MS, (ms + 30) * MS);
            if (test_uniform(&seed) < 0.1)
                pulses(r.pulse_us, ms * MS, (ms + 40) * MS);
            if (mavlink_thrusters_take(&t, &t_ns, mps) && was_ns) {
                const double dt_s = (double)(ms * MS - was_ns) * 1e-9;
                CHECK(hypot(r.place_m[0] - was_m[0], r.place_m[1] - was_m[1]) <= mps[0] * dt_s + 1e-9);
                CHECK(fabs(r.place_m[2] - was_m[2]) <= mps[1] * dt_s + 1e-9);
                bounds++;
            }
            memcpy(was_m, r.place_m, sizeof was_m);
            was_ns = ms * MS;
        }
        CHECK(bounds > 700);
    }
}

int main(void)
{
    seed = test_seed();
    RUN(which_way_they_push_is_told);
    RUN(without_parameters_there_is_none);
    RUN(a_climb_that_is_known_says_more);
    RUN(what_cannot_be_known_is_no_bound);
    RUN(pulses_and_times_that_cannot_be);
    RUN(messages_that_are_lost_and_late);
    return test_end();
}
