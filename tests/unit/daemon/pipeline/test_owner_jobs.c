/* SPDX-License-Identifier: MIT */
/*
 * test_owner_jobs - what the maps' owner does for the loop while that goes on: each job once and in its turn, however
 * many there are, whoever has gone meanwhile, and none after the end.
 */
#include "tests/lib/held_owner.h"
#include "tests/lib/patience.h"
#include "tests/lib/plain_ping.h"
#include "tests/lib/test.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdatomic.h>
#include <sys/syscall.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "core/fault.h"
#include "core/loop.h"
#include "daemon/pipeline/pipeline.h"
#include "daemon/rpc/server.h"
#include "daemon/request_job.h"
#include "tests/lib/json_take.h"

#define MANY    500
#define CLIENTS 100

static struct loop *loop;
static struct pipeline *pipeline;
static struct request_jobs jobs;
static struct server *server;

static void begin(int threads)
{
    const struct pipeline_conf c = plain_pipeline(threads);
    struct fault fault = {""};
    loop = loop_new(false);
    pipeline = pipeline_new(&c, &fault);
    if (!pipeline || !request_jobs_start(&jobs, loop, pipeline, &fault)) {
        printf("%s\n", fault.text);
        exit(1);
    }
}

static void end(void)
{
    request_jobs_end(&jobs);
    pipeline_free(pipeline);
    loop_free(loop);
}

static void feed(void)
{
    pipeline_submit(pipeline, plain_ping(pipeline));
}

/* ---- jobs ---- */

/* What became of one. */
struct deed {
    struct owner_job call;
    atomic_int done; /* so often, ... */
    int turn;        /* ... the last time as the so manyeth of all */
    int released;
    enum { WANTED, DROPPED, LEFT } fate;
};

static atomic_int turns;

static void act(void *ctx, const struct pipeline_owned *owned)
{
    struct deed *deed = ctx;
    (void)owned;
    if (deed->call.pipeline == pipeline) /* of the owner meanwhile, as all that it lies in */
        deed->turn = atomic_fetch_add(&turns, 1);
    atomic_fetch_add(&deed->done, 1);
}

static void release(void *ctx)
{
    struct deed *deed = ctx;
    deed->released++;
}

static void turn_until_done(struct owner_job *last, pipeline_owner_fn *fn)
{
    bool done = false;
    TURN_UNTIL(loop, (done = owner_poll(pipeline, last, fn)));
    CHECK(done);
}

TEST(as_many_as_are_sent_are_done_in_their_order)
{
    static struct deed deed[MANY];
    begin(1);
    struct hold hold;
    hold_owner(&hold, pipeline);
    memset(deed, 0, sizeof deed);
    atomic_store(&turns, 0);
    for (int i = 0; i < MANY; i++)
        CHECK(!owner_poll(pipeline, &deed[i].call, act));
    for (int i = 0; i < MANY; i += 5)
        CHECK(!owner_poll(pipeline, &deed[i].call, act)); /* asked for, not sent anew */
    sem_post(&hold.go);
    turn_until_done(&deed[MANY - 1].call, act);
    for (int i = 0; i < MANY; i++) {
        CHECK_INT(deed[i].done, 1);
        CHECK_INT(deed[i].turn, i);
        CHECK(i == MANY - 1 || owner_poll(pipeline, &deed[i].call, act));
    }
    end();
}

/* Those that are dropped are not done unless they were started; those that are left are, and each is released once. */
TEST(who_goes_is_released_once)
{
    static struct deed deed[MANY], last;
    struct hold hold;
    uint64_t seed = 5;
    for (int threads = 1; threads <= 2; threads++) {
        begin(threads);
        hold_owner(&hold, pipeline);
        memset(deed, 0, sizeof deed);
        memset(&last, 0, sizeof last);
        for (int i = 0; i < MANY; i++)
            owner_poll(pipeline, &deed[i].call, act);
        for (int i = 0; i < MANY; i++) {
            const int at = (int)(test_random(&seed) % MANY);
            if (deed[at].fate != WANTED)
                continue;
            deed[at].fate = at % 2 ? DROPPED : LEFT;
            (at % 2 ? owner_job_drop : owner_job_leave)(&deed[at].call, release);
            CHECK_INT(deed[at].released, at % 2);
        }
        owner_poll(pipeline, &last.call, act);
        sem_post(&hold.go);
        for (int i = 0; i < 50; i++)
            feed();
        turn_until_done(&last.call, act);
        for (int i = 0; i < MANY; i++) {
            CHECK_INT(deed[i].done, deed[i].fate != DROPPED);
            CHECK_INT(deed[i].released, deed[i].fate != WANTED);
        }
        end();
    }
}

