/* SPDX-License-Identifier: MIT */
#include "sensor.h"

#include <math.h>
#include <string.h>

#include "sides.h"
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

/* What a beam says of water: it is free, nothing is known of it any more, it received nothing usable, or nothing at
 * all, as if it had not been sent. */
enum said { SAID_FREE, SAID_UNKNOWN, SAID_DEAF, SAID_NOTHING };

/* The water that a beam speaks of. */
struct water {
    struct beam_water range;
    enum said said;
    bool ends_at_echo;
};

/* The beam that is being entered, and what is the same for all directions that it may concern. */
struct look {
    const struct beam *beam;        /* as it surely was, wherever its pose may be within its blur ... */
    const struct beam *clears;      /* ... or all that it may have been, where it takes free water back ... */
    const struct beam *hits;        /* ... as its echoes do */
    struct pose_blur blur;          /* of the beam; all directions counted in both */
    double weight[ECHOES_PER_BEAM]; /* of each echo in full */
    double beyond_m;                /* no layer from here on can hold a point in free water */
    uint32_t direction, ring;       /* that is looked at ... */
    struct beam_ray ray;            /* ... through its middle */
    struct water water;
    struct free_ping ping;
};

/* An echo that the next turn does not confirm blocks for no longer than this many turns, or that time. */
#define UNCONFIRMED_TURNS 1.5
#define UNCONFIRMED_S     5.0

/* The most that the first echo of a cell weighs: it has faded to what blocks no more by the time that the head
 * has passed again. What is left of it still ends free water. */
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

/*
 * What the beam observed of the water in a direction. One ping that receives nothing usable may be a burst of noise or
 * a lost pulse: what was free stays, as of then. If the next one in this direction is deaf as well, something may be in
 * front of the sonar: the two take it back. So does the sonar's next ping wherever it points: deaf_again.
 */
