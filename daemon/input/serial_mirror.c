/* SPDX-License-Identifier: MIT */
#include "serial_mirror.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#define PATH_BYTES 272
#define READS_MAX  16 /* of what was written to the mirror, each time */

struct serial_mirror {
    int fd;     /* master */
    bool heard; /* somebody had it open the last time */
    char link[PATH_BYTES];
    char terminal[64]; /* where it leads */
    struct serial_mirror_status status;
};

/* Not even its first reader sees lines edited or echoed; readers need not set anything. */
static bool prepare_terminal(const char *terminal)
{
    struct termios tio;
    int fd = open(terminal, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (fd < 0)
        return false;
    bool good = tcgetattr(fd, &tio) == 0;
    cfmakeraw(&tio);
    good = good && tcsetattr(fd, TCSANOW, &tio) == 0;
    if (fchown(fd, (uid_t)-1, getegid()) == 0) /* a sandbox may forbid it: then it stays the user's alone */
        fchmod(fd, 0660);
    close(fd);
    return good;
}

/* A link that leads somewhere may be another's. */
static bool may_replace(const char *path, struct fault *fault)
{
    struct stat there;
    if (lstat(path, &there) < 0)
        return true;
    if (!S_ISLNK(there.st_mode))
        fault_set(fault, "tap %s: exists and is not a symbolic link; choose another name or remove it", path);
    else if (stat(path, &there) == 0)
        fault_set(fault, "tap %s: the link points to an existing file; choose another name or remove it", path);
    else
        return true;
    return false;
}

static bool make_link(const struct serial_mirror *mirror, struct fault *fault)
{
    char temporary[PATH_BYTES + 24];
    if (!may_replace(mirror->link, fault))
        return false;
    snprintf(temporary, sizeof temporary, "%s.%ld", mirror->link, (long)getpid());
    unlink(temporary);
    if (symlink(mirror->terminal, temporary) == 0) {
        if (rename(temporary, mirror->link) == 0)
            return true;
        unlink(temporary);
    }
    return fault_set(fault, "tap %s: cannot make the link: %s", mirror->link, strerror(errno));
}

struct serial_mirror *serial_mirror_open(const char *path, struct fault *fault)
{
    struct serial_mirror *mirror = calloc(1, sizeof *mirror);
    if (!mirror) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    mirror->fd = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (strlen(path) >= sizeof mirror->link) {
        fault_set(fault, "tap: a path longer than %zu bytes", sizeof mirror->link - 1);
    } else if (mirror->fd < 0 || grantpt(mirror->fd) < 0 || unlockpt(mirror->fd) < 0 ||
               ptsname_r(mirror->fd, mirror->terminal, sizeof mirror->terminal) != 0 ||
               !prepare_terminal(mirror->terminal)) {
        fault_set(fault, "tap %s: no pseudo-terminal: %s", path, strerror(errno));
    } else {
        strcpy(mirror->link, path);
        if (make_link(mirror, fault))
            return mirror;
    }
    if (mirror->fd >= 0)
        close(mirror->fd);
    free(mirror);
    return NULL;
}

static bool somebody_listens(const struct serial_mirror *mirror)
{
    struct pollfd p = {.fd = mirror->fd};
    return poll(&p, 1, 0) >= 0 && !(p.revents & POLLHUP);
}

static void throw_away_input(struct serial_mirror *mirror)
{
    uint8_t bytes[4096];
    for (int i = 0; i < READS_MAX; i++) {
        ssize_t n = read(mirror->fd, bytes, sizeof bytes);
        if (n <= 0)
            return;
        mirror->status.refused += (uint64_t)n;
    }
}

/* What the last reader has left is not for the next one. It lies on the terminal's side. */
static void flush_left_over(const struct serial_mirror *mirror)
{
    int fd = open(mirror->terminal, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return;
    tcflush(fd, TCIFLUSH);
    close(fd);
}

void serial_mirror_write(struct serial_mirror *mirror, const uint8_t *bytes, size_t n)
{
    bool listens = somebody_listens(mirror);
    throw_away_input(mirror);
    if (!listens) {
        if (mirror->heard)
            flush_left_over(mirror);
        mirror->heard = false;
        return;
    }
    mirror->heard = true;
    ssize_t taken = write(mirror->fd, bytes, n);
    size_t given = taken > 0 ? (size_t)taken : 0;
    mirror->status.given += given;
    mirror->status.dropped += n - given;
}

void serial_mirror_status(const struct serial_mirror *mirror, struct serial_mirror_status *out)
{
    *out = mirror->status;
}

void serial_mirror_close(struct serial_mirror *mirror)
{
    char target[sizeof mirror->terminal];
    if (!mirror)
        return;
    ssize_t n = readlink(mirror->link, target, sizeof target);
    if (n == (ssize_t)strlen(mirror->terminal) && memcmp(target, mirror->terminal, (size_t)n) == 0)
        unlink(mirror->link);
    close(mirror->fd);
    free(mirror);
}
