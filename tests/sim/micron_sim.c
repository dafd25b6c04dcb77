/* SPDX-License-Identifier: MIT */
/*
 * micron_sim - a virtual Tritech Micron on a pseudo-terminal, for tests and for people without a sonar: the head in its
 * water at the end of its line, on the monotonic clock. Commands come on standard input, one per line, and each is
 * answered by one line on standard output.
 */
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/fault.h"
#include "grid/geometry.h"
#include "tests/sim/lib/line.h"
#include "tests/sim/lib/micron_head.h"
#include "tests/sim/lib/pace.h"
#include "tests/water/scene.h"
#include "tests/sound/water.h"

#define STATUS_EVERY_NS 1000000000u
#define LINE_OPEN_NS    10000000u /* how often to look whether somebody has opened the line */
#define TEXT_MAX        256
#define FREQUENCY_HZ    700e3 /* middle of the sweep */

static struct {
    struct place scene;
    struct water water;
    double position_m[3], yaw_deg;
    struct micron_head head;
    struct line line;
    FILE *truth;
    uint64_t start_ns;
} sim;

static volatile sig_atomic_t stop_wanted;

static void on_stop(int signal)
{
    (void)signal;
    stop_wanted = 1;
}

__attribute__((noreturn, format(printf, 1, 2))) static void die(const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    fprintf(stderr, "micron_sim: ");
    vfprintf(stderr, fmt, args);
    fprintf(stderr, "\n");
    va_end(args);
    exit(2);
}

/* ---- what the head calls ---- */

static void on_send(void *ctx, const uint8_t *frame, size_t n, uint64_t now_ns)
{
    (void)ctx;
    line_send(&sim.line, frame, n, now_ns);
}

static void on_listen(void *ctx, const struct micron_head_shot *shot, uint8_t *samples)
{
    const double azimuth_deg = (shot->bearing - MICRON_AHEAD) * 360.0 / MICRON_TURN; /* from the bow */
    const uint32_t n_bins = shot->settings.n_bins, n = n_bins < WATER_MAX_SAMPLES ? n_bins : WATER_MAX_SAMPLES;
    struct water_shot beam = {
        .head = SOUND_MICRON,
        .az_rad = geo_rad(azimuth_deg + sim.yaw_deg),
        .t_s = (double)(shot->t_ns - sim.start_ns) * 1e-9,
        .sample_s = shot->settings.interval * MICRON_TICK_S,
        .transmit_s = shot->settings.pulse_us * 1e-6,
        .frequency_hz = FREQUENCY_HZ,
        .gain = shot->settings.gain / 84, /* 40 % is usual */
        .n_samples = n,
        .number = sim.head.pings,
    };
    (void)ctx;
    memcpy(beam.origin_m, sim.position_m, sizeof beam.origin_m);
    water_listen(&sim.water, &sim.scene, &beam, samples);
    memset(samples + n, 0, n_bins - n);
    if (sim.truth != NULL)
        water_write_truth(sim.truth, &sim.water, &sim.scene, &beam, shot->t_ns, shot->bearing, azimuth_deg,
                          sim.yaw_deg);
}

/* ---- commands ---- */

static uint64_t after(double s)
{
    return pace_ns() + (uint64_t)(s * 1e9);
}

/* Each returns NULL, or why it could not. */

static const char *do_unplug(const double *arg)
{
    (void)arg;
    if (sim.line.fd < 0)
        return "is unplugged already";
    line_unplug(&sim.line);
    return NULL;
}

static const char *do_plug(const double *arg)
{
    static struct fault why;
    (void)arg;
    if (sim.line.fd >= 0)
        return "is plugged in already";
    return line_plug(&sim.line, &why) ? NULL : why.text;
}

static const char *do_reboot(const double *arg)
{
    (void)arg;
    micron_head_boot(&sim.head, pace_ns());
    return NULL;
}

static const char *do_pose(const double *arg)
{
    memcpy(sim.position_m, arg, sizeof sim.position_m);
    sim.yaw_deg = arg[3];
    return NULL;
}

static const char *do_split(const double *arg)
{
    sim.line.faults.split = arg[0] != 0.0;
    return NULL;
}

static const char *do_nibbles(const double *arg)
{
    sim.head.faults.nibbles = arg[0] != 0.0;
    return NULL;
}

static const char *do_packets(const double *arg)
{
    sim.head.faults.packets = arg[0] != 0.0;
    return NULL;
}

static const char *do_range(const double *arg)
{
    sim.head.faults.range_m = arg[0];
    return NULL;
}

