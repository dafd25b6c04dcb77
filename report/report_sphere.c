/* SPDX-License-Identifier: MIT */
/*
 * report_sphere - the spherical grid in made-up basins: how wrong its answers are and what a beam costs, for settings
 * of [grid] turned one by one from the shipped default.
 *
 *   report_sphere errors [quick]   CSV: KNOB_COLUMNS, scene, seed, errors
 *   report_sphere pairs            CSV: KNOB_COLUMNS, apart_share, late_turns: two things behind one another
 *   report_sphere cost [quick]     CSV: KNOB_COLUMNS, nanoseconds per beam
 *   report_sphere count [quick]    CSV: KNOB_COLUMNS, beams, for callgrind to count the instructions of sphere_enter
 */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report/lib/asked.h"
#include "report/lib/basin.h"
#include "report/lib/basin_grid.h"
#include "report/lib/cost.h"
#include "tests/water/dice.h"
#include "report/lib/scans.h"

#define SEEDS        8
#define REPETITIONS  11
#define QUESTIONS    200  /* after each turn */
#define CONE_DEG     2.0  /* half a question's */
#define EDGE_M       0.15 /* a surface this near to the distance asked about is neither in the way nor out of it */
#define COST_TURNS   2
#define NEAR_POST_M  0.25
#define PAIR_TURN_NS UINT64_C(10000000000)

static const struct knob settings[] = {
    KNOB_KEY("grid", "angular_step", "0.5 deg"),
    KNOB_KEY("grid", "angular_step", "1 deg"),
    KNOB_KEY("grid", "angular_step", NULL),
    KNOB_KEY("grid", "angular_step", "3 deg"),
    KNOB_KEY("grid", "angular_step", "5 deg"),
    KNOB_KEY("grid", "angular_step", "10 deg"),
    KNOB_KEY("grid", "layer", "0.01 m"),
    KNOB_KEY("grid", "layer", "0.02 m"),
    KNOB_KEY("grid", "layer", NULL),
    KNOB_KEY("grid", "layer", "0.1 m"),
    KNOB_KEY("grid", "layer", "0.3 m"),
    KNOB_KEY("grid", "growth", "1"),
    KNOB_KEY("grid", "growth", "1.01"),
    KNOB_KEY("grid", "growth", NULL),
    KNOB_KEY("grid", "growth", "1.1"),
    KNOB_KEY("grid", "growth", "1.3"),
    KNOB_KEY("grid", "sensor_model", NULL),
    KNOB_KEY("grid", "sensor_model", "gauss"),
    KNOB_KEY("grid", "sensor_model", "midpoint"),
    KNOB_KEY("grid", "update", NULL),
    KNOB_KEY("grid", "update", "max"),
};
#define SETTINGS (sizeof settings / sizeof settings[0])

/* The one before is gone. */
static struct sphere *grid_of(const struct knob *knob)
{
    static struct sphere *grid;
    const struct sphere_conf conf = basin_grid_conf(knob);
    free(grid);
    return grid = basin_grid(&conf);
}

/* ---- errors ---- */

struct tally {
    unsigned in_way, false_clear;        /* questions with a surface in the way; called clear all the same */
    unsigned open, false_block, unknown; /* with none; called blocked; not known */
    double range_m[SEEDS * BASIN_TURNS * QUESTIONS]; /* |error| of the range when rightly blocked */
    unsigned n_ranges;
    double beyond_rad; /* sum of how far posts are blocked beyond their true edges */
    unsigned edges;
};

/* The grid and the records of the same pings, and who asks them. */
struct seen {
    struct sphere *grid;
    struct store *store;
    struct asking asking;
};

/* With that setting, empty; its records are the caller's to free. */
static struct seen seen_of(const struct knob *setting)
{
    struct conf conf;
    struct sphere *grid = grid_of(setting);
    knob_conf(setting, &conf);
    return (struct seen){
        .grid = grid,
        .store = asked_store(),
        .asking = {.picture = sphere_picture(grid), .limits = scans_limits(&conf), .near_m = asked_near_m()}};
}

