/* SPDX-License-Identifier: MIT */
/* test_png - what is written is what zlib unpacks; the checksums are right, and the header is that of the standard. */
#include <zlib.h>

#include "client/view/png.h"
#include "tests/lib/test.h"

static uint32_t big_endian(const uint8_t *at)
{
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

/* The chunk at *at, which moves behind it; its content, of *n bytes. */
static const uint8_t *chunk(const struct bytes *png, size_t *at, const char *type, uint32_t *n)
{
    const uint8_t *begun = png->data + *at;
    *n = big_endian(begun);
    CHECK(*at + 12 + *n <= png->size);
    CHECK(memcmp(begun + 4, type, 4) == 0);
    CHECK_INT(big_endian(begun + 8 + *n), (uint32_t)crc32(0, begun + 4, *n + 4));
    *at += 12 + *n;
    return begun + 8;
}

TEST(a_picture_can_be_read)
{
    static const uint8_t pixels[] = {0, 1, 2, 3, 15, 14, 13, 12}, packed[] = {0, 0x01, 0x23, 0, 0xfe, 0xdc};
    static const uint8_t colours[PNG_COLOURS][3] = {{1, 2, 3}, {4, 5, 6}};
    uint8_t lines[16];
    uLongf size = sizeof lines;
    struct bytes png = {0};
    size_t at = 8;
    uint32_t n;
    png_write(&png, pixels, 4, 2, colours);
    CHECK(!png.failed && png.size > 8 && memcmp(png.data, "\x89PNG\r\n\x1a\n", 8) == 0);
    const uint8_t *head = chunk(&png, &at, "IHDR", &n);
    CHECK_INT(n, 13);
    CHECK(memcmp(head, "\0\0\0\4\0\0\0\2\4\3\0\0\0", 13) == 0);
    const uint8_t *palette = chunk(&png, &at, "PLTE", &n);
    CHECK_INT(n, 48);
    CHECK(memcmp(palette, colours, 48) == 0);
    const uint8_t *data = chunk(&png, &at, "IDAT", &n);
    CHECK_INT(uncompress(lines, &size, data, n), Z_OK);
    CHECK_INT(size, sizeof packed);
    CHECK(memcmp(lines, packed, sizeof packed) == 0);
    chunk(&png, &at, "IEND", &n);
    CHECK_INT(n, 0);
    CHECK_INT(at, png.size);
    free(png.data);
}

int main(void)
{
    RUN(a_picture_can_be_read);
    return test_end();
}
