/* SPDX-License-Identifier: MIT */
#include "out_file.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "leftover.h"

static void name_part(const char *path, char part[PATH_MAX])
{
    snprintf(part, PATH_MAX, "%s.part", path);
}

/* What is no regular file cannot be replaced by one: it is written itself. */
static bool is_written_itself(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && !S_ISREG(st.st_mode);
}

static bool refuse_existing(const char *path, struct fault *fault)
{
    return fault_set(fault, "%s: %s; remove it first, or name another", path, strerror(EEXIST));
}

/* Empty, and nobody else's. */
static int make_part(const char *part, struct fault *fault)
{
    struct stat st;
    const int fd = open(part, O_WRONLY | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666);
    if (fd < 0 || fstat(fd, &st) != 0) {
        fault_set(fault, "%s: %s", part, strerror(errno));
    } else if (!S_ISREG(st.st_mode)) {
        fault_set(fault, "%s: not a regular file; remove it", part);
    } else if (flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        fault_set(fault, "%s: another command is writing it; wait for it, or name another", part);
    } else if (!leftover_name(part) || ftruncate(fd, 0) != 0) {
        fault_set(fault, "%s: %s", part, strerror(errno));
    } else {
        return fd;
    }
    if (fd >= 0)
        close(fd);
    return -1;
}

static int open_part(const char *path, struct fault *fault)
{
    char part[PATH_MAX];
    sigset_t before;
    name_part(path, part);
    leftover_hold(&before);
    const int fd = make_part(part, fault);
    leftover_release(&before);
    return fd;
}

int out_file_create(const char *path, bool replace, struct fault *fault)
{
    struct stat st;
    if (strlen(path) >= PATH_MAX - sizeof ".part") {
        fault_set(fault, "%.80s...: %s", path, strerror(ENAMETOOLONG));
        return -1;
    }
    if (!replace && lstat(path, &st) == 0) {
        refuse_existing(path, fault);
        return -1;
    }
    if (!replace || !is_written_itself(path))
        return open_part(path, fault);
    const int fd = open(path, O_WRONLY | O_CLOEXEC);
    if (fd < 0)
        fault_set(fault, "%s: %s", path, strerror(errno));
    return fd;
}

/* Some file systems know no renaming that replaces nothing. */
static bool rename_to(const char *part, const char *path, bool replace)
{
    if (replace)
        return rename(part, path) == 0;
    return renameat2(AT_FDCWD, part, AT_FDCWD, path, RENAME_NOREPLACE) == 0 ||
           (errno == EINVAL && access(path, F_OK) != 0 && rename(part, path) == 0);
}

bool out_file_keep(const char *path, bool replace, struct fault *fault)
{
    char part[PATH_MAX];
    name_part(path, part);
    if (replace && is_written_itself(path))
        return true;
    if (rename_to(part, path, replace)) {
        leftover_forget(part);
        return true;
    }
    if (errno == EEXIST)
        refuse_existing(path, fault);
    else
        fault_set(fault, "%s: %s", path, strerror(errno));
    out_file_drop(path);
    return false;
}

void out_file_drop(const char *path)
{
    char part[PATH_MAX];
    name_part(path, part);
    if (is_written_itself(path))
        return;
    unlink(part);
    leftover_forget(part);
}