static struct answer ask(const struct seen *seen, double az_rad, double distance_m, double half_rad)
{
    const struct obstacles_query q = {
        .line = {.az_rad = geo_wrap(az_rad), .ned = true, .distance_m = distance_m, .half_angle_rad = half_rad}};
    struct answer a;
    asked_of_store(&seen->asking, seen->store, &q, &a);
    return a;
}

static void ask_around(const struct seen *seen, const struct basin *basin, const double place[2],
                       struct dice *dice, struct tally *t)
{
    for (int i = 0; i < QUESTIONS; i++) {
        const double az_rad = GEO_TURN * dice_uniform(dice), distance_m = 0.8 + 5 * dice_uniform(dice);
        const double nearest_m = basin_nearest(basin, place, az_rad, geo_rad(CONE_DEG));
        const struct answer a = ask(seen, az_rad, distance_m, geo_rad(CONE_DEG));
        if (nearest_m < distance_m - EDGE_M) {
            t->in_way++;
            t->false_clear += a.state == ANSWER_CLEAR;
            if (a.state == ANSWER_BLOCKED)
                t->range_m[t->n_ranges++] = fabs(a.range_m - nearest_m);
        } else if (nearest_m > distance_m + EDGE_M) {
            t->open++;
            t->false_block += a.state == ANSWER_BLOCKED;
            t->unknown += a.state == ANSWER_UNKNOWN;
        }
    }
}

/* How far from a post's true edge, on one side, its directions are still blocked at its range; at most 20 degrees. */
static double beyond_edge(const struct seen *seen, double middle_rad, double half_rad, double range_m, int side)
{
    const double step = geo_rad(0.1);
    double beyond = 0;
    for (; beyond < geo_rad(20); beyond += step) {
        const struct answer a = ask(seen, middle_rad + side * (half_rad + beyond), range_m + NEAR_POST_M, 1e-4);
        if (a.state != ANSWER_BLOCKED || fabs(a.range_m - range_m) > NEAR_POST_M)
            break;
    }
    return beyond;
}

static void ask_posts(const struct seen *seen, const struct basin *basin, const double place[2], struct tally *t)
{
    for (int k = 1; basin->place.shape[k].kind != PLACE_END; k++) {
        const double *post = basin->place.shape[k].p, x = post[0] - place[0], y = post[1] - place[1];
        const double r = sqrt(x * x + y * y), middle = atan2(y, x), half = asin(post[2] / r);
        int shape;
        basin_range(basin, place, middle, &shape);
        for (int side = -1; shape == k && side <= 1; side += 2, t->edges++)
            t->beyond_rad += beyond_edge(seen, middle, half, r - post[2], side);
    }
}

static void drive(struct seen *seen, const struct basin *basin, unsigned turn)
{
    struct beam_echoes heard;
    struct echoes e = {.beam = &heard};
    for (unsigned beam = 0; beam < BASIN_BEAMS; beam++) {
        basin_listen(basin, turn, beam, false, &e);
        sphere_enter(seen->grid, &e, &mount_identity);
        store_enter(seen->store, &e, &mount_identity);
    }
    seen->asking.now = (struct answer_now){.now_ns = e.t_ns, .pose_fresh = true, .pose = e.pose};
}

