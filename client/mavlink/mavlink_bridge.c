/* SPDX-License-Identifier: MIT */
#include "mavlink_bridge.h"

#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mavlink_alert.h"

#define SECOND_NS    1000000000u
#define POSE_LOST_S  2.0
#define PING_LOST_NS 2000000000u
#define START_NS     3000000000u  /* a sonar may take so long to its first ping */
#define FIRST_NS     15000000000u /* until what was never there is said to be missing */
#define DRIFT_TOLD_NS                                                                                             \
    30000000000u /* parameters of the autopilot, and half a minute of idle thrusters, take so long */
#define LEAK_TOLD_NS      6000000000u /* a leak counts so long, longer than two texts are apart: none is missed */
#define PATIENCE_NS       6000000000u /* until a vehicle without any heartbeat is called absent */
#define ASK_EVERY_NS      10000000000u
#define ATTITUDE_DUE      2000000000u /* asked for again when none came for so long */
#define READS_PER_TURN    32          /* so that a flood does not keep the obstacles waiting */
#define CLIMB_INTERVAL_US 200000
#define SERVO_INTERVAL_US 50000
#define PARAMS_A_SECOND   8 /* asked for while they are not known */
#define OWN_SYSTEM        1 /* until a vehicle's is known: that of nearly all vehicles */

/* What standard error last said of something that comes and goes. */
enum told { TOLD_NOTHING, TOLD_OPEN, TOLD_THERE, TOLD_LOST };

enum alert {
    ALERT_DAEMON,
    ALERT_BLIND,
    ALERT_LEAK,
    ALERT_POSE,
    ALERT_BAROMETERS,
    ALERT_CLOCKS,
    ALERT_POSITION,
    ALERT_DRIFT,
    ALERT_SENSOR,
    ALERT_HEARING = ALERT_SENSOR + MAVLINK_SENSORS_MAX,
    ALERTS = ALERT_HEARING + MAVLINK_SENSORS_MAX
};

struct mavlink_bridge {
    const struct mavlink_bridge_conf *conf;
    struct mavlink_link *link;
    struct mavlink_peer peer;
    struct mavlink_parser parser;
    struct mavlink_source parsed; /* whose bytes the parser holds */
    struct mavlink_sender sender;
    struct mavlink_vehicle vehicle;
    struct mavlink_feed feed;
    struct mavlink_alert alert[ALERTS];
    uint64_t obstacles_due_ns, second_due_ns, ask_due_ns;
    uint64_t below_ns; /* of the downward ping sent last */
    double reach_m;    /* last known */
    uint64_t sent;
    uint64_t start_ns;
    bool had_vehicle, two_clocks;
    bool had_daemon, had_data, had_pose, had_ping[MAVLINK_SENSORS_MAX]; /* what was never there is not lost */
    enum mavlink_no_bound why, why_told; /* why there is no bound of the speed: now, and as said last */
    unsigned why_s;                      /* now has lasted so many seconds */
    uint64_t bounded_ns;                 /* the daemon said last that its drift is bounded, or nothing about it */
    enum told link_told, daemon_told, vehicle_told, below_told;
};

__attribute__((format(printf, 1, 2))) static void say(const char *format, ...)
{
    char text[600];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (char *c = text; *c; c++)
        *c = *c >= ' ' && *c <= '~' ? *c : '?';
    fprintf(stderr, "sonard-mavlink: %s\n", text);
}

/* ---- to the autopilot ---- */

static void send_message(struct mavlink_bridge *b, enum mavlink_id id, const void *content, uint64_t now_ns)
{
    uint8_t frame[MAVLINK_FRAME_MAX];
    if (b->link->fd < 0)
        return;
    if (b->sender.signing)
        mavlink_signing_clock(b->sender.signing, (now_ns + b->feed.unix_offset_ns) / 1000);
    b->sender.system_id = b->vehicle.system_id ? b->vehicle.system_id : OWN_SYSTEM;
    mavlink_link_write(b->link, frame, mavlink_build(&b->sender, mavlink_message(id), content, frame), now_ns);
    b->sent++;
}

