/* SPDX-License-Identifier: MIT */
/*
 * test_decide - what one record says of one tile: each margin by itself, where it begins to count, and all of them
 * together against points of the tile that are looked up in the image.
 */
#include "tests/lib/random.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/decide.h"

#define COLUMNS_MOST 128
#define FINE_M       (2 * WATER_GRID_M / 4) /* of the thinnest tiles: two steps of the grid */

static double tan_az[COLUMNS_MOST + 1], tan_el[8];
static struct water_cell cells[6 * COLUMNS_MOST];
static struct water_record record;
static struct water_view view;
static struct water_tile tile;
static struct water_pieces out;

/* An image of columns and rows of that width around straight ahead, all free from 0.5 to 5 m. */
static void begin(int columns, int rows, double column_deg, double row_deg)
{
    record = (struct water_record){.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    record.image = (struct water_image){.columns = (uint16_t)columns,
                                        .rows = (uint16_t)rows,
                                        .parts = 1,
                                        .tan_az = tan_az,
                                        .tan_el = tan_el,
                                        .near_m = 0.5};
    for (int i = 0; i <= columns; i++)
        tan_az[i] = tan(geo_rad((i - columns / 2.0) * column_deg));
    for (int i = 0; i <= rows; i++)
        tan_el[i] = tan(geo_rad((i - rows / 2.0) * row_deg));
    for (int i = 0; i < columns * rows; i++)
        cells[i] = (struct water_cell){.from = 50, .least = 500, .most = 500, .ends = WATER_NO_END};
    water_image_fill(&record.image, cells);
    view = (struct water_view){.record = &record};
}

/* All of it is one cell of 20 by 20 degrees. */
static void begin_one(void)
{
    begin(1, 1, 20, 20);
}

static void aim(double az_deg, double el_deg, double half_deg)
{
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), tile.v);
    tile.half_rad = geo_rad(half_deg);
}

/* The stretch that is free; from above to: nothing is. */
struct stretch {
    double from_m, to_m;
};

static struct stretch free_in(double az_deg, double el_deg, double half_deg)
{
    struct stretch s = {INFINITY, -INFINITY};
    aim(az_deg, el_deg, half_deg);
    water_decide(&view, &tile, 0, 12, &out);
    for (int i = 0; i < out.n; i++)
        if (out.piece[i].says == WATER_FREE) {
            s.from_m = fmin(s.from_m, out.piece[i].from_m);
            s.to_m = fmax(s.to_m, out.piece[i].to_m);
        }
    return s;
}

static bool is_free(double az_deg, double el_deg, double half_deg)
{
    const struct stretch s = free_in(az_deg, el_deg, half_deg);
    return s.from_m < s.to_m;
}

/* From where on the water ends; INFINITY: nowhere. */
static double ends_m(double az_deg, double el_deg, double half_deg)
{
    aim(az_deg, el_deg, half_deg);
    water_decide(&view, &tile, 0, 12, &out);
    return out.piece[out.n - 1].says == WATER_ENDED ? out.piece[out.n - 1].from_m : INFINITY;
}

/* A thin tile is free from there to there, to the grid's step, and no farther. */
#define CHECK_FREE(az_deg, el_deg, begin_m, end_m)                                                                \
    do {                                                                                                          \
        const struct stretch got_s = free_in(az_deg, el_deg, 0);                                                  \
        CHECK(got_s.from_m >= (begin_m)-1e-9 && got_s.from_m <= (begin_m) + FINE_M);                              \
        CHECK(got_s.to_m <= (end_m) + 1e-9 && got_s.to_m >= (end_m)-FINE_M);                                      \
    } while (0)

#define CHECK_ENDS(az_deg, el_deg, at_m)                                                                          \
    do {                                                                                                          \
        const double got_m = ends_m(az_deg, el_deg, 0);                                                           \
        CHECK(got_m <= (at_m) + 1e-9 && got_m >= (at_m)-FINE_M);                                                  \
    } while (0)

/* Of a stretch from 0 to end_m it is not free nearer to middle_m than off_m, and is so from not far beyond that on. */
#define CHECK_GAP(middle_m, off_m, end_m)                                                                         \
    do {                                                                                                          \
        const double gap_m = (middle_m), half_m = (off_m);                                                        \
        water_decide(&view, &tile, 0, end_m, &out);                                                               \
        CHECK(out.piece[0].says == WATER_FREE && out.piece[out.n - 1].says == WATER_FREE);                        \
        for (int i = 0; i < out.n; i++)                                                                           \
            CHECK(out.piece[i].says != WATER_FREE || out.piece[i].to_m <= gap_m - half_m + 1e-9 ||                \
                  out.piece[i].from_m >= gap_m + half_m - 1e-9);                                                  \
    } while (0)

/* At that angle beside a side of the image something of that size fits in from here on. */
static double fits_from(double radius_m, double aside_deg)
{
    return radius_m / sin(geo_rad(aside_deg));
}

/* ---- one cell, one thing at a time ---- */

TEST(water_is_free_within_the_cell_and_its_ranges)
{
    begin_one();
    CHECK_FREE(0, 0, 0.5, 5);
    for (int side = -1; side <= 1; side += 2) {
        CHECK_FREE(side * 9.9, 0, 0.5, 5);
        CHECK_FREE(0, side * 9.8, 0.5, 5);
        CHECK(!is_free(side * 10.1, 0, 0));
        CHECK(!is_free(0, side * 10.1, 0));
        CHECK(is_free(side * 8.8, 0, 1) && !is_free(side * 9.2, 0, 1));
        CHECK(is_free(0, side * 8.8, 1) && !is_free(0, side * 9.2, 1));
    }
    CHECK(!is_free(180, 0, 0) && !is_free(170, 0, 5) && !is_free(90, 0, 1));
    CHECK(ends_m(0, 0, 0) == INFINITY);
    view.keeps_m = 3;
    CHECK_FREE(0, 0, 0.5, 3);
    view.keeps_m = 0.8;
    CHECK_FREE(0, 0, 0.5, 0.8);
    view.lost = true;
    CHECK(!is_free(0, 0, 0));
}

/* From anywhere to anywhere, if one multiple of the grid lies between them. */
TEST(a_stretch_is_divided_at_the_first_multiple_of_the_grid_and_at_the_last)
{
    begin_one();
    cells[0].least = cells[0].most = 501;
    aim(0, 0, 0);
    for (int last = 0; last < 2; last++) {
        water_decide(&view, &tile, 4.99, last ? 5.011 : 5.02, &out);
        CHECK(out.piece[0].says == WATER_FREE && out.piece[0].to_m == 5);
    }
}

TEST(water_ends_where_it_may_touch_an_echo)
{
    begin_one();
    cells[0].ends = cells[0].least = cells[0].most = 400;
    for (int lost = 0; lost < 2; lost++) {
        view.lost = lost;
        view.margin_m = 0;
        CHECK_ENDS(0, 0, 4);
        CHECK(fabs(ends_m(10.5, 0, 1) - 4) < 2 * WATER_GRID_M && fabs(ends_m(0, -10.5, 1) - 4) < 2 * WATER_GRID_M);
        CHECK(ends_m(11.5, 0, 1) == INFINITY && ends_m(0, 11.5, 1) == INFINITY && ends_m(180, 0, 1) == INFINITY);
        view.margin_m = 0.2;
        CHECK_ENDS(0, 0, 3.8);
    }
}

