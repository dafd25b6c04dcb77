/* SPDX-License-Identifier: MIT */
/*
 * run - one drive of a vehicle through a world, by the answers of the daemon in virtual time: its pings go through the
 * daemon's own pipeline, its poses into the daemon's log, and the law of examples/autopilot.c asks the daemon's
 * methods as a client does, and never goes faster than `limit` says.
 *
 * Where the vehicle's poses carry a velocity it steers over ground, else through the water. Its heading is kept by a
 * compass. With attitude and depth alone it is a BlueROV2 in six degrees of freedom (rover.h): its thrusters bound its
 * speed, `current` is promised, and a head looks where they push (`scan = auto`).
 */
#ifndef SONARD_PILOT_RUN_H
#define SONARD_PILOT_RUN_H

#include "route.h"
#include "sonars.h"
#include "vehicle.h"

enum pilot_nav {
    PILOT_POSITION, /* position, velocity, attitude, depth */
    PILOT_VELOCITY, /* velocity, attitude, depth */
    PILOT_ATTITUDE, /* attitude, depth, and the bound of the speed that sonard-mavlink has from the thrusters */
    PILOT_NAVS,
};

extern const char *const pilot_nav_name[PILOT_NAVS];

/* What the configuration says beyond sonars, body and braking. */
enum pilot_setup {
    PILOT_BARE,  /* nothing: near = auto, directions over the whole sphere */
    PILOT_NEAR,  /* near as --check wants it. Nothing nearer stands at the start then: that is its promise */
    PILOT_LEVEL, /* and elevation = level, as config/scenes/bluerov2-ping360.conf */
    PILOT_SETUPS,
};

extern const char *const pilot_setup_name[PILOT_SETUPS];

enum pilot_fault {
    PILOT_SOUND,    /* none */
    PILOT_NO_PINGS, /* one in ten is lost */
    PILOT_NO_SONAR, /* silent for 4 s at times */
    PILOT_NO_POSES, /* none for 2.5 s at times */
    PILOT_NO_SPEED, /* poses carry no velocity for 4 s at times */
    PILOT_JUMP,     /* the origin of positions moves by 2 m, once */
    PILOT_STRAY,    /* another sonar is heard in one beam in fifty */
    PILOT_FAULTS,
};

extern const char *const pilot_fault_name[PILOT_FAULTS];

struct pilot_case {
    enum pilot_place place;
    enum pilot_sonar sonar;
    enum pilot_nav nav;
    enum pilot_setup setup;
    enum pilot_fault fault;
    bool chart;    /* the pilot has a chart of what stands still; otherwise it makes straight for the goal */
    bool heedless; /* it goes as fast as it wants to */
    double current_mps;
    double poor;          /* instruments: 0..1, of what is allowed for */
    double limit_s;       /* the drive ends after so long; 0: 4 times that of a pilot who knows the world */
    bool trace;           /* show what is asked and answered */
    const char *question; /* a line of JSON-RPC that is asked, too, at question_s; NULL: none */
    double question_s;
    const char *conf; /* more of the configuration; NULL: nothing */
    uint64_t seed;
};

enum pilot_held { PILOT_GOING, PILOT_UNKNOWN, PILOT_BLOCKED };

#define PILOT_REASONS     12
#define PILOT_REASON_SIZE 64

struct pilot_result {
    bool arrived, collided; /* with what stands still */
    bool struck;            /* at more than `slow`, but by a diver, who moves between two pings of a head, ... */
    double unseen_s;        /* ... and was last in a beam so long ago */
    double time_s, known_s; /* from the first command; of a pilot who knows the world, at the same speed */
    double touched_mps; /* fastest that the vehicle went over ground when it touched something; negative: never */
    double end_s;       /* when it ended, on the clock of the world */
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

extern const struct place_hull pilot_hull;

/** pilot_free_m - so far nothing stands from the hull when a drive starts. */
double pilot_free_m(const struct pilot_case *c);

/** pilot_run - false: there is no way to the goal in that world. track may be NULL. */
bool pilot_run(const struct pilot_case *c, struct pilot_result *result, struct pilot_track *track);

#define PILOT_NAME_SIZE 160

/** pilot_name - a line that says which drive it was. */
const char *pilot_name(const struct pilot_case *c, char text[PILOT_NAME_SIZE]);

/** pilot_draw_case - drive `number` of a seed: what, where and with what is drawn. */
void pilot_draw_case(uint64_t seed, unsigned number, struct pilot_case *c);

#endif
