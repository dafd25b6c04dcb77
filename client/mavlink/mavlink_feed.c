/* SPDX-License-Identifier: MIT */
#include "mavlink_feed.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define RETRY_NS       1000000000u
#define ALIVE_NS       1500000000u /* shorter than the silence after which a sonar is called lost */
#define SILENCE_NS     5000000000u /* then another connection is tried */
#define WAITING_MAX    25          /* poses: half a second of them */
#define STATUS_HZ      5.0
#define PING_FRESH_NS  2000000000u
#define RING_FRESH_NS  1000000000u
#define LEVEL_BAND_DEG 5.0
#define LAYER_BAND_DEG 15.0
#define NEW_PING_NS    10000000u /* ages are rounded: a ping's time differs that little from one answer to the next */

const double mavlink_layer_deg[MAVLINK_LAYERS] = {[MAVLINK_WATCH_LEVEL] = 0,
                                                  [MAVLINK_WATCH_LOWEST] = -60,
                                                  [MAVLINK_WATCH_LOW] = -30,
                                                  [MAVLINK_WATCH_HIGH] = 30,
                                                  [MAVLINK_WATCH_HIGHEST] = 60};

static void forget_answers(struct mavlink_feed *feed)
{
    for (int i = 0; i < MAVLINK_LAYERS; i++)
        mavlink_ring_forget(&feed->ring[i]);
    for (int i = 0; i < MAVLINK_WATCHES; i++) {
        feed->request[i] = 0;
        feed->watch[i] = -1;
    }
    feed->replay = false;
    feed->n_sensors = 0;
    feed->posed = false;
    feed->drift[0] = '\0';
    feed->below.t_ns = 0;
    feed->below_refused = (struct sonard_error){0};
    feed->level_ns = 0;
    feed->poses_waiting = 0;
}

void mavlink_feed_init(struct mavlink_feed *feed, const struct mavlink_feed_conf *conf)
{
    *feed = (struct mavlink_feed){.conf = *conf};
    forget_answers(feed);
}

void mavlink_feed_close(struct mavlink_feed *feed)
{
    sonard_disconnect(feed->client);
    feed->client = NULL;
    feed->no_bound_id = 0;
    forget_answers(feed);
}

static void lose_daemon(struct mavlink_feed *feed, uint64_t now_ns)
{
    mavlink_feed_close(feed);
    feed->retry_ns = now_ns + RETRY_NS;
}

/* Asks the daemon to send `method` by itself; params is used up. */
static bool watch(struct mavlink_feed *feed, enum mavlink_watch which, const char *method, json_t *params,
                  double rate_hz)
{
    json_t *request = json_pack("{s:s, s:o, s:f}", "method", method, "params", params, "rate_hz", rate_hz);
    feed->request[which] = sonard_json_send(feed->client, "watch", request, &feed->error);
    json_decref(request);
    return feed->request[which] != 0;
}

static bool watch_layer(struct mavlink_feed *feed, enum mavlink_watch which)
{
    const double band_deg = feed->conf.layers ? LAYER_BAND_DEG : LEVEL_BAND_DEG;
    json_t *params =
        json_pack("{s:i, s:s, s:[f, f]}", "count", MAVLINK_SECTORS, "frame", feed->conf.north ? "ned" : "body",
                  "elevation_deg", mavlink_layer_deg[which] - band_deg, mavlink_layer_deg[which] + band_deg);

    json_object_set_new(params, "distance_m", json_real(fmax(0, feed->conf.distance_m)));
    return watch(feed, which, "sectors", params, feed->conf.rate_hz);
}

static bool watch_all(struct mavlink_feed *feed)
{
    for (int i = 0; i < (feed->conf.layers ? MAVLINK_LAYERS : 1); i++)
        if (!watch_layer(feed, (enum mavlink_watch)i))
            return false;
    if (!watch(feed, MAVLINK_WATCH_STATUS, "status", json_object(), STATUS_HZ))
        return false;
    return !feed->conf.downward || watch(feed, MAVLINK_WATCH_DOWNWARD, "image",
                                         json_pack("{s:s}", "sensor", feed->conf.downward), feed->conf.rate_hz);
}

