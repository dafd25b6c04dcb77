/* SPDX-License-Identifier: MIT */
#include "png.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#define LEVEL 6 /* of compression */

static void big_endian(uint8_t *at, uint32_t v)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(v >> (24 - 8 * i));
}

static void put_chunk(struct bytes *out, const char *type, const uint8_t *data, uint32_t n)
{
    uint8_t head[8], tail[4];
    const uLong crc = crc32(0, (const Bytef *)type, 4);
    big_endian(head, n);
    memcpy(head + 4, type, 4);
    big_endian(tail, (uint32_t)(n ? crc32(crc, data, n) : crc));
    bytes_put(out, head, sizeof head);
    bytes_put(out, data, n);
    bytes_put(out, tail, sizeof tail);
}

/* Two pixels a byte, and before each line the number of its filter: none. */
static void pack(uint8_t *to, const uint8_t *pixels, uint32_t width, uint32_t height)
{
    for (uint32_t row = 0; row < height; row++) {
        *to++ = 0;
        for (uint32_t i = 0; i < width; i += 2, pixels += 2)
            *to++ = (uint8_t)(pixels[0] << 4 | (pixels[1] & 15));
    }
}

void png_write(struct bytes *out, const uint8_t *pixels, uint32_t width, uint32_t height,
               const uint8_t colours[PNG_COLOURS][3])
{
    static const uint8_t signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    const uLong raw = (uLong)height * (width / 2 + 1);
    uLongf n = compressBound(raw);
    uint8_t *lines = malloc(raw), *packed = malloc(n);
    uint8_t head[13] = {[8] = 4, [9] = 3}; /* bits of a pixel; colours by number */
    big_endian(head, width);
    big_endian(head + 4, height);
    if (lines)
        pack(lines, pixels, width, height);
    if (lines && packed && compress2(packed, &n, lines, raw, LEVEL) == Z_OK) {
        bytes_put(out, signature, sizeof signature);
        put_chunk(out, "IHDR", head, sizeof head);
        put_chunk(out, "PLTE", colours[0], 3 * PNG_COLOURS);
        put_chunk(out, "IDAT", packed, (uint32_t)n);
        put_chunk(out, "IEND", NULL, 0);
    } else {
        out->failed = true;
    }
    free(lines);
    free(packed);
}
