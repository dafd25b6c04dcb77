/* SPDX-License-Identifier: MIT */
/*
 * can_sim - virtual sonars on a CAN bus: a DroneCAN range sensor and an NMEA 2000 depth transducer, for tests and for
 * people without them. Speaks on an interface, or writes a log as candump -L does where there is no CAN. Commands that
 * make faults come on standard input, one per line, and each is answered by one line on standard output.
 */
#include <errno.h>
#include <getopt.h>
#include <linux/can/error.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/ports/can_frame.h"
#include "drivers/devices/dronecan.h"
#include "drivers/ports/port.h"

#define SECOND 1000000000u

/* So many of the next messages have this wrong. */
enum sim_fault { DROP, CORRUPT, DUPLICATE, REORDER, TOO_CLOSE, TOO_FAR, UNAVAILABLE, N_FAULTS };
static const char *const fault_names[N_FAULTS] = {
    [DROP] = "drop",           [CORRUPT] = "corrupt", [DUPLICATE] = "duplicate",    [REORDER] = "reorder",
    [TOO_CLOSE] = "too_close", [TOO_FAR] = "too_far", [UNAVAILABLE] = "unavailable"};

struct talker {
    uint64_t period_ns, next_ns;
    uint8_t transfer;
    uint64_t messages;
};

struct sim {
    const char *interface;
    struct port port; /* unused with log */
    bool log, fd;
    int node, address; /* of the DroneCAN sensor, of the NMEA 2000 one; -1: silent */
    int sensor_id;
    double range_m, noise_m, speed_mps, field_of_view_rad;
    double seconds; /* ends after so long; 0: never */
    double load_hz; /* frames of others per second */
    uint64_t random, start_ns, silent_until_ns;
    struct talker dronecan, nmea2000, load;
    unsigned faults[N_FAULTS];
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
    fprintf(stderr, "can_sim: ");
    vfprintf(stderr, fmt, args);
    fprintf(stderr, "\n");
    va_end(args);
    exit(2);
}

static uint64_t clock_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * SECOND + (uint64_t)t.tv_nsec;
}

/* uniform in [-1, 1) */
static double shake(struct sim *s)
{
    s->random = s->random * 6364136223846793005u + 1442695040888963407u;
    return (double)(s->random >> 11) * 0x1p-52 - 1;
}

static bool faulty(struct sim *s, enum sim_fault fault)
{
    if (!s->faults[fault])
        return false;
    s->faults[fault]--;
    return true;
}

/* ---- the bus ---- */

static void log_frame(const struct sim *s, const struct canfd_frame *frame, bool fd, uint64_t now_ns)
{
    printf("(%010llu.%06llu) %s %08X#%s", (unsigned long long)(now_ns / SECOND),
           (unsigned long long)(now_ns % SECOND / 1000), s->interface, frame->can_id & CAN_EFF_MASK,
           fd ? "#1" : "");
    for (unsigned i = 0; i < frame->len; i++)
        printf("%02X", frame->data[i]);
    printf("\n");
}

static void put(struct sim *s, const struct canfd_frame *frame, bool fd, uint64_t now_ns)
{
    if (s->log) {
        log_frame(s, frame, fd, now_ns);
        return;
    }
    if (write(s->port.fd, frame, fd ? CANFD_MTU : CAN_MTU) < 0 && errno != ENOBUFS && errno != EAGAIN &&
        errno != ENETDOWN)
        die("%s: %s", s->interface, strerror(errno));
}

/* ---- DroneCAN ---- */

static uint16_t float16(double x)
{
    int exponent;
    double m = frexp(x, &exponent); /* 0.5 <= m < 1 */
    if (exponent < -13)
        return (uint16_t)lround(ldexp(x, 24));
    return (uint16_t)(((unsigned)(exponent + 14) << 10) + (unsigned)lround((m * 2 - 1) * 1024));
}

