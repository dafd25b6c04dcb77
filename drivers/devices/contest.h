/* SPDX-License-Identifier: MIT */
/*
 * contest - notices a sonar whose answers get lost again and again although it does answer. A bridge between network
 * and line answers whoever spoke last: while another program speaks to the head, too, most answers go to that program.
 * The pings that are left have the settings that were sent (so takeover.h sees nothing) and come often enough to look
 * well. A poor line does the same; the two cannot be told apart from here, so both are named. Knows no protocol.
 *
 * Lost answers raise a level once a ping comes again, and each ping lowers it by one. A head that answers never raises
 * it, one that has died raises it at most once, and what was only late is taken back by contest_late.
 */
#ifndef SONARD_CONTEST_H
#define SONARD_CONTEST_H

#include "device.h"

/* All zeros: nothing was lost. */
struct contest {
    unsigned level;
    uint64_t timeouts, restarts; /* of the status at the last ping */
    bool told;                   /* said before */
    uint64_t well_ns;            /* when it was well again; 0: never */
};

/** contest_forget - the port was opened, or the device was closed: what was lost before does not count. */
void contest_forget(struct contest *c, struct device_status *status);

/**
 * contest_ping - a ping came at now_ns; what status.timeouts has grown by since the last one is lost. `polled`: every
 * ping is asked for, so that a timeout is one lost ping, not a second of silence. Keeps status.contested.
 */
void contest_ping(struct contest *c, struct device_status *status, bool polled, uint64_t now_ns,
                  const struct device_io *io);

/** contest_late - the second answer to a ping that was asked for twice came: the first was late, not lost. */
void contest_late(struct contest *c);

#endif
