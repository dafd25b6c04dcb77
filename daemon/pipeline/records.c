/* SPDX-License-Identifier: MIT */
#include "records.h"

#include <string.h>

#define RECORDS_GO 2 /* with each ping of a fan that stands: the last one, and that of all before it */

uint32_t records_spare(int threads, uint32_t waiting)
{
    const uint32_t clean_up = 2,
                   entered = 1; /* pings that one may release beside itself, and one that is entered */
    return RECORDS_GO * ((uint32_t)threads * waiting + clean_up + entered + RECORDS_HELD + 1);
}

static size_t store_at(void)
{
    return (sizeof(struct records) + 7) / 8 * 8;
}

size_t records_bytes(const struct store_conf *conf)
{
    return store_at() + store_bytes(conf);
}

struct records *records_init(void *memory, const struct store_conf *conf)
{
    struct records *w = memory;
    memset(w, 0, sizeof *w);
    w->store = store_init((char *)memory + store_at(), conf);
    return w;
}

/* ---- the owner ---- */

static void begin_list(struct records *w)
{
    store_number(w->store, snapshot_now(&w->turn) + 1, atomic_load_explicit(&w->read_from, memory_order_acquire));
}

static void publish_list(struct records *w)
{
    struct store_list list;
    store_list(w->store, &list);
    snapshot_publish_words(&w->turn, w->side[0], &list, RECORDS_LIST_WORDS);
}

void records_enter(struct records *w, const struct echoes *e, const struct mount *mount)
{
    begin_list(w);
    store_enter(w->store, e, mount);
    atomic_store_explicit(&w->left_out, w->store->pool.left_out, memory_order_relaxed);
    publish_list(w);
}

void records_follow(struct records *w, const struct pose *pose)
{
    begin_list(w);
    store_follow(w->store, pose);
    publish_list(w);
}

/* ---- the loop ---- */

static void leave(struct records *w, struct records_reading *r)
{
    struct records_reading **at = &w->oldest, *older = NULL;
    for (; *at != r; at = &older->newer)
        older = *at;
    *at = r->newer;
    if (w->newest == r)
        w->newest = older;
    r->open = false;
}

void records_tell(struct records *w)
{
    const uint64_t now = snapshot_now(&w->turn);
    while (w->oldest && now - w->oldest->list.number > RECORDS_HELD) {
        w->oldest->taken = true;
        leave(w, w->oldest);
    }
    atomic_store_explicit(&w->read_from, w->oldest ? w->oldest->list.number : now, memory_order_release);
}

void records_open(struct records *w, struct records_reading *r)
{
    const snapshot_word *const side[2] = {w->side[0], w->side[1]};
    if (!snapshot_copy(&w->turn, &r->list, side, RECORDS_LIST_WORDS)) {
        r->list = (struct store_list){0};
        return;
    }
    r->open = true;
    r->newer = NULL;
    if (w->newest)
        w->newest->newer = r;
    else
        w->oldest = r;
    w->newest = r;
}

void records_close(struct records *w, struct records_reading *r)
{
    r->taken = false;
    if (!r->open)
        return;
    leave(w, r);
    records_tell(w);
}

bool records_keeps(struct records *w, struct records_reading *r)
{
    if (r->open && snapshot_now(&w->turn) - r->list.number > RECORDS_HELD)
        records_tell(w);
    if (!r->taken)
        return true;
    r->taken = false;
    if (++r->tries < RECORDS_TRIES)
        records_open(w, r);
    else
        r->list = (struct store_list){0};
    return false;
}
