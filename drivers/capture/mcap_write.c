/* SPDX-License-Identifier: MIT */
/*
 * mcap_write - writes captures: chunks, indexes, attachments, summary. Knows where each record stands in the file;
 * knows nothing of what the messages say.
 *
 * Every append is one write(2). One that fails half-way is taken back by truncating the file to its old length, so
 * that what is on disk always ends with a whole record.
 */
#include "mcap.h"

#include <errno.h>
#include <lz4frame.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>
#include <zstd.h>

#include "core/fault.h"
#include "mcap_format.h"

#define CHUNK_HEAD  64u /* of a chunk record up to its bytes, rounded up */
#define INDEX_ENTRY 16u /* log time, offset */
#define NO_ENTRY    UINT32_MAX
#define ZSTD_LEVEL  1

/* A message in the open chunk; those of one channel form a list. */
struct entry {
    uint64_t log_ns;
    uint32_t offset, next;
};

struct channel {
    uint64_t messages;    /* on disk */
    uint32_t first, last; /* entries in the open chunk, NO_ENTRY: none */
    uint32_t waiting;
};

struct mcap_writer {
    int fd;
    bool broken; /* half a record could not be taken back: nothing may follow it */
    enum mcap_compression compression;
    size_t chunk_bytes, message_bytes;
    LZ4F_cctx *lz4;
    ZSTD_CCtx *zstd;
    uint32_t crc; /* of all bytes on disk */
    struct mcap_written written;
    uint32_t n_attachments;
    uint64_t start_ns, end_ns; /* of all messages on disk */

    struct mcap_bytes chunk; /* messages of the open chunk, uncompressed */
    struct mcap_bytes out;   /* a chunk with its indexes, as it goes to disk */
    uint64_t chunk_start_ns, chunk_end_ns;
    struct entry *entry;
    uint32_t n_entries, max_entries;

    /* The summary's records, collected as they become known. */
    struct mcap_bytes schemas, channels, attachments, chunks;
    struct channel channel[MCAP_CHANNELS_MAX];
    unsigned n_channels;
    uint16_t n_schemas;
};

static const char *const compression_name[] = {[MCAP_LZ4] = "lz4", [MCAP_NONE] = "", [MCAP_ZSTD] = "zstd"};

/* Make room for n more bytes; not for the message path. */
static bool reserve(struct mcap_bytes *b, size_t n)
{
    if (b->cap - b->n >= n)
        return true;
    uint8_t *p = realloc(b->p, b->n + n);
    if (!p)
        return false;
    b->p = p;
    b->cap = b->n + n;
    return true;
}

/* All of p to disk, or nothing of it. */
static bool append(struct mcap_writer *w, const uint8_t *p, size_t n, struct fault *fault)
{
    if (w->broken)
        return fault_set(fault, "an earlier write failed half-way; the file cannot be continued");
    for (size_t done = 0; done < n;) {
        ssize_t k = write(w->fd, p + done, n - done);
        if (k < 0 && errno == EINTR)
            continue;
        if (k <= 0) {
            int cause = k < 0 ? errno : ENOSPC;
            w->broken = done > 0 && (ftruncate(w->fd, (off_t)w->written.bytes) != 0 ||
                                     lseek(w->fd, (off_t)w->written.bytes, SEEK_SET) < 0);
            return fault_set(fault, "writing %zu bytes at offset %llu: %s", n,
                             (unsigned long long)w->written.bytes, strerror(cause));
        }
        done += (size_t)k;
    }
    w->crc = (uint32_t)crc32_z(w->crc, p, n);
    w->written.bytes += n;
    return true;
}

/* ---- chunks ---- */

static size_t compress_bound(const struct mcap_writer *w, size_t n)
{
    switch (w->compression) {
    case MCAP_LZ4:
        return LZ4F_compressFrameBound(n, NULL) + LZ4F_HEADER_SIZE_MAX;
    case MCAP_ZSTD:
        return ZSTD_compressBound(n);
    case MCAP_NONE:
        break;
    }
    return n;
}

