/* SPDX-License-Identifier: MIT */
/* submarine.h - an ArduSub autopilot, system 7, whose messages a vehicle takes from START on. */
#ifndef SONARD_TEST_SUBMARINE_H
#define SONARD_TEST_SUBMARINE_H

#include "client/mavlink/mavlink_vehicle.h"
#include "test.h"

#define MS    1000000ull
#define S     1000000000ull
#define START (1000 * S)

static bool give(struct mavlink_vehicle *v, enum mavlink_id id, const void *content, uint64_t now_ns)
{
    struct mavlink_frame frame = {.message = mavlink_message(id), .system_id = 7, .component_id = 1};
    mavlink_pack(frame.message, content, frame.payload);
    return mavlink_vehicle_take(v, &frame, now_ns);
}

static void beat(struct mavlink_vehicle *v, uint64_t now_ns)
{
    const struct mavlink_heartbeat submarine = {.type = 12, .autopilot = 3, .mavlink_version = 3};
    CHECK(give(v, MAVLINK_HEARTBEAT, &submarine, now_ns));
}

/* At START, with its first heartbeat. */
static struct mavlink_vehicle vehicle_of(const struct mavlink_vehicle_conf *conf)
{
    struct mavlink_vehicle v;
    mavlink_vehicle_init(&v, conf);
    beat(&v, START);
    return v;
}

static inline struct mavlink_vehicle vehicle_at_start(void)
{
    const struct mavlink_vehicle_conf conf = {.barometer = 2, .surface_hpa = 1013.25, .density_kgpm3 = 1025};
    return vehicle_of(&conf);
}

#endif
