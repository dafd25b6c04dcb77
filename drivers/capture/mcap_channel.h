/* SPDX-License-Identifier: MIT */
/*
 * mcap_channel - texts and channels as they stand in a capture's records.
 */
#ifndef SONARD_MCAP_CHANNEL_H
#define SONARD_MCAP_CHANNEL_H

#include <stddef.h>

#include "mcap.h"
#include "mcap_format.h"

/** mcap_copy_text - the text as dst[dst_size], cut to fit; what comes from a file may hold anything. */
void mcap_copy_text(char *dst, size_t dst_size, struct mcap_cursor text);

/**
 * mcap_parse_channel - the content of a channel record in one block of memory, for the caller to free. NULL when it is
 * malformed or over a limit.
 */
struct mcap_channel *mcap_parse_channel(struct mcap_cursor content);

#endif
