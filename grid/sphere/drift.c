/* SPDX-License-Identifier: MIT */
#include "drift.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"

#define TOUCH_RAD 1e-3 /* beams of one ping that are no farther apart overlap: their bearings are rounded */
#define AHEAD_RAD 1e-6 /* a sweep that has turned by less stands still */

size_t drift_bytes(void)
{
    return DRIFT_LOOKS * sizeof(struct drift_look);
}

void drift_init(struct drift *d, void *memory)
{
    *d = (struct drift){.look = memory};
}

static double dot(const float a[3], const float b[3])
{
    return (double)a[0] * (double)b[0] + (double)a[1] * (double)b[1] + (double)a[2] * (double)b[2];
}

static const struct wedge_ping *ping_of(const struct wedges *w, const struct drift_look *look)
{
    return &w->ping[look->ping % WEDGES_PINGS];
}

static const struct wedge *wedge_of(const struct wedges *w, const struct drift_look *look)
{
    return &w->wedge[look->wedge % WEDGES_MAX];
}

/* ---- gathering ---- */

static double drifted_m(const struct wedge_ping *ping, const double drift_m[2])
{
    return hypot(fmax(drift_m[0] - ping->drift_m[0], 0), fmax(drift_m[1] - ping->drift_m[1], 0));
}

/* A beam that is wider is looked at in parts as well: what is in its middle has not left it through its sides. */
#define WIDE_PARTS 8

/* 0: only as a whole. */
static uint32_t parts_of(const struct wedge *wedge, double part_rad)
{
    const double parts = ceil(2 * (double)wedge->half_az_rad / part_rad - TOUCH_RAD);
    return parts > WIDE_PARTS ? (uint32_t)parts : 0;
}

/* A wedge to look at, and its ping, both with their numbers. */
struct source {
    const struct wedge_ping *ping;
    const struct wedge *wedge;
    uint32_t ping_number, wedge_number;
};

static void add_look(struct drift *d, const struct source *of, double az_rad, double half_rad)
{
    const struct wedge_ping *ping = of->ping;
    const struct wedge *wedge = of->wedge;
    const double cos_el = cos((double)wedge->el_rad);
    double ahead[3] = {cos_el * cos(az_rad), cos_el * sin(az_rad), -sin((double)wedge->el_rad)},
           down[3] = {0, 0, 1};
    struct drift_look *look = &d->look[d->n++];
    quat_rotate(ping->attitude, ahead, ahead);
    quat_rotate(ping->attitude, down, down);
    *look = (struct drift_look){.ping = of->ping_number,
                                .wedge = of->wedge_number,
                                .az_rad = (float)az_rad,
                                .half_rad = (float)half_rad,
                                .before = DRIFT_LOOKS,
                                .behind = DRIFT_LOOKS};
    for (int i = 0; i < 3; i++) {
        look->ahead[i] = (float)ahead[i];
        look->down[i] = (float)down[i];
    }
}

static void link_looks(struct drift *d, uint32_t earlier, uint32_t later)
{
    d->look[earlier].behind = (uint16_t)later;
    d->look[later].before = (uint16_t)earlier;
}

/* The whole beam follows the one before of its sensor, *last; its parts follow each other. */
static void add_looks(struct drift *d, const struct source *of, uint32_t parts, uint16_t *last)
{
    const struct wedge *wedge = of->wedge;
    const double half = (double)wedge->half_az_rad / fmax(1, parts);
    add_look(d, of, (double)wedge->az_rad, (double)wedge->half_az_rad);
    if (*last != DRIFT_LOOKS)
        link_looks(d, *last, d->n - 1);
    *last = (uint16_t)(d->n - 1);
    for (uint32_t k = 0; k < parts; k++) {
        add_look(d, of, (double)wedge->az_rad + half * (2.0 * k + 1 - parts), half);
        if (k > 0)
            link_looks(d, d->n - 2, d->n - 1);
    }
}

/* Number of the first ping whose looks, and those of all later ones, there is room for. */
static uint32_t first_ping(const struct wedges *w, const double drift_m[2], double most_m, double part_rad)
{
    uint32_t first = w->end, n = 0;
    for (; first != w->first; first--) {
        const struct wedge_ping *ping = &w->ping[(first - 1) % WEDGES_PINGS];
        for (uint32_t i = 0; i < ping->n; i++)
            n += 1 + parts_of(wedges_of(w, ping, i), part_rad);
        if (n > DRIFT_LOOKS || drifted_m(ping, drift_m) >= most_m)
            break;
    }
    return first;
}

uint32_t drift_gather(struct drift *d, const struct wedges *w, const double drift_m[2], double most_m,
                      double part_rad)
{
    uint16_t newest[64];
    d->n = 0;
    for (int i = 0; i < 64; i++)
        newest[i] = DRIFT_LOOKS;
    for (uint32_t k = first_ping(w, drift_m, most_m, part_rad); k != w->end; k++) {
        const struct wedge_ping *ping = &w->ping[k % WEDGES_PINGS];
        for (uint32_t i = 0; i < ping->n; i++) {
            const struct source of = {ping, wedges_of(w, ping, i), k, ping->first + i};
            add_looks(d, &of, parts_of(of.wedge, part_rad), &newest[ping->sensor % 64]);
        }
    }
    return d->n;
}

