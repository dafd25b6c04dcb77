/* SPDX-License-Identifier: MIT */
/*
 * rov.h - a virtual BlueROV2 in six degrees of freedom, coupled: a rigid body and the water that moves with it by
 * Kirchhoff's equations, linear and quadratic drag, righting moment, weight in water, thrusters that lag, that are
 * stronger one way than the other and differ from each other, a steady current, and a tether that lies in water that
 * moves otherwise. Drawn anew for every dive, between the published models. It knows nothing of the bounds that are
 * tested with it, and shares no table or function with them.
 */
#ifndef SONARD_TEST_ROV_H
#define SONARD_TEST_ROV_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "random.h"

struct rov {
    bool heavy;
    uint64_t seed;
    double mass[3], inertia[3]; /* with the water that moves along */
    double linear[6], square[6];
    double righting_nm, lift_n; /* of the weight below the buoyancy; of the whole, upward */
    double volts, lag_s, share[8];
    int strong[8]; /* the sign of the direction in which it is strong */
    int direction[8];
    double current_mps[3], tether_mps[3], tether_ns2pm2;
    double most_current_mps; /* of both */
    /* now */
    double place_m[3], q[4], momentum[3], spin[3], thrust_n[8];
    int pulse_us[8];
};

static inline double rov_draw(struct rov *r, double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&r->seed);
}

/* m, m, m, a x 6, b x 6: Wu; Lipenitis and Einarsson; von Benzon and others; orca4. */
static const double rov_models[4][15] = {
    {17.0, 24.2, 26.07, 4.03, 6.22, 5.18, .07, .07, .07, 18.18, 21.66, 36.99, 1.55, 1.55, 1.55},
    {16.9, 24.1, 25.97, 25.15, 7.364, 17.955, 3.744, 3.744, 3.744, 17.77, 125.9, 72.36, .186, .186, .186},
    {19.86, 20.62, 32.18, 13.7, 0, 33, .07, .07, .07, 141, 217, 190, 1.5, 1.5, 1.5},
    {9.75, 9.75, 9.75, 0, 0, 0, .07, .07, .07, 34.2, 55.0, 73.2, 1.0, 1.0, 1.0}};

/* A mixture of two models: often one of them alone. */
static inline void rov_mix(struct rov *r, double out[15])
{
    const int i = (int)rov_draw(r, 0, 3.999), k = (int)rov_draw(r, 0, 3.999);
    const double share = fmin(fmax(rov_draw(r, -0.5, 1.5), 0), 1);
    for (int n = 0; n < 15; n++)
        out[n] = rov_models[i][n] + share * (rov_models[k][n] - rov_models[i][n]);
}

static inline void rov_water(struct rov *r, double most_mps, double out[3])
{
    const double to = rov_draw(r, 0, 6.28318530717958648), mps = most_mps * fmin(1, rov_draw(r, 0, 1.5));
    out[0] = mps * cos(to);
    out[1] = mps * sin(to);
    out[2] = 0;
}

static inline void rov_start(struct rov *r, uint64_t seed, bool heavy, double most_current_mps)
{
    double masses[15], drags[15];
    *r = (struct rov){.heavy = heavy, .seed = seed, .q = {1, 0, 0, 0}, .most_current_mps = most_current_mps};
    rov_mix(r, masses);
    rov_mix(r, drags);
    memcpy(r->mass, masses, sizeof r->mass);
    for (int i = 0; i < 3; i++)
        r->inertia[i] = rov_draw(r, 0.2, 0.7);
    memcpy(r->linear, drags + 3, sizeof r->linear);
    memcpy(r->square, drags + 9, sizeof r->square);
    r->righting_nm = rov_draw(r, 1, 5);
    r->lift_n = rov_draw(r, -3, 3);
    r->volts = rov_draw(r, 12.5, 16.8);
    r->lag_s = rov_draw(r, 0.02, 0.3);
    for (int k = 0; k < 8; k++) {
        r->share[k] = rov_draw(r, 0.88, 1.08);
        r->strong[k] = rov_draw(r, 0, 1) < 0.5 ? -1 : 1;
        r->direction[k] = rov_draw(r, 0, 1) < 0.5 ? -1 : 1;
        r->pulse_us[k] = 1500;
    }
    if (rov_draw(r, 0, 1) < 0.1) /* a propeller is gone */
        r->share[(int)rov_draw(r, 0, heavy ? 7.999 : 5.999)] = 0;
    rov_water(r, most_current_mps, r->current_mps);
    rov_water(r, most_current_mps, r->tether_mps);
    r->tether_ns2pm2 = rov_draw(r, 0, 0.5 * 1025 * 1.2 * 0.0076 * 20);
}

