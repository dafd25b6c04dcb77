/* SPDX-License-Identifier: MIT */
/*
 * ping360_device - the Blue Robotics Ping360 scanning sonar as a state machine: wakes the head up, asks who it is, sets it
 * scanning, notices what does not come, and turns its data frames into pings. See device.h for the rules and
 * ping360.h for the configuration. Knows no descriptor, no clock and no grid.
 *
 *   opened -> WAKE -> AUTOBAUD -> IDENTIFY -> VERSION -> AUTO or REQUEST     (stop: STOPPING -> IDLE)
 *              ^  ^                   | no answer           | silence
 *              |  +-------------------|---------------------+
 *              +--------- WAIT <------+
 */
#include "ping360.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "device.h"
#include "ping360_scan.h"

#define NEVER  UINT64_MAX
#define MS     1000000ull
#define SECOND 1000000000ull

#define BREAK_MS       12u       /* the head wants 10 at least */
#define WAKE_NS        (10 * MS) /* from the break until the head measures the speed of the line ... */
#define AUTOBAUD_BYTES 10u       /* ... by so many 'U' ... */
#define AUTOBAUD_NS    (11 * MS) /* ... and until it listens */
#define ANSWER_NS      (500 * MS)
#define ANSWER_TRIES   3
#define RETRY_FIRST_NS (250 * MS)
#define RETRY_MAX_NS   (2 * SECOND)
#define STOP_NS        (250 * MS)
#define STOP_TRIES     3
#define QUIET_NS       (40 * MS) /* adapters hold bytes back up to 16 ms; a frame that paused longer was cut off */

#define TRAVEL_ANY_NS     (4200 * MS) /* the longest way of the head, from anywhere to anywhere */
#define TRAVEL_GRADIAN_NS (8 * MS)    /* measured: 6 to 10 */
#define TRAVEL_NEAR       20          /* gradians; beyond, and from an unknown angle, TRAVEL_ANY_NS is waited */
/*
 * Waited on top of line, listening and travel. This and the travel allowed for one step are what a lost frame costs,
 * besides being asked for again: 190 ms at 10 gradians.
 */
#define MARGIN_NS        (110 * MS)
#define MISSED_MAX       5 /* pings in a row that were asked for in vain: wake the head up anew ... */
#define MISSED_FIRST_MAX 2 /* ... when the first ones, with the long wait, stay out */
#define AUTO_SILENCE_NS  SECOND
#define SPEAK_UP_TRIES   2

#define TYPE_PING360     2
#define TRANSDUCER_BYTES (PING_OVERHEAD + 14u)
#define DATA_BYTES       (PING_OVERHEAD + 14u) /* of a device_data frame, without the samples */

enum phase {
    PHASE_CLOSED,
    PHASE_LISTEN,   /* listen_only: nothing but this while open */
    PHASE_WAKE,     /* the break was sent */
    PHASE_AUTOBAUD, /* the 'U's were sent */
    PHASE_IDENTIFY, /* device_information was asked for */
    PHASE_VERSION,  /* protocol_version was asked for */
    PHASE_AUTO,     /* the head scans by itself */
    PHASE_REQUEST,  /* one transducer message per ping */
    PHASE_WAIT,     /* until the next attempt to wake it up */
    PHASE_STOPPING, /* motor_off was sent */
    PHASE_IDLE,
};

struct ping360 {
    struct device_conf conf;
    struct ping360_settings set;
    struct ping360_scan scan;

    enum phase phase;
    uint64_t due_ns;
    unsigned tries;    /* in this phase, since the last answer */
    uint64_t retry_ns; /* next wait of PHASE_WAIT */
    bool silent;       /* has let us down, and no ping came since */
    bool answered;     /* a ping came since the settings were sent */
    bool auto_refused; /* automatic scan, by this firmware */

    struct ping360_track track;
    bool new_turn; /* the next ping begins one */

    struct ping_parser parser;
    struct device_status status; /* state, frames, garbage_bytes, bad_checksum: filled in when asked */
};

/* ---- how long things take ---- */

static uint64_t line_ns(const struct ping360 *d, size_t bytes)
{
    return ping_line_ns(d->conf.baud, bytes);
}

/* The time in which a ping from `angle` must have come, whole, after the head was told. */
static uint64_t answer_ns(const struct ping360 *d, uint16_t angle)
{
    uint64_t travel_ns = TRAVEL_ANY_NS;
    if (d->track.head != PING360_ANGLE_UNKNOWN) {
        int turn = ping360_way(d->track.head, angle);
        unsigned gradians = (unsigned)(turn < 0 ? -turn : turn);
        if (gradians <= TRAVEL_NEAR)
            travel_ns = gradians * TRAVEL_GRADIAN_NS;
    }
    return line_ns(d, TRANSDUCER_BYTES + DATA_BYTES + d->set.n_samples) + ping360_listening_ns(&d->set) +
           travel_ns + MARGIN_NS;
}

