/* SPDX-License-Identifier: MIT */
/* What the bridge makes of messages and answers: clock, pose, distances, points, texts; its link's addresses. */
#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <unistd.h>

#include "client/mavlink/mavlink_alert.h"
#include "client/mavlink/mavlink_link.h"
#include "client/mavlink/mavlink_obstacles.h"
#include "client/mavlink/mavlink_vehicle.h"
#include "core/fault.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#define MS    1000000ull
#define S     1000000000ull
#define START (1000 * S) /* our clock when the autopilot has been up for 100 s */

/* ---- clock ---- */

TEST(the_clock_follows_the_least_delay)
{
    uint64_t random = test_seed(), now_ns = 0;
    struct mavlink_clock clock = {0};
    for (uint32_t ms = 0; ms < 20000; ms += 20) {
        const uint64_t truth_ns = START + ms * MS, due_ns = truth_ns + 2 * MS + test_random(&random) % (30 * MS);
        now_ns = due_ns > now_ns ? due_ns : now_ns; /* none overtakes another */
        const uint64_t got_ns = mavlink_clock_heard(&clock, 100000 + ms, now_ns);

        CHECK(got_ns <= now_ns);
        if (ms > 5000)
            CHECK_NEAR((double)got_ns - (double)truth_ns, 2.5e6, 0, 0.6e6);
    }
}

TEST(the_clock_follows_one_that_runs_slow)
{
    struct mavlink_clock clock = {0};
    uint64_t got_ns = 0, truth_ns = 0;
    for (uint32_t ms = 0; ms < 600000; ms += 20) { /* 30 ppm, ten minutes: 18 ms */
        truth_ns = START + (uint64_t)(ms * 1.00003 * 1e6);
        got_ns = mavlink_clock_heard(&clock, 100000 + ms, truth_ns);
    }
    CHECK_NEAR((double)got_ns - (double)truth_ns, 0, 0, 1e6);
}

TEST(the_clock_goes_on_when_the_autopilots_wraps)
{
    struct mavlink_clock clock = {0};
    for (uint64_t ms = UINT32_MAX - 1000; ms < (1ull << 32) + 1000; ms += 10)
        CHECK(mavlink_clock_heard(&clock, (uint32_t)ms, START + ms * MS) == START + ms * MS);
}

TEST(the_clock_begins_anew_with_the_autopilot)
{
    struct mavlink_clock clock = {0};
    mavlink_clock_heard(&clock, 100000, START);
    CHECK(mavlink_clock_heard(&clock, 3000, START + S) == START + S);
    CHECK(mavlink_clock_heard(&clock, 3010, START + S + 10 * MS) == START + S + 10 * MS);
}

TEST(the_clock_bears_messages_out_of_order_and_late_ones)
{
    struct mavlink_clock clock = {0};
    mavlink_clock_heard(&clock, 100000, START);
    CHECK(mavlink_clock_heard(&clock, 99980, START) == START - 20 * MS);
    CHECK(mavlink_clock_heard(&clock, 100100, START + 900 * MS) < START + 101 * MS); /* stuck for 0.8 s */
}

/* Messages every 20 ms whose stamps differ by step_ms from a clock that was followed: how long until they are right? */
static uint64_t followed_after(struct mavlink_clock clock, int64_t step_ms)
{
    for (uint64_t ms = 0; ms < 20000; ms += 20) {
        const uint64_t now_ns = START + ms * MS, boot_ms = (uint64_t)(100000 + (int64_t)ms + step_ms);
        const uint64_t got_ns = mavlink_clock_heard(&clock, (uint32_t)boot_ms, now_ns);
        CHECK(got_ns <= now_ns);
        if (now_ns - got_ns < 5 * MS)
            return ms;
    }
    return UINT64_MAX;
}

TEST(steps_of_the_autopilots_clock_are_followed)
{
    static const struct {
        const char *name;
        int64_t step_ms;
        uint64_t most_ms;
    } rows[] = {
        {"none", 0, 0},
        {"forward a little", 300, 0},
        {"forward a day", 86400000, 0},
        {"back a day: it has started anew", -99000, 0},
        {"back more than a second", -1500, 0},
        {"back less", -900, 0},
        {"back a third of a second", -300, 0},
        {"back less than messages differ: as if everything were late", -140, UINT64_MAX},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct mavlink_clock clock = {0};
        for (uint64_t ms = 0; ms < 5000; ms += 20)
            mavlink_clock_heard(&clock, (uint32_t)(95000 + ms), START - 5 * S + ms * MS);
        const uint64_t ms = followed_after(clock, rows[i].step_ms);
        if (ms > rows[i].most_ms)
            printf("# %s: followed after %llu ms\n", rows[i].name, (unsigned long long)ms);
        CHECK(ms <= rows[i].most_ms);
    }
}

TEST(an_autopilot_that_starts_anew_at_once_is_followed)
{
    struct mavlink_clock clock = {0};
    uint64_t got_ns = 0, now_ns = 0;
    mavlink_clock_heard(&clock, 2000, START);
    for (uint64_t ms = 1500; ms < 6000; ms += 20) { /* 4.5 s later it is younger by half a second only */
        now_ns = START + 3 * S + ms * MS;
        got_ns = mavlink_clock_heard(&clock, (uint32_t)ms, now_ns);
    }
    CHECK(got_ns == now_ns);
}

TEST(a_wrong_timesync_answer_is_outlived)
{
    struct mavlink_clock clock = {0};
    mavlink_clock_heard(&clock, 100000, START);
    mavlink_clock_answer(&clock, (int64_t)(100 * S + 900 * MS), (int64_t)START, START + MS);
    CHECK(mavlink_clock_heard(&clock, 100020, START + 20 * MS) < START - 800 * MS);
    CHECK(followed_after(clock, 0) <= 3100);
}

TEST(a_timesync_answer_takes_half_the_way_off)
{
    struct mavlink_clock clock = {0};
    int64_t before;
    mavlink_clock_heard(&clock, 100000, START + 8 * MS); /* true offset 900 s, seen with 8 ms delay */
    mavlink_clock_answer(&clock, (int64_t)(100 * S + 20 * MS), (int64_t)(START + 16 * MS), START + 24 * MS);
    CHECK(mavlink_clock_boot_ns(&clock, START) == 100 * S);
    before = clock.offset_ns;
    mavlink_clock_answer(&clock, (int64_t)(100 * S + 50 * MS), (int64_t)START, START + 60 * MS); /* slow */
    mavlink_clock_answer(&clock, (int64_t)(500 * S), (int64_t)START, START + MS); /* another clock */
    mavlink_clock_answer(&clock, INT64_MIN, INT64_MIN, START + MS);
    mavlink_clock_answer(&clock, INT64_MAX, INT64_MAX, START + MS);
    CHECK(clock.offset_ns == before);
}

