/* SPDX-License-Identifier: MIT */
/*
 * map_export - a map of places as bytes that other tools open: its surface as PLY or as an MCAP file with one
 * foxglove.PointCloud, its volume as an OctoMap tree. Knows the map as it is read and no file.
 *
 * All have x east, y north, z up, in metres from the poses' origin, as such tools expect. The surface is the
 * frontier (grid/voxel/frontier.h), in the order in which it is kept: free voxels of which one of 26 neighbours is not
 * free. Tag 1: something was heard there or in a neighbour, 0: the end of what was looked at.
 */
#ifndef SONARD_MAP_EXPORT_H
#define SONARD_MAP_EXPORT_H

#include <stddef.h>
#include <stdint.h>

#include "../grid/voxel/frontier.h"

/* All give malloced bytes, *size of them, or NULL with a sentence in err. */

/** map_export_ply - double x, y, z, float nx, ny, nz, uchar tag. */
uint8_t *map_export_ply(struct frontier *f, size_t *size, char *err, size_t err_size);

/** map_export_points - the same points as the JSON of one foxglove.PointCloud message; t_unix_ns is its time. */
uint8_t *map_export_points(struct frontier *f, uint64_t t_unix_ns, size_t *size, char *err, size_t err_size);

/** map_export_points_schema - the JSON schema of that message. */
extern const char map_export_points_schema[];

/**
 * map_export_octomap - OctoMap's .bt: free and occupied leaves of a tree 16 levels deep, equal ones joined; what is
 * unknown has no leaf. Refused when the map lies farther from the origin than the 32768 voxels that OctoMap knows.
 */
uint8_t *map_export_octomap(struct voxmask *mask, size_t *size, char *err, size_t err_size);

#endif
