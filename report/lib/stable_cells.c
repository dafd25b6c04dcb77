/* SPDX-License-Identifier: MIT */
/* stable_cells - cases G of the spherical grid's geometry: layers, directions, shares of cells. */
#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "grid/geometry.h"
#include "grid/sphere/gauss.h"
#include "grid/sphere/layers.h"
#include "grid/picture/rings.h"
#include "grid/sphere/spread.h"
#include "tests/water/dice.h"
#include "stable.h"

static struct layers make_layers(const struct layers_conf *conf)
{
    struct layers layers;
    layers_init(&layers, conf, stable_memory((layers_count(conf) + 1) * sizeof(double)));
    return layers;
}

static void free_layers(const struct layers *layers)
{
    free((void *)(uintptr_t)layers->edge);
}

/* Edge i as a sum of layers, smallest first: exact to a few roundings of long double. */
static long double edge_by_hand(const struct layers_conf *c, uint32_t i)
{
    long double grown = 0, thick = c->dr_m;
    for (uint32_t k = c->n_const; k < i; k++)
        grown += thick *= c->growth;
    return c->r_min_m + (long double)c->dr_m * (i < c->n_const ? i : c->n_const) + grown;
}

/* Growth near one and far from it: error of the edges, in 4 + i ln g ulp; naive: dr (g^j - 1) / (g - 1). */
static void growths(bool quick, struct stable_found *f)
{
    static const double growth[] = {1, 1 + DBL_EPSILON, 1 + 1e-12, 1.0000001, 1.035, 2, 1e3};
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t k = 0; k < sizeof growth / sizeof growth[0]; k++) {
        const double g = growth[k];
        const struct layers_conf conf = {
            .r_min_m = 0.3, .r_max_m = g > 100 ? 1e9 : 60, .dr_m = 0.05, .n_const = 4, .growth = g};
        const struct layers layers = make_layers(&conf);
        for (uint32_t i = 1; i <= layers.n; i++) {
            const double want = (double)edge_by_hand(&conf, i), ulp = want * DBL_EPSILON * (4 + i * log(g)),
                         j = i > 4 ? i - 4 : 0,
                         plain = 0.3 + 0.05 * (i > 4 ? 4 : i) + 0.05 * g * (pow(g, j) - 1) / (g - 1);
            f->ours = stable_worse(f->ours, fabs(layers.edge[i] - want) / ulp);
            f->naive = stable_worse(f->naive, fabs(plain - want) / ulp);
            if (!(layers.edge[i] > layers.edge[i - 1]))
                f->ours = INFINITY;
        }
        free_layers(&layers);
    }
}

/* On every edge, just above and just below. Naive: the logarithm that the series inverts. */
static void at_edges(bool quick, struct stable_found *f)
{
    const struct layers_conf conf = {.r_min_m = 0, .r_max_m = 200, .dr_m = 0.05, .n_const = 0, .growth = 1.035};
    const struct layers layers = make_layers(&conf);
    (void)quick;
    f->naive = f->ours = 0;
    for (uint32_t i = 0; i < layers.n; i++) {
        const double edge = layers.edge[i];
        const double r[] = {edge, nextafter(edge, INFINITY), nextafter(layers.edge[i + 1], 0)};
        for (int k = 0; k < 3; k++) {
            f->ours += layers_index(&layers, r[k]) != (int32_t)i;
            f->naive += floor(log1p(r[k] / 0.05 * 0.035 / 1.035) / log(1.035)) != i;
        }
    }
    const double senseless[] = {-1, -DBL_MIN, NAN, INFINITY, layers.edge[layers.n]};
    for (int k = 0; k < 5; k++)
        f->ours += layers_index(&layers, senseless[k]) != (k < 2 ? LAYERS_BELOW : LAYERS_BEYOND);
    free_layers(&layers);
}

