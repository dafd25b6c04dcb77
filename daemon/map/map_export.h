/* SPDX-License-Identifier: MIT */
/*
 * map_export - a voxel map as bytes that other tools open: its surface as PLY or as an MCAP file with one
 * foxglove.PointCloud, its volume as an OctoMap tree. Knows the map as it is read and no
 * file's name.
 *
 * All have x east, y north, z up, in metres from the poses' origin, as such tools expect. The surface is the
 * frontier (grid/voxel/frontier.h), in the order in which it is kept: free voxels of which one of 26 neighbours is not
 * free. Tag 1: an echo came from there or from a neighbour, 0: the end of what was looked at.
 */
#ifndef SONARD_MAP_EXPORT_H
#define SONARD_MAP_EXPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "grid/voxel/frontier.h"

/* Those with a size give malloced bytes, *size of them, or NULL with a sentence in fault. */

/** map_export_ply - double x, y, z, float nx, ny, nz, uchar tag, red, green, blue: coloured by depth. */
uint8_t *map_export_ply(struct frontier *f, size_t *size, struct fault *fault);

/**
 * map_export_points - the same points as one foxglove.PointCloud message of the time t_unix_ns, in an MCAP file. Owns
 * fd, an empty file open for writing, from here on. False with a sentence in fault.
 */
bool map_export_points(struct frontier *f, uint64_t t_unix_ns, const char *library, int fd, struct fault *fault);

/**
 * map_export_octomap - OctoMap's .bt: free and occupied leaves of a tree 16 levels deep, equal ones joined; what is
 * unknown has no leaf. Refused when the map lies farther from the origin than the 32768 voxels that OctoMap knows.
 */
uint8_t *map_export_octomap(struct voxmask *mask, size_t *size, struct fault *fault);

#endif
