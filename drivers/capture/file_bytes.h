/* SPDX-License-Identifier: MIT */
/*
 * file_bytes - the bytes of a file as one array, read as they are needed. Unlike a mapping they are a copy: a file that
 * somebody cuts off or overwrites meanwhile neither ends the process nor changes what was checked.
 */
#ifndef SONARD_FILE_BYTES_H
#define SONARD_FILE_BYTES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

struct file_bytes;

/** file_bytes_open - a regular file that is not empty. NULL with a sentence in fault. */
struct file_bytes *file_bytes_open(const char *path, struct fault *fault);

/** file_bytes_data - [file_bytes_size]; only what was asked for by file_bytes_need holds the file's bytes. */
const uint8_t *file_bytes_data(const struct file_bytes *f);
size_t file_bytes_size(const struct file_bytes *f);

/** file_bytes_need - read from .. to, unless it is there. Zeros stand for what the file no longer has: false then. */
bool file_bytes_need(struct file_bytes *f, size_t from, size_t to);

/** file_bytes_keep - the same, and file_bytes_drop leaves it alone. */
bool file_bytes_keep(struct file_bytes *f, size_t from, size_t to);

/** file_bytes_peek - copy n bytes without keeping them in the array; false: the file does not have them. */
bool file_bytes_peek(struct file_bytes *f, size_t from, uint8_t *out, size_t n);

/** file_bytes_lost - the file had fewer bytes than when it was opened, or could not be read, at least once. */
bool file_bytes_lost(const struct file_bytes *f);

/** file_bytes_drop - what is before `to` is not needed again soon: give its memory back. */
void file_bytes_drop(struct file_bytes *f, size_t to);

void file_bytes_close(struct file_bytes *f);

#endif
