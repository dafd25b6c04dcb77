/* SPDX-License-Identifier: MIT */
/*
 * test_sight - how old an answer is: as old as the water that was asked about, whatever stands nearer or farther; and
 * what is left of it to a vehicle that moves on without a ping. And a glance says what a look does.
 */
#include "tests/lib/picture_rig.h"

#include "grid/answer/sight.h"

#define SLIVER_S 12 /* what a few older pings freed beyond both ends of the newest: its age */
#define FRESH_S  2
#define BEGIN_M  0.275
#define END_M    8.0

static uint64_t seed;

static const struct answer_conf asked = {.clear_for_s = 30, .move_limit_m = INFINITY};

static uint64_t ago(double seconds)
{
    return NOW - (uint64_t)(seconds * 1e9);
}

/* Every direction: free water as the last ping saw it, and one older bin of it at both ends. */
static void start(double sliver_s)
{
    start_with(rings_full(&rings, geo_rad(5)), true);
    const struct picture_entry e = {
        .free = {{.t_ping_ns = ago(FRESH_S), .from_m = (float)BEGIN_M, .to_m = (float)END_M},
                 {.t_ping_ns = ago(sliver_s), .from_m = 0.267f, .to_m = (float)BEGIN_M},
                 {.t_ping_ns = ago(sliver_s), .from_m = (float)END_M, .to_m = 8.01f}}};
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++)
        picture_set(&picture, d, &e);
    picture_end(&picture);
}

static struct answer cone(double near_m, double to_m)
{
    struct answer a;
    const struct answer_query q = {.ned = true, .distance_m = to_m, .half_angle_rad = 0.1, .near_m = near_m};
    answer_direction(&picture, &asked, &now, &q, &a);
    return a;
}

static struct answer sector(double near_m, double to_m)
{
    struct answer a[4];
    const struct answer_band band = {
        .ned = true, .lo_rad = -0.1, .hi_rad = 0.1, .reach_m = to_m, .near_m = near_m, .count = 4};
    answer_sectors(&picture, &asked, &now, &band, a);
    return a[0];
}

TEST(an_answer_is_as_old_as_the_water_asked_about)
{
    static const struct {
        double near_m, to_m, age_s;
    } row[] = {
        {0.7, 5, FRESH_S},      /* from the vehicle on, and not as far as was heard */
        {0.7, 8.005, SLIVER_S}, /* the older end is asked about */
        {0.2, 5, SLIVER_S},     /* so is the older beginning */
        {0, 5, SLIVER_S},       {0.27, 0.272, SLIVER_S},
        {0.7, 0.5, SLIVER_S}, /* nothing but the vehicle's own: as old as any of it */
    };
    start(SLIVER_S);
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        const struct answer c = cone(row[i].near_m, row[i].to_m), s = sector(row[i].near_m, row[i].to_m);
        CHECK_INT(c.state, ANSWER_CLEAR);
        CHECK_INT(s.state, ANSWER_CLEAR);
        CHECK_NEAR(c.age_s, row[i].age_s, 0, 1e-9);
        CHECK_NEAR(s.age_s, row[i].age_s, 0, 1e-9);
        CHECK_NEAR(c.confidence, 1 - row[i].age_s / asked.clear_for_s, 0, 1e-9);
    }
}

/* An older bin beside the last ping's water takes nothing from it when it is too old, and a vehicle that has moved
 * asks for so much more. */
TEST(what_is_too_old_ends_the_water_there_alone)
{
    start(asked.clear_for_s + 1);
    const struct answer a = cone(0, 5);
    CHECK_INT(a.state, ANSWER_CLEAR);
    CHECK_NEAR(a.age_s, FRESH_S, 0, 1e-9);
    CHECK_NEAR(a.blind_to_m, BEGIN_M, 0, 1e-6);
    CHECK_NEAR(a.free_to_m, END_M, 0, 1e-6);
    CHECK_INT(cone(0, 8.005).state, ANSWER_UNKNOWN);
    start(SLIVER_S);
    now.pose.uncertain_m = 0.3;
    CHECK_NEAR(cone(1, 5).age_s, FRESH_S, 0, 1e-9);
    CHECK_NEAR(cone(0.5, 5).age_s, SLIVER_S, 0, 1e-9);
}

