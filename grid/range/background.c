/* SPDX-License-Identifier: MIT */
/* background - see background.h. */
#include "background.h"

#include <math.h>
#include <string.h>

static size_t aligned(size_t n)
{
    return (n + 15) / 16 * 16;
}

bool background_shape_good(const struct background_shape *s)
{
    return s->rows >= 1 && s->rows <= BACKGROUND_ROWS_MAX && s->bins >= 1 && s->bins <= PING_MAX_BINS &&
           (s->head_turn == 0 || (s->head_turn >= s->rows && s->head_turn <= 1u << 24)) && s->r0_m >= 0 &&
           s->r0_m <= 10000 && s->dr_m > 0 && s->dr_m <= 1000 && s->az0_rad >= 0 &&
           s->az0_rad <= (float)GEO_TURN && s->row_rad >= 0 && s->row_rad <= (float)GEO_TURN &&
           s->law <= AMPLITUDE_LOG && s->db_per_count >= 0 && s->db_per_count <= 100;
}

/* Evenly spread beams are taken as such; the spacing serves to tell near from far only. */
static double fan_step(const struct ping *ping)
{
    return ping->n_beams < 2
               ? 0
               : fabs((double)ping->beam[ping->n_beams - 1].az_rad - ping->beam[0].az_rad) / (ping->n_beams - 1);
}

bool background_shape_of(const struct ping *ping, struct background_shape *shape)
{
    if (ping->kind != PING_PROFILE || ping->n_beams == 0 || (ping->head_turn && ping->n_beams != 1))
        return false;
    *shape = (struct background_shape){.head_turn = ping->head_turn,
                                       .rows = ping->n_beams,
                                       .bins = ping->n_bins,
                                       .r0_m = ping->r0_m,
                                       .dr_m = ping->dr_m,
                                       .az0_rad = (float)geo_wrap((double)ping->beam[0].az_rad),
                                       .db_per_count = ping->law == AMPLITUDE_LOG ? ping->db_per_count : 0,
                                       .law = ping->law};
    if (ping->head_turn) {
        shape->rows = ping->head_turn <= BACKGROUND_ROWS_MAX ? ping->head_turn : BACKGROUND_ROWS_FINE;
        shape->row_rad = (float)(GEO_TURN / shape->rows);
        shape->az0_rad = (float)geo_wrap((double)ping->beam[0].az_rad -
                                         GEO_TURN * (ping->head_units % ping->head_turn) / ping->head_turn);
    } else {
        shape->row_rad = (float)fan_step(ping);
    }
    return background_shape_good(shape);
}

size_t background_size(const struct background_shape *shape)
{
    return aligned(sizeof(struct background)) + aligned(shape->rows) + (size_t)shape->rows * shape->bins;
}

struct background *background_init(void *mem, const struct background_shape *shape, uint8_t mask_above)
{
    struct background *b = mem;
    memset(mem, 0, background_size(shape));
    b->shape = *shape;
    b->mask_above = mask_above;
    b->learnt = (uint8_t *)mem + aligned(sizeof *b);
    b->level = b->learnt + aligned(shape->rows);
    return b;
}

uint32_t background_row(const struct background_shape *shape, const struct ping *ping, uint16_t beam)
{
    if (shape->head_turn == 0)
        return beam;
    return (uint32_t)((uint64_t)(ping->head_units % shape->head_turn) * shape->rows / shape->head_turn);
}

enum background_fit background_fit(const struct background_shape *shape, const struct ping *ping)
{
    struct background_shape other;
    if (!background_shape_of(ping, &other) || other.head_turn != shape->head_turn || other.rows != shape->rows ||
        other.law != shape->law || other.db_per_count != shape->db_per_count)
        return BACKGROUND_FOREIGN;
    return other.bins == shape->bins && other.r0_m == shape->r0_m && other.dr_m == shape->dr_m
               ? BACKGROUND_FITS
               : BACKGROUND_RESAMPLED;
}

