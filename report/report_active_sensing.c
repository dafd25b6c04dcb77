/* SPDX-License-Identifier: MIT */
/*
 * report_active_sensing - what steering a head is worth: a virtual Ping360 on a vehicle under way, and things that
 * appear within 20 degrees of its way, anywhere in a turn. The rig, its seed and its figures are those of
 * tests/unit/daemon/pipeline/test_active_sensing.c.
 *
 *   report_active_sensing [quick]   CSV: way, things, share, noticed_s, longest_wait_s
 *
 * noticed_s: until a ping goes there, of that share of the things; longest_wait_s: of any bearing, between two pings.
 */
#include <stdio.h>

#include "tests/lib/active_sensing_rig.h"
#include "report/lib/cost.h"

#define SEED  20260101u
#define STEPS 20

int main(int argc, char **argv)
{
    static const char *const names[] = {"plain by itself", "plain asked for every ping", "active",
                                        "active with a circle of 90 s"};
    static double delay_s[ALL];
    const unsigned runs = argc > 1 && argv[1][0] == 'q' ? 1 : RUNS;
    printf("way,things,share,noticed_s,longest_wait_s\n");
    for (int way = PLAIN_AUTO; way <= ACTIVE_CIRCLE; way++) {
        double wait_s = 0;
        for (unsigned run = 0; run < runs; run++) {
            measure_run((enum way)way, SEED + 1000003u * run, delay_s + run * THINGS);
            wait_s = fmax(wait_s, rig.longest_wait_s);
        }
        cost_sort(delay_s, runs * THINGS);
        for (int k = 0; k <= STEPS; k++)
            printf("%s,%u,%g,%.1f,%.1f\n", names[way], runs * THINGS, (double)k / STEPS,
                   cost_quantile(delay_s, runs * THINGS, (double)k / STEPS), wait_s);
    }
    return test_case_failed;
}
