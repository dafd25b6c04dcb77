/* SPDX-License-Identifier: MIT */
/*
 * background - the template of what a sonar always hears of its own vehicle: frame, tether, electronics. A template
 * has one row of 8-bit counts per head angle (or per beam of a fan) and marks the cells in which it is so loud that
 * nothing else can be detected there. Knows no file and no detector; background_learn.h makes templates.
 *
 * Method: background subtraction of Oliveira, Ferreira and Cruz 2023, section III A; the masking is ours.
 */
#ifndef SONARD_BACKGROUND_H
#define SONARD_BACKGROUND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/ping.h"

#define BACKGROUND_ROWS_MAX   512 /* >= PING_MAX_BEAMS */
#define BACKGROUND_ROWS_FINE  400 /* of a head that counts in finer units than the rows there may be */
#define BACKGROUND_LEARNT_MAX 64

/* What a template is of. */
struct background_shape {
    uint32_t head_turn;  /* units of the head in a turn; 0: it does not turn, rows are its beams */
    uint32_t rows, bins; /* 1..BACKGROUND_ROWS_MAX, 1..PING_MAX_BINS */
    float r0_m, dr_m;    /* as in struct ping */
    float az0_rad;       /* of row 0's first angle, in the sensor frame; for pictures */
    float row_rad;       /* from one row to the next; 0: a single beam */
    float db_per_count;
    uint8_t law; /* enum amplitude_law */
};

struct background {
    struct background_shape shape;
    uint8_t mask_above; /* louder cells are blind */
    uint8_t *learnt;    /* [rows] pings behind the row, at most BACKGROUND_LEARNT_MAX; 0: nothing known */
    uint8_t *level;     /* [rows][bins]; 0 where nothing is known */
};

/* A template as a ping needs it: arrays of [n_beams][n_bins] of the ping. */
struct background_view {
    uint8_t *level, *blind;
};

enum background_fit {
    BACKGROUND_FITS,      /* same head, same bins */
    BACKGROUND_RESAMPLED, /* same head, other range or bins: each bin takes the loudest of those it covers */
    BACKGROUND_FOREIGN,   /* another head, other counts, or no profile: nothing is known of this ping */
};

/** background_shape_of - the shape of a template of such pings; false for pings that can have none. */
bool background_shape_of(const struct ping *ping, struct background_shape *shape);

/** background_shape_good - is it one that background_shape_of could have made? For shapes from outside. */
bool background_shape_good(const struct background_shape *shape);

/** background_size - bytes of a template with its arrays. */
size_t background_size(const struct background_shape *shape);

/** background_init - an empty template in mem (background_size bytes, aligned to max_align_t). */
struct background *background_init(void *mem, const struct background_shape *shape, uint8_t mask_above);

/** background_row - the row of a beam of a ping that fits or can be resampled. */
uint32_t background_row(const struct background_shape *shape, const struct ping *ping, uint16_t beam);

/** background_fit - can this template say something of this ping? */
enum background_fit background_fit(const struct background_shape *shape, const struct ping *ping);

/**
 * background_view - fill *view, whose arrays have room for the ping's cells: the template's counts, and 1 in `blind`
 * where they exceed mask_above or within a pulse's length of it: an echo so close to the vehicle's own cannot be told
 * from it. Beyond the template's range, and in rows it has not learnt, both are 0: there what
 * the vehicle itself reflects is taken for an obstacle, which is the safe mistake. False, nothing written, when the
 * template is foreign to the ping or no cell is known. *any_blind: at least one cell is. O(cells), allocates nothing.
 */
bool background_view(const struct background *background, const struct ping *ping,
                     const struct background_view *view, bool *any_blind);

/** background_mask - blind[i] = level[i] > mask_above; returns whether any is. */
bool background_mask(const uint8_t *level, size_t n, uint8_t mask_above, uint8_t *blind);

/** background_counts - n samples of the ping from `first` on as 8-bit counts: of 16 bits the upper ones. */
void background_counts(const struct ping *ping, size_t first, size_t n, uint8_t *out);

#endif
