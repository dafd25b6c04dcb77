/* SPDX-License-Identifier: MIT */
/*
 * rig - the daemon in one process, with its loop on a clock that the test turns: one virtual sonar on a line of its
 * own, a Ping360 unless rig_far says otherwise, an instrument's line where the configuration has RIG_NMEA, the server
 * with a client at its socket, no thread that decides anything. Nothing waits and nothing is measured, so a run is the
 * same on any machine. The program is linked with --wrap (Makefile, WRAPS_test_rig).
 *
 * rig_run() turns the loop every RIG_STEP_NS. rig_hold() lets the sonar and the client go on while the loop stands, as
 * a process does that is stopped.
 */
#ifndef SONARD_TEST_RIG_H
#define SONARD_TEST_RIG_H

#include "tests/lib/test.h"

#include <errno.h>
#include <jansson.h>
#include <signal.h>
#include <stdarg.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "daemon/methods/environment.h"
#include "daemon/methods/methods.h"
#include "daemon/record/clock_note.h"
#include "daemon/request_job.h"
#include "daemon/replay.h"
#include "daemon/steering.h"
#include "daemon/wiring.h"
#include "tests/sim/lib/sim.h"

#define RIG_S        1000000000u
#define RIG_STEP_NS  5000000u
#define RIG_EPOCH_NS 1700000000000000000u /* Unix time of the clock's 0 */
#define RIG_BAUD     115200
#define RIG_PORT     "port = serial:/dev/rig:115200\nrange = 10 m\n"
#define RIG_SONAR    "[sonar front]\ndevice = ping360\n" RIG_PORT
#define RIG_NMEA     "[nmea]\nport = serial:/dev/nmea:4800\n"

struct rig {
    struct methods_env d;
    struct worker *worker;
    struct steering steering;
    struct request_jobs jobs;
    struct sim sim;
    bool unplugged;
    bool dead, instrument_dead;           /* the port is open and deaf, and swallows what is written, until ... */
    bool noted;                           /* the port tells when bytes came, as a socket's does: ... */
    uint64_t came_ns;                     /* ... the last ones, then ... */
    int port_fd, there;                   /* ... when more than these were there to read */
    int instrument;                       /* far end of [nmea]'s line; -1: none */
    bool held;                            /* the loop has stood, and has not turned since */
    double hold_in_turn_s;                /* hold once, between the look and the sonar's read */
    uint64_t next_pose_ns, pose_every_ns; /* every 0: no poses */
    bool dated;                           /* poses tell their time */
    bool unplaced;                        /* poses tell the attitude alone */
    double turn_dps;                      /* of the vehicle, from the next step on */
    double north_mps, north_m;            /* likewise; poses tell where it is, the scene does not move */
    uint64_t heard;                       /* a checksum of the pings so far: times, flags, bearings, poses */
    int64_t clock_off_ns;                 /* by what the computer's clock was set */
    struct clock_note clock_note;
    char path[64], dir[48]; /* of the socket */
    int client, pilot;      /* who asks; who sends poses */
    char answer[1 << 20];
    int log_was; /* standard error of the program, while rig_log_begin holds */
    char log_path[80];
};

static struct rig rig;
static _Atomic uint64_t rig_now_ns; /* the thread that writes captures reads it, too */

/* Of the next rig_start: the folder of captures; NULL: none is recorded. */
static const char *rig_captures;
static uint64_t rig_file_size = 1u << 30; /* of their segments */
/* Likewise. */
static struct head_conf rig_head = {
    .id = 2, .lag = 2, .ms_per_gradian = 6.0, .processing_ms = 18.0, .sound_speed_mps = 1500.0};
/* Likewise: measures the work done for clients, who then may ask without a limit; NULL: it takes no time. */
static uint64_t (*rig_work_clock)(void);
/* Of the next rig_replay: called before it plays; NULL: nothing is. */
static void (*rig_before_replay)(void);

