/* SPDX-License-Identifier: MIT */
/*
 * report_shaft - Table I of Oliveira, Ferreira and Cruz 2023 rebuilt: one dive through a virtual dam shaft and back,
 * heard, extracted, mapped, and the shaft's dimensions read from the map.
 *
 *   report_shaft table [quick]    CSV: seed, dimension, true_m, paper_m, paper_percent, found_m, percent,
 *                                 worst_percent; seed "median" is over all seeds
 *   report_shaft settings [quick] CSV: part, setting, dimension, true_m, paper_percent, percent, worst_percent,
 *                                 none_share, short_m, beyond_share, beyond_max_m: the table in four settings (median,
 *                                 worst seed), and of each the chamber's ceiling over all of its plan (means; the
 *                                 worst)
 *   report_shaft fresh [quick]    CSV: world, setting, dimension, percent, false_free_m3: length and width of drawn
 *                                 shafts that no rule or setting was chosen on, dived in the same way
 *   report_shaft paper [quick]    the same as table with the paper's own clean-up and order in place of what ships
 *   report_shaft gain [quick]     the same where the receiver's gain raises the noise by 20 dB up to the end of the
 *                                 range
 *   report_shaft slices [quick]   CSV: figure, cut, level, and the edges of rectangles of voxels in two vertical cuts
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report/lib/chart.h"
#include "report/lib/knob.h"
#include "report/lib/cost.h"
#include "tests/water/dice.h"

#define SEEDS       10
#define QUICK_SEEDS 2
#define GAIN_DB     20.0
#define TURNS       107 /* down, and as many up: 0.3 m a turn */
#define QUICK_TURNS 4
#define MAX_ROWS    20000

/* Of the depth that the virtual sensor says: its scale (salt, temperature) and offset, per dive; its noise and step,
 * per ping. */
#define DEPTH_SCALE_SD 0.002
#define DEPTH_OFFSET_M 0.05
#define DEPTH_SD_M     0.01
#define DEPTH_STEP_M   0.01

static const struct chart_setting fine = {.voxel_m = 0.05, .rule = {.threshold = 1}, .body_m = 0.5};

/* How a dimension is read: the free voxels in a row, without a gap; of the rows
 * near the vehicle's way (beside it, for the height), of those lengths the mean of the middle half. */
static const struct dimension {
    const char *name;
    double true_m, paper_m;
    int axis;
    double low[3], high[3]; /* the rows; along the axis, where they begin */
} dimensions[] = {
    {"chamber height", 27, 26.1, 2, {0.4, -1, 13}, {1.4, 1, 13}},
    {"chamber entry length", 9, 8.8, 0, {2.25, -1, 2}, {2.25, 1, 11}},
    {"chamber width", 5, 5.6, 1, {1.25, 0, 2}, {3.25, 0, 11}},
    {"connection duct width", 1.5, 1.4, 0, {2.25, -0.5, 27.5}, {2.25, 0.5, 29.5}},
};
#define DIMENSIONS (sizeof dimensions / sizeof dimensions[0])

/* Free voxels in a row from one of them on, times their edge. */
static double free_along(const struct chart *c, const double from[3], int axis, int step)
{
    struct lattice_place at = chart_place(c, from);
    double length_m = 0;
    for (; chart_cell(c, at.cell) == VOXEL_FREE; at.cell[axis] += step)
        length_m += c->set.voxel_m;
    return length_m;
}

static double measure(const struct chart *c, const struct dimension *d)
{
    static double length_m[MAX_ROWS];
    const int u = (d->axis + 1) % 3, v = (d->axis + 2) % 3;
    const double h = c->set.voxel_m;
    double sum = 0;
    unsigned n = 0;
    for (double p = d->low[u]; p <= d->high[u]; p += h)
        for (double q = d->low[v]; q <= d->high[v] && n < MAX_ROWS; q += h) {
            double at[3];
            at[d->axis] = d->low[d->axis];
            at[u] = p;
            at[v] = q;
            length_m[n++] = free_along(c, at, d->axis, 1) + fmax(0, free_along(c, at, d->axis, -1) - h);
        }
    cost_sort(length_m, n);
    for (unsigned i = n / 4; i < n - n / 4; i++)
        sum += length_m[i];
    return sum / (n - 2 * (n / 4));
}

