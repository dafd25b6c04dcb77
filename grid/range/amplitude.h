/* SPDX-License-Identifier: MIT */
/*
 * amplitude - from a sonar's counts to acoustic power. The theory of the detectors holds for power, and devices send
 * something else: pressure, a compressed pressure, decibels. Knows no detector and no ping.
 */
#ifndef SONARD_AMPLITUDE_H
#define SONARD_AMPLITUDE_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/ping.h"

#define AMPLITUDE_MAX_DB 120.0 /* of a full-scale count: keeps power below AMPLITUDE_LIMIT */
#define AMPLITUDE_LIMIT  ((uint64_t)1 << 48)

/* A prepared conversion. Power is in arbitrary units, an integer below AMPLITUDE_LIMIT;
 * it never falls with the count. */
struct amplitude {
    enum amplitude_law law;
    unsigned sample_bytes; /* 1 or 2 */
    uint32_t max_count;    /* 255 or 65535 */
    uint64_t table[256];   /* power of an 8-bit count */
    double fine[256];      /* 16-bit decibels: ratio of the low byte ... */
    double coarse[256];    /* ... and of the high byte, times the unit */
};

/**
 * amplitude_init - prepare counts of sample_bytes (1 or 2) under `law`.
 *
 * linear: v^2; power: v; sqrt: v^4 (16 bit: v^4 / 65536, rounded); log: amplitude_from_db(v * db_per_count).
 * db_per_count matters for log only: > 0, and full scale at most AMPLITUDE_MAX_DB.
 * False, *a untouched, when an argument is outside.
 */
bool amplitude_init(struct amplitude *a, enum amplitude_law law, unsigned sample_bytes, double db_per_count);

/** amplitude_from_db - 256 * 10^(db/10), rounded to the nearest integer; db in [-inf, AMPLITUDE_MAX_DB]. */
uint64_t amplitude_from_db(double db);

/** amplitude_of_word - power of one count of 16 bits. */
uint64_t amplitude_of_word(const struct amplitude *a, uint32_t count);

/** amplitude_of - power of one count; counts beyond full scale are taken as full scale. */
static inline uint64_t amplitude_of(const struct amplitude *a, uint32_t count)
{
    const uint32_t v = count < a->max_count ? count : a->max_count;
    return a->sample_bytes == 1 ? a->table[v] : amplitude_of_word(a, v);
}

/**
 * amplitude_sums - sum[n + 1]: sum[i] is the power of the first i of n <= 65536 samples (uint8_t or uint16_t in host
 * order, as initialised).
 */
void amplitude_sums(const struct amplitude *a, const void *samples, uint32_t n, uint64_t *sum);

#endif
