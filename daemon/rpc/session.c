/* SPDX-License-Identifier: MIT */
/*
 * session - see session.h. Every event ends in settle(), which alone decides what the session waits for next, or
 * that it is over. Nothing else frees it, so the functions before may use it to their end.
 */
#include "session.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#define IN_START_BYTES  4096
#define IN_MAX_BYTES    (RPC_LINE_MAX + 1)
#define OUT_PAUSE_BYTES 65536 /* waiting output from which no further request is handled ... */
#define OUT_MAX_BYTES   (OUT_PAUSE_BYTES + RPC_REPLY_MAX + 2 * RPC_LINE_MAX) /* ... plus the longest reply */
#define FLUSH_BYTES     (2 * OUT_PAUSE_BYTES)                                /* sent at a time, at least */
#define STUCK_NS        1000000000u /* who has read nothing for so long may be displaced */
#define TURN_NS         1000000u    /* work for all clients together in one turn of the loop */
#define REQUESTS_PER_S  2000.0
#define REQUESTS_BURST  2000.0
#define REQUEST_NS      250000.0  /* work that one request pays for: at 2000 a second, half of the loop's time */
#define REFILL_NS       10000000u /* longer than it must pauses a client that has used up its requests */

struct session {
    struct session_host *host;
    struct session **slot;
    struct loop_fd io;
    struct loop_timer wake;
    uint32_t events;    /* waited for at present; ... */
    uint64_t listen_ns; /* ... input since then */
    uint64_t empty_ns;  /* nothing was left to be read, then */
    uint64_t since_ns;  /* the lines in `in` ended after this */
    char *in;
    size_t in_len, in_size;
    struct rpc_job *job; /* the line before `in`, when its requests are not all handled */
    char *out;           /* bytes out_start..out_len are waiting */
    size_t out_start, out_len, out_size;
    double tokens;                   /* requests that may be handled now */
    uint64_t tokens_ns;              /* of the last refill */
    uint64_t progress_ns, active_ns; /* by patience_clock: it last took or needed no output; the last line began */
    uint64_t turn, spent_ns;         /* work done for it in that turn of the loop */
    int next_watch;                  /* asked first */
    bool left;                       /* more waited than the last read took */
    bool eof;                        /* the client sends no more */
    bool gone;                       /* nor does it read */
    bool closing;                    /* ends when the output is flushed */
    bool dead;                       /* ends now */
    bool working;                    /* on its requests and notifications */
    struct peer peer;
    bool kept;            /* never displaced */
    struct fault refusal; /* why it may not change anything; empty: it may */
    struct watch_set watches;
};

static size_t waiting(const struct session *session)
{
    return session->out_len - session->out_start;
}

/* Counts and tells it; who it was is for people, to find the program. */
static void tell_cut(struct session *session, uint64_t now_ns, const char *why)
{
    char who[PEER_WHO_SIZE];
    session->host->stats.clients_cut++;
    log_limited(now_ns, LOG_NOTICE, LOG_ABOUT(.event = "client_cut"), "client cut off (%s): %s",
                peer_who(&session->peer, who), why);
}

static void cut(struct session *session, uint64_t now_ns, const char *why)
{
    session->dead = true;
    tell_cut(session, now_ns, why);
}

/* Room for n more bytes behind the waiting ones. */
static bool reserve_out(struct session *session, size_t n)
{
    size_t size = session->out_size ? session->out_size : IN_START_BYTES;
    char *out;
    if (session->out_start > 0) {
        memmove(session->out, session->out + session->out_start, waiting(session));
        session->out_len -= session->out_start;
        session->out_start = 0;
    }
    while (size < session->out_len + n)
        size *= 2;
    if (size == session->out_size)
        return true;
    out = realloc(session->out, size);
    if (!out)
        return false;
    session->out = out;
    session->out_size = size;
    return true;
}

/* Takes over text; NULL (no memory for it) ends the client, which would otherwise wait for an answer for ever. A long
 * one, with nothing waiting before it, is not copied. */
