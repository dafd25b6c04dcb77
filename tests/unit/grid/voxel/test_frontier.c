/* SPDX-License-Identifier: MIT */
/* test_frontier - frontier.h: the surface against the definition, kept against made anew, tags and normals. */
#include "core/fault.h"
#include "grid/voxel/voxpage.h"
#include "tests/lib/table.h"
#include "tests/lib/voxmap_rig.h"

static bool free_at(struct rig *r, int64_t i, int64_t j, int64_t k)
{
    return merge_at(&r->map, (const int64_t[3]){i, j, k}) == VOXEL_FREE;
}

static bool on_frontier(struct rig *r, const int64_t cell[3])
{
    struct block_key key = merge_block_of(cell);
    const struct frontier_block *b = frontier_block(&r->frontier, &key);
    return b->surface[(cell[0] & 15) * 16 + (cell[1] & 15)] >> (cell[2] & 63) & 1;
}

/* The definition: free, and one of 26 neighbours is not. */
static bool should_be(struct rig *r, const int64_t c[3])
{
    if (!free_at(r, c[0], c[1], c[2]))
        return false;
    for (int n = 0; n < 27; n++)
        if (!free_at(r, c[0] + n / 9 - 1, c[1] + n / 3 % 3 - 1, c[2] + n % 3 - 1))
            return true;
    return false;
}

static int64_t wrong_in(struct rig *r, const int64_t first[3], const int64_t end[3], int64_t *surface)
{
    int64_t wrong = 0, c[3];
    for (c[0] = first[0]; c[0] < end[0]; c[0]++)
        for (c[1] = first[1]; c[1] < end[1]; c[1]++)
            for (c[2] = first[2]; c[2] < end[2]; c[2]++) {
                bool want = should_be(r, c);
                wrong += on_frontier(r, c) != want;
                *surface += want;
            }
    return wrong;
}

/* Cells first.. of the array are free where it says so; a ring around it is free or not. */
static int64_t oracle_wrong(const struct table *t, const char *want, bool ring)
{
    struct voxmap_setting s = rig_setting();
    s.side = 16;
    struct rig *r = rig_new(&s);
    const int64_t nx = table_int(t, 2), ny = table_int(t, 3), nz = table_int(t, 4);
    const int64_t at[3] = {-7, -3, -31}; /* across blocks */
    int64_t wrong = 0, c[3];
    rig_open(r);
    for (c[0] = -1; c[0] <= nx; c[0]++)
        for (c[1] = -1; c[1] <= ny; c[1]++)
            for (c[2] = -1; c[2] <= nz; c[2]++) {
                bool in = c[0] >= 0 && c[0] < nx && c[1] >= 0 && c[1] < ny && c[2] >= 0 && c[2] < nz;
                bool is_free = in ? t->field[5][(c[0] * ny + c[1]) * nz + c[2]] == '1' : ring;
                if (is_free)
                    rig_set(r, (const int64_t[3]){c[0] + at[0], c[1] + at[1], c[2] + at[2]}, SUBMAP_VACANCY, 3);
            }
    for (c[0] = 0; c[0] < nx; c[0]++)
        for (c[1] = 0; c[1] < ny; c[1]++)
            for (c[2] = 0; c[2] < nz; c[2]++)
                wrong += on_frontier(r, (const int64_t[3]){c[0] + at[0], c[1] + at[1], c[2] + at[2]}) !=
                         (want[(c[0] * ny + c[1]) * nz + c[2]] == '1');
    rig_free(r);
    return wrong;
}

TEST(oracle)
{
    struct table t = table_open("tests/oracles/frontier.csv");
    int cases = 0;
    while (table_next(&t)) {
        CHECK_INT(oracle_wrong(&t, t.field[6], false), 0);
        CHECK_INT(oracle_wrong(&t, t.field[7], true), 0);
        cases++;
    }
    CHECK_INT(cases, 10);
}

