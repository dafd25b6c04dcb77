/* SPDX-License-Identifier: MIT */
/* memory - blocks for the life of what has them, which no page fault delays later, and blocks that leave no trace. */
#ifndef SONARD_MEMORY_H
#define SONARD_MEMORY_H

#include <stddef.h>

/** memory_touched - n > 0 bytes of zeros, 64-aligned, with every page in place; for free(). NULL without memory. */
void *memory_touched(size_t n);

#define MEMORY_LARGE_BYTES 65536

/**
 * memory_return_large - from now on a malloced block of MEMORY_LARGE_BYTES or more goes back to the system when it is
 * freed. Otherwise the C library soon takes such blocks from its heap, and what many clients once needed stays there,
 * in holes between small blocks.
 */
void memory_return_large(void);

#endif
