/* SPDX-License-Identifier: MIT */
/*
 * takeover - notices a sonar that another program has given other settings. Each ping tells the settings that it was
 * made with; here they are compared with those that were sent. A few pings that differ are normal: some with the old
 * settings follow every change. More of them are a takeover. It is logged once, and the settings are sent again, less
 * and less often while that changes nothing: two programs that fight for a head must not keep it from scanning. The
 * pings are used with the settings that they tell. Knows no protocol.
 */
#ifndef SONARD_TAKEOVER_H
#define SONARD_TAKEOVER_H

#include "device.h"

/* One setting, in the device's own units. */
struct takeover_value {
    const char *name; /* as the protocol has it */
    long seen, sent;
    long slack; /* a difference of at most this is the device's rounding */
};

/* All zeros: nothing was seen. */
struct takeover {
    unsigned level;   /* rises with each ping of other settings, falls with each ping of ours */
    bool told;        /* a takeover has been logged */
    uint64_t ours_ns; /* when the last takeover ended; 0: none has */
    uint64_t due_ns;  /* the settings are not sent again before this time */
    uint64_t wait_ns; /* last wait between two attempts; 0: no attempt yet */
};

/** takeover_forget - start anew: the port was opened, or the device is set up again. */
void takeover_forget(struct takeover *t, struct device_status *status);

/**
 * takeover_ping - compare the n settings of a ping, received at now_ns, with those sent. Returns true when they are to
 * be sent again now. Updates status.taken_over and status.other_settings; notes when a takeover begins or ends.
 */
bool takeover_ping(struct takeover *t, struct device_status *status, const struct takeover_value *value,
                   unsigned n, uint64_t now_ns, const struct device_io *io);

#endif
