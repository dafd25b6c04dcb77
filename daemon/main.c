/* SPDX-License-Identifier: MIT */
/* sonard - start order, the main loop, the end. See sonard(8). */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/methods/answers_file.h"
#include "daemon/methods/data_word.h"
#include "daemon/methods/methods.h"
#include "request_job.h"
#include "daemon/input/aux_sensors.h"
#include "daemon/record/clock_note.h"
#include "daemon/rpc/listen.h"
#include "core/log.h"
#include "core/memory.h"
#include "fit.h"
#include "options.h"
#include "plan_show.h"
#include "realtime.h"
#include "reload.h"
#include "replay.h"
#include "service.h"
#include "settings.h"
#include "steering.h"
#include "wiring.h"

_Static_assert(LOG_SONAR_MAX >= CONF_NAME_MAX, "a sonar's name fits into a line of the log");

#define STOP_PATIENCE_NS 800000000u /* for the hardware to confirm that it is quiet */
#define RECORD_TICK_NS   500000000u
#define LAW_TICK_NS      1000000000u
#define KEPT_CLIENTS     1 /* beyond max_clients, for the tools of the owner */

/* The process: what the methods work with, and what they need not know of. */
struct process {
    struct methods_env env;
    struct clock_note clock_note;
    const struct options *options;
    struct worker *worker;
    struct request_jobs jobs;
    struct service service;
    struct loop_fd signals;
    struct replay_env replay; /* where a capture is played to */
    struct answers_file answers;
    struct conf began; /* the configuration of the start; what reloads of a capture made of it is env.conf */
    uint64_t no_line;  /* sonars of the capture that it has from no line: struct source_env */
    int inherited_fd;  /* the socket that the service manager handed over; 0: none */
    bool stopped;      /* by a signal */
};

/* The exit status of what only prints: what standard output did not take is no success. */
static int written(int status)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return status;
    fprintf(stderr, "sonard: standard output: %s\n", strerror(errno));
    return FAILED;
}

/* ---- configuration ---- */

static void print_fault(void *ctx, const char *message)
{
    (void)ctx;
    fprintf(stderr, "%s\n", message);
}

static void print_sentence(void *ctx, const char *sentence)
{
    const char *const *path = ctx;
    printf("%s: %s\n", *path, sentence);
}

static int check_file(const char *path)
{
    struct conf conf;
    struct conf_source *source;
    int faults = conf_load(&conf, &source, path, &settings_checks, print_fault, NULL);
    conf_source_free(source);
    if (faults == 0) {
        conf_idle(&conf, &settings_checks, print_sentence, &path);
        fit_judge(&conf, print_sentence, &path);
        fit_unchecked(&conf, print_sentence, &path);
        printf("%s: no faults\n", path);
    }
    return faults == 0 ? OK : FAILED;
}

static int explain(const struct conf *conf, enum options_explain how)
{
    if (how == EXPLAIN_TABLE) {
        plan_print(conf, stdout);
        return OK;
    }
    struct json_out text = {0};
    plan_write(conf, &text);
    json_t *plan = text.failed ? NULL : json_loadb(text.bytes, text.n, 0, NULL);
    const int status = json_dumpf(plan, stdout, JSON_INDENT(2)) == 0 && putchar('\n') != EOF ? OK : FAILED;
    json_decref(plan);
    free(text.bytes);
    return status;
}

static bool load_conf(const struct options *o, struct replay *replay, struct conf *conf,
                      struct conf_source **source, const char **name)
{
    struct fault fault;
    *name = settings_path(o);
    if (*name)
        return settings_load(o, &(struct settings_how){.starts = true}, conf, source, print_fault, NULL);
    struct conf_checks checks = settings_checks;
    size_t size;
    const char *text = replay_conf(replay, &size, &fault);
    checks.recorded = true;
    *name = o->replay;
    if (!text) {
        fprintf(stderr, "sonard: %s: %s; give a configuration with -c\n", o->replay, fault.text);
        return false;
    }
    if (conf_load_text(conf, source, &(struct conf_text){*name, text, size}, &checks, print_fault, NULL) != 0)
        return false;
    settings_override(o, conf, *source);
    return true;
}

/* ---- running ---- */

