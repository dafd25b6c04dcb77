/* SPDX-License-Identifier: MIT */
#include "verdict.h"

#include <math.h>
#include <string.h>

#include "promise.h"

#define FARTHEST_M 600.0 /* of a question to the records */

static bool is_ned(const struct verdict *v)
{
    return v->query.around ? v->query.band.ned : v->query.line.ned;
}

static double near_of(const struct verdict *v)
{
    return v->query.around ? v->query.band.near_m : v->query.line.near_m;
}

static double distance_of(const struct verdict *v)
{
    return v->query.around ? v->query.band.reach_m : v->query.line.distance_m;
}

static void doubt(struct verdict_part *part, enum answer_reason why)
{
    part->against = why > part->against ? why : part->against;
}

/* ---- questions to the records ---- */

/* Wide cones are asked by tiles that are less small: that takes long. More of it is never less careful. Sectors are
 * asked for all around. */
static int levels_of(const struct obstacles_query *q)
{
    const double wide = q->around || q->line.corridor ? 0 : q->line.half_angle_rad;
    return wide > geo_rad(30) ? 3 : q->around || wide > geo_rad(15) ? 4 : TILES_LEVELS;
}

/* Turned into the axes of the records: NED, or the body's without an attitude. */
static void axis_of(const struct verdict *v, double axis[3])
{
    geo_direction(v->query.line.az_rad, v->query.line.el_rad, axis);
    if (v->frame.ned && !v->query.line.ned)
        quat_rotate(v->by.now->pose.attitude, axis, axis);
}

static void set_band(const struct verdict *v, size_t part, struct ask_band *band)
{
    const struct answer_band *q = &v->query.band;
    const double width = GEO_TURN / (double)q->count;
    *band =
        (struct ask_band){.attitude = {1, 0, 0, 0}, .lo_rad = q->lo_rad, .hi_rad = q->hi_rad, .parts = q->count};
    if (v->frame.ned && !q->ned)
        memcpy(band->attitude, v->by.now->pose.attitude, sizeof band->attitude);
    if (v->all || q->count == 1)
        return;
    band->parts = 1;
    band->from_rad = geo_wrap(((double)part - 0.5) * width);
    band->width_rad = width;
}

/* So far is asked from there on. Within `near` always as far as that, so that what is found there does not depend on
 * the distance. */
static double asked_to_m(const struct verdict *v, enum verdict_stage stage, double from_m)
{
    const double least_m = stage == VERDICT_WITHIN   ? near_of(v)
                           : stage == VERDICT_BEYOND ? v->frame.range_max_m
                                                     : 0;
    return fmin(fmax(fmax(distance_of(v), least_m), from_m + WATER_GRID_M), FARTHEST_M);
}

/* Of the water beyond the distance sectors are told nothing. */
static double most_asked_m(const struct verdict *v)
{
    return asked_to_m(v, v->query.around ? VERDICT_NEAR : VERDICT_BEYOND, near_of(v));
}

/* Of all parts, or of one of them. */
static struct ask_question question_from(const struct verdict *v, size_t part, double from_m)
{
    const struct answer_query *line = &v->query.line;
    struct ask_question q = {.kind = v->query.around  ? ASK_AROUND
                                     : line->corridor ? ASK_CORRIDOR
                                                      : ASK_CONE,
                             .near_m = from_m,
                             .to_m = asked_to_m(v, v->part[part].stage, from_m),
                             .levels = levels_of(&v->query),
                             .loose_rad = is_ned(v) ? 0 : v->place.turned_rad,
                             .half_rad = line->half_angle_rad,
                             .radius_m = line->radius_m};
    if (v->query.around)
        set_band(v, part, &q.band);
    else
        axis_of(v, q.axis);
    return q;
}

static struct store_now now_of(const struct verdict *v)
{
    return (struct store_now){.now_ns = v->by.now->now_ns,
                              .pose = &v->by.now->pose,
                              .clear_for_s = v->by.conf->clear_for_s,
                              .move_limit_m = v->by.conf->move_limit_m,
                              .keeps_m = v->frame.reach_m,
                              .lost = v->by.now->lost};
}

