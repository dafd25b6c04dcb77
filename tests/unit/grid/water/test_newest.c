/* SPDX-License-Identifier: MIT */
/*
 * test_newest - what a question takes from several records: of each stretch, the newest that says something of it; and
 * what it answers with. Records are written by hand and small.
 */
#include "tests/lib/ask_free.h"
#include "tests/lib/random.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/ask.h"

#define MOST    4
#define COLUMNS 24
#define ROWS    2

static struct made {
    struct water_record r;
    double tan_az[COLUMNS + 1], tan_el[ROWS + 1];
    struct water_cell cell[2 * COLUMNS * ROWS];
} made[MOST];
static struct water_view view[MOST];
static int records;

/* The next older one, of a sensor in the vehicle that looks north: free from 0.1 m on as far as that, and from there on
 * ended if `ends`. Its cells are 5 degrees wide and 10 high. */
static struct made *add(double to_m, bool ends)
{
    struct made *m = &made[records];
    const uint16_t to = (uint16_t)lround(to_m / WATER_UNIT_M);
    m->r = (struct water_record){.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                 .t_ns = 1000 - 10 * (unsigned)records,
                                 .newest_ns = 1000 - 10 * (unsigned)records,
                                 .image = {.columns = COLUMNS, .rows = ROWS, .parts = 1, .near_m = 0.1}};
    for (int i = 0; i <= COLUMNS; i++)
        m->tan_az[i] = tan(geo_rad(5 * i - 60));
    for (int i = 0; i <= ROWS; i++)
        m->tan_el[i] = tan(geo_rad(10 * i - 10));
    for (int i = 0; i < COLUMNS * ROWS; i++)
        m->cell[i] = (struct water_cell){.from = 10, .least = to, .most = to, .ends = ends ? to : WATER_NO_END};
    m->r.image.tan_az = m->tan_az;
    m->r.image.tan_el = m->tan_el;
    water_image_fill(&m->r.image, m->cell);
    view[records] = (struct water_view){.record = &m->r};
    records++;
    return m;
}

static struct ask_answer ask_at(double az_deg, double half_deg, double near_m)
{
    struct ask_question q = {.kind = ASK_CONE, .near_m = near_m, .to_m = 9, .half_rad = geo_rad(half_deg)};
    geo_direction(geo_rad(az_deg), 0, q.axis);
    return ask_free(view, records, &q);
}

static double free_at(double az_deg)
{
    return ask_at(az_deg, 0.2, 0.5).free_to_m;
}

#define CHECK_FREE(az_deg, want_m)                                                                                \
    do {                                                                                                          \
        const double got_m = free_at(az_deg);                                                                     \
        CHECK(got_m <= (want_m) + 1e-9 && got_m > (want_m)-0.1);                                                  \
    } while (0)

TEST(the_newest_record_that_says_something_counts)
{
    records = 0;
    CHECK_FREE(0, 0.5); /* nobody says anything */
    add(4, false);
    CHECK_FREE(0, 4);
    add(7, false); /* an older one goes on */
    CHECK_FREE(0, 7);
    records = 0;
    add(4, true); /* an echo ends it, whatever older ones say */
    add(7, false);
    CHECK_FREE(0, 4);
    records = 0;
    add(7, false); /* the echo of an older one is none */
    add(4, true);
    CHECK_FREE(0, 7);
    records = 0;
    add(3, false);
    add(5, true);
    add(8, false);
    CHECK_FREE(0, 5);
    records = 0; /* one that is near leaves a gap, which another one fills, and a third one only in part */
    struct made *m = add(9.5, false);
    for (int i = 0; i < COLUMNS * ROWS; i++)
        m->cell[i].from = 600;
    water_image_fill(&m->r.image, m->cell);
    CHECK_FREE(0, 0.5);
    add(4, false);
    CHECK_FREE(0, 4);
    add(6.5, false);
    CHECK_FREE(0, 9);
}

TEST(a_question_is_as_free_as_the_worst_of_it)
{
    records = 0;
    struct made *m = add(8, false);
    for (int row = 0; row < ROWS; row++)
        m->cell[row * COLUMNS + 12].least = m->cell[row * COLUMNS + 12].most = 300; /* of 0 to 5 degrees */
    water_image_fill(&m->r.image, m->cell);
    CHECK_FREE(7, 8);
    CHECK_FREE(2.5, 3);
    CHECK_FREE(-2.5, 8);
    const struct ask_answer a = ask_at(-5, 7, 0.5);
    double az, el;
    geo_angles(a.at, &az, &el);
    CHECK(a.free_to_m <= 3 && a.free_to_m > 2.7);
    CHECK(geo_deg(az) > -0.5 && geo_deg(az) < 2.5); /* there */
    CHECK_NEAR(a.at_m, a.free_to_m, 0, 1e-9);
    CHECK(geo_dot(a.at, tiles_cone(&a.tile).v) > 1 - 1e-9);
    CHECK(ask_at(-10, 4, 0.5).free_to_m > 7.9);
}