/* Sent, dropped and left while the owner works on them, again and again. */
TEST(any_mix_while_pings_come)
{
    static struct deed deed[20];
    uint64_t seed = 9;
    begin(2);
    memset(deed, 0, sizeof deed);
    for (int i = 0; i < 10; i++)
        deed[i].call.extracts = true;
    for (int i = 0; i < 20000; i++) {
        struct deed *one = &deed[test_random(&seed) % 20];
        const uint64_t what = test_random(&seed) % 8;
        const bool out = one->fate != WANTED && !one->released;
        if (!out && one->fate != WANTED)
            *one = (struct deed){.call.extracts = one - deed < 10};
        if (out || (what > 1 && owner_poll(pipeline, &one->call, act))) {
            CHECK(out || one->done > 0);
        } else if (what < 2) {
            one->fate = what ? DROPPED : LEFT;
            (what ? owner_job_drop : owner_job_leave)(&one->call, release);
        }
        if (i % 100 == 0)
            feed();
        if (i % 7 == 0)
            loop_turn(loop, 0);
    }
    for (int i = 0; i < 20; i++)
        if (deed[i].fate == WANTED)
            owner_job_leave(&deed[i].call, release);
    request_jobs_end(&jobs);
    for (int i = 0; i < 20; i++)
        CHECK_INT(deed[i].released, 1);
    pipeline_free(pipeline);
    loop_free(loop);
}

/* A job that is being done until the loop waits for it. */
static struct {
    struct hold hold;
    pthread_t loop_thread;
    int rests; /* of the loop until it is let go */
    atomic_bool done;
} busy;

/* In the place of the C library's: the loop rests between two looks at what it waits for. */
int nanosleep(const struct timespec *time, struct timespec *left)
{
    if (busy.rests > 0 && pthread_equal(pthread_self(), busy.loop_thread) && --busy.rests == 0)
        sem_post(&busy.hold.go);
    return (int)syscall(SYS_nanosleep, time, left);
}

static void take_time(void *ctx, const struct pipeline_owned *owned)
{
    hold_until_let_go(ctx, owned);
    atomic_store(&busy.done, true);
}

/* It is being done when this returns. */
static void start_busy(bool extracts)
{
    busy.hold = (struct hold){.call.extracts = extracts};
    sem_init(&busy.hold.started, 0, 0);
    sem_init(&busy.hold.go, 0, 0);
    atomic_store(&busy.done, false);
    CHECK(!owner_poll(pipeline, &busy.hold.call, take_time));
    while (sem_wait(&busy.hold.started) != 0) {
    }
    busy.loop_thread = pthread_self();
    busy.rests = 10;
}

/* The loop has waited for it, and did not let go before. */
static void check_busy(void)
{
    CHECK(busy.rests == 0 && atomic_load(&busy.done));
    if (busy.rests > 0)
        sem_post(&busy.hold.go);
    busy.rests = 0;
}

/* One is being done, one is the next, the others wait. */
TEST(at_the_end_none_is_being_done_and_none_begins)
{
    static struct deed deed[6];
    for (int early = 0; early < 2; early++) {
        int gone = 0;
        begin(2);
        memset(deed, 0, sizeof deed);
        start_busy(early);
        for (int i = 0; i < 6; i++) {
            deed[i].call.extracts = early;
            CHECK(!owner_poll(pipeline, &deed[i].call, act));
        }
        for (int i = 0; i < 6; i += 2)
            owner_job_leave(&deed[i].call, release);
        request_jobs_end(&jobs);
        check_busy();
        feed();
        pipeline_drain(pipeline);
        for (int i = 0; i < 6; i++) {
            CHECK_INT(deed[i].done, 0);
            gone += deed[i].released;
        }
        CHECK_INT(gone, 3);
        pipeline_free(pipeline);
        loop_free(loop);
    }
}

/* The thread that extracts does its own while the maps' owner is held. */
TEST(each_thread_has_its_own)
{
    struct deed deed = {.call.extracts = true};
    struct hold hold;
    begin(2);
    hold_owner(&hold, pipeline);
    CHECK(!owner_poll(pipeline, &deed.call, act));
    turn_until_done(&deed.call, act);
    CHECK_INT(deed.done, 1);
    sem_post(&hold.go);
    end();
}

