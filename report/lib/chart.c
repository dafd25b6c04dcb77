/* SPDX-License-Identifier: MIT */
/* chart - submaps of made-up worlds, graded; see chart.h. */
#include "chart.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "daemon/wiring.h"

static void *room(size_t bytes)
{
    void *p = bytes > 0 ? calloc(1, bytes) : NULL;
    if (!p) {
        fprintf(stderr, "chart: no memory\n");
        exit(1);
    }
    return p;
}

#define EACH_CELL(c, cell)                                                                                        \
    for (int64_t cell[3] = {(c)->box.first[0]}; cell[0] < (c)->box.first[0] + (c)->box.size[0]; cell[0]++)        \
        for (cell[1] = (c)->box.first[1]; cell[1] < (c)->box.first[1] + (c)->box.size[1]; cell[1]++)              \
            for (cell[2] = (c)->box.first[2]; cell[2] < (c)->box.first[2] + (c)->box.size[2]; cell[2]++)

static bool is_free(const struct chart *c, const int64_t cell[3])
{
    return chart_cell(c, cell) == VOXEL_FREE;
}

/* As in grid/voxel/voxmap.c. */
#define EDGE_WIDER 1.22

struct lattice_place chart_place(const struct chart *c, const double at[3])
{
    double position_m[3];
    struct lattice_place place;
    for (int a = 0; a < 3; a++)
        position_m[a] = c->world->origin_m[a] + at[a];
    if (!lattice_place(position_m, c->set.voxel_m, &place))
        abort();
    return place;
}

void chart_center(const struct chart *c, const int64_t cell[3], double at[3])
{
    for (int a = 0; a < 3; a++)
        at[a] = ((double)cell[a] + 0.5) * c->set.voxel_m - c->world->origin_m[a];
}

struct chart_setting chart_setting_of(const struct conf *conf)
{
    struct pipeline_conf pipeline;
    struct plan plan;
    plan_make(conf, &plan);
    wiring_pipeline(conf, &plan, true, &pipeline);
    if (!pipeline.map) {
        fprintf(stderr, "chart: the configuration has no map\n");
        exit(1);
    }
    const struct voxmap_setting *s = &pipeline.voxels;
    return (struct chart_setting){.voxel_m = s->voxel_m,
                                  .tolerance_m = s->tolerance_m,
                                  .rule = s->rule,
                                  .opening = s->opening,
                                  .echoes = s->keep_echoes,
                                  .body_m = s->body_radius_m};
}

struct chart *chart_make(const struct place *world, const struct chart_setting *set)
{
    struct chart *c = room(sizeof *c);
    double middle[3], side_m = 0;
    struct fault fault;
    c->world = world;
    c->set = *set;
    const double az_rad = geo_rad(DIVE_AZ_DEG / 2), el_rad = geo_rad(DIVE_EL_DEG / 2);
    const double share = set->opening > 0 ? set->opening : 1;
    if (!cast_opening_init(&c->opening, CAST_WEDGE, az_rad, share * el_rad, set->tolerance_m, &fault) ||
        !cast_opening_init(&c->axis_opening, CAST_WEDGE, az_rad, share / 2 * el_rad, set->tolerance_m, &fault) ||
        !cast_opening_init(&c->edge_opening, CAST_WEDGE, EDGE_WIDER * az_rad, el_rad, set->tolerance_m, &fault) ||
        !cast_opening_init(&c->whole_opening, CAST_WEDGE, az_rad, el_rad, set->tolerance_m, &fault) ||
        !cast_opening_init(&c->heard_opening, CAST_WEDGE, az_rad, el_rad, 0, &fault)) {
        fprintf(stderr, "chart: %s\n", fault.text);
        exit(1);
    }
    const struct lattice_place low = chart_place(c, world->low), high = chart_place(c, world->high);
    for (int a = 0; a < 3; a++) {
        middle[a] = (world->low[a] + world->high[a]) / 2;
        c->box.first[a] = low.cell[a];
        c->box.size[a] = (int32_t)(high.cell[a] - low.cell[a]);
        side_m = a < 2 ? fmax(side_m, world->high[a] - world->low[a]) : side_m;
    }
    const uint32_t side = (uint32_t)(side_m / set->voxel_m / TILE_SIDE) + 3, height = (uint32_t)c->box.size[2] + 2;
    const struct lattice_place base = chart_place(c, middle);
    tiles_init(&c->tiles, room(tiles_bytes(side * side, height, 1 + set->echoes)), side * side, height,
               1 + set->echoes);
    submap_init(&c->map, room(submap_bytes(side, height)), side, &c->tiles, &base);
    return c;
}

