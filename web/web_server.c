/* SPDX-License-Identifier: MIT */
#include "web_server.h"

#include <errno.h>
#include <inttypes.h>
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "web_budget.h"
#include "web_files.h"
#include "web_foxglove.h"
#include "web_link.h"
#include "web_live.h"
#include "web_metrics.h"
#include "web_openapi.h"
#include "web_query.h"
#include "web_stranger.h"

#define DESCRIPTORS_MAX 192   /* connections of browsers and programs, together */
#define HEADERS_MAX     8192  /* bytes of a request */
#define REQUEST_S       5     /* until a request is there as a whole */
#define ANSWER_S        20    /* until its answer is sent as a whole */
#define IDLE_S          15    /* between two requests of a connection */
#define CHUNK_BYTES     16384 /* of an answer, at a time */
#define HOST_BYTES      256

enum protocol_place { HTTP, LIVE, FOXGLOVE, FOXGLOVE_SDK, DAEMON, PROTOCOLS };

struct web_server {
    struct lws_context *context;
    struct lws_protocols protocol[PROTOCOLS + 1];
    struct web_guard guard;
    struct web_budget budget;
    struct web_link feed, asks; /* what is watched does not wait for what is asked */
    struct web_board board;
    struct web_live live;
    struct web_settings settings;
    struct web_foxglove foxglove;
    char *openapi;
};

/* An answer on its way; of a connection that waits for the next request all zeros. */
struct exchange {
    struct web_server *server;
    struct lws *wsi;
    unsigned status;
    const char *type, *body;
    char *owned; /* body, when it is to be freed; then the budget counts it */
    size_t size, sent;
    bool head, head_sent;
    json_t *said[WEB_METRICS_QUESTIONS]; /* of /metrics: what the daemon has answered so far ... */
    int asked;                           /* ... to so many of its questions; 0: it is another request */
    char host[HOST_BYTES];
};

/* ---- answers ---- */

static void finish_exchange(struct exchange *e)
{
    if (e->server)
        web_link_cancel(&e->server->asks, e);
    if (e->owned)
        web_budget_give(&e->server->budget, e->size);
    free(e->owned);
    for (int i = 0; i < WEB_METRICS_QUESTIONS; i++)
        json_decref(e->said[i]);
    *e = (struct exchange){0};
}

static void respond(struct exchange *e, unsigned status, const char *type, const char *body, size_t size)
{
    e->status = status;
    e->type = type;
    e->body = body;
    e->size = size;
    lws_set_timeout(e->wsi, PENDING_TIMEOUT_HTTP_CONTENT, ANSWER_S);
    lws_callback_on_writable(e->wsi);
}

/* text is for free(). */
static void respond_owned(struct exchange *e, unsigned status, const char *type, char *text)
{
    static const char too_much[] =
        "{\"error\":{\"code\":-32000,\"message\":\"too many answers wait to be taken\"}}";
    const size_t size = text ? strlen(text) : 0;

    if (!text || !web_budget_take(&e->server->budget, size)) {
        free(text);
        respond(e, 503, "application/json", too_much, sizeof too_much - 1);
        return;
    }
    e->owned = text;
    respond(e, status, type, text, size);
}

static void refuse(struct exchange *e, unsigned status, int code, const char *message)
{
    json_t *refusal = json_pack("{s:{s:i, s:s}}", "error", "code", code, "message", message);
    respond_owned(e, status, "application/json", refusal ? json_dumps(refusal, JSON_COMPACT) : NULL);
    json_decref(refusal);
}

static unsigned status_of(int rpc_code)
{
    switch (rpc_code) {
    case -32602:
    case -32600:
        return 400;
    case -32601:
        return 404;
    case -32000:
        return 429;
    case 0:
        return 503;
    default:
        return 500;
    }
}

static void answered(void *ctx, const struct web_answer *answer);

static void ask_daemon(struct exchange *e, const char *method, json_t *params)
{
    const char *why;
    lws_set_timeout(e->wsi, PENDING_TIMEOUT_HTTP_CONTENT, ANSWER_S);
    if (web_link_ask(&e->server->asks, method, params, answered, e))
        return;
    why = web_link_state(&e->server->asks);
    refuse(e, why ? 503 : 429, why ? 0 : -32000, why ? why : "too many requests wait for the daemon");
}

