/* SPDX-License-Identifier: MIT */
/*
 * test_components - connected components of spherical cells against a table, against stated cases at the seam and the
 * poles, and against a recomputation from nothing while cells come and go at random.
 */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/sphere/components.h"

#define ROOM   4096
#define LAYERS 24

static struct rings rings;
static struct components components;
static _Alignas(16) unsigned char memory[1 << 20];

static void begin(void)
{
    if (components_bytes(ROOM) > sizeof memory) {
        printf("memory: %zu bytes needed\n", components_bytes(ROOM));
        exit(1);
    }
    components_init(&components, memory, &rings, ROOM);
}

/* Rings of equal numbers of cells, as the table has them. */
static void uniform(uint32_t polar, uint32_t azimuth)
{
    rings = (struct rings){
        .n_rings = polar, .n = polar * azimuth, .top_rad = GEO_PI / 2, .height_rad = GEO_PI / polar};
    for (uint32_t j = 0; j <= polar; j++)
        rings.start[j] = j * azimuth;
}

static uint32_t put(uint32_t direction, uint32_t layer)
{
    return components_put(&components, direction, (uint16_t)layer, true, 1000);
}

static uint32_t count(void)
{
    uint32_t n = 0;
    COMPONENTS_EACH(&components, root)
    n++;
    return n;
}

/* ---- the table ---- */

struct row {
    uint32_t index;
    long label;
};

/* Equal labels in the table if and only if in one component. */
static void check_case(const struct row *row, int n)
{
    for (int a = 0; a < n; a++)
        for (int b = 0; b < a; b++)
            CHECK_INT(components_of(&components, row[a].index) == components_of(&components, row[b].index),
                      row[a].label == row[b].label);
}

TEST(components_equal_the_table)
{
    struct table t = table_open("tests/oracles/components.csv");
    static struct row row[ROOM];
    long current = -1;
    int n = 0, cases = 0;
    while (table_next(&t)) {
        if (table_int(&t, 0) != current) {
            check_case(row, n);
            n = 0;
            cases++;
            current = table_int(&t, 0);
            uniform((uint32_t)table_int(&t, 2), (uint32_t)table_int(&t, 3));
            begin();
        }
        const long direction = table_int(&t, 5) * table_int(&t, 3) + table_int(&t, 6);
        row[n++] = (struct row){put((uint32_t)direction, (uint32_t)table_int(&t, 4)), table_int(&t, 7)};
    }
    check_case(row, n);
    printf("# %d cases\n", cases);
    CHECK(cases > 5);
}

/* ---- stated cases ---- */

TEST(a_ring_around_the_pole_is_one_and_the_pole_joins_what_faces_each_other)
{
    CHECK(rings_full(&rings, geo_rad(10)));
    begin();
    for (uint32_t d = rings.start[2]; d < rings.start[3]; d++)
        put(d, 7);
    CHECK_INT(count(), 1);
    begin();
    put(0, 3);
    put(rings.start[1] / 2, 4); /* across the pole, one layer on */
    CHECK_INT(count(), 1);
    put(rings.n - 1, 3);
    CHECK_INT(count(), 2);
}

TEST(the_seam_is_no_border_and_two_layers_are)
{
    CHECK(rings_level(&rings, geo_rad(5), geo_rad(10)));
    begin();
    put(0, 3);
    put(rings.n - 1, 2);
    CHECK_INT(count(), 1);
    put(1, 5);
    CHECK_INT(count(), 2);
    put(1, 4);
    CHECK_INT(count(), 1);
}

TEST(all_cells_are_one_component)
{
    CHECK(rings_full(&rings, geo_rad(20)));
    begin();
    for (uint32_t d = 0; d < rings.n; d++)
        for (uint32_t layer = 0; layer < LAYERS; layer++)
            CHECK(put(d, layer) != COMPONENTS_NONE);
    CHECK_INT(count(), 1);
    COMPONENTS_EACH(&components, root)
    CHECK_INT(components_of(&components, root)->cells, rings.n * LAYERS);
}