/* How long a head that scans by itself may be silent: three pings, but never less than AUTO_SILENCE_NS. */
static uint64_t auto_silence_ns(const struct ping360 *d)
{
    uint64_t ping_ns = line_ns(d, DATA_BYTES + d->set.n_samples) + ping360_listening_ns(&d->set) +
                       d->scan.step * TRAVEL_GRADIAN_NS;
    return 3 * ping_ns > AUTO_SILENCE_NS ? 3 * ping_ns : AUTO_SILENCE_NS;
}

/* ---- configuration ---- */

/* Says in err what is wrong, or leaves it alone and returns true. Comparisons are written so that NaN fails. */
static bool check_conf(const struct device_conf *conf, double frequency_khz, char *err, size_t err_size)
{
    const double far_rad = 2.0 * GEO_TURN;

    if (!(conf->range_m >= 0.75 && conf->range_m <= 200.0))
        snprintf(err, err_size, "range = %g m: a Ping360 does 0.75 .. 200 m", conf->range_m);
    else if (!(conf->sound_speed_mps >= 1350.0 && conf->sound_speed_mps <= 1650.0))
        snprintf(err, err_size, "sound_speed = %g m/s: must be 1350 .. 1650 m/s", conf->sound_speed_mps);
    else if (conf->gain < -1 || conf->gain > 2)
        snprintf(err, err_size, "gain = %d: a Ping360 has 0 (low), 1 (normal) and 2 (high)", conf->gain);
    else if (!(frequency_khz >= 500.0 && frequency_khz <= 1000.0))
        snprintf(err, err_size, "frequency = %g kHz: a Ping360 does 500 .. 1000 kHz", frequency_khz);
    else if (!(conf->step_rad >= 0.0 && conf->step_rad <= GEO_PI))
        snprintf(err, err_size, "step = %g deg: must be 0.9 .. 180 deg", geo_deg(conf->step_rad));
    else if (!(fabs(conf->sector_start_rad) <= far_rad && fabs(conf->sector_end_rad) <= far_rad))
        snprintf(err, err_size, "sector = %g %g deg: must lie in -720 .. 720 deg", geo_deg(conf->sector_start_rad),
                 geo_deg(conf->sector_end_rad));
    else
        return true;
    return false;
}

static bool ping360_init(void *state, const struct device_conf *conf, char *err, size_t err_size)
{
    struct ping360 *d = state;
    double frequency_khz = conf->frequency_hz != 0.0 ? conf->frequency_hz / 1e3 : 750.0;

    if (!check_conf(conf, frequency_khz, err, err_size))
        return false;
    memset(d, 0, sizeof(*d));
    d->conf = *conf;
    d->set.mode = 1;
    d->set.gain = (uint8_t)(conf->gain < 0 ? 1 : conf->gain);
    d->set.frequency_khz = (uint16_t)lround(frequency_khz);
    ping360_set_range(&d->set, conf->range_m, conf->sound_speed_mps);
    ping360_scan_init(&d->scan, conf->sector_start_rad, conf->sector_end_rad, conf->step_rad);
    ping360_track_reset(&d->track);
    ping_parser_init(&d->parser, PING_PAYLOAD_MAX);
    d->phase = PHASE_CLOSED;
    d->due_ns = NEVER;
    return true;
}

/* ---- what is sent ---- */

static void enter(struct ping360 *d, enum phase phase, uint64_t due_ns)
{
    d->phase = phase;
    d->due_ns = due_ns;
}

static void wake(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    d->answered = false;
    d->auto_refused = false;
    d->track.head = PING360_ANGLE_UNKNOWN;
    if (d->conf.baud)
        io->send_break(io->ctx, BREAK_MS);
    enter(d, PHASE_WAKE, now_ns + (d->conf.baud ? BREAK_MS * MS + WAKE_NS : 0));
}

static void send_autobaud(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[AUTOBAUD_BYTES];
    memset(out, 'U', sizeof(out));
    if (d->conf.baud)
        io->send(io->ctx, out, sizeof(out));
    enter(d, PHASE_AUTOBAUD, now_ns + (d->conf.baud ? line_ns(d, sizeof(out)) + AUTOBAUD_NS : 0));
}

