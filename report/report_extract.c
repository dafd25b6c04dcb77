/* SPDX-License-Identifier: MIT */
/*
 * report_extract - error against run time of the range extraction: every knob by itself, over a made-up sea whose
 * truth is known, beside the naive first sample over a fixed threshold.
 *
 *   report_extract errors [quick]   CSV: KNOB_COLUMNS, scene, head, seed and the error measures; scene "all" pools
 *   report_extract cost [quick]     CSV: nanoseconds per bin
 *   report_extract scenes           CSV: what the scenes are
 *   report_extract count            CSV: bins per setting, for callgrind to count the instructions of chain_run
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report/lib/chain.h"
#include "report/lib/cost.h"
#include "report/lib/knob.h"
#include "tests/sound/sea.h"

#define SEEDS        8
#define QUICK_SCENES 1
#define COUNT_SCENES 8
#define REPETITIONS  9
#define HIT_M        0.3  /* an echo so far off the surface is none of it */
#define DEEP_M       0.25 /* free water so far behind a surface would be driven into */

/* ---- settings ---- */

/* The steps of the image clean-up, by themselves and together. */
#define CLEANUP(of, lines)                                                                                        \
    {                                                                                                             \
        .name = "cleanup", .label = (of), .more = "[extract]\n" lines                                             \
    }
/* The naive method: the first sample of so many counts behind half a metre. */
#define THRESHOLD(counts)                                                                                         \
    {                                                                                                             \
        .name = "fixed_threshold", .label = #counts " counts", .beside = "first sample of " #counts " counts",    \
        .number = (counts)                                                                                        \
    }

static const struct knob settings[] = {
    KNOB_KEY("extract", "detector", "ca"),
    KNOB_KEY("extract", "detector", "goca"),
    KNOB_KEY("extract", "detector", NULL),
    KNOB_KEY("extract", "detector", "os"),
    KNOB_KEY("extract", "window", "0.2 m"),
    KNOB_KEY("extract", "window", NULL),
    KNOB_KEY("extract", "window", "0.8 m"),
    KNOB_KEY("extract", "window", "1.6 m"),
    KNOB_KEY("extract", "window", "3.2 m"),
    KNOB_KEY("extract", "guard", "0 m"),
    KNOB_KEY("extract", "guard", "0.05 m"),
    KNOB_KEY("extract", "guard", NULL),
    KNOB_KEY("extract", "guard", "0.2 m"),
    KNOB_KEY("extract", "guard", "0.3 m"),
    KNOB_KEY("extract", "false_alarm", "1e-2"),
    KNOB_KEY("extract", "false_alarm", NULL),
    KNOB_KEY("extract", "false_alarm", "1e-4"),
    KNOB_KEY("extract", "false_alarm", "1e-6"),
    KNOB_KEY("extract", "false_alarm", "1e-8"),
    KNOB_KEY("extract", "min_contrast", "0 dB"),
    KNOB_KEY("extract", "min_contrast", "8 dB"),
    KNOB_KEY("extract", "min_contrast", "11 dB"),
    KNOB_KEY("extract", "min_contrast", NULL),
    KNOB_KEY("extract", "min_contrast", "17 dB"),
    KNOB_KEY("extract", "min_contrast", "20 dB"),
    KNOB_KEY("extract", "floor", "1"),
    KNOB_KEY("extract", "floor", NULL),
    KNOB_KEY("extract", "floor", "30"),
    KNOB_KEY("sonar", "ring_down", NULL),
    KNOB_KEY("sonar", "ring_down", "0.5 m"),
    KNOB_KEY("sonar", "ring_down", "1 m"),
    KNOB_KEY("extract", "no_echo", NULL),
    KNOB_KEY("extract", "no_echo", "minimum"),
    KNOB_KEY("extract", "no_echo", "range"),
    KNOB_KEY("sonar", "amplitude", NULL),
    KNOB_KEY("sonar", "amplitude", "linear"),
    KNOB_KEY("sonar", "amplitude", "power"),
    {.name = "background", .label = "none"},
    {.name = "background", .label = "learnt", .beside = "template learnt in open water", .number = CHAIN_TEMPLATE},
    {.name = "cleanup", .label = "none"},
    CLEANUP("median 3 paper", "order = paper\nmedian = 3\n"),
    CLEANUP("median 5 paper", "order = paper\nmedian = 5\n"),
    CLEANUP("otsu paper", "order = paper\notsu = on\n"),
    CLEANUP("clahe paper", "order = paper\nclahe = on\n"),
    CLEANUP("classes safe", "classes = on\n"),
    CLEANUP("median classes safe", "median = 3\nclasses = on\n"),
    CLEANUP("otsu safe", "otsu = on\n"),
    CLEANUP("all safe", "median = 3\notsu = on\nclahe = on\nclasses = on\n"),
    CLEANUP("all paper", "order = paper\nmedian = 3\notsu = on\nclahe = on\nclasses = on\n"),
    THRESHOLD(60),
    THRESHOLD(90),
    THRESHOLD(120),
    THRESHOLD(150),
};
#define SETTINGS (sizeof settings / sizeof settings[0])

