/* SPDX-License-Identifier: MIT */
/* bytes - a message as it is written: bytes that grow as they come. */
#ifndef SONARD_BYTES_H
#define SONARD_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct bytes {
    uint8_t *data; /* for free() */
    size_t size, room;
    bool failed; /* no memory: what came since is missing */
};

/** bytes_put - n bytes more. */
void bytes_put(struct bytes *bytes, const void *data, size_t n);

/** bytes_number - the lowest n bytes (1 to 8) of a number, little-endian. */
void bytes_number(struct bytes *bytes, uint64_t number, int n);

/** bytes_float - as an IEEE 754 number of 4 bytes, little-endian. */
void bytes_float(struct bytes *bytes, double value);

/** bytes_insert - n bytes in front of those from `at` on. */
void bytes_insert(struct bytes *bytes, size_t at, const void *data, size_t n);

#endif
