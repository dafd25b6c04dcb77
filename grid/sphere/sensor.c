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
#define NEAREST_M       0.1 /* nothing is heard nearer: bounds the parallax */

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
    return echo->flags ? fmin(weight, MARKED_BLOCKS * s->blocked_logodds) : weight;
}

/* What a beam says of water: it is free, nothing is known of it any more, or nothing at all, as if it had not been sent. */
enum said { SAID_FREE, SAID_UNKNOWN, SAID_NOTHING };

/* The water that a beam speaks of, by range from the sensor. */
struct water {
    double from_m, to_m;
    enum said said;
};

/* The beam that is being entered, and what is the same for all directions that it may concern. */
struct look {
    const struct beam *beam;
    double weight[ECHOES_PER_BEAM]; /* of each echo in full */
    double beyond_m;                /* no layer from here on can hold a point in free water */
    uint32_t direction, ring;       /* that is looked at ... */
    struct beam_ray ray;            /* ... through its middle */
    struct water water;
};

/* An echo `at` range_m along the direction raises the cell of a layer by `weight`. */
static void raise(struct sphere *s, const struct look *l, uint16_t layer, double range_m, const struct echo *echo,
                  double weight)
{
    const struct echoes *ping = l->beam->ping;
    struct cell *c = state_take(s, l->direction, layer);
    if (!c || c->state == CELL_LOCKED)
        return;
    double z[3];
    for (int i = 0; i < 3; i++)
        z[i] = range_m * s->axis[l->direction][i] + s->frame.centre_m[i] - s->anchor_m[i];
    interpolate(s, c, z, range_m, echo, echo_variance(s, l->ring, range_m, echo));
    c->near_m += (float)ping->pose.slack_m;
    if (!c->echoes)
        c->t_first_ms = state_ms(s, ping->t_ns);
    if (ping->t_ns > c->t_echo_ns)
        c->t_echo_ns = ping->t_ns;
    c->misses = 0;
    if (c->echoes < UINT16_MAX)
        c->echoes++;
    if (s->conf.update == SPHERE_MAX)
        weight = fmax(0, weight - state_logodds(s, c, ping->t_ns));
    weigh(s, c, ping, weight);
    state_mark(s, l->direction);
}

/* What the beam heard of the water in direction d; a beam that says nothing takes back what older ones said. */
static void clear_direction(struct sphere *s, const struct look *l)
{
    struct direction *dir = &s->direction[l->direction];
    const struct echoes *e = l->beam->ping;
    const bool first = !dir->claim[CLAIM_NOW].t_ping_ns;
    struct stretch st;
    if (!beam_stretch(l->beam, &s->ring[l->ring], &l->ray, l->water.from_m, l->water.to_m, &st))
        return;
    if (l->water.said == SAID_FREE)
        claim_add(dir->claim, &st, e->t_ns, e->pose.path_m, e->sensor);
    else
        claim_withdraw(dir->claim, e->t_ns, e->pose.path_m, e->sensor);
    s->stats.pinged += first;
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
    const struct beam *b = l->beam;
    const struct beam_cell *cell = &s->ring[l->ring];
    const double *u = s->axis[l->direction], half_az = b->opening->half_az, half_el = b->opening->half_el;
    const bool held = beam_holds(b, cell, u, at);
    const double most_az = held ? GEO_TURN : SPREAD_WIDEST * half_az,
                 most_el = held ? GEO_PI : SPREAD_WIDEST * half_el;
    struct beam_view view;
    if (!beam_sees(b, cell, u, place, beam_range(b, place), most_az, most_el, &view))
        return;
    double deep_m = s->layers.edge[layer + 1] - s->layers.edge[layer];
    struct spread spread = spread_of(fmax(echo->sd_m, s->conf.range_error * echo->range_m), half_az, half_el,
                                     deep_m, view.wide_rad, view.high_rad, s->conf.model == SPHERE_MIDPOINT);
    double across = spread_across(&spread, view.off_az, view.off_el, view.wide_rad, view.high_rad);
    if (held || across > 0)
        raise_layers(s, l, at, echo, &spread, across);
}

static void hit_direction(struct sphere *s, const struct look *l, uint8_t i)
{
    const struct echo *echo = &l->beam->heard->echo[i];
    const double *u = s->axis[l->direction];
    double at = beam_meet(l->beam, u, echo->range_m), place[3] = {at * u[0], at * u[1], at * u[2]};
    bool opening = s->conf.model == SPHERE_OPENING;
    if (at <= 0 || (opening && !beam_holds(l->beam, &s->ring[l->ring], u, at)))
        return;
    int32_t layer = layers_index(&s->layers, at);
    if (layer < 0)
        s->stats.out_of_range++;
    else if (opening)
        raise(s, l, (uint16_t)layer, at, echo, l->weight[i]);
    else
        spread_echo(s, l, place, at, layer, echo);
}

/*
 * Nothing was heard in the water up to free_to_m: cells there lose by the share of them that the beam covered, wherever within
 * the slack of its pose it was.
 */
