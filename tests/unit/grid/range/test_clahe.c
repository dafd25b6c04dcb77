/* SPDX-License-Identifier: MIT */
/*
 * test_clahe - the exact filter against the reference images and its symmetries; the causal one against the exact
 * tables of whole tiles, in whatever order rows come.
 */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include "grid/range/clahe_causal.h"

#define SIDE 64

struct picture {
    uint8_t at[SIDE * SIDE];
};

static clahe_table table[CLAHE_MAX_TILES * CLAHE_MAX_TILES];

static uint32_t read_hex(const char *text, uint8_t *to)
{
    uint32_t n = 0;
    for (; text[2 * n] && text[2 * n + 1]; n++) {
        const char digits[3] = {text[2 * n], text[2 * n + 1], '\0'};
        to[n] = (uint8_t)strtoul(digits, NULL, 16);
    }
    return n;
}

/* I5: constant, zeros, saturated, one tile, no limit and a limit of one among them */
TEST(images_equal_the_table)
{
    struct table cases = table_open("tests/oracles/clahe_cases.csv");
    struct table pixels = table_open("tests/oracles/clahe_pixels.csv");
    int images = 0;
    while (table_next(&cases)) {
        const struct clahe_grid g = {.rows = (uint32_t)table_int(&cases, 2),
                                     .columns = (uint32_t)table_int(&cases, 3),
                                     .tiles_y = (uint32_t)table_int(&cases, 4),
                                     .tiles_x = (uint32_t)table_int(&cases, 5),
                                     .clip_q100 = (uint32_t)table_int(&cases, 6),
                                     .corner = table_int(&cases, 7) == 0,
                                     .wrap = table_int(&cases, 8) == 1};
        static struct picture in, want, got;
        CHECK(clahe_grid_ok(&g));
        for (uint32_t y = 0; y < g.rows; y++) {
            CHECK(table_next(&pixels));
            CHECK_INT(table_int(&pixels, 0), table_int(&cases, 0));
            CHECK_INT(read_hex(pixels.field[2], in.at + y * g.columns), g.columns);
            read_hex(pixels.field[3], want.at + y * g.columns);
        }
        clahe_image(&g, in.at, table, got.at);
        if (memcmp(got.at, want.at, g.rows * g.columns) != 0) {
            printf("case %s %s differs\n", cases.field[0], cases.field[1]);
            test_case_failed = true;
        }
        images++;
    }
    CHECK_INT(images, 89);
}

/* I5 */
TEST(more_tiles_than_rows_are_refused)
{
    const struct clahe_grid good = {.rows = 8, .columns = 8, .tiles_y = 8, .tiles_x = 8, .clip_q100 = 1};
    struct clahe_grid g = good;
    CHECK(clahe_grid_ok(&g));
    g.rows = 7;
    CHECK(!clahe_grid_ok(&g));
    g = good;
    g.columns = 7;
    CHECK(!clahe_grid_ok(&g));
    g = good;
    g.tiles_x = 0;
    CHECK(!clahe_grid_ok(&g));
    g = good;
    g.clip_q100 = CLAHE_MAX_CLIP + 1;
    CHECK(!clahe_grid_ok(&g));
}

static void make(struct picture *p, uint32_t n, uint64_t *random)
{
    for (uint32_t i = 0; i < n * n; i++)
        p->at[i] = (uint8_t)(test_random(random) % (1 + (i % n) * 8));
}

/* I6: a change of the input and the same change of the output commute */
TEST(mirrored_transposed_and_rolled_images)
{
    uint64_t random = test_seed();
    static struct picture in, out, changed, got, want;
    const uint32_t n = 32;
    for (int round = 0; round < 20; round++) {
        const struct clahe_grid g = {.rows = n,
                                     .columns = n,
                                     .tiles_y = round & 1 ? 4 : 8,
                                     .tiles_x = round & 1 ? 4 : 8,
                                     .clip_q100 = (uint32_t)(round * 40),
                                     .wrap = round & 2};
        make(&in, n, &random);
        clahe_image(&g, in.at, table, out.at);
        for (int change = 0; change < 4; change++) {
            if ((change == 2 && g.wrap) || (change == 3 && !g.wrap))
                continue; /* transposed, the wrap would be along the other axis */
            for (uint32_t y = 0; y < n; y++)
                for (uint32_t x = 0; x < n; x++) {
                    const uint32_t from = change == 0   ? (n - 1 - y) * n + x
                                          : change == 1 ? y * n + n - 1 - x
                                          : change == 2 ? x * n + y
                                                        : (y + n / g.tiles_y) % n * n + x;
                    changed.at[y * n + x] = in.at[from];
                    want.at[y * n + x] = out.at[from];
                }
            clahe_image(&g, changed.at, table, got.at);
            CHECK(memcmp(got.at, want.at, n * n) == 0);
        }
    }
}