static size_t compress_lz4(struct mcap_writer *w, uint8_t *to, size_t room)
{
    LZ4F_preferences_t prefs = {.autoFlush = 1,
                                .frameInfo = {.blockSizeID = LZ4F_max256KB,
                                              .blockMode = LZ4F_blockIndependent,
                                              .contentSize = w->chunk.n}};
    size_t head = LZ4F_compressBegin(w->lz4, to, room, &prefs);
    if (LZ4F_isError(head))
        return 0;
    size_t body = LZ4F_compressUpdate(w->lz4, to + head, room - head, w->chunk.p, w->chunk.n, NULL);
    if (LZ4F_isError(body))
        return 0;
    size_t tail = LZ4F_compressEnd(w->lz4, to + head + body, room - head - body, NULL);
    return LZ4F_isError(tail) ? 0 : head + body + tail;
}

/* The open chunk's bytes, compressed to the end of w->out. False: the library refused. */
static bool compress_chunk(struct mcap_writer *w)
{
    uint8_t *to = w->out.p + w->out.n;
    size_t room = w->out.cap - w->out.n, n = 0;
    switch (w->compression) {
    case MCAP_LZ4:
        n = compress_lz4(w, to, room);
        break;
    case MCAP_ZSTD:
        n = ZSTD_compressCCtx(w->zstd, to, room, w->chunk.p, w->chunk.n, ZSTD_LEVEL);
        if (ZSTD_isError(n))
            return false;
        break;
    case MCAP_NONE:
        memcpy(to, w->chunk.p, w->chunk.n);
        n = w->chunk.n;
        break;
    }
    w->out.n += n;
    return n > 0;
}

/* The chunk record into w->out; how many bytes its records have there in *compressed. */
static bool build_chunk(struct mcap_writer *w, uint64_t *compressed)
{
    w->out.n = 0;
    size_t at = mcap_begin(&w->out, MCAP_OP_CHUNK);
    mcap_put_int(&w->out, w->chunk_start_ns, 8);
    mcap_put_int(&w->out, w->chunk_end_ns, 8);
    mcap_put_int(&w->out, w->chunk.n, 8);
    mcap_put_int(&w->out, crc32_z(0, w->chunk.p, w->chunk.n), 4);
    mcap_put_string(&w->out, compression_name[w->compression]);
    size_t length_at = w->out.n;
    mcap_put_int(&w->out, 0, 8);
    if (!compress_chunk(w))
        return false;
    *compressed = w->out.n - length_at - 8;
    struct mcap_bytes length = {w->out.p, length_at, w->out.cap};
    mcap_put_int(&length, *compressed, 8);
    mcap_end(&w->out, at);
    return true;
}

static void build_message_index(struct mcap_writer *w, unsigned id)
{
    const struct channel *c = &w->channel[id];
    size_t at = mcap_begin(&w->out, MCAP_OP_MESSAGE_INDEX);
    mcap_put_int(&w->out, id, 2);
    mcap_put_int(&w->out, (uint64_t)c->waiting * INDEX_ENTRY, 4);
    for (uint32_t i = c->first; i != NO_ENTRY; i = w->entry[i].next) {
        mcap_put_int(&w->out, w->entry[i].log_ns, 8);
        mcap_put_int(&w->out, w->entry[i].offset, 8);
    }
    mcap_end(&w->out, at);
}

static size_t chunk_index_size(const struct mcap_writer *w)
{
    return MCAP_RECORD_HEAD + 4 * 8 + 4 + 10 * (size_t)w->n_channels + 8 + 8 + 2 * 8;
}

/* The message indexes behind the chunk in w->out, and the chunk's own index record into the summary-to-be. */
static void build_indexes(struct mcap_writer *w, uint64_t compressed)
{
    struct mcap_bytes *ci = &w->chunks;
    uint64_t chunk_at = w->written.bytes, chunk_length = w->out.n;
    size_t at = mcap_begin(ci, MCAP_OP_CHUNK_INDEX);
    mcap_put_int(ci, w->chunk_start_ns, 8);
    mcap_put_int(ci, w->chunk_end_ns, 8);
    mcap_put_int(ci, chunk_at, 8);
    mcap_put_int(ci, chunk_length, 8);
    struct mcap_bytes map_length = {ci->p, ci->n, ci->cap};
    mcap_put_int(ci, 0, 4);
    for (unsigned id = 0; id < w->n_channels; id++) {
        if (!w->channel[id].waiting)
            continue;
        mcap_put_int(ci, id, 2);
        mcap_put_int(ci, chunk_at + w->out.n, 8);
        build_message_index(w, id);
    }
    mcap_put_int(&map_length, ci->n - map_length.n - 4, 4);
    mcap_put_int(ci, w->out.n - chunk_length, 8);
    mcap_put_string(ci, compression_name[w->compression]);
    mcap_put_int(ci, compressed, 8);
    mcap_put_int(ci, w->chunk.n, 8);
    mcap_end(ci, at);
}

