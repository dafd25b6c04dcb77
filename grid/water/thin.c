/* SPDX-License-Identifier: MIT */
#include "thin.h"

#include <math.h>

#include "grid/geometry.h"

#define NEAR_M    0.15
#define NEAR_COS  0.99756 /* of 4 degrees */
#define ALIKE_M   0.05    /* ends of free water that differ by less are the same */
#define ALIKE_TAN 1e-9

static bool is_near(const struct water_record *a, const struct water_record *b)
{
    const double way[3] = {a->place_m[0] - b->place_m[0], a->place_m[1] - b->place_m[1],
                           a->place_m[2] - b->place_m[2]};
    bool near = geo_length(way) <= NEAR_M && fabs(a->drift_m[0] - b->drift_m[0]) <= NEAR_M;
    for (int k = 0; k < 3; k++)
        near = near && geo_dot(a->axis[k], b->axis[k]) >= NEAR_COS;
    return near;
}

static bool is_alike(const struct water_image *a, const struct water_image *b)
{
    return a->columns == b->columns && a->rows == b->rows && fabs(a->tan_az[0] - b->tan_az[0]) <= ALIKE_TAN &&
           fabs(a->tan_az[a->columns] - b->tan_az[b->columns]) <= ALIKE_TAN;
}

/* A place where a record's water ends. */
struct place {
    double north_m[3]; /* NED */
    int row;
};

static bool shows_end(const struct water_record *r, const struct place *p)
{
    const struct water_image *image = &r->image;
    const double to[3] = {p->north_m[0] - r->place_m[0], p->north_m[1] - r->place_m[1],
                          p->north_m[2] - r->place_m[2]};
    const double ahead = geo_dot(to, r->axis[0]), right = geo_dot(to, r->axis[1]), range_m = geo_length(to);
    if (ahead <= 0)
        return range_m <= NEAR_M; /* the sensor is all but there */
    const int column = water_image_find(image->tan_az, image->columns, right / ahead);
    for (int i = column > 0 ? column - 1 : 0; i <= column + 1 && i < image->columns; i++) {
        const struct water_cell cell = image->cell[p->row * image->columns + i];
        if (cell.ends != WATER_NO_END && cell.ends * WATER_UNIT_M <= range_m + ALIKE_M)
            return true;
    }
    return false;
}

static struct place end_of(const struct water_record *r, int row, int column)
{
    const struct water_image *image = &r->image;
    const double tan_az = (image->tan_az[column] + image->tan_az[column + 1]) / 2,
                 tan_el = (image->tan_el[row] + image->tan_el[row + 1]) / 2;
    const double to_m = image->cell[row * image->columns + column].ends * WATER_UNIT_M;
    const double ahead = to_m / sqrt((1 + tan_az * tan_az) * (1 + tan_el * tan_el)), right = ahead * tan_az,
                 down = -tan_el * sqrt(ahead * ahead + right * right);
    struct place p = {.row = row};
    for (int k = 0; k < 3; k++)
        p.north_m[k] = r->place_m[k] + ahead * r->axis[0][k] + right * r->axis[1][k] + down * r->axis[2][k];
    return p;
}

/* All rows end at the same echoes: the axis' stands for them. */
bool thin_spares(const struct water_record *before, const struct water_record *middle,
                 const struct water_record *newest)
{
    const int row = middle->image.rows / 2;
    if (!is_near(before, newest) || !is_near(before, middle) || !is_alike(&before->image, &middle->image) ||
        !is_alike(&middle->image, &newest->image))
        return false;
    for (int i = 0; middle->echoes && i < middle->image.columns; i++) {
        if (middle->image.cell[row * middle->image.columns + i].ends == WATER_NO_END)
            continue;
        const struct place end = end_of(middle, row, i);
        if (!shows_end(before, &end) || !shows_end(newest, &end))
            return false;
    }
    return true;
}
