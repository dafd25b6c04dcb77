/* SPDX-License-Identifier: MIT */
/* Who is believed: source addresses, and clocks under one system id. */
#include <arpa/inet.h>
#include <netinet/in.h>

#include "client/mavlink/mavlink_vehicle.h"
#include "client/mavlink/mavlink_peer.h"
#include "core/fault.h"
#include "tests/lib/submarine.h"
#include "tests/lib/test.h"

/* ---- the peer ---- */

static struct mavlink_source source_of(const char *host, uint16_t port)
{
    struct sockaddr_in a = {.sin_family = AF_INET, .sin_port = htons(port)};
    struct mavlink_source source = {.size = sizeof a};
    CHECK(inet_pton(AF_INET, host, &a.sin_addr) == 1);
    memcpy(&source.address, &a, sizeof a);
    return source;
}

TEST(networks)
{
    static const struct {
        const char *text;
        bool good;
        uint32_t host, mask;
    } rows[] = {
        {"127.0.0.1", true, 0x7F000001, 0xFFFFFFFF},
        {"192.168.2.0/24", true, 0xC0A80200, 0xFFFFFF00},
        {"192.168.2.17/24", true, 0xC0A80200, 0xFFFFFF00},
        {"10.0.0.0/8", true, 0x0A000000, 0xFF000000},
        {"128.0.0.0/1", true, 0x80000000, 0x80000000},
        {"1.2.3.4/32", true, 0x01020304, 0xFFFFFFFF},
        {"", false, 0, 0},
        {"blueos.local", false, 0, 0},
        {"0.0.0.0/0", false, 0, 0},
        {"1.2.3.4/33", false, 0, 0},
        {"1.2.3.4/", false, 0, 0},
        {"1.2.3.4/8x", false, 0, 0},
        {"1.2.3.4/008", false, 0, 0},
        {"1.2.3.4:14550", false, 0, 0},
        {"::1", false, 0, 0},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct mavlink_network network = {0};
        struct fault fault = {""};
        if (mavlink_network_parse(rows[i].text, &network, &fault) != rows[i].good) {
            printf("# %s\n", rows[i].text);
            CHECK(false);
        }
        CHECK_INT(network.host, rows[i].host);
        CHECK_INT(network.mask, rows[i].mask);
        CHECK((fault.text[0] != '\0') == !rows[i].good);
    }
}

TEST(the_peer_is_one_address_and_port_until_it_is_silent)
{
    const struct mavlink_source one = source_of("192.168.2.2", 14550), two = source_of("192.168.2.2", 14551),
                                far = source_of("192.168.2.3", 14550);
    struct mavlink_peer peer = {0};
    CHECK_INT(mavlink_peer_judge(&peer, &one, START), MAVLINK_CANDIDATES);
    CHECK_INT(mavlink_peer_judge(&peer, &two, START),
              MAVLINK_CANDIDATES); /* nobody has spoken like the autopilot */
    CHECK(mavlink_peer_hold(&peer, &one, START));
    CHECK(!mavlink_peer_hold(&peer, &one, START + S));
    CHECK_INT(mavlink_peer_judge(&peer, &one, START + 2 * S), MAVLINK_PEERS);
    CHECK_INT(mavlink_peer_judge(&peer, &two, START + 2 * S), MAVLINK_SOMEBODYS);
    CHECK_INT(mavlink_peer_judge(&peer, &far, START + 5 * S), MAVLINK_SOMEBODYS);
    CHECK_INT(peer.strangers, 2);
    CHECK_INT(mavlink_peer_judge(&peer, &two, START + 6 * S),
              MAVLINK_CANDIDATES); /* silent: a router that restarted */
    CHECK_INT(mavlink_peer_judge(&peer, &one, START + 6 * S), MAVLINK_PEERS);
    CHECK(mavlink_peer_hold(&peer, &two, START + 6 * S));
    CHECK_INT(mavlink_peer_judge(&peer, &one, START + 6 * S), MAVLINK_SOMEBODYS);
}

