/* SPDX-License-Identifier: MIT */
/*
 * ping360_device - the Blue Robotics Ping360 scanning sonar as a state machine: wakes the head up, asks who it is, sets
 * it scanning, notices what does not come, and turns its data frames into pings. See poller.h for the steps, device.h
 * for the rules and ping360.h for the configuration. Knows no descriptor, no clock and no grid.
 *
 *   opened -> BREAK -> WAKE -> AUTOBAUD -> IDENTIFY -> VERSION -> AUTO or REQUEST     (stop: STOP)
 *              ^  ^                            | no answer           | silence
 *              |  +----------------------------|---------------------+
 *              +---------- a wait <------------+
 */
#include "ping360.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "contest.h"
#include "drivers/ports/line_time.h"
#include "ping360_scan.h"
#include "ping_talk.h"
#include "takeover.h"

#define MS     1000000ull
#define SECOND 1000000000ull

#define BREAK_NS       (12 * MS) /* the head wants 10 at least */
#define WAKE_NS        (10 * MS) /* from the break until the head measures the speed of the line ... */
#define AUTOBAUD_BYTES 10u       /* ... by so many 'U' ... */
#define AUTOBAUD_NS    (11 * MS) /* ... and until it listens */
#define ANSWER_NS      (500 * MS)
#define STOP_NS        (250 * MS)

#define TRAVEL_ANY_NS     (4200 * MS) /* the longest way of the head, from anywhere to anywhere */
#define TRAVEL_GRADIAN_NS (8 * MS)    /* measured: 6 to 10 */
#define TRAVEL_NEAR       20          /* gradians; beyond, and from an unknown angle, TRAVEL_ANY_NS is waited */
/*
 * Waited on top of line, listening and travel. This and the travel allowed for one step are what a lost frame costs,
 * besides being asked for again: 190 ms at 10 gradians.
 */
#define MARGIN_NS       (110 * MS)
#define FIRST_TRIES     2 /* of the first pings asked for, with the long wait */
#define AUTO_SILENCE_NS SECOND
#define SPEAK_UP_NS     SECOND

#define TRANSDUCER_BYTES (PING_OVERHEAD + 14u)
#define DATA_BYTES       (PING_OVERHEAD + 14u) /* of a device_data frame, without the samples */

enum step { BREAK, WAKE, AUTOBAUD, IDENTIFY, VERSION, AUTO, REQUEST, STOP, N_STEPS };

static const struct poller_step steps[N_STEPS];

struct ping360 {
    struct ping_talk talk; /* first: see ping_talk.h */
    struct device_conf conf;
    struct ping360_settings set;
    struct ping360_scan scan;
    bool auto_refused; /* automatic scan, by this firmware */
    struct takeover takeover;
    struct contest contest;
    struct ping360_track track;
    struct steer_seen seen; /* of a head that is steered: it jumps, and a turn is when it has been everywhere */
    bool new_turn;          /* the next ping begins one */
    bool empty;             /* data without samples came, and no ping since */
};

static void go(struct ping360 *d, enum step step, uint64_t now_ns, const struct device_io *io)
{
    poller_start(&d->talk.poller, &steps[step], now_ns, io);
}

static bool at(const struct ping360 *d, enum step step)
{
    return d->talk.poller.step == &steps[step];
}

/* ---- how long things take ---- */

/* The time in which a ping from `angle` must have come, whole, after the request. */
static uint64_t answer_ns(const struct ping360 *d, uint16_t angle)
{
    uint64_t travel_ns = TRAVEL_ANY_NS;
    if (d->track.head != PING360_ANGLE_UNKNOWN) {
        int turn = ping360_angle_to(d->track.head, angle);
        unsigned gradians = (unsigned)(turn < 0 ? -turn : turn);
        if (gradians <= TRAVEL_NEAR)
            travel_ns = gradians * TRAVEL_GRADIAN_NS;
    }
    return poller_line_ns(&d->conf, TRANSDUCER_BYTES + DATA_BYTES + d->set.n_samples) +
           ping360_listening_ns(&d->set) + travel_ns + MARGIN_NS;
}