static uint64_t ping_time(void *ctx, const struct source *source, const struct ping *ping)
{
    struct process *d = ctx;
    uint16_t i = source_index(source);
    return d->env.conf.sonar[i].trigger[0] ? trigger_time(&d->env.aux.trigger[i], ping) : ping->t_ns;
}

static void on_ping(void *ctx, struct source *source, const struct ping *ping)
{
    struct process *d = ctx;
    template_ping(&d->env.templates, source_index(source), ping);
    if (!(ping->flags & PING_NEW_TURN))
        return;
    d->answers.turns++;
    if (!d->answers.file)
        return;
    pipeline_drain(d->env.pipeline);
    answers_file_write(&d->answers, "turn", source_name(source));
}

static void on_signal(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct process *d = ctx;
    struct signalfd_siginfo signal;
    (void)events;
    (void)now_ns;
    while (read(d->signals.fd, &signal, sizeof signal) == sizeof signal) {
        if (signal.ssi_signo == SIGHUP)
            reload_by_signal(&d->env.reload);
        else
            loop_quit(d->env.loop);
        d->stopped |= signal.ssi_signo != SIGHUP;
    }
}

struct recorder_timer {
    struct loop_timer timer;
    struct process *d;
    uint64_t errors, resumed; /* already logged */
    uint64_t overflows;
};

static void on_record_tick(void *ctx, uint64_t now_ns)
{
    struct recorder_timer *t = ctx;
    struct record_status s;
    record_tick(t->d->env.record);
    record_status(t->d->env.record, &s);
    if (s.segments.errors > t->errors)
        log_line(LOG_ERR, "record_failed", "%s; %s", s.segments.error.text,
                 s.segments.paused ? "the recording has ended without what the disk did not take" : "retrying");
    if (s.segments.resumed > t->resumed)
        log_line(LOG_NOTICE, "record_resumed", "recording again, to %s; %llu messages were lost", s.segments.path,
                 (unsigned long long)s.segments.lost_in_gap);
    if (s.overflows > t->overflows)
        log_limited(now_ns, LOG_WARNING, LOG_ABOUT(.event = "record_lost", .count = s.overflows - t->overflows),
                    "recording: the disk is too slow: %llu messages lost",
                    (unsigned long long)(s.overflows - t->overflows));
    t->errors = s.segments.errors;
    t->resumed = s.segments.resumed;
    t->overflows = s.overflows;
    loop_arm(t->d->env.loop, &t->timer, now_ns + RECORD_TICK_NS);
}

/* Tells each doubt about a sonar's amplitude law once, and about its receiver when it begins and when it ends. */
struct law_timer {
    struct loop_timer timer;
    struct process *d;
    enum law_doubt told[PIPELINE_MAX_SENSORS];
    enum hearing_doubt hearing[PIPELINE_MAX_SENSORS];
};

static void tell_hearing(uint64_t now_ns, const char *sonar, enum hearing_doubt doubt, enum hearing_doubt *told)
{
    if (doubt == *told)
        return;
    *told = doubt;
    log_limited(now_ns, doubt == HEARING_HEARS ? LOG_NOTICE : LOG_WARNING,
                LOG_ABOUT(.event = doubt == HEARING_HEARS ? "hears_again" : "hearing_doubted", .sonar = sonar),
                "%s", doubt == HEARING_HEARS ? "the receiver works again" : hearing_doubt_text(doubt));
}

static void on_law_tick(void *ctx, uint64_t now_ns)
{
    struct law_timer *t = ctx;
    struct pipeline_stats s;
    pipeline_stats(t->d->env.pipeline, &s);
    for (int i = 0; i < t->d->env.conf.n_sonars; i++) {
        tell_hearing(now_ns, t->d->env.conf.sonar[i].name, s.hearing[i], &t->hearing[i]);
        if (s.law_doubt[i] == LAW_FITS || s.law_doubt[i] == t->told[i])
            continue;
        t->told[i] = s.law_doubt[i];
        log_sonar(LOG_WARNING, "amplitude_doubted", t->d->env.conf.sonar[i].name,
                  "%s (amplitude, docs/extract.md)", law_doubt_text(s.law_doubt[i]));
    }
    loop_arm(t->d->env.loop, &t->timer, now_ns + LAW_TICK_NS);
}

