/* SPDX-License-Identifier: MIT */
#include "beam.h"

#include <math.h>
#include <string.h>

#define ROUNDING 1e-12

#define WIDEST_HALF_RAD 1.45 /* of a beam with flat sides */

/* From the axis to a direction with these components to the side and upward, at most; pi where they bound nothing. */
static double off_axis(double aside, double upward)
{
    const double sine = sqrt(aside * aside + upward * upward);
    return sine < 1 ? asin(sine) : GEO_PI;
}

static double tan_of(double half_rad)
{
    return tan(fmin(half_rad, WIDEST_HALF_RAD));
}

struct beam_opening beam_opening(double az_rad, double el_rad)
{
    const double half_az = fmin(az_rad / 2, GEO_PI), half_el = el_rad / 2;
    const double bend = 1 - cos(fmin(half_az, GEO_PI / 2)); /* of an arc of equal elevation */
    const double aside = sin(fmin(half_az, GEO_PI / 2)), upward = sin(fmin(half_el, GEO_PI / 2)) + bend;
    return (struct beam_opening){.half_az = half_az,
                                 .half_el = half_el,
                                 .sin_az = sin(half_az),
                                 .cos_az = cos(half_az),
                                 .tan_az = tan_of(half_az),
                                 .tan_el = tan_of(half_el),
                                 .aside = aside,
                                 .upward = upward,
                                 .off_rad = off_axis(aside, upward)};
}

void beam_place(struct beam *b, double az_rad, double el_rad, const struct beam_opening *opening,
                const double turn[4], const double origin_m[3])
{
    const double sin_az = sin(az_rad), cos_az = cos(az_rad), cos_el = cos(el_rad);
    *b = (struct beam){.opening = opening,
                       .origin_m = {origin_m[0], origin_m[1], origin_m[2]},
                       .lever_m = sqrt(geo_dot(origin_m, origin_m)),
                       .sin_el = sin(el_rad),
                       .sin_low = sin(fmax(el_rad - opening->half_el, -GEO_PI / 2)),
                       .sin_high = sin(fmin(el_rad + opening->half_el, GEO_PI / 2))};
    const double ahead[3] = {cos_az, sin_az, 0}, side[3] = {-sin_az, cos_az, 0}, down[3] = {0, 0, 1};
    const double axis[3] = {cos_el * cos_az, cos_el * sin_az, -b->sin_el};
    quat_rotate(turn, axis, b->axis);
    quat_rotate(turn, ahead, b->ahead);
    quat_rotate(turn, side, b->side);
    quat_rotate(turn, down, b->down);
    for (int i = 0; i < 3; i++) /* up = side x axis, with z downward */
        b->up[i] = b->side[(i + 1) % 3] * b->axis[(i + 2) % 3] - b->side[(i + 2) % 3] * b->axis[(i + 1) % 3];
    for (int i = 0; i < 3; i++) {
        b->left[i] = opening->sin_az * b->ahead[i] + opening->cos_az * b->side[i];
        b->right[i] = opening->sin_az * b->ahead[i] - opening->cos_az * b->side[i];
    }
    b->offset_m[0] = geo_dot(origin_m, b->axis);
    b->offset_m[1] = geo_dot(origin_m, b->side);
    b->offset_m[2] = geo_dot(origin_m, b->up);
}

void beam_of(struct beam *b, const struct echoes *ping, uint16_t index, const struct beam_opening *opening,
             const double turn[4], const double origin_m[3])
{
    const struct beam_echoes *h = &ping->beam[index];
    beam_place(b, h->az_rad, h->el_rad, opening, turn, origin_m);
    b->ping = ping;
    b->heard = h;
}