/* How long a head that scans by itself may be silent: three pings, but never less than AUTO_SILENCE_NS. */
static uint64_t auto_silence_ns(const struct ping360 *d)
{
    uint64_t ping_ns = poller_line_ns(&d->conf, DATA_BYTES + d->set.n_samples) + ping360_listening_ns(&d->set) +
                       d->scan.step * TRAVEL_GRADIAN_NS;
    return 3 * ping_ns > AUTO_SILENCE_NS ? 3 * ping_ns : AUTO_SILENCE_NS;
}

/* ---- configuration ---- */

static void on_frame(void *device, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io);

static void tune(struct ping360 *d, const struct device_conf *conf)
{
    d->conf = *conf;
    d->set.gain = (uint8_t)(conf->gain < 0 ? 1 : conf->gain);
    /* a head is steered to where its answers count by the second: the line's time is worth more than fine samples */
    ping360_set_range(&d->set, conf->range_m, conf->sound_speed_mps,
                      conf->steered ? PING360_SAMPLES_FEW : PING360_SAMPLES_MAX);
}

static bool ping360_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    struct ping360 *d = state;
    double frequency_khz = conf->frequency_hz != 0.0 ? conf->frequency_hz / 1e3 : 750.0;
    if (!device_conf_check(&device_ping360, conf, fault))
        return false;
    memset(d, 0, sizeof *d);
    d->set.mode = 1;
    d->set.frequency_khz = (uint16_t)lround(frequency_khz);
    tune(d, conf);
    ping360_scan_init(&d->scan, conf->sector_start_rad, conf->sector_end_rad, conf->step_rad);
    d->scan.steer.circle_ns = (uint64_t)(conf->circle_s * 1e9);
    ping360_track_reset(&d->track);
    d->talk.on_frame = on_frame;
    ping_parser_init(&d->talk.parser, PING_PAYLOAD_MAX);
    poller_init(&d->talk.poller, conf->listen_only, &steps[BREAK], &steps[STOP]);
    return true;
}

/* ---- what is said ---- */

/*
 * A head on a serial line is woken up so. Over a network the wire's break is for a bridge that may have to wake the
 * head up, and is kept for when the head is silent.
 */
static bool wants_break(const struct ping360 *d)
{
    return d->conf.baud || d->talk.poller.silent;
}

static uint64_t begin_break(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    (void)now_ns;
    d->auto_refused = false;
    d->track.head = PING360_ANGLE_UNKNOWN;
    if (!wants_break(d))
        return 0;
    io->hold_break(io->ctx, true);
    return BREAK_NS;
}

static uint64_t end_break(void *device, uint64_t now_ns, const struct device_io *io)
{
    const struct ping360 *d = device;
    (void)now_ns;
    if (!wants_break(d))
        return 0;
    io->hold_break(io->ctx, false);
    return WAKE_NS;
}

static uint64_t send_autobaud(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    uint8_t out[AUTOBAUD_BYTES];
    (void)now_ns;
    if (!d->conf.baud)
        return 0;
    memset(out, 'U', sizeof out);
    io->send(io->ctx, out, sizeof out);
    return line_ns(d->conf.baud, sizeof out) + AUTOBAUD_NS;
}

static uint64_t ask_identity(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    ping_talk_request(PING_DEVICE_INFORMATION, io);
    return ANSWER_NS;
}

static uint64_t ask_version(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    ping_talk_request(PING_PROTOCOL_VERSION, io);
    return ANSWER_NS;
}

static uint64_t request_ping(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    uint8_t out[TRANSDUCER_BYTES];
    (void)now_ns;
    if (!d->talk.poller.answered && d->talk.poller.tries > FIRST_TRIES)
        return POLLER_GIVE_UP;
    d->set.angle = ping360_scan_angle(&d->scan);
    io->send(io->ctx, out, ping360_encode_transducer(out, sizeof out, &d->set, true));
    return answer_ns(d, d->set.angle);
}

/* Over a network the silence may have a harmless cause: a bridge answers whoever spoke last. */
static uint64_t start_auto(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    uint8_t out[32];
    if (d->talk.poller.tries > 1) {
        if (!d->talk.poller.answered || d->conf.baud)
            return POLLER_GIVE_UP;
        ask_identity(d, now_ns, io);
        return SPEAK_UP_NS;
    }
    io->send(io->ctx, out, ping360_encode_auto_transmit(out, sizeof out, &d->set, &d->scan.sweep));
    return answer_ns(d, d->scan.sweep.start);
}

