/* SPDX-License-Identifier: MIT */
/* All counters and latencies as one list of metrics; sonard-protocol(7) has its shape. */
#include <stdio.h>
#include <string.h>

#include "counters.h"
#include "data_word.h"
#include "methods.h"
#include "query_context.h"
#include "json_units.h"

/* Edges of a histogram's buckets: powers of two, from 1 us to 69 s. */
#define POWER_FIRST 10
#define POWER_LAST  36

/* The object and its samples are left open. */
static void write_open_metric(struct json_out *out, const char *family, const char *name, const char *unit,
                              const char *type, const char *help)
{
    char full[96];
    snprintf(full, sizeof full, "sonard_%s%s%s", family, name, unit);
    json_out_open(out, '{');
    json_member_text(out, "name", full);
    json_member_word(out, "type", type);
    json_member_text(out, "help", help);
    json_member_open(out, "samples", '[');
}

static void write_labels(struct json_out *out, const char *label, const char *value)
{
    json_member_open(out, "labels", '{');
    if (label)
        json_member_text(out, label, value);
    json_out_close(out, '}');
}

static void write_sample(struct json_out *out, const char *label, const char *value, uint64_t n)
{
    json_out_open(out, '{');
    write_labels(out, label, value);
    json_member_count(out, "value", n);
    json_out_close(out, '}');
}

static void write_counters(struct json_out *out, const struct counter *counter, unsigned n)
{
    for (unsigned k = 0; k < n; k++) {
        write_open_metric(out, "", counter[k].name, "_total", "counter", counter[k].help);
        write_sample(out, NULL, NULL, counter[k].value);
        json_out_put(out, "]}");
    }
}

static void write_gauge(struct json_out *out, const char *name, const char *help, uint64_t value)
{
    write_open_metric(out, "", name, "", "gauge", help);
    write_sample(out, NULL, NULL, value);
    json_out_put(out, "]}");
}

/* One metric for each counter, with a sample for each sonar. */
static void write_sensors(struct json_out *out, const struct methods_env *d, const struct pipeline_stats *pipe)
{
    struct counter counter[CONF_MAX_SONARS][COUNTERS_MAX];
    const uint64_t lost = query_lost_sonars(d);
    const int n_sonars = d->conf.n_sonars;
    unsigned n = 0;
    write_open_metric(out, "sensor_", "pings", "_total", "counter", "pings received");
    for (int i = 0; i < n_sonars; i++) {
        struct source_stats s;
        source_stats(d->source[i], &s);
        n = counters_sensor(&s, pipe->dropped[i], counter[i]);
        write_sample(out, "sensor", d->conf.sonar[i].name, s.device.pings);
    }
    json_out_put(out, "]}");
    write_open_metric(out, "sensor_", "heard", "", "gauge", "1: online");
    for (int i = 0; i < n_sonars; i++)
        write_sample(out, "sensor", d->conf.sonar[i].name, !(lost >> i & 1));
    json_out_put(out, "]}");
    for (unsigned k = 0; k < n; k++) {
        write_open_metric(out, "sensor_", counter[0][k].name, "_total", "counter", counter[0][k].help);
        for (int i = 0; i < n_sonars; i++)
            write_sample(out, "sensor", d->conf.sonar[i].name, counter[i][k].value);
        json_out_put(out, "]}");
    }
}

static void write_histogram(struct json_out *out, const char *stage, struct latency *l)
{
    json_out_open(out, '{');
    write_labels(out, "stage", stage);
    json_out_name(out, "count");
    json_out_real(out, (double)atomic_load(&l->count));
    json_out_name(out, "sum_s");
    json_out_real(out, (double)atomic_load(&l->sum_ns) * 1e-9);
    json_member_real(out, "p50_us", (double)latency_quantile(l, 0.5) * 1e-3, 10);
    json_member_real(out, "p99_us", (double)latency_quantile(l, 0.99) * 1e-3, 10);
    json_member_real(out, "p999_us", (double)latency_quantile(l, 0.999) * 1e-3, 10);
    json_member_real(out, "max_us", (double)atomic_load(&l->max_ns) * 1e-3, 10);
    json_member_open(out, "buckets", '[');
    for (unsigned power = POWER_FIRST; power <= POWER_LAST; power += 2) {
        json_out_open(out, '[');
        json_out_real(out, (double)((1ull << power) - 1) * 1e-9);
        json_out_integer(out, (int64_t)latency_below(l, power));
        json_out_close(out, ']');
    }
    json_out_put(out, "]}");
}

static void write_stages(struct json_out *out, const struct methods_env *d)
{
    static const char *const words[] = {
        [PIPELINE_EXTRACT] = "extract", [PIPELINE_MAPS] = "maps", [PIPELINE_WHOLE] = "ping_to_picture"};
    write_open_metric(out, "", "latency", "_seconds", "histogram",
                      "time of a stage, or from a ping's last byte to its answer");
    for (int stage = 0; stage < PIPELINE_STAGES; stage++)
        write_histogram(out, words[stage], pipeline_latency(d->pipeline, (enum pipeline_stage)stage));
    if (d->server)
        write_histogram(out, "request", server_latency(d->server));
    json_out_put(out, "]}");
}

static void write_seconds(struct json_out *out, const char *label, const char *value, double seconds)
{
    json_out_open(out, '{');
    write_labels(out, label, value);
    json_member_real(out, "value", seconds, 1e3);
    json_out_close(out, '}');
}

static void write_uptime(struct json_out *out, const struct methods_env *d)
{
    write_open_metric(out, "", "uptime_seconds", "", "gauge", "since the start");
    write_seconds(out, NULL, NULL, (double)(loop_now(d->loop) - d->start_ns) * 1e-9);
    json_out_put(out, "]}");
}

/* Of those parts that were ever given. */
static void write_pose_ages(struct json_out *out, const struct methods_env *d)
{
    double age_s;
    write_open_metric(out, "", "pose_age", "_seconds", "gauge",
                      "age of each part of the pose that was ever given");
    for (unsigned i = 0; i < QUERY_POSE_PARTS; i++)
        if (query_pose_part(d, i, &age_s))
            write_seconds(out, "part", query_pose_parts[i], age_s);
    json_out_put(out, "]}");
}

/* The label says what is wrong, in the words of status. */
static void write_data(struct json_out *out, const struct methods_env *d)
{
    const char *word = status_data_word(d);
    write_open_metric(out, "", "data", "_ok", "gauge", "1: nothing is wrong with the data; 0: what `data` says");
    write_sample(out, "data", word, strcmp(word, "ok") == 0);
    json_out_put(out, "]}");
}

bool method_stats(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct pipeline_stats pipe;
    struct server_stats server = {0};
    struct counter counter[COUNTERS_MAX];
    (void)params;
    (void)error;
    pipeline_stats(d->pipeline, &pipe);
    if (d->server)
        server_stats(d->server, &server);
    json_out_open(out, '{');
    json_member_text(out, "version", SONARD_VERSION);
    json_member_open(out, "metrics", '[');
    write_uptime(out, d);
    write_data(out, d);
    write_pose_ages(out, d);
    write_gauge(out, "pings_waiting", "pings in the queue", pipe.waiting);
    write_gauge(out, "clients_now", "clients connected", server.clients_now);
    write_gauge(out, "grid_cells", "cells of the grid in use", pipe.grid.cells);
    write_counters(out, counter, counters_pipeline(&pipe, counter));
    write_counters(out, counter, counters_server(&server, counter));
    write_sensors(out, d, &pipe);
    write_stages(out, d);
    json_out_put(out, "]}");
    return true;
}
