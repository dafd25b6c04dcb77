/* SPDX-License-Identifier: MIT */
/* console - commands for a virtual instrument: lines on standard input. Knows no instrument. */
#ifndef SONARD_SIM_CONSOLE_H
#define SONARD_SIM_CONSOLE_H

#include <stdbool.h>

/**
 * console_read - read what is there and hand each whole line, without its newline, to `run`, whose answer it prints:
 * "ok LINE STATUS" or "error: ...". False at the end of the input. Lines of more than 254 bytes are thrown away.
 */
bool console_read(bool (*run)(void *ctx, const char *line), const char *(*status)(void *ctx), void *ctx);

#endif
