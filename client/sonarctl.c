/* SPDX-License-Identifier: MIT */
/*
 * sonarctl - ask a running sonard, or work on its captures. One function per command; the tables below are the
 * command line and its help.
 */
#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "arguments.h"
#include "show_background.h"
#include "show_map.h"
#include "capture.h"
#include "plot.h"
#include "show.h"
#include "sonard_client.h"

#define DEFAULT_TIMEOUT_S 5.0

enum exit_status {
    EXIT_CLEAR = 0, /* and of everything else that went well */
    EXIT_BLOCKED = 1,
    EXIT_UNKNOWN = 2,
    EXIT_USAGE = 3,
    EXIT_NO_DAEMON = 4,
    EXIT_SILENT = 5,
    EXIT_REFUSED = 6,
    EXIT_OUTPUT = 7, /* the result could not be written */
};

/* What a command runs with. */
struct context {
    const struct command *command;
    struct arguments arguments;
    struct sonard_client *client; /* NULL until the first call */
    char socket[128];
    double timeout_s;
    bool json, colour;
};

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

static int fail(const struct sonard_error *error)
{
    static const int status[] = {[SONARD_NO_DAEMON] = EXIT_NO_DAEMON,
                                 [SONARD_NO_PERMISSION] = EXIT_NO_DAEMON,
                                 [SONARD_SILENT] = EXIT_SILENT,
                                 [SONARD_LOST] = EXIT_SILENT,
                                 [SONARD_REFUSED] = EXIT_REFUSED};

    fprintf(stderr, "sonarctl: ");
    for (const char *c = error->message; *c; c++)
        fputc((unsigned char)*c < 0x20 || *c == 0x7f ? '?' : *c, stderr);
    fputc('\n', stderr);
    return status[error->status];
}

static int usage(const char *command, const char *message)
{
    fprintf(stderr, "sonarctl: %s; see `sonarctl %s%s`\n", message, command ? command : "help",
            command ? " --help" : "");
    return EXIT_USAGE;
}

static void print_result(const struct context *context, const char *method, const json_t *result)
{
    if (context->json) {
        json_dumpf(result, stdout, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(13));
        putchar('\n');
    } else {
        show_result(stdout, method, result, context->colour);
    }
}

/* Connects at the first call: faults of usage are told without a daemon. NULL: *status is what to exit with. */
static json_t *call(struct context *context, const char *method, json_t *params, int *status)
{
    struct sonard_error error;
    json_t *result = NULL;

    if (!context->client)
        context->client = sonard_connect(context->socket, context->timeout_s, &error);
    if (context->client)
        result = sonard_call(context->client, method, params, &error);
    *status = result ? EXIT_CLEAR : fail(&error);
    return result;
}

static int call_and_print(struct context *context, const char *method, json_t *params)
{
    int status;
    json_t *result = call(context, method, params, &status);

    if (result)
        print_result(context, method, result);
    json_decref(result);
    return status;
}

static int run_method(struct context *context)
{
    return call_and_print(context, context->command->name, context->arguments.options);
}

static int run_blocked(struct context *context)
{
    json_t *params = context->arguments.options;
    double azimuth_deg;
    const char *state;
    json_t *result;
    int status;

    if (!arguments_number(context->arguments.word[0], -DBL_MAX, DBL_MAX, &azimuth_deg))
        return usage("blocked", "AZ must be a number of degrees");
    if (!json_object_get(params, "distance_m"))
        return usage("blocked", "--distance D is missing");
    json_object_set_new(params, "azimuth_deg", json_real(azimuth_deg));
    result = call(context, "blocked", params, &status);
    if (!result)
        return status;
    print_result(context, "blocked", result);
    state = json_string_value(json_object_get(result, "state"));
    status = state && strcmp(state, "clear") == 0     ? EXIT_CLEAR
             : state && strcmp(state, "blocked") == 0 ? EXIT_BLOCKED
                                                      : EXIT_UNKNOWN;
    json_decref(result);
    return status;
}

static int run_version(struct context *context)
{
    if (!context->json)
        printf("sonarctl %s\n", SONARD_VERSION);
    return run_method(context);
}

static int run_call(struct context *context)
{
    json_error_t where;
    json_t *params = NULL;
    int status;

    if (context->arguments.n_words > 1) {
        params = json_loads(context->arguments.word[1], JSON_REJECT_DUPLICATES, &where);
        if (!json_is_object(params)) {
            json_decref(params);
            return usage("call", "the parameters must be a JSON object");
        }
    }
    status = call_and_print(context, context->arguments.word[0], params);
    json_decref(params);
    return status;
}

