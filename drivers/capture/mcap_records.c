/* SPDX-License-Identifier: MIT */
/* mcap_records - see the header. */
#include "mcap_records.h"

#include <string.h>

#include "mcap_seek.h"

#define SEARCH_BYTES ((size_t)1 << 18) /* at a time, for a record behind damage */

void mcap_records_need(const struct mcap_records *in, size_t from, size_t to)
{
    if (in->file)
        file_bytes_need(in->file, from, to);
}

bool mcap_records_head(const struct mcap_records *in, size_t offset, struct mcap_record *out)
{
    uint8_t head[MCAP_RECORD_HEAD];
    if (!in->file)
        return mcap_record_at(in->data + offset, in->size - offset, out);
    if (!file_bytes_peek(in->file, offset, head, sizeof head))
        return false;
    return mcap_record_head(head, in->data + offset, in->size - offset, out);
}

bool mcap_records_closed(const struct mcap_records *in)
{
    if (in->size < sizeof mcap_magic)
        return false;
    mcap_records_need(in, in->size - sizeof mcap_magic, in->size);
    return memcmp(in->data + in->size - sizeof mcap_magic, mcap_magic, sizeof mcap_magic) == 0;
}

/* Is the end of a record where another one begins, or the file ends? */
static bool is_followed(const struct mcap_records *in, size_t end)
{
    struct mcap_record next;
    if (end == in->size || (end == in->size - sizeof mcap_magic && mcap_records_closed(in)))
        return true;
    return mcap_records_head(in, end, &next) && mcap_is_credible(&next);
}

size_t mcap_records_find(const struct mcap_records *in, size_t from, size_t to)
{
    for (size_t at = from, end; at < to; at = end) {
        struct mcap_record record;
        end = to - at > SEARCH_BYTES ? at + SEARCH_BYTES : to;
        mcap_records_need(in, at, in->size - end > MCAP_SEEK_AHEAD ? end + MCAP_SEEK_AHEAD : in->size);
        for (size_t found; (found = mcap_seek(in->data, in->size, at, end, in->chunked)) < end; at = found + 1)
            if (mcap_record_at(in->data + found, in->size - found, &record) &&
                (record.opcode == MCAP_OP_CHUNK || is_followed(in, found + record.size)))
                return found;
    }
    return to;
}

bool mcap_records_fit(const struct mcap_records *in, size_t offset, const struct mcap_record *record)
{
    const size_t end = offset + record->size;
    return is_followed(in, end) || mcap_records_find(in, offset + 1, end) == end;
}
