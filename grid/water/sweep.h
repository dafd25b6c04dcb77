/* SPDX-License-Identifier: MIT */
/*
 * sweep - the last beams of a turning head as one row: of single beams that are sent from different places next to no
 * tile lies in one. Each was sent from its own place with its own tilt: how far these lie from the row's is part of
 * what is uncertain of it.
 */
#ifndef SONARD_WATER_SWEEP_H
#define SONARD_WATER_SWEEP_H

#include "beams.h"

#define SWEEP_BEAMS 18 /* of a row, at most ... */
#define SWEEP_EACH  6 /* ... of which one is kept after so many beams, or fewer if those are not all in the next */

/* A beam of a head; its record's axes are turned to the beam. */
struct sweep_look {
    struct water_record at;
    struct row_beam beam;
    struct row_shape shape;
    bool apart;               /* between the one before and it nothing is said; else ... */
    double join_m[ROW_ROWS];  /* ... they leave no gap from here on: struct row_shape; ... */
    double aside_m, tilt_rad; /* ... and their axes diverge by that: struct row_beam; ... */
    double gap_m;             /* ... nearer than this a post may stand between them: WATER_THIN_M */
};

struct sweep {
    struct sweep_look look[SWEEP_BEAMS + 1]; /* from the oldest on */
    int n;                                   /* of these */
    int first;       /* the first of the row: 1, where the one before it is known; else 0 */
    double sense;    /* of its turn: 1, -1; 0: not known yet */
    int since;       /* beams since a row was kept, the last one counted */
    uint32_t before; /* number of the ping before the last one that joined it ... */
    uint32_t begun;  /* ... and of the first one of the sweep */
};

/**
 * sweep_add - the next beam, whose record is as beams_begin has it and whose row holds it alone. False: it does not
 * join those before it; many pings are lost between, the head has turned back, or by less than a sixteenth of the beam,
 * or together they would be wider than 60 degrees, or the beam is ten degrees wide and the head turns slowly: it begins
 * a row. Between beams that leave a gap nothing is said. Only of a row that goes on are the oldest beams left out.
 */
bool sweep_add(struct sweep *s, const struct water_record *at, const struct beams_row *row);

/** sweep_write - the row of the beams so far. */
void sweep_write(const struct sweep *s, struct water_record *record, struct row_room *room);

#endif
