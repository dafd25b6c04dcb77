/* SPDX-License-Identifier: MIT */
/*
 * test_sight - how near obstacles are to a vehicle whose place is doubtful, when they fade, and how directions turn.
 */
#include "tests/lib/picture_rig.h"

#include "grid/answer/sight.h"
#include "tests/lib/way_rig.h"

static uint64_t seed;

static uint64_t ago(double seconds)
{
    return NOW - (uint64_t)(seconds * 1e9);
}

static void start(void)
{
    start_with(rings_full(&rings, geo_rad(5)), true);
}

static struct obstacles_found sector(double to_m)
{
    struct obstacles_found found[4];
    find_obstacles(
        &picture, &limits, &now,
        &(struct obstacles_query){
            .around = true, .band = {.ned = true, .lo_rad = -0.1, .hi_rad = 0.1, .reach_m = to_m, .count = 4}},
        found);
    return found[0];
}

static struct obstacles_found cone(double to_m)
{
    struct obstacles_found found;
    find_obstacles(&picture, &limits, &now,
                   &(struct obstacles_query){.line = {.ned = true, .distance_m = to_m, .half_angle_rad = 0.1}},
                   &found);
    return found;
}

/* ---- by how much nearer all is: term by term ---- */

/* What brings obstacles nearer. */
struct doubt {
    double place_m[3], path_m, uncertain_m, drift_m[2], heading_radps;
    double less_m;
};

static void take_doubt(const struct doubt *d)
{
    memcpy(now.pose.position_m, d->place_m, sizeof d->place_m);
    memcpy(now.pose.drift_m, d->drift_m, sizeof d->drift_m);
    now.pose.path_m = d->path_m;
    now.pose.uncertain_m = d->uncertain_m;
    now.pose.heading_radps = d->heading_radps;
}

#define WALL_M      4.0 /* where it may begin ... */
#define WALL_DEEP_M 0.1 /* ... and how far behind that its echo is */

static struct picture_obstacle obstacle_at(double near_m)
{
    return (struct picture_obstacle){.t_ref_ns = NOW,
                                     .t_echo_ns = NOW,
                                     .logodds = 3,
                                     .near_m = (float)near_m,
                                     .range_m = (float)(near_m + WALL_DEEP_M),
                                     .sd_m = 0.05f};
}

/* With a wall all around, and another one behind it. */
static void start_walled(void)
{
    start();
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++) {
        struct picture_entry e;
        picture_get(&picture, d, &e);
        e.obstacle[0] = obstacle_at(WALL_M);
        e.obstacle[1] = obstacle_at(WALL_M + 2);
        picture_set(&picture, d, &e);
    }
    picture_end(&picture);
}

TEST(each_doubt_of_the_place_brings_obstacles_nearer)
{
    static const struct doubt row[] = {
        {.less_m = 0},
        {.place_m = {0.3, 0, 0}, .less_m = 0.3},
        {.place_m = {0, 0.3, 0}, .less_m = 0.3},
        {.place_m = {0, 0, 0.3}, .less_m = 0.3},
        {.path_m = 0.4, .less_m = 0.4 * POSE_WAY_ERROR},
        {.uncertain_m = 0.2, .less_m = 0.2},
        {.drift_m = {0.25, 0}, .less_m = 0.25},
        {.drift_m = {0, 0.25}, .less_m = 0.25},
        {.drift_m = {0.3, 0.4}, .less_m = 0.5},
        {.place_m = {0.3, 0, 0}, .heading_radps = 0.001, .less_m = 0.3 + 0.3 * 0.001 * 30},
        {.place_m = {0.3, 0, 0},
         .path_m = 0.4,
         .uncertain_m = 0.2,
         .drift_m = {0.25, 0},
         .less_m = 0.3 + 0.4 * POSE_WAY_ERROR + 0.2 + 0.25},
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        start_walled();
        take_doubt(&row[i]);
        const struct obstacles_found c = cone(5), s = sector(5);
        CHECK_NEAR(c.near_m, WALL_M - row[i].less_m, 0, 1e-6);
        CHECK_NEAR(s.near_m, WALL_M - row[i].less_m, 0, 1e-6);
        CHECK_NEAR(s.range_m, WALL_M + WALL_DEEP_M - row[i].less_m, 0, 1e-6);
        CHECK_NEAR(s.confidence, 1 / (1 + exp(-3)), 1e-6, 0);
        CHECK(!cone(WALL_M - row[i].less_m - 1e-3).any);
    }
}

/* A grid of level sonars keeps 15 degrees up and down. */
static void start_level(double pitch_deg, double uncertain_deg)
{
    start_with(rings_level(&rings, geo_rad(5), geo_rad(15)), true);
    quat_from_rpy(0, geo_rad(pitch_deg), 0, now.pose.attitude);
    now.pose.uncertain_rad = geo_rad(uncertain_deg);
}

static enum answer_reason between(double lo_deg, double hi_deg, bool ned)
{
    struct obstacles_found found[4];
    return find_obstacles(
        &picture, &limits, &now,
        &(struct obstacles_query){
            .around = true,
            .band = {.ned = ned, .lo_rad = geo_rad(lo_deg), .hi_rad = geo_rad(hi_deg), .reach_m = 5, .count = 4}},
        found);
}