/* ---- runs ---- */

/* Two looks of which one follows the other. */
struct joint {
    double turn_rad; /* from the earlier to the later, clockwise about the sensor's z */
    double from_m;   /* nearer, a thing may have slipped through between them */
};

static double apart_m(const struct wedge_ping *a, const struct wedge_ping *b)
{
    const double v[3] = {a->place_m[0] - b->place_m[0], a->place_m[1] - b->place_m[1],
                         a->place_m[2] - b->place_m[2]};
    return geo_length(v);
}

/*
 * How far the sensor may have gone across an edge of the earlier look between the two: what it went along the edge,
 * such as a level head up or down, lets nothing past. Who slipped through was beyond that edge first, and is so far
 * behind it from where the sensor then is: the range times the sine of the overlap. side: to the right of that look.
 */
static double across_m(const struct wedges *w, const struct drift_look *earlier, const struct drift_look *later,
                       const float side[3])
{
    const struct wedge_ping *a = ping_of(w, earlier), *b = ping_of(w, later);
    const double aslant = sin(fmin((double)earlier->half_rad, GEO_PI / 2));
    double way = 0, ahead = 0;
    for (int i = 0; i < 3; i++) {
        way += (b->place_m[i] - a->place_m[i]) * (double)side[i];
        ahead += (b->place_m[i] - a->place_m[i]) * (double)earlier->ahead[i];
    }
    const double steep = fabs((double)side[2]) + aslant * fabs((double)earlier->ahead[2]);
    return fabs(way) + aslant * fabs(ahead) + fmax(b->drift_m[0] - a->drift_m[0], 0) +
           steep * fmax(b->drift_m[1] - a->drift_m[1], 0);
}

/* False: they do not overlap, or are no neighbours. */
static bool join_looks(const struct wedges *w, const struct drift_look *earlier, const struct drift_look *later,
                       struct joint *out)
{
    const struct wedge *a = wedge_of(w, earlier), *b = wedge_of(w, later);
    const double ahead = dot(earlier->ahead, later->ahead);
    float side[3]; /* of the earlier one: z x ahead */
    if (a->el_rad != b->el_rad || a->kind != WEDGE_FREE || b->kind != WEDGE_FREE)
        return false;
    for (int i = 0; i < 3; i++)
        side[i] = earlier->down[(i + 1) % 3] * earlier->ahead[(i + 2) % 3] -
                  earlier->down[(i + 2) % 3] * earlier->ahead[(i + 1) % 3];
    out->turn_rad = atan2(dot(side, later->ahead), ahead);
    out->from_m = 0;
    const double over = (double)earlier->half_rad + (double)later->half_rad - fabs(out->turn_rad);
    const double between_m = across_m(w, earlier, later, side);
    if (between_m <= 0)
        return over >= -TOUCH_RAD;
    if (over <= 0)
        return false;
    out->from_m = between_m / sin(fmin(over, GEO_PI / 2));
    return true;
}

/* The run around a look, as far as it has grown. */
struct run {
    const struct drift *drift;
    const struct wedges *wedges;
    const double *drift_m;
    const struct drift_look *middle;
    uint16_t end[2];         /* the oldest and the newest look of it */
    double wide_rad[2];      /* it reaches so far beyond the middle one's edges, on the side of each */
    double sense;            /* of the sweep: 1, -1; 0: not known yet */
    struct beam_water water; /* what all of them found free, from their own sensors; and their joints */
    double slip_m;
    double apart_m, tilt_rad;
};

static void take_in(struct run *r, const struct drift_look *look)
{
    const struct wedge *wedge = wedge_of(r->wedges, look);
    const struct wedge_ping *ping = ping_of(r->wedges, look);
    const struct beam_water other = wedges_water(wedge);
    r->water = (struct beam_water){
        fmax(r->water.from_m, other.from_m),       fmin(r->water.to_m, other.to_m),
        fmin(r->water.side_to_m, other.side_to_m), fmax(r->water.edge_from_m, other.edge_from_m),
        fmin(r->water.edge_to_m, other.edge_to_m), r->water.nested || other.nested};
    r->apart_m = fmax(r->apart_m, apart_m(ping, ping_of(r->wedges, r->middle)) + (double)ping->uncertain_m);
    r->tilt_rad = fmax(r->tilt_rad, acos(fmin(1, dot(look->down, r->middle->down))));
}

