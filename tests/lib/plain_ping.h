/* SPDX-License-Identifier: MIT */
/* plain_ping.h - a ping of one beam and 100 equal samples, for tests of what becomes of pings, whatever they say. */
#ifndef SONARD_TEST_PLAIN_PING_H
#define SONARD_TEST_PLAIN_PING_H

#include <string.h>

#include "daemon/pipeline/pipeline.h"

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
