/* SPDX-License-Identifier: MIT */
/*
 * nmea2000_device - an NMEA 2000 depth transducer as a device: hears Water Depth (PGN 128267), which fits one frame,
 * and makes pings of it. Sends nothing, so it claims no address. Of the configuration it takes:
 *
 *   node    source address of the transducer, 0 .. 251; -1: any
 *   range   how far it hears, where the message does not say so
 *
 * The depth is the range below the transducer. The offset to water line or keel in the message is not added: where the
 * transducer sits is configured. A depth that is "not available" is no ping: it does not say that the water is free.
 *
 * Displays repeat the message without ever having a depth, and there may be a second transducer. So one address is used
 * at a time: the first that has a depth, until it has been silent.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/ports/can_frame.h"
#include "receiver.h"

#define PGN_WATER_DEPTH 128267u
#define DEPTH_BYTES     8
#define ADDRESS_MAX     251
#define ADDRESSES       256           /* that a frame can hold */
#define PATIENCE_NS     5000000000ull /* it is sent every second */

/* Of usual through-hull transducers; the message does not tell. */
#define APERTURE_DEG 20.0

/* The two largest numbers are "out of range" and "not available"; one less is reserved. */
#define DEPTH_GOOD_MAX  0xFFFFFFFCu
#define RANGE_GOOD_MAX  0xFCu
#define OFFSET_GOOD_MAX 0x7FFC

struct talker {
    bool short_told;   /* that its frames are too short */
    bool several_told; /* that it has depths as well, and is not used */
};

struct nmea2000 {
    struct receiver receiver; /* first: see receiver.h */
    struct talker talker[ADDRESSES];
    int also; /* an address whose depths are not used, beside the one whose are; -1: none */
};

static bool nmea2000_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    struct nmea2000 *d = state;
    if (!device_conf_check(&device_nmea2000, conf, fault))
        return false;
    d->also = -1;
    receiver_init(&d->receiver, conf, "NMEA 2000 depth transducer", PATIENCE_NS);
    return true;
}

/* The group's number without regard to priority, and the source when it is configured. */
static struct can_match nmea2000_can_match(const void *state)
{
    const struct nmea2000 *d = state;
    const int node = d->receiver.conf.node;
    struct can_match match = {CAN_EFF_FLAG | PGN_WATER_DEPTH << 8, CAN_EFF_FLAG | CAN_RTR_FLAG | 0x03FFFF00u};
    if (node >= 0) {
        match.id |= (uint32_t)node;
        match.mask |= 0xFF;
    }
    return match;
}

/* `also`: another address that has depths, or has had them: -1: none. */
static void describe_source(struct receiver *l, unsigned source, int also, int16_t offset_mm)
{
    char *what = l->status.what;
    const size_t room = sizeof l->status.what;
    int n = snprintf(what, room, "NMEA 2000 address %u", source);
    if (also >= 0)
        n += snprintf(what + n, room - (size_t)n, " (depths also from %d)", also);
    /* -1 mm is sent by devices that mean "not available" and say so with the wrong number. */
    if (offset_mm <= OFFSET_GOOD_MAX && offset_mm != 0 && offset_mm != -1)
        snprintf(what + n, room - (size_t)n, ", %.3f m %s", fabs(offset_mm * 1e-3),
                 offset_mm > 0 ? "below the water line" : "above the keel");
}

static void tell_several(struct nmea2000 *d, unsigned source, const struct device_io *io)
{
    d->also = (int)source;
    if (d->talker[source].several_told)
        return;
    d->talker[source].several_told = true;
    io->note(io->ctx, NOTE_WARNING,
             "depths come from NMEA 2000 addresses %u and %u; those of %u are not used; set node to one of them",
             d->receiver.talker, source, source);
}

/* One that says "not available" holds nobody's place: displays do so all the time. */
static bool is_believed(struct nmea2000 *d, unsigned source, bool heard, uint64_t now_ns,
                        const struct device_io *io)
{
    unsigned held;
    const bool talks = receiver_talks(&d->receiver, now_ns, &held);
    if (!talks || held == source)
        d->also = talks ? d->also : -1;
    else if (!heard)
        return false;
    if (!heard && !talks)
        return true;
    if (receiver_hears(&d->receiver, source, now_ns))
        return true;
    tell_several(d, source, io);
    return false;
}

static void on_depth(struct nmea2000 *d, const struct canfd_frame *frame, uint64_t now_ns,
                     const struct device_io *io)
{
    const uint8_t *b = frame->data;
    const unsigned source = frame->can_id & 0xFF;
    const uint32_t depth = b[1] | (uint32_t)b[2] << 8 | (uint32_t)b[3] << 16 | (uint32_t)b[4] << 24;
    const bool heard = depth > 0 && depth <= DEPTH_GOOD_MAX; /* else "not available" */
    const struct receiver_range range = {.range_m = heard ? depth * 0.01 : 0,
                                         .unheard = !heard,
                                         .range_max_m = b[7] <= RANGE_GOOD_MAX ? b[7] * 10.0 : 0,
                                         .resolution_m = 0.01,
                                         .aperture_rad = geo_rad(APERTURE_DEG)};
    if (!is_believed(d, source, heard, now_ns, io))
        return;
    describe_source(&d->receiver, source, d->also, (int16_t)(b[5] | b[6] << 8));
    receiver_heard(&d->receiver, now_ns, io);
    receiver_ping(&d->receiver, &range, now_ns, io);
}

/* Some instruments leave the last byte out. They are named once, and in `what` while nothing better comes. */
static void on_short(struct nmea2000 *d, const struct canfd_frame *frame, const struct device_io *io)
{
    struct receiver *l = &d->receiver;
    const unsigned source = frame->can_id & 0xFF;
    l->status.bad_frame++;
    if (!l->heard)
        snprintf(l->status.what, sizeof l->status.what, "NMEA 2000 address %u: depths of %u bytes not used",
                 source, frame->len);
    if (!d->talker[source].short_told)
        io->note(io->ctx, NOTE_WARNING, "NMEA 2000 address %u sends depths of %u bytes, not %d; they are not used",
                 source, frame->len, DEPTH_BYTES);
    d->talker[source].short_told = true;
}

static void nmea2000_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct nmea2000 *d = state;
    struct canfd_frame frame;
    if (!can_frame_read(bytes, n, &frame))
        d->receiver.status.garbage_bytes += n;
    else if (!can_frame_is_data(&frame) || !can_frame_matches(&frame, nmea2000_can_match(d)))
        return;
    else if (n != CAN_MTU || frame.len != DEPTH_BYTES)
        on_short(d, &frame, io);
    else
        on_depth(d, &frame, now_ns, io);
}

static const struct device_key keys[] = {
    {.name = "node", .lo = 0, .hi = ADDRESS_MAX},
    {.name = "delay", .help = "auto: 0.5 0.5 s, assumed"},
    {.name = NULL},
};

const struct device_ops device_nmea2000 = {
    .name = "nmea2000",
    .keys = keys,
    .delay = {.s = 0.5, .uncertain_s = 0.5, .assumed = true},
    .beam_deg = {APERTURE_DEG, APERTURE_DEG},
    .state_size = sizeof(struct nmea2000),
    .max_beams = 1,
    .max_bins = 1,
    .round = true,
    .axial = true,
    .listens = true,
    .init = nmea2000_init,
    .opened = receiver_opened,
    .closed = receiver_closed,
    .feed = nmea2000_feed,
    .tick = receiver_tick,
    .deadline = receiver_deadline,
    .stop = receiver_stop,
    .status = receiver_status,
    .can_match = nmea2000_can_match,
};
