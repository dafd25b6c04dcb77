/* SPDX-License-Identifier: MIT */
/*
 * sonarctl - ask a running sonard, or work on its captures. The tables below are the command line and its help; the
 * commands are in command_ask.c, command_background.c and command_places.c.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "capture.h"
#include "command.h"

#define DEFAULT_TIMEOUT_S 5.0

struct command {
    const char *name, *words, *help;
    const struct argument *options; /* NULL: none but the common ones */
    int min_words, max_words;
    int (*run)(struct context *context);
};

static const struct argument common_options[] = {
    {"--socket", "socket", "PATH", "of the daemon; else $SONARD_SOCKET, else " SONARD_DEFAULT_SOCKET,
     ARGUMENT_TEXT, 0, 0, 0},
    {"--timeout", "timeout", "S", "seconds to wait for an answer (5)", ARGUMENT_NUMBER, 0, 0.001, 1e6},
    {"--json", "json", "", "the result object as it is, on one line", ARGUMENT_FLAG, 0, 0, 0},
    {"--help", "help", "", "this text", ARGUMENT_FLAG, 0, 0, 0},
    {"-h", "help", "", "this text", ARGUMENT_FLAG, 0, 0, 0},
    {0},
};

#define FRAME_OPTION                                                                                              \
    {                                                                                                             \
        "--frame", "frame", "body|ned", "azimuth 0 is forward (body) or north (ned)", ARGUMENT_TEXT, 0, 0, 0      \
    }

#define GRID_OPTION                                                                                               \
    {                                                                                                             \
        "--grid", "grid", "NAME", "ask this grid (main)", ARGUMENT_TEXT, 0, 0, 0                                  \
    }

static const struct argument blocked_options[] = {
    {"--distance", "distance_m", "D", "metres to look ahead; must be given", ARGUMENT_NUMBER, 0, 0, 0},
    {"--elevation", "elevation_deg", "E", "degrees upward (0)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--half-angle", "half_angle_deg", "A", "look in a cone that opens so many degrees to each side",
     ARGUMENT_NUMBER, 0, 0, 0},
    {"--radius", "radius_m", "R", "look in a corridor of this radius in metres instead", ARGUMENT_NUMBER, 0, 0, 0},
    FRAME_OPTION,
    GRID_OPTION,
    {0},
};

static const struct argument sectors_options[] = {
    {"--count", "count", "N", "number of sectors around (72)", ARGUMENT_INTEGER, 0, 0, 0},
    {"--elevation", "elevation_deg", "LO,HI", "band of elevations in degrees", ARGUMENT_NUMBERS, 2, 0, 0},
    {"--distance", "distance_m", "D", "metres to look ahead; else as far as the grid reaches", ARGUMENT_NUMBER, 0,
     0, 0},
    FRAME_OPTION,
    GRID_OPTION,
    {0},
};

static const struct argument nearest_options[] = {
    {"--elevation", "elevation_deg", "LO,HI", "band of elevations in degrees (-90,90)", ARGUMENT_NUMBERS, 2, 0, 0},
    {"--distance", "distance_m", "D", "what is farther away in metres does not count", ARGUMENT_NUMBER, 0, 0, 0},
    FRAME_OPTION,
    GRID_OPTION,
    {0},
};

static const struct argument limit_options[] = {
    {"--velocity", "velocity_mps", "X,Y,Z", "asked for, in m/s: forward, right, down, or north, east, down",
     ARGUMENT_NUMBERS, 3, 0, 0},
    FRAME_OPTION,
    GRID_OPTION,
    {0},
};

static const struct argument collision_options[] = {
    {"--velocity", "velocity_mps", "X,Y,Z", "in m/s: forward, right, down, or north, east, down (the pose's)",
     ARGUMENT_NUMBERS, 3, 0, 0},
    {"--ahead", "ahead_s", "S", "seconds to look ahead (60)", ARGUMENT_NUMBER, 0, 0, 0},
    FRAME_OPTION,
    GRID_OPTION,
    {0},
};

static const struct argument clusters_options[] = {
    {"--count", "count", "N", "at most so many, the nearest (64)", ARGUMENT_INTEGER, 0, 1, 256},
    GRID_OPTION,
    {0},
};

static const struct argument next_look_options[] = {
    {"--count", "count", "N", "so many directions (8)", ARGUMENT_INTEGER, 0, 1, 64},
    {"--elevation", "elevation_deg", "LO,HI", "band of elevations in degrees (-5,5)", ARGUMENT_NUMBERS, 2, 0, 0},
    {"--apart", "apart_deg", "A", "at least so many degrees apart (10)", ARGUMENT_NUMBER, 0, 0, 180},
    GRID_OPTION,
    {0},
};

static const struct argument grid_options[] = {
    {"--elevation", "elevation_deg", "E", "degrees upward (0)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--half-angle", "half_angle_deg", "A",
     "lock, unlock: the cells of a cone that opens so many degrees to each side (5)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--from", "from_m", "R", "and not nearer than this, in metres (0)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--to", "to_m", "R", "and not farther than this", ARGUMENT_NUMBER, 0, 0, 0},
    GRID_OPTION,
    {0},
};

