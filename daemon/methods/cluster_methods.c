/* SPDX-License-Identifier: MIT */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/answer/next_look.h"
#include "grid/sphere/shapes.h"
#include "daemon/request_job.h"
#include "grid_methods.h"
#include "methods.h"
#include "json_units.h"

#define CLUSTERS_PER_PART 32

_Static_assert(PROTOCOL_CLUSTERS_MAX <= CLUSTERS_MAX, "more clusters may be asked for than there are");
_Static_assert(PROTOCOL_NEXT_LOOK_MAX <= NEXT_LOOK_MAX, "more directions may be asked for than there are");

/* The clusters of a grid at one moment, of one request. */
struct look {
    struct owner_job call;
    struct methods_env *d;
    struct grid *grid;
    struct clusters *known; /* of it: the owner's to look into */
    uint64_t now_ns;
    struct picture_frame frame;
    uint32_t n, all, n_gone;
    struct cluster list[CLUSTERS_MAX];
    struct cluster_gone gone[CLUSTERS_GONE_MAX];
    struct shapes shapes;       /* of clusters */
    uint32_t wanted, written;   /* clusters */
    bool begun, looked;         /* at the clusters */
    struct next_look_conf conf; /* of next_look ... */
    struct next_look_ranking ranking;
};

static void write_since(struct json_out *out, const char *name, const struct look *l, uint64_t t_ns)
{
    json_member_age(out, name, l->now_ns > t_ns ? (double)(l->now_ns - t_ns) * 1e-9 : 0);
}

/* The first time makes room for them. */
static struct clusters *clusters_of(struct methods_env *d, struct grid *grid, struct rpc_error *error)
{
    struct fault fault;
    if (!grid_has_room(d, grid->setting.name, grid_clusters_bytes(grid), &fault)) {
        rpc_refuse(error, RPC_LIMIT, "clusters of %s", fault.text);
        return NULL;
    }
    struct clusters *clusters = grid_clusters(grid);
    if (!clusters)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for clusters of %u cells",
                   grid->setting.sphere.max_cells);
    return clusters;
}

/* The part of the grid's owner, in steps. False: there are more. */
static bool look_at(struct look *l)
{
    const struct cluster_gone *g;
    const struct cluster *list;
    if (!l->begun)
        clusters_begin(l->known, l->now_ns);
    l->begun = true;
    if (clusters_step(l->known, l->grid->sphere))
        return false;
    l->n = clusters_list(l->known, &list, &l->all);
    memcpy(l->list, list, l->n * sizeof *list);
    for (l->n_gone = 0; (g = clusters_gone(l->known, l->n_gone)); l->n_gone++)
        l->gone[l->n_gone] = *g;
    return true;
}

static void look_at_shapes(void *ctx, const struct pipeline_owned *owned)
{
    struct look *l = ctx;
    (void)owned;
    l->call.more = !look_at(l);
    if (l->call.more)
        return;
    picture_get_frame(grid_picture(l->grid), &l->frame);
    shapes_look(&l->shapes, grid_picture(l->grid), l->now_ns);
}

static void look_at_ways(void *ctx, const struct pipeline_owned *owned)
{
    struct look *l = ctx;
    (void)owned;
    l->call.more = true;
    if (l->looked) {
        l->call.more = next_look_step(&l->ranking, grid_picture(l->grid));
    } else if (look_at(l)) {
        l->looked = true;
        l->conf.clusters = l->list;
        l->conf.n_clusters = l->n;
        l->conf.gone = l->gone;
        l->conf.n_gone = l->n_gone;
        next_look_begin(&l->ranking, l->now_ns, &l->conf, l->grid->look_score, l->wanted);
    }
}

/* NULL with *error set. */
static struct look *begin_look(const struct rpc_call *call, struct grid *grid, uint32_t wanted,
                               struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct clusters *known = clusters_of(d, grid, error);
    struct look *l = known ? calloc(1, sizeof *l) : NULL;
    if (!l) {
        if (known)
            rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for a look at clusters");
        return NULL;
    }
    l->d = d;
    l->known = known;
    l->grid = grid;
    l->now_ns = loop_now(d->loop);
    l->wanted = wanted;
    rpc_work_keep(call->work, l, request_job_free);
    return l;
}

static void write_count(struct json_out *out, const char *name, uint32_t n)
{
    json_out_name(out, name);
    json_out_integer(out, n);
}

static void write_turn(struct json_out *out, const struct cluster *k)
{
    json_out_name(out, "turn");
    json_out_open(out, '{');
    write_count(out, "appeared", k->appeared);
    write_count(out, "updated", k->updated);
    write_count(out, "missed", k->missed);
    json_out_close(out, '}');
}

