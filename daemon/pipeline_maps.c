/* SPDX-License-Identifier: MIT */
/*
 * pipeline_maps - the loop's side of the grids and of the map of places: both belong to the thread that enters pings
 * into them, which is visited between two pings. Knows no buffers and no extract stage.
 */
#include "pipeline_state.h"

/* ---- between two pings ---- */

static void visit(struct pipeline *p, visit_fn *fn, void *ctx)
{
    struct visitor v = {.fn = fn, .ctx = ctx};
    if (p->conf.patient)
        pipeline_drain(p);
    if (p->conf.threads == 0) {
        fn(ctx, p);
        return;
    }
    sem_init(&v.done, 0, 0);
    atomic_store_explicit(&p->visitor, &v, memory_order_release);
    sem_post(&pipeline_owners_belt(p)->news);
    while (sem_wait(&v.done) != 0) {
    }
    sem_destroy(&v.done);
}

struct look_visit {
    pipeline_look_fn *fn;
    void *ctx;
};

static void look(void *ctx, struct pipeline *p)
{
    struct look_visit *v = ctx;
    v->fn(v->ctx, &p->witnesses);
}

void pipeline_visit(struct pipeline *p, pipeline_look_fn *fn, void *ctx)
{
    struct look_visit v = {fn, ctx};
    visit(p, look, &v);
}

/* ---- the map of places ---- */

bool pipeline_has_map(const struct pipeline *p)
{
    return p->map != NULL;
}

struct voxmap_setting pipeline_map_setting(const struct pipeline *p)
{
    return p->conf.voxels;
}

struct map_visit {
    pipeline_visit_fn *fn;
    void *ctx;
};

static void visit_map(void *ctx, struct pipeline *p)
{
    struct map_visit *v = ctx;
    v->fn(v->ctx, p->map);
}

bool pipeline_visit_map(struct pipeline *p, pipeline_visit_fn *fn, void *ctx)
{
    struct map_visit v = {fn, ctx};
    if (p->map)
        visit(p, visit_map, &v);
    return p->map != NULL;
}

/* ---- grids ---- */

static void add_grid(void *ctx, struct pipeline *p)
{
    p->grid[p->n_grids++] = ctx;
}

static void drop_grid(void *ctx, struct pipeline *p)
{
    int kept = 0;
    for (int i = 0; i < p->n_grids; i++)
        if (p->grid[i] != ctx)
            p->grid[kept++] = p->grid[i];
    p->n_grids = kept;
}

bool pipeline_add_grid(struct pipeline *p, struct grid *grid)
{
    if (p->n_grids == PIPELINE_MAX_GRIDS)
        return false;
    grid->number = ++p->grids_ever;
    visit(p, add_grid, grid);
    return true;
}

bool pipeline_has_grid(const struct pipeline *p, uint64_t number)
{
    for (int i = 0; i < p->n_grids; i++)
        if (p->grid[i]->number == number)
            return true;
    return false;
}

void pipeline_drop_grid(struct pipeline *p, struct grid *grid)
{
    visit(p, drop_grid, grid);
    grid_free(grid);
}

struct grid *pipeline_grid(struct pipeline *p, int i)
{
    return i < p->n_grids ? p->grid[i] : NULL;
}

struct sphere *pipeline_sphere(struct pipeline *p, const struct grid *grid)
{
    pipeline_drain(p);
    return grid->sphere;
}

struct picture *pipeline_picture(struct pipeline *p)
{
    return grid_picture(p->grid[0]);
}
