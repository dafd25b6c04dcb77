/* SPDX-License-Identifier: MIT */
/*
 * mcap_read - reads captures, whole or damaged, record by record in the order of the file. Indexes and summary are
 * checked but not needed, except for channels whose own record is damaged. Records are read where they will stand in
 * one array (file_bytes.h), so a length in the file never makes us allocate; only the unpacked chunk does, up to
 * MCAP_CHUNK_LIMIT. Where no whole record stands, or one whose length leads to no other, the next one is looked for.
 */
#include "mcap.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "core/fault.h"
#include "file_bytes.h"
#include "mcap_channel.h"
#include "mcap_chunk.h"
#include "mcap_format.h"
#include "mcap_records.h"
#include "mcap_seek.h"
#include "mcap_summary.h"

#define SLOT_REPORTED UINT16_MAX

struct mcap_reader {
    struct mcap_records in;
    bool told_lost; /* that the file has lost bytes since it was opened */
    mcap_problem_fn problem;
    void *problem_ctx;
    struct mcap_info info;

    size_t at; /* of the next record of the data section */
    bool done;
    uint32_t crc; /* of the data section up to crc_at */
    size_t crc_at;

    struct mcap_cursor chunk; /* what is left of the open chunk */
    const uint8_t *chunk_start;
    size_t chunk_at; /* the open chunk's offset in the file */
    struct mcap_unpacker unpacker;

    struct mcap_channel *channel[MCAP_CHANNELS_MAX];
    bool announced[MCAP_CHANNELS_MAX]; /* of each: by the data, or else by the summary only */
    size_t n_channels;
    uint16_t slot[65536]; /* by channel id: index in channel[] + 1; 0: not announced */
};

static __attribute__((format(printf, 2, 3))) void problem(struct mcap_reader *r, const char *fmt, ...)
{
    char sentence[256];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(sentence, sizeof sentence, fmt, ap);
    va_end(ap);
    r->info.problems++;
    if (r->problem)
        r->problem(r->problem_ctx, sentence);
}

/* Once. */
static void tell_lost(struct mcap_reader *r)
{
    if (!r->in.file || r->told_lost || !file_bytes_lost(r->in.file))
        return;
    r->told_lost = true;
    problem(r, "the file was cut off, or could not be read, while it was played");
}

/* ---- channels ---- */

static void announce_channel(struct mcap_reader *r, struct mcap_cursor content, size_t offset, bool in_data)
{
    struct mcap_channel *new = mcap_parse_channel(content);
    if (!new) {
        problem(r, "offset %zu: the channel record is malformed or over %d bytes of text", offset,
                MCAP_STRING_MAX);
        return;
    }
    uint16_t *slot = &r->slot[new->id];
    if (*slot != 0 && *slot != SLOT_REPORTED) {
        const struct mcap_channel *old = r->channel[*slot - 1];
        if (strcmp(old->topic, new->topic) != 0 || strcmp(old->encoding, new->encoding) != 0)
            problem(r, "offset %zu: channel %u is announced %s; %s stays", offset, new->id,
                    r->announced[*slot - 1] ? "again with another name" : "with another name than in the summary",
                    r->announced[*slot - 1] ? "the first one" : "that of the summary");
        r->announced[*slot - 1] |= in_data;
        free(new);
    } else if (r->n_channels == MCAP_CHANNELS_MAX) {
        problem(r, "offset %zu: channel %u is one more than the %d that are read", offset, new->id,
                MCAP_CHANNELS_MAX);
        free(new);
    } else {
        new->index = (unsigned)r->n_channels;
        r->announced[new->index] = in_data;
        r->channel[r->n_channels++] = new;
        *slot = (uint16_t)r->n_channels;
    }
}

/* ---- messages and chunks ---- */