TEST(without_the_bridge_the_larger_part_keeps_the_label)
{
    CHECK(rings_level(&rings, geo_rad(5), geo_rad(10)));
    begin();
    const uint32_t small = put(10, 5), bridge = put(12, 5), large = put(14, 5);
    put(11, 5);
    put(13, 5);
    put(15, 5);
    CHECK_INT(count(), 1);
    const uint32_t label = components_of(&components, bridge)->label;
    CHECK(components_remove(&components, 12, 5));
    CHECK(!components_remove(&components, 12, 5));
    components_settle(&components, 2000);
    CHECK_INT(count(), 2);
    CHECK_INT(components_of(&components, large)->label, label);
    CHECK_INT(components_of(&components, large)->cells, 3);
    CHECK_INT(components_of(&components, large)->t_label, 1000);
    CHECK(components_of(&components, small)->label != label);
    CHECK_INT(components_of(&components, small)->t_label, 2000);
    put(12, 5);
    CHECK_INT(count(), 1);
    CHECK_INT(components_of(&components, small)->label, label);
}

/* No label is spent on a part that a flood would find to be the whole. */
TEST(a_circle_holds_the_long_way_round_until_its_second_gap)
{
    CHECK(rings_level(&rings, geo_rad(5), geo_rad(10)));
    begin();
    for (uint32_t d = 0; d < rings.n; d++)
        put(d, 5);
    const uint32_t labels = components.labels;
    CHECK(components_remove(&components, 12, 5));
    components_settle(&components, 2000);
    CHECK_INT(count(), 1);
    CHECK_INT(components.labels, labels);
    CHECK_INT(components_of(&components, put(50, 5))->cells, rings.n - 1);
    CHECK(components_remove(&components, 40, 5));
    components_settle(&components, 3000);
    CHECK_INT(count(), 2);
    CHECK_INT(components_of(&components, put(20, 5))->cells, 27);
}

TEST(a_broken_component_that_joins_a_larger_one_is_settled_all_the_same)
{
    CHECK(rings_level(&rings, geo_rad(5), geo_rad(10)));
    begin();
    for (uint32_t d = 0; d < 5; d++) /* 0 1 2 3 4, to break at 2 */
        put(d, 5);
    for (uint32_t d = 6; d < 30; d++)
        put(d, 5);
    CHECK(components_remove(&components, 2, 5));
    const uint32_t link = put(5, 5), alone = put(0, 5);
    components_settle(&components, 0);
    CHECK_INT(count(), 2);
    CHECK_INT(components_of(&components, link)->cells, 27);
    CHECK_INT(components_of(&components, alone)->cells, 2);
}

TEST(what_is_not_put_again_is_gone)
{
    CHECK(rings_level(&rings, geo_rad(5), geo_rad(10)));
    begin();
    components_begin(&components);
    put(1, 1);
    put(40, 9);
    components_end(&components, 1000);
    CHECK_INT(count(), 2);
    components_begin(&components);
    const uint32_t kept = components_put(&components, 40, 9, false, 1500);
    components_end(&components, 2000);
    CHECK_INT(count(), 1);
    CHECK_INT(components.used, 1);
    CHECK_INT(components_of(&components, kept)->seeds, 0);
}

TEST(a_full_pool_refuses_and_keeps_what_it_has)
{
    CHECK(rings_full(&rings, geo_rad(5)));
    begin();
    uint32_t in = 0;
    for (uint32_t d = 0; d < rings.n; d++)
        for (uint32_t layer = 0; layer < 60; layer += 3)
            in += put(d, layer) != COMPONENTS_NONE;
    CHECK_INT(in, ROOM);
    CHECK_INT(components.used, ROOM);
    /* all leave and come back before anything is settled */
    for (uint32_t i = 0; i < ROOM; i++)
        CHECK(components_remove(&components, components.cell[i].direction, components.cell[i].layer));
    for (uint32_t i = 0; i < ROOM; i++)
        CHECK(put(components.cell[i].direction, components.cell[i].layer) != COMPONENTS_NONE);
    const uint32_t before = count();
    components_settle(&components, 0);
    CHECK_INT(components.used, ROOM);
    CHECK_INT(count(), before);
}

/* ---- against a recomputation ---- */

#define MOST_DIRECTIONS 256

