/* SPDX-License-Identifier: MIT */
#include "web_foxglove.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "client/view/protobuf.h"

#define SUBSCRIPTIONS_MAX 16
#define MESSAGE_MAX       4096 /* bytes of a message from a client */
#define DATA_HEAD         13   /* u8 1, u32 subscription, u64 nanoseconds, little-endian; then the message */

struct subscription {
    uint32_t id;
    const struct view_topic *topic; /* NULL: free */
    struct web_channel *channel;
    uint64_t seen;             /* number of the message; one by one: version of the channel */
    struct view_cursor cursor; /* one by one */
};

struct web_foxglove_session {
    struct web_foxglove *foxglove;
    struct lws *wsi;
    struct web_foxglove_session *next;
    struct subscription subscription[SUBSCRIPTIONS_MAX];
    unsigned turn;
    int greeted;    /* messages of the greeting that were sent */
    bool complains; /* it shows that the daemon is lost */
    size_t in_size;
    char in[MESSAGE_MAX];
};

/* ---- to the client ---- */

static int send_json(struct lws *wsi, json_t *message)
{
    char *text = message ? json_dumps(message, JSON_COMPACT) : NULL;
    const size_t n = text ? strlen(text) : 0;
    uint8_t *padded = text ? malloc(LWS_PRE + n) : NULL;
    int sent = -1;
    if (padded) {
        memcpy(padded + LWS_PRE, text, n);
        sent = lws_write(wsi, padded + LWS_PRE, n, LWS_WRITE_TEXT) < (int)n ? -1 : 0;
    }
    free(padded);
    free(text);
    json_decref(message);
    return sent;
}

static char *base64(const struct bytes *bytes)
{
    const size_t room = (bytes->size + 2) / 3 * 4 + 4; /* the library wants more than it needs */
    char *text = bytes->failed ? NULL : malloc(room);
    if (text && lws_b64_encode_string((const char *)bytes->data, (int)bytes->size, text, (int)room) < 0) {
        free(text);
        text = NULL;
    }
    return text;
}

static json_t *channel_of(int id)
{
    const struct message_type *type = view_topic_type(&view_topics[id]);
    struct bytes schema = {0};
    json_t *channel = NULL;
    char *text;
    if (!type)
        return NULL;
    protobuf_schema(type, &schema);
    if ((text = base64(&schema)))
        channel = json_pack("{s:i, s:s, s:s, s:s, s:s, s:s}", "id", id, "topic", view_topics[id].topic, "encoding",
                            "protobuf", "schemaName", type->name, "schema", text, "schemaEncoding", "protobuf");
    free(text);
    free(schema.data);
    return channel;
}

static json_t *advertise(void)
{
    json_t *channels = json_array();
    for (int i = 0; view_topics[i].topic; i++)
        json_array_append_new(channels, channel_of(i));
    return json_pack("{s:s, s:o}", "op", "advertise", "channels", channels);
}

static int greet(struct web_foxglove_session *s)
{
    lws_callback_on_writable(s->wsi);
    if (s->greeted++ == 0)
        return send_json(s->wsi, json_pack("{s:s, s:s, s:[], s:{}}", "op", "serverInfo", "name",
                                           "sonard " SONARD_VERSION, "capabilities", "metadata"));
    return send_json(s->wsi, advertise());
}

/* What is shown of a daemon that is lost is old, and nothing else says so. */
static int send_state(struct web_foxglove_session *s, const char *lost)
{
    s->complains = lost != NULL;
    lws_callback_on_writable(s->wsi);
    if (!lost)
        return send_json(s->wsi, json_pack("{s:s, s:[s]}", "op", "removeStatus", "statusIds", "daemon"));
    return send_json(
        s->wsi, json_pack("{s:s, s:i, s:s, s:s}", "op", "status", "level", 2, "message", lost, "id", "daemon"));
}

static uint64_t unix_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static int send_data(const struct web_foxglove_session *s, const struct subscription *sub,
                     const struct bytes *message)
{
    const size_t size = DATA_HEAD + message->size;
    uint8_t *padded = malloc(LWS_PRE + size), *at = padded + LWS_PRE;
    const uint64_t now_ns = unix_ns();
    int sent = 0;
    if (!padded)
        return 0;
    at[0] = 1;
    for (int i = 0; i < 4; i++)
        at[1 + i] = (uint8_t)(sub->id >> (8 * i));
    for (int i = 0; i < 8; i++)
        at[5 + i] = (uint8_t)(now_ns >> (8 * i));
    if (message->size > 0)
        memcpy(at + DATA_HEAD, message->data, message->size);
    sent = lws_write(s->wsi, at, size, LWS_WRITE_BINARY) < (int)size ? -1 : 0;
    free(padded);
    return sent;
}