TEST(an_answer_tells_the_records_that_it_rests_on)
{
    records = 0;
    add(4, false);
    add(3, false); /* says nothing more */
    add(7, false);
    struct ask_answer a = ask_at(0, 1, 0.5);
    CHECK_INT(a.records, 2);
    CHECK_INT(a.oldest, 2);
    a = ask_at(120, 1, 0.5);
    CHECK(a.records == 0 && a.oldest == -1 && a.free_to_m <= 0.5);
    records = 0;
    add(9.5, false);
    a = ask_at(0, 1, 0.5);
    CHECK(a.records == 1 && a.oldest == 0 && a.free_to_m == 9);
    CHECK(a.at[0] == 0 && a.at[1] == 0 && a.at[2] == 0); /* so far as was asked */
}

/* A row of a head stands where its newest beam does. What another sensor received meanwhile may be newer than the beam
 * that freed the water. */
TEST(of_records_that_overlap_in_time_an_echo_of_either_counts)
{
    for (int kind = 0; kind < 4; kind++) {
        records = 0;
        struct made *row = add(8, false), *other = add(3, true);
        row->r.t_ns = 500;
        other->r.sensor = kind != 1;
        other->r.newest_ns = kind == 2 ? 499 : 700;
        other->r.t_ns = kind == 3 ? 400 : other->r.newest_ns;
        CHECK_FREE(0, kind == 0 || kind == 3 ? 3 : 8);
    }
    struct ask_question q = {.axis = {1}, .half_rad = 0.003, .near_m = 0.5, .to_m = 6};
    records = 0; /* though all that is asked was free by then */
    add(8, false)->r.t_ns = 500;
    struct made *meanwhile = add(3, true);
    meanwhile->r.sensor = 1;
    meanwhile->r.newest_ns = meanwhile->r.t_ns = 700;
    CHECK(ask_free(view, records, &q).free_to_m <= 3);
    records = 0; /* what freed it is newer; what is older freed nothing of it */
    add(8, false);
    struct made *away = add(8, false);
    away->r.axis[0][0] = away->r.axis[1][1] = -1;
    away->r.t_ns = 500;
    meanwhile = add(3, true);
    meanwhile->r.sensor = 1;
    meanwhile->r.newest_ns = meanwhile->r.t_ns = 700;
    CHECK_FREE(0, 8);
    records = 0; /* all of it ends, nearer than is asked */
    add(8, false)->r.t_ns = 500;
    struct made *other = add(0.3, true);
    other->r.sensor = 1;
    other->r.newest_ns = other->r.t_ns = 700;
    CHECK_FREE(0, 0.5);
    records = 0; /* it frees nothing anew */
    add(3, true)->r.t_ns = 500;
    other = add(8, false);
    other->r.sensor = 1;
    other->r.newest_ns = other->r.t_ns = 700;
    CHECK_FREE(0, 3);
}

/* Behind many records that lie elsewhere. */
TEST(each_of_many_records_is_asked)
{
    static struct water_view many[ASK_RECORDS];
    struct ask_question q = {.axis = {1}, .half_rad = 0.02, .near_m = 0.5, .to_m = 9};
    records = 0;
    struct made *away = add(9, true), *free = add(7, false), *ends = add(3, true);
    away->r.axis[0][0] = away->r.axis[1][1] = -1; /* it looks back */
    away->r.t_ns = away->r.newest_ns = 2000;
    ends->r.sensor = 1;
    ends->r.newest_ns = ends->r.t_ns = 700;
    for (int n = 60; n < 200; n++) {
        for (int i = 0; i < n; i++)
            many[i] = view[0];
        many[n] = view[1];
        free->r.t_ns = 800;
        many[n + 1] = view[2];
        struct ask_answer a = ask_free(many, n + 2, &q);
        CHECK(a.free_to_m <= 7 && a.free_to_m > 6.9);
        CHECK(a.records == 1 && a.oldest == n);
        free->r.t_ns = 600; /* what ends was received meanwhile */
        CHECK(ask_free(many, n + 2, &q).free_to_m <= 3);
        q.to_m = 6; /* though all that was asked was free by then */
        CHECK(ask_free(many, n + 2, &q).free_to_m <= 3);
        q.to_m = 9;
    }
}

/* Yes or no: to know that it is not free as far as that is enough. */
TEST(a_question_of_yes_or_no_is_over_at_the_first_no)
{
    static struct ask ask;
    records = 0;
    add(3, true);
    struct ask_question q = {.axis = {1}, .half_rad = 0.1, .near_m = 0.5, .to_m = 9, .stops = true};
    CHECK(ask_free(view, records, &q).free_to_m < 9);
    ask_begin(&ask, view, records, &q);
    CHECK(!ask_step(&ask));
    CHECK(ask.over);
    q.to_m = 2.5;
    CHECK(ask_free(view, records, &q).free_to_m >= 2.5);
}

/* A tile far away, where it is free, and where that ends. */
TEST(where_a_tile_begins_to_be_free_is_known)
{
    static struct ask ask;
    double v[3] = {1, 0, 0}, ends_m;
    const struct tile_index tile = tiles_at(v, TILES_LEVELS - 1);
    records = 0;
    struct made *m = add(5, false);
    for (int i = 0; i < COLUMNS * ROWS; i++)
        m->cell[i].from = 200;
    water_image_fill(&m->r.image, m->cell);
    CHECK_NEAR(ask_begins_m(&ask, view, records, &tile, &(struct ask_stretch){0.5, 9}, &ends_m), 2, 0, 0.05);
    CHECK(ends_m == INFINITY);
    CHECK_NEAR(ask_begins_m(&ask, view, records, &tile, &(struct ask_stretch){3, 9}, &ends_m), 3, 0, 1e-9);
    CHECK(ask_begins_m(&ask, view, records, &tile, &(struct ask_stretch){5.5, 9}, &ends_m) == INFINITY);
    add(1, true);
    CHECK(ask_begins_m(&ask, view, records, &tile, &(struct ask_stretch){0.5, 9}, &ends_m) <= 0.5);
    CHECK(ask_begins_m(&ask, view, 0, &tile, &(struct ask_stretch){0.5, 9}, &ends_m) == INFINITY);
}