/* What may be said of a ring now: all of it, of a sonar that is silent the obstacles only, of old answers nothing. */
static struct mavlink_ring sayable(const struct mavlink_bridge *b, enum mavlink_watch which, uint64_t now_ns)
{
    struct mavlink_ring ring = b->feed.ring[which];
    if (!mavlink_feed_answered(&b->feed, now_ns))
        mavlink_ring_forget(&ring);
    else if (!mavlink_feed_fresh(&b->feed, now_ns))
        mavlink_ring_doubt(&ring);
    return ring;
}

/* Does anything around rest on evidence? */
static bool sees(const struct mavlink_bridge *b, uint64_t now_ns)
{
    const struct mavlink_ring ring = sayable(b, MAVLINK_WATCH_LEVEL, now_ns);
    return mavlink_ring_known(&ring);
}

static void send_heartbeat(struct mavlink_bridge *b, uint64_t now_ns)
{
    const struct mavlink_heartbeat m = {.type = MAVLINK_TYPE_ONBOARD_CONTROLLER,
                                        .autopilot = MAVLINK_AUTOPILOT_INVALID,
                                        .system_status =
                                            sees(b, now_ns) ? MAVLINK_STATE_ACTIVE : MAVLINK_STATE_CRITICAL,
                                        .mavlink_version = MAVLINK_VERSION};
    send_message(b, MAVLINK_HEARTBEAT, &m, now_ns);
}

static void ask_for_rate(struct mavlink_bridge *b, enum mavlink_id id, float interval_us, uint64_t now_ns)
{
    const struct mavlink_command_long m = {.param = {(float)id, interval_us},
                                           .command = MAVLINK_CMD_SET_MESSAGE_INTERVAL,
                                           .target_system = b->vehicle.system_id,
                                           .target_component = 1};
    send_message(b, MAVLINK_COMMAND_LONG, &m, now_ns);
}

/* What the thrusters do, as often as it takes, also when a ground station has asked for less since; and parameters that
 * are not known. One that is known is asked for again now and then: it may have been set. */
static void ask_for_thrusters(struct mavlink_bridge *b, uint64_t now_ns)
{
    struct mavlink_param_request_read m = {
        .param_index = -1, .target_system = b->vehicle.system_id, .target_component = 1};
    if (mavlink_thrusters_slow(&b->vehicle.thrusters))
        ask_for_rate(b, MAVLINK_SERVO_OUTPUT_RAW, SERVO_INTERVAL_US, now_ns);
    if (b->vehicle.thrusters.submarine && !b->vehicle.thrusters.climb_ns)
        ask_for_rate(b, MAVLINK_VFR_HUD, CLIMB_INTERVAL_US, now_ns);
    for (int i = 0; i < PARAMS_A_SECOND; i++)
        if (mavlink_thrusters_ask(&b->vehicle.thrusters, true, m.param_id))
            send_message(b, MAVLINK_PARAM_REQUEST_READ, &m, now_ns);
    if (mavlink_thrusters_ask(&b->vehicle.thrusters, false, m.param_id))
        send_message(b, MAVLINK_PARAM_REQUEST_READ, &m, now_ns);
}

/* Which of its barometers is in the water. */
static void ask_for_barometer(struct mavlink_bridge *b, uint64_t now_ns)
{
    struct mavlink_param_request_read m = {
        .param_index = -1, .target_system = b->vehicle.system_id, .target_component = 1};
    const char *name = b->vehicle.thrusters.submarine ? mavlink_barometers_ask(&b->vehicle.barometers) : NULL;
    if (!name)
        return;
    memcpy(m.param_id, name, strnlen(name, sizeof m.param_id));
    send_message(b, MAVLINK_PARAM_REQUEST_READ, &m, now_ns);
}

#define WHY_LASTS_S 10 /* until standard error says why: parameters take some seconds, and a message may be lost */

