/* SPDX-License-Identifier: MIT */
/*
 * log - one line per event, to the journal with fields where standard error goes there, else to standard error. Never
 * used on the ping path above debug.
 */
#ifndef SONARD_LOG_H
#define SONARD_LOG_H

#include <stddef.h>
#include <stdint.h>

#define LOG_TEXT_MAX  1024 /* bytes of a line; longer ones are cut */
#define LOG_SONAR_MAX 32   /* of a sonar's name with its NUL; longer ones are cut */

enum log_level { LOG_ERR, LOG_WARNING, LOG_NOTICE, LOG_INFO, LOG_DEBUG };

/* What a line is about: the journal's fields. Made by the macros below. */
struct log_about {
    const char *event; /* a word for this kind of line; sonard(8) lists them */
    const char *sonar; /* its name, which the line begins with; NULL: none */
    uint64_t count;    /* of what the line tells the number of; 0: of nothing */
    const char *file, *function;
    int line;
};

#define LOG_ABOUT(...)                                                                                            \
    (&(const struct log_about){.file = __FILE__, .line = __LINE__, .function = __func__, __VA_ARGS__})

/** log_open - finds out where lines go. Before there are threads; until then they go to standard error. */
void log_open(void);

void log_set_level(enum log_level level);

void log_tell(enum log_level level, const struct log_about *about, const char *fmt, ...)
    __attribute__((format(printf, 3, 4)));

/** log_limited - what an outsider can trigger: of each event of a sonar 5 lines in 10 s; log_flush says how many more
 * there were. The loop's thread only. */
void log_limited(uint64_t now_ns, enum log_level level, const struct log_about *about, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));

/** log_flush - one line about each kind with suppressed messages whose 10 s are over; LOOP_NEVER: about all of them. */
void log_flush(uint64_t now_ns);

/* The format is a literal: what comes from outside is never one. */
#define log_line(level, word, ...) log_tell(level, LOG_ABOUT(.event = (word)), "" __VA_ARGS__)
#define log_sonar(level, word, name, ...)                                                                         \
    log_tell(level, LOG_ABOUT(.event = (word), .sonar = (name)), "" __VA_ARGS__)
#define log_counted(level, word, n, ...) log_tell(level, LOG_ABOUT(.event = (word), .count = (n)), "" __VA_ARGS__)

#endif
