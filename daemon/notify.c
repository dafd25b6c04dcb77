/* SPDX-License-Identifier: MIT */
#include "notify.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/datagram.h"

#define STATE_MAX 1024

void notify_tell(const char *fmt, ...)
{
    const char *name = getenv("NOTIFY_SOCKET");
    const int fd = name ? datagram_to(name) : -1;
    if (fd < 0)
        return;

    char state[STATE_MAX];
    va_list args;
    va_start(args, fmt);
    const int n = vsnprintf(state, sizeof state, fmt, args);
    va_end(args);
    if (n >= 0)
        send(fd, state, (size_t)n < sizeof state ? (size_t)n : sizeof state - 1, MSG_NOSIGNAL);
    close(fd);
}

/* A whole positive number, all of the text; 0 otherwise. */
static uint64_t number_in(const char *variable)
{
    const char *text = getenv(variable);
    char *end;
    if (!text || *text < '0' || *text > '9')
        return 0;
    errno = 0;
    const unsigned long long value = strtoull(text, &end, 10);
    return errno == 0 && *end == '\0' ? value : 0;
}

uint64_t notify_watchdog_ns(void)
{
    const uint64_t us = number_in("WATCHDOG_USEC");
    if (getenv("WATCHDOG_PID") && number_in("WATCHDOG_PID") != (uint64_t)getpid())
        return 0;
    return us < UINT64_MAX / 1000 ? us * 1000 : 0;
}