static bool take_message(struct mcap_reader *r, struct mcap_cursor c, size_t offset, struct mcap_message *out)
{
    size_t record_bytes = MCAP_RECORD_HEAD + (size_t)(c.end - c.p);
    uint16_t id = (uint16_t)mcap_take_int(&c, 2);
    *out = (struct mcap_message){.sequence = (uint32_t)mcap_take_int(&c, 4)};
    out->log_ns = mcap_take_int(&c, 8);
    out->publish_ns = mcap_take_int(&c, 8);
    if (c.bad) {
        problem(r, "offset %zu: a message record is too short for its own fields", offset);
        r->info.left_out_bytes += record_bytes;
        return false;
    }
    uint16_t *slot = &r->slot[id];
    if (*slot == 0 || *slot == SLOT_REPORTED) {
        if (*slot == 0)
            problem(r, "offset %zu: messages of channel %u, which was never announced, are left out", offset, id);
        *slot = SLOT_REPORTED;
        r->info.left_out_bytes += record_bytes;
        return false;
    }
    struct mcap_channel *channel = r->channel[*slot - 1];
    if (!r->announced[channel->index])
        problem(r, "offset %zu: channel %u is known from the summary only: its own record is damaged or missing",
                offset, id);
    r->announced[channel->index] = true;
    out->channel = channel;
    out->data = c.p;
    out->size = (size_t)(c.end - c.p);
    channel->messages++;
    channel->bytes += out->size;
    if (r->info.messages == 0 || out->log_ns < r->info.start_ns)
        r->info.start_ns = out->log_ns;
    if (r->info.messages == 0 || out->log_ns > r->info.end_ns)
        r->info.end_ns = out->log_ns;
    r->info.messages++;
    return true;
}

static void open_chunk(struct mcap_reader *r, const struct mcap_record *record, size_t offset)
{
    struct mcap_chunk chunk;
    const char *why = NULL;
    const uint8_t *records = NULL;
    r->in.chunked = true;
    if (!mcap_parse_chunk(record->content, &chunk))
        why = "its fields need more bytes than it has";
    else
        records = mcap_unpack(&r->unpacker, &chunk, &why);
    if (!records) {
        problem(r, "chunk at offset %zu is left out: %s", offset, why);
        if (!mcap_records_fit(&r->in, offset, record))
            r->at = mcap_records_find(&r->in, offset + 1, r->at);
        r->info.left_out_bytes += r->at - offset;
        return;
    }
    r->info.chunks++;
    r->chunk = (struct mcap_cursor){records, records + chunk.unpacked_size, false};
    r->chunk_start = records;
    r->chunk_at = offset;
}

/* Does the chunk end at `at` of its n bytes, or another record begin there? */
static bool is_followed_in_chunk(const uint8_t *p, size_t n, size_t at)
{
    struct mcap_record next;
    return at == n || (mcap_record_at(p + at, n - at, &next) && mcap_is_credible(&next));
}

/* The first record from byte 1 to `to` of what is left of the open chunk that reading can go on at; `to`: none. */
static size_t find_in_chunk(const struct mcap_reader *r, size_t to)
{
    const uint8_t *p = r->chunk.p;
    const size_t n = (size_t)(r->chunk.end - p);
    for (size_t at = 1; (at = mcap_seek(p, n, at, to, false)) < to; at++) {
        struct mcap_record record;
        if (mcap_record_at(p + at, n - at, &record) && is_followed_in_chunk(p, n, at + record.size))
            return at;
    }
    return to;
}

static void skip_in_chunk(struct mcap_reader *r)
{
    const uint8_t *from = r->chunk.p;
    r->chunk.p += find_in_chunk(r, (size_t)(r->chunk.end - from));
    r->info.left_out_bytes += (size_t)(r->chunk.p - from);
    if (r->chunk.p == r->chunk.end)
        problem(r, "chunk at offset %zu: truncated after its byte %td; the rest is skipped", r->chunk_at,
                from - r->chunk_start);
    else
        problem(r, "chunk at offset %zu: damaged at its byte %td; skipped %td bytes up to the next record",
                r->chunk_at, from - r->chunk_start, r->chunk.p - from);
}

/* The next record of the open chunk; true when it is a message. */
static bool next_in_chunk(struct mcap_reader *r, struct mcap_message *out)
{
    const size_t left = (size_t)(r->chunk.end - r->chunk.p);
    struct mcap_record record;
    if (!mcap_record_at(r->chunk.p, left, &record) ||
        (!is_followed_in_chunk(r->chunk.p, left, record.size) && find_in_chunk(r, record.size) < record.size)) {
        skip_in_chunk(r);
        return false;
    }
    r->chunk.p += record.size;
    if (record.opcode == MCAP_OP_CHANNEL)
        announce_channel(r, record.content, r->chunk_at, true);
    return record.opcode == MCAP_OP_MESSAGE && take_message(r, record.content, r->chunk_at, out);
}

