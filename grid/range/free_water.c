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

/*
 * By so much less is heard off the axis: at BEAM_SIDE_SHARE of the way to the edge the two-way pattern has lost 3 dB.
 * Halfway to the edge it has lost 1.5 dB, and as much again is the map's margin for a surface that is met there at an
 * angle. At the edge it has lost 6 dB, and a whole surface that the edge grazes may be 10 dB weaker than the target, as
 * a soft bottom is: docs/map.md has what each costs.
 */
#define SIDE_LOSS         2.0
#define EDGE_LOSS         4.0
#define EDGE_SURFACE_LOSS 40.0

double free_water_detectable(enum amplitude_law law, double gain_db, double below_wall_db)
{
    const double wall_db = law == AMPLITUDE_LOG ? WALL_LOG_DB : WALL_DB;
    return pow(10.0, (wall_db + gain_db - FADING_DB - below_wall_db) / 10.0);
}

double free_water_bottom_over_wall(double below_wall_db)
{
    return pow(10.0, (FADING_DB - below_wall_db) / 10.0);
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

/* From cell `begin` on, as free_water_find has it. */
static struct free_water free_from(const struct profile *p, const struct baseline *b, uint32_t begin,
                                   double detectable, double contrast)
{
    const uint32_t n = p->axis->n, half = p->axis->half;
    while (begin < n && cell_power(p, begin) >= detectable && !profile_saturated(p, begin) &&
           !(b && free_water_stands_out(p, b, begin, contrast)))
        begin++;
    uint32_t end = free_until(p, b, begin, detectable, contrast);
    if (end < n && !profile_blind(p, end))
        end -= end > half ? half : end; /* what stands in this cell may begin half a pulse before its middle */
    return (struct free_water){begin, end};
}

struct free_water free_water_find(const struct profile *p, const struct baseline *b, uint32_t begin,
                                  double detectable, double contrast, uint32_t passed)
{
    for (uint32_t i = p->blind ? passed : 0; i-- > begin;)
        if (profile_blind(p, i)) {
            begin = i + 1;
            break;
        }
    return free_from(p, b, begin, detectable, contrast);
}

static uint32_t sooner(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

struct free_water free_water_before_surface(const struct profile *p, struct free_water w, double power)
{
    const uint32_t window = w.begin < w.end ? sooner(p->axis->window, w.end - w.begin) : 0;
    const uint64_t most = profile_below(p, power * (double)window);
    uint64_t sum = 0;
    /* no mean is louder than all of its cells */
    const uint32_t loud = window ? profile_next_above(p, w.begin, w.end, profile_below(p, power)) : w.end;
    if (loud >= w.end)
        return w;
    uint32_t at = loud - w.begin >= window ? loud - window + 1 : w.begin;
    const uint32_t last = w.end - window, latest = sooner(w.begin + window, last);
    for (uint32_t i = at; i < at + window; i++)
        sum += p->cell[i];
    while (at == w.begin && sum > most && w.begin < latest) {
        sum += p->cell[w.begin + window] - p->cell[w.begin];
        at = ++w.begin;
    }
    for (; sum <= most && at < last; at++)
        sum += p->cell[at + window] - p->cell[at];
    return (struct free_water){w.begin, sum > most ? at : w.end};
}

/* ---- off the axis ---- */

struct free_water_aside free_water_aside(const struct profile *p, const struct baseline *b, struct free_water w,
                                         double detectable, double contrast)
{
    const uint32_t side_end = sooner(free_from(p, b, w.begin, detectable / SIDE_LOSS, contrast).end, w.end);
    struct free_water edge = free_from(p, b, w.begin, detectable / EDGE_LOSS, contrast);
    edge.end = sooner(edge.end, side_end);
    struct free_water surface = edge;
    if (edge.begin >= edge.end || edge.end - edge.begin < p->axis->window)
        surface.end = surface.begin; /* too short to tell one */
    return (struct free_water_aside){side_end, edge,
                                     free_water_before_surface(p, surface, detectable / EDGE_SURFACE_LOSS)};
}
