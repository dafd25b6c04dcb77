/* SPDX-License-Identifier: MIT */
/*
 * map_steps - what the map's owner does for a job of map_service.h: copies the map, or replaces it by what was
 * read. Jobs
 * in steps of one submap (struct owner_job), of which pings wait for one at a time; so what is copied is one map,
 * whatever others want to change in it, and nobody else is answered from half of one that is put in.
 */
#ifndef SONARD_MAP_STEPS_H
#define SONARD_MAP_STEPS_H

#include "map_service.h"

/** map_steps_measure - steps.wanted and steps.residual_size, of the map as it is now. */
void map_steps_measure(void *map_job, const struct pipeline_owned *owned);

/**
 * map_steps_copy - all submaps into job->bytes, which has the room that steps.wanted says behind its header, and the
 * residual into steps.residual. job->copied is false when the map has outgrown the room. Each submap is of one moment;
 * pings that come meanwhile are in the later ones.
 */
void map_steps_copy(void *map_job, const struct pipeline_owned *owned);

/** map_steps_put_in - job->bytes replace the map. steps.good is false, with a sentence in job->message, when one of
 * their submaps is of another kind: then the map is as it was; or is none: then it is empty. It is held until the loop
 * has settled where it counts from. */
void map_steps_put_in(void *map_job, const struct pipeline_owned *owned);

#endif
