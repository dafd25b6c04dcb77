/* SPDX-License-Identifier: MIT */
/*
 * ping360_sim - a virtual Ping360 on a pseudo-terminal or a UDP port, for tests and for people without a sonar. Reads
 * the command line, then runs the sim on the monotonic clock; commands come on standard input, one per line, and each
 * is answered by one line on standard output.
 */
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/fault.h"
#include "tests/sim/lib/pace.h"
#include "tests/sim/lib/sim.h"

#define MAX_TIMED       32
#define STATUS_EVERY_NS 1000000000u

struct timed_command {
    double at_s;
    const char *text;
};

struct options {
    const char *link, *scene, *truth;
    int udp_port; /* LINE_NO_UDP: a pseudo-terminal */
    struct head_conf head;
    struct sim_pose pose;
    struct sim_frame frame;
    double noise_counts, ghost;
    uint64_t seed;
    unsigned baud;
    bool print;
    int n_timed;
    struct timed_command timed[MAX_TIMED]; /* in order of time once parsed */
};

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
    fprintf(stderr, "ping360_sim: ");
    vfprintf(stderr, fmt, args);
    fprintf(stderr, "\n");
    va_end(args);
    exit(2);
}

/* ---- command line ---- */

enum {
    OPT_LINK = 1000,
    OPT_UDP,
    OPT_SCENE,
    OPT_POSE,
    OPT_FRAME,
    OPT_SEED,
    OPT_NOISE,
    OPT_GHOST,
    OPT_SOUND_SPEED,
    OPT_BAUD,
    OPT_FIRMWARE,
    OPT_ID,
    OPT_LAG,
    OPT_MS_PER_GRADIAN,
    OPT_PROCESSING_MS,
    OPT_STRICT_AUTOBAUD,
    OPT_TRUTH,
    OPT_AT,
    OPT_PRINT,
    OPT_HELP,
};

static const struct option long_options[] = {
    {"link", required_argument, NULL, OPT_LINK},
    {"udp", required_argument, NULL, OPT_UDP},
    {"scene", required_argument, NULL, OPT_SCENE},
    {"pose", required_argument, NULL, OPT_POSE},
    {"frame", required_argument, NULL, OPT_FRAME},
    {"seed", required_argument, NULL, OPT_SEED},
    {"noise", required_argument, NULL, OPT_NOISE},
    {"ghost", required_argument, NULL, OPT_GHOST},
    {"sound-speed", required_argument, NULL, OPT_SOUND_SPEED},
    {"baud", required_argument, NULL, OPT_BAUD},
    {"firmware", required_argument, NULL, OPT_FIRMWARE},
    {"id", required_argument, NULL, OPT_ID},
    {"lag", required_argument, NULL, OPT_LAG},
    {"ms-per-gradian", required_argument, NULL, OPT_MS_PER_GRADIAN},
    {"processing-ms", required_argument, NULL, OPT_PROCESSING_MS},
    {"strict-autobaud", no_argument, NULL, OPT_STRICT_AUTOBAUD},
    {"truth", required_argument, NULL, OPT_TRUTH},
    {"at", required_argument, NULL, OPT_AT},
    {"print", no_argument, NULL, OPT_PRINT},
    {"help", no_argument, NULL, OPT_HELP},
    {NULL, 0, NULL, 0},
};

static void print_help(void)
{
    printf("ping360_sim - a virtual Ping360 scanning sonar on a pseudo-terminal\n\n"
           "  ping360_sim --link /tmp/sonar --scene harbour --print\n\n"
           "Open /tmp/sonar as if it were the sonar's serial port. Options, with their defaults:\n"
           "  --link PATH            make a symbolic link to the terminal; removed at the end\n"
           "  --udp PORT             a UDP port of 127.0.0.1 instead of a terminal; 0: any that is free\n"
           "  --scene NAME|FILE      what stands in the water (box)\n"
           "  --pose N,E,D,YAW       of the vehicle, metres and degrees (0,0,0,0)\n"
           "  --frame AZ,WIDTH,RANGE a bar of the vehicle's own frame: degrees from the bow, metres (none)\n"
           "  --seed N               of noise and speckle (1)\n"
           "  --noise COUNTS         mean of the noise floor at 1 m; 0: none (8)\n"
           "  --ghost RATIO          pressure of ghost echoes, 0 to 1 (0.5)\n"
           "  --sound-speed M/S      of the water (1500)\n"
           "  --baud N               of the line; 0: as the host has set it (0)\n"
           "  --firmware new|old     old refuses auto_transmit and motor_off (new)\n"
           "  --id N                 device id, 1 to 254 (2)\n"
           "  --lag N                pings that still come with the old settings after a change (2)\n"
           "  --ms-per-gradian MS    of the motor (6)\n"
           "  --processing-ms MS     from the last sample to the first byte (18)\n"
           "  --strict-autobaud      deaf until a 'U' has come\n"
           "  --truth FILE           write what is really there, one JSON object per ping\n"
           "  --at SECONDS:COMMAND   do a command so long after the start; may be repeated\n"
           "  --print                status on standard error, every second\n"
           "  --help                 this text\n\n"
           "Scenes:\n");
    scene_print_builtin(stdout);
    printf("A scene file has one shape per line (north, east, down in metres; degrees):\n"
           "  box XMIN XMAX YMIN YMAX ZMIN ZMAX    walls of a room; a block when seen from outside\n"
           "  cylinder X Y RADIUS                  vertical pile\n"
           "  slope DISTANCE AZIMUTH ELEVATION     plane; its nearest point to the origin lies there\n"
           "  pile X Y RADIUS VX VY                vertical pile that moves\n\n"
           "Commands on standard input, each answered by a line \"ok COMMAND\" or \"error: WHY\":\n");
    sim_print_commands(stdout);
    printf("  status             what the head is doing\n"
           "  quit               end, as SIGTERM and SIGINT do\n");
}

