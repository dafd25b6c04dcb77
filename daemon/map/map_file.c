/* SPDX-License-Identifier: MIT */
/* map_file - see map_file.h. */
#include "map_file.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#define MAGIC          "SONARDVM"
#define VERSION        3
#define HEADER_BYTES   96
#define HEADER_OF_1    32 /* as far as version 1 had it */
#define SIZE_BYTES     8
#define CHECK_BYTES    4
#define SUBMAP_BYTES   1024u /* a submap without its tiles has fewer */
#define RESIDUAL_BYTES (((size_t)1 << 22) + 4096)
#define AT_SUBMAPS     12
#define AT_RUN         32
#define AT_ORIGIN      40

static void put_number(uint8_t *at, uint64_t v, int n)
{
    for (int i = 0; i < n; i++)
        at[i] = (uint8_t)(v >> (8 * i));
}

static uint64_t get(const uint8_t *at, int n)
{
    uint64_t v = 0;
    for (int i = 0; i < n; i++)
        v |= (uint64_t)at[i] << (8 * i);
    return v;
}

static double get_double(const uint8_t *at)
{
    const uint64_t bits = get(at, 8);
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static uint32_t checksum(const uint8_t *bytes, size_t size)
{
    return (uint32_t)crc32_z(0, bytes, size);
}

/* ---- making ---- */

static bool reserve(struct map_bytes *b, size_t more)
{
    if (b->room - b->size >= more)
        return true;
    uint8_t *bytes = realloc(b->bytes, b->size + more);
    if (!bytes)
        return false;
    b->bytes = bytes;
    b->room = b->size + more;
    return true;
}

bool map_file_begin(struct map_bytes *b, const struct voxmap_setting *setting, const struct map_origin *origin)
{
    uint64_t voxel;
    *b = (struct map_bytes){0};
    if (!reserve(b, HEADER_BYTES))
        return false;
    memcpy(&voxel, &setting->voxel_m, sizeof voxel);
    memcpy(b->bytes, MAGIC, MAP_FILE_MAGIC_BYTES);
    put_number(b->bytes + 8, VERSION, 4);
    put_number(b->bytes + AT_SUBMAPS, 0, 4);
    put_number(b->bytes + 16, voxel, 8);
    put_number(b->bytes + 24, setting->height, 4);
    put_number(b->bytes + 28, setting->keep_echoes, 4);
    put_number(b->bytes + AT_RUN, origin->run, 8);
    memcpy(b->bytes + AT_ORIGIN, origin->name, MAP_ORIGIN_MAX);
    b->size = HEADER_BYTES;
    return true;
}

uint8_t *map_file_room(struct map_bytes *b, size_t size)
{
    if (!reserve(b, SIZE_BYTES + size + CHECK_BYTES))
        return NULL;
    return b->bytes + b->size + SIZE_BYTES;
}

size_t map_file_bytes(size_t size)
{
    return SIZE_BYTES + size;
}

void map_file_take(struct map_bytes *b, size_t size)
{
    put_number(b->bytes + b->size, size, SIZE_BYTES);
    put_number(b->bytes + AT_SUBMAPS, get(b->bytes + AT_SUBMAPS, 4) + 1, 4);
    b->size += SIZE_BYTES + size;
}

bool map_file_end(struct map_bytes *b, const uint8_t *residual, size_t n)
{
    if (!reserve(b, SIZE_BYTES + n + CHECK_BYTES))
        return false;
    put_number(b->bytes + b->size, n, SIZE_BYTES);
    if (n)
        memcpy(b->bytes + b->size + SIZE_BYTES, residual, n);
    b->size += SIZE_BYTES + n;
    put_number(b->bytes + b->size, checksum(b->bytes, b->size), CHECK_BYTES);
    b->size += CHECK_BYTES;
    return true;
}

/* ---- reading ---- */

static size_t header_bytes(const uint8_t *bytes)
{
    return get(bytes + 8, 4) == 1 ? HEADER_OF_1 : HEADER_BYTES;
}

struct map_origin map_file_origin(const uint8_t *bytes)
{
    struct map_origin origin = {0};
    if (header_bytes(bytes) == HEADER_BYTES) {
        origin.run = get(bytes + AT_RUN, 8);
        memcpy(origin.name, bytes + AT_ORIGIN, MAP_ORIGIN_MAX - 1);
    }
    return origin;
}

/* What stands behind a page: bytes with their size before them. */
static bool next_section(const uint8_t *bytes, size_t size, struct map_page *page)
{
    const size_t at = page->bytes ? (size_t)(page->bytes - bytes) + page->size : header_bytes(bytes);
    const size_t left = size - CHECK_BYTES - at;
    if (left < SIZE_BYTES)
        return false;
    const uint64_t n = get(bytes + at, SIZE_BYTES);
    if (n > left - SIZE_BYTES)
        return false;
    *page = (struct map_page){bytes + at + SIZE_BYTES, (size_t)n, page->number + 1};
    return true;
}

bool map_file_page(const uint8_t *bytes, size_t size, struct map_page *page)
{
    return page->number < get(bytes + AT_SUBMAPS, 4) && next_section(bytes, size, page);
}

/* The section behind all submaps. False: of an older version, or cut off. */
static bool find_residual(const uint8_t *bytes, size_t size, struct map_page *page)
{
    while (map_file_page(bytes, size, page)) {
    }
    return get(bytes + 8, 4) >= 3 && page->number == get(bytes + AT_SUBMAPS, 4) && next_section(bytes, size, page);
}

const uint8_t *map_file_residual(const uint8_t *bytes, size_t size, uint32_t *n)
{
    struct map_page page = {0};
    *n = find_residual(bytes, size, &page) ? (uint32_t)page.size : 0;
    return *n ? page.bytes : NULL;
}

/* As many submaps as the header says, a residual that is one, and nothing behind. */
static bool sections_good(const uint8_t *bytes, size_t size)
{
    const bool has_residual = get(bytes + 8, 4) >= 3;
    struct map_page page = {0};
    if (find_residual(bytes, size, &page) != has_residual ||
        page.number != get(bytes + AT_SUBMAPS, 4) + has_residual)
        return false;
    const size_t end = page.bytes ? (size_t)(page.bytes - bytes) + page.size : header_bytes(bytes);
    return end == size - CHECK_BYTES && (!has_residual || page.size == 0 || residual_good(page.size));
}

static enum map_fault check_kind(const uint8_t *bytes, size_t size, struct fault *fault)
{
    if (size < MAP_FILE_HEAD_BYTES || memcmp(bytes, MAGIC, MAP_FILE_MAGIC_BYTES) != 0) {
        fault_set(fault, "not a map file");
        return MAP_FOREIGN;
    }
    if (get(bytes + 8, 4) < 1 || get(bytes + 8, 4) > VERSION) {
        fault_set(fault, "a map of version %u; this program knows versions 1 to %d", (unsigned)get(bytes + 8, 4),
                  VERSION);
        return MAP_FOREIGN;
    }
    return MAP_GOOD;
}

/* Tiles are packed with 8 bytes each, submaps with some hundred. */
size_t map_file_most(const struct voxmap_setting *setting)
{
    struct fault ignored;
    return 2 * voxmap_bytes(setting, &ignored) + setting->max_submaps * SUBMAP_BYTES + RESIDUAL_BYTES;
}

enum map_fault map_file_check_head(const uint8_t *head, size_t n, size_t size,
                                   const struct voxmap_setting *setting, struct fault *fault)
{
    const size_t most = map_file_most(setting);
    if (check_kind(head, n, fault) != MAP_GOOD)
        return MAP_FOREIGN;
    if (size <= most)
        return MAP_GOOD;
    fault_set(fault, "%zu bytes are more than memory in [map] allows: a map that fits has at most %zu", size,
              most);
    return MAP_FOREIGN;
}

enum map_fault map_file_check(const uint8_t *bytes, size_t size, const struct voxmap_setting *setting,
                              uint32_t *n_pages, struct fault *fault)
{
    if (check_kind(bytes, size, fault) != MAP_GOOD)
        return MAP_FOREIGN;
    if (size < header_bytes(bytes) + CHECK_BYTES ||
        checksum(bytes, size - CHECK_BYTES) != get(bytes + size - CHECK_BYTES, CHECK_BYTES) ||
        !sections_good(bytes, size)) {
        fault_set(fault, "the map is damaged");
        return MAP_DAMAGED;
    }
    const double voxel_m = get_double(bytes + 16);
    const unsigned height = (unsigned)get(bytes + 24, 4), echoes = (unsigned)get(bytes + 28, 4);
    if (!(voxel_m == setting->voxel_m) || height != setting->height || echoes != setting->keep_echoes) {
        fault_set(
            fault,
            "a map with voxels of %g m, %u high, %s echoes; configured are voxels of %g m, %u high, %s echoes",
            voxel_m, height, echoes ? "with" : "without", setting->voxel_m, setting->height,
            setting->keep_echoes ? "with" : "without");
        return MAP_FOREIGN;
    }
    *n_pages = (uint32_t)get(bytes + AT_SUBMAPS, 4);
    return MAP_GOOD;
}
