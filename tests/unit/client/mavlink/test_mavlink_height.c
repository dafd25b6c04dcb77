/* SPDX-License-Identifier: MIT */
/* The height above the bottom, by what the autopilot passes on of its altimeter. */
#include <math.h>

#include "tests/lib/submarine.h"

static struct mavlink_vehicle vehicle_that(bool told_below)
{
    return vehicle_of(&(struct mavlink_vehicle_conf){.density_kgpm3 = 1025, .told_below = told_below});
}

/* The height of the pose that goes out 100 ms after the start; -1: it has none. The vehicle is rolled. */
static double height(struct mavlink_vehicle *v, float roll, enum mavlink_id id, const void *content)
{
    const uint64_t now_ns = START + 100 * MS;
    const struct mavlink_attitude attitude = {.time_boot_ms = 5100, .roll = roll};
    struct mavlink_pose pose = {0};
    CHECK(give(v, MAVLINK_ATTITUDE, &attitude, now_ns));
    CHECK(give(v, id, content, now_ns));
    CHECK(mavlink_vehicle_pose(v, now_ns, &pose));
    return pose.has & MAVLINK_POSE_ALTITUDE ? pose.altitude_m : -1;
}

/* As ArduSub sends it: 2.5 m below. */
static const struct mavlink_distance_sensor below = {.time_boot_ms = 5100,
                                                     .min_distance = 20,
                                                     .max_distance = 5000,
                                                     .current_distance = 250,
                                                     .type = MAVLINK_SENSOR_ULTRASOUND,
                                                     .orientation = MAVLINK_ORIENTATION_DOWN};

TEST(an_altimeter_is_believed_as_far_as_it_ranges_downward)
{
    static const struct {
        const char *name;
        uint16_t cm;
        uint8_t orientation, quality;
        float roll;
        double height_m;
    } rows[] = {
        {"level", 250, 25, 0, 0, 2.5},
        {"of the best quality", 250, 25, 100, 0, 2.5},
        {"tilted: less than along its axis", 250, 25, 0, 0.5f, 2.5 * 0.87758},
        {"on its side: it ranges to a wall", 250, 25, 0, 1.2f, -1},
        {"no echo, said by the quality", 250, 25, 1, 0, -1},
        {"no echo, said by the range", 5000, 25, 0, 0, -1},
        {"beyond its range", 5001, 25, 0, 0, -1},
        {"nearer than it hears", 20, 25, 0, 0, -1},
        {"forward", 250, 0, 0, 0, -1},
        {"upward", 250, 24, 0, 0, -1},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct mavlink_vehicle v = vehicle_that(false);
        struct mavlink_distance_sensor m = below;
        m.current_distance = rows[i].cm;
        m.orientation = rows[i].orientation;
        m.signal_quality = rows[i].quality;

        const double height_m = height(&v, rows[i].roll, MAVLINK_DISTANCE_SENSOR, &m);

        if (fabs(height_m - rows[i].height_m) > 1e-4)
            printf("%s:\n", rows[i].name);
        CHECK_NEAR(height_m, rows[i].height_m, 0, 1e-4);
    }
}

TEST(a_clearance_counts_while_there_is_one)
{
    static const struct {
        float clearance_m;
        double height_m;
    } rows[] = {{3.25f, 3.25}, {-1, -1}, {0, -1}, {NAN, -1}, {INFINITY, -1}};

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct mavlink_vehicle v = vehicle_that(false);
        const struct mavlink_altitude_message m = {.time_usec = 5100000, .bottom_clearance = rows[i].clearance_m};
        CHECK_NEAR(height(&v, 0.5f, MAVLINK_ALTITUDE, &m), rows[i].height_m, 0, 1e-6);
    }
}

TEST(of_two_altimeters_the_lower_counts)
{
    struct mavlink_vehicle v = vehicle_that(false);
    const struct mavlink_altitude_message higher = {.time_usec = 5090000, .bottom_clearance = 3};
    struct mavlink_distance_sensor lower = below;
    lower.current_distance = 200;
    height(&v, 0, MAVLINK_HEARTBEAT, &(struct mavlink_heartbeat){.type = 12, .autopilot = 3});
    give(&v, MAVLINK_DISTANCE_SENSOR, &lower, START + 150 * MS);
    give(&v, MAVLINK_ALTITUDE, &higher, START + 150 * MS);
    CHECK_NEAR(v.next.altitude_m, 2, 0, 1e-9);
}

/* With --downward the autopilot passes the bridge's own ranges on. */
TEST(what_the_bridge_sent_itself_is_no_altimeter)
{
    struct mavlink_vehicle v = vehicle_that(true);
    const struct mavlink_altitude_message fused = {.time_usec = 5100000, .bottom_clearance = 2.5f};
    CHECK_NEAR(height(&v, 0, MAVLINK_DISTANCE_SENSOR, &below), -1, 0, 0);
    v = vehicle_that(true);
    CHECK_NEAR(height(&v, 0, MAVLINK_ALTITUDE, &fused), -1, 0, 0);
}

/* Without an attitude nobody knows where the altimeter points. */
TEST(no_attitude_no_height)
{
    struct mavlink_vehicle v = vehicle_that(false);
    CHECK(give(&v, MAVLINK_DISTANCE_SENSOR, &below, START + 100 * MS));
    CHECK_INT(v.next.has, 0);
}

int main(void)
{
    RUN(an_altimeter_is_believed_as_far_as_it_ranges_downward);
    RUN(a_clearance_counts_while_there_is_one);
    RUN(of_two_altimeters_the_lower_counts);
    RUN(what_the_bridge_sent_itself_is_no_altimeter);
    RUN(no_attitude_no_height);
    return test_end();
}
