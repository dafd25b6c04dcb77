/* SPDX-License-Identifier: MIT */
/* The method that tells what an answer about a direction rests on: the grid's cells and claims, and the last pings that
 * looked there; sonard-protocol(7) has its shape. */
#include <math.h>
#include <string.h>

#include "../grid/answer/sight.h"
#include "grid_methods.h"
#include "methods.h"
#include "moment.h"
#include "say.h"

#define DEFAULT_COUNT 8
#define COUNT_MAX     64

/* What is explained, and from where it is seen. */
struct scene {
    struct daemon *d;
    struct grid *grid;
    struct sphere *sphere;
    struct picture_frame frame;
    struct answer_now now;
    struct answer_query query;
    struct answer answer;
    double axis[3]; /* of the cone, in the grid's axes */
    uint32_t count;
};

static json_t *age(const struct scene *s, uint64_t t_ns)
{
    return t_ns ? say_real(sight_seconds(s->now.now_ns, t_ns), 1e3) : json_null();
}

/* Angles as asked: of the body, or NED. */
static void angles_of(const struct scene *s, const double in_grid[3], double *az_rad, double *el_rad)
{
    double v[3];
    memcpy(v, in_grid, sizeof v);
    if (s->frame.ned && !s->query.ned)
        quat_rotate_inverse(s->now.pose.attitude, v, v);
    geo_angles(v, az_rad, el_rad);
}

static const char *sensor_name(const struct daemon *d, uint32_t sensor)
{
    return sensor < (uint32_t)d->conf.n_sonars ? d->conf.sonar[sensor].name : "?";
}

static json_t *sensor_names(const struct daemon *d, uint64_t set)
{
    json_t *names = json_array();
    for (uint32_t i = 0; i < (uint32_t)d->conf.n_sonars; i++)
        if (set >> i & 1)
            json_array_append_new(names, json_string(sensor_name(d, i)));
    return names;
}

/* The cone, and the cells of the grid that it touches: that is what the answer looked at. */
static double opening_of(const struct scene *s)
{
    return s->query.half_angle_rad + rings_reach(grid_picture(s->grid)->rings);
}

static struct rings_visit visit_of(const struct scene *s)
{
    double az, el;
    geo_angles(s->axis, &az, &el);
    return rings_visit(grid_picture(s->grid)->rings, az, el, opening_of(s));
}

/* ---- cells ---- */

struct blocking {
    uint32_t direction;
    struct sphere_cell cell;
};

/* The nearest ones, in order; returns how many there are in all. */
static uint32_t find_cells(const struct scene *s, struct blocking *found, uint32_t *n)
{
    const double blocked_logodds = (double)grid_picture(s->grid)->blocked_logodds;
    struct rings_visit visit = visit_of(s);
    uint32_t all = 0;
    *n = 0;
    while (rings_next(&visit)) {
        struct blocking b = {.direction = visit.direction};
        for (uint32_t k = 0; sphere_cell(s->sphere, visit.direction, k, s->now.now_ns, &b.cell); k++) {
            if (b.cell.logodds <= blocked_logodds || b.cell.near_m > s->query.distance_m)
                continue;
            all++;
            uint32_t at = *n < s->count ? (*n)++ : s->count;
            for (; at > 0 && found[at - 1].cell.near_m > b.cell.near_m; at--)
                if (at < s->count)
                    found[at] = found[at - 1];
            if (at < s->count)
                found[at] = b;
        }
    }
    return all;
}

/* What happened to it in the present turn of the sensor that touched it last. */
static const char *turn_word(unsigned flags)
{
    return flags & SPHERE_NEW       ? "appeared"
           : flags & SPHERE_UPDATED ? "updated"
           : flags & SPHERE_MISSED  ? "missed"
                                    : "not looked at";
}

/* What is told of a cell, whether it is there or gone; seen in the direction of `axis`. */
static json_t *history_json(const struct scene *s, const struct sphere_cell *c, const double axis[3],
                            double range_m)
{
    double az, el;
    angles_of(s, axis, &az, &el);
    return json_pack("{s:o, s:o, s:o, s:i, s:o, s:o, s:i, s:s, s:I}", "azimuth_deg", say_degrees(az),
                     "elevation_deg", say_degrees(el), "range_m", say_metres(range_m), "echoes", (int)c->echoes,
                     "first_echo_age_s", age(s, c->t_first_ns), "last_echo_age_s", age(s, c->t_echo_ns),
                     "misses", (int)c->misses, "sensor", sensor_name(s->d, c->sensor), "last_ping",
                     (json_int_t)c->seq);
}