/* ---- the data section ---- */

/* Is the last record a chunk that the end of the file cuts off, and of any use? Then what is there of it is open. */
static bool open_cut_chunk(struct mcap_reader *r)
{
    struct mcap_chunk chunk;
    size_t n = 0;
    if (r->in.size - r->at <= MCAP_RECORD_HEAD ||
        mcap_records_closed(&r->in)) /* closed: then its length is wrong */
        return false;
    mcap_records_need(&r->in, r->at, r->in.size);
    const struct mcap_cursor content = {r->in.data + r->at + MCAP_RECORD_HEAD, r->in.data + r->in.size, false};
    if (r->in.data[r->at] != MCAP_OP_CHUNK || !mcap_parse_cut_chunk(content, &chunk))
        return false;
    const uint8_t *records = mcap_unpack_cut(&r->unpacker, &chunk, &n);
    if (!records || n == 0)
        return false;
    problem(
        r,
        "offset %zu: the file ends within a chunk, still being written or cut off; its first %zu bytes are read",
        r->at, n);
    r->info.chunks++;
    r->chunk = (struct mcap_cursor){records, records + n, false};
    r->chunk_start = records;
    r->chunk_at = r->at;
    r->at = r->in.size;
    r->done = true;
    r->info.unclosed = true;
    return true;
}

/* No whole record at r->at. */
static void skip_damage(struct mcap_reader *r)
{
    const size_t from = r->at;
    r->at = from < r->in.size ? mcap_records_find(&r->in, from + 1, r->in.size) : from;
    if (r->at == r->in.size && from < r->in.size) {
        r->at = from;
        if (open_cut_chunk(r))
            return;
        r->at = r->in.size;
    }
    r->done = r->at == r->in.size;
    r->info.left_out_bytes += r->at - from;
    r->info.unclosed = r->done && !mcap_records_closed(&r->in);
    if (!r->done)
        problem(r, "offset %zu: no whole record; %zu bytes up to the next one are left out", from, r->at - from);
    else if (!r->info.unclosed)
        problem(r, "offset %zu: no whole record; the last %zu bytes are left out", from, r->in.size - from);
    else if (from < r->in.size)
        problem(
            r,
            "offset %zu: the file ends within a record, still being written or cut off; its last %zu bytes are "
            "left out",
            from, r->in.size - from);
    else
        problem(r, "the file ends at offset %zu without a summary: it is still being written, or was cut off",
                from);
}

static void check_data_crc(struct mcap_reader *r, struct mcap_cursor data_end, size_t offset)
{
    uint32_t want = (uint32_t)mcap_take_int(&data_end, 4);
    if (data_end.bad)
        problem(r, "offset %zu: the record that ends the data is too short", offset);
    else if (want != 0 && want != r->crc && r->info.problems == 0)
        problem(r, "the data before offset %zu was changed: its checksum is wrong", offset);
}

/* What stands behind the data section: nothing there is needed, but a changed bit should not go unseen. */
static void check_summary(struct mcap_reader *r)
{
    struct mcap_summary s;
    if (!mcap_summary_footer(&r->in, r->at, &s)) {
        problem(r, "the file does not end with a footer: it was cut off or damaged behind offset %zu", r->at);
        r->info.unclosed = !mcap_records_closed(&r->in);
        return;
    }
    if (s.start < r->at || s.start > s.footer_at)
        problem(r, "the footer says the summary begins at offset %" PRIu64 ", outside %zu to %zu", s.start, r->at,
                s.footer_at);
    else if (!mcap_summary_is_whole(&r->in, &s))
        problem(r, "the summary at offset %" PRIu64 " was changed: its checksum is wrong", s.start);
    else
        r->info.complete = true;
}

bool mcap_summary_end(struct mcap_reader *r, uint64_t *end_ns)
{
    return mcap_summary_last_ns(&r->in, end_ns);
}

