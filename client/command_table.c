/* SPDX-License-Identifier: MIT */
#include "command_table.h"

#include <string.h>

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
    {"--half-angle", "half_angle_deg", "A", "look in a cone that opens so many degrees to each side (7.5)",
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

static const struct argument explain_options[] = {
    {"--distance", "distance_m", "D", "metres to look ahead; must be given", ARGUMENT_NUMBER, 0, 0, 0},
    {"--elevation", "elevation_deg", "E", "degrees upward (0)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--half-angle", "half_angle_deg", "A", "of the cone, in degrees (7.5)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--count", "count", "N", "at most so many cells, and pings (8)", ARGUMENT_INTEGER, 0, 1, 64},
    FRAME_OPTION,
    GRID_OPTION,
    {0},
};

static const struct argument top_options[] = {
    {"--once", "once", "", "print one frame and end", ARGUMENT_FLAG, 0, 0, 0},
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
    {"--velocity", "velocity_mps", "X,Y,Z", "m/s: forward, right, down, or north, east, down; must be given",
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

const struct command command_table[] = {
    {"blocked", "AZ --distance D", "is a direction free? Exit status: 0 clear, 1 blocked, 2 unknown", blocked_options, 1, 1,
     command_blocked},
    {"explain", "AZ --distance D", "which echoes and pings an answer about a direction rests on", explain_options, 1, 1,
     command_explain},
    {"sectors", "", "state, range and age all around", sectors_options, 0, 0, command_method},
    {"nearest", "", "the nearest obstacle, and how much nearer than it is unknown", nearest_options, 0, 0,
     command_method},
    {"limit", "--velocity X,Y,Z", "how fast may the vehicle go, to stop in water known to be free?", limit_options, 0, 0,
     command_limit},
    {"time_to_collision", "", "when does the vehicle meet something?", collision_options, 0, 0, command_method},
    {"clusters", "", "what the obstacles form together", clusters_options, 0, 0, command_method},
    {"next_look", "", "which directions to look at next, and why", next_look_options, 0, 0, command_method},
    {"grid", "list|create NAME [KEY=VALUE...]|drop NAME|lock AZ|unlock AZ",
     "the grids of directions; locked cells neither change nor fade", grid_options, 1, ARGUMENTS_WORDS_MAX,
     command_grid},
    {"status", "", "what the daemon and its sonars do", NULL, 0, 0, command_method},
    {"sensors", "", "what every sonar is, where it sits and what it does", NULL, 0, 0, command_method},
    {"stats", "", "counters and latencies", stats_options, 0, 0, command_stats},
    {"top", "", "sectors, sonars, rates and warnings on the whole terminal, live", top_options, 0, 0, command_top},
    {"watch", "METHOD [KEY=VALUE...]", "ask a method again and again", watch_options, 1, ARGUMENTS_WORDS_MAX,
     command_watch},
    {"pose", "", "tell the daemon where the vehicle is", pose_options, 0, 0, command_pose},
    {"plot", "-o FILE", "draw echoes and sectors as SVG", plot_options, 0, 0, command_plot},
    {"background", "show|learn|stop|save|load|forget", "what a sonar hears of the vehicle itself",
     background_options, 1, 1, command_background},
    {"point", "N,E,D", "is this place free? Exit status: 0 free, 1 occupied, 2 unknown", point_options, 1, 1,
     command_place},
    {"box", "N,E,D N,E,D", "is all of the box between two places free? Exit status as of point", NULL, 2, 2, command_place},
    {"path", "N,E,D... --radius R", "may a body pass along these places? Exit status as of point", path_options, 1,
     ARGUMENTS_WORDS_MAX, command_place},
    {"map", "status|draw|new|forget|save NAME|load NAME|export NAME", "the map of places", map_options, 1, 2,
     command_map},
    {"plan", "", "which stages run, which are left out, why, and what each costs", NULL, 0, 0, command_method},
    {"reload", "", "have the daemon read its configuration anew", NULL, 0, 0, command_method},
    {"version", "", "versions of sonarctl and the daemon", NULL, 0, 0, command_version},
    {"call", "METHOD [JSON]", "call any method of sonard-protocol(7) with a JSON object of parameters", NULL, 1, 2,
     command_call_any},
    {"complete", "-- WORD...", NULL, NULL, 0, ARGUMENTS_WORDS_MAX, command_complete},
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
