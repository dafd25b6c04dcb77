/* SPDX-License-Identifier: MIT */
/* mcap_seek - see the header. */
#include "mcap_seek.h"

#include "mcap_chunk.h"

/* Bytes that the fields of a record need at least, its texts and lists being empty. Source: mcap.dev/spec. */
static const uint8_t fields_bytes[] = {
    [MCAP_OP_HEADER] = 8,          [MCAP_OP_FOOTER] = 20,
    [MCAP_OP_SCHEMA] = 14,         [MCAP_OP_CHANNEL] = 16,
    [MCAP_OP_MESSAGE] = 22,        [MCAP_OP_CHUNK] = 40,
    [MCAP_OP_MESSAGE_INDEX] = 6,   [MCAP_OP_CHUNK_INDEX] = 60,
    [MCAP_OP_ATTACHMENT] = 36,     [MCAP_OP_ATTACHMENT_INDEX] = 48,
    [MCAP_OP_STATISTICS] = 46,     [MCAP_OP_METADATA] = 8,
    [MCAP_OP_METADATA_INDEX] = 20, [MCAP_OP_SUMMARY_OFFSET] = 17,
    [MCAP_OP_DATA_END] = 4,
};

bool mcap_is_credible(const struct mcap_record *record)
{
    const uint64_t length = record->size - MCAP_RECORD_HEAD;
    if (record->opcode == 0)
        return false;
    return record->opcode < sizeof fields_bytes ? length >= fields_bytes[record->opcode] : length > 0;
}

static bool can_go_on_at(const struct mcap_record *record, bool chunked)
{
    switch (record->opcode) {
    case MCAP_OP_CHUNK:
        return mcap_is_credible_chunk(record->content);
    case MCAP_OP_DATA_END:
        return record->size == MCAP_RECORD_HEAD + fields_bytes[MCAP_OP_DATA_END];
    case MCAP_OP_ATTACHMENT:
    case MCAP_OP_METADATA:
        return mcap_is_credible(record);
    case MCAP_OP_SCHEMA:
    case MCAP_OP_CHANNEL:
    case MCAP_OP_MESSAGE:
        return !chunked && mcap_is_credible(record);
    default:
        return false;
    }
}

size_t mcap_seek(const uint8_t *data, size_t size, size_t from, size_t to, bool chunked)
{
    for (size_t at = from; at < to; at++) {
        struct mcap_record record;
        if (data[at] >= 1 && data[at] <= MCAP_OP_DATA_END && mcap_record_at(data + at, size - at, &record) &&
            can_go_on_at(&record, chunked))
            return at;
    }
    return to;
}
