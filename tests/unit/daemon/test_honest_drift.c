/* SPDX-License-Identifier: MIT */
/*
 * test_honest_drift - no clear is false where nobody tells the position of a vehicle that moves (honest.h):
 * attitude and depth alone, as of a vehicle without a velocity log; with a velocity; with no pose at all; and
 * enough is said. With LONG=1 in more worlds, and with more vehicles.
 */
#include "tests/lib/honest.h"

#define CONF_DRIFT                                                                                                \
    CONF_HEARD "[grid]\nclear_for = 20 s\nforget = 60 s\n[pose]\nmax_age = 2 s\n"                                 \
               "[vehicle]\nnear = 3.3 m\nunknown = stop\n"
#define CONF_HEAD "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n" CONF_DRIFT
#define CONF_FAN  "[sonar fan]\ndevice = surveyor\nport = udp:10.0.0.2:62312\nrange = 10 m\n" CONF_DRIFT
/* Its steps are less than half of its beam, as those of heads on the market: a lost ping leaves no gap. */
#define HEAD                                                                                                      \
    {                                                                                                             \
        1, 0, 360, 6, 25, SECOND / 25, true                                                                       \
    }
#define FAN                                                                                                       \
    {                                                                                                             \
        32, -48, 48, 3, 25, SECOND / 8, false                                                                     \
    }

/* At most 0.3 m/s. */
static const struct vehicle head = {
    .conf = CONF_HEAD "max_speed = 0.3 m/s\n", .head = {HEAD}, .heads = 1, .pace = 0.5, .tilt_deg = 2};
static const struct vehicle fan = {.conf = CONF_FAN "max_speed = 0.3 m/s\n",
                                   .head = {FAN},
                                   .heads = 1,
                                   .pace = 0.5,
                                   .tilt_deg = 2,
                                   .ahead_deg = 40};
static const struct vehicle unsaid_fan = {
    .conf = CONF_FAN, .head = {FAN}, .heads = 1, .pace = 0.5, .tilt_deg = 2, .ahead_deg = 40};
/* Keeps its place as well as it can, and says so. */
static const struct vehicle keeping = {
    .conf = CONF_HEAD "station_keeping = 0.05 m/s\n", .head = {HEAD}, .heads = 1, .pace = 0.05, .tilt_deg = 1};
/* All around, mounted off the middle; a fan that sees high and low. */
#define CONF_MOUNTED                                                                                              \
    "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\nmount = 0.3 0.1 -0.2 m\n"                    \
    "[sonar fan]\ndevice = surveyor\nport = udp:10.0.0.2:62312\nrange = 10 m\nmount = 0.4 0 0.1 m\n" CONF_DRIFT
static const struct vehicle both = {
    .conf = CONF_MOUNTED "max_speed = 0.6 m/s\n",
    .head = {{1, 0, 360, 3, 165, SECOND / 25, true}, {24, -48, 48, 4, 60, SECOND / 8, false}},
    .heads = 2,
    .pace = 1,
    .tilt_deg = 4};

/* A client bounds its speed; it may be five times as fast as it mostly is. */
static const struct vehicle bounded_head = {.conf = CONF_HEAD "max_speed = 1.5 m/s\ncurrent = 0.05 m/s\n",
                                            .head = {HEAD},
                                            .heads = 1,
                                            .pace = 0.3,
                                            .tilt_deg = 2};
static const struct vehicle bounded_fan = {.conf = CONF_FAN "max_speed = 1.5 m/s\ncurrent = 0.05 m/s\n",
                                           .head = {FAN},
                                           .heads = 1,
                                           .pace = 0.5,
                                           .tilt_deg = 2,
                                           .ahead_deg = 40};

#define NO_PLACE (POSE_POSITION | POSE_VELOCITY)

/* Poses ten times a second; what they do not tell. */
static void drift_with(const struct vehicle *v, unsigned untold, bool basin, int n_worlds)
{
    run_with(&(struct trial){.vehicle = v,
                             .period_ns = SECOND / 10,
                             .late_ns = SECOND / 50,
                             .untold = untold,
                             .hollow_m = basin ? 0 : 5, /* nearer, near would be no true promise */
                             .basin = basin},
             1, n_worlds);
}

TEST(a_head_with_attitude_and_depth)
{
    drift_with(&head, NO_PLACE, true, worlds(2));
    USEFUL(count[SECTORS].clear > 12 && count[FREE_TO].clear > 25 && count[LIMIT].clear > 15);
    if (is_long())
        drift_with(&head, NO_PLACE, false, 2);
}

TEST(a_fan_with_attitude_and_depth)
{
    drift_with(&fan, NO_PLACE, true, 1);
    USEFUL(amply_told_share(CONE) > 0.45 && amply_told_share(CORRIDOR) > 0.45 && amply_told_share(SECTORS) > 0.5);
    if (is_long()) {
        drift_with(&fan, NO_PLACE, false, 1);
        drift_with(&unsaid_fan, NO_PLACE, false, 1);
    }
}

TEST(several_sonars_with_attitude_and_depth)
{
    drift_with(&both, NO_PLACE, false, worlds(2));
}

TEST(with_attitude_alone)
{
    drift_with(&fan, NO_PLACE | POSE_DEPTH, true, 1);
    if (is_long())
        drift_with(&head, NO_PLACE | POSE_DEPTH, false, 1);
}

TEST(with_attitude_and_velocity)
{
    drift_with(&head, POSE_POSITION, true, 1);
    USEFUL(amply_told_share(SECTORS) > 0.2);
    drift_with(&fan, POSE_POSITION | POSE_DEPTH, false, 1);
    USEFUL(amply_told_share(SECTORS) > 0.5);
    if (is_long())
        drift_with(&both, POSE_POSITION, false, 2);
}

TEST(keeping_its_place)
{
    drift_with(&keeping, NO_PLACE, true, 1);
    USEFUL(amply_told_share(SECTORS) > 0.5);
}

TEST(bounds_of_its_speed)
{
    static const struct vehicle *const v[] = {&bounded_head, &bounded_fan};
    for (int i = 0; i < (is_long() ? 4 : 1); i++)
        run_with(&(struct trial){.vehicle = v[i % 2],
                                 .period_ns = SECOND / 20,
                                 .late_ns = SECOND / 50,
                                 .untold = NO_PLACE,
                                 .hollow_m = i < 2 ? 0 : 5,
                                 .basin = i < 2,
                                 .water_mps = 0.05},
                 1, 1);
    USEFUL(is_long() || (count[SECTORS].clear > 12 && count[FREE_TO].clear > 25));
}

/* A vehicle of which it is said that it moves, and nothing else ever; or its depth alone. */
TEST(without_attitude)
{
    drift_with(&head, NO_PLACE | POSE_DEPTH | POSE_ATTITUDE, true, 1);
    if (is_long()) {
        drift_with(&fan, NO_PLACE | POSE_DEPTH | POSE_ATTITUDE, true, 1);
        drift_with(&head, NO_PLACE | POSE_ATTITUDE, true, 1);
    }
}

int main(void)
{
    seed = test_seed();
    RUN(a_head_with_attitude_and_depth);
    RUN(a_fan_with_attitude_and_depth);
    RUN(several_sonars_with_attitude_and_depth);
    RUN(with_attitude_alone);
    RUN(with_attitude_and_velocity);
    RUN(keeping_its_place);
    RUN(bounds_of_its_speed);
    RUN(without_attitude);
    return test_end();
}
