/* SPDX-License-Identifier: MIT */
/* command_ask - the commands that ask the daemon one thing, once or again and again; see command.h. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "command.h"
#include "core/fault.h"
#include "page.h"
#include "show_stats.h"
#include "client/lib/sonard_json.h"

int command_method(struct context *context)
{
    return command_call_and_print(context, context->command, context->arguments.options);
}

/* The first word and --distance, as `blocked` and `explain` want them. */
static bool take_direction(struct context *context)
{
    json_t *params = context->arguments.options;
    double azimuth_deg;
    if (!command_azimuth(context, 0, &azimuth_deg))
        return false;
    if (!json_object_get(params, "distance_m")) {
        command_usage(context->command, "--distance D is missing");
        return false;
    }
    json_object_set_new(params, "azimuth_deg", json_real(azimuth_deg));
    return true;
}

int command_blocked(struct context *context)
{
    const char *state;
    json_t *result;
    int status;
    if (!take_direction(context))
        return EXIT_USAGE;
    result = command_call(context, "blocked", context->arguments.options, &status);
    if (!result)
        return status;
    command_print(context, "blocked", result);
    state = json_string_value(json_object_get(result, "state"));
    status = state && strcmp(state, "clear") == 0     ? EXIT_CLEAR
             : state && strcmp(state, "blocked") == 0 ? EXIT_BLOCKED
                                                      : EXIT_UNKNOWN;
    json_decref(result);
    return status;
}

#define BEGIN_TRIES    20
#define BEGIN_EVERY_NS 100000000

/* The daemon's disk has its own pace: asked again until a file is there, or the disk has refused one. */
static json_t *wait_begun(struct context *context, json_t *result, int *status)
{
    const json_int_t before = json_integer_value(json_object_get(result, "errors"));
    for (int i = 0; result && i < BEGIN_TRIES && !json_is_true(json_object_get(result, "recording")) &&
                    json_integer_value(json_object_get(result, "errors")) == before;
         i++) {
        nanosleep(&(struct timespec){.tv_nsec = BEGIN_EVERY_NS}, NULL);
        json_decref(result);
        result = command_call(context, "record_start", context->arguments.options, status);
    }
    return result;
}

/* The recording that goes on, of the daemon's status; NULL: none, or *status says why nobody knows. */
static json_t *recording_now(struct context *context, int *status)
{
    json_t *all = command_call(context, "status", NULL, status), *record = json_object_get(all, "record");
    record = json_is_true(json_object_get(record, "recording")) ? json_incref(record) : NULL;
    json_decref(all);
    return record;
}

static void tell_already(const json_t *record)
{
    char since[PAGE_CELL], path[PAGE_CELL];
    const double age_s = json_number_value(json_object_get(record, "recording_age_s"));
    printf("already recording to %s, since %s\n", page_text(path, record, "path"),
           page_utc(since, (double)time(NULL) - age_s));
}

int command_record(struct context *context)
{
    const char *word = context->arguments.word[0];
    const bool start = strcmp(word, "start") == 0;
    const char *method = start ? "record_start" : "record_stop";
    int status;
    if (!start && strcmp(word, "stop") != 0)
        return command_usage("record", "expected start or stop");
    json_t *result = start ? recording_now(context, &status) : NULL;
    if (start && !result && status != EXIT_CLEAR)
        return status;
    if (result && !context->json) {
        tell_already(result);
        json_decref(result);
        return EXIT_CLEAR;
    }
    json_decref(result);
    result = command_call(context, method, context->arguments.options, &status);
    if (start)
        result = wait_begun(context, result, &status);
    if (!result)
        return status;
    command_print(context, method, result);
    status = start && !json_is_true(json_object_get(result, "recording")) ? EXIT_OUTPUT : EXIT_CLEAR;
    json_decref(result);
    return status;
}

int command_explain(struct context *context)
{
    return take_direction(context) ? command_method(context) : EXIT_USAGE;
}

int command_limit(struct context *context)
{
    if (!json_object_get(context->arguments.options, "velocity_mps"))
        return command_usage("limit", "--velocity X,Y,Z is missing");
    return command_method(context);
}

int command_version(struct context *context)
{
    if (!context->json)
        printf("sonarctl %s\n", SONARD_VERSION);
    return command_method(context);
}

