/* SPDX-License-Identifier: MIT */
/* test_row - the image that is written of a row of beams, cell by cell, on the fewest beams that show each rule. */
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/row.h"

#define BEAMS    100
#define HALF_DEG 2.0 /* of a beam's width ... */
#define HIGH_DEG 10.0

static struct row_beam beam[BEAMS];
static struct row_shape shape;
static struct water_record record;
static struct row_room room;
static size_t beams;

/* So many beams at that distance: free from 0.3 to 10 m on their axes. A row from edge to edge. */
static void begin(size_t n, double step_deg)
{
    beams = n;
    for (size_t i = 0; i < n; i++)
        beam[i] = (struct row_beam){.az_rad = geo_rad(((double)i - (double)(n - 1) / 2) * step_deg),
                                    .near_m = 0.3,
                                    .edge_near_m = 0.3,
                                    .axis_m = 10,
                                    .side_m = 10,
                                    .edge_m = 10,
                                    .ends_m = INFINITY};
    shape = (struct row_shape){.half_az_rad = geo_rad(HALF_DEG), .half_el_rad = geo_rad(HIGH_DEG)};
    shape.from_rad = shape.outer_rad[0] = beam[0].az_rad - shape.half_az_rad;
    shape.to_rad = shape.outer_rad[1] = beam[n - 1].az_rad + shape.half_az_rad;
    if (n < BEAMS) /* what lies behind them does not count */
        beam[n] = (struct row_beam){.az_rad = 1.3, .near_m = 0.1, .aside_m = 9, .tilt_rad = 1, .axis_m = 1};
}

/* 8 m at their sides, 6 at their edges, and there from 1 m on. */
static void begin_nested(size_t n, double step_deg)
{
    begin(n, step_deg);
    for (size_t i = 0; i < n; i++) {
        beam[i].side_m = 8;
        beam[i].edge_m = 6;
        beam[i].edge_near_m = 1;
    }
}

static void write_row(void)
{
    row_write(&record, &room, &shape, beam, beams);
}

static int columns(void)
{
    return record.image.columns;
}

/* Where a column, or a row, begins. */
static double column_deg(int i)
{
    return geo_deg(atan(record.image.tan_az[i]));
}

static double row_deg(int i)
{
    return geo_deg(atan(record.image.tan_el[i]));
}

static struct water_cell cell_at(int column, int row)
{
    return record.image.cell[row * columns() + column];
}

#define CHECK_COLUMNS(...)                                                                                        \
    do {                                                                                                          \
        const double want_deg_[] = {__VA_ARGS__};                                                                 \
        CHECK_INT(columns() + 1, sizeof want_deg_ / sizeof *want_deg_);                                           \
        for (int i_ = 0; i_ <= columns() && i_ < (int)(sizeof want_deg_ / sizeof *want_deg_); i_++)               \
            CHECK_NEAR(column_deg(i_), want_deg_[i_], 0, 1e-5);                                                   \
    } while (0)

#define CHECK_CELL(cell, from_, to_)                                                                              \
    do {                                                                                                          \
        const struct water_cell got_cell = cell;                                                                  \
        CHECK_INT(got_cell.from, from_);                                                                          \
        CHECK_INT(got_cell.least, to_);                                                                           \
        CHECK_INT(got_cell.most, to_);                                                                            \
    } while (0)

/* ---- cells, sizes ---- */

TEST(ranges_are_rounded_to_where_it_is_free_for_sure)
{
    struct row_beam b = {.axis_m = 5.019, .side_m = 4, .edge_m = 3};
    CHECK_CELL(row_cell(&b, ROW_AXIS, 0.301, INFINITY), 31, 501);
    CHECK_CELL(row_cell(&b, ROW_AXIS, 0.07, INFINITY), 7, 501); /* no farther, for 0.07 / 0.01 is above 7 */
    CHECK_CELL(row_cell(&b, ROW_AXIS, -1, INFINITY), 0, 501);
    CHECK_CELL(row_cell(&b, ROW_SIDE, 0.3, INFINITY), 30, 400);
    CHECK_CELL(row_cell(&b, ROW_EDGE, 0.3, INFINITY), 30, 300);
    CHECK_CELL(row_cell(&b, ROW_NOTHING, 0, INFINITY), 0, 0);
    CHECK_CELL(row_cell(&b, ROW_EDGE, 3, INFINITY), 0, 0); /* free nowhere */
    CHECK_CELL(row_cell(&b, ROW_EDGE, 2.99, INFINITY), 299, 300);
    CHECK_INT(row_cell(&b, ROW_EDGE, 0.3, INFINITY).ends, WATER_NO_END);
    CHECK_INT(row_cell(&b, ROW_EDGE, 0.3, 2.509).ends, 250);
    CHECK_INT(row_cell(&b, ROW_EDGE, 4, 2.509).ends, 250);
    CHECK_INT(row_cell(&b, ROW_EDGE, 4, 0.5).ends, 50);
    CHECK_INT(row_cell(&b, ROW_EDGE, 4, -1).ends, 0);
    b.axis_m = 1000; /* what a cell cannot tell is not the number of no end, nor one below */
    CHECK_CELL(row_cell(&b, ROW_AXIS, 0, INFINITY), 0, UINT16_MAX - 3);
    CHECK_INT(row_cell(&b, ROW_AXIS, 0, 1000).ends, UINT16_MAX - 3);
}

