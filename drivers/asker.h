/* SPDX-License-Identifier: MIT */
/*
 * asker - what devices have in common that speak: ask, wait for the answer, ask again, and when that is in vain set the
 * device up anew, less and less often. A device lists its questions as steps and tells which comes next; the asker keeps
 * the deadline and knows whether the device answers, is silent, or was told to be quiet. Knows no protocol.
 *
 * A device's state begins with a struct asker, so that a step's functions get the device, and asker_deadline and
 * asker_stop stand in its device_ops.
 */
#ifndef SONARD_ASKER_H
#define SONARD_ASKER_H

#include "device.h"

#define ASKER_GIVE_UP UINT64_MAX /* returned by `ask`: there is no use in asking once more */

/* A question. */
struct asker_step {
    enum device_state state; /* of the device, until its first ping */
    unsigned tries;          /* so often it is asked in vain; 0: a pause, nothing is to be answered */
    bool per_ping;           /* asks for one ping: each that is not answered is one lost */
    /* Say it; returns how long to wait. asker.tries is 1 the first time. */
    uint64_t (*ask)(void *device, uint64_t now_ns, const struct device_io *io);
    /* It was in vain, or the pause is over: go elsewhere. */
    void (*missed)(void *device, uint64_t now_ns, const struct device_io *io);
};

struct asker {
    bool listen_only;
    const struct asker_step *first, *stop; /* after opening and after silence; to make the device quiet, or NULL */

    const struct asker_step *step;
    uint64_t due_ns;
    unsigned tries;              /* at this step, since it was last answered */
    uint64_t retry_ns;           /* next wait of asker_retry */
    bool silent;                 /* has let us down, and no ping came since */
    bool answered;               /* a ping came since it was opened or set up anew */
    uint64_t strange;            /* bytes since the last frame */
    struct device_status status; /* state and what the parser counts: filled in when asked */
};

void asker_init(struct asker *a, bool listen_only, const struct asker_step *first, const struct asker_step *stop);

/** asker_opened, asker_closed - for those of device_ops. With listen_only nothing is ever asked. */
void asker_opened(struct asker *a, uint64_t now_ns, const struct device_io *io);
void asker_closed(struct asker *a);

/** asker_go - ask this, from the first try on. */
void asker_go(struct asker *a, const struct asker_step *step, uint64_t now_ns, const struct device_io *io);

/** asker_expect - as if this had just been asked: the (next) answer is due at due_ns. */
void asker_expect(struct asker *a, const struct asker_step *step, uint64_t due_ns);

/** asker_retry - all was in vain: wait, twice as long each time, and begin at the first step. */
void asker_retry(struct asker *a, uint64_t now_ns);

/** asker_restart - a device that worked does so no more (why): set it up anew, at once. */
void asker_restart(struct asker *a, const char *why, uint64_t now_ns, const struct device_io *io);

/** asker_quiet - it was told to stop, and did or never will. */
void asker_quiet(struct asker *a);

/** asker_seeking - waits to be answered at `step`, or to begin there again. */
bool asker_seeking(const struct asker *a, const struct asker_step *step);

/** asker_listening - listen_only, and open. */
bool asker_listening(const struct asker *a);

/** asker_let_down - it is silent. Said once, when the silence begins, not at every try. */
void asker_let_down(struct asker *a, const char *why, const struct device_io *io);

/** asker_pinged - a ping came; true: the first one after opening, setting up or silence. */
bool asker_pinged(struct asker *a);

/** asker_is_due - the deadline has come. asker_tick - and nothing came in the last moment: ask again, or go elsewhere. */
bool asker_is_due(const struct asker *a, uint64_t now_ns);
void asker_tick(struct asker *a, uint64_t now_ns, const struct device_io *io);

/** asker_line_ns - how long so many bytes may be on their way over the configured wire. */
uint64_t asker_line_ns(const struct device_conf *conf, size_t bytes);

/* For device_ops; `state` begins with the asker. */
uint64_t asker_deadline(const void *state);
void asker_stop(void *state, uint64_t now_ns, const struct device_io *io);

enum device_state asker_state(const struct asker *a);

#endif
