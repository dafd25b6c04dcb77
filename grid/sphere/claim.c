/* SPDX-License-Identifier: MIT */
#include "claim.h"

#include <math.h>
#include <stddef.h>

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

/* A ray from the new centre, among the claims of the old one. */
struct ray {
    const struct rings *rings;
    const struct claim *old;
    const double (*axis)[3];
    const double *u, *step_m;
    double along_m, across_m; /* the step along the ray and across it */
};

static void place_at(const struct ray *ray, double range_m, double place[3])
{
    for (int i = 0; i < 3; i++)
        place[i] = ray->step_m[i] + range_m * ray->u[i];
}

/* The old direction in which the ray is at range_m. */
static uint32_t direction_at(const struct ray *ray, double range_m)
{
    double place[3];
    place_at(ray, range_m, place);
    return rings_holding(ray->rings, place);
}

/* Where the ray is so far from the old centre, past the place where it is nearest to that; negative: nowhere. */
static double at_old_range(const struct ray *ray, double range_m)
{
    const double left2 = range_m * range_m - ray->across_m * ray->across_m;
    return left2 < 0 ? -1 : sqrt(left2) - ray->along_m;
}

#define HALVINGS 7

/* Between two places of the ray in different old directions, d the farther one's: where it comes into that. */
static double edge_of(const struct ray *ray, uint32_t d, double near, double far)
{
    for (int i = 0; i < HALVINGS; i++) {
        const double middle = (near + far) / 2;
        if (direction_at(ray, middle) == d)
            far = middle;
        else
            near = middle;
    }
    return far;
}

/* From where on the directions above and below the place are free, as far as the place; INFINITY: one is not. */
static double both_from_m(const struct ray *ray, const double place[3], double range_m)
{
    const double level = fmax(hypot(place[0], place[1]), 1e-9), up = 2 * ray->rings->tan_half;
    double from_m = 0;
    for (int side = -1; side <= 1; side += 2) {
        const double less = 1 - side * up * place[2] / level,
                     v[3] = {place[0] * less, place[1] * less, place[2] + side * up * level};
        const uint32_t d = rings_holding(ray->rings, v);
        const bool free = d != RINGS_NONE && holds(&ray->old[d]) && ray->old[d].to_m >= range_m;
        from_m = fmax(from_m, free ? ray->old[d].from_m : INFINITY);
    }
    return from_m;
}

/*
 * A claim speaks of the middle of its direction. A place above that or below may come into the beam later, through its
 * lower or upper side, to which the middle is at least half the height of a direction aslant: only whole directions are
 * freed. Where those above and below are free as well no side is near.
 */
static double from_at(const struct ray *ray, uint32_t d, double near)
{
    const double from_m = ray->old[d].from_m;
    double place[3];
    place_at(ray, fmax(near, at_old_range(ray, from_m)), place);
    const double range = sqrt(place[0] * place[0] + place[1] * place[1] + place[2] * place[2]);
    double aslant_m = from_m + fabs(place[2] - range * ray->axis[d][2]) / ray->rings->tan_half;
    if (aslant_m > range)
        aslant_m = fmax(from_m, fmin(aslant_m, both_from_m(ray, place, range)));
    return fmax(near, at_old_range(ray, aslant_m));
}

/* The stretches of the ray that were found free, from far to near: the one at hand, and the longest. */
struct found {
    struct claim run, best;
};

static float length(const struct claim *c)
{
    return c->to_m - c->from_m;
}

/* Between these ranges the ray lies in the old direction d. */
static void add(const struct ray *ray, uint32_t d, double near, double far, struct found *f)
{
    if (d == RINGS_NONE || !holds(&ray->old[d]))
        return;
    const struct claim *c = &ray->old[d];
    const float to_m = (float)fmin(far, at_old_range(ray, c->to_m)), from_m = (float)from_at(ray, d, near);
    if (from_m >= to_m)
        return;
    if (to_m < f->run.from_m) {
        f->run = *c;
        f->run.to_m = to_m;
    }
    f->run.t_ping_ns = c->t_ping_ns < f->run.t_ping_ns ? c->t_ping_ns : f->run.t_ping_ns;
    f->run.path_m = fmin(c->path_m, f->run.path_m);
    f->run.sensors |= c->sensors;
    f->run.from_m = from_m;
    if (length(&f->run) > length(&f->best))
        f->best = f->run;
}

/*
 * The ray at range `near` past the old centre, which lies `across` beside it and `along` behind its beginning, is seen from
 * there so far off its own direction that the tangent is across / (near + along). Turned on by half a cell, it is at this range:
 */
static double inward(const struct rings *rings, double near, double along, double across)
{
    const double ahead = fmax(near + along, 1e-9), t = rings->tan_half;
    if (!(across > 0 && across < (GEO_PI / 2 - rings->height_rad / 2) * ahead))
        return 0;
    const double turned = across * (ahead - across * t) / (across + ahead * t) - along;
    return turned < near * 0.9
               ? turned
               : near * 0.9; /* along a ray that stays in its direction the step is in range alone */
}

#define INWARD_MOST 200 /* steps: bounds the work near the centre */

struct claim claim_moved(const struct rings *rings, const double (*axis)[3], const struct claim *old, uint32_t d,
                         const double step_m[3])
{
    struct claim none = old[d];
    const double *u = axis[d];
    if (!holds(&none))
        return none;
    const double along = step_m[0] * u[0] + step_m[1] * u[1] + step_m[2] * u[2];
    const double step2 = step_m[0] * step_m[0] + step_m[1] * step_m[1] + step_m[2] * step_m[2];
    const struct ray ray = {rings, old, axis, u, step_m, along, sqrt(fmax(0, step2 - along * along))};
    /* far off, many steps across may leave it in its direction */
    double far = at_old_range(&ray, none.to_m) - ray.across_m;
    uint32_t there = direction_at(&ray, far);
    none.from_m = none.to_m = (float)fmax(far, 0);
    struct found f = {.run = none, .best = none};
    /* each step inward turns the old direction by half a cell */
    for (int k = 0; k < INWARD_MOST && far > 0; k++) {
        const double near = inward(rings, far, along, ray.across_m);
        const uint32_t here = direction_at(&ray, near);
        const double edge = here == there ? near : edge_of(&ray, there, near, far);
        add(&ray, there, edge, far, &f);
        if (here != there)
            add(&ray, here, near, edge, &f);
        far = near;
        there = here;
    }
    return f.best;
}
