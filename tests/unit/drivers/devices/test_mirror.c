/* SPDX-License-Identifier: MIT */
/*
 * Port and starboard of a sensor swapped.
 */
#include "drivers/devices/mirror.h"
#include "tests/lib/test.h"

TEST(beams_change_sides)
{
    struct ping_beam beam[3] = {{.az_rad = 0.5f, .el_rad = 0.1f, .range_m = 3.0f},
                                {.az_rad = 0.5f, .el_rad = 0.1f, .range_m = 4.0f},
                                {.az_rad = -0.25f}};
    struct ping ping = {.n_beams = 3, .beam = beam};
    mirror_ping(&ping);
    CHECK_NEAR(beam[0].az_rad, -0.5, 0, 0);
    CHECK(beam[1].az_rad == beam[0].az_rad); /* still echoes of one beam */
    CHECK_NEAR(beam[2].az_rad, 0.25, 0, 0);
    CHECK_NEAR(beam[0].el_rad, 0.1, 1e-6, 0);
    CHECK_NEAR(beam[1].range_m, 4, 0, 0);
    CHECK_INT(ping.head_units, 0);
}

/* A template's rows are head units: row and azimuth go on together, whichever unit is ahead. */
TEST(a_row_is_still_one_azimuth)
{
    static const struct {
        uint32_t turn, ahead;
    } head[] = {{400, 200}, {6400, 3200}, {1200, 600}, {36000, 0}};

    for (size_t i = 0; i < sizeof head / sizeof head[0]; i++)
        for (uint32_t units = 0; units < head[i].turn; units++) {
            const uint32_t clockwise = (units + head[i].turn - head[i].ahead) % head[i].turn;
            struct ping_beam beam = {.az_rad = (float)(clockwise * GEO_TURN / head[i].turn)};
            struct ping ping = {.n_beams = 1, .beam = &beam, .head_units = units, .head_turn = head[i].turn};
            mirror_ping(&ping);
            const uint32_t now = (ping.head_units + head[i].turn - head[i].ahead) % head[i].turn;
            CHECK(ping.head_units < head[i].turn);
            CHECK_NEAR(geo_wrap_pi((double)beam.az_rad - now * GEO_TURN / head[i].turn), 0, 0, 2e-6);
        }
}

TEST(an_arc_stays_clockwise)
{
    double from_rad = geo_rad(300), to_rad = geo_rad(20);
    mirror_arc(&from_rad, &to_rad); /* 60 degrees to port .. 20 to starboard: now 20 to port .. 60 to starboard */
    CHECK_NEAR(geo_deg(geo_wrap(from_rad)), 340, 1e-12, 0);
    CHECK_NEAR(geo_deg(geo_wrap(to_rad)), 60, 1e-12, 0);
    mirror_arc(&from_rad, &to_rad);
    CHECK_NEAR(geo_deg(geo_wrap(from_rad)), 300, 1e-12, 0);
    CHECK_NEAR(geo_deg(geo_wrap(to_rad)), 20, 1e-12, 0);
}

int main(void)
{
    RUN(beams_change_sides);
    RUN(a_row_is_still_one_azimuth);
    RUN(an_arc_stays_clockwise);
    return test_end();
}