/* Every second, for a daemon that has just started. It also tells the daemon that its sonars belong to a vehicle, even
 * where that says nothing yet. */
static void tell_no_bound(struct mavlink_bridge *b, uint64_t now_ns)
{
    const enum mavlink_no_bound why =
        b->had_vehicle ? mavlink_thrusters_why(&b->vehicle.thrusters, now_ns) : MAVLINK_NO_VEHICLE;

    b->why_s = why == b->why ? b->why_s + 1 : 0;
    b->why = why;
    if (why != MAVLINK_BOUND)
        mavlink_feed_no_bound(&b->feed, mavlink_no_bound_words[why], now_ns);
    if (b->why_s < WHY_LASTS_S || why == b->why_told || !b->vehicle.thrusters.submarine)
        return;
    b->why_told = why;
    if (why != MAVLINK_BOUND)
        say("no bound of the vehicle's speed by its thrusters: %s; `sonarctl status` says more",
            mavlink_no_bound_words[why]);
    else
        say("the vehicle's speed is bounded by what its thrusters do");
}

/* Only for what is missing: a slow line may have been given lower rates for what comes. */
static void ask_for_rates(struct mavlink_bridge *b, bool attitude, uint64_t now_ns)
{
    static const struct {
        enum mavlink_id id;
        float interval_us;
    } wanted[] = {{MAVLINK_ATTITUDE, 20000},           {MAVLINK_LOCAL_POSITION_NED, 50000},
                  {MAVLINK_SCALED_PRESSURE, 100000},   {MAVLINK_SCALED_PRESSURE2, 100000},
                  {MAVLINK_SCALED_PRESSURE3, 100000},  {MAVLINK_VFR_HUD, 200000},
                  {MAVLINK_DISTANCE_SENSOR, 100000},   {MAVLINK_ALTITUDE, 200000},
                  {MAVLINK_EKF_STATUS_REPORT, 200000}, {MAVLINK_ESTIMATOR_STATUS, 200000}};

    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++)
        if (!attitude || wanted[i].id == MAVLINK_EKF_STATUS_REPORT || wanted[i].id == MAVLINK_ESTIMATOR_STATUS)
            ask_for_rate(b, wanted[i].id, wanted[i].interval_us, now_ns);
}

static uint32_t boot_ms(const struct mavlink_bridge *b, uint64_t t_ns)
{
    return (uint32_t)(mavlink_clock_boot_ns(&b->vehicle.clock, t_ns) / 1000000u);
}

static void send_points(struct mavlink_bridge *b, const struct mavlink_obstacle_conf *conf, uint64_t now_ns)
{
    struct mavlink_obstacle_distance_3d point[MAVLINK_FACES];
    for (int layer = 0; layer < MAVLINK_LAYERS; layer++) {
        const struct mavlink_ring ring = sayable(b, (enum mavlink_watch)layer, now_ns);
        const int n = mavlink_ring_points(&ring, conf, mavlink_layer_deg[layer] * (M_PI / 180), b->reach_m,
                                          boot_ms(b, b->feed.evidence_ns), point);
        for (int i = 0; i < n; i++)
            send_message(b, MAVLINK_OBSTACLE_DISTANCE_3D, &point[i], now_ns);
    }
}

/*
 * Receivers take what arrives as of now, whatever its time stamp says, and as a sign of life even where every element
 * is unknown, which ArduPilot takes for free. So a ring of which nothing is known is not sent, and the receiver's own
 * time-out says that there is no data; but it is sent where the user wants an obstacle in its place.
 */
