/* SPDX-License-Identifier: MIT */
/*
 * ping1d_device - the Blue Robotics Ping1D and Ping2 echosounders as a state machine: asks who is there, sets it up one
 * acknowledged setting after the other, keeps its profiles coming or asks for them, and turns readings into pings. Only
 * a device that has no profiles is asked for distances, which cannot be checked.
 * See poller.h for the steps, device.h for the rules and ping1d.h for the configuration.
 * Knows no descriptor, no clock and no grid.
 *
 *   opened -> IDENTIFY -> SETTING (each) -> STREAM, or REQUEST (or DISTANCE) and PAUSE in turn      (stop: STOP)
 *               ^  | \refused     ^                        | silence, or it was started anew
 *               |  |  FIRMWARE ---+                        |
 *              a wait <------------------------------------+
 */
#include "ping1d.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "ping_talk.h"
#include "takeover.h"

#define MS 1000000ull

#define ANSWER_NS      (500 * MS) /* a bridge in between may need as long */
#define SILENCE_NS     (1500 * MS)
#define STOP_NS        (250 * MS)
#define PING_MARGIN_NS (25 * MS) /* of the device's own work and the line, beside listening */
#define LATE_MAX       8         /* pings; datagrams may overtake each other */
#define PING_LEAST_NS  (50 * MS)
#define PROFILES_NS    (5000 * MS) /* for so long after a profile a distance alone says nothing */

#define REVISION_PING2  2
#define BEAM_DEG        30.0
#define BEAM_PING2_DEG  25.0
#define LISTENING_MIN_M 1.5
#define SLACK_MM        50 /* how exactly a device takes the scan that it is set to is not known: */
#define SLACK_SHARE     20 /* this, and a part in so many */

enum step { IDENTIFY, FIRMWARE, SETTING, STREAM, REQUEST, DISTANCE, PAUSE, STOP, N_STEPS };

static const struct poller_step steps[N_STEPS];

/* In this order. Profiles are started last, at STREAM. */
static const uint16_t settings[] = {PING1D_CONTINUOUS_STOP,   PING1D_SET_SPEED_OF_SOUND, PING1D_SPEED_OF_SOUND,
                                    PING1D_SET_MODE_AUTO,     PING1D_SET_RANGE,          PING1D_SET_GAIN,
                                    PING1D_SET_PING_INTERVAL, PING1D_SET_PING_ENABLE};
#define N_SETTINGS (sizeof settings / sizeof settings[0])

struct ping1d {
    struct ping_talk talk; /* first: see ping_talk.h */
    struct device_conf conf;
    uint64_t interval_ns;
    double device_speed_mps; /* that its distances are on */
    double beam_rad;
    double scan_start_m,
        scan_end_m; /* that the last reading but simple ones was from; as configured before the first */
    struct takeover takeover;

    unsigned setting; /* of settings[], at SETTING */
    struct ping_count count;

    bool profiled;       /* a profile came since it was opened or found silent */
    bool alone;          /* it has none: distances are asked for */
    uint64_t profile_ns; /* of the last one; with profiled */
};

static void go(struct ping1d *d, enum step step, uint64_t now_ns, const struct device_io *io)
{
    poller_start(&d->talk.poller, &steps[step], now_ns, io);
}

static bool at(const struct ping1d *d, enum step step)
{
    return d->talk.poller.step == &steps[step];
}

/* ---- configuration ---- */

static void on_frame(void *device, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io);

/* Its scan is as it is going to be configured, until it says one. */
static void forget_scan(struct ping1d *d)
{
    d->scan_start_m = PING1D_START_MM * 1e-3;
    d->scan_end_m = d->conf.range_m;
}

static bool ping1d_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    struct ping1d *d = state;
    if (!device_conf_check(&device_ping1d, conf, fault))
        return false;
    uint64_t ping_ns = (uint64_t)(2e9 * conf->range_m / conf->sound_speed_mps) + PING_MARGIN_NS;
    memset(d, 0, sizeof *d);
    d->conf = *conf;
    d->interval_ns = ping_ns > PING_LEAST_NS ? ping_ns : PING_LEAST_NS;
    d->device_speed_mps = PING1D_SOUND_SPEED_MPS;
    forget_scan(d);
    d->beam_rad = geo_rad(BEAM_DEG);
    d->talk.on_frame = on_frame;
    ping_parser_init(&d->talk.parser, PING_PAYLOAD_MAX);
    poller_init(&d->talk.poller, conf->listen_only, &steps[IDENTIFY], &steps[STOP]);
    return true;
}

