/* SPDX-License-Identifier: MIT */
#include "mavlink_vehicle.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define AUTOPILOT         1 /* its component id */
#define PRESENT_NS        5000000000u
#define POSE_PERIOD_NS    20000000u
#define ALONE_AFTER_NS    500000000u
#define POSITION_FRESH_NS 2000000000u
#define TOO_OLD_NS        5000000000u
#define GRAVITY_MPS2      9.80665
#define PA_PER_HPA        100.0
#define POSITION_MAX_M    1e8 /* these are the daemon's limits */
#define VELOCITY_MAX_MPS  100.0
#define DEPTH_MIN_M       -100.0
#define DEPTH_MAX_M       12000.0
#define LEAST_UPRIGHT     0.7071 /* cosine of the tilt */

void mavlink_vehicle_init(struct mavlink_vehicle *vehicle, const struct mavlink_vehicle_conf *conf)
{
    *vehicle = (struct mavlink_vehicle){.conf = *conf, .system_id = conf->system_id};
    mavlink_barometers_init(&vehicle->barometers, conf->barometer,
                            PA_PER_HPA / (conf->density_kgpm3 * GRAVITY_MPS2));
    mavlink_thrusters_init(&vehicle->thrusters, &conf->thrusters);
}

bool mavlink_vehicle_present(struct mavlink_vehicle *vehicle, uint64_t now_ns)
{
    if (vehicle->present && now_ns > vehicle->heartbeat_ns + PRESENT_NS) {
        vehicle->present = false;
        vehicle->clock.known = false;
        vehicle->aiding = (struct mavlink_aiding){0};
        vehicle->next.has = 0;
        mavlink_thrusters_forget(&vehicle->thrusters);
        mavlink_barometers_unsay(&vehicle->barometers);
    }
    return vehicle->present;
}

bool mavlink_vehicle_speaks(const struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame)
{
    struct mavlink_heartbeat heartbeat;
    if (frame->component_id != AUTOPILOT || frame->message->id != MAVLINK_HEARTBEAT)
        return false;
    mavlink_unpack(frame->message, frame->payload, &heartbeat);
    return heartbeat.autopilot != MAVLINK_AUTOPILOT_INVALID && heartbeat.type != MAVLINK_TYPE_GCS &&
           (vehicle->conf.system_id == 0 || vehicle->conf.system_id == frame->system_id);
}

void mavlink_vehicle_moved(struct mavlink_vehicle *vehicle)
{
    mavlink_barometers_forget(&vehicle->barometers);
    mavlink_thrusters_forget(&vehicle->thrusters);
}

/* A heartbeat of an autopilot takes the vehicle's place when that is free. */
static void meet(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    if (!mavlink_vehicle_speaks(vehicle, frame))
        return;
    if (!mavlink_vehicle_present(vehicle, now_ns)) {
        if (vehicle->system_id != frame->system_id)
            mavlink_barometers_forget(&vehicle->barometers);
        vehicle->present = true;
        vehicle->system_id = frame->system_id;
    }
    if (vehicle->present && vehicle->system_id == frame->system_id) {
        struct mavlink_heartbeat heartbeat;
        vehicle->heartbeat_ns = now_ns;
        mavlink_unpack(frame->message, frame->payload, &heartbeat);
        mavlink_thrusters_heartbeat(&vehicle->thrusters, &heartbeat);
    }
}

/* The sample's own time; 0, counted, when it is too old to be of use, or nobody knows whose clock it is of. Then
 * nothing that came before it counts either. */
static uint64_t sampled(struct mavlink_vehicle *vehicle, uint32_t boot_ms, uint64_t now_ns)
{
    const uint64_t t_ns = mavlink_clock_heard(&vehicle->clock, boot_ms, now_ns);
    if (mavlink_clock_doubtful(&vehicle->clock, now_ns)) {
        mavlink_aiding_doubt(&vehicle->aiding, now_ns);
        mavlink_thrusters_lose(&vehicle->thrusters, MAVLINK_NO_CLOCK);
        vehicle->next.has = 0;
        vehicle->undated++;
        return 0;
    }
    if (now_ns <= t_ns + TOO_OLD_NS)
        return t_ns;
    vehicle->refused++;
    return 0;
}

