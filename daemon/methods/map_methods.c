/* SPDX-License-Identifier: MIT */
/* The methods about the map: what a client may ask of it as a whole and change in it;
 * sonard-protocol(7) has every shape. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/request_job.h"
#include "daemon/map/map_service.h"
#include "methods.h"
#include "json_units.h"
#include "query_context.h"

#define SLICE_ROW_VOXELS  100000 /* of one row */
#define SLICE_STEP_VOXELS 10000  /* looked at in one step, and of one line more */

bool map_asked(const struct methods_env *d, struct rpc_error *error)
{
    return pipeline_has_map(d->pipeline) ||
           rpc_refuse(error, RPC_INVALID_REQUEST, "no map is kept: set voxel in [map]");
}

/* ---- the map's state ---- */

struct map_state {
    struct voxmap_stats stats;
    uint64_t started;
    uint32_t submaps, tiles_free, tiles;
    size_t tile_bytes;
};

static void read_state(void *ctx, struct pipeline_map *m)
{
    struct map_state *v = ctx;
    *v = (struct map_state){.stats = m->map.stats,
                            .started = m->map.next_id - 1,
                            .tiles_free = m->map.tiles.n_free,
                            .tiles = m->map.tiles.n,
                            .tile_bytes = m->map.tiles.tile_bytes};
    for (uint32_t i = 0; i < m->map.set.max_submaps; i++) {
        const struct voxmap_part *part = &m->map.part[i];
        v->submaps += part->id != 0;
    }
}

static void write_job(struct json_out *out, const char *name, const struct map_job *job)
{
    static const char *const whats[] = {
        [MAP_SERVICE_SAVE] = "save", [MAP_SERVICE_LOAD] = "load", [MAP_SERVICE_EXPORT] = "export"};
    static const char *const states[] = {
        [MAP_SERVICE_RUNNING] = "running", [MAP_SERVICE_DONE] = "done", [MAP_SERVICE_FAILED] = "failed"};
    if (job->state == MAP_SERVICE_IDLE) {
        json_member_null(out, name);
        return;
    }
    json_member_open(out, name, '{');
    json_member_word(out, "what", whats[job->what]);
    json_member_word(out, "state", states[job->state]);
    json_member_outside(out, "path", job->path);
    json_member_text(out, "message", job->state == MAP_SERVICE_RUNNING ? "" : job->message);
    json_out_close(out, '}');
}

static void write_state(struct json_out *out, struct methods_env *d, const struct map_state *v)
{
    const char *state = d->map_service.frame_lost ? "held: the pose jumped"
                        : v->stats.pings          ? "kept"
                        : v->stats.no_pose        ? "no pose that places the pings"
                                                  : "no ping yet";
    json_out_open(out, '{');
    json_member_word(out, "state", state);
    json_out_name(out, "voxel_m");
    json_out_real(out, d->conf.map.voxel_m);
    json_member_count(out, "submaps", v->submaps);
    json_member_count(out, "begun", v->started);
    json_member_count(out, "used_bytes", (v->tiles - v->tiles_free) * v->tile_bytes);
    json_member_count(out, "memory_bytes", (uint64_t)d->conf.map.memory_bytes);
    json_member_count(out, "pings", v->stats.pings);
    json_member_count(out, "beams", v->stats.beams);
    json_member_count(out, "not_entered", v->stats.no_pose + v->stats.unfit);
    json_member_count(out, "clipped", v->stats.clipped);
    json_member_count(out, "starved", v->stats.starved);
    json_member_count(out, "dropped", v->stats.lost);
    json_member_count(out, "saved", d->saver.saved);
    json_member_count(out, "save_errors", d->saver.errors);
    if (d->conf.map.directory[0])
        json_member_text(out, "directory", d->conf.map.directory);
    else
        json_member_null(out, "directory");
    write_job(out, "job", &d->map_service.asked.job);
    write_job(out, "kept", &d->map_service.kept.job);
    json_out_close(out, '}');
}

/* What is done to the map, and how it stands then: of one request. */
struct deed {
    struct owner_job call;
    struct methods_env *d;
    pipeline_map_fn *fn;                      /* NULL: nothing is done to it */
    struct discontinuity_sum discontinuities; /* of the poses, when it was sent */
    uint64_t job;                             /* that has started; 0: none */
    bool done;
    struct map_state state;
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
static void settle_deed(struct deed *deed)
{
    struct methods_env *d = deed->d;
    if (!deed->fn || !deed->done)
        return;
    d->map_service.changed = true;
    map_service_trust(&d->map_service, &deed->discontinuities);
    deed->fn = NULL;
}

static void free_deed(void *ctx)
{
    settle_deed(ctx);
    free(ctx);
}

static void leave_deed(void *ctx)
{
    owner_job_leave(ctx, free_deed);
}

static struct deed *begin_deed(const struct rpc_call *call, pipeline_map_fn *fn, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct deed *deed = malloc(sizeof *deed);
    if (!deed) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
        return NULL;
    }
    *deed = (struct deed){.d = d, .fn = fn, .discontinuities = d->map_service.discontinuities.sum};
    rpc_work_keep(call->work, deed, fn ? leave_deed : request_job_free);
    return deed;
}