/* ---- what is said ---- */

static void set(uint16_t id, uint32_t a, uint32_t b, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD + 8];
    io->send(io->ctx, out, ping1d_encode_set(out, sizeof out, id, a, b));
}

static uint64_t identify(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    ping_talk_request(PING_DEVICE_INFORMATION, io);
    return ANSWER_NS;
}

static uint64_t ask_firmware(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    ping_talk_request(PING1D_FIRMWARE_VERSION, io);
    return ANSWER_NS;
}

static uint64_t send_setting(void *device, uint64_t now_ns, const struct device_io *io)
{
    const struct ping1d *d = device;
    const uint32_t range_mm = (uint32_t)lround(d->conf.range_m * 1e3);
    const uint16_t id = settings[d->setting];
    (void)now_ns;
    switch (id) {
    case PING1D_CONTINUOUS_STOP:
        set(id, PING1D_PROFILE, 0, io);
        break;
    case PING1D_SET_SPEED_OF_SOUND:
        set(id, (uint32_t)lround(d->conf.sound_speed_mps * 1e3), 0, io);
        break;
    case PING1D_SPEED_OF_SOUND: /* what it now works with is believed, not what it was sent */
        ping_talk_request(id, io);
        break;
    case PING1D_SET_MODE_AUTO:
        set(id, d->conf.gain < 0, 0, io);
        break;
    case PING1D_SET_RANGE:
        set(id, PING1D_START_MM, range_mm - PING1D_START_MM, io);
        break;
    case PING1D_SET_GAIN:
        set(id, (uint32_t)d->conf.gain, 0, io);
        break;
    case PING1D_SET_PING_INTERVAL:
        set(id, (uint32_t)(d->interval_ns / MS), 0, io);
        break;
    default:
        set(id, 1, 0, io);
        break;
    }
    return ANSWER_NS;
}

static uint64_t start_profiles(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    set(PING1D_CONTINUOUS_START, PING1D_PROFILE, 0, io);
    return SILENCE_NS;
}

static uint64_t ask_profile(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    ping_talk_request(PING1D_PROFILE, io);
    return ANSWER_NS;
}

static uint64_t ask_distance(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    ping_talk_request(PING1D_DISTANCE, io);
    return ANSWER_NS;
}

static uint64_t wait_for_ping(void *device, uint64_t now_ns, const struct device_io *io)
{
    const struct ping1d *d = device;
    (void)now_ns, (void)io;
    return d->interval_ns;
}

static uint64_t send_stop(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    set(PING1D_CONTINUOUS_STOP, PING1D_PROFILE, 0, io);
    return STOP_NS;
}

/* ---- what follows when nothing comes ---- */

/* The next setting that applies, or the readings when there is none. */
static void set_up_from(struct ping1d *d, unsigned setting, uint64_t now_ns, const struct device_io *io)
{
    for (d->setting = setting; d->setting < N_SETTINGS; d->setting++) {
        bool own = settings[d->setting] == PING1D_SET_RANGE || settings[d->setting] == PING1D_SET_GAIN;
        if (own && d->conf.gain < 0)
            continue; /* the device chooses */
        go(d, SETTING, now_ns, io);
        return;
    }
    go(d, d->conf.request_response ? REQUEST : STREAM, now_ns, io);
}

static void nobody_there(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = device;
    char why[96];
    snprintf(why, sizeof why, "no answer from an echosounder (%s)", poller_advice(&d->conf));
    poller_timed_out(&d->talk.poller, why, io);
    poller_retry(&d->talk.poller, now_ns);
}

/* It has answered, if only to refuse its name: it is there, and readings will tell what it is worth. */
static void set_up_nameless(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = device;
    struct device_status *s = &d->talk.poller.status;
    snprintf(s->what, sizeof s->what, "Ping1D of old firmware");
    set_up_from(d, 0, now_ns, io);
}

