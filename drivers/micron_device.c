/* SPDX-License-Identifier: MIT */
/*
 * micron_device - a Tritech Micron, or another SeaNet imaging head, as a state machine: waits for a head that is
 * centred, asks what it is, tells it what to do and asks for one echo line after the other. See device.h for the
 * rules and micron.h for the configuration. Knows no descriptor, no clock and no grid.
 *
 *   opened -> ALIVE --3 s without a sign of life--> CENTRING (rebooted; again after 30, 60, 120 s)
 *               |                                       |        ^           ^
 *               +------------ centred ------> VERSION <-+        |           |
 *                                                |  \--no answer-+           |
 *                                              USER -----no answer-----------+
 *                                                |                           |
 *                                            PARAMETERS -> SCAN --silence----+    (stop: IDLE)
 *
 * The head pings only when asked; two-wire lines are half duplex, so nothing is sent while an answer is due.
 */
#include "micron.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "device.h"

#define NEVER  UINT64_MAX
#define MS     1000000ull
#define SECOND 1000000000ull

#define ALIVE_NS        (3 * SECOND) /* a waiting head shows itself once a second */
#define CENTRING_NS     (30 * SECOND)
#define CENTRING_MAX_NS (120 * SECOND)
#define ANSWER_NS       (4 * SECOND)
#define ANSWER_TRIES    3
#define PARAMETERS_NS   (10 * SECOND)
#define PING_MARGIN_NS  SECOND    /* on top of listening and line: motor, and whatever the head is busy with */
#define PING_TRIES      5         /* requests in vain before the head is told its settings again ... */
#define PING_TRIES_MOST 10        /* ... and before it is rebooted */
#define PACKET_NS       SECOND    /* between packets of one line */
#define QUIET_NS        (40 * MS) /* adapters hold bytes back up to 16 ms; a frame that paused longer was cut off */
#define BEARING_UNKNOWN UINT16_MAX
#define MS_OF_DAY       86400000u

#define SEND_DATA_BYTES (SEANET_OVERHEAD + 4u)
#define DATA_BYTES      (SEANET_OVERHEAD + SEANET_DATA_AT) /* of a mtHeadData, without the echo */

enum phase {
    PHASE_CLOSED,
    PHASE_LISTEN,     /* listen_only: nothing but this while open */
    PHASE_ALIVE,      /* is anybody there? */
    PHASE_CENTRING,   /* until the motor knows where it is */
    PHASE_VERSION,    /* mtVersionData was asked for */
    PHASE_USER,       /* mtBBUserData was asked for */
    PHASE_PARAMETERS, /* mtHeadCommand was sent */
    PHASE_SCAN,       /* one mtSendData per ping */
    PHASE_IDLE,
};

struct micron {
    struct device_conf conf;
    struct micron_settings set;

    enum phase phase;
    uint64_t due_ns;
    unsigned tries;     /* since the last answer */
    uint64_t reboot_ns; /* how long the next reboot may take */
    bool silent;        /* has let us down, and no ping came since */
    bool answered;      /* a ping came since the port was opened or the head was set up anew */
    bool motor_told;

    uint16_t bearing; /* of the last ping, or BEARING_UNKNOWN */
    int travel;       /* units since the sweep or turn began, > 0 clockwise */
    bool new_turn;    /* the next ping begins one */

    uint8_t software;
    uint16_t serial;

    struct micron_line line;
    struct seanet_parser parser;
    struct device_status status; /* state, frames, garbage_bytes: filled in when asked */
};

/* ---- configuration ---- */