static void send_ring(struct mavlink_bridge *b, uint64_t now_ns)
{
    const struct mavlink_ring ring = sayable(b, MAVLINK_WATCH_LEVEL, now_ns);
    struct mavlink_obstacle_conf conf = b->conf->obstacles;
    struct mavlink_obstacle_distance m;
    if (!mavlink_ring_known(&ring) && conf.unknown_as != MAVLINK_UNKNOWN_AS_DISTANCE)
        return;
    if (conf.unknown_as == MAVLINK_UNKNOWN_AS_FAR && !mavlink_feed_fresh(&b->feed, now_ns))
        conf.unknown_as = MAVLINK_UNKNOWN_AS_UNKNOWN;
    mavlink_ring_distances(&ring, &conf, b->reach_m,
                           mavlink_clock_boot_ns(&b->vehicle.clock, b->feed.evidence_ns) / 1000, &m);
    send_message(b, MAVLINK_OBSTACLE_DISTANCE, &m, now_ns);
}

static void send_obstacles(struct mavlink_bridge *b, uint64_t now_ns)
{
    const struct mavlink_obstacle_conf *conf = &b->conf->obstacles;
    const double reach_m = mavlink_feed_reach_m(&b->feed);
    if (reach_m > 0)
        b->reach_m = fmin(reach_m, MAVLINK_REACH_M);
    else if (b->reach_m <= 0 && conf->unknown_as == MAVLINK_UNKNOWN_AS_DISTANCE)
        b->reach_m = conf->unknown_m;
    if (b->reach_m <= 0)
        return;
    send_ring(b, now_ns);
    if (b->conf->feed.layers)
        send_points(b, conf, now_ns);
}

/* Each ping of the downward sonar once. */
static void send_below(struct mavlink_bridge *b, uint64_t now_ns)
{
    const struct mavlink_depth_below *below = &b->feed.below;
    double most_m = 0;
    if (below->t_ns <= b->below_ns)
        return;
    for (int i = 0; i < b->feed.n_sensors; i++)
        if (strcmp(b->feed.sensor[i].name, b->conf->feed.downward) == 0)
            most_m = b->feed.sensor[i].range_m;
    if (most_m <= 0)
        return;
    b->below_ns = below->t_ns;

    const uint16_t max_cm = mavlink_centimetres(most_m, UINT16_MAX - 1);
    const struct mavlink_distance_sensor m = {
        .time_boot_ms = boot_ms(b, below->t_ns),
        .min_distance = mavlink_centimetres(below->blind_m, max_cm),
        .max_distance = max_cm,
        .current_distance = below->echo ? mavlink_centimetres(below->range_m, max_cm) : (uint16_t)(max_cm + 1),
        .type = MAVLINK_SENSOR_ULTRASOUND,
        .orientation = MAVLINK_ORIENTATION_DOWN,
        .signal_quality = below->echo ? MAVLINK_QUALITY_UNKNOWN : MAVLINK_QUALITY_INVALID,
        .covariance = MAVLINK_COVARIANCE_UNKNOWN,
        .horizontal_fov = (float)below->width_rad,
        .vertical_fov = (float)below->width_rad,
    };

    send_message(b, MAVLINK_DISTANCE_SENSOR, &m, now_ns);
}

/* ---- what is wrong ---- */

/* A vehicle that never had a measured position lacks nothing. */
static void update_pose_alerts(struct mavlink_bridge *b, uint64_t now_ns)
{
    const bool two = mavlink_clock_two(&b->vehicle.clock, now_ns);
    const enum mavlink_position position = b->vehicle.aiding.position;
    const bool believed = position == MAVLINK_POSITION_AIDED || position == MAVLINK_POSITION_UNREPORTED;
    mavlink_alert_set(&b->alert[ALERT_CLOCKS], two, now_ns,
                      two ? "sonard: two autopilots, one system id: no pose" : "sonard: one autopilot again");
    if (b->vehicle.aiding.believed_ever && position != MAVLINK_POSITION_NONE &&
        position != MAVLINK_POSITION_WAITING)
        mavlink_alert_set(&b->alert[ALERT_POSITION], !believed, now_ns,
                          believed ? "sonard: position measured again"
                                   : "sonard: position not measured, not used");
}

