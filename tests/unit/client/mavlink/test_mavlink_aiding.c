/* SPDX-License-Identifier: MIT */
/* What of an autopilot's position is believed, by what its estimator says of itself. */
#include "client/mavlink/mavlink_vehicle.h"
#include "tests/lib/submarine.h"
#include "tests/lib/test.h"

static unsigned place_at(struct mavlink_vehicle *v, uint64_t ms, float north_m)
{
    const uint64_t now_ns = START + ms * MS;
    const struct mavlink_local_position_ned m = {
        .time_boot_ms = 100000 + (uint32_t)ms, .x = north_m, .y = 2, .z = 3, .vx = 0.5f};
    const struct mavlink_attitude level = {.time_boot_ms = 100000 + (uint32_t)ms};
    struct mavlink_pose pose = {0};
    beat(v, now_ns);
    give(v, MAVLINK_LOCAL_POSITION_NED, &m, now_ns);
    give(v, MAVLINK_ATTITUDE, &level, now_ns);
    CHECK(mavlink_vehicle_pose(v, now_ns, &pose));
    CHECK(pose.has & MAVLINK_POSE_ATTITUDE);
    return pose.has & (MAVLINK_POSE_POSITION | MAVLINK_POSE_VELOCITY);
}

/* As measured: never the same twice. */
static unsigned place(struct mavlink_vehicle *v, uint64_t ms)
{
    return place_at(v, ms, 1 + (float)ms * 1e-3f);
}

/* The alert of a lost position must not hang on who looks when: one that was believed for one message was believed. */
TEST(a_position_believed_once_is_remembered)
{
    struct mavlink_vehicle v = vehicle_at_start();
    const struct mavlink_ekf_status_report aided = {.flags = 831}, constant = {.flags = 167};
    give(&v, MAVLINK_EKF_STATUS_REPORT, &constant, START);
    CHECK(place(&v, 50) == 0 && !v.aiding.believed_ever);
    give(&v, MAVLINK_EKF_STATUS_REPORT, &aided, START + 3100 * MS);
    CHECK(place(&v, 3150) != 0);
    give(&v, MAVLINK_EKF_STATUS_REPORT, &constant, START + 3160 * MS);
    CHECK(place(&v, 3200) == 0 && v.aiding.position == MAVLINK_POSITION_UNAIDED && v.aiding.believed_ever);
}

TEST(what_the_estimator_confirms_is_believed)
{
    static const unsigned both = MAVLINK_POSE_POSITION | MAVLINK_POSE_VELOCITY;
    static const struct {
        const char *name;
        uint16_t flags;
        unsigned has;
    } rows[] = {
        {"aided by GPS, as recorded", 831, both},
        {"relative only, as by a DVL", 0x2F, both},
        {"absolute only", 0x37, both},
        {"constant, as recorded", 167, 0},
        {"constant, although the bits are there", 831 | 0x80, 0},
        {"not aided", 0x27, MAVLINK_POSE_VELOCITY},
        {"predicted bits only", 0x327, MAVLINK_POSE_VELOCITY},
        {"no horizontal velocity", 831 & ~2, MAVLINK_POSE_POSITION},
        {"no vertical velocity", 831 & ~4, MAVLINK_POSE_POSITION},
        {"uninitialised", 0x400, 0},
        {"nothing", 0, 0},
    };

    for (size_t i = 0; i < 2 * (sizeof rows / sizeof *rows); i++) {
        struct mavlink_vehicle v = vehicle_at_start();
        const uint16_t flags = rows[i / 2].flags;
        const struct mavlink_ekf_status_report ekf = {.flags = flags, .airspeed_variance = 1};
        const struct mavlink_estimator_status estimator = {.flags = flags, .time_usec = 1};
        if (i % 2)
            give(&v, MAVLINK_ESTIMATOR_STATUS, &estimator, START);
        else
            give(&v, MAVLINK_EKF_STATUS_REPORT, &ekf, START);
        const unsigned has = place(&v, 100);

        if (has != rows[i / 2].has)
            printf("# %s\n", rows[i / 2].name);
        CHECK_INT(has, rows[i / 2].has);
        CHECK_INT(v.unaided, !(has & MAVLINK_POSE_POSITION));
    }
}

TEST(a_report_that_has_stopped_confirms_nothing)
{
    struct mavlink_vehicle v = vehicle_at_start();
    const struct mavlink_ekf_status_report aided = {.flags = 831};
    char text[300];
    give(&v, MAVLINK_EKF_STATUS_REPORT, &aided, START);
    CHECK(place(&v, 2900) != 0);
    CHECK(mavlink_aiding_news(&v.aiding, START + 3 * S, text, sizeof text) && strstr(text, "it is measured"));
    CHECK(place(&v, 3100) == 0 && mavlink_aiding_wanted(&v.aiding, START + 3100 * MS));
    for (uint64_t s = 4; s <= 60; s++)
        CHECK(place(&v, s * 1000) == 0); /* however long it is silent */
    CHECK(mavlink_aiding_news(&v.aiding, START + 60 * S, text, sizeof text) && strstr(text, "stopped"));
    CHECK(!mavlink_aiding_news(&v.aiding, START + 61 * S, text, sizeof text));
    give(&v, MAVLINK_EKF_STATUS_REPORT, &aided, START + 62 * S);
    CHECK(place(&v, 62500) != 0);
}

