/* SPDX-License-Identifier: MIT */
#include "cluster_methods.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../grid/answer/next_look.h"
#include "../grid/sphere/shapes.h"
#include "errand.h"
#include "grid_methods.h"
#include "say.h"

#define DEFAULT_COUNT     64
#define CLUSTERS_PER_PART 32

#define DEFAULT_LOOKS     8
#define DEFAULT_BAND_DEG  5.0
#define DEFAULT_APART_DEG 10.0

/* The clusters of a grid at one moment, of one request. */
struct look {
    struct errand errand;
    struct daemon *d;
    struct clusters *known; /* of the grid: as long as that is there, and the owner's to look into */
    uint64_t grid_number, now_ns;
    bool there;
    struct picture_frame frame;
    uint32_t n, all, n_gone;
    struct cluster list[CLUSTERS_MAX];
    struct cluster_gone gone[CLUSTERS_GONE_MAX];
    struct shapes shapes;       /* of clusters */
    uint32_t wanted, written;   /* clusters */
    bool begun;                 /* to write */
    struct next_look_conf conf; /* of next_look ... */
    struct next_look way[NEXT_LOOK_MAX];
    uint32_t ways;
};

static void write_since(struct text *out, const char *name, const struct look *l, uint64_t t_ns)
{
    write_age(out, name, l->now_ns > t_ns ? (double)(l->now_ns - t_ns) * 1e-9 : 0);
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

/* The part of the grid's owner: all that is told, as of one moment. */
static struct grid *look_at(struct look *l, const struct pipeline_owned *owned)
{
    struct grid *grid = pipeline_owned_grid(owned, l->grid_number);
    const struct cluster_gone *g;
    const struct cluster *list;
    l->there = grid != NULL;
    if (!grid)
        return NULL;
    l->n = clusters_look(l->known, grid->sphere, l->now_ns, &list, &l->all);
    memcpy(l->list, list, l->n * sizeof *list);
    for (l->n_gone = 0; (g = clusters_gone(l->known, l->n_gone)); l->n_gone++)
        l->gone[l->n_gone] = *g;
    return grid;
}

static void look_at_shapes(void *ctx, const struct pipeline_owned *owned)
{
    struct look *l = ctx;
    struct grid *grid = look_at(l, owned);
    if (!grid)
        return;
    picture_get_frame(grid_picture(grid), &l->frame);
    shapes_look(&l->shapes, grid_picture(grid), l->now_ns);
}

static void look_at_ways(void *ctx, const struct pipeline_owned *owned)
{
    struct look *l = ctx;
    struct grid *grid = look_at(l, owned);
    if (grid)
        l->ways = next_look(grid_picture(grid), l->now_ns, &l->conf, l->list, l->n, l->way, l->wanted);
}

/* NULL with *error set. */
static struct look *begin_look(const struct rpc_call *call, struct grid *grid, uint32_t wanted,
                               struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    struct clusters *known = clusters_of(d, grid, error);
    struct look *l = known ? calloc(1, sizeof *l) : NULL;
    if (!l) {
        if (known)
            rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for a look at clusters");
        return NULL;
    }
    l->d = d;
    l->known = known;
    l->grid_number = grid->number;
    l->now_ns = loop_now(d->loop);
    l->wanted = wanted;
    *call->work = (struct rpc_work){.state = l, .drop = errand_free};
    return l;
}

/* False with *error set: not done yet, or never. */
static bool looked(const struct rpc_call *call, pipeline_owner_fn *fn, struct rpc_error *error)
{
    const struct look *l = call->work->state;
    return errand_done(call, fn, error) &&
           (l->there || rpc_refuse(error, RPC_INVALID_PARAMS, "grid: it was dropped meanwhile"));
}

static void write_count(struct text *out, const char *name, uint32_t n)
{
    text_name(out, name);
    text_integer(out, n);
}

static void write_turn(struct text *out, const struct cluster *k)
{
    text_name(out, "turn");
    text_open(out, '{');
    write_count(out, "appeared", k->appeared);
    write_count(out, "updated", k->updated);
    write_count(out, "missed", k->missed);
    text_close(out, '}');
}

static void write_where(struct text *out, const struct cluster *k)
{
    double az, el;
    geo_angles(k->nearest_m, &az, &el);
    write_degrees(out, "from_deg", k->from_rad);
    write_degrees(out, "width_deg", k->width_rad);
    text_name(out, "elevation_deg");
    text_open(out, '[');
    text_real(out, say_rounded(geo_deg(k->low_rad), SAY_DEGREES));
    text_real(out, say_rounded(geo_deg(k->high_rad), SAY_DEGREES));
    text_close(out, ']');
    write_metres(out, "near_m", k->near_m);
    write_metres(out, "far_m", k->far_m);
    text_name(out, "nearest");
    text_open(out, '{');
    write_degrees(out, "azimuth_deg", az);
    write_degrees(out, "elevation_deg", el);
    text_close(out, '}');
    write_metres3(out, "centre_m", k->centre_m);
}

static void write_cluster(struct text *out, const struct look *l, const struct cluster *k)
{
    const uint32_t ghost_of = shapes_ghost_of(&l->shapes, k);
    text_open(out, '{');
    write_count(out, "label", k->label);
    write_count(out, "cells", k->cells);
    write_count(out, "seeds", k->seeds);
    write_count(out, "echoes", k->echoes);
    write_turn(out, k);
    write_count(out, "locked", k->locked);
    write_where(out, k);
    write_real(out, "confidence", 1 / (1 + exp(-k->logodds)), 1e3);
    write_since(out, "first_echo_age_s", l, k->t_first_ns);
    write_since(out, "last_echo_age_s", l, k->t_echo_ns);
    write_since(out, "label_age_s", l, k->t_label_ns);
    write_real(out, "approach_mps", k->approach_mps, 1e4);
    write_real(out, "growth_directions_ps", k->growth_directions_ps, 1e2);
    if (ghost_of == TANGENTS_NONE)
        write_null(out, "ghost_of");
    else
        write_count(out, "ghost_of", ghost_of);
    text_close(out, '}');
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

static void write_gone(struct text *out, const struct look *l, const struct cluster_gone *g)
{
    double az, el;
    geo_angles(g->place_m, &az, &el);
    text_open(out, '{');
    write_count(out, "label", g->label);
    write_word(out, "why", vanish_word(g->why));
    write_since(out, "age_s", l, g->t_gone_ns);
    write_degrees(out, "azimuth_deg", az);
    write_degrees(out, "elevation_deg", el);
    write_metres(
        out, "range_m",
        sqrt(g->place_m[0] * g->place_m[0] + g->place_m[1] * g->place_m[1] + g->place_m[2] * g->place_m[2]));
    write_count(out, "cells", g->cells);
    write_since(out, "last_echo_age_s", l, g->t_echo_ns);
    text_close(out, '}');
}

static void write_list_head(struct text *out, const struct look *l)
{
    text_open(out, '{');
    write_word(out, "frame", l->frame.ned ? "ned" : "body");
    write_word(out, "pose", pose_word(l->d, l->frame.ned));
    write_count(out, "all", l->all);
    text_name(out, "clusters");
    text_open(out, '[');
}

/* What follows the clusters. */
static void write_list_rest(struct text *out, const struct look *l)
{
    json_t *walls = walls_json(&l->shapes), *corners = corners_json(&l->shapes);
    text_close(out, ']');
    text_name(out, "walls");
    text_json(out, walls);
    text_name(out, "corners");
    text_json(out, corners);
    text_name(out, "gone");
    text_open(out, '[');
    for (uint32_t i = 0; i < l->n_gone; i++)
        write_gone(out, l, &l->gone[i]);
    text_put(out, "]}");
    json_decref(walls);
    json_decref(corners);
}

static struct look *begin_list(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"count", "grid", NULL};
    int64_t count = DEFAULT_COUNT;
    struct grid *grid;
    if (!rpc_only(params, keys, error) || !rpc_integer(params, "count", false, 1, CLUSTERS_MAX, &count, error) ||
        !(grid = grid_asked(call->daemon, params, error)))
        return NULL;
    return begin_look(call, grid, (uint32_t)count, error);
}

/* In parts: the look, and then some clusters in each. */
bool cluster_method_list(const struct rpc_call *call, json_t *params, struct text *out, struct rpc_error *error)
{
    struct look *l = call->work->state;
    if (!l && !(l = begin_list(call, params, error)))
        return false;
    if (!l->begun) {
        if (!looked(call, look_at_shapes, error))
            return false;
        write_list_head(out, l);
        l->begun = true;
    }
    const uint32_t end = l->n < l->wanted ? l->n : l->wanted;
    for (int i = 0; i < CLUSTERS_PER_PART && l->written < end; i++)
        write_cluster(out, l, &l->list[l->written++]);
    if (l->written < end) {
        error->code = RPC_UNFINISHED;
        return false;
    }
    write_list_rest(out, l);
    return true; /* the work is dropped with the request */
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

static struct look *begin_ways(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"count", "elevation_deg", "apart_deg", "grid", NULL};
    struct daemon *d = call->daemon;
    int64_t count = DEFAULT_LOOKS;
    struct grid *grid;
    struct picture_frame frame;
    struct next_look_conf conf;
    if (!rpc_only(params, keys, error) || !rpc_integer(params, "count", false, 1, NEXT_LOOK_MAX, &count, error) ||
        !(grid = grid_asked(d, params, error)))
        return NULL;
    picture_get_frame(grid_picture(grid), &frame);
    if (!look_conf(d, params, grid, frame.ned, &conf, error))
        return NULL;
    struct look *l = begin_look(call, grid, (uint32_t)count, error);
    if (l) {
        l->conf = conf;
        l->frame = frame;
    }
    return l;
}

json_t *cluster_method_next_look(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct look *l = call->work->state;
    if ((!l && !(l = begin_ways(call, params, error))) || !looked(call, look_at_ways, error))
        return NULL;
    json_t *looks = json_array();
    for (uint32_t i = 0; i < l->ways; i++) {
        const struct next_look *w = &l->way[i];
        json_array_append_new(looks,
                              json_pack("{s:o, s:o, s:o, s:s, s:o}", "azimuth_deg", say_degrees(w->az_rad),
                                        "elevation_deg", say_degrees(w->el_rad), "score", say_real(w->score, 1e3),
                                        "why", next_look_word(w->why), "age_s", say_age(w->age_s)));
    }
    return json_pack("{s:s, s:o}", "frame", l->frame.ned ? "ned" : "body", "directions", looks);
}
