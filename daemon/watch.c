/* SPDX-License-Identifier: MIT */
#include "watch.h"

#include <stdlib.h>
#include <string.h>

/* The watches themselves; what changes something cannot be watched either, it would do so at every turn. */
static const char *const not_watchable[] = {"watch", "unwatch", NULL};

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct watch *watch = ctx;
    uint64_t next_ns = watch->timer.due_ns + watch->period_ns;

    /* Ticks missed while the loop was away are not made up for. */
    if (next_ns <= now_ns)
        next_ns = now_ns + watch->period_ns;
    loop_arm(watch->set->loop, &watch->timer, next_ns);
    watch->set->due(watch->set->ctx, watch, now_ns);
}

/* The name as the table of methods has it, NULL with *error set. */
static const char *find_watchable(const struct rpc_method *methods, const char *name, struct rpc_error *error)
{
    const struct rpc_method *method = rpc_find(methods, name);
    bool watchable = method && method->right != RPC_CHANGES;

    for (int i = 0; not_watchable[i]; i++)
        watchable = watchable && strcmp(name, not_watchable[i]) != 0;
    if (watchable)
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

/* The parameters of a watch request; *watched is borrowed, NULL when absent. */
static bool parse_request(const struct watch_set *set, json_t *request, const char **method, json_t **watched,
                          double *rate_hz, struct rpc_error *error)
{
    static const char *const keys[] = {"method", "params", "rate_hz", NULL};
    const json_t *name = json_object_get(request, "method");

    *watched = json_object_get(request, "params");
    *rate_hz = 1.0;
    if (!rpc_only(request, keys, error) ||
        !rpc_number(request, "rate_hz", false, WATCH_RATE_MIN_HZ, WATCH_RATE_MAX_HZ, rate_hz, error))
        return false;
    if (!json_is_string(name))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter 'method' must be a string: what to watch");
    if (*watched && !json_is_object(*watched))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter 'params' must be an object");
    *method = find_watchable(set->methods, json_string_value(name), error);
    return *method != NULL;
}

json_t *watch_add(struct watch_set *set, json_t *params, uint64_t now_ns, struct rpc_error *error)
{
    struct watch *watch = free_watch(set);
    const char *method = NULL;
    json_t *watched;
    double rate_hz;

    if (!parse_request(set, params, &method, &watched, &rate_hz, error))
        return NULL;
    if (!watch) {
        rpc_refuse(error, RPC_LIMIT, "a client may have at most %d watches", WATCH_MAX);
        return NULL;
    }
    *watch = (struct watch){.set = set,
                            .id = ++set->last_id,
                            .method = method,
                            .params = watched ? json_incref(watched) : json_object(),
                            .period_ns = (uint64_t)(1e9 / rate_hz),
                            .timer = {.fire = on_timer, .ctx = watch}};
    loop_arm(set->loop, &watch->timer, now_ns);
    return json_pack("{s:I}", "watch", (json_int_t)watch->id);
}

static void drop_work(struct watch *watch)
{
    if (watch->work.state)
        watch->work.drop(watch->work.state);
    watch->work = (struct rpc_work){0};
}

static void end(struct watch *watch)
{
    loop_arm(watch->set->loop, &watch->timer, LOOP_NEVER);
    drop_work(watch);
    free(watch->text.bytes);
    json_decref(watch->params);
    *watch = (struct watch){0};
}

json_t *watch_remove(struct watch_set *set, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"watch", NULL};
    int64_t id = 0;

    if (!rpc_only(params, keys, error) || !rpc_integer(params, "watch", true, 1, INT64_MAX, &id, error))
        return NULL;
    for (int i = 0; i < WATCH_MAX; i++) {
        if (set->watch[i].id == id) {
            end(&set->watch[i]);
            return json_pack("{s:I}", "watch", (json_int_t)id);
        }
    }
    rpc_refuse(error, RPC_INVALID_PARAMS, "this client has no watch %lld", (long long)id);
    return NULL;
}

void watch_due_now(struct watch_set *set, const char *method, uint64_t now_ns)
{
    for (int i = 0; i < WATCH_MAX; i++)
        if (set->watch[i].id != 0 && strcmp(set->watch[i].method, method) == 0)
            loop_arm(set->loop, &set->watch[i].timer, now_ns);
}

bool watch_any(const struct watch_set *set)
{
    for (int i = 0; i < WATCH_MAX; i++)
        if (set->watch[i].id != 0)
            return true;
    return false;
}

void watch_clear(struct watch_set *set)
{
    for (int i = 0; i < WATCH_MAX; i++)
        if (set->watch[i].id != 0)
            end(&set->watch[i]);
}

void watch_postpone(struct watch *watch)
{
    if (watch->late)
        watch->skipped++;
    watch->late = true;
}

static void write_head(struct watch *watch)
{
    struct text *out = &watch->text;
    text_put(out, "{\"jsonrpc\":\"2.0\",\"method\":\"watch\",\"params\":{\"watch\":");
    text_integer(out, watch->id);
    text_name(out, "method");
    text_word(out, watch->method);
}

static void write_error(struct text *out, const struct rpc_error *error)
{
    text_name(out, "error");
    text_open(out, '{');
    text_name(out, "code");
    text_integer(out, error->code);
    text_name(out, "message");
    text_word(out, error->message);
    text_close(out, '}');
}

bool watch_write(struct watch *watch, uint64_t now_ns)
{
    const struct rpc_call call = {.daemon = watch->set->daemon, .now_ns = now_ns, .work = &watch->work};
    struct text *out = &watch->text;
    struct rpc_error error;
    if (!watch->begun) {
        write_head(watch);
        watch->head = out->n;
        text_name(out, "result");
        watch->begun = true;
    }
    const bool good = rpc_answer(watch->set->methods, &call, watch->method, watch->params, out, &error);
    if (!good && error.code == RPC_UNFINISHED)
        return true;
    drop_work(watch);
    if (!good) {
        text_cut(out, watch->head);
        write_error(out, &error);
    }
    return false;
}

char *watch_take(struct watch *watch)
{
    struct text *out = &watch->text;
    if (watch->skipped > 0) {
        text_name(out, "skipped");
        text_integer(out, (int64_t)watch->skipped);
    }
    text_bytes(out, "}}", sizeof "}}");
    if (out->failed)
        free(out->bytes);
    char *line = out->failed ? NULL : out->bytes;
    *out = (struct text){0};
    watch->begun = watch->late = false;
    watch->skipped = 0;
    return line;
}
