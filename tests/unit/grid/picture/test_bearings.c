/* SPDX-License-Identifier: MIT */
/* test_bearings - at which level bearings of the vehicle its sonars look, from the beams of their pings. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/geometry.h"
#include "grid/ping.h"
#include "grid/picture/bearings.h"
#include "tests/lib/test.h"

static struct bearings b;
static struct mount mount;
static struct pose pose;
static uint8_t state, hides;
static uint32_t turn_ms[BEARINGS_SENSORS];

#define SECOND UINT64_C(1000000000)
#define KEEP_S 30.0

static double wide_deg; /* of a beam */
static bool fixed;      /* a single beam that stays */
static double edge_deg; /* of what still beams cover so much on either side does not count */

static void start(double roll_deg, double pitch_deg, double yaw_deg)
{
    b = (struct bearings){0};
    pose = pose_identity;
    pose.t_ns = 1000 * SECOND;
    mount = mount_identity;
    memset(turn_ms, 0, sizeof turn_ms);
    state = BEAM_SILENT;
    hides = BEAM_HIDES_NOTHING;
    edge_deg = 3;
    wide_deg = 3;
    fixed = false;
    quat_from_rpy(geo_rad(roll_deg), geo_rad(pitch_deg), geo_rad(yaw_deg), mount.attitude);
}

/* Beams of wide_deg by high_deg from one azimuth to the other. */
static void ping(unsigned sensor, int beams, double from_deg, double to_deg, double high_deg, bool new_turn)
{
    struct beam_echoes beam[64];
    struct echoes e = {.sensor = (uint16_t)sensor,
                       .n_beams = (uint16_t)beams,
                       .flags = new_turn ? PING_NEW_TURN : 0,
                       .turns = beams == 1 && !fixed,
                       .az_aperture_rad = (float)geo_rad(wide_deg),
                       .el_aperture_rad = (float)geo_rad(high_deg),
                       .range_max_m = 10,
                       .pose = pose,
                       .t_ns = pose.t_ns,
                       .beam = beam};
    for (int i = 0; i < beams; i++) {
        const double share = beams > 1 ? (double)i / (beams - 1) : 0;
        beam[i] = (struct beam_echoes){.az_rad = (float)geo_wrap(geo_rad(from_deg + share * (to_deg - from_deg))),
                                       .state = state,
                                       .hides = hides,
                                       .n = state == BEAM_ECHO,
                                       .heard_to_m = 10};
    }
    bearings_enter(&b, &e, &mount);
}

/* A head looks ahead, 60 degrees to each side, so many times. */
static void sweeps(unsigned sensor, int turns, double turn_s)
{
    for (int turn = 0; turn < turns; turn++)
        for (int deg = -60; deg < 60; deg += 3) {
            pose.t_ns += (uint64_t)(turn_s / 40 * 1e9);
            ping(sensor, 1, deg, deg, 25, deg == -60);
        }
}

static bool shows(double deg)
{
    struct bearings_looks looks;
    bearings_tell(&b, turn_ms, &looks);
    return bearings_have(bearings_of(&looks, 1, pose.t_ns, KEEP_S), geo_rad(deg), 0);
}

/* At a bearing and so far above the body's level, in rows of cells a degree high. */
static bool at_place(double deg, double up_deg)
{
    const struct bearings_view view = {.attitude = {1, 0, 0, 0}, .step_rad = geo_rad(1)};
    static struct bearings told; /* a row is told for all bearings at once */
    static double told_deg = NAN;
    static uint64_t row[BEARINGS_FINE / 64];
    struct bearings_looks looks;
    bearings_tell(&b, turn_ms, &looks);
    if (told_deg != up_deg || memcmp(&told, &b, sizeof b) != 0)
        bearings_row(&looks, &view, geo_rad(up_deg), 3, row);
    told = b;
    told_deg = up_deg;
    return bearings_have(bearings_level(&looks, 0), geo_rad(deg), 0) ||
           bearings_inside(row, geo_rad(deg), geo_rad(edge_deg)) > 0;
}

