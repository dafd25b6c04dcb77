/* SPDX-License-Identifier: MIT */
#include "web_live.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "web_query.h"

#define VIEWS_MAX    12
#define ASKS_MAX     2 /* of a page that wait for their answers */
#define KERNEL_BYTES 65536
#define MESSAGE_MAX  4096 /* bytes of a message from a page */
#define RPC_INVALID  (-32602)
#define RPC_NO_SUCH  (-32601)
#define RPC_LIMIT    (-32000)
#define RPC_NO_REPLY (-32603)
#define RPC_NO_RIGHT (-32001)
#define GUESS_US     1000000 /* a wrong token is answered so late, and its page gives no other meanwhile */

struct view {
    struct web_channel *channel;
    uint64_t seen; /* its version, or of rows the change */
};

struct ask {
    struct web_live_session *session;
    bool waits;
    json_int_t id;
    char *text; /* the reply that waits to be sent, behind LWS_PRE bytes */
    size_t size;
};

struct web_live_session {
    struct web_live *live;
    struct lws *wsi;
    struct web_live_session *next;
    struct view view[VIEWS_MAX];
    unsigned n_views, turn;
    struct ask ask[ASKS_MAX];
    struct ask *guess; /* had a wrong token; its answer waits for guess_over */
    lws_sorted_usec_list_t guess_over;
    unsigned connection_told;
    size_t in_size;
    char in[MESSAGE_MAX];
};

/* ---- to the page ---- */

static int send_text(struct lws *wsi, char *padded, size_t size)
{
    return lws_write(wsi, (unsigned char *)padded + LWS_PRE, size, LWS_WRITE_TEXT) < (int)size ? -1 : 0;
}

static int send_link(struct web_live_session *s)
{
    const char *fault = web_link_state(s->live->board->link);
    json_t *message = json_pack("{s:s, s:{s:i, s:s?, s:b, s:b}}", "method", "link", "result", "connection",
                                (int)s->live->connection, "fault", fault, "replay", (int)s->live->replay,
                                "settings", s->live->settings->path != NULL);
    char padded[LWS_PRE + 2048];
    const size_t n =
        message ? json_dumpb(message, padded + LWS_PRE, sizeof padded - LWS_PRE, JSON_COMPACT) : sizeof padded;

    json_decref(message);
    s->connection_told = s->live->connection;
    return n <= sizeof padded - LWS_PRE ? send_text(s->wsi, padded, n) : -1;
}

static void drop_reply(struct ask *ask)
{
    if (ask->text)
        web_budget_give(ask->session->live->budget, ask->size);
    free(ask->text);
    *ask = (struct ask){.session = ask->session};
}

static void reply(struct ask *ask, json_t *message)
{
    char *text = message ? json_dumps(message, JSON_COMPACT | JSON_REAL_PRECISION(15)) : NULL;
    const size_t size = text ? strlen(text) : 0;
    json_decref(message);
    ask->text = text && web_budget_take(ask->session->live->budget, size) ? malloc(LWS_PRE + size) : NULL;
    ask->waits = false;
    ask->size = size;
    if (ask->text) {
        memcpy(ask->text + LWS_PRE, text, size);
        lws_callback_on_writable(ask->session->wsi);
    }
    free(text);
}

static void refuse(struct ask *ask, int code, const char *message)
{
    reply(ask, json_pack("{s:I, s:{s:i, s:s}}", "id", ask->id, "error", "code", code, "message", message));
}

static void answered(void *ctx, const struct web_answer *answer)
{
    struct ask *ask = ctx;
    if (answer->result)
        reply(ask, json_pack("{s:I, s:O}", "id", ask->id, "result", answer->result));
    else
        refuse(ask, answer->rpc_code ? answer->rpc_code : RPC_NO_REPLY, answer->message);
}

static bool has_news(const struct view *view)
{
    const struct web_channel *c = view->channel;
    if (c->rows && !c->text)
        return c->version > 0 && c->rows->change > view->seen;
    return c->version > 0 && c->version != view->seen;
}

static int send_view(struct web_live_session *s, struct view *view)
{
    static uint8_t part[LWS_PRE + VIEW_ROWS_BYTES];
    const struct web_channel *c = view->channel;
    if (!c->rows || c->text) {
        view->seen = c->version;
        return send_text(s->wsi, c->text, c->size);
    }
    const size_t n = view_rows_part(c->rows, &view->seen, part + LWS_PRE);

    if (n == 0) {
        view->seen = c->rows->change; /* the rows that changed are forgotten */
        return 0;
    }
    return lws_write(s->wsi, part + LWS_PRE, n, LWS_WRITE_BINARY) < (int)n ? -1 : 0;
}

