/* SPDX-License-Identifier: MIT */
/*
 * clahe - positions are in half pixels, so that the centres of tiles and pixels are integers; weights are integers
 * over the product of the distances between centres.
 */
#include "clahe.h"

#include <string.h>

bool clahe_grid_ok(const struct clahe_grid *g)
{
    return g->tiles_y >= 1 && g->tiles_y <= CLAHE_MAX_TILES && g->tiles_y <= g->rows && g->tiles_x >= 1 &&
           g->tiles_x <= CLAHE_MAX_TILES && g->tiles_x <= g->columns && g->rows <= 1u << 14 &&
           g->columns <= 1u << 14 && g->clip_q100 <= CLAHE_MAX_CLIP;
}

static uint32_t bound(uint32_t tile, uint32_t length, uint32_t tiles)
{
    return (uint32_t)((uint64_t)tile * length / tiles);
}

static uint32_t tile_of(uint32_t at, uint32_t length, uint32_t tiles)
{
    return (uint32_t)(((uint64_t)(at + 1) * tiles - 1) / length);
}

uint32_t clahe_tile_row(const struct clahe_grid *g, uint32_t row)
{
    return tile_of(row, g->rows, g->tiles_y);
}

/* ---- tables ---- */

void clahe_tabulate(const uint32_t count[256], uint64_t pixels, uint32_t clip_q100, clahe_table table)
{
    uint64_t h[256], excess = 0, below = 0;
    const uint64_t share = (uint64_t)clip_q100 * pixels / 25600, limit = share > 1 ? share : 1;
    for (int v = 0; v < 256; v++) {
        h[v] = count[v];
        if (clip_q100 > 0 && h[v] > limit) {
            excess += h[v] - limit;
            h[v] = limit;
        }
    }
    const uint64_t rest = excess % 256, stride = rest ? 256 / rest : 256;
    for (uint64_t v = 0; v < 256; v++)
        h[v] += excess / 256 + (v % stride == 0 && v / stride < rest);
    for (int v = 0; v < 256; v++) {
        below += h[v];
        table[v] = (uint8_t)((2 * 255 * below + pixels) / (2 * pixels));
    }
}

/* ---- between tiles ---- */

/* The two tiles around a position, and the weights of either, which add up to `whole`. */
struct pair {
    uint32_t a, b, weight_a, weight_b, whole;
};

/* Centre of a tile in half pixels. */
static int64_t centre_of(uint32_t tile, uint32_t length, uint32_t tiles)
{
    return (int64_t)bound(tile, length, tiles) + bound(tile + 1, length, tiles);
}

/* The same where tiles go on beyond the ends, a turn apart. */
static int64_t centre_beyond(int64_t tile, uint32_t length, uint32_t tiles)
{
    const int64_t turn = 2 * (int64_t)length;
    if (tile < 0)
        return centre_of(tiles - 1, length, tiles) - turn;
    return tile < tiles ? centre_of((uint32_t)tile, length, tiles) : centre_of(0, length, tiles) + turn;
}

static struct pair alone(uint32_t tile)
{
    return (struct pair){tile, tile, 1, 0, 1};
}

/* Around the position `at`, in half pixels. */
static struct pair pair_at(int64_t at, uint32_t length, uint32_t tiles, bool wrap)
{
    uint32_t next = 0;
    while (next < tiles && centre_of(next, length, tiles) <= at)
        next++;
    if (!wrap && (next == 0 || next == tiles))
        return alone(next == 0 ? 0 : tiles - 1);
    const int64_t before = centre_beyond((int64_t)next - 1, length, tiles);
    const int64_t after = centre_beyond(next, length, tiles);
    return (struct pair){.a = next == 0 ? tiles - 1 : next - 1,
                         .b = next == tiles ? 0 : next,
                         .weight_a = (uint32_t)(after - at),
                         .weight_b = (uint32_t)(at - before),
                         .whole = (uint32_t)(after - before)};
}