/* The vehicle may be elsewhere: ranges count less far, and the sides come nearer. */
TEST(margins_of_place_make_free_water_smaller)
{
    begin_one();
    view.margin_m = 0.2;
    CHECK_FREE(0, 0, fits_from(0.2, 10), 4.8);
    CHECK_FREE(0, 5, fits_from(0.2, 10), 4.8);
    for (int side = -1; side <= 1; side += 2)
        CHECK_FREE(side * 5, 0, fits_from(0.2, 5), 4.8);
    begin_one();
    view.lift_m = 0.2;
    CHECK_FREE(5, 0, fits_from(0.2, 10), 5);
    for (int side = -1; side <= 1; side += 2)
        CHECK_FREE(0, side * 5, fits_from(0.2, 5), 5);
    begin_one();
    record.spread_m[0] = 0.2;
    CHECK_FREE(9, 9, 0.7, 4.8);
    begin_one();
    record.spread_m[1] = 0.2;
    CHECK_FREE(0, 9, fits_from(0.2, 10), 5);
    CHECK_FREE(5, 0, fits_from(0.2, 5), 5);
    begin_one();
    record.spread_m[2] = 0.2;
    CHECK_FREE(9, 0, fits_from(0.2, 10), 5);
    CHECK_FREE(0, 5, fits_from(0.2, 5), 5);
}

/* Far to the side of a wide image, and high above it, they count from the sensor as well as straight ahead. */
TEST(margins_count_from_the_sensor_wherever_it_looks)
{
    const double steep = tan(geo_rad(8)) / tan(geo_rad(10));
    for (int side = -1; side <= 1; side += 2) {
        begin(1, 1, 120, 20);
        view.margin_m = 0.2;
        CHECK_FREE(side * 50, 0, fits_from(0.2, 10), 4.8);
        begin(1, 1, 120, 20);
        view.level_m = 0.5;
        CHECK_FREE(side * 50, 8, 0.5 / (1 - steep) / cos(geo_rad(8)), 5);
        view.lift_m = 0.2; /* from as near as it may be by its drift */
        CHECK_FREE(side * 50, 0, fits_from(0.2, 10) + 0.5, 5);
        begin(1, 1, 20, 150);
        CHECK_FREE(0, side * 60, 0.5, 5);
    }
}

TEST(margins_of_direction_take_the_sides_alone)
{
    begin_one();
    view.margin_rad = geo_rad(2);
    CHECK_FREE(7.8, 0, 0.5, 5);
    CHECK_FREE(0, 9.8, 0.5, 5);
    CHECK(!is_free(8.2, 0, 0) && !is_free(-8.2, 0, 0));
    begin_one();
    view.lift_rad = geo_rad(2);
    CHECK_FREE(0, 7.8, 0.5, 5);
    CHECK_FREE(9.8, 0, 0.5, 5);
    CHECK(!is_free(0, 8.2, 0) && !is_free(0, -8.2, 0));
}

/* What is as high as before and nearer is seen steeper; what is farther away, less steeply. */
TEST(level_drift_changes_how_steep_water_is_seen)
{
    const double steep = tan(geo_rad(8)) / tan(geo_rad(10)), flat = tan(geo_rad(5)) / tan(geo_rad(6));
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        view.level_m = 0.5;
        CHECK_FREE(0, side * 8, 0.5 / (1 - steep) / cos(geo_rad(8)), 5);
        CHECK_FREE(0, 0, 0.5, 5);
        begin_one();
        tan_el[0] = tan(geo_rad(side > 0 ? 5 : -40));
        tan_el[1] = tan(geo_rad(side > 0 ? 40 : -5));
        view.level_m = 0.5;
        CHECK_FREE(0, side * 6, 0.5 * flat / (1 - flat) / cos(geo_rad(6)), 5);
    }
}

/* The vehicle is 1 m beside, above, below or behind the sensor by now. */
TEST(a_tile_begins_at_the_vehicle_and_lies_where_the_sensor_sees_it)
{
    const double side_m = 1 / tan(geo_rad(10)), s5 = sin(geo_rad(5));
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        cells[0].least = cells[0].most = 800;
        view.at_m[1] = side;
        CHECK_FREE(0, 0, side_m, sqrt(8 * 8 - 1));
        CHECK_FREE(side * -5, 0, cos(geo_rad(10)) / sin(geo_rad(15)), s5 + sqrt(s5 * s5 + 63));
        view.at_m[1] = 0;
        view.at_m[2] = side;
        CHECK_FREE(0, 0, side_m, sqrt(8 * 8 - 1));
        view.at_m[2] = 0;
        view.at_m[0] = side;
        CHECK_FREE(0, 0, side > 0 ? 0 : 1.5, 8 - side);
    }
}

/* From ahead towards the sensor, with margins. */
TEST(a_tile_that_comes_nearer_is_free_as_long_as_it_fits_in)
{
    for (int up = 0; up < 2; up++) {
        begin_one();
        view.at_m[0] = 6;
        view.margin_m = up ? 0 : 0.2;
        view.lift_m = up ? 0.2 : 0;
        CHECK_FREE(180, 0, up ? 1 : 1.2, 6 - fits_from(0.2, 10));
    }
}

/* A way that passes beside the sensor, above or below it, is seen steepest in its middle. */
TEST(a_way_is_as_high_as_where_it_is_highest)
{
    for (int side = -1; side <= 1; side += 2)
        for (int up = -1; up <= 1; up += 2)
            for (int later = 0; later < 2; later++) {
                begin(1, 1, 120, 40);
                cells[0].least = cells[0].most = 800;
                memcpy(view.at_m, (double[3]){2, -3 * side, up}, sizeof view.at_m);
                aim(90 * side, 0, 0);
                water_decide(&view, &tile, 0, later ? 7 : 6, &out);
                const double far_m = sqrt(1 / (tan_el[1] * tan_el[1]) - 2 * 2);
                double free_m = 0;
                for (int i = 0; i < out.n; i++)
                    if (out.piece[i].says == WATER_FREE) {
                        CHECK(out.piece[i].to_m <= 3 - far_m || out.piece[i].from_m >= 3 + far_m);
                        free_m += out.piece[i].to_m - out.piece[i].from_m;
                    }
                const double sides_m = 2 * (tan(geo_rad(60)) - 1.5); /* of it beyond the image */
                CHECK(sides_m < 0.5 && free_m >= (later ? 6 + 0.46 : 6) - 2 * far_m - 4 * FINE_M);
                CHECK(out.judged > out.n && out.judged < 150);
            }
}

