/* SPDX-License-Identifier: MIT */
/* test_show_stats - counters for people, and in the text format of Prometheus with its escapes. */
#include "client/ctl/show_stats.h"
#include "tests/lib/test.h"

#define METRICS                                                                                                   \
    "{\"metrics\":[{\"name\":\"a_total\",\"type\":\"counter\",\"help\":\"one\\ntwo \\\\\",\"samples\":["          \
    "{\"labels\":{\"sensor\":\"he\\\"ad\",\"kind\":\"x\"},\"value\":12},{\"labels\":{},\"value\":0}]},"           \
    "{\"name\":\"wait_seconds\",\"type\":\"histogram\",\"help\":\"so long\",\"samples\":[{\"labels\":"            \
    "{\"stage\":\"maps\"},\"buckets\":[[0.001,3],[0.01,5]],\"count\":6,\"sum_s\":0.25,\"p50_us\":900,"            \
    "\"p99_us\":12000,\"max_us\":20000.5},{\"labels\":{},\"buckets\":[],\"count\":0,\"sum_s\":0}]}]}"

static void check_text(void (*show)(FILE *out, const json_t *result), const char *wanted)
{
    json_t *result = json_loads(METRICS, 0, NULL);
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    CHECK(result != NULL);
    show(out, result);
    fclose(out);
    CHECK_STR(text, wanted);
    free(text);
    json_decref(result);
}

TEST(as_prometheus_wants_it)
{
    check_text(show_stats_prometheus, "# HELP a_total one\\ntwo \\\\\n"
                                      "# TYPE a_total counter\n"
                                      "a_total{sensor=\"he\\\"ad\",kind=\"x\"} 12\n"
                                      "a_total 0\n"
                                      "# HELP wait_seconds so long\n"
                                      "# TYPE wait_seconds histogram\n"
                                      "wait_seconds_bucket{stage=\"maps\",le=\"0.001\"} 3\n"
                                      "wait_seconds_bucket{stage=\"maps\",le=\"0.01\"} 5\n"
                                      "wait_seconds_bucket{stage=\"maps\",le=\"+Inf\"} 6\n"
                                      "wait_seconds_sum{stage=\"maps\"} 0.25\n"
                                      "wait_seconds_count{stage=\"maps\"} 6\n"
                                      "wait_seconds_bucket{le=\"+Inf\"} 0\n"
                                      "wait_seconds_sum 0\n"
                                      "wait_seconds_count 0\n");
}

/* What never happened is left out. */
TEST(for_people)
{
    check_text(show_stats,
               "a_total{sensor=\"he\\\"ad\",kind=\"x\"} 12  one\ntwo \\\n"
               "wait_seconds{stage=\"maps\"} 6 times; 900.0 us median, 12000.0 us 99 %, 20000.5 us max\n");
}

int main(void)
{
    RUN(as_prometheus_wants_it);
    RUN(for_people);
    return test_end();
}
