/* SPDX-License-Identifier: MIT */
#include "notify.h"

#include <errno.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define STATE_MAX 1024

/* A path, or @NAME in the abstract namespace. */
static socklen_t address_of(const char *name, struct sockaddr_un *address)
{
    const size_t n = strlen(name);
    *address = (struct sockaddr_un){.sun_family = AF_UNIX};
    if ((name[0] != '/' && name[0] != '@') || n < 2 || n >= sizeof address->sun_path)
        return 0;
    memcpy(address->sun_path, name, n);
    if (name[0] == '@')
        address->sun_path[0] = '\0';
    return (socklen_t)(offsetof(struct sockaddr_un, sun_path) + n);
}

void notify_tell(const char *fmt, ...)
{
    const char *name = getenv("NOTIFY_SOCKET");
    struct sockaddr_un address;
    const socklen_t length = name ? address_of(name, &address) : 0;
    if (!length)
        return;

    char state[STATE_MAX];
    va_list args;
    va_start(args, fmt);
    const int n = vsnprintf(state, sizeof state, fmt, args);
    va_end(args);
    const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0 || n < 0)
        return;
    sendto(fd, state, (size_t)n < sizeof state ? (size_t)n : sizeof state - 1, MSG_NOSIGNAL,
           (const struct sockaddr *)&address, length);
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
