/* SPDX-License-Identifier: MIT */
#include "mavlink_frame.h"

#include <string.h>

#define MAGIC_1     0xFE
#define MAGIC_2     0xFD
#define HEADER_1    6u
#define HEADER_2    10u
#define CRC_BYTES   2u
#define FLAG_SIGNED 0x01
#define CRC_START   0xFFFF
#define PEEK_FLAGS  3u /* bytes after which a frame's length is known */

uint16_t mavlink_crc(const void *bytes, size_t n, uint16_t crc)
{
    const uint8_t *from = bytes;
    while (n-- > 0) {
        crc ^= *from++;
        for (int bit = 0; bit < 8; bit++)
            crc = (uint16_t)(crc & 1 ? crc >> 1 ^ 0x8408 : crc >> 1);
    }
    return crc;
}

static uint16_t frame_crc(const uint8_t *frame, size_t n, uint8_t crc_extra)
{
    return mavlink_crc(&crc_extra, 1, mavlink_crc(frame + 1, n - 1, CRC_START));
}

/* What the bytes held are: too few to tell, so that `size` are needed; a frame, or one to pass over, of `size`. */
enum verdict { MORE, FRAME, SKIP, GARBAGE };

/* A frame of an id we know, whole: n bytes without a signature. */
static enum verdict judge(struct mavlink_parser *parser, const struct mavlink_message *message, size_t header,
                          size_t n, bool is_signed, struct mavlink_frame *out)
{
    const uint8_t *b = parser->held;
    const uint16_t crc = frame_crc(b, n - CRC_BYTES, message->crc_extra);
    const bool two = b[0] == MAGIC_2;
    if (b[n - 2] != (crc & 0xFF) || b[n - 1] != crc >> 8) {
        parser->counters.bad_crc++;
        return GARBAGE;
    }
    if (parser->signing && !(is_signed && mavlink_signature_holds(parser->signing, b, n))) {
        parser->counters.bad_signature++;
        return SKIP;
    }
    *out = (struct mavlink_frame){.message = message,
                                  .version = two ? 2 : 1,
                                  .sequence = b[two ? 4 : 2],
                                  .system_id = b[two ? 5 : 3],
                                  .component_id = b[two ? 6 : 4],
                                  .size = b[1]};
    memcpy(out->payload, b + header, b[1]);
    parser->counters.frames++;
    return FRAME;
}

static enum verdict examine(struct mavlink_parser *parser, size_t *size, struct mavlink_frame *out)
{
    const uint8_t *b = parser->held;
    const bool two = b[0] == MAGIC_2;
    const struct mavlink_message *message;
    size_t header = two ? HEADER_2 : HEADER_1, n;
    bool is_signed;
    *size = PEEK_FLAGS;
    if (parser->n_held > 0 && !two && b[0] != MAGIC_1)
        return GARBAGE;
    if (parser->n_held < *size)
        return MORE;
    if (two && (b[2] & ~FLAG_SIGNED)) {
        parser->counters.bad_flags++;
        return GARBAGE;
    }
    is_signed = two && (b[2] & FLAG_SIGNED);
    n = header + b[1] + CRC_BYTES;
    *size = n + (is_signed ? MAVLINK_SIGNATURE_BYTES : 0);
    if (parser->n_held < *size)
        return MORE;
    message = mavlink_message(two ? b[7] | (uint32_t)b[8] << 8 | (uint32_t)b[9] << 16 : b[5]);
    if (message)
        return judge(parser, message, header, n, is_signed, out);
    if (parser->searching)
        return GARBAGE;
    if (parser->n_held == *size) {
        ++*size;
        return MORE;
    }
    if (b[*size] != MAGIC_1 && b[*size] != MAGIC_2)
        return GARBAGE;
    parser->counters.unknown++;
    return SKIP;
}

static void drop_bytes(struct mavlink_parser *parser, size_t n)
{
    parser->searching = false;
    parser->n_held -= n;
    memmove(parser->held, parser->held + n, parser->n_held);
}

/* At least one byte, up to the next that may begin a frame. */
static void drop_garbage(struct mavlink_parser *parser)
{
    size_t n = 1;
    while (n < parser->n_held && parser->held[n] != MAGIC_1 && parser->held[n] != MAGIC_2)
        n++;
    parser->counters.garbage_bytes += n;
    drop_bytes(parser, n);
    parser->searching = true;
}

bool mavlink_parser_next(struct mavlink_parser *parser, const uint8_t **bytes, size_t *n,
                         struct mavlink_frame *out)
{
    for (;;) {
        size_t size;
        switch (examine(parser, &size, out)) {
        case FRAME:
            drop_bytes(parser, size);
            return true;
        case SKIP:
            drop_bytes(parser, size);
            break;
        case GARBAGE:
            drop_garbage(parser);
            break;
        case MORE: {
            const size_t want = size - parser->n_held, k = want < *n ? want : *n;

            if (k == 0)
                return false;
            memcpy(parser->held + parser->n_held, *bytes, k);
            parser->n_held += k;
            *bytes += k;
            *n -= k;
        }
        }
    }
}

void mavlink_parser_restart(struct mavlink_parser *parser)
{
    parser->counters.garbage_bytes += parser->n_held;
    parser->n_held = 0;
    parser->searching = false;
}

size_t mavlink_build(struct mavlink_sender *sender, const struct mavlink_message *message, const void *content,
                     uint8_t out[MAVLINK_FRAME_MAX])
{
    size_t size = message->size, n;
    uint16_t crc;
    mavlink_pack(message, content, out + HEADER_2);
    while (size > 1 && out[HEADER_2 + size - 1] == 0)
        size--;
    out[0] = MAGIC_2;
    out[1] = (uint8_t)size;
    out[2] = sender->signing ? FLAG_SIGNED : 0;
    out[3] = 0;
    out[4] = sender->sequence++;
    out[5] = sender->system_id;
    out[6] = sender->component_id;
    for (unsigned i = 0; i < 3; i++)
        out[7 + i] = (uint8_t)(message->id >> (8 * i));
    n = HEADER_2 + size;
    crc = frame_crc(out, n, message->crc_extra);
    out[n++] = (uint8_t)crc;
    out[n++] = (uint8_t)(crc >> 8);
    if (sender->signing) {
        mavlink_sign(sender->signing, out, n);
        n += MAVLINK_SIGNATURE_BYTES;
    }
    return n;
}
