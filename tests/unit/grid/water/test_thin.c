/* SPDX-License-Identifier: MIT */
/* test_thin - each thing in which two records must agree, so that one of them says nothing more or both may be one. */
#include "tests/lib/random.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/thin.h"

#define COLUMNS 40 /* of 1 degree */
#define ROWS    5

struct made {
    struct water_record r;
    double tan_az[COLUMNS + 1], tan_el[ROWS + 1];
    struct water_cell cell[2 * COLUMNS * ROWS];
};

static struct made before, middle, newest;
static struct made *const all[] = {&before, &middle, &newest};
static struct water_record joined;
static struct row_room room;

static void fill(struct made *m)
{
    m->r.image.tan_az = m->tan_az;
    m->r.image.tan_el = m->tan_el;
    water_image_fill(&m->r.image, m->cell);
}

/* Three that are alike, free from 0 to 10 m; parts: ROWS of a row of beams, 1 of a matrix. */
static void begin(uint8_t parts)
{
    for (int n = 0; n < 3; n++) {
        struct made *m = all[n];
        m->r = (struct water_record){.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                     .place_m = {3, -2, 1},
                                     .path_m = 50,
                                     .drift_m = {7, 8},
                                     .t_ns = 10 * (unsigned)n,
                                     .newest_ns = 10 * (unsigned)n + 5,
                                     .seq = 100 + (unsigned)n,
                                     .image = {.columns = COLUMNS, .rows = ROWS, .parts = parts, .near_m = 0.5}};
        for (int i = 0; i <= COLUMNS; i++)
            m->tan_az[i] = tan(geo_rad(i - COLUMNS / 2));
        for (int i = 0; i <= ROWS; i++)
            m->tan_el[i] = tan(geo_rad(2 * i - ROWS));
        for (int i = 0; i < COLUMNS * ROWS; i++)
            m->cell[i] = (struct water_cell){.from = 0, .least = 1000, .most = 1000, .ends = WATER_NO_END};
        fill(m);
    }
}

static void turn(struct water_record *r, int axis, double deg)
{
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    const double c = cos(geo_rad(deg)), s = sin(geo_rad(deg));
    for (int k = 0; k < 3; k++) {
        const double x = r->axis[a][k], y = r->axis[b][k];
        r->axis[a][k] = c * x + s * y;
        r->axis[b][k] = c * y - s * x;
    }
}

/* It ends there; of a row in all its parts. */
static void end_at(struct made *m, int column, int row, double at_m)
{
    for (int y = 0; y < ROWS; y++)
        if (y == row || m->r.image.parts == ROWS)
            m->cell[y * COLUMNS + column].ends = (uint16_t)lround(at_m / WATER_UNIT_M);
    m->r.echoes = true;
    fill(m);
}

static bool spares(void)
{
    return thin_spares(&before.r, &middle.r, &newest.r);
}

/* ---- which record is spared ---- */