/* Its axes need not be those of the world. */
TEST(a_record_lies_as_its_sensor_lay)
{
    begin_one();
    memcpy(record.axis, (double[3][3]){{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}, sizeof record.axis);
    CHECK_FREE(90, 0, 0.5, 5);
    CHECK(is_free(90, -9, 0) && is_free(99, 0, 0));
    CHECK(!is_free(0, 0, 0) && !is_free(-90, 0, 0) && !is_free(90, -11, 0));
}

/* What lies beside the sensor is nearer to it by some of the tile, and farther by others. */
TEST(a_wide_tile_beside_the_sensor_loses_range)
{
    begin(1, 1, 120, 120);
    CHECK(free_in(0, 0, 1).to_m > 5 - 2 * WATER_GRID_M && free_in(0, 0, 1).from_m < 0.5 + 2 * WATER_GRID_M);
    view.at_m[1] = 2;
    const double end_m = sqrt(5 * 5 - 2 * 2), wide_m = end_m * geo_rad(1);
    CHECK(free_in(0, 0, 1).to_m <= end_m - 0.3 * wide_m);
    CHECK(free_in(0, 0, 1).to_m >= end_m - wide_m - 2 * WATER_GRID_M);
}

/* What may be above the sensor as well as beside it is nowhere, however high the image reaches. */
TEST(water_that_may_have_drifted_over_the_sensor_is_not_free)
{
    const double c = cos(geo_rad(60)), s = sin(geo_rad(60));
    for (int side = -1; side <= 1; side += 2) {
        begin(1, 1, 20, 150);
        cells[0].from = 0;
        record.image.near_m = 0;
        view.level_m = 0.5;
        CHECK_FREE(0, side * 60, 0.5 * tan_el[1] / (c * tan_el[1] - s), 5);
    }
    begin_one(); /* nor what comes towards it, from there on where it may be beside or behind it */
    cells[0].from = 0;
    view.at_m[0] = 6;
    view.level_m = 0.7;
    CHECK_FREE(180, 0, 1, 5.3);
}

/* It passes half a metre before the sensor: nearer than that it is never. */
TEST(a_way_is_free_where_it_passes_near_the_sensor)
{
    for (int side = -1; side <= 1; side += 2)
        for (int up = -1; up <= 1; up += 2) {
            begin(1, 1, 150, 120);
            cells[0].from = 0;
            record.image.near_m = 0;
            memcpy(view.at_m, (double[3]){0.5, -1.1 * side, -0.1 * up}, sizeof view.at_m);
            aim(90 * side, 0, 0);
            water_decide(&view, &tile, 0, 2.5, &out);
            CHECK(out.n == 1 && out.piece[0].says == WATER_FREE);
            tan_el[0] = -0.15; /* half a metre away it is seen steeper than that */
            tan_el[1] = 0.15;
            CHECK_GAP(1.1, sqrt(0.1 * 0.1 / (0.15 * 0.15) - 0.25), 2.5);
            tan_el[0] = -1;
            tan_el[1] = 1;
            cells[0].from = 60; /* or nearer */
            CHECK_GAP(1.1, sqrt(0.6 * 0.6 - 0.1 * 0.1 - 0.25), 2.5);
        }
}

/* It climbs: it is seen steepest behind where it is nearest. */
TEST(a_way_that_climbs_is_as_high_as_where_it_is_highest)
{
    for (int side = -1; side <= 1; side += 2)
        for (int up = -1; up <= 1; up += 2) {
            begin(1, 1, 164, 90);
            cells[0] = (struct water_cell){.least = 3000, .most = 3000, .ends = WATER_NO_END};
            record.image.near_m = 0;
            memcpy(view.at_m, (double[3]){1, -3 * side, 2 * up}, sizeof view.at_m);
            aim(90 * side, 45 * up, 0);
            tan_el[0] = up > 0 ? -1 : -1.3;
            tan_el[1] = up > 0 ? 1.3 : 1;
            /* (x - 2)^2 = 1.3^2 (1 + (x - 3)^2), x the level way */
            const double middle = (6 * 1.69 - 4) / 2 / 0.69, off = sqrt(middle * middle - (16.9 - 4) / 0.69);
            CHECK_GAP(middle * sqrt(2), off * sqrt(2), 9.8);
        }
}

/* Nor does it count from where it is nearest in all, but from where it passes over the sensor or below it. */
TEST(a_way_that_climbs_may_have_drifted_over_the_sensor)
{
    for (int up = -1; up <= 1; up += 2) {
        begin(1, 1, 150, 160);
        cells[0].from = 0;
        record.image.near_m = 0;
        view.level_m = 0.5;
        memcpy(view.at_m, (double[3]){0.4, -1.1, 0.3 * up}, sizeof view.at_m);
        aim(90, 45 * up, 0);
        CHECK_GAP(1.1 * sqrt(2), 0.3 * sqrt(2), 3);
    }
}

/* A stretch beside the sensor that no multiple of the grid divides; its nearest and its farthest point. */
static void aim_beside(double beside_m, double at_m, double *from_m, double *to_m, double *nearest_m,
                       double *farthest_m)
{
    begin(1, 1, 150, 150);
    cells[0].from = 0;
    record.image.near_m = 0;
    cells[0].least = cells[0].most = 3000;
    view.at_m[1] = beside_m;
    aim(0, 0, 0);
    tile.half_rad = 0.199;
    *from_m = at_m;
    *to_m = at_m + 0.01;
    const double c = cos(0.199), s = sin(0.199);
    *nearest_m = hypot(*from_m * c, beside_m - *from_m * s);
    *farthest_m = hypot(*to_m * c, beside_m + *to_m * s);
}

/* By how much a wide tile may be nearer than its axis, or farther: all of it counts, and little more. */
TEST(a_wide_tile_is_as_near_and_as_far_as_its_nearest_and_farthest_point)
{
    double from_m, to_m, nearest_m, farthest_m;
    for (int kind = 0; kind < 4; kind++) {
        const bool wide = kind / 2, more = kind % 2;
        aim_beside(wide ? 20 : 2, wide ? 10.01 : 4.05, &from_m, &to_m, &nearest_m, &farthest_m);
        cells[0].from = (uint16_t)ceil(100 * nearest_m - (more ? 3 : 0));
        water_decide(&view, &tile, from_m, to_m, &out);
        CHECK_INT(out.piece[0].says == WATER_FREE, more);
        cells[0].from = 0;
        cells[0].least = cells[0].most = (uint16_t)floor(100 * farthest_m + (more ? wide ? 40 : 6 : 0));
        water_decide(&view, &tile, from_m, to_m, &out);
        CHECK_INT(out.piece[0].says == WATER_FREE, more);
    }
}

/* A way through the image in which every second column is free: too many pieces are none. */
TEST(water_ends_where_there_are_too_many_pieces)
{
    begin(COLUMNS_MOST, 1, 1, 20);
    for (int i = 0; i < COLUMNS_MOST; i++)
        cells[i] = (struct water_cell){
            .from = 0, .least = i % 2 ? 60000 : 0, .most = i % 2 ? 60000 : 0, .ends = WATER_NO_END};
    record.image.near_m = 0;
    water_image_fill(&record.image, cells);
    view.at_m[0] = 30;
    view.at_m[1] = -40;
    aim(90, 0, 0);
    for (double from_m = 0; from_m < 10; from_m = out.piece[1].from_m) { /* whatever the last of them says */
        water_decide(&view, &tile, from_m, 100, &out);
        CHECK_INT(out.n, WATER_PIECES);
        CHECK(out.piece[out.n - 1].says == WATER_ENDED && out.piece[out.n - 1].mixed);
        CHECK(out.piece[out.n - 1].to_m < 90);
        int free = 0;
        for (int i = 0; i + 1 < out.n; i++) {
            CHECK(out.piece[i].says != WATER_ENDED && out.piece[i].to_m == out.piece[i + 1].from_m);
            free += out.piece[i].says == WATER_FREE;
        }
        CHECK(free > WATER_PIECES / 5);
    }
}

/* ---- rows of a head that follow each other ---- */

static struct water_record later, last;
static struct water_view later_view, last_view;
static struct water_cell later_cells[2], last_cells[2];

/* The same, turned by so much. */
static void follow(struct water_record *r, struct water_view *as, struct water_cell *cell, double turned_deg)
{
    const double c = cos(geo_rad(turned_deg)), s = sin(geo_rad(turned_deg));
    *r = record;
    memcpy(r->axis, (double[3][3]){{c, s, 0}, {-s, c, 0}, {0, 0, 1}}, sizeof r->axis);
    cell[0] = cells[0];
    water_image_fill(&r->image, cell);
    *as = (struct water_view){.record = r};
}

/* What begins in one of them, where the head came from, and goes on in the next ones until it ends in one is free. */
TEST(water_is_free_in_rows_that_follow_each_other)
{
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        record.sense = side;
        follow(&later, &later_view, later_cells, side * 10);
        const double az = side * 9.5;
        CHECK(!is_free(az, 0, 1.5));
        view.next = &later_view;
        CHECK(is_free(az, 0, 1.5) && !is_free(-az, 0, 1.5));
        CHECK(!is_free(az, 9.5, 1.5)); /* neither holds what is above them */
        record.sense = later.sense = -side;
        CHECK(!is_free(az, 0, 1.5));
        record.sense = later.sense = side;
        later_view.lost = true;
        CHECK(!is_free(az, 0, 1.5));
        later_view.lost = false;
        later_cells[0].least = 0; /* by the next one it is not */
        CHECK(!is_free(az, 0, 1.5));
        follow(&later, &later_view, later_cells, side * 0.5); /* it does not hold all of it, ... */
        CHECK(!is_free(az, 0, 1.5));
        follow(&last, &last_view, last_cells, side * 10);
        later_view.next = &last_view;
        CHECK(is_free(az, 0, 1.5)); /* ... which another one does */
        last_cells[0].least = 0;
        CHECK(!is_free(az, 0, 1.5));
    }
}

