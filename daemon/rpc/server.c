/* SPDX-License-Identifier: MIT */
#include "server.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "listen.h"
#include "core/log.h"
#include "peer.h"
#include "session.h"
#include "shares.h"

#define ACCEPTS_PER_TURN 16
#define KEPT_PER_PROGRAM 2            /* connections of a program for which places are kept: sonard-web has two */
#define LOOK_AGAIN_NS    10000000000u /* a user that was not there when names were looked up may be by now */
#define ACCEPT_PAUSE_NS  200000000u   /* without descriptors or memory: a listening socket stays ready meanwhile */

/* Names that the worker looks up: the user database may be on another machine.
 * It outlives a server that stops meanwhile. */
struct lookup {
    struct worker_job job;
    struct server *server; /* NULL: it has stopped */
    bool busy, again;      /* at the worker; what was set meanwhile comes after it */
    bool rights;           /* wanted as well as places */
    char change[RIGHTS_TEXT_MAX], keep[KEEP_TEXT_MAX];
    gid_t socket_group;
    struct rights found;
    struct keep kept;
};

struct server {
    struct session_host host;
    struct rpc_method *methods; /* the daemon's and the server's own */
    struct loop_fd listener;
    struct loop_timer resume;
    char *path;
    struct stat file; /* of the socket, to remove no other */
    bool inherited;
    struct worker *worker;
    struct lookup *lookup;        /* one at a time */
    char change[RIGHTS_TEXT_MAX]; /* who may change something, as it is set */
    char keep_text[KEEP_TEXT_MAX];
    struct keep keep;
    uint64_t looked_ns;   /* names were looked up last */
    struct share *shares; /* [n_slots], while they are compared */
    int max_clients, n_slots;
    struct session **sessions; /* [n_slots], NULL: free */
};

static struct session **idle_slot(struct server *server, bool for_owner)
{
    struct session **idlest = NULL;
    uint64_t since_ns = LOOP_NEVER;
    for (int i = 0; i < server->n_slots; i++) {
        const uint64_t idle_ns =
            server->sessions[i] ? session_idle_since(server->sessions[i], for_owner) : LOOP_NEVER;
        if (idle_ns < since_ns) {
            since_ns = idle_ns;
            idlest = &server->sessions[i];
        }
    }
    return idlest;
}

/* ---- shares ---- */

/* Is one more connection of this peer to be kept? Whom nobody named is known before any other is looked at, for each
 * is asked about whenever somebody may have to make room. */
static bool is_for_keeping(const struct server *server, const struct peer *peer)
{
    int kept = 0;
    if (!keep_has(&server->keep, peer))
        return false;
    for (int i = 0; i < server->n_slots && kept < KEPT_PER_PROGRAM; i++)
        if (server->sessions[i] && session_is_kept(server->sessions[i]))
            kept += peer_same_program(session_peer(server->sessions[i]), peer);
    return kept < KEPT_PER_PROGRAM;
}

static void keep_anew(struct server *server)
{
    for (int i = 0; i < server->n_slots; i++)
        if (server->sessions[i])
            session_keep(server->sessions[i], false);
    for (int i = 0; i < server->n_slots; i++)
        if (server->sessions[i])
            session_keep(server->sessions[i], is_for_keeping(server, session_peer(server->sessions[i])));
}

typedef double amount_fn(const struct session *session);

static double one_place(const struct session *session)
{
    (void)session;
    return 1;
}

/* The client that makes room for what is wanted, and was told why; the slot, which is free now. NULL: there is none. */
static struct session **displace(struct server *server, amount_fn *amount, const char *what,
                                 const struct share *wanted)
{
    char who[PEER_WHO_SIZE], why[2 * PEER_WHO_SIZE];
    int n = 0;
    keep_anew(server); /* of two that were kept one may have gone */
    for (int i = 0; i < server->n_slots; i++)
        if (server->sessions[i]) {
            server->shares[n] = session_share(server->sessions[i], amount(server->sessions[i]));
            server->shares[n++].slot = i;
        }
    const struct share *victim = shares_victim(server->shares, n, wanted);
    if (!victim)
        return NULL;
    struct session **slot = &server->sessions[victim->slot];
    snprintf(why, sizeof why, "its user or program has most %s, and makes room for %s", what,
             peer_who(wanted->peer, who));
    session_displace(*slot, why);
    return slot;
}

