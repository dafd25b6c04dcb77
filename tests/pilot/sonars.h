/* SPDX-License-Identifier: MIT */
/*
 * sonars - the virtual sonars of a vehicle that is steered: two turning heads with the sound of tests/sound/water.h,
 * a fan that picks ranges itself, and a matrix of beams that does so up to 44 degrees above and below. Pings are made
 * as their devices make them.
 */
#ifndef SONARD_PILOT_SONARS_H
#define SONARD_PILOT_SONARS_H

#include "grid/ping.h"
#include "tests/water/places.h"

enum pilot_sonar { PILOT_PING360, PILOT_MICRON, PILOT_FAN, PILOT_MATRIX, PILOT_SONARS };

extern const char *const pilot_sonar_name[PILOT_SONARS];

/** pilot_sonar_conf - its sections of the configuration. */
const char *pilot_sonar_conf(enum pilot_sonar sonar);

/**
 * pilot_sonar_near_m - [vehicle] near that `sonard --check` wants for it, with the vehicle of run.c; 0: none, since it
 * looks up and down.
 */
double pilot_sonar_near_m(enum pilot_sonar sonar);

/** pilot_sonar_period_ns - from one ping to the next. pilot_sonar_turn_s - until all has been pinged once. */
uint64_t pilot_sonar_period_ns(enum pilot_sonar sonar);
double pilot_sonar_turn_s(enum pilot_sonar sonar);

/** pilot_sonar_turn_units - of a head's turn. */
uint32_t pilot_sonar_turn_units(enum pilot_sonar sonar);

/* A ping: in which world, when, from where. */
struct pilot_shot {
    const struct place *world;
    uint64_t seed;
    const struct mount *mount; /* of the sonar, on a level vehicle that is ... */
    double place_m[3], heading_rad;
    double t_s;      /* of the world */
    uint32_t number; /* from 1 */
    double stray;    /* so many of the beams hear another sonar: [0, 1] */
    bool
        aimed; /* a head was sent to head_units, and listens as far as range_m; otherwise it goes round by itself */
    uint32_t head_units;
    double range_m;
    bool new_turn;
};

/** pilot_sonar_points_at - is something of that radius and place (north, east) in the ping's beams, by its bearing? */
bool pilot_sonar_points_at(enum pilot_sonar sonar, const struct pilot_shot *shot, const double at_m[2],
                           double radius_m);

/** pilot_sonar_hear - what the ping holds but its time and pose. */
void pilot_sonar_hear(enum pilot_sonar sonar, const struct pilot_shot *shot, struct ping *ping);

#endif
