/* SPDX-License-Identifier: MIT */
/* test_witness - what the last beams said: kept in order, forgotten oldest first, found by where they looked. */
#include "tests/lib/test.h"

#include "grid/answer/witness.h"

static struct witness memory[8];
static struct witnesses log_of;
static struct beam_echoes beam[3];
static struct echoes ping;
static struct mount mount;

static void start(void)
{
    witness_init(&log_of, memory, 8);
    mount = mount_identity;
    for (int i = 0; i < 3; i++)
        beam[i] = (struct beam_echoes){.az_rad = (float)geo_rad(10 * i), .blind_m = 0.5f, .free_to_m = 9};
    ping = (struct echoes){.n_beams = 1,
                           .sensor = 3,
                           .az_aperture_rad = (float)geo_rad(2),
                           .el_aperture_rad = (float)geo_rad(20),
                           .bin0_m = 0.5f,
                           .bin_m = 0.02f,
                           .pose = pose_identity,
                           .beam = beam};
}

static void say(uint32_t seq)
{
    ping.seq = seq;
    ping.t_ns = seq * 1000;
    witness_take(&log_of, &ping, &mount);
}

static bool sees(double az_deg, double el_deg, double half_deg)
{
    double v[3];
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), v);
    return witness_sees(witness_look(&log_of, 0), v, geo_rad(half_deg));
}

TEST(the_newest_first_and_no_more_than_there_is_room_for)
{
    start();
    CHECK(!witness_look(&log_of, 0));
    for (uint32_t seq = 1; seq <= 20; seq++) {
        say(seq);
        for (uint32_t k = 0; k < 10; k++) {
            const struct witness *w = witness_look(&log_of, k);
            CHECK((w != NULL) == (k < 8 && k < seq));
            CHECK(!w || (w->seq == seq - k && w->t_ns == 1000ull * (seq - k)));
        }
    }
}

TEST(every_beam_is_one)
{
    start();
    ping.n_beams = 3;
    say(1);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR((double)witness_look(&log_of, (uint64_t)k)->az_rad, geo_rad(20 - 10 * k), 1e-6, 0);
    CHECK(!witness_look(&log_of, 3));
}

TEST(the_bin_is_where_the_first_echo_lies)
{
    start();
    say(1);
    CHECK_INT(witness_look(&log_of, 0)->bin, -1);
    beam[0].n = 2;
    beam[0].echo[0] = (struct echo){.range_m = 1.51f, .near_m = 1.4f, .confidence = 0.9f};
    beam[0].echo[1] = (struct echo){.range_m = 5};
    say(2);
    CHECK_INT(witness_look(&log_of, 0)->bin, 50);
    CHECK_NEAR((double)witness_look(&log_of, 0)->range_m, 1.51, 1e-6, 0);
    ping.bin0_m = ping.bin_m = 0; /* ranges only */
    say(3);
    CHECK_INT(witness_look(&log_of, 0)->bin, -1);
}

TEST(an_opening_is_wide_one_way_and_narrow_the_other)
{
    start();
    say(1);
    CHECK(sees(0, 0, 0) && sees(0.9, 0, 0) && sees(0, 9.9, 0) && sees(0, -9.9, 0));
    CHECK(!sees(1.2, 0, 0) && !sees(0, 11, 0) && !sees(180, 0, 0) && !sees(90, 0, 0));
    CHECK(sees(4, 0, 3.1) && !sees(4, 0, 2.9) && sees(0, 14, 4.1));
}

TEST(sensor_and_vehicle_may_be_turned)
{
    start();
    quat_from_rpy(0, 0, geo_rad(90), mount.attitude);
    say(1);
    CHECK(sees(90, 0, 0) && !sees(0, 0, 0));
    CHECK(!witness_look(&log_of, 0)->ned);
    quat_from_rpy(0, 0, geo_rad(45), ping.pose.attitude);
    ping.pose.has = POSE_ATTITUDE;
    say(2);
    CHECK(sees(135, 0, 0) && !sees(90, 0, 0));
    CHECK(witness_look(&log_of, 0)->ned);
    quat_from_rpy(geo_rad(90), 0, 0,
                  ping.pose.attitude); /* on its side: the sonar looks straight down, wide along east */
    say(3);
    CHECK(sees(0, -90, 0) && sees(90, -81, 0) && !sees(0, -87, 0));
}

int main(void)
{
    RUN(the_newest_first_and_no_more_than_there_is_room_for);
    RUN(every_beam_is_one);
    RUN(the_bin_is_where_the_first_echo_lies);
    RUN(an_opening_is_wide_one_way_and_narrow_the_other);
    RUN(sensor_and_vehicle_may_be_turned);
    return test_end();
}