/* By one look on side 0 (older) or 1 (newer). False: the run ends there. */
static bool grow(struct run *r, int side)
{
    const struct drift_look *all = r->drift->look, *end = &all[r->end[side]];
    const uint16_t next = side ? end->behind : end->before;
    struct joint joint;
    if (next == DRIFT_LOOKS || !join_looks(r->wedges, side ? end : &all[next], side ? &all[next] : end, &joint))
        return false;
    const double sense = fabs(joint.turn_rad) < AHEAD_RAD ? 0 : joint.turn_rad > 0 ? 1 : -1;
    if (sense * r->sense < 0) /* the head turned back */
        return false;
    r->sense = sense != 0 ? sense : r->sense;
    r->wide_rad[side] += fabs(joint.turn_rad) + (double)all[next].half_rad - (double)end->half_rad;
    r->slip_m = fmax(r->slip_m, joint.from_m);
    r->end[side] = next;
    take_in(r, &all[next]);
    return true;
}

/* What the run frees. False: nothing, and no wider one does. */
static bool worth_of(const struct run *r, struct drift_worth *out)
{
    const struct wedge_ping *oldest = ping_of(r->wedges, &r->drift->look[r->end[0]]);
    const double wide_rad = fmin(r->wide_rad[0], r->wide_rad[1]);
    for (int k = 0; k < 2; k++)
        out->drift_m[k] = fmax(r->drift_m[k] - oldest->drift_m[k], 0);
    const double off_m = hypot(out->drift_m[0], out->drift_m[1]) + r->apart_m;
    out->apart_m = r->apart_m;
    out->tilt_rad = r->tilt_rad;
    out->water = beam_water_less(&r->water, off_m);
    if (out->water.to_m <= out->water.from_m)
        return false;
    double from_m = fmax(out->water.from_m, r->slip_m + off_m);
    if (wide_rad < GEO_PI / 2)
        from_m = wide_rad > 0 ? fmax(from_m, off_m / sin(wide_rad)) : (double)INFINITY;
    out->water.from_m = from_m;
    out->water.edge_from_m = fmax(out->water.edge_from_m, from_m);
    return true;
}

/* Where water that begins nearer, and ends at to_m, ends with what narrower runs freed. */
static double joined_to(double from_m, double narrower_to_m, double to_m)
{
    return to_m >= from_m ? fmax(to_m, narrower_to_m) : to_m;
}

/* The water of a wider run joins what narrower ones freed, where they touch; else the longer is kept. */
static void add_worth(struct drift_worth *all, const struct drift_worth *wider)
{
    const struct beam_water was = all->water, *is = &wider->water;
    if (!(is->to_m > is->from_m))
        return;
    if (was.to_m > was.from_m && is->to_m < was.from_m && is->to_m - is->from_m <= was.to_m - was.from_m)
        return;
    *all = *wider;
    if (was.to_m > was.from_m && is->to_m >= was.from_m) {
        all->water.from_m = fmin(was.from_m, is->from_m);
        all->water.to_m = fmax(was.to_m, is->to_m);
        all->water.side_to_m = joined_to(was.from_m, was.side_to_m, is->side_to_m);
        all->water.edge_to_m = joined_to(was.edge_from_m, was.edge_to_m, is->edge_to_m);
    }
}

/* The row of beams of which a part is looked at that is off_rad from its middle. Of a single beam it is counted as if
 * it were as far off the axis all over as where it is farthest. */
static struct beam_row row_of_part(const struct beam_row *row, float off_rad, float half_rad)
{
    struct beam_row part = *row;
    part.left_rad = part.right_rad = half_rad;
    part.several = true;
    if (row->several) {
        part.left_rad = fminf(half_rad, off_rad + row->left_rad);
        part.right_rad = fminf(half_rad, row->right_rad - off_rad);
    } else {
        part.seam_rad = fabsf(off_rad) + half_rad;
    }
    return part;
}

void drift_narrow(struct wedge *w, const struct drift_look *look)
{
    if (look->half_rad == w->half_az_rad)
        return;
    w->row = row_of_part(&w->row, look->az_rad - w->az_rad, look->half_rad);
    w->az_rad = look->az_rad;
    w->half_az_rad = look->half_rad;
}

bool drift_judge(const struct drift *d, const struct wedges *w, const double drift_m[2], uint32_t i,
                 struct drift_worth *out)
{
    struct run r = {.drift = d,
                    .wedges = w,
                    .drift_m = drift_m,
                    .middle = &d->look[i],
                    .end = {(uint16_t)i, (uint16_t)i},
                    .water = beam_water_alike(0, INFINITY)};
    struct drift_worth wider;
    *out = (struct drift_worth){0};
    take_in(&r, r.middle);
    while (fmin(r.wide_rad[0], r.wide_rad[1]) < GEO_PI / 2 && grow(&r, r.wide_rad[0] > r.wide_rad[1])) {
        if (fmin(r.wide_rad[0], r.wide_rad[1]) <= 0)
            continue;
        if (!worth_of(&r, &wider))
            break;
        add_worth(out, &wider);
    }
    return out->water.to_m > out->water.from_m;
}