struct beam_cell beam_cell_of(double width_rad, double height_rad, double el_rad)
{
    const double across_rad = width_rad * cos(el_rad), half = fmin(width_rad / 2, GEO_PI);
    struct beam_cell cell = {.across_rad = across_rad,
                             .tan_across = tan(fmin(across_rad / 2, WIDEST_HALF_RAD)),
                             .per_level = 1 / cos(el_rad)};
    for (int i = -1; i <= 1; i++) {
        const double el = el_rad + i * height_rad / 2;
        cell.aside = fmax(cell.aside, cos(el) * sin(fmin(half, GEO_PI / 2)));
        for (int k = 0; k <= 1; k++) {
            const double level = cos(el) * cos(k * half);
            cell.upward = fmax(cell.upward, fabs(sin(el) * cos(el_rad) - level * sin(el_rad)));
            cell.inward = fmax(cell.inward, 1 - sin(el) * sin(el_rad) - level * cos(el_rad));
        }
    }
    cell.across = sqrt(cell.aside * cell.aside + cell.upward * cell.upward);
    return cell;
}

/* Half the sides of a cell whose middle is at_m along u, laid on the sphere about the sensor that goes through it. */
struct sides {
    double along[3], up[3];
    double bulge_m; /* the cell is so much nearer or farther than the two say */
};

static struct sides sides_of(const struct beam *b, const struct beam_cell *cell, const double u[3], double at_m)
{
    const double sin_az = u[1] * cell->per_level, cos_az = u[0] * cell->per_level, wide = at_m * cell->aside,
                 high = at_m * cell->upward;
    struct sides s = {.along = {-wide * sin_az, wide * cos_az, 0},
                      .up = {high * u[2] * cos_az, high * u[2] * sin_az, -high * (u[0] * cos_az + u[1] * sin_az)},
                      .bulge_m = at_m * cell->inward};
    if (b->lever_m > 0) {
        const double depth = fmax(at_m - geo_dot(u, b->origin_m), 1e-9 * at_m),
                     along = geo_dot(s.along, b->origin_m) / depth, up = geo_dot(s.up, b->origin_m) / depth;
        for (int i = 0; i < 3; i++) {
            s.along[i] += along * u[i];
            s.up[i] += up * u[i];
        }
        s.bulge_m *= 1 + 2 * b->lever_m / depth;
    }
    return s;
}

/* How far the cell reaches along a unit vector, from its middle. */
static double reach(const struct sides *s, const double n[3])
{
    return fabs(geo_dot(n, s->along)) + fabs(geo_dot(n, s->up));
}

bool beam_sees(const struct beam *b, const struct beam_cell *cell, const struct beam_spot *spot, double most_az,
               double most_el, struct beam_view *view)
{
    const double *u = spot->u, *place_m = spot->place_m, range = spot->range_m;
    const double v[3] = {place_m[0] - b->origin_m[0], place_m[1] - b->origin_m[1], place_m[2] - b->origin_m[2]};
    const double upward = -geo_dot(v, b->down), y = geo_dot(v, b->side), lever_m = b->lever_m;
    /* An angle is at least its sine, and two angles differ at least as much as their sines.
     * The sides reach no farther. */
    const double skewed = 1 + lever_m / fmax(range - 2 * lever_m, 1e-9 * range);
    const double tolerance_m = (range + lever_m) * cell->across * skewed + 1e-9 * range;
    if (fabs(upward - b->sin_el * range) > most_el * range + tolerance_m ||
        fabs(y) > most_az * range + tolerance_m)
        return false;
    const double x = geo_dot(v, b->ahead), level = sqrt(x * x + y * y);
    if (fabs(y) > most_az * level + tolerance_m)
        return false;
    const struct sides sides = sides_of(b, cell, u, sqrt(geo_dot(place_m, place_m)));
    double aside[3], up[3];
    for (int i = 0; i < 3; i++) {
        aside[i] = (x * b->side[i] - y * b->ahead[i]) / fmax(level, 1e-12);
        up[i] = (-level * b->down[i] - upward * (x * b->ahead[i] + y * b->side[i]) / fmax(level, 1e-12)) / range;
    }
    *view = (struct beam_view){.off_az = atan2(y, x),
                               .off_el = atan2(upward, level) - b->heard->el_rad,
                               .wide_rad = fmin(2 * reach(&sides, aside) / level, GEO_TURN),
                               .high_rad = fmin(2 * reach(&sides, up) / range, GEO_PI)};
    return fabs(view->off_az) <= most_az + view->wide_rad / 2 &&
           fabs(view->off_el) <= most_el + view->high_rad / 2;
}

