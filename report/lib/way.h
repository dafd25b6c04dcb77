/* SPDX-License-Identifier: MIT */
/*
 * way - a vehicle that moves through a made-up harbour or basin, recorded once: the pings of a Ping360, poses with the
 * errors of instruments, and what is true of every sector when it is asked for. Any configuration is then run over the
 * same recording, through the daemon's own pipeline, pose log and answers. Two rods of the vehicle's frame are in the
 * beams; its template is learnt at the start, beside whatever stands there.
 */
#ifndef SONARD_REPORT_WAY_H
#define SONARD_REPORT_WAY_H

#include "config/conf.h"
#include "grid/ping.h"
#include "tests/pilot/run.h"

#define WAY_SECTORS 72
#define WAY_BINS    600
#define WAY_PINGS   800
#define WAY_POSES   600
#define WAY_ASKS    2
#define WAY_POINTS  3000
#define WAY_LOOK_M  5.0 /* sectors are asked for so far */

struct way_ping {
    struct ping ping; /* without room of its own */
    struct ping_beam beam;
    uint8_t samples[WAY_BINS];
};

struct way {
    struct place world;
    struct way_ping ping[WAY_PINGS];
    struct pose pose[WAY_POSES];
    unsigned pings, poses, learnt; /* the template is learnt from the first pings, which do nothing else */
    struct {
        uint64_t t_ns;
        double wall_m[WAY_SECTORS]; /* nearest surface within 5 degrees of level; from the vehicle, ahead first */
    } ask[WAY_ASKS];
    unsigned asks;
    double point_m[WAY_POINTS][3]; /* about the way, for the map */
};

/* What a configuration makes of it. */
struct way_tally {
    unsigned in_way, past;               /* sectors with a surface in the way; free water claimed past it */
    unsigned open, false_block, unknown; /* sectors without; called blocked; not known */
    double free_m, said_m;               /* metres that are free; said to be */
    unsigned asked_limits, too_fast;     /* `limit`; speeds that do not stop before what is there */
    double limit_mps;                    /* sum of the speeds */
    unsigned map_solid, map_false, map_open, map_said; /* points in solids, called free; in water, called free */
    unsigned pings;
    double ns; /* that they took, of the processor */
};

/** way_record - the way of a seed: harbours and basins in turn. So long, in pings of 70 ms. */
void way_record(struct way *way, unsigned seed, unsigned pings);

/** way_run - adds to *tally what a configuration makes of it. learn: with a template. */
void way_run(const struct way *way, const struct conf *conf, bool learn, struct way_tally *tally);

/** way_enter - one ping into the pipeline: this is what callgrind counts. */
struct pipeline;
void way_enter(struct pipeline *pipeline, const struct way_ping *heard, const struct pose *pose);

#endif
