/* SPDX-License-Identifier: MIT */
/*
 * mcap_summary - what stands behind the data of a capture that was closed: channels, statistics and the footer.
 */
#ifndef SONARD_MCAP_SUMMARY_H
#define SONARD_MCAP_SUMMARY_H

#include "mcap_records.h"

/* Where the summary begins, and the checksum from there to its place in the footer (0: the file has none). */
struct mcap_summary {
    uint64_t start; /* as the footer has it: anywhere */
    size_t footer_at;
    uint32_t crc;
};

/** mcap_summary_footer - what the footer says; the file is read from `from` on. False: it was cut off or damaged. */
bool mcap_summary_footer(const struct mcap_records *in, size_t from, struct mcap_summary *out);

/** mcap_summary_is_whole - by its checksum; its start is not behind the footer, and its bytes were read. */
bool mcap_summary_is_whole(const struct mcap_records *in, const struct mcap_summary *s);

/** mcap_summary_find - the summary of a closed file, read and whole by its checksum. False: it has none. */
bool mcap_summary_find(const struct mcap_records *in, struct mcap_summary *out);

/** mcap_summary_next - the record of the summary at *at, and *at behind it. False: the end. */
bool mcap_summary_next(const struct mcap_records *in, const struct mcap_summary *s, size_t *at,
                       struct mcap_record *out);

/** mcap_summary_last_ns - the greatest log time by the statistics of a summary that is whole. False: there are none. */
bool mcap_summary_last_ns(const struct mcap_records *in, uint64_t *end_ns);

#endif
