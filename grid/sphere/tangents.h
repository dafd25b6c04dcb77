/* SPDX-License-Identifier: MIT */
/*
 * tangents - tangential clusters: echoes along a scan whose neighbours lie in the same line form a wall (Mandelbaum
 * and Mintz 1994, after Auran and Silven 1996, 2.1), two walls that meet form a corner, and what lies parallel behind
 * a wall at the distance between it and the wall opposite may be its ghost. In the plane of the scan. Pure.
 */
#ifndef SONARD_TANGENTS_H
#define SONARD_TANGENTS_H

#include <stdbool.h>
#include <stdint.h>

#define TANGENTS_MAX  2048 /* points of a turn */
#define TANGENTS_NONE UINT32_MAX

struct tangent_point {
    double x_m, y_m; /* forward, right; NaN: no echo on this bearing */
};

struct tangents_conf {
    uint32_t neighbours; /* points that say how a point's line runs, itself included; odd, >= 3 */
    double angle_rad;    /* tangents that differ by less, and ... */
    double offset_m;     /* ... whose lines lie so near each other, hang together ... */
    double offset_share; /* ... and this share of the nearer one's range beside it; so do points off their wall */
    double reach_m;      /* a neighbour farther off than this from its point says nothing about it ... */
    double reach_share;  /* ... unless that is less than this share of the point's range */
    uint32_t least_n;    /* points of a wall, >= 2 */
    double straight_m;   /* rms off its line at most, offset_share of the range beside it */
};

/* Points p with p . (cos normal, sin normal) = distance, between two bearings. */
struct wall {
    double normal_rad; /* azimuth of its nearest place, [0, 2pi) */
    double distance_m;
    double rms_m; /* of its points off the line */
    uint32_t points;
    double from_m, to_m; /* along the line, rightward as seen from the scanner, 0 at the nearest place */
};

/**
 * tangents_walls - the walls of n points in order of bearing around a whole turn (n <= TANGENTS_MAX), most points
 * first; returns how many, `room` at most: those of the largest tangential clusters. of[i]: which wall point i
 * belongs to, or TANGENTS_NONE. A line through the scanner itself is none. O(n^2).
 */
uint32_t tangents_walls(const struct tangents_conf *conf, const struct tangent_point *points, uint32_t n,
                        struct wall *wall, uint32_t room, uint32_t *of);

/**
 * tangents_corner - where two walls meet; false: they are near parallel, or an end of either lies more than gap_m and
 * more than gap_rad of bearing short of it, or more than gap_m and half its range.
 */
bool tangents_corner(const struct wall *a, const struct wall *b, double gap_m, double gap_rad,
                     struct tangent_point *place);

/**
 * tangents_ghost - may an echo at (azimuth, range) be sound that was at walls[w] and ran once more: to a wall opposite
 * and back past the sonar (at the wall's distance plus that between the two), or to the vehicle itself (at twice the
 * wall's distance), within off_rad of its normal, give or take `within_m`? Returns w, or TANGENTS_NONE. A suspicion
 * only: something may well stand there.
 */
uint32_t tangents_ghost(const struct wall *walls, uint32_t n, double az_rad, double range_m, double off_rad,
                        double within_m);

#endif
