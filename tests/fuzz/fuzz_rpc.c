/* SPDX-License-Identifier: MIT */
/*
 * fuzz_rpc - any bytes as a request line: a reply is JSON again, on one line, and nothing leaks. The method takes a
 * parameter of every type.
 */
#include "daemon/rpc/rpc.h"
#include "tests/lib/json_take.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile double sink;

static bool every_reader(const struct rpc_call *call, json_t *params, struct json_out *out,
                         struct rpc_error *error)
{
    double vector[3] = {0}, place[4][3];
    (void)call, (void)error;
    params_numbers(params, "v", vector);
    sink = params_number(params, "n") + (double)params_integer(params, "i") + vector[2] +
           params_is(params, "w", "ned") + params_places(params, "p", place) + params_flag(params, "f") +
           params_has(params, "c") + (params_text(params, "t") != NULL);
    return json_out_take(out, json_incref(params));
}

#define ONE(name_, type_, ...)                                                                                    \
    {                                                                                                             \
        .name = name_, .type = PROTOCOL_##type_, .absent = "", __VA_ARGS__                                        \
    }

/* A parameter of every type. */
static const struct protocol_method row = {
    .name = "m",
    .params = (const struct protocol_param[]){
        ONE("n", NUMBER, .lo = -1, .hi = 1, .need = PROTOCOL_REQUIRED),
        ONE("i", INTEGER, .lo = -5, .hi = 5, .need = PROTOCOL_DEFAULT, .initial = {2}),
        ONE("v", NUMBERS, .lo = -1, .hi = 1, .count = 3),
        ONE("b", BAND, .lo = -90, .hi = 90, .count = 2, .need = PROTOCOL_DEFAULT, .initial = {-5, 5}),
        ONE("p", PLACES, .lo = -1, .hi = 1, .count = 4, .instead_of = "v"),
        ONE("w", WORD, .words = (const char *const[]){"body", "ned", NULL}, .need = PROTOCOL_DEFAULT),
        ONE("f", FLAG, .need = PROTOCOL_DEFAULT),
        ONE("c", CURSOR, .lo = 0),
        ONE("t", TEXT, .lo = 0),
        ONE("o", OBJECT, .lo = 0),
        {0}}};

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const struct rpc_method methods[] = {{"m", every_reader, RPC_ASKS, &row}, {.name = NULL}};
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
