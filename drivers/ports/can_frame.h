/* SPDX-License-Identifier: MIT */
/*
 * can_frame - one CAN frame as the kernel hands it out: a record of 16 bytes (struct can_frame) or 72 (struct
 * canfd_frame) in host byte order. Captures hold the same records (encoding "socketcan"). Knows no protocol.
 */
#ifndef SONARD_CAN_FRAME_H
#define SONARD_CAN_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <linux/can.h>

/* A frame matches when (its can_id & mask) == (id & mask). Flags of linux/can.h stand in both. */
struct can_match {
    uint32_t id, mask;
};

/**
 * can_frame_read - a record of n bytes as a canfd_frame, whichever of the two it is; bytes beyond len are 0.
 * False when it is neither, or says that it is longer than its kind can be.
 */
bool can_frame_read(const uint8_t *record, size_t n, struct canfd_frame *out);

/** can_frame_is_data - carries data: neither an error frame nor a remote request. */
bool can_frame_is_data(const struct canfd_frame *frame);

bool can_frame_matches(const struct canfd_frame *frame, struct can_match match);

#endif