static bool in[MOST_DIRECTIONS][LAYERS], seed_of[MOST_DIRECTIONS][LAYERS];
static uint32_t index_of[MOST_DIRECTIONS][LAYERS];
static int part[MOST_DIRECTIONS][LAYERS];

/* Do the closed cells of two directions share a point? From their edges, in whole numbers. */
static bool share_a_point(uint32_t a, uint32_t b)
{
    const uint32_t ra = rings_ring(&rings, a), rb = rings_ring(&rings, b);
    const uint32_t n = rings.start[ra + 1] - rings.start[ra], m = rings.start[rb + 1] - rings.start[rb];
    const uint32_t p = a - rings.start[ra], q = b - rings.start[rb];
    if (ra == rb && rings.n_rings > 1 && (ra == 0 || ra == rings.n_rings - 1))
        return true;
    if (ra > rb + 1 || rb > ra + 1)
        return false;
    for (int turn = -1; turn <= 1; turn++) { /* [p/n, (p+1)/n] meets [q/m, (q+1)/m] moved by whole turns */
        const int64_t from = ((int64_t)q + turn * (int64_t)m) * n, to = from + n;
        if ((int64_t)p * m <= to && from <= ((int64_t)p + 1) * m)
            return true;
    }
    return false;
}

static void spread(uint32_t d, uint32_t layer, int label)
{
    part[d][layer] = label;
    for (uint32_t e = 0; e < rings.n; e++) {
        if (!share_a_point(d, e))
            continue;
        for (uint32_t l = layer ? layer - 1 : 0; l < LAYERS && l <= layer + 1; l++)
            if (in[e][l] && !part[e][l])
                spread(e, l, label);
    }
}

static bool equals_recomputation(void)
{
    static uint32_t of_part[MOST_DIRECTIONS * LAYERS + 1], cells[MOST_DIRECTIONS * LAYERS + 1],
        seeds[MOST_DIRECTIONS * LAYERS + 1];
    int labels = 0;
    bool same = true;
    memset(part, 0, sizeof part);
    for (uint32_t d = 0; d < rings.n; d++)
        for (uint32_t l = 0; l < LAYERS; l++)
            if (in[d][l] && !part[d][l])
                spread(d, l, ++labels);
    for (int i = 1; i <= labels; i++)
        of_part[i] = cells[i] = seeds[i] = 0;
    for (uint32_t d = 0; d < rings.n; d++) {
        for (uint32_t l = 0; l < LAYERS; l++) {
            if (!in[d][l])
                continue;
            const uint32_t label = components_of(&components, index_of[d][l])->label;
            uint32_t *known = &of_part[part[d][l]];
            same &= !*known || *known == label;
            *known = label;
            cells[part[d][l]]++;
            seeds[part[d][l]] += seed_of[d][l];
        }
    }
    for (uint32_t d = 0; d < rings.n; d++)
        for (uint32_t l = 0; l < LAYERS; l++)
            if (in[d][l]) {
                const struct component *own = components_of(&components, index_of[d][l]);
                same &= own->cells == cells[part[d][l]] && own->seeds == seeds[part[d][l]];
            }
    return same && count() == (uint32_t)labels; /* as many as parts, and one for each part: the same */
}

static void one_change(uint64_t *random, double density)
{
    const uint32_t d = (uint32_t)(test_random(random) % rings.n), l = (uint32_t)(test_random(random) % LAYERS);
    if (test_uniform(random) < density) {
        seed_of[d][l] = test_random(random) % 4 == 0;
        index_of[d][l] = components_put(&components, d, (uint16_t)l, seed_of[d][l], 0);
        in[d][l] = true;
    } else {
        CHECK_INT(components_remove(&components, d, (uint16_t)l), in[d][l]);
        in[d][l] = false;
    }
}

TEST(a_hundred_thousand_random_changes_equal_a_recomputation)
{
    uint64_t random = test_seed();
    int compared = 0;
    for (int grid = 0; grid < 10; grid++) {
        CHECK(grid % 3 ? rings_full(&rings, geo_rad(16 + 3 * grid))
                       : rings_level(&rings, geo_rad(4 + grid), geo_rad(9)));
        CHECK(rings.n <= MOST_DIRECTIONS);
        begin();
        memset(in, 0, sizeof in);
        const double density = 0.05 + 0.03 * grid;
        for (int i = 1; i <= 10000; i++) {
            one_change(&random, density);
            if (test_random(&random) % 64)
                continue;
            components_settle(&components, (uint64_t)i);
            CHECK(equals_recomputation());
            compared++;
        }
    }
    printf("# 100000 changes, compared %d times\n", compared);
}