/* ---- vehicle ---- */

static bool give(struct mavlink_vehicle *v, uint8_t system, uint8_t component, enum mavlink_id id,
                 const void *content, uint64_t now_ns)
{
    struct mavlink_frame frame = {.message = mavlink_message(id), .system_id = system, .component_id = component};
    mavlink_pack(frame.message, content, frame.payload);
    return mavlink_vehicle_take(v, &frame, now_ns);
}

static const struct mavlink_heartbeat submarine = {.type = 12, .autopilot = 3, .mavlink_version = 3};

static struct mavlink_vehicle vehicle_at_start(double surface_hpa)
{
    const struct mavlink_vehicle_conf conf = {.barometer = 2, .surface_hpa = surface_hpa, .density_kgpm3 = 1025};
    struct mavlink_vehicle v;
    mavlink_vehicle_init(&v, &conf);
    CHECK(give(&v, 7, 1, MAVLINK_HEARTBEAT, &submarine, START));
    return v;
}

static bool give_attitude(struct mavlink_vehicle *v, uint32_t ms, double roll, double pitch, double yaw)
{
    const struct mavlink_attitude m = {
        .time_boot_ms = 100000 + ms, .roll = (float)roll, .pitch = (float)pitch, .yaw = (float)yaw};
    return give(v, 7, 1, MAVLINK_ATTITUDE, &m, START + ms * MS);
}

TEST(the_vehicle_is_whoever_beats_as_an_autopilot)
{
    const struct mavlink_heartbeat station = {.type = 6, .autopilot = 8}, companion = {.type = 18, .autopilot = 8};
    const struct mavlink_vehicle_conf chosen = {.system_id = 9, .surface_hpa = 1013, .density_kgpm3 = 1025};
    struct mavlink_vehicle v;
    mavlink_vehicle_init(&v, &chosen);
    CHECK(!give(&v, 7, 1, MAVLINK_HEARTBEAT, &submarine, START));
    CHECK(give(&v, 9, 1, MAVLINK_HEARTBEAT, &submarine, START));
    v = vehicle_at_start(1013);
    CHECK_INT(v.system_id, 7);
    CHECK(!give(&v, 7, 196, MAVLINK_HEARTBEAT, &companion, START));
    CHECK(!give(&v, 255, 190, MAVLINK_HEARTBEAT, &station, START));
    CHECK(!give(&v, 255, 1, MAVLINK_HEARTBEAT, &station, START));
    CHECK(!give(&v, 9, 1, MAVLINK_HEARTBEAT, &submarine, START + S)); /* a second one */
    CHECK(mavlink_vehicle_present(&v, START + 5 * S));
    CHECK(!mavlink_vehicle_present(&v, START + 5 * S + 1));
    CHECK(!give_attitude(&v, 6000, 0, 0, 0)); /* without a heartbeat it is not there */
    CHECK(give(&v, 9, 1, MAVLINK_HEARTBEAT, &submarine, START + 7 * S));
    CHECK_INT(v.system_id, 9);
}

TEST(euler_angles_become_the_quaternion)
{
    static const double half = 0.70710678118654752;
    struct mavlink_vehicle v = vehicle_at_start(1013);
    struct mavlink_pose pose;
    CHECK(give_attitude(&v, 0, 0, 0, M_PI / 2) && mavlink_vehicle_pose(&v, START, &pose));
    CHECK_NEAR(pose.quaternion[0], half, 1e-6, 0);
    CHECK_NEAR(pose.quaternion[3], half, 1e-6, 0);
    CHECK(give_attitude(&v, 100, M_PI / 2, 0, 0) && mavlink_vehicle_pose(&v, START + 100 * MS, &pose));
    CHECK_NEAR(pose.quaternion[1], half, 1e-6, 0);
    CHECK(give_attitude(&v, 200, 0, -M_PI / 2, 0) && mavlink_vehicle_pose(&v, START + 200 * MS, &pose));
    CHECK_NEAR(pose.quaternion[2], -half, 1e-6, 0);
    /* all three by 90 degrees: as pitch alone, since yaw and roll turn about the same axis then */
    CHECK(give_attitude(&v, 300, M_PI / 2, M_PI / 2, M_PI / 2) &&
          mavlink_vehicle_pose(&v, START + 300 * MS, &pose));
    CHECK_NEAR(pose.quaternion[0], half, 1e-6, 0);
    CHECK_NEAR(pose.quaternion[1], 0, 0, 1e-6);
    CHECK_NEAR(pose.quaternion[2], half, 1e-6, 0);
    CHECK_NEAR(pose.quaternion[3], 0, 0, 1e-6);
    CHECK_INT(pose.has, MAVLINK_POSE_ATTITUDE);
}

TEST(parts_go_out_together_at_the_time_of_the_attitude)
{
    struct mavlink_vehicle v = vehicle_at_start(1013.25);
    const struct mavlink_ekf_status_report aided = {.flags = 0x33F};
    const struct mavlink_local_position_ned place = {100010, 1, 2, 3, 0.1f, 0.2f, 0.3f};
    const struct mavlink_scaled_pressure pressure = {.time_boot_ms = 100005, .press_abs = 2013.25f};
    struct mavlink_pose pose;
    CHECK(give(&v, 7, 1, MAVLINK_EKF_STATUS_REPORT, &aided, START));
    give_attitude(&v, 0, 0, 0, 0);
    CHECK(mavlink_vehicle_pose(&v, START, &pose) && pose.has == MAVLINK_POSE_ATTITUDE);
    CHECK(give(&v, 7, 1, MAVLINK_SCALED_PRESSURE2, &pressure, START + 5 * MS));
    CHECK(give(&v, 7, 1, MAVLINK_LOCAL_POSITION_NED, &place, START + 10 * MS));
    CHECK(give(&v, 7, 1, MAVLINK_SCALED_PRESSURE2, &pressure, START + 15 * MS));
    CHECK(!mavlink_vehicle_pose(&v, START + 15 * MS, &pose)); /* waits for the attitude */
    give_attitude(&v, 20, 0, 0, 0);
    CHECK(mavlink_vehicle_pose(&v, START + 20 * MS, &pose));
    CHECK_INT(pose.has, MAVLINK_POSE_ATTITUDE | MAVLINK_POSE_POSITION | MAVLINK_POSE_VELOCITY);
    CHECK(pose.t_ns <= START + 20 * MS && pose.t_ns + MS > START + 20 * MS);
    CHECK(pose.position_m[2] == 3 && pose.velocity_mps[0] == 0.1f);
    CHECK(!mavlink_vehicle_pose(&v, START + 40 * MS, &pose)); /* nothing new */
}