/* One message, and the wish to send the next: the socket decides how fast. */
static int send_next(struct web_live_session *s)
{
    if (s->connection_told != s->live->connection) {
        lws_callback_on_writable(s->wsi);
        return send_link(s);
    }
    for (int i = 0; i < ASKS_MAX; i++) {
        if (s->ask[i].text) {
            const int status = send_text(s->wsi, s->ask[i].text, s->ask[i].size);
            drop_reply(&s->ask[i]);
            lws_callback_on_writable(s->wsi);
            return status;
        }
    }
    for (unsigned i = 0; i < s->n_views; i++) {
        struct view *view = &s->view[s->turn++ % s->n_views];
        if (has_news(view)) {
            lws_callback_on_writable(s->wsi);
            return send_view(s, view);
        }
    }
    return 0;
}

/* ---- from the page ---- */

static void close_views(struct web_live_session *s)
{
    for (unsigned i = 0; i < s->n_views; i++)
        web_board_close(s->view[i].channel);
    s->n_views = 0;
}

/* The new set is opened before the old one is closed: what is in both is not asked anew. */
static bool watch(struct web_live_session *s, const json_t *list)
{
    struct view view[VIEWS_MAX] = {0};
    unsigned n = 0;
    for (size_t i = 0; i < json_array_size(list) && n < VIEWS_MAX; i++) {
        const json_t *one = json_array_get(list, i);
        const char *method = json_string_value(json_object_get(one, "method"));
        json_t *given = json_object_get(one, "params");
        json_t *params = json_is_object(given) ? json_incref(given) : json_object();
        view[n].channel = method ? web_board_open(s->live->board, method, params) : NULL;
        json_decref(params);
        if (view[n].channel)
            n++;
    }
    for (unsigned i = 0; i < n; i++)
        for (unsigned k = 0; k < s->n_views; k++)
            if (view[i].channel == s->view[k].channel && !view[i].channel->rows)
                view[i].seen = s->view[k].seen;
    close_views(s);
    memcpy(s->view, view, sizeof view);
    s->n_views = n;
    lws_callback_on_writable(s->wsi);
    return json_is_array(list);
}

static bool waits_for_restart(const struct web_live *live, const json_t *keys)
{
    static const char others[] = "other sections [";
    for (size_t i = 0; i < json_array_size(keys); i++) {
        const char *text = json_string_value(json_array_get(keys, i));
        if (text && strncmp(text, live->changed, live->changed_key) == 0 && text[live->changed_key] == ' ')
            return true;
        if (text && strncmp(text, others, strlen(others)) == 0) /* which ones it does not say */
            return true;
    }
    return false;
}

/* The change is over: what its page is told, if that is still there. A message of the JSON value, or a refusal. */
static void conclude(struct web_live *live, json_t *applied, int code, const char *message)
{
    struct ask *ask = live->changer;
    live->phase = WEB_LIVE_IDLE;
    live->changer = NULL;
    if (ask && applied)
        reply(ask, json_pack("{s:I, s:{s:O}}", "id", ask->id, "result", "applied", applied));
    else if (ask)
        refuse(ask, code, message);
}

/* The daemon has read the file as it was before: whatever became of the lost request, the two agree now. */
static void restored(void *ctx, const struct web_answer *answer)
{
    struct web_live *live = ctx;
    char message[512];
    if (!answer->result && !answer->rpc_code) {
        live->phase = WEB_LIVE_LOST; /* until it is back */
        return;
    }
    if (answer->result)
        snprintf(message, sizeof message,
                 "the daemon was lost before it answered: the change is taken back, from the daemon as well");
    else
        snprintf(message, sizeof message,
                 "the daemon was lost before it answered: it is not known whether it took the change, "
                 "which is no longer in the file: %s",
                 answer->message);
    conclude(live, NULL, RPC_NO_REPLY, message);
}

/* Nobody knows whether the daemon took what it did not answer. It may be starting by now, and a value that it would
 * refuse would keep it from that: so the file is as it was before, and the daemon reads it once it is there. */
static void restore(struct web_live *live)
{
    struct fault fault;
    char message[FAULT_TEXT_MAX + 128];
    if (!web_settings_take_back(live->settings, &fault)) {
        snprintf(message, sizeof message,
                 "it is not known whether the daemon took the change, and it cannot be taken back: %s",
                 fault.text);
        conclude(live, NULL, RPC_NO_REPLY, message);
        return;
    }
    live->phase = web_link_ask(live->asks, "reload", NULL, restored, live) ? WEB_LIVE_CHANGING : WEB_LIVE_LOST;
}