/* Begin an empty chunk; the waiting messages are on disk, or lost. */
static void reset_chunk(struct mcap_writer *w, bool on_disk)
{
    for (unsigned id = 0; id < w->n_channels; id++) {
        struct channel *c = &w->channel[id];
        if (on_disk)
            c->messages += c->waiting;
        c->waiting = 0;
        c->first = c->last = NO_ENTRY;
    }
    if (on_disk) {
        if (w->written.messages == 0 || w->chunk_start_ns < w->start_ns)
            w->start_ns = w->chunk_start_ns;
        if (w->written.messages == 0 || w->chunk_end_ns > w->end_ns)
            w->end_ns = w->chunk_end_ns;
        w->written.messages += w->n_entries;
        w->written.chunks++;
    } else {
        w->written.lost += w->n_entries;
    }
    w->chunk.n = 0;
    w->n_entries = 0;
}

bool mcap_flush(struct mcap_writer *w, struct fault *fault)
{
    if (w->n_entries == 0)
        return true;
    size_t index_at = w->chunks.n;
    uint64_t compressed;
    bool ok;
    if (build_chunk(w, &compressed)) {
        build_indexes(w, compressed);
        ok = append(w, w->out.p, w->out.n, fault);
    } else {
        ok = fault_set(fault, "compressing a chunk of %zu bytes failed", w->chunk.n);
    }
    if (!ok)
        w->chunks.n = index_at;
    reset_chunk(w, ok);
    return ok;
}

bool mcap_write_message(struct mcap_writer *w, int channel, const struct mcap_message *message,
                        struct fault *fault)
{
    const size_t size = message->size;
    const uint64_t log_ns = message->log_ns;
    if (channel < 0 || (unsigned)channel >= w->n_channels)
        return fault_set(fault, "there is no channel %d", channel);
    if (size > w->message_bytes)
        return fault_set(fault, "a message of %zu bytes; %zu is the limit", size, w->message_bytes);
    if ((w->chunk.n + MCAP_MESSAGE_HEAD + size > w->chunk_bytes || w->n_entries == w->max_entries) &&
        !mcap_flush(w, fault))
        return false;
    if (mcap_written(w).full)
        return fault_set(fault, "the index of chunks is full; begin another file");

    if (w->n_entries == 0 || log_ns < w->chunk_start_ns)
        w->chunk_start_ns = log_ns;
    if (w->n_entries == 0 || log_ns > w->chunk_end_ns)
        w->chunk_end_ns = log_ns;
    struct channel *c = &w->channel[channel];
    uint32_t i = w->n_entries++;
    w->entry[i] = (struct entry){log_ns, (uint32_t)w->chunk.n, NO_ENTRY};
    if (c->last == NO_ENTRY)
        c->first = i;
    else
        w->entry[c->last].next = i;
    c->last = i;
    c->waiting++;

    size_t at = mcap_begin(&w->chunk, MCAP_OP_MESSAGE);
    mcap_put_int(&w->chunk, (unsigned)channel, 2);
    mcap_put_int(&w->chunk, message->sequence, 4);
    mcap_put_int(&w->chunk, log_ns, 8);
    mcap_put_int(&w->chunk, message->publish_ns, 8);
    mcap_put(&w->chunk, message->data, size);
    mcap_end(&w->chunk, at);
    return w->chunk.n < w->chunk_bytes || mcap_flush(w, fault);
}

/* ---- the rest of the data section ---- */

int mcap_add_schema(struct mcap_writer *w, const char *name, const char *encoding, const void *schema, size_t n,
                    struct fault *fault)
{
    struct mcap_bytes *b = &w->schemas;
    size_t room = MCAP_RECORD_HEAD + 2 + 12 + strlen(name) + strlen(encoding) + n;
    if (w->n_schemas == MCAP_CHANNELS_MAX || room > w->message_bytes) {
        fault_set(fault, "no schema %.64s: %d schemas of %zu bytes are the limit", name, MCAP_CHANNELS_MAX,
                  w->message_bytes);
        return -1;
    }
    if (!reserve(b, room)) {
        fault_set(fault, "out of memory");
        return -1;
    }
    size_t at = mcap_begin(b, MCAP_OP_SCHEMA);
    mcap_put_int(b, w->n_schemas + 1u, 2);
    mcap_put_string(b, name);
    mcap_put_string(b, encoding);
    mcap_put_int(b, n, 4);
    mcap_put(b, schema, n);
    mcap_end(b, at);
    if (!append(w, b->p + at, b->n - at, fault)) {
        b->n = at;
        return -1;
    }
    return ++w->n_schemas;
}

