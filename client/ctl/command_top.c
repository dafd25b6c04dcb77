/* SPDX-License-Identifier: MIT */
/*
 * command_top - `sonarctl top`: watches sectors, status and stats and shows them on the whole terminal until q. What
 * the daemon has not said for a while is not shown any more.
 */
#include <errno.h>
#include <langinfo.h>
#include <locale.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "command.h"
#include "client/lib/sonard_json.h"
#include "terminal.h"
#include "top_view.h"

#define SECTORS_HZ 5.0
#define STATUS_HZ  1.0
#define RETRY_S    1.0
#define SILENCE_S  3.0 /* after which nothing is believed any more */
#define FRAME_S    0.1 /* at least, between two */

enum watched { SECTORS, STATUS, STATS, N_WATCHED };

struct top {
    struct context *context;
    json_t *sectors_params;
    struct sonard_error error; /* why there is no connection */
    double heard_s, retry_s;   /* when the daemon said something, when to try again */
    int64_t request[N_WATCHED], watch[N_WATCHED];
    json_t *result[N_WATCHED]; /* NULL: not known */
    struct top_rates rates;
    double range_m; /* 0: by the sonars */
    bool unicode;
    struct canvas canvas, shown;
};

static const char *const method_of[N_WATCHED] = {[SECTORS] = "sectors", [STATUS] = "status", [STATS] = "stats"};

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static void forget_results(struct top *top)
{
    for (int i = 0; i < N_WATCHED; i++) {
        json_decref(top->result[i]);
        top->result[i] = NULL;
        top->request[i] = top->watch[i] = 0;
    }
    top->rates = (struct top_rates){0};
}

static void lose_daemon(struct top *top)
{
    sonard_disconnect(top->context->client);
    top->context->client = NULL;
    top->retry_s = now_s() + RETRY_S;
    forget_results(top);
}

/* ---- what the daemon says ---- */

static bool ask_watch(struct top *top, enum watched which)
{
    json_t *params = which == SECTORS ? json_incref(top->sectors_params) : json_object();
    json_t *request = json_pack("{s:s, s:o, s:f}", "method", method_of[which], "params", params, "rate_hz",
                                which == SECTORS ? SECTORS_HZ : STATUS_HZ);
    top->request[which] = sonard_json_send(top->context->client, "watch", request, &top->error);
    json_decref(request);
    return top->request[which] != 0;
}

static void connect_again(struct top *top)
{
    top->context->client = sonard_connect(top->context->socket, 0, &top->error);
    top->heard_s = now_s();
    if (!top->context->client || !ask_watch(top, SECTORS) || !ask_watch(top, STATUS) || !ask_watch(top, STATS))
        lose_daemon(top);
}

/* What was said is used up. False: the daemon refuses a watch, as top->error says. */
static bool take_message(struct top *top, const struct sonard_message *message, json_t *said)
{
    bool good = true;
    for (int i = 0; i < N_WATCHED; i++) {
        if (message->watch > 0 && message->watch == top->watch[i]) {
            json_decref(top->result[i]);
            top->result[i] = json_incref(said); /* NULL when the method fails */
            if (i == STATUS && said)
                top_rates_take(&top->rates, said);
        } else if (message->watch == 0 && (message->id == top->request[i] || message->id == 0)) {
            top->watch[i] = json_integer_value(json_object_get(said, "watch"));
            good = good && said;
            if (!said)
                top->error = message->refusal;
        }
    }
    json_decref(said);
    return good;
}

static bool replay_is_over(const struct top *top)
{
    const char *mode = json_string_value(json_object_get(top->result[STATUS], "mode"));
    return mode && strcmp(mode, "replay, ended") == 0;
}

static void hear(struct top *top)
{
    struct sonard_message message;
    json_t *result;
    while (top->context->client && sonard_json_take(top->context->client, 0, &message, &result, &top->error)) {
        top->heard_s = now_s();
        if (!take_message(top, &message, result))
            lose_daemon(top);
    }
    if (!top->context->client)
        return;
    if (top->error.status == SONARD_SILENT && now_s() > top->heard_s + SILENCE_S && !replay_is_over(top))
        lose_daemon(top); /* its clock does not stand, so it hangs */
    else if (top->error.status != SONARD_SILENT)
        lose_daemon(top);
}

/* ---- what is shown ---- */

