/* SPDX-License-Identifier: MIT */
/*
 * sonard-mavlink - the bridge between sonard and an autopilot that speaks MAVLink. This file is its command line, and
 * waits and reads the clock; mavlink_bridge does the work.
 */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "client/arguments.h"
#include "core/fault.h"
#include "mavlink_bridge.h"

#define SECOND_NS            1000000000u
#define CLOCK_TRIES          8
#define CLOCKS_TOGETHER_NS   100000u
#define EXIT_USAGE           3
#define EXIT_OUTPUT          7   /* what was asked for could not be written */
#define DEFAULT_COMPONENT    196 /* MAV_COMP_ID_OBSTACLE_AVOIDANCE */
#define DEFAULT_RATE_HZ      10.0
#define DEFAULT_DENSITY      1025.0
#define DRAG_MOST            1000.0
#define STANDARD_SURFACE_HPA 1013.25

static volatile sig_atomic_t stop_wanted;

static void on_stop(int signal)
{
    (void)signal;
    stop_wanted = 1;
}

static const struct argument options[] = {
    {"--link", "link", "LINK", "udp:HOST:PORT, udpin:[ADDRESS:]PORT or serial:/dev/NAME:BAUD; must be given",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--peer", "peer", "ADDRESS[/BITS]", "udpin: believe only senders there; else the first autopilot",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--socket", "socket", "PATH", "of the daemon; else $SONARD_SOCKET, else " SONARD_DEFAULT_SOCKET,
     ARGUMENT_TEXT, 0, 0, 0},
    {"--system-id", "system-id", "N", "of the vehicle, and ours; else the first autopilot's", ARGUMENT_INTEGER, 0,
     1, 255},
    {"--component-id", "component-id", "N", "ours (196, obstacle avoidance)", ARGUMENT_INTEGER, 0, 2, 255},
    {"--rate", "rate", "HZ", "obstacle messages per second, 5 to 50 (10)", ARGUMENT_NUMBER, 0, 5, 50},
    {"--distance", "distance", "M", "range to judge (default: that of the sonars)", ARGUMENT_NUMBER, 0, 0.1,
     MAVLINK_REACH_M},
    {"--unknown-as", "unknown_as", "far|unknown|M", "how to report unknown water (unknown)", ARGUMENT_TEXT, 0, 0,
     0},
    {"--frame", "frame", "body|ned", "azimuth 0 is forward (body) or north (ned)", ARGUMENT_TEXT, 0, 0, 0},
    {"--3d", "layers", "", "send OBSTACLE_DISTANCE_3D too", ARGUMENT_FLAG, 0, 0, 0},
    {"--downward", "downward", "SENSOR", "send this sonar's ranges as DISTANCE_SENSOR", ARGUMENT_TEXT, 0, 0, 0},
    {"--barometer", "barometer", "1|2|3", "that is in the water: SCALED_PRESSURE, 2 or 3 (found out)",
     ARGUMENT_INTEGER, 0, 1, MAVLINK_BAROMETERS},
    {"--surface-pressure", "surface", "HPA|first", "pressure at the surface (1013.25), or the first reading",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--density", "density", "KG/M3", "of the water, for depth from pressure (1025)", ARGUMENT_NUMBER, 0, 900,
     1200},
    {"--battery", "battery", "V", "the thrusters', when full (16.8)", ARGUMENT_NUMBER, 0, 10, 25},
    {"--drag", "drag", "A,B", "of the vehicle ahead, A v + B v^2 newtons (the least of published ones)",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--sign", "sign", "FILE", "sign frames, and require signatures, with the key of 64 hex digits in it",
     ARGUMENT_TEXT, 0, 0, 0},
    {"--sign-link", "sign-link", "N", "link id in our signatures (0)", ARGUMENT_INTEGER, 0, 0, 255},
    {"--version", "version", "", "print the version", ARGUMENT_FLAG, 0, 0, 0},
    {"--help", "help", "", "this text", ARGUMENT_FLAG, 0, 0, 0},
    {0},
};

static void print_help(void)
{
    printf("usage: sonard-mavlink --link LINK [OPTIONS]\n"
           "Gives an autopilot's pose to sonard, and sonard's obstacles to the autopilot.\n\n");
    for (const struct argument *a = options; a->flag; a++)
        printf("  %s %-*s %s\n", a->flag, (int)(30 - strlen(a->flag)), a->form, a->help);
    printf("\nExit status: 0 ended by SIGTERM or SIGINT, 3 wrong usage.\n");
}

/* The table has checked its range. */
static double number(const json_t *given, const char *key, double absent)
{
    const json_t *value = json_object_get(given, key);
    return value ? json_number_value(value) : absent;
}

