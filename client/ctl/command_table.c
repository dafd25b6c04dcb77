/* SPDX-License-Identifier: MIT */
#include "command_table.h"

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

/* Options that are no parameters of a method, or whose values are words of it. */
static const struct argument top_options[] = {
    {"--once", "once", "", "print one frame and end", ARGUMENT_FLAG, 0, 0, 0},
    {0},
};

static const struct argument stats_options[] = {
    {"--prometheus", "prometheus", "", "in the text format that Prometheus scrapes", ARGUMENT_FLAG, 0, 0, 0},
    {0},
};

static const struct argument watch_options[] = {
    {"--rate", "rate_hz", "HZ", "notifications per second, 0.1 to 50 (1)", ARGUMENT_NUMBER, 0, 0.1, 50},
    {"--count", "count", "N", "stop after this many", ARGUMENT_INTEGER, 0, 1, 1e9},
    {0},
};

static const struct argument pose_options[] = {
    {"--rate", "rate_hz", "HZ", "keep sending it, 0.1 to 50 times a second, until Ctrl-C", ARGUMENT_NUMBER, 0, 0.1,
     50},
    {"--withdraw", "withdraw", "", "take the pose back: go on as if none had ever been given", ARGUMENT_FLAG, 0, 0,
     0},
    {0},
};

