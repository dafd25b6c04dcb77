/* SPDX-License-Identifier: MIT */
#include "cell_methods.h"

#include <math.h>
#include <stdlib.h>

#include "daemon.h"
#include "errand.h"
#include "grid_methods.h"

#define DEFAULT_HALF_ANGLE_DEG 5.0
#define RANGE_MAX_M            1e4

/* A cone in the grid's axes, and the ranges in it; and how many cells were found there. */
struct part {
    struct errand errand;
    uint64_t grid_number, now_ns;
    double axis[3], cos_half;
    double from_m, to_m;
    bool locked;
    bool there, ned; /* the grid; its axes */
    json_int_t cells;
};

static bool part_of(json_t *params, struct part *part, struct rpc_error *error)
{
    double az_deg = 0, el_deg = 0, half_deg = DEFAULT_HALF_ANGLE_DEG;
    const json_t *locked = json_object_get(params, "locked");
    *part = (struct part){.to_m = RANGE_MAX_M, .locked = true};
    if (!rpc_number(params, "azimuth_deg", true, -360, 360, &az_deg, error) ||
        !rpc_number(params, "elevation_deg", false, -90, 90, &el_deg, error) ||
        !rpc_number(params, "half_angle_deg", false, 0, 180, &half_deg, error) ||
        !rpc_number(params, "from_m", false, 0, RANGE_MAX_M, &part->from_m, error) ||
        !rpc_number(params, "to_m", false, 0, RANGE_MAX_M, &part->to_m, error))
        return false;
    if (part->from_m > part->to_m)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "from_m is %g: it must not be beyond to_m, %g", part->from_m,
                          part->to_m);
    if (locked && !json_is_boolean(locked))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter 'locked' must be true or false");
    part->locked = !locked || json_is_true(locked);
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), part->axis);
    part->cos_half = cos(geo_rad(half_deg));
    return true;
}

static bool holds(const struct part *part, const struct sphere_cell *cell)
{
    const double *p = cell->point_m, range_m = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    const double along_m = p[0] * part->axis[0] + p[1] * part->axis[1] + p[2] * part->axis[2];
    return along_m >= part->cos_half * range_m && range_m >= part->from_m && range_m <= part->to_m;
}

static void lock(void *ctx, const struct pipeline_owned *owned)
{
    struct part *part = ctx;
    const struct grid *grid = pipeline_owned_grid(owned, part->grid_number);
    struct sphere *sphere = grid ? grid->sphere : NULL;
    struct sphere_stats stats;
    struct sphere_cell cell;
    part->there = grid != NULL;
    if (!grid)
        return;
    sphere_stats(sphere, &stats);
    for (uint32_t direction = 0; direction < stats.directions; direction++)
        for (uint32_t k = 0; sphere_cell(sphere, direction, k, part->now_ns, &cell); k++)
            if (holds(part, &cell))
                part->cells += sphere_lock(sphere, direction, (cell.from_m + cell.to_m) / 2, part->locked);
}

static struct part *begin_part(struct daemon *d, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"azimuth_deg", "elevation_deg", "half_angle_deg", "from_m",
                                       "to_m",        "locked",        "grid",           NULL};
    struct part part;
    struct picture_frame frame;
    struct grid *grid;
    if (!rpc_only(params, keys, error) || !part_of(params, &part, error) || !(grid = grid_asked(d, params, error)))
        return NULL;
    picture_get_frame(grid_picture(grid), &frame);
    part.grid_number = grid->number;
    part.now_ns = loop_now(d->loop);
    part.ned = frame.ned;
    struct part *kept = malloc(sizeof *kept);
    if (kept)
        *kept = part;
    else
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
    return kept;
}

json_t *cell_method_lock(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct part *part = call->work->state;
    if (!part && (!errand_room(call, error) || !(part = begin_part(call->daemon, params, error))))
        return NULL;
    *call->work = (struct rpc_work){.state = part, .drop = errand_leave};
    if (!errand_done(call, lock, error))
        return NULL;
    if (part->there)
        return json_pack("{s:s, s:I, s:b}", "frame", part->ned ? "ned" : "body", "cells", part->cells, "locked",
                         part->locked);
    rpc_refuse(error, RPC_INVALID_PARAMS, "grid: it was dropped meanwhile");
    return NULL;
}