/* As it touches an echo beside it, or in the midst of one. */
TEST(where_a_tile_ends_is_known)
{
    static struct ask ask;
    double v[3], ends_m;
    const struct ask_stretch within = {0.5, 9};
    records = 0;
    struct made *m = add(8, false);
    for (int row = 0; row < ROWS; row++)
        m->cell[row * COLUMNS + 11] =
            (struct water_cell){.from = 10, .least = 400, .most = 400, .ends = 400}; /* of -5 to 0 degrees */
    water_image_fill(&m->r.image, m->cell);
    geo_direction(geo_rad(2.5), geo_rad(2.5), v);
    struct tile_index tile = tiles_at(v, 0);
    CHECK(ask_begins_m(&ask, view, records, &tile, &within, &ends_m) <= 0.5);
    CHECK(ends_m <= 4 && ends_m > 3.5);
    CHECK(ask_begins_m(&ask, view, records, &tile, &(struct ask_stretch){0.5, 3}, &ends_m) <= 0.5);
    CHECK(ends_m == INFINITY);
    tile = tiles_at(v, TILES_LEVELS - 1); /* it does not touch that */
    CHECK(ask_begins_m(&ask, view, records, &tile, &within, &ends_m) <= 0.5 && ends_m == INFINITY);
    geo_direction(geo_rad(-2.5), geo_rad(2.5), v);
    tile = tiles_at(v, TILES_LEVELS - 1);
    CHECK(ask_begins_m(&ask, view, records, &tile, &(struct ask_stretch){4.5, 9}, &ends_m) == INFINITY);
    CHECK(ends_m == 4.5);
}

static uint64_t seed;

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

/* What is not in the middle of it nor at its rim is found all the same, before it is over. */
TEST(a_question_of_yes_or_no_is_not_over_before_all_of_it_is_asked)
{
    records = 0;
    struct made *m = add(9.5, false);
    for (int row = 0; row < ROWS; row++)
        m->cell[row * COLUMNS + 14] =
            (struct water_cell){.from = 10, .least = 300, .most = 300, .ends = 300}; /* of 10 to 15 degrees */
    water_image_fill(&m->r.image, m->cell);
    struct ask_question q = {.axis = {1}, .half_rad = geo_rad(9.5), .near_m = 0.5, .to_m = 9, .stops = true};
    geo_direction(geo_rad(7), 0, q.axis);
    CHECK(ask_free(view, records, &q).free_to_m <= 3);
    geo_direction(geo_rad(-1), 0, q.axis);
    CHECK(ask_free(view, records, &q).free_to_m >= 9);
}

/* The axes of the cells are turned by half of one, so that tiles of 5 degrees lie across two of them. */
static void turn_by(struct made *m, double deg)
{
    const double c = cos(geo_rad(deg)), s = sin(geo_rad(deg));
    memcpy(m->r.axis, (double[3][3]){{c, s, 0}, {-s, c, 0}, {0, 0, 1}}, sizeof m->r.axis);
}

static void set_column(struct made *m, int column, double from_m, double to_m)
{
    const uint16_t from = (uint16_t)lround(100 * from_m), to = (uint16_t)lround(100 * to_m);
    for (int row = 0; row < ROWS; row++)
        m->cell[row * COLUMNS + column] =
            (struct water_cell){.from = from, .least = to, .most = to, .ends = WATER_NO_END};
    water_image_fill(&m->r.image, m->cell);
}

/* A cell of 5 degrees beside one that ends: the nearer to it, the smaller a tile has to be that does not touch it. */
TEST(each_level_of_tiles_tells_more)
{
    const double beside_deg[TILES_LEVELS] = {7.5, 3.75, 1.9, 0.95, 0.47, 0.24};
    records = 0;
    struct made *silent = add(9.5, false); /* says nothing of either */
    for (int i = 0; i < COLUMNS; i++)
        set_column(silent, i, 0, 0);
    struct made *m = add(9.5, false);
    add(9.5, false);
    for (int row = 0; row < ROWS; row++)
        m->cell[row * COLUMNS + 11] = (struct water_cell){.from = 10, .least = 300, .most = 300, .ends = 300};
    water_image_fill(&m->r.image, m->cell);
    for (int levels = 1; levels <= TILES_LEVELS; levels++)
        for (int at = 0; at < TILES_LEVELS; at++) {
            struct ask_question q = {.near_m = 0.5, .to_m = 9, .half_rad = 1e-4, .levels = levels};
            geo_direction(geo_rad(beside_deg[at]), geo_rad(1), q.axis);
            CHECK_INT(ask_free(view, records, &q).free_to_m > 3, at < levels);
        }
}