/* Writes the answers beside those of every turn. */
struct answers_timer {
    struct loop_timer timer;
    struct process *d;
    uint64_t every_ns;
};

static void on_answers_tick(void *ctx, uint64_t now_ns)
{
    struct answers_timer *t = ctx;
    pipeline_drain(t->d->env.pipeline);
    answers_file_write(&t->d->answers, "time", "");
    loop_arm(t->d->env.loop, &t->timer, now_ns + t->every_ns);
}

static bool make_pipeline(struct process *d, struct fault *fault)
{
    struct pipeline_conf p;
    wiring_pipeline(&d->env.conf, &d->env.plan, d->env.replay, &p);
    p.measured = d->options->measure;
    memcpy(d->env.mount, p.mount, sizeof d->env.mount);
    if (!wiring_check(&d->env.conf, &p, fault))
        return false;
    d->env.pipeline = pipeline_new(&p, fault);
    return d->env.pipeline && request_jobs_start(&d->jobs, d->env.loop, d->env.pipeline, fault);
}

static bool make_sources(struct process *d, struct fault *fault)
{
    struct source_env env = {.loop = d->env.loop,
                             .worker = d->worker,
                             .pipeline = d->env.pipeline,
                             .poses = &d->env.poses,
                             .record = d->env.record,
                             .replay = d->env.replay,
                             .told = d->env.told,
                             .no_line = d->no_line,
                             .steered = d->env.plan.steered,
                             .ping_time = ping_time,
                             .on_ping = on_ping,
                             .ctx = d};
    for (int i = 0; i < d->env.conf.n_sonars; i++) {
        struct fault why;
        d->env.source[i] = source_new(&env, &d->env.conf.sonar[i], &d->env.conf.water, (uint16_t)i, &why);
        if (!d->env.source[i])
            return fault_set(fault, "[sonar %s]: %s", d->env.conf.sonar[i].name, why.text);
    }
    return true;
}

static bool make_record(struct process *d, const struct conf_source *source, struct fault *fault)
{
    size_t size;
    const char *text = conf_source_text(source, &size);
    if (!plan_has(&d->env.plan, PLAN_RECORD, 0) || d->env.replay)
        return true;
    const struct segments_conf conf = {.directory = d->env.conf.record.directory,
                                       .file_size = (uint64_t)d->env.conf.record.file_size_bytes,
                                       .files = d->env.conf.record.files,
                                       .conf_text = text,
                                       .conf_size = size,
                                       .unix_offset_ns = d->env.unix_offset_ns,
                                       .paused = d->env.conf.record.start != 0};
    d->env.record = record_open(&conf, loop_now(d->env.loop), fault);
    if (d->env.record)
        d->env.pose_channel = record_channel(d->env.record, "/pose", "json");
    if (d->env.record)
        clock_note_start(&d->clock_note, d->env.loop, d->env.record, d->env.unix_offset_ns);
    return d->env.record != NULL;
}

/* A capture brings the socket of the vehicle along, which a desk need not have. False: the fault stands. */
static bool replay_without_socket(const struct process *d, struct fault *fault)
{
    const struct options *o = d->options;
    if (!d->env.replay || o->socket)
        return false;
    if (o->stay)
        return fault_add(fault, "; choose another with --socket PATH");
    log_line(LOG_NOTICE, "no_socket",
             "%s; replaying without a socket, as with --socket none (--socket PATH answers clients)", fault->text);
    fault->text[0] = '\0';
    return true;
}

/* Grows with every picture of any grid. */
static uint64_t count_pictures(void *env)
{
    struct methods_env *d = env;
    uint64_t n = 0;
    struct grid *g;
    for (int i = 0; (g = pipeline_grid(d->pipeline, i)); i++)
        n += picture_now(grid_picture(g));
    return n;
}

