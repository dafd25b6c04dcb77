/* SPDX-License-Identifier: MIT */
/*
 * test_mavlink_steps - the whole bridge between an autopilot and a daemon of this test's own, on a clock that the test
 * turns. Frames keep their order, and each whole second ends with a heartbeat: what did not come before it was not
 * sent.
 */
#include <arpa/inet.h>

#include "client/mavlink/mavlink_bridge.h"
#include "client/mavlink/mavlink_messages.h"
#include "tests/lib/daemon_here.h"
#include "tests/lib/patience.h"

#define STEP     (100 * MS)
#define ASKED_NS 123456789 /* the autopilot's clock when it asks for ours */

/* What the autopilot heard in one second. */
struct heard {
    int obstacles, status;
    uint16_t ahead_cm; /* of the last obstacles */
    uint16_t left_cm;  /* likewise, in the fifth sector from the end */
    double stamp_s;    /* likewise, after START */
    char text[512];    /* of all texts, the parts of long ones joined */
    int below, points; /* messages of the water below, and of points */
    struct mavlink_distance_sensor last_below;
    struct mavlink_obstacle_distance_3d point[MAVLINK_SECTORS]; /* the first ones */
    bool asked_reports, asked_rates;                            /* for the estimator's messages; for any other */
    int asked_servos;                                           /* for what the thrusters do */
    bool asked_barometers;                                      /* for which is in the water */
    char param[20];                                             /* that was asked for last */
    int64_t synced_ns;                                          /* what it wrote into a question about its clock */
};

struct flight {
    struct daemon_here daemon;
    struct mavlink_link link;
    struct mavlink_bridge_conf conf;
    struct mavlink_bridge *bridge;
    struct mavlink_parser parser;
    struct mavlink_sender sender;
    struct sockaddr_in bridge_at;
    int fd;
    uint64_t now_ns;
    bool flies, answers; /* the autopilot speaks; the daemon does */
    bool pings;          /* the sonar does */
    bool thrusters;      /* the autopilot tells what they do, and its parameters */
    uint16_t pulse_us;   /* of all motors */
    int frame_config;
    double ping_s; /* it did last, after START; negative: never */
    double range_m;
    int poses;
    double hold_s; /* the bridge is held up for so long when it next has read the clock */
};

static struct flight f;
/* Of the next begin. */
static struct mavlink_feed_conf feed_conf = {.socket = path, .rate_hz = 10};

static void begin(void)
{
    struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t n = sizeof a;
    char address[64];
    struct fault fault;
    f = (struct flight){
        .now_ns = START, .pings = true, .range_m = 7, .sender = {.system_id = 7, .component_id = 1}};
    f.fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    CHECK(bind(f.fd, (struct sockaddr *)&a, n) == 0 && getsockname(f.fd, (struct sockaddr *)&a, &n) == 0);
    snprintf(address, sizeof address, "udp:127.0.0.1:%u", ntohs(a.sin_port));
    CHECK(mavlink_link_init(&f.link, address, &fault));
    f.conf = (struct mavlink_bridge_conf){
        .feed = feed_conf,
        .vehicle = {.surface_hpa = 1013.25, .density_kgpm3 = 1025},
        .obstacles = {.unknown_as = MAVLINK_UNKNOWN_AS_UNKNOWN},
        .component_id = 196,
    };
    listen_here(&f.daemon);
    f.daemon.status_watch = feed_conf.layers ? MAVLINK_LAYERS + 1 : 2;
    f.bridge = mavlink_bridge_new(&f.conf, &f.link, f.now_ns);
}

static void end(void)
{
    mavlink_bridge_end(f.bridge);
    leave_here(&f.daemon);
    close(f.fd);
}

static void say_frame(enum mavlink_id id, const void *content)
{
    uint8_t frame[MAVLINK_FRAME_MAX];
    const size_t n = mavlink_build(&f.sender, mavlink_message(id), content, frame);
    CHECK_INT(sendto(f.fd, frame, n, 0, (struct sockaddr *)&f.bridge_at, sizeof f.bridge_at), n);
}

static void say_param(const char *name)
{
    struct mavlink_param_value m = {.param_value = 1};
    int n;
    if (sscanf(name, "SERVO%d", &n) == 1)
        m.param_value = (float)(n <= 6 ? 32 + n : 0);
    if (strcmp(name, "FRAME_CONFIG") == 0)
        m.param_value = (float)f.frame_config;
    memcpy(m.param_id, name, strnlen(name, sizeof m.param_id));
    say_frame(MAVLINK_PARAM_VALUE, &m);
}

