/* SPDX-License-Identifier: MIT */

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "grid/voxel/frontier.h"
#include "daemon/request_job.h"
#include "daemon/methods/environment.h"
#include "methods.h"
#include "json_units.h"

/* ---- submaps ---- */

/* What is reported of one. */
struct submap_state {
    uint64_t id, pings, begin_ns;
    double position_m[3], turn[4];
    bool current, moved;
};

struct submaps {
    struct owner_job call;
    struct submap_state submap[VOXMAP_MAX_SUBMAPS]; /* oldest first */
    uint32_t n;
};

static void look_at(const struct voxmap *map, const struct voxmap_part *part, struct submap_state *out)
{
    *out = (struct submap_state){.id = part->id,
                                 .pings = part->pings,
                                 .begin_ns = part->begin_ns,
                                 .current = part == map->current,
                                 .moved = part->moved};
    for (int a = 0; a < 3; a++)
        out->position_m[a] = ((double)part->moved_to.cell[a] + part->moved_to.offset[a]) * map->set.voxel_m;
    memcpy(out->turn, part->turn, sizeof out->turn);
}

static void look_at_all(void *ctx, const struct pipeline_owned *owned)
{
    struct pipeline_map *m = owned->map;
    struct submaps *v = ctx;
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

static void write_submap(struct json_out *out, const struct methods_env *d, const struct submap_state *s)
{
    const uint64_t now = loop_now(d->loop);
    const double age_s = s->begin_ns == 0 ? -1 : now > s->begin_ns ? (double)(now - s->begin_ns) * 1e-9 : 0;
    json_out_open(out, '{');
    json_member_count(out, "id", s->id);
    json_member_flag(out, "current", s->current);
    json_member_flag(out, "moved", s->moved);
    json_member_count(out, "pings", s->pings);
    json_member_age(out, "begin_age_s", age_s);
    json_member_metres3(out, "position_m", s->position_m);
    json_member_open(out, "quaternion", '[');
    for (int i = 0; i < 4; i++)
        json_out_rounded(out, s->turn[i], 1e9);
    json_out_put(out, "]}");
}

static bool write_all(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    const struct submaps *v = call->work->state;
    (void)error;
    if (!request_job_done(call, d->pipeline, look_at_all, write_all))
        return false;
    json_out_put(out, "{\"submaps\":[");
    for (uint32_t i = 0; i < v->n; i++)
        write_submap(out, d, &v->submap[i]);
    json_out_put(out, "]}");
    return true;
}

bool method_map_submaps(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params;
    if (!map_asked(call->daemon, error))
        return false;
    struct submaps *v = calloc(1, sizeof *v);
    if (!v)
        return rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
    rpc_work_keep(call->work, v, request_job_free);
    return write_all(call, out, error);
}

/* A submap that is put elsewhere, of one request. */
struct move {
    struct owner_job call;
    struct methods_env *d;
    uint64_t id;
    struct pose pose;
    bool there, moved;
    struct submap_state state;
};

static void move(void *ctx, const struct pipeline_owned *owned)
{
    struct pipeline_map *m = owned->map;
    struct move *v = ctx;
    v->there = voxmap_part(&m->map, v->id) != NULL;
    v->moved = v->there && voxmap_move(&m->map, v->id, v->pose.position_m, v->pose.attitude);
    if (v->moved)
        look_at(&m->map, voxmap_part(&m->map, v->id), &v->state);
}

static void free_move(void *ctx)
{
    struct move *v = ctx;
    v->d->map_service.changed |= v->moved;
    free(v);
}

static void leave_move(void *ctx)
{
    owner_job_leave(ctx, free_move);
}

static struct move *begin_move(struct methods_env *d, json_t *params, struct rpc_error *error)
{
    struct move v = {.d = d, .id = (uint64_t)params_integer(params, "id"), .pose = pose_identity};
    params_numbers(params, "position_m", v.pose.position_m);
    if (!pose_attitude(params, &v.pose, error) || !map_asked(d, error))
        return NULL;
    struct move *kept = malloc(sizeof *kept);
    if (kept)
        *kept = v;
    else
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
    return kept;
}

static bool write_moved(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    const struct move *v = call->work->state;
    if (!request_job_done(call, d->pipeline, move, write_moved))
        return false;
    if (v->moved) {
        write_submap(out, d, &v->state);
        return true;
    }
    rpc_refuse(error, RPC_INVALID_PARAMS,
               v->there ? "position_m: no place of this map"
                        : "id = %" PRIu64 ": no such submap; see `sonarctl call map_submaps`",
               v->id);
    return false;
}

bool method_map_move(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct move *v = request_job_room(d->pipeline, error) ? begin_move(d, params, error) : NULL;
    if (!v)
        return false;
    rpc_work_keep(call->work, v, leave_move);
    return write_moved(call, out, error);
}

/* ---- the surface ---- */

#define FRONTIER_BLOCKS 1024
#define PAGE_BLOCKS     256 /* looked at for one page, */
#define SKIPPED_AT_MOST 256 /* and empty ones before each of them: so long pings wait, and other clients */

/* How far a walk over the blocks has come, and of which map: what all but pings have done to it is in the last two. */
struct cursor {
    struct merge_walk walk;
    uint64_t change_of_all, next_id;
};

/* A page on its way, of one request. */
struct page {
    struct owner_job call;
    struct frontier *frontier; /* not made yet: from this memory */
    void *memory;
    struct cursor cursor;
    bool started, changed, ended;
    uint32_t blocks;
    int64_t points, count; /* written, and wanted */
    struct json_out text;  /* of the points of the last part: the reply's own may be gone when the owner writes */
};

static void write_point(void *context, const struct frontier_point *p)
{
    const double normal[3] = {(double)p->normal[0], (double)p->normal[1], (double)p->normal[2]};
    struct page *page = context;
    json_out_open(&page->text, '{');
    json_member_metres3(&page->text, "position_m", p->position_m);
    json_member_metres3(&page->text, "normal", normal);
    json_member_word(&page->text, "tag", p->tag == FRONTIER_ECHO ? "echo" : "limit");
    json_out_close(&page->text, '}');
    page->points++;
}

/* The next block. */
static void walk_on(void *ctx, const struct pipeline_owned *owned)
{
    struct pipeline_map *m = owned->map;
    struct page *page = ctx;
    struct block_key key;
    if (!page->frontier->block)
        frontier_init(page->frontier, &m->mask, page->memory, FRONTIER_BLOCKS);
    if (!page->started) {
        page->cursor.change_of_all = m->map.change_of_all;
        page->cursor.next_id = m->map.next_id;
        page->started = true;
    }
    const enum merge_sought sought = merge_seek(&m->map, &page->cursor.walk, SKIPPED_AT_MOST, &key);
    page->ended = sought == MERGE_ALL;
    page->blocks++;
    if (sought == MERGE_FOUND)
        frontier_points(page->frontier, &key, write_point, page);
    page->changed = page->cursor.change_of_all != m->map.change_of_all || page->cursor.next_id != m->map.next_id;
}

/* The frontier is kept, so that pages of a map that has not changed cost little; its memory is there when somebody
 * first asks, and the map's owner makes it. */
static struct frontier *frontier_of(struct methods_env *d, struct rpc_error *error)
{
    struct map_service *p = &d->map_service;
    if (!p->frontier_memory)
        p->frontier_memory = malloc(frontier_bytes(FRONTIER_BLOCKS));
    if (!p->frontier_memory)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for the surface");
    return p->frontier_memory ? &p->frontier : NULL;
}

static bool cursor_of(const json_t *params, struct page *page, struct rpc_error *error)
{
    const char *text = params_text(params, "cursor");
    struct cursor *c = &page->cursor;
    int end = -1;
    if (!text)
        return true;
    if (strlen(text) < 80 && strspn(text, "0123456789.") == strlen(text))
        sscanf(text, "%10" SCNu32 ".%18" SCNd64 ".%19" SCNu64 ".%19" SCNu64 "%n", &c->walk.part, &c->walk.at,
               &c->change_of_all, &c->next_id, &end);
    page->started = end >= 0 && text[end] == '\0';
    return page->started || rpc_refuse(error, RPC_INVALID_PARAMS, "cursor: expected that of the previous page");
}

static struct page *begin_page(struct methods_env *d, json_t *params, struct json_out *out,
                               struct rpc_error *error)
{
    struct page page = {.count = params_integer(params, "count")};
    if (!cursor_of(params, &page, error) || !map_asked(d, error) || !(page.frontier = frontier_of(d, error)))
        return NULL;
    struct page *kept = malloc(sizeof *kept);
    if (!kept) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for a page of the surface");
        return NULL;
    }
    *kept = page;
    kept->memory = d->map_service.frontier_memory;
    json_out_open(out, '{');
    json_member_real(out, "voxel_m", d->conf.map.voxel_m, 1e6);
    json_out_name(out, "points");
    json_out_open(out, '[');
    return kept;
}

