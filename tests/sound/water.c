/* SPDX-License-Identifier: MIT */
/* water - echoes from rays; see water.h. */
#include "water.h"

#include <string.h>

#include "grid/geometry.h"

#define RAYS_AZ 15
#define RAYS_EL 41
#define LOOK_AZ 9
#define LOOK_EL 51

#define MAX_SPAN 64 /* samples over which noise is correlated */

/* Levels are pressures at normal gain, 1: full scale. */
#define ECHO_LEVEL          3.0   /* beam-filling wall at 1 m */
#define ABSORPTION_DB_PER_M 0.2   /* one way, at 750 kHz */
#define REVERBERATION_LEVEL 0.002 /* of the volume, at 1 m */
#define SPECULAR_STRENGTH   2.0   /* mean field against the diffuse part */
#define SPECULAR_WIDTH_RAD  0.2
#define RING_FULL_M         0.14  /* the transducer rings at full scale so far, and the pulse's length ... */
#define RING_DECAY_M        0.026 /* ... and then decays */

/* Of pressure 1. */
static const double one[SOUND_HEADS] = {[SOUND_PING360] = 255.0, [SOUND_MICRON] = 66.0 / SOUND_MICRON_DB};

/* The echo of one pulse, seen through the receiver: flat with soft edges, 1 at the top. u = 0..1 over its length. */
static double pulse_envelope(double u)
{
    double edge = fmin(u, 1.0 - u) / 0.25;
    return edge >= 1.0 ? 1.0 : 0.5 - 0.5 * cos(GEO_PI * edge);
}

/* Never shorter than two samples: the receiver's bandwidth follows its sampling. */
static double pulse_length_s(const struct water_shot *shot)
{
    return fmax(shot->transmit_s, 2.0 * shot->sample_s);
}

static void pulse_add(double complex *field, const struct water *water, const struct water_shot *shot,
                      double range_m, double complex pressure)
{
    const double begin_s = 2.0 * range_m / water->sound_speed_mps, length_s = pulse_length_s(shot);
    const double first = floor(begin_s / shot->sample_s);
    if (first >= shot->n_samples)
        return;
    for (uint32_t i = (uint32_t)first; i < shot->n_samples; i++) {
        double u = ((i + 0.5) * shot->sample_s - begin_s) / length_s;
        if (u >= 1.0)
            break;
        if (u > 0.0)
            field[i] += pressure * pulse_envelope(u);
    }
}

/* Spreading of an insonified area, absorption there and back. */
static double loss(const struct water_shot *shot, double range_m)
{
    double f = shot->frequency_hz / 750e3;
    return pow(10.0, -2.0 * ABSORPTION_DB_PER_M * f * f * range_m / 20.0) / fmax(range_m, 0.1);
}

static double time_varied_gain(const struct water_shot *shot, double range_m)
{
    return sqrt(fmax(range_m, 0.1)) * pow(2.0, shot->gain - 1);
}

static void ray_add(double complex *field, const struct water *water, const struct water_shot *shot,
                    const struct place_hit *hit, double weight, struct dice *dice)
{
    const double off = acos(hit->cos_incidence) / SPECULAR_WIDTH_RAD;
    const double facing = exp(-off * off);
    const double complex phase = cexp(I * (GEO_TURN * dice_uniform(dice)));
    const double complex pressure =
        ECHO_LEVEL * (sqrt(weight * hit->cos_incidence) * phase + SPECULAR_STRENGTH * weight * facing);

    pulse_add(field, water, shot, hit->range_m, pressure * loss(shot, hit->range_m));
    pulse_add(field, water, shot, hit->ghost_m, pressure * water->ghost * facing * loss(shot, hit->ghost_m));
}

static void rays_add(double complex *field, const struct water *water, const struct place *scene,
                     const struct water_shot *shot, struct dice *dice)
{
    const struct sound_head_kind *head = &sound_heads[shot->head];
    struct sound_ray ray[RAYS_AZ * RAYS_EL];
    struct place_hit hit;
    double direction[3];
    sound_fan(SOUND_JITTERED, 1.0, RAYS_AZ, RAYS_EL, dice, ray);
    for (int n = 0; n < RAYS_AZ * RAYS_EL; n++) {
        geo_direction(shot->az_rad + geo_rad(ray[n].az * head->az_deg), geo_rad(ray[n].el * head->el_deg),
                      direction);
        if (place_cast(scene, shot->origin_m, direction, shot->t_s, &hit))
            ray_add(field, water, shot, &hit, ray[n].weight, dice);
    }
}

