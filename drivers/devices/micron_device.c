/* SPDX-License-Identifier: MIT */
/*
 * micron_device - a Tritech Micron, or another SeaNet imaging head, as a state machine: waits for a head that is
 * centred, asks what it is, tells it what to do and asks for one echo line after the other. See poller.h for the
 * steps, device.h for the rules and micron.h for the configuration. Knows no descriptor, no clock and no grid.
 *
 *   opened -> ALIVE --3 s without a sign of life--> CENTRING (rebooted; again after 30, 60, 120 s)
 *               |                                       |        ^           ^
 *               +------------ centred ------> VERSION <-+        |           |
 *                                                |  \--no answer-+           |
 *                                              USER -----no answer-----------+
 *                                                |                           |
 *                                            PARAMETERS -> SCAN --silence----+    (stop: quiet)
 *
 * The head pings only when asked; two-wire lines are half duplex, so nothing is sent while an answer is due.
 */
#include "micron.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "poller.h"
#include "drivers/ports/line_time.h"
#include "micron_scan.h"
#include "takeover.h"

#define MS     1000000ull
#define SECOND 1000000000ull

#define ALIVE_NS        (3 * SECOND) /* a waiting head shows itself once a second */
#define CENTRING_NS     (30 * SECOND)
#define CENTRING_MAX_NS (120 * SECOND)
#define ANSWER_NS       (4 * SECOND)
#define PARAMETERS_NS   (10 * SECOND)
#define PING_MARGIN_NS  SECOND    /* on top of listening and line: motor, and whatever the head is busy with */
#define PING_TRIES      5         /* requests in vain before the head is sent its settings again */
#define PACKET_NS       SECOND    /* between packets of one line */
#define QUIET_NS        (40 * MS) /* adapters hold bytes back up to 16 ms; a frame that paused longer was cut off */
#define BEARING_UNKNOWN UINT16_MAX
#define MS_OF_DAY       86400000u

#define BINS_SLACK_SHARE 20

#define SEND_DATA_BYTES (SEANET_OVERHEAD + 4u)
#define DATA_BYTES      (SEANET_OVERHEAD + SEANET_DATA_AT) /* of a mtHeadData, without the echo */

enum step {
    ALIVE,      /* is anybody there? */
    CENTRING,   /* until the motor knows where it is */
    VERSION,    /* mtVersionData was asked for */
    USER,       /* mtBBUserData was asked for */
    PARAMETERS, /* mtHeadCommand was sent */
    SCAN,       /* one mtSendData per ping */
    N_STEPS,
};

static const struct poller_step steps[N_STEPS];

struct micron {
    struct poller poller; /* first: see poller.h */
    struct device_conf conf;
    struct micron_settings set;
    uint64_t reboot_ns; /* how long the next reboot may take */
    bool motor_told;
    bool retuned; /* it has not been sent its new settings yet */
    struct takeover takeover;

    uint16_t bearing;        /* of the last ping, or BEARING_UNKNOWN */
    int travel;              /* units since the sweep or turn began, > 0 clockwise */
    bool new_turn;           /* the next ping begins one */
    struct micron_scan scan; /* of a head that is steered ... */
    struct steer_seen seen;  /* ... which jumps, and a turn is when it has been everywhere */

    uint8_t software;
    uint16_t serial;

    struct micron_line line;
    struct seanet_parser parser;
};

static void go(struct micron *d, enum step step, uint64_t now_ns, const struct device_io *io)
{
    poller_start(&d->poller, &steps[step], now_ns, io);
}

static bool at(const struct micron *d, enum step step)
{
    return d->poller.step == &steps[step];
}

/* ---- configuration ---- */

static void tune(struct micron *d, const struct device_conf *conf)
{
    d->conf = *conf;
    d->set.gain = (uint8_t)(21 * (conf->gain < 0 ? 4 : conf->gain));
    micron_set_range(&d->set, conf->range_m, conf->sound_speed_mps);
}

