/* SPDX-License-Identifier: MIT */
#include "sensor.h"

#include <math.h>
#include <string.h>

#include "spread.h"

/*
 * Probability of an echo from an occupied and from an empty cell. That an occupied cell echoes only every other time
 * is said on purpose: a weak reflector that one of the beams over it hears must not be talked away by its neighbours
 * in the same sweep.
 */
#define ECHO_IF_OCCUPIED 0.5
#define ECHO_IF_EMPTY    0.1
/* A burst or ghost weighs so many times what blocking takes, but no more than another echo: it lasts for an eighth of
 * the time that the surest obstacle does, and with the default one beam that finds nothing there removes it. */
#define MARKED_BLOCKS   1.4
#define MIN_CARVE_SHARE 0.05
#define NEAREST_M       0.1 /* no echo is nearer: bounds the parallax */

#define FLUSH_BELOW 1e-6 /* evidence this weak is none: it would fade into denormal numbers, which are slow */

/* A ping changed a cell. */
static void weigh(const struct sphere *s, struct cell *c, const struct echoes *ping, double change)
{
    double l = state_logodds(s, c, ping->t_ns) + change;
    l = fmax(-LOGODDS_MAX, fmin(l, LOGODDS_MAX));
    c->logodds = fabs(l) < FLUSH_BELOW ? 0 : (float)l;
    if (ping->t_ns > c->t_ref_ns)
        c->t_ref_ns = ping->t_ns;
    c->sensor = ping->sensor & (SPHERE_SENSORS - 1u);
    c->seq = ping->seq;
}

#define GATE2 9.0 /* (3 standard deviations)^2 */
#define ALIKE                                                                                                     \
    (1.0 / 7.0) /* of an echo's variance: what all looks share, so that no number of them ends the doubt */

/*
 * The echo at z (from the anchor) moves the cell's point to the mean of the first eight echoes, later ones by 1/8, so
 * that it can follow; the ball shrinks alike. An echo outside the gate is another reflector: the nearer point, the
 * nearer edge and the larger doubt are kept and the ball reaches the other. The gate does not grow with the ball, or
 * the farther one would pull the point away.
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
static double echo_variance(const struct sphere *s, uint32_t ring, double range_m, const struct echo *echo)
{
    double wide = range_m * fmax(s->ring[ring].across_rad, s->rings.height_rad);
    return fmax((double)echo->sd_m * echo->sd_m, wide * wide / 12);
}

/* What `share` of an echo adds to a cell. */
static double weight_of(const struct sphere *s, const struct echo *echo, double share)
{
    double strength = echo->confidence > 0 ? echo->confidence * share : 0;
    double weight = log1p(strength * (ECHO_IF_OCCUPIED / ECHO_IF_EMPTY - 1));
    return echo->flags & (ECHO_BURST | ECHO_GHOST) ? fmin(weight, MARKED_BLOCKS * s->blocked_logodds) : weight;
}

/* The beam that is being entered, and what is the same for all directions that it may concern. */
struct look {
    const struct beam *beam;        /* as it surely was, wherever its pose may be within its blur, ... */
    const struct beam *hits;        /* ... and all that it may have been, where its echoes are entered */
    struct pose_blur blur;          /* of the beam; all directions counted in both */
    double weight[ECHOES_PER_BEAM]; /* of each echo in full */
    double beyond_m;                /* no layer from here on can hold a point in free water */
    uint32_t direction, ring;       /* that is looked at ... */
    struct beam_ray ray;            /* ... through its middle */
};

/* An echo that the next turn does not confirm blocks for no longer than this many turns, or that time. */
#define UNCONFIRMED_TURNS 1.5
#define UNCONFIRMED_S     5.0

/* The most that the first echo of a cell weighs: it has faded to what blocks no more by the time that the head
 * has passed again. */
static double unconfirmed_weight(const struct sphere *s)
{
    if (s->frame.turn_s <= 0)
        return LOGODDS_MAX;
    return s->blocked_logodds * exp(fmax(UNCONFIRMED_S, UNCONFIRMED_TURNS * s->frame.turn_s) / s->fade_s);
}

