/* SPDX-License-Identifier: MIT */
/*
 * template_keep - background templates that survive the run by themselves (`save_every` in [background]): each that has
 * changed is written to its sonar's file every so often and when sonard stops. One thread at a time waits for the disk; the
 * loop copies a template for it and goes on. What it finds at a start, template_start has loaded.
 */
#ifndef SONARD_TEMPLATE_KEEP_H
#define SONARD_TEMPLATE_KEEP_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../config/conf.h"
#include "loop.h"

struct daemon;

/* A template on its way to its file. */
struct template_copy {
    uint8_t *bytes; /* NULL: none of this sonar */
    size_t size;
    unsigned made; /* which of the sonar's templates */
    char path[CONF_TEXT_MAX]; /* of its own: a reload may change the configuration meanwhile */
    bool good;
    char message[640]; /* why not */
};

struct template_keep {
    struct loop_timer timer; /* its fire is NULL: nothing is kept */
    struct loop_fd ended;    /* an eventfd */
    pthread_t thread;
    bool running; /* while it does, the thread alone has the copies */
    struct template_copy copy[CONF_MAX_SONARS];
};

/** template_keep_start - from here on; nothing without save_every or in a replay. False with a sentence in err. */
bool template_keep_start(struct daemon *d, char *err, size_t err_size);

/** template_keep_wait - until no file is being written. */
void template_keep_wait(struct daemon *d);

/** template_keep_end - writes what has changed and ends. Before template_end. */
void template_keep_end(struct daemon *d);

#endif
