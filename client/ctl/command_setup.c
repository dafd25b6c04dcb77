/* SPDX-License-Identifier: MIT */
/*
 * command_setup - `sonarctl setup`: asks the few questions whose answers nobody but the user knows, finds the sonar,
 * and writes them as a drop-in for sonard.conf(5), with the reasons. Needs no daemon. What options answer is not asked.
 */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "command.h"
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/ports/port.h"
#include "find_network.h"
#include "find_sonar.h"
#include "setup_check.h"

#define CONF_FILE    "/etc/sonard/sonard.conf"
#define DROP_IN      CONF_FILE ".d/50-setup.conf"
#define DEFAULT_NAME "front" /* of the section in the sonard.conf that is installed */
#define LINE_MAX_    256
#define NETWORK_MS   800 /* for answers, twice */

/* For the promise that [vehicle] near is: what sonard.conf(5) and docs/devices/ping360.md reckon with. */
#define PING360_HALF_FAN_DEG 12.5
#define ANGULAR_STEP_DEG     2.0
#define MARGIN_M             0.3
#define HEIGHT_M             0.5

/* As sonard.conf(5) has it without an answer, and no difference. */
#define RADIUS_M 0.4
#define EQUAL_M  1e-6

#define QUICK_RANGE_M 10.0 /* of a head without a position */

struct setup {
    const struct context *context;
    bool asks;  /* somebody sits at the terminal */
    bool ended; /* ... and has left: the rest of the answers is not the defaults */
    char device[32], port[FIND_SONAR_PATH + 32], how[80], name[32];
    double mount_m[3], size_m[3], range_m, current_mps;
    bool current_answered;                              /* there is no DVL */
    bool mount_answered, size_answered, range_answered; /* the others stay the defaults of sonard.conf */
    bool upside_down;
    bool promises_near; /* what stands near is in the beams' sight */
    int port_error;     /* errno of the port given with --port; 0: it was open */
};

static const json_t *given(const struct setup *s, const char *key)
{
    return json_object_get(s->context->arguments.options, key);
}

/* A line of the user, without its end; false at the end of the input, and for an empty line: the default is meant. */
static bool ask_person(struct setup *s, const char *question, const char *standard, char *answer, size_t size)
{
    if (!s->asks || s->ended)
        return false;
    fprintf(stderr, "%s [%s] ", question, standard);
    s->ended = !fgets(answer, (int)size, stdin);
    if (s->ended)
        return false;
    answer[strcspn(answer, "\r\n")] = '\0';
    return answer[0] != '\0';
}

struct question {
    const char *option, *key; /* that answers it, as written and as parsed */
    const char *text;
    int n;         /* numbers wanted, 1 to 3 */
    double lo, hi; /* each of them within */
};

static const struct question mount = {
    "--mount", "mount_m", "Where is the transducer: forward, right, down of the vehicle's middle, in m?",
    3,         -50,       50};
static const struct question size = {"--size", "size_m", "How large is the vehicle: length, width, height in m?",
                                     3,        0.1,      50};
static const struct question range = {"--range", "range_m", "How far is it to listen, in m?", 1, 0.75, 200};

static double number_of(const json_t *option, int i)
{
    return json_number_value(json_is_array(option) ? json_array_get(option, (size_t)i) : option);
}

/* Is an option for it what the question would take? False after a message. */
static bool check_numbers(const struct setup *s, const struct question *question)
{
    const json_t *option = given(s, question->key);
    bool good = true;
    for (int i = 0; i < question->n && option; i++)
        good = good && number_of(option, i) >= question->lo && number_of(option, i) <= question->hi;
    if (!good)
        fprintf(stderr, "sonarctl setup: %s: expected %d number%s from %g to %g\n", question->option, question->n,
                question->n > 1 ? "s" : "", question->lo, question->hi);
    return good;
}

