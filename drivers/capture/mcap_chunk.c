/* SPDX-License-Identifier: MIT */
/*
 * mcap_chunk - see the header. Sizes come from the file: each is held against a limit before memory is asked for,
 * and unpacking stops where the stated size ends.
 */
#include "mcap_chunk.h"

#include <stdlib.h>
#include <zlib.h>

#include "mcap.h"

static bool grow(struct mcap_unpacker *u, size_t n)
{
    if (n < u->cap)
        return true;
    free(u->buffer);
    u->buffer = malloc(n + 1);
    u->cap = u->buffer ? n + 1 : 0;
    return u->buffer != NULL;
}

static bool unpack_lz4(struct mcap_unpacker *u, const uint8_t *src, size_t n, size_t want)
{
    if (!u->lz4 && LZ4F_isError(LZ4F_createDecompressionContext(&u->lz4, LZ4F_VERSION)))
        return false;
    LZ4F_resetDecompressionContext(u->lz4);
    size_t done = 0, used = 0, hint = 1;
    while (hint != 0 && used < n) {
        size_t to = want - done, from = n - used;
        hint = LZ4F_decompress(u->lz4, u->buffer + done, &to, src + used, &from, NULL);
        if (LZ4F_isError(hint) || (to == 0 && from == 0))
            return false;
        done += to;
        used += from;
    }
    return hint == 0 && done == want;
}

static bool unpack_zstd(struct mcap_unpacker *u, const uint8_t *src, size_t n, size_t want)
{
    if (!u->zstd && !(u->zstd = ZSTD_createDCtx()))
        return false;
    return ZSTD_decompressDCtx(u->zstd, u->buffer, want, src, n) == want;
}

static bool text_is(struct mcap_cursor text, const char *s)
{
    size_t n = strlen(s);
    return (size_t)(text.end - text.p) == n && (n == 0 || memcmp(text.p, s, n) == 0);
}

static void take_chunk_head(struct mcap_cursor *c, struct mcap_chunk *out)
{
    out->start_ns = mcap_take_int(c, 8);
    out->end_ns = mcap_take_int(c, 8);
    out->unpacked_size = mcap_take_int(c, 8);
    out->crc = (uint32_t)mcap_take_int(c, 4);
    out->compression = mcap_take_sized(c);
    out->records_size = mcap_take_int(c, 8);
}

bool mcap_parse_chunk(struct mcap_cursor c, struct mcap_chunk *out)
{
    take_chunk_head(&c, out);
    out->records = mcap_take(&c, out->records_size);
    return !c.bad;
}

bool mcap_parse_cut_chunk(struct mcap_cursor c, struct mcap_chunk *out)
{
    take_chunk_head(&c, out);
    if (c.bad)
        return false;
    out->records_size = (uint64_t)(c.end - c.p);
    out->records = c.p;
    return true;
}

#define LZ4_INDEPENDENT 0x20u /* bits of a frame's flags: blocks can be read alone, */
#define LZ4_SUMMED      0x10u /* each has 4 bytes of checksum behind it */
#define LZ4_FLAGS_AT    4
#define LZ4_PLAIN       0x80000000u /* of a block's size: it is not packed */
#define LZ4_FRAME_MIN   7

/* Block after block, and of the last one what is there. LZ4F_decompress would keep an unfinished block to itself. */
static size_t unpack_cut_lz4(struct mcap_unpacker *u, const uint8_t *src, size_t n, size_t want)
{
    const size_t head = n >= LZ4_FRAME_MIN ? LZ4F_headerSize(src, n) : 0;
    size_t done = 0;
    if (LZ4F_isError(head) || head == 0 || head > n || !(src[LZ4_FLAGS_AT] & LZ4_INDEPENDENT))
        return 0;
    struct mcap_cursor c = {src + head, src + n, false};
    while (done < want) {
        const uint32_t size = (uint32_t)mcap_take_int(&c, 4), packed = size & ~LZ4_PLAIN;
        const size_t left = (size_t)(c.end - c.p), here = packed < left ? packed : left, room = want - done;
        if (c.bad || size == 0 || here == 0)
            break;
        int got = (int)(here < room ? here : room);
        if (size & LZ4_PLAIN)
            memcpy(u->buffer + done, c.p, (size_t)got);
        else
            got = LZ4_decompress_safe_partial((const char *)c.p, (char *)u->buffer + done, (int)here, (int)room,
                                              (int)room);
        if (got <= 0)
            break;
        done += (size_t)got;
        mcap_take(&c, here + (src[LZ4_FLAGS_AT] & LZ4_SUMMED ? 4 : 0));
    }
    return done;
}

