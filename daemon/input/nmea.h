/* SPDX-License-Identifier: MIT */
/*
 * nmea - one port (input_port.h) on which a sensor speaks NMEA 0183, tied to the loop: hands depth and heading on as
 * pose. Sends nothing.
 */
#ifndef SONARD_NMEA_H
#define SONARD_NMEA_H

#include "config/conf.h"
#include "core/fault.h"
#include "core/worker.h"
#include "drivers/nmea/nmea0183.h"
#include "drivers/ports/port.h"
#include "pose_input.h"

struct nmea;

struct nmea_status {
    struct nmea_counts counts;
    bool open;
    uint64_t bytes_in, reconnects;
    uint64_t strangers;    /* see struct port */
    uint64_t late_bytes;   /* not used: received while the process was stalled, at an unknown time */
    uint64_t no_variation; /* magnetic headings that could not be used */
    uint64_t excluded;     /* values that `use` leaves out */
    struct fault unused;   /* what came lately, and why none of it was used; empty: all is well */
    uint64_t t_value_ns;   /* of the last value that became a pose; 0: none */
    struct fault port_error;
};

/** nmea_new - NULL with a sentence in fault. Nothing is opened. The worker looks up the host's name, if it has one. */
struct nmea *nmea_new(const struct conf_nmea *conf, struct pose_input *input, struct worker *worker,
                      struct fault *fault);

void nmea_start(struct nmea *nmea);
void nmea_free(struct nmea *nmea); /* NULL is allowed */
void nmea_status(const struct nmea *nmea, struct nmea_status *out);

#endif
