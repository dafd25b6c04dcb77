/* SPDX-License-Identifier: MIT */
#include "claim.h"

#include <math.h>

#include "../geometry.h"

static struct claim claim_of(const struct stretch *s, uint64_t t_ns, double path_m, uint32_t sensor)
{
    return (struct claim){.t_ping_ns = t_ns,
                          .path_m = path_m,
                          .from_m = (float)s->from_m,
                          .to_m = (float)s->to_m,
                          .sensors = 1ull << (sensor % 64)};
}

void claim_withdraw(struct claim *claims, uint64_t t_ns, double path_m, uint32_t sensor)
{
    claims[CLAIM_NOW] = claim_of(&(struct stretch){0}, t_ns, path_m, sensor);
    claims[CLAIM_BEFORE] = (struct claim){0};
}

/* An end that the beam itself has (ring-down, echo, end of what was heard) holds against everything older. */
static void cut(struct claim *c, const struct stretch *s)
{
    if (!s->enters_aside)
        c->from_m = fmaxf(c->from_m, (float)s->from_m);
    if (!s->leaves_aside)
        c->to_m = fminf(c->to_m, (float)s->to_m);
}

void claim_add(struct claim *claims, const struct stretch *s, uint64_t t_ns, double path_m, uint32_t sensor)
{
    struct claim *now = &claims[CLAIM_NOW], *before = &claims[CLAIM_BEFORE];
    struct claim fresh = claim_of(s, t_ns, path_m, sensor);
    if (!s->enters_aside && !s->leaves_aside) {
        *now = fresh;
        *before = (struct claim){0};
        return;
    }
    bool own_turn = now->t_ping_ns && t_ns >= now->t_ping_ns && t_ns - now->t_ping_ns <= CLAIM_CHAIN_NS;
    if (!own_turn) {
        *before = *now;
        *now = (struct claim){0};
    }
    cut(now, s);
    cut(before, s);
    *now = claim_join(now, &fresh);
}

static bool holds(const struct claim *c)
{
    return c->t_ping_ns && c->to_m > c->from_m;
}

struct claim claim_join(const struct claim *a, const struct claim *b)
{
    if (!holds(a))
        return b->t_ping_ns ? *b : *a;
    if (!holds(b))
        return *a;
    if (a->from_m > b->to_m || b->from_m > a->to_m)
        return a->to_m - a->from_m >= b->to_m - b->from_m ? *a : *b;
    return (struct claim){.t_ping_ns = a->t_ping_ns < b->t_ping_ns ? a->t_ping_ns : b->t_ping_ns,
                          .path_m = fmin(a->path_m, b->path_m),
                          .from_m = fminf(a->from_m, b->from_m),
                          .to_m = fmaxf(a->to_m, b->to_m),
                          .sensors = a->sensors | b->sensors};
}

struct claim claim_meet(const struct claim *a, const struct claim *b)
{
    if (!a->t_ping_ns || !b->t_ping_ns)
        return (struct claim){0};
    const float from_m = fmaxf(a->from_m, b->from_m), to_m = fminf(a->to_m, b->to_m);
    return (struct claim){.t_ping_ns = a->t_ping_ns < b->t_ping_ns ? a->t_ping_ns : b->t_ping_ns,
                          .path_m = fmin(a->path_m, b->path_m),
                          .from_m = to_m > from_m ? from_m : 0,
                          .to_m = to_m > from_m ? to_m : 0,
                          .sensors = a->sensors | b->sensors};
}

/* A ray of the new centre, among the claims of the directions of the old one. */
struct ray {
    const struct rings *rings;
    const struct claim *old;
    const double *step_m, *axis;
    double along, across; /* the step's parts */
};

/* Does the old claim of the direction in which the place lies free it? Joined to *c when it does. */
static bool frees_place(const struct ray *ray, const double place_m[3], struct claim *c)
{
    const double old_m = geo_length(place_m);
    const uint32_t d = old_m > 0 ? rings_holding(ray->rings, place_m) : RINGS_NONE;
    if (d == RINGS_NONE)
        return false;
    const struct claim *old = &ray->old[d];
    if (!holds(old) || old_m < old->from_m || old_m > old->to_m)
        return false;
    c->t_ping_ns = old->t_ping_ns < c->t_ping_ns ? old->t_ping_ns : c->t_ping_ns;
    c->path_m = old->path_m < c->path_m ? old->path_m : c->path_m;
    c->sensors |= old->sensors;
    return true;
}

