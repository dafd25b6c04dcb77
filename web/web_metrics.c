/* SPDX-License-Identifier: MIT */
#include "web_metrics.h"

#include <string.h>

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

void web_metrics_print(FILE *out, const json_t *stats)
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
