/* SPDX-License-Identifier: MIT */
#include "import_clock.h"

/*
 * Digit zero of every script; each has its ten digits in a row. Source: the Unicode character database, category
 * Nd.
 */
static const uint32_t digit_zero[] = {
    0x30,    0x660,   0x6f0,   0x7c0,   0x966,   0x9e6,   0xa66,   0xae6,   0xb66,   0xbe6,   0xc66,   0xce6,
    0xd66,   0xde6,   0xe50,   0xed0,   0xf20,   0x1040,  0x1090,  0x17e0,  0x1810,  0x1946,  0x19d0,  0x1a80,
    0x1a90,  0x1b50,  0x1bb0,  0x1c40,  0x1c50,  0xa620,  0xa8d0,  0xa900,  0xa9d0,  0xa9f0,  0xaa50,  0xabf0,
    0xff10,  0x104a0, 0x10d30, 0x11066, 0x110f0, 0x11136, 0x111d0, 0x112f0, 0x11450, 0x114d0, 0x11650, 0x116c0,
    0x11730, 0x118e0, 0x11950, 0x11c50, 0x11d50, 0x11da0, 0x11f50, 0x16a60, 0x16ac0, 0x16b50, 0x1d7ce, 0x1d7d8,
    0x1d7e2, 0x1d7ec, 0x1d7f6, 0x1e140, 0x1e2f0, 0x1e4d0, 0x1e950, 0x1fbf0,
};

static int digit_value(uint32_t c)
{
    for (size_t i = 0; i < sizeof digit_zero / sizeof digit_zero[0]; i++)
        if (c - digit_zero[i] < 10)
            return (int)(c - digit_zero[i]);
    return -1;
}

bool import_clock(const uint32_t *text, size_t n, uint64_t *t_ns)
{
    static const struct {
        unsigned digits, limit;
        uint64_t ns;
    } part[] = {{2, 24, 3600000000000u}, {2, 60, 60000000000u}, {2, 60, 1000000000u}, {3, 1000, 1000000u}};
    uint64_t t = 0;
    size_t at = 0;
    for (size_t k = 0; k < 4; k++) {
        unsigned value = 0;
        if (k > 0 && (at == n || digit_value(text[at++]) >= 0))
            return false; /* no separator */
        for (unsigned i = 0; i < part[k].digits; i++) {
            int digit = at < n ? digit_value(text[at++]) : -1;
            if (digit < 0)
                return false;
            value = 10 * value + (unsigned)digit;
        }
        if (value >= part[k].limit)
            return false;
        t += value * part[k].ns;
    }
    *t_ns = t;
    return at == n;
}
