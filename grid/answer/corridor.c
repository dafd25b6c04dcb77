/* SPDX-License-Identifier: MIT */
#include "corridor.h"

#include <math.h>
#include <string.h>

#include "sight.h"

/* The tunnel in the grid's axes. `up` is across the line, as nearly up in the body as may be. */
struct tunnel {
    double along[3], side[3], up[3];
    double half_width_m, half_height_m, most_m;
    double near_m;                   /* water nearer than this to the grid's centre is not asked for */
    double drift_side_m, drift_up_m; /* the wall on that side is so much farther away */
    double moved_m; /* rays begin so far from the vehicle; the walls are farther away by it, too */
};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void scale(double v[3], double factor)
{
    for (int i = 0; i < 3; i++)
        v[i] *= factor;
}

/* The cylinder's support along its own axis (share of it: sine of the line's slope) and across. */
static double extent(const struct corridor_body *body, double upright)
{
    const double across = sqrt(fmax(0, 1 - upright * upright));
    return body->half_height_m * fabs(upright) + body->radius_m * across + body->margin_m;
}

#define STEEP                                                                                                     \
    1e-6 /* a line this near to the cylinder's axis has no side: any will do, the cross-section is round */

static void dig(const struct corridor_body *body, const struct picture_frame *frame, const struct answer_now *now,
                const struct corridor_query *q, struct tunnel *t, double *front_m)
{
    double axis[3] = {0, 0, -1}, forward[3] = {1, 0, 0}, drift[3];
    memcpy(drift, q->drift_m, sizeof drift);
    memcpy(t->along, q->direction, sizeof t->along);
    scale(t->along, 1 / sqrt(dot(t->along, t->along)));
    sight_to_grid(frame, now, q->ned, t->along);
    sight_to_grid(frame, now, q->ned, drift);
    sight_to_grid(frame, now, false, axis);
    sight_to_grid(frame, now, false, forward);
    const double slope = dot(axis, t->along);
    cross(t->along, axis, t->side);
    if (dot(t->side, t->side) < STEEP * STEEP)
        cross(t->along, forward, t->side);
    scale(t->side, 1 / sqrt(dot(t->side, t->side)));
    cross(t->side, t->along, t->up);
    *front_m = extent(body, slope);
    t->half_width_m = body->radius_m + body->margin_m;
    t->half_height_m = extent(body, sqrt(fmax(0, 1 - slope * slope)));
    t->drift_side_m = dot(drift, t->side);
    t->drift_up_m = dot(drift, t->up);
    t->near_m = body->near_m;
    t->most_m = q->most_m;
}

/* Without a call, for directions by the thousand. */
static double clamped(double x, double lo, double hi)
{
    return x < lo ? lo : x > hi ? hi : x;
}

/* An angle from 0 to a right one: the sum and difference with another need no more than this. */
struct reach {
    double sin, cos;
};

static struct reach reach_of(double rad)
{
    const double most = fmin(rad, GEO_PI / 2); /* wider cells have rays in every direction, too */
    return (struct reach){sin(most), cos(most)};
}

/*
 * Where the rays within `reach` of one that goes `share` (a sine) sideways leave a wall at half_m, at the latest: by the
 * sine of the difference. The wall that the body drifts towards is farther away by drift_m (negative: the other wall).
 */
static double leaves_wall(double half_m, double drift_m, double share, struct reach reach)
{
    const double aside = clamped(fabs(share), 0, 1);
    const double least = aside * reach.cos - sqrt(1 - aside * aside) * reach.sin;
    const double wall_m = half_m + clamped(share < 0 ? -drift_m : drift_m, 0, INFINITY);
    return least > 0 ? wall_m / least : INFINITY;
}

/* Range at which the last ray of the cell around v leaves the tunnel by its sides. */
static double leaves_side(const struct tunnel *t, const double v[3], struct reach reach)
{
    const double aside_m = leaves_wall(t->half_width_m, t->drift_side_m, dot(v, t->side), reach);
    return clamped(leaves_wall(t->half_height_m, t->drift_up_m, dot(v, t->up), reach), 0, aside_m);
}

static void meet(struct corridor *out, const struct sight *s, const struct answer_now *now, double at_m)
{
    if (at_m >= out->blocked_m)
        return;
    out->blocked_m = at_m;
    out->blocked_sd_m = s->obstacle->sd_m;
    out->confidence = 1 / (1 + exp(-s->logodds));
    out->blocked_age_s = sight_seconds(now->now_ns, s->obstacle->t_echo_ns);
}

static void doubt(struct corridor *out, enum answer_reason why, double at_m)
{
    if (at_m >= out->known_m)
        return;
    out->known_m = at_m;
    out->reason = why;
}

/* Where along the line a ray is at a range that is shorter by what the vehicle has moved: that may have been all ahead. */
static double along_m(const struct tunnel *t, double range_m, double foreshortened)
{
    return clamped(range_m * foreshortened - t->moved_m * (1 - foreshortened), 0, INFINITY);
}

/* A question about a tunnel, while directions are added to the answer. */
struct look {
    struct picture *picture;
    const struct answer_conf *conf;
    const struct answer_now *now;
    struct sight_place place;
    struct tunnel tunnel;
    struct corridor *out;
};

