/* SPDX-License-Identifier: MIT */
/*
 * surveyor_device - the Cerulean Surveyor 240 multibeam sonar as a state machine: asks who is there, sends the settings
 * that make it ping, repeats them while nothing comes, and turns its points into pings of many beams. See poller.h for
 * the steps, device.h for the rules and surveyor.h for the configuration. Knows no descriptor, no clock and no grid.
 *
 *   opened -> IDENTIFY -> SETUP -> RUN      (stop: STOP)
 *               ^           |        | silence
 *               +- a wait <-+        +--> SETUP's message again, then IDENTIFY
 */
#include "surveyor.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "ping_talk.h"
#include "takeover.h"

#define MS     1000000ull
#define SECOND 1000000000ull

#define ANSWER_NS      (500 * MS)
#define SILENCE_NS     (1500 * MS)
#define REPEAT_NS      SECOND
#define STOP_NS        (250 * MS)
#define PING_MARGIN_NS (25 * MS)
#define PING_LEAST_NS  (50 * MS)
#define POWER_UP_WRAP  (1ull << 32)
#define STEPS          400
#define SLACK_MM       50 /* how exactly it takes its range is not known: this, */
#define SLACK_SHARE    20 /* and a part of the end in so many, which may be the start that it tells */

enum step { IDENTIFY, SETUP, RUN, STOP, N_STEPS };

static const struct poller_step steps[N_STEPS];

struct surveyor {
    struct ping_talk talk; /* first: see ping_talk.h */
    struct device_conf conf;
    struct surveyor_settings set;
    bool has_atof;  /* of these points came since it was opened: yz would say the same again */
    double start_m; /* that it is set to, as far as is known: 3012 does not say it */
    struct ping_count count;
    struct takeover takeover;
    struct clock_map clock; /* power_up_ms on the host's clock */
};

static bool at(const struct surveyor *d, enum step step)
{
    return d->talk.poller.step == &steps[step];
}

/* ---- configuration ---- */

static void on_frame(void *device, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io);

static bool surveyor_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    struct surveyor *d = state;
    if (!device_conf_check(&device_surveyor, conf, fault))
        return false;
    uint64_t ping_ns = (uint64_t)(2e9 * conf->range_m / conf->sound_speed_mps) + PING_MARGIN_NS;
    memset(d, 0, sizeof *d);
    d->conf = *conf;
    d->set = (struct surveyor_settings){.end_mm = (int32_t)lround(conf->range_m * 1e3),
                                        .sound_speed_mps = (float)conf->sound_speed_mps,
                                        .gain = (int16_t)conf->gain,
                                        .interval_ms =
                                            (int16_t)((ping_ns > PING_LEAST_NS ? ping_ns : PING_LEAST_NS) / MS),
                                        .atof = true,
                                        .n_steps = STEPS};
    d->talk.on_frame = on_frame;
    clock_map_init(&d->clock, POWER_UP_WRAP, MS);
    ping_parser_init(&d->talk.parser, PING_PAYLOAD_LIMIT);
    poller_init(&d->talk.poller, conf->listen_only, &steps[IDENTIFY], &steps[STOP]);
    return true;
}

/* ---- what is said ---- */

static uint64_t identify(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)device, (void)now_ns;
    ping_talk_request(PING_DEVICE_INFORMATION, io);
    return ANSWER_NS;
}

static void send_settings(const struct surveyor *d, bool ping, const struct device_io *io)
{
    uint8_t out[64];
    struct surveyor_settings set = d->set;
    set.ping = ping;
    io->send(io->ctx, out, surveyor_encode_settings(out, sizeof out, &set));
}

static uint64_t set_up(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)now_ns;
    send_settings(device, true, io);
    return ANSWER_NS;
}

static uint64_t set_up_again(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)now_ns;
    send_settings(device, true, io);
    return REPEAT_NS;
}

static uint64_t send_stop(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)now_ns;
    send_settings(device, false, io);
    return STOP_NS;
}

/* ---- what follows when nothing comes ---- */

/* One that does not tell its name may work all the same. */
static void go_set_up(void *device, uint64_t now_ns, const struct device_io *io)
{
    poller_start(device, &steps[SETUP], now_ns, io);
}

