/* SPDX-License-Identifier: MIT */
/*
 * listener - what devices have in common that only listen and get ready ranges of one fixed beam: whether they are
 * heard, and the ping. Knows no protocol. A device's state begins with a struct listener, so that the functions here
 * stand in its device_ops.
 */
#ifndef SONARD_LISTENER_H
#define SONARD_LISTENER_H

#include "device.h"

struct listener {
    struct device_conf conf;
    const char *subject;  /* of the sentence when nothing comes: "DroneCAN range sensor" */
    uint64_t patience_ns; /* silence is told after so long */
    bool open, heard, silent;
    uint64_t due_ns;
    struct device_status status; /* state is filled in by listener_status */
};

/** A range for listener_ping. */
struct listener_range {
    double range_m;      /* 0: it listened and heard nothing */
    double range_max_m;  /* how far it can hear; 0: as configured */
    double resolution_m; /* step of the number */
    double aperture_rad; /* full width of the beam */
    bool unheard;        /* it says that it cannot tell; range_m is 0 */
};

void listener_init(struct listener *l, const struct device_conf *conf, const char *subject, uint64_t patience_ns);

/** listener_heard - something for us came in, with or without a range. */
void listener_heard(struct listener *l, uint64_t now_ns, const struct device_io *io);

/**
 * listener_ping - a range that came in at now_ns becomes a ping of one beam along the sensor's axis, sent as long ago as
 * sound needs for the way there and back. Its deviation is a hundredth of the range (speed of sound, form of the
 * bottom), 2 cm or the resolution, whichever is most.
 */
void listener_ping(struct listener *l, const struct listener_range *range, uint64_t now_ns,
                   const struct device_io *io);

/* For device_ops; `state` begins with the listener. */
void listener_opened(void *state, uint64_t now_ns, const struct device_io *io);
void listener_closed(void *state, uint64_t now_ns);
void listener_tick(void *state, uint64_t now_ns, const struct device_io *io);
uint64_t listener_deadline(const void *state);
void listener_stop(void *state, uint64_t now_ns, const struct device_io *io);
void listener_status(const void *state, struct device_status *out);

#endif
