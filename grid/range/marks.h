/* SPDX-License-Identifier: MIT */
/*
 * marks - what the last looks of a sensor say against an echo: that no other look at nearly the same bearing shows it,
 * or that it is the ghost of a nearer echo. Marks echoes and drops none; knows no samples, no map.
 *
 * Looks are kept in rows of bearing in the sensor's frame. One is evidence about another while it is fresh and the
 * sensor has hardly moved.
 */
#ifndef SONARD_MARKS_H
#define SONARD_MARKS_H

#include <stdbool.h>
#include <stdint.h>

#include "comb.h"
#include "grid/echoes.h"

#define MARKS_ROWS 800 /* of a turn: half a step of the finest head that is common */

/* One beam's last look in a row. */
struct marks_look {
    uint64_t t_ns; /* 0: none yet */
    float az_rad, el_rad;
    float heard_from_m, heard_to_m; /* an echo between the two that it does not show was not there */
    bool placed; /* it is known where the body was, by its position or the path its velocity makes */
    bool turned; /* ... and its attitude */
    float position_m[3], attitude[4]; /* of the body, the position from the first ping's */
    uint8_t n, due;                   /* bit i: echo i came when another sonar's pulse was due */
    float range_m[ECHOES_PER_BEAM];
};

struct marks {
    bool placed;
    double origin_m[3]; /* position of the first ping */
    struct comb comb;
    struct marks_look row[MARKS_ROWS];
};

/** marks_init - nothing was looked at yet. sound_mps: the speed of sound that ranges are made with. */
void marks_init(struct marks *marks, double sound_mps);

/**
 * marks_run - set the flags of the ping's echoes from the looks before it, then keep its beams as looks.
 *
 * ECHO_BURST, ECHO_ALONE: at least two looks within one beam width of its bearing, or one, found nothing up to beyond
 * its range, and none shows it. (One look denies the first beam onto everything that there is, until the next beam
 * shows it, too.) ECHO_FAINT, which comes with the echo, stays unless one shows it. A faint echo counts as shown only
 * where more looks show it than deny it. A look reaches from heard_from_m to heard_to_m. Where it is not known
 * whether the body has moved (neither position nor velocity), only looks of the last 10 s count, and without an
 * attitude the head's own bearing. ECHO_GHOST: behind the beam's first echo and weaker, at twice its range (between a
 * wall and the head), or at twice its range and the range of the first echo on the opposite side (between two walls).
 * Only earlier looks count: the next look may show that a mark was wrong, and carries none itself.
 * Allocates nothing; O(beams * rows within a beam width).
 */
void marks_run(struct marks *marks, struct echoes *echoes);

#endif
