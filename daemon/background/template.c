/* SPDX-License-Identifier: MIT */
/* template - see template.h. */
#include "template.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/devices/device.h"
#include "core/log.h"
#include "template_file.h"

#define LOOK_EVERY 64 /* pings between two looks whether learning is done */
#define STRANGE    64 /* pings of another shape in a row after which learning begins anew with theirs */
#define LEAST_USED 3  /* pings of a row that a template may rest on */

static void happened(struct templates *s, int sensor, enum log_level level, const char *event, const char *fmt,
                     ...) __attribute__((format(printf, 5, 6)));

static void happened(struct templates *s, int sensor, enum log_level level, const char *event, const char *fmt,
                     ...)
{
    struct template *t = &s->of[sensor];
    va_list args;
    va_start(args, fmt);
    vsnprintf(t->happened, sizeof t->happened, fmt, args);
    va_end(args);
    log_sonar(level, event, s->env.conf->sonar[sensor].name, "background: %s", t->happened);
}

/* Cells that a ping of this sonar may have. */
static size_t room(const struct templates *s, int sensor)
{
    const struct device_ops *ops = device_find(s->env.conf->sonar[sensor].device);
    return (size_t)ops->max_beams * ops->max_bins;
}

/* A change of what the extract stage works with, and what nobody works with after it. */
struct handing {
    struct background_job job;
    struct template *of;
    void *old[3];
};

static void release(void *handing)
{
    struct handing *h = handing;
    if (!h->job.done) { /* at the end */
        pipeline_drain(h->job.call.pipeline);
        pipeline_take_background(&h->job, NULL);
    }
    for (size_t i = 0; i < sizeof h->old / sizeof *h->old; i++)
        free(h->old[i]);
    struct template *t = h->of;
    free(h);
    if (--t->handing == 0)
        rpc_work_resume_all(&t->waiters);
}

/*
 * From now on the extract stage works with this template and this learner (NULL: none). The loop does not wait for it:
 * those of before are freed when the stage has heard of it. False without memory: nothing has changed.
 */
