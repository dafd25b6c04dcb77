/* SPDX-License-Identifier: MIT */
/*
 * voxpage - a closed submap as plain bytes, to be put away and brought back: the same on every machine. Knows no file;
 * whoever stores the bytes guards them with a checksum.
 *
 * A closed submap never changes, so its bytes may be packed in slices, written by another thread, and only when they are
 * safe is it detached. While it is away, voxels of its tiles answer unknown, but where the others' evidence is enough.
 */
#ifndef SONARD_VOXPAGE_H
#define SONARD_VOXPAGE_H

#include "voxmap.h"

/** voxpage_bytes - of a submap that is not away, as packed; 0: no such. The current one may be packed too (to save a
 * map), in one go: pings change it. */
size_t voxpage_bytes(const struct voxmap *m, uint64_t id);

/**
 * voxpage_pack - bytes from..from+size-1 of the packed submap into out; size is cut at the end. Returns what was written.
 * 0: at the end, or no such submap any more.
 */
size_t voxpage_pack(const struct voxmap *m, uint64_t id, size_t from, uint8_t *out, size_t size);

/** voxpage_detach - gives a closed submap's tiles back; it is away. False: no such, the current one, or away already. */
bool voxpage_detach(struct voxmap *m, uint64_t id);

/**
 * voxpage_attach - brings a submap that is away back from its bytes. False, with a sentence in err, when it is not away,
 * the bytes are not its own, or there are too few tiles (voxpage_tiles): the map is as it was.
 */
bool voxpage_attach(struct voxmap *m, uint64_t id, const uint8_t *bytes, size_t size, char *err, size_t err_size);

/**
 * voxpage_add - a submap of another run, as a closed one with a new id, which is returned. It ages from now on (what it
 * had aged by when it was packed stays). 0, with a
 * sentence in err, when the bytes are no submap, of another voxel size or height, or there is no room.
 */
uint64_t voxpage_add(struct voxmap *m, const uint8_t *bytes, size_t size, char *err, size_t err_size);

#define VOXPAGE_HEAD 232 /* bytes with which a packed submap begins: all but its tiles */

/**
 * voxpage_head - the head that a submap would get if it were packed now, also of one that is away: what was packed before
 * has aged since, and may have been moved. False: no such.
 */
bool voxpage_head(const struct voxmap *m, uint64_t id, uint8_t head[VOXPAGE_HEAD]);

/** voxpage_unlike - why these bytes are no submap of this map's kind (size and height of submaps and voxels, evidence): a
 * phrase; NULL: they may be one. Looks at their head alone. */
const char *voxpage_unlike(const struct voxmap *m, const uint8_t *bytes, size_t size);

/** voxpage_tiles - tiles that these bytes need; TILE_NONE: they are no packed submap. */
uint32_t voxpage_tiles(const uint8_t *bytes, size_t size);

#endif