static void queue(struct session *session, char *text, uint64_t now_ns)
{
    const size_t n = text ? strlen(text) + 1 : 0;
    if (n > OUT_PAUSE_BYTES && n <= OUT_MAX_BYTES && waiting(session) == 0) {
        free(session->out);
        session->out = text;
        session->out[n - 1] = '\n';
        session->out_start = 0;
        session->out_len = session->out_size = n;
        return;
    }
    if (!text)
        cut(session, now_ns, "out of memory");
    else if (waiting(session) + n > OUT_MAX_BYTES)
        cut(session, now_ns, "a line of more than 4 MiB for it");
    else if (session->out_size < session->out_len + n && !reserve_out(session, n))
        cut(session, now_ns, "out of memory");
    else {
        memcpy(session->out + session->out_len, text, n - 1);
        session->out[session->out_len + n - 1] = '\n';
        session->out_len += n;
    }
    free(text);
}

/* The time by which a client's patience is judged: a replay's clock runs ahead of clients, jumps, or stands. */
static uint64_t patience_clock(const struct session_host *host)
{
    return host->no_rate_limit ? host->clock() : loop_now(host->loop);
}

/* How long it may still leave its replies unread; 0: it is over. */
static uint64_t patience_left(const struct session *session)
{
    const uint64_t end_ns = session->progress_ns + session->host->client_timeout_ns,
                   now_ns = patience_clock(session->host);
    return end_ns > now_ns ? end_ns - now_ns : 0;
}

/* A client that reads as fast as it is written to must not hold the others up: what is left is for the next turn. */
static void flush(struct session *session)
{
    const size_t end = session->out_start + FLUSH_BYTES;
    while (!session->dead && waiting(session) > 0) {
        const ssize_t n =
            send(session->io.fd, session->out + session->out_start, waiting(session), MSG_NOSIGNAL | MSG_DONTWAIT);

        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0 && (errno == EAGAIN || errno == ENOBUFS))
            return;
        if (n < 0) {
            session->dead = true;
            return;
        }
        session->out_start += (size_t)n;
        session->progress_ns = patience_clock(session->host);
        if (session->out_start >= end && waiting(session) > 0)
            return;
    }
    session->progress_ns = patience_clock(session->host);
    session->out_start = session->out_len = 0;
    if (session->out_size > OUT_PAUSE_BYTES) {
        free(session->out);
        session->out = NULL;
        session->out_size = 0;
    }
}

/* A line is there, or one is not handled to its end. */
static bool line_waiting(const struct session *session)
{
    return session->job || (session->in_len > 0 && (session->eof || memchr(session->in, '\n', session->in_len)));
}

/* A notification is due, and can be worked on. */
static bool watch_waiting(const struct session *session)
{
    for (int i = 0; i < WATCH_MAX; i++) {
        const struct watch *watch = &session->watches.watch[i];
        if (watch->id != 0 && watch->late && !watch->work.waits)
            return true;
    }
    return false;
}

/* The line that is handled waits for others. */
static bool line_held(const struct session *session)
{
    return session->job && rpc_waits(session->job);
}

static bool may_handle(const struct session *session)
{
    return !session->dead && !session->closing && session->tokens >= 1.0 && waiting(session) < OUT_PAUSE_BYTES;
}

/* The clients share a turn, so that however many there are the sonars do not wait longer. */
static bool turn_over(const struct session *session)
{
    return session->spent_ns >= TURN_NS / session->host->stats.clients_now;
}

/* Takes the time since started_ns as work done for the client, which at least pays for what it begins. */
static void charge(struct session *session, uint64_t started_ns, bool begins)
{
    const uint64_t spent_ns = session->host->clock() - started_ns;
    const double requests = (double)spent_ns / REQUEST_NS;
    session->spent_ns += spent_ns;
    latency_add(&session->host->spent, spent_ns);
    if (!session->host->no_rate_limit)
        session->tokens -= begins && requests < 1.0 ? 1.0 : requests;
}

static void reply(struct session *session, uint64_t now_ns)
{
    char *text;
    if (!rpc_end(session->job, &text))
        cut(session, now_ns, "out of memory");
    else if (text)
        queue(session, text, now_ns);
    session->job = NULL;
}

/* Begins the line at in + *at and moves *at behind it; false when there is none. The last line of a client that
 * has ended needs no newline. */