/* What to set, in the daemon's words. */
static void update_drift_alert(struct mavlink_bridge *b, bool alive, uint64_t now_ns)
{
    if (!alive || !b->feed.drift[0])
        b->bounded_ns = now_ns;
    const bool drifts = alive && now_ns >= b->bounded_ns + DRIFT_TOLD_NS;

    if (alive)
        mavlink_alert_set(&b->alert[ALERT_DRIFT], drifts, now_ns, "sonard: %s",
                          drifts ? b->feed.drift : "drift bounded, or position known");
}

static void update_alerts(struct mavlink_bridge *b, uint64_t now_ns)
{
    const struct mavlink_feed *feed = &b->feed;
    const bool alive = mavlink_feed_alive(feed, now_ns);
    const bool leak = feed->wet || (feed->leak_ns && now_ns < feed->leak_ns + LEAK_TOLD_NS);
    const bool data = sees(b, now_ns), pose = feed->posed && feed->pose_age_s <= POSE_LOST_S;
    const bool doubtful = mavlink_vehicle_depth_doubtful(&b->vehicle, now_ns);
    if (b->had_daemon || now_ns > b->start_ns + FIRST_NS)
        mavlink_alert_set(&b->alert[ALERT_DAEMON], !alive, now_ns,
                          !alive          ? b->had_daemon ? "sonard: offline, no obstacle data"
                                                          : "sonard: not running, no obstacle data"
                          : b->had_daemon ? "sonard: online again"
                                          : "sonard: running");
    if (alive && now_ns > feed->connected_ns + (b->had_data ? START_NS : FIRST_NS))
        mavlink_alert_set(&b->alert[ALERT_BLIND], !data, now_ns,
                          !data         ? b->had_data ? "sonard: no obstacle data; all directions unknown"
                                                      : "sonard: no obstacle data yet"
                          : b->had_data ? "sonard: obstacle data again"
                                        : "sonard: obstacle data");
    mavlink_alert_set(&b->alert[ALERT_LEAK], leak, now_ns,
                      feed->wet ? "LEAK: the probe is wet"
                      : leak    ? "LEAK: the probe was wet briefly"
                                : "leak probe: no longer wet");
    if (alive && feed->posed && (pose || b->had_pose))
        mavlink_alert_set(&b->alert[ALERT_POSE], !pose, now_ns,
                          pose ? "sonard: vehicle pose back" : "sonard: vehicle pose lost");
    mavlink_alert_set(&b->alert[ALERT_BAROMETERS], doubtful, now_ns,
                      !doubtful                     ? "sonard: barometers agree again"
                      : b->vehicle.barometers.named ? "sonard: barometers disagree: depth right?"
                                                    : "sonard: barometers disagree: no depth");
    update_pose_alerts(b, now_ns);
    update_drift_alert(b, alive, now_ns);
    for (int i = 0; alive && i < feed->n_sensors; i++) {
        const struct mavlink_sensor *s = &feed->sensor[i];
        const bool had_ping = b->had_ping[i];
        const uint64_t start_ns = feed->connected_ns + (had_ping ? START_NS : FIRST_NS),
                       alive_ns = s->ping_ns > start_ns ? s->ping_ns : start_ns;
        const bool lost = now_ns > alive_ns + PING_LOST_NS;
        mavlink_alert_set(&b->alert[ALERT_SENSOR + i], lost, now_ns,
                          lost       ? had_ping ? "sonar %s: offline (%s)" : "sonar %s: no ping yet (%s)"
                          : had_ping ? "sonar %s: online again"
                                     : "sonar %s: first ping",
                          s->name, s->state);
        mavlink_alert_set(&b->alert[ALERT_HEARING + i], s->deaf, now_ns,
                          s->deaf ? "sonar %s: receiver may have failed" : "sonar %s: receiver works again",
                          s->name);
        b->had_ping[i] |= s->ping_ns > 0;
    }
    b->had_daemon |= alive;
    b->had_data |= data;
    b->had_pose |= pose;
}

