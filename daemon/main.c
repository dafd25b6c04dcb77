/* SPDX-License-Identifier: MIT */
/* sonard - start order, the main loop, the end. See sonard(8). */
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#include "attention.h"
#include "daemon.h"
#include "grid_methods.h"
#include "errand.h"
#include "instruments.h"
#include "listen.h"
#include "log.h"
#include "options.h"
#include "plan_show.h"
#include "realtime.h"
#include "reload.h"
#include "replay.h"
#include "settings.h"
#include "wiring.h"

#define STOP_PATIENCE_NS 800000000u /* for the hardware to confirm that it is quiet */
#define RECORD_TICK_NS   500000000u
#define LAW_TICK_NS      1000000000u

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

static int check_file(const char *path)
{
    struct conf conf;
    struct conf_source *source;
    int faults = conf_load(&conf, &source, path, &settings_checks, print_fault, NULL);
    conf_source_free(source);
    if (faults == 0)
        printf("%s: no faults\n", path);
    return faults == 0 ? OK : FAILED;
}

static int explain(const struct conf *conf, enum options_explain how)
{
    if (how == EXPLAIN_TABLE) {
        plan_print(conf, stdout);
        return OK;
    }
    json_t *plan = plan_json(conf);
    const int status = json_dumpf(plan, stdout, JSON_INDENT(2)) == 0 && putchar('\n') != EOF ? OK : FAILED;
    json_decref(plan);
    return status;
}

static bool load_conf(const struct options *o, struct replay *replay, struct conf *conf,
                      struct conf_source **source, const char **name)
{
    char err[256];
    *name = settings_path(o);
    if (*name)
        return settings_load(o, conf, source, print_fault, NULL);
    size_t size;
    const char *text = replay_conf(replay, &size, err, sizeof err);
    *name = o->replay;
    if (!text) {
        fprintf(stderr, "sonard: %s: %s; give a configuration with -c\n", o->replay, err);
        return false;
    }
    if (conf_load_text(conf, source, *name, text, size, &settings_checks, print_fault, NULL) != 0)
        return false;
    settings_override(o, conf, *source);
    return true;
}

/* ---- running ---- */

static uint64_t ping_time(void *ctx, const struct source *source, const struct ping *ping)
{
    struct daemon *d = ctx;
    uint16_t i = source_index(source);
    return d->conf.sonar[i].trigger[0] ? trigger_time(&d->trigger[i], ping) : ping->t_ns;
}

static void on_ping(void *ctx, struct source *source, const struct ping *ping)
{
    struct daemon *d = ctx;
    template_ping(d, source_index(source), ping);
    if (!(ping->flags & PING_NEW_TURN))
        return;
    d->turns++;
    if (!d->answers)
        return;
    pipeline_drain(d->pipeline);
    daemon_write_answers(d, "turn", source_name(source));
}

static void on_signal(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct daemon *d = ctx;
    struct signalfd_siginfo signal;
    (void)events;
    (void)now_ns;
    while (read(d->signals.fd, &signal, sizeof signal) == sizeof signal) {
        if (signal.ssi_signo == SIGHUP)
            reload_by_signal(d);
        else
            loop_quit(d->loop);
    }
}

struct recorder_timer {
    struct loop_timer timer;
    struct daemon *d;
    uint64_t errors; /* already logged */
    uint64_t overflows;
};

static void on_record_tick(void *ctx, uint64_t now_ns)
{
    struct recorder_timer *t = ctx;
    struct record_status s;
    record_tick(t->d->record);
    record_status(t->d->record, &s);
    if (s.parts.errors > t->errors)
        log_line(LOG_ERR, "record_failed", "%s", s.parts.error);
    if (s.overflows > t->overflows)
        log_limited(now_ns, LOG_WARNING, LOG_ABOUT(.event = "record_lost", .count = s.overflows - t->overflows),
                    "recording: the disk is too slow: %llu messages lost",
                    (unsigned long long)(s.overflows - t->overflows));
    t->errors = s.parts.errors;
    t->overflows = s.overflows;
    loop_arm(t->d->loop, &t->timer, now_ns + RECORD_TICK_NS);
}

