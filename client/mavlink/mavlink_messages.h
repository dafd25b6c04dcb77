/* SPDX-License-Identifier: MIT */
/*
 * mavlink_messages - the MAVLink messages that the bridge takes and sends, as C structs, and the tables that say how
 * they lie in a payload. Pure. Knows no framing.
 *
 * Units are the wire's own; they stand in the comments. Source: the message definitions common.xml and
 * ardupilotmega.xml.
 */
#ifndef SONARD_MAVLINK_MESSAGES_H
#define SONARD_MAVLINK_MESSAGES_H

#include <stddef.h>
#include <stdint.h>

#define MAVLINK_PAYLOAD_MAX 255
#define MAVLINK_SECTORS     72

enum mavlink_id {
    MAVLINK_HEARTBEAT = 0,
    MAVLINK_SYSTEM_TIME = 2,
    MAVLINK_PARAM_REQUEST_READ = 20,
    MAVLINK_PARAM_VALUE = 22,
    MAVLINK_SCALED_PRESSURE = 29,
    MAVLINK_ATTITUDE = 30,
    MAVLINK_ATTITUDE_QUATERNION = 31,
    MAVLINK_LOCAL_POSITION_NED = 32,
    MAVLINK_GLOBAL_POSITION_INT = 33,
    MAVLINK_SERVO_OUTPUT_RAW = 36,
    MAVLINK_VFR_HUD = 74,
    MAVLINK_COMMAND_LONG = 76,
    MAVLINK_TIMESYNC = 111,
    MAVLINK_DISTANCE_SENSOR = 132,
    MAVLINK_SCALED_PRESSURE2 = 137,
    MAVLINK_ALTITUDE = 141,
    MAVLINK_SCALED_PRESSURE3 = 143,
    MAVLINK_AHRS2 = 178,
    MAVLINK_EKF_STATUS_REPORT = 193,
    MAVLINK_ESTIMATOR_STATUS = 230,
    MAVLINK_STATUSTEXT = 253,
    MAVLINK_OBSTACLE_DISTANCE = 330,
    MAVLINK_OBSTACLE_DISTANCE_3D = 11037,
};

enum mavlink_value { /* of fields, as the definitions number them */
                     MAVLINK_TYPE_GCS = 6,
                     MAVLINK_TYPE_SUBMARINE = 12,
                     MAVLINK_TYPE_ONBOARD_CONTROLLER = 18,
                     MAVLINK_AUTOPILOT_ARDUPILOT = 3,
                     MAVLINK_MODE_ARMED = 128,      /* of base_mode */
                     MAVLINK_AUTOPILOT_INVALID = 8, /* this component is no autopilot */
                     MAVLINK_STATE_ACTIVE = 4,
                     MAVLINK_STATE_CRITICAL = 5,
                     MAVLINK_VERSION = 3,
                     MAVLINK_SENSOR_ULTRASOUND = 1,
                     MAVLINK_FRAME_GLOBAL = 0, /* azimuth 0 is north */
                     MAVLINK_FRAME_BODY_FRD = 12,
                     MAVLINK_ORIENTATION_DOWN = 25,
                     MAVLINK_COVARIANCE_UNKNOWN = 255,
                     MAVLINK_QUALITY_UNKNOWN = 0,
                     MAVLINK_QUALITY_INVALID = 1,
                     MAVLINK_OBSTACLE_ID_UNKNOWN = 65535,
                     MAVLINK_SEVERITY_CRITICAL = 2,
                     MAVLINK_SEVERITY_WARNING = 4,
                     MAVLINK_SEVERITY_NOTICE = 5,
                     MAVLINK_CMD_SET_MESSAGE_INTERVAL = 511,
};

struct mavlink_heartbeat {
    uint32_t custom_mode;
    uint8_t type, autopilot, base_mode, system_status, mavlink_version;
};

struct mavlink_system_time {
    uint64_t time_unix_usec;
    uint32_t time_boot_ms;
};

struct mavlink_attitude {
    uint32_t time_boot_ms;
    float roll, pitch, yaw;                /* rad, NED to FRD */
    float rollspeed, pitchspeed, yawspeed; /* rad/s */
};

struct mavlink_attitude_quaternion {
    uint32_t time_boot_ms;
    float q1, q2, q3, q4; /* w, x, y, z */
    float rollspeed, pitchspeed, yawspeed;
};

struct mavlink_local_position_ned {
    uint32_t time_boot_ms;
    float x, y, z;    /* m */
    float vx, vy, vz; /* m/s */
};

struct mavlink_global_position_int {
    uint32_t time_boot_ms;
    int32_t lat, lon;          /* 1e-7 deg */
    int32_t alt, relative_alt; /* mm, upward: above the sea, and above home */
    int16_t vx, vy, vz;        /* cm/s */
    uint16_t hdg;              /* 0.01 deg */
};

#define MAVLINK_PARAM_ID 16

struct mavlink_param_request_read {
    int16_t param_index; /* -1: by its name */
    uint8_t target_system, target_component;
    char param_id[MAVLINK_PARAM_ID]; /* zeros behind; none when full */
};

