/* SPDX-License-Identifier: MIT */
/*
 * bench_voxel - beams into a voxel submap: time per ping and per voxel raised, beside the time that adding 1 to one
 * byte of the very same cache lines takes, the map's bytes, and what is wrong. Scenes of voxel_scene.h, and a fan of
 * 512 beams. "bench_voxel SCENE VOXEL TURNS" runs one scene (F: the fan) only, for counting instructions.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/fault.h"
#include "grid/voxel/submap.h"
#include "voxel_scene.h"
#include "bench.h"

#define ROUNDS 5 /* the median of which is said */

static const struct lattice_place middle = {{0, 0, 0}, {0.5, 0.5, 0.5}};
static struct submap map;
static struct tiles tiles;

static void map_new(double reach_m, double height_m, double voxel_m)
{
    uint32_t side = (uint32_t)(2 * reach_m / voxel_m / TILE_SIDE) + 3, height = (uint32_t)(height_m / voxel_m) + 2;
    tiles_init(&tiles, need(tiles_bytes(side * side, height, 1)), side * side, height, 1);
    submap_init(&map, need(submap_bytes(side, height)), side, &tiles, &middle);
}

static void map_free(void)
{
    free(tiles.next);
    free(map.tile);
}

/* ---- the lines of memory that pings touch ---- */

struct lines {
    uint8_t **line;
    size_t n, room;
    uint64_t voxels;
};

static void note_lines(void *context, const struct cast_spans *s)
{
    struct lines *k = context;
    for (int l = 0; l < s->runs; l++) {
        if (s->n[l] <= 0)
            continue;
        uint32_t i = (uint32_t)s->i[l], j = (uint32_t)s->j[l];
        uint32_t tile = map.tile[i / TILE_SIDE * ((uint32_t)map.box.size[1] / TILE_SIDE) + j / TILE_SIDE];
        uintptr_t first =
            (uintptr_t)(tiles_column(&tiles, tile, i % TILE_SIDE * TILE_SIDE + j % TILE_SIDE, 0) + s->k[l]);
        for (uintptr_t at = first / 64; at <= (first + (uintptr_t)s->n[l] - 1) / 64; at++) {
            if (k->n == k->room) {
                k->room = 2 * k->room + 4096;
                k->line = realloc(k->line, k->room * sizeof *k->line);
                if (!k->line)
                    exit(1);
            }
            k->line[k->n++] = (uint8_t *)(at * 64 < first ? first : at * 64);
        }
        k->voxels += (uint64_t)s->n[l];
    }
}

static double touch_lines(const struct lines *k)
{
    double start = cpu_ns();
    for (size_t n = 0; n < k->n; n++) {
        uint64_t word;
        memcpy(&word, k->line[n], sizeof word);
        word += 1;
        memcpy(k->line[n], &word, sizeof word);
    }
    return cpu_ns() - start;
}

/* ---- scenes ---- */

