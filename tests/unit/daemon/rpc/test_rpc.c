/* SPDX-License-Identifier: MIT */
/*
 * test_rpc - JSON-RPC 2.0 as its specification has it (the examples of its chapter 7 among the rows), what sonard adds
 * (parameters by name only, limits, nothing misspelt passes) and inputs that nobody means well with.
 */
#include "daemon/rpc/rpc.h"

#include "core/readable.h"

#include "tests/lib/test.h"
#include "tests/lib/json_take.h"

static bool subtract(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call, (void)error;
    return json_out_take(out, json_real(params_number(params, "minuend") - params_number(params, "subtrahend")));
}

static int n_updates;

static bool update(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call, (void)params, (void)error;
    n_updates++;
    return json_out_take(out, json_object());
}

static bool silent_failure(const struct rpc_call *call, json_t *params, struct json_out *out,
                           struct rpc_error *error)
{
    (void)call, (void)params, (void)error, (void)out;
    return false;
}

static bool numbers(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call, (void)params, (void)error;
    return json_out_take(out, json_pack("[f, f, f, s]", 0.1, 1710345016.123, (double)0.25f, "a\nb\xe2\x80\xa8"));
}

static bool who(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params, (void)error;
    return json_out_take(out, json_integer((json_int_t)(call->now_ns + *(const uint64_t *)call->daemon)));
}

static int n_dropped;

static void drop_parts(void *state)
{
    (void)state;
    n_dropped++;
}

struct parts {
    int done;
    bool refuses;
};

/* In three parts; at the last it gives its state back, or leaves it and refuses. */
static bool part(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct parts *p = call->work->state;
    if (++p->done < 3)
        return rpc_continue(call, part);
    if (p->refuses)
        return rpc_refuse(error, RPC_LIMIT, "no");
    rpc_work_keep(call->work, NULL, NULL);
    return json_out_take(out, json_integer(p->done));
}

static bool parts(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    static struct parts p;
    p = (struct parts){.refuses = json_object_get(params, "refuse") != NULL};
    rpc_work_keep(call->work, &p, drop_parts);
    return part(call, out, error);
}

static const struct protocol_method subtract_row = {
    .name = "subtract",
    .params = (const struct protocol_param[]){
        {.name = "minuend", .type = PROTOCOL_NUMBER, .lo = -1e6, .hi = 1e6, .need = PROTOCOL_REQUIRED},
        {.name = "subtrahend", .type = PROTOCOL_NUMBER, .lo = -1e6, .hi = 1e6, .need = PROTOCOL_REQUIRED},
        {0}}};

static const struct rpc_method methods[] = {{"parts", parts, RPC_CHANGES, NULL},
                                            {"subtract", subtract, RPC_ASKS, &subtract_row},
                                            {"update", update, RPC_CHANGES, NULL},
                                            {"silent", silent_failure, RPC_ASKS, NULL},
                                            {"numbers", numbers, RPC_ASKS, NULL},
                                            {"who", who, RPC_ASKS, NULL},
                                            {.name = NULL}};

static uint64_t daemon_value = 5;
static struct rpc_counts counts;
static const struct rpc_call the_call = {.daemon = &daemon_value, .now_ns = 37, .counts = &counts};

static char *ask_as(const struct rpc_call *call, const char *line, size_t n)
{
    struct rpc_job *job = rpc_begin(call, line, n);
    char *text = NULL;
    while (rpc_step(job, methods, call)) {
    }
    CHECK(rpc_end(job, &text));
    return text;
}

static char *ask_bytes(const char *line, size_t n)
{
    return ask_as(&the_call, line, n);
}

/* "-" stands for no reply. A want that ends in "..." is compared up to there. */
static void check_reply(const char *name, const char *line, size_t n, const char *want)
{
    char *got = ask_bytes(line, n);
    const size_t length = strlen(want);
    const bool open = length > 3 && strcmp(want + length - 3, "...") == 0;
    const char *shown = got ? got : "-";
    if (open ? strncmp(shown, want, length - 3) != 0 : strcmp(shown, want) != 0) {
        printf("%s: got %s\n  expected %s\n", name, shown, want);
        test_case_failed = true;
    }
    free(got);
}

