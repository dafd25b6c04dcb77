/* SPDX-License-Identifier: MIT */
#include "tap.h"

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
#define READS_MAX  16 /* of what was written to the tap, each time */

struct tap {
    int fd;     /* master */
    bool heard; /* somebody had it open the last time */
    char link[PATH_BYTES];
    char terminal[64]; /* where it leads */
    struct tap_status status;
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
static bool may_replace(const char *path, char *err, size_t err_size)
{
    struct stat there;

    if (lstat(path, &there) < 0)
        return true;
    if (!S_ISLNK(there.st_mode))
        snprintf(err, err_size, "tap %s: is there and no symbolic link; give another name, or remove it", path);
    else if (stat(path, &there) == 0)
        snprintf(err, err_size, "tap %s: the link leads to something that exists; give another name, or remove it",
                 path);
    else
        return true;
    return false;
}

static bool make_link(const struct tap *tap, char *err, size_t err_size)
{
    char temporary[PATH_BYTES + 24];

    if (!may_replace(tap->link, err, err_size))
        return false;
    snprintf(temporary, sizeof temporary, "%s.%ld", tap->link, (long)getpid());
    unlink(temporary);
    if (symlink(tap->terminal, temporary) == 0) {
        if (rename(temporary, tap->link) == 0)
            return true;
        unlink(temporary);
    }
    snprintf(err, err_size, "tap %s: cannot make the link: %s", tap->link, strerror(errno));
    return false;
}

struct tap *tap_open(const char *path, char *err, size_t err_size)
{
    struct tap *tap = calloc(1, sizeof *tap);

    if (!tap) {
        snprintf(err, err_size, "out of memory");
        return NULL;
    }
    tap->fd = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (strlen(path) >= sizeof tap->link) {
        snprintf(err, err_size, "tap: a path longer than %zu bytes", sizeof tap->link - 1);
    } else if (tap->fd < 0 || grantpt(tap->fd) < 0 || unlockpt(tap->fd) < 0 ||
               ptsname_r(tap->fd, tap->terminal, sizeof tap->terminal) != 0 || !prepare_terminal(tap->terminal)) {
        snprintf(err, err_size, "tap %s: no pseudo-terminal: %s", path, strerror(errno));
    } else {
        strcpy(tap->link, path);
        if (make_link(tap, err, err_size))
            return tap;
    }
    if (tap->fd >= 0)
        close(tap->fd);
    free(tap);
    return NULL;
}

static bool somebody_listens(const struct tap *tap)
{
    struct pollfd p = {.fd = tap->fd};
    return poll(&p, 1, 0) >= 0 && !(p.revents & POLLHUP);
}

static void throw_away_input(struct tap *tap)
{
    uint8_t bytes[4096];
    for (int i = 0; i < READS_MAX; i++) {
        ssize_t n = read(tap->fd, bytes, sizeof bytes);
        if (n <= 0)
            return;
        tap->status.refused += (uint64_t)n;
    }
}

/* What the last reader has left is not for the next one. It lies on the terminal's side. */
static void flush_left_over(const struct tap *tap)
{
    int fd = open(tap->terminal, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return;
    tcflush(fd, TCIFLUSH);
    close(fd);
}

void tap_mirror(struct tap *tap, const uint8_t *bytes, size_t n)
{
    bool listens = somebody_listens(tap);

    throw_away_input(tap);
    if (!listens) {
        if (tap->heard)
            flush_left_over(tap);
        tap->heard = false;
        return;
    }
    tap->heard = true;
    ssize_t taken = write(tap->fd, bytes, n);
    size_t given = taken > 0 ? (size_t)taken : 0;
    tap->status.given += given;
    tap->status.dropped += n - given;
}

void tap_status(const struct tap *tap, struct tap_status *out)
{
    *out = tap->status;
}

void tap_close(struct tap *tap)
{
    char target[sizeof tap->terminal];

    if (!tap)
        return;
    ssize_t n = readlink(tap->link, target, sizeof target);
    if (n == (ssize_t)strlen(tap->terminal) && memcmp(target, tap->terminal, (size_t)n) == 0)
        unlink(tap->link);
    close(tap->fd);
    free(tap);
}
