/* SPDX-License-Identifier: MIT */
/* The methods about sonard itself: how it is, and what its sensors do; sonard-protocol(7) has every shape. */
#include <stdio.h>
#include <string.h>

#include "aux_status.h"
#include "counters.h"
#include "data_word.h"
#include "drift_words.h"
#include "grid_methods.h"
#include "daemon/input/aux_sensors.h"
#include "methods.h"
#include "query_context.h"
#include "reference.h"
#include "daemon/fit.h"
#include "core/log.h"
#include "daemon/plan_show.h"
#include "daemon/replay.h"
#include "json_units.h"

static void write_bus(struct json_out *out, const struct port_bus *bus)
{
    static const char *const words[] = {[BUS_DOWN] = "down",
                                        [BUS_UP] = "up",
                                        [BUS_WARNING] = "warning",
                                        [BUS_PASSIVE] = "passive",
                                        [BUS_OFF] = "off"};
    json_member_open(out, "bus", '{');
    json_member_word(out, "state", words[bus->state]);
    json_member_count(out, "tx_errors", bus->tx_errors);
    json_member_count(out, "rx_errors", bus->rx_errors);
    json_member_count(out, "error_frames", bus->error_frames);
    json_member_count(out, "bus_offs", bus->bus_offs);
    json_member_count(out, "restarts", bus->restarts);
    json_member_count(out, "controller_overflows", bus->controller_overflows);
    json_member_count(out, "transfer_errors", bus->transfer_errors);
    json_member_count(out, "not_sent", bus->not_sent);
    json_out_close(out, '}');
}

static void write_clock(struct json_out *out, const struct clock_report *clock)
{
    json_member_open(out, "clock", '{');
    json_member_flag(out, "used", clock->running);
    json_member_count(out, "restarts", clock->restarts);
    if (clock->running) {
        json_out_name(out, "offset_s");
        json_out_real(out, clock->offset_s);
        json_out_name(out, "drift_ppm");
        json_out_real(out, clock->drift * 1e6);
        json_out_name(out, "jitter_s");
        json_out_real(out, clock->jitter_s);
    }
    json_out_close(out, '}');
}

/* The stages in their order; null: none. Thresholds are of the last turn, as the names say. */
static void write_threshold(struct json_out *out, const char *name, int threshold)
{
    if (threshold < 0)
        json_member_null(out, name);
    else
        json_member_count(out, name, (uint64_t)threshold);
}

static void write_cleanup(struct json_out *out, const struct conf_extract *c, const struct cleanup_conf *wired,
                          const struct cleanup_state *s)
{
    if (!cleanup_wanted(wired)) {
        json_member_null(out, "cleanup");
        return;
    }
    json_member_open(out, "cleanup", '{');
    json_member_open(out, "stages", '[');
    if (wired->median)
        json_out_word(out, wired->median == 3 ? "median 3x3" : "median 5x5");
    if (wired->otsu)
        json_out_word(out, "otsu");
    if (wired->clahe)
        json_out_word(out, "clahe");
    if (wired->classes)
        json_out_word(out, "classes");
    json_out_close(out, ']');
    json_member_count(out, "delay_pings", (uint64_t)cleanup_delay(wired));
    json_member_count(out, "held", s->held);
    json_member_count(out, "rows", s->rows);
    json_member_count(out, "restarts", s->restarts);
    json_member_count(out, "not_cleaned", s->passed);
    write_threshold(out, "last_turn_otsu", s->otsu);
    write_threshold(out, "last_turn_lowest_class", s->lowest);
    json_member_word(out, "order", c->order == CONF_ORDER_PAPER ? "paper" : "safe");
    json_out_close(out, '}');
}

