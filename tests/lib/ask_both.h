/* SPDX-License-Identifier: MIT */
/* ask_both.h - a question to a picture and to records of free water, asked to its end. */
#ifndef SONARD_TEST_ASK_BOTH_H
#define SONARD_TEST_ASK_BOTH_H

#include "grid/answer/verdict.h"

/* Of whom, by which limits, when. */
struct asker {
    struct picture *picture;
    const struct store *store;
    const struct answer_conf *conf;
    const struct answer_now *now;
};

static inline const struct verdict *ask_both(const struct asker *by, const struct obstacles_query *q, double own_m)
{
    static struct store_list list;
    static struct verdict v;
    store_list(by->store, &list);
    const struct verdict_evidence evidence = {by->picture, by->store, &list, by->conf, by->now};
    for (bool more = verdict_begin(&v, &evidence, q, own_m); more;)
        more = verdict_step(&v);
    return &v;
}

#endif