static void fill_measurement(struct sim *s, double range_m, uint64_t now_ns, uint8_t payload[15])
{
    const uint64_t timestamp_us = (now_ns - s->start_ns) / 1000 + 1;
    unsigned reading = DRONECAN_READING_VALID;
    uint16_t fov = float16(s->field_of_view_rad), range = float16(range_m);
    if (faulty(s, TOO_CLOSE))
        reading = DRONECAN_READING_TOO_CLOSE;
    else if (faulty(s, TOO_FAR))
        reading = DRONECAN_READING_TOO_FAR;
    for (int i = 0; i < 7; i++)
        payload[i] = (uint8_t)(timestamp_us >> 8 * i);
    payload[7] = (uint8_t)s->sensor_id;
    payload[8] = payload[9] = 0;
    payload[10] = (uint8_t)fov;
    payload[11] = (uint8_t)(fov >> 8);
    payload[12] = (uint8_t)(DRONECAN_SENSOR_SONAR << 3 | reading);
    payload[13] = (uint8_t)range;
    payload[14] = (uint8_t)(range >> 8);
}

/* One transfer in frames; their number. */
static unsigned split(const struct sim *s, const uint8_t *payload, size_t n, struct canfd_frame *frames)
{
    const canid_t id = CAN_EFF_FLAG | 16u << 24 | DRONECAN_MEASUREMENT_TYPE << 8 | (canid_t)(s->node & 0x7F);
    const uint8_t transfer = s->dronecan.transfer & 0x1F;
    uint8_t stream[2 + 15], signature[8];
    unsigned count = 0;
    if (s->fd) {
        frames[0] = (struct canfd_frame){.can_id = id, .len = (uint8_t)(n + 1), .flags = CANFD_BRS};
        memcpy(frames[0].data, payload, n);
        frames[0].data[n] = (uint8_t)(0xC0 | transfer);
        return 1;
    }
    for (int i = 0; i < 8; i++)
        signature[i] = (uint8_t)(DRONECAN_MEASUREMENT_SIGNATURE >> 8 * i);
    uint16_t crc = dronecan_crc(dronecan_crc(0xFFFF, signature, 8), payload, n);
    stream[0] = (uint8_t)crc;
    stream[1] = (uint8_t)(crc >> 8);
    memcpy(stream + 2, payload, n);
    n += 2;
    for (size_t at = 0; at < n; at += 7, count++) {
        size_t part = n - at < 7 ? n - at : 7;
        frames[count] = (struct canfd_frame){.can_id = id, .len = (uint8_t)(part + 1)};
        memcpy(frames[count].data, stream + at, part);
        frames[count].data[part] =
            (uint8_t)((at == 0 ? 0x80 : 0) | (at + part == n ? 0x40 : 0) | (count & 1 ? 0x20 : 0) | transfer);
    }
    return count;
}

static void talk_dronecan(struct sim *s, double range_m, uint64_t now_ns)
{
    struct canfd_frame frames[3];
    uint8_t payload[15];
    fill_measurement(s, range_m, now_ns, payload);
    unsigned n = split(s, payload, sizeof payload, frames);
    s->dronecan.transfer++;
    unsigned dropped = faulty(s, DROP) ? n / 2 : n;
    if (faulty(s, CORRUPT))
        frames[n - 1].data[0] ^= 0x10;
    if (n > 2 && faulty(s, REORDER)) {
        struct canfd_frame kept = frames[1];
        frames[1] = frames[2];
        frames[2] = kept;
    }
    for (int rounds = faulty(s, DUPLICATE) ? 2 : 1; rounds > 0; rounds--)
        for (unsigned i = 0; i < n; i++)
            if (i != dropped)
                put(s, &frames[i], s->fd, now_ns);
}

/* ---- NMEA 2000 ---- */

static void talk_nmea2000(struct sim *s, double range_m, uint64_t now_ns)
{
    uint32_t depth = faulty(s, UNAVAILABLE) ? 0xFFFFFFFFu : (uint32_t)lround(range_m * 100);
    struct canfd_frame frame = {.can_id = CAN_EFF_FLAG | 0x0DF50B00u | (canid_t)s->address, .len = 8};
    frame.data[0] = s->nmea2000.transfer++;
    for (int i = 0; i < 4; i++)
        frame.data[1 + i] = (uint8_t)(depth >> 8 * i);
    frame.data[5] = 0xFF; /* no offset, 100 m */
    frame.data[6] = 0x7F;
    frame.data[7] = 10;
    put(s, &frame, false, now_ns);
}

