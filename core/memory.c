/* SPDX-License-Identifier: MIT */
#include "memory.h"

#include <malloc.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define ALIGNMENT 64

/* One call for all pages that lie within the block: a page fault for each takes several times as long. A kernel before
 * Linux 5.14 refuses, and the pages come one by one when they are written. */
static void put_in_place(void *block, size_t n)
{
#ifdef MADV_POPULATE_WRITE
    const uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE), at = (uintptr_t)block;
    const uintptr_t from = (at + page - 1) / page * page, to = (at + n) / page * page;
    if (from < to)
        madvise((char *)block + (from - at), to - from, MADV_POPULATE_WRITE);
#else
    (void)block, (void)n;
#endif
}

void *memory_touched(size_t n)
{
    void *block =
        n <= SIZE_MAX - ALIGNMENT ? aligned_alloc(ALIGNMENT, (n + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT) : NULL;
    if (!block)
        return NULL;
    put_in_place(block, n);
    memset(block, 0, n);
    return block;
}

void memory_return_large(void)
{
    mallopt(M_MMAP_THRESHOLD, MEMORY_LARGE_BYTES);
}