/* Numbers from the option or the user, to whom those in value[] are offered. False: nobody answered. */
static bool ask_numbers(struct setup *s, const struct question *question, double value[])
{
    const json_t *option = given(s, question->key);
    const double lo = question->lo, hi = question->hi;
    const int n = question->n;
    char standard[64] = "", answer[LINE_MAX_];
    double number[3];
    for (int i = 0; i < n && option; i++)
        value[i] = number_of(option, i);
    if (option)
        return true;
    for (int i = 0; i < n; i++)
        snprintf(standard + strlen(standard), sizeof standard - strlen(standard), "%s%g", i ? " " : "", value[i]);
    while (ask_person(s, question->text, standard, answer, sizeof answer)) {
        char *at = answer;
        int got = 0;
        for (; got < n; got++) {
            char *end;
            number[got] = strtod(at, &end);
            if (end == at || !(number[got] >= lo && number[got] <= hi))
                break;
            at = end + strspn(end, ", x");
        }
        if (got == n && *at == '\0') {
            memcpy(value, number, (size_t)n * sizeof *value);
            return true;
        }
        fprintf(stderr, "  expected %d number%s from %g to %g\n", n, n > 1 ? "s" : "", lo, hi);
    }
    return s->asks;
}

#define DEVICE_NAME(device) #device,

static const char *const devices[] = {DEVICES(DEVICE_NAME) NULL};

static bool known_device(const char *name)
{
    for (const char *const *d = devices; *d; d++)
        if (strcmp(*d, name) == 0)
            return true;
    return false;
}

static void list_devices(void)
{
    fprintf(stderr, "  supported:");
    for (const char *const *d = devices; *d; d++)
        fprintf(stderr, " %s", *d);
    fputc('\n', stderr);
}

/* Listens on one port after the other, until a sonar is found. */
static bool search_each(struct setup *s, char path[][FIND_SONAR_PATH], size_t n)
{
    const bool ask_it = !given(s, "listen");
    for (size_t i = 0; i < n; i++) {
        struct found_sonar found;
        struct fault fault;
        fprintf(stderr, "%s: listening%s ...\n", path[i], ask_it ? ", then asking" : "");
        if (!find_sonar_on(path[i], ask_it, &found, &fault)) {
            fprintf(stderr, "  %s\n", fault.text);
            s->port_error = given(s, "port") ? found.error : 0;
            continue;
        }
        fprintf(stderr, "  found: %s (%s)\n", found.device, found.how);
        snprintf(s->device, sizeof s->device, "%s", found.device);
        snprintf(s->port, sizeof s->port, "%s", found.port);
        snprintf(s->how, sizeof s->how, "%s", found.how);
        return true;
    }
    return false;
}

/* Where options do not say it: on the port given, or on every serial line there is, then on the network. */
static void search_ports(struct setup *s)
{
    char path[FIND_SONAR_PORTS][FIND_SONAR_PATH];
    const char *option = json_string_value(given(s, "port"));
    struct find_target target[FIND_NETWORK_TARGETS];
    if (option) {
        snprintf(path[0], sizeof path[0], "%s", option);
        search_each(s, path, 1);
        return;
    }
    size_t n = find_sonar_ports(path);
    if (n == 0)
        fprintf(stderr, "no serial adapter found below /dev/serial/by-id, /dev/ttyUSB* and /dev/ttyACM*\n");
    if (search_each(s, path, n) || given(s, "listen"))
        return;
    fprintf(stderr, "asking on the network ...\n");
    n = find_network(target, find_network_targets(target), NETWORK_MS, path);
    if (n == 0)
        fprintf(stderr, "  no answer: no Ping360 to a broadcast, no Surveyor and no bridge of BlueOS where they "
                        "usually are\n");
    for (size_t i = 0; n > 1 && i < n; i++)
        fprintf(stderr, "  answered: %s\n", path[i]);
    search_each(s, path, n);
}

static bool is_ping360(const struct setup *s)
{
    return strcmp(s->device, "ping360") == 0;
}

/* A port as sonard.conf wants it, of a device file too: a Ping360 follows the rate of the line. */
static bool take_port(struct setup *s, const char *text, struct fault *fault)
{
    const char *rest;
    if (text[0] == '/')
        snprintf(s->port, sizeof s->port, "serial:%.*s:%s", FIND_SONAR_PATH - 1, text,
                 is_ping360(s) ? "921600" : "115200");
    else
        snprintf(s->port, sizeof s->port, "%s", text);
    return port_find(s->port, &rest, fault) != NULL;
}