static void nobody_there(void *device, uint64_t now_ns, const struct device_io *io)
{
    const struct surveyor *d = device;
    char why[96];
    snprintf(why, sizeof why, "no answer from a Surveyor (%s)", poller_advice(&d->conf));
    poller_timed_out(device, why, io);
    poller_retry(device, now_ns);
}

static void points_missed(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct surveyor *d = device;
    takeover_forget(&d->takeover, &d->talk.poller.status);
    poller_restart(device, "the Surveyor stopped sending points", now_ns, io);
}

static void never_stopped(void *device, uint64_t now_ns, const struct device_io *io)
{
    (void)now_ns, (void)io;
    poller_quiet(device);
}

static const struct poller_step steps[N_STEPS] = {
    [IDENTIFY] = {DEVICE_IDENTIFY, .tries = 3, .ask = identify, .missed = go_set_up},
    [SETUP] = {DEVICE_SETUP, .tries = 3, .ask = set_up, .missed = nobody_there},
    [RUN] = {DEVICE_SETUP, .tries = 4, .ask = set_up_again, .missed = points_missed},
    [STOP] = {DEVICE_CLOSED, .tries = 3, .ask = send_stop, .missed = never_stopped},
};

/* ---- what comes ---- */

static void make_ping(struct surveyor *d, const struct surveyor_points *points, const struct ping_frame *frame,
                      const struct device_io *io)
{
    struct ping *ping = io->ping_begin(io->ctx);
    d->talk.poller.status.pings++;
    d->talk.poller.status.last_ping_ns = frame->t_last_ns;
    d->talk.poller.status.range_m = surveyor_end_m(points, d->conf.sound_speed_mps);
    if (!ping)
        return;
    surveyor_fill_ping(ping, frame, points, d->start_m, d->conf.sound_speed_mps);
    if (points->atof) {
        const uint64_t t_ns = clock_map_put(&d->clock, points->power_up_ms, ping->t_ns);
        ping->t_ns = clock_map_is_sure(&d->clock) ? t_ns : ping->t_ns;
    }
    io->ping_done(io->ctx, ping);
}

/* Somebody else's range, as far as the points tell theirs: 3012 has no start, and 3011 may have neither. */
static bool is_taken_over(struct surveyor *d, const struct surveyor_points *points, uint64_t now_ns,
                          const struct device_io *io)
{
    const long slack_mm = SLACK_MM + d->set.end_mm / SLACK_SHARE;
    const double end_m = surveyor_end_m(points, d->conf.sound_speed_mps);
    const struct takeover_value value[] = {
        {"end_mm", lround(end_m * 1e3), d->set.end_mm, slack_mm},
        {"start_mm", lround(points->start_m * 1e3), d->set.start_mm, slack_mm},
    };
    return end_m > 0.0 &&
           takeover_ping(&d->takeover, &d->talk.poller.status, value, points->atof ? 1 : 2, now_ns, io);
}

static void on_points(struct surveyor *d, const struct ping_frame *frame, uint64_t now_ns,
                      const struct device_io *io)
{
    struct surveyor_points points;
    if (!surveyor_decode_points(frame, &points)) {
        d->talk.poller.status.bad_frame++;
        return;
    }
    const bool taken_over = at(d, RUN) && is_taken_over(d, &points, now_ns, io);
    d->has_atof |= points.atof;
    if (!points.atof && points.end_m > 0.0)
        d->start_m = points.start_m;
    else if (!points.atof)
        points.end_m = d->conf.range_m;
    if (points.atof && d->count.known && points.ping_number < d->count.last)
        clock_map_forget(&d->clock); /* it started anew, however short its clock's way back is */
    if (points.atof ? ping_count_is_new(&d->count, points.ping_number, &d->talk.poller.status.lost_frames)
                    : !d->has_atof)
        make_ping(d, &points, frame, io);
    if (poller_pinged(&d->talk.poller))
        io->note(io->ctx, NOTE_INFO, "%s, %u points, range %.4g m",
                 d->talk.poller.status.what[0] ? d->talk.poller.status.what : "Surveyor", points.n,
                 d->talk.poller.status.range_m);
    if (taken_over) {
        d->talk.poller.status.restarts++;
        go_set_up(d, now_ns, io);
    } else if (at(d, SETUP) || at(d, RUN))
        poller_expect(&d->talk.poller, &steps[RUN], now_ns + SILENCE_NS);
}

