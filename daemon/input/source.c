/* SPDX-License-Identifier: MIT */
#include "source.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>

#include "drivers/devices/mirror.h"
#include "garbage.h"
#include "input_port.h"

#define READ_BYTES      65536 /* a datagram is taken whole or cut; after so many the others get their turn, ... */
#define READS_PER_EVENT 8     /* ... and after so many of fewer bytes */
#define OUT_BYTES       4096

/* A ping that may have looked farther aside, or from farther off, would put its echo where nothing is. */
#define UNDATED_MAX_DEG 2.5
#define UNDATED_MAX_M   0.5

/* A capture is told the state so often: it may begin, or have a gap, anywhere. */
#define STATE_AGAIN_NS 1000000000u

#define BACKLOG_NS 1000000000u /* a device's deadline waits no longer for what came late to be read */

struct source {
    struct source_env env;
    char name[CONF_NAME_MAX];
    char address[CONF_TEXT_MAX];
    uint16_t index;
    uint32_t seq;
    double aperture_rad[2];          /* in place of the device's; 0: the device's */
    uint64_t delay_ns, by_ns;        /* of its readings, and how uncertain that is */
    double lever_m;                  /* of the sensor, from the vehicle's reference point */
    bool mirrored;                   /* port and starboard swapped */
    char mirror_path[CONF_TEXT_MAX]; /* empty: none */
    struct serial_mirror *mirror;    /* NULL: none, or it could not be made */
    struct input_port line;
    struct loop_timer deadline;
    uint64_t due_ns, lag_ns; /* the device's deadline, and how much later than that it is called */
    uint8_t out[OUT_BYTES];  /* not yet taken by the port */
    size_t n_out;
    bool waits_for_room;
    const struct device_ops *ops;
    void *device;
    struct device_io io;
    int rx_channel, tx_channel, events_channel;
    struct source_event
        state; /* that the capture was told last, or in a replay tells; at first there is no port */
    struct loop_timer state_again;
    bool stirred;              /* since then anything came, or the device was told something */
    struct source_event looks; /* what the device was told last */
    bool stopping;
    uint64_t arrived_ns; /* what was read last */
    bool unread;         /* bytes wait: the first of them ... */
    uint64_t unread_ns;  /* ... came after this */
    uint64_t backlog_ns; /* they were found late, then; 0: they were not */
    uint64_t late_ns;    /* when the bytes were read last whose arrival is not known but for ... */
    uint64_t doubt_ns;   /* ... so long before */
    uint8_t flags_kept;  /* of pings that were not handed on, for the next */
    struct garbage garbage;
    struct source_stats stats;
    uint8_t in[READ_BYTES];
};

/* ---- what a capture keeps of it ---- */

/* Its end is the daemon's, and no silence of the sonar. */
static void keep_event(struct source *s, const struct source_event *event, uint64_t t_ns)
{
    char text[SOURCE_EVENT_TEXT_MAX];
    if (s->env.record && !s->stopping)
        record_message(s->env.record, s->events_channel, t_ns, text, source_event_write(event, text));
}

static struct source_event state_of(const struct source *s)
{
    struct device_status status;
    s->ops->status(s->device, &status);
    return (struct source_event){
        .kind = SOURCE_STATE, .open = input_port_is_open(&s->line), .state = status.state};
}

static void tell_state(struct source *s, uint64_t now_ns)
{
    s->state = state_of(s);
    s->stirred = false;
    keep_event(s, &s->state, now_ns);
    loop_arm(s->env.loop, &s->state_again, now_ns + STATE_AGAIN_NS);
}

/* Where nothing stirs, nothing is told: a replay skips a minute without a message. */
static void on_state_again(void *ctx, uint64_t now_ns)
{
    struct source *s = ctx;
    if (s->stirred)
        tell_state(s, now_ns);
    else
        loop_arm(s->env.loop, &s->state_again, now_ns + STATE_AGAIN_NS);
}

/* After all that may have changed it. */
static void keep_state(struct source *s)
{
    s->stirred = true;
    if (!s->env.record || s->stopping)
        return;
    const struct source_event state = state_of(s);
    if (state.open != s->state.open || state.state != s->state.state)
        tell_state(s, loop_now(s->env.loop));
}

/* The device counts from when its bytes came, lag_ns ago; what it sent because of them it sent only now. In a replay
 * its deadlines come as they came then: a timer would fire at another moment than a busy computer's did. */
