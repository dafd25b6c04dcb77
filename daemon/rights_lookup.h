/* SPDX-License-Identifier: MIT */
/*
 * rights_lookup - finds out who the names in [server] change are, in a thread of its own: the user database may be on
 * another machine, and the loop does not wait for it. One look at a time; what is asked for meanwhile comes after it.
 */
#ifndef SONARD_RIGHTS_LOOKUP_H
#define SONARD_RIGHTS_LOOKUP_H

#include "loop.h"
#include "rights.h"

#define RIGHTS_TEXT_MAX 512

struct rights_look;

/* Zeroed but for the first four. */
struct rights_lookup {
    struct loop *loop;
    gid_t socket_group;
    void (*done)(void *ctx, const struct rights *rights); /* from the loop; NULL: no thread can be had (errno) */
    void *ctx;
    struct rights_look *look; /* under way; NULL: none */
    bool again;               /* for `wanted`, when that has ended */
    char wanted[RIGHTS_TEXT_MAX];
    struct loop_fd ended; /* an eventfd */
};

/** rights_lookup_begin - as rights_set; `done` is told later, or at once that it cannot be. */
void rights_lookup_begin(struct rights_lookup *l, const char *change);

/** rights_lookup_end - waits for nothing: a look that is under way goes on for itself, and `done` is not told of it. */
void rights_lookup_end(struct rights_lookup *l);

#endif
