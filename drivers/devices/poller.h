/* SPDX-License-Identifier: MIT */
/*
 * poller - what devices have in common that speak: ask, wait for the answer, ask again, and when that is in vain set
 * the device up anew, less and less often. A device lists its questions as steps and tells which comes next; the poller
 * keeps the deadline and knows whether the device answers, is silent, or was asked to be quiet. Knows no protocol.
 *
 * A device's state begins with a struct poller, so that a step's functions get the device, and poller_deadline and
 * poller_stop stand in its device_ops.
 */
#ifndef SONARD_POLLER_H
#define SONARD_POLLER_H

#include "device.h"

#define POLLER_GIVE_UP UINT64_MAX /* returned by `ask`: there is no use in asking once more */

/* A question. */
struct poller_step {
    enum device_state state; /* of the device, until its first ping */
    unsigned tries;          /* so often it is asked in vain; 0: a pause, nothing is to be answered */
    bool per_ping;           /* asks for one ping: each that is not answered is one lost */
    /* Say it; returns how long to wait. poller.tries is 1 the first time. */
    uint64_t (*ask)(void *device, uint64_t now_ns, const struct device_io *io);
    /* It was in vain, or the pause is over: go elsewhere. */
    void (*missed)(void *device, uint64_t now_ns, const struct device_io *io);
};

struct poller {
    bool listen_only;
    const struct poller_step *first,
        *stop; /* after opening and after silence; to make the device quiet, or NULL */

    const struct poller_step *step;
    uint64_t due_ns;
    unsigned tries;              /* at this step, since it was last answered */
    uint64_t retry_ns;           /* next wait of poller_retry */
    bool silent;                 /* has let us down, and no ping came since */
    bool answered;               /* a ping came since it was opened or set up anew */
    uint64_t strange;            /* bytes since the last frame */
    struct device_status status; /* state and what the parser counts: filled in when asked */
};

void poller_init(struct poller *a, bool listen_only, const struct poller_step *first,
                 const struct poller_step *stop);

/** poller_opened, poller_closed - for those of device_ops. With listen_only nothing is ever asked. */
void poller_opened(struct poller *a, uint64_t now_ns, const struct device_io *io);
void poller_closed(struct poller *a);

/** poller_start - ask this, from the first try on. */
void poller_start(struct poller *a, const struct poller_step *step, uint64_t now_ns, const struct device_io *io);

/** poller_expect - as if this had just been asked: the (next) answer is due at due_ns. */
void poller_expect(struct poller *a, const struct poller_step *step, uint64_t due_ns);

/** poller_retry - all was in vain: wait, twice as long each time, and begin at the first step. */
void poller_retry(struct poller *a, uint64_t now_ns);

/** poller_restart - a device that worked does so no more (why): set it up anew, at once. */
void poller_restart(struct poller *a, const char *why, uint64_t now_ns, const struct device_io *io);

/** poller_quiet - it was asked to stop, and did or never will. */
void poller_quiet(struct poller *a);

/** poller_seeking - waits to be answered at `step`, or to begin there again. */
bool poller_seeking(const struct poller *a, const struct poller_step *step);

/** poller_listening - listen_only, and open. */
bool poller_listening(const struct poller *a);

/** poller_timed_out - it is silent. Said once, when the silence begins, not at every try. */
void poller_timed_out(struct poller *a, const char *why, const struct device_io *io);

/** poller_advice - what to look at on a wire of this kind where nobody answers; for brackets. */
const char *poller_advice(const struct device_conf *conf);

/** poller_pinged - a ping came; true: the first one after opening, setting up or silence. */
bool poller_pinged(struct poller *a);

/** poller_is_due - the deadline has come. poller_tick - and nothing came in the last moment:
 * ask again, or go elsewhere. */
bool poller_is_due(const struct poller *a, uint64_t now_ns);
void poller_tick(struct poller *a, uint64_t now_ns, const struct device_io *io);

/** poller_line_ns - how long so many bytes may be on their way over the configured wire. */
uint64_t poller_line_ns(const struct device_conf *conf, size_t bytes);

/* For device_ops; `state` begins with the poller. */
uint64_t poller_deadline(const void *state);
void poller_stop(void *state, uint64_t now_ns, const struct device_io *io);

enum device_state poller_state(const struct poller *a);

#endif
