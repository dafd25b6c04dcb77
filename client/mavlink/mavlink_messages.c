/* SPDX-License-Identifier: MIT */
#include "mavlink_messages.h"

#include <string.h>

#define FIELD(message, member, type)                                                                              \
    {                                                                                                             \
#member, type, 0, 0, offsetof(struct mavlink_##message, member)                                           \
    }
#define ARRAY(message, member, type, n)                                                                           \
    {                                                                                                             \
#member, type, n, 0, offsetof(struct mavlink_##message, member)                                           \
    }
#define EXTRA(message, member, type)                                                                              \
    {                                                                                                             \
#member, type, 0, 1, offsetof(struct mavlink_##message, member)                                           \
    }
#define EXTRA_ARRAY(message, member, type, n)                                                                     \
    {                                                                                                             \
#member, type, n, 1, offsetof(struct mavlink_##message, member)                                           \
    }
#define PARAM(i)                                                                                                  \
    {                                                                                                             \
        "param" #i, MAVLINK_F32, 0, 0, offsetof(struct mavlink_command_long, param[i - 1])                        \
    }

static const struct mavlink_field heartbeat[] = {
    FIELD(heartbeat, custom_mode, MAVLINK_U32),
    FIELD(heartbeat, type, MAVLINK_U8),
    FIELD(heartbeat, autopilot, MAVLINK_U8),
    FIELD(heartbeat, base_mode, MAVLINK_U8),
    FIELD(heartbeat, system_status, MAVLINK_U8),
    FIELD(heartbeat, mavlink_version, MAVLINK_U8),
    {0},
};

static const struct mavlink_field system_time[] = {
    FIELD(system_time, time_unix_usec, MAVLINK_U64),
    FIELD(system_time, time_boot_ms, MAVLINK_U32),
    {0},
};

static const struct mavlink_field attitude[] = {
    FIELD(attitude, time_boot_ms, MAVLINK_U32), FIELD(attitude, roll, MAVLINK_F32),
    FIELD(attitude, pitch, MAVLINK_F32),        FIELD(attitude, yaw, MAVLINK_F32),
    FIELD(attitude, rollspeed, MAVLINK_F32),    FIELD(attitude, pitchspeed, MAVLINK_F32),
    FIELD(attitude, yawspeed, MAVLINK_F32),     {0},
};

static const struct mavlink_field attitude_quaternion[] = {
    FIELD(attitude_quaternion, time_boot_ms, MAVLINK_U32),
    FIELD(attitude_quaternion, q1, MAVLINK_F32),
    FIELD(attitude_quaternion, q2, MAVLINK_F32),
    FIELD(attitude_quaternion, q3, MAVLINK_F32),
    FIELD(attitude_quaternion, q4, MAVLINK_F32),
    FIELD(attitude_quaternion, rollspeed, MAVLINK_F32),
    FIELD(attitude_quaternion, pitchspeed, MAVLINK_F32),
    FIELD(attitude_quaternion, yawspeed, MAVLINK_F32),
    {0},
};

static const struct mavlink_field local_position_ned[] = {
    FIELD(local_position_ned, time_boot_ms, MAVLINK_U32),
    FIELD(local_position_ned, x, MAVLINK_F32),
    FIELD(local_position_ned, y, MAVLINK_F32),
    FIELD(local_position_ned, z, MAVLINK_F32),
    FIELD(local_position_ned, vx, MAVLINK_F32),
    FIELD(local_position_ned, vy, MAVLINK_F32),
    FIELD(local_position_ned, vz, MAVLINK_F32),
    {0},
};

static const struct mavlink_field global_position_int[] = {
    FIELD(global_position_int, time_boot_ms, MAVLINK_U32), FIELD(global_position_int, lat, MAVLINK_I32),
    FIELD(global_position_int, lon, MAVLINK_I32),          FIELD(global_position_int, alt, MAVLINK_I32),
    FIELD(global_position_int, relative_alt, MAVLINK_I32), FIELD(global_position_int, vx, MAVLINK_I16),
    FIELD(global_position_int, vy, MAVLINK_I16),           FIELD(global_position_int, vz, MAVLINK_I16),
    FIELD(global_position_int, hdg, MAVLINK_U16),          {0},
};

static const struct mavlink_field param_request_read[] = {
    FIELD(param_request_read, param_index, MAVLINK_I16),
    FIELD(param_request_read, target_system, MAVLINK_U8),
    FIELD(param_request_read, target_component, MAVLINK_U8),
    ARRAY(param_request_read, param_id, MAVLINK_CHAR, MAVLINK_PARAM_ID),
    {0},
};

