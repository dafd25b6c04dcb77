/* SPDX-License-Identifier: MIT */
/*
 * mcap_records - where the records of a capture stand, be it whole or damaged: in a file, whose bytes are read where
 * they will stand in one array, or in memory. Knows of their content only what mcap_seek does.
 */
#ifndef SONARD_MCAP_RECORDS_H
#define SONARD_MCAP_RECORDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "file_bytes.h"
#include "mcap_format.h"

struct mcap_records {
    const uint8_t *data; /* only what mcap_records_need asked for holds the file's bytes */
    size_t size;
    struct file_bytes *file; /* NULL: the data are all there */
    bool chunked;            /* messages are in chunks */
};

/** mcap_records_need - from now on these bytes can be read; where the file has lost them they are zeros. */
void mcap_records_need(const struct mcap_records *in, size_t from, size_t to);

/** mcap_records_head - is there a whole record at `offset`? Its head is read, its content is not yet. */
bool mcap_records_head(const struct mcap_records *in, size_t offset, struct mcap_record *out);

/** mcap_records_closed - does the file end as every file does that was closed? */
bool mcap_records_closed(const struct mcap_records *in);

/** mcap_records_find - the first record in from .. to that reading can go on at; `to`: there is none. */
size_t mcap_records_find(const struct mcap_records *in, size_t from, size_t to);

/** mcap_records_fit - is the record's length right? Not if it leads to no other, but past the beginning of one. */
bool mcap_records_fit(const struct mcap_records *in, size_t offset, const struct mcap_record *record);

#endif
