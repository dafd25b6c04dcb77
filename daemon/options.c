/* SPDX-License-Identifier: MIT */
#include "options.h"

#include <getopt.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "settings.h"
#include "config/word.h"
#include "protocol/man.h"
#include "protocol/schema.h"

static const char usage[] =
    "sonard [-c FILE]                          run on the sonars of FILE (" OPTIONS_CONF ")\n"
    "sonard --replay CAPTURE.mcap [-c FILE]    run on a capture, with its own configuration unless -c names one\n"
    "\n"
    "  -c, --config FILE    configuration, sonard.conf(5)\n"
    "      --check FILE     list all faults of a configuration and exit: 0 none, 1 some\n"
    "      --print          print the effective configuration, with where each value came from, and exit\n"
    "      --explain        print which stages the configuration needs, why, and their memory, and exit;\n"
    "                       --explain=json: as the method plan answers\n"
    "      --sample         print the commented default configuration and exit\n"
    "      --man-table      print the table of keys in man(7) macros and exit\n"
    "      --schema         print the JSON Schema of sonard-protocol(7) and exit\n"
    "      --man-methods    fill the tables of methods into a page from standard input and exit\n"
    "      --record DIR     record captures into DIR\n"
    "      --replay FILE    play a capture instead of opening ports\n"
    "      --speed X        pace the replay: 1 as recorded; without it as fast as it goes\n"
    "      --stay           after the replay go on answering, the clock standing at its end\n"
    "      --measure        in a replay, too, measure how long the stages take (sonarctl stats)\n"
    "      --answers FILE   write the sectors after every turn and at the end, as JSON lines; - for standard "
    "output\n"
    "      --every S        and every S seconds, beside the turns\n"
    "      --bands          of every grid, in bands of 10 degrees of elevation, not only about the horizon\n"
    "      --socket PATH    socket for clients, instead of the configured one; 'none': no socket\n"
    "      --threads N      0, 1 or 2 pipeline threads, instead of the configured number\n"
    "      --version        print the version and exit\n"
    "      --help           print this and exit\n";

/* -1 in these: go on; otherwise it is the exit status. */

static int wrong(const char *what, const char *value, const char *wanted)
{
    fprintf(stderr, "sonard: %s '%s': wanted %s\n", what, value, wanted);
    return USAGE;
}

static int too_long(const char *what, const char *value, size_t room)
{
    char wanted[64];
    snprintf(wanted, sizeof wanted, "a path of at most %zu bytes", room - 1);
    return wrong(what, value, wanted);
}

enum {
    CHECK = 256,
    PRINT,
    EXPLAIN,
    EVERY,
    SAMPLE,
    MAN_TABLE,
    SCHEMA,
    MAN_METHODS,
    RECORD,
    REPLAY,
    SPEED,
    STAY,
    MEASURE,
    ANSWERS,
    BANDS,
    SOCKET,
    THREADS,
    VERSION
};

static const struct option longs[] = {{"config", required_argument, NULL, 'c'},
                                      {"check", required_argument, NULL, CHECK},
                                      {"print", no_argument, NULL, PRINT},
                                      {"explain", optional_argument, NULL, EXPLAIN},
                                      {"every", required_argument, NULL, EVERY},
                                      {"sample", no_argument, NULL, SAMPLE},
                                      {"man-table", no_argument, NULL, MAN_TABLE},
                                      {"schema", no_argument, NULL, SCHEMA},
                                      {"man-methods", no_argument, NULL, MAN_METHODS},
                                      {"record", required_argument, NULL, RECORD},
                                      {"replay", required_argument, NULL, REPLAY},
                                      {"speed", required_argument, NULL, SPEED},
                                      {"stay", no_argument, NULL, STAY},
                                      {"measure", no_argument, NULL, MEASURE},
                                      {"answers", required_argument, NULL, ANSWERS},
                                      {"bands", no_argument, NULL, BANDS},
                                      {"socket", required_argument, NULL, SOCKET},
                                      {"threads", required_argument, NULL, THREADS},
                                      {"version", no_argument, NULL, VERSION},
                                      {"help", no_argument, NULL, 'h'},
                                      {NULL, 0, NULL, 0}};

/* Options that keep their value as it stands. */
static const struct {
    int c;
    size_t at; /* in struct options */
} texts[] = {{'c', offsetof(struct options, conf)},        {CHECK, offsetof(struct options, conf)},
             {RECORD, offsetof(struct options, record)},   {REPLAY, offsetof(struct options, replay)},
             {ANSWERS, offsetof(struct options, answers)}, {SOCKET, offsetof(struct options, socket)}};

/* What an option needs that stands without a value. */
static const struct {
    int c;
    const char *what;
} needs[] = {{'c', "a configuration: -c FILE"},         {CHECK, "a configuration, without -c: --check FILE"},
             {RECORD, "a folder: --record DIR"},        {REPLAY, "a capture: --replay CAPTURE.mcap"},
             {ANSWERS, "a file, or -: --answers FILE"}, {SOCKET, "a path, or none: --socket PATH"}};

