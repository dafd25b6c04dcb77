/* SPDX-License-Identifier: MIT */
/* test_geometry - directions, rotations and poses, against identities and the slerp table. */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"

TEST(wrap_never_gives_a_whole_turn)
{
    static const double in[] = {0, -0.0, GEO_TURN, -GEO_TURN, -1e-17, 1e9 * GEO_TURN + 0.1, -1e-300, 7};
    for (size_t i = 0; i < sizeof in / sizeof in[0]; i++) {
        double w = geo_wrap(in[i]);
        CHECK(w >= 0 && w < GEO_TURN);
        CHECK(!signbit(w));
        CHECK(geo_wrap_pi(in[i]) >= -GEO_PI && geo_wrap_pi(in[i]) < GEO_PI);
    }
}

TEST(directions_and_angles_are_inverse)
{
    uint64_t seed = test_seed();
    for (int i = 0; i < 10000; i++) {
        double az = test_uniform(&seed) * GEO_TURN, el = (test_uniform(&seed) - 0.5) * GEO_PI, v[3], az2, el2;
        geo_direction(az, el, v);
        geo_angles(v, &az2, &el2);
        CHECK_NEAR(el2, el, 0, 1e-12);
        CHECK_NEAR(geo_wrap_pi(az2 - az) * cos(el), 0, 0, 1e-12);
    }
}

TEST(starboard_is_a_quarter_turn_and_up_is_positive)
{
    double v[3];
    geo_direction(GEO_PI / 2, 0, v);
    CHECK_NEAR(v[1], 1, 0, 1e-15);
    geo_direction(0, GEO_PI / 2, v);
    CHECK_NEAR(v[2], -1, 0, 1e-15);
}

TEST(straight_up_has_azimuth_zero)
{
    double az, el;
    geo_angles((double[]){0, 0, -2}, &az, &el);
    CHECK_NEAR(az, 0, 0, 0);
    CHECK_NEAR(el, GEO_PI / 2, 0, 1e-15);
}

TEST(yaw_turns_forward_to_starboard_and_pitch_lifts_the_nose)
{
    double q[4], v[3];
    quat_from_rpy(0, 0, GEO_PI / 2, q);
    quat_rotate(q, (double[]){1, 0, 0}, v);
    CHECK_NEAR(v[1], 1, 0, 1e-15);
    quat_from_rpy(0, geo_rad(30), 0, q);
    quat_rotate(q, (double[]){1, 0, 0}, v);
    CHECK_NEAR(v[2], -0.5, 0, 1e-15);
}

TEST(rotations_keep_length_and_undo_each_other)
{
    uint64_t seed = test_seed();
    for (int i = 0; i < 1000; i++) {
        double q[4], v[3] = {test_uniform(&seed), test_uniform(&seed), test_uniform(&seed)}, w[3], r, p, y, q2[4];
        quat_from_rpy(6 * test_uniform(&seed) - 3, 3 * test_uniform(&seed) - 1.5, 6 * test_uniform(&seed) - 3, q);
        double axis[3][3];
        quat_axes(q, axis);
        quat_rotate(q, v, w);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(v[0] * axis[0][k] + v[1] * axis[1][k] + v[2] * axis[2][k], w[k], 0, 1e-14);
        quat_rotate_inverse(q, w, w);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(w[k], v[k], 0, 1e-14);
        quat_to_rpy(q, &r, &p, &y);
        quat_from_rpy(r, p, y, q2);
        double dot = q[0] * q2[0] + q[1] * q2[1] + q[2] * q2[2] + q[3] * q2[3];
        CHECK_NEAR(fabs(dot), 1, 0, 1e-14);
    }
}

TEST(a_product_rotates_as_its_factors_one_after_the_other)
{
    double a[4], b[4], ab[4], v[3] = {1, 2, 3}, one[3], two[3];
    quat_from_rpy(0.1, -0.7, 2, a);
    quat_from_rpy(-1, 0.4, 0.3, b);
    quat_multiply(a, b, ab);
    quat_rotate(ab, v, one);
    quat_rotate(b, v, two);
    quat_rotate(a, two, two);
    for (int k = 0; k < 3; k++)
        CHECK_NEAR(one[k], two[k], 0, 1e-14);
}

TEST(normalise_refuses_what_is_no_rotation)
{
    double bad[][4] = {{0, 0, 0, 0}, {NAN, 0, 0, 1}, {INFINITY, 0, 0, 0}, {1.2, 0, 0, 0}, {1e-3, 0, 0, 0}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        CHECK(!quat_normalise(bad[i]));
    double good[4] = {1.05, 0, 0, 0};
    CHECK(quat_normalise(good));
    CHECK_NEAR(good[0], 1, 0, 1e-16);
}

TEST(slerp_equals_table)
{
    struct table t = table_open("tests/oracles/slerp.csv");
    int rows = 0;
    while (table_next(&t)) {
        double a[4], b[4], got[4], na = 0, nb = 0, dot = 0, length = 0;
        for (int i = 0; i < 4; i++) {
            a[i] = table_real(&t, 1 + i);
            b[i] = table_real(&t, 5 + i);
            na += a[i] * a[i];
            nb += b[i] * b[i];
        }
        for (int i = 0; i < 4; i++) {
            a[i] /= sqrt(na);
            b[i] /= sqrt(nb);
        }
        quat_slerp(a, b, table_real(&t, 9), got);
        for (int i = 0; i < 4; i++) {
            dot += got[i] * table_real(&t, 10 + i);
            length += got[i] * got[i];
        }
        CHECK_NEAR(length, 1, 0, 1e-14);
        if (!table_int(&t, 16))
            for (int i = 0; i < 4; i++)
                CHECK_NEAR(dot < 0 ? -got[i] : got[i], table_real(&t, 10 + i), 0, 1e-12);
        rows++;
    }
    CHECK(rows > 100);
}

int main(void)
{
    RUN(wrap_never_gives_a_whole_turn);
    RUN(directions_and_angles_are_inverse);
    RUN(starboard_is_a_quarter_turn_and_up_is_positive);
    RUN(straight_up_has_azimuth_zero);
    RUN(yaw_turns_forward_to_starboard_and_pitch_lifts_the_nose);
    RUN(rotations_keep_length_and_undo_each_other);
    RUN(a_product_rotates_as_its_factors_one_after_the_other);
    RUN(normalise_refuses_what_is_no_rotation);
    RUN(slerp_equals_table);
    return test_end();
}