TEST(those_outside_the_network_are_never_candidates)
{
    const struct mavlink_source in = source_of("192.168.2.2", 5), out = source_of("192.168.3.2", 5), line = {0};
    struct mavlink_peer peer = {.network = {0xC0A80200, 0xFFFFFF00}};
    struct mavlink_source six = {.size = sizeof(struct sockaddr_in6)};
    six.address.ss_family = AF_INET6;
    CHECK_INT(mavlink_peer_judge(&peer, &out, START), MAVLINK_SOMEBODYS);
    CHECK_INT(mavlink_peer_judge(&peer, &six, START), MAVLINK_SOMEBODYS);
    CHECK_INT(mavlink_peer_judge(&peer, &line, START), MAVLINK_SOMEBODYS);
    CHECK_INT(mavlink_peer_judge(&peer, &in, START), MAVLINK_CANDIDATES);
    CHECK_INT(peer.strangers, 3);
}

TEST(a_line_with_one_far_end_has_one_source)
{
    const struct mavlink_source line = {0};
    struct mavlink_peer peer = {0};
    CHECK_INT(mavlink_peer_judge(&peer, &line, START), MAVLINK_CANDIDATES);
    CHECK(mavlink_peer_hold(&peer, &line, START));
    CHECK_INT(mavlink_peer_judge(&peer, &line, START + 100 * S), MAVLINK_PEERS);
    CHECK_INT(peer.strangers, 0);
}

TEST(strangers_are_named_once_and_not_too_often)
{
    const struct mavlink_source one = source_of("192.168.2.2", 14550), two = source_of("192.168.2.7", 999),
                                three = source_of("192.168.2.8", 999);
    struct mavlink_peer peer = {0};
    char text[300];
    int lines = 0;
    mavlink_peer_hold(&peer, &one, START);
    CHECK(!mavlink_peer_news(&peer, START, text, sizeof text));
    mavlink_peer_judge(&peer, &two, START);
    CHECK(mavlink_peer_news(&peer, START, text, sizeof text));
    CHECK_STR(text,
              "warning: dropping what 192.168.2.7:999 sends: the autopilot is at 192.168.2.2:14550 (1 datagrams "
              "of others so far); --peer ADDRESS says whom to believe");
    for (uint64_t s = 1; s < 300; s++) { /* two at once: a line a minute */
        mavlink_peer_hold(&peer, &one, START + s * S);
        mavlink_peer_judge(&peer, s % 2 ? &two : &three, START + s * S);
        lines += mavlink_peer_news(&peer, START + s * S, text, sizeof text);
    }
    CHECK(lines >= 1 && lines <= 5);
    peer.network = (struct mavlink_network){0xC0A80202, 0xFFFFFFFF};
    mavlink_peer_judge(&peer, mavlink_source_same(&peer.told, &two) ? &three : &two, START + 400 * S);
    CHECK(mavlink_peer_news(&peer, START + 400 * S, text, sizeof text) && strstr(text, "--peer does not name it"));
    CHECK(!mavlink_peer_news(&peer, START + 500 * S, text, sizeof text)); /* the same one again */
}

/* ---- the vehicle ---- */