struct row {
    const char *name, *line, *want;
};

static void check_rows(const struct row *row, size_t n)
{
    for (size_t i = 0; i < n; i++)
        check_reply(row[i].name, row[i].line, strlen(row[i].line), row[i].want);
}

#define CHECK_ROWS(rows) check_rows(rows, sizeof rows / sizeof *(rows))
#define REQUEST          "{\"jsonrpc\":\"2.0\",\"method\":\"subtract\",\"params\":{\"minuend\":42,\"subtrahend\":23}"
#define ERROR(code)      "{\"jsonrpc\":\"2.0\",\"error\":{\"code\":" #code ",\"message\":\""

TEST(a_method_in_parts_is_called_until_it_is_done)
{
    static const char one[] = "{\"jsonrpc\":\"2.0\",\"method\":\"parts\",\"id\":1}";
    static const struct row rows[] = {
        {"one", one, "{\"jsonrpc\":\"2.0\",\"result\":3,\"id\":1}"},
        {"a batch",
         "[{\"jsonrpc\":\"2.0\",\"method\":\"parts\",\"id\":1},{\"jsonrpc\":\"2.0\",\"method\":\"parts\",\"id\":2}"
         "]",
         "[{\"jsonrpc\":\"2.0\",\"result\":3,\"id\":1},{\"jsonrpc\":\"2.0\",\"result\":3,\"id\":2}]"},
        {"a notification", "{\"jsonrpc\":\"2.0\",\"method\":\"parts\"}", "-"},
    };
    static const struct row refused[] = {
        {"refused", "{\"jsonrpc\":\"2.0\",\"method\":\"parts\",\"params\":{\"refuse\":1},\"id\":1}",
         "{\"jsonrpc\":\"2.0\",\"error\":{\"code\":-32000,..."},
    };
    const uint64_t before = counts.requests;
    n_dropped = 0;
    CHECK_ROWS(rows);
    CHECK_INT(counts.requests - before, 4);
    CHECK_INT(n_dropped, 0);
    CHECK_ROWS(refused);
    CHECK_INT(n_dropped, 1);
    struct rpc_job *job = rpc_begin(&the_call, one, sizeof one - 1);
    char *text = NULL;
    CHECK(rpc_step(job, methods, &the_call)); /* and nobody waits for the rest */
    CHECK(rpc_end(job, &text) && !text);
    CHECK_INT(n_dropped, 2);
}

TEST(examples_of_the_specification)
{
    static const struct row rows[] = {
        {"named parameters", REQUEST ",\"id\":3}", "{\"jsonrpc\":\"2.0\",\"result\":19.0,\"id\":3}"},
        {"named, other order",
         "{\"jsonrpc\": \"2.0\", \"method\": \"subtract\", \"params\": {\"subtrahend\": 23, \"minuend\": 42}, "
         "\"id\": 4}",
         "{\"jsonrpc\":\"2.0\",\"result\":19.0,\"id\":4}"},
        {"notification", "{\"jsonrpc\": \"2.0\", \"method\": \"update\", \"params\": {}}", "-"},
        {"notification, no such method", "{\"jsonrpc\": \"2.0\", \"method\": \"foobar\"}", "-"},
        {"no such method", "{\"jsonrpc\": \"2.0\", \"method\": \"foobar\", \"id\": \"1\"}",
         ERROR(-32601) "no method 'foobar'; see sonard-protocol(7)\"},\"id\":\"1\"}"},
        {"invalid JSON", "{\"jsonrpc\": \"2.0\", \"method\": \"foobar, \"params\": \"bar\", \"baz]",
         ERROR(-32700) "..."},
        {"invalid request", "{\"jsonrpc\": \"2.0\", \"method\": 1, \"params\": \"bar\"}", ERROR(-32600) "..."},
        {"batch, invalid JSON",
         "[{\"jsonrpc\": \"2.0\", \"method\": \"update\", \"id\": \"1\"},{\"jsonrpc\": \"2.0\", \"method\"]",
         ERROR(-32700) "..."},
        {"empty batch", "[]", ERROR(-32600) "a batch must hold at least one request\"},\"id\":null}"},
        {"batch of nothing valid", "[1]",
         "[" ERROR(-32600) "a request is an object, found a number\"},\"id\":null}]"},
        {"three of them", "[1,2,3]",
         "[" ERROR(-32600) "a request is an object, found a number\"},\"id\":null}," ERROR(
             -32600) "a request is an object, found a number\"},\"id\":null}," ERROR(-32600) "a request is an "
                                                                                             "object, found a "
                                                                                             "number\"},\"id\":"
                                                                                             "null}]"},
        {"batch of all sorts",
         "[" REQUEST ",\"id\":\"1\"}," REQUEST
         "},{\"foo\":\"boo\"},{\"jsonrpc\":\"2.0\",\"method\":\"foo.get\",\"id\":\"5\"}]",
         "[{\"jsonrpc\":\"2.0\",\"result\":19.0,\"id\":\"1\"}," ERROR(
             -32600) "'foo' is not known here, allowed: "
                     "jsonrpc, method, params, "
                     "id\"},\"id\":null}," ERROR(-32601) "no method "
                                                         "'foo.get'; see sonard-protocol(7)\"},\"id\":"
                                                         "\"5\"}]"},
        {"batch of notifications", "[" REQUEST "}," REQUEST "}]", "-"},
    };
    CHECK_ROWS(rows);
}

