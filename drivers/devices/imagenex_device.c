/* SPDX-License-Identifier: MIT */
/*
 * imagenex_device - Imagenex 852 echosounder (fixed) and 881A scanning head as one state machine: asks for a ping,
 * waits for the reply, asks for the next. Every request carries all settings, so there is nothing to set up, and
 * nothing to stop: a head that is not asked is silent. See poller.h for the steps
 * and device.h for the rules. Of the configuration it takes:
 *
 *   range      the head's next longer one: 5 10 20 30 40 50 m (852), also 1 2 3 4 60 80 100 m (881A), at 1500 m/s
 *   gain       0..40 dB; -1: 6 dB (852), 20 dB (881A)
 *   frequency  881A: 280..1100 kHz in steps of 5, 0: 675 kHz. 852: 0, it has one
 *   sector     881A: rounded to 3 degrees
 *   step       881A: the nearest of 0.3, 0.6, 0.9, 1.2, 2.4 degrees
 *
 *   opened -> PING, answered: PING again; silence: a wait, and PING again      (stop: quiet)
 */
#include "poller.h"
#include "takeover.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "imagenex_frame.h"
#include "drivers/ports/line_time.h"

#define MS     1000000ull
#define SECOND 1000000000ull

#define HEAD_SOUND_SPEED 1500.0 /* by which heads turn time into metres */
#define POINTS           500u
#define POINTS_CODE      50
#define ABSORPTION       20 /* 0.20 dB/m, for 675 kHz */
#define POSITION_TURN    1200u
#define POSITION_AHEAD   600u

#define ANSWER_LEAST_NS (250 * MS)
#define MARGIN_NS       (100 * MS) /* on top of line and listening: the head's own work, a USB adapter */
#define QUIET_NS        (40 * MS) /* adapters hold bytes back up to 16 ms; a frame that paused longer was cut off */

/* Beams at half power. */
#define WIDE_852_DEG  10.0
#define WIDE_881A_DEG 2.4
#define HIGH_881A_DEG 22.0

struct model {
    const char *name;
    const struct device_ops *ops;
    uint8_t head, head_last; /* ids that such heads may have; the first is asked */
    uint8_t default_gain_db;
    bool scans;
    uint8_t pulse_unit_us;
    uint8_t ranges_m[16]; /* ascending, 0 at the end */
    double az_aperture_deg, el_aperture_deg;
};

static const struct model model_852 = {
    .name = "Imagenex 852",
    .ops = &device_imagenex852,
    .head = 0x11,
    .head_last = 0x15,
    .default_gain_db = 6,
    .pulse_unit_us = 1,
    .ranges_m = {5, 10, 20, 30, 40, 50},
    .az_aperture_deg = WIDE_852_DEG,
    .el_aperture_deg = WIDE_852_DEG,
};

static const struct model model_881a = {
    .name = "Imagenex 881A",
    .ops = &device_imagenex881a,
    .head = 0x10,
    .head_last = 0x10,
    .default_gain_db = 20,
    .scans = true,
    .pulse_unit_us = 10,
    .ranges_m = {1, 2, 3, 4, 5, 10, 20, 30, 40, 50, 60, 80, 100},
    .az_aperture_deg = WIDE_881A_DEG,
    .el_aperture_deg = HIGH_881A_DEG,
};

static const struct poller_step ping_step;

struct imagenex {
    struct poller poller; /* first: see poller.h */
    const struct model *model;
    struct device_conf conf;
    struct imagenex_switch request;
    struct takeover takeover;
    bool other_told;   /* that another head speaks */
    bool follows;      /* there was a ping since the port was opened ... */
    uint16_t position; /* ... the last one from here ... */
    bool clockwise;    /* ... and where the head was going */
    struct imagenex_parser parser;
};

/* ---- how long things take ---- */

/* Pulse lengths by range, as drivers of the 881A send them. */
static unsigned pulse_us(unsigned range_m)
{
    static const struct {
        unsigned range_m, us;
    } row[] = {{4, 20}, {10, 60}, {20, 100}, {30, 160}, {40, 220}, {50, 260}, {60, 320}, {80, 420}, {100, 540}};
    size_t i = 0;
    while (i + 1 < sizeof row / sizeof row[0] && range_m > row[i].range_m)
        i++;
    return row[i].us;
}

static uint64_t listening_ns(unsigned range_m)
{
    return (uint64_t)(2.0 * range_m / HEAD_SOUND_SPEED * 1e9);
}

static uint64_t answer_ns(const struct imagenex *d)
{
    const uint64_t ns = poller_line_ns(&d->conf, IMAGENEX_SWITCH_BYTES + IMAGENEX_OVERHEAD + POINTS) +
                        listening_ns(d->request.range_m) + MARGIN_NS;
    return ns > ANSWER_LEAST_NS ? ns : ANSWER_LEAST_NS;
}