/* Asks the next of its questions, or answers. */
static void go_on_with_metrics(struct exchange *e)
{
    const struct web_metrics_question *next = &web_metrics_question[e->asked];
    char *text = NULL;
    json_t *params;
    size_t n;
    FILE *out;
    if (e->asked++ < WEB_METRICS_QUESTIONS) {
        params = next->params ? json_loads(next->params, 0, NULL) : NULL;
        ask_daemon(e, next->method, params);
        json_decref(params);
    } else {
        out = open_memstream(&text, &n);
        if (out) {
            web_metrics_print(out, e->said);
            fclose(out);
        }
        respond_owned(e, 200, "text/plain; version=0.0.4; charset=utf-8", text);
    }
}

static void answered(void *ctx, const struct web_answer *answer)
{
    struct exchange *e = ctx;
    if (!answer->result) {
        refuse(e, status_of(answer->rpc_code), answer->rpc_code, answer->message);
    } else if (e->asked > 0) {
        e->said[e->asked - 1] = json_incref(answer->result);
        go_on_with_metrics(e);
    } else {
        respond_owned(e, 200, "application/json",
                      json_dumps(answer->result, JSON_COMPACT | JSON_REAL_PRECISION(15)));
    }
}

static bool add_header(struct lws *wsi, const char *name, const char *value, uint8_t **at, uint8_t *end)
{
    return lws_add_http_header_by_name(wsi, (const unsigned char *)name, (const unsigned char *)value,
                                       (int)strlen(value), at, end) == 0;
}

static bool add_policy(const struct exchange *e, uint8_t **at, uint8_t *end)
{
    char policy[600];
    const int name = (int)(e->host[0] == '[' ? strcspn(e->host, "]") + 1 : strcspn(e->host, ":"));
    /* pages of this machine at other ports may frame this one, as BlueOS does */
    snprintf(policy, sizeof policy,
             "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
             "base-uri 'none'; form-action 'none'; frame-ancestors 'self'%s%.*s%s",
             name ? " http://" : "", name, e->host, name ? ":*" : "");
    return add_header(e->wsi, "content-security-policy:", policy, at, end);
}

static int send_head(struct exchange *e)
{
    uint8_t buffer[LWS_PRE + 2048], *at = buffer + LWS_PRE, *start = at, *end = buffer + sizeof buffer;
    if (lws_add_http_common_headers(e->wsi, e->status, e->type, e->size, &at, end) ||
        !add_header(e->wsi, "x-content-type-options:", "nosniff", &at, end) ||
        !add_header(e->wsi, "referrer-policy:", "no-referrer", &at, end) ||
        !add_header(e->wsi, "cross-origin-resource-policy:", "same-origin", &at, end) ||
        !add_header(e->wsi, "cache-control:", e->owned ? "no-store" : "no-cache", &at, end) ||
        !add_policy(e, &at, end) || lws_finalize_write_http_header(e->wsi, start, &at, end))
        return -1;
    e->head_sent = true;
    return 0;
}

static int complete(struct exchange *e)
{
    struct lws *wsi = e->wsi;
    finish_exchange(e);
    return lws_http_transaction_completed(wsi) ? -1 : 0;
}

static int send_more(struct exchange *e)
{
    static uint8_t chunk[LWS_PRE + CHUNK_BYTES];
    const size_t left = e->size - e->sent, n = left < CHUNK_BYTES ? left : CHUNK_BYTES;
    if (!e->status)
        return 0;
    if (!e->head_sent) {
        if (send_head(e) < 0)
            return -1;
        if (e->head || e->size == 0)
            return complete(e);
        lws_callback_on_writable(e->wsi);
        return 0;
    }
    memcpy(chunk + LWS_PRE, e->body + e->sent, n);
    if (lws_write(e->wsi, chunk + LWS_PRE, n, n == left ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) < (int)n)
        return -1;
    e->sent += n;
    if (e->sent == e->size)
        return complete(e);
    lws_callback_on_writable(e->wsi);
    return 0;
}

/* ---- requests ---- */