static bool make_server(struct process *d, struct fault *fault)
{
    struct server_conf c = {.path = d->env.conf.server.socket,
                            .mode = (unsigned)d->env.conf.server.mode,
                            .change = d->env.conf.server.change,
                            .keep = d->env.conf.server.keep,
                            .worker = d->worker,
                            .max_clients = d->env.conf.server.max_clients,
                            .kept_clients = KEPT_CLIENTS,
                            .client_timeout_ns = (uint64_t)(d->env.conf.server.client_timeout_s * 1e9),
                            .pings = count_pictures,
                            .no_rate_limit = d->env.replay};
    if (!plan_has(&d->env.plan, PLAN_SERVER, 0))
        return true;
    if (d->inherited_fd == 0 && !listen_inherited(&d->inherited_fd, fault))
        return false;
    if (d->inherited_fd > 0 && (c.inherited_fd = fcntl(d->inherited_fd, F_DUPFD_CLOEXEC, STDERR_FILENO + 1)) < 0)
        return fault_set(fault, "cannot keep the service manager's socket: %s", strerror(errno));
    d->env.server = server_start(d->env.loop, &c, daemon_methods, &d->env, fault);
    return d->env.server != NULL || replay_without_socket(d, fault);
}

static int catch_signals(void)
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGHUP);
    sigprocmask(SIG_BLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
    return signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
}

static void run_live(struct process *d)
{
    struct recorder_timer recording = {.d = d};
    recording.timer = (struct loop_timer){.fire = on_record_tick, .ctx = &recording};
    if (d->env.record)
        loop_arm(d->env.loop, &recording.timer, loop_now(d->env.loop) + RECORD_TICK_NS);
    struct law_timer law = {.d = d};
    law.timer = (struct loop_timer){.fire = on_law_tick, .ctx = &law};
    loop_arm(d->env.loop, &law.timer, loop_now(d->env.loop) + LAW_TICK_NS);
    struct steering steering;
    steering_start(&steering, &(struct steering_env){.loop = d->env.loop,
                                                     .pipeline = d->env.pipeline,
                                                     .plan = &d->env.plan,
                                                     .poses = &d->env.poses,
                                                     .push = &d->env.push,
                                                     .mount = d->env.mount,
                                                     .source = d->env.source});
    for (int i = 0; i < d->env.conf.n_sonars; i++)
        source_start(d->env.source[i]);
    log_line(LOG_NOTICE, "started", "version %s, configuration %s, %d sonar%s, %d pipeline thread%s, socket %s",
             SONARD_VERSION, d->env.conf_name, d->env.conf.n_sonars, d->env.conf.n_sonars == 1 ? "" : "s",
             d->env.conf.pipeline.threads, d->env.conf.pipeline.threads == 1 ? "" : "s",
             d->env.server ? server_path(d->env.server) : "none");
    if (d->env.conf.n_sonars == 0)
        log_line(LOG_WARNING, "no_sonar",
                 "no sonar is configured: depth and heading are read, every answer is unknown");
    while (loop_turn(d->env.loop, LOOP_NEVER)) {
    }
    loop_arm(d->env.loop, &recording.timer, LOOP_NEVER);
    loop_arm(d->env.loop, &law.timer, LOOP_NEVER);
    steering_stop(&steering);
}

/* Nobody asked for anything: what there is to ask for. */
static void say_played(const struct process *d)
{
    struct pipeline_stats stats;
    pipeline_stats(d->env.pipeline, &stats);
    log_line(LOG_NOTICE, "played", "%llu pings played; --answers - prints the sectors, --stay keeps answering",
             (unsigned long long)stats.submitted);
}

/* A jump back in a capture ends a run, but not the process. */
static bool comes_back(const struct process *d, const struct replay *replay)
{
    return replay && replay_leads_back(replay) && !d->stopped;
}

/* False: it was played, and came to nothing. */
static bool run_replay(struct process *d, struct replay *replay, const struct options *o)
{
    for (int i = 0; i < d->env.conf.n_sonars; i++)
        source_start(d->env.source[i]);
    bool running = replay_run(replay, &d->replay);
    const bool heard = !running || replay_judge(replay, &d->replay);
    if (comes_back(d, replay))
        return true;
    d->env.replay_ended = true;
    if (d->answers.file) {
        answers_file_write(&d->answers, "end", "");
        fflush(d->answers.file);
    } else if (running && heard && !o->stay) {
        say_played(d);
    }
    while (running && o->stay)
        running = loop_turn(d->env.loop, LOOP_NEVER);
    return heard;
}

