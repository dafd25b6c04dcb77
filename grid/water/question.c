/* SPDX-License-Identifier: MIT */
#include "question.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"

#define ROUNDING 1e-9

static double clamped(double x, double lo, double hi)
{
    return x < lo ? lo : x > hi ? hi : x;
}

/* From the least to the greatest angle. */
struct angles {
    double lo, hi;
};

/* Of the tile's directions against the axis. */
static struct angles angles_off(const struct question_shape *q, const struct water_tile *tile)
{
    const double off = acos(clamped(geo_dot(tile->v, q->asked.axis), -1, 1)),
                 half = tile->half_rad + q->asked.loose_rad;
    return (struct angles){fmax(off - half - ROUNDING, 0), fmin(off + half + ROUNDING, GEO_PI)};
}

/* Of the tile's directions above a plane with that normal; both ways alike. */
static struct angles angles_above(const struct question_shape *q, const struct water_tile *tile,
                                  const double normal[3])
{
    const double above = fabs(asin(clamped(geo_dot(tile->v, normal), -1, 1))),
                 half = tile->half_rad + q->asked.loose_rad + ROUNDING;
    return (struct angles){fmax(above - half, 0), fmin(above + half, GEO_PI / 2)};
}

static double over(double length, double share)
{
    return share > 0 ? length / share : INFINITY;
}

/* ---- round corridors ---- */

/* The longest way of a ray within the angles in a round corridor of that radius and length. */
static double longest_in(double radius_m, double to_m, struct angles off)
{
    const double corner = atan2(radius_m, to_m);
    if (off.lo >= GEO_PI / 2)
        return 0;
    return off.hi <= corner   ? over(to_m, cos(off.hi))
           : off.lo >= corner ? over(radius_m, sin(off.lo))
                              : hypot(radius_m, to_m);
}

/* The least way along it to what lies no nearer than free_m. */
static double least_along(double radius_m, double free_m, struct angles off)
{
    const double by_angle = free_m * cos(off.hi), wall2 = free_m * free_m - radius_m * radius_m;
    return fmax(0, fmax(by_angle, wall2 > 0 ? sqrt(wall2) : 0));
}

/* ---- a body that moves ---- */

static void scale(double v[3], double factor)
{
    for (int i = 0; i < 3; i++)
        v[i] *= factor;
}

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* The cylinder's support along a direction with that share of its own axis (a sine). */
static double extent(const struct ask_body *body, double upright)
{
    const double across = sqrt(fmax(0, 1 - upright * upright));
    return body->half_height_m * fabs(upright) + body->radius_m * across + body->margin_m;
}

#define STEEP                                                                                                     \
    1e-6 /* a line this near to the cylinder's axis has no side: any will do, the cross-section is round */

/* Where a body is nothing stands upright, nor does it above or below it. A way that has gone aside by less than this
 * has not left that place: no pose is so certain. */
#define UPRIGHT_M 0.01

static void begin_move(struct question_shape *q)
{
    const struct ask_body *body = &q->asked.body;
    const double *along = q->asked.axis, slope = geo_dot(body->up, along);
    const double any[3] = {fabs(along[0]) < 0.7, fabs(along[0]) >= 0.7, 0};
    cross(along, body->up, q->side);
    if (geo_dot(q->side, q->side) < STEEP * STEEP)
        cross(along, any, q->side);
    scale(q->side, 1 / geo_length(q->side));
    cross(q->side, along, q->up);
    q->across = sqrt(fmax(0, 1 - slope * slope));
    q->front_m = extent(body, slope);
    q->half_width_m = body->radius_m + body->margin_m;
    q->half_height_m = extent(body, q->across);
    q->drift_side_m = geo_dot(body->drift_m, q->side);
    q->drift_up_m = geo_dot(body->drift_m, q->up);
    q->round_m = body->radius_m + body->margin_m;
    q->flat_m = body->margin_m * fabs(slope);
    q->upright_m = over(UPRIGHT_M, hypot(along[0], along[1]));
}

/* The longest way of a ray of the tile to the wall at half_m on its side, which is farther by the drift towards it. */
static double longest_to_wall(const struct question_shape *q, const struct water_tile *tile,
                              const double normal[3], double half_m, double drift_m)
{
    const struct angles above = angles_above(q, tile, normal);
    const double towards_m = geo_dot(tile->v, normal) < 0 ? -drift_m : drift_m;
    return over(half_m + fmax(towards_m, 0), sin(above.lo));
}

static double widest_m(const struct question_shape *q)
{
    return hypot(q->half_width_m + fabs(q->drift_side_m), q->half_height_m + fabs(q->drift_up_m));
}

