/* SPDX-License-Identifier: MIT */
/* atomic_file - see atomic_file.h. */
#include "atomic_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "fault.h"

#define MAGIC_MAX 64

/* Reads until `most` bytes or the end. False with errno. */
static bool read_up_to(int fd, uint8_t *bytes, size_t most, size_t *size)
{
    ssize_t n;
    for (*size = 0; *size<most; *size += n> 0 ? (size_t)n : 0) {
        n = read(fd, bytes + *size, most - *size);
        if (n == 0)
            return true;
        if (n < 0 && errno != EINTR)
            return false;
    }
    return true;
}

/* A regular file, open; its size in *size. -1 with errno. */
static int open_regular(const char *path, size_t *size)
{
    struct stat st;
    const int fd = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return -1;
    if (fstat(fd, &st) == 0 && S_ISREG(st.st_mode)) {
        *size = (size_t)st.st_size;
        return fd;
    }
    close(fd);
    errno = EINVAL;
    return -1;
}

bool atomic_file_look(const char *path, uint8_t *bytes, size_t n, size_t *got, size_t *size)
{
    const int fd = open_regular(path, size);
    if (fd < 0)
        return false;
    const bool good = read_up_to(fd, bytes, n, got);
    const int cause = errno;
    close(fd);
    errno = cause;
    return good;
}

uint8_t *atomic_file_read(const char *path, size_t most, size_t *size)
{
    size_t room;
    const int fd = open_regular(path, &room);
    if (fd < 0)
        return NULL;
    room = (room < most ? room : most) + 1;
    uint8_t *bytes = malloc(room);
    if (bytes && !read_up_to(fd, bytes, room, size)) {
        free(bytes);
        bytes = NULL;
    }
    close(fd);
    return bytes;
}

static bool write_all(int fd, const uint8_t *bytes, size_t size)
{
    for (size_t done = 0; done < size;) {
        ssize_t n = write(fd, bytes + done, size - done);
        if (n < 0 && errno != EINTR)
            return false;
        done += n > 0 ? (size_t)n : 0;
    }
    return fsync(fd) == 0;
}

/* The name itself must be on the disk as well. */
static bool sync_folder(const char *path)
{
    char folder[ATOMIC_FILE_PATH];
    snprintf(folder, sizeof folder, "%s", path);
    char *slash = strrchr(folder, '/');
    if (!slash)
        return true;
    slash[slash == folder] = '\0';
    int fd = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    bool ok = fd >= 0 && fsync(fd) == 0;
    if (fd >= 0)
        close(fd);
    return ok;
}

/* Nobody's own file is lost to a wrong path in the configuration. */
static bool may_replace(const char *path, const uint8_t *magic, size_t magic_size)
{
    uint8_t old[MAGIC_MAX];
    size_t size;
    const int fd = open_regular(path, &size);
    if (fd < 0)
        return errno == ENOENT;
    const bool may = magic_size <= MAGIC_MAX && read_up_to(fd, old, magic_size, &size) && size == magic_size &&
                     memcmp(old, magic, magic_size) == 0;
    close(fd);
    return may;
}

/* An empty file to write, -1 with errno. A FIFO would make its writer wait for ever, a device would take the bytes. */
static int open_empty(const char *path)
{
    struct stat st;
    const int fd = open(path, O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0644);
    if (fd < 0)
        return -1;
    if (fstat(fd, &st) == 0 && S_ISREG(st.st_mode) && ftruncate(fd, 0) == 0)
        return fd;
    close(fd);
    errno = EEXIST;
    return -1;
}

bool atomic_file_replace(const char *path, const uint8_t *bytes, size_t size, size_t magic_size,
                         struct fault *fault)
{
    char beside[ATOMIC_FILE_PATH];
    if (!may_replace(path, bytes, magic_size))
        return fault_set(fault, "%s: something else is there, which is not replaced", path);
    snprintf(beside, sizeof beside, "%s.new", path);
    const int fd = open_empty(beside);
    if (fd < 0 && (errno == EEXIST || errno == ENXIO || errno == ELOOP))
        return fault_set(fault, "%s: %s is there and is no regular file; remove it", path, beside);
    bool ok = fd >= 0 && write_all(fd, bytes, size);
    int cause = errno;
    if (fd >= 0)
        close(fd);
    if (ok && (rename(beside, path) != 0 || !sync_folder(path))) {
        cause = errno;
        ok = false;
    }
    if (!ok) {
        fault_set(fault, "%s: %s", path, strerror(cause));
        if (fd >= 0)
            unlink(beside);
    }
    return ok;
}

void atomic_file_set_aside(const char *path, struct fault *fault)
{
    char aside[ATOMIC_FILE_PATH];
    snprintf(aside, sizeof aside, "%s.damaged", path);
    if (rename(path, aside) == 0)
        fault_add(fault, "; it is now %s", aside);
}
