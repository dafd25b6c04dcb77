/* SPDX-License-Identifier: MIT */
/* The method that gives every cell of a spherical grid, page by page; sonard-protocol(7) has its shape. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/request_job.h"
#include "grid_methods.h"
#include "json_units.h"
#include "methods.h"
#include "query_context.h"
#include "grid/sphere/view.h"

/* Looked at in one part: so long pings wait, and other clients. */
#define DIRECTIONS_PER_PART 2048
#define CELLS_PER_PART      256
#define PARTS_PER_PAGE      64

struct found {
    struct sphere_cell cell;
    double az_rad, el_rad; /* middle of its direction, in the grid's frame */
};

/* The next cell is the first in this layer or farther, of this direction or a later one. */
struct cursor {
    uint32_t direction, layer;
    uint64_t moves, ned; /* of the grid's centre and axes, and which axes, when the first page was made */
};

/* A page on its way, of one request. */
struct page {
    struct owner_job call;
    struct grid *grid;
    uint64_t now_ns;
    struct cursor cursor;
    bool started, changed, ended, ned;
    double centre_m[3];
    uint32_t parts, wanted; /* cells that there is still room for */
    uint32_t n;
    struct found found[CELLS_PER_PART]; /* of the last part */
};

/* The cells of the cursor's direction that there is room for; false: it has more. */
static bool take_direction(struct page *page, uint32_t room)
{
    const struct sphere *sphere = page->grid->sphere;
    const uint32_t direction = page->cursor.direction;
    struct found f = {.az_rad = 0};
    rings_centre(grid_picture(page->grid)->rings, direction, &f.az_rad, &f.el_rad);
    f.az_rad = geo_wrap(f.az_rad + sphere_axes(sphere));
    for (uint32_t k = 0; sphere_cell(sphere, direction, k, page->now_ns, &f.cell); k++) {
        if (f.cell.layer < page->cursor.layer)
            continue;
        if (page->n == room)
            return false;
        page->found[page->n++] = f;
        page->cursor.layer = (uint32_t)f.cell.layer + 1;
    }
    return true;
}

/* The part of the grid's owner. */
static void copy_page(void *ctx, const struct pipeline_owned *owned)
{
    struct page *page = ctx;
    struct picture_frame frame;
    struct sphere_stats stats;
    (void)owned;
    picture_get_frame(grid_picture(page->grid), &frame);
    page->ned = frame.ned;
    sphere_stats(page->grid->sphere, &stats);
    sphere_centre(page->grid->sphere, page->centre_m);
    const uint64_t moves = stats.recentred + stats.turned;
    if (!page->started) {
        page->cursor.moves = moves;
        page->cursor.ned = page->ned;
    }
    page->started = true;
    page->changed = page->changed || page->cursor.moves != moves || page->cursor.ned != page->ned;
    const uint32_t room = page->wanted < CELLS_PER_PART ? page->wanted : CELLS_PER_PART;
    page->n = 0;
    for (int i = 0; i < DIRECTIONS_PER_PART && page->cursor.direction < stats.directions; i++) {
        if (!take_direction(page, room))
            break;
        page->cursor.direction++;
        page->cursor.layer = 0;
    }
    page->ended = page->cursor.direction >= stats.directions;
    page->wanted -= page->n;
    page->parts++;
}

static bool cursor_of(const json_t *params, struct page *page, struct rpc_error *error)
{
    const char *text = params_text(params, "cursor");
    struct cursor *c = &page->cursor;
    int end = -1;
    if (!text)
        return true;
    if (strlen(text) < 48 && strspn(text, "0123456789.") == strlen(text))
        sscanf(text, "%9" SCNu32 ".%9" SCNu32 ".%19" SCNu64 ".%1" SCNu64 "%n", &c->direction, &c->layer, &c->moves,
               &c->ned, &end);
    page->started = end >= 0 && text[end] == '\0';
    return page->started || rpc_refuse(error, RPC_INVALID_PARAMS, "cursor: expected that of the previous page");
}

static struct page *begin_page(struct methods_env *d, json_t *params, struct rpc_error *error)
{
    struct page *page = calloc(1, sizeof *page);
    if (!page) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for a page of cells");
        return NULL;
    }
    page->grid = grid_asked(d, params, error);
    if (!page->grid || !cursor_of(params, page, error)) {
        free(page);
        return NULL;
    }
    page->now_ns = loop_now(d->loop);
    page->wanted = (uint32_t)params_integer(params, "count");
    return page;
}

static void write_age(struct json_out *out, const char *name, const struct page *page, uint64_t t_ns)
{
    json_member_age(out, name, page->now_ns > t_ns ? (double)(page->now_ns - t_ns) * 1e-9 : 0);
}

static void write_cell(struct json_out *out, const struct methods_env *d, const struct page *page,
                       const struct found *f)
{
    const struct sphere_cell *c = &f->cell;
    double place_m[3];
    for (int a = 0; a < 3; a++)
        place_m[a] = page->centre_m[a] + c->point_m[a];
    json_out_open(out, '{');
    json_member_degrees(out, "azimuth_deg", f->az_rad);
    json_member_degrees(out, "elevation_deg", f->el_rad);
    json_member_metres(out, "from_m", c->from_m);
    json_member_metres(out, "to_m", c->to_m);
    json_member_metres(out, "near_m", c->near_m);
    json_member_metres3(out, "position_m", place_m);
    json_member_metres(out, "position_sd_m", c->ball_m);
    json_member_real(out, "confidence", 1 / (1 + exp(-c->logodds)), 1e3);
    json_member_flag(out, "blocks", !c->pending && c->logodds > (double)grid_picture(page->grid)->blocked_logodds);
    json_member_count(out, "echoes", c->echoes);
    write_age(out, "first_echo_age_s", page, c->t_first_ns);
    write_age(out, "last_echo_age_s", page, c->t_echo_ns);
    json_member_count(out, "misses", c->misses);
    json_member_word(out, "turn", grid_turn_word(c->flags));
    json_member_flag(out, "locked", (c->flags & SPHERE_LOCKED) != 0);
    json_member_text(out, "sensor", grid_sensor_name(d, c->sensor));
    json_out_close(out, '}');
}

static void write_end(struct json_out *out, const struct page *page)
{
    char next[48];
    snprintf(next, sizeof next, "%" PRIu32 ".%" PRIu32 ".%" PRIu64 ".%" PRIu64, page->cursor.direction,
             page->cursor.layer, page->cursor.moves, page->cursor.ned);
    json_out_close(out, ']');
    if (page->ended)
        json_member_null(out, "cursor");
    else
        json_member_word(out, "cursor", next);
    json_member_word(out, "frame", page->ned ? "ned" : "body");
    json_member_flag(out, "changed", page->changed);
    json_out_close(out, '}');
}

/* Some cells. */
static bool write_part(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    struct page *page = call->work->state;
    (void)error;
    if (!request_job_done(call, d->pipeline, copy_page, write_part))
        return false;
    for (uint32_t i = 0; i < page->n; i++)
        write_cell(out, d, page, &page->found[i]);
    if (!page->ended && page->wanted > 0 && page->parts < PARTS_PER_PAGE)
        return rpc_continue(call, write_part);
    write_end(out, page);
    return true; /* the work is dropped with the request */
}

bool method_grid_cells(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct page *page = begin_page(d, params, error);
    if (!page)
        return false;
    json_out_open(out, '{');
    json_member_real(out, "t_unix", query_unix_s(d), 1e6);
    json_member_open(out, "cells", '[');
    rpc_work_keep(call->work, page, request_job_free);
    return write_part(call, out, error);
}
