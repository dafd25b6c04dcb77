/* SPDX-License-Identifier: MIT */
/*
 * template_keep - writes background templates to their sonars' files, and reads them from there: those that clients ask for,
 * and with `save_every` in [background], so that they survive the run by themselves, each that has changed, every so often
 * and when sonard stops. One thread at a time waits for the disk; the loop copies a template for it and goes on. What it
 * finds at a start, template_start has loaded.
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

enum template_way { TEMPLATE_STAYS, TEMPLATE_TO_FILE, TEMPLATE_FROM_FILE };

/* A sonar's template on its way to its file, or from there. */
struct template_copy {
    enum template_way way;
    uint8_t *bytes; /* to the file, ... */
    size_t size;
    unsigned made; /* ... which of the sonar's templates */
    struct background *read; /* from the file */
    uint8_t mask;
    char path[CONF_TEXT_MAX]; /* of its own: a reload may change the configuration meanwhile */
    bool good;
    char message[640]; /* why not */
};

/* Somebody who waits until a sonar's template is in its file, or that of the file is in force. */
struct template_wait {
    struct daemon *d;
    int sensor;
    enum template_way way;
    bool under_way, done, good;
    char message[640]; /* why it is done and not good */
    struct template_wait *next;
};

struct template_keep {
    struct loop_timer timer; /* its fire is NULL: what nobody asks for is not kept */
    struct loop_fd ended;    /* an eventfd */
    pthread_t thread;
    bool running; /* while it does, the thread alone has the copies */
    struct template_copy copy[CONF_MAX_SONARS];
    struct template_wait *asked; /* not done yet */
};

/** template_keep_start - from here on. False with a sentence in err. */
bool template_keep_start(struct daemon *d, char *err, size_t err_size);

/**
 * template_keep_ask - have the template of that sonar, which has a file, written there or read from there and put in force;
 * what is under way comes before. When it is done server_go_on is called. template_keep_forget - nobody waits for it any more;
 * what is under way goes on.
 */
void template_keep_ask(struct daemon *d, int sensor, enum template_way way, struct template_wait *wait);
void template_keep_forget(struct template_wait *wait);

/** template_keep_end - waits, writes what is to be kept and ends. Nobody waits any more. Before template_end. */
void template_keep_end(struct daemon *d);

#endif
