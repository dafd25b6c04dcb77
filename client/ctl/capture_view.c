/* SPDX-License-Identifier: MIT */
/*
 * capture_view - `sonarctl capture export --foxglove`: what the live viewers are shown (view_topics.h), of a capture. A
 * sonard of its own plays it, a tenth of a second after the other, and each message has the capture's time.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "capture.h"
#include "capture_file.h"
#include "client/view/protobuf.h"
#include "client/view/view_topics.h"
#include "played.h"

#define STEP_S        0.1 /* a sonar that is quicker has pings that are left out */
#define SPARE_S       0.5 /* rows of the image that are asked for once more */
#define MESSAGE_BYTES (1u << 20)
#define METHODS_MAX   8

/* A method whose answers topics are made from, asked once for all of them. */
struct asked {
    const char *method;
    json_t *params, *result;
};

struct export
{
    struct played played;
    struct mcap_writer *out;
    int channel[VIEW_TOPICS];
    struct view_cursor cursor[VIEW_TOPICS];
    double due_s[VIEW_TOPICS];
    struct asked asked[METHODS_MAX];
    size_t n_asked;
    struct view_rows rows;
    double now_unix;
};

static bool add_channels(struct export *e, struct fault *fault)
{
    for (int i = 0; i < VIEW_TOPICS; i++) {
        const struct message_type *type = view_topic_type(&view_topics[i]);
        struct bytes schema = {0};

        if (type)
            protobuf_schema(type, &schema);
        const int id = type && !schema.failed
                           ? mcap_add_schema(e->out, type->name, "protobuf", schema.data, schema.size, fault)
                           : -fault_set(fault, "out of memory") - 1;
        free(schema.data);
        e->channel[i] = id > 0 ? mcap_add_channel_of(e->out, id, view_topics[i].topic, "protobuf", fault) : -1;
        if (e->channel[i] < 0)
            return false;
    }
    return true;
}

/* The answer that a topic is made from; NULL: there is none, as of a map that is not kept. */
static struct asked *ask(struct export *e, const struct view_topic *topic)
{
    struct asked *asked = e->asked;

    while (asked < e->asked + e->n_asked && strcmp(asked->method, topic->method) != 0)
        asked++;
    if (asked == e->asked + e->n_asked) {
        if (e->n_asked == METHODS_MAX)
            return NULL;
        *asked = (struct asked){.method = topic->method, .params = json_loads(topic->params, 0, NULL)};
        e->n_asked++;
    }
    if (asked->result)
        return asked;
    if (strcmp(asked->method, "image") == 0)
        json_object_set_new(asked->params, "newer_s", json_real(STEP_S + SPARE_S));
    asked->result = played_ask(&e->played, asked->method, asked->params);
    if (asked->result && strcmp(asked->method, "image") == 0)
        view_rows_take(&e->rows, asked->result);
    return asked->result ? asked : NULL;
}

/* A time in a message as nanoseconds; 0: none. */
static uint64_t time_in(const json_t *message)
{
    const json_t *t = json_object_get(message, "timestamp");

    return (uint64_t)json_integer_value(json_object_get(t, "seconds")) * 1000000000u +
           (uint64_t)json_integer_value(json_object_get(t, "nanos"));
}

static bool put_message(struct export *e, int i, const json_t *message, struct fault *fault)
{
    const uint64_t own_ns = time_in(message);
    struct bytes bytes = {0};

    protobuf_message(view_topic_type(&view_topics[i]), message, &bytes);
    const struct mcap_message record = {.log_ns = own_ns ? own_ns : (uint64_t)(e->now_unix * 1e9),
                                        .publish_ns = own_ns ? own_ns : (uint64_t)(e->now_unix * 1e9),
                                        .data = bytes.data,
                                        .size = bytes.size};
    const bool ok = !bytes.failed ? mcap_write_message(e->out, e->channel[i], &record, fault)
                                  : fault_set(fault, "out of memory");
    free(bytes.data);
    return ok;
}

static bool put_topic(struct export *e, int i, struct fault *fault)
{
    const struct view_topic *topic = &view_topics[i];
    const struct asked *asked = ask(e, topic);
    json_t *message;
    bool ok = true;

    if (!asked)
        return true;
    const struct view_source source = {.result = asked->result, .rows = &e->rows, .now_unix = e->now_unix};
    do {
        message = topic->make(&source, &e->cursor[i]);
        ok = !message || put_message(e, i, message, fault);
        json_decref(message);
    } while (ok && message && topic->one_by_one);
    return ok;
}

static bool put_moment(struct export *e, struct fault *fault)
{
    json_t *status = played_ask(&e->played, "status", NULL);
    bool ok = true;

    if (!status)
        return fault_set(fault, "sonard, which replays it, is gone");
    e->now_unix = json_number_value(json_object_get(status, "t_unix"));
    json_decref(status);
    for (int i = 0; ok && i < VIEW_TOPICS; i++) {
        if (e->played.position_s < e->due_s[i])
            continue;
        e->due_s[i] = e->played.position_s + view_topics[i].period_s - STEP_S / 2;
        ok = put_topic(e, i, fault);
    }
    for (size_t i = 0; i < e->n_asked; i++) {
        json_decref(e->asked[i].result);
        e->asked[i].result = NULL;
    }
    return ok;
}

static bool play(struct export *e, struct fault *fault)
{
    for (double at_s = STEP_S, end_s = e->played.length_s; at_s < end_s + STEP_S; at_s += STEP_S) {
        if (!played_go(&e->played, fmin(at_s, end_s), fault) || !put_moment(e, fault))
            return false;
        at_s = fmax(at_s, floor(e->played.position_s / STEP_S) * STEP_S);
    }
    return true;
}

int capture_export_view(const char *path, const char *out_path, const char *conf)
{
    struct export *e = calloc(1, sizeof *e);
    struct fault fault;
    int status = 1;

    if (!e)
        return capture_failed("out of memory");
    if (!played_start(&e->played, path, conf, &fault))
        capture_failed("%s", fault.text);
    else if ((e->out = capture_create(out_path, MESSAGE_BYTES)))
        status = capture_finish(e->out, out_path, add_channels(e, &fault) && play(e, &fault), &fault);
    played_stop(&e->played);
    for (size_t i = 0; i < e->n_asked; i++)
        json_decref(e->asked[i].params);
    for (int i = 0; i < VIEW_TOPICS; i++)
        json_decref(e->cursor[i].said);
    free(e);
    return status;
}