TEST(an_image_has_room_for_beams_that_touch_no_other)
{
    CHECK_INT(row_columns(10), 60);
    CHECK_INT(row_columns(86), 516);
    CHECK_INT(row_columns(87), WATER_COLUMNS);
    CHECK_INT(row_bytes(10, 5), (11 + 6) * sizeof(double) + water_image_cells(10, 5) * sizeof(struct water_cell));
}

/* ---- beams that detect off their axes what they do on them ---- */

TEST(a_column_is_what_is_a_beams_own)
{
    begin(3, 3);
    beam[2].az_rad = geo_rad(3.5);
    beam[1].axis_m = beam[1].side_m = beam[1].edge_m = 7;
    beam[1].near_m = beam[1].edge_near_m = 0.5;
    shape.to_rad = shape.outer_rad[1] = geo_rad(5.5);
    write_row();
    CHECK_COLUMNS(-5, -1.5, 1.75, 5.5);
    CHECK_INT(record.image.rows, ROW_ROWS);
    CHECK_INT(record.image.parts, ROW_ROWS);
    CHECK_NEAR(record.image.near_m, 0.3, 0, 0);
    for (int row = 0; row < ROW_ROWS; row++) {
        CHECK_CELL(cell_at(0, row), 30, 1000);
        CHECK_CELL(cell_at(1, row), 50, 700);
        CHECK_CELL(cell_at(2, row), 30, 1000);
    }
}

/* A gap, and where bearings are rounded, none. */
TEST(between_beams_that_leave_a_gap_nothing_is_said)
{
    for (int kind = 0; kind < 3; kind++) {
        const double over_deg = kind == 0 ? 1 : geo_deg((kind == 1 ? 1.01 : 0.99) * ROW_TOUCH_RAD);
        begin(3, 3);
        beam[0].az_rad = geo_rad(-4 - over_deg);
        beam[1].az_rad = 0;
        for (int i = 0; i < 3; i++)
            beam[i].ends_m = 10;
        shape.from_rad = shape.outer_rad[0] = geo_rad(-6 - over_deg);
        write_row();
        if (kind == 2) {
            CHECK_COLUMNS(-6 - over_deg, -2 - over_deg / 2, 1.5, 5);
            continue;
        }
        CHECK_COLUMNS(-6 - over_deg, -2 - over_deg, -2, 1.5, 5);
        CHECK_CELL(cell_at(0, 2), 30, 1000);
        CHECK_CELL(cell_at(1, 2), 0, 0);
        CHECK_CELL(cell_at(2, 2), 30, 1000);
        CHECK(cell_at(0, 2).ends == 1000 && cell_at(1, 2).ends == WATER_NO_END && cell_at(2, 2).ends == 1000);
    }
}

/* Whichever it is of many; and one that detects less off its axis is enough for all to have parts. */
TEST(a_gap_is_where_it_is_and_one_nested_beam_counts)
{
    begin(4, 3);
    beam[3].az_rad += geo_rad(3);
    shape.to_rad = shape.outer_rad[1] = beam[3].az_rad + shape.half_az_rad;
    write_row();
    CHECK_COLUMNS(-6.5, -3, 0, 3.5, 5.5, 9.5);
    CHECK_CELL(cell_at(3, 2), 0, 0);
    for (int i = 0; i < 3; i++) {
        begin(3, 3);
        beam[i].side_m = beam[i].edge_m = 6;
        write_row();
        CHECK(columns() > 3);
    }
}

