/* SPDX-License-Identifier: MIT */
#include "replay.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../drivers/candump.h"
#include "../drivers/mcap.h"
#include "instruments.h"
#include "log.h"

/* Clients are served so often in a replay that runs as fast as it goes. */
#define MESSAGES_PER_TURN 64

/* In a paced one the clock moves on at least so often: watches fire by it. */
#define PACE_NS 20000000u

/* A longer silence is skipped: the clock jumps. */
#define GAP_NS 60000000000u

/* What calls itself later than the year 2262 is no time; so sums of times do not overflow. */
#define TIME_MAX_NS ((uint64_t)INT64_MAX)

struct message {
    const char *topic; /* "/NAME/rx"; of a CAN log the port's address, "can:can0" */
    uint64_t log_ns;
    const uint8_t *data;
    size_t size;
};

struct replay {
    struct mcap_reader *reader; /* NULL: a CAN log */
    struct candump *log;
    struct candump_frame frame;
    char address[sizeof "can:" + IFNAMSIZ]; /* of that frame */
    struct message next;
    bool has_next;
    uint64_t skipped_ns; /* gaps, together */
    uint64_t unknown;    /* messages on channels that no configured sensor has */
};

static void on_problem(void *ctx, const char *sentence)
{
    (void)ctx;
    log_limited(loop_clock(), LOG_WARNING, LOG_ABOUT(.event = "capture_damaged"), "capture: %s", sentence);
}

static bool next_of_capture(struct replay *r)
{
    struct mcap_message m;
    if (!mcap_next(r->reader, &m))
        return false;
    r->next.topic = m.channel->topic;
    r->next.log_ns = m.log_ns;
    r->next.data = m.data;
    r->next.size = m.size;
    return true;
}

static bool next_of_log(struct replay *r)
{
    if (!candump_next(r->log, &r->frame))
        return false;
    snprintf(r->address, sizeof r->address, "can:%s", r->frame.name);
    r->next.topic = r->address;
    r->next.log_ns = r->frame.t_ns;
    r->next.data = (const uint8_t *)&r->frame.frame;
    r->next.size = r->frame.n;
    return true;
}

static void take_next(struct replay *r)
{
    while ((r->has_next = r->reader ? next_of_capture(r) : next_of_log(r)) && r->next.log_ns > TIME_MAX_NS)
        on_problem(r, "a message from after the year 2262 is left out");
}

/* A capture, or else a CAN log. */
static bool open_file(struct replay *r, const char *path, char *err, size_t err_size)
{
    char why[256];
    if (access(path, R_OK) != 0) {
        snprintf(err, err_size, "%s: %s", path, strerror(errno));
        return false;
    }
    r->reader = mcap_open(path, on_problem, r, err, err_size);
    if (!r->reader)
        r->log = candump_open(path, why, sizeof why);
    if (r->reader || r->log)
        return true;
    size_t used = strlen(err);
    snprintf(err + used, err_size - used, "; nor a CAN log: %s", why);
    return false;
}

struct replay *replay_open(const char *path, char *err, size_t err_size)
{
    struct replay *r = calloc(1, sizeof *r);
    if (!r) {
        snprintf(err, err_size, "out of memory");
        return NULL;
    }
    if (!open_file(r, path, err, err_size)) {
        free(r);
        return NULL;
    }
    take_next(r);
    return r;
}

const char *replay_conf(struct replay *r, size_t *size, char *err, size_t err_size)
{
    struct mcap_attachment a;
    if (!r->reader) {
        snprintf(err, err_size, "a CAN log holds no configuration");
        return NULL;
    }
    if (!mcap_find_attachment(r->reader, "sonard.conf", &a, err, err_size))
        return NULL;
    *size = a.size;
    return (const char *)a.data;
}

uint64_t replay_start(struct replay *r)
{
    return r->has_next ? r->next.log_ns : 0;
}

/* The port of that sonar read the next message; on a bus that may be several. */
static bool is_for(const struct replay *r, const struct daemon *d, int sonar)
{
    const char *name = d->conf.sonar[sonar].name, *topic = r->next.topic;
    size_t n = strlen(name);
    if (r->log)
        return strcmp(topic, d->conf.sonar[sonar].port) == 0;
    return topic[0] == '/' && strncmp(topic + 1, name, n) == 0 && strcmp(topic + 1 + n, "/rx") == 0;
}

