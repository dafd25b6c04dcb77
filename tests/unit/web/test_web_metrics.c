/* SPDX-License-Identifier: MIT */
/* The result of stats as Prometheus reads it. */
#include "tests/lib/test.h"
#include "web/web_metrics.h"

static void check(const char *stats, const char *want)
{
    json_t *read = json_loads(stats, 0, NULL);
    char *text = NULL;
    size_t n;
    FILE *out = open_memstream(&text, &n);

    CHECK(read && out);
    web_metrics_print(out, read);
    fclose(out);
    CHECK_STR(text, want);
    free(text);
    json_decref(read);
}

TEST(counters_and_labels)
{
    check("{\"metrics\":[{\"name\":\"sonard_pings_total\",\"type\":\"counter\",\"help\":\"pings\",\"samples\":["
          "{\"labels\":{},\"value\":123456789012},{\"labels\":{\"sensor\":\"a\\\"b\\\\\\n\"},\"value\":0.5}]}]}",
          "# HELP sonard_pings_total pings\n# TYPE sonard_pings_total counter\nsonard_pings_total 123456789012\n"
          "sonard_pings_total{sensor=\"a\\\"b\\\\\\n\"} 0.5\n");
}

TEST(histograms)
{
    check("{\"metrics\":[{\"name\":\"s\",\"type\":\"histogram\",\"help\":\"h\",\"samples\":[{\"labels\":"
          "{\"stage\":\"maps\"},\"count\":5,\"sum_s\":0.25,\"buckets\":[[1e-6,2],[0.1,4]]}]}]}",
          "# HELP s h\n# TYPE s histogram\ns_bucket{stage=\"maps\",le=\"1e-06\"} 2\n"
          "s_bucket{stage=\"maps\",le=\"0.1\"} 4\ns_bucket{stage=\"maps\",le=\"+Inf\"} 5\n"
          "s_sum{stage=\"maps\"} 0.25\ns_count{stage=\"maps\"} 5\n");
}

TEST(what_is_no_metric)
{
    check("{\"metrics\":[1,{},{\"name\":\"a\"},{\"name\":\"a\",\"type\":\"gauge\",\"samples\":7}]}",
          "# HELP a \n# TYPE a gauge\n");
}

int main(void)
{
    RUN(counters_and_labels);
    RUN(histograms);
    RUN(what_is_no_metric);
    return test_end();
}
