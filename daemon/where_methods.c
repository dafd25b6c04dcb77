/* SPDX-License-Identifier: MIT */
/* where_methods - see where_methods.h. */
#include "where_methods.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../grid/voxel/free_query.h"
#include "errand.h"
#include "places.h"
#include "say.h"

#define QUESTION_VOXELS 2e6 /* in one question */
#define PATH_POINTS_MAX 256
#define BEGUN_MOST      8

/* ---- where ---- */

/* The pose by which places of this question become NED; the identity for those that are. */
static bool frame_of(const struct daemon *d, json_t *params, struct pose *pose, struct rpc_error *error)
{
    static const char *const words[] = {"ned", "body", NULL};
    int frame = 0;
    *pose = pose_identity;
    if (!rpc_word(params, "frame", words, &frame, error))
        return false;
    return frame == 0 || places_whole_pose(d, pose) ||
           rpc_refuse(error, RPC_INVALID_REQUEST,
                      "frame body needs a fresh pose with attitude, position and depth");
}

static bool place_of(json_t *params, const char *key, const struct pose *pose, double out[3],
                     struct rpc_error *error)
{
    bool given;
    double v[3];
    if (!rpc_numbers(params, key, -PLACES_MAX_M, PLACES_MAX_M, 3, v, &given, error))
        return false;
    if (!given)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is missing", key);
    quat_rotate(pose->attitude, v, out);
    for (int a = 0; a < 3; a++)
        out[a] += pose->position_m[a];
    return true;
}

/* How far a place of the body's may be from where the pose puts it: the vehicle may have moved, and turned about itself. */
static double slack_m(const struct pose *pose, const double at_m[3])
{
    double way2 = 0;
    for (int a = 0; a < 3; a++)
        way2 += (at_m[a] - pose->position_m[a]) * (at_m[a] - pose->position_m[a]);
    return pose->slack_m + pose->slack_rad * sqrt(way2);
}

/* ---- answers ---- */

static const char *const state_words[] = {
    [VOXEL_FREE] = "free", [VOXEL_UNKNOWN] = "unknown", [VOXEL_OCCUPIED] = "occupied"};

/* Of one request. */
struct question {
    struct errand errand;
    struct daemon *d;
    uint64_t now_ns; /* the map is judged as of then */
    bool point;
    double at_m[3];                   /* of a point */
    double way_m[PATH_POINTS_MAX][3]; /* of a path, ... */
    uint32_t n;                       /* ... so many; 0: it is none */
    double radius_m;
    struct free_query asked, query; /* at its begin, and now */
    bool done;
    int begun;              /* so often, ... */
    uint64_t change_of_all; /* ... the last time when the map stood at this */
    uint64_t
        since_ns; /* begin of the oldest submap that says anything of the point; 0: none does, or of another run */
};

/* no_body: nobody said that the vehicle's own place is free. */
static const char *reason_of(const struct free_answer *a, bool path, bool no_body, bool astray)
{
    return a->state == VOXEL_FREE ? "all of it was found free"
           : astray               ? "the pose jumped: nothing is free until map new, map forget or map load"
           : a->state == VOXEL_OCCUPIED && a->first_state != VOXEL_OCCUPIED
               ? "something was heard beyond the first place, which is unknown"
           : a->state == VOXEL_OCCUPIED ? "something was heard there"
           : a->away ? "a part of the map that may know is on disk; it comes back if there is room"
           : a->lost ? "a part of the map that knew was forgotten; fresh looks can find it free"
           : path && no_body && a->clear_m <= 0
               ? "unknown where it begins: no beam reaches the water at the vehicle itself; set body in [map]"
               : "never looked at, or not found free often enough";
}

static json_t *answer_json(const struct question *q)
{
    const struct free_answer *a = &q->query.answer;
    const bool is_free = a->state == VOXEL_FREE;
    if (a->away)
        pager_want(q->d, a->away_m);
    json_t *first = is_free ? json_null()
                            : json_pack("{s:s, s:o}", "state", state_words[a->first_state], "position_m",
                                        say_metres3(a->first_m));
    if (!is_free && q->n)
        json_object_set_new(first, "along_m", say_metres(a->clear_m));
    const double unknown = a->voxels ? (double)a->unknown / (double)a->voxels : 1;
    json_t *result = json_pack("{s:s, s:o, s:o, s:s}", "state", state_words[a->state], "first", first,
                               "unknown_share", json_real(round(unknown * 1e4) / 1e4), "reason",
                               reason_of(a, q->n > 0, q->d->conf.map.body_m <= 0, q->d->places.astray));
    const double age_s = q->now_ns > q->since_ns ? (double)(q->now_ns - q->since_ns) * 1e-9 : 0;
    if (q->point)
        json_object_set_new(result, "age_s", q->since_ns ? json_real(round(age_s * 1e3) * 1e-3) : json_null());
    return result;
}

