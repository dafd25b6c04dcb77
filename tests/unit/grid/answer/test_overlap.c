/* SPDX-License-Identifier: MIT */
/* The sectors that a cell touches, against the plain formula: anywhere, and where rough angles cannot tell. */
#include <math.h>

#include "grid/answer/overlap.h"
#include "grid/geometry.h"
#include "tests/lib/test.h"

static uint64_t seed;

static double uniform(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

static bool one_in(int n)
{
    return test_uniform(&seed) * n < 1;
}

/* In azimuth, where it is widest: at the edge nearer to a pole, which is no nearer than that. */
static double wider(double el, double half_el, double aside)
{
    const double level = cos(el) * (1 - half_el * half_el / 2) - half_el * fabs(sin(el));
    return aside <= 0 ? 0 : aside < GEO_PI / 2 && sin(aside) < level ? asin(sin(aside) / level) : GEO_PI;
}

/* As a person would write it. Bits of the sectors touched, of up to 64. */
static uint64_t plain(const struct overlap_band *band, const struct overlap_cell *cell, double aside)
{
    double az, el, width = GEO_TURN / (double)band->count;
    uint64_t touched = 0;
    geo_angles(cell->v, &az, &el);
    const double half = fmin(cell->half_az_rad + wider(el, cell->half_el_rad, aside), GEO_PI);
    if (el + (cell->half_el_rad + aside) <= band->lo_rad || el - (cell->half_el_rad + aside) >= band->hi_rad)
        return 0;
    const double from = floor((az - half) / width + 0.5 + 1e-9), to = ceil((az + half) / width - 0.5 - 1e-9);
    for (double k = from; k <= to; k++)
        touched |= 1ull << (size_t)(k + 4 * (double)band->count) % band->count;
    return touched;
}

static uint64_t found(const struct overlap_band *band, const struct overlap_cell *cell, double aside)
{
    struct overlap_cell copy = *cell;
    const struct overlap_run run = overlap_run(band, &copy, aside);
    uint64_t touched = 0;
    for (size_t k = 0; k < run.n; k++)
        touched |= 1ull << (run.at + k) % band->count;
    return run.at < band->count && run.n <= band->count ? touched : ~touched;
}

/* Nothing, or so small that rough angles may miss it. */
static double tiny(void)
{
    return one_in(3) ? 0 : uniform(-1, 1) * pow(10, uniform(-14, -4));
}

static struct overlap_band any_band(void)
{
    const double lo = one_in(4) ? -GEO_PI / 2 : uniform(-1.5, 1.2);
    return (struct overlap_band){
        .lo_rad = lo, .hi_rad = uniform(lo, GEO_PI / 2), .count = one_in(5) ? 1 : (size_t)uniform(1, 65)};
}

/* Often with an edge on that of a sector, or of the band, or so near to a pole that all sectors are touched or not. */
static void any_cell(const struct overlap_band *band, double aside, struct overlap_cell *cell)
{
    const double width = GEO_TURN / (double)band->count;
    cell->half_az_rad = one_in(4) ? width * floor(uniform(0, 4)) / 2 : uniform(0, one_in(9) ? GEO_PI : 0.1);
    cell->half_el_rad = uniform(0, 0.1);
    double el = one_in(4)   ? band->lo_rad - aside - cell->half_el_rad + tiny()
                : one_in(3) ? band->hi_rad + aside + cell->half_el_rad + tiny()
                : one_in(3) ? (GEO_PI / 2 - aside + tiny()) * (one_in(2) ? 1 : -1)
                            : uniform(-1.5, 1.5);
    el = fmax(-GEO_PI / 2, fmin(GEO_PI / 2, el));
    const double more = wider(el, cell->half_el_rad, aside);
    const double edge = width * (floor(uniform(-2, (double)band->count + 2)) + 0.5) + tiny();
    const double az = one_in(3)   ? edge + more + cell->half_az_rad
                      : one_in(2) ? edge - more - cell->half_az_rad
                      : one_in(9) ? tiny()
                                  : uniform(0, GEO_TURN);
    geo_direction(az, el, cell->v);
    if (one_in(200))
        cell->v[0] = cell->v[1] = 0;
    overlap_middle(cell, cell->v);
}

TEST(rough_angles_touch_what_exact_ones_do)
{
    uint64_t differ = 0;
    seed = test_seed();
    for (int i = 0; i < 400000; i++) {
        const struct overlap_band band = any_band();
        const double aside = one_in(3) ? 0 : uniform(0, one_in(9) ? GEO_PI : 0.4);
        struct overlap_cell cell;
        any_cell(&band, aside, &cell);
        differ += found(&band, &cell, aside) != plain(&band, &cell, aside);
        geo_angles(cell.v, &cell.az_rad, &cell.el_rad);
        cell.level = cos(cell.el_rad);
        cell.exact = true;
        differ += found(&band, &cell, aside) != plain(&band, &cell, aside);
    }
    CHECK_INT(differ, 0);
}

/* A place of the cell, from up to so far beside where it is seen: it is in a sector that the cell touches. */
TEST(no_place_of_a_cell_is_seen_outside_its_sectors)
{
    seed = test_seed();
    for (int i = 0; i < 100000; i++) {
        const struct overlap_band band = any_band();
        const double aside = uniform(0, one_in(4) ? 3 : 0.4), el = uniform(-1.4, 1.4), az = uniform(0, GEO_TURN);
        struct overlap_cell cell = {.half_az_rad = uniform(0, 0.2), .half_el_rad = uniform(0, 0.15)};
        double v[3], at[3], turn[4], seen_az, seen_el;
        geo_direction(az, el, v);
        overlap_middle(&cell, v);
        geo_direction(az + cell.half_az_rad * uniform(-1, 1), el + cell.half_el_rad * uniform(-1, 1), at);
        geo_direction(uniform(0, GEO_TURN), uniform(-1.5, 1.5), v);
        turn[0] = cos(aside / 2);
        for (int n = 0; n < 3; n++)
            turn[n + 1] = v[n] * sin(aside / 2);
        quat_rotate(turn, at, at);
        geo_angles(at, &seen_az, &seen_el);
        if (seen_el <= band.lo_rad || seen_el >= band.hi_rad)
            continue;
        const double sector = floor(geo_wrap(seen_az) / GEO_TURN * (double)band.count + 0.5);
        CHECK(found(&band, &cell, aside) >> (size_t)sector % band.count & 1);
    }
}

TEST(angles_are_computed_exactly_only_where_that_decides)
{
    const struct overlap_band band = {.lo_rad = -0.1, .hi_rad = 0.1, .count = 72};
    int exact = 0;
    seed = test_seed();
    for (int i = 0; i < 10000; i++) {
        struct overlap_cell cell = {.half_az_rad = 0.0175, .half_el_rad = 0.0175};
        double v[3];
        geo_direction(uniform(0, GEO_TURN), uniform(-0.3, 0.3), v);
        overlap_middle(&cell, v);
        overlap_run(&band, &cell, 0.03);
        exact += cell.exact;
    }
    CHECK(exact < 100);
}

/* Between two bearings, each sector by its own arc; past the last one goes on with the first. */
TEST(of_a_window_those_that_the_cell_reaches_into)
{
    unsigned some = 0, both_ends = 0;
    seed = test_seed();
    for (int i = 0; i < 20000; i++) {
        const struct overlap_band band = {.lo_rad = -0.2,
                                          .hi_rad = 0.2,
                                          .from_rad = uniform(-7, 7),
                                          .width_rad = uniform(0.01, GEO_TURN),
                                          .count = (size_t)uniform(1, 64)};
        const double az = uniform(0, GEO_TURN), half = uniform(0, one_in(4) ? GEO_PI : 0.3);
        const double wide = band.width_rad / (double)band.count;
        struct overlap_cell cell = {.half_az_rad = half, .half_el_rad = 0.01};
        geo_direction(az, 0, cell.v);
        overlap_middle(&cell, cell.v);
        uint64_t touched = 0;
        for (size_t k = 0; k < band.count; k++) {
            const double middle = band.from_rad + ((double)k + 0.5) * wide;
            touched |= (uint64_t)(fabs(geo_wrap_pi(az - middle)) < half + wide / 2) << k;
        }
        some += touched != 0;
        both_ends += band.count > 2 && (touched & 1) && touched >> (band.count - 1) & 1;
        CHECK(found(&band, &cell, 0) == touched);
    }
    CHECK(some > 5000 && both_ends > 500);
}

int main(void)
{
    RUN(rough_angles_touch_what_exact_ones_do);
    RUN(no_place_of_a_cell_is_seen_outside_its_sectors);
    RUN(angles_are_computed_exactly_only_where_that_decides);
    RUN(of_a_window_those_that_the_cell_reaches_into);
    return test_end();
}
