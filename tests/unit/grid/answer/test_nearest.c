/* SPDX-License-Identifier: MIT */
/*
 * test_nearest - the nearest obstacle of a picture made by hand, against a plain search on random ones, and how much of
 * the water before it records do not have.
 */
#include "grid/answer/nearest.h"
#include "tests/lib/looks_rig.h"

#define FANS    3
#define BEAMS   42 /* of each */
#define OWN_M   0.5
#define NEAR_M  1.0
#define HEARD_M 9.0

static const struct store_conf conf = {.beams = {BEAMS, BEAMS, BEAMS}, .spare = 1};
static struct store *store;
static struct store_list list;
static struct beam_echoes beam[BEAMS];
static struct echoes ping;

/* Fans of 42 beams of 3 degrees, 25 degrees high, that hear nothing up to 10 m. */
static void start(bool ned)
{
    static void *memory;
    start_with(rings_full(&rings, geo_rad(4)), ned);
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    now.pose.has = ned ? POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH : 0;
    ping = (struct echoes){.n_beams = BEAMS,
                           .t_ns = NOW - SECOND,
                           .range_max_m = 10,
                           .az_aperture_rad = (float)geo_rad(3),
                           .el_aperture_rad = (float)geo_rad(25),
                           .beam = beam};
    for (int i = 0; i < BEAMS; i++)
        beam[i] = (struct beam_echoes){
            .az_rad = (float)geo_rad((i - (BEAMS - 1) / 2.0) * 3), .blind_m = 0.75f, .free_to_m = 10};
}

/* By fans side by side, the first of them ahead, age_s ago. */
static void send(int fans, double age_s)
{
    for (int i = 0; i < fans; i++) {
        struct mount mount = mount_identity;
        quat_from_rpy(0, 0, i * GEO_TURN / FANS, mount.attitude);
        ping.sensor = (uint8_t)i;
        ping.seq++;
        ping.t_ns = NOW - (uint64_t)(age_s * 1e9);
        ping.pose = now.pose;
        ping.pose.t_ns = ping.t_ns;
        store_enter(store, &ping, &mount);
    }
}

static void put(uint32_t d, double near_m, double age_s)
{
    const uint64_t t_ns = NOW - (uint64_t)(age_s * 1e9);
    struct picture_entry e = {0};
    e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = t_ns,
                                              .t_echo_ns = t_ns,
                                              .logodds = 4,
                                              .near_m = (float)near_m,
                                              .range_m = (float)near_m + 0.1f,
                                              .sd_m = 0.05f};
    picture_begin(&picture);
    picture_set(&picture, d, &e);
    picture_end(&picture);
}

static uint32_t at(double az_deg, double el_deg)
{
    return rings_index(&rings, geo_rad(az_deg), geo_rad(el_deg));
}

static struct nearest answer(const struct nearest_query *query)
{
    static struct verdict v;
    struct nearest_look look;
    struct nearest_query q = *query;
    q.near_m = NEAR_M;
    q.heard_m = HEARD_M;
    store_list(store, &list);
    const struct verdict_evidence evidence = {&picture, store, &list, &limits, &now};
    for (bool more = nearest_begin(&look, &v, &evidence, &q, OWN_M); more;)
        more = nearest_step(&look);
    return look.answer;
}

static struct nearest look(bool ned, double lo_deg, double hi_deg, double reach_m)
{
    return answer(&(struct nearest_query){
        .ned = ned, .lo_rad = geo_rad(lo_deg), .hi_rad = geo_rad(hi_deg), .reach_m = reach_m});
}

static struct nearest look_between(double from_deg, double to_deg, double lo_deg, double hi_deg, double reach_m)
{
    return answer(&(struct nearest_query){.lo_rad = geo_rad(lo_deg),
                                          .hi_rad = geo_rad(hi_deg),
                                          .from_rad = geo_rad(from_deg),
                                          .width_rad = geo_wrap(geo_rad(to_deg - from_deg)),
                                          .reach_m = reach_m});
}

