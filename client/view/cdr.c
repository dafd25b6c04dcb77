/* SPDX-License-Identifier: MIT */
#include "cdr.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define TYPES_MAX 32
#define LINE_MAX_ 160

/* ---- the schema ---- */

static const char *kind_name(enum message_kind kind)
{
    switch (kind) {
    case MESSAGE_DOUBLE:
        return "float64";
    case MESSAGE_FLOAT:
        return "float32";
    case MESSAGE_INT64:
        return "int64";
    case MESSAGE_INT32:
        return "int32";
    case MESSAGE_FIXED32:
        return "uint32";
    case MESSAGE_FLAG:
        return "bool";
    case MESSAGE_TEXT:
        return "string";
    case MESSAGE_BYTES:
        return "uint8[]";
    case MESSAGE_SIGNED_BYTES:
        return "int8[]";
    default:
        return "uint8";
    }
}

/* std_msgs/msg/Header is std_msgs/Header in a definition. */
static void short_name(const struct message_type *type, char name[LINE_MAX_])
{
    const char *slash = strchr(type->name, '/'), *last = strrchr(type->name, '/');
    snprintf(name, LINE_MAX_, "%.*s%s", (int)(slash - type->name), type->name, last);
}

static void put_line(struct bytes *out, const char *line)
{
    bytes_put(out, line, strlen(line));
}

static void put_fields(struct bytes *out, const struct message_type *type)
{
    char name[LINE_MAX_], line[2 * LINE_MAX_];
    for (const struct message_field *f = type->fields; f->name; f++) {
        if (f->of)
            short_name(f->of, name);
        else
            snprintf(name, sizeof name, "%s", kind_name(f->kind));
        snprintf(line, sizeof line, "%s%s %s\n", name, f->repeated ? "[]" : "", f->name);
        put_line(out, line);
    }
}

void cdr_schema(const struct message_type *type, struct bytes *out)
{
    static const char between[] =
        "================================================================================\n";
    const struct message_type *of[TYPES_MAX] = {type};
    char name[LINE_MAX_], line[2 * LINE_MAX_];
    size_t n = 1;

    for (size_t i = 0; i < n; i++) {
        if (i > 0) {
            short_name(of[i], name);
            snprintf(line, sizeof line, "%sMSG: %s\n", between, name);
            put_line(out, line);
        }
        put_fields(out, of[i]);
        for (const struct message_field *f = of[i]->fields; f->name; f++) {
            size_t k = 0;
            while (f->of && k < n && of[k] != f->of)
                k++;
            if (f->of && k == n && n < TYPES_MAX)
                of[n++] = f->of;
        }
    }
}

/* ---- messages ---- */

/* Numbers lie at multiples of their size, counted from behind the head of the message. */
static void put_number(struct bytes *out, uint64_t bits, int size)
{
    static const uint8_t zeros[8];
    bytes_put(out, zeros, -(out->size - 4) & ((size_t)size - 1));
    bytes_number(out, bits, size);
}

static double double_of(const json_t *value)
{
    if (json_is_string(value))
        return strcmp(json_string_value(value), "inf") == 0 ? (double)INFINITY : (double)NAN;
    return json_is_number(value) ? json_number_value(value) : !value ? 0.0 : (double)NAN;
}

static void put_real(struct bytes *out, enum message_kind kind, double value)
{
    const float f = (float)value;
    uint32_t half;
    uint64_t whole;
    memcpy(&half, &f, sizeof half);
    memcpy(&whole, &value, sizeof whole);
    if (kind == MESSAGE_DOUBLE)
        put_number(out, whole, 8);
    else
        put_number(out, half, 4);
}

static void put_text(struct bytes *out, const json_t *value)
{
    const char *text = json_is_string(value) ? json_string_value(value) : "";
    put_number(out, strlen(text) + 1, 4);
    bytes_put(out, text, strlen(text) + 1);
}

static void put_fields_of(struct bytes *out, const struct message_type *type, const json_t *message);

static void put_one(struct bytes *out, const struct message_field *f, const json_t *value)
{
    const uint64_t number = json_is_boolean(value) ? json_is_true(value) : (uint64_t)json_integer_value(value);
    switch (f->kind) {
    case MESSAGE_OBJECT:
        put_fields_of(out, f->of, value);
        break;
    case MESSAGE_DOUBLE:
    case MESSAGE_FLOAT:
        put_real(out, f->kind, double_of(value));
        break;
    case MESSAGE_TEXT:
        put_text(out, value);
        break;
    case MESSAGE_BYTES:
    case MESSAGE_SIGNED_BYTES:
        put_number(out, json_string_length(value), 4);
        bytes_put(out, json_string_value(value), json_string_length(value));
        break;
    case MESSAGE_INT64:
        put_number(out, number, 8);
        break;
    case MESSAGE_INT32:
    case MESSAGE_FIXED32:
        put_number(out, number, 4);
        break;
    default:
        put_number(out, number, 1);
        break;
    }
}

static void put_fields_of(struct bytes *out, const struct message_type *type, const json_t *message)
{
    for (const struct message_field *f = type->fields; f->name; f++) {
        const json_t *value = json_object_get(message, f->name), *one;
        size_t i;
        if (!f->repeated) {
            put_one(out, f, value);
            continue;
        }
        put_number(out, json_array_size(value), 4);
        json_array_foreach(value, i, one) put_one(out, f, one);
    }
}

void cdr_message(const struct message_type *type, const json_t *message, struct bytes *out)
{
    static const uint8_t head[] = {0, 1, 0, 0}; /* CDR, little-endian */
    bytes_put(out, head, sizeof head);
    put_fields_of(out, type, message);
}
