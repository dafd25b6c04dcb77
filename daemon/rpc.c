/* SPDX-License-Identifier: MIT */
/*
 * rpc - see rpc.h. Replies are put together as text, not as one JSON value: an id must come back with every digit it
 * was sent with, while the numbers of a result are cut to what a sonar can mean.
 */
#include "rpc.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../config/word.h"

#define ID_FLAGS (JSON_COMPACT | JSON_ENCODE_ANY)

/* Where the replies to one line are collected. */
struct reply {
    struct text out;
    size_t whole; /* bytes of the replies so far; behind them the result of the one that is under way */
    bool batch;
    bool lost;  /* there was no memory for one of them */
    unsigned n; /* replies so far */
};

struct rpc_job {
    json_t *value;        /* a request, or a batch of them; NULL: the line is refused as a whole */
    size_t next, end;     /* requests in it: to be handled next, and behind the last */
    struct rpc_work work; /* of the next one, which is handled in parts */
    bool unfinished;      /* it has begun */
    struct reply reply;
};

static const char *kind_name(const json_t *value)
{
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        return "an object";
    case JSON_ARRAY:
        return "an array";
    case JSON_STRING:
        return "a string";
    case JSON_INTEGER:
    case JSON_REAL:
        return "a number";
    case JSON_TRUE:
    case JSON_FALSE:
        return "true or false";
    default:
        return "null";
    }
}

/* A message may quote what a client sent, cut anywhere: leave only what JSON and terminals take as it is. */
static void make_harmless(struct rpc_error *error)
{
    for (char *c = error->message; *c; c++) {
        if (*c == '"' || *c == '\\')
            *c = '\'';
        else if (*c < 0x20 || *c > 0x7e)
            *c = '?';
    }
}

bool rpc_refuse(struct rpc_error *error, int code, const char *fmt, ...)
{
    va_list args;

    error->code = code;
    va_start(args, fmt);
    vsnprintf(error->message, sizeof error->message, fmt, args);
    va_end(args);
    make_harmless(error);
    return false;
}

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
    text_cut(&reply->out, reply->whole);
    if (reply->n > 0)
        text_put(&reply->out, ",");
    else if (reply->batch)
        text_put(&reply->out, "[");
    text_put(&reply->out, "{\"jsonrpc\":\"2.0\",");
}

static void reply_id(struct text *out, const json_t *id)
{
    char *text = id && json_is_real(id) ? json_dumps(id, ID_FLAGS) : NULL;

    text_put(out, ",\"id\":");
    if (text)
        text_put(out, text);
    else if (id)
        text_json(out, id);
    else
        text_null(out);
    free(text);
}

static void reply_end(struct reply *reply, const json_t *id)
{
    reply_id(&reply->out, id);
    text_put(&reply->out, "}");
    reply->lost |= reply->out.failed;
    reply->whole = reply->out.n;
    reply->n++;
}

static void put_error(struct text *out, const struct rpc_error *error)
{
    text_put(out, "\"error\":{\"code\":");
    text_integer(out, error->code);
    text_put(out, ",\"message\":");
    text_word(out, error->message);
    text_put(out, "}");
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
                      meant ? "no method '%.64s'; did you mean %s?" : "no method '%.64s'; sonard-protocol(7) has them all",
                      name, meant);
}

static bool write_result(const struct rpc_method *m, const struct rpc_call *call, json_t *params, struct text *out,
                         struct rpc_error *error)
{
    if (m->write)
        return m->write(call, params, out, error);

    json_t *result = m->fn(call, params, error);

    if (result)
        text_json(out, result);
    json_decref(result);
    return result != NULL;
}

bool rpc_answer(const struct rpc_method *methods, const struct rpc_call *call, const char *method, json_t *params,
                struct text *out, struct rpc_error *error)
{
    const struct rpc_method *m = rpc_find(methods, method);
    const size_t before = out->n;

    error->code = 0;
    error->message[0] = '\0';
    if (!m)
        return rpc_refuse_method(methods, method, error);
    if (m->right == RPC_CHANGES && call->refusal && !call->work->state) /* what has begun may be done already */
        return rpc_refuse(error, RPC_FORBIDDEN, "'%s': %s", m->name, call->refusal);

    json_t *named = params ? json_incref(params) : json_object();
    bool good = write_result(m, call, named, out, error);

