/* SPDX-License-Identifier: MIT */
#include "sides.h"

#include <math.h>
#include <string.h>

static uint64_t apart_ns(uint64_t a_ns, uint64_t b_ns)
{
    return a_ns > b_ns ? a_ns - b_ns : b_ns - a_ns;
}

/*
 * Both; the longer one, where between them is water that neither has. What is older than half of what is kept gives way
 * to what is new, or one look that reached far would count for ever.
 */
static void join(struct reach *side, const struct stretch *st, const struct side_look *look, uint64_t keep_ns)
{
    const struct reach fresh = {look->t_ns, (float)st->from_m, (float)fmin(st->to_m, look->most_m)};
    const bool far_apart = apart_ns(fresh.t_ns, side->t_ns) > keep_ns / 2;
    if (fresh.to_m <= fresh.from_m || (far_apart && fresh.t_ns < side->t_ns))
        return;
    if (far_apart || (fresh.t_ns >= side->t_ns && fresh.from_m <= side->from_m && fresh.to_m >= side->to_m))
        *side = fresh;
    else if (fresh.from_m <= side->to_m && side->from_m <= fresh.to_m)
        *side = (struct reach){fresh.t_ns < side->t_ns ? fresh.t_ns : side->t_ns,
                               fminf(side->from_m, fresh.from_m), fmaxf(side->to_m, fresh.to_m)};
    else if (fresh.to_m - fresh.from_m > side->to_m - side->from_m)
        *side = fresh;
}

#define EDGE                                                                                                      \
    1e-4 /* of a beam: a side of a cell that is its own but for rounding, of azimuths in float, is in it */

/* The beam's sides for the side of a cell. Whether its upper and lower end are in the beam is asked of the middle. */
static bool sides_for(const struct beam *b, const struct beam_cell *cell, struct beam_sides *out)
{
    if (!beam_sides(b, cell, out))
        return false;
    out->tan_az *= 1 + EDGE;
    out->tan_el = fmax(out->tan_el, b->opening->tan_high) * (1 + EDGE);
    return true;
}

void sides_see(struct sphere *s, uint32_t d, uint32_t ring, const struct side_look *look,
               const struct stretch *stretch)
{
    const uint64_t keep_ns = state_keep_ns(s);
    const struct beam *b = look->beam;
    struct beam_sides flat;
    if (!sides_for(b, &s->ring[ring], &flat))
        return;
    for (int k = 0; k < 2; k++) {
        struct reach *side = &s->direction[d].side[k];
        double u[3];
        struct stretch st;
        if (stretch->from_m >= (double)side->from_m && stretch->to_m <= (double)side->to_m &&
            apart_ns(look->t_ns, side->t_ns) <= keep_ns / 2)
            continue;
        beam_cell_side(&s->ring[ring], s->axis[d], 2 * k - 1, u);
        const struct beam_ray ray = beam_ray(b, u);
        const bool near = beam_has(b, &flat, &ray, stretch->from_m), far = beam_has(b, &flat, &ray, stretch->to_m);
        if (near && far)
            join(side, stretch, look, keep_ns);
        else if ((near || far) && beam_stretch(b, &s->ring[ring], &ray, look->near_m, look->far_m, &st))
            join(side, &st, look, keep_ns);
    }
}

void sides_end(struct direction *d, float to_m)
{
    for (int k = 0; k < 2; k++)
        d->side[k].to_m = fminf(d->side[k].to_m, to_m);
}

static bool holds(const struct free_interval *by, const struct free_interval *f)
{
    return by->t_ping_ns && f->from_m >= by->from_m && f->to_m <= by->to_m;
}

/* What is left of a direction's own side at t_ns. */
static struct free_interval own_side(const struct direction *dir, int side, uint64_t t_ns, uint64_t keep_ns)
{
    const struct reach *own = &dir->side[side];
    if (apart_ns(t_ns, own->t_ns) > keep_ns)
        return (struct free_interval){0};
    return (struct free_interval){
        .t_ping_ns = own->t_ns, .path_m = INFINITY, .from_m = own->from_m, .to_m = own->to_m};
}

/* Did the beams that freed the direction see this side of all its free water? */
static bool stands_alone(const struct direction *dir, const struct free_interval *own)
{
    for (int k = 0; k < FREE_INTERVALS; k++) {
        const struct free_interval *f = &dir->free[k];
        if (f->to_m > f->from_m && !holds(own, f))
            return false;
    }
    return true;
}

void sides_mark(struct sphere *s, uint64_t t_ns)
{
    const uint64_t keep_ns = state_keep_ns(s);
    const uint32_t n = s->n_dirty;
    for (uint32_t i = 0; i < n && n < s->rings.n; i++) {
        uint32_t beside[2];
        rings_beside(&s->rings, s->dirty[i], beside);
        for (int k = 0; k < 2; k++) {
            const struct direction *dir = &s->direction[beside[k]];
            const struct free_interval own = own_side(dir, 1 - k, t_ns, keep_ns);
            if (!stands_alone(dir, &own))
                state_mark(s, beside[k]);
        }
    }
}

/* The interval rests on other evidence as well; its time stays that of its middle. */
static void rest_on(struct free_interval *f, const struct free_interval *by)
{
    f->path_m = fmin(f->path_m, by->path_m);
    f->sensors |= by->sensors;
}

/* The longest part of the interval that the others (FREE_INTERVALS of the neighbour and the own side) have without a
 * gap. */
static void keep_seen(struct free_interval *f, const struct free_interval *others)
{
    struct free_interval part[FREE_INTERVALS + 1];
    if (f->to_m <= f->from_m)
        return;
    for (int i = FREE_INTERVALS; i >= 0; i--)
        if (holds(&others[i], f)) {
            rest_on(f, &others[i]);
            return;
        }
    memcpy(part, others, sizeof part);
    for (int i = 0; i <= FREE_INTERVALS; i++) {
        part[i].from_m = fmaxf(part[i].from_m, f->from_m);
        part[i].to_m = fminf(part[i].to_m, f->to_m);
    }
    const struct free_interval seen = free_longest(part, FREE_INTERVALS + 1);
    if (!seen.t_ping_ns) {
        f->to_m = -1; /* as of free_spend: its middle showed water all the same */
        return;
    }
    f->from_m = seen.from_m;
    f->to_m = seen.to_m;
    rest_on(f, &seen);
}

void sides_cut(const struct sphere *s, uint32_t d, uint64_t t_ns, struct free_interval *list)
{
    const struct direction *dir = &s->direction[d];
    const uint64_t keep_ns = state_keep_ns(s);
    for (int side = 0; side < 2; side++) {
        struct free_interval others[FREE_INTERVALS + 1];
        uint32_t beside[2];
        others[FREE_INTERVALS] = own_side(dir, side, t_ns, keep_ns);
        if (stands_alone(dir, &others[FREE_INTERVALS]))
            continue;
        rings_beside(&s->rings, d, beside);
        memcpy(others, s->direction[beside[side]].free, FREE_INTERVALS * sizeof *others);
        for (int i = 0; i < FREE_INTERVALS; i++)
            if (apart_ns(t_ns, others[i].t_ping_ns) > keep_ns)
                others[i] = (struct free_interval){0};
        for (int k = 0; k < FREE_INTERVALS; k++)
            keep_seen(&list[k], others);
    }
}