static void ask(struct ping360 *d, enum phase phase, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD + 2];
    uint16_t id = phase == PHASE_IDENTIFY ? PING_DEVICE_INFORMATION : PING_PROTOCOL_VERSION;
    d->tries = phase == d->phase ? d->tries + 1 : 1;
    io->send(io->ctx, out, ping_encode_request(out, sizeof(out), id));
    enter(d, phase, now_ns + ANSWER_NS);
}

static void request_ping(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[TRANSDUCER_BYTES];
    d->set.angle = ping360_scan_angle(&d->scan);
    io->send(io->ctx, out, ping360_encode_transducer(out, sizeof(out), &d->set, true));
    enter(d, PHASE_REQUEST, now_ns + answer_ns(d, d->set.angle));
}

static void start_scan(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[32];
    d->tries = 0;
    d->answered = false;
    if (d->conf.request_response || d->auto_refused || !d->scan.by_itself) {
        request_ping(d, now_ns, io);
        return;
    }
    io->send(io->ctx, out, ping360_encode_auto_transmit(out, sizeof(out), &d->set, &d->scan.sweep));
    enter(d, PHASE_AUTO, now_ns + answer_ns(d, d->scan.sweep.start));
}

static void send_motor_off(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD];
    d->tries = d->phase == PHASE_STOPPING ? d->tries + 1 : 1;
    io->send(io->ctx, out, ping360_encode_motor_off(out, sizeof(out)));
    enter(d, PHASE_STOPPING, now_ns + STOP_NS);
}

/* ---- what does not come ---- */

/* Said once, when the silence begins, not at every try. */
static void fall_silent(struct ping360 *d, const char *why, const struct device_io *io)
{
    if (!d->silent)
        io->note(io->ctx, NOTE_WARNING, "%s; trying on", why);
    d->silent = true;
}

static void wait_retry(struct ping360 *d, uint64_t now_ns)
{
    enter(d, PHASE_WAIT, now_ns + d->retry_ns);
    d->retry_ns = 2 * d->retry_ns < RETRY_MAX_NS ? 2 * d->retry_ns : RETRY_MAX_NS;
}

static void restart(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    d->status.restarts++;
    fall_silent(d, "the Ping360 sends no more pings", io);
    wake(d, now_ns, io);
}

/* Over a network the silence may have a harmless cause: a bridge answers whoever spoke last. */
static void speak_up(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD + 2];
    d->tries++;
    io->send(io->ctx, out, ping_encode_request(out, sizeof(out), PING_DEVICE_INFORMATION));
    d->due_ns = now_ns + SECOND;
}

static void auto_missed(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    if (d->answered && !d->conf.baud && d->tries < SPEAK_UP_TRIES) {
        speak_up(d, now_ns, io);
        return;
    }
    if (d->answered) {
        restart(d, now_ns, io);
        return;
    }
    io->note(io->ctx, NOTE_INFO, "no answer to auto_transmit: asking for every ping");
    d->auto_refused = true;
    start_scan(d, now_ns, io);
}

static void ping_missed(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    d->status.lost_frames++;
    d->tries++;
    if (d->tries < (d->answered ? MISSED_MAX : MISSED_FIRST_MAX))
        request_ping(d, now_ns, io);
    else
        restart(d, now_ns, io);
}

static void identity_missed(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    if (d->tries < ANSWER_TRIES) {
        ask(d, PHASE_IDENTIFY, now_ns, io);
        return;
    }
    fall_silent(d, "no answer from a Ping360 (power, wiring, baud rate?)", io);
    wait_retry(d, now_ns);
}

/* The deadline of an answer has passed. */
static void missed(struct ping360 *d, uint64_t now_ns, const struct device_io *io)
{
    d->status.timeouts++;
    if (d->phase == PHASE_IDENTIFY)
        identity_missed(d, now_ns, io);
    else if (d->phase == PHASE_VERSION && d->tries < ANSWER_TRIES)
        ask(d, PHASE_VERSION, now_ns, io);
    else if (d->phase == PHASE_VERSION)
        start_scan(d, now_ns, io); /* it is known well enough without */
    else if (d->phase == PHASE_AUTO)
        auto_missed(d, now_ns, io);
    else if (d->phase == PHASE_REQUEST)
        ping_missed(d, now_ns, io);
    else if (d->phase == PHASE_STOPPING && d->tries < STOP_TRIES)
        send_motor_off(d, now_ns, io);
    else
        enter(d, PHASE_IDLE, NEVER);
}

/* ---- what comes ---- */

