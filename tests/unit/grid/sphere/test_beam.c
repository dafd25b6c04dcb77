/* SPDX-License-Identifier: MIT */
/*
 * test_beam - how a beam sees places: offsets against the angles of the sensor frame itself, and that the cheap test
 * never turns away a place within the bounds; which directions a beam is held against.
 */
#include "tests/lib/test.h"

#include "grid/sphere/beam.h"
#include "grid/picture/rings.h"

TEST(places_are_seen_as_in_the_sensor_frame_and_none_in_reach_is_turned_away)
{
    static struct rings rings;
    uint64_t seed = test_seed();
    CHECK(rings_full(&rings, geo_rad(4)));
    int spared = 0, seen = 0;
    for (int i = 0; i < 200000; i++) {
        struct beam_echoes heard = {.az_rad = (float)(GEO_TURN * test_uniform(&seed)),
                                    .el_rad = (float)(3 * (test_uniform(&seed) - 0.5))};
        struct echoes ping = {.az_aperture_rad = 0.1f, .el_aperture_rad = 0.4f, .beam = &heard};
        double turn[4], origin[3], place[3], v[3], w[3], u[3], az, el;
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
        struct beam_opening opening = beam_opening(0.1, 0.4);
        beam_of(&b, &ping, 0, &opening, turn, origin);
        geo_angles(v, &az, &el);
        double want_az = geo_wrap_pi(az - heard.az_rad), want_el = el - heard.el_rad;
        double most_az = 0.4 * test_uniform(&seed), most_el = 0.4 * test_uniform(&seed);
        struct beam_view view;
        geo_angles(place, &az, &el);
        uint32_t d = rings_index(&rings, az, el), ring = rings_ring(&rings, d);
        rings_centre(&rings, d, &az, &el);
        geo_direction(az, el, u);
        struct beam_cell cell = beam_cell_of(rings_width(&rings, ring), rings.height_rad, el);
        CHECK_NEAR(beam_range(&b, place), range, 1e-12, 1e-12);
        if (beam_sees(&b, &cell, &(struct beam_spot){u, place, beam_range(&b, place)}, most_az, most_el, &view)) {
            seen++;
            CHECK_NEAR(sin(view.off_az), sin(want_az), 0, 1e-9);
            CHECK_NEAR(view.off_el, want_el, 0, 1e-9);
            CHECK(view.wide_rad > 0 && view.high_rad > 0);
        } else {
            spared++;
            CHECK(fabs(want_az) > most_az || fabs(want_el) > most_el);
        }
    }
    CHECK(spared > 50000 && seen > 10000);
}

/* Wherever the sensor sits and however it is turned: no place in the beam lies in a direction that is passed over. */
TEST(whatever_the_beam_holds_passes_its_sieve)
{
    static struct rings rings;
    uint64_t seed = test_seed();
    int small = 0, long_lever = 0, bounded = 0;
    CHECK(rings_full(&rings, geo_rad(4)));
    const double reach = rings_reach(&rings);
    for (int i = 0; i < 2500; i++) {
        struct beam_echoes heard = {.az_rad = (float)(GEO_TURN * test_uniform(&seed)),
                                    .el_rad = (float)(2 * (test_uniform(&seed) - 0.5))};
        struct echoes ping = {.beam = &heard};
        double az_ap = geo_rad(1 + 60 * pow(test_uniform(&seed), 3)),
               el_ap = geo_rad(1 + 60 * test_uniform(&seed));
        struct beam_opening opening = beam_opening(az_ap, el_ap);
        double turn[4], origin[3], middle[3], az, el, near_m = 0.1 + test_uniform(&seed);
        double lever_m = (i % 5) * 0.3 * test_uniform(&seed) * (i % 5 == 4 ? 10 : 1);
        quat_from_rpy(6 * test_uniform(&seed), 3 * test_uniform(&seed) - 1.5, 6 * test_uniform(&seed), turn);
        geo_direction(6 * test_uniform(&seed), 3 * test_uniform(&seed) - 1.5, origin);
        for (int k = 0; k < 3; k++)
            origin[k] *= lever_m;
        struct beam b;
        beam_of(&b, &ping, 0, &opening, turn, origin);
        const struct beam_sieve tight = beam_sieve(&b, &opening, near_m), sieve = beam_sieve_wider(&tight, reach);
        double radius = beam_sieve_cap(&b, &sieve, middle);
        small += radius < 0.5;
        long_lever += lever_m > near_m;
        bounded += lever_m > near_m && radius < GEO_PI / 2;
        for (int k = 0; k < 50; k++) {
            double v[3], w[3], range = near_m * pow(10, 2 * test_uniform(&seed) * test_uniform(&seed)), c[3];
            geo_direction(heard.az_rad + (test_uniform(&seed) - 0.5) * az_ap,
                          heard.el_rad + (test_uniform(&seed) - 0.5) * el_ap, v);
            quat_rotate(turn, v, w);
            for (int j = 0; j < 3; j++)
                w[j] = origin[j] + range * w[j];
            geo_angles(w, &az, &el);
            rings_centre(&rings, rings_index(&rings, az, el), &az, &el);
            geo_direction(az, el, c);
            const double along = c[0] * middle[0] + c[1] * middle[1] + c[2] * middle[2];
            const struct beam_ray ray = beam_ray(&b, c);
            CHECK(beam_sieve_passes(&sieve, &ray));
            CHECK(along >= cos(radius) - 1e-12);
        }
    }
    CHECK(small > 500);
    CHECK(4 * bounded > long_lever);
}

/* A head below the grid's centre by more than its blind range: the directions that each beam is held against. */
TEST(a_lever_longer_than_the_blind_range_does_not_open_the_sphere)
{
    static struct rings rings;
    CHECK(rings_full(&rings, geo_rad(2)));
    const double reach = rings_reach(&rings), origin[3] = {0, 0, 0.5};
    for (int az = 0; az < 360; az += 10) {
        struct beam_echoes heard = {.az_rad = (float)geo_rad(az)};
        struct echoes ping = {.beam = &heard};
        struct beam_opening opening = beam_opening(geo_rad(2), geo_rad(25));
        struct beam b;
        double middle[3];
        beam_of(&b, &ping, 0, &opening, pose_identity.attitude, origin);
        const struct beam_sieve tight = beam_sieve(&b, &opening, 0.3), sieve = beam_sieve_wider(&tight, reach),
                                wider = beam_sieve_wider(&tight, 2 * reach);
        double radius = beam_sieve_cap(&b, &wider, middle);
        struct rings_visit visit = rings_visit(&rings, middle, radius);
        uint32_t visited = 0, passed = 0;
        while (rings_next(&visit)) {
            double c[3], cell_az, cell_el;
            rings_centre(&rings, visit.direction, &cell_az, &cell_el);
            geo_direction(cell_az, cell_el, c);
            const struct beam_ray ray = beam_ray(&b, c);
            visited++;
            passed += beam_sieve_passes(&sieve, &ray);
        }
        CHECK(visited < rings.n / 3);
        CHECK(passed < rings.n / 20);
        if (az == 0)
            printf("# of %u directions %u visited, %u looked at\n", rings.n, visited, passed);
    }
}

int main(void)
{
    RUN(whatever_the_beam_holds_passes_its_sieve);
    RUN(a_lever_longer_than_the_blind_range_does_not_open_the_sphere);
    RUN(places_are_seen_as_in_the_sensor_frame_and_none_in_reach_is_turned_away);
    return test_end();
}
