/* SPDX-License-Identifier: MIT */
/*
 * line_time - see line_time.h.
 */
#include "line_time.h"

#define SECOND 1000000000ull

uint64_t line_ns(unsigned baud, size_t bytes)
{
    return baud ? bytes * 10u * SECOND / baud : 0;
}

static uint64_t before(uint64_t t_ns, uint64_t ago_ns)
{
    return t_ns > ago_ns ? t_ns - ago_ns : 0;
}

uint64_t transmitted_ns(uint64_t first_ns, uint64_t last_ns, size_t bytes, unsigned baud, uint64_t listening_ns)
{
    uint64_t started_ns = before(last_ns, line_ns(baud, bytes));
    return before(started_ns < first_ns ? started_ns : first_ns, listening_ns);
}