static bool write_state_after(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct deed *deed = call->work->state;
    (void)error;
    if (!request_job_done(call, d->pipeline, act, write_state_after))
        return false;
    settle_deed(deed);
    write_state(out, d, &deed->state);
    return true;
}

static bool state_after(const struct rpc_call *call, pipeline_map_fn *fn, struct json_out *out,
                        struct rpc_error *error)
{
    return begin_deed(call, fn, error) && write_state_after(call, out, error);
}

bool method_map(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    (void)params;
    if (!pipeline_has_map(d->pipeline)) {
        json_out_put(out, "{\"state\":\"none: no voxel is configured, nothing is allocated\"}");
        return true;
    }
    return state_after(call, NULL, out, error);
}

/* ---- a slice ---- */

/* A slice on its way, of one request: the next of its rows. */
struct slice {
    struct owner_job call;
    uint64_t now_ns;
    int64_t first[3];       /* cell of the row's north-west corner */
    int32_t per_cell;       /* voxels along a cell's side */
    int32_t n, done;        /* cells of a row, which is how many rows there are, and rows written */
    int32_t looked;         /* cells of this row, ... */
    int32_t line;           /* ... and lines of the next, of which ... */
    enum voxel_state worst; /* ... this is the severest voxel so far */
    char text[PROTOCOL_SLICE_MAX + 1];
};

/* One line of voxels of the next cell, drawn as the severest of all its voxels: what is drawn free is all free. */
static void look_at_line(struct voxmask *mask, struct slice *row)
{
    const int64_t east = row->first[1] + (int64_t)row->looked * row->per_cell;
    for (int32_t j = 0; j < row->per_cell; j++) {
        const int64_t cell[3] = {row->first[0] - row->line, east + j, row->first[2]};
        const enum voxel_state state = voxmask_at(mask, cell);
        row->worst = state > row->worst ? state : row->worst;
    }
    if (++row->line < row->per_cell)
        return;
    row->text[row->looked++] = row->worst == VOXEL_FREE ? '.' : row->worst == VOXEL_OCCUPIED ? '#' : ' ';
    row->line = 0;
    row->worst = VOXEL_FREE;
}

static void look_at_row(void *ctx, const struct pipeline_owned *owned)
{
    struct pipeline_map *m = owned->map;
    struct slice *row = ctx;
    voxmap_pass(&m->map, row->now_ns);
    for (int32_t voxels = 0; row->looked < row->n && voxels < SLICE_STEP_VOXELS; voxels += row->per_cell)
        look_at_line(&m->mask, row);
    row->text[row->looked] = '\0';
    row->call.more = row->looked < row->n;
}

static void middle_of(const struct methods_env *d, const json_t *params, double middle[3])
{
    struct pose pose = pose_identity;
    pose_log_newest(&d->poses, &pose);
    memcpy(middle, pose.position_m, sizeof pose.position_m);
    params_numbers(params, "middle_m", middle);
    if (params_has(params, "depth_m"))
        middle[2] = params_number(params, "depth_m");
}

/* Whole voxels make a cell. */
static bool row_of(const struct methods_env *d, const double middle[3], double size_m, int64_t cells,
                   struct slice *row, struct rpc_error *error)
{
    struct lattice_place place;
    const double voxel = d->conf.map.voxel_m, per_cell = fmax(1, ceil(size_m / voxel / (double)cells));
    if (per_cell * per_cell * (double)cells > SLICE_ROW_VOXELS)
        return rpc_refuse(error, RPC_LIMIT,
                          "%g m is too large for voxels of %g m: ask for a smaller picture or more cells", size_m,
                          voxel);
    lattice_place(middle, voxel, &place);
    row->per_cell = (int32_t)per_cell;
    row->n = (int32_t)ceil(size_m / voxel / per_cell);
    const int64_t half = (int64_t)row->n * row->per_cell / 2;
    row->first[0] = place.cell[0] + half;
    row->first[1] = place.cell[1] - half;
    row->first[2] = place.cell[2];
    return true;
}

