/* SPDX-License-Identifier: MIT */
#include "verdict.h"

#include <math.h>
#include <string.h>

#include "verdict_ask.h"
#include "verdict_bars.h"
#include "verdict_begins.h"
#include "verdict_body.h"
#include "verdict_why.h"

static void doubt(struct verdict_part *part, enum answer_reason why)
{
    part->against = why > part->against ? why : part->against;
}

/* ---- the words ---- */

/* From the measure of a corridor to the range along the line on which it ends. */
static double range_of(const struct verdict *v, const double at[3], double measure_m)
{
    double axis[3];
    if (v->query.around || !v->query.line.corridor)
        return measure_m;
    verdict_axis(v, axis);
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

/* From here on something else than the records says that the water is not free. */
static double barred_m(const struct verdict_part *part)
{
    const double bar_m = fmin(part->bottom_m, part->hint_m);
    return fmin(bar_m, part->obstacle_m);
}

/* What was found from start_m on: rather what begins where it is promised. Why the water ends is told of the look
 * from `near` on, or of the one that found some. */
static void take_water(struct verdict *v, struct verdict_part *part, const struct ask_answer *water)
{
    const bool found = water->free_to_m > part->start_m,
               counts = part->start_m <= part->promised_m && (!part->found || part->start_m < barred_m(part));
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
    verdict_draw_in(v, end_m, part->line_at);
    part->tile = smallest_of(v, &water->tile, part->line_at);
    if ((found && counts) || (!part->found && part->start_m == verdict_near_m(v)))
        end_here(part, end_m);
}

/* It is free as far as asked, or up to there, and all nearer is the vehicle's, or promised. */
static bool is_known(const struct verdict *v, const struct verdict_part *part)
{
    const double to_m = fmin(verdict_distance_m(v), barred_m(part));
    return part->found && part->from_m <= part->promised_m && part->free_m >= to_m &&
           (part->from_m < to_m || to_m >= verdict_distance_m(v));
}

/* So many leave room for `near`, and half of it and so on. Where they do not suffice a narrow cone, which goes from one
 * piece of water to the next, is told less than a wide one. */
#define WITHIN_STARTS 20

/* Some of the water counts, and goes on to there, or to what else bars it. */
static bool counts_to(const struct verdict_part *part, double to_m)
{
    const double bar_m = barred_m(part);
    return part->found && part->from_m <= part->promised_m && part->from_m < bar_m &&
           part->free_m >= fmin(to_m, bar_m);
}

/* Where along the line on which it ended the water begins within `near`, or begins again, and then `near` itself. What
 * is free farthest counts, as all nearer is promised: the first piece of a narrow cone may lie before that of a wide
 * one and end there. Negative: nothing more is to be asked, or it is VERDICT_UNSOUGHT. */
static double next_within(struct verdict *v, struct verdict_part *part)
{
    if (counts_to(part, verdict_near_m(v)))
        return -1;
    const double known_m = part->found ? fmax(part->start_m, part->free_m) : part->start_m,
                 most_m = fmin(verdict_near_m(v), barred_m(part)),
                 from_m = part->starts < WITHIN_STARTS ? verdict_begins_m(v, part, known_m, most_m) : INFINITY;
    if (from_m < most_m) /* or VERDICT_UNSOUGHT */
        return from_m;
    part->stage = VERDICT_NEAR;
    return verdict_near_m(v);
}

/* Up to where `near` holds; half as far, and again, as long as that is not the vehicle itself; then beyond it, where
 * the water begins, or begins again. Negative: nowhere else, or VERDICT_UNSOUGHT. The same places for all distances. */
static double next_start(struct verdict *v, struct verdict_part *part)
{
    if (part->starts == VERDICT_STARTS)
        return -1;
    if (part->stage == VERDICT_WITHIN)
        return next_within(v, part);
    if (part->start_m <= verdict_near_m(v) && part->start_m > part->promised_m)
        return part->promised_m;
    if (counts_to(part, 0))
        return -1;
    if (part->start_m <= verdict_near_m(v) && part->start_m > v->own_m)
        return fmax(part->start_m / 2, v->own_m);
    if (part->free_m >= verdict_distance_m(v))
        return -1;
    const double known_m = part->found ? part->free_m : verdict_near_m(v);
    const double from_m = verdict_begins_m(v, part, fmax(part->start_m, known_m), verdict_farthest_start_m(v));
    if (from_m == VERDICT_UNSOUGHT)
        return from_m;
    return from_m > verdict_near_m(v) && from_m < verdict_farthest_start_m(v) ? from_m : -1;
}

/* The water of a cone or corridor that is free as far as asked may go on. */
static bool goes_beyond(const struct verdict *v, const struct verdict_part *part)
{
    return !v->query.around && part->stage != VERDICT_BEYOND && part->free_m >= verdict_distance_m(v) &&
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
    if (part->bottom_m < verdict_distance_m(v) &&
        (part->free_m >= part->bottom_m || part->bottom_m <= part->promised_m))
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
        verdict_tile_begins_m(v, part, from_m, from_m + WATER_GRID_M, &ends_m) <= from_m)
        return false;
    part->start_m = from_m;
    part->starts++;
    if (!part->found && from_m == verdict_near_m(v))
        end_here(part, from_m);
    return true;
}

