/* SPDX-License-Identifier: MIT */
/*
 * thrust - which way the thrusters of a frame push, and how hard by the pulses that their controllers get: ArduSub's
 * frames (AP_Motors6DOF) and the Blue Robotics T200 (the maker's workbook of September 2019). Pure. Forces are
 * newtons in the body's axes: forward, right, down.
 */
#ifndef SONARD_MAVLINK_THRUST_H
#define SONARD_MAVLINK_THRUST_H

#include <stdbool.h>

#define THRUST_MOTORS 8

#define THRUST_PULSE_MIN 1100 /* microseconds: full reverse, ... */
#define THRUST_PULSE_MID 1500
#define THRUST_PULSE_MAX 1900 /* ... full ahead */

#define THRUST_VOLTS 16.8 /* a full battery of four lithium cells */

/* How far the thrust of a pulse may lie from the curve, by tolerance and wear. A battery that is not full makes all
 * thrusters weaker alike: less pushes the vehicle then, and what fights each other still does. */
#define THRUST_MOST  1.1
#define THRUST_LEAST 0.85

/* One motor that turns the way the autopilot calls positive. */
struct thrust_motor {
    double axis[3]; /* it pushes the body that way */
    double splay;   /* and this share of it any way along the level plane: how it is tilted is not known */
    bool strong;    /* that is the strong direction of its propeller; false: that or the other one, nobody knows */
};

struct thrust_frame {
    int n;
    struct thrust_motor motor[THRUST_MOTORS];
};

/* Between what one motor pushes, along its axis. */
struct thrust_range {
    double least_n, most_n;
};

/** thrust_frame - of FRAME_CONFIG; NULL: of an unknown frame. */
const struct thrust_frame *thrust_frame(int frame_config);

/** thrust_newtons - what the curve has for a pulse so far from the middle, at so many volts, in the propeller's strong
 * or weak direction. us: [0, 400]; volts: [10, 25]. */
double thrust_newtons(double us, double volts, bool strong);

/** thrust_range - between what a motor pushes by a pulse in [THRUST_PULSE_MIN, THRUST_PULSE_MAX]; direction: 1 or -1,
 * as MOT_n_DIRECTION. */
struct thrust_range thrust_range(const struct thrust_motor *motor, int pulse_us, int direction, double volts);

#endif
