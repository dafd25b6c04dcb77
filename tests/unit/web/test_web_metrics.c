/* SPDX-License-Identifier: MIT */
/* What the daemon answers, as Prometheus reads it. */
#include "tests/lib/test.h"
#include "web/web_metrics.h"

static void check_answers(const char *stats, const char *sectors, const char *limit, const char *want)
{
    json_t *read[WEB_METRICS_QUESTIONS] = {json_loads(stats, 0, NULL), json_loads(sectors, 0, NULL),
                                           json_loads(limit, 0, NULL)};
    char *text = NULL;
    size_t n;
    FILE *out = open_memstream(&text, &n);
    CHECK(read[0] && read[1] && read[2] && out);
    web_metrics_print(out, read);
    fclose(out);
    CHECK_STR(text, want);
    free(text);
    for (int i = 0; i < WEB_METRICS_QUESTIONS; i++)
        json_decref(read[i]);
}

static void check(const char *stats, const char *want)
{
    check_answers(stats, "{}", "{}", want);
}

TEST(questions)
{
    for (int i = 0; i < WEB_METRICS_QUESTIONS; i++) {
        json_t *params =
            web_metrics_question[i].params ? json_loads(web_metrics_question[i].params, 0, NULL) : NULL;

        CHECK(json_is_object(params) == !!web_metrics_question[i].params);
        json_decref(params);
    }
    check_answers("{}",
                  "{\"distance_m\":7.5,\"sectors\":[{\"state\":\"clear\"},{\"state\":\"unknown\"},{},7,"
                  "{\"state\":\"clear\"}]}",
                  "{\"speed_mps\":0.25,\"limited_by\":\"unknown\"}",
                  "# HELP sonard_sectors sectors of the default ring in each state\n# TYPE sonard_sectors gauge\n"
                  "sonard_sectors{state=\"clear\"} 2\nsonard_sectors{state=\"blocked\"} 0\n"
                  "sonard_sectors{state=\"unknown\"} 1\n"
                  "# HELP sonard_sectors_distance_metres how far these sectors are judged\n"
                  "# TYPE sonard_sectors_distance_metres gauge\nsonard_sectors_distance_metres 7.5\n"
                  "# HELP sonard_limit_ahead_mps how fast the vehicle may go ahead, of 10 m/s asked\n"
                  "# TYPE sonard_limit_ahead_mps gauge\nsonard_limit_ahead_mps{limited_by=\"unknown\"} 0.25\n");
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
    RUN(questions);
    RUN(counters_and_labels);
    RUN(histograms);
    RUN(what_is_no_metric);
    return test_end();
}
