/* SPDX-License-Identifier: MIT */
/*
 * store - the records of free water of all sonars, written as pings come in, and as a question sees them. Free water
 * lies in NED, or in the body's axes until a pose has an attitude; all is forgotten when nobody knows any more where
 * it lies: poses jump, are withdrawn, or have no attitude while the vehicle may turn. Fixed memory, 3 MiB at most; one
 * thread owns it.
 *
 * A ping of several beams is a row of columns for each elevation that it has, up to STORE_ROWS of them; of such whose
 * neighbours say the same only some are kept. A head's ping is the end of a row of its last beams (sweep.h).
 */
#ifndef SONARD_WATER_STORE_H
#define SONARD_WATER_STORE_H

#include "ask.h"
#include "beams.h"
#include "pool.h"
#include "sweep.h"

#define STORE_SENSORS 8 /* pings of others are left out */
#define STORE_ROWS    4

struct store_sensor {
    struct beams_deaf deaf;
    struct sweep sweep;
};

struct store {
    struct pool pool;
    bool ned, placed;
    unsigned has;     /* which parts of a place the poses have */
    double at_m[3];   /* where the vehicle was last ... */
    uint64_t t_at_ns; /* ... by then */
    uint64_t discontinuities, withdrawn;
    struct store_sensor sensor[STORE_SENSORS];
    struct beams_row row; /* scratch, as is room */
    struct row_room room;
};

/* When and where a question is asked, and what of older water still counts for it. */
struct store_now {
    uint64_t now_ns;
    const struct pose *pose;
    double clear_for_s;  /* water seen longer ago is free no more ... */
    double move_limit_m; /* ... nor from such a way on */
    uint64_t lost;       /* set of the sensors that are offline: what they found free is so no more */
};

/** store_bytes - memory for store_init, which is 8-byte aligned. */
size_t store_bytes(void);
struct store *store_init(void *memory);

/** store_copy - as store_init, with all that is in another store. */
struct store *store_copy(void *memory, const struct store *s);

/** store_enter - a ping, received by a sensor at `mount`. Cost: O(beams log beams). */
void store_enter(struct store *s, const struct echoes *e, const struct mount *mount);

/** store_follow - no ping comes, and the vehicle is there: a way in small steps is no jump. */
void store_follow(struct store *s, const struct pose *pose);

/** store_view - the records as a question sees them, the newest first, into view[ASK_RECORDS]; how many. Directions are
 * in NED, or in the body's axes where the pose has no attitude. */
int store_view(const struct store *s, const struct store_now *now, struct water_view *view);

#endif
