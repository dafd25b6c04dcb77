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

/* A weak echo as well, nearer than an obstacle or alone. */
TEST(each_doubt_of_the_place_brings_weak_echoes_nearer)
{
    for (int behind = 0; behind < 2; behind++)
        for (double at_m = 0.6; at_m < 4; at_m += 0.7) {
            start();
            picture_begin(&picture);
            for (uint32_t d = 0; d < rings.n; d++) {
                struct picture_entry e = {.hint_m = (float)at_m};
                if (behind)
                    e.obstacle[0] = obstacle_at(WALL_M);
                picture_set(&picture, d, &e);
            }
            picture_end(&picture);
            now.pose.uncertain_m = 0.2;
            now.pose.position_m[1] = 0.3;
            struct obstacles_found found[4];
            struct obstacles_query q = {
                .line = {.ned = true, .distance_m = 5, .half_angle_rad = 0.1, .near_m = 5}};
            find_obstacles(&picture, &limits, &now, &q, found);
            CHECK_NEAR(found[0].hint_m, at_m - 0.5, 0, 1e-6);
            q = (struct obstacles_query){
                .around = true,
                .band = {.ned = true, .lo_rad = -0.1, .hi_rad = 0.1, .reach_m = 3, .near_m = 5, .count = 4}};
            find_obstacles(&picture, &limits, &now, &q, found);
            for (int k = 0; k < 4 && at_m < 3.4; k++)
                CHECK_NEAR(found[k].hint_m, at_m - 0.5, 0, 1e-6);
        }
}

/* From where the centre is, wherever that is. */
TEST(the_vehicle_is_off_the_centre_by_the_difference_of_both_places)
{
    const struct picture_frame frame = {.ned = true, .centre_m = {3, -5, 7}, .path_m = 2};
    struct sight_place place;
    start();
    memcpy(now.pose.position_m, (double[]){3.3, -4.6, 7}, sizeof now.pose.position_m);
    now.pose.path_m = 2.5;
    sight_locate(&frame, &limits, &now, &place);
    CHECK_NEAR(place.offset_m[0], 0.3, 0, 1e-9);
    CHECK_NEAR(place.offset_m[1], 0.4, 0, 1e-9);
    CHECK_NEAR(place.offset_m[2], 0, 0, 1e-9);
    CHECK_NEAR(place.uncertain_m, 0.5 * POSE_WAY_ERROR, 0, 1e-9);
    CHECK_NEAR(place.moved_m, 0.5 + 0.5 * POSE_WAY_ERROR, 0, 1e-9);
    now.pose.heading_radps = 0.001; /* for as long as water is clear */
    sight_locate(&frame, &limits, &now, &place);
    CHECK_NEAR(place.adrift_rad, 0.001 * limits.clear_for_s, 0, 1e-9);
    CHECK_NEAR(place.adrift_cos, cos(place.adrift_rad), 0, 1e-12);
    CHECK_NEAR(place.adrift_sin, sin(place.adrift_rad), 0, 1e-12);
}

TEST(a_pose_that_is_no_number_is_none)
{
    double *const part[] = {&now.pose.drift_m[0],    &now.pose.drift_m[1],    &now.pose.position_m[0],
                            &now.pose.position_m[1], &now.pose.position_m[2], &now.pose.uncertain_m,
                            &now.pose.uncertain_rad, &now.pose.heading_radps};
    for (size_t i = 0; i < sizeof part / sizeof *part; i++)
        for (int k = 0; k < 3; k++)
            for (int ned = 0; ned < 2; ned++) {
                const struct picture_frame frame = {.ned = (uint64_t)ned, .pings = 1};
                enum answer_reason why;
                start();
                *part[i] = k == 0 ? 0.01 : k == 1 ? (double)INFINITY : (double)NAN;
                const bool good = k == 0 || (!ned && i > 1); /* without an attitude a drift is all that counts */
                CHECK(sight_possible(&frame, &now, false, &why) == good);
                CHECK_INT(why, good ? ANSWER_HEARD : ANSWER_POSE_LOST);
                CHECK(sight_possible(&frame, &now, true, &why) == (good && ned));
                CHECK_INT(why, !good ? ANSWER_POSE_LOST : ned ? ANSWER_HEARD : ANSWER_NO_FRAME);
            }
    start();
    now.pose_fresh = false;
    for (int ned = 0; ned < 2; ned++) {
        const struct picture_frame frame = {.ned = (uint64_t)ned, .pings = 1}, none = {.ned = (uint64_t)ned};
        enum answer_reason why;
        CHECK(sight_possible(&frame, &now, false, &why) == !ned);
        CHECK(!sight_possible(&none, &now, false, &why));
        CHECK_INT(why, ANSWER_NO_DATA);
    }
}

