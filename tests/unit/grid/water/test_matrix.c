/* SPDX-License-Identifier: MIT */
/* test_matrix - the image of a ping whose beams have several elevations, against the beams themselves. */
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/matrix.h"
#include "tests/water/dice.h"

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

/* What stands where a beam is missing is in the openings of those beside it: free up to the first of their echoes. */
TEST(what_is_no_beams_own_is_free_up_to_the_echoes_around)
{
    start(8, 20, 20);
    start_grid(3, 3, 3, 5);
    aim(4, 3, 5);
    for (int i = 0; i < 8; i++) {
        beam[i].n = 1;
        beam[i].free_to_m = (float)(4 + i);
    }
    CHECK(write_image());
    CHECK_NEAR(free_m(0, 0), 4, 0, 1e-6);
    CHECK_INT(cell_at(0, 0).ends, 400);
    beam[0].n = 0;
    beam[0].free_to_m = 0; /* deaf once */
    CHECK(write_image());
    CHECK_NEAR(free_m(0, 0), 5, 0, 1e-6);
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

/* ---- beams that make no grid ---- */

#define ROUNDING_DEG 0.03 /* beams that leave no more than twice this touch */

/* Rows of which every other one is half a beam further to the side. */
static void aim_staggered(double wide, struct dice *dice)
{
    (void)dice;
    start(512, 3 * wide, 5.5 * wide);
    for (int i = 0; i < 512; i++)
        aim(i, (i % 32 - 15.5 + (i / 32 % 2 ? 0.25 : -0.25)) * 3, (i / 32 - 7.5) * 5.5);
}

/* A planar array, whose beams are as far apart in the sines of their angles. */
static void aim_array(double wide, struct dice *dice)
{
    (void)dice;
    start(512, 2.5 * wide, 4.3 * wide);
    for (int i = 0; i < 512; i++) {
        const double el_rad = asin((i / 32 - 7.5) * 0.075);
        aim(i, geo_deg(asin((i % 32 - 15.5) * 0.04375 / cos(el_rad))), geo_deg(el_rad));
    }
}

static void aim_inexactly(double wide, struct dice *dice)
{
    start(512, 3 * wide, 5.5 * wide);
    for (int i = 0; i < 512; i++)
        aim(i, (i % 32 - 15.5) * 3 + 0.04 * dice_uniform(dice) - 0.02,
            (i / 32 - 7.5) * 5.5 + 0.04 * dice_uniform(dice) - 0.02);
}

static void aim_rolled(int beams, double step_deg, double wide)
{
    start((uint16_t)beams, step_deg * wide, 20);
    for (int i = 0; i < beams; i++) {
        const double az = geo_rad((i - (beams - 1) / 2.0) * step_deg), roll = geo_rad(10);
        aim(i, geo_deg(atan2(sin(az) * cos(roll), cos(az))), -geo_deg(asin(sin(az) * sin(roll))));
    }
}

static void aim_rolled_fan(double wide, struct dice *dice)
{
    (void)dice;
    aim_rolled(64, 1.5, wide);
}

static void aim_rolled_multibeam(double wide, struct dice *dice)
{
    (void)dice;
    aim_rolled(512, 120.0 / 512, wide);
}

static void aim_anyhow(double wide, struct dice *dice)
{
    start(512, 15 * wide, 15 * wide);
    for (int i = 0; i < 512; i++)
        aim(i, 158 * dice_uniform(dice) - 79, 158 * dice_uniform(dice) - 79);
}

/* A cross of two fans. */
static void aim_crossed(double wide, struct dice *dice)
{
    (void)dice;
    start(81, 2 * wide, 2 * wide);
    for (int i = 0; i < 81; i++)
        aim(i, i < 41 ? 2 * (i - 20) : 0, i < 41 ? 0 : 2 * (i - 41 - (i < 61 ? 20 : 19)));
}

/* So far the water is free in that direction: a beam looks there and found nothing nearer, and no beam that looks there
 * has a nearer echo. Openings are larger by more_deg, and those of beams with echoes smaller. */
static double truly_free_m(double az_deg, double el_deg, double more_deg)
{
    const double half_az = geo_deg((double)ping.az_aperture_rad) / 2,
                 half_el = geo_deg((double)ping.el_aperture_rad) / 2;
    double free_to_m = 0, echo_m = INFINITY;
    for (int i = 0; i < ping.n_beams; i++) {
        const double off = fmax(fabs(az_deg - geo_deg((double)beam[i].az_rad)) - half_az,
                                fabs(el_deg - geo_deg((double)beam[i].el_rad)) - half_el);
        if (off <= more_deg)
            free_to_m = fmax(free_to_m, (double)beam[i].free_to_m);
        if (off <= -more_deg && beam[i].n > 0)
            echo_m = fmin(echo_m, (double)beam[i].free_to_m);
    }
    return fmin(free_to_m, echo_m);
}

/* One beam in twenty has an echo, and one is deaf. */
static void hear_echoes(struct dice *dice, bool loose)
{
    ping.pose.uncertain_m = loose ? 0.2 : 0;
    for (int i = 0; i < ping.n_beams; i++) {
        if (dice_uniform(dice) > 0.05)
            continue;
        beam[i].n = 1;
        beam[i].free_to_m = (float)(2 + 8 * dice_uniform(dice));
    }
    beam[7] = (struct beam_echoes){.az_rad = beam[7].az_rad, .el_rad = beam[7].el_rad, .blind_m = 0.3f};
}

static void check_echoes_end(void)
{
    for (int i = 0; i < ping.n_beams; i++)
        if (beam[i].n > 0)
            CHECK(cell_at(geo_deg((double)beam[i].az_rad), geo_deg((double)beam[i].el_rad)).ends * WATER_UNIT_M <=
                  (double)beam[i].free_to_m + 1e-6);
}

static void check_nothing_ends(void)
{
    for (int i = 0; i < record.image.columns * record.image.rows; i++)
        CHECK_INT(room.cell[i].ends, WATER_NO_END);
}

/* Shares of what is truly free that the image says: of all directions, and of all circles of 2.5 degrees, as no tile is
 * free of which any part is not. */
struct told {
    double rays, circles;
};

static struct told tell(struct dice *dice)
{
    double said_m[2] = {0}, true_m[2] = {0};
    for (int i = 0; i < 300; i++) {
        const int beside = (int)(ping.n_beams * dice_uniform(dice));
        const double az = geo_deg((double)beam[beside].az_rad) + 8 * (dice_uniform(dice) - 0.5),
                     el = geo_deg((double)beam[beside].el_rad) + 16 * (dice_uniform(dice) - 0.5);
        double least_m = INFINITY, least_said_m = INFINITY;
        for (int k = 0; k < 9; k++) {
            const double off = k > 0 ? 1.25 : 0, x = az + off * cos(k), y = el + off * sin(k);
            const double far_m = truly_free_m(x, y, 0), m = free_m(x, y);
            CHECK(m <= truly_free_m(x, y, ROUNDING_DEG) + 1e-6);
            least_m = fmin(least_m, far_m);
            least_said_m = fmin(least_said_m, m);
            true_m[0] += far_m;
            said_m[0] += fmin(m, far_m);
        }
        true_m[1] += least_m;
        said_m[1] += fmin(least_said_m, least_m);
    }
    return (struct told){said_m[0] / true_m[0], true_m[1] > 0 ? said_m[1] / true_m[1] : 1};
}

TEST(beams_that_make_no_grid_say_what_each_of_them_sees)
{
    static const struct {
        const char *name;
        void (*aim)(double wide, struct dice *dice);
        double wide; /* openings, as they are to the way between two axes */
        double rays, circles;
    } layouts[] = {
        {"staggered rows", aim_staggered, 1.4, 0.97, 0.95},
        {"staggered rows that touch", aim_staggered, 1, 0.97, 0.95},
        {"planar array", aim_array, 1.4, 0.9, 0.85},
        {"planar array with gaps", aim_array, 1, 0.6, 0},
        {"angles that are inexact", aim_inexactly, 1.4, 0.93, 0.88},
        {"angles that are inexact and touch", aim_inexactly, 1, 0.97, 0.97},
        {"rolled fan", aim_rolled_fan, 1, 0.85, 0.8},
        {"rolled multibeam", aim_rolled_multibeam, 1, 0.85, 0.7},
        {"crossed fans", aim_crossed, 1, 0.95, 0.9},
        {"anyhow", aim_anyhow, 1, 0.85, 0.75},
    };
    for (size_t i = 0; i < 2 * sizeof layouts / sizeof *layouts; i++) {
        const size_t k = i / 2;
        const bool loose = i % 2;
        struct dice dice = dice_of(46003, k);
        layouts[k].aim(layouts[k].wide, &dice);
        hear_echoes(&dice, loose);
        CHECK(write_image());
        CHECK(row_bytes(record.image.columns, record.image.rows) <=
              row_bytes(row_columns(ping.n_beams), ROW_ROWS));
        loose ? check_nothing_ends() : check_echoes_end();
        const struct told told = tell(&dice);
        printf("# %s%s: %.2f of directions, %.2f of circles; %d x %d cells\n", layouts[k].name,
               loose ? ", loose" : "", told.rays, told.circles, record.image.columns, record.image.rows);
        CHECK(told.rays >= layouts[k].rays && told.circles >= layouts[k].circles);
    }
}

/* A pose that is too uncertain to end what older pings found free is no reason to see through an echo. */
TEST(an_echo_of_a_loose_ping_stops_the_beams_beside_it)
{
    aim_staggered(7.0 / 3, NULL);
    ping.pose.uncertain_m = 0.11;
    beam[7 * 32 + 16].n = 1;
    beam[7 * 32 + 16].free_to_m = 5;
    CHECK(write_image());
    const double az = geo_deg((double)beam[7 * 32 + 16].az_rad), el = geo_deg((double)beam[7 * 32 + 16].el_rad);
    CHECK_NEAR(free_m(az, el), 5, 0, 1e-6);
    CHECK_NEAR(free_m(az + 2.9, el), 5, 0, 1e-6);
    CHECK_NEAR(free_m(az + 6, el), 10, 0, 1e-6);
    CHECK_INT(cell_at(az, el).ends, WATER_NO_END);
    beam[7 * 32 + 16].n = 0; /* it only hears less far than those beside it */
    CHECK(write_image());
    CHECK_NEAR(free_m(az, el), 10, 0, 1e-6);
}

/* A beam whose edge is free from 5 to 11 m beside one that is free from 0.3 to 10 m. */
TEST(what_is_free_near_is_not_lost_to_what_is_free_far)
{
    start(3, 10, 10);
    aim(0, 0, 0);
    aim(1, 3, 2.1);
    aim(2, -3.3, 1.3);
    beam[1] = (struct beam_echoes){.az_rad = beam[1].az_rad,
                                   .el_rad = beam[1].el_rad,
                                   .blind_m = 0.3f,
                                   .free_to_m = 12,
                                   .off_axis = true,
                                   .side_to_m = 11.5f,
                                   .edge_from_m = 5,
                                   .edge_to_m = 11};
    CHECK(write_image());
    CHECK(cell_at(0.2, 0.2).from <= 31);
    CHECK_NEAR(free_m(0.2, 0.2), 11, 0, 1e-6);
    beam[2].n = 1;
    beam[2].free_to_m = 4;
    CHECK(write_image());
    CHECK(cell_at(0.2, 0.2).from <= 31);
    CHECK_NEAR(free_m(0.2, 0.2), 4, 0, 1e-6);
}

/* Their openings hold cells of their own only if they are divided. */
TEST(beams_on_a_slant_that_hear_less_aside)
{
    start(3, 4, 4);
    for (int i = 0; i < 3; i++)
        aim(i, 9 * i, 7 * i);
    hear_less_aside(3);
    CHECK(write_image());
    for (int i = 0; i < 3; i++) {
        CHECK(free_m(9 * i, 7 * i) >= 5 && free_m(9 * i + 0.5, 7 * i - 0.5) >= 5);
        CHECK(free_m(9 * i + 1.8, 7 * i + 1.8) == 0);
    }
}

/* Off their axes they free no more than they detect. */
TEST(beams_that_make_no_grid_and_hear_less_aside)
{
    struct dice dice = dice_of(46004, 0);
    double said_m = 0, true_m = 0;
    for (int k = 0; k < 20; k++) {
        const uint16_t beams = (uint16_t)(3 + 200 * dice_uniform(&dice) * dice_uniform(&dice));
        start(beams, 2 + 10 * dice_uniform(&dice), 2 + 10 * dice_uniform(&dice));
        for (int i = 0; i < beams; i++)
            aim(i, 40 * dice_uniform(&dice) - 20, 20 * dice_uniform(&dice) - 10);
        hear_less_aside(beams);
        CHECK(write_image());
        for (int i = 0; i < 500; i++) {
            const double az = 60 * dice_uniform(&dice) - 30, el = 40 * dice_uniform(&dice) - 20,
                         m = free_m(az, el), most_m = most_aside_m(az, el);
            CHECK(m <= most_m + 1e-6);
            said_m += m;
            true_m += most_m;
        }
    }
    printf("# that hear less aside: %.2f\n", said_m / true_m);
    CHECK(said_m > 0.6 * true_m);
}

int main(void)
{
    RUN(beams_that_overlap_leave_no_gap_in_between);
    RUN(a_gap_says_nothing);
    RUN(a_beam_that_is_missing_is_missed_in_its_own_part_alone);
    RUN(what_is_no_beams_own_is_free_up_to_the_echoes_around);
    RUN(an_echo_ends_the_part_of_its_beam);
    RUN(of_two_in_one_direction_the_worse_counts);
    RUN(off_its_axis_a_beam_frees_no_more_than_it_detects);
    RUN(an_echo_ends_all_of_a_beam_that_hears_less_aside);
    RUN(a_column_of_beams_is_one_image);
    RUN(no_beams_free_what_none_of_them_sees);
    RUN(beams_that_make_no_grid_say_what_each_of_them_sees);
    RUN(an_echo_of_a_loose_ping_stops_the_beams_beside_it);
    RUN(what_is_free_near_is_not_lost_to_what_is_free_far);
    RUN(beams_on_a_slant_that_hear_less_aside);
    RUN(beams_that_make_no_grid_and_hear_less_aside);
    return test_end();
}