/* What the daemon refuses after all does not stay in the file, whether or not the page is still there. */
static void reloaded(void *ctx, const struct web_answer *answer)
{
    struct web_live *live = ctx;
    const bool restart = waits_for_restart(live, json_object_get(answer->result, "needs_restart"));
    struct fault fault;
    if (answer->result && !restart)
        conclude(live, json_object_get(answer->result, "applied"), 0, NULL);
    else if (!answer->result && !answer->rpc_code)
        restore(live);
    else if (!web_settings_take_back(live->settings, &fault))
        conclude(live, NULL, RPC_NO_REPLY, fault.text);
    else if (restart)
        conclude(live, NULL, RPC_INVALID, "this key needs a restart of the daemon: nothing is changed");
    else
        conclude(live, NULL, answer->rpc_code, answer->message);
}

/* Nothing is in the file before the daemon has said that it would take it. */
static void checked(void *ctx, const struct web_answer *answer)
{
    struct web_live *live = ctx;
    struct fault fault;
    const char *why;
    if (answer->result && !waits_for_restart(live, json_object_get(answer->result, "needs_restart"))) {
        if (!web_settings_save(live->settings, &fault)) {
            web_settings_forget(live->settings);
            conclude(live, NULL, RPC_INVALID, fault.text);
        } else if (!web_link_ask(live->asks, "reload", NULL, reloaded, live)) {
            why = web_link_state(live->asks);
            reloaded(live,
                     &(struct web_answer){.rpc_code = RPC_LIMIT, .message = why ? why : "too much is asked"});
        }
        return;
    }
    web_settings_forget(live->settings);
    if (answer->result)
        conclude(live, NULL, RPC_INVALID, "this key needs a restart of the daemon: nothing is changed");
    else if (answer->rpc_code)
        conclude(live, NULL, answer->rpc_code, answer->message);
    else
        conclude(live, NULL, RPC_NO_REPLY, "the daemon was lost before it answered: nothing is changed");
}

/* The question whether the daemon would take the file; false with a fault. */
static bool ask_check(struct web_live *live, struct fault *fault)
{
    char *file = web_settings_file(live->settings, fault), *text = web_settings_text(live->settings);
    json_t *params = file && text ? json_pack("{s:s, s:s}", "file", file, "text", text) : NULL;
    const bool good = params && web_link_ask(live->asks, "reload_check", params, checked, live);
    const char *why = web_link_state(live->asks);
    if (file && !good)
        fault_set(fault, "%s", !params ? "out of memory" : why ? why : "too much is asked");
    json_decref(params);
    free(file);
    free(text);
    return good;
}

void web_live_asks_changed(struct web_live *live)
{
    if (live->phase == WEB_LIVE_LOST && !web_link_state(live->asks))
        restore(live);
}

static void answer_guess(lws_sorted_usec_list_t *timer)
{
    struct web_live_session *s = lws_container_of(timer, struct web_live_session, guess_over);
    struct ask *ask = s->guess;
    s->guess = NULL;
    refuse(ask, RPC_NO_RIGHT, "this is not the token");
}

/* The right token is taken whatever others give: only who gave a wrong one waits. One change at a time. */
static bool may_change(struct ask *ask, const char *token)
{
    struct web_live_session *s = ask->session;
    struct web_live *live = s->live;
    if (!live->settings->path) {
        refuse(ask, RPC_NO_SUCH, "nothing can be changed here; sonard-web(8) says how to allow it (--settings)");
    } else if (s->guess) {
        refuse(ask, RPC_LIMIT, "wait a second and try again");
    } else if (!token || !web_settings_token(live->settings, token)) {
        s->guess = ask;
        lws_sul_schedule(live->asks->context, 0, &s->guess_over, answer_guess, GUESS_US);
    } else if (live->phase != WEB_LIVE_IDLE) {
        refuse(ask, RPC_LIMIT, "another change waits for the daemon: try again once it has answered");
    } else {
        return true;
    }
    return false;
}

static void change(struct ask *ask, const json_t *params)
{
    struct web_live *live = ask->session->live;
    const char *text = json_string_value(json_object_get(params, "text"));
    struct web_setting setting;
    struct fault fault;
    if (!may_change(ask, json_string_value(json_object_get(params, "token"))))
        return;
    if (!web_settings_parse(text ? text : "", &setting, &fault) ||
        !web_settings_change(live->settings, &setting, &fault)) {
        refuse(ask, RPC_INVALID, fault.text);
        return;
    }
    snprintf(live->changed, sizeof live->changed, "%s", setting.text);
    live->changed_key = setting.key;
    live->changer = ask;
    live->phase = WEB_LIVE_CHANGING;
    if (ask_check(live, &fault))
        return;
    web_settings_forget(live->settings);
    conclude(live, NULL, RPC_LIMIT, fault.text);
}

