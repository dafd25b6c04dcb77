/* SPDX-License-Identifier: MIT */
/*
 * report_plan - the stages of the plan (sonard --explain), each against being left out: the same scans of the made-up
 * sea through the daemon's own pipeline with it and without, and the sectors that come of it. The scans are a
 * Ping360's, with the shipped configuration but for the stage.
 *
 *   report_plan proof [quick]   CSV: scene, stage, plan, must_be, sectors, changed, falsely_clear, bytes
 *   report_plan cost [quick]    CSV: stage, nanoseconds per bin from a ping's submission until it is in the picture
 *   report_plan count [quick]   CSV: stage, bins, for callgrind to count the instructions of pipeline_submit
 *   report_plan spared [quick]  CSV: scene, stage, per cent of that time that leaving it out spares, median and
 *                               quarters
 *
 * falsely_clear: clear without the stage, and not clear with it. bytes: what the stage holds.
 */
#include <stdio.h>
#include <string.h>

#include "daemon/plan_memory.h"
#include "report/lib/asked.h"
#include "report/lib/cost.h"
#include "report/lib/knob.h"
#include "report/lib/scans.h"

#define SCANS       3
#define ASK_EVERY   5 /* pings */
#define SECTORS     72
#define LOOK_M      3.0 /* look_ahead, as shipped */
#define ANSWERS     (SCANS * SEA_BEAMS / ASK_EVERY)
#define COUNT_BEAMS 10
#define REPETITIONS 5

static const char no_socket[] = "no socket"; /* no section: the daemon is told so as it starts */

/* A configuration with the stage and one without it; the plan as shipped has one of the two. */
static const struct stage {
    const char *name;
    enum plan_id id;
    const char *with, *without;
} stages[] = {
    {"image", PLAN_IMAGE, "", no_socket},
    {"map", PLAN_MAP, "[map]\nvoxel = 0.2 m\nmemory = 32 MiB\n", ""},
    {"threads", PLAN_THREADS, "[pipeline]\nthreads = 2\n", ""},
    {"marks", PLAN_MARKS, "", "[extract]\nmarks = off\n"},
    {"elevation", PLAN_ELEVATION, "", "[grid]\nelevation = level\n"},
    {"relaxation", PLAN_RELAXATION, "[grid]\nrelaxation = 0.5\n", ""},
    {"cleanup", PLAN_CLEANUP, "[extract]\nmedian = 3\notsu = on\nclahe = on\nclasses = on\n", ""},
    {"all that may go", PLAN_IDS, "[map]\nvoxel = 0.2 m\nmemory = 32 MiB\n",
     "[extract]\nmarks = off\n[grid]\nelevation = level\n"},
};
#define STAGES (sizeof stages / sizeof stages[0])

struct scans {
    struct answer sector[ANSWERS][SECTORS];
};

static void configure(const char *more, struct conf *conf)
{
    knob_conf(&(struct knob){.name = "plan", .label = "", .more = more == no_socket ? NULL : more}, conf);
    if (more == no_socket)
        snprintf(conf->server.socket, sizeof conf->server.socket, "none");
}

static void ask(struct pipeline *pipeline, const struct conf *conf, uint64_t t_ns, struct answer *sector)
{
    const struct asking asking = {pipeline_picture(pipeline), scans_limits(conf), scans_now(t_ns), asked_near_m()};
    const struct obstacles_query query = {
        .around = true,
        .band = {.lo_rad = geo_rad(-5), .hi_rad = geo_rad(5), .reach_m = LOOK_M, .count = SECTORS}};
    pipeline_drain(pipeline);
    asked_of_pipeline(pipeline, &asking, &query, sector);
}

/* The clean-up's held pings are behind; the sectors are those of what came out. */
static void play(const char *more, const struct sea_scene *scene, struct scans *out)
{
    static struct sea_ping sea;
    struct conf conf;
    configure(more, &conf);
    struct pipeline *pipeline = scans_start(&conf, 1);
    for (unsigned n = 0; n < SCANS * SEA_BEAMS; n++) {
        sea_listen(scene, SOUND_PING360, n / SEA_BEAMS + 1, n % SEA_BEAMS, &sea);
        scans_submit(pipeline, &sea);
        if (n % ASK_EVERY == ASK_EVERY - 1)
            ask(pipeline, &conf, sea.ping.t_ns, out->sector[n / ASK_EVERY]);
    }
    pipeline_free(pipeline);
}

static bool same(const struct answer *a, const struct answer *b)
{
    return a->state == b->state && a->range_m == b->range_m && a->free_to_m == b->free_to_m &&
           a->blind_to_m == b->blind_to_m && a->confidence == b->confidence && a->age_s == b->age_s;
}

static double memory(const char *more)
{
    struct conf conf;
    struct plan plan;
    double bytes[PLAN_STAGES_MAX];
    configure(more, &conf);
    plan_make(&conf, &plan);
    return plan_memory(&plan, &conf, bytes);
}

static bool shipped_has(const struct stage *s)
{
    struct conf conf;
    struct plan plan;
    configure("", &conf);
    plan_make(&conf, &plan);
    return s->id == PLAN_IDS || plan_has(&plan, s->id, 0);
}

static bool must_be_same(enum plan_id id)
{
    return id == PLAN_IMAGE || id == PLAN_MAP || id == PLAN_THREADS;
}