static double longest_in_sweep(const struct question_shape *q, const struct water_tile *tile, double to_m)
{
    const double round_m = longest_in(widest_m(q), to_m, angles_off(q, tile));
    const double side_m = longest_to_wall(q, tile, q->side, q->half_width_m, q->drift_side_m);
    return fmin(round_m, fmin(side_m, longest_to_wall(q, tile, q->up, q->half_height_m, q->drift_up_m)));
}

/*
 * By how much farther ahead than its way along the line something counts that is at least so far to the side, for the
 * body's front is round. Its cross-section at y to the side is a box as high as the body and sqrt(R^2 - y^2) long; it
 * reaches ahead by sqrt(R^2 - y^2) across + H slope, R and H with the margin.
 */
static double behind_front_m(const struct question_shape *q, double side_m)
{
    const double y = clamped(side_m - fabs(q->drift_side_m), 0, q->round_m);
    return fmax(0, (q->round_m - sqrt(q->round_m * q->round_m - y * y)) * q->across - q->flat_m);
}

static double along_sweep(const struct question_shape *q, const struct water_tile *tile, double free_m)
{
    const double side_m = free_m * sin(angles_above(q, tile, q->side).lo);
    return least_along(widest_m(q), free_m, angles_off(q, tile)) + behind_front_m(q, side_m);
}

/* ---- a body that stays ---- */

/* How far a ray at that angle above its level plane goes within a cylinder. */
static double way_out(double radius_m, double half_height_m, double above_rad)
{
    return fmin(over(radius_m, cos(above_rad)), over(half_height_m, sin(above_rad)));
}

static double longest_out(double radius_m, double half_height_m, struct angles above)
{
    const double corner = atan2(half_height_m, radius_m);
    if (above.lo <= corner && above.hi >= corner)
        return hypot(radius_m, half_height_m);
    return way_out(radius_m, half_height_m, above.hi <= corner ? above.hi : above.lo);
}

static double shortest_out(double radius_m, double half_height_m, struct angles above)
{
    return fmin(way_out(radius_m, half_height_m, above.lo), way_out(radius_m, half_height_m, above.hi));
}

static bool stretch_around_body(const struct question_shape *q, const struct water_tile *tile, double to_m,
                                struct ask_stretch *s)
{
    const struct ask_body *body = &q->asked.body;
    const struct angles above = angles_above(q, tile, body->up);
    s->from_m = fmax(q->asked.near_m, shortest_out(body->radius_m, body->half_height_m, above));
    s->to_m = longest_out(body->radius_m + to_m, body->half_height_m + to_m, above);
    return s->from_m < s->to_m;
}

/* The least distance from the cylinder of what lies no nearer than free_m. */
static double around_body(const struct question_shape *q, const struct water_tile *tile, double free_m)
{
    const struct ask_body *body = &q->asked.body;
    const struct angles above = angles_above(q, tile, body->up);
    return fmax(0, fmax(free_m * cos(above.hi) - body->radius_m, free_m * sin(above.lo) - body->half_height_m));
}

/* ---- bands ---- */

static void begin_band(struct question_shape *q)
{
    double up[3] = {0, 0, -1};
    quat_rotate(q->asked.band.attitude, up, up);
    q->tilt_rad = acos(clamped(-up[2], -1, 1));
    if (q->asked.band.width_rad <= 0)
        return;
    const struct ask_band *band = &q->asked.band;
    const double high = band->hi_rad - band->lo_rad;
    geo_direction(band->from_rad + band->width_rad / 2, (band->lo_rad + band->hi_rad) / 2, q->asked.axis);
    quat_rotate(band->attitude, q->asked.axis, q->asked.axis);
    q->bound_rad = (band->width_rad + high) / 2 + ROUNDING;
}

/* Do the elevations, NED, touch the band, however it is tilted? */
static bool may_touch_band(const struct question_shape *q, double el_rad, double half_rad)
{
    const struct ask_band *band = &q->asked.band;
    const double reach = half_rad + q->tilt_rad + q->asked.loose_rad + ROUNDING;
    return el_rad + reach >= band->lo_rad && el_rad - reach <= band->hi_rad;
}

/* Of parts side by side from from_rad on those within `aside` of az. */
static struct question_run run_in_width(const struct ask_band *band, double az_rad, double aside_rad)
{
    const double width = band->width_rad > 0 ? band->width_rad : GEO_TURN, part = width / (double)band->parts;
    const double off = geo_wrap_pi(az_rad - band->from_rad - width / 2);
    if (fabs(off) > width / 2 + aside_rad)
        return (struct question_run){0, 0};
    if (off + aside_rad > GEO_PI || off - aside_rad < -GEO_PI) /* it may touch both ends */
        return (struct question_run){0, band->parts};
    const double most = (double)band->parts - 1, from = floor((off - aside_rad + width / 2) / part),
                 to = floor((off + aside_rad + width / 2) / part);
    const size_t first = (size_t)clamped(from, 0, most);
    return (struct question_run){first, (size_t)clamped(to, 0, most) - first + 1};
}