static void send_alerts(struct mavlink_bridge *b, uint64_t now_ns)
{
    struct mavlink_statustext m;
    for (int i = 0; b->link->fd >= 0 && i < ALERTS; i++) {
        while (mavlink_alert_due(&b->alert[i], now_ns, &m)) {
            if (m.chunk_seq == 0)
                say("told the vehicle: %s", b->alert[i].text);
            send_message(b, MAVLINK_STATUSTEXT, &m, now_ns);
        }
    }
}

/* Each change once. */
static void say_change(bool is, enum told *told, const char *what, const char *why)
{
    const enum told now = is ? TOLD_THERE : TOLD_LOST;
    if (*told != now)
        say("%s: %s%s%s", what,
            is                    ? "connected"
            : *told == TOLD_THERE ? "lost"
                                  : "not connected",
            is || !why[0] ? "" : ": ", is ? "" : why);
    *told = now;
}

/* A link that is open is not there before something came: nobody may be at the other end. */
static void say_link(struct mavlink_bridge *b)
{
    const bool open = !b->link->error[0];
    if (!open || b->link->received) {
        say_change(open, &b->link_told, "link", b->link->error);
    } else if (b->link_told != TOLD_OPEN) {
        say("link: open, nothing received yet");
        b->link_told = TOLD_OPEN;
    }
}

/* ---- from the autopilot ---- */

static void answer_timesync(struct mavlink_bridge *b, const struct mavlink_frame *frame, uint64_t now_ns)
{
    struct mavlink_timesync m;
    mavlink_unpack(frame->message, frame->payload, &m);
    if (m.tc1 != 0)
        return;
    m = (struct mavlink_timesync){.tc1 = (int64_t)now_ns,
                                  .ts1 = m.ts1,
                                  .target_system = frame->system_id,
                                  .target_component = frame->component_id};
    send_message(b, MAVLINK_TIMESYNC, &m, now_ns);
}

static void take_frame(struct mavlink_bridge *b, const struct mavlink_frame *frame, uint64_t now_ns)
{
    struct mavlink_pose pose;
    if (!mavlink_vehicle_take(&b->vehicle, frame, now_ns))
        return;
    mavlink_peer_hold(&b->peer, &b->link->sender, now_ns);
    if (frame->message->id == MAVLINK_TIMESYNC)
        answer_timesync(b, frame, now_ns);
    if (mavlink_vehicle_pose(&b->vehicle, now_ns, &pose))
        mavlink_feed_pose(&b->feed, &pose, now_ns);
    if (mavlink_vehicle_bound(&b->vehicle, &pose))
        mavlink_feed_pose(&b->feed, &pose, now_ns);
}

/* There is no peer: only that an autopilot says that it is there makes one. */
static bool meet_peer(struct mavlink_bridge *b, const struct mavlink_frame *frame, uint64_t now_ns)
{
    char text[400];
    if (!mavlink_vehicle_speaks(&b->vehicle, frame))
        return false;
    if (!mavlink_source_same_host(&b->peer.source, &b->link->sender))
        mavlink_vehicle_moved(&b->vehicle);
    mavlink_peer_hold(&b->peer, &b->link->sender, now_ns);
    mavlink_link_answer(b->link);
    say("%s", mavlink_peer_text(&b->peer, text, sizeof text));
    return true;
}

/* What one read gave, of one sender. A frame may be cut by its sender, but never goes on with the bytes of another. */
static void take_bytes(struct mavlink_bridge *b, const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    const enum mavlink_whose whose = mavlink_peer_judge(&b->peer, &b->link->sender, now_ns);
    bool peers = whose == MAVLINK_PEERS;
    struct mavlink_frame frame;
    if (whose == MAVLINK_SOMEBODYS)
        return;
    b->link->received = true;
    if (!mavlink_source_same(&b->parsed, &b->link->sender)) {
        mavlink_parser_restart(&b->parser);
        b->parsed = b->link->sender;
    }
    while (mavlink_parser_next(&b->parser, &bytes, &n, &frame)) {
        peers = peers || meet_peer(b, &frame, now_ns);
        if (peers)
            take_frame(b, &frame, now_ns);
    }
}