static void proof(unsigned scenes)
{
    static struct scans with, without;
    printf("scene,stage,plan,must_be,sectors,changed,falsely_clear,bytes\n");
    for (size_t k = 0; k < STAGES; k++) {
        const struct stage *s = &stages[k];
        const double bytes = memory(s->with) - memory(s->without);
        unsigned changed = 0, falsely = 0;
        for (unsigned scene = 0; scene <= scenes; scene++) {
            unsigned changed_here = 0, falsely_here = 0;
            if (scene < scenes) {
                play(s->with, &sea_scenes[scene], &with);
                play(s->without, &sea_scenes[scene], &without);
            }
            for (unsigned n = 0; scene < scenes && n < ANSWERS * SECTORS; n++) {
                const struct answer *a = &with.sector[n / SECTORS][n % SECTORS];
                const struct answer *b = &without.sector[n / SECTORS][n % SECTORS];
                changed_here += !same(a, b);
                falsely_here += b->state == ANSWER_CLEAR && a->state != ANSWER_CLEAR;
            }
            changed += changed_here;
            falsely += falsely_here;
            const bool all = scene == scenes;
            printf("%s,%s,%s,%s,%u,%u,%u,%.0f\n", all ? "all" : sea_scenes[scene].name, s->name,
                   shipped_has(s) ? "in" : "out", must_be_same(s->id) ? "same" : "-",
                   ANSWERS * SECTORS * (all ? scenes : 1), all ? changed : changed_here,
                   all ? falsely : falsely_here, bytes);
        }
    }
}

static struct sea_ping some[SEA_MAX_SCENES * COUNT_BEAMS];

static void listen_some(unsigned scenes)
{
    for (unsigned n = 0; n < scenes * COUNT_BEAMS; n++)
        sea_listen(&sea_scenes[n / COUNT_BEAMS], SOUND_PING360, n / COUNT_BEAMS + 1,
                   n % COUNT_BEAMS * SEA_BEAMS / COUNT_BEAMS, &some[n]);
}

/* Those beams of so many scenes from one on through a pipeline of its own. Returns their bins;
 * *ns: until all are done. */
static unsigned run_some(const char *more, unsigned first, unsigned scenes, double *ns)
{
    struct conf conf;
    unsigned bins = 0;
    configure(more, &conf);
    struct pipeline *pipeline = scans_start(&conf, 1);
    *ns = 0;
    for (unsigned n = first * COUNT_BEAMS; n < (first + scenes) * COUNT_BEAMS; n++, bins += SEA_MAX_BINS) {
        const double begin_ns = cost_now_ns();
        scans_submit(pipeline, &some[n]);
        pipeline_drain(pipeline);
        *ns += cost_now_ns() - begin_ns;
    }
    pipeline_free(pipeline);
    return bins;
}

static void cost(unsigned repetitions)
{
    listen_some(sea_scenes_n);
    printf("stage,ns,ns_low,ns_high\n");
    for (size_t k = 0; k < STAGES; k++)
        for (int without = 0; without < 2; without++) {
            double ns[REPETITIONS];
            for (unsigned r = 0; r < repetitions; r++) {
                const unsigned bins =
                    run_some(without ? stages[k].without : stages[k].with, 0, sea_scenes_n, &ns[r]);
                ns[r] /= bins;
            }
            const struct cost_spread spread = cost_spread_of(ns, repetitions);
            printf("%s %s,%.4g,%.4g,%.4g\n", without ? "without" : "with", stages[k].name, spread.median,
                   spread.low, spread.high);
        }
}

/* Threads do the same work elsewhere, where callgrind does not follow: they have the count of none. */
static void count(unsigned scenes)
{
    double ns;
    listen_some(scenes);
    printf("stage,bins\n");
    for (size_t k = 0; k < STAGES; k++)
        for (int without = 0; without < 2; without++) {
            const char *more = stages[k].id == PLAN_THREADS || without ? stages[k].without : stages[k].with;
            printf("%s %s,%u\n", without ? "without" : "with", stages[k].name, run_some(more, 0, scenes, &ns));
            cost_mark();
        }
}

/* Scene by scene; the median is of the ratios, with and without run in turn, so that other load hits both alike. */
static void spared(unsigned scenes, unsigned repetitions)
{
    listen_some(sea_scenes_n);
    printf("scene,stage,spared_percent,low,high\n");
    for (unsigned scene = 0; scene < scenes; scene++)
        for (size_t k = 0; k < STAGES; k++) {
            double percent[REPETITIONS];
            for (unsigned r = 0; r < repetitions; r++) {
                double with_ns, without_ns;
                run_some(stages[k].with, scene, 1, &with_ns);
                run_some(stages[k].without, scene, 1, &without_ns);
                percent[r] = 100.0 * (1.0 - without_ns / with_ns);
            }
            const struct cost_spread spread = cost_spread_of(percent, repetitions);
            printf("%s,%s,%.1f,%.1f,%.1f\n", sea_scenes[scene].name, stages[k].name, spread.median, spread.low,
                   spread.high);
        }
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    const unsigned scenes = quick ? 3 : sea_scenes_n;
    if (strcmp(what, "proof") == 0)
        proof(scenes);
    else if (strcmp(what, "cost") == 0)
        cost(quick ? 1 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count(quick ? 1 : scenes / 2);
    else if (strcmp(what, "spared") == 0)
        spared(scenes, quick ? 1 : REPETITIONS);
    else {
        fprintf(stderr, "usage: report_plan proof|cost|count|spared [quick]\n");
        return 2;
    }
    return 0;
}
