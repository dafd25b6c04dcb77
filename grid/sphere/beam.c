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

const double beam_part_share[BEAM_PARTS] = {[BEAM_AXIS] = BEAM_AXIS_SHARE, [BEAM_SIDE] = BEAM_SIDE_SHARE};

static double tan_of(double half_rad)
{
    return tan(fmin(half_rad, WIDEST_HALF_RAD));
}

/* Where no beam is on that side, the beam's own ellipse at the height of the row ends it: as far off as the seam. */
static double row_reach(const struct beam_row *row, float side_rad, double more_rad)
{
    return side_rad > 0 ? (double)side_rad + more_rad : (double)row->seam_rad;
}

void beam_row_open(struct beam_opening *o, const struct beam_row *row, double less_az_rad, double less_el_rad)
{
    const double half_az = (double)row->half_az_rad, half_el = (double)row->half_el_rad;
    const double seam = ((double)row->seam_rad + less_az_rad) / half_az;
    o->axes[0] = row->several ? 0 : half_az;
    o->axes[1] = row->several ? 0 : half_el;
    o->less[0] = less_az_rad;
    o->less[1] = less_el_rad;
    for (enum beam_part k = 0; k < BEAM_PARTS; k++) {
        const double share = beam_part_share[k];
        o->patch[k] = (struct beam_patch){0};
        if (!(row->left_rad + row->right_rad > 0 && seam <= share))
            continue;
        const double more = (share - seam) * half_az; /* of the beam's own part, beyond the seam */
        o->patch[k] =
            (struct beam_patch){.tan_left = (1 + BEAM_EDGE) * tan_of(row_reach(row, row->left_rad, more)),
                                .tan_right = (1 + BEAM_EDGE) * tan_of(row_reach(row, row->right_rad, more)),
                                .tan_el = tan_of(sqrt(share * share - seam * seam) * half_el - less_el_rad)};
    }
}

struct beam_opening beam_opening(double az_rad, double el_rad, double height_rad, bool level)
{
    const double half_az = fmin(az_rad / 2, GEO_PI), half_el = el_rad / 2, within = half_el - height_rad / 2;
    const double bend = 1 - cos(fmin(half_az, GEO_PI / 2)); /* of an arc of equal elevation */
    const bool too_high = !level && height_rad > 4 * half_el;
    const double aside = sin(fmin(half_az, GEO_PI / 2)), upward = sin(fmin(half_el, GEO_PI / 2)) + bend;
    struct beam_opening o = {
        .half_az = half_az,
        .half_el = half_el,
        .sin_az = sin(half_az),
        .cos_az = cos(half_az),
        .aside = aside,
        .upward = upward,
        .off_rad = off_axis(aside, upward),
        .tan_az = tan_of(half_az),
        .tan_el = tan_of(within > 0 || level ? within : height_rad / 2),
        .tan_high = tan_of(half_el),
        .widest_rad = too_high ? 0 : 4 * half_az,
    };
    beam_row_open(&o, &(struct beam_row){.half_az_rad = (float)half_az, .half_el_rad = (float)half_el}, 0, 0);
    return o;
}