/* The object is left open. */
static void write_open_sensor(struct json_out *out, const struct methods_env *d, int i,
                              const struct pipeline_stats *pipe)
{
    const struct conf_sonar *conf = &d->conf.sonar[i];
    const char *doubt = law_doubt_text(pipe->law_doubt[i]);
    struct counter counter[COUNTERS_MAX];
    struct source_stats s;
    source_stats(d->source[i], &s);
    const uint64_t last_ns = s.device.last_ping_ns;
    const unsigned n = counters_sensor(&s, pipe->dropped[i], counter);
    json_out_open(out, '{');
    json_member_text(out, "name", conf->name);
    json_member_text(out, "device", conf->device);
    json_member_text(out, "port", conf->port);
    json_member_word(out, "state",
                     source_state_word(s.open || (d->replay && !(d->told >> i & 1)), s.device.state));
    json_member_text(out, "what", s.device.what);
    json_member_metres(out, "range_m", s.device.range_m);
    json_member_count(out, "pings", s.device.pings);
    json_member_age(out, "last_ping_age_s", last_ns ? (double)(loop_now(d->loop) - last_ns) * 1e-9 : -1);
    for (unsigned k = 0; k < n; k++)
        json_member_count(out, counter[k].name, counter[k].value);
    if (s.device.has_clock)
        write_clock(out, &s.device.clock);
    if (s.bus.state != BUS_NONE)
        write_bus(out, &s.bus);
    json_member_text(out, "background", template_word(&d->templates.of[i]));
    write_cleanup(out, &d->conf.extract, pipeline_cleanup(d->pipeline, i), &pipe->cleanup[i]);
    json_member_count(out, "own_bearings", pipe->own_bearings[i]);
    if (doubt)
        json_member_text(out, "amplitude_doubt", doubt);
    else
        json_member_null(out, "amplitude_doubt");
    const char *deaf = hearing_doubt_text(pipe->hearing[i]);
    if (deaf)
        json_member_text(out, "hearing_doubt", deaf);
    else
        json_member_null(out, "hearing_doubt");
    reference_write(out, d, &pipe->reference[i]);
    if (s.device.other_settings[0])
        json_member_text(out, "other_settings", s.device.other_settings);
    else
        json_member_null(out, "other_settings");
    json_member_flag(out, "contested", s.device.contested);
    if (s.port_error.text[0])
        json_member_outside(out, "port_error", s.port_error.text);
}

bool sensor_asked(const struct methods_env *d, const json_t *params, int *sensor, struct rpc_error *error)
{
    const char *name = params_text(params, "sensor");
    char names[CONF_MAX_SONARS * (sizeof d->conf.sonar[0].name + 2)];
    size_t used = 0;
    if (d->conf.n_sonars == 0)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "no sonar is configured");
    for (*sensor = 0; name && *sensor < d->conf.n_sonars; ++*sensor) {
        const char *one = d->conf.sonar[*sensor].name;
        if (strcmp(one, name) == 0)
            return true;
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", *sensor ? ", " : "", one);
    }
    return !name ||
           rpc_refuse(error, RPC_INVALID_PARAMS, "parameter 'sensor' is %.40s, expected one of: %s", name, names);
}

/* An attitude that is too old is none: who reads it may not look at its age. */
static void write_attitude(struct json_out *out, const struct methods_env *d, const struct pose *newest)
{
    double rpy[3], age_s;
    const char *sender;
    if (pose_log_missing(&d->poses, loop_now(d->loop), &age_s, &sender) == POSE_ATTITUDE) {
        json_member_null(out, "attitude_deg");
        return;
    }
    quat_to_rpy(newest->attitude, &rpy[0], &rpy[1], &rpy[2]);
    json_member_open(out, "attitude_deg", '[');
    for (int i = 0; i < 3; i++)
        json_out_rounded(out, geo_deg(rpy[i]), PER_DEGREES);
    json_out_close(out, ']');
}

/* As map_slice has it: also the last one of a capture whose clock stands at its end. */
static void write_position(struct json_out *out, const struct methods_env *d, const struct pose *newest)
{
    struct pose now;
    if (query_whole_pose(d, &now))
        json_member_metres3(out, "position_m", now.position_m);
    else if (d->replay && (newest->has & POSE_POSITION))
        json_member_metres3(out, "position_m", newest->position_m);
    else
        json_member_null(out, "position_m");
}

/* How old each part that was ever given may be, as it is in force: with max_age = auto that changes. */
static void write_max_age(struct json_out *out, const struct methods_env *d)
{
    json_member_open(out, "max_age_s", '{');
    for (unsigned i = 0; i < QUERY_POSE_PARTS; i++)
        json_member_known(out, query_pose_parts[i], pose_log_last_ns(&d->poses, 1u << i) > 0,
                          (double)pose_log_max_age_ns(&d->poses, 1u << i) * 1e-9, 1e3);
    json_out_close(out, '}');
}

/* As answers take it: less by how far the vehicle may have sunk since. */
static void write_altitude(struct json_out *out, const struct methods_env *d)
{
    struct pose now;
    pose_log_at(&d->poses, loop_now(d->loop), &now);
    json_member_known(out, "altitude_m", now.has & POSE_ALTITUDE, now.altitude_m, PER_METRES);
}

