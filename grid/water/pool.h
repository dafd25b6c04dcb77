/* SPDX-License-Identifier: MIT */
/*
 * pool - the records of free water that are kept: fixed memory, and their order in time. The oldest goes when there is
 * no room. One thread owns it.
 */
#ifndef SONARD_WATER_POOL_H
#define SONARD_WATER_POOL_H

#include <stddef.h>

#include "record.h"

#define POOL_RECORDS 256 /* in all; rows of up to 40, 136 and WATER_COLUMNS columns: 64, 64 and 128 at most */

struct pool {
    struct water_record *record;  /* [POOL_RECORDS], each with room of its own */
    bool *used;                   /* [POOL_RECORDS] */
    uint16_t order[POOL_RECORDS]; /* those that are used, from the oldest to the newest */
    uint32_t n;
    char *room;
};

/** pool_bytes - memory for pool_init, which is 8-byte aligned. */
size_t pool_bytes(void);
void pool_init(struct pool *p, void *memory);
void pool_clear(struct pool *p);

/** pool_copy - the same records in memory of pool_bytes. */
void pool_copy(struct pool *copy, void *memory, const struct pool *p);

/** pool_keep - copies a record and its image, of five rows, to its place in time. */
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