TEST(depth_follows_from_pressure)
{
    static const struct {
        const char *name;
        double surface_hpa, first_hpa, hpa, depth_m;
    } rows[] = {
        {"1 dbar by ten", 1013.25, 1013.25, 2013.25, 9.948},
        {"above the surface", 1013.25, 1013.25, 1003.25, -0.0995},
        {"zeroed at the first reading", 0, 1030.0, 2030.0, 9.948},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct mavlink_vehicle v = vehicle_at_start(rows[i].surface_hpa);
        struct mavlink_scaled_pressure m = {.time_boot_ms = 100000, .press_abs = (float)rows[i].first_hpa};
        struct mavlink_pose pose;
        give(&v, 7, 1, MAVLINK_SCALED_PRESSURE2, &m, START);
        CHECK(mavlink_vehicle_pose(&v, START, &pose) &&
              pose.has == MAVLINK_POSE_DEPTH); /* alone: no attitude yet */
        CHECK_NEAR(pose.depth_m, 0, 0, 1e-9);
        m.time_boot_ms += 100;
        m.press_abs = (float)rows[i].hpa;
        give(&v, 7, 1, MAVLINK_SCALED_PRESSURE2, &m, START + 100 * MS);
        CHECK(mavlink_vehicle_pose(&v, START + 100 * MS, &pose));
        CHECK_NEAR(pose.depth_m, rows[i].depth_m, 1e-3, 0);
    }
}

TEST(values_that_cannot_be_are_refused)
{
    struct mavlink_vehicle v = vehicle_at_start(1013);
    struct mavlink_attitude_quaternion turn = {100000, 0, 0, 0, 0, 0, 0, 0};
    struct mavlink_local_position_ned place = {.time_boot_ms = 100000, .x = NAN};
    struct mavlink_scaled_pressure pressure = {.time_boot_ms = 100000, .press_abs = -1};
    struct mavlink_pose pose;
    give_attitude(&v, 0, NAN, 0, 0);
    give_attitude(&v, 0, 0, INFINITY, 0);
    give(&v, 7, 1, MAVLINK_ATTITUDE_QUATERNION, &turn, START);
    give(&v, 7, 1, MAVLINK_LOCAL_POSITION_NED, &place, START);
    give(&v, 7, 1, MAVLINK_SCALED_PRESSURE2, &pressure, START);
    pressure.press_abs = NAN;
    give(&v, 7, 1, MAVLINK_SCALED_PRESSURE2, &pressure, START);
    CHECK_INT(v.refused, 6);
    CHECK(!mavlink_vehicle_pose(&v, START, &pose));
}

TEST(what_was_stuck_for_seconds_on_its_way_is_refused)
{
    struct mavlink_vehicle v = vehicle_at_start(1013);
    const struct mavlink_attitude late = {.time_boot_ms = 100100};
    struct mavlink_pose pose;
    give_attitude(&v, 0, 0, 0, 0);
    CHECK(mavlink_vehicle_pose(&v, START, &pose));
    CHECK(give(&v, 7, 1, MAVLINK_HEARTBEAT, &submarine, START + 4 * S));
    CHECK(give(&v, 7, 1, MAVLINK_ATTITUDE, &late, START + 6 * S));
    CHECK_INT(v.refused, 1);
    CHECK(!mavlink_vehicle_pose(&v, START + 6 * S, &pose));
}

/* Nothing of the first autopilot is left: not its clock, by which the second one's samples would be a minute old, nor
 * its place. */
TEST(another_autopilot_brings_its_own_clock)
{
    struct mavlink_vehicle v = vehicle_at_start(1013);
    const struct mavlink_local_position_ned place = {.time_boot_ms = 100020, .x = 1};
    const struct mavlink_attitude level = {.time_boot_ms = 100100};
    const uint64_t later_ns = START + 60 * S;
    struct mavlink_pose pose;
    give_attitude(&v, 0, 0, 0, 0);
    CHECK(mavlink_vehicle_pose(&v, START, &pose));
    CHECK(give(&v, 7, 1, MAVLINK_LOCAL_POSITION_NED, &place, START + 20 * MS));
    CHECK(give(&v, 9, 1, MAVLINK_HEARTBEAT, &submarine, later_ns));
    CHECK(give(&v, 9, 1, MAVLINK_ATTITUDE, &level, later_ns));
    CHECK_INT(v.refused, 0);
    CHECK(mavlink_vehicle_pose(&v, later_ns, &pose));
    CHECK_INT(pose.t_ns, later_ns);
    CHECK_INT(pose.has, MAVLINK_POSE_ATTITUDE);
}

/* A sample of the thrusters and an attitude, of an autopilot whose clock is ahead by so much. */
static void give_pulses(struct mavlink_vehicle *v, const uint8_t from[2], uint32_t ms, uint32_t ahead_ms, int us)
{
    const uint32_t boot_ms = 100000 + ms + ahead_ms;
    const struct mavlink_attitude level = {.time_boot_ms = boot_ms};
    struct mavlink_servo_output_raw m = {.time_usec = boot_ms * 1000};
    for (int k = 0; k < 6; k++)
        m.servo[k] = (uint16_t)us;
    give(v, from[0], from[1], MAVLINK_ATTITUDE, &level, START + ms * MS);
    give(v, from[0], from[1], MAVLINK_SERVO_OUTPUT_RAW, &m, START + ms * MS);
}

static void give_params(struct mavlink_vehicle *v)
{
    struct mavlink_param_value m = {0};
    while (mavlink_thrusters_ask(&v->thrusters, true, m.param_id)) {
        int n = 0;
        m.param_value = 1; /* FRAME_CONFIG, MOT_n_DIRECTION */
        if (sscanf(m.param_id, "SERVO%d", &n) == 1)
            m.param_value = n <= 6 ? (float)(32 + n) : 0;
        give(v, 7, 1, MAVLINK_PARAM_VALUE, &m, START);
    }
}