static const struct mavlink_field param_value[] = {
    FIELD(param_value, param_value, MAVLINK_F32), FIELD(param_value, param_count, MAVLINK_U16),
    FIELD(param_value, param_index, MAVLINK_U16), ARRAY(param_value, param_id, MAVLINK_CHAR, MAVLINK_PARAM_ID),
    FIELD(param_value, param_type, MAVLINK_U8),   {0},
};

#define SERVO(i)                                                                                                  \
    {                                                                                                             \
        "servo" #i "_raw", MAVLINK_U16, 0, (i) > 8, offsetof(struct mavlink_servo_output_raw, servo[(i)-1])       \
    }

static const struct mavlink_field servo_output_raw[] = {
    FIELD(servo_output_raw, time_usec, MAVLINK_U32),
    SERVO(1),
    SERVO(2),
    SERVO(3),
    SERVO(4),
    SERVO(5),
    SERVO(6),
    SERVO(7),
    SERVO(8),
    FIELD(servo_output_raw, port, MAVLINK_U8),
    SERVO(9),
    SERVO(10),
    SERVO(11),
    SERVO(12),
    SERVO(13),
    SERVO(14),
    SERVO(15),
    SERVO(16),
    {0},
};

static const struct mavlink_field vfr_hud[] = {
    FIELD(vfr_hud, airspeed, MAVLINK_F32),
    FIELD(vfr_hud, groundspeed, MAVLINK_F32),
    FIELD(vfr_hud, alt, MAVLINK_F32),
    FIELD(vfr_hud, climb, MAVLINK_F32),
    FIELD(vfr_hud, heading, MAVLINK_I16),
    FIELD(vfr_hud, throttle, MAVLINK_U16),
    {0},
};

static const struct mavlink_field command_long[] = {
    PARAM(1),
    PARAM(2),
    PARAM(3),
    PARAM(4),
    PARAM(5),
    PARAM(6),
    PARAM(7),
    FIELD(command_long, command, MAVLINK_U16),
    FIELD(command_long, target_system, MAVLINK_U8),
    FIELD(command_long, target_component, MAVLINK_U8),
    FIELD(command_long, confirmation, MAVLINK_U8),
    {0},
};

static const struct mavlink_field timesync[] = {
    FIELD(timesync, tc1, MAVLINK_I64),
    FIELD(timesync, ts1, MAVLINK_I64),
    EXTRA(timesync, target_system, MAVLINK_U8),
    EXTRA(timesync, target_component, MAVLINK_U8),
    {0},
};

static const struct mavlink_field distance_sensor[] = {
    FIELD(distance_sensor, time_boot_ms, MAVLINK_U32),
    FIELD(distance_sensor, min_distance, MAVLINK_U16),
    FIELD(distance_sensor, max_distance, MAVLINK_U16),
    FIELD(distance_sensor, current_distance, MAVLINK_U16),
    FIELD(distance_sensor, type, MAVLINK_U8),
    FIELD(distance_sensor, id, MAVLINK_U8),
    FIELD(distance_sensor, orientation, MAVLINK_U8),
    FIELD(distance_sensor, covariance, MAVLINK_U8),
    EXTRA(distance_sensor, horizontal_fov, MAVLINK_F32),
    EXTRA(distance_sensor, vertical_fov, MAVLINK_F32),
    EXTRA_ARRAY(distance_sensor, quaternion, MAVLINK_F32, 4),
    EXTRA(distance_sensor, signal_quality, MAVLINK_U8),
    {0},
};

static const struct mavlink_field scaled_pressure[] = {
    FIELD(scaled_pressure, time_boot_ms, MAVLINK_U32),
    FIELD(scaled_pressure, press_abs, MAVLINK_F32),
    FIELD(scaled_pressure, press_diff, MAVLINK_F32),
    FIELD(scaled_pressure, temperature, MAVLINK_I16),
    {0},
};

static const struct mavlink_field altitude_message[] = {
    FIELD(altitude_message, time_usec, MAVLINK_U64),
    FIELD(altitude_message, altitude_monotonic, MAVLINK_F32),
    FIELD(altitude_message, altitude_amsl, MAVLINK_F32),
    FIELD(altitude_message, altitude_local, MAVLINK_F32),
    FIELD(altitude_message, altitude_relative, MAVLINK_F32),
    FIELD(altitude_message, altitude_terrain, MAVLINK_F32),
    FIELD(altitude_message, bottom_clearance, MAVLINK_F32),
    {0},
};

