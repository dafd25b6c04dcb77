/* SPDX-License-Identifier: MIT */
/* relax - see relax.h. */
#include "relax.h"

#include <math.h>
#include <string.h>

void relax_init(struct sphere *s, struct relaxed *layer)
{
    s->relax = layer;
    memset(layer, 0, s->layers.n * sizeof *layer);
}

void relax_reach(struct sphere *s)
{
    const uint32_t changed = s->n_dirty;
    for (uint32_t i = 0; i < changed && s->n_dirty < s->rings.n; i++) {
        struct rings_run run[3];
        const unsigned runs = rings_touching(&s->rings, s->dirty[i], run);
        for (unsigned r = 0; r < runs; r++)
            for (uint32_t k = 0; k < run[r].n; k++)
                state_mark(s, rings_in(&run[r], k));
    }
}

/* Layers from `from` up to, not including, `to` hold something. */
struct extent {
    uint32_t from, to;
};

static void extend(struct extent *e, uint32_t layer)
{
    e->from = layer < e->from ? layer : e->from;
    e->to = layer >= e->to ? layer + 1 : e->to;
}

/* Locked cells take no part. */
static void gather_own(const struct sphere *s, uint32_t d, uint64_t t_ns, struct extent *e)
{
    for (uint32_t i = s->cells.first[d]; i != CELLS_NONE; i = s->cells.cell[i].next) {
        const struct cell *c = &s->cells.cell[i];
        s->relax[c->layer].own = c->state == CELL_LOCKED ? (double)INFINITY : state_logodds(s, c, t_ns);
        s->relax[c->layer].cell = i + 1;
        extend(e, c->layer);
    }
}

/* What the cells of a direction that touches have more than the cells that they touch: of up to three the strongest. */
static void gather_beside(const struct sphere *s, uint32_t d, uint64_t t_ns, struct extent *e)
{
    for (uint32_t i = s->cells.first[d]; i != CELLS_NONE; i = s->cells.cell[i].next) {
        const struct cell *c = &s->cells.cell[i];
        const double l = c->state == CELL_LOCKED ? 0 : state_logodds(s, c, t_ns);
        const uint32_t from = c->layer > 0 ? c->layer - 1u : 0, last = s->layers.n - 1;
        for (uint32_t k = from; k <= c->layer + 1u && k <= last; k++) {
            struct relaxed *at = &s->relax[k];
            const double had = at->of == d + 1 ? at->most : at->own;
            if (l <= had)
                continue;
            at->more += l - had;
            at->of = d + 1;
            at->most = l;
            at->t_echo_ns = c->t_echo_ns > at->t_echo_ns ? c->t_echo_ns : at->t_echo_ns;
            at->sd_m = fmaxf(at->sd_m, c->sd_m);
            extend(e, k);
        }
    }
}

/* As the echo of the direction's own cell there, or without one as the whole layer. */
static struct picture_obstacle obstacle_of(const struct sphere *s, uint32_t layer, double logodds, uint64_t t_ns)
{
    const struct relaxed *at = &s->relax[layer];
    struct picture_obstacle o = {.t_ref_ns = t_ns, .t_echo_ns = at->t_echo_ns, .logodds = (float)logodds};
    if (at->cell) {
        const struct cell *c = &s->cells.cell[at->cell - 1];
        double v[3];
        o.range_m = (float)state_vector(s, c, v);
        o.near_m = fmaxf(0, o.range_m - c->near_m);
        o.sd_m = c->sd_m;
    } else {
        o.range_m = (float)((s->layers.edge[layer] + s->layers.edge[layer + 1]) / 2);
        o.near_m = (float)s->layers.edge[layer];
        o.sd_m = at->sd_m;
    }
    return o;
}

static void put(struct picture_obstacle *obstacle, unsigned n, struct picture_obstacle o)
{
    for (; n > 0 && obstacle[n - 1].range_m > o.range_m; n--)
        obstacle[n] = obstacle[n - 1];
    obstacle[n] = o;
}

/* What stands around the direction, and in it; returns how many directions touch it. Forgotten by forget(). */
static uint32_t gather_around(const struct sphere *s, uint32_t d, uint64_t t_ns, struct extent *e)
{
    struct rings_run run[3];
    uint32_t touching = 0;
    gather_own(s, d, t_ns, e);
    const unsigned runs = rings_touching(&s->rings, d, run);
    for (unsigned r = 0; r < runs; r++) {
        touching += run[r].n;
        for (uint32_t k = 0; k < run[r].n; k++)
            if (rings_in(&run[r], k) != d)
                gather_beside(s, rings_in(&run[r], k), t_ns, e);
    }
    return touching - 1;
}

static void forget(const struct sphere *s, const struct extent *e)
{
    if (e->from < e->to)
        memset(&s->relax[e->from], 0, (e->to - e->from) * sizeof *s->relax);
}

void relax_direction(struct sphere *s, uint32_t d, uint64_t t_ns, struct picture_obstacle *obstacle, unsigned n)
{
    const double blocked = (double)s->picture.blocked_logodds;
    struct extent e = {.from = s->layers.n};
    if (n == PICTURE_OBSTACLES || !sphere_pinged(s, d))
        return;
    const uint32_t touching = gather_around(s, d, t_ns, &e);
    for (uint32_t i = e.from; i < e.to; i++) {
        const struct relaxed *at = &s->relax[i];
        const double l = at->own + s->conf.relaxation * at->more / touching;
        if (at->own <= blocked && l > blocked && n < PICTURE_OBSTACLES)
            put(obstacle, n++, obstacle_of(s, i, l, t_ns));
    }
    forget(s, &e);
}

/* A cell that only its neighbours make, in the middle of its layer. */
static struct sphere_cell raised(const struct sphere *s, uint32_t d, uint32_t layer, double logodds)
{
    const struct picture_obstacle o = obstacle_of(s, layer, logodds, 0);
    struct sphere_cell c = {.from_m = s->layers.edge[layer],
                            .to_m = s->layers.edge[layer + 1],
                            .near_m = (double)o.near_m,
                            .ball_m = (double)o.sd_m,
                            .logodds = logodds,
                            .t_first_ns = o.t_echo_ns,
                            .t_echo_ns = o.t_echo_ns,
                            .layer = (uint16_t)layer};
    for (int i = 0; i < 3; i++)
        c.point_m[i] = (double)o.range_m * s->axis[d][i];
    return c;
}

void relax_cells(const struct sphere *s, uint32_t d, double mu, uint64_t t_ns, relax_take *take, void *context)
{
    struct extent e = {.from = s->layers.n};
    const uint32_t touching = gather_around(s, d, t_ns, &e);
    const bool pinged = sphere_pinged(s, d) != 0;
    for (uint32_t i = e.from, k = 0; i < e.to; i++) {
        const struct relaxed *at = &s->relax[i];
        struct sphere_cell c;
        if (at->cell) {
            sphere_cell(s, d, k++, t_ns, &c);
            c.logodds += isfinite(at->own) ? mu * at->more / touching : 0;
        } else if (pinged && at->more > 0) {
            c = raised(s, d, i, mu * at->more / touching);
        } else {
            continue;
        }
        take(context, &c);
    }
    forget(s, &e);
}