/* Options that cannot be meant, before anything is listened to. False after a message. */
static bool check_options(struct setup *s)
{
    const char *device = json_string_value(given(s, "device")), *port = json_string_value(given(s, "port"));
    struct fault fault;
    if (device && !known_device(device)) {
        fprintf(stderr, "sonarctl setup: no such device: %s\n", device);
        list_devices();
        return false;
    }
    if (port && !take_port(s, port, &fault)) {
        fprintf(stderr, "sonarctl setup: --port: %s\n", fault.text);
        return false;
    }
    s->port[0] = '\0';
    return check_numbers(s, &mount) && check_numbers(s, &size) && check_numbers(s, &range);
}

/* What to do about it. */
static void not_found(const struct setup *s, const char *port)
{
    if (s->port_error == EBUSY) {
        fprintf(stderr, "sonarctl setup: another program has %s; stop it and try again", port);
        if (port[0] == '/')
            fprintf(stderr, " (sudo fuser -v %s names it)", port);
        fputc('\n', stderr);
        return;
    } else if (s->port_error == ENOENT) {
        fprintf(stderr, "sonarctl setup: no such port; find it with `ls /dev/serial/by-id`\n");
        return;
    } else if (port && strncmp(port, "udp:", 4) == 0)
        fprintf(stderr,
                "sonarctl setup: no sonar found at %s; is its bridge running, and which port does it listen on? "
                "BlueOS "
                "lists both; usual are 9092 for a Ping360, 9090 for a Ping1D. Give --device to write it all the "
                "same\n",
                port);
    else if (port)
        fprintf(
            stderr,
            "sonarctl setup: no sonar found at %s; power, wiring, right port? Give --device to write it all the "
            "same\n",
            port);
    else
        fprintf(stderr,
                "sonarctl setup: no sonar found; give --device and --port, or plug it in, power it and try "
                "again\n");
    list_devices();
}

static bool take_device(struct setup *s)
{
    const char *device = json_string_value(given(s, "device")), *port = json_string_value(given(s, "port"));
    char answer[LINE_MAX_];
    struct fault fault;
    if (!device || !port)
        search_ports(s);
    if (device) {
        if (s->device[0] && strcmp(device, s->device) != 0)
            fprintf(stderr, "  taking %s, as --device says, although %s was found\n", device, s->device);
        snprintf(s->device, sizeof s->device, "%s", device);
    }
    while (!device && ask_person(s, "Which sonar?", s->device[0] ? s->device : "none", answer, sizeof answer)) {
        if (known_device(answer)) {
            snprintf(s->device, sizeof s->device, "%.31s", answer);
            break;
        }
        list_devices();
    }
    if (port && !s->port[0])
        take_port(s, port, &fault);
    while (!port && ask_person(s, "Which port?", s->port[0] ? s->port : "none", answer, sizeof answer)) {
        if (take_port(s, answer, &fault))
            break;
        fprintf(stderr, "  %s\n", fault.text);
        s->port[0] = '\0';
    }
    if (known_device(s->device) && s->port[0])
        return true;
    not_found(s, port);
    return false;
}

/* An empty line is no. */
static bool ask_yes(struct setup *s, const char *question)
{
    char answer[LINE_MAX_];
    while (ask_person(s, question, "n", answer, sizeof answer)) {
        const bool yes = strcasecmp(answer, "y") == 0 || strcasecmp(answer, "yes") == 0;
        if (yes || strcasecmp(answer, "n") == 0 || strcasecmp(answer, "no") == 0)
            return yes;
        fprintf(stderr, "  expected y or n\n");
    }
    return false;
}