TEST(the_autopilots_thrusters_alone_bound_the_speed)
{
    static const uint8_t own[2] = {7, 1}, gimbal[2] = {7, 154}, other[2] = {9, 1};
    const struct mavlink_heartbeat armed = {.type = 12, .autopilot = 3, .base_mode = 209};
    struct mavlink_vehicle v = vehicle_at_start(1013);
    double mps[2];
    uint64_t t_ns;
    uint32_t ms = 0;
    give_params(&v);
    for (; ms < 60000; ms += 50) {
        give(&v, 7, 1, MAVLINK_HEARTBEAT, &submarine, START + ms * MS);
        give(&v, 7, 154, MAVLINK_HEARTBEAT, &armed, START + ms * MS);
        give(&v, 9, 1, MAVLINK_HEARTBEAT, &armed, START + ms * MS);
        give_pulses(&v, own, ms, 0, 1500);
        give_pulses(&v, gimbal, ms, 0, 1900);
        give_pulses(&v, other, ms, 0, 1900);
        mavlink_thrusters_take(&v.thrusters, &t_ns, mps);
    }
    CHECK(!v.thrusters.armed);
    CHECK_INT(mavlink_thrusters_why(&v.thrusters, START + ms * MS), MAVLINK_BOUND);
    CHECK(mps[0] < 0.3);
    /* another one with the same ids: nobody knows whose thrusters they are */
    for (const uint32_t end_ms = ms + 5000; ms < end_ms; ms += 50) {
        give(&v, 7, 1, MAVLINK_HEARTBEAT, &submarine, START + ms * MS);
        give_pulses(&v, own, ms, 0, 1500);
        give_pulses(&v, own, ms, 30000, 1900);
        if (end_ms - ms < 4000)
            CHECK(mavlink_thrusters_why(&v.thrusters, START + ms * MS) != MAVLINK_BOUND || v.thrusters.mps[0] > 2);
    }
    CHECK_INT(mavlink_thrusters_why(&v.thrusters, START + ms * MS), MAVLINK_NO_CLOCK);
}

TEST(at_most_fifty_poses_a_second)
{
    uint64_t random = test_seed();
    for (uint32_t rate = 10; rate <= 400; rate *= 2) {
        struct mavlink_vehicle v = vehicle_at_start(1013);
        struct mavlink_pose pose;
        int poses = 0;
        uint64_t last_ns = 0;
        for (uint32_t i = 0; i < 4 * rate; i++) { /* up to 3 ms early or late */
            const uint32_t ms = i * 1000 / rate + (uint32_t)(test_random(&random) % 4);

            give_attitude(&v, ms, 0, 0, 0);
            if (!mavlink_vehicle_pose(&v, START + ms * MS, &pose))
                continue;
            CHECK(pose.t_ns > last_ns);
            last_ns = pose.t_ns;
            poses++;
        }
        CHECK(poses <= 4 * 50 + 2 && poses >= 4 * (rate < 50 ? (int)rate : 50) - 4);
    }
}

TEST(a_second_message_of_the_same_time_is_no_second_pose)
{
    struct mavlink_vehicle v = vehicle_at_start(1013);
    const struct mavlink_attitude_quaternion same = {100000, 1, 0, 0, 0, 0, 0, 0};
    struct mavlink_pose pose;
    give_attitude(&v, 0, 0, 0, 0);
    CHECK(mavlink_vehicle_pose(&v, START, &pose));
    give(&v, 7, 1, MAVLINK_ATTITUDE_QUATERNION, &same, START);
    CHECK(!mavlink_vehicle_pose(&v, START + 50 * MS, &pose));
}

/* ---- obstacles ---- */

#define NEAR_M 1.1

/* A result of `sectors`, all of one kind, with one other sector. */
static struct mavlink_ring ring_with(const char *all, const char *one, int at)
{
    struct mavlink_ring ring = {0};
    json_t *sectors = json_array(), *result;
    for (int i = 0; i < MAVLINK_SECTORS; i++)
        json_array_append_new(sectors, json_loads(one && i == at ? one : all, 0, NULL));
    result = json_pack("{s:f, s:f, s:o}", "t_unix", 1.7e9, "near_m", NEAR_M, "sectors", sectors);
    CHECK(mavlink_ring_read(&ring, result));
    json_decref(result);
    return ring;
}

#define CLEAR   "{\"state\":\"clear\",\"range_m\":null,\"free_to_m\":20,\"blind_to_m\":0.25,\"age_s\":3.5}"
#define UNKNOWN "{\"state\":\"unknown\",\"range_m\":null,\"free_to_m\":0,\"blind_to_m\":0,\"age_s\":null}"
#define BLOCKED "{\"state\":\"blocked\",\"range_m\":7.259,\"free_to_m\":7.1,\"blind_to_m\":0.25,\"age_s\":0.25}"

static struct mavlink_obstacle_distance distances(const struct mavlink_ring *ring, enum mavlink_unknown as,
                                                  double max_m)
{
    const struct mavlink_obstacle_conf conf = {.unknown_as = as, .unknown_m = 3.999};
    struct mavlink_obstacle_distance m;
    mavlink_ring_distances(ring, &conf, max_m, 123456, &m);
    return m;
}

TEST(every_field_of_the_distances)
{
    const struct mavlink_ring ring = ring_with(CLEAR, NULL, 0);
    const struct mavlink_obstacle_conf north = {.north = true};
    struct mavlink_obstacle_distance m = distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, 20);
    CHECK(m.time_usec == 123456 && m.min_distance == 110 && m.max_distance == 2000 && m.sensor_type == 1);
    CHECK(m.increment == 5 && m.increment_f == 0 && m.angle_offset == 0 && m.frame == 12);
    for (int i = 0; i < MAVLINK_SECTORS; i++)
        CHECK_INT(m.distances[i], 2001);
    mavlink_ring_distances(&ring, &north, 20, 0, &m);
    CHECK_INT(m.frame, 0);
}

TEST(min_distance_is_what_is_known_but_ignores_no_obstacle)
{
    struct mavlink_ring ring = ring_with(CLEAR, BLOCKED, 18);
    const struct mavlink_obstacle_conf conf = {0};
    struct mavlink_obstacle_distance_3d point[MAVLINK_FACES];
    ring.near_m = 1.139;
    CHECK_INT(distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, 20).min_distance, 113);
    CHECK_INT(mavlink_ring_points(&ring, &conf, 0, 20, 0, point), 1);
    CHECK(point[0].min_distance == (float)1.139);
    ring.sector[18].range_m = 0.45;
    const struct mavlink_obstacle_distance m = distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, 20);
    CHECK_INT(m.distances[18], 45);
    CHECK_INT(m.min_distance, 45);
    CHECK_INT(mavlink_ring_points(&ring, &conf, 0, 20, 0, point), 1);
    CHECK(point[0].min_distance == (float)0.45);
    ring.near_m = 30; /* beyond what is told */
    ring.sector[18].range_m = 25;
    CHECK_INT(distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, 20).min_distance, 2000);
}