    json_decref(named);
    if (!good && error->code == 0)
        rpc_refuse(error, RPC_INTERNAL_ERROR, "method '%.64s' gave no result", method);
    if (good && out->failed)
        good = rpc_refuse(error, RPC_INTERNAL_ERROR, "the result cannot be written as JSON");
    if (!good && error->code != RPC_UNFINISHED)
        text_cut(out, before);
    make_harmless(error);
    return good;
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
        return rpc_refuse(error, RPC_INVALID_REQUEST, "a request is an object, found %s", kind_name(request));
    if (!rpc_only(request, members, error)) {
        error->code = RPC_INVALID_REQUEST;
        return false;
    }
    version = json_object_get(request, "jsonrpc");
    if (!json_is_string(version) || strcmp(json_string_value(version), "2.0") != 0)
        return rpc_refuse(error, RPC_INVALID_REQUEST, "'jsonrpc' must be the string '2.0'");
    method = json_object_get(request, "method");
    if (!json_is_string(method))
        return rpc_refuse(error, RPC_INVALID_REQUEST, "'method' must be a string, %s",
                          method ? kind_name(method) : "it is missing");
    id = json_object_get(request, "id");
    if (id && !id_allowed(id))
        return rpc_refuse(error, RPC_INVALID_REQUEST, "'id' must be a string, a number or null, found %s",
                          kind_name(id));
    params = json_object_get(request, "params");
    if (params && !json_is_object(params) && !json_is_array(params))
        return rpc_refuse(error, RPC_INVALID_REQUEST, "'params' must be an object, found %s", kind_name(params));
    return true;
}

/* False: it is to be handled once more. */
static bool handle_request(struct rpc_job *job, const struct rpc_method *methods, const struct rpc_call *call,
                           json_t *request)
{
    struct reply *reply = &job->reply;
    struct rpc_error error = {0};
    const json_t *id = json_object_get(request, "id");
    json_t *params;
    bool good = false;

    if (!check_request(request, &error)) {
        reply_error(reply, call, id && id_allowed(id) ? id : NULL, &error);
        return true;
    }
    if (!job->unfinished) {
        reply_begin(reply);
        text_put(&reply->out, "\"result\":");
    }
    params = json_object_get(request, "params");
    if (json_is_array(params))
        rpc_refuse(&error, RPC_INVALID_PARAMS,
                   "parameters go by name: 'params' must be an object, found an array");
    else
        good = rpc_answer(methods, call, json_string_value(json_object_get(request, "method")), params,
                          &reply->out, &error);
    if (error.code == RPC_UNFINISHED)
        return false;
    if (good && id && reply->out.n > RPC_REPLY_MAX)
        good = rpc_refuse(&error, RPC_LIMIT, "with this result the reply would be longer than %d bytes",
                          RPC_REPLY_MAX);
    if (id && good)
        reply_end(reply, id);
    else if (id)
        reply_error(reply, call, id, &error);
    else
        text_cut(&reply->out, reply->whole);
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

static void drop_work(struct rpc_job *job)
{
    if (job->work.state)
        job->work.drop(job->work.state);
    job->work = (struct rpc_work){0};
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
        if (call->counts && !job->unfinished)
            call->counts->requests++;
        job->unfinished = !handle_request(job, methods, &part, request);
        if (!job->unfinished) {
            drop_work(job);
            job->next++;
        }
    }
    return job->next < job->end;
}

bool rpc_waits(const struct rpc_job *job)
{
    return job->work.waits;
}

void rpc_go_on(struct rpc_job *job)
{
    job->work.waits = false;
}