/* What one direction adds. A range along a ray is `foreshortened` along the line, at the least. */
static void add(const struct look *l, uint32_t direction, struct reach reach)
{
    const struct tunnel *t = &l->tunnel;
    struct corridor *out = l->out;
    const double *v = l->picture->axis[direction];
    const double ahead = clamped(dot(v, t->along), -1, 1), off = sqrt(1 - ahead * ahead);
    const double foreshortened = clamped(ahead * reach.cos - off * reach.sin, 0, 1);
    const double near_m = along_m(t, t->near_m, foreshortened);
    if (ahead * reach.cos + off * reach.sin < 0) /* no ray of the cell leads ahead */
        return;
    const bool blank = picture_blank(l->picture, direction);
    if (blank && near_m >= out->known_m) /* a doubt from there on is no news */
        return;
    const double side_m = leaves_side(t, v, reach);
    const double exit_m = fmin(side_m, t->most_m / fmax(foreshortened, 1e-9));
    if (blank && exit_m <= t->near_m)
        return;
    struct picture_entry e;
    struct sight s;
    sight_look(l->picture, direction, l->conf, l->now, &l->place, &e, &s);
    if (s.obstacle && s.near_m <= side_m && s.near_m * foreshortened <= t->most_m)
        meet(out, &s, l->now, along_m(t, s.near_m, foreshortened));
    const double sure_m = s.obstacle ? s.near_m : INFINITY;
    if (s.hint_m < fmin(sure_m, fmin(exit_m, t->near_m))) /* too weak to block, but no water to be sure of */
        doubt(out, ANSWER_BEYOND, along_m(t, s.hint_m, foreshortened));
    if (exit_m <= t->near_m)
        return;
    out->age_s = fmax(out->age_s, s.age_s);
    if (s.reason != ANSWER_HEARD)
        doubt(out, s.reason, near_m);
    else if (s.blind_m - t->moved_m > t->near_m)
        doubt(out, ANSWER_BLIND, near_m);
    else if (s.clear_m < exit_m)
        doubt(out, ANSWER_BEYOND, along_m(t, fmax(s.clear_m, t->near_m), foreshortened));
}

/* The tunnel's place along the line where its corner is farther than what is the vehicle's own place. */
static double corner_m(const struct tunnel *t)
{
    const double side_m = t->half_width_m + fabs(t->drift_side_m), up_m = t->half_height_m + fabs(t->drift_up_m);
    return fmax(0, sqrt(fmax(0, t->near_m * t->near_m - side_m * side_m - up_m * up_m)) - t->moved_m);
}

/* A grid of a level row knows nothing above and below. Where the tunnel leaves its band at all it may do so at a corner. */
static void heed_band(const struct rings *rings, const struct tunnel *t, double tilt, struct corridor *out)
{
    const double bottom = rings->top_rad - rings->n_rings * rings->height_rad;
    const double el = asin(fmax(-1, fmin(1, -t->along[2])));
    if (sight_keeps(rings, -GEO_PI / 2, GEO_PI / 2))
        return;
    const double edge = fmax(0, fmin(rings->top_rad - el, el - bottom) - tilt);
    if (leaves_wall(t->half_height_m, fabs(t->drift_up_m), sin(fmin(edge, GEO_PI / 2)), reach_of(0)) > t->near_m)
        doubt(out, ANSWER_OUTSIDE, corner_m(t));
}

static void look_once(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                      const struct corridor_body *body, const struct corridor_query *q, struct corridor *out)
{
    struct picture_frame frame;
    struct look l = {.picture = p, .conf = conf, .now = now, .out = out};
    struct tunnel *t = &l.tunnel;
    picture_get_frame(p, &frame);
    *out = (struct corridor){
        .blocked_m = INFINITY, .blocked_age_s = -1, .known_m = q->most_m, .reason = ANSWER_HEARD, .age_s = -1};
    dig(body, &frame, now, q, t, &out->front_m);
    if (!sight_possible(&frame, now, q->ned, &out->reason)) {
        out->known_m = 0;
        return;
    }
    sight_locate(&frame, now, &l.place);
    t->moved_m = l.place.moved_m;
    t->near_m = fmax(0, t->near_m - t->moved_m);
    t->half_width_m += t->moved_m;
    t->half_height_m += t->moved_m;
    struct rings_visit visit =
        rings_visit(p->rings, t->along, fmin(GEO_PI / 2 + p->rings->height_rad + l.place.turned_rad, GEO_PI));
    const double turned = q->ned ? 0 : l.place.turned_rad;
    struct reach reach = reach_of(0);
    for (uint32_t ring = RINGS_NONE; rings_next(&visit); ring = visit.ring) {
        if (visit.ring != ring)
            reach = reach_of(sight_cell_reach(p->rings, visit.ring) + turned);
        add(&l, visit.direction, reach);
    }
    heed_band(p->rings, t, turned + (frame.ned ? sight_tilt(now->pose.attitude) : 0), out);
}

void corridor_look(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                   const struct corridor_body *body, const struct corridor_query *query, struct corridor *out)
{
    struct sight_reading r = {.picture = p};
    while (sight_reads(&r))
        look_once(p, conf, now, body, query, out);
}
