/* SPDX-License-Identifier: MIT */
/*
 * report_left_out - what stages of the range extraction cost that a configuration does not ask for, and whether leaving
 * them out changes an answer: every beam of the made-up sea with the stage and without.
 *
 *   report_left_out proof [quick]   CSV: stage, must_be, beams, changed, bytes
 *   report_left_out cost [quick]    CSV: stage, nanoseconds per bin
 *   report_left_out count           CSV: stage, bins, for callgrind to count the instructions of chain_run
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report/lib/chain.h"
#include "report/lib/cost.h"
#include "report/lib/knob.h"

#define SEEDS        3
#define QUICK_SCENES 2
#define COUNT_BEAMS  4
#define REPETITIONS  5

static void as_shipped(struct chain_conf *conf)
{
    (void)conf;
}

static void with_empty_template(struct chain_conf *conf)
{
    conf->background = CHAIN_EMPTY_TEMPLATE;
}

static void with_template(struct chain_conf *conf)
{
    conf->background = CHAIN_TEMPLATE;
}

static void without_contrast(struct chain_conf *conf)
{
    conf->extract.min_contrast_db = 0.0;
}

static void without_floor(struct chain_conf *conf)
{
    conf->extract.floor_counts = 0;
}

static void without_usual_ring_down(struct chain_conf *conf)
{
    conf->extract.learn_ring_down = false;
}

static void with_known_ring_down(struct chain_conf *conf)
{
    conf->extract.ring_down_m = 0.5;
}

static void with_image_unread(struct chain_conf *conf)
{
    conf->cleanup = (struct cleanup_conf){.median = 3, .clahe = true, .clip = 2.0};
}

static void with_classes(struct chain_conf *conf)
{
    conf->cleanup = (struct cleanup_conf){.median = 3, .classes = true, .clip = 2.0};
}

static const struct variant {
    const char *name;
    const char *must; /* be the same: leaving it out is right only then */
    void (*set)(struct chain_conf *conf);
} variants[] = {
    {"as shipped", "same", as_shipped},
    {"with a template that masks nothing", "same", with_empty_template},
    {"with a template of the vehicle", "-", with_template},
    {"with a cleaned image that nobody reads", "same", with_image_unread},
    {"with median and three classes", "-", with_classes},
    {"without min_contrast", "-", without_contrast},
    {"without floor", "-", without_floor},
    {"without the usual ring-down", "-", without_usual_ring_down},
    {"with a configured ring-down", "-", with_known_ring_down},
};
#define VARIANTS (sizeof variants / sizeof variants[0])

static struct chain *chain_of(const struct variant *v)
{
    struct chain_conf conf;
    struct conf shipped;
    knob_conf(NULL, &shipped);
    chain_configure(&shipped, &conf);
    v->set(&conf);
    return chain_make(&conf);
}

static bool same_echo(const struct echo *a, const struct echo *b)
{
    return a->range_m == b->range_m && a->near_m == b->near_m && a->sd_m == b->sd_m &&
           a->strength == b->strength && a->confidence == b->confidence;
}

/* Bit for bit: no tolerance. */
static bool same_answer(const struct beam_echoes *a, const struct beam_echoes *b)
{
    bool same = a->state == b->state && a->n == b->n && a->blind_m == b->blind_m && a->free_to_m == b->free_to_m;
    for (unsigned k = 0; same && k < a->n; k++)
        same = same_echo(&a->echo[k], &b->echo[k]);
    return same;
}

static struct sea_ping scan[SEA_BEAMS];

static void answers(struct chain *chain, const struct sea_scene *scene, enum sound_head head,
                    struct beam_echoes *out)
{
    chain_begin(chain, scene, head);
    for (unsigned b = 0; b < SEA_BEAMS; b++)
        chain_run(chain, &scan[b].ping, out);
    chain_end(chain, out);
}

