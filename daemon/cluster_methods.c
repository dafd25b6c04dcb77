/* SPDX-License-Identifier: MIT */
#include "cluster_methods.h"

#include <math.h>
#include <string.h>

#include "../grid/answer/next_look.h"
#include "../grid/sphere/shapes.h"
#include "daemon.h"
#include "grid_methods.h"
#include "say.h"

#define DEFAULT_COUNT 64

#define DEFAULT_LOOKS     8
#define DEFAULT_BAND_DEG  5.0
#define DEFAULT_APART_DEG 10.0

static json_t *age(const struct daemon *d, uint64_t t_ns)
{
    const uint64_t now = loop_now(d->loop);
    return say_real(now > t_ns ? (double)(now - t_ns) * 1e-9 : 0, 1e3);
}

/* The first time makes room for them. */
static struct clusters *clusters_of(struct daemon *d, struct grid *grid, struct rpc_error *error)
{
    char err[256];
    if (!grid_has_room(d, grid->setting.name, grid_clusters_bytes(grid), err, sizeof err)) {
        rpc_refuse(error, RPC_LIMIT, "clusters of %s", err);
        return NULL;
    }
    struct clusters *clusters = grid_clusters(grid);
    if (!clusters)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for clusters of %u cells",
                   grid->setting.sphere.max_cells);
    return clusters;
}

static json_t *cluster_json(const struct daemon *d, const struct shapes *shapes, const struct cluster *k)
{
    const uint32_t ghost_of = shapes_ghost_of(shapes, k);
    double az, el;
    geo_angles(k->nearest_m, &az, &el);
    return json_pack(
        "{s:I, s:i, s:i, s:I, s:{s:i, s:i, s:i}, s:i, s:o, s:o, s:[o, o], s:o, s:o, s:{s:o, s:o}, s:[o, o, o], s:o, s:o, s:o, "
        "s:o, s:o, s:o, s:o}",
        "label", (json_int_t)k->label, "cells", (int)k->cells, "seeds", (int)k->seeds, "echoes",
        (json_int_t)k->echoes, "turn", "appeared", (int)k->appeared, "updated", (int)k->updated, "missed",
        (int)k->missed, "locked", (int)k->locked, "from_deg", say_degrees(k->from_rad), "width_deg", say_degrees(k->width_rad),
        "elevation_deg", say_degrees(k->low_rad), say_degrees(k->high_rad), "near_m", say_metres(k->near_m),
        "far_m", say_metres(k->far_m), "nearest", "azimuth_deg", say_degrees(az), "elevation_deg", say_degrees(el),
        "centre_m", say_metres(k->centre_m[0]), say_metres(k->centre_m[1]), say_metres(k->centre_m[2]),
        "confidence", say_real(1 / (1 + exp(-k->logodds)), 1e3), "first_echo_age_s", age(d, k->t_first_ns),
        "last_echo_age_s", age(d, k->t_echo_ns), "label_age_s", age(d, k->t_label_ns), "approach_mps",
        say_real(k->approach_mps, 1e4), "growth_directions_ps", say_real(k->growth_directions_ps, 1e2), "ghost_of",
        ghost_of == TANGENTS_NONE ? json_null() : json_integer(ghost_of));
}

/* May places in the grid's axes be trusted? In the body's axes no pose is needed. */
static const char *pose_word(const struct daemon *d, bool ned)
{
    return !ned ? "not needed" : pose_log_fresh(&d->poses, loop_now(d->loop)) ? "fresh" : "old";
}

static json_t *walls_json(const struct shapes *shapes)
{
    json_t *walls = json_array();
    for (uint32_t i = 0; i < shapes->n; i++) {
        const struct wall *w = &shapes->wall[i];
        json_array_append_new(walls, json_pack("{s:o, s:o, s:o, s:o, s:o, s:i, s:b}", "normal_deg",
                                               say_degrees(w->normal_rad), "distance_m", say_metres(w->distance_m),
                                               "from_m", say_metres(w->from_m), "to_m", say_metres(w->to_m),
                                               "rms_m", say_metres(w->rms_m), "points", (int)w->points,
                                               "constant_depth", shapes->constant_depth[i]));
    }
    return walls;
}

static json_t *corners_json(const struct shapes *shapes)
{
    json_t *corners = json_array();
    for (uint32_t i = 0; i < shapes->corners; i++) {
        const struct shapes_corner *c = &shapes->corner[i];
        json_array_append_new(corners, json_pack("{s:[i, i], s:[o, o]}", "walls", (int)c->a, (int)c->b, "place_m",
                                                 say_metres(c->place.x_m), say_metres(c->place.y_m)));
    }
    return corners;
}