TEST(an_obstacle_counts_in_three_sectors_rounded_down)
{
    for (int at = 0; at < MAVLINK_SECTORS; at++) {
        const struct mavlink_ring ring = ring_with(at & 1 ? CLEAR : UNKNOWN, BLOCKED, at);
        const struct mavlink_obstacle_distance m = distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, 20);
        for (int i = 0; i < MAVLINK_SECTORS; i++) {
            const int away = (i - at + MAVLINK_SECTORS) % MAVLINK_SECTORS;
            CHECK_INT(m.distances[i], away <= 1 || away == MAVLINK_SECTORS - 1 ? 725 : at & 1 ? 2001 : 65535);
        }
    }
}

TEST(unknown_is_what_was_chosen)
{
    const struct mavlink_ring ring = ring_with(UNKNOWN, CLEAR, 9);
    static const int want[] = {[MAVLINK_UNKNOWN_AS_UNKNOWN] = 65535,
                               [MAVLINK_UNKNOWN_AS_FAR] = 2001,
                               [MAVLINK_UNKNOWN_AS_DISTANCE] = 399};
    for (int as = 0; as < 3; as++) {
        const struct mavlink_obstacle_distance m = distances(&ring, (enum mavlink_unknown)as, 20);
        CHECK_INT(m.distances[0], want[as]);
        CHECK_INT(m.distances[9], 2001);
    }
    struct mavlink_ring none;
    mavlink_ring_forget(&none);
    CHECK(none.youngest_s < 0);
    CHECK_INT(distances(&none, MAVLINK_UNKNOWN_AS_UNKNOWN, 20).distances[71], 65535);
}

TEST(ranges_at_the_ends)
{
    static const struct {
        const char *name, *sector;
        double max_m;
        int want;
    } rows[] = {
        {"touching", "{\"state\":\"blocked\",\"range_m\":0,\"free_to_m\":0,\"blind_to_m\":0.25,\"age_s\":0}", 20,
         1},
        {"under a centimetre",
         "{\"state\":\"blocked\",\"range_m\":0.0099,\"free_to_m\":0,\"blind_to_m\":0.25,\"age_s\":0}", 20, 1},
        {"whole in decimal only",
         "{\"state\":\"blocked\",\"range_m\":0.29,\"free_to_m\":0,\"blind_to_m\":0.25,\"age_s\":0}", 20, 29},
        {"at the limit", "{\"state\":\"blocked\",\"range_m\":20,\"free_to_m\":19,\"blind_to_m\":0.25,\"age_s\":0}",
         20, 2000},
        {"just beyond, not free",
         "{\"state\":\"blocked\",\"range_m\":20.3,\"free_to_m\":19,\"blind_to_m\":0.25,\"age_s\":0}", 20, 2000},
        {"beyond, and free to there",
         "{\"state\":\"blocked\",\"range_m\":30,\"free_to_m\":29,\"blind_to_m\":0.25,\"age_s\":0}", 20, 2001},
        {"farther than can be said",
         "{\"state\":\"blocked\",\"range_m\":900,\"free_to_m\":0,\"blind_to_m\":0.25,\"age_s\":0}", 800, 65533},
        {"clear farther than that", CLEAR, 800, 65534},
        {"behind the vehicle",
         "{\"state\":\"blocked\",\"range_m\":-5,\"free_to_m\":0,\"blind_to_m\":0.25,\"age_s\":0}", 20, 1},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const struct mavlink_ring ring = ring_with(rows[i].sector, NULL, 0);
        const int got = distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, rows[i].max_m).distances[5];
        if (got != rows[i].want)
            printf("# %s\n", rows[i].name);
        CHECK_INT(got, rows[i].want);
    }
    static const struct {
        double m;
        int cm;
    } ends[] = {{NAN, 1},     {-INFINITY, 1}, {-1e300, 1},   {-0.0, 1},       {5e-324, 1},
                {9.995, 999}, {10, 1000},     {1e300, 1000}, {INFINITY, 1000}};
    for (size_t i = 0; i < sizeof ends / sizeof *ends; i++)
        CHECK_INT(mavlink_centimetres(ends[i].m, 1000), ends[i].cm);
}

TEST(water_is_free_only_where_it_is_known_from_near_on)
{
    static const struct {
        const char *name, *sector;
        int want;
    } rows[] = {
        {"known from near on", "{\"state\":\"clear\",\"free_to_m\":20,\"blind_to_m\":1.1,\"age_s\":0}", 2001},
        {"known farther out", "{\"state\":\"clear\",\"free_to_m\":20,\"blind_to_m\":1.1001,\"age_s\":0}", 65535},
        {"nobody says from where on", "{\"state\":\"clear\",\"free_to_m\":20,\"age_s\":0}", 65535},
        {"an obstacle behind water of which only the far end is known",
         "{\"state\":\"blocked\",\"range_m\":5,\"free_to_m\":4.9,\"blind_to_m\":3,\"age_s\":0}", 500},
        {"one beyond, the water known from near on",
         "{\"state\":\"blocked\",\"range_m\":30,\"free_to_m\":29,\"blind_to_m\":1,\"age_s\":0}", 2001},
        {"one beyond, the water known farther out",
         "{\"state\":\"blocked\",\"range_m\":30,\"free_to_m\":29,\"blind_to_m\":3,\"age_s\":0}", 2000},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const struct mavlink_ring ring = ring_with(rows[i].sector, NULL, 0);
        const int got = distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, 20).distances[5];
        if (got != rows[i].want)
            printf("# %s\n", rows[i].name);
        CHECK_INT(got, rows[i].want);
        CHECK(mavlink_ring_known(&ring) == (rows[i].want != 65535));
    }
}

TEST(the_youngest_evidence_counts)
{
    CHECK_NEAR(ring_with(CLEAR, BLOCKED, 3).youngest_s, 0.25, 0, 0);
    CHECK_NEAR(ring_with(UNKNOWN, CLEAR, 3).youngest_s, 3.5, 0, 0);
    CHECK(ring_with(UNKNOWN, NULL, 0).youngest_s < 0);
}

TEST(what_is_no_ring_changes_nothing)
{
    static const char *const results[] = {
        "{}", "[]", "{\"t_unix\":1,\"sectors\":[]}", "{\"t_unix\":1,\"sectors\":7}", "null",
    };
    struct mavlink_ring ring = ring_with(BLOCKED, NULL, 0);
    const struct mavlink_ring before = ring;
    for (size_t i = 0; i < sizeof results / sizeof *results; i++) {
        json_t *result = json_loads(results[i], JSON_DECODE_ANY, NULL);
        CHECK(!mavlink_ring_read(&ring, result));
        json_decref(result);
    }
    CHECK(memcmp(&ring, &before, sizeof ring) == 0);
}

