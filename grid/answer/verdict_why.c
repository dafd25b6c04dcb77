/* SPDX-License-Identifier: MIT */
#include "verdict_why.h"

#include <math.h>
#include <string.h>

#include "verdict_ask.h"

#define LOOK_M (2 * WATER_GRID_M)

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
void verdict_draw_in(const struct verdict *v, double range_m, double at[3])
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

/* v->aside becomes all that a question could rest on if nothing were too old, too far away or lost. */
static void set_limits_aside(struct verdict *v)
{
    struct store_now all = verdict_now(v);
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
void verdict_count_age(struct verdict_part *part, const struct water_record *r)
{
    if (!part->oldest_ns || r->t_ns < part->oldest_ns)
        part->oldest_ns = r->t_ns;
}

/* As poses have it, whatever they leave uncertain. */
struct water_view verdict_as_told(const struct water_view *view)
{
    return (struct water_view){.record = view->record,
                               .at_m = {view->at_m[0], view->at_m[1], view->at_m[2]},
                               .keeps_m = view->keeps_m,
                               .lost = view->lost};
}

/* Did any sonar ever look there, as far as poses say where it was? */
static bool was_looked_at(const struct verdict *v, struct verdict_part *part)
{
    const struct water_tile tile = {{part->end_at[0], part->end_at[1], part->end_at[2]}, VERDICT_LOOK_RAD};
    for (int i = 0; i < v->n_aside; i++) {
        const struct water_view view = verdict_as_told(&v->aside[i]);
        if (!water_covers(&view, &tile, part->end_m))
            continue;
        if (!part->oldest_ns)
            verdict_count_age(part, view.record);
        return true;
    }
    return false;
}

/* The gravest of those by which the water goes on where the records that count have it end. */
enum answer_reason verdict_reason(struct verdict *v, struct verdict_part *part)
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
            verdict_count_age(part, v->aside[i].record);
        }
    if (why != ANSWER_HEARD)
        return why;
    if (part->from_m > part->promised_m)
        return part->from_m > verdict_near_m(v) ? ANSWER_BLIND : ANSWER_MOVED;
    return part->found || was_looked_at(v, part) ? ANSWER_BEYOND : ANSWER_NEVER;
}
