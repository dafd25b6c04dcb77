/* SPDX-License-Identifier: MIT */
#include "console.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

bool console_read(bool (*run)(void *ctx, const char *line), const char *(*status)(void *ctx), void *ctx)
{
    static char held[256];
    static size_t n;
    ssize_t got = read(STDIN_FILENO, held + n, sizeof held - 1 - n);
    if (got <= 0)
        return false;
    n += (size_t)got;
    held[n] = '\0';
    for (char *newline; (newline = strchr(held, '\n')) != NULL;) {
        *newline = '\0';
        if (run(ctx, held))
            printf("ok %s %s\n", held, status(ctx));
        else
            printf("error: '%s' is no command; started without arguments I list them\n", held);
        fflush(stdout);
        n -= (size_t)(newline + 1 - held);
        memmove(held, newline + 1, n + 1);
    }
    if (n == sizeof held - 1)
        n = 0;
    return true;
}