/* One dive as heard with the noise of a seed, up to `pings`, in maps of n settings. */
static void maps_of(const struct dive *dive, struct dive_ears *ears, const struct chart_setting *set, unsigned n,
                    struct chart **map, uint64_t seed, size_t pings)
{
    struct dice dice = dice_of(seed, UINT64_MAX);
    const double scale = 1 + DEPTH_SCALE_SD * dice_gauss(&dice), offset_m = DEPTH_OFFSET_M * dice_gauss(&dice);
    for (unsigned k = 0; k < n; k++)
        map[k] = chart_make(dive->world, &set[k]);
    dive_begin(ears);
    for (size_t i = 0; i < pings && i < dive->n; i++) {
        const struct dive_look *look = &dive->look[i];
        const double depth_m = scale * look->at[2] + offset_m + DEPTH_SD_M * dice_gauss(&dice);
        const double at[3] = {look->at[0], look->at[1], DEPTH_STEP_M * round(depth_m / DEPTH_STEP_M)};
        struct beam_echoes heard;
        dive_hear(ears, dive, i, seed, &heard);
        for (unsigned k = 0; k < n; k++)
            chart_enter(map[k], look, at, &heard);
    }
}

static struct chart *map_of(const struct dive *dive, struct dive_ears *ears, uint64_t seed, size_t pings)
{
    struct chart *c;
    maps_of(dive, ears, &fine, 1, &c, seed, pings);
    return c;
}

static void print_row(const char *seed, const struct dimension *d, double found_m, double percent, double worst)
{
    printf("%s,%s,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f\n", seed, d->name, d->true_m, d->paper_m,
           100 * fabs(d->paper_m - d->true_m) / d->true_m, found_m, percent, worst);
}

static void table(const struct dive *dive, struct dive_ears *ears, unsigned seeds)
{
    static double found[DIMENSIONS][SEEDS], percent[DIMENSIONS][SEEDS];
    printf("seed,dimension,true_m,paper_m,paper_percent,found_m,percent,worst_percent\n");
    for (unsigned s = 0; s < seeds; s++) {
        struct chart *c = map_of(dive, ears, s + 1, dive->n);
        char name[16];
        snprintf(name, sizeof name, "%u", s + 1);
        for (size_t d = 0; d < DIMENSIONS; d++) {
            found[d][s] = measure(c, &dimensions[d]);
            percent[d][s] = 100 * fabs(found[d][s] - dimensions[d].true_m) / dimensions[d].true_m;
            print_row(name, &dimensions[d], found[d][s], percent[d][s], percent[d][s]);
        }
        chart_free(c);
    }
    for (size_t d = 0; d < DIMENSIONS; d++) {
        cost_sort(found[d], seeds);
        cost_sort(percent[d], seeds);
        print_row("median", &dimensions[d], cost_quantile(found[d], seeds, 0.5),
                  cost_quantile(percent[d], seeds, 0.5), percent[d][seeds - 1]);
    }
}

/* ---- the whole ceiling ---- */

#define CEILING_FROM_M 5.0 /* columns are followed upward from so far below it */

static const double plan[2][2] = {{0, -2.5}, {9, 2.5}}; /* of the chamber at its ceiling, which is at 0 */

/* Shares of the columns in which nothing is free and in which there is free water above; means and worst of edges. */
struct ceiling {
    double none, shortfall_m, beyond, beyond_max_m;
};

static struct ceiling ceiling_of(const struct chart *c)
{
    const double h = c->set.voxel_m;
    struct ceiling out = {0};
    unsigned columns = 0, found = 0;
    for (double x = plan[0][0] + h / 2; x < plan[1][0]; x += h)
        for (double y = plan[0][1] + h / 2; y < plan[1][1]; y += h, columns++) {
            double at[3] = {x, y, CEILING_FROM_M - h / 2};
            if (chart_state(c, at) != VOXEL_FREE) {
                out.none++;
                continue;
            }
            while (chart_state(c, at) == VOXEL_FREE)
                at[2] -= h;
            const double edge_m = at[2] + h / 2; /* of the last free one */
            found++;
            out.shortfall_m += fmax(edge_m, 0);
            out.beyond += edge_m < -1e-9;
            out.beyond_max_m = fmax(out.beyond_max_m, -edge_m);
        }
    out.none /= columns;
    out.shortfall_m /= found ? found : 1;
    out.beyond /= found ? found : 1;
    return out;
}

