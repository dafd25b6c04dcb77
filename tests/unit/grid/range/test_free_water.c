/* SPDX-License-Identifier: MIT */
/* test_free_water - how far a beam is free, rule by rule, of beams that are made by hand, cell by cell. */
#include "tests/lib/test.h"

#include "grid/range/free_water.h"

#define N        200
#define GUARD    3
#define HALF     2
#define FIRST    7
#define TARGET   100.0 /* power of the reference target */
#define CONTRAST 8.0
#define NEVER    1e9 /* a contrast that nothing has */

static struct profile_axis axis;
static struct amplitude amplitude;
static struct profile profile;
static struct baseline baseline;
static uint64_t cell[N], bits[N];
static uint8_t samples[N], blind[N], own[N];
static double level[N], calm[N];

/* A quiet beam, over a baseline that hides nothing; its own count is its power. */
static void start(void)
{
    axis = (struct profile_axis){.n = N, .dr = 0.1, .half = HALF, .window = 24, .guard = GUARD};
    amplitude = (struct amplitude){.sample_bytes = 1, .max_count = 255};
    baseline = (struct baseline){.level = level, .calm = calm};
    profile = (struct profile){.axis = &axis,
                               .amplitude = &amplitude,
                               .samples = samples,
                               .cell = cell,
                               .bits = bits,
                               .floor_power = 1,
                               .first = FIRST};
    for (int i = 0; i < N; i++) {
        cell[i] = 1;
        samples[i] = 10;
        level[i] = blind[i] = own[i] = 0;
    }
}

static void set_cells(int from, int to, uint64_t power)
{
    for (int i = from; i < to; i++)
        cell[i] = power;
}

static void set_levels(int from, int to, double power)
{
    for (int i = from; i < to; i++)
        level[i] = power;
}

/* What the profile and the baseline know of blocks. */
static void add_up(void)
{
    for (int i = 0; i < N; i++) {
        const int block = i / PROFILE_BLOCK, begins = i % PROFILE_BLOCK == 0;
        bits[block] = begins ? cell[i] : bits[block] | cell[i];
        calm[block] = begins || level[i] < calm[block] ? level[i] : calm[block];
    }
}

static struct free_water find(uint32_t begin, double contrast, uint32_t passed)
{
    add_up();
    return free_water_find(&profile, &baseline, begin, TARGET, contrast, passed);
}

static void check_water(struct free_water w, uint32_t begin, uint32_t end)
{
    CHECK_INT(w.begin, begin);
    CHECK_INT(w.end, end);
}

TEST(the_reference_target_is_as_strong_as_stated)
{
    CHECK_NEAR(free_water_detectable(AMPLITUDE_LINEAR, 0, 0), pow(10, -2.7), 1e-12,
               0); /* -21 dB, 6 of it fading */
    CHECK_NEAR(free_water_detectable(AMPLITUDE_LOG, 0, 0), pow(10, -5.2), 1e-12, 0);
    CHECK_NEAR(free_water_detectable(AMPLITUDE_LINEAR, 3, 10), pow(10, -3.4), 1e-12, 0);
    CHECK_NEAR(free_water_bottom_over_wall(0), pow(10, 0.6), 1e-12, 0);
    CHECK_NEAR(free_water_bottom_over_wall(10), pow(10, -0.4), 1e-12, 0);
}

TEST(a_receiver_that_says_nothing_is_dumb)
{
    start();
    CHECK(!free_water_is_dumb(&profile));
    memset(samples, 255, sizeof samples);
    CHECK(free_water_is_dumb(&profile));
    samples[N - 1] = 254;
    CHECK(!free_water_is_dumb(&profile));
    memset(samples, 0, sizeof samples);
    CHECK(free_water_is_dumb(&profile));
    samples[N - 1] = 1;
    CHECK(!free_water_is_dumb(&profile));
    memset(samples, 255, sizeof samples);
    memset(samples, 9, FIRST); /* the ring-down need not be at full scale */
    CHECK(free_water_is_dumb(&profile));
}

/* A baseline hides the target from half of its power on. */
TEST(water_begins_where_the_baseline_hides_the_target_no_more)
{
    static const struct {
        double power;
        uint32_t begin;
    } row[] = {{TARGET / 2, 40}, {TARGET / 2 - 0.1, 20}, {TARGET, 40}, {1, 20}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        start();
        set_levels(0, 20, 5000);
        set_levels(20, 40, row[i].power);
        CHECK_INT(free_water_begin(&profile, &baseline, TARGET), row[i].begin);
    }
    set_levels(0, N, TARGET / 2);
    CHECK_INT(free_water_begin(&profile, &baseline, TARGET), FIRST);
}

