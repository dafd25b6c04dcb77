/* SPDX-License-Identifier: MIT */
/* dive - a virtual sonar's way, truth and sound; see dive.h. */
#include "dive.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/range/background_learn.h"
#include "grid/range/cleanup.h"
#include "grid/range/extract.h"
#include "tests/water/dice.h"

#define UNITS       (6400 / DIVE_TURN)
#define LEARN_SCANS 7
#define LEARN_SEED  1000000
#define RING_DOWN_M 0.45 /* what an installer finds in open water */
#define MASK        64   /* counts, as [background] mask */
#define PING_NS     40000000u

static const struct sea_sound sound = {
    .surface_db = -6, .rough = 0.1, .bounce_db = {-15}, .rays_az = 5, .rays_el = 45, .spread = SOUND_STAGGERED};
static const struct sea_scene noise = {
    .floor_db = -44, .reverb_db = -60, .ring_m = 0.2, .burst_share = 0.02, .frame_m = 0.45};

static void *room(size_t bytes)
{
    void *p = calloc(1, bytes);
    if (!p) {
        fprintf(stderr, "dive: no memory\n");
        exit(1);
    }
    return p;
}

/* ---- the way, and what is there ---- */

static void look_from(struct dive_look *look, const struct place *world, double along, double heading_rad,
                      double tilt_rad)
{
    static const double unit[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int a = 0; a < 3; a++)
        look->at[a] = world->from[a] + along * (world->to[a] - world->from[a]);
    quat_from_rpy(tilt_rad * sin(look->t_s), tilt_rad * cos(0.7 * look->t_s), heading_rad, look->attitude);
    for (int a = 0; a < 3; a++)
        quat_rotate(look->attitude, unit[a], look->axis[a]);
}

static void sound_of(const struct place *world, const struct dive_look *look, float *mean)
{
    const struct ping head = sea_ping_of(SOUND_MICRON);
    double power[SEA_MAX_BINS] = {0};
    sea_surfaces(&sound, world, look->at, look->attitude, look->t_s, &head, power);
    for (uint32_t b = 0; b < head.n_bins; b++)
        mean[b] = (float)power[b];
}

struct dive *dive_make(const struct place *world, unsigned turns, bool back, double tilt_rad, unsigned parts)
{
    struct dive *dive = room(sizeof *dive);
    const size_t way = (size_t)turns * DIVE_TURN;
    dive->world = world;
    dive->n = back ? 2 * way : way;
    dive->look = room(dive->n * sizeof *dive->look);
    dive->mean = parts & DIVE_SOUND ? room(dive->n * sizeof *dive->mean) : NULL;
    for (size_t i = 0; i < dive->n; i++) {
        const double gone = i < way ? (double)i : (double)(2 * way - 1 - i);
        dive->look[i].t_s = (double)i / DIVE_RATE_HZ;
        look_from(&dive->look[i], world, gone / (double)(way - 1), GEO_TURN * (double)(i % DIVE_TURN) / DIVE_TURN,
                  tilt_rad);
        if (parts & DIVE_TRUTH)
            dive->look[i].first_m =
                place_first(world, dive->look[i].at, dive->look[i].axis, geo_rad(DIVE_AZ_DEG / 2),
                            geo_rad(DIVE_EL_DEG / 2), DIVE_RANGE_M, dive->look[i].t_s);
        if (parts & DIVE_SOUND)
            sound_of(world, &dive->look[i], dive->mean[i]);
    }
    return dive;
}

void dive_free(struct dive *dive)
{
    free(dive->look);
    free(dive->mean);
    free(dive);
}

/* ---- what is heard ---- */

struct dive_ears {
    struct extract *extract;
    void *fresh; /* the extractor as it was before its first ping */
    size_t bytes;
    struct background *background;
    bool open_water; /* the template is promised to hold the vehicle alone */
    double gain_db;  /* what the noise is raised by at the end of the range */
    struct cleanup_conf cleanup_conf;
    struct cleanup *cleanup; /* NULL: none is wanted */
    size_t given, heard;     /* pings that went into it, and that came out */
    uint8_t samples[SEA_MAX_BINS], level[SEA_MAX_BINS], blind[SEA_MAX_BINS];
    struct ping_beam axis;
    uint64_t pings;
};

/* Two rods of the frame stand in the way of eight directions each. */
static bool framed(size_t direction)
{
    return (direction >= 20 && direction < 24) || (direction >= 120 && direction < 124);
}

static struct ping listen(struct dive_ears *ears, const float *surfaces, size_t i, uint64_t seed)
{
    struct dice dice = dice_of(seed, i);
    struct ping ping = sea_ping_of(SOUND_MICRON);
    double mean[SEA_MAX_BINS] = {0};
    for (uint32_t b = 0; surfaces && b < ping.n_bins; b++)
        mean[b] = (double)surfaces[b];
    for (uint32_t b = 0; ears->gain_db > 0.0 && b < ping.n_bins; b++) {
        const double r_m = fmax(1.0, (b + 0.5) * (double)ping.dr_m);
        const double rise_db = ears->gain_db * log10(r_m) / log10(DIVE_RANGE_M);
        mean[b] += sound_power(noise.floor_db) * (sound_power(rise_db) - 1.0);
    }
    sea_hear(&noise, SOUND_MICRON, framed(i % DIVE_TURN), &dice, mean, ears->samples);
    ping.t_ns = ++ears->pings * PING_NS;
    ping.seq = (uint32_t)ears->pings;
    ping.head_units = (uint32_t)(i % DIVE_TURN) * UNITS;
    ears->axis.az_rad = (float)(GEO_TURN * (double)(i % DIVE_TURN) / DIVE_TURN);
    ping.beam = &ears->axis;
    ping.samples = ears->samples;
    return ping;
}

