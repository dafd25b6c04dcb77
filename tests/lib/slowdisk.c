/* SPDX-License-Identifier: MIT */
/*
 * slowdisk - a disk that takes its time, for tests to preload into a program. It knows nothing of the program.
 *
 *   SLOWDISK_FOLDER=PATH  every read and every sync of a file in it takes ...
 *   SLOWDISK_MS=N         ... so long
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static void wait_if_inside(int fd)
{
    const char *folder = getenv("SLOWDISK_FOLDER"), *ms = getenv("SLOWDISK_MS");
    char link[64], path[512];
    if (!folder || !ms)
        return;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    const ssize_t n = readlink(link, path, sizeof path - 1);
    path[n > 0 ? n : 0] = '\0';
    if (strncmp(path, folder, strlen(folder)) != 0)
        return;
    const long ns = atol(ms) * 1000000;
    nanosleep(&(struct timespec){.tv_sec = ns / 1000000000, .tv_nsec = ns % 1000000000}, NULL);
}

ssize_t read(int fd, void *bytes, size_t n)
{
    wait_if_inside(fd);
    return syscall(SYS_read, fd, bytes, n);
}

int fsync(int fd)
{
    wait_if_inside(fd);
    return (int)syscall(SYS_fsync, fd);
}
