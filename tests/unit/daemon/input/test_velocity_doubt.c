/* SPDX-License-Identifier: MIT */
/* test_velocity_doubt - a velocity of exactly zero is not believed where other parts show that the vehicle moves. */
#include "tests/lib/test.h"

#include "daemon/input/velocity_doubt.h"

static struct velocity_doubt doubt;
static int told;
static uint64_t t_ns; /* of the next sample */

/* One sample; is there a velocity in it that is believed? */
static bool sample(unsigned has, double yaw_rad, double north_m, double depth_m, double north_mps)
{
    struct pose p = pose_identity;
    p.has = has;
    p.t_ns = t_ns += 100000000;
    quat_from_rpy(0, 0, yaw_rad, p.attitude);
    p.position_m[0] = north_m;
    p.position_m[2] = depth_m;
    p.velocity_mps[0] = north_mps;
    told += velocity_doubt_take(&doubt, &p);
    CHECK_INT(p.has & ~(unsigned)POSE_VELOCITY, has & ~(unsigned)POSE_VELOCITY);
    return p.has & POSE_VELOCITY;
}

static void begin(void)
{
    doubt = (struct velocity_doubt){0};
    told = 0;
}

static const unsigned whole = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH | POSE_VELOCITY;

TEST(zeros_at_rest_are_believed)
{
    begin();
    for (int i = 0; i < 1000; i++) /* what a compass, a barometer and a position do at rest */
        CHECK(sample(whole, 0.08 * sin(i), 0.4 * cos(i), 3 + 0.1 * sin(i / 10.0), 0));
    CHECK(told == 0 && !doubt.doubted);
}

TEST(zeros_that_something_contradicts_are_not)
{
    static const struct {
        const char *name;
        unsigned has;
        double yaw_rad, north_m, depth_m; /* each sample */
    } rows[] = {
        {"turns", POSE_ATTITUDE | POSE_VELOCITY, 0.02, 0, 0},
        {"sinks", POSE_DEPTH | POSE_VELOCITY, 0, 0, 0.06},
        {"rises", POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY, 0, 0, -0.06},
        {"goes by its position", whole, 0, 0.12, 0},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        int believed = 0;
        begin();
        for (int k = 0; k < 50; k++)
            believed += sample(rows[i].has, k * rows[i].yaw_rad, k * rows[i].north_m, 5 + k * rows[i].depth_m, 0);
        if (believed > 10)
            printf("# %s\n", rows[i].name);
        CHECK(believed >= 4 && believed <= 10);
        CHECK_INT(told, 1);
        CHECK_INT(doubt.left_out, 50 - believed);
        CHECK(sample(rows[i].has, 0, 0, 5, 0.003)); /* measured again */
        CHECK(!doubt.doubted && sample(rows[i].has, 0, 0, 5, 0));
    }
}

/* The parts may come one by one, of several senders. */
TEST(parts_that_come_apart_contradict_as_well)
{
    begin();
    for (int k = 0; k < 50; k++) {
        sample(POSE_ATTITUDE, 0, 0, 0, 0);
        sample(POSE_DEPTH, 0, 0, 5 + 0.06 * k, 0);
        CHECK_INT(sample(POSE_VELOCITY, 0, 0, 0, 0), k < 10);
    }
    CHECK_INT(told, 1);
}

TEST(who_has_no_velocity_of_zero_is_never_doubted)
{
    begin();
    for (int k = 0; k < 100; k++) {
        CHECK(sample(whole, 0.1 * k, k, k, 0.001));
        CHECK(!sample(POSE_ATTITUDE | POSE_DEPTH, 0.1 * k, k, k, 0));
        if (k % 3 == 0) /* one in between, as a measured velocity that passes through it */
            CHECK(sample(whole, 0.1 * k, k, k, 0));
    }
    CHECK_INT(told, 0);
}

TEST(a_velocity_that_is_left_out_is_not_doubted)
{
    begin();
    for (int k = 0; k < 50; k++)
        sample(POSE_ATTITUDE | POSE_VELOCITY, 0.02 * k, 0, 0, 0);
    CHECK(doubt.doubted && told == 1);
    for (int k = 50; k < 145; k++) { /* 9.5 s: it may come back */
        sample(POSE_ATTITUDE, 0.02 * k, 0, 0, 0);
        CHECK(doubt.doubted);
    }
    for (int k = 145; k < 155; k++)
        sample(POSE_ATTITUDE, 0.02 * k, 0, 0, 0);
    CHECK(!doubt.doubted && told == 1);
}

int main(void)
{
    RUN(zeros_at_rest_are_believed);
    RUN(zeros_that_something_contradicts_are_not);
    RUN(parts_that_come_apart_contradict_as_well);
    RUN(who_has_no_velocity_of_zero_is_never_doubted);
    RUN(a_velocity_that_is_left_out_is_not_doubted);
    return test_end();
}