int __wrap_clock_gettime(clockid_t clock, struct timespec *t);
int __wrap_clock_gettime(clockid_t clock, struct timespec *t)
{
    const uint64_t ns = rig_now_ns + (clock == CLOCK_REALTIME ? RIG_EPOCH_NS + (uint64_t)rig.clock_off_ns : 0);
    *t = (struct timespec){.tv_sec = (time_t)(ns / RIG_S), .tv_nsec = (long)(ns % RIG_S)};
    return 0;
}

/* Who is at the far end of the sonar's line, rig.sim.line. */
struct rig_far {
    const char *device;             /* of the configuration */
    void (*start)(uint64_t now_ns); /* switched on */
    void (*turn)(uint64_t now_ns);  /* take what the host sent, do what is due */
};

static void rig_ping360_start(uint64_t now_ns)
{
    sim_start(&rig.sim, &rig_head, now_ns);
}

static void rig_ping360_turn(uint64_t now_ns)
{
    sim_turn(&rig.sim, now_ns);
}

static const struct rig_far rig_ping360 = {"ping360", rig_ping360_start, rig_ping360_turn};
/* Of the next rig_start. */
static const struct rig_far *rig_far = &rig_ping360;

/* What Linux says first to a process that was stopped while it waited (signal(7)). */
int __real_epoll_wait(int epoll, struct epoll_event *events, int n, int ms);
int __wrap_epoll_wait(int epoll, struct epoll_event *events, int n, int ms);
int __wrap_epoll_wait(int epoll, struct epoll_event *events, int n, int ms)
{
    if (!rig.held)
        return __real_epoll_wait(epoll, events, n, ms);
    rig.held = false;
    errno = EINTR;
    return -1;
}

/* ---- the line: a socket pair, whose bytes are there as soon as they are written ---- */

static bool rig_check(const char *rest, struct fault *fault)
{
    (void)rest, (void)fault;
    return true;
}

static unsigned rig_baud(const char *rest)
{
    (void)rest;
    return RIG_BAUD;
}

/* Pull the adapter, and put it back. */
static inline void rig_unplug(void)
{
    if (rig.sim.line.fd >= 0)
        close(rig.sim.line.fd);
    rig.sim.line.fd = -1;
    rig.sim.line.begin = rig.sim.line.end = 0;
    rig.unplugged = true;
}

/* ... it is closed, as a USB adapter's is whose transfers have stopped. */
static inline void rig_dead(bool dead)
{
    rig.dead = dead;
}

static inline void rig_plug(void)
{
    rig.unplugged = false;
}

static bool rig_open(struct port *port, const char *rest, struct fault *fault)
{
    int ends[2];
    const bool nmea = strncmp(rest, "/dev/nmea", 9) == 0;
    int *const far = nmea ? &rig.instrument : &rig.sim.line.fd;
    port->fd = -1;
    port->error = ENOENT;
    if ((rig.unplugged && !nmea) || socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) < 0)
        return fault_set(fault, "/dev/rig: cannot be opened: %s", strerror(port->error));
    if (*far >= 0)
        close(*far);
    port->fd = ends[0];
    if (!nmea)
        rig.port_fd = ends[0];
    *far = ends[1];
    return true;
}

static bool rig_is_dead(const struct port *port)
{
    return port->fd == rig.port_fd ? rig.dead : rig.instrument_dead;
}

static ssize_t rig_done(struct port *port, ssize_t n)
{
    if (n > 0 || (n < 0 && errno == EAGAIN))
        return n > 0 ? n : 0;
    port->error = n == 0 ? ENODEV : errno;
    return -1;
}

static void rig_world(void);

static ssize_t rig_read(struct port *port, void *buf, size_t size)
{
    const double hold_s = rig.hold_in_turn_s;
    rig.hold_in_turn_s = 0;
    for (const uint64_t end_ns = rig_now_ns + (uint64_t)(hold_s * 1e9); rig_now_ns < end_ns;)
        rig_world();
    ssize_t n = recv(port->fd, buf, size, 0);
    if (n > 0 && rig_is_dead(port)) {
        n = -1;
        errno = EAGAIN;
    }
    rig.there = 0;
    port->t_ns = rig.noted ? rig.came_ns : 0;
    return rig_done(port, n);
}

