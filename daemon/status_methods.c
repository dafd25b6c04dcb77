/* SPDX-License-Identifier: MIT */
/* The methods about sonard itself: how it is, and what its sensors do; sonard-protocol(7) has every shape. */
#include "counters.h"
#include "grid_methods.h"
#include "instruments.h"
#include "methods.h"
#include "moment.h"
#include "plan_show.h"
#include "say.h"

static const char *state_word(const struct source_stats *s, bool replay)
{
    static const char *const words[] = {[DEVICE_CLOSED] = "closed",
                                        [DEVICE_IDENTIFY] = "asking who is there",
                                        [DEVICE_SETUP] = "setting up",
                                        [DEVICE_RUNNING] = "running",
                                        [DEVICE_SILENT] = "silent"};
    return s->open || replay ? words[s->device.state] : "no port";
}

static json_t *bus_json(const struct port_bus *bus)
{
    static const char *const words[] = {[BUS_DOWN] = "down",
                                        [BUS_UP] = "up",
                                        [BUS_WARNING] = "warning",
                                        [BUS_PASSIVE] = "passive",
                                        [BUS_OFF] = "off"};
    return json_pack("{s:s, s:i, s:i, s:I, s:I, s:I, s:I, s:I, s:I}", "state", words[bus->state], "tx_errors",
                     (int)bus->tx_errors, "rx_errors", (int)bus->rx_errors, "error_frames",
                     (json_int_t)bus->error_frames, "bus_offs", (json_int_t)bus->bus_offs, "restarts",
                     (json_int_t)bus->restarts, "controller_overflows", (json_int_t)bus->controller_overflows,
                     "transfer_errors", (json_int_t)bus->transfer_errors, "not_sent", (json_int_t)bus->not_sent);
}

static json_t *clock_json(const struct clock_report *clock)
{
    if (!clock->running)
        return json_pack("{s:b, s:I}", "used", 0, "restarts", (json_int_t)clock->restarts);
    return json_pack("{s:b, s:I, s:f, s:f, s:f}", "used", 1, "restarts", (json_int_t)clock->restarts, "offset_s",
                     clock->offset_s, "drift_ppm", clock->drift * 1e6, "jitter_s", clock->jitter_s);
}

/* The stages in their order; null: none. Thresholds are of the last turn, as the names say. */
static json_t *cleanup_json(const struct conf_extract *c, const struct cleanup_conf *wired,
                            const struct cleanup_state *s)
{
    if (!cleanup_wanted(wired))
        return json_null();
    json_t *stages = json_array();
    if (wired->median)
        json_array_append_new(stages, json_string(wired->median == 3 ? "median 3x3" : "median 5x5"));
    if (wired->otsu)
        json_array_append_new(stages, json_string("otsu"));
    if (wired->clahe)
        json_array_append_new(stages, json_string("clahe"));
    if (wired->classes)
        json_array_append_new(stages, json_string("classes"));
    return json_pack("{s:o, s:i, s:i, s:i, s:I, s:I, s:o, s:o, s:s}", "stages", stages, "delay_pings",
                     (int)cleanup_delay(wired), "held", (int)s->held, "rows", (int)s->rows, "restarts",
                     (json_int_t)s->restarts, "not_cleaned", (json_int_t)s->passed, "last_turn_otsu",
                     s->otsu < 0 ? json_null() : json_integer(s->otsu), "last_turn_lowest_class",
                     s->lowest < 0 ? json_null() : json_integer(s->lowest), "order",
                     c->order == CONF_ORDER_PAPER ? "paper" : "safe");
}