static void say_thrusters(void)
{
    struct mavlink_servo_output_raw m = {.time_usec = (uint32_t)(100000000 + (f.now_ns - START) / 1000)};
    for (int i = 0; i < 6; i++)
        m.servo[i] = f.pulse_us;
    say_frame(MAVLINK_SERVO_OUTPUT_RAW, &m);
}

/* The autopilot has been up for 100 s at START, and turns. */
static void say_vehicle(void)
{
    const struct mavlink_heartbeat beat = {.type = 12, .autopilot = 3, .mavlink_version = 3};
    const struct mavlink_attitude attitude = {.time_boot_ms = (uint32_t)(100000 + (f.now_ns - START) / MS),
                                              .yaw = (float)((double)(f.now_ns - START) * 1e-10)};
    if (!f.flies || !f.bridge_at.sin_port)
        return;
    say_frame(MAVLINK_HEARTBEAT, &beat);
    say_frame(MAVLINK_ATTITUDE, &attitude);
    if (f.thrusters)
        say_thrusters();
    patience_for(f.link.fd, POLLIN);
}

/* The autopilot goes on while the bridge is held up. */
static struct mavlink_time now(void)
{
    const struct mavlink_time t = {f.now_ns, OFFSET};
    const uint64_t end_ns = f.now_ns + (uint64_t)(f.hold_s * 1e9);
    f.hold_s = 0;
    while (f.now_ns < end_ns) {
        f.now_ns += STEP;
        say_vehicle();
    }
    return t;
}

static void step(void)
{
    const double at_s = (double)(f.now_ns - START) * 1e-9;
    say_vehicle();
    if (f.pings)
        f.ping_s = at_s - 0.1;
    if (f.answers && f.daemon.watches >= 2) {
        say_status(&f.daemon, f.ping_s < 0 ? -1 : at_s - f.ping_s, at_s);
        if (f.ping_s >= 0)
            say_sectors(&f.daemon, f.range_m, at_s - f.ping_s, at_s);
    }
    mavlink_bridge_work(f.bridge, now);
    if (f.answers)
        f.poses += agree(&f.daemon);
    f.now_ns += STEP;
}

/* False: that was the heartbeat. */
static bool hear(struct heard *h)
{
    uint8_t buffer[512];
    socklen_t size = sizeof f.bridge_at;
    struct mavlink_frame frame;
    CHECK(patience_for(f.fd, POLLIN));
    const ssize_t got = recvfrom(f.fd, buffer, sizeof buffer, 0, (struct sockaddr *)&f.bridge_at, &size);
    size_t n = got > 0 ? (size_t)got : 0;
    const uint8_t *bytes = buffer;
    if (!n || !mavlink_parser_next(&f.parser, &bytes, &n, &frame))
        return false;
    if (frame.message->id == MAVLINK_OBSTACLE_DISTANCE) {
        struct mavlink_obstacle_distance m;
        mavlink_unpack(frame.message, frame.payload, &m);
        h->obstacles++;
        h->ahead_cm = m.distances[0];
        h->left_cm = m.distances[MAVLINK_SECTORS - 5];
        h->stamp_s = (double)m.time_usec * 1e-6 - 100;
    } else if (frame.message->id == MAVLINK_STATUSTEXT) {
        struct mavlink_statustext m;
        mavlink_unpack(frame.message, frame.payload, &m);
        const size_t used = strlen(h->text);
        const bool goes_on = m.id != 0 && m.text[sizeof m.text - 1];
        snprintf(h->text + used, sizeof h->text - used, "%.50s%s", m.text, goes_on ? "" : ";");
    } else if (frame.message->id == MAVLINK_DISTANCE_SENSOR) {
        mavlink_unpack(frame.message, frame.payload, &h->last_below);
        h->below++;
    } else if (frame.message->id == MAVLINK_OBSTACLE_DISTANCE_3D) {
        struct mavlink_obstacle_distance_3d m;
        mavlink_unpack(frame.message, frame.payload, &m);
        if (h->points < MAVLINK_SECTORS)
            h->point[h->points] = m;
        h->points++;
    } else if (frame.message->id == MAVLINK_COMMAND_LONG) {
        struct mavlink_command_long m;
        mavlink_unpack(frame.message, frame.payload, &m);
        const bool report = m.param[0] == MAVLINK_EKF_STATUS_REPORT || m.param[0] == MAVLINK_ESTIMATOR_STATUS;
        h->asked_reports |= report;
        h->asked_servos += m.param[0] == MAVLINK_SERVO_OUTPUT_RAW;
        h->asked_rates |= !report && m.param[0] != MAVLINK_SERVO_OUTPUT_RAW && m.param[0] != MAVLINK_VFR_HUD;
    } else if (frame.message->id == MAVLINK_PARAM_REQUEST_READ) {
        struct mavlink_param_request_read m;
        mavlink_unpack(frame.message, frame.payload, &m);
        snprintf(h->param, sizeof h->param, "%.16s", m.param_id);
        h->asked_barometers |= strcmp(h->param, "BARO_PRIMARY") == 0 || strcmp(h->param, "GND_PRIMARY") == 0;
        if (f.thrusters)
            say_param(h->param);
    } else if (frame.message->id == MAVLINK_TIMESYNC) {
        struct mavlink_timesync m;
        mavlink_unpack(frame.message, frame.payload, &m);
        if (m.ts1 == ASKED_NS)
            h->synced_ns = m.tc1;
    } else if (frame.message->id == MAVLINK_HEARTBEAT) {
        struct mavlink_heartbeat m;
        mavlink_unpack(frame.message, frame.payload, &m);
        h->status = m.system_status;
        return false;
    }
    return true;
}

