/* SPDX-License-Identifier: MIT */
#include "merge.h"

#include <string.h>

#include "resample.h"
#include "wide.h"

static inline uint32_t faded_vacancy(uint32_t count, unsigned shift)
{
    return count >> shift;
}

/* What one submap says of a cell of its own lattice. */
static struct merge_sum own_sum(const struct voxmap *m, const struct voxmap_part *p, const int64_t cell[3])
{
    struct merge_sum sum = {0};
    unsigned shift = voxmap_shift(m, p);
    if (!lattice_holds(&p->map.box, cell))
        return sum;
    sum.vacancy = faded_vacancy(submap_count(&p->map, SUBMAP_VACANCY, cell), shift);
    sum.echoes = voxmap_faded_echoes(submap_count(&p->map, SUBMAP_ECHOES, cell), shift);
    return sum;
}

/* What a corrected submap says of a cell of the world. */
static struct merge_sum pulled_sum(const struct voxmap *m, const struct voxmap_part *p,
                                   const struct resample *resample, const int64_t cell[3])
{
    struct merge_sum sum = {.vacancy = UINT32_MAX};
    const int64_t *first = p->map.box.first;
    struct resample_cell at;
    if (!resample_cell(resample, cell, &at))
        return (struct merge_sum){0};
    for (int n = 0; n < 8; n++) {
        const int step[3] = {n & 1, n >> 1 & 1, n >> 2};
        if ((step[0] && !at.pair[0]) || (step[1] && !at.pair[1]) || (step[2] && !at.pair[2]))
            continue;
        int64_t own[3];
        for (int a = 0; a < 3; a++)
            own[a] = first[a] + at.least[a] + step[a];
        struct merge_sum one = own_sum(m, p, own);
        sum.vacancy = one.vacancy < sum.vacancy ? one.vacancy : sum.vacancy;
        sum.echoes = one.echoes > sum.echoes ? one.echoes : sum.echoes;
    }
    return sum;
}

static struct merge_sum moved_sum(const struct voxmap *m, const struct voxmap_part *p, const int64_t cell[3])
{
    struct resample resample;
    resample_of(&resample, p);
    return pulled_sum(m, p, &resample, cell);
}

struct merge_sum merge_sum(const struct voxmap *m, const int64_t cell[3])
{
    struct merge_sum sum = {0};
    for (uint32_t n = 0; n < m->set.max_submaps; n++) {
        const struct voxmap_part *p = &m->part[n];
        if (!p->id)
            continue;
        struct merge_sum one = p->moved ? moved_sum(m, p, cell) : own_sum(m, p, cell);
        sum.vacancy += one.vacancy;
        sum.echoes += one.echoes;
    }
    sum.residual = residual_echoes(&m->residual, cell, &sum.lost);
    return sum;
}

static enum voxel_state judge_sum(const struct voxmap *m, const struct merge_sum *sum)
{
    if (voxel_judge(&m->rule, sum->vacancy, sum->echoes + sum->residual) == VOXEL_FREE)
        return VOXEL_FREE;
    return sum->echoes ? VOXEL_OCCUPIED : VOXEL_UNKNOWN;
}

enum voxel_state merge_at(const struct voxmap *m, const int64_t cell[3])
{
    struct merge_sum sum = merge_sum(m, cell);
    return judge_sum(m, &sum);
}

/* ---- blocks ---- */

/* An uncorrected submap's part in a block: the tile over it, and which of its heights. */
struct layer {
    uint32_t tile;
    unsigned shift;
    int32_t first, end, skip; /* cells of the block; the first of the column */
};

/* Whether an uncorrected submap has a tile that reaches into a block. */
static bool layer_in(const struct voxmap *m, const struct voxmap_part *p, const struct block_key *key,
                     struct layer *out, uint32_t *entry)
{
    const struct lattice_box *box = &p->map.box;
    int64_t i = key->at[0] * BLOCK_SIDE - box->first[0], j = key->at[1] * BLOCK_SIDE - box->first[1];
    int64_t k = key->at[2] * BLOCK_HEIGHT - box->first[2];
    if (i < 0 || i >= box->size[0] || j < 0 || j >= box->size[1] || k <= -BLOCK_HEIGHT || k >= box->size[2])
        return false;
    *entry = (uint32_t)submap_entry(&p->map, (int32_t)i, (int32_t)j);
    out->tile = p->map.tile[*entry];
    out->shift = voxmap_shift(m, p);
    out->first = k < 0 ? (int32_t)-k : 0;
    out->end = box->size[2] - k < BLOCK_HEIGHT ? (int32_t)(box->size[2] - k) : BLOCK_HEIGHT;
    out->skip = k < 0 ? 0 : (int32_t)k;
    return out->tile != TILE_NONE;
}

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "bytes are packed eight at a time, the first lowest");

