/* SPDX-License-Identifier: MIT */
#include "verdict_job.h"

#include "grid_methods.h"
#include "query_context.h"

static bool ask(struct verdict_job *job)
{
    const struct verdict_evidence by = {.picture = grid_picture(job->grid),
                                        .store = pipeline_records(job->d->pipeline)->store,
                                        .list = &job->reading.list,
                                        .conf = &job->limits,
                                        .now = &job->now};
    if (job->is_nearest)
        return nearest_begin(&job->look, &job->verdict, &by, &job->nearest, query_own_m(job->d));
    return verdict_begin(&job->verdict, &by, &job->query, query_own_m(job->d));
}

void verdict_job_begin(struct verdict_job *job)
{
    job->now = query_now(job->d);
    job->limits = grid_limits(job->grid);
    job->nearest.near_m = job->query.line.near_m = job->query.band.near_m = job->query.move.near_m =
        query_near_m(job->d);
    records_open(pipeline_records(job->d->pipeline), &job->reading);
    job->more = ask(job);
    if (!job->more)
        verdict_job_end(job);
}

static bool step(struct verdict_job *job)
{
    return job->is_nearest ? nearest_step(&job->look) : verdict_step(&job->verdict);
}

bool verdict_job_step(struct verdict_job *job)
{
    if (job->more && !records_keeps(pipeline_records(job->d->pipeline), &job->reading))
        job->more = ask(job);
    job->more = job->more && step(job);
    if (!job->more)
        verdict_job_end(job);
    return job->more;
}

void verdict_job_end(struct verdict_job *job)
{
    records_close(pipeline_records(job->d->pipeline), &job->reading);
}
