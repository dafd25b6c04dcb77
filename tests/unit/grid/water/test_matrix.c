/* SPDX-License-Identifier: MIT */
/* test_matrix - the image of a ping whose beams have several elevations, against the beams themselves. */
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/matrix.h"
#include "report/lib/dice.h"

static struct beam_echoes beam[BEAMS_MAX];
static struct echoes ping;
static struct beams_deaf deaf;
static struct matrix matrix;
static struct row_room room;
static struct water_record record;

static void start(uint16_t beams, double wide_deg, double high_deg)
{
    ping = (struct echoes){.n_beams = beams,
                           .az_aperture_rad = (float)geo_rad(wide_deg),
                           .el_aperture_rad = (float)geo_rad(high_deg),
                           .pose = pose_identity,
                           .beam = beam};
    deaf = (struct beams_deaf){.n = beams};
    for (uint16_t i = 0; i < beams; i++)
        beam[i] = (struct beam_echoes){.blind_m = 0.3f, .free_to_m = 10};
}

static void aim(int i, double az_deg, double el_deg)
{
    beam[i].az_rad = (float)geo_rad(az_deg);
    beam[i].el_rad = (float)geo_rad(el_deg);
}

static void start_grid(int columns, int rows, double column_deg, double row_deg)
{
    for (int i = 0; i < columns * rows; i++)
        aim(i, (i % columns - (columns - 1) / 2.0) * column_deg, (i / columns - (rows - 1) / 2.0) * row_deg);
}

static bool write_image(void)
{
    return matrix_write(&ping, &deaf, &matrix, &record, &room);
}

/* What the image says there; nothing beyond its ends. */
static struct water_cell cell_at(double az_deg, double el_deg)
{
    const struct water_image *image = &record.image;
    const double az = tan(geo_rad(az_deg)), el = tan(geo_rad(el_deg));
    if (az < image->tan_az[0] || az > image->tan_az[image->columns] || el < image->tan_el[0] ||
        el > image->tan_el[image->rows])
        return (struct water_cell){.ends = WATER_NO_END};
    return image->cell[water_image_find(image->tan_el, image->rows, el) * image->columns +
                       water_image_find(image->tan_az, image->columns, az)];
}

static double free_m(double az_deg, double el_deg)
{
    return cell_at(az_deg, el_deg).least * WATER_UNIT_M;
}

TEST(beams_that_overlap_leave_no_gap_in_between)
{
    for (int falls = 0; falls < 2; falls++) {
        start(512, 4.5, 7.5);
        start_grid(32, 16, 3, falls ? -5.5 : 5.5);
        CHECK(write_image());
        CHECK_INT(record.image.columns, 32);
        CHECK_INT(record.image.rows, 16);
        for (double az = -48; az < 48; az += 0.7)
            for (double el = -44; el < 44; el += 0.7)
                CHECK_NEAR(free_m(az, el), 10, 0, 1e-6);
        CHECK(free_m(49.2, 0) == 0 && free_m(0, -45.5) == 0);
        CHECK_NEAR(record.image.near_m, 0.3, 0, 1e-6);
    }
}

TEST(a_gap_says_nothing)
{
    start(4, 2, 4);
    start_grid(2, 2, 2, 10);
    CHECK(write_image());
    CHECK_INT(record.image.columns, 2);
    CHECK_INT(record.image.rows, 3);
    CHECK_NEAR(free_m(0.5, 6.9), 10, 0, 1e-6);
    CHECK(free_m(0.5, 2.9) == 0 && free_m(0.5, 0) == 0);
    CHECK_INT(cell_at(0.5, 0).ends, WATER_NO_END);
}

TEST(a_beam_that_is_missing_is_missed_in_its_own_part_alone)
{
    start(8, 4, 6);
    start_grid(3, 3, 3, 5);
    aim(4, 3, 5); /* the middle one is; the last one stands in its place */
    CHECK(write_image());
    CHECK(free_m(0, 0) == 0 && free_m(1.4, 2.4) == 0 && free_m(-1.4, -2.4) == 0);
    CHECK_NEAR(free_m(1.6, 0), 10, 0, 1e-6);
    CHECK_NEAR(free_m(0, 2.6), 10, 0, 1e-6);
}