/* PX4 stamps some messages by their sensor: with 0 where that is missing, and always the same once it is dead. So while
 * attitudes tell the time, such a message of a time that jumps is left out, and makes no second clock. */
static uint64_t sensed(struct mavlink_vehicle *vehicle, uint32_t boot_ms, uint64_t now_ns)
{
    const bool attitudes = vehicle->attitude_ns && now_ns <= vehicle->attitude_ns + ALONE_AFTER_NS;
    if (attitudes && mavlink_clock_jumps(&vehicle->clock, boot_ms, now_ns)) {
        vehicle->refused++;
        return 0;
    }
    return sampled(vehicle, boot_ms, now_ns);
}

static bool within(const double *v, size_t n, double limit)
{
    for (size_t i = 0; i < n; i++)
        if (!(fabs(v[i]) <= limit))
            return false;
    return true;
}

static void take_quaternion(struct mavlink_vehicle *vehicle, const double q[4], uint64_t t_ns, uint64_t now_ns)
{
    const double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(norm >= 0.9 && norm <= 1.1)) {
        vehicle->refused++;
        return;
    }
    for (int i = 0; i < 4; i++)
        vehicle->next.quaternion[i] = q[i] / norm;
    vehicle->next.has |= MAVLINK_POSE_ATTITUDE;
    vehicle->next.t_ns = t_ns;
    vehicle->attitude_ns = now_ns;
    mavlink_thrusters_attitude(&vehicle->thrusters, vehicle->next.quaternion, t_ns);
}

static void take_attitude(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    struct mavlink_attitude m;
    mavlink_unpack(frame->message, frame->payload, &m);

    const uint64_t t_ns = sampled(vehicle, m.time_boot_ms, now_ns);
    const double cr = cos(m.roll / 2.0), sr = sin(m.roll / 2.0), cp = cos(m.pitch / 2.0), sp = sin(m.pitch / 2.0);
    const double cy = cos(m.yaw / 2.0), sy = sin(m.yaw / 2.0);
    const double q[4] = {cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy,
                         cr * cp * sy - sr * sp * cy};

    if (t_ns)
        take_quaternion(vehicle, q, t_ns, now_ns);
}

static void take_attitude_quaternion(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame,
                                     uint64_t now_ns)
{
    struct mavlink_attitude_quaternion m;
    mavlink_unpack(frame->message, frame->payload, &m);

    const uint64_t t_ns = sampled(vehicle, m.time_boot_ms, now_ns);
    const double q[4] = {m.q1, m.q2, m.q3, m.q4};

    if (t_ns)
        take_quaternion(vehicle, q, t_ns, now_ns);
}

/* The time of a part that comes without attitude: of the pose, when it has to go out alone. */
static void add_part(struct mavlink_vehicle *vehicle, unsigned part, uint64_t t_ns)
{
    if (!(vehicle->next.has & MAVLINK_POSE_ATTITUDE))
        vehicle->next.t_ns = t_ns;
    vehicle->next.has |= part;
}

static void take_position(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    struct mavlink_local_position_ned m;
    mavlink_unpack(frame->message, frame->payload, &m);

    const uint64_t t_ns = sampled(vehicle, m.time_boot_ms, now_ns);
    const double position_m[3] = {m.x, m.y, m.z}, velocity_mps[3] = {m.vx, m.vy, m.vz};

    if (!t_ns)
        return;
    if (!within(position_m, 3, POSITION_MAX_M) || !within(velocity_mps, 3, VELOCITY_MAX_MPS)) {
        vehicle->refused++;
        return;
    }
    const unsigned aided = mavlink_aiding_offer(&vehicle->aiding, position_m, now_ns);

    memcpy(vehicle->next.velocity_mps, velocity_mps, sizeof velocity_mps);
    if (aided & MAVLINK_AIDED_VELOCITY)
        add_part(vehicle, MAVLINK_POSE_VELOCITY, t_ns);
    if (!(aided & MAVLINK_AIDED_POSITION)) {
        vehicle->unaided++;
        return;
    }
    memcpy(vehicle->next.position_m, position_m, sizeof position_m);
    vehicle->next.has &= ~(unsigned)MAVLINK_POSE_DEPTH;
    add_part(vehicle, MAVLINK_POSE_POSITION, t_ns);
    vehicle->position_ns = now_ns;
}

