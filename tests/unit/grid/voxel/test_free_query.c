/* SPDX-License-Identifier: MIT */
/* test_free_query - free_query.h: places, boxes, corridors and rays against the definition;
 * larger is never more free. */
#include "grid/voxel/voxpage.h"
#include "tests/lib/ask_map.h"
#include "tests/lib/table.h"
#include "tests/lib/voxmap_rig.h"

static const double origin_m[3] = {0, 0, 0};

/* A ball of free water around the origin, with holes: unknown and occupied voxels. */
static struct rig *room_new(uint64_t *seed, int holes)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    int64_t c[3];
    rig_open(r);
    for (c[0] = -30; c[0] < 30; c[0]++)
        for (c[1] = -30; c[1] < 30; c[1]++)
            for (c[2] = -30; c[2] < 30; c[2]++)
                if (c[0] * c[0] + c[1] * c[1] + c[2] * c[2] < 30 * 30)
                    rig_set(r, c, SUBMAP_VACANCY, 5);
    for (int n = 0; n < holes; n++) {
        for (int a = 0; a < 3; a++)
            c[a] = (int64_t)(40 * test_uniform(seed)) - 20;
        rig_set(r, c, SUBMAP_VACANCY, 0);
        if (n % 2)
            rig_set(r, c, SUBMAP_ECHOES, 1);
    }
    return r;
}

static void random_place(uint64_t *seed, double reach_m, double out[3])
{
    for (int a = 0; a < 3; a++)
        out[a] = reach_m * (2 * test_uniform(seed) - 1);
}

TEST(Q1_nothing_pinged_is_unknown)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    const double way[2][3] = {{0, 0, 0}, {5, 1, 2}};
    struct free_answer a;
    CHECK(free_query_point(&r->mask, origin_m, &a) && a.state == VOXEL_UNKNOWN);
    CHECK(free_query_box(&r->mask, origin_m, way[1], &a) && a.state == VOXEL_UNKNOWN && a.unknown == a.voxels);
    CHECK(free_query_corridor(&r->mask, way, 2, 0.3, &a) && a.state == VOXEL_UNKNOWN && a.clear_m == 0);
    rig_free(r);
}

TEST(what_is_no_question_is_refused)
{
    uint64_t seed = 1;
    struct rig *r = room_new(&seed, 0);
    struct free_answer a;
    const double nan_m[3] = {0, NAN, 0}, far_m[3] = {1e200, 0, 0}, one[3] = {1, 1, 1}, huge[3] = {1e6, 1e6, 1e6};
    const double way[2][3] = {{0, 0, 0}, {1e6, 0, 0}}, still[2][3] = {{1e-160, 0, 0}, {1e-160, 1e-160, 0}};
    CHECK(!free_query_point(&r->mask, nan_m, &a));
    CHECK(!free_query_point(&r->mask, far_m, &a));
    CHECK(!free_query_box(&r->mask, one, origin_m, &a));
    CHECK(!free_query_box(&r->mask, origin_m, huge, &a));
    CHECK(!free_query_corridor(&r->mask, way, 0, 1, &a));
    CHECK(!free_query_corridor(&r->mask, way, 2, NAN, &a));
    CHECK(!free_query_corridor(&r->mask, way, 2, -1, &a));
    CHECK(!free_query_corridor(&r->mask, way, 2, 1, &a));
    CHECK(!free_query_corridor(&r->mask, way, 1, INFINITY, &a));
    CHECK(free_query_corridor(&r->mask, still, 2, 0, &a) && a.state == VOXEL_FREE); /* Q4 */
    CHECK(free_query_corridor(&r->mask, still, 1, 0.5, &a) && a.state == VOXEL_FREE);
    rig_free(r);
}