static ssize_t rig_write(struct port *port, const void *buf, size_t size)
{
    return rig_is_dead(port) ? (ssize_t)size : rig_done(port, send(port->fd, buf, size, MSG_NOSIGNAL));
}

static inline void rig_hold_break(struct port *port, bool on)
{
    (void)port, (void)on;
}

static void rig_close(struct port *port)
{
    if (port->fd >= 0) {
        *(port->fd == rig.port_fd ? &rig.dead : &rig.instrument_dead) = false;
        close(port->fd);
    }
    port->fd = -1;
}

const struct port_ops port_serial = {.kind = "serial",
                                     .encoding = "octet-stream",
                                     .check = rig_check,
                                     .baud = rig_baud,
                                     .open = rig_open,
                                     .read = rig_read,
                                     .write = rig_write,
                                     .hold_break = rig_hold_break,
                                     .close = rig_close};

/* ---- the daemon ---- */

static uint64_t rig_ping_time(void *ctx, const struct source *source, const struct ping *ping)
{
    (void)ctx, (void)source;
    return ping->t_ns;
}

static void rig_hear(const void *data, size_t n)
{
    for (const uint8_t *byte = data; n-- > 0; byte++)
        rig.heard = (rig.heard ^ *byte) * 0x100000001b3u;
}

static void rig_on_ping(void *ctx, struct source *source, const struct ping *ping)
{
    struct methods_env *d = ctx;
    const uint64_t numbers[] = {ping->t_ns - (d->replay ? RIG_EPOCH_NS : 0), ping->flags, ping->head_units,
                                ping->n_bins};
    rig_hear(numbers, sizeof numbers);
    rig_hear(ping->pose.attitude, sizeof ping->pose.attitude);
    rig_hear(ping->pose.position_m, sizeof ping->pose.position_m);
    template_ping(&d->templates, source_index(source), ping);
}

static void rig_pose_taken(void *ctx, const struct pose *pose)
{
    pose_taken(ctx, pose);
}

static void rig_fault(void *ctx, const char *message)
{
    (void)ctx;
    fprintf(stderr, "%s\n", message);
}

static void rig_must(bool good, const char *what, const struct fault *fault)
{
    if (good)
        return;
    printf("rig: %s: %s\n", what, fault->text);
    exit(1);
}

static int rig_connect(void)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    snprintf(address.sun_path, sizeof address.sun_path, "%s", rig.path);
    rig_must(fd >= 0 && connect(fd, (struct sockaddr *)&address, sizeof address) == 0, "client",
             &(struct fault){"cannot connect"});
    return fd;
}

static void rig_configure(const char *more)
{
    struct methods_env *d = &rig.d;
    struct conf_source *source;
    char text[4096];
    snprintf(text, sizeof text, "[sonar front]\ndevice = %s\n" RIG_PORT "%s", rig_far->device, more);
    rig_must(conf_load_text(&d->conf, &source, &(struct conf_text){"rig", text, strlen(text)}, NULL, rig_fault,
                            NULL) == 0,
             "configuration", &(struct fault){"faulty"});
    conf_source_free(source);
    d->conf_name = "rig";
    d->conf.pipeline.threads = 0;
    plan_make(&d->conf, &d->plan);
}