TEST(a_record_between_two_that_are_near_and_alike_is_spared)
{
    begin(ROWS);
    CHECK(spares());
    for (int n = 0; n < 3; n++)
        for (int k = 0; k < 3; k++) {
            begin(ROWS);
            all[n]->r.place_m[k] += 0.14;
            CHECK(spares());
            all[n]->r.place_m[k] += 0.02;
            CHECK(!spares());
            begin(ROWS);
            turn(&all[n]->r, k, 3.9);
            CHECK(spares());
            turn(&all[n]->r, k, 0.2);
            CHECK(!spares());
        }
    begin(ROWS);
    newest.r.newest_ns = THIN_JOINED_NS; /* since the one before */
    CHECK(spares());
    newest.r.newest_ns++;
    CHECK(!spares());
    for (int n = 0; n < 3; n++) {
        for (int k = 0; k < 2; k++) {
            begin(ROWS);
            all[n]->r.drift_m[k] += 0.14;
            CHECK(spares());
            all[n]->r.drift_m[k] += 0.02;
            CHECK(!spares());
        }
        for (int kind = 0; kind < 6; kind++) {
            begin(ROWS);
            all[n]->tan_az[0] += kind == 0 ? 1e-6 : 0;
            all[n]->tan_az[COLUMNS] += kind == 1 ? 1e-6 : 0;
            all[n]->tan_el[0] += kind == 2 ? 1e-6 : 0;
            all[n]->tan_el[ROWS] += kind == 3 ? 1e-6 : 0;
            all[n]->r.image.columns = (uint16_t)(COLUMNS - (kind == 4));
            all[n]->r.image.rows = (uint16_t)(ROWS - (kind == 5));
            CHECK(!spares());
            all[n]->tan_az[COLUMNS - 1] += kind == 4 ? all[n]->tan_az[COLUMNS] - all[n]->tan_az[COLUMNS - 1] : 0;
            all[n]->tan_el[ROWS - 1] += kind == 5 ? all[n]->tan_el[ROWS] - all[n]->tan_el[ROWS - 1] : 0;
            CHECK(!spares()); /* of other columns or rows, but as wide and as high */
        }
    }
}

/* All that a narrow one shows those beside it must show as well: they overlap by half, from 2 m on. */
TEST(a_narrow_record_is_spared_by_those_that_overlap_it)
{
    for (int high = 0; high < 2; high++)
        for (int n = 0; n < 3; n++)
            for (int kind = 0; kind < 4; kind++) {
                begin(ROWS);
                for (int i = 0; i < 3; i++) { /* 3 degrees wide or high, and 12 the other way */
                    for (int x = 0; x <= COLUMNS; x++)
                        all[i]->tan_az[x] = tan(geo_rad((high ? 12.0 : 3.0) * (x / (double)COLUMNS - 0.5)));
                    for (int y = 0; y <= ROWS; y++)
                        all[i]->tan_el[y] = tan(geo_rad((high ? 3.0 : 12.0) * (y / (double)ROWS - 0.5)));
                }
                if (kind < 2)
                    turn(&all[n]->r, high ? 1 : 2, kind ? 1.55 : 1.45);
                else
                    all[n]->r.place_m[high ? 2 : 1] += 2 * geo_rad(kind == 3 ? 1.55 : 1.45);
                CHECK_INT(spares(), kind % 2 == 0);
            }
}

/* By both, and by one of them in the very same beam. */
TEST(an_end_must_be_seen_by_those_before_and_behind)
{
    static const struct {
        double before_m, newest_m;
        int before_off, newest_off;
        bool spared;
    } row[] = {
        {4, 4, 0, 0, true},       {0, 4, 0, 0, false},    {4, 0, 0, 0, false},    {4, 4, 1, 0, true},
        {4, 4, 0, -1, true},      {4, 4, 1, -1, false},   {4, 4, 2, 0, false},    {4, 4, 0, -2, false},
        {4.04, 4.04, 0, 0, true}, {4.06, 4, 0, 0, false}, {4, 4.06, 0, 0, false}, {3, 1, 0, 0, true},
    };
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        for (int matrix = 0; matrix < 3; matrix++) {
            begin(matrix ? 1 : ROWS);
            end_at(&middle, 20, 2, 4);
            const int across = matrix == 2; /* along the other angle */
            if (row[i].before_m > 0)
                end_at(&before, 20 + !across * row[i].before_off, 2 + across * row[i].before_off, row[i].before_m);
            if (row[i].newest_m > 0)
                end_at(&newest, 20 + !across * row[i].newest_off, 2 + across * row[i].newest_off, row[i].newest_m);
            CHECK(spares() == row[i].spared);
            middle.r.echoes = false; /* nothing ends in it, it says */
            CHECK(spares());
        }
    for (int edge = 0; edge < 2; edge++) { /* at the sides of the image */
        begin(ROWS);
        for (int n = 0; n < 3; n++)
            end_at(all[n], edge ? COLUMNS - 1 : 0, 2, 4);
        CHECK(spares());
        end_at(&middle, edge ? 0 : COLUMNS - 1, 2, 4);
        CHECK(!spares());
    }
}

