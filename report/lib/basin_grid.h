/* SPDX-License-Identifier: MIT */
/* basin_grid - the spherical grid as shipped, with layers out to the walls of a basin, in memory of its own. */
#ifndef SONARD_REPORT_BASIN_GRID_H
#define SONARD_REPORT_BASIN_GRID_H

#include <stdio.h>
#include <stdlib.h>

#include "core/fault.h"
#include "grid/sphere/sphere.h"

static const struct sphere_conf basin_grid_shipped = {
    .angular_step_rad = 2 * GEO_PI / 180,
    .layers = {.r_max_m = 12, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
    .max_cells = 65536,
    .forget_s = 160,
    .blocked_above = 0.6,
    .recentre_m = 0.1,
    .range_error = 0.003};

/* A new one, to be given to free(); ends the program with a sentence where there cannot be any. */
static inline struct sphere *basin_grid(const struct sphere_conf *conf)
{
    struct fault fault = {"no memory"};
    const size_t bytes = sphere_bytes(conf, &fault);
    void *memory = bytes ? aligned_alloc(64, (bytes + 63) / 64 * 64) : NULL;

    if (!memory) {
        fprintf(stderr, "no grid for the basin: %s\n", fault.text);
        exit(1);
    }
    return sphere_init(memory, conf);
}

#endif
