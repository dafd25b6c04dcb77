/* SPDX-License-Identifier: MIT */
/* chain - the stages of a ping; see chain.h. */
#include "chain.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "daemon/wiring.h"
#include "grid/range/background_learn.h"

#define LEARN_SCANS  7
#define PING_NS      50000000u
#define LEARN_SEED   1000
#define TURN_SEED    500
#define MAX_VEHICLES 8
#define NAIVE_M      0.5f

struct chain {
    struct chain_conf conf;
    uint64_t clock_ns;
    size_t bytes;                  /* of one extractor */
    struct extract *extract;       /* NULL: the naive method */
    void *fresh;                   /* the extractor as it was before its first ping */
    struct background *background; /* shared by all chains */
    struct cleanup *cleanup;       /* NULL: none is wanted */
    const struct sea_ping *turn;   /* that it heard at the beginning; pushes out what waits at the end */
    uint8_t level[SEA_MAX_BINS], blind[SEA_MAX_BINS];
};

static void *room(size_t bytes)
{
    void *p = calloc(1, bytes);
    if (!p) {
        fprintf(stderr, "chain: no memory\n");
        exit(1);
    }
    return p;
}

void chain_configure(const struct conf *conf, struct chain_conf *out)
{
    *out = (struct chain_conf){.background = CHAIN_NO_TEMPLATE};
    wiring_extract(conf, 0, &out->extract);
    wiring_cleanup(&conf->extract, &out->cleanup);
}

struct chain *chain_make(const struct chain_conf *conf)
{
    struct chain *chain = room(sizeof *chain);
    struct fault fault;
    chain->conf = *conf;
    if (conf->threshold > 0)
        return chain;
    chain->bytes = extract_size(SEA_MAX_BINS);
    void *mem = room(chain->bytes);
    chain->fresh = room(chain->bytes);
    chain->extract = extract_init(mem, &conf->extract, SEA_MAX_BINS, &fault);
    if (!chain->extract) {
        fprintf(stderr, "chain: %s\n", fault.text);
        exit(1);
    }
    memcpy(chain->fresh, mem, chain->bytes);
    return chain;
}

void chain_free(struct chain *chain)
{
    free(chain->extract);
    free(chain->fresh);
    free(chain->cleanup);
    free(chain);
}

size_t chain_bytes(const struct chain *chain)
{
    return chain->bytes + (chain->background ? background_size(&chain->background->shape) : 0) +
           (chain->cleanup ? cleanup_size(&chain->conf.cleanup, SEA_MAX_BINS) : 0);
}

/* What a vehicle hears of itself: learnt in open water, once for each that rings or is built differently. */
static struct background *learn(const struct sea_scene *vehicle, enum sound_head head)
{
    const struct background_learn_conf conf = {.pings = LEARN_SCANS, .standing = true};
    struct background_shape shape;
    static struct sea_ping sea;
    sea_listen(vehicle, head, LEARN_SEED, 0, &sea);
    if (!background_shape_of(&sea.ping, &shape))
        abort();
    struct background_learn *learn =
        background_learn_init(room(background_learn_size(&shape, conf.pings)), &shape, &conf, &mount_identity);
    for (unsigned scan = 0; scan < LEARN_SCANS; scan++)
        for (unsigned b = 0; b < SEA_BEAMS; b++) {
            sea_listen(vehicle, head, LEARN_SEED + scan, b, &sea);
            background_learn_take(learn, &sea.ping);
        }
    struct background *background = background_init(room(background_size(&shape)), &shape, CHAIN_MASK);
    background_learn_finish(learn, 1, background);
    free(learn);
    return background;
}

static struct background *template_of(const struct sea_scene *scene, enum sound_head head)
{
    static struct {
        double ring_m, frame_m;
        struct background *of[SOUND_HEADS];
    } known[MAX_VEHICLES];
    struct sea_scene vehicle = sea_scenes[0];
    unsigned v = 0;

    while (known[v].of[0] && (known[v].ring_m != scene->ring_m || known[v].frame_m != scene->frame_m))
        if (++v == MAX_VEHICLES)
            abort();
    if (!known[v].of[0]) {
        known[v].ring_m = vehicle.ring_m = scene->ring_m;
        known[v].frame_m = vehicle.frame_m = scene->frame_m;
        for (int h = 0; h < SOUND_HEADS; h++)
            known[v].of[h] = learn(&vehicle, (enum sound_head)h);
    }
    return known[v].of[head];
}

