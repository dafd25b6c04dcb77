/* SPDX-License-Identifier: MIT */
/*
 * report_water - false-free volume of the voxel map in made-up worlds, and its errors against run time.
 *
 *   report_water false [quick]    CSV: world, ranges, voxel_m, tolerance_voxels, threshold, free_m3, false_free_m3,
 *                                 behind_max_m
 *   report_water fresh [FIRST [WORLDS]] [quick]
 *                                 CSV: kind, world, level_db, setting, free_m3, false_free_m3, behind_max_m: so many
 *                                 drawn worlds (12) from that seed (1) on, with the vehicle's body; harbours and shafts
 *                                 in turn. Rules are chosen on other seeds than those of which is told
 *   report_water errors [quick]   CSV: knob, value, default, scene, seed, and chart_errors' measures
 *   report_water maps [quick]     CSV: map, free_iou, missed_share, false_free_m3 (mean of the seeds),
 *                                 false_free_worst_m3
 *   report_water cost [quick]     CSV: knob, value, ns_per_bin, ns_low, ns_high, by ping in place of bin; map_bytes
 *   report_water count            CSV: knob, value, bins (pings), for callgrind to count the instructions of water_run
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report/lib/chart.h"
#include "report/lib/cost.h"
#include "tests/water/dice.h"
#include "report/lib/knob.h"
#include "peer.h"

#define TURNS       8
#define QUICK_TURNS 2
#define RANGE_SD_M  0.05 /* where ranges are noisy */
#define SEEDS       8
#define REPETITIONS 9
#define COUNT_PINGS 40
#define BODY_M      0.5

/* The map as shipped once there is one, and the vehicle's body in it. */
#define MAP_BASE "[map]\nvoxel = 0.2 m\nbody = 0.5 m\n"

/* ... and without the body. */
static struct chart_setting shipped(void)
{
    struct conf conf;
    knob_conf(NULL, &conf);
    conf.map.body_m = 0;
    return chart_setting_of(&conf);
}

/* What is free and lies in a solid, by how much of a beam is entered and how often it must have been found free; the
 * four after what ships are each a setting that tanks do not tell from it. */
static const struct heard_as {
    const char *name;
    double opening;
    uint16_t threshold, echo_weight;
} heard_as[] = {
    {"the paper's", 0, 1, 2},     {"opening 1", 1, 1, 2},     {"as shipped", 0.5, 1, 2},
    {"opening 0.75", 0.75, 1, 2}, {"threshold 0", 0.5, 0, 2}, {"echo_weight 1", 0.5, 1, 1},
    {"echo_weight 0", 0.5, 1, 0}, {"safe", 0.35, 2, 2},
};
#define HEARD_AS (sizeof heard_as / sizeof heard_as[0])

static struct chart_setting set_as(const struct heard_as *as)
{
    struct chart_setting set = shipped();
    set.opening = as->opening;
    set.rule.threshold = as->threshold;
    set.rule.echo_weight = as->echo_weight;
    return set;
}

/* All pings of a dive, as heard. Of the heap. */
static struct beam_echoes *hear_all(const struct dive *dive, struct dive_ears *ears, uint64_t seed)
{
    struct beam_echoes *heard = calloc(dive->n, sizeof *heard);
    if (!heard)
        exit(1);
    dive_begin(ears);
    for (size_t i = 0; i < dive->n; i++)
        dive_hear(ears, dive, i, seed, &heard[i]);
    return heard;
}

/* ---- false free ---- */

static double noise_of(uint64_t seed, size_t i, double sd_m)
{
    struct dice dice = dice_of(seed, i);
    return sqrt(2) * sd_m * creal(dice_normal(&dice));
}

static void false_row(const struct dive *dive, const char *ranges, const struct chart_setting *set,
                      const struct chart *c)
{
    double behind_max_m, free_m3;
    const double wrong_m3 = chart_false_free(c, dive->look[dive->n - 1].t_s, &behind_max_m, &free_m3);
    printf("%s,%s,%.3g,%.3g,%u,%.4g,%.4g,%.3g\n", dive->world->name, ranges, set->voxel_m,
           set->tolerance_m / set->voxel_m, set->rule.threshold, free_m3, wrong_m3, behind_max_m);
}

