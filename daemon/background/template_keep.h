/* SPDX-License-Identifier: MIT */
/*
 * template_keep - writes background templates to their sonars' files, and reads them from there: those that clients ask
 * for, and with `save_every` in [background], so that they survive the run by themselves, each that has changed, every
 * so often and when sonard stops. The worker waits for the disk; the loop copies a template for it and goes on.
 * What it finds at a start, template_start has loaded.
 */
#ifndef SONARD_TEMPLATE_KEEP_H
#define SONARD_TEMPLATE_KEEP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config/conf.h"
#include "core/fault.h"
#include "core/loop.h"
#include "core/worker.h"
#include "daemon/rpc/work.h"
#include "template.h"

enum template_transfer { TEMPLATE_STAYS, TEMPLATE_TO_FILE, TEMPLATE_FROM_FILE };

/* A sonar's template on its way to its file, or from there. */
struct template_copy {
    enum template_transfer transfer;
    uint8_t *bytes; /* to the file, ... */
    size_t size;
    unsigned made;           /* ... which of the sonar's templates */
    struct background *read; /* from the file */
    uint8_t mask;
    char path[CONF_TEXT_MAX]; /* of its own: a reload may change the configuration meanwhile */
    bool good;
    struct fault fault; /* why not */
};

/* Somebody who waits until a sonar's template is in its file, or that of the file is in force. */
struct template_wait {
    struct template_keep *keep;
    int sensor;
    enum template_transfer transfer;
    bool under_way, done, good;
    struct fault fault; /* why it is done and not good */
    struct template_wait *next;
};

/* What it needs; all of it outlives it. */
struct template_keep_env {
    struct loop *loop;
    struct worker *worker;
    const struct conf *conf;
    struct templates *templates;
    bool replay;
};

struct template_keep {
    struct template_keep_env env;
    struct loop_timer timer; /* its fire is NULL: what nobody asks for is not kept */
    struct worker_job job;
    bool running; /* while it is, the worker alone has the copies */
    bool ends;    /* nothing is put in force any more */
    struct template_copy copy[CONF_MAX_SONARS];
    struct template_wait *asked; /* not done yet */
    struct rpc_waiters waiters;  /* requests that look at theirs when some are done */
};

/** template_keep_start - from here on. */
void template_keep_start(struct template_keep *k, const struct template_keep_env *env);

/**
 * template_keep_ask - have the template of that sonar, which has a file, written there or read from there and put in
 * force; what is under way comes before. When it is done the waiters are resumed. template_keep_forget - nobody waits
 * for it any more; what is under way goes on.
 */
void template_keep_ask(struct template_keep *k, int sensor, enum template_transfer transfer,
                       struct template_wait *wait);
void template_keep_forget(struct template_wait *wait);

/** template_keep_save, template_keep_load - template_keep_ask for a client: false with a sentence in fault where that
 * sonar has no file. */
bool template_keep_save(struct template_keep *k, int sensor, struct template_wait *wait, struct fault *fault);
bool template_keep_load(struct template_keep *k, int sensor, struct template_wait *wait, struct fault *fault);

/** template_keep_end - waits, writes what is to be kept and ends. Nobody waits any more. Before template_end. */
void template_keep_end(struct template_keep *k);

#endif
