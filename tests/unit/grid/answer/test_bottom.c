/* SPDX-License-Identifier: MIT */
/* test_bottom - nothing is free below a bottom whose height is known, whatever beams found there. */
#include "tests/lib/ask_both.h"
#include "tests/lib/picture_rig.h"

#include "grid/answer/bottom.h"

static uint64_t seed;

static double uniform(double lo, double hi)
{
    return lo + (hi - lo) * ((double)(test_random(&seed) >> 11) * 0x1p-53);
}

static double surely_m(double altitude_m)
{
    return altitude_m * (1 - BOTTOM_ALTITUDE_SHARE) - BOTTOM_ALTITUDE_M;
}

/* Where the lowest ray meets a bottom that rises by the slope assumed, by walking along it. */
static double walk_m(double down_m, double down_rad)
{
    const double slope = tan(geo_rad(BOTTOM_SLOPE_DEG));
    double lo_m = 0, hi_m = 1e4;
    if (hi_m * sin(down_rad) < down_m - hi_m * cos(down_rad) * slope)
        return INFINITY;
    for (int i = 0; i < 100; i++) {
        const double m = (lo_m + hi_m) / 2;
        if (m * sin(down_rad) < down_m - m * cos(down_rad) * slope)
            lo_m = m;
        else
            hi_m = m;
    }
    return lo_m;
}

TEST(a_ray_reaches_the_bottom_where_geometry_has_it)
{
    seed = test_seed();
    for (int i = 0; i < 2000; i++) {
        const double altitude_m = uniform(0, 30), down_rad = uniform(-1.2, 1.2);
        const struct bottom b = bottom_below(altitude_m, 0, 0);
        const double reach_m = bottom_reach_m(&b, sin(down_rad));
        const double there_m = walk_m(fmax(surely_m(altitude_m), 0), down_rad);
        CHECK(isinf(there_m) ? reach_m > 9e3 : fabs(reach_m - there_m) <= 1e-6 + 1e-9 * there_m);
    }
}

TEST(less_is_free_where_less_is_known)
{
    seed = test_seed();
    for (int i = 0; i < 2000; i++) {
        const double altitude_m = uniform(0, 30), down = uniform(-1, 1);
        const struct bottom b = bottom_below(altitude_m, 0, 0), lower = bottom_below(altitude_m, -0.3, 0),
                            beside = bottom_below(altitude_m, 0, 2);
        const double reach_m = bottom_reach_m(&b, down);
        CHECK(reach_m >= 0);
        CHECK(bottom_reach_m(&lower, down) <= reach_m);
        CHECK(bottom_reach_m(&beside, down) <= reach_m);
    }
    const struct bottom on_it = bottom_below(0, 0, 0);
    CHECK_NEAR(bottom_reach_m(&on_it, 0.5), 0, 0, 0);
}

/* Straight down from a place 0.3 m higher and 2 m beside: the bottom may have risen by the slope on the way there. */
TEST(the_way_beside_may_be_uphill)
{
    const struct bottom b = bottom_below(5, 0.3, 2);
    const double down_m = surely_m(5) + 0.3 - 2 * tan(geo_rad(BOTTOM_SLOPE_DEG));
    CHECK_NEAR(bottom_reach_m(&b, 1), down_m * cos(geo_rad(BOTTOM_SLOPE_DEG)), 1e-12, 0);
}

#define BEAMS  60
#define NEAR_M 0.75

static struct store *store;

/* What lies ahead was observed free to 20 m from 20 degrees up to straight down, by beams that hear no mud. */
static void start(bool ned, double altitude_m)
{
    static const struct store_conf conf = {.beams = {BEAMS}, .spare = 1};
    static void *memory;
    struct beam_echoes beam[BEAMS];
    start_with(rings_full(&rings, geo_rad(3)), ned);
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    now.pose.has = (ned ? POSE_ATTITUDE : 0u) | POSE_POSITION | POSE_DEPTH | POSE_ALTITUDE;
    now.pose.altitude_m = altitude_m;
    for (int i = 0; i < BEAMS; i++)
        beam[i] = (struct beam_echoes){
            .az_rad = (float)geo_rad((i - (BEAMS - 1) / 2.0) * 2.5), .blind_m = 0.3f, .free_to_m = 20};
    for (int down_deg = 0; down_deg <= 90; down_deg += 15) {
        struct echoes e = {.t_ns = NOW - SECOND + (unsigned long long)down_deg,
                           .seq = (uint32_t)down_deg,
                           .n_beams = BEAMS,
                           .range_max_m = 20,
                           .az_aperture_rad = (float)geo_rad(2.5),
                           .el_aperture_rad = (float)geo_rad(40),
                           .pose = now.pose,
                           .beam = beam};
        struct mount mount = mount_identity;
        quat_from_rpy(0, geo_rad(-down_deg), 0, mount.attitude);
        store_enter(store, &e, &mount);
    }
}

static struct answer answer_to(const struct obstacles_query *q)
{
    return *verdict_of(ask_both(&(struct asker){&picture, store, &limits, &now}, q, NEAR_M), 0);
}

