/* SPDX-License-Identifier: MIT */
/*
 * came_back - strong echoes that were gone and are there again, in many directions, while the vehicle has not moved:
 * what has left does not come back to where it was, so the receiver was deaf in between. For heads that turn, and for
 * fans. Knows no samples, no map.
 */
#ifndef SONARD_CAME_BACK_H
#define SONARD_CAME_BACK_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/echoes.h"
#include "standing.h"

#define CAME_BACK_BEARINGS 800 /* of a head's turn, half a step of the finest; or beams of a fan */
#define CAME_BACK_PARTS    36  /* of a head's turn; a fan has CAME_BACK_FAN */
#define CAME_BACK_FAN      16

/* When the sensor last looked there, and when it last had a strong echo; where that is to be expected: it stays in mind
 * when looks miss it. */
struct came_back_bearing {
    uint64_t looked_ns, strong_ns; /* 0: never */
    float range_m, last_m;         /* last_m: in the last look; 0: none */
};

/* What the last pass has heard of a part. */
enum came_back_heard { CAME_BACK_UNKNOWN, CAME_BACK_HEARD, CAME_BACK_MISSED };

/* Part of a sensor's directions. */
struct came_back_part {
    uint64_t since_ns; /* what is in mind was seen from here, since then: */
    struct pose pose;
    uint64_t gone_ns; /* end of a pass that missed it; 0: none has */
    uint64_t back_ns; /* when some of it was there again, as if the receiver had been deaf ... */
    uint32_t back;    /* ... which counts for so many passes more */
    uint8_t heard;    /* enum came_back_heard, since then */
    bool again;       /* this ping shows some of it again */
};

/* Looks where a strong echo was, and those of them that found none at all. */
struct came_back_looks {
    uint32_t n, missed;
};

/* The pass through a part that goes on. */
struct came_back_pass {
    uint32_t part;
    struct came_back_looks all, sure; /* sure: at no edge of what stands there */
    double astray_rad;                /* bearings may have changed by so much */
};

/* A bearing among the last looks. */
struct came_back_place {
    uint64_t t_ns; /* 0: there was none */
    uint32_t bearing, part;
    double astray_rad;
};

/* All zero: nothing was heard yet. */
struct came_back {
    struct standing standing;
    struct came_back_pass pass;
    struct came_back_place missed, found; /* the last edge without its echo, and the last strong echo */
    struct came_back_part part[CAME_BACK_PARTS];
    struct came_back_bearing bearing[CAME_BACK_BEARINGS];
};

/**
 * came_back_run - a ping after its echoes were marked. True while there is a doubt: strong echoes in six parts were
 * missed by a pass and then were there again at the same bearing and range; in a fan, by the same ping. It ends once
 * half of these parts have been heard again and the last pass through none of them misses more than a quarter of what
 * it should hear; after eight passes of a head or 400 pings of a fan; and after 300 s of silence.
 *
 * Only bearings that had a strong echo say whether the receiver hears: a look into an opening says nothing, and what
 * stands before something that has left is an echo all the same. Bearings at an edge, as near as the vehicle has turned
 * and moved meanwhile, may show it or not; what is thinner than that, as a pile, is not gone where it is found beside.
 * O(beams).
 */
bool came_back_run(struct came_back *c, const struct echoes *echoes);

#endif
