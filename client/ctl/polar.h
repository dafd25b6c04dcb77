/* SPDX-License-Identifier: MIT */
/*
 * polar - the beams of an `image` result on a polar grid of few grey levels, as a picture needs them. Knows nothing of
 * SVG. What is missing or of the wrong kind is left out, numbers beyond any sonar are ignored.
 */
#ifndef SONARD_POLAR_H
#define SONARD_POLAR_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define POLAR_CELLS       256 /* along the range */
#define POLAR_LEVELS      20  /* grey levels; 0 is the background */
#define POLAR_RANGE_MAX_M 10000.0

struct polar_beam {
    double az_deg, lo_deg, hi_deg; /* centre [0, 360), and the edges it is drawn with */
    double width_deg, r0_m, r1_m;
    double echo_m;       /* NAN: none */
    bool echo_marked;    /* something speaks against it */
    const char *samples; /* in the image; two hexadecimal digits each */
    size_t n_samples;
    uint8_t cell[POLAR_CELLS]; /* levels; cell c covers c..c+1 times range_m / POLAR_CELLS */
};

struct polar {
    double range_m;
    struct polar_beam *beam; /* [n_beams], by azimuth */
    size_t n_beams;
    int white; /* counts of the highest level */
};

/**
 * polar_read - from `image` (NULL: no beams), which must outlive *polar. range_m <= 0: the longest range of the image,
 * else of what the sectors (NULL: none) say is free. False without memory.
 */
bool polar_read(struct polar *polar, const json_t *image, const json_t *sectors, double range_m);

void polar_free(struct polar *polar);

/** polar_run_end - the first cell after c whose level differs from cell c's, or POLAR_CELLS. */
int polar_run_end(const struct polar_beam *beam, int c);

/** polar_number - a member's number when it is one in [lo, hi]; else false and *out as it was. */
bool polar_number(const json_t *object, const char *key, double lo, double hi, double *out);

/** polar_text - a member's text, `absent` when it is none. */
const char *polar_text(const json_t *object, const char *key, const char *absent);

#endif
