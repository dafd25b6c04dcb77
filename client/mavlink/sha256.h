/* SPDX-License-Identifier: MIT */
/*
 * sha256 - the hash of FIPS 180-4, for MAVLink signatures. Pure; knows nothing of keys or frames.
 */
#ifndef SONARD_SHA256_H
#define SONARD_SHA256_H

#include <stddef.h>
#include <stdint.h>

#define SHA256_BYTES 32

struct sha256 {
    uint32_t state[8];
    uint64_t bytes; /* taken so far */
    uint8_t block[64];
};

void sha256_begin(struct sha256 *hash);

/** sha256_add - n more bytes; in any pieces. */
void sha256_add(struct sha256 *hash, const void *bytes, size_t n);

/** sha256_end - the digest of all that was added; *hash is used up. */
void sha256_end(struct sha256 *hash, uint8_t digest[SHA256_BYTES]);

#endif
