/* SPDX-License-Identifier: MIT */
#include "submap.h"

#include <math.h>
#include <string.h>

#include "wide.h"

#define CHUNK 32 /* counts that are raised together */
_Static_assert(CHUNK <= TILE_SLACK, "a chunk may pass the end of the last column");

/* From `skip` on: what all but the last `skip` counts of a chunk are raised to at most but 1, and 255 for those, which
 * are not raised. */
static const uint8_t most_of[2 * CHUNK] = {
    254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 254,
    254, 254, 254, 254, 254, 254, 254, 254, 254, 254, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255,
    255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255};

INLINE void raise_chunk(uint8_t *count, const uint8_t *most)
{
    for (int l = 0; l < CHUNK; l++) {
        uint8_t kept = count[l] < most[l] ? count[l] : most[l], one = (uint8_t)~most[l];
        count[l] = (uint8_t)(kept + one);
    }
}

/* Whether all counts are 255 up to `last`, and of that chunk those that `most` is not 255 for. */
INLINE bool are_full(const uint8_t *count, const uint8_t *last, const uint8_t *most)
{
    uint8_t least[CHUNK], all = UINT8_MAX;
    for (int l = 0; l < CHUNK; l++)
        least[l] = last[l] > most[l] ? last[l] : most[l];
    for (; count != last; count += CHUNK)
        for (int l = 0; l < CHUNK; l++)
            least[l] &= count[l];
    for (int l = 0; l < CHUNK; l++)
        all &= least[l];
    return all == UINT8_MAX;
}

/* Adds 1, up to 255, to n > 0 counts. False: all were 255, and nothing was written; most runs show it by their first
 * count not to be so. What follows the counts within the last chunk is written back as it was: last, so that no chunk
 * is read that overlaps one just written, for which a CPU waits. */
INLINE bool raise_counts(uint8_t *count, size_t n)
{
    const uint8_t *last = count + (n - 1) / CHUNK * CHUNK, *most = most_of + -n % CHUNK;
    if (*count == UINT8_MAX && are_full(count, last, most))
        return false;
    for (; count != last; count += CHUNK)
        raise_chunk(count, most_of);
    raise_chunk(count, most);
    return true;
}

/* Where in the memory the stamps begin, behind the directory. */
static size_t stamps_at(uint32_t side)
{
    return ((size_t)side * side + 1) / 2 * 2 * sizeof(uint32_t);
}

/* Wherever the box begins within one. */
static uint32_t slices_of(uint32_t height)
{
    return (height + SUBMAP_SLICE - 2) / SUBMAP_SLICE + 1;
}

static size_t stamps_bytes(uint32_t side, uint32_t height)
{
    return (size_t)side * side * slices_of(height) * sizeof(uint64_t);
}

size_t submap_bytes(uint32_t side, uint32_t height)
{
    const bool fits = side >= 1 && side <= 4096 && height >= 1 && height <= 1u << 20;
    return fits ? stamps_at(side) + stamps_bytes(side, height) : 0;
}

void submap_init(struct submap *m, void *memory, uint32_t side, struct tiles *tiles,
                 const struct lattice_place *base)
{
    *m = (struct submap){.tiles = tiles, .tile = memory, .slices = slices_of(tiles->height)};
    m->written = (uint64_t *)((uint8_t *)memory + stamps_at(side));
    for (int a = 0; a < 2; a++) {
        int64_t first = base->cell[a] - (int64_t)side * TILE_SIDE / 2 + TILE_SIDE / 2;
        int64_t past = first % TILE_SIDE;
        m->box.first[a] = first - (past < 0 ? past + TILE_SIDE : past);
        m->box.size[a] = (int32_t)(side * TILE_SIDE);
    }
    m->box.first[2] = base->cell[2] - tiles->height / 2;
    m->box.size[2] = (int32_t)tiles->height;
    for (size_t t = 0; t < (size_t)side * side; t++)
        m->tile[t] = TILE_NONE;
    memset(m->written, 0, stamps_bytes(side, tiles->height));
}

static size_t directory_size(const struct submap *m)
{
    return (size_t)(m->box.size[0] / TILE_SIDE) * (size_t)(m->box.size[1] / TILE_SIDE);
}

void submap_clear(struct submap *m)
{
    for (size_t t = 0; t < directory_size(m); t++)
        if (m->tile[t] != TILE_NONE) {
            tiles_give(m->tiles, m->tile[t]);
            m->tile[t] = TILE_NONE;
        }
    m->n_tiles = 0;
}

/* The first count of a plane of an entry's tile, which is about to be written to. The tile is taken from the pool when
 * there is none yet; NULL when that is exhausted. */
INLINE uint8_t *plane_to_write(struct submap *m, size_t entry, enum submap_plane plane)
{
    if (m->tile[entry] == TILE_NONE) {
        m->tile[entry] = tiles_take(m->tiles);
        if (m->tile[entry] == TILE_NONE)
            return NULL;
        m->n_tiles++;
    }
    return tiles_column(m->tiles, m->tile[entry], 0, plane);
}

/* Of an entry's tile these slices, and no others, may have changed. */
INLINE void stamp(struct submap *m, size_t entry, uint32_t first, uint32_t last)
{
    for (uint32_t s = first; s <= last; s++)
        m->written[entry * m->slices + s] = m->now;
}

struct entry {
    struct submap *map;
    enum submap_plane plane;
};

