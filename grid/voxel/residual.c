/* SPDX-License-Identifier: MIT */
#include "residual.h"

#include <string.h>

#include "lattice.h"

#define LEAST    (1u << 12)
#define MOST     (1u << 22)
#define SHARE    64
#define IN_TILES 16 /* columns along a tile's side */

static uint32_t added(uint32_t a, uint32_t b)
{
    return a + b < UINT8_MAX ? a + b : UINT8_MAX;
}

uint32_t residual_cells(size_t tile_bytes)
{
    uint32_t n = LEAST;
    while (n < MOST && 2 * (size_t)n <= tile_bytes / SHARE)
        n *= 2;
    return n;
}

bool residual_good(size_t n)
{
    return n >= LEAST && n <= MOST && (n & (n - 1)) == 0;
}

size_t residual_bytes(uint32_t n)
{
    return RESIDUAL_STAMPS * sizeof(uint64_t) + n;
}

void residual_init(struct residual *v, void *memory, uint32_t n)
{
    *v = (struct residual){
        .stamp = memory, .count = (uint8_t *)memory + RESIDUAL_STAMPS * sizeof(uint64_t), .n = n};
    memset(memory, 0, residual_bytes(n));
}

void residual_clear(struct residual *v)
{
    if (v->any)
        memset(v->count, 0, v->n);
    v->any = false;
}

/* Two places of a cube in a table of 2^32; in a smaller one their lowest bits. */
static void map_service_of(const int64_t cube[3], uint32_t place[2])
{
    uint64_t h = 0;
    for (int a = 0; a < 3; a++) {
        h = (h ^ (uint64_t)cube[a]) * UINT64_C(0x9e3779b97f4a7c15);
        h ^= h >> 32;
    }
    h *= UINT64_C(0xc2b2ae3d27d4eb4f);
    place[0] = (uint32_t)h;
    place[1] = (uint32_t)(h >> 32);
}

static uint64_t *stamp_of(const struct residual *v, int64_t tile_i, int64_t tile_j)
{
    const uint64_t h =
        (uint64_t)tile_i * UINT64_C(0x9e3779b97f4a7c15) + (uint64_t)tile_j * UINT64_C(0xc2b2ae3d27d4eb4f);
    return &v->stamp[(h >> 32) % RESIDUAL_STAMPS];
}

void residual_add(struct residual *v, const int64_t cube[3], uint32_t echoes, uint64_t change)
{
    uint32_t place[2];
    map_service_of(cube, place);
    for (int p = 0; p < 2; p++) {
        uint8_t *count = &v->count[place[p] & (v->n - 1)];
        if (p == 0 || count != &v->count[place[0] & (v->n - 1)])
            *count = (uint8_t)added(*count ? *count : 1, echoes);
    }
    *stamp_of(v, floor_div(cube[0], IN_TILES / RESIDUAL_CUBE), floor_div(cube[1], IN_TILES / RESIDUAL_CUBE)) =
        change;
    v->any = true;
}

uint32_t residual_echoes(const struct residual *v, const int64_t cell[3], bool *known)
{
    uint32_t place[2];
    *known = false;
    if (!v->any)
        return 0;
    map_service_of((const int64_t[3]){floor_div(cell[0], RESIDUAL_CUBE), floor_div(cell[1], RESIDUAL_CUBE),
                                      floor_div(cell[2], RESIDUAL_CUBE)},
                   place);
    const uint32_t a = v->count[place[0] & (v->n - 1)], b = v->count[place[1] & (v->n - 1)];
    const uint32_t least = a < b ? a : b;
    *known = least > 0;
    return least > 0 ? least - 1 : 0;
}

uint64_t residual_stamp(const struct residual *v, int64_t i, int64_t j)
{
    return *stamp_of(v, floor_div(i, IN_TILES), floor_div(j, IN_TILES));
}

void residual_halve(struct residual *v)
{
    for (uint32_t c = 0; v->any && c < v->n; c++) {
        const uint8_t count = v->count[c];
        v->count[c] = (uint8_t)(count - (count > 1 ? (count - 1) / 2 : 0));
    }
}

void residual_join(struct residual *v, const uint8_t *count, uint32_t n)
{
    for (uint32_t c = 0; c < n || c < v->n; c++) {
        uint8_t *at = &v->count[c & (v->n - 1)];
        const uint8_t other = count[c & (n - 1)];
        if (other) {
            *at = (uint8_t)added(*at ? *at : 1, other - 1u);
            v->any = true;
        }
    }
}