static void write_where(struct json_out *out, const struct cluster *k)
{
    double az, el;
    geo_angles(k->nearest_m, &az, &el);
    json_member_degrees(out, "from_deg", k->from_rad);
    json_member_degrees(out, "width_deg", k->width_rad);
    json_out_name(out, "elevation_deg");
    json_out_open(out, '[');
    json_out_rounded(out, geo_deg(k->low_rad), PER_DEGREES);
    json_out_rounded(out, geo_deg(k->high_rad), PER_DEGREES);
    json_out_close(out, ']');
    json_member_metres(out, "near_m", k->near_m);
    json_member_metres(out, "far_m", k->far_m);
    json_out_name(out, "nearest");
    json_out_open(out, '{');
    json_member_degrees(out, "azimuth_deg", az);
    json_member_degrees(out, "elevation_deg", el);
    json_out_close(out, '}');
    json_member_metres3(out, "centre_m", k->centre_m);
}

static void write_cluster(struct json_out *out, const struct look *l, const struct cluster *k)
{
    const uint32_t ghost_of = shapes_ghost_of(&l->shapes, k);
    json_out_open(out, '{');
    write_count(out, "label", k->label);
    write_count(out, "cells", k->cells);
    write_count(out, "seeds", k->seeds);
    write_count(out, "echoes", k->echoes);
    write_turn(out, k);
    write_count(out, "locked", k->locked);
    write_where(out, k);
    json_member_real(out, "confidence", 1 / (1 + exp(-k->logodds)), 1e3);
    write_since(out, "first_echo_age_s", l, k->t_first_ns);
    write_since(out, "last_echo_age_s", l, k->t_echo_ns);
    write_since(out, "label_age_s", l, k->t_label_ns);
    json_member_real(out, "approach_mps", k->approach_mps, 1e4);
    json_member_real(out, "growth_directions_ps", k->growth_directions_ps, 1e2);
    if (ghost_of == TANGENTS_NONE)
        json_member_null(out, "ghost_of");
    else
        write_count(out, "ghost_of", ghost_of);
    json_out_close(out, '}');
}

/* May places in the grid's axes be trusted? In the body's axes no pose is needed. */
static const char *pose_word(const struct methods_env *d, bool ned)
{
    return !ned ? "not needed" : pose_log_fresh(&d->poses, loop_now(d->loop)) ? "fresh" : "old";
}