/* A second, its last step the one with the heartbeat. */
static struct heard second(void)
{
    struct heard h = {0};
    for (int i = 0; i < 10; i++)
        step();
    while (hear(&h)) {
    }
    return h;
}

/* What was heard in so many seconds, of the last one's heartbeat. */
static struct heard seconds(int n)
{
    struct heard all = {0};
    while (n-- > 0) {
        const struct heard h = second();
        const size_t used = strlen(all.text);
        all.obstacles += h.obstacles;
        all.ahead_cm = h.obstacles ? h.ahead_cm : all.ahead_cm;
        all.left_cm = h.obstacles ? h.left_cm : all.left_cm;
        all.stamp_s = h.obstacles ? h.stamp_s : all.stamp_s;
        all.status = h.status;
        snprintf(all.text + used, sizeof all.text - used, "%s", h.text);
    }
    return all;
}

/* The first heartbeat tells where the bridge is. */
static void begin_flight(void)
{
    struct heard h = {0};
    begin();
    step();
    while (hear(&h)) {
    }
    f.flies = f.answers = true;
    seconds(2);
}

/* The bridge has left it meanwhile. */
static void start_again(void)
{
    close(f.daemon.fd);
    f.daemon.fd = -1;
    f.daemon.watches = 0;
    f.answers = true;
}

TEST(obstacles_come_while_the_daemon_answers_and_no_longer)
{
    struct heard h;
    begin_flight();
    h = seconds(3);
    CHECK_INT(h.obstacles, 30);
    CHECK_INT(h.ahead_cm, 700);
    CHECK_INT(h.status, MAVLINK_STATE_ACTIVE);
    f.range_m = 3;
    CHECK_INT(second().ahead_cm, 300);
    f.answers = false; /* it hangs, its socket open */
    const double hung_s = (double)(f.now_ns - START) * 1e-9;
    h = second();
    CHECK(h.obstacles >= 9 && h.obstacles <= 10); /* those of its last second: what was said last, and as old */
    CHECK(h.ahead_cm == 300 && h.stamp_s < hung_s);
    h = seconds(5);
    CHECK_INT(h.obstacles, 0);
    CHECK_INT(h.status, MAVLINK_STATE_CRITICAL);
    CHECK(strstr(h.text, "sonard: offline") && !strstr(h.text, "sonar head"));
    start_again();
    h = seconds(4);
    CHECK(h.obstacles >= 10 && h.status == MAVLINK_STATE_ACTIVE);
    CHECK(strstr(h.text, "sonard: online again"));
    end();
}