/* Two stretches are open where a tile is divided; an older record frees one of them for its parts. */
TEST(parts_of_a_tile_keep_all_that_is_open)
{
    records = 0;
    struct made *m = add(5, false);
    for (int i = 0; i < COLUMNS; i++)
        set_column(m, i, 2, 5);
    m->r.image.near_m = 2;
    set_column(add(2.5, false), 13, 0.1, 9.5); /* of 5 to 10 degrees */
    CHECK_FREE(2.5, 5);
    CHECK_FREE(7.5, 9);
}

/* Nearer than a part of a tile is asked something may be open that the whole of it asks. */
TEST(what_is_open_nearer_than_a_part_is_asked_does_not_count)
{
    static double level_m[ASK_LEVEL];
    records = 0;
    struct made *m = add(9.5, false);
    for (int i = 13; i < COLUMNS; i++) /* from 5 degrees on */
        set_column(m, i, 1, 9.5);
    for (int k = 0; k < ASK_LEVEL; k++)
        level_m[k] = k > 2 ? 5 : 0.5; /* to 4.2 degrees */
    struct ask_question q = {.near_m = 5, .to_m = 8, .half_rad = geo_rad(2), .level_m = level_m};
    geo_direction(geo_rad(7), geo_rad(2), q.axis);
    CHECK(ask_free(view, records, &q).free_to_m >= 8);
    level_m[4] = 0.5; /* of 5.6 to 7 degrees */
    CHECK(ask_free(view, records, &q).free_to_m <= 1);
}

/* A corridor leaves what lies beside it behind: its outer parts are asked less far than the whole tile. */
TEST(parts_of_a_tile_are_asked_as_far_as_they_lie_in_a_corridor)
{
    records = 0;
    struct made *m = add(9.5, false);
    struct ask_question q = {.kind = ASK_CORRIDOR, .axis = {1}, .near_m = 3.6, .to_m = 8, .radius_m = 0.5};
    for (int side = 0; side < 2; side++) {
        set_column(m, side ? 10 : 13, 0.1, 6.5); /* beyond 5 degrees it is 0.56 m aside */
        for (int row = 0; row < ROWS; row++)
            m->cell[row * COLUMNS + (side ? 10 : 13)].ends = 650;
        water_image_fill(&m->r.image, m->cell);
    }
    CHECK(ask_free(view, records, &q).free_to_m >= 8);
    q.radius_m = 0.6;
    CHECK(ask_free(view, records, &q).free_to_m < 6.5);
}

/* Half a degree wide, from 11.6 degrees on: a cone around 10.2 degrees holds it, but for its middle and its rim. Its
 * upper part, from 2.2 degrees on, is nearer. */
static struct made *add_pole(double upper_m, double lower_m)
{
    struct made *m = add(9.5, false);
    m->r.image.columns = 3;
    m->tan_az[1] = tan(geo_rad(11.6));
    m->tan_az[2] = tan(geo_rad(12.1));
    m->tan_az[3] = tan(geo_rad(60));
    m->tan_el[0] = -0.5;
    m->tan_el[1] = tan(geo_rad(2.2));
    m->tan_el[2] = 0.5;
    const uint16_t ends[ROWS] = {(uint16_t)lround(100 * lower_m), (uint16_t)lround(100 * upper_m)};
    for (int row = 0; row < ROWS; row++)
        m->cell[row * 3 + 1] =
            (struct water_cell){.from = 10, .least = ends[row], .most = ends[row], .ends = ends[row]};
    water_image_fill(&m->r.image, m->cell);
    return m;
}

static struct ask_question around_pole(void)
{
    struct ask_question q = {.near_m = 0.5, .to_m = 9, .half_rad = geo_rad(2.2)};
    geo_direction(geo_rad(10.2), geo_rad(2.5), q.axis);
    return q;
}

/* Of tiles of 5 degrees that are to be divided the worst is not the first one of its row. */
TEST(each_tile_that_is_to_be_divided_is)
{
    const struct ask_question q = around_pole();
    double v[3];
    records = 0;
    add_pole(3, 5);
    struct water_pieces out;
    struct question_shape shape;
    question_begin(&shape, &q);
    for (size_t i = 0; question_probe(&shape, i, v); i++) {
        const struct tile_index tile = tiles_at(v, TILES_LEVELS - 1);
        const struct water_tile cone = tiles_cone(&tile);
        water_decide(&view[0], &cone, 0.5, 9, &out);
        CHECK(out.n == 1 && out.piece[0].says == WATER_FREE);
    }
    static struct ask ask;
    ask_begin(&ask, view, records, &q);
    while (ask_step(&ask))
        ;
    CHECK(ask.roots == 3 && ask.root[0].tile.row == 18 && ask.root[2].tile.row == 17); /* they came from below */
    CHECK(ask_end(&ask, 0).free_to_m <= 3);
    records = 0;
    add_pole(5, 3);
    CHECK(ask_free(view, records, &q).free_to_m <= 3);
}

/* Of many records the one that ends it comes at any place among others that lie elsewhere; of its tile only some does
 * it touch. */