static void rearm(struct source *s, uint64_t lag_ns)
{
    if (s->env.replay)
        return;
    const uint64_t due_ns = s->ops->deadline(s->device);
    if (due_ns != s->due_ns)
        s->lag_ns = lag_ns;
    s->due_ns = due_ns;
    loop_arm(s->env.loop, &s->deadline, due_ns < LOOP_NEVER - s->lag_ns ? due_ns + s->lag_ns : LOOP_NEVER);
}

/* ---- what the device asks for ---- */

static void flush(struct source *s)
{
    while (s->n_out) {
        ssize_t n = input_port_write(&s->line, s->out, s->n_out);
        if (n < 0)
            s->n_out = 0;
        if (n <= 0)
            break;
        memmove(s->out, s->out + n, s->n_out - (size_t)n);
        s->n_out -= (size_t)n;
    }
    bool wait = s->n_out > 0;
    if (wait != s->waits_for_room) {
        s->waits_for_room = wait;
        input_port_wait_for_room(&s->line, wait);
    }
}

static void io_send(void *ctx, const uint8_t *bytes, size_t n)
{
    struct source *s = ctx;
    if (!input_port_is_open(&s->line))
        return;
    if (n > OUT_BYTES - s->n_out) {
        s->stats.bytes_not_sent += n;
        return;
    }
    memcpy(s->out + s->n_out, bytes, n);
    s->n_out += n;
    s->stats.bytes_out += n;
    if (s->env.record)
        record_message(s->env.record, s->tx_channel, loop_now(s->env.loop), bytes, n);
    flush(s);
}

static void io_hold_break(void *ctx, bool on)
{
    struct source *s = ctx;
    if (input_port_is_open(&s->line))
        s->line.port.ops->hold_break(&s->line.port, on);
}

static struct ping *io_ping_begin(void *ctx)
{
    struct source *s = ctx;
    return pipeline_begin(s->env.pipeline);
}

/* What a sensor that is not in the middle moves when the vehicle turns. */
static void blur_lever(const struct source *s, struct pose *pose)
{
    pose->blur_any_m += s->lever_m * fmin(pose->blur_rad, GEO_PI);
}

/*
 * A reading that comes late is dated back, and its pose allows for all the time that it may be from. A ping whose bytes
 * waited while the process was held up may be as old as they: it gets that time, and a pose that allows for every other
 * until they were read. False: it may have looked from so many places or in so many directions that it says nothing of
 * any.
 */
static bool place(struct source *s, struct ping *ping)
{
    const uint64_t doubt_ns = ping->t_ns <= s->late_ns ? s->doubt_ns : 0;
    const uint64_t came_ns = s->env.ping_time(s->env.ctx, s, ping);
    const uint64_t t_ns = came_ns > s->delay_ns ? came_ns - s->delay_ns : 0;
    if (!doubt_ns) {
        ping->t_ns = t_ns;
        pose_log_blurred(s->env.poses, t_ns, s->by_ns, &ping->pose);
        blur_lever(s, &ping->pose);
        return true;
    }
    s->stats.undated_pings++;
    ping->t_ns = t_ns > doubt_ns + s->by_ns ? t_ns - doubt_ns - s->by_ns : 0;
    pose_log_within(s->env.poses, ping->t_ns, t_ns + s->by_ns, &ping->pose);
    return ping->pose.uncertain_rad <= geo_rad(UNDATED_MAX_DEG) && ping->pose.uncertain_m <= UNDATED_MAX_M;
}

static void io_ping_done(void *ctx, struct ping *ping)
{
    struct source *s = ctx;
    ping->seq = ++s->seq;
    ping->sensor = s->index;
    ping->flags = (uint8_t)(ping->flags | s->flags_kept);
    const bool placed = place(s, ping);
    s->flags_kept = placed ? 0 : (uint8_t)(ping->flags & PING_NEW_TURN);
    if (!placed)
        return;
    if (s->mirrored)
        mirror_ping(ping);
    if (s->aperture_rad[0] > 0) {
        ping->az_aperture_rad = (float)s->aperture_rad[0];
        ping->el_aperture_rad = (float)s->aperture_rad[1];
    }
    s->env.on_ping(s->env.ctx, s, ping);
    pipeline_submit(s->env.pipeline, ping);
}

