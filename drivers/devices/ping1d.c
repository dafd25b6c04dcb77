/* SPDX-License-Identifier: MIT */
/*
 * ping1d - see ping1d.h.
 */
#include "ping1d.h"

#include <math.h>
#include <string.h>

#include "drivers/ports/line_time.h"
#include "ping_bytes.h"

#define SIMPLE_BYTES   5
#define FIRMWARE_BYTES 6
#define DISTANCE_BYTES 24
#define PROFILE_BYTES  26      /* without the samples */
#define FAR_MM         300000u /* no scan of these devices ends beyond */

bool ping1d_is_reading(uint16_t id)
{
    return id == PING1D_DISTANCE_SIMPLE || id == PING1D_DISTANCE || id == PING1D_PROFILE;
}

bool ping1d_decode(const struct ping_frame *f, struct ping1d_reading *out)
{
    const uint8_t *b = f->payload;
    if (f->id == PING1D_DISTANCE_SIMPLE) {
        if (f->length < SIMPLE_BYTES)
            return false;
        *out = (struct ping1d_reading){.distance_mm = get_u32(b), .confidence_percent = b[4], .simple = true};
        return out->distance_mm <= FAR_MM && out->confidence_percent <= 100;
    }
    bool profile = f->id == PING1D_PROFILE;
    if (!ping1d_is_reading(f->id) || f->length < (profile ? PROFILE_BYTES : DISTANCE_BYTES))
        return false;
    *out = (struct ping1d_reading){.distance_mm = get_u32(b),
                                   .confidence_percent = get_u16(b + 4),
                                   .transmit_us = get_u16(b + 6),
                                   .ping_number = get_u32(b + 8),
                                   .start_mm = get_u32(b + 12),
                                   .length_mm = get_u32(b + 16),
                                   .gain = get_u32(b + 20)};
    if (profile) {
        out->n_samples = get_u16(b + 24);
        out->samples = b + PROFILE_BYTES;
        /* with fewer than it says nobody knows where they lie, without any its choice could not be checked */
        if (out->n_samples == 0 || out->n_samples > (size_t)f->length - PROFILE_BYTES)
            return false;
    }
    return out->distance_mm <= FAR_MM && out->confidence_percent <= 100 && out->start_mm <= FAR_MM &&
           out->length_mm >= 1 && out->length_mm <= FAR_MM;
}

size_t ping1d_encode_reading(uint8_t *out, size_t size, uint8_t src, const struct ping1d_reading *r)
{
    uint8_t b[PING_PAYLOAD_MAX];
    put_u32(b, r->distance_mm);
    put_u16(b + 4, r->confidence_percent);
    if (r->simple)
        return ping_frame_build(out, size, PING1D_DISTANCE_SIMPLE, src, b, SIMPLE_BYTES);
    put_u16(b + 6, r->transmit_us);
    put_u32(b + 8, r->ping_number);
    put_u32(b + 12, r->start_mm);
    put_u32(b + 16, r->length_mm);
    put_u32(b + 20, r->gain);
    if (r->n_samples == 0)
        return ping_frame_build(out, size, PING1D_DISTANCE, src, b, DISTANCE_BYTES);
    if (r->n_samples > PING1D_SAMPLES_MAX)
        return 0;
    put_u16(b + 24, r->n_samples);
    memcpy(b + PROFILE_BYTES, r->samples, r->n_samples);
    return ping_frame_build(out, size, PING1D_PROFILE, src, b, PROFILE_BYTES + (size_t)r->n_samples);
}

size_t ping1d_encode_set(uint8_t *out, size_t size, uint16_t id, uint32_t a, uint32_t b)
{
    uint8_t payload[8];
    size_t n = 2;
    put_u32(payload, a);
    put_u32(payload + 4, b);
    if (id == PING1D_SET_RANGE)
        n = 8;
    else if (id == PING1D_SET_SPEED_OF_SOUND)
        n = 4;
    else if (id == PING1D_SET_MODE_AUTO || id == PING1D_SET_GAIN || id == PING1D_SET_PING_ENABLE)
        n = 1;
    return ping_frame_build(out, size, id, 0, payload, n);
}

