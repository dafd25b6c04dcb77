/* SPDX-License-Identifier: MIT */
#include "submap_methods.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../grid/voxel/frontier.h"
#include "daemon.h"
#include "methods.h"
#include "say.h"

/* ---- submaps ---- */

/* What is told of one. */
struct submap_state {
    uint64_t id, pings, begin_ns;
    double position_m[3], turn[4];
    bool current, away, moved;
};

struct visit_submaps {
    struct submap_state submap[VOXMAP_MAX_SUBMAPS]; /* oldest first */
    uint32_t n;
};

static void look_at(const struct voxmap *map, const struct voxmap_part *part, struct submap_state *out)
{
    *out = (struct submap_state){.id = part->id,
                                 .pings = part->pings,
                                 .begin_ns = part->begin_ns,
                                 .current = part == map->current,
                                 .away = part->away,
                                 .moved = part->moved};
    for (int a = 0; a < 3; a++)
        out->position_m[a] = ((double)part->moved_to.cell[a] + part->moved_to.offset[a]) * map->set.voxel_m;
    memcpy(out->turn, part->turn, sizeof out->turn);
}

static void look_at_all(void *ctx, struct pipeline_map *m)
{
    struct visit_submaps *v = ctx;
    v->n = 0;
    for (uint32_t i = 0; i < m->map.set.max_submaps; i++) {
        uint32_t at = v->n;
        if (!m->map.part[i].id)
            continue;
        for (; at > 0 && v->submap[at - 1].id > m->map.part[i].id; at--)
            v->submap[at] = v->submap[at - 1];
        look_at(&m->map, &m->map.part[i], &v->submap[at]);
        v->n++;
    }
}

static json_t *submap_json(const struct daemon *d, const struct submap_state *s)
{
    const uint64_t now = loop_now(d->loop);
    const double age_s = s->begin_ns == 0 ? -1 : now > s->begin_ns ? (double)(now - s->begin_ns) * 1e-9 : 0;
    return json_pack("{s:I, s:b, s:b, s:b, s:I, s:o, s:o, s:[o, o, o, o]}", "id", (json_int_t)s->id, "current",
                     s->current, "away", s->away, "moved", s->moved, "pings", (json_int_t)s->pings, "begin_age_s",
                     say_age(age_s), "position_m", say_metres3(s->position_m), "quaternion",
                     say_real(s->turn[0], 1e9), say_real(s->turn[1], 1e9), say_real(s->turn[2], 1e9),
                     say_real(s->turn[3], 1e9));
}

json_t *submap_method_list(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    struct daemon *d = call->daemon;
    struct visit_submaps v;
    if (!rpc_only(params, keys, error) || !places_there(d, error))
        return NULL;
    pipeline_visit_map(d->pipeline, look_at_all, &v);
    json_t *list = json_array();
    for (uint32_t i = 0; i < v.n; i++)
        json_array_append_new(list, submap_json(d, &v.submap[i]));
    return json_pack("{s:o}", "submaps", list);
}

struct visit_move {
    uint64_t id;
    struct pose pose;
    bool there, moved;
    struct submap_state state;
};

static void move(void *ctx, struct pipeline_map *m)
{
    struct visit_move *v = ctx;
    v->there = voxmap_part(&m->map, v->id) != NULL;
    v->moved = v->there && voxmap_move(&m->map, v->id, v->pose.position_m, v->pose.attitude);
    if (v->moved)
        look_at(&m->map, voxmap_part(&m->map, v->id), &v->state);
}

json_t *submap_method_move(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"id", "position_m", "attitude_deg", "quaternion", NULL};
    struct daemon *d = call->daemon;
    struct visit_move v = {.pose = pose_identity};
    int64_t id = 0;
    bool placed;
    if (!rpc_only(params, keys, error) || !rpc_integer(params, "id", true, 1, INT64_MAX, &id, error) ||
        !rpc_numbers(params, "position_m", -PLACES_MAX_M, PLACES_MAX_M, 3, v.pose.position_m, &placed, error) ||
        !pose_attitude(params, &v.pose, error) || !places_there(d, error))
        return NULL;
    if (!placed) {
        rpc_refuse(error, RPC_INVALID_PARAMS, "parameter 'position_m' is missing");
        return NULL;
    }
    v.id = (uint64_t)id;
    pipeline_visit_map(d->pipeline, move, &v);
    d->places.changed |= v.moved;
    if (v.moved)
        return submap_json(d, &v.state);
    rpc_refuse(error, RPC_INVALID_PARAMS,
               v.there ? "position_m: no place of this map"
                       : "id = %" PRId64 ": there is no such submap; map_submaps has them",
               id);
    return NULL;
}

/* ---- the surface ---- */

