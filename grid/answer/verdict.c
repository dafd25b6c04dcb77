/* SPDX-License-Identifier: MIT */
#include "verdict.h"

#include <math.h>
#include <string.h>

#define FARTHEST_M 600.0 /* of a question to the records */

/* Wide cones are asked by tiles that are less small: that takes long. More of it is never less careful. */
static int levels_of(const struct answer_query *q)
{
    const double wide = q->corridor ? 0 : q->half_angle_rad;
    return wide > geo_rad(30) ? 3 : wide > geo_rad(15) ? 4 : TILES_LEVELS;
}

static void doubt(struct verdict *v, enum answer_reason why)
{
    v->against = why > v->against ? why : v->against;
}

/* ---- obstacles ---- */

static void meet(struct answer *a, const struct sight *s, const struct answer_now *now, double moved_m)
{
    if (a->state == ANSWER_BLOCKED && s->near_m >= a->near_m)
        return;
    *a = (struct answer){.state = ANSWER_BLOCKED,
                         .range_m = sight_more(s->near_m, s->obstacle->range_m - moved_m),
                         .range_sd_m = s->obstacle->sd_m,
                         .near_m = s->near_m,
                         .confidence = 1 / (1 + exp(-s->logodds)),
                         .age_s = sight_seconds(now->now_ns, s->obstacle->t_echo_ns)};
}

/* What the cells of one direction hold nearer than need_m: an obstacle, or an echo that is too little for one. Farther
 * than `near` the records tell what such an echo ends. */
static void look_at_cells(struct verdict *v, uint32_t direction, double need_m, struct sight_fade *fade)
{
    const struct answer_now *now = v->by.now;
    const double moved_m = v->place.moved_m;
    struct picture_entry e;
    struct sight s;
    if (need_m <= 0 || picture_told_m(v->by.picture, direction) - moved_m > need_m)
        return;
    const struct sight_observer by = {v->by.conf, now, &v->place, v->query.near_m, need_m, fade};
    sight_look(v->by.picture, direction, &by, &e, &s);
    if (s.obstacle && s.near_m <= need_m)
        meet(&v->answer, &s, now, moved_m);
    else if (s.hint_m < sight_less(need_m, v->query.near_m))
        doubt(v, ANSWER_BEYOND);
}

static void look_for_obstacles(struct verdict *v)
{
    struct picture *p = v->by.picture;
    struct sight_fade fade = {.known = false};
    struct rings_visit visit = rings_visit(p->rings, v->scope.axis, v->scope.around_rad);
    while (rings_next(&visit)) {
        const struct scope_share share = scope_share(&v->scope, p->axis[visit.direction], visit.ring);
        look_at_cells(v, visit.direction, share.need_m, &fade);
    }
    if (!sight_keeps(p->rings, v->scope.lo_rad, v->scope.hi_rad))
        doubt(v, ANSWER_OUTSIDE);
}

/* ---- the bottom ---- */

#define BOTTOM_LEVELS 4 /* of tiles: nobody knows it better */

/* How far the question is free of the bottom in a tile, and in its parts where it is not. */
static double above_bottom(const struct question_shape *q, const struct bottom *bottom,
                           const struct tile_index *tile)
{
    const struct water_tile cone = tiles_cone(tile);
    const double most_m = q->asked.to_m, reach = cone.half_rad + q->asked.loose_rad;
    struct ask_stretch s;
    if (!question_run(q, &cone).n || !question_stretch(q, &cone, most_m, &s))
        return most_m;
    const double down = sin(fmin(asin(fmax(-1, fmin(cone.v[2], 1))) + reach, GEO_PI / 2));
    const double free_m = bottom_reach_m(bottom, down);
    if (free_m >= s.to_m)
        return most_m;
    double least_m = fmin(question_measure(q, &cone, free_m), most_m);
    if (tile->level + 1 < BOTTOM_LEVELS) {
        least_m = most_m;
        for (int i = 0; i < 4; i++) {
            const struct tile_index part = tiles_part(tile, i);
            least_m = fmin(least_m, above_bottom(q, bottom, &part));
        }
    }
    return least_m;
}

static double heed_bottom(const struct verdict *v, const struct question_shape *q)
{
    const struct answer_now *now = v->by.now;
    double least_m = q->asked.to_m;
    if (!v->frame.ned || !(now->pose.has & POSE_ALTITUDE))
        return INFINITY;
    const struct bottom bottom =
        bottom_below(now->pose.altitude_m, -v->place.uncertain_m, v->place.uncertain_m, 0);
    for (uint32_t row = 0; row < TILES_ROWS; row++) {
        uint32_t n, column = question_columns(q, row, &n);
        for (; n > 0; n--, column++) {
            const struct tile_index root = {0, (uint16_t)row, (uint16_t)(column % tiles_columns(row))};
            least_m = fmin(least_m, above_bottom(q, &bottom, &root));
        }
    }
    return least_m < q->asked.to_m ? least_m : INFINITY;
}

/* ---- free water ---- */