int command_call_any(struct context *context)
{
    json_error_t where;
    json_t *params = NULL;
    struct fault fault;
    int status;
    if (context->arguments.n_words > 1) {
        params = json_loads(context->arguments.word[1], JSON_REJECT_DUPLICATES, &where);
        if (!json_is_object(params)) {
            fault_set(&fault, "the parameters must be a JSON object%s%s", params ? "" : ": ",
                      params ? "" : where.text);
            json_decref(params);
            return command_usage("call", fault.text);
        }
    }
    status = command_call_and_print(context, context->arguments.word[0], params);
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

/* The result is used up. */
static int print_notification(const struct context *context, const char *method,
                              const struct sonard_message *notification, json_t *result)
{
    struct sonard_error error = notification->refusal;
    if (notification->skipped > 0)
        fprintf(stderr, "sonarctl: %lld skipped, this one is the newest\n", (long long)notification->skipped);
    if (result) {
        command_print(context, method, result);
        json_decref(result);
        return fflush(stdout) == 0 ? EXIT_CLEAR : EXIT_OUTPUT;
    }
    snprintf(error.message, sizeof error.message, "%.100s: %.660s", method, notification->refusal.message);
    return command_fail(&error);
}

int command_watch(struct context *context)
{
    const char *method = context->arguments.word[0];
    const json_t *options = context->arguments.options, *rate = json_object_get(options, "rate_hz");
    const double rate_hz = rate ? json_number_value(rate) : 1.0;
    json_int_t left = json_integer_value(json_object_get(options, "count"));
    const bool endless = !json_object_get(options, "count");
    json_t *params = parse_pairs(&context->arguments, 1), *request, *reply;
    int status;
    if (!params)
        return command_usage("watch", "parameters are key=value");
    request = json_pack("{s:s, s:o, s:f}", "method", method, "params", params, "rate_hz", rate_hz);
    reply = command_call(context, "watch", request, &status);
    json_decref(request);
    json_decref(reply);
    while (status == EXIT_CLEAR && (endless || left-- > 0)) {
        const double patience_s = context->timeout_s + 1.0 / rate_hz;
        struct sonard_message notification;
        struct sonard_error error;
        json_t *result;
        status = sonard_json_next(context->client, patience_s, &notification, &result, &error)
                     ? print_notification(context, method, &notification, result)
                     : command_fail(&error);
    }
    return status;
}

static void wait_s(double s)
{
    struct timespec t = {.tv_sec = (time_t)s, .tv_nsec = (long)((s - floor(s)) * 1e9)};
    nanosleep(&t, NULL);
}

/* Sends the same pose until somebody ends the program; only the first answer is printed. */
static int keep_sending(struct context *context, json_t *params, double rate_hz)
{
    int status = command_call_and_print(context, "pose", params);
    if (status == EXIT_CLEAR)
        fprintf(stderr, "sonarctl: sending this pose %g times a second; Ctrl-C ends it\n", rate_hz);
    while (status == EXIT_CLEAR && fflush(stdout) == 0) {
        json_t *result;
        wait_s(1 / rate_hz);
        result = command_call(context, "pose", params, &status);
        json_decref(result);
    }
    return status;
}

int command_pose(struct context *context)
{
    json_t *options = context->arguments.options;
    const json_t *rate = json_object_get(options, "rate_hz");
    const double rate_hz = rate ? json_number_value(rate) : 0;
    const bool withdraw = json_object_get(options, "withdraw") != NULL;
    json_object_del(options, "rate_hz");
    json_object_del(options, "withdraw");
    if (withdraw && (rate_hz > 0 || json_object_size(options) > 0))
        return command_usage("pose", "--withdraw stands alone");
    if (withdraw)
        return command_call_and_print(context, "pose_withdraw", NULL);
    if (json_object_size(options) == 0)
        return command_usage("pose", "give at least one part of the pose, for instance --attitude 0,0,90");
    if (rate_hz > 0 && json_object_get(options, "t_unix"))
        return command_usage("pose", "--time and --rate exclude each other: every pose would have the same time");
    return rate_hz > 0 ? keep_sending(context, options, rate_hz) : command_method(context);
}

/* With north, where the daemon has an attitude. */
static int write_plot(struct context *context, const char *path, json_t *image, json_t *sectors, double range_m)
{
    int status;
    json_t *result = command_call(context, "status", NULL, &status);
    const json_t *heading = json_array_get(json_object_get(json_object_get(result, "pose"), "attitude_deg"), 2);
    const double heading_deg = json_number_value(heading);
    if (result)
        status = command_write_plot(path, image, sectors, range_m, json_is_number(heading) ? &heading_deg : NULL);
    json_decref(result);
    return status;
}

int command_plot(struct context *context)
{
    json_t *options = context->arguments.options, *image, *sectors = NULL;
    json_t *output = json_incref(json_object_get(options, "output"));
    double range_m;
    int status;
    if (!output)
        return command_usage("plot", "-o FILE is missing");
    if (command_refuses_picture(context, json_string_value(output))) {
        json_decref(output);
        return EXIT_USAGE;
    }
    range_m = json_number_value(json_object_get(options, "range_m"));
    json_object_del(options, "output");
    json_object_del(options, "range_m");
    image = command_call(context, "image", options, &status);
    if (image)
        sectors = command_call(context, "sectors", NULL, &status);
    if (sectors) {
        if (json_array_size(json_object_get(image, "rows")) == 0)
            fprintf(stderr, "sonarctl: no data from the sonar yet: the picture is empty\n");
        status = write_plot(context, json_string_value(output), image, sectors, range_m);
    }
    json_decref(output);
    json_decref(image);
    json_decref(sectors);
    return status;
}

int command_stats(struct context *context)
{
    const bool prometheus = json_object_get(context->arguments.options, "prometheus") != NULL;
    int status;
    json_t *result = command_call(context, "stats", NULL, &status);
    if (result && context->json)
        command_print(context, "stats", result);
    else if (result && prometheus)
        show_stats_prometheus(stdout, result);
    else if (result)
        show_stats(stdout, result);
    json_decref(result);
    return status;
}
