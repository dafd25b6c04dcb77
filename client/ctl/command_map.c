/* SPDX-License-Identifier: MIT */
/* command_map - the commands about the voxel map; see command.h. */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "command.h"
#include "show_map.h"

#define JOB_EVERY_S 0.05 /* how often to ask whether a file is written */
#define DRAW_CELLS  40   /* across a terminal, two characters each */

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

int command_place(struct context *context)
{
    const char *method = context->command, *state;
    json_t *result;
    int status;
    if (!take_places(&context->arguments, method, context->arguments.options))
        return command_usage(method, "a place is three numbers: N,E,D, in metres");
    if (strcmp(method, "path") == 0 && !json_object_get(context->arguments.options, "radius_m"))
        return command_usage(method, "--radius R is missing");
    if (!(result = command_call(context, method, context->arguments.options, &status)))
        return status;
    if (context->json)
        command_print(context, method, result);
    else
        show_map_place(stdout, result, context->colour);
    state = json_string_value(json_object_get(result, "state"));
    status = state && strcmp(state, "free") == 0       ? EXIT_CLEAR
             : state && strcmp(state, "occupied") == 0 ? EXIT_BLOCKED
                                                       : EXIT_UNKNOWN;
    json_decref(result);
    return status;
}

/* Is there anything to see? */
static bool slice_is_blank(const json_t *result)
{
    const json_t *row;
    size_t i;
    json_array_foreach(json_object_get(result, "rows"), i,
                       row) if (strspn(json_string_value(row) ? json_string_value(row) : "", " ") !=
                                json_string_length(row)) return false;
    return true;
}

static int print_slice(const struct context *context, const json_t *result, const char *path)
{
    const bool to_stdout = path && strcmp(path, "-") == 0;
    FILE *out = !path || to_stdout ? stdout : fopen(path, "w");
    bool ok = out != NULL;
    if (!context->json && slice_is_blank(result))
        fprintf(stderr, "sonarctl: nothing is known of this water: the picture is empty\n");
    if (context->json)
        command_print(context, "map_slice", result);
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
        nanosleep(&(struct timespec){.tv_nsec = (long)(JOB_EVERY_S * 1e9)}, NULL);
        json_decref(result);
        result = command_call(context, "map", NULL, status);
    }
    if (result && state && strcmp(state, "failed") == 0) {
        snprintf(error.message, sizeof error.message, "%s", json_string_value(json_object_get(job, "message")));
        *status = command_fail(&error);
    }
    return result;
}

int command_map(struct context *context)
{
    static const struct {
        const char *word, *method;
        int words; /* with this one */
    } actions[] = {{"status", "map", 1},       {"draw", "map_slice", 1},
                   {"new", "map_new", 1},      {"forget", "map_forget", 1},
                   {"clear", "map_forget", 1}, /* what it was called once */ {"save", "map_save", 2},
                   {"load", "map_load", 2},    {"export", "map_export", 2}};
    const struct arguments *arguments = &context->arguments;
    const char *word = arguments->word[0], *method = NULL;
    json_t *options = arguments->options, *output = json_incref(json_object_get(options, "output")), *result;
    int status = EXIT_CLEAR;

    for (size_t i = 0; i < sizeof actions / sizeof *actions; i++)
        if (strcmp(actions[i].word, word) == 0 && actions[i].words == arguments->n_words)
            method = actions[i].method;
    if (!method) {
        json_decref(output);
        return command_usage("map",
                             "expected one of status, draw, new, forget, save NAME, load NAME, export NAME");
    }
    if (command_refuses_picture(context, json_string_value(output))) {
        json_decref(output);
        return EXIT_USAGE;
    }
    json_object_del(options, "output");
    if (strcmp(word, "draw") == 0 && !output && !json_object_get(options, "cells"))
        json_object_set_new(options, "cells", json_integer(DRAW_CELLS));
    if (arguments->n_words == 2)
        json_object_set_new(options, "name", json_string(arguments->word[1]));
    result = command_call(context, method, options, &status);
    if (arguments->n_words == 2)
        result = wait_job(context, result, &status);
    if (result && strcmp(word, "draw") == 0)
        status = print_slice(context, result, json_string_value(output));
    else if (result && context->json)
        command_print(context, method, result);
    else if (result && status == EXIT_CLEAR)
        show_map_state(stdout, result);
    json_decref(result);
    json_decref(output);
    return status;
}