/* A place is looked up where the others see it: 1 m away a tenth of a metre is 5 to 6 degrees. */
TEST(an_end_is_looked_for_where_it_is_seen_from_elsewhere)
{
    for (int n = 0; n < 3; n += 2)
        for (int side = -1; side <= 1; side += 2) {
            struct made *moved = all[n], *still = all[2 - n];
            const double az = geo_deg(atan2(sin(geo_rad(0.5)) - side * 0.1, cos(geo_rad(0.5))));
            for (int kind = 0; kind < 2; kind++) {
                begin(ROWS);
                moved->r.place_m[1] += side * 0.1;
                end_at(&middle, 20, 2, 1);
                end_at(still, 20, 2, 1);
                end_at(moved, kind ? 20 : 20 + (int)floor(az), 2, 1);
                CHECK(spares() == (kind == 0));
            }
            for (int kind = 0; kind < 2; kind++) { /* ahead or behind: it ends nearer or farther away */
                begin(ROWS);
                moved->r.place_m[0] += side * 0.1;
                end_at(&middle, 20, 2, 1);
                end_at(still, 20, 2, 1);
                end_at(moved, 20, 2, 1 - side * 0.1 + (kind ? 0.07 : 0.03));
                CHECK(spares() == (kind == 0));
            }
            for (int kind = 0; kind < 2; kind++) { /* above or below, in a matrix */
                begin(1);
                moved->r.place_m[2] += side * 0.06;
                end_at(&middle, 20, 2, 1);
                end_at(still, 20, 2, 1);
                end_at(moved, 20, kind ? 2 - side * 2 : 2 + side * 2, 1);
                CHECK(spares() == (kind == 0));
            }
            for (int kind = 0; kind < 2; kind++) { /* its axes are turned: one column and a half */
                begin(ROWS);
                turn(&moved->r, 2, side * 3);
                end_at(&middle, 20, 2, 4);
                end_at(still, 20, 2, 4);
                end_at(moved, 20 + (kind ? side : -side) * 3, 2, 4);
                CHECK(spares() == (kind == 0));
            }
        }
}

/* Of a deaf beam nobody knows where it ends, of what is next to the sensor where that is seen from elsewhere: as the
 * beams look it must be shown. */
