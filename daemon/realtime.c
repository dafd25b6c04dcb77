/* SPDX-License-Identifier: MIT */
#include "realtime.h"

#include <errno.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include "core/log.h"

/* Of a thread: the whole of it is locked. The deepest is zstd's, below 200 KiB. */
#define STACK_BYTES ((size_t)1 << 20)

/* Of the loop, whose stack grows by faults: as much as it ever uses. */
#define LOOP_STACK_TOUCHED (256 * 1024)

static bool fail(struct fault *fault, const char *key, int error, const char *remedy)
{
    return fault_set(fault, "[realtime] %s: %s; %s", key, strerror(error), remedy);
}

static bool keep_to_processors(const struct conf_realtime *conf, struct fault *fault)
{
    cpu_set_t set;
    if (conf->processor < 0)
        return true;
    CPU_ZERO(&set);
    for (int i = 0; i < conf->processor_count; i++)
        CPU_SET((size_t)(conf->processor + i), &set);
    if (sched_setaffinity(0, sizeof set, &set) == 0)
        return true;
    return fail(fault, "processor", errno,
                errno == EINVAL ? "this computer has no processor of that number"
                                : "the service does not permit it, see sonard(8)");
}

static bool prepare_memory(struct fault *fault)
{
    pthread_attr_t attr;
    pthread_attr_init(&attr);
    int cause = pthread_attr_setstacksize(&attr, STACK_BYTES);
    if (cause == 0)
        cause = pthread_setattr_default_np(&attr);
    pthread_attr_destroy(&attr);
    if (cause != 0)
        return fail(fault, "lock_memory", cause, "the size of stacks cannot be set");
    mallopt(M_TRIM_THRESHOLD, -1);
    mallopt(M_MMAP_MAX, 0);
    return true;
}

bool realtime_prepare(const struct conf_realtime *conf, struct fault *fault)
{
    return keep_to_processors(conf, fault) && (conf->lock_memory != CONF_ON || prepare_memory(fault));
}

static void touch_stack(void)
{
    volatile char stack[LOOP_STACK_TOUCHED];
    for (size_t i = 0; i < sizeof stack; i += 4096)
        stack[i] = 0;
}

/*
 * Memory that is taken later stays once it was touched. With a limit it could not be had at all at some time in the
 * water, so there must be none.
 */
static bool lock_memory(struct fault *fault)
{
    static const char remedy[] = "needs LimitMEMLOCK=infinity, as sonard.service has it";
    struct rlimit limit;
    getrlimit(RLIMIT_MEMLOCK, &limit);
    if (limit.rlim_max != RLIM_INFINITY && geteuid() != 0)
        return fail(fault, "lock_memory", EPERM, remedy);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_MEMLOCK, &limit);
    touch_stack();
    if (mlockall(MCL_CURRENT) == 0 && mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0)
        return true;
    return fail(fault, "lock_memory", errno, remedy);
}

static bool take_priority(int priority, struct pipeline *p, struct fault *fault)
{
    const struct sched_param param = {.sched_priority = priority};
    /* threads that the loop starts later, to write or export a map, are ordinary ones */
    if (sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &param) != 0)
        return fail(fault, "priority", errno, "needs LimitRTPRIO= of at least as much");
    int cause = pipeline_schedule(p, priority - 1);
    return cause == 0 || fail(fault, "priority", cause, "of a thread of the pipeline");
}

bool realtime_enter(const struct conf_realtime *conf, struct pipeline *p, struct fault *fault)
{
    if (conf->lock_memory == CONF_ON && !lock_memory(fault))
        return false;
    if (conf->priority > 0 && !take_priority(conf->priority, p, fault))
        return false;
    if (conf->lock_memory == CONF_ON || conf->priority > 0)
        log_line(LOG_NOTICE, "realtime", "real time: priority %d, memory %s", conf->priority,
                 conf->lock_memory == CONF_ON ? "locked" : "not locked");
    return true;
}
