/* SPDX-License-Identifier: MIT */
/*
 * voyage - makes the capture that sonard would have recorded of a virtual sonar, in virtual time: the same bytes on
 * every machine, however busy. The sonar is a program of tests/sim, which takes its turns when it is told to (pace.h);
 * at the other end of its line is the daemon's own device, as the first [sonar] of CONF has it.
 *
 *   voyage CONF CAPTURE PROGRAM [OPTION...]
 *
 * Commands on standard input, each answered by "ok SECONDS PINGS" (of virtual time, and made so far) or "error: WHY":
 *   run S             let S seconds pass
 *   pings N           let time pass until the sonar has made N more pings; an hour at most
 *   pose JSON         what a client says of the pose, as the parameters of the method `pose`
 *   sonar COMMAND     a command of the virtual sonar
 *   end               close the capture; its clock ends at this moment
 */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "config/conf.h"
#include "core/fault.h"
#include "drivers/capture/mcap.h"
#include "drivers/devices/device.h"
#include "grid/geometry.h"
#include "tests/sim/lib/pace.h"

#define START_NS    (1700000000u * 1000000000ull) /* captures go by Unix time; any will do, but always the same */
#define SECOND_NS   1000000000u
#define PINGS_MAX_S 3600
#define BAUD        4000000
#define COMMAND_MAX 4096
#define CONF_BYTES  65536
#define SAMPLES     (PING_MAX_BINS * 2)

static struct {
    struct conf_sonar sonar;
    const struct device_ops *ops;
    void *device;
    struct ping ping; /* the one there is: filled, counted, forgotten */
    struct ping_beam beam[PING_MAX_BEAMS];
    uint8_t samples[SAMPLES];
    uint64_t pings;
    struct mcap_writer *capture;
    int rx, tx, pose;        /* channels */
    uint64_t now_ns, due_ns; /* due: the virtual sonar's next turn */
    int clock_fd, line_fd;
    FILE *to, *from; /* the virtual sonar's standard input and output */
    pid_t pid;
    bool spoke; /* the device has sent something that the sonar has not had a turn to read */
} voyage;

__attribute__((noreturn, format(printf, 1, 2))) static void die(const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    fprintf(stderr, "voyage: ");
    vfprintf(stderr, fmt, args);
    fprintf(stderr, "\n");
    va_end(args);
    exit(2);
}

/* ---- the capture ---- */

static void keep(int channel, const void *data, size_t n)
{
    const struct mcap_message m = {.log_ns = voyage.now_ns, .publish_ns = voyage.now_ns, .data = data, .size = n};
    struct fault fault;
    if (!mcap_write_message(voyage.capture, channel, &m, &fault))
        die("%s", fault.text);
}

static void open_capture(const char *path, const char *conf, size_t size)
{
    const struct mcap_options options = {.library = "sonard voyage"};
    const struct mcap_attachment attached = {.log_ns = START_NS,
                                             .name = "sonard.conf",
                                             .media_type = "text/plain",
                                             .data = (const uint8_t *)conf,
                                             .size = size};
    char topic[CONF_NAME_MAX + 8];
    struct fault fault;
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd < 0)
        die("%s: %s", path, strerror(errno));
    voyage.capture = mcap_create(fd, &options, &fault);
    if (!voyage.capture || !mcap_attach(voyage.capture, &attached, &fault))
        die("%s: %s", path, fault.text);
    snprintf(topic, sizeof topic, "/%s/rx", voyage.sonar.name);
    voyage.rx = mcap_add_channel(voyage.capture, topic, "octet-stream", NULL, 0, &fault);
    snprintf(topic, sizeof topic, "/%s/tx", voyage.sonar.name);
    voyage.tx = mcap_add_channel(voyage.capture, topic, "octet-stream", NULL, 0, &fault);
    voyage.pose = mcap_add_channel(voyage.capture, "/pose", "json", NULL, 0, &fault);
    if (voyage.rx < 0 || voyage.tx < 0 || voyage.pose < 0)
        die("%s: %s", path, fault.text);
}

/* ---- what the device calls ---- */

static void on_send(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx;
    if (send(voyage.line_fd, bytes, n, MSG_NOSIGNAL) != (ssize_t)n)
        return; /* as a serial line without a peer: lost */
    keep(voyage.tx, bytes, n);
    voyage.spoke = true;
}

static void on_hold_break(void *ctx, bool on)
{
    (void)ctx, (void)on; /* the virtual sonars do not listen for it */
}

static struct ping *on_ping_begin(void *ctx)
{
    (void)ctx;
    voyage.ping = (struct ping){.max_beams = voyage.ops->max_beams,
                                .max_samples = sizeof voyage.samples / 2,
                                .beam = voyage.beam,
                                .samples = voyage.samples};
    return &voyage.ping;
}

static void on_ping_done(void *ctx, struct ping *ping)
{
    (void)ctx, (void)ping;
    voyage.pings++;
}