/* The lowest bits of 64 bytes, the first lowest. */
static uint64_t pack(const uint8_t flag[BLOCK_HEIGHT])
{
    uint64_t bits = 0, eight;
    for (int n = 0; n < BLOCK_HEIGHT; n += 8) {
        memcpy(&eight, flag + n, sizeof eight);
        bits |= (eight * UINT64_C(0x0102040810204080) >> 56) << n;
    }
    return bits;
}

struct sums {
    uint16_t vacancy[BLOCK_HEIGHT], echoes[BLOCK_HEIGHT];
};

#define CUBES_ACROSS (BLOCK_SIDE / RESIDUAL_CUBE)

/* Echoes that no submap keeps, by cube in plan. */
typedef uint16_t residual_of_block[CUBES_ACROSS * CUBES_ACROSS][BLOCK_HEIGHT];

/* A column of a layer, 0 where it has none: loops of a fixed length over it become vectors. */
static inline void read_column(const struct voxmap *m, const struct layer *l, uint32_t column,
                               enum submap_plane plane, uint8_t count[BLOCK_HEIGHT])
{
    const uint8_t *from = tiles_column(&m->tiles, l->tile, column, plane) + l->skip;
    if (l->first == 0 && l->end == BLOCK_HEIGHT) {
        memcpy(count, from, BLOCK_HEIGHT);
        return;
    }
    memset(count, 0, BLOCK_HEIGHT);
    memcpy(count + l->first, from, (size_t)(l->end - l->first));
}

/* A column's counts, halved so often: vacancy is rounded down, echoes up, as submap_halve does. */
INLINE void add_vacancy(uint8_t count[BLOCK_HEIGHT], unsigned shift, struct sums *s)
{
    for (; shift > 0; shift--)
        for (int k = 0; k < BLOCK_HEIGHT; k++)
            count[k] >>= 1;
    for (int k = 0; k < BLOCK_HEIGHT; k++)
        s->vacancy[k] = (uint16_t)(s->vacancy[k] + count[k]);
}

INLINE void add_echoes(uint8_t count[BLOCK_HEIGHT], unsigned shift, struct sums *s)
{
    for (; shift > 0; shift--)
        for (int k = 0; k < BLOCK_HEIGHT; k++)
            count[k] = (uint8_t)(count[k] - (count[k] >> 1));
    for (int k = 0; k < BLOCK_HEIGHT; k++)
        s->echoes[k] = (uint16_t)(s->echoes[k] + count[k]);
}

INLINE void judge(const struct voxmap *m, const struct sums *s, const uint16_t residual[BLOCK_HEIGHT],
                  uint64_t *free, uint64_t *heard)
{
    uint8_t is_free[BLOCK_HEIGHT], is_heard[BLOCK_HEIGHT];
    uint32_t threshold = m->rule.threshold, weight = m->rule.echo_weight;
    for (int k = 0; k < BLOCK_HEIGHT; k++)
        is_free[k] = s->vacancy[k] > threshold + weight * ((uint32_t)s->echoes[k] + residual[k]);
    for (int k = 0; k < BLOCK_HEIGHT; k++)
        is_heard[k] = s->echoes[k] > 0;
    *free = pack(is_free);
    *heard = pack(is_heard);
}

/* True: something was forgotten in the block. */
static bool add_residual(const struct voxmap *m, const struct block_key *key, residual_of_block residual)
{
    bool lost = false;
    for (int q = 0; m->residual.any && q < CUBES_ACROSS * CUBES_ACROSS; q++)
        for (int k = 0; k < BLOCK_HEIGHT; k++) {
            const int64_t cell[3] = {key->at[0] * BLOCK_SIDE + q / CUBES_ACROSS * RESIDUAL_CUBE,
                                     key->at[1] * BLOCK_SIDE + q % CUBES_ACROSS * RESIDUAL_CUBE,
                                     key->at[2] * BLOCK_HEIGHT + k};
            bool known = lost;
            residual[q][k] =
                k % RESIDUAL_CUBE ? residual[q][k - 1] : (uint16_t)residual_echoes(&m->residual, cell, &known);
            lost |= known;
        }
    return lost;
}

static bool moved_in(const struct voxmap_part *p, const struct block_key *key, struct resample *resample)
{
    static const int32_t size[3] = {BLOCK_SIDE, BLOCK_SIDE, BLOCK_HEIGHT};
    resample_of(resample, p);
    return resample_meets(
        resample, (const int64_t[3]){key->at[0] * BLOCK_SIDE, key->at[1] * BLOCK_SIDE, key->at[2] * BLOCK_HEIGHT},
        size);
}