static void io_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    static const enum log_level levels[] = {
        [NOTE_DEBUG] = LOG_DEBUG, [NOTE_INFO] = LOG_INFO, [NOTE_WARNING] = LOG_WARNING};
    struct source *s = ctx;
    char text[DEVICE_NOTE_MAX];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(text, sizeof text, fmt, ap);
    va_end(ap);
    log_limited(loop_now(s->env.loop), levels[level], LOG_ABOUT(.event = "device", .sonar = s->name), "%s", text);
}

/* ---- what the device is told ---- */

/* All but its bytes and its settings: live and in a replay through here, so that a capture keeps each. */
static void tell(struct source *s, const struct source_event *event, uint64_t t_ns)
{
    keep_event(s, event, t_ns);
    switch (event->kind) {
    case SOURCE_OPENED:
        s->ops->opened(s->device, t_ns, &s->io);
        break;
    case SOURCE_CLOSED:
        s->ops->closed(s->device, t_ns);
        break;
    case SOURCE_TICK:
        s->ops->tick(s->device, t_ns, &s->io);
        break;
    case SOURCE_LOOKS:
        s->ops->steer(s->device, event->from_rad, event->to_rad, event->only);
        return;
    case SOURCE_STATE:
        return;
    }
    rearm(s, 0);
    keep_state(s);
}

/* ---- the port comes and goes ---- */

static void on_opened(void *ctx, uint64_t now_ns, bool again)
{
    struct source *s = ctx;
    s->n_out = 0;
    s->waits_for_room = s->unread = false;
    s->backlog_ns = 0;
    if (again) /* the device goes on asking */
        keep_state(s);
    else
        tell(s, &(struct source_event){.kind = SOURCE_OPENED}, now_ns);
}

static void on_closed(void *ctx, uint64_t now_ns)
{
    tell(ctx, &(struct source_event){.kind = SOURCE_CLOSED}, now_ns);
}

static void on_rests(void *ctx)
{
    keep_state(ctx);
}

static uint64_t count_messages(const void *ctx)
{
    const struct source *s = ctx;
    struct device_status status;
    s->ops->status(s->device, &status);
    return status.frames;
}

static void count_garbage(const void *source, struct garbage_count *now)
{
    const struct source *s = source;
    struct device_status status;
    s->ops->status(s->device, &status);
    *now = (struct garbage_count){
        .bytes = s->stats.bytes_in, .garbage = status.garbage_bytes, .messages = status.frames};
}

static void take_bytes(struct source *s, const uint8_t *bytes, size_t n, const struct record_time *came)
{
    const uint64_t t_ns = came->t_ns, doubt_ns = came->t_ns - came->since_ns;
    s->stats.bytes_in += n;
    if (doubt_ns) { /* what began in the late bytes before may end in these */
        const bool follows = t_ns - s->late_ns < doubt_ns + BACKLOG_NS;
        s->doubt_ns = follows && s->doubt_ns > doubt_ns ? s->doubt_ns : doubt_ns;
        s->late_ns = t_ns;
    }
    if (s->env.record)
        record_message_of(s->env.record, s->rx_channel, came, bytes, n);
    if (s->mirror)
        serial_mirror_write(s->mirror, bytes, n);
    s->ops->feed(s->device, bytes, n, t_ns, &s->io);
    rearm(s, loop_now(s->env.loop) - t_ns);
    keep_state(s);
    garbage_heard(&s->garbage);
}

/* When the bytes just read came in: as the kernel noted, but never before those that came before them. Where it notes
 * nothing, they came since they were last seen not to wait. */
static struct record_time arrival(struct source *s, uint64_t now_ns)
{
    const uint64_t noted_ns = s->line.port.t_ns, t_ns = noted_ns && noted_ns < now_ns ? noted_ns : now_ns;
    s->arrived_ns = t_ns > s->arrived_ns ? t_ns : s->arrived_ns;
    const bool known = noted_ns || s->arrived_ns <= s->unread_ns + LOOP_TIMELY_NS;
    return (struct record_time){.t_ns = s->arrived_ns, .since_ns = known ? s->arrived_ns : s->unread_ns};
}

/* Bytes are ready. If they have waited long, the poses that came meanwhile wait as well, in other descriptors: they are
 * needed first, and have this turn for it. */
