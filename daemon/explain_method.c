/* SPDX-License-Identifier: MIT */
/* The method that tells what an answer about a direction rests on: the grid's cells and claims, and the last pings that
 * looked there; sonard-protocol(7) has its shape. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../grid/answer/sight.h"
#include "errand.h"
#include "grid_methods.h"
#include "methods.h"
#include "moment.h"
#include "say.h"

#define DEFAULT_COUNT 8
#define COUNT_MAX     64

/* Looked at in one part: so long pings wait, and other clients. */
#define DIRECTIONS_PER_PART 512
#define BEAMS_PER_PART      2048

struct blocking {
    uint32_t direction;
    struct sphere_cell cell;
};

/* What a beam says of the water asked about. */
enum says { SAYS_ECHO, SAYS_FREE, SAYS_NOTHING, SAYINGS };

struct saying {
    struct witness beam;
    enum says says;
};

/* What is explained, from where it is seen, and what was found so far. */
struct scene {
    struct errand errand;
    struct daemon *d;
    struct grid *grid;
    uint64_t grid_number;
    struct answer_conf limits; /* of the grid at the question: the loop may change them meanwhile */
    bool begun;
    struct picture_frame frame;
    struct answer_now now;
    struct answer_query query;
    struct answer answer;
    double axis[3]; /* of the cone, in NED or the body's axes, as are the places of cells */
    double opening_rad; /* half of it, and the cells of the grid that it touches, with relaxation their neighbours,
                           too: that is what the answer looked at */
    uint32_t count;
    /* directions */
    struct rings_visit visit;
    bool all_visited;
    uint32_t directions, never, cells, n_found;
    struct blocking found[COUNT_MAX]; /* the nearest cells, in order */
    uint32_t all_gone;
    struct sphere_cell gone[COUNT_MAX];
    struct claim oldest, shortest;
    uint32_t oldest_at, shortest_at;
    /* beams: those taken before the question, from the newest on */
    uint64_t beams_taken, beams;
    uint64_t back_to_ns;
    bool all_heard;
    json_int_t says[SAYINGS];
    uint32_t n_sayings;
    struct saying saying[COUNT_MAX];
};

static json_t *age(const struct scene *s, uint64_t t_ns)
{
    return t_ns ? say_real(sight_seconds(s->now.now_ns, t_ns), 1e3) : json_null();
}

/* The middle of a direction, as axis of the scene. */
static void middle_of(const struct scene *s, uint32_t direction, double v[3])
{
    memcpy(v, grid_picture(s->grid)->axis[direction], 3 * sizeof *v);
    sight_from_grid(&s->frame, &s->now, true, v);
}

/* Angles as asked: of the body, or NED. */
static void angles_of(const struct scene *s, const double axis[3], double *az_rad, double *el_rad)
{
    double v[3];
    memcpy(v, axis, sizeof v);
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

/* ---- cells ---- */

/* The nearest ones, in order. */
static void take_cells(struct scene *s, uint32_t direction)
{
    const double blocked_logodds = (double)grid_picture(s->grid)->blocked_logodds;
    struct blocking b = {.direction = direction};
    for (uint32_t k = 0; sphere_cell(s->grid->sphere, direction, k, s->now.now_ns, &b.cell); k++) {
        if (b.cell.logodds <= blocked_logodds || b.cell.near_m > s->query.distance_m)
            continue;
        s->cells++;
        uint32_t at = s->n_found < s->count ? s->n_found++ : s->count;
        for (; at > 0 && s->found[at - 1].cell.near_m > b.cell.near_m; at--)
            if (at < s->count)
                s->found[at] = s->found[at - 1];
        if (at < s->count)
            s->found[at] = b;
    }
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
                     "first_echo_age_s", age(s, c->t_first_ns), "last_echo_age_s", age(s, c->t_echo_ns), "misses",
                     (int)c->misses, "sensor", sensor_name(s->d, c->sensor), "last_ping", (json_int_t)c->seq);
}

static json_t *cell_json(const struct scene *s, const struct blocking *b)
{
    const struct sphere_cell *c = &b->cell;
    double axis[3];
    middle_of(s, b->direction, axis);
    json_t *told = history_json(s, c, axis, (c->from_m + c->to_m) / 2);
    json_t *more = json_pack("{s:o, s:o, s:s, s:b}", "near_m", say_metres(c->near_m), "confidence",
                             say_real(1 / (1 + exp(-c->logodds)), 1e3), "turn", turn_word(c->flags), "locked",
                             (c->flags & SPHERE_LOCKED) != 0);
    json_object_update(told, more);
    json_decref(more);
    return told;
}

