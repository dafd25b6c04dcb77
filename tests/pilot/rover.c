/* SPDX-License-Identifier: MIT */
#include "rover.h"

#include "grid/geometry.h"

#define IDLE_S     25.0
#define REST_S     15.0
#define STEP_S     0.01
#define STEER_S    0.02
#define GAIN_HZ    2.0 /* of who holds the speed */
#define GENTLE     0.3 /* m/s2 that he speeds up and brakes by, at most */
#define NOTHING_N  0.2
#define TURN_RADPS 0.5
#define HALVINGS   20
#define DEEP_M     10.0

double rover_heading(const struct rover *r)
{
    double m[3][3];
    rov_axes(&r->rov, m);
    return atan2(m[1][0], m[0][0]);
}

static bool due(double *since_s, double every_s, double dt_s)
{
    *since_s += dt_s;
    if (*since_s < every_s - dt_s / 2)
        return false;
    *since_s = 0;
    return true;
}

static bool go_on(struct rover *r, bool steered, double dt_s)
{
    bool sampled = false;
    for (double left_s = dt_s; left_s > STEP_S / 2; left_s -= STEP_S) {
        if (due(&r->steer_s, STEER_S, STEP_S) && steered)
            rov_steer(&r->rov, &r->sticks);
        rov_step(&r->rov, STEP_S);
        if (!due(&r->sample_s, ROV_BOUND_S, STEP_S))
            continue;
        rov_bound_sample(&r->bound, &r->rov, r->mps, r->push_n);
        sampled = true;
    }
    return sampled;
}

void rover_start(struct rover *r, uint64_t seed, const double current_mps[2], double most_mps)
{
    *r = (struct rover){.sticks = {.levels = true, .heads = true, .deep = true, .depth_m = DEEP_M}};
    rov_start(&r->rov, seed, false, most_mps);
    memcpy(r->rov.current_mps, current_mps, 2 * sizeof *current_mps);
    r->rov.place_m[2] = DEEP_M;
    rov_bound_start(&r->bound, &r->rov);
    go_on(r, false, IDLE_S);
    go_on(r, true, REST_S);
    memset(r->rov.place_m, 0, sizeof r->rov.place_m);
    r->sticks.depth_m = 0;
}

/* How far to move the stick for a force along one of the body's level axes: two thrusters push by their strong side,
 * and two by the other. */
static double stick_for(const struct rov *r, double force_n)
{
    double lo = 0, hi = 1;
    if (fabs(force_n) < NOTHING_N)
        return 0;
    for (int i = 0; i < HALVINGS; i++) {
        const double mid = (lo + hi) / 2;
        const double n = sqrt(2) * (rov_curve_n(r, 400 * mid, true) + rov_curve_n(r, 400 * mid, false));
        *(n < fabs(force_n) ? &lo : &hi) = mid;
    }
    return copysign(lo, force_n);
}

/* He knows the drag of his vehicle. */
static double force_for(const struct rov *r, int axis, double wanted_mps)
{
    const double drag_n = (r->linear[axis] + r->square[axis] * fabs(wanted_mps)) * wanted_mps,
                 wish = GAIN_HZ * (wanted_mps - r->momentum[axis] / r->mass[axis]);
    return drag_n + r->mass[axis] * fmax(-GENTLE, fmin(GENTLE, wish));
}

bool rover_step(struct rover *r, const double command_mps[2], double wanted_rad, double dt_s)
{
    const double yaw = rover_heading(r), c = cos(yaw), s = sin(yaw);
    const double wanted_mps[2] = {c * command_mps[0] + s * command_mps[1],
                                  c * command_mps[1] - s * command_mps[0]};
    const double off = geo_wrap_pi(wanted_rad - r->sticks.yaw_rad), most = TURN_RADPS * dt_s;
    r->sticks.yaw_rad += fmax(-most, fmin(most, off));
    for (int i = 0; i < 2; i++)
        r->sticks.axis[4 + i] = stick_for(&r->rov, force_for(&r->rov, i, wanted_mps[i]));
    return go_on(r, true, dt_s);
}