/* key=value words as an object: the value as JSON where it is some, else as text. */
static json_t *parse_pairs(const struct arguments *arguments, int first)
{
    json_t *params = json_object();

    for (int i = first; i < arguments->n_words; i++) {
        const char *word = arguments->word[i], *equals = strchr(word, '=');
        json_t *value;

        if (!equals || equals == word) {
            json_decref(params);
            return NULL;
        }
        value = json_loads(equals + 1, JSON_DECODE_ANY | JSON_REJECT_DUPLICATES, NULL);
        json_object_setn_new(params, word, (size_t)(equals - word), value ? value : json_string(equals + 1));
    }
    return params;
}

static int print_notification(const struct context *context, const char *method, const json_t *notification)
{
    const json_t *result = json_object_get(notification, "result");
    const json_t *refusal = json_object_get(notification, "error");
    const json_int_t skipped = json_integer_value(json_object_get(notification, "skipped"));
    struct sonard_error error = {.status = SONARD_REFUSED};

    if (skipped > 0)
        fprintf(stderr, "sonarctl: %lld skipped, this one is the newest\n", (long long)skipped);
    if (result) {
        print_result(context, method, result);
        return fflush(stdout) == 0 ? EXIT_CLEAR : EXIT_OUTPUT;
    }
    snprintf(error.message, sizeof error.message, "%s: %s", method,
             json_is_object(refusal) ? json_string_value(json_object_get(refusal, "message")) : "no result");
    return fail(&error);
}

static int run_watch(struct context *context)
{
    const char *method = context->arguments.word[0];
    const json_t *options = context->arguments.options, *rate = json_object_get(options, "rate_hz");
    const double rate_hz = rate ? json_number_value(rate) : 1.0;
    json_int_t left = json_integer_value(json_object_get(options, "count"));
    const bool endless = !json_object_get(options, "count");
    json_t *params = parse_pairs(&context->arguments, 1), *request, *reply;
    int status;

    if (!params)
        return usage("watch", "parameters are key=value");
    request = json_pack("{s:s, s:o, s:f}", "method", method, "params", params, "rate_hz", rate_hz);
    reply = call(context, "watch", request, &status);
    json_decref(request);
    json_decref(reply);
    while (status == EXIT_CLEAR && (endless || left-- > 0)) {
        struct sonard_error error;
        json_t *notification = sonard_next(context->client, context->timeout_s + 1.0 / rate_hz, &error);

        status = notification ? print_notification(context, method, notification) : fail(&error);
        json_decref(notification);
    }
    return status;
}

static int run_pose(struct context *context)
{
    if (json_object_size(context->arguments.options) == 0)
        return usage("pose", "give at least one part of the pose");
    return run_method(context);
}

/* sectors NULL: `image` is a background template. */
static int write_plot(const char *path, json_t *image, json_t *sectors)
{
    const struct plot_conf conf = {0};
    const bool to_stdout = strcmp(path, "-") == 0;
    FILE *out = to_stdout ? stdout : fopen(path, "w");
    bool ok = out && (sectors ? plot_svg(out, image, sectors, &conf) : show_background_svg(out, image));

    if (out && (to_stdout ? fflush(out) : fclose(out)) != 0)
        ok = false;
    if (!ok)
        fprintf(stderr, "sonarctl: %s: %s\n", path, strerror(errno));
    return ok ? EXIT_CLEAR : EXIT_OUTPUT;
}

static int run_plot(struct context *context)
{
    json_t *options = context->arguments.options, *image, *sectors = NULL;
    json_t *output = json_incref(json_object_get(options, "output"));
    int status;

    if (!output)
        return usage("plot", "-o FILE is missing");
    json_object_del(options, "output");
    image = call(context, "image", options, &status);
    if (image)
        sectors = call(context, "sectors", NULL, &status);
    if (sectors) {
        if (json_array_size(json_object_get(image, "rows")) == 0)
            fprintf(stderr, "sonarctl: no data from the sonar yet: the picture is empty\n");
        status = write_plot(json_string_value(output), image, sectors);
    }
    json_decref(output);
    json_decref(image);
    json_decref(sectors);
    return status;
}

/* ---- background ---- */

#define PROGRESS_EVERY_S 0.5
#define DRAW_CELLS       40 /* across a terminal, two characters each */