/* A tile row without tables leaves its weight to the other one. False when neither has any. */
static bool only_ready(const bool *ready, struct pair *p)
{
    if (!ready || (ready[p->a] && ready[p->b]))
        return true;
    if (!ready[p->a] && !ready[p->b])
        return false;
    *p = alone(ready[p->a] ? p->a : p->b);
    return true;
}

/* The tables of all tile columns, for one row: `whole` times a grey level. */
struct blended {
    uint32_t table[CLAHE_MAX_TILES][256];
    uint32_t whole;
};

/*
 * n columns between the two tile columns of x. The tables of tile columns are blended for this row already; D is the
 * product of its whole and that of x. The quotient is (2 acc + D) / (2 D); half a unit more above does not change its
 * floor and keeps it 1 / (4 D) > 1e-10 away from any integer, where a multiplication of doubles is wrong by less than
 * 1e-13.
 */
static void blend_columns(bool keep_zero, const struct blended *row, struct pair x, uint32_t n, const uint8_t *in,
                          uint8_t *out)
{
    const uint32_t *left = row->table[x.a], *right = row->table[x.b], step = x.a == x.b ? 0 : 2;
    const uint64_t whole = (uint64_t)x.whole * row->whole;
    const double share = 1.0 / (double)(2 * whole);
    for (uint32_t i = 0; i < n; i++) {
        const uint64_t acc = (uint64_t)left[in[i]] * x.weight_a + (uint64_t)right[in[i]] * x.weight_b;
        const uint8_t level = (uint8_t)(((double)(2 * acc + whole) + 0.5) * share);
        out[i] = keep_zero && in[i] == 0 ? 0 : level;
        x.weight_a -= step;
        x.weight_b += step;
    }
}

void clahe_row(const struct clahe_grid *g, const clahe_table *table, const bool *ready, uint32_t row,
               const uint8_t *in, uint8_t *out)
{
    struct blended blended;
    const uint32_t half = !g->corner;
    struct pair y = pair_at(2 * (int64_t)row + half, g->rows, g->tiles_y, g->wrap);
    if (!only_ready(ready, &y)) {
        memmove(out, in, g->columns);
        return;
    }
    for (uint32_t b = 0; b < g->tiles_x; b++) {
        const uint8_t *upper = table[y.a * g->tiles_x + b], *lower = table[y.b * g->tiles_x + b];
        for (int v = 0; v < 256; v++)
            blended.table[b][v] = upper[v] * y.weight_a + lower[v] * y.weight_b;
    }
    blended.whole = y.whole;
    uint32_t begin = 0;
    for (uint32_t b = 0; b <= g->tiles_x; b++) {
        const uint32_t end =
            b == g->tiles_x ? g->columns : ((uint32_t)centre_of(b, g->columns, g->tiles_x) - half + 1) / 2;
        const struct pair x = pair_at(2 * (int64_t)begin + half, g->columns, g->tiles_x, false);
        if (begin < end)
            blend_columns(g->keep_zero, &blended, x, end - begin, in + begin, out + begin);
        begin = end;
    }
}

void clahe_image(const struct clahe_grid *g, const uint8_t *in, clahe_table *table, uint8_t *out)
{
    for (uint32_t a = 0; a < g->tiles_y; a++)
        for (uint32_t b = 0; b < g->tiles_x; b++) {
            const uint32_t y0 = bound(a, g->rows, g->tiles_y), y1 = bound(a + 1, g->rows, g->tiles_y);
            const uint32_t x0 = bound(b, g->columns, g->tiles_x), x1 = bound(b + 1, g->columns, g->tiles_x);
            uint32_t count[256] = {0};
            for (uint32_t y = y0; y < y1; y++)
                for (uint32_t x = x0; x < x1; x++)
                    count[in[(size_t)y * g->columns + x]]++;
            clahe_tabulate(count, (uint64_t)(y1 - y0) * (x1 - x0), g->clip_q100, table[a * g->tiles_x + b]);
        }
    for (uint32_t y = 0; y < g->rows; y++)
        clahe_row(g, (const clahe_table *)table, NULL, y, in + (size_t)y * g->columns,
                  out + (size_t)y * g->columns);
}