TEST(open_water_is_clear_and_what_was_never_pinged_is_not)
{
    start(false);
    CHECK_INT(look(false, -5, 5, 5).state, ANSWER_UNKNOWN);
    CHECK_INT(look(false, -5, 5, 5).reason, ANSWER_NEVER);
    CHECK_NEAR(look(false, -5, 5, 5).unknown_share, 1, 1e-12, 0);
    CHECK(look(false, -5, 5, 5).age_s < 0);
    send(FANS, 2);
    CHECK_INT(look(false, -5, 5, 5).state, ANSWER_CLEAR);
    CHECK_INT(look(false, -5, 5, 0).state, ANSWER_CLEAR); /* as far as was heard */
    CHECK_NEAR(look(false, -5, 5, 5).unknown_share, 0, 1e-12, 0);
    CHECK_NEAR(look(false, -5, 5, 5).age_s, 2, 1e-6, 0);
    CHECK_INT(look(false, -5, 5, 11).reason, ANSWER_BEYOND);
    now.now_ns += 40 * SECOND;
    CHECK_INT(look(false, -5, 5, 5).reason, ANSWER_STALE);
}

/* Level rows of parts are known, those above and below are not. */
TEST(the_share_is_of_all_that_is_asked)
{
    start(false);
    send(FANS, 1);
    const struct nearest n = look(false, -90, 90, 5);
    CHECK_INT(n.state, ANSWER_UNKNOWN);
    CHECK_INT(n.reason, ANSWER_NEVER);
    CHECK(n.unknown_share > 0.75 && n.unknown_share < 0.95);
    const double half = look_between(-90, 90, -5, 5, 5).unknown_share,
                 wide = look(false, -15, 15, 5).unknown_share;
    CHECK_NEAR(half, 0, 1e-12, 0);
    CHECK(wide > 0.5 && wide < 0.75);
}

TEST(clear_is_clear_to_every_shorter_distance_and_in_less)
{
    start(true);
    send(FANS, 1);
    for (double to_m = 0.2; to_m < 11; to_m += 0.6) {
        const bool clear = look(true, -10, 10, to_m).state == ANSWER_CLEAR;
        CHECK(clear == (to_m < 9.7) || to_m >= 9.7);
        for (double half_deg = 1; clear && half_deg < 10; half_deg += 2)
            CHECK_INT(look_between(-20 * half_deg, 9 * half_deg, -half_deg, half_deg, to_m).state, ANSWER_CLEAR);
    }
}

TEST(the_nearest_one_with_its_place_and_age)
{
    start(false);
    send(FANS, 1);
    put(at(30, 0), 4, 2);
    put(at(200, 40), 2.5, 7);
    struct nearest n = look(false, -90, 90, 0);
    CHECK_INT(n.state, ANSWER_BLOCKED);
    CHECK_NEAR(n.range_m, 2.6, 1e-6, 0);
    CHECK_NEAR(n.age_s, 7, 1e-6, 0);
    CHECK_NEAR(geo_deg(n.az_rad), 200, 0, 4);
    CHECK_NEAR(geo_deg(n.el_rad), 40, 0, 4);
    CHECK(n.confidence > 0.9 && n.confidence < 1);
    CHECK_NEAR(n.range_sd_m, 0.05, 1e-6, 0);
    CHECK(n.unknown_share > 0.7);
    n = look(false, -5, 5, 0);
    CHECK_NEAR(n.range_m, 4.1, 1e-6, 0);
    CHECK_NEAR(n.unknown_share, 0, 1e-12, 0); /* the water before it is known */
    CHECK_INT(n.reason, ANSWER_HEARD);
    CHECK_INT(look(false, -5, 5, 3).state, ANSWER_CLEAR);
    CHECK_INT(look(false, -5, 5, 4.5).state, ANSWER_BLOCKED);
}