static const struct argument stats_options[] = {
    {"--prometheus", "prometheus", "", "in the text format that Prometheus scrapes", ARGUMENT_FLAG, 0, 0, 0},
    {0},
};

static const struct argument watch_options[] = {
    {"--rate", "rate_hz", "HZ", "notifications per second, 0.1 to 50 (1)", ARGUMENT_NUMBER, 0, 0.1, 50},
    {"--count", "count", "N", "end after so many", ARGUMENT_INTEGER, 0, 1, 1e9},
    {0},
};

static const struct argument pose_options[] = {
    {"--attitude", "attitude_deg", "R,P,Y", "roll, pitch, yaw in degrees", ARGUMENT_NUMBERS, 3, 0, 0},
    {"--quaternion", "quaternion", "W,X,Y,Z", "attitude, body to north-east-down, instead", ARGUMENT_NUMBERS, 4, 0,
     0},
    {"--position", "position_m", "N,E,D", "metres north, east, down", ARGUMENT_NUMBERS, 3, 0, 0},
    {"--depth", "depth_m", "D", "metres below the surface", ARGUMENT_NUMBER, 0, 0, 0},
    {"--velocity", "velocity_mps", "N,E,D", "metres per second north, east, down", ARGUMENT_NUMBERS, 3, 0, 0},
    {"--time", "t_unix", "T", "Unix seconds of the measurement (now)", ARGUMENT_NUMBER, 0, 0, 0},
    {0},
};

static const struct argument plot_options[] = {
    {"-o", "output", "FILE", "SVG file to write, - for standard output; must be given", ARGUMENT_TEXT, 0, 0, 0},
    {"--sensor", "sensor", "NAME", "which sonar (the first)", ARGUMENT_TEXT, 0, 0, 0},
    {0},
};

static const struct argument background_options[] = {
    {"--sensor", "sensor", "NAME", "which sonar (the first)", ARGUMENT_TEXT, 0, 0, 0},
    {"--pings", "pings", "K", "learn: pings of each direction, 1 to 64 (15)", ARGUMENT_INTEGER, 0, 1, 64},
    {"--standing", "standing", "", "learn: although the vehicle does not move", ARGUMENT_FLAG, 0, 0, 0},
    {"--no-wait", "no_wait", "", "learn: do not wait until it is done", ARGUMENT_FLAG, 0, 0, 0},
    {"--use", "use", "", "stop: make the template of what there is", ARGUMENT_FLAG, 0, 0, 0},
    {"--svg", "svg", "FILE", "show: draw into this file, - for standard output", ARGUMENT_TEXT, 0, 0, 0},
    {0},
};

#define PLACE_FRAME_OPTION                                                                                        \
    {                                                                                                             \
        "--frame", "frame", "ned|body", "north, east, down (ned), or forward, right, down of the vehicle (body)", \
            ARGUMENT_TEXT, 0, 0, 0                                                                                \
    }

static const struct argument point_options[] = {PLACE_FRAME_OPTION, {0}};

static const struct argument path_options[] = {
    {"--radius", "radius_m", "R", "of the corridor around the path, in metres; must be given", ARGUMENT_NUMBER, 0,
     0, 0},
    PLACE_FRAME_OPTION,
    {0},
};

static const struct argument map_options[] = {
    {"--format", "format", "ply|mcap|bt", "export: of the file (ply)", ARGUMENT_TEXT, 0, 0, 0},
    {"--depth", "depth_m", "D", "draw: metres below the surface (the vehicle's)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--middle", "middle_m", "N,E", "draw: what is in the middle (the vehicle)", ARGUMENT_NUMBERS, 2, 0, 0},
    {"--size", "size_m", "S", "draw: side of the picture in metres (40)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--cells", "cells", "N", "draw: cells along a side (160 for -o, else 40)", ARGUMENT_INTEGER, 0, 0, 0},
    {"-o", "output", "FILE", "draw: as SVG into this file, - for standard output", ARGUMENT_TEXT, 0, 0, 0},
    {0},
};

