/* SPDX-License-Identifier: MIT */
/*
 * next_look - which directions are worth a look next: never pinged, not looked at for long, with something in them
 * that comes nearer or grows, and the more of these the more they lie ahead. Features (Auran and Silven 1996, sections
 * 2.1 and 3.1) are looked at twice as often: edges of clusters, what vanished, and what is not stationary. From the
 * picture, the clusters and the velocity; knows no sonar and not what one can turn to. Pure.
 */
#ifndef SONARD_NEXT_LOOK_H
#define SONARD_NEXT_LOOK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "grid/sphere/clusters.h"
#include "grid/picture/picture.h"

#define NEXT_LOOK_MAX 64

enum next_look_why { LOOK_NEVER, LOOK_STALE, LOOK_APPROACHING, LOOK_GROWING, LOOK_EDGE, LOOK_VANISHED };

struct next_look_conf {
    double stale_s;           /* a direction not looked at for so long is as bad as one never looked at; > 0 */
    double low_rad, high_rad; /* elevations of the directions' centres that are wanted */
    double apart_rad;         /* directions nearer to a better one are left out */
    double velocity_mps[3];   /* in the grid's axes; zeros: unknown or at rest, nothing is ahead */
    const struct cluster *clusters; /* what next_look looks at beside ages; next_look_sector does not */
    uint32_t n_clusters;
    const struct cluster_gone *gone; /* clusters that vanished */
    uint32_t n_gone;
};

struct next_look {
    double az_rad, el_rad; /* in the grid's axes */
    double score;          /* 0: just looked at, nothing there; 1: never looked at, abeam; 3: the same ahead */
    double age_s;          /* of the newest ping in that direction; negative: none */
    enum next_look_why why;
};

/** next_look - the best first; returns how many were found, at most room <= NEXT_LOOK_MAX. O(directions * room). */
uint32_t next_look(struct picture *picture, uint64_t now_ns, const struct next_look_conf *conf,
                   struct next_look *out, uint32_t room);

#define NEXT_LOOK_SLICES 72 /* of the circle, by which a sector is moved */

/* What stood in every slice of the circle at the last look at the picture, and when it moved or vanished since. Zeroed
 * before the first. */
struct next_look_features {
    double range_m[NEXT_LOOK_SLICES]; /* of the nearest obstacle; INFINITY: none */
    bool known[NEXT_LOOK_SLICES];     /* some direction of it was looked at */
    uint64_t t_changed_ns[NEXT_LOOK_SLICES];
};

/**
 * next_look_sector - the middle azimuth of the sector, width_rad wide in (0, 2 pi), whose directions are together most
 * worth a look: by the mean of their scores without clusters, but with features (NULL: without), which it brings up to
 * the picture: a slice with an edge, or in which something moved or vanished within stale_s, counts twice its age.
 * Not by the best of them: a direction in the gap between two beams is never looked at, and would have all the looks.
 * False: nothing is worth one. O(directions).
 */
bool next_look_sector(struct picture *picture, uint64_t now_ns, const struct next_look_conf *conf,
                      struct next_look_features *features, double width_rad, double *az_rad);

const char *next_look_word(enum next_look_why why);

#endif