static void learn(struct dive_ears *ears)
{
    const struct background_learn_conf conf = {.pings = LEARN_SCANS, .standing = true};
    struct background_shape shape;
    struct ping ping = listen(ears, NULL, 0, LEARN_SEED);
    if (!background_shape_of(&ping, &shape))
        abort();
    struct background_learn *learn =
        background_learn_init(room(background_learn_size(&shape, conf.pings)), &shape, &conf, &mount_identity);
    for (unsigned scan = 0; scan < LEARN_SCANS; scan++)
        for (size_t i = 0; i < DIVE_TURN; i++) {
            ping = listen(ears, NULL, i, LEARN_SEED + scan);
            background_learn_take(learn, &ping);
        }
    ears->background = background_init(room(background_size(&shape)), &shape, MASK);
    background_learn_finish(learn, 1, ears->background);
    free(learn);
}

static void give_up(const struct fault *fault)
{
    fprintf(stderr, "dive: %s\n", fault->text);
    exit(1);
}

static struct extract_conf as_shipped(enum extract_order order)
{
    struct extract_conf conf;
    extract_defaults(&conf);
    conf.ring_down_m = RING_DOWN_M;
    conf.order = order;
    return conf;
}

static struct dive_ears *ears_of(const struct extract_conf *conf, const struct cleanup_conf *cleanup,
                                 bool open_water, double gain_db)
{
    struct dive_ears *ears = room(sizeof *ears);
    struct fault fault;
    ears->cleanup_conf = *cleanup;
    ears->open_water = open_water;
    ears->gain_db = gain_db;
    ears->bytes = extract_size(SEA_MAX_BINS);
    ears->fresh = room(ears->bytes);
    ears->extract = extract_init(room(ears->bytes), conf, SEA_MAX_BINS, &fault);
    if (!ears->extract)
        give_up(&fault);
    memcpy(ears->fresh, ears->extract, ears->bytes);
    learn(ears);
    return ears;
}

struct dive_ears *dive_ears_make(bool open_water)
{
    const struct extract_conf conf = as_shipped(EXTRACT_SAFE);
    return ears_of(&conf, &(struct cleanup_conf){.clip = 2.0}, open_water, 0.0);
}

struct dive_ears *dive_ears_over_mud(double bottom_db)
{
    struct extract_conf conf = as_shipped(EXTRACT_SAFE);
    conf.bottom_db = bottom_db;
    return ears_of(&conf, &(struct cleanup_conf){.clip = 2.0}, true, 0.0);
}

struct dive_ears *dive_ears_of_paper(double gain_db)
{
    static const struct cleanup_conf cleanup = {
        .median = 3, .otsu = true, .clahe = true, .clip = 2.0, .classes = true, .survivors = true};
    const struct extract_conf conf = as_shipped(EXTRACT_PAPER);
    return ears_of(&conf, &cleanup, true, gain_db);
}

void dive_ears_free(struct dive_ears *ears)
{
    free(ears->extract);
    free(ears->fresh);
    free(ears->background);
    free(ears->cleanup);
    free(ears);
}

void dive_begin(struct dive_ears *ears)
{
    memcpy(ears->extract, ears->fresh, ears->bytes);
    ears->pings = 0;
    ears->given = ears->heard = 0;
    if (!cleanup_wanted(&ears->cleanup_conf))
        return;
    struct fault fault;
    free(ears->cleanup);
    ears->cleanup = cleanup_init(room(cleanup_size(&ears->cleanup_conf, SEA_MAX_BINS)), &ears->cleanup_conf,
                                 &mount_identity, SEA_MAX_BINS, &fault);
    if (!ears->cleanup)
        give_up(&fault);
}

/* A ping as it comes, and what the template knows of it. */
static struct ping listen_in(struct dive_ears *ears, const struct dive *dive, size_t i, uint64_t seed, bool *known,
                             bool *any_blind)
{
    const struct background_view view = {.level = ears->level, .blind = ears->blind};
    const struct ping ping = listen(ears, dive->mean[i], i, seed);
    *any_blind = false;
    *known = background_view(ears->background, &ping, &view, any_blind);
    return ping;
}

/* Through the clean-up, which holds pings back: it is given those behind ping i until that one comes out. */
static void hear_cleaned(struct dive_ears *ears, const struct dive *dive, size_t i, uint64_t seed,
                         struct echoes *out)
{
    struct extract_aid aid;
    while (ears->heard <= i && ears->given < dive->n) {
        bool known, any_blind;
        const struct ping ping = listen_in(ears, dive, ears->given++, seed, &known, &any_blind);
        if (!cleanup_put(ears->cleanup, &ping, known ? ears->level : NULL, known && any_blind ? ears->blind : NULL,
                         known && any_blind && ears->open_water ? ears->level : NULL))
            abort();
        for (const struct ping *ready; (ready = cleanup_next(ears->cleanup, &aid)) != NULL; ears->heard++)
            extract_run(ears->extract, ready, &aid, out);
    }
}

void dive_hear(struct dive_ears *ears, const struct dive *dive, size_t i, uint64_t seed, struct beam_echoes *out)
{
    struct echoes echoes = {.max_beams = 1, .beam = out};
    if (ears->cleanup) {
        *out = (struct beam_echoes){.state = BEAM_BLIND};
        hear_cleaned(ears, dive, i, seed, &echoes);
        return;
    }
    bool known, any_blind;
    const struct ping ping = listen_in(ears, dive, i, seed, &known, &any_blind);
    const struct extract_aid aid = {
        .blind = ears->blind, .own = ears->open_water ? ears->level : NULL, .lowest = -1};
    extract_run(ears->extract, &ping, known && any_blind ? &aid : NULL, &echoes);
}
