/* SPDX-License-Identifier: MIT */
#include "watch.h"

#include <stdlib.h>
#include <string.h>

/* The timer is not armed again before the notification is taken: a client that reads nothing costs nothing. */
static void on_timer(void *ctx, uint64_t now_ns)
{
    struct watch *watch = ctx;
    const uint64_t due_ns = watch->timer.due_ns;
    /* Periods missed while the loop was away are not made up for. */
    watch->due_ns = due_ns + watch->period_ns <= now_ns ? now_ns : due_ns;
    watch->late = true;
    watch->set->due(watch->set->ctx, now_ns);
}

/* The name as the table of methods has it, NULL with *error set: not the watches themselves, nor what changes
 * something, for it would do so at every turn. */
static const char *find_watchable(const struct rpc_method *methods, const char *name, struct rpc_error *error)
{
    const struct rpc_method *method = rpc_find(methods, name);
    if (method && method->right == RPC_ASKS)
        return method->name;
    if (method)
        rpc_refuse(error, RPC_INVALID_PARAMS, "method '%s' cannot be watched", method->name);
    else
        rpc_refuse_method(methods, name, error);
    return NULL;
}

static struct watch *free_watch(struct watch_set *set)
{
    for (int i = 0; i < WATCH_MAX; i++)
        if (set->watch[i].id == 0)
            return &set->watch[i];
    return NULL;
}

static double client_rate_hz(const struct watch_set *set)
{
    double rate_hz = 0.0;
    for (int i = 0; i < WATCH_MAX; i++)
        rate_hz += set->watch[i].id != 0 ? set->watch[i].rate_hz : 0.0;
    return rate_hz;
}

double watch_share_of(double rate_hz)
{
    return rate_hz / WATCH_ALL_HZ + 1.0 / WATCH_ALL_MAX;
}

double watch_share(const struct watch_set *set)
{
    double share = 0.0;
    for (int i = 0; i < WATCH_MAX; i++)
        share += set->watch[i].id != 0 ? watch_share_of(set->watch[i].rate_hz) : 0.0;
    return share;
}

static bool is_full(const struct watch_set *set, double rate_hz)
{
    const int n = WATCH_ALL_MAX + (set->kept ? WATCH_MAX : 0);
    const double all_hz = WATCH_ALL_HZ + (set->kept ? WATCH_CLIENT_HZ : 0.0);
    return set->all->n >= n || set->all->rate_hz + rate_hz > all_hz;
}

/* One more of this rate. */
static bool check_bounds(const struct watch_set *set, double rate_hz, struct rpc_error *error)
{
    if (client_rate_hz(set) + rate_hz > WATCH_CLIENT_HZ)
        return rpc_refuse(error, RPC_LIMIT, "the watches of a client may together have at most %g Hz",
                          WATCH_CLIENT_HZ);
    while (is_full(set, rate_hz))
        if (!set->make_room || !set->make_room(set->ctx, watch_share_of(rate_hz)))
            return rpc_refuse(
                error, RPC_LIMIT,
                "all clients together may have at most %d watches and %g Hz; use fewer, or a lower rate",
                WATCH_ALL_MAX, WATCH_ALL_HZ);
    return true;
}

static void count(struct watch_sum *all, int n, double rate_hz)
{
    all->n += n;
    all->rate_hz = all->n > 0 ? all->rate_hz + rate_hz : 0.0; /* no rounding is left over */
}

static bool write_id(struct json_out *out, int64_t id)
{
    json_out_put(out, "{\"watch\":");
    json_out_integer(out, id);
    json_out_put(out, "}");
    return true;
}

bool watch_add(struct watch_set *set, json_t *params, uint64_t now_ns, struct json_out *out,
               struct rpc_error *error)
{
    struct watch *watch = free_watch(set);
    const char *method = find_watchable(set->methods, params_text(params, "method"), error);
    json_t *watched = json_object_get(params, "params");
    const double rate_hz = params_number(params, "rate_hz");
    if (!method)
        return false;
    if (!watch) {
        rpc_refuse(error, RPC_LIMIT, "a client may have at most %d watches", WATCH_MAX);
        return false;
    }
    if (!check_bounds(set, rate_hz, error))
        return false;
    *watch = (struct watch){.set = set,
                            .id = ++set->last_id,
                            .method = method,
                            .params = watched ? json_incref(watched) : json_object(),
                            .rate_hz = rate_hz,
                            .period_ns = (uint64_t)(1e9 / rate_hz),
                            .timer = {.fire = on_timer, .ctx = watch}};
    count(set->all, 1, rate_hz);
    loop_arm(set->loop, &watch->timer, now_ns);
    return write_id(out, watch->id);
}

