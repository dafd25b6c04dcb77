/* SPDX-License-Identifier: MIT */
/*
 * report_precision - what float or double is worth where the choice matters: a cell's evidence over many updates, and
 * the voxel predicate far from the origin, each in several formats against long double.
 *
 *   report_precision evidence [quick]   CSV: format, bytes, updates, error, error_max, wrong, ns
 *   report_precision voxels [quick]     CSV: format, distance_m, wrong_share, wrong_share_max, voxels, ns
 *
 * error: of the log-odds, the worst of all updates so far: median and worst of the seeds. wrong: updates after which
 * the cell blocks and should not, or does not and should, of all seeds. wrong_share:
 * of the voxels that belong to the beam.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/voxel/cast.h"
#include "report/lib/cost.h"
#include "tests/water/dice.h"
#include "report/lib/stable.h"
#include "report/lib/stable_sphere.h"

#define SEEDS 5

/* ---- evidence: L(t) = clamp(L(t0) exp(-(t - t0) / fade) + weight), as sphere.h has it ---- */

#define LOGODDS_MAX 6.0
#define FLUSH_BELOW 1e-6
#define UPDATES_MAX 100000
#define FORGET_S    160.0
#define CONFIDENCE  0.9f /* of stable_ping's echoes */
#define RANGE_M     5.0

struct event {
    float dt_s;
    bool hit;
};

static struct event events[UPDATES_MAX];
static long double truth[UPDATES_MAX];
static double kept[UPDATES_MAX]; /* the log-odds of one format after each update */

enum format { FLOAT_FLOAT, FLOAT_DOUBLE, DOUBLE_DOUBLE, PRODUCT, FORMATS };
static const struct {
    const char *name;
    int bytes;
} formats[FORMATS] = {{"float kept and computed", 4},
                      {"float kept and double computed", 4},
                      {"double kept and computed", 8},
                      {"sonard", 4}};

static long double hit_weight, miss_weight, fade_s, blocked;

static void make_events(unsigned seed, unsigned n)
{
    struct dice dice = dice_of(seed, 11);
    for (unsigned i = 0; i < n; i++)
        events[i] = (struct event){(float)ldexp(round(ldexp(0.02 * pow(1e3, dice_uniform(&dice)), 20)), -20),
                                   dice_uniform(&dice) < 0.4};
}

/* One format's replica: kept in KEPT, computed in T. */
#define REPLICA(name, KEPT, T, EXP)                                                                               \
    static void name(unsigned n, double *out)                                                                     \
    {                                                                                                             \
        KEPT l = 0;                                                                                               \
        for (unsigned i = 0; i < n; i++) {                                                                        \
            T now = (T)l * EXP(-(T)events[i].dt_s / (T)fade_s);                                                   \
            if (events[i].hit || now > 0)                                                                         \
                now += events[i].hit ? (T)hit_weight : (T)miss_weight;                                            \
            now = now > (T)LOGODDS_MAX ? (T)LOGODDS_MAX : now;                                                    \
            l = now < (T)FLUSH_BELOW ? 0 : (KEPT)now;                                                             \
            out[i] = (double)l;                                                                                   \
        }                                                                                                         \
    }
REPLICA(in_float, float, float, expf)
REPLICA(in_mixed, float, double, exp)
REPLICA(in_double, double, double, exp)

static void in_truth(unsigned n)
{
    long double l = 0;
    for (unsigned i = 0; i < n; i++) {
        l *= expl(-(long double)events[i].dt_s / fade_s);
        if (events[i].hit || l > 0)
            l += events[i].hit ? hit_weight : miss_weight;
        l = l > (long double)LOGODDS_MAX ? (long double)LOGODDS_MAX : l < (long double)FLUSH_BELOW ? 0 : l;
        truth[i] = l;
    }
}

/* The product's own cell. A look that hears something much farther is a miss. */
static void in_product(unsigned n, double *out)
{
    const struct sphere_conf conf = {.angular_step_rad = 2 * GEO_PI / 180,
                                     .level = true,
                                     .level_half_rad = 7.5 * GEO_PI / 180,
                                     .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                     .max_cells = 4096,
                                     .forget_s = FORGET_S,
                                     .blocked_above = 0.6,
                                     .recentre_m = 0.1};
    struct stable_sphere s = stable_sphere(&conf);
    for (unsigned i = 0; i < n; i++) {
        s.t_ns += (uint64_t)llround((double)events[i].dt_s * 1e9);
        stable_ping(&s, 1, events[i].hit ? RANGE_M : 0, 10);
        out[i] = stable_cell(&s, 1).logodds;
    }
    free(s.sphere);
}