/* What stands where a beam is missing is in the openings of those beside it. */
TEST(what_is_no_beams_own_ends_at_the_echoes_around)
{
    start(8, 20, 20);
    start_grid(3, 3, 3, 5);
    aim(4, 3, 5);
    for (int i = 0; i < 8; i++) {
        beam[i].n = 1;
        beam[i].free_to_m = (float)(4 + i);
    }
    CHECK(write_image());
    CHECK(free_m(0, 0) == 0);
    CHECK_INT(cell_at(0, 0).ends, 400);
    start(4, 2, 4);
    start_grid(2, 2, 2, 10);
    for (int i = 0; i < 4; i++)
        beam[i].n = 1;
    CHECK(write_image());
    CHECK_INT(cell_at(0.5, 0).ends, WATER_NO_END); /* a gap is in no opening */
    CHECK_INT(cell_at(0.5, 5).ends, 1000);
}

TEST(an_echo_ends_the_part_of_its_beam)
{
    start(9, 4, 6);
    start_grid(3, 3, 3, 5);
    beam[7].n = 1; /* the middle one of the upper row */
    beam[7].free_to_m = 4;
    CHECK(write_image());
    CHECK(record.echoes);
    CHECK_INT(cell_at(0, 5).ends, 400);
    CHECK_INT(cell_at(0, 2.6).ends, 400);
    CHECK_INT(cell_at(0, 7.9).ends, 400);
    CHECK_INT(cell_at(0, 2.4).ends, WATER_NO_END);
    CHECK_INT(cell_at(1.6, 5).ends, WATER_NO_END);
    CHECK_NEAR(free_m(0, 5), 4, 0, 1e-6);
}

TEST(of_two_in_one_direction_the_worse_counts)
{
    start(5, 4, 6);
    start_grid(2, 2, 3, 5);
    aim(4, 1.503, -2.5); /* rounded */
    beam[4].free_to_m = 7;
    beam[4].blind_m = 0.9f;
    CHECK(write_image());
    CHECK_INT(record.image.columns, 2);
    CHECK_INT(cell_at(1, -2).from, 90);
    CHECK_NEAR(free_m(1, -2), 7, 0, 1e-6);
    CHECK_NEAR(free_m(-1, -2), 10, 0, 1e-6);
}

static void hear_less_aside(int beams)
{
    for (int i = 0; i < beams; i++) {
        beam[i].off_axis = true;
        beam[i].side_to_m = 7;
        beam[i].edge_from_m = 0.5f;
        beam[i].edge_to_m = 5;
    }
}

/* The most that a beam says there: what takes it off its axis to the side and upward adds up. */
static double most_aside_m(double az_deg, double el_deg)
{
    const double half_az = geo_deg((double)ping.az_aperture_rad) / 2,
                 half_el = geo_deg((double)ping.el_aperture_rad) / 2;
    double most_m = 0;
    for (int i = 0; i < ping.n_beams; i++) {
        const double share = hypot((az_deg - geo_deg(beams_az_rad(&beam[i]))) / half_az,
                                   (el_deg - geo_deg((double)beam[i].el_rad)) / half_el) -
                             1e-3;
        most_m = fmax(most_m, share <= BEAM_AXIS_SHARE ? 10 : share <= BEAM_SIDE_SHARE ? 7 : share <= 1 ? 5 : 0);
    }
    return most_m;
}

TEST(off_its_axis_a_beam_frees_no_more_than_it_detects)
{
    struct dice dice = dice_of(46002, 0);
    static const struct {
        int columns, rows;
        double column_deg, row_deg, seam_m;
    } grids[] = {{5, 5, 0.6, 0.6, 10}, {5, 5, 1.9, 1.9, 7}, {5, 5, 2.7, 2.7, 7}, {5, 5, 3.5, 1.5, 5},
                 {5, 5, 3, 3, 5},      {32, 2, 1.9, 3, 7},  {2, 2, 9, 9, 0},     {1, 3, 9, 9, 0}};
    for (size_t k = 0; k < sizeof grids / sizeof *grids; k++) {
        const int beams = grids[k].columns * grids[k].rows;
        start((uint16_t)beams, 4, 4);
        start_grid(grids[k].columns, grids[k].rows, grids[k].column_deg, grids[k].row_deg);
        hear_less_aside(beams);
        CHECK(write_image());
        CHECK(row_bytes(record.image.columns, record.image.rows) <=
              row_bytes(row_columns((uint32_t)beams), ROW_ROWS));
        for (int i = 0; i < beams; i++) {
            const double az = geo_deg(beams_az_rad(&beam[i])), el = geo_deg((double)beam[i].el_rad);
            CHECK(free_m(az, el) >= 5 && free_m(az + 0.9, el - 0.9) >= 5);
        }
        for (int i = 0; i < 2000; i++) {
            const double az = 160 * dice_uniform(&dice) - 80, el = 30 * dice_uniform(&dice) - 15;
            CHECK(free_m(az, el) <= most_aside_m(az, el) + 1e-6);
        }
        if (grids[k].columns > 1)
            CHECK_NEAR(
                free_m(geo_deg(beams_az_rad(&beam[0])) + grids[k].column_deg / 2, geo_deg((double)beam[0].el_rad)),
                grids[k].seam_m, 0, 1e-6);
        if (grids[k].seam_m == 5)
            CHECK_INT(cell_at(grids[k].column_deg / 2, 0).from, 50);
    }
}

