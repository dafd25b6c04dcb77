/* SPDX-License-Identifier: MIT */
#include "nearest.h"

#include <math.h>

#define ROW_RAD  geo_rad(10) /* no row of parts is higher, ... */
#define PART_RAD geo_rad(5)  /* ... and no part of it wider, in an arc */
#define LEAST_M  1e-3        /* water is asked for as far as this */

static bool is_around(const struct nearest_query *q)
{
    return q->width_rad <= 0 || q->width_rad >= GEO_TURN;
}

/* Rows of one height, an odd number of them: what is level is in the middle of one as a rule. */
static size_t rows_of(const struct nearest_query *q)
{
    const size_t n = (size_t)ceil((q->hi_rad - q->lo_rad) / ROW_RAD - 1e-9);
    return n < 1 ? 1 : n | 1;
}

static void set_row(const struct nearest_look *look, struct answer_band *band)
{
    const struct nearest_query *q = &look->query;
    const double high = (q->hi_rad - q->lo_rad) / (double)look->rows;
    band->lo_rad = q->lo_rad + (double)look->row * high;
    band->hi_rad = look->row + 1 == look->rows ? q->hi_rad : band->lo_rad + high;
    const double level = band->lo_rad > 0 ? cos(band->lo_rad) : band->hi_rad < 0 ? cos(band->hi_rad) : 1;
    const double wide = is_around(q) ? GEO_TURN : q->width_rad;
    band->count = (size_t)fmax(1, ceil(wide * level / PART_RAD - 1e-9));
}

/* Of all that is asked, in one part. */
static struct obstacles_query all_of(const struct nearest_query *q)
{
    return (struct obstacles_query){.around = true,
                                    .band = {.ned = q->ned,
                                             .lo_rad = q->lo_rad,
                                             .hi_rad = q->hi_rad,
                                             .from_rad = q->from_rad,
                                             .width_rad = is_around(q) ? 0 : q->width_rad,
                                             .reach_m = q->reach_m > 0 ? q->reach_m : INFINITY,
                                             .near_m = q->near_m,
                                             .count = 1}};
}

/* If it is nearer than what was found before. */
static void take_obstacle(struct nearest_look *look, const struct obstacles_found *f)
{
    struct nearest *out = &look->answer;
    const double to_m = out->state == ANSWER_BLOCKED ? nextafter(look->to_m, 0)
                        : look->query.reach_m > 0    ? look->query.reach_m
                                                     : INFINITY;
    if (!f->any || f->near_m > to_m)
        return;
    look->to_m = fmax(f->near_m, LEAST_M);
    out->state = ANSWER_BLOCKED;
    geo_angles(f->at, &out->az_rad, &out->el_rad);
    out->range_m = f->range_m;
    out->range_sd_m = f->sd_m;
    out->confidence = f->confidence;
    out->age_s = f->age_s;
}

static void doubt(struct nearest *out, enum answer_reason why)
{
    out->reason = why > out->reason ? why : out->reason;
}

/* In the picture. False: it cannot be asked. */
static bool find(struct nearest_look *look)
{
    const struct obstacles_query query = all_of(&look->query);
    const struct verdict_evidence *by = &look->by;
    struct picture_frame frame;
    struct sight_place place;
    struct obstacles_found found;
    const struct obstacles_scene scene = {by->picture, &frame, by->conf, by->now, &place};
    picture_get_frame(by->picture, &frame);
    if (!sight_possible(&frame, by->now, query.band.ned, &look->answer.reason))
        return false;
    sight_locate(&frame, by->conf, by->now, &place);
    doubt(&look->answer, obstacles_find(&scene, &query, &found));
    take_obstacle(look, &found);
    return true;
}

static void reset(struct nearest_look *look)
{
    const struct nearest_query *q = &look->query;
    look->answer = (struct nearest){.state = ANSWER_UNKNOWN, .age_s = -1, .unknown_share = 1};
    look->to_m = q->reach_m > 0 ? q->reach_m : q->heard_m;
}

bool nearest_begin(struct nearest_look *look, struct verdict *v, const struct verdict_evidence *by,
                   const struct nearest_query *query, double own_m)
{
    struct sight_reading r = {.picture = by->picture};
    bool possible = false;
    *look = (struct nearest_look){
        .verdict = v, .by = *by, .query = *query, .own_m = own_m, .rows = rows_of(query), .oldest_s = -1};
    while (sight_reads(&r)) {
        reset(look);
        possible = find(look);
    }
    return possible;
}

static bool begin_row(struct nearest_look *look)
{
    struct obstacles_query query = all_of(&look->query);
    set_row(look, &query.band);
    query.band.reach_m = look->to_m;
    look->row_begun = true;
    return verdict_begin(look->verdict, &look->by, &query, look->own_m);
}

static void count_row(struct nearest_look *look)
{
    const struct verdict *v = look->verdict;
    for (size_t k = 0; k < v->parts; k++) {
        const struct verdict_part *part = &v->part[k];
        const enum answer_reason why = part->answer.reason > part->against ? part->answer.reason : part->against;
        take_obstacle(look, &part->met);
        doubt(&look->answer, why);
        look->unknown += why != ANSWER_HEARD;
        if (part->oldest_ns)
            look->oldest_s = fmax(look->oldest_s, sight_seconds(look->by.now->now_ns, part->oldest_ns));
    }
    look->parts += v->parts;
    look->row++;
    look->row_begun = false;
}

static void finish(struct nearest_look *look)
{
    struct nearest *out = &look->answer;
    out->unknown_share = (double)look->unknown / (double)look->parts;
    if (out->state == ANSWER_BLOCKED)
        return;
    out->age_s = look->oldest_s;
    out->state = out->reason == ANSWER_HEARD ? ANSWER_CLEAR : ANSWER_UNKNOWN;
}

bool nearest_step(struct nearest_look *look)
{
    const bool more = look->row_begun ? verdict_step(look->verdict) : begin_row(look);
    if (more)
        return true;
    count_row(look);
    if (look->row < look->rows)
        return true;
    finish(look);
    return false;
}
