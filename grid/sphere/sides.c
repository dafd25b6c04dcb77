/* SPDX-License-Identifier: MIT */
#include "sides.h"

#include <math.h>
#include <string.h>

static uint64_t apart_ns(uint64_t a_ns, uint64_t b_ns)
{
    return a_ns > b_ns ? a_ns - b_ns : b_ns - a_ns;
}

static bool holds(const struct free_interval *by, const struct free_interval *f)
{
    return by->t_ping_ns && f->from_m >= by->from_m && f->to_m <= by->to_m;
}

static bool is_held(const struct free_interval *f, const struct free_interval *side)
{
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (holds(&side[k], f))
            return true;
    return false;
}

/* The beam's sides for the side of a cell. Whether its upper and lower end are in the beam is asked of the middle. */
static bool sides_for(const struct beam *b, const struct beam_cell *cell, struct beam_sides *out)
{
    if (!beam_sides(b, cell, out))
        return false;
    out->tan_az *= 1 + BEAM_EDGE;
    out->tan_el = fmax(out->tan_el, b->opening->tan_high) * (1 + BEAM_EDGE);
    return true;
}

static bool look_along(const struct beam *b, const struct beam_cell *cell, const struct beam_ray *side,
                       const struct beam_water *water, struct stretch *out)
{
    const bool looks = beam_stretch(b, cell, side, water, out);
    if (looks)
        beam_stretch_aside(b, cell, side, water, out);
    return looks;
}

/* Where the beam has the side, left (0) or right, of the direction, whose middle it has along a stretch, or, NULL, not
 * at all. */
static bool stretch_of(const struct sphere *s, int side, const struct side_look *look,
                       const struct stretch *middle, struct stretch *out)
{
    const struct beam_cell *cell = &s->ring[look->ring];
    const struct beam *b = look->beam;
    struct beam_sides flat;
    double u[3];
    if (!sides_for(b, cell, &flat))
        return false;
    beam_cell_side(cell, s->axis[look->direction], 2 * side - 1, u);
    const struct beam_ray ray = beam_ray(b, u);
    if (!middle)
        return look_along(b, cell, &ray, look->water, out);
    const bool near = beam_has(b, &flat, &ray, middle->look_from_m),
               far = beam_has(b, &flat, &ray, middle->look_to_m);
    *out = *middle;
    if (near && far) {
        beam_stretch_aside(b, cell, &ray, look->water, out);
        return true;
    }
    if (!near && !far)
        return false;
    const bool any = look_along(b, cell, &ray, look->water, out);
    out->ends_at_echo = middle->ends_at_echo;
    return any;
}

/* Nothing new: the neighbour may be published already as far as this. */
static bool was_seen(const struct free_interval *side, const struct stretch *st, uint64_t t_ns, uint64_t keep_ns)
{
    const struct free_interval f = {.from_m = (float)st->from_m, .to_m = (float)st->to_m};
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (holds(&side[k], &f) && apart_ns(t_ns, side[k].t_ping_ns) <= keep_ns)
            return true;
    return false;
}

/* The newest look counts: it showed water up to where it ended itself. */
static void end_at(struct side_end *end, uint64_t t_ns, double to_m)
{
    if (t_ns > end->t_ns || (t_ns == end->t_ns && to_m < (double)end->to_m))
        *end = (struct side_end){t_ns, (float)to_m};
}

static bool ends_it(const struct stretch *st)
{
    return st->ends_at_echo && !st->leaves_aside;
}

static void end_side(struct sphere *s, int side, const struct side_look *look, const struct stretch *st)
{
    if (ends_it(st))
        end_at(&s->direction[look->direction].end[side], look->by.t_ns, st->look_to_m);
}

/* What of that side the beam frees, in *out, which no echo ends for others; false: nothing. Middles that the beam has
 * not are no concern of its echo. */
static bool look_aside(struct sphere *s, int side, const struct side_look *look, const struct stretch *middle,
                       struct stretch *out)
{
    if (!stretch_of(s, side, look, middle, out))
        return false;
    end_side(s, side, look, out);
    out->ends_at_echo = false;
    return out->to_m > out->from_m;
}

/* The same ping, and where another neighbour had it is as much as this one: most sides of cells lie within a beam. */
static bool is_told(const struct free_interval *side, const struct stretch *st, uint64_t t_ns)
{
    return st && side[0].t_ping_ns == t_ns && (float)st->from_m >= side[0].from_m &&
           (float)st->to_m <= side[0].to_m;
}

void sides_see(struct sphere *s, const struct side_look *look, const struct stretch *stretch)
{
    const uint32_t d = look->direction;
    const uint64_t keep_ns = state_keep_ns(s), t_ns = look->by.t_ns;
    struct stretch st;
    for (int side = 0; side < 2; side++) {
        const uint32_t beside = rings_aside(&s->rings, look->ring, d, side);
        struct free_interval *seen = s->direction[side ? d : beside].side;
        if (is_told(seen, stretch, t_ns)) {
            end_side(s, side, look, stretch);
            continue;
        }
        if (!look_aside(s, side, look, stretch, &st))
            continue;
        if (!was_seen(seen, &st, t_ns, keep_ns)) {
            state_mark(s, d);
            state_mark(s, beside);
        }
        free_add(seen, &st, &look->by);
    }
}