/* The value of a header, or NULL. A longer one is none. */
static const char *header(struct lws *wsi, enum lws_token_indexes which, char *value, int size)
{
    return lws_hdr_copy(wsi, value, size, which) > 0 ? value : NULL;
}

/* Address and port of this end of the connection, as in a URL. */
static void name_here(struct lws *wsi, char here[HOST_BYTES])
{
    struct sockaddr_storage address;
    socklen_t size = sizeof address;
    char host[NI_MAXHOST], port[NI_MAXSERV];
    const char *plain = host;
    if (getsockname(lws_get_socket_fd(wsi), (struct sockaddr *)&address, &size) < 0 ||
        getnameinfo((struct sockaddr *)&address, size, host, sizeof host, port, sizeof port,
                    NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
        snprintf(here, HOST_BYTES, "127.0.0.1:9360");
        return;
    }
    if (strncmp(host, "::ffff:", 7) == 0)
        plain = host + 7; /* an IPv4 connection to an IPv6 socket */
    host[strcspn(host, "%")] = '\0';
    snprintf(here, HOST_BYTES, strchr(plain, ':') ? "[%.64s]:%.8s" : "%.64s:%.8s", plain, port);
}

/* Browsers say that they would like a page; programs get the sentence as JSON. */
static bool wants_page(struct lws *wsi)
{
    char accept[HOST_BYTES];
    return header(wsi, WSI_TOKEN_HTTP_ACCEPT, accept, sizeof accept) && strstr(accept, "text/html");
}

static bool is_ours(struct lws *wsi, const struct web_guard *guard, char host[HOST_BYTES], struct fault *fault)
{
    char origin[HOST_BYTES];
    const bool has_origin = lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) > 0;
    if (!header(wsi, WSI_TOKEN_HOST, host, HOST_BYTES))
        return fault_set(fault, "no host name, or one that is too long");
    if (!web_guard_host(guard, host))
        return fault_set(fault, "host name '%.*s' is not allowed; start sonard-web with --names followed by it",
                         (int)strcspn(host, ":"), host);
    if (has_origin &&
        (!header(wsi, WSI_TOKEN_ORIGIN, origin, sizeof origin) || !web_guard_origin(guard, origin, host)))
        return fault_set(fault, "pages of this Origin may not ask; allow it with --origins");
    return true;
}

/* A browser says so of what a page of another site wants to load. */
static bool is_cross_site(struct lws *wsi)
{
    static const char name[] = "sec-fetch-site:";
    char value[32];
    const int n = lws_hdr_custom_copy(wsi, value, sizeof value, name, (int)sizeof name - 1);
    return n > 0 && strcmp(value, "same-origin") != 0 && strcmp(value, "none") != 0;
}

/* Over plain HTTP a browser does not say for which site it loads something. But what another site's page has it load,
 * an image for instance, comes without this header, and for a script of that page it would have to be allowed. */
static bool has_own_header(struct lws *wsi)
{
    static const char name[] = WEB_QUERY_HEADER ":";
    return lws_hdr_custom_length(wsi, name, (int)sizeof name - 1) > 0;
}

static void serve_method(struct exchange *e, const char *name)
{
    const struct protocol_method *method = web_query_method(name);
    char part[HEADERS_MAX];
    struct fault fault;
    json_t *params;
    bool good = true;
    if (!method) {
        refuse(e, 404, -32601, "no such method, or one that changes something; see /api/openapi.json");
        return;
    }
    if (!web_query_is_cheap(method) && !has_own_header(e->wsi)) {
        refuse(e, 403, -32001,
               "this question costs: send the header X-Sonard, with any value (curl -H 'X-Sonard: 1')");
        return;
    }
    params = json_object();
    for (int i = 0, n;
         good && (n = lws_hdr_copy_fragment(e->wsi, part, sizeof part, WSI_TOKEN_HTTP_URI_ARGS, i)) >= 0; i++)
        good = n == 0 || web_query_add(method, params, part, (size_t)n, &fault);
    if (good)
        ask_daemon(e, method->name, params);
    else
        refuse(e, 400, -32602, fault.text);
    json_decref(params);
}

