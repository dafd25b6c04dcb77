/* SPDX-License-Identifier: MIT */
/*
 * lost_echo - directions that had an echo and return none any more, one after the other, while the vehicle has not
 * moved: that is a doubt about the receiver, and no open water. One obstacle that leaves takes its own direction with
 * it, and others answer meanwhile; a receiver that dies takes all. For heads that turn, and for fans. Withdraws the
 * free water of a ping; knows no samples, no map.
 */
#ifndef SONARD_LOST_ECHO_H
#define SONARD_LOST_ECHO_H

#include <stdbool.h>
#include <stdint.h>

#include "came_back.h"
#include "grid/echoes.h"
#include "shade.h"

#define LOST_ECHO_PARTS 36 /* of a head's turn; a fan is divided into LOST_ECHO_FAN */
#define LOST_ECHO_FAN   16
#define LOST_ECHO_ROWS  800 /* of a head's turn, half a step of the finest; or beams of a fan */

/* A part of the sensor's directions. */
struct lost_echo_part {
    uint64_t since_ns; /* the vehicle has been where it is now since then: */
    struct pose pose;
    uint64_t shown_ns; /* its last ping with an echo */
    uint64_t lost_ns;  /* since when it should have an echo and has none; 0: it has */
    uint8_t shown;     /* pings with an echo since since_ns, up to 2 */
};

/* The last echo in a direction. */
struct lost_echo_row {
    uint64_t t_ns; /* 0: none */
    float range_m;
};

/* All zero: nothing was heard yet. */
struct lost_echo {
    uint32_t lost; /* parts, since the last echo */
    bool doubt;
    struct lost_echo_part part[LOST_ECHO_PARTS];
    struct lost_echo_row row[LOST_ECHO_ROWS];
    struct came_back came_back;
    struct shade shade;
};

/**
 * lost_echo_run - a ping after its echoes were marked. Only echoes count that no mark speaks against, in parts that two
 * pings have shown from where the vehicle is: within 0.3 m and 5 degrees, as its pose and its drift have it.
 *
 * A ping with an echo shows that the receiver hears: what is gone has left. In one without any, a beam that had an echo
 * in its own direction frees nothing for 10 s. Six parts of a head (60 degrees) or 12 of a fan that lose theirs without
 * an echo between them are a doubt: nothing is free in any ping until the next echo. Returns whether there is one.
 *
 * A receiver that hears one ping in twenty has such an echo all the while: came_back says when that is a doubt. What
 * rings beside a head has not left because a beam does not show it: shade says when.
 * O(beams).
 */
bool lost_echo_run(struct lost_echo *l, struct echoes *echoes);

#endif
