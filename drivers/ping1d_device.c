/* SPDX-License-Identifier: MIT */
/*
 * ping1d_device - the Blue Robotics Ping1D and Ping2 echosounders as a state machine: asks who is there, sets it up one
 * acknowledged setting after the other, keeps its profiles coming or asks for distances, and turns readings into pings.
 * See device.h for the rules and ping1d.h for the configuration. Knows no descriptor, no clock and no grid.
 *
 *   opened -> IDENTIFY -> SETUP -> STREAM or REQUEST      (stop: STOPPING -> IDLE)
 *               ^  |         ^          | silence
 *               |  v         +----------+ (then IDENTIFY anew)
 *               WAIT
 */
#include "ping1d.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "device.h"

#define NEVER  UINT64_MAX
#define MS     1000000ull
#define SECOND 1000000000ull

#define ANSWER_NS      (500 * MS) /* a bridge in between may need as long */
#define ANSWER_TRIES   3
#define SETTING_TRIES  2 /* one that is not acknowledged is done without */
#define RETRY_FIRST_NS (250 * MS)
#define RETRY_MAX_NS   (2 * SECOND)
#define SILENCE_NS     (1500 * MS)
#define SILENCES_MAX   3
#define QUIET_NS       (40 * MS) /* a frame that paused longer was cut off */
#define STOP_NS        (250 * MS)
#define STOP_TRIES     3
#define PING_MARGIN_NS (25 * MS) /* of the device's own work and the line, beside listening */
#define PING_LEAST_NS  (50 * MS)

#define TYPE_PING360    2
#define REVISION_PING2  2
#define BEAM_DEG        30.0
#define BEAM_PING2_DEG  25.0
#define LISTENING_MIN_M 1.5

enum phase {
    PHASE_CLOSED,
    PHASE_LISTEN,   /* listen_only: nothing but this while open */
    PHASE_IDENTIFY, /* device_information was asked for */
    PHASE_SETUP,    /* settings[step] was sent */
    PHASE_STREAM,   /* profiles come by themselves */
    PHASE_REQUEST,  /* a distance was asked for, or will be at due_ns */
    PHASE_WAIT,     /* until the next attempt to find it */
    PHASE_STOPPING,
    PHASE_IDLE,
};

/* In this order. Profiles are started last, in STREAM. */
static const uint16_t settings[] = {PING1D_CONTINUOUS_STOP,   PING1D_SET_SPEED_OF_SOUND, PING1D_SPEED_OF_SOUND,
                                    PING1D_SET_MODE_AUTO,     PING1D_SET_RANGE,          PING1D_SET_GAIN,
                                    PING1D_SET_PING_INTERVAL, PING1D_SET_PING_ENABLE};
#define N_SETTINGS (sizeof(settings) / sizeof(settings[0]))

struct ping1d {
    struct device_conf conf;
    uint64_t interval_ns;
    double device_speed_mps; /* that its distances are on */
    double beam_rad;

    enum phase phase;
    uint64_t due_ns;
    unsigned tries;
    unsigned step;     /* of settings[] */
    uint64_t retry_ns; /* next wait of PHASE_WAIT */
    bool asked;        /* PHASE_REQUEST: an answer is due, not the next question */
    bool silent;       /* has let us down, and no reading came since */
    bool answered;     /* a reading came since it was opened */
    struct ping_count count;

    struct ping_parser parser;
    struct device_status status; /* state, frames, garbage_bytes, bad_checksum: filled in when asked */
};

/* ---- configuration ---- */