static void draw(struct top *top, bool help)
{
    const struct top_frame frame = {.sectors = top->result[SECTORS],
                                    .status = top->result[STATUS],
                                    .stats = top->result[STATS],
                                    .rates = &top->rates,
                                    .fault = top->result[STATUS] ? NULL : top->error.message,
                                    .range_m = top->range_m,
                                    .help = help};
    int columns, rows;
    terminal_size(&columns, &rows);
    canvas_clear(&top->canvas, columns, rows);
    top_view_draw(&top->canvas, &frame);
}

/* Only rows that changed: over a slow line a whole screen takes long. */
static void show(struct top *top)
{
    const bool whole = top->canvas.columns != top->shown.columns || top->canvas.rows != top->shown.rows;
    if (whole)
        printf("\033[2J");
    for (int row = 0; row < top->canvas.rows; row++) {
        if (!whole && canvas_row_equal(&top->canvas, &top->shown, row))
            continue;
        printf("\033[%d;1H", row + 1);
        canvas_print_row(stdout, &top->canvas, row, top->context->colour, top->unicode);
        printf("\033[K");
    }
    fflush(stdout);
    top->shown = top->canvas;
}

/* False: the person wants to end it. */
static bool obey(struct top *top)
{
    char keys[64];
    const ssize_t n = read(STDIN_FILENO, keys, sizeof keys);
    const struct top_frame frame = {.status = top->result[STATUS], .range_m = top->range_m};
    const double range_m = top_view_range(&frame);
    for (ssize_t i = 0; i < n; i++) {
        if (keys[i] == 'q' || keys[i] == 'Q')
            return false;
        if (keys[i] == '+')
            top->range_m = range_m > 0.5 ? range_m / 2 : range_m;
        else if (keys[i] == '-')
            top->range_m = range_m < 5000 ? range_m * 2 : range_m;
    }
    return n > 0 || errno == EINTR; /* a terminal that is readable and says nothing is gone */
}

static void run_view(struct top *top, struct terminal *terminal)
{
    for (bool going = true; going;) {
        struct sonard_client *client = top->context->client;
        struct pollfd fds[] = {
            {.fd = STDIN_FILENO, .events = POLLIN},
            {.fd = terminal->signals, .events = POLLIN},
            {.fd = client ? sonard_fd(client) : -1, .events = client ? sonard_events(client) : 0}};
        poll(fds, 3, (int)(RETRY_S * 1e3));
        if (fds[1].revents) {
            const enum terminal_event event = terminal_signal(terminal);
            going = event != TERMINAL_END;
            top->shown.columns = 0;
        }
        if (fds[0].revents && going)
            going = obey(top);
        if (top->context->client)
            hear(top);
        else if (now_s() >= top->retry_s)
            connect_again(top);
        if (going) {
            draw(top, true);
            show(top);
        }
        poll(NULL, 0, (int)(FRAME_S * 1e3)); /* what comes meanwhile is drawn together */
    }
}

/* One frame, of what the daemon says now. */
static int print_once(struct top *top)
{
    int status = EXIT_CLEAR;
    for (int i = 0; i < N_WATCHED && status == EXIT_CLEAR; i++)
        top->result[i] =
            command_call(top->context, method_of[i], i == SECTORS ? top->sectors_params : NULL, &status);
    if (status == EXIT_CLEAR) {
        draw(top, false);
        for (int row = 0; row < top->canvas.rows; row++) {
            canvas_print_row(stdout, &top->canvas, row, top->context->colour, top->unicode);
            putchar('\n');
        }
    }
    return status;
}

int command_top(struct context *context)
{
    json_t *options = context->arguments.options;
    const bool once = json_object_get(options, "once") != NULL;
    struct top *top = calloc(1, sizeof *top);
    struct terminal terminal;
    int status = EXIT_CLEAR;
    if (!top)
        return command_usage("top", "out of memory");
    json_object_del(options, "once");
    setlocale(LC_CTYPE, "");
    top->unicode = strcmp(nl_langinfo(CODESET), "UTF-8") == 0;
    top->context = context;
    top->sectors_params = options;
    if (once) {
        status = print_once(top);
    } else if (!terminal_enter(&terminal)) {
        status = command_usage("top", "top needs a terminal; --once prints one frame");
    } else {
        run_view(top, &terminal);
        terminal_leave(&terminal);
    }
    forget_results(top);
    free(top);
    return status;
}