static json_t *gone_json(const struct daemon *d, const struct clusters *clusters)
{
    json_t *list = json_array();
    const struct cluster_gone *g;
    for (uint32_t k = 0; (g = clusters_gone(clusters, k)); k++) {
        double az, el;
        geo_angles(g->place_m, &az, &el);
        json_array_append_new(
            list, json_pack("{s:I, s:s, s:o, s:o, s:o, s:o, s:i, s:o}", "label", (json_int_t)g->label, "why",
                            vanish_word(g->why), "age_s", age(d, g->t_gone_ns), "azimuth_deg", say_degrees(az),
                            "elevation_deg", say_degrees(el), "range_m",
                            say_metres(sqrt(g->place_m[0] * g->place_m[0] + g->place_m[1] * g->place_m[1] +
                                            g->place_m[2] * g->place_m[2])),
                            "cells", (int)g->cells, "last_echo_age_s", age(d, g->t_echo_ns)));
    }
    return list;
}

json_t *cluster_method_list(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"count", "grid", NULL};
    struct daemon *d = call->daemon;
    int64_t count = DEFAULT_COUNT;
    struct grid *grid;
    struct clusters *known;
    if (!rpc_only(params, keys, error) || !rpc_integer(params, "count", false, 1, CLUSTERS_MAX, &count, error) ||
        !(grid = grid_asked(d, params, error)) || !(known = clusters_of(d, grid, error)))
        return NULL;
    const struct cluster *list;
    struct picture_frame frame;
    struct shapes shapes;
    uint32_t all, n = clusters_look(known, pipeline_sphere(d->pipeline, grid), loop_now(d->loop), &list, &all);
    picture_get_frame(grid_picture(grid), &frame);
    shapes_look(&shapes, grid_picture(grid), loop_now(d->loop));
    json_t *clusters = json_array();
    for (uint32_t i = 0; i < n && i < count; i++)
        json_array_append_new(clusters, cluster_json(d, &shapes, &list[i]));
    return json_pack("{s:s, s:s, s:I, s:o, s:o, s:o, s:o}", "frame", frame.ned ? "ned" : "body", "pose",
                     pose_word(d, frame.ned), "all", (json_int_t)all, "clusters", clusters, "walls",
                     walls_json(&shapes), "corners", corners_json(&shapes), "gone", gone_json(d, known));
}

/* ---- where to look next ---- */

static bool look_conf(const struct daemon *d, json_t *params, const struct grid *grid, bool ned,
                      struct next_look_conf *conf, struct rpc_error *error)
{
    double band[2] = {-DEFAULT_BAND_DEG, DEFAULT_BAND_DEG}, apart = DEFAULT_APART_DEG;
    struct pose pose = pose_identity;
    bool given;
    if (!rpc_numbers(params, "elevation_deg", -90, 90, 2, band, &given, error) ||
        !rpc_number(params, "apart_deg", false, 0, 180, &apart, error))
        return false;
    if (band[0] >= band[1])
        return rpc_refuse(error, RPC_INVALID_PARAMS,
                          "elevation_deg is [%g, %g]: the first must be below the second", band[0], band[1]);
    *conf = (struct next_look_conf){.stale_s = grid->setting.limits.clear_for_s,
                                    .low_rad = geo_rad(band[0]),
                                    .high_rad = geo_rad(band[1]),
                                    .apart_rad = geo_rad(apart)};
    /* a velocity is told in NED: nobody knows where that is in a grid of the body's axes */
    pose_log_newest(&d->poses, &pose);
    if (ned && (pose.has & POSE_VELOCITY) && pose_log_fresh(&d->poses, loop_now(d->loop)))
        memcpy(conf->velocity_mps, pose.velocity_mps, sizeof conf->velocity_mps);
    return true;
}

json_t *cluster_method_next_look(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"count", "elevation_deg", "apart_deg", "grid", NULL};
    struct daemon *d = call->daemon;
    int64_t count = DEFAULT_LOOKS;
    struct grid *grid;
    struct clusters *known;
    struct picture_frame frame;
    struct next_look_conf conf;
    if (!rpc_only(params, keys, error) || !rpc_integer(params, "count", false, 1, NEXT_LOOK_MAX, &count, error) ||
        !(grid = grid_asked(d, params, error)))
        return NULL;
    picture_get_frame(grid_picture(grid), &frame);
    if (!look_conf(d, params, grid, frame.ned, &conf, error) || !(known = clusters_of(d, grid, error)))
        return NULL;
    const struct cluster *list;
    struct next_look look[NEXT_LOOK_MAX];
    const uint64_t now_ns = loop_now(d->loop);
    uint32_t all, n = clusters_look(known, pipeline_sphere(d->pipeline, grid), now_ns, &list, &all);
    n = next_look(grid_picture(grid), now_ns, &conf, list, n, look, (uint32_t)count);
    json_t *looks = json_array();
    for (uint32_t i = 0; i < n; i++) {
        const struct next_look *l = &look[i];
        json_array_append_new(looks, json_pack("{s:o, s:o, s:o, s:s, s:o}", "azimuth_deg", say_degrees(l->az_rad),
                                               "elevation_deg", say_degrees(l->el_rad), "score",
                                               say_real(l->score, 1e3), "why", next_look_word(l->why), "age_s",
                                               l->age_s < 0 ? json_null() : say_real(l->age_s, 1e3)));
    }
    return json_pack("{s:s, s:o}", "frame", frame.ned ? "ned" : "body", "directions", looks);
}