#define STEPS 5

static void act_in_steps(void *ctx, const struct pipeline_owned *owned)
{
    struct deed *deed = ctx;
    act(ctx, owned);
    deed->call.more = deed->done < STEPS;
}

/* Pings come between the steps, other jobs do not; and the loop goes on, with its own thread as the owner, too. */
TEST(steps_of_one_are_done_before_the_next)
{
    for (int threads = 0; threads <= 2; threads++)
        for (int early = 0; early < 2; early++) {
            struct deed slow = {.call.extracts = early}, next = {.call.extracts = early}, none = {0};
            begin(threads);
            atomic_store(&turns, 0);
            CHECK(!owner_poll(pipeline, &slow.call, act_in_steps));
            CHECK(!owner_poll(pipeline, &next.call, act));
            feed();
            if (threads == 0)
                CHECK_INT(slow.done, 1);
            turn_until_done(&next.call, act);
            CHECK_INT(slow.done, STEPS);
            CHECK_INT(next.turn, STEPS);
            CHECK(owner_poll(pipeline, &slow.call, act_in_steps));
            CHECK(owner_poll(pipeline, &none.call, act) == (threads == 0)); /* nothing is left over */
            turn_until_done(&none.call, act);
            end();
        }
}

struct chain {
    struct owner_job call;
    struct deed *next;
};

static void do_nothing(void *ctx, const struct pipeline_owned *owned)
{
    (void)ctx;
    (void)owned;
}

static void send_deed(void *chain)
{
    struct deed *deed = ((struct chain *)chain)->next;
    owner_call(pipeline, &deed->call, act, release);
}

/* One that is sent when another has come back is not done before those that wait; nor where the loop does it itself. */
TEST(what_follows_from_one_comes_after_those_that_wait)
{
    for (int threads = 0; threads <= 2; threads++) {
        struct deed slow = {0}, waits = {0}, follows = {0};
        struct chain chain = {.next = &follows};
        begin(threads);
        atomic_store(&turns, 0);
        CHECK(!owner_poll(pipeline, &slow.call, act_in_steps));
        owner_call(pipeline, &chain.call, do_nothing, send_deed);
        CHECK(!owner_poll(pipeline, &waits.call, act));
        TURN_UNTIL(loop, follows.released);
        CHECK_INT(follows.released, 1);
        CHECK(waits.call.state == OWNER_JOB_DONE && waits.turn < follows.turn);
        end();
    }
}

static void act_without_end(void *ctx, const struct pipeline_owned *owned)
{
    struct deed *deed = ctx;
    act(ctx, owned);
    deed->call.more = true;
}

/* However many steps it would have. */
TEST(after_the_end_comes_no_step)
{
    struct deed endless = {0};
    begin(1);
    CHECK(!owner_poll(pipeline, &endless.call, act_without_end));
    WAIT_UNTIL(endless.done > 0);
    owner_job_leave(&endless.call, release);
    request_jobs_end(&jobs);
    CHECK(endless.released == 1 && endless.call.state == OWNER_JOB_NONE);
    const int steps = endless.done;
    CHECK(steps > 0);
    feed();
    pipeline_drain(pipeline);
    CHECK_INT(endless.done, steps);
    pipeline_free(pipeline);
    loop_free(loop);
}

static void visit(void *ctx, const struct pipeline_owned *owned)
{
    int *turn = ctx;
    (void)owned;
    *turn = atomic_fetch_add(&turns, 1);
}

/* Or a change could come between two visits that belong together. */
TEST(a_visit_comes_after_what_was_sent_before)
{
    begin(1);
    for (int i = 0; i < 200; i++) {
        struct deed deed = {0};
        int turn = -1;
        owner_poll(pipeline, &deed.call, act);
        owner_run_now(pipeline, visit, &turn);
        CHECK(deed.done == 1 && deed.turn == turn - 1);
        turn_until_done(&deed.call, act);
    }
    end();
}

/* ---- clients ---- */

static int questions, changes;

static void count(void *ctx, const struct pipeline_owned *owned)
{
    struct deed *deed = ctx;
    (void)owned;
    (*(deed->turn ? &changes : &questions))++; /* the owner's, while the loop does not look */
}

static bool counted(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    (void)error;
    return request_job_done(call, pipeline, count, counted) && json_out_take(out, json_true());
}