/* The loudest cell of the ring-down is sought within three guards: there the head still swings up. */
TEST(water_begins_behind_the_loudest_cell_near_the_head)
{
    for (int loudest = 3 * GUARD - 1; loudest <= 3 * GUARD; loudest++) {
        start();
        set_levels(0, 3, 1000);
        level[loudest] = 2000;
        CHECK_INT(free_water_begin(&profile, &baseline, TARGET), loudest < 3 * GUARD ? loudest + 1 : 3);
    }
}

TEST(a_ring_down_of_four_times_the_usual_one_rings_on)
{
    for (int templated = 0; templated < 2; templated++)
        for (uint64_t power = 399; power <= 400; power++) {
            start();
            axis.half = 0;
            set_levels(0, 20, 100);
            set_cells(0, 20, 100);
            cell[19] = power;
            memset(own, 255, sizeof own); /* of no power: the table is empty */
            profile.own = templated ? own : NULL;
            CHECK_INT(free_water_rings_on(&profile, &baseline, 20), power == 400);
            CHECK(!free_water_rings_on(&profile, &baseline, 19));
        }
    for (int i = 0; i < 256; i++)
        amplitude.table[i] = (uint64_t)i;
    cell[0] = 2000;
    CHECK(free_water_rings_on(&profile, &baseline, 1));
    cell[0] = 100;
    cell[19] = 800;
    own[19] = 200; /* the vehicle's own echo there: 4 times */
    CHECK(free_water_rings_on(&profile, &baseline, 20));
    own[19] = 201;
    CHECK(!free_water_rings_on(&profile, &baseline, 20));
}

/* Water ends half a pulse before the middle of the cell that ends it, and where a mask begins. */
TEST(water_ends_where_something_is_as_loud_as_the_target_or_stands_out)
{
    start();
    check_water(find(10, CONTRAST, 0), 10, N);
    cell[100] = (uint64_t)TARGET - 1;
    check_water(find(10, NEVER, 0), 10, N);
    check_water(find(10, CONTRAST, 0), 10, 100 - HALF); /* of the floor */
    set_levels(0, N, (TARGET - 1) / CONTRAST + 0.1);
    check_water(find(10, CONTRAST, 0), 10, N);
    cell[100] = (uint64_t)TARGET;
    check_water(find(10, NEVER, 0), 10, 100 - HALF);
    profile.blind = blind;
    check_water(find(10, CONTRAST, 0), 10, 100 - HALF);
    blind[100] = 1;
    check_water(find(10, CONTRAST, 0), 10, 100);
    blind[70] = 1;
    check_water(find(10, CONTRAST, 0), 10, 70);
    check_water(find(10, CONTRAST, 90), 71, 100);
    check_water(find(10, CONTRAST, 70), 10, 70);
    cell[1] = (uint64_t)TARGET;
    check_water(find(1, NEVER, 90), 71, 100);
}

TEST(water_begins_behind_what_the_baseline_explains)
{
    start();
    set_levels(0, 30, 200);
    set_cells(10, 30, 200);
    check_water(find(10, CONTRAST, 0), 30, N);
    cell[20] = (uint64_t)(200 * CONTRAST);
    check_water(find(10, CONTRAST, 0), 20, 20 - HALF); /* stands out */
    cell[20] = 200;
    samples[20] = 255;
    check_water(find(10, CONTRAST, 0), 20, 20 - HALF); /* saturated: nobody knows how loud */
    add_up();
    check_water(free_water_find(&profile, NULL, 10, TARGET, CONTRAST, 0), 20, 20 - HALF);
}

/* A block of cells is passed only when none of it can stand out, by its quietest level and in the profile's scale. */
TEST(blocks_that_are_passed_hide_nothing)
{
    start();
    level[100] = 50; /* all around it is quiet */
    cell[100] = 60;
    check_water(find(10, CONTRAST, 0), 10, N);
    level[100] = 0;
    check_water(find(10, CONTRAST, 0), 10, 100 - HALF);
    start();
    profile.shift = 2;
    cell[100] = (uint64_t)CONTRAST - 1;
    check_water(find(10, CONTRAST, 0), 10, N);
    cell[100] = (uint64_t)CONTRAST;
    check_water(find(10, CONTRAST, 0), 10, 100 - HALF);
    cell[100] = (uint64_t)TARGET / 4;
    check_water(find(10, NEVER, 0), 10, 100 - HALF);
}