static void from_zero(bool quick, struct stable_found *f)
{
    const struct layers_conf conf = {.r_min_m = 0, .r_max_m = 10, .dr_m = 0.05, .n_const = 10, .growth = 1.1};
    const struct layers layers = make_layers(&conf);
    (void)quick;
    f->ours = (layers.edge[0] != 0) + (layers_index(&layers, 0) != 0) + (layers_index(&layers, -0.0) != 0) +
              (layers_index(&layers, DBL_TRUE_MIN) != 0);
    f->derived = true;
    f->naive = !isfinite(log(0 / 0.05)); /* a geometric series alone never reaches zero */
    free_layers(&layers);
}

static void senseless_layers(bool quick, struct stable_found *f)
{
    static const struct layers_conf row[] = {
        {0, 10, 0.05, 10, 0.5}, {0, 10, 0, 10, 1.1},     {0, 10, -1, 10, 1.1},  {0, 10, NAN, 10, 1.1},
        {0, 10, 0.05, 10, NAN}, {-1, 10, 0.05, 10, 1.1}, {0, 1e9, 1e-3, 10, 1}, {0, INFINITY, 0.05, 10, 1.1},
    };
    (void)quick;
    f->derived = true;
    f->naive = sizeof row / sizeof row[0]; /* the loop that adds layers never ends, or ends at once */
    f->ours = 0;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        f->ours += layers_count(&row[i]) != 0;
}

/* Angles at the seam and the poles. */
static void angles(bool quick, struct stable_found *f)
{
    static const double az[] = {0, -0.0, GEO_TURN, -1e-17, 1e9 * GEO_TURN + 0.1, -1e9 * GEO_TURN, 4.9e-324};
    const double el[] = {0, GEO_PI / 2, -GEO_PI / 2, nextafter(GEO_PI / 2, 0), nextafter(-GEO_PI / 2, 0), 1e-300};
    static struct rings rings;
    (void)quick;
    rings_full(&rings, geo_rad(2));
    f->naive = f->ours = 0;
    for (size_t a = 0; a < sizeof az / sizeof az[0]; a++)
        for (size_t e = 0; e < sizeof el / sizeof el[0]; e++) {
            const uint32_t d = rings_index(&rings, az[a], el[e]), zero = rings_index(&rings, 0, el[e]);
            const bool at_zero = a != 4 && a != 5;
            f->ours += d >= rings.n || (at_zero && d != zero && a != 3);
            double wrapped = fmod(az[a], GEO_TURN); /* without a last look at what rounding did */
            wrapped += wrapped < 0 ? GEO_TURN : 0;
            f->naive += floor(wrapped / geo_rad(2)) >= 180 || floor((GEO_PI / 2 - el[e]) / geo_rad(2)) >= 90;
        }
}

/* Solid angles of all cells, and directions that lie in the closed box of exactly the cell that
 * they are said to be in. */
static void all_the_sphere(bool quick, struct stable_found *f)
{
    static const double step_deg[] = {90, 45, 7, 2, 0.5};
    static struct rings rings;
    struct dice dice = dice_of(6, 0);
    f->naive = f->ours = 0;
    for (size_t k = 0; k < sizeof step_deg / sizeof step_deg[0]; k++) {
        long double whole = 0;
        double plain = 0;
        rings_full(&rings, geo_rad(step_deg[k]));
        for (uint32_t r = 0; r < rings.n_rings; r++) {
            const uint32_t cells = rings.start[r + 1] - rings.start[r];
            const double top = rings.top_rad - r * rings.height_rad;
            whole += (long double)cells * rings_width(&rings, r) * (sinl(top) - sinl(top - rings.height_rad));
            plain +=
                90 / step_deg[k] * 4 * geo_rad(step_deg[k]) * geo_rad(step_deg[k]); /* equal steps of azimuth */
        }
        f->ours = stable_worse(f->ours, fabs((double)(whole / (4 * GEO_PI)) - 1));
        f->naive = stable_worse(f->naive, fabs(plain / (4 * GEO_PI) - 1));
        for (int n = 0; n < (quick ? 1000 : 100000); n++) {
            const double az = GEO_TURN * dice_uniform(&dice), el = asin(2 * dice_uniform(&dice) - 1);
            const uint32_t d = rings_index(&rings, az, el), r = rings_ring(&rings, d);
            double az_mid, el_mid;
            rings_centre(&rings, d, &az_mid, &el_mid);
            if (fabs(geo_wrap_pi(az - az_mid)) > rings_width(&rings, r) / 2 + 1e-12 ||
                fabs(el - el_mid) > rings.height_rad / 2 + 1e-12)
                f->ours = INFINITY;
        }
    }
}

