/* SPDX-License-Identifier: MIT */
/*
 * dronecan_device - a range sensor on DroneCAN as a device: hears its Measurement messages and makes pings of the
 * valid ones. Sends nothing, so it needs no node id of its own. "Too far" is a ping without an echo. "Too close"
 * is none at all: there is something, nearer than can be told, and the water before it must not be called free.
 */
#include "dronecan.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "receiver.h"

#define PATIENCE_NS      3000000000ull /* a node that is alive says so every second */
#define APERTURE_DEFAULT (10.0 * GEO_PI / 180.0)

struct dronecan {
    struct receiver receiver; /* first: see receiver.h */
    struct dronecan_receiver transfers;
    bool other_told, several_told;
};

static bool dronecan_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    struct dronecan *d = state;
    if (!device_conf_check(&device_dronecan, conf, fault))
        return false;
    memset(d, 0, sizeof *d);
    receiver_init(&d->receiver, conf, "DroneCAN range sensor", PATIENCE_NS);
    dronecan_receiver_init(&d->transfers, DRONECAN_MEASUREMENT_SIGNATURE);
    return true;
}

/* Broadcast messages of this type: 16 bits of type above the bit that marks a service. */
static struct can_match dronecan_can_match(const void *state)
{
    const struct dronecan *d = state;
    const uint32_t flags = CAN_EFF_FLAG | CAN_RTR_FLAG;
    const int node = d->receiver.conf.node;
    struct can_match match = {CAN_EFF_FLAG | DRONECAN_MEASUREMENT_TYPE << 8, flags | 0xFFFF80u};
    if (node > 0) {
        match.id |= (uint32_t)node;
        match.mask |= 0x7F;
    }
    return match;
}

static void dronecan_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct dronecan *d = state;
    dronecan_receiver_reset(&d->transfers);
    receiver_opened(state, now_ns, io);
}

static void on_measurement(struct dronecan *d, const struct dronecan_measurement *m, uint64_t now_ns,
                           const struct device_io *io)
{
    const double fov = m->field_of_view_rad;
    struct receiver_range range = {.resolution_m = m->resolution_m,
                                   .aperture_rad = fov > 0.001 && fov < GEO_PI ? fov : APERTURE_DEFAULT};
    if (m->reading_type == DRONECAN_READING_VALID) {
        if (!(m->range_m > 0 && isfinite(m->range_m))) {
            d->receiver.status.bad_frame++;
            return;
        }
        range.range_m = m->range_m;
        receiver_ping(&d->receiver, &range, now_ns, io);
    } else {
        range.unheard = m->reading_type != DRONECAN_READING_TOO_FAR; /* too close, or undefined */
        receiver_ping(&d->receiver, &range, now_ns, io);
    }
}

/* Two sensors have two places and two directions, and only one is configured. */
static bool is_believed(struct dronecan *d, unsigned node, unsigned sensor, uint64_t now_ns,
                        const struct device_io *io)
{
    const unsigned talker = node << 8 | sensor;
    if (receiver_hears(&d->receiver, talker, now_ns))
        return true;
    if (!d->several_told)
        io->note(
            io->ctx, NOTE_WARNING,
            "ranges come from sensor %u of node %u and from sensor %u of node %u; the latter are not used; set "
            "node and sensor_id",
            d->receiver.talker & 0xFF, d->receiver.talker >> 8, sensor, node);
    d->several_told = true;
    return false;
}

static void on_transfer(struct dronecan *d, const struct dronecan_transfer *t, uint64_t now_ns,
                        const struct device_io *io)
{
    struct receiver *l = &d->receiver;
    struct dronecan_measurement m;
    if (!dronecan_decode_measurement(t->payload, t->n, &m)) {
        l->status.bad_frame++;
        return;
    }
    l->status.lost_frames += t->missed;
    if (l->conf.sensor_id >= 0 && m.sensor_id != l->conf.sensor_id)
        return;
    if (m.sensor_type != DRONECAN_SENSOR_SONAR && m.sensor_type != DRONECAN_SENSOR_UNDEFINED) {
        if (!d->other_told)
            io->note(io->ctx, NOTE_WARNING, "sensor %u of node %u is no sonar: not used", m.sensor_id, t->node);
        d->other_told = true;
        return;
    }
    if (!is_believed(d, t->node, m.sensor_id, now_ns, io))
        return;
    snprintf(l->status.what, sizeof l->status.what, "DroneCAN node %u sensor %u", t->node, m.sensor_id);
    receiver_heard(l, now_ns, io);
    on_measurement(d, &m, now_ns, io);
}

static void dronecan_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct dronecan *d = state;
    struct device_status *status = &d->receiver.status;
    struct dronecan_transfer transfer;
    struct canfd_frame frame;
    if (!can_frame_read(bytes, n, &frame)) {
        status->garbage_bytes += n;
        return;
    }
    if (!can_frame_is_data(&frame) || !can_frame_matches(&frame, dronecan_can_match(d)))
        return;
    switch (dronecan_receive(&d->transfers, &frame, now_ns, &transfer)) {
    case DRONECAN_WHOLE:
        on_transfer(d, &transfer, now_ns, io);
        break;
    case DRONECAN_BAD_CRC:
        status->bad_checksum++;
        break;
    case DRONECAN_BAD:
        status->bad_frame++;
        break;
    case DRONECAN_STRAY:
        status->garbage_bytes += frame.len;
        break;
    case DRONECAN_MORE:
    case DRONECAN_DUPLICATE:
        break;
    }
}

static const struct device_key keys[] = {
    {.name = "node", .lo = 1, .hi = DRONECAN_NODES - 1},
    {.name = "sensor_id"},
    {.name = "delay", .help = "auto: 0.4 0.4 s, assumed"},
    {.name = NULL},
};

const struct device_ops device_dronecan = {
    .name = "dronecan",
    .keys = keys,
    .delay = {.s = 0.4, .uncertain_s = 0.4, .assumed = true},
    .state_size = sizeof(struct dronecan),
    .max_beams = 1,
    .max_bins = 1,
    .round = true,
    .axial = true,
    .listens = true,
    .init = dronecan_init,
    .opened = dronecan_opened,
    .closed = receiver_closed,
    .feed = dronecan_feed,
    .tick = receiver_tick,
    .deadline = receiver_deadline,
    .stop = receiver_stop,
    .status = receiver_status,
    .can_match = dronecan_can_match,
};
