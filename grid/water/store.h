/* SPDX-License-Identifier: MIT */
/*
 * store - the records of free water of all sonars, written as pings come in, and as a question sees them. Free water
 * lies in NED, or in the body's axes until a pose has an attitude; all is forgotten when nobody knows any more where
 * it lies: poses jump, are withdrawn, or have no attitude while the vehicle may turn. Fixed memory; one thread owns it,
 * and publishes lists of its records, which others read where they lie (pool.h).
 *
 * A ping of several beams is a row, or a matrix if they have several elevations; of such whose neighbours say the same
 * only some are kept. A head's ping is the end of a row of its last beams (sweep.h).
 */
#ifndef SONARD_WATER_STORE_H
#define SONARD_WATER_STORE_H

#include "ask.h"
#include "beams.h"
#include "matrix.h"
#include "pool.h"
#include "sweep.h"

#define STORE_SENSORS POOL_SENSORS /* pings of others are left out */

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
    struct beams_row row; /* scratch, as are these */
    struct matrix matrix;
    struct row_room room, joined;
};

struct store_conf {
    uint32_t beams[STORE_SENSORS]; /* of a ping of each sensor, at most; 0: there is none */
    uint32_t spare;                /* of struct pool_conf */
};

/* What a question has to know of the store besides the records themselves, as it was at one time. All zeros:
 * nothing. */
struct store_list {
    uint64_t number; /* of the list */
    uint64_t gone_ns[STORE_SENSORS];
    uint64_t discontinuities, withdrawn;
    double at_m[3];
    uint32_t n;
    bool ned, placed, reserved[2];
    uint16_t order[POOL_RECORDS];
};
_Static_assert(sizeof(struct store_list) % 8 == 0, "a list is whole words");

/* When and where a question is asked, and what of older water still counts for it. */
struct store_now {
    uint64_t now_ns;
    const struct pose *pose;
    double clear_for_s;  /* water seen longer ago is free no more ... */
    double move_limit_m; /* ... nor from such a way on */
    double
        keeps_m; /* what a ping shows farther from the vehicle is forgotten: nothing is free there; 0: no limit */
    uint64_t lost; /* set of the sensors that are offline: what they found free is so no more */
    bool looks;    /* where anybody looked: an echo that would have ended the water there may be forgotten since */
};

/** store_bytes - memory for store_init, which is 8-byte aligned. */
size_t store_bytes(const struct store_conf *conf);
struct store *store_init(void *memory, const struct store_conf *conf);

/** store_number - what is entered from now on makes the list of this number; read_from: nobody reads one of a lower
 * number, nor will. Without readers neither need be told. */
void store_number(struct store *s, uint64_t number, uint64_t read_from);

/** store_enter - a ping, received by a sensor at `mount`. Cost: O(beams log beams). */
void store_enter(struct store *s, const struct echoes *e, const struct mount *mount);

/** store_follow - no ping comes, and the vehicle is there: a way in small steps is no jump. */
void store_follow(struct store *s, const struct pose *pose);

/** store_list - the list as it is now. */
void store_list(const struct store *s, struct store_list *list);

/** store_look - the records of a list as a question sees them, the newest first, into view[ASK_RECORDS]; how many.
 * Directions are in NED, or in the body's axes where the pose has no attitude. Any thread, while nothing that the list
 * names is used again. Of the store it reads the records alone. */
int store_look(const struct store *s, const struct store_list *list, const struct store_now *now,
               struct water_view *view);

/** store_view - the same of the list as it is now. By the owner. */
static inline int store_view(const struct store *s, const struct store_now *now, struct water_view *view)
{
    struct store_list list;
    store_list(s, &list);
    return store_look(s, &list, now, view);
}

#endif
