/* SPDX-License-Identifier: MIT */
/* test_thrust - which way the motors of ArduSub's frames push, and the T200's curve. */
#include "client/mavlink/thrust.h"
#include "tests/lib/test.h"

/* Of a real BlueROV2 Heavy: MOT_n_DIRECTION. */
static const int directions[8] = {-1, -1, 1, 1, -1, 1, 1, -1};

/* The middle of what the motors may push. */
static void push(int frame_config, const int pulse_us[], double out[3])
{
    const struct thrust_frame *frame = thrust_frame(frame_config);
    memset(out, 0, 3 * sizeof *out);
    for (int k = 0; k < frame->n; k++) {
        const struct thrust_range r = thrust_range(&frame->motor[k], pulse_us[k], directions[k], 16);
        CHECK(r.least_n <= r.most_n);
        for (int i = 0; i < 3; i++)
            out[i] += frame->motor[k].axis[i] * (r.least_n + r.most_n) / 2;
    }
}

/* What ArduSub 4.1.1 made of sticks a little ahead, to the right, up and to the left, ten times as much of it. */
TEST(a_heavy_goes_where_its_sticks_say)
{
    static const int ahead[8] = {1570, 1570, 1570, 1570, 1500, 1500, 1500, 1500},
                     right[8] = {1430, 1570, 1570, 1430, 1500, 1500, 1500, 1500},
                     up[8] = {1500, 1500, 1500, 1500, 1580, 1420, 1420, 1580},
                     turn[8] = {1420, 1580, 1420, 1580, 1500, 1500, 1500, 1500};
    double f[3];
    push(2, ahead, f);
    CHECK(f[0] > 5 && f[0] < 12 && fabs(f[1]) < 1e-9 && fabs(f[2]) < 1e-9);
    push(2, right, f);
    CHECK(fabs(f[0]) < 1e-9 && f[1] > 5 && f[1] < 12);
    push(2, up, f);
    CHECK(fabs(f[0]) < 1e-9 && fabs(f[1]) < 1e-9 && f[2] < -8);
    push(2, turn, f);
    CHECK(fabs(f[0]) < 1e-9 && fabs(f[1]) < 1e-9 && fabs(f[2]) < 1e-9);
}

TEST(frames)
{
    static const int motors[] = {6, 6, 8, 8, 5, 5, 5};
    for (int frame = 0; frame < 7; frame++) {
        CHECK_INT(thrust_frame(frame)->n, motors[frame]);
        for (int k = 0; k < motors[frame]; k++) {
            const double *a = thrust_frame(frame)->motor[k].axis;
            CHECK_NEAR(sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]), 1, 1e-12, 0);
        }
    }
    CHECK(!thrust_frame(-1) && !thrust_frame(7) && !thrust_frame(8));
}

/* The maker's tables, and never less for more. */
TEST(the_curve)
{
    CHECK_NEAR(thrust_newtons(400, 12, true), 3.71 * 9.80665, 0.01, 0);
    CHECK_NEAR(thrust_newtons(400, 12, false), 2.90 * 9.80665, 0.01, 0);
    CHECK_NEAR(thrust_newtons(200, 12, true), 1.28 * 9.80665, 0.02, 0);
    CHECK_NEAR(thrust_newtons(400, 16, true), 51.4, 1e-9, 0);
    CHECK_NEAR(thrust_newtons(400, 20, true), 65.9, 1e-9, 0);
    for (double volts = 10; volts <= 25; volts += 0.5)
        for (int us = 0; us <= 400; us++) {
            CHECK(thrust_newtons(us, volts, true) >= thrust_newtons(us, volts, false));
            CHECK(us == 0 || thrust_newtons(us, volts, true) >= thrust_newtons(us - 1, volts, true));
            CHECK(volts <= 10 || thrust_newtons(us, volts, true) >= thrust_newtons(us, volts - 0.5, true));
            CHECK(us >= 24 || thrust_newtons(us, volts, true) == 0);
        }
}

int main(void)
{
    RUN(a_heavy_goes_where_its_sticks_say);
    RUN(frames);
    RUN(the_curve);
    return test_end();
}