static struct slice *begin_slice(struct methods_env *d, json_t *params, struct json_out *out,
                                 struct rpc_error *error)
{
    struct slice s = {.now_ns = loop_now(d->loop)};
    double middle[3];
    middle_of(d, params, middle);
    if (!map_asked(d, error) ||
        !row_of(d, middle, params_number(params, "size_m"), params_integer(params, "cells"), &s, error))
        return NULL;
    struct slice *kept = malloc(sizeof *kept);
    if (!kept) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for a slice");
        return NULL;
    }
    *kept = s;
    const double voxel = d->conf.map.voxel_m, step = voxel * s.per_cell;
    json_out_open(out, '{');
    json_member_metres(out, "depth_m", ((double)s.first[2] + 0.5) * voxel);
    json_member_metres(out, "north_m", ((double)s.first[0] + 1) * voxel - step / 2);
    json_member_metres(out, "east_m", (double)s.first[1] * voxel + step / 2);
    json_member_metres(out, "step_m", step);
    json_out_name(out, "rows");
    json_out_open(out, '[');
    return kept;
}

static void end_slice(const struct methods_env *d, struct json_out *out)
{
    double roll, pitch, yaw;
    struct pose pose;
    const bool placed = query_whole_pose(d, &pose) || (d->replay && pose_log_newest(&d->poses, &pose));
    json_out_close(out, ']');
    if (placed) {
        quat_to_rpy(pose.attitude, &roll, &pitch, &yaw);
        json_member_metres3(out, "vehicle_m", pose.position_m);
        json_member_degrees(out, "heading_deg", yaw);
    } else {
        json_member_null(out, "vehicle_m");
        json_member_null(out, "heading_deg");
    }
    json_out_close(out, '}');
}

static bool write_slice_row(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    struct slice *s = call->work->state;
    (void)error;
    if (!request_job_done(call, d->pipeline, look_at_row, write_slice_row))
        return false;
    json_out_word(out, s->text);
    s->first[0] -= s->per_cell;
    s->looked = 0;
    if (++s->done < s->n)
        return rpc_continue(call, write_slice_row);
    end_slice(d, out);
    return true; /* the work is dropped with the request */
}

bool method_map_slice(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct slice *s = begin_slice(call->daemon, params, out, error);
    if (!s)
        return false;
    rpc_work_keep(call->work, s, request_job_free);
    return write_slice_row(call, out, error);
}

/* ---- changes ---- */

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

static bool change(const struct rpc_call *call, pipeline_map_fn *fn, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    return map_asked(d, error) && request_job_room(d->pipeline, error) && state_after(call, fn, out, error);
}

bool method_map_new(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params;
    return change(call, begin_submap, out, error);
}

bool method_map_forget(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params;
    return change(call, forget_map, out, error);
}

static const char *name_of(const struct methods_env *d, const json_t *params, struct rpc_error *error)
{
    const char *name = params_text(params, "name");
    if (!map_asked(d, error))
        return NULL;
    if (map_service_name_good(name))
        return name;
    rpc_refuse(error, RPC_INVALID_PARAMS,
               "name: expected a file name without its ending: 1 to %d letters, digits, - and _",
               MAP_SERVICE_NAME_MAX);
    return NULL;
}

/* What the client sends next changes nothing in what its job saves: its answer waits until the map is copied. */
static bool after_copy(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    const struct deed *deed = call->work->state;
    if (map_service_copied(&d->map_service, deed->job))
        return write_state_after(call, out, error);
    rpc_work_wait(call->work, &d->map_service.asked.waiters);
    return rpc_continue(call, after_copy);
}

/* The answer of a request whose job has started, or its refusal. */
static bool after_begin(const struct rpc_call *call, bool started, const char *why, struct json_out *out,
                        struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    if (!started)
        return rpc_refuse(error, RPC_INVALID_REQUEST, "%s", why);
    struct deed *deed = begin_deed(call, NULL, error);
    if (!deed)
        return false;
    deed->job = d->map_service.asked.number;
    return after_copy(call, out, error);
}

bool method_map_save(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct fault why = {""};
    const char *name;
    if (!(name = name_of(d, params, error)))
        return false;
    return after_begin(call, map_service_save(&d->map_service, name, &why), why.text, out, error);
}

bool method_map_load(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct fault why = {""};
    const char *name;
    if (!(name = name_of(d, params, error)))
        return false;
    return after_begin(call, map_service_load(&d->map_service, name, &why), why.text, out, error);
}

bool method_map_export(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    const enum map_service_format format = params_is(params, "format", "bt")     ? MAP_SERVICE_BT
                                           : params_is(params, "format", "mcap") ? MAP_SERVICE_MCAP
                                                                                 : MAP_SERVICE_PLY;
    struct methods_env *d = call->daemon;
    struct fault why = {""};
    const char *name;
    if (!(name = name_of(d, params, error)))
        return false;
    return after_begin(call, map_service_export(&d->map_service, name, format, &why), why.text, out, error);
}