TEST(a_silent_sonar_is_told_and_its_obstacles_keep_their_time)
{
    struct heard h;
    begin_flight();
    f.daemon.clear = 9;
    h = seconds(15);
    CHECK_STR(h.text, "");
    CHECK_INT(h.left_cm, 1001); /* free */
    f.pings = false;
    const double silent_s = (double)(f.now_ns - START) * 1e-9;
    h = seconds(4);
    CHECK(strstr(h.text, "sonar head: offline"));
    CHECK(h.obstacles == 40 && h.ahead_cm == 700 && h.stamp_s < silent_s);
    CHECK_INT(h.left_cm, UINT16_MAX); /* what was free is unknown */
    f.pings = true;
    h = seconds(8);
    CHECK(strstr(h.text, "sonar head: online again"));
    CHECK(h.obstacles == 80 && h.stamp_s > silent_s + 10);
    CHECK_STR(seconds(5).text, "");
    end();
}

TEST(what_is_late_at_the_start_is_no_fault)
{
    struct heard h = {0};
    begin();
    f.pings = false;
    f.ping_s = -1;
    step();
    while (hear(&h)) {
    }
    f.flies = true;
    CHECK_STR(seconds(3).text, ""); /* no daemon yet */
    f.answers = true;
    h = seconds(5); /* no ping yet */
    CHECK_STR(h.text, "");
    CHECK_INT(h.obstacles, 0);
    f.pings = true;
    h = seconds(4);
    CHECK_STR(h.text, "");
    CHECK(h.obstacles >= 30);
    end();
}

TEST(poses_have_the_time_of_their_measurement)
{
    begin_flight();
    f.poses = 0;
    seconds(3);
    CHECK(f.poses >= 29 && f.poses <= 31);
    CHECK_NEAR(f.daemon.pose_unix, T_UNIX + (double)(f.now_ns - START) * 1e-9 - 0.1, 0, 0.11);
    f.flies = false;
    second();
    f.poses = 0;
    seconds(3);
    CHECK_INT(f.poses, 0);
    end();
}

/* It asks for what it needs, tells the daemon how fast the vehicle can be, and why it no longer can. */
TEST(what_the_thrusters_do_bounds_the_speed)
{
    begin_flight();
    seconds(2);
    const struct heard h = second();
    CHECK(h.asked_servos >= 1 && h.param[0] && h.asked_barometers);
    CHECK_STR(f.daemon.no_bound, "parameters");
    f.thrusters = true;
    f.pulse_us = 1500;
    f.frame_config = 1;
    seconds(40);
    const int bounds = f.daemon.bounds;
    CHECK(bounds > 300 && f.daemon.bound_mps < 0.2);
    CHECK_INT(f.daemon.pushes, bounds);
    f.pulse_us = 1600; /* all motors of one side */
    seconds(10);
    CHECK(f.daemon.bound_mps > 0.3);
    f.pulse_us = 2000;
    f.daemon.bounds = 0;
    seconds(2);
    CHECK_INT(f.daemon.bounds, 0);
    CHECK_STR(f.daemon.no_bound, "pulses");
    f.pulse_us = 1500;
    f.frame_config = 9; /* it is asked for again now and then */
    seconds(40);
    CHECK_STR(f.daemon.no_bound, "frame");
    end();
}

/* In the daemon's words, once it has lasted, and not while a bound of the speed counts. */
TEST(the_pilot_is_told_what_to_set)
{
    static const char drift[] =
        "no position: 18.0 m of drift allowed for in a scan of 12 s; set `current` in [vehicle]: with ...";

    begin_flight();
    f.daemon.drift = drift;
    f.daemon.bounded = true;
    CHECK_STR(seconds(60).text, "");
    f.daemon.bounded = false;
    CHECK_STR(seconds(25).text, "");
    const struct heard h = seconds(20);
    CHECK(strncmp(h.text, "sonard: ", 8) == 0 && strncmp(h.text + 8, drift, strlen(drift)) == 0);
    CHECK_STR(h.text + 8 + strlen(drift), ";");
    f.daemon.bounded = true;
    CHECK_STR(seconds(20).text, "sonard: drift bounded, or position known;");
    end();
}

/* The autopilot sends to a port of ours, from `f.fd`. */
static void begin_flight_to_us(void)
{
    struct fault fault;
    socklen_t size = sizeof f.bridge_at;
    begin();
    CHECK(mavlink_link_init(&f.link, "udpin:14550", &fault));
    strcpy(f.link.port, "0"); /* any that is free */
    CHECK(mavlink_link_open(&f.link, f.now_ns));
    CHECK(getsockname(f.link.fd, (struct sockaddr *)&f.bridge_at, &size) == 0);
    f.bridge_at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    f.flies = f.answers = true;
}