static bool begin_line(struct session *session, const struct rpc_call *call, size_t *at)
{
    const char *line = session->in + *at;
    const size_t left = session->in_len - *at;
    const char *end = left > 0 ? memchr(line, '\n', left) : NULL;
    if (!end && (left == 0 || !session->eof))
        return false;

    const size_t n = end ? (size_t)(end - line) : left;

    session->job = rpc_begin(call, line, n);
    if (!session->job)
        cut(session, call->now_ns, "out of memory");
    *at += n + (end != NULL);
    session->active_ns = patience_clock(session->host);
    return session->job != NULL;
}

static void on_resume(void *client);

static void handle_lines(struct session *session, uint64_t now_ns)
{
    struct session_host *host = session->host;
    const struct rpc_call call = {.daemon = host->daemon,
                                  .client = session,
                                  .resume = on_resume,
                                  .now_ns = now_ns,
                                  .waited_ns = now_ns - session->since_ns,
                                  .refusal = session->refusal.text[0] ? session->refusal.text : NULL,
                                  .counts = &host->counts,
                                  .shared = &host->shared};
    size_t at = 0;
    while (may_handle(session) && !turn_over(session)) {
        const uint64_t started_ns = host->clock(), requests = host->counts.requests;
        const bool line_begins = !session->job;
        if (line_begins && !begin_line(session, &call, &at))
            break;
        if (!rpc_step(session->job, host->methods, &call))
            reply(session, now_ns);
        charge(session, started_ns, line_begins || host->counts.requests > requests);
        if (line_held(session))
            break;
    }
    memmove(session->in, session->in + at, session->in_len - at);
    session->in_len -= at;

    if (session->in_len == IN_MAX_BYTES && !line_waiting(session)) {
        queue(session, rpc_refusal("the line is longer than 65536 bytes"), now_ns);
        host->counts.errors++;
        tell_cut(session, now_ns, "a line longer than 65536 bytes");
        session->closing = true;
    }
}

/* Notifications only when nothing else waits for the client to read: what it gets is the newest. */
static void tell_watches(struct session *session, uint64_t now_ns)
{
    for (int n = 0; n < WATCH_MAX && may_handle(session) && waiting(session) == 0 && !turn_over(session);) {
        struct watch *watch = &session->watches.watch[session->next_watch];
        const uint64_t started_ns = session->host->clock();
        if (watch->id != 0 && watch->late) {
            const bool begins = !watch->started, unfinished = watch_write(watch, now_ns);
            if (!unfinished) {
                session->host->stats.notifications_skipped += watch_skipped(watch, now_ns);
                queue(session, watch_take(watch, now_ns), now_ns);
                session->host->stats.notifications_sent++;
                flush(session);
            }
            charge(session, started_ns, begins);
            if (unfinished && !watch->work.waits)
                continue;
        }
        session->next_watch = (session->next_watch + 1) % WATCH_MAX;
        n++;
    }
}

/* What was just read came since the descriptor was last seen not to be ready, if that was looked at, and since nothing
 * was left of the read before. */
static void note_arrival(struct session *session, bool left)
{
    const uint64_t seen_ns = loop_since(session->host->loop);
    session->since_ns = session->empty_ns;
    if (!session->left && seen_ns > session->listen_ns && seen_ns > session->empty_ns)
        session->since_ns = seen_ns;
    session->left = left;
    if (!left)
        session->empty_ns = loop_now(session->host->loop);
    loop_reread(session->host->loop);
}

static void receive(struct session *session)
{
    if (session->in_len == session->in_size) {
        const size_t size = 2 * session->in_size < IN_MAX_BYTES ? 2 * session->in_size : IN_MAX_BYTES;
        char *in = realloc(session->in, size);
        if (!in) {
            session->dead = true;
            return;
        }
        session->in = in;
        session->in_size = size;
    }

    const size_t room = session->in_size - session->in_len;
    const ssize_t n = recv(session->io.fd, session->in + session->in_len, room, 0);

    note_arrival(session, n == (ssize_t)room);
    if (n > 0)
        session->in_len += (size_t)n;
    else if (n == 0)
        session->eof = true;
    else if (errno != EAGAIN && errno != EINTR)
        session->dead = true;
}

static void end(struct session *session)
{
    struct session_host *host = session->host;
    const int fd = session->io.fd;
    char *unfinished = NULL;
    host->stats.notifications_skipped += session_skipped(session);
    watch_clear(&session->watches);
    if (session->job)
        rpc_end(session->job, &unfinished);
    free(unfinished);
    loop_arm(host->loop, &session->wake, LOOP_NEVER);
    loop_remove(host->loop, &session->io);
    host->stats.clients_now--;
    *session->slot = NULL;
    free(session->in);
    free(session->out);
    free(session);
    close(fd); /* last: a client that reads the end knows that nothing of it is left */
}

