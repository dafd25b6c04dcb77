/* SPDX-License-Identifier: MIT */
#include "beam.h"

#include <math.h>
#include <string.h>

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

#define WIDEST_HALF_RAD 1.45 /* of a beam with flat sides */

void beam_of(struct beam *b, const struct echoes *ping, uint16_t index, const double turn[4],
             const double origin_m[3])
{
    const struct beam_echoes *h = &ping->beam[index];
    *b = (struct beam){.ping = ping,
                       .heard = h,
                       .lever_m = sqrt(dot(origin_m, origin_m)),
                       .half_az = ping->az_aperture_rad / 2,
                       .half_el = ping->el_aperture_rad / 2,
                       .tan_az = tan(fmin(ping->az_aperture_rad / 2, WIDEST_HALF_RAD)),
                       .sin_el = sin(h->el_rad)};
    memcpy(b->origin_m, origin_m, sizeof b->origin_m);
    const double sin_az = sin(h->az_rad), cos_az = cos(h->az_rad);
    const double ahead[3] = {cos_az, sin_az, 0}, side[3] = {-sin_az, cos_az, 0}, down[3] = {0, 0, 1};
    geo_direction(h->az_rad, h->el_rad, b->axis);
    quat_rotate(turn, b->axis, b->axis);
    quat_rotate(turn, ahead, b->ahead);
    quat_rotate(turn, side, b->side);
    quat_rotate(turn, down, b->down);
    for (int i = 0; i < 3; i++) /* up = side x axis, with z downward */
        b->up[i] = b->side[(i + 1) % 3] * b->axis[(i + 2) % 3] - b->side[(i + 2) % 3] * b->axis[(i + 1) % 3];
}

double beam_range(const struct beam *b, const double place_m[3])
{
    double v[3];
    for (int i = 0; i < 3; i++)
        v[i] = place_m[i] - b->origin_m[i];
    return sqrt(dot(v, v));
}

bool beam_sees(const struct beam *b, const double place_m[3], double most_az, double most_el, double *off_az,
               double *off_el)
{
    double v[3];
    for (int i = 0; i < 3; i++)
        v[i] = place_m[i] - b->origin_m[i];
    double x = dot(v, b->ahead), y = dot(v, b->side), z = dot(v, b->down);
    double level = sqrt(x * x + y * y), range = sqrt(dot(v, v)), slack = 1e-9 * range;
    /* an angle is at least its sine, and two angles differ at least as much as their sines */
    if (fabs(y) > most_az * level + slack || fabs(-z - b->sin_el * range) > most_el * range + slack)
        return false;
    *off_az = atan2(y, x);
    *off_el = atan2(-z, level) - b->heard->el_rad;
    return true;
}

double beam_meet(const struct beam *b, const double u[3], double range_m)
{
    const double *o = b->origin_m;
    double along = dot(u, o);
    double d = along * along - dot(o, o) + range_m * range_m;
    return d < 0 ? -1 : along + sqrt(d);
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
        if (offset / slope < st->to_m) {
            st->to_m = offset / slope;
            st->leaves_aside = true;
        }
    } else if (offset > 0) {
        return false;
    }
    return st->from_m < st->to_m;
}

bool beam_stretch(const struct beam *b, const double u[3], double width, double height, bool level, double near_m,
                  double far_m, struct stretch *st)
{
    bool too_coarse = width > 4 * b->half_az || (!level && height > 4 * b->half_el);
    if (too_coarse)
        return false;
    double wide = b->half_el - height / 2;
    double tan_az = width / 2 > b->half_az ? tan(fmin(width / 2, WIDEST_HALF_RAD)) : b->tan_az;
    double tan_el = tan(fmin(wide > 0 || level ? wide : height / 2, WIDEST_HALF_RAD));
    double x = dot(u, b->axis), y = dot(u, b->side), z = dot(u, b->up);
    double ox = dot(b->origin_m, b->axis), oy = dot(b->origin_m, b->side), oz = dot(b->origin_m, b->up);
    *st = (struct stretch){.from_m = fmax(0, beam_meet(b, u, near_m)), .to_m = beam_meet(b, u, far_m)};
    return st->to_m > st->from_m && tan_el > 0 && cut_side(st, tan_az * x - y, tan_az * ox - oy) &&
           cut_side(st, tan_az * x + y, tan_az * ox + oy) && cut_side(st, tan_el * x - z, tan_el * ox - oz) &&
           cut_side(st, tan_el * x + z, tan_el * ox + oz);
}

struct beam_sieve beam_sieve(const struct beam *b, double range_m, double cell)
{
    double parallax = b->lever_m < range_m ? asin(b->lever_m / range_m) : GEO_PI / 2;
    double angle = hypot(b->half_az, b->half_el) + cell + parallax;
    double side = b->half_az + cell + parallax;
    return (struct beam_sieve){.cos_axis = angle < GEO_PI ? cos(angle) : -1,
                               .sin_side = side < GEO_PI / 2 ? sin(side) : 1};
}
