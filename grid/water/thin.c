/* SPDX-License-Identifier: MIT */
#include "thin.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"

#define NEAR_M    0.15
#define NEAR_RAD  (4 * GEO_PI / 180)
#define CLOSE_M   2.0  /* as seen from so far, or farther away, images of two places overlap */
#define ALIKE_M   0.05 /* ends of free water that differ by less are the same */
#define ALIKE_TAN 1e-9

static double way_m(const struct water_record *a, const struct water_record *b)
{
    const double way[3] = {a->place_m[0] - b->place_m[0], a->place_m[1] - b->place_m[1],
                           a->place_m[2] - b->place_m[2]};
    return geo_length(way);
}

static bool drifted_little(const struct water_record *a, const struct water_record *b)
{
    return fabs(a->drift_m[0] - b->drift_m[0]) <= NEAR_M && fabs(a->drift_m[1] - b->drift_m[1]) <= NEAR_M;
}

/* Half of an image's width or height, whichever is less. */
static double half_rad(const struct water_image *image)
{
    const double wide_rad = atan(image->tan_az[image->columns]) - atan(image->tan_az[0]),
                 high_rad = atan(image->tan_el[image->rows]) - atan(image->tan_el[0]);
    return fmin(wide_rad, high_rad) / 2;
}

/* What a narrow image shows only others show that overlap it. */
static bool is_near(const struct water_record *a, const struct water_record *b)
{
    const double half = half_rad(&a->image), least_cos = cos(fmin(NEAR_RAD, half));
    bool near = way_m(a, b) <= fmin(NEAR_M, half * CLOSE_M) && drifted_little(a, b);
    for (int k = 0; k < 3; k++)
        near = near && geo_dot(a->axis[k], b->axis[k]) >= least_cos;
    return near;
}

static bool is_alike(const struct water_image *a, const struct water_image *b)
{
    return a->columns == b->columns && a->rows == b->rows && fabs(a->tan_az[0] - b->tan_az[0]) <= ALIKE_TAN &&
           fabs(a->tan_az[a->columns] - b->tan_az[b->columns]) <= ALIKE_TAN &&
           fabs(a->tan_el[0] - b->tan_el[0]) <= ALIKE_TAN &&
           fabs(a->tan_el[a->rows] - b->tan_el[b->rows]) <= ALIKE_TAN;
}

/* A place where a record's water ends. */
struct place {
    double north_m[3]; /* NED */
    double to[3];      /* the direction from the record's own place to it ... */
    double at_m;       /* ... and how far away it is */
    int row;
};

/* In that column or, as bearings are rounded and the sensor turns, up to `beside` from it. */
static bool shows_end_in(const struct water_image *image, int row, int column, double range_m, int beside)
{
    for (int i = column > beside ? column - beside : 0; i <= column + beside && i < image->columns; i++) {
        const struct water_cell cell = image->cell[row * image->columns + i];
        if (cell.ends != WATER_NO_END && cell.ends * WATER_UNIT_M <= range_m + ALIKE_M)
            return true;
    }
    return false;
}

/* All rows of one elevation end at the same echoes. What is as near as sensors may be apart ends the direction. */
static bool shows_end(const struct water_record *r, const struct place *p, int beside)
{
    const struct water_image *image = &r->image;
    const bool here = p->at_m <= NEAR_M;
    double to[3];
    for (int k = 0; k < 3; k++)
        to[k] = here ? p->to[k] : p->north_m[k] - r->place_m[k];
    const double ahead = geo_dot(to, r->axis[0]), right = geo_dot(to, r->axis[1]),
                 range_m = here ? p->at_m : geo_length(to);
    if (ahead <= 0)
        return false;
    const int column = water_image_find(image->tan_az, image->columns, right / ahead);
    if (image->parts == image->rows)
        return shows_end_in(image, p->row, column, range_m, beside);
    const double tan_el = -geo_dot(to, r->axis[2]) / hypot(ahead, right);
    const int row = water_image_find(image->tan_el, image->rows, tan_el);
    for (int y = row > beside ? row - beside : 0; y <= row + beside && y < image->rows; y++)
        if (shows_end_in(image, y, column, range_m, beside))
            return true;
    return false;
}

static struct place end_of(const struct water_record *r, int row, int column)
{
    const struct water_image *image = &r->image;
    const double tan_az = (image->tan_az[column] + image->tan_az[column + 1]) / 2,
                 tan_el = (image->tan_el[row] + image->tan_el[row + 1]) / 2;
    const double ahead = 1 / sqrt((1 + tan_az * tan_az) * (1 + tan_el * tan_el)), right = ahead * tan_az,
                 down = -tan_el * sqrt(ahead * ahead + right * right);
    struct place p = {.at_m = image->cell[row * image->columns + column].ends * WATER_UNIT_M, .row = row};
    for (int k = 0; k < 3; k++) {
        p.to[k] = ahead * r->axis[0][k] + right * r->axis[1][k] + down * r->axis[2][k];
        p.north_m[k] = r->place_m[k] + p.at_m * p.to[k];
    }
    return p;
}