TEST(boxes_are_all_their_voxels)
{
    uint64_t seed = test_seed();
    struct rig *r = room_new(&seed, 60);
    int free = 0;
    for (int n = 0; n < 300; n++) {
        double low[3], high[3];
        struct free_answer a;
        random_place(&seed, 2, low);
        uint64_t voxels = 1, unknown = 0, occupied = 0;
        int64_t first[3], last[3], c[3];
        for (int x = 0; x < 3; x++) {
            high[x] = low[x] + (n % 10 ? 0.8 * test_uniform(&seed) : 0);
            first[x] = (int64_t)floor(low[x] / 0.1);
            last[x] = (int64_t)floor(high[x] / 0.1);
            voxels *= (uint64_t)(last[x] - first[x] + 1);
        }
        CHECK(free_query_box(&r->mask, low, high, &a));
        for (c[0] = first[0]; c[0] <= last[0]; c[0]++)
            for (c[1] = first[1]; c[1] <= last[1]; c[1]++)
                for (c[2] = first[2]; c[2] <= last[2]; c[2]++) {
                    enum voxel_state s = merge_at(&r->map, c);
                    unknown += s == VOXEL_UNKNOWN;
                    occupied += s == VOXEL_OCCUPIED;
                }
        CHECK_INT(a.voxels, voxels);
        CHECK_INT(a.unknown, unknown);
        CHECK_INT(a.occupied, occupied);
        CHECK_INT(a.state, occupied ? VOXEL_OCCUPIED : unknown ? VOXEL_UNKNOWN : VOXEL_FREE);
        if (a.state != VOXEL_FREE) {
            const int64_t at[3] = {(int64_t)floor(a.first_m[0] / 0.1), (int64_t)floor(a.first_m[1] / 0.1),
                                   (int64_t)floor(a.first_m[2] / 0.1)};
            CHECK_INT(merge_at(&r->map, at), a.first_state);
            CHECK(a.first_state != VOXEL_FREE);
        }
        free += a.state == VOXEL_FREE;
    }
    CHECK(free > 30 && free < 270);
    rig_free(r);
}

/* ---- corridors ---- */

/* Distance of a voxel's cube from the leg's point t (in metres), by definition. */
static double cube_at(const double a[3], const double b[3], const int64_t cell[3], double t)
{
    double sum = 0;
    for (int x = 0; x < 3; x++) {
        double p = a[x] + t * (b[x] - a[x]), lo = (double)cell[x] * 0.1, hi = lo + 0.1;
        double off = p < lo ? lo - p : p > hi ? p - hi : 0;
        sum += off * off;
    }
    return sqrt(sum);
}

/* Its least over the leg: convex, so by thirds. */
static double cube_least(const double a[3], const double b[3], const int64_t cell[3], double *at)
{
    double lo = 0, hi = 1;
    for (int n = 0; n < 100; n++) {
        double p = lo + (hi - lo) / 3, q = hi - (hi - lo) / 3;
        if (cube_at(a, b, cell, p) <= cube_at(a, b, cell, q))
            hi = q;
        else
            lo = p;
    }
    *at = lo;
    return cube_at(a, b, cell, lo);
}

TEST(corridors_are_all_voxels_that_the_ball_touches)
{
    uint64_t seed = test_seed();
    struct rig *r = room_new(&seed, 60);
    int free = 0, blocked = 0;
    for (int n = 0; n < 60; n++) {
        double way[2][3], radius = n % 7 ? 0.6 * test_uniform(&seed) : 0;
        struct free_answer a;
        random_place(&seed, 1.5, way[0]);
        random_place(&seed, 1.5, way[1]);
        if (n % 5 == 0)
            way[1][n % 3] = way[0][n % 3];
        if (n % 11 == 0)
            memcpy(way[1], way[0], sizeof way[1]);
        CHECK(free_query_corridor(&r->mask, (const double(*)[3])way, 2, radius, &a));
        uint64_t surely = 0, perhaps = 0;
        double length =
            sqrt(pow(way[1][0] - way[0][0], 2) + pow(way[1][1] - way[0][1], 2) + pow(way[1][2] - way[0][2], 2));
        double first = length;
        int64_t c[3];
        for (c[0] = -25; c[0] < 25; c[0]++)
            for (c[1] = -25; c[1] < 25; c[1]++)
                for (c[2] = -25; c[2] < 25; c[2]++) {
                    double t = 0, middle = 0;
                    for (int x = 0; x < 3; x++) /* far from the leg's box: not touched */
                        middle = fmax(middle, fmax(fmin(way[0][x], way[1][x]) - 0.1 * (double)(c[x] + 1),
                                                   0.1 * (double)c[x] - fmax(way[0][x], way[1][x])));
                    if (middle > radius + 1e-9)
                        continue;
                    double least = cube_least(way[0], way[1], c, &t);
                    surely += least < radius - 1e-9;
                    perhaps += least <= radius + 1e-9;
                    if (least > radius - 1e-9 || merge_at(&r->map, c) == VOXEL_FREE)
                        continue;
                    double lo = 0, hi = t;
                    if (cube_at(way[0], way[1], c, 0) <= radius)
                        hi = 0;
                    for (int m = 0; m < 60 && hi > 0; m++)
                        *(cube_at(way[0], way[1], c, (lo + hi) / 2) <= radius ? &hi : &lo) = (lo + hi) / 2;
                    first = fmin(first, hi * length);
                }
        CHECK(a.voxels >= surely && a.voxels <= perhaps);
        CHECK_NEAR(a.clear_m, first, 0, 1e-7);
        CHECK(a.state != VOXEL_FREE || first == length);
        free += a.state == VOXEL_FREE;
        blocked += a.state == VOXEL_OCCUPIED;
    }
    CHECK(free > 5 && blocked > 5);
    rig_free(r);
}