/* As far as the image has it, to the grid's step: a long stretch is divided for them, too. */
TEST(water_of_rows_that_follow_each_other_is_free_as_far_as_they_have_it)
{
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        record.sense = side;
        follow(&later, &later_view, later_cells, side * 10);
        view.next = &later_view;
        const struct stretch s = free_in(side * 9.5, 0, 1.5);
        CHECK(s.to_m <= 5 && s.to_m >= 5 - 2 * WATER_GRID_M);
    }
}

/* What is above or below the first row slips past its beams, whatever the next ones hold. */
TEST(a_row_holds_what_begins_in_it_from_below_to_above)
{
    static const double later_el[2] = {-1, 1};
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        record.sense = 1;
        follow(&later, &later_view, later_cells, 10);
        later.image.tan_el = later_el;
        view.next = &later_view;
        CHECK(is_free(9.5, side * 7, 1.5) && !is_free(9.5, side * 9.5, 1.5));
    }
}

/* The next row was sent from beside: as seen from there all of it lies where the head came from. What the row sees
 * elsewhere takes nothing from it. */
TEST(a_row_that_lies_beyond_takes_nothing)
{
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        record.sense = side;
        follow(&later, &later_view, later_cells, side * 10);
        later_cells[0].least = 0;
        view.next = &later_view;
        CHECK(!is_free(side * 9.5, 0, 1.5));
        later_view.at_m[1] = -3 * side;
        CHECK(is_free(side * 9.5, 0, 1.5));
    }
}

/* The way leads past the next row's sensor and on behind it: there it has no bearing, and that row does not tell on
 * which side it is. */
TEST(what_a_row_has_no_bearing_of_does_not_go_on_in_it)
{
    const double past_m = 0.5 / sin(geo_rad(10.5));
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        record.sense = side;
        follow(&later, &later_view, later_cells, side * 110);
        follow(&last, &last_view, last_cells, side * 10);
        later_cells[0].from = 0;
        view.next = &later_view;
        later_view.next = &last_view;
        later_view.at_m[0] = 0.5;
        later_view.at_m[1] = -2 * side;
        const struct stretch s = free_in(side * 9.5, 0, 1.5);
        CHECK(past_m < 3 && s.to_m <= past_m && s.to_m > past_m - 0.5);
    }
}

/* ---- what is told of smaller tiles, and what is asked of shorter stretches ---- */

/* What all of the tile meets is told of its parts as well; what only some of it does is mixed. */
TEST(what_smaller_tiles_may_be_told_otherwise_is_mixed)
{
    begin_one();
    aim(0, 0, 1);
    water_decide(&view, &tile, 0.1, 0.4, &out); /* nearer than anything is free */
    CHECK(out.n == 1 && out.piece[0].says == WATER_NOTHING && !out.piece[0].mixed);
    aim(10, 0, 1);
    water_decide(&view, &tile, 6, 8, &out); /* farther than anything is */
    CHECK(out.n == 1 && out.piece[0].says == WATER_NOTHING && !out.piece[0].mixed);
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        view.at_m[1] = -3 * side; /* it comes into the image and leaves it again */
        aim(side * 45, 0, 3);
        water_decide(&view, &tile, 0.5, 12, &out);
        CHECK_INT(out.n, 5);
        for (int i = 0; i < out.n; i++) {
            CHECK_INT(out.piece[i].mixed, i == 1 || i == 3);
            CHECK(out.piece[i].says == (i == 2 ? WATER_FREE : WATER_NOTHING));
        }
    }
    for (int up = 0; up < 2; up++) { /* only one of two cells ends it */
        begin(up ? 1 : 2, up ? 2 : 1, 10, 10);
        cells[0] = (struct water_cell){.from = 50, .least = 400, .most = 400, .ends = 400};
        water_image_fill(&record.image, cells);
        aim(0, 0, 1);
        water_decide(&view, &tile, 4.2, 4.25, &out);
        CHECK(out.piece[0].says == WATER_ENDED && out.piece[0].mixed);
    }
}

/* Some of it is nearer than the echo, though the axis is not. */
TEST(a_tile_of_which_some_is_before_an_echo_is_mixed)
{
    double from_m, to_m, nearest_m, farthest_m;
    aim_beside(2, 4.05, &from_m, &to_m, &nearest_m, &farthest_m);
    for (int more = 0; more < 2; more++) {
        cells[0].ends = (uint16_t)(100 * nearest_m + (more ? 1 : -3));
        cells[0].least = cells[0].most = cells[0].ends;
        water_decide(&view, &tile, from_m, to_m, &out);
        CHECK(out.piece[0].says == WATER_ENDED);
        CHECK_INT(out.piece[0].mixed, more);
    }
}

/* Towards the sensor it is nearer than the axis, on the other side farther: there a smaller tile may be free. */
TEST(a_tile_of_which_one_side_may_be_free_is_mixed)
{
    double from_m, to_m, nearest_m, farthest_m;
    for (int far = 0; far < 2; far++)
        for (int more = 0; more < 2; more++) {
            aim_beside(2, 4.05, &from_m, &to_m, &nearest_m, &farthest_m);
            const uint16_t at = (uint16_t)(100 * (far ? farthest_m : nearest_m) + (more == far ? -6 : 6));
            record.image.near_m = far ? at * WATER_UNIT_M : 0;
            cells[0] = far ? (struct water_cell){.from = at, .least = 900, .most = 900, .ends = WATER_NO_END}
                           : (struct water_cell){.least = at, .most = at, .ends = WATER_NO_END};
            water_decide(&view, &tile, from_m, to_m, &out);
            CHECK(out.piece[0].says == WATER_NOTHING);
            CHECK_INT(out.piece[0].mixed, more);
            aim(0, 0, 0);
            geo_direction((far ? 1 : -1) * 0.185, 0, tile.v);
            water_decide(&view, &tile, from_m, to_m, &out);
            CHECK_INT(out.piece[0].says == WATER_FREE, more);
        }
}