/* ---- Table I with several settings ---- */

/* dive_ears_make without and with the promise, dive_ears_of_paper. */
enum ears { SHIPPED, PROMISED, OF_PAPER, EARS };

#define AS_THE_PAPER "a beam's whole opening is free as far as its axis"
#define FINE         "[map]\nvoxel = 0.05 m\nechoes = off\necho_weight = 0\nbody = 0.5 m\n"
#define CLEANUP      "[extract]\norder = paper\nmedian = 3\notsu = on\nclahe = on\nclasses = on\n"
#define PROMISE      "[background]\nopen_water = yes\n"

static const struct knob named[] = {
    {.name = "setting", .label = "fine", .more = FINE PROMISE, .beside = AS_THE_PAPER, .number = PROMISED},
    {.name = "setting", .label = "shipped, body 0.5 m", .more = "[map]\nvoxel = 0.2 m\nbody = 0.5 m\n"},
    {.name = "setting", .label = "shipped", .more = "[map]\nvoxel = 0.2 m\n"},
    {.name = "setting",
     .label = "promised",
     .more = "[map]\nvoxel = 0.2 m\nbody = 0.5 m\n" PROMISE,
     .number = PROMISED},
    {.name = "setting",
     .label = "survey",
     .more = "[map]\nvoxel = 0.1 m\nbody = 0.5 m\necho_weight = 1\n" PROMISE,
     .number = PROMISED},
    {.name = "setting",
     .label = "the paper's chain",
     .more = FINE PROMISE CLEANUP,
     .beside = AS_THE_PAPER,
     .number = OF_PAPER},
};
#define NAMED (sizeof named / sizeof named[0])

static double percent[NAMED][DIMENSIONS][SEEDS];
static struct ceiling ceiling[NAMED]; /* means over the seeds, and the worst */

static void enter_ceiling(struct ceiling *all, const struct ceiling *one, unsigned seeds)
{
    all->none += one->none / seeds;
    all->shortfall_m += one->shortfall_m / seeds;
    all->beyond += one->beyond / seeds;
    all->beyond_max_m = fmax(all->beyond_max_m, one->beyond_max_m);
}

/* The settings of one kind of ears, over all seeds: every dive is heard once. */
static void measure_settings(const struct dive *dive, struct dive_ears *ears, unsigned kind, unsigned seeds)
{
    struct chart_setting set[NAMED];
    struct chart *map[NAMED];
    size_t which[NAMED];
    unsigned n = 0;
    for (size_t k = 0; k < NAMED; k++)
        if ((unsigned)named[k].number == kind) {
            struct conf conf;
            knob_conf(&named[k], &conf);
            set[n] = chart_setting_of(&conf);
            if (named[k].beside)
                set[n].opening = 0;
            which[n++] = k;
        }
    for (unsigned s = 0; s < seeds; s++) {
        maps_of(dive, ears, set, n, map, s + 1, dive->n);
        for (unsigned i = 0; i < n; i++) {
            const struct ceiling one = ceiling_of(map[i]);
            enter_ceiling(&ceiling[which[i]], &one, seeds);
            for (size_t d = 0; d < DIMENSIONS; d++)
                percent[which[i]][d][s] =
                    100 * fabs(measure(map[i], &dimensions[d]) - dimensions[d].true_m) / dimensions[d].true_m;
            chart_free(map[i]);
        }
    }
}

static void print_named(const char *part, const struct knob *knob)
{
    char text[KNOB_TEXT_MAX];
    knob_configuration(knob, text);
    printf("%s,\"%s\",\"%s\",", part, knob->label, text);
}

