/* SPDX-License-Identifier: MIT */
/*
 * segments - writes messages to captures in a folder: segments of limited size, the oldest removed. Knows no port, no
 * client and no thread; its calls wait for the disk.
 *
 * A chunk goes to disk with a plain write(2), a new segment with an fsync(2) of the folder. Each write starts the
 * kernel's writing-back at once, so a power cut costs about the time between two commits of the file system, and the
 * process's own death costs at most the open chunk (1 s).
 */
#ifndef SONARD_SEGMENTS_H
#define SONARD_SEGMENTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

#define SEGMENTS_CHANNELS_MAX  64
#define SEGMENTS_MESSAGE_BYTES 65536 /* longest message */
#define SEGMENTS_CHUNK_AGE_NS  1000000000ull

/* After a failure recording starts again so much later, then after twice the time, and so on. */
#define SEGMENTS_RETRY_FIRST_NS 1000000000ull
#define SEGMENTS_RETRY_MOST_NS  30000000000ull

/* Counters only grow. */
struct segments_status {
    bool recording; /* false: paused, or stopped by an error; then a new segment is tried at growing intervals */
    bool paused;    /* on request: what comes is not kept, and not lost */
    uint64_t segments;      /* files started */
    uint64_t messages;      /* handed in */
    uint64_t lost_messages; /* refused, or in a chunk that could not be written */
    uint64_t errors;        /* a log line is due when this has grown: recording stopped, or has another cause to */
    uint64_t resumed;       /* likewise: a chunk went to disk again, ... */
    uint64_t lost_in_gap;   /* ... after so many messages were lost */
    struct fault error;     /* the newest error; empty: none yet */
    char path[512];         /* of the newest segment */
};

struct segments;

/* When bytes came or went, monotonic: at t_ns at the latest, and not before since_ns. In a capture they are the log
 * time and the publish time of a message. */
struct record_time {
    uint64_t t_ns, since_ns;
};

struct segments_conf {
    /* Made if only its last component is missing, at the start and whenever it has gone; but never used on the system's
     * disk when it was on another at the start: that one is not mounted any more. */
    const char *directory;
    uint64_t
        file_size; /* bytes after which another segment begins, exceeded by less than a chunk and the summary */
    int files;     /* segments kept in the folder, of this and earlier runs; <= 0: all */
    const char *conf_text; /* attached to every segment as sonard.conf; copied */
    size_t conf_size;
    uint64_t unix_offset_ns; /* Unix time minus monotonic time: log times are monotonic times plus this */
    bool paused; /* at first, see segments_pause: no disk is touched; files are those of a single recording */
};

/**
 * segments_open - start recording at now_ns (monotonic).
 *
 * Files are named sonard-YYYYmmddTHHMMSSZ-NNN.mcap after the UTC time at which recording began and the number of the
 * segment.
 * NULL with a sentence in fault. Allocates what a segment needs; later segments allocate anew when they begin.
 */
struct segments *segments_open(const struct segments_conf *conf, uint64_t now_ns, struct fault *fault);

/**
 * segments_channel - a channel of all segments, for instance "/front/rx" with "octet-stream" or "/pose" with "json".
 * Returns its number, or -1 when SEGMENTS_CHANNELS_MAX are there or the texts are too long.
 */
int segments_channel(struct segments *segments, const char *topic, const char *encoding);

/** segments_message - keep n bytes that came or went then. False: lost; segments_status says why. */
bool segments_message(struct segments *segments, int channel, const struct record_time *then, const void *data,
                      size_t n);

/** segments_conf - from the next segment on n bytes of `text` are attached; the old ones when there is no memory. */
void segments_conf(struct segments *segments, const char *text, size_t n);

/**
 * segments_tick - write a chunk older than SEGMENTS_CHUNK_AGE_NS, try again after a failure; call it twice a second.
 */
void segments_tick(struct segments *segments, uint64_t now_ns);

/**
 * segments_pause - complete the open segment and keep nothing, or start a new one, at now_ns (monotonic). A segment
 * into which nothing was written does not stay. While paused, no disk is touched.
 */
void segments_pause(struct segments *segments, bool paused, uint64_t now_ns);

const struct segments_status *segments_status(const struct segments *segments);

/** segments_close - complete the open segment. NULL is allowed. */
void segments_close(struct segments *segments);

#endif
