/* SPDX-License-Identifier: MIT */
/* vehicle - see vehicle.h. */
#include "vehicle.h"

#include <math.h>

#define GAIN_HZ    3.0 /* of its speed controller */
#define LAG_S      0.2 /* of its thrusters */
#define TURN_RADPS 0.5

#define NOISE_M   0.02
#define NOISE_MPS 0.01
#define NOISE_RAD 0.005

#define SCALE      0.008
#define BIAS_MPS   0.008 /* with the noise within 0.02 m/s */
#define DRIFT_DEGS 0.008

void pilot_vehicle_move(struct pilot_vehicle *v, bool over_ground, double dt_s)
{
    double wish[2];
    for (int k = 0; k < 2; k++)
        wish[k] = GAIN_HZ * (v->command_mps[k] - v->velocity_mps[k] + (over_ground ? 0 : v->current_mps[k]));
    const double much = fmax(1, hypot(wish[0], wish[1]) / PILOT_THRUST_MPS2);
    for (int k = 0; k < 2; k++) {
        v->thrust_mps2[k] += (wish[k] / much - v->thrust_mps2[k]) * fmin(1, dt_s / LAG_S);
        v->velocity_mps[k] += v->thrust_mps2[k] * dt_s;
        v->place_m[k] += v->velocity_mps[k] * dt_s;
    }
    const double off = geo_wrap_pi(v->wanted_rad - v->heading_rad), most = TURN_RADPS * dt_s;
    v->heading_rad = geo_wrap(v->heading_rad + fmax(-most, fmin(most, off)));
}

static double off(struct pilot_instruments *n, double most)
{
    return most * (2 * dice_uniform(&n->dice) - 1);
}

void pilot_instruments_init(struct pilot_instruments *n, double poor, struct dice dice)
{
    *n = (struct pilot_instruments){.dice = dice};
    n->scale = off(n, poor * SCALE);
    n->bias_mps[0] = off(n, poor * BIAS_MPS);
    n->bias_mps[1] = off(n, poor * BIAS_MPS);
    n->heading_radps = off(n, poor * geo_rad(DRIFT_DEGS));
}

void pilot_instruments_read(struct pilot_instruments *n, const struct pilot_vehicle *v, unsigned parts, double t_s,
                            struct pose *out, double *heading_rad)
{
    *out = pose_identity;
    out->has = parts;
    for (int k = 0; k < 2; k++) {
        const double place_m = (1 + n->scale) * v->place_m[k] + n->jump_m[k] + off(n, NOISE_M);
        const double velocity_mps = (1 + n->scale) * v->velocity_mps[k] + n->bias_mps[k] + off(n, NOISE_MPS);
        out->position_m[k] = parts & POSE_POSITION ? place_m : 0;
        out->velocity_mps[k] = parts & POSE_VELOCITY ? velocity_mps : 0;
    }
    out->position_m[2] = v->place_m[2] + off(n, NOISE_M);
    *heading_rad = v->heading_rad + n->heading_radps * t_s + off(n, NOISE_RAD);
    quat_from_rpy(off(n, NOISE_RAD), off(n, NOISE_RAD), *heading_rad, out->attitude);
}
