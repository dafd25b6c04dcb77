/* SPDX-License-Identifier: MIT */
#include "frontier.h"

#include <string.h>

#define RING (BLOCK_SIDE + 2) /* a block's columns and one more on every side */

/* A block with its ring: per column the word below, its own and the one above. */
struct surroundings {
    uint64_t free[RING][RING][3], heard[RING][RING][3];
};

size_t frontier_bytes(uint32_t n)
{
    bool fits = n >= 1024 && n <= 1u << 24 && (n & (n - 1)) == 0;
    return fits ? n * sizeof(struct frontier_block) : 0;
}

void frontier_init(struct frontier *f, struct voxmask *mask, void *memory, uint32_t n)
{
    *f = (struct frontier){.mask = mask, .block = memory, .n = n};
    memset(memory, 0, frontier_bytes(n));
}

static struct block_key beside(const struct block_key *key, int n)
{
    return (struct block_key){{key->at[0] + n / 9 - 1, key->at[1] + n / 3 % 3 - 1, key->at[2] + n % 3 - 1}};
}

/* Columns of the ring that the block beside (-1, 0, 1) gives, and where in it they begin. */
static void columns_of(int step, int *ring, int *own, int *n)
{
    *ring = step < 0 ? 0 : step == 0 ? 1 : RING - 1;
    *own = step < 0 ? BLOCK_SIDE - 1 : 0;
    *n = step == 0 ? BLOCK_SIDE : 1;
}

static void gather_blocks(struct voxmask *mask, const struct block_key *key, struct surroundings *s)
{
    for (int n = 0; n < 27; n++) {
        struct block_key at = beside(key, n);
        const struct merge_block *bits = &voxmask_block(mask, &at)->bits;
        int i_ring, i_own, i_n, j_ring, j_own, j_n;
        columns_of(n / 9 - 1, &i_ring, &i_own, &i_n);
        columns_of(n / 3 % 3 - 1, &j_ring, &j_own, &j_n);
        for (int i = 0; i < i_n; i++)
            for (int j = 0; j < j_n; j++) {
                int column = (i_own + i) * BLOCK_SIDE + j_own + j;
                s->free[i_ring + i][j_ring + j][n % 3] = bits->free[column];
                s->heard[i_ring + i][j_ring + j][n % 3] = bits->heard[column];
            }
    }
}

/* Bits whose neighbours along the column are set too; and bits that are set or have a set neighbour there. */
static uint64_t both_beside(const uint64_t w[3])
{
    return w[1] & (w[1] << 1 | w[0] >> 63) & (w[1] >> 1 | w[2] << 63);
}

static uint64_t any_beside(const uint64_t w[3])
{
    return w[1] | (w[1] << 1 | w[0] >> 63) | (w[1] >> 1 | w[2] << 63);
}

static void extract(const struct surroundings *s, struct frontier_block *out)
{
    uint64_t within[RING][RING], near_heard[RING][RING];
    for (int i = 0; i < RING; i++)
        for (int j = 0; j < RING; j++) {
            within[i][j] = both_beside(s->free[i][j]);
            near_heard[i][j] = any_beside(s->heard[i][j]);
        }
    for (int i = 1; i <= BLOCK_SIDE; i++)
        for (int j = 1; j <= BLOCK_SIDE; j++) {
            uint64_t inner = UINT64_MAX, heard = 0;
            for (int n = 0; n < 9; n++) {
                inner &= within[i + n / 3 - 1][j + n % 3 - 1];
                heard |= near_heard[i + n / 3 - 1][j + n % 3 - 1];
            }
            int column = (i - 1) * BLOCK_SIDE + j - 1;
            out->surface[column] = s->free[i][j][1] & ~inner;
            out->echo[column] = out->surface[column] & heard;
        }
}

/* Has the block or one around it become another since this frontier was made? */
static bool is_stale(struct frontier *f, const struct frontier_block *b, const struct block_key *key)
{
    if (b->head.checked == 0)
        return true;
    if (!merge_around_changed(f->mask->map, key, b->head.checked))
        return false;
    for (int n = 0; n < 27; n++) {
        struct block_key at = beside(key, n);
        if (voxmask_block(f->mask, &at)->changed > b->made)
            return true;
    }
    return false;
}

const struct frontier_block *frontier_block(struct frontier *f, const struct block_key *key)
{
    struct frontier_block *b = (struct frontier_block *)block_find(f->block, sizeof *b, f->n, key);
    uint64_t now = voxmap_changed(f->mask->map);
    struct surroundings s;
    if (b->head.checked == now)
        return b;
    if (is_stale(f, b, key)) {
        gather_blocks(f->mask, key, &s);
        extract(&s, b);
        b->made = now;
        f->computed++;
    }
    b->head.checked = now;
    return b;
}

/* Where the free volume grows: the sum of the directions to the free ones of 26 neighbours. */
static void normal_at(const struct surroundings *s, int i, int j, int k, float normal[3])
{
    int sum[3] = {0};
    for (int n = 0; n < 27; n++) {
        const int step[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
        const uint64_t *w = s->free[i + 1 + step[0]][j + 1 + step[1]];
        int at = k + step[2] + 64;
        int is_free = (int)(w[at / 64] >> at % 64 & 1);
        for (int a = 0; a < 3; a++)
            sum[a] += is_free * step[a];
    }
    float length = sqrtf((float)(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]));
    for (int a = 0; a < 3; a++)
        normal[a] = length > 0 ? (float)sum[a] / length : 0;
}

void frontier_points(struct frontier *f, const struct block_key *key, frontier_take *take, void *context)
{
    const struct frontier_block *b = frontier_block(f, key);
    const double voxel_m = f->mask->map->set.voxel_m;
    struct surroundings s;
    bool gathered = false;
    for (int column = 0; column < BLOCK_COLUMNS; column++) {
        for (uint64_t left = b->surface[column]; left; left &= left - 1) {
            int i = column / BLOCK_SIDE, j = column % BLOCK_SIDE, k = __builtin_ctzll(left);
            struct frontier_point point = {
                .cell = {key->at[0] * BLOCK_SIDE + i, key->at[1] * BLOCK_SIDE + j, key->at[2] * BLOCK_HEIGHT + k},
                .tag = b->echo[column] >> k & 1 ? FRONTIER_ECHO : FRONTIER_LIMIT,
            };
            if (!gathered)
                gather_blocks(f->mask, key, &s);
            gathered = true;
            for (int a = 0; a < 3; a++)
                point.position_m[a] = ((double)point.cell[a] + 0.5) * voxel_m;
            normal_at(&s, i, j, k, point.normal);
            take(context, &point);
        }
    }
}

void frontier_all(struct frontier *f, frontier_take *take, void *context)
{
    struct merge_walk walk = {0};
    struct block_key key;
    while (merge_next(f->mask->map, &walk, &key))
        frontier_points(f, &key, take, context);
}
