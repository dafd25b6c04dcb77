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

/*
 * How far above and below the body's level plane the water at a beam's bearing is surely heard; negative: the beam
 * passes above or below. Where the sensor lies on its side that is the beam's width.
 */
static double level_rad(const struct beam_echoes *beam, const struct echoes *e, const struct mount *mount,
                        double *az_rad)
{
    const double az = (double)beam->az_rad, el = (double)beam->el_rad;
    double axis[3], up[3], side[3] = {-sin(az), cos(az), 0};
    geo_direction(az, el, axis);
    geo_direction(az, el + GEO_PI / 2, up);
    quat_rotate(mount->attitude, axis, axis);
    quat_rotate(mount->attitude, up, up);
    quat_rotate(mount->attitude, side, side);
    *az_rad = atan2(axis[1], axis[0]);
    const double high_rad = (double)e->el_aperture_rad / 2 / fmax(fabs(up[2]), 1e-9),
                 wide_rad = (double)e->az_aperture_rad / 2 / fmax(fabs(side[2]), 1e-9);
    return fmin(high_rad, wide_rad) - fabs(asin(fmax(-1, fmin(1, axis[2]))));
}

#define LEAST_RAD (5 * GEO_PI / 180) /* a beam that hears no more above and below level shows no bearing */

#define TOUCH_RAD 1e-3 /* beams that are no farther apart point the same way: their bearings are rounded */

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
 * a step. A step is less than one and a half times as long as its least, for after a lost ping it is twice as long. No
 * longer way is one, however often the head makes it: of evenly spaced pings most may have been lost.
 */