static void run_format(enum format format, unsigned n, double *out)
{
    static void (*const run[FORMATS])(unsigned, double *) = {in_float, in_mixed, in_double, in_product};
    run[format](n, out);
}

static void evidence(unsigned most, unsigned seeds)
{
    const double blocked_above = 0.6;
    hit_weight = log1pl((long double)CONFIDENCE * 4.0L);
    miss_weight = logl(0.5L / 0.9L);
    blocked = logl((long double)blocked_above / (1 - (long double)blocked_above));
    fade_s = (long double)FORGET_S / logl((long double)LOGODDS_MAX / blocked);

    printf("format,bytes,updates,error,error_max,wrong,ns\n");
    for (enum format f = 0; f < FORMATS; f++) {
        double error[6][SEEDS] = {0}, ns[SEEDS];
        unsigned wrong[6] = {0};
        for (unsigned seed = 0; seed < seeds; seed++) {
            make_events(seed + 1, most);
            in_truth(most);
            const double begin_ns = cost_now_ns();
            run_format(f, most, kept);
            ns[seed] = (cost_now_ns() - begin_ns) / most;
            double worst = 0;
            unsigned wrong_so_far = 0;
            for (unsigned i = 0, decade = 0, next = 1; i < most; i++) {
                worst = fmax(worst, (double)fabsl((long double)kept[i] - truth[i]));
                wrong_so_far += ((long double)kept[i] > blocked) != (truth[i] > blocked);
                if (i + 1 == next) {
                    error[decade][seed] = worst;
                    wrong[decade] += wrong_so_far;
                    decade++;
                    next *= 10;
                }
            }
        }
        cost_sort(ns, seeds);
        for (unsigned decade = 0, n = 1; n <= most; decade++, n *= 10) {
            cost_sort(error[decade], seeds);
            printf("%s,%d,%u,%.4g,%.4g,%u,%.4g\n", formats[f].name, formats[f].bytes, n,
                   cost_quantile(error[decade], seeds, 0.5), error[decade][seeds - 1], wrong[decade],
                   cost_quantile(ns, seeds, 0.5));
        }
    }
}

/* ---- the voxel predicate ---- */

#define VOXEL_M 0.1
#define FAR_M   6.0
#define WIDE    62 /* cells from the apex that a beam reaches, level; and up and down */
#define HIGH    24
#define CELLS   ((2 * WIDE + 1) * (2 * WIDE + 1) * (2 * HIGH + 1))

static bool inside[CELLS];

/* Where the apex is: whole cells, and the place within one. Everything but the product is given it in metres. */
struct aimed {
    struct cast_beam beam;
    double apex_m[3];
};

#define IN_WEDGE(T, SQRT, p, beam, far)                                                                           \
    T q[3];                                                                                                       \
    for (int a = 0; a < 3; a++)                                                                                   \
        q[a] = (T)(beam)->axis[a][0] * p[0] + (T)(beam)->axis[a][1] * p[1] + (T)(beam)->axis[a][2] * p[2];        \
    const struct cast_opening *o = (beam)->opening;                                                               \
    const T level2 = q[0] * q[0] + q[1] * q[1], y = q[1] < 0 ? -q[1] : q[1], z = q[2] < 0 ? -q[2] : q[2];         \
    return SQRT(level2 + q[2] * q[2]) <= (far) && q[0] * (T)o->sin_az - y * (T)o->cos_az >= 0 &&                  \
           SQRT(level2) * (T)o->sin_el - z * (T)o->cos_el >= 0;

/* In metres of the world: the centre of the cell less the apex. */
#define IN_METRES(name, T, SQRT)                                                                                  \
    static bool name(const struct aimed *at, const int64_t cell[3])                                               \
    {                                                                                                             \
        T p[3];                                                                                                   \
        for (int a = 0; a < 3; a++)                                                                               \
            p[a] = ((T)cell[a] + (T)0.5) * (T)VOXEL_M - (T)at->apex_m[a];                                         \
        IN_WEDGE(T, SQRT, p, &at->beam, (T)FAR_M)                                                                 \
    }