bool ping1d_decode_speed(const struct ping_frame *f, double *speed_mps)
{
    if (f->id != PING1D_SPEED_OF_SOUND || f->length < 4)
        return false;
    double speed = get_u32(f->payload) * 1e-3;
    if (!(speed >= 1000.0 && speed <= 2000.0))
        return false;
    *speed_mps = speed;
    return true;
}

bool ping1d_decode_firmware(const struct ping_frame *f, unsigned *major, unsigned *minor)
{
    if (f->id != PING1D_FIRMWARE_VERSION || f->length < FIRMWARE_BYTES)
        return false;
    *major = get_u16(f->payload + 2);
    *minor = get_u16(f->payload + 4);
    return true;
}

/* What the protocol calls relative strength, taken for pressure: only ratios within a profile are looked at. */
static void fill_profile(struct ping *ping, const struct ping1d_reading *r, double start_m, double cell_m)
{
    const uint32_t n = r->n_samples < ping->max_samples ? r->n_samples : ping->max_samples;
    ping->kind = PING_CHOICE;
    ping->law = AMPLITUDE_LINEAR;
    ping->sample_bytes = 1;
    ping->n_bins = n;
    ping->r0_m = (float)start_m;
    ping->dr_m = (float)cell_m;
    if (n > 0)
        memcpy(ping->samples, r->samples, n);
}

void ping1d_fill_ping(struct ping *ping, const struct ping_frame *frame, const struct ping1d_reading *r,
                      const struct ping1d_view *view)
{
    const double start_m = r->simple ? view->start_m : r->start_mm * 1e-3 * view->scale,
                 begin_m = fmax(start_m, PING1D_START_MM * 1e-3 * view->scale);
    const double end_m = r->simple ? view->range_m : start_m + r->length_mm * 1e-3 * view->scale;
    const double scan_m = r->simple ? fmax(end_m - begin_m, 0.0) : r->length_mm * 1e-3 * view->scale;
    double pulse_m = view->sound_speed_mps * r->transmit_us * 1e-6 / 2.0;
    double deaf_m = fmax(PING1D_START_MM * 1e-3 * view->scale, PING1D_RINGS_MM * 1e-3 * view->scale + pulse_m);
    double cell_m = scan_m / (r->n_samples > 0 ? r->n_samples : PING1D_SAMPLES);
    double confidence = r->confidence_percent / 100.0;
    bool reports = r->distance_mm > 0 && r->confidence_percent > 0;
    bool heard = reports && confidence >= view->min_confidence;
    uint64_t listening_ns = (uint64_t)(2e9 * end_m / view->sound_speed_mps);
    ping->t_ns =
        transmitted_ns(frame->t_first_ns, frame->t_last_ns, ping_frame_bytes(frame), view->baud, listening_ns);
    ping->t_in_ns = frame->t_last_ns;
    ping->kind = PING_RANGES;
    /* with a profile that says more; without, it may be an obstacle, and what was free behind it may not be */
    if (reports && !heard && r->n_samples == 0)
        ping->flags |= PING_UNHEARD;
    ping->sample_bytes = 0;
    ping->n_beams = 1;
    ping->n_bins = 1;
    ping->r0_m = (float)begin_m;
    ping->dr_m = (float)fmax(end_m - begin_m, 0.0);
    ping->pulse_m = (float)pulse_m;
    ping->deaf_m = (float)deaf_m;
    ping->gain = (uint8_t)(r->gain < UINT8_MAX ? r->gain : UINT8_MAX);
    if (r->n_samples > 0)
        fill_profile(ping, r, start_m, cell_m);
    ping->az_aperture_rad = ping->el_aperture_rad = (float)view->beam_rad;
    ping->beam[0] = (struct ping_beam){.range_m = heard ? (float)(r->distance_mm * 1e-3 * view->scale) : 0.0f,
                                       .range_sd_m = (float)(fmax(pulse_m, cell_m) / sqrt(12.0)),
                                       .confidence = heard ? (float)confidence : 0.0f};
}
