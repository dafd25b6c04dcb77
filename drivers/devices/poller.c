/* SPDX-License-Identifier: MIT */
/*
 * poller - see poller.h.
 */
#include "poller.h"

#include <inttypes.h>

#include "drivers/ports/line_time.h"

#define NEVER          UINT64_MAX
#define RETRY_FIRST_NS 250000000ull
#define RETRY_MAX_NS   2000000000ull

/* Where nothing is asked. `waiting` only holds the place until `first` comes again. */
static const struct poller_step closed = {.state = DEVICE_CLOSED};
static const struct poller_step listening = {.state = DEVICE_IDENTIFY};
static const struct poller_step waiting = {.state = DEVICE_IDENTIFY};
static const struct poller_step quiet = {.state = DEVICE_CLOSED};

static void enter(struct poller *a, const struct poller_step *step, uint64_t due_ns)
{
    a->step = step;
    a->due_ns = due_ns;
    a->tries = 0;
}

void poller_init(struct poller *a, bool listen_only, const struct poller_step *first,
                 const struct poller_step *stop)
{
    *a = (struct poller){.listen_only = listen_only, .first = first, .stop = stop};
    enter(a, &closed, NEVER);
}

static void ask_step(struct poller *a, uint64_t now_ns, const struct device_io *io)
{
    a->tries++;
    const uint64_t wait_ns = a->step->ask(a, now_ns, io);
    if (wait_ns == POLLER_GIVE_UP)
        a->step->missed(a, now_ns, io);
    else
        a->due_ns = now_ns + wait_ns;
}

void poller_start(struct poller *a, const struct poller_step *step, uint64_t now_ns, const struct device_io *io)
{
    enter(a, step, NEVER);
    ask_step(a, now_ns, io);
}

static void begin_steps(struct poller *a, uint64_t now_ns, const struct device_io *io)
{
    a->answered = false;
    poller_start(a, a->first, now_ns, io);
}

void poller_opened(struct poller *a, uint64_t now_ns, const struct device_io *io)
{
    a->silent = a->answered = false;
    a->strange = 0;
    a->retry_ns = RETRY_FIRST_NS;
    if (a->listen_only)
        enter(a, &listening, NEVER);
    else
        begin_steps(a, now_ns, io);
}

void poller_closed(struct poller *a)
{
    enter(a, &closed, NEVER);
}

void poller_expect(struct poller *a, const struct poller_step *step, uint64_t due_ns)
{
    enter(a, step, due_ns);
    a->tries = 1;
}

void poller_retry(struct poller *a, uint64_t now_ns)
{
    enter(a, &waiting, now_ns + a->retry_ns);
    a->retry_ns = 2 * a->retry_ns < RETRY_MAX_NS ? 2 * a->retry_ns : RETRY_MAX_NS;
}

void poller_restart(struct poller *a, const char *why, uint64_t now_ns, const struct device_io *io)
{
    a->status.restarts++;
    poller_timed_out(a, why, io);
    begin_steps(a, now_ns, io);
}

void poller_quiet(struct poller *a)
{
    enter(a, &quiet, NEVER);
}

bool poller_seeking(const struct poller *a, const struct poller_step *step)
{
    return a->step == step || a->step == &waiting;
}

bool poller_listening(const struct poller *a)
{
    return a->step == &listening;
}

void poller_timed_out(struct poller *a, const char *why, const struct device_io *io)
{
    if (!a->silent && a->strange > 0)
        io->note(io->ctx, NOTE_WARNING, "%s; discarded %" PRIu64 " bytes that are not valid frames; retrying", why,
                 a->strange);
    else if (!a->silent)
        io->note(io->ctx, NOTE_WARNING, "%s; retrying", why);
    a->silent = true;
}

const char *poller_advice(const struct device_conf *conf)
{
    if (conf->baud)
        return "power, wiring, baud rate?";
    return conf->least_baud ? "power, wiring?" : "power, address, port; is the bridge running?";
}

bool poller_pinged(struct poller *a)
{
    const bool news = !a->answered || a->silent;
    a->answered = true;
    a->silent = false;
    a->retry_ns = RETRY_FIRST_NS;
    return news;
}

bool poller_is_due(const struct poller *a, uint64_t now_ns)
{
    return a->due_ns != NEVER && now_ns >= a->due_ns;
}

void poller_tick(struct poller *a, uint64_t now_ns, const struct device_io *io)
{
    if (!poller_is_due(a, now_ns))
        return;
    if (a->step == &waiting) {
        begin_steps(a, now_ns, io);
        return;
    }
    a->status.timeouts += a->step->tries > 0;
    a->status.lost_frames += a->step->per_ping;
    if (a->tries < a->step->tries)
        ask_step(a, now_ns, io);
    else
        a->step->missed(a, now_ns, io);
}

uint64_t poller_line_ns(const struct device_conf *conf, size_t bytes)
{
    return line_ns(conf->baud ? conf->baud : conf->least_baud, bytes);
}

uint64_t poller_deadline(const void *state)
{
    const struct poller *a = state;
    return a->due_ns;
}

void poller_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct poller *a = state;
    if (a->step == &closed || a->step == &listening || a->step == &quiet || a->step == a->stop)
        return;
    if (a->stop)
        poller_start(a, a->stop, now_ns, io);
    else
        poller_quiet(a);
}

enum device_state poller_state(const struct poller *a)
{
    if (a->step == &closed || a->step == &quiet || a->step == a->stop)
        return DEVICE_CLOSED;
    return a->silent ? DEVICE_SILENT : a->answered ? DEVICE_RUNNING : a->step->state;
}
