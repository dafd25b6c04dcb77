/* SPDX-License-Identifier: MIT */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/methods/environment.h"
#include "daemon/request_job.h"
#include "grid_methods.h"
#include "json_units.h"
#include "methods.h"
#include "grid/sphere/view.h"

/* A cone in the grid's axes, and the ranges in it; and how many cells were found there. */
struct part {
    struct owner_job call;
    struct sphere *sphere;
    uint64_t now_ns;
    double axis[3], cos_half;
    double from_m, to_m;
    bool locked;
    bool ned;                   /* the grid's axes */
    struct picture_frame frame; /* of the grid at the first step */
    struct picture *picture;
    bool begun;
    uint32_t direction; /* the next */
    int tries;
    bool lost; /* it was begun anew too often */
    uint64_t cells;
};

/* A step ends with so much work: a direction or a cell that is looked at, or a cell that is locked. */
#define WORK_PER_STEP 16384u
#define WORK_TO_LOCK  64u

/* Cells move when the centre or the axes do, perhaps from where is yet to be looked to where was: it begins anew, some
 * times at most, and is refused then. What is locked already stays so, and counts again. */
#define TRIES 8

static bool part_of(json_t *params, struct part *part, struct rpc_error *error)
{
    *part = (struct part){.from_m = params_number(params, "from_m"),
                          .to_m = params_number(params, "to_m"),
                          .cos_half = cos(geo_rad(params_number(params, "half_angle_deg"))),
                          .locked = params_flag(params, "locked")};
    char from[PARAMS_NUMBER_SIZE], to[PARAMS_NUMBER_SIZE];
    if (part->from_m > part->to_m)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "from_m is %s: it must not be beyond to_m, %s",
                          params_number_text(part->from_m, from), params_number_text(part->to_m, to));
    geo_direction(geo_rad(params_number(params, "azimuth_deg")), geo_rad(params_number(params, "elevation_deg")),
                  part->axis);
    return true;
}

static bool holds(const struct part *part, const struct sphere_cell *cell)
{
    const double *p = cell->point_m, range_m = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    const double along_m = p[0] * part->axis[0] + p[1] * part->axis[1] + p[2] * part->axis[2];
    return along_m >= part->cos_half * range_m && range_m >= part->from_m && range_m <= part->to_m;
}

/* Returns the work. */
static uint32_t lock_direction(struct part *part, uint32_t direction)
{
    struct sphere_cell cell;
    uint32_t work = 1;
    for (uint32_t k = 0; sphere_cell(part->sphere, direction, k, part->now_ns, &cell); k++) {
        work++;
        if (!holds(part, &cell))
            continue;
        part->cells += sphere_lock(part->sphere, direction, (cell.from_m + cell.to_m) / 2, part->locked);
        work += WORK_TO_LOCK;
    }
    return work;
}

static bool has_moved(const struct picture_frame *a, const struct picture_frame *b)
{
    return a->axes_rad != b->axes_rad || a->ned != b->ned ||
           memcmp(a->centre_m, b->centre_m, sizeof a->centre_m) != 0;
}

static void begin_anew(struct part *part)
{
    struct picture_frame frame;
    picture_get_frame(part->picture, &frame);
    if (part->begun && !has_moved(&frame, &part->frame))
        return;
    part->lost = part->tries >= TRIES;
    part->begun = true;
    part->frame = frame;
    part->tries++;
    part->direction = 0;
    part->cells = 0;
}

static void lock(void *ctx, const struct pipeline_owned *owned)
{
    struct part *part = ctx;
    const uint32_t n = part->picture->n;
    (void)owned;
    begin_anew(part);
    for (uint32_t work = 0; !part->lost && part->direction < n && work < WORK_PER_STEP; part->direction++)
        work += lock_direction(part, part->direction);
    part->call.more = !part->lost && part->direction < n;
}

static struct part *begin_part(struct methods_env *d, json_t *params, struct rpc_error *error)
{
    struct part part;
    struct picture_frame frame;
    struct grid *grid;
    if (!part_of(params, &part, error) || !(grid = grid_asked(d, params, error)))
        return NULL;
    picture_get_frame(grid_picture(grid), &frame);
    part.sphere = grid->sphere;
    part.picture = grid_picture(grid);
    part.now_ns = loop_now(d->loop);
    part.ned = frame.ned;
    struct part *kept = malloc(sizeof *kept);
    if (kept)
        *kept = part;
    else
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
    return kept;
}

static bool write_locked(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    const struct part *part = call->work->state;
    if (!request_job_done(call, d->pipeline, lock, write_locked))
        return false;
    if (part->lost)
        return rpc_refuse(error, RPC_LIMIT,
                          "the grid moved with the vehicle %d times meanwhile, so some cells may not be %s: ask "
                          "again when it moves less",
                          part->tries, part->locked ? "locked" : "unlocked");
    json_out_open(out, '{');
    json_member_word(out, "frame", part->ned ? "ned" : "body");
    json_member_count(out, "cells", part->cells);
    json_member_flag(out, "locked", part->locked);
    json_out_close(out, '}');
    return true;
}

bool method_grid_lock(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct part *part = request_job_room(d->pipeline, error) ? begin_part(d, params, error) : NULL;
    if (!part)
        return false;
    rpc_work_keep(call->work, part, request_job_leave);
    return write_locked(call, out, error);
}
