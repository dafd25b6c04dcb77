/* SPDX-License-Identifier: MIT */
/*
 * test_obstacles - what is found among many directions is what is found of each of them alone: no glance leaves out
 * what a look would have shown. Nothing that lies in what is asked is passed over.
 */
#include "tests/lib/picture_rig.h"
#include "tests/lib/way_rig.h"

#define SECTORS 24
#define TOLD    300
#define PLACES  24

static uint64_t random_state;
static struct picture_entry entry[TOLD];
static uint32_t at[TOLD];

static float any(double lo, double hi)
{
    return (float)(lo + (hi - lo) * test_uniform(&random_state));
}

/* With an echo too little to block in one of two, up to two obstacles, some faded, some weak from the first. */
static struct picture_entry any_entry(void)
{
    struct picture_entry e = {.t_look_ns = NOW};
    const int n = (int)(3 * test_uniform(&random_state));
    e.hint_m = test_uniform(&random_state) < 0.5 ? any(0.3, 4) : 0;
    for (int i = 0; i < n; i++) {
        const float near_m = any(0.5, 12);
        e.obstacle[i] = (struct picture_obstacle){.t_ref_ns = NOW - (uint64_t)any(0, 120) * SECOND,
                                                  .t_echo_ns = NOW - SECOND,
                                                  .logodds = any(0.1, 3),
                                                  .near_m = near_m,
                                                  .range_m = near_m + any(0, 0.3),
                                                  .sd_m = any(0.01, 0.1)};
    }
    return e;
}

static void put(int i, bool there)
{
    static const struct picture_entry none;
    picture_begin(&picture);
    picture_set(&picture, at[i], there ? &entry[i] : &none);
    picture_end(&picture);
}

static void any_scene(void)
{
    start_with(rings_full(&rings, geo_rad(6)), true);
    for (int i = 0; i < TOLD; i++) {
        at[i] = (uint32_t)(test_uniform(&random_state) * rings.n);
        entry[i] = any_entry();
    }
    now.pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    for (int k = 0; k < 3; k++)
        now.pose.position_m[k] = (double)any(-0.1, 0.1);
    now.pose.uncertain_rad = (double)any(0, 0.05);
    quat_from_rpy((double)any(-0.2, 0.2), (double)any(-0.2, 0.2), (double)any(0, 6), now.pose.attitude);
}

static struct obstacles_query any_query(void)
{
    const bool ned = test_uniform(&random_state) < 0.5;
    const double lo = (double)any(-1.5, 0.5), to_m = (double)any(0.5, 13), near_m = (double)any(0.3, 3);
    return (struct obstacles_query){.around = test_uniform(&random_state) < 0.5,
                                    .line = {.ned = ned,
                                             .az_rad = (double)any(0, 6),
                                             .el_rad = lo,
                                             .distance_m = to_m,
                                             .corridor = test_uniform(&random_state) < 0.5,
                                             .half_angle_rad = (double)any(0, 3.1f),
                                             .radius_m = (double)any(0.1, 3),
                                             .near_m = near_m},
                                    .band = {.ned = ned,
                                             .lo_rad = lo,
                                             .hi_rad = lo + (double)any(0.05, 1),
                                             .reach_m = to_m,
                                             .near_m = near_m,
                                             .count = SECTORS}};
}

static void find(const struct obstacles_query *q, struct obstacles_found found[SECTORS])
{
    find_obstacles(&picture, &limits, &now, q, found);
}

/* What is behind an obstacle does not count. */
static void fold(struct obstacles_found *all, const struct obstacles_found *one)
{
    const double hint_m = fmin(all->hint_m, one->hint_m);
    if (one->any && !(all->any && all->near_m <= one->near_m))
        *all = *one;
    all->hint_m = all->any && hint_m >= all->near_m ? (double)INFINITY : hint_m;
}

TEST(of_many_directions_no_other_is_found_than_of_each_alone)
{
    random_state = test_seed();
    int blocked = 0, hints = 0;
    for (int place = 0; place < PLACES; place++) {
        struct obstacles_found together[SECTORS], one[SECTORS], all[SECTORS];
        const struct obstacles_query q = any_query();
        any_scene();
        for (size_t k = 0; k < SECTORS; k++)
            all[k] = (struct obstacles_found){.hint_m = INFINITY};
        for (int i = 0; i < TOLD; i++) {
            bool later = false; /* the same direction is told once more, otherwise */
            for (int j = i + 1; j < TOLD; j++)
                later = later || at[j] == at[i];
            if (later)
                continue;
            put(i, true);
            find(&q, one);
            put(i, false);
            for (size_t k = 0; k < obstacles_parts(&q); k++)
                fold(&all[k], &one[k]);
        }
        for (int i = 0; i < TOLD; i++)
            put(i, true);
        find(&q, together);
        for (size_t k = 0; k < obstacles_parts(&q); k++) {
            CHECK(together[k].any == all[k].any);
            CHECK(!all[k].any || together[k].near_m == all[k].near_m);
            CHECK(!all[k].any || together[k].range_m == all[k].range_m);
            CHECK(together[k].hint_m == all[k].hint_m);
            blocked += all[k].any;
            hints += all[k].hint_m < INFINITY;
        }
    }
    CHECK(blocked > PLACES && hints > PLACES / 2);
}