/* Have newer looks said all of a side that this one can add? */
static bool adds_nothing(const struct free_interval *side, const struct side_end *end, const struct stretch *st,
                         uint64_t t_ns)
{
    const struct free_interval f = {.from_m = (float)st->from_m, .to_m = (float)st->to_m};
    return is_held(&f, side) && (!ends_it(st) || end->t_ns > t_ns);
}

void sides_fill(struct sphere *s, const struct side_look *look, const struct stretch *stretch)
{
    const uint32_t d = look->direction;
    struct stretch st;
    for (int side = 0; side < 2; side++) {
        float no_limit_m = INFINITY;
        struct free_interval *seen = s->direction[side ? d : rings_aside(&s->rings, look->ring, d, 0)].side;
        if (stretch && adds_nothing(seen, &s->direction[d].end[side], stretch, look->by.t_ns))
            continue;
        if (look_aside(s, side, look, stretch, &st))
            free_fill(seen, &st, &look->by, &no_limit_m);
    }
}

void sides_withdraw(struct sphere *s, uint32_t d, uint64_t t_ns)
{
    for (int side = 0; side < 2; side++)
        end_at(&s->direction[d].end[side], t_ns, 0);
}

#define SAME_NS                                                                                                   \
    500000000u /* nothing moves in that time: of two beams one of which has an echo it is not in the other */

/* What was seen of both sides of a direction by some time. */
struct seen {
    struct free_interval side[2][FREE_INTERVALS];
};

static void look_at(const struct sphere *s, uint32_t d, uint64_t t_ns, uint64_t keep_ns, struct seen *seen)
{
    uint32_t beside[2];
    rings_beside(&s->rings, d, beside);
    memcpy(seen->side[0], s->direction[beside[0]].side, sizeof seen->side[0]);
    memcpy(seen->side[1], s->direction[d].side, sizeof seen->side[1]);
    for (int side = 0; side < 2; side++) {
        const struct side_end *end = &s->direction[d].end[side];
        for (int k = 0; k < FREE_INTERVALS; k++) {
            struct free_interval *f = &seen->side[side][k];
            if (apart_ns(t_ns, f->t_ping_ns) > keep_ns)
                *f = (struct free_interval){0};
            else if (f->t_ping_ns + SAME_NS <= end->t_ns)
                f->to_m = fminf(f->to_m, end->to_m);
        }
    }
}

static bool has_water(const struct free_interval *list)
{
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (list[k].to_m > list[k].from_m)
            return true;
    return false;
}

/* Is all of the direction's free water seen at both sides at once? */
static bool is_whole(const struct direction *dir, const struct seen *seen)
{
    for (int k = 0; k < FREE_INTERVALS; k++) {
        const struct free_interval *f = &dir->free[k];
        if (f->to_m > f->from_m && !(is_held(f, seen->side[0]) && is_held(f, seen->side[1])))
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
            struct seen seen;
            if (s->direction[beside[k]].dirty || !has_water(s->direction[beside[k]].free))
                continue;
            look_at(s, beside[k], t_ns, keep_ns, &seen);
            if (!is_whole(&s->direction[beside[k]], &seen))
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

/* The longest part of the interval that was seen of a side (FREE_INTERVALS) without a gap. */
static void keep_seen(struct free_interval *f, const struct free_interval *side)
{
    struct free_interval part[FREE_INTERVALS];
    if (f->to_m <= f->from_m)
        return;
    for (int i = 0; i < FREE_INTERVALS; i++)
        if (holds(&side[i], f)) {
            rest_on(f, &side[i]);
            return;
        }
    memcpy(part, side, sizeof part);
    for (int i = 0; i < FREE_INTERVALS; i++) {
        part[i].from_m = fmaxf(part[i].from_m, f->from_m);
        part[i].to_m = fminf(part[i].to_m, f->to_m);
    }
    const struct free_interval longest = free_longest(part, FREE_INTERVALS);
    if (!longest.t_ping_ns) {
        f->to_m = -1; /* as of free_spend: its middle showed water all the same */
        return;
    }
    f->from_m = longest.from_m;
    f->to_m = longest.to_m;
    rest_on(f, &longest);
}

void sides_cut(const struct sphere *s, uint32_t d, uint64_t t_ns, struct free_interval *list)
{
    struct seen seen;
    if (!has_water(list))
        return;
    look_at(s, d, t_ns, state_keep_ns(s), &seen);
    for (int side = 0; side < 2; side++)
        for (int k = 0; k < FREE_INTERVALS; k++)
            keep_seen(&list[k], seen.side[side]);
}
