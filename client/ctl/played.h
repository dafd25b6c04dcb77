/* SPDX-License-Identifier: MIT */
/* played - a capture that a sonard of its own plays, for whoever wants its answers at one moment after the other. */
#ifndef SONARD_PLAYED_H
#define SONARD_PLAYED_H

#include <jansson.h>
#include <stdbool.h>
#include <sys/types.h>

#include "client/lib/sonard.h"
#include "core/fault.h"

struct played {
    pid_t daemon; /* 0: none */
    struct sonard_client *client;
    double length_s;   /* of the capture */
    double position_s; /* where its clock stands */
    int log;           /* what it says; -1: none */
    char folder[64];   /* of its socket, until it is connected to; "": none */
};

/**
 * played_start - with the configuration of that file, or NULL: the capture's own. The clock stands at its start. False
 * with a sentence in fault, and what the daemon said on standard error; played_stop is to be called anyway.
 */
bool played_start(struct played *played, const char *capture, const char *conf, struct fault *fault);

/** played_go - so many seconds after its start, or past that where nothing was recorded for long. False: fault. */
bool played_go(struct played *played, double to_s, struct fault *fault);

/** played_ask - what a method answers there; params may be NULL. NULL: it is refused, or the daemon is gone. */
json_t *played_ask(struct played *played, const char *method, json_t *params);

/** played_stop - end the daemon and remove what it needed. */
void played_stop(struct played *played);

#endif
