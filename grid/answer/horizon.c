/* SPDX-License-Identifier: MIT */
#include "horizon.h"

#include <math.h>
#include <string.h>

#define PART_RAD (GEO_TURN / ASK_LEVEL)

/* Cosine of 45 degrees. Farther to the side of its level course a ray leaves a body's way beside its own front. */
#define BOW 0.7071

#define BEYOND_M (2 * WATER_GRID_M)

static double middle_rad(uint32_t part)
{
    return (part + 0.5) * PART_RAD;
}

/* In the grid's axes. */
static double grid_rad(const struct horizon *h, uint32_t part)
{
    return middle_rad(part) - h->axes_rad;
}

static uint32_t part_at(const struct horizon *h, uint32_t k)
{
    return (h->first + k) % ASK_LEVEL;
}

/* However steep the way is: what it is promised to not stand there goes from the bottom to the surface. */
static bool is_ahead(const double along[3], uint32_t part)
{
    const double level = hypot(along[0], along[1]);
    return along[0] * cos(middle_rad(part)) + along[1] * sin(middle_rad(part)) > BOW * level;
}

bool horizon_begin(struct horizon *h, const double along[3], double axes_rad, double near_m)
{
    bool asks = false;
    h->near_m = near_m;
    h->axes_rad = axes_rad;
    h->drifts = h->promise.now->pose.drift_mps > 0;
    h->nominal = false;
    h->start_m = near_m;
    h->first = h->n = 0;
    for (uint32_t k = 0; k < ASK_LEVEL; k++) {
        h->level_m[k] = near_m;
        h->look[k] = (struct promise_look){.looked_m = near_m};
        if (is_ahead(along, k) && !is_ahead(along, (k + ASK_LEVEL - 1) % ASK_LEVEL))
            h->first = k;
        h->n += is_ahead(along, k);
    }
    for (uint32_t k = 0; k < h->n && !asks; k++) {
        const double az_rad = grid_rad(h, part_at(h, k));
        asks = promise_heeds(&h->promise, az_rad, near_m) || promise_passes(&h->promise, az_rad, near_m);
    }
    h->n = asks ? h->n : 0;
    return asks;
}

struct ask_question horizon_question(const struct horizon *h)
{
    return (struct ask_question){.kind = ASK_AROUND,
                                 .near_m = h->start_m,
                                 .to_m = h->near_m + BEYOND_M,
                                 .levels = TILES_LEVELS,
                                 .band = {.attitude = {1, 0, 0, 0},
                                          .from_rad = h->first * PART_RAD,
                                          .width_rad = h->n * PART_RAD,
                                          .parts = h->n}};
}

/* By how much it is uncertain where the newest record lies that showed the part's water. An old one tells nothing of
 * that: the vehicle may have turned since, and brought in what nobody showed. */
static void take_loose(struct promise_look *look, const struct ask *ask, uint32_t k, const struct horizon_now *now)
{
    int i = 0;
    while (i < ask->n && !(ask->part[k].used[i / 64] >> (i % 64) & 1))
        i++;
    if (i == ask->n || sight_seconds(now->now_ns, now->view[i].record->t_ns) > PROMISE_LOOKED_S)
        return;
    look->loose_m = now->view[i].margin_m;
    look->loose_rad = now->view[i].margin_rad;
}

/* What was found from start_m on. */
static void take_part(struct horizon *h, struct promise_look *look, const struct ask *ask, uint32_t k,
                      const struct horizon_now *now)
{
    const struct ask_answer water = ask_end(ask, k);
    if (!(water.free_to_m > h->start_m))
        return;
    if (!h->nominal) {
        if (h->start_m == h->near_m)
            take_loose(look, ask, k, now);
        look->goes_on = look->goes_on || h->start_m == h->near_m;
        look->sure_m = look->sure_m > 0 ? look->sure_m : fmin(water.free_to_m, h->near_m);
    } else if (!look->showed && water.oldest >= 0) {
        look->showed = true;
        look->age_s = sight_seconds(now->now_ns, ask->view[water.oldest].record->t_ns);
        take_loose(look, ask, k, now);
    }
}

/* Is there a part of which nothing is known yet? */
static bool is_open(struct horizon *h)
{
    for (uint32_t k = 0; k < h->n; k++) {
        const struct promise_look *look = &h->look[part_at(h, k)];
        const double az_rad = grid_rad(h, part_at(h, k));
        if (look->goes_on || (h->nominal ? look->showed : look->sure_m > 0))
            continue;
        if (h->nominal ? promise_asks(&h->promise, az_rad, h->near_m)
                       : promise_heeds(&h->promise, az_rad, h->near_m))
            return true;
    }
    return false;
}

bool horizon_take(struct horizon *h, const struct ask *ask, const struct horizon_now *now)
{
    for (uint32_t k = 0; k < h->n; k++)
        take_part(h, &h->look[part_at(h, k)], ask, k, now);
    if (is_open(h) && h->start_m > PROMISE_LEAST * h->near_m) { /* from half of it on, and again */
        h->start_m /= 2;
        return true;
    }
    if (h->nominal)
        return false;
    h->nominal = true;
    h->start_m = h->near_m;
    return is_open(h);
}

/* Half of a rope of 2 cm. A beam that passes no farther beside its middle meets it. */
#define ROPE_M 0.01

