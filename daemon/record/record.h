/* SPDX-License-Identifier: MIT */
/*
 * record - keeps what the ports read and wrote, and the poses, as captures. The loop hands messages over and never
 * waits; a thread of its own writes them (segments.h) and may wait for the disk. Knows no port and no client.
 *
 * What the disk has not taken yet waits in 8 MiB. When these are full, what comes is lost and counted, and the capture
 * has a gap. The daemon's own death costs at most the last second and a quarter, if the disk kept up.
 */
#ifndef SONARD_RECORD_H
#define SONARD_RECORD_H

#include "core/fault.h"
#include "segments.h"

#define RECORD_CONF_TOPIC "/sonard.conf" /* the configuration whenever a reload changed it, as text */

struct record_status {
    struct segments_status segments; /* messages: taken or lost until now; lost_messages: with those lost here */
    uint64_t messages_here;          /* of those, since it was last told to go on */
    uint64_t since_ns;               /* when that was; 0: never */
    uint64_t overflows;              /* of the lost: there was no room, since the disk is too slow */
    uint64_t waiting_bytes;          /* not yet taken by the disk's side */
};

struct record;

/** record_open - start recording, see segments_open. Allocates all that the loop's side needs.
 * NULL: a sentence in fault. */
struct record *record_open(const struct segments_conf *conf, uint64_t now_ns, struct fault *fault);

/** record_channel - see segments_channel; before record_start only. */
int record_channel(struct record *rec, const char *topic, const char *encoding);

/** record_start - from here on messages are written. False with a sentence in fault. */
bool record_start(struct record *rec, struct fault *fault);

/** record_message - keep n bytes that came or went at t_ns (monotonic), unless paused. False: lost, and counted. */
bool record_message(struct record *rec, int channel, uint64_t t_ns, const void *data, size_t n);

/** record_message_of - the same of bytes of which nobody knows exactly when they came. */
bool record_message_of(struct record *rec, int channel, const struct record_time *then, const void *data,
                       size_t n);

/** record_conf - n bytes of the configuration that is in force from t_ns (monotonic) on: a message on
 * RECORD_CONF_TOPIC, and what later segments begin with, also while paused. False: lost, and counted. */
bool record_conf(struct record *rec, uint64_t t_ns, const char *text, size_t n);

/** record_tick - hand over what still waits for company; call it twice a second. */
void record_tick(struct record *rec);

/** record_pause - from here on keep nothing, or go on in a new segment; see segments_pause. What came before is still
 * written. The disk's side follows within a quarter of a second: record_status says when. */
void record_pause(struct record *rec, bool paused, uint64_t now_ns);

/** record_paused - what was asked for last. */
bool record_paused(const struct record *rec);

void record_status(struct record *rec, struct record_status *out);

/* For which the end of the daemon waits for its disk. */
#define RECORD_PATIENCE_MS 5000

/** record_close - complete the open part; a disk that does not answer for so long is left. NULL is allowed. */
void record_close(struct record *rec, int patience_ms);

#endif
