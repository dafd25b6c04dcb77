/* SPDX-License-Identifier: MIT */
#include "overlap.h"

#include <math.h>

#include "grid/geometry.h"

#define EDGE       1e-9                /* sectors: edges that come so close are common */
#define MARGIN_RAD (4 * GEO_ROUGH_RAD) /* the rough angles of one comparison together are wrong by less */

void overlap_middle(struct overlap_cell *cell, const double v[3])
{
    for (int i = 0; i < 3; i++)
        cell->v[i] = v[i];
    cell->level = sqrt(v[0] * v[0] + v[1] * v[1]);
    cell->az_rad = geo_rough_angle(v[1], v[0]);
    cell->el_rad = geo_rough_angle(-v[2], cell->level);
    cell->exact = false;
}

static struct overlap_run run_of(const struct overlap_band *band, double from, double to)
{
    const double count = (double)band->count, n = fmin(to - from + 1, count);
    if (!(n > 0))
        return (struct overlap_run){0, 0};
    while (from < 0)
        from += count;
    while (from >= count)
        from -= count;
    return (struct overlap_run){(size_t)from, (size_t)n};
}

/* Of sectors that are not all around those between the azimuths az - half and az + half, half <= pi. Past the last one
 * goes on with the first where both ends are touched. */
static struct overlap_run run_in_width(const struct overlap_band *band, double az_rad, double half_rad)
{
    const double count = (double)band->count, wide = band->width_rad, per_rad = count / wide;
    const double off = geo_wrap_pi(az_rad - band->from_rad - wide / 2);
    const double lo = off - half_rad + wide / 2, hi = off + half_rad + wide / 2; /* from the first one on */
    if (hi * per_rad <= EDGE || (lo - wide) * per_rad >= -EDGE)
        return (struct overlap_run){0, 0};
    double from = lo > 0 ? floor(lo * per_rad + EDGE) : 0, to = hi < wide ? ceil(hi * per_rad - EDGE) : count;
    if ((lo + GEO_TURN - wide) * per_rad < -EDGE)
        from = floor((lo + GEO_TURN) * per_rad + EDGE) - count;
    if ((hi - GEO_TURN) * per_rad > EDGE)
        to = count + ceil((hi - GEO_TURN) * per_rad - EDGE);
    return run_of(band, from, to - 1);
}

/* At least the cosine of the elevation of the cell's edge that is nearer to a pole, where aside is most in azimuth. */
static double edge_level(double level, double half_el_rad)
{
    return level * (1 - half_el_rad * half_el_rad / 2) - half_el_rad * sqrt(fmax(0, 1 - level * level));
}

static struct overlap_run exact_run(const struct overlap_band *band, struct overlap_cell *cell, double aside_rad)
{
    if (!cell->exact)
        geo_angles(cell->v, &cell->az_rad, &cell->el_rad);
    cell->exact = true;
    const double half_el = cell->half_el_rad + aside_rad, level = edge_level(cos(cell->el_rad), cell->half_el_rad);
    const double s = aside_rad < GEO_PI / 2 ? sin(aside_rad) : 1;
    const double more = aside_rad <= 0 ? 0 : s < level ? asin(s / level) : GEO_PI;
    if (cell->el_rad + half_el <= band->lo_rad || cell->el_rad - half_el >= band->hi_rad)
        return (struct overlap_run){0, 0};
    const double half = fmin(cell->half_az_rad + more, GEO_PI), width = GEO_TURN / (double)band->count;
    if (band->width_rad > 0)
        return run_in_width(band, cell->az_rad, half);
    return run_of(band, floor((cell->az_rad - half) / width + 0.5 + EDGE),
                  ceil((cell->az_rad + half) / width - 0.5 - EDGE));
}

/* Which side of 0 is x on? 0: too near to it to tell, or NaN. */
static int side_of(double x, double margin)
{
    return x > margin ? 1 : x < -margin ? -1 : 0;
}

/* By how much a cell is wider in azimuth when it is seen from aside; negative: not known. */
static double wider_by(const struct overlap_cell *cell, double aside_rad)
{
    if (aside_rad <= 0)
        return 0;
    const double s = aside_rad < GEO_PI / 2 ? sin(aside_rad) : 1,
                 level = edge_level(cell->level, cell->half_el_rad);
    const int more = side_of(level - s, MARGIN_RAD);
    return more > 0 ? geo_rough_angle(s, sqrt((level - s) * (level + s))) : more < 0 ? GEO_PI : -1;
}

/* floor(x), false where the rough angles leave that open. */
static bool sure_floor(double x, double margin, double *whole)
{
    *whole = floor(x);
    return x - *whole > margin && x - *whole < 1 - margin;
}

/* The same as exact_run, by rough angles; false where they cannot tell. */
static bool rough_run(const struct overlap_band *band, const struct overlap_cell *cell, double aside_rad,
                      struct overlap_run *run)
{
    const double half_el = cell->half_el_rad + aside_rad;
    const int above = side_of(cell->el_rad + half_el - band->lo_rad, MARGIN_RAD),
              below = side_of(band->hi_rad - cell->el_rad + half_el, MARGIN_RAD);
    *run = (struct overlap_run){0, 0};
    if (above < 0 || below < 0)
        return true;
    const double more = wider_by(cell, aside_rad);
    if (!above || !below || more < 0 || band->width_rad > 0)
        return false;
    const double half = fmin(cell->half_az_rad + more, GEO_PI), per_rad = (double)band->count / GEO_TURN;
    const double margin = MARGIN_RAD * per_rad + EDGE;
    double from, before_to;
    if (!sure_floor((cell->az_rad - half) * per_rad + 0.5, margin, &from) ||
        !sure_floor((cell->az_rad + half) * per_rad - 0.5, margin, &before_to))
        return false;
    *run = run_of(band, from, before_to + 1);
    return true;
}

struct overlap_run overlap_run(const struct overlap_band *band, struct overlap_cell *cell, double aside_rad)
{
    struct overlap_run run;
    return rough_run(band, cell, aside_rad, &run) ? run : exact_run(band, cell, aside_rad);
}
