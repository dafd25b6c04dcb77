/* SPDX-License-Identifier: MIT */
/*
 * tap - a pseudo-terminal that says what a sonar says, so that a viewer or a logger can listen while sonard owns the
 * sonar. It is found by a symbolic link of one's choice. Nothing that happens at the tap reaches the sonar or holds
 * anybody up: what is written to it is thrown away, what its reader does not take is thrown away, both are counted.
 *
 * There is one queue of bytes, as in any terminal: whoever opens it may read, one after the other; two at the same
 * time would share the bytes.
 */
#ifndef SONARD_TAP_H
#define SONARD_TAP_H

#include <stddef.h>
#include <stdint.h>

/* Counters only grow. */
struct tap_status {
    uint64_t given;   /* bytes that a reader could take */
    uint64_t dropped; /* bytes for which an open tap had no room */
    uint64_t refused; /* bytes that somebody wrote to it */
};

struct tap;

/**
 * tap_open - a raw pseudo-terminal behind the link `path`, for our user and group. The link is made in one step; one
 * that leads nowhere is replaced, anything else in its place is left alone. NULL with a sentence in err.
 */
struct tap *tap_open(const char *path, char *err, size_t err_size);

/** tap_mirror - n bytes came from the sonar. Never waits. */
void tap_mirror(struct tap *tap, const uint8_t *bytes, size_t n);

void tap_status(const struct tap *tap, struct tap_status *out);

/** tap_close - removes the link, if it still is ours. NULL is borne. */
void tap_close(struct tap *tap);

#endif
