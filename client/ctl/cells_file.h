/* SPDX-License-Identifier: MIT */
/*
 * cells_file - the cells of a spherical grid as `grid_cells` sends them, as rows of CSV and as points. Knows no daemon
 * and no file's name.
 */
#ifndef SONARD_CELLS_FILE_H
#define SONARD_CELLS_FILE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "core/fault.h"

/** cells_csv_head - the names of the columns. ned: positions are north, east, down; else forward, right, down. */
void cells_csv_head(FILE *out, bool ned);

/** cells_csv_row - one cell of t_unix, a row; numbers as the daemon sent them, in the columns of the head. */
void cells_csv_row(FILE *out, const json_t *cell, double t_unix);

/** cells_capture - cells as one foxglove.PointCloud in an MCAP file: x east, y north, z up (frame "map"), or x forward,
 * y left, z up (frame "vehicle"). Owns fd, as point_cloud_capture. False with a sentence in fault. */
bool cells_capture(const json_t *cells, bool ned, double t_unix, int fd, struct fault *fault);

#endif
