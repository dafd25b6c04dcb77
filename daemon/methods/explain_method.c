/* SPDX-License-Identifier: MIT */
/* The method that tells what an answer about a direction rests on: the grid's cells, the records of free water, and the
 * last pings that looked there; sonard-protocol(7) has its shape. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/answer/scope.h"
#include "grid/sphere/view.h"
#include "grid/water/ask.h"
#include "daemon/request_job.h"
#include "grid_methods.h"
#include "methods.h"
#include "query_context.h"
#include "reference.h"
#include "verdict_job.h"
#include "json_units.h"

/* Looked at in one part, or one step of asking the records: so long pings wait, and other clients. */
#define DIRECTIONS_PER_PART 512
#define BEAMS_PER_PART      2048

/* The records are not asked about wider cones: that takes long; nor farther than they reach. */
#define RECORDS_HALF_RAD (15 * GEO_PI / 180)
#define RECORDS_TO_M     600.0

struct blocking {
    uint32_t direction;
    struct sphere_cell cell;
};

/* What a beam says of the water asked about. */
enum says { SAYS_ECHO, SAYS_FREE, SAYS_NOTHING, SAYS_OWN, SAYINGS };

struct saying {
    struct witness beam;
    enum says says;
};

/* What is explained, from where it is seen, and what was found so far. */
struct scene {
    struct owner_job call;
    struct methods_env *d;
    struct grid *grid;
    struct answer_conf limits; /* of the grid at the question: the loop may change them meanwhile */
    bool started;
    struct picture_frame frame;
    struct answer_now now;
    struct answer_query query;
    struct verdict_job verdict; /* that which it explains, ... */
    struct answer answer;
    struct scope scope; /* which directions the answer looked at; where it looked at none, none */
    double axis[3];     /* of the cone, in NED or the body's axes, as are the places of cells */
    double opening_rad; /* half of it, and the cells of the grid that it touches; as far as the pose is uncertain,
                           more */
    double relaxed_rad; /* with relaxation cells so far from the cone raise directions within it */
    uint32_t count;
    /* directions */
    struct rings_visit visit;
    bool all_visited;
    uint32_t cells, n_found;
    struct blocking found[PROTOCOL_EXPLAIN_MAX]; /* the nearest cells, in order */
    uint32_t all_gone;
    struct sphere_cell gone[PROTOCOL_EXPLAIN_MAX];
    /* beams: those taken before the question, from the newest on */
    uint64_t beams_taken, beams;
    uint64_t back_to_ns;
    bool all_heard;
    json_int_t says[SAYINGS];
    uint32_t n_sayings;
    struct saying saying[PROTOCOL_EXPLAIN_MAX];
    /* records of free water: the loop's, also while the owner looks at the rest */
    bool recorded; /* they are asked */
    struct ask_question question;
    struct records_reading reading;
    struct water_view view[ASK_RECORDS];
    struct ask ask;
    uint64_t oldest_record_ns; /* that the answer rests on; 0: none */
};