struct mavlink_param_value {
    float param_value; /* the number, whatever the type */
    uint16_t param_count, param_index;
    char param_id[MAVLINK_PARAM_ID];
    uint8_t param_type;
};

#define MAVLINK_SERVOS 16

struct mavlink_servo_output_raw {
    uint32_t time_usec;             /* since start, wrapping */
    uint16_t servo[MAVLINK_SERVOS]; /* us; 0: no pulses */
    uint8_t port;
};

struct mavlink_vfr_hud {
    float airspeed, groundspeed; /* m/s */
    float alt, climb;            /* m, m/s, upward */
    int16_t heading;             /* deg */
    uint16_t throttle;           /* percent */
};

struct mavlink_command_long {
    float param[7];
    uint16_t command;
    uint8_t target_system, target_component, confirmation;
};

struct mavlink_timesync {
    int64_t tc1, ts1; /* ns; a question has tc1 = 0, its answer the answerer's clock there */
    uint8_t target_system, target_component;
};

struct mavlink_distance_sensor {
    uint32_t time_boot_ms;
    uint16_t min_distance, max_distance, current_distance; /* cm */
    uint8_t type, id, orientation, covariance;
    float horizontal_fov, vertical_fov; /* rad; 0: unknown */
    float quaternion[4];
    uint8_t signal_quality; /* MAVLINK_QUALITY_..., 100 best */
};

/* Of SCALED_PRESSURE, 2 and 3. */
struct mavlink_scaled_pressure {
    uint32_t time_boot_ms;
    float press_abs, press_diff; /* hPa */
    int16_t temperature;         /* 0.01 degC */
};

struct mavlink_altitude_message {
    uint64_t time_usec;
    float altitude_monotonic, altitude_amsl, altitude_local, altitude_relative, altitude_terrain; /* m, upward */
    float bottom_clearance; /* m, to the ground below; negative or NaN: none */
};

struct mavlink_ahrs2 {
    float roll, pitch, yaw; /* rad */
    float altitude;         /* m, upward */
    int32_t lat, lng;       /* 1e-7 deg */
};

struct mavlink_ekf_status_report {
    float velocity_variance, pos_horiz_variance, pos_vert_variance, compass_variance, terrain_alt_variance;
    uint16_t flags; /* EKF_STATUS_FLAGS */
    float airspeed_variance;
};

struct mavlink_estimator_status {
    uint64_t time_usec;
    float vel_ratio, pos_horiz_ratio, pos_vert_ratio, mag_ratio, hagl_ratio, tas_ratio;
    float pos_horiz_accuracy, pos_vert_accuracy; /* m */
    uint16_t flags;                              /* ESTIMATOR_STATUS_FLAGS */
};

struct mavlink_statustext {
    uint8_t severity;
    char text[50]; /* zeros behind; none when full */
    uint16_t id;   /* 0: this text is whole */
    uint8_t chunk_seq;
};

struct mavlink_obstacle_distance {
    uint64_t time_usec;
    uint16_t distances[MAVLINK_SECTORS]; /* cm; max_distance + 1: nothing seen; 65535: unknown */
    uint16_t min_distance, max_distance; /* cm */
    uint8_t sensor_type;
    uint8_t increment;  /* deg; where increment_f is 0 */
    float increment_f;  /* deg */
    float angle_offset; /* deg, of element 0 */
    uint8_t frame;
};

struct mavlink_obstacle_distance_3d {
    uint32_t time_boot_ms;
    float x, y, z;                    /* m, in the frame */
    float min_distance, max_distance; /* m */
    uint16_t obstacle_id;
    uint8_t sensor_type, frame;
};

enum mavlink_type {
    MAVLINK_U8,
    MAVLINK_CHAR,
    MAVLINK_U16,
    MAVLINK_I16,
    MAVLINK_U32,
    MAVLINK_I32,
    MAVLINK_F32,
    MAVLINK_U64,
    MAVLINK_I64,
};

/* Fields stand in wire order: by size, 8, 4, 2, 1; extensions behind, in the definition's order. */
struct mavlink_field {
    const char *name; /* NULL ends the table */
    enum mavlink_type type;
    uint8_t count; /* elements; 0: not an array */
    uint8_t extension;
    size_t member; /* offset in the struct */
};

struct mavlink_message {
    uint32_t id;
    const char *name;
    uint8_t crc_extra; /* of the definition, checked along with a frame's content */
    uint8_t size;      /* of the payload with extensions */
    const struct mavlink_field *fields;
};

extern const struct mavlink_message mavlink_messages[];
extern const size_t mavlink_message_count;

/** mavlink_message - the table's entry for an id, NULL when it has none. */
const struct mavlink_message *mavlink_message(uint32_t id);

/** mavlink_type_size - bytes of one element on the wire and in the struct. */
size_t mavlink_type_size(enum mavlink_type type);

/** mavlink_pack - the struct that belongs to `message` into its payload of message->size bytes. */
void mavlink_pack(const struct mavlink_message *message, const void *from, uint8_t *payload);

/** mavlink_unpack - the reverse; all message->size bytes are read: zeros stand for what was cut off. */
void mavlink_unpack(const struct mavlink_message *message, const uint8_t *payload, void *to);

#endif