double beam_meet(const struct beam *b, const double u[3], double range_m)
{
    const double *o = b->origin_m;
    double along = geo_dot(u, o);
    double d = along * along - b->lever_m * b->lever_m + range_m * range_m;
    return d < 0 ? -1 : along + sqrt(d);
}

double beam_share(double off, double half, double width)
{
    double share = (half + width / 2 - fabs(off)) / width;
    double most = 2 * half / width;
    share = share < most ? share : most;
    return share < 0 ? 0 : share > 1 ? 1 : share;
}

/* Does any of the cell, with its middle at v from the sensor, lie on the inner side of a plane through the sensor? */
static bool inside(const struct sides *s, const double n[3], const double v[3])
{
    return geo_dot(n, v) + reach(s, n) + s->bulge_m >= 0;
}

bool beam_holds(const struct beam *b, const struct beam_cell *cell, const double u[3], double at_m)
{
    const struct sides sides = sides_of(b, cell, u, at_m);
    double v[3];
    for (int i = 0; i < 3; i++)
        v[i] = at_m * u[i] - b->origin_m[i];
    const double upward = -geo_dot(v, b->down), range = sqrt(geo_dot(v, v)),
                 more = reach(&sides, b->down) + sides.bulge_m;
    if (upward + more < range * b->sin_low || upward - more > range * b->sin_high)
        return false;
    const bool left = inside(&sides, b->left, v), right = inside(&sides, b->right, v);
    return b->opening->half_az > GEO_PI / 2 ? left || right : left && right && inside(&sides, b->ahead, v);
}

/* The least of q . origin / lever over the opening: -1, the beam looks back at the grid's centre; 1, away from it. */
static double least_outward(const struct beam *b, const struct beam_opening *o)
{
    const double *at = b->offset_m;
    if (o->off_rad >= GEO_PI / 2)
        return -1;
    return ((at[0] > 0 ? cos(o->off_rad) : 1) * at[0] - o->aside * fabs(at[1]) - o->upward * fabs(at[2])) /
           b->lever_m;
}

/* The most of (offset + r most) / sqrt(lever^2 + r^2) for r >= range_m; it has one maximum. */
static double most_of(double offset_m, double most, double lever_m, double range_m)
{
    const double at_m =
        offset_m * range_m < most * lever_m * lever_m ? most * lever_m * lever_m / offset_m : range_m;
    return at_m < INFINITY ? (offset_m + at_m * most) / hypot(lever_m, at_m) : most;
}

/*
 * Square to the axis and the offset a place's component is r q's alone: it is bounded by the opening's over what the
 * distance from the centre is of r, at least.
 */
static void bound_square(const struct beam *b, const double most[2], double distance_share, struct beam_sieve *s)
{
    const double aside = b->offset_m[1], upward = b->offset_m[2], across = sqrt(aside * aside + upward * upward);
    if (!(across > 0 && distance_share > 0))
        return;
    s->square[0] = -upward / across;
    s->square[1] = aside / across;
    s->most = (fabs(s->square[0]) * most[0] + fabs(s->square[1]) * most[1]) / distance_share + ROUNDING;
}

/*
 * A place in the beam at range r is at origin + r q, with |q| = 1 and q's components to the side and upward within
 * those of the opening. Its distance from the centre is at least r - lever, which bounds the components the better the
 * farther range_m is; what that bounds only shrinks with growing range. Its square is r^2 + 2 r lever k + lever^2 as
 * well, where k is the cosine between q and the origin, and at least (1 + k) (r^2 + lever^2) where k is negative: that
 * bounds them however long the lever is, unless the beam looks back at the centre.
 */