/* Noise and the volume's reverberation, as correlated as a receiver of the pulse's bandwidth leaves them. */
static void noise_add(double complex *field, const struct water *water, const struct water_shot *shot,
                      struct dice *dice)
{
    /* mean of sqrt(p) for Rayleigh p of scale s is 2^(1/4) Gamma(5/4) sqrt(s) */
    const double noise = pow(water->noise_counts / (255.0 * 1.0779), 2.0);
    const uint32_t span = (uint32_t)fmin(fmax(1.0, round(pulse_length_s(shot) / shot->sample_s / 2.0)), MAX_SPAN);
    const double scale = 1.0 / sqrt((double)span);
    double complex x[WATER_MAX_SAMPLES + MAX_SPAN];

    for (uint32_t i = 0; i < shot->n_samples + span; i++)
        x[i] = sqrt(2.0) * dice_normal(dice);
    sound_pulse(x, shot->n_samples + span, span);
    for (uint32_t i = 0; i < shot->n_samples; i++) {
        double range_m = (i + 0.5) * shot->sample_s * water->sound_speed_mps / 2.0;
        field[i] += scale * x[i + span] * hypot(noise, REVERBERATION_LEVEL * loss(shot, range_m));
    }
}

void water_listen(const struct water *water, const struct place *scene, const struct water_shot *shot,
                  uint8_t *samples)
{
    double complex field[WATER_MAX_SAMPLES] = {0};
    const double ring_end_m = RING_FULL_M + shot->transmit_s * water->sound_speed_mps / 2.0;
    struct dice dice = {water->seed * 0x9e3779b97f4a7c15u + shot->number};
    dice_bits(&dice);
    rays_add(field, water, scene, shot, &dice);
    if (water->noise_counts > 0.0)
        noise_add(field, water, shot, &dice);
    for (uint32_t i = 0; i < shot->n_samples; i++) {
        double range_m = (i + 0.5) * shot->sample_s * water->sound_speed_mps / 2.0;
        double ring = exp(-(range_m - ring_end_m) / RING_DECAY_M);
        const double pressure = cabs(field[i]) * time_varied_gain(shot, range_m) + ring;
        samples[i] = sound_byte(
            sound_count(sound_heads[shot->head].law, pressure * pressure, one[shot->head], SOUND_MICRON_DB));
    }
}

void water_look(const struct place *scene, const struct water_shot *shot, struct water_truth *truth)
{
    double direction[3];
    const struct place_fan fan = {shot->az_rad,
                                  0.0,
                                  geo_rad(sound_heads[shot->head].az_deg) / 2.0,
                                  geo_rad(sound_heads[shot->head].el_deg) / 2.0,
                                  LOOK_AZ,
                                  LOOK_EL};
    truth->nearest_m = place_nearest(scene, shot->origin_m, &fan, shot->t_s);
    geo_direction(shot->az_rad, 0.0, direction);
    truth->axis_m = place_ray(scene, shot->origin_m, direction, INFINITY, shot->t_s);
}

static void write_range(FILE *out, const char *key, double range_m)
{
    if (isfinite(range_m))
        fprintf(out, ",\"%s\":%.4f", key, range_m);
    else
        fprintf(out, ",\"%s\":null", key);
}

void water_write_truth(FILE *out, const struct water *water, const struct place *scene,
                       const struct water_shot *shot, uint64_t t_ns, unsigned angle, double azimuth_deg,
                       double yaw_deg)
{
    struct water_truth truth;
    water_look(scene, shot, &truth);
    fprintf(out, "{\"t_ns\":%llu,\"ping\":%llu,\"angle\":%u,\"azimuth_deg\":%.3f", (unsigned long long)t_ns,
            (unsigned long long)shot->number, angle, geo_deg(geo_wrap(geo_rad(azimuth_deg))));
    write_range(out, "range_m", truth.nearest_m);
    write_range(out, "axis_m", truth.axis_m);
    fprintf(out, ",\"listening_m\":%.4f,\"position_m\":[%.4f,%.4f,%.4f],\"yaw_deg\":%.3f}\n",
            shot->n_samples * shot->sample_s * water->sound_speed_mps / 2.0, shot->origin_m[0], shot->origin_m[1],
            shot->origin_m[2], yaw_deg);
    fflush(out);
}