static void false_truth(const struct dive *dive, double tolerance_voxels, unsigned threshold, double sd_m,
                        double bias_m, const char *ranges)
{
    const struct chart_setting set = {
        .voxel_m = 0.1, .tolerance_m = 0.1 * tolerance_voxels, .rule.threshold = (uint16_t)threshold};
    struct chart *c = chart_make(dive->world, &set);
    for (size_t i = 0; i < dive->n; i++)
        chart_enter_truth(c, &dive->look[i], bias_m + (sd_m > 0 ? noise_of(1, i, sd_m) : 0));
    false_row(dive, ranges, &set, c);
    chart_free(c);
}

static void false_heard(const struct dive *dive, const struct beam_echoes *heard, const struct heard_as *as)
{
    const struct chart_setting set = set_as(as);
    struct chart *c = chart_make(dive->world, &set);
    char name[40];
    snprintf(name, sizeof name, "heard; %s", as->name);
    for (size_t i = 0; i < dive->n; i++)
        chart_enter(c, &dive->look[i], dive->look[i].at, &heard[i]);
    false_row(dive, name, &set, c);
    chart_free(c);
}

static void false_free(bool quick)
{
    struct dive_ears *ears = dive_ears_make(false);
    printf("world,ranges,voxel_m,tolerance_voxels,threshold,free_m3,false_free_m3,behind_max_m\n");
    for (unsigned w = 0; w < places_n; w += quick ? 4 : 1) {
        struct dive *dive = dive_make(&places[w], quick ? QUICK_TURNS : TURNS, false, 0, DIVE_TRUTH | DIVE_SOUND);
        false_truth(dive, 0, 0, 0, 0, "true");
        false_truth(dive, 0.5, 0, 0, 0, "true");
        false_truth(dive, 0.866, 0, 0, 0, "true");
        false_truth(dive, 0, 0, RANGE_SD_M, 0, "noisy");
        false_truth(dive, 0, 1, RANGE_SD_M, 0, "noisy");
        false_truth(dive, 0, 0, RANGE_SD_M, -3 * RANGE_SD_M, "noisy less 3 sd");
        struct beam_echoes *heard = hear_all(dive, ears, 1);
        for (size_t h = 0; h < HEARD_AS; h++)
            false_heard(dive, heard, &heard_as[h]);
        free(heard);
        dive_free(dive);
    }
    dive_ears_free(ears);
}

/* ---- the same in fresh worlds ---- */

#define FRESH       12
#define QUICK_FRESH 2

static const struct heard_as over_mud = {"bottom = 20 dB", 0.5, 1, 2};

static void fresh_row(const struct dive *dive, uint64_t seed, const struct beam_echoes *heard,
                      const struct heard_as *as)
{
    struct chart_setting set = set_as(as);
    double behind_max_m, free_m3;
    set.body_m = BODY_M;
    struct chart *c = chart_make(dive->world, &set);
    for (size_t i = 0; i < dive->n; i++)
        chart_enter(c, &dive->look[i], dive->look[i].at, &heard[i]);
    const double wrong_m3 = chart_false_free(c, 0, &behind_max_m, &free_m3);
    printf("%s,%s %u,%.1f,%s,%.4g,%.4g,%.3g\n", dive->world->name, dive->world->name, (unsigned)seed,
           dive->world->level_db, as->name, free_m3, wrong_m3, behind_max_m);
    chart_free(c);
}

static void fresh(uint64_t first, unsigned count, bool quick)
{
    struct dive_ears *ears = dive_ears_make(true), *mud = dive_ears_over_mud(20);
    printf("kind,world,level_db,setting,free_m3,false_free_m3,behind_max_m\n");
    for (uint64_t seed = first; seed < first + (quick ? QUICK_FRESH : count); seed++) {
        const struct place world = place_drawn(seed);
        struct dive *dive = dive_make(&world, quick ? QUICK_TURNS : TURNS, false, 0, DIVE_SOUND);
        struct beam_echoes *heard = hear_all(dive, ears, seed), *over = hear_all(dive, mud, seed);
        for (size_t as = 0; as < HEARD_AS; as++)
            fresh_row(dive, seed, heard, &heard_as[as]);
        fresh_row(dive, seed, over, &over_mud);
        free(heard);
        free(over);
        dive_free(dive);
    }
    dive_ears_free(ears);
    dive_ears_free(mud);
}

