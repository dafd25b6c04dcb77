/* SPDX-License-Identifier: MIT */
/*
 * fuzz_mapfile - any bytes as a saved map, as they are and with the checksum put right: what is accepted goes into a
 * map submap by submap or is refused with a sentence, and the map answers and can be packed again all the same.
 */
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "core/fault.h"
#include "daemon/map/map_file.h"
#include "grid/voxel/voxpage.h"
#include "tests/lib/ask_map.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void must(bool fact)
{
    if (!fact)
        abort();
}

static const struct voxmap_setting setting = {.voxel_m = 0.5,
                                              .side = 2,
                                              .height = 2,
                                              .n_tiles = 8,
                                              .max_submaps = 4,
                                              .keep_echoes = true,
                                              .rule = {1, 2},
                                              .opening = 1,
                                              .weight_levels = 1,
                                              .submap_path_m = 10,
                                              .submap_ns = VOXMAP_NEVER,
                                              .half_life_ns = VOXMAP_NEVER};

static struct voxmap map;
static struct voxmask mask;

static void make_map(void)
{
    struct fault fault;
    const size_t size = voxmap_bytes(&setting, &fault);
    must(size > 0);
    if (!map.part) {
        void *memory = malloc(size), *blocks = malloc(voxmask_bytes(1024));
        must(memory && blocks);
        voxmap_init(&map, &setting, memory);
        voxmask_init(&mask, &map, blocks, 1024);
    }
    voxmap_clear(&map);
}

static void put_in(const uint8_t *data, size_t size, uint32_t wanted)
{
    struct map_page page = {0};
    uint32_t n = 0;
    struct fault fault = {""};
    make_map();
    for (; map_file_page(data, size, &page); n++) {
        must(page.bytes >= data && page.bytes + page.size <= data + size);
        const uint64_t id = voxpage_add(&map, page.bytes, page.size, &fault);
        must(id || fault.text[0]);
        if (!id)
            continue;
        must(voxpage_tiles(page.bytes, page.size) != TILE_NONE || voxpage_bytes(&map, id) > 0);
        uint8_t *again = malloc(voxpage_bytes(&map, id));
        must(again && voxpage_pack(&map, id, 0, again, SIZE_MAX) == voxpage_bytes(&map, id));
        free(again);
    }
    must(n == wanted);
    const uint8_t *residual = map_file_residual(data, size, &n);
    if (residual)
        voxmap_join_residual(&map, residual, n);
    struct free_answer answer;
    must(free_query_box(&mask, (double[3]){-8, -8, -2}, (double[3]){8, 8, 2}, &answer));
}

static void try(const uint8_t *data, size_t size)
{
    struct fault fault = {""};
    uint32_t pages = 0;
    const enum map_fault kind = map_file_check(data, size, &setting, &pages, &fault);
    must((kind == MAP_GOOD) == (fault.text[0] == '\0'));
    if (kind == MAP_GOOD)
        put_in(data, size, pages);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    try(data, size);
    if (size < 4)
        return 0;
    uint8_t *good = malloc(size);
    must(good != NULL);
    memcpy(good, data, size);
    const uint32_t sum = (uint32_t)crc32(0, good, (uInt)(size - 4));
    for (int i = 0; i < 4; i++)
        good[size - 4 + (size_t)i] = (uint8_t)(sum >> (8 * i));
    try(good, size);
    free(good);
    return 0;
}