static void ask_from(struct verdict *v, size_t part, double from_m)
{
    const struct ask_question q = question_from(v, part, from_m);
    for (size_t k = v->all ? 0 : part; k < (v->all ? v->parts : part + 1); k++)
        v->part[k].start_m = from_m;
    ask_begin(&v->ask, v->view, v->n, &q);
    v->asking = true;
}

/* ---- the bottom ---- */

#define BOTTOM_LEVELS TILES_LEVELS

/* So far may a part of the run be free of the bottom, as far as is known. */
static double most_bottom_m(const struct verdict *v, const struct question_run *run)
{
    double most_m = 0;
    for (size_t k = 0; k < run->n; k++)
        most_m = fmax(most_m, v->part[(run->at + k) % v->parts].bottom_m);
    return most_m;
}

/* How far the parts that the tile touches are free of the bottom. Roots come from the lowest on, so most that are
 * higher can tell nothing nearer and are not divided. */
static void heed_bottom_in(struct verdict *v, const struct bottom *bottom, const struct tile_index *tile)
{
    const struct question_shape *q = &v->ask.question;
    const struct water_tile cone = tiles_cone(tile);
    const struct question_run run = question_run(q, &cone);
    struct ask_stretch s;
    if (!run.n || !question_stretch(q, &cone, most_asked_m(v), &s))
        return;
    const double lowest = asin(fmax(-1, fmin(cone.v[2], 1))) + cone.half_rad + q->asked.loose_rad;
    const double free_m = bottom_reach_m(bottom, sin(fmin(lowest, GEO_PI / 2)));
    const double least_m = question_measure(q, &cone, free_m);
    if (free_m >= s.to_m || least_m >= most_bottom_m(v, &run))
        return;
    for (int i = 0; i < 4 && tile->level + 1 < BOTTOM_LEVELS; i++) {
        const struct tile_index part = tiles_part(tile, i);
        heed_bottom_in(v, bottom, &part);
    }
    for (size_t k = 0; k < run.n && tile->level + 1 == BOTTOM_LEVELS; k++) {
        struct verdict_part *part = &v->part[(run.at + k) % v->parts];
        part->bottom_m = fmin(part->bottom_m, least_m);
    }
}

static void heed_bottom(struct verdict *v)
{
    const struct answer_now *now = v->by.now;
    if (!v->frame.ned || !(now->pose.has & POSE_ALTITUDE))
        return;
    const struct bottom bottom =
        bottom_below(now->pose.altitude_m, -v->place.uncertain_m, v->place.uncertain_m, 0);
    for (uint32_t row = 0; row < TILES_ROWS; row++) {
        uint32_t n, column = question_columns(&v->ask.question, row, &n);
        for (; n > 0; n--, column++) {
            const struct tile_index root = {0, (uint16_t)row, (uint16_t)(column % tiles_columns(row))};
            heed_bottom_in(v, &bottom, &root);
        }
    }
}

/* ---- the promise ---- */

/* Something that a beam showed elsewhere may have come to where the tile is asked, however far that is asked. */
static void heed_shown_in(struct verdict *v, const struct promise *promise, const struct question_shape *q,
                          const struct tile_index *tile)
{
    const struct water_tile cone = tiles_cone(tile);
    const struct question_run run = question_run(q, &cone);
    struct ask_stretch s;
    if (!run.n || !question_stretch(q, &cone, FARTHEST_M, &s))
        return;
    double at[3] = {cone.v[0], cone.v[1], cone.v[2]};
    sight_to_grid(&v->frame, v->by.now, true, at);
    const double level = hypot(at[0], at[1]), half = sin(cone.half_rad) / fmax(level, 1e-9);
    const double come_m =
        promise_come_m(promise, atan2(at[1], at[0]), v->place.adrift_rad + (half < 1 ? asin(half) : GEO_PI));
    for (size_t k = 0; k < run.n && come_m < s.to_m; k++) {
        struct verdict_part *part = &v->part[(run.at + k) % v->parts];
        part->promised_m = fmax(v->own_m, fmin(part->promised_m, come_m));
    }
}