/* A frame counts from when it was read, not from before: one of later than its arrival would set the autopilot's clock
 * ahead, and every pose back. */
static void read_link(struct mavlink_bridge *b, mavlink_now_fn *now)
{
    uint8_t buffer[2048];
    for (int i = 0; i < READS_PER_TURN; i++) {
        const size_t n = mavlink_link_read(b->link, buffer, sizeof buffer, now().now_ns);
        const uint64_t now_ns = now().now_ns;
        if (n == 0)
            return;
        take_bytes(b, buffer, n, now_ns);
    }
}

/* ---- time ---- */

/* Is it time? The deadlines lie on a grid: a late one does not move the next; those missed are left out. */
static bool is_due(uint64_t *due_ns, uint64_t period_ns, uint64_t now_ns)
{
    if (now_ns < *due_ns)
        return false;
    *due_ns += period_ns * ((now_ns - *due_ns) / period_ns + 1);
    return true;
}

static void say_clocks(struct mavlink_bridge *b, uint64_t now_ns)
{
    const bool two = mavlink_clock_two(&b->vehicle.clock, now_ns);
    if (two != b->two_clocks)
        say(two ? "warning: the time of system %u jumps, as that of two autopilots with one id does (a "
                  "simulator, a second vehicle), or of two links whose delays differ: no pose until it stops"
                : "the time of system %u no longer jumps",
            b->vehicle.system_id);
    b->two_clocks = two;
}

static void do_second(struct mavlink_bridge *b, uint64_t now_ns)
{
    const struct mavlink_timesync question = {.ts1 = (int64_t)now_ns};
    const bool had_vehicle = b->had_vehicle;
    char news[400];
    b->had_vehicle = mavlink_vehicle_present(&b->vehicle, now_ns);
    if (b->had_vehicle || b->vehicle_told != TOLD_NOTHING || now_ns > b->start_ns + PATIENCE_NS)
        say_change(b->had_vehicle, &b->vehicle_told, "vehicle", "no heartbeat");
    if (b->had_vehicle && !had_vehicle)
        b->ask_due_ns = now_ns;
    send_heartbeat(b, now_ns);
    if (mavlink_peer_news(&b->peer, now_ns, news, sizeof news))
        say("%s", news);
    tell_no_bound(b, now_ns);
    if (!b->had_vehicle)
        return;
    if (mavlink_vehicle_depth_news(&b->vehicle, now_ns, news, sizeof news))
        say("%s", news);
    if (mavlink_aiding_news(&b->vehicle.aiding, now_ns, news, sizeof news))
        say("%s", news);
    say_clocks(b, now_ns);
    send_message(b, MAVLINK_TIMESYNC, &question, now_ns);
    const bool attitude = now_ns <= b->vehicle.attitude_ns + ATTITUDE_DUE;

    if ((!attitude || mavlink_aiding_wanted(&b->vehicle.aiding, now_ns)) &&
        is_due(&b->ask_due_ns, ASK_EVERY_NS, now_ns))
        ask_for_rates(b, attitude, now_ns);
    ask_for_thrusters(b, now_ns);
    ask_for_barometer(b, now_ns);
}

/* One that was just connected to gets the time to answer. */
static void say_daemon(struct mavlink_bridge *b, uint64_t now_ns)
{
    const bool alive = mavlink_feed_alive(&b->feed, now_ns);
    if (alive || !b->feed.client || b->daemon_told == TOLD_THERE)
        say_change(alive, &b->daemon_told, "sonard", b->feed.error.message);
}

/* A name that the daemon does not know, or after a reload does again. */
static void say_below(struct mavlink_bridge *b)
{
    const bool refused = b->feed.below_refused.status != SONARD_OK;
    if (refused || b->below_told != TOLD_NOTHING)
        say_change(!refused, &b->below_told, "--downward", b->feed.below_refused.message);
}