/* Says in err what is wrong, or leaves it alone and returns true. Comparisons are written so that NaN fails. */
static bool check_conf(const struct device_conf *conf, double frequency_hz, char *err, size_t err_size)
{
    const double far_rad = 2.0 * GEO_TURN, step_max_deg = 255.5 * 360.0 / MICRON_TURN;

    if (!(conf->range_m >= 0.75 && conf->range_m <= 200.0))
        snprintf(err, err_size, "range = %g m: a SeaNet head does 0.75 .. 200 m", conf->range_m);
    else if (!(conf->sound_speed_mps >= 1350.0 && conf->sound_speed_mps <= 1650.0))
        snprintf(err, err_size, "sound_speed = %g m/s: must be 1350 .. 1650 m/s", conf->sound_speed_mps);
    else if (conf->gain < -1 || conf->gain > 10)
        snprintf(err, err_size, "gain = %d: a Micron has 0 .. 10, tenths of its full gain", conf->gain);
    else if (!(frequency_hz >= 200e3 && frequency_hz <= 1200e3))
        snprintf(err, err_size, "frequency = %g kHz: a SeaNet head does 200 .. 1200 kHz", frequency_hz / 1e3);
    else if (!(conf->step_rad >= 0.0 && geo_deg(conf->step_rad) < step_max_deg))
        snprintf(err, err_size, "step = %g deg: a Micron does 0.06 .. 14.3 deg", geo_deg(conf->step_rad));
    else if (!(fabs(conf->sector_start_rad) <= far_rad && fabs(conf->sector_end_rad) <= far_rad))
        snprintf(err, err_size, "sector = %g %g deg: must lie in -720 .. 720 deg", geo_deg(conf->sector_start_rad),
                 geo_deg(conf->sector_end_rad));
    else
        return true;
    return false;
}

static bool micron_init(void *state, const struct device_conf *conf, char *err, size_t err_size)
{
    struct micron *d = state;
    double frequency_hz = conf->frequency_hz != 0.0 ? conf->frequency_hz : 675e3;

    if (!check_conf(conf, frequency_hz, err, err_size))
        return false;
    memset(d, 0, sizeof(*d));
    d->conf = *conf;
    d->set.frequency_hz = (uint32_t)lround(frequency_hz);
    d->set.gain = (uint8_t)(21 * (conf->gain < 0 ? 4 : conf->gain));
    micron_set_range(&d->set, conf->range_m, conf->sound_speed_mps);
    micron_set_scan(&d->set, conf->sector_start_rad, conf->sector_end_rad, conf->step_rad);
    seanet_parser_init(&d->parser);
    d->bearing = BEARING_UNKNOWN;
    d->phase = PHASE_CLOSED;
    d->due_ns = NEVER;
    return true;
}

/* ---- what is sent ---- */

static void enter(struct micron *d, enum phase phase, uint64_t due_ns)
{
    d->phase = phase;
    d->due_ns = due_ns;
}

static void send_short(const struct device_io *io, uint8_t id)
{
    uint8_t out[SEANET_OVERHEAD];
    io->send(io->ctx, out, micron_encode_short(out, sizeof(out), id));
}

static void reboot(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    send_short(io, SEANET_REBOOT);
    d->answered = false;
    enter(d, PHASE_CENTRING, now_ns + d->reboot_ns);
    d->reboot_ns = 2 * d->reboot_ns < CENTRING_MAX_NS ? 2 * d->reboot_ns : CENTRING_MAX_NS;
}

static void ask(struct micron *d, enum phase phase, uint64_t now_ns, const struct device_io *io)
{
    d->tries = phase == d->phase ? d->tries + 1 : 1;
    send_short(io, phase == PHASE_VERSION ? SEANET_SEND_VERSION : SEANET_SEND_USER_DATA);
    enter(d, phase, now_ns + ANSWER_NS);
}

static void send_parameters(const struct micron *d, const struct device_io *io)
{
    uint8_t out[MICRON_COMMAND_BYTES];
    io->send(io->ctx, out, micron_encode_head_command(out, sizeof(out), &d->set));
}