static bool ping1d_init(void *state, const struct device_conf *conf, char *err, size_t err_size)
{
    struct ping1d *d = state;

    if (!(conf->range_m >= LISTENING_MIN_M && conf->range_m <= 200.0))
        snprintf(err, err_size, "range = %g m: a Ping1D does %g .. 200 m", conf->range_m, LISTENING_MIN_M);
    else if (!(conf->sound_speed_mps >= 1350.0 && conf->sound_speed_mps <= 1650.0))
        snprintf(err, err_size, "sound_speed = %g m/s: must be 1350 .. 1650 m/s", conf->sound_speed_mps);
    else if (conf->gain < -1 || conf->gain > 6)
        snprintf(err, err_size, "gain = %d: a Ping1D has 0 .. 6, or auto", conf->gain);
    else if (!(conf->min_confidence > 0.0 && conf->min_confidence <= 1.0))
        snprintf(err, err_size, "min_confidence = %g: must be above 0, at most 1", conf->min_confidence);
    else if (conf->frequency_hz != 0.0)
        snprintf(err, err_size, "frequency = %g kHz: a Ping1D has one of its own, want auto",
                 conf->frequency_hz * 1e-3);
    else {
        uint64_t ping_ns = (uint64_t)(2e9 * conf->range_m / conf->sound_speed_mps) + PING_MARGIN_NS;
        memset(d, 0, sizeof(*d));
        d->conf = *conf;
        d->interval_ns = ping_ns > PING_LEAST_NS ? ping_ns : PING_LEAST_NS;
        d->device_speed_mps = PING1D_SOUND_SPEED_MPS;
        d->beam_rad = geo_rad(BEAM_DEG);
        ping_parser_init(&d->parser, PING_PAYLOAD_MAX);
        d->phase = PHASE_CLOSED;
        d->due_ns = NEVER;
        return true;
    }
    return false;
}

/* ---- what is sent ---- */

static void enter(struct ping1d *d, enum phase phase, uint64_t due_ns)
{
    d->phase = phase;
    d->due_ns = due_ns;
}

static void request(uint16_t id, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD + 2];
    io->send(io->ctx, out, ping_encode_request(out, sizeof(out), id));
}

static void set(uint16_t id, uint32_t a, uint32_t b, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD + 8];
    io->send(io->ctx, out, ping1d_encode_set(out, sizeof(out), id, a, b));
}

static void identify(struct ping1d *d, uint64_t now_ns, const struct device_io *io)
{
    d->tries = d->phase == PHASE_IDENTIFY ? d->tries + 1 : 1;
    request(PING_DEVICE_INFORMATION, io);
    enter(d, PHASE_IDENTIFY, now_ns + ANSWER_NS);
}

static void send_setting(struct ping1d *d, uint64_t now_ns, const struct device_io *io)
{
    uint32_t range_mm = (uint32_t)lround(d->conf.range_m * 1e3);

    switch (settings[d->step]) {
    case PING1D_CONTINUOUS_STOP:
        set(PING1D_CONTINUOUS_STOP, PING1D_PROFILE, 0, io);
        break;
    case PING1D_SET_SPEED_OF_SOUND:
        set(PING1D_SET_SPEED_OF_SOUND, (uint32_t)lround(d->conf.sound_speed_mps * 1e3), 0, io);
        break;
    case PING1D_SPEED_OF_SOUND: /* what it now works with is believed, not what it was told */
        request(PING1D_SPEED_OF_SOUND, io);
        break;
    case PING1D_SET_MODE_AUTO:
        set(PING1D_SET_MODE_AUTO, d->conf.gain < 0, 0, io);
        break;
    case PING1D_SET_RANGE:
        set(PING1D_SET_RANGE, PING1D_START_MM, range_mm - PING1D_START_MM, io);
        break;
    case PING1D_SET_GAIN:
        set(PING1D_SET_GAIN, (uint32_t)d->conf.gain, 0, io);
        break;
    case PING1D_SET_PING_INTERVAL:
        set(PING1D_SET_PING_INTERVAL, (uint32_t)(d->interval_ns / MS), 0, io);
        break;
    default:
        set(PING1D_SET_PING_ENABLE, 1, 0, io);
        break;
    }
    enter(d, PHASE_SETUP, now_ns + ANSWER_NS);
}

