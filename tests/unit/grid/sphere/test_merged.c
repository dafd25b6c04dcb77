/* SPDX-License-Identifier: MIT */
/* test_merged - two cells that fall together when the vehicle has moved: which of what both knew is kept. */
#include "tests/lib/sphere_rig.h"
#include "grid/sphere/view.h"

static const struct sphere_conf conf = {.angular_step_rad = 2 * GEO_PI / 180,
                                        .level = true,
                                        .level_half_rad = 7.5 * GEO_PI / 180,
                                        .layers = {.r_max_m = 60, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                        .max_cells = 4096,
                                        .forget_s = 1e6,
                                        .blocked_above = 0.6,
                                        .recentre_m = 0.1};

/* One echo ahead, of a beam that says nothing of the water before it. */
static void hear(double range_m, double confidence, double sd_m, uint64_t t_ns)
{
    struct beam_echoes beam = {.az_rad = (float)geo_rad(1), .state = BEAM_ECHO, .n = 1};
    beam.echo[0] = (struct echo){.range_m = (float)range_m,
                                 .near_m = (float)(range_m - 0.02),
                                 .sd_m = (float)sd_m,
                                 .confidence = (float)confidence};
    const struct echoes e = {.t_ns = t_ns,
                             .n_beams = 1,
                             .range_max_m = 60,
                             .az_aperture_rad = (float)geo_rad(1),
                             .el_aperture_rad = (float)geo_rad(25),
                             .pose = now.pose,
                             .max_beams = 1,
                             .beam = &beam};
    sphere_enter(sphere, &e, &mount_identity);
}

/* Back by `to_m`, with beams astern that hear nothing. */
static void move_back(double to_m, uint64_t t_ns)
{
    for (double at_m = 0; at_m > -to_m; at_m -= 0.5) {
        struct beam_echoes beam = {.az_rad = (float)geo_rad(180), .state = BEAM_BLIND};
        struct echoes e = {.t_ns = t_ns,
                           .n_beams = 1,
                           .range_max_m = 60,
                           .az_aperture_rad = (float)geo_rad(1),
                           .el_aperture_rad = (float)geo_rad(25),
                           .pose = now.pose,
                           .max_beams = 1,
                           .beam = &beam};
        e.pose.position_m[0] = at_m * cos(geo_rad(1));
        e.pose.position_m[1] = at_m * sin(geo_rad(1));
        e.pose.path_m = -at_m;
        sphere_enter(sphere, &e, &mount_identity);
    }
}

static uint32_t cells_ahead(uint64_t t_ns, struct sphere_cell *first)
{
    struct sphere_cell c;
    uint32_t k = 0;
    for (; sphere_cell(sphere, rings_index(sphere_picture(sphere)->rings, geo_rad(1), 1e-6), k, t_ns, &c); k++)
        if (k == 0)
            *first = c;
    return k;
}

TEST(the_surer_the_newer_and_the_larger_doubt_are_kept_whichever_is_nearer)
{
    static const struct {
        double near_confidence, far_confidence, near_sd_m, far_sd_m;
        uint64_t near_ns, far_ns;
    } row[] = {
        {0.9, 0.3, 0.01, 0.03, 2 * SECOND, 3 * SECOND},
        {0.3, 0.9, 0.03, 0.01, 3 * SECOND, 2 * SECOND},
        {0.3, 0.9, 0.01, 0.03, 3 * SECOND, 2 * SECOND},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct sphere_cell near = {0}, one = {0};
        const uint64_t then_ns = 4 * SECOND;
        rig_sphere(&conf);
        now.pose = pose_identity;
        now.pose.has = POSE_ATTITUDE | POSE_POSITION;
        const double first_m = 4.0, second_m = 4.2;
        if (row[i].near_ns < row[i].far_ns)
            hear(first_m, row[i].near_confidence, row[i].near_sd_m, row[i].near_ns);
        hear(second_m, row[i].far_confidence, row[i].far_sd_m, row[i].far_ns);
        if (row[i].near_ns > row[i].far_ns)
            hear(first_m, row[i].near_confidence, row[i].near_sd_m, row[i].near_ns);
        CHECK_INT(cells_ahead(then_ns, &near), 2);
        move_back(20, then_ns);
        CHECK_INT(cells_ahead(then_ns, &one), 1);
        CHECK_NEAR(one.logodds, log1p(4 * fmax(row[i].near_confidence, row[i].far_confidence)), 1e-3, 0);
        CHECK_INT(one.echoes, 2);
        CHECK_INT(one.t_echo_ns, 3 * SECOND);
        CHECK_NEAR((double)one.t_first_ns, 2e9, 0, 2e6);
        CHECK_NEAR(one.point_m[0], 24 * cos(geo_rad(1)), 0, 0.6);
        CHECK(one.near_m < first_m - 0.02 + 20);
        struct picture_entry e;
        picture_get(sphere_picture(sphere), rings_index(sphere_picture(sphere)->rings, geo_rad(1), 1e-6), &e);
        /* a hundredth of the way beside it */
        CHECK_NEAR(e.obstacle[0].sd_m, fmax(row[i].near_sd_m, row[i].far_sd_m) + 0.2, 0, 0.006);
        if (test_case_failed)
            printf("(row %zu: %u cells)\n", i, cells_ahead(then_ns, &one));
    }
}

int main(void)
{
    RUN(the_surer_the_newer_and_the_larger_doubt_are_kept_whichever_is_nearer);
    return test_end();
}