/* A command either sets a count, or a time until which something lasts, or has a function. */
static const struct command {
    const char *name, *args, *what;
    int n_args;
    double lo, hi;
    uint64_t *count, *until_ns;
    const char *(*run)(const double *arg);
} commands[] = {
    {"drop", "N", "the next N frames are lost", 1, 0, 1e6, &sim.line.faults.drop, NULL, NULL},
    {"corrupt", "N", "the next N frames have one wrong bit", 1, 0, 1e6, &sim.line.faults.corrupt, NULL, NULL},
    {"short", "N", "the next N frames end in the middle", 1, 0, 1e6, &sim.line.faults.cut, NULL, NULL},
    {"garbage", "N", "N random bytes before the next frame", 1, 0, 60000, &sim.line.faults.garbage, NULL, NULL},
    {"motor", "N", "the next N lines tell a motor error", 1, 0, 1e6, &sim.head.faults.motor_errors, NULL, NULL},
    {"silent", "S", "say nothing for S seconds", 1, 0, 3600, NULL, &sim.line.faults.silent_ns, NULL},
    {"stall", "S", "do not read the line for S seconds", 1, 0, 3600, NULL, &sim.line.faults.stall_ns, NULL},
    {"flood", "S", "random bytes without a pause for S seconds", 1, 0, 3600, NULL, &sim.line.faults.flood_ns,
     NULL},
    {"split", "0|1", "one byte per write", 1, 0, 1, NULL, NULL, do_split},
    {"nibbles", "0|1", "4-bit echoes whatever is asked for", 1, 0, 1, NULL, NULL, do_nibbles},
    {"packets", "0|1", "lines in several packets", 1, 0, 1, NULL, NULL, do_packets},
    {"range", "M", "ping with a range of M metres whatever is asked for; 0: end that", 1, 0, 200, NULL, NULL,
     do_range},
    {"unplug", "", "pull the adapter: close the line, remove the link; the head keeps running", 0, 0, 0, NULL,
     NULL, do_unplug},
    {"plug", "", "put it back, as a new pseudo-terminal", 0, 0, 0, NULL, NULL, do_plug},
    {"reboot", "", "switch the head off and on", 0, 0, 0, NULL, NULL, do_reboot},
    {"pose", "N E D YAW", "move the vehicle there: metres, degrees", 4, -1e6, 1e6, NULL, NULL, do_pose},
};

static void print_status(FILE *out)
{
    const struct micron_head *head = &sim.head;
    fprintf(out, "%s, %s, bearing %u, %llu pings, %llu requests, %llu bytes sent, %llu lost",
            sim.line.fd < 0             ? "unplugged"
            : line_connected(&sim.line) ? "open"
                                        : "nobody there",
            head->scanning     ? "scanning"
            : head->configured ? "set up"
                               : "waiting",
            head->bearing, (unsigned long long)head->pings, (unsigned long long)head->requests,
            (unsigned long long)sim.line.sent_bytes, (unsigned long long)sim.line.lost_bytes);
}

static const char *command_do(const char *text)
{
    char copy[TEXT_MAX], *save = NULL, *end;
    double arg[4];
    int n = 0;
    const struct command *command = NULL;
    snprintf(copy, sizeof copy, "%s", text);
    const char *word = strtok_r(copy, " \t\r\n", &save);
    for (size_t i = 0; word != NULL && i < sizeof commands / sizeof commands[0]; i++)
        if (strcmp(commands[i].name, word) == 0)
            command = &commands[i];
    if (command == NULL)
        return "no such command; --help lists them";
    for (; (word = strtok_r(NULL, " \t\r\n", &save)) != NULL; n++) {
        if (n == command->n_args || (arg[n] = strtod(word, &end), *end != '\0') ||
            !(arg[n] >= command->lo && arg[n] <= command->hi))
            return "an argument too many, no number, or out of range; --help tells what it needs";
    }
    if (n != command->n_args)
        return "an argument is missing; --help tells what it needs";
    if (command->run != NULL)
        return command->run(arg);
    if (command->count != NULL)
        *command->count = (uint64_t)arg[0];
    else
        *command->until_ns = after(arg[0]);
    return NULL;
}

static void command_run(const char *text)
{
    if (strcmp(text, "quit") == 0) {
        stop_wanted = 1;
        printf("ok quit\n");
    } else if (strcmp(text, "status") == 0) {
        printf("ok status ");
        print_status(stdout);
        printf("\n");
    } else if (text[strspn(text, " \t\r")] != '\0') {
        const char *why = command_do(text);
        if (why != NULL)
            printf("error: %.60s: %s\n", text, why);
        else
            printf("ok %s\n", text);
    }
    fflush(stdout);
}

/* Whole lines from standard input. False at its end: the sim goes on without. */
static bool input_take(void)
{
    static char held_text[TEXT_MAX];
    static size_t held;
    ssize_t n = read(STDIN_FILENO, held_text + held, sizeof held_text - 1 - held);
    if (n <= 0)
        return n < 0 && (errno == EINTR || errno == EAGAIN);
    held += (size_t)n;
    held_text[held] = '\0';
    for (char *newline; (newline = strchr(held_text, '\n')) != NULL;) {
        *newline = '\0';
        command_run(held_text);
        held -= (size_t)(newline + 1 - held_text);
        memmove(held_text, newline + 1, held + 1);
    }
    if (held == sizeof held_text - 1)
        held = 0; /* no command is that long */
    return true;
}

