/* SPDX-License-Identifier: MIT */
/* basin - see basin.h. */
#include "basin.h"

#include <math.h>

#include "grid/ping.h"
#include "tests/water/dice.h"

#define RAYS    9   /* traced across a beam */
#define APART_M 0.3 /* surfaces that are nearer to each other give one echo */
#define MOST_M  12.0
#define NOISE_M 0.01
#define NOISE   0.003 /* of the range */
#define PULSE_M 0.02
#define TURN_NS 10000000000u

void basin_make(struct basin *b, unsigned seed)
{
    *b = (struct basin){.place = place_basin(seed), .seed = seed};
}

void basin_place(const struct basin *b, unsigned turn, double place[2])
{
    const double way = 0.7 * b->seed;
    place[0] = 0.25 * (turn - 0.5 * (BASIN_TURNS - 1)) * cos(way);
    place[1] = 0.25 * (turn - 0.5 * (BASIN_TURNS - 1)) * sin(way);
}

double basin_range(const struct basin *b, const double p[2], double az_rad, int *shape)
{
    struct place_hit hit;
    place_cast(&b->place, (const double[]){p[0], p[1], 0}, (const double[]){cos(az_rad), sin(az_rad), 0}, 0, &hit);
    if (shape)
        *shape = hit.shape;
    return hit.range_m;
}

double basin_nearest(const struct basin *b, const double p[2], double az_rad, double half_rad)
{
    const struct place_fan fan = {az_rad, 0, half_rad, 0, 41, 1};
    return place_nearest(&b->place, (const double[]){p[0], p[1], 0}, &fan, 0);
}

/* Ranges that a beam meets, the nearest first, those that run into each other once. */
static unsigned ranges_of(const struct basin *b, const double p[2], double az_rad, double range_m[RAYS])
{
    unsigned n = 0;
    double ray[RAYS];
    for (int k = 0; k < RAYS; k++)
        ray[k] = basin_range(b, p, az_rad + geo_rad(BASIN_AZ_DEG) * ((double)k / (RAYS - 1) - 0.5), NULL);
    for (double last = -INFINITY;; last = range_m[n++]) {
        double next = INFINITY;
        for (int k = 0; k < RAYS; k++)
            if (ray[k] > last + (n > 0 ? APART_M : 0) && ray[k] < next)
                next = ray[k];
        if (n == ECHOES_PER_BEAM || next > MOST_M)
            return n;
        range_m[n] = next;
    }
}

void basin_listen(const struct basin *b, unsigned turn, unsigned beam, bool still, struct echoes *e)
{
    struct dice dice = dice_of(b->seed, 100 + turn * BASIN_BEAMS + beam);
    const double az_rad = GEO_TURN * beam / BASIN_BEAMS;
    struct beam_echoes *h = e->beam;
    double place[2], range_m[RAYS];
    basin_place(b, still ? 0 : turn, place);
    *h = (struct beam_echoes){.az_rad = (float)az_rad, .blind_m = 0.5f, .state = BEAM_SILENT};
    h->n = (uint8_t)ranges_of(b, place, az_rad, range_m);
    for (unsigned k = 0; k < h->n; k++) {
        const double sd_m = NOISE_M + NOISE * range_m[k], r = range_m[k] + sd_m * dice_gauss(&dice);
        h->echo[k] = (struct echo){.range_m = (float)r,
                                   .near_m = (float)(r - PULSE_M),
                                   .sd_m = (float)sd_m,
                                   .strength = 10,
                                   .confidence = 0.9f};
    }
    h->free_to_m = h->n ? h->echo[0].near_m : 0.0f;
    h->state = h->n ? BEAM_ECHO : BEAM_SILENT;
    *e = (struct echoes){.t_ns = (uint64_t)(1 + turn) * TURN_NS + TURN_NS / BASIN_BEAMS * beam,
                         .seq = turn * BASIN_BEAMS + beam,
                         .n_beams = 1,
                         .flags = beam == 0 ? PING_NEW_TURN : 0,
                         .range_max_m = (float)MOST_M,
                         .az_aperture_rad = (float)geo_rad(BASIN_AZ_DEG),
                         .el_aperture_rad = (float)geo_rad(BASIN_EL_DEG),
                         .pose = pose_identity,
                         .max_beams = 1,
                         .beam = h};
    e->pose.has = POSE_ATTITUDE | POSE_POSITION;
    e->pose.position_m[0] = place[0];
    e->pose.position_m[1] = place[1];
    e->pose.path_m = still ? 0 : 0.25 * turn;
}
