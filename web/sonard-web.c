/* SPDX-License-Identifier: MIT */
/* sonard-web - a live page, an HTTP API and Prometheus metrics of sonard. This file is its command line. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "client/arguments.h"
#include "client/lib/sonard.h"
#include "web_server.h"

#define EXIT_USAGE  3
#define EXIT_FAILED 1
#define EXIT_OUTPUT 7 /* what was asked for could not be written */

static volatile sig_atomic_t stop_wanted;
static struct web_server *server;

static void on_stop(int signal)
{
    (void)signal;
    stop_wanted = 1;
    web_server_wake(server);
}

static const struct argument options[] = {
    {"--listen", "listen", "ADDRESS:PORT", "where browsers connect (127.0.0.1:9360); any:PORT: on all networks",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--socket", "socket", "PATH", "of the daemon; else $SONARD_SOCKET, else " SONARD_DEFAULT_SOCKET,
     ARGUMENT_TEXT, 0, 0, 0},
    {"--names", "names", "NAME,...", "more names of this machine, beside its host name and addresses",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--origins", "origins", "ORIGIN,...", "pages of other sites that may connect, as https://site.example",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--settings", "settings", "FILE", "let pages change what can be reloaded: a file of sonard.conf.d for it",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--token", "token", "FILE", "a file with the token that they need, for --settings", ARGUMENT_TEXT, 0, 0, 0},
    {"--replay", "replay", "", "let pages pause a capture that sonard --replay plays, and jump in it",
     ARGUMENT_FLAG, 0, 0, 0},
    {"--version", "version", "", "print the version", ARGUMENT_FLAG, 0, 0, 0},
    {"--help", "help", "", "this text", ARGUMENT_FLAG, 0, 0, 0},
    {0},
};

static void print_help(void)
{
    printf("usage: sonard-web [OPTIONS]\n"
           "Shows what sonard sees in a browser, and answers questions over HTTP. It changes nothing\n"
           "without --settings or --replay.\n\n");
    for (const struct argument *a = options; a->flag; a++)
        printf("  %s %-*s %s\n", a->flag, (int)(26 - strlen(a->flag)), a->form, a->help);
    printf("\nExit status: 0 ended by SIGTERM or SIGINT, 1 cannot listen, 3 wrong usage.\n");
}

/* ADDRESS:PORT, [ADDRESS]:PORT or any:PORT, into text and the configuration. */
static bool parse_listen(char *text, struct web_server_conf *conf, struct fault *fault)
{
    char *colon = strrchr(text, ':');
    double port;
    if (!colon || colon == text || !arguments_number(colon + 1, 1, 65535, &port) || port != (int)port)
        return fault_set(fault, "--listen %.100s: expected ADDRESS:PORT", text);
    conf->port = (int)port;
    *colon = '\0';
    if (text[0] == '[' && colon[-1] == ']') {
        colon[-1] = '\0';
        text++;
    }
    conf->address = strcmp(text, "any") == 0 ? NULL : text;
    return true;
}

static bool parse_conf(const struct arguments *arguments, char listen[256], struct web_server_conf *conf,
                       struct fault *fault)
{
    const json_t *given = arguments->options;
    const char *at = json_string_value(json_object_get(given, "listen"));
    if (arguments->n_words > 0)
        return fault_set(fault, "'%.100s' is no option", arguments->word[0]);
    *conf = (struct web_server_conf){
        .socket = json_string_value(json_object_get(given, "socket")),
        .guard = {.names = json_string_value(json_object_get(given, "names")),
                  .origins = json_string_value(json_object_get(given, "origins"))},
        .settings = json_string_value(json_object_get(given, "settings")),
        .token = json_string_value(json_object_get(given, "token")),
        .replay = json_is_true(json_object_get(given, "replay")),
    };
    if (!conf->settings != !conf->token)
        return fault_set(fault, "--settings and --token belong together");
    gethostname(conf->guard.machine, sizeof conf->guard.machine - 1);
    snprintf(listen, 256, "%s", at ? at : "127.0.0.1:9360");
    return parse_listen(listen, conf, fault);
}

static int run_server(const struct web_server_conf *conf)
{
    const struct sigaction action = {.sa_handler = on_stop};
    struct fault fault;
    server = web_server_new(conf, &fault);
    if (!server) {
        fprintf(stderr, "sonard-web: %s\n", fault.text);
        return EXIT_FAILED;
    }
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    fprintf(stderr, "sonard-web: listening on %s, port %d\n", conf->address ? conf->address : "any address",
            conf->port);
    while (!stop_wanted && web_server_turn(server))
        ;
    web_server_free(server);
    return 0;
}

int main(int argc, char **argv)
{
    struct arguments arguments;
    struct web_server_conf conf;
    struct fault fault = {""};
    char listen[256];
    int status = EXIT_USAGE;
    if (!arguments_parse(&arguments, argc, argv, argc, &(struct argument_tables){.own = options}, &fault)) {
        status = EXIT_USAGE;
    } else if (json_object_get(arguments.options, "help")) {
        print_help();
        status = 0;
    } else if (json_object_get(arguments.options, "version")) {
        printf("sonard-web %s\n", SONARD_VERSION);
        status = 0;
    } else if (parse_conf(&arguments, listen, &conf, &fault)) {
        status = run_server(&conf);
    }
    if (status == EXIT_USAGE)
        arguments_tell("sonard-web", fault.text, "sonard-web --help");
    if (fflush(stdout) != 0 || ferror(stdout)) {
        fprintf(stderr, "sonard-web: standard output: %s\n", strerror(errno));
        status = EXIT_OUTPUT;
    }
    json_decref(arguments.options);
    return status;
}
