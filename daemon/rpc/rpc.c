/* SPDX-License-Identifier: MIT */
/*
 * rpc - see rpc.h. Replies are put together as text, not as one JSON value: an id must come back with every digit it
 * was sent with, while the numbers of a result are cut to what a sonar can mean.
 */
#include "rpc.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/word.h"

#define ID_FLAGS (JSON_COMPACT | JSON_ENCODE_ANY)

/* Where the replies to one line are collected. */
struct reply {
    struct json_out out;
    size_t whole; /* bytes of the replies so far; behind them the result of the one that is under way */
    bool batch;
    bool lost;  /* there was no memory for one of them */
    unsigned n; /* replies so far */
};

struct rpc_job {
    json_t *value;        /* a request, or a batch of them; NULL: the line is refused as a whole */
    size_t next, end;     /* requests in it: to be handled next, and behind the last */
    struct rpc_work work; /* of the next one, which is handled in parts */
    bool started;         /* it has */
    struct reply reply;
};

/* Nesting of the text's brackets outside strings: jansson recurses, so this is counted before it sees the text. */
static bool too_deep(const char *line, size_t n)
{
    int depth = 0;
    bool in_string = false;
    for (size_t i = 0; i < n; i++) {
        if (in_string) {
            if (line[i] == '\\')
                i++;
            else if (line[i] == '"')
                in_string = false;
        } else if (line[i] == '"') {
            in_string = true;
        } else if (line[i] == '[' || line[i] == '{') {
            if (++depth > RPC_DEPTH_MAX)
                return true;
        } else if (line[i] == ']' || line[i] == '}') {
            depth--;
        }
    }
    return false;
}

static void reply_begin(struct reply *reply)
{
    json_out_cut(&reply->out, reply->whole);
    if (reply->n > 0)
        json_out_put(&reply->out, ",");
    else if (reply->batch)
        json_out_put(&reply->out, "[");
    json_out_put(&reply->out, "{\"jsonrpc\":\"2.0\",");
}

static void reply_id(struct json_out *out, const json_t *id)
{
    char *text = json_is_real(id) ? json_dumps(id, ID_FLAGS) : NULL;
    json_out_put(out, ",\"id\":");
    if (text)
        json_out_put(out, text);
    else if (id)
        json_out_value(out, id);
    else
        json_out_null(out);
    free(text);
}

static void reply_end(struct reply *reply, const json_t *id)
{
    reply_id(&reply->out, id);
    json_out_put(&reply->out, "}");
    reply->lost |= reply->out.failed;
    reply->whole = reply->out.n;
    reply->n++;
}

static void put_error(struct json_out *out, const struct rpc_error *error)
{
    json_out_put(out, "\"error\":{\"code\":");
    json_out_integer(out, error->code);
    json_out_put(out, ",\"message\":");
    json_out_word(out, error->message);
    json_out_put(out, "}");
}

static void reply_error(struct reply *reply, const struct rpc_call *call, const json_t *id,
                        const struct rpc_error *error)
{
    if (call->counts)
        call->counts->errors++;
    reply_begin(reply);
    put_error(&reply->out, error);
    reply_end(reply, id);
}

const struct rpc_method *rpc_find(const struct rpc_method *methods, const char *name)
{
    for (; methods->name; methods++)
        if (strcmp(methods->name, name) == 0)
            return methods;
    return NULL;
}

bool rpc_refuse_method(const struct rpc_method *methods, const char *name, struct rpc_error *error)
{
    size_t best = WORD_FAR;
    const char *meant = NULL;
    for (; methods->name; methods++)
        if (word_is_nearest(name, methods->name, &best))
            meant = methods->name;
    return rpc_refuse(error, RPC_METHOD_NOT_FOUND,
                      meant ? "no method '%.64s'; did you mean %s?" : "no method '%.64s'; see sonard-protocol(7)",
                      name, meant);
}

bool rpc_continue(const struct rpc_call *call, rpc_part_fn *part)
{
    call->work->part = part;
    return false;
}

bool rpc_postpone(const struct rpc_call *call, struct rpc_waiters *waiters)
{
    rpc_work_wait(call->work, waiters);
    call->work->postponed = true;
    return false;
}

/* What takes its parameters as they come may tell by more than these. */
static bool is_shared(const struct rpc_call *call, const struct rpc_method *m)
{
    return call->shared && m->right == RPC_ASKS && m->row;
}

