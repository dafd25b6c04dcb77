/* SPDX-License-Identifier: MIT */
/*
 * receiver - what devices have in common that only listen and get ready ranges of one fixed beam: whether they are
 * heard, and the ping. Knows no protocol. A device's state begins with a struct receiver, so that the functions here
 * stand in its device_ops.
 */
#ifndef SONARD_RECEIVER_H
#define SONARD_RECEIVER_H

#include "device.h"

struct receiver {
    struct device_conf conf;
    const char *subject;  /* of the sentence when nothing comes: "DroneCAN range sensor" */
    uint64_t patience_ns; /* silence is reported after so long */
    bool open, heard, silent;
    uint64_t due_ns;
    bool talking;                /* somebody was heard: ... */
    unsigned talker;             /* ... on a bus where any may speak, that one */
    uint64_t t_talker_ns;        /* of its newest message */
    struct device_status status; /* state is filled in by receiver_status */
};

/** A range for receiver_ping. */
struct receiver_range {
    double range_m;      /* 0: it listened and heard nothing */
    double range_min_m;  /* nearer it hears nothing; 0: not known */
    double range_max_m;  /* how far it can hear; 0: as configured */
    double resolution_m; /* step of the number */
    double aperture_rad; /* full width of the beam */
    bool unheard;        /* it says that it cannot tell; range_m is 0 */
};

void receiver_init(struct receiver *l, const struct device_conf *conf, const char *subject, uint64_t patience_ns);

/** receiver_talks - is anybody held who spoke within the patience? Then *talker is that one. */
bool receiver_talks(const struct receiver *l, uint64_t now_ns, unsigned *talker);

/**
 * receiver_hears - is a message of `talker` to be believed? Two instruments are no single one that knows more: the
 * first that speaks is held, and is replaced only after its silence. Messages of others are counted.
 */
bool receiver_hears(struct receiver *l, unsigned talker, uint64_t now_ns);

/** receiver_heard - something for us came in, with or without a range. */
void receiver_heard(struct receiver *l, uint64_t now_ns, const struct device_io *io);

/**
 * receiver_ping - a range that came in at now_ns becomes a ping of one beam along the sensor's axis, sent as long ago
 * as sound needs for the way there and back. Its deviation is a hundredth of the range (speed of sound, form of the
 * bottom), 2 cm or the resolution, whichever is most.
 */
void receiver_ping(struct receiver *l, const struct receiver_range *range, uint64_t now_ns,
                   const struct device_io *io);

/* For device_ops; `state` begins with the receiver. */
void receiver_opened(void *state, uint64_t now_ns, const struct device_io *io);
void receiver_closed(void *state, uint64_t now_ns);
void receiver_tick(void *state, uint64_t now_ns, const struct device_io *io);
uint64_t receiver_deadline(const void *state);
void receiver_stop(void *state, uint64_t now_ns, const struct device_io *io);
void receiver_status(const void *state, struct device_status *out);

#endif
