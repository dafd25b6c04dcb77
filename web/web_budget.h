/* SPDX-License-Identifier: MIT */
/* web_budget - how many bytes of answers wait for clients that are slow to take them, all together. */
#ifndef SONARD_WEB_BUDGET_H
#define SONARD_WEB_BUDGET_H

#include <stdbool.h>
#include <stddef.h>

#define WEB_BUDGET_BYTES (8u << 20)

struct web_budget {
    size_t used;
};

/** web_budget_take - n bytes more; false: that would be too much. */
static inline bool web_budget_take(struct web_budget *budget, size_t n)
{
    if (n > WEB_BUDGET_BYTES - budget->used)
        return false;
    budget->used += n;
    return true;
}

/** web_budget_give - n bytes that were taken wait no longer. */
static inline void web_budget_give(struct web_budget *budget, size_t n)
{
    budget->used -= n;
}

#endif
