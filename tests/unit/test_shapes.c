/* SPDX-License-Identifier: MIT */
/* test_shapes - from pings in a room to its walls, corners and a ghost behind one of them, through the grid. */
#include "../lib/sphere_rig.h"

#include "../../grid/sphere/shapes.h"

static const double distance_m[4] = {2, 1.5, 1.2, 1.7}; /* forward, right, back, left */
static struct clusters *clusters;
static struct shapes shapes;

static void start(bool level)
{
    const struct sphere_conf conf = {.angular_step_rad = 2 * GEO_PI / 180,
                                     .level = level,
                                     .level_half_rad = 7.5 * GEO_PI / 180,
                                     .layers = {.r_max_m = 20, .dr_m = 0.05, .n_const = 20, .growth = 1.02},
                                     .max_cells = 16384,
                                     .forget_s = 60,
                                     .blocked_above = 0.6,
                                     .recentre_m = 0.1};
    rig_sphere(&conf);
    clusters = rig_clusters(&conf);
}

static struct echo echo_at(double range_m)
{
    return (struct echo){
        .range_m = (float)range_m, .near_m = (float)(range_m - 0.02), .sd_m = 0.01f, .confidence = 0.9f};
}

/* A turn of 1 degree steps; ghost_m > 0: a second echo there, straight ahead. */
static void turn(double ghost_m)
{
    for (int u = 0; u < 360; u++) {
        struct beam_echoes beam = {.az_rad = (float)geo_rad(u + 0.5), .state = BEAM_ECHO, .n = 1, .blind_m = 0.1f};
        double range = INFINITY;
        for (int w = 0; w < 4; w++) {
            const double c = cos((double)beam.az_rad - w * GEO_PI / 2);
            range = c > 1e-9 ? fmin(range, distance_m[w] / c) : range;
        }
        beam.free_to_m = (float)(range - 0.05);
        beam.echo[0] = echo_at(range);
        if (ghost_m > 0 && (u < 5 || u >= 355))
            beam.echo[beam.n++] = echo_at(ghost_m);
        const struct echoes e = {.t_ns = 1000 * SECOND,
                                 .n_beams = 1,
                                 .range_max_m = 18,
                                 .az_aperture_rad = (float)geo_rad(2),
                                 .el_aperture_rad = (float)geo_rad(25),
                                 .pose = pose_identity,
                                 .max_beams = 1,
                                 .beam = &beam};
        sphere_enter(sphere, &e, &mount_identity);
    }
}

TEST(a_room_through_the_grid)
{
    for (int level = 0; level < 2; level++) {
        start(level);
        turn(0);
        shapes_look(&shapes, sphere_picture(sphere), 1000 * SECOND);
        CHECK_INT(shapes.n, 4);
        CHECK_INT(shapes.corners, 4);
        for (uint32_t w = 0; w < shapes.n; w++) {
            const int side = (int)lround(shapes.wall[w].normal_rad / (GEO_PI / 2)) % 4;
            CHECK_NEAR(shapes.wall[w].distance_m, distance_m[side], 0, 0.06);
            CHECK(shapes.constant_depth[w]);
        }
    }
}

TEST(what_stands_a_room_length_behind_a_wall_is_suspected_and_nothing_else)
{
    static const struct {
        double behind_m;
        bool suspected;
    } row[] = {{2 + 3.2, true}, {4.0, true}, {4.6, false}, {6.5, false}};
    for (int i = 0; i < 4; i++) {
        const struct cluster *list;
        uint32_t all, suspects = 0;
        start(true);
        turn(row[i].behind_m);
        shapes_look(&shapes, sphere_picture(sphere), 1000 * SECOND);
        const uint32_t n = clusters_look(clusters, sphere, 1000 * SECOND, &list, &all);
        CHECK_INT(n, 2);
        for (uint32_t k = 0; k < n; k++) {
            const uint32_t w = shapes_ghost_of(&shapes, &list[k]);
            suspects += w != TANGENTS_NONE;
            CHECK_INT(w != TANGENTS_NONE, row[i].suspected && list[k].near_m > 3);
            if (w != TANGENTS_NONE)
                CHECK_NEAR(shapes.wall[w].distance_m, 2, 0, 0.06);
        }
        CHECK_INT(suspects, row[i].suspected);
    }
}

TEST(an_empty_picture_has_no_shapes)
{
    start(true);
    shapes_look(&shapes, sphere_picture(sphere), 1000 * SECOND);
    CHECK_INT(shapes.n, 0);
    CHECK_INT(shapes.corners, 0);
}

int main(void)
{
    RUN(a_room_through_the_grid);
    RUN(what_stands_a_room_length_behind_a_wall_is_suspected_and_nothing_else);
    RUN(an_empty_picture_has_no_shapes);
    return test_end();
}