void mavlink_feed_connect(struct mavlink_feed *feed, uint64_t now_ns)
{
    if (feed->client || now_ns < feed->retry_ns)
        return;
    feed->client = sonard_connect(feed->conf.socket, 0, &feed->error);
    feed->connected_ns = feed->heard_ns = now_ns;
    feed->said_something = false;
    if (!feed->client || !watch_all(feed))
        lose_daemon(feed, now_ns);
}

/* When the daemon said it, on our clock. Its calendar is ours; in a replay it is the capture's, which tells nothing. */
static uint64_t said(const struct mavlink_feed *feed, double t_unix, uint64_t now_ns)
{
    const double t_ns = t_unix * 1e9 - (double)feed->unix_offset_ns;
    return feed->replay || t_ns > (double)now_ns ? now_ns : t_ns > 0 ? (uint64_t)t_ns : 0;
}

static uint64_t before(uint64_t t_ns, double age_s)
{
    return age_s * 1e9 < (double)t_ns ? t_ns - (uint64_t)(age_s * 1e9) : 0;
}

static void take_ring(struct mavlink_feed *feed, enum mavlink_watch which, const json_t *result, uint64_t now_ns)
{
    struct mavlink_ring *ring = &feed->ring[which];
    if (!mavlink_ring_read(ring, result))
        return;

    const uint64_t said_ns = said(feed, ring->t_unix, now_ns);
    const uint64_t evidence_ns = ring->youngest_s >= 0 ? before(said_ns, ring->youngest_s) : 0;

    if (which == MAVLINK_WATCH_LEVEL)
        feed->level_ns = said_ns;
    feed->evidence_ns = evidence_ns > feed->evidence_ns ? evidence_ns : feed->evidence_ns;
}

static void take_sensor(struct mavlink_sensor *sensor, const json_t *object, uint64_t said_ns)
{
    const char *name = json_string_value(json_object_get(object, "name"));
    const char *state = json_string_value(json_object_get(object, "state"));
    const json_t *age = json_object_get(object, "last_ping_age_s");
    snprintf(sensor->name, sizeof sensor->name, "%s", name ? name : "?");
    snprintf(sensor->state, sizeof sensor->state, "%s", state ? state : "?");
    sensor->deaf = json_is_string(json_object_get(object, "hearing_doubt"));
    sensor->range_m = json_number_value(json_object_get(object, "range_m"));
    sensor->ping_ns = json_is_number(age) ? before(said_ns, fmax(0, json_number_value(age))) : 0;
}

static void take_status(struct mavlink_feed *feed, const json_t *result, uint64_t now_ns)
{
    const json_t *sensors = json_object_get(result, "sensors");
    const json_t *pose = json_object_get(result, "pose");
    const char *drift = json_string_value(json_object_get(pose, "drift"));
    const char *bound = json_string_value(json_object_get(json_object_get(pose, "speed_bound"), "state"));
    const json_t *leak = json_object_get(result, "leak");
    const char *mode = json_string_value(json_object_get(result, "mode"));
    const char *leak_state = json_string_value(json_object_get(leak, "state"));
    const json_int_t leaks = json_integer_value(json_object_get(leak, "alarms"));
    feed->replay = mode && strncmp(mode, "replay", 6) == 0;

    const uint64_t said_ns = said(feed, json_number_value(json_object_get(result, "t_unix")), now_ns);

    feed->n_sensors = 0;
    for (size_t i = 0; i < json_array_size(sensors) && feed->n_sensors < MAVLINK_SENSORS_MAX; i++)
        take_sensor(&feed->sensor[feed->n_sensors++], json_array_get(sensors, i), said_ns);
    const json_t *pose_age = json_object_get(pose, "age_s");
    const bool bounded = bound && strcmp(bound, "used") == 0;

    snprintf(feed->drift, sizeof feed->drift, "%s", drift && !bounded ? drift : "");
    feed->posed = json_is_number(pose_age);
    feed->pose_age_s = json_number_value(pose_age);
    feed->wet = leak_state && strcmp(leak_state, "wet") == 0;
    if (leaks > feed->leaks || (leaks > 0 && leaks < feed->leaks)) /* fewer: another daemon's count */
        feed->leak_ns = now_ns;
    feed->leaks = leaks;
}

