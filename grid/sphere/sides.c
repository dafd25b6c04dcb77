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
static void join(struct reach *side, const struct stretch *st, uint64_t t_ns, uint64_t keep_ns)
{
    const struct reach fresh = {t_ns, (float)st->from_m, (float)st->to_m};
    const bool far_apart = apart_ns(t_ns, side->t_ns) > keep_ns / 2;
    if (far_apart && t_ns < side->t_ns)
        return;
    if (far_apart)
        *side = fresh;
    else if (fresh.from_m <= side->to_m && side->from_m <= fresh.to_m)
        *side = (struct reach){t_ns < side->t_ns ? t_ns : side->t_ns, fminf(side->from_m, fresh.from_m),
                               fmaxf(side->to_m, fresh.to_m)};
    else if (fresh.to_m - fresh.from_m > side->to_m - side->from_m)
        *side = fresh;
}

void sides_see(struct sphere *s, uint32_t d, uint32_t ring, const struct side_look *look,
               const struct stretch *stretch)
{
    const uint64_t keep_ns = state_keep_ns(s);
    const struct beam *b = look->beam;
    struct beam_sides flat;
    if (!beam_sides(b, &s->ring[ring], &flat))
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
            join(side, stretch, look->t_ns, keep_ns);
        else if ((near || far) && beam_stretch(b, &s->ring[ring], &ray, look->near_m, look->far_m, &st))
            join(side, &st, look->t_ns, keep_ns);
    }
}

void sides_forget(struct direction *d)
{
    free_none(d->free);
    d->side[0] = d->side[1] = (struct reach){0};
}

static bool holds(float from_m, float to_m, const struct free_interval *f)
{
    return f->to_m <= f->from_m || (f->from_m >= from_m && f->to_m <= to_m);
}

/* What is left of a side at t_ns. */
static struct reach side_at(const struct sphere *s, const struct direction *dir, int side, uint64_t t_ns)
{
    const struct reach *own = &dir->side[side];
    return apart_ns(t_ns, own->t_ns) <= state_keep_ns(s) ? *own : (struct reach){0};
}

/* Did the beams that freed the direction see this side of all its free water? */
static bool stands_alone(const struct direction *dir, const struct reach *own)
{
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (!holds(own->from_m, own->to_m, &dir->free[k]))
            return false;
    return true;
}

void sides_mark(struct sphere *s, uint64_t t_ns)
{
    const uint32_t n = s->n_dirty;
    for (uint32_t i = 0; i < n && n < s->rings.n; i++) {
        uint32_t beside[2];
        rings_beside(&s->rings, s->dirty[i], beside);
        for (int k = 0; k < 2; k++) {
            const struct direction *dir = &s->direction[beside[k]];
            const struct reach own = side_at(s, dir, 1 - k, t_ns);
            if (!stands_alone(dir, &own))
                state_mark(s, beside[k]);
        }
    }
}

/* The longest part of the interval that the neighbour and the own side together have without a gap. */
static void keep_seen(struct free_interval *f, const struct free_interval *beside, const struct reach *own)
{
    struct free_interval part[FREE_INTERVALS + 1];
    bool whole = holds(own->from_m, own->to_m, f);
    for (int i = 0; i < FREE_INTERVALS && !whole; i++)
        whole = holds(beside[i].from_m, beside[i].to_m, f);
    if (whole)
        return;
    memcpy(part, beside, FREE_INTERVALS * sizeof *part);
    part[FREE_INTERVALS] = (struct free_interval){.t_ping_ns = 1, .from_m = own->from_m, .to_m = own->to_m};
    for (int i = 0; i <= FREE_INTERVALS; i++) {
        part[i].from_m = fmaxf(part[i].from_m, f->from_m);
        part[i].to_m = fminf(part[i].to_m, f->to_m);
    }
    const struct free_interval seen = free_longest(part, FREE_INTERVALS + 1);
    f->from_m = seen.t_ping_ns ? seen.from_m : f->from_m;
    f->to_m = seen.t_ping_ns ? seen.to_m : -1; /* as of free_spend: its middle showed water all the same */
}

void sides_cut(const struct sphere *s, uint32_t d, uint64_t t_ns, struct free_interval *list)
{
    const struct direction *dir = &s->direction[d];
    for (int side = 0; side < 2; side++) {
        const struct reach own = side_at(s, dir, side, t_ns);
        uint32_t beside[2];
        if (stands_alone(dir, &own))
            continue;
        rings_beside(&s->rings, d, beside);
        for (int k = 0; k < FREE_INTERVALS; k++)
            keep_seen(&list[k], s->direction[beside[side]].free, &own);
    }
}