/* Nobody but the user knows where the vehicle dives; an empty line: something tells where it is. */
static void ask_current(struct setup *s)
{
    static const struct {
        const char *water;
        double mps;
    } waters[] = {{"pool", 0.05}, {"harbour", 0.3}, {"tidal", 1.5}};
    const json_t *option = given(s, "current_mps");
    char answer[LINE_MAX_], *end;

    s->current_mps = json_number_value(option);
    s->current_answered = option;
    while (
        !s->current_answered &&
        ask_person(s,
                   "Without a DVL: in which water does it dive, pool (0.05), harbour (0.3) or tidal (1.5), or how "
                   "fast does the water go at most, in m/s?",
                   "it has a DVL", answer, sizeof answer)) {
        s->current_mps = strtod(answer, &end);
        s->current_answered = end != answer && *end == '\0' && s->current_mps >= 0 && s->current_mps <= 5;
        for (size_t i = 0; i < sizeof waters / sizeof *waters && !s->current_answered; i++) {
            s->current_answered = strcasecmp(answer, waters[i].water) == 0;
            s->current_mps = waters[i].mps;
        }
        if (!s->current_answered)
            fprintf(stderr, "  expected pool, harbour, tidal or a number from 0 to 5\n");
    }
}

/* From here on the beams are as high as the vehicle with its margin; rounded up. */
static double near_m(const struct setup *s)
{
    const double height_m = s->size_answered ? s->size_m[2] : HEIGHT_M;
    const double seen_deg = PING360_HALF_FAN_DEG - 1.5 * ANGULAR_STEP_DEG;
    const double off_m = s->mount_answered ? fabs(s->mount_m[2]) : 0;
    return ceil((height_m / 2 + MARGIN_M + off_m) / sin(seen_deg * M_PI / 180) * 10) / 10;
}

/* As far as the sonar will listen. */
static double range_m(const struct setup *s)
{
    return s->current_answered && is_ping360(s) && !s->range_answered ? QUICK_RANGE_M : s->range_m;
}

/* Is there a distance that can be promised? It is known of a Ping360's beam alone, and sonard takes none beyond the
 * range. */
static bool has_near(const struct setup *s)
{
    return is_ping360(s) && near_m(s) <= range_m(s);
}

/* Behind mount and size, which say how far the promise reaches, and behind the water, of which it is. */
static bool ask_near(struct setup *s)
{
    char question[LINE_MAX_];
    snprintf(
        question, sizeof question,
        "A promise: does every obstacle within %.1f m reach from the bottom to the surface, as a pool's walls "
        "do, y or n?",
        near_m(s));
    return given(s, "near") || (has_near(s) && ask_yes(s, question));
}

static void ask_all(struct setup *s)
{
    s->mount_answered = ask_numbers(s, &mount, s->mount_m);
    s->upside_down = given(s, "upside_down") || ask_yes(s, "Is it mounted upside down, y or n?");
    s->size_answered = ask_numbers(s, &size, s->size_m);
    s->range_answered = ask_numbers(s, &range, &s->range_m);
    ask_current(s);
    s->promises_near = ask_near(s);
}

static void write_port(const struct setup *s, FILE *out)
{
    const bool is_serial = strncmp(s->port, "serial:", 7) == 0;
    if (is_serial && is_ping360(s) && strstr(s->port, ":921600"))
        fprintf(out,
                "# At 115200 baud the line would limit the scan, not the water; a Ping360 follows the rate.\n");
    if (is_serial && !strstr(s->port, "/by-id/"))
        fprintf(out, "# Names below /dev/serial/by-id/ stay the same when plugs are moved.\n");
    fprintf(out, "port = %s\n", s->port);
}

/* What the user did not promise is written as a comment. */
static void write_near(const struct setup *s, FILE *out)
{
    fprintf(
        out,
        "# A level head does not see what is close above and below it: without this `limit` allows a crawl only.\n"
        "%s that nothing stands so near out of the beams' sight (docs/devices/ping360.md).\n%snear = %.1f m\n",
        s->promises_near ? "# A promise:" : "# Remove the # to promise", s->promises_near ? "" : "#", near_m(s));
}

/* Without a position water is clear for seconds: turns must be quick (config/scenes/bluerov2-stock.conf). */
static void write_scan(const struct setup *s, FILE *out)
{
    if (!s->current_answered || !is_ping360(s))
        return;
    if (!s->range_answered)
        fprintf(out, "# Without a position a quick turn is worth more than what is far away.\nrange = %g m\n",
                range_m(s));
    fprintf(out, "# Every second step: half the time for a turn, and the beams of 2 deg still overlap.\n"
                 "step = 1.8 deg\n");
}