/* Columns of every length around a word's, at every place in words. */
TEST(V7_columns_across_words)
{
    static const int lengths[] = {1, 2, 3, 63, 64, 65, 128};
    struct voxmap_setting s = rig_setting();
    s.height = 200;
    for (size_t l = 0; l < sizeof lengths / sizeof lengths[0]; l++)
        for (int64_t start = -64; start <= -62; start++) {
            struct rig *r = rig_new(&s);
            int64_t surface = 0;
            rig_open(r);
            for (int c = 0; c < 9; c++)
                for (int64_t k = 0; k < lengths[l]; k++)
                    rig_set(r, (const int64_t[3]){c / 3 - 1, c % 3 - 1, start + k}, SUBMAP_VACANCY, 9);
            CHECK_INT(wrong_in(r, (const int64_t[3]){-3, -3, -70}, (const int64_t[3]){3, 3, 70}, &surface), 0);
            int64_t n = lengths[l], within = n > 2 ? n - 2 : 0;
            CHECK_INT(surface, 9 * n - within);
            rig_free(r);
        }
}

TEST(V8_shapes)
{
    static const struct {
        const char *name;
        int64_t size[3], hole; /* of a free box; edge of a hole in its middle */
        int64_t want;
    } row[] = {
        {"none free", {0, 0, 0}, 0, 0},       {"a single voxel", {1, 1, 1}, 0, 1},
        {"a sheet", {20, 20, 1}, 0, 400},     {"an upright sheet", {1, 20, 20}, 0, 400},
        {"a solid", {7, 7, 7}, 0, 343 - 125}, {"a solid with a hole", {9, 9, 9}, 1, 729 - 343 + 26},
    };
    for (size_t n = 0; n < sizeof row / sizeof row[0]; n++) {
        struct voxmap_setting s = rig_setting();
        struct rig *r = rig_new(&s);
        int64_t surface = 0, c[3];
        rig_open(r);
        for (c[0] = 0; c[0] < row[n].size[0]; c[0]++)
            for (c[1] = 0; c[1] < row[n].size[1]; c[1]++)
                for (c[2] = 0; c[2] < row[n].size[2]; c[2]++)
                    if (!(row[n].hole && c[0] == 4 && c[1] == 4 && c[2] == 4))
                        rig_set(r, c, SUBMAP_VACANCY, 3);
        CHECK_INT(wrong_in(r, (const int64_t[3]){-2, -2, -2}, (const int64_t[3]){22, 22, 22}, &surface), 0);
        CHECK_INT(surface, row[n].want);
        if (test_case_failed)
            printf("(%s)\n", row[n].name);
        rig_free(r);
    }
}

struct points {
    int64_t n, echo, wrong_normals, out_of_order;
    int64_t last;
};

static void take_point(void *context, const struct frontier_point *p)
{
    struct points *all = context;
    double length =
        sqrt((double)(p->normal[0] * p->normal[0] + p->normal[1] * p->normal[1] + p->normal[2] * p->normal[2]));
    int64_t order = ((p->cell[0] & 15) * 16 + (p->cell[1] & 15)) * 64 + (p->cell[2] & 63);
    all->n++;
    all->echo += p->tag == FRONTIER_ECHO;
    all->out_of_order += order <= all->last;
    all->last = order;
    if (p->cell[1] > 3 && p->cell[1] < 16 && p->cell[2] > 3 && p->cell[2] < 16) /* the north and south faces */
        all->wrong_normals += !(p->normal[0] == (p->cell[0] == 0 ? 1.0f : -1.0f) && fabs(length - 1) < 1e-6);
}

TEST(points_have_places_normals_and_tags)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    int64_t c[3];
    rig_open(r);
    for (c[0] = 0; c[0] < 20; c[0]++)
        for (c[1] = 0; c[1] < 20; c[1]++)
            for (c[2] = 0; c[2] < 20; c[2]++)
                rig_set(r, c, SUBMAP_VACANCY, 9);
    for (c[1] = 5; c[1] < 15; c[1]++)
        for (c[2] = 5; c[2] < 15; c[2]++)
            rig_set(r, (const int64_t[3]){20, c[1], c[2]}, SUBMAP_ECHOES, 1); /* a wall in the north */
    struct merge_walk walk = {0};
    struct block_key key;
    struct points all = {0};
    while (merge_next(&r->map, &walk, &key)) {
        all.last = -1;
        frontier_points(&r->frontier, &key, take_point, &all);
    }
    CHECK_INT(all.n, 8000 - 18 * 18 * 18);
    CHECK_INT(all.echo, 12 * 12); /* and their neighbours */
    CHECK_INT(all.wrong_normals, 0);
    CHECK_INT(all.out_of_order, 0);
    rig_free(r);
}