/* Speaks from a socket of its own as the vehicle does, but of a roll that the vehicle never has; `stranger`: its fd. */
static void say_rolled(int stranger, bool beats)
{
    const int own = f.fd;
    const struct mavlink_heartbeat beat = {.type = 12, .autopilot = 3, .mavlink_version = 3};
    const struct mavlink_attitude attitude = {.time_boot_ms = (uint32_t)(100900 + (f.now_ns - START) / MS),
                                              .roll = 1};
    f.fd = stranger;
    if (beats)
        say_frame(MAVLINK_HEARTBEAT, &beat);
    say_frame(MAVLINK_ATTITUDE, &attitude);
    f.fd = own;
    patience_for(f.link.fd, POLLIN);
}

TEST(a_stranger_is_not_believed_beside_the_autopilot)
{
    const int stranger = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    uint8_t cut[] = {0xFD, 40, 0, 0, 0, 7, 1};
    begin_flight_to_us();
    say_rolled(stranger, false); /* no heartbeat: this is nobody */
    seconds(2);
    f.poses = 0;
    for (int i = 0; i < 60; i++) {
        struct heard h = {0};
        say_rolled(stranger, i > 30);
        /* the start of a frame, which would take the vehicle's next one in */
        CHECK(sendto(stranger, cut, sizeof cut, 0, (struct sockaddr *)&f.bridge_at, sizeof f.bridge_at) > 0);
        step();
        if (i % 10 == 9)
            while (hear(&h)) {
            }
    }
    CHECK(f.poses >= 59);
    CHECK_NEAR(f.daemon.rolled, 0, 0, 1e-9);
    CHECK(recv(stranger, cut, sizeof cut, 0) < 0); /* nor answered */
    end();
    close(stranger);
}

/* A router that has restarted sends from another port. */
TEST(a_peer_that_is_silent_is_replaced)
{
    const int next = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    begin_flight_to_us();
    seconds(2);
    const int before = f.fd;
    f.fd = next;
    f.poses = 0;
    for (int i = 0; i < 48; i++)
        step();
    CHECK_INT(f.poses, 0);
    for (int i = 0; i < 30; i++)
        step();
    CHECK(f.poses >= 20);
    f.fd = before;
    end();
    close(next);
}

TEST(nor_do_poses_lose_it_when_the_bridge_is_held_up)
{
    begin_flight();
    seconds(3);
    f.hold_s = 0.8;
    for (int i = 0; i < 3; i++) {
        f.poses = 0;
        second();
        CHECK(f.poses > 0);
        CHECK_NEAR(f.daemon.pose_unix, T_UNIX + (double)(f.now_ns - START) * 1e-9 - 0.1, 0, 0.11);
    }
    end();
}

TEST(nothing_is_said_to_a_vehicle_that_is_not_there)
{
    struct heard h;
    begin_flight();
    f.flies = false;
    CHECK_INT(seconds(4).obstacles, 40); /* a heartbeat counts for five seconds */
    second();
    second();
    h = seconds(5);
    CHECK_INT(h.obstacles, 0);
    CHECK_STR(h.text, "");
    f.flies = true;
    CHECK(seconds(2).obstacles >= 10);
    end();
}

TEST(the_next_deadline_is_a_tenth_of_a_second_away)
{
    struct pollfd fds[MAVLINK_BRIDGE_FDS];
    begin_flight();
    CHECK_INT(mavlink_bridge_wait(f.bridge, fds), f.now_ns);
    CHECK(fds[0].fd == f.link.fd && fds[1].fd >= 0);
    end();
}

/* That a socket is open says nothing of its other end. */
TEST(a_link_is_there_when_something_was_received)
{
    char text[4096];
    FILE *const file = tmpfile();
    const int err = dup(2);
    dup2(fileno(file), 2);
    begin();
    seconds(2);
    const size_t alone = (size_t)pread(fileno(file), text, sizeof text - 1, 0);
    text[alone] = '\0';
    CHECK(strstr(text, "link: open, nothing received yet\n") && !strstr(text, "link: connected"));
    f.flies = true;
    seconds(2);
    dup2(err, 2);
    text[pread(fileno(file), text, sizeof text - 1, 0)] = '\0';
    const char *open = strstr(text, "link: open"), *there = strstr(text, "link: connected\n");
    CHECK(open && there && open < there && !strstr(open + 1, "link: open"));
    end();
    close(err);
    fclose(file);
}