/* Without a ping the vehicle goes ahead: all is shorter by its way and the error of that, until that is a jump. */
TEST(water_stays_free_while_no_ping_comes)
{
    for (double way_m = 0; way_m < POSE_STEP_MOST_M; way_m += 0.09) {
        start(asked.clear_for_s + 1);
        now.pose.position_m[0] = now.pose.path_m = way_m;
        const double less_m = way_m * (1 + POSE_WAY_ERROR);
        const struct answer c = cone(0, 5), s = sector(0, 5);
        CHECK_INT(c.state, ANSWER_CLEAR);
        CHECK_INT(s.state, ANSWER_CLEAR);
        CHECK_NEAR(c.free_to_m, END_M - less_m, 0, 1e-6);
        CHECK_NEAR(s.free_to_m, END_M - less_m, 0, 1e-6);
        CHECK_INT(cone(0, END_M - less_m + 1e-3).state, ANSWER_UNKNOWN);
    }
    start(SLIVER_S);
    now.pose.position_m[0] = POSE_STEP_MOST_M + 1e-3;
    const struct answer a = cone(0, 5);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
    CHECK_INT(a.reason, ANSWER_MOVED);
}

/* ---- by how much less is free: term by term ---- */

/* What makes the water shorter at its end, and begin later, by a metre's share each. */
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
    start(asked.clear_for_s + 1);
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

TEST(each_doubt_of_the_place_takes_from_both_ends_of_the_water)
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
        start(asked.clear_for_s + 1);
        take_doubt(&row[i]);
        const struct answer c = cone(0, 5), s = sector(0, 5);
        CHECK_INT(c.state, ANSWER_CLEAR);
        CHECK_INT(s.state, ANSWER_CLEAR);
        CHECK_NEAR(c.free_to_m, END_M - row[i].less_m, 0, 1e-6);
        CHECK_NEAR(s.free_to_m, END_M - row[i].less_m, 0, 1e-6);
        CHECK(c.blind_to_m >= BEGIN_M + row[i].less_m - 1e-6);
        CHECK_NEAR(s.blind_to_m, BEGIN_M + row[i].less_m, 0, 1e-6);
        start_walled();
        take_doubt(&row[i]);
        CHECK_INT(sector(0, WALL_M - row[i].less_m - 1e-3).state, ANSWER_CLEAR);
        const struct answer b = sector(0, WALL_M - row[i].less_m + 1e-3);
        CHECK_INT(b.state, ANSWER_BLOCKED);
        CHECK_NEAR(b.range_m, WALL_M + WALL_DEEP_M - row[i].less_m, 0, 1e-6);
        CHECK_NEAR(b.confidence, 1 / (1 + exp(-3)), 1e-6, 0);
    }
}

/* Where the vehicle has been lost nothing is clear from here; another number than the picture's is enough. */
TEST(poses_withdrawn_or_an_attitude_that_jumped_leave_nothing_clear)
{
    for (int which = 0; which < 3; which++) {
        start(SLIVER_S);
        now.pose.withdrawn = which == 1;
        now.pose.discontinuities = which == 2;
        const enum answer_state want = which ? ANSWER_UNKNOWN : ANSWER_CLEAR;
        CHECK_INT(cone(0, 5).state, want);
        CHECK_INT(sector(0, 5).state, want);
        CHECK_INT(cone(0, 5).reason, which ? ANSWER_MOVED : ANSWER_HEARD);
    }
}

