/* SPDX-License-Identifier: MIT */
/*
 * arguments - the clients' command lines by tables: options become members of a JSON object under the names of the
 * daemon's parameters, the rest are words. Checks forms (a number is a number, without anything behind it) and the
 * ranges that the table gives; those of parameters that go to the daemon are the daemon's.
 */
#ifndef SONARD_ARGUMENTS_H
#define SONARD_ARGUMENTS_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>

#include "core/fault.h"

#define ARGUMENTS_WORDS_MAX 32

enum argument_kind { ARGUMENT_NUMBER, ARGUMENT_INTEGER, ARGUMENT_TEXT, ARGUMENT_NUMBERS, ARGUMENT_FLAG };

struct argument {
    const char *flag; /* "--distance"; NULL ends the table */
    const char *key;  /* member of the object */
    const char *form; /* for the help: "D" */
    const char *help;
    enum argument_kind kind;
    int n;         /* ARGUMENT_NUMBERS: how many, separated by commas */
    double lo, hi; /* of a number, both included; equal: any */
};

/* The options that a command line may have; NULL: none. */
struct argument_tables {
    const struct argument *common; /* of all commands */
    const struct argument *own;    /* of this one */
};

struct arguments {
    json_t *options;
    const char *word[ARGUMENTS_WORDS_MAX];
    int n_words;
};

/** arguments_is_option - does it begin like one? A negative number is a word. */
bool arguments_is_option(const char *arg);

/** arguments_find - the option of the n bytes at flag in a table (NULL: an empty one), or NULL. */
const struct argument *arguments_find(const struct argument *table, const char *flag, size_t n);

/** arguments_number - a decimal number that is all of the text, finite and within [lo, hi]; otherwise false. */
bool arguments_number(const char *text, double lo, double hi, double *number);

/** arguments_command - index in argv of the first word: of what is neither an option nor its value; argc: none. */
int arguments_command(int argc, char **argv);

/**
 * arguments_parse - argv[1..] without argv[command], by the tables. "-30" is a word, "--" ends the options,
 * "--flag=value" and "--flag value" mean the same. False with a sentence in fault. options is always set.
 */
bool arguments_parse(struct arguments *arguments, int argc, char **argv, int command,
                     const struct argument_tables *tables, struct fault *fault);

/** arguments_tell - "PROGRAM: WHAT; see `HELP`" on standard error; without HELP where a question ends it. */
void arguments_tell(const char *program, const char *what, const char *help);

#endif