static void ask_distance(struct ping1d *d, uint64_t now_ns, const struct device_io *io)
{
    d->asked = true;
    request(PING1D_DISTANCE, io);
    enter(d, PHASE_REQUEST, now_ns + ANSWER_NS);
}

static void start_readings(struct ping1d *d, uint64_t now_ns, const struct device_io *io)
{
    if (d->conf.request_response) {
        ask_distance(d, now_ns, io);
        return;
    }
    set(PING1D_CONTINUOUS_START, PING1D_PROFILE, 0, io);
    enter(d, PHASE_STREAM, now_ns + SILENCE_NS);
}

/* The next setting that applies, or the readings when there is none. */
static void set_up_from(struct ping1d *d, unsigned step, uint64_t now_ns, const struct device_io *io)
{
    d->tries = 0;
    for (d->step = step; d->step < N_SETTINGS; d->step++) {
        bool own = settings[d->step] == PING1D_SET_RANGE || settings[d->step] == PING1D_SET_GAIN;
        if (own && d->conf.gain < 0)
            continue; /* the device chooses */
        send_setting(d, now_ns, io);
        return;
    }
    start_readings(d, now_ns, io);
}

static void send_stop(struct ping1d *d, uint64_t now_ns, const struct device_io *io)
{
    d->tries = d->phase == PHASE_STOPPING ? d->tries + 1 : 1;
    set(PING1D_CONTINUOUS_STOP, PING1D_PROFILE, 0, io);
    enter(d, PHASE_STOPPING, now_ns + STOP_NS);
}

/* ---- what does not come ---- */

/* Said once, when the silence begins, not at every try. */
static void fall_silent(struct ping1d *d, const char *why, const struct device_io *io)
{
    if (!d->silent)
        io->note(io->ctx, NOTE_WARNING, "%s; trying on", why);
    d->silent = true;
}

static void wait_retry(struct ping1d *d, uint64_t now_ns)
{
    enter(d, PHASE_WAIT, now_ns + d->retry_ns);
    d->retry_ns = 2 * d->retry_ns < RETRY_MAX_NS ? 2 * d->retry_ns : RETRY_MAX_NS;
}

static void reading_missed(struct ping1d *d, uint64_t now_ns, const struct device_io *io)
{
    if (++d->tries < SILENCES_MAX) {
        start_readings(d, now_ns, io);
        return;
    }
    d->status.restarts++;
    fall_silent(d, "the echosounder sends no more readings", io);
    identify(d, now_ns, io);
}

/* The deadline of an answer has passed. */
static void missed(struct ping1d *d, uint64_t now_ns, const struct device_io *io)
{
    d->status.timeouts++;
    if (d->phase == PHASE_IDENTIFY && d->tries < ANSWER_TRIES) {
        identify(d, now_ns, io);
    } else if (d->phase == PHASE_IDENTIFY) {
        fall_silent(d, "no answer from an echosounder (power, wiring, baud rate?)", io);
        wait_retry(d, now_ns);
    } else if (d->phase == PHASE_SETUP && ++d->tries < SETTING_TRIES) {
        send_setting(d, now_ns, io);
    } else if (d->phase == PHASE_SETUP) {
        io->note(io->ctx, NOTE_INFO, "setting %u is not acknowledged", settings[d->step]);
        set_up_from(d, d->step + 1, now_ns, io);
    } else if (d->phase == PHASE_STREAM || d->phase == PHASE_REQUEST) {
        reading_missed(d, now_ns, io);
    } else if (d->phase == PHASE_STOPPING && d->tries < STOP_TRIES) {
        send_stop(d, now_ns, io);
    } else {
        enter(d, PHASE_IDLE, NEVER);
    }
}

/* ---- what comes ---- */

