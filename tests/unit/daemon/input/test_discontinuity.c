/* SPDX-License-Identifier: MIT */
/* test_discontinuity - a jump is one in whatever direction, and one back takes it back. */
#include "tests/lib/test.h"

#include <string.h>

#include "daemon/input/discontinuity.h"

#define SECOND     1000000000ull
#define MOST_MPS   1.0
#define MOST_DEGPS 5.0
#define LEAST      (DISCONTINUITY_DEG * GEO_PI / 180)

static struct discontinuities jumps;

static bool at(uint64_t t_s, const double place_m[3], const double rpy_deg[3])
{
    struct pose pose = pose_identity;
    struct jump jump;
    pose.t_ns = t_s * SECOND;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    memcpy(pose.position_m, place_m, sizeof pose.position_m);
    quat_from_rpy(geo_rad(rpy_deg[0]), geo_rad(rpy_deg[1]), geo_rad(rpy_deg[2]), pose.attitude);
    return discontinuity_take(&jumps, &pose, MOST_MPS, geo_rad(MOST_DEGPS), &jump);
}

static const double here[3] = {100, -50, 20}, level[3] = {0, 0, 30};

static void begin(void)
{
    discontinuity_init(&jumps, LEAST);
    CHECK(!at(100, here, level)); /* the first place is none that it has jumped to */
}

TEST(a_jump_along_any_axis_is_one_until_it_is_taken_back)
{
    for (int axis = 0; axis < 3; axis++)
        for (int sign = -1; sign <= 1; sign += 2) {
            double there[3];
            begin();
            const struct discontinuity_sum before = jumps.sum;
            memcpy(there, here, sizeof there);
            there[axis] += sign * 12;
            CHECK(at(101, there, level));
            CHECK(!discontinuity_same(&before, &jumps.sum));
            CHECK(!discontinuity_same(&jumps.sum, &before));
            CHECK(at(102, here, level));
            CHECK(discontinuity_same(&before, &jumps.sum));
        }
}

TEST(a_turn_about_any_axis_is_one_until_it_is_taken_back)
{
    for (int axis = 0; axis < 3; axis++)
        for (int sign = -1; sign <= 1; sign += 2) {
            double turned[3];
            begin();
            const struct discontinuity_sum before = jumps.sum;
            memcpy(turned, level, sizeof turned);
            turned[axis] += sign * 80;
            CHECK(at(101, here, turned));
            CHECK(!discontinuity_same(&before, &jumps.sum));
            CHECK(at(102, here, level));
            CHECK(discontinuity_same(&before, &jumps.sum));
        }
}

TEST(what_the_vehicle_can_do_is_no_jump)
{
    double there[3];
    begin();
    const struct discontinuity_sum before = jumps.sum;
    memcpy(there, here, sizeof there);
    for (uint64_t t_s = 101; t_s < 160; t_s++) {
        there[0] += MOST_MPS * 0.7;
        there[2] -= MOST_MPS;
        CHECK(!at(t_s, there, (const double[3]){0, 0, 30 + MOST_DEGPS * (double)(t_s - 100)}));
    }
    CHECK(discontinuity_same(&before, &jumps.sum));
}

int main(void)
{
    RUN(a_jump_along_any_axis_is_one_until_it_is_taken_back);
    RUN(a_turn_about_any_axis_is_one_until_it_is_taken_back);
    RUN(what_the_vehicle_can_do_is_no_jump);
    return test_end();
}