/* What else is said on a bus: groups of NMEA 2000 and other messages that are nobody's range. */
static void talk_load(struct sim *s, uint64_t now_ns)
{
    static const canid_t ids[] = {0x09F11223, 0x0DF11923, 0x15FD0823, 0x1001552A, 0x1803FC2A, 0x0DF50C23};
    struct canfd_frame frame = {.can_id = CAN_EFF_FLAG | ids[s->load.transfer++ % 6], .len = 8};
    for (int i = 0; i < 8; i++)
        frame.data[i] = (uint8_t)lround(127 + 127 * shake(s));
    put(s, &frame, false, now_ns);
}

/* ---- time ---- */

static double range_now(struct sim *s, uint64_t now_ns)
{
    double t_s = (double)(now_ns - s->start_ns) * 1e-9;
    return fmax(0.05, s->range_m + s->speed_mps * t_s + s->noise_m * shake(s));
}

static void run_talker(struct sim *s, struct talker *t, uint64_t now_ns)
{
    if (t->period_ns == 0 || now_ns < t->next_ns)
        return;
    t->next_ns += t->period_ns;
    if (now_ns < s->silent_until_ns)
        return;
    t->messages++;
    if (t == &s->dronecan)
        talk_dronecan(s, range_now(s, now_ns), now_ns);
    else if (t == &s->nmea2000)
        talk_nmea2000(s, range_now(s, now_ns), now_ns);
    else
        talk_load(s, now_ns);
}

static uint64_t next_due(const struct sim *s)
{
    const struct talker *talkers[] = {&s->dronecan, &s->nmea2000, &s->load};
    uint64_t due = UINT64_MAX;
    for (int i = 0; i < 3; i++)
        if (talkers[i]->period_ns && talkers[i]->next_ns < due)
            due = talkers[i]->next_ns;
    return due;
}

static void run_talkers(struct sim *s, uint64_t now_ns)
{
    run_talker(s, &s->dronecan, now_ns);
    run_talker(s, &s->nmea2000, now_ns);
    run_talker(s, &s->load, now_ns);
}

/* ---- commands ---- */

static const struct {
    const char *name;
    canid_t bits;
    uint8_t controller;
} errors[] = {
    {"busoff", CAN_ERR_BUSOFF, 0},
    {"restarted", CAN_ERR_RESTARTED, 0},
    {"warning", CAN_ERR_CRTL | CAN_ERR_CNT, CAN_ERR_CRTL_RX_WARNING},
    {"passive", CAN_ERR_CRTL | CAN_ERR_CNT, CAN_ERR_CRTL_RX_PASSIVE},
    {"active", CAN_ERR_CRTL | CAN_ERR_CNT, CAN_ERR_CRTL_ACTIVE},
};

static bool command_error(struct sim *s, const char *name, uint64_t now_ns)
{
    for (size_t i = 0; i < sizeof errors / sizeof errors[0]; i++) {
        if (strcmp(errors[i].name, name) != 0)
            continue;
        struct canfd_frame frame = {.can_id = CAN_ERR_FLAG | errors[i].bits, .len = 8};
        frame.data[1] = errors[i].controller;
        frame.data[6] = 11; /* counters of sent and received */
        frame.data[7] = 130;
        put(s, &frame, false, now_ns);
        return true;
    }
    return false;
}