/* Only what was found or answered: the rest stays as sonard.conf or the defaults have it. */
static void write_conf(const struct setup *s, FILE *out)
{
    const double radius_m = hypot(s->size_m[0], s->size_m[1]) / 2;
    fprintf(out,
            "# Written by `sonarctl setup`; change it as you like. Read after sonard.conf if it is in\n"
            "# " CONF_FILE ".d/; keys set here override it. What each key means: sonard.conf(5).\n\n"
            "[sonar %s]\n",
            s->name);
    fprintf(out, "device = %s%s%s\n", s->device, s->how[0] ? "    ; " : "", s->how);
    write_port(s, out);
    if (s->range_answered)
        fprintf(out,
                "# Several times the stopping distance; longer makes every scan of a head slower.\n"
                "range = %g m\n",
                s->range_m);
    write_scan(s, out);
    if (s->mount_answered)
        fprintf(
            out,
            "# Forward, right, down of the vehicle's middle, from which all ranges count.\nmount = %g %g %g m\n",
            s->mount_m[0], s->mount_m[1], s->mount_m[2]);
    if (s->upside_down)
        fprintf(out, "# It hangs upside down: left is right without this.\nrotation = 180 0 0 deg\n");
    if (s->size_answered || s->current_answered || has_near(s))
        fprintf(out, "\n[vehicle]\n");
    if (s->size_answered)
        fprintf(out,
                "# Half the diagonal of %g m by %g m: the upright cylinder that holds the vehicle.\n"
                "radius = %.3g m\nheight = %g m\n",
                s->size_m[0], s->size_m[1], ceil(radius_m * 1e3) / 1e3, s->size_m[2]);
    if (s->current_answered)
        fprintf(
            out,
            "# A promise: the water goes no faster. Without a DVL the thrusters of an ArduSub vehicle then bound "
            "its drift\n# (docs/without-a-dvl.md); without it nothing is clear for long.\ncurrent = %g m/s\n"
            "# A promise: it never goes faster over ground. Less is better, if it is true.\nmax_speed = 1.5 m/s\n",
            s->current_mps);
    if (has_near(s))
        write_near(s, out);
    if (s->current_answered)
        fprintf(out, "\n[answers]\n"
                     "# Drift leaves little within 3 m that beams cover 5 deg up and down.\nlook_ahead = 6 m\n");
}

/* Ranges count from the vehicle's middle: what is measured to one end of it, say, is a mistake that stays. */
static void judge_mount(const struct setup *s)
{
    const double radius_m = s->size_answered ? hypot(s->size_m[0], s->size_m[1]) / 2 : RADIUS_M;
    const double half_m = (s->size_answered ? s->size_m[2] : HEIGHT_M) / 2;
    const double *m = s->mount_m;
    if (hypot(m[0], m[1]) > radius_m + EQUAL_M || fabs(m[2]) > half_m + EQUAL_M)
        fprintf(
            stderr,
            "sonarctl setup: warning: the transducer at %g %g %g m is outside of the vehicle, which reaches %g m "
            "to the side and %g m up and down: measure from its middle\n",
            m[0], m[1], m[2], ceil(radius_m * 1e3) / 1e3, half_m);
}

/* A promise that was given and not written, or cannot be given. */
static void judge_near(const struct setup *s)
{
    if (is_ping360(s) && !has_near(s))
        fprintf(stderr,
                "sonarctl setup: warning: near is left out: it would be %.1f m, beyond the range of %g m, and "
                "without it `limit` allows a crawl only: listen farther\n",
                near_m(s), range_m(s));
    else if (s->promises_near && !is_ping360(s))
        fprintf(stderr,
                "sonarctl setup: warning: --near is for a Ping360 and was left out for %s: set near in [vehicle] "
                "yourself, see sonard.conf(5)\n",
                s->device);
}

/* To be known before all is answered: does the file to write exist already? */
static bool output_exists(const struct setup *s)
{
    const char *output = json_string_value(given(s, "output")), *path = output ? output : DROP_IN;
    if (strcmp(path, "-") == 0 || access(path, F_OK) != 0)
        return false;
    fprintf(stderr, "sonarctl setup: %s: %s; remove it first, or choose another with --output\n", path,
            strerror(EEXIST));
    return true;
}

