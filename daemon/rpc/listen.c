/* SPDX-License-Identifier: MIT */
#include "listen.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define BACKLOG       64
#define FIRST_FD      3 /* of those that a service manager hands over */
#define LOCK_TRIES    20
#define LOCK_PAUSE_NS 50000000

/* Whoever may read a directory may lock it: no waiting without end. */
static bool lock(int fd)
{
    const struct timespec pause = {.tv_nsec = LOCK_PAUSE_NS};
    for (int i = 0; i < LOCK_TRIES; i++) {
        if (flock(fd, LOCK_EX | LOCK_NB) == 0)
            return true;
        if (errno != EWOULDBLOCK && errno != EINTR)
            return false;
        nanosleep(&pause, NULL);
    }
    errno = EWOULDBLOCK;
    return false;
}

/* The directory of path, locked for as long as the descriptor is open. */
static int lock_directory(const char *path, struct fault *fault)
{
    char directory[sizeof((struct sockaddr_un *)0)->sun_path];
    const char *slash = strrchr(path, '/');
    int fd;
    if (!slash)
        strcpy(directory, ".");
    else
        snprintf(directory, sizeof directory, "%.*s", slash == path ? 1 : (int)(slash - path), path);
    fd = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0 && lock(fd))
        return fd;
    fault_set(fault, "socket %s: the directory %s: %s%s", path, directory,
              errno == EWOULDBLOCK ? "another program keeps it locked" : strerror(errno),
              errno == ENOENT || errno == EACCES ? "; --socket PATH names another place" : "");
    if (fd >= 0)
        close(fd);
    return -1;
}

/* True when nothing is at the path any more. */
static bool clear_path(const struct sockaddr_un *address, struct fault *fault)
{
    const char *path = address->sun_path;
    struct stat st;
    int fd, failure;
    if (lstat(path, &st) < 0) {
        if (errno == ENOENT)
            return true;
        return fault_set(fault, "socket %s: %s", path, strerror(errno));
    }
    if (!S_ISSOCK(st.st_mode))
        return fault_set(fault, "%s exists and is not a socket; remove it or choose another path", path);
    fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return fault_set(fault, "socket %s: %s", path, strerror(errno));
    failure = connect(fd, (const struct sockaddr *)address, sizeof *address) < 0 ? errno : 0;
    close(fd);
    if (failure == ECONNREFUSED && unlink(path) == 0)
        return true;
    if (failure == 0 || failure == EAGAIN)
        fault_set(fault, "another sonard is listening on %s", path);
    else
        fault_set(fault, "socket %s: cannot replace the existing file: %s", path,
                  strerror(failure == ECONNREFUSED ? errno : failure));
    return false;
}

/* The file has its permissions from its first moment: who comes before listen() hears that nobody listens, not that it
 * may not. chmod() is for a folder whose default ACL overrules the umask. */
static int bind_and_listen(const struct sockaddr_un *address, unsigned mode, struct fault *fault)
{
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    bool bound, ok;
    if (fd < 0) {
        fault_set(fault, "socket %s: %s", address->sun_path, strerror(errno));
        return -1;
    }

    const mode_t before = umask(~mode & 0777);

    bound = bind(fd, (const struct sockaddr *)address, sizeof *address) == 0;
    umask(before);
    ok = bound && chmod(address->sun_path, mode & 0777) == 0 && listen(fd, BACKLOG) == 0;
    if (!ok) {
        fault_set(fault, "socket %s: %s", address->sun_path, strerror(errno));
        if (bound)
            unlink(address->sun_path);
        close(fd);
        return -1;
    }
    return fd;
}

int listen_unix(const char *path, unsigned mode, struct fault *fault)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const size_t length = strlen(path);
    int lock, fd = -1;
    if (length == 0 || length >= sizeof address.sun_path) {
        fault_set(fault, "socket path has %zu bytes, expected 1 to %zu", length, sizeof address.sun_path - 1);
        return -1;
    }
    memcpy(address.sun_path, path, length);
    lock = lock_directory(path, fault);
    if (lock < 0)
        return -1;
    if (clear_path(&address, fault))
        fd = bind_and_listen(&address, mode, fault);
    close(lock);
    return fd;
}

static bool is_listening_unix(int fd)
{
    int domain = 0, type = 0, listening = 0;
    socklen_t size = sizeof domain;
    return getsockopt(fd, SOL_SOCKET, SO_DOMAIN, &domain, &size) == 0 && domain == AF_UNIX &&
           getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_STREAM &&
           getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listening, &size) == 0 && listening;
}

bool listen_inherited(int *fd, struct fault *fault)
{
    const char *pid = getenv("LISTEN_PID"), *count = getenv("LISTEN_FDS");
    const long for_whom = pid ? strtol(pid, NULL, 10) : 0, n = count ? strtol(count, NULL, 10) : 0;
    *fd = 0;
    if (for_whom != (long)getpid() || n < 1)
        return true;
    unsetenv("LISTEN_PID");
    unsetenv("LISTEN_FDS");
    if (n > 1)
        return fault_set(fault, "the service manager hands over %ld sockets, expected one ListenStream", n);
    if (!is_listening_unix(FIRST_FD))
        return fault_set(fault, "the inherited file descriptor is not a listening UNIX stream socket");
    if (fcntl(FIRST_FD, F_SETFD, FD_CLOEXEC) < 0 || fcntl(FIRST_FD, F_SETFL, O_NONBLOCK) < 0)
        return fault_set(fault, "the socket that the service manager hands over: %s", strerror(errno));
    *fd = FIRST_FD;
    return true;
}