/* ---- configuration ---- */

static uint8_t choose_range(const struct model *m, double range_m)
{
    for (const uint8_t *r = m->ranges_m; *r; r++)
        if (range_m <= *r)
            return *r;
    return 0;
}

/* In units of 0.3 degrees; 0: too wide. */
static uint8_t choose_step(double step_rad)
{
    static const uint8_t steps[] = {1, 2, 3, 4, 8};
    const double wanted = geo_deg(step_rad) / 0.3;
    uint8_t best = 1;
    for (size_t i = 0; i < sizeof steps; i++)
        if (fabs(steps[i] - wanted) < fabs(best - wanted))
            best = steps[i];
    return best;
}

static void set_sector(struct imagenex_switch *s, double start_rad, double end_rad)
{
    const double width_rad = geo_wrap(end_rad - start_rad);
    s->train = 60;
    s->sector = 120;
    if (width_rad == 0.0)
        return; /* equal ends: the full circle */
    s->train = (uint8_t)lround((geo_deg(geo_wrap_pi(start_rad + width_rad / 2.0)) + 180.0) / 3.0);
    s->sector = (uint8_t)fmax(1.0, round(geo_deg(width_rad) / 3.0));
}

static void tune(struct imagenex *d, const struct device_conf *conf)
{
    const uint8_t range_m = choose_range(d->model, conf->range_m);
    d->conf = *conf;
    d->request.range_m = range_m;
    d->request.gain_db = (uint8_t)(conf->gain < 0 ? d->model->default_gain_db : conf->gain);
    d->request.pulse = (uint8_t)fmin(255.0, (double)pulse_us(range_m) / d->model->pulse_unit_us);
}

static bool init(struct imagenex *d, const struct model *m, const struct device_conf *conf, struct fault *fault)
{
    if (!device_conf_check(m->ops, conf, fault))
        return false;
    memset(d, 0, sizeof *d);
    d->model = m;
    poller_init(&d->poller, conf->listen_only, &ping_step, NULL);
    d->request = (struct imagenex_switch){.head = m->head, .absorption = ABSORPTION, .points = POINTS_CODE};
    tune(d, conf);
    if (m->scans) {
        const double khz = conf->frequency_hz != 0.0 ? conf->frequency_hz / 1e3 : 675.0;
        set_sector(&d->request, conf->sector_start_rad, conf->sector_end_rad);
        d->request.step = choose_step(conf->step_rad);
        d->request.bits = 8;
        d->request.baud_code = 6;
        d->request.frequency = (uint8_t)lround((khz - 675.0) / 5.0 + 100.0);
    }
    return true;
}

static bool init_852(void *state, const struct device_conf *conf, struct fault *fault)
{
    return init(state, &model_852, conf, fault);
}

static bool init_881a(void *state, const struct device_conf *conf, struct fault *fault)
{
    return init(state, &model_881a, conf, fault);
}

/* ---- asking ---- */

static uint64_t send_switch(void *device, uint64_t now_ns, const struct device_io *io)
{
    const struct imagenex *d = device;
    uint8_t out[IMAGENEX_SWITCH_BYTES];
    (void)now_ns;
    if (d->poller.silent && d->poller.tries > 1)
        return POLLER_GIVE_UP; /* until the next wait is over */
    imagenex_encode_switch(&d->request, out);
    io->send(io->ctx, out, sizeof out);
    return answer_ns(d);
}

static void replies_missed(void *device, uint64_t now_ns, const struct device_io *io)
{
    struct imagenex *d = device;
    char why[96];
    snprintf(why, sizeof why, "no answer from an %s (%s)", d->model->name, poller_advice(&d->conf));
    poller_timed_out(&d->poller, why, io);
    poller_retry(&d->poller, now_ns);
}

static const struct poller_step ping_step = {DEVICE_IDENTIFY, .tries = 5, .per_ping = true, .ask = send_switch,
                                             .missed = replies_missed};

/* ---- replies ---- */

/* 852: centimetres; 881A: 2 mm when it listens less than 5 m far, else centimetres. */
static double profile_m(const struct imagenex *d, const struct imagenex_frame *f)
{
    return f->profile * (d->model->scans && f->range_m < 5 ? 0.002 : 0.01);
}

/* The 852 counts to 127: its full scale is made that of a byte, by which saturation is known. */
static void copy_samples(const struct imagenex *d, const struct imagenex_frame *f, uint8_t *out, uint32_t n)
{
    const uint8_t full_scale = d->model->scans ? 255 : 127;
    for (uint32_t i = 0; i < n; i++)
        out[i] = f->data[i] < full_scale ? f->data[i] : 255;
}

