/* SPDX-License-Identifier: MIT */
#include "scope.h"

#include <math.h>

/* The narrowest cone, wider than the error of the grid's single-precision axes: a ray along the border of two
 * directions lies in both. */
#define RAY_RAD 1e-4

#define ROUNDING 1e-9 /* far more than squares lose: hypot takes long */

static struct scope_bearing bearing_of(double cosine)
{
    const double c = sight_more(-1, sight_less(1, cosine));
    return (struct scope_bearing){c, sqrt((1 - c) * (1 + c))};
}

/* How far the first lies beyond the second; 0 when it does not. */
static struct scope_bearing beyond(const struct scope_bearing *b, const struct scope_bearing *edge)
{
    if (b->cos >= edge->cos)
        return (struct scope_bearing){1, 0};
    return (struct scope_bearing){b->cos * edge->cos + b->sin * edge->sin,
                                  sight_more(b->sin * edge->cos - b->cos * edge->sin, 0)};
}

/* How far the vehicle is from the centre towards a ray of the cell around v, across the axis, at the most: around the
 * axis its rays lie up to an angle of this sine to both sides of v. */
static double towards_m(const struct scope *s, const double v[3], const struct scope_bearing *b, double reach)
{
    if (b->sin <= reach)
        return s->across_m;
    const double sine = reach / b->sin, middle_m = (geo_dot(s->place.offset_m, v) - b->cos * s->ahead_m) / b->sin;
    const double aside_m = sqrt(sight_more(0, s->across_m * s->across_m - middle_m * middle_m));
    if (middle_m > 0 && aside_m <= sine * s->across_m)
        return s->across_m;
    return middle_m * sqrt(1 - sine * sine) + aside_m * sine;
}

/* How far it may be off the centre across the wall of the question, towards a ray of the cell. */
static double off_m(const struct scope *s, const double v[3], double reach)
{
    const struct scope_bearing b = bearing_of(geo_dot(v, s->axis));
    return sight_more(0, s->cos_wall * towards_m(s, v, &b, reach) - s->sin_wall * s->ahead_m) +
           s->place.uncertain_m;
}

static struct scope_share share_of(const struct scope *s, const double v[3])
{
    const struct answer_query *q = &s->query;
    const struct scope_bearing nearest = bearing_of(cell_edge_nearest(&s->edge.cell, v, s->axis)),
                               outside = beyond(&nearest, &s->edge.wall);
    const double moved_m = s->place.moved_m, off = moved_m > 0 ? off_m(s, v, s->edge.reach) : 0;
    if (!q->corridor) {
        if (outside.sin <= 0 && outside.cos > 0)
            return (struct scope_share){.need_m = q->distance_m};
        return (struct scope_share){.need_m = sight_less(q->distance_m, off / (outside.cos > 0 ? outside.sin : 1)),
                                    .beside = true};
    }
    if (outside.cos < 0)
        return (struct scope_share){0};
    /* The ray nearest to the line leaves by the side last, the one farthest from it by the end; none goes beyond the
     * corner. Ranges are already shorter by moved_m, along the ray; along the line that may be more. */
    const double ahead = outside.cos * s->edge.apart.cos - outside.sin * s->edge.apart.sin;
    const double end = ahead > 1e-12 ? (q->distance_m + moved_m * (1 - ahead)) / ahead : INFINITY;
    const double side = outside.sin > 0 ? (q->radius_m + off) / outside.sin : INFINITY;
    const double leaves = sight_less(end, side), far = q->distance_m + moved_m, aside = q->radius_m + off;
    const bool corner = leaves * leaves > (far * far + aside * aside) * (1 - ROUNDING);
    const double need_m = corner ? sight_less(leaves, hypot(far, aside)) : leaves;
    return (struct scope_share){.need_m = need_m, .side = side < q->distance_m};
}

/* What is alike for all cells of a ring. */
static void enter_ring(struct scope *s, uint32_t ring)
{
    const double reach = fmin(sight_cell_reach(s->rings, ring), GEO_PI / 2),
                 apart = fmin(2 * (reach + s->turned_rad + s->place.adrift_rad), GEO_PI);
    s->ring = ring;
    s->edge.cell = cell_edge_of(s->rings, ring);
    s->edge.reach = sin(reach);
    s->edge.apart = (struct scope_bearing){cos(apart), sin(apart)};
}

#define SURE 1e-6 /* more than the error of single-precision axes */

bool scope_begin(struct scope *s, const struct rings *rings, const struct scope_view *by,
                 const struct answer_query *query)
{
    const struct sight_place *place = by->place;
    const double wall_rad = query->corridor ? 0 : fmin(fmax(query->half_angle_rad, RAY_RAD), GEO_PI);
    const double opening = query->corridor ? GEO_PI / 2 : wall_rad;
    const double beside = query->corridor ? 0 : sight_aside_rad(place, 0);
    double az, el;
    *s = (struct scope){.query = *query,
                        .place = *place,
                        .rings = rings,
                        .ring = RINGS_NONE,
                        .cos_wall = cos(wall_rad),
                        .sin_wall = sin(wall_rad),
                        .turned_rad = query->ned ? 0 : place->turned_rad,
                        .beside_m = beside > 0 ? SIGHT_BESIDE * place->moved_m : 0};
    geo_direction(query->az_rad, query->el_rad, s->axis);
    sight_to_grid(by->frame, by->now, query->ned, s->axis);
    s->ahead_m = geo_dot(place->offset_m, s->axis);
    s->across_m = sqrt(fmax(0, geo_dot(place->offset_m, place->offset_m) - s->ahead_m * s->ahead_m));
    geo_angles(s->axis, &az, &el);
    const double wall = fmin(wall_rad + s->turned_rad, GEO_PI);
    s->edge.wall = (struct scope_bearing){cos(wall), sin(wall)};
    s->sure_cos = query->corridor ? INFINITY : s->edge.wall.cos + SURE;
    s->around_rad = fmin(opening + beside + s->turned_rad + place->adrift_rad + rings->height_rad, GEO_PI);
    s->lo_rad = el - opening - s->turned_rad;
    s->hi_rad = el + opening + s->turned_rad;
    return rings_index(rings, az, el) != RINGS_NONE;
}

struct scope_share scope_share_near(struct scope *s, const double middle[3], uint32_t ring)
{
    double v[3] = {middle[0], middle[1], middle[2]};
    if (ring != s->ring)
        enter_ring(s, ring);
    if (s->place.adrift_rad > 0)
        sight_swing(&s->place, s->axis, v);
    return share_of(s, v);
}
