/* SPDX-License-Identifier: MIT */
#include "log.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#define LINE_MAX_BYTES  1024
#define LIMIT_LINES     5
#define LIMIT_WINDOW_NS 10000000000u

static const struct {
    int syslog_priority;
    const char *word;
} levels[] = {
    [LOG_ERR] = {3, "error"}, [LOG_WARNING] = {4, "warning"}, [LOG_NOTICE] = {5, "notice"},
    [LOG_INFO] = {6, "info"}, [LOG_DEBUG] = {7, "debug"},
};

static _Atomic enum log_level threshold = LOG_INFO;

void log_set_level(enum log_level level)
{
    threshold = level;
}

/* Does standard error go to the journal? The variable is inherited by those whose does not any more. */
static bool is_journal(void)
{
    const char *stream = getenv("JOURNAL_STREAM");
    unsigned long long device, inode;
    struct stat st;
    return stream && sscanf(stream, "%llu:%llu", &device, &inode) == 2 && fstat(STDERR_FILENO, &st) == 0 &&
           st.st_dev == device && st.st_ino == inode;
}

/* One write per line, so that lines of several threads do not mix. */
static void emit(enum log_level level, const char *fmt, va_list ap)
{
    char line[LINE_MAX_BYTES];
    int n = is_journal() ? snprintf(line, sizeof line, "<%d>", levels[level].syslog_priority)
                         : snprintf(line, sizeof line, "sonard: %s: ", levels[level].word);
    size_t room = sizeof line - (size_t)n - 1;
    int m = vsnprintf(line + n, room, fmt, ap);
    size_t len = (size_t)n + (m < 0 ? 0 : (size_t)m < room ? (size_t)m : room - 1);
    line[len++] = '\n';
    if (write(STDERR_FILENO, line, len) < 0)
        return; /* nowhere left to say so */
}

void log_line(enum log_level level, const char *fmt, ...)
{
    if (level > threshold)
        return;
    va_list ap;
    va_start(ap, fmt);
    emit(level, fmt, ap);
    va_end(ap);
}

void log_limited(struct log_limit *limit, uint64_t now_ns, enum log_level level, const char *fmt, ...)
{
    if (level > threshold)
        return;
    if (limit->passed == 0 || now_ns - limit->window_start_ns >= LIMIT_WINDOW_NS) {
        if (limit->held)
            log_line(level, "%u more lines like the last were held back", limit->held);
        *limit = (struct log_limit){.window_start_ns = now_ns};
    }
    if (limit->passed >= LIMIT_LINES) {
        limit->held++;
        return;
    }
    limit->passed++;
    va_list ap;
    va_start(ap, fmt);
    emit(level, fmt, ap);
    va_end(ap);
}