struct beam_opening beam_opening_freed(const struct beam_opening *own, double cell_width_rad)
{
    const double half_az = (1 + BEAM_EDGE) * fmax(own->half_az, cell_width_rad / 2), tan_el = fmax(own->tan_el, 0);
    const double aside = sin(fmin(half_az, WIDEST_HALF_RAD)), upward = tan_el / sqrt(1 + tan_el * tan_el);
    return (struct beam_opening){.aside = aside, .upward = upward, .off_rad = off_axis(aside, upward)};
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

void beam_blur(struct beam *b, const double blur_m[3], double any_m)
{
    memcpy(b->blur_m, blur_m, sizeof b->blur_m);
    b->margin_m = any_m;
}

/*
 * A place r from the sensor, with the line's components `along` and `across` as seen there, is at most
 * hypot(r + along, across) and at least r - along from wherever on the line the sensor is.
 */
struct beam_water beam_surely_free(const struct beam *b, const struct beam_water *w)
{
    const struct pose_blur blur = pose_blur_of(b->blur_m, b->axis, b->opening->off_rad);
    const double off_m = blur.along_m + b->margin_m, across2 = blur.across_m * blur.across_m;
    if (!(off_m > 0 || across2 > 0))
        return *w;
    const struct beam_water within = {w->from_m,
                                      sqrt(fmax(w->to_m * w->to_m - across2, 0)),
                                      sqrt(fmax(w->side_to_m * w->side_to_m - across2, 0)),
                                      w->edge_from_m,
                                      sqrt(fmax(w->edge_to_m * w->edge_to_m - across2, 0)),
                                      w->nested};
    return beam_water_less(&within, off_m);
}

struct beam_water beam_water_less(const struct beam_water *w, double by_m)
{
    return (struct beam_water){w->from_m + by_m,      w->to_m - by_m,      w->side_to_m - by_m,
                               w->edge_from_m + by_m, w->edge_to_m - by_m, w->nested};
}

struct beam_cell beam_cell_of(double width_rad, double height_rad, double el_rad)
{
    const double across_rad = width_rad * cos(el_rad), half = fmin(width_rad / 2, GEO_PI);
    struct beam_cell cell = {.across_rad = across_rad,
                             .tan_across = tan(fmin(across_rad / 2, WIDEST_HALF_RAD)),
                             .per_level = 1 / cos(el_rad),
                             .cos_half = cos(half),
                             .sin_half = sin(half)};
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

void beam_cell_side(const struct beam_cell *cell, const double u[3], int side, double out[3])
{
    const double x = u[0], y = u[1], sine = side * cell->sin_half;
    out[0] = cell->cos_half * x - sine * y;
    out[1] = sine * x + cell->cos_half * y;
    out[2] = u[2];
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

/* Where a ray whose beginning is farther from the sensor than range_m comes as near as that; 0 for others. */
static double come_within(const struct beam *b, const double u[3], double range_m)
{
    if (b->lever_m <= range_m)
        return 0;
    const double along = geo_dot(u, b->origin_m), d = along * along - b->lever_m * b->lever_m + range_m * range_m;
    return d < 0 ? INFINITY : along - sqrt(d);
}

double beam_share(double off, double half, double width)
{
    double share = (half + width / 2 - fabs(off)) / width;
    double most = 2 * half / width;
    share = share < most ? share : most;
    return share < 0 ? 0 : share > 1 ? 1 : share;
}

/* Cuts the stretch to where slope * r >= offset: one side of the beam. False when nothing is left. */
static bool cut_side(struct stretch *st, double slope, double offset)
{
    if (slope > 1e-12) {
        if (offset / slope > st->from_m) {
            st->from_m = offset / slope;
            st->enters_aside = true;
        }
    } else if (slope < -1e-12) {
        if (offset >= 0)
            return false;
        if (offset / slope < st->to_m) {
            st->to_m = offset / slope;
            st->leaves_aside = true;
        }
    } else if (offset > 0) {
        return false;
    }
    return st->from_m < st->to_m;
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

/* The flat sides at these angles, farther in by what of the sensor's place is not known. */
static struct beam_sides sides_at(const struct beam *b, double tan_az, double tan_el)
{
    const double margin_el_m = b->margin_m + b->margin_el_m;
    const double along_m = fabs(geo_dot(b->blur_m, b->axis));
    struct beam_sides f = {.tan_az = tan_az, .tan_el = tan_el};
    f.in_az = b->margin_m > 0 ? b->margin_m * sqrt(1 + tan_az * tan_az) : 0;
    f.in_el = margin_el_m > 0 ? margin_el_m * sqrt(1 + tan_el * tan_el) : 0;
    f.in_az += tan_az * along_m + fabs(geo_dot(b->blur_m, b->side));
    f.in_el += tan_el * along_m + fabs(geo_dot(b->blur_m, b->up));
    return f;
}

bool beam_sides(const struct beam *b, const struct beam_cell *cell, struct beam_sides *f)
{
    const struct beam_opening *o = b->opening;
    if (cell->across_rad > o->widest_rad || !(o->tan_el > 0))
        return false;
    *f = sides_at(b, cell->tan_across > o->tan_az ? cell->tan_across : o->tan_az, o->tan_el);
    return true;
}

/* Cuts the stretch to what of the ray is between the sides. False when nothing is left. */
static bool cut_sides(const struct beam *b, const struct beam_sides *f, const struct beam_ray *ray,
                      struct stretch *st)
{
    const double x = ray->along, y = ray->aside, z = ray->upward;
    const double ox = b->offset_m[0], oy = b->offset_m[1], oz = b->offset_m[2];
    return cut_side(st, f->tan_az * x - y, f->tan_az * ox - oy + f->in_az) &&
           cut_side(st, f->tan_az * x + y, f->tan_az * ox + oy + f->in_az) &&
           cut_side(st, f->tan_el * x - z, f->tan_el * ox - oz + f->in_el) &&
           cut_side(st, f->tan_el * x + z, f->tan_el * ox + oz + f->in_el);
}

/* ---- what is free in the parts of a beam ---- */

/* What another part frees joins it where they touch; else the longer stays. */
static void add_run(struct stretch *st, double from_m, double to_m)
{
    if (!(to_m > from_m))
        return;
    if (st->to_m > st->from_m && from_m <= st->to_m && to_m >= st->from_m) {
        st->from_m = fmin(st->from_m, from_m);
        st->to_m = fmax(st->to_m, to_m);
    } else if (to_m - from_m > st->to_m - st->from_m) {
        st->from_m = from_m;
        st->to_m = to_m;
    }
}

/* How far the cell reaches from its middle, along the beam's axis, to its side and up, of a unit's way along it. */
struct box {
    double along, aside, upward;
};

static struct box box_of(const struct beam *b, const struct beam_cell *cell, const double u[3])
{
    const double cos_az = u[0] * cell->per_level, sin_az = u[1] * cell->per_level;
    const double wide = cell->aside, high = cell->upward;
    const double w[3] = {-wide * sin_az, wide * cos_az, 0},
                 h[3] = {high * u[2] * cos_az, high * u[2] * sin_az, -high * (u[0] * cos_az + u[1] * sin_az)};
    return (struct box){fabs(geo_dot(w, b->axis)) + fabs(geo_dot(h, b->axis)),
                        fabs(geo_dot(w, b->side)) + fabs(geo_dot(h, b->side)),
                        fabs(geo_dot(w, b->up)) + fabs(geo_dot(h, b->up))};
}

/* Cuts the stretch to where the ray, with the box about it, is within the patch. */
static bool cut_patch(const struct beam *b, const struct beam_patch *p, const struct beam_ray *ray,
                      const struct box *box, struct stretch *st)
{
    const struct beam_sides in = sides_at(b, fmax(fabs(p->tan_left), fabs(p->tan_right)), p->tan_el);
    const double *o = b->offset_m, low = ray->along - box->along;
    const double left = p->tan_left * ray->along - box->aside, right = p->tan_right * ray->along - box->aside;
    const double high = p->tan_el * low - box->upward;
    return cut_side(st, right - ray->aside, p->tan_right * o[0] - o[1] + in.in_az) &&
           cut_side(st, left + ray->aside, p->tan_left * o[0] + o[1] + in.in_az) &&
           cut_side(st, high - ray->upward, p->tan_el * o[0] - o[2] + in.in_el) &&
           cut_side(st, high + ray->upward, p->tan_el * o[0] + o[2] + in.in_el);
}

/*
 * Of the rectangles within the ellipse of a part the one about where the cell is at range_m, as much larger than that
 * in width as in height. An angle is no more than its tangent. Where the cell is not wholly in the part as far as
 * that: a square one.
 */
static bool own_patch(const struct beam *b, enum beam_part part, const struct beam_ray *ray, const struct box *box,
                      double range_m, struct beam_patch *out)
{
    const struct beam_opening *o = b->opening;
    const double share2 = beam_part_share[part] * beam_part_share[part];
    const double along_m = range_m * (ray->along - box->along) - b->offset_m[0];
    const double aside_m = fabs(range_m * ray->aside - b->offset_m[1]) + range_m * box->aside,
                 upward_m = fabs(range_m * ray->upward - b->offset_m[2]) + range_m * box->upward;
    double az2 = share2, el2 = share2;
    if (!(o->axes[0] > 0))
        return false;
    if (along_m > 0) {
        az2 = (aside_m / along_m + o->less[0]) / o->axes[0];
        el2 = (upward_m / along_m + o->less[1]) / o->axes[1];
        az2 *= az2;
        el2 *= el2;
    }
    const double slack = (share2 - az2 - el2) / 2;
    const double az = sqrt(slack >= 0 ? az2 + slack : share2 / 2),
                 el = sqrt(slack >= 0 ? el2 + slack : share2 / 2);
    const double tan_az = az * o->axes[0] - o->less[0];
    *out = (struct beam_patch){tan_az, tan_az, el * o->axes[1] - o->less[1]};
    return tan_az > 0 && out->tan_el > 0;
}

/* Of where the beam looks along the ray: at its edge, that is, in all of it; and farther where all of the cell lies in
 * a part of the beam, or the ray in that of the row. */
static void free_in_parts(const struct beam *b, const struct box *box, const struct beam_ray *ray,
                          const struct beam_water *w, struct stretch *st)
{
    const double reach_m[BEAM_PARTS] = {[BEAM_AXIS] = w->to_m, [BEAM_SIDE] = w->side_to_m};
    const struct stretch look = {.from_m = st->look_from_m, .to_m = st->look_to_m};
    const struct box high = {box->along, 0, box->upward};
    st->from_m = st->to_m = 0;
    const double edge_m = fmax(beam_meet(b, ray->u, w->edge_from_m), come_within(b, ray->u, w->edge_to_m));
    add_run(st, fmax(look.from_m, edge_m), fmin(look.to_m, beam_meet(b, ray->u, w->edge_to_m)));
    for (enum beam_part k = BEAM_PARTS; k-- > 0;) {
        const struct stretch all = {.from_m = fmax(look.from_m, come_within(b, ray->u, reach_m[k])),
                                    .to_m = fmin(look.to_m, beam_meet(b, ray->u, reach_m[k]))};
        const struct beam_patch *row = &b->opening->patch[k];
        struct beam_patch own;
        struct stretch in = all;
        if (!(all.to_m > all.from_m))
            continue;
        if (row->tan_el > 0 && cut_patch(b, row, ray, &high, &in))
            add_run(st, in.from_m, in.to_m);
        in = all;
        if (own_patch(b, k, ray, box, all.to_m, &own) && cut_patch(b, &own, ray, box, &in))
            add_run(st, in.from_m, in.to_m);
    }
}

void beam_stretch_aside(const struct beam *b, const struct beam_cell *cell, const struct beam_ray *side,
                        const struct beam_water *water, struct stretch *st)
{
    if (!water->nested)
        return;
    struct box box = box_of(b, cell, side->u);
    box.aside = 0;
    free_in_parts(b, &box, side, water, st);
}

bool beam_stretch(const struct beam *b, const struct beam_cell *cell, const struct beam_ray *ray,
                  const struct beam_water *water, struct stretch *st)
{
    struct beam_sides f;
    if (!beam_sides(b, cell, &f))
        return false;
    *st = (struct stretch){.to_m = INFINITY};
    if (!cut_sides(b, &f, ray, st))
        return false;
    const double from = fmax(beam_meet(b, ray->u, water->from_m), come_within(b, ray->u, water->to_m)),
                 to = beam_meet(b, ray->u, water->to_m);
    if (from >= st->from_m) {
        st->from_m = from;
        st->enters_aside = false;
    }
    if (to <= st->to_m) {
        st->to_m = to;
        st->leaves_aside = false;
    }
    st->look_from_m = st->from_m;
    st->look_to_m = st->to_m;
    if (!(st->to_m > st->from_m))
        return false;
    if (water->nested) {
        const struct box box = box_of(b, cell, ray->u);
        free_in_parts(b, &box, ray, water, st);
    }
    return true;
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
