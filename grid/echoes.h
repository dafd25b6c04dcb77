/* SPDX-License-Identifier: MIT */
/*
 * echoes - what the extract stage found in one ping: per beam where the first reflection is, how sure that is, and
 * how far the water before it is free. Made by grid/range, read by the maps.
 */
#ifndef SONARD_ECHOES_H
#define SONARD_ECHOES_H

#include <stdbool.h>
#include <stdint.h>

#include "geometry.h"

#define ECHOES_PER_BEAM 4

/* Shares of the way from a beam's axis to its edge (half power). The two-way pattern, exp(-2 ln 2 u^2) at the share u,
 * takes 0.4 dB at the first: as much as nothing. At the second it takes 3 dB, and 6 dB at the edge. */
#define BEAM_AXIS_SHARE 0.25
#define BEAM_SIDE_SHARE 0.7

/* What speaks against an echo; it is an echo all the same. docs/extract.md has the rules. */
enum echo_flag {
    ECHO_BURST =
        1, /* at least two beams at nearly the same bearing should show it and do not: interference, perhaps */
    ECHO_GHOST = 2,  /* where a second bounce of the beam's first echo would be */
    ECHO_FAINT = 4,  /* weaker than the weakest target that must be detected */
    ECHO_ALONE = 8,  /* one beam at nearly the same bearing should show it and does not, and none does */
    ECHO_OTHER = 16, /* arrived when another sonar's pulse was due */
    ECHO_OWN = 32,   /* the vehicle's own: it ends free space and never blocks */
};

/* An echo with one of these marks blocks only once a second beam has shown it. */
#define ECHO_UNCONFIRMED (ECHO_BURST | ECHO_FAINT | ECHO_ALONE | ECHO_OTHER)

struct echo {
    float range_m;    /* of the reflection, sub-bin */
    float near_m;     /* near edge of it: nothing that belongs to it lies closer */
    float sd_m;       /* standard deviation of range_m, a device's unknown half pulse included */
    float strength;   /* over the threshold, power ratio (1: just at it) */
    float level;      /* over what the weakest wall exceeds, power ratio; INFINITY: saturated; 0: ready ranges */
    float confidence; /* 0..1 */
    uint8_t flags;    /* set of enum echo_flag */
};

enum beam_state {
    BEAM_ECHO,   /* echo[0] is the first reflection */
    BEAM_SILENT, /* listened, nothing found; free_to_m says what that is worth */
    BEAM_BLIND,  /* no usable signal (saturated, no samples): says nothing about the water */
};

/* What hides water beside the free interval, apart from an echo or a weak signal. */
enum beam_hides {
    BEAM_HIDES_NOTHING,
    BEAM_HIDES_MASK,   /* the template of the vehicle's own echoes masks what follows ... */
    BEAM_HIDES_BEFORE, /* ... or what is right before it */
    BEAM_HIDES_RING,   /* the transducer rings longer or louder than usual: nothing is free at all */
    BEAM_HIDES_DEAF,   /* the ping does not show that its receiver hears: nothing is free at all */
};

struct beam_echoes {
    float az_rad, el_rad;           /* axis in the sensor frame */
    float blind_m;                  /* nothing is known nearer than this (ring-down) */
    float free_to_m;                /* water from blind_m to here is free; <= blind_m: no free interval */
    float heard_from_m, heard_to_m; /* echoes are detected between the two; from >= to: none are */
    /* Off its axis a beam hears less, so less is known to be free there: free_to_m at BEAM_SIDE_SHARE of the way to
     * its edge, at most as far, and blind_m and free_to_m at the edge, within blind_m and side_to_m; from >= to:
     * nothing. Within the latter two those of a surface that the edge grazes, which answers weakly and for long. */
    bool off_axis; /* it is known how far */
    float side_to_m, edge_from_m, edge_to_m, surface_from_m, surface_to_m;
    uint8_t state; /* enum beam_state */
    uint8_t n;     /* echoes, in order of range */
    uint8_t hides; /* enum beam_hides */
    struct echo echo[ECHOES_PER_BEAM];
};

/** beam_frees_nothing - it does not show that its receiver hears: its echoes stay, its silence says nothing. */
static inline void beam_frees_nothing(struct beam_echoes *beam)
{
    beam->state = beam->n > 0 ? BEAM_ECHO : BEAM_BLIND;
    beam->free_to_m = beam->heard_from_m = beam->heard_to_m = 0.0f;
    beam->off_axis = false;
    beam->hides = BEAM_HIDES_DEAF;
}

/** beam_ends_at - what stands there hides all behind it: nothing is free or heard farther than to_m. */
static inline void beam_ends_at(struct beam_echoes *beam, float to_m)
{
    float *const ends[] = {&beam->free_to_m, &beam->heard_to_m, &beam->side_to_m, &beam->edge_to_m,
                           &beam->surface_to_m};
    for (unsigned i = 0; i < sizeof ends / sizeof *ends; i++)
        *ends[i] = *ends[i] < to_m ? *ends[i] : to_m;
}

/* As struct ping: a fixed buffer of the pipeline's pool with room for max_beams. */
struct echoes {
    uint64_t t_ns, t_in_ns; /* of the ping */
    uint32_t seq;
    uint16_t sensor;
    uint16_t n_beams;
    uint8_t flags;       /* of the ping: set of enum ping_flag */
    bool turns;          /* it is from a head that turns, its driver says; a fan or a fixed beam does not */
    float range_max_m;   /* end of the last bin */
    float bin0_m, bin_m; /* near edge of bin 0, length of a bin; 0: the sonar reported ranges only */
    float az_aperture_rad, el_aperture_rad;
    struct pose pose;
    uint32_t max_beams;
    struct beam_echoes *beam; /* [n_beams], in order of elevation, then of azimuth from -pi to pi; no two alike */
};

#endif