/* ---- what lies in a question ---- */

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&random_state);
}

static bool one_in(double n)
{
    return test_uniform(&random_state) * n < 1;
}

/* Where the vehicle may be, and how it may be turned; of what it saw, how far its heading has drifted since. */
struct doubt {
    double offset_m[3], attitude[4], turned_rad, adrift_rad;
    double turned[4], drifted[4]; /* one way of it */
};

static struct doubt any_doubt(void)
{
    struct doubt d = {.turned_rad = one_in(2) ? between(0, 0.08) : 0,
                      .adrift_rad = one_in(2) ? between(0, 0.3) : 0};
    for (int k = 0; k < 3 && one_in(2); k++)
        d.offset_m[k] = between(-0.1, 0.1);
    quat_from_rpy(between(-0.4, 0.4), between(-0.4, 0.4), between(-3, 3), d.attitude);
    double about[3];
    geo_direction(between(0, GEO_TURN), asin(between(-1, 1)), about);
    const double half = d.turned_rad * between(0.9, 1) / 2, drift = d.adrift_rad * (one_in(2) ? 1 : -1) / 2;
    memcpy(d.turned, (double[]){cos(half), sin(half) * about[0], sin(half) * about[1], sin(half) * about[2]},
           sizeof d.turned);
    memcpy(d.drifted, (double[]){cos(drift), 0, 0, sin(drift)}, sizeof d.drifted);
    return d;
}

static void take_doubt(const struct doubt *d)
{
    memcpy(now.pose.position_m, d->offset_m, sizeof d->offset_m);
    memcpy(now.pose.attitude, d->attitude, sizeof d->attitude);
    now.pose.uncertain_rad = d->turned_rad;
    now.pose.heading_radps = d->adrift_rad / limits.clear_for_s;
}

/* From the axes asked about, as seen from the vehicle, to where the grid has it: seen from the centre, with the
 * heading of then. */
static void to_where_it_was_seen(const struct doubt *d, bool ned, double v[3])
{
    if (!ned) {
        quat_rotate(d->attitude, v, v);
        quat_rotate(d->turned, v, v);
    }
    for (int i = 0; i < 3; i++)
        v[i] += d->offset_m[i];
    quat_rotate(d->drifted, v, v);
}

/* Somewhere in the question as seen from the vehicle, often in its wall. */
static void somewhere_in(const struct answer_query *q, double v[3])
{
    const double most = q->corridor ? q->radius_m : q->half_angle_rad, turn = between(0, GEO_TURN);
    const double wide = one_in(2) ? 0.999 * most : between(0, most), far_m = between(0.9, 0.999) * q->distance_m;
    const double ahead = q->corridor ? far_m : far_m * cos(wide), aside = q->corridor ? wide : far_m * sin(wide);
    double line[3], side[3], up[3];
    geo_direction(q->az_rad, q->el_rad, line);
    geo_direction(q->az_rad + GEO_PI / 2, 0, side);
    geo_direction(q->az_rad, q->el_rad + GEO_PI / 2, up);
    for (int i = 0; i < 3; i++)
        v[i] = ahead * line[i] + aside * (cos(turn) * side[i] + sin(turn) * up[i]);
}

/* An obstacle, or an echo too little for one. */
static void put_one_thing(const double v[3], bool weak)
{
    double az, el;
    start_with(true, true);
    geo_angles(v, &az, &el);
    struct picture_entry e = {.hint_m = (float)(geo_length(v) - 1e-4)};
    if (!weak)
        e = (struct picture_entry){.obstacle[0] = {.t_ref_ns = NOW,
                                                   .t_echo_ns = NOW,
                                                   .logodds = 4,
                                                   .near_m = (float)(geo_length(v) - 1e-4),
                                                   .range_m = (float)geo_length(v)}};
    picture_begin(&picture);
    picture_set(&picture, rings_index(&rings, az, el), &e);
    picture_end(&picture);
}

TEST(nothing_in_a_cone_or_corridor_is_passed_over)
{
    random_state = test_seed();
    for (int i = 0; i < 4000 && !test_case_failed; i++) {
        struct answer_query q = {.az_rad = between(0, GEO_TURN),
                                 .el_rad = between(-1.5, 1.5),
                                 .ned = one_in(2),
                                 .distance_m = between(1, 10),
                                 .corridor = one_in(2),
                                 .half_angle_rad = between(0, 0.8),
                                 .radius_m = between(0.1, 1)};
        const struct doubt d = any_doubt();
        const bool weak = one_in(3);
        struct obstacles_found found;
        double v[3];
        q.near_m = 20;
        CHECK(rings_full(&rings, geo_rad(between(3, 15))));
        somewhere_in(&q, v);
        to_where_it_was_seen(&d, q.ned, v);
        put_one_thing(v, weak);
        take_doubt(&d);
        find_obstacles(&picture, &limits, &now, &(struct obstacles_query){.line = q}, &found);
        CHECK(weak ? isfinite(found.hint_m) : found.any);
    }
}

