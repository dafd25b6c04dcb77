/* SPDX-License-Identifier: MIT */
/*
 * service - the daemon as its service manager sees it: when it is ready, in a sentence how it does, that it still
 * lives, that it stops. Without a manager nothing of it happens.
 */
#ifndef SONARD_SERVICE_H
#define SONARD_SERVICE_H

#include <stdbool.h>
#include <stddef.h>

#include "loop.h"
#include "watchdog.h"

struct daemon;

struct service {
    struct loop_timer timer;
    const char *told; /* the daemon's state as the manager knows it */
    struct watchdog watchdog;
};

/** service_start - all is set up and questions are answered: say so, feed the watchdog from now on. False with a sentence in err. */
bool service_start(struct daemon *d, char *err, size_t err_size);

/** service_stop - say that the end has begun. Before the pipeline is freed; also when it never started. */
void service_stop(struct daemon *d);

#endif