static json_t *cell_json(const struct scene *s, const struct blocking *b)
{
    const struct sphere_cell *c = &b->cell;
    json_t *told = history_json(s, c, grid_picture(s->grid)->axis[b->direction], (c->from_m + c->to_m) / 2);
    json_t *more = json_pack("{s:o, s:o, s:s, s:b}", "near_m", say_metres(c->near_m), "confidence",
                             say_real(1 / (1 + exp(-c->logodds)), 1e3), "turn", turn_word(c->flags), "locked",
                             (c->flags & SPHERE_LOCKED) != 0);
    json_object_update(told, more);
    json_decref(more);
    return told;
}

static json_t *cells_json(const struct scene *s)
{
    struct blocking found[COUNT_MAX];
    uint32_t n, all = find_cells(s, found, &n);
    json_t *list = json_array();
    for (uint32_t i = 0; i < n; i++)
        json_array_append_new(list, cell_json(s, &found[i]));
    return json_pack("{s:I, s:o}", "all", (json_int_t)all, "nearest", list);
}

/* What stood within the cone and the distance until beams of the present turn took it away, the newest first. */
static json_t *gone_json(const struct scene *s)
{
    const double cos_opening = cos(fmin(opening_of(s), GEO_PI));
    json_t *list = json_array();
    struct sphere_cell c;
    json_int_t all = 0;
    for (uint32_t at = 0; sphere_gone(s->sphere, &at, s->now.now_ns, &c);) {
        const double *p = c.point_m, range_m = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        const double along_m = p[0] * s->axis[0] + p[1] * s->axis[1] + p[2] * s->axis[2];
        if (along_m < range_m * cos_opening || c.near_m > s->query.distance_m)
            continue;
        if (all++ < s->count)
            json_array_append_new(list, history_json(s, &c, p, range_m));
    }
    return json_pack("{s:I, s:o}", "all", all, "newest", list);
}

/* ---- claims ---- */

static json_t *claim_json(const struct scene *s, uint32_t direction, const struct claim *c)
{
    double az, el;
    if (!c->t_ping_ns)
        return json_null();
    angles_of(s, grid_picture(s->grid)->axis[direction], &az, &el);
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "azimuth_deg", say_degrees(az), "elevation_deg",
                     say_degrees(el), "free_from_m", say_metres((double)c->from_m), "free_to_m",
                     say_metres(fmax((double)c->from_m, (double)c->to_m)), "age_s", age(s, c->t_ping_ns),
                     "sensors", sensor_names(s->d, c->sensors));
}

/* Of the directions asked about: how many were ever looked at, and the claims that clear stands or falls with. */
static json_t *claims_json(const struct scene *s)
{
    struct claim oldest = {0}, shortest = {0};
    uint32_t all = 0, never = 0, oldest_at = 0, shortest_at = 0;
    struct rings_visit visit = visit_of(s);
    while (rings_next(&visit)) {
        struct picture_entry e;
        picture_get(grid_picture(s->grid), visit.direction, &e);
        const struct claim c = e.claim[CLAIM_NOW];
        all++;
        never += c.t_ping_ns == 0;
        if (!c.t_ping_ns)
            continue;
        if (!oldest.t_ping_ns || c.t_ping_ns < oldest.t_ping_ns) {
            oldest = c;
            oldest_at = visit.direction;
        }
        if (!shortest.t_ping_ns || c.to_m < shortest.to_m) {
            shortest = c;
            shortest_at = visit.direction;
        }
    }
    return json_pack("{s:I, s:I, s:o, s:o}", "all", (json_int_t)all, "never", (json_int_t)never, "oldest",
                     claim_json(s, oldest_at, &oldest), "shortest", claim_json(s, shortest_at, &shortest));
}

/* ---- pings ---- */

/* What a beam says of the water asked about. */
enum says { SAYS_ECHO, SAYS_FREE, SAYS_NOTHING, SAYINGS };

