/* SPDX-License-Identifier: MIT */
#include "bearings.h"

#include <math.h>

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

/* From the last level beam to this one: the head passed there, or the fan has no beam between. */
static void join_bearings(struct bearings *b, struct bearings_sensor *sensor, double az_rad)
{
    const float step_rad = (float)fabs(geo_wrap_pi(az_rad - (double)sensor->last_rad));
    if (step_rad > 0 && (sensor->step_rad <= 0 || step_rad < sensor->step_rad))
        sensor->step_rad = step_rad;
    b->seen |= between((double)sensor->last_rad, az_rad);
}

void bearings_enter(struct bearings *b, const struct echoes *e, const struct mount *mount)
{
    struct bearings_sensor *sensor = &b->sensor[e->sensor % BEARINGS_SENSORS];
    const bool one_beam = sensor->first_rad == sensor->last_rad;
    const float before_rad = sensor->first_rad;
    double az_rad;
    bool first = true;
    sensor->wide_rad = e->az_aperture_rad;
    if (e->flags & PING_NEW_TURN && sensor->turns < 3)
        sensor->turns++;
    for (unsigned i = 0; i < e->n_beams; i++) {
        const double heard_rad = level_rad(&e->beam[i], e, mount, &az_rad);
        const bool joins = sensor->level && (one_beam || !first);
        sensor->level = heard_rad >= LEAST_RAD;
        if (!sensor->level)
            continue;
        if (first && sensor->pings == 2 && !sensor->moves && (float)az_rad == before_rad)
            return; /* a fan that looks where it did before */
        b->level_rad = b->seen ? fmin(b->level_rad, heard_rad) : heard_rad;
        b->seen |= part(az_rad);
        if (joins)
            join_bearings(b, sensor, az_rad);
        sensor->last_rad = (float)az_rad;
        sensor->first_rad = first ? (float)az_rad : sensor->first_rad;
        first = false;
    }
    if (first)
        return;
    sensor->moves |= sensor->pings > 0 && sensor->first_rad != before_rad;
    sensor->pings = sensor->pings ? 2 : 1;
}

#define TOUCH_RAD 1e-3 /* beams that are no farther apart leave no gap: their bearings are rounded */

void bearings_tell(const struct bearings *b, struct bearings_looks *out)
{
    *out = (struct bearings_looks){.bearings = b->seen, .level_rad = b->level_rad};
    for (int k = 0; k < BEARINGS_SENSORS; k++) {
        const struct bearings_sensor *sensor = &b->sensor[k];
        const bool turns = sensor->pings == 1 || sensor->moves, first_turns = turns && sensor->turns < 3;
        const double gap_rad = (double)sensor->step_rad - (first_turns ? (double)sensor->wide_rad : 0);
        if (turns && sensor->turns < 2)
            out->bearings = UINT64_MAX;
        out->first_turns |= first_turns;
        if (gap_rad > TOUCH_RAD)
            out->gap_rad = fmax(out->gap_rad, gap_rad);
    }
}