/* from_ns: of a virtual clock, the first time that it shows; main sets it before all else, too. */
static void rig_make_parts(uint64_t from_ns)
{
    struct methods_env *d = &rig.d;
    struct pipeline_conf p;
    struct pose_drift drift;
    struct fault fault = {""};
    rig_must((d->loop = loop_new(d->replay)) != NULL, "loop", &fault);
    if (d->replay)
        loop_advance(d->loop, from_ns);
    d->unix_offset_ns = d->replay ? 0 : RIG_EPOCH_NS;
    d->start_ns = loop_now(d->loop);
    wiring_pipeline(&d->conf, &d->plan, false, &p);
    memcpy(d->mount, p.mount, sizeof d->mount);
    rig_must((d->pipeline = pipeline_new(&p, &fault)) != NULL, "pipeline", &fault);
    rig_must((rig.worker = worker_new(d->loop, &fault)) != NULL, "worker", &fault);
    rig_must(request_jobs_start(&rig.jobs, d->loop, d->pipeline, &fault), "jobs", &fault);
    pose_log_init(&d->poses, (uint64_t)(d->conf.pose.max_age_s * 1e9));
    pose_log_set_most(&d->poses, d->conf.vehicle.max_speed_mps, d->conf.vehicle.max_turn_radps);
    wiring_pose_delay(&d->conf, &d->poses);
    wiring_drift(&d->conf, &drift);
    pose_log_set_drift(&d->poses, loop_now(d->loop), &drift);
    template_start(&d->templates, &(struct template_env){.conf = &d->conf,
                                                         .mount = d->mount,
                                                         .pipeline = d->pipeline,
                                                         .replay_ended = &d->replay_ended});
    template_keep_start(&d->keep,
                        &(struct template_keep_env){
                            .loop = d->loop, .worker = rig.worker, .conf = &d->conf, .templates = &d->templates});
    map_service_start(&d->map_service, &(struct map_service_env){.loop = d->loop,
                                                                 .worker = rig.worker,
                                                                 .pipeline = d->pipeline,
                                                                 .conf = &d->conf,
                                                                 .unix_offset_ns = d->unix_offset_ns});
    if (rig_captures && !d->replay) {
        const struct segments_conf conf = {.directory = rig_captures,
                                           .file_size = rig_file_size,
                                           .conf_text = "",
                                           .unix_offset_ns = RIG_EPOCH_NS};
        d->record = record_open(&conf, rig_now_ns, &fault);
        rig_must(d->record != NULL, "capture", &fault);
        d->pose_channel = record_channel(d->record, "/pose", "json");
        clock_note_start(&rig.clock_note, d->loop, d->record, RIG_EPOCH_NS);
    }
    const struct source_env env = {.loop = d->loop,
                                   .worker = rig.worker,
                                   .pipeline = d->pipeline,
                                   .poses = &d->poses,
                                   .record = d->record,
                                   .replay = d->replay,
                                   .told = d->told,
                                   .steered = d->plan.steered,
                                   .ping_time = rig_ping_time,
                                   .on_ping = rig_on_ping,
                                   .ctx = d};
    d->source[0] = source_new(&env, &d->conf.sonar[0], &d->conf.water, 0, &fault);
    rig_must(d->source[0] != NULL, "source", &fault);
    const struct aux_sensors_env aux = {.loop = d->loop,
                                        .worker = rig.worker,
                                        .conf = &d->conf,
                                        .poses = &d->poses,
                                        .record = d->record,
                                        .pose_channel = d->pose_channel,
                                        .source = d->source,
                                        .unix_offset_ns = d->unix_offset_ns,
                                        .replay = d->replay,
                                        .pose_taken = rig_pose_taken,
                                        .ctx = d};
    rig_must(aux_sensors_make(&d->aux, &aux, &fault), "auxiliary sensors", &fault);
    rig_must(!d->record || record_start(d->record, &fault), "capture", &fault);
}

static void rig_serve(void)
{
    struct fault fault = {""};
    snprintf(rig.dir, sizeof rig.dir, "/tmp/sonard-rig-XXXXXX");
    rig_must(mkdtemp(rig.dir) != NULL, "folder", &(struct fault){"cannot be made"});
    snprintf(rig.path, sizeof rig.path, "%s/socket", rig.dir);
    const struct server_conf conf = {.path = rig.path,
                                     .mode = 0600,
                                     .change = "",
                                     .worker = rig.worker,
                                     .max_clients = 4,
                                     .client_timeout_ns = 600ull * RIG_S,
                                     .no_rate_limit = rig_work_clock != NULL,
                                     .clock = rig_work_clock};
    rig.d.server = server_start(rig.d.loop, &conf, daemon_methods, &rig.d, &fault);
    rig_must(rig.d.server != NULL, "server", &fault);
    rig.client = rig_connect();
    rig.pilot = rig_connect();
}

