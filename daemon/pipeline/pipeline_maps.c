/* SPDX-License-Identifier: MIT */
/*
 * pipeline_maps - the loop's side of the grids and of the voxel map: both belong to the thread that enters pings
 * into them, which the loop may call between two pings or wait for. Knows no buffers and no extract stage.
 */
#include "pipeline_state.h"

/* ---- between two pings ---- */

void pipeline_drain(struct pipeline *p)
{
    for (;;) {
        /* in this order: a ping that is let go is in `held` until nothing of what it lets go has finished */
        const uint64_t finished = atomic_load_explicit(&p->finished, memory_order_acquire);
        const uint64_t held = atomic_load_explicit(&p->held, memory_order_acquire);
        if (finished + held == atomic_load_explicit(&p->submitted, memory_order_relaxed))
            return;
        pipeline_rest();
    }
}

void owner_run_now(struct pipeline *p, pipeline_owner_fn *fn, void *ctx)
{
    struct sync_call v = {.fn = fn, .ctx = ctx};
    if (p->conf.patient)
        pipeline_drain(p);
    if (p->conf.threads == 0) {
        const struct pipeline_owned owned = pipeline_owned(p);
        fn(ctx, &owned);
        return;
    }
    sem_init(&v.done, 0, 0);
    atomic_store_explicit(&p->sync_call, &v, memory_order_release);
    sem_post(&pipeline_owners_queue(p)->news);
    while (sem_wait(&v.done) != 0) {
    }
    sem_destroy(&v.done);
}

/* ---- the voxel map ---- */

bool pipeline_has_map(const struct pipeline *p)
{
    return p->map != NULL;
}

struct voxmap_setting pipeline_map_setting(const struct pipeline *p)
{
    return p->conf.voxels;
}

struct map_call {
    pipeline_map_fn *fn;
    void *ctx;
};

static void call_for_map(void *ctx, const struct pipeline_owned *owned)
{
    struct map_call *v = ctx;
    v->fn(v->ctx, owned->map);
}

bool owner_run_map_now(struct pipeline *p, pipeline_map_fn *fn, void *ctx)
{
    struct map_call v = {fn, ctx};
    if (p->map)
        owner_run_now(p, call_for_map, &v);
    return p->map != NULL;
}

/* ---- grids ---- */

struct grid *pipeline_grid(struct pipeline *p, int i)
{
    return i < p->n_grids ? p->grid[i] : NULL;
}

struct picture *pipeline_picture(struct pipeline *p)
{
    return grid_picture(p->grid[0]);
}
