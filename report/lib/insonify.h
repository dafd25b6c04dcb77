/* SPDX-License-Identifier: MIT */
/*
 * insonify - the mean power that one beam of a drawn world brings back, bin by bin and cause by cause, before any
 * speckle; and what really stands in the beam. A reflector at r is heard from r to r + pulse: its power stands
 * here in the bin of r, and the pulse is yet to be summed over. Knows no noise of a single ping and no detector.
 */
#ifndef SONARD_REPORT_INSONIFY_H
#define SONARD_REPORT_INSONIFY_H

#include "drawn.h"

enum insonify_cause {
    CAUSE_NOISE,
    CAUSE_VOLUME, /* reverberation of the water */
    CAUSE_RING,
    CAUSE_OWN_PARTS,
    CAUSE_PLANE,
    CAUSE_TARGET,
    CAUSE_SIDE_LOBE,
    CAUSE_MULTIPATH,
    CAUSE_OTHER_SONAR,
    CAUSES,
};

extern const char *const insonify_cause_name[CAUSES];

/* What comes back in one piece. */
struct insonify_glint {
    uint32_t bin;
    double power;
};

struct insonified {
    float mean[CAUSES][DRAWN_MAX_BINS];
    float target[DRAWN_MAX_TARGETS][DRAWN_MAX_BINS];           /* its speckle; also within mean[CAUSE_TARGET] */
    struct insonify_glint glint[DRAWN_MAX_TARGETS];            /* power 0: the target is not in the beam */
    uint32_t first[DRAWN_MAX_TARGETS], end[DRAWN_MAX_TARGETS]; /* bins with any power of it; first >= end: none */
    double near_m[DRAWN_MAX_TARGETS]; /* nearest point within half power; INFINITY: none */
    double far_m[DRAWN_MAX_TARGETS];
    double plane_m; /* nearest point of a surface, bottom or slope within half power; INFINITY: none */
    double solid_m; /* nearest of anything within half power, the vehicle's own parts too; INFINITY: none */
    double skirt_m; /* the same down to the beam's skirt, 35 dB down: what is heard from there on is no ghost */
    bool shadowed;  /* by the vehicle's own parts */
};

/* What is the same in all beams of a world. Large. */
struct insonify {
    const struct drawn_world *world;
    double bin_m;
    float noise[DRAWN_MAX_BINS], electronic, volume[DRAWN_MAX_BINS], ring[DRAWN_MAX_BINS];
    double wall[DRAWN_MAX_BINS]; /* power of a wall seen square on */
};

void insonify_init(struct insonify *in, const struct drawn_world *world);

/** insonify_beam - from a place (north, east) along az_rad. Other sonars are not in it. */
void insonify_beam(const struct insonify *in, const double place_m[2], double az_rad, struct insonified *out);

/** insonify_add - power between two ranges to mean power by bin. */
void insonify_add(const struct insonify *in, float *mean, double from_m, double to_m, double power);

#endif
