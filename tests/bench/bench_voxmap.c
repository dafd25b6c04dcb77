/* SPDX-License-Identifier: MIT */
/*
 * bench_voxmap - what is built on submaps: entering pings into the map, judging and surfacing what they changed, and
 * questions, at 0.1 m in scene A of voxel_scene.h (a shaft of 9 x 5 x 27 m). Beside the time of entering a ping: the
 * same beams cast into the bare submap.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/fault.h"
#include "grid/voxel/frontier.h"
#include "tests/lib/ask_map.h"
#include "voxel_scene.h"
#include "bench.h"

#define VOXEL_M 0.1
#define TURNS   60
#define BLOCKS  4096
#define ASKED   4096

static struct voxmap map;
static struct voxmask mask;
static struct frontier frontier;
static struct scene_ping ping[TURNS][SCENE_PINGS];

static double uniform(void)
{
    static uint64_t state = 1;
    state = state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(state >> 11) * 0x1p-53;
}

static void map_new(uint8_t levels, bool keep_echoes, double submap_path_m)
{
    struct fault fault;
    struct voxmap_setting s = {
        .voxel_m = VOXEL_M,
        .side = 8,
        .height = 300,
        .n_tiles = 500,
        .max_submaps = 16,
        .keep_echoes = keep_echoes,
        .rule = {.threshold = 2, .echo_weight = 4},
        .opening = 1,
        .weight_levels = levels,
        .submap_path_m = submap_path_m,
        .submap_ns = VOXMAP_NEVER,
        .half_life_ns = VOXMAP_NEVER,
    };
    free(map.part);
    voxmap_init(&map, &s, need(voxmap_bytes(&s, &fault)));
}

static void enter(const struct scene_ping *p, int turn, double range_m)
{
    static const struct voxmap_sensor sensor = {.mount = {.attitude = {1, 0, 0, 0}}, .shape = CAST_WEDGE};
    struct beam_echoes beam = {
        .free_to_m = (float)range_m, .state = p->echo ? BEAM_ECHO : BEAM_SILENT, .n = p->echo};
    struct echoes e = {
        .t_ns = (uint64_t)turn,
        .n_beams = 1,
        .az_aperture_rad = (float)geo_rad(SCENE_AZ_DEG),
        .el_aperture_rad = (float)geo_rad(SCENE_EL_DEG),
        .pose = {.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, .path_m = turn},
        .beam = &beam,
    };
    beam.echo[0] = (struct echo){.range_m = (float)range_m, .near_m = (float)range_m, .sd_m = 0.02f};
    memcpy(e.pose.position_m, p->position_m, sizeof e.pose.position_m);
    memcpy(e.pose.attitude, p->attitude, sizeof e.pose.attitude);
    voxmap_enter(&map, &e, &sensor);
}

static double enter_all(void)
{
    double start = cpu_ns();
    for (int turn = 0; turn < TURNS; turn++)
        for (int n = 0; n < SCENE_PINGS; n++)
            enter(&ping[turn][n], turn, ping[turn][n].range_m);
    return (cpu_ns() - start) / (TURNS * SCENE_PINGS);
}

static uint64_t surface_all(void)
{
    struct merge_walk walk = {0};
    struct block_key key;
    uint64_t blocks = 0;
    while (merge_next(&map, &walk, &key)) {
        frontier_block(&frontier, &key);
        blocks++;
    }
    return blocks;
}

static void entering(void)
{
    map_new(1, false, INFINITY);
    enter_all();
    printf("enter a ping, vacancy only                 %8.1f ns\n", enter_all());
    map_new(4, false, INFINITY);
    enter_all();
    printf("  weighted by angle, 4 levels              %8.1f ns\n", enter_all());
    map_new(1, true, INFINITY);
    enter_all();
    printf("  with echo evidence                       %8.1f ns\n", enter_all());
}

static void judging(const char *name)
{
    voxmask_init(&mask, &map, mask.block ? mask.block : need(voxmask_bytes(BLOCKS)), BLOCKS);
    frontier_init(&frontier, &mask, frontier.block ? frontier.block : need(frontier_bytes(BLOCKS)), BLOCKS);
    double start = cpu_ns();
    struct merge_walk walk = {0};
    struct block_key key;
    struct merge_block bits;
    uint64_t blocks = 0;
    while (merge_next(&map, &walk, &key)) {
        merge_block(&map, &key, &bits);
        blocks++;
    }
    printf("%s: merge and judge a block of 16384 voxels  %8.1f ns\n", name, (cpu_ns() - start) / (double)blocks);
    start = cpu_ns();
    blocks = surface_all();
    printf("  frontier, all anew: %5.0f us, %4u blocks, each  %8.1f ns\n", (cpu_ns() - start) / 1e3,
           (unsigned)blocks, (cpu_ns() - start) / (double)blocks);
    uint64_t judged = mask.computed, made = frontier.computed;
    start = cpu_ns();
    for (int n = 0; n < SCENE_PINGS; n++) {
        enter(&ping[TURNS / 2][n], TURNS, ping[TURNS / 2][n].range_m);
        surface_all();
    }
    printf("  kept up after each ping                  %8.1f ns (%.1f blocks judged, %.1f surfaced)\n",
           (cpu_ns() - start) / SCENE_PINGS, (double)(mask.computed - judged) / SCENE_PINGS,
           (double)(frontier.computed - made) / SCENE_PINGS);
}

/* Every submap lies elsewhere, and is turned: mostly about the vertical, and a little tilted. */
static void correct_all(void)
{
    const double to_m[3] = {0.234, -0.111, 0.05};
    double turn[4];
    quat_from_rpy(0.01, -0.02, 0.1, turn);
    for (uint64_t id = 1; id < map.next_id; id++)
        voxmap_move(&map, id, to_m, turn);
}

