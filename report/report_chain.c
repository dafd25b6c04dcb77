/* SPDX-License-Identifier: MIT */
/*
 * report_chain - the whole chain, from a ping to the answer about a direction, in a made-up sea whose truth is known:
 * scans of a Ping360 through the daemon's own pipeline, for settings turned one by one from the shipped configuration.
 *
 *   report_chain errors [quick]   CSV: KNOB_COLUMNS, scene, seed, errors; scene "all" pools
 *   report_chain cost [quick]     CSV: KNOB_COLUMNS, nanoseconds per ping from the first to the last, all threads done
 *   report_chain count [quick]    CSV: KNOB_COLUMNS, pings, for callgrind to count instructions of pipeline_submit
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "tests/water/scene.h"
#include "report/lib/asked.h"
#include "report/lib/cost.h"
#include "tests/water/dice.h"
#include "report/lib/knob.h"
#include "report/lib/scans.h"

#define SEEDS       8
#define SCANS       2
#define PINGS       (SCANS * SEA_BEAMS)
#define QUESTIONS   100
#define CONE_DEG    2.0  /* half a question's */
#define WITHIN_DEG  14.0 /* of straight ahead: beams reach beyond the cone */
#define EDGE_M      0.15 /* a surface this near to the distance asked about is neither in the way nor out of it */
#define RAYS        5    /* across a question's cone */
#define COST_SCENES 4
#define REPETITIONS 9
#define PING_NS     UINT64_C(50000000)

/* Without the rule for bottoms, which would hide what `target` does. */
#define TARGET(db)                                                                                                \
    {                                                                                                             \
        .name = "target", .section = "extract", .value = (db), .more = "[extract]\nbottom = off\n"                \
    }

static const struct knob settings[] = {
    KNOB_KEY("pipeline", "threads", NULL),
    KNOB_KEY("pipeline", "threads", "1"),
    KNOB_KEY("pipeline", "threads", "2"),
    KNOB_KEY("extract", "detector", NULL),
    KNOB_KEY("extract", "detector", "ca"),
    KNOB_KEY("extract", "detector", "goca"),
    KNOB_KEY("extract", "detector", "os"),
    KNOB_KEY("extract", "no_echo", NULL),
    KNOB_KEY("extract", "no_echo", "minimum"),
    KNOB_KEY("extract", "no_echo", "range"),
    TARGET("0 dB"),
    TARGET("6 dB"),
    TARGET("12 dB"),
    TARGET("15 dB"),
    TARGET("20 dB"),
    TARGET("25 dB"),
    TARGET("30 dB"),
    KNOB_KEY("extract", "bottom", "12 dB"),
    KNOB_KEY("extract", "bottom", NULL),
    KNOB_KEY("extract", "bottom", "20 dB"),
    KNOB_KEY("extract", "bottom", "25 dB"),
    KNOB_KEY("extract", "bottom", "30 dB"),
    KNOB_KEY("extract", "marks", NULL),
    KNOB_KEY("extract", "marks", "off"),
    {.name = "cleanup", .label = "none"},
    {.name = "cleanup", .label = "all", .more = "[extract]\nmedian = 3\notsu = on\nclahe = on\nclasses = on\n"},
    KNOB_KEY("grid", "angular_step", "0.5 deg"),
    KNOB_KEY("grid", "angular_step", "1 deg"),
    KNOB_KEY("grid", "angular_step", NULL),
    KNOB_KEY("grid", "angular_step", "4 deg"),
    KNOB_KEY("grid", "layer", "0.01 m"),
    KNOB_KEY("grid", "layer", NULL),
    KNOB_KEY("grid", "layer", "0.2 m"),
    KNOB_KEY("grid", "sensor_model", NULL),
    KNOB_KEY("grid", "sensor_model", "gauss"),
    KNOB_KEY("grid", "sensor_model", "midpoint"),
    KNOB_KEY("grid", "elevation", NULL),
    KNOB_KEY("grid", "elevation", "level"),
};
#define SETTINGS (sizeof settings / sizeof settings[0])

/* ---- errors ---- */

