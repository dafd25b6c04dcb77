/* SPDX-License-Identifier: MIT */
/* test_rings - the division of the sphere into directions: table, poles, seam, and the visitor against all cells. */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/picture/rings.h"

static struct rings rings;

TEST(cells_per_ring_equal_table)
{
    struct table t = table_open("tests/oracles/angular_rings.csv");
    int rows = 0;
    while (table_next(&t)) {
        uint32_t n =
            rings_cells((uint32_t)table_int(&t, 3), (uint32_t)table_int(&t, 1), geo_rad(table_real(&t, 2)));
        CHECK_INT(n, table_int(&t, 6));
        rows++;
    }
    CHECK(rows > 300);
}

TEST(every_direction_has_exactly_one_cell_that_holds_it)
{
    uint64_t seed = test_seed();
    CHECK(rings_full(&rings, geo_rad(2)));
    for (int i = 0; i < 100000; i++) {
        double az = (test_uniform(&seed) * 3 - 1) * GEO_TURN, el = asin(2 * test_uniform(&seed) - 1), caz, cel;
        uint32_t d = rings_index(&rings, az, el);
        CHECK(d < rings.n);
        rings_centre(&rings, d, &caz, &cel);
        double width = rings_width(&rings, rings_ring(&rings, d));
        CHECK(fabs(geo_wrap_pi(az - caz)) <= width / 2 + 1e-9);
        CHECK(fabs(el - cel) <= rings.height_rad / 2 + 1e-12);
    }
}

TEST(centres_map_to_their_own_cell)
{
    for (double step = 0.5; step < 90; step *= 1.7) {
        CHECK(rings_full(&rings, geo_rad(step)));
        for (uint32_t d = 0; d < rings.n; d++) {
            double az, el;
            rings_centre(&rings, d, &az, &el);
            CHECK_INT(rings_index(&rings, az, el), d);
        }
    }
}

TEST(poles_and_seam_are_no_special_case)
{
    CHECK(rings_full(&rings, geo_rad(2)));
    static const double az[] = {0, -0.0, GEO_TURN, -1e-17, 1e9 * GEO_TURN + 0.1};
    for (size_t i = 0; i < 5; i++) {
        CHECK(rings_index(&rings, az[i], GEO_PI / 2) < rings.start[1]);
        CHECK(rings_index(&rings, az[i], -GEO_PI / 2) >= rings.start[rings.n_rings - 1]);
        CHECK(rings_index(&rings, az[i], -GEO_PI / 2) < rings.n);
    }
    CHECK_INT(rings_index(&rings, GEO_TURN, 0.3), rings_index(&rings, 0, 0.3));
    CHECK_INT(rings_index(&rings, -1e-17, 0.3), rings_index(&rings, 0, 0.3));
}

TEST(a_level_ring_holds_its_band_only)
{
    CHECK(rings_level(&rings, geo_rad(2), geo_rad(10)));
    CHECK_INT(rings.n, 180);
    CHECK(rings_index(&rings, 1, geo_rad(9.9)) != RINGS_NONE);
    CHECK(rings_index(&rings, 1, geo_rad(-9.9)) != RINGS_NONE);
    CHECK_INT(rings_index(&rings, 1, geo_rad(10.1)), RINGS_NONE);
    CHECK_INT(rings_index(&rings, 1, geo_rad(-10.1)), RINGS_NONE);
}

static bool found_alike(const double v[3])
{
    double az, el;
    geo_angles(v, &az, &el);
    return rings_holding(&rings, v) == rings_index(&rings, az, el);
}

/* Of what surely stays in a cell all is in it; of what is in one, all but what lies on its edge. */
static bool keeps_alike(const double v[3], uint32_t ring)
{
    double az, el, u[3];
    const uint32_t d = rings_holding(&rings, v), cells = rings.start[ring + 1] - rings.start[ring];
    for (uint32_t k = 0; k < 3; k++) {
        const uint32_t near = rings.start[ring] + (d - rings.start[ring] + cells + k - 1) % cells;
        rings_centre(&rings, near, &az, &el);
        geo_direction(az, el, u);
        if (rings_keeps(&rings, ring, u, v, geo_length(v)) && d != near)
            return false;
    }
    return true;
}

TEST(what_surely_stays_in_a_cell_is_in_it_and_that_is_nearly_all)
{
    uint64_t seed = test_seed();
    for (int i = 0; i < 100; i++) {
        const double step = geo_rad(0.25 + 20 * test_uniform(&seed) * test_uniform(&seed));
        CHECK(i % 4 ? rings_full(&rings, step) : rings_level(&rings, step, test_uniform(&seed) * GEO_PI / 2));
        uint32_t kept = 0, in = 0;
        for (int k = 0; k < 1000; k++) {
            const uint32_t d = (uint32_t)(test_uniform(&seed) * rings.n), ring = rings_ring(&rings, d);
            double az, el, u[3], v[3];
            rings_centre(&rings, d, &az, &el);
            geo_direction(az, el, u);
            geo_direction(az + (test_uniform(&seed) - 0.5) * 1.5 * rings_width(&rings, ring),
                          el + (test_uniform(&seed) - 0.5) * 1.5 * rings.height_rad, v);
            for (int a = 0; a < 3; a++)
                v[a] *= 7;
            const bool keeps = rings_keeps(&rings, ring, u, v, geo_length(v)),
                       wide = rings_width(&rings, ring) >= GEO_PI / 2;
            CHECK(!keeps || rings_holding(&rings, v) == d);
            kept += keeps;
            in += rings_holding(&rings, v) == d && !wide;
        }
        CHECK_INT(kept, in);
    }
}

