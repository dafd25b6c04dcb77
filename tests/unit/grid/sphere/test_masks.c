/* SPDX-License-Identifier: MIT */
/*
 * test_masks - which cells an echo changes and by how much, read from the grid's cells and held against eq. (1) written
 * out here: the deviation in range is the echo's own or range_error times the range, whichever is more.
 */
#include "tests/lib/sphere_rig.h"
#include "grid/sphere/view.h"

#define DEEP_M 0.05 /* of a layer */

static struct sphere_conf usual(void)
{
    return (struct sphere_conf){.angular_step_rad = 2 * GEO_PI / 180,
                                .level = true,
                                .level_half_rad = 7.5 * GEO_PI / 180,
                                .layers = {.r_max_m = 30, .dr_m = DEEP_M, .n_const = 1000, .growth = 1},
                                .max_cells = 4096,
                                .forget_s = 160,
                                .blocked_above = 0.6,
                                .recentre_m = 0.1,
                                .model = SPHERE_GAUSS};
}

static uint32_t direction(double az_deg)
{
    return rings_index(sphere_picture(sphere)->rings, geo_rad(az_deg), 1e-6);
}

/* One echo along the middle of the direction at 1 degree. */
static void hear(double range_m, double sd_m)
{
    struct beam_echoes beam = {.az_rad = (float)geo_rad(1), .state = BEAM_ECHO, .n = 1};
    beam.echo[0] = (struct echo){
        .range_m = (float)range_m, .near_m = (float)(range_m - 0.02), .sd_m = (float)sd_m, .confidence = 0.9f};
    const struct echoes e = {.t_ns = SECOND,
                             .n_beams = 1,
                             .range_max_m = 30,
                             .az_aperture_rad = (float)geo_rad(2),
                             .el_aperture_rad = (float)geo_rad(25),
                             .pose = pose_identity,
                             .max_beams = 1,
                             .beam = &beam};
    sphere_enter(sphere, &e, &mount_identity);
}

static double mass(double from_m, double to_m, double sd_m)
{
    return (erf(to_m / (sd_m * sqrt(2))) - erf(from_m / (sd_m * sqrt(2)))) / 2;
}

/* Cells of the direction that are not as eq. (1) with this deviation has them, and how many there are. */
static int wrong_cells(double range_m, double sd_m, double reach, int *cells)
{
    const double at = (double)(float)range_m, middle_m = floor(at / DEEP_M) * DEEP_M;
    const double most = mass(middle_m - at, middle_m + DEEP_M - at, sd_m);
    struct sphere_cell c;
    int wrong = 0;
    for (*cells = 0; sphere_cell(sphere, direction(1), (uint32_t)*cells, SECOND, &c); ++*cells) {
        const double share = fmin(mass(c.from_m - at, c.to_m - at, sd_m) / most, 1);
        wrong += !(fabs(c.logodds - log1p((double)0.9f * share * 4)) < 1e-5);
        wrong += c.to_m < at - reach * sd_m - 1e-6 || c.from_m > at + reach * sd_m + 1e-6;
    }
    return wrong;
}

TEST(an_echo_is_shared_out_in_range_by_its_deviation)
{
    static const struct {
        double range_m, sd_m, range_error, want_m;
    } row[] = {
        {10.013, 0.05, 0, 0.05},    {10.013, 0.05, 0.003, 0.05},   {10.013, 0.05, 0.01, 0.10013},
        {5.013, 0.05, 0.005, 0.05}, {20.013, 0.05, 0.01, 0.20013}, {20.013, 0.1, 0.005, 0.100065},
        {2.013, 0.01, 0.1, 0.2013},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct sphere_conf conf = usual();
        int cells;
        conf.range_error = row[i].range_error;
        rig_sphere(&conf);
        hear(row[i].range_m, row[i].sd_m);
        CHECK_INT(wrong_cells(row[i].range_m, row[i].want_m, 2, &cells), 0);
        const double at = (double)(float)row[i].range_m, reach_m = 2 * row[i].want_m;
        CHECK_INT(cells, floor((at + reach_m) / DEEP_M - 1e-6) - floor((at - reach_m) / DEEP_M + 1e-6) + 1);
        if (test_case_failed)
            printf("(%g m, sd %g m, error %g)\n", row[i].range_m, row[i].sd_m, row[i].range_error);
    }
}

