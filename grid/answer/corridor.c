/* SPDX-License-Identifier: MIT */
#include "corridor.h"

#include <math.h>
#include <string.h>

#include "promise.h"
#include "sight.h"

/* The tunnel in the grid's axes. `up` is across the line, as nearly up in the body as may be. */
struct tunnel {
    double along[3], side[3], up[3];
    double half_width_m, half_height_m, most_m;
    double off_m
        [3]; /* the vehicle from the grid's centre, where the rays begin: along, to the side, up; within ... */
    double loose_m; /* ... this */
    double near_m;  /* water nearer than this to the grid's centre is not asked for; 0: own_m holds */
    double own_m;   /* nor what is not so far along the line */
    double drift_side_m, drift_up_m; /* the wall on that side is so much farther away */
    /* the body with its margin is round: so far to the side its front lies farther back */
    double round_m, across, flat_m; /* its radius; share of it along a sloping line, and what the slope takes */
};

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

#define OWN_LEAST_M 1e-3

#define STEEP                                                                                                     \
    1e-6 /* a line this near to the cylinder's axis has no side: any will do, the cross-section is round */

static void dig(const struct corridor_body *body, const struct picture_frame *frame, const struct answer_now *now,
                const struct corridor_query *q, struct tunnel *t, double *front_m)
{
    double axis[3] = {0, 0, -1}, forward[3] = {1, 0, 0}, drift[3];
    memcpy(drift, q->drift_m, sizeof drift);
    memcpy(t->along, q->direction, sizeof t->along);
    scale(t->along, 1 / sqrt(geo_dot(t->along, t->along)));
    sight_to_grid(frame, now, q->ned, t->along);
    sight_to_grid(frame, now, q->ned, drift);
    sight_to_grid(frame, now, false, axis);
    sight_to_grid(frame, now, false, forward);
    const double slope = geo_dot(axis, t->along);
    cross(t->along, axis, t->side);
    if (geo_dot(t->side, t->side) < STEEP * STEEP)
        cross(t->along, forward, t->side);
    scale(t->side, 1 / sqrt(geo_dot(t->side, t->side)));
    cross(t->side, t->along, t->up);
    *front_m = extent(body, slope);
    t->half_width_m = body->radius_m + body->margin_m;
    t->half_height_m = extent(body, sqrt(fmax(0, 1 - slope * slope)));
    t->drift_side_m = geo_dot(drift, t->side);
    t->drift_up_m = geo_dot(drift, t->up);
    t->round_m = body->radius_m + body->margin_m;
    t->flat_m = body->margin_m * fabs(slope);
    t->across = sqrt(fmax(0, 1 - slope * slope));
    t->near_m = body->near_m;
    t->own_m = *front_m - body->margin_m + body->own_margin_m;
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
 * Where the rays within `reach` of one that goes `share` (a sine) sideways leave a wall at half_m from the vehicle, at
 * the latest: by the sine of the difference. The rays begin off_m short of it, and it is farther away by what the body
 * drifts towards it (negative: towards the other wall).
 */
static double leaves_wall(double half_m, double drift_m, double off_m, double share, struct reach reach)
{
    const double aside = clamped(fabs(share), 0, 1), side = share < 0 ? -1 : 1;
    const double least = aside * reach.cos - sqrt(1 - aside * aside) * reach.sin;
    const double wall_m = half_m + clamped(side * drift_m, 0, INFINITY) + side * off_m;
    return least > 0 ? sight_more(wall_m, 0) / least : INFINITY;
}

/* How far the rays of a ring's cells, and what was observed along them, may lie from their middles: in any direction,
 * and by how much `up` they do. A heading that has drifted takes nothing up or down. */
struct reaches {
    struct reach any, up;
};

static struct reaches reaches_of(const struct tunnel *t, double rad, double adrift_rad)
{
    return (struct reaches){reach_of(rad + adrift_rad), reach_of(rad + adrift_rad * hypot(t->up[0], t->up[1]))};
}

/* Range at which the last ray of the cell around v leaves the tunnel by its sides. */
static double leaves_side(const struct tunnel *t, const double v[3], const struct reaches *reach)
{
    const double wide_m = t->half_width_m + t->loose_m, high_m = t->half_height_m + t->loose_m;
    const double aside_m = leaves_wall(wide_m, t->drift_side_m, t->off_m[1], geo_dot(v, t->side), reach->any);
    return clamped(leaves_wall(high_m, t->drift_up_m, t->off_m[2], geo_dot(v, t->up), reach->up), 0, aside_m);
}

static void meet(struct corridor *out, const struct sight *s, const struct answer_now *now, const double axis[3],
                 double at_m)
{
    if (at_m >= out->blocked_m)
        return;
    memcpy(out->blocked_at, axis, sizeof out->blocked_at);
    out->blocked_m = at_m;
    out->blocked_sd_m = s->obstacle->sd_m;
    out->confidence = 1 / (1 + exp(-s->logodds));
    out->blocked_age_s = sight_seconds(now->now_ns, s->obstacle->t_echo_ns);
}

static void doubt_corridor(struct corridor *out, enum answer_reason why, const double axis[3], double at_m)
{
    if (at_m >= out->known_m)
        return;
    memcpy(out->known_at, axis, sizeof out->known_at);
    out->known_m = at_m;
    out->reason = why;
}

/* Where along the line, from the vehicle, a ray is at a range that is shorter by how loosely its place is known:
 * that may have been all ahead. */
static double along_m(const struct tunnel *t, double range_m, double foreshortened)
{
    return clamped(range_m * foreshortened - t->loose_m * (1 - foreshortened) - t->off_m[0], 0, INFINITY);
}

/*
 * By how much farther ahead than the line's something may be at range_m along the rays within `reach` of one that goes
 * `share` (a sine) sideways, for the body's front is round. Its cross-section at y to the side is a box as high as the
 * body and sqrt(R^2 - y^2) long; it reaches ahead by sqrt(R^2 - y^2) across + H slope, R and H with the margin.
 */
static double behind_front_m(const struct tunnel *t, double range_m, double share, struct reach reach)
{
    const double sine = clamped(share, -1, 1), cosine = sqrt(1 - sine * sine);
    const double right = sine * reach.cos - cosine * reach.sin, left = sine * reach.cos + cosine * reach.sin;
    const double beside_m = sight_more(range_m * right - t->off_m[1], t->off_m[1] - range_m * left) - t->loose_m -
                            fabs(t->drift_side_m);
    const double y = clamped(beside_m, 0, t->round_m);
    return sight_more(0, (t->round_m - sqrt(t->round_m * t->round_m - y * y)) * t->across - t->flat_m);
}

/* Where along the line the body's front is when it gets there. */
static double place_m(const struct tunnel *t, double range_m, const double v[3], double foreshortened,
                      struct reach reach)
{
    return along_m(t, range_m, foreshortened) + behind_front_m(t, range_m, geo_dot(v, t->side), reach);
}

/* A question about a tunnel, while directions are added to the answer. */
struct look {
    struct picture *picture;
    const struct answer_conf *conf;
    const struct answer_now *now;
    struct picture_frame frame;
    struct sight_place place;
    struct tunnel tunnel;
    struct promise promise;
    struct sight_fade fade;
    struct corridor *out;
};

/* Up to which range no ray of a cell is asked, of those that it has the one that goes `ahead` most (a cosine). */
static double own_range_m(const struct tunnel *t, double ahead)
{
    return t->near_m > 0 ? t->near_m : t->own_m / ahead;
}

/* Cosine of 45 degrees. Farther to the side a ray leaves the tunnel beside the body's own front. */
#define BOW 0.7071

/* Where along the line the tunnel ends, seen from the grid's centre. */
static double end_of(const struct tunnel *t)
{
    return t->most_m + t->off_m[0] + t->loose_m;
}

/* The bottom ends what is free where nobody needs to have looked, too. */
static void heed_bottom(const struct look *l, const double v[3], double foreshortened,
                        const struct reaches *reaches)
{
    const struct tunnel *t = &l->tunnel;
    const double bottom_m = fmax(0, bottom_reach_m(&l->place.bottom, v[2]) - l->place.moved_m);
    if (bottom_m * foreshortened < end_of(t) && bottom_m < leaves_side(t, v, reaches))
        doubt_corridor(l->out, ANSWER_BOTTOM, v, place_m(t, bottom_m, v, foreshortened, reaches->any));
}

/* What one direction adds. A range along a ray is `foreshortened` along the line, at the least. */
static void add(struct look *l, uint32_t direction, const struct reaches *reaches)
{
    const struct reach reach = reaches->any;
    const struct tunnel *t = &l->tunnel;
    struct corridor *out = l->out;
    const double *v = l->picture->axis[direction];
    const double ahead = clamped(geo_dot(v, t->along), -1, 1), off = sqrt(1 - ahead * ahead);
    const double foreshortened = clamped(ahead * reach.cos - off * reach.sin, 0, 1);
    const double most_ahead = ahead > reach.cos ? 1 : ahead * reach.cos + off * reach.sin;
    if (most_ahead <= 0) /* no ray of the cell leads ahead */
        return;
    if (isfinite(l->place.bottom.least_m))
        heed_bottom(l, v, foreshortened, reaches);
    const bool blank = picture_blank(l->picture, direction), promised = t->near_m > 0 && ahead > BOW;
    double own_m = own_range_m(t, most_ahead);
    if (blank && promised)
        own_m = promise_m(&l->promise, direction, reaches->up.sin, NULL, own_m);
    double near_m = blank ? place_m(t, own_m, v, foreshortened, reach) : 0;
    if (blank && near_m >= out->known_m) /* a doubt from there on is no news */
        return;
    const double side_m = leaves_side(t, v, reaches);
    const double end_m = end_of(t);
    const double exit_m = sight_less(side_m, sight_more(end_m, 0) / sight_more(foreshortened, 1e-9));
    if (exit_m <= own_m &&
        (blank || (!promised && picture_told_m(l->picture, direction) - l->place.moved_m > side_m)))
        return;
    struct picture_entry e;
    struct sight s;
    const struct sight_observer by = {l->conf, l->now, &l->place, own_m, exit_m, &l->fade};
    if (blank)
        s = sight_never;
    else
        sight_look_told(l->picture, direction, &by, &e, &s);
    if (s.obstacle && s.near_m <= side_m && s.near_m * foreshortened <= end_m)
        meet(out, &s, l->now, v, place_m(t, s.near_m, v, foreshortened, reach));
    const double sure_m = s.obstacle ? s.near_m : INFINITY;
    if (s.hint_m <
        sight_less(sure_m, sight_less(exit_m, own_m))) /* too weak to block, but no water to be sure of */
        doubt_corridor(out, ANSWER_BEYOND, v, place_m(t, s.hint_m, v, foreshortened, reach));
    if (!blank && promised)
        own_m = promise_m(&l->promise, direction, reaches->up.sin, &s, own_m);
    if (exit_m <= own_m)
        return;
    out->age_s = sight_more(out->age_s, s.age_s);
    if (!blank && (s.reason != ANSWER_HEARD || s.blind_m - t->loose_m > own_m))
        near_m = place_m(t, own_m, v, foreshortened, reach);
    if (s.reason != ANSWER_HEARD)
        doubt_corridor(out, s.reason, v, near_m);
    else if (s.blind_m - t->loose_m > own_m && s.clear_m > own_m)
        doubt_corridor(out, ANSWER_BLIND, v, near_m);
    else if (s.clear_m < exit_m)
        doubt_corridor(out, sight_beyond(&s), v,
                       place_m(t, sight_more(s.clear_m, own_m), v, foreshortened, reach));
}

/* The tunnel's place along the line where its corner is farther than what is the vehicle's own place. */
static double corner_m(const struct tunnel *t)
{
    const double side_m = t->half_width_m + fabs(t->drift_side_m) + fabs(t->off_m[1]) + t->loose_m,
                 up_m = t->half_height_m + fabs(t->drift_up_m) + fabs(t->off_m[2]) + t->loose_m;
    const double own_m =
        t->near_m <= 0 ? t->own_m : sqrt(fmax(0, t->near_m * t->near_m - side_m * side_m - up_m * up_m));
    return fmax(0, own_m - t->off_m[0] - t->loose_m);
}

/* A grid of a level row knows nothing above and below. Where the tunnel leaves its band at all it
 * may do so at a corner. */
static const double nowhere[3];

static void heed_band(const struct rings *rings, const struct tunnel *t, double tilt, struct corridor *out)
{
    const double bottom = rings->top_rad - rings->n_rings * rings->height_rad;
    const double el = asin(fmax(-1, fmin(1, -t->along[2])));
    if (sight_keeps(rings, -GEO_PI / 2, GEO_PI / 2))
        return;
    const double edge = fmax(0, fmin(rings->top_rad - el, el - bottom) - tilt);
    const double wall_m = t->half_height_m + fabs(t->off_m[2]) + t->loose_m;
    if (leaves_wall(wall_m, fabs(t->drift_up_m), 0, sin(fmin(edge, GEO_PI / 2)), reach_of(0)) > t->near_m)
        doubt_corridor(out, ANSWER_OUTSIDE, nowhere, corner_m(t));
}

/* From now on ranges are from the grid's centre, and shorter by what is not known of the vehicle's place alone. */
static void set_off(struct tunnel *t, struct sight_place *place)
{
    t->off_m[0] = geo_dot(place->offset_m, t->along);
    t->off_m[1] = geo_dot(place->offset_m, t->side);
    t->off_m[2] = geo_dot(place->offset_m, t->up);
    t->loose_m = place->uncertain_m + place->turned_rad * (place->moved_m - place->uncertain_m);
    if (t->near_m > 0)
        t->near_m = fmax(OWN_LEAST_M, t->near_m - place->moved_m);
    t->own_m = fmax(OWN_LEAST_M, t->own_m + t->off_m[0] - t->loose_m);
    place->moved_m = t->loose_m;
}

static void look_once(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                      const struct corridor_body *body, const struct corridor_query *q, struct corridor *out)
{
    struct look l = {.picture = p, .conf = conf, .now = now, .out = out};
    const struct picture_frame *frame = &l.frame;
    struct tunnel *t = &l.tunnel;
    picture_get_frame(p, &l.frame);
    *out = (struct corridor){
        .blocked_m = INFINITY, .blocked_age_s = -1, .known_m = q->most_m, .reason = ANSWER_HEARD, .age_s = -1};
    dig(body, frame, now, q, t, &out->front_m);
    if (!sight_possible(frame, now, q->ned, &out->reason)) {
        out->known_m = 0;
        return;
    }
    sight_locate(p, frame, conf, now, &l.place);
    out->uncertain_m = l.place.uncertain_m;
    set_off(t, &l.place);
    l.promise = promise_begin(p, conf, frame, now, &l.place);
    struct rings_visit visit =
        rings_visit(p->rings, t->along,
                    fmin(GEO_PI / 2 + p->rings->height_rad + l.place.turned_rad + l.place.adrift_rad, GEO_PI));
    const double turned = q->ned ? 0 : l.place.turned_rad;
    struct reaches reach = {reach_of(0), reach_of(0)};
    for (uint32_t ring = RINGS_NONE; rings_next(&visit); ring = visit.ring) {
        if (visit.ring != ring)
            reach = reaches_of(t, sight_cell_reach(p->rings, visit.ring) + turned, l.place.adrift_rad);
        add(&l, visit.direction, &reach);
    }
    heed_band(p->rings, t, turned + (frame->ned ? sight_tilt(now->pose.attitude) : 0), out);
    sight_from_grid(frame, now, q->ned, out->blocked_at);
    sight_from_grid(frame, now, q->ned, out->known_at);
}

void corridor_look(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                   const struct corridor_body *body, const struct corridor_query *query, struct corridor *out)
{
    struct sight_reading r = {.picture = p};
    while (sight_reads(&r))
        look_once(p, conf, now, body, query, out);
}
