/* SPDX-License-Identifier: MIT */
/*
 * witness - what the last beams said, one by one, so that an answer can name the pings it rests on. A ring: the oldest
 * is forgotten first. Knows no grid and no answer; one thread owns it. Pure.
 */
#ifndef SONARD_WITNESS_H
#define SONARD_WITNESS_H

#include <stddef.h>

#include "grid/echoes.h"

/* One beam of a ping. Vectors are of the world's axes (NED) where the ping had an attitude, else of the body's. */
struct witness {
    uint64_t t_ns;
    uint32_t seq;
    uint16_t sensor;
    uint8_t state; /* enum beam_state */
    bool ned;
    float axis[3], up[3];              /* unit; of the beam */
    float az_rad, el_rad;              /* of the axis, in the sensor frame */
    float half_az_rad, half_el_rad;    /* of its opening */
    float blind_m, free_to_m;          /* as in struct beam_echoes */
    float range_m, range_sd_m, near_m; /* first echo; 0 without */
    float confidence;                  /* of it */
    bool own;                          /* it is the vehicle's own */
    int32_t bin;                       /* it lies in, from 0; negative: the sonar reported no bins, or no echo */
};

struct witnesses {
    struct witness *beam; /* [n], a ring */
    uint32_t n;
    uint64_t taken; /* ever */
};

/** witness_bytes - memory for n beams. */
size_t witness_bytes(uint32_t n);

/** witness_init - nothing said yet. memory: witness_bytes(n), 8-byte aligned; n > 0. */
void witness_init(struct witnesses *w, void *memory, uint32_t n);

/** witness_take - every beam of a ping, received by a sensor that is mounted so. */
void witness_take(struct witnesses *w, const struct echoes *e, const struct mount *mount);

/**
 * witness_look - the k-th newest beam; NULL: so far back nobody remembers. witness_sees - does its opening touch the
 * cone of half_rad around a unit vector? To a good part of a degree: edges are where nobody hears well.
 */
const struct witness *witness_look(const struct witnesses *w, uint64_t k);
bool witness_sees(const struct witness *beam, const double axis[3], double half_rad);

#endif
