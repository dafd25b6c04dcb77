/* SPDX-License-Identifier: MIT */
/*
 * surveyor - see surveyor.h.
 */
#include "surveyor.h"

#include <math.h>

#include "drivers/ports/line_time.h"
#include "ping_bytes.h"

#define SETTINGS_BYTES   36
#define ATOF_HEAD_BYTES  40
#define ATOF_POINT_BYTES 16
#define YZ_HEAD_BYTES    100
#define YZ_POINT_BYTES   8
#define YZ_START_AT      88 /* start_m, then end_m */
#define FREQUENCY_HZ     240000u
#define PULSE_STEPS      1.5f
#define LISTENING_MIN_S  1e-5
#define LISTENING_MAX_S  1.0
#define PULSE_MAX_S      0.1
#define SWATH_DEG        120.0
#define RANGE_MIN_M      0.01
#define RANGE_MAX_M      1000.0
#define ANGLE_MAX_RAD    (GEO_PI / 2.0)
#define SD_LEAST_M       0.01
/*
 * Nothing is published about the beam width of a single detection. A narrow one makes little water free; the grid
 * enters echoes over whole cells anyway.
 */
#define ACROSS_DEG 1.0
#define ALONG_DEG  5.0
#define CONFIDENCE 0.8f /* the points have none of their own */

size_t surveyor_encode_settings(uint8_t *out, size_t size, const struct surveyor_settings *set)
{
    uint8_t b[SETTINGS_BYTES] = {0};
    put_u32(b, (uint32_t)set->start_mm);
    put_u32(b + 4, (uint32_t)set->end_mm);
    put_f32(b + 8, set->sound_speed_mps);
    put_u16(b + 12, (uint16_t)set->gain);
    put_u16(b + 14, (uint16_t)set->interval_ms);
    b[19] = set->ping;
    b[22] = set->yz;
    b[23] = set->atof;
    put_u32(b + 24, FREQUENCY_HZ);
    put_u16(b + 28, set->n_steps);
    put_f32(b + 32, PULSE_STEPS);
    return ping_frame_build(out, size, SURVEYOR_SET_PING_PARAMETERS, 0, b, sizeof b);
}

bool surveyor_decode_settings(const struct ping_frame *f, struct surveyor_settings *out)
{
    const uint8_t *b = f->payload;
    if (f->id != SURVEYOR_SET_PING_PARAMETERS || f->length < SETTINGS_BYTES)
        return false;
    *out = (struct surveyor_settings){.start_mm = (int32_t)get_u32(b),
                                      .end_mm = (int32_t)get_u32(b + 4),
                                      .sound_speed_mps = get_f32(b + 8),
                                      .gain = (int16_t)get_u16(b + 12),
                                      .interval_ms = (int16_t)get_u16(b + 14),
                                      .ping = b[19] != 0,
                                      .yz = b[22] != 0,
                                      .atof = b[23] != 0,
                                      .n_steps = get_u16(b + 28)};
    return true;
}

static unsigned points_there(const struct ping_frame *f, unsigned said, size_t head, size_t each)
{
    size_t there = (f->length - head) / each;
    return said < there ? said : (unsigned)there;
}

static bool decode_atof(const struct ping_frame *f, struct surveyor_points *out)
{
    const uint8_t *b = f->payload;
    if (f->length < ATOF_HEAD_BYTES || get_u16(b + 36) > SURVEYOR_POINTS_MAX)
        return false;
    *out = (struct surveyor_points){.atof = true,
                                    .ping_number = get_u32(b + 20),
                                    .power_up_ms = get_u32(b),
                                    .listening_s = (double)get_f32(b + 12),
                                    .pulse_s = (double)get_f32(b + 28),
                                    .n = points_there(f, get_u16(b + 36), ATOF_HEAD_BYTES, ATOF_POINT_BYTES),
                                    .records = b + ATOF_HEAD_BYTES};
    return out->listening_s >= LISTENING_MIN_S && out->listening_s <= LISTENING_MAX_S && out->pulse_s >= 0.0 &&
           out->pulse_s <= PULSE_MAX_S;
}

static bool decode_yz(const struct ping_frame *f, struct surveyor_points *out)
{
    const uint8_t *b = f->payload;
    if (f->length < YZ_HEAD_BYTES || get_u16(b + 98) > SURVEYOR_POINTS_MAX)
        return false;
    const double start_m = (double)get_f32(b + YZ_START_AT), end_m = (double)get_f32(b + YZ_START_AT + 4);
    const bool told = start_m >= 0.0 && start_m < end_m && end_m <= RANGE_MAX_M;
    *out = (struct surveyor_points){.start_m = told ? start_m : 0.0,
                                    .end_m = told ? end_m : 0.0,
                                    .n = points_there(f, get_u16(b + 98), YZ_HEAD_BYTES, YZ_POINT_BYTES),
                                    .records = b + YZ_HEAD_BYTES};
    return true;
}

bool surveyor_decode_points(const struct ping_frame *f, struct surveyor_points *out)
{
    if (f->id == SURVEYOR_ATOF_POINTS)
        return decode_atof(f, out);
    return f->id == SURVEYOR_YZ_POINTS && decode_yz(f, out);
}

double surveyor_end_m(const struct surveyor_points *points, double sound_speed_mps)
{
    return points->atof ? sound_speed_mps * points->listening_s / 2.0 : points->end_m;
}

