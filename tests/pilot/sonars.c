/* SPDX-License-Identifier: MIT */
/* sonars - see sonars.h. */
#include "sonars.h"

#include <math.h>

#include "drivers/devices/micron.h"
#include "report/lib/dice.h"
#include "tests/sim/lib/water.h"

#define SOUND_MPS    1500.0
#define NOISE_COUNTS 8.0

const char *const pilot_sonar_name[PILOT_SONARS] = {"ping360", "micron", "fan"};

/* A head turns by step_deg between two pings. */
static const struct {
    const char *conf;
    uint64_t period_ns;
    double range_m, step_deg;
    uint32_t bins, units, turn;
    double wide_deg, high_deg, pulse_m;
} kinds[PILOT_SONARS] = {
    [PILOT_PING360] =
        {"[sonar front]\ndevice = ping360\nport = serial:/dev/ttyUSB0\nrange = 15 m\nmount = 0.2 0 -0.1 m\n",
         70000000, 15, 1.8, 600, 2, 400, 2, 25, 0.06},
    [PILOT_MICRON] =
        {"[sonar front]\ndevice = micron\nport = serial:/dev/ttyUSB0\nrange = 10 m\nmount = 0.2 0 -0.1 m\n",
         60000000, 10, 1.8, 400, 32, MICRON_TURN, 3, 35, 0.06},
    [PILOT_FAN] = {"[sonar front]\ndevice = surveyor\nport = udp:10.0.0.2:62312\nrange = 15 m\n"
                   "mount = 0.3 0 0 m\n[extract]\nno_echo = range\nminimum_range = 15 m\n",
                   200000000, 15, 0, 0, 0, 0, 1.5, 20, 0.05},
};

const char *pilot_sonar_conf(enum pilot_sonar sonar)
{
    return kinds[sonar].conf;
}

uint64_t pilot_sonar_period_ns(enum pilot_sonar sonar)
{
    return kinds[sonar].period_ns;
}

double pilot_sonar_turn_s(enum pilot_sonar sonar)
{
    return (kinds[sonar].step_deg > 0 ? 360 / kinds[sonar].step_deg : 1) * (double)kinds[sonar].period_ns * 1e-9;
}

static void hear_profile(enum pilot_sonar sonar, const struct pilot_world *w, uint64_t seed,
                         const double place_m[3], double heading_rad, double t_s, uint32_t number,
                         struct ping *ping)
{
    const struct water water = {
        .sound_speed_mps = SOUND_MPS, .noise_counts = NOISE_COUNTS, .ghost = 0.1, .seed = seed};
    const uint32_t steps = kinds[sonar].turn / kinds[sonar].units, step = number % steps;
    const double az_rad = step * GEO_TURN / steps;
    const struct water_shot shot = {.head = sonar == PILOT_MICRON ? WATER_MICRON : WATER_PING360,
                                    .origin_m = {place_m[0], place_m[1], place_m[2]},
                                    .az_rad = heading_rad + az_rad,
                                    .t_s = t_s,
                                    .sample_s = 2 * kinds[sonar].range_m / SOUND_MPS / kinds[sonar].bins,
                                    .transmit_s = 2 * kinds[sonar].pulse_m / SOUND_MPS,
                                    .frequency_hz = 750e3,
                                    .gain = 1,
                                    .n_samples = kinds[sonar].bins,
                                    .number = number};
    ping->kind = PING_PROFILE;
    ping->law = sonar == PILOT_MICRON ? AMPLITUDE_LOG : AMPLITUDE_SQRT;
    ping->db_per_count = sonar == PILOT_MICRON ? (float)MICRON_DB_PER_COUNT : 0;
    ping->sample_bytes = 1;
    ping->flags = step == 0 ? PING_NEW_TURN : 0;
    ping->n_beams = 1;
    ping->n_bins = kinds[sonar].bins;
    ping->dr_m = (float)(kinds[sonar].range_m / kinds[sonar].bins);
    ping->head_units = step * kinds[sonar].units;
    ping->head_turn = kinds[sonar].turn;
    ping->beam[0] = (struct ping_beam){.az_rad = (float)az_rad};
    water_listen(&water, &w->scene, &shot, ping->samples);
}

#define FAN_BEAMS   64
#define FAN_RAYS_AZ 3
#define FAN_RAYS_EL 25

/* The first surface in a beam of the fan; 0: none. */
static double first_m(const struct pilot_world *w, const double place_m[3], double az_rad, double t_s)
{
    double nearest_m = INFINITY;
    for (int i = 0; i < FAN_RAYS_AZ; i++)
        for (int k = 0; k < FAN_RAYS_EL; k++) {
            struct scene_hit hit;
            double direction[3];
            geo_direction(az_rad + geo_rad(kinds[PILOT_FAN].wide_deg) * ((i + 0.5) / FAN_RAYS_AZ - 0.5),
                          geo_rad(kinds[PILOT_FAN].high_deg) * (k / (FAN_RAYS_EL - 1.0) - 0.5), direction);
            if (scene_cast(&w->scene, place_m, direction, t_s, &hit))
                nearest_m = fmin(nearest_m, hit.range_m);
        }
    return nearest_m < kinds[PILOT_FAN].range_m ? nearest_m : 0;
}

static void hear_fan(const struct pilot_world *w, uint64_t seed, const double place_m[3], double heading_rad,
                     double t_s, uint32_t number, struct ping *ping)
{
    struct dice dice = dice_of(seed, number);
    ping->kind = PING_RANGES;
    ping->n_beams = FAN_BEAMS;
    ping->n_bins = 1;
    ping->dr_m = (float)kinds[PILOT_FAN].range_m;
    for (int b = 0; b < FAN_BEAMS; b++) {
        const double az_rad = geo_rad(kinds[PILOT_FAN].wide_deg) * (b + 0.5 - FAN_BEAMS / 2.0);
        const double range_m = first_m(w, place_m, heading_rad + az_rad, t_s);
        ping->beam[b] =
            (struct ping_beam){.az_rad = (float)geo_wrap(az_rad),
                               .range_m = range_m > 0 ? (float)(range_m + 0.02 * (dice_uniform(&dice) - 0.5)) : 0,
                               .range_sd_m = 0.015f,
                               .confidence = 0.9f};
    }
}

void pilot_sonar_hear(enum pilot_sonar sonar, const struct pilot_world *w, uint64_t seed, const double place_m[3],
                      double heading_rad, double t_s, uint32_t number, struct ping *ping)
{
    ping->seq = number;
    ping->sensor = 0;
    ping->flags = 0;
    ping->gain = 1;
    ping->gain_db = 0;
    ping->r0_m = 0;
    ping->pulse_m = (float)kinds[sonar].pulse_m;
    ping->az_aperture_rad = (float)geo_rad(kinds[sonar].wide_deg);
    ping->el_aperture_rad = (float)geo_rad(kinds[sonar].high_deg);
    if (sonar == PILOT_FAN)
        hear_fan(w, seed, place_m, heading_rad, t_s, number, ping);
    else
        hear_profile(sonar, w, seed, place_m, heading_rad, t_s, number, ping);
}
