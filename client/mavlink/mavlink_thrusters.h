/* SPDX-License-Identifier: MIT */
/*
 * mavlink_thrusters - what ArduSub's messages tell of the thrusters: which output drives which motor of which frame,
 * and what pulses it gets; and the bound of the vehicle's speed that follows from it (speed_bound.h). A state machine:
 * messages and their times go in, the bound comes out, or why there is none. Times are CLOCK_MONOTONIC nanoseconds of
 * this computer.
 */
#ifndef SONARD_MAVLINK_THRUSTERS_H
#define SONARD_MAVLINK_THRUSTERS_H

#include <stdbool.h>
#include <stdint.h>

#include "mavlink_messages.h"
#include "speed_bound.h"

/* Between two samples that are no farther apart, the thrusters did as one or the other says. */
#define MAVLINK_THRUSTERS_GAP_NS 200000000u

/* FRAME_CONFIG, MOT_n_DIRECTION, SERVOn_FUNCTION */
#define MAVLINK_THRUSTERS_PARAMS (1 + THRUST_MOTORS + MAVLINK_SERVOS)

enum mavlink_no_bound {
    MAVLINK_BOUND, /* there is one */
    MAVLINK_NO_MESSAGES,
    MAVLINK_NO_RATE, /* they come, and too seldom */
    MAVLINK_NO_PARAMETERS,
    MAVLINK_NO_FRAME,
    MAVLINK_NO_MOTORS,
    MAVLINK_NO_STICKS,
    MAVLINK_NO_PULSES,
    MAVLINK_NO_CLOCK,
    MAVLINK_NO_VEHICLE, /* that has thrusters of which anything is known */
};

/* As the method `pose` has them. */
extern const char *const mavlink_no_bound_words[];

struct mavlink_thrusters_conf {
    struct speed_bound_conf drag;
    double volts; /* of a full battery; 0: THRUST_VOLTS */
};

struct mavlink_thrusters_attitude {
    uint64_t t_ns;  /* 0: none */
    double down[3]; /* in the body's axes */
    double yaw_rad;
};

struct mavlink_thrusters {
    struct mavlink_thrusters_conf conf;
    bool submarine, armed;
    int param[MAVLINK_THRUSTERS_PARAMS];
    bool known[MAVLINK_THRUSTERS_PARAMS];
    int asked;                                          /* the parameter asked for last */
    struct mavlink_thrusters_attitude attitude, before; /* newest; that of the last sample */
    double climb_mps;                                   /* on the average of CLIMB_S */
    uint64_t climb_ns, climbs_ns;                       /* when it came last, and since when it does; 0: never */
    struct thrust_range thrust[THRUST_MOTORS];          /* of the last sample */
    uint64_t t_ns;                                      /* of it; 0: none, or what came before it is not known */
    uint64_t heard_ns;                                  /* when a sample came last, usable or not */
    unsigned in_second;                                 /* samples since mavlink_thrusters_slow was asked last */
    enum mavlink_no_bound why;
    bool fresh; /* a bound that nobody took */
    double mps[2];
    double push_n[2]; /* of the last sample, by the middle of the curves: forward and to the right */
    struct speed_bound bound;
};

void mavlink_thrusters_init(struct mavlink_thrusters *t, const struct mavlink_thrusters_conf *conf);

/** mavlink_thrusters_forget - another vehicle, or the same one that has started again. */
void mavlink_thrusters_forget(struct mavlink_thrusters *t);

/** mavlink_thrusters_lose - nothing of what was is known any more, for that reason; parameters stay. */
void mavlink_thrusters_lose(struct mavlink_thrusters *t, enum mavlink_no_bound why);

void mavlink_thrusters_heartbeat(struct mavlink_thrusters *t, const struct mavlink_heartbeat *m);
void mavlink_thrusters_param(struct mavlink_thrusters *t, const struct mavlink_param_value *m);

/** mavlink_thrusters_attitude - q: unit quaternion, body to NED. */
void mavlink_thrusters_attitude(struct mavlink_thrusters *t, const double q[4], uint64_t t_ns);

/** mavlink_thrusters_climb - upward, m/s, by the depth sensor; exactly 0 is no measurement. */
void mavlink_thrusters_climb(struct mavlink_thrusters *t, double mps, uint64_t now_ns);

/** mavlink_thrusters_climb_known - does it come, and has it for some seconds? */
bool mavlink_thrusters_climb_known(const struct mavlink_thrusters *t, uint64_t now_ns);

/** mavlink_thrusters_servo - pulses of t_ns that came at now_ns. */
void mavlink_thrusters_servo(struct mavlink_thrusters *t, const struct mavlink_servo_output_raw *m, uint64_t t_ns,
                             uint64_t now_ns);

/** mavlink_thrusters_take - a bound that was not taken yet: since the one before, until *t_ns, no faster than mps. */
bool mavlink_thrusters_take(struct mavlink_thrusters *t, uint64_t *t_ns, double mps[2]);

/** mavlink_thrusters_why - why there is no bound now; MAVLINK_BOUND: there is one. */
enum mavlink_no_bound mavlink_thrusters_why(const struct mavlink_thrusters *t, uint64_t now_ns);

/** mavlink_thrusters_ask - the name of a parameter to ask for now, into id, zeros behind; false: it is no submarine.
 * missing: only one that is not known. */
bool mavlink_thrusters_ask(struct mavlink_thrusters *t, bool missing, char id[MAVLINK_PARAM_ID]);

/** mavlink_thrusters_slow - once a second: came fewer samples in the last one than asked for? */
bool mavlink_thrusters_slow(struct mavlink_thrusters *t);

#endif