static void parse_words(const json_t *given, struct mavlink_bridge_conf *conf, struct fault *fault)
{
    const char *unknown = json_string_value(json_object_get(given, "unknown_as"));
    const char *frame = json_string_value(json_object_get(given, "frame"));
    const char *surface = json_string_value(json_object_get(given, "surface"));
    conf->vehicle.surface_hpa = STANDARD_SURFACE_HPA;
    if (unknown && strcmp(unknown, "far") == 0)
        conf->obstacles.unknown_as = MAVLINK_UNKNOWN_AS_FAR;
    else if (unknown && strcmp(unknown, "unknown") != 0)
        conf->obstacles.unknown_as = MAVLINK_UNKNOWN_AS_DISTANCE;
    if (conf->obstacles.unknown_as == MAVLINK_UNKNOWN_AS_DISTANCE &&
        !arguments_number(unknown, 0.01, MAVLINK_REACH_M, &conf->obstacles.unknown_m)) {
        fault_set(fault, "--unknown-as %.50s: expected far, unknown, or metres from 0.01 to %g", unknown,
                  MAVLINK_REACH_M);
    }
    conf->obstacles.north = conf->feed.north = frame && strcmp(frame, "ned") == 0;
    if (frame && !conf->feed.north && strcmp(frame, "body") != 0) {
        fault_set(fault, "--frame %.50s: expected body or ned", frame);
    }
    if (surface && strcmp(surface, "first") == 0) {
        conf->vehicle.surface_hpa = 0;
    } else if (surface && !arguments_number(surface, 300, 1200, &conf->vehicle.surface_hpa)) {
        fault_set(fault, "--surface-pressure %.50s: expected first, or hPa from 300 to 1200", surface);
    }
}

/* "4.03,18.18" */
static void parse_drag(const char *text, struct speed_bound_conf *drag, struct fault *fault)
{
    const char *comma = text ? strchr(text, ',') : NULL;
    char first[32];
    if (!text)
        return;
    if (comma && comma - text < (ptrdiff_t)sizeof first) {
        memcpy(first, text, (size_t)(comma - text));
        first[comma - text] = '\0';
        if (arguments_number(first, 0, DRAG_MOST, &drag->linear_nspm) &&
            arguments_number(comma + 1, 1, DRAG_MOST, &drag->square_ns2pm2))
            return;
    }
    fault_set(
        fault,
        "--drag %.50s: expected two numbers, N at 1 m/s: 0 to %g of the linear part, 1 to %g of the square one, "
        "such as 4.03,18.18",
        text, DRAG_MOST, DRAG_MOST);
}

static void read_key(const char *path, struct mavlink_signing *signing, struct fault *fault)
{
    char text[200];
    FILE *file = fopen(path, "r");
    const size_t n = file ? fread(text, 1, sizeof text - 1, file) : 0;
    text[n] = '\0';
    if (!file || !mavlink_signing_key(signing, text))
        fault_set(fault, "--sign %.150s: %s", path,
                  file ? "expected a key of 64 hexadecimal digits in it" : strerror(errno));
    if (file)
        fclose(file);
}

static bool parse_conf(const struct arguments *arguments, struct mavlink_bridge_conf *conf,
                       struct mavlink_signing *signing, struct mavlink_link *link, struct fault *fault)
{
    const json_t *given = arguments->options;
    const char *socket = json_string_value(json_object_get(given, "socket")), *set = getenv("SONARD_SOCKET");
    const char *address = json_string_value(json_object_get(given, "link"));
    const char *key_file = json_string_value(json_object_get(given, "sign"));
    const char *peer = json_string_value(json_object_get(given, "peer"));
    *conf =
        (struct mavlink_bridge_conf){.feed = {.socket = socket        ? socket
                                                        : set && *set ? set
                                                                      : SONARD_DEFAULT_SOCKET,
                                              .rate_hz = number(given, "rate", DEFAULT_RATE_HZ),
                                              .layers = json_object_get(given, "layers") != NULL,
                                              .distance_m = number(given, "distance", 0),
                                              .downward = json_string_value(json_object_get(given, "downward"))},
                                     .vehicle = {.system_id = (uint8_t)number(given, "system-id", 0),
                                                 .density_kgpm3 = number(given, "density", DEFAULT_DENSITY),
                                                 .told_below = json_object_get(given, "downward") != NULL},
                                     .component_id = (uint8_t)number(given, "component-id", DEFAULT_COMPONENT),
                                     .signing = key_file ? signing : NULL};
    conf->vehicle.barometer = (int)number(given, "barometer", MAVLINK_BAROMETER_ANY);
    signing->link_id = (uint8_t)number(given, "sign-link", 0);
    conf->vehicle.thrusters.volts = number(given, "battery", THRUST_VOLTS);
    parse_words(given, conf, fault);
    if (!fault->text[0])
        parse_drag(json_string_value(json_object_get(given, "drag")), &conf->vehicle.thrusters.drag, fault);
    if (!fault->text[0] && key_file)
        read_key(key_file, signing, fault);
    if (!fault->text[0] && (arguments->n_words > 0 || !address)) {
        fault_set(fault, address ? "'%.100s' is no option" : "--link LINK is missing",
                  arguments->n_words > 0 ? arguments->word[0] : "");
    }
    if (!fault->text[0] && peer && mavlink_network_parse(peer, &conf->network, fault) &&
        strncmp(address, "udpin:", 6) != 0)
        fault_set(fault, "--peer %.60s: only --link udpin:PORT has more than one sender", peer);
    return !fault->text[0] && mavlink_link_init(link, address, fault);
}

