/* SPDX-License-Identifier: MIT */
/*
 * environment - what the methods may ask and change: made by main, which alone has the rest of the process. All of it
 * belongs to the loop's thread; other threads have the pipeline's rings and pictures only.
 */
#ifndef SONARD_ENVIRONMENT_H
#define SONARD_ENVIRONMENT_H

#include <stdbool.h>
#include <stdint.h>

#include "config/conf.h"
#include "core/loop.h"
#include "daemon/background/template.h"
#include "daemon/background/template_keep.h"
#include "daemon/input/aux_sensors.h"
#include "daemon/input/pose_doubt.h"
#include "daemon/input/velocity_doubt.h"
#include "daemon/input/pose_log.h"
#include "daemon/input/push.h"
#include "daemon/input/source.h"
#include "daemon/map/map_service.h"
#include "daemon/map/saver.h"
#include "daemon/pipeline/pipeline.h"
#include "daemon/plan.h"
#include "daemon/record/record.h"
#include "daemon/reload.h"
#include "daemon/rpc/rpc.h"
#include "daemon/rpc/server.h"

struct replay;

struct methods_env {
    struct conf conf;
    struct plan plan;      /* of conf, as it was at the start */
    const char *conf_name; /* file, or capture whose attachment it was */
    struct loop *loop;
    struct pipeline *pipeline;
    struct source *source[CONF_MAX_SONARS];
    struct mount mount[CONF_MAX_SONARS];
    struct pose_log poses;
    struct push push;
    struct pose_doubt pose_doubt;
    struct velocity_doubt velocity_doubt;
    struct aux_sensors aux;
    struct templates templates;
    struct template_keep keep;
    struct map_service map_service;
    struct saver saver;
    struct record *record; /* NULL: not recording */
    int pose_channel;
    struct server *server; /* NULL: nobody may ask */
    struct reload_env reload;
    bool replay, replay_ended;
    uint64_t told;          /* in a replay: sonars of which the capture tells the state; the others' are running */
    struct replay *playing; /* NULL: live */
    uint64_t start_ns;
    uint64_t unix_offset_ns; /* Unix time = monotonic + this; 0 in a replay, whose clock is Unix time already */
};

/** daemon_methods - the table of JSON-RPC methods; ->daemon of a call is a struct methods_env. */
extern const struct rpc_method daemon_methods[];

#endif