static const struct mavlink_field ahrs2[] = {
    FIELD(ahrs2, roll, MAVLINK_F32),
    FIELD(ahrs2, pitch, MAVLINK_F32),
    FIELD(ahrs2, yaw, MAVLINK_F32),
    FIELD(ahrs2, altitude, MAVLINK_F32),
    FIELD(ahrs2, lat, MAVLINK_I32),
    FIELD(ahrs2, lng, MAVLINK_I32),
    {0},
};

static const struct mavlink_field ekf_status_report[] = {
    FIELD(ekf_status_report, velocity_variance, MAVLINK_F32),
    FIELD(ekf_status_report, pos_horiz_variance, MAVLINK_F32),
    FIELD(ekf_status_report, pos_vert_variance, MAVLINK_F32),
    FIELD(ekf_status_report, compass_variance, MAVLINK_F32),
    FIELD(ekf_status_report, terrain_alt_variance, MAVLINK_F32),
    FIELD(ekf_status_report, flags, MAVLINK_U16),
    EXTRA(ekf_status_report, airspeed_variance, MAVLINK_F32),
    {0},
};

static const struct mavlink_field estimator_status[] = {
    FIELD(estimator_status, time_usec, MAVLINK_U64),
    FIELD(estimator_status, vel_ratio, MAVLINK_F32),
    FIELD(estimator_status, pos_horiz_ratio, MAVLINK_F32),
    FIELD(estimator_status, pos_vert_ratio, MAVLINK_F32),
    FIELD(estimator_status, mag_ratio, MAVLINK_F32),
    FIELD(estimator_status, hagl_ratio, MAVLINK_F32),
    FIELD(estimator_status, tas_ratio, MAVLINK_F32),
    FIELD(estimator_status, pos_horiz_accuracy, MAVLINK_F32),
    FIELD(estimator_status, pos_vert_accuracy, MAVLINK_F32),
    FIELD(estimator_status, flags, MAVLINK_U16),
    {0},
};

static const struct mavlink_field statustext[] = {
    FIELD(statustext, severity, MAVLINK_U8),
    ARRAY(statustext, text, MAVLINK_CHAR, 50),
    EXTRA(statustext, id, MAVLINK_U16),
    EXTRA(statustext, chunk_seq, MAVLINK_U8),
    {0},
};

static const struct mavlink_field obstacle_distance[] = {
    FIELD(obstacle_distance, time_usec, MAVLINK_U64),
    ARRAY(obstacle_distance, distances, MAVLINK_U16, MAVLINK_SECTORS),
    FIELD(obstacle_distance, min_distance, MAVLINK_U16),
    FIELD(obstacle_distance, max_distance, MAVLINK_U16),
    FIELD(obstacle_distance, sensor_type, MAVLINK_U8),
    FIELD(obstacle_distance, increment, MAVLINK_U8),
    EXTRA(obstacle_distance, increment_f, MAVLINK_F32),
    EXTRA(obstacle_distance, angle_offset, MAVLINK_F32),
    EXTRA(obstacle_distance, frame, MAVLINK_U8),
    {0},
};

static const struct mavlink_field obstacle_distance_3d[] = {
    FIELD(obstacle_distance_3d, time_boot_ms, MAVLINK_U32),
    FIELD(obstacle_distance_3d, x, MAVLINK_F32),
    FIELD(obstacle_distance_3d, y, MAVLINK_F32),
    FIELD(obstacle_distance_3d, z, MAVLINK_F32),
    FIELD(obstacle_distance_3d, min_distance, MAVLINK_F32),
    FIELD(obstacle_distance_3d, max_distance, MAVLINK_F32),
    FIELD(obstacle_distance_3d, obstacle_id, MAVLINK_U16),
    FIELD(obstacle_distance_3d, sensor_type, MAVLINK_U8),
    FIELD(obstacle_distance_3d, frame, MAVLINK_U8),
    {0},
};