static json_t *cells_json(const struct scene *s)
{
    json_t *list = json_array();
    for (uint32_t i = 0; i < s->n_found; i++)
        json_array_append_new(list, cell_json(s, &s->found[i]));
    return json_pack("{s:I, s:o}", "all", (json_int_t)s->cells, "nearest", list);
}

static double range_of(const struct sphere_cell *c)
{
    return sqrt(c->point_m[0] * c->point_m[0] + c->point_m[1] * c->point_m[1] + c->point_m[2] * c->point_m[2]);
}

/* What stood within the cone and the distance until beams of the present turn took it away, the newest first. */
static void take_gone(struct scene *s)
{
    const double cos_opening = cos(fmin(s->opening_rad, GEO_PI));
    struct sphere_cell c;
    for (uint32_t at = 0; sphere_gone(s->grid->sphere, &at, s->now.now_ns, &c);) {
        const double along_m = c.point_m[0] * s->axis[0] + c.point_m[1] * s->axis[1] + c.point_m[2] * s->axis[2];
        if (along_m < range_of(&c) * cos_opening || c.near_m > s->query.distance_m)
            continue;
        if (s->all_gone++ < s->count)
            s->gone[s->all_gone - 1] = c;
    }
}

static json_t *gone_json(const struct scene *s)
{
    json_t *list = json_array();
    for (uint32_t i = 0; i < s->all_gone && i < s->count; i++)
        json_array_append_new(list, history_json(s, &s->gone[i], s->gone[i].point_m, range_of(&s->gone[i])));
    return json_pack("{s:I, s:o}", "all", (json_int_t)s->all_gone, "newest", list);
}

/* ---- claims ---- */

static json_t *claim_json(const struct scene *s, uint32_t direction, const struct claim *c)
{
    double axis[3], az, el;
    if (!c->t_ping_ns)
        return json_null();
    middle_of(s, direction, axis);
    angles_of(s, axis, &az, &el);
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "azimuth_deg", say_degrees(az), "elevation_deg",
                     say_degrees(el), "free_from_m", say_metres((double)c->from_m), "free_to_m",
                     say_metres(fmax((double)c->from_m, (double)c->to_m)), "age_s", age(s, c->t_ping_ns),
                     "sensors", sensor_names(s->d, c->sensors));
}

/* How many directions were ever looked at, and the claims that clear stands or falls with. */
static void take_claim(struct scene *s, uint32_t direction)
{
    struct picture_entry e;
    picture_get(grid_picture(s->grid), direction, &e);
    const struct claim c = e.claim[CLAIM_NOW];
    s->directions++;
    s->never += c.t_ping_ns == 0;
    if (!c.t_ping_ns)
        return;
    if (!s->oldest.t_ping_ns || c.t_ping_ns < s->oldest.t_ping_ns) {
        s->oldest = c;
        s->oldest_at = direction;
    }
    if (!s->shortest.t_ping_ns || c.to_m < s->shortest.to_m) {
        s->shortest = c;
        s->shortest_at = direction;
    }
}

static json_t *claims_json(const struct scene *s)
{
    return json_pack("{s:I, s:I, s:o, s:o}", "all", (json_int_t)s->directions, "never", (json_int_t)s->never,
                     "oldest", claim_json(s, s->oldest_at, &s->oldest), "shortest",
                     claim_json(s, s->shortest_at, &s->shortest));
}

/* ---- pings ---- */

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
static void take_beam(struct scene *s, const struct witness *w)
{
    s->back_to_ns = w->t_ns;
    if (w->ned != (bool)s->frame.ned || !witness_sees(w, s->axis, s->opening_rad))
        return;
    const enum says says = says_of(s, w);
    s->says[says]++;
    if (supports(s->answer.state, says) && s->n_sayings < s->count)
        s->saying[s->n_sayings++] = (struct saying){*w, says};
}

static json_t *pings_json(const struct scene *s)
{
    json_t *list = json_array();
    for (uint32_t i = 0; i < s->n_sayings; i++)
        json_array_append_new(list, ping_json(s, &s->saying[i].beam, s->saying[i].says));
    return json_pack("{s:I, s:I, s:I, s:o, s:o}", "echo", s->says[SAYS_ECHO], "free", s->says[SAYS_FREE],
                     "nothing", s->says[SAYS_NOTHING], "back_to_s",
                     s->beams > 0 ? say_real(sight_seconds(s->now.now_ns, s->back_to_ns), 1e3) : json_null(),
                     "newest", list);
}