static bool call_method(const struct rpc_call *call, const struct rpc_method *m, json_t *named,
                        struct json_out *out, struct rpc_error *error)
{
    call->work->changes = m->right == RPC_CHANGES;
    if (m->row && !params_take(m->row->params, named, error))
        return false;
    const enum shared_outcome outcome =
        is_shared(call, m) ? shared_ask(call->shared, call->work, m, named, out) : SHARED_MAKE;
    return outcome == SHARED_TAKEN || (outcome == SHARED_MAKE && m->fn(call, named, out, error));
}

/* The first part of a method. */
static bool begin_method(const struct rpc_method *methods, const struct rpc_call *call, const char *method,
                         json_t *params, struct json_out *out, struct rpc_error *error)
{
    const struct rpc_method *m = rpc_find(methods, method);
    if (!m)
        return rpc_refuse_method(methods, method, error);
    if (m->right == RPC_CHANGES && call->refusal)
        return rpc_refuse(error, RPC_FORBIDDEN, "'%s': %s", m->name, call->refusal);
    json_t *named = params ? json_incref(params) : json_object();
    const bool good = call_method(call, m, named, out, error);

    json_decref(named);
    return good;
}

enum rpc_outcome rpc_answer(const struct rpc_method *methods, const struct rpc_call *call, const char *method,
                            json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct rpc_work *work = call->work;
    rpc_part_fn *part = work->part;
    *error = (struct rpc_error){0};
    if (!part && !work->postponed)
        work->before = out->n;
    rpc_work_go_on(work);
    work->part = NULL;
    work->postponed = false;

    bool good = part ? part(call, out, error) : begin_method(methods, call, method, params, out, error);

    if (work->changes && call->shared)
        shared_changed(call->shared);
    if (!good && (work->part || work->postponed))
        return RPC_MORE;
    if (!good && error->code == 0)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "method '%.64s' gave no result", method);
    if (good && out->failed)
        good = rpc_refuse(error, RPC_INTERNAL_ERROR, "the result cannot be written as JSON");
    if (good)
        shared_made(work, out->bytes + work->before, out->n - work->before);
    else
        json_out_cut(out, work->before);
    return good ? RPC_ANSWERED : RPC_FAILED;
}

static bool id_allowed(const json_t *id)
{
    return json_is_string(id) || json_is_number(id) || json_is_null(id);
}

/* The form of a request, without asking whether the method exists. */
static bool check_request(json_t *request, struct rpc_error *error)
{
    static const char *const members[] = {"jsonrpc", "method", "params", "id", NULL};
    const json_t *version, *method, *id, *params;
    if (!json_is_object(request))
        return rpc_refuse(error, RPC_INVALID_REQUEST, "a request is an object, found %s", params_kind(request));
    if (!params_refuse_other(request, members, error)) {
        error->code = RPC_INVALID_REQUEST;
        return false;
    }
    version = json_object_get(request, "jsonrpc");
    if (!json_is_string(version) || strcmp(json_string_value(version), "2.0") != 0)
        return rpc_refuse(error, RPC_INVALID_REQUEST, "'jsonrpc' must be the string '2.0'");
    method = json_object_get(request, "method");
    if (!json_is_string(method))
        return rpc_refuse(error, RPC_INVALID_REQUEST, "'method' must be a string, %s",
                          method ? params_kind(method) : "it is missing");
    id = json_object_get(request, "id");
    if (id && !id_allowed(id))
        return rpc_refuse(error, RPC_INVALID_REQUEST, "'id' must be a string, a number or null, found %s",
                          params_kind(id));
    params = json_object_get(request, "params");
    if (params && !json_is_object(params) && !json_is_array(params))
        return rpc_refuse(error, RPC_INVALID_REQUEST, "'params' must be an object, found %s", params_kind(params));
    return true;
}

