/* SPDX-License-Identifier: MIT */
/*
 * records - the records of free water (grid/water), written by the maps' owner with every ping and read by questions
 * where they lie, without a copy. What is published is the list of the records that count, by core/snapshot: 1 KiB.
 *
 * The loop alone opens lists, reads them and closes them, so there is one reader. It tells the owner by one word, which
 * only grows, below which number it has no list and will open none: that of the oldest that is open, or of the newest
 * published when none is. The owner puts a new record into the slot of an old one only when the list that was the first
 * without it has no higher number than that. So what a list names stays as it is while the list is open, and neither
 * side waits. The word is stored with release, when all of the older list has been read, and loaded with acquire: no
 * stronger order is needed, since what the loop is going to open is never older than the number it has seen.
 * tests/model/records.pml is the model.
 *
 * The loop tells it with every ping, so at most the pings that may wait are entered meanwhile; what is RECORDS_HELD
 * lists old it takes away from the question, which begins again when it goes on. For that many records there are slots
 * (records_spare). Where a ping finds none all the same, it is left out and counted, and water that was seen before it
 * is free no more: nobody knows what it would have ended.
 */
#ifndef SONARD_RECORDS_H
#define SONARD_RECORDS_H

#include <stdatomic.h>

#include "core/snapshot.h"
#include "grid/water/store.h"

#define RECORDS_HELD  16 /* lists: 0.4 s of a fan of 40 Hz */
#define RECORDS_TRIES 8  /* a question begins so often; then all is unknown */

#define RECORDS_LIST_WORDS (sizeof(struct store_list) / 8)

/* A list that is open. */
struct records_reading {
    struct store_list list; /* without records when it could not be had: all is unknown */
    struct records_reading *newer;
    int tries;
    bool open;
    bool taken; /* it was open for too long, and has been closed */
};

struct records {
    struct store *store; /* the owner's, but for the records of lists that are open */
    struct snapshot turn;
    snapshot_word side[2][RECORDS_LIST_WORDS];
    _Atomic uint64_t read_from; /* the loop's word: it has no list of a lower number, and will open none */
    _Atomic uint64_t left_out;  /* records for which there was no slot */
    struct records_reading *oldest, *newest; /* open ones, the loop's */
};

/** records_spare - struct store_conf, of a pipeline with that many threads and pings that may wait for each. */
uint32_t records_spare(int threads, uint32_t waiting);

/** records_bytes - memory for records_init, which is 8-byte aligned. */
size_t records_bytes(const struct store_conf *conf);
struct records *records_init(void *memory, const struct store_conf *conf);

/* ---- the owner ---- */

/** records_enter, records_follow - as store_enter and store_follow, and published. */
void records_enter(struct records *w, const struct echoes *e, const struct mount *mount);
void records_follow(struct records *w, const struct pose *pose);

/* ---- the loop ---- */

/** records_tell - how far it has come with reading; before every ping. What has been open for too long is closed: its
 * question goes on when its client reads, if it ever does. */
void records_tell(struct records *w);

/** records_open - the newest list, to be closed. r is zeroed at first. */
void records_open(struct records *w, struct records_reading *r);

/** records_keeps - before all later steps of a question: true, its list is still young enough. False: another has been
 * opened instead, and the question begins again. */
bool records_keeps(struct records *w, struct records_reading *r);

/** records_close - nothing of it is read any more. What is not open is left alone. */
void records_close(struct records *w, struct records_reading *r);

/** records_view - store_look, of a list that is open. The view holds until the loop tells the next time: no other
 * thread may read it, since what is open may be taken then. */
static inline int records_view(const struct records *w, const struct records_reading *r,
                               const struct store_now *now, struct water_view *view)
{
    return store_look(w->store, &r->list, now, view);
}

#endif
