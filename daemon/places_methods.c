/* SPDX-License-Identifier: MIT */
/* The methods about the map: what a client may ask of it as a whole and change in it; sonard-protocol(7) has every shape. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "errand.h"
#include "places.h"
#include "say.h"

#define SLICE_CELLS      160
#define SLICE_CELLS_MAX  400
#define SLICE_SIZE_M     40.0
#define SLICE_ROW_VOXELS 100000 /* looked at in one visit */

bool places_there(const struct daemon *d, struct rpc_error *error)
{
    return pipeline_has_map(d->pipeline) ||
           rpc_refuse(error, RPC_INVALID_REQUEST, "no map is kept: set voxel in [map]");
}

bool places_whole_pose(const struct daemon *d, struct pose *pose)
{
    const unsigned all = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    return pose_log_at(&d->poses, loop_now(d->loop), pose) && (pose->has & all) == all &&
           pose_log_fresh(&d->poses, loop_now(d->loop));
}

/* ---- the map's state ---- */

struct visit_state {
    struct voxmap_stats stats;
    uint64_t begun;
    uint32_t submaps, away, tiles_free, tiles;
    size_t tile_bytes;
};

static void read_state(void *ctx, struct pipeline_map *m)
{
    struct visit_state *v = ctx;
    *v = (struct visit_state){.stats = m->map.stats,
                              .begun = m->map.next_id - 1,
                              .tiles_free = m->map.tiles.n_free,
                              .tiles = m->map.tiles.n,
                              .tile_bytes = m->map.tiles.tile_bytes};
    for (uint32_t i = 0; i < m->map.set.max_submaps; i++) {
        const struct voxmap_part *part = &m->map.part[i];
        v->submaps += part->id != 0;
        v->away += part->id != 0 && part->away;
    }
}

static json_t *job_json(const struct places_job *job)
{
    static const char *const whats[] = {
        [PLACES_SAVE] = "save", [PLACES_LOAD] = "load", [PLACES_EXPORT] = "export"};
    static const char *const states[] = {
        [PLACES_RUNNING] = "running", [PLACES_DONE] = "done", [PLACES_FAILED] = "failed"};
    if (job->state == PLACES_IDLE)
        return json_null();
    return json_pack("{s:s, s:s, s:s, s:s}", "what", whats[job->what], "state", states[job->state], "path",
                     job->path, "message", job->state == PLACES_RUNNING ? "" : job->message);
}

static json_t *state_json(struct daemon *d, const struct visit_state *v)
{
    const char *state = d->places.astray  ? "held: the pose jumped"
                        : v->stats.pings        ? "kept"
                        : v->stats.no_pose      ? "no pose that places the pings"
                                               : "no ping yet";
    return json_pack(
        "{s:s, s:o, s:i, s:i, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:s?, s:o, s:o}",
        "state", state, "voxel_m", json_real(d->conf.map.voxel_m), "submaps", (int)v->submaps, "away", (int)v->away,
        "begun", (json_int_t)v->begun, "used_bytes", (json_int_t)((v->tiles - v->tiles_free) * v->tile_bytes),
        "memory_bytes", (json_int_t)d->conf.map.memory_bytes, "pings", (json_int_t)v->stats.pings, "beams",
        (json_int_t)v->stats.beams, "not_entered", (json_int_t)(v->stats.no_pose + v->stats.unfit), "clipped",
        (json_int_t)v->stats.clipped, "starved", (json_int_t)v->stats.starved, "dropped", (json_int_t)v->stats.lost,
        "paged_out", (json_int_t)d->pager.out, "paged_in", (json_int_t)d->pager.in, "page_errors",
        (json_int_t)d->pager.errors, "directory", d->conf.map.directory[0] ? d->conf.map.directory : NULL, "job",
        job_json(&d->places.asked.job), "kept", job_json(&d->places.kept.job));
}

/* What is done to the map, and how it stands then: of one request. */
struct deed {
    struct errand errand;
    struct daemon *d;
    pipeline_visit_fn *fn; /* NULL: nothing is done to it */
    struct jumps_sum jumps; /* of the poses, when it was sent */
    uint64_t job;           /* that has begun; 0: none */
    bool done;
    struct visit_state state;
};

static void act(void *ctx, const struct pipeline_owned *owned)
{
    struct deed *deed = ctx;
    if (deed->fn)
        deed->fn(NULL, owned->map);
    read_state(&deed->state, owned->map);
    deed->done = true;
}

/* What the client does with the map tells that its places count from where poses did when it said so. */
static void settle(struct deed *deed)
{
    struct daemon *d = deed->d;
    if (!deed->fn || !deed->done)
        return;
    d->places.changed = true;
    places_trust(d, &deed->jumps);
    deed->fn = NULL;
}

static void free_deed(void *ctx)
{
    settle(ctx);
    free(ctx);
}

static void leave_deed(void *ctx)
{
    pipeline_errand_leave(ctx, free_deed);
}