static double number(const char *option, const char *text, double lo, double hi)
{
    char *end;
    double value = strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= lo && value <= hi))
        die("--%s %s: expected a number in [%g, %g]", option, text, lo, hi);
    return value;
}

static struct sim_pose pose_parse(const char *text)
{
    struct sim_pose pose;
    double *p = pose.position_m;
    int used = 0;
    if (sscanf(text, "%lf,%lf,%lf,%lf%n", &p[0], &p[1], &p[2], &pose.yaw_deg, &used) != 4 || text[used] != '\0' ||
        !isfinite(p[0] + p[1] + p[2] + pose.yaw_deg))
        die("--pose %s: expected NORTH,EAST,DOWN,YAW in metres and degrees", text);
    return pose;
}

static struct sim_frame frame_parse(const char *text)
{
    struct sim_frame f;
    char rest;
    if (sscanf(text, "%lf,%lf,%lf%c", &f.azimuth_deg, &f.width_deg, &f.range_m, &rest) != 3 ||
        !(fabs(f.azimuth_deg) <= 360 && f.width_deg > 0 && f.width_deg <= 360 && f.range_m > 0 && f.range_m <= 50))
        die("--frame %s: expected azimuth and width in degrees, range in metres, as 200,20,0.8", text);
    return f;
}

static void timed_add(struct options *o, const char *text)
{
    char *end;
    double at_s = strtod(text, &end);
    int i = o->n_timed;
    if (end == text || *end != ':' || !(at_s >= 0.0 && at_s <= 1e6))
        die("--at %s: expected SECONDS:COMMAND", text);
    if (o->n_timed == MAX_TIMED)
        die("--at: at most %d", MAX_TIMED);
    for (; i > 0 && o->timed[i - 1].at_s > at_s; i--)
        o->timed[i] = o->timed[i - 1];
    o->timed[i] = (struct timed_command){at_s, end + 1};
    o->n_timed++;
}

static void option_take(struct options *o, int option, const char *text)
{
    switch (option) {
    case OPT_LINK:
        o->link = text;
        break;
    case OPT_UDP:
        o->udp_port = (int)number("udp", text, 0, 65535);
        break;
    case OPT_SCENE:
        o->scene = text;
        break;
    case OPT_POSE:
        o->pose = pose_parse(text);
        break;
    case OPT_FRAME:
        o->frame = frame_parse(text);
        break;
    case OPT_SEED:
        o->seed = (uint64_t)number("seed", text, 0, 1e15);
        break;
    case OPT_NOISE:
        o->noise_counts = number("noise", text, 0, 200);
        break;
    case OPT_GHOST:
        o->ghost = number("ghost", text, 0, 1);
        break;
    case OPT_SOUND_SPEED:
        o->head.sound_speed_mps = number("sound-speed", text, 1000, 2000);
        break;
    case OPT_BAUD:
        o->baud = (unsigned)number("baud", text, 0, 4e6);
        break;
    case OPT_FIRMWARE:
        if (strcmp(text, "old") != 0 && strcmp(text, "new") != 0)
            die("--firmware %s: expected new or old", text);
        o->head.old_firmware = strcmp(text, "old") == 0;
        break;
    case OPT_ID:
        o->head.id = (uint8_t)number("id", text, 1, 254);
        break;
    case OPT_LAG:
        o->head.lag = (unsigned)number("lag", text, 0, 1000);
        break;
    case OPT_MS_PER_GRADIAN:
        o->head.ms_per_gradian = number("ms-per-gradian", text, 0, 1000);
        break;
    case OPT_PROCESSING_MS:
        o->head.processing_ms = number("processing-ms", text, 0, 10000);
        break;
    case OPT_STRICT_AUTOBAUD:
        o->head.strict_autobaud = true;
        break;
    case OPT_TRUTH:
        o->truth = text;
        break;
    case OPT_AT:
        timed_add(o, text);
        break;
    case OPT_PRINT:
        o->print = true;
        break;
    case OPT_HELP:
        print_help();
        exit(0);
    default: /* getopt has said why */
        fprintf(stderr, "ping360_sim --help tells the rest\n");
        exit(2);
    }
}