/* Turned into the axes of the records: NED, or the body's without an attitude. */
static void axis_of(const struct verdict *v, double axis[3])
{
    geo_direction(v->query.az_rad, v->query.el_rad, axis);
    if (v->frame.ned && !v->query.ned)
        quat_rotate(v->by.now->pose.attitude, axis, axis);
}

static struct ask_question question_from(const struct verdict *v, double from_m)
{
    const struct answer_query *q = &v->query;
    struct ask_question question = {.kind = q->corridor ? ASK_CORRIDOR : ASK_CONE,
                                    .near_m = from_m,
                                    .to_m = fmin(fmax(q->distance_m, from_m + WATER_GRID_M), FARTHEST_M),
                                    .levels = levels_of(q),
                                    .loose_rad = q->ned ? 0 : v->place.turned_rad,
                                    .half_rad = q->half_angle_rad,
                                    .radius_m = q->radius_m};
    axis_of(v, question.axis);
    return question;
}

static struct store_now now_of(const struct verdict *v)
{
    return (struct store_now){.now_ns = v->by.now->now_ns,
                              .pose = &v->by.now->pose,
                              .clear_for_s = v->by.conf->clear_for_s,
                              .move_limit_m = v->by.conf->move_limit_m,
                              .lost = v->by.now->lost};
}

static void ask_from(struct verdict *v, double from_m)
{
    const struct ask_question q = question_from(v, from_m);
    v->start_m = from_m;
    v->starts++;
    ask_begin(&v->ask, v->view, v->n, &q);
}

/* ---- why not farther ---- */

#define LOOK_RAD 1e-3
#define LOOK_M   (2 * WATER_GRID_M)

/* Along a line, to its end. The question itself is over. */
static struct ask_answer look_along(struct verdict *v, const struct water_view *view, int n, double from_m)
{
    struct ask_question q = {.kind = ASK_CONE, .near_m = from_m, .to_m = from_m + LOOK_M};
    memcpy(q.axis, v->end_at, sizeof q.axis);
    ask_begin(&v->ask, view, n, &q);
    while (ask_step(&v->ask))
        ;
    return ask_end(&v->ask, 0);
}

/* Why a record counts no more; ANSWER_HEARD: it does. */
static enum answer_reason outdated(const struct verdict *v, const struct water_view *view)
{
    const struct water_record *r = view->record;
    const struct answer_now *now = v->by.now;
    const double way_m = fmax(now->pose.path_m - r->path_m, 0);
    if (now->lost >> r->sensor & 1)
        return ANSWER_SILENT;
    if (sight_seconds(now->now_ns, r->t_ns) > v->by.conf->clear_for_s)
        return ANSWER_STALE;
    return way_m + view->margin_m > v->by.conf->move_limit_m ? ANSWER_MOVED : ANSWER_HEARD;
}

/* The gravest of those by which the water goes on where the records that count have it end. */
static enum answer_reason reason_of_end(struct verdict *v)
{
    struct store_now all = now_of(v);
    all.clear_for_s = all.move_limit_m = INFINITY;
    all.lost = 0;
    const int n = store_look(v->by.store, v->by.list, &all, v->aside);
    if (n == 0)
        return v->by.list->n ? ANSWER_MOVED : ANSWER_NEVER;
    const struct ask_answer on = look_along(v, v->aside, n, v->end_m);
    enum answer_reason why = ANSWER_HEARD;
    for (int i = 0; on.free_to_m > v->end_m && i < n; i++)
        if (v->ask.part[0].used[i / 64] >> (i % 64) & 1) {
            const enum answer_reason one = outdated(v, &v->aside[i]);
            why = one > why ? one : why;
        }
    if (why != ANSWER_HEARD)
        return why;
    if (v->found && v->from_m > v->query.near_m)
        return ANSWER_BLIND;
    return v->found || on.free_to_m > v->end_m ? ANSWER_BEYOND : ANSWER_NEVER;
}

/* Where along the line on which it ends the water begins to be free; INFINITY: nowhere. */
static double begins_m(const struct verdict *v)
{
    const struct water_tile tile = {{v->end_at[0], v->end_at[1], v->end_at[2]}, LOOK_RAD};
    const double most_m = fmin(v->query.distance_m, FARTHEST_M);
    double least_m = INFINITY;
    for (int i = 0; i < v->n; i++) {
        struct water_pieces said;
        double from_m = fmax(v->start_m, v->query.near_m), to_m = most_m;
        if (!(from_m < to_m) || !water_touches(&v->view[i], &tile, &from_m, &to_m))
            continue;
        water_decide(&v->view[i], &tile, from_m, to_m, &said);
        for (int k = 0; k < said.n; k++)
            if (said.piece[k].says == WATER_FREE && said.piece[k].from_m > v->start_m)
                least_m = fmin(least_m, said.piece[k].from_m);
    }
    return ceil(least_m / WATER_GRID_M) * WATER_GRID_M;
}

/* ---- the words ---- */