/* A channel whose own record is damaged would take all of its messages along. */
static void learn_channels(struct mcap_reader *r)
{
    struct mcap_record record;
    struct mcap_summary s;
    if (!mcap_summary_find(&r->in, &s))
        return;
    for (size_t at = (size_t)s.start; mcap_summary_next(&r->in, &s, &at, &record);)
        if (record.opcode == MCAP_OP_CHANNEL)
            announce_channel(r, record.content, at - record.size, false);
}

static bool parse_attachment(struct mcap_cursor c, struct mcap_attachment *out)
{
    const uint8_t *start = c.p;
    out->log_ns = mcap_take_int(&c, 8);
    mcap_take_int(&c, 8);
    struct mcap_cursor name = mcap_take_sized(&c), media_type = mcap_take_sized(&c);
    uint64_t size = mcap_take_int(&c, 8);
    out->data = mcap_take(&c, size);
    const uint8_t *end = c.p;
    uint32_t crc = (uint32_t)mcap_take_int(&c, 4);
    if (c.bad)
        return false;
    out->size = (size_t)size;
    mcap_copy_text(out->name, sizeof out->name, name);
    mcap_copy_text(out->media_type, sizeof out->media_type, media_type);
    out->crc_good = crc == 0 || crc32_z(0, start, (size_t)(end - start)) == crc;
    return true;
}

static void meet_attachment(struct mcap_reader *r, const struct mcap_record *record, size_t offset)
{
    struct mcap_attachment attachment;
    if (parse_attachment(record->content, &attachment) && attachment.crc_good) {
        r->info.attachments++;
    } else {
        problem(r, "the attachment at offset %zu is malformed or its checksum is wrong", offset);
        r->info.left_out_bytes += record->size;
    }
}

static void meet_header(struct mcap_reader *r, struct mcap_cursor c)
{
    struct mcap_cursor profile = mcap_take_sized(&c), library = mcap_take_sized(&c);
    if (c.bad) {
        problem(r, "the header is malformed");
        return;
    }
    mcap_copy_text(r->info.profile, sizeof r->info.profile, profile);
    mcap_copy_text(r->info.library, sizeof r->info.library, library);
}

/* The next record of the data section; true when it is a message outside of chunks. */
static bool next_record(struct mcap_reader *r, struct mcap_message *out)
{
    struct mcap_record record;
    size_t offset = r->at;
    if (!mcap_records_head(&r->in, offset, &record) ||
        (record.opcode != MCAP_OP_CHUNK && !mcap_records_fit(&r->in, offset, &record))) {
        skip_damage(r);
        return false;
    }
    mcap_records_need(&r->in, r->crc_at, offset + record.size);
    r->crc = (uint32_t)crc32_z(r->crc, r->in.data + r->crc_at, offset - r->crc_at);
    r->crc_at = offset;
    if (r->in.file)
        file_bytes_drop(r->in.file, offset);
    r->at += record.size;
    switch (record.opcode) {
    case MCAP_OP_HEADER:
        meet_header(r, record.content);
        break;
    case MCAP_OP_CHANNEL:
        announce_channel(r, record.content, offset, true);
        break;
    case MCAP_OP_MESSAGE:
        return take_message(r, record.content, offset, out);
    case MCAP_OP_CHUNK:
        open_chunk(r, &record, offset);
        break;
    case MCAP_OP_ATTACHMENT:
        meet_attachment(r, &record, offset);
        break;
    case MCAP_OP_DATA_END:
        check_data_crc(r, record.content, offset);
        check_summary(r);
        r->done = true;
        break;
    case MCAP_OP_FOOTER:
        problem(r, "offset %zu: a footer, but the record that ends the data is missing", offset);
        r->done = true;
        break;
    default: /* indexes, which are not needed, and what the future brings */
        break;
    }
    return false;
}

bool mcap_next(struct mcap_reader *r, struct mcap_message *out)
{
    while (!r->done || r->chunk.p < r->chunk.end) {
        if (r->chunk.p < r->chunk.end ? next_in_chunk(r, out) : next_record(r, out))
            return true;
        tell_lost(r);
    }
    return false;
}

