/* SPDX-License-Identifier: MIT */
/*
 * command_options - what a command of sonarctl is: a row with its words, its help, and its options, most of which come
 * from what protocol.h says of the methods. Knows no command.
 */
#ifndef SONARD_COMMAND_OPTIONS_H
#define SONARD_COMMAND_OPTIONS_H

#include "command.h"

struct command {
    const char *name;
    const char *words;       /* of the command line: alternatives with | between them, variables in capitals */
    const char *help;        /* NULL: that of the method of its name; without one it is of no use to people */
    const char *methods;     /* whose parameters are its options, */
    const char *not_options; /* but for these, */
    const struct argument *own_options; /* and these beside; NULL: none */
    int min_words, max_words;
    int (*run)(struct context *context);
    bool draws; /* it has no result to print */
};

/** command_find - in a table that a name NULL ends; NULL: there is none of that name. */
const struct command *command_find(const struct command *table, const char *name);

/** command_options - a command's own options, until it is called for another. */
const struct argument *command_options(const struct command *command);

/** command_help - a line about it; NULL: it is of no use to people. */
const char *command_help(const struct command *command);

/** command_common - the options that a command (NULL: any) has beside its own. */
const struct argument *command_common(const struct command *command);

#endif