static uint64_t clock_ns(clockid_t which)
{
    struct timespec t;
    clock_gettime(which, &t);
    return (uint64_t)t.tv_sec * SECOND_NS + (uint64_t)t.tv_nsec;
}

/* The process may be held up between the two clocks, which would date every pose of a turn wrong. */
static struct mavlink_time now(void)
{
    struct mavlink_time t = {.now_ns = clock_ns(CLOCK_MONOTONIC)};
    uint64_t before_ns = 0;
    for (int i = 0; i < CLOCK_TRIES && t.now_ns - before_ns > CLOCKS_TOGETHER_NS; i++) {
        before_ns = t.now_ns;
        t.unix_offset_ns = clock_ns(CLOCK_REALTIME) - before_ns;
        t.now_ns = clock_ns(CLOCK_MONOTONIC);
    }
    return t;
}

/* Until the link or the daemon has something, the next deadline, or a signal. */
static void wait_for_work(const struct mavlink_bridge *bridge, const sigset_t *waiting)
{
    struct pollfd fds[MAVLINK_BRIDGE_FDS];
    const uint64_t due_ns = mavlink_bridge_wait(bridge, fds), now_ns = clock_ns(CLOCK_MONOTONIC);
    const uint64_t left_ns = due_ns > now_ns ? due_ns - now_ns : 0;
    const struct timespec timeout = {(time_t)(left_ns / SECOND_NS), (long)(left_ns % SECOND_NS)};
    ppoll(fds, MAVLINK_BRIDGE_FDS, &timeout, waiting);
}

/* The signals that end it are let in while it waits, so none is missed. */
static int run_bridge(const struct mavlink_bridge_conf *conf, struct mavlink_link *link)
{
    const struct sigaction action = {.sa_handler = on_stop};
    sigset_t stops, waiting;
    struct mavlink_bridge *bridge = mavlink_bridge_new(conf, link, clock_ns(CLOCK_MONOTONIC));
    if (!bridge) {
        fprintf(stderr, "sonard-mavlink: out of memory\n");
        return EXIT_FAILURE;
    }
    sigemptyset(&stops);
    sigaddset(&stops, SIGTERM);
    sigaddset(&stops, SIGINT);
    sigprocmask(SIG_BLOCK, &stops, &waiting);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    while (!stop_wanted) {
        mavlink_bridge_work(bridge, now);
        wait_for_work(bridge, &waiting);
    }
    mavlink_bridge_end(bridge);
    return 0;
}

int main(int argc, char **argv)
{
    static struct mavlink_link link;
    struct arguments arguments;
    struct mavlink_bridge_conf conf;
    struct mavlink_signing signing = {0};
    struct fault fault = {""};
    int status = EXIT_USAGE;
    if (!arguments_parse(&arguments, argc, argv, argc, &(struct argument_tables){.own = options}, &fault)) {
        status = EXIT_USAGE;
    } else if (json_object_get(arguments.options, "help")) {
        print_help();
        status = 0;
    } else if (json_object_get(arguments.options, "version")) {
        printf("sonard-mavlink %s\n", SONARD_VERSION);
        status = 0;
    } else if (parse_conf(&arguments, &conf, &signing, &link, &fault)) {
        status = run_bridge(&conf, &link);
    }
    if (status == EXIT_USAGE)
        arguments_tell("sonard-mavlink", fault.text, "sonard-mavlink --help");
    if (fflush(stdout) != 0 || ferror(stdout)) {
        fprintf(stderr, "sonard-mavlink: standard output: %s\n", strerror(errno));
        status = EXIT_OUTPUT;
    }
    json_decref(arguments.options);
    return status;
}
