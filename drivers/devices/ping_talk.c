/* SPDX-License-Identifier: MIT */
/*
 * ping_talk - see ping_talk.h.
 */
#include "ping_talk.h"

#include <stdio.h>

#define QUIET_NS 40000000ull /* adapters hold bytes back up to 16 ms; a frame that paused longer was cut off */
#define TEXT_MAX 81

void ping_talk_opened(struct ping_talk *t, uint64_t now_ns, const struct device_io *io)
{
    ping_parser_reset(&t->parser);
    poller_opened(&t->poller, now_ns, io);
}

void ping_talk_request(uint16_t id, const struct device_io *io)
{
    uint8_t out[PING_OVERHEAD + 2];
    io->send(io->ctx, out, ping_encode_request(out, sizeof out, id));
}

bool ping_talk_identity(struct ping_talk *t, const struct ping_frame *frame, struct ping_device_information *out)
{
    const bool good = ping_decode_device_information(frame, out);
    t->poller.status.bad_frame += !good;
    return good;
}

void ping_talk_name(struct ping_talk *t, const char *name, const struct ping_device_information *info, uint8_t id)
{
    struct device_status *s = &t->poller.status;
    snprintf(s->what, sizeof s->what, "%s fw %u.%u.%u id %u", name, info->firmware[0], info->firmware[1],
             info->firmware[2], id);
}

bool ping_talk_answered(struct ping_talk *t, const struct ping_frame *frame, const struct device_io *io,
                        uint16_t *id, bool *refused)
{
    const char *text;
    size_t n;
    char shown[TEXT_MAX];
    *refused = frame->id == PING_NACK;
    if (!*refused && frame->id != PING_ACK)
        return false;
    if (*refused ? !ping_decode_nack(frame, id, &text, &n) : !ping_decode_ack(frame, id)) {
        t->poller.status.bad_frame++;
        return false;
    }
    if (*refused) {
        t->poller.status.nacks++;
        io->note(io->ctx, NOTE_INFO, "refused message %u: %s", *id, ping_text(shown, sizeof shown, text, n));
    }
    return true;
}

void ping_talk_says(const struct ping_frame *frame, const struct device_io *io)
{
    char shown[TEXT_MAX];
    io->note(io->ctx, NOTE_INFO, "says: %s",
             ping_text(shown, sizeof shown, (const char *)frame->payload, frame->length));
}

void ping_talk_closed(void *state, uint64_t now_ns)
{
    struct ping_talk *t = state;
    (void)now_ns;
    ping_parser_reset(&t->parser);
    poller_closed(&t->poller);
}

void ping_talk_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    struct ping_talk *t = state;
    struct ping_frame frame;
    size_t strange = n;
    while (ping_parser_next(&t->parser, &bytes, &n, now_ns, &frame)) {
        t->poller.strange = 0;
        t->on_frame(t, &frame, now_ns, io);
        strange = n;
    }
    t->poller.strange += strange;
}

void ping_talk_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct ping_talk *t = state;
    if (!poller_is_due(&t->poller, now_ns))
        return;
    /* The answer may be there, behind a false or broken beginning that waits for more bytes. */
    ping_parser_give_up(&t->parser, now_ns > QUIET_NS ? now_ns - QUIET_NS : 0);
    ping_talk_feed(t, NULL, 0, now_ns, io);
    poller_tick(&t->poller, now_ns, io);
}

void ping_talk_status(const void *state, struct device_status *out)
{
    const struct ping_talk *t = state;
    *out = t->poller.status;
    out->state = poller_state(&t->poller);
    out->frames = t->parser.frames;
    out->garbage_bytes = t->parser.garbage_bytes;
    out->cut_bytes = t->parser.cut_bytes;
    out->bad_checksum = t->parser.bad_checksum;
}