struct beam_sieve beam_sieve(const struct beam *b, const struct beam_opening *opening, double range_m)
{
    const double most[2] = {opening->aside, opening->upward}, far = range_m - b->lever_m;
    struct beam_sieve s = {.from = {-1, -1}, .to = {1, 1}, .most = 1, .off_rad = opening->off_rad};
    double shrink = 0;
    if (!(far > 0.5 * range_m)) {
        const double outward = least_outward(b, opening);
        shrink = outward < 0 ? sqrt(fmax(1 + outward, 0)) : 1;
    }
    for (int k = 0; k < 2; k++) {
        const double o = b->offset_m[k + 1], low = o < 0 ? -o : 0, high = o > 0 ? o : 0;
        if (far > 0) {
            s.from[k] = fmax(s.from[k], -(low + most[k] * range_m) / far);
            s.to[k] = fmin(s.to[k], (high + most[k] * range_m) / far);
        }
        if (shrink > 0) {
            s.from[k] = fmax(s.from[k], -most_of(low, most[k], b->lever_m, range_m) / shrink);
            s.to[k] = fmin(s.to[k], most_of(high, most[k], b->lever_m, range_m) / shrink);
        }
    }
    bound_square(b, most, fmax(far / range_m, shrink), &s);
    return s;
}

struct beam_sieve beam_sieve_wider(const struct beam_sieve *s, double by_rad)
{
    struct beam_sieve wider = *s;
    for (int k = 0; k < 2; k++) {
        wider.from[k] -= by_rad;
        wider.to[k] += by_rad;
    }
    wider.most += by_rad;
    wider.off_rad += by_rad;
    return wider;
}

struct beam_sieve beam_sieve_either(const struct beam_sieve *a, const struct beam_sieve *b)
{
    struct beam_sieve either = *a; /* the vector is the beam's, or none where nothing is bounded along it */
    for (int k = 0; k < 2; k++) {
        either.from[k] = a->from[k] < b->from[k] ? a->from[k] : b->from[k];
        either.to[k] = a->to[k] > b->to[k] ? a->to[k] : b->to[k];
    }
    either.off_rad = fmax(a->off_rad, b->off_rad);
    either.most = a->most > b->most ? a->most : b->most;
    return either;
}

/*
 * Directions of places are positive sums of the origin and of what the opening holds: they lie in any convex cap that
 * holds these. False: there is none.
 */
static bool hull_cap(const struct beam *b, const struct beam_sieve *s, double middle[3], double *radius)
{
    if (!(b->lever_m > 0))
        return false;
    const double apart = acos(fmax(-1, fmin(b->offset_m[0] / b->lever_m, 1)));
    *radius = apart / 2 + s->off_rad;
    if (*radius >= GEO_PI / 2)
        return false;
    for (int i = 0; i < 3; i++)
        middle[i] = (b->axis[i] + b->origin_m[i] / b->lever_m) / (2 * cos(apart / 2));
    return true;
}

/* The components are the orthographic view of the half sphere around the axis: arcs are longest at the outermost. */
double beam_sieve_cap(const struct beam *b, const struct beam_sieve *s, double middle[3])
{
    double c[3], outermost2 = 0, radius2 = 0;
    for (int k = 0; k < 2; k++) {
        double half = (s->to[k] - s->from[k]) / 2, most = -s->from[k] > s->to[k] ? -s->from[k] : s->to[k];
        c[k + 1] = (s->from[k] + s->to[k]) / 2;
        radius2 += half * half;
        outermost2 += most * most;
    }
    double radius = outermost2 < 1 ? sqrt(radius2 / (1 - outermost2)) : GEO_PI;
    if (radius >= GEO_PI / 2) {
        if (hull_cap(b, s, middle, &radius))
            return radius;
        memcpy(middle, b->axis, sizeof b->axis);
        return GEO_PI;
    }
    c[0] = sqrt(1 - c[1] * c[1] - c[2] * c[2]);
    for (int i = 0; i < 3; i++)
        middle[i] = c[0] * b->axis[i] + c[1] * b->side[i] + c[2] * b->up[i];
    return radius;
}