TEST(a_cell_reaches_to_its_farthest_corner)
{
    for (double width_deg = 2; width_deg < 16; width_deg += 3.3) {
        CHECK(rings_full(&rings, geo_rad(width_deg)));
        for (uint32_t ring = 0; ring < rings.n_rings; ring++) {
            double az, el, middle[3], farthest = 0;
            rings_centre(&rings, rings.start[ring], &az, &el);
            geo_direction(az, el, middle);
            for (int k = 0; k < 4; k++) {
                double corner[3];
                geo_direction(az + (k % 2 ? 1 : -1) * rings_width(&rings, ring) / 2,
                              el + (k / 2 ? 1 : -1) * rings.height_rad / 2, corner);
                farthest = fmax(farthest, acos(fmax(-1, fmin(geo_dot(middle, corner), 1))));
            }
            CHECK_NEAR(sight_cell_reach(&rings, ring), farthest, 0, 1e-6);
        }
    }
}

TEST(a_vehicle_is_tilted_up_to_standing_on_its_head)
{
    for (int roll_deg = -180; roll_deg <= 180; roll_deg += 15) {
        double q[4];
        quat_from_rpy(geo_rad(roll_deg), 0, 1, q);
        CHECK_NEAR(geo_deg(sight_tilt(q)), abs(roll_deg), 0, 1e-5);
        quat_from_rpy(0, geo_rad(roll_deg), -2, q);
        CHECK_NEAR(geo_deg(sight_tilt(q)), abs(roll_deg), 0, 1e-5);
    }
}

TEST(a_grid_to_the_poles_keeps_what_reaches_beyond_them)
{
    CHECK(rings_full(&rings, geo_rad(5)));
    CHECK(sight_keeps(&rings, -2, 2) && sight_keeps(&rings, -GEO_PI / 2, GEO_PI / 2));
    CHECK(rings_level(&rings, geo_rad(5), geo_rad(15)));
    CHECK(sight_keeps(&rings, geo_rad(-15), geo_rad(15)) && !sight_keeps(&rings, -2, 0) &&
          !sight_keeps(&rings, 0, 2));
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

TEST(what_changed_while_it_was_read_is_read_again)
{
    start();
    struct sight_reading once = {.picture = &picture}, twice = once, restless = once, turning = once;
    CHECK(sight_reads(&once) && !sight_reads(&once));
    CHECK(sight_reads(&twice));
    turn_axes(0);
    CHECK(sight_reads(&twice) && !sight_reads(&twice));
    int n = 0, turned = 0;
    for (; n < 99 && sight_reads(&restless); n++)
        turn_axes(0);
    CHECK(n > 1 && n < 99);
    for (; turned < 99 && sight_reads(&turning); turned++)
        turn_axes(0.01 * (turned + 1));
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
    RUN(each_doubt_of_the_place_brings_weak_echoes_nearer);
    RUN(the_vehicle_is_off_the_centre_by_the_difference_of_both_places);
    RUN(a_pose_that_is_no_number_is_none);
    RUN(a_cell_reaches_to_its_farthest_corner);
    RUN(a_vehicle_is_tilted_up_to_standing_on_its_head);
    RUN(a_grid_to_the_poles_keeps_what_reaches_beyond_them);
    RUN(a_band_that_reaches_beyond_the_grid_is_not_all_known);
    RUN(an_obstacle_fades_from_its_own_time_on);
    RUN(what_changed_while_it_was_read_is_read_again);
    RUN(a_place_swings_to_where_it_is_nearest);
    RUN(a_direction_is_turned_into_the_grids_axes_and_back);
    return test_end();
}
