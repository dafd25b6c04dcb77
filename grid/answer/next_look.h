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
    const struct cluster *clusters;  /* what a ranking looks at beside ages; next_look_sector does not */
    uint32_t n_clusters;             /* at most CLUSTERS_MAX */
    const struct cluster_gone *gone; /* clusters that vanished */
    uint32_t n_gone;
};

struct next_look {
    double az_rad, el_rad; /* in the grid's axes */
    double score;          /* 0: just looked at, nothing there; 1: never looked at, abeam; 3: the same ahead */
    double age_s;          /* of the newest ping in that direction; negative: none */
    enum next_look_why why;
};

/* What a direction is worth, while the best are chosen. */
struct next_look_score {
    double score; /* 0: nothing, not wanted, or too near to a better one */
    float age_s;
    uint32_t why;
};

/*
 * A ranking on its way, in steps between which pings may come. All clusters and scores in it are the caller's, and stay
 * until it is over.
 */
struct next_look_ranking {
    struct next_look_conf conf;
    uint64_t now_ns;
    struct next_look_score *score; /* [directions] */
    uint32_t room, n;              /* found so far: */
    struct next_look look[NEXT_LOOK_MAX];
    bool started, judged;
    double axes_rad;     /* of the grid, by which all scores are */
    uint32_t next, ring; /* direction */
    uint32_t best;       /* of this round ... */
    double best_score, best_off;
    uint32_t chosen; /* ... and of the one before: directions near to it are left out */
    uint32_t n_here;
    const struct cluster *here[CLUSTERS_MAX]; /* at the elevation of that ring, in their order */
    uint32_t work; /* of the last step, in judgements of one direction and one cluster */
};

#define NEXT_LOOK_STEP 100000u /* a step ends with so much work, and at most what one ring's clusters take more */

/** next_look_begin - room: at most NEXT_LOOK_MAX; score: of all directions of the picture. */
void next_look_begin(struct next_look_ranking *r, uint64_t now_ns, const struct next_look_conf *conf,
                     struct next_look_score *score, uint32_t room);

/**
 * next_look_step - a step of it. True: there is more. Otherwise look[0..n-1] are the best, the best first. Together
 * O(directions * (room + clusters at their elevation)).
 */
bool next_look_step(struct next_look_ranking *r, struct picture *picture);

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
