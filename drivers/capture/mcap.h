/* SPDX-License-Identifier: MIT */
/*
 * mcap - the capture file (MCAP, mcap.dev): timestamped bytes on named channels, append only. Writes and reads the
 * part of the format that sonard needs: channels, with a schema or without, messages in compressed chunks with indexes,
 * attachments, and the summary at the end. Knows no sonar, no clock and no folder.
 *
 * The writer never changes what is on disk: a power cut costs the open chunk and the summary, and the reader does
 * without both. The reader trusts nothing in the file: what is damaged is named, counted and left out.
 */
#ifndef SONARD_MCAP_H
#define SONARD_MCAP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

#define MCAP_CHANNELS_MAX  1024
#define MCAP_STRING_MAX    4096         /* bytes of a topic, an encoding, a name */
#define MCAP_CHUNK_BYTES   (256u << 10) /* usual size of a chunk before compression */
#define MCAP_MESSAGE_BYTES (64u << 10)  /* usual limit of one message */
#define MCAP_INDEX_BYTES   (2u << 20)   /* usual room for the index of chunks: about 20000 chunks */
#define MCAP_CHUNK_LIMIT   (64u << 20)  /* reader and writer refuse chunks and messages beyond */

enum mcap_compression { MCAP_LZ4, MCAP_NONE, MCAP_ZSTD };

/* One entry of a channel's metadata. */
struct mcap_pair {
    const char *key, *value;
};

/* A channel as a file announces it. What is read lives as long as the reader. */
struct mcap_channel {
    uint16_t id;        /* in the file */
    unsigned index;     /* as mcap_channel_at counts */
    uint16_t schema_id; /* 0: none */
    const char *topic, *encoding;
    const struct mcap_pair *metadata;
    size_t n_metadata;
    uint64_t messages, bytes; /* handed out by mcap_next so far */
};

/* What is read is valid until the next call on the reader. */
struct mcap_message {
    const struct mcap_channel *channel;
    uint32_t sequence;
    uint64_t log_ns, publish_ns; /* of any epoch */
    const uint8_t *data;
    size_t size;
};

/* What is read has data that live as long as the reader; names too long for their array are cut. */
struct mcap_attachment {
    uint64_t log_ns;
    char name[128], media_type[64];
    const uint8_t *data;
    size_t size;
    bool crc_good; /* or the file has none */
};

/* ---- writing ---- */

struct mcap_options {
    const char *library;               /* who writes, "sonard 1.0" */
    enum mcap_compression compression; /* zero: LZ4 */
    size_t chunk_bytes;                /* a chunk is written when it is this large; 0: MCAP_CHUNK_BYTES */
    size_t message_bytes;              /* largest message; larger ones are refused; 0: MCAP_MESSAGE_BYTES */
    size_t index_bytes;                /* room for the index of chunks; 0: MCAP_INDEX_BYTES */
    const char *profile;               /* what readers may expect; NULL: that of sonard's own captures */
};

struct mcap_written {
    uint64_t bytes;    /* on disk */
    uint64_t messages; /* on disk */
    uint64_t waiting;  /* messages in the open chunk */
    uint64_t lost;     /* messages in chunks that could not be written */
    uint64_t chunks;
    bool full; /* no room for another chunk in the index: close, and begin another file */
};

struct mcap_writer;

/**
 * mcap_create - begin a capture on fd, an empty file open for writing. The writer owns fd from here on, also when
 * it fails. Allocates all that mcap_write_message and mcap_flush will need.
 * NULL with a sentence in fault.
 */
struct mcap_writer *mcap_create(int fd, const struct mcap_options *options, struct fault *fault);

/**
 * mcap_add_schema - announce what messages look like: its name, "jsonschema" or the like, and n bytes of it. Returns
 * the number for mcap_add_channel_of, > 0, or -1 with a sentence in fault.
 */
int mcap_add_schema(struct mcap_writer *w, const char *name, const char *encoding, const void *schema, size_t n,
                    struct fault *fault);

/**
 * mcap_add_channel - announce a channel; its record is on disk at once, so that a damaged chunk does not take it
 * along. metadata may be NULL when n_metadata is 0. Returns the channel's number, or -1 with a sentence in fault.
 */
int mcap_add_channel(struct mcap_writer *w, const char *topic, const char *encoding,
                     const struct mcap_pair *metadata, size_t n_metadata, struct fault *fault);