static void fill_ping(const struct imagenex *d, const struct imagenex_frame *f, struct ping *ping)
{
    const double scale = d->conf.sound_speed_mps / HEAD_SOUND_SPEED;
    const double pulse_m = d->conf.sound_speed_mps * pulse_us(f->range_m) * 1e-6 / 2.0;
    ping->t_ns = transmitted_ns(f->t_first_ns, f->t_last_ns, IMAGENEX_OVERHEAD + (size_t)f->n_data, d->conf.baud,
                                listening_ns(f->range_m));
    ping->t_in_ns = f->t_last_ns;
    ping->n_beams = 1;
    ping->pulse_m = (float)pulse_m;
    ping->az_aperture_rad = (float)geo_rad(d->model->az_aperture_deg);
    ping->el_aperture_rad = (float)geo_rad(d->model->el_aperture_deg);
    ping->beam[0] = (struct ping_beam){.az_rad = 0.0f};
    if (d->model->scans) {
        ping->head_units = f->position % POSITION_TURN;
        ping->head_turn = POSITION_TURN;
        ping->beam[0].az_rad = (float)geo_wrap(geo_rad(0.3 * ((double)f->position - POSITION_AHEAD)));
    }
    if (f->n_points == 0) {
        ping->kind = PING_RANGES;
        ping->n_bins = 1;
        ping->dr_m = (float)(f->range_m * scale);
        ping->beam[0].range_m = (float)(profile_m(d, f) * scale);
        ping->beam[0].range_sd_m = (float)pulse_m;
        ping->beam[0].confidence = 0.5f;
        return;
    }
    ping->kind = PING_PROFILE;
    ping->sample_bytes = 1;
    ping->law = AMPLITUDE_LINEAR;
    ping->n_bins = f->n_points < ping->max_samples ? f->n_points : ping->max_samples;
    ping->dr_m = (float)(f->range_m * scale / f->n_points);
    copy_samples(d, f, ping->samples, ping->n_bins);
}

/* A turn ends where the head turns back, or goes through its zero. */
static bool new_turn(struct imagenex *d, const struct imagenex_frame *f)
{
    const unsigned way = f->position > d->position ? f->position - d->position : d->position - f->position;
    const bool turned = d->follows && (f->clockwise != d->clockwise || way > POSITION_TURN / 2);
    d->position = f->position;
    d->clockwise = f->clockwise;
    d->follows = true;
    return d->model->scans && turned;
}

static void make_ping(struct imagenex *d, const struct imagenex_frame *f, const struct device_io *io)
{
    const bool turn = new_turn(d, f);
    d->poller.status.pings++;
    d->poller.status.last_ping_ns = f->t_last_ns;
    d->poller.status.range_m = f->range_m * d->conf.sound_speed_mps / HEAD_SOUND_SPEED;
    struct ping *ping = io->ping_begin(io->ctx);
    if (!ping)
        return;
    fill_ping(d, f, ping);
    ping->flags = turn ? PING_NEW_TURN : 0;
    io->ping_done(io->ctx, ping);
}

/* Is it from a head that was asked or, where none is asked, from one of this model? */
static bool is_ours(const struct imagenex *d, const struct imagenex_frame *f)
{
    const struct model *m = d->model;
    return f->head == d->request.head ||
           (poller_listening(&d->poller) && f->head >= m->head && f->head <= m->head_last);
}

static void on_other_head(struct imagenex *d, const struct imagenex_frame *f, const struct device_io *io)
{
    d->poller.status.bad_frame++;
    if (!d->other_told)
        io->note(io->ctx, NOTE_WARNING, "head 0x%02x answers, not 0x%02x of an %s: not used", f->head,
                 d->request.head, d->model->name);
    d->other_told = true;
}

/* The range is all that a reply says of its settings. The next request has ours in any case. */
static void compare(struct imagenex *d, const struct imagenex_frame *f, uint64_t now_ns,
                    const struct device_io *io)
{
    const struct takeover_value range = {"range", f->range_m, d->request.range_m, 0};
    if (!poller_listening(&d->poller))
        takeover_ping(&d->takeover, &d->poller.status, &range, 1, now_ns, io);
}