static void end(struct watch *watch)
{
    loop_arm(watch->set->loop, &watch->timer, LOOP_NEVER);
    count(watch->set->all, -1, -watch->rate_hz);
    rpc_work_end(&watch->work);
    free(watch->text.bytes);
    json_decref(watch->params);
    *watch = (struct watch){0};
}

bool watch_remove(struct watch_set *set, json_t *params, struct json_out *out, struct rpc_error *error)
{
    const int64_t id = params_integer(params, "watch");
    for (int i = 0; i < WATCH_MAX; i++) {
        if (set->watch[i].id == id) {
            end(&set->watch[i]);
            return write_id(out, id);
        }
    }
    rpc_refuse(error, RPC_INVALID_PARAMS, "this client has no watch %lld", (long long)id);
    return false;
}

void watch_due_now(struct watch_set *set, const char *method, uint64_t now_ns)
{
    for (int i = 0; i < WATCH_MAX; i++)
        if (set->watch[i].id != 0 && !set->watch[i].late && strcmp(set->watch[i].method, method) == 0)
            loop_arm(set->loop, &set->watch[i].timer, now_ns);
}

bool watch_any(const struct watch_set *set)
{
    for (int i = 0; i < WATCH_MAX; i++)
        if (set->watch[i].id != 0)
            return true;
    return false;
}

void watch_let_go(struct watch_set *set)
{
    for (int i = 0; i < WATCH_MAX; i++)
        rpc_work_let_go(&set->watch[i].work);
}

void watch_clear(struct watch_set *set)
{
    for (int i = 0; i < WATCH_MAX; i++)
        if (set->watch[i].id != 0)
            end(&set->watch[i]);
}

uint64_t watch_skipped(const struct watch *watch, uint64_t now_ns)
{
    return watch->late ? (now_ns - watch->due_ns) / watch->period_ns : 0;
}

static void write_head(struct watch *watch)
{
    struct json_out *out = &watch->text;
    json_out_put(out, "{\"jsonrpc\":\"2.0\",\"method\":\"watch\",\"params\":{\"watch\":");
    json_out_integer(out, watch->id);
    json_out_name(out, "method");
    json_out_word(out, watch->method);
}

static void write_error(struct json_out *out, const struct rpc_error *error)
{
    json_out_name(out, "error");
    json_out_open(out, '{');
    json_out_name(out, "code");
    json_out_integer(out, error->code);
    json_out_name(out, "message");
    json_out_word(out, error->message);
    json_out_close(out, '}');
}

bool watch_write(struct watch *watch, uint64_t now_ns)
{
    const struct rpc_call call = {
        .daemon = watch->set->daemon, .now_ns = now_ns, .work = &watch->work, .shared = watch->set->shared};
    struct json_out *out = &watch->text;
    struct rpc_error error;
    watch->work.resume = watch->set->resume;
    watch->work.ctx = watch->set->ctx;
    if (!watch->started) {
        write_head(watch);
        watch->head = out->n;
        json_out_name(out, "result");
        watch->started = true;
    }
    const enum rpc_outcome outcome =
        rpc_answer(watch->set->methods, &call, watch->method, watch->params, out, &error);
    if (outcome == RPC_MORE)
        return true;
    rpc_work_end(&watch->work);
    if (outcome == RPC_FAILED) {
        json_out_cut(out, watch->head);
        write_error(out, &error);
    }
    return false;
}

char *watch_take(struct watch *watch, uint64_t now_ns)
{
    struct json_out *out = &watch->text;
    const uint64_t skipped = watch_skipped(watch, now_ns);
    if (skipped > 0) {
        json_out_name(out, "skipped");
        json_out_integer(out, (int64_t)skipped);
    }
    json_out_bytes(out, "}}", sizeof "}}");
    if (out->failed)
        free(out->bytes);
    char *line = out->failed ? NULL : out->bytes;
    *out = (struct json_out){0};
    watch->started = watch->late = false;
    loop_arm(watch->set->loop, &watch->timer, watch->due_ns + (skipped + 1) * watch->period_ns);
    return line;
}
