/* SPDX-License-Identifier: MIT */
/*
 * test_client - the client library against peers of every kind: none, no permission, silent, gone, talking nonsense,
 * talking in pieces; and what sonarctl makes of command lines and results.
 */
#include "client/lib/sonard.h"

#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "client/arguments.h"
#include "client/ctl/show.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

static char directory[] = "/tmp/sonard-test-XXXXXX";
static char path[64];

/* A daemon that waits for a request and says these pieces, then closes (or stays silent until the client leaves). */
struct peer {
    int listener;
    const char *pieces[8];
    bool stay;
    pthread_t thread;
};

static void *answer(void *ctx)
{
    const struct peer *peer = ctx;
    const int fd = accept(peer->listener, NULL, NULL);
    char request[4096];
    for (int i = 0; i < 8 && peer->pieces[i]; i++) {
        if (i == 0 && recv(fd, request, sizeof request, 0) <= 0)
            break;
        send(fd, peer->pieces[i], strlen(peer->pieces[i]), MSG_NOSIGNAL);
        usleep(2000);
    }
    while (peer->stay && recv(fd, request, sizeof request, 0) > 0)
        ;
    close(fd);
    return NULL;
}

static void start(struct peer *peer)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    peer->listener = socket(AF_UNIX, SOCK_STREAM, 0);
    CHECK(bind(peer->listener, (struct sockaddr *)&address, sizeof address) == 0 &&
          listen(peer->listener, 1) == 0);
    pthread_create(&peer->thread, NULL, answer, peer);
}

static void stop(struct peer *peer)
{
    pthread_join(peer->thread, NULL);
    close(peer->listener);
    unlink(path);
}

TEST(no_daemon_is_told_from_no_permission)
{
    struct sonard_error error;
    CHECK(sonard_connect(path, 1, &error) == NULL);
    CHECK_INT(error.status, SONARD_NO_DAEMON);
    CHECK(strstr(error.message, "no daemon answers on"));
    CHECK(sonard_connect("/dev/null", 1, &error) == NULL);
    CHECK_INT(error.status, SONARD_NO_DAEMON);
    CHECK_STR(error.message, "/dev/null is not a socket");

    struct peer peer = {.stay = true};
    start(&peer);
    chmod(path, 0);
    if (geteuid() != 0) {
        CHECK(sonard_connect(path, 1, &error) == NULL);
        CHECK_INT(error.status, SONARD_NO_PERMISSION);
    }
    chmod(path, 0600);
    sonard_disconnect(sonard_connect(path, 1, &error));
    pthread_join(peer.thread, NULL);
    close(peer.listener);

    CHECK(sonard_connect(path, 1, &error) == NULL); /* the file is still there, nobody listens */
    CHECK_INT(error.status, SONARD_NO_DAEMON);
    unlink(path);

    char long_path[200] = "";
    memset(long_path, 'a', sizeof long_path - 1);
    CHECK(sonard_connect(long_path, 1, &error) == NULL);
    CHECK(strstr(error.message, "1 to 107 bytes"));
}

