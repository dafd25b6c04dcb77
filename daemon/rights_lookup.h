/* SPDX-License-Identifier: MIT */
/*
 * rights_lookup - finds out who the names in [server] change are, in a thread of its own: the user database may be on
 * another machine, and the loop does not wait for it. One look at a time; what is asked for meanwhile comes after it.
 */
#ifndef SONARD_RIGHTS_LOOKUP_H
#define SONARD_RIGHTS_LOOKUP_H

#include <pthread.h>

#include "loop.h"
#include "rights.h"

#define RIGHTS_TEXT_MAX 512

/* Zeroed but for the first four. */
struct rights_lookup {
    struct loop *loop;
    gid_t socket_group;
    void (*done)(void *ctx, const struct rights *rights); /* from the loop */
    void *ctx;
    bool running, again; /* again: for `wanted`, when the one under way has ended */
    char wanted[RIGHTS_TEXT_MAX];
    struct loop_fd ended; /* an eventfd */
    pthread_t thread;
    char change[RIGHTS_TEXT_MAX]; /* of the thread while it runs, ... */
    struct rights found;          /* ... and what it found */
};

/** rights_lookup_begin - as rights_set; `done` is told later. False: no thread can be had (errno). */
bool rights_lookup_begin(struct rights_lookup *l, const char *change);

/** rights_lookup_end - waits for a look that is under way; `done` is not told of it. */
void rights_lookup_end(struct rights_lookup *l);

#endif
