/* SPDX-License-Identifier: MIT */
#include "sweep.h"

#include <math.h>
#include <string.h>

#define WIDEST_RAD (60 * GEO_PI / 180)
#define CUT_RAD    (80 * GEO_PI / 180)
#define WIDE_RAD                                                                                                  \
    (5 * GEO_PI / 180) /* tiles lie in one beam of twice as much, unless it turns by a quarter of that */
#define STANDS                                                                                                    \
    0.125 /* of half a beam's width: a head that has turned by less stands, tiles lie in one of its beams */
#define LOST_MOST 4 /* pings between two that follow each other in a row */

/* Beams that leave a gap as far as this are taken apart, rather than that all of the row begins there. */
#define JOIN_MOST_M 6.0

#define MEET_LEAST    0.002 /* of a row that hardly turns nobody knows where its axes meet */
#define BENT_LEAST    4     /* a row says nothing nearer than so many times what its beams' places bend ... */
#define BENT_ENOUGH_M 0.5   /* ... or than this */

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

static double drifted_m(const struct water_record *a, const struct water_record *b)
{
    return hypot(b->drift_m[0] - a->drift_m[0], b->drift_m[1] - a->drift_m[1]);
}

/* How high a beam reaches, up or down. */
static double highest_rad(const struct row_shape *shape)
{
    return fabs(shape->el_rad) + shape->half_el_rad;
}

/* The same of the part of it that a row of the image is. */
static double highest_in_rad(const struct row_shape *shape, int row)
{
    const double from_rad = shape->el_rad + row_share[row] * shape->half_el_rad,
                 to_rad = shape->el_rad + row_share[row + 1] * shape->half_el_rad;
    return fmax(fabs(from_rad), fabs(to_rad));
}

/* So far does b's place lie beyond a line from a's that is turned towards b's axis by that; negative: within. */
static double slipped_m(const struct sweep_look *a, const struct sweep_look *b, double off_rad)
{
    const double side = azimuth(&b->at, &a->at) < 0 ? -1 : 1;
    double m = 0;
    for (int k = 0; k < 3; k++)
        m += (b->at.place_m[k] - a->at.place_m[k]) *
             (side * cos(off_rad) * a->at.axis[1][k] - sin(off_rad) * a->at.axis[0][k]);
    return m;
}

/*
 * Two beams that follow each other, b the later one. Where b was sent from beyond the edge of a's a thing may stand
 * between them, up to where their edges cross: all the farther away the less they overlap. They overlap less where they
 * are tilted against each other, by as much as their tilt moves what is high. False: they leave a gap.
 */
static bool join(const struct sweep_look *a, const struct sweep_look *b, double join_m[ROW_ROWS])
{
    const double over_rad = 2 * b->shape.half_az_rad - fabs(azimuth(&b->at, &a->at)),
                 tilt_rad = tilt(&a->at, &b->at);
    const double slip_m = fmax(slipped_m(a, b, a->shape.half_az_rad), 0) + drifted_m(&a->at, &b->at);
    for (int row = 0; row < ROW_ROWS; row++) {
        const double highest = highest_in_rad(&b->shape, row), least_rad = over_rad - tilt_rad * tan(highest);
        join_m[row] = slip_m <= 0 && least_rad >= -ROW_TOUCH_RAD ? 0
                      : least_rad <= 0                           ? (double)INFINITY
                                       : slip_m / (sin(fmin(least_rad, GEO_PI / 2)) * cos(highest));
    }
    return join_m[ROW_ROWS / 2] <= JOIN_MOST_M;
}

/* Nearer than this a post may stand between two such beams that leave no gap farther away. */
static double gap_m(const struct sweep_look *a, const struct sweep_look *b)
{
    const double over_rad = 2 * b->shape.half_az_rad - fabs(azimuth(&b->at, &a->at)),
                 slip_m = slipped_m(a, b, a->shape.half_az_rad) - 2 * WATER_THIN_M;
    return slip_m <= 0 ? 0 : over_rad > 0 ? slip_m / sin(fmin(over_rad, GEO_PI / 2)) : INFINITY;
}

/* How their axes begin to diverge where they meet halfway. */
static void diverge(const struct sweep_look *a, struct sweep_look *b)
{
    b->tilt_rad = tilt(&a->at, &b->at);
    b->aside_m = fmax(slipped_m(a, b, fabs(azimuth(&b->at, &a->at)) / 2), 0) + drifted_m(&a->at, &b->at);
}

/* Does the new beam continue the row? */
static bool joins(const struct sweep *s, const struct sweep_look *next)
{
    const struct sweep_look *last = &s->look[s->n - 1];
    const double turn = azimuth(&next->at, &last->at);
    return next->at.seq - last->at.seq - 1 <= LOST_MOST && next->at.t_ns >= last->at.t_ns &&
           next->shape.el_rad == last->shape.el_rad && next->shape.half_az_rad == last->shape.half_az_rad &&
           next->shape.half_el_rad == last->shape.half_el_rad && fabs(turn) > STANDS * next->shape.half_az_rad &&
           (next->shape.half_az_rad < WIDE_RAD || fabs(turn) > next->shape.half_az_rad / 2) &&
           fabs(turn) < WIDEST_RAD && turn * s->sense >= 0;
}