/* Another sonar's pulse may come when one has come before, but hardly a third time in the same place. */
static bool waits_for_third(const struct cell *c, const struct echo *echo)
{
    return (echo->flags & ECHO_OTHER) && c->echoes <= 2;
}

/* An echo `at` range_m along the direction raises the cell of a layer by `weight`. */
static void raise(struct sphere *s, const struct look *l, uint16_t layer, double range_m, const struct echo *echo,
                  double weight)
{
    const struct echoes *ping = l->beam->ping;
    struct cell *c = state_take(s, l->direction, layer);
    if (!c || c->state == CELL_LOCKED)
        return;
    const bool same_beam = ping->n_beams == 1 && c->seq == ping->seq && c->sensor == ping->sensor;
    double z[3];
    for (int i = 0; i < 3; i++)
        z[i] = range_m * s->axis[l->direction][i] + s->frame.centre_m[i] - s->anchor_m[i];
    interpolate(s, c, z, range_m, echo, echo_variance(s, l->ring, range_m, echo));
    c->near_m += (float)(ping->pose.uncertain_m + l->blur.along_m + s->ahead_m);
    if (!c->echoes)
        c->t_first_ms = state_ms(s, ping->t_ns);
    if (ping->t_ns > c->t_echo_ns)
        c->t_echo_ns = ping->t_ns;
    c->misses = 0;
    if (c->echoes < UINT16_MAX)
        c->echoes++;
    c->pending = (echo->flags & ECHO_UNCONFIRMED) &&
                 (c->echoes == 1 || (c->pending && (same_beam || waits_for_third(c, echo))));
    if (c->echoes == 1)
        weight = fmin(weight, unconfirmed_weight(s));
    if (s->conf.update == SPHERE_MAX)
        weight = fmax(0, weight - state_logodds(s, c, ping->t_ns));
    weigh(s, c, ping, weight);
    state_mark(s, l->direction);
}

/* The layers within reach of the range get their shares, relative to the one that holds it. */
static void raise_layers(struct sphere *s, const struct look *l, double at, const struct echo *echo,
                         const struct spread *spread, double across)
{
    const double *edge = s->layers.edge;
    int32_t middle = layers_index(&s->layers, at);
    double most = spread_along(spread, edge[middle], edge[middle + 1], at), reach_m = spread->reach * spread->sd_m;
    int32_t i = middle;
    while (i > 0 && edge[i] > at - reach_m)
        i--;
    for (; i < (int32_t)s->layers.n && edge[i] < at + reach_m; i++) {
        double share = across * fmin(spread_along(spread, edge[i], edge[i + 1], at) / most, 1);
        raise(s, l, (uint16_t)i, i == middle ? at : (edge[i] + edge[i + 1]) / 2, echo, weight_of(s, echo, share));
    }
}

/*
 * The echo, at this place along the direction, is shared out as eq. (1) has it. What the opening touches is never left
 * out: with no weight at all its water is unknown, not clear.
 */
static void spread_echo(struct sphere *s, const struct look *l, const double place[3], double at, int32_t layer,
                        const struct echo *echo)
{
    const struct beam *b = l->hits;
    const struct beam_cell *cell = &s->ring[l->ring];
    const double *u = s->axis[l->direction], half_az = b->opening->half_az, half_el = b->opening->half_el;
    const bool held = beam_holds(b, cell, u, at);
    const double most_az = held ? GEO_TURN : s->widest * half_az, most_el = held ? GEO_PI : s->widest * half_el;
    struct beam_view view;
    if (!beam_sees(b, cell, &(struct beam_spot){u, place, beam_range(b, place)}, most_az, most_el, &view))
        return;
    double deep_m = s->layers.edge[layer + 1] - s->layers.edge[layer];
    struct spread spread = spread_of(
        fmax(echo->sd_m, s->conf.range_error * echo->range_m), half_az, half_el, s->widest * SPREAD_HALF_POWER,
        &(struct spread_cell){deep_m, view.wide_rad, view.high_rad}, s->conf.model == SPHERE_MIDPOINT);
    double across = spread_across(&spread, view.off_az, view.off_el, view.wide_rad, view.high_rad);
    if (held || across > 0)
        raise_layers(s, l, at, echo, &spread, across);
}

