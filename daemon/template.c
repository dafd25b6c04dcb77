/* SPDX-License-Identifier: MIT */
/* template - see template.h. */
#include "template.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../drivers/device.h"
#include "daemon.h"
#include "template_file.h"

#define LOOK_EVERY 64 /* pings between two looks whether learning is done: each look waits for the pipeline */
#define LEAST_USED 3  /* pings of a row that a template may rest on */

static void happened(struct daemon *d, int sensor, enum log_level level, const char *event, const char *fmt, ...)
    __attribute__((format(printf, 5, 6)));

static void happened(struct daemon *d, int sensor, enum log_level level, const char *event, const char *fmt, ...)
{
    struct template *t = &d->template[sensor];
    va_list args;
    va_start(args, fmt);
    vsnprintf(t->happened, sizeof t->happened, fmt, args);
    va_end(args);
    log_sonar(level, event, d->conf.sonar[sensor].name, "background: %s", t->happened);
}

/* Cells that a ping of this sonar may have. */
static size_t room(const struct daemon *d, int sensor)
{
    const struct device_ops *ops = device_find(d->conf.sonar[sensor].device);
    return (size_t)ops->max_beams * ops->max_bins;
}

/* A change of what the extract stage works with, and what nobody works with after it. */
struct handing {
    struct background_errand way;
    void *old[2];
};

static void free_old(void *handing)
{
    struct handing *h = handing;
    if (!h->way.done) { /* at the end, or without memory */
        pipeline_drain(h->way.errand.pipeline);
        pipeline_take_background(&h->way, NULL);
    }
    free(h->old[0]);
    free(h->old[1]);
}

static void release(void *handing)
{
    free_old(handing);
    free(handing);
}

/* The loop does not wait for it: a, b are freed when the extract stage has heard of it. */
static void hand_over(struct daemon *d, int sensor, void *a, void *b)
{
    const struct template *t = &d->template[sensor];
    struct handing now = {.way = {.errand = {.early = true, .pipeline = d->pipeline},
                                  .sensor = sensor,
                                  .background = {.use = t->background, .learn = t->learn}},
                          .old = {a, b}};
    if (t->view)
        now.way.background.view = (struct background_view){.level = t->view, .blind = t->view + room(d, sensor)};
    struct handing *h = malloc(sizeof *h);
    if (!h) {
        free_old(&now);
        return;
    }
    *h = now;
    pipeline_errand(d->pipeline, &h->way.errand, pipeline_take_background);
    pipeline_errand_leave(&h->way.errand, release);
}

/* Puts `next` (NULL: nothing) in force and frees what was. False without memory: nothing has changed. */
static bool replace(struct daemon *d, int sensor, struct background *next)
{
    struct template *t = &d->template[sensor];
    struct background *old = t->background;
    uint8_t *old_view = t->view;
    t->view = next ? calloc(2, room(d, sensor)) : NULL;
    if (next && !t->view) {
        t->view = old_view;
        return false;
    }
    t->background = next;
    t->made++;
    t->fit = -1;
    t->kept = (struct background_kept){0};
    hand_over(d, sensor, old, old_view);
    return true;
}

static void drop_learner(struct daemon *d, int sensor)
{
    struct template *t = &d->template[sensor];
    struct background_learn *learn = t->learn;
    t->learn = NULL;
    hand_over(d, sensor, learn, NULL);
}

/* ---- learning ---- */

static struct background *make(const struct daemon *d, const struct template *t, uint32_t least,
                               struct background_kept *kept)
{
    const struct conf_background *c = &d->conf.background;
    const struct background_rule rule = {.neighbour_m = c->neighbour_m,
                                         .min_points = (uint32_t)c->min_points,
                                         .min_level = c->min_level,
                                         .extent_m = c->extent_m,
                                         .reach_m = c->reach_m,
                                         .share = c->share,
                                         .ring_m = c->ring_m};
    const struct background_shape *shape = background_learn_shape(t->learn);
    void *work = malloc(background_keep_size(shape)), *mem = malloc(background_size(shape));
    struct background *b = NULL;
    if (work && mem) {
        b = background_init(mem, shape, (uint8_t)c->mask);
        background_learn_finish(t->learn, least, b);
        background_keep(b, &rule, work, kept);
    } else {
        free(mem);
    }
    free(work);
    return b;
}

/* Rows with fewer pings than this tell too little. */
static uint32_t least_used(const struct template *t)
{
    return t->learning.pings < LEAST_USED ? t->learning.pings : LEAST_USED;
}

static bool finish(struct daemon *d, int sensor, char *err, size_t err_size)
{
    struct template *t = &d->template[sensor];
    struct background_kept kept;
    struct background *b = make(d, t, least_used(t), &kept);
    if (!b || !replace(d, sensor, b)) {
        free(b);
        snprintf(err, err_size, "out of memory");
        return false;
    }
    t->kept = kept;
    happened(d, sensor, LOG_NOTICE, "background_learnt",
             "learnt: %u of %u clusters are the vehicle, %u cells are blind", kept.kept, kept.clusters,
             kept.blind);
    return true;
}

void template_ping(struct daemon *d, int sensor, const struct ping *ping)
{
    struct template *t = &d->template[sensor];
    struct background_shape shape;
    struct background_progress p;
    char err[128];
    if (background_shape_of(ping, &shape)) {
        t->shape = shape;
        t->has_shape = true;
    }
    if (t->background) {
        const int fit = (int)background_fit(&t->background->shape, ping);
        if (fit != t->fit && fit == BACKGROUND_FOREIGN)
            happened(d, sensor, LOG_WARNING, "background_unfit",
                     "the template is of another head or other counts: not used");
        t->fit = fit;
    }
    if (!t->learn || ++t->pings % LOOK_EVERY != 0)
        return;
    pipeline_drain(d->pipeline);
    background_learn_progress(t->learn, &p);
    if (!p.done)
        return;
    if (!finish(d, sensor, err, sizeof err))
        happened(d, sensor, LOG_ERR, "background_failed", "learning: %s", err);
    drop_learner(d, sensor);
}