/* Tells each doubt about a sonar's amplitude law once. */
struct law_timer {
    struct loop_timer timer;
    struct daemon *d;
    enum law_doubt told[PIPELINE_MAX_SENSORS];
};

static void on_law_tick(void *ctx, uint64_t now_ns)
{
    struct law_timer *t = ctx;
    struct pipeline_stats s;
    pipeline_stats(t->d->pipeline, &s);
    for (int i = 0; i < t->d->conf.n_sonars; i++) {
        if (s.law_doubt[i] == LAW_FITS || s.law_doubt[i] == t->told[i])
            continue;
        t->told[i] = s.law_doubt[i];
        log_sonar(LOG_WARNING, "amplitude_doubted", t->d->conf.sonar[i].name, "%s (amplitude, docs/extract.md)",
                  law_doubt_text(s.law_doubt[i]));
    }
    loop_arm(t->d->loop, &t->timer, now_ns + LAW_TICK_NS);
}

/* Tells sonars that can be steered where to look. */
struct attention_timer {
    struct loop_timer timer;
    struct daemon *d;
};

static void on_attention_tick(void *ctx, uint64_t now_ns)
{
    struct attention_timer *t = ctx;
    struct daemon *d = t->d;
    struct pose pose = pose_identity;
    if (pose_log_fresh(&d->poses, now_ns))
        pose_log_newest(&d->poses, &pose);
    for (int i = 0; i < d->conf.n_sonars; i++) {
        double from_rad = 0, to_rad = 0;
        if (d->conf.sonar[i].scan != CONF_SCAN_ACTIVE)
            continue;
        attention_sector(pipeline_picture(d->pipeline), now_ns, d->conf.grid.clear_for_s, &pose, &d->mount[i],
                         &from_rad, &to_rad);
        source_attend(d->source[i], from_rad, to_rad);
    }
    loop_arm(d->loop, &t->timer, now_ns + ATTENTION_TICK_NS);
}

/* Writes the answers beside those of every turn. */
struct answers_timer {
    struct loop_timer timer;
    struct daemon *d;
    uint64_t every_ns;
};

static void on_answers_tick(void *ctx, uint64_t now_ns)
{
    struct answers_timer *t = ctx;
    pipeline_drain(t->d->pipeline);
    daemon_write_answers(t->d, "time", "");
    loop_arm(t->d->loop, &t->timer, now_ns + t->every_ns);
}

static bool make_pipeline(struct daemon *d, char *err, size_t err_size)
{
    struct pipeline_conf p;
    wiring_pipeline(&d->conf, &d->plan, d->replay, &p);
    p.measured = d->options->measure;
    memcpy(d->mount, p.mount, sizeof d->mount);
    d->pipeline = pipeline_new(&p, err, err_size);
    return d->pipeline && errand_start(d, err, err_size) && grid_start(d, err, err_size);
}

static bool make_sources(struct daemon *d, char *err, size_t err_size)
{
    struct source_env env = {.loop = d->loop,
                             .pipeline = d->pipeline,
                             .poses = &d->poses,
                             .record = d->record,
                             .replay = d->replay,
                             .ping_time = ping_time,
                             .on_ping = on_ping,
                             .ctx = d};
    for (int i = 0; i < d->conf.n_sonars; i++) {
        char why[256];
        d->source[i] = source_new(&env, &d->conf.sonar[i], &d->conf.water, (uint16_t)i, why, sizeof why);
        if (!d->source[i]) {
            snprintf(err, err_size, "[sonar %s]: %s", d->conf.sonar[i].name, why);
            return false;
        }
    }
    return true;
}

static bool make_record(struct daemon *d, const struct conf_source *source, char *err, size_t err_size)
{
    size_t size;
    const char *text = conf_source_text(source, &size);
    if (!plan_has(&d->plan, PLAN_RECORD, 0) || d->replay)
        return true;
    d->record = record_open(d->conf.record.directory, (uint64_t)d->conf.record.file_size_bytes,
                            d->conf.record.files, text, size, d->unix_offset_ns, loop_now(d->loop), err, err_size);
    if (d->record)
        d->pose_channel = record_channel(d->record, "/pose", "json");
    return d->record != NULL;
}

