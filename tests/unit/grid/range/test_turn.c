/* SPDX-License-Identifier: MIT */
/* test_turn - histograms kept up to date row by row equal those counted anew. */
#include "tests/lib/test.h"

#include "grid/range/turn.h"

#define ROWS  40
#define BINS  33
#define TILES 12

static _Alignas(16) uint8_t memory[1 << 16];

/* What the image should hold: the newest row of each of the last turn and a half of puts. */
struct model {
    uint8_t bin[ROWS][BINS];
    uint64_t put[ROWS], puts;
};

static void model_put(struct model *m, uint32_t rows, uint32_t row, const uint8_t *bin, uint32_t bins)
{
    memcpy(m->bin[row], bin, bins);
    m->put[row] = ++m->puts;
    for (uint32_t y = 0; y < rows; y++)
        if (m->put[y] && m->puts - m->put[y] >= rows + (rows + 1) / 2)
            m->put[y] = 0;
}

static bool same(const struct turn *t, const struct model *m)
{
    for (uint32_t a = 0; a < t->tiles_y; a++)
        for (uint32_t b = 0; b < t->tiles_x; b++) {
            uint32_t want[256] = {0};
            uint64_t pixels, total = 0;
            for (uint32_t y = a * t->rows / t->tiles_y; y < (a + 1) * t->rows / t->tiles_y; y++)
                for (uint32_t x = b * t->bins / t->tiles_x; x < (b + 1) * t->bins / t->tiles_x; x++)
                    if (m->put[y]) {
                        want[m->bin[y][x]]++;
                        total++;
                    }
            const uint32_t *got = turn_histogram(t, a, b, &pixels);
            if (pixels != total || memcmp(got, want, sizeof want) != 0)
                return false;
        }
    return true;
}

static void run(int puts, int check_every, uint64_t *random)
{
    static struct model model;
    struct turn t;
    const uint32_t rows = 1 + (uint32_t)(test_random(random) % ROWS),
                   bins = 1 + (uint32_t)(test_random(random) % BINS);
    const uint32_t tiles_y = 1 + (uint32_t)(test_random(random) % (rows < 4 ? rows : 4));
    const uint32_t tiles_x = 1 + (uint32_t)(test_random(random) % (bins < 3 ? bins : 3));
    uint32_t row = 0;
    memset(&model, 0, sizeof model);
    memset(memory, 0x55, sizeof memory);
    turn_init(&t, memory, ROWS, BINS, TILES);
    turn_begin(&t, rows, bins, tiles_y, tiles_x);
    for (int i = 1; i <= puts; i++) {
        uint8_t bin[BINS];
        for (uint32_t x = 0; x < bins; x++)
            bin[x] = (uint8_t)(test_random(random) >> (test_random(random) & 7));
        row = test_random(random) % 20 ? (row + 1) % rows : (uint32_t)(test_random(random) % rows);
        turn_put(&t, row, bin);
        model_put(&model, rows, row, bin, bins);
        if (i % check_every == 0)
            CHECK(same(&t, &model));
    }
}

TEST(histograms_equal_a_recount)
{
    uint64_t random = test_seed();
    CHECK(turn_size(ROWS, BINS, TILES) <= sizeof memory);
    for (int round = 0; round < 40; round++)
        run(300, 1, &random);
}

/* I9; 1e7 with SONARD_LONG set */
TEST(histograms_equal_a_recount_after_many_rows)
{
    uint64_t random = test_seed();
    const int puts = getenv("SONARD_LONG") ? 10000000 : 200000;
    run(puts, puts / 10, &random);
}

TEST(a_row_not_seen_for_a_turn_and_a_half_is_forgotten)
{
    struct turn t;
    const uint8_t loud[4] = {9, 9, 9, 9}, still[4] = {0};
    uint64_t pixels;
    turn_init(&t, memory, ROWS, BINS, TILES);
    turn_begin(&t, 10, 4, 1, 1);
    turn_put(&t, 9, loud);
    for (uint32_t i = 0; i < 14; i++)
        turn_put(&t, i % 3, still);
    CHECK_INT(turn_histogram(&t, 0, 0, &pixels)[9], 4);
    turn_put(&t, 1, still);
    CHECK_INT(turn_histogram(&t, 0, 0, &pixels)[9], 0);
    CHECK_INT(pixels, 12);
}

int main(void)
{
    RUN(histograms_equal_a_recount);
    RUN(histograms_equal_a_recount_after_many_rows);
    RUN(a_row_not_seen_for_a_turn_and_a_half_is_forgotten);
    return test_end();
}