/* One scan through all variants; changed[v] counts the beams of which variant v says anything else than the first. */
static void proof_of(struct chain *chain[VARIANTS], const struct sea_scene *scene, enum sound_head head,
                     unsigned seed, unsigned changed[VARIANTS])
{
    struct beam_echoes want[SEA_BEAMS], got[SEA_BEAMS];
    for (unsigned b = 0; b < SEA_BEAMS; b++)
        sea_listen(scene, head, seed, b, &scan[b]);
    answers(chain[0], scene, head, want);
    for (size_t v = 0; v < VARIANTS; v++) {
        answers(chain[v], scene, head, got);
        for (unsigned b = 0; b < SEA_BEAMS; b++)
            changed[v] += !same_answer(&want[b], &got[b]);
    }
}

static void proof(unsigned seeds)
{
    struct chain *chain[VARIANTS];
    unsigned changed[VARIANTS] = {0};
    for (size_t v = 0; v < VARIANTS; v++)
        chain[v] = chain_of(&variants[v]);
    for (unsigned seed = 1; seed <= seeds; seed++)
        for (unsigned s = 0; s < sea_scenes_n; s++)
            for (int h = 0; h < SOUND_HEADS; h++)
                proof_of(chain, &sea_scenes[s], (enum sound_head)h, seed, changed);
    printf("stage,must_be,beams,changed,bytes\n");
    for (size_t v = 0; v < VARIANTS; v++) {
        printf("%s,%s,%u,%u,%zu\n", variants[v].name, variants[v].must,
               seeds * sea_scenes_n * SOUND_HEADS * SEA_BEAMS, changed[v], chain_bytes(chain[v]));
        chain_free(chain[v]);
    }
}

static struct sea_ping some[SEA_MAX_SCENES][SOUND_HEADS][COUNT_BEAMS];

static void listen_some(unsigned scenes)
{
    for (unsigned s = 0; s < scenes; s++)
        for (int h = 0; h < SOUND_HEADS; h++)
            for (unsigned b = 0; b < COUNT_BEAMS; b++)
                sea_listen(&sea_scenes[s], (enum sound_head)h, 1, b * SEA_BEAMS / COUNT_BEAMS, &some[s][h][b]);
}

/* Those beams of so many scenes; *ns is what chain_run takes of them. Returns their bins. */
static unsigned run_some(struct chain *chain, unsigned scenes, double *ns)
{
    struct beam_echoes found[SEA_BEAMS];
    unsigned bins = 0;
    *ns = 0;
    for (unsigned s = 0; s < scenes; s++)
        for (int h = 0; h < SOUND_HEADS; h++) {
            chain_begin(chain, &sea_scenes[s], (enum sound_head)h);
            for (unsigned b = 0; b < COUNT_BEAMS; b++) {
                const double begin_ns = cost_now_ns();
                chain_run(chain, &some[s][h][b].ping, found);
                bins += some[s][h][b].ping.n_bins;
                *ns += cost_now_ns() - begin_ns;
            }
        }
    return bins;
}

static void cost(unsigned repetitions)
{
    listen_some(sea_scenes_n);
    printf("stage,ns,ns_low,ns_high\n");
    for (size_t v = 0; v < VARIANTS; v++) {
        struct chain *chain = chain_of(&variants[v]);
        double ns[REPETITIONS];
        for (unsigned r = 0; r < repetitions; r++) {
            const unsigned bins = run_some(chain, sea_scenes_n, &ns[r]);
            ns[r] /= bins;
        }
        const struct cost_spread spread = cost_spread_of(ns, repetitions);
        printf("%s,%.4g,%.4g,%.4g\n", variants[v].name, spread.median, spread.low, spread.high);
        chain_free(chain);
    }
}

static void count(unsigned scenes)
{
    double ns;
    listen_some(scenes);
    printf("stage,bins\n");
    for (size_t v = 0; v < VARIANTS; v++) {
        struct chain *chain = chain_of(&variants[v]);
        printf("%s,%u\n", variants[v].name, run_some(chain, scenes, &ns));
        cost_mark();
        chain_free(chain);
    }
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    if (strcmp(what, "proof") == 0)
        proof(quick ? 1 : SEEDS);
    else if (strcmp(what, "cost") == 0)
        cost(quick ? 1 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count(quick ? QUICK_SCENES : sea_scenes_n);
    else {
        fprintf(stderr, "usage: report_left_out proof|cost|count [quick]\n");
        return 2;
    }
    return 0;
}
