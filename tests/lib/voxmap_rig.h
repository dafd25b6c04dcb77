/* SPDX-License-Identifier: MIT */
/* voxmap_rig.h - a voxel map with memory of its own, and pings for it, as the tests of grid/voxel want them. */
#ifndef SONARD_TEST_VOXMAP_RIG_H
#define SONARD_TEST_VOXMAP_RIG_H

#include "core/fault.h"
#include "grid/voxel/frontier.h"
#include "grid/voxel/merge.h"
#include "grid/voxel/voxmap.h"
#include "grid/voxel/voxmask.h"
#include "test.h"

#define RIG_BLOCKS 1024
#define SECOND     UINT64_C(1000000000)

struct rig {
    struct voxmap map;
    struct voxmask mask;
    struct frontier frontier;
    void *memory, *mask_memory, *frontier_memory;
};

static inline struct voxmap_setting rig_setting(void)
{
    return (struct voxmap_setting){
        .voxel_m = 0.1,
        .side = 8,
        .height = 80,
        .n_tiles = 400,
        .max_submaps = 8,
        .keep_echoes = true,
        .rule = {.threshold = 2, .echo_weight = 4},
        .opening = 1,
        .weight_levels = 1,
        .submap_path_m = INFINITY,
        .submap_ns = VOXMAP_NEVER,
        .half_life_ns = VOXMAP_NEVER,
    };
}

static inline void *rig_memory(size_t bytes)
{
    void *p = bytes ? malloc(bytes) : NULL;
    if (!p) {
        printf("no memory\n");
        exit(1);
    }
    memset(p, 0x5a, bytes);
    return p;
}

static inline struct rig *rig_new(const struct voxmap_setting *s)
{
    struct rig *r = rig_memory(sizeof *r);
    struct fault fault = {""};
    size_t bytes = voxmap_bytes(s, &fault);
    if (!bytes)
        printf("%s\n", fault.text);
    r->memory = rig_memory(bytes);
    r->mask_memory = rig_memory(voxmask_bytes(RIG_BLOCKS));
    r->frontier_memory = rig_memory(frontier_bytes(RIG_BLOCKS));
    voxmap_init(&r->map, s, r->memory);
    voxmask_init(&r->mask, &r->map, r->mask_memory, RIG_BLOCKS);
    frontier_init(&r->frontier, &r->mask, r->frontier_memory, RIG_BLOCKS);
    return r;
}

static inline void rig_free(struct rig *r)
{
    free(r->memory);
    free(r->mask_memory);
    free(r->frontier_memory);
    free(r);
}

static const struct voxmap_sensor rig_sensor = {
    .mount = {.attitude = {1, 0, 0, 0}},
    .shape = CAST_WEDGE,
};

/* One beam of 3 x 35 degrees or another width, heading along az, from a place. */
struct rig_ping {
    struct echoes echoes;
    struct beam_echoes beam;
};

static inline void rig_aim(struct rig_ping *p, const double position_m[3], double az_rad, double free_m)
{
    *p = (struct rig_ping){
        .echoes = {.n_beams = 1,
                   .max_beams = 1,
                   .az_aperture_rad = (float)geo_rad(3),
                   .el_aperture_rad = (float)geo_rad(35),
                   .pose = {.attitude = {1, 0, 0, 0}, .has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH}},
        .beam = {.az_rad = (float)az_rad, .free_to_m = (float)free_m, .state = BEAM_SILENT},
    };
    memcpy(p->echoes.pose.position_m, position_m, sizeof p->echoes.pose.position_m);
    p->echoes.beam = &p->beam;
}

/* The beam hears something at its end. */
static inline void rig_hear(struct rig_ping *p, double range_m)
{
    p->beam.state = BEAM_ECHO;
    p->beam.free_to_m = (float)(range_m - 0.05);
    p->beam.n = 1;
    p->beam.echo[0] = (struct echo){.range_m = (float)range_m, .near_m = (float)(range_m - 0.05), .sd_m = 0.02f};
}

static inline bool rig_enter(struct rig *r, struct rig_ping *p, uint64_t t_ns)
{
    p->echoes.t_ns = t_ns;
    return voxmap_enter(&r->map, &p->echoes, &rig_sensor);
}

/* A whole turn of free water of free_m around a place. */
static inline void rig_turn(struct rig *r, const double position_m[3], double free_m, uint64_t t_ns)
{
    struct rig_ping p;
    for (int n = 0; n < 120; n++) {
        rig_aim(&p, position_m, geo_rad(3 * n), free_m);
        rig_enter(r, &p, t_ns);
    }
}

static inline enum voxel_state rig_state(struct rig *r, double north, double east, double down)
{
    const double h = r->map.set.voxel_m;
    const int64_t cell[3] = {(int64_t)floor(north / h), (int64_t)floor(east / h), (int64_t)floor(down / h)};
    return merge_at(&r->map, cell);
}

/* Id of the oldest submap but the current one; 0: none. */
static inline uint64_t rig_oldest(const struct rig *r)
{
    uint64_t id = 0;
    for (uint32_t p = 0; p < r->map.set.max_submaps; p++) {
        const struct voxmap_part *part = &r->map.part[p];
        if (part->id && part != r->map.current && (!id || part->id < id))
            id = part->id;
    }
    return id;
}

/* Opens a submap around the origin into which cells are then written. */
static inline void rig_open(struct rig *r)
{
    struct rig_ping p;
    rig_aim(&p, (const double[3]){0.01, 0.01, 0.01}, 0, 0);
    rig_enter(r, &p, 0);
}

/* Writes a count of the current submap. */
static inline void rig_set(struct rig *r, const int64_t cell[3], enum submap_plane plane, uint8_t count)
{
    struct submap *m = &r->map.current->map;
    const struct lattice_place at = {{cell[0], cell[1], cell[2]}, {0.5, 0.5, 0.5}};
    m->now = ++r->map.change;
    submap_body(m, &at, &at, 0.1, 0); /* takes a tile */
    const int32_t i = (int32_t)(cell[0] - m->box.first[0]), j = (int32_t)(cell[1] - m->box.first[1]);
    const int32_t k = (int32_t)(cell[2] - m->box.first[2]);
    const size_t entry = submap_entry(m, i, j);
    tiles_column(m->tiles, m->tile[entry], submap_column(i, j), plane)[k] = count;
    m->written[entry * m->slices + submap_slice(m, k)] = m->now;
}

/* A number that stands for all states in a box of cells around the origin. */
static inline uint64_t rig_hash(struct rig *r, int64_t reach, const int64_t shift[3])
{
    uint64_t h = 1469598103934665603u;
    for (int64_t i = -reach; i < reach; i++)
        for (int64_t j = -reach; j < reach; j++)
            for (int64_t k = -reach; k < reach; k++) {
                const int64_t cell[3] = {i + shift[0], j + shift[1], k + shift[2]};
                struct merge_sum s = merge_sum(&r->map, cell);
                h = (h ^ (s.vacancy + 1000u * s.echoes)) * 1099511628211u;
            }
    return h;
}

#endif