static bool among(const struct rings *rings, uint32_t d, uint32_t other, unsigned *times)
{
    struct rings_run run[3];
    const unsigned runs = rings_touching(rings, d, run);
    *times = 0;
    for (unsigned r = 0; r < runs; r++)
        for (uint32_t k = 0; k < run[r].n; k++)
            *times += rings_in(&run[r], k) == other;
    return *times > 0;
}

/* Pairs of directions of which one has the other for a neighbour and not the other way round, or twice. */
static void neighbours(bool quick, struct stable_found *f)
{
    static const double step_deg[] = {90, 60, 45, 20, 7};
    static struct rings rings;
    unsigned times, back;
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t k = 0; k < sizeof step_deg / sizeof step_deg[0]; k++) {
        rings_full(&rings, geo_rad(step_deg[k]));
        for (uint32_t a = 0; a < rings.n; a++)
            for (uint32_t b = 0; b < rings.n; b++) {
                const bool there = among(&rings, a, b, &times), here = among(&rings, b, a, &back);
                f->ours += there != here || times > 1 || (a == b && !there);
                /* Naive: a ring's cell k is next to cell k * n / m of the ring below, and the same upward. */
                const uint32_t ra = rings_ring(&rings, a), rb = rings_ring(&rings, b);
                if (rb != ra + 1)
                    continue;
                const uint32_t na = rings.start[ra + 1] - rings.start[ra],
                               nb = rings.start[rb + 1] - rings.start[rb];
                const uint32_t ka = a - rings.start[ra], kb = b - rings.start[rb];
                f->naive += (ka * nb / na == kb) != (kb * na / nb == ka);
            }
    }
}

/* Shares of an echo over a whole partition, its far tails, and one wider than the circle. */
static void shares(bool quick, struct stable_found *f)
{
    static const double sd[] = {1e-6, 1e-3, 1, 30};
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t k = 0; k < sizeof sd / sizeof sd[0]; k++) {
        double sum = 0, plain = 0;
        for (int i = -400; i < 400; i++) {
            const double from = 8 * sd[k] * i / 400, to = 8 * sd[k] * (i + 1) / 400;
            sum += gauss_between(from, to, 0, sd[k]);
            plain += 8 * sd[k] / 400 * exp(-from * from / (2 * sd[k] * sd[k])) / (sd[k] * sqrt(2 * GEO_PI));
        }
        f->ours = stable_worse(f->ours, fabs(sum - 1));
        f->naive = stable_worse(f->naive, fabs(plain - 1));
    }
    /* Thirty deviations out, where 1 - Phi is 0: relative to erfcl. Naive: a difference of erf. */
    const long double want = (erfcl(30 / sqrtl(2)) - erfcl(31 / sqrtl(2))) / 2;
    const double naive = (erf(31 / sqrt(2)) - erf(30 / sqrt(2))) / 2;
    f->ours = stable_worse(f->ours, fabs((double)(gauss_between(30, 31, 0, 1) / want) - 1));
    f->naive = stable_worse(f->naive, fabs((double)(naive / want) - 1));
    double around = 0;
    for (int i = 0; i < 360; i++)
        around += gauss_around(geo_rad(i), geo_rad(i + 1), 1, 3);
    f->ours = stable_worse(f->ours, fabs(around - 1));
}

/* The distribution on the sphere that knows no pole (von Mises and Fisher),
 * over a cell so far beside the axis: midpoints. */
static double around_axis(double off, double cell, double sd)
{
    const int n = 200;
    double sum = 0;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            const double az = cell * ((i + 0.5) / n - 0.5), el = off + cell * ((k + 0.5) / n - 0.5);
            sum += exp((cos(el) * cos(az) - 1) / (sd * sd)) * cos(el);
        }
    return sum;
}

