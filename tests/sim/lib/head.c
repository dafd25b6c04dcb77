/* SPDX-License-Identifier: MIT */
/* head - the Ping360's side of the protocol; see head.h. */
#include "head.h"

#include <stdlib.h>
#include <string.h>

#define MESSAGE_SET_DEVICE_ID 2000
#define MESSAGE_RESET         2600

static const struct ping360_settings boot_settings = {
    .mode = 1, .gain = 0, .transmit_us = 32, .sample_period = 80, .frequency_khz = 740, .n_samples = 1024};

static uint64_t ns_of(double s)
{
    return (uint64_t)(s * 1e9);
}

void head_boot(struct head *head)
{
    head->settings = head->wanted = boot_settings;
    head->lag_left = 0;
    head->configured = false;
    head->awake = !head->conf.strict_autobaud;
    head->automatic = false;
    head->angle = 0;
    head->phase = HEAD_IDLE;
    head->due_ns = HEAD_NEVER;
    ping_parser_reset(&head->parser);
}

void head_init(struct head *head, const struct head_conf *conf, const struct head_io *io)
{
    memset(head, 0, sizeof *head);
    head->conf = *conf;
    head->io = *io;
    ping_parser_init(&head->parser, PING_PAYLOAD_MAX);
    head_boot(head);
}

uint64_t head_deadline(const struct head *head)
{
    return head->due_ns;
}

/* ---- answers ---- */

static uint64_t reply(struct head *head, uint16_t id, const void *payload, size_t n, uint64_t now_ns)
{
    uint8_t frame[PING_FRAME_MAX];
    size_t length = ping_frame_build(frame, sizeof frame, id, head->conf.id, payload, n);
    return head->io.send(head->io.ctx, frame, length, now_ns);
}

static void ack(struct head *head, uint16_t id, uint64_t now_ns)
{
    const uint8_t payload[2] = {(uint8_t)id, (uint8_t)(id >> 8)};
    reply(head, PING_ACK, payload, sizeof payload, now_ns);
}

static void nack(struct head *head, uint16_t id, const char *why, uint64_t now_ns)
{
    uint8_t payload[64] = {(uint8_t)id, (uint8_t)(id >> 8)};
    size_t n = strnlen(why, sizeof payload - 2);
    memcpy(payload + 2, why, n);
    head->counts.nacks++;
    reply(head, PING_NACK, payload, 2 + n, now_ns);
}

/* samples: NULL for settings without data. */
static uint64_t send_data(struct head *head, bool automatic, const struct ping360_settings *settings,
                          const uint8_t *samples, uint64_t now_ns)
{
    uint8_t frame[PING_FRAME_MAX];
    const struct ping360_data data = {
        .set = *settings,
        .automatic = automatic,
        .sweep = head->sweep,
        .data_length = samples ? settings->n_samples : 0,
        .n_data = samples ? settings->n_samples : 0,
        .data = samples,
    };
    size_t n = ping360_encode_data(frame, sizeof frame, head->conf.id, &data);
    return head->io.send(head->io.ctx, frame, n, now_ns);
}

/* ---- pings ---- */

static void ping_begin(struct head *head, uint16_t angle, bool transmits, uint64_t now_ns)
{
    const int way = abs((int)angle - (int)head->angle);
    const int shorter = way < HEAD_TURN - way ? way : HEAD_TURN - way;
    if (head->lag_left > 0)
        head->lag_left--;
    else
        head->settings = head->wanted;
    head->angle = angle;
    head->transmits = transmits;
    head->shot.settings = head->settings;
    head->shot.settings.angle = angle;
    if (head->forced_range_m > 0.0)
        ping360_set_range(&head->shot.settings, head->forced_range_m, head->conf.sound_speed_mps,
                          PING360_SAMPLES_MAX);
    head->shot.t_ns = now_ns + ns_of(shorter * head->conf.ms_per_gradian * 1e-3);
    head->due_ns = head->shot.t_ns;
    if (transmits)
        head->due_ns += ping360_listening_ns(&head->shot.settings) + ns_of(head->conf.processing_ms * 1e-3);
    head->phase = HEAD_LISTENING;
}

static void ping_end(struct head *head, uint64_t now_ns)
{
    uint8_t samples[PING360_SAMPLES_MAX];
    head->phase = HEAD_IDLE;
    head->due_ns = HEAD_NEVER;
    if (!head->transmits) {
        send_data(head, false, &head->shot.settings, NULL, now_ns);
        return;
    }
    head->counts.pings++;
    head->io.listen(head->io.ctx, &head->shot, samples);
    uint64_t left_ns = send_data(head, head->automatic, &head->shot.settings, samples, now_ns);
    if (head->automatic) {
        head->phase = HEAD_PAUSE;
        head->due_ns = left_ns + head->sweep.delay_ms * 1000000u;
    }
}

