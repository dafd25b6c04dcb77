/* SPDX-License-Identifier: MIT */
/*
 * device - a sonar's protocol as a pure state machine. Bytes and the time go in; bytes to send, pings and the next
 * deadline come out. A device knows no descriptor, no clock and no grid, allocates nothing and keeps all it knows in
 * its state, so the same code runs live, in replay, in a unit test and under a fuzzer. One ops table per device,
 * listed in DEVICES below.
 *
 * A data frame that arrives is always turned into a ping, whatever the device thinks its state is: a replay of a
 * recording that begins in mid-stream, or of one without answers to our requests, must work.
 */
#ifndef SONARD_DEVICE_H
#define SONARD_DEVICE_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "grid/ping.h"
#include "drivers/ports/can_frame.h"
#include "clock_map.h"

#define DEVICE_TEXT_MAX     96
#define DEVICE_SETTINGS_MAX 272 /* all that a Ping360 tells with each ping has at most 257 characters */
#define DEVICE_KEY_TEXT_MAX 128
#define DEVICE_NOTE_MAX     384 /* bytes of a note with its NUL: a list of settings and what is said of it */

enum device_note {
    NOTE_DEBUG,
    NOTE_INFO,
    NOTE_WARNING,
};

/* What a device may ask of its surroundings. Every slot is set. */
struct device_io {
    void *ctx;
    void (*send)(void *ctx, const uint8_t *bytes, size_t n);
    void (*hold_break)(void *ctx, bool on); /* as port_ops.hold_break; nothing is sent before it is off again */
    /* A free ping buffer with beam, samples and their room set, the rest zeroed; NULL: no room, drop the ping. */
    struct ping *(*ping_begin)(void *ctx);
    /* Hand the filled buffer on. t_ns, t_in_ns and all of the description must be set; seq, sensor, pose are not. */
    void (*ping_done)(void *ctx, struct ping *ping);
    /* One sentence for the operator, of less than DEVICE_NOTE_MAX bytes; the caller adds the sensor's name and limits
     * the rate. */
    void (*note)(void *ctx, enum device_note level, const char *fmt, ...) __attribute__((format(printf, 3, 4)));
};

/* What the configuration says of a sensor, in SI units. A device takes what it needs. */
struct device_conf {
    double range_m;
    double sound_speed_mps;
    int gain; /* device's own scale; -1: device's default */
    double sector_start_rad,
        sector_end_rad; /* in the sensor frame, clockwise from start to end; equal: full circle */
    double step_rad;
    double frequency_hz;   /* 0: device's default */
    double min_confidence; /* 0..1: a pick of the device's own below it counts as no echo */
    bool request_response; /* ask for every ping instead of letting the device transmit by itself */
    bool steered;          /* `steer` will say where to look more often */
    double circle_s;       /* steered: all around within this time, if it can be; 0: in twice as many pings */
    bool listen_only;      /* a replay that has bytes alone: never wait for answers, ask nothing again */
    int node;              /* whose messages to take on a bus, its address; -1: anybody's */
    int sensor_id;         /* which of a node's sensors; -1: any */
    unsigned baud;         /* of the line the bytes come over; 0: unknown */
    unsigned least_baud;   /* as port_ops.least_baud */
};

enum device_state {
    DEVICE_CLOSED,   /* no port */
    DEVICE_IDENTIFY, /* asking who is there */
    DEVICE_SETUP,    /* settings sent, not yet answered */
    DEVICE_RUNNING,  /* pings come in */
    DEVICE_SILENT,   /* the port is open, nothing understandable comes */
};

/* Counters only grow, from the start of the process. */
struct device_status {
    enum device_state state;
    char what[DEVICE_TEXT_MAX]; /* "Ping360 fw 3.3.8 id 2"; empty: not identified */
    uint64_t frames;            /* whole good frames of any kind */
    uint64_t pings;
    uint64_t garbage_bytes; /* skipped while looking for a frame */
    uint64_t cut_bytes;     /* of what may have been a frame when the port was lost */
    uint64_t bad_checksum;
    uint64_t bad_frame;   /* right checksum, senseless or short content */
    uint64_t lost_frames; /* expected and never came */
    uint64_t strangers;   /* of another sender than the one that is believed: not used */
    uint64_t nacks;
    uint64_t timeouts;
    uint64_t restarts;   /* set up anew, after silence or a takeover */
    uint64_t taken_over; /* times that its pings showed settings that were not the ones sent */
    char other_settings[DEVICE_SETTINGS_MAX]; /* which, while they do; empty: it has those that were sent */
    bool contested;        /* its answers get lost again and again: another program, or a poor line */
    uint64_t last_ping_ns; /* 0: none yet */
    double range_m;        /* that the device reports, 0: none yet */
    bool has_clock;        /* its pings carry a time of its own */
    struct clock_report clock;
};

