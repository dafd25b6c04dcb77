/* SPDX-License-Identifier: MIT */
#include "bearings.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"
#include "grid/ping.h"

#define PART_RAD (GEO_TURN / BEARINGS)

static uint64_t part(double az_rad)
{
    return UINT64_C(1) << (unsigned)(geo_wrap(az_rad) / PART_RAD) % BEARINGS;
}

/* All parts from one azimuth to the other, the shorter way. */
static uint64_t between(double from_rad, double to_rad)
{
    const double way_rad = geo_wrap_pi(to_rad - from_rad);
    const int steps = (int)ceil(fabs(way_rad) / PART_RAD);
    uint64_t parts = part(to_rad);
    for (int i = 0; i < steps; i++)
        parts |= part(from_rad + way_rad * i / steps);
    return parts;
}

static bool is_open(const uint64_t set[BEARINGS_FINE / 64], int64_t fine)
{
    const uint64_t k = (uint64_t)fine % BEARINGS_FINE; /* BEARINGS_FINE divides 2^64 */
    return set[k / 64] >> k % 64 & 1;
}

#define FINE_RAD (GEO_TURN / BEARINGS_FINE)

static int64_t fine_part(double az_rad)
{
    return (int64_t)floor(az_rad / FINE_RAD);
}

static void open_part(uint64_t set[BEARINGS_FINE / 64], int64_t fine)
{
    set[(uint64_t)fine % BEARINGS_FINE / 64] |= UINT64_C(1) << (uint64_t)fine % 64;
}

/* Where a head's beam passes the body's level plane. */
struct level {
    double az_rad;
    double
        high_rad; /* so far above and below the plane water is surely heard; negative: the beam passes beside it */
};

/* Half of a beam's extent along a unit vector. */
static double half_along(const double v[3], const double side[3], const double up[3], const struct echoes *e)
{
    return fmin((double)e->el_aperture_rad / 2 / fmax(fabs(geo_dot(up, v)), 1e-9),
                (double)e->az_aperture_rad / 2 / fmax(fabs(geo_dot(side, v)), 1e-9));
}

static struct level level_of(const struct beam_echoes *beam, const struct echoes *e, const struct mount *mount)
{
    static const double down[3] = {0, 0, 1};
    const double az = (double)beam->az_rad, el = (double)beam->el_rad;
    double axis[3], up[3], side[3] = {-sin(az), cos(az), 0};
    geo_direction(az, el, axis);
    geo_direction(az, el + GEO_PI / 2, up);
    quat_rotate(mount->attitude, axis, axis);
    quat_rotate(mount->attitude, up, up);
    quat_rotate(mount->attitude, side, side);
    return (struct level){.az_rad = atan2(axis[1], axis[0]),
                          .high_rad = half_along(down, side, up, e) - fabs(asin(fmax(-1, fmin(1, axis[2]))))};
}

#define LEAST_RAD (5 * GEO_PI / 180) /* a beam that hears no more above and below level shows no bearing */

#define TOUCH_RAD 1e-3 /* beams that are no farther apart point the same way: their bearings are rounded */

#define STEP_MOST 1.5 /* times its least is no step of a head any more: after a lost ping it is twice as long */

/* From the last level beam to this one: the head passed there, or the fan has no beam between. */
static void join_bearings(struct bearings_sensor *sensor, double az_rad)
{
    const float step_rad = (float)fabs(geo_wrap_pi(az_rad - (double)sensor->last_rad));
    if ((double)step_rad > TOUCH_RAD && (sensor->step_rad <= 0 || step_rad < sensor->step_rad))
        sensor->step_rad = step_rad;
    sensor->seen |= between((double)sensor->last_rad, az_rad);
}

static bool is_deaf(const struct beam_echoes *beam)
{
    return beam->state == BEAM_BLIND || beam->hides == BEAM_HIDES_RING || beam->hides == BEAM_HIDES_DEAF ||
           (beam->n == 0 && beam->heard_from_m >= beam->heard_to_m);
}

/*
 * What a head has passed on its way from the last beam to this one: the parts of both and those between, if the way was
 * a step. No longer way is one, however often the head makes it: of evenly spaced pings most may have been lost.
 */
static uint64_t passed(const struct bearings_sensor *sensor, double az_rad, bool joins)
{
    const double last_rad = (double)sensor->last_rad, way_rad = fabs(geo_wrap_pi(az_rad - last_rad));
    return joins && way_rad < STEP_MOST * (double)sensor->step_rad ? between(last_rad, az_rad) : part(az_rad);
}

