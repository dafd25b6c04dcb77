/* SPDX-License-Identifier: MIT */
/*
 * map_job - what a job of places.h does in its thread: writes a map, reads one, or makes an export of one. Touches the
 * job and the disk, nothing of the daemon.
 */
#ifndef SONARD_MAP_JOB_H
#define SONARD_MAP_JOB_H

#include "places.h"

/** map_job_run - by job->what; sets good and message, and for a load bytes, tiles and pages. */
void map_job_run(struct places_job *job);

#endif
