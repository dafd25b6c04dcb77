/* SPDX-License-Identifier: MIT */
/* test_arcs - arcs among points of a scan: round tanks, piles, what is a line, and runs across the seam of the turn. */
#include "grid/sphere/arcs.h"

#include "grid/geometry.h"
#include "tests/lib/test.h"

#define TURN 180

static const struct arcs_conf conf = {.reach_m = 0.5, .least_n = 6, .round_m = 0.06, .radius_m = 100};
static struct tangent_point point[TURN];
static uint32_t of[TURN];
static struct arc arc[4];

static void nothing(void)
{
    for (int i = 0; i < TURN; i++) {
        point[i] = (struct tangent_point){NAN, NAN};
        of[i] = TANGENTS_NONE;
    }
}

/* Where rays at 2 degrees meet a circle, the near side or from within. */
static void circle(double x_m, double y_m, double radius_m, double noise_m, uint64_t *seed)
{
    for (int i = 0; i < TURN; i++) {
        const double az = geo_rad(2 * i + 1), along = x_m * cos(az) + y_m * sin(az);
        const double under = along * along - x_m * x_m - y_m * y_m + radius_m * radius_m;
        const double root = sqrt(fmax(0, under)), near = along - root;
        double r = near > 0 ? near : along + root;
        if (under < 0 || r <= 0)
            continue;
        r += noise_m * (2 * test_uniform(seed) - 1);
        point[i] = (struct tangent_point){r * cos(az), r * sin(az)};
    }
}

TEST(a_tank_is_an_arc_wherever_in_it_one_stands)
{
    uint64_t seed = test_seed();
    for (int k = 0; k < 50; k++) {
        const double radius_m = 1 + 5 * test_uniform(&seed), off_m = 0.6 * radius_m * test_uniform(&seed);
        const double az = GEO_TURN * test_uniform(&seed), x_m = off_m * cos(az), y_m = off_m * sin(az);
        nothing();
        circle(x_m, y_m, radius_m, 0.03, &seed);
        CHECK_INT(arcs_find(&conf, point, TURN, of, arc, 4), 1);
        CHECK_NEAR(arc[0].centre.x_m, x_m, 0, 0.02);
        CHECK_NEAR(arc[0].centre.y_m, y_m, 0, 0.02);
        CHECK_NEAR(arc[0].radius_m, radius_m, 0, 0.02);
        CHECK_INT(arc[0].points, TURN);
        CHECK(arc[0].rms_m > 0.005 && arc[0].rms_m < 0.03);
    }
}

/* Ahead, across the seam of the turn, and two of them. */
TEST(piles_are_arcs_that_bulge_towards_the_sonar)
{
    uint64_t seed = test_seed();
    nothing();
    circle(2, 0.1, 0.4, 0, &seed);
    circle(-1, 2, 0.5, 0, &seed);
    CHECK_INT(arcs_find(&conf, point, TURN, of, arc, 4), 2);
    for (int k = 0; k < 2; k++) {
        const bool ahead = arc[k].centre.x_m > 0;
        CHECK_NEAR(arc[k].centre.x_m, ahead ? 2 : -1, 0, 1e-6);
        CHECK_NEAR(arc[k].centre.y_m, ahead ? 0.1 : 2, 0, 1e-6);
        CHECK_NEAR(arc[k].radius_m, ahead ? 0.4 : 0.5, 0, 1e-6);
        CHECK(isfinite(point[arc[k].first].x_m));
        CHECK(!isfinite(point[(arc[k].first + TURN - 1) % TURN].x_m));
        CHECK(!isfinite(point[(arc[k].first + arc[k].points) % TURN].x_m));
    }
    CHECK_INT(arcs_find(&conf, point, TURN, of, arc, 1), 2); /* one is stored */
}

TEST(what_is_no_arc)
{
    uint64_t seed = test_seed();
    nothing();
    for (int i = -20; i < 20; i++) /* a line, with noise */
        point[(i + TURN) % TURN] =
            (struct tangent_point){3 + 0.02 * test_uniform(&seed), 3 * tan(geo_rad(2 * i + 1))};
    CHECK_INT(arcs_find(&conf, point, TURN, of, arc, 4), 0);
    nothing();
    circle(2, 0, 0.4, 0, &seed);
    for (int i = 0; i < TURN; i++) /* of a wall */
        of[i] = 0;
    CHECK_INT(arcs_find(&conf, point, TURN, of, arc, 4), 0);
    nothing();
    circle(0, 0, 3, 0.3, &seed); /* far too rough */
    CHECK_INT(arcs_find(&conf, point, TURN, of, arc, 4), 0);
    nothing();
    CHECK_INT(arcs_find(&conf, point, TURN, of, arc, 4), 0);
    CHECK_INT(arcs_find(&conf, point, 0, of, arc, 4), 0);
    circle(2, 0, 0.4, 0, &seed);
    point[5] = point[TURN - 6] = (struct tangent_point){NAN, NAN};
    uint32_t n =
        arcs_find(&conf, point, TURN, of, arc, 4); /* a missing bearing splits; pieces of fewer than 6 are none */
    for (uint32_t k = 0; k < n; k++)
        CHECK(arc[k].points >= 6);
    struct arcs_conf small = conf;
    small.radius_m = 0.39;
    CHECK_INT(arcs_find(&small, point, TURN, of, arc, 4), 0);
}

int main(void)
{
    RUN(a_tank_is_an_arc_wherever_in_it_one_stands);
    RUN(piles_are_arcs_that_bulge_towards_the_sonar);
    RUN(what_is_no_arc);
    return test_end();
}