void chart_free(struct chart *c)
{
    free(c->tiles.next); /* where their memory begins */
    free(c->map.tile);
    free(c);
}

bool chart_aim(const struct chart *c, const struct cast_opening *opening, const struct dive_look *look,
               const double at[3], double near_m, double far_m, struct cast_beam *beam)
{
    const struct lattice_place apex = chart_place(c, at);
    return cast_aim(beam, opening,
                    &(struct cast_look){.apex = &apex,
                                        .attitude = look->attitude,
                                        .near_m = near_m,
                                        .far_m = far_m,
                                        .voxel_m = c->set.voxel_m});
}

/* The body is stamped again only when it has moved by a part of a voxel. */
static void enter_body(struct chart *c, const double at[3])
{
    double moved2 = 0;
    for (int a = 0; a < 3; a++)
        moved2 += (at[a] - c->body[a]) * (at[a] - c->body[a]);
    if (!(c->set.body_m > 0) || (c->stamped && moved2 < c->set.voxel_m * c->set.voxel_m / 16))
        return;
    const struct lattice_place here = chart_place(c, at);
    submap_body(&c->map, &here, &here, c->set.body_m / c->set.voxel_m, UINT8_MAX);
    c->stamped = true;
    memcpy(c->body, at, sizeof c->body);
}

/* Free from *from_m to to_m through one opening; afterwards *from_m lies just behind. */
static void enter_stretch(struct chart *c, const struct cast_opening *opening, const struct dive_look *look,
                          const double at[3], double *from_m, double to_m)
{
    struct cast_beam beam;
    if (!(to_m > *from_m) || !chart_aim(c, opening, look, at, *from_m, to_m, &beam))
        return;
    submap_cast(&c->map, &beam, SUBMAP_VACANCY);
    *from_m = to_m * (1 + 4 * DBL_EPSILON);
}

/* As voxmap_enter has it. */
static void enter_water(struct chart *c, const struct dive_look *look, const double at[3],
                        const struct beam_echoes *heard)
{
    const double axis_m = (double)heard->free_to_m, side_m = (double)heard->side_to_m;
    const double edge_from_m = (double)heard->surface_from_m, edge_m = (double)heard->surface_to_m;
    double from_m = (double)heard->blind_m;
    if (!heard->off_axis || !(c->set.opening > 0)) {
        enter_stretch(c, &c->opening, look, at, &from_m, axis_m);
        return;
    }
    const double whole_from_m = fmax(from_m, (double)heard->edge_from_m);
    const double whole_m = fmin((double)heard->edge_to_m, c->set.body_m / sin(geo_rad(DIVE_EL_DEG / 2)));
    if (whole_m > whole_from_m) {
        enter_stretch(c, &c->opening, look, at, &from_m, fmin(whole_from_m, side_m));
        from_m = fmax(from_m, whole_from_m);
        enter_stretch(c, &c->whole_opening, look, at, &from_m,
                      edge_m > edge_from_m ? fmin(whole_m, edge_from_m) : whole_m);
    }
    if (edge_m > edge_from_m) {
        enter_stretch(c, &c->opening, look, at, &from_m, fmin(edge_from_m, side_m));
        from_m = fmax(from_m, edge_from_m);
        enter_stretch(c, &c->edge_opening, look, at, &from_m, edge_m);
    }
    if (whole_m > whole_from_m)
        enter_stretch(c, &c->whole_opening, look, at, &from_m, whole_m);
    enter_stretch(c, &c->opening, look, at, &from_m, side_m);
    enter_stretch(c, &c->axis_opening, look, at, &from_m, axis_m);
}