static bool gives_way(struct source *s, uint64_t now_ns)
{
    if (!s->unread) {
        s->unread = true;
        s->unread_ns = loop_since(s->env.loop);
    }
    if (s->backlog_ns || now_ns - s->unread_ns <= LOOP_TIMELY_NS)
        return false;
    s->backlog_ns = now_ns;
    return true;
}

static void on_ready(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct source *s = ctx;
    size_t taken = 0;
    if (gives_way(s, now_ns))
        return;
    for (int i = 0; i < READS_PER_EVENT && taken < READ_BYTES; i++) {
        ssize_t n = input_port_read(&s->line, s->in, sizeof s->in);
        if (n < 0)
            return;
        if (n == 0) {
            s->unread = false;
            s->backlog_ns = 0;
            break;
        }
        taken += (size_t)n;
        const struct record_time came = arrival(s, loop_reread(s->env.loop));
        take_bytes(s, s->in, (size_t)n, &came);
        if (!input_port_is_open(&s->line))
            return;
    }
    if (events & EPOLLOUT)
        flush(s);
}

/* Nobody is silent whose bytes wait to be read. */
static void on_deadline(void *ctx, uint64_t now_ns)
{
    struct source *s = ctx;
    if (s->backlog_ns && now_ns - s->backlog_ns < BACKLOG_NS) {
        loop_arm(s->env.loop, &s->deadline, now_ns);
        return;
    }
    tell(s, &(struct source_event){.kind = SOURCE_TICK}, now_ns);
}

/* ---- life ---- */

/* A body-side azimuth as the sensor has it. */
static double to_sensor(const struct mount *mount, double az_rad)
{
    double v[3], az, el;
    geo_direction(az_rad, 0, v);
    quat_rotate_inverse(mount->attitude, v, v);
    geo_angles(v, &az, &el);
    return az;
}

#define FULL_CIRCLE_SLACK_RAD 1e-6

/* The configured sector is the vehicle's; the head's own is turned with its mount, and mirrored when it hangs upside
 * down. */
static void sector_of(const struct conf_sonar *conf, struct device_conf *d)
{
    if (fabs(geo_wrap_pi(conf->sector_rad[1] - conf->sector_rad[0])) < FULL_CIRCLE_SLACK_RAD)
        return; /* equal ends: the full circle */
    struct mount mount = mount_identity;
    double down[3] = {0, 0, 1};
    quat_from_rpy(conf->rotation_rad[0], conf->rotation_rad[1], conf->rotation_rad[2], mount.attitude);
    quat_rotate(mount.attitude, down, down);
    bool inverted = down[2] < 0;
    d->sector_start_rad = to_sensor(&mount, conf->sector_rad[inverted ? 1 : 0]);
    d->sector_end_rad = to_sensor(&mount, conf->sector_rad[inverted ? 0 : 1]);
    if (conf->mirror)
        mirror_arc(&d->sector_start_rad, &d->sector_end_rad);
}

/* Is it in a replay of a capture that keeps its events? */
static bool is_told(const struct source *s)
{
    return s->env.replay && (s->env.told >> s->index & 1);
}

static void describe_device(const struct source *s, const struct conf_sonar *conf, const struct conf_water *water,
                            struct device_conf *d)
{
    const struct port_ops *port = s->line.port.ops;
    const bool has_line = !(s->env.no_line >> s->index & 1);
    *d = (struct device_conf){.range_m = conf->range_m,
                              .sound_speed_mps = water->sound_speed_mps,
                              .gain = conf->gain,
                              .step_rad = conf->step_rad,
                              .frequency_hz = conf->frequency_hz,
                              .min_confidence = conf->min_confidence,
                              .request_response = conf->mode == CONF_MODE_REQUEST,
                              .steered = s->env.steered >> s->index & 1,
                              .circle_s = conf->circle_s,
                              .listen_only = s->env.replay && !is_told(s),
                              .node = conf->node,
                              .sensor_id = conf->sensor_id,
                              .baud = has_line && port->baud ? port->baud(s->line.rest) : 0,
                              .least_baud = port->least_baud};
    sector_of(conf, d);
}

static void open_channels(struct source *s)
{
    char topic[CONF_NAME_MAX + 8];
    snprintf(topic, sizeof topic, "/%s/rx", s->name);
    s->rx_channel = record_channel(s->env.record, topic, s->line.port.ops->encoding);
    snprintf(topic, sizeof topic, "/%s/tx", s->name);
    s->tx_channel = record_channel(s->env.record, topic, s->line.port.ops->encoding);
    snprintf(topic, sizeof topic, "/%s/events", s->name);
    s->events_channel = record_channel(s->env.record, topic, "json");
}