/* ---- error against run time ---- */

enum method { SPANS, VOXEL_TEST, RAYS, PEER };

/* Rays: so many voxels apart where the beam ends; the axis alone. The peer's are one voxel apart, over that share of
 * the beam's height. */
#define AXIS_ONLY 1e9
#define OF_BEAM   -2.0
#define OF_HALF   -2.5

#define CASTING(how, as)                                                                                          \
    {                                                                                                             \
        .name = "casting", .label = (how), .beside = (how), .number = (as)                                        \
    }

static const struct knob settings[] = {
    KNOB_KEY("map", "voxel", "0.05 m"),    KNOB_KEY("map", "voxel", "0.1 m"),
    KNOB_KEY("map", "voxel", NULL),        KNOB_KEY("map", "voxel", "0.4 m"),
    KNOB_KEY("map", "tolerance", NULL),    KNOB_KEY("map", "tolerance", "5 cm"),
    KNOB_KEY("map", "tolerance", "10 cm"), KNOB_KEY("map", "tolerance", "17.32 cm"),
    KNOB_KEY("map", "threshold", "0"),     KNOB_KEY("map", "threshold", NULL),
    KNOB_KEY("map", "threshold", "2"),     KNOB_KEY("map", "threshold", "4"),
    KNOB_KEY("map", "threshold", "8"),     KNOB_KEY("map", "echoes", NULL),
    KNOB_KEY("map", "echoes", "off"),      KNOB_KEY("map", "echo_weight", "0"),
    KNOB_KEY("map", "echo_weight", "1"),   KNOB_KEY("map", "echo_weight", NULL),
    KNOB_KEY("map", "echo_weight", "4"),   KNOB_KEY("map", "opening", "1"),
    KNOB_KEY("map", "opening", "0.75"),    KNOB_KEY("map", "opening", NULL),
    KNOB_KEY("map", "opening", "0.25"),    {.name = "casting", .label = "spans"},
    CASTING("voxel by voxel", -1),         CASTING("rays 1 voxel apart", 1),
    CASTING("rays 2 voxels apart", 2),     CASTING("one ray", AXIS_ONLY),
    CASTING("OctoMap", OF_BEAM),           CASTING("OctoMap of half the beam", OF_HALF),
};
#define SETTINGS (sizeof settings / sizeof settings[0])

/* A chart, how beams get into it, and for rays which voxels the ping has raised already; the peer is copied into it at
 * the end. */
struct water {
    struct chart *chart;
    struct peer *peer;
    enum method method;
    double apart_voxels, opening; /* of rays */
    uint32_t *raised, ping;       /* [cells of the chart's box] */
};

static bool casts(const struct knob *s)
{
    return strcmp(s->name, "casting") == 0;
}

static struct chart_setting setting_of(const struct knob *s)
{
    struct conf conf;
    knob_conf(s, &conf);
    return chart_setting_of(&conf);
}

static struct water water_make(const struct place *world, const struct knob *s)
{
    const struct chart_setting set = setting_of(s);
    struct water w = {.chart = chart_make(world, &set)};
    const int32_t *size = w.chart->box.size;
    if (casts(s) && s->number != 0) {
        w.method = s->number > 0 ? RAYS : s->number > OF_BEAM ? VOXEL_TEST : PEER;
        w.apart_voxels = w.method == RAYS ? s->number : 1;
        w.opening = s->number == OF_HALF ? 0.5 : 1;
        w.peer = w.method == PEER ? peer_make(set.voxel_m) : NULL;
        w.raised = calloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2], sizeof *w.raised);
        if (!w.raised)
            exit(1);
    }
    return w;
}

static void water_free(struct water *w)
{
    peer_free(w->peer);
    chart_free(w->chart);
    free(w->raised);
}

/* The peer has no row, which are the last ones, where its library is not installed. */
static bool is_here(const struct knob *s)
{
    struct peer *peer = casts(s) && s->number <= OF_BEAM ? peer_make(1) : NULL;
    const bool here = !casts(s) || s->number > OF_BEAM || peer;
    peer_free(peer);
    return here;
}