TEST(ids_come_back_as_they_were)
{
    static const char *const ids[] = {
        "0",    "-7",  "9007199254740993", "9223372036854775807", "\"\"", "\"a \\\" b\"",
        "null", "1.5", "\"\xc3\xa9\"",     "0.10000000000000001"};
    for (size_t i = 0; i < sizeof ids / sizeof *ids; i++) {
        char line[256], want[256];
        snprintf(line, sizeof line, REQUEST ",\"id\":%s}", ids[i]);
        snprintf(want, sizeof want, "{\"jsonrpc\":\"2.0\",\"result\":19.0,\"id\":%s}", ids[i]);
        check_reply(ids[i], line, strlen(line), want);
    }
}

TEST(requests_of_the_wrong_form_are_refused)
{
    static const struct row rows[] = {
        {"scalar", "17", ERROR(-32600) "..."},
        {"string", "\"subtract\"", ERROR(-32600) "..."},
        {"id true", REQUEST ",\"id\":true}",
         ERROR(-32600) "'id' must be a string, a number or null, found true or "
                       "false\"},\"id\":null}"},
        {"id object", REQUEST ",\"id\":{}}", ERROR(-32600) "..."},
        {"version missing", "{\"method\":\"update\",\"id\":1}",
         ERROR(-32600) "'jsonrpc' must be the string "
                       "'2.0'\"},\"id\":1}"},
        {"version a number", "{\"jsonrpc\":2.0,\"method\":\"update\",\"id\":1}", ERROR(-32600) "..."},
        {"version 1.0", "{\"jsonrpc\":\"1.0\",\"method\":\"update\",\"id\":1}", ERROR(-32600) "..."},
        {"method missing", "{\"jsonrpc\":\"2.0\",\"id\":1}",
         ERROR(-32600) "'method' must be a string, it is missing..."},
        {"params a string", "{\"jsonrpc\":\"2.0\",\"method\":\"update\",\"params\":\"x\",\"id\":1}",
         ERROR(-32600) "..."},
        {"params null", "{\"jsonrpc\":\"2.0\",\"method\":\"update\",\"params\":null,\"id\":1}",
         ERROR(-32600) "..."},
        {"params by position", "{\"jsonrpc\":\"2.0\",\"method\":\"subtract\",\"params\":[42,23],\"id\":1}",
         ERROR(-32602) "parameters go by name: 'params' must be an object, found an array\"},\"id\":1}"},
        {"misspelt member", "{\"jsonrpc\":\"2.0\",\"method\":\"update\",\"parms\":{},\"id\":1}",
         ERROR(-32600) "'parms' is not known here, allowed: jsonrpc, method, params, id\"},\"id\":1}"},
        {"duplicate key", "{\"jsonrpc\":\"2.0\",\"method\":\"update\",\"method\":\"x\",\"id\":1}",
         ERROR(-32700) "..."},
        {"method gave nothing", "{\"jsonrpc\":\"2.0\",\"method\":\"silent\",\"id\":1}", ERROR(-32603) "..."},
    };
    CHECK_ROWS(rows);
}

