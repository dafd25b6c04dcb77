/* SPDX-License-Identifier: MIT */
/*
 * image - the last turn of a sensor as a picture for people: one row per head angle with the intensities (loudest of
 * each group of bins) and the echoes, and apart from it what hides water beside its free interval. Written by the
 * thread that extracts, copied out by the loop.
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

/* What hides water beside a beam's free interval: the vehicle's own echo or its template behind, that before, or the
 * ring-down all of it. */
enum image_hides {
    IMAGE_HIDES_NOTHING,
    IMAGE_HIDES_OWN,
    IMAGE_HIDES_MASK,
    IMAGE_HIDES_BEFORE,
    IMAGE_HIDES_RING,
    IMAGE_HIDES_DEAF,
};

/* That, and where. */
struct image_end {
    float attitude[4];              /* of the body in NED, with the ping; `ned` false: it had none */
    float az_rad, el_rad;           /* in the sensor frame */
    float half_az_rad, half_el_rad; /* of its opening */
    float at_m;                     /* where that begins, or ends if it is before; 0: there is no free interval */
    uint16_t ned;                   /* a flag */
    uint16_t hides;                 /* enum image_hides */
};

struct image {
    SNAPSHOT_OF(struct image_end) end[IMAGE_ROWS];
    SNAPSHOT_OF(struct image_row) row[IMAGE_ROWS];
};

/** image_enter - the beams of one ping. A turning head has a row per angle, a multibeam one per beam. */
void image_enter(struct image *image, const struct ping *ping, const struct echoes *echoes);

/** image_end - a consistent copy of what hides water in a row, 0 <= index < IMAGE_ROWS. */
void image_end(struct image *image, uint32_t index, struct image_end *end);

/** image_row - a consistent copy of a row, 0 <= index < IMAGE_ROWS. */
void image_row(struct image *image, uint32_t index, struct image_row *row);

#endif