static int judged_in(double az_deg, double el_deg, double half_deg, double from_m, double to_m)
{
    aim(az_deg, el_deg, half_deg);
    water_decide(&view, &tile, from_m, to_m, &out);
    CHECK(out.n == 1 && out.piece[0].says != WATER_FREE);
    return out.judged;
}

/* Where each part of a stretch is kept from being free by the same thing it is not divided. */
TEST(a_stretch_of_which_no_part_can_be_free_is_judged_once)
{
    for (int side = -1; side <= 1; side += 2) {
        begin_one(); /* each part reaches beyond the same side */
        CHECK_INT(judged_in(side * 9.6, 0, 1.5, 2, 4), 1);
        CHECK_INT(judged_in(0, side * 9.6, 1.5, 2, 4), 1);
        double *const margins[] = {&view.margin_m, &record.spread_m[1], &view.lift_m, &record.spread_m[2]};
        for (int i = 0; i < 4; i++) {
            *margins[i] = 0.3;
            CHECK_INT(judged_in(i < 2 ? side * 9 : 0, i < 2 ? 0 : side * 9, 0, 1, 1.5), 1);
            *margins[i] = 1; /* the sensor is within what it may be, ... */
            CHECK_INT(judged_in(0, 0, 0, 0.2, 0.8), 1);
            *margins[i] = 0;
        }
        for (int up = 0; up < 2; up++) {
            *(up ? &view.lift_rad : &view.margin_rad) = geo_rad(2);
            CHECK_INT(judged_in(up ? 0 : side * 9, up ? side * 9 : 0, 0, 1, 1.5), 1);
            view.lift_rad = view.margin_rad = 0;
        }
        view.margin_m = 0.5; /* ... or none of it before the sensor */
        view.at_m[0] = -0.1;
        view.at_m[1] = -side;
        CHECK_INT(judged_in(side * 90, 0, 0, 1.7, 2.4), 1);
        view.at_m[0] = -0.5;
        CHECK_INT(judged_in(side * 45, 0, 0, 0.5, 0.6), 1);
    }
}

/* ... nor where all of them touch a cell that is too near, too far or at its echo. */
TEST(a_stretch_is_judged_once_where_all_of_it_touches_what_denies_it)
{
    begin(2, 1, 10, 20);
    cells[1].least = cells[1].most = 900;
    water_image_fill(&record.image, cells);
    CHECK_INT(judged_in(0, 0, 1, 6, 8), 1);
    begin(2, 1, 10, 20); /* though its sum is told farther */
    cells[0].most = 900;
    water_image_fill(&record.image, cells);
    CHECK_INT(judged_in(-5, 0, 1, 6, 8), 1);
    begin(2, 1, 10, 20);
    record.image.near_m = 0;
    cells[1].from = 0;
    water_image_fill(&record.image, cells);
    CHECK_INT(judged_in(0, 0, 1, 0.2, 0.4), 1);
    begin(2, 1, 10, 20);
    for (int i = 0; i < 2; i++)
        cells[i].ends = cells[i].least = cells[i].most = 400;
    water_image_fill(&record.image, cells);
    CHECK_INT(judged_in(0, 0, 1, 5, 8), 1);
    CHECK(out.piece[0].says == WATER_ENDED);
}

/* What comes into the image as it goes on, for a margin counts less and less: it is divided where the last of it is
 * in. */
TEST(a_stretch_is_divided_where_a_margin_leaves_room_for_its_end)
{
    const double free_m = 1 / sin(geo_rad(16.7 + 10.6));
    for (int side = -1; side <= 1; side += 2)
        for (int up = 0; up < 2; up++) {
            begin_one();
            double *ends = up ? tan_el : tan_az;
            ends[side < 0] = tan(geo_rad(side * -60));
            ends[side > 0] = tan(geo_rad(side * 10.6));
            (up ? tan_az : tan_el)[0] = -1;
            (up ? tan_az : tan_el)[1] = 1;
            *(up ? &view.lift_m : &view.margin_m) = 1;
            aim(up ? 0 : side * -16.7, up ? side * -16.7 : 0, 0);
            water_decide(&view, &tile, 2, 2.24, &out);
            const struct water_piece *piece = &out.piece[out.n - 1];
            CHECK(piece->says == WATER_FREE && piece->from_m >= free_m && piece->from_m < free_m + FINE_M);
        }
}

/* ---- what need not be asked ---- */

static bool touches(double *from_m, double *to_m)
{
    *from_m = 0;
    *to_m = 10;
    return water_touches(&view, &tile, from_m, to_m);
}

TEST(a_stretch_is_shortened_to_the_image)
{
    double from_m, to_m;
    begin_one();
    aim(0, 0, 1);
    CHECK(touches(&from_m, &to_m) && from_m <= 0 && to_m >= 10);
    for (int side = -1; side <= 1; side += 2) {
        aim(side * 30, 0, 1);
        CHECK(!touches(&from_m, &to_m) || to_m < 1e-4);
    }
    for (int side = -1; side <= 1; side += 2) { /* its sides need not be alike */
        begin_one();
        tan_az[side > 0] = side * tan(geo_rad(40));
        aim(side * 30, 0, 1);
        CHECK(touches(&from_m, &to_m) && from_m <= 0 && to_m >= 10);
        aim(side * -30, 0, 1);
        CHECK(!touches(&from_m, &to_m) || to_m < 1e-4);
    }
    const double c = cos(geo_rad(10)), s = sin(geo_rad(10)), h = sqrt(0.5);
    for (int side = -1; side <= 1; side += 2) {
        begin_one();
        view.at_m[1] = -3 * side; /* it comes in at one side, and leaves at the other */
        aim(side * 45, 0, 0);
        CHECK(touches(&from_m, &to_m));
        CHECK_NEAR(from_m, 3 * c / (h * (c + s)), 0, 1e-5);
        CHECK_NEAR(to_m, 3 * c / (h * (c - s)), 0, 1e-5);
        tile.half_rad = 0.1; /* the sides are as much nearer as the tile is wide */
        CHECK(touches(&from_m, &to_m));
        CHECK_NEAR(from_m, 3 * c / (h * (c + s) + 0.1), 0, 1e-5);
        CHECK_NEAR(to_m, 3 * c / (h * (c - s) - 0.1), 0, 1e-5);
        tile.half_rad = 0;
        view.margin_rad = 0.1;
        CHECK(touches(&from_m, &to_m));
        CHECK_NEAR(from_m, (3 * c - 0.1 * 3) / (h * (c + s) + 0.1), 0, 1e-5);
        CHECK_NEAR(to_m, (3 * c + 0.1 * 3) / (h * (c - s) - 0.1), 0, 1e-5);
        view.at_m[2] = 2; /* bearings may be turned up and down as well */
        CHECK(touches(&from_m, &to_m));
        CHECK_NEAR(from_m, (3 * c - 0.1 * sqrt(13)) / (h * (c + s) + 0.1), 0, 1e-5);
        view.at_m[0] = 4; /* the farther, the more */
        CHECK(touches(&from_m, &to_m));
        CHECK_NEAR(from_m, (3 * c - 4 * s - 0.1 * sqrt(29)) / (h * (c + s) + 0.1), 0, 1e-5);
        CHECK_NEAR(to_m, (3 * c + 4 * s + 0.1 * sqrt(29)) / (h * (c - s) - 0.1), 0, 1e-5);
        view.at_m[0] = view.at_m[2] = 0;
        view.margin_rad = 0;
        for (int kind = 0; kind < 2; kind++) {
            view.margin_m = kind ? 0 : 0.3;
            record.spread_m[1] = kind ? 0.3 : 0;
            CHECK(touches(&from_m, &to_m));
            CHECK_NEAR(from_m, (3 * c - 0.3) / (h * (c + s)), 0, 1e-5);
            CHECK_NEAR(to_m, (3 * c + 0.3) / (h * (c - s)), 0, 1e-5);
        }
    }
}

