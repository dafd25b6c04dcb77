/* SPDX-License-Identifier: MIT */
#include "reload.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "request_job.h"
#include "core/log.h"
#include "fit.h"
#include "notify.h"
#include "settings.h"
#include "wiring.h"

/* One reload, and what came of it. */
struct outcome {
    const struct conf *conf; /* in force before */
    bool checks;             /* nothing changes, and nothing is logged */
    bool replays;            /* what needs a restart was left alone when it was recorded; a capture fills no log */
    const struct conf_text *instead;  /* of a file; NULL: of none */
    struct json_out applied, restart; /* lines of changed keys, */
    unsigned n_applied, n_restart;    /* so many */
    bool extract[CONF_MAX_SONARS];    /* this sonar's extraction begins anew for one of them */
    char fault[560];                  /* the first; empty: none */
    int faults;
};

static void on_fault(void *ctx, const char *message)
{
    struct outcome *o = ctx;
    if (!o->checks && !o->replays)
        log_line(LOG_ERR, "reload_fault", "reload: %s", message);
    if (o->faults++ == 0)
        snprintf(o->fault, sizeof o->fault, "%s", message);
}

/* Which sonars' extraction a live key is about; text: "[section] key = value" of the section as it is titled. How a
 * sonar is asked for its pings (mode) says nothing of what is in them. */
static void mark_extracts(struct outcome *o, const char *section, const char *text)
{
    for (int i = 0; i < o->conf->n_sonars; i++) {
        char title[CONF_NAME_MAX + 16];
        const size_t n = (size_t)snprintf(title, sizeof title, "[sonar %s] ", o->conf->sonar[i].name);
        const bool of_sonar = strncmp(text, title, n) == 0 && strncmp(text + n, "mode ", 5) != 0;
        o->extract[i] |= strcmp(section, "extract") == 0 || of_sonar;
    }
}

static void on_change(void *ctx, const char *section, const char *text, bool live)
{
    struct outcome *o = ctx;
    if (live) {
        json_out_text(&o->applied, text);
        o->n_applied++;
        mark_extracts(o, section, text);
        if (!o->checks && !o->replays)
            log_line(LOG_NOTICE, "reload_key", "reload: %s", text);
    } else if (!o->replays) {
        json_out_text(&o->restart, text);
        o->n_restart++;
        if (!o->checks)
            log_line(LOG_WARNING, "reload_restart", "reload: %s: needs a restart", text);
    }
}

/* Whatever order the sections have by now. */
static void set_limits(const struct reload_env *env)
{
    for (int i = 0; i <= env->conf->n_more_grids; i++) {
        struct grid_setting setting;
        struct grid *grid;
        wiring_grid(env->conf, i == 0 ? &env->conf->grid : &env->conf->more_grid[i - 1], &setting);
        for (int k = 0; (grid = pipeline_grid(env->pipeline, k)); k++)
            if (strcmp(grid->setting.name, setting.name) == 0)
                grid->setting.limits = setting.limits;
    }
}

/* A sonar whose extraction begins anew. */
struct renewal {
    struct extract_job job;
    char sonar[CONF_NAME_MAX];
};

static void tell_renewal(void *renewal)
{
    struct renewal *r = renewal;
    if (r->job.good)
        log_line(LOG_INFO, "reload_extract", "reload: %s: learning ring-down and noise again", r->sonar);
    else if (r->job.fault.text[0])
        log_line(LOG_ERR, "reload_fault", "reload: %s: %s", r->sonar, r->job.fault.text);
    free(r);
}

static void renew_extract(const struct reload_env *env, int sensor)
{
    struct renewal *r = calloc(1, sizeof *r);
    if (!r) {
        log_line(LOG_ERR, "reload_fault", "reload: %s: out of memory", env->conf->sonar[sensor].name);
        return;
    }
    r->job = (struct extract_job){.call.extracts = true, .sensor = sensor};
    wiring_extract(env->conf, sensor, &r->job.conf);
    snprintf(r->sonar, sizeof r->sonar, "%s", env->conf->sonar[sensor].name);
    owner_poll(env->pipeline, &r->job.call, pipeline_take_extract);
    owner_job_leave(&r->job.call, tell_renewal);
}