/* Until learning is over, however long that takes; who does not want to wait may interrupt: the daemon goes on. */
static json_t *wait_learnt(struct context *context, json_t *result, const json_t *sensor, int *status)
{
    const bool shows = isatty(STDERR_FILENO);
    json_t *params = json_object();

    if (sensor)
        json_object_set(params, "sensor", (json_t *)sensor);
    while (result && json_is_object(json_object_get(result, "learning"))) {
        if (shows) {
            fputs("\r\033[K", stderr);
            show_background_progress(stderr, result);
        }
        nanosleep(&(struct timespec){.tv_nsec = (long)(PROGRESS_EVERY_S * 1e9)}, NULL);
        json_decref(result);
        result = call(context, "background", params, status);
    }
    if (shows)
        fputc('\n', stderr);
    json_decref(params);
    return result;
}

static int print_background(const struct context *context, json_t *result, const char *svg)
{
    if (svg)
        return write_plot(svg, result, NULL);
    if (context->json) {
        print_result(context, "background", result);
    } else {
        show_background_state(stdout, result);
        if (json_object_get(result, "rows"))
            show_background_draw(stdout, result);
    }
    return EXIT_CLEAR;
}

/* Flags of the command line as the words of the protocol. */
static void name_choice(json_t *options, const char *flag, const char *key, const char *word)
{
    if (!json_object_get(options, flag))
        return;
    json_object_del(options, flag);
    json_object_set_new(options, key, json_string(word));
}

static int run_background(struct context *context)
{
    static const struct {
        const char *word, *method;
    } actions[] = {{"show", "background"},      {"learn", "background_learn"}, {"stop", "background_stop"},
                   {"save", "background_save"}, {"load", "background_load"},   {"clear", "background_clear"}};
    json_t *options = context->arguments.options, *result;
    json_t *svg = json_incref(json_object_get(options, "svg"));
    json_t *sensor = json_incref(json_object_get(options, "sensor"));
    const bool no_wait = json_object_get(options, "no_wait") != NULL;
    const char *word = context->arguments.word[0], *method = NULL;
    int status = EXIT_CLEAR;

    for (size_t i = 0; i < sizeof actions / sizeof *actions; i++)
        if (strcmp(actions[i].word, word) == 0)
            method = actions[i].method;
    if (!method)
        return usage("background", "want one of show, learn, stop, save, load, clear");
    json_object_del(options, "svg");
    json_object_del(options, "no_wait");
    name_choice(options, "standing", "motion", "any");
    name_choice(options, "use", "use", "yes");
    if (strcmp(word, "show") == 0)
        json_object_set_new(options, "picture", json_string("yes"));
    result = call(context, method, options, &status);
    if (strcmp(word, "learn") == 0 && !no_wait)
        result = wait_learnt(context, result, sensor, &status);
    if (result)
        status = print_background(context, result, json_string_value(svg));
    json_decref(result);
    json_decref(svg);
    json_decref(sensor);
    return status;
}

/* ---- places ---- */

/* "N,E,D" */
static json_t *parse_place(const char *word)
{
    double v[3];
    int used = 0;

    if (sscanf(word, "%lf,%lf,%lf%n", &v[0], &v[1], &v[2], &used) != 3 || word[used] != '\0')
        return NULL;
    return json_pack("[f, f, f]", v[0], v[1], v[2]);
}

/* The words of `point`, `box` and `path` become the parameters of the method of that name. */
static bool take_places(const struct arguments *arguments, const char *method, json_t *params)
{
    json_t *places = json_array();
    bool ok = true;

    for (int i = 0; i < arguments->n_words; i++)
        ok = json_array_append_new(places, parse_place(arguments->word[i])) == 0 && ok;
    if (ok && strcmp(method, "path") == 0) {
        json_object_set(params, "points_m", places);
    } else if (ok && strcmp(method, "box") == 0) {
        json_object_set(params, "from_m", json_array_get(places, 0));
        json_object_set(params, "to_m", json_array_get(places, 1));
    } else if (ok) {
        json_object_set(params, "position_m", json_array_get(places, 0));
    }
    json_decref(places);
    return ok;
}

static int run_place(struct context *context)
{
    const char *method = context->command->name, *state;
    json_t *result;
    int status;

    if (!take_places(&context->arguments, method, context->arguments.options))
        return usage(method, "a place is three numbers: N,E,D, in metres");
    if (strcmp(method, "path") == 0 && !json_object_get(context->arguments.options, "radius_m"))
        return usage(method, "--radius R is missing");
    if (!(result = call(context, method, context->arguments.options, &status)))
        return status;
    if (context->json)
        print_result(context, method, result);
    else
        show_map_place(stdout, result, context->colour);
    state = json_string_value(json_object_get(result, "state"));
    status = state && strcmp(state, "free") == 0       ? EXIT_CLEAR
             : state && strcmp(state, "occupied") == 0 ? EXIT_BLOCKED
                                                       : EXIT_UNKNOWN;
    json_decref(result);
    return status;
}

