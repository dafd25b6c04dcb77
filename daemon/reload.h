/* SPDX-License-Identifier: MIT */
/*
 * reload - reads the configuration anew while all goes on. All keys that a running daemon can change take effect, or,
 * where the new configuration has a fault, none; the others are named. Maps, poses, clients and sonars stay. The method
 * `reload` answers with what reload_now says, `reload_check` with what it would say.
 */
#ifndef SONARD_RELOAD_H
#define SONARD_RELOAD_H

#include <stdbool.h>

#include "config/conf.h"
#include "core/loop.h"
#include "daemon/input/pose_log.h"
#include "daemon/input/source.h"
#include "daemon/pipeline/pipeline.h"
#include "daemon/record/record.h"
#include "daemon/rpc/server.h"
#include "options.h"

/* What it reads, and where what it found takes effect; all of it outlives it. */
struct reload_env {
    const struct options *options;
    const char *conf_name;
    struct conf *conf; /* in force */
    struct loop *loop;
    struct pipeline *pipeline;
    struct pose_log *poses;
    struct source *const *source; /* of each sonar */
    struct server *server;        /* NULL: none */
    struct record *record;        /* is told what is in force; NULL: nothing is recorded */
    bool replay;
};

/** reload_now - do it, and write what has changed, as the method `reload` answers; false with a refusal in *error. */
bool reload_now(const struct reload_env *env, struct json_out *out, struct rpc_error *error);

/**
 * reload_check - what reload_now would say, and nothing changes. file: the absolute path, without links, of a file of
 * the configuration's folder, there or not, that holds `text` instead; NULL: the files as they are.
 */
bool reload_check(const struct reload_env *env, const char *file, const char *text, struct json_out *out,
                  struct rpc_error *error);

/**
 * reload_replay - what a reload put in force when a capture was made: `text`, n bytes, as record_conf was given. The
 * same keys take effect. False with the first fault: nothing changes.
 */
bool reload_replay(const struct reload_env *env, const char *text, size_t n, struct fault *fault);

/** reload_by_signal - do it, and say in the log and to the service manager what came of it. */
void reload_by_signal(const struct reload_env *env);

#endif