/* One voxel, at most once a ping. */
static void raise_cell(struct water *w, const int64_t cell[3])
{
    const struct lattice_box *box = &w->chart->box;
    if (!lattice_holds(box, cell))
        return;
    uint32_t *raised =
        &w->raised[((cell[0] - box->first[0]) * box->size[1] + cell[1] - box->first[1]) * box->size[2] + cell[2] -
                   box->first[2]];
    if (*raised == w->ping)
        return;
    *raised = w->ping;
    uint8_t *count = chart_count(w->chart, cell, SUBMAP_VACANCY);
    *count = (uint8_t)(*count + (*count < UINT8_MAX));
}

static void by_voxel_test(struct water *w, const struct dive_look *look, double near_m, double far_m)
{
    const struct lattice_place apex = chart_place(w->chart, look->at);
    const int64_t reach = (int64_t)(far_m / w->chart->set.voxel_m) + 2;
    const int64_t high =
        (int64_t)(far_m * sin(geo_rad(DIVE_EL_DEG / 2)) / w->chart->set.voxel_m) + 2; /* level looks */
    struct cast_beam beam;
    int64_t cell[3];

    if (!chart_aim(w->chart, &w->chart->opening, look, look->at, near_m, far_m, &beam))
        return;
    for (cell[0] = apex.cell[0] - reach; cell[0] <= apex.cell[0] + reach; cell[0]++)
        for (cell[1] = apex.cell[1] - reach; cell[1] <= apex.cell[1] + reach; cell[1]++)
            for (cell[2] = apex.cell[2] - high; cell[2] <= apex.cell[2] + high; cell[2]++)
                if (cast_slack(&beam, cell) >= 0)
                    raise_cell(w, cell);
}

/* Directions of rays over a beam, no farther apart than that where it ends. */
#define RAYS_MOST 65536
static size_t rays_of(const struct water *w, const struct dive_look *look, double far_m, double ray[][3])
{
    const double apart_m = w->apart_voxels * w->chart->set.voxel_m;
    const double az_rad = geo_rad(DIVE_AZ_DEG), el_rad = w->opening * geo_rad(DIVE_EL_DEG);
    const int n_az = (int)ceil(az_rad * far_m / apart_m) + 1, n_el = (int)ceil(el_rad * far_m / apart_m) + 1;
    const bool one = w->apart_voxels == AXIS_ONLY;
    size_t n = 0;
    for (int a = 0; a < (one ? 1 : n_az); a++)
        for (int e = 0; e < (one ? 1 : n_el) && n < RAYS_MOST; e++) {
            double in_beam[3];
            geo_direction(one ? 0 : az_rad * (a / (n_az - 1.0) - 0.5), one ? 0 : el_rad * (e / (n_el - 1.0) - 0.5),
                          in_beam);
            quat_rotate(look->attitude, in_beam, ray[n++]);
        }
    return n;
}

static double ray[RAYS_MOST][3];

static void by_rays(struct water *w, const struct dive_look *look, double near_m, double far_m)
{
    const double step_m = w->chart->set.voxel_m / 2;
    const size_t n = rays_of(w, look, far_m, ray);
    for (size_t i = 0; i < n; i++)
        for (double r = near_m; r <= far_m; r += step_m) {
            const double *d = ray[i];
            const double at[3] = {look->at[0] + r * d[0], look->at[1] + r * d[1], look->at[2] + r * d[2]};
            raise_cell(w, chart_place(w->chart, at).cell);
        }
}

/* OctoMap's own way: rays all over the beam, each of which ends at an occupied place where something was heard. */
static void by_peer(struct water *w, const struct dive_look *look, const struct beam_echoes *heard)
{
    static float end[RAYS_MOST][3];
    const double echo_m = heard->n ? (double)heard->echo[0].range_m : INFINITY, free_m = (double)heard->free_to_m;
    const double to_m = heard->n ? echo_m : 2 * free_m; /* beyond its most a ray ends at nothing */
    const size_t n = rays_of(w, look, heard->n ? echo_m : free_m, ray);
    for (size_t i = 0; i < n; i++)
        for (int a = 0; a < 3; a++)
            end[i][a] = (float)(look->at[a] + to_m * ray[i][a]);
    if (to_m > 0)
        peer_enter(w->peer, look->at, (const float(*)[3])end, n, heard->n ? 2 * echo_m : free_m);
}