static json_t *sensor_json(const struct daemon *d, int i, const struct pipeline_stats *pipe)
{
    const struct conf_sonar *conf = &d->conf.sonar[i];
    struct source_stats s;
    source_stats(d->source[i], &s);
    uint64_t now = loop_now(d->loop);
    double last_s = s.device.last_ping_ns ? (double)(now - s.device.last_ping_ns) * 1e-9 : -1;
    json_t *j = json_pack("{s:s, s:s, s:s, s:s, s:s, s:o, s:I, s:o}", "name", conf->name, "device", conf->device,
                          "port", conf->port, "state", state_word(&s, d->replay), "what", s.device.what, "range_m",
                          say_metres(s.device.range_m), "pings", (json_int_t)s.device.pings, "last_ping_age_s",
                          say_age(last_s));
    struct counter counter[COUNTERS_MAX];
    const unsigned n = counters_sensor(&s, pipe->dropped[i], counter);
    for (unsigned k = 0; k < n; k++)
        json_object_set_new(j, counter[k].name, json_integer((json_int_t)counter[k].value));
    if (s.device.has_clock)
        json_object_set_new(j, "clock", clock_json(&s.device.clock));
    if (s.bus.state != BUS_NONE)
        json_object_set_new(j, "bus", bus_json(&s.bus));
    json_object_set_new(j, "background", json_string(template_word(&d->template[i])));
    json_object_set_new(j, "cleanup",
                        cleanup_json(&d->conf.extract, pipeline_cleanup(d->pipeline, i), &pipe->cleanup[i]));
    const char *doubt = law_doubt_text(pipe->law_doubt[i]);
    json_object_set_new(j, "amplitude_doubt", doubt ? json_string(doubt) : json_null());
    if (s.port_error[0])
        json_object_set_new(j, "port_error", json_string(s.port_error));
    return j;
}

const char *status_data_word(const struct daemon *d)
{
    struct picture_frame frame;
    picture_get_frame(pipeline_picture(d->pipeline), &frame);
    uint64_t now = loop_now(d->loop);
    uint64_t lost = moment_lost_sonars(d), all = (1ull << d->conf.n_sonars) - 1;
    if (!frame.pings || lost == all)
        return "no data from the sonar";
    if (lost)
        return "no data from one of the sonars";
    /* Before silence: pings without a pose are not used, which looks like it. */
    if (frame.ned && !pose_log_fresh(&d->poses, now))
        return "the pose is too old";
    if (now > frame.t_ping_ns && (double)(now - frame.t_ping_ns) * 1e-9 > d->conf.grid.clear_for_s)
        return "the sonar has fallen silent";
    return "ok";
}

static json_t *pose_json(const struct daemon *d)
{
    static const char *const parts[] = {"attitude", "position", "depth", "velocity"};
    struct pose p;
    pose_log_newest(&d->poses, &p);
    json_t *has = json_array();
    for (unsigned i = 0; i < 4; i++)
        if (p.has & (1u << i))
            json_array_append_new(has, json_string(parts[i]));
    return json_pack("{s:o, s:o, s:I, s:I, s:I}", "age_s", say_age(moment_pose_age_s(d)), "has", has, "count",
                     (json_int_t)d->poses.taken, "refused", (json_int_t)d->poses.refused, "jumps",
                     (json_int_t)d->poses.jumps);
}

/* null: nothing was measured, as in a replay. */
static json_t *latency_json(struct latency *l)
{
    if (atomic_load(&l->count) == 0)
        return json_null();
    return json_pack("{s:o, s:o, s:o, s:o}", "p50", say_real((double)latency_quantile(l, 0.5) * 1e-3, 10), "p99",
                     say_real((double)latency_quantile(l, 0.99) * 1e-3, 10), "p999",
                     say_real((double)latency_quantile(l, 0.999) * 1e-3, 10), "max",
                     say_real((double)atomic_load(&l->max_ns) * 1e-3, 10));
}

static json_t *pipeline_json(const struct daemon *d, const struct pipeline_stats *s)
{
    uint64_t dropped = 0;
    for (int i = 0; i < d->conf.n_sonars; i++)
        dropped += s->dropped[i];
    return json_pack("{s:i, s:i, s:I, s:i, s:I, s:o}", "threads", d->conf.pipeline.threads, "queue",
                     d->conf.pipeline.queue, "pings", (json_int_t)s->submitted, "waiting", (int)s->waiting,
                     "dropped", (json_int_t)dropped, "latency_us",
                     latency_json(pipeline_latency(d->pipeline, PIPELINE_WHOLE)));
}

static json_t *grid_json(const struct sphere_stats *g)
{
    return json_pack("{s:i, s:i, s:i, s:I, s:I, s:I, s:I, s:I}", "cells", (int)g->cells, "directions",
                     (int)g->directions, "pinged", (int)g->pinged, "cells_lost", (json_int_t)g->cells_lost,
                     "out_of_range", (json_int_t)g->out_of_range, "no_attitude", (json_int_t)g->no_attitude,
                     "recentred", (json_int_t)g->recentred, "turned", (json_int_t)g->turned);
}