/* One occupied voxel around the point of each row: touched if the clearance is below 0,
 * not touched beyond its diagonal. */
TEST(capsule_oracle)
{
    struct table t = table_open("tests/oracles/capsule_clearance.csv");
    int rows = 0, asked = 0;
    while (table_next(&t)) {
        struct voxmap_setting s = rig_setting();
        double way[2][3], at[3], radius = table_real(&t, 10), reach = 0;
        rows++;
        for (int a = 0; a < 3; a++) {
            way[0][a] = table_real(&t, 1 + a);
            way[1][a] = table_real(&t, 4 + a);
            at[a] = table_real(&t, 7 + a);
            reach = fmax(reach, fabs(at[a] - way[0][a]) + fabs(way[1][a] - way[0][a]));
        }
        if (reach > 1e8 || reach < 1e-8)
            continue; /* no place on a lattice */
        s.voxel_m =
            fmin(fmax(fmax(reach / 2000, radius / 20), 0.01), 10); /* a question of a size that is answered */
        struct rig *r = rig_new(&s);
        struct rig_ping p;
        struct lattice_place cell;
        struct free_answer a;
        lattice_place(at, s.voxel_m, &cell);
        rig_aim(&p, at, 0, 0);
        CHECK(rig_enter(r, &p, 0));
        rig_set(r, cell.cell, SUBMAP_ECHOES, 1);
        if (free_query_corridor(&r->mask, (const double(*)[3])way, 2, radius, &a)) {
            double clearance = table_real(&t, 12);
            CHECK(!(clearance < 0) || a.occupied == 1);
            CHECK(!(clearance > 1.7321 * s.voxel_m) || a.occupied == 0);
            asked++;
        }
        rig_free(r);
    }
    printf("# %d rows, %d asked\n", rows, asked);
    CHECK(rows == 66 && asked > 40);
}

TEST(Q6_larger_is_never_more_free)
{
    uint64_t seed = test_seed();
    struct rig *r = room_new(&seed, 40);
    int turned = 0;
    for (int n = 0; n < 150; n++) {
        double way[4][3];
        struct free_answer a, before = {.state = VOXEL_FREE};
        for (int w = 0; w < 4; w++)
            random_place(&seed, 1.7, way[w]);
        for (int step = 0; step < 8; step++) { /* wider */
            CHECK(free_query_corridor(&r->mask, (const double(*)[3])way, 3, 0.07 * step, &a));
            CHECK(a.state >= before.state);
            CHECK(a.voxels >= before.voxels);
            CHECK(step == 0 || a.clear_m <= before.clear_m + 1e-9);
            turned += a.state != before.state;
            before = a;
        }
        for (uint32_t w = 1; w <= 4; w++) { /* longer */
            CHECK(free_query_corridor(&r->mask, (const double(*)[3])way, w, 0.1, &a));
            CHECK(w == 1 || a.state >= before.state);
            before = a;
        }
    }
    CHECK(turned > 100);
    rig_free(r);
}

