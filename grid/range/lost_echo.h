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

#include "grid/echoes.h"

#define LOST_ECHO_ROWS 36 /* of a head's turn; a fan is divided into LOST_ECHO_FAN */
#define LOST_ECHO_FAN  16

/* A direction of the sensor. */
struct lost_echo_row {
    uint64_t shown_ns; /* by its last ping with an echo */
    uint64_t lost_ns;  /* since when it should have an echo and has none; 0: it has */
    struct pose pose;  /* of the vehicle then */
    float range_m;
    uint8_t shown; /* pings that showed it, up to 2 */
};

struct lost_echo {
    uint32_t lost; /* rows, since the last echo */
    bool doubt;    /* until the next echo */
    struct lost_echo_row row[LOST_ECHO_ROWS];
};

/** lost_echo_init - nothing was heard yet. */
void lost_echo_init(struct lost_echo *l);

/**
 * lost_echo_run - a ping after its echoes were marked. Only echoes count that no mark speaks against, and that two pings
 * of a row have shown; and only rows count that were shown from where the vehicle is: within 0.3 m and 5 degrees, as its
 * pose and its drift have it.
 *
 * A ping with an echo shows that the receiver hears: what is gone has left. In one without any, the beams of a row that
 * does not show what it has shown free nothing for 10 s. Six rows of a head (60 degrees) or 12 sixteenths of a fan without an echo between them
 * are a doubt: nothing is free in any ping until the next echo. Returns whether there is one. O(beams).
 */
bool lost_echo_run(struct lost_echo *l, struct echoes *echoes);

#endif