static void on_reply(struct imagenex *d, const struct imagenex_frame *f, uint64_t now_ns,
                     const struct device_io *io)
{
    if (!is_ours(d, f)) {
        on_other_head(d, f, io);
        return;
    }
    /* Samples of 4 and 16 bits are never asked for, and how they are packed is not known. */
    if (f->range_m == 0 || f->n_data != f->n_points || (d->model->scans && f->position > POSITION_TURN)) {
        d->poller.status.bad_frame++;
        return;
    }
    if (!(f->status & IMAGENEX_ACCEPTED))
        d->poller.status.nacks++; /* with the next request they come again */
    make_ping(d, f, io);
    snprintf(d->poller.status.what, sizeof d->poller.status.what, "%s head 0x%02x", d->model->name, f->head);
    if (poller_pinged(&d->poller))
        io->note(io->ctx, NOTE_INFO, "%s, range %.4g m", d->poller.status.what, d->poller.status.range_m);
    compare(d, f, now_ns, io);
    if (poller_seeking(&d->poller, &ping_step))
        poller_start(&d->poller, &ping_step, now_ns, io);
}

/* ---- the device ---- */

static void imagenex_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct imagenex *d = state;
    struct imagenex_frame frame;
    size_t strange = n;
    while (imagenex_parser_next(&d->parser, &bytes, &n, now_ns, &frame)) {
        d->poller.strange = 0;
        on_reply(d, &frame, now_ns, io);
        strange = n;
    }
    d->poller.strange += strange;
}

static void imagenex_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct imagenex *d = state;
    imagenex_parser_reset(&d->parser);
    d->follows = false;
    takeover_forget(&d->takeover, &d->poller.status);
    poller_opened(&d->poller, now_ns, io);
}

static void imagenex_closed(void *state, uint64_t now_ns)
{
    struct imagenex *d = state;
    (void)now_ns;
    imagenex_parser_reset(&d->parser);
    poller_closed(&d->poller);
}

static void imagenex_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct imagenex *d = state;
    if (!poller_is_due(&d->poller, now_ns))
        return;
    /* The reply may be there, behind a false or broken beginning that waits for more bytes. */
    imagenex_parser_give_up(&d->parser, now_ns > QUIET_NS ? now_ns - QUIET_NS : 0);
    imagenex_feed(d, NULL, 0, now_ns, io);
    poller_tick(&d->poller, now_ns, io);
}

/* Every request says all of its settings. */
static void imagenex_retune(void *state, const struct device_conf *conf, uint64_t now_ns,
                            const struct device_io *io)
{
    (void)now_ns, (void)io;
    tune(state, conf);
}

static void imagenex_status(const void *state, struct device_status *out)
{
    const struct imagenex *d = state;
    *out = d->poller.status;
    out->state = poller_state(&d->poller);
    out->frames = d->parser.frames;
    out->garbage_bytes = d->parser.garbage_bytes;
    out->cut_bytes = d->parser.cut_bytes;
    out->bad_frame += d->parser.bad_end;
}

static const struct device_key keys_852[] = {
    {.name = "range", .lo = 0.75, .hi = 50},
    {.name = "gain", .lo = 0, .hi = 40, .help = "dB; auto: 6"},
    {.name = "amplitude"},
    {.name = "decibels_per_count"},
    {.name = "background"},
    {.name = NULL},
};

static const struct device_key keys_881a[] = {
    {.name = "range", .lo = 0.75, .hi = 100},
    {.name = "gain", .lo = 0, .hi = 40, .help = "dB; auto: 20"},
    {.name = "sector"},
    {.name = "step", .lo = 0.1, .hi = 2.7, .help = "0.3, 0.6, 0.9, 1.2 or 2.4, whichever is nearest"},
    {.name = "frequency", .lo = 280, .hi = 1100, .help = "auto: 675"},
    {.name = "amplitude"},
    {.name = "decibels_per_count"},
    {.name = "background"},
    {.name = NULL},
};

#define IMAGENEX_OPS(its_name, its_keys, its_init, its_axial, wide_deg, high_deg)                                 \
    {                                                                                                             \
        .name = (its_name), .keys = (its_keys), .state_size = sizeof(struct imagenex), .max_beams = 1,            \
        .max_bins = POINTS, .axial = (its_axial), .beam_deg = {(wide_deg), (high_deg)}, .init = (its_init),       \
        .opened = imagenex_opened, .closed = imagenex_closed, .feed = imagenex_feed, .tick = imagenex_tick,       \
        .deadline = poller_deadline, .stop = poller_stop, .status = imagenex_status, .retune = imagenex_retune,   \
    }

const struct device_ops device_imagenex852 =
    IMAGENEX_OPS("imagenex852", keys_852, init_852, true, WIDE_852_DEG, WIDE_852_DEG);
const struct device_ops device_imagenex881a =
    IMAGENEX_OPS("imagenex881a", keys_881a, init_881a, false, WIDE_881A_DEG, HIGH_881A_DEG);