/* The bound that clients send of the vehicle's speed. */
static void write_bound(struct json_out *out, const struct methods_env *d)
{
    const struct drift_log *unseen = &d->poses.unseen;
    const bool used = drift_log_in_use(unseen, loop_now(d->loop));
    const char *doubt = drift_bound_doubt(d);
    json_member_open(out, "speed_bound", '{');
    json_member_word(out, "state",
                     used                                       ? "used"
                     : !doubt[0]                                ? "none"
                     : d->poses.no_bound || unseen->set.bounded ? "lost"
                                                                : "not used");
    json_member_known(out, "level_mps", used, unseen->mps[DRIFT_LEVEL], 1e3);
    json_member_known(out, "vertical_mps", used, unseen->mps[DRIFT_VERTICAL], 1e3);
    json_member_text(out, "why", doubt);
    json_out_close(out, '}');
}

static void write_pose(struct json_out *out, const struct methods_env *d)
{
    char missing[QUERY_REASON_SIZE], drift[QUERY_REASON_SIZE];
    struct pose p;
    pose_log_newest(&d->poses, &p);
    json_member_open(out, "pose", '{');
    json_member_age(out, "age_s", query_pose_age_s(d));
    json_member_open(out, "has", '[');
    for (unsigned i = 0; i < QUERY_POSE_PARTS; i++)
        if (p.has & (1u << i))
            json_out_word(out, query_pose_parts[i]);
    json_out_close(out, ']');
    write_max_age(out, d);
    write_attitude(out, d, &p);
    write_position(out, d, &p);
    write_altitude(out, d);
    json_member_count(out, "count", d->poses.taken);
    json_member_count(out, "refused", d->poses.refused);
    json_member_count(out, "jumps", d->poses.discontinuities);
    json_member_count(out, "withdrawn", d->poses.withdrawn);
    json_member_text(out, "missing", query_pose_missing(d, missing));
    json_member_text(out, "drift", drift_sentence(d, drift));
    write_bound(out, d);
    json_member_text(out, "doubt", d->velocity_doubt.doubted ? VELOCITY_DOUBT_TEXT : "");
    json_out_close(out, '}');
}

/* null: nothing was measured, as in a replay. */
static void write_latency(struct json_out *out, struct latency *l)
{
    if (atomic_load(&l->count) == 0) {
        json_member_null(out, "latency_us");
        return;
    }
    json_member_open(out, "latency_us", '{');
    json_member_real(out, "p50", (double)latency_quantile(l, 0.5) * 1e-3, 10);
    json_member_real(out, "p99", (double)latency_quantile(l, 0.99) * 1e-3, 10);
    json_member_real(out, "p999", (double)latency_quantile(l, 0.999) * 1e-3, 10);
    json_member_real(out, "max", (double)atomic_load(&l->max_ns) * 1e-3, 10);
    json_out_close(out, '}');
}

static void write_pipeline(struct json_out *out, const struct methods_env *d, const struct pipeline_stats *s)
{
    uint64_t dropped = 0;
    for (int i = 0; i < d->conf.n_sonars; i++)
        dropped += s->dropped[i];
    json_member_open(out, "pipeline", '{');
    json_member_count(out, "threads", (uint64_t)d->conf.pipeline.threads);
    json_member_count(out, "queue", (uint64_t)d->conf.pipeline.queue);
    json_member_count(out, "pings", s->submitted);
    json_member_count(out, "waiting", s->waiting);
    json_member_count(out, "dropped", dropped);
    json_member_count(out, "records_left_out", s->records_left_out);
    write_latency(out, pipeline_latency(d->pipeline, PIPELINE_WHOLE));
    json_out_close(out, '}');
}

static void write_grid(struct json_out *out, const struct sphere_stats *g)
{
    json_member_open(out, "grid", '{');
    json_member_count(out, "cells", g->cells);
    json_member_count(out, "directions", g->directions);
    json_member_count(out, "pinged", g->pinged);
    json_member_count(out, "cells_lost", g->cells_lost);
    json_member_count(out, "out_of_range", g->out_of_range);
    json_member_count(out, "no_attitude", g->no_attitude);
    json_member_count(out, "recentred", g->recentred);
    json_member_count(out, "turned", g->turned);
    json_out_close(out, '}');
}