struct tally {
    unsigned in_way, false_clear; /* questions with a surface in the way; called clear all the same */
    unsigned surfaces,
        behind; /* with a surface in the cone; free water claimed behind it, whatever the distance */
    unsigned open, false_block, unknown; /* with none; called blocked; not known */
    unsigned n;
    double range_m[SEA_MAX_SCENES * QUESTIONS]; /* |error| where rightly blocked */
};

static struct sea_ping pings[PINGS];

static double nearest_of(const struct place *scene, double az_rad)
{
    const struct place_fan fan = {az_rad, 0, geo_rad(CONE_DEG), geo_rad(CONE_DEG), RAYS, RAYS};
    return place_nearest(scene, (const double[3]){0}, &fan, 0);
}

static void ask(struct pipeline *pipeline, const struct conf *conf, const struct place *scene, struct dice *dice,
                struct tally *t)
{
    const struct asking asking = {pipeline_picture(pipeline), scans_limits(conf),
                                  scans_now(pings[PINGS - 1].ping.t_ns), asked_near_m()};
    for (int i = 0; i < QUESTIONS; i++) {
        const double az_rad = geo_rad(WITHIN_DEG) * (2 * dice_uniform(dice) - 1);
        const double distance_m = 0.8 + 8 * dice_uniform(dice);
        const struct obstacles_query q = {
            .line = {.az_rad = geo_wrap(az_rad), .distance_m = distance_m, .half_angle_rad = geo_rad(CONE_DEG)}};
        const double nearest_m = nearest_of(scene, az_rad);
        struct answer a;
        asked_of_pipeline(pipeline, &asking, &q, &a);
        t->surfaces += isfinite(nearest_m) != 0;
        t->behind += a.free_to_m > nearest_m + EDGE_M;
        if (nearest_m < distance_m - EDGE_M) {
            t->in_way++;
            t->false_clear += a.state == ANSWER_CLEAR;
            if (a.state == ANSWER_BLOCKED)
                t->range_m[t->n++] = fabs(a.range_m - nearest_m);
        } else if (nearest_m > distance_m + EDGE_M) {
            t->open++;
            t->false_block += a.state == ANSWER_BLOCKED;
            t->unknown += a.state == ANSWER_UNKNOWN;
        }
    }
}

static void play(const struct knob *s, const struct place *scene, unsigned seed, struct tally *t)
{
    struct dice dice = dice_of(seed, 3);
    struct conf conf;
    knob_conf(s, &conf);
    struct pipeline *pipeline = scans_start(&conf, 1);
    for (unsigned n = 0; n < PINGS; n++)
        scans_submit(pipeline, &pings[n]);
    pipeline_drain(pipeline);
    ask(pipeline, &conf, scene, &dice, t);
    pipeline_free(pipeline);
}

static void print_tally(const struct knob *s, const char *scene, unsigned seed, struct tally *t)
{
    cost_sort(t->range_m, t->n);
    knob_print(s);
    printf(",%s,%u,%u,%u,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", scene, seed, t->in_way, t->false_clear,
           t->false_clear / fmax(t->in_way, 1), t->behind / fmax(t->surfaces, 1),
           t->false_block / fmax(t->open, 1), t->unknown / fmax(t->open, 1), cost_quantile(t->range_m, t->n, 0.5),
           cost_quantile(t->range_m, t->n, 0.95), cost_quantile(t->range_m, t->n, 1));
}

static void add(struct tally *all, const struct tally *one)
{
    all->in_way += one->in_way;
    all->false_clear += one->false_clear;
    all->surfaces += one->surfaces;
    all->behind += one->behind;
    all->open += one->open;
    all->false_block += one->false_block;
    all->unknown += one->unknown;
    memcpy(all->range_m + all->n, one->range_m, one->n * sizeof one->range_m[0]);
    all->n += one->n;
}

static void listen(const struct sea_scene *sea, unsigned seed)
{
    for (unsigned n = 0; n < PINGS; n++)
        sea_listen(sea, SOUND_PING360, seed * SCANS + n / SEA_BEAMS, n % SEA_BEAMS, &pings[n]);
}

