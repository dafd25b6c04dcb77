/* SPDX-License-Identifier: MIT */
/*
 * active_sensing_rig.h - a virtual Ping360 on a serial line in simulated time, scanning plainly or steered to where the
 * grid says that a look tells most, on a vehicle that moves. The device, the head,
 * the grid and the rule are those of the daemon.
 */
#ifndef SONARD_TEST_ACTIVE_SENSING_RIG_H
#define SONARD_TEST_ACTIVE_SENSING_RIG_H

#include "core/fault.h"
#include "daemon/pipeline/active_sensing.h"
#include "drivers/devices/device.h"
#include "drivers/devices/ping360_scan.h"
#include "grid/sphere/sphere.h"
#include "tests/sim/lib/head.h"
#include "test.h"

#define MS     1000000ull
#define SECOND 1000000000ull
#define BAUD   115200u

struct rig {
    void *device;
    struct device_io io;
    struct head head;
    struct sphere *sphere;
    struct mount mount;
    struct next_look_features features;
    struct pose pose;
    uint64_t now_ns, free_at_ns; /* the line from the head to us */
    uint64_t arrives_ns;         /* of the frame that is on its way; 0: none */
    size_t n;
    uint8_t frame[PING_FRAME_MAX];
    struct ping ping;
    struct ping_beam beam;
    uint8_t samples[PING_MAX_BINS];
    uint64_t seen_ns[PING360_TURN];
    double longest_wait_s; /* of any bearing between two pings */
    int pings, turns;
};

static struct rig rig;

static uint64_t line(size_t bytes)
{
    return bytes * 10 * SECOND / BAUD;
}

/* Commands are short: they arrive at once, and what the line takes of them is left out for both ways of scanning. */
static void to_head(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx;
    head_feed(&rig.head, bytes, n, rig.now_ns);
}

static uint64_t to_host(void *ctx, const uint8_t *frame, size_t n, uint64_t now_ns)
{
    (void)ctx;
    rig.arrives_ns = now_ns + line(n);
    rig.n = n;
    memcpy(rig.frame, frame, n);
    return rig.arrives_ns;
}

static void listen(void *ctx, const struct head_shot *shot, uint8_t *samples)
{
    (void)ctx;
    memset(samples, 0, shot->settings.n_samples);
}

static void no_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
}

static void no_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level, (void)fmt;
}

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    rig.ping = (struct ping){.max_beams = 1,
                             .max_samples = PING_MAX_BINS,
                             .beam = &rig.beam,
                             .samples = rig.samples,
                             .pose = pose_identity};
    return &rig.ping;
}

/* Silence up to 15 m: what matters is when which bearing was looked at. */
static void enter(const struct ping *ping)
{
    struct beam_echoes heard = {
        .az_rad = ping->beam[0].az_rad, .blind_m = 0.5f, .free_to_m = 15, .state = BEAM_SILENT};
    const struct echoes e = {.t_ns = rig.now_ns,
                             .n_beams = 1,
                             .range_max_m = 20,
                             .az_aperture_rad = (float)geo_rad(2),
                             .el_aperture_rad = (float)geo_rad(25),
                             .pose = rig.pose,
                             .max_beams = 1,
                             .beam = &heard};
    sphere_enter(rig.sphere, &e, &rig.mount);
}

static void done_ping(void *ctx, struct ping *ping)
{
    (void)ctx;
    const long bearing =
        (lround((double)ping->beam[0].az_rad * PING360_TURN / GEO_TURN) + PING360_TURN) % PING360_TURN;
    const double wait_s = (double)(rig.now_ns - rig.seen_ns[bearing]) * 1e-9;
    if (rig.seen_ns[bearing])
        rig.longest_wait_s = fmax(rig.longest_wait_s, wait_s);
    rig.seen_ns[bearing] = rig.now_ns;
    rig.pings++;
    rig.turns += (ping->flags & PING_NEW_TURN) != 0;
    enter(ping);
}

enum way { PLAIN_AUTO, PLAIN_ASKED, ACTIVE, ACTIVE_CIRCLE };

#define CIRCLE_S 90.0

