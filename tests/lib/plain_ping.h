/* SPDX-License-Identifier: MIT */
/* plain_ping.h - a small pipeline, and pings of one beam and 100 equal samples for it: for tests of what becomes of
 * pings, whatever they say. */
#ifndef SONARD_TEST_PLAIN_PING_H
#define SONARD_TEST_PLAIN_PING_H

#include <string.h>

#include "daemon/pipeline/pipeline.h"

/* Of a coarse grid and one sonar at the vehicle's middle; what else there is in it is the test's. */
static inline struct pipeline_conf plain_pipeline(int threads)
{
    struct pipeline_conf c = {
        .threads = threads,
        .queue = 4,
        .max_beams = 1,
        .max_samples = 100,
        .max_bins = 100,
        .n_sensors = 1,
        .mount = {mount_identity},
        .grid.sphere = {.angular_step_rad = geo_rad(10),
                        .layers = {.r_max_m = 30, .dr_m = 0.5, .n_const = 29, .growth = 1.035},
                        .max_cells = 1000,
                        .forget_s = 160,
                        .blocked_above = 0.6,
                        .recentre_m = 0.1}};
    extract_defaults(&c.extract[0]);
    return c;
}

/* The next one, 20 ms after the last; to be submitted. The pipeline has room for one beam, 100 samples and 100 bins. */
static inline struct ping *plain_ping(struct pipeline *pipeline)
{
    static uint32_t seq;
    struct ping *ping = pipeline_begin(pipeline);
    memset(ping->samples, 9, 100);
    ping->seq = ++seq;
    ping->t_ns = ping->t_in_ns = seq * 20000000ull;
    ping->sample_bytes = 1;
    ping->n_beams = 1;
    ping->n_bins = 100;
    ping->dr_m = 0.1f;
    ping->pulse_m = 0.03f;
    ping->az_aperture_rad = ping->el_aperture_rad = 0.1f;
    ping->beam[0] = (struct ping_beam){.az_rad = 0};
    return ping;
}

#endif
