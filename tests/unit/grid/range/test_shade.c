/* SPDX-License-Identifier: MIT */
/*
 * test_shade - where a part of the vehicle has rung with a head, turn after turn, what a beam that does not show it
 * says of the water: turns of a head made by hand.
 */
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/range/shade.h"

#define STEP_DEG 1.8
#define STEPS    200

static struct shade shade;
static struct beam_echoes beam;

/* One beam; does it free water? */
static bool frees(double az_deg, bool rings)
{
    struct echoes e = {.n_beams = 1, .max_beams = 1, .turns = true, .beam = &beam};
    beam = (struct beam_echoes){.az_rad = (float)geo_rad(az_deg),
                                .blind_m = 0.5f,
                                .free_to_m = rings ? 0 : 10,
                                .state = BEAM_SILENT,
                                .hides = rings ? BEAM_HIDES_RING : BEAM_HIDES_NOTHING};
    shade_run(&shade, &e);
    CHECK(beam.free_to_m > beam.blind_m || beam.hides == BEAM_HIDES_RING);
    return beam.free_to_m > beam.blind_m;
}

/* A turn in which the bearings from half_deg before astern to half_deg behind ring, but for some of them. How many of
 * those free water. */
static int turn(double half_deg, double missed_deg, double to_deg)
{
    int n = 0;
    for (int i = 0; i < STEPS; i++) {
        const double az_deg = STEP_DEG * i;
        const bool missed = az_deg > missed_deg - 0.1 && az_deg < to_deg + 0.1,
                   part = fabs(az_deg - 180) < half_deg, free = frees(az_deg, part && !missed);
        CHECK(part || free);
        n += part && missed && free;
    }
    return n;
}

static void begin(void)
{
    shade = (struct shade){.rings = false};
}

/* From the second turn on. A part that goes goes from all its bearings, or for long. */
TEST(two_beams_that_miss_a_wide_part_free_nothing)
{
    for (double missed_deg = 160.2; missed_deg < 199; missed_deg += STEP_DEG) {
        begin();
        CHECK_INT(turn(32, 0, -1), 0);
        CHECK_INT(turn(32, missed_deg, missed_deg + STEP_DEG), 0);
        CHECK_INT(turn(32, missed_deg, missed_deg + STEP_DEG), 0);
        CHECK_INT(turn(32, missed_deg, missed_deg + STEP_DEG), 2);
    }
}

TEST(a_wide_part_that_is_gone_hides_nothing)
{
    begin();
    turn(32, 0, -1);
    CHECK(turn(32, 0, 359) >= 30); /* of 35: some lie where the turn before rang last */
    CHECK_INT(turn(32, 0, 359), 35);
}

/* Though an echo is at its edge now, beams beyond that see that it has left. */
TEST(what_no_beam_beside_shows_any_more_hides_nothing)
{
    struct echoes e = {.n_beams = 1, .max_beams = 1, .turns = true, .beam = &beam};
    begin();
    turn(32, 0, -1);
    for (double az_deg = 118.8; az_deg < 165; az_deg += STEP_DEG) {
        beam = (struct beam_echoes){.az_rad = (float)geo_rad(az_deg),
                                    .blind_m = 0.5f,
                                    .state = BEAM_ECHO,
                                    .n = 1,
                                    .echo = {{.range_m = 0.5f}}};
        shade_run(&shade, &e);
    }
    for (double az_deg = 165.6; az_deg < 200; az_deg += STEP_DEG)
        CHECK(frees(az_deg, false));
}

/* Whose beams at the edge lie in open water as often as not. */
TEST(a_part_may_shake_at_its_edge)
{
    begin();
    turn(32, 0, -1);
    CHECK_INT(turn(32, 149.4, 154.8), 4);
}

TEST(a_narrow_part_takes_six_turns)
{
    for (int turns = 1; turns < 9; turns++) {
        begin();
        for (int i = 0; i < turns; i++)
            turn(2, 0, -1);
        CHECK_INT(turn(2, 178.2, 181.8), turns < 6 ? 3 : 0);
        CHECK_INT(turn(2, 178.2, 181.8), turns < 6 ? 3 : 0);
        CHECK_INT(turn(2, 178.2, 181.8), 3);
        CHECK_INT(turn(2, 178.2, 181.8), 3);
    }
}

/* Nor is anything wide where nobody has looked beside it. */
TEST(a_head_that_stands_takes_six_pings)
{
    for (int pings = 1; pings < 9; pings++) {
        begin();
        for (int i = 0; i < pings; i++)
            frees(90, true);
        CHECK(frees(90, false) == (pings < 6));
    }
}

/* A ping in ten rings, anywhere. */
TEST(what_rings_now_and_then_hides_nothing)
{
    uint64_t seed = test_seed();
    begin();
    for (int i = 0; i < 100 * STEPS; i++) {
        const bool rings = test_uniform(&seed) < 0.1;
        CHECK(frees(STEP_DEG * (i % STEPS), rings) || rings);
    }
}

TEST(a_fan_and_a_deaf_beam_change_nothing)
{
    struct beam_echoes two[2] = {{.free_to_m = 10, .hides = BEAM_HIDES_RING}, {.free_to_m = 10}};
    struct echoes e = {.n_beams = 2, .max_beams = 2, .beam = two};
    begin();
    for (int i = 0; i < 10; i++)
        turn(2, 0, -1);
    const struct shade before = shade;
    shade_run(&shade, &e);
    two[0] = (struct beam_echoes){.az_rad = (float)GEO_PI, .hides = BEAM_HIDES_DEAF};
    e.n_beams = 1;
    shade_run(&shade, &e);
    CHECK(memcmp(&before, &shade, sizeof shade) == 0);
    CHECK(!frees(180, false));
}

int main(void)
{
    RUN(two_beams_that_miss_a_wide_part_free_nothing);
    RUN(a_wide_part_that_is_gone_hides_nothing);
    RUN(what_no_beam_beside_shows_any_more_hides_nothing);
    RUN(a_part_may_shake_at_its_edge);
    RUN(a_narrow_part_takes_six_turns);
    RUN(a_head_that_stands_takes_six_pings);
    RUN(what_rings_now_and_then_hides_nothing);
    RUN(a_fan_and_a_deaf_beam_change_nothing);
    return test_end();
}