size_t surveyor_encode_atof(uint8_t *out, size_t size, uint8_t src, const struct surveyor_points *head,
                            float sound_speed_mps, const float (*point)[2])
{
    uint8_t b[ATOF_HEAD_BYTES + SURVEYOR_POINTS_MAX * ATOF_POINT_BYTES] = {0};
    if (head->n > SURVEYOR_POINTS_MAX)
        return 0;
    put_u32(b, head->power_up_ms);
    put_f32(b + 12, (float)head->listening_s);
    put_f32(b + 16, sound_speed_mps);
    put_u32(b + 20, head->ping_number);
    put_u32(b + 24, FREQUENCY_HZ);
    put_f32(b + 28, (float)head->pulse_s);
    put_u16(b + 36, head->n);
    for (unsigned i = 0; i < head->n; i++) {
        put_f32(b + ATOF_HEAD_BYTES + i * ATOF_POINT_BYTES, point[i][0]);
        put_f32(b + ATOF_HEAD_BYTES + i * ATOF_POINT_BYTES + 4, point[i][1]);
    }
    return ping_frame_build(out, size, SURVEYOR_ATOF_POINTS, src, b,
                            ATOF_HEAD_BYTES + (size_t)head->n * ATOF_POINT_BYTES);
}

size_t surveyor_encode_yz(uint8_t *out, size_t size, uint8_t src, const struct surveyor_points *head,
                          const float (*point)[2])
{
    uint8_t b[YZ_HEAD_BYTES + SURVEYOR_POINTS_MAX * YZ_POINT_BYTES] = {0};
    if (head->n > SURVEYOR_POINTS_MAX)
        return 0;
    put_f32(b + YZ_START_AT, (float)head->start_m);
    put_f32(b + YZ_START_AT + 4, (float)head->end_m);
    put_u16(b + 98, head->n);
    for (unsigned i = 0; i < head->n; i++) {
        put_f32(b + YZ_HEAD_BYTES + i * YZ_POINT_BYTES, point[i][0]);
        put_f32(b + YZ_HEAD_BYTES + i * YZ_POINT_BYTES + 4, point[i][1]);
    }
    return ping_frame_build(out, size, SURVEYOR_YZ_POINTS, src, b,
                            YZ_HEAD_BYTES + (size_t)head->n * YZ_POINT_BYTES);
}

/*
 * Angle and range of point i. The sonar counts angles and y positive to port, the sensor frame clockwise, that is to
 * starboard. False: not a number, behind the sonar, or nowhere.
 */
static bool polar(const struct surveyor_points *points, unsigned i, double sound_speed_mps, double *angle_rad,
                  double *range_m)
{
    const uint8_t *b = points->records + i * (points->atof ? ATOF_POINT_BYTES : YZ_POINT_BYTES);
    double first = (double)get_f32(b), second = (double)get_f32(b + 4);
    if (points->atof) { /* the time is the sonar's, the speed of sound the configuration's */
        *angle_rad = -first;
        *range_m = sound_speed_mps * second / 2.0;
    } else {
        *angle_rad = atan2(-first, -second);
        *range_m = hypot(first, second);
    }
    return fabs(*angle_rad) <= ANGLE_MAX_RAD && *range_m >= RANGE_MIN_M && *range_m <= RANGE_MAX_M;
}

void surveyor_fill_ping(struct ping *ping, const struct ping_frame *frame, const struct surveyor_points *points,
                        double start_m, double sound_speed_mps)
{
    const double end_m = surveyor_end_m(points, sound_speed_mps);
    const double begin_m = fmax(start_m, SURVEYOR_DEAF * end_m);
    const double listening_s = 2.0 * end_m / sound_speed_mps;
    double pulse_m = sound_speed_mps * points->pulse_s / 2.0;
    ping->t_ns = transmitted_ns(frame->t_first_ns, frame->t_last_ns, ping_frame_bytes(frame), 0,
                                (uint64_t)(listening_s * 1e9));
    ping->t_in_ns = frame->t_last_ns;
    ping->kind = PING_RANGES;
    ping->sample_bytes = 0;
    ping->n_bins = 1;
    ping->r0_m = (float)begin_m;
    ping->dr_m = (float)fmax(end_m - begin_m, 0.0);
    ping->pulse_m = (float)pulse_m;
    ping->az_aperture_rad = (float)geo_rad(ACROSS_DEG);
    ping->el_aperture_rad = (float)geo_rad(ALONG_DEG);
    ping->n_beams = 0;
    for (unsigned i = 0; i < points->n && ping->n_beams < ping->max_beams; i++) {
        double angle_rad, point_m;
        if (!polar(points, i, sound_speed_mps, &angle_rad, &point_m))
            continue;
        ping->beam[ping->n_beams++] =
            (struct ping_beam){.az_rad = (float)angle_rad,
                               .range_m = (float)point_m,
                               .range_sd_m = (float)fmax(pulse_m / sqrt(12.0), SD_LEAST_M),
                               .confidence = CONFIDENCE};
    }
    if (ping->n_beams == 0) { /* nothing detected: over all of the swath it cannot tell */
        ping->n_beams = 1;
        ping->beam[0] = (struct ping_beam){.range_sd_m = (float)SD_LEAST_M};
        ping->flags |= PING_UNHEARD;
        ping->az_aperture_rad = (float)geo_rad(SWATH_DEG);
    }
}
