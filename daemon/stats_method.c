/* SPDX-License-Identifier: MIT */
/* All counters and latencies as one list of metrics; sonard-protocol(7) has its shape. */
#include <stdio.h>

#include "counters.h"
#include "methods.h"
#include "moment.h"
#include "say.h"

/* Edges of a histogram's buckets: powers of two, from 1 us to 69 s. */
#define POWER_FIRST 10
#define POWER_LAST  36

static json_t *metric(const char *family, const char *name, const char *unit, const char *type, const char *help,
                      json_t *samples)
{
    char full[96];
    snprintf(full, sizeof full, "sonard_%s%s%s", family, name, unit);
    return json_pack("{s:s, s:s, s:s, s:o}", "name", full, "type", type, "help", help, "samples", samples);
}

static json_t *sample(const char *label, const char *value, json_t *number)
{
    return label ? json_pack("{s:{s:s}, s:o}", "labels", label, value, "value", number)
                 : json_pack("{s:{}, s:o}", "labels", "value", number);
}

static void add_counters(json_t *metrics, const struct counter *counter, unsigned n)
{
    for (unsigned k = 0; k < n; k++) {
        json_t *one = json_pack("[o]", sample(NULL, NULL, json_integer((json_int_t)counter[k].value)));
        json_array_append_new(metrics, metric("", counter[k].name, "_total", "counter", counter[k].help, one));
    }
}

static void add_gauge(json_t *metrics, const char *name, const char *help, json_t *value)
{
    json_array_append_new(metrics,
                          metric("", name, "", "gauge", help, json_pack("[o]", sample(NULL, NULL, value))));
}

/* One metric for each counter, with a sample for each sonar. */
static void add_sensors(const struct daemon *d, const struct pipeline_stats *pipe, json_t *metrics)
{
    struct counter counter[CONF_MAX_SONARS][COUNTERS_MAX];
    json_t *pings = json_array(), *heard = json_array();
    const uint64_t lost = moment_lost_sonars(d);
    unsigned n = 0;
    for (int i = 0; i < d->conf.n_sonars; i++) {
        const char *name = d->conf.sonar[i].name;
        struct source_stats s;
        source_stats(d->source[i], &s);
        n = counters_sensor(&s, pipe->dropped[i], counter[i]);
        json_array_append_new(pings, sample("sensor", name, json_integer((json_int_t)s.device.pings)));
        json_array_append_new(heard, sample("sensor", name, json_integer(!(lost >> i & 1))));
    }
    json_array_append_new(metrics, metric("sensor_", "pings", "_total", "counter", "pings heard", pings));
    json_array_append_new(metrics, metric("sensor_", "heard", "", "gauge", "1: it is heard at present", heard));
    for (unsigned k = 0; k < n; k++) {
        json_t *samples = json_array();
        for (int i = 0; i < d->conf.n_sonars; i++)
            json_array_append_new(
                samples, sample("sensor", d->conf.sonar[i].name, json_integer((json_int_t)counter[i][k].value)));
        json_array_append_new(
            metrics, metric("sensor_", counter[0][k].name, "_total", "counter", counter[0][k].help, samples));
    }
}

static json_t *histogram(const char *stage, struct latency *l)
{
    const double count = (double)atomic_load(&l->count);
    json_t *buckets = json_array();
    for (unsigned power = POWER_FIRST; power <= POWER_LAST; power += 2)
        json_array_append_new(buckets, json_pack("[f, I]", (double)((1ull << power) - 1) * 1e-9,
                                                 (json_int_t)latency_below(l, power)));
    return json_pack("{s:{s:s}, s:f, s:f, s:o, s:o, s:o, s:o, s:o}", "labels", "stage", stage, "count", count,
                     "sum_s", (double)atomic_load(&l->sum_ns) * 1e-9, "p50_us",
                     say_real((double)latency_quantile(l, 0.5) * 1e-3, 10), "p99_us",
                     say_real((double)latency_quantile(l, 0.99) * 1e-3, 10), "p999_us",
                     say_real((double)latency_quantile(l, 0.999) * 1e-3, 10), "max_us",
                     say_real((double)atomic_load(&l->max_ns) * 1e-3, 10), "buckets", buckets);
}

static json_t *stages_json(const struct daemon *d)
{
    static const char *const words[] = {
        [PIPELINE_EXTRACT] = "extract", [PIPELINE_MAPS] = "maps", [PIPELINE_WHOLE] = "ping_to_picture"};
    json_t *samples = json_array();
    for (int stage = 0; stage < PIPELINE_STAGES; stage++)
        json_array_append_new(samples,
                              histogram(words[stage], pipeline_latency(d->pipeline, (enum pipeline_stage)stage)));
    if (d->server)
        json_array_append_new(samples, histogram("request", server_latency(d->server)));
    return samples;
}

json_t *stats_method(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    struct daemon *d = call->daemon;
    struct pipeline_stats pipe;
    struct server_stats server = {0};
    struct counter counter[COUNTERS_MAX];
    if (!rpc_only(params, keys, error))
        return NULL;
    pipeline_stats(d->pipeline, &pipe);
    if (d->server)
        server_stats(d->server, &server);
    const double uptime_s = (double)(loop_now(d->loop) - d->start_ns) * 1e-9;
    json_t *metrics = json_array();
    add_gauge(metrics, "uptime_seconds", "since the start", say_real(uptime_s, 1e3));
    add_gauge(metrics, "pings_waiting", "pings in the queue", json_integer((json_int_t)pipe.waiting));
    add_gauge(metrics, "clients_now", "clients connected", json_integer((json_int_t)server.clients_now));
    add_gauge(metrics, "grid_cells", "cells of the grid in use", json_integer((json_int_t)pipe.grid.cells));
    add_counters(metrics, counter, counters_pipeline(&pipe, counter));
    add_counters(metrics, counter, counters_server(&server, counter));
    add_sensors(d, &pipe, metrics);
    json_array_append_new(metrics, metric("", "latency", "_seconds", "histogram",
                                          "time that a stage takes, or from a ping's last byte to its picture",
                                          stages_json(d)));
    return json_pack("{s:s, s:o}", "version", SONARD_VERSION, "metrics", metrics);
}