TEST(a_record_is_asked_again_about_the_parts_of_a_tile)
{
    static struct water_view many[ASK_RECORDS];
    records = 0;
    struct made *away = add(9, true), *ends = add_pole(3, 3), *free = add(9.5, false);
    away->r.axis[0][0] = away->r.axis[1][1] = -1; /* it looks back */
    away->r.t_ns = away->r.newest_ns = ends->r.t_ns = ends->r.newest_ns = free->r.t_ns;
    for (int i = 0; i < 6; i++)
        if (i % 3 != 1)
            ends->cell[i] = (struct water_cell){.ends = WATER_NO_END};
    water_image_fill(&ends->r.image, ends->cell);
    const int n = 200;
    for (int at = 0; at < n - 1; at++) {
        struct ask_question q = around_pole();
        for (int i = 0; i < n - 1; i++)
            many[i] = view[i == at ? 1 : 0];
        many[n - 1] = view[2];
        CHECK(ask_free(many, n, &q).free_to_m <= 3);
        q.half_rad = geo_rad(1.1);
        const struct ask_answer a = ask_free(many, n, &q);
        CHECK(a.free_to_m >= 9 && a.records == 1 && a.oldest == n - 1);
    }
}

/* A tile crosses one column after the other, of which every second may tell smaller tiles more: what is open stays
 * one stretch. */
TEST(many_pieces_that_are_open_are_one)
{
    records = 0;
    for (int i = 0; i < 2; i++) {
        struct made *m = add(0.1, false);
        for (int k = 0; k < COLUMNS; k += 2) {
            set_column(m, k, 50, 60);
            set_column(m, k + 1, 0, 0);
        }
        turn_by(m, 2.5 * i);
        view[records - 1].at_m[0] = 3;
        view[records - 1].at_m[1] = -5;
    }
    turn_by(add(9.5, false), 90);
    struct ask_question q = {.near_m = 0.5, .to_m = 9, .half_rad = 1e-4};
    geo_direction(geo_rad(90.24), geo_rad(0.24), q.axis);
    const struct water_tile fine = tiles_cone(&(struct tile_index){0});
    struct water_tile cone = fine;
    memcpy(cone.v, q.axis, sizeof cone.v);
    cone.half_rad = 1e-3;
    struct water_pieces out;
    water_decide(&view[0], &cone, 0.5, 9, &out);
    CHECK(out.n > 18);
    CHECK(ask_free(view, records, &q).free_to_m >= 9);
}

/* Of more of them than there is room for the last ones count together: from the nearest to the farthest. */
TEST(of_too_many_stretches_that_smaller_tiles_may_be_told_more_of_none_is_lost)
{
    static struct made more[ASK_MIXED + 1];
    static struct water_view many[ASK_MIXED + 2];
    for (int kind = 0; kind < 3; kind++) {
        for (int i = 0; i < ASK_MIXED + 1; i++) {
            const bool goes_on = i == (kind == 0 ? ASK_MIXED - 1 : kind == 1 ? ASK_MIXED : 0);
            records = 0;
            more[i] = *add(0.1, false);
            struct made *m = &more[i];
            m->r.image.tan_az = m->tan_az;
            m->r.image.tan_el = m->tan_el;
            for (int k = 0; k < COLUMNS; k++)
                set_column(m, k, 0, 0);
            const double from_m = goes_on ? 3 : kind == 0 && i == ASK_MIXED ? 8 : 1;
            set_column(m, 13, from_m, goes_on ? 9.5 : from_m + 0.5);
            m->r.image.near_m = from_m;
            turn_by(m, -2.5); /* of 2.5 to 7.5 degrees */
            many[i] = (struct water_view){.record = &m->r};
        }
        records = 0;
        add(3.5, false);
        many[ASK_MIXED + 1] = view[0];
        struct ask_question q = {.near_m = 0.5, .to_m = 9, .half_rad = 1e-3};
        geo_direction(geo_rad(4), geo_rad(2.5), q.axis);
        CHECK(ask_free(many, ASK_MIXED + 2, &q).free_to_m >= 9);
        geo_direction(geo_rad(1), geo_rad(2.5), q.axis);
        CHECK(ask_free(many, ASK_MIXED + 2, &q).free_to_m <= 3.5);
    }
}

/* Smaller tiles may be free farther, but none of it ends; and what was asked before does not count. */
TEST(a_tile_ends_where_something_ends_it)
{
    static struct ask ask;
    double v[3], ends_m;
    geo_direction(geo_rad(2.5), geo_rad(2.5), v);
    const struct tile_index tile = tiles_at(v, 0);
    records = 0;
    set_column(add(9.5, false), 11, 0, 0);
    CHECK(ask_begins_m(&ask, view, records, &tile, &(struct ask_stretch){0.5, 9}, &ends_m) == INFINITY);
    CHECK(ends_m == INFINITY);
    records = 0;
    struct made *m = add(3, true); /* it is one cell: all of it ends */
    m->r.image.columns = m->r.image.rows = 1;
    m->tan_az[1] = m->tan_az[COLUMNS];
    m->tan_el[1] = m->tan_el[ROWS];
    water_image_fill(&m->r.image, m->cell);
    CHECK(ask_begins_m(&ask, view, records, &tile, &(struct ask_stretch){4.5, 9}, &ends_m) == INFINITY);
    CHECK(ends_m == 4.5);
}

