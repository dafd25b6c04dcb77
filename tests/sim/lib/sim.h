/* SPDX-License-Identifier: MIT */
/*
 * sim - a virtual Ping360: the head in its water at the end of its line, the commands that make faults, and the
 * record of what was really there. The time is handed in, monotonic nanoseconds.
 */
#ifndef SONARD_SIM_SIM_H
#define SONARD_SIM_SIM_H

#include <stdio.h>

#include "head.h"
#include "line.h"
#include "tests/water/scene.h"
#include "tests/sound/water.h"

#define SIM_ANSWER_MAX 256

struct sim_pose {
    double position_m[3]; /* NED */
    double yaw_deg;
};

/* A bar of the vehicle's own frame: heard in every ping of some directions, wherever the vehicle is. Sound passes. */
struct sim_frame {
    double azimuth_deg, width_deg; /* from the bow; full width */
    double range_m;                /* near side; 0: no such bar */
};

/* What the receiver of a broken head sends. */
enum sim_hears {
    SIM_HEARS,
    SIM_HEARS_NOTHING,  /* the transducer is dead: noise of 2 to 4 counts, and no ring-down */
    SIM_HEARS_CONSTANT, /* the receiver is stuck: 7 counts */
    SIM_HEARS_ZEROS,
    SIM_HEARS_AIR,  /* the ring-down, and noise of 5 to 12 counts: the head is out of the water */
    SIM_HEARS_LEAK, /* the transducer's cable is off: the transmission itself, and that noise */
    SIM_HEARS_END
};

struct sim {
    struct place scene;
    struct water water;
    struct sim_frame frame;
    struct sim_pose pose; /* head angle 200 gradians looks ahead */
    struct head head;
    struct line line;
    enum sim_hears hears;
    FILE *truth;       /* one JSON object per ping; NULL: none */
    uint64_t start_ns; /* time 0 of the scene */
};

/** sim_start - a head that has just been switched on, at a line that must have been initialised before. */
void sim_start(struct sim *sim, const struct head_conf *conf, uint64_t now_ns);

/** sim_turn - take what the host sent, do what is due; returns when to call again. */
uint64_t sim_turn(struct sim *sim, uint64_t now_ns);

/**
 * sim_command - do one command ("drop 3"). answer gets one sentence without newline: "ok drop 3", or "error: ..." and
 * the return value false.
 */
bool sim_command(struct sim *sim, const char *command, uint64_t now_ns, char *answer, size_t answer_size);

/** sim_print_commands - the table of commands, for a person. */
void sim_print_commands(FILE *out);

/** sim_print_status - one line without newline. */
void sim_print_status(const struct sim *sim, FILE *out);

#endif