/* A grid of level sonars keeps 15 degrees up and down; all of it is free. */
static void start_level(double pitch_deg, double uncertain_deg)
{
    start_with(rings_level(&rings, geo_rad(5), geo_rad(15)), true);
    const struct picture_entry e = {.free[0] = {.t_ping_ns = ago(FRESH_S), .to_m = (float)END_M}};
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++)
        picture_set(&picture, d, &e);
    picture_end(&picture);
    quat_from_rpy(0, geo_rad(pitch_deg), 0, now.pose.attitude);
    now.pose.uncertain_rad = geo_rad(uncertain_deg);
}

static struct answer between(double lo_deg, double hi_deg, bool ned)
{
    struct answer a[4];
    const struct answer_band band = {
        .ned = ned, .lo_rad = geo_rad(lo_deg), .hi_rad = geo_rad(hi_deg), .reach_m = 5, .count = 4};
    answer_sectors(&picture, &asked, &now, &band, a);
    return a[1];
}

TEST(no_sector_is_clear_that_reaches_beyond_the_grid)
{
    static const struct {
        double lo_deg, hi_deg, pitch_deg, uncertain_deg;
        bool body, clear;
    } row[] = {
        {-15, 15, 0, 0, false, true}, {-16, 15, 0, 0, false, false}, {-15, 16, 0, 0, false, false},
        {5, 60, 0, 0, false, false},  {-60, -5, 0, 0, false, false}, {50, 70, 0, 0, false, false},
        {-5, 5, 20, 0, false, true},  {-5, 5, 9, 0, true, true},     {-5, 1, 11, 0, true, false},
        {-1, 5, 11, 0, true, false},  {-5, 5, 1, 8, true, true},     {-5, 1, 1, 10, true, false},
        {-1, 5, 1, 10, true, false},
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        start_level(row[i].pitch_deg, row[i].uncertain_deg);
        const struct answer a = between(row[i].lo_deg, row[i].hi_deg, !row[i].body);
        CHECK_INT(a.state, row[i].clear ? ANSWER_CLEAR : ANSWER_UNKNOWN);
        CHECK_INT(a.reason, row[i].clear ? ANSWER_HEARD : ANSWER_OUTSIDE);
    }
}

/* Two obstacles in one cone: what the older one has faded by is not the newer one's. */
TEST(an_obstacle_fades_from_its_own_time_on)
{
    for (int newer = 0; newer < 2; newer++) {
        start(SLIVER_S);
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
        const struct answer a = cone(0, 6);
        CHECK_INT(a.state, ANSWER_BLOCKED);
        CHECK_NEAR(a.range_m, WALL_M + WALL_DEEP_M + newer, 0, 1e-6);
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
    start(SLIVER_S);
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
        start(SLIVER_S);
        quat_from_rpy(0, 0, 0.3, now.pose.attitude);
        sight_to_grid(&frame, &now, row[i].asked_ned, v);
        CHECK_NEAR(atan2(v[1], v[0]), row[i].az_rad, 0, 1e-12);
        sight_from_grid(&frame, &now, row[i].asked_ned, v);
        CHECK_NEAR(atan2(v[1], v[0]), 0, 0, 1e-12);
    }
}

/* ---- a glance against a look ---- */

#define PICTURES 60

