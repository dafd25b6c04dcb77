/* SPDX-License-Identifier: MIT */
/* pace - see pace.h. */
#include "pace.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

static struct {
    bool known; /* the environment was looked at */
    int clock_fd, line_fd;
    uint64_t now_ns;
} voyage = {.clock_fd = -1, .line_fd = -1};

static void take_time(void)
{
    if (read(voyage.clock_fd, &voyage.now_ns, sizeof voyage.now_ns) != sizeof voyage.now_ns)
        exit(0);
}

static bool in_voyage(void)
{
    if (!voyage.known) {
        const char *text = getenv(PACE_VARIABLE);
        voyage.known = true;
        if (text && sscanf(text, "%d,%d", &voyage.clock_fd, &voyage.line_fd) == 2)
            take_time();
    }
    return voyage.clock_fd >= 0;
}

uint64_t pace_ns(void)
{
    struct timespec t;
    if (in_voyage())
        return voyage.now_ns;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

int pace_line(void)
{
    return in_voyage() ? voyage.line_fd : -1;
}

static bool wait_for_turn(int input_fd, uint64_t due_ns)
{
    struct pollfd fds[2] = {{input_fd, POLLIN, 0}, {voyage.clock_fd, POLLIN, 0}};
    if (write(voyage.clock_fd, &due_ns, sizeof due_ns) != sizeof due_ns || poll(fds, 2, -1) < 0)
        exit(0);
    if (fds[1].revents != 0)
        take_time();
    return fds[0].revents != 0;
}

bool pace_wait(int input_fd, int line_fd, uint64_t due_ns, const sigset_t *mask)
{
    if (in_voyage())
        return wait_for_turn(input_fd, due_ns);
    const uint64_t now_ns = pace_ns(), wait_ns = due_ns > now_ns ? due_ns - now_ns : 0;
    const struct timespec timeout = {(time_t)(wait_ns / 1000000000u), (long)(wait_ns % 1000000000u)};
    struct pollfd fds[2] = {{input_fd, POLLIN, 0}, {line_fd, POLLIN, 0}};

    return ppoll(fds, 2, &timeout, mask) > 0 && fds[0].revents != 0;
}
