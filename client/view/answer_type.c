/* SPDX-License-Identifier: MIT */
#include "answer_type.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TYPES_MAX 64

/* Those made so far, by the fields that they are made of. */
static struct made {
    const struct protocol_field *from;
    struct message_type type;
} made[TYPES_MAX];
static size_t n_made;

static const struct message_type *make(const char *name, size_t n, const struct protocol_field *from);

static bool is(const char *name, const char *type, size_t n)
{
    return strlen(name) == n && strncmp(name, type, n) == 0;
}

/* The type that a name of n bytes stands for; NULL: it is no object. */
static const struct message_type *object_of(const char *type, size_t n)
{
    for (const struct protocol_shape *s = protocol_shapes; s->name; s++)
        if (is(s->name, type, n))
            return make(type, n, s->fields);
    for (const struct protocol_method *m = protocol_methods; m->name; m++)
        if (is(m->name, type, n) && m->result)
            return make(type, n, m->result);
    return NULL;
}

static enum message_kind kind_of(const char *type, size_t n, bool maybe)
{
    static const char *const doubles[] = {"number", "amount", "share", "age", "triple"};
    static const char *const counts[] = {"integer", "count", "misses"};
    for (size_t i = 0; i < sizeof doubles / sizeof *doubles; i++)
        if (is(doubles[i], type, n))
            return MESSAGE_DOUBLE;
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
        if (is(counts[i], type, n))
            return maybe ? MESSAGE_DOUBLE : MESSAGE_INT64;
    return is("flag", type, n) ? MESSAGE_FLAG : MESSAGE_TEXT;
}

/* A type is a name and then suffixes: [] or [N], ?. */
static void take(struct message_field *field, const struct protocol_field *from)
{
    const size_t n = strcspn(from->type, "[?"), suffixes = strlen(from->type) - n;
    const char *suffix = from->type + n;
    field->name = from->name;
    field->repeated = memchr(suffix, '[', suffixes) || is("triple", from->type, n);
    field->maybe = !field->repeated && (from->maybe || memchr(suffix, '?', suffixes) || is("age", from->type, n));
    field->of = object_of(from->type, n);
    field->kind = field->of ? MESSAGE_OBJECT : kind_of(from->type, n, field->maybe);
    field->maybe &= field->kind == MESSAGE_DOUBLE;
}

static const struct message_type *make(const char *name, size_t n, const struct protocol_field *from)
{
    size_t count = 0;
    for (size_t i = 0; i < n_made; i++)
        if (made[i].from == from)
            return &made[i].type;
    while (from[count].name)
        count++;
    struct message_field *fields = calloc(count + 1, sizeof *fields);
    char *full = malloc(sizeof "sonard." + n);

    if (!fields || !full || n_made == TYPES_MAX) {
        free(fields);
        free(full);
        return NULL;
    }
    snprintf(full, sizeof "sonard." + n, "sonard.%.*s", (int)n, name);
    for (size_t i = 0; i < count; i++) {
        fields[i].number = (int)i + 1;
        take(&fields[i], &from[i]);
    }
    made[n_made] = (struct made){.from = from, .type = {.name = full, .fields = fields}};
    return &made[n_made++].type;
}

const struct message_type *answer_type(const char *method)
{
    const struct protocol_method *m = protocol_find(method);
    return m && m->result ? make(m->name, strlen(m->name), m->result) : NULL;
}
