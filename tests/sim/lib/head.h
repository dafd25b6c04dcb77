/* SPDX-License-Identifier: MIT */
/*
 * head - a Ping360 as a pure state machine: the host's bytes and the time go in, frames come out. It knows neither
 * the line nor the water; both are called through struct head_io. Numbers are the device's own: gradians (400 per
 * turn), microseconds of transmission, ticks of 25 ns per sample.
 *
 * A ping takes as long as the real thing: the motor's way, then the listening time, then the head's own work; in
 * auto-transmit the next one begins when the frame has left the line.
 */
#ifndef SONARD_SIM_HEAD_H
#define SONARD_SIM_HEAD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/devices/ping360.h"
#include "drivers/devices/ping_frame.h"

#define HEAD_NEVER UINT64_MAX
#define HEAD_TURN  400 /* gradians */
#define HEAD_AHEAD 200 /* the angle that looks forward; 0 is the cable side */

struct head_conf {
    uint8_t id;
    bool old_firmware;      /* 3.1.0: knows neither auto_transmit nor motor_off */
    bool strict_autobaud;   /* deaf until the host has sent a 'U' */
    unsigned lag;           /* pings that still come with the settings before a change */
    double ms_per_gradian;  /* of the motor */
    double processing_ms;   /* from the last sample to the first byte */
    double sound_speed_mps; /* for the faulty range only: the head itself counts ticks */
};

/* One transmission, as the water needs it. */
struct head_shot {
    struct ping360_settings settings; /* angle: where the head looks */
    uint64_t t_ns;                    /* of the transmission */
};

struct head_io {
    void *ctx;
    uint64_t (*send)(void *ctx, const uint8_t *frame, size_t n, uint64_t now_ns); /* returns when it has left */
    void (*listen)(void *ctx, const struct head_shot *shot, uint8_t *samples);    /* samples[n_samples] */
};

enum head_phase {
    HEAD_IDLE,
    HEAD_LISTENING, /* a ping is under way; its data are ready at due_ns */
    HEAD_PAUSE,     /* auto-transmit: the next ping begins at due_ns */
};

struct head_counts {
    uint64_t pings, requests, nacks;
};

struct head {
    struct head_conf conf;
    struct head_io io;
    struct ping_parser parser;
    struct ping360_settings settings, wanted; /* in force; asked for */
    unsigned lag_left;                        /* pings until wanted is in force */
    bool configured;                          /* settings have come since it was switched on */
    bool awake;                               /* has heard a 'U', or need not */
    bool automatic;                           /* auto-transmit runs, over `sweep` */
    struct ping360_sweep sweep, next_sweep;   /* the next one is taken at the end of a sweep */
    int position, direction;                  /* gradians from the sweep's start; +1 or -1 */
    uint16_t angle;                           /* where the motor stands, gradians */
    enum head_phase phase;
    uint64_t due_ns;
    struct head_shot shot; /* under way */
    bool transmits;        /* the shot is a ping, not only a turn of the head */
    uint64_t nack_next;    /* fault: so many next settings are refused */
    double forced_range_m; /* fault: settings changed by themselves; 0: off */
    struct head_counts counts;
};

/** head_init - a head that has just been switched on. */
void head_init(struct head *head, const struct head_conf *conf, const struct head_io *io);

/** head_boot - switch it off and on: boot settings, idle; counts and faults stay. */
void head_boot(struct head *head);

/** head_feed - n bytes from the host; any split, any content. */
void head_feed(struct head *head, const uint8_t *bytes, size_t n, uint64_t now_ns);

/** head_tick - do what is due by now. */
void head_tick(struct head *head, uint64_t now_ns);

/** head_deadline - when head_tick has something to do; HEAD_NEVER: nothing. */
uint64_t head_deadline(const struct head *head);

#endif
