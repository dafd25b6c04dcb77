/* SPDX-License-Identifier: MIT */
/*
 * report_relax - relaxation (Auran and Silven 1996, section 3), which sonard does not have: what one step of it would do to
 * the spherical grid's evidence in the made-up basins. Every cell of a direction that was looked at is raised towards its 26
 * neighbours, on a copy, so that no order matters: L += mu * sum over neighbours of max(0, max(0, Lj) - L) / 26.
 *
 *   report_relax [quick]   CSV: mu, seeds, blocked, blocked_false, anew, anew_false, anew_false_low, anew_false_high
 *
 * blocked: cells that are obstacles, of all seeds, before the step; anew: those that become obstacles by it. *_false: the share
 * with no surface in them, anywhere across their width, or within 15 cm.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "../../grid/sphere/sphere.h"
#include "lib/basin.h"
#include "lib/cost.h"

#define SEEDS      6
#define NEIGHBOURS 26.0
#define EDGE_M     0.15
#define ACROSS     4 /* places across a cell's width at which a surface is looked for */

static const struct sphere_conf conf = {.angular_step_rad = 2 * GEO_PI / 180,
                                        .layers = {.r_max_m = 12, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                        .max_cells = 65536,
                                        .forget_s = 160,
                                        .blocked_above = 0.6,
                                        .recentre_m = 0.1,
                                        .range_error = 0.003};

struct tally {
    unsigned blocked, blocked_false, anew, anew_false;
};

static void *room(size_t bytes)
{
    void *p = bytes ? aligned_alloc(64, (bytes + 63) / 64 * 64) : NULL;

    if (!p) {
        fprintf(stderr, "report_relax: no memory\n");
        exit(1);
    }
    return p;
}

/* The grid after all turns; *t_ns: of its last ping. */
static struct sphere *drive(const struct basin *basin, uint64_t *t_ns)
{
    struct beam_echoes heard;
    struct echoes e = {.beam = &heard};
    char err[200];
    struct sphere *grid = sphere_init(room(sphere_bytes(&conf, err, sizeof err)), &conf);

    for (unsigned i = 0; i < BASIN_TURNS * BASIN_BEAMS; i++) {
        basin_listen(basin, i / BASIN_BEAMS, i % BASIN_BEAMS, false, &e);
        sphere_enter(grid, &e, &mount_identity);
    }
    *t_ns = e.t_ns;
    return grid;
}

/* Log-odds by [direction][layer]; 0: no cell. */
static double *evidence_of(const struct sphere *grid, uint32_t directions, uint32_t layers, uint64_t t_ns)
{
    double *of = room((size_t)directions * layers * sizeof *of);
    struct sphere_cell cell;

    for (size_t i = 0; i < (size_t)directions * layers; i++)
        of[i] = 0;
    for (uint32_t d = 0; d < directions; d++)
        for (uint32_t k = 0; sphere_cell(grid, d, k, t_ns, &cell); k++)
            of[(size_t)d * layers + cell.layer] = cell.logodds;
    return of;
}

static double relaxed(const struct rings *rings, const double *of, uint32_t layers, uint32_t d, uint32_t layer,
                      double mu)
{
    const double own = of[(size_t)d * layers + layer];
    struct rings_run run[3];
    double sum = 0;

    const unsigned runs = rings_touching(rings, d, run);
    for (unsigned r = 0; r < runs; r++)
        for (uint32_t k = 0; k < run[r].n; k++)
            for (uint32_t l = layer > 0 ? layer - 1 : 0; l <= layer + 1 && l < layers; l++)
                sum += fmax(0, fmax(0, of[(size_t)rings_in(&run[r], k) * layers + l]) - own);
    return own + mu * sum / NEIGHBOURS;
}

/* The basin is alike at all depths: a direction's range over the ground is what counts. */
static bool has_surface(const struct basin *basin, const double place[2], const struct rings *rings, uint32_t d,
                        uint32_t layer)
{
    const double from_m = layers_edge(&conf.layers, layer), to_m = layers_edge(&conf.layers, layer + 1);
    double az_rad, el_rad;

    rings_centre(rings, d, &az_rad, &el_rad);
    const double width_rad = rings_width(rings, rings_ring(rings, d));
    for (int k = -ACROSS; k <= ACROSS; k++) {
        unsigned post;
        const double range_m =
            basin_range(basin, place, az_rad + width_rad * k / (2 * ACROSS), &post) / cos(el_rad);
        if (range_m >= from_m - EDGE_M && range_m <= to_m + EDGE_M)
            return true;
    }
    return false;
}

static void relax(unsigned seed, double mu, struct tally *t)
{
    struct basin basin;
    uint64_t t_ns;
    double centre_m[3];

    basin_make(&basin, seed);
    struct sphere *grid = drive(&basin, &t_ns);
    const struct picture *picture = sphere_picture(grid);
    const struct rings *rings = picture->rings;
    const uint32_t layers = layers_count(&conf.layers);
    const double blocked = (double)picture->blocked_logodds;
    double *of = evidence_of(grid, rings->n, layers, t_ns);

    sphere_centre(grid, centre_m);
    for (uint32_t d = 0; d < rings->n; d++) {
        if (sphere_pinged(grid, d) == 0)
            continue;
        for (uint32_t l = 0; l < layers; l++) {
            const double before = of[(size_t)d * layers + l];
            if (relaxed(rings, of, layers, d, l, mu) <= blocked)
                continue;
            const bool is_false = !has_surface(&basin, centre_m, rings, d, l);
            t->blocked += before > blocked;
            t->blocked_false += before > blocked && is_false;
            t->anew += before <= blocked;
            t->anew_false += before <= blocked && is_false;
        }
    }
    free(of);
    free(grid);
}

int main(int argc, char **argv)
{
    static const double mu[] = {0.1, 0.25, 0.5, 1};
    const bool quick = argc > 1 && argv[1][0] == 'q';
    const unsigned seeds = quick ? 1 : SEEDS;

    printf("mu,seeds,blocked,blocked_false,anew,anew_false,anew_false_low,anew_false_high\n");
    for (int m = 0; m < 4; m++) {
        struct tally all = {0};
        double share[SEEDS];
        for (unsigned seed = 0; seed < seeds; seed++) {
            struct tally t = {0};
            relax(seed + 1, mu[m], &t);
            share[seed] = t.anew_false / fmax(t.anew, 1);
            all.blocked += t.blocked;
            all.blocked_false += t.blocked_false;
            all.anew += t.anew;
            all.anew_false += t.anew_false;
        }
        cost_sort(share, seeds);
        printf("%g,%u,%u,%.3g,%u,%.3g,%.3g,%.3g\n", mu[m], seeds, all.blocked,
               all.blocked_false / fmax(all.blocked, 1), all.anew, all.anew_false / fmax(all.anew, 1), share[0],
               share[seeds - 1]);
    }
    return 0;
}
