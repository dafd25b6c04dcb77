/* SPDX-License-Identifier: MIT */
/*
 * voxel_scene - the pings of the voxel map's benchmarks, the same for every map that is measured:
 *   A  a shaft of 9 x 5 x 27 m, a turning head of 3 x 35 degrees, 200 pings a turn, 100 turns on the way down
 *   T  the same with roll and pitch of 10 degrees
 *   B  open water: 50 m, no echo
 */
#ifndef SONARD_VOXEL_SCENE_H
#define SONARD_VOXEL_SCENE_H

#include <math.h>
#include <stdbool.h>

#include "grid/geometry.h"

#define SCENE_PINGS  200 /* a turn */
#define SCENE_AZ_DEG 3.0
#define SCENE_EL_DEG 35.0

struct scene_ping {
    double position_m[3], attitude[4]; /* the beam's axis is the attitude's x */
    double range_m;
    bool echo;
};

/* To the shaft's wall along a ray. */
static inline double scene_wall(const double from_m[3], const double ray[3])
{
    static const double half_m[3] = {4.5, 2.5, 13.5};
    double range = 1e9;
    for (int a = 0; a < 3; a++)
        if (fabs(ray[a]) > 1e-12)
            range = fmin(range, ((ray[a] > 0 ? half_m[a] : -half_m[a]) - from_m[a]) / ray[a]);
    return range;
}

static inline void scene_ray(const struct scene_ping *p, double az_rad, double el_rad, double ray[3])
{
    const double v[3] = {cos(az_rad) * cos(el_rad), sin(az_rad) * cos(el_rad), -sin(el_rad)};
    quat_rotate(p->attitude, v, ray);
}

static inline struct scene_ping scene_at(char scene, int turn, int turns, int number)
{
    struct scene_ping p;
    double tilt = scene == 'T' ? geo_rad(10) : 0, phase = turn * 0.7 + number * 0.003;
    p.position_m[0] = p.position_m[1] = 0.03;
    p.position_m[2] = scene == 'B' || turns < 2 ? 0.04 : -9.0 + 18.0 * turn / (turns - 1);
    quat_from_rpy(tilt * sin(phase), tilt * cos(phase), GEO_TURN * number / SCENE_PINGS, p.attitude);
    p.echo = scene != 'B';
    p.range_m = p.echo ? 1e9 : 50;
    for (int i = 0; p.echo && i < 7; i++)
        for (int j = 0; j < 15; j++) {
            double ray[3];
            scene_ray(&p, geo_rad(SCENE_AZ_DEG) * (i / 6.0 - 0.5), geo_rad(SCENE_EL_DEG) * (j / 14.0 - 0.5), ray);
            p.range_m = fmin(p.range_m, scene_wall(p.position_m, ray));
        }
    return p;
}

#endif
