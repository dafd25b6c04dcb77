/* SPDX-License-Identifier: MIT */
#include "replay.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/capture/candump.h"
#include "drivers/capture/mcap.h"
#include "core/log.h"

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
    uint64_t since_ns; /* it came after this: its publish time */
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
    const char *path;
    bool quiet;                     /* damage is not logged */
    uint64_t start_ns, end_ns;      /* of the first message, and of the last; end 0: not looked for */
    uint64_t paced_ns, paced_at_ns; /* the clock when pacing began, and loop_clock then */
    double speed;                   /* 0: not paced */
    bool paused, jumping, again;    /* again: from the start, because the jump leads back */
    uint64_t jump_ns;               /* to there */
    uint64_t played;                /* messages that something took */
    uint64_t unknown;               /* messages on channels that no configured sensor has */
    char stranger[128];             /* one of them, where a sonar spoke; empty: none */
};

/* "/front/events" of the sonar "front"? */
static bool is_topic_of(const char *topic, const char *sonar, const char *kind)
{
    const size_t n = strlen(sonar);
    return topic[0] == '/' && strncmp(topic + 1, sonar, n) == 0 && strcmp(topic + 1 + n, kind) == 0;
}

static uint64_t whole_ns(double ns)
{
    return ns < (double)TIME_MAX_NS ? (uint64_t)ns : TIME_MAX_NS;
}

static void on_problem(void *ctx, const char *sentence)
{
    const struct replay *r = ctx;
    if (!r->quiet)
        log_limited(loop_clock(), LOG_WARNING, LOG_ABOUT(.event = "capture_damaged"), "capture: %s", sentence);
}

