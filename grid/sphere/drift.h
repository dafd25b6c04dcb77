/* SPDX-License-Identifier: MIT */
/*
 * drift - what wedges of free water are still worth when poses have no position: since its ping the vehicle may have
 * moved in any direction, by its drift at most. Knows no cell and no direction of the grid.
 *
 * A point is free now when the beam that would have detected something there did not, wherever the vehicle was at
 * that time. So a beam's free water is shorter by the drift at both ends. Its upper and lower side are farther in by
 * what of the drift goes across them: next to nothing for the level drift of a level beam. Through its left and right
 * side the point may have left the beam, into a neighbouring one. Hence beams free only together: a run of beams that
 * follow and overlap each other, in a fan or in the sweep of a head, frees what is in the middle of it and farther from
 * both its ends than the drift since the oldest of them. Nothing in that water can have passed the sweep undetected: it
 * was on one side of the beam when the run started, and on the other when it ended. The nearer the water, the wider
 * the run must be, and the older is its first beam; drift_judge takes all runs around a beam and joins what they free.
 */
#ifndef SONARD_SPHERE_DRIFT_H
#define SONARD_SPHERE_DRIFT_H

#include "wedges.h"

#define DRIFT_LOOKS 2048

/* A beam, or a part of a wide one, in order of time. */
struct drift_look {
    uint32_t ping, wedge;    /* of which it is: their numbers */
    float az_rad, half_rad;  /* in the sensor frame */
    float ahead[3], down[3]; /* its axis and the sensor's z, in the axes of the pings */
    /* numbers of the looks before it and behind, of the same sensor or parts of the same beam; DRIFT_LOOKS: none */
    uint16_t before, behind;
};

/* What a look is worth. */
struct drift_worth {
    struct beam_water water; /* to_m <= from_m: nothing */
    double drift_m[2];       /* level, in depth: by what it was made smaller */
    double apart_m;          /* and by this in every direction: sensors of the run are so far apart */
    double tilt_rad;         /* their beams are tilted against each other so much */
};

struct drift {
    struct drift_look *look; /* [DRIFT_LOOKS] */
    uint32_t n;
};

/** drift_bytes - memory for drift_init, which is 8-byte aligned. */
size_t drift_bytes(void);
void drift_init(struct drift *d, void *memory);

/**
 * drift_gather - the looks of all pings that are not older than a drift of most_m, in order of time; of more than there
 * is room for the newest. drift_m: up to now, level and in depth. part_rad: beams that are
 * much wider than part_rad are looked at in such parts, too. Returns how many there are.
 */
uint32_t drift_gather(struct drift *d, const struct wedges *w, const double drift_m[2], double most_m,
                      double part_rad);

/** drift_narrow - a wedge becomes the part of it that is looked at. */
void drift_narrow(struct wedge *wedge, const struct drift_look *look);

/** drift_judge - what look i is worth after that drift; false: nothing. Cost: the looks of the widest run around it. */
bool drift_judge(const struct drift *d, const struct wedges *w, const double drift_m[2], uint32_t i,
                 struct drift_worth *out);

#endif