static void asking(void)
{
    static double from[ASKED][3], way[ASKED][2][3];
    struct free_answer a;
    double voxels = 0;
    int free_ways = 0;
    for (int n = 0; n < ASKED; n++)
        for (int x = 0; x < 3; x++) {
            from[n][x] = 2 * uniform() - 1;
            way[n][0][x] = from[n][x];
            way[n][1][x] = from[n][x] + 1.5 * (2 * uniform() - 1) * (x == 2 ? 0.2 : 1);
        }
    for (int n = 0; n < ASKED; n++) /* finds the blocks */
        free_query_point(&mask, from[n], &a);
    double start = cpu_ns();
    for (int n = 0; n < ASKED; n++)
        free_query_point(&mask, from[n], &a);
    printf("point                                      %8.1f ns\n", (cpu_ns() - start) / ASKED);
    start = cpu_ns();
    for (int n = 0; n < ASKED / 8; n++) {
        free_query_corridor(&mask, (const double(*)[3])way[n], 2, 0.4, &a);
        voxels += (double)a.voxels;
        free_ways += a.state == VOXEL_FREE;
    }
    printf("corridor of 0.4 m radius                   %8.1f us (%.0f voxels, %.1f ns each; %d of %d free)\n",
           (cpu_ns() - start) / 1e3 / (ASKED / 8), voxels / (ASKED / 8), (cpu_ns() - start) / voxels, free_ways,
           ASKED / 8);
}

/* The largest question that a client may ask, and how long pings wait for a step of it. */
static void large_question(const char *name, struct free_query *q)
{
    double whole = 0, longest = 0;
    int steps = 0;
    for (bool done = false; !done; steps++) {
        const double start = cpu_ns();
        done = free_query_step(q, &mask);
        const double step = cpu_ns() - start;
        whole += step;
        longest = step > longest ? step : longest;
    }
    printf("%s of %.1e voxels: %4.0f us in %3d steps, the longest %8.1f us\n", name, (double)q->answer.voxels,
           whole / 1e3, steps, longest / 1e3);
}

static void asking_for_much(void)
{
    static const double low[3] = {-6.2, -6.2, -6.2}, high[3] = {6.2, 6.2, 6.2},
                        way[2][3] = {{-12, 0, 0}, {12, 0, 0}};
    struct free_query q;
    free_query_begin_box(&q, map.set.voxel_m, low, high);
    large_question("box", &q);
    free_query_begin_corridor(&q, map.set.voxel_m, way, 2, 4.4);
    large_question("corridor", &q);
}

int main(void)
{
    for (int turn = 0; turn < TURNS; turn++)
        for (int n = 0; n < SCENE_PINGS; n++)
            ping[turn][n] = scene_at('A', turn, TURNS, n);
    entering();
    judging("one submap");
    asking();
    asking_for_much();
    correct_all();
    judging("the same, corrected");
    map_new(1, true, 5);
    enter_all();
    judging("twelve submaps");
    correct_all();
    judging("the same, corrected");
    return 0;
}
