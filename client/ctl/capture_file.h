/* SPDX-License-Identifier: MIT */
/*
 * capture_file - what the commands of the capture tool share: opening, making and finishing a capture, and what they
 * say. A file that exists is never overwritten; what is not finished has another name, and is removed (out_file.h).
 */
#ifndef SONARD_CAPTURE_FILE_H
#define SONARD_CAPTURE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "core/fault.h"
#include "drivers/capture/mcap.h"

/** capture_failed - prints the sentence on standard error; 1, the exit status. */
__attribute__((format(printf, 1, 2))) int capture_failed(const char *fmt, ...);

/** capture_create - a new file, of that profile (NULL: a capture); message_bytes: its largest message, 0: the usual.
 * NULL after a message. */
struct mcap_writer *capture_create(const char *path, const char *profile, size_t message_bytes);

/** capture_finish - closes it. ok false, with the fault set: what came before failed, and it is removed. 0, or 1. */
int capture_finish(struct mcap_writer *w, const char *path, bool ok, struct fault *fault);

/** capture_drop - closes and removes it: there is nothing to be written. */
void capture_drop(struct mcap_writer *w, const char *path);

/** capture_tell_exported - after all of it was read: says how much of a capture that is damaged or not closed was
 * exported, on standard error. 0: all of it; else 1. */
int capture_tell_exported(const char *path, const struct mcap_info *info);

/** capture_open - open for reading; damage is reported on standard error. NULL after a message there. */
struct mcap_reader *capture_open(const char *path);

/** capture_text - print text from a file; what is not printable ASCII as \xNN. */
void capture_text(FILE *out, const char *text);

#endif
