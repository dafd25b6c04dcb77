/* SPDX-License-Identifier: MIT */
/*
 * mcap_chunk - takes chunk records apart, unpacks them, and finds them where the chain of records is broken. Part
 * of the MCAP reader; knows neither channels nor messages.
 */
#ifndef SONARD_MCAP_CHUNK_H
#define SONARD_MCAP_CHUNK_H

#include <lz4.h>
#include <lz4frame.h>
#include <zstd.h>

#include "mcap_format.h"

struct mcap_chunk {
    uint64_t start_ns, end_ns, unpacked_size;
    uint32_t crc;
    struct mcap_cursor compression;
    const uint8_t *records;
    uint64_t records_size;
};

/* Memory and contexts that are kept from chunk to chunk. Zeroed before the first. */
struct mcap_unpacker {
    uint8_t *buffer;
    size_t cap;
    LZ4F_dctx *lz4;
    ZSTD_DCtx *zstd;
};

/** mcap_parse_chunk - the fields of a chunk record's content. False when it is too short for them. */
bool mcap_parse_chunk(struct mcap_cursor content, struct mcap_chunk *out);

/**
 * mcap_unpack - the chunk's unpacked_size bytes of records, valid until the next call and as long as the chunk.
 * NULL, with the end of a sentence in *why, when they are over MCAP_CHUNK_LIMIT, damaged, or of unknown
 * compression.
 */
const uint8_t *mcap_unpack(struct mcap_unpacker *u, const struct mcap_chunk *chunk, const char **why);

/** mcap_parse_cut_chunk - the same for a chunk record that the end of the file cuts off: its records are those that
 * are there. */
bool mcap_parse_cut_chunk(struct mcap_cursor content, struct mcap_chunk *out);

/**
 * mcap_unpack_cut - what can be unpacked of a chunk that is cut off; *n: how many bytes, as valid as those of
 * mcap_unpack. No checksum covers them. NULL: nothing.
 */
const uint8_t *mcap_unpack_cut(struct mcap_unpacker *u, const struct mcap_chunk *chunk, size_t *n);

/** mcap_is_credible_chunk - do the fields of a whole chunk record agree with each other? */
bool mcap_is_credible_chunk(struct mcap_cursor content);

void mcap_unpacker_free(struct mcap_unpacker *u);

#endif
