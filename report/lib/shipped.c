/* SPDX-License-Identifier: MIT */
/* shipped - see shipped.h. */
#include "shipped.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/wiring.h"
#include "grid/range/extract.h"
#include "grid/range/marks.h"
#include "grid/range/own_echo.h"

struct shipped {
    struct extract *extract;
    struct marks marks;
    struct own_echo own_echo;
    void *fresh; /* the extractor before its first ping */
    size_t bytes;
};

const char *const shipped_knob_name = "min_contrast";
const double shipped_knob[SHIPPED_KNOBS] = {8, 10, 12, 14, 17, 20, 25};
const unsigned shipped_knob_default = 3;

/* value: room for the text, which the row points to. */
static struct knob row_of(double knob, char value[32])
{
    snprintf(value, 32, "%g dB", knob);
    return (struct knob)KNOB_KEY("extract", shipped_knob_name, value);
}

struct shipped *shipped_make(double knob, uint32_t max_bins)
{
    char value[32];
    const struct knob row = row_of(knob, value);
    struct extract_conf extract;
    struct conf conf;
    knob_conf(&row, &conf);
    wiring_extract(&conf, 0, &extract);
    return shipped_make_as(&extract, max_bins);
}

void shipped_configuration(double knob, char text[KNOB_TEXT_MAX])
{
    char value[32];
    const struct knob row = row_of(knob, value);
    knob_configuration(&row, text);
}

struct shipped *shipped_make_as(const struct extract_conf *conf, uint32_t max_bins)
{
    struct shipped *s = calloc(1, sizeof *s);
    struct fault fault = {"no memory"};
    if (s) {
        s->bytes = extract_size(max_bins);
        void *mem = calloc(1, s->bytes);
        s->fresh = calloc(1, s->bytes);
        s->extract = mem && s->fresh ? extract_init(mem, conf, max_bins, &fault) : NULL;
    }
    if (!s || !s->extract) {
        fprintf(stderr, "shipped: %s\n", fault.text);
        exit(1);
    }
    memcpy(s->fresh, s->extract, s->bytes);
    return s;
}

void shipped_free(struct shipped *s)
{
    free(s->extract);
    free(s->fresh);
    free(s);
}

void shipped_begin(struct shipped *s)
{
    memcpy(s->extract, s->fresh, s->bytes);
    marks_init(&s->marks, 1500.0);
    own_echo_init(&s->own_echo);
}

void shipped_run(struct shipped *s, const struct ping *ping, struct echoes *out)
{
    extract_run(s->extract, ping, NULL, out);
    marks_run(&s->marks, out);
    own_echo_run(&s->own_echo, out, &mount_identity);
}