void chart_enter(struct chart *c, const struct dive_look *look, const double at[3],
                 const struct beam_echoes *heard)
{
    const double half = c->set.voxel_m / 2;
    struct cast_beam beam;
    enter_water(c, look, at, heard);
    for (unsigned e = 0; c->set.echoes && e < heard->n; e++) {
        const double near_m = fmax(0, (double)heard->echo[e].near_m - half);
        if (chart_aim(c, &c->heard_opening, look, at, near_m,
                      (double)(heard->echo[e].range_m + heard->echo[e].sd_m) + half, &beam))
            submap_cast(&c->map, &beam, SUBMAP_ECHOES);
    }
    enter_body(c, at);
}

void chart_enter_truth(struct chart *c, const struct dive_look *look, double range_error_m)
{
    struct cast_beam beam;
    if (chart_aim(c, &c->opening, look, look->at, 0, look->first_m + range_error_m, &beam))
        submap_cast(&c->map, &beam, SUBMAP_VACANCY);
    enter_body(c, look->at);
}

uint8_t *chart_count(struct chart *c, const int64_t cell[3], enum submap_plane plane)
{
    struct submap *m = &c->map;
    const int32_t i = (int32_t)(cell[0] - m->box.first[0]), j = (int32_t)(cell[1] - m->box.first[1]);
    uint32_t *tile = &m->tile[submap_entry(m, i, j)];
    if (*tile == TILE_NONE)
        *tile = tiles_take(m->tiles);
    return tiles_column(m->tiles, *tile, submap_column(i, j), plane) + (cell[2] - m->box.first[2]);
}

static bool in_sight(const struct chart *c, const struct dive_look *look, const int64_t cell[3])
{
    double at[3], direction[3], away_m = 0;
    chart_center(c, cell, at);
    for (int a = 0; a < 3; a++) {
        direction[a] = at[a] - look->at[a];
        away_m = hypot(away_m, direction[a]);
    }
    for (int a = 0; a < 3; a++)
        direction[a] /= away_m;
    return away_m > 0 && place_ray(c->world, look->at, direction, away_m, look->t_s) >= away_m;
}

void chart_enter_sight(struct chart *c, const struct dive_look *look)
{
    struct cast_beam beam;
    if (chart_aim(c, &c->opening, look, look->at, 0, DIVE_RANGE_M, &beam))
        EACH_CELL(c, cell)
        {
            if (!is_free(c, cell) && cast_slack(&beam, cell) >= 0 && in_sight(c, look, cell))
                *chart_count(c, cell, SUBMAP_VACANCY) = UINT8_MAX;
        }
    enter_body(c, look->at);
}

enum voxel_state chart_cell(const struct chart *c, const int64_t cell[3])
{
    return voxel_judge(&c->set.rule, submap_count(&c->map, SUBMAP_VACANCY, cell),
                       submap_count(&c->map, SUBMAP_ECHOES, cell));
}

enum voxel_state chart_state(const struct chart *c, const double at[3])
{
    const struct lattice_place place = chart_place(c, at);
    return chart_cell(c, place.cell);
}

/* ---- errors ---- */

