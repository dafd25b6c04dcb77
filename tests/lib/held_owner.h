/* SPDX-License-Identifier: MIT */
/* held_owner.h - a job that keeps the maps' owner busy until it is let go, so that others wait in its queue. */
#ifndef SONARD_TEST_HELD_OWNER_H
#define SONARD_TEST_HELD_OWNER_H

#include <semaphore.h>

#include "daemon/pipeline/pipeline.h"
#include "test.h"

struct hold {
    struct owner_job call;
    sem_t started, go;
};

static inline void hold_until_let_go(void *ctx, const struct pipeline_owned *owned)
{
    struct hold *hold = ctx;
    (void)owned;
    sem_post(&hold->started);
    while (sem_wait(&hold->go) != 0) {
    }
}

/* The owner is busy when this returns; sem_post(&hold->go) lets it go. */
static inline void hold_owner(struct hold *hold, struct pipeline *pipeline)
{
    *hold = (struct hold){0};
    sem_init(&hold->started, 0, 0);
    sem_init(&hold->go, 0, 0);
    CHECK(!owner_poll(pipeline, &hold->call, hold_until_let_go));
    while (sem_wait(&hold->started) != 0) {
    }
}

#endif
