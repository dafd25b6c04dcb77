/* SPDX-License-Identifier: MIT */
/*
 * fault - why something did not work: one sentence that says what, where, and what would be right. Whoever meets the
 * fault writes the sentence, nobody above rewrites it, one place tells it. Pure: no heap, no log.
 */
#ifndef SONARD_FAULT_H
#define SONARD_FAULT_H

#include <stdbool.h>

#define FAULT_TEXT_MAX 640 /* as the message of an answer; a longer sentence loses its end */

struct fault {
    char text[FAULT_TEXT_MAX]; /* empty: none */
};

/** fault_set - write the sentence; what names of files bring in is made readable (readable.h). Always false,
 * for `return fault_set(...)`. */
bool fault_set(struct fault *fault, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

/** fault_add - go on with the sentence that is there. Always false. */
bool fault_add(struct fault *fault, const char *fmt, ...) __attribute__((format(printf, 2, 3)));

#endif
