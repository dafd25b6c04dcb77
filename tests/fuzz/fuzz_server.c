/* SPDX-License-Identifier: MIT */
/*
 * fuzz_server - the whole server with four clients whose lines come in any pieces, at any time, in any order, read or
 * not: what comes back is whole lines of JSON, and the server serves the next client afterwards.
 *
 * The input is a list of steps: one byte says whose turn it is (low two bits) and what happens (the next three), one
 * byte says how much, then for a send so many bytes of what is sent.
 */
#include <errno.h>
#include <jansson.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "core/fault.h"
#include "core/loop.h"
#include "daemon/rpc/server.h"
#include "tests/lib/json_take.h"

#define CLIENTS    4
#define TAIL_BYTES (1 << 20)
#define STEPS_MAX  400
#define STEP_NS    3000000u
#define SETTLE     64 /* turns of the loop until all is answered that will be */

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

struct client {
    int fd; /* -1: not there */
    char *tail;
    size_t n;
};

static char path[64];

static bool echo(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call;
    (void)error;
    return json_out_take(out, json_incref(params));
}

static bool change(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params;
    (void)out;
    rpc_refuse(error, RPC_INVALID_REQUEST, "not at %llu", (unsigned long long)call->now_ns);
    return false;
}

static bool large(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    static char text[60001];
    (void)call;
    (void)params;
    (void)error;
    memset(text, 'x', sizeof text - 1);
    return json_out_take(out, json_pack("{s:s}", "text", text));
}

static const struct rpc_method methods[] = {
    {"e", echo, RPC_ASKS, NULL}, {"c", change, RPC_CHANGES, NULL}, {"l", large, RPC_ASKS, NULL}, {.name = NULL}};

static void come(struct client *c)
{
    struct sockaddr_un to = {.sun_family = AF_UNIX};
    snprintf(to.sun_path, sizeof to.sun_path, "%s", path);
    c->n = 0;
    c->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (connect(c->fd, (const struct sockaddr *)&to, sizeof to) != 0)
        abort();
}

static void go(struct client *c)
{
    if (c->fd >= 0)
        close(c->fd);
    c->fd = -1;
}

/* Every whole line is JSON; the rest waits for more. */
static void judge(struct client *c)
{
    char *line = c->tail, *end;
    while ((end = memchr(line, '\n', c->n - (size_t)(line - c->tail)))) {
        json_t *value = json_loadb(line, (size_t)(end - line), 0, NULL);
        if (!value)
            abort();
        json_decref(value);
        line = end + 1;
    }
    c->n -= (size_t)(line - c->tail);
    memmove(c->tail, line, c->n);
}

static void take(struct client *c, size_t most)
{
    while (c->fd >= 0 && most > 0) {
        const size_t room = TAIL_BYTES - c->n;
        const ssize_t n = recv(c->fd, c->tail + c->n, room < most ? room : most, 0);
        if (n < 0 && errno == EAGAIN)
            return;
        if (n <= 0) {
            go(c);
            return;
        }
        c->n += (size_t)n;
        most -= (size_t)n;
        judge(c);
        if (c->n == TAIL_BYTES)
            abort(); /* a line without end */
    }
}

static void turns(struct loop *loop, int n)
{
    for (int i = 0; i < n; i++) {
        loop_advance(loop, loop_now(loop) + STEP_NS);
        loop_turn(loop, 0);
    }
}

static void play(struct loop *loop, struct client client[CLIENTS], const uint8_t *data, size_t size)
{
    for (int step = 0; size >= 2 && step < STEPS_MAX; step++) {
        struct client *c = &client[data[0] & 3];
        const unsigned what = data[0] >> 2 & 7;
        const size_t much = data[1];
        data += 2;
        size -= 2;
        if (c->fd < 0)
            come(c);
        if (what < 3) {
            const size_t n = much < size ? much : size;
            (void)!send(c->fd, data, n, MSG_NOSIGNAL);
            data += n;
            size -= n;
        } else if (what == 3) {
            for (size_t i = 0; i < much; i++)
                (void)!send(c->fd, data, size < 200 ? size : 200, MSG_NOSIGNAL);
        } else if (what == 4) {
            take(c, much * 300);
        } else if (what == 5) {
            shutdown(c->fd, SHUT_WR);
        } else if (what == 6) {
            go(c);
        }
        turns(loop, what == 7 ? (int)much : 1);
    }
}

/* A client that behaves is served, whatever was before. */
static void still_serves(struct loop *loop, struct client *c)
{
    static const char line[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"e\",\"params\":{}}\n";
    static const char wanted[] = "{\"jsonrpc\":\"2.0\",\"result\":{},\"id\":1}\n";
    char answer[200];
    come(c);
    turns(loop, 2);
    if (send(c->fd, line, sizeof line - 1, MSG_NOSIGNAL) != (ssize_t)sizeof line - 1)
        abort();
    turns(loop, 4);
    const ssize_t n = recv(c->fd, answer, sizeof answer, 0);
    if (n != (ssize_t)sizeof wanted - 1 || memcmp(answer, wanted, (size_t)n) != 0)
        abort();
    go(c);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char tails[CLIENTS][TAIL_BYTES];
    struct client client[CLIENTS];
    struct fault fault;
    snprintf(path, sizeof path, "/tmp/fuzz_server.%d", (int)getpid());
    const struct server_conf conf = {
        .path = path, .mode = 0600, .max_clients = CLIENTS, .client_timeout_ns = 10000000000u};
    struct loop *loop = loop_new(true);
    struct server *server = loop ? server_start(loop, &conf, methods, NULL, &fault) : NULL;
    if (!server)
        abort();
    for (int i = 0; i < CLIENTS; i++)
        client[i] = (struct client){.fd = -1, .tail = tails[i]};
    play(loop, client, data, size);
    for (int i = 0; i < CLIENTS; i++) {
        take(&client[i], SIZE_MAX);
        go(&client[i]);
    }
    turns(loop, SETTLE);
    still_serves(loop, &client[0]);
    server_stop(server);
    loop_free(loop);
    return 0;
}
