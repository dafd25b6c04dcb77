/* SPDX-License-Identifier: MIT */
/*
 * report_extract - error against run time of the range extraction: every knob by itself, over a made-up sea whose
 * truth is known, beside the naive first sample over a fixed threshold.
 *
 *   report_extract errors [quick]   CSV: knob, value, scene, head, seed and the error measures; scene "all" pools
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
#include "report/lib/sea.h"

#define SEEDS        8
#define QUICK_SCENES 2
#define REPETITIONS  9
#define HIT_M        0.3  /* an echo so far off the surface is none of it */
#define DEEP_M       0.25 /* free water so far behind a surface would be driven into */

/* ---- settings ---- */

enum knob {
    DETECTOR,
    WINDOW,
    GUARD,
    FALSE_ALARM,
    MIN_CONTRAST,
    FLOOR,
    RING_DOWN,
    NO_ECHO,
    LAW,
    BACKGROUND,
    CLEANUP,
    THRESHOLD,
    KNOBS,
};

static const char *const knob_name[KNOBS] = {"detector",     "window",     "guard",     "false_alarm",
                                             "min_contrast", "floor",      "ring_down", "no_echo",
                                             "amplitude",    "background", "cleanup",   "fixed_threshold"};

struct setting {
    enum knob knob;
    const char *label;
    double value;
};

static const struct setting settings[] = {
    {DETECTOR, "ca", CFAR_CA},
    {DETECTOR, "goca", CFAR_GOCA},
    {DETECTOR, "soca", CFAR_SOCA},
    {DETECTOR, "os", CFAR_OS},
    {WINDOW, "0.2 m", 0.2},
    {WINDOW, "0.4 m", 0.4},
    {WINDOW, "0.8 m", 0.8},
    {WINDOW, "1.6 m", 1.6},
    {WINDOW, "3.2 m", 3.2},
    {GUARD, "0 m", 0.0},
    {GUARD, "0.05 m", 0.05},
    {GUARD, "0.1 m", 0.1},
    {GUARD, "0.2 m", 0.2},
    {GUARD, "0.4 m", 0.4},
    {FALSE_ALARM, "1e-2", 1e-2},
    {FALSE_ALARM, "1e-3", 1e-3},
    {FALSE_ALARM, "1e-4", 1e-4},
    {FALSE_ALARM, "1e-6", 1e-6},
    {FALSE_ALARM, "1e-8", 1e-8},
    {MIN_CONTRAST, "0 dB", 0.0},
    {MIN_CONTRAST, "8 dB", 8.0},
    {MIN_CONTRAST, "11 dB", 11.0},
    {MIN_CONTRAST, "14 dB", 14.0},
    {MIN_CONTRAST, "17 dB", 17.0},
    {MIN_CONTRAST, "20 dB", 20.0},
    {FLOOR, "1", 1.0},
    {FLOOR, "8", 8.0},
    {FLOOR, "30", 30.0},
    {RING_DOWN, "auto", -1.0},
    {RING_DOWN, "0.5 m", 0.5},
    {RING_DOWN, "1 m", 1.0},
    {NO_ECHO, "minimum", EXTRACT_MINIMUM},
    {NO_ECHO, "heard", EXTRACT_HEARD},
    {NO_ECHO, "range", EXTRACT_RANGE},
    {LAW, "of the ping", EXTRACT_LAW_OF_PING},
    {LAW, "linear", AMPLITUDE_LINEAR},
    {LAW, "power", AMPLITUDE_POWER},
    {BACKGROUND, "none", CHAIN_NO_TEMPLATE},
    {BACKGROUND, "learnt", CHAIN_TEMPLATE},
    {CLEANUP, "none", 0},
    {CLEANUP, "median 3 paper", 1},
    {CLEANUP, "median 5 paper", 2},
    {CLEANUP, "otsu paper", 3},
    {CLEANUP, "clahe paper", 4},
    {CLEANUP, "classes safe", 5},
    {CLEANUP, "median classes safe", 6},
    {CLEANUP, "otsu safe", 9},
    {CLEANUP, "all safe", 7},
    {CLEANUP, "all paper", 8},
    {THRESHOLD, "60 counts", 60.0},
    {THRESHOLD, "90 counts", 90.0},
    {THRESHOLD, "120 counts", 120.0},
    {THRESHOLD, "150 counts", 150.0},
};
#define SETTINGS (sizeof settings / sizeof settings[0])