static void errors_of(const struct knob *setting, unsigned seed, unsigned turns)
{
    static struct tally t;
    struct seen seen = seen_of(setting);
    struct dice dice = dice_of(seed, 2);
    struct sphere_stats stats;
    struct basin basin;
    double place[2];

    memset(&t, 0, sizeof t);
    basin_make(&basin, seed);
    for (unsigned turn = 0; turn < turns; turn++) {
        drive(&seen, &basin, turn);
        basin_place(&basin, turn, place);
        ask_around(&seen, &basin, place, &dice, &t);
        ask_posts(&seen, &basin, place, &t);
    }
    free(seen.store);
    sphere_stats(seen.grid, &stats);
    cost_sort(t.range_m, t.n_ranges);
    knob_print(setting);
    printf(",all,%u,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g,%u\n", seed, (double)t.false_clear / t.in_way,
           (double)t.false_block / t.open, (double)t.unknown / t.open, cost_quantile(t.range_m, t.n_ranges, 0.5),
           cost_quantile(t.range_m, t.n_ranges, 0.95), cost_quantile(t.range_m, t.n_ranges, 1),
           geo_deg(t.beyond_rad / fmax(t.edges, 1)), stats.cells);
}

static void errors(unsigned seeds, unsigned turns)
{
    printf(KNOB_COLUMNS ",scene,seed,false_clear_share,false_block_share,unknown_share,range_median_m,"
                        "range_p95_m,range_max_m,direction_deg,cells\n");
    for (unsigned seed = 1; seed <= seeds; seed++)
        for (size_t i = 0; i < SETTINGS; i++)
            errors_of(&settings[i], seed, turns);
}

/* ---- two things behind one another ---- */

#define PAIR_TURNS  5
#define MOST_TURNS  30
#define PAIR_BEAMS  9 /* each side of straight ahead */
#define PAIR_EDGE_M 0.07

/* A turn of the beams around straight ahead, which hear what stands at both ranges, or at the second one alone. */
static void hear_pair(struct seen *seen, unsigned turn, const double range_m[2], bool both)
{
    for (int b = -PAIR_BEAMS; b <= PAIR_BEAMS; b++) {
        struct beam_echoes h = {
            .az_rad = (float)(GEO_TURN * b / BASIN_BEAMS), .blind_m = 0.5f, .state = BEAM_ECHO};
        struct echoes e = {.t_ns = (uint64_t)(1 + turn) * PAIR_TURN_NS + (uint64_t)(b + PAIR_BEAMS),
                           .seq = turn * BASIN_BEAMS + (unsigned)(b + PAIR_BEAMS),
                           .n_beams = 1,
                           .flags = b == -PAIR_BEAMS ? PING_NEW_TURN : 0,
                           .range_max_m = BASIN_GRID_REACH_M,
                           .az_aperture_rad = (float)geo_rad(BASIN_AZ_DEG),
                           .el_aperture_rad = (float)geo_rad(BASIN_EL_DEG),
                           .pose = pose_identity,
                           .max_beams = 1,
                           .beam = &h};
        for (int k = both ? 0 : 1; k < 2; k++)
            h.echo[h.n++] = (struct echo){.range_m = (float)range_m[k],
                                          .near_m = (float)(range_m[k] - 0.02),
                                          .sd_m = 0.02f,
                                          .strength = 10,
                                          .confidence = 0.9f};
        h.free_to_m = h.echo[0].near_m;
        e.pose.has = POSE_ATTITUDE | POSE_POSITION;
        sphere_enter(seen->grid, &e, &mount_identity);
        store_enter(seen->store, &e, &mount_identity);
        seen->asking.now = (struct answer_now){.now_ns = e.t_ns, .pose_fresh = true, .pose = e.pose};
    }
}

static bool shows_both(const struct seen *seen, const double range_m[2])
{
    struct picture_entry e;
    picture_get(seen->asking.picture, rings_index(seen->asking.picture->rings, 0.01, 0.01), &e);
    for (int k = 0; k < 2; k++)
        if (!(e.obstacle[k].logodds > 0) || fabs((double)e.obstacle[k].range_m - range_m[k]) > PAIR_EDGE_M)
            return false;
    return true;
}