static bool by_job(const struct rpc_call *call, bool change, struct json_out *out, struct rpc_error *error)
{
    struct deed *deed;
    if (change && !request_job_room(pipeline, error))
        return false;
    deed = calloc(1, sizeof *deed);
    CHECK(deed != NULL);
    deed->turn = change;
    rpc_work_keep(call->work, deed, change ? request_job_leave : request_job_free);
    return counted(call, out, error);
}

static bool question(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params;
    return by_job(call, false, out, error);
}

static bool change(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params;
    return by_job(call, true, out, error);
}

static bool quick(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call, (void)params, (void)error;
    return json_out_take(out, json_true());
}

static const struct rpc_method methods[] = {{"question", question, RPC_ASKS, NULL},
                                            {"change", change, RPC_CHANGES, NULL},
                                            {"quick", quick, RPC_ASKS, NULL},
                                            {.name = NULL}};
static char folder[] = "/tmp/sonard-jobs-XXXXXX", path[64];

static void serve(void)
{
    const struct server_conf conf = {.path = path,
                                     .mode = 0600,
                                     .change = "all",
                                     .max_clients = CLIENTS,
                                     .client_timeout_ns = PATIENCE_NS,
                                     .no_rate_limit = true};
    struct fault fault;
    begin(2);
    server = server_start(loop, &conf, methods, NULL, &fault);
    CHECK(server != NULL);
    questions = changes = 0;
}

static void stop_serving(void)
{
    server_stop(server);
    end();
}

static void take_turns(int n)
{
    for (int i = 0; i < n; i++)
        loop_turn(loop, 0);
}

static int client(void)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    CHECK(connect(fd, (struct sockaddr *)&address, sizeof address) == 0);
    take_turns(1); /* only so many may wait to be taken in */
    return fd;
}

static void ask(int fd, const char *method, int id)
{
    char line[128];
    const int n = snprintf(line, sizeof line, "{\"jsonrpc\":\"2.0\",\"method\":\"%s\",\"id\":%d}\n", method, id);
    CHECK(write(fd, line, (size_t)n) == n);
}

/* What has come for it when the loop has answered so many lines. */
static void hear(int fd, int lines, char *text, size_t size)
{
    size_t used = 0;
    int heard = 0;
    for (const uint64_t start_ns = loop_clock(); heard < lines && loop_clock() - start_ns < PATIENCE_NS;) {
        const ssize_t n = read(fd, text + used, size - used - 1);
        for (ssize_t k = 0; k < n; k++)
            heard += text[used + (size_t)k] == '\n';
        used += n > 0 ? (size_t)n : 0;
        if (n <= 0)
            loop_turn(loop, 10000000);
    }
    text[used] = '\0';
}

TEST(many_clients_are_answered_each_in_its_order)
{
    static const char want[] = "{\"jsonrpc\":\"2.0\",\"result\":true,\"id\":1}\n"
                               "{\"jsonrpc\":\"2.0\",\"result\":true,\"id\":2}\n"
                               "{\"jsonrpc\":\"2.0\",\"result\":true,\"id\":3}\n"
                               "{\"jsonrpc\":\"2.0\",\"result\":true,\"id\":4}\n";
    struct hold hold;
    char text[512];
    int fd[CLIENTS];
    serve();
    hold_owner(&hold, pipeline);
    for (int i = 0; i < CLIENTS; i++) {
        fd[i] = client();
        ask(fd[i], i % 2 ? "change" : "question", 1);
        ask(fd[i], "quick", 2);
        ask(fd[i], i % 2 ? "question" : "change", 3);
        ask(fd[i], "quick", 4);
    }
    take_turns(50);
    for (int i = 0; i < CLIENTS; i++)
        CHECK(read(fd[i], text, sizeof text) < 0 && errno == EAGAIN); /* no quick one overtakes */
    sem_post(&hold.go);
    for (int i = 0; i < CLIENTS; i++) {
        hear(fd[i], 4, text, sizeof text);
        CHECK_STR(text, want);
        close(fd[i]);
    }
    CHECK(questions == CLIENTS && changes == CLIENTS);
    stop_serving();
}

/* What it wanted to know nobody wants to know any more; what it wanted to be done is done. */
TEST(a_client_that_has_gone_harms_nobody)
{
    struct hold hold;
    char text[512];
    serve();
    hold_owner(&hold, pipeline);
    const int asks = client(), changer = client(), stays = client();
    ask(asks, "question", 1);
    ask(changer, "change", 1);
    take_turns(20);
    close(asks);
    close(changer);
    take_turns(20);
    ask(stays, "question", 1);
    take_turns(20);
    sem_post(&hold.go);
    hear(stays, 1, text, sizeof text);
    CHECK_STR(text, "{\"jsonrpc\":\"2.0\",\"result\":true,\"id\":1}\n");
    CHECK(questions == 1 && changes == 1);
    close(stays);
    stop_serving();
}

