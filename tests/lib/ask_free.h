/* SPDX-License-Identifier: MIT */
/* ask_free.h - a question to records of water, asked to its end. */
#ifndef SONARD_TEST_ASK_FREE_H
#define SONARD_TEST_ASK_FREE_H

#include "grid/water/ask.h"

static inline struct ask_answer ask_free(const struct water_view *view, int n, const struct ask_question *question)
{
    static struct ask ask;
    ask_begin(&ask, view, n, question);
    while (ask_step(&ask))
        ;
    return ask_end(&ask, 0);
}

#endif
