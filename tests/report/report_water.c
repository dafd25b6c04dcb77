/* SPDX-License-Identifier: MIT */
/*
 * report_water - false-free volume of the voxel map in made-up worlds, and its errors against run time.
 *
 *   report_water false [quick]    CSV: world, ranges, voxel_m, tolerance_voxels, threshold, free_m3, false_free_m3,
 *                                 behind_max_m
 *   report_water errors [quick]   CSV: knob, value, default, scene, seed, and chart_errors' measures
 *   report_water cost [quick]     CSV: knob, value, ns_per_bin, ns_low, ns_high, by ping in place of bin; map_bytes
 *   report_water count            CSV: knob, value, bins (pings), for callgrind to count the instructions of water_run
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lib/chart.h"
#include "lib/cost.h"
#include "lib/dice.h"

#define TURNS       8
#define QUICK_TURNS 2
#define RANGE_SD_M  0.05 /* where ranges are noisy */
#define SEEDS       5
#define REPETITIONS 9
#define COUNT_PINGS 40
#define BODY_M      0.5

/* As [map] ships it: threshold 1, tolerance 0, echoes weighed 2, half the opening entered. */
static const struct chart_setting shipped = {
    .voxel_m = 0.2, .rule = {.threshold = 1, .echo_weight = 2}, .echoes = true, .opening = 0.5};

/* What is free and lies in a solid, by how much of a beam is entered; the first is the paper's, the last `safe`. */
static const struct {
    const char *name;
    double opening;
    uint16_t threshold;
} heard_as[] = {
    {"heard; opening 1", 1, 1},
    {"heard; opening 0.75", 0.75, 1},
    {"heard; as shipped", 0.5, 1},
    {"heard; safe", 0.35, 2},
};

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

static void false_heard(const struct dive *dive, struct dive_ears *ears, const struct chart_setting *set,
                        const char *ranges)
{
    struct chart *c = chart_make(dive->world, set);

    dive_begin(ears);
    for (size_t i = 0; i < dive->n; i++) {
        struct beam_echoes heard;
        dive_hear(ears, dive, i, 1, &heard);
        chart_enter(c, &dive->look[i], dive->look[i].at, &heard);
    }
    false_row(dive, ranges, set, c);
    chart_free(c);
}

static void false_free(bool quick)
{
    struct dive_ears *ears = dive_ears_make();

    printf("world,ranges,voxel_m,tolerance_voxels,threshold,free_m3,false_free_m3,behind_max_m\n");
    for (unsigned w = 0; w < worlds_n; w += quick ? 4 : 1) {
        struct dive *dive = dive_make(&worlds[w], quick ? QUICK_TURNS : TURNS, false, 0, DIVE_TRUTH | DIVE_SOUND);
        false_truth(dive, 0, 0, 0, 0, "true");
        false_truth(dive, 0.5, 0, 0, 0, "true");
        false_truth(dive, 0.866, 0, 0, 0, "true");
        false_truth(dive, 0, 0, RANGE_SD_M, 0, "noisy");
        false_truth(dive, 0, 1, RANGE_SD_M, 0, "noisy");
        false_truth(dive, 0, 0, RANGE_SD_M, -3 * RANGE_SD_M, "noisy less 3 sd");
        for (size_t h = 0; h < sizeof heard_as / sizeof heard_as[0]; h++) {
            struct chart_setting set = shipped;
            set.opening = heard_as[h].opening;
            set.rule.threshold = heard_as[h].threshold;
            false_heard(dive, ears, &set, heard_as[h].name);
        }
        dive_free(dive);
    }
    dive_ears_free(ears);
}

/* ---- error against run time ---- */

enum method { SPANS, VOXEL_TEST, RAYS };
enum knob { VOXEL, TOLERANCE, THRESHOLD, ECHO_WEIGHT, OPENING, CASTING };

static const char *const knob_name[] = {"voxel", "tolerance", "threshold", "echo_weight", "opening", "casting"};

/* Rays: so many voxels apart where the beam ends; the axis alone. */
#define AXIS_ONLY 1e9

static const struct setting {
    enum knob knob;
    const char *label;
    double value;
} settings[] = {
    {VOXEL, "0.05 m", 0.05},
    {VOXEL, "0.1 m", 0.1},
    {VOXEL, "0.2 m", 0.2},
    {VOXEL, "0.4 m", 0.4},
    {TOLERANCE, "0", 0},
    {TOLERANCE, "0.25 voxels", 0.25},
    {TOLERANCE, "0.5 voxels", 0.5},
    {TOLERANCE, "0.866 voxels", 0.866},
    {THRESHOLD, "0", 0},
    {THRESHOLD, "1", 1},
    {THRESHOLD, "2", 2},
    {THRESHOLD, "4", 4},
    {THRESHOLD, "8", 8},
    {ECHO_WEIGHT, "no echoes", -1},
    {ECHO_WEIGHT, "0", 0},
    {ECHO_WEIGHT, "1", 1},
    {ECHO_WEIGHT, "2", 2},
    {ECHO_WEIGHT, "4", 4},
    {OPENING, "1", 1},
    {OPENING, "0.75", 0.75},
    {OPENING, "0.5", 0.5},
    {OPENING, "0.25", 0.25},
    {CASTING, "spans", 0},
    {CASTING, "voxel by voxel", -1},
    {CASTING, "rays 1 voxel apart", 1},
    {CASTING, "rays 2 voxels apart", 2},
    {CASTING, "one ray", AXIS_ONLY},
};
#define SETTINGS (sizeof settings / sizeof settings[0])