static struct chain *chain_of(const struct knob *s)
{
    struct chain_conf chain;
    struct conf conf;
    knob_conf(s, &conf);
    chain_configure(&conf, &chain);
    if (strcmp(s->name, "fixed_threshold") == 0)
        chain.threshold = (int)s->number;
    if (strcmp(s->name, "background") == 0)
        chain.background = (enum chain_background)s->number;
    return chain_make(&chain);
}

/* ---- errors ---- */

#define MAX_ERRORS (SEA_MAX_SCENES * SOUND_HEADS * SEA_BEAMS)

struct tally {
    unsigned beams, surfaces; /* with and without a surface; with */
    unsigned false_first, missed, behind, deep;
    double behind_max_m, water_m, claimed_m;
    unsigned n_errors;
    double error_m[MAX_ERRORS]; /* of first echoes that are the surface's */
};

/* How far a range lies off the stretch in which the beam meets the surface. */
static double off_surface_m(const struct sea_ping *sea, double range_m)
{
    return fmax(0.0, fmax(sea->met.nearest_m - range_m, range_m - sea->met.farthest_m));
}

static void tally_add(struct tally *t, const struct sea_ping *sea, const struct beam_echoes *found)
{
    const bool surface = isfinite(sea->met.nearest_m);
    const double end_m = surface ? sea->met.nearest_m : (double)sea->ping.dr_m * sea->ping.n_bins;
    const double free_to_m = found->free_to_m > found->blind_m ? (double)found->free_to_m : 0.0;
    const double free_from_m = fmin((double)found->blind_m, free_to_m);
    bool hit = false;
    t->beams++;
    t->water_m += end_m;
    t->claimed_m += fmin(free_to_m, end_m) - fmin(free_from_m, end_m);
    if (found->n > 0 && (double)found->echo[0].range_m < sea->met.skirt_m - HIT_M)
        t->false_first++;
    if (!surface)
        return;
    t->surfaces++;
    for (unsigned k = 0; k < found->n; k++)
        hit |= off_surface_m(sea, (double)found->echo[k].range_m) <= HIT_M;
    t->missed += !hit;
    if (found->n > 0 && off_surface_m(sea, (double)found->echo[0].range_m) <= HIT_M)
        t->error_m[t->n_errors++] = off_surface_m(sea, (double)found->echo[0].range_m);
    const double behind_m = free_to_m - sea->met.nearest_m;
    t->behind += behind_m > (double)sea->ping.dr_m;
    t->deep += behind_m > DEEP_M;
    t->behind_max_m = fmax(t->behind_max_m, behind_m);
}

static void tally_print(struct tally *t, const struct knob *s, const char *scene, const char *head, unsigned seed)
{
    const double beams = t->beams, surfaces = fmax(t->surfaces, 1.0);
    cost_sort(t->error_m, t->n_errors);
    knob_print(s);
    printf(",%s,%s,%u,%u,%u,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", scene, head, seed, t->beams,
           t->surfaces, t->behind / surfaces, t->deep / surfaces, t->behind_max_m, t->missed / surfaces,
           t->false_first / beams, cost_quantile(t->error_m, t->n_errors, 0.5),
           cost_quantile(t->error_m, t->n_errors, 0.95), cost_quantile(t->error_m, t->n_errors, 1.0),
           1.0 - t->claimed_m / t->water_m);
}

static struct sea_ping sea[SEA_MAX_SCENES][SOUND_HEADS][SEA_BEAMS];

static void listen_all(unsigned scenes, unsigned seed, unsigned beams)
{
    for (unsigned s = 0; s < scenes; s++)
        for (int h = 0; h < SOUND_HEADS; h++)
            for (unsigned b = 0; b < beams; b++)
                sea_listen(&sea_scenes[s], (enum sound_head)h, seed, b, &sea[s][h][b]);
}