/* Of a part with an obstacle, too: as far as that. */
TEST(water_before_an_obstacle_that_was_not_observed_is_unknown)
{
    start(false);
    for (int i = 0; i < BEAMS; i++) {
        beam[i].free_to_m = 5;
        beam[i].n = 1;
    }
    send(1, 1);
    put(at(0, 0), 8, 1);
    CHECK_INT(look_between(-2, 2, -5, 5, 0).state, ANSWER_BLOCKED);
    CHECK_INT(look_between(-2, 2, -5, 5, 0).reason, ANSWER_BEYOND);
    CHECK_NEAR(look_between(-2, 2, -5, 5, 0).unknown_share, 1, 1e-12, 0);
    put(at(0, 0), 4.5, 1);
    CHECK_NEAR(look_between(-2, 2, -5, 5, 0).unknown_share, 0, 1e-12, 0);
    put(at(0, 0), 0.9, 1); /* beyond what is asked, which `near` promises */
    CHECK_INT(look_between(-2, 2, -5, 5, 0.7).state, ANSWER_CLEAR);
    CHECK_INT(look_between(-2, 2, -5, 5, 0.95).state, ANSWER_BLOCKED);
}

static void send_pitched(double up_deg, double high_deg)
{
    struct mount mount = mount_identity;
    quat_from_rpy(0, geo_rad(up_deg), 0, mount.attitude);
    ping.el_aperture_rad = (float)geo_rad(high_deg);
    ping.sensor = up_deg > 0;
    ping.seq++;
    ping.pose = now.pose;
    ping.pose.t_ns = ping.t_ns;
    store_enter(store, &ping, &mount);
}

/* Two fans, one above the other, with a gap or none, wherever rows of parts begin. */
TEST(a_gap_between_two_elevations_is_unknown)
{
    for (int lo_deg = -15; lo_deg < -9; lo_deg++)
        for (int gap = 0; gap < 2; gap++) {
            start(false);
            send_pitched(4.5, 25); /* from -8 degrees on */
            send_pitched(-16, gap ? 8 : 20);
            const struct nearest n = look_between(-5, 5, lo_deg, lo_deg + 21, 5);
            CHECK_INT(n.state, gap ? ANSWER_UNKNOWN : ANSWER_CLEAR);
            CHECK(gap == (n.unknown_share > 0.2) && n.unknown_share < 0.9);
        }
}

/* What a fan sees ahead; astern nothing was ever pinged. */
TEST(between_two_bearings_only_what_is_there_counts)
{
    start(false);
    send(1, 1);
    CHECK_INT(look_between(0, 0, -5, 5, 5).state, ANSWER_UNKNOWN);
    CHECK_NEAR(look_between(0, 0, -5, 5, 5).unknown_share, 2.0 / 3, 0.1, 0);
    CHECK_INT(look_between(-180, 180, -5, 5, 5).state, ANSWER_UNKNOWN);
    CHECK_INT(look_between(-50, 50, -5, 5, 5).state, ANSWER_CLEAR);
    CHECK_INT(look_between(310, 50, -5, 5, 5).state, ANSWER_CLEAR);
    CHECK_INT(look_between(50, 310, -5, 5, 5).state, ANSWER_UNKNOWN);
    CHECK_INT(look_between(-50, 75, -5, 5, 5).reason, ANSWER_NEVER); /* its edge is beside the fan */
    put(at(100, 0), 4, 1);
    put(at(20, 0), 4.5, 1);
    CHECK_NEAR(look_between(-180, 180, -5, 5, 0).range_m, 4.1, 1e-6, 0);
    CHECK_NEAR(look_between(-50, 50, -5, 5, 0).range_m, 4.6, 1e-6, 0);
    CHECK_INT(look_between(-50, 0, -5, 5, 5).state, ANSWER_CLEAR);
}

TEST(angles_are_told_in_the_axes_asked_about)
{
    start(true);
    put(at(100, 0), 4, 1);
    quat_from_rpy(0, 0, geo_rad(60), now.pose.attitude);
    CHECK_NEAR(geo_deg(look(true, -90, 90, 0).az_rad), 100, 0, 4);
    CHECK_NEAR(geo_deg(look(false, -90, 90, 0).az_rad), 40, 0, 4);
    struct picture_frame frame; /* of a grid that is not turned to the north */
    picture_get_frame(&picture, &frame);
    frame.axes_rad = geo_rad(50);
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_set(&picture, at(100, 0), &(struct picture_entry){0});
    picture_end(&picture);
    put(at(100, 30), 4, 1);
    CHECK_NEAR(geo_deg(look(true, -90, 90, 0).az_rad), 150, 0, 4);
    CHECK_NEAR(geo_deg(look(true, -90, 90, 0).el_rad), 30, 0, 4);
    CHECK_NEAR(geo_deg(look(false, -90, 90, 0).az_rad), 90, 0, 4);
    now.pose_fresh = false;
    CHECK_INT(look(true, -90, 90, 0).reason, ANSWER_POSE_LOST);
    CHECK_NEAR(look(true, -90, 90, 0).unknown_share, 1, 1e-12, 0);
    start(false);
    CHECK_INT(look(true, -90, 90, 0).reason, ANSWER_NO_FRAME);
}