/* The sonars of which *conf wants something else than what is in force. */
static void retune(const struct reload_env *env, const struct conf *conf)
{
    for (int i = 0; i < conf->n_sonars; i++) {
        const struct conf_sonar *now = &env->conf->sonar[i], *wanted = &conf->sonar[i];
        if (now->range_m != wanted->range_m || now->gain != wanted->gain || now->mode != wanted->mode)
            source_retune(env->source[i], wanted, &conf->water);
    }
}

/* extract: [conf->n_sonars], whose extraction begins anew. */
static void put_in_force(const struct reload_env *env, const struct conf *conf, const bool *extract)
{
    struct pose_drift drift;
    retune(env, conf);
    *env->conf = *conf;
    set_limits(env);
    log_set_level(settings_log_level(conf));
    pose_log_set_max_age(env->poses, (uint64_t)(conf->pose.max_age_s * 1e9));
    wiring_pose_delay(conf, env->poses);
    pose_log_set_most(env->poses, conf->vehicle.max_speed_mps, conf->vehicle.max_turn_radps);
    wiring_drift(conf, &drift);
    pose_log_set_drift(env->poses, loop_now(env->loop), &drift);
    if (!env->replay) {
        settings_log_idle(conf);
        fit_log(conf);
    }
    if (env->server)
        server_set_names(env->server, conf->server.change, conf->server.keep);
    for (int i = 0; i < conf->n_sonars; i++)
        if (extract[i])
            renew_extract(env, i);
}

static void ignore_change(void *ctx, const char *section, const char *text, bool live)
{
    (void)ctx, (void)section, (void)text, (void)live;
}

/* A FIFO would make the loop wait for its writer. Its reader reports what is missing. */
static bool is_readable_again(const char *path, struct outcome *o)
{
    struct stat st;
    char sentence[FAULT_TEXT_MAX];
    if (!path || stat(path, &st) != 0 || S_ISREG(st.st_mode))
        return true;
    snprintf(sentence, sizeof sentence, "%s is not a regular file and cannot be read again", path);
    on_fault(o, sentence);
    return false;
}

/* All of it, and not what was read: that may hold keys that need a restart, and later segments begin with this. */
static void record_reload(const struct reload_env *env, const struct conf *conf)
{
    char *text = NULL;
    size_t n = 0;
    FILE *out = env->record ? open_memstream(&text, &n) : NULL;
    if (!out)
        return;
    conf_print(conf, NULL, out);
    if (fclose(out) == 0)
        record_conf(env->record, loop_now(env->loop), text, n);
    free(text);
}

/* What of *wanted, of that source, can take the place of what there is. False with a fault: nothing has changed. */
static bool take_wanted(const struct reload_env *env, struct outcome *o, const struct conf *wanted,
                        const struct conf_source *source)
{
    struct conf merged = *env->conf;
    conf_take_live(&merged, wanted, &settings_checks, ignore_change, NULL);
    if (conf_check_together(&merged, source, &settings_checks, on_fault, o) != 0)
        return false;
    merged = *env->conf;
    conf_take_live(&merged, wanted, &settings_checks, on_change, o);
    if (o->checks)
        return true;
    if (o->n_applied > 0)
        record_reload(env, &merged);
    put_in_force(env, &merged, o->extract);
    return true;
}

/* False with a fault: nothing has changed. */
static bool reload(const struct reload_env *env, struct outcome *o)
{
    struct conf wanted;
    struct conf_source *source = NULL;
    const bool good = is_readable_again(settings_path(env->options), o) &&
                      settings_load(env->options, &(struct settings_how){.instead = o->instead}, &wanted, &source,
                                    on_fault, o) &&
                      take_wanted(env, o, &wanted, source);
    conf_source_free(source);
    return good;
}