/* What `reload` reads, NULL: nothing, and where it takes effect. */
static inline void rig_set_reload(const struct options *options)
{
    struct methods_env *d = &rig.d;
    d->reload = (struct reload_env){.options = options,
                                    .conf_name = options ? options->conf : "rig",
                                    .conf = &d->conf,
                                    .loop = d->loop,
                                    .pipeline = d->pipeline,
                                    .poses = &d->poses,
                                    .source = d->source,
                                    .server = d->server,
                                    .record = d->record,
                                    .replay = d->replay};
}

/* A sonar in a scene (tests/water/scene.h), and the daemon with one sonar "front" of 10 m range and `conf` behind
 * that in the configuration. */
static void rig_start(const char *scene, const char *conf)
{
    struct fault fault = {""};
    signal(SIGPIPE, SIG_IGN); /* as in main: a worker may close the port while the head writes */
    memset(&rig, 0, sizeof rig);
    rig.instrument = -1;
    rig_now_ns = 100ull * RIG_S;
    rig.sim.water = (struct water){1500.0, 8.0, 0.5, 1};
    rig_must(scene_parse(&rig.sim.scene, "rig", scene, &fault), "scene", &fault);
    line_init(&rig.sim.line, NULL, RIG_BAUD, 1);
    rig_far->start(rig_now_ns);
    rig_configure(conf);
    rig_make_parts(0);
    rig_serve();
    source_start(rig.d.source[0]);
    steering_start(&rig.steering, &(struct steering_env){.loop = rig.d.loop,
                                                         .pipeline = rig.d.pipeline,
                                                         .plan = &rig.d.plan,
                                                         .poses = &rig.d.poses,
                                                         .push = &rig.d.push,
                                                         .mount = rig.d.mount,
                                                         .source = rig.d.source});
    rig_must(aux_sensors_start(&rig.d.aux, &fault), "auxiliary sensors", &fault);
}

static void rig_end(void)
{
    struct methods_env *d = &rig.d;
    close(rig.client);
    close(rig.pilot);
    server_stop(d->server);
    request_jobs_end(&rig.jobs);
    aux_sensors_end(&d->aux);
    source_free(d->source[0]);
    map_service_end(&d->map_service);
    pipeline_free(d->pipeline);
    clock_note_end(&rig.clock_note);
    record_close(d->record, 60000);
    template_keep_end(&d->keep);
    template_end(&d->templates);
    worker_free(rig.worker);
    loop_free(d->loop);
    if (rig.sim.line.fd >= 0)
        close(rig.sim.line.fd);
    if (rig.instrument >= 0)
        close(rig.instrument);
    rmdir(rig.dir);
}

/* ---- time passes ---- */

static void rig_tell_pose(void)
{
    char line[256], none[4096], place[64] = "";
    if (!rig.unplaced)
        snprintf(place, sizeof place, ",\"position_m\":[%.6f,0,0]", rig.north_m);
    int n = snprintf(line, sizeof line,
                     "{\"jsonrpc\":\"2.0\",\"method\":\"pose\",\"params\":{\"attitude_deg\":[0,0,%.6f]%s",
                     rig.sim.pose.yaw_deg, place);
    if (rig.dated)
        n += snprintf(line + n, sizeof line - (size_t)n, ",\"t_unix\":%.9f",
                      (double)(rig_now_ns + RIG_EPOCH_NS) * 1e-9);
    n += snprintf(line + n, sizeof line - (size_t)n, "}}\n");
    CHECK_INT(write(rig.pilot, line, (size_t)n), n);
    while (read(rig.pilot, none, sizeof none) > 0) {
    }
    rig.next_pose_ns = rig_now_ns + rig.pose_every_ns;
}