/* The worst come first, for what is free there need not be asked farther elsewhere. */
TEST(tiles_are_asked_from_the_worst_on)
{
    static struct ask ask;
    seed = test_seed();
    for (int world = 0; world < 4; world++) {
        struct ask_question q = {.kind = ASK_AROUND, .near_m = 0.5, .to_m = 9};
        q.band = (struct ask_band){.attitude = {1, 0, 0, 0}, .lo_rad = -0.1, .hi_rad = 0.1, .parts = ASK_PARTS};
        records = 0;
        struct made *m = add(9.5, false);
        for (int i = 0; i < COLUMNS; i++)
            set_column(m, i, 0.1, between(2, 9));
        turn_by(m, 2.5);
        int steps = 1;
        ask_begin(&ask, view, records, &q);
        while (ask_step(&ask))
            steps++;
        CHECK(steps > 4);
        for (int i = 1; i < ask.roots; i++)
            CHECK(ask.root[i - 1].measure_m <= ask.root[i].measure_m);
        CHECK(ask.roots > 20);
        for (int level = 0; level < TILES_LEVELS - 1; level++) {
            CHECK(ask.level[level].n > 1);
            for (int i = 1; i < ask.level[level].n; i++)
                CHECK(ask.level[level].part[i - 1].measure_m <= ask.level[level].part[i].measure_m);
        }
    }
}

/* Ended beside by what was received meanwhile: smaller tiles keep what was free. */
TEST(parts_of_a_tile_that_is_contested_are_asked)
{
    struct ask_question q = {.near_m = 0.5, .to_m = 6, .half_rad = geo_rad(2)};
    records = 0;
    add(8, false)->r.t_ns = 500;
    struct made *meanwhile = add(3, true);
    meanwhile->r.sensor = 1;
    meanwhile->r.newest_ns = meanwhile->r.t_ns = 700;
    for (int i = 0; i < COLUMNS; i++)
        if (i != 11) /* of -5 to 0 degrees */
            set_column(meanwhile, i, 0, 0);
    geo_direction(geo_rad(2.5), geo_rad(2.5), q.axis);
    CHECK(ask_free(view, records, &q).free_to_m >= 6);
    geo_direction(geo_rad(-2.5), geo_rad(2.5), q.axis);
    CHECK(ask_free(view, records, &q).free_to_m <= 3);
}

/* What was received meanwhile ends it where it passes before that sensor, which says nothing of it farther on. */
TEST(what_is_contested_ends_before_what_is_open)
{
    records = 0;
    add(8, false)->r.t_ns = 500;
    struct made *meanwhile = add(1.5, true);
    meanwhile->r.sensor = 1;
    meanwhile->r.newest_ns = meanwhile->r.t_ns = 700;
    turn_by(meanwhile, 90); /* 3 m ahead and 1 m to the left, it looks to the right */
    view[1].at_m[0] = 1;
    view[1].at_m[1] = 3;
    CHECK(free_at(0) <= 3 - sqrt(1.5 * 1.5 - 1));
}

/* A third of the way each is free by every second column of a record; too many stretches are open for the rest. */
TEST(water_ends_where_too_many_stretches_are_open)
{
    enum { N = 20 };
    records = 0;
    for (int k = 0; k < 3; k++) {
        struct made *m = add(50, false);
        m->r.image.columns = N;
        m->r.image.near_m = 0;
        for (int i = 0; i <= N; i++)
            m->tan_az[i] = tan(geo_rad(-60 + 40 * k + 2 * i));
        for (int i = 0; i < ROWS * N; i++)
            m->cell[i] =
                (struct water_cell){.least = i % 2 ? 5000 : 0, .most = i % 2 ? 5000 : 0, .ends = WATER_NO_END};
        water_image_fill(&m->r.image, m->cell);
        view[k].at_m[0] = 3;
        view[k].at_m[1] = -5;
    }
    turn_by(add(8.5, false), 90);
    struct ask_question q = {.near_m = 0.5, .to_m = 9, .half_rad = 1e-4};
    geo_direction(geo_rad(90.24), geo_rad(0.24), q.axis);
    const double free_m = ask_free(view, records, &q).free_to_m;
    CHECK(free_m > 5 && free_m <= 8.5);
}

/* Of 0.4 degrees, anywhere in a cone. */
TEST(a_small_thing_is_found_wherever_it_stands)
{
    seed = test_seed();
    for (int i = 0; i < 150; i++) {
        const double az = between(2, 14), el = between(-4, 4);
        struct ask_question q = {.near_m = 0.5, .to_m = 9, .half_rad = geo_rad(2)};
        records = 0;
        struct made *m = add(9.5, false);
        m->r.image.columns = m->r.image.rows = 3;
        memcpy(m->tan_az, (double[]){-1, tan(geo_rad(az)), tan(geo_rad(az + 0.4)), 1}, 4 * sizeof(double));
        static double tan_el[4];
        memcpy(tan_el, (double[]){-0.5, tan(geo_rad(el)), tan(geo_rad(el + 0.4)), 0.5}, sizeof tan_el);
        m->r.image.tan_el = tan_el;
        m->cell[4] = (struct water_cell){.from = 10, .least = 300, .most = 300, .ends = 300};
        water_image_fill(&m->r.image, m->cell);
        geo_direction(geo_rad(az + between(-1, 1)), geo_rad(el + between(-1, 1)), q.axis);
        CHECK(ask_free(view, records, &q).free_to_m <= 3);
    }
}