static bool make_watch_room(void *ctx, const struct session *session, double share)
{
    struct server *server = ctx;
    const struct share wanted = {.peer = session_peer(session), .amount = share, .kept = session_is_kept(session)};
    return displace(server, session_watch_share, "watches", &wanted) != NULL;
}

/* A place for the client, which may cost another its own: an idle one, or one of who has most. NULL: there is none. */
static struct session **slot_for(struct server *server, int fd, const struct peer *peer, bool kept)
{
    struct session **slot;
    struct fault why;
    if (server->host.stats.clients_now >= (uint64_t)server->max_clients) {
        const bool is_owner = rights_judge(&server->host.rights, fd, &why);
        if (!is_owner || server->host.stats.clients_now >= (uint64_t)server->n_slots) {
            slot = idle_slot(server, is_owner);
            if (slot)
                session_displace(*slot, "idle, and another client needed its place");
            return slot ? slot
                        : displace(server, one_place, "places",
                                   &(struct share){.peer = peer, .amount = 1, .kept = kept});
        }
    }
    for (int i = 0; i < server->n_slots; i++)
        if (!server->sessions[i])
            return &server->sessions[i];
    return NULL;
}

static void refuse_client(struct server *server, int fd, uint64_t now_ns)
{
    char message[64];
    char *line;
    snprintf(message, sizeof message, "at most %d clients are served at a time", server->max_clients);
    line = rpc_refusal(message);
    if (line && send(fd, line, strlen(line), MSG_NOSIGNAL) > 0)
        send(fd, "\n", 1, MSG_NOSIGNAL);
    free(line);
    close(fd);
    server->host.stats.clients_refused++;
    log_limited(now_ns, LOG_NOTICE, LOG_ABOUT(.event = "client_refused"), "client refused: %s", message);
}

static void look_up_names(struct server *server, bool rights);

/* False: what else waits to be accepted is for the next turn, for a place had to be found. */
static bool take_client(struct server *server, int fd, uint64_t now_ns)
{
    const bool full = server->host.stats.clients_now >= (uint64_t)server->max_clients;
    struct peer peer;
    peer_of(fd, &peer);
    if (server->keep.unknown && server->worker && now_ns >= server->looked_ns + LOOK_AGAIN_NS)
        look_up_names(server, false);
    const bool kept = is_for_keeping(server, &peer);
    struct session **slot = slot_for(server, fd, &peer, kept);

    if (!slot)
        refuse_client(server, fd, now_ns);
    else if (session_open(&server->host, fd, slot))
        session_keep(*slot, kept);
    else
        log_limited(now_ns, LOG_WARNING, LOG_ABOUT(.event = "client_failed"),
                    "cannot serve a client: out of memory");
    return !full;
}

static void resume_accepting(void *ctx, uint64_t now_ns)
{
    struct server *server = ctx;
    (void)now_ns;
    loop_change(server->host.loop, &server->listener, EPOLLIN);
}

static void on_connection(void *ctx, uint32_t epoll_events, uint64_t now_ns)
{
    struct server *server = ctx;
    (void)epoll_events;
    for (int i = 0; i < ACCEPTS_PER_TURN; i++) {
        const int fd = accept4(server->listener.fd, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);
        if (fd < 0 && (errno == EINTR || errno == ECONNABORTED))
            continue;
        if (fd < 0 && errno == EAGAIN)
            return;
        if (fd < 0) {
            log_limited(now_ns, LOG_WARNING, LOG_ABOUT(.event = "client_failed"), "cannot accept a client: %s",
                        strerror(errno));
            loop_change(server->host.loop, &server->listener, 0);
            loop_arm(server->host.loop, &server->resume, now_ns + ACCEPT_PAUSE_NS);
            return;
        }
        if (!take_client(server, fd, now_ns))
            return;
    }
}