static const struct argument setup_options[] = {
    {"--device", "device", "NAME", "which sonar; else it is found by listening", ARGUMENT_TEXT, 0, 0, 0},
    {"--port", "port", "PORT", "where: a device file, or a port as in sonard.conf; else all serial adapters",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--listen", "listen", "", "send nothing to find it: only listen", ARGUMENT_FLAG, 0, 0, 0},
    {"--name", "name", "NAME", "of the sonar (front)", ARGUMENT_TEXT, 0, 0, 0},
    {"--mount", "mount_m", "F,R,D", "of the transducer: forward, right, down of the vehicle's middle, in m",
     ARGUMENT_NUMBERS, 3, 0, 0},
    {"--upside-down", "upside_down", "", "it is mounted so", ARGUMENT_FLAG, 0, 0, 0},
    {"--size", "size_m", "L,W,H", "of the vehicle: length, width, height, in m", ARGUMENT_NUMBERS, 3, 0, 0},
    {"--range", "range_m", "M", "how far to listen, 0.75 to 200 m", ARGUMENT_NUMBER, 0, 0.75, 200},
    {"--output", "output", "FILE", "to write, - for standard output (/etc/sonard/sonard.conf.d/50-setup.conf)",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--yes", "yes", "", "ask nothing: what options do not say stays at the default of sonard.conf(5)",
     ARGUMENT_FLAG, 0, 0, 0},
    {0},
};

static const struct argument plot_options[] = {
    {"-o", "output", "FILE", "SVG file to write, - for standard output; must be given", ARGUMENT_TEXT, 0, 0, 0},
    {"--range", "range_m", "M", "how far the picture reaches, in m (as the sonar listens)", ARGUMENT_NUMBER, 0,
     0.1, 1000},
    {0},
};

static const struct argument background_options[] = {
    {"--standing", "standing", "", "learn: even if the vehicle does not move", ARGUMENT_FLAG, 0, 0, 0},
    {"--no-wait", "no_wait", "", "learn: do not wait for the end", ARGUMENT_FLAG, 0, 0, 0},
    {"--use", "use", "", "stop: build the template from the pings so far", ARGUMENT_FLAG, 0, 0, 0},
    {"--svg", "svg", "FILE", "show: draw into this file, - for standard output", ARGUMENT_TEXT, 0, 0, 0},
    {0},
};

static const struct argument map_options[] = {
    {"--cells", "cells", "N", "draw: cells along a side (160 for -o, else 40)", ARGUMENT_INTEGER, 0, 0, 0},
    {"-o", "output", "FILE", "draw: as SVG into this file, - for standard output", ARGUMENT_TEXT, 0, 0, 0},
    {0},
};

const struct command command_table[] = {
    {"blocked", "AZ --distance M", "is a direction free? Exit status: 0 clear, 1 blocked, 2 unknown", "blocked",
     "azimuth_deg", NULL, 1, 1, command_blocked},
    {"explain", "AZ --distance M", NULL, "explain", "azimuth_deg", NULL, 1, 1, command_explain},
    {"sectors", "", NULL, "sectors", "", NULL, 0, 0, command_method},
    {"nearest", "", NULL, "nearest", "", NULL, 0, 0, command_method},
    {"limit", "--velocity X,Y,Z", NULL, "limit", "", NULL, 0, 0, command_limit},
    {"time_to_collision", "", NULL, "time_to_collision", "", NULL, 0, 0, command_method},
    {"clusters", "", NULL, "clusters", "", NULL, 0, 0, command_method},
    {"next_look", "", NULL, "next_look", "", NULL, 0, 0, command_method},
    {"grid", "list|lock AZ|unlock AZ|export FILE",
     "the spherical grids; locked cells neither change nor fade; export to .csv or .mcap", "grid_lock",
     "azimuth_deg locked", NULL, 1, 2, command_grid},
    {"status", "", NULL, "status", "", NULL, 0, 0, command_method},
    {"sensors", "", NULL, "sensors", "", NULL, 0, 0, command_method},
    {"stats", "", NULL, "stats", "", stats_options, 0, 0, command_stats},
    {"top", "", "sectors, sonars, rates and warnings on the whole terminal, live", "sectors", "", top_options, 0,
     0, command_top},
    {"watch", "METHOD [KEY=VALUE...]", NULL, "watch", "method params rate_hz", watch_options, 1,
     ARGUMENTS_WORDS_MAX, command_watch},
    {"pose", "", "tell the daemon where the vehicle is", "pose", "", pose_options, 0, 0, command_pose},
    {"plot", "-o FILE", "draw echoes and sectors as SVG", "image", "", plot_options, 0, 0, command_plot},
    {"background", "show|learn|stop|save|load|forget", "the vehicle's own echoes: learn, save or load a template",
     "background learn:background_learn", "motion picture", background_options, 1, 1, command_background},
    {"point", "N,E,D", "is this place free? Exit status: 0 free, 1 occupied, 2 unknown", "point", "position_m",
     NULL, 1, 1, command_place},
    {"box", "N,E,D N,E,D", "is all of the box between two places free? Exit status as of point", "box",
     "from_m to_m", NULL, 2, 2, command_place},
    {"path", "N,E,D... --radius M", "may a body pass along these places? Exit status as of point", "path",
     "points_m", NULL, 1, ARGUMENTS_WORDS_MAX, command_place},
    {"map", "status|draw|new|forget|save NAME|load NAME|export NAME", "the voxel map",
     "export:map_export draw:map_slice", "name cells", map_options, 1, 2, command_map},
    {"plan", "", NULL, "plan", "", NULL, 0, 0, command_method},
    {"reload", "", NULL, "reload", "", NULL, 0, 0, command_method},
    {"replay", "", NULL, "replay", "", NULL, 0, 0, command_method},
    {"version", "", "versions of sonarctl and the daemon", "version", "", NULL, 0, 0, command_version},
    {"call", "METHOD [JSON]", "call any method of sonard-protocol(7) with a JSON object of parameters", "", "",
     NULL, 1, 2, command_call_any},
    {"setup", "", "find the sonar, ask where it sits, write a configuration; needs no daemon", "", "",
     setup_options, 0, 0, command_setup},
    {"complete", "-- WORD...", NULL, "", "", NULL, 0, ARGUMENTS_WORDS_MAX, command_complete},
    {0},
};

const struct command *command_find(const char *name)
{
    for (const struct command *c = command_table; c->name; c++)
        if (strcmp(c->name, name) == 0)
            return c;
    return NULL;
}

const struct argument *command_common(const struct command *command)
{
    const bool draws = command && (command->run == command_top || command->run == command_plot);

    return common_options + draws;
}

/* ---- options from the parameters of methods ---- */

#define OPTIONS_MAX 24

/* The options of one command: a program has one. */
static struct {
    struct argument row[OPTIONS_MAX + 1];
    char flag[OPTIONS_MAX][32], form[OPTIONS_MAX][24], help[OPTIONS_MAX][160];
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
