/* SPDX-License-Identifier: MIT */
#include "readable.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* Bytes that a character with this first byte has; 0: it is none. */
static size_t length_by_first(unsigned char first)
{
    return first < 0x80 ? 1 : first < 0xc2 ? 0 : first < 0xe0 ? 2 : first < 0xf0 ? 3 : first < 0xf5 ? 4 : 0;
}

/* How many bytes of the n that the character should have go on with it. */
static size_t length_present(const unsigned char *s, size_t n)
{
    size_t present = 1;
    while (present < n && (s[present] & 0xc0) == 0x80)
        present++;
    return present;
}

size_t readable_length(const char *text)
{
    const unsigned char *s = (const unsigned char *)text;
    const size_t n = length_by_first(*s);
    if (n == 1)
        return *s >= 0x20 && *s != 0x7f;
    if (n == 0 || length_present(s, n) < n)
        return 0;
    uint32_t code = s[0] & (0xffu >> (n + 1));
    for (size_t i = 1; i < n; i++)
        code = code << 6 | (s[i] & 0x3fu);
    const bool overlong = code < 0x80 || (n == 3 && code < 0x800) || (n == 4 && code < 0x10000);
    const bool control = code < 0xa0 || code == 0x2028 || code == 0x2029; /* these two break lines */
    return overlong || control || (code >= 0xd800 && code < 0xe000) || code > 0x10ffff ? 0 : n;
}

void readable(char *text)
{
    char *s = text;
    while (*s) {
        const size_t n = readable_length(s), wanted = length_by_first((unsigned char)*s);
        if (n == 0 && wanted > 1) {
            const size_t present = length_present((const unsigned char *)s, wanted);
            if (present < wanted && s[present] == '\0') {
                *s = '\0';
                return;
            }
        }
        if (n == 0)
            *s = '?';
        s += n ? n : 1;
    }
}
