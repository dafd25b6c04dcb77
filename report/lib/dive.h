/* SPDX-License-Identifier: MIT */
/*
 * dive - a turning head that is carried through a world: where it looks from, what is really there, and what it hears
 * of it: surfaces through the whole beam, second bounces, reverberation, noise, bursts, ring-down, the vehicle's own
 * frame. The head is sea.h's Micron-like one, 3 x 35 degrees, 10 m, turning level. The same pings for the same numbers.
 */
#ifndef SONARD_REPORT_DIVE_H
#define SONARD_REPORT_DIVE_H

#include <stdbool.h>
#include <stddef.h>

#include "grid/echoes.h"
#include "tests/sound/sea.h"
#include "tests/water/places.h"

#define DIVE_TURN    200  /* pings */
#define DIVE_RATE_HZ 25.0 /* of pings */
#define DIVE_RANGE_M 10.0
#define DIVE_AZ_DEG  3.0
#define DIVE_EL_DEG  35.0

struct dive_look {
    double t_s;
    double at[3]; /* from the world's origin */
    double attitude[4];
    double axis[3][3]; /* the attitude's x, y, z */
    double first_m;    /* the truth: the first surface within the half-power aperture; DIVE_RANGE_M: none */
};

enum dive_part { DIVE_TRUTH = 1, DIVE_SOUND = 2 };

struct dive {
    const struct place *world;
    size_t n;
    struct dive_look *look;      /* [n] */
    float (*mean)[SEA_MAX_BINS]; /* [n] power of surfaces by bin; NULL without DIVE_SOUND */
};

/** dive_make - along the world's way in `turns` turns, and back in as many when `back`; roll and pitch sway by
 * tilt_rad. Of parts (set of enum dive_part) only those asked for are made. Of the heap. */
struct dive *dive_make(const struct place *world, unsigned turns, bool back, double tilt_rad, unsigned parts);
void dive_free(struct dive *dive);

struct dive_ears;

/** dive_ears_make - range extraction as shipped, with the head's ring-down and a template of the vehicle learnt in open
 * water. open_water: that is promised, as by that key of [background]. Of the heap. */
struct dive_ears *dive_ears_make(bool open_water);

/** dive_ears_over_mud - the same, promised, with `bottom` of [extract] in place of what ships. */
struct dive_ears *dive_ears_over_mud(double bottom_db);

/** dive_ears_of_paper - the same, promised, with the image clean-up and the order of Oliveira, Ferreira and Cruz 2023.
 * gain_db: by so much the receiver's gain has raised the noise at the end of the range, evenly with the logarithm of
 * range from 1 m on. */
struct dive_ears *dive_ears_of_paper(double gain_db);
void dive_ears_free(struct dive_ears *ears);

/** dive_begin - forgets earlier pings; dive_hear goes on with ping 0 and leaves none out. */
void dive_begin(struct dive_ears *ears);

/** dive_hear - what is extracted from ping i of a dive with sound; seeds differ in noise. The clean-up
 * holds the last pings of a dive back for ever: their beams are BEAM_BLIND. */
void dive_hear(struct dive_ears *ears, const struct dive *dive, size_t i, uint64_t seed, struct beam_echoes *out);

#endif