static bool micron_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    struct micron *d = state;
    double frequency_hz = conf->frequency_hz != 0.0 ? conf->frequency_hz : 675e3;
    if (!device_conf_check(&device_micron, conf, fault))
        return false;
    memset(d, 0, sizeof *d);
    d->set.frequency_hz = (uint32_t)lround(frequency_hz);
    tune(d, conf);
    micron_set_scan(&d->set, conf->sector_start_rad, conf->sector_end_rad, conf->step_rad);
    micron_scan_init(&d->scan, d->set.step, (uint64_t)(conf->circle_s * 1e9));
    seanet_parser_init(&d->parser);
    d->bearing = BEARING_UNKNOWN;
    poller_init(&d->poller, conf->listen_only, &steps[ALIVE], NULL);
    return true;
}

/* ---- what is said ---- */

static void send_short(const struct device_io *io, uint8_t id)
{
    uint8_t out[SEANET_OVERHEAD];
    io->send(io->ctx, out, micron_encode_short(out, sizeof out, id));
}

static uint64_t await_life(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns, (void)io;
    return ALIVE_NS;
}

static uint64_t reboot(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = device;
    const uint64_t wait_ns = d->reboot_ns;
    (void)now_ns;
    send_short(io, SEANET_REBOOT);
    takeover_forget(&d->takeover, &d->poller.status);
    d->poller.answered = false;
    d->reboot_ns = 2 * wait_ns < CENTRING_MAX_NS ? 2 * wait_ns : CENTRING_MAX_NS;
    return wait_ns;
}

static uint64_t ask_version(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    send_short(io, SEANET_SEND_VERSION);
    return ANSWER_NS;
}

static uint64_t ask_user_data(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    send_short(io, SEANET_SEND_USER_DATA);
    return ANSWER_NS;
}

static uint64_t send_parameters(void *device, uint64_t now_ns, const struct device_io *io)
{
    const struct micron *d = device;
    uint8_t out[MICRON_COMMAND_BYTES];
    (void)now_ns;
    io->send(io->ctx, out, micron_encode_head_command(out, sizeof out, &d->set));
    return PARAMETERS_NS;
}

static uint64_t request_ping(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = device;
    uint8_t out[SEND_DATA_BYTES];
    if (d->poller.tries == PING_TRIES + 1) {
        poller_timed_out(&d->poller, "the head stopped sending pings", io);
        send_parameters(d, now_ns, io);
    }
    io->send(io->ctx, out, micron_encode_send_data(out, sizeof out, (uint32_t)(now_ns / MS % MS_OF_DAY)));
    return poller_line_ns(&d->conf, SEND_DATA_BYTES + DATA_BYTES + d->set.n_bins) +
           micron_listening_ns(d->set.interval, d->set.n_bins) + PING_MARGIN_NS;
}

/* ---- what follows when nothing comes ---- */

static void go_reboot(void *device, uint64_t now_ns, const struct device_io *io)
{
    go(device, CENTRING, now_ns, io);
}

/* Also a head that scans shows no life but its answers, so this is no alarm yet. */
static void no_life(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = device;
    if (d->poller.strange > 0)
        io->note(
            io->ctx, NOTE_INFO,
            "no SeaNet alive message for 3 s; discarded %llu bytes that are not valid frames (wrong device or "
            "%s?); rebooting the head",
            (unsigned long long)d->poller.strange, d->conf.baud ? "baud rate" : "port");
    else
        io->note(io->ctx, NOTE_INFO, "no SeaNet alive message for 3 s; no bytes received; rebooting the head");
    go_reboot(d, now_ns, io);
}

static void not_ready(void *device, uint64_t now_ns, const struct device_io *io)
{
    const struct micron *d = device;
    char why[96];
    snprintf(why, sizeof why, "no head is ready (%s)", poller_advice(&d->conf));
    poller_timed_out(device, why, io);
    go_reboot(device, now_ns, io);
}

static void not_named(void *device, uint64_t now_ns, const struct device_io *io)
{
    poller_timed_out(device, "the head does not identify itself", io);
    go_reboot(device, now_ns, io);
}

/* Nothing acknowledges the settings; pings will tell. */
static void start_scan(void *device, uint64_t now_ns, const struct device_io *io)
{
    go(device, SCAN, now_ns, io);
}

