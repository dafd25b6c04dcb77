/* SPDX-License-Identifier: MIT */
#include "command_options.h"

#include <stdio.h>
#include <string.h>

#include "protocol/protocol.h"

static const struct argument common_options[] = {
    /* what draws has no result to print: all but this one */
    {"--json", "json", "", "the result object as it is, on one line", ARGUMENT_FLAG, 0, 0, 0},
    {"--socket", "socket", "PATH", "of the daemon; else $SONARD_SOCKET, else " SONARD_DEFAULT_SOCKET,
     ARGUMENT_TEXT, 0, 0, 0},
    {"--timeout", "timeout", "S", "seconds to wait for an answer (5)", ARGUMENT_NUMBER, 0, 0.001, 1e6},
    {"--help", "help", "", "this text", ARGUMENT_FLAG, 0, 0, 0},
    {"-h", "help", "", "this text", ARGUMENT_FLAG, 0, 0, 0},
    {0},
};

const struct command *command_find(const struct command *table, const char *name)
{
    for (const struct command *c = table; c->name; c++)
        if (strcmp(c->name, name) == 0)
            return c;
    return NULL;
}

const struct argument *command_common(const struct command *command)
{
    return common_options + (command && command->draws);
}

/* ---- options from the parameters of methods ---- */

#define OPTIONS_MAX 24

/* The options of one command: a program has one. */
static struct {
    struct argument row[OPTIONS_MAX + 1];
    char flag[OPTIONS_MAX][32], form[OPTIONS_MAX][64], help[OPTIONS_MAX][160];
    int n;
} options;

/* Is the name one of the words of a list? */
static bool listed(const char *list, const char *name)
{
    const size_t n = strlen(name);
    for (const char *at = list; (at = strstr(at, name)) != NULL; at += n)
        if ((at == list || at[-1] == ' ') && (at[n] == ' ' || at[n] == '\0'))
            return true;
    return false;
}

/* "half_angle_deg" as "--half-angle": a name without its unit. */
static void flag_of(const char *name, char *flag, size_t size)
{
    static const char *const units[] = {"_deg", "_m", "_mps", "_s", "_hz"};
    size_t n = strlen(name);
    for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
        const size_t unit = strlen(units[i]);
        if (n > unit && strcmp(name + n - unit, units[i]) == 0) {
            n -= unit;
            break;
        }
    }
    if (strcmp(name, "t_unix") == 0)
        snprintf(flag, size, "--time");
    else
        snprintf(flag, size, "--%.*s", (int)n, name);
    for (char *c = flag; *c; c++)
        *c = *c == '_' ? '-' : *c;
}

static void form_of(const struct protocol_param *p, char *form, size_t size)
{
    static const char *const axes[] = {"", "X", "X,Y", "X,Y,Z", "W,X,Y,Z"};
    static const char *const units[][2] = {{"degrees", "DEG"}, {"m", "M"},   {"m/s", "M/S"},
                                           {"s", "S"},         {"Hz", "HZ"}, {"", "X"}};
    size_t used = 0;
    form[0] = '\0';
    if (p->type == PROTOCOL_NUMBER)
        for (size_t i = 0; i < sizeof units / sizeof *units && !form[0]; i++)
            snprintf(form, size, "%s", strcmp(units[i][0], p->unit) == 0 ? units[i][1] : "");
    else if (p->type == PROTOCOL_WORD)
        for (int i = 0; p->words[i] && used < size; i++)
            used += (size_t)snprintf(form + used, size - used, "%s%s", i ? "|" : "", p->words[i]);
    else
        snprintf(form, size, "%s",
                 p->type == PROTOCOL_INTEGER   ? "N"
                 : p->type == PROTOCOL_BAND    ? "LO,HI"
                 : p->type == PROTOCOL_NUMBERS ? axes[p->count]
                                               : "NAME");
}

static void help_of(const struct protocol_param *p, const char *prefix, char *help, size_t size)
{
    char without[64];
    protocol_without(p, without, sizeof without);
    snprintf(help, size, "%s%s%s%s%s%s%s%s", prefix, p->help, p->unit[0] ? ", in " : "", p->unit,
             p->need == PROTOCOL_REQUIRED ? "; must be given" : "", without[0] ? " (" : "", without,
             without[0] ? ")" : "");
}

static void add_param(const struct protocol_param *p, const char *prefix)
{
    const int i = options.n++;
    flag_of(p->name, options.flag[i], sizeof options.flag[i]);
    form_of(p, options.form[i], sizeof options.form[i]);
    help_of(p, prefix, options.help[i], sizeof options.help[i]);
    options.row[i] = (struct argument){
        .flag = options.flag[i],
        .key = p->name,
        .form = options.form[i],
        .help = options.help[i],
        .kind = p->type == PROTOCOL_NUMBER                                ? ARGUMENT_NUMBER
                : p->type == PROTOCOL_INTEGER                             ? ARGUMENT_INTEGER
                : p->type == PROTOCOL_NUMBERS || p->type == PROTOCOL_BAND ? ARGUMENT_NUMBERS
                                                                          : ARGUMENT_TEXT,
        .n = (int)p->count,
    };
}

static bool has_key(const char *key)
{
    for (int i = 0; i < options.n; i++)
        if (strcmp(options.row[i].key, key) == 0)
            return true;
    return false;
}

/* Those of one of the methods: "map_slice", or "draw:map_slice" for what stands before their helps. */
static void add_method(const struct command *command, const char *word, size_t n)
{
    const char *colon = memchr(word, ':', n);
    const size_t before = colon ? (size_t)(colon - word) + 1 : 0;
    char name[32], prefix[32];
    snprintf(name, sizeof name, "%.*s", (int)(n - before), word + before);
    snprintf(prefix, sizeof prefix, "%.*s%s", (int)before, word, before ? " " : "");

    const struct protocol_method *method = protocol_find(name);

    for (const struct protocol_param *p = method ? method->params : NULL; p && p->name; p++)
        if (!listed(command->not_options, p->name) && !has_key(p->name))
            add_param(p, prefix);
}

const struct argument *command_options(const struct command *command)
{
    options.n = 0;
    for (const char *word = command->methods; *word;) {
        const size_t n = strcspn(word, " ");
        add_method(command, word, n);
        word += n + strspn(word + n, " ");
    }
    for (const struct argument *a = command->own_options; a && a->flag; a++)
        options.row[options.n++] = *a;
    options.row[options.n] = (struct argument){0};
    return options.row;
}

const char *command_help(const struct command *command)
{
    const struct protocol_method *method = protocol_find(command->name);
    return command->help ? command->help : method ? method->help : NULL;
}
