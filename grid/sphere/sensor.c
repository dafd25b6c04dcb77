/* SPDX-License-Identifier: MIT */
#include "sensor.h"

#include <math.h>

#include "spread.h"

/*
 * Probability of an echo from an occupied and from an empty cell. That an occupied cell is heard only every other time
 * is said on purpose: a weak reflector that one of the beams over it hears must not be talked away by its neighbours
 * in the same sweep.
 */
#define ECHO_IF_OCCUPIED 0.5
#define ECHO_IF_EMPTY    0.1
/* A marked echo weighs so many times what blocking takes, but no more than another one: by itself it blocks for a
 * eighth of the time that the surest obstacle does, and with the default one look that hears nothing there takes it away. */
#define MARKED_BLOCKS   1.4
#define MIN_CARVE_SHARE 0.05

#define FLUSH_BELOW 1e-6 /* evidence this weak is none: it would fade into denormal numbers, which are slow */

/* A ping changed a cell. */
static void weigh(const struct sphere *s, struct cell *c, const struct echoes *ping, double change)
{
    double l = state_logodds(s, c, ping->t_ns) + change;
    l = fmax(-LOGODDS_MAX, fmin(l, LOGODDS_MAX));
    c->logodds = fabs(l) < FLUSH_BELOW ? 0 : (float)l;
    if (ping->t_ns > c->t_ref_ns)
        c->t_ref_ns = ping->t_ns;
    c->sensor = ping->sensor % SPHERE_SENSORS;
    c->seq = ping->seq;
}

#define GATE2 9.0 /* (3 standard deviations)^2 */
#define ALIKE                                                                                                     \
    (1.0 / 7.0) /* of an echo's variance: what all looks share, so that no number of them ends the doubt */

/*
 * The echo at z (from the anchor) moves the cell's point to the mean of the first eight echoes, later ones by 1/8, so
 * that it can follow; the ball shrinks alike. An echo outside the gate is another reflector: the nearer point, the nearer
 * edge and the larger doubt are kept and the ball reaches the other. The gate does not grow with the ball, or the
 * farther one would pull the point away.
 */
static void interpolate(const struct sphere *s, struct cell *c, const double z[3], double range_m,
                        const struct echo *echo, double m2)
{
    double v[3], d2 = 0, gain = 1, s2 = m2, depth_m = echo->range_m - echo->near_m, sd_m = echo->sd_m;
    for (int i = 0; i < 3; i++)
        d2 += (z[i] - c->point_m[i]) * (z[i] - c->point_m[i]);
    if (c->echoes && d2 <= GATE2 * 2 * m2) {
        gain = 1.0 / (c->echoes < 8 ? c->echoes + 1 : 8);
        s2 = fmax((1 - gain) * c->ball_m2, ALIKE * m2);
    } else if (c->echoes) {
        double point_m = state_vector(s, c, v), edge_m = fmin(point_m - c->near_m, range_m - depth_m);
        gain = range_m < point_m;
        s2 = fmax(c->ball_m2, d2 / GATE2);
        depth_m = fmin(point_m, range_m) - edge_m;
        sd_m = fmax(c->sd_m, sd_m);
    }
    for (int i = 0; i < 3; i++)
        c->point_m[i] += (float)(gain * (z[i] - c->point_m[i]));
    c->ball_m2 = (float)s2;
    c->near_m = (float)depth_m;
    c->sd_m = (float)sd_m;
}

/* Variance of an echo's point within a cell: of its range, and of where across the cell it is. */
static double echo_variance(const struct sphere *s, uint32_t d, double range_m, const struct echo *echo)
{
    double wide = range_m * fmax(s->direction[d].across_rad, s->rings.height_rad);
    return fmax((double)echo->sd_m * echo->sd_m, wide * wide / 12);
}

