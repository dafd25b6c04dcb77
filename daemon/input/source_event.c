/* SPDX-License-Identifier: MIT */
#include "source_event.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define NO_PORT "no port"

static const char *const kind_words[] = {[SOURCE_OPENED] = "opened",
                                         [SOURCE_CLOSED] = "closed",
                                         [SOURCE_TICK] = "tick",
                                         [SOURCE_LOOKS] = "looks",
                                         [SOURCE_STATE] = "state"};

static const char *const state_words[] = {[DEVICE_CLOSED] = "closed",
                                          [DEVICE_IDENTIFY] = "asking who is there",
                                          [DEVICE_SETUP] = "setting up",
                                          [DEVICE_RUNNING] = "running",
                                          [DEVICE_SILENT] = "silent"};

const char *source_state_word(bool open, enum device_state state)
{
    return open ? state_words[state] : NO_PORT;
}

size_t source_event_write(const struct source_event *event, char text[SOURCE_EVENT_TEXT_MAX])
{
    const char *kind = kind_words[event->kind];
    int n;
    if (event->kind == SOURCE_LOOKS)
        n = snprintf(text, SOURCE_EVENT_TEXT_MAX,
                     "{\"event\":\"%s\",\"from_rad\":%.17g,\"to_rad\":%.17g,\"only\":%s}", kind, event->from_rad,
                     event->to_rad, event->only ? "true" : "false");
    else if (event->kind == SOURCE_STATE)
        n = snprintf(text, SOURCE_EVENT_TEXT_MAX, "{\"event\":\"%s\",\"state\":\"%s\"}", kind,
                     source_state_word(event->open, event->state));
    else
        n = snprintf(text, SOURCE_EVENT_TEXT_MAX, "{\"event\":\"%s\"}", kind);
    return (size_t)n;
}

/* The number of a word among n; n: it is none of them. */
static unsigned word_number(const json_t *object, const char *name, const char *const *words, unsigned n)
{
    const char *word = json_string_value(json_object_get(object, name));
    unsigned i = 0;
    while (i < n && (!word || strcmp(word, words[i]) != 0))
        i++;
    return i;
}

static bool read_looks(json_t *object, struct source_event *out)
{
    int only = 0;
    if (json_unpack(object, "{s:F, s:F, s:b}", "from_rad", &out->from_rad, "to_rad", &out->to_rad, "only",
                    &only) != 0)
        return false;
    out->only = only != 0;
    return fabs(out->from_rad) <= 2 * GEO_TURN && fabs(out->to_rad) <= 2 * GEO_TURN;
}

static bool read_state(const json_t *object, struct source_event *out)
{
    const unsigned n = sizeof state_words / sizeof *state_words;
    const char *word = json_string_value(json_object_get(object, "state"));
    const unsigned state = word_number(object, "state", state_words, n);
    out->open = state < n;
    out->state = out->open ? (enum device_state)state : DEVICE_CLOSED;
    return out->open || (word && strcmp(word, NO_PORT) == 0);
}

bool source_event_read(const void *text, size_t n, struct source_event *out, struct fault *fault)
{
    const unsigned kinds = sizeof kind_words / sizeof *kind_words;
    json_t *object = json_loadb(text, n, 0, NULL);
    const unsigned kind = word_number(object, "event", kind_words, kinds);
    *out = (struct source_event){.kind = (enum source_event_kind)kind};
    const bool good = kind < kinds && (kind != SOURCE_LOOKS || read_looks(object, out)) &&
                      (kind != SOURCE_STATE || read_state(object, out));
    json_decref(object);
    return good || fault_set(fault, "not an event of a sonar");
}