TEST(only_an_autopilots_heartbeat_makes_a_peer)
{
    static const struct {
        uint8_t system, component;
        enum mavlink_id id;
        struct mavlink_heartbeat beat;
        bool speaks;
    } rows[] = {
        {7, 1, MAVLINK_HEARTBEAT, {.type = 12, .autopilot = 3}, true},
        {7, 1, MAVLINK_HEARTBEAT, {.type = 12, .autopilot = 12}, true},
        {8, 1, MAVLINK_HEARTBEAT, {.type = 12, .autopilot = 3}, false},   /* another system */
        {7, 154, MAVLINK_HEARTBEAT, {.type = 26, .autopilot = 8}, false}, /* a gimbal */
        {7, 154, MAVLINK_HEARTBEAT, {.type = 12, .autopilot = 3}, false},
        {7, 1, MAVLINK_HEARTBEAT, {.type = 6, .autopilot = 3}, false}, /* a ground station */
        {7, 1, MAVLINK_HEARTBEAT, {.type = 18, .autopilot = 8}, false},
        {7, 1, MAVLINK_ATTITUDE, {0}, false},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const struct mavlink_vehicle_conf conf = {.system_id = 7, .density_kgpm3 = 1025};
        struct mavlink_frame frame = {.message = mavlink_message(rows[i].id),
                                      .system_id = rows[i].system,
                                      .component_id = rows[i].component};
        struct mavlink_vehicle v;
        if (rows[i].id == MAVLINK_HEARTBEAT)
            mavlink_pack(frame.message, &rows[i].beat, frame.payload);
        mavlink_vehicle_init(&v, &conf);
        CHECK_INT(mavlink_vehicle_speaks(&v, &frame), rows[i].speaks);
    }
}

/* ---- two clocks ---- */

static int attitude(struct mavlink_vehicle *v, int64_t boot_ms, uint64_t now_ns)
{
    const struct mavlink_attitude m = {.time_boot_ms = (uint32_t)boot_ms};
    struct mavlink_pose pose;
    give(v, MAVLINK_ATTITUDE, &m, now_ns);
    return mavlink_vehicle_pose(v, now_ns, &pose);
}

/* Poses of the last 15 of 20 seconds, at 20 Hz, while another clock `apart_ms` ahead speaks every `every_ms`. */
static int poses_beside(int64_t apart_ms, uint64_t every_ms, bool *two)
{
    struct mavlink_vehicle v = vehicle_at_start();
    int poses = 0;
    for (uint64_t ms = 0; ms < 20000; ms += 50) {
        const uint64_t now_ns = START + ms * MS;
        if (ms % 1000 == 0)
            beat(&v, now_ns);
        poses += attitude(&v, 1000000 + (int64_t)ms, now_ns) * (ms >= 5000);
        if (ms % every_ms == 0)
            poses += attitude(&v, 1000000 + (int64_t)ms + apart_ms, now_ns + 5 * MS) * (ms >= 5000);
    }
    *two = mavlink_clock_two(&v.clock, START + 20 * S);
    return poses;
}

TEST(two_clocks_under_one_system_id_give_no_pose)
{
    static const int64_t apart_ms[] = {300, 900, 5000, 86400000, -300, -900, -5000, -900000};
    static const uint64_t every_ms[] = {50, 200, 1000, 4000};
    bool two;
    for (size_t i = 0; i < sizeof apart_ms / sizeof *apart_ms; i++)
        for (size_t k = 0; k < sizeof every_ms / sizeof *every_ms; k++) {
            const int poses = poses_beside(apart_ms[i], every_ms[k], &two);
            if (poses || !two)
                printf("# %d ms apart, each %d ms: %d poses\n", (int)apart_ms[i], (int)every_ms[k], poses);
            CHECK(poses == 0 && two);
        }
    CHECK(poses_beside(0, 100, &two) >= 300 && !two);    /* the same one over two links */
    CHECK(poses_beside(-100, 100, &two) >= 300 && !two); /* one of them slower */
}

/* PX4 stamps a missing barometer with 0, a dead one with its last time; of another clock none is believed. */
TEST(pressures_of_a_wrong_time_stop_no_pose)
{
    static const uint32_t boot_ms[] = {0, 1000000, 2000000};
    for (size_t i = 0; i < sizeof boot_ms / sizeof *boot_ms; i++) {
        const struct mavlink_scaled_pressure m = {.time_boot_ms = boot_ms[i], .press_abs = 1500};
        struct mavlink_vehicle v = vehicle_at_start();
        for (uint64_t ms = 1000; ms < 20000; ms += 50) {
            const uint64_t now_ns = START + ms * MS;
            if (ms % 1000 == 0)
                beat(&v, now_ns);
            CHECK(attitude(&v, 1000000 + (int64_t)ms, now_ns));
            give(&v, MAVLINK_SCALED_PRESSURE2, &m, now_ns + 10 * MS);
            CHECK(!(v.next.has & MAVLINK_POSE_DEPTH));
        }
        CHECK_INT(v.refused, 380);
    }
}