TEST(every_kind_of_answer_has_its_status)
{
    static const struct {
        const char *name, *pieces[8];
        bool stay;
        enum sonard_status want;
        const char *message;
    } rows[] = {
        {"result", {"{\"jsonrpc\":\"2.0\",\"result\":{\"x\":1},\"id\":1}\n"}, false, SONARD_OK, ""},
        {"in pieces", {"{\"jsonrpc\":\"2.0\",", "\"result\":{\"x\":1}", ",\"id\":1}", "\n"}, false, SONARD_OK, ""},
        {"after a notification",
         {"{\"jsonrpc\":\"2.0\",\"method\":\"watch\",\"params\":{\"watch\":1,\"result\":{}}}\n{\"jsonrpc\":\"2."
          "0\",\"result\":{},\"id\":1}"
          "\n"},
         false,
         SONARD_OK,
         ""},
        {"after another's answer",
         {"{\"result\":{},\"id\":99}\n{\"result\":{},\"id\":1}\n"},
         false,
         SONARD_OK,
         ""},
        {"error",
         {"{\"jsonrpc\":\"2.0\",\"error\":{\"code\":-32602,\"message\":\"no\"},\"id\":1}\n"},
         false,
         SONARD_REFUSED,
         "m: no"},
        {"refused at the door",
         {"{\"jsonrpc\":\"2.0\",\"error\":{\"code\":-32000,\"message\":\"full\"},\"id\":null}\n"},
         false,
         SONARD_REFUSED,
         "m: full"},
        {"neither result nor error", {"{\"jsonrpc\":\"2.0\",\"id\":1}\n"}, false, SONARD_REFUSED, "without"},
        {"no JSON", {"SSH-2.0-OpenSSH\n"}, false, SONARD_LOST, "does not speak JSON-RPC"},
        {"array", {"[]\n"}, false, SONARD_LOST, "does not speak JSON-RPC"},
        {"cut in the middle", {"{\"jsonrpc\":\"2.0\","}, false, SONARD_LOST, "ended the connection"},
        {"silence", {NULL}, true, SONARD_SILENT, "is silent"},
        {"half an answer, then silence", {"{\"jsonrpc\":\"2.0\","}, true, SONARD_SILENT, "is silent"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct peer peer = {.stay = rows[i].stay};
        struct sonard_error error = {0};
        memcpy(peer.pieces, rows[i].pieces, sizeof peer.pieces);
        start(&peer);
        struct sonard_client *client = sonard_connect(path, rows[i].stay ? 0.05 : PATIENCE_S, &error);
        const char *result = sonard_call(client, "m", NULL, &error);

        if ((result ? SONARD_OK : error.status) != rows[i].want || !strstr(error.message, rows[i].message)) {
            printf("%s: status %d, %s\n", rows[i].name, error.status, error.message);
            test_case_failed = true;
        }
        sonard_disconnect(client);
        stop(&peer);
    }
}

#define NOTE(n) "{\"method\":\"watch\",\"params\":{\"watch\":4,\"result\":{\"n\":" #n "}}}\n"

TEST(notifications_are_kept_in_order)
{
    struct peer peer = {.pieces = {NOTE(1) NOTE(2.5) "{\"method\":\"else\",\"params\":{}}\n",
                                   "{\"result\":true,\"id\":1}\n" NOTE(
                                       3) "{\"method\":\"watch\",\"params\":{\"watch\":4,\"skipped\":7,\"error\":"
                                          "{\"code\":-32600,\"message\":\"no\"}}}\n"},
                        .stay = true};
    static const char *const want[] = {"{\"n\":1}", "{\"n\":2.5}", "{\"n\":3}"};
    struct sonard_message message;
    struct sonard_error error = {0};
    start(&peer);
    struct sonard_client *client = sonard_connect(path, PATIENCE_S, &error);
    const char *result = sonard_call(client, "m", NULL, &error);

    CHECK(result && strcmp(result, "true") == 0);
    for (int i = 0; result && i < 3; i++) {
        const bool there = sonard_next(client, PATIENCE_S, &message, &error);
        CHECK(there && strcmp(message.json, want[i]) == 0);
        CHECK(there && message.id == 0 && message.watch == 4 && message.skipped == 0);
    }
    CHECK(sonard_next(client, PATIENCE_S, &message, &error) && !message.json && message.skipped == 7);
    CHECK_INT(message.refusal.rpc_code, -32600);
    CHECK(!sonard_next(client, 0, &message, &error));
    CHECK_INT(error.status, SONARD_SILENT);
    sonard_disconnect(client);
    stop(&peer);
}

TEST(what_cannot_be_said_is_not_sent)
{
    struct peer peer = {.stay = true};
    struct sonard_error error = {0};
    struct sonard_limit limit = {.speed_mps = 1};
    struct sonard_pose pose = {.has = SONARD_POSE_DEPTH, .depth_m = NAN};
    start(&peer);
    struct sonard_client *client = sonard_connect(path, PATIENCE_S, &error);
    static const char *const wrong[] = {"", "5", "[1]", "{\"a\":1", "{\"a\":1,\"a\":2}", "{} {}"};

    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        CHECK(!sonard_call(client, "m", wrong[i], &error));
        CHECK_INT(error.status, SONARD_INVALID);
    }
    CHECK(!sonard_call(client, "\xff", NULL, &error));
    CHECK_INT(error.status, SONARD_INVALID);
    CHECK(!sonard_limit(client, SONARD_BODY, (double[]){NAN, 0, 0}, &limit, &error));
    CHECK(error.status == SONARD_INVALID && limit.speed_mps == 0);
    CHECK(!sonard_send_pose(client, &pose, &error));
    CHECK_INT(error.status, SONARD_INVALID);
    CHECK_INT(sonard_events(client), POLLIN);
    sonard_disconnect(client);
    stop(&peer);
}

