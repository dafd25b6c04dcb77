/* SPDX-License-Identifier: MIT */
#include "voxpage.h"

#include <string.h>

/* The bytes: a head of numbers of 8 bytes, lowest byte first,
 * then per tile its number in the directory and its planes. */
enum field {
    F_MAGIC,
    F_VOXEL,
    F_SIDE,
    F_HEIGHT,
    F_PLANES,
    F_LEVELS,
    F_TILES,
    F_ID,
    F_BEGIN,
    F_LAST,
    F_PINGS,
    F_SHIFT, /* half-lives by which the counts are still to be halved */
    F_MOVED,
    F_BASE,                  /* cell, offset */
    F_MOVED_TO = F_BASE + 6, /* cell, offset */
    F_TURN = F_MOVED_TO + 6,
    FIELDS = F_TURN + 4
};
#define MAGIC UINT64_C(0x31504d5856) /* "VXMP1" */
#define HEAD  (FIELDS * sizeof(uint64_t))

static void put_word(uint8_t *to, uint64_t x)
{
    for (int b = 0; b < 8; b++)
        to[b] = (uint8_t)(x >> 8 * b);
}

static uint64_t get(const uint8_t *from)
{
    uint64_t x = 0;
    for (int b = 0; b < 8; b++)
        x |= (uint64_t)from[b] << 8 * b;
    return x;
}

