/* SPDX-License-Identifier: MIT */
/*
 * test_beam - how a beam sees places: offsets against the angles of the sensor frame itself, and that the cheap test never
 * turns away a place within the bounds.
 */
#include "../lib/test.h"

#include "../../grid/sphere/beam.h"

TEST(places_are_seen_as_in_the_sensor_frame_and_none_in_reach_is_turned_away)
{
    uint64_t seed = test_seed();
    int spared = 0, seen = 0;
    for (int i = 0; i < 200000; i++) {
        struct beam_echoes heard = {.az_rad = (float)(GEO_TURN * test_uniform(&seed)),
                                    .el_rad = (float)(3 * (test_uniform(&seed) - 0.5))};
        struct echoes ping = {.az_aperture_rad = 0.1f, .el_aperture_rad = 0.4f, .beam = &heard};
        double turn[4], origin[3], place[3], v[3], w[3], az, el, off_az, off_el;
        quat_from_rpy(6 * test_uniform(&seed), 3 * test_uniform(&seed) - 1.5, 6 * test_uniform(&seed), turn);
        geo_direction(heard.az_rad + 0.6 * (test_uniform(&seed) - 0.5),
                      heard.el_rad + 0.6 * (test_uniform(&seed) - 0.5), v);
        double range = pow(10, 4 * test_uniform(&seed) - 1);
        quat_rotate(turn, v, w);
        for (int k = 0; k < 3; k++) {
            origin[k] = test_uniform(&seed) - 0.5;
            place[k] = origin[k] + range * w[k];
        }
        struct beam b;
        beam_of(&b, &ping, 0, turn, origin);
        geo_angles(v, &az, &el);
        double want_az = geo_wrap_pi(az - heard.az_rad), want_el = el - heard.el_rad;
        double most_az = 0.4 * test_uniform(&seed), most_el = 0.4 * test_uniform(&seed);
        CHECK_NEAR(beam_range(&b, place), range, 1e-12, 1e-12);
        if (beam_sees(&b, place, most_az, most_el, &off_az, &off_el)) {
            seen++;
            CHECK_NEAR(sin(off_az), sin(want_az), 0, 1e-9);
            CHECK_NEAR(off_el, want_el, 0, 1e-9);
        } else {
            spared++;
            CHECK(fabs(want_az) > most_az || fabs(want_el) > most_el);
        }
    }
    CHECK(spared > 50000 && seen > 10000);
}

int main(void)
{
    RUN(places_are_seen_as_in_the_sensor_frame_and_none_in_reach_is_turned_away);
    return test_end();
}
