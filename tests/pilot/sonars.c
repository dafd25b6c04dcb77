/* SPDX-License-Identifier: MIT */
/* sonars - see sonars.h. */
#include "sonars.h"

#include <math.h>
#include <string.h>

#include "drivers/devices/micron.h"
#include "tests/water/dice.h"
#include "tests/sound/water.h"

#define SOUND_MPS    1500.0
#define NOISE_COUNTS 8.0

const char *const pilot_sonar_name[PILOT_SONARS] = {"ping360", "micron", "fan", "matrix"};

/* A head turns by step_deg between two pings. */
static const struct {
    const char *conf;
    uint64_t period_ns;
    double range_m, step_deg;
    uint32_t bins, units, turn;
    double wide_deg, high_deg, pulse_m, near_m;
    int columns, rows; /* of beams */
    double column_deg, row_deg;
} kinds[PILOT_SONARS] = {
    [PILOT_PING360] = {.conf = "[sonar front]\ndevice = ping360\nport = serial:/dev/ttyUSB0\nrange = 15 m\n"
                               "mount = 0.2 0 -0.1 m\n",
                       .period_ns = 70000000,
                       .range_m = 15,
                       .step_deg = 1.8,
                       .bins = 600,
                       .units = 2,
                       .turn = 400,
                       .wide_deg = 2,
                       .high_deg = 25,
                       .pulse_m = 0.06,
                       .near_m = 4.0},
    [PILOT_MICRON] = {.conf = "[sonar front]\ndevice = micron\nport = serial:/dev/ttyUSB0\nrange = 10 m\n"
                              "mount = 0.2 0 -0.1 m\n",
                      .period_ns = 60000000,
                      .range_m = 10,
                      .step_deg = 1.8,
                      .bins = 400,
                      .units = 32,
                      .turn = MICRON_TURN,
                      .wide_deg = 3,
                      .high_deg = 35,
                      .pulse_m = 0.06,
                      .near_m = 2.6},
    [PILOT_FAN] = {.conf = "[sonar front]\ndevice = surveyor\nport = udp:10.0.0.2:62312\nrange = 15 m\n"
                           "mount = 0.3 0 0 m\n[extract]\nminimum_range = 15 m\n",
                   .period_ns = 200000000,
                   .range_m = 15,
                   .wide_deg = 1.5,
                   .high_deg = 20,
                   .pulse_m = 0.05,
                   .near_m = 4.6,
                   .columns = 64,
                   .rows = 1,
                   .column_deg = 1.5},
    [PILOT_MATRIX] = {.conf = "[sonar front]\ndevice = surveyor\nport = udp:10.0.0.2:62312\nrange = 15 m\n"
                              "ring_down = 0.1 m\nmount = 0 0 0 m\n[extract]\nminimum_range = 15 m\n",
                      .period_ns = 400000000,
                      .range_m = 15,
                      .wide_deg = 4.5,
                      .high_deg = 7.5,
                      .pulse_m = 0.05,
                      .columns = 32,
                      .rows = 16,
                      .column_deg = 3,
                      .row_deg = 5.5},
};

const char *pilot_sonar_conf(enum pilot_sonar sonar)
{
    return kinds[sonar].conf;
}

double pilot_sonar_near_m(enum pilot_sonar sonar)
{
    return kinds[sonar].near_m;
}

uint64_t pilot_sonar_period_ns(enum pilot_sonar sonar)
{
    return kinds[sonar].period_ns;
}

double pilot_sonar_turn_s(enum pilot_sonar sonar)
{
    return (kinds[sonar].step_deg > 0 ? 360 / kinds[sonar].step_deg : 1) * (double)kinds[sonar].period_ns * 1e-9;
}

uint32_t pilot_sonar_turn_units(enum pilot_sonar sonar)
{
    return kinds[sonar].turn;
}

#define STRAY_COUNT  200
#define STRAY_COUNTS 6 /* samples: a pulse as long as its own */

/* A pulse of another sonar, somewhere. */
static void add_stray(struct ping *ping, struct dice *dice)
{
    uint8_t *samples = ping->samples;
    const uint32_t at = (uint32_t)((ping->n_bins - STRAY_COUNTS) * dice_uniform(dice));
    memset(samples + at, STRAY_COUNT, STRAY_COUNTS);
}

static void hear_profile(enum pilot_sonar sonar, const struct pilot_shot *from, struct ping *ping)
{
    const struct water water = {
        .sound_speed_mps = SOUND_MPS, .noise_counts = NOISE_COUNTS, .ghost = 0.1, .seed = from->seed};
    const uint32_t steps = kinds[sonar].turn / kinds[sonar].units, units = kinds[sonar].units;
    const uint32_t at = from->aimed ? from->head_units : from->number % steps * units;
    const double az_rad = at * GEO_TURN / kinds[sonar].turn;
    const double range_m = from->aimed ? from->range_m : kinds[sonar].range_m;
    const struct water_shot shot = {.head = sonar == PILOT_MICRON ? SOUND_MICRON : SOUND_PING360,
                                    .origin_m = {from->place_m[0], from->place_m[1], from->place_m[2]},
                                    .az_rad = from->heading_rad + az_rad,
                                    .t_s = from->t_s,
                                    .sample_s = 2 * range_m / SOUND_MPS / kinds[sonar].bins,
                                    .transmit_s = 2 * kinds[sonar].pulse_m / SOUND_MPS,
                                    .frequency_hz = 750e3,
                                    .gain = 1,
                                    .n_samples = kinds[sonar].bins,
                                    .number = from->number};
    struct dice dice = dice_of(from->seed + 1, from->number);
    ping->kind = PING_PROFILE;
    ping->law = sonar == PILOT_MICRON ? AMPLITUDE_LOG : AMPLITUDE_SQRT;
    ping->db_per_count = sonar == PILOT_MICRON ? (float)MICRON_DB_PER_COUNT : 0;
    ping->sample_bytes = 1;
    ping->flags = (from->aimed ? from->new_turn : at == 0) ? PING_NEW_TURN : 0;
    ping->n_beams = 1;
    ping->n_bins = kinds[sonar].bins;
    ping->dr_m = (float)(range_m / kinds[sonar].bins);
    ping->head_units = at;
    ping->head_turn = kinds[sonar].turn;
    ping->beam[0] = (struct ping_beam){.az_rad = (float)az_rad};
    water_listen(&water, from->world, &shot, ping->samples);
    if (dice_uniform(&dice) < from->stray)
        add_stray(ping, &dice);
}

