/* SPDX-License-Identifier: MIT */
/*
 * pool - the records of free water that are kept: fixed memory, and their order in time. Each sensor has a shelf of its
 * own, so that a fan of many pings pushes no turn of a head out. A record is never changed. One thread owns the pool;
 * others may read the records of a list of it (order) that the owner has published, without a copy: the slot of a
 * record that is in the list no more is used again only when nobody reads a list with it (read_from).
 */
#ifndef SONARD_WATER_POOL_H
#define SONARD_WATER_POOL_H

#include <stddef.h>

#include "record.h"

#define POOL_SENSORS 8
#define POOL_KEPT    192 /* records of a sensor in the list, at most ... */
#define POOL_RECORDS 512 /* ... and of all */

struct pool_conf {
    uint32_t
        columns[POOL_SENSORS]; /* of images of ROW_ROWS rows, than which each sensor's are no larger; 0: none of
                                       it is kept */
    uint32_t
        spare; /* slots of a sensor beside POOL_KEPT, >= 1: for records that are in the list no more, and read */
};

/* A slot without a record of the list, and the number of the first list that was without it. */
struct pool_idle {
    uint64_t since;
    uint16_t slot;
};

/* Of one sensor: slots, and those of them that are idle, the longest first. */
struct pool_shelf {
    uint32_t columns, first, slots;
    uint32_t listed;
    uint32_t longest; /* idle one, in pool->idle[first ... first + slots - 1], which goes round */
    char *room;
};

struct pool {
    struct water_record *record; /* each with room of its own */
    struct pool_idle *idle;
    struct pool_shelf shelf[POOL_SENSORS];
    uint16_t order[POOL_RECORDS]; /* slots of the list, from the oldest record to the newest */
    uint32_t n;
    uint64_t number;    /* of the list that is being made */
    uint64_t read_from; /* nobody reads a list of a lower number, nor will */
    uint64_t left_out;  /* records for which there was no slot */
    uint64_t
        gone_ns[POOL_SENSORS]; /* the newest of that sensor's records that are not in the list for want of room */
};

/** pool_bytes - memory for pool_init, which is 8-byte aligned. */
size_t pool_bytes(const struct pool_conf *conf);
void pool_init(struct pool *p, void *memory, const struct pool_conf *conf);
void pool_clear(struct pool *p);

/** pool_keep - copies a record and its image to its place in time. Where its sensor has POOL_KEPT, or
 * all have POOL_RECORDS, the oldest one goes. Where no slot is idle, the record is left out. */
void pool_keep(struct pool *p, const struct water_record *record);

/** pool_drop - the newest record of that sensor, if its ping has this number. */
void pool_drop(struct pool *p, uint32_t sensor, uint32_t seq);

/** pool_of - the newest record of a sensor but for `back` of them; NULL: there are not so many. */
const struct water_record *pool_of(const struct pool *p, uint32_t sensor, uint32_t back);

/** pool_at - from the newest, 0, to the oldest, n - 1. */
static inline const struct water_record *pool_at(const struct pool *p, uint32_t i)
{
    return &p->record[p->order[p->n - 1 - i]];
}

#endif