static double uniform(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

static bool one_in(double n)
{
    return test_uniform(&seed) * n < 1;
}

/* One free interval or several, or none; obstacles in any order; all of it fresh, or not. */
static struct picture_entry any_entry(void)
{
    struct picture_entry e = {.hint_m = one_in(4) ? (float)uniform(0.1, 10) : 0};
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (k == 0 ? !one_in(6) : one_in(6))
            e.free[k] = (struct free_interval){.t_ping_ns = ago(uniform(-1, 32)),
                                               .path_m = uniform(-0.3, 0),
                                               .from_m = (float)uniform(0, 1),
                                               .to_m = one_in(9) ? -1 : (float)uniform(0.2, 12),
                                               .sensors = one_in(4) ? 2 : 1};
    for (int k = 0; k < PICTURE_OBSTACLES && one_in(2); k++)
        e.obstacle[k] = (struct picture_obstacle){.t_ref_ns = ago(uniform(0, 60)),
                                                  .t_echo_ns = ago(uniform(0, 20)),
                                                  .logodds = (float)uniform(-0.5, 4),
                                                  .near_m = (float)uniform(0.2, 12),
                                                  .range_m = 12,
                                                  .sd_m = 0.1f};
    return e;
}

static void any_picture(void)
{
    start_with(rings_full(&rings, geo_rad(10)), !one_in(4));
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++) {
        const struct picture_entry e = any_entry();
        if (!one_in(9))
            picture_set(&picture, d, &e);
    }
    picture_end(&picture);
    now.lost = one_in(2) ? 2 : 0;
    now.pose.position_m[0] = one_in(3) ? uniform(-0.3, 0.3) : one_in(9) ? POSE_STEP_MOST_M + 1 : 0;
    now.pose.path_m = one_in(3) ? uniform(0, 0.3) : 0;
    now.pose.uncertain_m = one_in(2) ? uniform(0, 0.3) : 0;
    now.pose.drift_m[0] = one_in(3) ? uniform(0, 0.3) : 0;
    now.pose.altitude_m = uniform(0, 8);
    now.pose.has |= one_in(2) ? POSE_ALTITUDE : 0u;
}

/* Has it one free interval, the nearest obstacle first? Then a glance has to be enough. */
static bool is_simple(const struct picture_entry *e)
{
    for (int k = 1; k < FREE_INTERVALS; k++)
        if (e->free[k].t_ping_ns)
            return false;
    return e->obstacle[1].logodds <= 0;
}

TEST(a_glance_says_what_a_look_does)
{
    const struct answer_conf conf = {.clear_for_s = 30, .move_limit_m = 0.5};
    uint64_t seen = 0, differ = 0, missed = 0, nearer = 0;
    seed = test_seed();
    for (int i = 0; i < PICTURES; i++) {
        struct picture_frame frame;
        struct sight_place place;
        any_picture();
        picture_get_frame(&picture, &frame);
        sight_locate(&picture, &frame, &conf, &now, &place);
        const struct sight_observer by = {&conf, &now, &place, uniform(0, 1), uniform(0, 12), NULL};
        for (uint32_t d = 0; d < rings.n; d++) {
            struct picture_entry e;
            struct sight look, glance;
            picture_get(&picture, d, &e);
            const bool simple = is_simple(&e), told = sight_glance(&picture, d, &by, &glance);
            sight_look(&picture, d, &by, &e, &look);
            missed += simple && !told;
            if (!told)
                continue;
            seen++;
            differ += glance.reason != look.reason || glance.clear_m != look.clear_m ||
                      glance.blind_m != look.blind_m || glance.age_s != look.age_s ||
                      glance.bottom_m != look.bottom_m;
            nearer += look.obstacle && look.near_m < glance.near_m;
        }
    }
    CHECK(seen > 1000);
    CHECK_INT(differ, 0);
    CHECK_INT(missed, 0);
    CHECK_INT(nearer, 0);
}

int main(void)
{
    RUN(an_answer_is_as_old_as_the_water_asked_about);
    RUN(what_is_too_old_ends_the_water_there_alone);
    RUN(water_stays_free_while_no_ping_comes);
    RUN(each_doubt_of_the_place_takes_from_both_ends_of_the_water);
    RUN(poses_withdrawn_or_an_attitude_that_jumped_leave_nothing_clear);
    RUN(no_sector_is_clear_that_reaches_beyond_the_grid);
    RUN(an_obstacle_fades_from_its_own_time_on);
    RUN(what_changed_while_it_was_read_is_read_again);
    RUN(a_place_swings_to_where_it_is_nearest);
    RUN(a_direction_is_turned_into_the_grids_axes_and_back);
    RUN(a_glance_says_what_a_look_does);
    return test_end();
}
