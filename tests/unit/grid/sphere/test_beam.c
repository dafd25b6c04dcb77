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
        struct beam_opening opening = beam_opening(0.1, 0.4, 0.05, false);
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
        struct beam_opening opening = beam_opening(az_ap, el_ap, rings.height_rad, false);
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

/* Nor does any direction with a stretch of its middle ray in the beam fail the sieve for those, which has no slack. */
TEST(whatever_a_beam_frees_passes_the_sieve_of_what_it_frees)
{
    static struct rings rings;
    uint64_t seed = test_seed();
    int freed = 0, spared = 0;
    for (int i = 0; i < 3000; i++) {
        CHECK(rings_full(&rings, geo_rad(2 + 6 * test_uniform(&seed))));
        struct beam_echoes heard = {.az_rad = (float)(GEO_TURN * test_uniform(&seed)),
                                    .el_rad = (float)(2 * (test_uniform(&seed) - 0.5))};
        struct echoes ping = {.beam = &heard};
        const double wide = i % 7 ? geo_rad(1 + 60 * pow(test_uniform(&seed), 3)) : 4 * test_uniform(&seed);
        const struct beam_opening own =
            beam_opening(wide, geo_rad(1 + 60 * test_uniform(&seed)), rings.height_rad, false);
        double turn[4], origin[3], widest = 0, near_m = 0.1 + test_uniform(&seed);
        const double lever_m = i % 4 * 0.3 * test_uniform(&seed);
        quat_from_rpy(6 * test_uniform(&seed), 3 * test_uniform(&seed) - 1.5, 6 * test_uniform(&seed), turn);
        geo_direction(6 * test_uniform(&seed), 3 * test_uniform(&seed) - 1.5, origin);
        for (int k = 0; k < 3; k++)
            origin[k] *= lever_m;
        for (uint32_t j = 0; j < rings.n_rings; j++)
            widest = fmax(widest, rings_width(&rings, j) * rings.cos_el[j]);
        struct beam b;
        beam_of(&b, &ping, 0, &own, turn, origin);
        const struct beam_opening opening = beam_opening_freed(&own, widest);
        const struct beam_sieve sieve = beam_sieve(&b, &opening, near_m);
        for (uint32_t d = 0; d < rings.n; d++) {
            const uint32_t ring = rings_ring(&rings, d);
            double az, el, u[3];
            rings_centre(&rings, d, &az, &el);
            geo_direction(az, el, u);
            const struct beam_cell cell = beam_cell_of(rings_width(&rings, ring), rings.height_rad, el);
            const struct beam_ray ray = beam_ray(&b, u);
            const struct beam_water water = beam_water_alike(near_m, near_m * 20);
            struct stretch st;
            const bool frees = beam_stretch(&b, &cell, &ray, &water, &st);
            freed += frees;
            spared += !beam_sieve_passes(&sieve, &ray);
            CHECK(!frees || beam_sieve_passes(&sieve, &ray));
        }
    }
    CHECK(freed > 10000 && spared > 1000000);
}

/* The range of the least of the beam's parts that a place needs. */
static double due_m(const struct beam *b, const struct beam_water *water, const double v[3])
{
    const double x = geo_dot(v, b->axis), y = geo_dot(v, b->side), z = geo_dot(v, b->up);
    const double share =
        fmax(atan2(fabs(y), x) / b->opening->half_az, atan2(fabs(z), hypot(x, y)) / b->opening->half_el);
    return share <= BEAM_AXIS_SHARE ? water->to_m : share <= BEAM_SIDE_SHARE ? water->side_to_m : water->edge_to_m;
}

/* However far from the grid's centre the sensor is, and wherever it looks: at the centre from beyond its range, too. */
TEST(no_place_is_free_farther_from_the_sensor_than_its_part_reaches)
{
    static struct rings rings;
    uint64_t seed = test_seed();
    int places = 0, too_far = 0;
    CHECK(rings_full(&rings, geo_rad(4)));
    for (int i = 0; i < 200; i++) {
        struct beam_echoes heard = {.az_rad = (float)(GEO_TURN * test_uniform(&seed)),
                                    .el_rad = (float)(test_uniform(&seed) - 0.5)};
        struct echoes ping = {.beam = &heard};
        const struct beam_opening own = beam_opening(
            geo_rad(4 + 60 * test_uniform(&seed)), geo_rad(8 + 60 * test_uniform(&seed)), rings.height_rad, false);
        const double to_m = 1 + 9 * test_uniform(&seed), side_m = to_m * test_uniform(&seed);
        const struct beam_water water = {0.3, to_m, side_m, 0.5, side_m * test_uniform(&seed), true};
        const double lever_m = i % 4 * 4 * test_uniform(&seed);
        double turn[4], origin[3];
        quat_from_rpy(6 * test_uniform(&seed), 3 * test_uniform(&seed) - 1.5, 6 * test_uniform(&seed), turn);
        geo_direction(6 * test_uniform(&seed), 3 * test_uniform(&seed) - 1.5, origin);
        for (int k = 0; k < 3; k++)
            origin[k] *= lever_m;
        struct beam b;
        beam_of(&b, &ping, 0, &own, turn, origin);
        for (uint32_t d = 0; d < rings.n; d++) {
            double az, el, u[3], v[3];
            rings_centre(&rings, d, &az, &el);
            geo_direction(az, el, u);
            const struct beam_cell cell =
                beam_cell_of(rings_width(&rings, rings_ring(&rings, d)), rings.height_rad, el);
            const struct beam_ray ray = beam_ray(&b, u);
            struct stretch st;
            if (!beam_stretch(&b, &cell, &ray, &water, &st) || st.to_m <= st.from_m)
                continue;
            for (int k = 0; k < 10; k++) {
                const double at_m = st.from_m + (k + 0.5) / 10 * (st.to_m - st.from_m);
                for (int n = 0; n < 3; n++)
                    v[n] = at_m * u[n] - origin[n];
                places++;
                too_far += geo_length(v) > due_m(&b, &water, v) + 1e-6;
            }
        }
    }
    CHECK(places > 10000);
    CHECK_INT(too_far, 0);
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
        struct beam_opening opening = beam_opening(geo_rad(2), geo_rad(25), rings.height_rad, false);
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
    RUN(whatever_a_beam_frees_passes_the_sieve_of_what_it_frees);
    RUN(a_lever_longer_than_the_blind_range_does_not_open_the_sphere);
    RUN(places_are_seen_as_in_the_sensor_frame_and_none_in_reach_is_turned_away);
    RUN(no_place_is_free_farther_from_the_sensor_than_its_part_reaches);
    return test_end();
}