/* Seen by both may be something else that stands beside it, nearer; at the place itself one of them ends, too, what is
 * older. */
static bool spares_row(const struct water_record *before, const struct water_record *middle,
                       const struct water_record *newest, int row)
{
    for (int i = 0; i < middle->image.columns; i++) {
        if (middle->image.cell[row * middle->image.columns + i].ends == WATER_NO_END)
            continue;
        const struct place end = end_of(middle, row, i);
        if (!shows_end(before, &end, 1) || !shows_end(newest, &end, 1) ||
            !(shows_end(before, &end, 0) || shows_end(newest, &end, 0)))
            return false;
    }
    return true;
}

bool thin_spares(const struct water_record *before, const struct water_record *middle,
                 const struct water_record *newest)
{
    const struct water_image *image = &middle->image;
    if (newest->newest_ns > before->t_ns + THIN_JOINED_NS)
        return false;
    if (!is_near(before, newest) || !is_near(before, middle) || !is_alike(&before->image, image) ||
        !is_alike(image, &newest->image))
        return false;
    for (int row = image->parts / 2; middle->echoes && row < image->rows; row += image->parts)
        if (!spares_row(before, middle, newest, row))
            return false;
    return true;
}

/* ---- pings from one place ---- */

#define STILL_M   0.01
#define STILL_RAD 1e-3

/* The angle between their axes. */
static double turned_rad(const struct water_record *a, const struct water_record *b)
{
    double trace = 0;
    for (int k = 0; k < 3; k++)
        trace += geo_dot(a->axis[k], b->axis[k]);
    return acos(fmax(-1, fmin(1, (trace - 1) / 2)));
}

static bool is_same(const double *a, const double *b, int n)
{
    for (int i = 0; i < n; i++)
        if (fabs(a[i] - b[i]) > ALIKE_TAN)
            return false;
    return true;
}

bool thin_is_still(const struct water_record *older, const struct water_record *newer)
{
    const struct water_image *a = &older->image, *b = &newer->image;
    if (way_m(older, newer) > STILL_M || newer->path_m - older->path_m > STILL_M ||
        !drifted_little(older, newer) || turned_rad(older, newer) > STILL_RAD || a->columns != b->columns ||
        a->rows != b->rows || !is_same(a->tan_az, b->tan_az, a->columns + 1) ||
        !is_same(a->tan_el, b->tan_el, a->rows + 1))
        return false;
    for (int i = 0; older->echoes && i < a->columns * a->rows; i++)
        if (a->cell[i].ends != WATER_NO_END &&
            b->cell[i].least * WATER_UNIT_M > a->cell[i].ends * WATER_UNIT_M + ALIKE_M)
            return false;
    return true;
}

/* A newer echo ends what an older ping found free. */
static struct water_cell join_cells(struct water_cell older, struct water_cell newer)
{
    older.least = older.least < newer.ends ? older.least : newer.ends;
    return water_cell_join(older, newer);
}

void thin_join(const struct water_record *older, const struct water_record *newer, struct water_record *joined,
               struct row_room *room)
{
    const struct water_image *a = &older->image, *b = &newer->image;
    *joined = *older;
    joined->newest_ns = newer->newest_ns;
    joined->seq = newer->seq;
    joined->uncertain_m = fmax(older->uncertain_m, newer->uncertain_m + way_m(older, newer));
    joined->tilt_rad = fmax(older->tilt_rad, newer->tilt_rad + turned_rad(older, newer));
    for (int k = 0; k < 3; k++)
        joined->spread_m[k] = fmax(older->spread_m[k], newer->spread_m[k]);
    joined->ahead_m = fmax(older->ahead_m, newer->ahead_m);
    joined->gap_m = fmax(older->gap_m, newer->gap_m);
    joined->echoes = older->echoes || newer->echoes;
    memcpy(room->tan_az, b->tan_az, (b->columns + 1u) * sizeof *b->tan_az);
    memcpy(room->tan_el, b->tan_el, (b->rows + 1u) * sizeof *b->tan_el);
    for (int i = 0; i < b->columns * b->rows; i++)
        room->cell[i] = join_cells(a->cell[i], b->cell[i]);
    joined->image.tan_az = room->tan_az;
    joined->image.tan_el = room->tan_el;
    joined->image.near_m = fmin(a->near_m, b->near_m);
    water_image_fill(&joined->image, room->cell);
}