static void take_report(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    union {
        struct mavlink_ekf_status_report ekf;
        struct mavlink_estimator_status estimator;
    } m;

    mavlink_unpack(frame->message, frame->payload, &m);
    mavlink_aiding_report(&vehicle->aiding,
                          frame->message->id == MAVLINK_EKF_STATUS_REPORT ? m.ekf.flags : m.estimator.flags,
                          now_ns);
}

/* Do positions come? They hold the depth, and it is not taken from pressure then. */
static bool has_position(const struct mavlink_vehicle *vehicle, uint64_t now_ns)
{
    return vehicle->position_ns && now_ns < vehicle->position_ns + POSITION_FRESH_NS;
}

/* The pressure at the surface for barometer `number`; 0: not known. */
static double surface_of(const struct mavlink_vehicle *vehicle, int number)
{
    return vehicle->conf.surface_hpa > 0 ? vehicle->conf.surface_hpa
                                         : mavlink_barometers_surface_hpa(&vehicle->barometers, number);
}

/* Of barometer `number`. */
static void take_pressure(struct mavlink_vehicle *vehicle, int number, const struct mavlink_frame *frame,
                          uint64_t now_ns)
{
    const struct mavlink_barometers *barometers = &vehicle->barometers;
    struct mavlink_scaled_pressure m;
    mavlink_unpack(frame->message, frame->payload, &m);

    const uint64_t t_ns = sensed(vehicle, m.time_boot_ms, now_ns);

    if (!t_ns)
        return;
    if (!(m.press_abs > 0 && isfinite(m.press_abs))) {
        vehicle->refused++;
        return;
    }
    mavlink_barometers_pressure(&vehicle->barometers, number, m.press_abs, now_ns);
    if (has_position(vehicle, now_ns) || mavlink_barometers_depth(barometers) != number)
        return;

    const double surface_hpa = surface_of(vehicle, number);

    if (!(surface_hpa > 0))
        return;
    const double depth_m = (m.press_abs - surface_hpa) * barometers->m_per_hpa;

    if (!(depth_m >= DEPTH_MIN_M && depth_m <= DEPTH_MAX_M)) {
        vehicle->refused++;
        return;
    }
    vehicle->next.depth_m = depth_m;
    add_part(vehicle, MAVLINK_POSE_DEPTH, t_ns);
}

/* Cosine of the vehicle's tilt; 0: not known. */
static double upright(const struct mavlink_vehicle *vehicle, uint64_t now_ns)
{
    const double *q = vehicle->next.quaternion;
    if (!vehicle->attitude_ns || now_ns > vehicle->attitude_ns + ALONE_AFTER_NS)
        return 0;
    return 1 - 2 * (q[1] * q[1] + q[2] * q[2]);
}

/* Two sensors: the lower height counts. */
static void take_height(struct mavlink_vehicle *vehicle, double altitude_m, uint32_t boot_ms, uint64_t now_ns)
{
    if (vehicle->conf.told_below)
        return;

    const uint64_t t_ns = sensed(vehicle, boot_ms, now_ns);
    const bool more = vehicle->next.has & MAVLINK_POSE_ALTITUDE && altitude_m >= vehicle->next.altitude_m;

    if (!t_ns || more)
        return;
    vehicle->next.altitude_m = altitude_m;
    add_part(vehicle, MAVLINK_POSE_ALTITUDE, t_ns);
}

/* At its limits a sensor has no echo, whatever it says. The range is along the vehicle's own axis. */
static void take_distance(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    struct mavlink_distance_sensor m;
    const double cosine = upright(vehicle, now_ns);
    mavlink_unpack(frame->message, frame->payload, &m);
    if (cosine >= LEAST_UPRIGHT && m.orientation == MAVLINK_ORIENTATION_DOWN &&
        m.signal_quality != MAVLINK_QUALITY_INVALID && m.current_distance > m.min_distance &&
        m.current_distance < m.max_distance)
        take_height(vehicle, m.current_distance * 1e-2 * cosine, m.time_boot_ms, now_ns);
}