/* Of a vehicle that drifts. */
static void heed_shown(struct verdict *v)
{
    if (v->by.now->pose.drift_mps <= 0)
        return;
    const struct promise promise = promise_begin(v->by.picture, v->by.conf, &v->frame, v->by.now, &v->place);
    const struct ask_question from_own = question_from(v, 0, v->own_m);
    struct question_shape q;
    question_begin(&q, &from_own);
    for (uint32_t row = 0; row < TILES_ROWS; row++) {
        uint32_t n, column = question_columns(&q, row, &n);
        for (; n > 0; n--, column++) {
            const struct tile_index root = {0, (uint16_t)row, (uint16_t)(column % tiles_columns(row))};
            heed_shown_in(v, &promise, &q, &root);
        }
    }
}

/* ---- why not farther ---- */

#define LOOK_RAD 1e-3
#define LOOK_M   (2 * WATER_GRID_M)

/* Towards the axis, to no more than most_rad from it. */
static void draw_in(const double axis[3], double most_rad, double at[3])
{
    const double along = geo_dot(at, axis);
    double aside[3] = {at[0] - along * axis[0], at[1] - along * axis[1], at[2] - along * axis[2]};
    const double off = geo_length(aside);
    if (atan2(off, along) <= most_rad)
        return;
    for (int k = 0; k < 3; k++)
        at[k] = cos(most_rad) * axis[k] + (off > 0 ? sin(most_rad) / off * aside[k] : 0);
}

static void draw_into_band(const struct verdict *v, double at[3])
{
    const struct ask_band *band = &v->ask.question.asked.band;
    const double loose = v->ask.question.asked.loose_rad;
    double az, el;
    quat_rotate_inverse(band->attitude, at, at);
    geo_angles(at, &az, &el);
    if (band->parts == 1 && band->width_rad > 0) {
        const double middle = band->from_rad + band->width_rad / 2, off = geo_wrap_pi(az - middle);
        const double most = band->width_rad / 2 + loose;
        az = middle + fmax(-most, fmin(off, most));
    }
    geo_direction(az, fmax(band->lo_rad - loose, fmin(el, band->hi_rad + loose)), at);
    quat_rotate(band->attitude, at, at);
}

/* A tile reaches beyond the question, and its middle may be there: the nearest direction of the question, as far as its
 * axes may be turned. */
static void draw_into_question(const struct verdict *v, double range_m, double at[3])
{
    const struct ask_question *q = &v->ask.question.asked;
    if (q->kind == ASK_AROUND)
        draw_into_band(v, at);
    else
        draw_in(q->axis, q->loose_rad + (q->kind == ASK_CONE ? q->half_rad : asin(fmin(1, q->radius_m / range_m))),
                at);
}

/* Along a line, to its end. The question itself is over. */
static struct ask_answer look_along(struct verdict *v, const struct verdict_part *part)
{
    struct ask_question q = {.kind = ASK_CONE, .near_m = part->end_m, .to_m = part->end_m + LOOK_M};
    memcpy(q.axis, part->end_at, sizeof q.axis);
    ask_begin(&v->ask, v->aside, v->n_aside, &q);
    while (ask_step(&v->ask))
        ;
    return ask_end(&v->ask, 0);
}

