/* SPDX-License-Identifier: MIT */
/*
 * map_job - what a job of places.h does in its thread: writes a map, reads one, or makes an export of one. Touches the
 * job and the disk, and by job->ask the map; nothing else of the daemon.
 */
#ifndef SONARD_MAP_JOB_H
#define SONARD_MAP_JOB_H

#include "places.h"

/** map_job_run - by job->what; sets good and message. What it has loaded is the map then. */
void map_job_run(struct places_job *job);

#endif
