/* SPDX-License-Identifier: MIT */
/* background_keep - see background_keep.h. */
#include "background_keep.h"

#include <math.h>
#include <string.h>

#include "dbscan.h"

struct cluster {
    uint64_t level; /* sum */
    uint32_t cells;
    uint32_t first_col, last_col;
    uint32_t rows, last_row; /* touched; the last of them */
};

static size_t aligned(size_t n)
{
    return (n + 15) / 16 * 16;
}

struct work {
    int32_t *label;
    struct cluster *cluster; /* at most one per cell */
    uint8_t *point;
    int16_t *reach;
    void *dbscan;
};

static size_t divide(const struct background_shape *s, uint8_t *mem, struct work *w)
{
    const size_t cells = (size_t)s->rows * s->bins;
    const size_t size[] = {cells * sizeof *w->label, cells * sizeof *w->cluster, cells,
                           s->bins * (2u * DBSCAN_SPAN_MAX + 1) * sizeof *w->reach,
                           dbscan_work_size(s->rows, s->bins)};
    size_t at[6] = {0};
    for (int i = 0; i < 5; i++)
        at[i + 1] = at[i] + aligned(size[i]);
    if (mem)
        *w = (struct work){.label = (int32_t *)(void *)(mem + at[0]),
                           .cluster = (struct cluster *)(void *)(mem + at[1]),
                           .point = mem + at[2],
                           .reach = (int16_t *)(void *)(mem + at[3]),
                           .dbscan = mem + at[4]};
    return at[5];
}

size_t background_keep_size(const struct background_shape *shape)
{
    return divide(shape, NULL, NULL);
}

static double edge_m(const struct background_shape *s, uint32_t col)
{
    return (double)s->r0_m + (double)col * (double)s->dr_m;
}

/* Loud cells beyond the ring. */
static void mark_points(const struct background *b, uint32_t first_col, uint8_t *point)
{
    const struct background_shape *s = &b->shape;
    background_mask(b->level, (size_t)s->rows * s->bins, b->mask_above, point);
    for (uint32_t row = 0; row < s->rows; row++)
        memset(point + (size_t)row * s->bins, 0, first_col);
}

static uint32_t find_clusters(const struct background_shape *s, const struct background_rule *rule, struct work *w)
{
    const double span = floor(rule->neighbour_m / (double)s->dr_m);
    const struct dbscan d = {.rows = s->rows,
                             .cols = s->bins,
                             .wrap = s->head_turn != 0,
                             .span = span < DBSCAN_SPAN_MAX ? (uint32_t)span : DBSCAN_SPAN_MAX,
                             .reach = w->reach,
                             .min_points = rule->min_points};
    const struct dbscan_polar picture = {.row_rad = (double)s->row_rad,
                                         .r0_m = (double)s->r0_m,
                                         .dr_m = (double)s->dr_m,
                                         .rows = s->rows,
                                         .cols = s->bins};
    dbscan_reach_metric(rule->neighbour_m, &picture, d.span, w->reach);
    return dbscan_run(&d, w->point, w->dbscan, w->label);
}

static void measure_cluster(const struct background *b, const int32_t *label, struct cluster *cluster)
{
    const struct background_shape *s = &b->shape;
    for (uint32_t row = 0; row < s->rows; row++) {
        for (uint32_t col = 0; col < s->bins; col++) {
            const size_t i = (size_t)row * s->bins + col;
            if (label[i] < 0)
                continue;
            struct cluster *c = &cluster[label[i]];
            c->first_col = c->cells == 0 || col < c->first_col ? col : c->first_col;
            c->last_col = col > c->last_col ? col : c->last_col;
            c->rows += c->cells == 0 || c->last_row != row;
            c->last_row = row;
            c->level += b->level[i];
            c->cells++;
        }
    }
}

static bool is_vehicle(const struct background_shape *s, const struct background_rule *rule,
                       const struct cluster *c)
{
    const double far_m = edge_m(s, c->last_col + 1);
    return (double)c->level >= rule->min_level * c->cells && far_m - edge_m(s, c->first_col) <= rule->extent_m &&
           far_m <= rule->reach_m && c->rows <= rule->share * s->rows;
}

void background_keep(struct background *b, const struct background_rule *rule, void *work,
                     struct background_kept *kept)
{
    const struct background_shape *s = &b->shape;
    const size_t cells = (size_t)s->rows * s->bins;
    const double ring = ceil((rule->ring_m - (double)s->r0_m) / (double)s->dr_m);
    struct work w;
    divide(s, work, &w);
    mark_points(b, ring <= 0 ? 0 : ring < s->bins ? (uint32_t)ring : s->bins, w.point);
    *kept = (struct background_kept){.clusters = find_clusters(s, rule, &w)};
    memset(w.cluster, 0, kept->clusters * sizeof *w.cluster);
    measure_cluster(b, w.label, w.cluster);
    for (uint32_t k = 0; k < kept->clusters; k++)
        kept->kept += is_vehicle(s, rule, &w.cluster[k]);
    for (size_t i = 0; i < cells; i++) {
        if (w.point[i] && (w.label[i] < 0 || !is_vehicle(s, rule, &w.cluster[w.label[i]]))) {
            b->level[i] = 0;
            kept->removed++;
        }
        kept->blind += b->level[i] > b->mask_above;
    }
}