/* An echo `at` range_m along a direction raises the cell of a layer by `share` of its evidence. */
static void raise(struct sphere *s, uint32_t direction, uint16_t layer, double range_m, const struct beam *b,
                  const struct echo *echo, double share)
{
    struct cell *c = state_take(s, direction, layer);
    if (!c || c->state == CELL_LOCKED)
        return;
    double z[3];
    for (int i = 0; i < 3; i++)
        z[i] = range_m * s->axis[direction][i] + s->frame.centre_m[i] - s->anchor_m[i];
    interpolate(s, c, z, range_m, echo, echo_variance(s, direction, range_m, echo));
    if (!c->echoes)
        c->t_first_ms = state_ms(s, b->ping->t_ns);
    if (b->ping->t_ns > c->t_echo_ns)
        c->t_echo_ns = b->ping->t_ns;
    if (c->echoes < UINT16_MAX)
        c->echoes++;
    double strength = echo->confidence > 0 ? echo->confidence * share : 0;
    double weight = log1p(strength * (ECHO_IF_OCCUPIED / ECHO_IF_EMPTY - 1));
    if (echo->flags)
        weight = fmin(weight, MARKED_BLOCKS * s->blocked_logodds);
    if (s->conf.update == SPHERE_MAX)
        weight = fmax(0, weight - state_logodds(s, c, b->ping->t_ns));
    weigh(s, c, b->ping, weight);
    state_mark(s, direction);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool stretch_of(const struct sphere *s, uint32_t d, const struct beam *b, double near_m, double far_m,
                       struct stretch *out)
{
    return beam_stretch(b, s->axis[d], s->direction[d].across_rad, s->rings.height_rad, s->conf.level, near_m,
                        far_m, out);
}

/* What the beam heard of the water in direction d; a beam that says nothing takes back what older ones said. */
static void clear_direction(struct sphere *s, uint32_t d, const struct beam *b)
{
    struct direction *dir = &s->direction[d];
    const struct echoes *e = b->ping;
    const struct beam_echoes *h = b->heard;
    struct stretch st;
    bool claims = h->free_to_m > h->blind_m, first = !dir->claim[CLAIM_NOW].t_ping_ns;
    if (claims && stretch_of(s, d, b, h->blind_m, h->free_to_m, &st))
        claim_add(dir->claim, &st, e->t_ns, e->pose.path_m, e->sensor);
    else if (!claims && stretch_of(s, d, b, 0, e->range_max_m, &st))
        claim_withdraw(dir->claim, e->t_ns, e->pose.path_m, e->sensor);
    else
        return;
    s->stats.pinged += first;
    state_mark(s, d);
}

/* The layers within reach of the range get their shares, relative to the one that holds it. */
static void raise_layers(struct sphere *s, uint32_t d, double at, const struct beam *b, const struct echo *echo,
                         const struct spread *spread, double across)
{
    const double *edge = s->layers.edge;
    int32_t middle = layers_index(&s->layers, at);
    double most = spread_along(spread, edge[middle], edge[middle + 1], at), reach_m = spread->reach * spread->sd_m;
    int32_t i = middle;
    while (i > 0 && edge[i] > at - reach_m)
        i--;
    for (; i < (int32_t)s->layers.n && edge[i] < at + reach_m; i++) {
        double share = spread_along(spread, edge[i], edge[i + 1], at) / most;
        raise(s, d, (uint16_t)i, i == middle ? at : (edge[i] + edge[i + 1]) / 2, b, echo, across * fmin(share, 1));
    }
}

static void hit_direction(struct sphere *s, uint32_t d, const struct beam *b, const struct echo *echo)
{
    double place[3], off_az, off_el, at = beam_meet(b, s->axis[d], echo->range_m);
    if (at <= 0)
        return;
    for (int i = 0; i < 3; i++)
        place[i] = at * s->axis[d][i];
    bool opening = s->conf.model == SPHERE_OPENING;
    double reach = opening ? 1 : SPREAD_WIDEST, width = s->direction[d].width_rad, high = s->rings.height_rad;
    double most_az = reach * b->half_az + width / 2, most_el = reach * b->half_el + high / 2;
    if (!beam_sees(b, place, most_az, most_el, &off_az, &off_el) || fabs(off_az) > most_az ||
        fabs(off_el) > most_el)
        return;
    int32_t layer = layers_index(&s->layers, at);
    if (layer < 0) {
        s->stats.out_of_range++;
        return;
    }
    if (opening) {
        raise(s, d, (uint16_t)layer, at, b, echo, 1);
        return;
    }
    double across_rad = s->direction[d].across_rad, deep_m = s->layers.edge[layer + 1] - s->layers.edge[layer];
    struct spread spread = spread_of(fmax(echo->sd_m, s->conf.range_error * echo->range_m), b->half_az, b->half_el,
                                     deep_m, across_rad, high, s->conf.model == SPHERE_MIDPOINT);
    double across = spread_across(&spread, off_az, off_el, across_rad, high);
    if (across > 0)
        raise_layers(s, d, at, b, echo, &spread, across);
}

/* Nothing was heard in the water up to free_to_m: cells there lose by the share of them that the beam covered. */
static void carve_direction(struct sphere *s, uint32_t d, const struct beam *b)
{
    for (uint32_t i = s->cells.first[d], next; i != CELLS_NONE; i = next) {
        struct cell *c = &s->cells.cell[i];
        next = c->next;
        double place[3], off_az, off_el;
        state_vector(s, c, place);
        double range = beam_range(b, place);
        double thick = s->layers.edge[c->layer + 1] - s->layers.edge[c->layer];
        if (range - 2.0 * c->sd_m < b->heard->blind_m || range + 2.0 * c->sd_m + thick / 2 > b->heard->free_to_m)
            continue;
        double width = s->direction[d].width_rad, high = s->rings.height_rad;
        if (!beam_sees(b, place, b->half_az + width / 2, b->half_el + high / 2, &off_az, &off_el))
            continue;
        double share = beam_share(off_az, b->half_az, width) * beam_share(off_el, b->half_el, high);
        if (share < MIN_CARVE_SHARE || c->state == CELL_LOCKED)
            continue;
        weigh(s, c, b->ping, log((1 - ECHO_IF_OCCUPIED * share) / (1 - ECHO_IF_EMPTY * share)));
        state_mark(s, d);
        if (c->logodds <= 0)
            cells_lose(&s->cells, i);
    }
}

#define NEAREST_M 0.1 /* nothing is heard nearer: bounds the parallax */

void sensor_enter(struct sphere *s, const struct beam *b)
{
    const struct beam_echoes *h = b->heard;
    double az, el, cell = s->rings.height_rad + s->rings.step_rad;
    geo_angles(b->axis, &az, &el);
    bool claims = h->free_to_m > h->blind_m;
    struct beam_sieve near = beam_sieve(b, fmax(h->blind_m, NEAREST_M), cell);
    struct beam_sieve clear = b->lever_m > 0 ? near : beam_sieve(b, 1, cell); /* no lever, no parallax */
    struct beam wide = *b;                                                    /* what echoes are entered over */
    if (s->conf.model != SPHERE_OPENING) {
        wide.half_az *= SPREAD_WIDEST;
        wide.half_el *= SPREAD_WIDEST;
    }
    struct beam_sieve hit = beam_sieve(&wide, h->n ? h->echo[0].range_m : 1, cell);

    double radius = acos(h->n ? fmin(near.cos_axis, hit.cos_axis) : near.cos_axis);
    struct rings_visit v = rings_visit(&s->rings, az, el, fmin(radius, GEO_PI / 2));
    while (rings_next(&v)) {
        double along = dot(s->axis[v.direction], b->axis), aside = dot(s->axis[v.direction], b->side);
        if (claims && s->cells.first[v.direction] != CELLS_NONE && beam_sieve_passes(&near, along, aside))
            carve_direction(s, v.direction, b);
        if (beam_sieve_passes(&clear, along, aside))
            clear_direction(s, v.direction, b);
        if (h->n && beam_sieve_passes(&hit, along, aside))
            for (uint8_t i = 0; i < h->n; i++)
                hit_direction(s, v.direction, b, &h->echo[i]);
    }
}