static void make_ping(struct ping360 *d, const struct ping360_data *data, const struct ping_frame *frame,
                      const struct device_io *io)
{
    d->status.pings++;
    d->status.last_ping_ns = frame->t_last_ns;
    d->status.range_m = data->set.n_samples * ping360_sample_m(&data->set, d->conf.sound_speed_mps);
    struct ping *ping = io->ping_begin(io->ctx);
    if (!ping)
        return;
    ping360_fill_ping(ping, frame, data, d->conf.sound_speed_mps, d->conf.baud);
    ping->flags = d->new_turn ? PING_NEW_TURN : 0;
    d->new_turn = false;
    io->ping_done(io->ctx, ping);
}

static const char *way_of_scanning(const struct ping360 *d)
{
    return d->phase == PHASE_AUTO      ? "scanning by itself"
           : d->phase == PHASE_REQUEST ? "asked for every ping"
                                       : "heard";
}

static void on_data(struct ping360 *d, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    struct ping360_data data;
    unsigned missing;

    if (!ping360_decode_data(frame, &data) || data.set.angle >= PING360_TURN || data.set.sample_period == 0 ||
        data.set.sample_period > PING360_PERIOD_MAX) {
        d->status.bad_frame++;
        return;
    }
    if (ping360_track_follow(&d->track, &data, &missing))
        d->new_turn = true;
    d->status.lost_frames += missing;
    if (data.n_data > 0) /* else the head only moved, or told its settings */
        make_ping(d, &data, frame, io);

    d->silent = false;
    d->retry_ns = RETRY_FIRST_NS;
    if (!d->answered)
        io->note(io->ctx, NOTE_INFO, "%s, %s, range %.4g m", d->status.what[0] ? d->status.what : "Ping360",
                 way_of_scanning(d), data.set.n_samples * ping360_sample_m(&data.set, d->conf.sound_speed_mps));
    d->answered = true;
    if (d->phase == PHASE_AUTO) {
        d->tries = 0;
        d->due_ns = now_ns + auto_silence_ns(d);
    } else if (d->phase == PHASE_REQUEST && data.set.angle == d->set.angle) {
        d->tries = 0; /* an answer from another angle is a late one: the one asked for is still to come */
        ping360_scan_advance(&d->scan);
        request_ping(d, now_ns, io);
    }
}

static void on_identity(struct ping360 *d, const struct ping_frame *frame, uint64_t now_ns,
                        const struct device_io *io)
{
    struct ping_device_information info;
    bool waiting = d->phase == PHASE_IDENTIFY || d->phase == PHASE_WAIT;

    if (!ping_decode_device_information(frame, &info)) {
        d->status.bad_frame++;
    } else if (info.type == TYPE_PING360) {
        snprintf(d->status.what, sizeof(d->status.what), "Ping360 fw %u.%u.%u id %u", info.firmware[0],
                 info.firmware[1], info.firmware[2], frame->src);
        if (waiting)
            ask(d, PHASE_VERSION, now_ns, io);
    } else if (waiting) {
        char why[64];
        snprintf(why, sizeof(why), "the device there is of type %u, not a Ping360 (2)", info.type);
        fall_silent(d, why, io);
        wait_retry(d, now_ns);
    }
}

static void on_ack(struct ping360 *d, const struct ping_frame *frame)
{
    uint16_t id;
    if (!ping_decode_ack(frame, &id))
        d->status.bad_frame++;
    else if (d->phase == PHASE_STOPPING && id == PING360_MOTOR_OFF)
        enter(d, PHASE_IDLE, NEVER);
}

static void on_nack(struct ping360 *d, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    uint16_t id;
    const char *text;
    size_t n;
    char shown[81];

    if (!ping_decode_nack(frame, &id, &text, &n)) {
        d->status.bad_frame++;
        return;
    }
    d->status.nacks++;
    io->note(io->ctx, NOTE_INFO, "refused message %u: %s", id, ping_text(shown, sizeof(shown), text, n));
    if (d->phase == PHASE_AUTO && id == PING360_AUTO_TRANSMIT) {
        d->auto_refused = true;
        start_scan(d, now_ns, io);
    } else if (d->phase == PHASE_VERSION && (id == PING_PROTOCOL_VERSION || id == PING_GENERAL_REQUEST)) {
        start_scan(d, now_ns, io);
    } else if (d->phase == PHASE_STOPPING && id == PING360_MOTOR_OFF) {
        enter(d, PHASE_IDLE, NEVER);
    }
}

static void on_version(struct ping360 *d, const struct ping_frame *frame, uint64_t now_ns,
                       const struct device_io *io)
{
    uint8_t v[3];
    if (!ping_decode_protocol_version(frame, v)) {
        d->status.bad_frame++;
        return;
    }
    io->note(io->ctx, NOTE_DEBUG, "protocol %u.%u.%u", v[0], v[1], v[2]);
    if (d->phase == PHASE_VERSION)
        start_scan(d, now_ns, io);
}