/* As narrow as directions are rounded. */
TEST(between_beams_that_are_apart_nothing_is_said)
{
    const double touch_deg = geo_deg(ROW_TOUCH_RAD / 2);
    begin(3, 3);
    beam[1].apart = true;
    write_row();
    CHECK_COLUMNS(-5, -1.5, 1.5 - touch_deg, 1.5 + touch_deg, 5);
    CHECK_CELL(cell_at(2, 2), 0, 0);
    CHECK_CELL(cell_at(3, 2), 30, 1000);
    begin(2, 6); /* they do not even touch */
    beam[0].apart = true;
    write_row();
    CHECK_COLUMNS(-5, -1, 1, 5);
}

/* Beyond the row's own part it frees, and ends nothing. */
TEST(what_is_another_rows_own_ends_nothing)
{
    begin(2, 3);
    for (int i = 0; i < 2; i++)
        beam[i].ends_m = 9 + i;
    shape.from_rad = geo_rad(-2.5);
    shape.to_rad = geo_rad(2);
    write_row();
    CHECK_COLUMNS(-3.5, -2.5, 0, 2, 3.5);
    CHECK(record.echoes);
    for (int row = 0; row < ROW_ROWS; row++) {
        CHECK(cell_at(0, row).ends == WATER_NO_END && cell_at(3, row).ends == WATER_NO_END);
        CHECK(cell_at(1, row).ends == 900 && cell_at(2, row).ends == 1000);
        for (int i = 0; i < 4; i++)
            CHECK_CELL(cell_at(i, row), 30, 1000);
    }
    beam[0].axis_m = beam[0].side_m = beam[0].edge_m = 5; /* each side is its own beam's */
    beam[0].ends_m = beam[1].ends_m = INFINITY;
    write_row();
    CHECK(!record.echoes);
    CHECK_CELL(cell_at(0, 2), 30, 500);
    CHECK_CELL(cell_at(3, 2), 30, 1000);
    beam[0].ends_m = 10;
    write_row();
    CHECK(record.echoes);
}

/* By beam, and by row of the image. */
TEST(beams_begin_where_they_leave_no_gap)
{
    static double join_m[2][ROW_ROWS];
    for (int i = 0; i < 2; i++)
        for (int row = 0; row < ROW_ROWS; row++)
            join_m[i][row] = i + 0.25 * row;
    begin(2, 3);
    shape.join_m = (const double(*)[ROW_ROWS])join_m;
    write_row();
    for (int i = 0; i < 2; i++)
        for (int row = 0; row < ROW_ROWS; row++)
            CHECK_CELL(cell_at(i, row), i == 0 && row < 2 ? 30 : 100 * i + 25 * row, 1000);
}

/* ---- beams that detect less off their axes ---- */

/* Parts are squares within ellipses. */
TEST(a_beam_alone_is_free_as_far_as_each_of_its_parts)
{
    static const uint16_t from[] = {30, 30, 100}, to[] = {1000, 800, 600};
    const double side_deg = HALF_DEG * 0.7 / sqrt(2), axis_deg = HALF_DEG * 0.25 / sqrt(2),
                 high = HIGH_DEG / HALF_DEG;
    begin_nested(1, 0);
    beam[0].ends_m = 10;
    shape.el_rad = geo_rad(3);
    write_row();
    CHECK_COLUMNS(-HALF_DEG, -side_deg, -axis_deg, axis_deg, side_deg, HALF_DEG);
    const double want_deg[] = {-HALF_DEG, -side_deg, -axis_deg, axis_deg, side_deg, HALF_DEG};
    for (int i = 0; i <= ROW_ROWS; i++)
        CHECK_NEAR(row_deg(i), 3 + high * want_deg[i], 0, 1e-5);
    for (int row = 0; row < ROW_ROWS; row++)
        for (int i = 0; i < ROW_ROWS; i++) {
            const int part = abs(i - 2) > abs(row - 2) ? abs(i - 2) : abs(row - 2);
            CHECK_CELL(cell_at(i, row), from[part], to[part]);
            CHECK_INT(cell_at(i, row).ends, 1000);
        }
}

