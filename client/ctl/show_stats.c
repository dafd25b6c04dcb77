/* SPDX-License-Identifier: MIT */
#include "show_stats.h"

#include <string.h>

static const char *text(const json_t *object, const char *key)
{
    const char *s = json_string_value(json_object_get(object, key));
    return s ? s : "";
}

static double number(const json_t *object, const char *key)
{
    return json_number_value(json_object_get(object, key));
}

/* In a label's value and in a help text the format wants these escaped. */
static void put_escaped(FILE *out, const char *s)
{
    for (; *s; s++) {
        if (*s == '\n')
            fputs("\\n", out);
        else if (*s == '\\' || *s == '"')
            fprintf(out, "\\%c", *s);
        else
            fputc(*s, out);
    }
}

/* name{label="value"}; le NULL: none. */
static void put_name(FILE *out, const char *name, const char *ending, json_t *labels, const char *le)
{
    const char *key, *separator = "{";
    json_t *value;

    fprintf(out, "%s%s", name, ending);
    json_object_foreach(labels, key, value)
    {
        fprintf(out, "%s%s=\"", separator, key);
        put_escaped(out, json_is_string(value) ? json_string_value(value) : "");
        fputc('"', out);
        separator = ",";
    }
    if (le) {
        fprintf(out, "%sle=\"%s\"", separator, le);
        separator = ",";
    }
    fputs(separator[0] == ',' ? "} " : " ", out);
}

static void put_histogram(FILE *out, const char *name, const json_t *sample)
{
    json_t *labels = json_object_get(sample, "labels"), *buckets = json_object_get(sample, "buckets");
    char le[32];
    for (size_t i = 0; i < json_array_size(buckets); i++) {
        const json_t *bucket = json_array_get(buckets, i);
        snprintf(le, sizeof le, "%.9g", json_number_value(json_array_get(bucket, 0)));
        put_name(out, name, "_bucket", labels, le);
        fprintf(out, "%.15g\n", json_number_value(json_array_get(bucket, 1)));
    }
    put_name(out, name, "_bucket", labels, "+Inf");
    fprintf(out, "%.15g\n", number(sample, "count"));
    put_name(out, name, "_sum", labels, NULL);
    fprintf(out, "%.15g\n", number(sample, "sum_s"));
    put_name(out, name, "_count", labels, NULL);
    fprintf(out, "%.15g\n", number(sample, "count"));
}

void show_stats_prometheus(FILE *out, const json_t *result)
{
    const json_t *metrics = json_object_get(result, "metrics");
    for (size_t i = 0; i < json_array_size(metrics); i++) {
        const json_t *metric = json_array_get(metrics, i), *samples = json_object_get(metric, "samples");
        const char *name = text(metric, "name"), *type = text(metric, "type");
        fprintf(out, "# HELP %s ", name);
        put_escaped(out, text(metric, "help"));
        fprintf(out, "\n# TYPE %s %s\n", name, type);
        for (size_t k = 0; k < json_array_size(samples); k++) {
            const json_t *sample = json_array_get(samples, k);
            if (strcmp(type, "histogram") == 0) {
                put_histogram(out, name, sample);
            } else {
                put_name(out, name, "", json_object_get(sample, "labels"), NULL);
                fprintf(out, "%.15g\n", number(sample, "value"));
            }
        }
    }
}

void show_stats(FILE *out, const json_t *result)
{
    const json_t *metrics = json_object_get(result, "metrics");
    for (size_t i = 0; i < json_array_size(metrics); i++) {
        const json_t *metric = json_array_get(metrics, i), *samples = json_object_get(metric, "samples");
        const char *name = text(metric, "name"), *help = text(metric, "help");
        for (size_t k = 0; k < json_array_size(samples); k++) {
            const json_t *sample = json_array_get(samples, k), *buckets = json_object_get(sample, "buckets");
            if (number(sample, buckets ? "count" : "value") == 0)
                continue;
            put_name(out, name, "", json_object_get(sample, "labels"), NULL);
            if (buckets)
                fprintf(out, "%.0f times; %.1f us median, %.1f us 99 %%, %.1f us max\n", number(sample, "count"),
                        number(sample, "p50_us"), number(sample, "p99_us"), number(sample, "max_us"));
            else
                fprintf(out, "%.15g  %s\n", number(sample, "value"), help);
        }
    }
}
