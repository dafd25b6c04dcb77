/* SPDX-License-Identifier: MIT */
/* test_polar - which row a ping belongs to and which rows are its neighbours, on heads that misbehave. */
#include "tests/lib/test.h"

#include "grid/range/polar.h"

static struct polar polar;
static uint64_t now_ns;

static struct ping ping_at(uint32_t units, uint32_t turn)
{
    now_ns += 50000000;
    return (struct ping){.t_ns = now_ns,
                         .head_units = units,
                         .head_turn = turn,
                         .n_beams = 1,
                         .n_bins = 100,
                         .dr_m = 0.1f,
                         .pose = pose_identity};
}

static uint32_t place(uint32_t units, uint32_t turn)
{
    const struct ping ping = ping_at(units, turn);
    return polar_place(&polar, &ping);
}

/* Head units of a neighbour's row, or -1. */
static long neighbour(uint32_t row, int offset)
{
    const struct polar_row *r = polar_neighbour(&polar, row, offset);
    return r ? (long)polar_index(&polar, r) : -1;
}

TEST(full_circles_close)
{
    polar_init(&polar);
    for (uint32_t u = 0; u < 400; u += 2)
        place(u, 400);
    CHECK_INT(polar.rows, 200);
    CHECK_INT(place(0, 400), 0);
    CHECK_INT(neighbour(0, -1), 199);
    CHECK_INT(neighbour(0, -2), 198);
    CHECK_INT(neighbour(199, 1), 0);
    CHECK_INT(polar.restarts, 0);
}

TEST(a_sector_has_ends)
{
    polar_init(&polar);
    for (uint32_t u = 6272; u < 6400 + 64; u += 32)
        place(u % 6400, 6400);
    CHECK_INT(polar.rows, 200);
    CHECK_INT(neighbour(197, -1), -1);
    CHECK_INT(neighbour(199, 1), 0);
    CHECK_INT(neighbour(1, 1), -1);
}

/* I8; the step of 28 instead of 32 is what a real head does where it reverses */
TEST(reversal_with_an_odd_step_goes_on)
{
    polar_init(&polar);
    for (uint32_t u = 320; u <= 1280; u += 32)
        place(u, 6400);
    uint32_t row = place(1280 - 28, 6400);
    CHECK_INT(row, 39);
    for (uint32_t u = 1280 - 28 - 32; u > 320; u -= 32) {
        row = place(u, 6400);
        CHECK_INT(neighbour(row, 1), row + 1);
    }
    CHECK_INT(polar.restarts, 0);
}

TEST(a_repeated_bearing_goes_on)
{
    polar_init(&polar);
    place(10, 400);
    place(11, 400);
    place(12, 400);
    CHECK_INT(place(12, 400), 12);
    CHECK_INT(place(11, 400), 11);
    CHECK_INT(neighbour(11, 1), 12);
    CHECK_INT(polar.restarts, 0);
}

/* I8 */
TEST(lost_beams_leave_rows_out)
{
    polar_init(&polar);
    place(10, 400);
    place(11, 400);
    place(14, 400);
    CHECK_INT(place(15, 400), 15);
    CHECK_INT(neighbour(15, -1), 14);
    CHECK_INT(neighbour(14, -1), -1);
    CHECK_INT(polar.restarts, 0);
}

/* I8 */
TEST(another_step_begins_a_new_image)
{
    static const struct {
        const char *name;
        uint32_t from, to;
        int pings; /* until it is believed */
    } row[] = {{"finer", 4, 2, 2}, {"other", 4, 3, 2}, {"several", 2, 6, 8}};

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint32_t u = 0;
        polar_init(&polar);
        for (int k = 0; k < 20; k++)
            place(u += row[i].from, 400);
        for (int k = 1; k <= row[i].pings; k++) {
            CHECK_INT(polar.restarts, 0);
            place(u += row[i].to, 400);
        }
        CHECK_INT(polar.restarts, 1);
        CHECK_INT(polar.step, row[i].to);
        CHECK_INT(polar.pings, 1);
    }
}

/* I8 */
TEST(another_range_or_bin_or_turn_begins_a_new_image)
{
    for (int what = 0; what < 5; what++) {
        polar_init(&polar);
        for (uint32_t u = 0; u < 10; u++)
            place(u, 400);
        struct ping ping = ping_at(10, 400);
        CHECK(polar_fits(&polar, &ping));
        if (what == 0)
            ping.n_bins = 99;
        if (what == 1)
            ping.dr_m = 0.2f;
        if (what == 2)
            ping.r0_m = 0.1f;
        if (what == 3)
            ping.head_turn = 6400;
        if (what == 4)
            ping.t_ns += POLAR_MAX_AGE_NS;
        CHECK(!polar_fits(&polar, &ping));
        polar_place(&polar, &ping);
        CHECK_INT(polar.restarts, 1);
        CHECK_INT(polar.pings, 1);
    }
}

/* Row 99 is the 99th ping of an image of 400 rows: it counts until 600 more have come. */
TEST(rows_older_than_a_turn_and_a_half_are_no_neighbours)
{
    polar_init(&polar);
    for (uint32_t u = 0; u <= 100; u++)
        place(u, 400); /* the first of them only tells the step from the second */
    CHECK_INT(polar.row[99].ping, 99);
    for (int i = 100; i < 699; i++)
        place(50 + (uint32_t)i % 2, 400);
    CHECK_INT(polar.pings, 699);
    CHECK_INT(neighbour(98, 1), 99);
    place(50, 400);
    CHECK_INT(neighbour(98, 1), -1);
    CHECK_INT(neighbour(49, 1), 50);
}

TEST(a_head_that_does_not_turn_has_one_row)
{
    polar_init(&polar);
    for (int i = 0; i < 5; i++)
        CHECK_INT(place(0, 0), 0);
    CHECK_INT(polar.rows, 1);
    CHECK_INT(neighbour(0, 1), -1);
    CHECK_INT(polar.restarts, 0);
}

TEST(finer_steps_than_rows_share_rows)
{
    polar_init(&polar);
    for (uint32_t u = 0; u < 6400; u++)
        CHECK_INT(place(u, 6400), u == 0 ? 0 : u * POLAR_MAX_ROWS / 6400);
    CHECK_INT(polar.rows, POLAR_MAX_ROWS);
}

TEST(random_angles_stay_inside)
{
    uint64_t random = test_seed();
    polar_init(&polar);
    for (int i = 0; i < 200000; i++) {
        static const uint32_t turns[] = {0, 1, 2, 3, 400, 6400, 65536, UINT32_MAX};
        const uint32_t turn = i % 100 ? polar.turn : turns[test_random(&random) % 8];
        const uint32_t row = place((uint32_t)test_random(&random), turn);
        CHECK(row < polar.rows && polar.rows <= POLAR_MAX_ROWS);
        for (int k = -2; k <= 2; k++)
            neighbour(row, k);
    }
}

int main(void)
{
    RUN(full_circles_close);
    RUN(a_sector_has_ends);
    RUN(reversal_with_an_odd_step_goes_on);
    RUN(a_repeated_bearing_goes_on);
    RUN(lost_beams_leave_rows_out);
    RUN(another_step_begins_a_new_image);
    RUN(another_range_or_bin_or_turn_begins_a_new_image);
    RUN(rows_older_than_a_turn_and_a_half_are_no_neighbours);
    RUN(a_head_that_does_not_turn_has_one_row);
    RUN(finer_steps_than_rows_share_rows);
    RUN(random_angles_stay_inside);
    return test_end();
}
