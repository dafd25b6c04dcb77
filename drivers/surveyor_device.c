/* SPDX-License-Identifier: MIT */
/*
 * surveyor_device - the Cerulean Surveyor 240 multibeam sonar as a state machine: asks who is there, sends the settings
 * that make it ping, repeats them while nothing comes, and turns its points into pings of many beams. See device.h for
 * the rules and surveyor.h for the configuration. Knows no descriptor, no clock and no grid.
 *
 *   opened -> IDENTIFY -> SETUP -> RUN      (stop: STOPPING -> IDLE)
 *               ^           |        | silence
 *               +-- WAIT <--+        +--> SETUP's message again, then IDENTIFY
 */
#include "surveyor.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "device.h"

#define NEVER  UINT64_MAX
#define MS     1000000ull
#define SECOND 1000000000ull

#define ANSWER_NS      (500 * MS)
#define ANSWER_TRIES   3
#define RETRY_FIRST_NS (250 * MS)
#define RETRY_MAX_NS   (2 * SECOND)
#define SILENCE_NS     (1500 * MS)
#define REPEAT_NS      SECOND
#define SILENCES_MAX   3
#define QUIET_NS       (40 * MS) /* a frame that paused longer was cut off */
#define STOP_NS        (250 * MS)
#define STOP_TRIES     3
#define PING_MARGIN_NS (25 * MS)
#define PING_LEAST_NS  (50 * MS)
#define STEPS          400

#define TYPE_ECHOSOUNDER 1
#define TYPE_PING360     2

enum phase {
    PHASE_CLOSED,
    PHASE_LISTEN,   /* listen_only: nothing but this while open */
    PHASE_IDENTIFY, /* device_information was asked for */
    PHASE_SETUP,    /* the settings were sent */
    PHASE_RUN,
    PHASE_WAIT, /* until the next attempt to find it */
    PHASE_STOPPING,
    PHASE_IDLE,
};

struct surveyor {
    struct device_conf conf;
    struct surveyor_settings set;

    enum phase phase;
    uint64_t due_ns;
    unsigned tries;    /* in this phase, since the last answer */
    uint64_t retry_ns; /* next wait of PHASE_WAIT */
    bool silent;       /* has let us down, and no points came since */
    bool answered;     /* points came since it was opened */
    bool has_atof;     /* ... these among them: yz would say the same again */
    struct ping_count count;

    struct ping_parser parser;
    struct device_status status; /* state, frames, garbage_bytes, bad_checksum: filled in when asked */
};

/* ---- configuration ---- */

static bool surveyor_init(void *state, const struct device_conf *conf, char *err, size_t err_size)
{
    struct surveyor *d = state;

    if (!(conf->range_m >= 1.0 && conf->range_m <= 200.0)) {
        snprintf(err, err_size, "range = %g m: a Surveyor does 1 .. 200 m", conf->range_m);
        return false;
    }
    if (!(conf->sound_speed_mps >= 1350.0 && conf->sound_speed_mps <= 1650.0)) {
        snprintf(err, err_size, "sound_speed = %g m/s: must be 1350 .. 1650 m/s", conf->sound_speed_mps);
        return false;
    }
    if (conf->gain < -1 || conf->gain > 10) {
        snprintf(err, err_size, "gain = %d: a Surveyor has 0 .. 10, or auto", conf->gain);
        return false;
    }
    if (conf->frequency_hz != 0.0) {
        snprintf(err, err_size, "frequency = %g kHz: a Surveyor has 240 kHz only, want auto",
                 conf->frequency_hz * 1e-3);
        return false;
    }
    uint64_t ping_ns = (uint64_t)(2e9 * conf->range_m / conf->sound_speed_mps) + PING_MARGIN_NS;
    memset(d, 0, sizeof(*d));
    d->conf = *conf;
    d->set = (struct surveyor_settings){.end_mm = (int32_t)lround(conf->range_m * 1e3),
                                        .sound_speed_mps = (float)conf->sound_speed_mps,
                                        .gain = (int16_t)conf->gain,
                                        .interval_ms =
                                            (int16_t)((ping_ns > PING_LEAST_NS ? ping_ns : PING_LEAST_NS) / MS),
                                        .atof = true,
                                        .n_steps = STEPS};
    ping_parser_init(&d->parser, PING_PAYLOAD_LIMIT);
    d->phase = PHASE_CLOSED;
    d->due_ns = NEVER;
    return true;
}

/* ---- what is sent ---- */

static void enter(struct surveyor *d, enum phase phase, uint64_t due_ns)
{
    d->tries = phase == d->phase ? d->tries + 1 : 1;
    d->phase = phase;
    d->due_ns = due_ns;
}

static void identify(struct surveyor *d, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD + 2];
    io->send(io->ctx, out, ping_encode_request(out, sizeof(out), PING_DEVICE_INFORMATION));
    enter(d, PHASE_IDENTIFY, now_ns + ANSWER_NS);
}

static void send_settings(const struct surveyor *d, bool ping, const struct device_io *io)
{
    uint8_t out[64];
    struct surveyor_settings set = d->set;
    set.ping = ping;
    io->send(io->ctx, out, surveyor_encode_settings(out, sizeof(out), &set));
}

