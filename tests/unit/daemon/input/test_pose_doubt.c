/* SPDX-License-Identifier: MIT */
/* test_pose_doubt - poses that are allowed and hardly meant are told once. */
#include "tests/lib/test.h"

#include "daemon/input/pose_doubt.h"

#define SECOND 1000000000ull

/* How often it is told in so many seconds at 10 Hz, turning by so much a second from there. */
static int told_in(struct pose_doubt *doubt, unsigned seconds, double from, double per_s)
{
    int told = 0;
    for (unsigned k = 0; k < 10 * seconds; k++) {
        const double rpy[3] = {0.05, -0.1, from + per_s * k / 10};
        told += pose_doubt_attitude(doubt, rpy, 5 * SECOND + k * SECOND / 10);
    }
    return told;
}

TEST(small_angles_for_a_minute_are_told_once)
{
    struct pose_doubt doubt = {0};
    CHECK_INT(told_in(&doubt, 59, -3, 0.1), 0);
    doubt = (struct pose_doubt){0};
    CHECK_INT(told_in(&doubt, 600, 0, 0.01), 1);
}

TEST(who_has_given_degrees_is_not_doubted)
{
    struct pose_doubt doubt = {0};
    CHECK_INT(told_in(&doubt, 5, 90, 1), 0);
    CHECK_INT(told_in(&doubt, 600, 0, 0), 0);
}

TEST(a_depth_above_the_surface_is_told_when_it_begins)
{
    struct pose_doubt doubt = {0};
    CHECK(!pose_doubt_depth(&doubt, 5) && !pose_doubt_depth(&doubt, -0.5));
    CHECK(pose_doubt_depth(&doubt, -5));
    CHECK(!pose_doubt_depth(&doubt, -6));
    CHECK(!pose_doubt_depth(&doubt, 6));
    CHECK(pose_doubt_depth(&doubt, -1.5));
}

int main(void)
{
    RUN(small_angles_for_a_minute_are_told_once);
    RUN(who_has_given_degrees_is_not_doubted);
    RUN(a_depth_above_the_surface_is_told_when_it_begins);
    return test_end();
}