TEST(the_bottom_ends_what_is_known_below)
{
    start(true);
    send(FANS, 1);
    now.pose.has |= POSE_ALTITUDE;
    now.pose.altitude_m = 2.2;
    CHECK_INT(look(true, 2, 8, 8).state, ANSWER_CLEAR);
    CHECK_INT(look(true, -8, 8, 8).state, ANSWER_UNKNOWN);
    CHECK_INT(look(true, -8, 8, 8).reason, ANSWER_BOTTOM);
}

static uint64_t state = 5;

static double uniform(double lo, double hi)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(state >> 11) * 0x1p-53;
}

/* Does the cell share more than an edge with what is asked? */
static bool touches(uint32_t d, double lo_rad, double hi_rad, double from_rad, double width_rad)
{
    double az, el;
    geo_angles(axis[d], &az, &el);
    const double half = rings_width(&rings, rings_ring(&rings, d)) / 2, high = rings.height_rad / 2;
    return el + high > lo_rad && el - high < hi_rad &&
           (geo_wrap(az + half - from_rad) < width_rad + 2 * half || width_rad + 2 * half >= GEO_TURN);
}

TEST(a_plain_search_finds_the_same)
{
    printf("seed %llu\n", (unsigned long long)state);
    uint32_t blocked = 0;
    for (int round = 0; round < 100; round++) {
        start(false);
        const double lo = uniform(-90, 80), hi = uniform(lo + 5, 90), reach_m = round % 2 ? uniform(1, 15) : 0;
        const double from = uniform(-360, 360), to = round % 4 < 2 ? from : uniform(-360, 360);
        const double width = round % 4 < 2 ? GEO_TURN : geo_wrap(geo_rad(to - from));
        double best_m = INFINITY;
        for (int k = 0; k < 10; k++) {
            const uint32_t d = (uint32_t)uniform(0, rings.n);
            const double near_m = (double)(float)uniform(0.5, 19);
            put(d, near_m, uniform(0, 20));
        }
        for (uint32_t d = 0; d < rings.n; d++) {
            const double near_m = picture_told_m(&picture, d);
            if (isfinite(near_m) && touches(d, geo_rad(lo), geo_rad(hi), geo_rad(from), width) &&
                (reach_m <= 0 || near_m <= reach_m))
                best_m = fmin(best_m, near_m);
        }
        const struct nearest n = look_between(from, to, lo, hi, reach_m);
        CHECK((n.state == ANSWER_BLOCKED) == (best_m < INFINITY));
        if (n.state == ANSWER_BLOCKED)
            CHECK_NEAR(n.range_m, best_m + 0.1, 1e-5, 0);
        blocked += n.state == ANSWER_BLOCKED;
    }
    CHECK(blocked > 25 && blocked < 95);
}

int main(void)
{
    RUN(open_water_is_clear_and_what_was_never_pinged_is_not);
    RUN(the_share_is_of_all_that_is_asked);
    RUN(clear_is_clear_to_every_shorter_distance_and_in_less);
    RUN(the_nearest_one_with_its_place_and_age);
    RUN(water_before_an_obstacle_that_was_not_observed_is_unknown);
    RUN(a_gap_between_two_elevations_is_unknown);
    RUN(between_two_bearings_only_what_is_there_counts);
    RUN(angles_are_told_in_the_axes_asked_about);
    RUN(the_bottom_ends_what_is_known_below);
    RUN(a_plain_search_finds_the_same);
    return test_end();
}