#define FRONTIER_BLOCKS  1024
#define PAGE_POINTS      256
#define PAGE_POINTS_MAX  1024
#define PAGE_BLOCKS      256 /* looked at for one page */
#define BLOCKS_PER_VISIT 4   /* so long pings wait, and for ... */
#define SKIPPED_AT_MOST  256 /* empty ones before each */

/* How far a walk over the blocks has come, and of which map: what all but pings have done to it is in the last two. */
struct cursor {
    struct merge_walk walk;
    uint64_t change_of_all, next_id;
};

struct visit_surface {
    struct frontier *frontier;
    struct cursor cursor;
    bool begun, changed, ended;
    uint32_t blocks;
    json_t *points;
};

static void take_point(void *context, const struct frontier_point *p)
{
    const double normal[3] = {(double)p->normal[0], (double)p->normal[1], (double)p->normal[2]};
    json_array_append_new(context,
                          json_pack("{s:o, s:o, s:s}", "position_m", say_metres3(p->position_m), "normal",
                                    say_metres3(normal), "tag", p->tag == FRONTIER_ECHO ? "echo" : "limit"));
}

static void find_mask(void *ctx, struct pipeline_map *m)
{
    struct voxmask **mask = ctx;
    *mask = &m->mask;
}

/* The next few blocks. */
static void walk_on(void *ctx, struct pipeline_map *m)
{
    struct visit_surface *v = ctx;
    struct block_key key;
    if (!v->begun) {
        v->cursor.change_of_all = m->map.change_of_all;
        v->cursor.next_id = m->map.next_id;
        v->begun = true;
    }
    for (int i = 0; i < BLOCKS_PER_VISIT && !v->ended; i++) {
        const enum merge_sought sought = merge_seek(&m->map, &v->cursor.walk, SKIPPED_AT_MOST, &key);
        v->ended = sought == MERGE_ALL;
        v->blocks++;
        if (sought == MERGE_FOUND)
            frontier_points(v->frontier, &key, take_point, v->points);
    }
    v->changed = v->cursor.change_of_all != m->map.change_of_all || v->cursor.next_id != m->map.next_id;
}

/* The frontier is kept, so that pages of a map that has not changed cost little; made when somebody first asks. */
static struct frontier *frontier_of(struct daemon *d, struct rpc_error *error)
{
    struct places *p = &d->places;
    struct voxmask *mask = NULL;
    if (p->frontier_memory)
        return &p->frontier;
    p->frontier_memory = malloc(frontier_bytes(FRONTIER_BLOCKS));
    if (!p->frontier_memory) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for the surface");
        return NULL;
    }
    pipeline_visit_map(d->pipeline, find_mask, &mask);
    frontier_init(&p->frontier, mask, p->frontier_memory, FRONTIER_BLOCKS);
    return &p->frontier;
}

static bool cursor_of(json_t *params, struct visit_surface *v, struct rpc_error *error)
{
    const json_t *given = json_object_get(params, "cursor");
    const char *text = json_string_value(given);
    struct cursor *c = &v->cursor;
    int end = -1;
    if (!given || json_is_null(given))
        return true;
    if (text && strlen(text) < 80 && strspn(text, "0123456789.") == strlen(text))
        sscanf(text, "%10" SCNu32 ".%18" SCNd64 ".%19" SCNu64 ".%19" SCNu64 "%n", &c->walk.part, &c->walk.at,
               &c->change_of_all, &c->next_id, &end);
    v->begun = end >= 0 && text[end] == '\0';
    return v->begun || rpc_refuse(error, RPC_INVALID_PARAMS, "cursor: wanted the one of the page before");
}

json_t *submap_method_surface(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"cursor", "count", NULL};
    struct daemon *d = call->daemon;
    struct visit_surface v = {.blocks = 0};
    int64_t count = PAGE_POINTS;
    char next[96];
    if (!rpc_only(params, keys, error) ||
        !rpc_integer(params, "count", false, 1, PAGE_POINTS_MAX, &count, error) || !cursor_of(params, &v, error) ||
        !places_there(d, error) || !(v.frontier = frontier_of(d, error)))
        return NULL;
    v.points = json_array();
    while (!v.ended && v.blocks < PAGE_BLOCKS && json_array_size(v.points) < (size_t)count)
        pipeline_visit_map(d->pipeline, walk_on, &v);
    snprintf(next, sizeof next, "%" PRIu32 ".%" PRId64 ".%" PRIu64 ".%" PRIu64, v.cursor.walk.part,
             v.cursor.walk.at, v.cursor.change_of_all, v.cursor.next_id);
    return json_pack("{s:o, s:o, s:o, s:b}", "voxel_m", json_real(d->conf.map.voxel_m), "points", v.points,
                     "cursor", v.ended ? json_null() : json_string(next), "changed", v.changed);
}
