/* SPDX-License-Identifier: MIT */
/*
 * test_obstacles - what is found among many directions is what is found of each of them alone: no glance leaves out
 * what a look would have shown.
 */
#include "grid/answer/obstacles.h"
#include "tests/lib/picture_rig.h"

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
    struct picture_entry e = {.free = {{.t_ping_ns = NOW, .to_m = 1}}};
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
    struct picture_frame frame;
    struct sight_place place;
    picture_get_frame(&picture, &frame);
    sight_locate(&picture, &frame, &limits, &now, &place);
    obstacles_find(&(struct obstacles_scene){&picture, &frame, &limits, &now, &place}, q, found);
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

int main(void)
{
    RUN(of_many_directions_no_other_is_found_than_of_each_alone);
    return test_end();
}
