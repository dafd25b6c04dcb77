/* SPDX-License-Identifier: MIT */
/*
 * powercut - a computer whose power fails, for tests to preload into a program. It knows nothing of the program.
 *
 *   POWERCUT_FOLDER=PATH  what is done to the files in it is told, one line each, in PATH/journal, when it is done:
 *                         "write FILE", "sync FILE" (of the folder: "sync ."), "rename FROM TO"
 *   POWERCUT_AT=N         instead of the Nth of these the program is killed; of a write, half is done
 *
 * What rename() replaces stays as PATH/was, so that a test can undo what no sync has confirmed.
 */
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

/* The name within the folder; NULL: elsewhere. "." is the folder itself. */
static const char *inside(const char *path)
{
    const char *folder = getenv("POWERCUT_FOLDER");
    const size_t n = folder ? strlen(folder) : 0;
    if (!n || strncmp(path, folder, n) != 0)
        return NULL;
    return path[n] == '/' ? path + n + 1 : path[n] ? NULL : ".";
}

static const char *inside_fd(int fd, char path[512])
{
    char link[64];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    const ssize_t n = readlink(link, path, 511);
    path[n > 0 ? n : 0] = '\0';
    return n > 0 ? inside(path) : NULL;
}

/* Is it now that the power fails? */
static int fails(void)
{
    static int done;
    const char *at = getenv("POWERCUT_AT");
    return __atomic_add_fetch(&done, 1, __ATOMIC_SEQ_CST) == (at ? atoi(at) : 0);
}

static void die(void)
{
    syscall(SYS_kill, getpid(), SIGKILL);
    for (;;)
        pause();
}

__attribute__((format(printf, 1, 2))) static void tell(const char *fmt, ...)
{
    char line[1200], path[600];
    va_list args;
    va_start(args, fmt);
    const int n = vsnprintf(line, sizeof line, fmt, args);
    va_end(args);
    snprintf(path, sizeof path, "%s/journal", getenv("POWERCUT_FOLDER"));
    const int fd = open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
    syscall(SYS_write, fd, line, (size_t)n);
    close(fd);
}

ssize_t write(int fd, const void *bytes, size_t n)
{
    char path[512];
    const char *name = inside_fd(fd, path);
    if (!name)
        return syscall(SYS_write, fd, bytes, n);
    tell("write %s\n", name);
    if (fails()) {
        syscall(SYS_write, fd, bytes, n / 2);
        die();
    }
    return syscall(SYS_write, fd, bytes, n);
}

int fsync(int fd)
{
    char path[512];
    const char *name = inside_fd(fd, path);
    if (name && fails())
        die();
    const int result = (int)syscall(SYS_fsync, fd);
    if (name && result == 0)
        tell("sync %s\n", name);
    return result;
}

int rename(const char *from, const char *to)
{
    const char *name = inside(from), *folder = getenv("POWERCUT_FOLDER");
    if (name && fails())
        die();
    if (name) {
        char was[600];
        snprintf(was, sizeof was, "%s/was", folder);
        unlink(was);
        (void)!link(to, was);
    }
    const int result = renameat(AT_FDCWD, from, AT_FDCWD, to);
    if (name && result == 0)
        tell("rename %s %s\n", name, inside(to));
    return result;
}
