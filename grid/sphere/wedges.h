/* SPDX-License-Identifier: MIT */
/*
 * wedges - what beams found free, in the frame in which they observed it: each is a wedge of water with the place and
 * attitude of its sensor at the ping, and is never resampled. When the grid's centre moves or its axes turn, the free
 * intervals of all directions are made anew from the wedges, so that no number of steps adds up to a drift.
 *
 * A ping is one record. Neighbouring beams of a fan are one wedge as long as together they are no wider than a cell:
 * free where all of them are, part by part. Of pings that a fan sends from nearly the same place the newest is kept.
 * Room is fixed; the oldest ping goes first. Knows no cell and no direction of the grid.
 */
#ifndef SONARD_WEDGES_H
#define SONARD_WEDGES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "beam.h"

#define WEDGES_PINGS 2048
#define WEDGES_MAX   2048

enum wedge_kind {
    WEDGE_FREE,    /* from from_m to to_m */
    WEDGE_SPENT,   /* it was free, and is no more: the vehicle may have drifted so far. No ping leaves one */
    WEDGE_UNKNOWN, /* what was known of the water up to to_m is so no longer */
    WEDGE_DEAF,    /* the beam received nothing usable; after another such beam it is WEDGE_UNKNOWN */
};

struct wedge {
    float az_rad, el_rad; /* axis in the sensor frame */
    float half_az_rad;    /* the beam's own, or half of what several of them cover */
    struct beam_row row;
    float from_m, to_m; /* as in struct beam_water */
    float side_to_m, edge_from_m, edge_to_m;
    uint8_t kind; /* enum wedge_kind */
    bool nested, ends_at_echo;
};

struct wedge_ping {
    uint64_t t_ns;
    double path_m;      /* distance travelled by then */
    double drift_m[2];  /* of the vehicle by then: struct pose */
    double place_m[3];  /* of the sensor, NED */
    double attitude[4]; /* of the sensor frame, in NED */
    /* the sensor may have been so far from place_m: the wedges' sides count as so much farther in */
    float uncertain_m;
    float blur_m[3];     /* and by the blur of its pose, NED */
    float uncertain_rad; /* of its bearing: what it made free is so much less high above and below */
    float el_aperture_rad;
    uint32_t sensor;
    uint32_t first, n; /* its wedges: in the ring of all, from that number on */
};

struct wedges {
    struct wedge_ping *ping; /* [WEDGES_PINGS], a ring */
    struct wedge *wedge;     /* [WEDGES_MAX], a ring */
    uint32_t first, end;     /* numbers of the oldest ping and of the one to come; they only grow */
    uint32_t wedge_end;      /* number of the next wedge */
};

/** wedges_bytes - memory for wedges_init, which is 8-byte aligned. */
size_t wedges_bytes(void);
void wedges_init(struct wedges *w, void *memory);
void wedges_clear(struct wedges *w);

/**
 * wedges_begin - a ping whose wedges follow by wedges_add, and then wedges_end: only what stands before `first` counts.
 * A ping of a fan makes the one before it superfluous when it is less than half a second and apart_m from the one
 * before that; unless it lacks an echo that was there.
 */
void wedges_begin(struct wedges *w, const struct wedge_ping *ping);
void wedges_add(struct wedges *w, const struct wedge *wedge);
void wedges_end(struct wedges *w, double apart_m);

/** wedges_set_water, wedges_water - how far it is free. */
void wedges_set_water(struct wedge *wedge, const struct beam_water *water);
struct beam_water wedges_water(const struct wedge *wedge);

/* Number k of wedge `i` of a ping. */
static inline const struct wedge *wedges_of(const struct wedges *w, const struct wedge_ping *ping, uint32_t i)
{
    return &w->wedge[(ping->first + i) % WEDGES_MAX];
}

/** wedges_forget - pings from before t_ns go. */
void wedges_forget(struct wedges *w, uint64_t t_ns);

/** wedges_join - *a becomes the wedge of two neighbouring beams of a fan. False: they are not,
 * or wider than widest_rad. */
bool wedges_join(struct wedge *a, const struct wedge *b, double widest_rad);

#endif
