/* SPDX-License-Identifier: MIT */
#include "wedges.h"

#include <math.h>

#include "grid/geometry.h"

#define FAN_NS  500000000u /* pings of a fan farther apart are all kept */
#define ALIKE_M 0.02       /* ends of free water that differ by less are the same */

size_t wedges_bytes(void)
{
    return WEDGES_PINGS * sizeof(struct wedge_ping) + WEDGES_MAX * sizeof(struct wedge);
}

void wedges_init(struct wedges *w, void *memory)
{
    *w = (struct wedges){.ping = memory};
    w->wedge = (struct wedge *)(w->ping + WEDGES_PINGS);
}

void wedges_clear(struct wedges *w)
{
    w->first = w->end = w->wedge_end = 0;
}

static struct wedge_ping *ping_at(const struct wedges *w, uint32_t number)
{
    return &w->ping[number % WEDGES_PINGS];
}

void wedges_set_water(struct wedge *wedge, const struct beam_water *water)
{
    wedge->from_m = (float)water->from_m;
    wedge->to_m = (float)water->to_m;
    wedge->side_to_m = (float)water->side_to_m;
    wedge->edge_from_m = (float)water->edge_from_m;
    wedge->edge_to_m = (float)water->edge_to_m;
    wedge->nested = water->nested;
}

struct beam_water wedges_water(const struct wedge *w)
{
    return (struct beam_water){(double)w->from_m,      (double)w->to_m,      (double)w->side_to_m,
                               (double)w->edge_from_m, (double)w->edge_to_m, w->nested};
}

void wedges_begin(struct wedges *w, const struct wedge_ping *ping)
{
    if (w->end - w->first == WEDGES_PINGS)
        w->first++;
    struct wedge_ping *p = ping_at(w, w->end);
    *p = *ping;
    p->first = w->wedge_end;
    p->n = 0;
}

void wedges_add(struct wedges *w, const struct wedge *wedge)
{
    struct wedge_ping *p = ping_at(w, w->end);
    while (w->first != w->end && w->wedge_end - ping_at(w, w->first)->first >= WEDGES_MAX)
        w->first++;
    if (p->n == WEDGES_MAX)
        return;
    w->wedge[w->wedge_end++ % WEDGES_MAX] = *wedge;
    p->n++;
}

static bool is_near(const struct wedge_ping *a, const struct wedge_ping *b, double apart_m)
{
    double d2 = 0;
    for (int i = 0; i < 3; i++)
        d2 += (a->place_m[i] - b->place_m[i]) * (a->place_m[i] - b->place_m[i]);
    return d2 <= apart_m * apart_m;
}

/* Both are free all over, and no echo of the older ping is missing in the newer one, whose wedges are as many. */
static bool shows_its_echoes(const struct wedges *w, const struct wedge_ping *older,
                             const struct wedge_ping *newer)
{
    for (uint32_t i = 0; i < older->n; i++) {
        const struct wedge *was = wedges_of(w, older, i), *is = wedges_of(w, newer, i);
        if (was->kind != WEDGE_FREE || is->kind != WEDGE_FREE ||
            (was->ends_at_echo && is->to_m > was->to_m + ALIKE_M))
            return false;
    }
    return true;
}

/* A fan sends so often that the ping between two from nearly the same place says nothing more. */
static bool drops_middle(struct wedges *w, double apart_m)
{
    const struct wedge_ping *last = ping_at(w, w->end);
    if (last->n < 2 || w->end - w->first < 2)
        return false;
    const struct wedge_ping *before = ping_at(w, w->end - 2);
    struct wedge_ping *middle = ping_at(w, w->end - 1);
    if (before->sensor != last->sensor || middle->sensor != last->sensor || middle->n != last->n ||
        last->t_ns - before->t_ns > FAN_NS || !is_near(before, last, apart_m) ||
        !shows_its_echoes(w, middle, last))
        return false;
    const uint32_t to = middle->first;
    for (uint32_t i = 0; i < last->n; i++)
        w->wedge[(to + i) % WEDGES_MAX] = *wedges_of(w, last, i);
    *middle = *last;
    middle->first = to;
    w->wedge_end = to + last->n;
    return true;
}

void wedges_end(struct wedges *w, double apart_m)
{
    struct wedge_ping *last = ping_at(w, w->end);
    if (!last->n || drops_middle(w, apart_m))
        return;
    w->end++;
}

void wedges_forget(struct wedges *w, uint64_t t_ns)
{
    while (w->first != w->end && ping_at(w, w->first)->t_ns < t_ns)
        w->first++;
}

#define TOUCH_RAD 1e-5 /* rows that are no farther apart touch: their bearings are rounded */

/* The row of both, from middle_rad from the middle of a; b is off_rad from there. Where the two do not touch there is
 * none. */
static struct beam_row row_of_both(const struct beam_row *a, const struct beam_row *b, double off_rad,
                                   double middle_rad)
{
    const struct beam_row *l = off_rad < 0 ? b : a, *r = off_rad < 0 ? a : b;
    const double l_rad = fmin(off_rad, 0), r_rad = fmax(off_rad, 0);
    struct beam_row both = {.half_az_rad = fminf(a->half_az_rad, b->half_az_rad),
                            .half_el_rad = fminf(a->half_el_rad, b->half_el_rad),
                            .seam_rad = fmaxf(a->seam_rad, b->seam_rad),
                            .several = true};
    if (l_rad + (double)l->right_rad + TOUCH_RAD < r_rad - (double)r->left_rad)
        return both;
    both.left_rad = (float)(middle_rad - l_rad + (double)l->left_rad);
    both.right_rad = (float)(r_rad - middle_rad + (double)r->right_rad);
    return both;
}

bool wedges_join(struct wedge *a, const struct wedge *b, double widest_rad)
{
    const double off = geo_wrap_pi((double)b->az_rad - (double)a->az_rad), reach = a->half_az_rad + b->half_az_rad;
    if (a->kind != b->kind || a->el_rad != b->el_rad || fabs(off) > reach)
        return false;
    const double low = fmin(-a->half_az_rad, off - b->half_az_rad),
                 high = fmax(a->half_az_rad, off + b->half_az_rad);
    if (high - low > widest_rad)
        return false;
    a->row = row_of_both(&a->row, &b->row, off, (low + high) / 2);
    a->az_rad = (float)((double)a->az_rad + (low + high) / 2);
    a->half_az_rad = (float)((high - low) / 2);
    a->from_m = fmaxf(a->from_m, b->from_m);
    a->edge_from_m = fmaxf(a->edge_from_m, b->edge_from_m);
    a->side_to_m = fminf(a->side_to_m, b->side_to_m);
    a->edge_to_m = fminf(a->edge_to_m, b->edge_to_m);
    a->nested |= b->nested;
    if (b->to_m <= a->to_m) {
        a->ends_at_echo = b->ends_at_echo;
        a->to_m = b->to_m;
    }
    return true;
}
