/* SPDX-License-Identifier: MIT */
/*
 * mavlink_bridge - carries poses from an autopilot to the daemon and obstacles from the daemon to the autopilot, until
 * told to stop. The one place where link, vehicle, feed and alerts meet, and where the clock is read.
 */
#ifndef SONARD_MAVLINK_BRIDGE_H
#define SONARD_MAVLINK_BRIDGE_H

#include <signal.h>
#include <stdbool.h>

#include "mavlink_feed.h"
#include "mavlink_link.h"

struct mavlink_bridge_conf {
    struct mavlink_feed_conf feed; /* its rate is also that of the obstacles sent */
    struct mavlink_vehicle_conf vehicle;
    struct mavlink_obstacle_conf obstacles;
    uint8_t component_id;            /* ours */
    struct mavlink_signing *signing; /* NULL: frames are not signed */
};

/**
 * mavlink_bridge_run - over `link`, which was initialised, until *stop. The signals that set *stop must be blocked;
 * `waiting` is the mask with which the bridge waits. Connections that are lost, or not there yet, are tried again for
 * ever. Tells what changes on standard error.
 */
void mavlink_bridge_run(const struct mavlink_bridge_conf *conf, struct mavlink_link *link,
                        const volatile sig_atomic_t *stop, const sigset_t *waiting);

#endif