/* The sonar is one that looks down. */
TEST(each_ping_below_is_told_once)
{
    struct heard h;
    feed_conf.downward = "head";
    begin_flight();
    say_below(&f.daemon, 6, 0.25, 2);
    h = second();
    CHECK_INT(h.below, 1);
    CHECK(h.last_below.min_distance == 50 && h.last_below.max_distance == 1000);
    CHECK_INT(h.last_below.current_distance, 600);
    CHECK(h.last_below.type == MAVLINK_SENSOR_ULTRASOUND && h.last_below.orientation == MAVLINK_ORIENTATION_DOWN);
    CHECK_INT(h.last_below.signal_quality, MAVLINK_QUALITY_UNKNOWN);
    CHECK_NEAR(h.last_below.horizontal_fov, 0.5235988, 0, 1e-6);
    CHECK_NEAR(h.last_below.time_boot_ms, 101750, 0,
               110); /* a quarter of a second ago, by the autopilot's clock */
    CHECK_INT(second().below, 0);
    say_below(&f.daemon, 0, 0.1, 4);
    h = second();
    CHECK_INT(h.below, 1);
    CHECK_INT(h.last_below.current_distance, 1001); /* nothing as far as it hears */
    CHECK_INT(h.last_below.signal_quality, MAVLINK_QUALITY_INVALID);
    end();
    feed_conf.downward = NULL;
}

/* Blocked at 7 m all around at the vehicle's level; nobody has looked higher or lower. */
TEST(points_stand_where_the_obstacles_are)
{
    struct heard h;
    feed_conf.layers = true;
    begin_flight();
    second();
    h = second();
    CHECK(h.points >= MAVLINK_SECTORS);
    for (int i = 0; i < MAVLINK_SECTORS; i++) {
        CHECK_NEAR(hypot(hypot((double)h.point[i].x, (double)h.point[i].y), (double)h.point[i].z), 7, 0, 0.01);
        CHECK_NEAR(h.point[i].z, 0, 0, 0.01);
        CHECK_NEAR(h.point[i].max_distance, 10, 0, 0.01);
    }
    f.answers = false;
    seconds(3);
    CHECK_INT(second().points, 0);
    end();
    feed_conf.layers = false;
}

/* A slow line may have been given lower rates. */
TEST(only_what_does_not_come_is_asked_for)
{
    bool reports = false;
    begin_flight();
    for (int s = 0; s < 15; s++) {
        const struct mavlink_local_position_ned m = {.time_boot_ms = (uint32_t)(100000 + (f.now_ns - START) / MS),
                                                     .vx = 0.1f};
        struct heard h;
        say_frame(MAVLINK_LOCAL_POSITION_NED, &m);
        h = second();
        reports |= h.asked_reports;
        CHECK(!h.asked_rates);
    }
    CHECK(reports);
    end();
}

TEST(the_autopilot_learns_our_time)
{
    const struct mavlink_timesync question = {.ts1 = ASKED_NS};
    begin_flight();
    say_frame(MAVLINK_TIMESYNC, &question);
    patience_for(f.link.fd, POLLIN);
    CHECK_INT(second().synced_ns, f.now_ns - 10 * STEP);
    end();
}

int main(void)
{
    if (!make_directory())
        return 1;
    RUN(obstacles_come_while_the_daemon_answers_and_no_longer);
    RUN(a_silent_sonar_is_told_and_its_obstacles_keep_their_time);
    RUN(what_is_late_at_the_start_is_no_fault);
    RUN(poses_have_the_time_of_their_measurement);
    RUN(what_the_thrusters_do_bounds_the_speed);
    RUN(the_pilot_is_told_what_to_set);
    RUN(a_stranger_is_not_believed_beside_the_autopilot);
    RUN(a_peer_that_is_silent_is_replaced);
    RUN(nor_do_poses_lose_it_when_the_bridge_is_held_up);
    RUN(nothing_is_said_to_a_vehicle_that_is_not_there);
    RUN(the_next_deadline_is_a_tenth_of_a_second_away);
    RUN(a_link_is_there_when_something_was_received);
    RUN(each_ping_below_is_told_once);
    RUN(points_stand_where_the_obstacles_are);
    RUN(only_what_does_not_come_is_asked_for);
    RUN(the_autopilot_learns_our_time);
    rmdir(directory);
    return test_end();
}
