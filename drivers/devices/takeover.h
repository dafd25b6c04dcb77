/* SPDX-License-Identifier: MIT */
/*
 * takeover - notices a sonar that somebody else has given other settings: its pings say which it has, and those are not
 * the ones that were sent. A few such pings are no sign, since some of the old settings follow every change. Then it is
 * said, once, and time to send the settings again, less and less often while that is in vain: two programs that fight
 * for a head must not keep it from scanning. The pings themselves stay what they say they are. Knows no protocol.
 */
#ifndef SONARD_TAKEOVER_H
#define SONARD_TAKEOVER_H

#include "device.h"

/* One setting, in the device's own units. */
struct takeover_value {
    const char *name; /* as the protocol has it */
    long seen, sent;
    long slack; /* a difference up to this is the device's rounding */
};

/* All zeros: nothing was seen. */
struct takeover {
    unsigned level;   /* rises with pings of other settings, sinks with pings of ours */
    bool told;        /* said, and not forgotten since */
    uint64_t ours_ns; /* when it had our settings again; 0: it has not, or nothing was ever noticed */
    uint64_t due_ns;  /* the settings are not sent again before ... */
    uint64_t wait_ns; /* ... and next time not before so long */
};

/** takeover_forget - the port was opened, or the device is set up anew: what it did before does not count. */
void takeover_forget(struct takeover *t, struct device_status *status);

/**
 * takeover_ping - a ping came from a device that was set up, with these settings. True: send
 * them again, now. Keeps status.taken_over and status.other_settings.
 */
bool takeover_ping(struct takeover *t, struct device_status *status, const struct takeover_value *value,
                   unsigned n, uint64_t now_ns, const struct device_io *io);

#endif
