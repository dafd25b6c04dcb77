/* SPDX-License-Identifier: MIT */
/* memory - blocks for the life of what has them, which no page fault delays later. */
#ifndef SONARD_MEMORY_H
#define SONARD_MEMORY_H

#include <stddef.h>

/** memory_touched - n > 0 bytes of zeros, 64-aligned, with every page in place; for free(). NULL without memory. */
void *memory_touched(size_t n);

#endif