static uint64_t send_motor_off(void *device, uint64_t now_ns, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD];
    (void)device, (void)now_ns;
    io->send(io->ctx, out, ping360_encode_motor_off(out, sizeof out));
    return STOP_NS;
}

/* ---- what follows when nothing comes ---- */

static void go_wake(void *device, uint64_t now_ns, const struct device_io *io)
{
    go(device, WAKE, now_ns, io);
}

static void go_autobaud(void *device, uint64_t now_ns, const struct device_io *io)
{
    go(device, AUTOBAUD, now_ns, io);
}

static void go_identify(void *device, uint64_t now_ns, const struct device_io *io)
{
    go(device, IDENTIFY, now_ns, io);
}

static void nobody_there(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    char why[96];
    snprintf(why, sizeof why, "no answer from a Ping360 (%s)", poller_advice(&d->conf));
    poller_timed_out(&d->talk.poller, why, io);
    poller_retry(&d->talk.poller, now_ns);
}

/* Also without its version it is known well enough. */
static void start_scan(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    steer_begin(&d->scan.steer, now_ns);
    const bool request = d->conf.request_response || d->conf.steered || d->auto_refused || !d->scan.by_itself;
    d->talk.poller.answered = false;
    takeover_forget(&d->takeover, &d->talk.poller.status);
    go(d, request ? REQUEST : AUTO, now_ns, io);
}

static void pings_missed(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    const bool empty = d->empty;
    d->empty = false;
    d->talk.poller.silent |= d->talk.poller.status.contested; /* which has been said */
    poller_restart(&d->talk.poller,
                   empty ? "the Ping360 answers without samples" : "the Ping360 stopped sending pings", now_ns,
                   io);
}

static void auto_missed(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    if (d->talk.poller.answered) {
        pings_missed(d, now_ns, io);
        return;
    }
    if (!d->talk.poller.status.contested)
        io->note(io->ctx, NOTE_INFO, "no answer to auto_transmit: asking for every ping");
    d->auto_refused = true;
    start_scan(d, now_ns, io);
}

static void never_stopped(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)now_ns, (void)io;
    poller_quiet(device);
}

static const struct poller_step steps[N_STEPS] = {
    [BREAK] = {DEVICE_IDENTIFY, .ask = begin_break, .missed = go_wake},
    [WAKE] = {DEVICE_IDENTIFY, .ask = end_break, .missed = go_autobaud},
    [AUTOBAUD] = {DEVICE_IDENTIFY, .ask = send_autobaud, .missed = go_identify},
    [IDENTIFY] = {DEVICE_IDENTIFY, .tries = 3, .ask = ask_identity, .missed = nobody_there},
    [VERSION] = {DEVICE_IDENTIFY, .tries = 3, .ask = ask_version, .missed = start_scan},
    [AUTO] = {DEVICE_SETUP, .tries = 3, .ask = start_auto, .missed = auto_missed},
    [REQUEST] = {DEVICE_SETUP, .tries = 5, .per_ping = true, .ask = request_ping, .missed = pings_missed},
    [STOP] = {DEVICE_CLOSED, .tries = 3, .ask = send_motor_off, .missed = never_stopped},
};

/* ---- what comes ---- */

static void make_ping(struct ping360 *d, const struct ping360_data *data, const struct ping_frame *frame,
                      const struct device_io *io)
{
    d->talk.poller.status.pings++;
    d->talk.poller.status.last_ping_ns = frame->t_last_ns;
    d->talk.poller.status.range_m = data->set.n_samples * ping360_sample_m(&data->set, d->conf.sound_speed_mps);
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
    return at(d, AUTO) ? "auto-transmit mode" : at(d, REQUEST) ? "polled mode" : "receiving pings";
}

