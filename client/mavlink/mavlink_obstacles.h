/* SPDX-License-Identifier: MIT */
/*
 * mavlink_obstacles - results of the daemon's `sectors` as messages to an autopilot: OBSTACLE_DISTANCE and
 * OBSTACLE_DISTANCE_3D. Pure; knows no socket and no link.
 *
 * Receivers disagree whether an element's angle is the middle of its sector or its edge, so an obstacle counts in the
 * sectors beside its own too. An obstacle is never reported farther than it is, and never nearer than 1 cm: 0 is
 * ignored by some.
 */
#ifndef SONARD_MAVLINK_OBSTACLES_H
#define SONARD_MAVLINK_OBSTACLES_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "mavlink_messages.h"

#define MAVLINK_FACES   8      /* of 45 degrees, in which receivers keep one 3D point each */
#define MAVLINK_REACH_M 655.33 /* further away no element can say */

enum mavlink_sector_state { MAVLINK_SECTOR_UNKNOWN, MAVLINK_SECTOR_CLEAR, MAVLINK_SECTOR_BLOCKED };

struct mavlink_sector {
    enum mavlink_sector_state state;
    double range_m; /* blocked only */
    double free_to_m;
};

/* Sector k is centred on k * 5 degrees. All zeros is the ring of which nothing is known. */
struct mavlink_ring {
    struct mavlink_sector sector[MAVLINK_SECTORS];
    double near_m;     /* water nearer than this is the vehicle's own; 0: none is */
    double youngest_s; /* age of the newest evidence in it; negative: there is none */
    double t_unix;     /* the daemon's clock when it answered */
};

enum mavlink_unknown { MAVLINK_UNKNOWN_AS_UNKNOWN, MAVLINK_UNKNOWN_AS_FAR, MAVLINK_UNKNOWN_AS_DISTANCE };

struct mavlink_obstacle_conf {
    enum mavlink_unknown unknown_as;
    double unknown_m; /* for MAVLINK_UNKNOWN_AS_DISTANCE */
    bool north;       /* azimuth 0 is north instead of forward */
};

/**
 * mavlink_ring_read - from a result of `sectors` with count 72; false, *ring as it was, when it is none. An element has
 * no word for water that is free only farther out, and a vehicle goes through the nearer first: a sector's water is
 * free only if it is known from near_m on. Its obstacle stands all the same.
 */
bool mavlink_ring_read(struct mavlink_ring *ring, const json_t *result);

/** mavlink_ring_forget - nothing is known any more. */
void mavlink_ring_forget(struct mavlink_ring *ring);

/** mavlink_ring_doubt - no water is known to be free any more; obstacles stay. */
void mavlink_ring_doubt(struct mavlink_ring *ring);

/** mavlink_ring_known - is anything known: an obstacle, or water that is free? */
bool mavlink_ring_known(const struct mavlink_ring *ring);

/**
 * mavlink_ring_distances - the message; max_m is how far "nothing seen" reaches, time_usec the time of the evidence in
 * the receiver's clock. min_distance is near_m, or where the nearest element is, so that none is ignored. An obstacle
 * beyond max_m is left out where the water is free up to there, and stands at max_m otherwise.
 */
void mavlink_ring_distances(const struct mavlink_ring *ring, const struct mavlink_obstacle_conf *conf,
                            double max_m, uint64_t time_usec, struct mavlink_obstacle_distance *out);

/**
 * mavlink_ring_points - the nearest obstacle of each face of 45 degrees as a point in the middle of its sector, at
 * elevation_rad (positive upward); returns how many of out[] are set.
 */
int mavlink_ring_points(const struct mavlink_ring *ring, const struct mavlink_obstacle_conf *conf,
                        double elevation_rad, double max_m, uint32_t time_boot_ms,
                        struct mavlink_obstacle_distance_3d out[MAVLINK_FACES]);

/** mavlink_centimetres - rounded down, within [1, most]; 1 for what is not a number. */
uint16_t mavlink_centimetres(double m, uint16_t most);

#endif
