/* SPDX-License-Identifier: MIT */
/* gunzip - see the header. */
#include "gunzip.h"

#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#define HEAD_BYTES  3u
#define ROOM_BYTES  ((size_t)1 << 20) /* at first, then twice as much each time */
#define GZIP_WINDOW (16 + MAX_WBITS)  /* of zlib: a gzip head, of any window */
#define INPUT_BYTES ((size_t)1 << 30) /* that zlib's counters hold */

bool gunzip_is(const uint8_t *data, size_t size)
{
    static const uint8_t head[HEAD_BYTES] = {0x1f, 0x8b, 8};
    return size >= HEAD_BYTES && memcmp(data, head, HEAD_BYTES) == 0;
}

struct unpacking {
    z_stream z;
    struct unpacked *out;
    gunzip_fn take;
    void *ctx;
    uint8_t piece[GUNZIP_PIECE];
};

static void hand_out(struct unpacking *u)
{
    const size_t n = GUNZIP_PIECE - u->z.avail_out;
    u->out->n += n;
    u->out->stopped = n > 0 && !u->take(u->ctx, u->piece, n);
    u->z.next_out = u->piece;
    u->z.avail_out = (uInt)GUNZIP_PIECE;
}

/* One member at data, up to its end, the damage, or the end of the file: u->z.next_in. True: it is whole. */
static bool unpack_member(struct unpacking *u, const uint8_t *data, size_t size)
{
    z_stream *z = &u->z;
    int status = Z_OK;
    z->next_in = (uint8_t *)(uintptr_t)data; /* zlib only reads it */
    z->avail_in = (uInt)(size < INPUT_BYTES ? size : INPUT_BYTES);
    while (status == Z_OK && !u->out->stopped) {
        status = inflate(z, Z_NO_FLUSH);
        if (z->avail_out == 0)
            hand_out(u);
        const size_t read = (size_t)(z->next_in - data);
        if (z->avail_in == 0)
            z->avail_in = (uInt)(size - read < INPUT_BYTES ? size - read : INPUT_BYTES);
    }
    return status == Z_STREAM_END;
}

/* The next member at or behind `at`; size: there is none. */
static size_t find_member(const uint8_t *data, size_t size, size_t at)
{
    while (at < size && !gunzip_is(data + at, size - at))
        at++;
    return at;
}

static void unpack_all(struct unpacking *u, const uint8_t *data, size_t size)
{
    u->z.next_out = u->piece;
    u->z.avail_out = (uInt)GUNZIP_PIECE;
    for (size_t at = 0; at < size && !u->out->stopped;) {
        inflateReset(&u->z);
        const bool whole = unpack_member(u, data + at, size - at);
        size_t end = (size_t)(u->z.next_in - data);
        while (whole && end < size && data[end] == 0)
            end++; /* some fill up the last block of a tape or a disk */
        at = find_member(data, size, whole || end > at ? end : at + 1);
        u->out->lost += at - end;
        u->out->damaged |= !whole && !u->out->stopped;
    }
    if (!u->out->stopped)
        hand_out(u);
}

bool gunzip_pieces(const uint8_t *data, size_t size, gunzip_fn take, void *ctx, struct unpacked *out,
                   struct fault *fault)
{
    struct unpacking *u = calloc(1, sizeof *u);
    *out = (struct unpacked){0};
    if (!u || inflateInit2(&u->z, GZIP_WINDOW) != Z_OK) {
        free(u);
        return fault_set(fault, "out of memory unpacking it");
    }
    u->out = out;
    u->take = take;
    u->ctx = ctx;
    unpack_all(u, data, size);
    inflateEnd(&u->z);
    free(u);
    return true;
}

struct whole {
    uint8_t *p;
    size_t n, room;
    struct fault *fault;
};

static bool keep(void *ctx, const uint8_t *bytes, size_t n)
{
    struct whole *w = ctx;
    if (n > GUNZIP_WHOLE_MAX - w->n)
        return fault_set(w->fault, "it unpacks to more than %zu MiB: unpack it with gunzip",
                         GUNZIP_WHOLE_MAX >> 20);
    if (n > w->room - w->n) {
        const size_t room = w->room ? 2 * w->room : ROOM_BYTES;
        uint8_t *p = realloc(w->p, room);
        if (!p)
            return fault_set(w->fault, "out of memory unpacking it");
        w->p = p;
        w->room = room;
    }
    memcpy(w->p + w->n, bytes, n);
    w->n += n;
    return true;
}

bool gunzip(const uint8_t *data, size_t size, struct unpacked *out, struct fault *fault)
{
    struct whole w = {.fault = fault};
    if (!gunzip_pieces(data, size, keep, &w, out, fault) || out->stopped) {
        free(w.p);
        *out = (struct unpacked){0};
        return false;
    }
    out->p = w.p;
    return true;
}
