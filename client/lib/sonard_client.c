/* SPDX-License-Identifier: MIT */
/*
 * sonard_client - libsonard's connection: bytes to messages and back. Knows no method by name but watch; sonard_answers
 * does.
 */
#include "sonard_json.h"

#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define IN_START_BYTES 8192
#define IN_MAX_BYTES   (8u << 20)
#define OUT_MAX_BYTES  65536
#define KEPT_MAX       64
#define DIGITS         15 /* of numbers handed on: a text of at most so many comes out as it came in */
#define RETRY_MS       20 /* between attempts while the daemon's queue of new clients is full */

struct sonard_client {
    int fd;
    double timeout_s;
    char path[sizeof((struct sockaddr_un *)0)->sun_path];
    int64_t last_id;
    char *in;
    size_t in_len, in_size;
    char *out; /* requests not yet written */
    size_t out_len;
    json_t *kept; /* notifications' params that came during calls, oldest first */
    char *text;   /* what the last message handed out points to */
};

__attribute__((format(printf, 3, 4))) static bool fail(struct sonard_error *error, enum sonard_status status,
                                                       const char *fmt, ...)
{
    va_list args;
    error->status = status;
    error->rpc_code = 0;
    va_start(args, fmt);
    vsnprintf(error->message, sizeof error->message, fmt, args);
    va_end(args);
    return false;
}

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

/* Waits for `events`; false when the deadline passes before. */
static bool await(const struct sonard_client *client, short events, double deadline_s)
{
    for (;;) {
        struct pollfd p = {.fd = client->fd, .events = events};
        const double left_s = deadline_s - now_s();
        const int n = poll(&p, 1, left_s <= 0 ? 0 : left_s > 1e6 ? 1000000000 : (int)(left_s * 1e3) + 1);
        if (n > 0)
            return true;
        if (n == 0 && now_s() >= deadline_s)
            return false;
        if (n < 0 && errno != EINTR)
            return false;
    }
}

/* What is refused there need not be one: the kernel says the same of a file. */
static bool is_no_socket(const char *path)
{
    struct stat st;
    return stat(path, &st) == 0 && !S_ISSOCK(st.st_mode);
}

static bool fail_connect(struct sonard_error *error, const char *path, int failure)
{
    if (failure == ECONNREFUSED && is_no_socket(path))
        return fail(error, SONARD_NO_DAEMON, "%s is not a socket", path);
    switch (failure) {
    case ENOENT:
    case ECONNREFUSED:
    case ENOTDIR:
    case ENOTSOCK:
        return fail(error, SONARD_NO_DAEMON, "no daemon answers on %s (%s): is sonard running, with this socket?",
                    path, strerror(failure));
    case EACCES:
    case EPERM:
        return fail(error, SONARD_NO_PERMISSION, "no permission to use %s: is this user in the socket's group?",
                    path);
    case EAGAIN:
        return fail(error, SONARD_SILENT, "the daemon on %s does not take new clients", path);
    default:
        return fail(error, SONARD_LOST, "cannot connect to %s: %s", path, strerror(failure));
    }
}

struct sonard_client *sonard_connect(const char *path, double timeout_s, struct sonard_error *error)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    struct sonard_client *client;
    const double deadline_s = now_s() + timeout_s;
    const char *set = getenv("SONARD_SOCKET");
    int failure;
    path = path ? path : set && *set ? set : SONARD_DEFAULT_SOCKET;
    if (strlen(path) == 0 || strlen(path) >= sizeof address.sun_path) {
        fail(error, SONARD_NO_DAEMON, "a socket's path has 1 to %zu bytes, this one has %zu",
             sizeof address.sun_path - 1, strlen(path));
        return NULL;
    }
    strcpy(address.sun_path, path);
    client = calloc(1, sizeof *client);
    if (!client) {
        fail(error, SONARD_LOST, "out of memory");
        return NULL;
    }
    strcpy(client->path, path);
    client->timeout_s = timeout_s;
    client->kept = json_array();
    client->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    for (;;) {
        failure = client->fd < 0 ? errno : 0;
        if (!failure && connect(client->fd, (const struct sockaddr *)&address, sizeof address) < 0)
            failure = errno;
        if (failure != EAGAIN || now_s() >= deadline_s)
            break;
        poll(NULL, 0, RETRY_MS);
    }
    if (failure) {
        fail_connect(error, path, failure);
        sonard_disconnect(client);
        return NULL;
    }
    return client;
}

