/* SPDX-License-Identifier: MIT */
/*
 * ping360_scan - where a Ping360's head shall go next, and what the angles received from it say: a new sweep, missing
 * pings. Angles are gradians 0..399, clockwise seen from above, 200 ahead. Sends nothing.
 */
#ifndef SONARD_PING360_SCAN_H
#define SONARD_PING360_SCAN_H

#include <stdbool.h>
#include <stdint.h>

#include "ping_frame.h"
#include "steer.h"

#define PING360_TURN          400 /* gradians */
#define PING360_AHEAD         200 /* head angle along the sensor's x axis; 0 is the cable side */
#define PING360_ANGLE_UNKNOWN UINT16_MAX

/* The order of angles in a sector (back and forth) or a full circle (round and round). */
struct ping360_scan {
    uint16_t first;       /* gradian where the sector begins */
    uint16_t step;        /* gradians, 1..200 */
    uint16_t positions;   /* angles in the sector; 0: full circle */
    uint16_t at;          /* position in the sector, or gradians behind `first` in a circle */
    bool backward;        /* on the way back through the sector */
    uint16_t steer_first; /* gradians in between are passed over after as many others; see ping360_scan_steer */
    uint16_t steer_n;     /* angles of a pass, a step apart; 0: it is not steered */
    uint16_t pass_left;   /* angles of the present pass; 0: the plain scan goes on */
    uint16_t pass_angle;  /* whose turn it is in the pass */
    bool pass_backward;   /* it began at the end, which was nearer */
    bool only;            /* pass after pass, and nothing of the plain scan */
    uint16_t plain;       /* angles of the plain scan since the last pass */
    struct steer steer;   /* circle_ns may be set after ping360_scan_init */
    bool by_itself;       /* the head can do this scan without being asked for every ping ... */
    struct ping360_sweep sweep; /* ... told so */
};

/**
 * ping360_scan_init - clockwise from start to end (azimuths in the sensor frame, radians); equal, or a turn apart:
 * full circle. All is rounded to gradians; a step below 1 is 1. The head's own scan goes by 1..10 gradians and not
 * across gradian 0, except in full circles.
 */
void ping360_scan_init(struct ping360_scan *scan, double start_rad, double end_rad, double step_rad);

/** ping360_scan_angle - the angle whose turn it is. */
uint16_t ping360_scan_angle(const struct ping360_scan *scan);

/** ping360_scan_advance - there was a ping, on to the next; the ends of a sector are not repeated. */
void ping360_scan_advance(struct ping360_scan *scan, uint64_t now_ns);

/**
 * ping360_scan_steer - in a full circle: pass over the azimuths from `from_rad` clockwise to `to_rad` (less than a
 * turn) after every so many angles of the plain scan as a pass has. That goes on where it was, so that all of the
 * circle is covered in twice as many pings, or sooner where steer.circle_ns says so. Equal: the plain scan alone. A
 * pass that has started is finished as it is. only: the plain scan waits where it is, and passes follow each other to
 * and fro; the next begins at the nearer end.
 */
void ping360_scan_steer(struct ping360_scan *scan, double from_rad, double to_rad, bool only);

/** ping360_scan_is_alone - it is in one of the passes that follow each other. */
bool ping360_scan_is_alone(const struct ping360_scan *scan);

/** ping360_angle_to - the shorter way between two angles, -200 < way <= 200 gradians, clockwise positive. */
int ping360_angle_to(uint16_t from, uint16_t to);

/* What the head last reported to do. */
struct ping360_track {
    uint16_t head;              /* last angle, or PING360_ANGLE_UNKNOWN */
    int travel;                 /* gradians since the sweep or turn began, > 0 clockwise */
    struct ping360_sweep sweep; /* of the last frame; step 0: it was not sent by the head itself */
};

void ping360_track_reset(struct ping360_track *track);

/**
 * ping360_track_follow - the head sent `data` (angle 0..399). True when a new sweep begins with it: the head has
 * reversed, or has done a whole turn since the last one began. *missing: pings of the head's own scan that should
 * have come in between; 0 where its settings have changed.
 */
bool ping360_track_follow(struct ping360_track *track, const struct ping360_data *data, unsigned *missing);

#endif