static void take_clearance(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    struct mavlink_altitude_message m;
    mavlink_unpack(frame->message, frame->payload, &m);
    if (m.bottom_clearance > 0 && m.bottom_clearance <= DEPTH_MAX_M)
        take_height(vehicle, m.bottom_clearance, (uint32_t)(m.time_usec / 1000), now_ns);
}

static void take_altitude(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    union {
        struct mavlink_vfr_hud hud;
        struct mavlink_global_position_int place;
        struct mavlink_ahrs2 ahrs2;
    } m;

    mavlink_unpack(frame->message, frame->payload, &m);
    if (frame->message->id == MAVLINK_VFR_HUD) {
        mavlink_barometers_altitude(&vehicle->barometers, MAVLINK_ALTITUDE_VFR_HUD, m.hud.alt, now_ns);
        mavlink_thrusters_climb(&vehicle->thrusters, m.hud.climb, now_ns);
    } else if (frame->message->id == MAVLINK_GLOBAL_POSITION_INT)
        mavlink_barometers_altitude(&vehicle->barometers, MAVLINK_ALTITUDE_GLOBAL_POSITION,
                                    m.place.relative_alt * 1e-3, now_ns);
    else
        mavlink_barometers_altitude(&vehicle->barometers, MAVLINK_ALTITUDE_AHRS2, m.ahrs2.altitude, now_ns);
}

/* Its time is that of the autopilot's clock in microseconds, of which 32 bits come: the same moment as near to now as
 * they allow. */
static void take_servo(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    struct mavlink_servo_output_raw m;
    mavlink_unpack(frame->message, frame->payload, &m);
    if (!vehicle->clock.known)
        return;

    const uint32_t now_us = (uint32_t)(mavlink_clock_boot_ns(&vehicle->clock, now_ns) / 1000u);
    const int64_t age_ns = (int64_t)(int32_t)(now_us - m.time_usec) * 1000;

    if (mavlink_clock_doubtful(&vehicle->clock, now_ns) || age_ns > (int64_t)TOO_OLD_NS ||
        age_ns < -(int64_t)ALONE_AFTER_NS) {
        mavlink_thrusters_lose(&vehicle->thrusters, MAVLINK_NO_CLOCK);
        vehicle->undated++;
        return;
    }
    mavlink_thrusters_servo(&vehicle->thrusters, &m, age_ns > 0 ? now_ns - (uint64_t)age_ns : now_ns, now_ns);
}

static void take_param(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame)
{
    struct mavlink_param_value m;
    mavlink_unpack(frame->message, frame->payload, &m);
    mavlink_thrusters_param(&vehicle->thrusters, &m);

    char name[MAVLINK_PARAM_ID + 1] = {0};

    memcpy(name, m.param_id, MAVLINK_PARAM_ID);
    if (vehicle->thrusters.submarine && mavlink_barometers_is_primary(name) && fabsf(m.param_value) < 100)
        mavlink_barometers_primary(&vehicle->barometers, (int)lrintf(m.param_value));
}

static void take_clock(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    if (frame->message->id == MAVLINK_SYSTEM_TIME) {
        struct mavlink_system_time m;
        mavlink_unpack(frame->message, frame->payload, &m);
        mavlink_clock_heard(&vehicle->clock, m.time_boot_ms, now_ns);
    } else {
        struct mavlink_timesync m;
        mavlink_unpack(frame->message, frame->payload, &m);
        if (m.tc1 != 0)
            mavlink_clock_answer(&vehicle->clock, m.tc1, m.ts1, now_ns);
    }
}

