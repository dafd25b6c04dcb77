/* SPDX-License-Identifier: MIT */
/*
 * sonarctl - ask a running sonard, or work on its captures. command_table has the command line.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "config/word.h"
#include "capture.h"
#include "command_table.h"
#include "core/fault.h"

#define DEFAULT_TIMEOUT_S 5.0

/* The exit status, unless standard output could not be written. */
static int written(int status)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return status;
    fprintf(stderr, "sonarctl: standard output: %s\n", strerror(errno));
    return EXIT_OUTPUT;
}

static void print_options(const struct argument *options)
{
    for (; options && options->flag; options++)
        if (strcmp(options->flag, "-h") != 0)
            printf("  %s %-*s %s\n", options->flag, (int)(22 - strlen(options->flag)), options->form,
                   options->help);
}

static int print_help(const struct command *command)
{
    if (command) {
        printf("usage: sonarctl [OPTIONS] %s%s%s [OPTIONS]\n%s\n\n", command->name, command->words[0] ? " " : "",
               command->words,
               command_help(command) ? command_help(command) : "for the completion of bash and zsh");
        print_options(command_options(command));
        print_options(command_common(command));
        return EXIT_CLEAR;
    }
    printf("usage: sonarctl [OPTIONS] COMMAND [ARGUMENTS]\n\n");
    for (const struct command *c = command_table; c->name; c++)
        if (command_help(c))
            printf("  %-17s %s\n", c->name, command_help(c));
    printf("  %-17s %s\n\n", "capture", "import, inspect, repair and export captures, add poses; needs no daemon");
    print_options(command_common(NULL));
    printf("  --version               of sonarctl; needs no daemon\n");
    printf("\n`sonarctl COMMAND --help` tells a command's own options. Exit status: 3 wrong usage, 4 no daemon,\n"
           "5 the daemon did not answer, 6 it refused, 7 the output could not be written.\n");
    return EXIT_CLEAR;
}

/* Takes the common options out of the object; what is left are the parameters. */
static void take_common(struct context *context)
{
    json_t *options = context->arguments.options;
    const char *socket = json_string_value(json_object_get(options, "socket")), *set = getenv("SONARD_SOCKET");
    const json_t *timeout = json_object_get(options, "timeout");
    snprintf(context->socket, sizeof context->socket, "%s",
             socket        ? socket
             : set && *set ? set
                           : SONARD_DEFAULT_SOCKET);
    context->timeout_s = timeout ? json_number_value(timeout) : DEFAULT_TIMEOUT_S;
    context->json = json_object_get(options, "json") != NULL;
    context->colour = !context->json && isatty(STDOUT_FILENO) && !getenv("NO_COLOR");
    for (const struct argument *a = command_common(NULL); a->flag; a++)
        json_object_del(options, a->key);
}

static int run_command(const struct command *command, int argc, char **argv, int at)
{
    const struct argument_tables tables = {command_common(command), command_options(command)};
    struct context context = {.command = command->name, .commands = command_table};
    struct arguments *arguments = &context.arguments;
    struct fault fault;
    int status;
    if (!arguments_parse(arguments, argc, argv, at, &tables, &fault)) {
        status = command_usage(command->name, fault.text);
    } else if (json_object_get(arguments->options, "help")) {
        status = print_help(command);
    } else if (arguments->n_words < command->min_words || arguments->n_words > command->max_words) {
        fault_set(&fault, "usage: sonarctl %s%s%s", command->name, command->words[0] ? " " : "", command->words);
        status = command_usage(command->name, fault.text);
    } else {
        take_common(&context);
        status = command->run(&context);
        sonard_disconnect(context.client);
    }
    json_decref(arguments->options);
    return written(status);
}

/* The message for a word that is no command. */
static void unknown_command(const char *name, char *message, size_t size)
{
    size_t best = WORD_FAR;
    const char *meant = NULL;
    if (word_is_nearest(name, "capture", &best))
        meant = "capture";
    if (word_is_nearest(name, "help", &best))
        meant = "help";
    for (const struct command *c = command_table; c->name; c++)
        if (command_help(c) && word_is_nearest(name, c->name, &best))
            meant = c->name;
    snprintf(message, size, meant ? "no command '%.64s'; did you mean %s?" : "no command '%.64s'", name, meant);
}

/* `help`, `help COMMAND`; name NULL: no command. False: there is no such command. */
static bool help_about(const char *name)
{
    char *capture[] = {(char[]){"capture"}, (char[]){"--help"}, NULL};
    const struct command *command = name ? command_find(command_table, name) : NULL;
    if (name && strcmp(name, "capture") == 0)
        capture_main(2, capture);
    else if (command || !name || strcmp(name, "help") == 0 || arguments_is_option(name))
        print_help(command);
    else
        return false;
    return true;
}

int main(int argc, char **argv)
{
    const int at = arguments_command(argc, argv);
    const char *name = at < argc ? argv[at] : NULL;
    const struct command *command = name ? command_find(command_table, name) : NULL;
    const struct argument_tables tables = {command_common(NULL), NULL};
    struct arguments options = {0};
    struct fault fault;
    char message[128] = "a command is missing";
    if (command)
        return run_command(command, argc, argv, at);
    if (name && strcmp(name, "capture") == 0)
        return capture_main(argc - at, argv + at);
    if (name && strcmp(name, "help") == 0) {
        name = at + 1 < argc ? argv[at + 1] : NULL;
        if (help_about(name))
            return written(EXIT_CLEAR);
    }
    if (!name && argc > 1 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0))
        return written(print_help(NULL));
    if (!name && argc > 1 && strcmp(argv[1], "--version") == 0) {
        printf("sonarctl %s\n", SONARD_VERSION);
        return written(EXIT_CLEAR);
    }
    if (name)
        unknown_command(name, message, sizeof message);
    else if (!arguments_parse(&options, argc, argv, argc, &tables, &fault))
        snprintf(message, sizeof message, "%.127s", fault.text);
    json_decref(options.options);
    return command_usage(NULL, message);
}
