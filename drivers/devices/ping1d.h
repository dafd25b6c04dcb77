/* SPDX-License-Identifier: MIT */
/*
 * ping1d - the messages of the Blue Robotics Ping1D and Ping2 echosounders, and a reading as a ping. Keeps no state.
 * The device itself is device_ping1d of device.h (ping1d_device.c); of the configuration it takes:
 *
 *   range            1.5 .. 200 m: what is listened to with a gain of one's own, and how often is pinged
 *   gain             0 .. 6; -1: the echosounder chooses gain and range by itself
 *   min_confidence   readings below count as no echo
 *   request_response ask for every profile instead of letting the device send them by itself
 *
 * The intensities of its profiles are scaled anew for every ping, so no threshold could be held against them: the
 * reading is the distance that the device picks itself, with its confidence, and the profile that it was picked in.
 * Source: the public definition of the Blue Robotics Ping protocol.
 */
#ifndef SONARD_PING1D_H
#define SONARD_PING1D_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/ping.h"
#include "ping_frame.h"

#define PING1D_START_MM        500    /* these transducers detect nothing nearer */
#define PING1D_RINGS_MM        400    /* for so long they ring behind a pulse: a longer one ends later */
#define PING1D_LENGTH_MIN_MM   1000   /* of a scan */
#define PING1D_SOUND_SPEED_MPS 1500.0 /* when switched on */
#define PING1D_SAMPLES         200    /* of a profile, in practice */
#define PING1D_SAMPLES_MAX     (PING_PAYLOAD_MAX - 26)

enum ping1d_message {
    PING1D_SET_RANGE = 1001,
    PING1D_SET_SPEED_OF_SOUND = 1002,
    PING1D_SET_MODE_AUTO = 1003,
    PING1D_SET_PING_INTERVAL = 1004,
    PING1D_SET_GAIN = 1005,
    PING1D_SET_PING_ENABLE = 1006,
    PING1D_FIRMWARE_VERSION = 1200,
    PING1D_SPEED_OF_SOUND = 1203,
    PING1D_DISTANCE_SIMPLE = 1211,
    PING1D_DISTANCE = 1212,
    PING1D_PROFILE = 1300,
    PING1D_CONTINUOUS_START = 1400,
    PING1D_CONTINUOUS_STOP = 1401,
};

/* distance_simple, distance or profile. Lengths are on the sound speed that the device is set to. */
struct ping1d_reading {
    uint32_t distance_mm;
    uint16_t confidence_percent;
    bool simple; /* nothing of what follows was said */
    uint16_t transmit_us;
    uint32_t ping_number;
    uint32_t start_mm, length_mm; /* of the scan */
    uint32_t gain;
    uint16_t n_samples; /* of a profile that are there; 0: a distance */
    const uint8_t *samples;
};

/** ping1d_is_reading - is it one of the three messages that hold a distance? */
bool ping1d_is_reading(uint16_t id);

/** ping1d_decode - such a message. False: too short, fewer samples than it says or none in a profile, or lengths or a
 * confidence that cannot be. */
bool ping1d_decode(const struct ping_frame *f, struct ping1d_reading *out);

/** ping1d_encode_reading - what a device of id `src` says: a profile,
 * or with n_samples 0 a distance, or a simple one. */
size_t ping1d_encode_reading(uint8_t *out, size_t size, uint8_t src, const struct ping1d_reading *r);

/** ping1d_encode_set - the setting `id` (1001 .. 1006, 1400, 1401); a and b as its fields, b of set_range only. */
size_t ping1d_encode_set(uint8_t *out, size_t size, uint16_t id, uint32_t a, uint32_t b);

/** ping1d_decode_speed - speed_of_sound, m/s; false when it is none, or none of any water (1000 .. 2000 m/s). */
bool ping1d_decode_speed(const struct ping_frame *f, double *speed_mps);

/** ping1d_decode_firmware - firmware_version, all that old firmware tells of itself; false when it is none. */
bool ping1d_decode_firmware(const struct ping_frame *f, unsigned *major, unsigned *minor);

/* What a reading is held against. */
struct ping1d_view {
    double scale;            /* true sound speed over the device's */
    double start_m, range_m; /* listened to from, and up to, where the message does not say */
    double sound_speed_mps;
    double min_confidence; /* 0..1 */
    double beam_rad;
    unsigned baud;
};

/**
 * ping1d_fill_ping - the reading as a ping of one ready range along x of the sensor; no echo when its confidence
 * is below the least, and PING_UNHEARD without a profile. A profile's samples come with it (PING_CHOICE; those that the
 * ping has room for); else one bin without samples spans what was listened to and what these transducers can detect.
 * sd: of a reflector anywhere within the pulse and a profile's bin. Everything but the other flags, seq, sensor and
 * pose is set.
 */
void ping1d_fill_ping(struct ping *ping, const struct ping_frame *frame, const struct ping1d_reading *r,
                      const struct ping1d_view *view);

#endif