TEST(an_end_in_the_sensor_is_that_of_the_same_direction)
{
    static const struct {
        double at_m, turned_deg, shown_m;
        int off;
        bool spared;
    } row[] = {{0, 0, 0, 0, true},      {0, 0, -1, 0, false},   {0, 3, -1, 0, false},    {0, 3, 0, -3, true},
               {0, 3, 0, 0, false},     {0, -3, 0, 3, true},    {0.1, 0, 0.14, 0, true}, {0.1, 0, 0.2, 0, false},
               {0.1, 3, 0.1, -3, true}, {0.1, 3, -1, 0, false}, {0.14, 0, -1, 0, false}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        for (int n = 0; n < 3; n += 2)
            for (int moved = 0; moved < 3; moved++) {
                begin(ROWS);
                struct made *other = all[n];
                other->r.place_m[0] += moved == 1 ? 0.14 : 0;
                other->r.place_m[0] -= moved == 2 ? 0.14 : 0;
                turn(&other->r, 2, row[i].turned_deg);
                end_at(&middle, 20, 2, row[i].at_m);
                end_at(all[2 - n], 20, 2, row[i].at_m);
                if (row[i].shown_m >= 0)
                    end_at(other, 20 + row[i].off, 2, row[i].shown_m);
                CHECK_INT(spares(), row[i].spared);
            }
}

static uint64_t seed;

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

/* In which column or row, with fractions. */
static double part_at(const double *tan_of, int n, double x)
{
    int i = 0;
    while (i + 1 < n && tan_of[i + 1] <= x)
        i++;
    return i + (x - tan_of[i]) / (tan_of[i + 1] - tan_of[i]);
}

/* Where another record has the middle of that cell of `middle`, at that range. */
static double seen_by(const struct made *m, int column, int row, double at_m, double *column_of, double *row_of)
{
    const double az = atan((middle.tan_az[column] + middle.tan_az[column + 1]) / 2),
                 el = atan((middle.tan_el[row] + middle.tan_el[row + 1]) / 2);
    double v[3], to[3] = {0, 0, 0};
    geo_direction(az, el, v);
    for (int k = 0; k < 3; k++) {
        to[k] = middle.r.place_m[k] - m->r.place_m[k];
        for (int j = 0; j < 3; j++)
            to[k] += at_m * v[j] * middle.r.axis[j][k];
    }
    const double ahead = geo_dot(to, m->r.axis[0]), right = geo_dot(to, m->r.axis[1]),
                 down = geo_dot(to, m->r.axis[2]);
    *column_of = part_at(m->tan_az, COLUMNS, right / ahead);
    *row_of = part_at(m->tan_el, ROWS, -down / hypot(ahead, right));
    return geo_length(to);
}

/* From anywhere, turned anyhow: at the very cell that has it an end is found, and not two columns or rows beside it. */
TEST(an_end_is_found_from_anywhere)
{
    int found = 0, tried = 0;
    seed = test_seed();
    while (tried < 400) {
        const int column = (int)between(6, COLUMNS - 6), row = (int)between(0, ROWS);
        const double at_m = 0.01 * floor(between(60, 400));
        bool inside = true;
        double column_of[3], row_of[3], range_m[3];
        begin(1);
        for (int n = 0; n < 3; n++) {
            for (int i = 0; i <= ROWS; i++)
                all[n]->tan_el[i] = tan(geo_rad(16 * i - 8 * ROWS));
            for (int k = 0; k < 3; k++)
                all[n]->r.place_m[k] += between(-0.04, 0.04);
            for (int k = 0; k < 3; k++)
                turn(&all[n]->r, k, 30 * k + between(-1.2, 1.2));
        }
        for (int n = 0; n < 3; n += 2) {
            range_m[n] = seen_by(all[n], column, row, at_m, &column_of[n], &row_of[n]);
            inside = inside && fabs(column_of[n] - floor(column_of[n]) - 0.5) < 0.49 && column_of[n] > 2 &&
                     column_of[n] < COLUMNS - 3 && fabs(row_of[n] - floor(row_of[n]) - 0.5) < 0.49 &&
                     row_of[n] > 0 && row_of[n] < ROWS;
        }
        if (!inside)
            continue;
        tried++;
        end_at(&middle, column, row, at_m);
        for (int n = 0; n < 3; n += 2)
            end_at(all[n], (int)column_of[n], (int)row_of[n], range_m[n]);
        found += spares();
        before.cell[(int)row_of[0] * COLUMNS + (int)column_of[0]].ends = WATER_NO_END;
        if (tried % 2)
            end_at(&before, (int)column_of[0] + (column % 2 ? 2 : -2), (int)row_of[0], range_m[0]);
        else
            end_at(&before, (int)column_of[0], (int)row_of[0] + (row_of[0] < 2 ? 2 : -2), range_m[0]);
        found -= spares();
    }
    CHECK_INT(found, tried);
}

/* ---- pings from one place ---- */

static bool is_still(void)
{
    return thin_is_still(&middle.r, &newest.r);
}

TEST(pings_from_one_place_are_those_of_the_same_image_there)
{
    begin(ROWS);
    CHECK(is_still());
    for (int k = 0; k < 3; k++) {
        begin(ROWS);
        newest.r.place_m[k] += 0.009;
        CHECK(is_still());
        newest.r.place_m[k] -= 0.020;
        CHECK(!is_still());
        begin(ROWS);
        turn(&newest.r, k, geo_deg(0.9e-3));
        CHECK(is_still());
        turn(&newest.r, k, geo_deg(0.2e-3));
        CHECK(!is_still());
    }
    begin(ROWS);
    newest.r.path_m += 0.009;
    CHECK(is_still());
    newest.r.path_m += 0.002;
    CHECK(!is_still());
    for (int k = 0; k < 2; k++) {
        begin(ROWS);
        newest.r.drift_m[k] += 0.14;
        CHECK(is_still());
        newest.r.drift_m[k] += 0.02;
        CHECK(!is_still());
    }
    for (int kind = 0; kind < 4; kind++) {
        begin(ROWS);
        newest.tan_az[7] += kind == 0 ? 1e-6 : 0;
        newest.tan_el[3] += kind == 1 ? 1e-6 : 0;
        newest.r.image.columns = (uint16_t)(COLUMNS - (kind == 2));
        newest.r.image.rows = (uint16_t)(ROWS - (kind == 3));
        CHECK(!is_still());
    }
    for (int end = 0; end < 2; end++) {
        begin(ROWS);
        newest.tan_az[end * COLUMNS] += 1e-6;
        CHECK(!is_still());
        begin(ROWS);
        newest.tan_el[end * ROWS] += 1e-6;
        CHECK(!is_still());
    }
}

/* What the newer one frees the older one's echo would end no more. */
TEST(what_a_newer_ping_frees_beyond_an_echo_is_not_joined)
{
    for (int at = 0; at < COLUMNS * ROWS; at += COLUMNS * ROWS - 1) {
        begin(1);
        middle.cell[at].ends = 400;
        middle.r.echoes = true;
        CHECK(!is_still());
        newest.cell[at].least = 406;
        CHECK(!is_still());
        newest.cell[at].least = 404;
        CHECK(is_still());
    }
    begin(1);
    newest.cell[0].ends = 400; /* its own echo is no matter */
    newest.r.echoes = true;
    CHECK(is_still());
}

TEST(a_cell_of_two_is_free_as_far_as_either_and_ends_at_the_nearer_echo)
{
    static const struct {
        uint16_t older[3], newer[3], both[3]; /* free from, free to, ends */
    } row[] = {
        {{0, 500, WATER_NO_END}, {0, 300, WATER_NO_END}, {0, 500, WATER_NO_END}},
        {{0, 300, WATER_NO_END}, {0, 500, WATER_NO_END}, {0, 500, WATER_NO_END}},
        {{20, 300, WATER_NO_END}, {50, 500, WATER_NO_END}, {20, 500, WATER_NO_END}},
        {{50, 500, WATER_NO_END}, {20, 300, WATER_NO_END}, {20, 500, WATER_NO_END}},
        {{0, 500, WATER_NO_END}, {0, 300, 310}, {0, 310, 310}}, /* a newer echo ends what is older */
        {{0, 300, 310}, {0, 310, WATER_NO_END}, {0, 310, 310}},
        {{0, 300, 310}, {0, 300, 305}, {0, 300, 305}},
        {{200, 500, WATER_NO_END}, {0, 100, WATER_NO_END}, {200, 500, WATER_NO_END}}, /* the longer one */
        {{0, 100, WATER_NO_END}, {200, 500, WATER_NO_END}, {200, 500, WATER_NO_END}},
        {{200, 250, WATER_NO_END}, {0, 100, WATER_NO_END}, {0, 100, WATER_NO_END}},
        {{300, 420, WATER_NO_END}, {0, 110, WATER_NO_END}, {300, 420, WATER_NO_END}},
        {{0, 0, WATER_NO_END}, {50, 300, WATER_NO_END}, {50, 300, WATER_NO_END}}, /* one that says nothing */
        {{50, 300, WATER_NO_END}, {0, 0, WATER_NO_END}, {50, 300, WATER_NO_END}},
        {{400, 500, WATER_NO_END}, {0, 300, 310}, {0, 300, 310}},
        {{400, 700, WATER_NO_END}, {100, 350, WATER_NO_END}, {400, 700, WATER_NO_END}},
        {{0, 100, WATER_NO_END}, {100, 300, WATER_NO_END}, {0, 300, WATER_NO_END}}, /* they touch */
        {{100, 300, WATER_NO_END}, {0, 100, WATER_NO_END}, {0, 300, WATER_NO_END}},
    };
    begin(1);
    const int n = sizeof row / sizeof *row;
    for (int i = 0; i < n; i++) {
        middle.cell[i] = (struct water_cell){row[i].older[0], row[i].older[1], row[i].older[1], row[i].older[2]};
        newest.cell[i] = (struct water_cell){row[i].newer[0], row[i].newer[1], row[i].newer[1], row[i].newer[2]};
    }
    thin_join(&middle.r, &newest.r, &joined, &room);
    for (int i = 0; i < n; i++) {
        const struct water_cell *cell = &joined.image.cell[i];
        CHECK_INT(cell->from, row[i].both[0]);
        CHECK_INT(cell->least, row[i].both[1]);
        CHECK_INT(cell->most, row[i].both[1]);
        CHECK_INT(cell->ends, row[i].both[2]);
    }
}

/* As old as the older one, as uncertain as either. */
TEST(one_record_of_two_is_as_old_and_as_uncertain_as_the_worse)
{
    for (int worse = 0; worse < 2; worse++) {
        struct made *good = worse ? &middle : &newest, *bad = worse ? &newest : &middle;
        begin(1);
        turn(&newest.r, 0, geo_deg(0.5e-3));
        newest.r.place_m[1] += 0.005;
        good->r.uncertain_m = 0.02;
        bad->r.uncertain_m = 0.03;
        good->r.tilt_rad = 0.01;
        bad->r.tilt_rad = 0.02;
        for (int k = 0; k < 3; k++) {
            good->r.spread_m[k] = 0.1 * k;
            bad->r.spread_m[k] = 0.1 * k + 0.05;
        }
        bad->r.echoes = true;
        good->r.image.near_m = 0.3;
        thin_join(&middle.r, &newest.r, &joined, &room);
        CHECK_INT(joined.t_ns, middle.r.t_ns);
        CHECK_INT(joined.newest_ns, newest.r.newest_ns);
        CHECK_INT(joined.seq, newest.r.seq);
        CHECK_NEAR(joined.uncertain_m, worse ? 0.035 : 0.03, 1e-9, 0);
        CHECK_NEAR(joined.tilt_rad, worse ? 0.0205 : 0.02, 1e-6, 0);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(joined.spread_m[k], 0.1 * k + 0.05, 1e-9, 0);
        CHECK(joined.echoes);
        CHECK_NEAR(joined.image.near_m, 0.3, 0, 0);
        CHECK(joined.place_m[1] == -2 && joined.axis[1][1] == 1);
        CHECK(joined.image.tan_az == room.tan_az && joined.image.tan_el == room.tan_el &&
              joined.image.cell == room.cell);
        CHECK(memcmp(room.tan_az, middle.tan_az, sizeof middle.tan_az) == 0 &&
              memcmp(room.tan_el, middle.tan_el, sizeof middle.tan_el) == 0);
    }
}

int main(void)
{
    RUN(a_record_between_two_that_are_near_and_alike_is_spared);
    RUN(a_narrow_record_is_spared_by_those_that_overlap_it);
    RUN(an_end_must_be_seen_by_those_before_and_behind);
    RUN(an_end_is_looked_for_where_it_is_seen_from_elsewhere);
    RUN(an_end_in_the_sensor_is_that_of_the_same_direction);
    RUN(an_end_is_found_from_anywhere);
    RUN(pings_from_one_place_are_those_of_the_same_image_there);
    RUN(what_a_newer_ping_frees_beyond_an_echo_is_not_joined);
    RUN(a_cell_of_two_is_free_as_far_as_either_and_ends_at_the_nearer_echo);
    RUN(one_record_of_two_is_as_old_and_as_uncertain_as_the_worse);
    return test_end();
}