/* One that detects nothing less, but later. */
TEST(an_edge_begins_where_it_detects)
{
    begin(1, 0);
    beam[0].edge_near_m = 1;
    write_row();
    CHECK_INT(columns(), ROW_ROWS);
    CHECK_CELL(cell_at(2, 2), 30, 1000);
    CHECK_CELL(cell_at(2, 0), 100, 1000);
    CHECK_CELL(cell_at(0, 2), 100, 1000);
    CHECK_NEAR(record.image.near_m, 0.3, 0, 0);
    for (int kind = 0; kind < 2; kind++) { /* less at its side, or at its edge alone */
        begin(1, 0);
        *(kind ? &beam[0].side_m : &beam[0].edge_m) = 8;
        beam[0].edge_m = 8;
        write_row();
        CHECK_CELL(cell_at(2, 2), 30, 1000);
        CHECK_CELL(cell_at(1, 2), 30, kind ? 800 : 1000);
        CHECK_CELL(cell_at(0, 2), 30, 800);
    }
    beam[0].edge_near_m = 0.2; /* the nearest of any */
    write_row();
    CHECK_NEAR(record.image.near_m, 0.2, 0, 0);
}

/* Where beams overlap, parts are only as wide as their seams are off the axis, and the higher for that. */
TEST(parts_are_as_wide_as_the_seams_of_the_row)
{
    static const double step[] = {0.4, 0.8, 0.96, 2,
                                  2.6, 2.7, 4}; /* seams at 0.1, 0.2, 0.24, 0.5, 0.65, 0.675, 1 */
    for (size_t k = 0; k < sizeof step / sizeof *step; k++) {
        begin_nested(3, step[k]);
        write_row();
        for (int part = 0; part < 2; part++) {
            const double share = part ? 0.7 : 0.25, seam = step[k] / 2 / HALF_DEG;
            const double wide = seam < 0.95 * share ? seam : share / sqrt(2),
                         high = sqrt(share * share - wide * wide);
            CHECK_NEAR(row_deg(3 + part), high * HIGH_DEG, 0, 1e-4);
            CHECK_NEAR(row_deg(2 - part), -high * HIGH_DEG, 0, 1e-4);
            const double to_deg = -step[k] + HALF_DEG * wide; /* that of the first beam ends there */
            bool found = to_deg > -step[k] / 2 - 1e-5;
            for (int i = 0; i <= columns(); i++)
                found = found || fabs(column_deg(i) - to_deg) < 1e-4;
            CHECK(found);
        }
    }
    begin_nested(3, 1); /* the widest seam counts, and a gap is one */
    beam[2].az_rad = geo_rad(1.4);
    write_row();
    CHECK_NEAR(row_deg(4), sqrt(0.49 - 0.35 * 0.35) * HIGH_DEG, 0, 1e-4);
    begin_nested(3, 1);
    beam[0].az_rad = geo_rad(-1.4);
    write_row();
    CHECK_NEAR(row_deg(4), sqrt(0.49 - 0.35 * 0.35) * HIGH_DEG, 0, 1e-4);
    for (int i = 0; i < 2; i++) {
        begin_nested(3, 1);
        beam[i].apart = true;
        write_row();
        CHECK_NEAR(row_deg(4), 0.7 / sqrt(2) * HIGH_DEG, 0, 1e-4);
    }
}

/* Axes that do not meet leave seams farther off them: parts are so much wider, up to squares. */
TEST(parts_are_wider_by_what_axes_diverge)
{
    static const struct {
        double aside_m, tilt_rad, el_deg;
    } c[] = {{0.004, 0, 0}, {0, 0.02, 0}, {0.004, 0.02, 0}, {0, 0.01, 20}, {0, 0.01, -20}, {0.1, 0, 0}};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++)
        for (int which = 0; which < 3; which++) {
            begin_nested(3, 1);
            shape.el_rad = geo_rad(c[i].el_deg);
            beam[which].aside_m = c[i].aside_m;
            beam[which].tilt_rad = c[i].tilt_rad;
            write_row();
            const double highest = geo_rad(fabs(c[i].el_deg) + 0.7 / sqrt(2) * HIGH_DEG),
                         aside_rad = c[i].aside_m / (2 * cos(highest)) + c[i].tilt_rad * tan(highest),
                         aside = aside_rad / 2 / geo_rad(HALF_DEG), wide = fmin(0.25 + aside, 0.7 / sqrt(2));
            CHECK_NEAR(row_deg(4) - c[i].el_deg, sqrt(0.49 - wide * wide) * HIGH_DEG, 0, 1e-4);
        }
}

