/* SPDX-License-Identifier: MIT */
/* background_learn - see background_learn.h. */
#include "background_learn.h"

#include <string.h>

/* Where a row's last ping was taken. */
struct stand {
    double position_m[3];
    float north, east; /* of the beam's axis, horizontal part of a unit vector */
    unsigned has;
};

struct background_learn {
    struct background_shape shape;
    struct background_learn_conf conf;
    struct mount mount;
    struct background_progress progress;
    uint32_t last_row;
    float az_width_rad; /* of the last ping's beams */
    struct stand stand[BACKGROUND_ROWS_MAX];
    uint8_t n[BACKGROUND_ROWS_MAX]; /* pings of the row */
    uint8_t fresh[PING_MAX_BINS];   /* counts being sorted in */
    uint8_t sorted[];               /* [rows][K][bins]: in each cell ascending over the row's n */
};

#define NO_ROW UINT32_MAX

size_t background_learn_size(const struct background_shape *shape, uint32_t pings)
{
    return sizeof(struct background_learn) + (size_t)shape->rows * pings * shape->bins;
}

struct background_learn *background_learn_init(void *mem, const struct background_shape *shape,
                                               const struct background_learn_conf *conf, const struct mount *mount)
{
    struct background_learn *l = mem;
    memset(l, 0, sizeof *l); /* of a row's planes only those of pings that it has had are read */
    l->shape = *shape;
    l->conf = *conf;
    l->mount = *mount;
    l->last_row = NO_ROW;
    return l;
}

/* ---- has the vehicle moved? ---- */

static struct stand stand_of(const struct background_learn *l, const struct ping *ping, uint16_t beam)
{
    double v[3];
    struct stand s = {.has = ping->pose.has & (POSE_POSITION | POSE_ATTITUDE)};
    memcpy(s.position_m, ping->pose.position_m, sizeof s.position_m);
    geo_direction(ping->beam[beam].az_rad, ping->beam[beam].el_rad, v);
    quat_rotate(l->mount.attitude, v, v);
    quat_rotate(ping->pose.attitude, v, v);
    s.north = (float)v[0];
    s.east = (float)v[1];
    return s;
}

static bool moved(const struct stand *a, const struct stand *b, double way_m, double turn_rad)
{
    const unsigned both = a->has & b->has;
    double way2 = 0;
    for (int i = 0; i < 3; i++)
        way2 += (a->position_m[i] - b->position_m[i]) * (a->position_m[i] - b->position_m[i]);
    /* A chord is shorter than its angle: at worst a little more turn is asked for. */
    const double north = (double)a->north - b->north, east = (double)a->east - b->east;
    return (both & POSE_POSITION && way2 >= way_m * way_m) ||
           (both & POSE_ATTITUDE && north * north + east * east >= turn_rad * turn_rad);
}

/* ---- taking ---- */

#define BLOCK 64 /* a constant number of cells: both compilers make vectors of such loops */

/* The smaller of both into `kept`, the greater into `fresh`. */
static void order(uint8_t *restrict kept, uint8_t *restrict fresh, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const uint8_t a = kept[i], b = fresh[i];
        kept[i] = a < b ? a : b;
        fresh[i] = a < b ? b : a;
    }
}

/* Sorts one count more into every cell: a pass of minimum and maximum over the planes. */
static void sort_in(uint8_t *plane, uint32_t n, uint32_t bins, uint8_t *fresh)
{
    for (uint32_t k = 0; k < n; k++) {
        uint8_t *kept = plane + (size_t)k * bins;
        uint32_t i = 0;
        for (; i + BLOCK <= bins; i += BLOCK)
            order(kept + i, fresh + i, BLOCK);
        order(kept + i, fresh + i, bins - i);
    }
    memcpy(plane + (size_t)n * bins, fresh, bins);
}

static uint8_t *planes(struct background_learn *l, uint32_t row)
{
    return l->sorted + (size_t)row * l->conf.pings * l->shape.bins;
}

