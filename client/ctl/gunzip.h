/* SPDX-License-Identifier: MIT */
/*
 * gunzip - files packed with gzip, as Cerulean's .svlz: piece by piece, or whole into memory where they are small. A
 * few bytes may unpack to any number of them, so nothing is held that has no bound. Pure but for the heap.
 */
#ifndef SONARD_GUNZIP_H
#define SONARD_GUNZIP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

#define GUNZIP_PIECE     ((size_t)256 << 10)
#define GUNZIP_WHOLE_MAX ((size_t)64 << 20) /* bytes that are unpacked into memory of one file */

struct unpacked {
    uint8_t *p; /* of the whole, for free(); of pieces NULL */
    uint64_t n;
    size_t lost;  /* bytes of the packed file behind damage, in which there is no other member */
    bool damaged; /* or cut off */
    bool stopped; /* by who takes the pieces */
};

/** gunzip_fn - 1 to GUNZIP_PIECE bytes, the next ones. False: stop. */
typedef bool (*gunzip_fn)(void *ctx, const uint8_t *bytes, size_t n);

/** gunzip_is - does a gzip file begin here? */
bool gunzip_is(const uint8_t *data, size_t size);

/**
 * gunzip_pieces - all members of the file, one behind the other. Of a damaged one what comes before the damage, and
 * then the next one. False with a sentence in fault: no memory.
 */
bool gunzip_pieces(const uint8_t *data, size_t size, gunzip_fn take, void *ctx, struct unpacked *out,
                   struct fault *fault);

/**
 * gunzip - the same into memory. False with a sentence in fault: more than GUNZIP_WHOLE_MAX bytes, or no memory;
 * nothing is to be freed then.
 */
bool gunzip(const uint8_t *data, size_t size, struct unpacked *out, struct fault *fault);

#endif
