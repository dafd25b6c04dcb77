/* SPDX-License-Identifier: MIT */
/*
 * report_saturated - what the voxel map is spared where voxels are counted as often as can be: a head that turns at one
 * place in a shaft, until most looks find a voxel that stands at 255 already.
 *
 *   report_saturated proof   CSV: turn, must_be, voxels, changed, looks, idle, touched, marked
 *   report_saturated count   CSV: turn, bins (its pings), for callgrind to count the instructions of turn_counted
 *
 * Of the turn: looks at voxels, those that change no count, tiles that a beam reaches, and those of them that are
 * marked as changed, all summed up over its pings. changed: voxels whose count is then not the number of looks since
 * the first turn, or 255.
 */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/voxel/submap.h"
#include "tests/bench/voxel_scene.h"
#include "report/lib/cost.h"

#define VOXEL_M 0.2
#define SIDE    5 /* tiles */
#define HEIGHT  20
#define TILES   (SIDE * SIDE)
#define CELLS   (TILES * TILE_SIDE * TILE_SIDE * HEIGHT)

static const unsigned turns[] = {1, 100, 200, 300};
#define TURNS (sizeof turns / sizeof turns[0])

static struct submap map;
static struct tiles tiles;
static struct cast_opening opening;
static struct cast_beam beam[SCENE_PINGS];

/* What a turn does. */
struct turn {
    uint64_t looks, idle, touched, marked;
};

static void *memory_of(size_t bytes)
{
    void *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (!memory || bytes == 0) {
        fprintf(stderr, "report_saturated: no memory\n");
        exit(1);
    }
    return memory;
}

/* The middle of scene A: the same pings in every turn. */
static void aim(void)
{
    struct fault fault;
    struct lattice_place at;
    for (int n = 0; n < SCENE_PINGS; n++) {
        const struct scene_ping ping = scene_at('A', 0, 1, n);
        if (!cast_opening_init(&opening, CAST_WEDGE, geo_rad(SCENE_AZ_DEG) / 2, geo_rad(SCENE_EL_DEG) / 2, 0,
                               &fault) ||
            !lattice_place(ping.position_m, VOXEL_M, &at) ||
            !cast_aim(&beam[n], &opening,
                      &(struct cast_look){
                          .apex = &at, .attitude = ping.attitude, .far_m = ping.range_m, .voxel_m = VOXEL_M}))
            exit(1);
    }
    tiles_init(&tiles, memory_of(tiles_bytes(TILES, HEIGHT, 1)), TILES, HEIGHT, 1);
    submap_init(&map, memory_of(submap_bytes(SIDE, HEIGHT)), SIDE, &tiles, &beam[0].apex);
}

/* The cells of a beam, asked one by one: how often each is looked at. */
static void look(const struct cast_beam *b, uint32_t looks[CELLS], struct turn *t)
{
    bool touched[TILES] = {false};
    uint32_t c = 0;
    for (int32_t i = 0; i < map.box.size[0]; i++)
        for (int32_t j = 0; j < map.box.size[1]; j++)
            for (int32_t k = 0; k < map.box.size[2]; k++, c++) {
                const int64_t cell[3] = {map.box.first[0] + i, map.box.first[1] + j, map.box.first[2] + k};
                if (cast_slack(b, cell) < 0)
                    continue;
                t->looks++;
                t->idle += looks[c]++ >= UINT8_MAX;
                touched[submap_entry(&map, i, j)] = true;
            }
    for (int e = 0; e < TILES; e++)
        t->touched += touched[e];
}

/* Voxels whose count is not their looks, or 255. */
static uint32_t off(const uint32_t looks[CELLS])
{
    uint32_t wrong = 0, c = 0;
    for (int32_t i = 0; i < map.box.size[0]; i++)
        for (int32_t j = 0; j < map.box.size[1]; j++)
            for (int32_t k = 0; k < map.box.size[2]; k++, c++) {
                const int64_t cell[3] = {map.box.first[0] + i, map.box.first[1] + j, map.box.first[2] + k};
                wrong += submap_count(&map, SUBMAP_VACANCY, cell) != (looks[c] < UINT8_MAX ? looks[c] : UINT8_MAX);
            }
    return wrong;
}

static void turn_round(struct turn *t)
{
    for (int n = 0; n < SCENE_PINGS; n++) {
        map.now++;
        submap_cast(&map, &beam[n], SUBMAP_VACANCY);
        for (uint32_t e = 0; t && e < TILES; e++) {
            bool marked = false;
            for (uint32_t s = 0; s < map.slices; s++)
                marked |= map.written[e * map.slices + s] == map.now;
            t->marked += marked;
        }
    }
}

static void proof(void)
{
    static uint32_t once[CELLS], looks[CELLS];
    struct turn first = {0};
    for (int n = 0; n < SCENE_PINGS; n++)
        look(&beam[n], once, &first);
    printf("turn,must_be,voxels,changed,looks,idle,touched,marked\n");
    for (unsigned n = 0, done = 0; n < TURNS; n++) {
        struct turn t = {0};
        for (; done + 1 < turns[n]; done++)
            turn_round(NULL);
        for (uint32_t c = 0; c < CELLS; c++)
            looks[c] = done * once[c];
        for (int b = 0; b < SCENE_PINGS; b++)
            look(&beam[b], looks, &t);
        turn_round(&t);
        done++;
        printf("%u,same,%d,%u,%llu,%llu,%llu,%llu\n", turns[n], CELLS, off(looks), (unsigned long long)t.looks,
               (unsigned long long)t.idle, (unsigned long long)t.touched, (unsigned long long)t.marked);
    }
}

static __attribute__((noinline)) void turn_counted(void)
{
    turn_round(NULL);
}

static void count(void)
{
    printf("turn,bins\n");
    for (unsigned n = 0, done = 0; n < TURNS; n++) {
        for (; done + 1 < turns[n]; done++)
            turn_round(NULL);
        turn_counted();
        done++;
        printf("%u,%d\n", turns[n], SCENE_PINGS);
        cost_mark();
    }
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    aim();
    if (strcmp(what, "proof") == 0)
        proof();
    else if (strcmp(what, "count") == 0)
        count();
    else {
        fprintf(stderr, "usage: report_saturated proof|count\n");
        return 2;
    }
    return 0;
}
