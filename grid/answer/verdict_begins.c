/* SPDX-License-Identifier: MIT */
#include "verdict_begins.h"

#include <math.h>

#include "verdict_ask.h"
#include "verdict_why.h"

/* Where the first water begins is told a little beyond the distance, too. */
double verdict_farthest_start_m(const struct verdict *v)
{
    return fmin(verdict_distance_m(v) + verdict_near_m(v), VERDICT_FARTHEST_M - WATER_GRID_M);
}

#define MORE 1.2 /* times as far, at least: a corridor has many lines that begin late */

#define STEP_M     (WATER_GRID_M / 4)
#define STEP_SHARE 0.0625 /* of the range: the farther away, the fewer places are tried */

/* Where beyond from_m the water begins to be free along a line, by one record; INFINITY: nowhere before most_m. */
static double begins_by(const struct water_view *view, const struct water_tile *line, double from_m, double most_m)
{
    struct water_pieces said;
    const double least_m = from_m + fmax(STEP_M, STEP_SHARE * from_m);
    double begin_m = from_m, end_m = most_m;
    if (!(from_m < most_m) || !water_touches(view, line, &begin_m, &end_m))
        return INFINITY;
    water_decide(view, line, begin_m, end_m, &said);
    for (int k = 0; k < said.n; k++)
        if (said.piece[k].says == WATER_FREE && said.piece[k].to_m > least_m)
            return fmax(said.piece[k].from_m, least_m);
    return INFINITY;
}

/* The same by all records that count. */
double verdict_begins_along_m(const struct verdict *v, const struct water_tile *line, double from_m, double most_m)
{
    double least_m = INFINITY;
    for (int i = 0; i < v->n; i++)
        least_m = fmin(least_m, begins_by(&v->view[i], line, from_m, most_m));
    return least_m;
}

static double round_up(double range_m)
{
    return ceil(range_m / STEP_M) * STEP_M;
}

/* Where from from_m on the tile in which it ended the last time begins to be free before most_m. */
double verdict_tile_begins_m(struct verdict *v, const struct verdict_part *part, double from_m, double most_m,
                             double *ends_m)
{
    const struct ask_stretch within = {from_m, most_m};
    return ask_begins_m(&v->ask, v->view, v->n, &part->tile, &within, ends_m);
}

/* Seeks on from where it has come; false: it is to be called again. What ends there may not farther on, where the tile
 * touches less of the same record, or another of its beams. */
static bool seek(struct verdict *v, const struct verdict_part *part, double most_m, double *begin_m)
{
    const double from_m = v->sought_m, to_m = fmin(2 * from_m, most_m);
    double ends_m = INFINITY;
    *begin_m = from_m < to_m ? verdict_tile_begins_m(v, part, from_m, to_m, &ends_m) : INFINITY;
    v->sought_m = isfinite(ends_m) ? round_up(ends_m + fmax(STEP_M, STEP_SHARE * ends_m)) : to_m;
    return isfinite(*begin_m) || v->sought_m >= most_m;
}

/* The tile, or where a corridor leaves it. */
double verdict_begins_m(struct verdict *v, const struct verdict_part *part, double from_m, double most_m)
{
    const struct water_tile cone = tiles_cone(&part->tile);
    struct ask_stretch asked;
    double least_m;
    if (!v->seeking)
        v->sought_m = from_m + STEP_M;
    v->seeking = !seek(v, part, most_m, &least_m);
    if (v->seeking)
        return VERDICT_UNSOUGHT;
    if (v->query.line.corridor && question_stretch(&v->ask.question, &cone, v->ask.question.asked.to_m, &asked) &&
        asked.to_m < most_m)
        least_m = fmin(least_m, asked.to_m);
    return round_up(v->query.line.corridor ? fmax(least_m, MORE * from_m) : least_m);
}

/* The direction in the middle of a part, in the axes of the records. */
static void middle_of(const struct verdict *v, size_t part, double axis[3])
{
    struct ask_band band;
    if (!v->query.around) {
        verdict_axis(v, axis);
        return;
    }
    verdict_band(v, part, &band);
    geo_direction(verdict_middle_rad(&v->query.band, part), (band.lo_rad + band.hi_rad) / 2, axis);
    quat_rotate(band.attitude, axis, axis);
}

#define NEWEST 4

/* Where in the middle of a part the water begins within `near` by the newest records that have some of it; INFINITY:
 * nowhere. */
static double begins_within_m(const struct verdict *v, size_t part)
{
    struct water_tile line = {.half_rad = VERDICT_LOOK_RAD};
    double least_m = INFINITY;
    int n = 0;
    middle_of(v, part, line.v);
    for (int i = 0; i < v->n && n < NEWEST; i++) {
        const double begin_m = begins_by(&v->view[i], &line, 0, verdict_near_m(v));
        n += isfinite(begin_m);
        least_m = fmin(least_m, begin_m);
    }
    return least_m;
}

/* Into n that grow. */
static void insert(double *sorted, size_t n, double x)
{
    for (; n > 0 && sorted[n - 1] > x; n--)
        sorted[n] = sorted[n - 1];
    sorted[n] = x;
}

#define MOST_PARTS 0.75
#define SOME_PARTS 24 /* evenly around */

/* Where most parts' water begins, within `near`. The first of a corridor's lies to its sides, which few beams see. */
double verdict_most_begin_m(const struct verdict *v)
{
    double begin_m[SOME_PARTS];
    const size_t some = v->parts < SOME_PARTS ? v->parts : SOME_PARTS;
    size_t n = 0;
    for (size_t k = 0; k < some && !v->query.line.corridor; k++) {
        const double one_m = begins_within_m(v, k * v->parts / some);
        if (isfinite(one_m))
            insert(begin_m, n++, one_m);
    }
    if (n == 0)
        return verdict_near_m(v);
    return fmin(round_up(begin_m[(size_t)(MOST_PARTS * (double)(n - 1))]), verdict_near_m(v));
}
