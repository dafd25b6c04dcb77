/* SPDX-License-Identifier: MIT */
/*
 * fuzz_rpc - any bytes as a request line: a reply is JSON again, on one line, and nothing leaks. The methods take
 * parameters through every helper.
 */
#include "../../daemon/rpc.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile double sink;

static json_t *every_helper(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"n", "i", "v", "w", NULL};
    static const char *const words[] = {"body", "ned", NULL};
    double number = 0, vector[3] = {0};
    int64_t whole = 0;
    int word = 0;
    bool present;

    (void)call;
    if (!rpc_only(params, keys, error) || !rpc_number(params, "n", true, -1, 1, &number, error) ||
        !rpc_integer(params, "i", false, -5, 5, &whole, error) ||
        !rpc_numbers(params, "v", -1, 1, 3, vector, &present, error) ||
        !rpc_word(params, "w", words, &word, error))
        return NULL;
    sink = number + (double)whole + vector[2] + word + present;
    return json_incref(params);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const struct rpc_method methods[] = {{"m", every_helper, RPC_ASKS, NULL}, {.name = NULL}};
    const struct rpc_call call = {.now_ns = 1};
    struct rpc_job *job = rpc_begin(&call, (const char *)data, size);
    char *reply;

    while (rpc_step(job, methods, &call)) {
    }
    rpc_end(job, &reply);

    if (!reply)
        return 0;

    json_t *value = json_loads(reply, 0, NULL);

    if (!value || strchr(reply, '\n'))
        abort();
    json_decref(value);
    free(reply);
    return 0;
}