/* Would they and one more be too many or too wide? What the image is cut by, as seen from the middle beam, ends
 * nothing. */
static bool is_full(const struct sweep *s, const struct sweep_look *next)
{
    const struct water_record *first = &s->look[s->first].at, *middle = &s->look[(s->first + s->n) / 2].at;
    const double most_rad = CUT_RAD - next->shape.half_az_rad;
    if (s->n == s->first)
        return false;
    return s->n - s->first >= SWEEP_BEAMS || fabs(azimuth(&next->at, first)) > WIDEST_RAD ||
           fabs(azimuth(&next->at, middle)) > most_rad || fabs(azimuth(first, middle)) > most_rad;
}

/* The row's first beams become its neighbour, until there is room for one more within 60 degrees. The last one stays,
 * for the next one joins it: beams of 40 degrees and more may be rows by themselves. */
static void make_room(struct sweep *s, const struct sweep_look *next)
{
    while (is_full(s, next)) {
        if (s->first) {
            s->n--;
            memmove(s->look, s->look + 1, (size_t)s->n * sizeof *s->look);
        }
        s->first = 1;
    }
}

/* Of so many beams' rows the last one is kept: of a row that has left beams behind no more than stay in it, so that two
 * that are kept have one in common. */
static int each(const struct sweep *s)
{
    const int stay = s->n - s->first;
    return s->first == 0 || stay > SWEEP_EACH ? SWEEP_EACH : stay;
}

/* Two in a row that received nothing usable end what both looked at. */
static void end_both(struct sweep_look *last, const struct sweep_look *next)
{
    if (next->beam.ends_m <= 0 && last->beam.axis_m <= 0)
        last->beam.ends_m = 0;
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
        s->since = s->since >= each(s) ? 1 : s->since + 1;
        s->before = s->look[s->n - 1].at.seq;
        next.apart = !join(&s->look[s->n - 1], &next, next.join_m);
        next.gap_m = gap_m(&s->look[s->n - 1], &next);
        diverge(&s->look[s->n - 1], &next);
    } else
        *s = (struct sweep){.since = 1, .begun = at->seq};
    s->look[s->n++] = next;
    return joined;
}

/* ---- the row ---- */

/*
 * Where the axes of all beams come nearest to meet, level, in the middle one's axes: a head on its way looks from
 * there. Rather from the middle beam's own place the higher the beams are: from elsewhere a range says less of what is
 * high.
 * No farther ahead than where a beam begins to detect.
 */
static void meet(const struct sweep *s, const struct sweep_look *middle, double at_m[2])
{
    const double highest = highest_rad(&middle->shape), lift = 1 - cos(highest), sine = sin(highest);
    const double own = (s->n - s->first) * (MEET_LEAST + lift * lift + 0.05 * sine * sine);
    double xx = own, xy = 0, yy = own, x = 0, y = 0;
    for (int i = s->first; i < s->n; i++) {
        const double az = azimuth(&s->look[i].at, &middle->at), across[2] = {-sin(az), cos(az)};
        double way_m[2] = {0, 0};
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < 2; j++)
                way_m[j] += (s->look[i].at.place_m[k] - middle->at.place_m[k]) * middle->at.axis[j][k];
        const double off_m = across[0] * way_m[0] + across[1] * way_m[1];
        xx += across[0] * across[0];
        xy += across[0] * across[1];
        yy += across[1] * across[1];
        x += across[0] * off_m;
        y += across[1] * off_m;
    }
    const double size = xx * yy - xy * xy;
    at_m[0] = fmin((x * yy - y * xy) / size, middle->beam.near_m);
    at_m[1] = (y * xx - x * xy) / size;
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

