/* SPDX-License-Identifier: MIT */
/*
 * command_complete - what may stand at the end of a command line: `sonarctl complete -- WORD...`, which the shells'
 * completion asks. Prints the candidates for the last word, one on a line, with a tab and a help behind it. Names of
 * grids, sonars and maps are those of the daemon, when it answers at once.
 */
#include <dirent.h>
#include <stdio.h>
#include <string.h>

#include "command_options.h"
#include "client/lib/sonard_json.h"
#include "protocol/protocol.h"

#define PATIENCE_S 0.3 /* nobody waits longer for a tab */

struct line {
    struct context *context;
    const struct command *command;
    const char *word[ARGUMENTS_WORDS_MAX]; /* behind the command, without options */
    int n_words;
    const char *last; /* the one to complete */
};

/* n bytes of a word, and what comes behind them. */
static void offer(const struct line *line, const char *word, size_t n, const char *ending, const char *help)
{
    const size_t given = strlen(line->last);
    if (given > n + strlen(ending) || strncmp(word, line->last, given < n ? given : n) != 0)
        return;
    printf("%.*s%s%s%s\n", (int)n, word, ending, help[0] ? "\t" : "", help);
}

static void offer_word(const struct line *line, const char *word, const char *help)
{
    offer(line, word, strlen(word), "", help);
}

/* ---- what the daemon knows ---- */

static json_t *ask_daemon(const struct line *line, const char *method)
{
    struct context *context = line->context;
    struct sonard_error error;
    if (!context->client)
        context->client = sonard_connect(context->socket, PATIENCE_S, &error);
    return context->client ? sonard_json_call(context->client, method, NULL, &error) : NULL;
}

static void offer_names(const struct line *line, const char *method, const char *list)
{
    json_t *result = ask_daemon(line, method), *names = json_object_get(result, list);
    for (size_t i = 0; i < json_array_size(names); i++) {
        const char *name = json_string_value(json_object_get(json_array_get(names, i), "name"));
        if (name)
            offer_word(line, name, "");
    }
    json_decref(result);
}

static void offer_maps(const struct line *line)
{
    json_t *result = ask_daemon(line, "map");
    const char *path = json_string_value(json_object_get(result, "directory"));
    DIR *directory = path ? opendir(path) : NULL;
    for (const struct dirent *entry; directory && (entry = readdir(directory)) != NULL;) {
        const char *dot = strrchr(entry->d_name, '.');
        if (dot && strcmp(dot, ".map") == 0)
            offer(line, entry->d_name, (size_t)(dot - entry->d_name), "", "");
    }
    if (directory)
        closedir(directory);
    json_decref(result);
}

/* ---- what the tables know ---- */

static void offer_options(const struct line *line, const struct argument *table)
{
    for (; table && table->flag; table++)
        offer_word(line, table->flag, table->help);
}

/* The parts of "body|ned"; what is in capitals is not one to type. */
static void offer_alternatives(const struct line *line, const char *form)
{
    while (*form) {
        const size_t n = strcspn(form, "|"), word = strcspn(form, "| ");
        if (form[0] >= 'a' && form[0] <= 'z')
            offer(line, form, word, "", "");
        form += n + (form[n] != '\0');
    }
}

static void offer_value(const struct line *line, const struct argument *argument)
{
    if (strcmp(argument->key, "grid") == 0)
        offer_names(line, "grid_list", "grids");
    else if (strcmp(argument->key, "sensor") == 0)
        offer_names(line, "sensors", "sensors");
    else if (strchr(argument->form, '|'))
        offer_alternatives(line, argument->form);
}

static void offer_commands(const struct line *line)
{
    for (const struct command *c = line->context->commands; c->name; c++)
        if (command_help(c))
            offer_word(line, c->name, command_help(c));
    offer_word(line, "capture", "import, inspect, repair and export captures, add poses");
    offer_word(line, "help", "list the commands");
}

static void offer_methods(const struct line *line)
{
    for (const struct protocol_method *m = protocol_methods; m->name; m++)
        offer_word(line, m->name, m->help);
}

static void offer_keys(const struct line *line, const char *method)
{
    const struct protocol_method *m = protocol_find(method);
    for (const struct protocol_param *p = m ? m->params : NULL; p && p->name; p++)
        offer(line, p->name, strlen(p->name), "=", p->help);
}

/* Is there "FIRST NAME" among the alternatives? */
static bool wants_name(const char *words, const char *first)
{
    const char *found = first[0] ? strstr(words, first) : NULL;
    return found && strncmp(found + strlen(first), " NAME", 5) == 0;
}

/* A word that is no option. */
static void offer_argument(const struct line *line)
{
    const char *words = line->command->words, *first = line->n_words > 0 ? line->word[0] : "";
    const char *name = line->command->name;
    if (strncmp(words, "METHOD", 6) == 0) {
        if (line->n_words == 0)
            offer_methods(line);
        else if (strcmp(name, "watch") == 0)
            offer_keys(line, first);
    } else if (line->n_words == 0) {
        offer_alternatives(line, words);
    } else if (line->n_words == 1 && strcmp(name, "map") == 0 && wants_name(words, first)) {
        offer_maps(line);
    }
}

/* The option whose value stands at the end, if any; takes the words and the socket on the way. */
static const struct argument *read_line(struct line *line, char **argv, int argc, int at)
{
    const struct argument *waiting = NULL;
    for (int i = 1; i < argc; i++) {
        const struct argument *argument = NULL;
        if (i == at)
            continue;
        if (waiting) {
            if (strcmp(waiting->key, "socket") == 0)
                snprintf(line->context->socket, sizeof line->context->socket, "%s", argv[i]);
            waiting = NULL;
        } else if (arguments_is_option(argv[i])) {
            argument = arguments_find(command_common(NULL), argv[i], strlen(argv[i]));
            if (!argument && line->command)
                argument = arguments_find(command_options(line->command), argv[i], strlen(argv[i]));
            waiting = argument && argument->kind != ARGUMENT_FLAG ? argument : NULL;
        } else if (line->command) {
            line->word[line->n_words++] = argv[i];
        }
    }
    return waiting;
}

int command_complete(struct context *context)
{
    const struct arguments *given = &context->arguments;
    char *argv[ARGUMENTS_WORDS_MAX + 1] = {(char[]){"sonarctl"}};
    struct line line = {.context = context, .last = given->n_words > 0 ? given->word[given->n_words - 1] : ""};
    const int argc = given->n_words > 0 ? given->n_words : 1;
    for (int i = 1; i < argc; i++)
        argv[i] = (char *)given->word[i - 1];

    const int at = arguments_command(argc, argv);
    const bool helps = at < argc && strcmp(argv[at], "help") == 0;

    line.command = at < argc ? command_find(context->commands, argv[at]) : NULL;

    const struct argument *waiting = read_line(&line, argv, argc, at);

    if (waiting) {
        offer_value(&line, waiting);
    } else if (line.last[0] == '-') {
        offer_options(&line, line.command ? command_options(line.command) : NULL);
        offer_options(&line, command_common(line.command));
    } else if (at >= argc || helps) {
        offer_commands(&line);
    } else if (line.command) {
        offer_argument(&line);
    } else if (strcmp(argv[at], "capture") == 0 && at == argc - 1) {
        offer_alternatives(&line, "import|info|repair|export|add-pose");
    }
    return EXIT_CLEAR;
}