static size_t unpack_cut_zstd(struct mcap_unpacker *u, const uint8_t *src, size_t n, size_t want)
{
    ZSTD_inBuffer in = {src, n, 0};
    ZSTD_outBuffer out = {u->buffer, want, 0};
    if (!u->zstd && !(u->zstd = ZSTD_createDCtx()))
        return 0;
    ZSTD_DCtx_reset(u->zstd, ZSTD_reset_session_only);
    while (in.pos < in.size && out.pos < out.size && !ZSTD_isError(ZSTD_decompressStream(u->zstd, &out, &in))) {
    }
    return out.pos;
}

const uint8_t *mcap_unpack_cut(struct mcap_unpacker *u, const struct mcap_chunk *chunk, size_t *n)
{
    const size_t want = (size_t)chunk->unpacked_size, left = (size_t)chunk->records_size;
    *n = 0;
    if (chunk->unpacked_size > MCAP_CHUNK_LIMIT)
        return NULL;
    if (text_is(chunk->compression, "")) {
        *n = left < want ? left : want;
        return chunk->records;
    }
    if (!grow(u, want))
        return NULL;
    if (text_is(chunk->compression, "lz4"))
        *n = unpack_cut_lz4(u, chunk->records, left, want);
    else if (text_is(chunk->compression, "zstd"))
        *n = unpack_cut_zstd(u, chunk->records, left, want);
    if (*n == want && chunk->crc != 0 && crc32_z(0, u->buffer, want) != chunk->crc)
        *n = 0;
    return u->buffer;
}

const uint8_t *mcap_unpack(struct mcap_unpacker *u, const struct mcap_chunk *chunk, const char **why)
{
    size_t want = (size_t)chunk->unpacked_size, n = (size_t)chunk->records_size;
    const uint8_t *records = chunk->records;
    if (chunk->unpacked_size > MCAP_CHUNK_LIMIT) {
        *why = "it says it unpacks to more than 64 MiB";
        return NULL;
    }
    *why = "it cannot be unpacked to the size it states";
    if (text_is(chunk->compression, "")) {
        if (n != want)
            return NULL;
    } else {
        bool lz4 = text_is(chunk->compression, "lz4");
        if (!lz4 && !text_is(chunk->compression, "zstd")) {
            *why = "its compression is none of \"\", lz4, zstd";
            return NULL;
        }
        if (!grow(u, want)) {
            *why = "out of memory unpacking it";
            return NULL;
        }
        if (!(lz4 ? unpack_lz4(u, records, n, want) : unpack_zstd(u, records, n, want)))
            return NULL;
        records = u->buffer;
    }
    if (chunk->crc != 0 && crc32_z(0, records, want) != chunk->crc) {
        *why = "its checksum is wrong";
        return NULL;
    }
    return records;
}

bool mcap_is_credible_chunk(struct mcap_cursor content)
{
    struct mcap_chunk chunk;
    return mcap_parse_chunk(content, &chunk) && chunk.unpacked_size <= MCAP_CHUNK_LIMIT &&
           (text_is(chunk.compression, "lz4") || text_is(chunk.compression, "zstd") ||
            (text_is(chunk.compression, "") && chunk.records_size == chunk.unpacked_size)) &&
           chunk.records + chunk.records_size == content.end;
}

void mcap_unpacker_free(struct mcap_unpacker *u)
{
    LZ4F_freeDecompressionContext(u->lz4);
    ZSTD_freeDCtx(u->zstd);
    free(u->buffer);
}