bool rpc_end(struct rpc_job *job, char **reply)
{
    struct text *out = &job->reply.out;

    drop_work(job);
    text_cut(out, job->reply.whole);
    if (job->reply.n > 0) {
        text_put(out, job->reply.batch ? "]" : "");
        text_bytes(out, "", 1);
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
    struct text out = {0};

    rpc_refuse(&error, RPC_LIMIT, "%s", message);
    text_put(&out, "{\"jsonrpc\":\"2.0\",");
    put_error(&out, &error);
    text_bytes(&out, ",\"id\":null}", sizeof ",\"id\":null}");
    if (!out.failed)
        return out.bytes;
    free(out.bytes);
    return NULL;
}

/* Sets *value to the parameter, NULL when it is absent and need not be there. */
static bool get_param(json_t *params, const char *key, bool required, json_t **value, struct rpc_error *error)
{
    *value = json_object_get(params, key);
    if (!*value && required)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is missing", key);
    return true;
}

bool rpc_number(json_t *params, const char *key, bool required, double lo, double hi, double *out,
                struct rpc_error *error)
{
    json_t *value;

    if (!get_param(params, key, required, &value, error))
        return false;
    if (!value)
        return true;
    if (!json_is_number(value))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %s, want a number from %g to %g", key,
                          kind_name(value), lo, hi);

    const double number = json_number_value(value);

    if (!(number >= lo && number <= hi))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %g, want a number from %g to %g", key,
                          number, lo, hi);
    *out = number;
    return true;
}

bool rpc_integer(json_t *params, const char *key, bool required, int64_t lo, int64_t hi, int64_t *out,
                 struct rpc_error *error)
{
    json_t *value;

    if (!get_param(params, key, required, &value, error))
        return false;
    if (!value)
        return true;
    if (!json_is_integer(value))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %s, want a whole number from %lld to %lld",
                          key, json_is_real(value) ? "not whole" : kind_name(value), (long long)lo, (long long)hi);

    const int64_t number = json_integer_value(value);

    if (number < lo || number > hi)
        return rpc_refuse(error, RPC_INVALID_PARAMS,
                          "parameter '%s' is %lld, want a whole number from %lld to %lld", key, (long long)number,
                          (long long)lo, (long long)hi);
    *out = number;
    return true;
}

bool rpc_numbers(json_t *params, const char *key, double lo, double hi, size_t n, double *out, bool *present,
                 struct rpc_error *error)
{
    json_t *value = json_object_get(params, key);

    *present = value != NULL;
    if (!value)
        return true;
    if (!json_is_array(value))
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %s, want an array of %zu numbers", key,
                          kind_name(value), n);
    if (json_array_size(value) != n)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' has %zu elements, want %zu numbers", key,
                          json_array_size(value), n);
    for (size_t i = 0; i < n; i++) {
        const json_t *element = json_array_get(value, i);
        const double number = json_number_value(element);

        if (!json_is_number(element))
            return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s[%zu]' is %s, want a number from %g to %g",
                              key, i, kind_name(element), lo, hi);
        if (!(number >= lo && number <= hi))
            return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s[%zu]' is %g, want a number from %g to %g",
                              key, i, number, lo, hi);
    }
    for (size_t i = 0; i < n; i++)
        out[i] = json_number_value(json_array_get(value, i));
    return true;
}

bool rpc_word(json_t *params, const char *key, const char *const *words, int *out, struct rpc_error *error)
{
    const json_t *value = json_object_get(params, key);
    char allowed[128] = "";
    size_t used = 0;

    if (!value)
        return true;
    for (int i = 0; json_is_string(value) && words[i]; i++) {
        if (strcmp(json_string_value(value), words[i]) == 0) {
            *out = i;
            return true;
        }
    }
    for (int i = 0; words[i] && used < sizeof allowed; i++)
        used += (size_t)snprintf(allowed + used, sizeof allowed - used, "%s%s", i ? ", " : "", words[i]);
    return rpc_refuse(error, RPC_INVALID_PARAMS, "parameter '%s' is %.40s, want one of: %s", key,
                      json_is_string(value) ? json_string_value(value) : kind_name(value), allowed);
}

bool rpc_only(json_t *params, const char *const *keys, struct rpc_error *error)
{
    const char *key;
    json_t *value;
    char allowed[128] = "";
    size_t used = 0;

    json_object_foreach(params, key, value)
    {
        int i = 0;

        while (keys[i] && strcmp(keys[i], key) != 0)
            i++;
        if (keys[i])
            continue;
        for (i = 0; keys[i] && used < sizeof allowed; i++)
            used += (size_t)snprintf(allowed + used, sizeof allowed - used, "%s%s", i ? ", " : "", keys[i]);
        return rpc_refuse(error, RPC_INVALID_PARAMS, "'%.40s' is not known here, allowed: %s", key,
                          allowed[0] ? allowed : "no parameters");
    }
    return true;
}
