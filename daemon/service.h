/* SPDX-License-Identifier: MIT */
/*
 * service - the daemon as its service manager sees it: when it is ready, in a sentence how it does, that it still
 * lives, that it stops. Without a manager nothing of it happens.
 */
#ifndef SONARD_SERVICE_H
#define SONARD_SERVICE_H

#include <stdbool.h>
#include <stddef.h>

#include "core/fault.h"
#include "core/loop.h"
#include "watchdog.h"

/* What it needs; all of it outlives it. */
struct service_env {
    struct loop *loop;
    struct pipeline *pipeline;
    int n_sonars;
    bool replay;
    const char *(*data_word)(const void *ctx); /* whether answers rest on living sonars */
    const void *ctx;
};

struct service {
    struct service_env env;
    struct loop_timer timer;
    const char *told; /* the daemon's state as the manager knows it */
    struct watchdog watchdog;
};

/** service_start - all is set up and questions are answered: say so, feed the watchdog from now on.
 * False with a sentence in fault. */
bool service_start(struct service *s, const struct service_env *env, struct fault *fault);

/**
 * service_stop - say that the end has started, unless the daemon comes back at once. Before the pipeline is freed; also
 * when it never started.
 */
void service_stop(struct service *s, bool comes_back);

#endif