/* Columns come in rows: mostly the next lies in the same tile. */
INLINE bool enter_spans_body(struct submap *m, enum submap_plane plane, const struct cast_spans *spans)
{
    const struct cast_spans s =
        *spans; /* a copy: for the compiler, a byte written may be part of any struct it sees */
    const uint32_t height = m->tiles->height, row = (uint32_t)m->box.size[1] / TILE_SIDE;
    const uint32_t first_slice = submap_slice(m, s.first_k), last_slice = submap_slice(m, s.last_k);
    uint32_t entry[CAST_SPANS], offset[CAST_SPANS];

    for (int first = 0; first < s.runs; first += CAST_LANES)
        for (int l = first; l < first + CAST_LANES; l++) {
            uint32_t i = (uint32_t)s.i[l], j = (uint32_t)s.j[l];
            entry[l] = i / TILE_SIDE * row + j / TILE_SIDE;
            offset[l] = (i % TILE_SIDE * TILE_SIDE + j % TILE_SIDE) * height + (uint32_t)s.k[l];
        }
    for (int l = 0; l < s.runs;) {
        const uint32_t here = entry[l];
        uint8_t *counts = s.n[l] > 0 ? plane_to_write(m, here, plane) : NULL;
        bool raised = false;
        if (!counts) {
            m->stats.starved += s.n[l] > 0;
            l++;
            continue;
        }
        for (; l < s.runs && entry[l] == here; l++)
            if (s.n[l] > 0)
                raised |= raise_counts(counts + offset[l], (uint32_t)s.n[l]);
        if (raised)
            stamp(m, here, first_slice, last_slice);
    }
    return true;
}

WIDE(static bool, enter_spans, (struct submap * m, enum submap_plane plane, const struct cast_spans *spans),
     (m, plane, spans))

static void take_spans(void *context, const struct cast_spans *spans)
{
    const struct entry *e = context;
    enter_spans(e->map, e->plane, spans);
}

void submap_cast(struct submap *m, const struct cast_beam *b, enum submap_plane plane)
{
    struct entry e = {m, plane};
    if (plane >= m->tiles->planes)
        return;
    if (!cast_run(b, &m->box, take_spans, &e))
        m->stats.clipped++;
}

/* Squared distance of p from the line a..b (d = b - a). */
static double distance2(const double p[3], const double a[3], const double d[3])
{
    double v[3], along = 0, length2 = 0, distance = 0;
    for (int i = 0; i < 3; i++) {
        v[i] = p[i] - a[i];
        along += v[i] * d[i];
        length2 += d[i] * d[i];
    }
    double t = length2 > 0 ? along / length2 : 0;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    for (int i = 0; i < 3; i++)
        distance += (v[i] - t * d[i]) * (v[i] - t * d[i]);
    return distance;
}

void submap_body(struct submap *m, const struct lattice_place *a, const struct lattice_place *b, double radius,
                 uint8_t score)
{
    double from[3], d[3];
    int32_t first[3], last[3];
    bool clipped = false;
    if (!(radius > 0 && radius <= CAST_MAX_VOXELS))
        return;
    for (int x = 0; x < 3; x++) {
        double to = (double)(b->cell[x] - m->box.first[x]) + b->offset[x];
        from[x] = (double)(a->cell[x] - m->box.first[x]) + a->offset[x];
        d[x] = to - from[x];
        double lo = floor(fmin(from[x], to) - radius), hi = ceil(fmax(from[x], to) + radius),
               end = m->box.size[x] - 1;
        clipped |= lo < 0 || hi > end;
        if (hi < 0 || lo > end) {
            m->stats.clipped++;
            return;
        }
        first[x] = (int32_t)fmax(lo, 0);
        last[x] = (int32_t)fmin(hi, end);
    }
    m->stats.clipped += clipped;
    for (int32_t i = first[0]; i <= last[0]; i++)
        for (int32_t j = first[1]; j <= last[1]; j++)
            for (int32_t k = first[2]; k <= last[2]; k++) {
                const double p[3] = {i + 0.5, j + 0.5, k + 0.5};
                if (distance2(p, from, d) > radius * radius)
                    continue;
                const size_t entry = submap_entry(m, i, j);
                uint8_t *counts = plane_to_write(m, entry, SUBMAP_VACANCY);
                if (!counts) {
                    m->stats.starved++;
                    continue;
                }
                uint8_t *count = counts + (size_t)submap_column(i, j) * m->tiles->height + k;
                if (*count < score) {
                    *count = score;
                    stamp(m, entry, submap_slice(m, k), submap_slice(m, k));
                }
            }
}

void submap_halve(struct submap *m)
{
    for (size_t t = 0; t < directory_size(m); t++) {
        if (m->tile[t] == TILE_NONE)
            continue;
        uint8_t *count = tiles_column(m->tiles, m->tile[t], 0, 0);
        for (size_t c = 0; c < m->tiles->plane_bytes; c++)
            count[c] >>= 1;
        for (size_t c = m->tiles->plane_bytes; c < m->tiles->tile_bytes; c++)
            count[c] = (uint8_t)(count[c] - (count[c] >> 1));
    }
}

uint8_t submap_count(const struct submap *m, enum submap_plane plane, const int64_t cell[3])
{
    if (plane >= m->tiles->planes || !lattice_holds(&m->box, cell))
        return 0;
    int32_t i = (int32_t)(cell[0] - m->box.first[0]), j = (int32_t)(cell[1] - m->box.first[1]);
    uint32_t tile = m->tile[submap_entry(m, i, j)];
    if (tile == TILE_NONE)
        return 0;
    return tiles_column(m->tiles, tile, submap_column(i, j), plane)[cell[2] - m->box.first[2]];
}
