/* SPDX-License-Identifier: MIT */
/*
 * image - the last turn of a sensor as a picture for people: one row per head angle with the intensities (loudest of
 * each group of bins) and the echoes. Written by the thread that extracts, copied out by the loop.
 */
#ifndef SONARD_IMAGE_H
#define SONARD_IMAGE_H

#include <stdint.h>

#include "core/snapshot.h"
#include "grid/echoes.h"
#include "grid/ping.h"

#define IMAGE_ROWS 1024
#define IMAGE_BINS 512

struct image_row {
    uint64_t t_ns; /* 0: nothing yet */
    float az_rad;  /* in the sensor frame */
    float width_rad;
    float r0_m, r1_m;
    float echo_m[ECHOES_PER_BEAM];
    float confidence[ECHOES_PER_BEAM]; /* of each echo, 0..1 */
    float near_m;                      /* of the first echo */
    float blind_m;                     /* nothing is known nearer than this */
    uint16_t n_bins;
    uint8_t state;                  /* enum beam_state */
    uint8_t n_echoes;               /* in order of range */
    uint8_t flags[ECHOES_PER_BEAM]; /* sets of enum echo_flag */
    uint8_t bin[IMAGE_BINS];
};

struct image {
    SNAPSHOT_OF(struct image_row) row[IMAGE_ROWS];
};

/** image_enter - the beams of one ping. A turning head has a row per angle, a multibeam one per beam. */
void image_enter(struct image *image, const struct ping *ping, const struct echoes *echoes);

/** image_row - a consistent copy of a row, 0 <= index < IMAGE_ROWS. */
void image_row(struct image *image, uint32_t index, struct image_row *row);

#endif
