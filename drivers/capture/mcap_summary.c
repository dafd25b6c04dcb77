/* SPDX-License-Identifier: MIT */
/* mcap_summary - see the header. */
#include "mcap_summary.h"

#include <string.h>
#include <zlib.h>

/* The footer as the file ends with it. False: it was cut off or damaged. All of the file from `from` on is read. */
static bool find_footer(const struct mcap_records *in, size_t from, struct mcap_record *footer)
{
    const size_t tail = MCAP_FOOTER_BYTES + sizeof mcap_magic;
    mcap_records_need(in, from, in->size);
    return in->size - from >= tail && mcap_records_closed(in) &&
           mcap_record_at(in->data + in->size - tail, MCAP_FOOTER_BYTES, footer) &&
           footer->opcode == MCAP_OP_FOOTER && footer->size == MCAP_FOOTER_BYTES;
}

static struct mcap_summary parse_footer(const struct mcap_records *in, struct mcap_record footer)
{
    struct mcap_summary s = {.footer_at = in->size - MCAP_FOOTER_BYTES - sizeof mcap_magic};
    s.start = mcap_take_int(&footer.content, 8);
    mcap_take_int(&footer.content, 8);
    s.crc = (uint32_t)mcap_take_int(&footer.content, 4);
    if (s.start == 0)
        s.start = s.footer_at;
    return s;
}

bool mcap_summary_footer(const struct mcap_records *in, size_t from, struct mcap_summary *out)
{
    struct mcap_record footer;
    if (!find_footer(in, from, &footer))
        return false;
    *out = parse_footer(in, footer);
    return true;
}

bool mcap_summary_is_whole(const struct mcap_records *in, const struct mcap_summary *s)
{
    const size_t end = s->footer_at + MCAP_RECORD_HEAD + 16;
    return s->crc == 0 || crc32_z(0, in->data + s->start, end - (size_t)s->start) == s->crc;
}

/* Its messages, schemas, channels, attachments, metadata and chunks are counted before the two times. */
static bool parse_statistics(struct mcap_cursor c, uint64_t *end_ns)
{
    const uint64_t messages = mcap_take_int(&c, 8);
    mcap_take(&c, 2 + 4 + 4 + 4 + 4 + 8);
    *end_ns = mcap_take_int(&c, 8);
    return !c.bad && messages > 0;
}

bool mcap_summary_find(const struct mcap_records *in, struct mcap_summary *out)
{
    const size_t tail = MCAP_FOOTER_BYTES + sizeof mcap_magic;
    if (in->size < tail + sizeof mcap_magic || !mcap_summary_footer(in, in->size - tail, out))
        return false;
    if (out->start < sizeof mcap_magic || out->start > out->footer_at)
        return false;
    mcap_records_need(in, (size_t)out->start, in->size);
    return mcap_summary_is_whole(in, out);
}

bool mcap_summary_next(const struct mcap_records *in, const struct mcap_summary *s, size_t *at,
                       struct mcap_record *out)
{
    if (*at >= s->footer_at || !mcap_record_at(in->data + *at, s->footer_at - *at, out))
        return false;
    *at += (size_t)out->size;
    return true;
}

bool mcap_summary_last_ns(const struct mcap_records *in, uint64_t *end_ns)
{
    struct mcap_record record;
    struct mcap_summary s;
    if (!mcap_summary_find(in, &s))
        return false;
    for (size_t at = (size_t)s.start; mcap_summary_next(in, &s, &at, &record);)
        if (record.opcode == MCAP_OP_STATISTICS)
            return parse_statistics(record.content, end_ns);
    return false;
}
