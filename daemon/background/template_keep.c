/* SPDX-License-Identifier: MIT */
/* template_keep - see template_keep.h. */
#include "template_keep.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/log.h"
#include "template_file.h"

/* ---- the worker ---- */

static void move(struct template_copy *c)
{
    enum template_fault kind;
    if (c->transfer == TEMPLATE_TO_FILE)
        c->good = template_write(c->bytes, c->size, c->path, &c->fault);
    else if (c->transfer == TEMPLATE_FROM_FILE)
        c->read = template_load(c->path, c->mask, &kind, &c->fault);
}

static void move_all(void *ctx)
{
    struct template_keep *k = ctx;
    for (struct template_copy *c = k->copy; c < k->copy + CONF_MAX_SONARS; c++)
        move(c);
}

/* ---- the loop ---- */

static void not_kept(const struct template_keep *k, int sensor, const char *why)
{
    log_limited(loop_now(k->env.loop), LOG_ERR,
                LOG_ABOUT(.event = "background_not_kept", .sonar = k->env.conf->sonar[sensor].name),
                "background: not kept: %s", why);
}

static bool is_asked_for(const struct template_keep *k, int sensor, enum template_transfer transfer)
{
    for (const struct template_wait *s = k->asked; s; s = s->next)
        if (s->sensor == sensor && s->transfer == transfer)
            return true;
    return false;
}

static void copy_one(struct template_keep *k, int sensor)
{
    const struct template *t = &k->env.templates->of[sensor];
    struct template_copy *c = &k->copy[sensor];
    c->made = t->made;
    c->bytes = template_encode(t->background, &c->size);
    if (c->bytes)
        c->transfer = TEMPLATE_TO_FILE;
    else
        not_kept(k, sensor, "out of memory");
}

/* Copies every template that somebody wants saved, and if it is time for that those that their files do not hold; where
 * there is none of a sonar, its file may be read. How many are on their way. */
static int copy_wanted(struct template_keep *k, bool changed)
{
    int n = 0;
    for (int i = 0; i < k->env.conf->n_sonars; i++) {
        const struct template *t = &k->env.templates->of[i];
        struct template_copy *c = &k->copy[i];
        *c = (struct template_copy){.mask = (uint8_t)k->env.conf->background.mask};
        snprintf(c->path, sizeof c->path, "%s", k->env.conf->sonar[i].background);
        if (t->background && c->path[0] &&
            ((changed && t->made != t->in_file) || is_asked_for(k, i, TEMPLATE_TO_FILE)))
            copy_one(k, i);
        if (c->transfer == TEMPLATE_STAYS && is_asked_for(k, i, TEMPLATE_FROM_FILE))
            c->transfer = TEMPLATE_FROM_FILE;
        n += c->transfer != TEMPLATE_STAYS;
    }
    return n;
}

/* Those who wait for this sonar's file, which is under way or is not, have waited long enough. */
static void tell_waiters(struct template_keep *k, int sensor, enum template_transfer transfer, bool under_way,
                         bool good, const char *why)
{
    for (struct template_wait **at = &k->asked; *at;) {
        struct template_wait *s = *at;
        if (s->sensor != sensor || s->transfer != transfer || s->under_way != under_way) {
            at = &s->next;
            continue;
        }
        *at = s->next;
        s->done = true;
        s->good = good;
        fault_set(&s->fault, "%s", why);
    }
}

/* It has been written or read, or not. */
static void settle_one(struct template_keep *k, int sensor)
{
    struct template_copy *c = &k->copy[sensor];
    if (c->transfer == TEMPLATE_FROM_FILE)
        c->good = c->read && template_put(k->env.templates, sensor, c->read, c->path, &c->fault);
    else if (c->good)
        template_kept(k->env.templates, sensor, c->made, c->path);
    else
        not_kept(k, sensor, c->fault.text);
    free(c->bytes);
    c->bytes = NULL;
    tell_waiters(k, sensor, c->transfer, true, c->good, c->fault.text);
    c->transfer = TEMPLATE_STAYS;
}

