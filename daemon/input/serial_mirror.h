/* SPDX-License-Identifier: MIT */
/*
 * serial_mirror - a pseudo-terminal that says what a sonar says, so that a viewer or a logger can listen while sonard
 * owns the sonar. It is found by the configured symbolic link. Nothing that happens at the mirror reaches the sonar
 * or holds anybody up: what is written to it is thrown away,
 * what its reader does not take is thrown away, both are counted.
 *
 * There is one queue of bytes, as in any terminal: whoever opens it may read, one after the other; two at the same
 * time would share the bytes.
 */
#ifndef SONARD_SERIAL_MIRROR_H
#define SONARD_SERIAL_MIRROR_H

#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

/* Counters only grow. */
struct serial_mirror_status {
    uint64_t given;   /* bytes that a reader could take */
    uint64_t dropped; /* bytes for which an open mirror had no room */
    uint64_t refused; /* bytes that somebody wrote to it */
};

struct serial_mirror;

/**
 * serial_mirror_open - a raw pseudo-terminal behind the link `path`, for our user and group. The link is made in one
 * step; one that leads nowhere is replaced, anything else in its place is left alone. NULL with a sentence in fault.
 */
struct serial_mirror *serial_mirror_open(const char *path, struct fault *fault);

/** serial_mirror_write - n bytes came from the sonar. Never waits. */
void serial_mirror_write(struct serial_mirror *mirror, const uint8_t *bytes, size_t n);

void serial_mirror_status(const struct serial_mirror *mirror, struct serial_mirror_status *out);

/** serial_mirror_close - removes the link, if it still is ours. NULL is accepted. */
void serial_mirror_close(struct serial_mirror *mirror);

#endif
