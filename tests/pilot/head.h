/* SPDX-License-Identifier: MIT */
/*
 * head - a virtual head that is sent to single bearings, in the order of drivers/devices/ping360_scan.h, and steered
 * as daemon/steering.c does it. It starts with the whole circle, ahead.
 */
#ifndef SONARD_PILOT_HEAD_H
#define SONARD_PILOT_HEAD_H

#include "daemon/methods/environment.h"
#include "daemon/pipeline/active_sensing.h"
#include "drivers/devices/ping360_scan.h"

struct pilot_head {
    struct ping360_scan scan;
    struct next_look_features features;
    uint16_t angle; /* gradians of the last ping */
    bool backward;
};

/** pilot_head_start - from one ping to the next it turns by step_rad. */
void pilot_head_start(struct pilot_head *h, double step_rad);

/** pilot_head_ping - it pings at t_ns: the gradians from ahead, clockwise, and whether that begins a turn or a sweep.
 * Returns how many gradians it is to the next ping. */
int pilot_head_ping(struct pilot_head *h, uint64_t t_ns, uint32_t *gradians, bool *new_turn);

/** pilot_head_steer - to where it matters at t_ns; to be called every ACTIVE_SENSING_TICK_NS. d's first sonar is it. */
void pilot_head_steer(struct pilot_head *h, struct methods_env *d, uint64_t t_ns);

#endif
