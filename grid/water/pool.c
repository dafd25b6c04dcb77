/* SPDX-License-Identifier: MIT */
#include "pool.h"

#include <string.h>

#include "row.h"

static size_t room_of(uint32_t columns)
{
    return row_bytes(columns, ROW_ROWS);
}

static uint32_t slots_of(const struct pool_conf *conf, int sensor)
{
    return conf->columns[sensor] ? POOL_KEPT + conf->spare : 0;
}

size_t pool_bytes(const struct pool_conf *conf)
{
    size_t bytes = 0;
    for (int i = 0; i < POOL_SENSORS; i++)
        bytes += slots_of(conf, i) *
                 (sizeof(struct water_record) + sizeof(struct pool_idle) + room_of(conf->columns[i]));
    return bytes;
}

void pool_init(struct pool *p, void *memory, const struct pool_conf *conf)
{
    uint32_t slots = 0;
    *p = (struct pool){.record = memory};
    for (int i = 0; i < POOL_SENSORS; i++) {
        p->shelf[i] = (struct pool_shelf){.columns = conf->columns[i], .first = slots, .slots = slots_of(conf, i)};
        slots += p->shelf[i].slots;
    }
    p->idle = (struct pool_idle *)(void *)(p->record + slots);
    char *room = (char *)(p->idle + slots);
    for (int i = 0; i < POOL_SENSORS; i++) {
        p->shelf[i].room = room;
        room += p->shelf[i].slots * room_of(p->shelf[i].columns);
    }
    for (uint32_t i = 0; i < slots; i++)
        p->idle[i] = (struct pool_idle){.slot = (uint16_t)i};
}

static struct pool_shelf *shelf_of(struct pool *p, uint32_t slot)
{
    return &p->shelf[p->record[slot].sensor];
}

static struct pool_idle *idle_at(const struct pool *p, const struct pool_shelf *shelf, uint32_t i)
{
    return &p->idle[shelf->first + (shelf->longest + i) % shelf->slots];
}

static void leave_out(struct pool *p, uint32_t at)
{
    const uint16_t slot = p->order[at];
    struct pool_shelf *shelf = shelf_of(p, slot);
    *idle_at(p, shelf, shelf->slots - shelf->listed) = (struct pool_idle){p->number, slot};
    shelf->listed--;
    p->n--;
    memmove(p->order + at, p->order + at + 1, (p->n - at) * sizeof *p->order);
}

void pool_clear(struct pool *p)
{
    while (p->n)
        leave_out(p, p->n - 1);
    memset(p->gone_ns, 0, sizeof p->gone_ns);
}

/* What it had ended is known no more. */
static void note_gone(struct pool *p, const struct water_record *record)
{
    uint64_t *gone_ns = &p->gone_ns[record->sensor];
    if (record->newest_ns > *gone_ns)
        *gone_ns = record->newest_ns;
}

static void let_go(struct pool *p, uint32_t at)
{
    note_gone(p, &p->record[p->order[at]]);
    leave_out(p, at);
}

/* The one that is idle for the longest time, if nobody reads it; NULL: somebody may. */
static const struct pool_idle *take_slot(struct pool *p, struct pool_shelf *shelf)
{
    if (shelf->listed == shelf->slots || idle_at(p, shelf, 0)->since > p->read_from)
        return NULL;
    const struct pool_idle *idle = idle_at(p, shelf, 0);
    shelf->longest = (shelf->longest + 1) % shelf->slots;
    shelf->listed++;
    return idle;
}

static void *put(char **at, const void *what, size_t bytes)
{
    void *there = *at;
    memcpy(there, what, bytes);
    *at += bytes;
    return there;
}

static void copy(struct pool *p, uint32_t slot, const struct water_record *record)
{
    const struct water_image *from = &record->image;
    const struct pool_shelf *shelf = &p->shelf[record->sensor];
    struct water_image *image = &p->record[slot].image;
    char *room = shelf->room + (slot - shelf->first) * room_of(shelf->columns);
    p->record[slot] = *record;
    image->tan_az = put(&room, from->tan_az, (from->columns + 1u) * sizeof(double));
    image->tan_el = put(&room, from->tan_el, (from->rows + 1u) * sizeof(double));
    image->cell = put(&room, from->cell, water_image_cells(from->columns, from->rows) * sizeof(struct water_cell));
}

/* The oldest record of a sensor. */
static uint32_t oldest_of(const struct pool *p, uint32_t sensor)
{
    uint32_t at = 0;
    while (p->record[p->order[at]].sensor != sensor)
        at++;
    return at;
}

void pool_keep(struct pool *p, const struct water_record *record)
{
    struct pool_shelf *shelf = &p->shelf[record->sensor];
    const bool fits = row_bytes(record->image.columns, record->image.rows) <= room_of(shelf->columns);
    const struct pool_idle *idle = fits ? take_slot(p, shelf) : NULL;
    if (!idle) {
        note_gone(p, record);
        p->left_out++;
        return;
    }
    const uint16_t slot = idle->slot;
    if (shelf->listed > POOL_KEPT)
        let_go(p, oldest_of(p, record->sensor));
    if (p->n == POOL_RECORDS)
        let_go(p, 0);
    uint32_t at = p->n++;
    copy(p, slot, record);
    for (; at > 0 && p->record[p->order[at - 1]].newest_ns > record->newest_ns; at--)
        p->order[at] = p->order[at - 1];
    p->order[at] = slot;
}

/* Where it stands in the order; n: nowhere. */
static uint32_t find(const struct pool *p, uint32_t sensor, uint32_t back)
{
    for (uint32_t i = p->n; i-- > 0;)
        if (p->record[p->order[i]].sensor == sensor && back-- == 0)
            return i;
    return p->n;
}

void pool_drop(struct pool *p, uint32_t sensor, uint32_t seq)
{
    const uint32_t at = find(p, sensor, 0);
    if (at < p->n && p->record[p->order[at]].seq == seq)
        leave_out(p, at);
}

const struct water_record *pool_of(const struct pool *p, uint32_t sensor, uint32_t back)
{
    const uint32_t at = find(p, sensor, back);
    return at < p->n ? &p->record[p->order[at]] : NULL;
}
