/* SPDX-License-Identifier: MIT */
#include "speed_bound.h"

#include <math.h>
#include <string.h>

/*
 * Published models of the BlueROV2, D = a v + b v |v| along each axis (N, m/s), and masses with the water that moves
 * with the vehicle (kg), for surge, sway, heave:
 *
 *     Wu 2018 (Flinders)           a 4.03 6.22 5.18      b 18.18 21.66 36.99    m 17.0 24.2 26.1
 *     Lipenitis, Einarsson 2020    a 25.15 7.36 17.96    b 17.77 125.9 72.36    m as Wu
 *     von Benzon 2022, Heavy       a 13.7 0 33           b 141 217 190          m 19.9 20.6 32.2
 *     orca4, a simulator           a 0 0 0               b 34.2 55 73.2         m 9.75 to 10, no water
 *
 * Level momentum by the mass of surge, wherever it points in the body: in these terms the drag of an axis is a / r and
 * b / r^2, with r its mass by that of surge. Over all directions the least of the sum of the a is the least of them,
 * and of the b it is 1 / sqrt(sum of 1 / b^2). Of all models Wu's is the lowest from 0.2 m/s on, below that orca4's.
 */
#define DRAG_MARGIN 0.9

/* The lower of two laws: a v + b v^2, and c v^2. least_kg, most_kg: masses, with a tenth. */
struct way {
    double linear, square, slow, least_kg, most_kg;
};

static const struct way ways[] = {
    [SPEED_BOUND_AHEAD] = {4.03, 18.18, 34.2, 8.8, 22}, [SPEED_BOUND_ASIDE] = {6.22, 21.66, 55.0, 8.8, 27},
    [SPEED_BOUND_LEVEL] = {4.03, 9.2, 29.0, 8.8, 22},   [SPEED_BOUND_VERTICAL] = {5.18, 36.99, 73.2, 8.8, 35},
    [SPEED_BOUND_ALL] = {3.4, 7.95, 27.0, 8.8, 22},
};
#define SIDE_BY_AHEAD 1.45 /* mass of sway by that of surge, at most; at least 1 */
#define UNLIKE        0.62 /* mass of heave by that of surge, at most, less 1 */

#define LAG_S    0.3          /* thrust follows the pulse within that */
#define SPENT_S  5.0          /* a motion that nothing drives any more loses its drag, at the slowest */
#define WEIGHT_N 3.0          /* in the water, up or down */
#define TILT_OFF 0.035        /* sine of 2 degrees */
#define STEEP    0.7          /* sine of a tilt beyond which level and vertical are not told apart */
#define STEP_S   0.01         /* of the integration */
#define AROUND   16           /* directions along the level that are tried */
#define BETWEEN  1.0195911582 /* and by how much the most in between may be more: 1 / cos(pi / 16) */
#define PI       3.14159265358979323846

void speed_bound_start(struct speed_bound *b, const struct speed_bound_conf *conf)
{
    const double motor_n = THRUST_MOST * thrust_newtons(THRUST_PULSE_MAX - THRUST_PULSE_MID, THRUST_VOLTS, true),
                 most_n = THRUST_MOTORS * motor_n;
    *b = (struct speed_bound){.conf = *conf, .up_n = most_n, .down_n = most_n, .along_n = most_n};
    for (int way = 0; way < SPEED_BOUND_WAYS; way++)
        b->mps[way] = SPEED_BOUND_CAP_MPS;
    for (int k = 0; k < THRUST_MOTORS; k++)
        b->thrust[k] = (struct thrust_range){-motor_n, motor_n};
}

/* ---- forces ---- */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double span(const struct thrust_range *r)
{
    return fmax(fabs(r->least_n), fabs(r->most_n));
}

/* The most that all motors together push along u (unit, body), one of them gone if that is more. splay: the part of u
 * along the body's level plane. */
static double push_along(const struct thrust_frame *frame, const struct thrust_range range[], const double u[3])
{
    const double splay = hypot(u[0], u[1]);
    double sum = 0, gone = 0;
    for (int k = 0; k < frame->n; k++) {
        const double share = dot(u, frame->motor[k].axis);
        const double most = fmax(share * range[k].least_n, share * range[k].most_n);
        sum += most + frame->motor[k].splay * splay * span(&range[k]);
        gone = fmax(gone, -most);
    }
    return sum + gone;
}

/* What pushes the vehicle along u, with what drag along its own up and down turns that way. */
static double drive_along(const struct speed_bound *b, const struct speed_bound_push *p,
                          const struct thrust_range range[], const double u[3])
{
    return push_along(p->frame, range, u) + fmax(-u[2] * b->drag_n[1], u[2] * b->drag_n[0]);
}

