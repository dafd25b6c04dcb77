/* SPDX-License-Identifier: MIT */
/* bench_socket.h - a client's end of a UNIX socket, and the bare echo that answers are measured beside. */
#ifndef SONARD_BENCH_SOCKET_H
#define SONARD_BENCH_SOCKET_H

#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>

/* A thread: gives back what comes through the descriptor that arg points to. */
static inline void *echo(void *arg)
{
    const int fd = *(int *)arg;
    char line[4096];
    for (ssize_t n; (n = recv(fd, line, sizeof line, 0)) > 0;)
        if (send(fd, line, (size_t)n, MSG_NOSIGNAL) != n)
            break;
    return NULL;
}

static inline int connect_to(const char *path)
{
    struct sockaddr_un to = {.sun_family = AF_UNIX};
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    snprintf(to.sun_path, sizeof to.sun_path, "%s", path);
    if (fd < 0 || connect(fd, (struct sockaddr *)&to, sizeof to) != 0) {
        perror(path);
        exit(1);
    }
    return fd;
}

#endif