/* All that speaks of a block. */
struct voices {
    struct layer layer[VOXMAP_MAX_SUBMAPS];
    struct voice {
        const struct voxmap_part *part;
        struct resample resample;
    } moved[VOXMAP_MAX_SUBMAPS];
    uint32_t n, n_moved;
    residual_of_block residual;
};

static void add_moved(const struct voxmap *m, const struct voice *v, const int64_t cell[3], struct sums *s)
{
    uint8_t vacancy[BLOCK_HEIGHT], echoes[BLOCK_HEIGHT];
    const unsigned shift = voxmap_shift(m, v->part);
    resample_column(&v->resample, cell, BLOCK_HEIGHT, vacancy, echoes);
    add_vacancy(vacancy, shift, s);
    add_echoes(echoes, shift, s);
}

INLINE bool judge_columns_body(const struct voxmap *m, const struct block_key *key, const struct voices *v,
                               struct merge_block *out)
{
    for (uint32_t c = 0; c < BLOCK_COLUMNS; c++) {
        const uint32_t i = c / BLOCK_SIDE, j = c % BLOCK_SIDE;
        const int64_t cell[3] = {key->at[0] * BLOCK_SIDE + i, key->at[1] * BLOCK_SIDE + j,
                                 key->at[2] * BLOCK_HEIGHT};
        uint8_t count[BLOCK_HEIGHT];
        struct sums sums = {0};
        for (uint32_t l = 0; l < v->n; l++) {
            read_column(m, &v->layer[l], c, SUBMAP_VACANCY, count);
            add_vacancy(count, v->layer[l].shift, &sums);
            if (m->tiles.planes < 2)
                continue;
            read_column(m, &v->layer[l], c, SUBMAP_ECHOES, count);
            add_echoes(count, v->layer[l].shift, &sums);
        }
        for (uint32_t l = 0; l < v->n_moved; l++)
            add_moved(m, &v->moved[l], cell, &sums);
        judge(m, &sums, v->residual[i / RESIDUAL_CUBE * CUBES_ACROSS + j / RESIDUAL_CUBE], &out->free[c],
              &out->heard[c]);
    }
    return true;
}

WIDE(static bool, judge_columns,
     (const struct voxmap *m, const struct block_key *key, const struct voices *v, struct merge_block *out),
     (m, key, v, out))

void merge_block(const struct voxmap *m, const struct block_key *key, struct merge_block *out)
{
    struct voices v;
    uint32_t entry;
    v.n = v.n_moved = 0;
    memset(v.residual, 0, sizeof v.residual);
    out->lost = add_residual(m, key, v.residual);
    for (uint32_t p = 0; p < m->set.max_submaps; p++) {
        const struct voxmap_part *part = &m->part[p];
        if (!part->id)
            continue;
        if (part->moved) {
            v.moved[v.n_moved].part = part;
            v.n_moved += moved_in(part, key, &v.moved[v.n_moved].resample);
        } else {
            v.n += layer_in(m, part, key, &v.layer[v.n], &entry);
        }
    }
    if (v.n + v.n_moved > 0) {
        judge_columns(m, key, &v, out);
    } else {
        memset(out->free, 0, sizeof out->free);
        memset(out->heard, 0, sizeof out->heard);
    }
}

/* The submap's slice that is a block's height, or beyond its own: blocks are cut as slices are. */
static int64_t slice_of(const struct submap *m, const struct block_key *key)
{
    return key->at[2] - floor_div(m->box.first[2], SUBMAP_SLICE);
}
_Static_assert(BLOCK_HEIGHT == SUBMAP_SLICE, "a block is one slice");

bool merge_block_changed(const struct voxmap *m, const struct block_key *key, uint64_t since)
{
    struct layer layer;
    uint32_t entry;
    if (m->change_of_all > since ||
        residual_stamp(&m->residual, key->at[0] * BLOCK_SIDE, key->at[1] * BLOCK_SIDE) > since)
        return true;
    for (uint32_t p = 0; p < m->set.max_submaps; p++) {
        const struct voxmap_part *part = &m->part[p];
        if (part->id && part->map.now > since && layer_in(m, part, key, &layer, &entry) &&
            part->map.written[entry * part->map.slices + (uint32_t)slice_of(&part->map, key)] > since)
            return true;
    }
    return false;
}

static bool residual_around_changed(const struct voxmap *m, const struct block_key *key, uint64_t since)
{
    for (int n = 0; n < 9; n++)
        if (residual_stamp(&m->residual, (key->at[0] + n / 3 - 1) * BLOCK_SIDE,
                           (key->at[1] + n % 3 - 1) * BLOCK_SIDE) > since)
            return true;
    return false;
}