static void settings(const struct dive *dive, unsigned seeds)
{
    knob_check(named, NAMED);
    struct dive_ears *ears[EARS] = {dive_ears_make(false), dive_ears_make(true), dive_ears_of_paper(0)};
    for (unsigned kind = 0; kind < EARS; kind++) {
        measure_settings(dive, ears[kind], kind, seeds);
        dive_ears_free(ears[kind]);
    }
    printf("part,setting,configuration,dimension,true_m,paper_percent,percent,worst_percent,none_share,short_m,"
           "beyond_share,"
           "beyond_max_m\n");
    for (size_t k = 0; k < NAMED; k++)
        for (size_t d = 0; d < DIMENSIONS; d++) {
            cost_sort(percent[k][d], seeds);
            print_named("dimensions", &named[k]);
            printf("%s,%.2f,%.2f,%.2f,%.2f,,,,\n", dimensions[d].name, dimensions[d].true_m,
                   100 * fabs(dimensions[d].paper_m - dimensions[d].true_m) / dimensions[d].true_m,
                   cost_quantile(percent[k][d], seeds, 0.5), percent[k][d][seeds - 1]);
        }
    for (size_t k = 0; k < NAMED; k++) {
        print_named("ceiling", &named[k]);
        printf("whole ceiling,,,,,%.4f,%.3f,%.4f,%.2f\n", ceiling[k].none, ceiling[k].shortfall_m,
               ceiling[k].beyond, ceiling[k].beyond_max_m);
    }
}

/* ---- shafts by chance ---- */

#define FRESH       6
#define QUICK_FRESH 1
#define TURN_M      0.3
#define BESIDE_M    0.75 /* rows begin so far beside the way at most */

/* How much of a row through the water the map has, less 1: its free voxels against the way between the walls. */
static double row_error(const struct chart *c, const double from[3], int axis)
{
    double d[3] = {0}, true_m = 0;
    for (int sign = -1; sign <= 1; sign += 2) {
        d[axis] = sign;
        true_m += place_ray(c->world, from, d, DIVE_RANGE_M, 0);
    }
    const double free_m = free_along(c, from, axis, 1) + free_along(c, from, axis, -1) - c->set.voxel_m;
    return fmax(0, free_m) / true_m - 1;
}

/* As a dimension of Table I: of rows near the way, the mean of the middle half. */
static double mean_error(const struct chart *c, int axis)
{
    static double error[MAX_ROWS];
    const struct place *w = c->world;
    const double h = c->set.voxel_m;
    double sum = 0;
    unsigned n = 0;
    for (double beside_m = -BESIDE_M; beside_m <= BESIDE_M; beside_m += h)
        for (double z = w->from[2]; z <= w->to[2] && n < MAX_ROWS; z += h) {
            double at[3] = {w->from[0], w->from[1], z};
            at[1 - axis] += beside_m;
            if (place_clearance(w, at, NULL, 0) > h)
                error[n++] = row_error(c, at, axis);
        }
    cost_sort(error, n);
    for (unsigned i = n / 4; i < n - n / 4; i++)
        sum += error[i];
    return sum / (n - 2 * (n / 4));
}

static void fresh_shaft(uint64_t seed, struct dive_ears *ears, const struct knob *const knob[], unsigned n)
{
    static const char *const name[] = {"length", "width"};
    const struct place world = place_drawn(seed);
    const unsigned turns = (unsigned)((world.to[2] - world.from[2]) / TURN_M) + 1;
    struct dive *dive = dive_make(&world, turns, true, 0, DIVE_SOUND);
    struct chart_setting set[NAMED];
    struct chart *map[NAMED];
    for (unsigned k = 0; k < n; k++) {
        struct conf conf;
        knob_conf(knob[k], &conf);
        set[k] = chart_setting_of(&conf);
        if (knob[k]->beside)
            set[k].opening = 0;
    }
    maps_of(dive, ears, set, n, map, seed, dive->n);
    for (unsigned k = 0; k < n; k++) {
        double behind_max_m, free_m3;
        const double wrong_m3 = chart_false_free(map[k], 0, &behind_max_m, &free_m3);
        for (int axis = 0; axis < 2; axis++)
            printf("drawn shaft %u,%s,%s,%.2f,%.3g\n", (unsigned)seed, knob[k]->label, name[axis],
                   100 * fabs(mean_error(map[k], axis)), wrong_m3);
        chart_free(map[k]);
    }
    dive_free(dive);
}