static int add_channel(struct mcap_writer *w, const struct mcap_channel *channel, struct fault *fault)
{
    size_t room = MCAP_RECORD_HEAD + 4 + 8 + strlen(channel->topic) + strlen(channel->encoding) + 4;
    for (size_t i = 0; i < channel->n_metadata; i++)
        room += 8 + strlen(channel->metadata[i].key) + strlen(channel->metadata[i].value);
    if (w->n_channels == MCAP_CHANNELS_MAX || strlen(channel->topic) > MCAP_STRING_MAX ||
        room > w->message_bytes) {
        fault_set(fault, "no channel %.64s: %d channels of %d bytes of name are the limit", channel->topic,
                  MCAP_CHANNELS_MAX, MCAP_STRING_MAX);
        return -1;
    }
    if (w->n_entries > 0 && !mcap_flush(w, fault))
        return -1; /* the open chunk's room in the index was checked for fewer channels */
    struct mcap_bytes *b = &w->channels;
    if (!reserve(b, room)) {
        fault_set(fault, "out of memory");
        return -1;
    }
    size_t at = mcap_begin(b, MCAP_OP_CHANNEL);
    mcap_put_int(b, w->n_channels, 2);
    mcap_put_int(b, channel->schema_id, 2);
    mcap_put_string(b, channel->topic);
    mcap_put_string(b, channel->encoding);
    struct mcap_bytes map_length = {b->p, b->n, b->cap};
    mcap_put_int(b, 0, 4);
    for (size_t i = 0; i < channel->n_metadata; i++) {
        mcap_put_string(b, channel->metadata[i].key);
        mcap_put_string(b, channel->metadata[i].value);
    }
    mcap_put_int(&map_length, b->n - map_length.n - 4, 4);
    mcap_end(b, at);
    if (!append(w, b->p + at, b->n - at, fault)) {
        b->n = at;
        return -1;
    }
    w->channel[w->n_channels] = (struct channel){0, NO_ENTRY, NO_ENTRY, 0};
    return (int)w->n_channels++;
}

int mcap_add_channel(struct mcap_writer *w, const char *topic, const char *encoding,
                     const struct mcap_pair *metadata, size_t n_metadata, struct fault *fault)
{
    const struct mcap_channel channel = {
        .topic = topic, .encoding = encoding, .metadata = metadata, .n_metadata = n_metadata};
    return add_channel(w, &channel, fault);
}

int mcap_add_channel_of(struct mcap_writer *w, int schema, const char *topic, const char *encoding,
                        struct fault *fault)
{
    return add_channel(
        w, &(struct mcap_channel){.schema_id = (uint16_t)schema, .topic = topic, .encoding = encoding}, fault);
}

bool mcap_attach(struct mcap_writer *w, const struct mcap_attachment *attachment, struct fault *fault)
{
    const char *name = attachment->name, *media_type = attachment->media_type;
    const uint64_t log_ns = attachment->log_ns;
    const size_t size = attachment->size, names = strlen(name) + strlen(media_type);
    struct mcap_bytes b = {0};
    if (size > MCAP_CHUNK_LIMIT)
        return fault_set(fault, "attachment %.64s of %zu bytes; %u is the limit", name, size, MCAP_CHUNK_LIMIT);
    if (!reserve(&b, MCAP_RECORD_HEAD + 16 + 8 + names + 8 + size + 4) ||
        !reserve(&w->attachments, MCAP_RECORD_HEAD + 40 + 8 + names)) {
        free(b.p);
        return fault_set(fault, "out of memory");
    }
    size_t at = mcap_begin(&b, MCAP_OP_ATTACHMENT);
    mcap_put_int(&b, log_ns, 8);
    mcap_put_int(&b, log_ns, 8);
    mcap_put_string(&b, name);
    mcap_put_string(&b, media_type);
    mcap_put_int(&b, size, 8);
    mcap_put(&b, attachment->data, size);
    mcap_put_int(&b, crc32_z(0, b.p + MCAP_RECORD_HEAD, b.n - MCAP_RECORD_HEAD), 4);
    mcap_end(&b, at);
    uint64_t offset = w->written.bytes;
    bool ok = append(w, b.p, b.n, fault);
    if (ok) {
        struct mcap_bytes *ai = &w->attachments;
        at = mcap_begin(ai, MCAP_OP_ATTACHMENT_INDEX);
        mcap_put_int(ai, offset, 8);
        mcap_put_int(ai, b.n, 8);
        mcap_put_int(ai, log_ns, 8);
        mcap_put_int(ai, log_ns, 8);
        mcap_put_int(ai, size, 8);
        mcap_put_string(ai, name);
        mcap_put_string(ai, media_type);
        mcap_end(ai, at);
        w->n_attachments++;
    }
    free(b.p);
    return ok;
}