/* The next message of a channel; false: there is none now. */
static bool make(const struct view_topic *topic, const struct web_channel *channel, struct view_cursor *cursor,
                 struct bytes *out)
{
    const struct view_source source = {
        .result = channel->result, .rows = channel->rows, .now_unix = (double)unix_ns() * 1e-9};
    const struct message_type *type = view_topic_type(topic);
    json_t *message = topic->make(&source, cursor);
    const bool made = message && type;
    if (made)
        protobuf_message(type, message, out);
    json_decref(message);
    return made && !out->failed;
}

static bool has_news(const struct web_channel *channel, uint64_t version)
{
    return channel->version > 0 && channel->version != version && (channel->result || channel->rows);
}

static void wake(lws_sorted_usec_list_t *timer)
{
    struct web_foxglove *foxglove = lws_container_of(timer, struct web_foxglove, timer);
    foxglove->wake_us = 0;
    for (struct web_foxglove_session *s = foxglove->first; s; s = s->next)
        lws_callback_on_writable(s->wsi);
}

static void wake_at(struct web_foxglove *foxglove, uint64_t due_us, uint64_t now_us)
{
    if (foxglove->wake_us && foxglove->wake_us <= due_us)
        return;
    foxglove->wake_us = due_us;
    lws_sul_schedule(foxglove->board->link->context, 0, &foxglove->timer, wake, (lws_usec_t)(due_us - now_us));
}

/* What all clients are told of a topic, made anew when it is time; false: this one has it. */
static bool take_told(struct web_foxglove *foxglove, struct subscription *sub)
{
    struct web_foxglove_told *told = &foxglove->told[sub->topic - view_topics];
    const uint64_t now_us = (uint64_t)lws_now_usecs();
    const uint64_t due_us = told->made_us + (uint64_t)(sub->topic->period_s * 1e6);
    if (has_news(sub->channel, told->version)) {
        if (told->there && now_us < due_us) {
            wake_at(foxglove, due_us, now_us);
        } else {
            told->message.size = 0;
            told->message.failed = false;
            told->version = sub->channel->version;
            told->made_us = now_us;
            told->number++;
            told->there = make(sub->topic, sub->channel, &sub->cursor, &told->message);
        }
    }
    if (!told->there || told->number == sub->seen)
        return false;
    sub->seen = told->number;
    return true;
}

/* The next message of this subscription alone; false: there is none. */
static bool take_next(struct subscription *sub, struct bytes *message)
{
    if (!has_news(sub->channel, sub->seen))
        return false;
    if (make(sub->topic, sub->channel, &sub->cursor, message))
        return true;
    sub->seen = sub->channel->version;
    return false;
}

static int send_next(struct web_foxglove_session *s)
{
    const char *lost = web_link_state(s->foxglove->board->link);
    if (s->greeted < 2)
        return greet(s);
    if (s->complains != (lost != NULL))
        return send_state(s, lost);
    for (int i = 0; i < SUBSCRIPTIONS_MAX; i++) {
        struct subscription *sub = &s->subscription[s->turn++ % SUBSCRIPTIONS_MAX];
        struct bytes own = {0};
        int sent = 0;
        if (!sub->topic || !(sub->topic->one_by_one ? take_next(sub, &own) : take_told(s->foxglove, sub))) {
            free(own.data);
            continue;
        }
        lws_callback_on_writable(s->wsi);
        sent = send_data(s, sub,
                         sub->topic->one_by_one ? &own : &s->foxglove->told[sub->topic - view_topics].message);
        free(own.data);
        return sent;
    }
    return 0;
}

/* ---- from the client ---- */

static void subscribe(struct web_foxglove_session *s, const json_t *said)
{
    const json_int_t id = json_integer_value(json_object_get(said, "id"));
    const json_int_t channel = json_integer_value(json_object_get(said, "channelId"));
    struct subscription *room = NULL;
    const struct view_topic *topic = NULL;
    for (int i = 0; view_topics[i].topic; i++)
        topic = i == channel && json_is_integer(json_object_get(said, "channelId")) ? &view_topics[i] : topic;
    for (int i = 0; i < SUBSCRIPTIONS_MAX; i++) {
        if (!s->subscription[i].topic)
            room = &s->subscription[i];
        else if (s->subscription[i].id == id)
            return; /* it has it */
    }
    if (!topic || !room || id < 0 || id > UINT32_MAX)
        return;

    json_t *params = json_loads(topic->params, 0, NULL);
    struct web_channel *opened = web_board_open(s->foxglove->board, topic->method, params);

    json_decref(params);
    if (opened)
        *room = (struct subscription){.id = (uint32_t)id, .topic = topic, .channel = opened};
    lws_callback_on_writable(s->wsi);
}