static void make_ping(struct ping1d *d, const struct ping1d_reading *r, const struct ping_frame *frame,
                      const struct device_io *io)
{
    const struct ping1d_view view = {.scale = d->conf.sound_speed_mps / d->device_speed_mps,
                                     .range_m = d->conf.range_m,
                                     .sound_speed_mps = d->conf.sound_speed_mps,
                                     .min_confidence = d->conf.min_confidence,
                                     .beam_rad = d->beam_rad,
                                     .baud = d->conf.baud};

    d->status.pings++;
    d->status.last_ping_ns = frame->t_last_ns;
    d->status.range_m = r->simple ? d->conf.range_m : (r->start_mm + r->length_mm) * 1e-3 * view.scale;
    struct ping *ping = io->ping_begin(io->ctx);
    if (!ping)
        return;
    ping1d_fill_ping(ping, frame, r, &view);
    io->ping_done(io->ctx, ping);
}

static void on_reading(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns,
                       const struct device_io *io)
{
    struct ping1d_reading r;

    if (!ping1d_decode(frame, &r)) {
        d->status.bad_frame++;
        return;
    }
    /* A distance that is told twice would make old evidence young. */
    uint64_t *lost = d->phase == PHASE_REQUEST ? NULL : &d->status.lost_frames;
    if (r.simple || ping_count_is_new(&d->count, r.ping_number, lost))
        make_ping(d, &r, frame, io);
    if (!d->answered || d->silent)
        io->note(io->ctx, NOTE_INFO, "%s, %s, range %.4g m", d->status.what[0] ? d->status.what : "Ping1D",
                 d->phase == PHASE_REQUEST ? "asked for every reading" : "sending by itself", d->status.range_m);
    d->silent = false;
    d->answered = true;
    d->retry_ns = RETRY_FIRST_NS;
    if (d->phase == PHASE_STREAM) {
        d->tries = 0;
        d->due_ns = now_ns + SILENCE_NS;
    } else if (d->phase == PHASE_REQUEST && d->asked) {
        d->tries = 0;
        d->asked = false;
        d->due_ns = now_ns + d->interval_ns;
    }
}

static void on_identity(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns,
                        const struct device_io *io)
{
    struct ping_device_information info;
    bool waiting = d->phase == PHASE_IDENTIFY || d->phase == PHASE_WAIT;

    if (!ping_decode_device_information(frame, &info)) {
        d->status.bad_frame++;
    } else if (info.type != TYPE_PING360) {
        bool ping2 = info.revision == REVISION_PING2;
        snprintf(d->status.what, sizeof(d->status.what), "%s fw %u.%u.%u id %u", ping2 ? "Ping2" : "Ping1D",
                 info.firmware[0], info.firmware[1], info.firmware[2], frame->src);
        d->beam_rad = geo_rad(ping2 ? BEAM_PING2_DEG : BEAM_DEG);
        if (waiting)
            set_up_from(d, 0, now_ns, io);
    } else if (waiting) {
        fall_silent(d, "the device there is a Ping360, not an echosounder: device = ping360?", io);
        wait_retry(d, now_ns);
    }
}

static void on_answer(struct ping1d *d, uint16_t id, uint64_t now_ns, const struct device_io *io)
{
    if (d->phase == PHASE_SETUP && id == settings[d->step])
        set_up_from(d, d->step + 1, now_ns, io);
    else if (d->phase == PHASE_STOPPING && id == PING1D_CONTINUOUS_STOP)
        enter(d, PHASE_IDLE, NEVER);
}

static void on_ack(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    uint16_t id;
    if (ping_decode_ack(frame, &id))
        on_answer(d, id, now_ns, io);
    else
        d->status.bad_frame++;
}

/* Some firmware refuses what nobody asked for: a refusal is counted and told, and ends nothing. */
static void on_nack(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
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
    on_answer(d, id, now_ns, io);
}

static void on_speed(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    if (!ping1d_decode_speed(frame, &d->device_speed_mps))
        d->status.bad_frame++;
    else
        on_answer(d, PING1D_SPEED_OF_SOUND, now_ns, io);
}