static struct answer ask(double el_deg, double distance_m, bool ned)
{
    return answer_to(&(struct obstacles_query){
        .line = {.el_rad = geo_rad(el_deg), .ned = ned, .distance_m = distance_m, .near_m = NEAR_M}});
}

/* No free water below it: the tile that is asked about may point lower by some of a degree. */
static void check_cap(double el_deg, double altitude_m)
{
    const struct answer a = ask(el_deg, 15, true);
    const double lowest_deg = fmin(3 + BOTTOM_SLOPE_DEG - el_deg, 90);
    CHECK_INT(a.state, ANSWER_UNKNOWN);
    CHECK_INT(a.reason, ANSWER_BOTTOM);
    CHECK(a.free_to_m < altitude_m / sin(geo_rad(-el_deg)));
    CHECK(a.free_to_m > 0.95 * surely_m(altitude_m) / sin(geo_rad(lowest_deg)));
    CHECK_INT(ask(el_deg, 0.99 * a.free_to_m, true).state, ANSWER_CLEAR);
}

TEST(a_cone_ends_at_the_bottom_and_says_so)
{
    static const double el_deg[] = {-20, -45, -80, -90};
    for (size_t i = 0; i < sizeof el_deg / sizeof *el_deg; i++) {
        start(true, 4);
        check_cap(el_deg[i], 4);
    }
    start(true, 4);
    CHECK_INT(ask(10, 15, true).state, ANSWER_CLEAR);
    now.pose.has &= ~(unsigned)POSE_ALTITUDE;
    CHECK_INT(ask(-80, 15, true).state, ANSWER_CLEAR);
}

TEST(a_vehicle_that_is_tilted_has_the_bottom_ahead)
{
    start(true, 3);
    quat_from_rpy(0, geo_rad(-40), 0, now.pose.attitude);
    const struct answer a = ask(0, 15, false);
    CHECK(a.state == ANSWER_UNKNOWN && a.reason == ANSWER_BOTTOM);
    CHECK(a.free_to_m > 3 && a.free_to_m < 3 / sin(geo_rad(40)));
    const double sure_m = a.free_to_m;
    now.pose.uncertain_rad = 0.1;
    CHECK(ask(0, 15, false).free_to_m < sure_m - 0.2);
}

TEST(the_bottom_is_as_far_below_the_grids_centre_as_below_the_vehicle_and_what_it_has_sunk)
{
    start(true, 3);
    const double level_m = ask(-60, 15, true).free_to_m;
    now.pose.position_m[2] = 0.2; /* sunk, and so much nearer */
    now.pose.altitude_m = 2.8;
    CHECK_NEAR(ask(-60, 15, true).free_to_m, level_m - 0.2, 0, 0.01);
    now.pose.uncertain_m = 0.3;
    CHECK(ask(-60, 15, true).free_to_m < level_m - 0.5); /* nearer, and lower */
}

/* Without an attitude nobody knows which way is down. */
TEST(the_body_has_no_down)
{
    start(false, 1);
    CHECK_INT(ask(-60, 15, false).state, ANSWER_CLEAR);
}

TEST(sectors_end_there_too)
{
    start(true, 1);
    const struct answer ahead = answer_to(&(struct obstacles_query){
        .around = true,
        .band = {.ned = true, .lo_rad = -0.17, .hi_rad = 0.17, .reach_m = 10, .near_m = NEAR_M, .count = 8}});
    CHECK(ahead.state == ANSWER_UNKNOWN && ahead.reason == ANSWER_BOTTOM);
    CHECK(ahead.free_to_m > 2 && ahead.free_to_m < 1 / sin(0.17));
}

/* An obstacle stays one, whatever is below it; the bottom itself is none. */
TEST(the_bottom_neither_blocks_nor_hides)
{
    start(true, 2);
    struct picture_entry e = {
        .obstacle[0] = {
            .t_ref_ns = NOW, .t_echo_ns = NOW, .logodds = 4, .near_m = 3.9f, .range_m = 4, .sd_m = 0.05f}};
    picture_begin(&picture);
    picture_set(&picture, rings_index(&rings, 0, geo_rad(-60)), &e);
    picture_end(&picture);
    CHECK_INT(ask(-60, 15, true).state, ANSWER_BLOCKED);
    CHECK_NEAR(ask(-60, 15, true).range_m, 4, 0, 1e-6);
    CHECK_INT(ask(-60, 3, true).state, ANSWER_UNKNOWN);
}

int main(void)
{
    RUN(a_ray_reaches_the_bottom_where_geometry_has_it);
    RUN(less_is_free_where_less_is_known);
    RUN(the_way_beside_may_be_uphill);
    RUN(a_cone_ends_at_the_bottom_and_says_so);
    RUN(a_vehicle_that_is_tilted_has_the_bottom_ahead);
    RUN(the_bottom_is_as_far_below_the_grids_centre_as_below_the_vehicle_and_what_it_has_sunk);
    RUN(the_body_has_no_down);
    RUN(sectors_end_there_too);
    RUN(the_bottom_neither_blocks_nor_hides);
    return test_end();
}