static void options_parse(struct options *o, int argc, char **argv)
{
    /* The times are those of measured full turns: 10.7 s at 2 m, 20.6 s at 20 m, 3.3 s at 2 m and 10 gradians. */
    *o = (struct options){
        .scene = "box",
        .udp_port = LINE_NO_UDP,
        .head = {.id = 2, .lag = 2, .ms_per_gradian = 6.0, .processing_ms = 18.0, .sound_speed_mps = 1500.0},
        .noise_counts = 8.0,
        .ghost = 0.5,
        .seed = 1,
    };
    for (int option; (option = getopt_long(argc, argv, "", long_options, NULL)) != -1;)
        option_take(o, option, optarg);
    if (optind < argc)
        die("'%s' is too much; --help tells the rest", argv[optind]);
}

/* ---- running ---- */

static void command_run(struct sim *sim, const char *text)
{
    char answer[SIM_ANSWER_MAX];
    if (strcmp(text, "quit") == 0) {
        stop_wanted = 1;
        printf("ok quit\n");
    } else if (strcmp(text, "status") == 0) {
        printf("ok status ");
        sim_print_status(sim, stdout);
        printf("\n");
    } else if (text[strspn(text, " \t\r")] != '\0') {
        sim_command(sim, text, pace_ns(), answer, sizeof answer);
        printf("%s\n", answer);
    }
    fflush(stdout);
}

/* Whole lines from standard input. False at its end: the sim goes on without. */
static bool input_take(struct sim *sim)
{
    static char line[SIM_ANSWER_MAX];
    static size_t held;
    ssize_t n = read(STDIN_FILENO, line + held, sizeof line - 1 - held);
    if (n <= 0)
        return n < 0 && (errno == EINTR || errno == EAGAIN);
    held += (size_t)n;
    line[held] = '\0';
    for (char *newline; (newline = strchr(line, '\n')) != NULL;) {
        *newline = '\0';
        command_run(sim, line);
        held -= (size_t)(newline + 1 - line);
        memmove(line, newline + 1, held + 1);
    }
    if (held == sizeof line - 1)
        held = 0; /* no command is that long */
    return true;
}

/* Sleep until due_ns, a byte from the host, a command or a signal. */
static void wait_for(struct sim *sim, bool *input, uint64_t due_ns, const sigset_t *mask)
{
    /* A line that nobody has open, or that is stalled, would wake us without end. */
    const bool listens = line_connected(&sim->line) && pace_ns() >= sim->line.faults.stall_ns;

    if (pace_wait(*input ? STDIN_FILENO : -1, listens ? sim->line.fd : -1, due_ns, mask))
        *input = input_take(sim);
}

static void run(struct sim *sim, const struct options *o, const sigset_t *mask)
{
    bool input = true;
    int next_timed = 0;
    uint64_t next_status_ns = sim->start_ns;
    while (!stop_wanted) {
        uint64_t now_ns = pace_ns();
        uint64_t due_ns = now_ns + STATUS_EVERY_NS;
        for (; next_timed < o->n_timed; next_timed++) {
            uint64_t at_ns = sim->start_ns + (uint64_t)(o->timed[next_timed].at_s * 1e9);
            if (at_ns > now_ns) {
                due_ns = at_ns < due_ns ? at_ns : due_ns;
                break;
            }
            command_run(sim, o->timed[next_timed].text);
        }
        if (o->print && now_ns >= next_status_ns) {
            fprintf(stderr, "\r");
            sim_print_status(sim, stderr);
            fprintf(stderr, "\033[K");
            next_status_ns = now_ns + STATUS_EVERY_NS;
        }
        uint64_t turn_ns = sim_turn(sim, now_ns);
        wait_for(sim, &input, turn_ns < due_ns ? turn_ns : due_ns, mask);
    }
    if (o->print)
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
    static struct sim sim;
    struct options o;
    sigset_t waiting;
    struct fault fault;
    options_parse(&o, argc, argv);
    signals_prepare(&waiting);
    sim.pose = o.pose;
    sim.frame = o.frame;
    sim.water = (struct water){o.head.sound_speed_mps, o.noise_counts, o.ghost, o.seed};
    if (!scene_load(&sim.scene, o.scene, &fault))
        die("%s", fault.text);
    if (!line_init(&sim.line, o.link, o.baud, o.seed))
        die("--link: longer than %d bytes", LINE_PATH_MAX - 1);
    line_use_udp(&sim.line, o.udp_port);
    if (o.truth != NULL && (sim.truth = fopen(o.truth, "w")) == NULL)
        die("%s: %s", o.truth, strerror(errno));
    if (!line_plug(&sim.line, &fault))
        die("%s", fault.text);
    sim_start(&sim, &o.head, pace_ns());
    printf("ready %s\n", o.link != NULL && o.udp_port == LINE_NO_UDP ? o.link : sim.line.slave);
    fflush(stdout);
    run(&sim, &o, &waiting);
    line_unplug(&sim.line);
    if (sim.truth != NULL)
        fclose(sim.truth);
    return 0;
}
