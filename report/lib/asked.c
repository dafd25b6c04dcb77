/* SPDX-License-Identifier: MIT */
/* asked - what the daemon answers; see asked.h. */
#include "asked.h"

#include <stdio.h>
#include <stdlib.h>

#include "daemon/methods/query_context.h"
#include "grid/answer/verdict.h"
#include "knob.h"

double asked_near_m(void)
{
    static struct methods_env shipped;
    if (shipped.conf.vehicle.radius_m <= 0)
        knob_conf(NULL, &shipped.conf);
    return query_near_m(&shipped);
}

struct store *asked_store(void)
{
    static const struct store_conf one = {.beams = {1}, .spare = 1};
    void *memory = malloc(store_bytes(&one));
    if (!memory) {
        fprintf(stderr, "asked: no memory\n");
        exit(1);
    }
    return store_init(memory, &one);
}

static void answer(const struct verdict_evidence *by, double near_m, const struct obstacles_query *query,
                   struct answer *parts)
{
    static struct verdict verdict;
    struct obstacles_query q = *query;
    q.line.near_m = q.band.near_m = near_m;
    if (verdict_begin(&verdict, by, &q, near_m))
        while (verdict_step(&verdict))
            ;
    for (size_t i = 0; i < obstacles_parts(&q); i++)
        parts[i] = *verdict_of(&verdict, i);
}

void asked_of_store(const struct asking *asking, const struct store *store, const struct obstacles_query *query,
                    struct answer *parts)
{
    static struct store_list list;
    store_list(store, &list);
    const struct verdict_evidence by = {asking->picture, store, &list, &asking->limits, &asking->now};
    answer(&by, asking->near_m, query, parts);
}

void asked_of_pipeline(struct pipeline *pipeline, const struct asking *asking, const struct obstacles_query *query,
                       struct answer *parts)
{
    struct records *records = pipeline_records(pipeline);
    struct records_reading reading = {0};
    records_open(records, &reading);
    const struct verdict_evidence by = {asking->picture, records->store, &reading.list, &asking->limits,
                                        &asking->now};
    answer(&by, asking->near_m, query, parts);
    records_close(records, &reading);
}