/* On or off. A file is written on the daemon's disk: only with the token. */
static void record(struct ask *ask, const json_t *params)
{
    struct web_link *asks = ask->session->live->asks;
    const json_t *on = json_object_get(params, "on");
    if (!may_change(ask, json_string_value(json_object_get(params, "token"))))
        return;
    if (!json_is_boolean(on))
        refuse(ask, RPC_INVALID, "on: expected true or false");
    else if (!web_link_ask(asks, json_is_true(on) ? "record_start" : "record_stop", NULL, answered, ask))
        refuse(ask, RPC_LIMIT, web_link_state(asks) ? web_link_state(asks) : "too much is asked");
}

static bool may_call(const struct web_live *live, const char *method)
{
    return web_query_method(method) || (live->replay && strcmp(method, "replay") == 0);
}

static bool question(struct web_live_session *s, const json_t *message)
{
    const char *method = json_string_value(json_object_get(message, "method"));
    json_t *id = json_object_get(message, "id"), *params = json_object_get(message, "params");
    struct ask *ask = NULL;
    if (!json_is_integer(id) || !method || (params && !json_is_object(params)))
        return false;
    for (int i = 0; i < ASKS_MAX && !ask; i++)
        ask = s->ask[i].waits || s->ask[i].text ? NULL : &s->ask[i];
    if (!ask)
        return false; /* a page waits for its answers */
    *ask = (struct ask){.session = s, .waits = true, .id = json_integer_value(id)};
    if (strcmp(method, "settings") == 0)
        change(ask, params);
    else if (strcmp(method, "record") == 0)
        record(ask, params);
    else if (!may_call(s->live, method))
        refuse(ask, RPC_NO_SUCH, "no such method, or one that changes something");
    else if (!web_link_ask(s->live->asks, method, params, answered, ask))
        refuse(ask, RPC_LIMIT,
               web_link_state(s->live->asks) ? web_link_state(s->live->asks) : "too much is asked");
    return true;
}

static bool read_message(struct web_live_session *s)
{
    json_t *message = json_loadb(s->in, s->in_size, JSON_REJECT_DUPLICATES, NULL);
    const json_t *list = json_object_get(message, "watch");
    const bool good = json_is_object(message) && (list ? watch(s, list) : question(s, message));
    s->in_size = 0;
    json_decref(message);
    return good;
}

static int receive(struct web_live_session *s, const char *bytes, size_t n)
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

static int enter(struct web_live *live, struct web_live_session *s, struct lws *wsi)
{
    *s = (struct web_live_session){.live = live, .wsi = wsi, .next = live->first, .connection_told = ~0u};
    for (int i = 0; i < ASKS_MAX; i++)
        s->ask[i].session = s;
    live->first = s;
    live->sessions++;
    /* what waits in the kernel for a slow page is old: let it be little */
    setsockopt(lws_get_socket_fd(wsi), SOL_SOCKET, SO_SNDBUF, &(int){KERNEL_BYTES}, sizeof(int));
    lws_callback_on_writable(wsi);
    return 0;
}

static void leave(struct web_live_session *s)
{
    struct web_live_session **at;
    if (!s || !s->live)
        return; /* it was refused before it was here */
    at = &s->live->first;
    while (*at != s)
        at = &(*at)->next;
    *at = s->next;
    s->live->sessions--;
    close_views(s);
    lws_sul_cancel(&s->guess_over);
    for (int i = 0; i < ASKS_MAX; i++) {
        web_link_cancel(s->live->asks, &s->ask[i]);
        if (s->live->changer == &s->ask[i])
            s->live->changer = NULL;
        drop_reply(&s->ask[i]);
    }
}

static int callback(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t n)
{
    const struct lws_protocols *protocol = lws_get_protocol(wsi);
    struct web_live *live = protocol ? protocol->user : NULL;
    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return live && live->sessions < WEB_LIVE_MAX ? 0 : -1;
    case LWS_CALLBACK_ESTABLISHED:
        return enter(live, user, wsi);
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

struct lws_protocols web_live_protocol(struct web_live *live)
{
    return (struct lws_protocols){.name = "sonard",
                                  .callback = callback,
                                  .per_session_data_size = sizeof(struct web_live_session),
                                  .rx_buffer_size = MESSAGE_MAX,
                                  .user = live};
}

void web_live_news(struct web_live *live, const struct web_channel *channel)
{
    for (struct web_live_session *s = live->first; s; s = s->next)
        for (unsigned i = 0; i < s->n_views; i++)
            if (s->view[i].channel == channel)
                lws_callback_on_writable(s->wsi);
}

void web_live_link_changed(struct web_live *live)
{
    live->connection++;
    for (struct web_live_session *s = live->first; s; s = s->next) {
        for (unsigned i = 0; i < s->n_views; i++)
            s->view[i].seen = s->view[i].channel->rows ? s->view[i].channel->rows->change : 0;
        lws_callback_on_writable(s->wsi);
    }
}
