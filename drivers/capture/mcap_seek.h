/* SPDX-License-Identifier: MIT */
/*
 * mcap_seek - what tells a record from other bytes, so that reading can go on behind damage. Records have neither a
 * mark nor a checksum of their own: what counts is their opcode, their length, and that another record follows.
 */
#ifndef SONARD_MCAP_SEEK_H
#define SONARD_MCAP_SEEK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "mcap_format.h"

#define MCAP_SEEK_AHEAD 64u /* bytes behind its first one that tell whether a record is credible */

/** mcap_is_credible - can this whole record be one: is it long enough for the fields of its kind? */
bool mcap_is_credible(const struct mcap_record *record);

/**
 * mcap_seek - offset of the first record that begins in from .. to of `size` bytes and that reading can go on at; `to`
 * when there is none. chunked: messages are in chunks, so that one outside of them is what is left of a damaged chunk.
 * All but chunks are only likely, until something credible follows them. Reads nothing behind to + MCAP_SEEK_AHEAD.
 */
size_t mcap_seek(const uint8_t *data, size_t size, size_t from, size_t to, bool chunked);

#endif