static struct deed *deed_of(const struct rpc_call *call, pipeline_visit_fn *fn, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    struct deed *deed = call->work->state ? call->work->state : calloc(1, sizeof *deed);
    if (!deed) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
        return NULL;
    }
    if (!call->work->state)
        *deed = (struct deed){.d = d, .fn = fn, .jumps = d->places.jumps.sum};
    *call->work = (struct rpc_work){.state = deed, .drop = fn ? leave_deed : errand_free};
    return deed;
}

/* NULL with *error set: its state is not known yet, or never. */
static json_t *state_after(const struct rpc_call *call, pipeline_visit_fn *fn, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    struct deed *deed = deed_of(call, fn, error);
    if (!deed || !errand_done(call, act, error))
        return NULL;
    settle(deed);
    return state_json(d, &deed->state);
}

json_t *places_method_map(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    const struct daemon *d = call->daemon;
    if (!rpc_only(params, keys, error))
        return NULL;
    if (!pipeline_has_map(d->pipeline))
        return json_pack("{s:s}", "state", "none: no voxel is configured, nothing is allocated");
    return state_after(call, NULL, error);
}

/* ---- a slice ---- */

/* A slice on its way, of one request: the next of its rows. */
struct slice {
    struct errand errand;
    uint64_t now_ns;
    int64_t first[3]; /* cell of the row's north-west corner */
    int32_t per_cell; /* voxels along a cell's side */
    int32_t n, done;  /* cells of a row, which is how many rows there are, and rows written */
    char text[SLICE_CELLS_MAX + 1];
};

/* The severest of a cell's voxels: what is drawn free is all free. */
static char look_at(struct voxmask *mask, const int64_t corner[3], int32_t per_cell)
{
    enum voxel_state worst = VOXEL_FREE;
    for (int32_t i = 0; i < per_cell; i++)
        for (int32_t j = 0; j < per_cell; j++) {
            const int64_t cell[3] = {corner[0] - i, corner[1] + j, corner[2]};
            const enum voxel_state state = voxmask_at(mask, cell);
            worst = state > worst ? state : worst;
        }
    return worst == VOXEL_FREE ? '.' : worst == VOXEL_OCCUPIED ? '#' : ' ';
}

static void look_at_row(void *ctx, const struct pipeline_owned *owned)
{
    struct pipeline_map *m = owned->map;
    struct slice *row = ctx;
    voxmap_pass(&m->map, row->now_ns);
    for (int32_t c = 0; c < row->n; c++) {
        const int64_t corner[3] = {row->first[0], row->first[1] + (int64_t)c * row->per_cell, row->first[2]};
        row->text[c] = look_at(&m->mask, corner, row->per_cell);
    }
    row->text[row->n] = '\0';
}

static bool slice_of(const struct daemon *d, json_t *params, double middle[3], double *size_m, int64_t *cells,
                     struct rpc_error *error)
{
    struct pose pose = pose_identity;
    bool given;
    pose_log_newest(&d->poses, &pose);
    memcpy(middle, pose.position_m, sizeof pose.position_m);
    *size_m = SLICE_SIZE_M;
    *cells = SLICE_CELLS;
    return rpc_numbers(params, "middle_m", -PLACES_MAX_M, PLACES_MAX_M, 2, middle, &given, error) &&
           rpc_number(params, "depth_m", false, -100, 12000, &middle[2], error) &&
           rpc_number(params, "size_m", false, 0.1, 10000, size_m, error) &&
           rpc_integer(params, "cells", false, 1, SLICE_CELLS_MAX, cells, error);
}

/* Whole voxels make a cell. */
static bool row_of(const struct daemon *d, const double middle[3], double size_m, int64_t cells, struct slice *row,
                   struct rpc_error *error)
{
    struct lattice_place place;
    const double voxel = d->conf.map.voxel_m, per_cell = fmax(1, ceil(size_m / voxel / (double)cells));
    if (per_cell * per_cell * (double)cells > SLICE_ROW_VOXELS)
        return rpc_refuse(error, RPC_LIMIT, "%g m are too much for voxels of %g m: ask for less, or more cells",
                          size_m, voxel);
    lattice_place(middle, voxel, &place);
    row->per_cell = (int32_t)per_cell;
    row->n = (int32_t)ceil(size_m / voxel / per_cell);
    const int64_t half = (int64_t)row->n * row->per_cell / 2;
    row->first[0] = place.cell[0] + half;
    row->first[1] = place.cell[1] - half;
    row->first[2] = place.cell[2];
    return true;
}

static struct slice *begin_slice(struct daemon *d, json_t *params, struct text *out, struct rpc_error *error)
{
    static const char *const keys[] = {"middle_m", "depth_m", "size_m", "cells", NULL};
    struct slice s = {.now_ns = loop_now(d->loop)};
    double middle[3], size_m;
    int64_t cells;
    if (!places_there(d, error) || !rpc_only(params, keys, error) ||
        !slice_of(d, params, middle, &size_m, &cells, error) || !row_of(d, middle, size_m, cells, &s, error))
        return NULL;
    struct slice *kept = malloc(sizeof *kept);
    if (!kept) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for a slice");
        return NULL;
    }
    *kept = s;
    const double voxel = d->conf.map.voxel_m, step = voxel * s.per_cell;
    text_open(out, '{');
    write_metres(out, "depth_m", ((double)s.first[2] + 0.5) * voxel);
    write_metres(out, "north_m", ((double)s.first[0] + 1) * voxel - step / 2);
    write_metres(out, "east_m", (double)s.first[1] * voxel + step / 2);
    write_metres(out, "step_m", step);
    text_name(out, "rows");
    text_open(out, '[');
    return kept;
}

