/* SPDX-License-Identifier: MIT */
#include "pool.h"

#include <string.h>

#include "row.h"

/* Records are as many as ask_free takes, and what they need follows their size: most are a head's, or a small fan's. */
static const struct size {
    uint32_t columns, n;
} sizes[] = {{40, 64}, {136, 64}, {WATER_COLUMNS, 128}};
#define SIZES 3

static size_t whole(size_t bytes)
{
    return (bytes + 7) / 8 * 8;
}

static size_t room_of(uint32_t columns)
{
    return whole((columns + 1 + ROW_ROWS + 1 + ROW_ROWS) * sizeof(double) +
                 water_image_cells(columns, ROW_ROWS) * sizeof(struct water_cell));
}

size_t pool_bytes(void)
{
    size_t bytes = POOL_RECORDS * sizeof(struct water_record) + whole(POOL_RECORDS * sizeof(bool));
    for (int i = 0; i < SIZES; i++)
        bytes += sizes[i].n * room_of(sizes[i].columns);
    return bytes;
}

void pool_init(struct pool *p, void *memory)
{
    *p = (struct pool){.record = memory};
    p->used = (bool *)(p->record + POOL_RECORDS);
    p->room = (char *)p->used + whole(POOL_RECORDS * sizeof(bool));
    pool_clear(p);
}

void pool_clear(struct pool *p)
{
    p->n = 0;
    memset(p->used, 0, POOL_RECORDS * sizeof *p->used);
}

/* Where in the copy's room it is. */
static const void *moved(const void *there, const struct pool *from, const struct pool *to)
{
    return to->room + ((const char *)there - from->room);
}

void pool_copy(struct pool *copy, void *memory, const struct pool *p)
{
    pool_init(copy, memory);
    memcpy(memory, p->record, pool_bytes());
    memcpy(copy->order, p->order, sizeof copy->order);
    copy->n = p->n;
    for (uint32_t i = 0; i < p->n; i++) {
        struct water_image *image = &copy->record[p->order[i]].image;
        image->tan_az = moved(image->tan_az, p, copy);
        image->tan_el = moved(image->tan_el, p, copy);
        image->near_m = moved(image->near_m, p, copy);
        image->cell = moved(image->cell, p, copy);
    }
}

/* Columns that there is room for in slot i; *at: where it begins. */
static uint32_t columns_of(uint32_t i, size_t *at)
{
    *at = 0;
    for (int k = 0; k + 1 < SIZES; k++) {
        if (i < sizes[k].n) {
            *at += i * room_of(sizes[k].columns);
            return sizes[k].columns;
        }
        i -= sizes[k].n;
        *at += sizes[k].n * room_of(sizes[k].columns);
    }
    *at += i * room_of(sizes[SIZES - 1].columns);
    return sizes[SIZES - 1].columns;
}

static void leave_out(struct pool *p, uint32_t at)
{
    p->used[p->order[at]] = false;
    p->n--;
    memmove(p->order + at, p->order + at + 1, (p->n - at) * sizeof *p->order);
}

/* The smallest that is free, or that of the oldest record. */
static uint32_t take_slot(struct pool *p, uint32_t columns)
{
    size_t at;
    for (uint32_t i = 0; i < POOL_RECORDS; i++)
        if (!p->used[i] && columns_of(i, &at) >= columns)
            return i;
    uint32_t oldest = 0;
    while (columns_of(p->order[oldest], &at) < columns)
        oldest++;
    const uint32_t slot = p->order[oldest];
    leave_out(p, oldest);
    return slot;
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
    struct water_image *image = &p->record[slot].image;
    size_t at;
    columns_of(slot, &at);
    char *room = p->room + at;
    p->record[slot] = *record;
    image->tan_az = put(&room, from->tan_az, (from->columns + 1u) * sizeof(double));
    image->tan_el = put(&room, from->tan_el, (from->rows + 1u) * sizeof(double));
    image->near_m = put(&room, from->near_m, from->rows * sizeof(double));
    image->cell = put(&room, from->cell, water_image_cells(from->columns, from->rows) * sizeof(struct water_cell));
}

void pool_keep(struct pool *p, const struct water_record *record)
{
    const uint32_t slot = take_slot(p, record->image.columns);
    uint32_t at = p->n++;
    copy(p, slot, record);
    p->used[slot] = true;
    for (; at > 0 && p->record[p->order[at - 1]].newest_ns > record->newest_ns; at--)
        p->order[at] = p->order[at - 1];
    p->order[at] = (uint16_t)slot;
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
