/* SPDX-License-Identifier: MIT */
/* gunzip - see the header. */
#include "gunzip.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#define HEAD_BYTES  3u
#define ROOM_BYTES  ((size_t)1 << 20) /* at first, then twice as much each time */
#define GZIP_WINDOW (16 + MAX_WBITS)  /* of zlib: a gzip head, of any window */
#define PIECE_BYTES ((size_t)1 << 30) /* that zlib's counters hold */

bool gunzip_is(const uint8_t *data, size_t size)
{
    static const uint8_t head[HEAD_BYTES] = {0x1f, 0x8b, 8};
    return size >= HEAD_BYTES && memcmp(data, head, HEAD_BYTES) == 0;
}

struct unpacking {
    z_stream z;
    struct unpacked *out;
    size_t room; /* of out->p */
    struct fault *fault;
};

/* Room for one more byte at least. */
static bool grow(struct unpacking *u)
{
    if (u->out->n < u->room)
        return true;
    if (u->room >= GUNZIP_MOST)
        return fault_set(u->fault, "it unpacks to more than %zu bytes", GUNZIP_MOST);
    const size_t more = u->room ? 2 * u->room : ROOM_BYTES;
    uint8_t *p = realloc(u->out->p, more);
    if (!p)
        return fault_set(u->fault, "out of memory unpacking it");
    u->out->p = p;
    u->room = more;
    return true;
}

/* One member at data, up to its end, the damage, or the end of the file: u->z.next_in. */
static bool unpack_member(struct unpacking *u, const uint8_t *data, size_t size, bool *whole)
{
    z_stream *z = &u->z;
    int status = Z_OK;
    z->next_in = (uint8_t *)(uintptr_t)data; /* zlib only reads it */
    z->avail_in = (uInt)(size < PIECE_BYTES ? size : PIECE_BYTES);
    while (status == Z_OK) {
        if (!grow(u))
            return false;
        const size_t left = u->room - u->out->n, piece = left < PIECE_BYTES ? left : PIECE_BYTES;
        z->next_out = u->out->p + u->out->n;
        z->avail_out = (uInt)piece;
        status = inflate(z, Z_NO_FLUSH);
        u->out->n += piece - z->avail_out;
        if (status == Z_BUF_ERROR && z->avail_out == 0)
            status = Z_OK; /* it wants more room */
        const size_t read = (size_t)(z->next_in - data);
        if (z->avail_in == 0)
            z->avail_in = (uInt)(size - read < PIECE_BYTES ? size - read : PIECE_BYTES);
    }
    *whole = status == Z_STREAM_END;
    return true;
}

/* The next member at or behind `at`; size: there is none. */
static size_t find_member(const uint8_t *data, size_t size, size_t at)
{
    while (at < size && !gunzip_is(data + at, size - at))
        at++;
    return at;
}

static bool unpack_all(struct unpacking *u, const uint8_t *data, size_t size)
{
    for (size_t at = 0; at < size;) {
        bool whole;
        inflateReset(&u->z);
        if (!unpack_member(u, data + at, size - at, &whole))
            return false;
        const size_t end = (size_t)(u->z.next_in - data);
        at = find_member(data, size, whole || end > at ? end : at + 1);
        u->out->lost += at - end;
        u->out->damaged |= !whole;
    }
    return true;
}

bool gunzip(const uint8_t *data, size_t size, struct unpacked *out, struct fault *fault)
{
    struct unpacking u = {.out = out, .fault = fault};
    *out = (struct unpacked){0};
    if (inflateInit2(&u.z, GZIP_WINDOW) != Z_OK)
        return fault_set(fault, "out of memory unpacking it");
    const bool ok = unpack_all(&u, data, size);
    inflateEnd(&u.z);
    if (!ok) {
        free(out->p);
        *out = (struct unpacked){0};
    }
    return ok;
}