__attribute__((format(printf, 3, 4))) static void on_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    va_list args;
    (void)ctx;
    va_start(args, fmt);
    if (level > NOTE_DEBUG) {
        fprintf(stderr, "%.3f s: ", (double)(voyage.now_ns - START_NS) * 1e-9);
        vfprintf(stderr, fmt, args);
        fprintf(stderr, "\n");
    }
    va_end(args);
}

static const struct device_io io = {
    .send = on_send,
    .hold_break = on_hold_break,
    .ping_begin = on_ping_begin,
    .ping_done = on_ping_done,
    .note = on_note,
};

/* ---- time ---- */

static void take_due(void)
{
    if (read(voyage.clock_fd, &voyage.due_ns, sizeof voyage.due_ns) != sizeof voyage.due_ns)
        die("the virtual sonar has ended");
}

static void turn_sonar(void)
{
    if (write(voyage.clock_fd, &voyage.now_ns, sizeof voyage.now_ns) != sizeof voyage.now_ns)
        die("the virtual sonar has ended");
    take_due();
}

static void hear(void)
{
    uint8_t bytes[4096];
    ssize_t n;
    while ((n = read(voyage.line_fd, bytes, sizeof bytes)) > 0) {
        keep(voyage.rx, bytes, (size_t)n);
        voyage.ops->feed(voyage.device, bytes, (size_t)n, voyage.now_ns, &io);
    }
}

/* All that is due now, on both sides, until nobody has anything more to say. */
static void settle(void)
{
    do {
        voyage.spoke = false;
        if (voyage.ops->deadline(voyage.device) <= voyage.now_ns)
            voyage.ops->tick(voyage.device, voyage.now_ns, &io);
        turn_sonar();
        hear();
    } while (voyage.spoke);
}

/* On to the next moment at which something is due, but not beyond until_ns. */
static void step(uint64_t until_ns)
{
    const uint64_t deadline_ns = voyage.ops->deadline(voyage.device);
    uint64_t next_ns = voyage.due_ns < deadline_ns ? voyage.due_ns : deadline_ns;
    if (next_ns <= voyage.now_ns)
        next_ns = voyage.now_ns + 1;
    voyage.now_ns = next_ns < until_ns ? next_ns : until_ns;
    settle();
}

/* ---- commands: each returns NULL, or why it could not ---- */

static const char *do_run(const char *text)
{
    char *end;
    const double s = strtod(text, &end);
    if (end == text || *end != '\0' || !(s >= 0 && s <= 1e6))
        return "want seconds, from 0 to 1e6";
    const uint64_t until_ns = voyage.now_ns + (uint64_t)llround(s * 1e9);
    while (voyage.now_ns < until_ns)
        step(until_ns);
    return NULL;
}

static const char *do_pings(const char *text)
{
    char *end;
    const unsigned long n = strtoul(text, &end, 10);
    const uint64_t wanted = voyage.pings + n, until_ns = voyage.now_ns + (uint64_t)PINGS_MAX_S * SECOND_NS;
    if (end == text || *end != '\0')
        return "want a count";
    while (voyage.pings < wanted && voyage.now_ns < until_ns)
        step(until_ns);
    return voyage.pings < wanted ? "not so many pings within an hour" : NULL;
}

static const char *do_pose(const char *text)
{
    keep(voyage.pose, text, strlen(text));
    return NULL;
}

static const char *do_sonar(const char *text)
{
    static char answer[COMMAND_MAX];
    fprintf(voyage.to, "%s\n", text);
    fflush(voyage.to);
    if (!fgets(answer, sizeof answer, voyage.from))
        die("the virtual sonar has ended");
    take_due();
    settle();
    return strncmp(answer, "ok", 2) == 0 ? NULL : answer;
}

static const struct command {
    const char *name;
    const char *(*run)(const char *text);
} commands[] = {{"run", do_run}, {"pings", do_pings}, {"pose", do_pose}, {"sonar", do_sonar}};

static const char *command_run(char *line)
{
    char *text = line + strcspn(line, " ");
    if (*text != '\0')
        *text++ = '\0';
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        if (strcmp(line, commands[i].name) == 0)
            return commands[i].run(text);
    return "no such command";
}

static void commands_run(void)
{
    static char line[COMMAND_MAX];
    while (fgets(line, sizeof line, stdin)) {
        line[strcspn(line, "\n")] = '\0';
        if (strcmp(line, "end") == 0)
            return;
        const char *why = command_run(line);
        if (why)
            printf("error: %s\n", why);
        else
            printf("ok %.9f %llu\n", (double)(voyage.now_ns - START_NS) * 1e-9, (unsigned long long)voyage.pings);
        fflush(stdout);
    }
}

/* ---- beginning ---- */