/* In the corners of a beam's opening nothing is free, yet its echo ends what is older. */
TEST(an_echo_ends_all_of_a_beam_that_hears_less_aside)
{
    start(4, 4, 4);
    start_grid(2, 2, 9, 9);
    hear_less_aside(4);
    for (int i = 0; i < 4; i++)
        beam[i].n = 1;
    CHECK(write_image());
    for (double off = -1.9; off < 2; off += 0.1)
        CHECK(cell_at(4.5 + off, 4.5 + off).ends == 1000 && cell_at(4.5 + off, 4.5 - off).ends == 1000);
}

TEST(a_column_of_beams_is_one_image)
{
    start(512, 10, 0.3);
    start_grid(1, 512, 1, 0.25);
    CHECK(write_image());
    CHECK_INT(record.image.columns, 1);
    CHECK_INT(record.image.rows, 512);
    CHECK_NEAR(free_m(4, 60), 10, 0, 1e-6);
    start(512, 10, 0.2); /* none touches another */
    start_grid(1, 512, 1, 0.3);
    CHECK(write_image());
    CHECK_INT(record.image.rows, 1023);
}

/* The most that a beam says whose opening holds that direction. */
static double most_free_m(double az_deg, double el_deg)
{
    const double half_az = geo_deg((double)ping.az_aperture_rad) / 2 + 0.1,
                 half_el = geo_deg((double)ping.el_aperture_rad) / 2 + 0.1;
    double most_m = 0;
    for (int i = 0; i < ping.n_beams; i++)
        if (fabs(az_deg - geo_deg(beams_az_rad(&beam[i]))) <= half_az &&
            fabs(el_deg - geo_deg((double)beam[i].el_rad)) <= half_el)
            most_m = fmax(most_m, (double)beam[i].free_to_m);
    return most_m;
}

/* Directions that make no grid: nothing is free beyond what some beam frees there, or where none looks. */
TEST(no_beams_free_what_none_of_them_sees)
{
    struct dice dice = dice_of(46001, 0);
    int told = 0;
    for (int k = 0; k < 60; k++) {
        const uint16_t beams = (uint16_t)(2 + 510 * dice_uniform(&dice) * dice_uniform(&dice));
        start(beams, 1 + 20 * dice_uniform(&dice), 1 + 20 * dice_uniform(&dice));
        for (int i = 0; i < beams; i++) {
            aim(i, 180 * dice_uniform(&dice) - 90, 180 * dice_uniform(&dice) - 90);
            beam[i].free_to_m = (float)(1 + 9 * dice_uniform(&dice));
        }
        const bool any = write_image();
        CHECK(row_bytes(record.image.columns, record.image.rows) <= row_bytes(row_columns(beams), ROW_ROWS));
        for (int i = 0; any && i < 2000; i++) {
            const double az = 160 * dice_uniform(&dice) - 80, el = 160 * dice_uniform(&dice) - 80,
                         m = free_m(az, el);
            CHECK(m <= most_free_m(az, el));
            told += m > 0;
        }
    }
    CHECK(told > 500);
}

int main(void)
{
    RUN(beams_that_overlap_leave_no_gap_in_between);
    RUN(a_gap_says_nothing);
    RUN(a_beam_that_is_missing_is_missed_in_its_own_part_alone);
    RUN(what_is_no_beams_own_ends_at_the_echoes_around);
    RUN(an_echo_ends_the_part_of_its_beam);
    RUN(of_two_in_one_direction_the_worse_counts);
    RUN(off_its_axis_a_beam_frees_no_more_than_it_detects);
    RUN(an_echo_ends_all_of_a_beam_that_hears_less_aside);
    RUN(a_column_of_beams_is_one_image);
    RUN(no_beams_free_what_none_of_them_sees);
    return test_end();
}
