/* SPDX-License-Identifier: MIT */
#include "verdict_ask.h"

#include <math.h>
#include <string.h>

bool verdict_ned(const struct verdict *v)
{
    const struct obstacles_query *q = &v->query;
    return q->moves ? q->move.ned : q->around ? q->band.ned : q->line.ned;
}

double verdict_near_m(const struct verdict *v)
{
    const struct obstacles_query *q = &v->query;
    return q->moves ? q->move.near_m : q->around ? q->band.near_m : q->line.near_m;
}

double verdict_distance_m(const struct verdict *v)
{
    const struct obstacles_query *q = &v->query;
    return q->moves ? q->move.most_m : q->around ? q->band.reach_m : q->line.distance_m;
}

/* Wide cones are asked by tiles that are less small: that takes long. More of it is never less careful. Sectors are
 * asked for all around. */
static int levels_of(const struct obstacles_query *q)
{
    const double wide = q->around || q->moves || q->line.corridor ? 0 : q->line.half_angle_rad;
    return wide > geo_rad(30) ? 3 : q->around || wide > geo_rad(15) ? 4 : TILES_LEVELS;
}

/* Turned into the axes of the records: NED, or the body's without an attitude. */
static void turn_axis(const struct verdict *v, bool ned, double axis[3])
{
    if (v->frame.ned && !ned)
        quat_rotate(v->by.now->pose.attitude, axis, axis);
}

void verdict_axis(const struct verdict *v, double axis[3])
{
    geo_direction(v->query.line.az_rad, v->query.line.el_rad, axis);
    turn_axis(v, v->query.line.ned, axis);
}

/* Of one sector. */
static double width_of(const struct answer_band *q)
{
    return (q->width_rad > 0 ? q->width_rad : GEO_TURN) / (double)q->count;
}

double verdict_middle_rad(const struct answer_band *q, size_t part)
{
    return q->width_rad > 0 ? q->from_rad + ((double)part + 0.5) * width_of(q) : (double)part * width_of(q);
}

void verdict_band(const struct verdict *v, size_t part, struct ask_band *band)
{
    const struct answer_band *q = &v->query.band;
    *band = (struct ask_band){.attitude = {1, 0, 0, 0},
                              .lo_rad = q->lo_rad,
                              .hi_rad = q->hi_rad,
                              .from_rad = q->from_rad,
                              .width_rad = q->width_rad,
                              .parts = q->count};
    if (v->frame.ned && !q->ned)
        memcpy(band->attitude, v->by.now->pose.attitude, sizeof band->attitude);
    if (v->all || q->count == 1)
        return;
    band->parts = 1;
    band->width_rad = width_of(q);
    band->from_rad = geo_wrap(verdict_middle_rad(q, part) - band->width_rad / 2);
}

struct ask_question verdict_way(const struct verdict *v)
{
    const struct corridor_query *move = &v->query.move;
    const double size = geo_length(move->direction), near_m = verdict_near_m(v);
    struct ask_question q = {.kind = ASK_MOVE,
                             .near_m = near_m,
                             .level_m = v->horizon.n ? v->horizon.level_m : NULL,
                             .to_m = fmin(fmax(verdict_distance_m(v), near_m + WATER_GRID_M), VERDICT_FARTHEST_M),
                             .loose_rad = move->ned ? 0 : v->place.turned_rad,
                             .body = {.up = {0, 0, -1},
                                      .radius_m = move->body.radius_m,
                                      .half_height_m = move->body.half_height_m,
                                      .margin_m = move->body.margin_m}};
    for (int i = 0; i < 3; i++)
        q.axis[i] = move->direction[i] / size;
    memcpy(q.body.drift_m, move->drift_m, sizeof q.body.drift_m);
    turn_axis(v, move->ned, q.axis);
    turn_axis(v, move->ned, q.body.drift_m);
    turn_axis(v, false, q.body.up);
    return q;
}

/* So far is asked from there on. Within `near` always as far as that, so that what is found there does not depend on
 * the distance. */
static double asked_to_m(const struct verdict *v, enum verdict_stage stage, double from_m)
{
    const double least_m = stage == VERDICT_WITHIN   ? verdict_near_m(v)
                           : stage == VERDICT_BEYOND ? v->frame.range_max_m
                                                     : 0;
    return fmin(fmax(fmax(verdict_distance_m(v), least_m), from_m + WATER_GRID_M), VERDICT_FARTHEST_M);
}

/* Of the water beyond the distance sectors are told nothing. */
double verdict_most_asked_m(const struct verdict *v)
{
    return asked_to_m(v, v->query.around ? VERDICT_NEAR : VERDICT_BEYOND, verdict_near_m(v));
}

/* Of all parts, or of one of them. */
struct ask_question verdict_question(const struct verdict *v, size_t part, double from_m)
{
    const struct answer_query *line = &v->query.line;
    struct ask_question q = {.kind = v->query.around  ? ASK_AROUND
                                     : line->corridor ? ASK_CORRIDOR
                                                      : ASK_CONE,
                             .near_m = from_m,
                             .to_m = asked_to_m(v, v->part[part].stage, from_m),
                             .levels = levels_of(&v->query),
                             .loose_rad = verdict_ned(v) ? 0 : v->place.turned_rad,
                             .half_rad = line->half_angle_rad,
                             .radius_m = line->radius_m};
    if (v->query.around)
        verdict_band(v, part, &q.band);
    else
        verdict_axis(v, q.axis);
    return q;
}

struct store_now verdict_now(const struct verdict *v)
{
    return (struct store_now){.now_ns = v->by.now->now_ns,
                              .pose = &v->by.now->pose,
                              .clear_for_s = v->by.conf->clear_for_s,
                              .move_limit_m = v->by.conf->move_limit_m,
                              .keeps_m = v->frame.reach_m,
                              .lost = v->by.now->lost};
}

void verdict_ask(struct verdict *v, size_t part, double from_m)
{
    const struct ask_question q = v->query.moves ? verdict_way(v) : verdict_question(v, part, from_m);
    for (size_t k = v->all ? 0 : part; k < (v->all ? v->parts : part + 1); k++)
        v->part[k].start_m = from_m;
    ask_begin(&v->ask, v->view, v->n, &q);
    v->asking = true;
}