static bool command(struct sim *s, const char *line, uint64_t now_ns)
{
    char word[32], argument[32];
    int n = sscanf(line, "%31s %31s", word, argument);
    double number = n == 2 ? strtod(argument, NULL) : 0;
    for (int f = 0; n == 2 && f < N_FAULTS; f++) {
        if (strcmp(word, fault_names[f]) == 0 && number >= 0 && number <= 1e6) {
            s->faults[f] = (unsigned)number;
            return true;
        }
    }
    if (n == 2 && strcmp(word, "range") == 0 && number > 0 && number < 65000)
        s->range_m = number;
    else if (n == 2 && strcmp(word, "silent") == 0 && number >= 0 && number <= 1e6)
        s->silent_until_ns = now_ns + (uint64_t)(number * SECOND);
    else if (n == 2 && strcmp(word, "sensor") == 0 && number >= 0 && number <= 255)
        s->sensor_id = (int)number;
    else if (n == 2 && strcmp(word, "error") == 0)
        return command_error(s, argument, now_ns);
    else if (n == 1 && strcmp(word, "quit") == 0)
        stop_wanted = 1;
    else
        return n == 1 && strcmp(word, "status") == 0;
    return true;
}

/* False at the end of the input. */
static bool read_command(struct sim *s, uint64_t now_ns)
{
    char line[128];
    if (!fgets(line, sizeof line, stdin))
        return false;
    line[strcspn(line, "\n")] = '\0';
    if (!command(s, line, now_ns))
        printf("error: '%s': no such command, or its argument is wrong; see --help\n", line);
    else
        printf("ok %s: %llu DroneCAN, %llu NMEA 2000 messages\n", line, (unsigned long long)s->dronecan.messages,
               (unsigned long long)s->nmea2000.messages);
    fflush(stdout);
    return true;
}

/* ---- the program ---- */

static void print_help(void)
{
    printf("can_sim - virtual sonars on a CAN bus\n\n"
           "  can_sim --dronecan 42 --range 7.25 vcan0\n"
           "  can_sim --nmea2000 35 --range 12 --log --seconds 60 can0 > sea.log\n\n"
           "Options, with their defaults:\n"
           "  --dronecan NODE     a DroneCAN range sensor with this node id\n"
           "  --sensor ID         its sensor_id (0)\n"
           "  --fd                in CAN FD frames\n"
           "  --rate HZ           its messages per second (10)\n"
           "  --nmea2000 ADDRESS  an NMEA 2000 depth transducer, one message per second\n"
           "  --nmea2000-rate HZ  or so many\n"
           "  --range M           what both measure (10)\n"
           "  --speed M/S         by which that grows (0)\n"
           "  --noise M           by which it shakes (0)\n"
           "  --seed N            of the noise (1)\n"
           "  --load HZ           frames per second of others (0)\n"
           "  --log               write a log to standard output, as fast as it goes, on a clock that starts at "
           "1e9 s\n"
           "  --seconds S         end after so long; a log needs it\n\n"
           "Commands on standard input, each answered by a line \"ok ...\" or \"error: ...\":\n"
           "  drop N | corrupt N | duplicate N | reorder N    of the next N DroneCAN transfers: lose a frame, "
           "change a\n"
           "                                                  bit, send twice, swap two frames\n"
           "  too_close N | too_far N                         readings of the next N\n"
           "  unavailable N                                   the next N NMEA 2000 depths\n"
           "  range M | sensor ID | silent SECONDS\n"
           "  error busoff|restarted|warning|passive|active   what a controller would report\n"
           "  status | quit\n");
}

static double number(const char *option, const char *text, double lo, double hi)
{
    char *rest;
    double v = strtod(text, &rest);
    if (*rest || rest == text || !(v >= lo && v <= hi))
        die("--%s '%s': must be a number from %g to %g", option, text, lo, hi);
    return v;
}

static const struct option options[] = {{"dronecan", required_argument, NULL, 'd'},
                                        {"sensor", required_argument, NULL, 'i'},
                                        {"fd", no_argument, NULL, 'f'},
                                        {"rate", required_argument, NULL, 'r'},
                                        {"nmea2000", required_argument, NULL, 'n'},
                                        {"nmea2000-rate", required_argument, NULL, 'N'},
                                        {"range", required_argument, NULL, 'm'},
                                        {"speed", required_argument, NULL, 'v'},
                                        {"noise", required_argument, NULL, 'o'},
                                        {"seed", required_argument, NULL, 's'},
                                        {"load", required_argument, NULL, 'l'},
                                        {"log", no_argument, NULL, 'L'},
                                        {"seconds", required_argument, NULL, 't'},
                                        {"help", no_argument, NULL, 'h'},
                                        {NULL, 0, NULL, 0}};

