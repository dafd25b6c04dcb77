/* SPDX-License-Identifier: MIT */
/*
 * surveyor - the messages of the Cerulean Surveyor 240 multibeam sonar, and its points as a ping of many beams. Keeps
 * no state. The device itself is device_surveyor of device.h (surveyor_device.c); of the configuration it takes:
 *
 *   range            1 .. 200 m
 *   gain             0 .. 10; -1: the sonar chooses
 *
 * Each ping is a list of points, an angle across the swath and a time of flight (atof) or a place (yz): what the sonar
 * has detected. Angles with no detection are not in the list, so nothing is said about them. The sensor frame has the
 * middle of the swath along x and the angles in the plane of x and y: looking down, the mount's rotation is 0 -90 0.
 * The sonar's own axes are x forward, y to port, z up, and its angles are positive to port: both are turned round here.
 * Source: Cerulean Sonar's pages ATOF_POINT_DATA, YZ_POINT_DATA and SET_PING_PARAMETERS, and the public definition of
 * the Ping protocol.
 */
#ifndef SONARD_SURVEYOR_H
#define SONARD_SURVEYOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/ping.h"
#include "ping_frame.h"

#define SURVEYOR_POINTS_MAX PING_MAX_BEAMS
#define SURVEYOR_DEAF       0.05 /* of its end range: nearer the sonar records nothing, whatever start it is set to */

enum surveyor_message {
    SURVEYOR_ATTITUDE = 504,
    SURVEYOR_SET_PING_PARAMETERS = 3023,
};

/* set_ping_parameters. */
struct surveyor_settings {
    int32_t start_mm, end_mm;
    float sound_speed_mps;
    int16_t gain; /* -1: the sonar chooses */
    int16_t interval_ms;
    bool ping, atof, yz; /* transmit at all; send atof_point_data, yz_point_data */
    uint16_t n_steps;    /* 200 .. 800 over the range */
};

/* atof_point_data or yz_point_data. */
struct surveyor_points {
    bool atof;
    uint32_t ping_number; /* atof only, as the three below */
    uint32_t power_up_ms; /* the sonar's own clock */
    double listening_s, pulse_s;
    double start_m, end_m;  /* yz only: where the sonar begins and ends to record echoes; 0, 0: it does not say */
    unsigned n;             /* points that are there, at most SURVEYOR_POINTS_MAX */
    const uint8_t *records; /* n of them */
};

/** surveyor_encode_settings - the whole frame from the host; its length, or 0 when `size` has no room. */
size_t surveyor_encode_settings(uint8_t *out, size_t size, const struct surveyor_settings *set);

/** surveyor_decode_settings - the same message, as the sonar reads it. */
bool surveyor_decode_settings(const struct ping_frame *f, struct surveyor_settings *out);

/**
 * surveyor_decode_points - both kinds of points. False: another message, too short for its head, more than
 * SURVEYOR_POINTS_MAX points, or times that cannot be. Points that the frame has no room for are left out.
 */
bool surveyor_decode_points(const struct ping_frame *f, struct surveyor_points *out);

/** surveyor_encode_atof - what a sonar of id `src` says: n points of {angle rad to port, time of flight s}. */
size_t surveyor_encode_atof(uint8_t *out, size_t size, uint8_t src, const struct surveyor_points *head,
                            float sound_speed_mps, const float (*point)[2]);

/** surveyor_encode_yz - the same as n points of {y to port, z up} in metres, with start_m and end_m of the head. */
size_t surveyor_encode_yz(uint8_t *out, size_t size, uint8_t src, const struct surveyor_points *head,
                          const float (*point)[2]);

/** surveyor_end_m - how far the sonar listened. */
double surveyor_end_m(const struct surveyor_points *points, double sound_speed_mps);

/**
 * surveyor_fill_ping - the points as a ping of ready ranges, each a beam; those that make no sense are left out.
 * One bin without samples spans what was listened to: from the larger of start_m, what the sonar is known to be set to,
 * and SURVEYOR_DEAF of the end, as the sonar has it.
 * Everything but flags, seq, sensor and pose is set; n_beams may be 0.
 */
void surveyor_fill_ping(struct ping *ping, const struct ping_frame *frame, const struct surveyor_points *points,
                        double start_m, double sound_speed_mps);

#endif