/* ---- auto-transmit ---- */

static bool sweep_equal(const struct ping360_sweep *a, const struct ping360_sweep *b)
{
    return a->start == b->start && a->stop == b->stop && a->step == b->step && a->delay_ms == b->delay_ms;
}

/* The sweep that was asked for last begins at its start. */
static void sweep_take(struct head *head)
{
    head->sweep = head->next_sweep;
    head->position = 0;
    head->direction = 1;
}

/* The next position; a full circle goes on, a sector turns back without repeating its end. A changed sector waits
 * for the end. */
static void sweep_advance(struct head *head)
{
    const struct ping360_sweep *sweep = &head->sweep;
    const bool circle = sweep->start == 0 && sweep->stop == HEAD_TURN - 1;
    const int span = (sweep->stop - sweep->start + HEAD_TURN) % HEAD_TURN;
    const int next = head->position + head->direction * sweep->step;
    if (next >= 0 && next <= span) {
        head->position = next;
    } else if (!sweep_equal(sweep, &head->next_sweep)) {
        sweep_take(head);
    } else if (circle) {
        head->position = next % HEAD_TURN;
    } else {
        head->direction = -head->direction;
        if (sweep->step <= span)
            head->position += head->direction * sweep->step;
    }
}

static void sweep_ping(struct head *head, uint64_t now_ns)
{
    ping_begin(head, (uint16_t)((head->sweep.start + head->position) % HEAD_TURN), true, now_ns);
}

void head_tick(struct head *head, uint64_t now_ns)
{
    while (head->due_ns <= now_ns) {
        if (head->phase == HEAD_LISTENING) {
            ping_end(head, now_ns);
        } else {
            sweep_advance(head);
            sweep_ping(head, now_ns);
        }
    }
}

/* ---- requests ---- */

static uint16_t get_u16(const uint8_t *b)
{
    return (uint16_t)(b[0] | (unsigned)b[1] << 8);
}

/* NULL when the head can do that. */
static const char *settings_fault(const struct ping360_settings *s)
{
    if (s->mode != 1)
        return "mode out of range";
    if (s->gain > 2)
        return "gain out of range";
    if (s->angle >= HEAD_TURN)
        return "angle out of range";
    if (s->transmit_us < 1 || s->transmit_us > 1000)
        return "transmit duration out of range";
    if (s->sample_period < 80 || s->sample_period > 40000)
        return "sample period out of range";
    if (s->frequency_khz < 500 || s->frequency_khz > 1000)
        return "transmit frequency out of range";
    if (s->n_samples < 200 || s->n_samples > PING360_SAMPLES_MAX)
        return "number of samples out of range";
    return NULL;
}

static const char *sweep_fault(const struct ping360_sweep *s)
{
    if (s->start >= HEAD_TURN || s->stop >= HEAD_TURN)
        return "angle out of range";
    if (s->step < 1 || s->step > 10)
        return "number of steps out of range";
    if (s->delay_ms > 100)
        return "delay out of range";
    return NULL;
}

static bool settings_equal(const struct ping360_settings *a, const struct ping360_settings *b)
{
    return a->mode == b->mode && a->gain == b->gain && a->transmit_us == b->transmit_us &&
           a->sample_period == b->sample_period && a->frequency_khz == b->frequency_khz &&
           a->n_samples == b->n_samples;
}

/* The first settings count at once, changes after some pings. */
static void settings_take(struct head *head, const struct ping360_settings *settings)
{
    if (head->configured && !settings_equal(settings, &head->wanted))
        head->lag_left = head->conf.lag;
    head->wanted = *settings;
    head->configured = true;
}

static void on_general_request(struct head *head, const struct ping_frame *f, uint64_t now_ns)
{
    const uint8_t information[6] = {2, 0, 3, head->conf.old_firmware ? 1 : 3, head->conf.old_firmware ? 0 : 8, 0};
    const uint8_t version[4] = {1, 0, 0, 0};
    struct ping360_settings settings = head->settings;
    switch (get_u16(f->payload)) {
    case PING_DEVICE_INFORMATION:
        reply(head, PING_DEVICE_INFORMATION, information, sizeof information, now_ns);
        break;
    case PING_PROTOCOL_VERSION:
        reply(head, PING_PROTOCOL_VERSION, version, sizeof version, now_ns);
        break;
    case PING360_DEVICE_DATA:
        settings.angle = head->angle;
        send_data(head, false, &settings, NULL, now_ns);
        break;
    default:
        nack(head, get_u16(f->payload), "unknown message", now_ns);
    }
}

