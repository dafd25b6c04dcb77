/* SPDX-License-Identifier: MIT */
/*
 * command_table - the command line of sonarctl and its help, in tables: what the program, its help and the shells'
 * completion go by. Knows no daemon.
 */
#ifndef SONARD_COMMAND_TABLE_H
#define SONARD_COMMAND_TABLE_H

#include "command.h"

struct command {
    const char *name;
    const char *words;              /* of the command line: alternatives with | between them, variables in capitals */
    const char *help;               /* NULL: of no use to people */
    const struct argument *options; /* NULL: none but the common ones */
    int min_words, max_words;
    int (*run)(struct context *context);
};

extern const struct command command_table[]; /* a name NULL ends it */

/** command_find - NULL: there is none of that name. */
const struct command *command_find(const char *name);

/** command_common - the options that a command (NULL: any) has beside its own. */
const struct argument *command_common(const struct command *command);

#endif
