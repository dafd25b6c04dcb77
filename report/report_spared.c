/* SPDX-License-Identifier: MIT */
/*
 * report_spared - what the spherical grid's parts cost that a scene may do without: motion, elevation, clusters, a
 * second grid, in a made-up basin; whether leaving them out changes what the main grid says of a direction; and what
 * balanced rings spare against uniform ones.
 *
 *   report_spared proof [quick]   CSV: part, must_be, directions, changed, bytes, nanoseconds per beam
 *   report_spared count [quick]   CSV: part, beams, for callgrind to count the instructions of spared_run
 *   report_spared rings           CSV: step, layout, directions, least and most solid angle, directions in a beam
 */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/sphere/clusters.h"
#include "grid/sphere/sphere.h"
#include "report/lib/basin.h"
#include "report/lib/cost.h"

#define MAX_CELLS   65536
#define REPETITIONS 7
#define GRIDS       2

static const struct part {
    const char *name, *must;
    bool pose, drives, level, clusters, second;
} parts[] = {
    {.name = "none of them", .must = "same"},
    {.name = "a pose while it stands still", .must = "same", .pose = true},
    {.name = "motion of 0.25 m per turn", .must = "-", .pose = true, .drives = true},
    {.name = "level instead of full", .must = "-", .level = true},
    {.name = "clusters asked for once a turn", .must = "same", .clusters = true},
    {.name = "a second grid", .must = "same", .second = true},
};
#define PARTS (sizeof parts / sizeof parts[0])

struct set {
    const struct part *part;
    struct sphere *grid[GRIDS];
    unsigned grids;
    void *memory[GRIDS + 1];
    struct clusters *clusters;
    size_t bytes;
};

static struct beam_echoes heard[BASIN_TURNS * BASIN_BEAMS];
static struct echoes ping[BASIN_TURNS * BASIN_BEAMS];

static void *room(struct set *set, unsigned which, size_t bytes)
{
    set->bytes += bytes;
    set->memory[which] = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (!set->memory[which] || bytes == 0) {
        fprintf(stderr, "report_spared: no memory\n");
        exit(1);
    }
    return set->memory[which];
}

