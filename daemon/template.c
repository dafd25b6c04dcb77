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

#define LOOK_EVERY 64 /* pings between two looks whether learning is done */
#define STRANGE    64 /* pings of another shape in a row after which learning begins anew with theirs */
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
    struct template *of;
    void *old[3];
};

static void release(void *handing)
{
    struct handing *h = handing;
    if (!h->way.done) { /* at the end */
        pipeline_drain(h->way.errand.pipeline);
        pipeline_take_background(&h->way, NULL);
    }
    for (size_t i = 0; i < sizeof h->old / sizeof *h->old; i++)
        free(h->old[i]);
    h->of->handing--;
    free(h);
}

/*
 * From now on the extract stage works with this template and this learner (NULL: none). The loop does not wait for it:
 * those of before are freed when the stage has heard of it. False without memory: nothing has changed.
 */
static bool hand_over(struct daemon *d, int sensor, struct background *use, struct background_learn *learn)
{
    struct template *t = &d->template[sensor];
    const bool another = use != t->background;
    uint8_t *view = another && use ? calloc(2, room(d, sensor)) : NULL;
    struct handing *h = malloc(sizeof *h);
    if (!h || (another && use && !view)) {
        free(view);
        free(h);
        return false;
    }
    *h = (struct handing){.way = {.errand = {.early = true, .pipeline = d->pipeline},
                                  .sensor = sensor,
                                  .background = {.use = use, .learn = learn}},
                          .of = t};
    t->handing++;
    if (another) {
        h->old[0] = t->background;
        h->old[1] = t->view;
        t->background = use;
        t->view = view;
        t->made++;
        t->fit = -1;
        t->kept = (struct background_kept){0};
    }
    if (learn != t->learn) {
        h->old[2] = t->learn;
        t->learn = learn;
        t->learnings++;
    }
    h->way.background.learning = t->learnings;
    if (use)
        h->way.background.view = (struct background_view){.level = t->view, .blind = t->view + room(d, sensor)};
    pipeline_errand(d->pipeline, &h->way.errand, pipeline_take_background);
    pipeline_errand_leave(&h->way.errand, release);
    return true;
}

static bool no_memory(char *err, size_t err_size)
{
    snprintf(err, err_size, "out of memory");
    return false;
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

/* What was learnt is in force, and learning is over. Without memory it goes on. */
static bool finish(struct daemon *d, int sensor, char *err, size_t err_size)
{
    struct template *t = &d->template[sensor];
    struct background_kept kept;
    pipeline_drain(d->pipeline); /* nobody learns while it is made */
    struct background *b = make(d, t, least_used(t), &kept);
    if (!b || !hand_over(d, sensor, b, NULL)) {
        free(b);
        return no_memory(err, err_size);
    }
    t->kept = kept;
    happened(d, sensor, LOG_NOTICE, "background_learnt",
             "learnt: %u of %u clusters are the vehicle, %u cells are blind", kept.kept, kept.clusters,
             kept.blind);
    return true;
}

/* In a replay of all that came before, so that the same capture is learnt from alike. */
void template_progress(const struct daemon *d, int sensor, struct background_progress *out)
{
    if (d->replay)
        pipeline_drain(d->pipeline);
    pipeline_learnt(d->pipeline, sensor, d->template[sensor].learnings, out);
}

/* The first ping may have been of the range before, or the range is another now. */
static void look_at_shape(struct daemon *d, int sensor, const struct ping *ping)
{
    struct template *t = &d->template[sensor];
    struct background_shape shape;
    char err[200];
    if (!background_shape_of(ping, &shape))
        return;
    t->shape = shape;
    t->has_shape = true;
    const bool strange = t->learn && background_fit(background_learn_shape(t->learn), ping) != BACKGROUND_FITS;
    t->strange = strange ? t->strange + 1 : 0;
    if (t->strange < STRANGE || t->handing > 0)
        return;
    t->strange = 0;
    happened(d, sensor, LOG_WARNING, "background_anew",
             "learning begins anew: for %d pings the range or the bins have been others than at its beginning", STRANGE);
    if (!template_learn(d, sensor, &t->learning, err, sizeof err))
        happened(d, sensor, LOG_ERR, "background_failed", "learning: %s", err);
}

void template_ping(struct daemon *d, int sensor, const struct ping *ping)
{
    struct template *t = &d->template[sensor];
    struct background_progress p;
    char err[128];
    look_at_shape(d, sensor, ping);
    if (t->background) {
        const int fit = (int)background_fit(&t->background->shape, ping);
        if (fit != t->fit && fit == BACKGROUND_FOREIGN)
            happened(d, sensor, LOG_WARNING, "background_unfit",
                     "the template is of another head or other counts: not used");
        t->fit = fit;
    }
    if (!t->learn || ++t->pings % LOOK_EVERY != 0)
        return;
    template_progress(d, sensor, &p);
    if (!p.done)
        return;
    if (!finish(d, sensor, err, sizeof err))
        happened(d, sensor, LOG_ERR, "background_failed", "learning: %s", err);
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
    if (!hand_over(d, sensor, t->background, background_learn_init(learn, &t->shape, conf, &d->mount[sensor]))) {
        free(learn);
        return no_memory(err, err_size);
    }
    t->learning = *conf;
    t->pings = t->strange = 0;
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
    template_progress(d, sensor, &p);
    if (use && p.least < least_used(t)) {
        snprintf(err, err_size, "too early: some row has %u pings only, at least %u are needed", p.least,
                 least_used(t));
        return false;
    }
    if (use)
        return finish(d, sensor, err, err_size);
    if (!hand_over(d, sensor, t->background, NULL))
        return no_memory(err, err_size);
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

static bool ask(struct daemon *d, int sensor, enum template_way way, struct template_wait *wait, char *err,
                size_t err_size)
{
    if (!path_of(d, sensor, err, err_size))
        return false;
    template_keep_ask(d, sensor, way, wait);
    return true;
}

bool template_save_one(struct daemon *d, int sensor, struct template_wait *wait, char *err, size_t err_size)
{
    return ask(d, sensor, TEMPLATE_TO_FILE, wait, err, err_size);
}

bool template_load_one(struct daemon *d, int sensor, struct template_wait *wait, char *err, size_t err_size)
{
    return ask(d, sensor, TEMPLATE_FROM_FILE, wait, err, err_size);
}

void template_kept(struct daemon *d, int sensor, unsigned made, const char *path)
{
    d->template[sensor].in_file = made;
    happened(d, sensor, LOG_NOTICE, "background_saved", "saved as %s", path);
}

bool template_put(struct daemon *d, int sensor, struct background *background, const char *path, char *err,
                  size_t err_size)
{
    struct template *t = &d->template[sensor];
    if (!hand_over(d, sensor, background, t->learn)) {
        free(background);
        return no_memory(err, err_size);
    }
    t->in_file = t->made;
    happened(d, sensor, LOG_NOTICE, "background_loaded", "loaded from %s", path);
    return true;
}

/* Before the first ping: nobody waits for it. */
static bool load(struct daemon *d, int sensor, enum template_fault *fault, char *err, size_t err_size)
{
    const char *path = d->conf.sonar[sensor].background;
    struct background *b = template_load(path, (uint8_t)d->conf.background.mask, fault, err, err_size);
    return b && template_put(d, sensor, b, path, err, err_size);
}

bool template_clear(struct daemon *d, int sensor, char *err, size_t err_size)
{
    if (!d->template[sensor].background) {
        snprintf(err, err_size, "no template is in force");
        return false;
    }
    if (!hand_over(d, sensor, NULL, d->template[sensor].learn))
        return no_memory(err, err_size);
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