static bool at(double deg)
{
    return at_place(deg, 0);
}

static double level_deg(unsigned sensor)
{
    struct bearings_looks looks;
    bearings_tell(&b, turn_ms, &looks);
    return geo_deg(looks.level_rad[sensor]);
}

/* In cells that lie in it does a still sonar look above and below level there. */
static bool is_high(double deg, double high_deg)
{
    return at_place(deg, high_deg - 0.85) && at_place(deg, 0.85 - high_deg) && !at_place(deg, high_deg - 0.65) &&
           !at_place(deg, 0.65 - high_deg);
}

TEST(a_fan_looks_within_its_opening_from_its_first_ping_on)
{
    start(0, 0, 0);
    CHECK(!at(0) && !at(180));
    ping(0, 32, -48, 48, 20, true);
    for (int deg = -40; deg <= 40; deg++)
        CHECK(at(deg));
    for (int deg = 50; deg <= 310; deg++)
        CHECK(!at(deg));
    CHECK(is_high(0, 10) && is_high(30, 10));
}

TEST(a_fan_of_more_than_half_a_circle_does_not_look_astern)
{
    start(0, 0, 0);
    for (int i = 0; i < 3; i++)
        ping(0, 64, -110, 110, 20, true);
    CHECK(at(100) && at(-100) && !at(180) && !at(125) && !at(-125));
}

TEST(a_head_may_look_anywhere_until_a_turn_is_over)
{
    start(0, 0, 0);
    for (int deg = -60; deg < 60; deg += 3)
        ping(0, 1, deg, deg, 25, deg == -60);
    CHECK(at(0) && at(180));
    ping(0, 1, 60, 60, 25, true);
    CHECK(at(0) && at(50) && at(-50) && !at(180) && !at(75) && !at(-75));
}

/* Beams of 3 degrees. */
TEST(a_lost_ping_is_no_gap_between_beams)
{
    static const struct {
        int step_deg, lost, turns;
        double gap_deg;
    } row[] = {{2, 0, 1, 0}, {3, 0, 1, 1.5}, {3, 1, 1, 1.5}, {6, 0, 1, 6}, {6, 1, 1, 6},
               {2, 1, 3, 0}, {6, 1, 2, 6},   {3, 0, 3, 1.5}, {6, 1, 3, 6}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings_looks looks;
        start(0, 0, 0);
        for (int turn = 0; turn < row[i].turns; turn++)
            for (int k = -5; k < 5; k++)
                if (k || !row[i].lost)
                    ping(0, 1, row[i].step_deg * k, row[i].step_deg * k, 25, k == -5);
        bearings_tell(&b, turn_ms, &looks);
        CHECK_NEAR(geo_deg(looks.gap_rad[0]), row[i].gap_deg, 1e-3, 0);
        CHECK(looks.first_turns == (row[i].turns < 3));
    }
}

TEST(a_head_passes_what_it_did_not_ping)
{
    start(0, 0, 0);
    for (int turn = 0; turn < 2; turn++)
        for (int deg = 0; deg < 360; deg += deg == 90 ? 60 : 3)
            ping(0, 1, deg, deg, 25, deg == 0);
    ping(0, 1, 0, 0, 25, true);
    for (int deg = 0; deg < 360; deg++)
        CHECK(at(deg));
}

/* It is as wide as it says. Where it is no wider than its edges, all of it counts. */
TEST(a_beam_that_stays_looks_where_it_points)
{
    static const struct {
        double wide_deg, edge_deg, half_deg;
    } row[] = {{30, 0, 15}, {30, 3, 11.5}, {40, 3, 16.5}, {200, 3, 96.5}, {9, 3, 1}, {5, 3, 2.5}, {3, 3, 1.5}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(0, 0, 30);
        wide_deg = row[i].wide_deg;
        fixed = true;
        edge_deg = row[i].edge_deg;
        for (int k = 0; k < 3; k++)
            ping(0, 1, 0, 0, 25, false);
        struct bearings_looks looks;
        bearings_tell(&b, turn_ms, &looks);
        CHECK(!looks.first_turns && !bearings_level(&looks, 0));
        for (double off = -180; off < 180; off += 0.25)
            if (fabs(fabs(off) - row[i].half_deg) > 1)
                CHECK(at(30 + off) == (fabs(off) < row[i].half_deg));
        CHECK(at(30));
    }
}

