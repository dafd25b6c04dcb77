/* SPDX-License-Identifier: MIT */
/* test_residual - residual.h: never fewer echoes than were added, whatever the table's size,
 * its age and what it is joined with. */
#include "grid/voxel/residual.h"
#include "tests/lib/test.h"

#define CUBES 20 /* along a side of the world that is tried */

static uint32_t truth[CUBES][CUBES][CUBES];

static struct residual residual_new(uint32_t n)
{
    struct residual v;
    void *memory = malloc(residual_bytes(n));
    CHECK(memory != NULL);
    residual_init(&v, memory, n);
    return v;
}

static void residual_free(struct residual *v)
{
    free(v->stamp);
}

static void add_some(struct residual *v, uint64_t *seed, int adds)
{
    for (int n = 0; n < adds; n++) {
        int64_t cube[3];
        const uint32_t echoes = (uint32_t)(4 * test_uniform(seed));
        for (int a = 0; a < 3; a++)
            cube[a] = (int64_t)(CUBES * test_uniform(seed));
        truth[cube[0]][cube[1]][cube[2]] += echoes;
        residual_add(v, (const int64_t[3]){cube[0] - CUBES / 2, cube[1] - CUBES / 2, cube[2] - CUBES / 2}, echoes,
                     7);
    }
}

/* Cubes of which less is told than is true, and *more: of which more. */
static int too_few(const struct residual *v, int *more)
{
    int few = 0;
    *more = 0;
    for (int c = 0; c < CUBES * CUBES * CUBES; c++) {
        const int at[3] = {c / CUBES / CUBES, c / CUBES % CUBES, c % CUBES};
        int64_t cell[3];
        bool known;
        for (int a = 0; a < 3; a++)
            cell[a] = (int64_t)(at[a] - CUBES / 2) * RESIDUAL_CUBE + c % RESIDUAL_CUBE;
        const uint32_t true_echoes = truth[at[0]][at[1]][at[2]], told = residual_echoes(v, cell, &known);
        few += told < (true_echoes < 254 ? true_echoes : 254);
        few += true_echoes > 0 && !known;
        *more += told > true_echoes;
    }
    return few;
}

TEST(never_fewer_than_were_added)
{
    uint64_t seed = test_seed();
    for (uint32_t n = 1u << 12; n <= 1u << 18; n *= 8) {
        struct residual v = residual_new(n);
        int more;
        memset(truth, 0, sizeof truth);
        CHECK(!v.any && too_few(&v, &more) == 0 && more == 0);
        for (int round = 0; round < 4; round++) {
            add_some(&v, &seed, 2000);
            CHECK_INT(too_few(&v, &more), 0);
        }
        CHECK(more < (n < 1u << 18 ? 8000 : 100)); /* and in a large table rarely more */
        CHECK_INT(residual_stamp(&v, 0, 0), 7);
        residual_clear(&v);
        memset(truth, 0, sizeof truth);
        CHECK(too_few(&v, &more) == 0 && more == 0);
        residual_free(&v);
    }
}

TEST(counts_stop_at_254)
{
    struct residual v = residual_new(1u << 12);
    const int64_t cube[3] = {-1, 2, -3}, cell[3] = {-8, 23, -17};
    bool known;
    for (int n = 0; n < 300; n++)
        residual_add(&v, cube, 1, 1);
    CHECK_INT(residual_echoes(&v, cell, &known), 254);
    residual_add(&v, cube, 255, 1);
    CHECK_INT(residual_echoes(&v, cell, &known), 254);
    residual_free(&v);
}

TEST(ageing_halves_and_leaves_one)
{
    struct residual v = residual_new(1u << 16);
    const int64_t heard[3] = {1, 2, 3}, silent[3] = {1, 2, 4}, cell[3] = {8, 16, 24}, quiet[3] = {8, 16, 32};
    static const uint32_t want[] = {7, 4, 2, 1, 1};
    bool known;
    residual_add(&v, heard, 7, 1);
    residual_add(&v, silent, 0, 1);
    for (int n = 0; n < 5; n++, residual_halve(&v)) {
        CHECK_INT(residual_echoes(&v, cell, &known), want[n]);
        CHECK(residual_echoes(&v, quiet, &known) == 0 && known);
    }
    residual_free(&v);
}

/* Tables of other sizes, as maps with another memory have them. */
TEST(joined_tables_know_what_both_knew)
{
    static const uint32_t size[][2] = {{1u << 12, 1u << 16}, {1u << 16, 1u << 12}, {1u << 14, 1u << 14}};
    uint64_t seed = test_seed();
    for (int s = 0; s < 3; s++) {
        struct residual v = residual_new(size[s][0]), other = residual_new(size[s][1]);
        int more;
        memset(truth, 0, sizeof truth);
        add_some(&v, &seed, 1000);
        add_some(&other, &seed, 1000);
        residual_join(&v, other.count, other.n);
        CHECK_INT(too_few(&v, &more), 0);
        residual_free(&v);
        residual_free(&other);
    }
}

/* Of cubes that do not meet in the table no echo is added that nobody heard: it would make water unknown for good. */
TEST(joined_counts_add_up)
{
    static const struct {
        int own, others; /* -1: nothing was forgotten there */
        uint32_t want;
    } row[] = {{3, 4, 7}, {0, 0, 0}, {0, 2, 2}, {2, 0, 2}, {5, -1, 5}, {-1, 5, 5}, {-1, 0, 0}, {200, 100, 254}};
    struct residual v = residual_new(1u << 16), other = residual_new(1u << 16);
    for (int i = 0; i < 8; i++) {
        const int64_t cube[3] = {i, 2, 3};
        if (row[i].own >= 0)
            residual_add(&v, cube, (uint32_t)row[i].own, 1);
        if (row[i].others >= 0)
            residual_add(&other, cube, (uint32_t)row[i].others, 1);
    }
    residual_join(&v, other.count, other.n);
    for (int i = 0; i < 8; i++) {
        bool known;
        CHECK_INT(residual_echoes(&v, (const int64_t[3]){RESIDUAL_CUBE * i, 16, 24}, &known), row[i].want);
        CHECK(known);
    }
    residual_free(&v);
    residual_free(&other);
}

TEST(the_table_grows_with_the_map)
{
    CHECK_INT(residual_cells(0), 1u << 12);
    CHECK_INT(residual_cells((size_t)64 << 20), 1u << 20);
    CHECK_INT(residual_cells((size_t)63 << 20), 1u << 19);
    CHECK_INT(residual_cells(SIZE_MAX), 1u << 22);
}

int main(void)
{
    RUN(never_fewer_than_were_added);
    RUN(counts_stop_at_254);
    RUN(ageing_halves_and_leaves_one);
    RUN(joined_tables_know_what_both_knew);
    RUN(joined_counts_add_up);
    RUN(the_table_grows_with_the_map);
    return test_end();
}
