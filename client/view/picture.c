/* SPDX-License-Identifier: MIT */
#include "picture.h"

#include <math.h>
#include <string.h>

#include "png.h"

#define PI         3.14159265358979323846
#define DIRECTIONS 1440 /* a quarter of a degree */

/* From water that was not received to the loudest echo. */
static const uint8_t colours[PNG_COLOURS][3] = {
    {24, 32, 42},   {0, 0, 0},       {32, 14, 2},     {60, 27, 4},     {88, 41, 6},    {116, 55, 8},
    {144, 70, 11},  {170, 86, 15},   {194, 104, 22},  {213, 123, 32},  {228, 143, 46}, {240, 165, 66},
    {248, 187, 94}, {252, 209, 132}, {254, 230, 180}, {255, 250, 235},
};

double picture_range_m(const struct view_rows *rows)
{
    double far_m = 0;
    for (size_t i = 0; i < VIEW_ROWS_MAX && rows->row[i].changed; i++)
        far_m = fmax(far_m, (double)rows->row[i].r1_m);
    return far_m;
}

static double turn(double deg)
{
    return deg - 360 * floor(deg / 360);
}

/* The row whose beam is nearest to each direction, out to the beam's width; NULL: none is. */
static void find_rows(const struct view_rows *rows, const struct view_row *of[DIRECTIONS])
{
    float off[DIRECTIONS];
    memset(of, 0, DIRECTIONS * sizeof *of);
    for (size_t i = 0; i < VIEW_ROWS_MAX && rows->row[i].changed; i++) {
        const struct view_row *row = &rows->row[i];
        const double per_deg = DIRECTIONS / 360.0, middle = turn((double)row->az_deg) * per_deg;
        const int reach = (int)fmin(ceil((double)row->width_deg * per_deg), DIRECTIONS / 2.0);
        for (int k = -reach; k <= reach; k++) {
            const double place = floor(middle) + k;
            const int at = ((int)place + 2 * DIRECTIONS) % DIRECTIONS;
            const float away = (float)fabs(place - middle);
            if (!of[at] || away < off[at]) {
                of[at] = row;
                off[at] = away;
            }
        }
    }
}

/* The loudest bin between two ranges, as a colour. */
static uint8_t shade(const struct view_row *row, double from_m, double to_m)
{
    const double bin_m = (double)(row->r1_m - row->r0_m) / row->n_bins;
    const double first = floor((from_m - (double)row->r0_m) / bin_m), last = (to_m - (double)row->r0_m) / bin_m;
    uint8_t most = 0;
    if (!(bin_m > 0) || last < 0 || first >= row->n_bins)
        return 0;
    for (int i = first > 0 ? (int)first : 0; i < row->n_bins && i <= last; i++)
        most = row->bin[i] > most ? row->bin[i] : most;
    return (uint8_t)(1 + most * (PNG_COLOURS - 2) / 255);
}

void picture_draw(const struct view_rows *rows, uint8_t pixels[PICTURE_SIDE * PICTURE_SIDE])
{
    const struct view_row *of[DIRECTIONS];
    const double pixel_m = picture_range_m(rows) / (PICTURE_SIDE / 2.0);
    find_rows(rows, of);
    for (int y = 0; y < PICTURE_SIDE; y++) {
        for (int x = 0; x < PICTURE_SIDE; x++) {
            const double forward = PICTURE_SIDE / 2.0 - y - 0.5, right = x + 0.5 - PICTURE_SIDE / 2.0;
            const double r_m = hypot(forward, right) * pixel_m;
            const double at = turn(atan2(right, forward) * 180 / PI) * DIRECTIONS / 360;
            const struct view_row *row = of[(int)at % DIRECTIONS];
            pixels[y * PICTURE_SIDE + x] =
                row && row->n_bins > 0 ? shade(row, r_m - pixel_m / 2, r_m + pixel_m / 2) : 0;
        }
    }
}

void picture_png(const struct view_rows *rows, struct bytes *out)
{
    uint8_t pixels[PICTURE_SIDE * PICTURE_SIDE];
    picture_draw(rows, pixels);
    png_write(out, pixels, PICTURE_SIDE, PICTURE_SIDE, colours);
}