/* Of one sonar or of two: what lies between them is in none. */
TEST(beams_that_stay_apart_leave_open_what_lies_between)
{
    for (unsigned second = 0; second < 2; second++) {
        start(0, 0, 0);
        wide_deg = 30;
        fixed = true;
        for (int k = 0; k < 3; k++) {
            ping(0, second ? 1 : 2, -45, 45, 25, true);
            if (second)
                ping(1, 1, 45, 45, 25, true);
        }
        for (double deg = -180; deg < 180; deg += 0.25)
            if (fabs(fabs(fabs(deg) - 45) - 11.5) > 1)
                CHECK(at(deg) == (fabs(fabs(deg) - 45) < 11.5));
    }
}

TEST(a_beam_on_its_side_is_as_wide_as_it_is_high)
{
    start(90, 0, 0);
    wide_deg = 20;
    fixed = true;
    for (int k = 0; k < 3; k++)
        ping(0, 1, 0, 0, 60, true);
    CHECK(at(26) && at(-26) && !at(31) && !at(-31));
    CHECK(at_place(0, 8) && at_place(0, -8) && !at_place(0, 12) && !at_place(0, -12));
}

TEST(a_head_that_hears_little_above_and_below_level_shows_no_bearing)
{
    static const struct {
        double roll_deg, pitch_deg, high_deg;
        bool level;
    } row[] = {{0, 0, 25, true},  {0, 0, 9, false},   {0, 5, 25, true},
               {0, 9, 25, false}, {90, 0, 25, false}, {180, 0, 25, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(row[i].roll_deg, row[i].pitch_deg, 0);
        for (int turn = 0; turn < 3; turn++)
            for (int deg = -12; deg <= 12; deg += 3)
                ping(0, 1, deg, deg, row[i].high_deg, deg == -12);
        CHECK_INT(at(0), row[i].level);
    }
}

/* Beams side by side cover together what none of them does. Lower than two cells all of it counts. */
TEST(a_fan_looks_where_any_of_its_beams_does)
{
    static const struct {
        double roll_deg, pitch_deg, high_deg;
        int from_deg, to_deg; /* on its level */
        double up_deg;        /* there it looks ahead as well */
    } row[] = {{0, 0, 20, -44, 44, 8},  {20, 0, 20, -24, 24, 8}, {-20, 0, 20, -24, 24, -8},
               {45, 0, 20, -9, 9, 5},   {90, 0, 20, -6, 6, 40},  {0, 8, 20, -40, 40, 16},
               {0, 0, 1.5, -44, 44, 0}, {180, 0, 9, -44, 44, 3}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(row[i].roll_deg, row[i].pitch_deg, 0);
        wide_deg = 1.5;
        ping(0, 64, -48, 48, row[i].high_deg, true);
        for (int deg = row[i].from_deg; deg <= row[i].to_deg; deg++)
            CHECK(at(deg));
        CHECK(at_place(0, row[i].up_deg) && !at_place(0, row[i].up_deg > 0 ? 60 : -60) && !at(180));
    }
    start(0, 0, 0);
    ping(0, 64, -48, 48, 20, true);
    CHECK(!at_place(0, 12));
    mount.attitude[0] = 0; /* by another one it looks astern, and no more ahead */
    mount.attitude[3] = 1;
    ping(0, 64, -48, 48, 20, true);
    CHECK(at(180) && !at(0));
}

/* Until it has come round as well. */
TEST(a_head_on_another_mount_has_looked_nowhere)
{
    start(0, 0, 0);
    sweeps(0, 3, 20);
    CHECK(shows(0) && !at(180));
    quat_from_rpy(0, 0, geo_rad(180), mount.attitude);
    pose.t_ns += SECOND;
    ping(0, 1, -60, -60, 25, true);
    CHECK(!shows(0) && at(0) && at(180));
    sweeps(0, 3, 20);
    CHECK(shows(180) && !shows(0) && !at(0));
}

TEST(sensors_add_up_and_each_head_has_its_own_opening)
{
    start(0, 0, 0);
    ping(0, 32, -48, 48, 20, true);
    ping(1, 32, 60, 150, 12, true);
    CHECK(at(0) && at(100) && !at(200));
    CHECK(is_high(0, 10) && is_high(100, 6));
    sweeps(2, 1, 20); /* one in its first turn */
    CHECK(at(200));
    CHECK_NEAR(level_deg(2), 12.5, 1e-4, 0);
    for (int deg = 0; deg < 30; deg += 3)
        ping(3, 1, deg, deg, 14, deg == 0);
    CHECK_NEAR(level_deg(2), 12.5, 1e-4, 0);
    CHECK_NEAR(level_deg(3), 7, 1e-4, 0);
}

/* A single deaf beam is forgiven; two in a row are not, until a beam hears there again. */
static bool look_to(const struct bearings_looks *looks, double ahead_m, double right_m)
{
    const double at_m[3] = {ahead_m, right_m, 0};
    return bearings_look(looks, 0, at_m);
}

/* A head half a metre ahead of the middle that sweeps 60 degrees to each side, and one to the right of it. */
TEST(near_by_a_head_looks_elsewhere_than_far_away)
{
    struct bearings_looks looks = {.level_rad = {0.1, 0.1}, .place_m = {{0.5, 0, 0}, {0, 0.5, 0}}};
    for (int k = 0; k < 11; k++)
        looks.bearings[0] |= UINT64_C(1) << k | UINT64_C(1) << (63 - k);
    CHECK(look_to(&looks, 3, 3) && !look_to(&looks, 0.6, 0.6) && look_to(&looks, 1, 0.6));
    CHECK(!look_to(&looks, -1, 0) && !look_to(&looks, 0.4, 0) && look_to(&looks, 0.6, 0));
    const double right_m[3] = {2, 1, 0};
    CHECK(bearings_look(&looks, 0.1, right_m) && !bearings_look(&looks, 0.11, right_m));
    const double across_m[2][3] = {{1, 3, 0}, {1, -3, 0}}, aside_m[2][3] = {{0, 3, 0}, {0, 1, 0}};
    CHECK(bearings_pass(&looks, 0.1, across_m[0], across_m[1]) &&
          !bearings_pass(&looks, 0.11, across_m[0], across_m[1]));
    CHECK(!bearings_pass(&looks, 0, across_m[0], aside_m[0]) && !bearings_pass(&looks, 0, aside_m[0], aside_m[1]));
    looks.bearings[1] = UINT64_MAX & ~looks.bearings[0]; /* another one looks at the rest: there is no edge */
    CHECK(look_to(&looks, 0.6, 2) && look_to(&looks, -1, 0));
    for (int deg = 0; deg < 360; deg++)
        CHECK(look_to(&looks, 1e3 * cos(geo_rad(deg)), 1e3 * sin(geo_rad(deg))));
}

TEST(a_head_shows_nothing_where_it_is_deaf)
{
    static const struct {
        int from_deg, to_deg; /* deaf in the fourth turn */
        bool shown;
    } row[] = {{0, 0, true}, {3, 6, true}, {-12, 15, false}, {-60, 60, false}, {30, 60, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings_looks looks;
        start(0, 0, 0);
        for (int turn = 0; turn < 5; turn++) {
            for (int deg = -60; deg < 60; deg += 3) {
                state = turn == 3 && deg >= row[i].from_deg && deg < row[i].to_deg ? BEAM_BLIND : BEAM_SILENT;
                ping(0, 1, deg, deg, 25, deg == -60);
            }
            bearings_tell(&b, turn_ms, &looks);
            const bool shown = turn != 3 || row[i].shown;
            CHECK(shows(0) == shown);
            CHECK(bearings_have(bearings_level(&looks, 0), 0, 0)); /* it looks there all the same */
        }
    }
    start(0, 0, 0);
    state = BEAM_BLIND; /* from the start on */
    for (int turn = 0; turn < 3; turn++)
        for (int deg = -60; deg < 60; deg += 3)
            ping(0, 1, deg, deg, 25, deg == -60);
    CHECK(at(0) && !shows(0));
}

/* Parts of 5.6 degrees: a burst that leaves a beam of each part alone darkens none. */
TEST(a_burst_darkens_only_parts_in_which_no_beam_hears)
{
    static const struct {
        int from_deg, to_deg; /* deaf, in steps of a degree */
        bool dark;
    } row[] = {{7, 12, false}, {4, 10, false}, {6, 11, true}, {5, 12, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(0, 0, 0);
        for (int turn = 0; turn < 4; turn++)
            for (int deg = -60; deg < 60; deg++) {
                state = turn == 3 && deg >= row[i].from_deg && deg < row[i].to_deg ? BEAM_BLIND : BEAM_SILENT;
                ping(0, 1, deg + 0.5, deg + 0.5, 25, deg == -60);
            }
        CHECK(shows(8) == !row[i].dark);
    }
}

/* Something close by rings: what is behind it has an echo, and nothing is known to be free. */
TEST(a_beam_that_rings_shows_nothing_though_it_has_an_echo)
{
    start(0, 0, 0);
    for (int turn = 0; turn < 4; turn++)
        for (int deg = -60; deg < 60; deg += 3) {
            hides = turn == 3 ? BEAM_HIDES_RING : BEAM_HIDES_NOTHING;
            state = BEAM_ECHO;
            ping(0, 1, deg, deg, 25, deg == -60);
            if (turn == 2)
                CHECK(shows(0));
        }
    CHECK(!shows(0));
}

/* A head shows what it has heard for as long as its water is clear. After a silence it has to pass again. */
TEST(a_head_shows_what_it_heard_of_late)
{
    static const struct {
        double turn_s, silent_s;
        bool kept;
    } row[] = {{20, 0, true}, {20, 9, true}, {20, 26, false}, {20, 300, false}, {2, 27, true}, {2, 31, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(0, 0, 0);
        for (int turn = 0; turn < 5; turn++)
            for (int deg = -60; deg < 60; deg += 3) {
                if (turn == 3 && deg == 30)
                    pose.t_ns += (uint64_t)(row[i].silent_s * 1e9);
                pose.t_ns += (uint64_t)(row[i].turn_s / 40 * 1e9);
                ping(0, 1, deg, deg, 25, deg == -60);
                const bool gone = !row[i].kept && ((turn == 3 && deg >= 30) || (turn == 4 && deg < 6));
                if (turn > 0)
                    CHECK(shows(0) == !gone);
            }
    }
}

/* And it is asked when it pings no more. */
TEST(what_a_head_heard_grows_old_without_a_ping)
{
    struct bearings_looks looks;
    start(0, 0, 0);
    for (int turn = 0; turn < 3; turn++)
        for (int deg = -60; deg < 60; deg += 3) { /* in 20 s */
            pose.t_ns += SECOND / 2;
            ping(0, 1, deg, deg, 25, deg == -60);
        }
    bearings_tell(&b, turn_ms, &looks);
    for (int deg = -54; deg < 54; deg += 6)
        for (unsigned later_s = 1; later_s < 40; later_s++) {
            const uint64_t shown = bearings_of(&looks, 1, pose.t_ns + later_s * SECOND, KEEP_S);
            const double since_s = later_s + (57 - deg) / 3 * 0.5;
            if (fabs(since_s - KEEP_S) > 1.5) /* a part is as old as the beams in it */
                CHECK(bearings_have(shown, geo_rad(deg), 0) == (since_s < KEEP_S));
        }
}

TEST(the_age_of_what_a_head_heard_is_rounded_up_and_has_an_end)
{
    static const struct {
        double since_s, clear_for_s;
        bool kept;
    } row[] = {{0, 0, true},        {0.01, 0.05, false}, {0.01, 0.1, true}, {6553, 7000, true},
               {6554, 7000, false}, {1e6, 1e7, false},   {-5, 0.1, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings_looks looks;
        start(0, 0, 0);
        sweeps(0, 3, 0);
        const uint64_t heard_ns = pose.t_ns;
        pose.t_ns += (uint64_t)(int64_t)(row[i].since_s * 1e9);
        const uint64_t now_ns = pose.t_ns > heard_ns ? pose.t_ns : heard_ns;
        ping(1, 1, 90, 90, 25, true); /* of another sonar, whose clock may be late */
        bearings_tell(&b, turn_ms, &looks);
        CHECK((bearings_of(&looks, 1, now_ns, row[i].clear_for_s) != 0) == row[i].kept);
    }
}

TEST(of_two_heads_each_has_its_own_age)
{
    struct bearings_looks looks;
    start(0, 0, 0);
    sweeps(1, 3, 20);
    pose.t_ns += 8 * SECOND;
    sweeps(0, 2, 20);
    bearings_tell(&b, turn_ms, &looks);
    CHECK(bearings_have(bearings_of(&looks, 1, pose.t_ns, KEEP_S), 0, 0));
    CHECK(!bearings_have(bearings_of(&looks, 2, pose.t_ns, KEEP_S), 0, 0));
    turn_ms[0] = 20000;
    bearings_tell(&b, turn_ms, &looks);
    CHECK(!bearings_have(bearings_of(&looks, 2, pose.t_ns, KEEP_S), 0, 0));
    turn_ms[1] = 30000;
    bearings_tell(&b, turn_ms, &looks);
    CHECK(bearings_have(bearings_of(&looks, 2, pose.t_ns, KEEP_S), 0, 0));
}

/* Until it has come round again, though its turn is longer than water stays clear; but not if it was away. */
TEST(a_slow_head_shows_what_it_heard_for_its_own_turns)
{
    static const struct {
        double silent_s;  /* before it pings again */
        double asked_s;   /* so long after it heard at 0 degrees */
        uint32_t turn_ms; /* of this head, the other's is 200 s */
        bool shown;
    } row[] = {{0, 95, 60000, true}, {0, 131, 60000, true},  {0, 133, 60000, false}, {0, 40, 6000, false},
               {9, 95, 60000, true}, {11, 95, 60000, false}, {0, 40, 0, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings_looks looks;
        start(0, 0, 0);
        turn_ms[0] = row[i].turn_ms;
        turn_ms[1] = 200000;
        sweeps(0, 2, 60);
        pose.t_ns += (uint64_t)(row[i].silent_s * 1e9);
        ping(0, 1, -60, -60, 25, true);
        const uint64_t heard_ns = b.sensor[0].heard_ns[0];
        bearings_tell(&b, turn_ms, &looks);
        const uint64_t shown = bearings_of(&looks, 1, heard_ns + (uint64_t)(row[i].asked_s * 1e9), KEEP_S);
        CHECK((shown & 1) == row[i].shown);
    }
}

/* It steps over whole parts: it has passed them, but not those in the way back to where its sector begins. */
TEST(a_head_has_heard_where_it_passes_in_a_step)
{
    static const struct {
        int step_deg, from_deg;
        bool shown;
    } row[] = {{12, -60, true}, {25, -100, true}, {12, 24, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(0, 0, 0);
        for (int turn = 0; turn < 3; turn++)
            for (int k = 0; k < 9; k++) {
                const double deg = row[i].from_deg + row[i].step_deg * k;
                ping(0, 1, deg, deg, 25, k == 0);
            }
        CHECK(shows(0) == row[i].shown);
    }
}

/* Whatever lies between pings here and there. Its least step is a degree. */
TEST(what_a_head_jumps_over_it_has_not_heard)
{
    static const struct {
        int deg[6];                                      /* after the scan from -60 to -20 */
        int from_deg, to_deg;                            /* not heard */
    } row[] = {{{100, -21, 101, -22, 102, -23}, -8, 90}, /* to and fro */
               {{8, -21, 7, -22, 6, -23}, -12, -2},
               {{5, 15, 16, 17, 18, 19}, -12, 0}, /* on, and then in shorter ways */
               {{5, 20, 30, 31, 32, 33}, 7, 10},
               {{-19, -7, 5, 17, 29, 41}, -16, 30},   /* evenly */
               {{-19, -7, -6, -5, -4, -3}, -16, -12}, /* a few pings were lost */
               {{20, 60, 100, 140, 180, 220}, -8, 10}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(0, 0, 0);
        for (int turn = 0; turn < 3; turn++) {
            for (int deg = -60; deg <= -20; deg++)
                ping(0, 1, deg, deg, 25, deg == -60);
            for (int k = 0; k < 6; k++)
                ping(0, 1, row[i].deg[k], row[i].deg[k], 25, false);
        }
        for (int deg = row[i].from_deg; deg < row[i].to_deg; deg++)
            CHECK(!shows(deg));
    }
}

TEST(a_ping_that_is_always_lost_shows_nothing)
{
    start(0, 0, 0);
    for (int turn = 0; turn < 3; turn++)
        for (int deg = -90; deg <= 90; deg += 9)
            if (deg != 0)
                ping(0, 1, deg, deg, 25, deg == -90);
    for (int deg = -70; deg <= 70; deg++)
        if (abs(deg) < 4 || abs(deg) > 20)
            CHECK(shows(deg) == (deg < -4 || deg > 4));
}

TEST(a_deaf_pass_in_long_steps_shows_nothing)
{
    for (int step_deg = 6; step_deg <= 45; step_deg += 13) {
        start(0, 0, 0);
        for (int turn = 0; turn < 4; turn++) {
            state = turn == 3 ? BEAM_BLIND : BEAM_SILENT;
            for (int deg = -90; deg <= 90; deg += step_deg)
                ping(0, 1, deg, deg, 25, deg == -90);
            for (int deg = -30; deg <= 30; deg++)
                CHECK(shows(deg) == (turn < 3));
        }
    }
}

/* Its azimuth in double and in single precision differ. */
TEST(a_bearing_that_is_pinged_twice_is_no_step)
{
    start(0, 0, 0);
    for (int turn = 0; turn < 3; turn++)
        for (int deg = 180; deg <= 270; deg += 9) {
            ping(0, 1, deg, deg, 25, deg == 180);
            ping(0, 1, deg, deg, 25, false);
        }
    for (int deg = 190; deg <= 260; deg++)
        CHECK(shows(deg));
    CHECK_NEAR(geo_deg((double)b.sensor[0].step_rad), 9, 1e-5, 0);
}

TEST(a_set_has_the_bearings_within_so_much_of_one_and_a_part_more)
{
    const double part_deg = 360.0 / BEARINGS;
    for (int n = 1; n <= BEARINGS; n++) { /* parts, about north */
        const uint64_t set = n < BEARINGS ? (UINT64_C(1) << n) - 1 : UINT64_MAX;
        for (double az = 0.4; az < 360; az += 7)
            for (double within = 0; within < 180; within += 11) {
                const bool all = az - within - part_deg >= 0 && az + within + part_deg < n * part_deg;
                CHECK(bearings_have(set, geo_rad(az), geo_rad(within)) == (all || n == BEARINGS));
            }
    }
}

/* Which it is its driver says: no ping of theirs does. */
TEST(a_fan_that_begins_at_another_bearing_each_time_does_not_turn)
{
    start(0, 0, 0);
    for (int k = 0; k < 9; k++)
        ping(0, 32, -48 + k % 3, 48, 20, true);
    struct bearings_looks looks;
    bearings_tell(&b, turn_ms, &looks);
    CHECK(!bearings_level(&looks, 0) && !looks.first_turns && !looks.hears[0]);
    CHECK(at(0) && at(40) && at(-40) && !at(180));
}

TEST(a_head_that_waits_at_a_bearing_may_look_anywhere)
{
    start(0, 0, 0);
    for (int k = 0; k < 20; k++) {
        ping(0, 1, -60, -60, 25, k == 0);
        CHECK(at(0) && at(180));
    }
    sweeps(0, 1, 20);
    CHECK(at(0) && !at(180));
}

/* Beams that come later add to it; of others that are as wide as a reload says nothing is left. */
TEST(what_a_fan_covers_grows_with_its_beams_and_goes_with_their_width)
{
    start(0, 0, 0);
    for (int k = 0; k < 3; k++)
        ping(0, 16, -24, 24, 20, true);
    CHECK(!at(40));
    ping(0, 32, -48, 48, 20, true);
    ping(0, 16, -24, 24, 20, true);
    CHECK(at(40) && at(-40));
    fixed = true;
    wide_deg = 30;
    ping(1, 1, 180, 180, 20, true);
    CHECK(at(170) && at(190));
    wide_deg = 12;
    ping(1, 1, 180, 180, 20, true);
    CHECK(at(180) && !at(170) && !at(190));
    wide_deg = 40;
    ping(1, 1, 180, 180, 12, true);
    CHECK(at(170) && at(190) && is_high(180, 6));
    ping(1, 1, 180, 180, 30, true);
    CHECK(is_high(180, 15));
}

int main(void)
{
    RUN(a_fan_looks_within_its_opening_from_its_first_ping_on);
    RUN(a_fan_of_more_than_half_a_circle_does_not_look_astern);
    RUN(a_head_may_look_anywhere_until_a_turn_is_over);
    RUN(a_lost_ping_is_no_gap_between_beams);
    RUN(a_head_passes_what_it_did_not_ping);
    RUN(a_beam_that_stays_looks_where_it_points);
    RUN(a_head_that_hears_little_above_and_below_level_shows_no_bearing);
    RUN(a_fan_looks_where_any_of_its_beams_does);
    RUN(a_head_on_another_mount_has_looked_nowhere);
    RUN(sensors_add_up_and_each_head_has_its_own_opening);
    RUN(beams_that_stay_apart_leave_open_what_lies_between);
    RUN(a_beam_on_its_side_is_as_wide_as_it_is_high);
    RUN(near_by_a_head_looks_elsewhere_than_far_away);
    RUN(a_head_shows_nothing_where_it_is_deaf);
    RUN(a_burst_darkens_only_parts_in_which_no_beam_hears);
    RUN(a_beam_that_rings_shows_nothing_though_it_has_an_echo);
    RUN(a_head_shows_what_it_heard_of_late);
    RUN(what_a_head_heard_grows_old_without_a_ping);
    RUN(the_age_of_what_a_head_heard_is_rounded_up_and_has_an_end);
    RUN(of_two_heads_each_has_its_own_age);
    RUN(a_slow_head_shows_what_it_heard_for_its_own_turns);
    RUN(a_head_has_heard_where_it_passes_in_a_step);
    RUN(a_ping_that_is_always_lost_shows_nothing);
    RUN(a_deaf_pass_in_long_steps_shows_nothing);
    RUN(a_bearing_that_is_pinged_twice_is_no_step);
    RUN(what_a_head_jumps_over_it_has_not_heard);
    RUN(a_fan_that_begins_at_another_bearing_each_time_does_not_turn);
    RUN(a_head_that_waits_at_a_bearing_may_look_anywhere);
    RUN(what_a_fan_covers_grows_with_its_beams_and_goes_with_their_width);
    RUN(a_set_has_the_bearings_within_so_much_of_one_and_a_part_more);
    return test_end();
}