/* It comes no nearer to that side, nor farther from it. */
TEST(a_way_along_a_side_of_the_image_is_in_it_or_not)
{
    double from_m, to_m;
    for (int side = -1; side <= 1; side += 2)
        for (int in = 0; in < 2; in++) {
            begin_one();
            view.at_m[1] = in ? -side : side;
            aim(side * 10, 0, 0);
            CHECK(touches(&from_m, &to_m) == in);
            CHECK(!in || to_m >= 10);
        }
}

TEST(an_image_covers_what_may_touch_it)
{
    begin_one();
    aim(10.5, 0, 1);
    CHECK(water_covers(&view, &tile, 3));
    aim(0, -10.5, 1);
    CHECK(water_covers(&view, &tile, 3));
    aim(11.5, 0, 1);
    CHECK(!water_covers(&view, &tile, 3));
    view.at_m[1] = -3;
    aim(45, 0, 0);
    CHECK(!water_covers(&view, &tile, 3.5) && water_covers(&view, &tile, 4.2) && !water_covers(&view, &tile, 5.3));
}

static double radius_m;

static bool looks(double az_deg, double el_deg, double at_m, double within_deg)
{
    double v[3];
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), v);
    return water_looks(&view, v, at_m, &(struct water_sought){3, geo_rad(within_deg), radius_m});
}

TEST(a_beam_looks_as_far_as_it_hears)
{
    begin_one();
    for (int side = -1; side <= 1; side += 2) {
        CHECK(looks(side * 9, 0, 4, 0) && !looks(side * 11, 0, 4, 0));
        CHECK(looks(side * 11, 0, 4, 1.5) && !looks(side * 12, 0, 4, 1.5));
        CHECK(looks(0, side * 9, 4, 0) && !looks(0, side * 11, 4, 1.5));
    }
    CHECK(!looks(180, 0, 4, 1) && !looks(180, 0, 4, 0));
    radius_m = 0.1; /* what is so thick counts where some of it is in the beam */
    CHECK(looks(14, 0, 1, 0) && !looks(14, 0, 2, 0) && looks(14, 0, 2, 5));
    radius_m = 0;
    CHECK(looks(0, 0, 4.9, 0) && !looks(0, 0, 5.1, 0));
    CHECK(looks(0, 0, 0.1, 0)); /* no beam shows its blind zone */
    record.ahead_m = 0.6;
    CHECK(looks(0, 0, 0.61, 0) && !looks(0, 0, 0.59, 0));
    record.ahead_m = 0;
    view.at_m[0] = 0.5; /* the vehicle has gone on */
    CHECK(looks(0, 0, 4.4, 0) && !looks(0, 0, 4.6, 0));
    view.at_m[0] = 0;
    cells[0].most = 0; /* it is deaf, */
    CHECK(!looks(0, 0, 2, 0));
    cells[0].ends = 300; /* or has an echo */
    CHECK(looks(0, 0, 2.9, 0) && !looks(0, 0, 3.1, 0));
    cells[0].most = 400; /* another one beside it goes on */
    CHECK(looks(0, 0, 3.9, 0) && !looks(0, 0, 4.1, 0));
    CHECK(looks(0, 15, 1, 0) && !looks(0, 15, 3.5, 0)); /* as high as 3 m away */
}

/* A sensor that lies on its side has beside it what an upright one has above or below: that stands elsewhere. Pitched,
 * it meets what stands on its way higher or lower. */
TEST(what_stands_upright_is_not_sought_beside_a_sensor_on_its_side)
{
    begin_one();
    CHECK(looks(0, 25, 1, 0) && !looks(20, 0, 1, 0));
    for (int side = -1; side <= 1; side += 2) {
        memcpy(record.axis, (double[3][3]){{1, 0, 0}, {0, 0, side}, {0, -side, 0}}, sizeof record.axis);
        CHECK(looks(0, 0, 1, 0) && looks(9, 0, 1, 0) && looks(-9, 0, 1, 0));
        CHECK(!looks(25, 0, 1, 0) && !looks(-25, 0, 1, 0) && !looks(0, 25, 1, 0));
        const double c = cos(geo_rad(20)), s = side * sin(geo_rad(20));
        memcpy(record.axis, (double[3][3]){{1, 0, 0}, {0, c, s}, {0, -s, c}}, sizeof record.axis);
        CHECK(looks(9, 0, 1, 0) && looks(-9, 0, 1, 0) && !looks(12, 0, 1, 0) && !looks(-12, 0, 1, 0));
        CHECK(looks(0, 20, 1, 0) && looks(0, -20, 1, 0));
        memcpy(record.axis, (double[3][3]){{c, 0, s}, {0, 1, 0}, {-s, 0, c}}, sizeof record.axis);
        CHECK(looks(0, 0, 1, 0) && !looks(0, 0, 4, 0) && !looks(12, 0, 1, 0));
    }
}

/* 3 cm do not count. What was sent 0.5 m farther beside the row's place may, 4 m away, have passed 7.2 degrees beside
 * where its azimuth lies. */
TEST(beams_sent_from_beside_the_row_look_less_far_aside)
{
    begin_one();
    record.spread_m[1] = 0.53;
    for (int side = -1; side <= 1; side += 2) {
        CHECK(looks(side * 2, 0, 4, 0) && !looks(side * 4, 0, 4, 0));
        CHECK(looks(side * 4, 0, 4, 3) && !looks(side * 12, 0, 4, 8) && looks(side * 12, 0, 4, 10));
    }
    CHECK(looks(0, 0, 3, 0) && !looks(0, 0, 2, 0) && !looks(0, 0, 0.4, 0));
    record.spread_m[1] = 0.03;
    CHECK(looks(9.9, 0, 4, 0) && looks(9.9, 0, 0.1, 0));
    begin(3, 3, 5, 5); /* whichever of them was there must have reached so far */
    for (int i = 0; i < 9; i++)
        cells[i].most = i == 4 ? 500 : 300;
    record.spread_m[1] = 0.13;
    CHECK(looks(0, 0, 4, 0));
    record.spread_m[1] = 0.23;
    CHECK(!looks(0, 0, 4, 0) && looks(0, 0, 2.9, 0));
    record.gap_m = 2.5; /* nearer it may have passed between two of them ... */
    CHECK(!looks(0, 0, 2.4, 0) && looks(0, 0, 2.6, 0));
    record.spread_m[1] = 0.03; /* ... that were sent from no farther beside than counts */
    CHECK(looks(0, 0, 2.4, 0));
}