IN_METRES(by_float, float, sqrtf)
IN_METRES(by_double, double, sqrt)

static bool by_product(const struct aimed *at, const int64_t cell[3])
{
    return cast_slack(&at->beam, cell) >= 0;
}

/* In voxels from the apex, which whole cells tell exactly. */
static bool by_truth(const struct aimed *at, const int64_t cell[3])
{
    long double p[3];
    for (int a = 0; a < 3; a++)
        p[a] = (long double)(cell[a] - at->beam.apex.cell[a]) + 0.5L - (long double)at->beam.apex.offset[a];
    IN_WEDGE(long double, sqrtl, p, &at->beam, (long double)at->beam.far)
}

typedef bool predicate(const struct aimed *at, const int64_t cell[3]);

static struct aimed aim(const struct cast_opening *opening, double distance_m, unsigned seed)
{
    struct dice dice = dice_of(seed, 12);
    struct lattice_place apex;
    struct aimed at;
    for (int a = 0; a < 3; a++) {
        apex.cell[a] = a < 2 ? (int64_t)(distance_m / VOXEL_M) : 0;
        apex.offset[a] = ldexp(floor(ldexp(dice_uniform(&dice), 10)), -10);
        at.apex_m[a] = ((double)apex.cell[a] + apex.offset[a]) * VOXEL_M;
    }
    cast_aim(&at.beam, opening,
             &(struct cast_look){.apex = &apex,
                                 .attitude = pose_identity.attitude,
                                 .az_rad = GEO_TURN * dice_uniform(&dice),
                                 .el_rad = geo_rad(10 * dice_uniform(&dice)),
                                 .far_m = FAR_M,
                                 .voxel_m = VOXEL_M});
    return at;
}

/* Asks for every cell around the apex; the first time what is right is kept, later times counted is what differs. */
static unsigned ask_all(predicate *asked, const struct aimed *at, bool first)
{
    unsigned n = 0, k = 0;
    for (int64_t i = -WIDE; i <= WIDE; i++)
        for (int64_t j = -WIDE; j <= WIDE; j++)
            for (int64_t d = -HIGH; d <= HIGH; d++, k++) {
                const int64_t *apex = at->beam.apex.cell, cell[3] = {apex[0] + i, apex[1] + j, apex[2] + d};
                const bool in = asked(at, cell);
                n += first ? in : in != inside[k];
                if (first)
                    inside[k] = in;
            }
    return n;
}

static void voxels(unsigned seeds, double step)
{
    static const struct {
        const char *name;
        predicate *asked;
    } ways[] = {{"metres of the world in float", by_float},
                {"metres of the world in double", by_double},
                {"sonard", by_product}};
    struct cast_opening opening;
    struct fault fault;

    cast_opening_init(&opening, CAST_WEDGE, geo_rad(1.5), geo_rad(17.5), 0, &fault);
    printf("format,distance_m,wrong_share,wrong_share_max,voxels,ns\n");
    for (size_t w = 0; w < sizeof ways / sizeof ways[0]; w++)
        for (double distance_m = 1; distance_m < 2e9; distance_m *= step) {
            double share[SEEDS], ns[SEEDS];
            unsigned all = 0;
            for (unsigned seed = 0; seed < seeds; seed++) {
                const struct aimed at = aim(&opening, distance_m, seed + 1);
                const unsigned right = ask_all(by_truth, &at, true);
                const double begin_ns = cost_now_ns();
                share[seed] = (double)ask_all(ways[w].asked, &at, false) / right;
                ns[seed] = (cost_now_ns() - begin_ns) / CELLS;
                all += right;
            }
            cost_sort(share, seeds);
            cost_sort(ns, seeds);
            printf("%s,%g,%.4g,%.4g,%u,%.3g\n", ways[w].name, distance_m, cost_quantile(share, seeds, 0.5),
                   share[seeds - 1], all, cost_quantile(ns, seeds, 0.5));
        }
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    if (strcmp(what, "evidence") == 0)
        evidence(quick ? 10000 : UPDATES_MAX, quick ? 2 : SEEDS);
    else if (strcmp(what, "voxels") == 0)
        voxels(quick ? 1 : SEEDS, quick ? 1000 : 10);
    else {
        fprintf(stderr, "usage: report_precision evidence|voxels [quick]\n");
        return 2;
    }
    return 0;
}
