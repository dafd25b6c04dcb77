/* SPDX-License-Identifier: MIT */
/*
 * ping - what a sonar says of one transmission. Made by a device, read by the extract stage; nobody else.
 *
 * A ping lives in a fixed buffer of the pipeline's pool. It holds n_beams beams that were received at the same time; a
 * scanning head has one, a multibeam up to PING_MAX_BEAMS. Either each beam has n_bins intensities (a profile), or
 * the sonar has picked the ranges itself, or both.
 */
#ifndef SONARD_PING_H
#define SONARD_PING_H

#include <stddef.h>
#include <stdint.h>

#include "geometry.h"

#define PING_MAX_BEAMS 512
#define PING_MAX_BINS  8192

/* What the intensity counts stand for. A detector that ignores it fails on real water. */
enum amplitude_law {
    AMPLITUDE_LINEAR, /* counts proportional to sound pressure */
    AMPLITUDE_POWER,  /* counts proportional to power */
    AMPLITUDE_SQRT,   /* counts proportional to the square root of pressure: a compressed display scale */
    AMPLITUDE_LOG,    /* db_per_count decibels per count */
};

enum ping_kind {
    PING_PROFILE, /* intensities; several beams: in order of elevation and azimuth, the same ones in every ping */
    /* Ready ranges in beam[].range_m, in any order. Several of one beam: entries with the same direction (the very same
     * az_rad and el_rad). */
    PING_RANGES,
    /* Both, one range a beam: what the device has chosen in intensities whose scale is that of this ping alone. It is
     * judged by them, and never without: see grid/range/choice.h. */
    PING_CHOICE,
};

enum ping_flag {
    PING_UNHEARD = 2,  /* the sonar reports no decision: no echo, and no free interval */
    PING_NEW_TURN = 1, /* first ping of a new sweep or full circle */
};

struct ping_beam {
    float az_rad, el_rad; /* axis of the beam in the sensor frame */
    float range_m;        /* but for PING_PROFILE: the device's own pick; 0: no echo */
    float range_sd_m;
    float confidence; /* 0..1 */
};

struct ping {
    uint64_t t_ns;        /* monotonic time of transmission on the host's clock */
    uint64_t t_in_ns;     /* when its last byte came in: latency is counted from here */
    uint32_t seq;         /* counts the sensor's pings from 1 */
    uint16_t sensor;      /* index of the sensor in the configuration */
    uint8_t kind;         /* enum ping_kind */
    uint8_t law;          /* enum amplitude_law */
    uint8_t sample_bytes; /* 1 or 2 (host byte order) per intensity */
    uint8_t flags;        /* set of enum ping_flag */
    uint16_t n_beams;     /* 1..PING_MAX_BEAMS */
    uint8_t gain;         /* the device's own setting of it, if it says one; else 0 */
    uint32_t n_bins;      /* 0..PING_MAX_BINS; bin i covers r0 + i*dr .. r0 + (i+1)*dr */
    float db_per_count;   /* AMPLITUDE_LOG only */
    float gain_db;        /* of the receiver, against the device's normal setting */
    float r0_m, dr_m;     /* near edge of bin 0, where listening begins; length of a bin */
    float pulse_m;        /* c * transmit duration / 2: what cannot be resolved */
    float deaf_m;         /* nearer nothing is heard, whatever the bins hold: the receiver is locked out, or the
                           * transducer of a PING_CHOICE may still ring; 0: not known, or it hears */
    float az_aperture_rad, el_aperture_rad; /* full width of one beam, half power */
    uint32_t head_units;                    /* head angle in units of the head ... */
    uint32_t head_turn;                     /* ... of which this many make a turn; 0: the head does not turn */
    struct pose pose;                       /* of the body at t_ns; set by the pipeline */
    uint32_t max_beams, max_samples;        /* room in the two arrays below; set once by the pool */
    struct ping_beam *beam;                 /* [n_beams] */
    void *samples;                          /* [n_beams][n_bins] of sample_bytes */
};

/** ping_bytes - bytes of intensities that the ping holds. */
static inline size_t ping_bytes(const struct ping *p)
{
    return (size_t)p->n_beams * p->n_bins * p->sample_bytes;
}

#endif