TEST(a_vector_is_in_the_direction_of_its_angles_at_every_edge_too)
{
    uint64_t seed = test_seed();
    static const double off[] = {0, 1e-16, -1e-16, 3e-7, -3e-7, 9e-7, -9e-7, 1.1e-6, -1.1e-6};
    for (int i = 0; i < 200; i++) {
        const double step = geo_rad(0.25 + 60 * test_uniform(&seed) * test_uniform(&seed));
        CHECK(i % 4 ? rings_full(&rings, step) : rings_level(&rings, step, test_uniform(&seed) * GEO_PI / 2));
        for (int k = 0; k < 2000; k++) {
            const uint32_t ring = (uint32_t)(test_uniform(&seed) * rings.n_rings);
            const double edge = (uint32_t)(k % 50) * rings_width(&rings, ring);
            const double az = k % 2 ? edge : test_uniform(&seed) * GEO_TURN,
                         far_m = 0.01 + 100 * test_uniform(&seed);
            const double el = rings.top_rad - (ring + (k % 3 ? test_uniform(&seed) : 0)) * rings.height_rad;
            double v[3];
            geo_direction(az + off[k % 9], el + off[k / 9 % 9], v);
            for (int a = 0; a < 3; a++)
                v[a] *= far_m;
            CHECK(found_alike(v));
            CHECK(keeps_alike(v, ring));
        }
        static const double axes[][3] = {{1, 0, 0}, {-1, 0, 0}, {-1, -0.0, 0}, {0, 1, 0},  {0, -1, 0},
                                         {0, 0, 1}, {0, 0, -1}, {1, 1, 0},     {-1, 1, 1}, {1e-200, 0, -1}};
        for (size_t k = 0; k < sizeof axes / sizeof axes[0]; k++)
            CHECK(found_alike(axes[k]));
    }
}

TEST(the_visitor_meets_every_centre_in_the_cap_once)
{
    uint64_t seed = test_seed();
    static uint8_t seen[200000];
    for (int i = 0; i < 300; i++) {
        CHECK(rings_full(&rings, geo_rad(1 + 9 * test_uniform(&seed))));
        double az = test_uniform(&seed) * GEO_TURN, el = (test_uniform(&seed) - 0.5) * GEO_PI, a[3];
        double radius = test_uniform(&seed) * test_uniform(&seed) * GEO_PI / 2;
        if (i % 10 == 0)
            el = i % 20 ? GEO_PI / 2 : -GEO_PI / 2;
        memset(seen, 0, rings.n);
        geo_direction(az, el, a);
        struct rings_visit v = rings_visit(&rings, a, radius);
        while (rings_next(&v))
            CHECK_INT(seen[v.direction]++, 0);
        for (uint32_t d = 0; d < rings.n; d++) {
            double caz, cel, c[3];
            rings_centre(&rings, d, &caz, &cel);
            geo_direction(caz, cel, c);
            double dot = a[0] * c[0] + a[1] * c[1] + a[2] * c[2];
            if (acos(fmin(1, fmax(-1, dot))) <= radius)
                CHECK(seen[d]);
        }
    }
}

TEST(senseless_steps_are_refused)
{
    CHECK(!rings_full(&rings, 0));
    CHECK(!rings_full(&rings, NAN));
    CHECK(!rings_full(&rings, 4));
    CHECK(!rings_level(&rings, geo_rad(2), 0));
}

TEST(turned_rings_hold_the_middles_each_in_its_own_direction)
{
    uint64_t seed = test_seed();
    static uint32_t holds[20000];
    for (int grid = 0; grid < 20; grid++) {
        CHECK(grid % 2 ? rings_full(&rings, geo_rad(3 + grid)) : rings_level(&rings, geo_rad(1 + grid), 0.2));
        const double turn =
            grid < 4 ? rings_width(&rings, rings.n_rings / 2) * (grid - 2) : 20 * test_uniform(&seed) - 10;
        memset(holds, 0, sizeof holds);
        for (uint32_t d = 0; d < rings.n; d++) {
            const uint32_t at = rings_turned(&rings, d, turn);
            double az, el, middle_az, middle_el;
            rings_centre(&rings, d, &az, &el);
            rings_centre(&rings, at, &middle_az, &middle_el);
            const double half = rings_width(&rings, rings_ring(&rings, d)) / 2;
            CHECK(middle_el == el && fabs(geo_wrap_pi(az - turn - middle_az)) <= half + 1e-9);
            CHECK(holds[at]++ == 0);
        }
    }
}

int main(void)
{
    RUN(cells_per_ring_equal_table);
    RUN(every_direction_has_exactly_one_cell_that_holds_it);
    RUN(centres_map_to_their_own_cell);
    RUN(poles_and_seam_are_no_special_case);
    RUN(a_level_ring_holds_its_band_only);
    RUN(a_vector_is_in_the_direction_of_its_angles_at_every_edge_too);
    RUN(what_surely_stays_in_a_cell_is_in_it_and_that_is_nearly_all);
    RUN(the_visitor_meets_every_centre_in_the_cap_once);
    RUN(senseless_steps_are_refused);
    RUN(turned_rings_hold_the_middles_each_in_its_own_direction);
    return test_end();
}