static void pings_missed(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = device;
    d->poller.status.restarts++;
    go_reboot(d, now_ns, io);
}

static const struct poller_step steps[N_STEPS] = {
    [ALIVE] = {DEVICE_IDENTIFY, .tries = 1, .ask = await_life, .missed = no_life},
    [CENTRING] = {DEVICE_IDENTIFY, .tries = 1, .ask = reboot, .missed = not_ready},
    [VERSION] = {DEVICE_IDENTIFY, .tries = 3, .ask = ask_version, .missed = not_named},
    [USER] = {DEVICE_IDENTIFY, .tries = 3, .ask = ask_user_data, .missed = not_named},
    [PARAMETERS] = {DEVICE_SETUP, .tries = 1, .ask = send_parameters, .missed = start_scan},
    [SCAN] = {DEVICE_SETUP, .tries = 10, .per_ping = true, .ask = request_ping, .missed = pings_missed},
};

/* ---- what comes ---- */

/* It is steered, and jumps: a turn is when it has been everywhere. */
static bool goes_around(const struct micron *d)
{
    return d->conf.steered && !(d->scan.only && d->scan.pass);
}

/* Follows the head; notes a new sweep, and what is missing of those that we did not ask for ourselves. */
static void follow_head(struct micron *d, const struct micron_data_head *h)
{
    if (d->bearing != BEARING_UNKNOWN) {
        int turned = micron_angle_to(d->bearing, h->bearing);
        int onward = d->travel > 0 ? turned : -turned;
        /* In a sector the same bearing twice means that the head turned round in between. */
        bool reversed = d->travel != 0 && (onward < 0 || (onward == 0 && !(h->control & MICRON_CONTINUOUS)));
        unsigned made = h->step ? (unsigned)(turned < 0 ? -turned : turned) / h->step : 0;
        if (poller_listening(&d->poller) && !reversed && made > 1)
            d->poller.status.lost_frames += made - 1;
        d->travel = reversed ? turned : d->travel + turned;
        if (!goes_around(d) && (reversed || d->travel >= MICRON_TURN || d->travel <= -MICRON_TURN))
            d->new_turn = true;
        d->travel %= MICRON_TURN;
    }
    if (!goes_around(d))
        d->seen = (struct steer_seen){0};
    else if (steer_seen_add(&d->seen, h->bearing % MICRON_TURN, d->set.step, MICRON_TURN))
        d->new_turn = true;
    d->bearing = h->bearing;
}

/* Another stretch of a steered scan: the head is sent its limits, and asked for the next ping right behind. */
static void steer(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    unsigned left, right;
    if (!d->conf.steered || !micron_scan_ping(&d->scan, d->line.head.bearing % MICRON_TURN, now_ns))
        return;
    if (micron_scan_limits(&d->scan, &left, &right)) {
        d->set.control &= (uint16_t)~MICRON_CONTINUOUS;
        d->set.left = (uint16_t)left;
        d->set.right = (uint16_t)right;
    } else {
        micron_set_scan(&d->set, 0, 0, d->conf.step_rad);
    }
    send_parameters(d, now_ns, io);
}

/*
 * Somebody else's settings. Heads leave some bins out (642 and 794 were recorded of 650 and 800), and the limits of a
 * full circle mean nothing.
 */
static bool is_taken_over(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    const struct micron_data_head *seen = &d->line.head;
    const struct micron_settings *sent = &d->set;
    const struct takeover_value value[] = {
        {"adc8on", seen->control & MICRON_8_BIT, sent->control & MICRON_8_BIT, 0},
        {"continuous", (seen->control & MICRON_CONTINUOUS) != 0, (sent->control & MICRON_CONTINUOUS) != 0, 0},
        {"gain", seen->gain, sent->gain, 0},
        {"ADInterval", seen->interval, sent->interval, 0},
        {"bins", (long)micron_line_bins(&d->line), sent->n_bins, sent->n_bins / BINS_SLACK_SHARE},
        {"step", seen->step, sent->step, 0},
        {"left limit", seen->left, sent->left, 0},
        {"right limit", seen->right, sent->right, 0},
    };
    const unsigned n = sizeof value / sizeof value[0], limits = 2;
    return takeover_ping(&d->takeover, &d->poller.status, value,
                         seen->control & sent->control & MICRON_CONTINUOUS ? n - limits : n, now_ns, io);
}

