/* SPDX-License-Identifier: MIT */
#include "layers.h"

#include <math.h>

double layers_edge(const struct layers_conf *c, uint32_t i)
{
    if (i <= c->n_const)
        return c->r_min_m + i * c->dr_m;
    double j = i - c->n_const, g1 = c->growth - 1; /* exact */
    double grown = g1 > 0 ? c->dr_m * c->growth * expm1(j * log1p(g1)) / g1 : c->dr_m * j;
    return c->r_min_m + c->n_const * c->dr_m + grown;
}

uint32_t layers_count(const struct layers_conf *c)
{
    if (!(c->r_min_m >= 0 && c->r_max_m > c->r_min_m && c->dr_m > 0 && c->growth >= 1 && isfinite(c->r_max_m)))
        return 0;
    uint32_t lo = 0, hi = LAYERS_MAX; /* edges rise with i: bisect */
    if (layers_edge(c, hi) < c->r_max_m)
        return 0;
    while (hi - lo > 1) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (layers_edge(c, mid) >= c->r_max_m)
            hi = mid;
        else
            lo = mid;
    }
    return hi;
}

void layers_init(struct layers *layers, const struct layers_conf *conf, double *edge)
{
    layers->conf = *conf;
    layers->n = layers_count(conf);
    for (uint32_t i = 0; i <= layers->n; i++)
        edge[i] = layers_edge(conf, i);
    layers->edge = edge;
    layers->log_growth = log1p(conf->growth - 1);
}

/* The inverse formula guesses within a layer; next to an edge it is often wrong, so the table decides. */
int32_t layers_index(const struct layers *layers, double r_m)
{
    const struct layers_conf *c = &layers->conf;
    double g1 = c->growth - 1, past = r_m - (c->r_min_m + c->n_const * c->dr_m);
    double guess = (r_m - c->r_min_m) / c->dr_m;
    if (past > 0 && g1 > 0)
        guess = c->n_const + log1p(past * g1 / (c->dr_m * c->growth)) / layers->log_growth;
    return layers_from(layers, r_m, guess < layers->n ? (int32_t)guess : (int32_t)layers->n - 1);
}