/* Are both told apart, and how many turns after the first has gone is the second the nearest? */
static void judge_pair(const struct knob *setting, const double range_m[2], unsigned *apart, unsigned *late)
{
    struct seen seen = seen_of(setting);
    for (unsigned turn = 0; turn < PAIR_TURNS; turn++)
        hear_pair(&seen, turn, range_m, true);
    *apart += shows_both(&seen, range_m);
    for (unsigned turn = 0; turn < MOST_TURNS; turn++, ++*late) {
        hear_pair(&seen, PAIR_TURNS + turn, range_m, false);
        const struct answer a = ask(&seen, 0, BASIN_GRID_REACH_M, geo_rad(0.5));
        if (a.state == ANSWER_BLOCKED && fabs(a.range_m - range_m[1]) < PAIR_EDGE_M)
            break;
    }
    free(seen.store);
}

static void pairs(void)
{
    printf(KNOB_COLUMNS ",pairs,apart_share,late_turns\n");
    for (size_t i = 0; i < SETTINGS; i++) {
        unsigned n = 0, apart = 0, late = 0;
        for (double gap_m = 0.2; gap_m < 0.9; gap_m *= 2)
            for (double near_m = 1.5; near_m < 9; near_m += 0.5, n++)
                judge_pair(&settings[i], (const double[]){near_m, near_m + gap_m}, &apart, &late);
        knob_print(&settings[i]);
        printf(",%u,%.3g,%.3g\n", n, (double)apart / n, (double)late / n);
    }
}

/* ---- cost ---- */

static void cost(unsigned repetitions)
{
    static struct beam_echoes heard[COST_TURNS * BASIN_BEAMS];
    static struct echoes ping[COST_TURNS * BASIN_BEAMS];
    struct basin basin;
    basin_make(&basin, 1);
    for (unsigned i = 0; i < COST_TURNS * BASIN_BEAMS; i++) {
        ping[i].beam = &heard[i];
        basin_listen(&basin, i / BASIN_BEAMS, i % BASIN_BEAMS, false, &ping[i]);
    }
    printf(KNOB_COLUMNS ",ns_per_bin,ns_low,ns_high\n");
    for (size_t k = 0; k < SETTINGS; k++) {
        double ns[REPETITIONS];
        for (unsigned r = 0; r < repetitions; r++) {
            struct sphere *grid = grid_of(&settings[k]);
            const double begin_ns = cost_now_ns();
            for (unsigned i = 0; i < COST_TURNS * BASIN_BEAMS; i++)
                sphere_enter(grid, &ping[i], &mount_identity);
            ns[r] = (cost_now_ns() - begin_ns) / (COST_TURNS * BASIN_BEAMS);
        }
        const struct cost_spread spread = cost_spread_of(ns, repetitions);
        knob_print(&settings[k]);
        printf(",%.4g,%.4g,%.4g\n", spread.median, spread.low, spread.high);
    }
}

/* The first beams of a turn. */
static void count(unsigned beams)
{
    struct beam_echoes heard;
    struct echoes e = {.beam = &heard};
    struct basin basin;
    basin_make(&basin, 1);
    printf(KNOB_COLUMNS ",bins\n");
    for (size_t k = 0; k < SETTINGS; k++) {
        struct sphere *grid = grid_of(&settings[k]);
        for (unsigned beam = 0; beam < beams; beam++) {
            basin_listen(&basin, 0, beam, false, &e);
            sphere_enter(grid, &e, &mount_identity);
        }
        knob_print(&settings[k]);
        printf(",%u\n", beams);
        cost_mark();
    }
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    knob_check(settings, SETTINGS);
    if (strcmp(what, "errors") == 0)
        errors(quick ? 1 : SEEDS, quick ? 2 : BASIN_TURNS);
    else if (strcmp(what, "pairs") == 0)
        pairs();
    else if (strcmp(what, "cost") == 0)
        cost(quick ? 3 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count(quick ? BASIN_BEAMS / 4 : BASIN_BEAMS);
    else {
        fprintf(stderr, "usage: report_sphere errors|pairs|cost|count [quick]\n");
        return 2;
    }
    return 0;
}