static void clear_direction(struct sphere *s, const struct look *l)
{
    struct direction *dir = &s->direction[l->direction];
    const bool first = !dir->free[0].t_ping_ns;
    struct stretch st;
    const struct side_look aside = {l->clears, l->ping, &l->water.range, l->direction, l->ring};
    if (!beam_stretch(l->clears, &s->ring[l->ring], &l->ray, &l->water.range, &st)) {
        if (l->water.said == SAID_FREE)
            sides_see(s, &aside, NULL);
        return;
    }
    st.ends_at_echo = l->water.ends_at_echo;
    const bool deaf = l->water.said == SAID_DEAF, alone = !dir->deaf_ns || dir->deaf_ns == l->ping.t_ns,
               forgiven = deaf && !first && alone;
    dir->deaf_ns = deaf ? l->ping.t_ns : 0;
    if (forgiven)
        return;
    if (l->water.said == SAID_FREE) {
        free_add(dir->free, &st, &l->ping);
        sides_see(s, &aside, &st);
    } else {
        sides_withdraw(s, l->direction, l->ping.t_ns);
        free_withdraw(dir->free, &l->ping);
    }
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
    return beam_part_share[to_m <= h->side_to_m ? BEAM_SIDE : BEAM_AXIS];
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

/* Of the beams of a ping: their own; as far as echoes are entered, for eq. (1) reaches beyond; of what is freed. */
struct openings {
    struct beam_opening own, widest, freed;
};

/* More or less wide than they are, by so much to each side. */
static struct openings openings_of(const struct sphere *s, const struct echoes *e, double more_rad)
{
    const double reach = s->conf.model == SPHERE_OPENING ? 1 : s->widest, high_rad = s->rings.height_rad;
    const double az_rad = fmax(e->az_aperture_rad + 2 * more_rad, 0),
                 el_rad = fmax(e->el_aperture_rad + 2 * more_rad, 0);
    struct openings o = {.own = beam_opening(az_rad, el_rad, high_rad, s->conf.level),
                         .widest = beam_opening(reach * az_rad, reach * el_rad, high_rad, s->conf.level)};
    o.freed = beam_opening_freed(&o.own, s->widest_rad);
    return o;
}

/* Where a beam looks for what, and where for anything. */
struct sieves {
    struct beam_sieve any, carves, clears, hits;
};

static bool is_own(const struct beam_echoes *h)
{
    return h->n > 0 && h->echo[0].flags & ECHO_OWN;
}

/* Is this ping deaf in every beam, as the last one of its sensor? */
static bool is_deaf_again(struct sphere *s, const struct echoes *e)
{
    const uint64_t sensor = UINT64_C(1) << e->sensor % SPHERE_SENSORS;
    const bool before = s->deaf_sensors & sensor;
    bool deaf = true;
    for (uint16_t i = 0; i < e->n_beams; i++)
        deaf = deaf && e->beam[i].free_to_m <= e->beam[i].blind_m && !is_own(&e->beam[i]);
    s->deaf_sensors = deaf ? s->deaf_sensors | sensor : s->deaf_sensors & ~sensor;
    return deaf && before;
}

/* What stands farther than the grid reaches leaves no cell that another beam's free water would have to end at: no beam
 * frees water there. */
static struct beam_water within_reach(const struct sphere *s, const struct beam *b, const struct beam_water *w)
{
    const double reach_m = s->layers.edge[s->layers.n] - b->lever_m;
    struct beam_water out = *w;
    out.to_m = fmin(w->to_m, reach_m);
    out.side_to_m = fmin(w->side_to_m, reach_m);
    out.edge_to_m = fmin(w->edge_to_m, reach_m);
    return out;
}

/* loose: the pose of the ping is too uncertain to make any water free; what older pings found free only ages, but for
 * an echo of the vehicle's own: it does not block, so the water behind it must not stay free. */
static struct water water_of(const struct sphere *s, const struct beam *b, bool loose)
{
    const struct beam_echoes *h = b->heard;
    struct beam_water own = beam_water_alike(h->blind_m, h->free_to_m);
    if (h->off_axis)
        own = (struct beam_water){h->blind_m, h->free_to_m, h->side_to_m, h->edge_from_m, h->edge_to_m, true};
    own = beam_water_less(&own, b->ping->pose.uncertain_m);
    own = beam_surely_free(b, &own);
    const struct beam_water kept = within_reach(s, b, &own);
    if (kept.to_m > kept.from_m && !loose)
        return (struct water){.range = kept, .said = SAID_FREE, .ends_at_echo = h->n > 0 && kept.to_m >= own.to_m};
    const enum said lost = s->deaf_again || is_own(h) ? SAID_UNKNOWN : SAID_DEAF;
    return (struct water){.range = beam_water_alike(0, b->ping->range_max_m),
                          .said = h->free_to_m > h->blind_m && !is_own(h) ? SAID_NOTHING : lost};
}

/*
 * The beam may miss the middle of a cell that it touches, and a point in a cell may be off its middle; of water it
 * speaks along middles alone, however near the end of it that the beam itself has. No cell to be carved has its point
 * nearer to the sensor than cells_m; infinite: there is none.
 */
static struct sieves sieves_of(const struct sphere *s, const struct beam *b, const struct beam_opening *widest,
                               const struct beam_opening *freed, const struct water *water, double cells_m)
{
    const struct beam_echoes *h = b->heard;
    struct sieves out = {.clears =
                             beam_sieve(b, freed, fmin(fmax(water->range.from_m, NEAREST_M), water->range.to_m))};
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
    const struct echoes *e = b->ping;
    struct look l = {.beam = b,
                     .hits = &p->perhaps,
                     .blur = p->blur,
                     .beyond_m = (h->free_to_m + b->lever_m) / s->nearer_share,
                     .ping = {e->t_ns, e->pose.path_m, e->sensor}};
    const double cells_m = s->nearest_m * s->nearer_share - b->lever_m;
    const bool carves = h->free_to_m > h->blind_m && !loose && cells_m < h->free_to_m;
    l.water = water_of(s, b, loose);
    const bool frees = l.water.said == SAID_FREE;
    l.clears = frees ? b : &p->perhaps;
    /* while the vehicle drifts no beam frees water by itself: motion_drift judges it together with its neighbours */
    const bool speaks = frees ? !s->drifts : l.water.said != SAID_NOTHING;
    const struct sieves sieves =
        sieves_of(s, b, &p->perhaps_open.widest, frees ? &p->surely_open.freed : &p->perhaps_open.freed, &l.water,
                  carves ? cells_m : INFINITY);
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
        if (speaks && beam_sieve_passes(&sieves.clears, &ray))
            clear_direction(s, &l);
        if (beam_sieve_passes(&sieves.hits, &ray))
            for (uint8_t i = 0; i < h->n; i++)
                if (!(h->echo[i].flags & ECHO_OWN))
                    hit_direction(s, &l, i);
    }
}