static bool heard_at(struct rig *r, int64_t i, int64_t j, int64_t k)
{
    const int64_t cell[3] = {i, j, k};
    struct block_key key = merge_block_of(cell);
    const struct merge_block *bits = &voxmask_block(&r->mask, &key)->bits;
    return bits->heard[(i & 15) * 16 + (j & 15)] >> (k & 63) & 1;
}

static void count_tag(void *context, const struct frontier_point *p)
{
    struct {
        struct rig *r;
        int64_t wrong, echo;
    } *all = context;
    bool near = false;
    for (int n = 0; n < 27; n++)
        near |= heard_at(all->r, p->cell[0] + n / 9 - 1, p->cell[1] + n / 3 % 3 - 1, p->cell[2] + n % 3 - 1);
    all->wrong += near != (p->tag == FRONTIER_ECHO);
    all->echo += near;
}

/* A surface voxel is an echo's where one of the 27 around it was heard, wherever words and blocks begin and end. */
TEST(tags_equal_the_definition_across_words_and_blocks)
{
    static const int64_t heard[][3] = {{3, 3, -1},  {3, 3, 64},   {-1, 5, 20},  {16, 5, 20}, {5, -1, 40},
                                       {5, 16, 40}, {-1, -1, -1}, {16, 16, 64}, {-1, 16, 64}};
    for (size_t h = 0; h < sizeof heard / sizeof heard[0]; h++) {
        struct voxmap_setting s = rig_setting();
        s.height = 200;
        s.side = 16;
        struct rig *r = rig_new(&s);
        int64_t c[3];
        rig_open(r);
        for (c[0] = 0; c[0] < 16; c[0]++) /* all of one block is free */
            for (c[1] = 0; c[1] < 16; c[1]++)
                for (c[2] = 0; c[2] < 64; c[2]++)
                    rig_set(r, c, SUBMAP_VACANCY, 9);
        rig_set(r, heard[h], SUBMAP_ECHOES, 1);
        struct {
            struct rig *r;
            int64_t wrong, echo;
        } all = {.r = r};
        struct block_key key = merge_block_of((const int64_t[3]){0, 0, 0});
        frontier_points(&r->frontier, &key, count_tag, &all);
        int beyond = 0;
        for (int a = 0; a < 3; a++)
            beyond += heard[h][a] < 0 || heard[h][a] >= (a == 2 ? 64 : 16);
        CHECK_INT(all.wrong, 0);
        CHECK_INT(all.echo, beyond == 1 ? 9 : 1);
        rig_free(r);
    }
}

/* In steps of a few empty blocks: the same blocks in the same order, and no step skips more. */
TEST(seeking_in_steps_finds_the_same_blocks)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    rig_open(r);
    rig_set(r, (const int64_t[3]){0, 0, 0}, SUBMAP_VACANCY, 9);
    rig_set(r, (const int64_t[3]){-40, 40, 10}, SUBMAP_VACANCY, 9);
    for (uint32_t most = 0; most < 4; most++) {
        struct merge_walk whole = {0}, steps = {0};
        struct block_key want, got;
        enum merge_sought sought = MERGE_NOT_YET;
        unsigned found = 0, not_yet = 0;
        while (merge_next(&r->map, &whole, &want)) {
            int64_t before = steps.at;
            while ((sought = merge_seek(&r->map, &steps, most, &got)) == MERGE_NOT_YET) {
                CHECK_INT(steps.at, before + most + 1);
                before = steps.at;
                not_yet++;
            }
            CHECK_INT(sought, MERGE_FOUND);
            CHECK(block_same(&want, &got));
            found++;
        }
        while ((sought = merge_seek(&r->map, &steps, most, &got)) == MERGE_NOT_YET)
            not_yet++;
        CHECK_INT(sought, MERGE_ALL);
        CHECK(found >= 2 && not_yet > 0);
    }
    rig_free(r);
}

