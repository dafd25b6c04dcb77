/* SPDX-License-Identifier: MIT */
/*
 * nmea0183_device - an echosounder that sends NMEA 0183 as a device: hears DPT and DBT and makes pings of the depths.
 * Sends nothing. Of the configuration it takes range, which `status` tells. A sentence needs its checksum.
 *
 * The depth is the range below the transducer, as measured. DPT's offset to water line or keel is not added: where the
 * transducer sits is configured. A depth that is missing, zero or negative is a ping that cannot tell: it does not say
 * that the water is free.
 *
 * One measurement often comes as DPT and as DBT, and displays and multiplexers repeat it under their own name, some
 * without ever having a depth. So one sentence of one talker is used at a time: the first that has a depth, for as long
 * as it comes. Evidence must not count twice.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/nmea/nmea0183.h"
#include "receiver.h"

#define PATIENCE_NS  5000000000ull /* it is sent every second or two */
#define TALKER_CHARS 2

/* The message tells neither. Transducers have 10 to 45 degrees, many of them a fan: water outside the narrowest was
 * perhaps not looked at. What lies nearer than half a metre is lost in the ringing of many. */
#define APERTURE_DEG 10.0
#define NEAREST_M    0.5

struct nmea0183 {
    struct receiver receiver; /* first: see receiver.h */
    struct nmea_parser parser;
    char used[6];       /* the sentence whose depths are taken, "SDDPT"; empty: none yet */
    uint64_t t_used_ns; /* when it came last, with a depth or without */
    char also[6];       /* one of another talker that has depths as well; empty: none */
    bool no_checksum_told;
};

static bool nmea0183_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    struct nmea0183 *d = state;
    (void)fault;
    memset(d, 0, sizeof *d);
    receiver_init(&d->receiver, conf, "NMEA 0183 echosounder", PATIENCE_NS);
    nmea_parser_init(&d->parser, true);
    return true;
}

/* "NMEA 0183 SDDPT, 0.500 m below the water line (depths also in IIDPT)" */
static void describe_value(struct nmea0183 *d, const struct nmea_value *value)
{
    char *what = d->receiver.status.what;
    const size_t room = sizeof d->receiver.status.what;
    int n = snprintf(what, room, "NMEA 0183 %s", value->name);
    if (value->offset_m != 0)
        n += snprintf(what + n, room - (size_t)n, ", %.3f m %s", fabs(value->offset_m),
                      value->offset_m > 0 ? "below the water line" : "above the keel");
    if (d->also[0])
        snprintf(what + n, room - (size_t)n, " (depths also in %s)", d->also);
}

/* The same talker says the same twice; another may be another transducer. */
static void tell_other(struct nmea0183 *d, const struct nmea_value *value, const struct device_io *io)
{
    if (d->also[0] || strncmp(value->name, d->used, TALKER_CHARS) == 0)
        return;
    memcpy(d->also, value->name, sizeof d->also);
    io->note(io->ctx, NOTE_WARNING, "depths come in %s and in %s; only those in %s are used", d->used, d->also,
             d->used);
}

static void on_depth(struct nmea0183 *d, const struct nmea_value *value, uint64_t now_ns,
                     const struct device_io *io)
{
    const bool heard = value->has == NMEA_DEPTH && value->below_m > 0;
    const bool any = d->used[0] && now_ns - d->t_used_ns <= PATIENCE_NS;
    const bool ours = any && strcmp(value->name, d->used) == 0;
    const struct receiver_range range = {.range_m = heard ? value->below_m : 0,
                                         .range_min_m = NEAREST_M,
                                         .resolution_m = 0.1,
                                         .aperture_rad = geo_rad(APERTURE_DEG),
                                         .unheard = !heard};
    if (any && !ours) {
        if (heard)
            tell_other(d, value, io);
        return;
    }
    if (heard && !ours) {
        memcpy(d->used, value->name, sizeof d->used);
        d->also[0] = '\0';
    }
    if (heard || ours)
        d->t_used_ns = now_ns;
    describe_value(d, value);
    receiver_heard(&d->receiver, now_ns, io);
    receiver_ping(&d->receiver, &range, now_ns, io);
}

/* While no depth comes, `what` names what comes in its place. */
static void tell_unused(struct nmea0183 *d, const struct device_io *io)
{
    struct receiver *l = &d->receiver;
    const struct nmea_counts *counts = &d->parser.counts;
    if (!l->heard && d->parser.other[0])
        snprintf(l->status.what, sizeof l->status.what, "NMEA 0183 %s, no depth", d->parser.other);
    if (counts->no_checksum > 0 && !d->no_checksum_told) {
        d->no_checksum_told = true;
        io->note(io->ctx, NOTE_WARNING,
                 "sentences without a checksum are not used; switch it on in the echosounder");
    }
}

static void count(struct nmea0183 *d)
{
    const struct nmea_counts *counts = &d->parser.counts;
    struct device_status *status = &d->receiver.status;
    status->frames = counts->sentences;
    status->garbage_bytes = counts->garbage_bytes;
    status->bad_checksum = counts->bad_checksum;
    status->bad_frame = counts->bad_sentence + counts->overlong;
}

static void nmea0183_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct nmea0183 *d = state;
    struct nmea_value value;
    while (nmea_parser_next(&d->parser, &bytes, &n, &value))
        if (value.has == NMEA_DEPTH || value.has == NMEA_NO_DEPTH)
            on_depth(d, &value, now_ns, io);
    tell_unused(d, io);
    count(d);
}

static void nmea0183_closed(void *state, uint64_t now_ns)
{
    struct nmea0183 *d = state;
    d->receiver.status.cut_bytes += d->parser.inside ? d->parser.n + 1 : 0; /* and the $ */
    nmea_parser_reset(&d->parser);
    receiver_closed(state, now_ns);
}

static const struct device_key keys[] = {
    {.name = "delay", .help = "auto: 1 1 s, assumed"},
    {.name = NULL},
};

const struct device_ops device_nmea0183 = {
    .name = "nmea0183",
    .keys = keys,
    .delay = {.s = 1, .uncertain_s = 1, .assumed = true},
    .beam_deg = {APERTURE_DEG, APERTURE_DEG},
    .state_size = sizeof(struct nmea0183),
    .max_beams = 1,
    .max_bins = 1,
    .round = true,
    .axial = true,
    .listens = true,
    .init = nmea0183_init,
    .opened = receiver_opened,
    .closed = nmea0183_closed,
    .feed = nmea0183_feed,
    .tick = receiver_tick,
    .deadline = receiver_deadline,
    .stop = receiver_stop,
    .status = receiver_status,
};