bool mavlink_vehicle_take(struct mavlink_vehicle *vehicle, const struct mavlink_frame *frame, uint64_t now_ns)
{
    if (frame->component_id != AUTOPILOT)
        return false;
    if (frame->message->id == MAVLINK_HEARTBEAT)
        meet(vehicle, frame, now_ns);
    if (!mavlink_vehicle_present(vehicle, now_ns) || frame->system_id != vehicle->system_id)
        return false;
    switch (frame->message->id) {
    case MAVLINK_ATTITUDE:
        take_attitude(vehicle, frame, now_ns);
        break;
    case MAVLINK_ATTITUDE_QUATERNION:
        take_attitude_quaternion(vehicle, frame, now_ns);
        break;
    case MAVLINK_LOCAL_POSITION_NED:
        take_position(vehicle, frame, now_ns);
        break;
    case MAVLINK_SCALED_PRESSURE:
        take_pressure(vehicle, 1, frame, now_ns);
        break;
    case MAVLINK_SCALED_PRESSURE2:
        take_pressure(vehicle, 2, frame, now_ns);
        break;
    case MAVLINK_SCALED_PRESSURE3:
        take_pressure(vehicle, 3, frame, now_ns);
        break;
    case MAVLINK_VFR_HUD:
    case MAVLINK_GLOBAL_POSITION_INT:
    case MAVLINK_AHRS2:
        take_altitude(vehicle, frame, now_ns);
        break;
    case MAVLINK_DISTANCE_SENSOR:
        take_distance(vehicle, frame, now_ns);
        break;
    case MAVLINK_ALTITUDE:
        take_clearance(vehicle, frame, now_ns);
        break;
    case MAVLINK_EKF_STATUS_REPORT:
    case MAVLINK_ESTIMATOR_STATUS:
        take_report(vehicle, frame, now_ns);
        break;
    case MAVLINK_SERVO_OUTPUT_RAW:
        take_servo(vehicle, frame, now_ns);
        break;
    case MAVLINK_PARAM_VALUE:
        take_param(vehicle, frame);
        break;
    case MAVLINK_SYSTEM_TIME:
    case MAVLINK_TIMESYNC:
        take_clock(vehicle, frame, now_ns);
        break;
    default:
        break;
    }
    return true;
}

bool mavlink_vehicle_pose(struct mavlink_vehicle *vehicle, uint64_t now_ns, struct mavlink_pose *out)
{
    const bool attitude = vehicle->next.has & MAVLINK_POSE_ATTITUDE;
    const bool alone = !vehicle->attitude_ns || now_ns > vehicle->attitude_ns + ALONE_AFTER_NS;
    if (!vehicle->next.has || (!attitude && !alone) || now_ns < vehicle->due_ns ||
        vehicle->next.t_ns <= vehicle->t_pose_ns)
        return false;
    /* A little early now and then: samples that come 50 times a second with jitter are all taken. */
    vehicle->due_ns =
        (vehicle->due_ns + POSE_PERIOD_NS > now_ns ? vehicle->due_ns : now_ns - POSE_PERIOD_NS) + POSE_PERIOD_NS;
    *out = vehicle->next;
    vehicle->t_pose_ns = out->t_ns;
    vehicle->next.has = 0;
    return true;
}

bool mavlink_vehicle_bound(struct mavlink_vehicle *vehicle, struct mavlink_pose *out)
{
    *out = (struct mavlink_pose){.has = MAVLINK_POSE_BOUND};
    memcpy(out->push_n, vehicle->thrusters.push_n, sizeof out->push_n);
    return mavlink_thrusters_take(&vehicle->thrusters, &out->t_ns, out->bound_mps);
}

/* The one that is used began where its first reading is no surface. */
static bool say_no_surface(struct mavlink_vehicle *vehicle, int number, char *text, size_t size)
{
    char name[MAVLINK_BAROMETER_NAME];
    if (vehicle->told_surface == number)
        return false;
    vehicle->told_surface = number;
    snprintf(text, size,
             "warning: no depth from %s: its first reading, %.0f hPa, is no air pressure; start the bridge at the "
             "surface, or give --surface-pressure in hPa",
             mavlink_barometers_name(&vehicle->barometers, number, name),
             vehicle->barometers.of[number - 1].first_hpa);
    return true;
}

bool mavlink_vehicle_depth_news(struct mavlink_vehicle *vehicle, uint64_t now_ns, char *text, size_t size)
{
    const struct mavlink_barometers *b = &vehicle->barometers;
    if (has_position(vehicle, now_ns))
        return false;
    if (b->used != MAVLINK_BAROMETER_ANY && b->of[b->used - 1].t_ns && !(surface_of(vehicle, b->used) > 0) &&
        say_no_surface(vehicle, b->used, text, size))
        return true;
    return mavlink_barometers_news(&vehicle->barometers, now_ns, text, size);
}

bool mavlink_vehicle_depth_doubtful(const struct mavlink_vehicle *vehicle, uint64_t now_ns)
{
    return !has_position(vehicle, now_ns) && vehicle->barometers.against != MAVLINK_BAROMETER_ANY;
}