static void free_page(void *state)
{
    struct page *page = state;
    free(page->text.bytes);
    free(page);
}

static void drop_page(void *state)
{
    owner_job_drop(state, free_page);
}

/* A block. */
static bool write_block(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    struct page *page = call->work->state;
    char next[96];
    (void)error;
    if (!request_job_done(call, d->pipeline, walk_on, write_block))
        return false;
    json_out_part(out, &page->text);
    json_out_cut(&page->text, 0);
    if (!page->ended && page->blocks < PAGE_BLOCKS && page->points < page->count)
        return rpc_continue(call, write_block);
    snprintf(next, sizeof next, "%" PRIu32 ".%" PRId64 ".%" PRIu64 ".%" PRIu64, page->cursor.walk.part,
             page->cursor.walk.at, page->cursor.change_of_all, page->cursor.next_id);
    json_out_close(out, ']');
    json_out_name(out, "cursor");
    if (page->ended)
        json_out_null(out);
    else
        json_out_word(out, next);
    json_out_name(out, "changed");
    json_out_flag(out, page->changed);
    json_out_close(out, '}');
    return true; /* the work is dropped with the request */
}

bool method_surface(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct page *page = begin_page(call->daemon, params, out, error);
    if (!page)
        return false;
    rpc_work_keep(call->work, page, drop_page);
    return write_block(call, out, error);
}