/* The world is turned so that it lies about straight down, or up. */
TEST(the_lowest_and_the_highest_tiles_are_asked)
{
    for (int down = -1; down <= 1; down += 2) {
        struct ask_question q = around_pole();
        double from[3][3], to[3][3] = {{0, 0, down}, {1, 0, 0}, {0, down, 0}};
        memcpy(from[0], q.axis, sizeof from[0]);
        const double level = hypot(q.axis[0], q.axis[1]);
        memcpy(from[1], (double[3]){-q.axis[1] / level, q.axis[0] / level, 0}, sizeof from[1]);
        for (int i = 0; i < 3; i++)
            from[2][i] = from[0][(i + 1) % 3] * from[1][(i + 2) % 3] - from[0][(i + 2) % 3] * from[1][(i + 1) % 3];
        records = 0;
        struct made *m = add_pole(3, 3);
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                m->r.axis[k][i] = to[0][i] * from[0][k] + to[1][i] * from[1][k] + to[2][i] * from[2][k];
        memcpy(q.axis, to[0], sizeof q.axis);
        CHECK(ask_free(view, records, &q).free_to_m <= 3);
        q.half_rad = geo_rad(1.1);
        CHECK(ask_free(view, records, &q).free_to_m >= 9);
    }
}

/* No direction of what is around a body is asked before its tiles. */
TEST(what_nobody_has_seen_is_not_free_around_a_body)
{
    const struct ask_question q = {
        .kind = ASK_STAY, .to_m = 2, .body = {.up = {0, 0, -1}, .radius_m = 0.3, .half_height_m = 0.3}};
    records = 0;
    CHECK(ask_free(view, records, &q).free_to_m <= 0);
    add(9, false);
    CHECK(ask_free(view, records, &q).free_to_m <= 0);
}

/* As many stretches as fit into a millisecond, not a whole question. */
TEST(a_step_ends_after_some_thousand_stretches)
{
    static struct ask ask;
    static struct water_view many[ASK_RECORDS];
    struct ask_question q = {.near_m = 0.5, .to_m = 9, .half_rad = 1e-3};
    struct water_pieces out;
    double v[3];
    records = 0;
    struct made *m = add(0.1, false);
    for (int k = 0; k < COLUMNS; k += 2)
        set_column(m, k, 50, 60);
    view[0].at_m[0] = 3;
    view[0].at_m[1] = -5;
    for (int i = 0; i < ASK_RECORDS; i++)
        many[i] = view[0];
    geo_direction(geo_rad(90.2), geo_rad(0.2), q.axis);
    memcpy(v, q.axis, sizeof v);
    const struct tile_index tile = tiles_at(v, TILES_LEVELS - 1);
    const struct water_tile cone = tiles_cone(&tile);
    water_decide(&view[0], &cone, 0.5, 9, &out);
    const int judged = ASK_RECORDS * (1 + out.judged); /* of the first probe: nothing of it is free */
    int steps = 1;
    ask_begin(&ask, many, ASK_RECORDS, &q);
    while (ask_step(&ask))
        steps++;
    struct ask_question other = {.axis = {1}, .near_m = 0.5, .to_m = 9, .half_rad = 1e-3};
    ask_begin(&ask, many, ASK_RECORDS, &q);
    CHECK(ask_step(&ask)); /* it is left for another one */
    records = 0;
    add(7, false);
    ask_begin(&ask, view, records, &other);
    while (ask_step(&ask))
        ;
    CHECK(ask_end(&ask, 0).free_to_m > 6.9);
    CHECK(steps > 50 && steps >= judged / (4096 + 1 + out.judged) && steps <= judged / 4096 + 1);
}

/* ---- against points ---- */

static void draw_records(void)
{
    const int n = 1 + (int)between(0, MOST - 0.01);
    records = 0;
    while (records < n) {
        struct made *m = add(9.5, false);
        const double turned = between(-0.4, 0.4), c = cos(turned), s = sin(turned);
        memcpy(m->r.axis, (double[3][3]){{c, s, 0}, {-s, c, 0}, {0, 0, 1}}, sizeof m->r.axis);
        for (int i = 0; i < COLUMNS * ROWS; i++) {
            const uint16_t to = between(0, 1) < 0.1 ? 0 : (uint16_t)between(200, 900);
            const bool ends = to && between(0, 1) < 0.3;
            m->cell[i] = (struct water_cell){to ? (uint16_t)between(0, 60) : 0, to, to, ends ? to : WATER_NO_END};
        }
        m->r.image.near_m = 0;
        water_image_fill(&m->r.image, m->cell);
        for (int k = 0; k < 2; k++)
            view[records - 1].at_m[k] = between(-0.5, 0.5);
    }
}

/* By the newest that says something of it; true: it is free. */
static bool is_free_at(const double p[3])
{
    for (int i = 0; i < records; i++) {
        const struct made *m = &made[i];
        const double *at = view[i].at_m;
        const double ahead = at[0] + geo_dot(p, m->r.axis[0]), right = at[1] + geo_dot(p, m->r.axis[1]),
                     up = -p[2];
        const double az = right / ahead, el = up / hypot(ahead, right),
                     range_m = geo_length((double[3]){ahead, right, up});
        if (ahead <= 0 || az < m->tan_az[0] || az > m->tan_az[COLUMNS] || el < m->tan_el[0] ||
            el > m->tan_el[ROWS])
            continue;
        const struct water_cell *cell =
            &m->cell[water_image_find(m->tan_el, ROWS, el) * COLUMNS + water_image_find(m->tan_az, COLUMNS, az)];
        if (range_m >= cell->from * WATER_UNIT_M && range_m <= cell->least * WATER_UNIT_M)
            return true;
        if (cell->ends != WATER_NO_END && range_m > cell->ends * WATER_UNIT_M)
            return false;
    }
    return false;
}

