/* SPDX-License-Identifier: MIT */
/*
 * template_file - a background template as bytes and as a file: versioned, with a checksum, written beside the old
 * file and moved over it, so that a power cut leaves the one or the other. What is read is never trusted.
 *
 *   offset  bytes   all numbers little-endian
 *   0       8       "SONARDBG"
 *   8       4       version, 1
 *   12      4       head_turn: units of the head in a turn; 0: rows are the beams of a fan
 *   16      4       rows R
 *   20      4       bins B
 *   24      4 4     near edge of bin 0 and length of a bin in metres, as 32-bit floats
 *   32      4 4     azimuth of row 0 and from one row to the next in radians, as 32-bit floats
 *   40      4       decibels per count, as a 32-bit float; 0 unless law is 3
 *   44      4       amplitude law: 0 linear, 1 power, 2 square root, 3 decibels
 *   48      R       pings behind each row, 0: not learnt, at most 64
 *   48+R    R*B     counts, row by row; 0 in rows that were not learnt
 *   48+R+RB 4       CRC-32 (as in zlib) of all before
 */
#ifndef SONARD_TEMPLATE_FILE_H
#define SONARD_TEMPLATE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "grid/range/background.h"

enum template_fault {
    TEMPLATE_GOOD,
    TEMPLATE_MISSING, /* no such file */
    TEMPLATE_UNREAD,  /* it cannot be read, or no memory */
    TEMPLATE_FOREIGN, /* not a template, or of a version that this program does not know */
    TEMPLATE_DAMAGED, /* began as one */
};

/** template_encode - the file's bytes, malloced, *size of them; NULL without memory. */
uint8_t *template_encode(const struct background *background, size_t *size);

/** template_decode - a malloced template of exactly these bytes, or NULL with a sentence in fault and *kind set. */
struct background *template_decode(const uint8_t *bytes, size_t size, uint8_t mask_above,
                                   enum template_fault *kind, struct fault *fault);

/**
 * template_write - replace `path` by encoded bytes. Does not replace what is there and is not a template. Takes as long
 * as the disk needs to confirm. False with a sentence in fault; the old file is untouched then.
 */
bool template_write(const uint8_t *bytes, size_t size, const char *path, struct fault *fault);

/**
 * template_load - as template_decode. A damaged file is renamed to PATH.damaged, which the sentence says, so that it is
 * not met again and can be looked at.
 */
struct background *template_load(const char *path, uint8_t mask_above, enum template_fault *kind,
                                 struct fault *fault);

#endif
