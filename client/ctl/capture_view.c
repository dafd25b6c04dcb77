/* SPDX-License-Identifier: MIT */
/*
 * capture_view - `sonarctl capture export --foxglove` and `--ros2`: what live viewers are shown (view_topics.h), of a
 * capture. A sonard of its own plays it, a tenth of a second after the other; each message has the capture's time.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "capture.h"
#include "capture_file.h"
#include "client/view/cdr.h"
#include "client/view/protobuf.h"
#include "client/view/ros2.h"
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

/* What a file is made of. */
struct form {
    const char *profile, *encoding, *schema_encoding;
    const struct message_type *(*type)(const struct view_topic *topic); /* NULL: it is not in the file */
    void (*schema)(const struct message_type *type, struct bytes *out);
    void (*encode)(const struct view_topic *topic, const json_t *message, struct bytes *out);
};

struct exporter {
    const struct form *form;
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

/* ---- the two forms ---- */

static const struct message_type *ros2_type(const struct view_topic *topic)
{
    const struct ros2_topic *ros = ros2_topic(topic->topic);
    return ros ? ros->type : NULL;
}

static void encode_foxglove(const struct view_topic *topic, const json_t *message, struct bytes *out)
{
    protobuf_message(view_topic_type(topic), message, out);
}

static void encode_ros2(const struct view_topic *topic, const json_t *message, struct bytes *out)
{
    json_t *converted = ros2_topic(topic->topic)->convert(message);
    out->failed = !converted;
    cdr_message(ros2_type(topic), converted, out);
    json_decref(converted);
}

static const struct form forms[] = {
    [CAPTURE_VIEW_FOXGLOVE] = {"", "protobuf", "protobuf", view_topic_type, protobuf_schema, encode_foxglove},
    [CAPTURE_VIEW_ROS2] = {"ros2", "cdr", "ros2msg", ros2_type, cdr_schema, encode_ros2},
};

/* ---- the file ---- */

static int add_channel(struct exporter *e, const char *topic, const struct message_type *type, struct fault *fault)
{
    struct bytes schema = {0};
    int id = -1;
    e->form->schema(type, &schema);
    if (schema.failed)
        fault_set(fault, "out of memory");
    else
        id = mcap_add_schema(e->out, type->name, e->form->schema_encoding, schema.data, schema.size, fault);
    free(schema.data);
    return id > 0 ? mcap_add_channel_of(e->out, id, topic, e->form->encoding, fault) : -1;
}

static bool add_channels(struct exporter *e, struct fault *fault)
{
    for (int i = 0; i < VIEW_TOPICS; i++) {
        const struct message_type *type = e->form->type(&view_topics[i]);
        e->channel[i] = type ? add_channel(e, view_topics[i].topic, type, fault) : -1;
        if (type && e->channel[i] < 0)
            return false;
    }
    return true;
}

/* The answer that a topic is made from; NULL: there is none, as of a map that is not kept. */
static struct asked *ask(struct exporter *e, const struct view_topic *topic)
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

static bool put_message(struct exporter *e, int i, const json_t *message, struct fault *fault)
{
    const uint64_t own_ns = time_in(message), t_ns = own_ns ? own_ns : (uint64_t)(e->now_unix * 1e9);
    struct bytes bytes = {0};
    e->form->encode(&view_topics[i], message, &bytes);
    const struct mcap_message record = {
        .log_ns = t_ns, .publish_ns = t_ns, .data = bytes.data, .size = bytes.size};
    const bool ok = !bytes.failed ? mcap_write_message(e->out, e->channel[i], &record, fault)
                                  : fault_set(fault, "out of memory");
    free(bytes.data);
    return ok;
}

static bool put_topic(struct exporter *e, int i, struct fault *fault)
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

static bool put_moment(struct exporter *e, struct fault *fault)
{
    json_t *status = played_ask(&e->played, "status", NULL);
    bool ok = true;
    if (!status)
        return fault_set(fault, "sonard, which replays it, is gone");
    e->now_unix = json_number_value(json_object_get(status, "t_unix"));
    json_decref(status);
    for (int i = 0; ok && i < VIEW_TOPICS; i++) {
        if (e->channel[i] < 0 || e->played.position_s < e->due_s[i])
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

static bool play(struct exporter *e, struct fault *fault)
{
    for (double at_s = STEP_S, end_s = e->played.length_s; at_s < end_s + STEP_S; at_s += STEP_S) {
        if (!played_go(&e->played, fmin(at_s, end_s), fault) || !put_moment(e, fault))
            return false;
        at_s = fmax(at_s, floor(e->played.position_s / STEP_S) * STEP_S);
    }
    return true;
}

/* sonard, which replays it, reads past damage; a CAN log has none to be told. */
static int tell_exported(const char *path)
{
    struct fault fault;
    struct mcap_message m;
    struct mcap_reader *r = mcap_open(path, NULL, NULL, &fault);
    if (!r)
        return 0;
    while (mcap_next(r, &m))
        ;
    const int status = capture_tell_exported(path, mcap_info(r));
    mcap_close(r);
    return status;
}

int capture_export_view(const char *path, const char *out_path, enum capture_view_form form, const char *conf)
{
    struct exporter *e = calloc(1, sizeof *e);
    struct fault fault;
    int status = 1;
    if (!e)
        return capture_failed("out of memory");
    e->form = &forms[form];
    if (!(e->out = capture_create(out_path, e->form->profile, MESSAGE_BYTES))) {
        free(e);
        return 1;
    }
    if (played_start(&e->played, path, conf, &fault)) {
        status = capture_finish(e->out, out_path, add_channels(e, &fault) && play(e, &fault), &fault);
    } else {
        capture_failed("%s", fault.text);
        capture_drop(e->out, out_path);
    }
    played_stop(&e->played);
    if (status == 0)
        status = tell_exported(path);
    for (size_t i = 0; i < e->n_asked; i++)
        json_decref(e->asked[i].params);
    for (int i = 0; i < VIEW_TOPICS; i++)
        json_decref(e->cursor[i].said);
    free(e);
    return status;
}