bool mcap_next_attachment(const struct mcap_reader *r, uint64_t *at, struct mcap_attachment *out)
{
    size_t offset = *at ? (size_t)*at : sizeof mcap_magic;
    struct mcap_record record;
    while (offset < r->in.size) {
        if (!mcap_records_head(&r->in, offset, &record) || !mcap_records_fit(&r->in, offset, &record)) {
            offset = mcap_records_find(&r->in, offset + 1, r->in.size);
            continue;
        }
        if (record.opcode == MCAP_OP_ATTACHMENT && r->in.file)
            file_bytes_keep(r->in.file, offset, offset + record.size);
        offset += record.size;
        *at = offset;
        if (record.opcode == MCAP_OP_DATA_END)
            break;
        if (record.opcode == MCAP_OP_ATTACHMENT && parse_attachment(record.content, out))
            return true;
    }
    *at = r->in.size;
    return false;
}

bool mcap_find_attachment(const struct mcap_reader *r, const char *name, struct mcap_attachment *out,
                          struct fault *fault)
{
    bool damaged = false;
    for (uint64_t at = 0; mcap_next_attachment(r, &at, out);) {
        if (strcmp(out->name, name) != 0)
            continue;
        if (out->crc_good)
            return true;
        damaged = true;
    }
    return fault_set(fault, damaged ? "attachment %s: its checksum is wrong" : "no attachment %s", name);
}

const struct mcap_channel *mcap_channel_at(const struct mcap_reader *r, size_t i)
{
    return i < r->n_channels ? r->channel[i] : NULL;
}

const struct mcap_info *mcap_info(const struct mcap_reader *r)
{
    return &r->info;
}

bool mcap_is_mostly_lost(const struct mcap_info *info)
{
    const bool damaged = info->problems > info->unclosed;
    return (damaged && info->messages == 0) || info->left_out_bytes > info->file_bytes / 2;
}

void mcap_lost_text(const struct mcap_info *info, struct fault *text)
{
    fault_set(text, "most of it is lost: %" PRIu64 " messages could be read", info->messages);
    if (info->left_out_bytes > 0)
        fault_add(text, ", %" PRIu64 " of %" PRIu64 " bytes are left out", info->left_out_bytes, info->file_bytes);
}

/* ---- open and close ---- */

static struct mcap_reader *new_reader(const void *data, size_t size, mcap_problem_fn problem_fn, void *ctx,
                                      struct fault *fault)
{
    if (size < sizeof mcap_magic || memcmp(data, mcap_magic, sizeof mcap_magic) != 0) {
        fault_set(fault, "not a capture: an MCAP file begins with 89 4D 43 41 50 30 0D 0A");
        return NULL;
    }
    struct mcap_reader *r = calloc(1, sizeof *r);
    if (!r) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    r->in.data = data;
    r->in.size = size;
    r->at = sizeof mcap_magic;
    r->problem = problem_fn;
    r->problem_ctx = ctx;
    r->info.file_bytes = size;
    return r;
}

struct mcap_reader *mcap_open_memory(const void *data, size_t size, mcap_problem_fn problem_fn, void *ctx,
                                     struct fault *fault)
{
    struct mcap_reader *r = new_reader(data, size, problem_fn, ctx, fault);
    if (r)
        learn_channels(r);
    return r;
}

struct mcap_reader *mcap_open(const char *path, mcap_problem_fn problem_fn, void *ctx, struct fault *fault)
{
    struct file_bytes *file = file_bytes_open(path, fault);
    struct fault why;
    if (!file)
        return NULL;
    const size_t size = file_bytes_size(file);
    file_bytes_need(file, 0, size < sizeof mcap_magic ? size : sizeof mcap_magic);
    struct mcap_reader *r = new_reader(file_bytes_data(file), size, problem_fn, ctx, &why);
    if (!r) {
        fault_set(fault, "%s: %s", path, why.text);
        file_bytes_close(file);
        return NULL;
    }
    r->in.file = file;
    learn_channels(r);
    return r;
}

void mcap_close(struct mcap_reader *r)
{
    if (!r)
        return;
    file_bytes_close(r->in.file);
    for (size_t i = 0; i < r->n_channels; i++)
        free(r->channel[i]);
    mcap_unpacker_free(&r->unpacker);
    free(r);
}