/* False: there is more of it. */
static bool handle_request(struct rpc_job *job, const struct rpc_method *methods, const struct rpc_call *call,
                           json_t *request)
{
    struct reply *reply = &job->reply;
    struct rpc_error error = {0};
    const json_t *id = json_object_get(request, "id");
    enum rpc_outcome outcome = RPC_FAILED;
    json_t *params;
    if (!check_request(request, &error)) {
        reply_error(reply, call, id && id_allowed(id) ? id : NULL, &error);
        return true;
    }
    if (!job->started) {
        reply_begin(reply);
        json_out_put(&reply->out, "\"result\":");
    }
    params = json_object_get(request, "params");
    if (json_is_array(params))
        rpc_refuse(&error, RPC_INVALID_PARAMS,
                   "parameters go by name: 'params' must be an object, found an array");
    else
        outcome = rpc_answer(methods, call, json_string_value(json_object_get(request, "method")), params,
                             &reply->out, &error);
    if (outcome == RPC_MORE)
        return false;
    bool good = outcome == RPC_ANSWERED;
    if (good && id && reply->out.n > RPC_REPLY_MAX)
        good = rpc_refuse(&error, RPC_LIMIT, "with this result the reply would be longer than %d bytes",
                          RPC_REPLY_MAX);
    if (id && good)
        reply_end(reply, id);
    else if (id)
        reply_error(reply, call, id, &error);
    else
        json_out_cut(&reply->out, reply->whole);
    return true;
}

/* What is in the line; false with *error set when it is refused as a whole. */
static bool parse_line(struct rpc_job *job, const char *line, size_t n, struct rpc_error *error)
{
    json_error_t where;
    if (n > RPC_LINE_MAX)
        return rpc_refuse(error, RPC_LIMIT, "the line is longer than %d bytes", RPC_LINE_MAX);
    if (too_deep(line, n))
        return rpc_refuse(error, RPC_LIMIT, "arrays and objects nested deeper than %d", RPC_DEPTH_MAX);
    job->value = json_loadb(line, n, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &where);
    if (!job->value)
        return rpc_refuse(error, RPC_PARSE_ERROR, "not JSON at byte %d: %s", where.position, where.text);
    if (!json_is_array(job->value)) {
        job->end = 1;
        return true;
    }

    const size_t size = json_array_size(job->value);

    if (size == 0)
        return rpc_refuse(error, RPC_INVALID_REQUEST, "a batch must hold at least one request");
    if (size > RPC_BATCH_MAX)
        return rpc_refuse(error, RPC_LIMIT, "%zu requests in a batch, at most %d are allowed", size,
                          RPC_BATCH_MAX);
    job->end = size;
    job->reply.batch = true;
    return true;
}

struct rpc_job *rpc_begin(const struct rpc_call *call, const char *line, size_t n)
{
    struct rpc_job *job = calloc(1, sizeof *job);
    struct rpc_error error;
    if (!job)
        return NULL;
    if (!parse_line(job, line, n, &error))
        reply_error(&job->reply, call, NULL, &error);
    return job;
}

bool rpc_step(struct rpc_job *job, const struct rpc_method *methods, const struct rpc_call *call)
{
    if (job->next < job->end) {
        json_t *request = job->reply.batch ? json_array_get(job->value, job->next) : job->value;
        struct rpc_call part = *call;
        part.work = &job->work;
        job->work.resume = call->resume;
        job->work.ctx = call->client;
        if (call->counts && !job->started)
            call->counts->requests++;
        job->started = !handle_request(job, methods, &part, request);
        if (!job->started) {
            rpc_work_end(&job->work);
            job->next++;
        }
    }
    return job->next < job->end;
}

void rpc_let_go(struct rpc_job *job)
{
    rpc_work_let_go(&job->work);
}

bool rpc_waits(const struct rpc_job *job)
{
    return job->work.waits;
}

bool rpc_end(struct rpc_job *job, char **reply)
{
    struct json_out *out = &job->reply.out;
    rpc_work_end(&job->work);
    json_out_cut(out, job->reply.whole);
    if (job->reply.n > 0) {
        json_out_put(out, job->reply.batch ? "]" : "");
        json_out_bytes(out, "", 1);
    }
    const bool good = !out->failed && !job->reply.lost;

    *reply = NULL;
    if (good && job->reply.n > 0)
        *reply = out->bytes;
    else
        free(out->bytes);
    json_decref(job->value);
    free(job);
    return good;
}

char *rpc_refusal(const char *message)
{
    struct rpc_error error;
    struct json_out out = {0};
    rpc_refuse(&error, RPC_LIMIT, "%s", message);
    json_out_put(&out, "{\"jsonrpc\":\"2.0\",");
    put_error(&out, &error);
    json_out_bytes(&out, ",\"id\":null}", sizeof ",\"id\":null}");
    if (!out.failed)
        return out.bytes;
    free(out.bytes);
    return NULL;
}