/* A single ping ends auto-transmit. */
static void on_transducer(struct head *head, const struct ping_frame *f, uint64_t now_ns)
{
    const uint8_t *b = f->payload;
    const struct ping360_settings settings = {
        .mode = b[0],
        .gain = b[1],
        .angle = get_u16(b + 2),
        .transmit_us = get_u16(b + 4),
        .sample_period = get_u16(b + 6),
        .frequency_khz = get_u16(b + 8),
        .n_samples = get_u16(b + 10),
    };
    const char *fault = settings_fault(&settings);
    if (fault != NULL) {
        nack(head, f->id, fault, now_ns);
        return;
    }
    head->automatic = false;
    settings_take(head, &settings);
    ping_begin(head, settings.angle, b[12] != 0, now_ns);
}

static void on_auto_transmit(struct head *head, const struct ping_frame *f, uint64_t now_ns)
{
    const uint8_t *b = f->payload;
    const struct ping360_settings settings = {
        .mode = b[0],
        .gain = b[1],
        .transmit_us = get_u16(b + 2),
        .sample_period = get_u16(b + 4),
        .frequency_khz = get_u16(b + 6),
        .n_samples = get_u16(b + 8),
    };
    const struct ping360_sweep sweep = {get_u16(b + 10), get_u16(b + 12), b[14], b[15]};
    const char *fault = settings_fault(&settings);
    if (fault == NULL)
        fault = sweep_fault(&sweep);
    if (fault != NULL) {
        nack(head, f->id, fault, now_ns);
        return;
    }
    settings_take(head, &settings);
    head->next_sweep = sweep;
    if (!head->automatic) {
        head->automatic = true;
        sweep_take(head);
        sweep_ping(head, now_ns);
    }
}

static void on_motor_off(struct head *head, const struct ping_frame *f, uint64_t now_ns)
{
    head->automatic = false;
    head->phase = HEAD_IDLE;
    head->due_ns = HEAD_NEVER;
    ack(head, f->id, now_ns);
}

static void on_reset(struct head *head, const struct ping_frame *f, uint64_t now_ns)
{
    (void)f;
    (void)now_ns;
    head_boot(head);
}

static void on_set_device_id(struct head *head, const struct ping_frame *f, uint64_t now_ns)
{
    if (f->payload[0] < 1 || f->payload[0] > 254) {
        nack(head, f->id, "device id out of range", now_ns);
        return;
    }
    head->conf.id = f->payload[0];
    ack(head, f->id, now_ns);
}

static const struct request {
    uint16_t id, length; /* shortest payload */
    bool new_firmware;   /* not known by the old one */
    bool settings;       /* refused by the fault nack_next */
    void (*take)(struct head *head, const struct ping_frame *f, uint64_t now_ns);
} requests[] = {
    {PING_GENERAL_REQUEST, 2, false, false, on_general_request},
    {PING360_TRANSDUCER, 14, false, true, on_transducer},
    {PING360_AUTO_TRANSMIT, 16, true, true, on_auto_transmit},
    {PING360_MOTOR_OFF, 0, true, false, on_motor_off},
    {MESSAGE_RESET, 2, false, false, on_reset},
    {MESSAGE_SET_DEVICE_ID, 2, false, false, on_set_device_id},
};

static const struct request *request_find(const struct head *head, uint16_t id)
{
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        if (requests[i].id == id && !(requests[i].new_firmware && head->conf.old_firmware))
            return &requests[i];
    }
    return NULL;
}

static void take_frame(struct head *head, const struct ping_frame *f, uint64_t now_ns)
{
    const struct request *request = request_find(head, f->id);
    const bool addressed = f->dst == head->conf.id || f->dst == 255 || (f->dst == 0 && f->src == 0);
    if (!addressed)
        return;
    head->counts.requests++;
    if (request == NULL) {
        nack(head, f->id, "unknown message", now_ns);
    } else if (f->length < request->length) {
        nack(head, f->id, "message too short", now_ns);
    } else if (request->settings && head->nack_next > 0) {
        head->nack_next--;
        nack(head, f->id, "busy", now_ns);
    } else {
        request->take(head, f, now_ns);
    }
}

void head_feed(struct head *head, const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    struct ping_frame frame;
    if (!head->awake) {
        const uint8_t *u = memchr(bytes, 'U', n);
        if (u == NULL)
            return;
        head->awake = true;
        n -= (size_t)(u - bytes);
        bytes = u;
    }
    while (ping_parser_next(&head->parser, &bytes, &n, now_ns, &frame))
        take_frame(head, &frame, now_ns);
}