/* Nothing new: nothing computed. One beam: the blocks around it. */
TEST(only_what_changed_is_computed_anew)
{
    struct voxmap_setting s = rig_setting();
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    const double at[3] = {0.05, 0.05, 0.05};
    uint64_t before[2], blocks = 0;
    for (int n = 0; n < 3; n++)
        rig_turn(r, at, 3, 0);
    for (int pass = 0; pass < 4; pass++) {
        struct merge_walk walk = {0};
        struct block_key key;
        before[0] = r->mask.computed;
        before[1] = r->frontier.computed;
        if (pass == 2) /* everything there is free already: counts rise, no bit changes */
            rig_enter(r, (rig_aim(&p, at, 1, 2), &p), 0);
        if (pass == 3)
            for (int n = 0; n < 3; n++)
                rig_enter(r, (rig_aim(&p, at, 1, 3.4), &p), 0);
        for (blocks = 0; merge_next(&r->map, &walk, &key); blocks++)
            frontier_block(&r->frontier, &key);
        uint64_t judged = r->mask.computed - before[0], made = r->frontier.computed - before[1];
        CHECK(pass != 0 || (judged >= blocks && made == blocks));
        CHECK(pass != 1 || (judged == 0 && made == 0));
        CHECK(pass != 2 || (judged > 0 && judged < blocks / 3 && made == 0));
        CHECK(pass != 3 || (judged > 0 && judged < blocks / 3 && made > 0 && made < blocks));
    }
    CHECK_INT(blocks, 32);
    rig_free(r);
}

