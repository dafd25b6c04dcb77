/* SPDX-License-Identifier: MIT */
/*
 * run - one drive of a vehicle through a world, by the answers of the daemon in virtual time: its pings go through the
 * daemon's own pipeline, its poses into the daemon's log, and the law of examples/autopilot.c asks the daemon's
 * methods as a client does, and never goes faster than `limit` says.
 *
 * The vehicle has a lag, overshoots, and is carried along by a current. Where its poses carry a velocity it steers
 * over ground, else through the water. Its heading is kept by a compass.
 */
#ifndef SONARD_PILOT_RUN_H
#define SONARD_PILOT_RUN_H

#include "sonars.h"

enum pilot_nav {
    PILOT_POSITION, /* position, velocity, attitude, depth */
    PILOT_VELOCITY, /* velocity, attitude, depth */
    PILOT_ATTITUDE, /* attitude, depth */
    PILOT_NAVS,
};

extern const char *const pilot_nav_name[PILOT_NAVS];

struct pilot_case {
    enum pilot_place place;
    enum pilot_sonar sonar;
    enum pilot_nav nav;
    bool chart;    /* the pilot has a chart of what stands still; otherwise it makes straight for the goal */
    bool heedless; /* it goes as fast as it wants to */
    bool faults;   /* one ping in twenty is lost, the sonar for 4 s at times, and so are poses for 1.5 s */
    double current_mps;
    double near_m;    /* [vehicle] near; 0: auto. Nothing nearer stands at the start then: that is its promise */
    double limit_s;   /* the drive ends after so long */
    const char *conf; /* more of the configuration; NULL: nothing */
    uint64_t seed;
};

enum pilot_held { PILOT_GOING, PILOT_UNKNOWN, PILOT_BLOCKED };

#define PILOT_REASONS     12
#define PILOT_REASON_SIZE 64

struct pilot_result {
    bool arrived, collided;
    double time_s, known_s; /* from the first command; of a pilot who knows the world, at the same speed */
    double touched_mps; /* fastest that the vehicle went over ground when it touched something; negative: never */
    double touched_s;   /* when that was */
    double nearest_m;   /* least clearance of all */
    double share[3];    /* of the time, by enum pilot_held: what makes it slower than half of what was wanted */
    struct {
        char text[PILOT_REASON_SIZE];
        long n;
    } reason[PILOT_REASONS];          /* why it was unknown */
    char last[2 * PILOT_REASON_SIZE]; /* the whole reason of the last answer */
};

#define PILOT_TRACK_MAX 4096

struct pilot_track {
    struct {
        float x_m, y_m;
        uint8_t held;
    } at[PILOT_TRACK_MAX];
    int n;
};

extern const struct pilot_hull pilot_hull;

/** pilot_free_m - so far nothing stands from the hull when a drive starts. */
double pilot_free_m(const struct pilot_case *c);

/** pilot_run - false: there is no way to the goal in that world. track may be NULL. */
bool pilot_run(const struct pilot_case *c, struct pilot_result *result, struct pilot_track *track);

/** pilot_name - a line that says which drive it was. */
const char *pilot_name(const struct pilot_case *c, char text[128]);

/** pilot_draw_case - drive `number` of a seed: what, where and with what is drawn. */
void pilot_draw_case(uint64_t seed, unsigned number, struct pilot_case *c);

#endif
