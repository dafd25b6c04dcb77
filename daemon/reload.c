/* SPDX-License-Identifier: MIT */
#include "reload.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "daemon.h"
#include "errand.h"
#include "log.h"
#include "methods.h"
#include "notify.h"
#include "settings.h"
#include "wiring.h"

/* What came of one reload. */
struct outcome {
    const struct conf *conf;       /* in force before */
    json_t *applied, *restart;     /* lines of changed keys */
    bool extract[CONF_MAX_SONARS]; /* one of them is this sonar's extraction's */
    char fault[560];               /* the first; empty: none */
    int faults;
};

static void on_fault(void *ctx, const char *message)
{
    struct outcome *o = ctx;
    log_line(LOG_ERR, "reload_fault", "reload: %s", message);
    if (o->faults++ == 0)
        snprintf(o->fault, sizeof o->fault, "%s", message);
}

/* Which sonars' extraction a live key is about; text: "[section] key = value" of the section as it is titled. */
static void mark_extracts(struct outcome *o, const char *section, const char *text)
{
    for (int i = 0; i < o->conf->n_sonars; i++) {
        char title[CONF_NAME_MAX + 16];
        snprintf(title, sizeof title, "[sonar %s] ", o->conf->sonar[i].name);
        o->extract[i] |= strcmp(section, "extract") == 0 || strncmp(text, title, strlen(title)) == 0;
    }
}

static void on_change(void *ctx, const char *section, const char *text, bool live)
{
    struct outcome *o = ctx;
    json_array_append_new(live ? o->applied : o->restart, json_string(text));
    if (live)
        mark_extracts(o, section, text);
    if (live)
        log_line(LOG_NOTICE, "reload_key", "reload: %s", text);
    else
        log_line(LOG_WARNING, "reload_restart", "reload: %s: needs a restart", text);
}

/* Of the grids of the configuration; others were made by clients, who said what they wanted. */
static void set_limits(struct daemon *d)
{
    for (int i = 0; i <= d->conf.n_more_grids; i++) {
        struct grid_setting setting;
        wiring_grid(&d->conf, i == 0 ? &d->conf.grid : &d->conf.more_grid[i - 1], &setting);
        for (int k = 0; pipeline_grid(d->pipeline, k); k++) {
            struct grid *grid = pipeline_grid(d->pipeline, k);
            if (!grid->of_client && strcmp(grid->setting.name, setting.name) == 0)
                grid->setting.limits = setting.limits;
        }
    }
}

/* A sonar whose extraction begins anew. */
struct renewal {
    struct extract_errand way;
    char sonar[CONF_NAME_MAX];
};

static void tell_renewal(void *renewal)
{
    struct renewal *r = renewal;
    if (r->way.good)
        log_line(LOG_INFO, "reload_extract", "reload: %s: ring-down and noise are learnt anew", r->sonar);
    else if (r->way.err[0])
        log_line(LOG_ERR, "reload_fault", "reload: %s: %s", r->sonar, r->way.err);
    free(r);
}

static void renew_extract(struct daemon *d, int sensor)
{
    struct renewal *r = calloc(1, sizeof *r);
    if (!r) {
        log_line(LOG_ERR, "reload_fault", "reload: %s: out of memory", d->conf.sonar[sensor].name);
        return;
    }
    r->way = (struct extract_errand){.errand.early = true, .sensor = sensor};
    wiring_extract(&d->conf, sensor, &r->way.conf);
    snprintf(r->sonar, sizeof r->sonar, "%s", d->conf.sonar[sensor].name);
    pipeline_errand(d->pipeline, &r->way.errand, pipeline_take_extract);
    pipeline_errand_leave(&r->way.errand, tell_renewal);
}

/* extract: [conf->n_sonars], whose extraction begins anew. */
static void put_in_force(struct daemon *d, const struct conf *conf, const bool *extract)
{
    d->conf = *conf;
    set_limits(d);
    log_set_level(settings_log_level(conf));
    pose_log_set_max_age(&d->poses, (uint64_t)(conf->pose.max_age_s * 1e9));
    pose_log_set_most(&d->poses, conf->vehicle.max_speed_mps, conf->vehicle.max_turn_radps);
    if (d->server)
        server_set_change(d->server, conf->server.change);
    for (int i = 0; i < conf->n_sonars; i++)
        if (extract[i])
            renew_extract(d, i);
}

static void ignore_change(void *ctx, const char *section, const char *text, bool live)
{
    (void)ctx, (void)section, (void)text, (void)live;
}

/* False with a fault: nothing has changed. */
static bool reload(struct daemon *d, struct outcome *o)
{
    struct conf wanted, merged = d->conf;
    struct conf_source *source = NULL;
    bool good = settings_load(d->options, &wanted, &source, on_fault, o);
    if (good) {
        conf_take_live(&merged, &wanted, ignore_change, NULL);
        good = conf_check_together(&merged, source, &settings_checks, on_fault, o) == 0;
    }
    if (good) {
        merged = d->conf;
        conf_take_live(&merged, &wanted, on_change, o);
        put_in_force(d, &merged, o->extract);
    }
    conf_source_free(source);
    return good;
}

json_t *reload_method(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    struct daemon *d = call->daemon;
    if (!rpc_only(params, keys, error))
        return NULL;
    if (d->replay) {
        rpc_refuse(error, RPC_INVALID_REQUEST, "a replay keeps its configuration");
        return NULL;
    }
    if (!errand_room(call, error))
        return NULL;
    struct outcome o = {.conf = &d->conf, .applied = json_array(), .restart = json_array()};
    if (reload(d, &o))
        return json_pack("{s:o, s:o}", "applied", o.applied, "needs_restart", o.restart);
    json_decref(o.applied);
    json_decref(o.restart);
    if (o.faults > 1)
        rpc_refuse(error, RPC_INVALID_REQUEST, "nothing is changed: %s; %d more in the log", o.fault,
                   o.faults - 1);
    else
        rpc_refuse(error, RPC_INVALID_REQUEST, "nothing is changed: %s", o.fault);
    return NULL;
}

void reload_by_signal(struct daemon *d)
{
    const struct rpc_call call = {.daemon = d, .now_ns = loop_now(d->loop)};
    struct rpc_error error = {0};
    json_t *params = json_object();
    notify_tell("RELOADING=1\nMONOTONIC_USEC=%llu", (unsigned long long)(loop_clock() / 1000));
    json_t *result = reload_method(&call, params, &error);
    if (result)
        log_line(LOG_NOTICE, "reloaded", "reload: %s: %zu changed, %zu need a restart", d->conf_name,
                 json_array_size(json_object_get(result, "applied")),
                 json_array_size(json_object_get(result, "needs_restart")));
    else
        log_line(LOG_ERR, "reload_failed", "reload: %s", error.message);
    notify_tell("READY=1");
    json_decref(result);
    json_decref(params);
}