static void request_ping(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[SEND_DATA_BYTES];
    io->send(io->ctx, out, micron_encode_send_data(out, sizeof(out), (uint32_t)(now_ns / MS % MS_OF_DAY)));
    enter(d, PHASE_SCAN,
          now_ns + micron_line_ns(d->conf.baud, SEND_DATA_BYTES + DATA_BYTES + d->set.n_bins) +
              micron_listening_ns(d->set.interval, d->set.n_bins) + PING_MARGIN_NS);
}

static void start_scan(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    d->tries = 0;
    request_ping(d, now_ns, io);
}

/* ---- what does not come ---- */

/* Said once, when the silence begins, not at every try. */
static void fall_silent(struct micron *d, const char *why, const struct device_io *io)
{
    if (!d->silent)
        io->note(io->ctx, NOTE_WARNING, "%s; trying on", why);
    d->silent = true;
}

static void ping_missed(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    d->status.lost_frames++;
    d->tries++;
    if (d->tries < PING_TRIES_MOST) {
        if (d->tries == PING_TRIES) {
            fall_silent(d, "the head sends no more pings", io);
            send_parameters(d, io);
        }
        request_ping(d, now_ns, io);
        return;
    }
    d->status.restarts++;
    reboot(d, now_ns, io);
}

static void answer_missed(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    if (d->tries < ANSWER_TRIES) {
        ask(d, d->phase, now_ns, io);
        return;
    }
    fall_silent(d, "the head shows itself and does not say what it is", io);
    reboot(d, now_ns, io);
}

/* The deadline of an answer has passed. */
static void missed(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    d->status.timeouts++;
    if (d->phase ==
        PHASE_ALIVE) { /* also a head that scans shows no life but its answers: reboot it in any case */
        reboot(d, now_ns, io);
    } else if (d->phase == PHASE_CENTRING) {
        fall_silent(d, "no head that is ready (power, wiring, baud rate?)", io);
        reboot(d, now_ns, io);
    } else if (d->phase == PHASE_PARAMETERS) { /* nothing acknowledges the settings; pings will tell */
        start_scan(d, now_ns, io);
    } else if (d->phase == PHASE_SCAN) {
        ping_missed(d, now_ns, io);
    } else {
        answer_missed(d, now_ns, io);
    }
}

/* ---- what comes ---- */

/* Follows the head; notes a new sweep, and what is missing of those that we did not ask for ourselves. */
static void follow(struct micron *d, const struct micron_data_head *h)
{
    if (d->bearing != BEARING_UNKNOWN) {
        int turned = micron_way(d->bearing, h->bearing);
        int onward = d->travel > 0 ? turned : -turned;
        /* In a sector the same bearing twice means that the head turned round in between. */
        bool reversed = d->travel != 0 && (onward < 0 || (onward == 0 && !(h->control & MICRON_CONTINUOUS)));
        unsigned steps = h->step ? (unsigned)(turned < 0 ? -turned : turned) / h->step : 0;
        if (d->phase == PHASE_LISTEN && !reversed && steps > 1)
            d->status.lost_frames += steps - 1;
        d->travel = reversed ? turned : d->travel + turned;
        if (reversed || d->travel >= MICRON_TURN || d->travel <= -MICRON_TURN)
            d->new_turn = true;
        d->travel %= MICRON_TURN;
    }
    d->bearing = h->bearing;
}

static void make_ping(struct micron *d, const struct device_io *io)
{
    const struct micron_data_head *h = &d->line.head;
    d->status.pings++;
    d->status.last_ping_ns = d->line.t_last_ns;
    d->status.range_m = micron_line_bins(&d->line) * micron_bin_m(h->interval, d->conf.sound_speed_mps);
    struct ping *ping = io->ping_begin(io->ctx);
    if (!ping)
        return;
    micron_fill_ping(ping, &d->line, d->conf.sound_speed_mps, d->conf.baud);
    ping->flags = d->new_turn ? PING_NEW_TURN : 0;
    d->new_turn = false;
    io->ping_done(io->ctx, ping);
}