/* What the peer has free and occupied, as voxels of the chart that surely are. */
static void copy_peer(struct water *w)
{
    const struct lattice_box *box = &w->chart->box;
    int64_t cell[3];
    for (cell[0] = box->first[0]; w->peer && cell[0] < box->first[0] + box->size[0]; cell[0]++)
        for (cell[1] = box->first[1]; cell[1] < box->first[1] + box->size[1]; cell[1]++)
            for (cell[2] = box->first[2]; cell[2] < box->first[2] + box->size[2]; cell[2]++) {
                double at[3];
                chart_center(w->chart, cell, at);
                const enum peer_state state = peer_at(w->peer, at);
                if (state != PEER_UNKNOWN)
                    *chart_count(w->chart, cell, state == PEER_FREE ? SUBMAP_VACANCY : SUBMAP_ECHOES) = UINT8_MAX;
            }
}

/* What callgrind counts: looks into the map. */
__attribute__((noinline)) static void water_run(struct water *w, const struct dive *dive,
                                                const struct beam_echoes *heard, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        struct beam_echoes rest = heard[i];
        w->ping++;
        if (w->method == PEER) {
            by_peer(w, &dive->look[i], &rest);
            rest.n = 0; /* what is left is the body */
            rest.free_to_m = 0;
            rest.off_axis = false;
        }
        if (w->method != SPANS && rest.free_to_m > rest.blind_m) {
            (w->method == RAYS ? by_rays : by_voxel_test)(w, &dive->look[i], (double)rest.blind_m,
                                                          (double)rest.free_to_m);
            rest.free_to_m = 0; /* what is left are the echoes and the body */
            rest.off_axis = false;
        }
        chart_enter(w->chart, &dive->look[i], dive->look[i].at, &rest);
    }
}

/* ---- the worlds that are closed: whatever surface the map has is one of theirs ---- */

static const char *const closed[] = {"box tank", "round tank"};
#define CLOSED (sizeof closed / sizeof closed[0])

static void print_errors(const struct knob *s, const char *scene, unsigned seed, const struct chart_errors *e)
{
    knob_print(s);
    printf(",%s,%u,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", scene, seed, e->false_free_m3,
           e->behind_max_m, 1 - e->found_share, 1 - e->overlap, e->overlap, e->to_truth.mean_m, e->to_truth.p95_m,
           e->to_truth.max_m, e->to_map.mean_m, e->to_map.p95_m, e->to_map.max_m);
}

static void pool_spread(struct surface_spread *all, const struct surface_spread *one)
{
    all->mean_m += one->mean_m / CLOSED;
    all->p95_m += one->p95_m / CLOSED;
    all->max_m = fmax(all->max_m, one->max_m);
}

/* Volumes add up, the worst stays the worst, the rest is the mean. */
static void pool(struct chart_errors *all, const struct chart_errors *e)
{
    all->false_free_m3 += e->false_free_m3;
    all->behind_max_m = fmax(all->behind_max_m, e->behind_max_m);
    all->found_share += e->found_share / CLOSED;
    all->overlap += e->overlap / CLOSED;
    pool_spread(&all->to_truth, &e->to_truth);
    pool_spread(&all->to_map, &e->to_map);
}

/* All that could be known: the water that some look had in sight. */
static struct chart *reference_of(const struct dive *dive)
{
    const struct chart_setting set = {.voxel_m = 0.1, .body_m = BODY_M};
    struct chart *c = chart_make(dive->world, &set);
    for (size_t i = 0; i < dive->n; i++)
        chart_enter_sight(c, &dive->look[i]);
    return c;
}