static void print_fault(void *ctx, const char *message)
{
    (void)ctx;
    fprintf(stderr, "%s\n", message);
}

/* What is to be written, in memory of its own; NULL after a message: there is no memory. */
static char *make_text(const struct setup *s, size_t *n)
{
    char *text = NULL;
    FILE *out = open_memstream(&text, n);
    if (out) {
        write_conf(s, out);
        if (fclose(out) == 0)
            return text;
    }
    fprintf(stderr, "sonarctl setup: %s: nothing is written\n", strerror(errno));
    free(text);
    return NULL;
}

/* To the file that is not there yet, - is standard output. */
static int write_out(const struct setup *s)
{
    const char *output = json_string_value(given(s, "output"));
    const bool is_drop_in = !output, to_stdout = output && strcmp(output, "-") == 0;
    const char *path = output ? output : DROP_IN;
    size_t n;
    char *text = make_text(s, &n);
    if (!text)
        return EXIT_OUTPUT;
    if (!setup_check(&(struct conf_text){to_stdout ? "standard output" : path, text, n}, print_fault, NULL)) {
        fprintf(stderr, "sonarctl setup: sonard would refuse this configuration: nothing is written\n");
        free(text);
        return EXIT_USAGE;
    }
    FILE *out = to_stdout ? stdout : fopen(path, "wxe");
    if (!out) {
        fprintf(stderr, "sonarctl setup: %s: %s%s\n", path, strerror(errno),
                errno == EEXIST                 ? "; remove it first, or choose another with --output"
                : errno == EACCES && is_drop_in ? "; run it with sudo, or choose another with --output FILE"
                : errno == ENOENT && is_drop_in ? "; make the folder first, or choose another with --output FILE"
                                                : "");
        free(text);
        return EXIT_OUTPUT;
    }
    fwrite(text, 1, n, out);
    free(text);
    if (to_stdout)
        return EXIT_CLEAR;
    if (fclose(out) != 0) {
        fprintf(stderr, "sonarctl setup: %s: %s\n", path, strerror(errno));
        unlink(path);
        return EXIT_OUTPUT;
    }
    fprintf(stderr, "written: %s\nCheck it: sonard --check %s\n", path, is_drop_in ? CONF_FILE : path);
    if (is_drop_in)
        fprintf(stderr, "Use it: %ssudo systemctl restart sonard\n",
                strncmp(s->port, "udp:", 4) == 0 || strncmp(s->port, "tcp:", 4) == 0
                    ? "permit the service to use the network (sonard(8), RUNNING), then "
                    : "");
    else
        fprintf(stderr, "Use it: sonard -c %s\n", path);
    return EXIT_CLEAR;
}

int command_setup(struct context *context)
{
    const json_t *options = context->arguments.options;
    const char *name = json_string_value(json_object_get(options, "name"));
    struct setup s = {.context = context,
                      .asks = isatty(STDIN_FILENO) && !json_object_get(options, "yes"),
                      .size_m = {0.46, 0.34, 0.25}, /* of a BlueROV2 without its tether */
                      .range_m = 20};
    snprintf(s.name, sizeof s.name, "%s", name ? name : DEFAULT_NAME);
    if (s.name[strspn(s.name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_")] || !s.name[0] ||
        (name && strlen(name) >= sizeof s.name))
        return command_usage("setup", "--name: expected up to 31 letters, digits, - and _");
    if (!check_options(&s))
        return EXIT_USAGE;
    if (output_exists(&s))
        return EXIT_OUTPUT;
    if (!s.asks && !json_object_get(options, "yes"))
        fprintf(stderr,
                "standard input is not a terminal, so nothing is asked: everything not given keeps its default\n");
    if (!take_device(&s))
        return EXIT_UNKNOWN;
    ask_all(&s);
    judge_mount(&s);
    judge_near(&s);
    if (s.ended) {
        fprintf(stderr, "\nsonarctl setup: the input ended before the last answer: nothing is written\n");
        return EXIT_OUTPUT;
    }
    return write_out(&s);
}