/* Finds port and device, sees to it that they fit together, and hands the device its configuration. */
static bool set_device(struct source *s, const struct conf_sonar *conf, const struct conf_water *water,
                       struct fault *fault)
{
    static const struct input_port_events events = {.open = "port_open",
                                                    .failed = "port_failed",
                                                    .lost = "port_lost",
                                                    .dead = "port_dead",
                                                    .stranger = "port_stranger"};
    const struct input_port_env line = {.loop = s->env.loop,
                                        .worker = s->env.worker,
                                        .sonar = s->name,
                                        .address = s->address,
                                        .events = &events,
                                        .ctx = s,
                                        .opened = on_opened,
                                        .ready = on_ready,
                                        .closed = on_closed,
                                        .rests = on_rests,
                                        .messages = count_messages};
    struct device_conf d;
    s->ops = device_find(conf->device);
    if (!input_port_init(&s->line, &line, fault))
        return false;
    if (!s->ops)
        return fault_set(fault, "device = %s: there is none", conf->device);
    s->line.port.only_listens = s->ops->listens;
    s->line.dead.asked = !s->ops->listens;
    if (conf->power[0] && conf->power_cycle_after_s > 0) /* that may be all it takes */
        s->line.dead.first_ns = (uint64_t)(conf->power_cycle_after_s * 0.5e9);
    bool wants_frames = s->ops->can_match != NULL;
    if (wants_frames != (strcmp(s->line.port.ops->encoding, "socketcan") == 0))
        return fault_set(fault, "device = %s: does not work over %s; it needs %s", conf->device, s->address,
                         wants_frames ? "a CAN bus, as port = can:can0"
                                      : "a stream of bytes; on a CAN bus that is isotp: or canstream:");
    if (wants_frames && conf->tap[0])
        return fault_set(fault, "tap = %s: a tap mirrors a byte stream, not a CAN bus", conf->tap);
    if (conf->mirror && s->ops->axial)
        return fault_set(fault, "mirror = yes: a %s has one beam along its axis, and no sides to swap",
                         conf->device);
    s->device = calloc(1, s->ops->state_size);
    describe_device(s, conf, water, &d);
    if (!s->device || !s->ops->init(s->device, &d, fault))
        return false;
    if (wants_frames)
        s->line.port.can_match = s->ops->can_match(s->device);
    return true;
}

void source_steer(struct source *s, double from_rad, double to_rad, bool only)
{
    if (s->mirrored)
        mirror_arc(&from_rad, &to_rad);
    const struct source_event looks = {.kind = SOURCE_LOOKS, .from_rad = from_rad, .to_rad = to_rad, .only = only};
    const struct source_event *was = &s->looks;
    if (was->from_rad == from_rad && was->to_rad == to_rad && was->only == only)
        return;
    s->looks = looks;
    tell(s, &looks, loop_now(s->env.loop));
}

void source_retune(struct source *s, const struct conf_sonar *conf, const struct conf_water *water)
{
    struct device_conf d;
    describe_device(s, conf, water, &d);
    s->ops->retune(s->device, &d, loop_now(s->env.loop), &s->io);
    rearm(s, 0);
    keep_state(s);
}

struct device_delay source_delay(const struct conf_sonar *conf, const struct device_ops *ops)
{
    return conf->delay_s[0] < 0 ? ops->delay
                                : (struct device_delay){.s = conf->delay_s[0], .uncertain_s = conf->delay_s[1]};
}

bool source_check(const struct conf_sonar *conf, const struct conf_water *water, struct fault *fault)
{
    struct source *s = calloc(1, sizeof *s);
    if (!s)
        return fault_set(fault, "device: out of memory");
    snprintf(s->address, sizeof s->address, "%s", conf->port);
    const bool good = set_device(s, conf, water, fault);
    input_port_end(&s->line);
    free(s->device);
    free(s);
    return good;
}