double chart_false_free(const struct chart *c, double t_s, double *behind_max_m, double *free_m3)
{
    const double voxel_m3 = c->set.voxel_m * c->set.voxel_m * c->set.voxel_m;
    uint64_t free_voxels = 0, wrong = 0;
    double at[3];
    *behind_max_m = 0;
    EACH_CELL(c, cell)
    {
        if (!is_free(c, cell))
            continue;
        free_voxels++;
        chart_center(c, cell, at);
        const double clear = place_clearance(c->world, at, NULL, t_s);
        if (clear <= 0) {
            wrong++;
            *behind_max_m = fmax(*behind_max_m, -clear);
        }
    }
    *free_m3 = (double)free_voxels * voxel_m3;
    return (double)wrong * voxel_m3;
}

/* What a chart and its reference have free in common, voxel by voxel of the reference. */
static void overlap(const struct chart *c, const struct chart *reference, struct chart_errors *out)
{
    uint64_t either = 0, both = 0, there = 0;
    double at[3];
    EACH_CELL(reference, cell)
    {
        chart_center(reference, cell, at);
        const bool truth = is_free(reference, cell), found = chart_state(c, at) == VOXEL_FREE;
        either += truth || found;
        both += truth && found;
        there += truth;
    }
    out->overlap = either > 0 ? (double)both / (double)either : 0;
    out->found_share = there > 0 ? (double)both / (double)there : 0;
}

/* Something was heard in a cell or beside it. Without echoes kept that is not known, and all is taken. */
static bool is_heard(const struct chart *c, const int64_t cell[3])
{
    for (int n = 0; n < 27; n++) {
        const int64_t next[3] = {cell[0] + n / 9 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n % 3 - 1};
        if (submap_count(&c->map, SUBMAP_ECHOES, next) > 0)
            return true;
    }
    return !c->set.echoes;
}

static bool is_frontier(const struct chart *c, const int64_t cell[3])
{
    if (!is_free(c, cell))
        return false;
    for (int n = 0; n < 27; n++) {
        const int64_t next[3] = {cell[0] + n / 9 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n % 3 - 1};
        if (!is_free(c, next))
            return true;
    }
    return false;
}

/* Marks the frontier; returns the cells' marks in EACH_CELL's order. */
static uint8_t *frontier_of(const struct chart *c, size_t *n)
{
    const int32_t *size = c->box.size;
    uint8_t *mark = room((size_t)size[0] * (size_t)size[1] * (size_t)size[2]);
    size_t i = 0;
    *n = 0;
    EACH_CELL(c, cell)
    {
        mark[i] = is_frontier(c, cell);
        *n += mark[i++];
    }
    return mark;
}

static void surfaces(const struct chart *c, const struct chart *reference, double t_s, struct chart_errors *out)
{
    size_t n_frontier, n_truth, n = 0, i = 0;
    uint8_t *mark = frontier_of(c, &n_frontier), *truth = frontier_of(reference, &n_truth);
    double *d = room((n_frontier + n_truth + 1) * sizeof *d), at[3];
    EACH_CELL(c, cell)
    {
        if (!mark[i++] || !is_heard(c, cell))
            continue;
        chart_center(c, cell, at);
        d[n++] = fabs(place_clearance(c->world, at, NULL, t_s));
    }
    out->to_truth = surface_spread_of(d, n);
    n = i = 0;
    EACH_CELL(reference, cell)
    {
        chart_center(reference, cell, at);
        /* Of the reference's frontier only what lies at a surface, and a part of it is enough. */
        if (truth[i++] && i % 7 == 0 && place_clearance(c->world, at, NULL, t_s) < reference->set.voxel_m) {
            const struct lattice_place place = chart_place(c, at);
            d[n++] = surface_to_marked(&c->box, mark, c->set.voxel_m, &place);
        }
    }
    out->to_map = surface_spread_of(d, n);
    free(mark);
    free(truth);
    free(d);
}

void chart_grade(const struct chart *c, const struct chart *reference, double t_s, struct chart_errors *out)
{
    *out = (struct chart_errors){0};
    out->false_free_m3 = chart_false_free(c, t_s, &out->behind_max_m, &out->free_m3);
    overlap(c, reference, out);
    surfaces(c, reference, t_s, out);
}
