/* SPDX-License-Identifier: MIT */
/*
 * test_honest_heading - no clear is false where the heading drifts (honest.h), as that of a gyro without a compass, as
 * long as the configuration says how fast; where it says that the heading keeps, some are.
 */
#include "tests/lib/honest.h"

#define DRIFT_DPS 0.5

/* Nothing but `heading_drift` tells the two apart. */
#define CONF_TURNING(heading_drift)                                                                               \
    CONF_HEARD "[grid]\nclear_for = 20 s\nforget = 60 s\n[pose]\nmax_age = 2 s\nheading_drift = " heading_drift   \
               "\n[vehicle]\nnear = 3.3 m\nunknown = stop\nmax_speed = 0.6 m/s\nmax_turn = 30 deg\n"
#define SLOW_HEAD(heading_drift)                                                                                  \
    {                                                                                                             \
        .conf = "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n" CONF_TURNING(heading_drift),   \
        .head = {{1, 0, 360, 6, 25, SECOND / 12, true}}, .heads = 1, .pace = 0.5, .tilt_deg = 2                   \
    }
static const struct vehicle kept = SLOW_HEAD("0 deg/s"), head = SLOW_HEAD("0.5 deg/s");
static const struct vehicle fan = {.conf = "[sonar fan]\ndevice = surveyor\nport = udp:10.0.0.2:62312\n"
                                           "range = 10 m\n" CONF_TURNING("0.5 deg/s"),
                                   .head = {{32, -48, 48, 3, 25, SECOND / 8, false}},
                                   .heads = 1,
                                   .pace = 0.5,
                                   .tilt_deg = 2};

static void drift_with(const struct vehicle *v, bool basin, bool provokes, int worlds)
{
    run_with(&(struct trial){.vehicle = v,
                             .period_ns = SECOND / 10,
                             .late_ns = SECOND / 50,
                             .hollow_m = basin ? 0 : 5, /* nearer, near would be no true promise */
                             .basin = basin,
                             .heading_dps = DRIFT_DPS,
                             .provokes = provokes},
             1, worlds);
}

TEST(a_heading_that_drifts)
{
    drift_with(&head, true, false, 1);
    USEFUL(amply_told_share(SECTORS) > 0.5);
    drift_with(&head, false, false, worlds(3));
    drift_with(&fan, false, false, 1);
}

TEST(a_heading_that_is_taken_to_keep)
{
    drift_with(&kept, false, true, is_long() ? 4 : 2);
}

int main(void)
{
    seed = test_seed();
    RUN(a_heading_that_drifts);
    RUN(a_heading_that_is_taken_to_keep);
    return test_end();
}
