/* SPDX-License-Identifier: MIT */
#include "depth.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "core/log.h"
#include "core/ring.h"
#include "dead_line.h"

#define SAMPLES        8
#define GRAVITY_MPS2   9.80665
#define RETRY_FIRST_MS 200
#define RETRY_MOST_MS  5000
#define JITTER_M       0.2 /* a step that any sensor may make at once */
#define SILENT_AFTER   3   /* failures in a row */

struct sample {
    uint64_t t_ns; /* middle between question and answer */
    enum modbus_result result;
    double value;
    unsigned oddities;
    bool reopened; /* the port was closed behind it, to be opened again: nothing has been heard for too long */
    struct fault fault;
};

struct depth {
    struct conf_depth conf;
    double density_kgpm3;
    struct pose_input *input;

    /* the loop's */
    struct loop_fd wake;
    struct depth_status status;
    int failures; /* in a row */
    bool linked;

    /* the thread's */
    struct modbus_depth *modbus;
    struct dead_line dead;
    pthread_t thread;
    bool started;
    int stop_fd;

    /* between them: indices of samples */
    struct ring idle, ready;
    struct sample sample[SAMPLES];
    _Atomic uint64_t dropped;
};

/* ---- what a value means ---- */

double depth_of_value(const struct conf_depth *conf, double density_kgpm3, double value)
{
    static const double pascal[] = {[CONF_UNIT_PA] = 1,
                                    [CONF_UNIT_KPA] = 1e3,
                                    [CONF_UNIT_MBAR] = 1e2,
                                    [CONF_UNIT_DBAR] = 1e4,
                                    [CONF_UNIT_BAR] = 1e5};
    double v = value * conf->scale + conf->offset;
    if (conf->unit == CONF_UNIT_M)
        return v;
    return (v * pascal[conf->unit] - conf->surface_pa) / (density_kgpm3 * GRAVITY_MPS2);
}

bool depth_plausible(const struct conf_depth *conf, double depth_m, uint64_t t_ns, double last_m, uint64_t last_ns)
{
    if (!(depth_m >= conf->plausible_m[0] && depth_m <= conf->plausible_m[1]))
        return false;
    if (!last_ns || t_ns <= last_ns)
        return true;
    return fabs(depth_m - last_m) <= JITTER_M + conf->speed_limit_mps * (double)(t_ns - last_ns) * 1e-9;
}

void depth_oddities_text(unsigned oddities, struct fault *text)
{
    static const char *const words[] = {"stray bytes before answers", "stray bytes behind answers",
                                        "echoes of the questions"};
    size_t n = 0;
    text->text[0] = '\0';
    for (unsigned i = 0; i < sizeof words / sizeof *words; i++)
        if (oddities & 1u << i)
            n += (size_t)snprintf(text->text + n, sizeof text->text - n, "%s%s", n ? ", " : "", words[i]);
}

bool depth_dated(const struct conf_depth *conf, uint64_t took_ns)
{
    return took_ns <= (uint64_t)(conf->timeout_s * 1e9) + LOOP_TIMELY_NS;
}

/* ---- the thread ---- */

/* False: it is time to end. */
static bool sleep_ms(const struct depth *d, int ms)
{
    struct pollfd stop = {.fd = d->stop_fd, .events = POLLIN};
    return poll(&stop, 1, ms) <= 0;
}

static void hand_over(struct depth *d, const struct sample *s)
{
    uint32_t i;
    uint64_t one = 1;
    if (!ring_take(&d->idle, &i)) {
        /* The loop is busy: the newest counts. Where it just took them all, the next sample will find room. */
        atomic_fetch_add_explicit(&d->dropped, 1, memory_order_relaxed);
        if (!ring_take(&d->ready, &i))
            return;
    }
    d->sample[i] = *s;
    ring_put(&d->ready, i);
    (void)!write(d->wake.fd, &one, sizeof one);
}

static void ask_slave(struct depth *d, struct sample *s)
{
    s->fault.text[0] = '\0';
    s->result = modbus_depth_prepare(d->modbus, &s->fault);
    uint64_t before = loop_clock();
    s->t_ns = before;
    if (s->result != MODBUS_OK)
        return;
    s->result = modbus_depth_read(d->modbus, &s->value, &s->fault);
    s->oddities = modbus_depth_oddities(d->modbus);
    const uint64_t took_ns = loop_clock() - before;
    s->t_ns = before + took_ns / 2;
    if (s->result != MODBUS_OK || depth_dated(&d->conf, took_ns))
        return;
    s->result = MODBUS_TIMEOUT;
    fault_set(&s->fault, "%.200s, slave %d: the answer was read %.1f s after the question", d->conf.source,
              d->conf.slave, (double)took_ns * 1e-9);
}

