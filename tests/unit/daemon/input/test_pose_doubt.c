/* SPDX-License-Identifier: MIT */
/* test_pose_doubt - poses that are allowed and hardly meant are told once, and poses that may well be meant never. */
#include "tests/lib/test.h"

#include "daemon/input/pose_doubt.h"
#include "grid/geometry.h"

#define SECOND 1000000000ull

/* A level vehicle for ten minutes: its heading, in whatever unit, at each time. */
typedef double heading_at(double t_s);

static double north(double t_s)
{
    return 0 * t_s;
}

static double drifting(double t_s)
{
    return -6 + 0.02 * t_s;
}

static double steady(double t_s)
{
    return 3.1 + 0 * t_s;
}

static double yawing(double t_s)
{
    return 3.2 * sin(t_s / 3);
}

static double yawing_fast(double t_s)
{
    return 6 * sin(3 * t_s);
}

static double from_side_to_side(double t_s)
{
    return fmod(t_s, 4) < 2 ? 3.15 : -3.15;
}

static double noisy(double t_s)
{
    return 2 * sin(1e4 * t_s * t_s) + 2 * sin(2e4 * t_s * t_s + 1);
}

/* One correction of a compass by 6.2 degrees. */
static double corrected(double t_s)
{
    return t_s < 300 ? 3 : -3.2;
}

static double turning(double t_s)
{
    return fmod(t_s, 360);
}

static double radians(double t_s)
{
    return remainder(0.1 * t_s, GEO_TURN);
}

static double radians_from_zero_backward(double t_s)
{
    return fmod(1000 * GEO_TURN - 0.1 * t_s, GEO_TURN);
}

static double radians_around_south(double t_s)
{
    return remainder(M_PI + 0.3 * sin(t_s), GEO_TURN);
}

static const struct {
    const char *name;
    heading_at *at;
    int told;
} courses[] = {
    {"north", north, 0},
    {"drifting past north", drifting, 0},
    {"steady", steady, 0},
    {"yawing", yawing, 0},
    {"yawing fast", yawing_fast, 0},
    {"from side to side", from_side_to_side, 0},
    {"noisy", noisy, 0},
    {"corrected", corrected, 0},
    {"turning", turning, 0},
    {"turning in radians", radians, 1},
    {"turning back in radians from 0", radians_from_zero_backward, 1},
    {"around south in radians", radians_around_south, 0}, /* nothing shows it */
};

static int told_in(struct pose_doubt *doubt, heading_at *at, unsigned seconds, unsigned per_s)
{
    int told = 0;
    for (unsigned k = 0; k < per_s * seconds; k++) {
        const double rpy[3] = {0.05, -0.1, at((double)k / per_s)};
        told += pose_doubt_attitude(doubt, rpy, 5 * SECOND + k * SECOND / per_s);
    }
    return told;
}

TEST(only_what_goes_round_the_circle_below_two_pi_is_told)
{
    for (size_t i = 0; i < sizeof courses / sizeof *courses; i++)
        for (unsigned per_s = 1; per_s <= 50; per_s *= per_s == 1 ? 10 : 5) {
            struct pose_doubt doubt = {0};
            const int told = told_in(&doubt, courses[i].at, 600, per_s);
            if (told != courses[i].told) {
                printf("%s at %u Hz: told %d times\n", courses[i].name, per_s, told);
                test_case_failed = true;
            }
        }
}

TEST(who_has_given_degrees_is_not_doubted)
{
    struct pose_doubt doubt = {0};
    CHECK_INT(told_in(&doubt, turning, 10, 10), 0);
    CHECK_INT(told_in(&doubt, radians, 600, 10), 0);
}

TEST(headings_with_a_gap_between_them_are_no_turn)
{
    struct pose_doubt doubt = {0};
    int told = 0;
    for (unsigned k = 0; k < 100; k++)
        told += pose_doubt_attitude(&doubt, (const double[3]){0, 0, radians(k)}, (5 + 3 * k) * SECOND);
    CHECK_INT(told, 0);
}

TEST(a_depth_above_the_surface_is_told_when_it_begins)
{
    struct pose_doubt doubt = {0};
    CHECK(!pose_doubt_depth(&doubt, 0.5) && !pose_doubt_depth(&doubt, -0.5));
    CHECK(pose_doubt_depth(&doubt, -5));
    CHECK(!pose_doubt_depth(&doubt, -6));
    CHECK(!pose_doubt_depth(&doubt, 0));
    CHECK(pose_doubt_depth(&doubt, -1.5));
}

/* It has dived: its depths have the right sign, and it is lifted out. */
TEST(a_depth_above_the_surface_after_a_dive_is_one)
{
    struct pose_doubt doubt = {0};
    CHECK(!pose_doubt_depth(&doubt, 20) && !pose_doubt_depth(&doubt, 0));
    CHECK(!pose_doubt_depth(&doubt, -5));
}

int main(void)
{
    RUN(only_what_goes_round_the_circle_below_two_pi_is_told);
    RUN(who_has_given_degrees_is_not_doubted);
    RUN(headings_with_a_gap_between_them_are_no_turn);
    RUN(a_depth_above_the_surface_is_told_when_it_begins);
    RUN(a_depth_above_the_surface_after_a_dive_is_one);
    return test_end();
}