static void hit_direction(struct sphere *s, const struct look *l, uint8_t i)
{
    const struct echo *echo = &l->hits->heard->echo[i];
    const double *u = s->axis[l->direction];
    double at = beam_meet(l->hits, u, echo->range_m), place[3] = {at * u[0], at * u[1], at * u[2]};
    bool opening = s->conf.model == SPHERE_OPENING;
    if (at <= 0 || (opening && !beam_holds(l->hits, &s->ring[l->ring], u, at)))
        return;
    int32_t layer = layers_index(&s->layers, at);
    if (layer < 0)
        s->stats.out_of_range++;
    else if (opening)
        raise(s, l, (uint16_t)layer, at, echo, l->weight[i]);
    else
        spread_echo(s, l, place, at, layer, echo);
}

/* How far what echoed may by now lie beside its cell for the heading's drift. If no turn has shown it again it is not
 * there: by then all of the water around was passed. */
static double adrift_rad(const struct sphere *s, const struct cell *c, const struct echoes *ping)
{
    const double since_s = ping->t_ns > c->t_echo_ns ? (double)(ping->t_ns - c->t_echo_ns) * 1e-9 : 0;
    return s->heading_radps * (s->frame.turn_s > 0 ? fmin(since_s, s->frame.turn_s) : since_s);
}

/* The greatest part of a beam, as a share of its opening, in which it would have detected what stands between these
 * ranges; 0: in none. */
static double share_heard(const struct beam_echoes *h, double from_m, double to_m)
{
    if (from_m < h->blind_m || to_m > h->free_to_m)
        return 0;
    if (!h->off_axis || (from_m >= h->edge_from_m && to_m <= h->edge_to_m))
        return 1;
    return to_m <= h->side_to_m ? BEAM_SIDE_SHARE : BEAM_AXIS_SHARE;
}

/*
 * No echo came from where the beam would have received one: cells there lose by the fraction of them that so much of
 * the beam covered, wherever within the pose uncertainty it was.
 */
static void carve_direction(struct sphere *s, const struct look *l)
{
    const struct beam *b = l->beam;
    const struct beam_cell *cell = &s->ring[l->ring];
    const double half_az = b->opening->half_az, half_el = b->opening->half_el;
    const double uncertain_m = b->ping->pose.uncertain_m, uncertain_rad = b->ping->pose.uncertain_rad;
    for (uint32_t i = s->cells.first[l->direction], next; i != CELLS_NONE; i = next) {
        struct cell *c = &s->cells.cell[i];
        struct beam_view view;
        double place[3];
        next = c->next;
        if (s->layers.edge[c->layer] > l->beyond_m)
            return;
        state_place(s, c, place);
        double thick = s->layers.edge[c->layer + 1] - s->layers.edge[c->layer], range = beam_range(b, place);
        double doubt_m = 2.0 * c->sd_m + uncertain_m + l->blur.along_m;
        double aside = uncertain_rad + (uncertain_m + l->blur.across_m) / fmax(range, NEAREST_M);
        const double part = share_heard(b->heard, range - doubt_m, range + doubt_m + thick / 2);
        if (part <= 0 || !beam_sees(b, cell, &(struct beam_spot){l->ray.u, place, range}, half_az, half_el, &view))
            continue;
        if (part < 1 && hypot(view.off_az / half_az, view.off_el / half_el) > part)
            continue;
        double share = beam_share(view.off_az, part * half_az - aside - adrift_rad(s, c, b->ping), view.wide_rad) *
                       beam_share(view.off_el, part * half_el - aside, view.high_rad);
        if (share < MIN_CARVE_SHARE || c->state == CELL_LOCKED)
            continue;
        weigh(s, c, b->ping, log((1 - ECHO_IF_OCCUPIED * share) / (1 - ECHO_IF_EMPTY * share)));
        c->misses = (c->misses < CELLS_MISSES ? c->misses + 1u : CELLS_MISSES) & CELLS_MISSES;
        state_mark(s, l->direction);
        if (c->logodds <= 0)
            cells_lose(&s->cells, i);
    }
}

/* The blur of a ping's pose in the grid's axes. */
struct blur {
    double m[3], any_m;
    double aside_rad; /* the beams are so much narrower, wherever they point */
    bool any;
};