static bool hand_over(struct templates *s, int sensor, struct background *use, struct background_learn *learn)
{
    struct template *t = &s->of[sensor];
    const bool another = use != t->background;
    uint8_t *view = another && use ? calloc(2, room(s, sensor)) : NULL;
    struct handing *h = malloc(sizeof *h);
    if (!h || (another && use && !view)) {
        free(view);
        free(h);
        return false;
    }
    *h = (struct handing){
        .job = {.call = {.extracts = true, .pipeline = s->env.pipeline},
                .sensor = sensor,
                .background = {.use = use, .learn = learn, .open_water = s->env.conf->background.open_water == 1}},
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
    h->job.background.learning = t->learnings;
    if (use)
        h->job.background.view = (struct background_view){.level = t->view, .blind = t->view + room(s, sensor)};
    owner_poll(s->env.pipeline, &h->job.call, pipeline_take_background);
    owner_job_leave(&h->job.call, release);
    return true;
}

static bool no_memory(struct fault *fault)
{
    return fault_set(fault, "out of memory");
}

/* ---- learning ---- */

static struct background *make(const struct templates *s, const struct template *t, uint32_t least,
                               struct background_kept *kept)
{
    const struct conf_background *c = &s->env.conf->background;
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

/* Open water has no part of the vehicle, and a template none: that is no failure. */
static void say_learnt(struct templates *s, int sensor, const struct background_kept *kept)
{
    const unsigned others = (unsigned)(kept->clusters - kept->kept);
    if (kept->kept == 0)
        happened(s, sensor, LOG_NOTICE, "background_learnt",
                 "learnt: no part of the vehicle found; loud clusters that stay obstacles: %u; %u cells are blind",
                 others, (unsigned)kept->blind);
    else
        happened(s, sensor, LOG_NOTICE, "background_learnt",
                 "learnt: loud clusters taken for the vehicle: %u, that stay obstacles: %u; %u cells are blind",
                 (unsigned)kept->kept, others, (unsigned)kept->blind);
}

/* What was learnt is in force, and learning is over. Without memory it goes on. */
static bool finish_learning(struct templates *s, int sensor, struct fault *fault)
{
    struct template *t = &s->of[sensor];
    struct background_kept kept;
    pipeline_drain(s->env.pipeline); /* nobody learns while it is made */
    struct background *b = make(s, t, least_used(t), &kept);
    if (!b || !hand_over(s, sensor, b, NULL)) {
        free(b);
        return no_memory(fault);
    }
    t->kept = kept;
    say_learnt(s, sensor, &kept);
    return true;
}

/* In a replay of all that came before, so that the same capture is learnt from alike. */
void template_progress(const struct templates *s, int sensor, struct background_progress *out)
{
    if (s->env.replay)
        pipeline_drain(s->env.pipeline);
    pipeline_learnt(s->env.pipeline, sensor, s->of[sensor].learnings, out);
}

/* The first ping may have been of the range before, or the range is another now. */
static void look_at_shape(struct templates *s, int sensor, const struct ping *ping)
{
    struct template *t = &s->of[sensor];
    struct background_shape shape;
    struct fault fault;
    if (!background_shape_of(ping, &shape))
        return;
    t->shape = shape;
    t->has_shape = true;
    const bool strange = t->learn && background_fit(background_learn_shape(t->learn), ping) != BACKGROUND_FITS;
    t->strange = strange ? t->strange + 1 : 0;
    if (t->strange < STRANGE || t->handing > 0)
        return;
    t->strange = 0;
    happened(s, sensor, LOG_WARNING, "background_anew",
             "learning restarts: range or bins have differed from the first ping for %d pings", STRANGE);
    if (!template_learn(s, sensor, &t->learning, &fault))
        happened(s, sensor, LOG_ERR, "background_failed", "learning: %s", fault.text);
}

void template_ping(struct templates *s, int sensor, const struct ping *ping)
{
    struct template *t = &s->of[sensor];
    struct background_progress p;
    struct fault fault;
    look_at_shape(s, sensor, ping);
    if (t->background) {
        const int fit = (int)background_fit(&t->background->shape, ping);
        if (fit != t->fit && fit == BACKGROUND_FOREIGN)
            happened(s, sensor, LOG_WARNING, "background_unfit",
                     "template not used: it is of another head or another amplitude law");
        t->fit = fit;
    }
    if (!t->learn || ++t->pings % LOOK_EVERY != 0)
        return;
    template_progress(s, sensor, &p);
    if (!p.done)
        return;
    if (!finish_learning(s, sensor, &fault))
        happened(s, sensor, LOG_ERR, "background_failed", "learning: %s", fault.text);
}

bool template_learn(struct templates *s, int sensor, const struct background_learn_conf *conf, struct fault *fault)
{
    struct template *t = &s->of[sensor];
    if (*s->env.replay_ended)
        return fault_set(fault, "nothing to learn from: the replay has ended");
    if (!t->has_shape)
        return fault_set(fault, "nothing to learn from: this sonar has sent no ping with intensities yet");
    const size_t size = background_learn_size(&t->shape, conf->pings);
    struct background_learn *learn = size <= TEMPLATE_LEARN_MAX ? malloc(size) : NULL;
    if (!learn)
        return fault_set(fault, "%u pings of %u rows of %u bins need %zu MiB: %s; use fewer pings", conf->pings,
                         t->shape.rows, t->shape.bins, size >> 20,
                         size > TEMPLATE_LEARN_MAX ? "more than 128" : "out of memory");
    if (!hand_over(s, sensor, t->background,
                   background_learn_init(learn, &t->shape, conf, &s->env.mount[sensor]))) {
        free(learn);
        return no_memory(fault);
    }
    t->learning = *conf;
    t->pings = t->strange = 0;
    happened(s, sensor, LOG_NOTICE, "background_learning", "learning from %u pings of each row%s", conf->pings,
             conf->standing ? ", moving or not" : "");
    return true;
}

bool template_stop(struct templates *s, int sensor, bool use, struct fault *fault)
{
    struct template *t = &s->of[sensor];
    if (!t->learn)
        return fault_set(fault, "no learning in progress");
    struct background_progress p;
    template_progress(s, sensor, &p);
    if (use && p.least < least_used(t))
        return fault_set(fault, "too early: one direction has only %u pings; at least %u are needed", p.least,
                         least_used(t));
    if (use)
        return finish_learning(s, sensor, fault);
    if (!hand_over(s, sensor, t->background, NULL))
        return no_memory(fault);
    happened(s, sensor, LOG_NOTICE, "background_given_up", "learning was cancelled");
    return true;
}

/* ---- files ---- */

void template_kept(struct templates *s, int sensor, unsigned made, const char *path)
{
    s->of[sensor].in_file = made;
    happened(s, sensor, LOG_NOTICE, "background_saved", "saved as %s", path);
}

bool template_put(struct templates *s, int sensor, struct background *background, const char *path,
                  struct fault *fault)
{
    struct template *t = &s->of[sensor];
    if (!hand_over(s, sensor, background, t->learn)) {
        free(background);
        return no_memory(fault);
    }
    t->in_file = t->made;
    happened(s, sensor, LOG_NOTICE, "background_loaded", "loaded from %s", path);
    return true;
}

/* Before the first ping: nobody waits for it. */
static bool load(struct templates *s, int sensor, enum template_fault *kind, struct fault *fault)
{
    const char *path = s->env.conf->sonar[sensor].background;
    struct background *b = template_load(path, (uint8_t)s->env.conf->background.mask, kind, fault);
    return b && template_put(s, sensor, b, path, fault);
}

bool template_clear(struct templates *s, int sensor, struct fault *fault)
{
    if (!s->of[sensor].background)
        return fault_set(fault, "no template is in force");
    if (!hand_over(s, sensor, NULL, s->of[sensor].learn))
        return no_memory(fault);
    happened(s, sensor, LOG_NOTICE, "background_cleared", "cleared");
    return true;
}

/* ---- start and end ---- */

void template_start(struct templates *s, const struct template_env *env)
{
    struct fault fault;
    s->env = *env;
    for (int i = 0; i < s->env.conf->n_sonars; i++) {
        enum template_fault kind;
        s->of[i].fit = -1;
        if (!s->env.conf->sonar[i].background[0])
            continue;
        if (!load(s, i, &kind, &fault))
            happened(s, i, kind == TEMPLATE_MISSING ? LOG_NOTICE : LOG_ERR, "background_missing",
                     "runs without a template: %s", fault.text);
        else if (s->env.replay)
            happened(s, i, LOG_WARNING, "background_of_today",
                     "using the present template; the one of the recording may differ: %s",
                     s->env.conf->sonar[i].background);
    }
}

void template_end(struct templates *s)
{
    for (int i = 0; i < CONF_MAX_SONARS; i++) {
        free(s->of[i].background);
        free(s->of[i].view);
        free(s->of[i].learn);
    }
}

const char *template_word(const struct template *t)
{
    return t->learn                       ? "learning"
           : !t->background               ? "none"
           : t->fit == BACKGROUND_FOREIGN ? "does not fit"
                                          : "in force";
}