static void take_below(struct mavlink_feed *feed, const json_t *result, uint64_t now_ns)
{
    const uint64_t said_ns = said(feed, json_number_value(json_object_get(result, "t_unix")), now_ns);
    const json_t *row;
    size_t i;
    json_array_foreach(json_object_get(result, "rows"), i, row)
    {
        const char *state = json_string_value(json_object_get(row, "state"));
        const json_t *age = json_object_get(row, "age_s"), *echo = json_object_get(row, "echo_m");
        const uint64_t t_ns = json_is_number(age) ? before(said_ns, fmax(0, json_number_value(age))) : 0;
        const bool heard = json_is_number(echo);

        if (t_ns < feed->below.t_ns + NEW_PING_NS || !state || (!heard && strcmp(state, "silent") != 0))
            continue;
        feed->below = (struct mavlink_depth_below){
            .t_ns = t_ns,
            .echo = heard,
            .range_m = json_number_value(echo),
            .width_rad = json_number_value(json_object_get(row, "width_deg")) * 3.14159265358979323846 / 180.0,
            .blind_m = json_number_value(json_object_get(row, "blind_m")),
        };
    }
}

/* Rings and status are never refused: what is asked for is always the same. */
static void take_notification(struct mavlink_feed *feed, const struct sonard_message *message,
                              const json_t *result, uint64_t now_ns)
{
    int which = 0;
    while (which < MAVLINK_WATCHES && feed->watch[which] != message->watch)
        which++;
    if (which == MAVLINK_WATCH_DOWNWARD)
        feed->below_refused = message->refusal;
    if (!result || which == MAVLINK_WATCHES)
        return;
    if (which == MAVLINK_WATCH_STATUS)
        take_status(feed, result, now_ns);
    else if (which == MAVLINK_WATCH_DOWNWARD)
        take_below(feed, result, now_ns);
    else
        take_ring(feed, (enum mavlink_watch)which, result, now_ns);
}

/* To a watch that was asked for, or to a pose. False: the watch, or this client, is refused, as error says. */
static bool take_reply(struct mavlink_feed *feed, const struct sonard_message *reply, const json_t *result)
{
    for (int i = 0; i < MAVLINK_WATCHES; i++) {
        if (reply->id != 0 && reply->id != feed->request[i])
            continue;
        if (result)
            feed->watch[i] = json_integer_value(json_object_get(result, "watch"));
        else
            feed->error = reply->refusal;
        return result != NULL;
    }
    if (reply->id == feed->no_bound_id) {
        feed->no_bound_id = 0;
        return true;
    }
    feed->poses_waiting--;
    feed->poses += result != NULL;
    feed->poses_refused += result == NULL;
    return true;
}

void mavlink_feed_read(struct mavlink_feed *feed, uint64_t now_ns)
{
    struct sonard_message message;
    json_t *result;
    bool good = true;
    while (feed->client && good) {
        if (!sonard_json_take(feed->client, 0, &message, &result, &feed->error))
            break;
        feed->heard_ns = now_ns;
        feed->said_something = true;
        if (message.watch > 0)
            take_notification(feed, &message, result, now_ns);
        else
            good = take_reply(feed, &message, result);
        json_decref(result);
    }
    if (feed->client && (!good || feed->error.status != SONARD_SILENT || now_ns > feed->heard_ns + SILENCE_NS))
        lose_daemon(feed, now_ns);
}