/* What is loud alone ends nothing here; a window of which the mean is louder does, from its beginning on. */
TEST(a_surface_is_what_is_loud_on_average)
{
    for (int loud = 0; loud < 2; loud++) {
        start();
        axis.window = 20;
        set_cells(0, N, 10);
        cell[50] = loud ? 211 : 210; /* 20 or 20.05 on average */
        add_up();
        check_water(free_water_before_surface(&profile, (struct free_water){10, N}, 20.01), 10, loud ? 31 : N);
        check_water(free_water_before_surface(&profile, (struct free_water){10, 60}, 20.01), 10, loud ? 31 : 60);
        check_water(free_water_before_surface(&profile, (struct free_water){60, N}, 20.01), 60, N);
    }
}

TEST(the_end_of_the_ring_down_is_no_surface_unless_it_is_longer_than_a_window)
{
    static const struct {
        int from, to, at; /* loud cells, and another one; 0: none */
        uint32_t end, begins, ends;
    } row[] = {{10, 14, 0, N, 14, N},   {25, 26, 0, N, 26, N},   {10, 60, 0, N, 30, 30},
               {10, 14, 33, N, 30, 30}, {10, 14, 36, N, 14, 17}, {15, 16, 0, 20, 10, 10}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        start();
        axis.window = 20;
        set_cells(row[i].from, row[i].to, 1000);
        cell[row[i].at] = 1000;
        add_up();
        check_water(free_water_before_surface(&profile, (struct free_water){10, row[i].end}, 20), row[i].begins,
                    row[i].ends);
    }
}

/* Off the axis the pattern has taken 3 dB (the side) and 6 dB (the edge) of what a target returns. */
TEST(off_the_axis_water_ends_at_what_is_weaker_by_the_pattern)
{
    for (int side = 0; side < 2; side++)
        for (int edge = 0; edge < 2; edge++) {
            start();
            cell[60] = (uint64_t)(TARGET / 4) - !edge;
            cell[120] = (uint64_t)(TARGET / 2) - !side;
            add_up();
            const struct free_water_aside aside =
                free_water_aside(&profile, &baseline, (struct free_water){10, 180}, TARGET, NEVER);
            CHECK_INT(aside.side_end, side ? 120 - HALF : 180);
            check_water(aside.edge, 10, edge ? 60 - HALF : 120 - HALF); /* a quarter is less than half, too */
        }
}

/* What a beam's edge grazes is weaker than the target by 16 dB, and as long as a reference window. */
TEST(a_surface_that_the_edge_grazes_ends_it)
{
    for (int loud = 0; loud < 2; loud++) {
        start();
        axis.window = 20;
        set_cells(0, N, 2);
        set_cells(100, 120, loud ? 3 : 2); /* 2.5 */
        add_up();
        const struct free_water_aside aside =
            free_water_aside(&profile, &baseline, (struct free_water){10, 180}, TARGET, NEVER);
        check_water(aside.edge, 10, 180);
        CHECK(loud ? aside.surface.end > 80 && aside.surface.end <= 100 : aside.surface.end == 180);
    }
    const struct free_water_aside none =
        free_water_aside(&profile, &baseline, (struct free_water){10, 29}, TARGET, NEVER);
    check_water(none.edge, 10, 29);
    CHECK_INT(none.surface.end, none.surface.begin); /* shorter than a window */
}

int main(void)
{
    RUN(the_reference_target_is_as_strong_as_stated);
    RUN(a_receiver_that_says_nothing_is_dumb);
    RUN(water_begins_where_the_baseline_hides_the_target_no_more);
    RUN(water_begins_behind_the_loudest_cell_near_the_head);
    RUN(a_ring_down_of_four_times_the_usual_one_rings_on);
    RUN(water_ends_where_something_is_as_loud_as_the_target_or_stands_out);
    RUN(water_begins_behind_what_the_baseline_explains);
    RUN(blocks_that_are_passed_hide_nothing);
    RUN(a_surface_is_what_is_loud_on_average);
    RUN(the_end_of_the_ring_down_is_no_surface_unless_it_is_longer_than_a_window);
    RUN(off_the_axis_water_ends_at_what_is_weaker_by_the_pattern);
    RUN(a_surface_that_the_edge_grazes_ends_it);
    return test_end();
}
