/* SPDX-License-Identifier: MIT */
/* test_rig_steering - a vehicle without a position looks where its thrusters push, and around when they do not. */
#include "tests/lib/rig.h"

/* Bearings, in steps of 5 degrees, at which the head was in that time. */
static unsigned run(int seconds, double forward_n, double right_n, bool at[72])
{
    unsigned n = 0;
    memset(at, 0, 72 * sizeof *at);
    for (int i = 0; i < seconds * 20; i++) {
        if (i % 20 == 0)
            json_decref(rig_ask("pose", "\"push_n\":[%g,%g]", forward_n, right_n));
        rig_run(0.05);
        at[(rig.sim.head.shot.settings.angle + 200) % 400 * 9 / 50] = true;
    }
    for (int i = 0; i < 72; i++)
        n += at[i];
    return n;
}

#define WATER "[vehicle]\ncurrent = 0.05 m/s\n"

/* At 115200 baud a circle of 200 pings takes 29 s, and 80 degrees of it 6 s. */
static void dive(const char *conf, bool steered)
{
    bool at[72];
    rig_start("box -30 30 -30 30 -20 20\n", conf);
    rig.pose_every_ns = RIG_S / 10;
    rig.unplaced = true;
    run(32, 0, 0, at);
    run(12, 0, -5, at); /* on its way there */
    const unsigned n = run(30, 0, -5, at);
    CHECK(steered ? n <= 18 && at[54] && at[47] && at[61] && !at[44] && !at[64] && !at[0] : n > 70);
    CHECK(run(46, 0, 0, at) > 70);
    rig_end();
}

TEST(the_head_looks_where_the_thrusters_push)
{
    dive("step = 1.8 deg\n" WATER, true);
}

TEST(not_where_it_is_to_scan_plainly_or_nothing_promises_how_the_water_goes)
{
    dive("step = 1.8 deg\nscan = plain\n" WATER, false);
    dive("step = 1.8 deg\n[vehicle]\nmax_speed = 0.05 m/s\n", false);
}

int main(void)
{
    RUN(the_head_looks_where_the_thrusters_push);
    RUN(not_where_it_is_to_scan_plainly_or_nothing_promises_how_the_water_goes);
    return test_end();
}