void sonard_disconnect(struct sonard_client *client)
{
    if (!client)
        return;
    if (client->fd >= 0)
        close(client->fd);
    json_decref(client->kept);
    free(client->in);
    free(client->out);
    free(client->text);
    free(client);
}

int sonard_fd(const struct sonard_client *client)
{
    return client->fd;
}

short sonard_events(const struct sonard_client *client)
{
    return (short)(POLLIN | (client->out_len > 0 ? POLLOUT : 0));
}

/*
 * Writes what waits, until the deadline; SONARD_SILENT when some is left. A daemon that has closed may have said why
 * before: a broken pipe is left to the reading that follows.
 */
static bool flush(struct sonard_client *client, double deadline_s, struct sonard_error *error)
{
    while (client->out_len > 0) {
        const ssize_t k = send(client->fd, client->out, client->out_len, MSG_NOSIGNAL);
        if (k >= 0) {
            client->out_len -= (size_t)k;
            memmove(client->out, client->out + k, client->out_len);
        } else if (errno == EPIPE || errno == ECONNRESET) {
            client->out_len = 0;
        } else if (errno == EAGAIN && !await(client, POLLOUT, deadline_s)) {
            return fail(error, SONARD_SILENT, "the daemon on %s does not read requests", client->path);
        } else if (errno != EAGAIN && errno != EINTR) {
            return fail(error, SONARD_LOST, "sending to %s: %s", client->path, strerror(errno));
        }
    }
    return true;
}

static bool enqueue(struct sonard_client *client, const char *line, struct sonard_error *error)
{
    const size_t n = strlen(line);
    char *out = client->out_len < OUT_MAX_BYTES ? realloc(client->out, client->out_len + n + 1) : NULL;
    if (!out)
        return fail(error, SONARD_SILENT, "the daemon on %s does not read requests: %zu bytes wait", client->path,
                    client->out_len);
    client->out = out;
    memcpy(out + client->out_len, line, n);
    out[client->out_len + n] = '\n';
    client->out_len += n + 1;
    return true;
}

static bool grow_input(struct sonard_client *client, struct sonard_error *error)
{
    const size_t size = client->in_size ? 2 * client->in_size : IN_START_BYTES;
    char *in = size <= IN_MAX_BYTES ? realloc(client->in, size) : NULL;
    if (!in)
        return fail(error, SONARD_LOST, "a reply of %s is longer than %zu bytes", client->path, client->in_size);
    client->in = in;
    client->in_size = size;
    return true;
}

/* One message of the daemon, or NULL with *error set. */
static json_t *read_message(struct sonard_client *client, double deadline_s, struct sonard_error *error)
{
    size_t scanned = 0;
    for (;;) {
        const char *end =
            client->in_len > scanned ? memchr(client->in + scanned, '\n', client->in_len - scanned) : NULL;

        if (end) {
            const size_t n = (size_t)(end - client->in);
            json_t *message = json_loadb(client->in, n, JSON_REJECT_DUPLICATES, NULL);
            client->in_len -= n + 1;
            memmove(client->in, end + 1, client->in_len);
            if (!json_is_object(message)) {
                json_decref(message);
                fail(error, SONARD_LOST, "the program listening on %s does not speak JSON-RPC", client->path);
                return NULL;
            }
            return message;
        }
        scanned = client->in_len;
        if (client->in_len == client->in_size && !grow_input(client, error))
            return NULL;

        const ssize_t k = recv(client->fd, client->in + client->in_len, client->in_size - client->in_len, 0);

        if (k > 0) {
            client->in_len += (size_t)k;
        } else if (k < 0 && (errno == EAGAIN || errno == EINTR)) {
            if (!await(client, POLLIN, deadline_s)) {
                fail(error, SONARD_SILENT, "the daemon on %s is silent", client->path);
                return NULL;
            }
        } else {
            fail(error, SONARD_LOST, "the daemon on %s ended the connection%s%s", client->path, k < 0 ? ": " : "",
                 k < 0 ? strerror(errno) : "");
            return NULL;
        }
    }
}