/* A second echo in a cell is the same reflector within three standard deviations of their difference, and moves the
 * point to the mean; farther off it is another one, and the nearer stays. */
TEST(the_gate_is_three_deviations)
{
    static const double apart[] = {0.1, 0.9, 0.99, 1.01, 1.5};
    for (size_t i = 0; i < sizeof apart / sizeof apart[0]; i++) {
        struct sphere_conf conf = usual();
        struct sphere_cell c;
        conf.model = SPHERE_OPENING;
        conf.layers = (struct layers_conf){.r_max_m = 30, .dr_m = 4, .n_const = 2, .growth = 1};
        rig_sphere(&conf);
        /* a cell of 15 degrees' height: across it, 3 m away, the place is uniform */
        const double range_m = 4.1, wide_m = range_m * geo_rad(15), gate_m = 3 * sqrt(2) * wide_m / sqrt(12);
        hear(range_m + apart[i] * gate_m, 0.01);
        hear(range_m, 0.01);
        CHECK(sphere_cell(sphere, direction(1), 0, SECOND, &c));
        CHECK_INT(c.echoes, 2);
        CHECK_NEAR(geo_length(c.point_m), range_m + (apart[i] < 1 ? apart[i] * gate_m / 2 : 0), 0, 1e-3);
        if (test_case_failed)
            printf("(%g gates apart: at %g m)\n", apart[i], geo_length(c.point_m));
    }
}

/* Echoes of the layers around, of how many directions around: all within the reach and none beyond. */
TEST(a_mask_reaches_as_far_as_it_is_told)
{
    static const double reach[] = {1.2, 1.5, 2, 0, 3, 4};
    for (size_t i = 0; i < sizeof reach / sizeof reach[0]; i++) {
        struct sphere_conf conf = usual();
        const double deviations = reach[i] > 0 ? reach[i] : 2, reach_m = deviations * 0.05;
        const double at = (double)(float)10.013, sd_az = geo_rad(1) / sqrt(2 * log(2));
        struct sphere_cell c;
        int cells, directions = 0, wanted = 0;
        conf.mask_reach = reach[i];
        rig_sphere(&conf);
        hear(at, 0.05);
        CHECK_INT(wrong_cells(at, 0.05, deviations, &cells), 0);
        CHECK_INT(cells, floor((at + reach_m) / DEEP_M) - floor((at - reach_m) / DEEP_M) + 1);
        for (int k = -20; k <= 20; k++) {
            directions += sphere_cell(sphere, direction(1 + 2 * k), 0, SECOND, &c);
            wanted += fabs(geo_rad(2 * k)) <= deviations * sd_az + geo_rad(1);
        }
        CHECK_INT(directions, wanted);
        if (test_case_failed)
            printf("(reach %g)\n", reach[i]);
    }
}

TEST(a_reach_within_the_opening_or_far_beyond_is_refused)
{
    static const double bad[] = {1.19, 4.01, -1, NAN, INFINITY};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct sphere_conf conf = usual();
        struct fault fault = {""};
        conf.mask_reach = bad[i];
        CHECK_INT(sphere_bytes(&conf, &fault), 0);
        CHECK(strstr(fault.text, "mask reach"));
    }
}

int main(void)
{
    RUN(the_gate_is_three_deviations);
    RUN(a_mask_reaches_as_far_as_it_is_told);
    RUN(a_reach_within_the_opening_or_far_beyond_is_refused);
    RUN(an_echo_is_shared_out_in_range_by_its_deviation);
    return test_end();
}