bool merge_around_changed(const struct voxmap *m, const struct block_key *key, uint64_t since)
{
    if (m->change_of_all > since || residual_around_changed(m, key, since))
        return true;
    for (uint32_t p = 0; p < m->set.max_submaps; p++) {
        const struct submap *map = &m->part[p].map;
        if (!m->part[p].id || map->now <= since)
            continue;
        int64_t i0 = key->at[0] - map->box.first[0] / TILE_SIDE, j0 = key->at[1] - map->box.first[1] / TILE_SIDE;
        int64_t n_i = map->box.size[0] / TILE_SIDE, n_j = map->box.size[1] / TILE_SIDE;
        int64_t s0 = slice_of(map, key), n_s = map->slices;
        for (int64_t i = i0 > 1 ? i0 - 1 : 0; i <= i0 + 1 && i < n_i; i++)
            for (int64_t j = j0 > 1 ? j0 - 1 : 0; j <= j0 + 1 && j < n_j; j++)
                for (int64_t s = s0 > 1 ? s0 - 1 : 0; s <= s0 + 1 && s < n_s; s++)
                    if (map->written[(i * n_j + j) * n_s + s] > since)
                        return true;
    }
    return false;
}

/* ---- all blocks ---- */

/* The blocks that a submap is walked by: those of its own tiles; of a corrected one,
 * all near the ball around its box. */
static void range_of(const struct voxmap_part *p, int64_t first[3], int64_t last[3])
{
    if (!p->moved) {
        for (int a = 0; a < 3; a++) {
            int side = a < 2 ? BLOCK_SIDE : BLOCK_HEIGHT;
            first[a] = floor_div(p->map.box.first[a], side);
            last[a] = floor_div(p->map.box.first[a] + p->map.box.size[a] - 1, side);
        }
        return;
    }
    double middle[3], v[3], reach = 0;
    for (int a = 0; a < 3; a++) {
        middle[a] = (double)(p->map.box.first[a] - p->base.cell[a]) + p->map.box.size[a] / 2.0 - p->base.offset[a];
        reach += p->map.box.size[a] / 2.0 * (p->map.box.size[a] / 2.0);
    }
    quat_rotate(p->turn, middle, v);
    reach = sqrt(reach) + 2;
    for (int a = 0; a < 3; a++) {
        int side = a < 2 ? BLOCK_SIDE : BLOCK_HEIGHT;
        int64_t at = p->moved_to.cell[a];
        first[a] = floor_div(at + (int64_t)floor(v[a] - reach), side);
        last[a] = floor_div(at + (int64_t)ceil(v[a] + reach), side);
    }
}

/* Has a submap a tile in a block, wherever it lies by now? No false negatives. */
static bool speaks_of(const struct voxmap *m, const struct voxmap_part *p, const struct block_key *key)
{
    struct layer layer;
    struct resample resample;
    uint32_t entry;
    return p->id && (p->moved ? moved_in(p, key, &resample) : layer_in(m, p, key, &layer, &entry));
}

static bool said_before(const struct voxmap *m, uint32_t part, const struct block_key *key)
{
    for (uint32_t p = 0; p < part; p++)
        if (speaks_of(m, &m->part[p], key))
            return true;
    return false;
}

enum merge_sought merge_seek(const struct voxmap *m, struct merge_walk *walk, uint32_t most, struct block_key *key)
{
    for (; walk->part < m->set.max_submaps; walk->part++, walk->at = 0) {
        const struct voxmap_part *p = &m->part[walk->part];
        int64_t first[3], last[3];
        if (!p->id)
            continue;
        range_of(p, first, last);
        int64_t rows = last[1] - first[1] + 1, levels = last[2] - first[2] + 1;
        int64_t n = (last[0] - first[0] + 1) * rows * levels;
        while (walk->at < n) {
            int64_t at = walk->at++;
            *key = (struct block_key){
                {first[0] + at / levels / rows, first[1] + at / levels % rows, first[2] + at % levels}};
            if (speaks_of(m, p, key) && !said_before(m, walk->part, key))
                return MERGE_FOUND;
            if (most-- == 0)
                return MERGE_NOT_YET;
        }
    }
    return MERGE_ALL;
}

bool merge_next(const struct voxmap *m, struct merge_walk *walk, struct block_key *key)
{
    enum merge_sought sought;
    do
        sought = merge_seek(m, walk, UINT32_MAX, key);
    while (sought == MERGE_NOT_YET);
    return sought == MERGE_FOUND;
}