static void make_ping(struct micron *d, const struct device_io *io)
{
    const struct micron_data_head *h = &d->line.head;
    d->poller.status.pings++;
    d->poller.status.last_ping_ns = d->line.t_last_ns;
    d->poller.status.range_m = micron_line_bins(&d->line) * micron_bin_m(h->interval, d->conf.sound_speed_mps);
    struct ping *ping = io->ping_begin(io->ctx);
    if (!ping)
        return;
    micron_fill_ping(ping, &d->line, d->conf.sound_speed_mps, d->conf.baud);
    ping->flags = d->new_turn ? PING_NEW_TURN : 0;
    d->new_turn = false;
    io->ping_done(io->ctx, ping);
}

/* The motor has lost its steps: no bearing is to be believed until the head was sent its settings again. */
static void on_motor_error(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    d->poller.status.bad_frame++;
    if (!d->motor_told)
        io->note(io->ctx, NOTE_WARNING, "motor error: its pings are left out until the motor turns again");
    d->motor_told = true;
    if (at(d, SCAN))
        go(d, PARAMETERS, now_ns, io);
}

static void on_line(struct micron *d, uint64_t now_ns, const struct device_io *io)
{
    if (micron_line_bins(&d->line) == 0) {
        d->poller.status.bad_frame++;
        return;
    }
    if (d->line.head.status & MICRON_STATUS_MOTOR_ERROR) {
        on_motor_error(d, now_ns, io);
        return;
    }
    follow_head(d, &d->line.head);
    make_ping(d, io);
    d->motor_told = false;
    d->reboot_ns = CENTRING_NS;
    if (poller_pinged(&d->poller))
        io->note(io->ctx, NOTE_INFO, "%s, %s, range %.4g m",
                 d->poller.status.what[0] ? d->poller.status.what : "SeaNet head",
                 poller_listening(&d->poller) ? "receiving pings" : "polled mode", d->poller.status.range_m);
    if (at(d, SCAN)) {
        const bool taken_over = is_taken_over(d, now_ns, io);
        d->poller.status.restarts += taken_over;
        if (taken_over || d->retuned)
            send_parameters(d, now_ns, io);
        d->retuned = false;
        steer(d, now_ns, io);
        start_scan(d, now_ns, io);
    }
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
        d->poller.status.bad_frame++;
        break;
    }
}

static void on_alive(struct micron *d, const struct seanet_frame *frame, uint64_t now_ns,
                     const struct device_io *io)
{
    uint8_t info;
    if (!micron_decode_alive(frame, &info)) {
        d->poller.status.bad_frame++;
        return;
    }
    bool ready = (info & MICRON_CENTRED) && !(info & MICRON_MOTORING);
    bool has_parameters = !(info & MICRON_NO_PARAMETERS);
    if (at(d, SCAN) && !has_parameters) {
        d->poller.status.restarts++;
        d->poller.answered = false;
        poller_timed_out(&d->poller, "the head has restarted (power?)", io);
        poller_expect(&d->poller, &steps[CENTRING], now_ns + CENTRING_NS);
    }
    if (at(d, PARAMETERS) && ready && has_parameters)
        start_scan(d, now_ns, io);
    else if ((at(d, ALIVE) || at(d, CENTRING)) && ready)
        go(d, VERSION, now_ns, io);
    else if (at(d, ALIVE))
        poller_expect(&d->poller, &steps[CENTRING], now_ns + CENTRING_NS);
}

static void on_version(struct micron *d, const struct seanet_frame *frame, uint64_t now_ns,
                       const struct device_io *io)
{
    if (!micron_decode_version(frame, &d->software, &d->serial)) {
        d->poller.status.bad_frame++;
        return;
    }
    snprintf(d->poller.status.what, sizeof d->poller.status.what, "SeaNet head sw %u serial %u", d->software,
             d->serial);
    if (at(d, VERSION))
        go(d, USER, now_ns, io);
}

