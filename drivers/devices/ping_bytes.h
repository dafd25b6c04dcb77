/* SPDX-License-Identifier: MIT */
/*
 * ping_bytes - the numbers inside Ping protocol messages: little-endian, unaligned. Lengths are the caller's business.
 */
#ifndef SONARD_PING_BYTES_H
#define SONARD_PING_BYTES_H

#include <stdint.h>
#include <string.h>

static inline uint16_t get_u16(const uint8_t *b)
{
    return (uint16_t)(b[0] | (unsigned)b[1] << 8);
}

static inline uint32_t get_u32(const uint8_t *b)
{
    return get_u16(b) | (uint32_t)get_u16(b + 2) << 16;
}

/* IEEE 754, as every CPU that runs Linux has it. */
static inline float get_f32(const uint8_t *b)
{
    uint32_t bits = get_u32(b);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static inline void put_u16(uint8_t *b, unsigned v)
{
    b[0] = (uint8_t)v;
    b[1] = (uint8_t)(v >> 8);
}

static inline void put_u32(uint8_t *b, uint32_t v)
{
    put_u16(b, v & 0xffff);
    put_u16(b + 2, v >> 16);
}

static inline void put_f32(uint8_t *b, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_u32(b, bits);
}

#endif