struct source *source_new(const struct source_env *env, const struct conf_sonar *conf,
                          const struct conf_water *water, uint16_t index, struct fault *fault)
{
    struct source *s = calloc(1, sizeof *s);
    if (!s) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    s->env = *env;
    s->index = index;
    snprintf(s->name, sizeof s->name, "%s", conf->name);
    snprintf(s->address, sizeof s->address, "%s", conf->port);
    snprintf(s->mirror_path, sizeof s->mirror_path, "%s", conf->tap);
    memcpy(s->aperture_rad, conf->aperture_rad, sizeof s->aperture_rad);
    s->lever_m = geo_length(conf->mount_m);
    s->mirrored = conf->mirror;
    s->deadline = (struct loop_timer){.fire = on_deadline, .ctx = s};
    s->state_again = (struct loop_timer){.fire = on_state_again, .ctx = s};
    s->io = (struct device_io){.ctx = s,
                               .send = io_send,
                               .hold_break = io_hold_break,
                               .ping_begin = io_ping_begin,
                               .ping_done = io_ping_done,
                               .note = io_note};
    if (!set_device(s, conf, water, fault)) {
        source_free(s);
        return NULL;
    }
    const struct device_delay delay = source_delay(conf, s->ops);
    s->delay_ns = (uint64_t)(delay.s * 1e9);
    s->by_ns = (uint64_t)(delay.uncertain_s * 1e9);
    s->garbage = (struct garbage){.loop = env->loop,
                                  .sonar = s->name,
                                  .whose = "",
                                  .port = s->address,
                                  .speech = s->ops->name,
                                  .count = count_garbage,
                                  .owner = s};
    if (env->record)
        open_channels(s);
    return s;
}

/* The sonar is worth more than those who listen in: without a tap everything else goes on. */
static void open_mirror(struct source *s)
{
    struct fault fault;
    if (s->mirror_path[0] == '\0')
        return;
    s->mirror = serial_mirror_open(s->mirror_path, &fault);
    if (!s->mirror)
        log_sonar(LOG_WARNING, "serial_mirror_failed", s->name, "%s; continuing without it", fault.text);
}

void source_start(struct source *s)
{
    if (is_told(s)) /* its capture has when the port was opened, if it does not begin later */
        return;
    if (s->env.replay) {
        s->ops->opened(s->device, loop_now(s->env.loop), &s->io);
        return;
    }
    if (s->env.record)
        tell_state(s, loop_now(s->env.loop));
    open_mirror(s);
    input_port_start(&s->line);
}

void source_befell(struct source *s, const struct source_event *event, uint64_t t_ns)
{
    if (event->kind == SOURCE_STATE)
        s->state = *event;
    else if (event->kind != SOURCE_LOOKS || s->ops->steer)
        tell(s, event, t_ns);
}

void source_feed(struct source *s, const uint8_t *bytes, size_t n, const struct record_time *came)
{
    take_bytes(s, bytes, n, came);
}

void source_stop(struct source *s)
{
    input_port_stop(&s->line);
    s->stopping = true;
    loop_arm(s->env.loop, &s->state_again, LOOP_NEVER);
    if (input_port_is_open(&s->line)) {
        s->ops->stop(s->device, loop_now(s->env.loop), &s->io);
        rearm(s, 0);
    }
}

bool source_stopped(const struct source *s)
{
    return !input_port_is_open(&s->line) || (s->ops->deadline(s->device) == LOOP_NEVER && s->n_out == 0);
}

void source_free(struct source *s)
{
    if (!s)
        return;
    input_port_end(&s->line);
    loop_arm(s->env.loop, &s->deadline, LOOP_NEVER);
    loop_arm(s->env.loop, &s->state_again, LOOP_NEVER);
    garbage_end(&s->garbage);
    serial_mirror_close(s->mirror);
    free(s->device);
    free(s);
}

const char *source_name(const struct source *s)
{
    return s->name;
}

uint16_t source_index(const struct source *s)
{
    return s->index;
}

void source_stats(const struct source *s, struct source_stats *out)
{
    *out = s->stats;
    s->ops->status(s->device, &out->device);
    out->open = input_port_is_open(&s->line);
    if (is_told(s)) {
        out->open = s->state.open;
        out->device.state = s->state.state;
    }
    out->reconnects = s->line.reconnects;
    out->port_error = s->line.error;
    out->port_lost = s->line.port.lost;
    out->port_refused = s->line.port.refused;
    out->port_strangers = s->line.port.strangers + out->device.strangers;
    out->bus = s->line.port.bus;
    out->mostly_garbage = s->garbage.mostly;
    if (s->mirror)
        serial_mirror_status(s->mirror, &out->tap);
}
