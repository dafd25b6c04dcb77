/* SPDX-License-Identifier: MIT */
/* test_wedges - the log of wedges: what is kept, what goes first, and which beams and pings count as one. */
#include <stdlib.h>

#include "grid/geometry.h"
#include "grid/sphere/wedges.h"
#include "tests/lib/test.h"

#define SECOND 1000000000ull

static struct wedges log_of_all;

static void start(void)
{
    static void *memory;
    if (!memory)
        memory = malloc(wedges_bytes());
    wedges_init(&log_of_all, memory);
}

static void put(uint64_t t_ns, double north_m, uint32_t beams, double to_m, bool echo)
{
    const struct wedge_ping ping = {.t_ns = t_ns, .place_m = {north_m, 0, 0}, .attitude = {1, 0, 0, 0}};
    wedges_begin(&log_of_all, &ping);
    for (uint32_t i = 0; i < beams; i++)
        wedges_add(&log_of_all, &(struct wedge){.az_rad = (float)i, .to_m = (float)to_m, .ends_at_echo = echo});
    wedges_end(&log_of_all, 0.1);
}

static const struct wedge_ping *newest(uint32_t back)
{
    return &log_of_all.ping[(log_of_all.end - 1 - back) % WEDGES_PINGS];
}

TEST(the_oldest_pings_go_when_there_is_no_room)
{
    start();
    for (uint32_t k = 0; k < 3 * WEDGES_PINGS; k++)
        put(k * SECOND, k, 1, k, false);
    CHECK_INT(log_of_all.end - log_of_all.first, WEDGES_PINGS);
    for (uint32_t k = log_of_all.first; k != log_of_all.end; k++)
        CHECK_NEAR(wedges_of(&log_of_all, &log_of_all.ping[k % WEDGES_PINGS], 0)->to_m, k, 0, 0.5);
}

TEST(large_fans_push_out_as_many_small_ones_as_it_takes)
{
    uint64_t seed = test_seed();
    start();
    for (uint32_t k = 0; k < 20000; k++) {
        put(k * SECOND, k, 1 + (uint32_t)(60 * test_uniform(&seed)), k, false);
        uint32_t wedges = 0;
        for (uint32_t i = log_of_all.first; i != log_of_all.end; i++)
            wedges += log_of_all.ping[i % WEDGES_PINGS].n;
        CHECK(wedges <= WEDGES_MAX && (k < 1000 || wedges > WEDGES_MAX - 200));
    }
    const struct wedge_ping *oldest = &log_of_all.ping[log_of_all.first % WEDGES_PINGS];
    for (uint32_t i = 0; i < oldest->n; i++)
        CHECK_NEAR(wedges_of(&log_of_all, oldest, i)->to_m, (double)(oldest->t_ns / SECOND), 0, 1);
}

TEST(of_fans_from_one_place_the_newest_is_kept_unless_an_echo_would_go)
{
    start();
    for (uint32_t k = 0; k < 5; k++)
        put(SECOND + k * SECOND / 20, 0.01 * k, 8, 5 + k, false);
    CHECK_INT(log_of_all.end - log_of_all.first, 2);
    CHECK_NEAR(wedges_of(&log_of_all, newest(0), 7)->to_m, 9, 0, 0);
    put(SECOND + 6 * SECOND / 20, 0.06, 8, 3, true);
    put(SECOND + 7 * SECOND / 20, 0.07, 8, 9, false); /* which does not show the echo */
    CHECK_INT(log_of_all.end - log_of_all.first, 3);
    put(SECOND + 8 * SECOND / 20, 2, 8, 9, false); /* from elsewhere */
    put(SECOND + 9 * SECOND / 20, 2.5, 8, 9, false);
    CHECK_INT(log_of_all.end - log_of_all.first, 5);
}

TEST(what_is_forgotten_is_gone)
{
    start();
    for (uint32_t k = 0; k < 100; k++)
        put(k * SECOND, k, 1, k, false);
    wedges_forget(&log_of_all, 40 * SECOND);
    CHECK_INT(log_of_all.end - log_of_all.first, 60);
    wedges_clear(&log_of_all);
    CHECK_INT(log_of_all.end - log_of_all.first, 0);
}

TEST(neighbours_of_a_fan_are_free_where_all_of_them_are)
{
    const float half = (float)geo_rad(0.5);
    struct wedge a = {.az_rad = 0, .half_az_rad = half, .from_m = 0.3f, .to_m = 8};
    const struct wedge b = {.az_rad = (float)geo_rad(0.8),
                            .half_az_rad = half,
                            .from_m = 0.4f,
                            .to_m = 5,
                            .ends_at_echo = true},
                       far = {.az_rad = (float)geo_rad(5), .half_az_rad = half, .to_m = 5},
                       blind = {.az_rad = (float)geo_rad(1), .half_az_rad = half, .kind = WEDGE_UNKNOWN};
    CHECK(!wedges_join(&a, &far, geo_rad(20)));
    CHECK(!wedges_join(&a, &blind, geo_rad(20)));
    CHECK(!wedges_join(&a, &b, geo_rad(1.5)));
    CHECK(wedges_join(&a, &b, geo_rad(2)));
    CHECK_NEAR(a.az_rad, geo_rad(0.4), 1e-5, 0);
    CHECK_NEAR(a.half_az_rad, geo_rad(0.9), 1e-5, 0);
    CHECK_NEAR(a.from_m, 0.4, 1e-6, 0);
    CHECK_NEAR(a.to_m, 5, 1e-6, 0);
    CHECK(a.ends_at_echo);
}

/* Rows that touch are one, about the middle of both; where they leave a gap there is none. */
TEST(rows_of_neighbours_that_touch_are_joined)
{
    const struct beam_row row = {
        .half_az_rad = 0.01f, .left_rad = 0.005f, .right_rad = 0.005f, .seam_rad = 0.005f};
    const struct wedge alone = {.half_az_rad = 0.01f, .row = row, .side_to_m = 8, .edge_to_m = 7};
    const struct wedge b = {
        .az_rad = 0.01f, .half_az_rad = 0.01f, .row = row, .side_to_m = 6, .edge_from_m = 0.5f, .edge_to_m = 3};
    struct wedge a = alone, apart = alone;
    CHECK(wedges_join(&a, &b, 0.04));
    CHECK(a.row.several);
    CHECK_NEAR(a.row.left_rad, 0.01, 1e-6, 0);
    CHECK_NEAR(a.row.right_rad, 0.01, 1e-6, 0);
    CHECK(a.side_to_m == 6 && a.edge_from_m == 0.5f && a.edge_to_m == 3);
    apart.az_rad = -0.005f;
    CHECK(wedges_join(&apart, &b, 0.04));
    CHECK(apart.row.left_rad == 0 && apart.row.right_rad == 0);
}

int main(void)
{
    RUN(the_oldest_pings_go_when_there_is_no_room);
    RUN(large_fans_push_out_as_many_small_ones_as_it_takes);
    RUN(of_fans_from_one_place_the_newest_is_kept_unless_an_echo_would_go);
    RUN(what_is_forgotten_is_gone);
    RUN(neighbours_of_a_fan_are_free_where_all_of_them_are);
    RUN(rows_of_neighbours_that_touch_are_joined);
    return test_end();
}