static const struct command commands[] = {
    {"blocked", "AZ", "is a direction free? Exit status: 0 clear, 1 blocked, 2 unknown", blocked_options, 1, 1,
     command_blocked},
    {"sectors", "", "state, range and age all around", sectors_options, 0, 0, command_method},
    {"nearest", "", "the nearest obstacle, and how much nearer than it is unknown", nearest_options, 0, 0,
     command_method},
    {"limit", "", "how fast may the vehicle go, to stop in water known to be free?", limit_options, 0, 0,
     command_method},
    {"time_to_collision", "", "when does the vehicle meet something?", collision_options, 0, 0, command_method},
    {"clusters", "", "what the obstacles form together", clusters_options, 0, 0, command_method},
    {"next_look", "", "which directions to look at next, and why", next_look_options, 0, 0, command_method},
    {"grid", "list|create NAME [KEY=VALUE...]|drop NAME|lock AZ|unlock AZ",
     "the grids of directions; locked cells neither change nor fade", grid_options, 1, ARGUMENTS_WORDS_MAX,
     command_grid},
    {"status", "", "what the daemon and its sonars do", NULL, 0, 0, command_method},
    {"sensors", "", "what every sonar is, where it sits and what it does", NULL, 0, 0, command_method},
    {"stats", "", "counters and latencies", stats_options, 0, 0, command_stats},
    {"watch", "METHOD [KEY=VALUE...]", "ask a method again and again", watch_options, 1, ARGUMENTS_WORDS_MAX,
     command_watch},
    {"pose", "", "tell the daemon where the vehicle is", pose_options, 0, 0, command_pose},
    {"plot", "", "draw echoes and sectors as SVG", plot_options, 0, 0, command_plot},
    {"background", "show|learn|stop|save|load|forget", "what a sonar hears of the vehicle itself",
     background_options, 1, 1, command_background},
    {"point", "N,E,D", "is this place free? Exit status: 0 free, 1 occupied, 2 unknown", point_options, 1, 1,
     command_place},
    {"box", "N,E,D N,E,D", "is all of the box between two places free?", NULL, 2, 2, command_place},
    {"path", "N,E,D...", "may a body pass along these places?", path_options, 1, ARGUMENTS_WORDS_MAX,
     command_place},
    {"map", "status|draw|new|forget|save NAME|load NAME|export NAME", "the map of places", map_options, 1, 2,
     command_map},
    {"plan", "", "which stages run, which are left out, why, and what each costs", NULL, 0, 0, command_method},
    {"reload", "", "have the daemon read its configuration anew", NULL, 0, 0, command_method},
    {"version", "", "versions of sonarctl and the daemon", NULL, 0, 0, command_version},
    {"call", "METHOD [JSON]", "call any method with a JSON object of parameters", NULL, 1, 2, command_call_any},
};

#define N_COMMANDS (sizeof commands / sizeof *commands)

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
               command->words, command->help);
        print_options(command->options);
        print_options(common_options);
        return EXIT_CLEAR;
    }
    printf("usage: sonarctl [OPTIONS] COMMAND [ARGUMENTS]\n\n");
    for (size_t i = 0; i < N_COMMANDS; i++)
        printf("  %-17s %s\n", commands[i].name, commands[i].help);
    printf("  %-17s %s\n\n", "capture", "import, inspect, repair and export captures; needs no daemon");
    print_options(common_options);
    printf("  --version               of sonarctl; needs no daemon\n");
    printf("\n`sonarctl COMMAND --help` tells a command's own options. Exit status: 3 wrong usage, 4 no daemon,\n"
           "5 the daemon did not answer, 6 it refused, 7 the output could not be written.\n");
    return EXIT_CLEAR;
}

static const struct command *find_command(const char *name)
{
    for (size_t i = 0; i < N_COMMANDS; i++)
        if (strcmp(commands[i].name, name) == 0)
            return &commands[i];
    return NULL;
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
    for (const struct argument *a = common_options; a->flag; a++)
        json_object_del(options, a->key);
}

static int run_command(const struct command *command, int argc, char **argv, int at)
{
    struct context context = {.command = command->name};
    struct arguments *arguments = &context.arguments;
    char err[256];
    int status;

    if (!arguments_parse(arguments, argc, argv, at, common_options, command->options, err, sizeof err)) {
        status = command_usage(command->name, err);
    } else if (json_object_get(arguments->options, "help")) {
        status = print_help(command);
    } else if (arguments->n_words < command->min_words || arguments->n_words > command->max_words) {
        snprintf(err, sizeof err, "want: sonarctl %s%s%s", command->name, command->words[0] ? " " : "",
                 command->words);
        status = command_usage(command->name, err);
    } else {
        take_common(&context);
        status = command->run(&context);
        sonard_disconnect(context.client);
    }
    json_decref(arguments->options);
    if (fflush(stdout) == 0 && !ferror(stdout))
        return status;
    fprintf(stderr, "sonarctl: standard output: %s\n", strerror(errno));
    return EXIT_OUTPUT;
}

int main(int argc, char **argv)
{
    const int at = arguments_command(argc, argv);
    const char *name = at < argc ? argv[at] : NULL;
    const struct command *command = name ? find_command(name) : NULL;
    char message[128];

    if (command)
        return run_command(command, argc, argv, at);
    if (name && strcmp(name, "capture") == 0)
        return capture_main(argc - at, argv + at);
    if (name && strcmp(name, "help") == 0) {
        name = at + 1 < argc ? argv[at + 1] : NULL;
        command = name ? find_command(name) : NULL;
        if (command || !name)
            return print_help(command);
    }
    if (!name && argc > 1 && (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0))
        return print_help(NULL);
    if (!name && argc > 1 && strcmp(argv[1], "--version") == 0) {
        printf("sonarctl %s\n", SONARD_VERSION);
        return EXIT_CLEAR;
    }
    snprintf(message, sizeof message, name ? "no command '%.64s'" : "a command is missing", name);
    return command_usage(NULL, message);
}