static uint64_t of_double(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static double to_double(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static size_t tile_size(const struct voxmap *m)
{
    return sizeof(uint64_t) + m->tiles.tile_bytes;
}

static size_t directory_size(const struct voxmap *m)
{
    return (size_t)m->set.side * m->set.side;
}

size_t voxpage_bytes(const struct voxmap *m, uint64_t id)
{
    const struct voxmap_part *part = voxmap_part(m, id);
    return part ? HEAD + part->map.n_tiles * tile_size(m) : 0;
}

static void put_place(uint64_t *field, const struct lattice_place *place)
{
    for (int a = 0; a < 3; a++) {
        field[a] = (uint64_t)place->cell[a];
        field[3 + a] = of_double(place->offset[a]);
    }
}

static bool get_place(const uint64_t *field, struct lattice_place *place)
{
    bool good = true;
    for (int a = 0; a < 3; a++) {
        place->cell[a] = (int64_t)field[a];
        place->offset[a] = to_double(field[3 + a]);
        good &= fabs((double)place->cell[a]) <= LATTICE_FARTHEST && place->offset[a] >= 0 && place->offset[a] <= 1;
    }
    return good;
}

/* What must be the same for bytes to fit a map. */
static void put_kind(const struct voxmap *m, uint64_t *field)
{
    field[F_MAGIC] = MAGIC;
    field[F_VOXEL] = of_double(m->set.voxel_m);
    field[F_SIDE] = m->set.side;
    field[F_HEIGHT] = m->set.height;
    field[F_PLANES] = m->tiles.planes;
    field[F_LEVELS] = m->set.weight_levels;
}

static void pack_head(const struct voxmap *m, const struct voxmap_part *p, uint8_t head[HEAD])
{
    uint64_t field[FIELDS];
    put_kind(m, field);
    field[F_TILES] = p->map.n_tiles;
    field[F_ID] = p->id;
    field[F_BEGIN] = p->begin_ns;
    field[F_LAST] = p->last_ns;
    field[F_PINGS] = p->pings;
    field[F_SHIFT] = voxmap_shift(m, p);
    field[F_MOVED] = p->moved;
    put_place(field + F_BASE, &p->base);
    put_place(field + F_MOVED_TO, &p->moved_to);
    for (int a = 0; a < 4; a++)
        field[F_TURN + a] = of_double(p->turn[a]);
    for (int f = 0; f < FIELDS; f++)
        put_word(head + (size_t)f * sizeof(uint64_t), field[f]);
}

/* The part of a packed submap that a caller wants. */
struct slice {
    uint8_t *out;
    size_t from, end;
};

/* Bytes at..at+n-1 of the packed submap, as far as they are in the slice. */
static void emit(const struct slice *s, size_t at, const uint8_t *bytes, size_t n)
{
    size_t first = at > s->from ? at : s->from, end = at + n < s->end ? at + n : s->end;
    if (first < end)
        memcpy(s->out + (first - s->from), bytes + (first - at), end - first);
}

size_t voxpage_pack(const struct voxmap *m, uint64_t id, size_t from, uint8_t *out, size_t size)
{
    size_t all = voxpage_bytes(m, id), at = HEAD;
    if (from >= all)
        return 0;
    const struct voxmap_part *part = voxmap_part(m, id);
    struct slice slice = {out, from, size < all - from ? from + size : all};
    uint8_t head[HEAD], number[sizeof(uint64_t)];

    pack_head(m, part, head);
    emit(&slice, 0, head, sizeof head);
    for (size_t t = 0; t < directory_size(m) && at < slice.end; t++) {
        if (part->map.tile[t] == TILE_NONE)
            continue;
        put_word(number, t);
        emit(&slice, at, number, sizeof number);
        emit(&slice, at + sizeof number, tiles_column(&m->tiles, part->map.tile[t], 0, 0), m->tiles.tile_bytes);
        at += tile_size(m);
    }
    return slice.end - from;
}

/* ---- from bytes ---- */

static void read_fields(const uint8_t *bytes, uint64_t field[FIELDS])
{
    for (int f = 0; f < FIELDS; f++)
        field[f] = get(bytes + (size_t)f * sizeof(uint64_t));
}

uint32_t voxpage_tiles(const uint8_t *bytes, size_t size)
{
    uint64_t field[FIELDS];
    if (size < HEAD)
        return TILE_NONE;
    read_fields(bytes, field);
    return field[F_MAGIC] == MAGIC && field[F_TILES] < TILE_NONE ? (uint32_t)field[F_TILES] : TILE_NONE;
}

/* Whether these are the bytes of a submap of this map's kind; the reason when not. */
static const char *unlike(const struct voxmap *m, const uint8_t *bytes, size_t size, uint64_t field[FIELDS])
{
    uint64_t kind[FIELDS];
    if (size < HEAD)
        return "not a submap: too short";
    read_fields(bytes, field);
    put_kind(m, kind);
    if (field[F_MAGIC] != MAGIC)
        return "not a submap";
    if (field[F_VOXEL] != kind[F_VOXEL])
        return "made with another voxel size";
    if (field[F_SIDE] != kind[F_SIDE] || field[F_HEIGHT] != kind[F_HEIGHT])
        return "made with another size of submaps";
    if (field[F_PLANES] != kind[F_PLANES] || field[F_LEVELS] != kind[F_LEVELS])
        return "made with other echo evidence or weight levels";
    return NULL;
}

const char *voxpage_unlike(const struct voxmap *m, const uint8_t *bytes, size_t size)
{
    uint64_t field[FIELDS];
    return unlike(m, bytes, size, field);
}

/* The same, with room for it. */
static const char *unfit(const struct voxmap *m, const uint8_t *bytes, size_t size, uint64_t field[FIELDS])
{
    const char *why = unlike(m, bytes, size, field);
    if (why)
        return why;
    if (field[F_TILES] > directory_size(m) || size != HEAD + field[F_TILES] * tile_size(m))
        return "cut or damaged: its length is not what it says";
    if (field[F_TILES] > m->tiles.n_free)
        return "no room: its tiles are more than are free";
    uint64_t before = 0;
    for (size_t t = 0, at = HEAD; t < field[F_TILES]; t++, at += tile_size(m)) {
        uint64_t number = get(bytes + at);
        if (number >= directory_size(m) || (t && number <= before))
            return "damaged: its tiles are out of order";
        before = number;
    }
    return NULL;
}

/* Into an empty directory. */
static void unpack_tiles(struct voxmap *m, struct submap *map, const uint8_t *bytes, uint64_t n)
{
    for (size_t t = 0, at = HEAD; t < n; t++, at += tile_size(m)) {
        uint32_t tile = tiles_take(&m->tiles);
        map->tile[get(bytes + at)] = tile;
        memcpy(tiles_column(&m->tiles, tile, 0, 0), bytes + at + sizeof(uint64_t), m->tiles.tile_bytes);
    }
    map->n_tiles = (uint32_t)n;
}

uint64_t voxpage_add(struct voxmap *m, const uint8_t *bytes, size_t size, struct fault *fault)
{
    uint64_t field[FIELDS];
    struct voxmap_part part = {.turn = {1, 0, 0, 0}};
    const char *why = unfit(m, bytes, size, field);
    if (!why) {
        for (int a = 0; a < 4; a++)
            part.turn[a] = to_double(field[F_TURN + a]);
        if (!get_place(field + F_BASE, &part.base) || !get_place(field + F_MOVED_TO, &part.moved_to) ||
            !quat_normalise(part.turn) || field[F_SHIFT] > 8 || field[F_MOVED] > 1)
            why = "damaged: its place cannot be";
    }
    if (why) {
        fault_set(fault, "%s", why);
        return 0;
    }
    part.pings = field[F_PINGS];
    part.moved = field[F_MOVED];
    part.half_lives = m->half_lives - field[F_SHIFT]; /* modulo 2^64, as voxmap_shift() takes it */
    part.id = m->next_id++;
    struct voxmap_part *place = voxmap_place_for_part(m);
    uint32_t *directory = place->map.tile;
    *place = part;
    submap_init(&place->map, directory, m->set.side, &m->tiles, &part.base);
    unpack_tiles(m, &place->map, bytes, field[F_TILES]);
    m->change_of_all = ++m->change;
    return part.id;
}