/* It is done without. */
static void setting_missed(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = device;
    io->note(io->ctx, NOTE_INFO, "setting %u is not acknowledged", settings[d->setting]);
    set_up_from(d, d->setting + 1, now_ns, io);
}

/* It may have been without power, and is at its own settings then: a request to go on would not do. */
static void readings_missed(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = device;
    d->profiled = d->alone = false;
    takeover_forget(&d->takeover, &d->talk.poller.status);
    poller_restart(&d->talk.poller,
                   d->talk.poller.answered ? "the echosounder stopped sending readings"
                                           : "the echosounder is there, but sends no readings",
                   now_ns, io);
}

static void go_without_profiles(struct ping1d *d, uint64_t now_ns, const struct device_io *io)
{
    d->alone = true;
    go(d, DISTANCE, now_ns, io);
}

static void profiles_missed(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = device;
    if (d->profiled)
        readings_missed(d, now_ns, io);
    else
        go_without_profiles(d, now_ns, io);
}

static void ask_again(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = device;
    go(d, d->alone ? DISTANCE : REQUEST, now_ns, io);
}

static void never_stopped(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)now_ns, (void)io;
    poller_quiet(device);
}

static const struct poller_step steps[N_STEPS] = {
    [IDENTIFY] = {DEVICE_IDENTIFY, .tries = 3, .ask = identify, .missed = nobody_there},
    [FIRMWARE] = {DEVICE_IDENTIFY, .tries = 2, .ask = ask_firmware, .missed = set_up_nameless},
    [SETTING] = {DEVICE_SETUP, .tries = 2, .ask = send_setting, .missed = setting_missed},
    [STREAM] = {DEVICE_SETUP, .tries = 1, .ask = start_profiles, .missed = readings_missed},
    [REQUEST] = {DEVICE_SETUP, .tries = 3, .ask = ask_profile, .missed = profiles_missed},
    [DISTANCE] = {DEVICE_SETUP, .tries = 3, .ask = ask_distance, .missed = readings_missed},
    [PAUSE] = {DEVICE_SETUP, .ask = wait_for_ping, .missed = ask_again},
    [STOP] = {DEVICE_CLOSED, .tries = 3, .ask = send_stop, .missed = never_stopped},
};

/* ---- what comes ---- */

static void make_ping(struct ping1d *d, const struct ping1d_reading *r, const struct ping_frame *frame,
                      const struct device_io *io)
{
    const double scale = d->conf.sound_speed_mps / d->device_speed_mps;
    const struct ping1d_view view = {.scale = scale,
                                     .start_m = d->scan_start_m,
                                     .range_m = d->scan_end_m,
                                     .sound_speed_mps = d->conf.sound_speed_mps,
                                     .min_confidence = d->conf.min_confidence,
                                     .beam_rad = d->beam_rad,
                                     .baud = d->conf.baud};
    d->talk.poller.status.pings++;
    d->talk.poller.status.last_ping_ns = frame->t_last_ns;
    if (!r->simple) {
        d->scan_start_m = r->start_mm * 1e-3 * scale;
        d->scan_end_m = (r->start_mm + r->length_mm) * 1e-3 * scale;
    }
    d->talk.poller.status.range_m = d->scan_end_m;
    struct ping *ping = io->ping_begin(io->ctx);
    if (!ping)
        return;
    ping1d_fill_ping(ping, frame, r, &view);
    io->ping_done(io->ctx, ping);
}

/* A count that goes back, further than a late frame does, is that of a device that was started anew. */
static bool started_anew(const struct ping1d *d, const struct ping1d_reading *r)
{
    return !r->simple && d->count.known && (uint64_t)r->ping_number + LATE_MAX < d->count.last;
}

/* Somebody else's scan or gain. With a gain of the device's own both are its choice, and say nothing. */
static bool is_taken_over(struct ping1d *d, const struct ping1d_reading *r, uint64_t now_ns,
                          const struct device_io *io)
{
    const long length_mm = lround(d->conf.range_m * 1e3) - PING1D_START_MM;
    const struct takeover_value value[] = {
        {"scan_start", (long)r->start_mm, PING1D_START_MM, SLACK_MM},
        {"scan_length", (long)r->length_mm, length_mm, SLACK_MM + length_mm / SLACK_SHARE},
        {"gain_setting", (long)r->gain, d->conf.gain, 0},
    };
    return d->conf.gain >= 0 && !r->simple &&
           takeover_ping(&d->takeover, &d->talk.poller.status, value, sizeof value / sizeof value[0], now_ns, io);
}

