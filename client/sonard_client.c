/* SPDX-License-Identifier: MIT */
#include "sonard_client.h"

#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define IN_START_BYTES 8192
#define IN_MAX_BYTES   (8u << 20)
#define OUT_MAX_BYTES  65536
#define KEPT_MAX       64
#define RETRY_MS       20 /* between attempts while the daemon's queue of new clients is full */

struct sonard_client {
    int fd;
    double timeout_s;
    char path[sizeof((struct sockaddr_un *)0)->sun_path];
    json_int_t last_id;
    char *in;
    size_t in_len, in_size;
    char *out; /* requests not yet written */
    size_t out_len;
    json_t *kept; /* notifications that came during calls, oldest first */
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

static bool fail_connect(struct sonard_error *error, const char *path, int failure)
{
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
    int failure;

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
                fail(error, SONARD_LOST, "what answers on %s does not speak JSON-RPC", client->path);
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

static void keep(struct sonard_client *client, json_t *message)
{
    if (json_array_size(client->kept) >= KEPT_MAX)
        json_array_remove(client->kept, 0);
    json_array_append(client->kept, json_object_get(message, "params"));
}

/* What came, as its reader wants it; the message is used up. False: it is neither a reply nor a notification. */
static bool sort_out(json_t *message, struct sonard_message *out)
{
    const json_t *id = json_object_get(message, "id"), *refusal = json_object_get(message, "error");
    json_t *result = json_object_get(message, "result");
    const char *why = json_string_value(json_object_get(refusal, "message"));

    *out = (struct sonard_message){.id = json_integer_value(id)};
    if (id) {
        out->content = json_incref(result);
        if (!result) {
            fail(&out->refusal, SONARD_REFUSED, "%s", why ? why : "an error without a message");
            out->refusal.rpc_code = (int)json_integer_value(json_object_get(refusal, "code"));
        }
    } else if (json_is_string(json_object_get(message, "method"))) {
        out->content = json_incref(json_object_get(message, "params"));
    }
    json_decref(message);
    return id || out->content;
}

json_int_t sonard_send(struct sonard_client *client, const char *method, json_t *params,
                       struct sonard_error *error)
{
    const json_int_t id = client->last_id + 1;
    json_t *request =
        params ? json_pack("{s:s, s:s, s:O, s:I}", "jsonrpc", "2.0", "method", method, "params", params, "id", id)
               : json_pack("{s:s, s:s, s:I}", "jsonrpc", "2.0", "method", method, "id", id);
    char *line = request ? json_dumps(request, JSON_COMPACT) : NULL;
    bool sent = false;

    json_decref(request);
    if (!line)
        fail(error, SONARD_LOST, "the request cannot be written as JSON: is '%s' valid UTF-8?", method);
    else
        sent = enqueue(client, line, error);
    free(line);
    if (!sent)
        return 0;
    client->last_id = id;
    return flush(client, 0, error) || error->status == SONARD_SILENT ? id : 0;
}

bool sonard_take(struct sonard_client *client, double timeout_s, struct sonard_message *out,
                 struct sonard_error *error)
{
    const double deadline_s = now_s() + timeout_s;

    if (json_array_size(client->kept) > 0) {
        *out = (struct sonard_message){.content = json_incref(json_array_get(client->kept, 0))};
        json_array_remove(client->kept, 0);
        return true;
    }
    if (!flush(client, 0, error) && error->status != SONARD_SILENT)
        return false;
    for (;;) {
        json_t *message = read_message(client, deadline_s, error);

        if (!message)
            return false;
        if (sort_out(message, out))
            return true;
    }
}

json_t *sonard_call(struct sonard_client *client, const char *method, json_t *params, struct sonard_error *error)
{
    const double deadline_s = now_s() + client->timeout_s;
    const json_int_t id = sonard_send(client, method, params, error);

    if (!id || !flush(client, deadline_s, error))
        return NULL;
    for (;;) {
        json_t *message = read_message(client, deadline_s, error);
        struct sonard_message got;

        if (!message)
            return NULL;
        if (!json_object_get(message, "id"))
            keep(client, message);
        if (!sort_out(message, &got))
            continue;
        if (got.content && got.id == id)
            return got.content;
        if (got.refusal.status == SONARD_REFUSED && (got.id == id || got.id == 0)) {
            *error = got.refusal;
            snprintf(error->message, sizeof error->message, "%s: %.400s", method, got.refusal.message);
            return NULL;
        }
        json_decref(got.content);
    }
}

json_t *sonard_next(struct sonard_client *client, double timeout_s, struct sonard_error *error)
{
    const double deadline_s = now_s() + timeout_s;
    struct sonard_message got;

    while (sonard_take(client, deadline_s - now_s(), &got, error)) {
        if (got.id == 0 && got.content)
            return got.content;
        json_decref(got.content);
    }
    return NULL;
}