static void keep_notification(struct sonard_client *client, json_t *params)
{
    if (json_array_size(client->kept) >= KEPT_MAX)
        json_array_remove(client->kept, 0);
    json_array_append(client->kept, params);
}

static int64_t integer(const json_t *object, const char *key)
{
    return json_integer_value(json_object_get(object, key));
}

/* What a reply or a watch says: the result, a new reference; NULL: refused, as out says. */
static json_t *hand_out(const json_t *said, struct sonard_message *out)
{
    const json_t *refusal = json_object_get(said, "error");
    const char *why = json_string_value(json_object_get(refusal, "message"));
    json_t *result = json_object_get(said, "result");
    if (result)
        return json_incref(result);
    fail(&out->refusal, SONARD_REFUSED, "%s", why ? why : "an error without a message");
    out->refusal.rpc_code = (int)integer(refusal, "code");
    return NULL;
}

static bool hand_out_notification(const json_t *params, struct sonard_message *out, json_t **result)
{
    *out = (struct sonard_message){.watch = integer(params, "watch"), .skipped = integer(params, "skipped")};
    *result = out->watch > 0 ? hand_out(params, out) : NULL;
    return out->watch > 0;
}

/* The result as text, which the client keeps until the next one; the result is used up. */
static const char *text_of(struct sonard_client *client, json_t *result)
{
    free(client->text);
    client->text =
        result ? json_dumps(result, JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(DIGITS)) : NULL;
    json_decref(result);
    return client->text;
}

/* The parameters that a text has, a new reference; NULL without a text. */
static bool read_params(const char *text, json_t **params, struct sonard_error *error)
{
    *params = text ? json_loads(text, JSON_REJECT_DUPLICATES, NULL) : NULL;
    if (!text || json_is_object(*params))
        return true;
    json_decref(*params);
    *params = NULL;
    return fail(error, SONARD_INVALID, "parameters are the text of a JSON object, not '%.80s'", text);
}

int64_t sonard_json_send(struct sonard_client *client, const char *method, json_t *params,
                         struct sonard_error *error)
{
    const int64_t id = client->last_id + 1;
    json_t *request = json_pack("{s:s, s:s, s:O*, s:I}", "jsonrpc", "2.0", "method", method, "params", params,
                                "id", (json_int_t)id);
    char *line = request ? json_dumps(request, JSON_COMPACT) : NULL;
    bool sent = false;
    if (line)
        sent = enqueue(client, line, error);
    else
        fail(error, SONARD_INVALID, "the method's name is not valid UTF-8");
    free(line);
    json_decref(request);
    if (!sent)
        return 0;
    client->last_id = id;
    return flush(client, 0, error) || error->status == SONARD_SILENT ? id : 0;
}

int64_t sonard_send(struct sonard_client *client, const char *method, const char *params,
                    struct sonard_error *error)
{
    json_t *read;
    const int64_t id = read_params(params, &read, error) ? sonard_json_send(client, method, read, error) : 0;
    json_decref(read);
    return id;
}