static void fresh(unsigned shafts)
{
    const struct knob *promised[NAMED];
    unsigned n = 0;
    struct dive_ears *ears = dive_ears_make(true);
    for (size_t k = 0; k < NAMED; k++)
        if (named[k].number == PROMISED)
            promised[n++] = &named[k];
    printf("world,setting,dimension,percent,false_free_m3\n");
    for (unsigned i = 1; i <= shafts; i++)
        fresh_shaft(2 * i, ears, promised, n);
    dive_ears_free(ears);
}

/* ---- cuts ---- */

enum level { NOTHING, SEEN_FREE, FILTERED_FREE, SURFACE, LEVELS };

static bool free_at(const struct chart *c, int64_t i, int64_t j, int64_t k)
{
    return chart_cell(c, (const int64_t[3]){i, j, k}) == VOXEL_FREE;
}

static enum level level_of(const struct chart *c, const int64_t cell[3])
{
    if (!free_at(c, cell[0], cell[1], cell[2]))
        return submap_count(&c->map, SUBMAP_VACANCY, cell) > 0 ? SEEN_FREE : NOTHING;
    for (int n = 0; n < 27; n++)
        if (!free_at(c, cell[0] + n / 9 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n % 3 - 1))
            return SURFACE;
    return FILTERED_FREE;
}

/* Runs of equal level down each column of a vertical cut: across is the axis that runs along it. */
static void cut(const char *figure, const char *name, const struct chart *c, int across, double other_m)
{
    const double h = c->set.voxel_m, at[3] = {other_m, other_m, 0};
    int64_t cell[3];
    cell[1 - across] = chart_place(c, at).cell[1 - across];
    for (int32_t i = 0; i < c->box.size[across]; i++) {
        cell[across] = c->box.first[across] + i;
        enum level last = NOTHING;
        int32_t begin = 0;
        for (int32_t k = 0; k <= c->box.size[2]; k++) {
            cell[2] = c->box.first[2] + k;
            const enum level now = k < c->box.size[2] ? level_of(c, cell) : NOTHING;
            if (now == last)
                continue;
            if (last != NOTHING)
                printf("%s,%s,%d,%.2f,%.2f,%.2f,%.2f\n", figure, name, last, (double)cell[across] * h,
                       (double)(cell[across] + 1) * h, (double)(c->box.first[2] + begin) * h, (double)cell[2] * h);
            last = now;
            begin = k;
        }
    }
}

static void slices(const struct dive *dive, struct dive_ears *ears)
{
    static const struct {
        const char *name;
        size_t images;
    } figures[] = {{"6a", 10}, {"6b", 20}, {"7", SIZE_MAX / DIVE_TURN}};

    printf("figure,cut,level,left_m,right_m,top_m,bottom_m\n");
    for (size_t f = 0; f < sizeof figures / sizeof figures[0]; f++) {
        struct chart *c = map_of(dive, ears, 1, figures[f].images * DIVE_TURN);
        cut(figures[f].name, "length", c, 0, 0);
        cut(figures[f].name, "width", c, 1, dive->world->from[0]);
        chart_free(c);
    }
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    const bool gain = strcmp(what, "gain") == 0, paper = gain || strcmp(what, "paper") == 0;
    const bool cuts = strcmp(what, "slices") == 0, all = strcmp(what, "settings") == 0;
    const unsigned seeds = quick ? QUICK_SEEDS : SEEDS;
    if (strcmp(what, "fresh") == 0) {
        fresh(quick ? QUICK_FRESH : FRESH);
        return 0;
    }
    if (strcmp(what, "table") != 0 && !cuts && !paper && !all) {
        fprintf(stderr, "usage: report_shaft table|settings|fresh|paper|gain|slices [quick]\n");
        return 2;
    }
    struct dive *dive = dive_make(place_named("shaft"), quick ? QUICK_TURNS : TURNS, true, 0, DIVE_SOUND);
    struct dive_ears *ears = paper ? dive_ears_of_paper(gain ? GAIN_DB : 0.0) : dive_ears_make(true);
    if (cuts)
        slices(dive, ears);
    else if (all)
        settings(dive, seeds);
    else
        table(dive, ears, seeds);
    dive_ears_free(ears);
    dive_free(dive);
    return 0;
}