static void start(enum way way)
{
    static void *grid;
    static const struct sphere_conf conf = {.angular_step_rad = 2 * GEO_PI / 180,
                                            .level = true,
                                            .level_half_rad = 7.5 * GEO_PI / 180,
                                            .layers = {.r_max_m = 22, .dr_m = 0.1, .n_const = 10, .growth = 1.035},
                                            .max_cells = 1024,
                                            .forget_s = 160,
                                            .blocked_above = 0.6,
                                            .recentre_m = 0.2};
    const struct device_conf device = {.range_m = 20,
                                       .sound_speed_mps = 1500,
                                       .gain = -1,
                                       .step_rad = geo_rad(0.9),
                                       .request_response = way == PLAIN_ASKED,
                                       .steered = way >= ACTIVE,
                                       .circle_s = way == ACTIVE_CIRCLE ? CIRCLE_S : 0,
                                       .node = -1,
                                       .sensor_id = -1,
                                       .baud = BAUD};
    const struct head_conf head = {.id = 1, .ms_per_gradian = 6, .processing_ms = 18, .sound_speed_mps = 1500};
    const struct head_io head_io = {.send = to_host, .listen = listen};
    struct fault fault;
    free(grid);
    free(rig.device);
    memset(&rig, 0, sizeof rig);
    rig.now_ns = 1000 * SECOND;
    rig.mount = mount_identity;
    rig.pose = pose_identity;
    rig.pose.has = POSE_ATTITUDE | POSE_VELOCITY;
    rig.pose.velocity_mps[0] = 0.5;
    grid = aligned_alloc(64, sphere_bytes(&conf, &fault));
    rig.sphere = sphere_init(grid, &conf);
    rig.io = (struct device_io){.send = to_head,
                                .hold_break = no_break,
                                .ping_begin = begin_ping,
                                .ping_done = done_ping,
                                .note = no_note};
    head_init(&rig.head, &head, &head_io);
    rig.device = aligned_alloc(64, (device_ping360.state_size + 63) / 64 * 64);
    memset(rig.device, 0, device_ping360.state_size);
    CHECK(device_ping360.init(rig.device, &device, &fault));
    device_ping360.opened(rig.device, rig.now_ns, &rig.io);
}

static void steer(void)
{
    struct active_sensing_look look = {0};
    const struct active_sensing_head head = {.pose = &rig.pose, .mount = &rig.mount, .features = &rig.features};
    active_sensing_sector(sphere_picture(rig.sphere), rig.now_ns, 30, &head, &look);
    device_ping360.steer(rig.device, look.from_rad, look.to_rad, look.only);
}

/* On to the next thing that happens, at most to t_ns. */
static void step(uint64_t t_ns)
{
    const uint64_t device_ns = device_ping360.deadline(rig.device), head_ns = head_deadline(&rig.head);
    uint64_t next_ns = device_ns < head_ns ? device_ns : head_ns;
    if (rig.arrives_ns && rig.arrives_ns < next_ns)
        next_ns = rig.arrives_ns;
    rig.now_ns = next_ns > t_ns ? t_ns : next_ns > rig.now_ns ? next_ns : rig.now_ns;
    if (rig.arrives_ns && rig.arrives_ns <= rig.now_ns) {
        rig.arrives_ns = 0;
        device_ping360.feed(rig.device, rig.frame, rig.n, rig.now_ns, &rig.io);
    }
    if (head_deadline(&rig.head) <= rig.now_ns)
        head_tick(&rig.head, rig.now_ns);
    if (device_ping360.deadline(rig.device) <= rig.now_ns)
        device_ping360.tick(rig.device, rig.now_ns, &rig.io);
}

/* Simulated time passes; with a hint every ACTIVE_SENSING_TICK_NS, as the daemon gives it. */
static void run_until(uint64_t t_ns, bool steered, bool (*enough)(long), long bearing)
{
    while (rig.now_ns < t_ns && !(enough && enough(bearing))) {
        const uint64_t tick_ns = rig.now_ns - rig.now_ns % ACTIVE_SENSING_TICK_NS + ACTIVE_SENSING_TICK_NS;
        step(tick_ns < t_ns ? tick_ns : t_ns);
        if (steered && rig.now_ns == tick_ns)
            steer();
    }
}

static uint64_t appeared_ns;

static bool noticed(long bearing)
{
    return rig.seen_ns[bearing] > appeared_ns;
}

#define RUNS   8  /* each with a seed of its own */
#define THINGS 60 /* that appear in each */
#define ALL    (RUNS * THINGS)

/* Seconds from when something appears on a bearing within 20 degrees of the way until a ping goes there, sorted. */
static void measure_run(enum way way, uint64_t seed, double delay_s[THINGS])
{
    const bool steered = way >= ACTIVE;
    start(way);
    run_until(rig.now_ns + 150 * SECOND, steered, NULL, 0);
    rig.longest_wait_s = 0;
    for (int i = 0; i < THINGS; i++) {
        run_until(rig.now_ns + (uint64_t)(test_uniform(&seed) * 80e9), steered, NULL, 0);
        appeared_ns = rig.now_ns;
        const long bearing = (lround((test_uniform(&seed) - 0.5) * 44) + PING360_TURN) % PING360_TURN;
        run_until(rig.now_ns + 600 * SECOND, steered, noticed, bearing);
        CHECK(noticed(bearing));
        delay_s[i] = (double)(rig.now_ns - appeared_ns) * 1e-9;
    }
}

#endif