/* From the measure of a corridor to the range along the line on which it ends. */
static double range_of(const struct verdict *v, const double at[3], double measure_m)
{
    double axis[3];
    if (!v->query.corridor)
        return measure_m;
    axis_of(v, axis);
    const double ahead = geo_dot(axis, at), wall_m = hypot(measure_m, v->query.radius_m);
    return ahead > 0 ? fmin(measure_m / ahead, wall_m) : wall_m;
}

static void keep_water(struct verdict *v, const struct ask_answer *water)
{
    v->found = true;
    v->from_m = v->start_m;
    v->free_m = water->free_to_m;
    v->oldest_ns = water->oldest >= 0 ? v->view[water->oldest].record->t_ns : 0;
}

/* It is free from start_m on as far as asked, and all nearer is the vehicle's, or promised. */
static bool is_known(const struct verdict *v)
{
    return v->found && v->from_m <= v->query.near_m && v->free_m >= v->query.distance_m;
}

static void finish(struct verdict *v, enum answer_reason water)
{
    struct answer *a = &v->answer;
    const double bottom_m = v->bottom_m, asked_m = v->query.distance_m;
    double free_m = v->found ? v->free_m : 0;
    if (a->state == ANSWER_BLOCKED)
        free_m = fmin(free_m, a->near_m);
    if (water == ANSWER_HEARD && bottom_m < asked_m)
        doubt(v, ANSWER_BOTTOM);
    doubt(v, water);
    a->blind_to_m = v->from_m;
    a->free_to_m = fmin(free_m, bottom_m) > v->from_m ? fmin(free_m, bottom_m) : 0;
    if (a->state == ANSWER_BLOCKED)
        return;
    a->age_s = v->oldest_ns ? sight_seconds(v->by.now->now_ns, v->oldest_ns) : -1;
    a->reason = v->against;
    a->state = v->against == ANSWER_HEARD ? ANSWER_CLEAR : ANSWER_UNKNOWN;
    if (a->state == ANSWER_CLEAR)
        a->confidence = fmax(0, 1 - a->age_s / v->by.conf->clear_for_s);
}

static bool cannot(struct verdict *v, enum answer_reason why)
{
    v->answer = (struct answer){.state = ANSWER_UNKNOWN, .reason = why, .age_s = -1};
    return false;
}

/* Nearer than `near` half as far, and again, as long as that is not the vehicle itself; then beyond it, where the water
 * begins. Negative: nowhere else. */
static double next_start(const struct verdict *v)
{
    if (v->found || v->starts == VERDICT_STARTS)
        return -1;
    if (v->start_m <= v->query.near_m && v->start_m > v->own_m)
        return fmax(v->start_m / 2, v->own_m);
    const double from_m = begins_m(v);
    return from_m > v->query.near_m && from_m < v->query.distance_m ? from_m : -1;
}

static bool end_ask(struct verdict *v)
{
    const struct ask_answer water = ask_end(&v->ask, 0);
    if (water.free_to_m > v->start_m)
        keep_water(v, &water);
    if (is_known(v)) {
        finish(v, ANSWER_HEARD);
        return false;
    }
    if (v->starts == 1 || (v->found && v->from_m <= v->query.near_m)) {
        memcpy(v->end_at, water.at, sizeof v->end_at);
        v->end_m = range_of(v, water.at, water.free_to_m);
    }
    const double from_m = next_start(v);
    if (from_m >= 0) {
        ask_from(v, from_m);
        return true;
    }
    finish(v, reason_of_end(v));
    return false;
}

bool verdict_step(struct verdict *v)
{
    return ask_step(&v->ask) || end_ask(v);
}

static bool look_at_picture(struct verdict *v)
{
    const struct answer_query *q = &v->query;
    enum answer_reason why;
    v->against = ANSWER_HEARD;
    v->answer = (struct answer){.state = ANSWER_UNKNOWN, .age_s = -1};
    picture_get_frame(v->by.picture, &v->frame);
    if (!sight_possible(&v->frame, v->by.now, q->ned, &why))
        return cannot(v, why);
    sight_locate(v->by.picture, &v->frame, v->by.conf, v->by.now, &v->place);
    const struct scope_view by = {&v->frame, v->by.now, &v->place};
    if (!scope_begin(&v->scope, v->by.picture->rings, &by, q))
        return cannot(v, ANSWER_OUTSIDE);
    look_for_obstacles(v);
    return true;
}

bool verdict_begin(struct verdict *v, const struct verdict_evidence *by, const struct answer_query *query,
                   double own_m)
{
    struct sight_reading r = {.picture = by->picture};
    bool possible = false;
    v->by = *by;
    v->query = *query;
    v->own_m = own_m;
    v->found = false;
    v->starts = 0;
    v->from_m = v->free_m = v->end_m = 0;
    v->oldest_ns = 0;
    v->bottom_m = INFINITY;
    while (sight_reads(&r))
        possible = look_at_picture(v);
    if (!possible)
        return false;
    const struct store_now now = now_of(v);
    v->n = store_look(by->store, by->list, &now, v->view);
    ask_from(v, query->near_m);
    v->bottom_m = heed_bottom(v, &v->ask.question);
    return true;
}