/* The motor has lost its steps: no bearing is to be believed until the head was told its settings again. */
static void on_motor_error(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    d->status.bad_frame++;
    if (!d->motor_told)
        io->note(io->ctx, NOTE_WARNING, "motor error: its pings are left out until the motor turns again");
    d->motor_told = true;
    if (d->phase == PHASE_SCAN) {
        send_parameters(d, io);
        enter(d, PHASE_PARAMETERS, now_ns + PARAMETERS_NS);
    }
}

static void on_line(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    if (micron_line_bins(&d->line) == 0) {
        d->status.bad_frame++;
        return;
    }
    if (d->line.head.status & MICRON_STATUS_MOTOR_ERROR) {
        on_motor_error(d, now_ns, io);
        return;
    }
    follow(d, &d->line.head);
    make_ping(d, io);
    d->silent = false;
    d->motor_told = false;
    d->reboot_ns = CENTRING_NS;
    if (!d->answered)
        io->note(io->ctx, NOTE_INFO, "%s, %s, range %.4g m", d->status.what[0] ? d->status.what : "SeaNet head",
                 d->phase == PHASE_LISTEN ? "heard" : "asked for every ping", d->status.range_m);
    d->answered = true;
    if (d->phase == PHASE_SCAN)
        start_scan(d, now_ns, io);
}

static void on_data(struct micron *d, const struct seanet_frame *frame, uint64_t now_ns,
                    const struct device_io *io)
{
    if (d->line.open && frame->t_first_ns > d->line.t_last_ns + PACKET_NS)
        d->line.open = false;
    switch (micron_line_add(&d->line, frame)) {
    case MICRON_LINE_OPEN:
        break;
    case MICRON_LINE_WHOLE:
        on_line(d, now_ns, io);
        break;
    case MICRON_LINE_BROKEN:
        d->status.bad_frame++;
        break;
    }
}

static void on_alive(struct micron *d, const struct seanet_frame *frame, uint64_t now_ns,
                     const struct device_io *io)
{
    uint8_t info;

    if (!micron_decode_alive(frame, &info)) {
        d->status.bad_frame++;
        return;
    }
    bool ready = (info & MICRON_CENTRED) && !(info & MICRON_MOTORING);
    bool has_parameters = !(info & MICRON_NO_PARAMETERS);
    if (d->phase == PHASE_SCAN && !has_parameters) {
        d->status.restarts++;
        d->answered = false;
        fall_silent(d, "the head has started anew (power?)", io);
        enter(d, PHASE_CENTRING, now_ns + CENTRING_NS);
    }
    if (d->phase == PHASE_PARAMETERS && ready && has_parameters)
        start_scan(d, now_ns, io);
    else if ((d->phase == PHASE_ALIVE || d->phase == PHASE_CENTRING) && ready)
        ask(d, PHASE_VERSION, now_ns, io);
    else if (d->phase == PHASE_ALIVE)
        enter(d, PHASE_CENTRING, now_ns + CENTRING_NS);
}

static void on_version(struct micron *d, const struct seanet_frame *frame, uint64_t now_ns,
                       const struct device_io *io)
{
    if (!micron_decode_version(frame, &d->software, &d->serial)) {
        d->status.bad_frame++;
        return;
    }
    snprintf(d->status.what, sizeof(d->status.what), "SeaNet head sw %u serial %u", d->software, d->serial);
    if (d->phase == PHASE_VERSION)
        ask(d, PHASE_USER, now_ns, io);
}

static void on_user_data(struct micron *d, const struct seanet_frame *frame, uint64_t now_ns,
                         const struct device_io *io)
{
    if (!micron_decode_user_data(frame, &d->set.dst)) {
        d->status.bad_frame++;
        return;
    }
    snprintf(d->status.what, sizeof(d->status.what), "%s sw %u serial %u",
             d->set.dst ? "Micron DST" : "SeaNet head", d->software, d->serial);
    if (d->phase == PHASE_USER) {
        send_parameters(d, io);
        enter(d, PHASE_PARAMETERS, now_ns + PARAMETERS_NS);
    }
}