/* The next message that is one; notifications go into client->kept when they are not wanted now. */
static bool take_message(struct sonard_client *client, double deadline_s, bool calling, struct sonard_message *out,
                         json_t **result, struct sonard_error *error)
{
    for (;;) {
        json_t *message = read_message(client, deadline_s, error);
        json_t *id = json_object_get(message, "id"), *params = json_object_get(message, "params");
        bool taken = id != NULL;
        if (!message)
            return false;
        if (id) {
            *out = (struct sonard_message){.id = json_integer_value(id)};
            *result = hand_out(message, out);
        } else if (calling) {
            keep_notification(client, params);
        } else {
            taken = hand_out_notification(params, out, result);
        }
        json_decref(message);
        if (taken)
            return true;
    }
}

bool sonard_json_take(struct sonard_client *client, double timeout_s, struct sonard_message *out, json_t **result,
                      struct sonard_error *error)
{
    const double deadline_s = now_s() + timeout_s;
    *result = NULL;
    while (json_array_size(client->kept) > 0) {
        const bool taken = hand_out_notification(json_array_get(client->kept, 0), out, result);
        json_array_remove(client->kept, 0);
        if (taken)
            return true;
    }
    if (!flush(client, 0, error) && error->status != SONARD_SILENT)
        return false;
    return take_message(client, deadline_s, false, out, result, error);
}

bool sonard_take(struct sonard_client *client, double timeout_s, struct sonard_message *out,
                 struct sonard_error *error)
{
    json_t *result;
    if (!sonard_json_take(client, timeout_s, out, &result, error))
        return false;
    out->json = text_of(client, result);
    return true;
}

json_t *sonard_json_call(struct sonard_client *client, const char *method, json_t *params,
                         struct sonard_error *error)
{
    const double deadline_s = now_s() + client->timeout_s;
    const int64_t id = sonard_json_send(client, method, params, error);
    struct sonard_message got;
    json_t *result;
    if (!id || !flush(client, deadline_s, error))
        return NULL;
    while (take_message(client, deadline_s, true, &got, &result, error)) {
        if (result && got.id == id)
            return result;
        if (!result && (got.id == id || got.id == 0)) {
            *error = got.refusal;
            snprintf(error->message, sizeof error->message, "%.100s: %.660s", method, got.refusal.message);
            return NULL;
        }
        json_decref(result);
    }
    return NULL;
}

const char *sonard_call(struct sonard_client *client, const char *method, const char *params,
                        struct sonard_error *error)
{
    json_t *read, *result;
    if (!read_params(params, &read, error))
        return NULL;
    result = sonard_json_call(client, method, read, error);
    json_decref(read);
    return text_of(client, result);
}

int64_t sonard_watch(struct sonard_client *client, const char *method, const char *params, double rate_hz,
                     struct sonard_error *error)
{
    json_t *read, *request, *watch = NULL;
    int64_t number = 0;
    if (!read_params(params, &read, error))
        return 0;
    request = json_pack("{s:s, s:f, s:o*}", "method", method, "rate_hz", rate_hz, "params", read);
    if (request)
        watch = sonard_json_call(client, "watch", request, error);
    else
        fail(error, SONARD_INVALID, "the method's name is not valid UTF-8, or the rate is no number");
    if (watch) {
        number = integer(watch, "watch");
        if (number <= 0)
            fail(error, SONARD_LOST, "watch: the daemon on %s gave no number", client->path);
    }
    json_decref(watch);
    json_decref(request);
    return number > 0 ? number : 0;
}

bool sonard_json_next(struct sonard_client *client, double timeout_s, struct sonard_message *out, json_t **result,
                      struct sonard_error *error)
{
    const double deadline_s = now_s() + timeout_s;
    while (sonard_json_take(client, deadline_s - now_s(), out, result, error)) {
        if (out->watch > 0)
            return true;
        json_decref(*result);
    }
    return false;
}

bool sonard_next(struct sonard_client *client, double timeout_s, struct sonard_message *out,
                 struct sonard_error *error)
{
    json_t *result;
    if (!sonard_json_next(client, timeout_s, out, &result, error))
        return false;
    out->json = text_of(client, result);
    return true;
}
