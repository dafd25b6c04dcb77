/* SPDX-License-Identifier: MIT */
#include "protobuf.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define TYPES_MAX 64  /* of a schema */
#define NAME_MAX_ 128 /* of a type or a file */

enum wire { VARINT = 0, EIGHT = 1, SIZED = 2, FOUR = 5 };

static int varint(uint8_t at[10], uint64_t v)
{
    int n = 0;
    for (; v >= 0x80; v >>= 7)
        at[n++] = (uint8_t)(v | 0x80);
    at[n++] = (uint8_t)v;
    return n;
}

static void put_varint(struct bytes *out, uint64_t v)
{
    uint8_t some[10];
    bytes_put(out, some, (size_t)varint(some, v));
}

static void put_tag(struct bytes *out, int number, enum wire wire)
{
    put_varint(out, (uint64_t)number << 3 | wire);
}

static void put_sized(struct bytes *out, int number, const void *data, size_t n)
{
    put_tag(out, number, SIZED);
    put_varint(out, n);
    bytes_put(out, data, n);
}

static void put_word(struct bytes *out, int number, const char *text)
{
    put_sized(out, number, text, strlen(text));
}

static void put_count(struct bytes *out, int number, uint64_t v)
{
    put_tag(out, number, VARINT);
    put_varint(out, v);
}

/* What is within a field is written first; then its length goes before it. */
static size_t begin(struct bytes *out, int number)
{
    put_tag(out, number, SIZED);
    return out->size;
}

static void end(struct bytes *out, size_t begun)
{
    uint8_t size[10];
    bytes_insert(out, begun, size, (size_t)varint(size, out->size - begun));
}

/* ---- the schema: numbers are those of descriptor.proto ---- */

struct types {
    const struct message_type *type[TYPES_MAX];
    size_t n;
};

static bool has(const struct types *types, const struct message_type *type)
{
    for (size_t i = 0; i < types->n; i++)
        if (types->type[i] == type)
            return true;
    return false;
}

/* What a type is made of comes before it. */
static void collect(struct types *types, const struct message_type *type)
{
    for (const struct message_field *f = type->fields; f->name; f++)
        if (f->of && !has(types, f->of))
            collect(types, f->of);
    if (types->n < TYPES_MAX)
        types->type[types->n++] = type;
}

/* foxglove.Log is in foxglove/Log.proto; Google's own type is where its makers have it. */
static const char *file_of(const struct message_type *type, char name[NAME_MAX_])
{
    const bool google = strncmp(type->name, "google.", 7) == 0;
    snprintf(name, NAME_MAX_, "%s.proto", type->name);
    for (char *c = name; c < name + strlen(type->name); c++)
        *c = *c == '.' ? '/' : google ? (char)tolower(*c) : *c;
    return name;
}

/* "Level: UNKNOWN DEBUG": an enumeration from 0 on. */
static void put_words(struct bytes *out, const char *words)
{
    const size_t enumeration = begin(out, 4), name = strcspn(words, ":");
    uint64_t value = 0;
    put_sized(out, 1, words, name);
    for (const char *word = words + name + 2; *word; value++) {
        const size_t n = strcspn(word, " "), one = begin(out, 2);
        put_sized(out, 1, word, n);
        put_count(out, 2, value);
        end(out, one);
        word += n + (word[n] == ' ');
    }
    end(out, enumeration);
}

static void put_field(struct bytes *out, const struct message_type *type, const struct message_field *f)
{
    const size_t field = begin(out, 2);
    char name[2 * NAME_MAX_];
    put_word(out, 1, f->name);
    put_count(out, 3, (uint64_t)f->number);
    put_count(out, 4, f->repeated ? 3 : 1);
    put_count(out, 5, f->kind);
    if (f->of)
        snprintf(name, sizeof name, ".%s", f->of->name);
    else if (f->words)
        snprintf(name, sizeof name, ".%s.%.*s", type->name, (int)strcspn(f->words, ":"), f->words);
    if (f->of || f->words)
        put_word(out, 6, name);
    end(out, field);
}

