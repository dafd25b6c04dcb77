/* SPDX-License-Identifier: MIT */
/*
 * voxpage - a closed submap as plain bytes, to be kept and added to a map again: the same on every machine. Knows no
 * file; whoever stores the bytes guards them with a checksum.
 */
#ifndef SONARD_VOXPAGE_H
#define SONARD_VOXPAGE_H

#include "core/fault.h"
#include "voxmap.h"

/** voxpage_bytes - of a submap, as packed; 0: no such. The current one may be packed too (to save a map), in one go:
 * pings change it. */
size_t voxpage_bytes(const struct voxmap *m, uint64_t id);

/**
 * voxpage_pack - bytes from..from+size-1 of the packed submap into out; size is cut at the end. Returns what was
 * written. 0: at the end, or no such submap any more.
 */
size_t voxpage_pack(const struct voxmap *m, uint64_t id, size_t from, uint8_t *out, size_t size);

/**
 * voxpage_add - a submap of another run, as a closed one with a new id, which is returned. It ages from now on (what it
 * had aged by when it was packed stays). 0, with a
 * sentence in fault, when the bytes are no submap, of another voxel size or height, or there is no room.
 */
uint64_t voxpage_add(struct voxmap *m, const uint8_t *bytes, size_t size, struct fault *fault);

/** voxpage_unlike - why these bytes are no submap of this map's kind (size and height of submaps and voxels, evidence):
 * a phrase; NULL: they may be one. Looks at their head alone. */
const char *voxpage_unlike(const struct voxmap *m, const uint8_t *bytes, size_t size);

/** voxpage_tiles - tiles that these bytes need; TILE_NONE: they are no packed submap. */
uint32_t voxpage_tiles(const uint8_t *bytes, size_t size);

#endif
