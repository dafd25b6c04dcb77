/* SPDX-License-Identifier: MIT */
/*
 * test_sight - how old an answer is: as old as the water that was asked about, whatever stands nearer or farther; and
 * what is left of it to a vehicle that moves on without a ping. And a glance says what a look does.
 */
#include "tests/lib/picture_rig.h"

#include "grid/answer/nearest.h"
#include "grid/answer/sight.h"

#define SLIVER_S 12 /* what a few older pings freed beyond both ends of the newest: its age */
#define FRESH_S  2
#define BEGIN_M  0.275
#define END_M    8.0

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

static struct nearest nearest(double near_m, double to_m)
{
    struct nearest n;
    const struct nearest_query q = {.ned = true, .lo_rad = -1, .hi_rad = 1, .reach_m = to_m, .near_m = near_m};
    nearest_look(&picture, &asked, &now, &q, &n);
    return n;
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
        const struct nearest n = nearest(row[i].near_m, row[i].to_m);
        CHECK_INT(c.state, ANSWER_CLEAR);
        CHECK_INT(s.state, ANSWER_CLEAR);
        CHECK_INT(n.state, ANSWER_CLEAR);
        CHECK_NEAR(c.age_s, row[i].age_s, 0, 1e-9);
        CHECK_NEAR(s.age_s, row[i].age_s, 0, 1e-9);
        CHECK_NEAR(n.age_s, row[i].age_s, 0, 1e-9);
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
        CHECK_INT(nearest(0, 5).state, ANSWER_CLEAR);
        CHECK_NEAR(c.free_to_m, END_M - less_m, 0, 1e-6);
        CHECK_NEAR(s.free_to_m, END_M - less_m, 0, 1e-6);
        CHECK_INT(cone(0, END_M - less_m + 1e-3).state, ANSWER_UNKNOWN);
    }
    start(SLIVER_S);
    now.pose.position_m[0] = POSE_STEP_MOST_M + 1e-3;
    const struct answer a = cone(0, 5);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
    CHECK_INT(a.reason, ANSWER_MOVED);
    CHECK_INT(nearest(0, 5).state, ANSWER_UNKNOWN);
}

/* ---- a glance against a look ---- */

#define PICTURES 60

static uint64_t seed;

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
    RUN(a_glance_says_what_a_look_does);
    return test_end();
}
