/* SPDX-License-Identifier: MIT */
/*
 * paper_layout - the grid's structure as Auran and Silven 1996, figure 5, have it, as a reference to compare
 * grid/sphere's cells with: tables of theta and phi, each cell on the heap, doubly linked to the nearer and the farther
 * one of its direction and to its neighbours in the order in which cells came.
 * Knows what a cell holds, not what an echo means.
 */
#ifndef SONARD_BENCH_PAPER_LAYOUT_H
#define SONARD_BENCH_PAPER_LAYOUT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

struct paper_cell {
    struct paper_cell *nearer, *farther; /* of its direction */
    struct paper_cell *before, *after;   /* of all */
    double from_m, to_m, state;          /* radial limits, probability state */
    double point_m[3], ball_m;           /* interpolated echo, uncertainty ball */
    uint64_t t_first_ns, t_last_ns;
    uint32_t theta, phi, layer, echoes, flag;
};

/* Of one theta; allocated with its first echo. */
struct paper_phis {
    bool *pinged;              /* [phis] */
    struct paper_cell **first; /* [phis] nearest of each direction */
};

struct paper_grid {
    uint32_t thetas, phis, cells;
    struct paper_phis *theta; /* [thetas] */
    struct paper_cell *head;
    size_t bytes;
};

static inline void *paper_room(struct paper_grid *g, size_t n, size_t size)
{
    void *p = calloc(n, size);
    if (!p)
        abort();
    g->bytes += n * size + 16; /* what the heap adds to a block */
    return p;
}

static inline struct paper_grid paper_grid(uint32_t thetas, uint32_t phis)
{
    struct paper_grid g = {.thetas = thetas, .phis = phis};
    g.theta = (struct paper_phis *)paper_room(&g, thetas, sizeof *g.theta);
    return g;
}

/** paper_take - the cell, made when it does not exist; its direction is pinged from now on. */
static inline struct paper_cell *paper_take(struct paper_grid *g, uint32_t theta, uint32_t phi, uint32_t layer)
{
    struct paper_phis *t = &g->theta[theta];
    if (!t->first) {
        t->first = (struct paper_cell **)paper_room(g, g->phis, sizeof *t->first);
        t->pinged = (bool *)paper_room(g, g->phis, sizeof *t->pinged);
    }
    t->pinged[phi] = true;
    struct paper_cell *farther = t->first[phi], *nearer = NULL;
    while (farther && farther->layer < layer) {
        nearer = farther;
        farther = farther->farther;
    }
    if (farther && farther->layer == layer)
        return farther;
    struct paper_cell *c = (struct paper_cell *)paper_room(g, 1, sizeof *c);
    c->theta = theta;
    c->phi = phi;
    c->layer = layer;
    c->nearer = nearer;
    c->farther = farther;
    *(nearer ? &nearer->farther : &t->first[phi]) = c;
    if (farther)
        farther->nearer = c;
    c->after = g->head;
    if (g->head)
        g->head->before = c;
    g->head = c;
    g->cells++;
    return c;
}

static inline void paper_release(struct paper_grid *g, struct paper_cell *c)
{
    *(c->nearer ? &c->nearer->farther : &g->theta[c->theta].first[c->phi]) = c->farther;
    if (c->farther)
        c->farther->nearer = c->nearer;
    *(c->before ? &c->before->after : &g->head) = c->after;
    if (c->after)
        c->after->before = c->before;
    g->cells--;
    g->bytes -= sizeof *c + 16;
    free(c);
}

static inline void paper_free(struct paper_grid *g)
{
    while (g->head)
        paper_release(g, g->head);
    for (uint32_t i = 0; i < g->thetas; i++) {
        free(g->theta[i].first);
        free(g->theta[i].pinged);
    }
    free(g->theta);
}

#endif