static void write_server(struct json_out *out, const struct methods_env *d)
{
    struct server_stats s = {0};
    if (d->server)
        server_stats(d->server, &s);
    json_member_open(out, "server", '{');
    json_member_count(out, "clients_now", s.clients_now);
    json_member_count(out, "clients_total", s.clients_total);
    json_member_count(out, "clients_refused", s.clients_refused);
    json_member_count(out, "clients_cut", s.clients_cut);
    json_member_count(out, "requests", s.requests);
    json_member_count(out, "errors", s.errors);
    json_member_count(out, "notifications_sent", s.notifications_sent);
    json_member_count(out, "notifications_skipped", s.notifications_skipped);
    json_out_close(out, '}');
}

/* The object is left open. */
static void write_open_record(struct json_out *out, const struct methods_env *d)
{
    struct record_status s;
    record_status(d->record, &s);
    const struct segments_status *r = &s.segments;
    const bool paused = record_paused(d->record);
    json_member_flag(out, "recording", r->recording && !paused);
    json_member_flag(out, "paused", paused);
    json_member_outside(out, "path", r->path);
    json_member_count(out, "parts", r->segments);
    json_member_count(out, "messages", r->messages);
    json_member_count(out, "recording_messages", s.messages_here);
    json_member_age(out, "recording_age_s", s.since_ns ? (double)(loop_now(d->loop) - s.since_ns) * 1e-9 : -1);
    json_member_count(out, "lost_messages", r->lost_messages);
    json_member_count(out, "overflows", s.overflows);
    json_member_count(out, "waiting_bytes", s.waiting_bytes);
    json_member_count(out, "errors", r->errors);
    json_member_text(out, "error", r->error.text);
}

static void write_record(struct json_out *out, const struct methods_env *d)
{
    if (!d->record) {
        json_member_null(out, "record");
        return;
    }
    json_member_open(out, "record", '{');
    write_open_record(out, d);
    json_out_close(out, '}');
}

/* Started or stopped; a second time changes nothing. */
static bool pause_record(const struct methods_env *d, bool paused, struct json_out *out, struct rpc_error *error)
{
    if (!d->record) {
        rpc_refuse(error, RPC_INVALID_REQUEST, "nothing can be recorded: %s",
                   d->playing ? "this is a replay" : "[record] directory names no folder");
        return false;
    }
    if (record_paused(d->record) != paused)
        log_line(LOG_NOTICE, "record", "recording %s on request", paused ? "ends" : "begins");
    record_pause(d->record, paused, loop_now(d->loop));
    json_out_open(out, '{');
    write_open_record(out, d);
    json_out_close(out, '}');
    return true;
}

bool method_record_start(const struct rpc_call *call, json_t *params, struct json_out *out,
                         struct rpc_error *error)
{
    (void)params;
    return pause_record(call->daemon, false, out, error);
}

bool method_record_stop(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params;
    return pause_record(call->daemon, true, out, error);
}

static void write_replay(struct json_out *out, const struct methods_env *d)
{
    struct replay_state s;
    replay_state(d->playing, d->loop, &s);
    json_out_name(out, "length_s");
    if (s.length_s < 0)
        json_out_null(out);
    else
        json_out_rounded(out, s.length_s, 1e3);
    json_member_real(out, "position_s", s.position_s, 1e3);
    json_member_real(out, "speed", s.speed, 1e3);
    json_member_flag(out, "paused", s.paused);
    json_member_flag(out, "jumping", s.jumping);
}

static void write_misfit(void *ctx, const char *sentence)
{
    json_out_text(ctx, sentence);
}

