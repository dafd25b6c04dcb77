/* SPDX-License-Identifier: MIT */
/* twin - see twin.h. */
#include "twin.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/fault.h"
#include "grid/geometry.h"
#include "console.h"
#include "pace.h"

#define LINE_OPEN_NS 10000000u /* how often to look whether somebody has opened the line */
#define IDLE_NS      1000000000u
#define TEXT_MAX     256

struct twin twin;

static const struct twin_ops *twin_ops;
static volatile sig_atomic_t stop_wanted;

static void on_stop(int signal)
{
    (void)signal;
    stop_wanted = 1;
}

void twin_send(const void *bytes, size_t n, uint64_t now_ns)
{
    line_send(&twin.line, bytes, n, now_ns);
}

void twin_listen(double az_deg, double range_m, double pulse_s, uint32_t n, unsigned full_scale, uint64_t now_ns,
                 uint8_t *counts)
{
    struct water_shot shot = {
        .az_rad = geo_rad(az_deg + twin.yaw_deg),
        .t_s = (double)(now_ns - twin.start_ns) * 1e-9,
        .sample_s = 2.0 * range_m / 1500.0 / n,
        .transmit_s = pulse_s,
        .frequency_hz = 675e3,
        .gain = 1,
        .n_samples = n,
        .number = twin.pings++,
    };
    memcpy(shot.origin_m, twin.position_m, sizeof shot.origin_m);
    water_listen(&twin.water, &twin.scene, &shot, counts);
    for (uint32_t i = 0; i < n; i++) { /* the water counts the root of pressure */
        const double root = counts[i] / 255.0;
        counts[i] = (uint8_t)lround(root * root * full_scale);
    }
}

/* ---- commands ---- */

static const struct line_fault {
    const char *name, *what;
    uint64_t *count, *until_ns;
} faults[] = {
    {"drop", "the next N frames are lost", &twin.line.faults.drop, NULL},
    {"corrupt", "the next N frames have one wrong bit", &twin.line.faults.corrupt, NULL},
    {"short", "the next N frames end in the middle", &twin.line.faults.cut, NULL},
    {"garbage", "N random bytes before the next frame", &twin.line.faults.garbage, NULL},
    {"silent", "say nothing for N seconds", NULL, &twin.line.faults.silent_ns},
    {"stall", "do not read the line for N seconds", NULL, &twin.line.faults.stall_ns},
    {"flood", "random bytes without a pause for N seconds", NULL, &twin.line.faults.flood_ns},
};

static bool command_fault(const char *line)
{
    char name[16];
    double value;
    int used = 0;
    if (sscanf(line, "%15s %lf%n", name, &value, &used) != 2 || line[used] != '\0' ||
        !(value >= 0 && value <= 1e6))
        return false;
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        if (strcmp(faults[i].name, name) != 0)
            continue;
        if (faults[i].count)
            *faults[i].count = (uint64_t)value;
        else
            *faults[i].until_ns = pace_ns() + (uint64_t)(value * 1e9);
        return true;
    }
    return false;
}

static bool parse_pose(const char *text, const char *format)
{
    double *p = twin.position_m;
    int used = 0;
    return sscanf(text, format, &p[0], &p[1], &p[2], &twin.yaw_deg, &used) == 4 && text[used] == '\0';
}

static bool command_run(void *ctx, const char *line)
{
    struct fault fault;
    (void)ctx;
    if (strcmp(line, "quit") == 0)
        stop_wanted = 1;
    else if (strcmp(line, "unplug") == 0)
        line_unplug(&twin.line);
    else if (strcmp(line, "plug") == 0)
        return twin.line.fd < 0 && line_plug(&twin.line, &fault);
    else if (strncmp(line, "pose ", 5) == 0)
        return parse_pose(line + 5, "%lf %lf %lf %lf%n");
    else if (strcmp(line, "split 0") == 0 || strcmp(line, "split 1") == 0)
        twin.line.faults.split = line[6] == '1';
    else
        return strcmp(line, "status") == 0 || command_fault(line);
    return true;
}

static const char *status(void *ctx)
{
    static char text[TEXT_MAX];
    (void)ctx;
    snprintf(text, sizeof text, "%s, %llu pings, %llu bytes sent, %llu lost",
             twin.line.fd < 0             ? "unplugged"
             : line_connected(&twin.line) ? "open"
                                          : "nobody there",
             (unsigned long long)twin.pings, (unsigned long long)twin.line.sent_bytes,
             (unsigned long long)twin.line.lost_bytes);
    return text;
}

