/* SPDX-License-Identifier: MIT */
/*
 * parts - writes messages to captures in a folder: parts of limited size, the oldest removed. Knows no port, no client
 * and no thread; its calls wait for the disk.
 *
 * A chunk goes to disk with a plain write(2), a new part with an fsync(2) of the folder. Each write starts the
 * kernel's writing-back at once, so a power cut costs about the time between two commits of the file system, and the
 * process's own death costs at most the open chunk (1 s).
 */
#ifndef SONARD_PARTS_H
#define SONARD_PARTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define PARTS_CHANNELS_MAX  64
#define PARTS_MESSAGE_BYTES 65536 /* longest message */
#define PARTS_CHUNK_AGE_NS  1000000000ull
#define PARTS_RETRY_NS      60000000000ull /* after a failure recording starts again so much later */

/* Counters only grow. */
struct parts_status {
    bool recording;         /* false: stopped by an error, a new part is tried later */
    uint64_t parts;         /* files begun */
    uint64_t messages;      /* handed in */
    uint64_t lost_messages; /* refused, or in a chunk that could not be written */
    uint64_t errors;        /* a log line is due when this has grown */
    char error[320];        /* the newest error; empty: none yet */
    char path[512];         /* of the newest part */
};

struct parts;

/**
 * parts_open - start recording into `directory`, which is made if only its last component is missing.
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
struct parts *parts_open(const char *directory, uint64_t file_size, int files, const char *conf_text,
                         size_t conf_size, uint64_t unix_offset_ns, uint64_t now_ns, char *err, size_t err_size);

/**
 * parts_channel - a channel of all parts, for instance "/front/rx" with "octet-stream" or "/pose" with "json".
 * Returns its number, or -1 when PARTS_CHANNELS_MAX are there or the texts are too long.
 */
int parts_channel(struct parts *parts, const char *topic, const char *encoding);

/** parts_message - keep n bytes that came or went at t_ns (monotonic). False: lost; parts_status says why. */
bool parts_message(struct parts *parts, int channel, uint64_t t_ns, const void *data, size_t n);

/**
 * parts_tick - write a chunk older than PARTS_CHUNK_AGE_NS, try again after a failure; call it twice a second.
 */
void parts_tick(struct parts *parts, uint64_t now_ns);

const struct parts_status *parts_status(const struct parts *parts);

/** parts_close - complete the open part. NULL is allowed. */
void parts_close(struct parts *parts);

#endif