#define BLUR_HALF_RAD 1.2 /* half the width of a beam, at most, that the next sentence is worked out for */

/* An edge of equal azimuth is no great circle: a turn of the sensor moves its upper end by more than the turn. Before
 * there are axes of the world nobody knows how those of the pose lie in the grid's. */
static struct blur blur_of(const struct sphere *s, const struct echoes *e)
{
    const double widest_rad = (double)fmaxf(e->az_aperture_rad, e->el_aperture_rad);
    const double half_rad = fmin(widest_rad / 2, BLUR_HALF_RAD);
    struct blur b = {.any_m = e->pose.blur_any_m, .aside_rad = e->pose.blur_rad / cos(half_rad)};
    if (s->frame.ned)
        memcpy(b.m, e->pose.blur_m, sizeof b.m);
    else
        b.any_m += geo_length(e->pose.blur_m);
    b.any = b.any_m > 0 || b.aside_rad > 0 || geo_length(b.m) > 0;
    return b;
}

/* A ping whose place is known worse than the centre's, or whose bearing worse than to half a cell. What the vehicle
 * does within the time of a late reading is no reason: its way is known. */
static bool is_loose(const struct sphere *s, const struct pose *pose)
{
    return pose->uncertain_m > s->conf.recentre_m || pose->uncertain_rad > s->rings.height_rad / 2;
}

/* Of the beams of a ping: their own; as far as echoes are entered, for eq. (1) reaches beyond; at least a cell's. */
struct openings {
    struct beam_opening own, widest, looks;
};

/* More or less wide than they are, by so much to each side. */
static struct openings openings_of(const struct sphere *s, const struct echoes *e, double more_rad)
{
    const double reach = s->conf.model == SPHERE_OPENING ? 1 : s->widest, high_rad = s->rings.height_rad;
    const double az_rad = fmax(e->az_aperture_rad + 2 * more_rad, 0),
                 el_rad = fmax(e->el_aperture_rad + 2 * more_rad, 0);
    return (struct openings){.own = beam_opening(az_rad, el_rad),
                             .widest = beam_opening(reach * az_rad, reach * el_rad),
                             .looks = beam_opening(fmax(az_rad, s->widest_rad), fmax(el_rad, high_rad))};
}

/* Where a beam looks for what, and where for anything. */
struct sieves {
    struct beam_sieve any, carves, looks, hits;
};

/* When a direction was looked at, no more: the sensor might as well be at the grid's centre. */
#define LOOKS_FROM_M 100.0

/* The beam is widened to the cell: then a sweep of narrow beams leaves out no middle. */
static bool looks_at(const struct sphere *s, const struct look *l)
{
    const struct beam_opening *o = l->beam->opening;
    const double tan_az = fmax(o->tan_az, s->ring[l->ring].tan_across),
                 tan_el = fmax(o->tan_el, s->rings.tan_half);
    return l->ray.along > 0 && fabs(l->ray.aside) <= tan_az * l->ray.along &&
           fabs(l->ray.upward) <= tan_el * l->ray.along;
}

static void look_in(struct sphere *s, const struct look *l)
{
    struct direction *dir = &s->direction[l->direction];
    if (l->beam->ping->t_ns < dir->t_look_ns)
        return;
    s->stats.pinged += dir->t_look_ns == 0;
    dir->t_look_ns = l->beam->ping->t_ns;
    dir->to_m = (float)(l->beam->heard->free_to_m - l->beam->lever_m);
    state_mark(s, l->direction);
}

/*
 * The beam may miss the middle of a cell that it touches, and a point in a cell may be off its middle. No cell to be
 * carved has its point nearer to the sensor than cells_m; infinite: there is none.
 */
static struct sieves sieves_of(const struct sphere *s, const struct beam *b, const struct beam_opening *widest,
                               const struct beam_opening *looks, double cells_m)
{
    const struct beam_echoes *h = b->heard;
    struct sieves out = {.looks = beam_sieve(b, looks, LOOKS_FROM_M)};
    out.hits = out.carves = out.any = out.looks;
    if (h->n) {
        const struct beam_sieve hits = beam_sieve(b, widest, h->echo[0].range_m);
        out.hits = beam_sieve_wider(&hits, s->reach_rad);
        out.any = beam_sieve_either(&out.any, &out.hits);
    }
    if (cells_m < INFINITY) {
        const struct beam_sieve carves = beam_sieve(b, widest, fmax(fmax(h->blind_m, NEAREST_M), cells_m));
        out.carves = beam_sieve_wider(&carves, 2 * s->reach_rad);
        out.any = beam_sieve_either(&out.any, &out.carves);
    }
    return out;
}

