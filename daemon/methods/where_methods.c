/* SPDX-License-Identifier: MIT */
/* The methods about the voxel map: what is free at a point, in a box and along a path. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/voxel/free_query.h"
#include "daemon/request_job.h"
#include "daemon/map/map_service.h"
#include "methods.h"
#include "query_context.h"
#include "reference.h"
#include "json_units.h"

#define QUESTION_VOXELS 2e6 /* in one question */
#define STARTS_MAX      8

/* ---- where ---- */

/* The pose by which places of this question become NED; the identity for those that are. */
static bool frame_of(const struct methods_env *d, json_t *params, struct pose *pose, struct rpc_error *error)
{
    *pose = pose_identity;
    return !params_is(params, "frame", "body") || query_whole_pose(d, pose) ||
           rpc_refuse(error, RPC_INVALID_REQUEST,
                      "frame body needs a fresh pose with attitude, position and depth");
}

/* A place of the vehicle's axes as NED. */
static void place_by(const struct pose *pose, double at_m[3])
{
    quat_rotate(pose->attitude, at_m, at_m);
    for (int a = 0; a < 3; a++)
        at_m[a] += pose->position_m[a];
}

/* How far a place of the body's may be from where the pose puts it: the vehicle may have moved,
 * and turned about itself. */
static double uncertain_m(const struct pose *pose, const double at_m[3])
{
    double way2 = 0;
    for (int a = 0; a < 3; a++)
        way2 += (at_m[a] - pose->position_m[a]) * (at_m[a] - pose->position_m[a]);
    return pose->uncertain_m + pose->uncertain_rad * sqrt(way2);
}

/* ---- answers ---- */

static const char *const state_words[] = {
    [VOXEL_FREE] = "free", [VOXEL_UNKNOWN] = "unknown", [VOXEL_OCCUPIED] = "occupied"};

/* Of one request. */
struct question {
    struct owner_job call;
    struct methods_env *d;
    uint64_t now_ns; /* the map is judged as of then */
    bool point;
    double at_m[3];                      /* of a point */
    double path_m[PROTOCOL_PATH_MAX][3]; /* of a path, ... */
    uint32_t n;                          /* ... so many; 0: it is none */
    double radius_m;
    struct free_query asked, query; /* at its begin, and now */
    bool done;
    int started;            /* so often, ... */
    uint64_t change_of_all; /* ... the last time when the map stood at this */
    /* begin of the oldest submap that says anything of the point; 0: none does, or of another run */
    uint64_t since_ns;
};

/* no_body: nobody said that the vehicle's own place is free. */
static const char *reason_of(const struct free_answer *a, bool path, bool no_body, bool frame_lost)
{
    return a->state == VOXEL_FREE ? "all of it was observed free"
           : frame_lost           ? "the pose jumped: nothing counts as free until map new, map forget or map load"
           : a->state == VOXEL_OCCUPIED && a->first_state != VOXEL_OCCUPIED
               ? "echo farther on; the first voxel that is not free is unknown"
           : a->state == VOXEL_OCCUPIED ? "an echo was received there"
           : a->lost                    ? "the part of the map that covered it was forgotten: scan it again"
           : path && no_body && a->clear_m <= 0
               ? "unknown at the start: no beam reaches the water at the vehicle itself; set body in [map]"
               : "never observed, or not observed free often enough";
}

static void write_answer(struct json_out *out, const struct question *q)
{
    const struct free_answer *a = &q->query.answer;
    const bool is_free = a->state == VOXEL_FREE;
    const double unknown = a->voxels ? (double)a->unknown / (double)a->voxels : 1;
    const double age_s = q->now_ns > q->since_ns ? (double)(q->now_ns - q->since_ns) * 1e-9 : 0;
    json_out_open(out, '{');
    json_member_word(out, "state", state_words[a->state]);
    json_out_name(out, "first");
    if (is_free) {
        json_out_null(out);
    } else {
        json_out_open(out, '{');
        json_member_word(out, "state", state_words[a->first_state]);
        json_member_metres3(out, "position_m", a->first_m);
        if (q->n)
            json_member_metres(out, "along_m", a->clear_m);
        json_out_close(out, '}');
    }
    json_member_real(out, "unknown_share", unknown, 1e4);
    json_member_text(out, "reason",
                     reason_of(a, q->n > 0, q->d->conf.map.body_m <= 0, q->d->map_service.frame_lost));
    if (q->point)
        json_member_known(out, "age_s", q->since_ns != 0, age_s, 1e3);
    reference_write_target(out, q->d);
    json_out_close(out, '}');
}

static void since_when(const struct voxmap *map, struct question *q)
{
    struct lattice_place place;
    q->since_ns = 0;
    if (!lattice_place(q->at_m, map->set.voxel_m, &place))
        return;
    for (uint32_t i = 0; i < map->set.max_submaps; i++) {
        const struct voxmap_part *part = &map->part[i];
        if (!part->id || (!submap_count(&part->map, SUBMAP_VACANCY, place.cell) &&
                          !submap_count(&part->map, SUBMAP_ECHOES, place.cell)))
            continue;
        if (part->begin_ns == 0) { /* loaded: nobody knows how old */
            q->since_ns = 0;
            return;
        }
        if (q->since_ns == 0 || part->begin_ns < q->since_ns)
            q->since_ns = part->begin_ns;
    }
}

/* ---- in steps ---- */