static void since_when(const struct voxmap *map, struct question *q)
{
    struct lattice_place place;
    q->since_ns = 0;
    if (!lattice_place(q->at_m, map->set.voxel_m, &place))
        return;
    for (uint32_t i = 0; i < map->set.max_submaps; i++) {
        const struct voxmap_part *part = &map->part[i];
        if (!part->id || part->away ||
            (!submap_count(&part->map, SUBMAP_VACANCY, place.cell) &&
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

/* One step. Begins anew when anything but pings has changed the map since it was begun. */
static void look(void *ctx, const struct pipeline_owned *owned)
{
    struct question *q = ctx;
    struct pipeline_map *m = owned->map;
    voxmap_pass(&m->map, q->now_ns);
    if (q->begun == 0 || q->change_of_all != m->map.change_of_all) {
        q->begun++;
        q->change_of_all = m->map.change_of_all;
        q->query = q->asked;
    }
    q->done = free_query_step(&q->query, &m->mask);
    if (q->done && q->point)
        since_when(&m->map, q);
}

/* Its answer, or NULL with *error set when it has none yet, or never. */
static json_t *answer(const struct rpc_call *call, struct question *q, struct rpc_error *error)
{
    *call->work = (struct rpc_work){.state = q, .drop = errand_free};
    if (!errand_done(call, look, error))
        return NULL;
    if (q->done)
        return answer_json(q);
    if (q->begun > BEGUN_MOST)
        rpc_refuse(error, RPC_LIMIT, "the map changes faster than so large a question is answered: ask for less");
    else
        error->code = RPC_UNFINISHED;
    return NULL;
}

typedef bool read_fn(json_t *params, struct question *q, struct rpc_error *error);

/* The next part of a question that was begun, or the first of one that is read from params. */
static json_t *go_on(const struct rpc_call *call, json_t *params, read_fn *read, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    struct question *q = call->work->state;
    if (q)
        return answer(call, q, error);
    if (!places_there(d, error))
        return NULL;
    q = calloc(1, sizeof *q);
    if (!q) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
        return NULL;
    }
    q->d = d;
    q->now_ns = loop_now(d->loop);
    if (read(params, q, error))
        return answer(call, q, error);
    free(q);
    return NULL;
}

/* ---- the questions ---- */

static bool asked(bool good, struct rpc_error *error)
{
    return good ||
           rpc_refuse(error, RPC_INVALID_PARAMS, "places too far away, or a question about too many voxels");
}

static bool small_enough(const struct daemon *d, const double extent_m[3], struct rpc_error *error)
{
    double voxels = 1;
    for (int a = 0; a < 3; a++)
        voxels *= extent_m[a] / d->conf.map.voxel_m + 2;
    return voxels <= QUESTION_VOXELS ||
           rpc_refuse(error, RPC_LIMIT,
                      "a question about %.3g voxels, at most %g are allowed: ask for less at a time", voxels,
                      QUESTION_VOXELS);
}

/* The box around all places where a point of the body's may be. */
static bool ask_around(const struct pose *pose, struct question *q, struct rpc_error *error)
{
    const double most_m = slack_m(pose, q->at_m), extent[3] = {2 * most_m, 2 * most_m, 2 * most_m};
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
    static const char *const keys[] = {"position_m", "frame", NULL};
    struct pose pose;
    q->point = true;
    return rpc_only(params, keys, error) && frame_of(q->d, params, &pose, error) &&
           place_of(params, "position_m", &pose, q->at_m, error) && ask_around(&pose, q, error);
}

json_t *where_method_point(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    return go_on(call, params, read_point, error);
}

static bool read_box(json_t *params, struct question *q, struct rpc_error *error)
{
    static const char *const keys[] = {"from_m", "to_m", NULL};
    double a[3], b[3], low[3], high[3], extent[3];
    if (!rpc_only(params, keys, error) || !place_of(params, "from_m", &pose_identity, a, error) ||
        !place_of(params, "to_m", &pose_identity, b, error))
        return false;
    for (int i = 0; i < 3; i++) {
        low[i] = fmin(a[i], b[i]);
        high[i] = fmax(a[i], b[i]);
        extent[i] = high[i] - low[i];
    }
    return small_enough(q->d, extent, error) &&
           asked(free_query_begin_box(&q->asked, q->d->conf.map.voxel_m, low, high), error);
}

json_t *where_method_box(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    return go_on(call, params, read_box, error);
}

static bool way_of(json_t *params, const struct pose *pose, struct question *q, struct rpc_error *error)
{
    json_t *points = json_object_get(params, "points_m");
    const size_t n = json_array_size(points);
    if (n < 1 || n > PATH_POINTS_MAX)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "points_m must be an array of 1 to %d places",
                          PATH_POINTS_MAX);
    for (size_t i = 0; i < n; i++) {
        json_t *one = json_pack("{s:O}", "points_m", json_array_get(points, i));
        const bool good = place_of(one, "points_m", pose, q->way_m[i], error);
        json_decref(one);
        if (!good)
            return false;
    }
    q->n = (uint32_t)n;
    double most_m = 0;
    for (uint32_t i = 0; i < q->n; i++)
        most_m = fmax(most_m, slack_m(pose, q->way_m[i]));
    q->radius_m += most_m;
    return true;
}

/* Voxels of a corridor, as a bundle of boxes around its legs. */
static bool way_short_enough(const struct question *q, struct rpc_error *error)
{
    const double across = 2 * q->radius_m;
    double length = across;
    for (uint32_t i = 1; i < q->n; i++)
        length += hypot(hypot(q->way_m[i][0] - q->way_m[i - 1][0], q->way_m[i][1] - q->way_m[i - 1][1]),
                        q->way_m[i][2] - q->way_m[i - 1][2]);
    return small_enough(q->d, (const double[3]){length, across, across}, error);
}

static bool read_path(json_t *params, struct question *q, struct rpc_error *error)
{
    static const char *const keys[] = {"points_m", "radius_m", "frame", NULL};
    struct pose pose;
    return rpc_only(params, keys, error) && frame_of(q->d, params, &pose, error) &&
           rpc_number(params, "radius_m", true, 0, 100, &q->radius_m, error) && way_of(params, &pose, q, error) &&
           way_short_enough(q, error) &&
           asked(free_query_begin_corridor(&q->asked, q->d->conf.map.voxel_m, (const double(*)[3])q->way_m, q->n,
                                           q->radius_m),
                 error);
}

json_t *where_method_path(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    return go_on(call, params, read_path, error);
}
