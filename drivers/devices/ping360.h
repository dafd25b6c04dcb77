/* SPDX-License-Identifier: MIT */
/*
 * ping360 - what a Ping360's settings mean in metres and nanoseconds, and its data frame as a ping. Keeps no state.
 * The device itself is device_ping360 of device.h (ping360_device.c); of the configuration it takes:
 *
 *   range            0.75 .. 200 m
 *   gain             0 low, 1 normal, 2 high; -1: 1
 *   frequency        500 .. 1000 kHz; 0: 750 kHz
 *   sector, step     azimuths in the sensor frame, rounded to gradians: see ping360_scan_init; step at most 180 deg
 *   request_response ask for every ping. This is also done where the head cannot do the scan by itself: steps beyond
 *                    10 gradians, a sector across its zero (dead aft), firmware without automatic scan
 *   baud             0: no line that needs a break, or time for its bytes
 */
#ifndef SONARD_PING360_H
#define SONARD_PING360_H

#include <stdint.h>

#include "grid/ping.h"
#include "ping_frame.h"

#define PING360_WIDE_DEG    2.0 /* its beam at half power */
#define PING360_HIGH_DEG    25.0
#define PING360_TICK_S      25e-9 /* of the sample period */
#define PING360_SAMPLES_MAX 1200
/*
 * So many tell what a pulse does: its length T is 0.4 % of the range, 2.6 samples lie in it, and its spectrum up to the
 * first zero, 1 / T, is below half the sample rate. Steps between samples add 0.16 % / sqrt(12) of the range to the
 * error of an echo's, 5 mm at 10 m. They take half the line's time of all samples: 58 ms, not 106, at 115200 baud.
 */
#define PING360_SAMPLES_FEW 640
#define PING360_PERIOD_MIN  80
#define PING360_PERIOD_MAX  40000
#define PING360_RANGE_MAX_M 50.0 /* to ask for; other programs ask for more */

/**
 * ping360_set_range - sample count, sample period and transmit duration for a range [0.75 .. 200 m] at a sound speed
 * [1350 .. 1650 m/s]; the other settings are left. n_most samples [PING360_SAMPLES_FEW .. PING360_SAMPLES_MAX], fewer
 * where the shortest period of the head forbids. The range covers what is asked for, and at most 25 mm more.
 */
void ping360_set_range(struct ping360_settings *set, double range_m, double sound_speed_mps, unsigned n_most);

/** ping360_listening_ns - how long the head listens with these settings. */
uint64_t ping360_listening_ns(const struct ping360_settings *set);

/** ping360_sample_m - length of one sample in metres of range. */
double ping360_sample_m(const struct ping360_settings *set, double sound_speed_mps);

/**
 * ping360_fill_ping - describe `data`, which came in `frame`, as a ping and copy its samples (as many as there is
 * room for). Everything but flags, seq, sensor and pose is set; beam and samples must have room for one beam. The
 * head was silent while it listened and began to send at once, so the time of transmission is reckoned back from the
 * frame's first byte; bytes that waited in a buffer come late and all at once, so that is put no later than the line
 * allows (baud; 0: no such bound). A time before 0 is 0.
 */
void ping360_fill_ping(struct ping *ping, const struct ping_frame *frame, const struct ping360_data *data,
                       double sound_speed_mps, unsigned baud);

#endif