static void make(struct set *set, const struct part *part)
{
    const struct sphere_conf conf = {.angular_step_rad = 2 * GEO_PI / 180,
                                     .level = part->level,
                                     .level_half_rad = geo_rad(BASIN_EL_DEG / 2),
                                     .layers = {.r_max_m = 12, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                     .max_cells = MAX_CELLS,
                                     .forget_s = 160,
                                     .blocked_above = 0.6,
                                     .recentre_m = 0.1};
    struct fault fault;
    *set = (struct set){.part = part, .grids = part->second ? 2 : 1};
    for (unsigned g = 0; g < set->grids; g++)
        set->grid[g] = sphere_init(room(set, g, sphere_bytes(&conf, &fault)), &conf);
    if (part->clusters) {
        const struct picture *picture = sphere_picture(set->grid[0]);
        set->clusters = clusters_init(room(set, GRIDS, clusters_bytes(picture->rings, MAX_CELLS)), picture->rings,
                                      MAX_CELLS, (double)picture->blocked_logodds);
    }
}

static void drop(struct set *set)
{
    for (unsigned i = 0; i <= GRIDS; i++)
        free(set->memory[i]);
}

static void listen(const struct part *part)
{
    struct basin basin;
    basin_make(&basin, 1);
    for (unsigned i = 0; i < BASIN_TURNS * BASIN_BEAMS; i++) {
        ping[i].beam = &heard[i];
        basin_listen(&basin, i / BASIN_BEAMS, i % BASIN_BEAMS, !part->drives, &ping[i]);
        if (!part->pose)
            ping[i].pose = pose_identity;
    }
}

void spared_run(struct set *set, unsigned turns);

/* So many turns; a function of its own, for callgrind. */
void spared_run(struct set *set, unsigned turns)
{
    const struct cluster *list;
    uint32_t all;
    for (unsigned i = 0; i < turns * BASIN_BEAMS; i++) {
        for (unsigned g = 0; g < set->grids; g++)
            sphere_enter(set->grid[g], &ping[i], &mount_identity);
        if (set->clusters && i % BASIN_BEAMS == BASIN_BEAMS - 1)
            clusters_look(set->clusters, set->grid[0], ping[i].t_ns, &list, &all);
    }
}

/* Directions of which the two main grids do not say the same, bit for bit;
 * all when they are not the same directions. */
static uint32_t changed(struct set *a, struct set *b)
{
    struct picture *p = sphere_picture(a->grid[0]), *q = sphere_picture(b->grid[0]);
    uint32_t n = 0;
    if (p->rings->n != q->rings->n)
        return p->rings->n;
    for (uint32_t d = 0; d < p->rings->n; d++) {
        struct picture_entry x, y;
        memset(&x, 0, sizeof x);
        memset(&y, 0, sizeof y);
        picture_get(p, d, &x);
        picture_get(q, d, &y);
        n += memcmp(&x, &y, sizeof x) != 0;
    }
    return n;
}

static void proof(unsigned repetitions)
{
    struct set plain, set;
    printf("part,must_be,directions,changed,bytes,ns,ns_low,ns_high\n");
    for (size_t k = 0; k < PARTS; k++) {
        double ns[REPETITIONS];
        make(&plain, &parts[0]);
        listen(&parts[0]);
        spared_run(&plain, BASIN_TURNS);
        listen(&parts[k]);
        for (unsigned r = 0; r < repetitions; r++) {
            make(&set, &parts[k]);
            const double begin_ns = cost_now_ns();
            spared_run(&set, BASIN_TURNS);
            ns[r] = (cost_now_ns() - begin_ns) / (BASIN_TURNS * BASIN_BEAMS);
            if (r + 1 < repetitions)
                drop(&set);
        }
        const struct cost_spread spread = cost_spread_of(ns, repetitions);
        printf("%s,%s,%u,%u,%zu,%.5g,%.5g,%.5g\n", parts[k].name, parts[k].must,
               sphere_picture(set.grid[0])->rings->n, changed(&plain, &set), set.bytes, spread.median, spread.low,
               spread.high);
        drop(&set);
        drop(&plain);
    }
}

static void count(unsigned turns)
{
    struct set set;
    printf("part,bins\n");
    for (size_t k = 0; k < PARTS; k++) {
        make(&set, &parts[k]);
        listen(&parts[k]);
        spared_run(&set, turns);
        printf("%s,%u\n", parts[k].name, turns * BASIN_BEAMS);
        cost_mark();
        drop(&set);
    }
}

/* Directions with their middle in a cone of 5 degrees to each side at an elevation;
 * each ring has n cells when uniform. */
static uint32_t in_cone(const struct rings *rings, uint32_t uniform, double el_rad)
{
    double axis[3], u[3];
    uint32_t held = 0;
    geo_direction(0.01, el_rad, axis);
    for (uint32_t j = 0; j < rings->n_rings; j++) {
        const uint32_t n = uniform ? uniform : rings->start[j + 1] - rings->start[j];
        for (uint32_t i = 0; i < n; i++) {
            geo_direction((i + 0.5) * GEO_TURN / n, rings->top_rad - (j + 0.5) * rings->height_rad, u);
            held += u[0] * axis[0] + u[1] * axis[1] + u[2] * axis[2] >= cos(geo_rad(5));
        }
    }
    return held;
}

static void rings_of(double step_deg, bool uniform)
{
    static struct rings rings;
    double least = INFINITY, most = 0;
    uint32_t directions = 0, n;
    rings_full(&rings, geo_rad(step_deg));
    const uint32_t around = uniform ? (uint32_t)ceil(GEO_TURN / rings.step_rad - 1e-9) : 0;
    for (uint32_t j = 0; j < rings.n_rings; j++, directions += n) {
        n = around ? around : rings.start[j + 1] - rings.start[j];
        const double solid = 2 * GEO_TURN * rings.cos_el[j] * sin(rings.height_rad / 2) / n;
        least = fmin(least, solid);
        most = fmax(most, solid);
    }
    printf("%g,%s,%u,%.3g,%.3g,%u,%u,%u\n", step_deg, uniform ? "uniform" : "balanced", directions,
           least / (rings.step_rad * rings.step_rad), most / (rings.step_rad * rings.step_rad),
           in_cone(&rings, around, 0), in_cone(&rings, around, geo_rad(60)), in_cone(&rings, around, geo_rad(89)));
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    if (strcmp(what, "proof") == 0)
        proof(quick ? 3 : REPETITIONS);
    else if (strcmp(what, "count") == 0)
        count(quick ? 1 : 3);
    else if (strcmp(what, "rings") == 0) {
        printf("step_deg,layout,directions,least_cell,most_cell,at_0,at_60,at_89\n");
        for (int k = 0; k < 3; k++)
            for (int uniform = 0; uniform < 2; uniform++)
                rings_of((const double[]){1, 2, 5}[k], uniform);
    } else {
        fprintf(stderr, "usage: report_spared proof|count|rings [quick]\n");
        return 2;
    }
    return 0;
}