/* Outside of the daemon. */
static void rig_world(void)
{
    rig_now_ns += RIG_STEP_NS;
    rig.sim.pose.yaw_deg = fmod(rig.sim.pose.yaw_deg + rig.turn_dps * RIG_STEP_NS * 1e-9, 360);
    rig.north_m += rig.north_mps * RIG_STEP_NS * 1e-9;
    if (rig.pose_every_ns && rig_now_ns >= rig.next_pose_ns)
        rig_tell_pose();
    rig_far->turn(rig_now_ns);
    const int were = rig.there;
    if (rig.sim.line.fd >= 0 && ioctl(rig.port_fd, FIONREAD, &rig.there) == 0 && rig.there > were)
        rig.came_ns = rig_now_ns;
}

/* The same in the middle of the loop's next turn that reads of the sonar: behind the look, before the read. */
static inline void rig_hold_in_turn(double s)
{
    rig.hold_in_turn_s = s;
}

static inline void rig_hold(double s)
{
    rig.held = true;
    for (const uint64_t end_ns = rig_now_ns + (uint64_t)(s * 1e9); rig_now_ns < end_ns;)
        rig_world();
}

static void rig_run(double s)
{
    for (const uint64_t end_ns = rig_now_ns + (uint64_t)(s * 1e9); rig_now_ns < end_ns;) {
        rig_world();
        worker_finish(rig.worker); /* what it does takes no time of this world */
        loop_turn(rig.d.loop, 0);
    }
}

/* Until cond holds; false: it does not within so many seconds. */
#define RIG_UNTIL(cond, s)                                                                                        \
    do {                                                                                                          \
        const uint64_t end_ns_ = rig_now_ns + (uint64_t)((s)*1e9);                                                \
        while (!(cond) && rig_now_ns < end_ns_)                                                                   \
            rig_run(RIG_STEP_NS * 1e-9);                                                                          \
        CHECK(cond);                                                                                              \
    } while (0)

/* ---- a replay ---- */

static bool rig_take_pose(void *ctx, const void *text, size_t n, struct fault *fault)
{
    struct rpc_error error = {0};
    json_t *params = json_loadb(text, n, 0, NULL);
    const bool good = pose_replay(ctx, params, &error);
    json_decref(params);
    return good || fault_set(fault, "%s", error.message);
}

static bool rig_take_reload(void *ctx, const void *text, size_t n, struct fault *fault)
{
    const struct methods_env *d = ctx;
    return reload_replay(&d->reload, text, n, fault);
}

/* In place of rig_start: the daemon with the same sonar, after it has played a capture. */
static inline void rig_replay(const char *path, const char *conf)
{
    struct methods_env *d = &rig.d;
    struct fault fault = {""};
    memset(&rig, 0, sizeof rig);
    rig.instrument = -1;
    rig.sim.line.fd = -1;
    d->replay = true;
    rig_configure(conf);
    struct replay *replay = replay_open(path, 0, &fault);
    rig_must(replay != NULL, "capture", &fault);
    d->told = replay_told(replay, &d->conf);
    rig_make_parts(replay_start(replay));
    rig_serve();
    source_start(d->source[0]);
    rig_set_reload(NULL);
    const struct replay_env env = {.loop = d->loop,
                                   .pipeline = d->pipeline,
                                   .conf = &d->conf,
                                   .source = d->source,
                                   .aux = &d->aux,
                                   .pose = rig_take_pose,
                                   .reload = rig_take_reload,
                                   .ctx = d};
    if (rig_before_replay)
        rig_before_replay();
    CHECK(replay_run(replay, &env));
    replay_close(replay);
}

/* ---- questions ---- */