/* A beam was sent from before, beside and above the row's place: what ranges allow for, and what is left. */
static void take_look(const struct sweep_look *look, const struct water_record *middle,
                      struct water_record *record, struct row_beam *beam)
{
    const struct water_record *at = &look->at;
    double off_m[3] = {0, 0, 0}; /* in the beam's axes */
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++)
            off_m[j] += (at->place_m[k] - record->place_m[k]) * at->axis[j][k];
    const double along_m = off_m[0], aside_m = fabs(off_m[1]), up_m = fabs(off_m[2]),
                 highest = highest_rad(&look->shape), half = look->shape.half_az_rad;
    const double bent_m = hypot(aside_m + fabs(along_m) * sin(half), up_m + fabs(along_m) * sin(highest));
    const double near_m = fmax(look->beam.near_m, fmin(BENT_LEAST * bent_m, BENT_ENOUGH_M));
    const double left_m = fabs(along_m) * (1 - cos(highest) * cos(half)) + aside_m * sin(half) +
                          up_m * sin(highest) + (near_m > 0 ? bent_m * bent_m / near_m : 0);
    /* from nearer to the water its sides are seen farther apart than from the row's place */
    const double spread_m[3] = {left_m, aside_m + fmax(along_m, 0) * sin(half),
                                up_m + fabs(along_m) * sin(highest)};
    *beam = look->beam;
    beam->az_rad = azimuth(at, middle);
    beam->axis_m += beam->axis_m > 0 ? along_m : 0;
    beam->side_m += beam->side_m > 0 ? along_m : 0;
    beam->edge_m += beam->edge_m > 0 ? along_m : 0;
    beam->ends_m += beam->ends_m > 0 ? along_m : 0;
    for (int j = 0; j < 3; j++)
        record->spread_m[j] = fmax(record->spread_m[j], spread_m[j]);
    record->uncertain_m = fmax(record->uncertain_m, at->uncertain_m);
    record->ahead_m = fmax(record->ahead_m, along_m);
    record->tilt_rad = fmax(record->tilt_rad, at->tilt_rad + tilt(at, middle));
    beam->near_m = near_m + along_m;
    beam->edge_near_m = fmax(look->beam.edge_near_m, near_m) + along_m;
    beam->along_m = along_m;
}

/* What a beam and the one before it mean for either: from where on they leave no gap, from the row's place, and how
 * their axes diverge. */
static void take_pair(const struct sweep_look *look, struct row_beam *beam, double join_m[ROW_ROWS])
{
    for (int row = 0; row < ROW_ROWS; row++)
        if (look->join_m[row] > 0)
            join_m[row] = fmax(join_m[row], look->join_m[row] + beam->along_m);
    beam->aside_m = fmax(beam->aside_m, look->aside_m);
    beam->tilt_rad = fmax(beam->tilt_rad, look->tilt_rad);
}

/* Of two beams in order of azimuth. */
static bool are_apart(const struct sweep *s, int a, int b)
{
    return s->look[a > b ? a : b].apart;
}

void sweep_write(const struct sweep *s, struct water_record *record, struct row_room *room)
{
    const int last = s->n - 1, n = s->n - s->first;
    const struct sweep_look *middle = &s->look[(s->first + last) / 2], *newest = &s->look[last],
                            *oldest = &s->look[s->first];
    struct row_shape shape = middle->shape;
    struct row_beam beam[SWEEP_BEAMS];
    double at_m[2], join_m[SWEEP_BEAMS][ROW_ROWS] = {{0}};
    *record = middle->at;
    record->t_ns = oldest->at.t_ns;
    record->newest_ns = newest->at.t_ns;
    record->seq = newest->at.seq;
    record->sweep = s->begun;
    record->sense = s->sense > 0 ? 1 : s->sense < 0 ? -1 : 0;
    record->path_m = oldest->at.path_m;
    memcpy(record->drift_m, oldest->at.drift_m, sizeof record->drift_m);
    meet(s, middle, at_m);
    for (int k = 0; k < 3; k++)
        record->place_m[k] += at_m[0] * middle->at.axis[0][k] + at_m[1] * middle->at.axis[1][k];
    for (int i = s->first; i <= last; i++) {
        /* clockwise or not, azimuths grow */
        const int k = s->sense < 0 ? last - i : i - s->first, next = s->sense < 0 ? i - 1 : i + 1,
                  before = s->sense < 0 ? k + 1 : k - 1;
        take_look(&s->look[i], &middle->at, record, &beam[k]);
        beam[k].apart = k + 1 < n && are_apart(s, i, next);
        if (i > 0 && !s->look[i].apart) {
            take_pair(&s->look[i], &beam[k], join_m[k]);
            if (s->look[i].gap_m > 0)
                record->gap_m = fmax(record->gap_m, s->look[i].gap_m + beam[k].along_m);
        }
        if (i > s->first && !s->look[i].apart)
            take_pair(&s->look[i], &beam[before], join_m[before]);
    }
    const double begin = end_of(s, &middle->at, s->first, oldest->apart ? -1 : s->first - 1),
                 end = end_of(s, &middle->at, last, -1);
    shape.from_rad = fmax(n == 1 ? -shape.half_az_rad : fmin(begin, end), -CUT_RAD);
    shape.to_rad = fmin(n == 1 ? shape.half_az_rad : fmax(begin, end), CUT_RAD);
    /* one alone has its own part only, and no other columns by a rounded bearing: its pings may join */
    const double first_rad = n == 1 ? shape.from_rad : beam[0].az_rad - shape.half_az_rad,
                 last_rad = n == 1 ? shape.to_rad : beam[n - 1].az_rad + shape.half_az_rad;
    shape.outer_rad[0] = fmax(fmin(first_rad, shape.from_rad), -CUT_RAD);
    shape.outer_rad[1] = fmin(fmax(last_rad, shape.to_rad), CUT_RAD);
    shape.join_m = (const double(*)[ROW_ROWS])join_m;
    row_write(record, room, &shape, beam, (size_t)n);
}