static void errors(unsigned seeds, unsigned turns)
{
    static struct chart_errors all[SETTINGS][SEEDS];
    struct dive_ears *ears = dive_ears_make(false);
    printf(KNOB_COLUMNS ",scene,seed,false_free_m3,behind_max_m,not_found_share,not_common_share,free_iou,"
                        "to_truth_mean_m,to_truth_p95_m,to_truth_max_m,to_map_mean_m,to_map_p95_m,to_map_max_m\n");
    for (size_t world = 0; world < CLOSED; world++) {
        struct dive *dive = dive_make(place_named(closed[world]), turns, false, 0, DIVE_TRUTH | DIVE_SOUND);
        struct chart *reference = reference_of(dive);
        for (unsigned seed = 0; seed < seeds; seed++) {
            struct beam_echoes *heard = hear_all(dive, ears, seed + 1);
            for (size_t s = 0; s < SETTINGS && is_here(&settings[s]); s++) {
                struct water w = water_make(dive->world, &settings[s]);
                struct chart_errors e;
                water_run(&w, dive, heard, dive->n);
                copy_peer(&w);
                chart_grade(w.chart, reference, 0, &e);
                print_errors(&settings[s], closed[world], seed + 1, &e);
                pool(&all[s][seed], &e);
                water_free(&w);
            }
            free(heard);
        }
        chart_free(reference);
        dive_free(dive);
    }
    for (size_t s = 0; s < SETTINGS && is_here(&settings[s]); s++)
        for (unsigned seed = 0; seed < seeds; seed++)
            print_errors(&settings[s], "all", seed + 1, &all[s][seed]);
    dive_ears_free(ears);
}

/* ---- what the map has of the water, beside other maps ---- */

static const struct map {
    const char *name;
    double opening; /* as chart_setting has it */
    uint16_t threshold;
    bool axis_alone; /* as of sonars that report ranges only */
    bool truth;      /* true first ranges in place of what was heard */
    double peer;     /* OF_BEAM, OF_HALF; 0: it is ours */
} maps[] = {
    {"as shipped", 0.5, 1, false, false, 0},     {"the axis alone", 0.5, 1, true, false, 0},
    {"safe", 0.35, 2, false, false, 0},          {"opening 1", 1, 1, false, false, 0},
    {"true first ranges", 0, 1, false, true, 0}, {"OctoMap of half the beam", 0, 1, false, false, OF_HALF},
    {"OctoMap", 0, 1, false, false, OF_BEAM},
};
#define MAPS (sizeof maps / sizeof maps[0])

static struct chart *our_map(const struct map *map, const struct dive *dive, const struct beam_echoes *heard)
{
    struct chart_setting set = shipped();
    set.body_m = BODY_M;
    set.opening = map->opening;
    set.rule.threshold = map->threshold;
    struct chart *c = chart_make(dive->world, &set);

    for (size_t i = 0; i < dive->n; i++) {
        struct beam_echoes beam = heard[i];
        beam.off_axis &= !map->axis_alone;
        if (map->truth)
            chart_enter_truth(c, &dive->look[i], 0);
        else
            chart_enter(c, &dive->look[i], dive->look[i].at, &beam);
    }
    return c;
}

static void grade_map(const struct map *map, const struct dive *dive, const struct beam_echoes *heard,
                      const struct chart *reference, struct chart_errors *all)
{
    struct chart_errors e;
    if (map->peer < 0) {
        struct water w = water_make(dive->world, &(struct knob)CASTING(map->name, map->peer));
        water_run(&w, dive, heard, dive->n);
        copy_peer(&w);
        chart_grade(w.chart, reference, 0, &e);
        water_free(&w);
    } else {
        struct chart *c = our_map(map, dive, heard);
        chart_grade(c, reference, 0, &e);
        chart_free(c);
    }
    pool(all, &e);
}

static void print_map(const struct map *map, const struct chart_errors all[], unsigned seeds)
{
    double iou = 0, found = 0, wrong_m3 = 0, worst_m3 = 0;
    for (unsigned seed = 0; seed < seeds; seed++) {
        iou += all[seed].overlap / seeds;
        found += all[seed].found_share / seeds;
        wrong_m3 += all[seed].false_free_m3 / seeds;
        worst_m3 = fmax(worst_m3, all[seed].false_free_m3);
    }
    printf("%s,%.4g,%.4g,%.4g,%.4g\n", map->name, iou, 1 - found, wrong_m3, worst_m3);
}

