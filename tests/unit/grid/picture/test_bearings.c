/* SPDX-License-Identifier: MIT */
/* test_bearings - at which level bearings of the vehicle its sonars look, from the beams of their pings. */
#include "grid/geometry.h"
#include "grid/ping.h"
#include "grid/picture/bearings.h"
#include "tests/lib/test.h"

static struct bearings b;
static struct mount mount;

static void start(double roll_deg, double pitch_deg, double yaw_deg)
{
    b = (struct bearings){0};
    quat_from_rpy(geo_rad(roll_deg), geo_rad(pitch_deg), geo_rad(yaw_deg), mount.attitude);
}

/* Beams of 3 by high_deg from one azimuth to the other. */
static void ping(unsigned sensor, int beams, double from_deg, double to_deg, double high_deg, bool new_turn)
{
    struct beam_echoes beam[64];
    struct echoes e = {.sensor = (uint16_t)sensor,
                       .n_beams = (uint16_t)beams,
                       .flags = new_turn ? PING_NEW_TURN : 0,
                       .az_aperture_rad = (float)geo_rad(3),
                       .el_aperture_rad = (float)geo_rad(high_deg),
                       .beam = beam};
    for (int i = 0; i < beams; i++) {
        const double share = beams > 1 ? (double)i / (beams - 1) : 0;
        beam[i] = (struct beam_echoes){.az_rad = (float)geo_wrap(geo_rad(from_deg + share * (to_deg - from_deg)))};
    }
    bearings_enter(&b, &e, &mount);
}

static bool at(double deg)
{
    struct bearings_looks looks;
    bearings_tell(&b, &looks);
    return bearings_has(looks.bearings, geo_rad(deg));
}

TEST(a_fan_looks_within_its_opening_from_its_second_ping_on)
{
    start(0, 0, 0);
    CHECK(!at(0) && !at(180));
    ping(0, 32, -48, 48, 20, true);
    CHECK(at(0) && at(180)); /* it may be a head */
    ping(0, 32, -48, 48, 20, true);
    for (int deg = -40; deg <= 40; deg++)
        CHECK(at(deg));
    for (int deg = 50; deg <= 310; deg++)
        CHECK(!at(deg));
    CHECK_NEAR(geo_deg(b.level_rad), 10, 1e-4, 0);
}

TEST(a_fan_of_more_than_half_a_circle_does_not_look_astern)
{
    start(0, 0, 0);
    for (int i = 0; i < 3; i++)
        ping(0, 64, -110, 110, 20, true);
    CHECK(at(100) && at(-100) && !at(180) && !at(125) && !at(-125));
}

TEST(a_head_may_look_anywhere_until_a_turn_is_over)
{
    start(0, 0, 0);
    for (int deg = -60; deg < 60; deg += 3)
        ping(0, 1, deg, deg, 25, deg == -60);
    CHECK(at(0) && at(180));
    ping(0, 1, 60, 60, 25, true);
    CHECK(at(0) && at(50) && at(-50) && !at(180) && !at(75) && !at(-75));
}

/* Beams of 3 degrees. A vehicle that turns with its head opens gaps: they count once it has been everywhere twice. */
TEST(a_lost_ping_in_the_first_turns_is_no_gap_between_beams)
{
    static const struct {
        int step_deg, lost, turns;
        double gap_deg;
    } row[] = {{2, 0, 1, 0}, {3, 0, 1, 0}, {3, 1, 1, 0}, {6, 0, 1, 3}, {6, 1, 1, 3},
               {3, 1, 2, 0}, {6, 1, 2, 3}, {3, 0, 3, 3}, {6, 1, 3, 6}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings_looks looks;
        start(0, 0, 0);
        for (int turn = 0; turn < row[i].turns; turn++)
            for (int k = -5; k < 5; k++)
                if (k || !row[i].lost)
                    ping(0, 1, row[i].step_deg * k, row[i].step_deg * k, 25, k == -5);
        bearings_tell(&b, &looks);
        CHECK_NEAR(geo_deg(looks.gap_rad), row[i].gap_deg, 1e-3, 0);
        CHECK(looks.first_turns == (row[i].turns < 3));
    }
}

TEST(a_head_passes_what_it_did_not_ping)
{
    start(0, 0, 0);
    for (int turn = 0; turn < 2; turn++)
        for (int deg = 0; deg < 360; deg += deg == 90 ? 60 : 3)
            ping(0, 1, deg, deg, 25, deg == 0);
    ping(0, 1, 0, 0, 25, true);
    for (int deg = 0; deg < 360; deg++)
        CHECK(at(deg));
}

TEST(a_beam_that_stays_looks_where_it_points)
{
    start(0, 0, 30);
    for (int i = 0; i < 3; i++)
        ping(0, 1, 0, 0, 25, false);
    CHECK(!at(30)); /* narrower than what counts as looked at */
    struct bearings_looks looks;
    bearings_tell(&b, &looks);
    CHECK(!looks.first_turns);
    CHECK(b.seen != 0 && !at(210));
}

TEST(what_hears_little_above_and_below_level_shows_no_bearing)
{
    static const struct {
        double roll_deg, pitch_deg, high_deg;
        bool level;
    } row[] = {{0, 0, 25, true},  {0, 0, 9, false},   {0, 5, 25, true},
               {0, 9, 25, false}, {90, 0, 25, false}, {180, 0, 25, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(row[i].roll_deg, row[i].pitch_deg, 0);
        for (int k = 0; k < 3; k++)
            ping(0, 9, -12, 12, row[i].high_deg, true);
        CHECK_INT(at(0), row[i].level);
    }
}

TEST(sensors_add_up_and_the_least_opening_counts)
{
    start(0, 0, 0);
    for (int i = 0; i < 2; i++) {
        ping(0, 32, -48, 48, 20, true);
        ping(1, 32, 60, 150, 12, true);
    }
    CHECK(at(0) && at(100) && !at(200));
    CHECK_NEAR(geo_deg(b.level_rad), 6, 1e-4, 0);
    for (int deg = 0; deg < 30; deg += 3)
        ping(2, 1, deg, deg, 25, deg == 0); /* one in its first turn */
    CHECK(at(200));
}

int main(void)
{
    RUN(a_fan_looks_within_its_opening_from_its_second_ping_on);
    RUN(a_fan_of_more_than_half_a_circle_does_not_look_astern);
    RUN(a_head_may_look_anywhere_until_a_turn_is_over);
    RUN(a_lost_ping_in_the_first_turns_is_no_gap_between_beams);
    RUN(a_head_passes_what_it_did_not_ping);
    RUN(a_beam_that_stays_looks_where_it_points);
    RUN(what_hears_little_above_and_below_level_shows_no_bearing);
    RUN(sensors_add_up_and_the_least_opening_counts);
    return test_end();
}
