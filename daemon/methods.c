/* SPDX-License-Identifier: MIT */
/* The JSON-RPC methods: parameters in, grid's answers out. sonard-protocol(7) documents every shape. */
#include <math.h>
#include <string.h>
#include <time.h>

#include "cluster_methods.h"
#include "daemon.h"
#include "instruments.h"

/* Rounded for people: a hundredth of a millimetre, degree or second is beyond any sonar. */
static json_t *real(double v, double per_unit)
{
    return json_real(round(v * per_unit) / per_unit);
}

static json_t *metres(double m)
{
    return real(m, 1e4);
}

static json_t *degrees(double rad)
{
    return real(geo_deg(rad), 1e4);
}

static json_t *age(double s)
{
    return s < 0 ? json_null() : real(s, 1e3);
}

/* Unix time less the loop's, as of now: the computer's clock may be set while sonard runs. A replay's is Unix time. */
static uint64_t unix_offset_now(const struct daemon *d)
{
    struct timespec t;
    if (d->replay)
        return 0;
    clock_gettime(CLOCK_REALTIME, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec - loop_clock();
}

static double unix_now(const struct daemon *d)
{
    return (double)(loop_now(d->loop) + unix_offset_now(d)) * 1e-9;
}

/* ---- blocked, sectors ---- */

static const char *const frame_words[] = {"body", "ned", NULL};

static struct answer_conf limits(const struct daemon *d)
{
    return (struct answer_conf){.clear_for_s = d->conf.grid.clear_for_s,
                                .move_limit_m = d->conf.grid.move_limit_m};
}

/* Set of the sonars that are not heard at present. A capture's are heard while it plays. */
static uint64_t lost_sonars(const struct daemon *d)
{
    uint64_t lost = 0;
    for (int i = 0; i < d->conf.n_sonars && !d->replay; i++) {
        struct source_stats s;
        source_stats(d->source[i], &s);
        if (!s.open || s.device.state != DEVICE_RUNNING)
            lost |= 1ull << i;
    }
    return lost;
}

static struct answer_now moment(const struct daemon *d)
{
    struct answer_now now = {.now_ns = loop_now(d->loop), .pose = pose_identity, .lost = lost_sonars(d)};
    pose_log_newest(&d->poses, &now.pose);
    now.pose_fresh = pose_log_fresh(&d->poses, now.now_ns);
    return now;
}

static json_t *answer_json(const struct answer *a)
{
    bool blocked = a->state == ANSWER_BLOCKED;
    return json_pack("{s:s, s:o, s:o, s:o, s:o, s:o, s:o, s:s}", "state", answer_state_name(a->state), "range_m",
                     blocked ? metres(a->range_m) : json_null(), "range_sd_m",
                     blocked ? metres(a->range_sd_m) : json_null(), "confidence", real(a->confidence, 1e3),
                     "free_to_m", metres(a->free_to_m), "blind_to_m", metres(a->blind_to_m), "age_s",
                     age(a->age_s), "reason", answer_reason_text(a->reason));
}

/* Half the opening of a cone that the caller did not state: wider than what a level sonar's fan leaves uncertain,
 * narrow enough to lie within the 25 degrees of a Ping360 on a vehicle that pitches a little. */
#define DEFAULT_HALF_ANGLE_DEG 7.5

static json_t *method_blocked(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"azimuth_deg", "elevation_deg", "distance_m", "half_angle_deg",
                                       "radius_m",    "frame",         NULL};
    struct daemon *d = call->daemon;
    double az = 0, el = 0, distance = 0, half = DEFAULT_HALF_ANGLE_DEG, radius = 0;
    int frame = 0;
    if (!rpc_only(params, keys, error) || !rpc_number(params, "azimuth_deg", true, -360, 720, &az, error) ||
        !rpc_number(params, "elevation_deg", false, -90, 90, &el, error) ||
        !rpc_number(params, "distance_m", true, 0, 1e4, &distance, error) ||
        !rpc_number(params, "half_angle_deg", false, 0, 180, &half, error) ||
        !rpc_number(params, "radius_m", false, 0, 1e3, &radius, error) ||
        !rpc_word(params, "frame", frame_words, &frame, error))
        return NULL;
    bool corridor = json_object_get(params, "radius_m");
    if (corridor && json_object_get(params, "half_angle_deg")) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message,
                 "half_angle_deg (a cone) and radius_m (a corridor) exclude each other: give one");
        return NULL;
    }
    struct answer_query q = {.az_rad = geo_rad(az),
                             .el_rad = geo_rad(el),
                             .ned = frame == 1,
                             .distance_m = distance,
                             .corridor = corridor,
                             .half_angle_rad = geo_rad(half),
                             .radius_m = radius};
    struct answer_conf conf = limits(d);
    struct answer_now now = moment(d);
    struct answer a;
    answer_direction(pipeline_picture(d->pipeline), &conf, &now, &q, &a);
    return answer_json(&a);
}

