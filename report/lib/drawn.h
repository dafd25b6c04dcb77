/* SPDX-License-Identifier: MIT */
/*
 * drawn - worlds whose physics is drawn at random from wide ranges: a head and its receiver, what stands in the
 * water, what else makes sound. Nothing in it is tuned to any detector. Knows no samples and no detector.
 *
 * Levels are decibels of power at the receiver's output, 0 being full scale. The reference is a plane wall seen
 * nearly square on; each class of targets has a reference strength below that, at the same range.
 */
#ifndef SONARD_REPORT_DRAWN_H
#define SONARD_REPORT_DRAWN_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "grid/ping.h"

#define DRAWN_MAX_BINS    1200
#define DRAWN_MAX_BEAMS   64 /* of a ping */
#define DRAWN_MAX_TARGETS 16
#define DRAWN_MAX_PLANES  3
#define DRAWN_MAX_OTHERS  2
#define DRAWN_TURNS       3

enum drawn_class { DRAWN_WALL, DRAWN_PILE, DRAWN_NET, DRAWN_LINE, DRAWN_CLASSES };

extern const char *const drawn_class_name[DRAWN_CLASSES];

/* What stands upright in the water, from top to bottom. Walls and nets reach from a to b, piles and lines stand at
 * a. */
struct drawn_target {
    enum drawn_class class;
    double a_m[2], b_m[2]; /* north, east */
    double strength_db;    /* against a wall at the same range, seen square on */
    double coherent;       /* share of the power that comes back in one piece; the rest is speckle */
};

/* The surface (depth below 0), a level bottom or a slope of mud: soft, seen at grazing angles, without an edge. */
struct drawn_plane {
    double depth_m;           /* below the head where it stands at first */
    double slope_rad, az_rad; /* rises towards az_rad */
    double strength_db;       /* against a wall, were it seen square on */
};

/* A sonar with its own timing. */
struct drawn_other {
    double az_rad, period_s, phase_s, length_m, level_db;
    double
        late_s; /* mean lateness of each of its pings, which puts off all later ones: its host asks; 0: its clock */
};

struct drawn_world {
    uint64_t seed;
    unsigned number;

    /* the head */
    const char *head;
    uint32_t beams, pings, turn_units, step_units; /* of a ping; of a turn; a multibeam has turn_units = 0 */
    double beam_step_rad, az_aperture_rad, el_aperture_rad;
    uint32_t bins, pulse_bins;
    double range_m, pulse_m, ping_s;
    double asked_late_s,
        dated_late_s; /* mean of what the host adds to ping_s, and to the time of transmission it says */

    /* the receiver */
    enum amplitude_law law, told;
    double db_per_count;
    bool four_bit;
    double low, span; /* of four bits, in counts */
    double tvg_log, tvg_per_m, absorption, gain_db;
    double wall_db;            /* at a third of the range */
    double noise_db;           /* at the range's end, raised by the same gain as an echo */
    double electronic_db;      /* behind that gain */
    double volume_db;          /* reverberation of the water at a third of the range; it falls as a wall does */
    double stray_share;        /* of bins that hold a stray count */
    double side_lobe_db;       /* two ways, against the axis */
    double multipath_db;       /* of a second bounce against the first */
    int texture;               /* shape of K-distributed speckle; 0: Rayleigh */
    double ring_m, ring_shape; /* the ring-down ends about there */
    double ripple_db, ripple_m, ripple_phase;
    double ring_speckle; /* deviation of its pressure from ping to ping, a share */
    unsigned dead_bins;  /* that are zero before the receiver is on */
    double lost_share, dead_share, raised_share,
        raised_db; /* of pings: do not come; are zero; have a raised noise */

    /* the water */
    unsigned targets, planes, others;
    struct drawn_target target[DRAWN_MAX_TARGETS];
    struct drawn_plane plane[DRAWN_MAX_PLANES];
    struct drawn_other other[DRAWN_MAX_OTHERS];
    bool frame; /* the vehicle's own parts are in some beams */
    double frame_az_rad, frame_half_rad, frame_m, frame_db, shadow_db;
    bool posed; /* the vehicle knows its pose */
    double velocity_mps[2];
};

/** drawn_world_of - world `number` of a seed. */
struct drawn_world drawn_world_of(uint64_t seed, unsigned number);

/** drawn_gain_db - of the receiver at a range, against that at a third of it. */
double drawn_gain_db(const struct drawn_world *world, double range_m);

/** drawn_wall_db - what a wall that is seen square on returns. */
double drawn_wall_db(const struct drawn_world *world, double range_m);

/** drawn_reference_db - what the reference target of a class returns. */
double drawn_reference_db(const struct drawn_world *world, enum drawn_class class, double range_m);

/** drawn_count - what the receiver sends for a power, 1 being full scale. */
uint8_t drawn_count(const struct drawn_world *world, double power);

/** drawn_power_above - the least power that gives more than `count`; INFINITY: none does. */
double drawn_power_above(const struct drawn_world *world, uint8_t count);

/** drawn_world_print - in one line. */
void drawn_world_print(FILE *out, const struct drawn_world *world);

#endif