static int print_slice(const struct context *context, const json_t *result, const char *path)
{
    const bool to_stdout = path && strcmp(path, "-") == 0;
    FILE *out = !path || to_stdout ? stdout : fopen(path, "w");
    bool ok = out != NULL;

    if (context->json)
        print_result(context, "map_slice", result);
    else if (ok && path)
        ok = show_map_svg(out, result);
    else if (ok)
        show_map_draw(out, result);
    if (out && out != stdout && fclose(out) != 0)
        ok = false;
    if (!ok)
        fprintf(stderr, "sonarctl: %s: %s\n", path, strerror(errno));
    return ok ? EXIT_CLEAR : EXIT_OUTPUT;
}

/* Until the file is written or read, however long the disk takes. A job that failed is a refusal. */
static json_t *wait_job(struct context *context, json_t *result, int *status)
{
    struct sonard_error error = {.status = SONARD_REFUSED};
    const json_t *job;
    const char *state = NULL;

    while (result) {
        job = json_object_get(result, "job");
        state = json_string_value(json_object_get(job, "state"));
        if (!state || strcmp(state, "running") != 0)
            break;
        nanosleep(&(struct timespec){.tv_nsec = (long)(PROGRESS_EVERY_S * 1e8)}, NULL);
        json_decref(result);
        result = call(context, "map", NULL, status);
    }
    if (result && state && strcmp(state, "failed") == 0) {
        snprintf(error.message, sizeof error.message, "%s", json_string_value(json_object_get(job, "message")));
        *status = fail(&error);
    }
    return result;
}

static int run_map(struct context *context)
{
    static const struct {
        const char *word, *method;
        int words; /* with this one */
    } actions[] = {{"status", "map", 1},       {"draw", "map_slice", 1}, {"new", "map_new", 1},
                   {"clear", "map_clear", 1},  {"save", "map_save", 2},  {"load", "map_load", 2},
                   {"export", "map_export", 2}};
    const struct arguments *arguments = &context->arguments;
    const char *word = arguments->word[0], *method = NULL;
    json_t *options = arguments->options, *output = json_incref(json_object_get(options, "output")), *result;
    int status = EXIT_CLEAR;

    for (size_t i = 0; i < sizeof actions / sizeof *actions; i++)
        if (strcmp(actions[i].word, word) == 0 && actions[i].words == arguments->n_words)
            method = actions[i].method;
    if (!method) {
        json_decref(output);
        return usage("map", "want one of status, draw, new, clear, save NAME, load NAME, export NAME");
    }
    json_object_del(options, "output");
    if (strcmp(word, "draw") == 0 && !output && !json_object_get(options, "cells"))
        json_object_set_new(options, "cells", json_integer(DRAW_CELLS));
    if (arguments->n_words == 2)
        json_object_set_new(options, "name", json_string(arguments->word[1]));
    result = call(context, method, options, &status);
    if (arguments->n_words == 2)
        result = wait_job(context, result, &status);
    if (result && strcmp(word, "draw") == 0)
        status = print_slice(context, result, json_string_value(output));
    else if (result && context->json)
        print_result(context, method, result);
    else if (result && status == EXIT_CLEAR)
        show_map_state(stdout, result);
    json_decref(result);
    json_decref(output);
    return status;
}

/* ---- the tables ---- */

#define FRAME_OPTION                                                                                              \
    {                                                                                                             \
        "--frame", "frame", "body|ned", "azimuth 0 is forward (body) or north (ned)", ARGUMENT_TEXT, 0, 0, 0      \
    }

static const struct argument blocked_options[] = {
    {"--distance", "distance_m", "D", "metres to look ahead; must be given", ARGUMENT_NUMBER, 0, 0, 0},
    {"--elevation", "elevation_deg", "E", "degrees upward (0)", ARGUMENT_NUMBER, 0, 0, 0},
    {"--half-angle", "half_angle_deg", "A", "look in a cone that opens so many degrees to each side",
     ARGUMENT_NUMBER, 0, 0, 0},
    {"--radius", "radius_m", "R", "look in a corridor of this radius in metres instead", ARGUMENT_NUMBER, 0, 0, 0},
    FRAME_OPTION,
    {0},
};