TEST(no_point_is_said_to_be_free_that_the_newest_record_denies)
{
    int points = 0, wrong = 0;
    double said_m = 0, free_m = 0;
    seed = test_seed();
    for (int world = 0; world < 150; world++) {
        draw_records();
        for (int n = 0; n < 2; n++) {
            const double half_deg = between(0.2, 4), az_deg = between(-50, 50);
            struct ask_question q = {.near_m = 0.8, .to_m = 8, .half_rad = geo_rad(half_deg)};
            geo_direction(geo_rad(az_deg), geo_rad(between(-6, 6)), q.axis);
            const double to_m = ask_free(view, records, &q).free_to_m;
            double least_m = q.to_m;
            for (int k = 0; k < 30; k++) {
                double v[3], p[3];
                do
                    geo_direction(geo_rad(az_deg + between(-1, 1) * half_deg),
                                  asin(-q.axis[2]) + geo_rad(between(-1, 1) * half_deg), v);
                while (geo_dot(v, q.axis) < cos(q.half_rad));
                const double at_m = between(q.near_m, fmax(to_m, q.near_m));
                for (int j = 0; j < 3; j++)
                    p[j] = at_m * v[j];
                points += to_m > q.near_m;
                wrong += to_m > q.near_m && !is_free_at(p);
                double far_m = q.near_m;
                for (; far_m < least_m; far_m += 0.05) {
                    for (int j = 0; j < 3; j++)
                        p[j] = far_m * v[j];
                    if (!is_free_at(p))
                        break;
                }
                least_m = fmin(least_m, far_m);
            }
            said_m += to_m - q.near_m;
            free_m += least_m - q.near_m;
        }
    }
    printf("# %.0f of %.0f free metres said\n", said_m, free_m);
    CHECK_INT(wrong, 0);
    CHECK(points > 3000 && said_m > 0.8 * free_m);
}

#define PARTS 36

/* What is asked of all sectors at once is what is asked of each. */
TEST(a_part_of_a_question_is_what_it_is_by_itself)
{
    static struct ask ask;
    int free_ones = 0;
    seed = test_seed();
    for (int world = 0; world < 6; world++) {
        struct ask_question q = {.kind = ASK_AROUND, .near_m = 0.8, .to_m = 8};
        q.band = (struct ask_band){.attitude = {1, 0, 0, 0}, .parts = PARTS};
        q.band.lo_rad = geo_rad(between(-6, 0));
        q.band.hi_rad = geo_rad(between(0, 6));
        draw_records();
        ask_begin(&ask, view, records, &q);
        while (ask_step(&ask))
            ;
        struct ask_answer all[PARTS];
        for (size_t k = 0; k < PARTS; k++)
            all[k] = ask_end(&ask, k);
        q.band.parts = 1;
        q.band.width_rad = GEO_TURN / PARTS;
        for (size_t k = 0; k < PARTS; k++) {
            q.band.from_rad = geo_wrap(((double)k - 0.5) * q.band.width_rad);
            const struct ask_answer one = ask_free(view, records, &q);
            CHECK_NEAR(one.free_to_m, all[k].free_to_m, 0, 1e-9);
            free_ones += one.free_to_m > 2;
        }
    }
    CHECK(free_ones > 10);
}

int main(void)
{
    RUN(the_newest_record_that_says_something_counts);
    RUN(a_question_is_as_free_as_the_worst_of_it);
    RUN(an_answer_tells_the_records_that_it_rests_on);
    RUN(of_records_that_overlap_in_time_an_echo_of_either_counts);
    RUN(each_of_many_records_is_asked);
    RUN(a_question_of_yes_or_no_is_over_at_the_first_no);
    RUN(where_a_tile_begins_to_be_free_is_known);
    RUN(where_a_tile_ends_is_known);
    RUN(a_question_of_yes_or_no_is_not_over_before_all_of_it_is_asked);
    RUN(each_level_of_tiles_tells_more);
    RUN(parts_of_a_tile_keep_all_that_is_open);
    RUN(what_is_open_nearer_than_a_part_is_asked_does_not_count);
    RUN(parts_of_a_tile_are_asked_as_far_as_they_lie_in_a_corridor);
    RUN(each_tile_that_is_to_be_divided_is);
    RUN(a_record_is_asked_again_about_the_parts_of_a_tile);
    RUN(many_pieces_that_are_open_are_one);
    RUN(of_too_many_stretches_that_smaller_tiles_may_be_told_more_of_none_is_lost);
    RUN(a_tile_ends_where_something_ends_it);
    RUN(tiles_are_asked_from_the_worst_on);
    RUN(parts_of_a_tile_that_is_contested_are_asked);
    RUN(what_is_contested_ends_before_what_is_open);
    RUN(water_ends_where_too_many_stretches_are_open);
    RUN(a_small_thing_is_found_wherever_it_stands);
    RUN(the_lowest_and_the_highest_tiles_are_asked);
    RUN(what_nobody_has_seen_is_not_free_around_a_body);
    RUN(a_step_ends_after_some_thousand_stretches);
    RUN(no_point_is_said_to_be_free_that_the_newest_record_denies);
    RUN(a_part_of_a_question_is_what_it_is_by_itself);
    return test_end();
}