static void print_help(void)
{
    printf("%s - %s\n\n"
           "  --link PATH        make a symbolic link to the terminal; removed at the end\n"
           "  --scene NAME|FILE  what stands in the water (box); ping360_sim --help tells what a file holds\n"
           "  --pose N,E,D,YAW   of the vehicle, metres and degrees (0,0,0,0)\n"
           "  --seed N           of noise and speckle (1)\n"
           "  --noise COUNTS     noise floor, on the scale of ping360_sim; 0: none (8)\n"
           "  --baud N           of the line; 0: as the host has set it (0)\n"
           "%s"
           "  --help             this text\n\n"
           "Commands on standard input, each answered by a line \"ok COMMAND STATUS\" or \"error: ...\":\n",
           twin_ops->name, twin_ops->what, twin_ops->options);
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++)
        printf("  %-7s N   %s\n", faults[i].name, faults[i].what);
    printf("  split 0|1   one byte per write\n"
           "  unplug, plug, pose N E D YAW, status, quit\n");
}

/* ---- command line ---- */

static bool option_take(const char *name, const char *value, const char **link, const char **scene, unsigned *baud)
{
    if (strcmp(name, "--link") == 0)
        *link = value;
    else if (strcmp(name, "--scene") == 0)
        *scene = value;
    else if (strcmp(name, "--pose") == 0)
        return parse_pose(value, "%lf,%lf,%lf,%lf%n");
    else if (strcmp(name, "--seed") == 0)
        twin.water.seed = strtoull(value, NULL, 10);
    else if (strcmp(name, "--noise") == 0)
        twin.water.noise_counts = strtod(value, NULL);
    else if (strcmp(name, "--baud") == 0)
        *baud = (unsigned)strtoul(value, NULL, 10);
    else
        return twin_ops->option(name, value);
    return true;
}

static int begin(int argc, char **argv)
{
    const char *link = NULL, *scene = "box";
    unsigned baud = 0;
    struct fault fault;
    twin.water = (struct water){.sound_speed_mps = 1500.0, .noise_counts = 8.0, .ghost = 0.5, .seed = 1};
    for (int i = 1; i < argc; i += 2) {
        if (strcmp(argv[i], "--help") == 0) {
            print_help();
            exit(0);
        }
        if (i + 1 == argc || !option_take(argv[i], argv[i + 1], &link, &scene, &baud)) {
            fprintf(stderr, "%s: %s: unknown, or not so; --help tells the rest\n", twin_ops->name, argv[i]);
            return 2;
        }
    }
    if (!scene_load(&twin.scene, scene, &fault) ||
        (!line_init(&twin.line, link, baud, twin.water.seed) && fault_set(&fault, "--link: too long")) ||
        !line_plug(&twin.line, &fault)) {
        fprintf(stderr, "%s: %s\n", twin_ops->name, fault.text);
        return 2;
    }
    printf("ready %s\n", link ? link : twin.line.slave);
    fflush(stdout);
    return 0;
}

/* ---- running ---- */

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

static uint64_t turn(uint64_t now_ns)
{
    uint8_t bytes[4096];
    size_t n;
    while ((n = line_read(&twin.line, bytes, sizeof bytes, now_ns)) > 0)
        twin_ops->feed(bytes, n, now_ns);
    const uint64_t tick_ns = twin_ops->tick(now_ns);
    const uint64_t due_ns = earlier(earlier(line_pump(&twin.line, now_ns), tick_ns), now_ns + IDLE_NS);
    return line_connected(&twin.line) ? due_ns : earlier(due_ns, now_ns + LINE_OPEN_NS);
}

int twin_main(int argc, char **argv, const struct twin_ops *ops)
{
    struct sigaction action = {.sa_handler = on_stop};
    sigset_t blocked, waiting;
    bool input = true;
    twin_ops = ops;
    sigemptyset(&blocked);
    sigaddset(&blocked, SIGTERM);
    sigaddset(&blocked, SIGINT);
    sigprocmask(SIG_BLOCK, &blocked, &waiting); /* let in only while waiting, so none is missed */
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    signal(SIGTTIN, SIG_IGN); /* in the background of a shell reading fails, and all goes on without commands */
    twin.start_ns = pace_ns();
    const int failed = begin(argc, argv);
    if (failed)
        return failed;
    while (!stop_wanted) {
        const uint64_t due_ns = turn(pace_ns());
        const bool listens = line_connected(&twin.line) && pace_ns() >= twin.line.faults.stall_ns;
        if (pace_wait(input ? STDIN_FILENO : -1, listens ? twin.line.fd : -1, due_ns, &waiting))
            input = console_read(command_run, status, NULL);
    }
    line_unplug(&twin.line);
    return 0;
}
