/* SPDX-License-Identifier: MIT */
/* micron_head - the Micron's side of the protocol; see micron_head.h. */
#include "micron_head.h"

#include <stdlib.h>
#include <string.h>

#define ALIVE_NS     1000000000u
#define SOFTWARE     6
#define USER_BYTES   161
#define USER_BYTES_2 250 /* of a DST */
#define PACKET_BYTES 128
#define TYPE_PLAIN   2
#define TYPE_DST     0x11
#define USER_DST     15

static uint64_t ns_of(double s)
{
    return (uint64_t)(s * 1e9);
}

void micron_head_boot(struct micron_head *head, uint64_t now_ns)
{
    head->configured = head->told_user_data = head->scanning = false;
    head->bearing = MICRON_AHEAD;
    head->backward = false;
    head->centred_ns = now_ns + ns_of(head->conf.centring_s);
    head->alive_ns = now_ns + ALIVE_NS;
    head->ready_ns = MICRON_HEAD_NEVER;
    seanet_parser_reset(&head->parser);
}

void micron_head_init(struct micron_head *head, const struct micron_head_conf *conf,
                      const struct micron_head_io *io, uint64_t now_ns)
{
    memset(head, 0, sizeof *head);
    head->conf = *conf;
    head->io = *io;
    seanet_parser_init(&head->parser);
    micron_head_boot(head, now_ns);
}

uint64_t micron_head_deadline(const struct micron_head *head)
{
    return head->scanning ? head->ready_ns : head->alive_ns;
}

/* ---- answers ---- */

static void reply(struct micron_head *head, uint8_t id, uint8_t packet, const uint8_t *payload, size_t n,
                  uint64_t now_ns)
{
    uint8_t frame[SEANET_OVERHEAD + SEANET_DATA_AT + SEANET_DATA_MAX];
    size_t length =
        seanet_build(frame, sizeof frame, (struct seanet_head){MICRON_NODE, SEANET_HOST, id, packet}, payload, n);
    head->io.send(head->io.ctx, frame, length, now_ns);
}

static void send_alive(struct micron_head *head, uint64_t now_ns)
{
    uint8_t payload[8] = {0x80};
    seanet_put_u32(payload + 1, (uint32_t)(now_ns / 1000000u));
    seanet_put_u16(payload + 5, head->bearing);
    if (now_ns < head->centred_ns)
        payload[7] = 0x5d; /* centring, motor on, no parameters */
    else
        payload[7] =
            (uint8_t)(0x0a | (head->configured ? 0 : MICRON_NO_PARAMETERS) | (head->told_user_data ? 0x80 : 0));
    reply(head, SEANET_ALIVE, SEANET_LAST_PACKET, payload, sizeof payload, now_ns);
}

static void send_version(struct micron_head *head, uint64_t now_ns)
{
    uint8_t payload[11] = {SOFTWARE};
    seanet_put_u16(payload + 2, head->conf.serial);
    payload[10] = MICRON_NODE;
    reply(head, SEANET_VERSION_DATA, SEANET_LAST_PACKET, payload, sizeof payload, now_ns);
}

static void send_user_data(struct micron_head *head, uint64_t now_ns)
{
    uint8_t payload[USER_BYTES_2] = {0};
    if (!head->conf.plain)
        payload[6] = USER_DST;
    head->told_user_data = true;
    reply(head, SEANET_USER_DATA, SEANET_LAST_PACKET, payload, head->conf.plain ? USER_BYTES : USER_BYTES_2,
          now_ns);
}

/* ---- pings ---- */

static void step_on(struct micron_head *head)
{
    const struct micron_settings *set = &head->settings;
    unsigned span = (unsigned)(set->right + MICRON_TURN - set->left) % MICRON_TURN;
    unsigned at = (unsigned)(head->bearing + MICRON_TURN - set->left) % MICRON_TURN;
    if (set->control & MICRON_CONTINUOUS) {
        head->bearing = (uint16_t)((head->bearing + set->step) % MICRON_TURN);
        return;
    }
    if (at > span) { /* outside, after a change of the limits */
        at = 0;
        head->backward = false;
    } else if (head->backward ? at < set->step : at + set->step > span) {
        head->backward = !head->backward; /* the same bearing comes twice */
    } else {
        at = head->backward ? at - set->step : at + set->step;
    }
    head->bearing = (uint16_t)((set->left + at) % MICRON_TURN);
}

static void ping_begin(struct micron_head *head, uint64_t now_ns)
{
    unsigned before = head->bearing;
    step_on(head);
    head->scanning = true;
    head->shot.settings = head->settings;
    head->shot.bearing = head->bearing;
    if (head->faults.nibbles)
        head->shot.settings.control &= (uint16_t)~MICRON_8_BIT;
    if (head->faults.range_m > 0.0)
        micron_set_range(&head->shot.settings, head->faults.range_m, head->conf.sound_speed_mps);
    int way = abs(micron_angle_to(before, head->bearing));
    head->shot.t_ns = now_ns + ns_of(way / 16.0 * head->conf.ms_per_gradian * 1e-3);
    head->ready_ns = head->shot.t_ns + ns_of(head->conf.processing_ms * 1e-3) +
                     micron_listening_ns(head->shot.settings.interval, head->shot.settings.n_bins);
}