/* In a band, the parts that a tile touches: those of its azimuths. */
static struct question_run run_in_band(const struct question_shape *q, const struct water_tile *tile)
{
    const struct ask_band *band = &q->asked.band;
    const double half = tile->half_rad + q->asked.loose_rad + ROUNDING;
    double v[3], az, el;
    quat_rotate_inverse(band->attitude, tile->v, v);
    geo_angles(v, &az, &el);
    if (el + half < band->lo_rad || el - half > band->hi_rad)
        return (struct question_run){0, 0};
    const double aside = fabs(el) + half >= GEO_PI / 2 ? GEO_PI : asin(fmin(1, sin(half) / cos(el)));
    if (band->parts == 1 || band->width_rad > 0)
        return run_in_width(band, az, aside);
    const double width = GEO_TURN / (double)band->parts;
    const long first = (long)ceil((az - aside) / width - 0.5), last = (long)floor((az + aside) / width + 0.5);
    if (last - first + 1 >= (long)band->parts)
        return (struct question_run){0, band->parts};
    return (struct question_run){(size_t)(first + (long)band->parts) % band->parts, (size_t)(last - first + 1)};
}

/* ---- all of them ---- */

/* How far from its axis a corridor reaches from where on it is asked. */
static double bound_of(double radius_m, const struct ask_question *q)
{
    double near_m = q->near_m;
    for (int k = 0; q->level_m && k < ASK_LEVEL; k++)
        near_m = fmin(near_m, q->level_m[k]);
    return near_m > radius_m ? asin(radius_m / near_m) : GEO_PI / 2;
}

void question_begin(struct question_shape *q, const struct ask_question *asked)
{
    *q = (struct question_shape){.asked = *asked, .parts = 1, .bound_rad = GEO_PI};
    q->asked.levels = asked->levels ? asked->levels : TILES_LEVELS;
    if (asked->kind == ASK_CONE)
        q->bound_rad = asked->half_rad;
    else if (asked->kind == ASK_CORRIDOR)
        q->bound_rad = bound_of(asked->radius_m, asked);
    else if (asked->kind == ASK_MOVE) {
        begin_move(q);
        q->bound_rad = bound_of(widest_m(q), asked);
    } else if (asked->kind == ASK_AROUND) {
        begin_band(q);
        q->parts = asked->band.parts;
    }
    q->bound_rad = fmin(q->bound_rad + asked->loose_rad, GEO_PI);
    if (q->bound_rad < GEO_PI)
        geo_angles(q->asked.axis, &q->az_rad, &q->el_rad);
}

#define WIDEST_RAD 0.1 /* no tile is wider to any side of its middle */

/* May a tile whose middle has that elevation be asked? */
static bool may_ask_row(const struct question_shape *q, double el_rad, double half_rad)
{
    if (q->asked.kind == ASK_AROUND && !may_touch_band(q, el_rad, half_rad))
        return false;
    return q->bound_rad >= GEO_PI || fabs(el_rad - q->el_rad) <= q->bound_rad + half_rad + ROUNDING;
}

uint32_t question_columns(const struct question_shape *q, uint32_t row, uint32_t *n)
{
    const struct tile_index first = {0, (uint16_t)row, 0};
    const double row_el = geo_rad((row + 0.5) * (180.0 / TILES_ROWS) - 90);
    *n = 0;
    if (!may_ask_row(q, row_el, WIDEST_RAD))
        return 0;
    const uint32_t columns = tiles_columns(row);
    const double half = tiles_cone(&first).half_rad, reach = q->bound_rad + half, wide = GEO_TURN / columns;
    if (!may_ask_row(q, row_el, half))
        return 0;
    *n = columns;
    /* the cone's own azimuths reach asin(sin(reach) / cos(el)) to each side, unless it holds a pole */
    if (q->bound_rad >= GEO_PI || fabs(q->el_rad) + reach >= GEO_PI / 2)
        return 0;
    const double aside = asin(fmin(1, sin(reach) / cos(q->el_rad)));
    const int from = (int)floor((q->az_rad - aside) / wide), to = (int)floor((q->az_rad + aside) / wide);
    *n = (uint32_t)(to - from + 1) < columns ? (uint32_t)(to - from + 1) : columns;
    return (uint32_t)(from + (int)columns) % columns;
}