/* The axes turn by any angle, some cells have moved, come or gone by the next look. */
TEST(after_turns_of_the_axes_all_equals_a_recomputation_and_most_labels_last)
{
    uint64_t random = test_seed();
    static bool before[MOST_DIRECTIONS][LAYERS];
    int kept = 0, parts = 0;
    for (int grid = 0; grid < 10; grid++) {
        CHECK(grid % 3 ? rings_full(&rings, geo_rad(16 + 3 * grid))
                       : rings_level(&rings, geo_rad(4 + grid), geo_rad(9)));
        begin();
        memset(in, 0, sizeof in);
        for (int look = 0; look < 60; look++) {
            const double turn = look ? 8 * test_uniform(&random) - 4 : 0;
            const uint32_t labels = components.labels;
            memcpy(before, in, sizeof in);
            memset(in, 0, sizeof in);
            components_turn(&components, turn);
            components_begin(&components);
            for (uint32_t d = 0; d < rings.n; d++)
                for (uint32_t l = 0; l < LAYERS; l++) {
                    const uint32_t at = rings_turned(&rings, d, turn);
                    if (before[d][l] ? test_uniform(&random) > 0.02 : test_uniform(&random) < 0.001)
                        in[at][l] = true;
                }
            for (uint32_t d = 0; d < rings.n; d++)
                for (uint32_t l = 0; l < LAYERS; l++)
                    if (in[d][l])
                        index_of[d][l] =
                            components_put(&components, d, (uint16_t)l, seed_of[d][l], (uint64_t)look);
            components_end(&components, (uint64_t)look);
            CHECK(equals_recomputation());
            COMPONENTS_EACH(&components, root)
            {
                parts += look > 10;
                kept += look > 10 && components_of(&components, root)->label <= labels;
            }
        }
    }
    printf("# of %d components at looks after a turn, %d had their label before\n", parts, kept);
    CHECK(kept > parts / 2);
}

/* A look may be dropped when some cells have left it and none is settled; then the axes turn. */
TEST(cells_that_leave_before_a_turn_of_the_axes_are_out_after_it)
{
    uniform(4, 120);
    begin();
    components_begin(&components);
    for (uint32_t i = 0; i < 5; i++)
        put(130 + 20 * i, 3);
    components_end(&components, 1000);
    uint32_t at = 0;
    components_begin(&components);
    CHECK(!components_leave(&components, &at, 2));
    components_turn(&components, geo_rad(9));
    components_begin(&components);
    const uint32_t again = put(rings_turned(&rings, 130, geo_rad(9)), 3);
    components_end(&components, 2000);
    CHECK_INT(components.used, 1);
    CHECK_INT(components_of(&components, again)->cells, 1);
    CHECK_INT(components_of(&components, again)->seeds, 1);
    CHECK_INT(count(), 1);
}

int main(void)
{
    RUN(components_equal_the_table);
    RUN(a_ring_around_the_pole_is_one_and_the_pole_joins_what_faces_each_other);
    RUN(the_seam_is_no_border_and_two_layers_are);
    RUN(all_cells_are_one_component);
    RUN(without_the_bridge_the_larger_part_keeps_the_label);
    RUN(a_circle_holds_the_long_way_round_until_its_second_gap);
    RUN(a_broken_component_that_joins_a_larger_one_is_settled_all_the_same);
    RUN(what_is_not_put_again_is_gone);
    RUN(a_full_pool_refuses_and_keeps_what_it_has);
    RUN(a_hundred_thousand_random_changes_equal_a_recomputation);
    RUN(after_turns_of_the_axes_all_equals_a_recomputation_and_most_labels_last);
    RUN(cells_that_leave_before_a_turn_of_the_axes_are_out_after_it);
    return test_end();
}
