/* SPDX-License-Identifier: MIT */
/*
 * realtime - what [realtime] asks of the kernel: processors, memory that stays, priorities. All of it is had or the
 * daemon does not start: a vehicle that counts on it must not find out in the water.
 * Knows nothing of what the threads do.
 */
#ifndef SONARD_REALTIME_H
#define SONARD_REALTIME_H

#include <stdbool.h>
#include <stddef.h>

#include "config/conf.h"
#include "core/fault.h"
#include "daemon/pipeline/pipeline.h"

/**
 * realtime_prepare - before any thread is made and any large memory is taken: keep to the processors; when memory is
 * to be locked, small stacks for threads, and none of the memory that is freed goes back to the kernel.
 * False with a sentence in fault that names the key and what is missing.
 */
bool realtime_prepare(const struct conf_realtime *conf, struct fault *fault);

/**
 * realtime_enter - when all that runs for the life of the process is there: lock the memory, every page of it in place
 * now, and give the calling thread (the loop) its priority, the pipeline's threads one less. Whoever else works, now or
 * later, stays an ordinary thread. False as above.
 */
bool realtime_enter(const struct conf_realtime *conf, struct pipeline *p, struct fault *fault);

#endif