static void parse(struct sim *s, int argc, char **argv)
{
    double rate = 10, nmea2000_rate = 1;
    for (int c, i; (c = getopt_long(argc, argv, "h", options, &i)) != -1;) {
        switch (c) {
        case 'd':
            s->node = (int)number("dronecan", optarg, 1, 127);
            break;
        case 'i':
            s->sensor_id = (int)number("sensor", optarg, 0, 255);
            break;
        case 'f':
            s->fd = true;
            break;
        case 'r':
            rate = number("rate", optarg, 0.01, 1e6);
            break;
        case 'n':
            s->address = (int)number("nmea2000", optarg, 0, 251);
            break;
        case 'N':
            nmea2000_rate = number("nmea2000-rate", optarg, 0.01, 1e6);
            break;
        case 'm':
            s->range_m = number("range", optarg, 0.05, 65000);
            break;
        case 'v':
            s->speed_mps = number("speed", optarg, -100, 100);
            break;
        case 'o':
            s->noise_m = number("noise", optarg, 0, 1000);
            break;
        case 's':
            s->random = (uint64_t)number("seed", optarg, 0, 1e15);
            break;
        case 'l':
            s->load_hz = number("load", optarg, 0, 1e6);
            break;
        case 'L':
            s->log = true;
            break;
        case 't':
            s->seconds = number("seconds", optarg, 0, 1e6);
            break;
        case 'h':
            print_help();
            exit(0);
        default:
            exit(2);
        }
    }
    if (optind + 1 != argc)
        die("wanted one CAN interface; see --help");
    s->interface = argv[optind];
    if (s->log && s->seconds <= 0)
        die("--log needs --seconds");
    s->dronecan.period_ns = s->node > 0 ? (uint64_t)(SECOND / rate) : 0;
    s->nmea2000.period_ns = s->address >= 0 ? (uint64_t)(SECOND / nmea2000_rate) : 0;
    s->load.period_ns = s->load_hz > 0 ? (uint64_t)(SECOND / s->load_hz) : 0;
}

static void run_log(struct sim *s)
{
    const uint64_t end_ns = s->start_ns + (uint64_t)(s->seconds * SECOND);
    for (uint64_t now; (now = next_due(s)) < end_ns;)
        run_talkers(s, now);
}

static void run_bus(struct sim *s)
{
    struct pollfd input = {STDIN_FILENO, POLLIN, 0};
    struct fault fault;
    s->port.can_match = (struct can_match){CAN_EFF_FLAG, UINT32_MAX}; /* hears nothing */
    if (!port_can.open(&s->port, s->interface, &fault))
        die("%s", fault.text);
    printf("ready %s\n", s->interface);
    fflush(stdout);
    const uint64_t end_ns = s->seconds > 0 ? s->start_ns + (uint64_t)(s->seconds * SECOND) : UINT64_MAX;
    for (uint64_t now; !stop_wanted && (now = clock_ns()) < end_ns;) {
        run_talkers(s, now);
        uint64_t due = next_due(s);
        int wait_ms = due > now ? (int)fmin((double)(due - now) * 1e-6 + 0.999, 100) : 0;
        if (poll(&input, 1, wait_ms) > 0 && !read_command(s, clock_ns()))
            input.fd = -1; /* nobody commands */
    }
}

int main(int argc, char **argv)
{
    static struct sim s = {.node = -1, .address = -1, .range_m = 10, .field_of_view_rad = 0.436, .random = 1};
    parse(&s, argc, argv);
    setvbuf(stdin, NULL, _IONBF, 0); /* poll must see every line */
    signal(SIGTERM, on_stop);
    signal(SIGINT, on_stop);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGTTIN, SIG_IGN); /* in the background of a shell reading fails, and all goes on without commands */
    s.start_ns = s.log ? (uint64_t)1e9 * SECOND : clock_ns();
    s.dronecan.next_ns = s.nmea2000.next_ns = s.load.next_ns = s.start_ns;
    if (s.log)
        run_log(&s);
    else
        run_bus(&s);
    return 0;
}