/* Counts to nibbles of the head's window, the nearer bin high. Bytes written. */
static size_t pack(const struct micron_settings *set, const uint8_t *samples, uint8_t *out)
{
    const int low = 8, span = 81;
    for (unsigned i = 0; i < set->n_bins; i++) {
        int v = (samples[i] - low) * 15 / span;
        uint8_t nibble = (uint8_t)(v < 0 ? 0 : v > 15 ? 15 : v);
        out[i / 2] = (uint8_t)(i & 1 ? out[i / 2] | nibble : nibble << 4);
    }
    return (set->n_bins + 1u) / 2;
}

static void ping_end(struct micron_head *head, uint64_t now_ns)
{
    uint8_t payload[SEANET_DATA_AT + SEANET_DATA_MAX] = {0}, samples[MICRON_BINS_MAX];
    const struct micron_settings *set = &head->shot.settings;
    size_t n = set->n_bins;
    head->ready_ns = MICRON_HEAD_NEVER;
    head->pings++;
    head->io.listen(head->io.ctx, &head->shot, samples);
    if (set->control & MICRON_8_BIT)
        memcpy(payload + SEANET_DATA_AT, samples, n);
    else
        n = pack(set, samples, payload + SEANET_DATA_AT);
    seanet_put_u16(payload, (unsigned)(SEANET_DATA_AT + n));
    payload[2] = head->conf.plain ? TYPE_PLAIN : TYPE_DST;
    payload[3] = 0x10;
    if (head->faults.motor_errors > 0) {
        head->faults.motor_errors--;
        payload[3] |= MICRON_STATUS_MOTOR_ERROR;
        head->scanning = false; /* shows itself again, until the next request */
        head->alive_ns = now_ns + ALIVE_NS;
    }
    seanet_put_u16(payload + 5, set->control);
    seanet_put_u16(payload + 7, set->range_dm);
    payload[13] = set->gain;
    payload[16] = 81;
    payload[17] = 8;
    seanet_put_u16(payload + 20, set->interval);
    seanet_put_u16(payload + 22, set->left);
    seanet_put_u16(payload + 24, set->right);
    payload[26] = set->step;
    seanet_put_u16(payload + 27, head->shot.bearing);
    seanet_put_u16(payload + 29, (unsigned)n);
    size_t total = SEANET_DATA_AT + n, part = head->faults.packets ? PACKET_BYTES : total;
    for (size_t at = 0, k = 0; at < total; at += part, k++) {
        bool last = at + part >= total;
        reply(head, SEANET_HEAD_DATA, (uint8_t)(k | (last ? SEANET_LAST_PACKET : 0)), payload + at,
              last ? total - at : part, now_ns);
    }
}

void micron_head_tick(struct micron_head *head, uint64_t now_ns)
{
    if (head->ready_ns <= now_ns)
        ping_end(head, now_ns);
    for (; !head->scanning && head->alive_ns <= now_ns; head->alive_ns += ALIVE_NS)
        send_alive(head, now_ns);
}

/* ---- requests ---- */

static void on_head_command(struct micron_head *head, const uint8_t *b, size_t n)
{
    if (n < 52 || (b[0] == 0x1d && n < 68))
        return;
    head->settings = (struct micron_settings){
        .control = seanet_u16(b + 1),
        .pulse_us = seanet_u16(b + 20),
        .range_dm = seanet_u16(b + 22),
        .left = seanet_u16(b + 24),
        .right = seanet_u16(b + 26),
        .gain = b[30],
        .step = b[37],
        .interval = seanet_u16(b + 38),
        .n_bins = seanet_u16(b + 40),
    };
    if (head->settings.n_bins > MICRON_BINS_MAX)
        head->settings.n_bins = MICRON_BINS_MAX;
    head->configured = true;
}

static void take_frame(struct micron_head *head, const struct seanet_frame *f, uint64_t now_ns)
{
    if (f->sender != SEANET_HOST || f->receiver != MICRON_NODE)
        return;
    head->requests++;
    if (f->id == SEANET_REBOOT)
        micron_head_boot(head, now_ns);
    else if (head->ready_ns != MICRON_HEAD_NEVER || now_ns < head->centred_ns)
        return; /* busy */
    else if (f->id == SEANET_SEND_VERSION)
        send_version(head, now_ns);
    else if (f->id == SEANET_SEND_USER_DATA)
        send_user_data(head, now_ns);
    else if (f->id == SEANET_HEAD_COMMAND)
        on_head_command(head, f->payload, f->length);
    else if (f->id == SEANET_SEND_DATA && head->configured)
        ping_begin(head, now_ns);
}

void micron_head_feed(struct micron_head *head, const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    struct seanet_frame frame;
    while (seanet_parser_next(&head->parser, &bytes, &n, now_ns, &frame))
        take_frame(head, &frame, now_ns);
}