/* Nearer than its part holds the seam, the next part counts. */
TEST(cells_at_a_seam_begin_where_their_part_holds_it)
{
    static const struct {
        double aside_m, tilt_rad, along_m;
    } c[] = {{0, 0, 0}, {0.004, 0, 0}, {0.004, 0, 0.5}, {0.004, 0.02, 0}, {0, 0.02, 0}, {0.2, 0, 0}, {0, 1.5, 0}};
    static const double step[] = {0.4, 1, 2.7};
    for (size_t i = 0; i < sizeof c / sizeof *c; i++)
        for (int k = 0; k < 3; k++) {
            begin_nested(3, step[k]);
            shape.el_rad = geo_rad(-5);
            beam[1].aside_m = c[i].aside_m;
            beam[1].tilt_rad = c[i].tilt_rad;
            beam[1].along_m = c[i].along_m;
            write_row();
            const double half = geo_rad(HALF_DEG), seam = step[k] / 2 / HALF_DEG;
            for (int row = 0; row < ROW_ROWS; row++) {
                const double low = row_deg(row) + 5, high = row_deg(row + 1) + 5,
                             top = fmax(fabs(low), fabs(high)) / HIGH_DEG;
                double from_m[2]; /* the axis' part and the side's hold the seam */
                for (int part = 0; part < 2; part++) {
                    const double share = part ? 0.7 : 0.25, wide = seam < 0.95 * share ? seam : share / sqrt(2);
                    double left = sqrt(fmax(share * share - top * top, 0)) - seam;
                    if (wide < seam)
                        left = INFINITY; /* it ends before */
                    left -= c[i].tilt_rad / 2 * tan(geo_rad(5 + top * HIGH_DEG)) / half;
                    const bool diverge = c[i].aside_m > 0 || c[i].tilt_rad > 0;
                    from_m[part] = !diverge      ? 0
                                   : left > 1e-6 ? c[i].aside_m / 2 / (left * half) + c[i].along_m
                                                 : (double)INFINITY;
                }
                const int first =
                    water_image_find(record.image.tan_az, columns(), tan(geo_rad(-step[k] / 2) + 1e-6));
                const int off_row = abs(row - 2), off_column = step[k] > 2.5 ? 2 : step[k] > 0.5 ? 1 : 0;
                int part = off_row > off_column ? off_row : off_column;
                double near_m = part == 2 ? 1 : 0.3;
                if (part == 0 && 8 < from_m[0])
                    part = 1;
                if (part <= 1 && 6 < from_m[1])
                    part = 2;
                if (part <= 1)
                    near_m = fmax(near_m, fmin(from_m[1], 1));
                if (part == 2)
                    near_m = 1;
                const struct water_cell cell = cell_at(first, row);
                CHECK_INT(cell.least, part == 0 ? 1000 : part == 1 ? 800 : 600);
                CHECK_NEAR(cell.from, near_m / WATER_UNIT_M, 0, 1.01);
            }
        }
}

/* Wherever other beams meet, on either side of a beam that may look anywhere. */
TEST(cells_at_a_seam_know_how_far_off_the_axis_it_is)
{
    for (int side = -1; side <= 1; side += 2)
        for (int far = 0; far < 3; far++) /* other seams: none, within the part at the side, and beyond it */
            for (int tilted = 0; tilted < 2; tilted++) {
                const double at_deg[] = {12, 12 + side * 0.4, 12 + side * (far == 1 ? 2.8 : 3.2)};
                begin_nested(far ? 3 : 2, 1);
                for (int i = 0; i < (int)beams; i++)
                    beam[side > 0 ? i : (int)beams - 1 - i].az_rad = geo_rad(at_deg[i]);
                struct row_beam *one = &beam[side > 0 ? 0 : beams - 1];
                one->tilt_rad =
                    tilted ? 0.05 : 0.01; /* at 20 degrees, more than the axis' part reaches beyond it */
                shape.el_rad = geo_rad(20);
                shape.from_rad = shape.outer_rad[0] = beam[0].az_rad - geo_rad(2);
                shape.to_rad = shape.outer_rad[1] = beam[beams - 1].az_rad + geo_rad(2);
                write_row();
                const double seam_deg = 12 + side * 0.199, own_deg = 12 - side * 0.5;
                const int at = water_image_find(record.image.tan_az, columns(), tan(geo_rad(seam_deg))),
                          own = water_image_find(record.image.tan_az, columns(), tan(geo_rad(own_deg)));
                CHECK_NEAR(column_deg(at + (side > 0)), 12 + side * 0.2, 0, 1e-5);
                CHECK_INT(cell_at(at, 2).least, tilted ? 800 : 1000);
                CHECK(!far ||
                      (cell_at(own, 2).least == 800 && cell_at(own, 2).from == 30)); /* it meets none there */
            }
}

