/* SPDX-License-Identifier: MIT */
#include "sweep.h"

#include <math.h>
#include <string.h>

#define WIDEST_RAD (60 * GEO_PI / 180)
#define CUT_RAD    (80 * GEO_PI / 180)
#define STANDS_RAD 1e-6 /* a head that has turned by less stands */

/* Of a's beam in b's axes. */
static double azimuth(const struct water_record *a, const struct water_record *b)
{
    return atan2(geo_dot(a->axis[0], b->axis[1]), geo_dot(a->axis[0], b->axis[0]));
}

/* The angle by which a's axes are turned against b's, but for the azimuth. */
static double tilt(const struct water_record *a, const struct water_record *b)
{
    const double az = azimuth(a, b), c = cos(az), s = sin(az);
    double trace = geo_dot(a->axis[2], b->axis[2]);
    for (int k = 0; k < 3; k++)
        trace += (c * b->axis[0][k] + s * b->axis[1][k]) * a->axis[0][k] +
                 (c * b->axis[1][k] - s * b->axis[0][k]) * a->axis[1][k];
    return acos(fmax(-1, fmin(1, (trace - 1) / 2)));
}

static double apart_m(const struct water_record *a, const struct water_record *b)
{
    const double v[3] = {a->place_m[0] - b->place_m[0], a->place_m[1] - b->place_m[1],
                         a->place_m[2] - b->place_m[2]};
    return geo_length(v);
}

static double drifted_m(const struct water_record *a, const struct water_record *b)
{
    return hypot(b->drift_m[0] - a->drift_m[0], b->drift_m[1] - a->drift_m[1]);
}

/*
 * Two beams that follow each other, b the later one. Sent from one place they need only touch; if not, a thing nearer
 * than *near_m may stand between them. False: everywhere.
 */
static bool overlap(const struct sweep_look *a, const struct sweep_look *b, double *near_m)
{
    const double over = 2 * b->shape.half_az_rad - fabs(azimuth(&b->at, &a->at));
    const double between_m = apart_m(&a->at, &b->at) + drifted_m(&a->at, &b->at);
    *near_m = 0;
    if (between_m <= 0)
        return over >= -ROW_TOUCH_RAD;
    if (over <= 0)
        return false;
    *near_m = between_m / sin(fmin(over, GEO_PI / 2));
    return true;
}

/* Does the new beam continue the row? */
static bool joins(const struct sweep *s, const struct sweep_look *next)
{
    const struct sweep_look *last = &s->look[s->n - 1];
    const double turn = azimuth(&next->at, &last->at);
    double near_m;
    return next->at.seq == last->at.seq + 1 && next->at.t_ns >= last->at.t_ns &&
           next->shape.el_rad == last->shape.el_rad && next->shape.half_az_rad == last->shape.half_az_rad &&
           next->shape.half_el_rad == last->shape.half_el_rad && fabs(turn) > STANDS_RAD && turn * s->sense >= 0 &&
           overlap(last, next, &near_m);
}

/* The row's first beams become its neighbour, until there is room for one more within 60 degrees. */
static void make_room(struct sweep *s, const struct sweep_look *next)
{
    while (s->n > s->first &&
           (s->n - s->first >= SWEEP_BEAMS || fabs(azimuth(&next->at, &s->look[s->first].at)) > WIDEST_RAD)) {
        if (s->first) {
            s->n--;
            memmove(s->look, s->look + 1, (size_t)s->n * sizeof *s->look);
        }
        s->first = 1;
    }
}

/* Two in a row that received nothing usable end what both looked at. */
static void end_both(struct sweep_look *last, const struct sweep_look *next)
{
    if (next->beam.axis_m <= 0 && next->beam.echo && last->beam.axis_m <= 0)
        last->beam.echo = true;
}

bool sweep_add(struct sweep *s, const struct water_record *at, const struct beams_row *row)
{
    struct sweep_look next = {.at = *at, .beam = row->beam[0], .shape = row->shape};
    const double c = cos(next.beam.az_rad), sine = sin(next.beam.az_rad);
    for (int k = 0; k < 3; k++) {
        next.at.axis[0][k] = c * at->axis[0][k] + sine * at->axis[1][k];
        next.at.axis[1][k] = c * at->axis[1][k] - sine * at->axis[0][k];
    }
    const bool joined = s->n > 0 && joins(s, &next);
    if (joined) {
        s->sense = azimuth(&next.at, &s->look[s->n - 1].at) > 0 ? 1 : -1;
        end_both(&s->look[s->n - 1], &next);
        make_room(s, &next);
        s->since = s->since == SWEEP_EACH ? 1 : s->since + 1;
    } else
        *s = (struct sweep){.since = 1};
    s->look[s->n++] = next;
    return joined;
}

/* Halfway to the neighbour; without one, the beam's own edge. */
static double end_of(const struct sweep *s, const struct water_record *by, int which, int neighbour)
{
    const struct sweep_look *look = &s->look[which];
    const double az = azimuth(&look->at, by), half = look->shape.half_az_rad;
    if (neighbour >= 0)
        return (az + azimuth(&s->look[neighbour].at, by)) / 2;
    const bool left = (which == s->first) == (s->sense >= 0);
    return left ? az - half : az + half;
}

static void add_look(const struct sweep *s, int i, struct water_record *record, struct row_shape *shape)
{
    const struct sweep_look *look = &s->look[i];
    const struct water_record *at = &look->at, *middle = &s->look[(s->first + s->n - 1) / 2].at;
    double near_m = 0;
    if (i > s->first)
        overlap(&s->look[i - 1], look, &near_m);
    record->uncertain_m = fmax(record->uncertain_m, at->uncertain_m + apart_m(at, middle));
    record->tilt_rad = fmax(record->tilt_rad, at->tilt_rad + tilt(at, middle));
    shape->near_m = fmax(shape->near_m, fmax(look->shape.near_m, near_m));
    shape->edge_near_m = fmax(shape->edge_near_m, look->shape.edge_near_m);
}

void sweep_write(const struct sweep *s, struct water_record *record, struct row_room *room)
{
    const int last = s->n - 1, n = s->n - s->first;
    const struct sweep_look *middle = &s->look[(s->first + last) / 2], *newest = &s->look[last],
                            *oldest = &s->look[s->first];
    struct row_shape shape = middle->shape;
    struct row_beam beam[SWEEP_BEAMS];
    *record = middle->at;
    record->t_ns = oldest->at.t_ns;
    record->newest_ns = newest->at.t_ns;
    record->seq = newest->at.seq;
    record->path_m = oldest->at.path_m;
    memcpy(record->drift_m, oldest->at.drift_m, sizeof record->drift_m);
    for (int i = s->first; i <= last; i++) {
        /* clockwise or not, azimuths grow */
        const int k = s->sense < 0 ? last - i : i - s->first;
        beam[k] = s->look[i].beam;
        beam[k].az_rad = azimuth(&s->look[i].at, &middle->at);
        add_look(s, i, record, &shape);
    }
    const double begin = end_of(s, &middle->at, s->first, s->first - 1), end = end_of(s, &middle->at, last, -1);
    shape.from_rad = fmax(n == 1 ? -shape.half_az_rad : fmin(begin, end), -CUT_RAD);
    shape.to_rad = fmin(n == 1 ? shape.half_az_rad : fmax(begin, end), CUT_RAD);
    if (n > 1)
        shape.goes_on[s->sense < 0] = s->first > 0;
    row_write(record, room, &shape, beam, (size_t)n);
}
