/* SPDX-License-Identifier: MIT */
/* basin_grid - the spherical grid as shipped, with layers out to the walls of a basin, in memory of its own. */
#ifndef SONARD_REPORT_BASIN_GRID_H
#define SONARD_REPORT_BASIN_GRID_H

#include <stdio.h>
#include <stdlib.h>

#include "core/fault.h"
#include "daemon/wiring.h"
#include "grid/sphere/sphere.h"
#include "knob.h"

#define BASIN_GRID_REACH_M 12.0

/* As a configuration has its plain grid; NULL: as shipped. */
static inline struct sphere_conf basin_grid_conf(const struct knob *knob)
{
    struct conf conf;
    struct grid_setting setting;
    knob_conf(knob, &conf);
    wiring_grid(&conf, &conf.grid, &setting);
    setting.sphere.layers.r_max_m = BASIN_GRID_REACH_M;
    return setting.sphere;
}

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
