/* SPDX-License-Identifier: MIT */
#include "leftover.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define PATHS 4

/* Changed while the signals are held only, so the handler finds it whole. */
static struct {
    char path[PATHS][PATH_MAX]; /* "": none */
    pid_t process;              /* 0: none */
    bool handled;               /* the handlers are set */
} left;

static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
#define SIGNALS (sizeof signals / sizeof *signals)

/* In the order in which they came, a folder is before what is in it. */
static void clean_up(int number)
{
    if (left.process > 0) {
        kill(left.process, SIGTERM);
        waitpid(left.process, NULL, 0);
    }
    for (int i = PATHS; i > 0; i--)
        if (left.path[i - 1][0] && unlink(left.path[i - 1]) != 0)
            rmdir(left.path[i - 1]);
    raise(number); /* as SA_RESETHAND has set it: once the handler returns, it ends the program */
}

static sigset_t all_signals(void)
{
    sigset_t all;
    sigemptyset(&all);
    for (size_t i = 0; i < SIGNALS; i++)
        sigaddset(&all, signals[i]);
    return all;
}

/* One that the caller has ignored, as nohup does, stays so. */
static void handle(void)
{
    const struct sigaction ends = {
        .sa_handler = clean_up, .sa_flags = (int)SA_RESETHAND, .sa_mask = all_signals()};
    struct sigaction before;
    for (size_t i = 0; i < SIGNALS && !left.handled; i++)
        if (sigaction(signals[i], NULL, &before) == 0 && before.sa_handler == SIG_DFL)
            sigaction(signals[i], &ends, NULL);
    left.handled = true;
}

void leftover_hold(sigset_t *before)
{
    const sigset_t all = all_signals();
    handle();
    sigprocmask(SIG_BLOCK, &all, before);
}

void leftover_release(const sigset_t *before)
{
    sigprocmask(SIG_SETMASK, before, NULL);
}

/* Room for a path behind the last one. NULL with errno: there is none. */
static char *room_for(const char *path)
{
    int n = PATHS;
    while (n > 0 && !left.path[n - 1][0])
        n--;
    if (n < PATHS && strlen(path) < PATH_MAX)
        return left.path[n];
    errno = n < PATHS ? ENAMETOOLONG : EMFILE;
    return NULL;
}

bool leftover_name(const char *path)
{
    sigset_t before;
    leftover_hold(&before);
    char *room = room_for(path);
    if (room)
        strcpy(room, path);
    leftover_release(&before);
    return room != NULL;
}

void leftover_forget(const char *path)
{
    sigset_t before;
    leftover_hold(&before);
    for (int i = 0; i < PATHS; i++)
        if (strcmp(left.path[i], path) == 0)
            left.path[i][0] = '\0';
    leftover_release(&before);
}

void leftover_process(pid_t process)
{
    sigset_t before;
    leftover_hold(&before);
    left.process = process;
    leftover_release(&before);
}