bool method_status(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    (void)params;
    (void)error;
    struct pipeline_stats pipe;
    pipeline_stats(d->pipeline, &pipe);
    const char *mode = !d->replay ? "live" : d->replay_ended ? "replay, ended" : "replay";
    json_out_open(out, '{');
    json_member_text(out, "version", SONARD_VERSION);
    json_member_real(out, "uptime_s", (double)(loop_now(d->loop) - d->start_ns) * 1e-9, 1e3);
    json_member_real(out, "t_unix", query_unix_s(d), 1e6);
    json_member_word(out, "mode", mode);
    json_member_outside(out, "config", d->conf_name);
    json_member_text(out, "data", status_data_word(d));
    json_member_open(out, "misfits", '[');
    fit_judge(&d->conf, write_misfit, out);
    json_out_close(out, ']');
    json_member_open(out, "sensors", '[');
    for (int i = 0; i < d->conf.n_sonars; i++) {
        write_open_sensor(out, d, i, &pipe);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
    write_pose(out, d);
    write_pipeline(out, d, &pipe);
    write_grid(out, &pipe.grid);
    write_server(out, d);
    write_record(out, d);
    grid_list_write(out, d);
    aux_status_write(out, d);
    if (d->playing) {
        json_member_open(out, "replay", '{');
        write_replay(out, d);
        json_out_close(out, '}');
    } else {
        json_member_null(out, "replay");
    }
    json_out_close(out, '}');
    return true;
}

/* Where a sonar sits and what it is set to, beside what it does. */
static void write_angles(struct json_out *out, const char *name, const double *rad, int n)
{
    json_member_open(out, name, '[');
    for (int i = 0; i < n; i++)
        json_out_rounded(out, geo_deg(rad[i]), PER_DEGREES);
    json_out_close(out, ']');
}

/* What the sonar is told, where it can be told something else while it runs (reload); null: nowhere. */
static void write_tuning(struct json_out *out, const struct methods_env *d, int i)
{
    const struct conf_sonar *c = &d->conf.sonar[i];
    static const char *const modes[] = {
        [CONF_MODE_AUTO] = "auto", [CONF_MODE_TRANSMIT] = "transmit", [CONF_MODE_REQUEST] = "request"};
    const struct device_ops *ops = device_find(c->device);
    const struct device_key *range = device_key_find(ops, "range"), *gain = device_key_find(ops, "gain");
    if (!ops->retune) {
        json_member_null(out, "tuning");
        return;
    }
    json_member_open(out, "tuning", '{');
    json_member_metres(out, "range_m", c->range_m);
    json_member_metres(out, "range_least_m", range->lo);
    json_member_metres(out, "range_most_m", range->hi);
    json_member_known(out, "gain", c->gain >= 0, c->gain, 1);
    json_member_count(out, "gain_most", (uint64_t)gain->hi);
    if (device_key_find(ops, "mode") && !plan_is_steered(&d->conf, i))
        json_member_word(out, "mode", modes[c->mode]);
    else
        json_member_null(out, "mode");
    json_out_close(out, '}');
}

static void write_placed(struct json_out *out, const struct methods_env *d, int i,
                         const struct pipeline_stats *pipe)
{
    const struct conf_sonar *c = &d->conf.sonar[i];
    write_open_sensor(out, d, i, pipe);
    json_member_metres3(out, "mount_m", c->mount_m);
    write_angles(out, "rotation_deg", c->rotation_rad, 3);
    write_angles(out, "sector_deg", c->sector_rad, 2);
    json_member_flag(out, "heard", !(query_lost_sonars(d) >> i & 1));
    write_tuning(out, d, i);
    json_out_close(out, '}');
}

bool method_sensors(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    (void)params;
    (void)error;
    struct pipeline_stats pipe;
    pipeline_stats(d->pipeline, &pipe);
    json_out_put(out, "{\"sensors\":[");
    for (int i = 0; i < d->conf.n_sonars; i++)
        write_placed(out, d, i, &pipe);
    json_out_put(out, "]}");
    return true;
}

bool method_plan(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    (void)params;
    (void)error;
    plan_write(&d->conf, out);
    return true;
}

bool method_version(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call;
    (void)params;
    (void)error;
    json_out_open(out, '{');
    json_member_text(out, "version", SONARD_VERSION);
    json_member_count(out, "protocol", 1);
    json_out_close(out, '}');
    return true;
}

bool method_reload(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    (void)params;
    return reload_now(&d->reload, out, error);
}

bool method_reload_check(const struct rpc_call *call, json_t *params, struct json_out *out,
                         struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    const char *file = params_text(params, "file"), *text = params_text(params, "text");
    return reload_check(&d->reload, file, text ? text : "", out, error);
}

bool method_replay(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    const struct methods_env *d = call->daemon;
    struct replay_state s;
    if (!d->playing) {
        rpc_refuse(error, RPC_INVALID_REQUEST, "no capture is played: sonard --replay plays one");
        return false;
    }
    replay_state(d->playing, d->loop, &s);
    if (params_has(params, "speed") || params_has(params, "pause"))
        replay_pace(d->playing, d->loop, params_has(params, "speed") ? params_number(params, "speed") : s.speed,
                    params_has(params, "pause") ? params_is(params, "pause", "yes") : s.paused);
    if (params_has(params, "to_s"))
        replay_jump(d->playing, d->loop, params_number(params, "to_s"));
    json_out_open(out, '{');
    write_replay(out, d);
    json_out_close(out, '}');
    return true;
}