static void put_file(struct bytes *out, const struct message_type *type)
{
    const size_t file = begin(out, 1);
    const char *last = strrchr(type->name, '.');
    char name[NAME_MAX_];
    struct types used = {.n = 0};
    put_word(out, 1, file_of(type, name));
    put_sized(out, 2, type->name, (size_t)(last - type->name));
    for (const struct message_field *f = type->fields; f->name; f++)
        if (f->of && !has(&used, f->of) && used.n < TYPES_MAX) {
            used.type[used.n++] = f->of;
            put_word(out, 3, file_of(f->of, name));
        }
    const size_t message = begin(out, 4);

    put_word(out, 1, last + 1);
    for (const struct message_field *f = type->fields; f->name; f++)
        put_field(out, type, f);
    for (const struct message_field *f = type->fields; f->name; f++)
        if (f->words)
            put_words(out, f->words);
    end(out, message);
    put_word(out, 12, "proto3");
    end(out, file);
}

void protobuf_schema(const struct message_type *type, struct bytes *out)
{
    struct types types = {.n = 0};
    collect(&types, type);
    for (size_t i = 0; i < types.n; i++)
        put_file(out, types.type[i]);
}

/* ---- messages ---- */

static enum wire wire_of(enum message_kind kind)
{
    switch (kind) {
    case MESSAGE_DOUBLE:
        return EIGHT;
    case MESSAGE_FIXED32:
        return FOUR;
    case MESSAGE_TEXT:
    case MESSAGE_BYTES:
    case MESSAGE_OBJECT:
        return SIZED;
    default:
        return VARINT;
    }
}

static double double_of(const json_t *value)
{
    if (json_is_string(value))
        return strcmp(json_string_value(value), "inf") == 0 ? (double)INFINITY : (double)NAN;
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

static uint64_t bits_of(enum message_kind kind, const json_t *value)
{
    if (kind == MESSAGE_DOUBLE) {
        const double v = double_of(value);
        uint64_t bits;
        memcpy(&bits, &v, sizeof bits);
        return bits;
    }
    if (json_is_boolean(value))
        return json_is_true(value);
    return json_is_real(value) ? (uint64_t)(int64_t)json_real_value(value) : (uint64_t)json_integer_value(value);
}

static void put_bits(struct bytes *out, enum wire wire, uint64_t bits)
{
    if (wire == VARINT)
        put_varint(out, bits);
    else
        bytes_number(out, bits, wire == EIGHT ? 8 : 4);
}

static void put_packed(struct bytes *out, const struct message_field *f, const json_t *list)
{
    const size_t packed = begin(out, f->number);
    const json_t *one;
    size_t i;
    json_array_foreach(list, i, one) put_bits(out, wire_of(f->kind), bits_of(f->kind, one));
    end(out, packed);
}

static void put_one(struct bytes *out, const struct message_field *f, const json_t *value)
{
    const enum wire wire = wire_of(f->kind);
    if (f->kind == MESSAGE_OBJECT && json_is_object(value)) {
        const size_t inner = begin(out, f->number);
        protobuf_message(f->of, value, out);
        end(out, inner);
    } else if (wire == SIZED) {
        if (json_is_string(value) && f->kind != MESSAGE_OBJECT)
            put_sized(out, f->number, json_string_value(value), json_string_length(value));
    } else {
        put_tag(out, f->number, wire);
        put_bits(out, wire, bits_of(f->kind, value));
    }
}

/* Zero is what a reader takes for what is not there. */
static bool is_told(const struct message_field *f, const json_t *value)
{
    if (!value || json_is_null(value))
        return f->maybe;
    return wire_of(f->kind) == SIZED || bits_of(f->kind, value) != 0;
}

void protobuf_message(const struct message_type *type, const json_t *message, struct bytes *out)
{
    const json_t *one;
    size_t i;
    for (const struct message_field *f = type->fields; f->name; f++) {
        const json_t *value = json_object_get(message, f->name);
        if (!f->repeated) {
            if (is_told(f, value))
                put_one(out, f, value);
        } else if (wire_of(f->kind) != SIZED && json_array_size(value) > 0) {
            put_packed(out, f, value);
        } else {
            json_array_foreach(value, i, one) put_one(out, f, one);
        }
    }
}