/* Other nodes of the bus, and our own words on a two-wire line, are frames and not for us. */
static void on_frame(struct micron *d, const struct seanet_frame *frame, uint64_t now_ns,
                     const struct device_io *io)
{
    if (frame->sender != MICRON_NODE)
        return;
    switch (frame->id) {
    case SEANET_HEAD_DATA:
        on_data(d, frame, now_ns, io);
        break;
    case SEANET_ALIVE:
        on_alive(d, frame, now_ns, io);
        break;
    case SEANET_VERSION_DATA:
        on_version(d, frame, now_ns, io);
        break;
    case SEANET_USER_DATA:
        on_user_data(d, frame, now_ns, io);
        break;
    default: /* counted as a frame; heads say more than we need */
        break;
    }
}

/* ---- the device ---- */

static void micron_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = state;
    struct seanet_frame frame;
    while (seanet_parser_next(&d->parser, &bytes, &n, now_ns, &frame))
        on_frame(d, &frame, now_ns, io);
}

static void micron_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = state;
    (void)io;
    seanet_parser_reset(&d->parser);
    d->line.open = false;
    d->bearing = BEARING_UNKNOWN;
    d->travel = 0;
    d->new_turn = false;
    d->silent = false;
    d->answered = false;
    d->motor_told = false;
    d->reboot_ns = CENTRING_NS;
    if (d->conf.listen_only)
        enter(d, PHASE_LISTEN, NEVER);
    else
        enter(d, PHASE_ALIVE, now_ns + ALIVE_NS);
}

static void micron_closed(void *state, uint64_t now_ns)
{
    struct micron *d = state;
    (void)now_ns;
    seanet_parser_reset(&d->parser);
    enter(d, PHASE_CLOSED, NEVER);
}

static void micron_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = state;

    if (now_ns < d->due_ns || d->due_ns == NEVER)
        return;
    /* The answer may be there, behind a false or broken beginning that waits for more bytes. */
    seanet_parser_give_up(&d->parser, now_ns > QUIET_NS ? now_ns - QUIET_NS : 0);
    micron_feed(d, NULL, 0, now_ns, io);
    if (now_ns >= d->due_ns)
        missed(d, now_ns, io);
}

static uint64_t micron_deadline(const void *state)
{
    const struct micron *d = state;
    return d->due_ns;
}

/* A head that is not asked is quiet. */
static void micron_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = state;
    (void)now_ns;
    (void)io;
    if (d->phase != PHASE_CLOSED && d->phase != PHASE_LISTEN)
        enter(d, PHASE_IDLE, NEVER);
}

static enum device_state state_of(const struct micron *d)
{
    switch (d->phase) {
    case PHASE_CLOSED:
    case PHASE_IDLE:
        return DEVICE_CLOSED;
    case PHASE_LISTEN:
        return d->answered ? DEVICE_RUNNING : DEVICE_IDENTIFY;
    case PHASE_PARAMETERS:
    case PHASE_SCAN:
        return d->silent ? DEVICE_SILENT : d->answered ? DEVICE_RUNNING : DEVICE_SETUP;
    default:
        return d->silent ? DEVICE_SILENT : DEVICE_IDENTIFY;
    }
}

static void micron_status(const void *state, struct device_status *out)
{
    const struct micron *d = state;
    *out = d->status;
    out->state = state_of(d);
    out->frames = d->parser.frames;
    out->garbage_bytes = d->parser.garbage_bytes;
    out->bad_frame += d->parser.broken;
}

const struct device_ops device_micron = {
    .name = "micron",
    .state_size = sizeof(struct micron),
    .max_beams = 1,
    .max_bins = MICRON_BINS_MAX,
    .init = micron_init,
    .opened = micron_opened,
    .closed = micron_closed,
    .feed = micron_feed,
    .tick = micron_tick,
    .deadline = micron_deadline,
    .stop = micron_stop,
    .status = micron_status,
};