static void end_slice(const struct daemon *d, struct text *out)
{
    double roll, pitch, yaw;
    struct pose pose;
    const bool placed = places_whole_pose(d, &pose) || (d->replay && pose_log_newest(&d->poses, &pose));
    text_close(out, ']');
    if (placed) {
        quat_to_rpy(pose.attitude, &roll, &pitch, &yaw);
        write_metres3(out, "vehicle_m", pose.position_m);
        write_degrees(out, "heading_deg", yaw);
    } else {
        write_null(out, "vehicle_m");
        write_null(out, "heading_deg");
    }
    text_close(out, '}');
}

/* In parts, a row in each. */
bool places_method_slice(const struct rpc_call *call, json_t *params, struct text *out, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    struct slice *s = call->work->state;
    if (!s && !(s = begin_slice(d, params, out, error)))
        return false;
    *call->work = (struct rpc_work){.state = s, .drop = errand_free};
    if (!errand_done(call, look_at_row, error))
        return false;
    text_word(out, s->text);
    s->first[0] -= s->per_cell;
    if (++s->done < s->n) {
        error->code = RPC_UNFINISHED;
        return false;
    }
    end_slice(d, out);
    return true; /* the work is dropped with the request */
}

/* ---- changes ---- */

/* The one place through which every change goes: who may make them is decided here. All who may connect may. */
static bool change_of(const struct daemon *d, json_t *params, const char *const *keys, struct rpc_error *error)
{
    return rpc_only(params, keys, error) && places_there(d, error);
}

static void begin_submap(void *ctx, struct pipeline_map *m)
{
    (void)ctx;
    voxmap_new(&m->map);
}

static void forget_map(void *ctx, struct pipeline_map *m)
{
    (void)ctx;
    voxmap_clear(&m->map);
}

static json_t *change(const struct rpc_call *call, json_t *params, pipeline_visit_fn *fn, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    if (!change_of(call->daemon, params, keys, error) || (!call->work->state && !errand_room(call, error)))
        return NULL;
    return state_after(call, fn, error);
}

json_t *places_method_new(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    return change(call, params, begin_submap, error);
}

json_t *places_method_forget(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    return change(call, params, forget_map, error);
}

static const char *name_of(json_t *params, struct rpc_error *error)
{
    const char *name = json_string_value(json_object_get(params, "name"));
    if (name && places_name_good(name))
        return name;
    rpc_refuse(error, RPC_INVALID_PARAMS,
               "name: wanted that of the file, without an ending: a name is 1 to %d letters, digits, - and _",
               PLACES_NAME_MAX);
    return NULL;
}

/*
 * The next part of a request whose job has begun, or its refusal. What the client sends next changes nothing in what the job
 * saves: its answer waits until the map is copied.
 */
static json_t *begun(const struct rpc_call *call, bool done, const char *why, struct rpc_error *error)
{
    const struct daemon *d = call->daemon;
    struct deed *deed = done ? deed_of(call, NULL, error) : NULL;
    if (!done)
        rpc_refuse(error, RPC_INVALID_REQUEST, "%s", why);
    if (!deed)
        return NULL;
    if (!deed->job)
        deed->job = d->places.asked.number;
    call->work->waits = !places_copied(d, deed->job);
    if (!call->work->waits)
        return state_after(call, NULL, error);
    error->code = RPC_UNFINISHED;
    return NULL;
}

json_t *places_method_save(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"name", NULL};
    char why[640] = "";
    const char *name;
    if (!change_of(call->daemon, params, keys, error) || !(name = name_of(params, error)))
        return NULL;
    return begun(call, call->work->state || places_save(call->daemon, name, why, sizeof why), why, error);
}

json_t *places_method_load(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"name", NULL};
    char why[640] = "";
    const char *name;
    if (!change_of(call->daemon, params, keys, error) || !(name = name_of(params, error)))
        return NULL;
    return begun(call, call->work->state || places_load(call->daemon, name, why, sizeof why), why, error);
}

json_t *places_method_export(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"name", "format", NULL};
    static const char *const formats[] = {[PLACES_PLY] = "ply", [PLACES_MCAP] = "mcap", [PLACES_BT] = "bt", NULL};
    int format = PLACES_PLY;
    char why[640] = "";
    const char *name;
    if (!change_of(call->daemon, params, keys, error) || !rpc_word(params, "format", formats, &format, error) ||
        !(name = name_of(params, error)))
        return NULL;
    const bool done = call->work->state ||
                      places_export(call->daemon, name, (enum places_format)format, why, sizeof why);
    return begun(call, done, why, error);
}
