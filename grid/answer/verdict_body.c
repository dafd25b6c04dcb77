/* SPDX-License-Identifier: MIT */
#include "verdict_body.h"

#include <math.h>
#include <string.h>

#include "verdict_ask.h"
#include "verdict_bars.h"
#include "verdict_begins.h"
#include "verdict_why.h"

static void doubt_way(struct corridor *out, enum answer_reason why, const double at[3], double at_m)
{
    if (at_m >= out->known_m)
        return;
    out->known_m = at_m;
    out->reason = why;
    memcpy(out->known_at, at, sizeof out->known_at);
}

/* The place of the body's way that is nearest to where it ends: a tile reaches beyond that. */
static void draw_into_way(const struct question_shape *q, double range_m, double at[3])
{
    const double wide_m = q->half_width_m + fabs(q->drift_side_m), high_m = q->half_height_m + fabs(q->drift_up_m);
    const double y = fmax(-wide_m, fmin(range_m * geo_dot(at, q->side), wide_m)),
                 z = fmax(-high_m, fmin(range_m * geo_dot(at, q->up), high_m)),
                 x = sqrt(fmax(0, range_m * range_m - y * y - z * z)), r = sqrt(x * x + y * y + z * z);
    for (int i = 0; i < 3 && r > 0; i++)
        at[i] = (x * q->asked.axis[i] + y * q->side[i] + z * q->up[i]) / r;
}

/* Of the water that ends there; it may only begin too late for how far `near` holds. */
static enum answer_reason reason_of_way(struct verdict *v, struct verdict_part *part)
{
    const struct water_tile line = {{part->end_at[0], part->end_at[1], part->end_at[2]}, VERDICT_LOOK_RAD};
    const enum answer_reason why = verdict_reason(v, part);
    const bool begins = part->end_m <= verdict_near_m(v) &&
                        verdict_begins_along_m(v, &line, part->end_m, 4 * verdict_near_m(v)) < INFINITY;
    return begins && why == ANSWER_BEYOND ? ANSWER_BLIND : why;
}

/* From the axes of the records into those asked about. */
static void turn_back(const struct verdict *v, double at[3])
{
    if (v->frame.ned && !verdict_ned(v))
        quat_rotate_inverse(v->by.now->pose.attitude, at, at);
}

static double age_of(const struct verdict *v, const struct verdict_part *part)
{
    return part->oldest_ns ? sight_seconds(v->by.now->now_ns, part->oldest_ns) : -1;
}

static void finish_way(struct verdict *v, struct verdict_part *part, const struct ask_answer *water)
{
    static const double nowhere[3];
    struct corridor *out = &v->corridor;
    double at[3];
    turn_back(v, part->bottom_at);
    memcpy(part->end_at, water->at, sizeof part->end_at);
    part->end_m = water->at_m;
    draw_into_way(&v->ask.question, part->end_m, part->end_at);
    part->found = false;
    if (water->oldest >= 0)
        verdict_count_age(part, v->view[water->oldest].record);
    out->age_s = age_of(v, part);
    doubt_way(out, ANSWER_BEYOND, part->met.hint_at, part->met.hint_m);
    doubt_way(out, ANSWER_OUTSIDE, nowhere, part->met.kept_m);
    doubt_way(out, ANSWER_BOTTOM, part->bottom_at, part->bottom_m);
    if (water->free_to_m >= out->known_m)
        return;
    const enum answer_reason why = reason_of_way(v, part);
    out->age_s = age_of(v, part);
    memcpy(at, part->end_at, sizeof at);
    turn_back(v, at);
    doubt_way(out, why, at, water->free_to_m);
}

static void begin_way(struct verdict *v)
{
    const struct corridor_query *move = &v->query.move;
    const struct obstacles_found *met = &v->part[0].met;
    v->corridor = (struct corridor){.front_m = v->ask.question.front_m,
                                    .blocked_m = met->any ? met->near_m : INFINITY,
                                    .blocked_sd_m = met->any ? met->sd_m : 0,
                                    .confidence = met->any ? met->confidence : 0,
                                    .blocked_age_s = met->any ? met->age_s : -1,
                                    .known_m = move->most_m,
                                    .reason = ANSWER_HEARD,
                                    .age_s = -1,
                                    .uncertain_m = v->place.uncertain_m};
    if (met->any)
        memcpy(v->corridor.blocked_at, met->at, sizeof met->at);
}

/* How far `near` holds is asked of the records with all that is uncertain now, or of what they showed without. */
static void ask_horizon(struct verdict *v)
{
    const struct ask_question q = horizon_question(&v->horizon);
    if (v->horizon.nominal)
        for (int i = 0; i < v->n; i++)
            v->aside[i] = verdict_as_told(&v->view[i]);
    ask_begin(&v->ask, v->horizon.nominal ? v->aside : v->view, v->n, &q);
}

static void ask_way(struct verdict *v)
{
    v->looking = false;
    verdict_ask(v, 0, verdict_near_m(v));
    begin_way(v);
    verdict_heed_bottom(v, &v->ask.question.asked);
}

void verdict_look_around(struct verdict *v)
{
    const struct ask_question q = verdict_way(v);
    v->looking = horizon_begin(&v->horizon, q.axis, v->frame.axes_rad, verdict_near_m(v));
    if (v->looking)
        ask_horizon(v);
    else
        ask_way(v);
}

/* v->aside becomes the records by which anybody looked somewhere; the others are lost. */
static int set_looks_aside(struct verdict *v)
{
    struct store_now looks = verdict_now(v);
    looks.clear_for_s = INFINITY;
    looks.looks = true;
    const int n = store_look(v->by.store, v->by.list, &looks, v->aside);
    for (int i = 0; i < n; i++) {
        const struct water_record *r = v->aside[i].record;
        v->aside[i].lost = v->aside[i].lost || !bearings_counts(&v->frame.looks, r->sensor, r->t_ns, looks.now_ns,
                                                                v->by.conf->clear_for_s);
    }
    return n;
}

static void end_look(struct verdict *v)
{
    const struct horizon_now now = {v->by.now->now_ns, v->view};
    if (horizon_take(&v->horizon, &v->ask, &now)) {
        ask_horizon(v);
        return;
    }
    const int n_looks = set_looks_aside(v);
    horizon_end(&v->horizon, v->view, v->n, v->aside, n_looks);
    v->n_aside = -1;
    ask_way(v);
}

bool verdict_step_way(struct verdict *v)
{
    if (ask_step(&v->ask))
        return true;
    if (v->looking) {
        end_look(v);
        return true;
    }
    const struct ask_answer water = ask_end(&v->ask, 0);
    finish_way(v, &v->part[0], &water);
    return false;
}
