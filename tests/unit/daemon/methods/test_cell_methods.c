/* SPDX-License-Identifier: MIT */
/*
 * test_cell_methods - the cells that `grid_lock`, `grid_cells`, `explain` and `clusters` speak of lie where they were
 * heard: a level head before a wall 3 m ahead, 40 degrees wide, which may go.
 */
#include "tests/lib/daemon_rig.h"

#define SECOND     1000000000ull
#define TURN_PINGS 144
#define PING_NS    (SECOND / 25)
#define WALL_M     3.0
#define POST_M     6.0
#define HALF_DEG   20.0

#define CONF                                                                                                      \
    "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n"                                            \
    "[extract]\nminimum_range = 10 m\nno_echo = range\n"

static uint32_t pings;

static double range_m(double az_rad)
{
    const double aside = fabs(geo_wrap_pi(az_rad));
    return aside <= geo_rad(HALF_DEG) ? WALL_M / cos(aside) : 0;
}

/* One turn, and the bow once more. When the wall is gone, a post astern shows that the head hears. */
static void turn(bool wall)
{
    for (uint32_t i = 0; i <= TURN_PINGS; i++, pings++) {
        const double az_rad = i % TURN_PINGS * GEO_TURN / TURN_PINGS;
        rig_send(&(struct rig_ping){.t_ns = 100 * SECOND + pings * PING_NS,
                                    .seq = pings + 1,
                                    .new_turn = i == 0,
                                    .az_rad = az_rad,
                                    .wide_deg = 3,
                                    .high_deg = 25,
                                    .range_m = wall                  ? range_m(az_rad)
                                               : i == TURN_PINGS / 2 ? POST_M
                                                                     : 0});
    }
}

static bool begin(void)
{
    pings = 0;
    if (!rig_start(CONF))
        return false;
    turn(true);
    turn(true);
    return true;
}

/* How many cells that locks or unlocks. */
static int lock(double az_deg, double from_m, double to_m, bool locked)
{
    json_t *a = ask("grid_lock", json_pack("{s:f, s:f, s:f, s:b}", "azimuth_deg", az_deg, "from_m", from_m, "to_m",
                                           to_m, "locked", locked));
    const int cells = (int)number(a, "cells");
    json_decref(a);
    return cells;
}

TEST(cells_are_locked_within_the_cone_and_its_ranges_alone)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    CHECK_INT(lock(0, 0, 2.5, true), 0);
    CHECK_INT(lock(0, 3.5, 10, true), 0);
    CHECK_INT(lock(90, 0, 10, true), 0);
    const int cells = lock(0, 2.5, 3.5, true);
    CHECK(cells > 0);
    CHECK_INT(lock(0, 2.5, 3.5, false), cells);
    rig_end();
}

/* How many cells are gone up to there. */
static int gone(double to_m)
{
    json_t *a = ask("explain",
                    json_pack("{s:f, s:f, s:f}", "azimuth_deg", 0.0, "distance_m", to_m, "half_angle_deg", 5.0)),
           *g = json_object_get(a, "gone"), *c;
    const int all = (int)number(g, "all");
    size_t i;
    json_array_foreach(json_object_get(g, "newest"), i, c)
    {
        CHECK_NEAR(number(c, "range_m"), WALL_M, 0, 0.2);
    }
    json_decref(a);
    return all;
}

TEST(what_is_gone_is_explained_as_far_as_was_asked)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    CHECK_INT(gone(8), 0);
    for (int i = 0; i < 5; i++)
        turn(false);
    CHECK(gone(8) > 0);
    CHECK_INT(gone(2), 0);
    rig_end();
}

/* How far the records say that the cone ahead is free; NAN: they were not asked. */
static double recorded(double half_deg)
{
    json_t *a = ask("explain", json_pack("{s:f, s:f, s:f}", "azimuth_deg", 0.0, "distance_m", 8.0,
                                         "half_angle_deg", half_deg));
    const json_t *water = json_object_get(a, "water");
    const bool any = json_is_object(water);
    const double to_m = any ? number(water, "free_to_m") : NAN;
    CHECK(!any || (number(water, "records") > 0) == (to_m > number(water, "free_from_m")));
    CHECK(!any || json_is_null(json_object_get(water, "oldest_age_s")) == (number(water, "records") == 0));
    json_decref(a);
    return to_m;
}

TEST(records_end_where_the_wall_is)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    const double to_m = recorded(3);
    CHECK(to_m > WALL_M - 0.3 && to_m < WALL_M);
    CHECK(isnan(recorded(16)));
    for (int i = 0; i < 4; i++)
        turn(false);
    CHECK(recorded(3) > WALL_M);
    rig_end();
}

TEST(a_cluster_reaches_from_its_near_edge_to_its_farthest_echo)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    json_t *a = ask("clusters", json_object()), *all = json_object_get(a, "clusters"), *k = json_array_get(all, 0);
    CHECK_INT(json_array_size(all), 1);
    CHECK_NEAR(number(k, "near_m"), WALL_M, 0, 0.1);
    CHECK_NEAR(number(k, "far_m"), WALL_M / cos(geo_rad(HALF_DEG)), 0, 0.1);
    CHECK(number(k, "far_m") > number(k, "near_m") + 0.1);
    CHECK_NEAR(number(k, "width_deg"), 2 * HALF_DEG, 0, 12);
    const double az_deg = number(json_object_get(k, "nearest"), "azimuth_deg");
    CHECK(fabs(geo_deg(geo_wrap_pi(geo_rad(az_deg)))) < 8);
    json_decref(a);
    rig_end();
}

/* The near edge lies before what was heard by the range's uncertainty, wherever its layer begins. */
TEST(cells_tell_the_edges_of_what_reflects)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    json_t *a = ask("grid_cells", json_pack("{s:i}", "count", 1000)), *c;
    size_t i, level = 0;
    json_array_foreach(json_object_get(a, "cells"), i, c)
    {
        const double aside = fabs(geo_wrap_pi(geo_rad(number(c, "azimuth_deg")))), near_m = number(c, "near_m");
        CHECK(number(c, "from_m") < number(c, "to_m") && near_m <= number(c, "to_m"));
        if (fabs(number(c, "elevation_deg")) > 2 || aside > geo_rad(3))
            continue;
        CHECK_NEAR(near_m, WALL_M - sqrt(3) * 0.01, 0, 0.012);
        level++;
    }
    CHECK(level > 0);
    json_decref(a);
    rig_end();
}

int main(void)
{
    RUN(cells_are_locked_within_the_cone_and_its_ranges_alone);
    RUN(what_is_gone_is_explained_as_far_as_was_asked);
    RUN(records_end_where_the_wall_is);
    RUN(cells_tell_the_edges_of_what_reflects);
    RUN(a_cluster_reaches_from_its_near_edge_to_its_farthest_echo);
    return test_end();
}
