/* SPDX-License-Identifier: MIT */
#include "free_water.h"

#include <math.h>
#include <string.h>

#include "own_ring.h"

/*
 * What the weakest reference wall returns of full scale, in decibels of power, where the device's gain is normal: a
 * level below which nobody sets up a sonar. Scales of decibels are laid out so that walls come nowhere near their end.
 */
#define WALL_DB     (-21.0)
#define WALL_LOG_DB (-46.0)

/* A wall fills three resolution cells or more; all three are this much below their mean in one beam of a hundred. */
#define FADING_DB 6.0

/* The baseline hides a target that is not so many times as strong. */
#define HIDES 2.0

/* A ring-down so many times (6 dB) the usual one is not the head's alone. */
#define RINGS_ON 4.0

static const double below_wall_db[] = {
    [EXTRACT_WALL] = 0.0, [EXTRACT_PILE] = 6.0, [EXTRACT_NET] = 12.0, [EXTRACT_LINE] = 18.0};

double free_water_detectable(enum amplitude_law law, double gain_db, enum extract_target target)
{
    const double wall_db = law == AMPLITUDE_LOG ? WALL_LOG_DB : WALL_DB;

    return pow(10.0, (wall_db + gain_db - FADING_DB - below_wall_db[target]) / 10.0);
}

bool free_water_is_dumb(const struct profile *p)
{
    const uint32_t n = p->axis->n;
    uint32_t loud = p->first, silent = 0;

    while (loud < n && profile_saturated(p, loud))
        loud++;
    while (silent < n && profile_count(p, silent) == 0)
        silent++;
    return loud == n || silent == n;
}

static double power_of(const struct profile *p, uint64_t cells)
{
    return (double)(int64_t)cells * (double)(UINT64_C(1) << p->shift);
}

static double cell_power(const struct profile *p, uint32_t i)
{
    return power_of(p, p->cell[i]);
}

static uint32_t loudest_near_head(const struct profile *p, const struct baseline *b)
{
    uint32_t top = 0;

    for (uint32_t i = 1; i < p->axis->n && i < 3 * p->axis->guard; i++)
        top = b->level[i] > b->level[top] ? i : top;
    return top;
}

uint32_t free_water_begin(const struct profile *p, const struct baseline *b, double detectable)
{
    uint32_t i = loudest_near_head(p, b);

    while (i < p->axis->n && HIDES * b->level[i] >= detectable)
        i++;
    return i < p->axis->n ? i : p->first;
}

bool free_water_rings_on(const struct profile *p, const struct baseline *b, uint32_t end)
{
    for (uint32_t i = 0; i < end; i++)
        if ((double)p->cell[i] >= RINGS_ON * baseline_usual(b, p, i) &&
            (double)p->cell[i] >= RINGS_ON * (double)own_ring_cell(p, i))
            return true;
    return false;
}

bool free_water_stands_out(const struct profile *p, const struct baseline *b, uint32_t i, double contrast)
{
    return (double)p->cell[i] >= contrast * baseline_usual(b, p, i);
}

/* Cells of a block that are quieter than this are neither as loud as the target nor stand out. */
static double quiet_power(const struct profile *p, const struct baseline *b, uint32_t block, double detectable,
                          double contrast)
{
    const double calm = b ? b->calm[block] : INFINITY,
                 floor = profile_floor(p) * (double)(UINT64_C(1) << p->shift);
    const double unusual = contrast * (calm > floor ? calm : floor);

    return unusual < detectable ? unusual : detectable;
}

/* The first cell from `begin` on that is masked, as loud as the target, or stands out of the baseline; n: none. */
static uint32_t free_until(const struct profile *p, const struct baseline *b, uint32_t begin, double detectable,
                           double contrast)
{
    const uint8_t *masked =
        p->blind && begin < p->axis->n ? memchr(p->blind + begin, 1, p->axis->n - begin) : NULL;
    const uint32_t n = masked ? (uint32_t)(masked - p->blind) : p->axis->n;
    uint32_t i = begin;

    while (i < n) {
        const uint32_t block = i / PROFILE_BLOCK, next = (block + 1) * PROFILE_BLOCK, end = next < n ? next : n;
        const double quiet = quiet_power(p, b, block, detectable, contrast);
        if (power_of(p, p->bits[block]) < quiet)
            i = end;
        for (; i < end; i++)
            if (cell_power(p, i) >= quiet &&
                (cell_power(p, i) >= detectable || (b && free_water_stands_out(p, b, i, contrast))))
                return i;
    }
    return i;
}

struct free_water free_water_find(const struct profile *p, const struct baseline *b, uint32_t begin,
                                  double detectable, double contrast, uint32_t passed)
{
    const uint32_t n = p->axis->n, half = p->axis->half;

    for (uint32_t i = p->blind ? passed : 0; i-- > begin;)
        if (profile_blind(p, i)) {
            begin = i + 1;
            break;
        }
    while (begin < n && cell_power(p, begin) >= detectable && !profile_saturated(p, begin) &&
           !(b && free_water_stands_out(p, b, begin, contrast)))
        begin++;
    uint32_t end = free_until(p, b, begin, detectable, contrast);
    if (end < n && !profile_blind(p, end))
        end -= end > half ? half : end; /* what stands in this cell may begin half a pulse before its middle */
    return (struct free_water){begin, end};
}
