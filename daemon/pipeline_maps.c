/* SPDX-License-Identifier: MIT */
/*
 * pipeline_maps - the loop's side of the grids and of the map of places: both belong to the thread that enters pings
 * into them, which is visited between two pings. Knows no buffers and no extract stage.
 */
#include "pipeline_state.h"

/* ---- between two pings ---- */

void pipeline_visit(struct pipeline *p, pipeline_owner_fn *fn, void *ctx)
{
    struct visitor v = {.fn = fn, .ctx = ctx};
    if (p->conf.patient)
        pipeline_drain(p);
    if (p->conf.threads == 0) {
        const struct pipeline_owned owned = pipeline_owned(p);
        fn(ctx, &owned);
        return;
    }
    sem_init(&v.done, 0, 0);
    atomic_store_explicit(&p->visitor, &v, memory_order_release);
    sem_post(&pipeline_owners_belt(p)->news);
    while (sem_wait(&v.done) != 0) {
    }
    sem_destroy(&v.done);
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

static void visit_map(void *ctx, const struct pipeline_owned *owned)
{
    struct map_visit *v = ctx;
    v->fn(v->ctx, owned->map);
}

bool pipeline_visit_map(struct pipeline *p, pipeline_visit_fn *fn, void *ctx)
{
    struct map_visit v = {fn, ctx};
    if (p->map)
        pipeline_visit(p, visit_map, &v);
    return p->map != NULL;
}

/* ---- grids ---- */

bool pipeline_add_grid(struct pipeline *p, struct grid *grid)
{
    if (p->n_grids == PIPELINE_MAX_GRIDS)
        return false;
    grid->number = ++p->grids_ever;
    p->grid[p->n_grids++] = grid;
    return true;
}

static int without(struct grid **list, int n, const struct grid *grid)
{
    int kept = 0;
    for (int i = 0; i < n; i++)
        if (list[i] != grid)
            list[kept++] = list[i];
    return kept;
}

void pipeline_drop_grid(struct pipeline *p, struct grid *grid)
{
    p->n_grids = without(p->grid, p->n_grids, grid);
}

/* The owner's list follows the loop's, in the same order: there is room. */
void pipeline_feed_grid(void *grid_errand, const struct pipeline_owned *owned)
{
    struct grid_errand *e = grid_errand;
    struct pipeline *p = e->errand.pipeline;
    p->fed[owned->n_grids] = e->grid;
    p->n_fed++;
    e->done = true;
}

void pipeline_starve_grid(void *grid_errand, const struct pipeline_owned *owned)
{
    struct grid_errand *e = grid_errand;
    struct pipeline *p = e->errand.pipeline;
    p->n_fed = without(p->fed, owned->n_grids, e->grid);
    e->done = true;
}

struct grid *pipeline_owned_grid(const struct pipeline_owned *owned, uint64_t number)
{
    for (int i = 0; i < owned->n_grids; i++)
        if (owned->grid[i]->number == number)
            return owned->grid[i];
    return NULL;
}

bool pipeline_has_grid(struct pipeline *p, uint64_t number)
{
    const struct pipeline_owned known = {.grid = p->grid, .n_grids = p->n_grids};
    return pipeline_owned_grid(&known, number) != NULL;
}

struct grid *pipeline_grid(struct pipeline *p, int i)
{
    return i < p->n_grids ? p->grid[i] : NULL;
}

struct picture *pipeline_picture(struct pipeline *p)
{
    return grid_picture(p->grid[0]);
}