static void on_user_data(struct micron *d, const struct seanet_frame *frame, uint64_t now_ns,
                         const struct device_io *io)
{
    if (!micron_decode_user_data(frame, &d->set.dst)) {
        d->poller.status.bad_frame++;
        return;
    }
    snprintf(d->poller.status.what, sizeof d->poller.status.what, "%s sw %u serial %u",
             d->set.dst ? "Micron DST" : "SeaNet head", d->software, d->serial);
    if (at(d, USER))
        go(d, PARAMETERS, now_ns, io);
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
    size_t strange = n;
    while (seanet_parser_next(&d->parser, &bytes, &n, now_ns, &frame)) {
        d->poller.strange = 0;
        on_frame(d, &frame, now_ns, io);
        strange = n;
    }
    d->poller.strange += strange;
}

static void micron_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = state;
    seanet_parser_reset(&d->parser);
    d->line.open = false;
    d->bearing = BEARING_UNKNOWN;
    d->travel = 0;
    d->new_turn = false;
    d->motor_told = false;
    takeover_forget(&d->takeover, &d->poller.status);
    d->reboot_ns = CENTRING_NS;
    poller_opened(&d->poller, now_ns, io);
}

static void micron_closed(void *state, uint64_t now_ns)
{
    struct micron *d = state;
    (void)now_ns;
    seanet_parser_reset(&d->parser);
    poller_closed(&d->poller);
}

static void micron_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = state;
    if (!poller_is_due(&d->poller, now_ns))
        return;
    /* The answer may be there, behind a false or broken beginning that waits for more bytes. */
    seanet_parser_give_up(&d->parser, now_ns > QUIET_NS ? now_ns - QUIET_NS : 0);
    micron_feed(d, NULL, 0, now_ns, io);
    poller_tick(&d->poller, now_ns, io);
}

static void micron_steer(void *state, double from_rad, double to_rad, bool only)
{
    struct micron *d = state;
    micron_scan_steer(&d->scan, from_rad, to_rad, only);
}

/* Between two pings, as it takes nothing else. */
static void micron_retune(void *state, const struct device_conf *conf, uint64_t now_ns, const struct device_io *io)
{
    struct micron *d = state;
    (void)now_ns, (void)io;
    tune(d, conf);
    d->retuned = true;
}

static void micron_status(const void *state, struct device_status *out)
{
    const struct micron *d = state;
    *out = d->poller.status;
    out->state = poller_state(&d->poller);
    out->frames = d->parser.frames;
    out->garbage_bytes = d->parser.garbage_bytes;
    out->cut_bytes = d->parser.cut_bytes;
    out->bad_frame += d->parser.broken;
}

static const struct device_key keys[] = {
    {.name = "range", .lo = 0.75, .hi = 200},
    {.name = "gain", .lo = 0, .hi = 10, .help = "tenths of its full gain; auto: 4"},
    {.name = "sector"},
    {.name = "step", .lo = 0.05, .hi = 14.37},
    {.name = "scan"},
    {.name = "circle"},
    {.name = "frequency", .lo = 200, .hi = 1200, .help = "auto: 675"},
    {.name = "amplitude"},
    {.name = "decibels_per_count"},
    {.name = "background"},
    {.name = NULL},
};

const struct device_ops device_micron = {
    .name = "micron",
    .keys = keys,
    .beam_deg = {MICRON_WIDE_DEG, MICRON_HIGH_DEG},
    .state_size = sizeof(struct micron),
    .max_beams = 1,
    .max_bins = MICRON_BINS_MAX,
    .init = micron_init,
    .opened = micron_opened,
    .closed = micron_closed,
    .feed = micron_feed,
    .tick = micron_tick,
    .deadline = poller_deadline,
    .stop = poller_stop, /* a head that is not asked is quiet */
    .status = micron_status,
    .steer = micron_steer,
    .retune = micron_retune,
};