void mavlink_feed_pose(struct mavlink_feed *feed, const struct mavlink_pose *pose, uint64_t now_ns)
{
    const unsigned has = (pose->has & MAVLINK_POSE_ATTITUDE ? SONARD_POSE_QUATERNION : 0u) |
                         (pose->has & MAVLINK_POSE_POSITION ? SONARD_POSE_POSITION : 0u) |
                         (pose->has & MAVLINK_POSE_VELOCITY ? SONARD_POSE_VELOCITY : 0u) |
                         (pose->has & MAVLINK_POSE_DEPTH ? SONARD_POSE_DEPTH : 0u) |
                         (pose->has & MAVLINK_POSE_ALTITUDE ? SONARD_POSE_ALTITUDE : 0u) |
                         (pose->has & MAVLINK_POSE_BOUND ? SONARD_POSE_SPEED_BOUND | SONARD_POSE_PUSH : 0u);
    struct sonard_pose said = {.has = has | SONARD_POSE_TIME,
                               .depth_m = pose->depth_m,
                               .altitude_m = pose->altitude_m,
                               .t_unix = (double)(feed->unix_offset_ns + pose->t_ns) * 1e-9};
    if (!feed->client)
        return;
    if (feed->poses_waiting >= WAITING_MAX) {
        feed->poses_held++;
        return;
    }
    memcpy(said.quaternion, pose->quaternion, sizeof said.quaternion);
    memcpy(said.position_m, pose->position_m, sizeof said.position_m);
    memcpy(said.velocity_mps, pose->velocity_mps, sizeof said.velocity_mps);
    memcpy(said.speed_bound_mps, pose->bound_mps, sizeof said.speed_bound_mps);
    memcpy(said.push_n, pose->push_n, sizeof said.push_n);
    if (sonard_send_pose(feed->client, &said, &feed->error))
        feed->poses_waiting++;
    else
        lose_daemon(feed, now_ns);
}

void mavlink_feed_no_bound(struct mavlink_feed *feed, const char *word, uint64_t now_ns)
{
    json_t *params = json_pack("{s:s}", "no_speed_bound", word);
    if (feed->client && feed->no_bound_id == 0) {
        feed->no_bound_id = sonard_json_send(feed->client, "pose", params, &feed->error);
        if (feed->no_bound_id == 0)
            lose_daemon(feed, now_ns);
    }
    json_decref(params);
}

bool mavlink_feed_alive(const struct mavlink_feed *feed, uint64_t now_ns)
{
    return feed->client && feed->said_something && now_ns < feed->heard_ns + ALIVE_NS;
}

bool mavlink_feed_answered(const struct mavlink_feed *feed, uint64_t now_ns)
{
    return feed->level_ns > 0 && now_ns < feed->level_ns + RING_FRESH_NS;
}

bool mavlink_feed_fresh(const struct mavlink_feed *feed, uint64_t now_ns)
{
    uint64_t ping_ns = 0;
    for (int i = 0; i < feed->n_sensors; i++)
        ping_ns = feed->sensor[i].ping_ns > ping_ns ? feed->sensor[i].ping_ns : ping_ns;
    return mavlink_feed_answered(feed, now_ns) && feed->ring[MAVLINK_WATCH_LEVEL].youngest_s >= 0 &&
           now_ns < ping_ns + PING_FRESH_NS;
}

double mavlink_feed_reach_m(const struct mavlink_feed *feed)
{
    double reach_m = feed->conf.distance_m;
    for (int i = 0; feed->conf.distance_m <= 0 && i < feed->n_sensors; i++)
        if (!feed->conf.downward || strcmp(feed->sensor[i].name, feed->conf.downward) != 0)
            reach_m = fmax(reach_m, feed->sensor[i].range_m);
    return reach_m;
}
