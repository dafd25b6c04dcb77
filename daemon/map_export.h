/* SPDX-License-Identifier: MIT */
/*
 * map_export - a map of places as bytes that other tools open: its surface as PLY or as an MCAP file with one
 * foxglove.PointCloud, its volume as an OctoMap tree. Knows the state of cells, not how a map keeps it, and no file.
 *
 * All have x east, y north, z up, in metres from the poses' origin, as such tools expect. The surface is where free
 * voxels end: every free voxel with one among its 26 neighbours that is not. Its normal points into the free
 * water; tag 1: something was heard in a neighbour, 0: the end of what was looked at.
 */
#ifndef SONARD_MAP_EXPORT_H
#define SONARD_MAP_EXPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../grid/voxel/submap.h"

struct map_scene {
    double voxel_m;
    struct lattice_box box; /* outside all is unknown */
    enum voxel_state (*at)(void *ctx, const int64_t cell[3]);
    bool (*any)(void *ctx, const struct lattice_box *part); /* false: all of that part is unknown */
    void *ctx;
};

/* All give malloced bytes, *size of them, or NULL with a sentence in err. */

/** map_export_ply - double x, y, z, float nx, ny, nz, uchar tag. */
uint8_t *map_export_ply(const struct map_scene *scene, size_t *size, char *err, size_t err_size);

/** map_export_points - the same points as the JSON of one foxglove.PointCloud message; t_unix_ns is its time. */
uint8_t *map_export_points(const struct map_scene *scene, uint64_t t_unix_ns, size_t *size, char *err,
                           size_t err_size);

/** map_export_points_schema - the JSON schema of that message. */
extern const char map_export_points_schema[];

/**
 * map_export_octomap - OctoMap's .bt: free and occupied leaves of a tree 16 levels deep, equal ones joined; what is
 * unknown has no leaf. Refused when the map lies farther from the origin than the 32768 voxels that OctoMap knows.
 */
uint8_t *map_export_octomap(const struct map_scene *scene, size_t *size, char *err, size_t err_size);

#endif