/* Whatever the slave says shows that the line is alive. */
static void look_after_line(struct depth *d, struct sample *s)
{
    const bool heard = s->result == MODBUS_OK || s->result == MODBUS_EXCEPTION || s->result == MODBUS_NO_NUMBER;
    const uint64_t now_ns = loop_clock();
    if (s->result == MODBUS_NO_LINK)
        dead_line_opened(&d->dead, now_ns);
    else if (dead_line_look(&d->dead, now_ns, heard)) {
        modbus_depth_disconnect(d->modbus);
        s->reopened = d->dead.due == 1;
    }
}

static void *poller(void *ctx)
{
    struct depth *d = ctx;
    const int period_ms = (int)(1000 / d->conf.rate_hz);
    int retry_ms = RETRY_FIRST_MS, wait_ms;
    dead_line_opened(&d->dead, loop_clock());
    do {
        struct sample s = {0};
        uint64_t start = loop_clock();
        ask_slave(d, &s);
        if (s.result == MODBUS_STOPPED)
            break;
        look_after_line(d, &s);
        hand_over(d, &s);
        if (s.result == MODBUS_NO_LINK) {
            wait_ms = retry_ms;
            retry_ms = retry_ms * 2 < RETRY_MOST_MS ? retry_ms * 2 : RETRY_MOST_MS;
        } else {
            uint64_t took_ms = (loop_clock() - start) / 1000000;
            wait_ms = took_ms < (uint64_t)period_ms ? period_ms - (int)took_ms : 0;
            retry_ms = RETRY_FIRST_MS;
        }
    } while (sleep_ms(d, wait_ms));
    return NULL;
}

/* ---- the loop ---- */

static void set_state(struct depth *d, enum depth_state state, const char *why)
{
    fault_set(&d->status.error, "%s", state == DEPTH_RUNNING ? "" : why);
    if (d->status.state == state)
        return;
    if (state == DEPTH_RUNNING)
        log_line(LOG_NOTICE, "depth_answers", "depth: %s, slave %d answers", d->conf.source, d->conf.slave);
    else if (state == DEPTH_REFUSED)
        log_line(LOG_WARNING, "depth_refused", "depth: %s; check function, register and type", why);
    else if (state == DEPTH_SILENT)
        log_line(LOG_WARNING, "depth_silent", "depth: %s; asking again", why);
    else
        log_line(LOG_WARNING, "depth_failed", "depth: %s; retrying until it opens", why);
    d->status.state = state;
}

/* The sensor sits beside the vehicle's reference point, whose depth is wanted. */
static double of_vehicle(const struct depth *d, uint64_t t_ns, double depth_m)
{
    struct pose pose;
    double arm[3];
    pose_log_at(d->input->poses, t_ns, &pose);
    quat_rotate(pose.attitude, d->conf.mount_m, arm);
    return depth_m - arm[2];
}

static void take_value(struct depth *d, const struct sample *s)
{
    double depth_m = depth_of_value(&d->conf, d->density_kgpm3, s->value);
    d->failures = 0;
    d->status.samples++;
    d->status.reconnects += !d->linked && d->status.t_depth_ns;
    d->linked = true;
    set_state(d, DEPTH_RUNNING, "");
    if (!depth_plausible(&d->conf, depth_m, s->t_ns, d->status.depth_m, d->status.t_depth_ns)) {
        d->status.implausible++;
        fault_set(&d->status.error, "%g m rejected; see plausible and speed_limit", depth_m);
        log_limited(loop_now(d->input->loop), LOG_WARNING, LOG_ABOUT(.event = "depth_doubted"),
                    "depth: %g m rejected (last %g m; see plausible and speed_limit)", depth_m, d->status.depth_m);
        return;
    }
    d->status.depth_m = depth_m;
    d->status.t_depth_ns = s->t_ns;
    pose_input_depth(d->input, s->t_ns, of_vehicle(d, s->t_ns, depth_m));
}

static void take_failure(struct depth *d, const struct sample *s)
{
    struct depth_status *st = &d->status;
    st->timeouts += s->result == MODBUS_TIMEOUT;
    st->exceptions += s->result == MODBUS_EXCEPTION;
    st->bad_answers += s->result == MODBUS_BAD_ANSWER;
    st->out_of_step += s->result == MODBUS_OUT_OF_STEP;
    st->no_number += s->result == MODBUS_NO_NUMBER;
    st->error = s->fault;
    if (s->result == MODBUS_NO_LINK) {
        d->linked = false;
        set_state(d, DEPTH_NO_LINK, s->fault.text);
    } else if (++d->failures >= SILENT_AFTER) {
        set_state(d, s->result == MODBUS_EXCEPTION ? DEPTH_REFUSED : DEPTH_SILENT, s->fault.text);
    }
}

