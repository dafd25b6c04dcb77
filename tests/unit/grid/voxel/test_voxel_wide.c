/* SPDX-License-Identifier: MIT */
/*
 * test_voxel_wide - the voxel cast's loops give the same bits whichever variant the CPU chooses. The modules are
 * included, not linked, so that both variants can be called.
 */
#include "grid/voxel/bounds.c"
#include "grid/voxel/submap.c"

#include "grid/geometry.h"

#if defined(__x86_64__) && !defined(__AVX2__)
#include "core/fault.h"
#include "tests/lib/test.h"

#define VOXELS 4096

static struct cast_beam random_beam(struct cast_opening *o, int n, uint64_t *seed)
{
    struct lattice_place apex = {{0}, {test_uniform(seed), test_uniform(seed), test_uniform(seed)}};
    double q[4], el_rad = 0.02 + 1.2 * test_uniform(seed);
    struct cast_beam b;
    struct fault fault;
    quat_from_rpy(n % 3 ? 0.4 * test_uniform(seed) : 0, n % 3 ? 0.4 * test_uniform(seed) : 0,
                  GEO_TURN * test_uniform(seed), q);
    if (!cast_opening_init(o, n % 2 ? CAST_WEDGE : CAST_PYRAMID, 0.02 + test_uniform(seed), el_rad, 0, &fault) ||
        !cast_aim(&b, o,
                  &(struct cast_look){
                      .apex = &apex, .attitude = q, .far_m = 5 + 100 * test_uniform(seed), .voxel_m = 1}))
        exit(1);
    return b;
}

TEST(bounds_are_the_same)
{
    uint64_t seed = test_seed();
    int blocks = 0, full = 0;
    for (int n = 0; n < 3000; n++) {
        struct cast_opening o;
        struct cast_beam b = random_beam(&o, n, &seed);
        struct bounds s;
        bounds_of(&s, &b, (const int32_t[3]){200, 200, 100}, 199);
        if (!s.quick)
            continue;
        int32_t inner[64], outer[64], k[2][64], cells[2][64], doubt[2][64];
        for (int c = 0; c < 64; c++) {
            inner[c] = 200 + (int32_t)(2 * b.far * (test_uniform(&seed) - 0.5));
            outer[c] = 200 + (int32_t)(2 * b.far * (test_uniform(&seed) - 0.5));
        }
        const struct bounds_columns columns = {inner, outer, 64};
        bool sure = bounds_quick_body(&s, &columns, k[0], cells[0], doubt[0]);
        CHECK_INT(bounds_quick_avx2(&s, &columns, k[1], cells[1], doubt[1]), sure);
        CHECK(memcmp(k[0], k[1], sizeof k[0]) == 0 && memcmp(cells[0], cells[1], sizeof cells[0]) == 0 &&
              memcmp(doubt[0], doubt[1], sizeof doubt[0]) == 0);
        blocks++;
        for (int c = 0; c < 64; c++)
            full += cells[0][c] > 0;
    }
    CHECK(blocks > 1000 && full > 1000);
}

TEST(counts_are_the_same)
{
    uint64_t seed = test_seed();
    static uint8_t memory[2][1 << 20];
    static uint32_t directory[2][1024];
    struct lattice_place base = {{0}, {0}};
    struct tiles tiles[2];
    struct submap map[2];
    if (tiles_bytes(4, 100, 2) > sizeof memory[0] || submap_bytes(2, 100) > sizeof directory[0])
        exit(1);
    for (int v = 0; v < 2; v++) {
        tiles_init(&tiles[v], memory[v], 4, 100, 2);
        submap_init(&map[v], directory[v], 2, &tiles[v], &base);
    }
    for (int round = 0; round < 3000; round++) {
        int32_t i[16], j[16], k[16], n[16];
        for (int l = 0; l < 16; l++) {
            i[l] = (int32_t)(6 * test_uniform(&seed));
            j[l] = (int32_t)(6 * test_uniform(&seed));
            k[l] = (int32_t)(99 * test_uniform(&seed));
            n[l] = (int32_t)((double)(101 - k[l]) * test_uniform(&seed));
        }
        const struct cast_spans spans = {16, i, j, k, n, 0, 99};
        enter_spans_body(&map[0], SUBMAP_VACANCY, &spans);
        enter_spans_avx2(&map[1], SUBMAP_VACANCY, &spans);
    }
    CHECK(memcmp(tiles[0].bytes, tiles[1].bytes, 4 * tiles[0].tile_bytes) == 0);
    CHECK_INT(tiles[0].n_free, 3);
}

int main(void)
{
    if (!__builtin_cpu_supports("avx2")) {
        printf("skip voxel_wide: this CPU has no AVX2\n");
        return 0;
    }
    RUN(bounds_are_the_same);
    RUN(counts_are_the_same);
    return test_end();
}
#else
#include <stdio.h>

int main(void)
{
    printf("skip voxel_wide: there is one variant only\n");
    return 0;
}
#endif