/* ---- command line ---- */

static void print_help(void)
{
    printf("micron_sim - a virtual Tritech Micron scanning sonar on a pseudo-terminal\n\n"
           "  micron_sim --link /tmp/sonar --scene harbour --print\n\n"
           "Open /tmp/sonar as if it were the sonar's serial port. Options, with their defaults:\n"
           "  --link PATH           make a symbolic link to the terminal; removed at the end\n"
           "  --scene NAME|FILE     what stands in the water (box); ping360_sim --help tells what a file holds\n"
           "  --pose N,E,D,YAW      of the vehicle, metres and degrees (0,0,0,0)\n"
           "  --seed N              of noise and speckle (1)\n"
           "  --noise COUNTS        noise floor, on the scale of ping360_sim; 0: none (8)\n"
           "  --ghost RATIO         pressure of ghost echoes, 0 to 1 (0.5)\n"
           "  --sound-speed M/S     of the water (1500)\n"
           "  --baud N              of the line; 0: as the host has set it (0)\n"
           "  --serial N            serial number (1234)\n"
           "  --plain               an older head, no DST\n"
           "  --centring S          after switching on (8)\n"
           "  --ms-per-gradian MS   of the motor (10)\n"
           "  --processing-ms MS    from the last sample to the first byte (5)\n"
           "  --truth FILE          write what is really there, one JSON object per ping\n"
           "  --print               status on standard error, every second\n"
           "  --help                this text\n\n"
           "Scenes:\n");
    scene_print_builtin(stdout);
    printf("Commands on standard input, each answered by a line \"ok COMMAND\" or \"error: ...\":\n");
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        printf("  %-7s %-9s  %s\n", commands[i].name, commands[i].args, commands[i].what);
    printf("  status             what the head is doing\n"
           "  quit               end, as SIGTERM and SIGINT do\n");
}

struct options {
    const char *link, *scene, *truth;
    struct micron_head_conf head;
    unsigned baud;
    bool print;
};

static double number(const char *option, const char *text, double lo, double hi)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= lo && value <= hi))
        die("--%s %s: expected a number in [%g, %g]", option, text, lo, hi);
    return value;
}

static void pose_parse(const char *text)
{
    double *p = sim.position_m;
    int used = 0;
    if (sscanf(text, "%lf,%lf,%lf,%lf%n", &p[0], &p[1], &p[2], &sim.yaw_deg, &used) != 4 || text[used] != '\0' ||
        !isfinite(p[0] + p[1] + p[2] + sim.yaw_deg))
        die("--pose %s: expected NORTH,EAST,DOWN,YAW in metres and degrees", text);
}

static void options_parse(struct options *o, int argc, char **argv)
{
    static const struct option names[] = {
        {"link", 1, NULL, 0},          {"scene", 1, NULL, 0},    {"pose", 1, NULL, 0},
        {"seed", 1, NULL, 0},          {"noise", 1, NULL, 0},    {"ghost", 1, NULL, 0},
        {"sound-speed", 1, NULL, 0},   {"baud", 1, NULL, 0},     {"serial", 1, NULL, 0},
        {"plain", 0, NULL, 0},         {"centring", 1, NULL, 0}, {"ms-per-gradian", 1, NULL, 0},
        {"processing-ms", 1, NULL, 0}, {"truth", 1, NULL, 0},    {"print", 0, NULL, 0},
        {"help", 0, NULL, 0},          {NULL, 0, NULL, 0}};
    *o = (struct options){.scene = "box",
                          .head = {.serial = 1234, .centring_s = 8, .ms_per_gradian = 10, .processing_ms = 5}};
    sim.water = (struct water){1500.0, 8.0, 0.5, 1};
    for (int c, i = 0; (c = getopt_long(argc, argv, "", names, &i)) != -1;) {
        if (c != 0) { /* getopt has said why */
            fprintf(stderr, "micron_sim --help tells the rest\n");
            exit(2);
        }
        const char *name = names[i].name;
        if (strcmp(name, "link") == 0)
            o->link = optarg;
        else if (strcmp(name, "scene") == 0)
            o->scene = optarg;
        else if (strcmp(name, "pose") == 0)
            pose_parse(optarg);
        else if (strcmp(name, "seed") == 0)
            sim.water.seed = (uint64_t)number(name, optarg, 0, 1e15);
        else if (strcmp(name, "noise") == 0)
            sim.water.noise_counts = number(name, optarg, 0, 200);
        else if (strcmp(name, "ghost") == 0)
            sim.water.ghost = number(name, optarg, 0, 1);
        else if (strcmp(name, "sound-speed") == 0)
            sim.water.sound_speed_mps = number(name, optarg, 1000, 2000);
        else if (strcmp(name, "baud") == 0)
            o->baud = (unsigned)number(name, optarg, 0, 4e6);
        else if (strcmp(name, "serial") == 0)
            o->head.serial = (uint16_t)number(name, optarg, 0, 65535);
        else if (strcmp(name, "plain") == 0)
            o->head.plain = true;
        else if (strcmp(name, "centring") == 0)
            o->head.centring_s = number(name, optarg, 0, 60);
        else if (strcmp(name, "ms-per-gradian") == 0)
            o->head.ms_per_gradian = number(name, optarg, 0, 1000);
        else if (strcmp(name, "processing-ms") == 0)
            o->head.processing_ms = number(name, optarg, 0, 10000);
        else if (strcmp(name, "truth") == 0)
            o->truth = optarg;
        else if (strcmp(name, "print") == 0)
            o->print = true;
        else
            print_help(), exit(0);
    }
    if (optind < argc)
        die("'%s' is too much; --help tells the rest", argv[optind]);
}

