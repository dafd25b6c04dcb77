/* SPDX-License-Identifier: MIT */
/*
 * point_cloud - points as a foxglove.PointCloud message, in JSON, and as a capture that holds this one message. Knows
 * what a field is called and how many bytes it has, not what it means.
 */
#ifndef SONARD_POINT_CLOUD_H
#define SONARD_POINT_CLOUD_H

#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

/* As the message numbers them. */
enum point_type { POINT_UINT8 = 1, POINT_UINT16 = 3, POINT_UINT32 = 5, POINT_FLOAT32 = 7, POINT_FLOAT64 = 8 };

struct point_field {
    const char *name; /* NULL ends the list */
    enum point_type type;
};

struct point_cloud {
    uint64_t t_unix_ns;
    const char *frame_id;             /* without characters that JSON escapes, as the names */
    const struct point_field *fields; /* one after the other, without gaps */
    const uint8_t *points;            /* little-endian; `bytes` are a multiple of point_bytes(fields) */
    size_t bytes;
};

/** point_bytes - of one point. */
size_t point_bytes(const struct point_field *fields);

/** point_put_* - a value, little-endian on every machine; returns the place behind it. */
uint8_t *point_put(uint8_t *at, uint64_t bits, int n);
uint8_t *point_put_double(uint8_t *at, double v);
uint8_t *point_put_float(uint8_t *at, double v);

/** point_cloud_message - malloced bytes, *size of them; NULL with a sentence in fault: no memory. */
uint8_t *point_cloud_message(const struct point_cloud *cloud, size_t *size, struct fault *fault);

/**
 * point_cloud_capture - writes that message into an MCAP file, compressed, with its schema, as the only one of
 * `topic`. Owns fd from here on, an empty file open for writing, also when it fails. False with a sentence in fault;
 * a message beyond MCAP_CHUNK_LIMIT is refused.
 */
bool point_cloud_capture(const struct point_cloud *cloud, const char *topic, const char *library, int fd,
                         struct fault *fault);

#endif