static double pose_age_s(const struct daemon *d)
{
    uint64_t now = loop_now(d->loop);
    struct pose p;
    if (!pose_log_newest(&d->poses, &p))
        return -1;
    return now > p.t_ns ? (double)(now - p.t_ns) * 1e-9 : 0;
}

#define DEFAULT_BAND_DEG 5.0

static json_t *method_sectors(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"count", "frame", "elevation_deg", "distance_m", NULL};
    struct daemon *d = call->daemon;
    int64_t count = 72;
    int frame = 0;
    double band[2] = {-DEFAULT_BAND_DEG, DEFAULT_BAND_DEG}, distance = 0;
    bool given;
    if (!rpc_only(params, keys, error) ||
        !rpc_integer(params, "count", false, 1, ANSWER_SECTORS_MAX, &count, error) ||
        !rpc_word(params, "frame", frame_words, &frame, error) ||
        !rpc_numbers(params, "elevation_deg", -90, 90, 2, band, &given, error) ||
        !rpc_number(params, "distance_m", false, 0, 1e4, &distance, error))
        return NULL;
    if (band[0] >= band[1]) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message,
                 "elevation_deg is [%g, %g]: the first must be below the second", band[0], band[1]);
        return NULL;
    }
    struct answer sector[ANSWER_SECTORS_MAX];
    struct answer_conf conf = limits(d);
    struct answer_now now = moment(d);
    answer_sectors(pipeline_picture(d->pipeline), &conf, &now, frame == 1, geo_rad(band[0]), geo_rad(band[1]),
                   distance, (size_t)count, sector);
    double width_deg = 360.0 / (double)count;
    json_t *list = json_array();
    for (int64_t k = 0; k < count; k++) {
        const struct answer *a = &sector[k];
        json_array_append_new(list, json_pack("{s:o, s:o, s:s, s:o, s:o, s:o}", "azimuth_deg",
                                              real((double)k * width_deg, 1e4), "width_deg", real(width_deg, 1e4),
                                              "state", answer_state_name(a->state), "range_m",
                                              a->state == ANSWER_BLOCKED ? metres(a->range_m) : json_null(),
                                              "free_to_m", metres(a->free_to_m), "age_s", age(a->age_s)));
    }
    return json_pack("{s:s, s:o, s:o, s:o}", "frame", frame_words[frame], "t_unix", real(unix_now(d), 1e6),
                     "pose_age_s", age(pose_age_s(d)), "sectors", list);
}

/* ---- pose ---- */

#define POSE_PAST_S   10.0
#define POSE_FUTURE_S 1.0

static bool pose_time(const struct daemon *d, json_t *params, uint64_t *t_ns, struct rpc_error *error)
{
    double t_unix = unix_now(d), given = t_unix;
    *t_ns = loop_now(d->loop);
    if (!rpc_number(params, "t_unix", false, 0, 1e11, &given, error))
        return false;
    if (!json_object_get(params, "t_unix"))
        return true;
    if (given < t_unix - POSE_PAST_S || given > t_unix + POSE_FUTURE_S) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message,
                 "t_unix is %.3f s off this computer's clock: wanted at most %g s in the past, %g s ahead",
                 given - t_unix, POSE_PAST_S, POSE_FUTURE_S);
        return false;
    }
    double ns = given * 1e9 - (double)unix_offset_now(d);
    *t_ns = ns > 0 ? (uint64_t)ns : 0;
    return true;
}