static const uint8_t kinds[] = {
    [SAID_FREE] = WEDGE_FREE, [SAID_UNKNOWN] = WEDGE_UNKNOWN, [SAID_DEAF] = WEDGE_DEAF};

/* What a beam says of the water, as a wedge; false: nothing. aside_rad: its bearing is uncertain by so much. */
static bool wedge_of(const struct sphere *s, const struct beam *b, const struct beam_row *row, double aside_rad,
                     struct wedge *out)
{
    const struct water water = water_of(s, b, is_loose(s, &b->ping->pose));
    if (water.said == SAID_NOTHING)
        return false;
    /* free is what the beam saw wherever it pointed; what it takes back it takes back in full */
    const double half_az = b->opening->half_az - (water.said == SAID_FREE ? aside_rad : 0);
    *out = (struct wedge){.az_rad = b->heard->az_rad,
                          .el_rad = b->heard->el_rad,
                          .half_az_rad = (float)fmax(0, half_az),
                          .row = *row,
                          .kind = kinds[water.said],
                          .ends_at_echo = water.ends_at_echo};
    wedges_set_water(out, &water.range);
    return true;
}

/* Keeps what the ping says of the water, in the frame in which it was observed. */
static void keep_wedges(struct sphere *s, const struct echoes *e, const double turn[4], const double origin_m[3])
{
    const struct beam_opening own =
        beam_opening(e->az_aperture_rad, e->el_aperture_rad, s->rings.height_rad, s->conf.level);
    const struct blur blur = blur_of(s, e);
    struct wedge_ping ping = {.t_ns = e->t_ns,
                              .path_m = e->pose.path_m,
                              .drift_m = {e->pose.drift_m[0], e->pose.drift_m[1]},
                              .uncertain_m = (float)(e->pose.uncertain_m + blur.any_m),
                              .blur_m = {(float)blur.m[0], (float)blur.m[1], (float)blur.m[2]},
                              .uncertain_rad = (float)(e->pose.uncertain_rad + blur.aside_rad),
                              .el_aperture_rad = e->el_aperture_rad,
                              .sensor = e->sensor};
    struct wedge fan, one;
    bool any = false;
    memcpy(ping.attitude, turn, sizeof ping.attitude);
    for (int i = 0; i < 3; i++)
        ping.place_m[i] = s->frame.centre_m[i] + origin_m[i];
    wedges_begin(&s->wedges, &ping);
    for (uint16_t i = 0; i < e->n_beams; i++) {
        struct beam b;
        beam_of(&b, e, i, &own, turn, origin_m);
        beam_blur(&b, blur.m, blur.any_m);
        const struct beam_row row = state_row(s, &b, i);
        if (!wedge_of(s, &b, &row, e->pose.uncertain_rad + blur.aside_rad, &one) ||
            (any && wedges_join(&fan, &one, s->rings.height_rad)))
            continue;
        if (any)
            wedges_add(&s->wedges, &fan);
        fan = one;
        any = true;
    }
    if (any)
        wedges_add(&s->wedges, &fan);
    wedges_end(&s->wedges, s->conf.recentre_m);
}

/* What the beam may have been, for its pose is blurred: turned to either side, and beside its place, which counts where
 * its nearest echo is. What it surely was is as much narrower. */