/* I6 */
TEST(zeros_stay_zero_where_they_mean_removed)
{
    struct clahe_grid g = {
        .rows = 16, .columns = 16, .tiles_y = 2, .tiles_x = 2, .clip_q100 = 200, .keep_zero = true};
    static struct picture in, out;
    memset(&in, 0, sizeof in);
    clahe_image(&g, in.at, table, out.at);
    for (int i = 0; i < 256; i++)
        CHECK_INT(out.at[i], 0);
    in.at[5] = 9;
    clahe_image(&g, in.at, table, out.at);
    CHECK(out.at[5] > 9 && out.at[6] == 0);
    g.keep_zero = false;
    clahe_image(&g, in.at, table, out.at);
    CHECK(out.at[6] > 0);
}

/* ---- causal ---- */

static struct clahe_causal causal;
static _Alignas(16) uint8_t memory[1 << 18];

static void begin(uint32_t rows, uint32_t bins)
{
    CHECK(clahe_causal_size(SIDE, SIDE) <= sizeof memory);
    clahe_causal_init(&causal, memory, SIDE, SIDE, 200);
    clahe_causal_begin(&causal, rows, bins);
}

TEST(causal_of_the_second_turn_of_a_still_image_is_exact)
{
    static struct picture in, want;
    uint64_t random = test_seed();
    uint8_t got[SIDE];
    const struct clahe_grid g = {.rows = SIDE,
                                 .columns = SIDE,
                                 .tiles_y = CLAHE_CAUSAL_TILES,
                                 .tiles_x = CLAHE_CAUSAL_TILES,
                                 .clip_q100 = 200,
                                 .wrap = true,
                                 .keep_zero = true};
    make(&in, SIDE, &random);
    clahe_image(&g, in.at, table, want.at);
    begin(SIDE, SIDE);
    for (uint32_t i = 0; i < 2 * SIDE; i++) {
        const uint32_t y = i % SIDE;
        clahe_causal_row(&causal, y, false, in.at + y * SIDE, got);
        if (i == 0)
            CHECK(memcmp(got, in.at, SIDE) == 0); /* no table yet */
        if (i >= SIDE)
            CHECK(memcmp(got, want.at + y * SIDE, SIDE) == 0);
    }
}

TEST(causal_is_the_same_whatever_the_order_inside_a_tile)
{
    static struct picture in;
    static clahe_table forward[CLAHE_CAUSAL_TILES * CLAHE_CAUSAL_TILES];
    uint64_t random = test_seed();
    uint8_t out[SIDE];
    make(&in, SIDE, &random);
    for (int backward = 0; backward < 2; backward++) {
        begin(SIDE, SIDE);
        for (uint32_t i = 0; i < SIDE; i++) {
            const uint32_t height = SIDE / CLAHE_CAUSAL_TILES, within = i % height;
            const uint32_t y = i - within + (backward ? height - 1 - within : within);
            clahe_causal_row(&causal, y, i % 5 == 0 && within == 0, in.at + y * SIDE, out);
        }
        clahe_causal_row(&causal, 0, true, in.at, out);
        if (!backward)
            memcpy(forward, causal.table, sizeof forward);
    }
    CHECK(memcmp(forward, causal.table, sizeof forward) == 0);
}

TEST(causal_in_a_sector_uses_only_tiles_that_were_seen)
{
    static struct picture in;
    uint64_t random = test_seed();
    uint8_t out[SIDE];
    make(&in, SIDE, &random);
    begin(SIDE, SIDE);
    for (int sweep = 0; sweep < 4; sweep++)
        for (uint32_t i = 0; i < 6; i++) {
            const uint32_t y = sweep & 1 ? 21 - i : 16 + i; /* inside tile 2 */
            clahe_causal_row(&causal, y, i == 0, in.at + y * SIDE, out);
        }
    for (uint32_t tile = 0; tile < CLAHE_CAUSAL_TILES; tile++)
        CHECK_INT(causal.ready[tile], tile == 2);
    CHECK(memcmp(out, in.at + 16 * SIDE, SIDE) != 0);
}

TEST(causal_with_fewer_rows_than_tiles)
{
    uint8_t in[3] = {10, 20, 30}, out[3];
    begin(1, 3);
    for (int i = 0; i < 3; i++)
        clahe_causal_row(&causal, 0, false, in, out);
    CHECK(out[2] >= out[1] && out[1] >= out[0]);
    CHECK_INT(causal.grid.tiles_y, 1);
    CHECK_INT(causal.grid.tiles_x, 3);
}

int main(void)
{
    RUN(images_equal_the_table);
    RUN(more_tiles_than_rows_are_refused);
    RUN(mirrored_transposed_and_rolled_images);
    RUN(zeros_stay_zero_where_they_mean_removed);
    RUN(causal_of_the_second_turn_of_a_still_image_is_exact);
    RUN(causal_is_the_same_whatever_the_order_inside_a_tile);
    RUN(causal_in_a_sector_uses_only_tiles_that_were_seen);
    RUN(causal_with_fewer_rows_than_tiles);
    return test_end();
}
