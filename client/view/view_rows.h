/* SPDX-License-Identifier: MIT */
/*
 * view_rows - the newest row of every direction of a sonar's image, each with the number of its last change: whoever
 * has all up to a number gets what changed since, however long that took, and never more than every row once. Pure.
 */
#ifndef SONARD_VIEW_ROWS_H
#define SONARD_VIEW_ROWS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define VIEW_ROWS_MAX   1024 /* as the daemon has them */
#define VIEW_ROW_BINS   512
#define VIEW_ROW_ECHOES 4
#define VIEW_ROWS_PART  32 /* rows of a message */
/* Of a message: its head with a sonar's name, and its rows. */
#define VIEW_ROWS_HEAD  (12 + 64)
#define VIEW_ROW_BYTES  (36 + 6 * VIEW_ROW_ECHOES + VIEW_ROW_BINS)
#define VIEW_ROWS_BYTES (VIEW_ROWS_HEAD + VIEW_ROWS_PART * VIEW_ROW_BYTES)

struct view_row {
    uint64_t changed;                                     /* 0: there is none */
    double t_unix;                                        /* of the ping */
    float az_deg, width_deg, r0_m, r1_m, blind_m, near_m; /* near_m NaN: no echo */
    uint8_t state;                                        /* 0 echo, 1 silent, 2 blind */
    uint8_t n_echoes;
    uint16_t n_bins;
    float echo_m[VIEW_ROW_ECHOES];
    uint8_t marks[VIEW_ROW_ECHOES];      /* 1 burst, 2 ghost, 4 anything else */
    uint8_t confidence[VIEW_ROW_ECHOES]; /* per cent */
    uint8_t bin[VIEW_ROW_BINS];
};

struct view_rows {
    char sensor[64];
    uint64_t change; /* number of the last one; goes on when all are forgotten */
    double t_unix;   /* of the last answer */
    struct view_row row[VIEW_ROWS_MAX];
};

/** view_rows_forget - all of it, as when the daemon is another one. */
void view_rows_forget(struct view_rows *rows);

/** view_rows_take - the result of the method image, whole or in part. What is no row of one is left out. */
void view_rows_take(struct view_rows *rows, const json_t *image);

/**
 * view_rows_part - write up to VIEW_ROWS_PART rows that changed after *seen, oldest change first, into out
 * (VIEW_ROWS_BYTES) and move *seen; the number of bytes, 0: nothing changed. Little-endian: u8 1, u8 bytes of the name,
 * u16 rows, f64 Unix time of the last answer, the name; for each row f64 Unix time, f32 azimuth, width (degrees), first
 * and last range, blind range, near edge (metres, NaN: no echo), u8 state, u8 echoes, u16 bins, per echo f32 range, u8
 * marks and u8 confidence (per cent), and the bins.
 */
size_t view_rows_part(const struct view_rows *rows, uint64_t *seen, uint8_t *out);

#endif