const struct mavlink_message mavlink_messages[] = {
    {MAVLINK_HEARTBEAT, "HEARTBEAT", 50, 9, heartbeat},
    {MAVLINK_SYSTEM_TIME, "SYSTEM_TIME", 137, 12, system_time},
    {MAVLINK_PARAM_REQUEST_READ, "PARAM_REQUEST_READ", 214, 20, param_request_read},
    {MAVLINK_PARAM_VALUE, "PARAM_VALUE", 220, 25, param_value},
    {MAVLINK_SCALED_PRESSURE, "SCALED_PRESSURE", 115, 14, scaled_pressure},
    {MAVLINK_ATTITUDE, "ATTITUDE", 39, 28, attitude},
    {MAVLINK_ATTITUDE_QUATERNION, "ATTITUDE_QUATERNION", 246, 32, attitude_quaternion},
    {MAVLINK_LOCAL_POSITION_NED, "LOCAL_POSITION_NED", 185, 28, local_position_ned},
    {MAVLINK_GLOBAL_POSITION_INT, "GLOBAL_POSITION_INT", 104, 28, global_position_int},
    {MAVLINK_SERVO_OUTPUT_RAW, "SERVO_OUTPUT_RAW", 222, 37, servo_output_raw},
    {MAVLINK_VFR_HUD, "VFR_HUD", 20, 20, vfr_hud},
    {MAVLINK_COMMAND_LONG, "COMMAND_LONG", 152, 33, command_long},
    {MAVLINK_TIMESYNC, "TIMESYNC", 34, 18, timesync},
    {MAVLINK_DISTANCE_SENSOR, "DISTANCE_SENSOR", 85, 39, distance_sensor},
    {MAVLINK_SCALED_PRESSURE2, "SCALED_PRESSURE2", 195, 14, scaled_pressure},
    {MAVLINK_ALTITUDE, "ALTITUDE", 47, 32, altitude_message},
    {MAVLINK_SCALED_PRESSURE3, "SCALED_PRESSURE3", 131, 14, scaled_pressure},
    {MAVLINK_AHRS2, "AHRS2", 47, 24, ahrs2},
    {MAVLINK_EKF_STATUS_REPORT, "EKF_STATUS_REPORT", 71, 26, ekf_status_report},
    {MAVLINK_ESTIMATOR_STATUS, "ESTIMATOR_STATUS", 163, 42, estimator_status},
    {MAVLINK_STATUSTEXT, "STATUSTEXT", 83, 54, statustext},
    {MAVLINK_OBSTACLE_DISTANCE, "OBSTACLE_DISTANCE", 23, 167, obstacle_distance},
    {MAVLINK_OBSTACLE_DISTANCE_3D, "OBSTACLE_DISTANCE_3D", 130, 28, obstacle_distance_3d},
};
const size_t mavlink_message_count = sizeof mavlink_messages / sizeof *mavlink_messages;

const struct mavlink_message *mavlink_message(uint32_t id)
{
    for (size_t i = 0; i < mavlink_message_count; i++)
        if (mavlink_messages[i].id == id)
            return &mavlink_messages[i];
    return NULL;
}

size_t mavlink_type_size(enum mavlink_type type)
{
    static const uint8_t size[] = {
        [MAVLINK_U8] = 1,  [MAVLINK_CHAR] = 1, [MAVLINK_U16] = 2, [MAVLINK_I16] = 2, [MAVLINK_U32] = 4,
        [MAVLINK_I32] = 4, [MAVLINK_F32] = 4,  [MAVLINK_U64] = 8, [MAVLINK_I64] = 8,
    };
    return size[type];
}

/* Values are little endian on the wire, and in the machine's own order in the struct. */
static void copy_value(size_t size, const void *from, void *to)
{
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    memcpy(to, from, size);
#else
    for (size_t i = 0; i < size; i++)
        ((uint8_t *)to)[i] = ((const uint8_t *)from)[size - 1 - i];
#endif
}

void mavlink_pack(const struct mavlink_message *message, const void *from, uint8_t *payload)
{
    for (const struct mavlink_field *f = message->fields; f->name; f++) {
        const size_t size = mavlink_type_size(f->type);
        for (size_t i = 0; i < (f->count ? f->count : 1u); i++, payload += size)
            copy_value(size, (const char *)from + f->member + i * size, payload);
    }
}

void mavlink_unpack(const struct mavlink_message *message, const uint8_t *payload, void *to)
{
    for (const struct mavlink_field *f = message->fields; f->name; f++) {
        const size_t size = mavlink_type_size(f->type);
        for (size_t i = 0; i < (f->count ? f->count : 1u); i++, payload += size)
            copy_value(size, payload, (char *)to + f->member + i * size);
    }
}
