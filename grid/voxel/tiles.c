/* SPDX-License-Identifier: MIT */
#include "tiles.h"

#include <string.h>

#define MOST_BYTES ((size_t)1 << (sizeof(size_t) > 4 ? 40 : 30))

static size_t links_bytes(uint32_t n)
{
    return ((size_t)n * sizeof(uint32_t) + 63) / 64 * 64;
}

size_t tiles_bytes(uint32_t n, uint32_t height, uint32_t planes)
{
    if (n == 0 || n == TILE_NONE || height == 0 || height > 1u << 20 || planes < 1 || planes > 2)
        return 0;
    size_t tile = (size_t)TILE_SIDE * TILE_SIDE * height * planes;
    if (n > MOST_BYTES / tile)
        return 0;
    return links_bytes(n) + n * tile + TILE_SLACK;
}

void tiles_init(struct tiles *t, void *memory, uint32_t n, uint32_t height, uint32_t planes)
{
    size_t plane = (size_t)TILE_SIDE * TILE_SIDE * height;
    *t = (struct tiles){
        .next = memory,
        .bytes = (uint8_t *)memory + links_bytes(n),
        .n = n,
        .n_free = n,
        .height = height,
        .planes = planes,
        .plane_bytes = plane,
        .tile_bytes = plane * planes,
    };
    memset(t->bytes, 0, n * t->tile_bytes + TILE_SLACK);
    for (uint32_t i = 0; i < n; i++)
        t->next[i] = i + 1 < n ? i + 1 : TILE_NONE;
}

uint32_t tiles_take(struct tiles *t)
{
    uint32_t tile = t->first_free;
    if (tile == TILE_NONE)
        return TILE_NONE;
    t->first_free = t->next[tile];
    t->n_free--;
    return tile;
}

void tiles_give(struct tiles *t, uint32_t tile)
{
    memset(t->bytes + tile * t->tile_bytes, 0, t->tile_bytes);
    t->next[tile] = t->first_free;
    t->first_free = tile;
    t->n_free++;
}