static void blur_beam(const struct sphere *s, struct placed_beam *p, const struct blur *blur, const double turn[4])
{
    const struct beam_echoes *h = p->surely.heard;
    beam_blur(&p->surely, blur->m, blur->any_m);
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
    s->deaf_again = is_deaf_again(s, e);
    for (uint16_t i = 0; i < e->n_beams; i++) {
        beam_of(&p.surely, e, i, &p.surely_open.own, turn, origin_m);
        if (blur.any)
            blur_beam(s, &p, &blur, turn);
        else
            p.perhaps = p.surely;
        if (e->beam[i].off_axis) {
            const struct beam_row row = state_row(s, &p.surely, i);
            beam_row_open(&p.surely_open.own, &row, blur.aside_rad, blur.aside_rad);
        }
        enter_beam(s, &p, loose);
    }
    if (s->frame.ned || (s->drifts && !e->pose.heading_adrift))
        keep_wedges(s, e, turn, origin_m);
    if (e->n_beams == 1)
        beside_keep(&s->last[e->sensor % SPHERE_SENSORS], &p.surely);
}

/* Of the wedge that is entered again: its opening, which is that of most wedges before it. */
struct again {
    float half_az_rad, aside_rad, el_aperture_rad, less_rad;
    struct beam_row row;
    struct beam_opening own, freed;
};

#define SAME_RAD 1e-6f /* bearings are rounded */

static bool is_same_row(const struct beam_row *a, const struct beam_row *b)
{
    return a->several == b->several && a->half_az_rad == b->half_az_rad && a->half_el_rad == b->half_el_rad &&
           fabsf(a->left_rad - b->left_rad) < SAME_RAD && fabsf(a->right_rad - b->right_rad) < SAME_RAD &&
           fabsf(a->seam_rad - b->seam_rad) < SAME_RAD;
}

/* Of a wedge whose beams count as so much less wide and high to each side. */
static void open_again(const struct sphere *s, struct again *a, const struct wedge *w, float el_aperture_rad,
                       float aside_rad, float less_rad)
{
    if (a->half_az_rad == w->half_az_rad && a->el_aperture_rad == el_aperture_rad && a->aside_rad == aside_rad &&
        a->less_rad == less_rad && is_same_row(&a->row, &w->row))
        return;
    a->half_az_rad = w->half_az_rad;
    a->row = w->row;
    a->el_aperture_rad = el_aperture_rad;
    a->aside_rad = aside_rad;
    a->less_rad = less_rad;
    a->own = beam_opening(2 * (double)w->half_az_rad, fmaxf(0, el_aperture_rad - 2 * less_rad),
                          s->rings.height_rad, s->conf.level);
    beam_row_open(&a->own, &w->row, (double)aside_rad, (double)less_rad);
    a->freed = beam_opening_freed(&a->own, s->widest_rad);
}

/* An older wedge as seen from where the grid's centre is now. */
struct seen_again {
    const struct wedge *wedge;
    const struct beam *beam;
    struct beam_water water;
    struct free_ping by;
};

/* A look that received nothing usable or something: as in clear_direction, from the newest to the oldest. */
static void fill_deaf(struct sphere *s, uint32_t d, bool deaf, uint64_t t_ns)
{
    struct direction *dir = &s->direction[d];
    struct refill *refill = &s->refill[d];
    if (deaf && !refill->told && !dir->deaf_ns)
        dir->deaf_ns = t_ns;
    if (deaf && refill->deaf_ns && refill->deaf_ns != t_ns) {
        sides_withdraw(s, d, refill->deaf_ns);
        refill->limit_m = 0;
    }
    refill->told |= !deaf;
    refill->deaf_ns = deaf ? t_ns : 0;
}