static json_t *server_json(const struct daemon *d)
{
    struct server_stats s = {0};
    if (d->server)
        server_stats(d->server, &s);
    return json_pack("{s:I, s:I, s:I, s:I, s:I, s:I, s:I, s:I}", "clients_now", (json_int_t)s.clients_now,
                     "clients_total", (json_int_t)s.clients_total, "clients_refused",
                     (json_int_t)s.clients_refused, "clients_cut", (json_int_t)s.clients_cut, "requests",
                     (json_int_t)s.requests, "errors", (json_int_t)s.errors, "notifications_sent",
                     (json_int_t)s.notifications_sent, "notifications_skipped",
                     (json_int_t)s.notifications_skipped);
}

static json_t *record_json(const struct daemon *d)
{
    if (!d->record)
        return json_null();
    struct record_status s;
    record_status(d->record, &s);
    const struct parts_status *r = &s.parts;
    return json_pack("{s:b, s:s, s:I, s:I, s:I, s:I, s:I, s:I, s:s}", "recording", r->recording, "path", r->path,
                     "parts", (json_int_t)r->parts, "messages", (json_int_t)r->messages, "lost_messages",
                     (json_int_t)r->lost_messages, "overflows", (json_int_t)s.overflows, "waiting_bytes",
                     (json_int_t)s.waiting_bytes, "errors", (json_int_t)r->errors, "error", r->error);
}

json_t *status_method(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    struct daemon *d = call->daemon;
    if (!rpc_only(params, keys, error))
        return NULL;
    struct pipeline_stats pipe;
    pipeline_stats(d->pipeline, &pipe);
    json_t *sensors = json_array();
    for (int i = 0; i < d->conf.n_sonars; i++)
        json_array_append_new(sensors, sensor_json(d, i, &pipe));
    const char *mode = !d->replay ? "live" : d->replay_ended ? "replay, ended" : "replay";
    json_t *status = json_pack(
        "{s:s, s:o, s:o, s:s, s:s, s:s, s:o, s:o, s:o, s:o, s:o, s:o}", "version", SONARD_VERSION, "uptime_s",
        say_real((double)(loop_now(d->loop) - d->start_ns) * 1e-9, 1e3), "t_unix", say_real(moment_unix_s(d), 1e6),
        "mode", mode, "config", d->conf_name, "data", status_data_word(d), "sensors", sensors, "pose",
        pose_json(d), "pipeline", pipeline_json(d, &pipe), "grid", grid_json(&pipe.grid), "server", server_json(d),
        "record", record_json(d));
    json_object_set_new(status, "grids", grid_list_json(d));
    instruments_status(d, status);
    return status;
}

/* Where a sonar sits and what it is set to, beside what it does. */
static json_t *placed_json(const struct daemon *d, int i, const struct pipeline_stats *pipe)
{
    const struct conf_sonar *c = &d->conf.sonar[i];
    json_t *j = sensor_json(d, i, pipe);
    json_object_set_new(j, "mount_m", say_metres3(c->mount_m));
    json_object_set_new(j, "rotation_deg",
                        json_pack("[o, o, o]", say_degrees(c->rotation_rad[0]), say_degrees(c->rotation_rad[1]),
                                  say_degrees(c->rotation_rad[2])));
    json_object_set_new(j, "sector_deg",
                        json_pack("[o, o]", say_degrees(c->sector_rad[0]), say_degrees(c->sector_rad[1])));
    json_object_set_new(j, "heard", json_boolean(!(moment_lost_sonars(d) >> i & 1)));
    return j;
}

json_t *status_method_sensors(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    struct daemon *d = call->daemon;
    if (!rpc_only(params, keys, error))
        return NULL;
    struct pipeline_stats pipe;
    pipeline_stats(d->pipeline, &pipe);
    json_t *sensors = json_array();
    for (int i = 0; i < d->conf.n_sonars; i++)
        json_array_append_new(sensors, placed_json(d, i, &pipe));
    return json_pack("{s:o}", "sensors", sensors);
}

json_t *plan_method(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    const struct daemon *d = call->daemon;
    return rpc_only(params, keys, error) ? plan_json(&d->conf) : NULL;
}

json_t *status_method_version(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    (void)call;
    return rpc_only(params, keys, error) ? json_pack("{s:s, s:i}", "version", SONARD_VERSION, "protocol", 1)
                                         : NULL;
}