/* Somebody else's settings: a scan of our own is started again. A request says all of its settings itself. */
static bool is_taken_over(struct ping360 *d, const struct ping360_data *data, uint64_t now_ns,
                          const struct device_io *io)
{
    const struct ping360_settings *seen = &data->set, *sent = &d->set;
    const struct ping360_sweep *sweep = &d->scan.sweep;
    const struct takeover_value value[] = {
        {"auto_transmit", data->automatic, at(d, AUTO), 0},
        {"gain_setting", seen->gain, sent->gain, 0},
        {"transmit_duration", seen->transmit_us, sent->transmit_us, 0},
        {"sample_period", seen->sample_period, sent->sample_period, 0},
        {"transmit_frequency", seen->frequency_khz, sent->frequency_khz, 0},
        {"number_of_samples", seen->n_samples, sent->n_samples, 0},
        {"start_angle", data->sweep.start, sweep->start, 0},
        {"stop_angle", data->sweep.stop, sweep->stop, 0},
        {"num_steps", data->sweep.step, sweep->step, 0},
    };
    const unsigned n = sizeof value / sizeof value[0], of_sweep = 3;
    return takeover_ping(&d->takeover, &d->talk.poller.status, value,
                         at(d, AUTO) && data->automatic ? n : n - of_sweep, now_ns, io);
}

static void on_data(struct ping360 *d, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    struct poller *poller = &d->talk.poller;
    struct ping360_data data;
    unsigned missing;
    if (!ping360_decode_data(frame, &data) || data.set.angle >= PING360_TURN || data.set.sample_period == 0 ||
        data.set.sample_period > PING360_PERIOD_MAX) {
        poller->status.bad_frame++;
        return;
    }
    if (at(d, REQUEST) && data.set.angle == d->track.head && data.set.angle != d->set.angle)
        contest_late(&d->contest);
    const bool turned = ping360_track_follow(&d->track, &data, &missing);
    if (d->conf.steered && ping360_scan_is_alone(&d->scan)) /* and it begins anew when it goes round again */
        d->seen = (struct steer_seen){0};
    else if (d->conf.steered)
        d->new_turn |= steer_seen_add(&d->seen, data.set.angle, d->scan.step, PING360_TURN);
    d->new_turn |= turned && (!d->conf.steered || ping360_scan_is_alone(&d->scan));
    poller->status.lost_frames += missing;
    d->empty = data.n_data == 0;
    if (d->empty) /* the head only moved, or sent its settings; the ping is still to come */
        return;
    make_ping(d, &data, frame, io);
    if (at(d, AUTO) || at(d, REQUEST))
        contest_ping(&d->contest, &poller->status, at(d, REQUEST), now_ns, io);
    if (poller_pinged(poller) && !poller->status.contested)
        io->note(io->ctx, NOTE_INFO, "%s, %s, range %.4g m",
                 poller->status.what[0] ? poller->status.what : "Ping360", way_of_scanning(d),
                 data.set.n_samples * ping360_sample_m(&data.set, d->conf.sound_speed_mps));
    const bool taken_over = (at(d, AUTO) || at(d, REQUEST)) && is_taken_over(d, &data, now_ns, io);
    if (at(d, AUTO) && taken_over) {
        poller->status.restarts++;
        go(d, AUTO, now_ns, io);
    } else if (at(d, AUTO)) {
        poller_expect(poller, &steps[AUTO], now_ns + auto_silence_ns(d));
    } else if (at(d, REQUEST) && data.set.angle == d->set.angle) {
        /* an answer from another angle is a late one: the one asked for is still to come */
        ping360_scan_advance(&d->scan, now_ns);
        go(d, REQUEST, now_ns, io);
    }
}

static void on_identity(struct ping360 *d, const struct ping_frame *frame, uint64_t now_ns,
                        const struct device_io *io)
{
    const bool seeking = poller_seeking(&d->talk.poller, &steps[IDENTIFY]);
    struct ping_device_information info;
    if (!ping_talk_identity(&d->talk, frame, &info))
        return;
    if (info.type == PING_TYPE_PING360) {
        ping_talk_name(&d->talk, "Ping360", &info, frame->src);
        if (seeking)
            go(d, VERSION, now_ns, io);
    } else if (seeking) {
        char why[64];
        snprintf(why, sizeof why, "the device is of type %u, not a Ping360 (2)", info.type);
        poller_timed_out(&d->talk.poller, why, io);
        poller_retry(&d->talk.poller, now_ns);
    }
}