/* What its estimator said before it started again says nothing of what it says after. */
TEST(an_autopilot_that_starts_again_reports_again)
{
    const struct mavlink_ekf_status_report aided = {.flags = 831};
    struct mavlink_vehicle v = vehicle_at_start();
    for (uint64_t ms = 0; ms < 8000; ms += 50) {
        const uint64_t now_ns = START + ms * MS;
        const bool restarted = ms >= 4000;
        const struct mavlink_local_position_ned m = {.time_boot_ms = (uint32_t)(restarted ? ms : 900000 + ms),
                                                     .x = 1};
        if (ms % 1000 == 0)
            beat(&v, now_ns);
        if (!restarted)
            give(&v, MAVLINK_EKF_STATUS_REPORT, &aided, now_ns);
        give(&v, MAVLINK_LOCAL_POSITION_NED, &m, now_ns);
        CHECK(!(v.next.has & MAVLINK_POSE_POSITION) == restarted);
    }
}

TEST(an_autopilot_that_starts_again_gives_poses_within_seconds)
{
    struct mavlink_vehicle v = vehicle_at_start();
    uint64_t back_ms = 0;
    for (uint64_t ms = 0; ms < 20000; ms += 20) {
        const uint64_t now_ns = START + ms * MS;
        const bool restarted = ms >= 8000;
        if (ms % 1000 == 0)
            beat(&v, now_ns);
        if (ms >= 5000 && !restarted)
            continue; /* it starts */
        const bool pose = attitude(&v, restarted ? (int64_t)ms - 6000 : 900000 + (int64_t)ms, now_ns);
        if (restarted && pose && !back_ms)
            back_ms = ms;
        CHECK(!mavlink_clock_two(&v.clock, now_ns));
        CHECK(pose || (ms >= 8000 && ms < 9100));
    }
    CHECK(back_ms >= 9000 && back_ms < 9100);
}

/* A link that sticks delivers late, in order, and may lose some. */
TEST(a_link_that_sticks_makes_no_clock_doubtful)
{
    struct mavlink_vehicle v = vehicle_at_start();
    uint64_t random = test_seed(), free_ns = START;
    int poses = 0;
    for (uint64_t ms = 0; ms < 60000; ms += 20) {
        const uint64_t sent_ns = START + ms * MS;
        if (free_ns < sent_ns && test_random(&random) % 100 == 0)
            free_ns = sent_ns + (200 + test_random(&random) % 4500) * MS;
        const uint64_t now_ns = free_ns > sent_ns ? free_ns : sent_ns;
        if (ms % 100 == 0)
            beat(&v, now_ns);
        if (test_random(&random) % 5 > 0)
            poses += attitude(&v, 1000000 + (int64_t)ms, now_ns);
        CHECK(!mavlink_clock_doubtful(&v.clock, now_ns));
    }
    CHECK(poses > 500);
}

int main(void)
{
    RUN(networks);
    RUN(the_peer_is_one_address_and_port_until_it_is_silent);
    RUN(those_outside_the_network_are_never_candidates);
    RUN(a_line_with_one_far_end_has_one_source);
    RUN(strangers_are_named_once_and_not_too_often);
    RUN(only_an_autopilots_heartbeat_makes_a_peer);
    RUN(two_clocks_under_one_system_id_give_no_pose);
    RUN(pressures_of_a_wrong_time_stop_no_pose);
    RUN(an_autopilot_that_starts_again_reports_again);
    RUN(an_autopilot_that_starts_again_gives_poses_within_seconds);
    RUN(a_link_that_sticks_makes_no_clock_doubtful);
    return test_end();
}
