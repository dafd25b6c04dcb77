/* SPDX-License-Identifier: MIT */
/*
 * watchdog - tells the service manager that the daemon lives, as long as every thread between a ping and its answer
 * takes its turns: the loop, by looking, and the pipeline's threads, which count theirs and are called for one at every
 * look. A sonar that is silent holds up none of them. Threads that wait for a disk or for a Modbus slave are left out:
 * they may wait, `status` says so, and to start anew would lose the maps and mend neither.
 */
#ifndef SONARD_WATCHDOG_H
#define SONARD_WATCHDOG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "core/loop.h"
#include "daemon/pipeline/pipeline.h"

struct watchdog {
    struct loop *loop;
    struct pipeline *pipeline;
    struct loop_fd timer; /* of the kernel: the loop's own clock may be a capture's */
    uint64_t period_ns;
    uint64_t turns[PIPELINE_MAX_THREADS]; /* at the last look */
    int stuck;                            /* the thread that took no turn, reported once; -1: none */
};

/**
 * watchdog_start - look four times in within_ns; 0: nobody wants it, and nothing is done. The manager is told where
 * each thread took a turn since the look before. False with a sentence in fault.
 */
bool watchdog_start(struct watchdog *w, struct loop *loop, struct pipeline *pipeline, uint64_t within_ns,
                    struct fault *fault);

/** watchdog_stop - before the pipeline is freed; also when it was never started, but zeroed. */
void watchdog_stop(struct watchdog *w);

#endif