/* The maker's table at 12 V in kgf, by microseconds; at other voltages more by a power that fits the maker's, and a
 * dead band that is narrower by 2 us a volt, as there. */
static inline double rov_curve_n(const struct rov *r, double us, bool strong)
{
    static const double at[] = {36, 40, 60, 80, 100, 200, 300, 400};
    static const double ahead[] = {0, .04, .13, .25, .39, 1.28, 2.46, 3.71},
                        back[] = {0, .04, .11, .21, .32, 1.02, 1.95, 2.90};
    const double *kgf = strong ? ahead : back;
    int i = 1;
    us = us < 400 ? 400 - (400 - us) * (400 - at[0]) / (400 - at[0] + 2 * (fmin(r->volts, 16) - 12)) : 400;
    if (us <= at[0])
        return 0;
    while (i < 7 && at[i] < us)
        i++;
    const double share = (us - at[i - 1]) / (at[i] - at[i - 1]);
    return 9.80665 * (kgf[i - 1] + share * (kgf[i] - kgf[i - 1])) * pow(r->volts / 12, 1.15);
}

/* Where motor k is, and which way it pushes when the autopilot calls it positive. */
static inline void rov_motor(const struct rov *r, int k, double at[3], double to[3])
{
    static const double level_at[4][2] = {{.15, .11}, {.15, -.11}, {-.15, .11}, {-.15, -.11}};
    static const double level_to[4][2] = {{-1, 1}, {-1, -1}, {1, 1}, {1, -1}};
    static const double high_at[4][2] = {{.12, .22}, {.12, -.22}, {-.12, .22}, {-.12, -.22}};
    if (k < 4) {
        memcpy(at, (double[3]){level_at[k][0], level_at[k][1], 0.02}, 3 * sizeof *at);
        memcpy(to, (double[3]){level_to[k][0] / sqrt(2), level_to[k][1] / sqrt(2), 0}, 3 * sizeof *to);
        return;
    }
    memcpy(at,
           r->heavy ? (double[3]){high_at[k - 4][0], high_at[k - 4][1], 0}
                    : (double[3]){0, k == 4 ? .11 : -.11, 0},
           3 * sizeof *at);
    memcpy(to, (double[3]){0, 0, 1}, 3 * sizeof *to);
}

