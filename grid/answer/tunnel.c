/* SPDX-License-Identifier: MIT */
#include "tunnel.h"

#include <math.h>
#include <string.h>

/* The tunnel in the grid's axes. `up` is across the line, as nearly up in the body as may be. */
struct tunnel {
    double along[3], side[3], up[3];
    double front_m, half_width_m, half_height_m, most_m, near_m;
    double off_m
        [3]; /* the vehicle from the grid's centre, where the rays begin: along, to the side, up; within ... */
    double loose_m;                  /* ... this */
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

#define STEEP                                                                                                     \
    1e-6 /* a line this near to the cylinder's axis has no side: any will do, the cross-section is round */

static void dig(const struct obstacles_scene *scene, const struct corridor_query *q, struct tunnel *t)
{
    const struct picture_frame *frame = scene->frame;
    const struct answer_now *now = scene->now;
    const struct corridor_body *body = &q->body;
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
    t->front_m = extent(body, slope);
    t->half_width_m = body->radius_m + body->margin_m;
    t->half_height_m = extent(body, sqrt(fmax(0, 1 - slope * slope)));
    t->drift_side_m = geo_dot(drift, t->side);
    t->drift_up_m = geo_dot(drift, t->up);
    t->round_m = body->radius_m + body->margin_m;
    t->flat_m = body->margin_m * fabs(slope);
    t->across = sqrt(fmax(0, 1 - slope * slope));
    t->near_m = q->near_m;
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

/* Where along the line the tunnel ends, seen from the grid's centre. */
static double end_of(const struct tunnel *t)
{
    return t->most_m + t->off_m[0] + t->loose_m;
}

/* ---- what stands in it ---- */

struct look {
    const struct obstacles_scene *scene;
    struct sight_place place; /* ranges are shorter by what is not known of it alone */
    struct tunnel tunnel;
    struct sight_fade fade;
    struct obstacles_found *found;
};

static void meet(const struct look *l, const struct sight *s, const double axis[3], double at_m)
{
    struct obstacles_found *f = l->found;
    if (f->any && at_m >= f->near_m)
        return;
    f->any = true;
    f->near_m = f->range_m = at_m;
    f->sd_m = s->obstacle->sd_m;
    f->confidence = 1 / (1 + exp(-s->logodds));
    f->age_s = sight_seconds(l->scene->now->now_ns, s->obstacle->t_echo_ns);
    memcpy(f->at, axis, sizeof f->at);
}

/* Too weak to block, but no water to be sure of. */
static void doubt(const struct look *l, const double axis[3], double at_m)
{
    struct obstacles_found *f = l->found;
    if (at_m >= f->hint_m)
        return;
    f->hint_m = at_m;
    memcpy(f->hint_at, axis, sizeof f->hint_at);
}

/* What one direction adds. A range along a ray is `foreshortened` along the line, at the least. */
static void add(struct look *l, uint32_t direction, const struct reaches *reaches)
{
    const struct obstacles_scene *scene = l->scene;
    const struct reach reach = reaches->any;
    const struct tunnel *t = &l->tunnel;
    const double *v = scene->picture->axis[direction];
    const double ahead = clamped(geo_dot(v, t->along), -1, 1), off = sqrt(1 - ahead * ahead);
    const double foreshortened = clamped(ahead * reach.cos - off * reach.sin, 0, 1);
    const double most_ahead = ahead > reach.cos ? 1 : ahead * reach.cos + off * reach.sin;
    if (most_ahead <= 0) /* no ray of the cell leads ahead */
        return;
    const double side_m = leaves_side(t, v, reaches), end_m = end_of(t);
    const double exit_m = sight_less(side_m, sight_more(end_m, 0) / sight_more(foreshortened, 1e-9));
    if (picture_told_m(scene->picture, direction) - l->place.moved_m > side_m)
        return;
    struct picture_entry e;
    struct sight s;
    sight_look(scene->picture, direction, &(struct sight_observer){scene->now, &l->place, &l->fade}, &e, &s);
    if (s.obstacle && s.near_m <= side_m && s.near_m * foreshortened <= end_m)
        meet(l, &s, v, place_m(t, s.near_m, v, foreshortened, reach));
    const double sure_m = s.obstacle ? s.near_m : INFINITY;
    if (s.hint_m < sight_less(sure_m, sight_less(exit_m, t->near_m)))
        doubt(l, v, place_m(t, s.hint_m, v, foreshortened, reach));
}

/* The tunnel's place along the line where its corner is farther than what is the vehicle's own place. */
static double corner_m(const struct tunnel *t)
{
    const double side_m = t->half_width_m + fabs(t->drift_side_m) + fabs(t->off_m[1]) + t->loose_m,
                 up_m = t->half_height_m + fabs(t->drift_up_m) + fabs(t->off_m[2]) + t->loose_m;
    const double own_m = sqrt(fmax(0, t->near_m * t->near_m - side_m * side_m - up_m * up_m));
    return fmax(0, own_m - t->off_m[0] - t->loose_m);
}

/* A grid of a level row knows nothing above and below. Where the tunnel leaves its band at all it
 * may do so at a corner. */
static void heed_band(const struct look *l, double tilt)
{
    const struct rings *rings = l->scene->picture->rings;
    const struct tunnel *t = &l->tunnel;
    const double bottom = rings->top_rad - rings->n_rings * rings->height_rad;
    const double el = asin(fmax(-1, fmin(1, -t->along[2])));
    if (sight_keeps(rings, -GEO_PI / 2, GEO_PI / 2))
        return;
    const double edge = fmax(0, fmin(rings->top_rad - el, el - bottom) - tilt);
    const double wall_m = t->half_height_m + fabs(t->off_m[2]) + t->loose_m;
    if (leaves_wall(wall_m, fabs(t->drift_up_m), 0, sin(fmin(edge, GEO_PI / 2)), reach_of(0)) > t->near_m)
        l->found->kept_m = corner_m(t);
}

/* From now on ranges are from the grid's centre, and shorter by what is not known of the vehicle's place alone. */
static void set_off(struct tunnel *t, struct sight_place *place)
{
    t->off_m[0] = geo_dot(place->offset_m, t->along);
    t->off_m[1] = geo_dot(place->offset_m, t->side);
    t->off_m[2] = geo_dot(place->offset_m, t->up);
    t->loose_m = place->uncertain_m + place->turned_rad * (place->moved_m - place->uncertain_m);
    place->moved_m = t->loose_m;
}

void tunnel_find(const struct obstacles_scene *scene, const struct corridor_query *q,
                 struct obstacles_found *found)
{
    struct look l = {.scene = scene, .place = *scene->place, .found = found};
    const struct rings *rings = scene->picture->rings;
    struct tunnel *t = &l.tunnel;
    dig(scene, q, t);
    set_off(t, &l.place);
    struct rings_visit visit = rings_visit(
        rings, t->along, fmin(GEO_PI / 2 + rings->height_rad + l.place.turned_rad + l.place.adrift_rad, GEO_PI));
    const double turned = q->ned ? 0 : l.place.turned_rad;
    struct reaches reach = {reach_of(0), reach_of(0)};
    for (uint32_t ring = RINGS_NONE; rings_next(&visit); ring = visit.ring) {
        if (visit.ring != ring)
            reach = reaches_of(t, sight_cell_reach(rings, visit.ring) + turned, l.place.adrift_rad);
        if (picture_told_m(scene->picture, visit.direction) < INFINITY)
            add(&l, visit.direction, &reach);
    }
    heed_band(&l, turned + (scene->frame->ned ? sight_tilt(scene->now->pose.attitude) : 0));
    sight_from_grid(scene->frame, scene->now, q->ned, found->at);
    sight_from_grid(scene->frame, scene->now, q->ned, found->hint_at);
}