/* What it says of a direction, of which newer ones have spoken. */
static void fill_direction(struct sphere *s, const struct seen_again *seen, const struct rings_visit *v,
                           const struct beam_ray *ray)
{
    const struct wedge *w = seen->wedge;
    struct direction *dir = &s->direction[v->direction];
    struct refill *refill = &s->refill[v->direction];
    struct stretch st;
    const struct side_look aside = {seen->beam, seen->by, &seen->water, v->direction, v->ring};
    if (refill->limit_m <= 0)
        return;
    if (!beam_stretch(seen->beam, &s->ring[v->ring], ray, &seen->water, &st)) {
        if (w->kind == WEDGE_FREE)
            sides_fill(s, &aside, NULL);
        return;
    }
    st.ends_at_echo = w->ends_at_echo;
    fill_deaf(s, v->direction, w->kind == WEDGE_DEAF, seen->by.t_ns);
    if (w->kind == WEDGE_FREE) {
        sides_fill(s, &aside, &st);
        free_fill(dir->free, &st, &seen->by, &refill->limit_m);
        return;
    }
    if (w->kind == WEDGE_UNKNOWN) {
        sides_withdraw(s, v->direction, seen->by.t_ns);
        refill->limit_m = 0;
    }
    if (!dir->free[0].t_ping_ns)
        (w->kind == WEDGE_SPENT ? free_spend : free_withdraw)(dir->free, &seen->by);
}

/*
 * A wedge that the vehicle has driven into surrounds it: only directions that hold some of the wedge this many times
 * farther from its sensor than the vehicle is are worth a look, and of those all of the ray.
 */
#define SEEN_LEVERS 2.0

/* What the path since says of a wedge: it is shorter at both ends. What drift does: its upper and lower side are
 * farther in, too, and its beam is less high. */
struct shrunk {
    double margin_m, tilt_rad, apart_m;
    const double *drift_m; /* level, in depth; NULL: none */
};

/* How much farther in the beam's upper and lower side are for the drift across them. */
static double drift_across(const struct beam *b, const struct shrunk *by)
{
    double most_m = 0;
    for (int side = -1; side <= 1 && by->drift_m; side += 2) {
        double normal[3];
        for (int i = 0; i < 3; i++)
            normal[i] = b->opening->tan_el * b->axis[i] + side * b->up[i];
        const double size = geo_length(normal);
        most_m =
            fmax(most_m, (by->drift_m[0] * hypot(normal[0], normal[1]) + by->drift_m[1] * fabs(normal[2])) / size);
    }
    return most_m + by->apart_m;
}

/*
 * The wedge as seen from where the grid's centre is now. Its left and right side stay: an error of the path moves
 * neighbouring beams alike, and between them no gap opens; drift is drift_judge's to see.
 */
static void free_again(struct sphere *s, struct again *a, const struct wedge_ping *ping, const struct wedge *w,
                       const struct shrunk *shrunk)
{
    const bool free = w->kind == WEDGE_FREE;
    const float aside_rad = free || w->kind == WEDGE_SPENT ? ping->uncertain_rad : 0;
    const struct beam_water water = wedges_water(w);
    double origin_m[3], middle[3], about[3];
    struct beam b;
    const struct seen_again seen = {.wedge = w,
                                    .beam = &b,
                                    .water = beam_water_less(&water, shrunk->margin_m),
                                    .by = {ping->t_ns, ping->path_m, ping->sensor}};
    if (!(seen.water.to_m > seen.water.from_m))
        return;
    open_again(s, a, w, ping->el_aperture_rad, aside_rad, aside_rad + (float)shrunk->tilt_rad);
    for (int i = 0; i < 3; i++)
        origin_m[i] = ping->place_m[i] - s->frame.centre_m[i];
    beam_place(&b, w->az_rad, w->el_rad, &a->own, ping->attitude, origin_m);
    if (free)
        beam_blur(&b, (const double[3]){ping->blur_m[0], ping->blur_m[1], ping->blur_m[2]}, ping->uncertain_m);
    b.margin_el_m = drift_across(&b, shrunk);
    const double sees_m = fmax(fmax(seen.water.from_m, NEAREST_M), SEEN_LEVERS * b.lever_m);
    const struct beam_sieve sieve = beam_sieve(&b, &a->freed, fmin(sees_m, seen.water.to_m));
    const double radius = beam_sieve_cap(&b, &sieve, middle);
    state_to_grid(s, middle, about);
    struct rings_visit v = rings_visit(&s->rings, about, radius);
    while (rings_next(&v)) {
        const struct beam_ray ray = beam_ray(&b, s->axis[v.direction]);
        if (beam_sieve_passes(&sieve, &ray))
            fill_direction(s, &seen, &v, &ray);
    }
}

