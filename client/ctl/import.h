/* SPDX-License-Identifier: MIT */
/*
 * import - recordings of other programs as a stream of timed bytes, as a port would have read them: Ping-Viewer's
 * sensor logs and MCAP files, text dumps of Ping360 messages as the ping-python tools print them, and the bytes of a
 * SeaNet line, raw or as a relay's log of UDP datagrams. Pure: bytes in, calls out; no file, no clock.
 */
#ifndef SONARD_IMPORT_H
#define SONARD_IMPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "drivers/devices/ping_frame.h"

struct seanet_frame;

enum import_kind {
    IMPORT_UNKNOWN,
    IMPORT_PING_VIEWER,
    IMPORT_TEXT,
    IMPORT_SEANET_RELAY,
    IMPORT_SEANET,
    IMPORT_IMAGENEX,
    IMPORT_SVLOG,
    IMPORT_VIEWER2
};

struct import_sink {
    void *ctx;
    /* n bytes came in at t_ns, counted from the start of the recording, or since 1970 where it has dates; never falls.
     * False: stop. */
    bool (*bytes)(void *ctx, uint64_t t_ns, const uint8_t *bytes, size_t n);
    void (*problem)(void *ctx, const char *sentence); /* something was left out or is doubtful */
};

struct import_result {
    uint64_t records;        /* handed to the sink */
    uint64_t left_out_bytes; /* of the file, for damage */
    bool times_made_up;      /* the file has none: see IMPORT_PACE_NS */
    bool stopped;            /* by the sink */
};

/* What a head takes for a ping beyond listening: turning, and the samples over the line. */
#define IMPORT_PACE_NS 42000000u

/** import_kind - from the content. */
enum import_kind import_kind(const uint8_t *data, size_t size);

/**
 * import_ping_viewer - each record of the log goes to the sink with its time: what one read of the link returned,
 * frames cut anywhere. A record whose length is wrong ends where the next whole one begins. Time stamps may be in the
 * decimal digits of any script (the log is written in the locale of the PC). False, nothing read, when the head of the
 * log is not as expected.
 */
bool import_ping_viewer(const uint8_t *data, size_t size, const struct import_sink *sink,
                        struct import_result *out);

/**
 * import_text - each dumped device_data message goes to the sink as a frame with checksum. A dump without time
 * stamps gets one ping per listening time (samples * sample period) plus IMPORT_PACE_NS: 44.7 ms at 2 m.
 */
void import_text(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out);

/** import_is_seanet_relay - is the first line of the file one of a relay's log? */
bool import_is_seanet_relay(const uint8_t *data, size_t size);

/** import_is_seanet - do the first 16 KiB hold the head of a SeaNet frame? */
bool import_is_seanet(const uint8_t *data, size_t size);

/**
 * import_seanet_relay - the datagrams of the sonar's port go to the sink with their dates and times (taken as UTC),
 * other ports are left out. False, nothing read, when no datagram holds the head of a frame.
 */
bool import_seanet_relay(const uint8_t *data, size_t size, const struct import_sink *sink,
                         struct import_result *out);

/**
 * import_seanet - every byte goes to the sink, one record per frame with what stood before it. There are no times in
 * raw bytes: each ping gets its listening time plus IMPORT_PACE_NS.
 */
void import_seanet(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out);

/** import_listening_ns - how long a head listened whose ping begins with this frame; 0: none begins here. */
uint64_t import_listening_ns(const struct seanet_frame *frame);

/** import_is_imagenex - does a .852 file of Imagenex's program begin here? */
bool import_is_imagenex(const uint8_t *data, size_t size);

/**
 * import_imagenex - the reply in each block of a .852 file goes to the sink with the block's time of day, or, where
 * something else stands there, after the listening time and 50 ms. It starts at import_imagenex_start, else at 0. A
 * broken block is left out.
 */
void import_imagenex(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out);

/** import_imagenex_start - the date and time of the first block, taken as UTC; false: it has none. */
bool import_imagenex_start(const uint8_t *data, size_t size, uint64_t *t_ns);

/** import_is_svlog - does a .svlog file of Cerulean's programs begin here? */
bool import_is_svlog(const uint8_t *data, size_t size);

/**
 * import_svlog - every byte goes to the sink, one record per frame with what stood before it, at the time of the last
 * points of a Surveyor, atof or yz; without any, all at the start. That is import_svlog_start, else 0.
 */
void import_svlog(const uint8_t *data, size_t size, const struct import_sink *sink, struct import_result *out);

/* The same of a file that comes in pieces. */
struct svlog_stream {
    const struct import_sink *sink;
    struct import_result *out;
    bool timed; /* by points of a Surveyor, the last of which had this: */
    uint32_t last_ms;
    uint64_t t_ns;
    struct ping_parser parser;
    size_t n; /* bytes of no whole frame yet, not handed on */
    uint8_t held[4 * PING_FRAME_LIMIT];
};

/** import_svlog_begin - sink and out stay until the end; start_ns: of import_svlog_start on the first piece, else 0. */
void import_svlog_begin(struct svlog_stream *s, const struct import_sink *sink, uint64_t start_ns,
                        struct import_result *out);

/** import_svlog_take - the next bytes. False: the sink wants no more. */
bool import_svlog_take(struct svlog_stream *s, const uint8_t *bytes, size_t n);

void import_svlog_end(struct svlog_stream *s);

/** import_svlog_start - "timestamp" of the text about the recording, where it is in UTC; false: there is none. */
bool import_svlog_start(const uint8_t *data, size_t size, uint64_t *t_ns);

/** import_is_viewer2 - is it an MCAP file of Ping Viewer 2? */
bool import_is_viewer2(const uint8_t *data, size_t size);

/**
 * import_viewer2 - each ping of the first device in it goes to the sink as a frame, a changed attitude of the
 * vehicle to `pose`, in the form that the method takes, with its time since 1970 and the sink's ctx; false from
 * there: stop. Other devices are left out.
 */
void import_viewer2(const uint8_t *data, size_t size, const struct import_sink *sink,
                    bool (*pose)(void *ctx, uint64_t t_ns, const char *json), struct import_result *out);

#endif