TEST(bytes_that_are_no_json_are_a_parse_error)
{
    static const struct {
        const char *name, *bytes;
        size_t n;
    } rows[] = {
        {"nothing", "", 0},
        {"blanks", "  \r", 3},
        {"NUL", "\0", 1},
        {"NUL after a request", REQUEST ",\"id\":1}\0", sizeof REQUEST ",\"id\":1}"},
        {"NUL in a string", "{\"jsonrpc\":\"2\0\"}", 16},
        {"escaped NUL", "{\"jsonrpc\":\"\\u0000\"}", 20},
        {"invalid UTF-8", "{\"jsonrpc\":\"\xff\"}", 15},
        {"overlong UTF-8", "{\"jsonrpc\":\"\xc0\x80\"}", 16},
        {"cut UTF-8", "{\"jsonrpc\":\"\xe2\x82\"}", 16},
        {"UTF-8 surrogate", "{\"jsonrpc\":\"\xed\xa0\x80\"}", 17},
        {"lone surrogate", "{\"jsonrpc\":\"\\ud800\"}", 20},
        {"byte order mark", "\xef\xbb\xbf{}", 5},
        {"two values", "{} {}", 5},
        {"NaN", "NaN", 3},
        {"infinite", "1e999", 5},
        {"integer beyond 64 bits", "99999999999999999999", 20},
        {"closing only", "]]]]}}}}", 8},
        {"escape at the end", "\"\\", 2},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        check_reply(rows[i].name, rows[i].bytes, rows[i].n, ERROR(-32700) "...");
}

TEST(limits_are_named)
{
    char *line = malloc(RPC_LINE_MAX + 2);
    char batch[8 * (RPC_BATCH_MAX + 2)] = "[1";
    memset(line, ' ', RPC_LINE_MAX + 1);
    memcpy(line, "{}", 2);
    check_reply("longest line", line, RPC_LINE_MAX, ERROR(-32600) "...");
    check_reply("one more byte", line, RPC_LINE_MAX + 1, ERROR(-32000) "the line is longer than 65536 bytes...");

    memset(line, '[', RPC_LINE_MAX);
    check_reply("65536 brackets", line, RPC_LINE_MAX, ERROR(-32000) "arrays and objects nested deeper than 16...");
    memset(line + RPC_DEPTH_MAX, ']', RPC_DEPTH_MAX);
    check_reply("deepest nesting", line, 2 * RPC_DEPTH_MAX, "[" ERROR(-32600) "...");
    check_reply("one level more", "[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]", 34, ERROR(-32000) "...");
    check_reply("brackets in a string", "\"[[[[[[[[[[[[[[[[[[[[\\\"[[[[[[[\"", 31, ERROR(-32600) "...");

    for (int i = 1; i < RPC_BATCH_MAX; i++)
        strcat(batch, ",1");
    strcat(batch, "]");
    check_reply("largest batch", batch, strlen(batch), "[" ERROR(-32600) "...");
    strcpy(batch + strlen(batch) - 1, ",1]");
    check_reply("one request more", batch, strlen(batch), ERROR(-32000) "17 requests in a batch, at most 16 ...");
    free(line);
}

TEST(numbers_have_the_digits_they_need)
{
    static const struct row rows[] = {
        {"reals", "{\"jsonrpc\":\"2.0\",\"method\":\"numbers\",\"id\":1}",
         "{\"jsonrpc\":\"2.0\",\"result\":[0.1,1710345016.123,0.25,\"a\\nb\xe2\x80\xa8\"],\"id\":1}"},
        {"who asks, when", "{\"jsonrpc\":\"2.0\",\"method\":\"who\",\"id\":1}",
         "{\"jsonrpc\":\"2.0\",\"result\":42,\"id\":1}"},
    };
    CHECK_ROWS(rows);
}

TEST(notifications_run_and_are_counted)
{
    static const char batch[] = "[{\"jsonrpc\":\"2.0\",\"method\":\"update\"},"
                                "{\"jsonrpc\":\"2.0\",\"method\":\"update\"},7]";
    counts = (struct rpc_counts){0};
    n_updates = 0;
    check_reply("batch", batch, strlen(batch), "[" ERROR(-32600) "...");
    CHECK_INT(n_updates, 2);
    CHECK_INT(counts.requests, 3);
    CHECK_INT(counts.errors, 1);
}

TEST(quoted_input_is_made_harmless)
{
    char line[1024] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"%s%n\\\"\\u001b[31m\xc3\xa9";

    for (int i = 0; i < 100; i++)
        strcat(line, "\xc3\xa9");
    strcat(line, "\"}");
    char *got = ask_bytes(line, strlen(line));
    CHECK(got && strstr(got, "no method '%s%n'?[31m\xc3\xa9\xc3\xa9"));
    for (const char *c = got; c && *c; c += readable_length(c) ? readable_length(c) : 1)
        CHECK(readable_length(c) > 0);

    json_t *value = json_loads(got, 0, NULL);

    CHECK(value != NULL);
    json_decref(value);
    free(got);
}

#define ONE(type_, ...)                                                                                           \
    (const struct protocol_param[])                                                                               \
    {                                                                                                             \
        {.name = "x", .type = PROTOCOL_##type_, .absent = "", __VA_ARGS__},                                       \
        {                                                                                                         \
            0                                                                                                     \
        }                                                                                                         \
    }

/* A row per type and fault: what is expected is the message, "" when it is accepted. */
TEST(parameters_of_every_type_are_checked)
{
    const struct protocol_param *const number = ONE(NUMBER, .hi = 10, .need = PROTOCOL_REQUIRED);
    const struct protocol_param *const integer = ONE(INTEGER, .lo = 1, .hi = 10);
    const struct protocol_param *const pair = ONE(NUMBERS, .hi = 10, .count = 2);
    const struct protocol_param *const band = ONE(BAND, .lo = -90, .hi = 90, .count = 2);
    const struct protocol_param *const places = ONE(PLACES, .hi = 10, .count = 2);
    const struct protocol_param *const word = ONE(WORD, .words = (const char *const[]){"body", "ned", NULL});
    const struct protocol_param *const flag = ONE(FLAG, .lo = 0), *const text = ONE(TEXT, .lo = 0);
    const struct protocol_param *const cursor = ONE(CURSOR, .lo = 0), *const object = ONE(OBJECT, .lo = 0);
    const struct {
        const struct protocol_param *params;
        const char *given, *want;
    } rows[] = {
        {number, "{}", "parameter 'x' is missing"},
        {number, "{\"x\":0}", ""},
        {number, "{\"x\":10.0}", ""},
        {number, "{\"x\":10.5}", "parameter 'x' is 10.5, expected a number from 0 to 10"},
        {number, "{\"x\":10.0000000001}", "parameter 'x' is 10.0000000001, expected a number from 0 to 10"},
        {number, "{\"x\":-1e-300}", "parameter 'x' is -1e-300, expected a number from 0 to 10"},
        {number, "{\"x\":-1}", "parameter 'x' is -1, expected a number from 0 to 10"},
        {number, "{\"x\":\"3\"}", "parameter 'x' is a string, expected a number from 0 to 10"},
        {number, "{\"x\":null}", "parameter 'x' is null, expected a number from 0 to 10"},
        {number, "{\"x\":1,\"y\":1}", "'y' is not known here, allowed: x"},
        {integer, "{}", ""},
        {integer, "{\"x\":10}", ""},
        {integer, "{\"x\":2.5}", "parameter 'x' is not whole, expected a whole number from 1 to 10"},
        {integer, "{\"x\":11}", "parameter 'x' is 11, expected a whole number from 1 to 10"},
        {integer, "{\"x\":[]}", "parameter 'x' is an array, expected a whole number from 1 to 10"},
        {pair, "{}", ""},
        {pair, "{\"x\":[1,2]}", ""},
        {pair, "{\"x\":[1]}", "parameter 'x' has 1 elements, expected 2 numbers"},
        {pair, "{\"x\":{}}", "parameter 'x' is an object, expected an array of 2 numbers"},
        {pair, "{\"x\":[1,true]}", "parameter 'x[1]' is true or false, expected a number from 0 to 10"},
        {pair, "{\"x\":[11,1]}", "parameter 'x[0]' is 11, expected a number from 0 to 10"},
        {band, "{\"x\":[-5,5]}", ""},
        {band, "{\"x\":[5,5]}", "x is [5, 5]: the first must be below the second"},
        {band, "{\"x\":[-90,90.0000000001]}",
         "parameter 'x[1]' is 90.0000000001, expected a number from -90 to 90"},
        {band, "{\"x\":[-90,90.00000000000001]}",
         "parameter 'x[1]' is 90.00000000000001, expected a number from -90 to 90"},
        {band, "{\"x\":[-1e308,5]}", "parameter 'x[0]' is -1e+308, expected a number from -90 to 90"},
        {band, "{\"x\":[-91,5]}", "parameter 'x[0]' is -91, expected a number from -90 to 90"},
        {places, "{\"x\":[[1,2,3],[4,5,6]]}", ""},
        {places, "{\"x\":[]}", "x must be an array of 1 to 2 places"},
        {places, "{\"x\":3}", "x must be an array of 1 to 2 places"},
        {places, "{\"x\":[[1,2,3],[4,5]]}", "parameter 'x[1]' has 2 elements, expected 3 numbers"},
        {places, "{\"x\":[[1,2,11]]}", "parameter 'x[0][2]' is 11, expected a number from 0 to 10"},
        {word, "{}", ""},
        {word, "{\"x\":\"ned\"}", ""},
        {word, "{\"x\":\"NED\"}", "parameter 'x' is NED, expected one of: body, ned"},
        {word, "{\"x\":1}", "parameter 'x' is a number, expected one of: body, ned"},
        {flag, "{\"x\":false}", ""},
        {flag, "{\"x\":0}", "parameter 'x' is a number, expected true or false"},
        {text, "{\"x\":\"a\"}", ""},
        {text, "{\"x\":null}", "parameter 'x' is null, expected a string"},
        {cursor, "{\"x\":null}", ""},
        {cursor, "{\"x\":1}", "parameter 'x' is a number, expected a string or null"},
        {object, "{\"x\":{}}", ""},
        {object, "{\"x\":[]}", "parameter 'x' is an array, expected an object"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct rpc_error error = {0};
        json_t *params = json_loads(rows[i].given, 0, NULL);
        const bool ok = params_take(rows[i].params, params, &error);
        CHECK_STR(error.message, rows[i].want);
        CHECK_INT(ok, rows[i].want[0] == '\0');
        CHECK_INT(error.code, ok ? 0 : RPC_INVALID_PARAMS);
        json_decref(params);
    }
}

/* What is not given has its default, also when the same parameters are taken again, as those of a watch are. */
TEST(defaults_are_set_and_do_not_count_as_given)
{
    static const struct protocol_param rows[] = {
        {.name = "cone", .type = PROTOCOL_NUMBER, .hi = 180, .need = PROTOCOL_DEFAULT, .initial = {7.5}},
        {.name = "corridor", .type = PROTOCOL_NUMBER, .hi = 100, .instead_of = "cone"},
        {.name = "count", .type = PROTOCOL_INTEGER, .hi = 100, .need = PROTOCOL_DEFAULT, .initial = {72}},
        {.name = "band", .type = PROTOCOL_BAND, .lo = -90, .hi = 90, .need = PROTOCOL_DEFAULT, .initial = {-5, 5}},
        {.name = "locked", .type = PROTOCOL_FLAG, .need = PROTOCOL_DEFAULT, .initial = {1}},
        {0}};
    static const struct {
        const char *given, *want;
    } row[] = {
        {"{}", "{\"cone\":7.5,\"count\":72,\"band\":[-5.0,5.0],\"locked\":true}"},
        {"{\"corridor\":2,\"count\":3}", "{\"corridor\":2,\"count\":3,\"band\":[-5.0,5.0],\"locked\":true}"},
    };
    struct rpc_error error = {0};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        json_t *params = json_loads(row[i].given, 0, NULL);
        for (int again = 0; again < 2; again++) {
            CHECK(params_take(rows, params, &error));
            char *text = json_dumps(params, JSON_COMPACT);
            CHECK_STR(text, row[i].want);
            free(text);
        }
        json_decref(params);
    }

    json_t *both = json_loads("{\"cone\":1,\"corridor\":1}", 0, NULL);

    CHECK(!params_take(rows, both, &error));
    CHECK_STR(error.message, "cone and corridor exclude each other: give only one");
    json_decref(both);
}

/* Requests with bytes changed, removed and doubled: always a reply that is JSON on one line, or none. */
TEST(spoilt_requests_get_a_sound_reply)
{
    static const char seedling[] =
        "[" REQUEST ",\"id\":1},{\"jsonrpc\":\"2.0\",\"method\":\"numbers\",\"id\":\"\xc3\xa9\"}]";
    uint64_t seed = test_seed();

    for (int round = 0; round < 20000; round++) {
        char line[sizeof seedling + 16];
        size_t n = sizeof seedling - 1;
        memcpy(line, seedling, n);
        for (uint64_t k = test_random(&seed) % 4 + 1; k > 0; k--) {
            const size_t at = (size_t)(test_random(&seed) % n);
            switch (test_random(&seed) % 3) {
            case 0:
                line[at] = (char)test_random(&seed);
                break;
            case 1:
                memmove(line + at, line + at + 1, --n - at);
                break;
            default:
                memmove(line + at + 1, line + at, n++ - at);
            }
        }
        char *got = ask_bytes(line, n);

        if (!got)
            continue;
        json_t *value = json_loads(got, 0, NULL);

        CHECK(value != NULL);
        CHECK(strchr(got, '\n') == NULL);
        json_decref(value);
        free(got);
    }
}

/* As a request, as a notification, in a batch: what changes something is not done for who may only ask. */
TEST(who_may_only_ask_changes_nothing)
{
    static const char *const lines[][2] = {
        {"{\"jsonrpc\":\"2.0\",\"method\":\"update\",\"id\":1}",
         ERROR(-32001) "'update': you may not\"},\"id\":1}"},
        {"{\"jsonrpc\":\"2.0\",\"method\":\"update\"}", "-"},
        {"[{\"jsonrpc\":\"2.0\",\"method\":\"update\"}," REQUEST ",\"id\":3}]",
         "[{\"jsonrpc\":\"2.0\",\"result\":19.0,\"id\":3}]"},
    };
    struct rpc_call asker = the_call;
    const int before = n_updates;
    asker.refusal = "you may not";
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
        char *got = ask_as(&asker, lines[i][0], strlen(lines[i][0]));
        CHECK_STR(got ? got : "-", lines[i][1]);
        free(got);
    }
    CHECK_INT(n_updates, before);
    free(ask_bytes(lines[1][0], strlen(lines[1][0])));
    CHECK_INT(n_updates, before + 1);
}

int main(void)
{
    RUN(who_may_only_ask_changes_nothing);
    RUN(examples_of_the_specification);
    RUN(a_method_in_parts_is_called_until_it_is_done);
    RUN(ids_come_back_as_they_were);
    RUN(requests_of_the_wrong_form_are_refused);
    RUN(bytes_that_are_no_json_are_a_parse_error);
    RUN(limits_are_named);
    RUN(numbers_have_the_digits_they_need);
    RUN(notifications_run_and_are_counted);
    RUN(quoted_input_is_made_harmless);
    RUN(parameters_of_every_type_are_checked);
    RUN(defaults_are_set_and_do_not_count_as_given);
    RUN(spoilt_requests_get_a_sound_reply);
    return test_end();
}