static void on_frame(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    char shown[81];

    if (ping1d_is_reading(frame->id))
        on_reading(d, frame, now_ns, io);
    else if (frame->id == PING_DEVICE_INFORMATION)
        on_identity(d, frame, now_ns, io);
    else if (frame->id == PING_ACK)
        on_ack(d, frame, now_ns, io);
    else if (frame->id == PING_NACK)
        on_nack(d, frame, now_ns, io);
    else if (frame->id == PING1D_SPEED_OF_SOUND)
        on_speed(d, frame, now_ns, io);
    else if (frame->id == PING_ASCII_TEXT)
        io->note(io->ctx, NOTE_INFO, "says: %s",
                 ping_text(shown, sizeof(shown), (const char *)frame->payload, frame->length));
}

/* ---- the device ---- */

static void ping1d_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = state;
    struct ping_frame frame;
    while (ping_parser_next(&d->parser, &bytes, &n, now_ns, &frame))
        on_frame(d, &frame, now_ns, io);
}

static void ping1d_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = state;
    ping_parser_reset(&d->parser);
    d->silent = d->answered = false;
    d->count = (struct ping_count){0};
    d->device_speed_mps = PING1D_SOUND_SPEED_MPS;
    d->retry_ns = RETRY_FIRST_NS;
    if (d->conf.listen_only)
        enter(d, PHASE_LISTEN, NEVER);
    else
        identify(d, now_ns, io);
}

static void ping1d_closed(void *state, uint64_t now_ns)
{
    struct ping1d *d = state;
    (void)now_ns;
    ping_parser_reset(&d->parser);
    enter(d, PHASE_CLOSED, NEVER);
}

static void ping1d_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = state;

    if (now_ns < d->due_ns || d->due_ns == NEVER)
        return;
    /* The answer may be there, behind a false or broken beginning that waits for more bytes. */
    ping_parser_give_up(&d->parser, now_ns > QUIET_NS ? now_ns - QUIET_NS : 0);
    ping1d_feed(d, NULL, 0, now_ns, io);
    if (now_ns < d->due_ns)
        return;
    if (d->phase == PHASE_WAIT)
        identify(d, now_ns, io);
    else if (d->phase == PHASE_REQUEST && !d->asked)
        ask_distance(d, now_ns, io);
    else
        missed(d, now_ns, io);
}

static uint64_t ping1d_deadline(const void *state)
{
    const struct ping1d *d = state;
    return d->due_ns;
}

static void ping1d_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = state;
    if (d->phase != PHASE_CLOSED && d->phase != PHASE_LISTEN && d->phase != PHASE_IDLE &&
        d->phase != PHASE_STOPPING)
        send_stop(d, now_ns, io);
}

static enum device_state state_of(const struct ping1d *d)
{
    if (d->phase == PHASE_CLOSED || d->phase == PHASE_STOPPING || d->phase == PHASE_IDLE)
        return DEVICE_CLOSED;
    if (d->silent)
        return DEVICE_SILENT;
    if (d->phase == PHASE_IDENTIFY || d->phase == PHASE_WAIT || (d->phase == PHASE_LISTEN && !d->answered))
        return DEVICE_IDENTIFY;
    return d->answered ? DEVICE_RUNNING : DEVICE_SETUP;
}

static void ping1d_status(const void *state, struct device_status *out)
{
    const struct ping1d *d = state;
    *out = d->status;
    out->state = state_of(d);
    out->frames = d->parser.frames;
    out->garbage_bytes = d->parser.garbage_bytes;
    out->bad_checksum = d->parser.bad_checksum;
}

const struct device_ops device_ping1d = {
    .name = "ping1d",
    .state_size = sizeof(struct ping1d),
    .max_beams = 1,
    .max_bins = 1,
    .init = ping1d_init,
    .opened = ping1d_opened,
    .closed = ping1d_closed,
    .feed = ping1d_feed,
    .tick = ping1d_tick,
    .deadline = ping1d_deadline,
    .stop = ping1d_stop,
    .status = ping1d_status,
};