static void on_answer(struct ping360 *d, uint16_t id, bool refused, uint64_t now_ns, const struct device_io *io)
{
    if (at(d, STOP) && id == PING360_MOTOR_OFF) {
        poller_quiet(&d->talk.poller);
    } else if (refused && at(d, AUTO) && id == PING360_AUTO_TRANSMIT) {
        d->auto_refused = true;
        start_scan(d, now_ns, io);
    } else if (refused && at(d, IDENTIFY) && (id == PING_DEVICE_INFORMATION || id == PING_GENERAL_REQUEST)) {
        go(d, VERSION, now_ns, io); /* it is there: its name is done without */
    } else if (refused && at(d, VERSION) && (id == PING_PROTOCOL_VERSION || id == PING_GENERAL_REQUEST)) {
        start_scan(d, now_ns, io);
    }
}

static void on_version(struct ping360 *d, const struct ping_frame *frame, uint64_t now_ns,
                       const struct device_io *io)
{
    uint8_t v[3];
    if (!ping_decode_protocol_version(frame, v)) {
        d->talk.poller.status.bad_frame++;
        return;
    }
    io->note(io->ctx, NOTE_DEBUG, "protocol %u.%u.%u", v[0], v[1], v[2]);
    if (at(d, VERSION))
        start_scan(d, now_ns, io);
}

/* Other messages are counted as frames; later firmware may know more than we. */
static void on_frame(void *device, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = device;
    uint16_t id;
    bool refused;
    if (frame->id == PING360_DEVICE_DATA || frame->id == PING360_AUTO_DEVICE_DATA)
        on_data(d, frame, now_ns, io);
    else if (frame->id == PING_DEVICE_INFORMATION)
        on_identity(d, frame, now_ns, io);
    else if (frame->id == PING_PROTOCOL_VERSION)
        on_version(d, frame, now_ns, io);
    else if (frame->id == PING_ASCII_TEXT)
        ping_talk_says(frame, io);
    else if (ping_talk_answered(&d->talk, frame, io, &id, &refused))
        on_answer(d, id, refused, now_ns, io);
}

/* ---- the device ---- */

static void ping360_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = state;
    ping360_track_reset(&d->track);
    takeover_forget(&d->takeover, &d->talk.poller.status);
    contest_forget(&d->contest, &d->talk.poller.status);
    d->new_turn = false;
    ping_talk_opened(&d->talk, now_ns, io);
}

static void ping360_steer(void *state, double from_rad, double to_rad, bool only)
{
    struct ping360 *d = state;
    ping360_scan_steer(&d->scan, from_rad, to_rad, only);
}

/* A request says all of its settings itself; a scan of its own is begun again with them. */
static void ping360_retune(void *state, const struct device_conf *conf, uint64_t now_ns,
                           const struct device_io *io)
{
    struct ping360 *d = state;
    const bool other_mode = conf->request_response != d->conf.request_response;
    tune(d, conf);
    if (other_mode)
        d->auto_refused = false;
    if (at(d, AUTO) || (at(d, REQUEST) && other_mode))
        start_scan(d, now_ns, io);
}

static void ping360_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping360 *d = state;
    if (at(d, BREAK))
        io->hold_break(io->ctx, false);
    poller_stop(state, now_ns, io);
}

static const struct device_key keys[] = {
    {.name = "range", .lo = 0.75, .hi = PING360_RANGE_MAX_M},
    {.name = "gain", .lo = 0, .hi = 2, .help = "0 low, 1 normal, 2 high; auto: 1"},
    {.name = "sector"},
    {.name = "step",
     .lo = 0.1,
     .hi = 180,
     .help = "0.9 is its finest; 1.8 is twice as fast, and its beams of 2 still overlap"},
    {.name = "mode"},
    {.name = "scan"},
    {.name = "circle"},
    {.name = "frequency", .lo = 500, .hi = 1000, .help = "auto: 750"},
    {.name = "amplitude"},
    {.name = "decibels_per_count"},
    {.name = "background"},
    {.name = NULL},
};

const struct device_ops device_ping360 = {
    .name = "ping360",
    .keys = keys,
    .beam_deg = {PING360_WIDE_DEG, PING360_HIGH_DEG},
    .state_size = sizeof(struct ping360),
    .max_beams = 1,
    .max_bins = PING360_SAMPLES_MAX,
    .init = ping360_init,
    .opened = ping360_opened,
    .closed = ping_talk_closed,
    .feed = ping_talk_feed,
    .tick = ping_talk_tick,
    .deadline = poller_deadline,
    .stop = ping360_stop,
    .status = ping_talk_status,
    .steer = ping360_steer,
    .retune = ping360_retune,
};
