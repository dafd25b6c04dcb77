/* SPDX-License-Identifier: MIT */
/*
 * map_job - what a job of map_service.h does, step by step: it writes a map, reads one, or makes an export of one. Some
 * steps are for the map's owner and some for the worker; whoever runs the job hands each to them and asks for the next.
 * Touches the job, the disk and, in the owner's steps, the map; nothing else of the daemon.
 */
#ifndef SONARD_MAP_JOB_H
#define SONARD_MAP_JOB_H

#include "map_service.h"

/* One of them, or none: the job is done, and its good and message say how. */
struct map_job_step {
    pipeline_owner_fn *owner;
    void (*worker)(void *map_job);
};

/** map_job_next - the step after the last, which is done. What was loaded is the map when there is none. */
struct map_job_step map_job_next(struct map_job *job);

#endif