/* Both ends of a socket; the sonar's lets pass `exec`, ours does not. */
static int socket_pair(int type, int *sonars)
{
    int fd[2];
    if (socketpair(AF_UNIX, type, 0, fd) != 0 || fcntl(fd[0], F_SETFD, FD_CLOEXEC) != 0)
        die("socketpair: %s", strerror(errno));
    *sonars = fd[1];
    return fd[0];
}

static void start_sonar(char **argv)
{
    int clock, line, talk;
    char text[32];
    const int ours = socket_pair(SOCK_STREAM, &talk);
    voyage.clock_fd = socket_pair(SOCK_SEQPACKET, &clock);
    voyage.line_fd = socket_pair(SOCK_STREAM | SOCK_NONBLOCK, &line);
    snprintf(text, sizeof text, "%d,%d", clock, line);
    if (setenv(PACE_VARIABLE, text, 1) != 0 || (voyage.pid = fork()) < 0)
        die("%s: %s", argv[0], strerror(errno));
    if (voyage.pid == 0) {
        dup2(talk, STDIN_FILENO);
        dup2(talk, STDOUT_FILENO);
        close(talk);
        execv(argv[0], argv);
        die("%s: %s", argv[0], strerror(errno));
    }
    close(talk);
    close(clock);
    close(line);
    voyage.to = fdopen(ours, "w");
    voyage.from = fdopen(dup(ours), "r");
    if (!voyage.to || !voyage.from)
        die("out of memory");
}

static void print_fault(void *ctx, const char *sentence)
{
    (void)ctx;
    fprintf(stderr, "%s\n", sentence);
}

static struct device_conf device_conf(const struct conf *conf)
{
    const struct conf_sonar *s = &conf->sonar[0];
    const bool sector = fabs(geo_wrap_pi(s->sector_rad[1] - s->sector_rad[0])) > 1e-6;
    return (struct device_conf){
        .range_m = s->range_m,
        .sound_speed_mps = conf->water.sound_speed_mps,
        .gain = s->gain,
        .sector_start_rad = sector ? geo_wrap_pi(s->sector_rad[0]) : 0,
        .sector_end_rad = sector ? geo_wrap_pi(s->sector_rad[1]) : 0,
        .step_rad = s->step_rad,
        .frequency_hz = s->frequency_hz,
        .min_confidence = s->min_confidence,
        .request_response = s->mode == CONF_MODE_REQUEST,
        .node = s->node,
        .sensor_id = s->sensor_id,
        .baud = BAUD,
    };
}

static void start_device(const char *path)
{
    static struct conf conf;
    struct conf_source *source;
    struct fault fault;
    if (conf_load(&conf, &source, path, NULL, print_fault, NULL) != 0 || conf.n_sonars == 0)
        die("%s: no good configuration of a sonar", path);
    conf_source_free(source);
    voyage.sonar = conf.sonar[0];
    const struct device_conf device = device_conf(&conf);
    voyage.ops = device_find(voyage.sonar.device);
    if (!voyage.ops || (voyage.device = calloc(1, voyage.ops->state_size)) == NULL)
        die("device = %s: there is none", voyage.sonar.device);
    for (int i = 0; i < 3; i++)
        if (voyage.sonar.rotation_rad[i] != 0)
            die("rotation: a virtual sonar looks ahead");
    if (!voyage.ops->init(voyage.device, &device, &fault))
        die("%s", fault.text);
}

static size_t read_file(const char *path, char *text, size_t size)
{
    FILE *f = fopen(path, "r");
    const size_t n = f ? fread(text, 1, size, f) : 0;
    if (!f || ferror(f) || n == size)
        die("%s: cannot be read, or has more than %zu bytes", path, size - 1);
    fclose(f);
    return n;
}

int main(int argc, char **argv)
{
    static char text[CONF_BYTES], ready[COMMAND_MAX];
    struct fault fault;
    int status;
    if (argc < 4)
        die("want CONF CAPTURE PROGRAM [OPTION...]");
    voyage.now_ns = START_NS;
    start_device(argv[1]);
    open_capture(argv[2], text, read_file(argv[1], text, sizeof text));
    start_sonar(argv + 3);
    if (write(voyage.clock_fd, &voyage.now_ns, sizeof voyage.now_ns) != sizeof voyage.now_ns ||
        !fgets(ready, sizeof ready, voyage.from) || strncmp(ready, "ready", 5) != 0)
        die("the virtual sonar does not start");
    take_due();
    keep(voyage.tx, "", 0); /* the capture's clock begins with the voyage's, and ends with it */
    voyage.ops->opened(voyage.device, voyage.now_ns, &io);
    settle();
    printf("ready\n");
    fflush(stdout);
    commands_run();
    keep(voyage.tx, "", 0);
    if (!mcap_finish(voyage.capture, &fault))
        die("%s", fault.text);
    close(voyage.clock_fd);
    if (waitpid(voyage.pid, &status, 0) != voyage.pid || status != 0)
        die("the virtual sonar ended with status %d", status);
    printf("ok\n");
    return 0;
}