/* A command of the virtual sonar (tests/sim/lib/sim.h). */
static inline void rig_command(const char *command)
{
    char answer[SIM_ANSWER_MAX];
    const bool good = sim_command(&rig.sim, command, rig_now_ns, answer, sizeof answer);
    if (!good)
        printf("%s\n", answer);
    CHECK(good);
}

/* The result of a method; the caller's. Time stands meanwhile. */
__attribute__((format(printf, 2, 3))) static json_t *rig_ask(const char *method, const char *params, ...)
{
    char given[512], line[700];
    size_t got = 0;
    va_list ap;
    va_start(ap, params);
    vsnprintf(given, sizeof given, params, ap);
    va_end(ap);
    const int n = snprintf(line, sizeof line, "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"%s\",\"params\":{%s}}\n",
                           method, given);
    CHECK_INT(write(rig.client, line, (size_t)n), n);
    for (int i = 0; i < 1000 && !memchr(rig.answer, '\n', got); i++) {
        loop_turn(rig.d.loop, 0);
        const ssize_t more = read(rig.client, rig.answer + got, sizeof rig.answer - got);
        got += more > 0 ? (size_t)more : 0;
    }
    json_t *reply = json_loadb(rig.answer, got, 0, NULL), *result = json_object_get(reply, "result");
    if (!result)
        printf("%s: %.*s\n", method, (int)got, rig.answer);
    CHECK(result != NULL);
    json_incref(result);
    json_decref(reply);
    return result;
}

static inline struct source_stats rig_stats(void)
{
    struct source_stats s;
    source_stats(rig.d.source[0], &s);
    return s;
}

static inline void rig_run_pings(unsigned n)
{
    const uint64_t pings = rig_stats().device.pings + n;
    RIG_UNTIL(rig_stats().device.pings >= pings, 60);
}

/* ---- the log, in a file of its own from rig_log_begin to rig_log_end ---- */

static inline void rig_log_begin(void)
{
    snprintf(rig.log_path, sizeof rig.log_path, "%s/log", rig.dir);
    rig.log_was = dup(STDERR_FILENO);
    CHECK(freopen(rig.log_path, "w", stderr) != NULL);
}

/* How often it says that. */
static inline unsigned rig_log_count(const char *what)
{
    static char text[1 << 16];
    unsigned n = 0;
    FILE *f = fopen(rig.log_path, "r");
    CHECK(f != NULL);
    if (!f)
        return 0;
    text[fread(text, 1, sizeof text - 1, f)] = '\0';
    fclose(f);
    for (const char *at = text; (at = strstr(at, what)) != NULL; at++)
        n++;
    return n;
}

static inline void rig_log_end(void)
{
    fflush(stderr);
    dup2(rig.log_was, STDERR_FILENO);
    close(rig.log_was);
    unlink(rig.log_path);
}

/* ---- states ---- */

/* The states of all sectors, as a set of RIG_... */
enum { RIG_UNKNOWN = 1, RIG_CLEAR = 2, RIG_BLOCKED = 4 };

static inline unsigned rig_states(void)
{
    json_t *reply = rig_ask("sectors", "\"distance_m\":0"), *s;
    unsigned states = 0;
    size_t i;
    json_array_foreach(json_object_get(reply, "sectors"), i, s)
    {
        const char *state = json_string_value(json_object_get(s, "state"));
        states |= state[0] == 'b' ? RIG_BLOCKED : state[0] == 'c' ? RIG_CLEAR : RIG_UNKNOWN;
    }
    json_decref(reply);
    return states;
}

/* A text of the result of `status`, of its first sonar where `sonar`; "" where there is none. */
static inline const char *rig_status(const char *name, bool sonar)
{
    static char text[512];
    json_t *status = rig_ask("status", "%s", ""),
           *from = sonar ? json_array_get(json_object_get(status, "sensors"), 0) : status;
    const char *value = json_string_value(json_object_get(from, name));
    snprintf(text, sizeof text, "%s", value ? value : "");
    json_decref(status);
    return text;
}

#endif