TEST(only_the_beam_that_passes_there_looks)
{
    begin(3, 3, 5, 5);
    for (int i = 0; i < 9; i++)
        cells[i].most = i == 4 ? 500 : 0;
    CHECK(looks(0, 0, 4, 0));
    for (int side = -1; side <= 1; side += 2) { /* or near it */
        CHECK(!looks(side * 5, 0, 4, 1) && looks(side * 5, 0, 4, 3));
        CHECK(looks(0, side * 5, 4, 1) && !looks(0, side * 9, 4, 1)); /* what is there stands upright */
    }
}

/* ---- all of it together, against points ---- */

static uint64_t seed;

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

/* A wide image, and a way that crosses it anyhow. */
static void draw_wide_world(void)
{
    begin(5, 3, 28, between(8, 15));
    for (int i = 0; i < 15; i++)
        cells[i].least = cells[i].most = (uint16_t)between(600, 900);
    record.image.near_m = 0;
    water_image_fill(&record.image, cells);
    for (int i = 0; i < 3; i++)
        view.at_m[i] = between(-3, 3);
    aim(between(-180, 180), between(-60, 60), between(0, 0.4));
}

/* Some cells are free, some end, some do neither. */
static void draw_narrow_world(void)
{
    begin(1 + (int)between(0, 12), 1 + (int)between(0, 3.99), between(2, 9), between(3, 12));
    for (int i = 0; i < record.image.columns * record.image.rows; i++) {
        const uint16_t most = between(0, 1) < 0.2 ? 0 : (uint16_t)between(300, 900);
        const bool ends = most && between(0, 1) < 0.5;
        cells[i] = (struct water_cell){
            .from = (uint16_t)between(0, 90), .least = most, .most = most, .ends = ends ? most : WATER_NO_END};
    }
    record.image.near_m = 0;
    water_image_fill(&record.image, cells);
    for (int i = 0; i < 3; i++) {
        view.at_m[i] = between(0, 1) < 0.3 ? 0 : between(-1, 1);
        record.spread_m[i] = between(0, 1) < 0.5 ? 0 : between(0, 0.1);
    }
    if (between(0, 1) < 0.7) {
        const double off_m = between(0, 0.1);
        view.level_m = between(0, 0.3);
        view.margin_m = off_m + view.level_m;
        view.lift_m = off_m;
        view.margin_rad = between(0, 0.05);
        view.lift_rad = between(0, 1) * view.margin_rad;
    }
    aim(between(-1, 1) * record.image.columns * 4, between(-1, 1) * record.image.rows * 6, between(0.1, 4));
}

static void draw_world(void)
{
    if (between(0, 1) < 0.4)
        draw_wide_world();
    else
        draw_narrow_world();
}

/* A point of the tile, from the sensor: ahead, right, up. */
static void draw_point(double t_m, double p[3])
{
    double off[3], v[3];
    for (int i = 0; i < 3; i++)
        off[i] = between(-1, 1);
    const double along = geo_dot(off, tile.v), aside = sqrt(geo_dot(off, off) - along * along);
    const double far = tan(tile.half_rad * sqrt(between(0, 1)));
    for (int i = 0; i < 3; i++)
        v[i] = tile.v[i] + far * (off[i] - along * tile.v[i]) / aside;
    for (int i = 0; i < 3; i++)
        p[i] = (i < 2 ? 1 : -1) * (view.at_m[i] + t_m * v[i] / geo_length(v));
}

/* Where the sensor may have seen it: the vehicle had drifted level, and was elsewhere besides. */
static void move_point(double p[3])
{
    const double to_rad = between(0, GEO_TURN), level_m = view.level_m * between(0, 1);
    double ball[3];
    for (int i = 0; i < 3; i++)
        ball[i] = between(-1, 1);
    const double share = view.lift_m * between(0, 1) / geo_length(ball);
    p[0] += level_m * cos(to_rad) + share * ball[0];
    p[1] += level_m * sin(to_rad) + share * ball[1];
    p[2] += share * ball[2];
}

/* The cell that it then lies in, NULL: none, and how far from the sensor: its beams were turned, and sent beside it. */
static const struct water_cell *see_point(const double p[3], double *range_m)
{
    const struct water_image *image = &record.image;
    const double to_rad = between(0, GEO_TURN), level_m = hypot(p[0], p[1]), away_m = geo_length(p);
    const double az_rad = atan2(p[1], p[0]) + view.margin_rad * cos(to_rad) +
                          asin(fmin(record.spread_m[1] / level_m, 1)) * between(-1, 1),
                 el_rad = atan2(p[2], level_m) + view.lift_rad * sin(to_rad) +
                          asin(fmin(record.spread_m[2] / away_m, 1)) * between(-1, 1);
    *range_m = away_m + record.spread_m[0] * between(-1, 1);
    if (fabs(az_rad) > 1.5 || tan(az_rad) < tan_az[0] || tan(az_rad) > tan_az[image->columns] ||
        tan(el_rad) < tan_el[0] || tan(el_rad) > tan_el[image->rows])
        return NULL;
    return &cells[water_image_find(tan_el, image->rows, tan(el_rad)) * image->columns +
                  water_image_find(tan_az, image->columns, tan(az_rad))];
}

/* Free is what all cells have free that it may be in. What does not end is behind no echo, wherever it may be. */
TEST(no_point_of_a_tile_is_told_what_its_cell_denies)
{
    int free = 0, not_free = 0, behind = 0, ended = 0;
    seed = test_seed();
    for (int world = 0; world < 3000; world++) {
        draw_world();
        const double from_m = between(0, 1) < 0.5 ? 0 : between(0, 3), to_m = between(4, 9);
        water_decide(&view, &tile, from_m, to_m, &out);
        for (int i = 0; i < out.n; i++)
            for (int k = 0; k < 6; k++) {
                const struct water_piece *piece = &out.piece[i];
                double p[3], range_m;
                draw_point(between(piece->from_m, piece->to_m), p);
                move_point(p);
                const struct water_cell *cell = see_point(p, &range_m);
                const bool is_good =
                    cell && range_m >= cell->from * WATER_UNIT_M && range_m <= cell->least * WATER_UNIT_M;
                free += piece->says == WATER_FREE;
                not_free += piece->says == WATER_FREE && !is_good;
                ended += piece->says == WATER_ENDED;
                behind += piece->says != WATER_ENDED && cell && cell->ends != WATER_NO_END &&
                          range_m > cell->ends * WATER_UNIT_M;
            }
    }
    CHECK_INT(not_free, 0);
    CHECK_INT(behind, 0);
    CHECK(free > 1000 && ended > 1000);
}

/* Ways that pass the sensor in any direction, of which no point is free above or below the image. */
TEST(no_way_past_the_sensor_is_free_beyond_the_image)
{
    int free = 0, wrong = 0;
    seed = test_seed();
    begin(1, 1, 150, 16);
    cells[0] = (struct water_cell){.from = 0, .least = 3000, .most = 3000, .ends = WATER_NO_END};
    record.image.near_m = 0;
    for (int world = 0; world < 2000; world++) {
        const double from_m = between(0, 4), to_m = from_m + between(2, 12), side = world % 2 ? 1 : -1;
        view.at_m[0] = between(0, 6);
        view.at_m[1] = -side * between(3, 9);
        view.at_m[2] = between(-1, 1);
        aim(side * between(50, 130), between(-12, 12), 0);
        water_decide(&view, &tile, from_m, to_m, &out);
        for (int i = 0; i < out.n; i++)
            for (int k = 0; k < 12 && out.piece[i].says == WATER_FREE; k++) {
                double p[3];
                draw_point(between(out.piece[i].from_m, out.piece[i].to_m), p);
                free++;
                wrong += p[0] <= 0 || fabs(p[1] / p[0]) > tan_az[1] || fabs(p[2] / hypot(p[0], p[1])) > tan_el[1];
            }
    }
    CHECK_INT(wrong, 0);
    CHECK(free > 5000);
}