TEST(a_doubted_ring_has_obstacles_but_no_free_water)
{
    static const char beyond[] =
        "{\"state\":\"blocked\",\"range_m\":30,\"free_to_m\":29,\"blind_to_m\":0.25,\"age_s\":0}";
    struct mavlink_ring ring = ring_with(CLEAR, BLOCKED, 20);

    mavlink_ring_doubt(&ring);
    const struct mavlink_obstacle_distance m = distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, 20);
    for (int i = 0; i < MAVLINK_SECTORS; i++)
        CHECK_INT(m.distances[i], i >= 19 && i <= 21 ? 725 : 65535);
    ring = ring_with(beyond, NULL, 0);
    mavlink_ring_doubt(&ring);
    CHECK_INT(distances(&ring, MAVLINK_UNKNOWN_AS_UNKNOWN, 20).distances[0], 2000);
}

TEST(a_ring_is_known_by_one_sector)
{
    struct mavlink_ring ring = {0};
    CHECK(!mavlink_ring_known(&ring));
    ring = ring_with(UNKNOWN, BLOCKED, 71);
    CHECK(mavlink_ring_known(&ring));
    mavlink_ring_doubt(&ring);
    CHECK(mavlink_ring_known(&ring)); /* an obstacle is held */
    ring = ring_with(UNKNOWN, CLEAR, 71);
    CHECK(mavlink_ring_known(&ring));
    mavlink_ring_doubt(&ring);
    CHECK(!mavlink_ring_known(&ring));
}

TEST(each_face_gives_its_nearest_point)
{
    struct mavlink_ring ring = ring_with(CLEAR, BLOCKED, 18);
    const struct mavlink_obstacle_conf conf = {0};
    struct mavlink_obstacle_distance_3d point[MAVLINK_FACES];
    ring.sector[20] = (struct mavlink_sector){MAVLINK_SECTOR_BLOCKED, 9, 9}; /* same face, farther */
    ring.sector[71] = (struct mavlink_sector){MAVLINK_SECTOR_BLOCKED, 4, 4}; /* of the face ahead */
    CHECK_INT(mavlink_ring_points(&ring, &conf, M_PI / 6, 20, 1234, point), 2);
    CHECK_NEAR(point[0].x, 4 * cos(M_PI / 6) * cos(M_PI / 36), 1e-6, 0);
    CHECK_NEAR(point[0].y, -4 * cos(M_PI / 6) * sin(M_PI / 36), 1e-6, 0);
    CHECK_NEAR(point[0].z, -2, 1e-6, 0); /* down is positive */
    CHECK_NEAR(point[1].x, 0, 0, 1e-5);
    CHECK_NEAR(point[1].y, 7.259 * cos(M_PI / 6), 1e-6, 0);
    CHECK(point[1].time_boot_ms == 1234 && point[1].obstacle_id == 65535 && point[1].sensor_type == 1);
    CHECK(point[1].frame == 12 && point[1].max_distance == 20 && point[1].min_distance == (float)NEAR_M);
    ring = ring_with(BLOCKED, NULL, 0);
    CHECK_INT(mavlink_ring_points(&ring, &conf, 0, 20, 0, point), MAVLINK_FACES);
    ring = ring_with(UNKNOWN, NULL, 0);
    CHECK_INT(mavlink_ring_points(&ring, &conf, 0, 20, 0, point), 0);
}

/* ---- texts ---- */

TEST(what_lasts_is_told_and_told_off)
{
    struct mavlink_alert alert = {0};
    struct mavlink_statustext m;
    mavlink_alert_set(&alert, true, START, "sonar %s: lost", "front");
    CHECK(!mavlink_alert_due(&alert, START + 999 * MS, &m));
    CHECK(mavlink_alert_due(&alert, START + S, &m));
    CHECK_INT(m.severity, 4);
    CHECK(strncmp(m.text, "sonar front: lost", 50) == 0);
    CHECK(!mavlink_alert_due(&alert, START + 60 * S, &m)); /* once */
    mavlink_alert_set(&alert, false, START + 60 * S, "sonar %s: back", "front");
    CHECK(mavlink_alert_due(&alert, START + 62 * S, &m));
    CHECK_INT(m.severity, 5);
    CHECK(strncmp(m.text, "sonar front: back", 50) == 0);
    alert = (struct mavlink_alert){.grave = true};
    mavlink_alert_set(&alert, true, START, "LEAK");
    CHECK(mavlink_alert_due(&alert, START, &m) && m.severity == 2); /* at once */
    mavlink_alert_set(&alert, false, START + 6 * S, "dry");
    CHECK(!mavlink_alert_due(&alert, START + 7 * S - 1, &m) && mavlink_alert_due(&alert, START + 7 * S, &m));
}

TEST(flapping_is_told_every_five_seconds_at_most)
{
    struct mavlink_alert alert = {0};
    struct mavlink_statustext m = {0};
    uint64_t random = test_seed(), t_ns = START, told_ns = 0;
    bool failed = false;
    for (int i = 0; i < 1000; i++) {
        failed = test_random(&random) % 2;
        for (int k = (int)(test_random(&random) % 40); k > 0; k--, t_ns += 100 * MS) {
            mavlink_alert_set(&alert, failed, t_ns, "%s", failed ? "lost" : "back");
            if (!mavlink_alert_due(&alert, t_ns, &m))
                continue;
            CHECK(told_ns == 0 || t_ns >= told_ns + 5 * S);
            CHECK(strcmp(m.text, failed ? "lost" : "back") == 0);
            told_ns = t_ns;
        }
    }
    t_ns += 6 * S; /* the last word is the truth */
    mavlink_alert_due(&alert, t_ns, &m);
    CHECK(alert.told_failed == alert.failed);
}

TEST(texts_fit_and_are_plain)
{
    struct mavlink_alert alert = {0};
    struct mavlink_statustext m;
    mavlink_alert_set(&alert, true, START, "%s", "\x1b[2J\xc3\xa4 123456789 123456789 123456789 123456789 12");
    CHECK(mavlink_alert_due(&alert, START + S, &m));
    CHECK_INT(m.text[49], 0);
    CHECK(strcmp(m.text, "?[2J?? 123456789 123456789 123456789 123456789 12") == 0);
    CHECK(m.id == 0 && m.chunk_seq == 0);
    CHECK(!mavlink_alert_due(&alert, START + S, &m));
}