/* A head's beam. A part is deaf where no beam of a pass hears, and where the first of them is not forgiven. */
static void mind_deaf_beam(struct bearings_sensor *sensor, const struct beam_echoes *beam, double az_rad,
                           bool joins)
{
    const uint64_t at = part(az_rad), last = part((double)sensor->last_rad);
    const uint64_t way = (passed(sensor, az_rad, joins) & ~last) | at;
    if (!is_deaf(beam)) {
        sensor->deaf &= ~way;
        sensor->deaf_before = 0;
        sensor->heard = at;
        return;
    }
    if (sensor->deaf_before && at != sensor->heard)
        sensor->deaf |= way;
    sensor->deaf_before = at;
}

/* A beam received something usable. A single deaf beam before it is forgiven. */
static void hear(struct bearings_sensor *sensor, double az_rad, bool joins, uint64_t t_ns)
{
    const uint64_t parts = passed(sensor, az_rad, joins);
    for (int k = 0; k < BEARINGS; k++)
        if (parts >> k & 1)
            sensor->heard_ns[k] = t_ns;
}

/* What tells the beams of two pings apart: which, and how wide and high. */
static uint64_t shape_of(const struct echoes *e)
{
    uint64_t shape = e->n_beams;
    for (unsigned i = 0; i < e->n_beams; i++) {
        uint32_t bits[2];
        memcpy(&bits[0], &e->beam[i].az_rad, sizeof bits[0]);
        memcpy(&bits[1], &e->beam[i].el_rad, sizeof bits[1]);
        shape = (shape ^ bits[0] ^ (uint64_t)bits[1] << 32) * UINT64_C(0x9e3779b97f4a7c15);
        shape ^= shape >> 29;
    }
    return shape;
}

/* Beams of another width or height take the place of those before them, as after a reload. */
static void mind_width(struct bearings_sensor *sensor, const struct echoes *e)
{
    if (sensor->wide_rad != e->az_aperture_rad || sensor->high_rad != e->el_aperture_rad) {
        sensor->still.low_rad = sensor->still.high_rad = 0;
        sensor->shape = 0;
        sensor->level_rad = 0;
    }
    sensor->wide_rad = e->az_aperture_rad;
    sensor->high_rad = e->el_aperture_rad;
}

/* From another mount it has looked nowhere yet. */
static void mind_mount(struct bearings_sensor *sensor, const struct mount *mount)
{
    if (memcmp(&sensor->still.mount, mount, sizeof *mount) != 0)
        *sensor = (struct bearings_sensor){.last_ns = sensor->last_ns, .back_ns = sensor->back_ns};
    sensor->still.mount = *mount;
}

#define STEEP_RAD (45 * GEO_PI / 180) /* a beam that goes so far up or down does not look where near is promised */

static bool is_steep(const struct beam_echoes *beam, const struct echoes *e, const struct mount *mount)
{
    double axis[3];
    geo_direction((double)beam->az_rad, (double)beam->el_rad, axis);
    quat_rotate(mount->attitude, axis, axis);
    return fabs(asin(fmax(-1, fmin(1, axis[2])))) -
               hypot((double)e->az_aperture_rad, (double)e->el_aperture_rad) / 2 >
           STEEP_RAD;
}

/* All parts that the beam touches: beams whose edges are less than a part apart leave no gap. Next to a pole, all. */
static void open_beam(struct bearings_still *still, const struct beam_echoes *beam, const struct echoes *e)
{
    const double az_rad = (double)beam->az_rad, el_rad = (double)beam->el_rad;
    const double high_rad = fmin((double)e->el_aperture_rad / 2, GEO_PI / 2);
    const bool pole = fabs(el_rad) + high_rad >= GEO_PI / 2, first = still->low_rad >= still->high_rad;
    const double half_rad = pole ? GEO_PI : fmin((double)e->az_aperture_rad / 2, GEO_PI);
    const double low_rad = fmax(el_rad - high_rad, -GEO_PI / 2), top_rad = fmin(el_rad + high_rad, GEO_PI / 2);
    if (first)
        memset(still->opens, 0, sizeof still->opens);
    still->low_rad = first ? low_rad : fmin(still->low_rad, low_rad);
    still->high_rad = first ? top_rad : fmax(still->high_rad, top_rad);
    for (int64_t k = fine_part(az_rad - half_rad); k <= fine_part(az_rad + half_rad); k++)
        open_part(still->opens, k);
}