static bool pose_attitude(json_t *params, struct pose *p, struct rpc_error *error)
{
    double rpy[3], q[4];
    bool has_rpy, has_q;
    if (!rpc_numbers(params, "attitude_deg", -360, 360, 3, rpy, &has_rpy, error) ||
        !rpc_numbers(params, "quaternion", -1.1, 1.1, 4, q, &has_q, error))
        return false;
    if (has_rpy && has_q) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message,
                 "attitude_deg and quaternion exclude each other: give one");
        return false;
    }
    if (has_q && !quat_normalise(q)) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message, "quaternion has not length 1 (w, x, y, z)");
        return false;
    }
    if (has_rpy)
        quat_from_rpy(geo_rad(rpy[0]), geo_rad(rpy[1]), geo_rad(rpy[2]), q);
    if (has_rpy || has_q) {
        memcpy(p->attitude, q, sizeof p->attitude);
        p->has |= POSE_ATTITUDE;
    }
    return true;
}

static bool pose_place(json_t *params, struct pose *p, struct rpc_error *error)
{
    bool placed, moving;
    double depth = 0;
    if (!rpc_numbers(params, "position_m", -1e8, 1e8, 3, p->position_m, &placed, error) ||
        !rpc_number(params, "depth_m", false, -100, 12000, &depth, error) ||
        !rpc_numbers(params, "velocity_mps", -100, 100, 3, p->velocity_mps, &moving, error))
        return false;
    if (placed)
        p->has |= POSE_POSITION | POSE_DEPTH;
    if (json_object_get(params, "depth_m")) {
        p->position_m[2] = depth;
        p->has |= POSE_DEPTH;
    }
    if (moving)
        p->has |= POSE_VELOCITY;
    return true;
}

bool daemon_take_pose(struct daemon *d, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"t_unix",     "position_m",   "depth_m", "attitude_deg",
                                       "quaternion", "velocity_mps", NULL};
    struct pose p = pose_identity;
    if (!rpc_only(params, keys, error) || !pose_time(d, params, &p.t_ns, error) ||
        !pose_attitude(params, &p, error) || !pose_place(params, &p, error)) {
        d->poses.refused++;
        return false;
    }
    if (!p.has) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message,
                 "nothing given: wanted attitude_deg, quaternion, position_m, depth_m or velocity_mps");
    } else if (!pose_log_put(&d->poses, &p)) {
        error->code = RPC_INVALID_PARAMS;
        snprintf(error->message, sizeof error->message, "t_unix is not after that of the pose before");
    } else if (json_object_get(params, "t_unix") && !d->replay) {
        /* what is recorded goes by the capture's clock, which does not step when the computer's is set */
        json_object_set_new(params, "t_unix", json_real((double)(p.t_ns + d->unix_offset_ns) * 1e-9));
    }
    return error->code == 0;
}

static json_t *method_pose(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    if (d->replay) {
        error->code = RPC_INVALID_REQUEST;
        snprintf(error->message, sizeof error->message, "this is a replay: its poses come from the capture");
        return NULL;
    }
    if (!daemon_take_pose(d, params, error))
        return NULL;
    if (json_object_get(params, "attitude_deg") || json_object_get(params, "quaternion"))
        d->pose_input.t_attitude_ns = loop_now(d->loop);
    if (d->record) {
        char *text = json_dumps(params, JSON_COMPACT | JSON_REAL_PRECISION(17));
        if (text)
            record_message(d->record, d->pose_channel, loop_now(d->loop), text, strlen(text));
        free(text);
    }
    return json_pack("{s:b}", "taken", 1);
}

/* ---- status ---- */

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
    json_t *j =
        json_pack("{s:s, s:s, s:s, s:s, s:s, s:o, s:I, s:o}", "name", conf->name, "device", conf->device, "port",
                  conf->port, "state", state_word(&s, d->replay), "what", s.device.what, "range_m",
                  metres(s.device.range_m), "pings", (json_int_t)s.device.pings, "last_ping_age_s", age(last_s));
    const struct {
        const char *name;
        uint64_t value;
    } counters[] = {
        {"frames", s.device.frames},
        {"garbage_bytes", s.device.garbage_bytes},
        {"bad_checksum", s.device.bad_checksum},
        {"bad_frame", s.device.bad_frame},
        {"lost_frames", s.device.lost_frames},
        {"nacks", s.device.nacks},
        {"timeouts", s.device.timeouts},
        {"restarts", s.device.restarts},
        {"reconnects", s.reconnects},
        {"tap_lost_bytes", s.tap.dropped},
        {"tap_refused_bytes", s.tap.refused},
        {"port_lost", s.port_lost},
        {"port_refused", s.port_refused},
        {"bytes_in", s.bytes_in},
        {"bytes_out", s.bytes_out},
        {"dropped", pipe->dropped[i]},
    };
    for (size_t k = 0; k < sizeof counters / sizeof counters[0]; k++)
        json_object_set_new(j, counters[k].name, json_integer((json_int_t)counters[k].value));
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