static void serve_service(struct exchange *e)
{
    json_t *said = json_pack("{s:s, s:s, s:s, s:s, s:s, s:s, s:s}", "name", "sonard", "description",
                             "Obstacles and free space from the sonar", "icon", "mdi-radar", "company", "sonard",
                             "version", SONARD_VERSION, "webpage", "", "api", "/api/openapi.json");
    respond_owned(e, 200, "application/json", said ? json_dumps(said, JSON_COMPACT) : NULL);
    json_decref(said);
}

static void serve_openapi(struct exchange *e)
{
    struct web_server *server = e->server;
    if (!server->openapi)
        server->openapi = web_openapi();
    if (server->openapi)
        respond(e, 200, "application/json", server->openapi, strlen(server->openapi));
    else
        refuse(e, 500, -32603, "out of memory");
}

static void serve(struct exchange *e, const char *path)
{
    const struct web_file *file = web_files_find(path);
    const bool data = strncmp(path, "/api/", 5) == 0 || strcmp(path, "/metrics") == 0;
    if (data && is_cross_site(e->wsi)) {
        refuse(e, 403, -32001, "pages of other sites may not ask");
    } else if (file) {
        respond(e, 200, file->type, file->start, (size_t)(file->end - file->start));
    } else if (strcmp(path, "/api/openapi.json") == 0) {
        serve_openapi(e);
    } else if (strcmp(path, "/register_service") == 0) {
        serve_service(e);
    } else if (strcmp(path, "/metrics") == 0) {
        go_on_with_metrics(e);
    } else if (data) {
        serve_method(e, path + 5);
    } else {
        refuse(e, 404, -32601, "no such page");
    }
}

static void refuse_stranger(struct exchange *e, const char *why)
{
    char here[HOST_BYTES];
    if (wants_page(e->wsi) && !web_guard_host(&e->server->guard, e->host)) {
        name_here(e->wsi, here);
        respond_owned(e, 403, "text/html; charset=utf-8", web_stranger_page(e->host, here));
    } else {
        refuse(e, 403, -32001, why);
    }
    e->host[0] = '\0'; /* such a name is in no policy */
}

static int receive(struct web_server *server, struct exchange *e, struct lws *wsi, const char *path)
{
    struct fault fault;
    char *uri;
    int n;
    finish_exchange(e);
    e->server = server;
    e->wsi = wsi;
    const int method = lws_http_get_uri_and_method(wsi, &uri, &n);

    if (method != LWSHUMETH_GET && method != LWSHUMETH_HEAD) {
        lws_return_http_status(wsi, HTTP_STATUS_METHOD_NOT_ALLOWED, NULL);
        return -1; /* its body is not read */
    }
    e->head = method == LWSHUMETH_HEAD;
    if (!is_ours(wsi, &server->guard, e->host, &fault)) {
        refuse_stranger(e, fault.text);
    } else {
        serve(e, path);
    }
    return 0;
}

static int callback(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t n)
{
    const struct lws_protocols *protocol = lws_get_protocol(wsi);
    struct web_server *server = protocol ? protocol->user : NULL;
    char host[HOST_BYTES];
    struct fault fault;
    switch (reason) {
    case LWS_CALLBACK_HTTP:
        return receive(server, user, wsi, in);
    case LWS_CALLBACK_HTTP_WRITEABLE:
        return send_more(user);
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:
        return strcmp(in, "websocket") == 0 && is_ours(wsi, &server->guard, host, &fault) ? 0 : -1;
    case LWS_CALLBACK_CLOSED_HTTP:
    case LWS_CALLBACK_HTTP_DROP_PROTOCOL:
        if (user)
            finish_exchange(user);
        return 0;
    case LWS_CALLBACK_RAW_ADOPT: /* what CONNECT makes of a connection; no time limit would hold for it */
    case LWS_CALLBACK_RAW_CONNECTED:
    case LWS_CALLBACK_RAW_RX:
        return -1;
    default:
        return lws_callback_http_dummy(wsi, reason, user, in, n);
    }
}

/* ---- start and end ---- */

static void feed_changed(void *ctx)
{
    struct web_server *server = ctx;
    web_board_reset(&server->board);
    web_live_link_changed(&server->live);
    web_foxglove_link_changed(&server->foxglove);
}

static void asks_changed(void *ctx)
{
    struct web_server *server = ctx;
    web_live_asks_changed(&server->live);
}