static bool is_over(const struct session *session)
{
    if (session->dead)
        return true;
    if (session->gone) /* what it sent before is still handled, unless that would have to wait */
        return line_waiting(session) ? !may_handle(session) || line_held(session) : session->eof;
    if (waiting(session) > 0)
        return false;
    return session->closing || (session->eof && !line_waiting(session) && !watch_any(&session->watches));
}

/* What it began goes on in the next turn, which comes when its socket can be written. That can be long after the last
 * reply went into the socket: a socket that is a quarter full says no more that it can be written. */
static bool has_next_turn(const struct session *session)
{
    struct pollfd socket = {.fd = session->io.fd, .events = POLLOUT};
    return poll(&socket, 1, 0) > 0;
}

/* Others ask the same, and wait for the answer that this client makes. They wait no more when it cannot go on, for it
 * leaves replies unread or has used up its requests; nor for a notification, when its lines come first. */
static void let_go(struct session *session)
{
    const bool goes_on = line_waiting(session) || watch_waiting(session);
    const bool held = !may_handle(session) || waiting(session) > 0 || (goes_on && !has_next_turn(session));
    if (held && session->job)
        rpc_let_go(session->job);
    if (held || (line_waiting(session) && !line_held(session)))
        watch_let_go(&session->watches);
}

static void settle_session(struct session *session, uint64_t now_ns)
{
    const bool lines = line_waiting(session) && !session->closing;
    uint64_t wake_ns = LOOP_NEVER;
    uint32_t events = 0;
    if (is_over(session)) {
        end(session);
        return;
    }
    let_go(session);
    if (!lines && !session->eof && !session->closing)
        events |= EPOLLIN;
    if (waiting(session) > 0) {
        events |= EPOLLOUT;
        wake_ns = now_ns + patience_left(session);
    } else if ((lines && !line_held(session)) || watch_waiting(session)) {
        if (session->tokens >= 1.0)
            events |= EPOLLOUT; /* can be written: that is the next turn */
        else
            wake_ns = now_ns + REFILL_NS + (uint64_t)((1.0 - session->tokens) * 1e9 / REQUESTS_PER_S);
    }
    loop_arm(session->host->loop, &session->wake, wake_ns);
    if (events != session->events)
        loop_change(session->host->loop, &session->io, events);
    if (events & ~session->events & EPOLLIN)
        session->listen_ns = loop_now(session->host->loop);
    session->events = events;
}

static void work(struct session *session, uint64_t now_ns)
{
    const uint64_t turn = loop_turns(session->host->loop);
    if (turn != session->turn)
        session->spent_ns = 0;
    session->turn = turn;
    session->tokens += (double)(now_ns - session->tokens_ns) * 1e-9 * REQUESTS_PER_S;
    if (session->tokens > REQUESTS_BURST)
        session->tokens = REQUESTS_BURST;
    session->tokens_ns = now_ns;

    session->working = true;
    flush(session);
    handle_lines(session, now_ns);
    flush(session);
    tell_watches(session, now_ns);
    session->working = false;
    settle_session(session, now_ns);
}

/* A request or a notification that waited goes on; one that is resumed by another of the same client does so next. */
static void on_resume(void *client)
{
    struct session *session = client;
    if (!session->working)
        work(session, loop_now(session->host->loop));
}

static void on_ready(void *ctx, uint32_t epoll_events, uint64_t now_ns)
{
    struct session *session = ctx;
    (void)now_ns;
    if (epoll_events & (EPOLLHUP | EPOLLERR))
        session->gone = true;
    if (!session->eof && !session->closing && !line_waiting(session))
        receive(session);
    work(session, loop_now(session->host->loop));
}

static void on_wake(void *ctx, uint64_t now_ns)
{
    struct session *session = ctx;
    if (waiting(session) > 0 && patience_left(session) == 0)
        cut(session, now_ns, "it does not read its replies");
    work(session, now_ns);
}

static bool on_watches_full(void *ctx, double share)
{
    const struct session *session = ctx;
    return session->host->make_room(session->host->server, session, share);
}