static bool next_of_capture(struct replay *r)
{
    struct mcap_message m;
    if (!mcap_next(r->reader, &m))
        return false;
    r->next.topic = m.channel->topic;
    r->next.log_ns = m.log_ns;
    r->next.since_ns = m.publish_ns;
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
    r->next.log_ns = r->next.since_ns = r->frame.t_ns;
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
static bool open_file(struct replay *r, const char *path, struct fault *fault)
{
    struct fault why;
    struct stat st;
    if (access(path, R_OK) != 0 || stat(path, &st) != 0)
        return fault_set(fault, "%s: %s", path, strerror(errno));
    if (!S_ISREG(st.st_mode))
        return fault_set(fault, "%s: not a file; expected a capture, as /var/lib/sonard/captures/NAME.mcap", path);
    r->reader = mcap_open(path, on_problem, r, fault);
    if (!r->reader)
        r->log = candump_open(path, &why);
    if (r->reader || r->log)
        return true;
    if (strcmp(fault->text, why.text) == 0) /* it could not be read as either, for the same reason */
        return false;
    return fault_add(fault, "; not a CAN log, either: no line of it is a frame as `candump -L` writes it. A "
                            "recording of another program becomes a capture with `sonarctl capture import`, a ROS "
                            "bag with `sonard-rosbag`");
}

struct replay *replay_open(const char *path, double speed, struct fault *fault)
{
    struct replay *r = calloc(1, sizeof *r);
    if (!r) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    if (!open_file(r, path, fault)) {
        free(r);
        return NULL;
    }
    if (r->log && candump_has_differences(r->log))
        log_line(LOG_NOTICE, "capture_differences",
                 "capture: the times are differences, as `candump -td` writes them: added up");
    take_next(r);
    r->path = path;
    r->speed = speed;
    r->start_ns = r->has_next ? r->next.log_ns : 0;
    return r;
}

static void close_file(struct replay *r)
{
    mcap_close(r->reader);
    candump_close(r->log);
}

/* The greatest time of all messages, by reading them. */
static uint64_t read_through(struct replay *r)
{
    uint64_t end_ns = 0;
    for (take_next(r); r->has_next; take_next(r))
        if (r->next.log_ns > end_ns)
            end_ns = r->next.log_ns;
    return end_ns;
}

void replay_measure(struct replay *r)
{
    struct replay other = {.quiet = true};
    struct fault fault;
    r->end_ns = r->start_ns;
    if (!open_file(&other, r->path, &fault))
        return;
    uint64_t end_ns;
    if (!other.reader || !mcap_summary_end(other.reader, &end_ns) || end_ns > TIME_MAX_NS)
        end_ns = read_through(&other);
    if (end_ns > r->end_ns)
        r->end_ns = end_ns;
    close_file(&other);
}

bool replay_leads_back(const struct replay *r)
{
    return r->again;
}

bool replay_again(struct replay *r, struct fault *fault)
{
    fault->text[0] = '\0';
    if (!r->again)
        return false;
    close_file(r);
    r->reader = NULL;
    r->log = NULL;
    r->again = false;
    r->played = r->unknown = 0;
    r->stranger[0] = '\0';
    if (!open_file(r, r->path, fault))
        return false;
    take_next(r);
    r->jumping = true;
    return true;
}

/* Does the capture have a channel of a sonar? */
static bool has_sonar(const struct replay *r)
{
    const struct mcap_channel *c;
    for (size_t i = 0; (c = mcap_channel_at(r->reader, i)) != NULL; i++) {
        const size_t n = strlen(c->topic);
        if (n > 3 && strcmp(c->topic + n - 3, "/rx") == 0)
            return true;
    }
    return false;
}

const char *replay_conf(struct replay *r, size_t *size, struct fault *fault)
{
    struct mcap_attachment a;
    if (!r->reader) {
        fault_set(fault, "a CAN log holds no configuration");
        return NULL;
    }
    if (!mcap_find_attachment(r->reader, "sonard.conf", &a, fault)) {
        if (r->has_next && !has_sonar(r))
            fault_add(fault, ", and no channel of a sonar: a file of another program becomes a capture with "
                             "`sonarctl capture import`");
        return NULL;
    }
    *size = a.size;
    return (const char *)a.data;
}

bool replay_has_line(const struct replay *r, const char *sonar)
{
    const struct mcap_channel *c;
    char topic[CONF_NAME_MAX + 8];
    snprintf(topic, sizeof topic, "/%s/rx", sonar);
    for (size_t i = 0; r->reader && (c = mcap_channel_at(r->reader, i)) != NULL; i++)
        for (size_t k = 0; strcmp(c->topic, topic) == 0 && k < c->n_metadata; k++)
            if (strcmp(c->metadata[k].key, "line") == 0 && strcmp(c->metadata[k].value, "none") == 0)
                return false;
    return true;
}

uint64_t replay_told(const struct replay *r, const struct conf *conf)
{
    const struct mcap_channel *c;
    uint64_t told = 0;
    for (size_t i = 0; r->reader && (c = mcap_channel_at(r->reader, i)) != NULL; i++)
        for (int k = 0; k < conf->n_sonars; k++)
            told |= (uint64_t)is_topic_of(c->topic, conf->sonar[k].name, "/events") << k;
    return told;
}

uint64_t replay_start(struct replay *r)
{
    return r->has_next ? r->next.log_ns : 0;
}

static void start_pace(struct replay *r, const struct loop *loop)
{
    r->paced_ns = loop_now(loop);
    r->paced_at_ns = loop_clock();
}

void replay_state(const struct replay *r, const struct loop *loop, struct replay_state *out)
{
    *out = (struct replay_state){
        .length_s = r->end_ns ? (double)(r->end_ns - r->start_ns) * 1e-9 : -1,
        .position_s = (double)(loop_now(loop) - r->start_ns) * 1e-9,
        .speed = r->speed,
        .paused = r->paused,
        .jumping = r->jumping,
    };
}

void replay_pace(struct replay *r, const struct loop *loop, double speed, bool paused)
{
    r->speed = speed;
    r->paused = paused;
    start_pace(r, loop);
}

void replay_jump(struct replay *r, struct loop *loop, double to_s)
{
    r->jump_ns = r->start_ns + whole_ns(to_s * 1e9);
    r->again |= r->jump_ns < loop_now(loop); /* after one that leads back, this one goes on from the start */
    r->jumping = r->has_next || r->again;
    if (r->again)
        loop_quit(loop);
}

/* The port of that sonar read the next message; on a bus that may be several. */
static bool is_for(const struct replay *r, const struct replay_env *env, int sonar)
{
    if (r->log)
        return strcmp(r->next.topic, env->conf->sonar[sonar].port) == 0;
    return is_topic_of(r->next.topic, env->conf->sonar[sonar].name, "/rx");
}

static void doubt_message(const struct replay *r, const struct replay_env *env, const char *event,
                          const struct fault *fault)
{
    log_limited(loop_now(env->loop), LOG_WARNING, LOG_ABOUT(.event = event), "capture: %s: %s", r->next.topic,
                fault->text);
}

/* What is neither bytes nor an auxiliary sensor's. False: nothing that is known. */
static bool take_text(struct replay *r, const struct replay_env *env)
{
    const char *topic = r->next.topic;
    struct fault fault;
    if (strcmp(topic, "/pose") == 0) {
        if (!env->pose(env->ctx, r->next.data, r->next.size, &fault))
            doubt_message(r, env, "capture_pose", &fault);
    } else if (strcmp(topic, RECORD_CONF_TOPIC) == 0) {
        if (!env->reload(env->ctx, r->next.data, r->next.size, &fault))
            doubt_message(r, env, "capture_reload", &fault);
    } else {
        return false;
    }
    return true;
}

static bool take_event(struct replay *r, const struct replay_env *env)
{
    struct source_event event;
    struct fault fault;
    int i = 0;
    while (i < env->conf->n_sonars && !is_topic_of(r->next.topic, env->conf->sonar[i].name, "/events"))
        i++;
    if (i == env->conf->n_sonars)
        return false;
    if (source_event_read(r->next.data, r->next.size, &event, &fault))
        source_befell(env->source[i], &event, r->next.log_ns);
    else
        doubt_message(r, env, "capture_event", &fault);
    return true;
}

/* When the next message came. What another program recorded may have been published later, or at no time. */
static struct record_time came(const struct message *m)
{
    const bool doubted = m->since_ns && m->log_ns > m->since_ns && m->log_ns - m->since_ns > LOOP_TIMELY_NS;
    return (struct record_time){.t_ns = m->log_ns, .since_ns = doubted ? m->since_ns : m->log_ns};
}

static void deliver(struct replay *r, const struct replay_env *env)
{
    const struct record_time then = came(&r->next);
    const char *topic = r->next.topic;
    size_t n = strlen(topic);
    bool known = false;
    if (strcmp(topic, "/clock") == 0)
        return; /* a replay goes by the capture's clock */
    for (int i = 0; i < env->conf->n_sonars; i++) {
        if (!is_for(r, env, i))
            continue;
        source_feed(env->source[i], r->next.data, r->next.size, &then);
        known = true;
    }
    known = known || take_text(r, env) || take_event(r, env);
    known = known || aux_sensors_feed(env->aux, topic, r->next.data, r->next.size);
    r->played += known;
    if (!known && (n < 3 || strcmp(topic + n - 3, "/tx") != 0)) {
        r->unknown++;
        if (!r->stranger[0] && (r->log || (n > 3 && strcmp(topic + n - 3, "/rx") == 0)))
            snprintf(r->stranger, sizeof r->stranger, "%s", topic);
    }
}

/* Nobody wants to wait for what lies between two dives, nor see watches fire all through it. */
static void skip_gap(struct replay *r, const struct replay_env *env)
{
    uint64_t now = loop_now(env->loop);
    if (!r->has_next || r->next.log_ns <= now || r->next.log_ns - now <= GAP_NS)
        return;
    log_limited(loop_clock(), LOG_NOTICE, LOG_ABOUT(.event = "capture_gap"),
                "capture: skipped %.0f s without a message", (double)(r->next.log_ns - now) * 1e-9);
    loop_skip(env->loop, r->next.log_ns);
    start_pace(r, env->loop);
}

/* Plays what is due at t_ns; false when nothing is left. */
static bool play_until(struct replay *r, const struct replay_env *env, uint64_t t_ns, int most)
{
    while (r->has_next && r->next.log_ns <= t_ns && most-- > 0) {
        loop_advance(env->loop, r->next.log_ns);
        deliver(r, env);
        take_next(r);
        skip_gap(r, env);
    }
    return r->has_next;
}

/* One turn of the loop; returns false when nothing is left. Advancing the clock only to what has been played keeps
 * the timers in step with the bytes. */
static bool turn_loop(struct replay *r, const struct replay_env *env, uint64_t until, uint64_t wait_ns,
                      bool *running)
{
    bool more = play_until(r, env, until, MESSAGES_PER_TURN);
    if (more && r->next.log_ns > until)
        loop_advance(env->loop, until);
    *running = loop_turn(env->loop, wait_ns);
    return more;
}

/* The jump is over where nothing is left up to its time, and the clock shows that. */
static void end_jump(struct replay *r, const struct replay_env *env, bool more)
{
    if (more && (r->next.log_ns <= r->jump_ns || loop_now(env->loop) < r->jump_ns))
        return;
    pipeline_drain(env->pipeline);
    r->jumping = false;
    start_pace(r, env->loop);
}

static bool paced_turn(struct replay *r, const struct replay_env *env, bool *running)
{
    uint64_t until = LOOP_NEVER, wait_ns = 0;
    if (r->speed > 0) {
        until = r->paced_ns + whole_ns((double)(loop_clock() - r->paced_at_ns) * r->speed);
        if (r->next.log_ns > until)
            wait_ns = whole_ns((double)(r->next.log_ns - until) / r->speed);
    }
    return turn_loop(r, env, until, wait_ns < PACE_NS ? wait_ns : PACE_NS, running);
}

bool replay_run(struct replay *r, const struct replay_env *env)
{
    bool more = r->has_next, running = true;
    start_pace(r, env->loop);
    while (more && running) {
        if (r->jumping) {
            more = turn_loop(r, env, r->jump_ns, 0, &running);
            end_jump(r, env, more);
        } else if (r->paused) {
            running = loop_turn(env->loop, LOOP_NEVER);
        } else {
            more = paced_turn(r, env, &running);
        }
    }
    pipeline_drain(env->pipeline);
    if (r->unknown)
        log_counted(LOG_WARNING, "capture_unknown", r->unknown,
                    "capture: %llu messages on %s that no configured sonar has", (unsigned long long)r->unknown,
                    r->log ? "CAN interfaces" : "channels");
    if (r->log && candump_left_out(r->log))
        log_counted(LOG_WARNING, "capture_damaged", candump_left_out(r->log),
                    "capture: %llu lines were skipped: not CAN frames",
                    (unsigned long long)candump_left_out(r->log));
    return running;
}

/* What a sonar that made no ping of the capture had of it. */
static void tell_unheard(const struct replay *r, const struct conf_sonar *sonar, uint64_t bytes)
{
    if (bytes)
        log_sonar(LOG_ERR, "capture_unheard", sonar->name,
                  "%llu bytes of the capture hold no ping of a %s: wrong device?", (unsigned long long)bytes,
                  sonar->device);
    else
        log_sonar(LOG_ERR, "capture_unheard", sonar->name,
                  "the capture has no message of this sonar, but has %s: wrong name?", r->stranger);
}

/* Of the capture too little could be read, or nothing was for this configuration. */
static bool is_worth_something(const struct replay *r)
{
    const struct mcap_info *info = r->reader ? mcap_info(r->reader) : NULL;
    struct fault lost;
    if (info && mcap_is_mostly_lost(info)) {
        mcap_lost_text(info, &lost);
        log_line(LOG_ERR, "capture_lost", "capture: %s", lost.text);
        return false;
    }
    if (r->played == 0 && !r->stranger[0])
        log_line(LOG_ERR, "capture_empty", "capture: nothing in it that could be played");
    return r->played > 0 || r->stranger[0];
}

bool replay_judge(const struct replay *r, const struct replay_env *env)
{
    if (!is_worth_something(r))
        return false;

    struct source_stats stats[CONF_MAX_SONARS];
    uint64_t bytes = 0, pings = 0;
    for (int i = 0; i < env->conf->n_sonars; i++) {
        source_stats(env->source[i], &stats[i]);
        bytes += stats[i].bytes_in;
        pings += stats[i].device.pings;
    }
    if (pings || (!bytes && !r->stranger[0]) || (env->conf->n_sonars == 0 && r->played > 0))
        return true;
    for (int i = 0; i < env->conf->n_sonars; i++)
        if (stats[i].bytes_in || r->stranger[0])
            tell_unheard(r, &env->conf->sonar[i], stats[i].bytes_in);
    return false;
}

void replay_close(struct replay *r)
{
    if (!r)
        return;
    close_file(r);
    free(r);
}