bool template_learn(struct daemon *d, int sensor, const struct background_learn_conf *conf, char *err,
                    size_t err_size)
{
    struct template *t = &d->template[sensor];
    if (d->replay_ended) {
        snprintf(err, err_size, "the replay has ended, no more pings come: nothing to learn from");
        return false;
    }
    if (!t->has_shape) {
        snprintf(err, err_size, "no ping with intensities has come from this sonar yet: nothing to learn from");
        return false;
    }
    const size_t size = background_learn_size(&t->shape, conf->pings);
    struct background_learn *learn = size <= TEMPLATE_LEARN_MAX ? malloc(size) : NULL;
    if (!learn) {
        snprintf(err, err_size, "%u pings of %u rows of %u bins need %zu MiB: %s; want fewer pings", conf->pings,
                 t->shape.rows, t->shape.bins, size >> 20,
                 size > TEMPLATE_LEARN_MAX ? "more than 128" : "out of memory");
        return false;
    }
    if (t->learn)
        drop_learner(d, sensor);
    t->learn = background_learn_init(learn, &t->shape, conf, &d->mount[sensor]);
    t->learning = *conf;
    t->pings = 0;
    hand_over(d, sensor, NULL, NULL);
    happened(d, sensor, LOG_NOTICE, "background_learning", "learning from %u pings of each row%s", conf->pings,
             conf->standing ? ", moving or not" : "");
    return true;
}

bool template_stop(struct daemon *d, int sensor, bool use, char *err, size_t err_size)
{
    struct template *t = &d->template[sensor];
    if (!t->learn) {
        snprintf(err, err_size, "nothing is being learnt");
        return false;
    }
    struct background_progress p;
    pipeline_drain(d->pipeline);
    background_learn_progress(t->learn, &p);
    if (use && p.least < least_used(t)) {
        snprintf(err, err_size, "too early: some row has %u pings only, at least %u are needed", p.least,
                 least_used(t));
        return false;
    }
    if (use && !finish(d, sensor, err, err_size))
        return false;
    drop_learner(d, sensor);
    if (!use)
        happened(d, sensor, LOG_NOTICE, "background_given_up", "learning was given up");
    return true;
}

/* ---- files ---- */

static const char *path_of(const struct daemon *d, int sensor, char *err, size_t err_size)
{
    const char *path = d->conf.sonar[sensor].background;
    if (path[0])
        return path;
    snprintf(err, err_size, "no file is configured: set background in [sonar %s]", d->conf.sonar[sensor].name);
    return NULL;
}

bool template_save_one(struct daemon *d, int sensor, struct template_saving *saving, char *err, size_t err_size)
{
    if (!path_of(d, sensor, err, err_size))
        return false;
    template_keep_save(d, sensor, saving);
    return true;
}

void template_kept(struct daemon *d, int sensor, unsigned made, const char *path)
{
    d->template[sensor].in_file = made;
    happened(d, sensor, LOG_NOTICE, "background_saved", "saved as %s", path);
}

static bool load(struct daemon *d, int sensor, enum template_fault *fault, char *err, size_t err_size)
{
    struct template *t = &d->template[sensor];
    const char *path = path_of(d, sensor, err, err_size);
    *fault = TEMPLATE_UNREAD;
    if (!path)
        return false;
    struct background *b = template_load(path, (uint8_t)d->conf.background.mask, fault, err, err_size);
    if (!b)
        return false;
    if (!replace(d, sensor, b)) {
        free(b);
        snprintf(err, err_size, "out of memory");
        return false;
    }
    t->in_file = t->made;
    happened(d, sensor, LOG_NOTICE, "background_loaded", "loaded from %s", path);
    return true;
}

bool template_load_one(struct daemon *d, int sensor, char *err, size_t err_size)
{
    enum template_fault fault;
    return load(d, sensor, &fault, err, err_size);
}

bool template_clear(struct daemon *d, int sensor, char *err, size_t err_size)
{
    if (!d->template[sensor].background) {
        snprintf(err, err_size, "no template is in force");
        return false;
    }
    replace(d, sensor, NULL);
    happened(d, sensor, LOG_NOTICE, "background_cleared", "cleared");
    return true;
}

/* ---- start and end ---- */

void template_start(struct daemon *d)
{
    char err[640];
    for (int i = 0; i < d->conf.n_sonars; i++) {
        enum template_fault fault;
        d->template[i].fit = -1;
        if (!d->conf.sonar[i].background[0])
            continue;
        if (!load(d, i, &fault, err, sizeof err))
            happened(d, i, fault == TEMPLATE_MISSING ? LOG_NOTICE : LOG_ERR, "background_missing",
                     "runs without a template: %s", err);
        else if (d->replay)
            happened(d, i, LOG_WARNING, "background_of_today",
                     "the template of today is in force; that of the recording may have been another: %s",
                     d->conf.sonar[i].background);
    }
}

void template_end(struct daemon *d)
{
    for (int i = 0; i < d->conf.n_sonars; i++) {
        free(d->template[i].background);
        free(d->template[i].view);
        free(d->template[i].learn);
    }
}

const char *template_word(const struct template *t)
{
    return t->learn                       ? "learning"
           : !t->background               ? "none"
           : t->fit == BACKGROUND_FOREIGN ? "does not fit"
                                          : "in force";
}