static void write_walls(struct json_out *out, const struct shapes *shapes)
{
    json_member_open(out, "walls", '[');
    for (uint32_t i = 0; i < shapes->n; i++) {
        const struct wall *w = &shapes->wall[i];
        json_out_open(out, '{');
        json_member_degrees(out, "normal_deg", w->normal_rad);
        json_member_metres(out, "distance_m", w->distance_m);
        json_member_metres(out, "from_m", w->from_m);
        json_member_metres(out, "to_m", w->to_m);
        json_member_metres(out, "rms_m", w->rms_m);
        json_member_count(out, "points", w->points);
        json_member_flag(out, "constant_depth", shapes->constant_depth[i]);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
}

static void write_place(struct json_out *out, const char *name, const struct tangent_point *place)
{
    json_member_open(out, name, '[');
    json_out_rounded(out, place->x_m, PER_METRES);
    json_out_rounded(out, place->y_m, PER_METRES);
    json_out_close(out, ']');
}

static void write_corners(struct json_out *out, const struct shapes *shapes)
{
    json_member_open(out, "corners", '[');
    for (uint32_t i = 0; i < shapes->corners; i++) {
        const struct shapes_corner *c = &shapes->corner[i];
        json_out_open(out, '{');
        json_member_open(out, "walls", '[');
        json_out_integer(out, c->a);
        json_out_integer(out, c->b);
        json_out_close(out, ']');
        write_place(out, "place_m", &c->place);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
}

static void write_arcs(struct json_out *out, const struct shapes *shapes)
{
    json_member_open(out, "arcs", '[');
    for (uint32_t i = 0; i < shapes->arcs; i++) {
        const struct arc *a = &shapes->arc[i];
        json_out_open(out, '{');
        write_place(out, "centre_m", &a->centre);
        json_member_metres(out, "radius_m", a->radius_m);
        json_member_metres(out, "rms_m", a->rms_m);
        json_member_count(out, "points", a->points);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
}

static void write_regions(struct json_out *out, const struct shapes *shapes)
{
    json_member_open(out, "regions", '[');
    for (uint32_t i = 0; i < shapes->regions; i++) {
        const struct shapes_region *r = &shapes->region[i];
        json_out_open(out, '{');
        json_member_degrees(out, "from_deg", r->from_rad);
        json_member_degrees(out, "width_deg", r->width_rad);
        json_member_metres(out, "least_m", r->least_m);
        json_member_metres(out, "most_m", r->most_m);
        json_member_count(out, "bearings", r->bearings);
        if (r->wall == TANGENTS_NONE)
            json_member_null(out, "wall");
        else
            write_count(out, "wall", r->wall);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
}

static void write_gone(struct json_out *out, const struct look *l, const struct cluster_gone *g)
{
    double az, el;
    geo_angles(g->place_m, &az, &el);
    json_out_open(out, '{');
    write_count(out, "label", g->label);
    json_member_word(out, "why", vanish_word(g->why));
    write_since(out, "age_s", l, g->t_gone_ns);
    json_member_degrees(out, "azimuth_deg", az);
    json_member_degrees(out, "elevation_deg", el);
    json_member_metres(
        out, "range_m",
        sqrt(g->place_m[0] * g->place_m[0] + g->place_m[1] * g->place_m[1] + g->place_m[2] * g->place_m[2]));
    write_count(out, "cells", g->cells);
    write_since(out, "last_echo_age_s", l, g->t_echo_ns);
    json_out_close(out, '}');
}

static void write_list_head(struct json_out *out, const struct look *l)
{
    json_out_open(out, '{');
    json_member_word(out, "frame", l->frame.ned ? "ned" : "body");
    json_member_word(out, "pose", pose_word(l->d, l->frame.ned));
    write_count(out, "all", l->all);
    json_out_name(out, "clusters");
    json_out_open(out, '[');
}

/* What follows the clusters. */
static void write_list_rest(struct json_out *out, const struct look *l)
{
    json_out_close(out, ']');
    write_walls(out, &l->shapes);
    write_corners(out, &l->shapes);
    write_arcs(out, &l->shapes);
    write_regions(out, &l->shapes);
    json_out_name(out, "gone");
    json_out_open(out, '[');
    for (uint32_t i = 0; i < l->n_gone; i++)
        write_gone(out, l, &l->gone[i]);
    json_out_put(out, "]}");
}

static struct look *begin_list(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct grid *grid = grid_asked(call->daemon, params, error);
    return grid ? begin_look(call, grid, (uint32_t)params_integer(params, "count"), error) : NULL;
}

/* Some clusters. */
static bool write_some(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct look *l = call->work->state;
    (void)error;
    const uint32_t end = l->n < l->wanted ? l->n : l->wanted;
    for (int i = 0; i < CLUSTERS_PER_PART && l->written < end; i++)
        write_cluster(out, l, &l->list[l->written++]);
    if (l->written < end)
        return rpc_continue(call, write_some);
    write_list_rest(out, l);
    return true; /* the work is dropped with the request */
}

static bool write_list(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    const struct look *l = call->work->state;
    if (!request_job_done(call, d->pipeline, look_at_shapes, write_list))
        return false;
    write_list_head(out, l);
    return write_some(call, out, error);
}

bool method_clusters(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    return begin_list(call, params, error) && write_list(call, out, error);
}

/* ---- where to look next ---- */

static void look_conf(const struct methods_env *d, const json_t *params, const struct grid *grid, bool ned,
                      struct next_look_conf *conf)
{
    double band[2];
    struct pose pose = pose_identity;
    params_numbers(params, "elevation_deg", band);
    *conf = (struct next_look_conf){.stale_s = grid_limits(grid).clear_for_s,
                                    .low_rad = geo_rad(band[0]),
                                    .high_rad = geo_rad(band[1]),
                                    .apart_rad = geo_rad(params_number(params, "apart_deg"))};
    /* a velocity is given in NED: nobody knows where that is in a grid of the body's axes */
    pose_log_newest(&d->poses, &pose);
    if (ned && (pose.has & POSE_VELOCITY) && pose_log_fresh(&d->poses, loop_now(d->loop)))
        memcpy(conf->velocity_mps, pose.velocity_mps, sizeof conf->velocity_mps);
}

static struct look *begin_ways(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct grid *grid = grid_asked(call->daemon, params, error);
    struct look *l = grid ? begin_look(call, grid, (uint32_t)params_integer(params, "count"), error) : NULL;
    if (l) {
        picture_get_frame(grid_picture(grid), &l->frame);
        look_conf(l->d, params, grid, l->frame.ned, &l->conf);
    }
    return l;
}

static bool write_ways(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    const struct look *l = call->work->state;
    (void)error;
    if (!request_job_done(call, d->pipeline, look_at_ways, write_ways))
        return false;
    json_out_open(out, '{');
    json_member_word(out, "frame", l->frame.ned ? "ned" : "body");
    json_member_open(out, "directions", '[');
    for (uint32_t i = 0; i < l->ranking.n; i++) {
        const struct next_look *w = &l->ranking.look[i];
        json_out_open(out, '{');
        json_member_degrees(out, "azimuth_deg", w->az_rad);
        json_member_degrees(out, "elevation_deg", w->el_rad);
        json_member_real(out, "score", w->score, 1e3);
        json_member_text(out, "why", next_look_word(w->why));
        json_member_age(out, "age_s", w->age_s);
        json_out_close(out, '}');
    }
    json_out_put(out, "]}");
    return true;
}

bool method_next_look(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    return begin_ways(call, params, error) && write_ways(call, out, error);
}