static bool make_server(struct daemon *d, char *err, size_t err_size)
{
    struct server_conf c = {.path = d->conf.server.socket,
                            .mode = (unsigned)d->conf.server.mode,
                            .change = d->conf.server.change,
                            .max_clients = d->conf.server.max_clients,
                            .no_rate_limit = d->replay};
    if (!plan_has(&d->plan, PLAN_SERVER, 0))
        return true;
    if (!listen_inherited(&c.inherited_fd, err, err_size))
        return false;
    d->server = server_start(d->loop, &c, daemon_methods, d, err, err_size);
    return d->server != NULL;
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

static void run_live(struct daemon *d)
{
    struct recorder_timer recording = {.d = d};
    recording.timer = (struct loop_timer){.fire = on_record_tick, .ctx = &recording};
    if (d->record)
        loop_arm(d->loop, &recording.timer, loop_now(d->loop) + RECORD_TICK_NS);
    struct law_timer law = {.d = d};
    law.timer = (struct loop_timer){.fire = on_law_tick, .ctx = &law};
    loop_arm(d->loop, &law.timer, loop_now(d->loop) + LAW_TICK_NS);
    struct attention_timer attention = {.d = d};
    attention.timer = (struct loop_timer){.fire = on_attention_tick, .ctx = &attention};
    if (plan_has(&d->plan, PLAN_ATTENTION, 0))
        loop_arm(d->loop, &attention.timer, loop_now(d->loop) + ATTENTION_TICK_NS);
    for (int i = 0; i < d->conf.n_sonars; i++)
        source_start(d->source[i]);
    log_line(LOG_NOTICE, "started", "version %s, configuration %s, %d sonar%s, %d pipeline thread%s, socket %s",
             SONARD_VERSION, d->conf_name, d->conf.n_sonars, d->conf.n_sonars == 1 ? "" : "s",
             d->conf.pipeline.threads, d->conf.pipeline.threads == 1 ? "" : "s",
             d->server ? server_path(d->server) : "none");
    while (loop_turn(d->loop, LOOP_NEVER)) {
    }
    loop_arm(d->loop, &recording.timer, LOOP_NEVER);
    loop_arm(d->loop, &law.timer, LOOP_NEVER);
    loop_arm(d->loop, &attention.timer, LOOP_NEVER);
}

static void run_replay(struct daemon *d, struct replay *replay, const struct options *o)
{
    for (int i = 0; i < d->conf.n_sonars; i++)
        source_start(d->source[i]);
    bool running = replay_run(replay, d, o->speed);
    d->replay_ended = true;
    if (d->answers) {
        daemon_write_answers(d, "end", "");
        fflush(d->answers);
    }
    while (running && o->stay)
        running = loop_turn(d->loop, LOOP_NEVER);
}

/* The hardware gets a moment to confirm that it is quiet; a second signal ends that too. */
static void stop_sources(struct daemon *d)
{
    uint64_t until = loop_clock() + STOP_PATIENCE_NS;
    for (int i = 0; i < d->conf.n_sonars; i++)
        if (d->source[i])
            source_stop(d->source[i]);
    for (bool busy = true; busy && loop_clock() < until;) {
        busy = false;
        for (int i = 0; i < d->conf.n_sonars; i++)
            busy |= !source_stopped(d->source[i]);
        if (busy)
            loop_turn(d->loop, 10000000u);
    }
}

static bool open_answers(struct daemon *d, const char *path, char *err, size_t err_size)
{
    if (!path)
        return true;
    d->answers = strcmp(path, "-") == 0 ? stdout : fopen(path, "we");
    if (!d->answers)
        snprintf(err, err_size, "%s: %s", path, strerror(errno));
    return d->answers != NULL;
}

static uint64_t unix_offset(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec - loop_clock();
}

static bool make_parts(struct daemon *d, const struct options *o, const struct conf_source *source)
{
    char err[512] = "";
    pose_log_init(&d->poses, (uint64_t)(d->conf.pose.max_age_s * 1e9));
    pose_log_set_most(&d->poses, d->conf.vehicle.max_speed_mps, d->conf.vehicle.max_turn_radps);
    if (open_answers(d, o->answers, err, sizeof err) &&
        (d->replay || realtime_prepare(&d->conf.realtime, err, sizeof err)) && make_pipeline(d, err, sizeof err) &&
        make_record(d, source, err, sizeof err) && make_server(d, err, sizeof err) &&
        make_sources(d, err, sizeof err) && instruments_make(d, err, sizeof err) &&
        (!d->record || record_start(d->record, err, sizeof err)) && instruments_start(d, err, sizeof err) &&
        places_start(d, err, sizeof err) && pager_start(d, err, sizeof err) &&
        (d->replay || realtime_enter(&d->conf.realtime, d->pipeline, err, sizeof err))) {
        template_start(d);
        if (template_keep_start(d, err, sizeof err) && service_start(d, err, sizeof err))
            return true;
    }
    log_line(LOG_ERR, "start_failed", "%s", err);
    return false;
}

static int end(struct daemon *d)
{
    int status = OK;
    server_stop(d->server);
    errand_end(d);
    instruments_end(d);
    for (int i = 0; i < d->conf.n_sonars; i++)
        source_free(d->source[i]);
    places_end(d);
    pager_end(d);
    pipeline_free(d->pipeline);
    template_keep_end(d);
    template_end(d);
    record_close(d->record);
    /* A write that failed before left its mark, and what it could not write is in no buffer any more. */
    const bool answers_lost = d->answers && ferror(d->answers);
    if (d->answers && (fclose(d->answers) != 0 || answers_lost)) {
        log_line(LOG_ERR, "answers_failed", "answers: not all could be written to %s: is the disk full?",
                 d->options->answers);
        status = FAILED;
    }
    loop_free(d->loop);
    log_flush(LOOP_NEVER);
    return status;
}

static int run(struct daemon *d, const struct options *o, struct replay *replay, const struct conf_source *source)
{
    d->replay = replay != NULL;
    d->loop = loop_new(d->replay);
    if (!d->loop) {
        log_line(LOG_ERR, "start_failed", "event loop: %s", strerror(errno));
        return FAILED;
    }
    d->options = o;
    plan_make(&d->conf, &d->plan);
    d->signals = (struct loop_fd){.fd = catch_signals(), .ready = on_signal, .ctx = d};
    loop_add(d->loop, &d->signals, EPOLLIN);
    if (replay)
        loop_advance(d->loop, replay_start(replay));
    else
        d->unix_offset_ns = unix_offset();
    d->start_ns = loop_now(d->loop);
    int status = FAILED;
    if (make_parts(d, o, source)) {
        struct answers_timer answers = {.d = d, .every_ns = (uint64_t)(o->every_s * 1e9)};
        answers.timer = (struct loop_timer){.fire = on_answers_tick, .ctx = &answers};
        if (answers.every_ns)
            loop_arm(d->loop, &answers.timer, d->start_ns + answers.every_ns);
        if (replay)
            run_replay(d, replay, o);
        else
            run_live(d);
        loop_arm(d->loop, &answers.timer, LOOP_NEVER);
        service_stop(d);
        stop_sources(d);
        status = OK;
    }
    if (end(d) != OK)
        status = FAILED;
    close(d->signals.fd);
    return status;
}

int main(int argc, char **argv)
{
    struct options o = {.threads = -1};
    log_open();
    int status = options_parse(argc, argv, &o);
    if (status >= 0)
        return written(status);
    if (o.check)
        return written(check_file(o.conf));
    char err[512];
    struct replay *replay = NULL;
    if (o.replay && !(replay = replay_open(o.replay, err, sizeof err))) {
        fprintf(stderr, "sonard: %s\n", err);
        return FAILED;
    }
    static struct daemon d;
    struct conf_source *source = NULL;
    status = FAILED;
    if (load_conf(&o, replay, &d.conf, &source, &d.conf_name)) {
        log_set_level(settings_log_level(&d.conf));
        if (o.print) {
            conf_print(&d.conf, source, stdout);
            status = written(OK);
        } else if (o.explain) {
            status = written(explain(&d.conf, o.explain));
        } else {
            status = run(&d, &o, replay, source);
        }
    }
    conf_source_free(source);
    replay_close(replay);
    return status;
}