static inline void rov_cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Rows: north, east, down in the body's axes. */
static inline void rov_axes(const struct rov *r, double m[3][3])
{
    const double w = r->q[0], x = r->q[1], y = r->q[2], z = r->q[3];
    const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                               {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                               {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    memcpy(m, rows, sizeof rows);
}

/* Over ground, NED. */
static inline void rov_velocity(const struct rov *r, double out[3])
{
    double m[3][3];
    rov_axes(r, m);
    for (int i = 0; i < 3; i++) {
        out[i] = r->current_mps[i];
        for (int k = 0; k < 3; k++)
            out[i] += m[i][k] * r->momentum[k] / r->mass[k];
    }
}

static inline void rov_push(struct rov *r, double dt_s, double force[3], double torque[3])
{
    for (int k = 0; k < (r->heavy ? 8 : 6); k++) {
        double at[3], to[3], turn[3];
        const double off_us = r->direction[k] * (r->pulse_us[k] - 1500);
        const int sign = off_us < 0 ? -1 : 1;
        const double wanted_n =
            sign * r->share[k] * rov_curve_n(r, fabs(off_us), (k < 4 ? 1 : r->strong[k]) == sign);
        r->thrust_n[k] += (wanted_n - r->thrust_n[k]) * (1 - exp(-dt_s / r->lag_s));
        rov_motor(r, k, at, to);
        rov_cross(at, to, turn);
        for (int i = 0; i < 3; i++) {
            force[i] += r->thrust_n[k] * to[i];
            torque[i] += r->thrust_n[k] * turn[i];
        }
    }
}

static inline void rov_step(struct rov *r, double dt_s)
{
    double m[3][3], v[3], w[3], force[3] = {0}, torque[3] = {0}, ground[3], p_w[3], l_w[3], p_v[3];
    rov_axes(r, m);
    rov_velocity(r, ground);
    rov_push(r, dt_s, force, torque);
    double away = 0, pull[3];
    for (int i = 0; i < 3; i++) {
        pull[i] = r->tether_mps[i] - ground[i];
        away += pull[i] * pull[i];
    }
    for (int i = 0; i < 3; i++) {
        v[i] = r->momentum[i] / r->mass[i];
        w[i] = r->spin[i] / r->inertia[i];
        force[i] -= (r->linear[i] + r->square[i] * fabs(v[i])) * v[i];
        torque[i] -= (r->linear[3 + i] + r->square[3 + i] * fabs(w[i])) * w[i];
        force[i] -= r->lift_n * m[2][i];
        for (int k = 0; k < 3; k++)
            force[i] += m[k][i] * r->tether_ns2pm2 * sqrt(away) * pull[k];
    }
    torque[0] -= r->righting_nm * m[2][1];
    torque[1] += r->righting_nm * m[2][0];
    rov_cross(r->momentum, w, p_w);
    rov_cross(r->spin, w, l_w);
    rov_cross(r->momentum, v, p_v);
    for (int i = 0; i < 3; i++) {
        r->momentum[i] += dt_s * (p_w[i] + force[i]);
        r->spin[i] += dt_s * (l_w[i] + p_v[i] + torque[i]);
        r->place_m[i] += dt_s * ground[i];
    }
    const double q[4] = {r->q[0], r->q[1], r->q[2], r->q[3]}, h = dt_s / 2;
    r->q[0] += h * (-q[1] * w[0] - q[2] * w[1] - q[3] * w[2]);
    r->q[1] += h * (q[0] * w[0] + q[2] * w[2] - q[3] * w[1]);
    r->q[2] += h * (q[0] * w[1] - q[1] * w[2] + q[3] * w[0]);
    r->q[3] += h * (q[0] * w[2] + q[1] * w[1] - q[2] * w[0]);
    const double size = sqrt(r->q[0] * r->q[0] + r->q[1] * r->q[1] + r->q[2] * r->q[2] + r->q[3] * r->q[3]);
    for (int i = 0; i < 4; i++)
        r->q[i] /= size;
}

/* ---- what steers it ---- */

/* Wanted of each axis, -1 to 1: roll, pitch, yaw, up, ahead, right. */
struct rov_sticks {
    double axis[6];
    bool levels; /* holds roll and pitch */
    bool heads;  /* holds the heading */
    bool deep;   /* holds the depth */
    double yaw_rad, depth_m;
};

/* ArduSub's mix, and the pulses of it. */
static inline void rov_steer(struct rov *r, const struct rov_sticks *s)
{
    static const int mix[8][6] = {{0, 0, 1, 0, -1, 1}, {0, 0, -1, 0, -1, -1}, {0, 0, -1, 0, 1, 1},
                                  {0, 0, 1, 0, 1, -1}, {1, -1, 0, -1, 0, 0},  {-1, -1, 0, -1, 0, 0},
                                  {1, 1, 0, -1, 0, 0}, {-1, 1, 0, -1, 0, 0}};
    static const int mix6[2][6] = {{1, 0, 0, -1, 0, 0}, {-1, 0, 0, -1, 0, 0}};
    double m[3][3], axis[6], ground[3];
    rov_axes(r, m);
    rov_velocity(r, ground);
    memcpy(axis, s->axis, sizeof axis);
    const double roll = atan2(m[2][1], m[2][2]), pitch = -asin(fmin(fmax(m[2][0], -1), 1)),
                 yaw = atan2(m[1][0], m[0][0]);
    if (s->levels) {
        axis[0] -= 1.2 * roll + 0.3 * r->spin[0] / r->inertia[0];
        axis[1] -= 1.2 * pitch + 0.3 * r->spin[1] / r->inertia[1];
    }
    if (s->heads) {
        const double off = remainder(s->yaw_rad - yaw, 6.28318530717958648);
        axis[2] += 0.6 * fmax(-0.5, fmin(0.5, off)) - 0.25 * r->spin[2] / r->inertia[2];
    }
    if (s->deep)
        axis[3] -= 0.6 * fmax(-0.5, fmin(0.5, s->depth_m - r->place_m[2]));
    axis[3] += s->deep ? 0.6 * ground[2] : 0;
    for (int k = 0; k < (r->heavy ? 8 : 6); k++) {
        double e = 0;
        for (int i = 0; i < 6; i++)
            e += axis[i] * (r->heavy || k < 4 ? mix[k][i] : mix6[k - 4][i]);
        r->pulse_us[k] = 1500 + (int)lround(400 * r->direction[k] * fmax(-1, fmin(1, e)));
    }
}

#endif
