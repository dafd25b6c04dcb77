/* SPDX-License-Identifier: MIT */
/*
 * verdict_job - a question about a direction to a grid and to the records of free water, in steps of the loop: what
 * `blocked`, `sectors`, `nearest` and `explain` have in common.
 */
#ifndef SONARD_VERDICT_JOB_H
#define SONARD_VERDICT_JOB_H

#include "grid/answer/nearest.h"
#include "environment.h"

struct verdict_job {
    struct methods_env *d;
    struct grid *grid;
    struct answer_conf limits; /* of the grid at the question: the loop may change them meanwhile */
    struct answer_now now;
    struct obstacles_query query;
    bool is_nearest; /* this is asked instead: */
    struct nearest_query nearest;
    struct records_reading reading; /* zeroed at first */
    bool more;
    struct verdict verdict;
    struct nearest_look look;
    size_t written; /* of its parts, once the answer is there */
};

/** verdict_job_begin - of d, grid and query, or nearest, but for near_m. */
void verdict_job_begin(struct verdict_job *job);

/** verdict_job_step - false: the answer is there, and nothing is held any more. */
bool verdict_job_step(struct verdict_job *job);

/** verdict_job_end - at any time. */
void verdict_job_end(struct verdict_job *job);

#endif