/* The hardware gets a moment to confirm that it is quiet; a second signal ends that too. */
static void stop_sources(struct process *d)
{
    uint64_t until = loop_clock() + STOP_PATIENCE_NS;
    for (int i = 0; i < d->env.conf.n_sonars; i++)
        if (d->env.source[i])
            source_stop(d->env.source[i]);
    for (bool busy = true; busy && loop_clock() < until;) {
        busy = false;
        for (int i = 0; i < d->env.conf.n_sonars; i++)
            busy |= !source_stopped(d->env.source[i]);
        if (busy)
            loop_turn(d->env.loop, 10000000u);
    }
}

static bool open_answers(struct process *d, const char *path, struct fault *fault)
{
    d->answers.d = &d->env;
    d->answers.bands = d->options->bands;
    if (!path)
        return true;
    d->answers.file = strcmp(path, "-") == 0 ? stdout : fopen(path, "we");
    if (!d->answers.file)
        fault_set(fault, "%s: %s", path, strerror(errno));
    return d->answers.file != NULL;
}

/* Standard output stays: after a jump back the next run writes there, too. */
static int close_answers(FILE *file)
{
    return file == stdout ? fflush(file) : fclose(file);
}

static uint64_t unix_offset(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec - loop_clock();
}

static bool make_map(struct process *d, struct fault *fault)
{
    const struct saver_env env = {.loop = d->env.loop,
                                  .worker = d->worker,
                                  .pipeline = d->env.pipeline,
                                  .conf = &d->env.conf.map,
                                  .origin = &d->env.map_service.origin,
                                  .replay = d->env.replay};
    const struct map_service_env service = {.loop = d->env.loop,
                                            .worker = d->worker,
                                            .pipeline = d->env.pipeline,
                                            .conf = &d->env.conf,
                                            .unix_offset_ns = d->env.unix_offset_ns,
                                            .replay = d->env.replay};
    map_service_start(&d->env.map_service, &service);
    return saver_start(&d->env.saver, &env, fault);
}

static void on_own_pose(void *ctx, const struct pose *pose)
{
    struct process *d = ctx;
    pose_own(&d->env, pose);
}

static void on_leak(void *ctx)
{
    struct process *d = ctx;
    if (d->env.server)
        server_tell(d->env.server, "status");
}

static bool make_aux_sensors(struct process *d, struct fault *fault)
{
    const struct aux_sensors_env env = {.loop = d->env.loop,
                                        .worker = d->worker,
                                        .conf = &d->env.conf,
                                        .poses = &d->env.poses,
                                        .record = d->env.record,
                                        .pose_channel = d->env.pose_channel,
                                        .source = d->env.source,
                                        .unix_offset_ns = d->env.unix_offset_ns,
                                        .replay = d->env.replay,
                                        .pose_taken = on_own_pose,
                                        .leak_changed = on_leak,
                                        .ctx = d};
    return aux_sensors_make(&d->env.aux, &env, fault);
}

static void start_templates(struct process *d)
{
    const struct template_env env = {.conf = &d->env.conf,
                                     .mount = d->env.mount,
                                     .pipeline = d->env.pipeline,
                                     .replay = d->env.replay,
                                     .replay_ended = &d->env.replay_ended};
    const struct template_keep_env keep = {.loop = d->env.loop,
                                           .worker = d->worker,
                                           .conf = &d->env.conf,
                                           .templates = &d->env.templates,
                                           .replay = d->env.replay};
    template_start(&d->env.templates, &env);
    template_keep_start(&d->env.keep, &keep);
}

/* A capture's message of /pose. */
static bool take_pose_text(void *ctx, const void *text, size_t n, struct fault *fault)
{
    struct process *d = ctx;
    struct rpc_error error = {0};
    json_t *params = json_loadb(text, n, 0, NULL);
    const bool good = json_is_object(params) && pose_replay(&d->env, params, &error);
    if (!good)
        fault_set(fault, "%s", json_is_object(params) ? error.message : "not a JSON object");
    json_decref(params);
    return good;
}

/* Where somebody has chosen the configuration of a replay, it stays. */
static bool take_reload_text(void *ctx, const void *text, size_t n, struct fault *fault)
{
    const struct process *d = ctx;
    return d->options->conf || reload_replay(&d->env.reload, text, n, fault);
}