TEST(far_from_the_origin_too)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    struct free_answer a;
    const double at[3] = {1e7, -1e7, 3000}, way[2][3] = {{1e7, -1e7, 3000}, {1e7 + 2, -1e7, 3000}};
    for (int n = 0; n < 3; n++)
        rig_enter(r, (rig_aim(&p, at, 0, 3), p.echoes.az_aperture_rad = 1, &p), 0);
    rig_enter(r, (rig_aim(&p, at, 0, 0), p.echoes.az_aperture_rad = 1, rig_hear(&p, 3), &p), 0);
    CHECK(free_query_corridor(&r->mask, way, 2, 0, &a));
    const double ahead[2][3] = {{1e7 + 1, -1e7 + 0.05, 3000.05}, {1e7 + 10, -1e7 + 0.05, 3000.05}};
    CHECK(free_query_corridor(&r->mask, ahead, 2, 0, &a));
    CHECK_INT(a.state, VOXEL_OCCUPIED);
    CHECK_NEAR(a.clear_m, 1.9, 0, 0.15);
    rig_free(r);
}

/* Answers a question that was started in steps, each of them no longer than allowed. Returns how many. */
static int answer_in_steps(struct rig *r, struct free_query *q)
{
    int steps = 0;
    bool done = false;
    while (!done) {
        const uint64_t voxels = q->answer.voxels, computed = r->mask.computed;
        done = free_query_step(q, &r->mask);
        const uint64_t blocks = r->mask.computed - computed;
        CHECK(q->answer.voxels - voxels <= FREE_QUERY_SLICE);
        CHECK(blocks <= FREE_QUERY_SLICE / FREE_QUERY_BLOCK + 1);
        steps++;
    }
    return steps;
}

static bool same_answer(const struct free_answer *a, const struct free_answer *b)
{
    return a->state == b->state && a->voxels == b->voxels && a->unknown == b->unknown &&
           a->occupied == b->occupied && a->first_state == b->first_state && a->clear_m == b->clear_m &&
           memcmp(a->first_m, b->first_m, sizeof a->first_m) == 0;
}

/* However large a question is, pings wait for one step of it, and the answer is that of one visit. */
TEST(in_steps_as_at_once)
{
    uint64_t seed = test_seed();
    struct rig *r = room_new(&seed, 60);
    struct free_answer a;
    struct free_query q;
    int steps = 0;
    for (int n = 0; n < 12; n++) {
        double low[3], high[3], way[4][3];
        random_place(&seed, 4, low);
        for (int x = 0; x < 3; x++)
            high[x] = low[x] + (n % 3 == x ? 60 : 4) * test_uniform(&seed);
        CHECK(free_query_begin_box(&q, 0.1, low, high));
        steps += answer_in_steps(r, &q);
        CHECK(free_query_box(&r->mask, low, high, &a) && same_answer(&a, &q.answer));
        for (int w = 0; w < 4; w++)
            random_place(&seed, n % 2 ? 1 : 8, way[w]);
        if (n % 4 == 0) /* one row of cells, upright */
            for (int x = 0; x < 2; x++)
                way[1][x] = way[0][x];
        const double radius = n % 4 ? 1.5 * test_uniform(&seed) : 0;
        const uint32_t points = n % 4 ? 1 + (uint32_t)n % 4 : 2;
        way[1][2] += n % 4 ? 0 : 9000;
        CHECK(free_query_begin_corridor(&q, 0.1, (const double(*)[3])way, points, radius));
        steps += answer_in_steps(r, &q);
        CHECK(free_query_corridor(&r->mask, (const double(*)[3])way, points, radius, &a));
        CHECK(same_answer(&a, &q.answer));
    }
    CHECK(steps > 100);
    rig_free(r);
}

int main(void)
{
    RUN(in_steps_as_at_once);
    RUN(Q1_nothing_pinged_is_unknown);
    RUN(what_is_no_question_is_refused);
    RUN(boxes_are_all_their_voxels);
    RUN(corridors_are_all_voxels_that_the_ball_touches);
    RUN(capsule_oracle);
    RUN(Q6_larger_is_never_more_free);
    RUN(far_from_the_origin_too);
    return test_end();
}