/* ---- in parts ---- */

/* The answer, and none of its directions yet. */
static void begin_directions(struct scene *s)
{
    struct picture *picture = grid_picture(s->grid);
    picture_get_frame(picture, &s->frame);
    answer_direction(picture, &s->limits, &s->now, &s->query, &s->answer);
    geo_direction(s->query.az_rad, s->query.el_rad, s->axis);
    sight_to_grid(&s->frame, &s->now, s->query.ned, s->axis);
    s->visit = rings_visit(picture->rings, s->axis, s->opening_rad);
    sight_from_grid(&s->frame, &s->now, true, s->axis);
    s->directions = s->never = s->cells = s->n_found = s->all_gone = 0;
    s->oldest = s->shortest = (struct claim){0};
    take_gone(s);
}

/* A direction is another one once the axes have turned. */
static bool axes_turned(const struct scene *s)
{
    struct picture_frame frame;
    picture_get_frame(grid_picture(s->grid), &frame);
    return frame.axes_rad != s->frame.axes_rad;
}

/* The next directions; when there are none left, the next beams. Older beams are forgotten while it goes on. */
static void look_on(struct scene *s, const struct witnesses *witnesses)
{
    if (!s->all_visited && axes_turned(s))
        begin_directions(s);
    for (int i = 0; i < DIRECTIONS_PER_PART && !s->all_visited; i++) {
        s->all_visited = !rings_next(&s->visit);
        if (s->all_visited)
            return;
        take_cells(s, s->visit.direction);
        take_claim(s, s->visit.direction);
    }
    if (!s->all_visited)
        return;
    for (int i = 0; i < BEAMS_PER_PART && !s->all_heard; i++) {
        const struct witness *w = witness_look(witnesses, witnesses->taken - s->beams_taken + s->beams);
        s->all_heard = !w;
        if (w) {
            take_beam(s, w);
            s->beams++;
        }
    }
}

/* All that the answer is made of, as of one moment. */
static void look_first(struct scene *s, const struct witnesses *witnesses)
{
    s->begun = true;
    s->beams_taken = witnesses->taken;
    begin_directions(s);
}

/* A part of it, by the grid's owner. */
static void look(void *ctx, const struct pipeline_owned *owned)
{
    struct scene *s = ctx;
    if (!pipeline_owned_grid(owned, s->grid_number))
        return;
    if (!s->begun)
        look_first(s, owned->witnesses);
    look_on(s, owned->witnesses);
}

static struct scene *begin_scene(struct daemon *d, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"azimuth_deg", "elevation_deg", "distance_m", "half_angle_deg",
                                       "frame",       "grid",          "count",      NULL};
    struct answer_query query;
    struct grid *grid;
    int64_t count = DEFAULT_COUNT;
    if (!rpc_only(params, keys, error) || !direction_query(params, &query, error) ||
        !rpc_integer(params, "count", false, 1, COUNT_MAX, &count, error) ||
        !(grid = grid_asked(d, params, error)))
        return NULL;
    struct scene *s = calloc(1, sizeof *s);
    if (!s) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory to explain anything");
        return NULL;
    }
    s->d = d;
    s->grid = grid;
    s->grid_number = grid->number;
    s->limits = grid->setting.limits;
    s->query = query;
    s->count = (uint32_t)count;
    s->now = moment_now(d);
    const double reach_rad = rings_reach(grid_picture(grid)->rings);
    s->opening_rad = query.half_angle_rad + reach_rad * (grid->setting.sphere.relaxation > 0 ? 3 : 1);
    return s;
}

json_t *explain_method(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const frames[] = {"body", "ned"};
    struct daemon *d = call->daemon;
    struct scene *s = call->work->state;
    if (!s && !(s = begin_scene(d, params, error)))
        return NULL;
    *call->work = (struct rpc_work){.state = s, .drop = errand_free};
    if (!errand_done(call, look, error))
        return NULL;
    if (!pipeline_has_grid(d->pipeline, s->grid_number)) {
        rpc_refuse(error, RPC_INVALID_PARAMS, "grid: it was dropped meanwhile");
        return NULL;
    }
    if (!s->all_heard) {
        error->code = RPC_UNFINISHED;
        return NULL;
    }
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o}", "frame", frames[s->query.ned], "answer",
                     direction_answer(&s->answer), "cells", cells_json(s), "gone", gone_json(s), "directions",
                     claims_json(s), "pings", pings_json(s));
}
