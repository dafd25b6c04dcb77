/* SPDX-License-Identifier: MIT */
/* test_layers - edges and indexes of the radial layers against tables of 50 digits, and the extreme growths. */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include <float.h>

#include "grid/sphere/layers.h"

static double edge[LAYERS_MAX + 1];
static struct layers_conf sets[64];

static void read_sets(void)
{
    struct table t = table_open("tests/oracles/layer_sets.csv");
    while (table_next(&t))
        sets[table_int(&t, 0)] = (struct layers_conf){.r_min_m = table_real(&t, 1),
                                                      .r_max_m = table_real(&t, 2),
                                                      .dr_m = table_real(&t, 3),
                                                      .growth = table_real(&t, 4),
                                                      .n_const = (uint32_t)table_int(&t, 5)};
}

TEST(counts_equal_table)
{
    struct table t = table_open("tests/oracles/layer_sets.csv");
    while (table_next(&t)) {
        long want = table_int(&t, 6), got = (long)layers_count(&sets[table_int(&t, 0)]);
        bool tie = table_real(&t, 7) < 1e-12;
        CHECK(got == want || (tie && labs(got - want) <= 1));
    }
}

TEST(edges_equal_table)
{
    struct table t = table_open("tests/oracles/layer_edges.csv");
    int rows = 0;
    while (table_next(&t)) {
        const struct layers_conf *c = &sets[table_int(&t, 0)];
        uint32_t i = (uint32_t)table_int(&t, 1);
        double want = strtod(t.field[3], NULL), got = layers_edge(c, i);
        CHECK_NEAR(got, want, (4 + i * log(c->growth)) * DBL_EPSILON, 0);
        rows++;
    }
    CHECK(rows > 1000);
}

TEST(indexes_equal_table)
{
    struct table t = table_open("tests/oracles/layer_index.csv");
    struct layers layers = {0};
    long set = -1, rows = 0;
    while (table_next(&t)) {
        if (table_int(&t, 0) != set) {
            set = table_int(&t, 0);
            layers_init(&layers, &sets[set], edge);
        }
        if (table_real(&t, 4) <= 8) /* decided by the rounding of an edge: our own table rules, next test */
            continue;
        CHECK_INT(layers_index(&layers, strtod(t.field[1], NULL)), table_int(&t, 3));
        rows++;
    }
    CHECK(rows > 100);
}

TEST(every_edge_and_its_neighbours_follow_the_own_table)
{
    for (int set = 0; set < 9; set++) {
        struct layers l;
        layers_init(&l, &sets[set], edge);
        for (uint32_t i = 0; i < l.n; i++) {
            CHECK(edge[i] < edge[i + 1]);
            CHECK_INT(layers_index(&l, edge[i]), i);
            CHECK_INT(layers_index(&l, nextafter(edge[i], -1)), i ? (int32_t)i - 1 : LAYERS_BELOW);
            CHECK_INT(layers_index(&l, nextafter(edge[i + 1], -1)), i);
        }
        CHECK_INT(layers_index(&l, edge[l.n]), LAYERS_BEYOND);
        CHECK_INT(layers_index(&l, NAN), LAYERS_BEYOND);
        CHECK_INT(layers_index(&l, INFINITY), LAYERS_BEYOND);
        CHECK_INT(layers_index(&l, -1), LAYERS_BELOW);
    }
}

TEST(zero_belongs_to_the_first_layer)
{
    struct layers_conf c = {.r_max_m = 10, .dr_m = 0.1, .n_const = 10, .growth = 1.05};
    struct layers l;
    layers_init(&l, &c, edge);
    CHECK_INT(layers_index(&l, 0), 0);
}

TEST(growths_next_to_one_and_beyond_two)
{
    static const double growth[] = {1, 1 + DBL_EPSILON, 1 + 1e-12, 1.0000001, 2, 1e3};
    for (size_t i = 0; i < sizeof growth / sizeof growth[0]; i++) {
        struct layers_conf c = {.r_max_m = 50, .dr_m = 0.02, .n_const = 1, .growth = growth[i]};
        struct layers l;
        layers_init(&l, &c, edge);
        for (uint32_t k = 0; k < l.n; k++)
            CHECK(edge[k] < edge[k + 1]);
        CHECK(edge[l.n] >= 50 && edge[l.n - 1] < 50);
    }
}

TEST(senseless_layers_are_refused)
{
    static const struct layers_conf bad[] = {
        {.r_max_m = 10, .dr_m = 0.1, .growth = 0.9},       {.r_max_m = 10, .dr_m = 0, .growth = 1.1},
        {.r_max_m = 10, .dr_m = -1, .growth = 1.1},        {.r_max_m = 0, .dr_m = 0.1, .growth = 1.1},
        {.r_max_m = 1e9, .dr_m = 1e-3, .growth = 1},       {.r_max_m = NAN, .dr_m = 0.1, .growth = 1.1},
        {.r_max_m = INFINITY, .dr_m = 0.1, .growth = 1.1},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        CHECK_INT(layers_count(&bad[i]), 0);
}

int main(void)
{
    read_sets();
    RUN(counts_equal_table);
    RUN(edges_equal_table);
    RUN(indexes_equal_table);
    RUN(every_edge_and_its_neighbours_follow_the_own_table);
    RUN(zero_belongs_to_the_first_layer);
    RUN(growths_next_to_one_and_beyond_two);
    RUN(senseless_layers_are_refused);
    return test_end();
}
