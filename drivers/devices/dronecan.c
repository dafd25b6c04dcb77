/* SPDX-License-Identifier: MIT */
#include "dronecan.h"

#include <math.h>
#include <string.h>

#define TAIL_START    0x80u
#define TAIL_END      0x40u
#define TAIL_TOGGLE   0x20u
#define TAIL_TRANSFER 0x1Fu

/* ---- transfers ---- */

uint16_t dronecan_crc(uint16_t crc, const uint8_t *bytes, size_t n)
{
    while (n--) {
        crc = (uint16_t)(crc ^ *bytes++ << 8);
        for (int bit = 0; bit < 8; bit++)
            crc = (uint16_t)(crc & 0x8000 ? crc << 1 ^ 0x1021 : crc << 1);
    }
    return crc;
}

void dronecan_receiver_init(struct dronecan_receiver *r, uint64_t signature)
{
    memset(r, 0, sizeof *r);
    r->signature = signature;
}

void dronecan_receiver_reset(struct dronecan_receiver *r)
{
    dronecan_receiver_init(r, r->signature);
}

static bool append(struct dronecan_partial *p, const uint8_t *bytes, size_t n)
{
    if (n > sizeof p->payload - p->n)
        return false;
    memcpy(p->payload + p->n, bytes, n);
    p->n += n;
    return true;
}

static bool crc_good(const struct dronecan_receiver *r, const struct dronecan_partial *p)
{
    uint8_t signature[8];
    for (int i = 0; i < 8; i++)
        signature[i] = (uint8_t)(r->signature >> 8 * i);
    return dronecan_crc(dronecan_crc(0xFFFF, signature, 8), p->payload, p->n) == p->crc;
}

/* The first frame: of several it begins with the checksum of them all. */
static enum dronecan_result begin_transfer(struct dronecan_partial *p, const uint8_t *bytes, size_t n,
                                           uint8_t tail, uint64_t now_ns)
{
    uint8_t transfer = tail & TAIL_TRANSFER;
    p->active = false;
    if (tail & TAIL_TOGGLE)
        return DRONECAN_STRAY;
    if (p->known && p->last_transfer == transfer && now_ns - p->last_ns < DRONECAN_TIMEOUT_NS)
        return DRONECAN_DUPLICATE;
    p->n = 0;
    p->transfer = transfer;
    p->toggle = true;
    p->first_ns = now_ns;
    if (tail & TAIL_END)
        return append(p, bytes, n) ? DRONECAN_WHOLE : DRONECAN_BAD;
    if (n < 2)
        return DRONECAN_BAD;
    p->crc = (uint16_t)(bytes[0] | bytes[1] << 8);
    p->active = append(p, bytes + 2, n - 2);
    return p->active ? DRONECAN_MORE : DRONECAN_BAD;
}

static enum dronecan_result go_on(const struct dronecan_receiver *r, struct dronecan_partial *p,
                                  const uint8_t *bytes, size_t n, uint8_t tail, uint64_t now_ns)
{
    bool fits = p->active && p->transfer == (tail & TAIL_TRANSFER) && p->toggle == !!(tail & TAIL_TOGGLE) &&
                now_ns - p->first_ns < DRONECAN_TIMEOUT_NS;
    p->active = false;
    if (!fits)
        return DRONECAN_STRAY;
    if (!append(p, bytes, n))
        return DRONECAN_BAD;
    if (tail & TAIL_END)
        return crc_good(r, p) ? DRONECAN_WHOLE : DRONECAN_BAD_CRC;
    p->active = true;
    p->toggle = !p->toggle;
    return DRONECAN_MORE;
}

enum dronecan_result dronecan_receive(struct dronecan_receiver *r, const struct canfd_frame *frame,
                                      uint64_t now_ns, struct dronecan_transfer *out)
{
    uint8_t node = frame->can_id & 0x7F;
    struct dronecan_partial *p = &r->node[node];
    if (frame->len == 0 || node == 0) /* an anonymous node has no address yet, and never a sensor's data */
        return DRONECAN_BAD;
    size_t n = frame->len - 1u;
    uint8_t tail = frame->data[n];
    enum dronecan_result result = tail & TAIL_START ? begin_transfer(p, frame->data, n, tail, now_ns)
                                                    : go_on(r, p, frame->data, n, tail, now_ns);
    if (result != DRONECAN_WHOLE)
        return result;
    bool follows = p->known && now_ns - p->last_ns < DRONECAN_TIMEOUT_NS;
    *out = (struct dronecan_transfer){
        .node = node,
        .missed = follows ? (uint8_t)((p->transfer - p->last_transfer - 1u) & TAIL_TRANSFER) : 0,
        .first_ns = p->first_ns,
        .payload = p->payload,
        .n = p->n,
    };
    p->known = true;
    p->last_transfer = p->transfer;
    p->last_ns = now_ns;
    return DRONECAN_WHOLE;
}

/* ---- Measurement ---- */

/* IEEE 754 half precision; *step is the distance to the next number, for finite ones. */
static double float16(const uint8_t *b, double *step)
{
    unsigned bits = b[0] | (unsigned)b[1] << 8, fraction = bits & 0x3FF;
    int exponent = (int)(bits >> 10 & 0x1F);
    double sign = bits & 0x8000 ? -1 : 1;
    *step = ldexp(1, (exponent > 0 ? exponent : 1) - 25);
    if (exponent == 31)
        return fraction ? (double)NAN : sign * (double)INFINITY;
    return sign * *step * (exponent > 0 ? fraction + 1024 : fraction);
}

bool dronecan_decode_measurement(const uint8_t *payload, size_t n, struct dronecan_measurement *out)
{
    double ignored;
    if (n < DRONECAN_MEASUREMENT_BYTES)
        return false;
    *out = (struct dronecan_measurement){.sensor_id = payload[7],
                                         .field_of_view_rad = float16(payload + 10, &ignored),
                                         .sensor_type = payload[12] >> 3,
                                         .reading_type = payload[12] & 7};
    for (int i = 0; i < 7; i++)
        out->timestamp_us |= (uint64_t)payload[i] << 8 * i;
    out->range_m = float16(payload + 13, &out->resolution_m);
    return true;
}