static void take_row(struct background_learn *l, const struct ping *ping, uint16_t beam, uint32_t row)
{
    struct background_progress *p = &l->progress;
    const struct stand here = stand_of(l, ping, beam);
    if (l->n[row] == l->conf.pings) {
        p->done |= p->rows_seen - p->rows_full <= p->rows_seen / BACKGROUND_STRAY;
        return;
    }
    const bool known = l->n[row] == 0 || (here.has & l->stand[row].has);
    if (known && l->n[row] && !l->conf.standing &&
        !moved(&here, &l->stand[row], BACKGROUND_MOVED_BINS * (double)l->shape.dr_m,
               BACKGROUND_MOVED_WIDTHS * (double)ping->az_aperture_rad)) {
        p->unmoved++;
        return;
    }
    background_counts(ping, (size_t)beam * l->shape.bins, l->shape.bins, l->fresh);
    sort_in(planes(l, row), l->n[row], l->shape.bins, l->fresh);
    l->stand[row] = here;
    p->rows_seen += l->n[row]++ == 0;
    p->rows_full += l->n[row] == l->conf.pings;
    p->no_pose += here.has == 0;
    p->taken++;
}

void background_learn_take(struct background_learn *l, const struct ping *ping)
{
    if (ping->flags & PING_UNHEARD)
        return;
    if (background_fit(&l->shape, ping) != BACKGROUND_FITS) {
        l->progress.other_bins++;
        return;
    }
    l->az_width_rad = ping->az_aperture_rad;
    for (uint16_t beam = 0; beam < ping->n_beams; beam++) {
        const uint32_t row = background_row(&l->shape, ping, beam);
        if (l->shape.head_turn && row == l->last_row)
            continue;
        l->last_row = row;
        take_row(l, ping, beam, row);
    }
}

const struct background_shape *background_learn_shape(const struct background_learn *l)
{
    return &l->shape;
}

void background_learn_progress(const struct background_learn *l, struct background_progress *out)
{
    *out = l->progress;
    out->least = l->progress.rows_seen ? l->conf.pings : 0;
    for (uint32_t row = 0; row < l->shape.rows; row++)
        if (l->n[row] && l->n[row] < out->least)
            out->least = l->n[row];
}

/* ---- the template ---- */

/* The nearest learnt row from `row` on in steps of +1 or -1, at most `most` away; NO_ROW: none. */
static uint32_t neighbour(const struct background *b, uint32_t row, int step, uint32_t most)
{
    const uint32_t rows = b->shape.rows;
    for (uint32_t k = 1; k <= most && k < rows; k++) {
        const int64_t at = (int64_t)row + (int64_t)step * k;
        if (b->shape.head_turn == 0 && (at < 0 || at >= rows))
            return NO_ROW;
        const uint32_t other = (uint32_t)((at + rows) % rows);
        if (b->learnt[other])
            return other;
    }
    return NO_ROW;
}

static void fill_row(struct background *b, uint32_t row, uint32_t other)
{
    if (other == NO_ROW)
        return;
    uint8_t *to = b->level + (size_t)row * b->shape.bins;
    const uint8_t *from = b->level + (size_t)other * b->shape.bins;
    for (uint32_t i = 0; i < b->shape.bins; i++)
        to[i] = from[i] > to[i] ? from[i] : to[i];
}

/* `learnt` tells learnt rows from filled ones until all are filled. */
static void fill_gaps(struct background *b, double width_rad)
{
    bool filled[BACKGROUND_ROWS_MAX] = {false};
    if (!(b->shape.row_rad > 0))
        return;
    const double steps = width_rad / (double)b->shape.row_rad;
    const uint32_t most = steps < b->shape.rows ? (uint32_t)steps : b->shape.rows;
    for (uint32_t row = 0; row < b->shape.rows; row++) {
        const uint32_t before = neighbour(b, row, -1, most), after = neighbour(b, row, 1, most);
        if (b->learnt[row] || (before == NO_ROW && after == NO_ROW))
            continue;
        fill_row(b, row, before);
        fill_row(b, row, after);
        filled[row] = true;
    }
    for (uint32_t row = 0; row < b->shape.rows; row++)
        if (filled[row])
            b->learnt[row] = 1;
}

void background_learn_finish(const struct background_learn *l, uint32_t least, struct background *out)
{
    const uint32_t bins = l->shape.bins;
    for (uint32_t row = 0; row < l->shape.rows; row++) {
        const uint32_t n = l->n[row];
        if (n == 0 || n < least)
            continue;
        const uint8_t *median = l->sorted + ((size_t)row * l->conf.pings + (n - 1) / 2) * bins;
        memcpy(out->level + (size_t)row * bins, median, bins);
        out->learnt[row] = (uint8_t)n;
    }
    fill_gaps(out, l->az_width_rad);
}
