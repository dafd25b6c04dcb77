/* SPDX-License-Identifier: MIT */
/*
 * log - one line per event to standard error; with a <N> priority prefix under the journal. Never used on the ping
 * path above debug.
 */
#ifndef SONARD_LOG_H
#define SONARD_LOG_H

#include <stddef.h>
#include <stdint.h>

enum log_level { LOG_ERR, LOG_WARNING, LOG_NOTICE, LOG_INFO, LOG_DEBUG };

void log_set_level(enum log_level level);

void log_line(enum log_level level, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

/* One per call site that an outsider can trigger: 5 lines in 10 s pass, then one line with the count. */
struct log_limit {
    uint64_t window_start_ns;
    unsigned passed, held;
};

void log_limited(struct log_limit *limit, uint64_t now_ns, enum log_level level, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));

#endif