static void first_over_threshold(const struct chain *chain, const struct ping *ping, struct beam_echoes *out)
{
    const uint8_t *samples = ping->samples;
    *out = (struct beam_echoes){
        .state = BEAM_SILENT, .blind_m = NAIVE_M, .free_to_m = (float)chain->conf.extract.minimum_range_m};
    for (uint32_t i = (uint32_t)(NAIVE_M / ping->dr_m); i < ping->n_bins; i++) {
        if (samples[i] < chain->conf.threshold)
            continue;
        out->state = BEAM_ECHO;
        out->n = 1;
        out->free_to_m = (float)i * ping->dr_m;
        out->echo[0] = (struct echo){.range_m = out->free_to_m, .near_m = out->free_to_m};
        return;
    }
}

static void enter(struct chain *chain, const struct ping *ping, const struct extract_aid *aid,
                  struct beam_echoes *found)
{
    struct echoes echoes = {.max_beams = 1, .beam = &found[ping->seq - 1]};
    extract_run(chain->extract, ping, aid, &echoes);
}

static void take(struct chain *chain, const struct ping *heard, struct beam_echoes *found)
{
    struct ping now = *heard, *const ping = &now;
    const struct background_view view = {.level = chain->level, .blind = chain->blind};
    struct extract_aid aid = {.lowest = -1};
    bool known = false, any_blind;
    ping->t_ns = chain->clock_ns += PING_NS; /* whatever scan it is of, it comes after the last one */
    if (!chain->extract) {
        first_over_threshold(chain, ping, &found[ping->seq - 1]);
        return;
    }
    if (chain->background)
        known = background_view(chain->background, ping, &view, &any_blind);
    aid.blind = known ? chain->blind : NULL;
    if (!chain->cleanup) {
        enter(chain, ping, known ? &aid : NULL, found);
        return;
    }
    if (!cleanup_put(chain->cleanup, ping, known ? chain->level : NULL, aid.blind, NULL))
        abort();
    for (const struct ping *ready; (ready = cleanup_next(chain->cleanup, &aid)) != NULL;)
        enter(chain, ready, &aid, found);
}

/* One turn of a scene, which chains hear before they are asked; made once. */
static const struct sea_ping *turn_of(const struct sea_scene *scene, enum sound_head head)
{
    static struct sea_ping *turns[SEA_MAX_SCENES][SOUND_HEADS];
    struct sea_ping **turn = &turns[scene - sea_scenes][head];
    if (!*turn) {
        *turn = room(SEA_BEAMS * sizeof **turn);
        for (unsigned b = 0; b < SEA_BEAMS; b++)
            sea_listen(scene, head, TURN_SEED, b, &(*turn)[b]);
    }
    return *turn;
}

static void begin_cleanup(struct chain *chain)
{
    const struct cleanup_conf *conf = &chain->conf.cleanup;
    struct fault fault;
    free(chain->cleanup);
    chain->cleanup =
        cleanup_init(room(cleanup_size(conf, SEA_MAX_BINS)), conf, &mount_identity, SEA_MAX_BINS, &fault);
    if (!chain->cleanup) {
        fprintf(stderr, "chain: %s\n", fault.text);
        exit(1);
    }
}

void chain_begin(struct chain *chain, const struct sea_scene *scene, enum sound_head head)
{
    struct beam_echoes found[SEA_BEAMS];
    if (chain->extract)
        memcpy(chain->extract, chain->fresh, chain->bytes);
    if (chain->conf.background != CHAIN_NO_TEMPLATE) {
        chain->background = template_of(scene, head);
        chain->background->mask_above = chain->conf.background == CHAIN_TEMPLATE ? CHAIN_MASK : UINT8_MAX;
    }
    if (!chain->extract)
        return;
    if (cleanup_wanted(&chain->conf.cleanup))
        begin_cleanup(chain);
    chain->turn = turn_of(scene, head);
    for (unsigned b = SEA_BEAMS; b-- > 0;)
        take(chain, &chain->turn[b].ping, found);
}

__attribute__((noinline)) void chain_run(struct chain *chain, const struct ping *ping, struct beam_echoes *found)
{
    take(chain, ping, found);
}

void chain_end(struct chain *chain, struct beam_echoes *found)
{
    if (chain->cleanup)
        for (unsigned b = 0; b < cleanup_delay(&chain->conf.cleanup); b++)
            take(chain, &chain->turn[b].ping, found);
}
