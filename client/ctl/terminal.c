/* SPDX-License-Identifier: MIT */
#include "terminal.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/signalfd.h>
#include <unistd.h>

#define OTHER_SCREEN "\033[?1049h\033[?25l" /* without a cursor */
#define SHELL_SCREEN "\033[0m\033[?25h\033[?1049l"

static void write_all(const char *text, size_t n)
{
    while (n > 0) {
        const ssize_t k = write(STDOUT_FILENO, text, n);
        if (k <= 0)
            return; /* the terminal is gone */
        text += k;
        n -= (size_t)k;
    }
}

static int from_environment(const char *name, int absent)
{
    const char *set = getenv(name);
    const int n = set ? atoi(set) : 0;
    return n > 0 ? n : absent;
}

void terminal_size(int *columns, int *rows)
{
    struct winsize size = {0};
    if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) < 0 || size.ws_col == 0 || size.ws_row == 0) {
        *columns = from_environment("COLUMNS", 80);
        *rows = from_environment("LINES", 24);
    } else {
        *columns = size.ws_col;
        *rows = size.ws_row;
    }
}

/* Everything that ends a program or stops it by default and may be caught, and the new size. */
static sigset_t all_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP, SIGWINCH, SIGPIPE};
    sigset_t set;
    sigemptyset(&set);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        sigaddset(&set, numbers[i]);
    return set;
}

static bool take_screen(const struct terminal *terminal)
{
    struct termios mine = terminal->before;
    mine.c_lflag &= ~(tcflag_t)(ICANON | ECHO);
    mine.c_cc[VMIN] = 0;
    mine.c_cc[VTIME] = 0;
    if (tcsetattr(STDIN_FILENO, TCSAFLUSH, &mine) < 0)
        return false;
    write_all(OTHER_SCREEN, sizeof OTHER_SCREEN - 1);
    return true;
}

static void give_screen_back(const struct terminal *terminal)
{
    write_all(SHELL_SCREEN, sizeof SHELL_SCREEN - 1);
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &terminal->before);
}

bool terminal_enter(struct terminal *terminal)
{
    const sigset_t set = all_signals();
    if (tcgetattr(STDOUT_FILENO, &terminal->before) < 0 || tcgetattr(STDIN_FILENO, &terminal->before) < 0)
        return false;
    terminal->signals = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    if (terminal->signals < 0)
        return false;
    sigprocmask(SIG_BLOCK, &set, NULL);
    if (take_screen(terminal))
        return true;
    close(terminal->signals);
    return false;
}

enum terminal_event terminal_signal(struct terminal *terminal)
{
    enum terminal_event event = TERMINAL_NOTHING;
    struct signalfd_siginfo info;
    while (read(terminal->signals, &info, sizeof info) == sizeof info) {
        if (info.ssi_signo != SIGWINCH && info.ssi_signo != SIGTSTP)
            return TERMINAL_END;
        if (info.ssi_signo == SIGTSTP) {
            give_screen_back(terminal);
            raise(SIGSTOP); /* goes on from here after SIGCONT */
            if (!take_screen(terminal))
                return TERMINAL_END;
        }
        event = TERMINAL_CHANGED;
    }
    return event;
}

void terminal_leave(struct terminal *terminal)
{
    const sigset_t set = all_signals();
    give_screen_back(terminal);
    close(terminal->signals);
    sigprocmask(SIG_UNBLOCK, &set, NULL);
}
