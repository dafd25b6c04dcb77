/* SPDX-License-Identifier: MIT */
#include "arguments.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/word.h"

bool arguments_is_option(const char *arg)
{
    return arg[0] == '-' && arg[1] != '\0' && !isdigit((unsigned char)arg[1]) && arg[1] != '.';
}

int arguments_command(int argc, char **argv)
{
    static const char *const without_value[] = {"--json", "--help", "-h", "--"};
    for (int i = 1; i < argc; i++) {
        bool alone = strchr(argv[i], '=') != NULL;
        if (!arguments_is_option(argv[i]))
            return i;
        for (size_t k = 0; k < sizeof without_value / sizeof *without_value; k++)
            alone = alone || strcmp(argv[i], without_value[k]) == 0;
        i += !alone;
    }
    return argc;
}

const struct argument *arguments_find(const struct argument *table, const char *flag, size_t n)
{
    for (; table && table->flag; table++)
        if (strlen(table->flag) == n && strncmp(table->flag, flag, n) == 0)
            return table;
    return NULL;
}

/* The number at the start of the text, with what is behind it in *end; no hexadecimal, infinity or NaN. */
static bool read_number(const char *text, double *number, char **end)
{
    if (text[strspn(text, "+-.0123456789eE,")])
        return false;
    *number = strtod(text, end);
    return *end != text && isfinite(*number);
}

bool arguments_number(const char *text, double lo, double hi, double *number)
{
    char *end;
    return read_number(text, number, &end) && *end == '\0' && *number >= lo && *number <= hi;
}

/* n numbers separated by commas; NULL when it is anything else */
static json_t *parse_numbers(const char *value, int n)
{
    json_t *list = json_array();
    for (int i = 0; i < n; i++) {
        char *end;
        double number;
        if (!read_number(value, &number, &end) || *end != (i + 1 < n ? ',' : '\0')) {
            json_decref(list);
            return NULL;
        }
        json_array_append_new(list, json_real(number));
        value = end + 1;
    }
    return list;
}

static json_t *parse_value(const struct argument *argument, const char *value)
{
    json_t *list, *number;
    long long whole;
    char *end;
    switch (argument->kind) {
    case ARGUMENT_NUMBERS:
        return parse_numbers(value, argument->n);
    case ARGUMENT_NUMBER:
        list = parse_numbers(value, 1);
        number = json_incref(json_array_get(list, 0));
        json_decref(list);
        return number;
    case ARGUMENT_INTEGER:
        errno = 0;
        whole = strtoll(value, &end, 10);
        return end != value && !*end && !value[strspn(value, "+-0123456789")] && errno == 0 ? json_integer(whole)
                                                                                            : NULL;
    default:
        return json_string(value);
    }
}

static bool in_range(const struct argument *argument, const json_t *parsed, const char *value, struct fault *fault)
{
    const double number = json_number_value(parsed);
    if (argument->lo == argument->hi || !json_is_number(parsed) ||
        (number >= argument->lo && number <= argument->hi))
        return true;
    return fault_set(fault, "%s %.50s: expected a%s number from %g to %g", argument->flag, value,
                     argument->kind == ARGUMENT_INTEGER ? " whole" : "", argument->lo, argument->hi);
}

#define DIGITS  "0123456789."
#define LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"

/* Nothing but letters behind a number. */
static bool has_unit(const char *value)
{
    const size_t n = strspn(value, DIGITS);
    return n > 0 && value[n] && !value[n + strspn(value + n, LETTERS)];
}

static bool set(json_t *options, const struct argument *argument, const char *value, struct fault *fault)
{
    json_t *parsed = argument->kind == ARGUMENT_FLAG ? json_true() : parse_value(argument, value);
    if (json_object_get(options, argument->key)) {
        json_decref(parsed);
        return fault_set(fault, "%s is given twice", argument->flag);
    }
    if (!parsed && argument->kind == ARGUMENT_NUMBER && has_unit(value))
        return fault_set(fault, "%s %s: expected %s as a plain number, such as %.*s: %.*s", argument->flag, value,
                         argument->form, (int)strspn(value, DIGITS), value, (int)strcspn(argument->help, ";"),
                         argument->help);
    if (!parsed)
        return fault_set(fault, "%s %s: expected %s, %.*s", argument->flag, value, argument->form,
                         (int)strcspn(argument->help, ";"), argument->help);
    if (!in_range(argument, parsed, value, fault)) {
        json_decref(parsed);
        return false;
    }
    return json_object_set_new(options, argument->key, parsed) == 0;
}

/* There is none whose name are the n bytes at flag; false. */
static bool refuse_option(const struct argument_tables *tables, const char *flag, size_t n, struct fault *fault)
{
    const struct argument *const table[] = {tables->own, tables->common};
    char name[WORD_FAR];
    const char *meant = NULL;
    size_t best = WORD_FAR;
    snprintf(name, sizeof name, "%.*s", (int)n, flag);
    for (size_t i = 0; i < 2; i++)
        for (const struct argument *a = table[i]; a && a->flag; a++)
            if (a->flag[1] == '-' && word_is_nearest(name, a->flag, &best))
                meant = a->flag;
    return fault_set(fault, meant ? "no option %s; did you mean %s?" : "no option %s", name, meant);
}

bool arguments_parse(struct arguments *arguments, int argc, char **argv, int command,
                     const struct argument_tables *tables, struct fault *fault)
{
    bool only_words = false;
    *arguments = (struct arguments){.options = json_object()};
    for (int i = 1; i < argc; i++) {
        const char *arg = argv[i], *equals = strchr(arg, '=');
        const size_t n = equals ? (size_t)(equals - arg) : strlen(arg);
        if (i == command)
            continue;
        if (!only_words && strcmp(arg, "--") == 0) {
            only_words = true;
        } else if (only_words || !arguments_is_option(arg)) {
            if (arguments->n_words == ARGUMENTS_WORDS_MAX)
                return fault_set(fault, "more than %d words", ARGUMENTS_WORDS_MAX);
            arguments->word[arguments->n_words++] = arg;
        } else {
            const struct argument *argument = arguments_find(tables->common, arg, n);
            const char *value = equals ? equals + 1 : NULL;
            argument = argument ? argument : arguments_find(tables->own, arg, n);
            if (!argument)
                return refuse_option(tables, arg, n, fault);
            if (argument->kind == ARGUMENT_FLAG && value)
                return fault_set(fault, "option %s takes no value", arg);
            if (argument->kind != ARGUMENT_FLAG && !value) {
                i += i + 1 == command ? 2 : 1;
                if (i >= argc)
                    return fault_set(fault, "%s needs a value: %s, %.*s", arg, argument->form,
                                     (int)strcspn(argument->help, ";"), argument->help);
                value = argv[i];
            }
            if (!set(arguments->options, argument, value, fault))
                return false;
        }
    }
    return true;
}

void arguments_tell(const char *program, const char *what, const char *help)
{
    const size_t n = strlen(what);
    if (n > 0 && what[n - 1] == '?')
        fprintf(stderr, "%s: %s\n", program, what);
    else
        fprintf(stderr, "%s: %s; see `%s`\n", program, what, help);
}