/* A key of [sonar NAME] that a device uses, and what it takes there. */
struct device_key {
    const char *name;
    double lo, hi; /* closed range in the unit of the key; both 0: all that the configuration allows */
    const char
        *help; /* what the numbers and auto mean to this device, in a few words; NULL: what they mean to all */
};

/* How long after its echo a reading of ready ranges comes, beside the time that sound takes. */
struct device_delay {
    double s, uncertain_s; /* it is from s - uncertain_s to s + uncertain_s; both 0: pings carry their true time */
    bool assumed;          /* nothing is published: whoever knows better should say so */
};

struct device_ops {
    const char *name;
    const struct device_key *keys; /* of those that not every device has, and of `range`; ends with name NULL */
    size_t state_size;             /* bytes; the caller gives zeroed, max_align_t-aligned memory */
    uint32_t max_beams, max_bins;  /* largest ping that it can make: the pool's buffers are sized by it */
    bool round;                    /* one round transducer: its beam is a cone and not a fan */
    bool listens;                  /* it sends nothing, ever */
    bool chooses;                  /* it picks the ranges itself, whatever samples come with them (PING_CHOICE) */
    bool axial;                    /* its only beam lies along the sensor's x axis: it has no sides */
    double beam_deg[2];        /* width and height of its usual beam at half power; 0 0: only its pings can tell */
    struct device_delay delay; /* of devices with the key `delay`, which stands for it */

    /* Take the configuration. False with a sentence in fault (which key, what is allowed) when it cannot be met. */
    bool (*init)(void *state, const struct device_conf *conf, struct fault *fault);
    void (*opened)(void *state, uint64_t now_ns,
                   const struct device_io *io);   /* port is (again) open: shake hands */
    void (*closed)(void *state, uint64_t now_ns); /* port is gone */
    /* n bytes read at now_ns; any split. */
    void (*feed)(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io);
    void (*tick)(void *state, uint64_t now_ns, const struct device_io *io); /* the deadline has come, or earlier */
    uint64_t (*deadline)(const void *state);                                /* UINT64_MAX: none */
    void (*stop)(void *state, uint64_t now_ns, const struct device_io *io); /* leave the hardware quiet */
    void (*status)(const void *state, struct device_status *out);
    /* The frames that it wants of a CAN bus, one record of can_frame.h per feed. NULL: it takes a stream of bytes. */
    struct can_match (*can_match)(const void *state);
    /* Pass over these azimuths (sensor frame, clockwise from - to, less than a turn) more often than over the rest, all
     * of which stays covered in twice as many pings or within circle_s; equal: no longer. only: pass over nothing else,
     * to and fro; each pass is a turn then. NULL: it cannot be steered. */
    void (*steer)(void *state, double from_rad, double to_rad, bool only);
    /* Take another range_m, gain and request_response of *conf, which are within what `keys` say, and tell the hardware
     * with what it is sent next; the rest of *conf is as before. NULL: it needs a new start, as all do whose pings do
     * not say what they were made with: who has but a part of a recording may not know of it. */
    void (*retune)(void *state, const struct device_conf *conf, uint64_t now_ns, const struct device_io *io);
};

/* Every device there is: a new one is a new .c and its name here. */
#define DEVICES(X)                                                                                                \
    X(micron)                                                                                                     \
    X(echolist) X(imagenex852) X(imagenex881a) X(nmea0183) X(ping360) X(dronecan) X(nmea2000) X(ping1d) X(surveyor)

#define DEVICE_DECLARE(device) extern const struct device_ops device_##device;
DEVICES(DEVICE_DECLARE)

extern const struct device_ops *const device_table[]; /* all of them; NULL at its end */

/** device_find - the device of that name, or NULL. */
const struct device_ops *device_find(const char *name);

/** device_key_find - the row of a key among those that the device uses, or NULL. */
const struct device_key *device_key_find(const struct device_ops *ops, const char *name);

/** device_key_text - the key and what the device takes there: "frequency 500 to 1000 kHz (auto: 750)". */
void device_key_text(const struct device_key *key, char *text, size_t size);

/**
 * device_conf_check - is every number within what the device's keys say, the sector made of angles and the speed of
 * sound that of water? False with a sentence in fault that begins with the key. Not a number fails.
 */
bool device_conf_check(const struct device_ops *ops, const struct device_conf *conf, struct fault *fault);

#endif
