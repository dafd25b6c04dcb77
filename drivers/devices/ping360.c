/* SPDX-License-Identifier: MIT */
/*
 * ping360 - see ping360.h.
 */
#include "ping360.h"

#include <math.h>
#include <string.h>

#include "drivers/ports/line_time.h"
#include "ping360_scan.h"

void ping360_set_range(struct ping360_settings *set, double range_m, double sound_speed_mps, unsigned n_most)
{
    const double hair = 1e-9; /* 80 ticks are 80, not 80.000..1 and hence 81 */
    double ticks = 2.0 * range_m / (sound_speed_mps * PING360_TICK_S);
    unsigned n = n_most;
    if (ticks / n + hair < PING360_PERIOD_MIN)
        n = (unsigned)ceil(ticks / PING360_PERIOD_MIN - hair);
    unsigned period = (unsigned)fmax(ceil(ticks / n - hair), PING360_PERIOD_MIN);

    set->n_samples = (uint16_t)n;
    set->sample_period = (uint16_t)period;
    /* A pulse that grows with the range; of whole microseconds, no shorter than 2.5 samples, as its maker has it. */
    const double least_us = ceil(2.5 * period * PING360_TICK_S * 1e6 - hair);
    set->transmit_us = (uint16_t)fmin(fmax(round(8000.0 * range_m / sound_speed_mps), fmax(least_us, 5.0)), 500.0);
}

uint64_t ping360_listening_ns(const struct ping360_settings *set)
{
    return (uint64_t)set->n_samples * set->sample_period * 25u;
}

double ping360_sample_m(const struct ping360_settings *set, double sound_speed_mps)
{
    return set->sample_period * PING360_TICK_S * sound_speed_mps / 2.0;
}

void ping360_fill_ping(struct ping *ping, const struct ping_frame *frame, const struct ping360_data *data,
                       double sound_speed_mps, unsigned baud)
{
    int clockwise = (data->set.angle + PING360_TURN - PING360_AHEAD) % PING360_TURN;
    ping->t_ns = transmitted_ns(frame->t_first_ns, frame->t_last_ns, ping_frame_bytes(frame), baud,
                                ping360_listening_ns(&data->set));
    ping->t_in_ns = frame->t_last_ns;
    ping->kind = PING_PROFILE;
    ping->law = AMPLITUDE_SQRT;
    /* what a step of gain is worth is not published; a louder one is not relied on */
    ping->gain_db = data->set.gain == 0 ? -6.0f : 0.0f;
    ping->gain = data->set.gain;
    ping->sample_bytes = 1;
    ping->n_beams = 1;
    /* a frame has room for more samples than the head can send */
    const uint32_t room = ping->max_samples < PING360_SAMPLES_MAX ? ping->max_samples : PING360_SAMPLES_MAX;
    ping->n_bins = data->n_data < room ? data->n_data : room;
    ping->r0_m = 0.0f;
    ping->dr_m = (float)ping360_sample_m(&data->set, sound_speed_mps);
    ping->pulse_m = (float)(sound_speed_mps * data->set.transmit_us * 1e-6 / 2.0);
    ping->az_aperture_rad = (float)geo_rad(PING360_WIDE_DEG);
    ping->el_aperture_rad = (float)geo_rad(PING360_HIGH_DEG);
    ping->head_units = data->set.angle;
    ping->head_turn = PING360_TURN;
    ping->beam[0] = (struct ping_beam){.az_rad = (float)(clockwise * GEO_TURN / PING360_TURN)};
    memcpy(ping->samples, data->data, ping->n_bins);
}