static void on_watch(void *ctx, uint64_t now_ns)
{
    struct session *session = ctx;
    if (waiting(session) == 0)
        work(session, now_ns); /* sends it, when the client may have it now */
}

bool session_open(struct session_host *host, int fd, struct session **slot)
{
    struct session *session = calloc(1, sizeof *session);
    char *in = malloc(IN_START_BYTES);
    const uint64_t now_ns = loop_now(host->loop);
    const int send_bytes = OUT_PAUSE_BYTES;
    if (!session || !in)
        goto fail;
    *session = (struct session){
        .host = host,
        .slot = slot,
        .io = {.fd = fd, .ready = on_ready, .ctx = session},
        .wake = {.fire = on_wake, .ctx = session},
        .events = EPOLLIN,
        .in = in,
        .in_size = IN_START_BYTES,
        .tokens = REQUESTS_BURST,
        .tokens_ns = now_ns,
        .listen_ns = now_ns,
        .empty_ns = loop_since(host->loop), /* it may have connected and sent then */
        .progress_ns = patience_clock(host),
        .active_ns = patience_clock(host),
        .watches = {.loop = host->loop,
                    .methods = host->methods,
                    .daemon = host->daemon,
                    .all = &host->watches,
                    .shared = &host->shared,
                    .due = on_watch,
                    .make_room = host->make_room ? on_watches_full : NULL,
                    .resume = on_resume,
                    .ctx = session},
    };
    peer_of(fd, &session->peer);
    if (!loop_add(host->loop, &session->io, EPOLLIN))
        goto fail;
    session_judge(session);
    /* What waits in the kernel for a slow reader is old news; keep it short. */
    setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &send_bytes, sizeof send_bytes);
    *slot = session;
    host->stats.clients_now++;
    host->stats.clients_total++;
    return true;
fail:
    free(in);
    free(session);
    close(fd);
    return false;
}

void session_close(struct session *session)
{
    if (session)
        end(session);
}

void session_judge(struct session *session)
{
    if (rights_judge(&session->host->rights, session->io.fd, &session->refusal))
        session->refusal.text[0] = '\0';
    session->watches.kept = session->refusal.text[0] == '\0';
}

uint64_t session_idle_since(const struct session *session, bool for_owner)
{
    const uint64_t now_ns = patience_clock(session->host);
    const bool is_owner = session->refusal.text[0] == '\0', stuck = waiting(session) > 0;
    const uint64_t since_ns = stuck ? session->progress_ns : session->active_ns;
    if ((is_owner && !for_owner) || (!stuck && (line_waiting(session) || watch_any(&session->watches))))
        return LOOP_NEVER;
    return now_ns - since_ns >= (stuck ? STUCK_NS : session->host->client_timeout_ns) ? since_ns : LOOP_NEVER;
}

const struct peer *session_peer(const struct session *session)
{
    return &session->peer;
}

void session_keep(struct session *session, bool kept)
{
    session->kept = kept;
}

bool session_is_kept(const struct session *session)
{
    return session->kept;
}

double session_watch_share(const struct session *session)
{
    return watch_share(&session->watches);
}

struct share session_share(const struct session *session, double amount)
{
    return (struct share){.peer = &session->peer,
                          .amount = amount,
                          .kept = session->kept || session->working,
                          .since_ns = session->active_ns};
}

void session_displace(struct session *session, const char *why)
{
    const uint64_t now_ns = loop_now(session->host->loop);
    tell_cut(session, now_ns, why);
    queue(session, rpc_refusal(why), now_ns);
    flush(session);
    end(session);
}

uint64_t session_skipped(const struct session *session)
{
    uint64_t skipped = 0;
    for (int i = 0; i < WATCH_MAX; i++)
        if (session->watches.watch[i].id != 0)
            skipped += watch_skipped(&session->watches.watch[i], loop_now(session->host->loop));
    return skipped;
}

void session_tell(struct session *session, const char *method)
{
    watch_due_now(&session->watches, method, loop_now(session->host->loop));
}

bool method_watch(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct session *session = call->client;
    return watch_add(&session->watches, params, call->now_ns, out, error);
}

bool method_unwatch(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct session *session = call->client;
    return watch_remove(&session->watches, params, out, error);
}