/* The steps of the image clean-up by themselves and together; CLEANUP's values. */
static const struct {
    struct cleanup_conf conf;
    enum extract_order order;
} cleanups[] = {
    {{.clip = 2.0}, EXTRACT_SAFE},
    {{.clip = 2.0, .median = 3}, EXTRACT_PAPER},
    {{.clip = 2.0, .median = 5}, EXTRACT_PAPER},
    {{.clip = 2.0, .otsu = true}, EXTRACT_PAPER},
    {{.clip = 2.0, .clahe = true}, EXTRACT_PAPER},
    {{.clip = 2.0, .classes = true}, EXTRACT_SAFE},
    {{.clip = 2.0, .median = 3, .classes = true}, EXTRACT_SAFE},
    {{.clip = 2.0, .median = 3, .otsu = true, .clahe = true, .classes = true}, EXTRACT_SAFE},
    {{.clip = 2.0, .median = 3, .otsu = true, .clahe = true, .classes = true, .survivors = true}, EXTRACT_PAPER},
    {{.clip = 2.0, .otsu = true}, EXTRACT_SAFE},
};

/* The value of a knob in a configuration; NAN: the naive method, which has none. */
static double knob_get(const struct chain_conf *conf, enum knob knob)
{
    const struct extract_conf *c = &conf->extract;
    const double value[KNOBS] = {[DETECTOR] = c->detector,
                                 [WINDOW] = c->window_m,
                                 [GUARD] = c->guard_m,
                                 [FALSE_ALARM] = c->false_alarm,
                                 [MIN_CONTRAST] = c->min_contrast_db,
                                 [FLOOR] = c->floor_counts,
                                 [RING_DOWN] = c->ring_down_m,
                                 [NO_ECHO] = c->no_echo,
                                 [LAW] = c->law,
                                 [BACKGROUND] = conf->background,
                                 [CLEANUP] = cleanup_wanted(&conf->cleanup) ? NAN : 0.0,
                                 [THRESHOLD] = NAN};
    return value[knob];
}

static void knob_set(struct chain_conf *conf, enum knob knob, double value)
{
    struct extract_conf *c = &conf->extract;

    switch (knob) {
    case DETECTOR:
        c->detector = (enum cfar_detector)value;
        break;
    case WINDOW:
        c->window_m = value;
        break;
    case GUARD:
        c->guard_m = value;
        break;
    case FALSE_ALARM:
        c->false_alarm = value;
        break;
    case MIN_CONTRAST:
        c->min_contrast_db = value;
        break;
    case FLOOR:
        c->floor_counts = (uint32_t)value;
        break;
    case RING_DOWN:
        c->ring_down_m = value;
        break;
    case NO_ECHO:
        c->no_echo = (enum extract_no_echo)value;
        break;
    case LAW:
        c->law = (int)value;
        break;
    case BACKGROUND:
        conf->background = (enum chain_background)value;
        break;
    case CLEANUP:
        conf->cleanup = cleanups[(size_t)value].conf;
        c->order = cleanups[(size_t)value].order;
        break;
    case THRESHOLD:
        conf->threshold = (int)value;
        break;
    case KNOBS:
        break;
    }
}

static bool is_default(const struct setting *s)
{
    struct chain_conf conf;

    chain_defaults(&conf);
    return knob_get(&conf, s->knob) == s->value;
}

static struct chain *chain_of(const struct setting *s)
{
    struct chain_conf conf;

    chain_defaults(&conf);
    knob_set(&conf, s->knob, s->value);
    return chain_make(&conf);
}

/* ---- errors ---- */

#define MAX_ERRORS (SEA_MAX_SCENES * SEA_HEADS * SEA_BEAMS)

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
    return fmax(0.0, fmax(sea->nearest_m - range_m, range_m - sea->farthest_m));
}

static void tally_add(struct tally *t, const struct sea_ping *sea, const struct beam_echoes *found)
{
    const bool surface = isfinite(sea->nearest_m);
    const double end_m = surface ? sea->nearest_m : (double)sea->ping.dr_m * sea->ping.n_bins;
    const double free_to_m = found->free_to_m > found->blind_m ? (double)found->free_to_m : 0.0;
    const double free_from_m = fmin((double)found->blind_m, free_to_m);
    bool hit = false;

    t->beams++;
    t->water_m += end_m;
    t->claimed_m += fmin(free_to_m, end_m) - fmin(free_from_m, end_m);
    if (found->n > 0 && (double)found->echo[0].range_m < sea->skirt_m - HIT_M)
        t->false_first++;
    if (!surface)
        return;
    t->surfaces++;
    for (unsigned k = 0; k < found->n; k++)
        hit |= off_surface_m(sea, (double)found->echo[k].range_m) <= HIT_M;
    t->missed += !hit;
    if (found->n > 0 && off_surface_m(sea, (double)found->echo[0].range_m) <= HIT_M)
        t->error_m[t->n_errors++] = off_surface_m(sea, (double)found->echo[0].range_m);
    const double behind_m = free_to_m - sea->nearest_m;
    t->behind += behind_m > (double)sea->ping.dr_m;
    t->deep += behind_m > DEEP_M;
    t->behind_max_m = fmax(t->behind_max_m, behind_m);
}

