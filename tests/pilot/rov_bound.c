/* SPDX-License-Identifier: MIT */
#include "rov_bound.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"
#include "tests/lib/rov.h"

#define CLIMB_S   2.0 /* of the average, as in mavlink_thrusters.c */
#define CLIMB_OFF 0.03

/* Where down is in the body's axes; the heading. */
static double attitude_of(const struct rov *r, double down[3])
{
    double m[3][3];
    rov_axes(r, m);
    memcpy(down, m[2], 3 * sizeof *down);
    return atan2(m[1][0], m[0][0]);
}

void rov_bound_start(struct rov_bound *b, const struct rov *r)
{
    memset(b, 0, sizeof *b);
    for (int k = 0; k < THRUST_MOTORS; k++)
        b->last_us[k] = r->pulse_us[k];
    b->last_yaw_rad = attitude_of(r, b->last_down);
    speed_bound_start(&b->bound, &(struct speed_bound_conf){0});
}

void rov_bound_sample(struct rov_bound *b, const struct rov *r, double mps[2], double push_n[2])
{
    struct speed_bound_push push = {
        .frame = thrust_frame(r->heavy ? 2 : 1), .tilt_known = true, .climb_known = true};
    double ground[3], was[2], is[2];
    const double yaw_rad = attitude_of(r, push.down[1]);
    rov_velocity(r, ground);
    b->climb_mps += (ground[2] - b->climb_mps) * (1 - exp(-ROV_BOUND_S / CLIMB_S));
    push.climb_mps = fabs(b->climb_mps) + CLIMB_OFF;
    push.turned_rad = remainder(yaw_rad - b->last_yaw_rad, GEO_TURN);
    memcpy(push.down[0], b->last_down, sizeof push.down[0]);
    push_n[0] = push_n[1] = 0;
    for (int k = 0; k < push.frame->n; k++) {
        const struct thrust_motor *m = &push.frame->motor[k];
        const struct thrust_range before = thrust_range(m, b->last_us[k], r->direction[k], THRUST_VOLTS),
                                  now = thrust_range(m, r->pulse_us[k], r->direction[k], THRUST_VOLTS);
        push.thrust[k] = (struct thrust_range){fmin(before.least_n, now.least_n), fmax(before.most_n, now.most_n)};
        for (int i = 0; i < 2; i++)
            push_n[i] += m->axis[i] * (now.least_n + now.most_n) / 2;
    }
    speed_bound_mps(&b->bound, was);
    speed_bound_step(&b->bound, &push, ROV_BOUND_S);
    speed_bound_mps(&b->bound, is);
    for (int i = 0; i < 2; i++)
        mps[i] = fmax(was[i], is[i]);
    memcpy(b->last_down, push.down[1], sizeof b->last_down);
    b->last_yaw_rad = yaw_rad;
    for (int k = 0; k < THRUST_MOTORS; k++)
        b->last_us[k] = r->pulse_us[k];
}