/* A receiver joins the parts of one id, and knows the last by the room that it leaves. */
TEST(long_texts_go_out_in_parts)
{
    struct mavlink_alert alert = {0};
    struct mavlink_statustext m;
    char text[300], whole[300] = "";
    for (int length = 48; length < 300; length++) {
        const uint64_t t_ns = START + (uint64_t)length * 20 * S;
        const int parts = length < 50 ? 1 : (length < 255 ? length : 255) / 50 + 1;
        uint16_t id = 0;
        for (int i = 0; i < length; i++)
            text[i] = (char)('a' + i % 26);
        text[length] = '\0';
        mavlink_alert_set(&alert, true, t_ns, "%s", text);
        whole[0] = '\0';
        for (int part = 0; part < parts; part++) {
            CHECK(mavlink_alert_due(&alert, t_ns + S, &m));
            CHECK_INT(m.chunk_seq, part);
            CHECK(parts == 1 ? m.id == 0 : m.id != 0 && (part == 0 || m.id == id));
            CHECK((m.text[49] == '\0') == (part == parts - 1));
            id = m.id;
            snprintf(whole + strlen(whole), sizeof whole - strlen(whole), "%.50s", m.text);
        }
        CHECK(!mavlink_alert_due(&alert, t_ns + S, &m));
        text[255] = '\0';
        CHECK_STR(whole, text);
        mavlink_alert_set(&alert, false, t_ns + 8 * S, "well");
        CHECK(mavlink_alert_due(&alert, t_ns + 10 * S, &m) && m.id == 0 &&
              !mavlink_alert_due(&alert, t_ns + 10 * S, &m));
    }
}

/* ---- the link's address ---- */

TEST(addresses_of_links)
{
    static const struct {
        const char *text;
        bool good;
        enum mavlink_link_kind kind;
    } rows[] = {
        {"udp:127.0.0.1:14550", true, MAVLINK_UDP},
        {"udp:blueos.local:14550", true, MAVLINK_UDP},
        {"udp:::1:14550", true, MAVLINK_UDP},
        {"udpout:192.168.2.2:14551", true, MAVLINK_UDP},
        {"udpin:14550", true, MAVLINK_UDPIN},
        {"udpin:0.0.0.0:14550", true, MAVLINK_UDPIN},
        {"udpin:127.0.0.1:14550", true, MAVLINK_UDPIN},
        {"serial:/dev/ttyAMA0:115200", true, MAVLINK_SERIAL},
        {"serial:/dev/serial/by-path/a:1.0:57600", true, MAVLINK_SERIAL},
        {"", false, 0},
        {"14550", false, 0},
        {"udp:14550", false, 0},
        {"udp::14550", false, 0},
        {"udpin:host:14550", false, 0},
        {"udpin::14550", true, MAVLINK_UDPIN},
        {"udpin:300.0.0.1:14550", false, 0},
        {"udpin:0", false, 0},
        {"udpin:65536", false, 0},
        {"udpin:1455O", false, 0},
        {"udp:host:999999999999999999999", false, 0},
        {"serial:/dev/ttyAMA0", false, 0},
        {"serial:/dev/ttyAMA0:1", false, 0},
        {"tcp:host:5760", false, 0},
    };
    struct fault fault;
    char text[400] = "udp:";

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct mavlink_link link;
        fault.text[0] = '\0';
        if (mavlink_link_init(&link, rows[i].text, &fault) != rows[i].good) {
            printf("# %s\n", rows[i].text);
            CHECK(false);
        }
        CHECK((fault.text[0] != '\0') == !rows[i].good);
        CHECK(!rows[i].good || link.kind == rows[i].kind);
    }
    struct mavlink_link link;
    memset(text + 4, 'h', 300);
    strcpy(text + 304, ":14550");
    CHECK(!mavlink_link_init(&link, text, &fault));
}

/* In the place of the C library's, which may ask a network: it knows no name. */
static int look_ups;

int getaddrinfo(const char *restrict node, const char *restrict service, const struct addrinfo *restrict hints,
                struct addrinfo **restrict found)
{
    static struct sockaddr_in name;
    static struct addrinfo result;
    look_ups++;
    name = (struct sockaddr_in){.sin_family = AF_INET, .sin_port = htons((uint16_t)atoi(service))};
    if (node && inet_pton(AF_INET, node, &name.sin_addr) != 1)
        return EAI_NONAME;
    result = (struct addrinfo){.ai_family = AF_INET,
                               .ai_socktype = hints->ai_socktype,
                               .ai_addr = (struct sockaddr *)&name,
                               .ai_addrlen = sizeof name};
    *found = &result;
    return 0;
}

void freeaddrinfo(struct addrinfo *found)
{
    (void)found;
}

static struct sockaddr_in name_of(int fd)
{
    struct sockaddr_in name;
    socklen_t size = sizeof name;
    CHECK(getsockname(fd, (struct sockaddr *)&name, &size) == 0);
    return name;
}