TEST(a_band_that_reaches_beyond_the_grid_is_not_all_known)
{
    static const struct {
        double lo_deg, hi_deg, pitch_deg, uncertain_deg;
        bool body, kept;
    } row[] = {
        {-15, 15, 0, 0, false, true}, {-16, 15, 0, 0, false, false}, {-15, 16, 0, 0, false, false},
        {5, 60, 0, 0, false, false},  {-60, -5, 0, 0, false, false}, {50, 70, 0, 0, false, false},
        {-5, 5, 20, 0, false, true},  {-5, 5, 9, 0, true, true},     {-5, 1, 11, 0, true, false},
        {-1, 5, 11, 0, true, false},  {-5, 5, 1, 8, true, true},     {-5, 1, 1, 10, true, false},
        {-1, 5, 1, 10, true, false},
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        start_level(row[i].pitch_deg, row[i].uncertain_deg);
        CHECK_INT(between(row[i].lo_deg, row[i].hi_deg, !row[i].body),
                  row[i].kept ? ANSWER_HEARD : ANSWER_OUTSIDE);
    }
}

/* Two obstacles in one cone: what the older one has faded by is not the newer one's. */
TEST(an_obstacle_fades_from_its_own_time_on)
{
    for (int newer = 0; newer < 2; newer++) {
        start();
        const uint32_t d = rings_index(&rings, 0, 0);
        for (uint32_t k = 0; k < 2; k++) {
            struct picture_entry e;
            picture_get(&picture, d + k, &e);
            e.obstacle[0] = obstacle_at(WALL_M + k);
            e.obstacle[0].t_ref_ns = ago(k == (uint32_t)newer ? 0 : 600);
            picture_begin(&picture);
            picture_set(&picture, d + k, &e);
            picture_end(&picture);
        }
        CHECK_NEAR(cone(6).range_m, WALL_M + WALL_DEEP_M + newer, 0, 1e-6);
    }
}

/* As a ping would; the axes turn with it. */
static void change_picture(double axes_rad)
{
    struct picture_frame frame;
    picture_get_frame(&picture, &frame);
    frame.axes_rad = axes_rad;
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
}

TEST(what_changed_while_it_was_read_is_read_again)
{
    start();
    struct sight_reading once = {.picture = &picture}, twice = once, restless = once, turning = once;
    CHECK(sight_reads(&once) && !sight_reads(&once));
    CHECK(sight_reads(&twice));
    change_picture(0);
    CHECK(sight_reads(&twice) && !sight_reads(&twice));
    int n = 0, turned = 0;
    for (; n < 99 && sight_reads(&restless); n++)
        change_picture(0);
    CHECK(n > 1 && n < 99);
    for (; turned < 99 && sight_reads(&turning); turned++)
        change_picture(0.01 * (turned + 1));
    CHECK_INT(turned, 99); /* never ends with what was read under two sets of axes */
}

/* Of all that a drifting heading makes of a place the one that is nearest to another direction. */
TEST(a_place_swings_to_where_it_is_nearest)
{
    seed = test_seed();
    for (int i = 0; i < 500; i++) {
        const double adrift = test_uniform(&seed) * GEO_PI;
        const struct sight_place place = {
            .adrift_rad = adrift, .adrift_cos = cos(adrift), .adrift_sin = sin(adrift)};
        const double az = GEO_TURN * test_uniform(&seed), level = 3 * test_uniform(&seed);
        double to[3], v[3] = {level * cos(az), level * sin(az), 0.7}, best = -INFINITY;
        geo_direction(GEO_TURN * test_uniform(&seed), i % 10 ? 0.3 : GEO_PI / 2, to);
        to[0] = i % 10 ? to[0] : 0; /* straight up: nothing to swing to */
        to[1] = i % 10 ? to[1] : 0;
        for (int k = -100; k <= 100; k++) {
            const double turned = az + adrift * k / 100;
            best = fmax(best, level * (cos(turned) * to[0] + sin(turned) * to[1]));
        }
        sight_swing(&place, to, v);
        CHECK_NEAR(hypot(v[0], v[1]), level, 1e-9, 0);
        CHECK_NEAR(v[2], 0.7, 0, 0);
        const double got = v[0] * to[0] + v[1] * to[1];
        CHECK(got >= best - 1e-9 && got <= best + 2e-3);
    }
}

/* The grid's axes are turned by 0.5 against north, the body by 0.3. */
TEST(a_direction_is_turned_into_the_grids_axes_and_back)
{
    static const struct {
        bool grid_ned, asked_ned;
        double axes_rad, az_rad; /* of north, or of ahead, in the grid */
    } row[] = {{true, true, 0.5, -0.5}, {true, false, 0.5, -0.2}, {true, true, 0, 0},
               {true, false, 0, 0.3},   {false, true, 0.5, 0},    {false, false, 0.5, 0}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        const struct picture_frame frame = {.ned = row[i].grid_ned, .axes_rad = row[i].axes_rad};
        double v[3] = {1, 0, 0};
        start();
        quat_from_rpy(0, 0, 0.3, now.pose.attitude);
        sight_to_grid(&frame, &now, row[i].asked_ned, v);
        CHECK_NEAR(atan2(v[1], v[0]), row[i].az_rad, 0, 1e-12);
        sight_from_grid(&frame, &now, row[i].asked_ned, v);
        CHECK_NEAR(atan2(v[1], v[0]), 0, 0, 1e-12);
    }
}

int main(void)
{
    RUN(each_doubt_of_the_place_brings_obstacles_nearer);
    RUN(a_band_that_reaches_beyond_the_grid_is_not_all_known);
    RUN(an_obstacle_fades_from_its_own_time_on);
    RUN(what_changed_while_it_was_read_is_read_again);
    RUN(a_place_swings_to_where_it_is_nearest);
    RUN(a_direction_is_turned_into_the_grids_axes_and_back);
    return test_end();
}