/*
 * Was that place in somebody's beam, or so little beside it that nothing thicker than a rope fits there? Or no farther
 * than half of what two of that sonar's beams leave out; thick: than half of what these leave out at `near`. So thin a
 * thing nobody promises to be found there, and no thinner one needs to be found on the way.
 */
static bool is_looked_at(const struct horizon *h, const double v[3], double at_m, bool thick,
                         const struct water_view *look)
{
    const double within_rad = h->promise.frame->looks.gap_rad[look->record->sensor % BEARINGS_SENSORS] / 2;
    const struct water_sought sought = {h->near_m, within_rad,
                                        fmax(ROPE_M, thick ? h->near_m * sin(within_rad) : 0)};
    return !look->lost && water_looks(look, v, at_m, &sought);
}

#define PLACES 48 /* along a ray */

static double place_m(const struct horizon *h, int place)
{
    return h->near_m * (PROMISE_LEAST + (1 - PROMISE_LEAST) * place / PLACES);
}

/* How far along a ray anybody has looked where sonars look, in steps: what stands there has never been in a beam if
 * some of the way has not, whatever was seen behind it from elsewhere. */
static double way_looked_m(const struct horizon *h, double az_rad, bool thick, const struct water_view *looks,
                           int n)
{
    int looked = 0, before = -1;
    double v[3];
    geo_direction(az_rad, 0, v);
    while (looked > before && looked <= PLACES) {
        before = looked;
        for (int i = 0; i < n; i++)
            while (looked <= PLACES && is_looked_at(h, v, place_m(h, looked), thick, &looks[i]))
                looked++;
        while (looked <= PLACES && !promise_looks(&h->promise, az_rad - h->axes_rad, place_m(h, looked)))
            looked++;
    }
    return looked > PLACES ? h->near_m : looked > 0 ? place_m(h, looked - 1) : 0;
}

#define RAYS 4 /* of a part, a third of a degree apart: a lost ping leaves out more */

/* How far all of a part was looked at: to its end, or so far that even what is thin was. */
static double looked_m(const struct horizon *h, uint32_t part, const struct water_view *looks, int n)
{
    double least_m = h->near_m;
    for (int i = 0; i < RAYS && least_m > 0; i++) {
        const double az_rad = (part + (i + 0.5) / RAYS) * PART_RAD;
        double to_m = way_looked_m(h, az_rad, true, looks, n);
        if (to_m > 0 && to_m < h->near_m)
            to_m = way_looked_m(h, az_rad, false, looks, n);
        least_m = fmin(least_m, to_m);
    }
    return least_m;
}

#define FROM_HERE                                                                                                 \
    0.5 /* of `near`: a sonar that was farther away from here saw the water there crosswise, if at all */

/* Has one that was about here seen the water free somewhere beyond near_m, so that it begins too late? Then it is not
 * that nobody has looked. */
static bool begins_late(const struct horizon *h, uint32_t part, const struct water_view *view, int n)
{
    const struct water_tile tile = {{cos(middle_rad(part)), sin(middle_rad(part)), 0}, PART_RAD / 2};
    struct water_pieces said;
    for (int i = 0; i < n; i++) {
        double from_m = h->near_m, to_m = 4 * h->near_m;
        if (view[i].lost || geo_length(view[i].at_m) - view[i].record->lever_m > FROM_HERE * h->near_m ||
            !water_touches(&view[i], &tile, &from_m, &to_m))
            continue;
        water_decide(&view[i], &tile, from_m, to_m, &said);
        for (int k = 0; k < said.n; k++)
            if (said.piece[k].says == WATER_FREE)
                return true;
    }
    return false;
}

/* So far beside water that was shown a part may be its edge. */
static double edge_rad(const struct promise_look *by, double near_m)
{
    if (!(by->loose_m > 0))
        return 0;
    return by->loose_rad + asin(fmin(by->loose_m / near_m, 1)) + PART_RAD;
}

static const struct promise_look *shown_at(const struct horizon *h, uint32_t i)
{
    const struct promise_look *look = i < h->n ? &h->look[part_at(h, i)] : NULL;
    return look && (look->goes_on || look->showed) ? look : NULL;
}

/* What shows nothing itself may be the edge of the nearest water that was shown. */
static void take_edge(struct horizon *h, uint32_t i)
{
    const struct promise_look *by = NULL;
    uint32_t off = 0;
    for (; !by && off < h->n; by = by ? by : shown_at(h, i + off))
        by = ++off <= i ? shown_at(h, i - off) : NULL;
    if (!by || off * PART_RAD > edge_rad(by, h->near_m))
        return;
    struct promise_look *look = &h->look[part_at(h, i)];
    look->loose_m = by->loose_m;
    look->loose_rad = by->loose_rad;
}

void horizon_end(struct horizon *h, const struct water_view *view, int n, const struct water_view *looks,
                 int n_looks)
{
    for (uint32_t i = 0; i < h->n; i++) {
        const uint32_t k = part_at(h, i);
        struct promise_look *look = &h->look[k];
        if (!shown_at(h, i))
            take_edge(h, i);
        if (!h->drifts && look->sure_m == 0 && promise_heeds(&h->promise, grid_rad(h, k), h->near_m))
            look->goes_on = look->goes_on || begins_late(h, k, view, n);
        if (promise_passes(&h->promise, grid_rad(h, k), h->near_m))
            look->looked_m = looked_m(h, k, looks, n_looks);
        h->level_m[k] = promise_m(&h->promise, grid_rad(h, k), look, h->near_m);
    }
}
