/* SPDX-License-Identifier: MIT */
/*
 * mavlink_vehicle - the autopilot as its messages show it: whether it is there, what its clock says, and where the
 * vehicle is, put together from messages that each know a part. Pure: frames and the time of their arrival go in.
 * Times are CLOCK_MONOTONIC nanoseconds of this computer unless they are named boot.
 */
#ifndef SONARD_MAVLINK_VEHICLE_H
#define SONARD_MAVLINK_VEHICLE_H

#include <stdbool.h>
#include <stdint.h>

#include "mavlink_aiding.h"
#include "mavlink_barometer.h"
#include "mavlink_clock.h"
#include "mavlink_frame.h"
#include "mavlink_thrusters.h"

enum mavlink_pose_part {
    MAVLINK_POSE_ATTITUDE = 1,
    MAVLINK_POSE_POSITION = 2,
    MAVLINK_POSE_VELOCITY = 4,
    MAVLINK_POSE_DEPTH = 8,
    MAVLINK_POSE_ALTITUDE = 16,
    MAVLINK_POSE_BOUND = 32, /* alone */
};

struct mavlink_pose {
    uint64_t t_ns;
    unsigned has;         /* set of enum mavlink_pose_part */
    double quaternion[4]; /* w, x, y, z: FRD to NED */
    double position_m[3]; /* NED */
    double velocity_mps[3];
    double depth_m;
    double altitude_m;   /* above the bottom */
    double bound_mps[2]; /* level, and up or down: mavlink_thrusters_take ... */
    double push_n[2];    /* ... and with it which way they push, forward and to the right */
};

struct mavlink_vehicle_conf {
    uint8_t system_id;    /* of the vehicle; 0: that of the first heartbeat */
    int barometer;        /* whose depth to take: 1, 2, 3; MAVLINK_BAROMETER_ANY: find out */
    double surface_hpa;   /* pressure at the surface; 0: the first reading's, if air has it */
    double density_kgpm3; /* of the water */
    bool told_below;      /* the autopilot is sent ranges downward: what it says of the bottom may be those */
    struct mavlink_thrusters_conf thrusters;
};

struct mavlink_vehicle {
    struct mavlink_vehicle_conf conf;
    struct mavlink_clock clock;
    struct mavlink_barometers barometers;
    struct mavlink_aiding aiding;
    struct mavlink_thrusters thrusters;
    int told_surface; /* of this one it was said that its first reading is no surface */
    bool present;
    uint8_t system_id; /* of the vehicle last present, or the configured; 0: none yet */
    uint64_t heartbeat_ns, attitude_ns, position_ns; /* when last received; 0: never */
    struct mavlink_pose next;                        /* parts that came since the last pose */
    uint64_t due_ns;                                 /* the next pose not before */
    uint64_t t_pose_ns;                              /* of the last pose */
    uint64_t refused;                                /* messages with values that cannot be, or too old */
    uint64_t unaided;                                /* positions that nothing confirms as measured */
    uint64_t undated;                                /* messages left out while the clock is doubtful */
};

void mavlink_vehicle_init(struct mavlink_vehicle *vehicle, const struct mavlink_vehicle_conf *conf);

/** mavlink_vehicle_speaks - is that the heartbeat of an autopilot which may be the vehicle's? Changes nothing. */
bool mavlink_vehicle_speaks(const struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame);

/** mavlink_vehicle_moved - frames come from another computer: what the barometers showed may be another's. */
void mavlink_vehicle_moved(struct mavlink_vehicle *vehicle);

/**
 * mavlink_vehicle_take - a frame that arrived at now_ns. True when the vehicle's autopilot sent it; frames of other
 * systems and components change nothing.
 */
bool mavlink_vehicle_take(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns);

/** mavlink_vehicle_present - was its heartbeat received within five seconds? Forgets the clock of one that is gone. */
bool mavlink_vehicle_present(struct mavlink_vehicle *vehicle, uint64_t now_ns);

/**
 * mavlink_vehicle_pose - the parts that came since the last pose, at the time of the attitude: true at most 50 times
 * a second. Without attitude the other parts go out alone, after half a second. Positions and velocities that the
 * autopilot's estimator does not confirm are left out, and everything while its clock is doubtful. A depth by pressure
 * is left out while positions come, while it is not known which barometer is in the water, and while the surface is not
 * known. A range to the bottom is left out without an attitude, while the vehicle is tilted by more than 45 degrees,
 * and where the sensor says that it is none.
 */
bool mavlink_vehicle_pose(struct mavlink_vehicle *vehicle, uint64_t now_ns, struct mavlink_pose *out);

/** mavlink_vehicle_bound - the bound of its speed since the last one, as a pose of its own. False: none is new. */
bool mavlink_vehicle_bound(struct mavlink_vehicle *vehicle, struct mavlink_pose *out);

/**
 * mavlink_vehicle_depth_news - as mavlink_barometers_news, while the depth is taken from pressure: not while positions
 * come. Also that the first reading of the one that is used is no surface.
 */
bool mavlink_vehicle_depth_news(struct mavlink_vehicle *vehicle, uint64_t now_ns, char *text, size_t size);

/** mavlink_vehicle_depth_slow - as mavlink_barometers_slow, of a submarine whose depth is taken from pressure. */
int mavlink_vehicle_depth_slow(struct mavlink_vehicle *vehicle, uint64_t now_ns);

/** mavlink_vehicle_depth_doubtful - do two barometers in the water disagree, while the depth is taken from pressure? */
bool mavlink_vehicle_depth_doubtful(const struct mavlink_vehicle *vehicle, uint64_t now_ns);

#endif