/* All that a question could rest on if nothing were too old, too far away or lost. */
static void set_limits_aside(struct verdict *v)
{
    struct store_now all = now_of(v);
    all.clear_for_s = all.move_limit_m = INFINITY;
    all.lost = 0;
    if (v->n_aside < 0)
        v->n_aside = store_look(v->by.store, v->by.list, &all, v->aside);
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

/* The answer is as old as the oldest that it could rest on. */
static void count_age(struct verdict_part *part, const struct water_record *r)
{
    if (!part->oldest_ns || r->t_ns < part->oldest_ns)
        part->oldest_ns = r->t_ns;
}

/* Did any sonar ever look there, as far as poses say where it was? */
static bool was_looked_at(const struct verdict *v, struct verdict_part *part)
{
    const struct water_tile tile = {{part->end_at[0], part->end_at[1], part->end_at[2]}, LOOK_RAD};
    for (int i = 0; i < v->n_aside; i++) {
        struct water_view view = v->aside[i];
        view.margin_m = view.level_m = view.lift_m = view.margin_rad = 0;
        if (!water_covers(&view, &tile, part->end_m))
            continue;
        if (!part->oldest_ns)
            count_age(part, view.record);
        return true;
    }
    return false;
}

/* The gravest of those by which the water goes on where the records that count have it end. */
static enum answer_reason reason_of_end(struct verdict *v, struct verdict_part *part)
{
    enum answer_reason why = ANSWER_HEARD;
    set_limits_aside(v);
    if (v->n_aside == 0)
        return v->by.list->n ? ANSWER_MOVED : ANSWER_NEVER;
    const bool goes_on = look_along(v, part).free_to_m > part->end_m;
    for (int i = 0; goes_on && i < v->n_aside; i++)
        if (v->ask.part[0].used[i / 64] >> (i % 64) & 1) {
            const enum answer_reason one = outdated(v, &v->aside[i]);
            why = one > why ? one : why;
            count_age(part, v->aside[i].record);
        }
    if (why != ANSWER_HEARD)
        return why;
    if (part->found && part->from_m > part->promised_m)
        return part->from_m > near_of(v) ? ANSWER_BLIND : ANSWER_MOVED;
    return part->found || was_looked_at(v, part) ? ANSWER_BEYOND : ANSWER_NEVER;
}

/* Where the first water begins is told a little beyond the distance, too. */
static double farthest_start_m(const struct verdict *v)
{
    return fmin(distance_of(v) + near_of(v), FARTHEST_M - WATER_GRID_M);
}

#define MORE 1.2 /* times as far, at least: a corridor has many lines that begin late */

#define STEP_M     (WATER_GRID_M / 4)
#define STEP_SHARE 0.0625 /* of the range: the farther away, the fewer places are tried */

/* Where beyond from_m the water begins to be free along a line, by one record; INFINITY: nowhere before most_m. */
static double begins_by(const struct water_view *view, const struct water_tile *line, double from_m, double most_m)
{
    struct water_pieces said;
    const double least_m = from_m + fmax(STEP_M, STEP_SHARE * from_m);
    double begin_m = from_m, end_m = most_m;
    if (!(from_m < most_m) || !water_touches(view, line, &begin_m, &end_m))
        return INFINITY;
    water_decide(view, line, begin_m, end_m, &said);
    for (int k = 0; k < said.n; k++)
        if (said.piece[k].says == WATER_FREE && said.piece[k].to_m > least_m)
            return fmax(said.piece[k].from_m, least_m);
    return INFINITY;
}

#define UNSOUGHT -INFINITY

static double round_up(double range_m)
{
    return ceil(range_m / STEP_M) * STEP_M;
}

/* Where from from_m on the tile in which it ended the last time begins to be free before most_m. */
static double tile_begins_m(struct verdict *v, const struct verdict_part *part, double from_m, double most_m,
                            double *ends_m)
{
    const struct ask_stretch within = {from_m, most_m};
    return ask_begins_m(&v->ask, v->view, v->n, &part->tile, &within, ends_m);
}

/* Seeks on from where it has come; false: it is to be called again. What ends there may not farther on, where the tile
 * touches less of the same record. */
static bool seek(struct verdict *v, const struct verdict_part *part, double most_m, double *begin_m)
{
    const double from_m = v->sought_m, to_m = fmin(2 * from_m, most_m);
    double ends_m = INFINITY;
    *begin_m = from_m < to_m ? tile_begins_m(v, part, from_m, to_m, &ends_m) : INFINITY;
    v->sought_m = isfinite(ends_m) ? round_up(ends_m + fmax(STEP_M, STEP_SHARE * ends_m)) : to_m;
    return isfinite(*begin_m) || v->sought_m >= most_m;
}

/* Where beyond from_m that is, or a corridor leaves the tile; INFINITY: nowhere; UNSOUGHT: to be called again. */
static double begins_m(struct verdict *v, const struct verdict_part *part, double from_m, double most_m)
{
    const struct water_tile cone = tiles_cone(&part->tile);
    struct ask_stretch asked;
    double least_m;
    if (!v->seeking)
        v->sought_m = from_m + STEP_M;
    v->seeking = !seek(v, part, most_m, &least_m);
    if (v->seeking)
        return UNSOUGHT;
    if (v->query.line.corridor && question_stretch(&v->ask.question, &cone, v->ask.question.asked.to_m, &asked) &&
        asked.to_m < most_m)
        least_m = fmin(least_m, asked.to_m);
    return round_up(v->query.line.corridor ? fmax(least_m, MORE * from_m) : least_m);
}

/* The direction in the middle of a part, in the axes of the records. */
static void middle_of(const struct verdict *v, size_t part, double axis[3])
{
    struct ask_band band;
    if (!v->query.around) {
        axis_of(v, axis);
        return;
    }
    set_band(v, part, &band);
    geo_direction((double)part * GEO_TURN / (double)v->parts, (band.lo_rad + band.hi_rad) / 2, axis);
    quat_rotate(band.attitude, axis, axis);
}

#define NEWEST 4

/* Where in the middle of a part the water begins within `near` by the newest records that have some of it; INFINITY:
 * nowhere. */
static double begins_within_m(const struct verdict *v, size_t part)
{
    struct water_tile line = {.half_rad = LOOK_RAD};
    double least_m = INFINITY;
    int n = 0;
    middle_of(v, part, line.v);
    for (int i = 0; i < v->n && n < NEWEST; i++) {
        const double begin_m = begins_by(&v->view[i], &line, 0, near_of(v));
        n += isfinite(begin_m);
        least_m = fmin(least_m, begin_m);
    }
    return least_m;
}

/* Into n that grow. */
static void insert(double *sorted, size_t n, double x)
{
    for (; n > 0 && sorted[n - 1] > x; n--)
        sorted[n] = sorted[n - 1];
    sorted[n] = x;
}

#define MOST_PARTS 0.75
#define SOME_PARTS 24 /* evenly around */

/* Where most parts' water begins, within `near`. The first of a corridor's lies to its sides, which few beams see. */
static double most_begin_m(const struct verdict *v)
{
    double begin_m[SOME_PARTS];
    const size_t some = v->parts < SOME_PARTS ? v->parts : SOME_PARTS;
    size_t n = 0;
    for (size_t k = 0; k < some && !v->query.line.corridor; k++) {
        const double one_m = begins_within_m(v, k * v->parts / some);
        if (isfinite(one_m))
            insert(begin_m, n++, one_m);
    }
    if (n == 0)
        return near_of(v);
    return fmin(round_up(begin_m[(size_t)(MOST_PARTS * (double)(n - 1))]), near_of(v));
}

/* ---- the words ---- */

/* From the measure of a corridor to the range along the line on which it ends. */
static double range_of(const struct verdict *v, const double at[3], double measure_m)
{
    double axis[3];
    if (v->query.around || !v->query.line.corridor)
        return measure_m;
    axis_of(v, axis);
    const double ahead = geo_dot(axis, at), wall_m = hypot(measure_m, v->query.line.radius_m);
    return ahead > 0 ? fmin(measure_m / ahead, wall_m) : wall_m;
}

/* A larger tile that ends there does so in all its parts, and farther on they differ. */
static struct tile_index smallest_of(const struct verdict *v, const struct tile_index *tile, const double at[3])
{
    const int last = v->ask.question.asked.levels - 1;
    return tile->level < last ? tiles_at(at, last) : *tile;
}

static void end_here(struct verdict_part *part, double end_m)
{
    memcpy(part->end_at, part->line_at, sizeof part->end_at);
    part->end_m = end_m;
}

/* What was found from start_m on: rather what begins where it is promised. Why the water ends is told of the look
 * from `near` on, or of the one that found some. */
static void take_water(struct verdict *v, struct verdict_part *part, const struct ask_answer *water)
{
    const bool found = water->free_to_m > part->start_m, counts = part->start_m <= part->promised_m;
    part->starts++;
    part->ends = geo_length(water->at) > 0;
    if (part->stage == VERDICT_BEYOND) {
        part->free_m = fmax(part->free_m, water->free_to_m);
        return;
    }
    const bool longer =
        part->from_m > part->promised_m && water->free_to_m - part->start_m > part->free_m - part->from_m;
    if (found && (counts || !part->found || longer)) {
        part->found = true;
        part->from_m = part->start_m;
        part->free_m = water->free_to_m;
        part->oldest_ns = water->oldest >= 0 ? v->view[water->oldest].record->t_ns : 0;
    }
    const double end_m = fmax(range_of(v, water->at, water->free_to_m), part->start_m);
    memcpy(part->line_at, water->at, sizeof part->line_at);
    draw_into_question(v, end_m, part->line_at);
    part->tile = smallest_of(v, &water->tile, part->line_at);
    if ((found && counts) || (!part->found && part->start_m == near_of(v)))
        end_here(part, end_m);
}

/* From here on something else than the records says that the water is not free. */
static double barred_m(const struct verdict_part *part)
{
    const double bar_m = fmin(part->bottom_m, part->hint_m);
    return fmin(bar_m, part->obstacle_m);
}

/* It is free as far as asked, or up to there, and all nearer is the vehicle's, or promised. */
static bool is_known(const struct verdict *v, const struct verdict_part *part)
{
    const double to_m = fmin(distance_of(v), barred_m(part));
    return part->found && part->from_m <= part->promised_m && part->free_m >= to_m &&
           (part->from_m < to_m || to_m >= distance_of(v));
}

#define WITHIN_STARTS 12

/* Some of the water counts, and goes on to there, or to what else bars it. */
static bool counts_to(const struct verdict_part *part, double to_m)
{
    const double bar_m = barred_m(part);
    return part->found && part->from_m <= part->promised_m && part->from_m < bar_m &&
           part->free_m >= fmin(to_m, bar_m);
}

/* Where along the line on which nothing was free the water begins within `near`, and then `near` itself: that and what
 * is tried after it do not depend on what was found before. Negative: nothing more is to be asked, or UNSOUGHT. */
static double next_within(struct verdict *v, struct verdict_part *part)
{
    if (counts_to(part, near_of(v)))
        return -1;
    const bool again = !part->found && part->starts < WITHIN_STARTS;
    const double from_m = again ? begins_m(v, part, part->start_m, near_of(v)) : near_of(v);
    if (from_m < near_of(v)) /* or UNSOUGHT */
        return from_m;
    part->stage = VERDICT_NEAR;
    return near_of(v);
}

/* Up to where `near` holds; half as far, and again, as long as that is not the vehicle itself; then beyond it, where
 * the water begins, or begins again. Negative: nowhere else, or UNSOUGHT. The same places for all distances. */
static double next_start(struct verdict *v, struct verdict_part *part)
{
    if (part->starts == VERDICT_STARTS)
        return -1;
    if (part->stage == VERDICT_WITHIN)
        return next_within(v, part);
    if (part->start_m <= near_of(v) && part->start_m > part->promised_m)
        return part->promised_m;
    if (counts_to(part, 0))
        return -1;
    if (part->start_m <= near_of(v) && part->start_m > v->own_m)
        return fmax(part->start_m / 2, v->own_m);
    if (part->free_m >= distance_of(v))
        return -1;
    const double known_m = part->found ? part->free_m : near_of(v);
    const double from_m = begins_m(v, part, fmax(part->start_m, known_m), farthest_start_m(v));
    if (from_m == UNSOUGHT)
        return from_m;
    return from_m > near_of(v) && from_m < farthest_start_m(v) ? from_m : -1;
}

/* The water of a cone or corridor that is free as far as asked may go on. */
static bool goes_beyond(const struct verdict *v, const struct verdict_part *part)
{
    return !v->query.around && part->stage != VERDICT_BEYOND && part->free_m >= distance_of(v) &&
           part->free_m < fmin(v->frame.range_max_m, barred_m(part));
}

static void give_water(const struct verdict_part *part, struct answer *a)
{
    const double free_m = part->found ? fmin(part->free_m, barred_m(part)) : 0;
    a->blind_to_m = part->from_m;
    a->free_to_m = free_m > part->from_m ? free_m : 0;
}

static void finish(struct verdict *v, struct verdict_part *part, enum answer_reason water)
{
    struct answer *a = &part->answer;
    if (part->bottom_m < distance_of(v) && (part->free_m >= part->bottom_m || part->bottom_m <= part->promised_m))
        doubt(part, ANSWER_BOTTOM);
    doubt(part, water);
    give_water(part, a);
    if (a->state == ANSWER_BLOCKED)
        return;
    a->age_s = part->oldest_ns ? sight_seconds(v->by.now->now_ns, part->oldest_ns) : -1;
    a->reason = part->against;
    a->state = part->against == ANSWER_HEARD ? ANSWER_CLEAR : ANSWER_UNKNOWN;
    if (a->state == ANSWER_CLEAR)
        a->confidence = fmax(0, 1 - a->age_s / v->by.conf->clear_for_s);
}

/* Is nothing free from there on, for the tile in which it ended is not? Of a corridor a tile may not be asked there. */
static bool fails_again(struct verdict *v, struct verdict_part *part, double from_m)
{
    double ends_m;
    if (!part->ends || v->query.line.corridor || part->stage == VERDICT_BEYOND ||
        tile_begins_m(v, part, from_m, from_m + WATER_GRID_M, &ends_m) <= from_m)
        return false;
    part->start_m = from_m;
    part->starts++;
    if (!part->found && from_m == near_of(v))
        end_here(part, from_m);
    return true;
}

/* The next part is asked once more, or settled. */
static void settle(struct verdict *v)
{
    struct verdict_part *part = &v->part[v->next];
    const bool known = is_known(v, part);
    double from_m = known ? -1 : next_start(v, part);
    if (from_m == UNSOUGHT)
        return;
    if (known && goes_beyond(v, part)) {
        part->stage = VERDICT_BEYOND;
        from_m = part->free_m;
    }
    if (from_m >= 0) {
        if (!fails_again(v, part, from_m))
            ask_from(v, v->next, from_m);
        return;
    }
    finish(v, part, known ? ANSWER_HEARD : reason_of_end(v, part));
    v->next++;
}

static void end_ask(struct verdict *v)
{
    for (size_t k = v->all ? 0 : v->next; k < (v->all ? v->parts : v->next + 1); k++) {
        const struct ask_answer water = ask_end(&v->ask, v->all ? k : 0);
        take_water(v, &v->part[k], &water);
    }
    v->all = v->asking = false;
}

/* ---- the question ---- */

static void cannot(struct verdict *v, enum answer_reason why)
{
    for (size_t k = 0; k < v->parts; k++)
        v->part[k] = (struct verdict_part){.answer = {.state = ANSWER_UNKNOWN, .reason = why, .age_s = -1}};
}

static void take_obstacles(struct verdict *v, const struct obstacles_found *found, enum answer_reason kept)
{
    for (size_t k = 0; k < v->parts; k++) {
        const struct obstacles_found *f = &found[k];
        const bool blocks = f->any && f->near_m <= distance_of(v);
        struct verdict_part *part = &v->part[k];
        *part = (struct verdict_part){.bottom_m = INFINITY,
                                      .promised_m = near_of(v),
                                      .hint_m = f->hint_m,
                                      .obstacle_m = f->any ? f->near_m : INFINITY,
                                      .against = f->hint_m < INFINITY ? ANSWER_BEYOND : ANSWER_HEARD,
                                      .answer = {.state = ANSWER_UNKNOWN, .age_s = -1}};
        doubt(part, kept);
        if (f->any && (blocks || v->query.around))
            part->answer = (struct answer){.range_m = f->range_m, .range_sd_m = f->sd_m, .near_m = f->near_m};
        part->answer.state = blocks ? ANSWER_BLOCKED : ANSWER_UNKNOWN;
        part->answer.confidence = blocks ? f->confidence : 0;
        part->answer.age_s = blocks ? f->age_s : -1;
    }
}

static bool look_at_picture(struct verdict *v)
{
    struct obstacles_found found[ANSWER_SECTORS_MAX];
    const struct obstacles_scene scene = {v->by.picture, &v->frame, v->by.conf, v->by.now, &v->place};
    enum answer_reason why;
    picture_get_frame(v->by.picture, &v->frame);
    if (!sight_possible(&v->frame, v->by.now, is_ned(v), &why)) {
        cannot(v, why);
        return false;
    }
    sight_locate(v->by.picture, &v->frame, v->by.conf, v->by.now, &v->place);
    take_obstacles(v, found, obstacles_find(&scene, &v->query, found));
    return true;
}

/* Where the nearest obstacle of a cone or corridor begins that is beyond the distance; INFINITY: there is none. The
 * picture may be a newer one by now. */
static double beyond_m(const struct verdict *v)
{
    struct sight_reading r = {.picture = v->by.picture};
    double least_m = INFINITY;
    while (sight_reads(&r)) {
        struct picture_frame frame;
        struct sight_place place;
        struct obstacles_query query = v->query;
        struct obstacles_found found = {.any = false};
        const struct obstacles_scene scene = {v->by.picture, &frame, v->by.conf, v->by.now, &place};
        enum answer_reason why;
        picture_get_frame(v->by.picture, &frame);
        if (!sight_possible(&frame, v->by.now, is_ned(v), &why)) {
            least_m = distance_of(v);
            continue;
        }
        sight_locate(v->by.picture, &frame, v->by.conf, v->by.now, &place);
        query.line.distance_m = most_asked_m(v);
        obstacles_find(&scene, &query, &found);
        least_m = found.any ? fmax(found.near_m, distance_of(v)) : INFINITY;
    }
    return least_m;
}

static void look_beyond(struct verdict *v)
{
    v->beyond = true;
    if (!v->query.around && v->part[0].answer.state != ANSWER_BLOCKED)
        v->part[0].obstacle_m = beyond_m(v);
}

bool verdict_begin(struct verdict *v, const struct verdict_evidence *by, const struct obstacles_query *query,
                   double own_m)
{
    struct sight_reading r = {.picture = by->picture};
    bool possible = false;
    v->by = *by;
    v->query = *query;
    v->own_m = own_m;
    v->parts = obstacles_parts(query);
    v->next = 0;
    v->all = true;
    v->beyond = v->begun = v->seeking = false;
    v->n_aside = -1;
    while (sight_reads(&r))
        possible = look_at_picture(v);
    if (!possible)
        return false;
    heed_shown(v);
    return true;
}

/* The first look at the records. */
static void begin_asking(struct verdict *v)
{
    const struct store_now now = now_of(v);
    v->begun = true;
    v->n = store_look(v->by.store, v->by.list, &now, v->view);
    const double begin_m = most_begin_m(v);
    for (size_t k = 0; k < v->parts; k++)
        v->part[k].stage = begin_m < near_of(v) ? VERDICT_WITHIN : VERDICT_NEAR;
    ask_from(v, 0, begin_m);
    heed_bottom(v);
}

#define STEP_SETTLED 16   /* in one step, each with a look or two along a line or a tile, ... */
#define STEP_JUDGED  2048 /* ... or so many stretches of these */

static void settle_some(struct verdict *v)
{
    v->ask.judged = 0;
    for (int i = 0; i < STEP_SETTLED && v->next < v->parts && !v->asking && v->ask.judged < STEP_JUDGED; i++)
        settle(v);
}

bool verdict_step(struct verdict *v)
{
    if (!v->beyond) {
        look_beyond(v);
        return true;
    }
    if (!v->begun) {
        begin_asking(v);
        return true;
    }
    if (v->asking && ask_step(&v->ask))
        return true;
    if (v->asking)
        end_ask(v);
    settle_some(v);
    return v->next < v->parts;
}