/* All that the beams of a fan ever covered counts. */
static void enter_still(struct bearings_sensor *sensor, const struct echoes *e, const struct mount *mount)
{
    const uint64_t shape = shape_of(e);
    if (sensor->shape == shape)
        return;
    sensor->shape = shape;
    for (unsigned i = 0; i < e->n_beams; i++)
        if (!is_steep(&e->beam[i], e, mount))
            open_beam(&sensor->still, &e->beam[i], e);
}

static bool is_level(struct bearings_sensor *sensor, const struct level *beam)
{
    if (beam->high_rad < LEAST_RAD)
        return false;
    sensor->level_rad = sensor->level_rad > 0 ? fmin(sensor->level_rad, beam->high_rad) : beam->high_rad;
    return true;
}

static void enter_head(struct bearings_sensor *sensor, const struct echoes *e, const struct mount *mount)
{
    for (unsigned i = 0; i < e->n_beams; i++) {
        const struct level beam = level_of(&e->beam[i], e, mount);
        const bool joins = sensor->level;
        sensor->level = is_level(sensor, &beam);
        if (!sensor->level)
            continue;
        sensor->seen |= part(beam.az_rad);
        if (joins)
            join_bearings(sensor, beam.az_rad);
        mind_deaf_beam(sensor, &e->beam[i], beam.az_rad, joins);
        if (!is_deaf(&e->beam[i]))
            hear(sensor, beam.az_rad, joins, e->t_ns);
        sensor->last_rad = (float)beam.az_rad;
    }
}

void bearings_enter(struct bearings *b, const struct echoes *e, const struct mount *mount)
{
    struct bearings_sensor *sensor = &b->sensor[e->sensor % BEARINGS_SENSORS];
    mind_mount(sensor, mount);
    if (sensor->last_ns && e->t_ns > sensor->last_ns && e->t_ns - sensor->last_ns > BEARINGS_AWAY_NS)
        sensor->back_ns = e->t_ns;
    sensor->last_ns = e->t_ns;
    b->t_ns = e->t_ns > b->t_ns ? e->t_ns : b->t_ns;
    if (e->flags & PING_NEW_TURN && sensor->turns < 3)
        sensor->turns++;
    mind_width(sensor, e);
    sensor->moves = e->turns;
    (e->turns ? enter_head : enter_still)(sensor, e, mount);
}

/* From then_ns (0: never) to t_ns, rounded up. */
static uint16_t tenths(uint64_t t_ns, uint64_t then_ns)
{
    const uint64_t tenth_ns = 100000000, since_ns = t_ns > then_ns ? t_ns - then_ns : 0;
    return then_ns && since_ns < BEARINGS_NEVER * tenth_ns ? (uint16_t)((since_ns + tenth_ns - 1) / tenth_ns)
                                                           : BEARINGS_NEVER;
}

void bearings_tell(const struct bearings *b, const uint32_t turn_ms[BEARINGS_SENSORS], struct bearings_looks *out)
{
    *out = (struct bearings_looks){
        .t_ns = b->t_ns,
    };
    for (int k = 0; k < BEARINGS_SENSORS; k++) {
        const struct bearings_sensor *sensor = &b->sensor[k];
        const bool turns = sensor->moves && sensor->seen, first_turns = turns && sensor->turns < 3;
        const double gap_rad = STEP_MOST * (double)sensor->step_rad - (double)sensor->wide_rad;
        out->last_ns[k] = sensor->last_ns;
        out->back_ds[k] = tenths(b->t_ns, sensor->back_ns);
        out->turn_s[k] = turn_ms[k] * 1e-3;
        if (!sensor->moves)
            out->still[k] = sensor->still;
        memcpy(out->place_m[k], sensor->still.mount.position_m, sizeof out->place_m[k]);
        if (!turns)
            continue;
        out->bearings[k] = sensor->turns < 2 ? UINT64_MAX : sensor->seen;
        out->level_rad[k] = sensor->level_rad;
        out->hears[k] = sensor->seen & ~sensor->deaf;
        for (int i = 0; i < BEARINGS; i++)
            out->heard_ds[k][i] = tenths(b->t_ns, sensor->heard_ns[i]);
        out->first_turns |= first_turns;
        if (gap_rad > TOUCH_RAD)
            out->gap_rad[k] = gap_rad;
    }
}

/* A head that sweeps to and fro begins a turn each way; a tenth more for pings that are lost. */
#define SHOWN_TURNS 2.2