static void errors(unsigned seeds, unsigned scenes)
{
    static struct tally all[SETTINGS];
    static struct place shapes;
    struct fault fault;
    printf(KNOB_COLUMNS ",scene,seed,in_way,false_clear,false_clear_share,behind_share,false_block_share,"
                        "unknown_share,range_median_m,range_p95_m,range_max_m\n");
    for (unsigned seed = 1; seed <= seeds; seed++) {
        memset(all, 0, sizeof all);
        for (unsigned k = 0; k < scenes; k++) {
            const struct sea_scene *sea = &sea_scenes[k];
            if (!scene_parse(&shapes, sea->name, sea->shapes, &fault)) {
                fprintf(stderr, "report_chain: %s\n", fault.text);
                exit(1);
            }
            listen(sea, seed);
            for (size_t i = 0; i < SETTINGS; i++) {
                static struct tally one;
                memset(&one, 0, sizeof one);
                play(&settings[i], &shapes, seed, &one);
                add(&all[i], &one);
                print_tally(&settings[i], sea->name, seed, &one);
            }
        }
        for (size_t i = 0; i < SETTINGS; i++)
            print_tally(&settings[i], "all", seed, &all[i]);
    }
}

/* ---- cost ---- */

static struct sea_ping scene_pings[COST_SCENES][SEA_BEAMS];

static void listen_scenes(unsigned scenes)
{
    for (unsigned k = 0; k < scenes; k++)
        for (unsigned b = 0; b < SEA_BEAMS; b++)
            sea_listen(&sea_scenes[k], SOUND_PING360, 1, b, &scene_pings[k][b]);
}

/* A scan of each of so many scenes, at times after all that went in before; *t_ns is the last one's. */
static void run_scenes(struct pipeline *pipeline, unsigned scenes, uint64_t *t_ns)
{
    for (unsigned k = 0; k < scenes; k++)
        for (unsigned b = 0; b < SEA_BEAMS; b++) {
            scene_pings[k][b].ping.t_ns = *t_ns += PING_NS;
            scans_submit(pipeline, &scene_pings[k][b]);
        }
    pipeline_drain(pipeline);
}

static void cost(unsigned repetitions)
{
    listen_scenes(COST_SCENES);
    printf(KNOB_COLUMNS ",ns_per_bin,ns_low,ns_high\n");
    for (size_t i = 0; i < SETTINGS; i++) {
        double ns[REPETITIONS];
        uint64_t t_ns = 0;
        struct conf conf;
        knob_conf(&settings[i], &conf);
        struct pipeline *pipeline = scans_start(&conf, 1);
        run_scenes(pipeline, COST_SCENES, &t_ns); /* to warm up */
        for (unsigned r = 0; r < repetitions; r++) {
            const double begin_ns = cost_now_ns();
            run_scenes(pipeline, COST_SCENES, &t_ns);
            ns[r] = (cost_now_ns() - begin_ns) / (COST_SCENES * SEA_BEAMS);
        }
        pipeline_free(pipeline);
        const struct cost_spread spread = cost_spread_of(ns, repetitions);
        knob_print(&settings[i]);
        printf(",%.4g,%.4g,%.4g\n", spread.median, spread.low, spread.high);
    }
}

/* Threads do the same work elsewhere, where callgrind does not follow: they have the count of none. */
static void count(unsigned scenes)
{
    listen_scenes(scenes);
    printf(KNOB_COLUMNS ",bins\n");
    for (size_t i = 0; i < SETTINGS; i++) {
        struct knob knob = settings[i];
        uint64_t t_ns = 0;
        struct conf conf;
        knob_conf(&knob, &conf);
        if (conf.pipeline.threads > 0)
            knob.beside = "counted without threads";
        conf.pipeline.threads = 0;
        struct pipeline *pipeline = scans_start(&conf, 1);
        run_scenes(pipeline, scenes, &t_ns);
        knob_print(&knob);
        printf(",%u\n", scenes * SEA_BEAMS);
        cost_mark();
        pipeline_free(pipeline);
    }
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    knob_check(settings, SETTINGS);
    if (strcmp(what, "errors") == 0)
        errors(quick ? 1 : SEEDS, quick ? 3 : sea_scenes_n);
    else if (strcmp(what, "cost") == 0)
        cost(quick ? 3 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count(quick ? 1 : COST_SCENES);
    else {
        fprintf(stderr, "usage: report_chain errors|cost|count [quick]\n");
        return 2;
    }
    return 0;
}
