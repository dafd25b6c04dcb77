/* SPDX-License-Identifier: MIT */
/*
 * test_ring - order, bounds and wrap-around in one thread, and a two-thread run in which every buffer must be in
 * exactly one place, the consumer must see order, and what it does not see must have been taken back as the oldest.
 */
#include "tests/lib/test.h"

#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/ring.h"

static struct ring ring, idle;

TEST(first_in_is_first_out_across_the_wrap_of_the_index)
{
    ring_init(&ring, 8, UINT32_MAX - 3);
    uint32_t v = 0;
    CHECK(!ring_take(&ring, &v));
    for (uint32_t round = 0; round < 100; round++) {
        for (uint32_t i = 0; i < 8; i++)
            ring_put(&ring, round * 10 + i);
        CHECK_INT(ring_count(&ring), 8);
        for (uint32_t i = 0; i < 8; i++) {
            CHECK(ring_take(&ring, &v));
            CHECK_INT(v, round * 10 + i);
        }
        CHECK(!ring_take(&ring, &v));
    }
}

TEST(putting_into_a_full_ring_ends_the_program)
{
    ring_init(&ring, 4, UINT32_MAX - 1);
    for (uint32_t i = 0; i < 4; i++)
        ring_put(&ring, i);
    const pid_t child = fork();
    if (child == 0) {
        const struct rlimit no_core = {0, 0};
        setrlimit(RLIMIT_CORE, &no_core);
        close(STDERR_FILENO);
        ring_put(&ring, 4);
        _exit(0);
    }
    int status = 0;
    CHECK(waitpid(child, &status, 0) == child);
    CHECK(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT);
}

TEST(sizes_are_rounded_up_to_a_power_of_two_within_bounds)
{
    static const struct {
        uint32_t want, got;
    } sizes[] = {{0, 2}, {2, 2}, {3, 4}, {1000, 1024}, {1024, 1024}, {5000, RING_MAX}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        ring_init(&ring, sizes[i].want, 0);
        CHECK_INT(ring.size, sizes[i].got);
    }
}

#define BUFFERS  4
#define MESSAGES 400000u
#define STOP     UINT32_MAX

static uint32_t content[BUFFERS]; /* plain memory: only the rings order the accesses to it */
static uint32_t received, disorder;

static void *consume(void *arg)
{
    (void)arg;
    uint32_t last = 0, v = 0, number;
    do {
        while (!ring_take(&ring, &v)) {
        }
        number = content[v];
        disorder += number <= last;
        last = number;
        received++;
        content[v] = 0;
        ring_put(&idle, v);
    } while (number != STOP);
    return NULL;
}

/* As the pipeline does it: an idle buffer, or the oldest that waits.
 * Neither exists while the consumer holds the rest. */
static uint32_t obtain(uint32_t *dropped)
{
    for (uint32_t v = 0;;) {
        if (ring_take(&idle, &v))
            return v;
        if (ring_take(&ring, &v)) {
            ++*dropped;
            return v;
        }
    }
}

TEST(two_threads_lose_only_the_oldest_and_no_buffer)
{
    ring_init(&ring, BUFFERS, UINT32_MAX - 1000);
    ring_init(&idle, BUFFERS, UINT32_MAX - 1000);
    for (uint32_t i = 0; i < BUFFERS; i++)
        ring_put(&idle, i);
    received = disorder = 0;
    pthread_t thread;
    pthread_create(&thread, NULL, consume, NULL);
    uint32_t dropped = 0;
    for (uint32_t n = 1; n <= MESSAGES; n++) {
        if (n % 256 == 0)
            usleep(1); /* let the consumer win some; to yield would cost a busy machine's slices of time */
        uint32_t v = obtain(&dropped);
        content[v] = n < MESSAGES ? n : STOP;
        ring_put(&ring, v);
    }
    pthread_join(thread, NULL);
    CHECK_INT(disorder, 0);
    CHECK_INT(received + dropped, MESSAGES);
    CHECK_INT(ring_count(&idle), BUFFERS);
    bool seen[BUFFERS] = {false};
    for (uint32_t v = 0; ring_take(&idle, &v); seen[v] = true)
        CHECK(v < BUFFERS && !seen[v]);
    printf("# %u received, %u dropped\n", received, dropped);
}

int main(void)
{
    RUN(first_in_is_first_out_across_the_wrap_of_the_index);
    RUN(putting_into_a_full_ring_ends_the_program);
    RUN(sizes_are_rounded_up_to_a_power_of_two_within_bounds);
    RUN(two_threads_lose_only_the_oldest_and_no_buffer);
    return test_end();
}