/* So many changes are kept of clients who have gone; those who stay may go on asking meanwhile. */
TEST(clients_who_go_leave_only_so_many_changes)
{
    struct hold hold;
    char text[512];
    serve();
    hold_owner(&hold, pipeline);
    for (int i = 0; i < 2 * ORPHANED_JOBS_MAX; i++) {
        const int goes = client();
        ask(goes, "change", 1);
        take_turns(5);
        close(goes);
        take_turns(5);
    }
    CHECK_INT(owner_jobs_orphaned(pipeline), ORPHANED_JOBS_MAX);
    const int changer = client(), asks = client();
    ask(changer, "change", 1);
    hear(changer, 1, text, sizeof text);
    CHECK(strstr(text, "\"code\":-32000") && strstr(text, "orphaned changes are queued"));
    ask(asks, "question", 1);
    take_turns(5);
    sem_post(&hold.go);
    hear(asks, 1, text, sizeof text);
    CHECK_STR(text, "{\"jsonrpc\":\"2.0\",\"result\":true,\"id\":1}\n");
    CHECK(questions == 1 && changes == ORPHANED_JOBS_MAX);
    ask(changer, "change", 2);
    hear(changer, 1, text, sizeof text);
    CHECK_STR(text, "{\"jsonrpc\":\"2.0\",\"result\":true,\"id\":2}\n");
    close(changer);
    close(asks);
    stop_serving();
}

/* For whichever thread; who waits and what the daemon sends for itself does not count. */
TEST(what_nobody_waits_for_is_counted)
{
    static struct deed deed[8];
    struct hold hold, held_early = {.call.extracts = true};
    begin(2);
    hold_owner(&hold, pipeline);
    sem_init(&held_early.started, 0, 0);
    sem_init(&held_early.go, 0, 0);
    CHECK(!owner_poll(pipeline, &held_early.call, hold_until_let_go));
    memset(deed, 0, sizeof deed);
    for (int i = 0; i < 8; i++) {
        deed[i].call.extracts = i % 2;
        if (i < 2) {
            owner_call(pipeline, &deed[i].call, act, release);
            continue;
        }
        CHECK(!owner_poll(pipeline, &deed[i].call, act));
        if (i < 5)
            owner_job_leave(&deed[i].call, release);
    }
    CHECK_INT(owner_jobs_orphaned(pipeline), 3);
    sem_post(&hold.go);
    sem_post(&held_early.go);
    turn_until_done(&deed[6].call, act);
    turn_until_done(&deed[7].call, act);
    CHECK_INT(owner_jobs_orphaned(pipeline), 0);
    for (int i = 0; i < 8; i++)
        CHECK(deed[i].done == 1 && deed[i].released == (i < 5));
    end();
}

/* They are not answered, and what they have sent is freed. */
TEST(clients_wait_when_all_ends)
{
    int fd[3];
    serve();
    start_busy(false);
    for (int i = 0; i < 3; i++) {
        fd[i] = client();
        ask(fd[i], i ? "change" : "question", 1);
    }
    take_turns(20);
    stop_serving();
    check_busy();
    CHECK(questions == 0 && changes == 0);
    for (int i = 0; i < 3; i++)
        close(fd[i]);
}

int main(void)
{
    CHECK(mkdtemp(folder) != NULL);
    snprintf(path, sizeof path, "%s/socket", folder);
    RUN(as_many_as_are_sent_are_done_in_their_order);
    RUN(who_goes_is_released_once);
    RUN(any_mix_while_pings_come);
    RUN(at_the_end_none_is_being_done_and_none_begins);
    RUN(each_thread_has_its_own);
    RUN(steps_of_one_are_done_before_the_next);
    RUN(what_follows_from_one_comes_after_those_that_wait);
    RUN(after_the_end_comes_no_step);
    RUN(a_visit_comes_after_what_was_sent_before);
    RUN(many_clients_are_answered_each_in_its_order);
    RUN(a_client_that_has_gone_harms_nobody);
    RUN(clients_who_go_leave_only_so_many_changes);
    RUN(what_nobody_waits_for_is_counted);
    RUN(clients_wait_when_all_ends);
    CHECK_INT(rmdir(folder), 0);
    return test_end();
}