/* One step. Starts again when anything but pings has changed the map since. */
static void look_at_map(void *ctx, const struct pipeline_owned *owned)
{
    struct question *q = ctx;
    struct pipeline_map *m = owned->map;
    voxmap_pass(&m->map, q->now_ns);
    if (q->started == 0 || q->change_of_all != m->map.change_of_all) {
        q->started++;
        q->change_of_all = m->map.change_of_all;
        q->query = q->asked;
    }
    q->done = free_query_step(&q->query, &m->mask);
    if (q->done && q->point)
        since_when(&m->map, q);
}

/* Its answer, when enough steps are done. */
static bool answer(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    struct question *q = call->work->state;
    if (!request_job_done(call, d->pipeline, look_at_map, answer))
        return false;
    if (q->done) {
        write_answer(out, q);
        return true;
    }
    if (q->started > STARTS_MAX)
        return rpc_refuse(error, RPC_LIMIT,
                          "the map changes faster than this question is answered: ask about less");
    return rpc_continue(call, answer);
}

typedef bool read_fn(json_t *params, struct question *q, struct rpc_error *error);

/* A question that is read from params. */
static bool ask_map(const struct rpc_call *call, json_t *params, read_fn *read, struct json_out *out,
                    struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    if (!map_asked(d, error))
        return false;
    struct question *q = calloc(1, sizeof *q);
    if (!q) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
        return false;
    }
    q->d = d;
    q->now_ns = loop_now(d->loop);
    if (!read(params, q, error)) {
        free(q);
        return false;
    }
    rpc_work_keep(call->work, q, request_job_free);
    return answer(call, out, error);
}

/* ---- the questions ---- */

static bool asked(bool good, struct rpc_error *error)
{
    return good ||
           rpc_refuse(error, RPC_INVALID_PARAMS, "places too far away, or a question about too many voxels");
}

static bool small_enough(const struct methods_env *d, const double extent_m[3], struct rpc_error *error)
{
    double voxels = 1;
    for (int a = 0; a < 3; a++)
        voxels *= extent_m[a] / d->conf.map.voxel_m + 2;
    return voxels <= QUESTION_VOXELS ||
           rpc_refuse(error, RPC_LIMIT, "%.3g voxels asked about; at most %g are allowed", voxels,
                      QUESTION_VOXELS);
}

/* The box around all places where a point of the body's may be. */
static bool ask_around(const struct pose *pose, struct question *q, struct rpc_error *error)
{
    const double most_m = uncertain_m(pose, q->at_m), extent[3] = {2 * most_m, 2 * most_m, 2 * most_m};
    double low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = q->at_m[a] - most_m;
        high[a] = q->at_m[a] + most_m;
    }
    return small_enough(q->d, extent, error) &&
           asked(free_query_begin_box(&q->asked, q->d->conf.map.voxel_m, low, high), error);
}

static bool read_point(json_t *params, struct question *q, struct rpc_error *error)
{
    struct pose pose;
    q->point = true;
    if (!frame_of(q->d, params, &pose, error))
        return false;
    params_numbers(params, "position_m", q->at_m);
    place_by(&pose, q->at_m);
    return ask_around(&pose, q, error);
}

bool method_point(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    return ask_map(call, params, read_point, out, error);
}

static bool read_box(json_t *params, struct question *q, struct rpc_error *error)
{
    double a[3], b[3], low[3], high[3], extent[3];
    params_numbers(params, "from_m", a);
    params_numbers(params, "to_m", b);
    for (int i = 0; i < 3; i++) {
        low[i] = fmin(a[i], b[i]);
        high[i] = fmax(a[i], b[i]);
        extent[i] = high[i] - low[i];
    }
    return small_enough(q->d, extent, error) &&
           asked(free_query_begin_box(&q->asked, q->d->conf.map.voxel_m, low, high), error);
}

bool method_box(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    return ask_map(call, params, read_box, out, error);
}

static void path_of(const json_t *params, const struct pose *pose, struct question *q)
{
    double most_m = 0;
    q->n = params_places(params, "points_m", q->path_m);
    for (uint32_t i = 0; i < q->n; i++) {
        place_by(pose, q->path_m[i]);
        most_m = fmax(most_m, uncertain_m(pose, q->path_m[i]));
    }
    q->radius_m = params_number(params, "radius_m") + most_m;
}

/* Voxels of a corridor, as a bundle of boxes around its legs. */
static bool way_short_enough(const struct question *q, struct rpc_error *error)
{
    const double across = 2 * q->radius_m;
    double length = across;
    for (uint32_t i = 1; i < q->n; i++)
        length += hypot(hypot(q->path_m[i][0] - q->path_m[i - 1][0], q->path_m[i][1] - q->path_m[i - 1][1]),
                        q->path_m[i][2] - q->path_m[i - 1][2]);
    return small_enough(q->d, (const double[3]){length, across, across}, error);
}

static bool read_path(json_t *params, struct question *q, struct rpc_error *error)
{
    struct pose pose;
    if (!frame_of(q->d, params, &pose, error))
        return false;
    path_of(params, &pose, q);
    return way_short_enough(q, error) &&
           asked(free_query_begin_corridor(&q->asked, q->d->conf.map.voxel_m, (const double(*)[3])q->path_m, q->n,
                                           q->radius_m),
                 error);
}

bool method_path(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    return ask_map(call, params, read_path, out, error);
}
