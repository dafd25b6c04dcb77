/* SPDX-License-Identifier: MIT */
/* Memory that is there: zeros, aligned, and no page fault when it is used. */
#include <malloc.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "core/memory.h"
#include "tests/lib/sanitized.h"
#include "tests/lib/test.h"

static long faults(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_minflt;
}

static void check_zeros(const uint8_t *block, size_t n)
{
    size_t other = 0;
    for (size_t i = 0; i < n; i++)
        other += block[i] != 0;
    CHECK_INT(other, 0);
    CHECK_INT((uintptr_t)block % 64, 0);
}

TEST(it_is_zero_and_aligned)
{
    static const size_t sizes[] = {1, 63, 64, 65, 4095, 4096, 4097, 100000, 10000001};
    for (int times = 0; times < 2; times++) /* what was freed before is not zero */
        for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
            uint8_t *block = memory_touched(sizes[i]);
            CHECK(block != NULL);
            if (!block)
                return;
            check_zeros(block, sizes[i]);
            memset(block, 0xff, sizes[i]);
            free(block);
        }
}

TEST(its_pages_are_in_place)
{
    const size_t n = 32 << 20, page = (size_t)sysconf(_SC_PAGESIZE);
    const long before = faults();
    uint8_t *block = memory_touched(n);
    const long made = faults() - before;
    CHECK(block != NULL);
    if (!block)
        return;
    for (size_t i = 0; i < n; i += page)
        block[i] = 1;
    CHECK(faults() - before - made < 8);
    printf("# %ld page faults for %zu pages\n", made, n / page);
    free(block);
}

/* The address sanitizer ends a program that asks for so much. */
TEST(what_cannot_be_had_is_refused)
{
#ifdef __SANITIZE_ADDRESS__
    printf("# skipped: the address sanitizer takes such a size for a fault\n");
    return;
#endif
    CHECK(memory_touched(SIZE_MAX) == NULL);
    CHECK(memory_touched(SIZE_MAX - 64) == NULL);
}

/* As the buffers of clients grow, with small blocks of others between them. */
TEST(large_blocks_leave_no_trace)
{
    enum { N = 200 };
    static void *large[N], *small[N];
    memory_return_large();
    for (int times = 0; times < 3; times++) {
        const struct mallinfo2 before = mallinfo2();
        for (size_t i = 0; i < N; i++) {
            large[i] = realloc(malloc(1000), MEMORY_LARGE_BYTES + 5000 * i);
            small[i] = malloc(100);
            CHECK(large[i] && small[i]);
        }
        const struct mallinfo2 most = mallinfo2();
        CHECK(sanitized() || most.hblkhd - before.hblkhd >= (size_t)N * MEMORY_LARGE_BYTES);
        for (int i = 0; i < N; i++)
            free(large[i]);
        CHECK_INT(mallinfo2().hblkhd, before.hblkhd);
        CHECK(mallinfo2().arena - before.arena <= 1 << 20);
        for (int i = 0; i < N; i++)
            free(small[i]);
    }
}

int main(void)
{
    RUN(it_is_zero_and_aligned);
    RUN(its_pages_are_in_place);
    RUN(what_cannot_be_had_is_refused);
    RUN(large_blocks_leave_no_trace);
    return test_end();
}
