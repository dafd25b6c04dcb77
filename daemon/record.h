/* SPDX-License-Identifier: MIT */
/*
 * record - keeps what the ports read and wrote, and the poses, as captures in a folder: parts of limited size, the
 * oldest removed. Knows no port and no client; never stops the daemon.
 *
 * A chunk goes to disk with a plain write(2) from the loop's thread, and a new part with an fsync(2) of the
 * folder: on a disk that stalls, the loop waits for it. Each write starts the kernel's writing-back at once, so a
 * power cut costs about the time between two commits of the file system, and the daemon's own death costs at most
 * the open chunk (1 s).
 */
#ifndef SONARD_RECORD_H
#define SONARD_RECORD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define RECORD_CHANNELS_MAX  64
#define RECORD_MESSAGE_BYTES 65536 /* longest message */
#define RECORD_CHUNK_AGE_NS  1000000000ull
#define RECORD_RETRY_NS      60000000000ull /* after a failure recording starts again so much later */

/* Counters only grow. */
struct record_status {
    bool recording;         /* false: stopped by an error, a new part is tried later */
    uint64_t parts;         /* files begun */
    uint64_t messages;      /* handed in */
    uint64_t lost_messages; /* refused, or in a chunk that could not be written */
    uint64_t errors;        /* a log line is due when this has grown */
    char error[320];        /* the newest error; empty: none yet */
    char path[512];         /* of the newest part */
};

struct record;

/**
 * record_open - start recording into `directory`, which is made if only its last component is missing.
 *
 * file_size       bytes after which another part is begun (it is exceeded by less than a chunk and the summary)
 * files           parts kept in the folder, of this and earlier runs; <= 0: all
 * conf_text       attached to every part as sonard.conf; copied
 * unix_offset_ns  Unix time minus monotonic time: log times are monotonic times plus this
 * now_ns          monotonic
 *
 * Files are named sonard-YYYYmmddTHHMMSSZ-NNN.mcap after the UTC time of the start and the number of the part.
 * NULL with a sentence in err. Allocates what a part needs; later parts allocate anew when they begin.
 */
struct record *record_open(const char *directory, uint64_t file_size, int files, const char *conf_text,
                           size_t conf_size, uint64_t unix_offset_ns, uint64_t now_ns, char *err, size_t err_size);

/**
 * record_channel - a channel of all parts, for instance "/front/rx" with "octet-stream" or "/pose" with "json".
 * Returns its number, or -1 when RECORD_CHANNELS_MAX are there or the texts are too long.
 */
int record_channel(struct record *rec, const char *topic, const char *encoding);

/** record_message - keep n bytes that came or went at t_ns (monotonic). False: lost; record_status says why. */
bool record_message(struct record *rec, int channel, uint64_t t_ns, const void *data, size_t n);

/**
 * record_tick - write a chunk older than RECORD_CHUNK_AGE_NS, try again after a failure; call it twice a second.
 */
void record_tick(struct record *rec, uint64_t now_ns);

const struct record_status *record_status(const struct record *rec);

/** record_close - complete the open part. NULL is allowed. */
void record_close(struct record *rec);

#endif