static enum says says_of(const struct scene *s, const struct witness *w)
{
    if (w->range_m > 0 && (double)w->near_m <= s->query.distance_m)
        return SAYS_ECHO;
    return w->state != BEAM_BLIND && w->free_to_m > w->blind_m ? SAYS_FREE : SAYS_NOTHING;
}

/* Does it speak for the answer? Of unknown all is told. */
static bool supports(enum answer_state state, enum says says)
{
    return state == ANSWER_UNKNOWN || says == (state == ANSWER_BLOCKED ? SAYS_ECHO : SAYS_FREE);
}

static json_t *ping_json(const struct scene *s, const struct witness *w, enum says says)
{
    static const char *const words[SAYINGS] = {"echo", "free", "nothing"};
    const double axis[3] = {(double)w->axis[0], (double)w->axis[1], (double)w->axis[2]};
    const bool echo = w->range_m > 0;
    double az, el;
    angles_of(s, axis, &az, &el);
    return json_pack(
        "{s:s, s:I, s:o, s:o, s:o, s:o, s:o, s:s, s:o, s:o, s:o, s:o, s:o}", "sensor",
        sensor_name(s->d, w->sensor), "number", (json_int_t)w->seq, "t_unix",
        say_real((double)(w->t_ns + moment_unix_offset_ns(s->d)) * 1e-9, 1e6), "age_s", age(s, w->t_ns),
        "bearing_deg", say_degrees((double)w->az_rad), "azimuth_deg", say_degrees(az), "elevation_deg",
        say_degrees(el), "says", words[says], "range_m", echo ? say_metres((double)w->range_m) : json_null(),
        "bin", w->bin >= 0 ? json_integer(w->bin) : json_null(), "confidence",
        echo ? say_real((double)w->confidence, 1e3) : json_null(), "blind_to_m", say_metres((double)w->blind_m),
        "free_to_m", say_metres(fmax((double)w->blind_m, (double)w->free_to_m)));
}

/* Newest first. */
static json_t *pings_json(const struct scene *s)
{
    const struct witnesses *witnesses = pipeline_witnesses(s->d->pipeline);
    const double half_rad = opening_of(s);
    json_int_t counts[SAYINGS] = {0};
    json_t *list = json_array();
    const struct witness *w;
    uint64_t oldest_ns = 0, k = 0;
    for (; (w = witness_look(witnesses, k)); k++) {
        oldest_ns = w->t_ns;
        if (w->ned != (bool)s->frame.ned || !witness_sees(w, s->axis, half_rad))
            continue;
        const enum says says = says_of(s, w);
        counts[says]++;
        if (supports(s->answer.state, says) && json_array_size(list) < s->count)
            json_array_append_new(list, ping_json(s, w, says));
    }
    return json_pack("{s:I, s:I, s:I, s:o, s:o}", "echo", counts[SAYS_ECHO], "free", counts[SAYS_FREE], "nothing",
                     counts[SAYS_NOTHING], "back_to_s",
                     k > 0 ? say_real(sight_seconds(s->now.now_ns, oldest_ns), 1e3) : json_null(), "newest", list);
}

json_t *explain_method(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"azimuth_deg", "elevation_deg", "distance_m", "half_angle_deg",
                                       "frame",       "grid",          "count",      NULL};
    static const char *const frames[] = {"body", "ned"};
    struct scene s = {.d = call->daemon};
    int64_t count = DEFAULT_COUNT;
    if (!rpc_only(params, keys, error) || !direction_query(params, &s.query, error) ||
        !rpc_integer(params, "count", false, 1, COUNT_MAX, &count, error) ||
        !(s.grid = grid_asked(s.d, params, error)))
        return NULL;
    s.count = (uint32_t)count;
    s.sphere = pipeline_sphere(s.d->pipeline, s.grid);
    s.now = moment_now(s.d);
    picture_get_frame(grid_picture(s.grid), &s.frame);
    answer_direction(grid_picture(s.grid), &s.grid->setting.limits, &s.now, &s.query, &s.answer);
    geo_direction(s.query.az_rad, s.query.el_rad, s.axis);
    sight_to_grid(&s.frame, &s.now, s.query.ned, s.axis);
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o}", "frame", frames[s.query.ned], "answer",
                     direction_answer(&s.answer), "cells", cells_json(&s), "gone", gone_json(&s), "directions",
                     claims_json(&s), "pings", pings_json(&s));
}
