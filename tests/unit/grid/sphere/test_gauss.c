/* SPDX-License-Identifier: MIT */
/*
 * test_gauss - cells' shares of an echo against the reference tables, whole partitions (G8), and against the
 * distribution on the sphere that knows no poles (G9).
 */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/sphere/gauss.h"
#include "grid/sphere/spread.h"

TEST(shares_of_cells_equal_the_table)
{
    struct table t = table_open("tests/oracles/cell_integrals.csv");
    while (table_next(&t)) {
        double r = gauss_between(table_real(&t, 1), table_real(&t, 2), table_real(&t, 7), table_real(&t, 10));
        double az = gauss_around(table_real(&t, 3), table_real(&t, 4), table_real(&t, 8), table_real(&t, 11));
        double el = gauss_between(table_real(&t, 5), table_real(&t, 6), table_real(&t, 9), table_real(&t, 12));
        CHECK_NEAR(log(r) + log(az) + log(el), table_real(&t, 17), 1e-10, 1e-14);
        if (fabs(table_real(&t, 19)) < 0.9) { /* beyond, the middle says nothing any more */
            double middle =
                gauss_midpoint(table_real(&t, 1), table_real(&t, 2), table_real(&t, 7), table_real(&t, 10)) *
                gauss_midpoint(table_real(&t, 5), table_real(&t, 6), table_real(&t, 9), table_real(&t, 12));
            CHECK(middle >= 0 && isfinite(middle));
        }
    }
}

/* Leading error of the midpoint: width^2 (1 - offset^2) / 24, in standard deviations. */
TEST(the_midpoint_errs_as_its_formula_says)
{
    for (double o = 0; o <= 3; o += 0.5) {
        double w = 0.2, exact = gauss_between(o - w / 2, o + w / 2, 0, 1),
               mid = gauss_midpoint(o - w / 2, o + w / 2, 0, 1);
        CHECK_NEAR(mid / exact - 1, w * w * (1 - o * o) / 24, 0, 2e-4);
    }
}

TEST(g8_a_partition_has_the_whole_mass)
{
    uint64_t seed = test_seed();
    for (int trial = 0; trial < 200; trial++) {
        double sd = pow(10, 4 * test_uniform(&seed) - 3), mean = GEO_TURN * test_uniform(&seed), sum = 0, turn = 0;
        int n = 1 + (int)(300 * test_uniform(&seed));
        for (int i = 0; i < n; i++) {
            sum += gauss_between(20.0 * i / n - 10, 20.0 * (i + 1) / n - 10, mean - 3, sd);
            turn += gauss_around(GEO_TURN * i / n, GEO_TURN * (i + 1) / n, mean, sd);
        }
        double outside = gauss_between(-1e9, -10, mean - 3, sd) + gauss_between(10, 1e9, mean - 3, sd);
        CHECK_NEAR(sum, 1 - outside, 0, 1e-12);
        CHECK_NEAR(turn, 1, 0, 1e-12);
    }
    CHECK_NEAR(gauss_between(10 - 1e-5, 10 + 1e-5, 10, 1e-6), 1, 1e-12, 0);
    double next = nextafter(10, 11);
    CHECK_NEAR(gauss_between(10, next, 10, 0.1), (next - 10) / 0.1 / sqrt(GEO_TURN), 1e-10, 0);
}

/* ---- the distribution on the sphere (von Mises and Fisher), which has no poles ---- */

/* Density about (POL, AZ) for kappa = 1 / sd^2, per solid angle. */
static double fisher(double pol, double az, double POL, double AZ, double sd)
{
    double k = 1 / (sd * sd), a = sin((pol - POL) / 2), b = sin((az - AZ) / 2);
    return exp(k * (-2 * a * a - 2 * sin(pol) * sin(POL) * b * b)) * k / (GEO_TURN * (1 - exp(-2 * k)));
}

static const double node[8] = {-0.9602898564975363, -0.7966664774136267, -0.5255324099163290, -0.1834346424956498,
                               0.1834346424956498,  0.5255324099163290,  0.7966664774136267,  0.9602898564975363};
static const double node_weight[8] = {0.1012285362903763, 0.2223810344533745, 0.3137066458778873,
                                      0.3626837833783620, 0.3626837833783620, 0.3137066458778873,
                                      0.2223810344533745, 0.1012285362903763};

/* Its mass in a box: Gauss and Legendre on panels of half a standard deviation. */
static double fisher_box(double pol0, double pol1, double az0, double az1, double POL, double AZ, double sd)
{
    double steepest = pol0 < GEO_PI / 2 && pol1 > GEO_PI / 2 ? 1 : fmax(sin(pol0), sin(pol1));
    int n = 1 + (int)((pol1 - pol0) / (sd / 2)), m = 1 + (int)((az1 - az0) * steepest / (sd / 2));
    double sum = 0;
    m = m < 40 ? 40 : m;
    double h = (pol1 - pol0) / n, w = (az1 - az0) / m;
    for (int i = 0; i < n * 8; i++) {
        double pol = pol0 + h * (i / 8 + 0.5 + node[i % 8] / 2), line = 0;
        if (fabs(pol - POL) > 9 * sd)
            continue;
        for (int j = 0; j < m * 8; j++)
            line += node_weight[j % 8] * fisher(pol, az0 + w * (j / 8 + 0.5 + node[j % 8] / 2), POL, AZ, sd);
        sum += node_weight[i % 8] * line * sin(pol);
    }
    return sum * h * w / 4;
}

