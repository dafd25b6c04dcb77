/* SPDX-License-Identifier: MIT */
/* bench_swath.h - a multibeam of 512 beams x 1000 bins that pings 40 times a second: its stages, and its pings. */
#ifndef SONARD_BENCH_SWATH_H
#define SONARD_BENCH_SWATH_H

#include <stdio.h>
#include <string.h>

#include "config/conf.h"
#include "core/loop.h"
#include "daemon/wiring.h"

#define BEAMS     512
#define BINS      1000
#define RATE_HZ   40
#define SWATH_DEG 120.0
#define RANGE_M   20.0

static inline double swath_deg(int beam)
{
    return SWATH_DEG * (beam + 0.5) / BEAMS - SWATH_DEG / 2;
}

/* One such sonar, the rest as it is by default. */
static inline void swath_conf(struct conf *conf, int threads)
{
    conf_defaults(conf);
    conf->n_sonars = 1;
    snprintf(conf->sonar[0].device, sizeof conf->sonar[0].device, "surveyor");
    snprintf(conf->sonar[0].name, sizeof conf->sonar[0].name, "fan");
    conf->sonar[0].range_m = RANGE_M;
    conf->pipeline.threads = threads;
}

/* With room for its pings. */
static inline void swath_pipeline(const struct conf *conf, struct plan *plan, struct pipeline_conf *out)
{
    plan_make(conf, plan);
    wiring_pipeline(conf, plan, false, out);
    out->max_beams = BEAMS;
    out->max_bins = BINS;
    out->max_samples = BEAMS * BINS;
}

/* Ping `number` (from 1), as of now. Its pose is the caller's to tell. */
static inline void swath_ping(struct ping *p, uint32_t number, uint8_t samples[BEAMS][BINS])
{
    p->t_ns = p->t_in_ns = loop_clock();
    p->seq = number;
    p->kind = PING_PROFILE;
    p->law = AMPLITUDE_LINEAR;
    p->sample_bytes = 1;
    p->n_beams = BEAMS;
    p->n_bins = BINS;
    p->dr_m = (float)(RANGE_M / BINS);
    p->pulse_m = 0.05f;
    p->az_aperture_rad = p->el_aperture_rad = (float)geo_rad(1.0);
    for (int b = 0; b < BEAMS; b++)
        p->beam[b] = (struct ping_beam){.az_rad = (float)geo_wrap(geo_rad(swath_deg(b)))};
    memcpy(p->samples, samples, (size_t)BEAMS * BINS);
}

#endif