/* ---- running ---- */

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/* Take what the host sent, do what is due; when to call again. */
static uint64_t turn(uint64_t now_ns)
{
    uint8_t bytes[4096];
    size_t n;
    while ((n = line_read(&sim.line, bytes, sizeof bytes, now_ns)) > 0)
        micron_head_feed(&sim.head, bytes, n, now_ns);
    micron_head_tick(&sim.head, now_ns);
    uint64_t due_ns = earlier(line_pump(&sim.line, now_ns), micron_head_deadline(&sim.head));
    if (now_ns < sim.line.faults.stall_ns)
        return earlier(due_ns, sim.line.faults.stall_ns);
    return line_connected(&sim.line) ? due_ns : earlier(due_ns, now_ns + LINE_OPEN_NS);
}

/* Sleep until due_ns, a byte from the host, a command or a signal. */
static void wait_for(bool *input, uint64_t due_ns, const sigset_t *mask)
{
    /* A line that nobody has open, or that is stalled, would wake us without end. */
    const bool listens = line_connected(&sim.line) && pace_ns() >= sim.line.faults.stall_ns;

    if (pace_wait(*input ? STDIN_FILENO : -1, listens ? sim.line.fd : -1, due_ns, mask))
        *input = input_take();
}

static void run(bool print, const sigset_t *mask)
{
    bool input = true;
    uint64_t next_status_ns = sim.start_ns;
    while (!stop_wanted) {
        uint64_t now_ns = pace_ns();
        if (print && now_ns >= next_status_ns) {
            fprintf(stderr, "\r");
            print_status(stderr);
            fprintf(stderr, "\033[K");
            next_status_ns = now_ns + STATUS_EVERY_NS;
        }
        wait_for(&input, earlier(turn(now_ns), now_ns + STATUS_EVERY_NS), mask);
    }
    if (print)
        fprintf(stderr, "\n");
}

/* Signals are let in only while waiting, so none is missed. */
static void signals_prepare(sigset_t *waiting)
{
    struct sigaction action = {.sa_handler = on_stop};
    sigset_t blocked;
    sigemptyset(&blocked);
    sigaddset(&blocked, SIGTERM);
    sigaddset(&blocked, SIGINT);
    sigaddset(&blocked, SIGHUP);
    sigprocmask(SIG_BLOCK, &blocked, waiting);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGTTIN, SIG_IGN); /* in the background of a shell reading fails, and all goes on without commands */
}

int main(int argc, char **argv)
{
    const struct micron_head_io io = {.send = on_send, .listen = on_listen};
    struct options o;
    sigset_t waiting;
    struct fault fault;
    options_parse(&o, argc, argv);
    signals_prepare(&waiting);
    o.head.sound_speed_mps = sim.water.sound_speed_mps;
    if (!scene_load(&sim.scene, o.scene, &fault))
        die("%s", fault.text);
    if (!line_init(&sim.line, o.link, o.baud, sim.water.seed))
        die("--link: longer than %d bytes", LINE_PATH_MAX - 1);
    if (o.truth != NULL && (sim.truth = fopen(o.truth, "w")) == NULL)
        die("%s: %s", o.truth, strerror(errno));
    if (!line_plug(&sim.line, &fault))
        die("%s", fault.text);
    sim.start_ns = pace_ns();
    micron_head_init(&sim.head, &o.head, &io, sim.start_ns);
    printf("ready %s\n", o.link != NULL ? o.link : sim.line.slave);
    fflush(stdout);
    run(o.print, &waiting);
    line_unplug(&sim.line);
    if (sim.truth != NULL)
        fclose(sim.truth);
    return 0;
}
