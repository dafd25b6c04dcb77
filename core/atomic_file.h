/* SPDX-License-Identifier: MIT */
/*
 * atomic_file - files that are read and replaced as a whole: a power cut leaves the old one or the new one. Knows no
 * content but its first bytes.
 */
#ifndef SONARD_ATOMIC_FILE_H
#define SONARD_ATOMIC_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "fault.h"

#define ATOMIC_FILE_PATH 512 /* room for a path with what is put behind it */

/** atomic_file_look - the first bytes of a regular file, *got of at most n, and its size. False with errno. */
bool atomic_file_look(const char *path, uint8_t *bytes, size_t n, size_t *got, size_t *size);

/** atomic_file_read - all of a regular file, malloced; one byte more than `most` where it is
 * longer. NULL with errno. */
uint8_t *atomic_file_read(const char *path, size_t most, size_t *size);

/**
 * atomic_file_replace - write PATH.new, move it over PATH when the disk has confirmed it, and have that confirmed too.
 * What is there and does not begin with the `magic_size` bytes that `bytes` begins with is somebody else's: refused.
 * False with a sentence in fault: the old file is untouched then, unless only the last confirmation failed. The new one
 * is in place in that case, and a power cut may yet bring the old one back. Takes as long as the disk needs.
 */
bool atomic_file_replace(const char *path, const uint8_t *bytes, size_t size, size_t magic_size,
                         struct fault *fault);

/** atomic_file_set_aside - rename PATH to PATH.damaged; what happened is added to the sentence in fault. */
void atomic_file_set_aside(const char *path, struct fault *fault);

#endif