/* While profiles come, what somebody else asks for without one is left out: nothing could be held against it. */
static bool is_unchecked(struct ping1d *d, const struct ping1d_reading *r, uint64_t now_ns)
{
    if (r->n_samples > 0) {
        d->profiled = true;
        d->alone = false;
        d->profile_ns = now_ns;
    }
    return r->n_samples == 0 && d->profiled && now_ns - d->profile_ns < PROFILES_NS;
}

static void tell_first(const struct ping1d *d, const struct ping1d_reading *r, bool asked,
                       const struct device_io *io)
{
    const struct device_status *s = &d->talk.poller.status;
    io->note(io->ctx, r->n_samples > 0 ? NOTE_INFO : NOTE_WARNING, "%s, %s, range %.4g m%s",
             s->what[0] ? s->what : "Ping1D", asked ? "polled mode" : "auto-transmit mode", s->range_m,
             r->n_samples > 0 ? "" : "; it sends distances without profiles, which cannot be checked");
}

static void on_reading(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns,
                       const struct device_io *io)
{
    struct poller *poller = &d->talk.poller;
    struct ping1d_reading r;
    if (!ping1d_decode(frame, &r)) {
        poller->status.bad_frame++;
        return;
    }
    if (started_anew(d, &r) && (at(d, STREAM) || at(d, REQUEST) || at(d, DISTANCE))) {
        d->count.known = false;
        poller_restart(poller, "the echosounder has restarted (power?)", now_ns, io);
        return;
    }
    if (is_unchecked(d, &r, now_ns))
        return;
    /* A distance that is reported twice would make old evidence young. */
    const bool asked = at(d, REQUEST) || at(d, DISTANCE);
    uint64_t *lost = asked || at(d, PAUSE) ? NULL : &poller->status.lost_frames;
    if (r.simple || ping_count_is_new(&d->count, r.ping_number, lost))
        make_ping(d, &r, frame, io);
    if (poller_pinged(poller))
        tell_first(d, &r, asked, io);
    if ((at(d, STREAM) || asked) && is_taken_over(d, &r, now_ns, io)) {
        poller->status.restarts++;
        set_up_from(d, 0, now_ns, io);
    } else if (r.n_samples == 0 && !at(d, DISTANCE))
        return; /* not what was asked for */
    else if (at(d, STREAM))
        poller_expect(poller, &steps[STREAM], now_ns + SILENCE_NS);
    else if (asked)
        go(d, PAUSE, now_ns, io);
}

/* Waits to hear what it is, or to ask that again. */
static bool is_seeking(const struct ping1d *d)
{
    return poller_seeking(&d->talk.poller, &steps[IDENTIFY]) || at(d, FIRMWARE);
}

static void on_identity(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns,
                        const struct device_io *io)
{
    const bool seeking = is_seeking(d);
    struct ping_device_information info;
    if (!ping_talk_identity(&d->talk, frame, &info))
        return;
    if (info.type != PING_TYPE_PING360) {
        const bool ping2 = info.revision == REVISION_PING2;
        ping_talk_name(&d->talk, ping2 ? "Ping2" : "Ping1D", &info, frame->src);
        d->beam_rad = geo_rad(ping2 ? BEAM_PING2_DEG : BEAM_DEG);
        if (seeking)
            set_up_from(d, 0, now_ns, io);
    } else if (seeking) {
        poller_timed_out(&d->talk.poller, "the device is a Ping360, not an echosounder: device = ping360?", io);
        poller_retry(&d->talk.poller, now_ns);
    }
}

/* Only this family knows the message; a Ping2 is too new to be asked. */
static void on_firmware(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns,
                        const struct device_io *io)
{
    struct device_status *s = &d->talk.poller.status;
    unsigned major, minor;
    if (!ping1d_decode_firmware(frame, &major, &minor)) {
        s->bad_frame++;
        return;
    }
    if (!at(d, FIRMWARE))
        return;
    snprintf(s->what, sizeof s->what, "Ping1D fw %u.%u id %u", major, minor, frame->src);
    set_up_from(d, 0, now_ns, io);
}