/* Weights beside a beam that points 0.7 degrees off the pole, towards it and beyond, against that distribution over the
 * same cells. Naive: normal distributions of azimuth and elevation. */
static void at_the_pole(bool quick, struct stable_found *f)
{
    const double sd = geo_rad(2), cell = geo_rad(1), half = sd * 1.1774100225154747, pole = geo_rad(0.7);
    const struct spread s = spread_of(0.03, half, half, 2, &(struct spread_cell){0.05, cell, cell}, false);
    const double axis = around_axis(0, cell, sd);
    (void)quick;
    f->naive = f->ours = 0;
    for (double off = 0; off < 2 * sd; off += sd / 8) {
        const double want = around_axis(off, cell, sd) / axis;
        const double turn = off > pole ? GEO_PI : 0, el = off > pole ? off - 2 * pole : off;
        const double plain = exp(-(turn * turn + el * el) / (2 * sd * sd));
        f->ours = stable_worse(f->ours, fabs(spread_across(&s, 0, off, cell, cell) / want - 1));
        f->naive = stable_worse(f->naive, fabs(plain / want - 1));
    }
}

/* Every second edge of a fine series, against the coarse one, in 2 + i ulp: g * g is rounded,
 * and edge i has it i times. */
static void coarse_and_fine(bool quick, struct stable_found *f)
{
    const double g = 1.02, dr = 0.04;
    const struct layers_conf fine = {.r_min_m = 0.5, .r_max_m = 100, .dr_m = dr, .growth = g};
    const struct layers_conf coarse = {.r_min_m = 0.5, .r_max_m = 100, .dr_m = dr * (1 + g) / g, .growth = g * g};
    double sum = 0.5, thick = dr;
    (void)quick;
    f->naive = f->ours = 0;
    for (uint32_t i = 1; 2 * i <= layers_count(&fine); i++) {
        const double want = layers_edge(&fine, 2 * i), unit = want * DBL_EPSILON * (2 + i);
        f->ours = stable_worse(f->ours, fabs(layers_edge(&coarse, i) - want) / unit);
        sum += thick *= g;
        sum += thick *= g; /* naive: layers added up one by one */
        f->naive = stable_worse(f->naive, fabs(sum - want) / unit);
    }
}

const struct stable_case stable_cells[] = {
    {"G1", "layers that grow by 1, 1 + 2^-52 ... 1000", "error of edges over 4 + i ln g ulp",
     "dr (g^j - 1) / (g - 1)", 1, growths},
    {"G2", "ranges on every edge, next to it, NaN, infinite", "wrong layers", "the logarithm of the series", 0,
     at_edges},
    {"G3", "layers from range 0", "wrong answers at 0, -0 and 5e-324", "a geometric series", 0, from_zero},
    {"G4", "growth below 1, thickness 0, NaN, a billion layers", "accepted", "layers are added until it is enough",
     0, senseless_layers},
    {"G5", "azimuths 2 pi, -0, -1e-17, 1e9 turns; the poles", "invalid or wrong directions", "fmod and floor", 0,
     angles},
    {"G6", "all cells of the sphere, steps of 90 to 0.5 degrees", "solid angle off 4 pi", "equal steps of azimuth",
     1e-15, all_the_sphere},
    {"G7", "neighbours of all directions, rings of 1, 2, 3 cells", "pairs one-sided or double",
     "index times n / m", 0, neighbours},
    {"G8", "an echo shared out, sd 1e-6 to wider than the circle, 30 sd out", "mass missing, relative error",
     "midpoints; a difference of erf", 1e-10, shares},
    {"G9", "a beam next to the pole, weights beside its axis", "relative error", "azimuth times elevation", 0.002,
     at_the_pole},
    {"G22", "a coarse series and every second edge of a fine one", "difference over 2 + i ulp",
     "layers added one by one", 1, coarse_and_fine},
    {0},
};