static void set_up(struct surveyor *d, uint64_t now_ns, const struct device_io *io)
{
    send_settings(d, true, io);
    enter(d, PHASE_SETUP, now_ns + ANSWER_NS);
}

static void send_stop(struct surveyor *d, uint64_t now_ns, const struct device_io *io)
{
    send_settings(d, false, io);
    enter(d, PHASE_STOPPING, now_ns + STOP_NS);
}

/* ---- what does not come ---- */

/* Said once, when the silence begins, not at every try. */
static void fall_silent(struct surveyor *d, const char *why, const struct device_io *io)
{
    if (!d->silent)
        io->note(io->ctx, NOTE_WARNING, "%s; trying on", why);
    d->silent = true;
}

static void wait_retry(struct surveyor *d, uint64_t now_ns)
{
    enter(d, PHASE_WAIT, now_ns + d->retry_ns);
    d->retry_ns = 2 * d->retry_ns < RETRY_MAX_NS ? 2 * d->retry_ns : RETRY_MAX_NS;
}

static void points_missed(struct surveyor *d, uint64_t now_ns, const struct device_io *io)
{
    if (d->tries <= SILENCES_MAX) {
        send_settings(d, true, io);
        enter(d, PHASE_RUN, now_ns + REPEAT_NS);
        return;
    }
    d->status.restarts++;
    fall_silent(d, "the Surveyor sends no more points", io);
    identify(d, now_ns, io);
}

/* The deadline of an answer has passed. */
static void missed(struct surveyor *d, uint64_t now_ns, const struct device_io *io)
{
    d->status.timeouts++;
    if (d->phase == PHASE_IDENTIFY && d->tries < ANSWER_TRIES) {
        identify(d, now_ns, io);
    } else if (d->phase == PHASE_IDENTIFY || (d->phase == PHASE_SETUP && d->tries < ANSWER_TRIES)) {
        set_up(d, now_ns, io); /* one that does not tell its name may work all the same */
    } else if (d->phase == PHASE_SETUP) {
        fall_silent(d, "no answer from a Surveyor (power, network address?)", io);
        wait_retry(d, now_ns);
    } else if (d->phase == PHASE_RUN) {
        points_missed(d, now_ns, io);
    } else if (d->phase == PHASE_STOPPING && d->tries < STOP_TRIES) {
        send_stop(d, now_ns, io);
    } else {
        enter(d, PHASE_IDLE, NEVER);
    }
}

/* ---- what comes ---- */

static void make_ping(struct surveyor *d, const struct surveyor_points *points, const struct ping_frame *frame,
                      const struct device_io *io)
{
    struct ping *ping = io->ping_begin(io->ctx);

    d->status.pings++;
    d->status.last_ping_ns = frame->t_last_ns;
    d->status.range_m = points->atof ? d->conf.sound_speed_mps * points->listening_s / 2.0 : d->conf.range_m;
    if (!ping)
        return;
    surveyor_fill_ping(ping, frame, points, d->conf.range_m, d->conf.sound_speed_mps);
    io->ping_done(io->ctx, ping);
}

static void on_points(struct surveyor *d, const struct ping_frame *frame, uint64_t now_ns,
                      const struct device_io *io)
{
    struct surveyor_points points;

    if (!surveyor_decode_points(frame, &points)) {
        d->status.bad_frame++;
        return;
    }
    d->has_atof |= points.atof;
    if (points.atof ? ping_count_is_new(&d->count, points.ping_number, &d->status.lost_frames) : !d->has_atof)
        make_ping(d, &points, frame, io);
    if (!d->answered || d->silent)
        io->note(io->ctx, NOTE_INFO, "%s, %u points, range %.4g m",
                 d->status.what[0] ? d->status.what : "Surveyor", points.n, d->status.range_m);
    d->silent = false;
    d->answered = true;
    d->retry_ns = RETRY_FIRST_NS;
    if (d->phase == PHASE_SETUP || d->phase == PHASE_RUN) {
        enter(d, PHASE_RUN, now_ns + SILENCE_NS);
        d->tries = 1;
    }
}

static void on_identity(struct surveyor *d, const struct ping_frame *frame, uint64_t now_ns,
                        const struct device_io *io)
{
    struct ping_device_information info;
    bool waiting = d->phase == PHASE_IDENTIFY || d->phase == PHASE_WAIT;

    if (!ping_decode_device_information(frame, &info)) {
        d->status.bad_frame++;
    } else if (info.type != TYPE_ECHOSOUNDER && info.type != TYPE_PING360) {
        snprintf(d->status.what, sizeof(d->status.what), "Surveyor fw %u.%u.%u id %u", info.firmware[0],
                 info.firmware[1], info.firmware[2], frame->src);
        if (waiting)
            set_up(d, now_ns, io);
    } else if (waiting) {
        fall_silent(d,
                    info.type == TYPE_PING360 ? "the device there is a Ping360: device = ping360?"
                                              : "the device there is an echosounder: device = ping1d?",
                    io);
        wait_retry(d, now_ns);
    }
}

