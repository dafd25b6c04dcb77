/* SPDX-License-Identifier: MIT */
/* test_shapes - from pings in a room to its walls, corners and a ghost behind one of them, through the grid. */
#include "tests/lib/sphere_rig.h"

#include "grid/ping.h"
#include "grid/sphere/shapes.h"

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

static double room_range(double az_rad)
{
    double range = INFINITY;
    for (int w = 0; w < 4; w++) {
        const double c = cos(az_rad - w * GEO_PI / 2);
        range = c > 1e-9 ? fmin(range, distance_m[w] / c) : range;
    }
    return range;
}

/* A turn of 1 degree steps, without those of no range; ghost_m > 0: a second echo there, straight ahead. */
static void turn_in(double (*range_at)(double az_rad), double ghost_m)
{
    for (int u = 0; u < 360; u++) {
        struct beam_echoes beam = {.az_rad = (float)geo_rad(u + 0.5), .state = BEAM_ECHO, .n = 1, .blind_m = 0.1f};
        const double range = range_at((double)beam.az_rad);
        if (isinf(range))
            continue;
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

static void turn(double ghost_m)
{
    turn_in(room_range, ghost_m);
}

static double tank_off_m; /* the sonar from the middle of a tank of 3 m, forward */

static double tank_range(double az_rad)
{
    const double along = -tank_off_m * cos(az_rad);
    return along + sqrt(along * along - tank_off_m * tank_off_m + 9);
}

TEST(a_round_tank_is_an_arc_and_from_its_middle_a_region_all_around)
{
    for (int off = 0; off < 2; off++) {
        start(true);
        tank_off_m = off;
        turn_in(tank_range, 0);
        shapes_look(&shapes, sphere_picture(sphere), 1000 * SECOND);
        CHECK_INT(shapes.n, 0);
        CHECK_INT(shapes.corners, 0);
        CHECK_INT(shapes.arcs, 1);
        CHECK_NEAR(shapes.arc[0].radius_m, 3, 0, 0.05);
        CHECK_NEAR(shapes.arc[0].centre.x_m, -off, 0, 0.05);
        CHECK_NEAR(shapes.arc[0].centre.y_m, 0, 0, 0.05);
        CHECK_NEAR(shapes.region[0].width_rad < GEO_TURN, off, 0, 0);
        CHECK(shapes.regions >= 1 && (off || shapes.regions == 1));
        CHECK_INT(shapes.region[0].wall, TANGENTS_NONE);
        for (uint32_t k = 0; k < shapes.regions; k++) {
            const struct shapes_region *r = &shapes.region[k];
            CHECK(r->width_rad >= geo_rad(6) * (1 - 1e-9));
            CHECK_NEAR(r->width_rad, r->bearings * geo_rad(2), 1e-9, 0);
            CHECK(r->most_m - r->least_m <= 0.06 + 0.02 * r->most_m);
            CHECK(k == 0 || r->bearings <= shapes.region[k - 1].bearings);
        }
        if (off) { /* straight ahead and astern the wall is met squarely */
            bool ahead = false, astern = false;
            for (uint32_t k = 0; k < shapes.regions; k++) {
                const struct shapes_region *r = &shapes.region[k];
                const double middle = geo_wrap_pi(r->from_rad + r->width_rad / 2);
                ahead |= fabs(middle) < geo_rad(3) && fabs(r->least_m - 2) < 0.05;
                astern |= fabs(middle) > geo_rad(177) && fabs(r->most_m - 4) < 0.05;
            }
            CHECK(ahead && astern);
        }
    }
}

TEST(each_wall_of_a_room_has_its_region)
{
    start(true);
    turn(0);
    shapes_look(&shapes, sphere_picture(sphere), 1000 * SECOND);
    bool has[SHAPES_WALLS] = {false};
    for (uint32_t k = 0; k < shapes.regions; k++)
        if (shapes.region[k].wall != TANGENTS_NONE) {
            const struct shapes_region *r = &shapes.region[k];
            CHECK(r->wall < shapes.n);
            has[r->wall] = true;
            CHECK_NEAR(r->least_m, shapes.wall[r->wall].distance_m, 0, 0.12);
        }
    for (uint32_t w = 0; w < shapes.n; w++)
        CHECK_INT(has[w], shapes.constant_depth[w]);
    CHECK_INT(shapes.arcs, 0);
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

#define BLURRED_RAD geo_rad(8)

/* A hall four times as large, of which nothing is heard near its corners, whatever the wall. */
static double hall_range(double az_rad)
{
    for (int w = 0; w < 4; w++) {
        const double *next = &distance_m[(w + 1) % 4];
        if (fabs(geo_wrap_pi(az_rad - w * GEO_PI / 2 - atan2(*next, distance_m[w]))) < BLURRED_RAD)
            return INFINITY;
    }
    return 4 * room_range(az_rad);
}

TEST(walls_meet_in_corners_near_which_nothing_is_heard)
{
    start(true);
    turn_in(hall_range, 0);
    shapes_look(&shapes, sphere_picture(sphere), 1000 * SECOND);
    CHECK_INT(shapes.n, 4);
    CHECK_INT(shapes.corners, 4);
}

/* ---- basins drawn at random ---- */

#define BASINS 60

/* Walls at distance[k] in direction k pi / 2; the vehicle's heading among them. */
struct basin {
    double distance[4], heading_rad;
};

static struct basin draw_basin(uint64_t *dice)
{
    struct basin b = {.heading_rad = GEO_TURN * test_uniform(dice)};
    for (int axis = 0; axis < 2; axis++) {
        const double length = 3 + 9 * test_uniform(dice), share = 0.15 + 0.7 * test_uniform(dice);
        b.distance[axis] = share * length;
        b.distance[axis + 2] = (1 - share) * length;
    }
    return b;
}

static double basin_range(const struct basin *b, double az_rad)
{
    double range = INFINITY;
    for (int w = 0; w < 4; w++) {
        const double c = cos(az_rad - w * GEO_PI / 2);
        range = c > 1e-9 ? fmin(range, b->distance[w] / c) : range;
    }
    return range;
}

/* Near normal: the sum of twelve. */
static double normal(uint64_t *dice)
{
    double sum = -6;
    for (int k = 0; k < 12; k++)
        sum += test_uniform(dice);
    return sum;
}

/* Two turns of 400 pings, 20 a second; the vehicle yaws so far to and fro in 8 s, its compass is off by half a degree
 * and ranges by 2 cm. */
static void listen(const struct basin *b, double yaw_rad, uint64_t *dice)
{
    for (unsigned u = 0; u < 800; u++) {
        const double yaw = b->heading_rad + yaw_rad * sin(GEO_TURN * u * 0.05 / 8);
        struct beam_echoes beam = {
            .az_rad = (float)(GEO_TURN * u / 400), .state = BEAM_ECHO, .n = 1, .blind_m = 0.1f};
        struct echoes e = {.t_ns = 1000 * SECOND + u * (SECOND / 20),
                           .seq = u,
                           .flags = u % 400 ? 0 : PING_NEW_TURN,
                           .n_beams = 1,
                           .range_max_m = 18,
                           .az_aperture_rad = (float)geo_rad(2),
                           .el_aperture_rad = (float)geo_rad(25),
                           .pose = pose_identity,
                           .max_beams = 1,
                           .beam = &beam};
        beam.echo[0] = echo_at(basin_range(b, yaw + (double)beam.az_rad) + 0.02 * normal(dice));
        beam.free_to_m = beam.echo[0].near_m;
        e.pose.has = POSE_ATTITUDE;
        quat_from_rpy(0, 0, yaw + geo_rad(0.5) * normal(dice), e.pose.attitude);
        sphere_enter(sphere, &e, &mount_identity);
    }
}

struct count {
    unsigned walls, no_walls, corners, no_corners;
};

static void count_walls(const struct basin *b, struct count *n)
{
    bool found[4] = {false};
    for (uint32_t w = 0; w < shapes.n; w++) {
        const struct wall *wall = &shapes.wall[w];
        const unsigned side = (unsigned)lround(wall->normal_rad / (GEO_PI / 2)) % 4;
        const bool is_one = fabs(geo_wrap_pi(wall->normal_rad - side * GEO_PI / 2)) < geo_rad(8) &&
                            fabs(wall->distance_m - b->distance[side]) < 0.1 + 0.02 * b->distance[side];
        n->walls += is_one && !found[side];
        n->no_walls += !is_one || found[side];
        found[side] |= is_one;
    }
}

static void count_corners(const struct basin *b, struct count *n)
{
    bool found[4] = {false};
    for (uint32_t k = 0; k < shapes.corners; k++) {
        const struct tangent_point *p = &shapes.corner[k].place;
        const unsigned which = (p->x_m < 0 ? 1u : 0u) + (p->y_m < 0 ? 2u : 0u);
        const double x = p->x_m < 0 ? -b->distance[2] : b->distance[0],
                     y = p->y_m < 0 ? -b->distance[3] : b->distance[1];
        const bool is_one = hypot(p->x_m - x, p->y_m - y) < 0.2 + 0.03 * hypot(x, y);
        n->corners += is_one && !found[which];
        n->no_corners += !is_one || found[which];
        found[which] |= is_one;
    }
}

/* A rate over basins, for a wall that spans a few directions may be missed. */
TEST(basins_show_their_walls_and_corners_standing_and_yawing)
{
    uint64_t dice = test_seed();
    for (int yaws = 0; yaws < 2; yaws++) {
        struct count n = {0};
        for (int k = 0; k < BASINS; k++) {
            const struct basin b = draw_basin(&dice);
            start(false);
            listen(&b, yaws ? geo_rad(25) : 0, &dice);
            shapes_look(&shapes, sphere_picture(sphere), 1040 * SECOND);
            count_walls(&b, &n);
            count_corners(&b, &n);
        }
        printf("# %s, %d basins: %u walls of %d, %u that are none; %u corners of %d, %u that are none\n",
               yaws ? "yawing by 25 degrees" : "standing", BASINS, n.walls, 4 * BASINS, n.no_walls, n.corners,
               4 * BASINS, n.no_corners);
        CHECK(n.walls >= 4 * BASINS * 0.94);
        CHECK(n.corners >= 4 * BASINS * 0.85);
        CHECK(n.no_walls <= 4 * BASINS * 0.02);
        CHECK(n.no_corners <= 4 * BASINS * 0.02);
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
    CHECK_INT(shapes.arcs, 0);
    CHECK_INT(shapes.regions, 0);
}

int main(void)
{
    RUN(a_round_tank_is_an_arc_and_from_its_middle_a_region_all_around);
    RUN(each_wall_of_a_room_has_its_region);
    RUN(a_room_through_the_grid);
    RUN(walls_meet_in_corners_near_which_nothing_is_heard);
    RUN(basins_show_their_walls_and_corners_standing_and_yawing);
    RUN(what_stands_a_room_length_behind_a_wall_is_suspected_and_nothing_else);
    RUN(an_empty_picture_has_no_shapes);
    return test_end();
}
