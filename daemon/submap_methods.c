/* SPDX-License-Identifier: MIT */
#include "submap_methods.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../grid/voxel/frontier.h"
#include "errand.h"
#include "methods.h"
#include "say.h"

/* ---- submaps ---- */

/* What is told of one. */
struct submap_state {
    uint64_t id, pings, begin_ns;
    double position_m[3], turn[4];
    bool current, away, moved;
};

struct submaps {
    struct errand errand;
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
    struct submaps *v = call->work->state;
    if (!rpc_only(params, keys, error) || !places_there(d, error))
        return NULL;
    if (!v && !(v = calloc(1, sizeof *v))) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
        return NULL;
    }
    *call->work = (struct rpc_work){.state = v, .drop = errand_free};
    if (!errand_done(call, look_at_all, error))
        return NULL;
    json_t *list = json_array();
    for (uint32_t i = 0; i < v->n; i++)
        json_array_append_new(list, submap_json(d, &v->submap[i]));
    return json_pack("{s:o}", "submaps", list);
}

/* A submap that is put elsewhere, of one request. */
struct move {
    struct errand errand;
    struct daemon *d;
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
    v->d->places.changed |= v->moved;
    free(v);
}

static void leave_move(void *ctx)
{
    pipeline_errand_leave(ctx, free_move);
}

static struct move *begin_move(struct daemon *d, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"id", "position_m", "attitude_deg", "quaternion", NULL};
    struct move v = {.d = d, .pose = pose_identity};
    int64_t id = 0;
    bool placed;
    if (!rpc_only(params, keys, error) || !rpc_integer(params, "id", true, 1, INT64_MAX, &id, error) ||
        !rpc_numbers(params, "position_m", -PLACES_MAX_M, PLACES_MAX_M, 3, v.pose.position_m, &placed, error) ||
        !pose_attitude(params, &v.pose, error) || !places_there(d, error))
        return NULL;
    struct move *kept = placed ? malloc(sizeof *kept) : NULL;
    v.id = (uint64_t)id;
    if (kept)
        *kept = v;
    else if (placed)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
    else
        rpc_refuse(error, RPC_INVALID_PARAMS, "parameter 'position_m' is missing");
    return kept;
}

json_t *submap_method_move(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    struct move *v = call->work->state;
    if (!v && (!errand_room(call, error) || !(v = begin_move(d, params, error))))
        return NULL;
    *call->work = (struct rpc_work){.state = v, .drop = leave_move};
    if (!errand_done(call, move, error))
        return NULL;
    if (v->moved)
        return submap_json(d, &v->state);
    rpc_refuse(error, RPC_INVALID_PARAMS,
               v->there ? "position_m: no place of this map"
                        : "id = %" PRIu64 ": there is no such submap; `sonarctl call map_submaps` has them",
               v->id);
    return NULL;
}

/* ---- the surface ---- */

#define FRONTIER_BLOCKS 1024
#define PAGE_POINTS     256
#define PAGE_POINTS_MAX 1024
#define PAGE_BLOCKS     256 /* looked at for one page, */
#define SKIPPED_AT_MOST 256 /* and empty ones before each of them: so long pings wait, and other clients */

/* How far a walk over the blocks has come, and of which map: what all but pings have done to it is in the last two. */
struct cursor {
    struct merge_walk walk;
    uint64_t change_of_all, next_id;
};

/* A page on its way, of one request. */
struct page {
    struct errand errand;
    struct frontier *frontier; /* not made yet: from this memory */
    void *memory;
    struct cursor cursor;
    bool begun, changed, ended;
    uint32_t blocks;
    int64_t points, count; /* written, and wanted */
    struct text text;      /* of the points of the last part: the reply's own may be gone when the owner writes */
};