/* A chart, how beams get into it, and for rays which voxels the ping has raised already. */
struct water {
    struct chart *chart;
    enum method method;
    double apart_voxels;
    uint32_t *raised, ping; /* [cells of the chart's box] */
};

static struct chart_setting setting_of(const struct setting *s)
{
    struct chart_setting set = shipped;

    set.body_m = BODY_M;
    if (s->knob == VOXEL)
        set.voxel_m = s->value;
    else if (s->knob == TOLERANCE)
        set.tolerance_m = s->value * set.voxel_m;
    else if (s->knob == THRESHOLD)
        set.rule.threshold = (uint16_t)s->value;
    else if (s->knob == OPENING)
        set.opening = s->value;
    else if (s->knob == ECHO_WEIGHT) {
        set.echoes = s->value >= 0;
        set.rule.echo_weight = (uint16_t)fmax(0, s->value);
    }
    return set;
}

static bool is_default(const struct setting *s)
{
    const double standard[] = {
        [VOXEL] = 0.2, [TOLERANCE] = 0, [THRESHOLD] = 1, [ECHO_WEIGHT] = 2, [OPENING] = 0.5, [CASTING] = 0};
    return s->value == standard[s->knob];
}

static struct water water_make(const struct world *world, const struct setting *s)
{
    const struct chart_setting set = setting_of(s);
    struct water w = {.chart = chart_make(world, &set)};
    const int32_t *size = w.chart->box.size;

    if (s->knob == CASTING && s->value != 0) {
        w.method = s->value > 0 ? RAYS : VOXEL_TEST;
        w.apart_voxels = s->value;
        w.raised = calloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2], sizeof *w.raised);
        if (!w.raised)
            exit(1);
    }
    return w;
}

static void water_free(struct water *w)
{
    chart_free(w->chart);
    free(w->raised);
}

/* One voxel, at most once a ping. */
static void raise_cell(struct water *w, const int64_t cell[3])
{
    struct submap *m = &w->chart->map;
    const struct lattice_box *box = &w->chart->box;

    if (!lattice_holds(box, cell))
        return;
    uint32_t *raised =
        &w->raised[((cell[0] - box->first[0]) * box->size[1] + cell[1] - box->first[1]) * box->size[2] + cell[2] -
                   box->first[2]];
    if (*raised == w->ping)
        return;
    *raised = w->ping;
    const uint32_t i = (uint32_t)(cell[0] - m->box.first[0]), j = (uint32_t)(cell[1] - m->box.first[1]);
    uint32_t *tile = &m->tile[i / TILE_SIDE * ((uint32_t)m->box.size[1] / TILE_SIDE) + j / TILE_SIDE];
    if (*tile == TILE_NONE)
        *tile = tiles_take(m->tiles);
    uint8_t *count = tiles_column(m->tiles, *tile, i % TILE_SIDE * TILE_SIDE + j % TILE_SIDE, SUBMAP_VACANCY) +
                     (cell[2] - m->box.first[2]);
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

static void by_rays(struct water *w, const struct dive_look *look, double near_m, double far_m)
{
    const double step_m = w->chart->set.voxel_m / 2, apart_m = w->apart_voxels * w->chart->set.voxel_m;
    const int n_az = (int)ceil(geo_rad(DIVE_AZ_DEG) * far_m / apart_m) + 1;
    const int n_el = (int)ceil(geo_rad(DIVE_EL_DEG) * far_m / apart_m) + 1;
    const bool one = w->apart_voxels == AXIS_ONLY;

    for (int a = 0; a < (one ? 1 : n_az); a++)
        for (int e = 0; e < (one ? 1 : n_el); e++) {
            const double az = one ? 0 : geo_rad(DIVE_AZ_DEG) * (a / (n_az - 1.0) - 0.5);
            const double el = one ? 0 : geo_rad(DIVE_EL_DEG) * (e / (n_el - 1.0) - 0.5);
            double in_beam[3], d[3];
            geo_direction(az, el, in_beam);
            quat_rotate(look->attitude, in_beam, d);
            for (double r = near_m; r <= far_m; r += step_m) {
                const double at[3] = {look->at[0] + r * d[0], look->at[1] + r * d[1], look->at[2] + r * d[2]};
                raise_cell(w, chart_place(w->chart, at).cell);
            }
        }
}

/* What callgrind counts: looks into the map. */
__attribute__((noinline)) static void water_run(struct water *w, const struct dive *dive,
                                                const struct beam_echoes *heard, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        struct beam_echoes rest = heard[i];
        w->ping++;
        if (w->method != SPANS && rest.free_to_m > rest.blind_m) {
            (w->method == RAYS ? by_rays : by_voxel_test)(w, &dive->look[i], (double)rest.blind_m,
                                                          (double)rest.free_to_m);
            rest.free_to_m = 0; /* what is left are the echoes and the body */
        }
        chart_enter(w->chart, &dive->look[i], dive->look[i].at, &rest);
    }
}

