/* SPDX-License-Identifier: MIT */
#include "log.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "journal.h"
#include "readable.h"

#define LIMIT_LINES     5
#define LIMIT_WINDOW_NS 10000000000u

#define KINDS 64 /* that are watched at once; of more, the oldest makes room */

static const struct {
    int syslog_priority;
    const char *word;
} levels[] = {
    [LOG_ERR] = {3, "error"}, [LOG_WARNING] = {4, "warning"}, [LOG_NOTICE] = {5, "notice"},
    [LOG_INFO] = {6, "info"}, [LOG_DEBUG] = {7, "debug"},
};

static _Atomic enum log_level threshold = LOG_INFO;

void log_open(void)
{
    journal_open();
}

void log_set_level(enum log_level level)
{
    threshold = level;
}

/* One write per line, so that lines of several threads do not mix. */
static void write_line(enum log_level level, const char *text)
{
    char line[LOG_TEXT_MAX + 32];
    int n = journal_is_stderr() ? snprintf(line, sizeof line, "<%d>%s\n", levels[level].syslog_priority, text)
                                : snprintf(line, sizeof line, "sonard: %s: %s\n", levels[level].word, text);
    if (write(STDERR_FILENO, line, (size_t)n) < 0)
        return; /* nowhere left to say so */
}

static void emit(enum log_level level, const struct log_about *about, const char *fmt, va_list ap)
{
    char text[LOG_TEXT_MAX];
    int n = about->sonar ? snprintf(text, sizeof text, "%s: ", about->sonar) : 0;
    vsnprintf(text + n, sizeof text - (size_t)n, fmt, ap);
    readable(text);
    if (!journal_send(levels[level].syslog_priority, about, text))
        write_line(level, text);
}

void log_tell(enum log_level level, const struct log_about *about, const char *fmt, ...)
{
    if (level > threshold)
        return;
    va_list ap;
    va_start(ap, fmt);
    emit(level, about, fmt, ap);
    va_end(ap);
}

/* ---- kinds of lines that outsiders can trigger ---- */

/* What was said of a kind since its window began; unused where passed is 0. */
static struct kind {
    const char *event;
    char sonar[LOG_SONAR_MAX]; /* a copy: sonars end before the log does; empty: none */
    enum log_level level;
    uint64_t start_ns;
    unsigned passed, held;
} kinds[KINDS];

static void end_window(struct kind *k)
{
    if (k->held)
        log_tell(k->level, LOG_ABOUT(.event = k->event, .sonar = k->sonar[0] ? k->sonar : NULL, .count = k->held),
                 k->held == 1 ? "suppressed %u similar \"%s\" message" : "suppressed %u similar \"%s\" messages",
                 k->held, k->event);
    k->passed = k->held = 0;
}

/* That of these words, or the one that has room for it. */
static struct kind *kind_of(const struct log_about *about)
{
    struct kind *room = kinds;
    const char *sonar = about->sonar ? about->sonar : "";
    for (struct kind *k = kinds; k < kinds + KINDS; k++) {
        if (k->passed && strcmp(k->event, about->event) == 0 && strcmp(k->sonar, sonar) == 0)
            return k;
        if (room->passed && (!k->passed || k->start_ns < room->start_ns))
            room = k;
    }
    end_window(room);
    return room;
}

void log_limited(uint64_t now_ns, enum log_level level, const struct log_about *about, const char *fmt, ...)
{
    if (level > threshold)
        return;
    struct kind *k = kind_of(about);
    if (k->passed && now_ns - k->start_ns >= LIMIT_WINDOW_NS)
        end_window(k);
    if (k->passed >= LIMIT_LINES) {
        k->held++;
        return;
    }
    if (k->passed == 0) {
        *k = (struct kind){.event = about->event, .level = level, .start_ns = now_ns};
        snprintf(k->sonar, sizeof k->sonar, "%s", about->sonar ? about->sonar : "");
    }
    k->passed++;
    va_list ap;
    va_start(ap, fmt);
    emit(level, about, fmt, ap);
    va_end(ap);
}

void log_flush(uint64_t now_ns)
{
    for (struct kind *k = kinds; k < kinds + KINDS; k++)
        if (k->passed && now_ns - k->start_ns >= LIMIT_WINDOW_NS)
            end_window(k);
}