/* The next part is asked once more, or settled. */
static void settle(struct verdict *v)
{
    struct verdict_part *part = &v->part[v->next];
    const bool known = is_known(v, part);
    double from_m = known ? -1 : next_start(v, part);
    if (from_m == VERDICT_UNSOUGHT)
        return;
    if (known && goes_beyond(v, part)) {
        part->stage = VERDICT_BEYOND;
        from_m = part->free_m;
    }
    if (from_m >= 0) {
        if (!fails_again(v, part, from_m))
            verdict_ask(v, v->next, from_m);
        return;
    }
    finish(v, part, known ? ANSWER_HEARD : verdict_reason(v, part));
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
    v->corridor = (struct corridor){.blocked_m = INFINITY, .blocked_age_s = -1, .reason = why, .age_s = -1};
    if (v->query.moves) {
        const struct ask_question q = verdict_way(v);
        question_begin(&v->ask.question, &q);
        v->corridor.front_m = v->ask.question.front_m;
    }
    for (size_t k = 0; k < v->parts; k++)
        v->part[k] = (struct verdict_part){.answer = {.state = ANSWER_UNKNOWN, .reason = why, .age_s = -1}};
}

static void take_obstacles(struct verdict *v, const struct obstacles_found *found, enum answer_reason kept)
{
    for (size_t k = 0; k < v->parts; k++) {
        const struct obstacles_found *f = &found[k];
        const bool blocks = f->any && f->near_m <= verdict_distance_m(v);
        struct verdict_part *part = &v->part[k];
        *part = (struct verdict_part){.bottom_m = INFINITY,
                                      .promised_m = verdict_near_m(v),
                                      .hint_m = f->hint_m,
                                      .obstacle_m = f->any ? f->near_m : INFINITY,
                                      .against = f->hint_m < INFINITY ? ANSWER_BEYOND : ANSWER_HEARD,
                                      .answer = {.state = ANSWER_UNKNOWN, .age_s = -1}};
        part->met = *f;
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
    if (!sight_possible(&v->frame, v->by.now, verdict_ned(v), &why)) {
        cannot(v, why);
        return false;
    }
    sight_locate(&v->frame, v->by.conf, v->by.now, &v->place);
    v->horizon.promise = promise_begin(v->by.picture, v->by.conf, &v->frame, v->by.now, &v->place);
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
        struct obstacles_query query = {.line = v->query.line};
        struct obstacles_found found = {.any = false};
        const struct obstacles_scene scene = {v->by.picture, &frame, v->by.conf, v->by.now, &place};
        enum answer_reason why;
        picture_get_frame(v->by.picture, &frame);
        if (!sight_possible(&frame, v->by.now, verdict_ned(v), &why)) {
            least_m = verdict_distance_m(v);
            continue;
        }
        sight_locate(&frame, v->by.conf, v->by.now, &place);
        query.line.distance_m = verdict_most_asked_m(v);
        obstacles_find(&scene, &query, &found);
        least_m = found.any ? fmax(found.near_m, verdict_distance_m(v)) : INFINITY;
    }
    return least_m;
}

static void look_beyond(struct verdict *v)
{
    v->beyond = true;
    if (v->part[0].answer.state != ANSWER_BLOCKED)
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
    v->beyond = query->moves || query->around;
    v->begun = v->seeking = false;
    v->n_aside = -1;
    v->horizon.n = 0;
    v->looking = false;
    memset(&v->place, 0, sizeof v->place);
    while (sight_reads(&r))
        possible = look_at_picture(v);
    if (!possible)
        return false;
    if (!v->query.moves)
        verdict_heed_shown(v);
    return true;
}

/* The first look at the records. */
static void begin_asking(struct verdict *v)
{
    const struct store_now now = verdict_now(v);
    v->begun = true;
    v->n = store_look(v->by.store, v->by.list, &now, v->view);
    if (v->query.moves) {
        verdict_look_around(v);
        return;
    }
    const double begin_m = verdict_most_begin_m(v);
    for (size_t k = 0; k < v->parts; k++)
        v->part[k].stage = begin_m < verdict_near_m(v) ? VERDICT_WITHIN : VERDICT_NEAR;
    verdict_ask(v, 0, begin_m);
    verdict_heed_bottom(v, &v->ask.question.asked);
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
    if (v->query.moves)
        return verdict_step_way(v);
    if (v->asking && ask_step(&v->ask))
        return true;
    if (v->asking)
        end_ask(v);
    settle_some(v);
    return v->next < v->parts;
}