static const struct argument sectors_options[] = {
    {"--count", "count", "N", "number of sectors around (72)", ARGUMENT_INTEGER, 0, 0, 0},
    {"--elevation", "elevation_deg", "LO,HI", "band of elevations in degrees", ARGUMENT_NUMBERS, 2, 0, 0},
    {"--distance", "distance_m", "D", "metres to look ahead; else as far as the grid reaches", ARGUMENT_NUMBER, 0,
     0, 0},
    FRAME_OPTION,
    {0},
};

static const struct argument nearest_options[] = {
    {"--elevation", "elevation_deg", "LO,HI", "band of elevations in degrees (-90,90)", ARGUMENT_NUMBERS, 2, 0, 0},
    {"--distance", "distance_m", "D", "what is farther away in metres does not count", ARGUMENT_NUMBER, 0, 0, 0},
    FRAME_OPTION,
    {0},
};

static const struct argument limit_options[] = {
    {"--velocity", "velocity_mps", "X,Y,Z", "asked for, in m/s: forward, right, down, or north, east, down",
     ARGUMENT_NUMBERS, 3, 0, 0},
    FRAME_OPTION,
    {0},
};

static const struct argument collision_options[] = {
    {"--velocity", "velocity_mps", "X,Y,Z", "in m/s: forward, right, down, or north, east, down (the pose's)",
     ARGUMENT_NUMBERS, 3, 0, 0},
    {"--ahead", "ahead_s", "S", "seconds to look ahead (60)", ARGUMENT_NUMBER, 0, 0, 0},
    FRAME_OPTION,
    {0},
};

static const struct argument clusters_options[] = {
    {"--count", "count", "N", "at most so many, the nearest (64)", ARGUMENT_INTEGER, 0, 1, 256},
    {0},
};

static const struct argument next_look_options[] = {
    {"--count", "count", "N", "so many directions (8)", ARGUMENT_INTEGER, 0, 1, 64},
    {"--elevation", "elevation_deg", "LO,HI", "band of elevations in degrees (-5,5)", ARGUMENT_NUMBERS, 2, 0, 0},
    {"--apart", "apart_deg", "A", "at least so many degrees apart (10)", ARGUMENT_NUMBER, 0, 0, 180},
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
     run_blocked},
    {"sectors", "", "state, range and age all around", sectors_options, 0, 0, run_method},
    {"nearest", "", "the nearest obstacle, and how much nearer than it is unknown", nearest_options, 0, 0, run_method},
    {"limit", "", "how fast may the vehicle go, to stop in water known to be free?", limit_options, 0, 0, run_method},
    {"time_to_collision", "", "when does the vehicle meet something?", collision_options, 0, 0, run_method},
    {"clusters", "", "what the obstacles form together", clusters_options, 0, 0, run_method},
    {"next_look", "", "which directions to look at next, and why", next_look_options, 0, 0, run_method},
    {"status", "", "what the daemon and its sonars do", NULL, 0, 0, run_method},
    {"watch", "METHOD [KEY=VALUE...]", "ask a method again and again", watch_options, 1, ARGUMENTS_WORDS_MAX,
     run_watch},
    {"pose", "", "tell the daemon where the vehicle is", pose_options, 0, 0, run_pose},
    {"plot", "", "draw echoes and sectors as SVG", plot_options, 0, 0, run_plot},
    {"background", "show|learn|stop|save|load|clear", "what a sonar hears of the vehicle itself",
     background_options, 1, 1, run_background},
    {"point", "N,E,D", "is this place free? Exit status: 0 free, 1 occupied, 2 unknown", point_options, 1, 1,
     run_place},
    {"box", "N,E,D N,E,D", "is all of the box between two places free?", NULL, 2, 2, run_place},
    {"path", "N,E,D...", "may a body pass along these places?", path_options, 1, ARGUMENTS_WORDS_MAX, run_place},
    {"map", "status|draw|new|clear|save NAME|load NAME|export NAME", "the map of places", map_options, 1, 2,
     run_map},
    {"version", "", "versions of sonarctl and the daemon", NULL, 0, 0, run_version},
    {"call", "METHOD [JSON]", "call any method with a JSON object of parameters", NULL, 1, 2, run_call},
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
    struct context context = {.command = command};
    struct arguments *arguments = &context.arguments;
    char err[256];
    int status;

    if (!arguments_parse(arguments, argc, argv, at, common_options, command->options, err, sizeof err)) {
        status = usage(command->name, err);
    } else if (json_object_get(arguments->options, "help")) {
        status = print_help(command);
    } else if (arguments->n_words < command->min_words || arguments->n_words > command->max_words) {
        snprintf(err, sizeof err, "want: sonarctl %s%s%s", command->name, command->words[0] ? " " : "",
                 command->words);
        status = usage(command->name, err);
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
    return usage(NULL, message);
}