/* A peer that accepts but neither reads nor says anything. */
TEST(asking_without_waiting_never_waits)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    struct sonard_error error = {0};
    struct sonard_message message;
    static const char params[] = "{\"text\":\"0123456789012345678901234567890123456789\"}";
    int64_t last = 0;
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    const int listener = socket(AF_UNIX, SOCK_STREAM, 0);
    CHECK(bind(listener, (struct sockaddr *)&address, sizeof address) == 0 && listen(listener, 1) == 0);
    struct sonard_client *client = sonard_connect(path, 0, &error);
    CHECK(client != NULL);
    CHECK_INT(sonard_events(client), POLLIN);
    for (int64_t id; (id = sonard_send(client, "m", params, &error)) != 0; last = id)
        CHECK(id == last + 1 && id < 100000);
    CHECK(last > 700); /* 64 KiB of them at least */
    CHECK_INT(error.status, SONARD_SILENT);
    CHECK(strstr(error.message, "does not read requests"));
    CHECK_INT(sonard_events(client), POLLIN | POLLOUT);
    CHECK(!sonard_take(client, 0, &message, &error));
    CHECK_INT(error.status, SONARD_SILENT);

    /* It wakes up: what waited arrives whole and in order, and there is room again. */
    const int fd = accept(listener, NULL, NULL);
    FILE *in = fdopen(dup(fd), "r");
    char line[200], want[32];
    for (int64_t i = 1; i <= last; i++) {
        sonard_take(client, 0, &message, &error);
        CHECK(fgets(line, sizeof line, in) != NULL);
        snprintf(want, sizeof want, "\"id\":%lld}\n", (long long)i);
        CHECK(strstr(line, want) != NULL);
    }
    CHECK_INT(sonard_events(client), POLLIN);
    CHECK(sonard_send(client, "m", NULL, &error) == last + 1);

    static const char said[] = NOTE(1) "{\"result\":{\"x\":1},\"id\":7}\n"
                                       "{\"error\":{\"code\":-32602,\"message\":\"no\"},\"id\":8}\n";
    CHECK(write(fd, said, sizeof said - 1) == sizeof said - 1);
    CHECK(sonard_take(client, PATIENCE_S, &message, &error) && message.id == 0 && message.watch == 4);
    CHECK(sonard_take(client, PATIENCE_S, &message, &error) && message.id == 7 && message.json);
    CHECK(sonard_take(client, PATIENCE_S, &message, &error) && message.id == 8 && !message.json);
    CHECK(message.refusal.status == SONARD_REFUSED && message.refusal.rpc_code == -32602);
    CHECK_STR(message.refusal.message, "no");
    fclose(in);
    close(fd);
    CHECK(!sonard_take(client, PATIENCE_S, &message, &error));
    CHECK_INT(error.status, SONARD_LOST);
    sonard_disconnect(client);
    close(listener);
    unlink(path);
}

