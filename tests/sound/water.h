/* SPDX-License-Identifier: MIT */
/*
 * water - the echo that a scanning head hears from a scene: one beam, one transmission, 8-bit samples. Simple
 * physics, the same every time for the same seed. Knows no protocol and no clock.
 *
 * Rays are spread over the beam (stratified, jittered by the seed) and weighted by its two-way Gaussian pattern. A
 * surface answers by a mean field near the perpendicular and by diffuse (Lambert) parts of random phase, whose sum
 * is Rayleigh speckle. Levels fall by spreading and absorption, the head's time-varied gain gives some back; noise,
 * volume reverberation, ring-down and one ghost per surface are added. A count is 255 times the square root of the
 * pressure: the compressed scale that the real Ping360 shows. A Micron says decibels: 80 over 255 counts, 0 where the
 * receiver ends.
 */
#ifndef SONARD_SOUND_WATER_H
#define SONARD_SOUND_WATER_H

#include <stdint.h>
#include <stdio.h>

#include "sound.h"
#include "tests/water/scene.h"

#define WATER_MAX_SAMPLES 1200

struct water {
    double sound_speed_mps;
    double noise_counts; /* mean of the noise floor at 1 m and normal gain; 0: none, and no reverberation */
    double ghost;        /* pressure of a ghost against its echo, 0..1 */
    uint64_t seed;
};

/* One transmission. The beam's axis is level. */
struct water_shot {
    enum sound_head head;
    double origin_m[3]; /* of the head, NED */
    double az_rad;      /* of the beam, clockwise from north */
    double t_s;         /* time of the scene */
    double sample_s, transmit_s, frequency_hz;
    int gain;           /* 0 low, 1 normal, 2 high: 6 dB apart */
    uint32_t n_samples; /* 1..WATER_MAX_SAMPLES */
    uint64_t number;    /* of the ping: chooses its random numbers, with the seed */
};

struct water_truth {
    double nearest_m; /* nearest surface inside the half-power aperture; infinite: none */
    double axis_m;    /* surface on the beam's axis; infinite: none */
};

/** water_listen - the samples of one transmission; samples[n_samples]. */
void water_listen(const struct water *water, const struct place *scene, const struct water_shot *shot,
                  uint8_t *samples);

/** water_look - what is really there, by a fine fan of rays. */
void water_look(const struct place *scene, const struct water_shot *shot, struct water_truth *truth);

/** water_write_truth - the same as a line of JSON; angle: as the head says it, azimuth_deg from the bow. */
void water_write_truth(FILE *out, const struct water *water, const struct place *scene,
                       const struct water_shot *shot, uint64_t t_ns, unsigned angle, double azimuth_deg,
                       double yaw_deg);

#endif