static void forget_intervals(struct sphere *s)
{
    for (uint32_t d = 0; d < s->rings.n; d++) {
        struct direction *dir = &s->direction[d];
        s->refill[d] = (struct refill){.limit_m = INFINITY};
        dir->deaf_ns = 0;
        free_none(dir->side);
        memset(dir->end, 0, sizeof dir->end);
        if (!dir->free[0].t_ping_ns && s->cells.first[d] == CELLS_NONE)
            continue;
        free_none(dir->free);
        state_mark(s, d);
    }
}

/*
 * The wedges of a ping that was made before the last drift. *next: number of the look behind the ping's last; pings of
 * which there are no looks are older than any drift that leaves something free.
 */
static void free_drifted(struct sphere *s, struct again *a, const struct wedge_ping *ping, uint32_t number,
                         uint32_t *next)
{
    const bool spent = *next == 0 || s->drift.look[*next - 1].ping != number;
    for (uint32_t i = 0; spent && i < ping->n; i++) {
        struct wedge w = *wedges_of(&s->wedges, ping, i);
        w.kind = w.kind == WEDGE_FREE ? WEDGE_SPENT : w.kind;
        free_again(s, a, ping, &w, &(struct shrunk){0});
    }
    for (; *next > 0 && s->drift.look[*next - 1].ping == number; --*next) {
        const struct drift_look *look = &s->drift.look[*next - 1];
        struct wedge w = s->wedges.wedge[look->wedge % WEDGES_MAX];
        struct drift_worth worth = {0};
        if (w.kind == WEDGE_FREE && drift_judge(&s->drift, &s->wedges, s->frame.drift_m, *next - 1, &worth)) {
            wedges_set_water(&w, &worth.water);
        } else if (w.kind == WEDGE_FREE) {
            w.kind = WEDGE_SPENT;
        }
        drift_narrow(&w, look);
        free_again(s, a, ping, &w, &(struct shrunk){0, worth.tilt_rad, worth.apart_m, worth.drift_m});
    }
}

/* Has the vehicle drifted since the ping, by what the picture counts? */
static bool has_drifted(const struct sphere *s, const struct wedge_ping *ping)
{
    return s->frame.drift_m[0] > ping->drift_m[0] || s->frame.drift_m[1] > ping->drift_m[1];
}

void sensor_free_again(struct sphere *s, uint64_t t_ns, double path_m)
{
    const uint64_t keep_ns = state_keep_ns(s);
    struct again a = {.half_az_rad = -1};
    wedges_forget(&s->wedges, t_ns > keep_ns ? t_ns - keep_ns : 0);
    forget_intervals(s);
    uint32_t next = 0;
    if (s->wedges.end != s->wedges.first && has_drifted(s, &s->wedges.ping[s->wedges.first % WEDGES_PINGS]))
        next = drift_gather(&s->drift, &s->wedges, s->frame.drift_m, s->layers.edge[s->layers.n],
                            s->rings.height_rad);
    for (uint32_t k = s->wedges.end; k != s->wedges.first; k--) {
        const struct wedge_ping *ping = &s->wedges.ping[(k - 1) % WEDGES_PINGS];
        const double margin_m = state_way_error_m(s, fmax(path_m - ping->path_m, 0), ping->t_ns, t_ns);
        if (has_drifted(s, ping)) {
            free_drifted(s, &a, ping, k - 1, &next);
            continue;
        }
        for (uint32_t i = ping->n; i > 0; i--) {
            const struct wedge *w = wedges_of(&s->wedges, ping, i - 1);
            free_again(s, &a, ping, w, &(struct shrunk){.margin_m = w->kind == WEDGE_FREE ? margin_m : 0});
        }
    }
    s->stats.pinged = 0;
    for (uint32_t d = 0; d < s->rings.n; d++)
        if (s->direction[d].free[0].t_ping_ns) {
            state_mark(s, d);
            s->stats.pinged++;
        }
}