/* ---- the summary ---- */

static void build_statistics(const struct mcap_writer *w, struct mcap_bytes *b)
{
    size_t at = mcap_begin(b, MCAP_OP_STATISTICS);
    mcap_put_int(b, w->written.messages, 8);
    mcap_put_int(b, w->n_schemas, 2);
    mcap_put_int(b, w->n_channels, 4);
    mcap_put_int(b, w->n_attachments, 4);
    mcap_put_int(b, 0, 4); /* metadata records */
    mcap_put_int(b, w->written.chunks, 4);
    mcap_put_int(b, w->start_ns, 8);
    mcap_put_int(b, w->end_ns, 8);
    mcap_put_int(b, 10ull * w->n_channels, 4);
    for (unsigned id = 0; id < w->n_channels; id++) {
        mcap_put_int(b, id, 2);
        mcap_put_int(b, w->channel[id].messages, 8);
    }
    mcap_end(b, at);
}

/* DataEnd, the groups of the summary, where each begins, the footer and the magic, into b, which has room. */
static void build_end(const struct mcap_writer *w, const struct mcap_bytes *statistics, struct mcap_bytes *b)
{
    size_t at = mcap_begin(b, MCAP_OP_DATA_END);
    mcap_put_int(b, w->crc, 4);
    mcap_end(b, at);

    const struct {
        enum mcap_opcode opcode;
        const struct mcap_bytes *records;
    } group[] = {{MCAP_OP_SCHEMA, &w->schemas},
                 {MCAP_OP_CHANNEL, &w->channels},
                 {MCAP_OP_STATISTICS, statistics},
                 {MCAP_OP_CHUNK_INDEX, &w->chunks},
                 {MCAP_OP_ATTACHMENT_INDEX, &w->attachments}};
    const size_t n_groups = sizeof group / sizeof group[0];
    uint64_t base = w->written.bytes;
    size_t start = b->n;
    for (size_t i = 0; i < n_groups; i++)
        mcap_put(b, group[i].records->p, group[i].records->n);
    uint64_t offsets = base + b->n, from = base + start;
    for (size_t i = 0; i < n_groups; i++) {
        if (!group[i].records->n)
            continue;
        at = mcap_begin(b, MCAP_OP_SUMMARY_OFFSET);
        mcap_put_int(b, group[i].opcode, 1);
        mcap_put_int(b, from, 8);
        mcap_put_int(b, group[i].records->n, 8);
        mcap_end(b, at);
        from += group[i].records->n;
    }
    mcap_put_int(b, MCAP_OP_FOOTER, 1);
    mcap_put_int(b, 20, 8);
    mcap_put_int(b, base + start, 8);
    mcap_put_int(b, offsets, 8);
    mcap_put_int(b, crc32_z(0, b->p + start, b->n - start), 4);
    mcap_put(b, mcap_magic, sizeof mcap_magic);
}

static bool write_end(struct mcap_writer *w, struct fault *fault)
{
    struct mcap_bytes statistics = {0}, b = {0};
    bool ok = reserve(&statistics, 128 + 10 * (size_t)w->n_channels) &&
              reserve(&b, 320 + w->schemas.n + w->channels.n + statistics.cap + w->chunks.n + w->attachments.n);
    if (ok) {
        build_statistics(w, &statistics);
        build_end(w, &statistics, &b);
        ok = append(w, b.p, b.n, fault);
    } else {
        fault_set(fault, "out of memory");
    }
    free(statistics.p);
    free(b.p);
    return ok;
}

/* ---- begin and end ---- */