/* In one word whether the answers rest on a living sonar. */
static const char *data_word(const struct daemon *d)
{
    struct picture_frame frame;
    picture_get_frame(pipeline_picture(d->pipeline), &frame);
    uint64_t now = loop_now(d->loop);
    uint64_t lost = lost_sonars(d), all = (1ull << d->conf.n_sonars) - 1;
    if (!frame.pings || lost == all)
        return "no data from the sonar";
    if (lost)
        return "no data from one of the sonars";
    /* Before silence: pings without a pose are not used, which looks like it. */
    if (frame.ned && !pose_log_fresh(&d->poses, now))
        return "the pose is too old";
    if ((double)(now - frame.t_ping_ns) * 1e-9 > d->conf.grid.clear_for_s)
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
    return json_pack("{s:o, s:o, s:I, s:I}", "age_s", age(pose_age_s(d)), "has", has, "count",
                     (json_int_t)d->poses.taken, "refused", (json_int_t)d->poses.refused);
}

static json_t *pipeline_json(const struct daemon *d, const struct pipeline_stats *s)
{
    struct latency *l = pipeline_latency(d->pipeline);
    uint64_t dropped = 0;
    for (int i = 0; i < d->conf.n_sonars; i++)
        dropped += s->dropped[i];
    return json_pack("{s:i, s:i, s:I, s:i, s:I, s:{s:o, s:o, s:o, s:o}}", "threads", d->conf.pipeline.threads,
                     "queue", d->conf.pipeline.queue, "pings", (json_int_t)s->submitted, "waiting",
                     (int)s->waiting, "dropped", (json_int_t)dropped, "latency_us", "p50",
                     real((double)latency_quantile(l, 0.5) * 1e-3, 10), "p99",
                     real((double)latency_quantile(l, 0.99) * 1e-3, 10), "p999",
                     real((double)latency_quantile(l, 0.999) * 1e-3, 10), "max",
                     real((double)atomic_load(&l->max_ns) * 1e-3, 10));
}

static json_t *grid_json(const struct sphere_stats *g)
{
    return json_pack("{s:i, s:i, s:i, s:I, s:I, s:I, s:I}", "cells", (int)g->cells, "directions",
                     (int)g->directions, "pinged", (int)g->pinged, "cells_lost", (json_int_t)g->cells_lost,
                     "out_of_range", (json_int_t)g->out_of_range, "no_attitude", (json_int_t)g->no_attitude,
                     "recentred", (json_int_t)g->recentred);
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

static json_t *method_status(const struct rpc_call *call, json_t *params, struct rpc_error *error)
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
    json_t *status =
        json_pack("{s:s, s:o, s:o, s:s, s:s, s:s, s:o, s:o, s:o, s:o, s:o, s:o}", "version", SONARD_VERSION,
                  "uptime_s", real((double)(loop_now(d->loop) - d->start_ns) * 1e-9, 1e3), "t_unix",
                  real(unix_now(d), 1e6), "mode", mode, "config", d->conf_name, "data", data_word(d), "sensors",
                  sensors, "pose", pose_json(d), "pipeline", pipeline_json(d, &pipe), "grid",
                  grid_json(&pipe.grid), "server", server_json(d), "record", record_json(d));
    instruments_status(d, status);
    return status;
}

/* ---- version, image ---- */

static json_t *method_version(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    (void)call;
    return rpc_only(params, keys, error) ? json_pack("{s:s, s:i}", "version", SONARD_VERSION, "protocol", 1)
                                         : NULL;
}

/* The echoes of a row, nearest first, with what speaks against each. */
static json_t *echoes_json(const struct image_row *row)
{
    json_t *echoes = json_array();
    for (int i = 0; i < row->n_echoes; i++) {
        json_t *marks = json_array();
        if (row->flags[i] & ECHO_BURST)
            json_array_append_new(marks, json_string("burst"));
        if (row->flags[i] & ECHO_GHOST)
            json_array_append_new(marks, json_string("ghost"));
        json_array_append_new(echoes, json_pack("{s:o, s:o}", "range_m", metres(row->echo_m[i]), "marks", marks));
    }
    return echoes;
}