static void take_oddities(struct depth *d, unsigned oddities)
{
    struct fault text;
    const unsigned news = oddities & ~d->status.oddities;
    if (!news)
        return;
    d->status.oddities |= news;
    depth_oddities_text(news, &text);
    log_line(LOG_NOTICE, "depth_oddity", "depth: %s: skipping %s", d->conf.source, text.text);
}

static void on_wake(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct depth *d = ctx;
    uint64_t count;
    uint32_t i;
    (void)events;
    (void)now_ns;
    (void)!read(d->wake.fd, &count, sizeof count);
    while (ring_take(&d->ready, &i)) {
        struct sample s = d->sample[i];
        ring_put(&d->idle, i);
        take_oddities(d, s.oddities);
        if (s.reopened)
            log_line(LOG_WARNING, "depth_dead",
                     "depth: %s: no answer for %d s or more; closing and opening the port", d->conf.source,
                     (int)(DEAD_LINE_LEAST_NS / 1000000000u));
        if (s.result == MODBUS_OK)
            take_value(d, &s);
        else
            take_failure(d, &s);
    }
}

/* ---- life ---- */

static void modbus_conf_of(const struct depth *d, struct modbus_depth_conf *m)
{
    static const enum modbus_type types[] = {[CONF_INT16] = MODBUS_INT16,
                                             [CONF_UINT16] = MODBUS_UINT16,
                                             [CONF_INT32] = MODBUS_INT32,
                                             [CONF_FLOAT32] = MODBUS_FLOAT32};
    *m = (struct modbus_depth_conf){.parity = "NEO"[d->conf.parity],
                                    .slave = d->conf.slave,
                                    .input = d->conf.function == CONF_INPUT,
                                    .reg = d->conf.reg,
                                    .type = types[d->conf.type],
                                    .little = d->conf.word_order == CONF_LITTLE,
                                    .timeout_ms = (uint32_t)(d->conf.timeout_s * 1e3),
                                    .turnaround_ms = (uint32_t)(d->conf.turnaround_s * 1e3),
                                    .echo = d->conf.resync == CONF_ECHO,
                                    .stop_fd = d->stop_fd};
    snprintf(m->source, sizeof m->source, "%s", d->conf.source);
}

struct depth *depth_new(const struct conf_depth *conf, double density_kgpm3, struct pose_input *input,
                        struct fault *fault)
{
    struct depth *d = aligned_alloc(RING_CACHE_LINE, sizeof *d);
    struct modbus_depth_conf modbus;
    struct fault why;
    if (!d) {
        fault_set(fault, "[depth]: out of memory");
        return NULL;
    }
    memset(d, 0, sizeof *d);
    d->conf = *conf;
    d->density_kgpm3 = density_kgpm3;
    d->input = input;
    d->dead.asked = true;
    d->stop_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    d->wake = (struct loop_fd){.fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), .ready = on_wake, .ctx = d};
    ring_init(&d->idle, SAMPLES, 0);
    ring_init(&d->ready, SAMPLES, 0);
    for (uint32_t i = 0; i < SAMPLES; i++)
        ring_put(&d->idle, i);
    modbus_conf_of(d, &modbus);
    d->modbus = modbus_depth_new(&modbus, &why);
    if (d->modbus && d->stop_fd >= 0 && d->wake.fd >= 0)
        return d;
    fault_set(fault, "[depth] source = %.200s: %s", conf->source, d->modbus ? strerror(errno) : why.text);
    depth_free(d);
    return NULL;
}

bool depth_start(struct depth *d, struct fault *fault)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, &before);
    bool added = loop_add(d->input->loop, &d->wake, EPOLLIN);
    int cause = added ? pthread_create(&d->thread, NULL, poller, d) : errno;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    d->started = cause == 0;
    if (cause != 0)
        fault_set(fault, "[depth]: cannot start: %s", strerror(cause));
    return d->started;
}

void depth_free(struct depth *d)
{
    uint64_t one = 1;
    if (!d)
        return;
    if (d->started) {
        (void)!write(d->stop_fd, &one, sizeof one);
        pthread_join(d->thread, NULL);
        loop_remove(d->input->loop, &d->wake);
    }
    modbus_depth_free(d->modbus);
    if (d->stop_fd >= 0)
        close(d->stop_fd);
    if (d->wake.fd >= 0)
        close(d->wake.fd);
    free(d);
}

void depth_status(const struct depth *d, struct depth_status *out)
{
    *out = d->status;
    out->dropped = atomic_load_explicit(&d->dropped, memory_order_relaxed);
}