static void scale_to(double v[3], double by, const double plus[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = by * v[i] + (plus ? plus[i] : 0);
}

/* Two axes of the level plane, in the body's: where it points, and to the right of that. down: not along its x axis. */
static void level_axes(const double down[3], double ahead[3], double aside[3])
{
    double x[3] = {1, 0, 0}, minus[3] = {-down[0] * down[0], -down[0] * down[1], -down[0] * down[2]};
    scale_to(x, 1, minus, ahead);
    scale_to(ahead, 1 / sqrt(dot(ahead, ahead)), NULL, ahead);
    aside[0] = down[1] * ahead[2] - down[2] * ahead[1];
    aside[1] = down[2] * ahead[0] - down[0] * ahead[2];
    aside[2] = down[0] * ahead[1] - down[1] * ahead[0];
}

/* What pushes it each way, at most; where down is so in the body's axes. */
static void level_pushes(const struct speed_bound *b, const struct speed_bound_push *p,
                         const struct thrust_range range[], const double down[3], double most_n[SPEED_BOUND_WAYS])
{
    double ahead[3], aside[3];
    level_axes(down, ahead, aside);
    for (int k = 0; k < AROUND; k++) {
        double u[3];
        scale_to(aside, sin(2 * PI * k / AROUND), NULL, u);
        scale_to(ahead, cos(2 * PI * k / AROUND), u, u);
        const double n = drive_along(b, p, range, u);
        most_n[SPEED_BOUND_LEVEL] = fmax(most_n[SPEED_BOUND_LEVEL], n * BETWEEN);
        if (k % (AROUND / 2) == 0)
            most_n[SPEED_BOUND_AHEAD] = fmax(most_n[SPEED_BOUND_AHEAD], n);
        if (k % (AROUND / 2) == AROUND / 4)
            most_n[SPEED_BOUND_ASIDE] = fmax(most_n[SPEED_BOUND_ASIDE], n);
    }
}

/* ---- motion ---- */

/* share: of the drag is left, for a tilt mixes the axes. */
static double drag_n(const struct speed_bound_conf *conf, const struct way *way, double mps)
{
    const struct way *surge = &ways[SPEED_BOUND_AHEAD];
    if (conf->linear_nspm > 0 || conf->square_ns2pm2 > 0)
        return DRAG_MARGIN * mps *
               (conf->linear_nspm * way->linear / surge->linear +
                conf->square_ns2pm2 * way->square / surge->square * mps);
    return DRAG_MARGIN * fmin(way->linear * mps + way->square * mps * mps, way->slow * mps * mps);
}

/* The change of one of the speeds in dt_s, by a force, and with so much of the drag. */
static double changed(const struct speed_bound *b, enum speed_bound_way which, double force_n, double drag_share,
                      double dt_s)
{
    const struct way *way = &ways[which];
    const double more_n = force_n - drag_share * drag_n(&b->conf, way, b->mps[which]);
    return b->mps[which] + more_n / (more_n > 0 ? way->least_kg : way->most_kg) * dt_s;
}

static double capped(double mps, double most_mps)
{
    return fmin(fmax(mps, 0), most_mps);
}

static double relaxed(double from, double to, double share)
{
    return to + (from - to) * share;
}

/* The most drag of all models, going up or down, and a tenth. */
static double heave_n(double mps)
{
    return 1.1 * mps * (33 + 190 * mps);
}

/* What has driven it goes at once to what is more, and slowly to what is less. */
static void follow(double *drive_n, double now_n, double dt_s)
{
    *drive_n = now_n > *drive_n ? now_n : relaxed(*drive_n, now_n, exp(-dt_s / SPENT_S));
}

/* All that a motor can have pushed meanwhile; and what it still can in the end. */
static struct thrust_range lag(struct thrust_range *now, const struct thrust_range *wanted, double dt_s)
{
    const double share = exp(-dt_s / LAG_S);
    const struct thrust_range all = {fmin(now->least_n, wanted->least_n), fmax(now->most_n, wanted->most_n)};
    now->least_n = relaxed(all.least_n, wanted->least_n, share);
    now->most_n = relaxed(all.most_n, wanted->most_n, share);
    return all;
}

/* Up and down in the body's own axes, and all of it in any direction. */
struct sums {
    double up_n, down_n, any_n;
};

static struct sums sums_of(const struct thrust_frame *frame, const struct thrust_range range[])
{
    static const double up[3] = {0, 0, -1}, down[3] = {0, 0, 1};
    double level_n = 0;
    const struct sums s = {push_along(frame, range, up), push_along(frame, range, down), 0};
    for (int k = 0; k < AROUND; k++) {
        const double u[3] = {cos(2 * PI * k / AROUND), sin(2 * PI * k / AROUND), 0};
        level_n = fmax(level_n, push_along(frame, range, u) * BETWEEN);
    }
    return (struct sums){fmax(s.up_n, 0) + WEIGHT_N, fmax(s.down_n, 0) + WEIGHT_N,
                         hypot(level_n, fmax(fmax(s.up_n, s.down_n), 0)) + WEIGHT_N};
}

/* One small step of all speeds. */
static void move(struct speed_bound *b, const double force_n[SPEED_BOUND_WAYS], double drag_share,
                 double turn_radps, double dt_s)
{
    double next[SPEED_BOUND_WAYS];
    for (int way = 0; way < SPEED_BOUND_WAYS; way++)
        next[way] =
            changed(b, (enum speed_bound_way)way, force_n[way], way == SPEED_BOUND_ALL ? 1 : drag_share, dt_s);
    next[SPEED_BOUND_AHEAD] += turn_radps * dt_s * SIDE_BY_AHEAD * b->mps[SPEED_BOUND_ASIDE];
    next[SPEED_BOUND_ASIDE] += turn_radps * dt_s * b->mps[SPEED_BOUND_AHEAD];
    b->mps[SPEED_BOUND_ALL] = capped(next[SPEED_BOUND_ALL], SPEED_BOUND_CAP_MPS);
    b->mps[SPEED_BOUND_LEVEL] = capped(next[SPEED_BOUND_LEVEL], b->mps[SPEED_BOUND_ALL]);
    b->mps[SPEED_BOUND_VERTICAL] = capped(next[SPEED_BOUND_VERTICAL], b->mps[SPEED_BOUND_ALL]);
    b->mps[SPEED_BOUND_AHEAD] = capped(next[SPEED_BOUND_AHEAD], b->mps[SPEED_BOUND_LEVEL]);
    b->mps[SPEED_BOUND_ASIDE] = capped(next[SPEED_BOUND_ASIDE], b->mps[SPEED_BOUND_LEVEL]);
}

/* The forces of a vehicle whose tilt is known; the greatest tilt's sine. */
static double tilted_pushes(struct speed_bound *b, const struct speed_bound_push *p,
                            const struct thrust_range range[], double dt_s, double force_n[SPEED_BOUND_WAYS])
{
    double sin_tilt = 0;
    for (int i = 0; i < 2; i++) {
        const double *down = p->down[i], up[3] = {-down[0], -down[1], -down[2]};
        level_pushes(b, p, range, down, force_n);
        force_n[SPEED_BOUND_VERTICAL] = fmax(force_n[SPEED_BOUND_VERTICAL], fmax(push_along(p->frame, range, down),
                                                                                 push_along(p->frame, range, up)));
        sin_tilt = fmax(sin_tilt, hypot(down[0], down[1]));
    }
    sin_tilt += TILT_OFF;
    /* what an attitude that is a little off turns from one to the other */
    for (int way = SPEED_BOUND_AHEAD; way <= SPEED_BOUND_LEVEL; way++)
        force_n[way] += TILT_OFF * (fmax(force_n[SPEED_BOUND_VERTICAL], 0) + fmax(b->drag_n[0], b->drag_n[1]));
    follow(&b->along_n, force_n[SPEED_BOUND_LEVEL], dt_s);
    force_n[SPEED_BOUND_VERTICAL] += WEIGHT_N + sin_tilt * b->along_n;
    return sin_tilt;
}

void speed_bound_step(struct speed_bound *b, const struct speed_bound_push *p, double dt_s)
{
    struct thrust_range range[THRUST_MOTORS];
    double force_n[SPEED_BOUND_WAYS] = {0}, sin_tilt = 1;
    for (int k = 0; k < p->frame->n; k++)
        range[k] = lag(&b->thrust[k], &p->thrust[k], dt_s);
    const struct sums sums = sums_of(p->frame, range);
    follow(&b->up_n, sums.up_n, dt_s);
    follow(&b->down_n, sums.down_n, dt_s);
    const double most_n = p->climb_known ? heave_n(p->climb_mps) : INFINITY;
    b->drag_n[0] = fmin(b->up_n, most_n);
    b->drag_n[1] = fmin(b->down_n, most_n);
    if (p->tilt_known && hypot(p->down[0][0], p->down[0][1]) < STEEP &&
        hypot(p->down[1][0], p->down[1][1]) < STEEP)
        sin_tilt = tilted_pushes(b, p, range, dt_s, force_n);
    force_n[SPEED_BOUND_ALL] = sums.any_n;
    for (double left_s = dt_s; left_s > 0; left_s -= STEP_S)
        move(b, force_n, pow(1 - sin_tilt * sin_tilt, 1.5), fabs(p->turned_rad) / dt_s, fmin(left_s, STEP_S));
    b->sin_tilt = sin_tilt < 1 ? sin_tilt : 0;
    for (int way = 0; sin_tilt >= 1 && way < SPEED_BOUND_WAYS; way++)
        b->mps[way] = b->mps[SPEED_BOUND_ALL];
}

void speed_bound_mps(const struct speed_bound *b, double mps[2])
{
    const double all_mps = b->mps[SPEED_BOUND_ALL], vertical_mps = b->mps[SPEED_BOUND_VERTICAL];
    const double level_mps =
        fmin(b->mps[SPEED_BOUND_LEVEL], hypot(b->mps[SPEED_BOUND_AHEAD], b->mps[SPEED_BOUND_ASIDE]));
    mps[0] = fmin(level_mps + UNLIKE * b->sin_tilt * vertical_mps, all_mps) + SPEED_BOUND_TETHER_MPS;
    mps[1] = fmin(vertical_mps + UNLIKE * b->sin_tilt * level_mps, all_mps) + SPEED_BOUND_TETHER_MPS;
}