struct question_run question_run(const struct question_shape *q, const struct water_tile *tile)
{
    const double reach = q->bound_rad + tile->half_rad;
    if (q->asked.kind == ASK_AROUND)
        return run_in_band(q, tile);
    return (struct question_run){0, reach >= GEO_PI || geo_dot(tile->v, q->asked.axis) >= cos(reach) - 1e-12};
}

#define PROBES_PART 3
#define PROBES_CONE 5

/* Of a part of a band: at its lower rim, in its middle and at its upper rim. */
static void probe_band(const struct ask_band *band, size_t i, double v[3])
{
    const bool all = band->width_rad <= 0;
    const double wide = (all ? GEO_TURN : band->width_rad) / (double)band->parts, part = (double)(i / PROBES_PART);
    const double az = all ? part * wide : band->from_rad + (part + 0.5) * wide;
    geo_direction(az, band->lo_rad + (band->hi_rad - band->lo_rad) * (double)(i % PROBES_PART) / 2, v);
    quat_rotate(band->attitude, v, v);
}

/* Of a cone: its axis, and four directions of its rim. */
static void probe_cone(const double axis[3], double half_rad, size_t i, double v[3])
{
    const double any[3] = {fabs(axis[0]) < 0.7, fabs(axis[0]) >= 0.7, 0};
    const double turn = (double)i * GEO_TURN / 4, aside = i ? sin(half_rad) : 0, along = i ? cos(half_rad) : 1;
    double right[3], down[3];
    cross(axis, any, right);
    scale(right, 1 / geo_length(right));
    cross(axis, right, down);
    for (int k = 0; k < 3; k++)
        v[k] = along * axis[k] + aside * (cos(turn) * right[k] + sin(turn) * down[k]);
}

bool question_probe(const struct question_shape *q, size_t i, double v[3])
{
    switch (q->asked.kind) {
    case ASK_CONE:
        probe_cone(q->asked.axis, q->asked.half_rad, i, v);
        return i < PROBES_CONE;
    case ASK_CORRIDOR:
    case ASK_MOVE:
        memcpy(v, q->asked.axis, sizeof q->asked.axis);
        return i < 1;
    case ASK_AROUND:
        probe_band(&q->asked.band, i, v);
        return i < PROBES_PART * q->parts;
    case ASK_STAY:
        break;
    }
    return false;
}

/* From where on the tile is asked, but for a body's own place: of what stands upright what is seen higher or lower is
 * farther along the ray. */
static double from_of(const struct question_shape *q, const struct water_tile *tile)
{
    const double half = tile->half_rad + q->asked.loose_rad + ROUNDING, level = hypot(tile->v[0], tile->v[1]);
    double from_m = q->asked.near_m;
    if (!q->asked.level_m)
        return from_m;
    const double az = atan2(tile->v[1], tile->v[0]), part = GEO_TURN / ASK_LEVEL;
    const double aside = level > sin(half) ? asin(sin(half) / level) : GEO_PI;
    const double flattest = cos(fmax(atan2(fabs(tile->v[2]), level) - half, 0));
    for (int k = (int)floor((az - aside) / part); k <= (int)floor((az + aside) / part); k++)
        from_m = fmin(from_m, q->asked.level_m[(k + 2 * ASK_LEVEL) % ASK_LEVEL] / flattest);
    if (q->asked.kind == ASK_MOVE)
        from_m = fmax(from_m, over(q->upright_m, cos(angles_off(q, tile).lo)));
    return fmin(from_m, q->asked.near_m);
}

bool question_stretch(const struct question_shape *q, const struct water_tile *tile, double to_m,
                      struct ask_stretch *s)
{
    *s = (struct ask_stretch){from_of(q, tile), to_m};
    switch (q->asked.kind) {
    case ASK_CORRIDOR:
        s->to_m = longest_in(q->asked.radius_m, to_m, angles_off(q, tile));
        break;
    case ASK_MOVE:
        s->to_m = longest_in_sweep(q, tile, to_m);
        if (q->asked.near_m <= 0)
            s->from_m = over(q->front_m, cos(angles_off(q, tile).lo));
        break;
    case ASK_STAY:
        return stretch_around_body(q, tile, to_m, s);
    case ASK_CONE:
    case ASK_AROUND:
        break;
    }
    return s->from_m < s->to_m;
}

double question_measure(const struct question_shape *q, const struct water_tile *tile, double free_m)
{
    switch (q->asked.kind) {
    case ASK_CORRIDOR:
        return least_along(q->asked.radius_m, free_m, angles_off(q, tile));
    case ASK_MOVE:
        return along_sweep(q, tile, free_m);
    case ASK_STAY:
        return around_body(q, tile, free_m);
    case ASK_CONE:
    case ASK_AROUND:
        break;
    }
    return free_m;
}