TEST(g9_the_reference_on_the_sphere_equals_the_table)
{
    struct table t = table_open("tests/oracles/cell_integrals_sphere.csv");
    while (table_next(&t))
        CHECK_NEAR(fisher_box(table_real(&t, 1), table_real(&t, 2), table_real(&t, 3), table_real(&t, 4),
                              table_real(&t, 5), table_real(&t, 6), table_real(&t, 7)),
                   table_real(&t, 8), 0, 1e-9);
    for (double pol = 0; pol < 0.2; pol += 0.05) { /* round the pole, 12 cells a ring */
        double sum = 0;
        for (int ring = 0; ring < 20; ring++)
            for (int cell = 0; cell < 12; cell++)
                sum += fisher_box(ring * GEO_PI / 20, (ring + 1) * GEO_PI / 20, cell * GEO_TURN / 12,
                                  (cell + 1) * GEO_TURN / 12, pol, 0.3, 0.05);
        CHECK_NEAR(sum, 1, 0, 1e-9);
    }
}

/* ---- spreading ---- */

TEST(the_axis_gets_all_and_half_power_gets_half)
{
    struct spread s =
        spread_of(0.03, geo_rad(1), geo_rad(12.5), 2, &(struct spread_cell){0.05, 1e-4, 1e-4}, false);
    CHECK_NEAR(spread_across(&s, 0, 0, 1e-4, 1e-4), 1, 1e-12, 0);
    CHECK_NEAR(spread_across(&s, geo_rad(1), 0, 1e-4, 1e-4), 0.5, 1e-4, 0);
    CHECK_NEAR(spread_across(&s, 0, geo_rad(-12.5), 1e-4, 1e-4), 0.5, 1e-4, 0);
}

/* A beam near the grid's pole: its own angles know nothing of that. The integral of the density on the sphere over a
 * cell of a balanced grid, against the weights of the beam's own angles. */
TEST(weights_at_the_pole_are_those_on_the_sphere)
{
    double sd = geo_rad(2), cell = geo_rad(1), half = sd * 1.1774100225154747;
    struct spread s = spread_of(0.03, half, half, 2, &(struct spread_cell){0.05, cell, cell}, false);
    double centre =
        fisher_box(GEO_PI / 2 - cell / 2, GEO_PI / 2 + cell / 2, -cell / 2, cell / 2, GEO_PI / 2, 0, sd);
    for (double gamma = 0; gamma < 2 * sd; gamma += sd / 4) {
        double pol = geo_rad(0.7), want = fisher(pol + gamma, 1, pol, 1, sd) / fisher(pol, 1, pol, 1, sd);
        double smooth = centre / (cell * cell) / fisher(0, 0, 0, 0, sd); /* a cell flattens the top a little */
        double got = spread_across(&s, gamma, 0, cell, cell);
        CHECK_NEAR(got, want / smooth, 0.06, 0);
    }
}

TEST(the_cap_shortens_all_sides_but_never_leaves_the_opening)
{
    for (double half_el = 0.5; half_el < 60; half_el *= 1.5)
        for (double cell = 0.5; cell < 8; cell *= 2) {
            struct spread s = spread_of(0.03, geo_rad(1), geo_rad(half_el), 2,
                                        &(struct spread_cell){0.02, geo_rad(cell), geo_rad(cell)}, false);
            CHECK(s.reach <= 2 && s.reach * s.sd_el >= geo_rad(half_el) * (1 - 1e-12));
            double n = (2 * ceil(s.reach * s.sd_m / 0.02) + 1) *
                       (2 * ceil(s.reach * s.sd_az / geo_rad(cell)) + 1) *
                       (2 * ceil(s.reach * s.sd_el / geo_rad(cell)) + 1);
            CHECK(n <= SPREAD_CELLS_MOST || s.reach < 1.178);
            double at = s.reach * s.sd_el + geo_rad(cell) * 0.49;
            CHECK(spread_across(&s, 0, at, geo_rad(cell), geo_rad(cell)) > 0);
            CHECK(spread_across(&s, 0, -at, geo_rad(cell), geo_rad(cell)) > 0);
        }
    struct spread all_round = spread_of(0.1, GEO_PI, 0.2, 2, &(struct spread_cell){0.1, 0.1, 0.1}, false);
    CHECK(spread_across(&all_round, GEO_PI, 0, 0.1, 0.1) > 0.4); /* both ways round add up */
}

int main(void)
{
    RUN(shares_of_cells_equal_the_table);
    RUN(the_midpoint_errs_as_its_formula_says);
    RUN(g8_a_partition_has_the_whole_mass);
    RUN(g9_the_reference_on_the_sphere_equals_the_table);
    RUN(the_axis_gets_all_and_half_power_gets_half);
    RUN(weights_at_the_pole_are_those_on_the_sphere);
    RUN(the_cap_shortens_all_sides_but_never_leaves_the_opening);
    return test_end();
}