static int take_number(struct options *o, int c, const char *value)
{
    char *rest;
    if (c == THREADS) {
        if (strlen(value) != 1 || value[0] < '0' || value[0] > '2')
            return wrong("--threads", value, "0, 1 or 2");
        o->threads = value[0] - '0';
        return -1;
    }
    if (c == EVERY) {
        o->every_s = strtod(value, &rest);
        if (*rest || rest == value || !(o->every_s >= 0.01 && o->every_s <= 1e6))
            return wrong("--every", value, "seconds from 0.01 to 1e6");
        return -1;
    }
    o->speed = strtod(value, &rest);
    if (*rest || rest == value || !(o->speed >= 1e-3 && o->speed <= 1e6))
        return wrong("--speed", value, "a factor from 0.001 to 1e6");
    return -1;
}

static int take_option(struct options *o, int c, const char *value)
{
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
        if (texts[i].c == c)
            memcpy((char *)o + texts[i].at, &value, sizeof value);
    o->check |= c == CHECK;
    o->print |= c == PRINT;
    o->stay |= c == STAY;
    o->measure |= c == MEASURE;
    o->bands |= c == BANDS;
    switch (c) {
    case EXPLAIN:
        if (value && strcmp(value, "json") != 0)
            return wrong("--explain", value, "nothing, or json");
        o->explain = value ? EXPLAIN_JSON : EXPLAIN_TABLE;
        return -1;
    case SPEED:
    case THREADS:
    case EVERY:
        return take_number(o, c, value);
    case SAMPLE:
        conf_sample(&settings_checks, stdout);
        return OK;
    case MAN_TABLE:
        settings_man(stdout);
        return OK;
    case SCHEMA:
        schema_print(stdout);
        return OK;
    case MAN_METHODS:
        return man_fill(stdin, stdout) ? OK
                                       : wrong("--man-methods", "standard input", "names of methods between @");
    case VERSION:
        printf("sonard %s\n", SONARD_VERSION);
        return OK;
    case 'h':
        fputs(usage, stdout);
        return OK;
    default:
        return -1;
    }
}

/* Is the option's text the next option, as in --check -c FILE? A file of such a name is ./-c. */
static bool is_bare(int c, char **argv)
{
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++)
        if (texts[i].c == c)
            return optind >= 2 && optarg == argv[optind - 1] && optarg[0] == '-' && optarg[1];
    return false;
}

/* Do they go together, and do they fit? */
static int check_options(const struct options *o)
{
    const struct conf *conf = NULL;
    if (!o->replay && (o->speed > 0 || o->stay)) {
        fprintf(stderr, "sonard: %s: needs --replay\n", o->stay ? "--stay" : "--speed");
        return USAGE;
    }
    if ((o->every_s > 0 || o->bands) && !o->answers) {
        fprintf(stderr, "sonard: %s: needs --answers\n", o->bands ? "--bands" : "--every");
        return USAGE;
    }
    if (o->replay && o->record)
        return wrong("--record", o->record, "a live run: a replay records nothing");
    if (o->socket && strlen(o->socket) >= sizeof conf->server.socket)
        return too_long("--socket", o->socket, sizeof conf->server.socket);
    if (o->record && strlen(o->record) >= sizeof conf->record.directory)
        return too_long("--record", o->record, sizeof conf->record.directory);
    return -1;
}

/* Either option c was given a value and takes none, or there is no such option: then c is its letter, or 0 for a long
 * one, which is the word `given`. */
static int refuse_option(int c, const char *given)
{
    const char *meant = NULL;
    char name[WORD_FAR];
    size_t best = WORD_FAR;
    for (const struct option *l = longs; c && l->name; l++)
        if (l->val == c) {
            fprintf(stderr, "sonard: option %s takes no value; see `sonard --help`\n", given);
            return USAGE;
        }
    snprintf(name, sizeof name, "%.*s", (int)strcspn(given, "="), given);
    if (c)
        snprintf(name, sizeof name, "-%c", c);
    for (const struct option *l = longs; l->name && !c; l++)
        if (word_is_nearest(name + 2, l->name, &best))
            meant = l->name;
    fprintf(stderr,
            meant ? "sonard: no option %s; did you mean --%s?\n" : "sonard: no option %s; see `sonard --help`\n",
            name, meant);
    return USAGE;
}

/* An option without its value. */
static int refuse_bare(int c, const char *given)
{
    const char *wanted = "a value";
    for (size_t i = 0; i < sizeof needs / sizeof needs[0]; i++)
        if (needs[i].c == c)
            wanted = needs[i].what;
    fprintf(stderr, "sonard: %s needs %s; see `sonard --help`\n", given, wanted);
    return USAGE;
}

int options_parse(int argc, char **argv, struct options *o)
{
    int status = -1;
    opterr = 0;
    for (int c; status < 0 && (c = getopt_long(argc, argv, ":c:h", longs, NULL)) != -1;)
        status = c == '?'           ? refuse_option(optopt, argv[optind - 1])
                 : c == ':'         ? refuse_bare(optopt, argv[optind - 1])
                 : is_bare(c, argv) ? refuse_bare(c, argv[optind - 2])
                                    : take_option(o, c, optarg);
    if (status < 0 && optind < argc) {
        fprintf(stderr,
                "sonard: %s: expected options only; a configuration is given as -c %s, a capture as --replay %s\n",
                argv[optind], argv[optind], argv[optind]);
        return USAGE;
    }
    return status < 0 ? check_options(o) : status;
}