static void outcome_free(struct outcome *o)
{
    free(o->applied.bytes);
    free(o->restart.bytes);
}

/* False with a refusal in *error. Its texts are for outcome_free in any case. */
static bool try_reload(const struct reload_env *env, struct outcome *o, struct rpc_error *error)
{
    o->conf = env->conf;
    if (env->replay)
        return rpc_refuse(error, RPC_INVALID_REQUEST, "a replay keeps its configuration");
    if (!request_job_room(env->pipeline, error))
        return false;
    if (reload(env, o))
        return true;
    if (o->faults > 1 && !o->checks)
        return rpc_refuse(error, RPC_INVALID_REQUEST, "nothing is changed: %s; %d more in the log", o->fault,
                          o->faults - 1);
    return rpc_refuse(error, RPC_INVALID_REQUEST, "nothing is changed: %s", o->fault);
}

static void write_lines(struct json_out *out, const char *name, const struct json_out *lines)
{
    json_out_name(out, name);
    json_out_open(out, '[');
    json_out_part(out, lines);
    json_out_close(out, ']');
}

static bool answer(const struct reload_env *env, struct outcome o, struct json_out *out, struct rpc_error *error)
{
    const bool good = try_reload(env, &o, error);
    if (good) {
        json_out_open(out, '{');
        write_lines(out, "applied", &o.applied);
        write_lines(out, "needs_restart", &o.restart);
        json_out_close(out, '}');
    }
    outcome_free(&o);
    return good;
}

bool reload_replay(const struct reload_env *env, const char *text, size_t n, struct fault *fault)
{
    struct outcome o = {.conf = env->conf, .replays = true};
    struct conf wanted;
    struct conf_source *source;
    struct conf_checks checks = settings_checks;
    checks.recorded = true;
    const bool good = conf_load_text(&wanted, &source, &(struct conf_text){env->conf_name, text, n}, &checks,
                                     on_fault, &o) == 0 &&
                      take_wanted(env, &o, &wanted, source);
    conf_source_free(source);
    outcome_free(&o);
    if (good)
        log_limited(loop_now(env->loop), LOG_NOTICE, LOG_ABOUT(.event = "reloaded"), "capture: reload: %u changed",
                    o.n_applied);
    return good || fault_set(fault, "%s", o.fault);
}

bool reload_now(const struct reload_env *env, struct json_out *out, struct rpc_error *error)
{
    return answer(env, (struct outcome){0}, out, error);
}

bool reload_check(const struct reload_env *env, const char *file, const char *text, struct json_out *out,
                  struct rpc_error *error)
{
    const char *path = settings_path(env->options);
    struct conf_text instead = {.bytes = text, .size = strlen(text)};
    if (file && path && !(instead.name = conf_drop_in(path, file)))
        return rpc_refuse(
            error, RPC_INVALID_REQUEST,
            "nothing is changed: the daemon does not read %s; it reads %s and the *.conf files of %s.d", file,
            path, path);
    return answer(env, (struct outcome){.checks = true, .instead = file ? &instead : NULL}, out, error);
}

void reload_by_signal(const struct reload_env *env)
{
    struct rpc_error error;
    struct outcome o = {0};
    notify_tell("RELOADING=1\nMONOTONIC_USEC=%llu", (unsigned long long)(loop_clock() / 1000));
    if (try_reload(env, &o, &error))
        log_line(LOG_NOTICE, "reloaded", "reload: %s: %u changed, %u need a restart", env->conf_name, o.n_applied,
                 o.n_restart);
    else
        log_line(LOG_ERR, "reload_failed", "reload: %s", error.message);
    notify_tell("READY=1");
    outcome_free(&o);
}
