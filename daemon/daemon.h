/* SPDX-License-Identifier: MIT */
/*
 * daemon - what the parts of the process share: made by main, lives until it ends. All of it belongs to the loop's
 * thread; other threads have the pipeline's rings and pictures only.
 */
#ifndef SONARD_DAEMON_H
#define SONARD_DAEMON_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "../config/conf.h"
#include "../grid/answer/answer.h"
#include "depth.h"
#include "leak.h"
#include "loop.h"
#include "nmea.h"
#include "options.h"
#include "pipeline.h"
#include "pager.h"
#include "places.h"
#include "plan.h"
#include "pose_input.h"
#include "pose_log.h"
#include "power.h"
#include "record.h"
#include "rpc.h"
#include "server.h"
#include "service.h"
#include "source.h"
#include "template.h"
#include "template_keep.h"
#include "trigger.h"

struct daemon {
    struct conf conf;
    struct plan plan; /* of conf, as it was at the start */
    const struct options *options;
    const char *conf_name; /* file, or capture whose attachment it was */
    struct loop *loop;
    struct pipeline *pipeline;
    size_t grid_bytes_aside; /* of grids that are being made, or are dropped and not freed yet */
    struct source *source[CONF_MAX_SONARS];
    struct mount mount[CONF_MAX_SONARS];
    struct pose_log poses;
    struct pose_input pose_input;
    struct depth *depth; /* NULL: none */
    struct nmea *nmea;   /* NULL: none */
    struct template template[CONF_MAX_SONARS];
    struct template_keep keep;
    struct places places;
    struct pager pager;
    struct leak leak;
    struct power power[CONF_MAX_SONARS];
    struct trigger trigger[CONF_MAX_SONARS];
    int trigger_channel[CONF_MAX_SONARS];
    struct record *record; /* NULL: not recording */
    int pose_channel;
    struct server *server; /* NULL: nobody may ask */
    struct service service;
    struct loop_fd signals;
    struct loop_fd errands;
    bool replay, replay_ended;
    uint64_t start_ns;
    uint64_t unix_offset_ns; /* Unix time = monotonic + this; 0 in a replay, whose clock is Unix time already */
    uint64_t turns;
    FILE *answers; /* --answers: the sectors after every turn */
};

/** daemon_methods - the table of JSON-RPC methods; ->daemon of a call is a struct daemon. */
extern const struct rpc_method daemon_methods[];

/** daemon_take_pose - what the `pose` method and a capture's /pose messages do; false with *error set. */
bool daemon_take_pose(struct daemon *d, json_t *params, struct rpc_error *error);

/** daemon_write_answers - append the sectors as of now to d->answers, as one JSON line, with --bands as one for
 * each grid and band of elevations; `event` says why. */
void daemon_write_answers(struct daemon *d, const char *event, const char *sensor);

#endif