/* As of an estimator that wavers, or of two under one system id. */
TEST(reports_that_contradict_each_other_confirm_nothing)
{
    static const uint64_t every_ms[] = {100, 200, 1000};
    for (size_t i = 0; i < sizeof every_ms / sizeof *every_ms; i++) {
        struct mavlink_vehicle v = vehicle_at_start();
        const uint64_t step_ms = every_ms[i];
        uint64_t ms = 0;
        for (unsigned k = 0; ms < 10000; ms += step_ms, k++) {
            const struct mavlink_ekf_status_report report = {.flags = k % 2 ? 831 : 167};
            give(&v, MAVLINK_EKF_STATUS_REPORT, &report, START + ms * MS);
            CHECK_INT(place(&v, ms + 50), 0);
        }
        for (const uint64_t end_ms = ms + 4000; ms < end_ms; ms += step_ms) {
            const struct mavlink_ekf_status_report aided = {.flags = 831};
            give(&v, MAVLINK_EKF_STATUS_REPORT, &aided, START + ms * MS);
        }
        CHECK(place(&v, ms) != 0); /* it has made up its mind */
    }
}

TEST(an_autopilot_that_cannot_report_is_believed_after_two_requests)
{
    struct mavlink_vehicle v = vehicle_at_start();
    char text[300];
    for (uint64_t ms = 0; ms < 20000; ms += 500) {
        CHECK((place(&v, ms) != 0) == (ms >= 12000));
        CHECK(mavlink_aiding_wanted(&v.aiding, START + ms * MS));
        CHECK(mavlink_aiding_news(&v.aiding, START + ms * MS, text, sizeof text) == (ms == 12000));
    }
    CHECK(strstr(text, "believed without a report"));
}

TEST(a_position_that_never_changes_is_not_believed_without_a_report)
{
    const struct mavlink_ekf_status_report aided = {.flags = 831};
    struct mavlink_vehicle v = vehicle_at_start();
    char text[300];
    for (uint64_t ms = 0; ms < 20000; ms += 500)
        CHECK_INT(place_at(&v, ms, 0), 0);
    CHECK(mavlink_aiding_news(&v.aiding, START + 20 * S, text, sizeof text) &&
          strstr(text, "does not change at all"));
    for (uint64_t ms = 20000; ms < 30000; ms += 500) /* it moves, and is held from 25 s on */
        CHECK((place_at(&v, ms, ms < 25000 ? (float)ms : 25000) != 0) == (ms < 28000));
    give(&v, MAVLINK_EKF_STATUS_REPORT, &aided, START + 30 * S);
    CHECK(place_at(&v, 30000, 25000) != 0); /* it is measured, says the estimator */
}

/* A depth is measured, whatever becomes of the position. */
TEST(without_a_measured_position_the_depth_is_the_barometers)
{
    struct mavlink_vehicle v = vehicle_at_start();
    const struct mavlink_ekf_status_report constant = {.flags = 167};
    const struct mavlink_scaled_pressure pressure = {.time_boot_ms = 100200, .press_abs = 2013.25f};
    const struct mavlink_attitude level = {.time_boot_ms = 100220};
    struct mavlink_pose pose;
    give(&v, MAVLINK_EKF_STATUS_REPORT, &constant, START);
    CHECK_INT(place(&v, 100), 0);
    give(&v, MAVLINK_SCALED_PRESSURE2, &pressure, START + 200 * MS);
    give(&v, MAVLINK_ATTITUDE, &level, START + 220 * MS);
    CHECK(mavlink_vehicle_pose(&v, START + 220 * MS, &pose));
    CHECK_INT(pose.has, MAVLINK_POSE_ATTITUDE | MAVLINK_POSE_DEPTH);
    CHECK_NEAR(pose.depth_m, 9.948, 1e-3, 0);
}

int main(void)
{
    RUN(a_position_believed_once_is_remembered);
    RUN(what_the_estimator_confirms_is_believed);
    RUN(a_report_that_has_stopped_confirms_nothing);
    RUN(reports_that_contradict_each_other_confirm_nothing);
    RUN(an_autopilot_that_cannot_report_is_believed_after_two_requests);
    RUN(a_position_that_never_changes_is_not_believed_without_a_report);
    RUN(without_a_measured_position_the_depth_is_the_barometers);
    return test_end();
}