static void news(void *ctx, const struct web_channel *channel)
{
    struct web_server *server = ctx;
    web_live_news(&server->live, channel);
    web_foxglove_news(&server->foxglove, channel);
}

static void log_library(int level, const char *line)
{
    (void)level;
    fprintf(stderr, "sonard-web: %s", line);
}

static void set_protocols(struct web_server *server)
{
    server->protocol[HTTP] = (struct lws_protocols){
        .name = "http", .callback = callback, .per_session_data_size = sizeof(struct exchange), .user = server};
    server->protocol[LIVE] = web_live_protocol(&server->live);
    server->protocol[FOXGLOVE] = web_foxglove_protocol(&server->foxglove, WEB_FOXGLOVE_NAME);
    server->protocol[FOXGLOVE_SDK] = web_foxglove_protocol(&server->foxglove, WEB_FOXGLOVE_SDK_NAME);
    server->protocol[DAEMON] = web_link_protocol;
}

static bool listen_at(struct web_server *server, const struct web_server_conf *conf, struct fault *fault)
{
    /* a page that is gone without a word is found out by pings */
    static const lws_retry_bo_t validity = {.secs_since_valid_ping = 20, .secs_since_valid_hangup = 30};
    struct lws_context_creation_info info = {
        .port = conf->port,
        .iface = conf->address,
        .protocols = server->protocol,
        .options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND |
                   (conf->address && !strchr(conf->address, ':') ? LWS_SERVER_OPTION_DISABLE_IPV6 : 0),
        .fd_limit_per_thread = DESCRIPTORS_MAX,
        .max_http_header_data = HEADERS_MAX,
        .max_http_header_pool = DESCRIPTORS_MAX,
        .timeout_secs = REQUEST_S,
        .keepalive_timeout = IDLE_S,
        .retry_and_idle_policy = &validity,
        .server_string = "sonard-web",
        .gid = -1,
        .uid = -1,
    };
    struct lws_vhost *vhost;

    lws_set_log_level(LLL_ERR, log_library);
    server->context = lws_create_context(&info);
    if (!server->context)
        return fault_set(fault, "libwebsockets does not start");
    errno = 0;
    vhost = lws_create_vhost(server->context, &info);
    if (!vhost)
        return fault_set(fault, "cannot listen on %s port %d: %s", conf->address ? conf->address : "any address",
                         conf->port, errno ? strerror(errno) : "no such address here");
    server->feed = (struct web_link){
        .path = conf->socket, .context = server->context, .vhost = vhost, .changed = feed_changed, .ctx = server};
    server->asks = (struct web_link){
        .path = conf->socket, .context = server->context, .vhost = vhost, .changed = asks_changed, .ctx = server};
    return true;
}

struct web_server *web_server_new(const struct web_server_conf *conf, struct fault *fault)
{
    struct web_server *server = calloc(1, sizeof *server);
    if (!server) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    server->guard = conf->guard;
    server->board = (struct web_board){.link = &server->feed, .news = news, .ctx = server};
    server->live = (struct web_live){.board = &server->board,
                                     .asks = &server->asks,
                                     .budget = &server->budget,
                                     .settings = &server->settings,
                                     .replay = conf->replay};
    server->foxglove = (struct web_foxglove){.board = &server->board};
    set_protocols(server);
    if (conf->settings && !web_settings_open(&server->settings, conf->settings, conf->token, fault)) {
        web_server_free(server);
        return NULL;
    }
    if (!listen_at(server, conf, fault)) {
        web_server_free(server);
        return NULL;
    }
    web_link_start(&server->feed);
    web_link_start(&server->asks);
    return server;
}

bool web_server_turn(struct web_server *server)
{
    return lws_service(server->context, 0) >= 0;
}

void web_server_wake(struct web_server *server)
{
    lws_cancel_service(server->context);
}

void web_server_free(struct web_server *server)
{
    if (server->feed.context) {
        web_board_stop(&server->board);
        web_foxglove_stop(&server->foxglove);
        web_link_stop(&server->feed);
        web_link_stop(&server->asks);
    }
    if (server->context)
        lws_context_destroy(server->context);
    free(server->openapi);
    free(server);
}
