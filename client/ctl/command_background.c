/* SPDX-License-Identifier: MIT */
/* command_background - the command `background`; see command.h. */
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "command.h"
#include "show_background.h"

#define PROGRESS_EVERY_S 0.5

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
        result = command_call(context, "background", params, status);
    }
    if (shows)
        fputc('\n', stderr);
    json_decref(params);
    return result;
}

static int print_background(const struct context *context, json_t *result, const char *svg)
{
    if (svg)
        return command_write_plot(svg, result, NULL, 0, NULL);
    if (context->json) {
        command_print(context, "background", result);
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

int command_background(struct context *context)
{
    static const struct {
        const char *word, *method;
    } actions[] = {{"show", "background"},        {"learn", "background_learn"}, {"stop", "background_stop"},
                   {"save", "background_save"},   {"load", "background_load"},   {"forget", "background_forget"},
                   {"clear", "background_forget"} /* what it was called once */};
    json_t *options = context->arguments.options, *result;
    json_t *svg, *sensor;
    const bool no_wait = json_object_get(options, "no_wait") != NULL;
    const char *word = context->arguments.word[0], *method = NULL;
    int status = EXIT_CLEAR;

    for (size_t i = 0; i < sizeof actions / sizeof *actions; i++)
        if (strcmp(actions[i].word, word) == 0)
            method = actions[i].method;
    if (!method)
        return command_usage("background", "expected one of show, learn, stop, save, load, forget");
    if (command_refuses_picture(context, json_string_value(json_object_get(options, "svg"))))
        return EXIT_USAGE;
    svg = json_incref(json_object_get(options, "svg"));
    sensor = json_incref(json_object_get(options, "sensor"));
    json_object_del(options, "svg");
    json_object_del(options, "no_wait");
    name_choice(options, "standing", "motion", "any");
    name_choice(options, "use", "use", "yes");
    if (strcmp(word, "show") == 0)
        json_object_set_new(options, "picture", json_string("yes"));
    result = command_call(context, method, options, &status);
    if (strcmp(word, "learn") == 0 && !no_wait)
        result = wait_learnt(context, result, sensor, &status);
    if (result)
        status = print_background(context, result, json_string_value(svg));
    json_decref(result);
    json_decref(svg);
    json_decref(sensor);
    return status;
}