static void writer_free(struct mcap_writer *w)
{
    if (w->fd >= 0)
        close(w->fd);
    LZ4F_freeCompressionContext(w->lz4);
    ZSTD_freeCCtx(w->zstd);
    free(w->chunk.p);
    free(w->out.p);
    free(w->entry);
    free(w->schemas.p);
    free(w->channels.p);
    free(w->attachments.p);
    free(w->chunks.p);
    free(w);
}

static bool allocate(struct mcap_writer *w, size_t index_bytes)
{
    size_t chunk = w->message_bytes + MCAP_MESSAGE_HEAD;
    if (chunk < w->chunk_bytes)
        chunk = w->chunk_bytes;
    w->max_entries = (uint32_t)(chunk / MCAP_MESSAGE_HEAD + 1);
    w->entry = malloc(w->max_entries * sizeof *w->entry);
    size_t out = CHUNK_HEAD + compress_bound(w, chunk) + (size_t)w->max_entries * INDEX_ENTRY +
                 MCAP_CHANNELS_MAX * (MCAP_RECORD_HEAD + 6);
    if (!w->entry || !reserve(&w->chunk, chunk) || !reserve(&w->out, out) || !reserve(&w->chunks, index_bytes))
        return false;
    if (w->compression == MCAP_LZ4 && LZ4F_isError(LZ4F_createCompressionContext(&w->lz4, LZ4F_VERSION)))
        return false;
    if (w->compression == MCAP_ZSTD && !(w->zstd = ZSTD_createCCtx()))
        return false;
    /*
     * Pages are faulted in now, not while messages come. Not with zeros: a compiler may make calloc of malloc and
     * that, which touches nothing.
     */
    memset(w->entry, 0xff, w->max_entries * sizeof *w->entry);
    memset(w->chunk.p, 0xff, chunk);
    memset(w->out.p, 0xff, out);
    memset(w->chunks.p, 0xff, index_bytes);
    /* The libraries allocate with the first chunk of a size: let that be now. */
    w->chunk.n = chunk;
    bool ok = compress_chunk(w);
    w->chunk.n = w->out.n = 0;
    return ok;
}

static bool write_head(struct mcap_writer *w, const struct mcap_options *options, struct fault *fault)
{
    struct mcap_bytes *b = &w->out;
    mcap_put(b, mcap_magic, sizeof mcap_magic);
    size_t at = mcap_begin(b, MCAP_OP_HEADER);
    mcap_put_string(b, options->profile ? options->profile : "sonard");
    mcap_put_string(b, options->library);
    mcap_end(b, at);
    return append(w, b->p, b->n, fault);
}

struct mcap_writer *mcap_create(int fd, const struct mcap_options *options, struct fault *fault)
{
    struct mcap_writer *w = calloc(1, sizeof *w);
    if (!w) {
        close(fd);
        fault_set(fault, "out of memory");
        return NULL;
    }
    w->fd = fd;
    w->compression = options->compression;
    w->chunk_bytes = options->chunk_bytes ? options->chunk_bytes : MCAP_CHUNK_BYTES;
    w->message_bytes = options->message_bytes ? options->message_bytes : MCAP_MESSAGE_BYTES;
    size_t index_bytes = options->index_bytes ? options->index_bytes : MCAP_INDEX_BYTES;
    bool ok;
    if (w->chunk_bytes + w->message_bytes > MCAP_CHUNK_LIMIT || strlen(options->library) > MCAP_STRING_MAX)
        ok = fault_set(fault, "chunk and message together may have %u bytes", MCAP_CHUNK_LIMIT);
    else if (!allocate(w, index_bytes))
        ok = fault_set(fault, "out of memory");
    else
        ok = write_head(w, options, fault);
    if (!ok) {
        writer_free(w);
        return NULL;
    }
    return w;
}

bool mcap_finish(struct mcap_writer *w, struct fault *fault)
{
    bool flushed = mcap_flush(w, fault);
    struct fault more;
    bool ended = write_end(w, flushed ? fault : &more);
    int fd = w->fd;
    w->fd = -1;
    bool closed = close(fd) == 0;
    if (flushed && ended && !closed)
        fault_set(fault, "closing the file: %s", strerror(errno));
    writer_free(w);
    return flushed && ended && closed;
}

struct mcap_written mcap_written(const struct mcap_writer *w)
{
    struct mcap_written state = w->written;
    state.waiting = w->n_entries;
    state.full = w->chunks.cap - w->chunks.n < chunk_index_size(w);
    return state;
}

int mcap_fd(const struct mcap_writer *w)
{
    return w->fd;
}