TEST(command_lines_become_parameters)
{
    static const struct argument common[] = {{"--json", "json", "", "", ARGUMENT_FLAG, 0, 0, 0},
                                             {"--socket", "socket", "PATH", "", ARGUMENT_TEXT, 0, 0, 0},
                                             {0}};
    static const struct argument own[] = {
        {"--distance", "distance_m", "D", "metres", ARGUMENT_NUMBER, 0, 0, 0},
        {"--count", "count", "N", "how many", ARGUMENT_INTEGER, 0, 0, 0},
        {"--elevation", "elevation_deg", "LO,HI", "degrees", ARGUMENT_NUMBERS, 2, 0, 0},
        {"--rate", "rate_hz", "HZ", "per second", ARGUMENT_NUMBER, 0, 0.1, 50},
        {"--id", "id", "N", "of the system", ARGUMENT_INTEGER, 0, 1, 255},
        {"-o", "output", "FILE", "file", ARGUMENT_TEXT, 0, 0, 0},
        {0}};
    static const struct {
        const char *argv[8];
        const char *want; /* options, a blank, the words; or the fault */
    } rows[] = {
        {{"c", "blocked", "30", "--distance", "5"}, "{\"distance_m\":5.0} 30"},
        {{"c", "--distance", "5", "blocked", "-30"}, "{\"distance_m\":5.0} -30"},
        {{"c", "--json", "blocked", "-.5", "--distance=-2e1"}, "{\"json\":true,\"distance_m\":-20.0} -.5"},
        {{"c", "--socket", "/x", "blocked", "--elevation", "-5,5"},
         "{\"socket\":\"/x\",\"elevation_deg\":[-5.0,5.0]}"},
        {{"c", "plot", "-o", "-"}, "{\"output\":\"-\"}"},
        {{"c", "--distance", "blocked", "5"},
         "--distance blocked: expected D, metres"}, /* then 5 is the command */
        {{"c", "call", "--", "--json"}, "{} --json"},
        {{"c", "blocked", "--distance"}, "--distance needs a value: D, metres"},
        {{"c", "blocked", "--distance", "5m"}, "--distance 5m: expected D as a plain number, such as 5: metres"},
        {{"c", "blocked", "--distance", "nan"}, "--distance nan: expected D, metres"},
        {{"c", "blocked", "--distance", ""}, "--distance : expected D, metres"},
        {{"c", "blocked", "--elevation", "5"}, "--elevation 5: expected LO,HI, degrees"},
        {{"c", "blocked", "--elevation", "5,6,7"}, "--elevation 5,6,7: expected LO,HI, degrees"},
        {{"c", "sectors", "--count", "2.5"}, "--count 2.5: expected N, how many"},
        {{"c", "sectors", "--count", "99999999999999999999"},
         "--count 99999999999999999999: expected N, how many"},
        {{"c", "sectors", "--count", " 2"}, "--count  2: expected N, how many"},
        {{"c", "blocked", "--distance", " 5"}, "--distance  5: expected D, metres"},
        {{"c", "blocked", "--distance", "0x10"}, "--distance 0x10: expected D, metres"},
        {{"c", "watch", "--rate", "0.1"}, "{\"rate_hz\":0.10000000000000001}"},
        {{"c", "watch", "--rate", "50.001"}, "--rate 50.001: expected a number from 0.1 to 50"},
        {{"c", "watch", "--rate", "0"}, "--rate 0: expected a number from 0.1 to 50"},
        {{"c", "watch", "--id", "255"}, "{\"id\":255}"},
        {{"c", "watch", "--id", "100000"}, "--id 100000: expected a whole number from 1 to 255"},
        {{"c", "watch", "--id", "1e5"}, "--id 1e5: expected N, of the system"},
        {{"c", "watch", "--id", "-1"}, "--id -1: expected a whole number from 1 to 255"},
        {{"c", "sectors", "--count", "1", "--count", "2"}, "--count is given twice"},
        {{"c", "sectors", "--cuont", "1"}, "no option --cuont; did you mean --count?"},
        {{"c", "sectors", "--json=yes"}, "option --json=yes takes no value"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char *argv[9], got[1024];
        struct fault fault = {""};
        struct arguments arguments;
        int argc = 0;
        for (; argc < 8 && rows[i].argv[argc]; argc++)
            argv[argc] = strdup(rows[i].argv[argc]);

        const int command = arguments_command(argc, argv);

        if (arguments_parse(&arguments, argc, argv, command, &(struct argument_tables){common, own}, &fault)) {
            char *options = json_dumps(arguments.options, JSON_COMPACT);
            snprintf(got, sizeof got, "%s%s%s", options, arguments.n_words ? " " : "",
                     arguments.n_words ? arguments.word[0] : "");
            free(options);
        } else {
            snprintf(got, sizeof got, "%s", fault.text);
        }
        CHECK_STR(got, rows[i].want);
        json_decref(arguments.options);
        while (argc > 0)
            free(argv[--argc]);
    }
}

static char *shown(const char *method, const char *result, bool colour)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    json_t *value = json_loads(result, JSON_DECODE_ANY, NULL);
    CHECK(value != NULL);
    show_result(out, method, value, colour);
    json_decref(value);
    fclose(out);
    return text;
}