/* Old firmware does not know the first question: it is asked the one that it knows, or set up without a name. */
static void on_nameless(struct ping1d *d, uint16_t id, uint64_t now_ns, const struct device_io *io)
{
    if (at(d, FIRMWARE) && id != PING_DEVICE_INFORMATION)
        set_up_nameless(d, now_ns, io);
    else if (!at(d, FIRMWARE) && id != PING1D_FIRMWARE_VERSION)
        go(d, FIRMWARE, now_ns, io);
}

/*
 * Some firmware refuses what nobody asked for: a refusal is counted and reported, and what was refused then done
 * without. A request is refused by its own id, or by that of the message around it.
 */
static void on_answer(struct ping1d *d, uint16_t id, bool refused, uint64_t now_ns, const struct device_io *io)
{
    const bool question =
        id == PING_DEVICE_INFORMATION || id == PING1D_FIRMWARE_VERSION || id == PING_GENERAL_REQUEST;

    if (refused && question && is_seeking(d))
        on_nameless(d, id, now_ns, io);
    else if (at(d, SETTING) && id == settings[d->setting])
        set_up_from(d, d->setting + 1, now_ns, io);
    else if (refused && at(d, STREAM) && id == PING1D_CONTINUOUS_START)
        go(d, REQUEST, now_ns, io);
    else if (refused && at(d, REQUEST) && id == PING1D_PROFILE && !d->profiled)
        go_without_profiles(d, now_ns, io);
    else if (at(d, STOP) && id == PING1D_CONTINUOUS_STOP)
        poller_quiet(&d->talk.poller);
}

static void on_speed(struct ping1d *d, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    if (!ping1d_decode_speed(frame, &d->device_speed_mps))
        d->talk.poller.status.bad_frame++;
    else
        on_answer(d, PING1D_SPEED_OF_SOUND, false, now_ns, io);
}

static void on_frame(void *device, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = device;
    uint16_t id;
    bool refused;
    if (ping1d_is_reading(frame->id))
        on_reading(d, frame, now_ns, io);
    else if (frame->id == PING_DEVICE_INFORMATION)
        on_identity(d, frame, now_ns, io);
    else if (frame->id == PING1D_SPEED_OF_SOUND)
        on_speed(d, frame, now_ns, io);
    else if (frame->id == PING1D_FIRMWARE_VERSION)
        on_firmware(d, frame, now_ns, io);
    else if (frame->id == PING_ASCII_TEXT)
        ping_talk_says(frame, io);
    else if (ping_talk_answered(&d->talk, frame, io, &id, &refused))
        on_answer(d, id, refused, now_ns, io);
}

/* ---- the device ---- */

static void ping1d_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping1d *d = state;
    takeover_forget(&d->takeover, &d->talk.poller.status);
    d->count = (struct ping_count){0};
    d->profiled = d->alone = false;
    d->device_speed_mps = PING1D_SOUND_SPEED_MPS;
    forget_scan(d);
    ping_talk_opened(&d->talk, now_ns, io);
}

static const struct device_key keys[] = {
    {.name = "range", .lo = LISTENING_MIN_M, .hi = 200},
    {.name = "gain", .lo = 0, .hi = 6, .help = "auto: the device chooses"},
    {.name = "mode"},
    {.name = "min_confidence", .lo = 0.01, .hi = 1},
    {.name = "delay", .help = "auto: 0.4 0.4 s, a Ping1D smooths"},
    {.name = NULL},
};

const struct device_ops device_ping1d = {
    .name = "ping1d",
    .keys = keys,
    .state_size = sizeof(struct ping1d),
    .max_beams = 1,
    .max_bins = PING1D_SAMPLES_MAX,
    .chooses = true,
    .round = true,
    .axial = true,
    .delay = {.s = 0.4, .uncertain_s = 0.4},
    .init = ping1d_init,
    .opened = ping1d_opened,
    .closed = ping_talk_closed,
    .feed = ping_talk_feed,
    .tick = ping_talk_tick,
    .deadline = poller_deadline,
    .stop = poller_stop,
    .status = ping_talk_status,
};
