/* SPDX-License-Identifier: MIT */
/*
 * asker - see asker.h.
 */
#include "asker.h"

#include <inttypes.h>

#include "line_time.h"

#define NEVER          UINT64_MAX
#define RETRY_FIRST_NS 250000000ull
#define RETRY_MAX_NS   2000000000ull

/* Where nothing is asked. `waiting` only holds the place until `first` comes again. */
static const struct asker_step closed = {.state = DEVICE_CLOSED};
static const struct asker_step listening = {.state = DEVICE_IDENTIFY};
static const struct asker_step waiting = {.state = DEVICE_IDENTIFY};
static const struct asker_step quiet = {.state = DEVICE_CLOSED};

static void enter(struct asker *a, const struct asker_step *step, uint64_t due_ns)
{
    a->step = step;
    a->due_ns = due_ns;
    a->tries = 0;
}

void asker_init(struct asker *a, bool listen_only, const struct asker_step *first, const struct asker_step *stop)
{
    *a = (struct asker){.listen_only = listen_only, .first = first, .stop = stop};
    enter(a, &closed, NEVER);
}

static void ask(struct asker *a, uint64_t now_ns, const struct device_io *io)
{
    a->tries++;
    const uint64_t wait_ns = a->step->ask(a, now_ns, io);
    if (wait_ns == ASKER_GIVE_UP)
        a->step->missed(a, now_ns, io);
    else
        a->due_ns = now_ns + wait_ns;
}

void asker_go(struct asker *a, const struct asker_step *step, uint64_t now_ns, const struct device_io *io)
{
    enter(a, step, NEVER);
    ask(a, now_ns, io);
}

static void begin(struct asker *a, uint64_t now_ns, const struct device_io *io)
{
    a->answered = false;
    asker_go(a, a->first, now_ns, io);
}

void asker_opened(struct asker *a, uint64_t now_ns, const struct device_io *io)
{
    a->silent = a->answered = false;
    a->strange = 0;
    a->retry_ns = RETRY_FIRST_NS;
    if (a->listen_only)
        enter(a, &listening, NEVER);
    else
        begin(a, now_ns, io);
}

void asker_closed(struct asker *a)
{
    enter(a, &closed, NEVER);
}

void asker_expect(struct asker *a, const struct asker_step *step, uint64_t due_ns)
{
    enter(a, step, due_ns);
    a->tries = 1;
}

void asker_retry(struct asker *a, uint64_t now_ns)
{
    enter(a, &waiting, now_ns + a->retry_ns);
    a->retry_ns = 2 * a->retry_ns < RETRY_MAX_NS ? 2 * a->retry_ns : RETRY_MAX_NS;
}

void asker_restart(struct asker *a, const char *why, uint64_t now_ns, const struct device_io *io)
{
    a->status.restarts++;
    asker_let_down(a, why, io);
    begin(a, now_ns, io);
}

void asker_quiet(struct asker *a)
{
    enter(a, &quiet, NEVER);
}

bool asker_seeking(const struct asker *a, const struct asker_step *step)
{
    return a->step == step || a->step == &waiting;
}

bool asker_listening(const struct asker *a)
{
    return a->step == &listening;
}

void asker_let_down(struct asker *a, const char *why, const struct device_io *io)
{
    if (!a->silent && a->strange > 0)
        io->note(io->ctx, NOTE_WARNING, "%s; %" PRIu64 " bytes heard that are no frames of it; trying on", why,
                 a->strange);
    else if (!a->silent)
        io->note(io->ctx, NOTE_WARNING, "%s; trying on", why);
    a->silent = true;
}

bool asker_pinged(struct asker *a)
{
    const bool news = !a->answered || a->silent;
    a->answered = true;
    a->silent = false;
    a->retry_ns = RETRY_FIRST_NS;
    return news;
}

bool asker_is_due(const struct asker *a, uint64_t now_ns)
{
    return a->due_ns != NEVER && now_ns >= a->due_ns;
}

void asker_tick(struct asker *a, uint64_t now_ns, const struct device_io *io)
{
    if (!asker_is_due(a, now_ns))
        return;
    if (a->step == &waiting) {
        begin(a, now_ns, io);
        return;
    }
    a->status.timeouts += a->step->tries > 0;
    a->status.lost_frames += a->step->per_ping;
    if (a->tries < a->step->tries)
        ask(a, now_ns, io);
    else
        a->step->missed(a, now_ns, io);
}

uint64_t asker_line_ns(const struct device_conf *conf, size_t bytes)
{
    return line_ns(conf->baud ? conf->baud : conf->least_baud, bytes);
}

uint64_t asker_deadline(const void *state)
{
    const struct asker *a = state;
    return a->due_ns;
}

void asker_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct asker *a = state;
    if (a->step == &closed || a->step == &listening || a->step == &quiet || a->step == a->stop)
        return;
    if (a->stop)
        asker_go(a, a->stop, now_ns, io);
    else
        asker_quiet(a);
}

enum device_state asker_state(const struct asker *a)
{
    if (a->step == &closed || a->step == &quiet || a->step == a->stop)
        return DEVICE_CLOSED;
    return a->silent ? DEVICE_SILENT : a->answered ? DEVICE_RUNNING : a->step->state;
}