static void take_pose(struct replay *r, struct daemon *d)
{
    struct rpc_error error = {0};
    json_error_t fault;
    json_t *params = json_loadb((const char *)r->next.data, r->next.size, 0, &fault);
    if (!json_is_object(params))
        snprintf(error.message, sizeof error.message, "not a JSON object");
    else
        daemon_take_pose(d, params, &error);
    if (error.message[0])
        log_limited(loop_now(d->loop), LOG_WARNING, LOG_ABOUT(.event = "capture_pose"), "capture: /pose: %s",
                    error.message);
    json_decref(params);
}

static void deliver(struct replay *r, struct daemon *d)
{
    const char *topic = r->next.topic;
    size_t n = strlen(topic);
    bool known = false;
    for (int i = 0; i < d->conf.n_sonars; i++) {
        if (!is_for(r, d, i))
            continue;
        source_feed(d->source[i], r->next.data, r->next.size);
        known = true;
    }
    if (known)
        return;
    if (strcmp(topic, "/pose") == 0)
        take_pose(r, d);
    else if (!instruments_feed(d, topic, r->next.data, r->next.size) &&
             (n < 3 || strcmp(topic + n - 3, "/tx") != 0))
        r->unknown++;
}

/* Nobody wants to wait for what lies between two dives, nor see watches fire all through it. */
static void skip_gap(struct replay *r, struct daemon *d)
{
    uint64_t now = loop_now(d->loop);
    if (!r->has_next || r->next.log_ns <= now || r->next.log_ns - now <= GAP_NS)
        return;
    r->skipped_ns += r->next.log_ns - now;
    log_limited(loop_clock(), LOG_NOTICE, LOG_ABOUT(.event = "capture_gap"),
                "capture: %.0f s without a message are skipped", (double)(r->next.log_ns - now) * 1e-9);
    loop_skip(d->loop, r->next.log_ns);
}

/* Plays what is due at t_ns; false when nothing is left. */
static bool play_until(struct replay *r, struct daemon *d, uint64_t t_ns, int most)
{
    while (r->has_next && r->next.log_ns <= t_ns && most-- > 0) {
        loop_advance(d->loop, r->next.log_ns);
        deliver(r, d);
        take_next(r);
        skip_gap(r, d);
    }
    return r->has_next;
}

/* One turn of the loop; returns false when nothing is left. Advancing the clock only to what has been played keeps
 * the timers in step with the bytes. */
static bool turn(struct replay *r, struct daemon *d, uint64_t until, uint64_t wait_ns, bool *running)
{
    bool more = play_until(r, d, until, MESSAGES_PER_TURN);
    if (more && r->next.log_ns > until)
        loop_advance(d->loop, until);
    *running = loop_turn(d->loop, wait_ns);
    return more;
}

static uint64_t whole_ns(double ns)
{
    return ns < (double)TIME_MAX_NS ? (uint64_t)ns : TIME_MAX_NS;
}

bool replay_run(struct replay *r, struct daemon *d, double speed)
{
    uint64_t real_start = loop_clock(), start = loop_now(d->loop);
    bool more = r->has_next, running = true;
    while (more && running) {
        uint64_t until = LOOP_NEVER, wait_ns = 0;
        if (speed > 0) {
            until = start + r->skipped_ns + whole_ns((double)(loop_clock() - real_start) * speed);
            if (r->next.log_ns > until)
                wait_ns = whole_ns((double)(r->next.log_ns - until) / speed);
        }
        more = turn(r, d, until, wait_ns < PACE_NS ? wait_ns : PACE_NS, &running);
    }
    pipeline_drain(d->pipeline);
    if (r->unknown)
        log_counted(LOG_WARNING, "capture_unknown", r->unknown,
                    "capture: %llu messages on %s that no configured sonar has", (unsigned long long)r->unknown,
                    r->log ? "CAN interfaces" : "channels");
    if (r->log && candump_left_out(r->log))
        log_counted(LOG_WARNING, "capture_damaged", candump_left_out(r->log),
                    "capture: %llu lines are no frames and were left out",
                    (unsigned long long)candump_left_out(r->log));
    return running;
}

void replay_close(struct replay *r)
{
    if (!r)
        return;
    mcap_close(r->reader);
    candump_close(r->log);
    free(r);
}