static void write_point(void *context, const struct frontier_point *p)
{
    const double normal[3] = {(double)p->normal[0], (double)p->normal[1], (double)p->normal[2]};
    struct page *page = context;
    text_open(&page->text, '{');
    write_metres3(&page->text, "position_m", p->position_m);
    write_metres3(&page->text, "normal", normal);
    write_word(&page->text, "tag", p->tag == FRONTIER_ECHO ? "echo" : "limit");
    text_close(&page->text, '}');
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
    if (!page->begun) {
        page->cursor.change_of_all = m->map.change_of_all;
        page->cursor.next_id = m->map.next_id;
        page->begun = true;
    }
    const enum merge_sought sought = merge_seek(&m->map, &page->cursor.walk, SKIPPED_AT_MOST, &key);
    page->ended = sought == MERGE_ALL;
    page->blocks++;
    if (sought == MERGE_FOUND)
        frontier_points(page->frontier, &key, write_point, page);
    page->changed = page->cursor.change_of_all != m->map.change_of_all || page->cursor.next_id != m->map.next_id;
}

/* The frontier is kept, so that pages of a map that has not changed cost little; its memory is there when somebody first
 * asks, and the map's owner makes it. */
static struct frontier *frontier_of(struct daemon *d, struct rpc_error *error)
{
    struct places *p = &d->places;
    if (!p->frontier_memory)
        p->frontier_memory = malloc(frontier_bytes(FRONTIER_BLOCKS));
    if (!p->frontier_memory)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for the surface");
    return p->frontier_memory ? &p->frontier : NULL;
}

static bool cursor_of(json_t *params, struct page *page, struct rpc_error *error)
{
    const json_t *given = json_object_get(params, "cursor");
    const char *text = json_string_value(given);
    struct cursor *c = &page->cursor;
    int end = -1;
    if (!given || json_is_null(given))
        return true;
    if (text && strlen(text) < 80 && strspn(text, "0123456789.") == strlen(text))
        sscanf(text, "%10" SCNu32 ".%18" SCNd64 ".%19" SCNu64 ".%19" SCNu64 "%n", &c->walk.part, &c->walk.at,
               &c->change_of_all, &c->next_id, &end);
    page->begun = end >= 0 && text[end] == '\0';
    return page->begun || rpc_refuse(error, RPC_INVALID_PARAMS, "cursor: wanted the one of the page before");
}

static struct page *begin_page(struct daemon *d, json_t *params, struct text *out, struct rpc_error *error)
{
    static const char *const keys[] = {"cursor", "count", NULL};
    struct page page = {.count = PAGE_POINTS};
    if (!rpc_only(params, keys, error) ||
        !rpc_integer(params, "count", false, 1, PAGE_POINTS_MAX, &page.count, error) ||
        !cursor_of(params, &page, error) || !places_there(d, error) || !(page.frontier = frontier_of(d, error)))
        return NULL;
    struct page *kept = malloc(sizeof *kept);
    if (!kept) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for a page of the surface");
        return NULL;
    }
    *kept = page;
    kept->memory = d->places.frontier_memory;
    text_open(out, '{');
    write_real(out, "voxel_m", d->conf.map.voxel_m, 1e6);
    text_name(out, "points");
    text_open(out, '[');
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
    pipeline_errand_drop(state, free_page);
}

/* In parts, a block in each. */
bool submap_method_surface(const struct rpc_call *call, json_t *params, struct text *out, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    struct page *page = call->work->state;
    char next[96];
    if (!page && !(page = begin_page(d, params, out, error)))
        return false;
    *call->work = (struct rpc_work){.state = page, .drop = drop_page};
    if (!errand_done(call, walk_on, error))
        return false;
    text_part(out, &page->text);
    text_cut(&page->text, 0);
    if (!page->ended && page->blocks < PAGE_BLOCKS && page->points < page->count) {
        error->code = RPC_UNFINISHED;
        return false;
    }
    snprintf(next, sizeof next, "%" PRIu32 ".%" PRId64 ".%" PRIu64 ".%" PRIu64, page->cursor.walk.part,
             page->cursor.walk.at, page->cursor.change_of_all, page->cursor.next_id);
    text_close(out, ']');
    text_name(out, "cursor");
    if (page->ended)
        text_null(out);
    else
        text_word(out, next);
    text_name(out, "changed");
    text_flag(out, page->changed);
    text_close(out, '}');
    return true; /* the work is dropped with the request */
}