/* How old, in tenths of a second at looks->t_ns, what a sensor heard may be to count since_s later: as old as clear
 * water, or as old as a head lets it become that has not been away. */
static double shown_ds(const struct bearings_looks *looks, int k, double since_s, double clear_for_s)
{
    const double turns_ds = 10 * (SHOWN_TURNS * looks->turn_s[k] - since_s);
    return fmin(fmax(10 * (clear_for_s - since_s), fmin(turns_ds, looks->back_ds[k])), BEARINGS_NEVER - 1);
}

static double since(const struct bearings_looks *looks, uint64_t now_ns)
{
    return now_ns > looks->t_ns ? (double)(now_ns - looks->t_ns) * 1e-9 : 0;
}

bool bearings_counts(const struct bearings_looks *looks, uint32_t sensor, uint64_t t_ns, uint64_t now_ns,
                     double clear_for_s)
{
    return tenths(looks->t_ns, t_ns) <=
           shown_ds(looks, (int)(sensor % BEARINGS_SENSORS), since(looks, now_ns), clear_for_s);
}

uint64_t bearings_of(const struct bearings_looks *looks, uint64_t sensors, uint64_t now_ns, double clear_for_s)
{
    const double since_s = since(looks, now_ns);
    uint64_t bearings = 0;
    for (int k = 0; k < BEARINGS_SENSORS; k++) {
        if (!(sensors >> k & 1))
            continue;
        const double most_ds = shown_ds(looks, k, since_s, clear_for_s);
        for (int i = 0; i < BEARINGS; i++)
            if (looks->heard_ds[k][i] <= most_ds)
                bearings |= looks->hears[k] & UINT64_C(1) << i;
    }
    return bearings;
}

uint64_t bearings_level(const struct bearings_looks *looks, double off_rad)
{
    uint64_t bearings = 0;
    for (int k = 0; k < BEARINGS_SENSORS; k++)
        if (off_rad <= looks->level_rad[k])
            bearings |= looks->bearings[k];
    return bearings;
}

/* From a sensor, in the body's axes. */
static double bearing_of(const struct bearings_looks *looks, int k, const double at_m[3])
{
    return atan2(at_m[1] - looks->place_m[k][1], at_m[0] - looks->place_m[k][0]);
}

bool bearings_pass(const struct bearings_looks *looks, double off_rad, const double from_m[3],
                   const double to_m[3])
{
    for (int k = 0; k < BEARINGS_SENSORS; k++)
        if (off_rad <= looks->level_rad[k] &&
            (looks->bearings[k] & between(bearing_of(looks, k, from_m), bearing_of(looks, k, to_m))))
            return true;
    return false;
}

bool bearings_look(const struct bearings_looks *looks, double off_rad, const double at_m[3])
{
    bool found[3] = {false};
    for (int k = 0; k < BEARINGS_SENSORS; k++) {
        const double az_rad = bearing_of(looks, k, at_m);
        for (int i = 0; i < 3 && off_rad <= looks->level_rad[k]; i++)
            found[i] = found[i] || (looks->bearings[k] & part(az_rad + (i - 1) * PART_RAD));
    }
    return found[0] && found[1] && found[2];
}

bool bearings_have(uint64_t set, double az_rad, double within_rad)
{
    const int64_t first = (int64_t)floor((az_rad - within_rad) / PART_RAD) - 1,
                  last = (int64_t)floor((az_rad + within_rad) / PART_RAD) + 1;
    uint64_t parts = 0;
    for (int64_t k = first; k <= last; k++)
        parts |= UINT64_C(1) << ((uint64_t)k % BEARINGS); /* BEARINGS divides 2^64 */
    return (parts & ~set) == 0;
}

/* How many parts from that one on are open, itself included, one way or the other (by = 1 or -1), up to so many. */
static int open_parts(const uint64_t set[BEARINGS_FINE / 64], int64_t fine, int by, int most)
{
    int n = 0;
    while (n < most && is_open(set, fine + by * n))
        n++;
    return n;
}

double bearings_inside(const uint64_t row[BEARINGS_FINE / 64], double az_rad, double edge_rad)
{
    const int64_t at = fine_part(az_rad);
    const int edge = (int)ceil(edge_rad / FINE_RAD), most = BEARINGS_FINE;
    const int left = open_parts(row, at, -1, most), right = open_parts(row, at, 1, most);
    if (left && left + right <= 2 * edge + 1)
        return INFINITY;
    return FINE_RAD * fmax(fmin(left, right) - edge, 0);
}

