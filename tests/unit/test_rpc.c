/* SPDX-License-Identifier: MIT */
/*
 * test_rpc - JSON-RPC 2.0 as its specification has it (the examples of its chapter 7 among the rows), what sonard adds
 * (parameters by name only, limits, nothing misspelt passes) and inputs that nobody means well with.
 */
#include "../../daemon/rpc.h"

#include "../lib/test.h"

static json_t *subtract(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"minuend", "subtrahend", NULL};
    double a, b;

    (void)call;
    if (!rpc_only(params, keys, error) || !rpc_number(params, "minuend", true, -1e6, 1e6, &a, error) ||
        !rpc_number(params, "subtrahend", true, -1e6, 1e6, &b, error))
        return NULL;
    return json_real(a - b);
}

static int n_updates;

static json_t *update(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    (void)call, (void)params, (void)error;
    n_updates++;
    return json_object();
}

static json_t *silent_failure(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    (void)call, (void)params, (void)error;
    return NULL;
}

static json_t *numbers(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    (void)call, (void)params, (void)error;
    return json_pack("[f, f, f, s]", 0.1, 1710345016.123, (double)0.25f, "a\nb\xe2\x80\xa8");
}

static json_t *who(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    (void)params, (void)error;
    return json_integer((json_int_t)(call->now_ns + *(const uint64_t *)call->daemon));
}

static int n_dropped;

static void drop_parts(void *state)
{
    (void)state;
    n_dropped++;
}

/* In three parts; at the last it gives its state back, or leaves it and refuses. */
static json_t *parts(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static int done;
    const bool refuses = json_object_get(params, "refuse") != NULL;
    if (!call->work->state)
        done = 0;
    *call->work = (struct rpc_work){.state = &done, .drop = drop_parts};
    if (++done < 3) {
        error->code = RPC_UNFINISHED;
        return NULL;
    }
    if (refuses) {
        rpc_refuse(error, RPC_LIMIT, "no");
        return NULL;
    }
    *call->work = (struct rpc_work){0};
    return json_integer(done);
}

static const struct rpc_method methods[] = {{"parts", parts, RPC_CHANGES, NULL},
                                            {"subtract", subtract, RPC_ASKS, NULL},
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
        printf("%s: got %s\n  want %s\n", name, shown, want);
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

#define CHECK_ROWS(rows) check_rows(rows, sizeof(rows) / sizeof *(rows))
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
         ERROR(-32601) "no method 'foobar'; sonard-protocol(7) has them all\"},\"id\":\"1\"}"},
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
         "[{\"jsonrpc\":\"2.0\",\"result\":19.0,\"id\":\"1\"}," ERROR(-32600) "'foo' is not known here, allowed: "
                                                                              "jsonrpc, method, params, "
                                                                              "id\"},\"id\":null}," ERROR(
                                                                                  -32601) "no method "
                                                                                          "'foo.get'; sonard-protocol(7) has them all\"},\"id\":"
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

    CHECK(got && strstr(got, "no method '%s%n'?[31m??"));
    for (const char *c = got; c && *c; c++)
        CHECK(*c >= 0x20 && *c < 0x7f);

    json_t *value = json_loads(got, 0, NULL);

    CHECK(value != NULL);
    json_decref(value);
    free(got);
}

/* A row per helper and fault: params, expected message ("" when it is accepted). */
TEST(parameter_helpers_say_what_is_wrong)
{
    static const char *const words[] = {"body", "ned", NULL};
    static const struct {
        char helper;
        const char *params, *want;
    } rows[] = {
        {'n', "{}", "parameter 'x' is missing"},
        {'n', "{\"x\":0}", ""},
        {'n', "{\"x\":10.0}", ""},
        {'n', "{\"x\":10.5}", "parameter 'x' is 10.5, want a number from 0 to 10"},
        {'n', "{\"x\":-1}", "parameter 'x' is -1, want a number from 0 to 10"},
        {'n', "{\"x\":\"3\"}", "parameter 'x' is a string, want a number from 0 to 10"},
        {'n', "{\"x\":null}", "parameter 'x' is null, want a number from 0 to 10"},
        {'i', "{}", ""},
        {'i', "{\"x\":10}", ""},
        {'i', "{\"x\":2.5}", "parameter 'x' is not whole, want a whole number from 1 to 10"},
        {'i', "{\"x\":11}", "parameter 'x' is 11, want a whole number from 1 to 10"},
        {'i', "{\"x\":[]}", "parameter 'x' is an array, want a whole number from 1 to 10"},
        {'v', "{}", ""},
        {'v', "{\"x\":[1,2]}", ""},
        {'v', "{\"x\":[1]}", "parameter 'x' has 1 elements, want 2 numbers"},
        {'v', "{\"x\":{}}", "parameter 'x' is an object, want an array of 2 numbers"},
        {'v', "{\"x\":[1,true]}", "parameter 'x[1]' is true or false, want a number from 0 to 10"},
        {'v', "{\"x\":[11,1]}", "parameter 'x[0]' is 11, want a number from 0 to 10"},
        {'w', "{}", ""},
        {'w', "{\"x\":\"ned\"}", ""},
        {'w', "{\"x\":\"NED\"}", "parameter 'x' is NED, want one of: body, ned"},
        {'w', "{\"x\":1}", "parameter 'x' is a number, want one of: body, ned"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct rpc_error error = {0};
        json_t *params = json_loads(rows[i].params, 0, NULL);
        double number = 0, pair[2];
        int64_t whole = 0;
        int word = -1;
        bool present, ok;

        switch (rows[i].helper) {
        case 'n':
            ok = rpc_number(params, "x", true, 0, 10, &number, &error);
            break;
        case 'i':
            ok = rpc_integer(params, "x", false, 1, 10, &whole, &error);
            break;
        case 'v':
            ok = rpc_numbers(params, "x", 0, 10, 2, pair, &present, &error);
            break;
        default:
            ok = rpc_word(params, "x", words, &word, &error);
        }
        CHECK_STR(error.message, rows[i].want);
        CHECK_INT(ok, rows[i].want[0] == '\0');
        CHECK_INT(error.code, ok ? 0 : RPC_INVALID_PARAMS);
        json_decref(params);
    }
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
    RUN(parameter_helpers_say_what_is_wrong);
    RUN(spoilt_requests_get_a_sound_reply);
    return test_end();
}