/* Each bin of the ping takes the loudest of the template's bins that it touches. */
static void resample(const struct background_shape *s, const uint8_t *from, const struct ping *ping, uint8_t *to)
{
    const double r0 = (double)s->r0_m, dr = (double)s->dr_m, near = (double)ping->r0_m, step = (double)ping->dr_m;
    uint32_t first = 0;
    for (uint32_t i = 0; i < ping->n_bins; i++) {
        const double lo = near + i * step, hi = near + (i + 1) * step;
        uint8_t most = 0;
        while (first < s->bins && r0 + (first + 1) * dr <= lo)
            first++;
        for (uint32_t k = first; k < s->bins && r0 + k * dr < hi; k++)
            most = from[k] > most ? from[k] : most;
        to[i] = most;
    }
}

/* Runs of 1 in blind[n] grow by `by` cells at both ends. */
static void widen(uint8_t *blind, uint32_t n, uint32_t by)
{
    for (uint32_t end = 0; end < n;) {
        const uint8_t *found = memchr(blind + end, 1, n - end);
        if (!found)
            return;
        const uint32_t begin = (uint32_t)(found - blind), room = begin - end;
        memset(blind + begin - (room < by ? room : by), 1, room < by ? room : by);
        found = memchr(blind + begin, 0, n - begin);
        end = found ? (uint32_t)(found - blind) : n;
        found = end < n ? memchr(blind + end, 1, n - end) : NULL;
        const uint32_t gap = (found ? (uint32_t)(found - blind) : n) - end;
        memset(blind + end, 1, gap < by ? gap : by);
        end += gap < by ? gap : by;
    }
}

bool background_view(const struct background *background, const struct ping *ping,
                     const struct background_view *view, bool *any_blind)
{
    const struct background_shape *s = &background->shape;
    const enum background_fit fit = background_fit(s, ping);
    bool known = false;
    *any_blind = false;
    if (fit == BACKGROUND_FOREIGN)
        return false;
    for (uint16_t beam = 0; beam < ping->n_beams; beam++)
        known |= background->learnt[background_row(s, ping, beam)] != 0;
    if (!known)
        return false;
    for (uint16_t beam = 0; beam < ping->n_beams; beam++) {
        const uint8_t *from = background->level + (size_t)background_row(s, ping, beam) * s->bins;
        uint8_t *to = view->level + (size_t)beam * ping->n_bins;
        if (fit == BACKGROUND_FITS)
            memcpy(to, from, s->bins);
        else
            resample(s, from, ping, to);
    }
    *any_blind =
        background_mask(view->level, (size_t)ping->n_beams * ping->n_bins, background->mask_above, view->blind);
    const double pulse = ceil((double)ping->pulse_m / (double)ping->dr_m);
    const uint32_t by = pulse > 0 ? pulse < ping->n_bins ? (uint32_t)pulse : ping->n_bins : 0;
    for (uint16_t beam = 0; *any_blind && beam < ping->n_beams; beam++)
        widen(view->blind + (size_t)beam * ping->n_bins, ping->n_bins, by);
    return true;
}

#define BLOCK 64 /* a constant number of cells: both compilers make vectors of such loops */

static uint8_t mask_some(const uint8_t *restrict level, size_t n, uint8_t mask_above, uint8_t *restrict blind)
{
    uint8_t any = 0;
    for (size_t i = 0; i < n; i++) {
        blind[i] = level[i] > mask_above;
        any |= blind[i];
    }
    return any;
}

bool background_mask(const uint8_t *level, size_t n, uint8_t mask_above, uint8_t *blind)
{
    uint8_t any = 0;
    size_t i = 0;
    for (; i + BLOCK <= n; i += BLOCK)
        any |= mask_some(level + i, BLOCK, mask_above, blind + i);
    return any | mask_some(level + i, n - i, mask_above, blind + i);
}

void background_counts(const struct ping *ping, size_t first, size_t n, uint8_t *out)
{
    if (ping->sample_bytes == 1) {
        memcpy(out, (const uint8_t *)ping->samples + first, n);
        return;
    }
    const uint16_t *wide = (const uint16_t *)ping->samples + first;
    for (size_t i = 0; i < n; i++)
        out[i] = (uint8_t)(wide[i] >> 8);
}