static void compare_maps(unsigned seeds, unsigned turns)
{
    static struct chart_errors all[MAPS][SEEDS];
    struct dive_ears *ears = dive_ears_make(false);
    const size_t n =
        is_here(&settings[SETTINGS - 1]) ? MAPS : MAPS - 2; /* the peer's are the last in either list */

    for (size_t world = 0; world < CLOSED; world++) {
        struct dive *dive = dive_make(place_named(closed[world]), turns, false, 0, DIVE_TRUTH | DIVE_SOUND);
        struct chart *reference = reference_of(dive);
        for (unsigned seed = 0; seed < seeds; seed++) {
            struct beam_echoes *heard = hear_all(dive, ears, seed + 1);
            for (size_t m = 0; m < n; m++)
                grade_map(&maps[m], dive, heard, reference, &all[m][seed]);
            free(heard);
        }
        chart_free(reference);
        dive_free(dive);
    }
    printf("map,free_iou,missed_share,false_free_m3,false_free_worst_m3\n");
    for (size_t m = 0; m < n; m++)
        print_map(&maps[m], all[m], seeds);
    dive_ears_free(ears);
}

/* ---- cost ---- */

/* One turn again and again into a map that has grown. */
static void cost(unsigned repetitions)
{
    struct dive_ears *ears = dive_ears_make(false);
    struct dive *dive = dive_make(place_named(closed[0]), 2, false, 0, DIVE_SOUND);
    struct beam_echoes *heard = hear_all(dive, ears, 1);
    printf(KNOB_COLUMNS ",ns_per_bin,ns_low,ns_high,map_bytes\n");
    for (size_t s = 0; s < SETTINGS && is_here(&settings[s]); s++) {
        struct water w = water_make(dive->world, &settings[s]);
        w.chart->set.body_m = 0; /* it costs the same whatever the knobs are */
        double ns[REPETITIONS];
        water_run(&w, dive, heard, dive->n);
        for (unsigned r = 0; r < repetitions; r++) {
            const double begin_ns = cost_now_ns();
            water_run(&w, dive, heard, dive->n);
            ns[r] = (cost_now_ns() - begin_ns) / (double)dive->n;
        }
        const struct cost_spread spread = cost_spread_of(ns, repetitions);
        knob_print(&settings[s]);
        printf(",%.4g,%.4g,%.4g,%zu\n", spread.median, spread.low, spread.high,
               w.peer ? peer_bytes(w.peer) : w.chart->map.n_tiles * w.chart->tiles.tile_bytes);
        water_free(&w);
    }
    free(heard);
    dive_free(dive);
    dive_ears_free(ears);
}

static void count(void)
{
    struct dive_ears *ears = dive_ears_make(false);
    struct dive *dive = dive_make(place_named(closed[0]), 1, false, 0, DIVE_SOUND);
    struct beam_echoes *heard = hear_all(dive, ears, 1);
    printf(KNOB_COLUMNS ",bins\n");
    for (size_t s = 0; s < SETTINGS && is_here(&settings[s]); s++) {
        struct water w = water_make(dive->world, &settings[s]);
        w.chart->set.body_m = 0; /* it costs the same whatever the knobs are */
        water_run(&w, dive, heard, COUNT_PINGS);
        knob_print(&settings[s]);
        printf(",%d\n", COUNT_PINGS);
        cost_mark();
        water_free(&w);
    }
    free(heard);
    dive_free(dive);
    dive_ears_free(ears);
}

/* An argument that may not be there; the last one may be a word. */
static uint64_t number(int argc, char **argv, int at, uint64_t without)
{
    const uint64_t given = argc > at ? strtoull(argv[at], NULL, 10) : 0;
    return given > 0 ? given : without;
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[argc - 1], "quick") == 0;
    knob_base(MAP_BASE);
    knob_check(settings, SETTINGS);
    if (strcmp(what, "false") == 0)
        false_free(quick);
    else if (strcmp(what, "fresh") == 0)
        fresh(number(argc, argv, 2, 1), (unsigned)number(argc, argv, 3, FRESH), quick);
    else if (strcmp(what, "errors") == 0)
        errors(quick ? 1 : SEEDS, quick ? QUICK_TURNS : TURNS);
    else if (strcmp(what, "maps") == 0)
        compare_maps(quick ? 1 : SEEDS, quick ? QUICK_TURNS : TURNS);
    else if (strcmp(what, "cost") == 0)
        cost(quick ? 3 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count();
    else {
        fprintf(stderr, "usage: report_water false|fresh [FIRST [WORLDS]]|errors|maps|cost|count [quick]\n");
        return 2;
    }
    return 0;
}