static void cast_turn(const struct cast_beam *beam, int n)
{
    for (int b = 0; b < n; b++)
        submap_cast(&map, &beam[b], SUBMAP_VACANCY);
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void report(const char *name, double voxel_m, const struct cast_beam *beam, int n, int pings)
{
    double cast_ns[ROUNDS], touch_ns[ROUNDS];
    struct lines k = {0};
    for (int b = 0; b < n; b++)
        cast_run(&beam[b], &map.box, note_lines, &k);
    for (int r = 0; r < ROUNDS; r++) {
        double start = cpu_ns();
        cast_turn(beam, n);
        cast_ns[r] = (cpu_ns() - start) / pings;
        touch_ns[r] = touch_lines(&k) / pings;
    }
    qsort(cast_ns, ROUNDS, sizeof *cast_ns, by_size);
    qsort(touch_ns, ROUNDS, sizeof *touch_ns, by_size);
    double voxels = (double)k.voxels / pings;
    size_t stored = (size_t)map.n_tiles * TILE_SIDE * TILE_SIDE * tiles.height;
    size_t bytes = map.n_tiles * (tiles.tile_bytes + sizeof *tiles.next) +
                   submap_bytes((uint32_t)map.box.size[0] / TILE_SIDE, tiles.height) + sizeof map;
    printf("%-6s %5.2f m %9.1f ns/ping %8.1f voxels %7.3f ns/voxel %7.1f lines %9.1f ns to touch them: %5.1f x   "
           "%5.1f MB, %.2f bytes/voxel, %llu clipped, %llu starved\n",
           name, voxel_m, cast_ns[ROUNDS / 2], voxels, cast_ns[ROUNDS / 2] / voxels, (double)k.n / pings,
           touch_ns[ROUNDS / 2], cast_ns[ROUNDS / 2] / touch_ns[ROUNDS / 2], (double)bytes / 1e6,
           (double)bytes / (double)stored, (unsigned long long)map.stats.clipped,
           (unsigned long long)map.stats.starved);
    free(k.line);
}

/* All turns are cast once, so that the map has grown and its memory is there; the last are timed. */
static void scene(char which, double voxel_m, int turns, bool timed)
{
    static struct cast_beam beam[10 * SCENE_PINGS];
    struct cast_opening o;
    struct fault fault;
    char name[2] = {which, '\0'};
    int kept = 0;
    if (!cast_opening_init(&o, CAST_WEDGE, geo_rad(SCENE_AZ_DEG) / 2, geo_rad(SCENE_EL_DEG) / 2, 0, &fault))
        exit(1);
    map_new(which == 'B' ? 51 : 9, which == 'B' ? 40 : 27, voxel_m);
    for (int turn = 0; turn < turns; turn++) {
        if (kept + SCENE_PINGS > 10 * SCENE_PINGS)
            kept = 0;
        for (int p = 0; p < SCENE_PINGS; p++) {
            struct scene_ping ping = scene_at(which, turn, turns, p);
            struct lattice_place at;
            struct cast_beam *b = &beam[kept++];
            if (!lattice_place(ping.position_m, voxel_m, &at) ||
                !cast_aim(b, &o,
                          &(struct cast_look){
                              .apex = &at, .attitude = ping.attitude, .far_m = ping.range_m, .voxel_m = voxel_m}))
                exit(1);
            submap_cast(&map, b, SUBMAP_VACANCY);
        }
    }
    if (timed)
        report(name, voxel_m, beam, kept, kept);
    map_free();
}

/* 512 beams over 120 degrees ahead, 20 degrees high; each half its spacing wide to either side. */
static void fan(double voxel_m, int turns, bool timed)
{
    static struct cast_beam beam[512];
    struct cast_opening o;
    struct fault fault;
    const double level[4] = {1, 0, 0, 0}, pitch_deg = 120.0 / 512, position_m[3] = {0.03, 0.03, 0.04};
    struct lattice_place at;
    if (!lattice_place(position_m, voxel_m, &at) ||
        !cast_opening_init(&o, CAST_WEDGE, geo_rad(pitch_deg) / 2, geo_rad(10), 0, &fault))
        exit(1);
    map_new(21, 8, voxel_m);
    for (int b = 0; b < 512; b++)
        if (!cast_aim(&beam[b], &o,
                      &(struct cast_look){.apex = &at,
                                          .attitude = level,
                                          .az_rad = geo_rad(pitch_deg * (b + 0.5) - 60),
                                          .far_m = 20 - 0.01 * (b % 50),
                                          .voxel_m = voxel_m}))
            exit(1);
    for (int turn = 0; turn < turns; turn++)
        cast_turn(beam, 512);
    if (timed)
        report("fan", voxel_m, beam, 512, 1);
    map_free();
}

int main(int argc, char **argv)
{
    if (argc == 4) {
        if (argv[1][0] == 'F')
            fan(atof(argv[2]), atoi(argv[3]), false);
        else
            scene(argv[1][0], atof(argv[2]), atoi(argv[3]), false);
        return 0;
    }
    for (const char *which = "AT"; *which; which++)
        for (int v = 0; v < 4; v++)
            scene(*which, (const double[]){0.5, 0.2, 0.1, 0.05}[v], 100, true);
    scene('B', 0.5, 2, true);
    scene('B', 0.2, 2, true);
    fan(0.2, 1, true);
    fan(0.1, 1, true);
    return 0;
}
