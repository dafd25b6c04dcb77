/* SPDX-License-Identifier: MIT */
/*
 * mavlink_bridge - carries poses from an autopilot to the daemon and obstacles from the daemon to the autopilot. The
 * one place where link, peer, vehicle, feed and alerts meet. Waits for nothing: who owns it polls its descriptors,
 * and hands the clock in.
 */
#ifndef SONARD_MAVLINK_BRIDGE_H
#define SONARD_MAVLINK_BRIDGE_H

#include <poll.h>
#include <stdint.h>

#include "mavlink_feed.h"
#include "mavlink_link.h"
#include "mavlink_peer.h"

#define MAVLINK_BRIDGE_FDS 2

struct mavlink_bridge_conf {
    struct mavlink_feed_conf feed; /* its rate is also that of the obstacles sent */
    struct mavlink_vehicle_conf vehicle;
    struct mavlink_obstacle_conf obstacles;
    struct mavlink_network network;  /* whose frames may be believed */
    uint8_t component_id;            /* ours */
    struct mavlink_signing *signing; /* NULL: frames are not signed */
};

/* Now: CLOCK_MONOTONIC, and what CLOCK_REALTIME is ahead of it. */
struct mavlink_time {
    uint64_t now_ns, unix_offset_ns;
};

/* Reads both clocks, as at one moment. */
typedef struct mavlink_time mavlink_now_fn(void);

struct mavlink_bridge;

/** mavlink_bridge_new - over `link`, which was initialised; both live as long as the bridge. NULL without memory. */
struct mavlink_bridge *mavlink_bridge_new(const struct mavlink_bridge_conf *conf, struct mavlink_link *link,
                                          uint64_t now_ns);

/**
 * mavlink_bridge_work - do what is due and take what has come. Connections that are lost, or not there yet, are tried
 * again for ever. Tells what changes on standard error.
 */
void mavlink_bridge_work(struct mavlink_bridge *b, mavlink_now_fn *now);

/** mavlink_bridge_wait - what to poll for before the next mavlink_bridge_work; returns when that is due at the latest.
 */
uint64_t mavlink_bridge_wait(const struct mavlink_bridge *b, struct pollfd fds[MAVLINK_BRIDGE_FDS]);

/** mavlink_bridge_end - tell what was counted on standard error, close the link, free the bridge. */
void mavlink_bridge_end(struct mavlink_bridge *b);

#endif
