/* SPDX-License-Identifier: MIT */
/*
 * sound - what all made-up sound has in common: decibels, the beam of a transducer, speckle as a pulse hears it, and
 * the counts that a device makes of it. Knows no place and no protocol.
 */
#ifndef SONARD_SOUND_H
#define SONARD_SOUND_H

#include <complex.h>
#include <math.h>
#include <stdint.h>

#include "grid/ping.h"
#include "tests/water/dice.h"

#define SOUND_MICRON_DB (80.0 / 255.0) /* of a count */

/* Whose transducer and scale it is. */
enum sound_head { SOUND_PING360, SOUND_MICRON, SOUND_HEADS };

struct sound_head_kind {
    const char *name;
    double az_deg, el_deg; /* full width at half power one way */
    enum amplitude_law law;
};

extern const struct sound_head_kind sound_heads[SOUND_HEADS];

/** sound_power - of decibels. */
static inline double sound_power(double db)
{
    return pow(10.0, db / 10.0);
}

/** sound_pattern - of a beam, two ways, so many half-power widths off its axis; 0.5: half power one way. */
static inline double sound_pattern(double az, double el)
{
    return exp2(-8.0 * (az * az + el * el));
}

/* A ray of a beam, in half-power widths off its axis, and its share of the beam's power. */
struct sound_ray {
    double az, el, weight;
};

enum sound_spread {
    SOUND_EVEN,
    SOUND_STAGGERED, /* every azimuth has elevations of its own: an oblique surface is no row of points */
    SOUND_JITTERED,  /* by the dice, which only this one needs */
};

/** sound_fan - n_az columns of n_el rays, to so many half-power widths off the axis: 1 is where the pattern is 24 dB
 * down. */
void sound_fan(enum sound_spread spread, double reach, int n_az, int n_el, struct dice *dice,
               struct sound_ray *ray);

/** sound_pulse - each of field[n] becomes the sum over the last `pulse` of them: noise of independent bins becomes as
 * correlated as a pulse leaves it. */
void sound_pulse(double complex *field, uint32_t n, uint32_t pulse);

/** sound_intensity - power of a field. */
static inline double sound_intensity(double complex field)
{
    return creal(field) * creal(field) + cimag(field) * cimag(field);
}

/** sound_texture - power of speckle that is the mean of so many looks, mean 1: gamma distributed. */
double sound_texture(struct dice *dice, int looks);

/** sound_count - what a law makes of a power, where 1 gives `one`; neither rounded nor limited. */
double sound_count(enum amplitude_law law, double power, double one, double db_per_count);

/** sound_byte - a count within 8 bits, the fraction cut off. */
static inline uint8_t sound_byte(double count)
{
    return (uint8_t)fmin(fmax(count, 0.0), 255.0);
}

#endif
