/* SPDX-License-Identifier: MIT */
/* test_promise_come - how near what a beam showed may have come to a vehicle that drifts, in every direction. */
#include "tests/lib/picture_rig.h"

#include "grid/answer/promise.h"

#define RANGE_M 3.0
#define SD_M    0.05
#define STEP    3.0
#define LOOSE_M 0.4
#define TURN_S  4.0

static struct picture_frame frame;
static double surely_m; /* what was shown may be as near */

/* A head looks all around, level, and has done so until now. */
static void start(void)
{
    start_with(rings_full(&rings, geo_rad(STEP)), false);
    frame = (struct picture_frame){.pings = 1, .t_ping_ns = NOW, .range_max_m = 20, .turn_s = TURN_S};
    frame.looks.bearings[0] = UINT64_MAX;
    frame.looks.t_ns = NOW;
    frame.looks.level_rad[0] = geo_rad(12);
    for (int k = 1; k < BEARINGS_SENSORS; k++)
        memset(frame.looks.heard_ds[k], 0xff, sizeof frame.looks.heard_ds[k]);
    now.pose.drift_mps = 0.5;
    surely_m = RANGE_M - 3 * SD_M;
}

/* Returns the azimuth of the cell's middle. */
static double show(double az_deg, double el_deg, double age_s, double odds)
{
    const uint32_t d = rings_index(&rings, geo_rad(az_deg), geo_rad(el_deg));
    const uint64_t t_ns = NOW - (uint64_t)(age_s * 1e9);
    struct picture_entry e = {.t_look_ns = t_ns};
    double az, el;
    e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = NOW,
                                              .t_echo_ns = t_ns,
                                              .logodds = (float)odds,
                                              .near_m = (float)RANGE_M,
                                              .range_m = (float)RANGE_M,
                                              .sd_m = (float)SD_M};
    picture_begin(&picture);
    picture_set(&picture, d, &e);
    picture_end(&picture);
    rings_centre(&rings, d, &az, &el);
    return az;
}

static struct promise given(double loose_m)
{
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
    return promise_begin(&picture, &limits, &frame, &now, &(struct sight_place){.moved_m = loose_m});
}

/* The nearest point, along rays of that part and half a cell beside it, of a disk around what was shown. */
static double nearest_m(int part, double az_rad, double radius_m)
{
    double near_m = INFINITY;
    if (radius_m >= surely_m)
        return 0;
    for (int k = 0; k <= 400; k++) {
        const double within = (k / 400.0 - 0.5) * (GEO_TURN / PROMISE_PARTS + geo_rad(STEP));
        const double off = (part + 0.5) * GEO_TURN / PROMISE_PARTS + within - az_rad;
        const double aside_m = surely_m * sin(off), along_m = surely_m * cos(off);
        if (along_m > 0 && fabs(aside_m) <= radius_m)
            near_m = fmin(near_m, along_m - sqrt(radius_m * radius_m - aside_m * aside_m));
    }
    return near_m;
}

static void check_come(double az_rad, double age_s, double loose_m)
{
    const struct promise p = given(loose_m);
    for (int i = 0; i < PROMISE_PARTS; i++) {
        const double want_m = nearest_m(i, az_rad, now.pose.drift_mps * age_s + loose_m);
        const bool good = isinf(want_m) ? isinf(p.come_m[i]) || p.come_m[i] > surely_m * 0.5
                                        : p.come_m[i] <= want_m + 1e-6 && p.come_m[i] >= want_m - 0.03;
        if (!good)
            printf("part %d: %g m, want %g m\n", i, p.come_m[i], want_m);
        CHECK(good);
    }
}

TEST(what_was_shown_has_come_nearer_by_the_drift_in_every_direction)
{
    static const double az_deg[] = {1, 75, 181, 300}, age_s[] = {0, 1, 3, 4.5, 6};
    for (size_t i = 0; i < sizeof az_deg / sizeof *az_deg; i++)
        for (size_t k = 0; k < sizeof age_s / sizeof *age_s; k++) {
            start();
            const double az_rad = show(az_deg[i], 1, age_s[k], 4);
            check_come(az_rad, age_s[k], 0);
            check_come(az_rad, age_s[k], LOOSE_M);
        }
}

static bool has_come(void)
{
    const struct promise p = given(0);
    bool any = false;
    for (int i = 0; i < PROMISE_PARTS; i++)
        any |= isfinite(p.come_m[i]);
    return any;
}

/* What else has to be so, each left out alone. */
TEST(only_what_blocks_and_is_looked_at_and_was_not_looked_at_since_may_have_come)
{
    static const struct {
        double el_deg, age_s, odds, drift_mps;
        bool heads, comes;
    } row[] = {
        {1, 4, 4, 0.5, true, true},   {1, 4, 0.3, 0.5, true, false}, /* too faint to block */
        {1, 4, 0.5, 0.5, true, true}, {1, 8.7, 4, 0.5, true, true},  {1, 8.9, 4, 0.5, true, false}, /* 2.2 turns */
        {1, 4, 4, 0, true, false},    {1, 4, 4, 0.5, false, false},  {30, 4, 4, 0.5, true, false}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        start();
        now.pose.drift_mps = row[i].drift_mps;
        frame.looks.bearings[0] = row[i].heads ? UINT64_MAX : 0;
        show(75, row[i].el_deg, row[i].age_s, row[i].odds);
        CHECK_INT(has_come(), row[i].comes);
    }
}

TEST(what_a_head_has_left_out_it_has_not_looked_at)
{
    for (int left_out = 0; left_out < 2; left_out++) {
        start();
        frame.looks.heard_ds[0][7] = left_out ? 120 : 0; /* 12 s ago */
        show(75, 1, 11, 4);
        CHECK_INT(has_come(), left_out);
        frame.looks.bearings[0] &= ~(UINT64_C(1) << 7); /* it need not look there */
        CHECK(!has_come());
    }
    start(); /* and all of it for as long as there was no ping */
    show(75, 1, 11, 4);
    frame.looks.heard_ds[0][7] = 60;
    CHECK(!has_come());
    frame.looks.t_ns = NOW - 6 * SECOND;
    CHECK(has_come());
    start(); /* before a first turn was timed, ever; where no head turns, for a second */
    show(75, 1, 300, 4);
    frame.turn_s = 0;
    CHECK(!has_come());
    frame.looks.first_turns = 1;
    CHECK(has_come());
    frame.turn_s = TURN_S;
    CHECK(!has_come());
}

int main(void)
{
    RUN(what_was_shown_has_come_nearer_by_the_drift_in_every_direction);
    RUN(only_what_blocks_and_is_looked_at_and_was_not_looked_at_since_may_have_come);
    RUN(what_a_head_has_left_out_it_has_not_looked_at);
    return test_end();
}
