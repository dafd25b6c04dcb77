/* SPDX-License-Identifier: MIT */
/* bench_answer.h - an answer of the daemon without its socket. */
#ifndef SONARD_BENCH_ANSWER_H
#define SONARD_BENCH_ANSWER_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/loop.h"
#include "daemon/methods/environment.h"
#include "daemon/methods/methods.h"

/* From the request's line to the answer's, as the loop does it; what the socket takes is not in it. */
static inline void bench_answer(struct methods_env *d, const char *line)
{
    struct rpc_work work = {0};
    const struct rpc_call call = {.daemon = d, .now_ns = loop_clock(), .work = &work};
    struct rpc_job *job = rpc_begin(&call, line, strlen(line));
    char *reply = NULL;
    while (rpc_step(job, daemon_methods, &call)) {
    }
    if (!rpc_end(job, &reply) || !reply || strstr(reply, "\"error\"")) {
        fprintf(stderr, "%s\n%s\n", line, reply ? reply : "no answer");
        exit(1);
    }
    free(reply);
}

#endif