/* Where all counts stand at 255 a ping leaves what was computed valid, until age or another beam changes one. */
TEST(what_is_saturated_is_not_computed_anew)
{
    struct voxmap_setting s = rig_setting();
    s.half_life_ns = 1000 * SECOND;
    s.body_radius_m = 0.3;
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    const double at[3] = {0.05, 0.05, 0.05};
    const int64_t first[3] = {-6, -8, -14}, end[3] = {24, 22, 14};
    int64_t surface = 0;
    for (int n = 0; n < 300; n++) {
        rig_aim(&p, at, geo_rad(40), 2);
        rig_hear(&p, 2);
        rig_enter(r, &p, 0);
    }
    CHECK_INT(wrong_in(r, first, end, &surface), 0);
    CHECK(surface > 100);
    static const struct {
        uint64_t t_s;
        double az_deg;
        bool anew;
    } row[] = {{1, 40, false}, {2, 40, false}, {3, 43, true}, {4, 40, false}, {1005, 40, true}, {1006, 40, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const uint64_t judged = r->mask.computed;
        rig_aim(&p, at, geo_rad(row[i].az_deg), 2);
        rig_hear(&p, 2);
        rig_enter(r, &p, row[i].t_s * SECOND);
        CHECK_INT(wrong_in(r, first, end, &surface), 0);
        CHECK((r->mask.computed > judged) == row[i].anew);
    }
    rig_free(r);
}

/* A look of little height into a deep map: the blocks it touches and no other one of the same columns. */
TEST(what_lies_above_and_below_is_not_judged_anew)
{
    struct voxmap_setting s = rig_setting();
    s.height = 400;
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    struct merge_walk walk = {0};
    struct block_key key;
    const double at[3] = {0.05, 0.05, 0.05};
    uint64_t within = 0, beyond = 0, beyond_judged = 0;
    for (int n = 0; n < 15; n++)
        rig_turn(r, (const double[3]){0.05, 0.05, 15.0 * (n % 5 - 2) / 2}, 3, 0);
    while (merge_next(&r->map, &walk, &key))
        frontier_block(&r->frontier, &key);
    rig_enter(r, (rig_aim(&p, at, 1, 3), &p), 0);
    walk = (struct merge_walk){0};
    while (merge_next(&r->map, &walk, &key)) {
        const bool meets = key.at[2] == -1 || key.at[2] == 0; /* it is 1.8 m high */
        const uint64_t before = r->mask.computed;
        voxmask_block(&r->mask, &key);
        within += meets && r->mask.computed > before;
        beyond += !meets;
        beyond_judged += !meets && r->mask.computed > before;
    }
    CHECK(within >= 2);
    CHECK(beyond >= 64);
    CHECK_INT(beyond_judged, 0);
    rig_free(r);
}

/* A steep look meets several blocks of each column, and all of them are noticed. */
TEST(what_a_look_touches_above_and_below_is_judged_anew)
{
    struct voxmap_setting s = rig_setting();
    s.height = 400;
    struct rig *r = rig_new(&s);
    struct rig_ping p;
    const int64_t first[3] = {16, -2, -66}, end[3] = {20, 2, 66};
    int64_t surface[3] = {0}, wrong = 0;
    for (int n = 0; n < 3; n++) {
        rig_aim(&p, (const double[3]){0.05, 0.05, 0.05}, 0, 4 + n);
        p.echoes.az_aperture_rad = 0.3f;
        p.echoes.el_aperture_rad = 2.7f;
        for (int look = 0; look < 3; look++)
            rig_enter(r, &p, 0);
        wrong += wrong_in(r, first, end, &surface[n]);
        CHECK(n == 0 || surface[n] != surface[n - 1]);
    }
    CHECK_INT(wrong, 0);
    rig_free(r);
}

/* Pings, half-lives, new, corrected, dropped and added submaps in any order:
 * kept equals made anew, cell by cell. */
TEST(random_walk_equals_a_full_pass)
{
    uint64_t seed = test_seed(), t = 0;
    struct voxmap_setting s = rig_setting();
    s.half_life_ns = 100 * SECOND;
    s.body_radius_m = 0.3;
    s.max_submaps = 6;
    s.voxel_m = 0.2;
    struct rig *r = rig_new(&s);
    uint8_t *page = NULL;
    uint64_t paged = 0;
    size_t page_size = 0;
    double at[3] = {0, 0, 0};
    struct fault fault;
    int64_t surface = 0, wrong = 0;
    for (int n = 0; n < 60; n++) {
        for (int b = 0; b < 25; b++) {
            struct rig_ping p;
            for (int a = 0; a < 3; a++)
                at[a] = fmax(-2, fmin(2, at[a] + 0.2 * (test_uniform(&seed) - 0.5)));
            t += SECOND;
            rig_aim(&p, at, 7 * test_uniform(&seed), 1 + test_uniform(&seed));
            p.echoes.az_aperture_rad = 0.6f;
            if (test_uniform(&seed) < 0.4)
                rig_hear(&p, 1 + 2 * test_uniform(&seed));
            rig_enter(r, &p, t);
        }
        const int64_t first[3] = {-18, -18, -12}, end[3] = {18, 18, 12};
        double what = test_uniform(&seed);
        if (n % 2) /* so that what happens next meets a frontier that is kept */
            wrong += wrong_in(r, first, end, &surface);
        if (what < 0.2) {
            voxmap_new(&r->map);
        } else if (what < 0.35 && !paged && (paged = rig_oldest(r)) != 0) {
            page_size = voxpage_bytes(&r->map, paged);
            page = rig_memory(page_size);
            voxpage_pack(&r->map, paged, 0, page, page_size);
            CHECK(voxmap_drop(&r->map, paged));
        } else if (what < 0.6 && paged) {
            CHECK(voxpage_add(&r->map, page, page_size, &fault) > 0);
            free(page);
            page = NULL;
            paged = 0;
        } else if (what < 0.65) {
            voxmap_drop(&r->map, rig_oldest(r));
        } else if (what < 0.68) {
            voxmap_move(&r->map, rig_oldest(r), at, (const double[4]){1, 0, 0, 0.2 * test_uniform(&seed)});
        }
        if (n % 2)
            wrong += wrong_in(r, first, end, &surface);
    }
    CHECK_INT(wrong, 0);
    CHECK(surface > 1000);
    CHECK(r->map.next_id > 5);
    free(page);
    rig_free(r);
}

int main(void)
{
    RUN(oracle);
    RUN(V7_columns_across_words);
    RUN(V8_shapes);
    RUN(points_have_places_normals_and_tags);
    RUN(tags_equal_the_definition_across_words_and_blocks);
    RUN(seeking_in_steps_finds_the_same_blocks);
    RUN(only_what_changed_is_computed_anew);
    RUN(what_is_saturated_is_not_computed_anew);
    RUN(what_lies_above_and_below_is_not_judged_anew);
    RUN(what_a_look_touches_above_and_below_is_judged_anew);
    RUN(random_walk_equals_a_full_pass);
    return test_end();
}
