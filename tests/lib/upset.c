/* SPDX-License-Identifier: MIT */
/*
 * upset - what a computer may do to a program, for tests to preload into it. It knows nothing of the program.
 *
 *   UPSET_DISK=FILE    while FILE is there, writes to regular files do not come back, as on a disk that stalls; but
 *                      those to standard error do
 *
 *   UPSET_THREADS=FILE while FILE is there, no thread but the first comes back from waiting for a semaphore
 *
 * The files are looked at with every call.
 */
#include <dlfcn.h>
#include <fcntl.h>
#include <poll.h>
#include <semaphore.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#define POLL_MS 10

static int is_file(int fd)
{
    struct stat st;
    return fd > STDERR_FILENO && fstat(fd, &st) == 0 && S_ISREG(st.st_mode);
}

ssize_t write(int fd, const void *bytes, size_t n)
{
    const char *path = getenv("UPSET_DISK");
    while (path && is_file(fd) && access(path, F_OK) == 0)
        poll(NULL, 0, POLL_MS);
    return syscall(SYS_write, fd, bytes, n);
}

int sem_wait(sem_t *semaphore)
{
    static int (*real)(sem_t *);
    const char *path = getenv("UPSET_THREADS");
    if (!real)
        *(void **)&real = dlsym(RTLD_NEXT, "sem_wait");
    int result = real(semaphore);
    while (path && gettid() != getpid() && access(path, F_OK) == 0)
        poll(NULL, 0, POLL_MS);
    return result;
}
