/* SPDX-License-Identifier: MIT */
#include "arrival.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#define STEP_NS     100000000ll /* more than a clock is slewed between two stamps: it was set */
#define TRIES       8           /* to read two clocks as one */
#define TOGETHER_NS 100000ll

static int64_t clock_ns(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

/* Time of day less monotonic. The process may be held up between the two. */
static int64_t unix_offset_ns(void)
{
    int64_t wall_ns = 0, before_ns = 0, after_ns = INT64_MAX;
    for (int i = 0; i < TRIES && after_ns - before_ns > TOGETHER_NS; i++) {
        before_ns = clock_ns(CLOCK_MONOTONIC);
        wall_ns = clock_ns(CLOCK_REALTIME);
        after_ns = clock_ns(CLOCK_MONOTONIC);
    }
    return wall_ns - before_ns;
}

bool arrival_ask(struct port *port, int fd)
{
    const int on = 1;
    port->lost_here = 0;
    port->clock_set_ns = 0;
    port->unix_offset_ns = unix_offset_ns();
    return setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) == 0 &&
           setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) == 0;
}

static uint64_t monotonic(struct port *port, const struct timespec *stamp)
{
    const int64_t offset_ns = unix_offset_ns(), now_ns = clock_ns(CLOCK_MONOTONIC);
    const int64_t t_ns = (int64_t)stamp->tv_sec * 1000000000 + stamp->tv_nsec - offset_ns;
    const bool set = llabs(offset_ns - port->unix_offset_ns) > STEP_NS;
    port->unix_offset_ns = offset_ns;
    if (set)
        port->clock_set_ns = now_ns;
    return t_ns > port->clock_set_ns && t_ns <= now_ns ? (uint64_t)t_ns : 0;
}

void arrival_take(struct port *port, struct msghdr *message)
{
    port->t_ns = 0;
    for (struct cmsghdr *c = CMSG_FIRSTHDR(message); c; c = CMSG_NXTHDR(message, c)) {
        if (c->cmsg_level != SOL_SOCKET)
            continue;
        if (c->cmsg_type == SCM_TIMESTAMPNS) {
            struct timespec stamp;
            memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
            port->t_ns = monotonic(port, &stamp);
        } else if (c->cmsg_type == SO_RXQ_OVFL) {
            uint32_t lost;
            memcpy(&lost, CMSG_DATA(c), sizeof lost);
            port->lost += (uint32_t)(lost - port->lost_here);
            port->lost_here = lost;
        }
    }
}