static void tally_print(struct tally *t, const struct setting *s, const char *scene, const char *head,
                        unsigned seed)
{
    const double beams = t->beams, surfaces = fmax(t->surfaces, 1.0);

    cost_sort(t->error_m, t->n_errors);
    printf("%s,%s,%d,%s,%s,%u,%u,%u,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", knob_name[s->knob], s->label,
           is_default(s), scene, head, seed, t->beams, t->surfaces, t->behind / surfaces, t->deep / surfaces,
           t->behind_max_m, t->missed / surfaces, t->false_first / beams,
           cost_quantile(t->error_m, t->n_errors, 0.5), cost_quantile(t->error_m, t->n_errors, 0.95),
           cost_quantile(t->error_m, t->n_errors, 1.0), 1.0 - t->claimed_m / t->water_m);
}

static struct sea_ping sea[SEA_MAX_SCENES][SEA_HEADS][SEA_BEAMS];

static void listen_all(unsigned scenes, unsigned seed, unsigned beams)
{
    for (unsigned s = 0; s < scenes; s++)
        for (int h = 0; h < SEA_HEADS; h++)
            for (unsigned b = 0; b < beams; b++)
                sea_listen(&sea_scenes[s], (enum sea_head)h, seed, b, &sea[s][h][b]);
}

static void errors_of(const struct setting *setting, unsigned seed)
{
    static struct tally one, all;
    struct beam_echoes found[SEA_BEAMS];
    struct chain *chain = chain_of(setting);

    memset(&all, 0, sizeof all);
    for (unsigned s = 0; s < sea_scenes_n; s++)
        for (int h = 0; h < SEA_HEADS; h++) {
            memset(&one, 0, sizeof one);
            chain_begin(chain, &sea_scenes[s], (enum sea_head)h);
            for (unsigned b = 0; b < SEA_BEAMS; b++)
                chain_run(chain, &sea[s][h][b].ping, found);
            chain_end(chain, found);
            for (unsigned b = 0; b < SEA_BEAMS; b++) {
                tally_add(&one, &sea[s][h][b], &found[b]);
                tally_add(&all, &sea[s][h][b], &found[b]);
            }
            tally_print(&one, setting, sea_scenes[s].name, sea_head_name[h], seed);
        }
    tally_print(&all, setting, "all", "all", seed);
    chain_free(chain);
}

static void errors(unsigned seeds)
{
    printf("knob,value,default,scene,head,seed,beams,surfaces,behind_share,deep_share,behind_max_m,missed_share,"
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
        for (int h = 0; h < SEA_HEADS; h++) {
            chain_begin(chain, &sea_scenes[s], (enum sea_head)h);
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
    printf("knob,value,ns_per_bin,ns_low,ns_high\n");
    for (size_t i = 0; i < SETTINGS; i++) {
        struct chain *chain = chain_of(&settings[i]);
        double ns[REPETITIONS] = {0.0};
        const double bins = run_all(chain, sea_scenes_n, beams, repetitions, ns);
        const struct cost_spread spread = cost_spread_of(ns, repetitions);
        printf("%s,%s,%.4g,%.4g,%.4g\n", knob_name[settings[i].knob], settings[i].label, spread.median / bins,
               spread.low / bins, spread.high / bins);
        chain_free(chain);
    }
}

static void count(unsigned scenes)
{
    const unsigned beams = 2;

    listen_all(scenes, 1, beams);
    printf("knob,value,bins\n");
    for (size_t i = 0; i < SETTINGS; i++) {
        struct chain *chain = chain_of(&settings[i]);
        printf("%s,%s,%.0f\n", knob_name[settings[i].knob], settings[i].label,
               run_all(chain, scenes, beams, 1, NULL));
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

    if (strcmp(what, "errors") == 0)
        errors(quick ? 2 : SEEDS);
    else if (strcmp(what, "cost") == 0)
        cost(quick ? 3 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count(quick ? QUICK_SCENES : sea_scenes_n);
    else if (strcmp(what, "scenes") == 0)
        scenes();
    else {
        fprintf(stderr, "usage: report_extract errors|cost|count|scenes [quick]\n");
        return 2;
    }
    return 0;
}