static void errors_of(const struct knob *setting, unsigned seed)
{
    static struct tally one, all;
    struct beam_echoes found[SEA_BEAMS];
    struct chain *chain = chain_of(setting);
    memset(&all, 0, sizeof all);
    for (unsigned s = 0; s < sea_scenes_n; s++)
        for (int h = 0; h < SOUND_HEADS; h++) {
            memset(&one, 0, sizeof one);
            chain_begin(chain, &sea_scenes[s], (enum sound_head)h);
            for (unsigned b = 0; b < SEA_BEAMS; b++)
                chain_run(chain, &sea[s][h][b].ping, found);
            chain_end(chain, found);
            for (unsigned b = 0; b < SEA_BEAMS; b++) {
                tally_add(&one, &sea[s][h][b], &found[b]);
                tally_add(&all, &sea[s][h][b], &found[b]);
            }
            tally_print(&one, setting, sea_scenes[s].name, sound_heads[h].name, seed);
        }
    tally_print(&all, setting, "all", "all", seed);
    chain_free(chain);
}

static void errors(unsigned seeds)
{
    printf(KNOB_COLUMNS ",scene,head,seed,beams,surfaces,behind_share,deep_share,behind_max_m,missed_share,"
                        "false_share,range_median_m,range_p95_m,range_max_m,unclaimed_share\n");
    for (unsigned seed = 1; seed <= seeds; seed++) {
        listen_all(sea_scenes_n, seed, SEA_BEAMS);
        for (size_t i = 0; i < SETTINGS; i++)
            errors_of(&settings[i], seed);
        fprintf(stderr, "seed %u of %u\n", seed, seeds);
    }
}

/* ---- cost ---- */

/* The first `beams` beams of so many scenes `repetitions` times; ns[] per bin, may be NULL.
 * Returns the bins of one time. */
static double run_all(struct chain *chain, unsigned scenes, unsigned beams, unsigned repetitions, double *ns)
{
    struct beam_echoes found[SEA_BEAMS];
    double bins = 0.0;
    for (unsigned s = 0; s < scenes; s++)
        for (int h = 0; h < SOUND_HEADS; h++) {
            chain_begin(chain, &sea_scenes[s], (enum sound_head)h);
            for (unsigned r = 0; r < repetitions; r++) {
                const double begin_ns = cost_now_ns();
                for (unsigned b = 0; b < beams; b++)
                    chain_run(chain, &sea[s][h][b].ping, found);
                if (ns)
                    ns[r] += cost_now_ns() - begin_ns;
            }
            bins += (double)beams * sea[s][h][0].ping.n_bins;
        }
    return bins;
}

static void cost(unsigned repetitions)
{
    const unsigned beams = 10;
    listen_all(sea_scenes_n, 1, beams);
    printf(KNOB_COLUMNS ",ns_per_bin,ns_low,ns_high\n");
    for (size_t i = 0; i < SETTINGS; i++) {
        struct chain *chain = chain_of(&settings[i]);
        double ns[REPETITIONS] = {0.0};
        const double bins = run_all(chain, sea_scenes_n, beams, repetitions, ns);
        const struct cost_spread spread = cost_spread_of(ns, repetitions);
        knob_print(&settings[i]);
        printf(",%.4g,%.4g,%.4g\n", spread.median / bins, spread.low / bins, spread.high / bins);
        chain_free(chain);
    }
}

static void count(unsigned scenes)
{
    const unsigned beams = 2;
    listen_all(scenes, 1, beams);
    printf(KNOB_COLUMNS ",bins\n");
    for (size_t i = 0; i < SETTINGS; i++) {
        struct chain *chain = chain_of(&settings[i]);
        knob_print(&settings[i]);
        printf(",%.0f\n", run_all(chain, scenes, beams, 1, NULL));
        cost_mark();
        chain_free(chain);
    }
}

static void scenes(void)
{
    printf("scene,what\n");
    for (unsigned s = 0; s < sea_scenes_n; s++)
        printf("%s,\"%s\"\n", sea_scenes[s].name, sea_scenes[s].what);
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    knob_check(settings, SETTINGS);
    if (strcmp(what, "errors") == 0)
        errors(quick ? 2 : SEEDS);
    else if (strcmp(what, "cost") == 0)
        cost(quick ? 3 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count(quick ? QUICK_SCENES : COUNT_SCENES);
    else if (strcmp(what, "scenes") == 0)
        scenes();
    else {
        fprintf(stderr, "usage: report_extract errors|cost|count|scenes [quick]\n");
        return 2;
    }
    return 0;
}