static void settle_transfers(struct template_keep *k)
{
    for (int i = 0; i < k->env.conf->n_sonars; i++)
        if (k->copy[i].transfer != TEMPLATE_STAYS)
            settle_one(k, i);
}

/* What is asked for and cannot be copied is refused at once. */
static void mark_under_way(struct template_keep *k)
{
    for (struct template_wait *s = k->asked; s; s = s->next)
        s->under_way = k->copy[s->sensor].transfer == s->transfer;
    for (int i = 0; i < k->env.conf->n_sonars; i++)
        tell_waiters(k, i, TEMPLATE_TO_FILE, false, false,
                     k->env.templates->of[i].background ? "out of memory" : "no template to save");
}

static void on_moved(void *ctx);

static void begin_transfers(struct template_keep *k, bool changed)
{
    const int n = copy_wanted(k, changed);
    mark_under_way(k);
    k->running = n > 0;
    if (k->running)
        worker_run(k->env.worker, &k->job, move_all, on_moved, k);
}

/* There is no pipeline any more that a template could be put in force in. */
static void drop_what_was_read(struct template_keep *k)
{
    for (struct template_copy *c = k->copy; c < k->copy + CONF_MAX_SONARS; c++)
        if (c->transfer == TEMPLATE_FROM_FILE) {
            free(c->read);
            c->transfer = TEMPLATE_STAYS;
        }
}

static void on_moved(void *ctx)
{
    struct template_keep *k = ctx;
    k->running = false;
    if (k->ends)
        drop_what_was_read(k);
    settle_transfers(k);
    if (k->asked && !k->ends)
        begin_transfers(k, false);
    rpc_work_resume_all(&k->waiters);
}

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct template_keep *k = ctx;
    loop_arm(k->env.loop, &k->timer, now_ns + (uint64_t)(k->env.conf->background.save_every_s * 1e9));
    if (!k->running)
        begin_transfers(k, true);
}

void template_keep_ask(struct template_keep *k, int sensor, enum template_transfer transfer,
                       struct template_wait *wait)
{
    *wait = (struct template_wait){.keep = k, .sensor = sensor, .transfer = transfer, .next = k->asked};
    k->asked = wait;
    if (!k->running)
        begin_transfers(k, false);
}

static bool ask_transfer(struct template_keep *k, int sensor, enum template_transfer transfer,
                         struct template_wait *wait, struct fault *fault)
{
    const struct conf_sonar *sonar = &k->env.conf->sonar[sensor];
    if (!sonar->background[0])
        return fault_set(fault, "no file configured: set background in [sonar %s]", sonar->name);
    template_keep_ask(k, sensor, transfer, wait);
    return true;
}

bool template_keep_save(struct template_keep *k, int sensor, struct template_wait *wait, struct fault *fault)
{
    return ask_transfer(k, sensor, TEMPLATE_TO_FILE, wait, fault);
}

bool template_keep_load(struct template_keep *k, int sensor, struct template_wait *wait, struct fault *fault)
{
    return ask_transfer(k, sensor, TEMPLATE_FROM_FILE, wait, fault);
}

void template_keep_forget(struct template_wait *wait)
{
    struct template_wait **at = &wait->keep->asked;
    while (*at && *at != wait)
        at = &(*at)->next;
    if (*at)
        *at = wait->next;
}

void template_keep_start(struct template_keep *k, const struct template_keep_env *env)
{
    k->env = *env;
    if (k->env.replay || !(k->env.conf->background.save_every_s > 0))
        return;
    k->timer = (struct loop_timer){.fire = on_timer, .ctx = k};
    loop_arm(k->env.loop, &k->timer,
             loop_now(k->env.loop) + (uint64_t)(k->env.conf->background.save_every_s * 1e9));
}

void template_keep_end(struct template_keep *k)
{
    k->ends = true;
    if (k->running)
        worker_finish(k->env.worker);
    if (!k->timer.fire)
        return;
    loop_arm(k->env.loop, &k->timer, LOOP_NEVER);
    if (copy_wanted(k, true) > 0) {
        move_all(k);
        settle_transfers(k);
    }
}