static void on_identity(struct surveyor *d, const struct ping_frame *frame, uint64_t now_ns,
                        const struct device_io *io)
{
    const bool seeking = poller_seeking(&d->talk.poller, &steps[IDENTIFY]);
    struct ping_device_information info;
    if (!ping_talk_identity(&d->talk, frame, &info))
        return;
    if (info.type != PING_TYPE_ECHOSOUNDER && info.type != PING_TYPE_PING360) {
        ping_talk_name(&d->talk, "Surveyor", &info, frame->src);
        if (seeking)
            go_set_up(d, now_ns, io);
    } else if (seeking) {
        poller_timed_out(&d->talk.poller,
                         info.type == PING_TYPE_PING360 ? "the device is a Ping360: device = ping360?"
                                                        : "the device is an echosounder: device = ping1d?",
                         io);
        poller_retry(&d->talk.poller, now_ns);
    }
}

static void on_answer(struct surveyor *d, bool refused, uint64_t now_ns, const struct device_io *io)
{
    if (at(d, STOP)) {
        poller_quiet(&d->talk.poller);
    } else if (at(d, SETUP) && refused) {
        poller_timed_out(&d->talk.poller, "the Surveyor refuses its settings", io);
        poller_retry(&d->talk.poller, now_ns);
    } else if (at(d, SETUP)) {
        poller_expect(&d->talk.poller, &steps[RUN], now_ns + SILENCE_NS);
    }
}

/* Recordings hold what the sonar was told. It may have been another program that did so. */
static void on_settings(struct surveyor *d, const struct ping_frame *frame)
{
    struct surveyor_settings set;
    if (!surveyor_decode_settings(frame, &set))
        d->talk.poller.status.bad_frame++;
    else if (set.start_mm >= 0)
        d->start_m = set.start_mm * 1e-3;
}

/* All else, its attitude and texts wrapped in JSON among them, counts as a frame and is not looked into. */
static void on_frame(void *device, const struct ping_frame *frame, uint64_t now_ns, const struct device_io *io)
{
    struct surveyor *d = device;
    uint16_t id;
    bool refused;
    if (frame->id == SURVEYOR_ATOF_POINTS || frame->id == SURVEYOR_YZ_POINTS)
        on_points(d, frame, now_ns, io);
    else if (frame->id == PING_DEVICE_INFORMATION)
        on_identity(d, frame, now_ns, io);
    else if (frame->id == SURVEYOR_SET_PING_PARAMETERS)
        on_settings(d, frame);
    else if (ping_talk_answered(&d->talk, frame, io, &id, &refused) && id == SURVEYOR_SET_PING_PARAMETERS)
        on_answer(d, refused, now_ns, io);
}

/* ---- the device ---- */

static void surveyor_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct surveyor *d = state;
    d->has_atof = false;
    takeover_forget(&d->takeover, &d->talk.poller.status);
    d->start_m = 0.0; /* what is sent to it */
    d->count = (struct ping_count){0};
    clock_map_forget(&d->clock);
    ping_talk_opened(&d->talk, now_ns, io);
}

static void surveyor_status(const void *state, struct device_status *out)
{
    const struct surveyor *d = state;
    ping_talk_status(state, out);
    out->has_clock = d->has_atof;
    clock_map_report(&d->clock, &out->clock);
}

static const struct device_key keys[] = {
    {.name = "range", .lo = 1, .hi = 200},
    {.name = "gain", .lo = 0, .hi = 10, .help = "auto: the device chooses"},
    {.name = NULL},
};

const struct device_ops device_surveyor = {
    .name = "surveyor",
    .keys = keys,
    .state_size = sizeof(struct surveyor),
    .max_beams = SURVEYOR_POINTS_MAX,
    .max_bins = 1,
    .init = surveyor_init,
    .opened = surveyor_opened,
    .closed = ping_talk_closed,
    .feed = ping_talk_feed,
    .tick = ping_talk_tick,
    .deadline = poller_deadline,
    .stop = poller_stop,
    .status = surveyor_status,
};