/* Of sectors, all around or not, the one that it lies in. */
TEST(nothing_in_a_sector_is_passed_over)
{
    random_state = test_seed();
    for (int i = 0; i < 4000 && !test_case_failed; i++) {
        const double lo = between(-1.4, 1.2), hi = between(lo, 1.5), wide = one_in(2) ? 0 : between(0.1, 6);
        const struct obstacles_query q = {.around = true,
                                          .band = {.ned = one_in(2),
                                                   .lo_rad = lo,
                                                   .hi_rad = hi,
                                                   .from_rad = wide > 0 ? between(0, GEO_TURN) : 0,
                                                   .width_rad = wide,
                                                   .reach_m = between(1, 10),
                                                   .near_m = 20,
                                                   .count = (size_t)between(1, SECTORS + 1)}};
        const double part = (wide > 0 ? wide : GEO_TURN) / (double)q.band.count;
        const size_t k = (size_t)between(0, (double)q.band.count);
        const double from = wide > 0 ? q.band.from_rad : -part / 2;
        const double off = one_in(2) ? 0.001 : one_in(2) ? 0.999 : between(0, 1);
        const double el = one_in(2)   ? lo + 0.001 * (hi - lo)
                          : one_in(2) ? hi - 0.001 * (hi - lo)
                                      : between(lo, hi);
        const double far_m = q.band.reach_m * between(0.9, 0.999);
        const struct doubt d = any_doubt();
        const bool weak = one_in(3);
        struct obstacles_found found[SECTORS + 1];
        double v[3];
        geo_direction(from + ((double)k + off) * part, el, v);
        for (int n = 0; n < 3; n++)
            v[n] *= far_m;
        CHECK(rings_full(&rings, geo_rad(between(3, 15))));
        to_where_it_was_seen(&d, q.band.ned, v);
        put_one_thing(v, weak);
        take_doubt(&d);
        find_obstacles(&picture, &limits, &now, &q, found);
        CHECK(weak ? found[k].hint_m < INFINITY : found[k].any);
    }
}

/* Of a vehicle that may be 0.2 m off an echo 0.8 m away lies up to 14 degrees beside where it seems to. */
TEST(a_weak_echo_counts_wherever_it_may_lie_whatever_stands_behind_it)
{
    for (int behind = 0; behind < 2; behind++) {
        struct obstacles_found found[SECTORS];
        struct picture_entry e = {.hint_m = 0.8f};
        const struct obstacles_query q = {
            .around = true,
            .band = {.lo_rad = geo_rad(-5), .hi_rad = geo_rad(5), .reach_m = 6, .near_m = 1, .count = SECTORS}};
        start_with(rings_full(&rings, geo_rad(3)), true);
        if (behind)
            e.obstacle[0] = (struct picture_obstacle){
                .t_ref_ns = NOW, .t_echo_ns = NOW, .logodds = 4, .near_m = 5, .range_m = 5, .sd_m = 0.05f};
        picture_begin(&picture);
        picture_set(&picture, rings_index(&rings, geo_rad(1), geo_rad(1)), &e);
        picture_end(&picture);
        now.pose.uncertain_m = 0.2;
        find(&q, found);
        for (int k = -1; k <= 1; k++)
            CHECK_NEAR(found[(k + SECTORS) % SECTORS].hint_m, 0.6, 0, 1e-6);
    }
}

/* Along a corridor, at the corner of which something stands that is beyond its end and does not block. */
TEST(a_weak_echo_in_a_corridor_counts_before_what_stands_at_its_corner)
{
    struct obstacles_found found[SECTORS];
    struct picture_entry e = {.hint_m = 0.8f};
    const struct obstacles_query q = {.line = {.distance_m = 5, .corridor = true, .radius_m = 1, .near_m = 1}};
    start_with(rings_full(&rings, geo_rad(3)), true);
    e.obstacle[0] = (struct picture_obstacle){
        .t_ref_ns = NOW, .t_echo_ns = NOW, .logodds = 4, .near_m = 5.005f, .range_m = 5.05f, .sd_m = 0.05f};
    picture_begin(&picture);
    picture_set(&picture, rings_index(&rings, geo_rad(4), geo_rad(1)), &e);
    picture_end(&picture);
    find(&q, found);
    CHECK(found[0].any && found[0].near_m > 5);
    CHECK_NEAR(found[0].hint_m, 0.8, 0, 1e-6);
}

int main(void)
{
    RUN(nothing_in_a_cone_or_corridor_is_passed_over);
    RUN(nothing_in_a_sector_is_passed_over);
    RUN(of_many_directions_no_other_is_found_than_of_each_alone);
    RUN(a_weak_echo_counts_wherever_it_may_lie_whatever_stands_behind_it);
    RUN(a_weak_echo_in_a_corridor_counts_before_what_stands_at_its_corner);
    return test_end();
}