static void write_age(struct json_out *out, const char *name, const struct scene *s, uint64_t t_ns)
{
    json_member_known(out, name, t_ns != 0, t_ns ? sight_seconds(s->now.now_ns, t_ns) : 0, 1e3);
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

/* ---- cells ---- */

/* Is it so near to the cone that with relaxation its cells may raise a direction within? */
static bool may_raise(const struct scene *s, uint32_t direction)
{
    const double *middle = grid_picture(s->grid)->axis[direction], *axis = s->scope.axis;
    const double cosine = middle[0] * axis[0] + middle[1] * axis[1] + middle[2] * axis[2];
    return cosine >= cos(fmin(s->query.half_angle_rad + s->relaxed_rad, GEO_PI));
}

/* Up to what range a direction's cells count for the answer; 0: none does. */
static double cells_to_m(struct scene *s, const struct scope_share *share, uint32_t direction)
{
    struct picture_entry e;
    struct sight view;
    if (s->relaxed_rad > 0)
        return share->need_m > 0 ? share->need_m : may_raise(s, direction) ? s->query.distance_m : 0;
    if (share->need_m <= 0)
        return 0;
    sight_look(grid_picture(s->grid), direction, &(struct sight_observer){&s->now, &s->scope.place, NULL}, &e,
               &view);
    return view.obstacle && view.near_m <= share->need_m ? share->need_m : 0;
}

/* The nearest ones, in order. */
static void take_cells(struct scene *s, uint32_t direction, double to_m)
{
    const double blocked_logodds = (double)grid_picture(s->grid)->blocked_logodds;
    struct blocking b = {.direction = direction};
    for (uint32_t k = 0; sphere_cell(s->grid->sphere, direction, k, s->now.now_ns, &b.cell); k++) {
        if (b.cell.pending || b.cell.logodds <= blocked_logodds || b.cell.near_m - s->scope.place.moved_m > to_m)
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

/* What is reported of a cell, whether it is there or gone; seen in the direction of `axis`. */
static void write_history(struct json_out *out, const struct scene *s, const struct sphere_cell *c,
                          const double axis[3], double range_m)
{
    double az, el;
    angles_of(s, axis, &az, &el);
    json_member_degrees(out, "azimuth_deg", az);
    json_member_degrees(out, "elevation_deg", el);
    json_member_metres(out, "range_m", range_m);
    json_member_count(out, "echoes", c->echoes);
    write_age(out, "first_echo_age_s", s, c->t_first_ns);
    write_age(out, "last_echo_age_s", s, c->t_echo_ns);
    json_member_count(out, "misses", c->misses);
    json_member_text(out, "sensor", grid_sensor_name(s->d, c->sensor));
    json_member_count(out, "last_ping", c->seq);
}

static void write_cell(struct json_out *out, const struct scene *s, const struct blocking *b)
{
    const struct sphere_cell *c = &b->cell;
    double axis[3];
    middle_of(s, b->direction, axis);
    json_out_open(out, '{');
    write_history(out, s, c, axis, (c->from_m + c->to_m) / 2);
    json_member_metres(out, "near_m", c->near_m);
    json_member_real(out, "confidence", 1 / (1 + exp(-c->logodds)), 1e3);
    json_member_text(out, "turn", grid_turn_word(c->flags));
    json_member_flag(out, "locked", (c->flags & SPHERE_LOCKED) != 0);
    json_out_close(out, '}');
}

static void write_cells(struct json_out *out, const struct scene *s)
{
    json_member_open(out, "cells", '{');
    json_member_count(out, "all", s->cells);
    json_member_open(out, "nearest", '[');
    for (uint32_t i = 0; i < s->n_found; i++)
        write_cell(out, s, &s->found[i]);
    json_out_put(out, "]}");
}

static double range_of(const struct sphere_cell *c)
{
    return sqrt(c->point_m[0] * c->point_m[0] + c->point_m[1] * c->point_m[1] + c->point_m[2] * c->point_m[2]);
}

/* So far from the axis a thing at that range counts: it may lie beside where it was observed. */
static double opening_at(const struct scene *s, double range_m)
{
    return fmin(s->opening_rad + sight_aside_rad(&s->scope.place, range_m), GEO_PI);
}

/* What stood within the cone and the distance until beams of the present turn took it away, the newest first. */
static void take_gone(struct scene *s)
{
    struct sphere_cell c;
    for (uint32_t at = 0; sphere_gone(s->grid->sphere, &at, s->now.now_ns, &c);) {
        const double along_m = c.point_m[0] * s->axis[0] + c.point_m[1] * s->axis[1] + c.point_m[2] * s->axis[2];
        if (along_m < range_of(&c) * cos(opening_at(s, range_of(&c))) ||
            c.near_m - s->scope.place.moved_m > s->query.distance_m)
            continue;
        if (s->all_gone++ < s->count)
            s->gone[s->all_gone - 1] = c;
    }
}

static void write_gone(struct json_out *out, const struct scene *s)
{
    json_member_open(out, "gone", '{');
    json_member_count(out, "all", s->all_gone);
    json_member_open(out, "newest", '[');
    for (uint32_t i = 0; i < s->all_gone && i < s->count; i++) {
        json_out_open(out, '{');
        write_history(out, s, &s->gone[i], s->gone[i].point_m, range_of(&s->gone[i]));
        json_out_close(out, '}');
    }
    json_out_put(out, "]}");
}

/* ---- pings ---- */

/* How far what a beam observed may have come nearer since. */
static double nearer_m(const struct scene *s, const struct witness *w)
{
    return s->scope.place.moved_m + answer_drifted_m(&s->now, sight_seconds(s->now.now_ns, w->t_ns));
}

static enum says says_of(const struct scene *s, const struct witness *w)
{
    if (w->range_m > 0 && (double)w->near_m - nearer_m(s, w) <= s->query.distance_m)
        return w->own ? SAYS_OWN : SAYS_ECHO;
    return w->state != BEAM_BLIND && w->free_to_m > w->blind_m ? SAYS_FREE : SAYS_NOTHING;
}

/* Does it speak for the answer? Of unknown all is listed. */
static bool supports(enum answer_state state, enum says says)
{
    return state == ANSWER_UNKNOWN || says == (state == ANSWER_BLOCKED ? SAYS_ECHO : SAYS_FREE);
}

static void write_ping(struct json_out *out, const struct scene *s, const struct witness *w, enum says says)
{
    static const char *const words[SAYINGS] = {"echo", "free", "nothing", "own"};
    const double axis[3] = {(double)w->axis[0], (double)w->axis[1], (double)w->axis[2]};
    const bool echo = w->range_m > 0;
    double az, el;
    angles_of(s, axis, &az, &el);
    json_out_open(out, '{');
    json_member_text(out, "sensor", grid_sensor_name(s->d, w->sensor));
    json_member_count(out, "number", w->seq);
    json_member_real(out, "t_unix", (double)(w->t_ns + query_unix_offset_ns(s->d)) * 1e-9, 1e6);
    write_age(out, "age_s", s, w->t_ns);
    json_member_degrees(out, "bearing_deg", (double)w->az_rad);
    json_member_degrees(out, "azimuth_deg", az);
    json_member_degrees(out, "elevation_deg", el);
    json_member_word(out, "says", words[says]);
    json_member_known(out, "range_m", echo, (double)w->range_m, PER_METRES);
    if (w->bin >= 0)
        json_member_count(out, "bin", (uint64_t)w->bin);
    else
        json_member_null(out, "bin");
    json_member_known(out, "confidence", echo, (double)w->confidence, 1e3);
    json_member_metres(out, "blind_to_m", (double)w->blind_m);
    json_member_metres(out, "free_to_m", fmax((double)w->blind_m, (double)w->free_to_m));
    json_out_close(out, '}');
}

/* Newest first. */
static void take_beam(struct scene *s, const struct witness *w)
{
    const double range_m = w->range_m > 0 ? fmin((double)w->range_m, s->query.distance_m) : s->query.distance_m;
    s->back_to_ns = w->t_ns;
    if (w->ned != (bool)s->frame.ned || !witness_sees(w, s->axis, opening_at(s, range_m)))
        return;
    const enum says says = says_of(s, w);
    s->says[says]++;
    if (supports(s->answer.state, says) && s->n_sayings < s->count)
        s->saying[s->n_sayings++] = (struct saying){*w, says};
}

static void write_pings(struct json_out *out, const struct scene *s)
{
    const bool any = s->beams > 0;
    json_member_open(out, "pings", '{');
    json_member_count(out, "echo", (uint64_t)s->says[SAYS_ECHO]);
    json_member_count(out, "free", (uint64_t)s->says[SAYS_FREE]);
    json_member_count(out, "nothing", (uint64_t)s->says[SAYS_NOTHING]);
    json_member_count(out, "own", (uint64_t)s->says[SAYS_OWN]);
    json_member_known(out, "back_to_s", any, any ? sight_seconds(s->now.now_ns, s->back_to_ns) : 0, 1e3);
    json_member_open(out, "newest", '[');
    for (uint32_t i = 0; i < s->n_sayings; i++)
        write_ping(out, s, &s->saying[i].beam, s->saying[i].says);
    json_out_put(out, "]}");
}

/* ---- in parts ---- */

/* Which directions the question is about, as the grid is turned and the vehicle placed now. */
static void locate(struct scene *s)
{
    struct picture *picture = grid_picture(s->grid);
    struct sight_place place;
    picture_get_frame(picture, &s->frame);
    sight_locate(&s->frame, &s->limits, &s->now, &place);
    scope_begin(&s->scope, picture->rings, &(struct scope_view){&s->frame, &s->now, &place}, &s->query);
    s->opening_rad =
        s->query.half_angle_rad + rings_reach(picture->rings) + s->scope.turned_rad + place.adrift_rad;
    memcpy(s->axis, s->scope.axis, sizeof s->axis);
    sight_from_grid(&s->frame, &s->now, true, s->axis);
}

/* None of the directions yet. */
static void begin_directions(struct scene *s)
{
    struct picture *picture = grid_picture(s->grid);
    locate(s);
    s->visit = rings_visit(picture->rings, s->scope.axis, fmin(s->scope.around_rad + s->relaxed_rad, GEO_PI));
    s->cells = s->n_found = s->all_gone = 0;
    take_gone(s);
}

/* A direction that the answer looked at, and its cells. */
static void take_direction(struct scene *s)
{
    const uint32_t direction = s->visit.direction;
    const struct scope_share share = scope_share(&s->scope, grid_picture(s->grid)->axis[direction], s->visit.ring);
    const double to_m = cells_to_m(s, &share, direction);
    if (to_m > 0)
        take_cells(s, direction, to_m);
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
        take_direction(s);
    }
    for (int i = 0; s->all_visited && i < BEAMS_PER_PART && !s->all_heard; i++) {
        const struct witness *w = witness_look(witnesses, witnesses->taken - s->beams_taken + s->beams);
        s->all_heard = !w;
        if (w) {
            take_beam(s, w);
            s->beams++;
        }
    }
}

/* All that the answer is made of, as of one moment. */
static void look_first(struct scene *s, const struct pipeline_owned *owned)
{
    s->started = true;
    s->beams_taken = owned->witnesses->taken;
    begin_directions(s);
}

/* A part of it, by the grid's owner. */
static void look_at_grid(void *ctx, const struct pipeline_owned *owned)
{
    struct scene *s = ctx;
    if (!s->started)
        look_first(s, owned); /* of a wide cone that was long */
    else
        look_on(s, owned->witnesses);
}

/* ---- records of free water ---- */

/* The list that is open, from the first tile on. */
static void begin_ask(struct scene *s)
{
    const struct store_now now = {.now_ns = s->now.now_ns,
                                  .pose = &s->now.pose,
                                  .clear_for_s = s->limits.clear_for_s,
                                  .move_limit_m = s->limits.move_limit_m,
                                  .keeps_m = s->frame.reach_m,
                                  .lost = s->now.lost};
    ask_begin(&s->ask, s->view, records_view(pipeline_records(s->d->pipeline), &s->reading, &now, s->view),
              &s->question);
}

static void begin_records(struct scene *s)
{
    enum answer_reason reason;
    locate(s);
    s->question = (struct ask_question){.half_rad = s->query.half_angle_rad + s->scope.turned_rad,
                                        .near_m = s->query.near_m,
                                        .to_m = fmin(s->query.distance_m, RECORDS_TO_M)};
    memcpy(s->question.axis, s->axis, sizeof s->question.axis);
    s->recorded = s->query.half_angle_rad <= RECORDS_HALF_RAD && s->question.to_m > s->question.near_m &&
                  sight_possible(&s->frame, &s->now, s->query.ned, &reason);
    if (!s->recorded)
        return;
    records_open(pipeline_records(s->d->pipeline), &s->reading);
    begin_ask(s);
}

/* The next tiles; false: there are none left. */
static bool ask_on(struct scene *s)
{
    struct records *records = pipeline_records(s->d->pipeline);
    if (!records_keeps(records, &s->reading))
        begin_ask(s);
    if (ask_step(&s->ask))
        return true;
    s->oldest_record_ns = ask_end(&s->ask, 0).oldest >= 0 ? s->view[ask_end(&s->ask, 0).oldest].record->t_ns : 0;
    records_close(records, &s->reading);
    return false;
}

static void write_records(struct json_out *out, const struct scene *s)
{
    if (!s->recorded) {
        json_member_null(out, "water");
        return;
    }
    const struct ask_answer water = ask_end(&s->ask, 0);
    json_member_open(out, "water", '{');
    json_member_metres(out, "free_from_m", s->question.near_m);
    json_member_metres(out, "free_to_m", water.free_to_m);
    json_member_count(out, "records", (uint64_t)water.records);
    write_age(out, "oldest_age_s", s, s->oldest_record_ns);
    json_out_close(out, '}');
}

/* By how much the pose may be off, which makes the cone wider and everything nearer. */
static void write_uncertain(struct json_out *out, const struct scene *s)
{
    json_member_open(out, "uncertain", '{');
    json_member_metres(out, "moved_m", s->scope.place.moved_m);
    json_member_degrees(out, "turned_deg", s->scope.turned_rad + s->scope.place.adrift_rad);
    json_out_close(out, '}');
}

static struct scene *begin_scene(struct methods_env *d, json_t *params, struct rpc_error *error)
{
    struct grid *grid = grid_asked(d, params, error);
    if (!grid)
        return NULL;
    struct scene *s = calloc(1, sizeof *s);
    if (!s) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory to explain anything");
        return NULL;
    }
    s->d = d;
    s->grid = grid;
    s->verdict.d = d;
    s->verdict.grid = grid;
    direction_query(params, &s->verdict.query.line);
    verdict_job_begin(&s->verdict);
    s->limits = s->verdict.limits;
    s->query = s->verdict.query.line;
    s->now = s->verdict.now;
    s->count = (uint32_t)params_integer(params, "count");
    s->relaxed_rad = grid->setting.sphere.relaxation > 0 ? 3 * rings_reach(grid_picture(grid)->rings) : 0;
    return s;
}

/* When the owner has seen all of it. */
static bool write_scene(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct scene *s = call->work->state;
    (void)error;
    if (!request_job_done(call, d->pipeline, look_at_grid, write_scene))
        return false;
    if (!s->all_heard)
        return rpc_continue(call, write_scene);
    json_out_open(out, '{');
    json_member_word(out, "frame", s->query.ned ? "ned" : "body");
    json_out_name(out, "answer");
    direction_answer(s->d, out, &s->now, &s->limits, &s->query, &s->answer);
    write_uncertain(out, s);
    write_cells(out, s);
    write_gone(out, s);
    write_records(out, s);
    reference_write_all(out, d);
    write_pings(out, s);
    json_out_close(out, '}');
    return true;
}

/* Records first: their list is that of the moment of the question, and is not open for long. */
static bool ask_records(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct scene *s = call->work->state;
    return s->recorded && ask_on(s) ? rpc_continue(call, ask_records) : write_scene(call, out, error);
}

/* The owner may still be looking. */
static void drop_scene(void *state)
{
    struct scene *s = state;
    verdict_job_end(&s->verdict);
    records_close(pipeline_records(s->d->pipeline), &s->reading);
    request_job_free(s);
}

/* The answer itself, before what it rests on. */
static bool ask_verdict(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct scene *s = call->work->state;
    if (verdict_job_step(&s->verdict))
        return rpc_continue(call, ask_verdict);
    s->answer = *verdict_of(&s->verdict.verdict, 0);
    (void)out, (void)error;
    begin_records(s);
    return rpc_continue(call, ask_records);
}

bool method_explain(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct scene *s = begin_scene(call->daemon, params, error);
    if (!s)
        return false;
    (void)out;
    rpc_work_keep(call->work, s, drop_scene);
    return rpc_continue(call, ask_verdict);
}
