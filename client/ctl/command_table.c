/* SPDX-License-Identifier: MIT */
#include "command_table.h"

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
    {"--current", "current_mps", "M/S",
     "of a vehicle without a DVL: how fast the water goes at most, 0 to 5 m/s (pool 0.05, harbour 0.3, tide 1)",
     ARGUMENT_NUMBER, 0, 0, 5},
    {"--near", "near", "",
     "promise for a Ping360 that every obstacle near by reaches from the bottom to the surface", ARGUMENT_FLAG, 0,
     0, 0},
    {"--output", "output", "FILE", "to write, - for standard output (/etc/sonard/sonard.conf.d/50-setup.conf)",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--yes", "yes", "", "ask nothing: everything not given keeps its default (sonard.conf(5))", ARGUMENT_FLAG, 0,
     0, 0},
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
     "azimuth_deg", NULL, 1, 1, command_blocked, false},
    {"explain", "AZ --distance M", NULL, "explain", "azimuth_deg", NULL, 1, 1, command_explain, false},
    {"sectors", "", NULL, "sectors", "", NULL, 0, 0, command_method, false},
    {"nearest", "", NULL, "nearest", "", NULL, 0, 0, command_method, false},
    {"limit", "--velocity X,Y,Z", NULL, "limit", "", NULL, 0, 0, command_limit, false},
    {"time_to_collision", "", NULL, "time_to_collision", "", NULL, 0, 0, command_method, false},
    {"clusters", "", NULL, "clusters", "", NULL, 0, 0, command_method, false},
    {"next_look", "", NULL, "next_look", "", NULL, 0, 0, command_method, false},
    {"grid", "list|lock AZ|unlock AZ|export FILE",
     "the spherical grids; locked cells neither change nor fade; export to .csv or .mcap", "grid_lock",
     "azimuth_deg locked", NULL, 1, 2, command_grid, false},
    {"status", "", NULL, "status", "", NULL, 0, 0, command_method, false},
    {"sensors", "", NULL, "sensors", "", NULL, 0, 0, command_method, false},
    {"stats", "", NULL, "stats", "", stats_options, 0, 0, command_stats, false},
    {"top", "", "sectors, sonars, rates and warnings on the whole terminal, live", "sectors", "", top_options, 0,
     0, command_top, true},
    {"watch", "METHOD [KEY=VALUE...]", NULL, "watch", "method params rate_hz", watch_options, 1,
     ARGUMENTS_WORDS_MAX, command_watch, false},
    {"pose", "", "tell the daemon where the vehicle is", "pose", "", pose_options, 0, 0, command_pose, false},
    {"plot", "-o FILE", "draw echoes and sectors as SVG", "image", "", plot_options, 0, 0, command_plot, true},
    {"background", "show|learn|stop|save|load|forget", "the vehicle's own echoes: learn, save or load a template",
     "background learn:background_learn", "motion picture", background_options, 1, 1, command_background, false},
    {"point", "N,E,D", "is this place free? Exit status: 0 free, 1 occupied, 2 unknown", "point", "position_m",
     NULL, 1, 1, command_place, false},
    {"box", "N,E,D N,E,D", "is all of the box between two places free? Exit status as of point", "box",
     "from_m to_m", NULL, 2, 2, command_place, false},
    {"path", "N,E,D... --radius M", "may a body pass along these places? Exit status as of point", "path",
     "points_m", NULL, 1, ARGUMENTS_WORDS_MAX, command_place, false},
    {"map", "status|draw|new|forget|save NAME|load NAME|export NAME", "the voxel map",
     "export:map_export draw:map_slice", "name cells", map_options, 1, 2, command_map, false},
    {"plan", "", NULL, "plan", "", NULL, 0, 0, command_method, false},
    {"record", "start|stop", "begin or end a recording into the folder of [record]", "start:record_start", "",
     NULL, 1, 1, command_record, false},
    {"reload", "", NULL, "reload", "", NULL, 0, 0, command_method, false},
    {"replay", "", NULL, "replay", "", NULL, 0, 0, command_method, false},
    {"version", "", "versions of sonarctl and the daemon", "version", "", NULL, 0, 0, command_version, false},
    {"call", "METHOD [JSON]", "call any method of sonard-protocol(7) with a JSON object of parameters", "", "",
     NULL, 1, 2, command_call_any, false},
    {"setup", "", "find the sonar, ask where it sits, write a configuration; needs no daemon", "", "",
     setup_options, 0, 0, command_setup, false},
    {"complete", "-- WORD...", NULL, "", "", NULL, 0, ARGUMENTS_WORDS_MAX, command_complete, false},
    {0},
};
