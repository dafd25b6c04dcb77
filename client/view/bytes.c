/* SPDX-License-Identifier: MIT */
#include "bytes.h"

#include <stdlib.h>
#include <string.h>

#define ROOM_LEAST 256

static bool reserve(struct bytes *bytes, size_t n)
{
    if (bytes->failed)
        return false;
    if (n <= bytes->room - bytes->size)
        return true;

    size_t room = bytes->room ? bytes->room : ROOM_LEAST;

    while (room - bytes->size < n)
        room *= 2;
    uint8_t *data = realloc(bytes->data, room);

    bytes->failed = !data;
    if (data) {
        bytes->data = data;
        bytes->room = room;
    }
    return data != NULL;
}

void bytes_put(struct bytes *bytes, const void *data, size_t n)
{
    if (n == 0 || !reserve(bytes, n))
        return;
    memcpy(bytes->data + bytes->size, data, n);
    bytes->size += n;
}

void bytes_number(struct bytes *bytes, uint64_t number, int n)
{
    uint8_t little[8];
    for (int i = 0; i < n; i++)
        little[i] = (uint8_t)(number >> (8 * i));
    bytes_put(bytes, little, (size_t)n);
}

void bytes_float(struct bytes *bytes, double value)
{
    const float f = (float)value;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    bytes_number(bytes, bits, 4);
}

void bytes_insert(struct bytes *bytes, size_t at, const void *data, size_t n)
{
    if (!reserve(bytes, n))
        return;
    memmove(bytes->data + at + n, bytes->data + at, bytes->size - at);
    memcpy(bytes->data + at, data, n);
    bytes->size += n;
}
