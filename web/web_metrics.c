/* SPDX-License-Identifier: MIT */
#include "web_metrics.h"

#include <string.h>

/* Faster than any vehicle: then the answer is the water's. */
#define AHEAD "{\"velocity_mps\":[10,0,0]}"

const struct web_metrics_question web_metrics_question[WEB_METRICS_QUESTIONS] = {
    {"stats", NULL}, {"sectors", NULL}, {"limit", AHEAD}};

static double number(const json_t *object, const char *key)
{
    return json_number_value(json_object_get(object, key));
}

/* Within quotes, or behind # HELP. */
static void print_escaped(FILE *out, const char *text)
{
    for (const char *c = text ? text : ""; *c; c++) {
        if (*c == '\\' || *c == '"')
            fputc('\\', out);
        if (*c == '\n')
            fputs("\\n", out);
        else
            fputc(*c, out);
    }
}

/* {a="b",c="d"}, with le="..." as the last; nothing at all without labels. */
static void print_labels(FILE *out, const json_t *labels, const char *le)
{
    const char *key, *before = "{";
    json_t *value;

    json_object_foreach((json_t *)labels, key, value)
    {
        fprintf(out, "%s%s=\"", before, key);
        print_escaped(out, json_string_value(value));
        fputc('"', out);
        before = ",";
    }
    if (le)
        fprintf(out, "%sle=\"%s\"", before, le);
    if (le || json_object_size(labels) > 0)
        fputc('}', out);
}

/* The buckets of stats include all before, as those of Prometheus do. */
static void print_histogram(FILE *out, const char *name, const json_t *sample)
{
    const json_t *labels = json_object_get(sample, "labels"), *buckets = json_object_get(sample, "buckets");
    char le[32];
    for (size_t i = 0; i < json_array_size(buckets); i++) {
        const json_t *bucket = json_array_get(buckets, i);
        snprintf(le, sizeof le, "%.9g", json_number_value(json_array_get(bucket, 0)));
        fprintf(out, "%s_bucket", name);
        print_labels(out, labels, le);
        fprintf(out, " %.15g\n", json_number_value(json_array_get(bucket, 1)));
    }
    fprintf(out, "%s_bucket", name);
    print_labels(out, labels, "+Inf");
    fprintf(out, " %.15g\n%s_sum", number(sample, "count"), name);
    print_labels(out, labels, NULL);
    fprintf(out, " %.15g\n%s_count", number(sample, "sum_s"), name);
    print_labels(out, labels, NULL);
    fprintf(out, " %.15g\n", number(sample, "count"));
}

static void print_stats(FILE *out, const json_t *stats)
{
    const json_t *metrics = json_object_get(stats, "metrics");
    for (size_t i = 0; i < json_array_size(metrics); i++) {
        const json_t *metric = json_array_get(metrics, i), *samples = json_object_get(metric, "samples");
        const char *name = json_string_value(json_object_get(metric, "name"));
        const char *type = json_string_value(json_object_get(metric, "type"));
        if (!name || !type)
            continue;
        fprintf(out, "# HELP %s ", name);
        print_escaped(out, json_string_value(json_object_get(metric, "help")));
        fprintf(out, "\n# TYPE %s %s\n", name, type);
        for (size_t k = 0; k < json_array_size(samples); k++) {
            const json_t *sample = json_array_get(samples, k);
            if (strcmp(type, "histogram") == 0) {
                print_histogram(out, name, sample);
            } else {
                fputs(name, out);
                print_labels(out, json_object_get(sample, "labels"), NULL);
                fprintf(out, " %.15g\n", number(sample, "value"));
            }
        }
    }
}

static void print_gauge(FILE *out, const char *name, const char *help)
{
    fprintf(out, "# HELP %s %s\n# TYPE %s gauge\n", name, help, name);
}

/* As far as the daemon judges them by default, its look_ahead. */
static void print_sectors(FILE *out, const json_t *answer)
{
    static const char *const states[] = {"clear", "blocked", "unknown"};
    const json_t *sectors = json_object_get(answer, "sectors");
    if (!json_is_array(sectors))
        return;
    print_gauge(out, "sonard_sectors", "sectors of the default ring in each state");
    for (size_t i = 0; i < sizeof states / sizeof *states; i++) {
        unsigned n = 0;
        for (size_t k = 0; k < json_array_size(sectors); k++) {
            const char *state = json_string_value(json_object_get(json_array_get(sectors, k), "state"));
            n += state && strcmp(state, states[i]) == 0;
        }
        fprintf(out, "sonard_sectors{state=\"%s\"} %u\n", states[i], n);
    }
    print_gauge(out, "sonard_sectors_distance_metres", "how far these sectors are judged");
    fprintf(out, "sonard_sectors_distance_metres %.15g\n", number(answer, "distance_m"));
}

static void print_limit(FILE *out, const json_t *answer)
{
    const char *by = json_string_value(json_object_get(answer, "limited_by"));
    if (!by)
        return;
    print_gauge(out, "sonard_limit_ahead_mps", "how fast the vehicle may go ahead, of 10 m/s asked");
    fputs("sonard_limit_ahead_mps{limited_by=\"", out);
    print_escaped(out, by);
    fprintf(out, "\"} %.15g\n", number(answer, "speed_mps"));
}

void web_metrics_print(FILE *out, json_t *const result[WEB_METRICS_QUESTIONS])
{
    print_stats(out, result[0]);
    print_sectors(out, result[1]);
    print_limit(out, result[2]);
}