static void on_frame(struct ping360 *d, const struct ping_frame *frame, uint64_t now_ns,
                     const struct device_io *io)
{
    char shown[81];

    switch (frame->id) {
    case PING360_DEVICE_DATA:
    case PING360_AUTO_DEVICE_DATA:
        on_data(d, frame, now_ns, io);
        break;
    case PING_DEVICE_INFORMATION:
        on_identity(d, frame, now_ns, io);
        break;
    case PING_PROTOCOL_VERSION:
        on_version(d, frame, now_ns, io);
        break;
    case PING_ACK:
        on_ack(d, frame);
        break;
    case PING_NACK:
        on_nack(d, frame, now_ns, io);
        break;
    case PING_ASCII_TEXT:
        io->note(io->ctx, NOTE_INFO, "says: %s",
                 ping_text(shown, sizeof(shown), (const char *)frame->payload, frame->length));
        break;
    default: /* counted as a frame; later firmware may know more messages than we */
        break;
    }
}

/* ---- the device ---- */

static void ping360_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = state;
    struct ping_frame frame;
    while (ping_parser_next(&d->parser, &bytes, &n, now_ns, &frame))
        on_frame(d, &frame, now_ns, io);
}

static void ping360_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = state;
    ping_parser_reset(&d->parser);
    ping360_track_reset(&d->track);
    d->new_turn = false;
    d->silent = false;
    d->answered = false;
    d->retry_ns = RETRY_FIRST_NS;
    if (d->conf.listen_only)
        enter(d, PHASE_LISTEN, NEVER);
    else
        wake(d, now_ns, io);
}

static void ping360_closed(void *state, uint64_t now_ns)
{
    struct ping360 *d = state;
    (void)now_ns;
    ping_parser_reset(&d->parser);
    enter(d, PHASE_CLOSED, NEVER);
}

static void ping360_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = state;

    if (now_ns < d->due_ns || d->due_ns == NEVER)
        return;
    /* The answer may be there, behind a false or broken beginning that waits for more bytes. */
    ping_parser_give_up(&d->parser, now_ns > QUIET_NS ? now_ns - QUIET_NS : 0);
    ping360_feed(d, NULL, 0, now_ns, io);
    if (now_ns < d->due_ns)
        return;

    if (d->phase == PHASE_WAIT)
        wake(d, now_ns, io);
    else if (d->phase == PHASE_WAKE)
        send_autobaud(d, now_ns, io);
    else if (d->phase == PHASE_AUTOBAUD)
        ask(d, PHASE_IDENTIFY, now_ns, io);
    else
        missed(d, now_ns, io);
}

static uint64_t ping360_deadline(const void *state)
{
    const struct ping360 *d = state;
    return d->due_ns;
}

static void ping360_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = state;
    if (d->phase != PHASE_CLOSED && d->phase != PHASE_LISTEN && d->phase != PHASE_IDLE &&
        d->phase != PHASE_STOPPING)
        send_motor_off(d, now_ns, io);
}

static enum device_state state_of(const struct ping360 *d)
{
    switch (d->phase) {
    case PHASE_CLOSED:
    case PHASE_STOPPING:
    case PHASE_IDLE:
        return DEVICE_CLOSED;
    case PHASE_AUTO:
    case PHASE_REQUEST:
        return d->silent ? DEVICE_SILENT : d->answered ? DEVICE_RUNNING : DEVICE_SETUP;
    case PHASE_LISTEN:
        return d->answered ? DEVICE_RUNNING : DEVICE_IDENTIFY;
    default:
        return d->silent ? DEVICE_SILENT : DEVICE_IDENTIFY;
    }
}

static void ping360_status(const void *state, struct device_status *out)
{
    const struct ping360 *d = state;
    *out = d->status;
    out->state = state_of(d);
    out->frames = d->parser.frames;
    out->garbage_bytes = d->parser.garbage_bytes;
    out->bad_checksum = d->parser.bad_checksum;
}

const struct device_ops device_ping360 = {
    .name = "ping360",
    .state_size = sizeof(struct ping360),
    .max_beams = 1,
    .max_bins = PING360_SAMPLES_MAX,
    .init = ping360_init,
    .opened = ping360_opened,
    .closed = ping360_closed,
    .feed = ping360_feed,
    .tick = ping360_tick,
    .deadline = ping360_deadline,
    .stop = ping360_stop,
    .status = ping360_status,
};