/* A part in the middle of a beam meets none, nor do those of one that is apart; and of two beams both do. */
TEST(the_middle_of_a_beam_is_free_whatever_its_neighbours_are_tilted_by)
{
    begin_nested(3, 1.6); /* the seams are at the beams' sides */
    beam[1].tilt_rad = 1;
    write_row();
    const int middle = water_image_find(record.image.tan_az, columns(), 0);
    CHECK_CELL(cell_at(middle, 2), 30, 1000);
    CHECK_CELL(cell_at(middle - 1, 2), 100, 600);
    CHECK_CELL(cell_at(middle + 1, 2), 100, 600);
    for (int apart = 0; apart < 2; apart++) {
        begin_nested(2, 1);
        beam[0].apart = apart;
        write_row();
        CHECK_NEAR(row_deg(4), (apart ? 0.7 / sqrt(2) : sqrt(0.49 - 0.25 * 0.25)) * HIGH_DEG, 0, 1e-4);
    }
    begin_nested(3, 1); /* a gap is a seam at the edge, whichever beam has it */
    for (int i = 0; i < 2; i++) {
        beam[0].az_rad = geo_rad(i ? -1 : -5);
        beam[2].az_rad = geo_rad(i ? 5 : 1);
        write_row();
        CHECK_NEAR(row_deg(4), 0.7 / sqrt(2) * HIGH_DEG, 0, 1e-4);
    }
}

/* From 86 beams on a beam has one column: the worst of it. */
TEST(of_many_beams_each_is_free_as_far_as_in_the_worst_of_its_part)
{
    static const double step[] = {0.4, 0.6, 0.9,
                                  1.3, 1.5, 1.7}; /* seams at 0.1, 0.15, 0.225, 0.325, 0.375, 0.425 */
    begin_nested(85, 1);
    write_row();
    CHECK(columns() > 85 * 3);
    for (size_t k = 0; k < sizeof step / sizeof *step; k++)
        for (int kind = 0; kind < 3; kind++) { /* all at one distance, or one farther to a side */
            begin_nested(86, step[k]);
            for (size_t i = 0; i < beams && kind > 0; i++)
                beam[i].az_rad += (i < 40) == (kind == 1) ? geo_rad(kind == 1 ? -1 : 1) : 0;
            shape.from_rad = shape.outer_rad[0] = beam[0].az_rad - geo_rad(0.1);
            shape.to_rad = shape.outer_rad[1] = beam[85].az_rad + geo_rad(0.1);
            write_row();
            CHECK_INT(columns(), 86);
            const double seam = (step[k] + (kind ? 1 : 0)) / 2 / HALF_DEG;
            double wide[2];
            for (int part = 0; part < 2; part++) {
                const double share = part ? 0.7 : 0.25;
                wide[part] = (seam < 0.95 * share ? seam : share / sqrt(2)) + 1e-5;
            }
            for (int i = 0; i < 86; i++) {
                const double off = (i == 39 || i == 40 ? seam : step[k] / 2 / HALF_DEG);
                CHECK_INT(cell_at(i, 2).least, off <= wide[0] ? 1000 : off <= wide[1] ? 800 : 600);
            }
        }
}

int main(void)
{
    RUN(ranges_are_rounded_to_where_it_is_free_for_sure);
    RUN(an_image_has_room_for_beams_that_touch_no_other);
    RUN(a_column_is_what_is_a_beams_own);
    RUN(between_beams_that_leave_a_gap_nothing_is_said);
    RUN(a_gap_is_where_it_is_and_one_nested_beam_counts);
    RUN(between_beams_that_are_apart_nothing_is_said);
    RUN(what_is_another_rows_own_ends_nothing);
    RUN(beams_begin_where_they_leave_no_gap);
    RUN(a_beam_alone_is_free_as_far_as_each_of_its_parts);
    RUN(an_edge_begins_where_it_detects);
    RUN(parts_are_as_wide_as_the_seams_of_the_row);
    RUN(parts_are_wider_by_what_axes_diverge);
    RUN(cells_at_a_seam_begin_where_their_part_holds_it);
    RUN(cells_at_a_seam_know_how_far_off_the_axis_it_is);
    RUN(the_middle_of_a_beam_is_free_whatever_its_neighbours_are_tilted_by);
    RUN(of_many_beams_each_is_free_as_far_as_in_the_worst_of_its_part);
    return test_end();
}
