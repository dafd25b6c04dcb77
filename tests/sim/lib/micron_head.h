/* SPDX-License-Identifier: MIT */
/*
 * micron_head - a Tritech Micron as a pure state machine: the host's bytes and the time go in, frames come out. It
 * knows neither the line nor the water; both are called through struct micron_head_io. Angles are units of 1/16
 * gradian, 3200 ahead.
 *
 * Switched on, it centres, then shows once a second that it lives, until it is asked for its first ping. A ping is one
 * step of the motor, the listening time and the head's own work; requests in the meantime are not heard.
 */
#ifndef SONARD_SIM_MICRON_HEAD_H
#define SONARD_SIM_MICRON_HEAD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/devices/micron.h"
#include "drivers/devices/seanet_frame.h"

#define MICRON_HEAD_NEVER UINT64_MAX

struct micron_head_conf {
    uint16_t serial;
    bool plain;             /* not a DST: the shorter command, the shorter user data */
    double centring_s;      /* after switching on */
    double ms_per_gradian;  /* of the motor */
    double processing_ms;   /* from the last sample to the first byte */
    double sound_speed_mps; /* for the faulty range only: the head itself counts ticks */
};

/* One transmission, as the water needs it. */
struct micron_head_shot {
    struct micron_settings settings;
    uint16_t bearing;
    uint64_t t_ns;
};

struct micron_head_io {
    void *ctx;
    void (*send)(void *ctx, const uint8_t *frame, size_t n, uint64_t now_ns);
    void (*listen)(void *ctx, const struct micron_head_shot *shot, uint8_t *samples); /* samples[n_bins] */
};

struct micron_head_faults {
    uint64_t motor_errors; /* so many next lines say that the motor has lost its steps */
    bool nibbles;          /* 4-bit echoes whatever is asked for */
    bool packets;          /* lines in packets of at most 128 bytes */
    double range_m;        /* settings changed by themselves; 0: off */
};

struct micron_head {
    struct micron_head_conf conf;
    struct micron_head_io io;
    struct micron_head_faults faults;
    struct seanet_parser parser;
    struct micron_settings settings;
    bool configured, told_user_data, scanning;
    uint16_t bearing;
    bool backward;
    uint64_t centred_ns, alive_ns;
    uint64_t ready_ns; /* of the ping under way; MICRON_HEAD_NEVER: none */
    struct micron_head_shot shot;
    uint64_t pings, requests;
};

/** micron_head_init - a head that has just been switched on. */
void micron_head_init(struct micron_head *head, const struct micron_head_conf *conf,
                      const struct micron_head_io *io, uint64_t now_ns);

/** micron_head_boot - switch it off and on; counts and faults stay. */
void micron_head_boot(struct micron_head *head, uint64_t now_ns);

/** micron_head_feed - n bytes from the host; any split, any content. */
void micron_head_feed(struct micron_head *head, const uint8_t *bytes, size_t n, uint64_t now_ns);

/** micron_head_tick - do what is due by now. */
void micron_head_tick(struct micron_head *head, uint64_t now_ns);

/** micron_head_deadline - when micron_head_tick has something to do. */
uint64_t micron_head_deadline(const struct micron_head *head);

#endif
