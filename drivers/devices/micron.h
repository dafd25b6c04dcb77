/* SPDX-License-Identifier: MIT */
/*
 * micron - the messages of a Tritech Micron and other SeaNet imaging heads as structs, what their settings mean in
 * metres and nanoseconds, and an echo line as a ping. Knows no state and no order of messages. The device itself is
 * device_micron of device.h (micron_device.c); of the configuration it takes:
 *
 *   range          0.75 .. 200 m
 *   gain           0 .. 10: tenths of the full gain; -1: 4
 *   sector, step   azimuths in the sensor frame, in units of 1/16 gradian (0.05625 deg); step at most 255 units
 *   frequency      200 .. 1200 kHz; 0: 675 kHz. A Micron DST sweeps a band of its own and ignores it
 *   baud           0: no time is reckoned for bytes on the line
 *
 * The head pings when it is asked to, and only then, so request_response changes nothing.
 */
#ifndef SONARD_MICRON_H
#define SONARD_MICRON_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/ping.h"
#include "seanet_frame.h"

#define MICRON_TURN          6400 /* units of a turn, clockwise seen from above */
#define MICRON_AHEAD         3200 /* unit along the sensor's x axis; 0 is astern */
#define MICRON_NODE          2
#define MICRON_WIDE_DEG      3.0 /* its beam at half power */
#define MICRON_HIGH_DEG      35.0
#define MICRON_TICK_S        640e-9 /* of the sampling interval */
#define MICRON_BINS          400    /* asked for: 39 ms of line at 115200 baud */
#define MICRON_BINS_MAX      1500
#define MICRON_INTERVAL_MIN  5 /* ticks */
#define MICRON_COMMAND_BYTES 82
#define MICRON_DB_PER_COUNT  (80.0 / 255.0)

/* Bits of the head control word, in commands and in replies. */
enum micron_control {
    MICRON_8_BIT = 0x0001,      /* a byte per bin; else a nibble */
    MICRON_CONTINUOUS = 0x0002, /* full circles; else back and forth between the limits */
    MICRON_SCAN_RIGHT = 0x0004,
    MICRON_COMMON = 0x2300, /* raw, has a motor, says its sampling interval: always set */
};

enum micron_alive_bit {
    MICRON_CENTRED = 0x02,
    MICRON_MOTORING = 0x04,
    MICRON_NO_PARAMETERS = 0x40,
};

#define MICRON_STATUS_MOTOR_ERROR 0x02

/* What mtHeadCommand sets. */
struct micron_settings {
    bool dst; /* the command for a Micron DST, which is longer */
    uint16_t control;
    uint32_t frequency_hz;
    uint16_t pulse_us;    /* 50..350 */
    uint16_t range_dm;    /* a label only: 0.1 m */
    uint16_t left, right; /* limits, clockwise from left to right */
    uint8_t gain;         /* 0..210 */
    uint8_t step;         /* 1..255 units */
    uint16_t interval;    /* ticks of MICRON_TICK_S per bin */
    uint16_t n_bins;
};

/* What stands before the echo in mtHeadData. */
struct micron_data_head {
    uint8_t status;
    uint16_t control;
    uint8_t gain;
    uint8_t span, low; /* of 4-bit echoes: counts (80 dB / 255) of the window and of its lower end */
    uint16_t interval; /* ticks per bin */
    uint16_t left, right;
    uint8_t step;
    uint16_t bearing;
    uint16_t n_data; /* bytes of echo */
};

/* An echo line that is being put together from its packets. */
struct micron_line {
    bool open; /* packets are still to come */
    uint8_t next_packet;
    struct micron_data_head head;
    size_t n;          /* bytes of echo so far */
    size_t wire_bytes; /* of all frames */
    uint64_t t_first_ns, t_last_ns;
    uint8_t data[SEANET_DATA_MAX];
};

enum micron_join { MICRON_LINE_OPEN, MICRON_LINE_WHOLE, MICRON_LINE_BROKEN };

/**
 * micron_set_range - bins, sampling interval, pulse and label for a range [0.75 .. 200 m] at a sound speed [1350 ..
 * 1650 m/s]; the other settings are left. MICRON_BINS bins, fewer where the shortest interval forbids; the range
 * comes out at most 0.1 m off.
 */
void micron_set_range(struct micron_settings *set, double range_m, double sound_speed_mps);

/**
 * micron_set_scan - limits, step and the continuous bit for a scan clockwise from start to end (azimuths in the sensor
 * frame, radians); equal, or a turn apart: full circle. A step is 1..255 units.
 */
void micron_set_scan(struct micron_settings *set, double start_rad, double end_rad, double step_rad);

/** micron_bin_m - length of a bin of so many ticks in metres of range. */
double micron_bin_m(unsigned interval, double sound_speed_mps);

/** micron_pulse_us - length of the pulse for a range: what is sent to heads that do not choose it themselves. */
double micron_pulse_us(double range_m);

/** micron_listening_ns - how long the head listens. */
uint64_t micron_listening_ns(unsigned interval, unsigned n_bins);

/** micron_angle_to - the shorter way between two bearings, -3200 < way <= 3200 units, clockwise positive. */
int micron_angle_to(unsigned from, unsigned to);

/* Encoders: the whole frame from the host to the head; its length, or 0 when `size` has no room. */
size_t micron_encode_short(uint8_t *out, size_t size, uint8_t id); /* reboot, send version, send user data */
size_t micron_encode_send_data(uint8_t *out, size_t size, uint32_t time_ms);
size_t micron_encode_head_command(uint8_t *out, size_t size, const struct micron_settings *set);

/* Decoders: false when the frame is another message or too short for the fields. */
bool micron_decode_alive(const struct seanet_frame *f, uint8_t *info); /* set of enum micron_alive_bit */
bool micron_decode_version(const struct seanet_frame *f, uint8_t *software, uint16_t *serial);
bool micron_decode_user_data(const struct seanet_frame *f, bool *is_dst);

/** micron_line_add - one more mtHeadData; a first packet begins anew. LINE_BROKEN: all so far is worth nothing. */
enum micron_join micron_line_add(struct micron_line *line, const struct seanet_frame *f);

/** micron_line_bins - bins of a whole line; 0 when its fields make no sense. */
unsigned micron_line_bins(const struct micron_line *line);

/**
 * micron_line_samples - the echo of a whole line as counts of 80 dB over 255, at most `room` bins of it; how many.
 * 4-bit echoes are put where they belong on that scale: what lay below their window is 0, what lay above it full scale.
 */
unsigned micron_line_samples(const struct micron_line *line, uint8_t *out, size_t room);

/**
 * micron_fill_ping - describe a whole line (of at least one bin) as a ping and copy its echo, as much as there is room
 * for, as micron_line_samples does. Everything but flags, seq, sensor and pose is set. The head was silent while it
 * listened and began to send at once: the time of transmission is reckoned back from the first byte, which is put no
 * later than the line allows (baud; 0: no such bound). A time before 0 is 0.
 */
void micron_fill_ping(struct ping *ping, const struct micron_line *line, double sound_speed_mps, unsigned baud);

#endif