/* Ranges are divided at the same places, however far one asks. */
TEST(a_shorter_stretch_is_free_at_least_as_far)
{
    seed = test_seed();
    for (int world = 0; world < 1000; world++) {
        struct water_pieces all;
        draw_world();
        water_decide(&view, &tile, 0, 8, &all);
        const double to_m = between(0.1, 8);
        water_decide(&view, &tile, 0, to_m, &out);
        for (int i = 0; i < all.n; i++)
            for (int k = 0; k < out.n; k++) {
                const double from_m = fmax(all.piece[i].from_m, out.piece[k].from_m),
                             end_m = fmin(all.piece[i].to_m, out.piece[k].to_m);
                CHECK(!(from_m < end_m) || all.piece[i].says != WATER_FREE || out.piece[k].says == WATER_FREE);
            }
    }
}

/* A tile within this one. */
static struct water_tile draw_within(const struct water_tile *whole)
{
    struct water_tile one;
    const double off = between(0, 1) * whole->half_rad, aside = tan(off);
    double any[3];
    for (int i = 0; i < 3; i++)
        any[i] = between(-1, 1);
    const double along = geo_dot(any, whole->v), size = sqrt(geo_dot(any, any) - along * along);
    for (int i = 0; i < 3; i++)
        one.v[i] = cos(off) * (whole->v[i] + aside * (any[i] - along * whole->v[i]) / size);
    one.half_rad = between(0, 1) * (whole->half_rad - off);
    return one;
}

/* Of what is not mixed smaller tiles are told the same; where the whole does not end, nor do they. */
TEST(smaller_tiles_are_told_otherwise_only_where_it_is_mixed)
{
    int otherwise = 0, not_mixed = 0;
    seed = test_seed();
    for (int world = 0; world < 2000; world++) {
        struct water_pieces all;
        draw_world();
        water_decide(&view, &tile, 0, 8, &all);
        const struct water_tile one = draw_within(&tile);
        for (int i = 0; i < all.n; i++) {
            const struct water_piece *whole = &all.piece[i];
            const double from_m = between(whole->from_m, whole->to_m), to_m = fmin(from_m + 0.05, whole->to_m);
            water_decide(&view, &one, from_m, to_m, &out);
            for (int k = 0; k < out.n; k++) {
                CHECK(whole->mixed || out.piece[k].says == whole->says);
                CHECK(whole->says == WATER_ENDED || out.piece[k].says != WATER_ENDED);
                otherwise += out.piece[k].says != whole->says;
                not_mixed += !whole->mixed;
            }
        }
    }
    CHECK(otherwise > 500 && not_mixed > 500);
}

/* The steps of the grid that are asked for by themselves: a stretch is divided wherever that tells more of it. */
TEST(nothing_is_lost_by_asking_for_a_long_stretch)
{
    long judged = 0, free = 0;
    seed = test_seed();
    for (int world = 0; world < 400; world++) {
        struct water_pieces all;
        draw_world();
        const double step_m = tile.half_rad > 0.04   ? 4 * WATER_GRID_M
                              : tile.half_rad > 0.02 ? 2 * WATER_GRID_M
                              : tile.half_rad > 0.01 ? WATER_GRID_M
                                                     : WATER_GRID_M / 4;
        water_decide(&view, &tile, 0, 8, &all);
        judged += all.judged;
        for (int i = 0, n = 0; n * step_m < 8; n++) {
            water_decide(&view, &tile, n * step_m, (n + 1) * step_m, &out);
            while (i + 1 < all.n && all.piece[i].to_m <= n * step_m)
                i++;
            if (all.n == WATER_PIECES || out.piece[0].says == WATER_ENDED)
                break;
            free += out.piece[0].says == WATER_FREE;
            CHECK(all.piece[i].says == out.piece[0].says);
        }
    }
    CHECK(free > 1000);
    CHECK(judged < 400 * 40);
}

int main(void)
{
    RUN(water_is_free_within_the_cell_and_its_ranges);
    RUN(a_stretch_is_divided_at_the_first_multiple_of_the_grid_and_at_the_last);
    RUN(water_ends_where_it_may_touch_an_echo);
    RUN(margins_of_place_make_free_water_smaller);
    RUN(margins_count_from_the_sensor_wherever_it_looks);
    RUN(margins_of_direction_take_the_sides_alone);
    RUN(level_drift_changes_how_steep_water_is_seen);
    RUN(a_tile_begins_at_the_vehicle_and_lies_where_the_sensor_sees_it);
    RUN(a_tile_that_comes_nearer_is_free_as_long_as_it_fits_in);
    RUN(a_way_is_as_high_as_where_it_is_highest);
    RUN(a_record_lies_as_its_sensor_lay);
    RUN(a_wide_tile_beside_the_sensor_loses_range);
    RUN(water_that_may_have_drifted_over_the_sensor_is_not_free);
    RUN(a_way_is_free_where_it_passes_near_the_sensor);
    RUN(a_way_that_climbs_is_as_high_as_where_it_is_highest);
    RUN(a_way_that_climbs_may_have_drifted_over_the_sensor);
    RUN(a_wide_tile_is_as_near_and_as_far_as_its_nearest_and_farthest_point);
    RUN(water_ends_where_there_are_too_many_pieces);
    RUN(water_is_free_in_rows_that_follow_each_other);
    RUN(water_of_rows_that_follow_each_other_is_free_as_far_as_they_have_it);
    RUN(a_row_holds_what_begins_in_it_from_below_to_above);
    RUN(a_row_that_lies_beyond_takes_nothing);
    RUN(what_a_row_has_no_bearing_of_does_not_go_on_in_it);
    RUN(what_smaller_tiles_may_be_told_otherwise_is_mixed);
    RUN(a_tile_of_which_some_is_before_an_echo_is_mixed);
    RUN(a_tile_of_which_one_side_may_be_free_is_mixed);
    RUN(a_stretch_of_which_no_part_can_be_free_is_judged_once);
    RUN(a_stretch_is_judged_once_where_all_of_it_touches_what_denies_it);
    RUN(a_stretch_is_divided_where_a_margin_leaves_room_for_its_end);
    RUN(a_stretch_is_shortened_to_the_image);
    RUN(a_way_along_a_side_of_the_image_is_in_it_or_not);
    RUN(an_image_covers_what_may_touch_it);
    RUN(a_beam_looks_as_far_as_it_hears);
    RUN(what_stands_upright_is_not_sought_beside_a_sensor_on_its_side);
    RUN(beams_sent_from_beside_the_row_look_less_far_aside);
    RUN(only_the_beam_that_passes_there_looks);
    RUN(no_point_of_a_tile_is_told_what_its_cell_denies);
    RUN(no_way_past_the_sensor_is_free_beyond_the_image);
    RUN(a_shorter_stretch_is_free_at_least_as_far);
    RUN(smaller_tiles_are_told_otherwise_only_where_it_is_mixed);
    RUN(nothing_is_lost_by_asking_for_a_long_stretch);
    return test_end();
}
