/* SPDX-License-Identifier: MIT */
/*
 * map_file - a voxel map as the bytes of a file: versioned, with a checksum. What is read is never trusted. Knows
 * submaps as the plain bytes that grid/voxel/voxpage packs, and no folder.
 *
 *   offset  bytes   all numbers little-endian
 *   0       8       "SONARDVM"
 *   8       4       version, 3; 2 is read, which lacks the residual, and 1, which also lacks what stands from 32 to 95
 *   12      4       submaps
 *   16      8       edge of a voxel in metres, as a 64-bit float
 *   24      4       voxels of a submap's height
 *   28      4       1: echoes are kept, 0: not
 *   32      8       run that made it: nanoseconds since 1970 when it began
 *   40      56      what its places count from, in UTF-8, 0 behind; all 0: nobody said
 *   96      ...     per submap, oldest first: 8 bytes size, then so many bytes
 *   then    ...     the residual (grid/voxel/residual.h): 8 bytes size, 0 or a power of 2 in
 *                   [2^12, 2^22], then so many counts
 *   end - 4 4       CRC-32 (as in zlib) of all before
 */
#ifndef SONARD_MAP_FILE_H
#define SONARD_MAP_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "grid/voxel/voxmap.h"

#define MAP_FILE_MAGIC_BYTES 8
#define MAP_FILE_HEAD_BYTES  12 /* that say what a file is */
#define MAP_ORIGIN_MAX       56 /* bytes of an origin's name, with its NUL */

/* What the places of a map count from. */
struct map_origin {
    uint64_t run;              /* that made it; 0: of version 1, nobody knows */
    char name[MAP_ORIGIN_MAX]; /* empty: nobody said; another run may have counted from anywhere else */
};

enum map_fault {
    MAP_GOOD,
    MAP_MISSING, /* no such file */
    MAP_UNREAD,  /* it cannot be read, or no memory */
    MAP_FOREIGN, /* not a map, of a version that this program does not know, or of other voxels than wanted */
    MAP_DAMAGED, /* began as one */
};

/* Bytes of a file that is being made. */
struct map_bytes {
    uint8_t *bytes; /* malloced; NULL: nothing yet */
    size_t size, room;
};

/** map_file_begin - the header. False without memory; so for all three. */
bool map_file_begin(struct map_bytes *b, const struct voxmap_setting *setting, const struct map_origin *origin);

/** map_file_room - room for one more submap of at most `size` bytes, to be packed there; NULL without memory. */
uint8_t *map_file_room(struct map_bytes *b, size_t size);

/** map_file_bytes - what a submap of `size` bytes takes of a file. */
size_t map_file_bytes(size_t size);

/** map_file_take - `size` bytes of that room are a submap. */
void map_file_take(struct map_bytes *b, size_t size);

/** map_file_end - puts the residual of n counts (0: none) and the checksum behind. */
bool map_file_end(struct map_bytes *b, const uint8_t *residual, size_t n);

/* A submap within the bytes of a file. */
struct map_page {
    const uint8_t *bytes;
    size_t size;
    uint32_t number; /* 1, 2 ... */
};

/** map_file_most - bytes that a file with as much as fits into a map of this setting cannot have more than. */
size_t map_file_most(const struct voxmap_setting *setting);

/**
 * map_file_check_head - may a file of `size` bytes that begins with these n be a map that fits? Before it is read.
 * MAP_FOREIGN with a sentence in fault, else MAP_GOOD.
 */
enum map_fault map_file_check_head(const uint8_t *head, size_t n, size_t size,
                                   const struct voxmap_setting *setting, struct fault *fault);

/** map_file_check - are these bytes a whole map of such voxels? *n_pages: its submaps. Else a sentence in fault. */
enum map_fault map_file_check(const uint8_t *bytes, size_t size, const struct voxmap_setting *setting,
                              uint32_t *n_pages, struct fault *fault);

/** map_file_origin - what the places of a map that was checked count from. */
struct map_origin map_file_origin(const uint8_t *bytes);

/** map_file_page - the next submap of a map that was checked; start with *page all zero. False: that was all. */
bool map_file_page(const uint8_t *bytes, size_t size, struct map_page *page);

/** map_file_residual - the residual of a map that was checked: n counts; NULL: none. */
const uint8_t *map_file_residual(const uint8_t *bytes, size_t size, uint32_t *n);

#endif