/* methods and behind them watch and unwatch */
static struct rpc_method *add_own_methods(const struct rpc_method *methods)
{
    static const struct rpc_method own[] = {
        {"watch", method_watch, RPC_OWN, &protocol_methods[PROTOCOL_watch]},
        {"unwatch", method_unwatch, RPC_OWN, &protocol_methods[PROTOCOL_unwatch]},
        {.name = NULL}};
    struct rpc_method *all;
    size_t n = 0;
    while (methods[n].name)
        n++;
    all = malloc(n * sizeof *all + sizeof own);
    if (all) {
        memcpy(all, methods, n * sizeof *all);
        memcpy(all + n, own, sizeof own);
    }
    return all;
}

static void free_server(struct server *server)
{
    free(server->methods);
    free(server->sessions);
    free(server->shares);
    free(server->path);
    if (server->lookup && server->lookup->busy)
        server->lookup->server = NULL;
    else
        free(server->lookup);
    free(server);
}

/* The path that a listening socket is bound to; for free(). NULL without memory. */
static char *path_of(int fd)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    socklen_t length = sizeof address - 1; /* a path may come without its end */
    getsockname(fd, (struct sockaddr *)&address, &length);
    return strdup(address.sun_path);
}

/* Nobody's but this server's own. */
static void remove_file(const struct server *server)
{
    struct stat now;
    if (!server->inherited && lstat(server->path, &now) == 0 && now.st_dev == server->file.st_dev &&
        now.st_ino == server->file.st_ino)
        unlink(server->path);
}

static struct server *new_server(struct loop *loop, const struct server_conf *conf,
                                 const struct rpc_method *methods, void *daemon)
{
    struct server *server = calloc(1, sizeof *server);
    if (!server)
        return NULL;
    server->methods = add_own_methods(methods);
    server->inherited = conf->inherited_fd > 0;
    server->path = server->inherited ? path_of(conf->inherited_fd) : strdup(conf->path);
    server->max_clients = conf->max_clients;
    server->n_slots = conf->max_clients + conf->kept_clients;
    server->worker = conf->worker;
    server->lookup = calloc(1, sizeof *server->lookup);
    server->sessions = calloc((size_t)server->n_slots, sizeof *server->sessions);
    server->shares = calloc((size_t)server->n_slots, sizeof *server->shares);
    server->host = (struct session_host){.loop = loop,
                                         .methods = server->methods,
                                         .daemon = daemon,
                                         .no_rate_limit = conf->no_rate_limit,
                                         .client_timeout_ns = conf->client_timeout_ns,
                                         .clock = conf->clock ? conf->clock : loop_clock,
                                         .make_room = make_watch_room,
                                         .server = server,
                                         .shared = {.loop = loop, .pings = conf->pings, .daemon = daemon}};
    server->listener = (struct loop_fd){.ready = on_connection, .ctx = server};
    server->resume = (struct loop_timer){.fire = resume_accepting, .ctx = server};
    if (!server->methods || !server->path || !server->sessions || !server->shares || !server->lookup) {
        free_server(server);
        return NULL;
    }
    return server;
}

static void take_rights(struct server *server, const struct rights *rights)
{
    const bool known = strcmp(server->host.rights.unknown, rights->unknown) == 0;
    server->host.rights = *rights;
    if (rights->unknown[0] && !known)
        log_line(LOG_WARNING, "right_unknown", "[server] change: there is %s here: that gives nobody a right",
                 rights->unknown);
    for (int i = 0; i < server->n_slots; i++)
        if (server->sessions[i])
            session_judge(server->sessions[i]);
}