/** mcap_add_channel_of - the same for a channel of a schema, by its number, and without metadata. */
int mcap_add_channel_of(struct mcap_writer *w, int schema, const char *topic, const char *encoding,
                        struct fault *fault);

/** mcap_attach - write an attachment; crc_good is not looked at. False with a sentence in fault. */
bool mcap_attach(struct mcap_writer *w, const struct mcap_attachment *attachment, struct fault *fault);

/**
 * mcap_write_message - add a message to the open chunk, writing the chunk when it is full. channel: a number of
 * mcap_add_channel; message->channel, which is a reader's, is not looked at. Two write(2) at most; no allocation.
 * False with a sentence in fault: the message is too large, the index is full, or the disk refuses; in the last case
 * the messages of the chunk are lost (mcap_written), what was on disk stays whole, and a later call may work again.
 */
bool mcap_write_message(struct mcap_writer *w, int channel, const struct mcap_message *message,
                        struct fault *fault);

/** mcap_flush - write the open chunk, if it holds anything. False as above. */
bool mcap_flush(struct mcap_writer *w, struct fault *fault);

struct mcap_written mcap_written(const struct mcap_writer *w);

/** mcap_fd - the file, for fstat and the like. */
int mcap_fd(const struct mcap_writer *w);

/**
 * mcap_finish - flush, write the summary, close the file, free w. False with a sentence in fault; w is gone anyway.
 */
bool mcap_finish(struct mcap_writer *w, struct fault *fault);

/* ---- reading ---- */

/* What mcap_next has met so far; all of the file once it has returned false. */
struct mcap_info {
    char profile[64], library[64];
    uint64_t file_bytes;
    uint64_t messages, chunks, attachments;
    uint64_t start_ns, end_ns; /* least and greatest log time; both 0 without messages */
    uint64_t problems;         /* calls of the problem function */
    uint64_t left_out_bytes;   /* of the file, or of an uncompressed chunk, that could not be used */
    bool complete;             /* the file was closed: it has its summary and footer, undamaged */
    bool unclosed; /* it ends before that, which is one of the problems: still being written, or cut off */
};

/* Called for every damage: one sentence, naming the offset in the file. */
typedef void (*mcap_problem_fn)(void *ctx, const char *sentence);

struct mcap_reader;

/**
 * mcap_open - read the capture `path`; channels are those of its summary, too. problem may be NULL. NULL with a
 * sentence in fault when it is no capture. Of a file that grows, what was there is read; of one that is cut off
 * meanwhile, what is left, and a problem says so.
 */
struct mcap_reader *mcap_open(const char *path, mcap_problem_fn problem, void *ctx, struct fault *fault);

/** mcap_open_memory - the same over bytes that stay where they are until mcap_close. */
struct mcap_reader *mcap_open_memory(const void *data, size_t size, mcap_problem_fn problem, void *ctx,
                                     struct fault *fault);

/**
 * mcap_next - the next message in the file's order (log times of different channels may go back a little).
 * False at the end; damage never ends it early unless nothing readable follows.
 */
bool mcap_next(struct mcap_reader *r, struct mcap_message *out);

/**
 * mcap_summary_end - the greatest log time of all messages as the summary of a closed file has it, which nothing but
 * the summary's checksum vouches for. False: it has no summary, or a damaged one, or one without statistics.
 */
bool mcap_summary_end(struct mcap_reader *r, uint64_t *end_ns);

/** mcap_channel_at - the i-th channel of the summary, or else that has been met, NULL beyond the last. */
const struct mcap_channel *mcap_channel_at(const struct mcap_reader *r, size_t i);

/** mcap_next_attachment - walk over the attachments; *at is 0 before the first call. Independent of mcap_next. */
bool mcap_next_attachment(const struct mcap_reader *r, uint64_t *at, struct mcap_attachment *out);

/** mcap_find_attachment - the first undamaged attachment of that name. False with a sentence in fault. */
bool mcap_find_attachment(const struct mcap_reader *r, const char *name, struct mcap_attachment *out,
                          struct fault *fault);

const struct mcap_info *mcap_info(const struct mcap_reader *r);

/** mcap_is_mostly_lost - is more than half of a file left out, or every message for damage? */
bool mcap_is_mostly_lost(const struct mcap_info *info);

/** mcap_lost_text - of such a file: "most of it is lost: 3 messages could be read, 700 of 900 bytes are left out". */
void mcap_lost_text(const struct mcap_info *info, struct fault *text);

void mcap_close(struct mcap_reader *r);

#endif