/* Where a reload takes effect, and a capture is played to. */
static void name_seams(struct process *d)
{
    d->env.reload = (struct reload_env){.options = d->options,
                                        .source = d->env.source,
                                        .conf_name = d->env.conf_name,
                                        .conf = &d->env.conf,
                                        .loop = d->env.loop,
                                        .pipeline = d->env.pipeline,
                                        .poses = &d->env.poses,
                                        .server = d->env.server,
                                        .record = d->env.record,
                                        .replay = d->env.replay};
    d->replay = (struct replay_env){.loop = d->env.loop,
                                    .pipeline = d->env.pipeline,
                                    .conf = &d->env.conf,
                                    .source = d->env.source,
                                    .aux = &d->env.aux,
                                    .pose = take_pose_text,
                                    .reload = take_reload_text,
                                    .ctx = d};
}

static const char *data_word(const void *daemon)
{
    return status_data_word(daemon);
}

static bool start_service(struct process *d, struct fault *fault)
{
    const struct service_env env = {.loop = d->env.loop,
                                    .pipeline = d->env.pipeline,
                                    .n_sonars = d->env.conf.n_sonars,
                                    .replay = d->env.replay,
                                    .data_word = data_word,
                                    .ctx = &d->env};
    return service_start(&d->service, &env, fault);
}

static bool make_parts(struct process *d, const struct options *o, const struct conf_source *source)
{
    struct fault fault = {""};
    struct pose_drift drift;
    pose_log_init(&d->env.poses, (uint64_t)(d->env.conf.pose.max_age_s * 1e9));
    wiring_pose_delay(&d->env.conf, &d->env.poses);
    pose_log_set_most(&d->env.poses, d->env.conf.vehicle.max_speed_mps, d->env.conf.vehicle.max_turn_radps);
    wiring_drift(&d->env.conf, &drift);
    pose_log_set_drift(&d->env.poses, loop_now(d->env.loop), &drift);
    if ((d->worker = worker_new(d->env.loop, &fault)) && open_answers(d, o->answers, &fault) &&
        (d->env.replay || realtime_prepare(&d->env.conf.realtime, &fault)) && make_pipeline(d, &fault) &&
        make_server(d, &fault) && make_record(d, source, &fault) && make_sources(d, &fault) &&
        make_aux_sensors(d, &fault) && (!d->env.record || record_start(d->env.record, &fault)) &&
        aux_sensors_start(&d->env.aux, &fault) && make_map(d, &fault) &&
        (d->env.replay || realtime_enter(&d->env.conf.realtime, d->env.pipeline, &fault))) {
        start_templates(d);
        name_seams(d);
        if (start_service(d, &fault))
            return true;
    }
    log_line(LOG_ERR, "start_failed", "%s", fault.text);
    return false;
}

static int end(struct process *d)
{
    int status = OK;
    server_stop(d->env.server);
    request_jobs_end(&d->jobs);
    aux_sensors_end(&d->env.aux);
    for (int i = 0; i < d->env.conf.n_sonars; i++)
        source_free(d->env.source[i]);
    map_service_end(&d->env.map_service);
    saver_end(&d->env.saver);
    pipeline_free(d->env.pipeline);
    template_keep_end(&d->env.keep);
    template_end(&d->env.templates);
    clock_note_end(&d->clock_note);
    record_close(d->env.record, RECORD_PATIENCE_MS);
    /* A write that failed before left its mark, and what it could not write is in no buffer any more. */
    const bool answers_lost = d->answers.file && ferror(d->answers.file);
    if (d->answers.file && (close_answers(d->answers.file) != 0 || answers_lost)) {
        log_line(LOG_ERR, "answers_failed", "answers: not all could be written to %s: is the disk full?",
                 d->options->answers);
        status = FAILED;
    }
    worker_free(d->worker);
    loop_free(d->env.loop);
    log_flush(LOOP_NEVER);
    return status;
}