static void unsubscribe(struct web_foxglove_session *s, const json_t *id)
{
    for (int i = 0; i < SUBSCRIPTIONS_MAX; i++) {
        struct subscription *sub = &s->subscription[i];
        if (sub->topic && (!id || (json_is_integer(id) && json_integer_value(id) == sub->id))) {
            web_board_close(sub->channel);
            json_decref(sub->cursor.said);
            *sub = (struct subscription){0};
        }
    }
}

/* What a client would publish, call or set is not offered, and is ignored. */
static bool read_message(struct web_foxglove_session *s)
{
    json_t *message = json_loadb(s->in, s->in_size, JSON_REJECT_DUPLICATES, NULL);
    const char *op = json_string_value(json_object_get(message, "op"));
    const json_t *list = json_object_get(message, "subscriptions"),
                 *ids = json_object_get(message, "subscriptionIds");
    const bool good = op != NULL;
    if (op && strcmp(op, "subscribe") == 0)
        for (size_t i = 0; i < json_array_size(list); i++)
            subscribe(s, json_array_get(list, i));
    else if (op && strcmp(op, "unsubscribe") == 0)
        for (size_t i = 0; i < json_array_size(ids); i++)
            unsubscribe(s, json_array_get(ids, i));
    s->in_size = 0;
    json_decref(message);
    return good;
}

static int receive(struct web_foxglove_session *s, const char *bytes, size_t n)
{
    if (lws_frame_is_binary(s->wsi) || n > sizeof s->in - s->in_size) {
        lws_close_reason(s->wsi, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE, NULL, 0);
        return -1;
    }
    memcpy(s->in + s->in_size, bytes, n);
    s->in_size += n;
    if (!lws_is_final_fragment(s->wsi) || lws_remaining_packet_payload(s->wsi) > 0 || read_message(s))
        return 0;
    lws_close_reason(s->wsi, LWS_CLOSE_STATUS_POLICY_VIOLATION, NULL, 0);
    return -1;
}

/* ---- coming and going ---- */

static int enter(struct web_foxglove *foxglove, struct web_foxglove_session *s, struct lws *wsi)
{
    *s = (struct web_foxglove_session){.foxglove = foxglove, .wsi = wsi, .next = foxglove->first};
    foxglove->first = s;
    foxglove->sessions++;
    lws_callback_on_writable(wsi);
    return 0;
}

static void leave(struct web_foxglove_session *s)
{
    struct web_foxglove_session **at;
    if (!s || !s->foxglove)
        return; /* it was refused before it was here */
    at = &s->foxglove->first;
    while (*at != s)
        at = &(*at)->next;
    *at = s->next;
    s->foxglove->sessions--;
    unsubscribe(s, NULL);
}

static int callback(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t n)
{
    const struct lws_protocols *protocol = lws_get_protocol(wsi);
    struct web_foxglove *foxglove = protocol ? protocol->user : NULL;
    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return foxglove && foxglove->sessions < WEB_FOXGLOVE_MAX ? 0 : -1;
    case LWS_CALLBACK_ESTABLISHED:
        return enter(foxglove, user, wsi);
    case LWS_CALLBACK_SERVER_WRITEABLE:
        return send_next(user);
    case LWS_CALLBACK_RECEIVE:
        return receive(user, in, n);
    case LWS_CALLBACK_CLOSED:
        leave(user);
        return 0;
    default:
        return 0;
    }
}

struct lws_protocols web_foxglove_protocol(struct web_foxglove *foxglove, const char *name)
{
    return (struct lws_protocols){.name = name,
                                  .callback = callback,
                                  .per_session_data_size = sizeof(struct web_foxglove_session),
                                  .rx_buffer_size = MESSAGE_MAX,
                                  .user = foxglove};
}

void web_foxglove_news(struct web_foxglove *foxglove, const struct web_channel *channel)
{
    for (struct web_foxglove_session *s = foxglove->first; s; s = s->next)
        for (int i = 0; i < SUBSCRIPTIONS_MAX; i++)
            if (s->subscription[i].channel == channel)
                lws_callback_on_writable(s->wsi);
}

void web_foxglove_link_changed(struct web_foxglove *foxglove)
{
    for (int i = 0; view_topics[i].topic; i++) {
        foxglove->told[i].there = false;
        foxglove->told[i].version = 0;
    }
    for (struct web_foxglove_session *s = foxglove->first; s; s = s->next) {
        for (int i = 0; i < SUBSCRIPTIONS_MAX; i++)
            s->subscription[i].seen = 0;
        lws_callback_on_writable(s->wsi);
    }
}

void web_foxglove_stop(struct web_foxglove *foxglove)
{
    lws_sul_cancel(&foxglove->timer);
    for (int i = 0; i < VIEW_TOPICS; i++)
        free(foxglove->told[i].message.data);
}
