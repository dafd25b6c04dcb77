/* SPDX-License-Identifier: MIT */
/* whole_file - see whole_file.h. */
#include "whole_file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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

uint8_t *whole_file_read(const char *path, size_t most, size_t *size)
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
    char folder[WHOLE_FILE_PATH];
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

bool whole_file_replace(const char *path, const uint8_t *bytes, size_t size, size_t magic_size, char *err,
                        size_t err_size)
{
    char beside[WHOLE_FILE_PATH];
    if (!may_replace(path, bytes, magic_size)) {
        snprintf(err, err_size, "%s: something else is there, which is not replaced", path);
        return false;
    }
    snprintf(beside, sizeof beside, "%s.new", path);
    const int fd = open(beside, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644);
    bool ok = fd >= 0 && write_all(fd, bytes, size);
    int fault = errno;
    if (fd >= 0)
        close(fd);
    if (ok && (rename(beside, path) != 0 || !sync_folder(path))) {
        fault = errno;
        ok = false;
    }
    if (!ok) {
        snprintf(err, err_size, "%s: %s", path, strerror(fault));
        if (fd >= 0)
            unlink(beside);
    }
    return ok;
}

void whole_file_set_aside(const char *path, char *err, size_t err_size)
{
    char aside[WHOLE_FILE_PATH];
    snprintf(aside, sizeof aside, "%s.damaged", path);
    const size_t used = strlen(err);
    if (used < err_size && rename(path, aside) == 0)
        snprintf(err + used, err_size - used, "; it is now %s", aside);
}