static void on_ack(struct surveyor *d, const struct ping_frame *frame, uint64_t now_ns)
{
    uint16_t id;
    if (!ping_decode_ack(frame, &id))
        d->status.bad_frame++;
    else if (id == SURVEYOR_SET_PING_PARAMETERS && d->phase == PHASE_SETUP)
        enter(d, PHASE_RUN, now_ns + SILENCE_NS);
    else if (id == SURVEYOR_SET_PING_PARAMETERS && d->phase == PHASE_STOPPING)
        enter(d, PHASE_IDLE, NEVER);
}

static void on_nack(struct surveyor *d, const struct ping_frame *frame, uint64_t now_ns,
                    const struct device_io *io)
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
    if (id == SURVEYOR_SET_PING_PARAMETERS && d->phase == PHASE_SETUP) {
        fall_silent(d, "the Surveyor refuses its settings", io);
        wait_retry(d, now_ns);
    } else if (id == SURVEYOR_SET_PING_PARAMETERS && d->phase == PHASE_STOPPING) {
        enter(d, PHASE_IDLE, NEVER);
    }
}

/* All else, its attitude and texts wrapped in JSON among them, counts as a frame and is not looked into. */
static void on_frame(struct surveyor *d, const struct ping_frame *frame, uint64_t now_ns,
                     const struct device_io *io)
{
    if (frame->id == SURVEYOR_ATOF_POINTS || frame->id == SURVEYOR_YZ_POINTS)
        on_points(d, frame, now_ns, io);
    else if (frame->id == PING_DEVICE_INFORMATION)
        on_identity(d, frame, now_ns, io);
    else if (frame->id == PING_ACK)
        on_ack(d, frame, now_ns);
    else if (frame->id == PING_NACK)
        on_nack(d, frame, now_ns, io);
}

/* ---- the device ---- */

static void surveyor_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct surveyor *d = state;
    struct ping_frame frame;
    while (ping_parser_next(&d->parser, &bytes, &n, now_ns, &frame))
        on_frame(d, &frame, now_ns, io);
}

static void surveyor_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct surveyor *d = state;
    ping_parser_reset(&d->parser);
    d->silent = d->answered = d->has_atof = false;
    d->count = (struct ping_count){0};
    d->retry_ns = RETRY_FIRST_NS;
    if (d->conf.listen_only)
        enter(d, PHASE_LISTEN, NEVER);
    else
        identify(d, now_ns, io);
}

static void surveyor_closed(void *state, uint64_t now_ns)
{
    struct surveyor *d = state;
    (void)now_ns;
    ping_parser_reset(&d->parser);
    enter(d, PHASE_CLOSED, NEVER);
}

static void surveyor_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct surveyor *d = state;

    if (now_ns < d->due_ns || d->due_ns == NEVER)
        return;
    /* The answer may be there, behind a false or broken beginning that waits for more bytes. */
    ping_parser_give_up(&d->parser, now_ns > QUIET_NS ? now_ns - QUIET_NS : 0);
    surveyor_feed(d, NULL, 0, now_ns, io);
    if (now_ns < d->due_ns)
        return;
    if (d->phase == PHASE_WAIT)
        identify(d, now_ns, io);
    else
        missed(d, now_ns, io);
}

static uint64_t surveyor_deadline(const void *state)
{
    const struct surveyor *d = state;
    return d->due_ns;
}

static void surveyor_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct surveyor *d = state;
    if (d->phase != PHASE_CLOSED && d->phase != PHASE_LISTEN && d->phase != PHASE_IDLE &&
        d->phase != PHASE_STOPPING)
        send_stop(d, now_ns, io);
}

static enum device_state state_of(const struct surveyor *d)
{
    if (d->phase == PHASE_CLOSED || d->phase == PHASE_STOPPING || d->phase == PHASE_IDLE)
        return DEVICE_CLOSED;
    if (d->silent)
        return DEVICE_SILENT;
    if (d->phase == PHASE_IDENTIFY || d->phase == PHASE_WAIT || (d->phase == PHASE_LISTEN && !d->answered))
        return DEVICE_IDENTIFY;
    return d->answered ? DEVICE_RUNNING : DEVICE_SETUP;
}

static void surveyor_status(const void *state, struct device_status *out)
{
    const struct surveyor *d = state;
    *out = d->status;
    out->state = state_of(d);
    out->frames = d->parser.frames;
    out->garbage_bytes = d->parser.garbage_bytes;
    out->bad_checksum = d->parser.bad_checksum;
}

const struct device_ops device_surveyor = {
    .name = "surveyor",
    .state_size = sizeof(struct surveyor),
    .max_beams = SURVEYOR_POINTS_MAX,
    .max_bins = 1,
    .init = surveyor_init,
    .opened = surveyor_opened,
    .closed = surveyor_closed,
    .feed = surveyor_feed,
    .tick = surveyor_tick,
    .deadline = surveyor_deadline,
    .stop = surveyor_stop,
    .status = surveyor_status,
};