/* Still sonars in the axes that are asked about. */
struct eyes {
    struct eye {
        const uint64_t *opens;
        double axis[3][3], origin_m[2], sin_low, sin_high;
    } eye[BEARINGS_SENSORS];
    int n;
};

static void open_eyes(const struct bearings_looks *looks, const struct bearings_view *view, struct eyes *eyes)
{
    eyes->n = 0;
    for (int k = 0; k < BEARINGS_SENSORS; k++) {
        const struct bearings_still *still = &looks->still[k];
        if (still->low_rad >= still->high_rad)
            continue;
        struct eye *eye = &eyes->eye[eyes->n++];
        double turn[4], lever_m[3];
        quat_multiply(view->attitude, still->mount.attitude, turn);
        quat_rotate(view->attitude, still->mount.position_m, lever_m);
        quat_axes(turn, eye->axis);
        eye->opens = still->opens;
        eye->sin_low = sin(still->low_rad);
        eye->sin_high = sin(still->high_rad);
        for (int i = 0; i < 2; i++)
            eye->origin_m[i] = view->offset_m[i] + lever_m[i];
    }
}

/* Is a place, given as the ranges count, in a beam of any? */
static bool eyes_see(const struct eyes *eyes, const double place_m[3])
{
    for (int k = 0; k < eyes->n; k++) {
        const struct eye *eye = &eyes->eye[k];
        const double way_m[3] = {place_m[0] - eye->origin_m[0], place_m[1] - eye->origin_m[1], place_m[2]};
        const double up_m = -geo_dot(way_m, eye->axis[2]), range_m = geo_length(way_m);
        if (up_m < eye->sin_low * range_m || up_m > eye->sin_high * range_m)
            continue;
        if (is_open(eye->opens, fine_part(atan2(geo_dot(way_m, eye->axis[1]), geo_dot(way_m, eye->axis[0])))))
            return true;
    }
    return false;
}

/* A cell of a row, as far away as is asked. */
struct spot {
    double cos_az, sin_az, el_rad, step_rad, range_m;
};

static bool is_seen(const struct eyes *eyes, const struct spot *at, double cells_up)
{
    const double el_rad = at->el_rad + cells_up * at->step_rad, level_m = at->range_m * cos(el_rad);
    return eyes_see(eyes,
                    (const double[3]){level_m * at->cos_az, level_m * at->sin_az, -at->range_m * sin(el_rad)});
}

#define WHOLE 0.75 /* cells: no corner of a cell lies farther above or below its middle, however it is turned */

/* Is so many cells above that one a cell wholly in the beams? */
static bool is_whole(const struct eyes *eyes, const struct spot *at, double cells_up)
{
    return is_seen(eyes, at, cells_up + WHOLE) && is_seen(eyes, at, cells_up - WHOLE);
}

/* As bearings_row has it. */
static bool is_looked_at(const struct eyes *eyes, const struct spot *at)
{
    if (is_whole(eyes, at, 0))
        return true;
    return (is_seen(eyes, at, 0) || is_seen(eyes, at, 0.5) || is_seen(eyes, at, -0.5)) && !is_whole(eyes, at, 1) &&
           !is_whole(eyes, at, -1);
}

bool bearings_still_look(const struct bearings_looks *looks, const struct bearings_view *view, double az_rad,
                         double range_m, double edge_rad)
{
    struct eyes eyes;
    bool whole = true;
    open_eyes(looks, view, &eyes);
    for (int side = -1; side <= 1 && whole; side++) {
        const double rad = az_rad + side * edge_rad;
        whole = is_whole(&eyes, &(struct spot){cos(rad), sin(rad), 0, view->step_rad, range_m}, 0);
    }
    return whole;
}

#define RANGES 3 /* at near_m, half and a third of it: parallax goes by one over the range */

void bearings_row(const struct bearings_looks *looks, const struct bearings_view *view, double el_rad,
                  double near_m, uint64_t row[BEARINGS_FINE / 64])
{
    struct eyes eyes;
    open_eyes(looks, view, &eyes);
    memset(row, 0, BEARINGS_FINE / 8);
    for (int k = 0; eyes.n > 0 && k < BEARINGS_FINE; k++) {
        const double az_rad = (k + 0.5) * FINE_RAD;
        struct spot at = {cos(az_rad), sin(az_rad), el_rad, view->step_rad, 0};
        for (int i = 1; i <= RANGES && !is_open(row, k); i++) {
            at.range_m = near_m / i;
            if (is_looked_at(&eyes, &at))
                open_part(row, k);
        }
    }
}