static int udp_socket(struct sockaddr_in *name)
{
    const int fd = socket(AF_INET, SOCK_DGRAM, 0);
    *name = (struct sockaddr_in){.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    CHECK(bind(fd, (struct sockaddr *)name, sizeof *name) == 0);
    *name = name_of(fd);
    return fd;
}

/* The next datagram; 0: none came. */
static char heard(int fd)
{
    char c = 0;
    return patience_for(fd, POLLIN) && recv(fd, &c, 1, 0) == 1 ? c : 0;
}

TEST(udpin_answers_whom_it_is_told_to)
{
    char buffer[10];
    struct fault fault;
    struct mavlink_link link;
    CHECK(mavlink_link_init(&link, "udpin:14550", &fault));
    strcpy(link.port, "0"); /* any that is free */
    CHECK(mavlink_link_open(&link, START));

    struct sockaddr_in name = name_of(link.fd), none;
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int first = udp_socket(&none), second = udp_socket(&none);
    mavlink_link_write(&link, "x", 1, START); /* to nobody */
    CHECK_INT(link.dropped, 1);
    for (int i = 0; i < 3; i++) { /* not the second one, only because it has sent something */
        CHECK(sendto(i == 0 ? first : second, "hi", 2, 0, (struct sockaddr *)&name, sizeof name) == 2);
        CHECK(patience_for(link.fd, POLLIN));
        CHECK_INT(mavlink_link_read(&link, buffer, sizeof buffer, START), 2);
        if (i != 1)
            mavlink_link_answer(&link);
        mavlink_link_write(&link, "x", 1, START);
        CHECK_INT(heard(i < 2 ? first : second), 'x');
    }
    mavlink_link_close(&link);
    close(first);
    close(second);
}

TEST(a_serial_line_that_went_away_is_tried_again_after_a_second)
{
    char path[100], address[120], buffer[10];
    struct fault fault;
    struct mavlink_link link;
    const int far = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    CHECK(grantpt(far) == 0 && unlockpt(far) == 0 && ptsname_r(far, path, sizeof path) == 0);
    snprintf(address, sizeof address, "serial:%s:115200", path);
    CHECK(mavlink_link_init(&link, address, &fault) && mavlink_link_open(&link, START));
    mavlink_link_write(&link, "abc", 3, START);
    CHECK(patience_for(far, POLLIN) && read(far, buffer, sizeof buffer) == 3 && write(far, "defg", 4) == 4);
    CHECK(patience_for(link.fd, POLLIN));
    CHECK_INT(mavlink_link_read(&link, buffer, sizeof buffer, START), 4);
    CHECK_INT(mavlink_link_read(&link, buffer, sizeof buffer, START), 0);
    CHECK(link.fd >= 0);
    for (int i = 0; i < 50000; i++) /* nobody reads: whole frames wait, the rest is dropped and counted */
        mavlink_link_write(&link, "0123456789", 10, START);
    CHECK(link.dropped > 0 && link.n_out <= sizeof link.out && (mavlink_link_events(&link) & POLLOUT));
    close(far);
    CHECK_INT(mavlink_link_read(&link, buffer, sizeof buffer, START), 0);
    CHECK(link.fd < 0 && strstr(link.error, "lost"));
    CHECK(!mavlink_link_open(&link, START + S / 2) && strstr(link.error, "lost"));
    CHECK(!mavlink_link_open(&link, START + S) && strstr(link.error, "cannot be opened"));
    mavlink_link_close(&link);
}

TEST(a_peer_that_is_not_there_is_told_until_it_is_heard)
{
    struct sockaddr_in name;
    char address[40], buffer[10];
    struct fault fault;
    struct mavlink_link link;
    const int fd = udp_socket(&name);
    int writes = 0;
    CHECK(connect(fd, (struct sockaddr *)&name, sizeof name) ==
          0); /* it hears itself alone: to others none is there */
    snprintf(address, sizeof address, "udp:127.0.0.1:%u", ntohs(name.sin_port));
    CHECK(mavlink_link_init(&link, address, &fault) && mavlink_link_open(&link, START));
    CHECK_STR(link.error, "");
    WAIT_UNTIL((mavlink_link_write(&link, "x", 1, START), writes++, link.error[0]));
    CHECK(strstr(link.error, "no peer answers: Connection refused"));
    CHECK(link.fd >= 0 && link.dropped > 0 && link.dropped < (unsigned)writes);
    const struct sockaddr_in from = name_of(link.fd);
    CHECK(connect(fd, (const struct sockaddr *)&from, sizeof from) == 0);
    WAIT_UNTIL(
        (mavlink_link_write(&link, "x", 1, START), recv(fd, buffer, 1, MSG_DONTWAIT) == 1)); /* some refused */
    CHECK(link.error[0] != '\0');
    CHECK(send(fd, "hi", 2, 0) == 2);
    WAIT_UNTIL(mavlink_link_read(&link, buffer, sizeof buffer, START) == 2);
    CHECK_STR(link.error, "");
    mavlink_link_close(&link);
    close(fd);
}

TEST(a_name_that_is_not_known_is_asked_for_more_and_more_seldom)
{
    struct mavlink_link link;
    struct fault fault;
    uint64_t now_ns = START, last_ns = 0;
    int attempts = 0;
    look_ups = 0;
    CHECK(mavlink_link_init(&link, "udp:nowhere.invalid:14550", &fault));
    for (; now_ns < START + 120 * S; now_ns += S / 2) {
        const uint64_t before_ns = link.retry_ns;
        CHECK(!mavlink_link_open(&link, now_ns) && strstr(link.error, "look-up"));
        if (link.retry_ns == before_ns)
            continue;
        CHECK(attempts == 0 || now_ns >= last_ns + S);
        last_ns = now_ns;
        attempts++;
    }
    CHECK_INT(look_ups, attempts);
    CHECK(attempts >= 6 && attempts <= 8); /* after 0, 1, 3, 7, 15, 31, 61, 91 s */
}

int main(void)
{
    RUN(the_clock_follows_the_least_delay);
    RUN(the_clock_follows_one_that_runs_slow);
    RUN(the_clock_goes_on_when_the_autopilots_wraps);
    RUN(the_clock_begins_anew_with_the_autopilot);
    RUN(the_clock_bears_messages_out_of_order_and_late_ones);
    RUN(steps_of_the_autopilots_clock_are_followed);
    RUN(an_autopilot_that_starts_anew_at_once_is_followed);
    RUN(a_wrong_timesync_answer_is_outlived);
    RUN(a_timesync_answer_takes_half_the_way_off);
    RUN(the_vehicle_is_whoever_beats_as_an_autopilot);
    RUN(euler_angles_become_the_quaternion);
    RUN(parts_go_out_together_at_the_time_of_the_attitude);
    RUN(depth_follows_from_pressure);
    RUN(values_that_cannot_be_are_refused);
    RUN(what_was_stuck_for_seconds_on_its_way_is_refused);
    RUN(another_autopilot_brings_its_own_clock);
    RUN(the_autopilots_thrusters_alone_bound_the_speed);
    RUN(at_most_fifty_poses_a_second);
    RUN(a_second_message_of_the_same_time_is_no_second_pose);
    RUN(every_field_of_the_distances);
    RUN(min_distance_is_what_is_known_but_ignores_no_obstacle);
    RUN(an_obstacle_counts_in_three_sectors_rounded_down);
    RUN(unknown_is_what_was_chosen);
    RUN(ranges_at_the_ends);
    RUN(water_is_free_only_where_it_is_known_from_near_on);
    RUN(the_youngest_evidence_counts);
    RUN(what_is_no_ring_changes_nothing);
    RUN(a_doubted_ring_has_obstacles_but_no_free_water);
    RUN(a_ring_is_known_by_one_sector);
    RUN(each_face_gives_its_nearest_point);
    RUN(what_lasts_is_told_and_told_off);
    RUN(flapping_is_told_every_five_seconds_at_most);
    RUN(texts_fit_and_are_plain);
    RUN(long_texts_go_out_in_parts);
    RUN(addresses_of_links);
    RUN(udpin_answers_whom_it_is_told_to);
    RUN(a_serial_line_that_went_away_is_tried_again_after_a_second);
    RUN(a_peer_that_is_not_there_is_told_until_it_is_heard);
    RUN(a_name_that_is_not_known_is_asked_for_more_and_more_seldom);
    return test_end();
}