struct server *server_start(struct loop *loop, const struct server_conf *conf, const struct rpc_method *methods,
                            void *daemon, struct fault *fault)
{
    struct server *server = new_server(loop, conf, methods, daemon);
    if (!server) {
        fault_set(fault, "socket %s: out of memory", conf->path);
        return NULL;
    }
    server->listener.fd = server->inherited ? conf->inherited_fd : listen_unix(server->path, conf->mode, fault);
    if (server->listener.fd < 0) {
        free_server(server);
        return NULL;
    }
    if (lstat(server->path, &server->file) < 0 || !loop_add(loop, &server->listener, EPOLLIN)) {
        fault_set(fault, "socket %s: %s", server->path, strerror(errno));
        close(server->listener.fd);
        remove_file(server);
        free_server(server);
        return NULL;
    }
    snprintf(server->change, sizeof server->change, "%s", conf->change ? conf->change : "");
    *server->lookup = (struct lookup){.server = server, .socket_group = server->file.st_gid};
    struct rights rights;
    snprintf(server->keep_text, sizeof server->keep_text, "%s", conf->keep ? conf->keep : "");
    keep_set(&server->keep, server->keep_text, true);
    rights_set(&rights, server->change, server->file.st_gid); /* nobody is served yet, and may wait for it */
    take_rights(server, &rights);
    return server;
}

static void look_up(void *ctx)
{
    struct lookup *l = ctx;
    if (l->rights)
        rights_set(&l->found, l->change, l->socket_group);
    keep_set(&l->kept, l->keep, true);
}

static void on_looked_up(void *ctx)
{
    struct lookup *l = ctx;
    l->busy = false;
    if (!l->server)
        free(l);
    else if (l->again)
        look_up_names(l->server, true);
    else {
        if (l->rights)
            take_rights(l->server, &l->found);
        l->server->keep = l->kept;
        keep_anew(l->server);
    }
}

/* Rights only when they were set: a user database that is away for a while takes nobody's. */
static void look_up_names(struct server *server, bool rights)
{
    struct lookup *l = server->lookup;
    l->again = l->again || (l->busy && rights);
    if (l->busy)
        return;
    l->again = false;
    l->busy = true;
    l->rights = rights;
    memcpy(l->change, server->change, sizeof l->change);
    memcpy(l->keep, server->keep_text, sizeof l->keep);
    server->looked_ns = loop_now(server->host.loop);
    worker_run(server->worker, &l->job, look_up, on_looked_up, l);
}

static void set_keep(struct server *server, const char *keep)
{
    if (strcmp(keep, server->keep_text) == 0)
        return;
    snprintf(server->keep_text, sizeof server->keep_text, "%s", keep);
    keep_set(&server->keep, keep, false);
    keep_anew(server);
}

/* Until names are looked up they give nobody a right, unless nothing has changed. */
void server_set_names(struct server *server, const char *change, const char *keep)
{
    struct rights known;
    const bool complete = rights_set_numbers(&known, change, server->file.st_gid);
    const bool same = strcmp(change, server->change) == 0;
    known.unknown[0] = '\0'; /* that is to be found out */
    if (complete || !same)
        take_rights(server, &known);
    snprintf(server->change, sizeof server->change, "%s", change);
    set_keep(server, keep);
    if (!complete || server->keep.unknown || server->lookup->busy)
        look_up_names(server, true);
}

const char *server_path(const struct server *server)
{
    return server->path;
}

void server_stop(struct server *server)
{
    if (!server)
        return;
    for (int i = 0; i < server->n_slots; i++)
        session_close(server->sessions[i]);
    shared_end(&server->host.shared);
    loop_arm(server->host.loop, &server->resume, LOOP_NEVER);
    loop_remove(server->host.loop, &server->listener);
    remove_file(server);
    close(server->listener.fd);
    free_server(server);
}

void server_tell(struct server *server, const char *method)
{
    for (int i = 0; i < server->n_slots; i++)
        if (server->sessions[i])
            session_tell(server->sessions[i], method);
}

void server_stats(const struct server *server, struct server_stats *out)
{
    *out = server->host.stats;
    out->requests = server->host.counts.requests;
    out->errors = server->host.counts.errors;
    for (int i = 0; i < server->n_slots; i++)
        if (server->sessions[i])
            out->notifications_skipped += session_skipped(server->sessions[i]);
}

struct latency *server_latency(struct server *server)
{
    return &server->host.spent;
}
