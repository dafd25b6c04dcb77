/* SPDX-License-Identifier: MIT */
/*
 * test_cell_edge - the ray of a cell that is nearest to a line, against all of its rays, at the poles and the
 * seam too.
 */
#include <math.h>

#include "grid/answer/cell_edge.h"
#include "grid/geometry.h"
#include "tests/lib/test.h"

static uint64_t seed;

static double uniform(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

#define RAYS 40 /* from edge to edge, each way */

static double by_rays(const struct rings *rings, uint32_t d, const double axis[3])
{
    const double half = rings_width(rings, rings_ring(rings, d)) / 2;
    double az, el, v[3], most = -1;
    rings_centre(rings, d, &az, &el);
    for (int i = -RAYS; i <= RAYS; i++)
        for (int k = -RAYS; k <= RAYS; k++) {
            geo_direction(az + half * i / RAYS, el + rings->height_rad / 2 * k / RAYS, v);
            most = fmax(most, dot(v, axis));
        }
    return most;
}

static void check_against_rays(const struct rings *rings)
{
    const uint32_t d = (uint32_t)uniform(0, rings->n);
    const struct cell_edge edge = cell_edge_of(rings, rings_ring(rings, d));
    double az, el, v[3], axis[3];
    rings_centre(rings, d, &az, &el);
    geo_direction(az, el, v);
    const bool near = uniform(0, 1) < 0.5;
    if (near)
        geo_direction(az + uniform(-0.2, 0.2), fmax(-1.57, fmin(1.57, el + uniform(-0.2, 0.2))), axis);
    else
        geo_direction(uniform(0, GEO_TURN), asin(uniform(-1, 1)), axis);
    const double nearest = cell_edge_nearest(&edge, v, axis), rays = by_rays(rings, d, axis);
    const double apart_rad = hypot(rings_width(rings, rings_ring(rings, d)), rings->height_rad) / RAYS;
    CHECK(nearest >= rays - 1e-12);
    /* a cell as wide as a half circle counts as having every azimuth */
    if (rings_width(rings, rings_ring(rings, d)) < GEO_PI)
        CHECK(acos(fmin(1, nearest)) >= acos(fmin(1, rays)) - apart_rad);
}

TEST(no_ray_of_the_cell_is_nearer_and_one_is_as_near)
{
    static const double step_deg[] = {1, 2, 7.3, 30, 90};
    seed = test_seed();
    for (size_t k = 0; k < sizeof step_deg / sizeof step_deg[0]; k++) {
        struct rings rings;
        CHECK(rings_full(&rings, geo_rad(step_deg[k])));
        for (int i = 0; i < 300 && !test_case_failed; i++)
            check_against_rays(&rings);
    }
}

TEST(a_level_row_is_as_high_as_its_beams)
{
    struct rings rings;
    seed = test_seed();
    CHECK(rings_level(&rings, geo_rad(2), geo_rad(12.5)));
    for (int i = 0; i < 300 && !test_case_failed; i++)
        check_against_rays(&rings);
}

int main(void)
{
    RUN(no_ray_of_the_cell_is_nearer_and_one_is_as_near);
    RUN(a_level_row_is_as_high_as_its_beams);
    return test_end();
}