/* One beam and what it may have been. */
struct placed_beam {
    struct beam surely, perhaps;
    struct openings surely_open, perhaps_open;
    struct pose_blur blur;
};

static void enter_beam(struct sphere *s, const struct placed_beam *p, bool loose)
{
    const struct beam *b = &p->surely;
    const struct beam_echoes *h = b->heard;
    struct look l = {.beam = b,
                     .hits = &p->perhaps,
                     .blur = p->blur,
                     .beyond_m = (h->free_to_m + b->lever_m) / s->nearer_share};
    const double cells_m = s->nearest_m * s->nearer_share - b->lever_m;
    const bool carves = h->free_to_m > h->blind_m && !loose && cells_m < h->free_to_m;
    const struct sieves sieves =
        sieves_of(s, b, &p->perhaps_open.widest, &p->surely_open.looks, carves ? cells_m : INFINITY);
    double middle[3], about[3], radius = beam_sieve_cap(b, &sieves.any, middle);
    for (uint8_t i = 0; i < h->n; i++)
        l.weight[i] = weight_of(s, &h->echo[i], 1);
    state_to_grid(s, middle, about);
    struct rings_visit v = rings_visit(&s->rings, about, radius);
    while (rings_next(&v)) {
        const struct beam_ray ray = beam_ray(b, s->axis[v.direction]);
        if (!beam_sieve_passes(&sieves.any, &ray))
            continue;
        l.ray = ray;
        l.direction = v.direction;
        l.ring = v.ring;
        if (carves && s->cells.first[v.direction] != CELLS_NONE && beam_sieve_passes(&sieves.carves, &ray))
            carve_direction(s, &l);
        if (!loose && beam_sieve_passes(&sieves.looks, &ray) && looks_at(s, &l))
            look_in(s, &l);
        if (beam_sieve_passes(&sieves.hits, &ray))
            for (uint8_t i = 0; i < h->n; i++)
                if (!(h->echo[i].flags & ECHO_OWN))
                    hit_direction(s, &l, i);
    }
}

/* What the beam may have been, for its pose is blurred: turned to either side, and beside its place, which counts where
 * its nearest echo is. What it surely was is as much narrower. */
static void blur_beam(const struct sphere *s, struct placed_beam *p, const struct blur *blur, const double turn[4])
{
    const struct beam_echoes *h = p->surely.heard;
    p->blur = pose_blur_of(blur->m, p->surely.axis, p->surely.opening->off_rad);
    p->blur.along_m += blur->any_m;
    p->blur.across_m += blur->any_m;
    const double aside_rad = h->n ? atan(p->blur.across_m / fmax(h->echo[0].range_m, NEAREST_M)) : 0;
    p->surely_open = openings_of(s, p->surely.ping, -blur->aside_rad);
    p->perhaps_open = openings_of(s, p->surely.ping, blur->aside_rad + aside_rad);
    beam_place(&p->perhaps, h->az_rad, h->el_rad, &p->perhaps_open.own, turn, p->surely.origin_m);
    p->perhaps.ping = p->surely.ping;
    p->perhaps.heard = h;
}

void sensor_enter(struct sphere *s, const struct echoes *e, const double turn[4], const double origin_m[3])
{
    const struct blur blur = blur_of(s, e);
    const struct openings open = openings_of(s, e, 0);
    const bool loose = is_loose(s, &e->pose);
    struct placed_beam p = {.surely_open = open, .perhaps_open = open};
    for (uint16_t i = 0; i < e->n_beams; i++) {
        beam_of(&p.surely, e, i, &p.surely_open.own, turn, origin_m);
        if (blur.any)
            blur_beam(s, &p, &blur, turn);
        else
            p.perhaps = p.surely;
        enter_beam(s, &p, loose);
    }
}