void mavlink_bridge_work(struct mavlink_bridge *b, mavlink_now_fn *now)
{
    const struct mavlink_time start = now();
    b->feed.unix_offset_ns = start.unix_offset_ns;
    mavlink_link_open(b->link, start.now_ns);
    mavlink_feed_connect(&b->feed, start.now_ns);
    mavlink_link_flush(b->link, start.now_ns);
    read_link(b, now);

    const uint64_t now_ns = now().now_ns;

    mavlink_feed_read(&b->feed, now_ns);
    say_link(b);
    say_daemon(b, now_ns);
    say_below(b);
    if (is_due(&b->obstacles_due_ns, (uint64_t)(1e9 / b->conf->feed.rate_hz), now_ns)) {
        update_alerts(b, now_ns);
        if (mavlink_vehicle_present(&b->vehicle, now_ns)) {
            send_obstacles(b, now_ns);
            send_alerts(b, now_ns);
        }
    }
    if (b->conf->feed.downward && mavlink_vehicle_present(&b->vehicle, now_ns))
        send_below(b, now_ns);
    if (is_due(&b->second_due_ns, SECOND_NS, now_ns))
        do_second(b, now_ns);
}

uint64_t mavlink_bridge_wait(const struct mavlink_bridge *b, struct pollfd fds[MAVLINK_BRIDGE_FDS])
{
    fds[0] = (struct pollfd){.fd = b->link->fd, .events = mavlink_link_events(b->link)};
    fds[1] = b->feed.client
                 ? (struct pollfd){.fd = sonard_fd(b->feed.client), .events = sonard_events(b->feed.client)}
                 : (struct pollfd){.fd = -1};
    return b->obstacles_due_ns < b->second_due_ns ? b->obstacles_due_ns : b->second_due_ns;
}

struct mavlink_bridge *mavlink_bridge_new(const struct mavlink_bridge_conf *conf, struct mavlink_link *link,
                                          uint64_t now_ns)
{
    struct mavlink_bridge *b = malloc(sizeof *b);
    if (!b)
        return NULL;
    *b = (struct mavlink_bridge){.conf = conf,
                                 .link = link,
                                 .peer = {.network = conf->network},
                                 .parser = {.signing = conf->signing},
                                 .sender = {.component_id = conf->component_id, .signing = conf->signing},
                                 .alert = {[ALERT_LEAK] = {.grave = true}},
                                 .start_ns = now_ns,
                                 .bounded_ns = now_ns,
                                 .obstacles_due_ns = now_ns,
                                 .second_due_ns = now_ns,
                                 .ask_due_ns = now_ns};
    mavlink_vehicle_init(&b->vehicle, &conf->vehicle);
    mavlink_feed_init(&b->feed, &conf->feed);
    return b;
}

void mavlink_bridge_end(struct mavlink_bridge *b)
{
    const struct mavlink_counters *in = &b->parser.counters;
    say("in: %" PRIu64 " frames, %" PRIu64 " of unknown id, %" PRIu64 " bad CRC, %" PRIu64 " bad flags, %" PRIu64
        " bad signature, %" PRIu64 " bytes of garbage, %" PRIu64 " datagrams of others; out: %" PRIu64
        " frames, %" PRIu64 " dropped; poses: %" PRIu64 ", %" PRIu64 " refused, %" PRIu64 " kept back, %" PRIu64
        " positions not measured, %" PRIu64 " messages of doubtful time",
        in->frames, in->unknown, in->bad_crc, in->bad_flags, in->bad_signature, in->garbage_bytes,
        b->peer.strangers, b->sent, b->link->dropped, b->feed.poses, b->feed.poses_refused + b->vehicle.refused,
        b->feed.poses_held, b->vehicle.unaided, b->vehicle.undated);
    mavlink_feed_close(&b->feed);
    mavlink_link_close(b->link);
    free(b);
}