static int run_daemon(struct process *d, const struct options *o, struct replay *replay,
                      const struct conf_source *source)
{
    d->env.replay = replay != NULL;
    d->env.playing = replay;
    d->env.loop = loop_new(d->env.replay);
    if (!d->env.loop) {
        log_line(LOG_ERR, "start_failed", "event loop: %s", strerror(errno));
        return FAILED;
    }
    d->options = o;
    d->began = d->env.conf;
    d->env.told = replay ? replay_told(replay, &d->env.conf) : 0;
    for (int i = 0; replay && i < d->env.conf.n_sonars; i++)
        d->no_line |= (uint64_t)!replay_has_line(replay, d->env.conf.sonar[i].name) << i;
    plan_make(&d->env.conf, &d->env.plan);
    d->signals = (struct loop_fd){.fd = catch_signals(), .ready = on_signal, .ctx = d};
    loop_add(d->env.loop, &d->signals, EPOLLIN);
    if (replay)
        loop_advance(d->env.loop, replay_start(replay));
    else
        d->env.unix_offset_ns = unix_offset();
    d->env.start_ns = loop_now(d->env.loop);
    int status = FAILED;
    if (make_parts(d, o, source)) {
        struct answers_timer answers = {.d = d, .every_ns = (uint64_t)(o->every_s * 1e9)};
        answers.timer = (struct loop_timer){.fire = on_answers_tick, .ctx = &answers};
        if (answers.every_ns)
            loop_arm(d->env.loop, &answers.timer, d->env.start_ns + answers.every_ns);
        status = OK;
        if (!replay)
            run_live(d);
        else if (!run_replay(d, replay, o))
            status = FAILED;
        loop_arm(d->env.loop, &answers.timer, LOOP_NEVER);
        service_stop(&d->service, comes_back(d, replay));
        stop_sources(d);
    }
    if (end(d) != OK)
        status = FAILED;
    close(d->signals.fd);
    return status;
}

/* A jump back in a capture makes everything but the configuration anew, so that nothing is left of what was played.
 * False with *status: it is over. */
static bool start_anew(struct process *d, struct replay *replay, int *status)
{
    const struct conf conf = d->began;
    const char *name = d->env.conf_name;
    const int inherited_fd = d->inherited_fd;
    struct fault fault;
    if (!comes_back(d, replay))
        return false;
    if (!replay_again(replay, &fault)) {
        if (fault.text[0]) {
            fprintf(stderr, "sonard: %s\n", fault.text);
            *status = FAILED;
        }
        return false;
    }
    memset(d, 0, sizeof *d);
    d->env.conf = conf;
    d->env.conf_name = name;
    d->inherited_fd = inherited_fd;
    return true;
}

/* Whoever starts sonard may have closed some of the first three: a file that came in their place would get the log. */
static bool keep_standard_descriptors(void)
{
    int fd = 0;
    while (fd >= 0 && fd <= STDERR_FILENO)
        fd = open("/dev/null", O_RDWR); /* the lowest that is free */
    return fd >= 0 && close(fd) == 0;
}

int main(int argc, char **argv)
{
    struct options o = {.threads = -1};
    if (!keep_standard_descriptors())
        return FAILED;
    log_open();
    memory_return_large();
    int status = options_parse(argc, argv, &o);
    if (status >= 0)
        return written(status);
    if (o.check)
        return written(check_file(o.conf));
    struct fault fault;
    struct replay *replay = NULL;
    if (o.replay && !(replay = replay_open(o.replay, o.speed, &fault))) {
        fprintf(stderr, "sonard: %s\n", fault.text);
        return FAILED;
    }
    struct process *d = calloc(1, sizeof *d);
    struct conf_source *source = NULL;
    status = FAILED;
    if (!d) {
        fprintf(stderr, "sonard: out of memory\n");
    } else if (load_conf(&o, replay, &d->env.conf, &source, &d->env.conf_name)) {
        log_set_level(settings_log_level(&d->env.conf));
        if (o.print) {
            conf_print(&d->env.conf, source, stdout);
            status = written(OK);
        } else if (o.explain) {
            status = written(explain(&d->env.conf, o.explain));
        } else {
            settings_log_idle(&d->env.conf);
            fit_log(&d->env.conf);
            if (replay && (o.stay || o.speed > 0))
                replay_measure(replay);
            do
                status = run_daemon(d, &o, replay, source);
            while (start_anew(d, replay, &status));
        }
    } else if (!replay) {
        status = MISCONFIGURED; /* the service manager need not try again */
    }
    conf_source_free(source);
    replay_close(replay);
    free(d);
    return status;
}
