/* SPDX-License-Identifier: MIT */
/*
 * cost - what a setting costs: nanoseconds of many repetitions, and the marks by which callgrind counts instructions.
 * Knows nothing of what is measured.
 */
#ifndef SONARD_REPORT_COST_H
#define SONARD_REPORT_COST_H

struct cost_spread {
    double median, low, high; /* low and high: the quarters */
};

/** cost_now_ns - the monotonic clock. */
double cost_now_ns(void);

/** cost_spread_of - sorts value[n]; n >= 1. */
struct cost_spread cost_spread_of(double *value, unsigned n);

/** cost_quantile - of sorted value[n], q in [0, 1]; 0 when there is none. */
double cost_quantile(const double *sorted, unsigned n, double q);

/** cost_sort - ascending. */
void cost_sort(double *value, unsigned n);

/** cost_mark - the end of a setting: report.py lets callgrind write down here what it has counted since the last. */
void cost_mark(void);

#endif
