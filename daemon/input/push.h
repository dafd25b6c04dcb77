/* SPDX-License-Identifier: MIT */
/*
 * push - which way a vehicle's thrusters push it, as a client tells. It says where the vehicle means to go, not where
 * it goes: it guides where a head looks, and no answer rests on it. One owner (the loop).
 */
#ifndef SONARD_PUSH_H
#define SONARD_PUSH_H

#include <stdbool.h>
#include <stdint.h>

#define PUSH_MEAN_S  1.0         /* of the average: what holds a vehicle in place pushes to and fro */
#define PUSH_LEAST_N 1.0         /* less is no way: drives a BlueROV2 no faster than 0.1 m/s */
#define PUSH_HOLD_NS 3000000000u /* it still goes that way */

/* Zeroed at first. */
struct push {
    uint64_t t_ns;      /* of the newest */
    double mean_n[2];   /* forward, right */
    uint64_t drives_ns; /* when it pushed somewhere last; 0: never */
    double way_n[2];    /* likewise, then */
};

/** push_put - n newtons forward and to the right at t_ns; one that is older than the last is left out. */
void push_put(struct push *push, uint64_t t_ns, const double n[2]);

/** push_way - level, in the body's axes: forward, right, 0; of any length. False: nobody says, or nowhere. */
bool push_way(const struct push *push, uint64_t now_ns, double way[3]);

#endif