static json_t *row_json(const struct daemon *d, int sensor, const struct image_row *row)
{
    static const char *const states[] = {[BEAM_ECHO] = "echo", [BEAM_SILENT] = "silent", [BEAM_BLIND] = "blind"};
    static const char digits[] = "0123456789abcdef";
    char hex[2 * IMAGE_BINS + 1];
    uint32_t n = row->n_bins < IMAGE_BINS ? row->n_bins : IMAGE_BINS;
    for (uint32_t i = 0; i < n; i++) {
        hex[2 * i] = digits[row->bin[i] >> 4];
        hex[2 * i + 1] = digits[row->bin[i] & 15];
    }
    hex[2 * n] = '\0';
    double v[3], az, el;
    geo_direction(row->az_rad, 0, v);
    quat_rotate(d->mount[sensor].attitude, v, v);
    geo_angles(v, &az, &el);
    bool echo = row->n_echoes > 0;
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:s, s:o, s:o, s:o, s:o, s:s}", "azimuth_deg", degrees(az),
                     "width_deg", degrees(row->width_rad), "r0_m", metres(row->r0_m), "r1_m", metres(row->r1_m),
                     "age_s", age((double)(loop_now(d->loop) - row->t_ns) * 1e-9), "samples", hex, "echo_m",
                     echo ? metres(row->echo_m[0]) : json_null(), "near_m",
                     echo ? metres(row->near_m) : json_null(), "echoes", echoes_json(row), "blind_m",
                     metres(row->blind_m), "state", states[row->state]);
}

static json_t *method_image(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"sensor", NULL};
    struct daemon *d = call->daemon;
    const char *words[CONF_MAX_SONARS + 1] = {NULL};
    int sensor = 0;
    for (int i = 0; i < d->conf.n_sonars; i++)
        words[i] = d->conf.sonar[i].name;
    if (!rpc_only(params, keys, error) || !rpc_word(params, "sensor", words, &sensor, error))
        return NULL;
    json_t *rows = json_array();
    for (uint32_t i = 0; i < IMAGE_ROWS; i++) {
        struct image_row row;
        image_row(pipeline_image(d->pipeline, sensor), i, &row);
        if (row.t_ns)
            json_array_append_new(rows, row_json(d, sensor, &row));
    }
    return json_pack("{s:s, s:s, s:o, s:o}", "sensor", d->conf.sonar[sensor].name, "frame", "body", "t_unix",
                     real(unix_now(d), 1e6), "rows", rows);
}

const struct rpc_method daemon_methods[] = {
    {"blocked", method_blocked},
    {"sectors", method_sectors},
    {"pose", method_pose},
    {"status", method_status},
    {"version", method_version},
    {"image", method_image},
    {"clusters", cluster_method_list},
    {"next_look", cluster_method_next_look},
    {"background", template_method_show},
    {"background_learn", template_method_learn},
    {"background_stop", template_method_stop},
    {"background_save", template_method_save},
    {"background_load", template_method_load},
    {"background_clear", template_method_clear},
    {"point", places_method_point},
    {"box", places_method_box},
    {"path", places_method_path},
    {"map", places_method_map},
    {"map_slice", places_method_slice},
    {"map_new", places_method_new},
    {"map_clear", places_method_clear},
    {"map_save", places_method_save},
    {"map_load", places_method_load},
    {"map_export", places_method_export},
    {NULL, NULL},
};

void daemon_write_answers(struct daemon *d, const char *event, const char *sensor)
{
    struct rpc_call call = {.daemon = d, .now_ns = loop_now(d->loop)};
    struct rpc_error error = {0};
    json_t *params = json_object();
    json_t *sectors = rpc_invoke(daemon_methods, &call, "sectors", params, &error);
    json_t *line = json_pack("{s:s, s:s, s:I, s:o}", "event", event, "sensor", sensor, "turn",
                             (json_int_t)d->turns, "sectors", sectors);
    char *text = json_dumps(line, JSON_COMPACT | JSON_REAL_PRECISION(15));
    if (text)
        fprintf(d->answers, "%s\n", text);
    free(text);
    json_decref(line);
    json_decref(params);
}