/* The same of this range of the ray. */
static bool frees(const struct ray *ray, double range_m, struct claim *c)
{
    double place_m[3];
    for (int i = 0; i < 3; i++)
        place_m[i] = ray->step_m[i] + range_m * ray->axis[i];
    return frees_place(ray, place_m, c);
}

/*
 * The same of the place half a cell nearer to the way. Each step brings a ray nearer to it by less than a cell, which the
 * direction does not show: without this the rays beside water in which nobody looked would soon claim it.
 */
static bool frees_nearer_way(const struct ray *ray, double range_m, struct claim *c)
{
    const double step = geo_length(ray->step_m), t = ray->rings->tan_half;
    double along = 0, way[3], off[3], place_m[3];
    for (int i = 0; i < 3; i++) {
        way[i] = ray->step_m[i] / step;
        place_m[i] = ray->step_m[i] + range_m * ray->axis[i];
        along += place_m[i] * way[i];
    }
    for (int i = 0; i < 3; i++)
        off[i] = place_m[i] - along * way[i];
    const double across = geo_length(off), turned = fmin(across, along * t);
    for (int i = 0; i < 3; i++)
        place_m[i] = (along + turned * t) * way[i] + (across > 0 ? (across - turned) / across * off[i] : 0);
    return frees_place(ray, place_m, c);
}

/*
 * The ray at range `near` past the old centre, which lies `across` beside it and `along` behind its beginning, is seen from
 * there so far off its own direction that the tangent is across / (near + along). Turned on by half a cell, it is at this range:
 */
static double inward(const struct ray *ray, double near)
{
    const double ahead = fmax(near + ray->along, 1e-9), t = ray->rings->tan_half, across = ray->across;
    if (!(across > 0 && across < (GEO_PI / 2 - ray->rings->height_rad / 2) * ahead))
        return 0;
    const double turned = across * (ahead - across * t) / (across + ahead * t) - ray->along;
    return turned < near * 0.9
               ? turned
               : near * 0.9; /* along a ray that stays in its direction the step is in range alone */
}

#define INWARD_MOST 200 /* steps: bounds the work near the centre */

/*
 * A ray ahead stays in its direction nearly to the centre, and what the last step inward loses would be all of its claim:
 * there that step is halved so often. Places on it lie nearer to the way than the direction that they are taken over from;
 * where the water half a cell nearer to it is free, too, they were looked at on both sides. Aside and astern the last step
 * stays lost, on purpose: a place counts as in a direction when it is half a cell off, which adds up with the steps of the
 * centre.
 */
#define HALVINGS    7
#define AHEAD_SHARE 0.2 /* across, of the way along: 11 degrees */

/* The last step: from_m is free, lost_m is not. How far inward it is free. */
static double halve(const struct ray *ray, double from_m, double lost_m, struct claim *c)
{
    for (int k = 0; k < HALVINGS; k++) {
        const double middle_m = (from_m + lost_m) / 2;
        if (frees(ray, middle_m, c) && frees_nearer_way(ray, middle_m, c))
            from_m = middle_m;
        else
            lost_m = middle_m;
    }
    return from_m;
}

struct claim claim_moved(const struct rings *rings, const double (*axis)[3], const struct claim *old, uint32_t d,
                         const double step_m[3])
{
    struct claim c = old[d];
    const double *u = axis[d];
    if (!holds(&c))
        return c;
    struct ray ray = {.rings = rings,
                      .old = old,
                      .step_m = step_m,
                      .axis = u,
                      .along = step_m[0] * u[0] + step_m[1] * u[1] + step_m[2] * u[2]};
    const double step2 = step_m[0] * step_m[0] + step_m[1] * step_m[1] + step_m[2] * step_m[2];
    ray.across = sqrt(fmax(0, step2 - ray.along * ray.along));
    const double to = c.to_m - fabs(ray.along) - ray.across;
    double from = to, near = to;
    /* each step inward turns the old direction by half a cell; the last one that is free ends the claim */
    for (int k = 0; k < INWARD_MOST && near > 0 && frees(&ray, near, &c); k++) {
        from = near;
        near = inward(&ray, near);
    }
    if (near >= to) {
        c.from_m = c.to_m = 0;
        return c;
    }
    if (ray.along > 0 && ray.across <= AHEAD_SHARE * ray.along)
        from = fmin(from, halve(&ray, from, fmax(0, near), &c) + ray.across);
    c.from_m = (float)from;
    c.to_m = (float)to;
    return c;
}
