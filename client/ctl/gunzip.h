/* SPDX-License-Identifier: MIT */
/*
 * gunzip - files packed with gzip, as Cerulean's .svlz: whole into memory. Pure but for the heap.
 */
#ifndef SONARD_GUNZIP_H
#define SONARD_GUNZIP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

#define GUNZIP_MOST ((size_t)2 << 30) /* bytes that are unpacked of one file */

struct unpacked {
    uint8_t *p; /* for free() */
    size_t n;
    size_t lost;  /* bytes of the packed file behind damage, in which there is no other member */
    bool damaged; /* or cut off */
};

/** gunzip_is - does a gzip file begin here? */
bool gunzip_is(const uint8_t *data, size_t size);

/**
 * gunzip - all members of the file, one behind the other. Of a damaged one what comes before the damage, and then the
 * next one. False with a sentence in fault: more than GUNZIP_MOST bytes, or no memory; nothing is to be freed then.
 */
bool gunzip(const uint8_t *data, size_t size, struct unpacked *out, struct fault *fault);

#endif