static void carve_direction(struct sphere *s, const struct look *l)
{
    const struct beam *b = l->beam;
    const struct beam_cell *cell = &s->ring[l->ring];
    const double half_az = b->opening->half_az, half_el = b->opening->half_el;
    const double slack_m = b->ping->pose.slack_m, slack_rad = b->ping->pose.slack_rad;
    for (uint32_t i = s->cells.first[l->direction], next; i != CELLS_NONE; i = next) {
        struct cell *c = &s->cells.cell[i];
        struct beam_view view;
        double place[3];
        next = c->next;
        if (s->layers.edge[c->layer] > l->beyond_m)
            return;
        state_place(s, c, place);
        double thick = s->layers.edge[c->layer + 1] - s->layers.edge[c->layer], range = beam_range(b, place);
        double doubt_m = 2.0 * c->sd_m + slack_m, aside = slack_rad + slack_m / fmax(range, NEAREST_M);
        if (range - doubt_m < b->heard->blind_m || range + doubt_m + thick / 2 > b->heard->free_to_m ||
            !beam_sees(b, cell, l->ray.u, place, range, half_az, half_el, &view))
            continue;
        double share = beam_share(view.off_az, half_az - aside, view.wide_rad) *
                       beam_share(view.off_el, half_el - aside, view.high_rad);
        if (share < MIN_CARVE_SHARE || c->state == CELL_LOCKED)
            continue;
        weigh(s, c, b->ping, log((1 - ECHO_IF_OCCUPIED * share) / (1 - ECHO_IF_EMPTY * share)));
        c->misses = (c->misses < CELLS_MISSES ? c->misses + 1u : CELLS_MISSES) & CELLS_MISSES;
        state_mark(s, l->direction);
        if (c->logodds <= 0)
            cells_lose(&s->cells, i);
    }
}

/* A ping whose place is known worse than the centre's, or whose bearing worse than to half a cell. */
static bool is_loose(const struct sphere *s, const struct pose *pose)
{
    return pose->slack_m > s->conf.recentre_m || pose->slack_rad > s->rings.height_rad / 2;
}

/* Beams' openings as far as echoes are entered: eq. (1) reaches beyond them. */
static struct beam_opening hit_opening(const struct sphere *s, const struct echoes *e)
{
    const double reach = s->conf.model == SPHERE_OPENING ? 1 : SPREAD_WIDEST;
    return beam_opening(reach * e->az_aperture_rad, reach * e->el_aperture_rad, s->rings.height_rad,
                        s->conf.level);
}

/* Where a beam looks for what, and where for anything. */
struct sieves {
    struct beam_sieve any, carves, clears, hits;
};

/* loose: the ping's pose is too far off for what it heard to make any water free; what older ones heard only grows older. */
static struct water water_of(const struct beam *b, bool loose)
{
    const struct beam_echoes *h = b->heard;
    const double slack_m = b->ping->pose.slack_m, from_m = h->blind_m + slack_m, to_m = h->free_to_m - slack_m;
    if (to_m > from_m && !loose)
        return (struct water){.from_m = from_m, .to_m = to_m, .said = SAID_FREE};
    return (struct water){.to_m = b->ping->range_max_m,
                          .said = h->free_to_m > h->blind_m ? SAID_NOTHING : SAID_UNKNOWN};
}

/*
 * The beam may miss the middle of a cell that it touches, and a point in a cell may be off its middle; of water it speaks
 * along middles alone, however near the end of it that the beam itself has. No cell to be carved has its point nearer to
 * the sensor than cells_m; infinite: there is none.
 */
static struct sieves sieves_of(const struct sphere *s, const struct beam *b, const struct beam_opening *widest,
                               const struct beam_opening *freed, const struct water *water, double cells_m)
{
    const struct beam_echoes *h = b->heard;
    struct sieves out = {.clears = beam_sieve(b, freed, fmin(fmax(water->from_m, NEAREST_M), water->to_m))};
    out.hits = out.carves = out.any = out.clears;
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

static void enter_beam(struct sphere *s, const struct beam *b, const struct beam_opening *widest,
                       const struct beam_opening *freed)
{
    const struct beam_echoes *h = b->heard;
    struct look l = {.beam = b, .beyond_m = (h->free_to_m + b->lever_m) / s->nearer_share};
    const bool loose = is_loose(s, &b->ping->pose);
    const double cells_m = s->nearest_m * s->nearer_share - b->lever_m;
    const bool carves = h->free_to_m > h->blind_m && !loose && cells_m < h->free_to_m;
    l.water = water_of(b, loose);
    const struct sieves sieves = sieves_of(s, b, widest, freed, &l.water, carves ? cells_m : INFINITY);
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
        if (l.water.said != SAID_NOTHING && beam_sieve_passes(&sieves.clears, &ray))
            clear_direction(s, &l);
        if (beam_sieve_passes(&sieves.hits, &ray))
            for (uint8_t i = 0; i < h->n; i++)
                hit_direction(s, &l, i);
    }
}

void sensor_enter(struct sphere *s, const struct echoes *e, const double turn[4], const double origin_m[3])
{
    const struct beam_opening widest = hit_opening(s, e);
    const struct beam_opening own =
        beam_opening(e->az_aperture_rad, e->el_aperture_rad, s->rings.height_rad, s->conf.level);
    const struct beam_opening freed = beam_opening_freed(&own, s->widest_rad);
    for (uint16_t i = 0; i < e->n_beams; i++) {
        struct beam b;
        beam_of(&b, e, i, &own, turn, origin_m);
        enter_beam(s, &b, &widest, &freed);
    }
}