/* ---- the worlds that are closed: whatever surface the map has is one of theirs ---- */

static const char *const closed[] = {"box tank", "round tank"};
#define CLOSED (sizeof closed / sizeof closed[0])

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

static void print_errors(const struct setting *s, const char *scene, unsigned seed, const struct chart_errors *e)
{
    printf("%s,%s,%d,%s,%u,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", knob_name[s->knob], s->label,
           is_default(s), scene, seed, e->false_free_m3, e->behind_max_m, 1 - e->found_share, 1 - e->overlap,
           e->to_truth.mean_m, e->to_truth.p95_m, e->to_truth.max_m, e->to_map.mean_m, e->to_map.p95_m,
           e->to_map.max_m);
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

static struct chart *reference_of(const struct dive *dive)
{
    const struct chart_setting set = {.voxel_m = 0.1, .body_m = BODY_M};
    struct chart *c = chart_make(dive->world, &set);

    for (size_t i = 0; i < dive->n; i++)
        chart_enter_truth(c, &dive->look[i], 0);
    return c;
}

static void errors(unsigned seeds, unsigned turns)
{
    static struct chart_errors all[SETTINGS][SEEDS];
    struct dive_ears *ears = dive_ears_make();

    printf("knob,value,default,scene,seed,false_free_m3,behind_max_m,not_found_share,not_common_share,to_truth_"
           "mean_m,"
           "to_truth_p95_m,to_truth_max_m,to_map_mean_m,to_map_p95_m,to_map_max_m\n");
    for (size_t world = 0; world < CLOSED; world++) {
        struct dive *dive = dive_make(world_named(closed[world]), turns, false, 0, DIVE_TRUTH | DIVE_SOUND);
        struct chart *reference = reference_of(dive);
        for (unsigned seed = 0; seed < seeds; seed++) {
            struct beam_echoes *heard = hear_all(dive, ears, seed + 1);
            for (size_t s = 0; s < SETTINGS; s++) {
                struct water w = water_make(dive->world, &settings[s]);
                struct chart_errors e;
                water_run(&w, dive, heard, dive->n);
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
    for (size_t s = 0; s < SETTINGS; s++)
        for (unsigned seed = 0; seed < seeds; seed++)
            print_errors(&settings[s], "all", seed + 1, &all[s][seed]);
    dive_ears_free(ears);
}

/* One turn again and again into a map that has grown. */
static void cost(unsigned repetitions)
{
    struct dive_ears *ears = dive_ears_make();
    struct dive *dive = dive_make(world_named(closed[0]), 2, false, 0, DIVE_SOUND);
    struct beam_echoes *heard = hear_all(dive, ears, 1);

    printf("knob,value,ns_per_bin,ns_low,ns_high,map_bytes\n");
    for (size_t s = 0; s < SETTINGS; s++) {
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
        printf("%s,%s,%.4g,%.4g,%.4g,%zu\n", knob_name[settings[s].knob], settings[s].label, spread.median,
               spread.low, spread.high, w.chart->map.n_tiles * w.chart->tiles.tile_bytes);
        water_free(&w);
    }
    free(heard);
    dive_free(dive);
    dive_ears_free(ears);
}

static void count(void)
{
    struct dive_ears *ears = dive_ears_make();
    struct dive *dive = dive_make(world_named(closed[0]), 1, false, 0, DIVE_SOUND);
    struct beam_echoes *heard = hear_all(dive, ears, 1);

    printf("knob,value,bins\n");
    for (size_t s = 0; s < SETTINGS; s++) {
        struct water w = water_make(dive->world, &settings[s]);
        w.chart->set.body_m = 0; /* it costs the same whatever the knobs are */
        water_run(&w, dive, heard, COUNT_PINGS);
        printf("%s,%s,%d\n", knob_name[settings[s].knob], settings[s].label, COUNT_PINGS);
        cost_mark();
        water_free(&w);
    }
    free(heard);
    dive_free(dive);
    dive_ears_free(ears);
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;

    if (strcmp(what, "false") == 0)
        false_free(quick);
    else if (strcmp(what, "errors") == 0)
        errors(quick ? 1 : SEEDS, quick ? QUICK_TURNS : TURNS);
    else if (strcmp(what, "cost") == 0)
        cost(quick ? 3 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count();
    else {
        fprintf(stderr, "usage: report_water false|errors|cost|count [quick]\n");
        return 2;
    }
    return 0;
}
