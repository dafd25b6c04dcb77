/* SPDX-License-Identifier: MIT */
/*
 * steer - for heads that are steered: when there is time to leave the plain scan for a pass over what it is steered to,
 * and when the head has been all around. Knows no device.
 */
#ifndef SONARD_STEER_H
#define SONARD_STEER_H

#include <stdbool.h>
#include <stdint.h>

#define STEER_ARCS_MAX 6400

/* The plain scan's present circle. */
struct steer {
    uint64_t circle_ns; /* within which it shall be done; 0: no such time */
    uint64_t started_ns;
    unsigned pings; /* since then, those of passes among them */
    /* of a ping in the circle before, the head's way to passes and back in it; 0: there was none */
    double pace_ns;
};

/** steer_begin - a circle begins. steer_ping - a ping of it came. */
void steer_begin(struct steer *s, uint64_t now_ns);
void steer_ping(struct steer *s);

/**
 * steer_has_time - may a pass of `pass` pings begin, `plain` pings of the plain scan after the one before? Passes keep
 * an even distance: so far from each other that a plain turn of `turn` pings and all passes in it take no longer than
 * the circle shall, at the pace so far, and never more than half of the pings.
 */
bool steer_has_time(const struct steer *s, unsigned plain, unsigned pass, unsigned turn, uint64_t now_ns);

/* The arcs, a step long, that pings came from since a turn began, whatever their order. Arcs, not angles: those of a
 * pass need not be the plain scan's. */
struct steer_seen {
    uint64_t arcs[STEER_ARCS_MAX / 64];
    uint16_t n;
};

/** steer_seen_add - a ping from `angle` of `turn`. True: a new turn begins with it, all of the circle was seen. */
bool steer_seen_add(struct steer_seen *seen, unsigned angle, unsigned step, unsigned turn);

#endif