#define RAY_DEG 1.3 /* from one ray to the next: a pole of 0.1 m is as wide at 4.4 m */

/* The first surface in a beam of a sonar that picks ranges; 0: none. */
static double first_m(enum pilot_sonar sonar, const struct pilot_shot *from, double az_rad, double el_rad)
{
    const double wide_deg = kinds[sonar].wide_deg, high_deg = kinds[sonar].high_deg;
    const int columns = 2 + (int)(wide_deg / RAY_DEG), rows = 2 + (int)(high_deg / RAY_DEG);
    const double nearest_m =
        place_nearest(from->world, from->place_m,
                      &(struct place_fan){from->heading_rad + az_rad, el_rad, geo_rad(wide_deg) / 2,
                                          geo_rad(high_deg) / 2, columns, rows},
                      from->t_s);
    return nearest_m < kinds[sonar].range_m ? nearest_m : 0;
}

static void hear_ranges(enum pilot_sonar sonar, const struct pilot_shot *from, struct ping *ping)
{
    struct dice dice = dice_of(from->seed, from->number), stray = dice_of(from->seed + 1, from->number);
    const int columns = kinds[sonar].columns, rows = kinds[sonar].rows;
    ping->kind = PING_RANGES;
    ping->n_beams = (uint16_t)(columns * rows);
    ping->n_bins = 1;
    ping->dr_m = (float)kinds[sonar].range_m;
    for (int b = 0; b < columns * rows; b++) {
        const double az_rad = geo_rad(kinds[sonar].column_deg) * (b % columns + 0.5 - columns / 2.0),
                     el_rad = geo_rad(kinds[sonar].row_deg) * (b / columns + 0.5 - rows / 2.0);
        double range_m = first_m(sonar, from, az_rad, el_rad);
        if (dice_uniform(&stray) < from->stray) {
            const double stray_m = 1 + (kinds[sonar].range_m - 1) * dice_uniform(&stray);
            range_m = range_m > 0 ? fmin(range_m, stray_m) : stray_m;
        }
        ping->beam[b] =
            (struct ping_beam){.az_rad = (float)geo_wrap(az_rad),
                               .el_rad = (float)el_rad,
                               .range_m = range_m > 0 ? (float)(range_m + 0.02 * (dice_uniform(&dice) - 0.5)) : 0,
                               .range_sd_m = 0.015f,
                               .confidence = 0.9f};
    }
}

/* From the vehicle to its transducer. */
static void go_to_mount(struct pilot_shot *from, const struct mount *mount)
{
    const double c = cos(from->heading_rad), s = sin(from->heading_rad), *m = mount->position_m;
    from->place_m[0] += c * m[0] - s * m[1];
    from->place_m[1] += s * m[0] + c * m[1];
    from->place_m[2] += m[2];
}

bool pilot_sonar_points_at(enum pilot_sonar sonar, const struct pilot_shot *shot, const double at_m[2],
                           double radius_m)
{
    struct pilot_shot from = *shot;
    go_to_mount(&from, shot->mount);
    const double north_m = at_m[0] - from.place_m[0], east_m = at_m[1] - from.place_m[1];
    const double half_rad = asin(fmin(1, radius_m / hypot(north_m, east_m)));
    const uint32_t steps = kinds[sonar].turn ? kinds[sonar].turn / kinds[sonar].units : 1;
    const double turned =
        shot->aimed ? shot->head_units / (double)kinds[sonar].turn : shot->number % steps / (double)steps;
    const double axis_rad = shot->heading_rad + turned * GEO_TURN;
    const double wide_deg = fmax(kinds[sonar].wide_deg, kinds[sonar].columns * kinds[sonar].column_deg);
    return fabs(geo_wrap_pi(atan2(east_m, north_m) - axis_rad)) < geo_rad(wide_deg) / 2 + half_rad;
}

void pilot_sonar_hear(enum pilot_sonar sonar, const struct pilot_shot *shot, struct ping *ping)
{
    struct pilot_shot from = *shot;
    ping->sensor = 0;
    ping->seq = shot->number;
    ping->flags = 0;
    ping->gain = 1;
    ping->gain_db = 0;
    ping->r0_m = 0;
    ping->pulse_m = (float)kinds[sonar].pulse_m;
    ping->az_aperture_rad = (float)geo_rad(kinds[sonar].wide_deg);
    ping->el_aperture_rad = (float)geo_rad(kinds[sonar].high_deg);
    go_to_mount(&from, shot->mount);
    if (kinds[sonar].turn > 0)
        hear_profile(sonar, &from, ping);
    else
        hear_ranges(sonar, &from, ping);
}