TEST(results_are_readable)
{
    static const struct {
        const char *method, *result;
        bool colour;
        const char *want;
    } rows[] = {
        {"blocked",
         "{\"state\":\"blocked\",\"range_m\":3.416,\"range_sd_m\":0.05,\"confidence\":0.934,\"free_to_m\":3.2,"
         "\"blind_to_m\":0.75,\"age_s\":1.23,\"reason\":\"echo at 3.42 m\"}",
         false,
         "blocked: nearest obstacle at 3.42 m (sd 0.05 m, confidence 0.93)\n  free     0.75 m to 3.20 m\n  age    "
         "  1.2 "
         "s\n  because  echo at 3.42 m\n"},
        {"blocked",
         "{\"state\":\"clear\",\"range_m\":null,\"free_to_m\":9.128,\"blind_to_m\":0.201,\"age_s\":75,\"reason\":"
         "\"free up to 9.12 m\"}",
         true,
         "\033[32mclear\033[0m\n  free     0.21 m to 9.12 m\n  age      75 s\n  because  free up to 9.12 m\n"},
        {"blocked", "{\"state\":\"clear\",\"target\":\"wall\",\"bottom_db\":12}", false,
         "clear\n  free     - to -\n  age      -\n  because  -\n  free of  wall; bottoms down to 12 dB below a "
         "wall, not "
         "softer ones\n"},
        {"nearest", "{\"state\":\"clear\",\"target\":\"20 dB below a wall\",\"bottom_db\":null}", false,
         "clear\n  unknown  nan % of the directions before it\n  age      -\n  because  -\n  free of  20 dB below "
         "a "
         "wall; soft bottoms may be there\n"},
        {"blocked", "{\"state\":\"\\u001b[2J\\u009b\"}", false,
         "?[2J\xc2?\n  free     - to -\n  age      -\n  because  -\n"},
        {"version", "{\"version\":\"1.2\"}", false, "sonard 1.2\n"},
        {"other", "[1,\"x\"]", false, "[\n  1,\n  \"x\"\n]\n"},
        {"status", "7", false, "7\n"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char *text = shown(rows[i].method, rows[i].result, rows[i].colour);
        CHECK_STR(text, rows[i].want);
        free(text);
    }
}

/* Whoever sees a red ring is told where to read on. */
TEST(a_ring_that_is_blocked_all_around_names_the_page_about_it)
{
    char json[1024] = "{\"sectors\":[";
    for (int i = 0; i < 12; i++)
        snprintf(json + strlen(json), sizeof json - strlen(json), "%s{\"state\":\"%s\"}", i ? "," : "",
                 i < 9 ? "blocked" : "clear");
    strncat(json, "]}", sizeof json - strlen(json) - 1);
    char *text = shown("sectors", json, false);
    CHECK(strstr(text, "9 blocked, 3 clear, 0 unknown") && strstr(text, "everything-is-blocked.md"));
    free(text);
    memcpy(strstr(json, "blocked"), "unknown", 7);
    text = shown("sectors", json, false);
    CHECK(strstr(text, "8 blocked, 3 clear, 1 unknown") && !strstr(text, "everything-is-blocked.md"));
    free(text);
}

TEST(no_data_does_not_look_like_no_obstacle)
{
    char *text = shown("status", "{\"data\":\"no data from the sonar\"}", false);
    CHECK(strncmp(text, "data       no data from the sonar\n", 34) == 0);
    free(text);
    text = shown(
        "sectors",
        "{\"why_none_clear\":\"no ping was received\",\"sectors\":[{\"azimuth_deg\":0,\"state\":\"unknown\"}]}",
        false);
    CHECK(strstr(text, "0 blocked, 0 clear, 1 unknown: no ping was received\n"));
    free(text);
    text = shown("sectors", "{\"why_none_clear\":null,\"sectors\":[{\"state\":\"clear\"}]}", false);
    CHECK(strstr(text, "0 blocked, 1 clear, 0 unknown\n"));
    free(text);
}

int main(void)
{
    if (!mkdtemp(directory))
        return 1;
    snprintf(path, sizeof path, "%s/sonard.sock", directory);
    RUN(no_daemon_is_told_from_no_permission);
    RUN(every_kind_of_answer_has_its_status);
    RUN(notifications_are_kept_in_order);
    RUN(what_cannot_be_said_is_not_sent);
    RUN(asking_without_waiting_never_waits);
    RUN(command_lines_become_parameters);
    RUN(results_are_readable);
    RUN(a_ring_that_is_blocked_all_around_names_the_page_about_it);
    RUN(no_data_does_not_look_like_no_obstacle);
    rmdir(directory);
    return test_end();
}