static uint64_t passed(const struct bearings_sensor *sensor, double az_rad, bool joins)
{
    const double last_rad = (double)sensor->last_rad, way_rad = fabs(geo_wrap_pi(az_rad - last_rad));
    return joins && way_rad < 1.5 * (double)sensor->step_rad ? between(last_rad, az_rad) : part(az_rad);
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

/* A fan's ping is deaf there. */
static void mind_deaf_beams(struct bearings_sensor *sensor, uint64_t deaf)
{
    sensor->deaf = deaf & sensor->deaf_before;
    sensor->deaf_before = deaf;
}

/* A ping that is deaf all over leaves what the last one had in view. */
static void keep_view(struct bearings_sensor *sensor, const struct echoes *e, const struct mount *mount)
{
    struct bearings_view *view = &sensor->view;
    uint64_t bearings = sensor->seen;
    double az_rad;
    for (unsigned i = 0; i < e->n_beams; i++)
        if (is_deaf(&e->beam[i]) && level_rad(&e->beam[i], e, mount, &az_rad) > 0)
            bearings &= ~part(az_rad);
    mind_deaf_beams(sensor, sensor->seen & ~bearings);
    if (!bearings)
        return;
    *view = (struct bearings_view){.bearings = bearings,
                                   .range_m = (double)e->range_max_m,
                                   .mount_m = geo_length(mount->position_m),
                                   .path_m = e->pose.path_m,
                                   .drift_m = {e->pose.drift_m[0], e->pose.drift_m[1]},
                                   .t_ns = e->t_ns,
                                   .discontinuities = e->pose.discontinuities,
                                   .withdrawn = e->pose.withdrawn};
    memcpy(view->attitude, e->pose.attitude, sizeof view->attitude);
    quat_rotate(view->attitude, mount->position_m, view->position_m);
    for (int k = 0; k < 3; k++)
        view->position_m[k] += e->pose.position_m[k];
}

void bearings_enter(struct bearings *b, const struct echoes *e, const struct mount *mount)
{
    struct bearings_sensor *sensor = &b->sensor[e->sensor % BEARINGS_SENSORS];
    const bool one_beam = sensor->first_rad == sensor->last_rad;
    const float before_rad = sensor->first_rad;
    double az_rad;
    bool first = true;
    sensor->wide_rad = e->az_aperture_rad;
    if (sensor->last_ns && e->t_ns > sensor->last_ns && e->t_ns - sensor->last_ns > BEARINGS_AWAY_NS)
        sensor->back_ns = e->t_ns;
    sensor->last_ns = e->t_ns;
    b->t_ns = e->t_ns > b->t_ns ? e->t_ns : b->t_ns;
    if (e->flags & PING_NEW_TURN && sensor->turns < 3)
        sensor->turns++;
    if (!sensor->moves)
        keep_view(sensor, e, mount);
    for (unsigned i = 0; i < e->n_beams; i++) {
        const double heard_rad = level_rad(&e->beam[i], e, mount, &az_rad);
        const bool joins = sensor->level && (one_beam || !first);
        sensor->level = heard_rad >= LEAST_RAD;
        if (!sensor->level)
            continue;
        if (first && sensor->pings == 2 && !sensor->moves && (float)az_rad == before_rad)
            return; /* a fan that looks where it did before */
        b->level_rad = b->level_rad > 0 ? fmin(b->level_rad, heard_rad) : heard_rad;
        sensor->seen |= part(az_rad);
        if (joins)
            join_bearings(sensor, az_rad);
        if (sensor->moves)
            mind_deaf_beam(sensor, &e->beam[i], az_rad, joins);
        if (!is_deaf(&e->beam[i]))
            hear(sensor, az_rad, joins, e->t_ns);
        sensor->last_rad = (float)az_rad;
        sensor->first_rad = first ? (float)az_rad : sensor->first_rad;
        first = false;
    }
    if (first)
        return;
    sensor->moves |= sensor->pings > 0 && sensor->first_rad != before_rad;
    sensor->pings = sensor->pings ? 2 : 1;
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
    *out = (struct bearings_looks){.t_ns = b->t_ns, .level_rad = b->level_rad};
    for (int k = 0; k < BEARINGS_SENSORS; k++) {
        const struct bearings_sensor *sensor = &b->sensor[k];
        const bool turns = sensor->pings == 1 || sensor->moves, first_turns = turns && sensor->turns < 3;
        const double gap_rad = (double)sensor->step_rad - (first_turns ? (double)sensor->wide_rad : 0);
        out->bearings |= turns && sensor->turns < 2 ? UINT64_MAX : sensor->seen;
        out->hears[k] = sensor->seen & ~sensor->deaf;
        for (int i = 0; turns && i < BEARINGS; i++)
            out->heard_ds[k][i] = tenths(b->t_ns, sensor->heard_ns[i]);
        out->back_ds[k] = tenths(b->t_ns, sensor->back_ns);
        out->turn_s[k] = turn_ms[k] * 1e-3;
        out->last_ns[k] = turns ? sensor->last_ns : sensor->view.t_ns;
        if (turns && !first_turns)
            out->heads |= UINT64_C(1) << k;
        if (!turns && sensor->pings) {
            out->fans |= UINT64_C(1) << k;
            out->view[k] = sensor->view;
        }
        out->first_turns |= first_turns;
        if (gap_rad > TOUCH_RAD)
            out->gap_rad = fmax(out->gap_rad, gap_rad);
    }
}

/* A head that sweeps to and fro begins a turn each way; a tenth more for pings that are lost. */
#define SHOWN_TURNS 2.2

/* How old, in tenths of a second at looks->t_ns, what a sensor heard may be to be shown since_s later: as old as clear
 * water, or as old as a head lets it become that has not been away. */
static double shown_ds(const struct bearings_looks *looks, int k, double since_s, double clear_for_s)
{
    const double turns_ds = 10 * (SHOWN_TURNS * looks->turn_s[k] - since_s);
    return fmin(fmax(10 * (clear_for_s - since_s), fmin(turns_ds, looks->back_ds[k])), BEARINGS_NEVER - 1);
}

uint64_t bearings_of(const struct bearings_looks *looks, uint64_t sensors, uint64_t now_ns, double clear_for_s)
{
    const double since_s = now_ns > looks->t_ns ? (double)(now_ns - looks->t_ns) * 1e-9 : 0;
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

void bearings_forget(struct bearings *b)
{
    for (int k = 0; k < BEARINGS_SENSORS; k++)
        b->sensor[k].view.bearings = 0;
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

/* A place in the body's axes as the fan saw it: its azimuth, and how far aside it may be for being off_m off. */
static double azimuth(const struct bearings_view *view, const double ned_m[3], double off_m, double *aside_rad,
                      double *far_m)
{
    double v[3];
    for (int k = 0; k < 3; k++)
        v[k] = ned_m[k] - view->position_m[k];
    quat_rotate_inverse(view->attitude, v, v);
    const double level_m = hypot(v[0], v[1]);
    *aside_rad = fmax(*aside_rad, off_m < level_m ? asin(off_m / level_m) : GEO_PI);
    *far_m = fmax(*far_m, geo_length(v) + off_m);
    return atan2(v[1], v[0]);
}

/* Nobody knows where what it had in view lies from there. */
static bool is_lost(const struct bearings_view *view, const struct pose *pose)
{
    return view->discontinuities != pose->discontinuities || view->withdrawn != pose->withdrawn ||
           pose->drift_m[0] > view->drift_m[0] || pose->drift_m[1] > view->drift_m[1];
}

bool bearings_had(const struct bearings_view *view, const struct pose *pose, uint64_t now_ns,
                  const double line_m[2][3], double off_m, double off_rad)
{
    if (!view->bearings || is_lost(view, pose))
        return false;
    const double since_s = now_ns > view->t_ns ? (double)(now_ns - view->t_ns) * 1e-9 : 0;
    const double way_m = fmax(pose->path_m - view->path_m, 0), turned_rad = pose->heading_radps * since_s;
    double aside_rad = 0, far_m = 0;
    off_m += (POSE_WAY_ERROR + turned_rad) * way_m;
    const double first_rad = azimuth(view, line_m[0], off_m, &aside_rad, &far_m),
                 half_rad = geo_wrap_pi(azimuth(view, line_m[1], off_m, &aside_rad, &far_m) - first_rad) / 2;
    const double within_rad = fabs(half_rad) + aside_rad + off_rad + turned_rad;
    return far_m <= view->range_m && bearings_have(view->bearings, first_rad + half_rad, fmin(within_rad, GEO_PI));
}
