/* SPDX-License-Identifier: MIT */
#include "text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FLAGS          (JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(15))
#define START_BYTES    512
#define DECIMALS       6
#define PER_UNIT       1e6
#define DIGITS_MAX     1e15 /* so many digits are told of a real */
#define EXPONENT_BELOW 1e-4

/* Room for n more; NULL when there is none. */
static char *room(struct text *t, size_t n)
{
    size_t size = t->size ? t->size : START_BYTES;
    if (t->failed)
        return NULL;
    while (size - t->n < n)
        size *= 2;
    if (size > t->size) {
        char *bytes = realloc(t->bytes, size);
        t->failed = !bytes;
        if (!bytes)
            return NULL;
        t->bytes = bytes;
        t->size = size;
    }
    return t->bytes + t->n;
}

void text_bytes(struct text *t, const char *bytes, size_t n)
{
    char *to = room(t, n);
    if (!to)
        return;
    memcpy(to, bytes, n);
    t->n += n;
}

void text_put(struct text *t, const char *characters)
{
    text_bytes(t, characters, strlen(characters));
}

void text_cut(struct text *t, size_t n)
{
    t->n = n;
    t->failed = false;
}

static void separate(struct text *t)
{
    const char before = t->n > 0 ? t->bytes[t->n - 1] : '[';
    if (before != '[' && before != '{' && before != ':' && before != ',')
        text_bytes(t, ",", 1);
}

void text_part(struct text *t, const struct text *values)
{
    t->failed |= values->failed;
    if (values->n == 0)
        return;
    separate(t);
    text_bytes(t, values->bytes, values->n);
}

void text_open(struct text *t, char bracket)
{
    separate(t);
    text_bytes(t, &bracket, 1);
}

void text_close(struct text *t, char bracket)
{
    text_bytes(t, &bracket, 1);
}

static void quoted(struct text *t, const char *word, size_t n, char after)
{
    separate(t);
    char *to = room(t, n + 3);
    if (!to)
        return;
    to[0] = '"';
    memcpy(to + 1, word, n);
    to[n + 1] = '"';
    to[n + 2] = after;
    t->n += n + (after ? 3 : 2);
}

void text_name(struct text *t, const char *name)
{
    quoted(t, name, strlen(name), ':');
}

void text_word(struct text *t, const char *word)
{
    quoted(t, word, strlen(word), '\0');
}

static void literal(struct text *t, const char *name)
{
    separate(t);
    text_put(t, name);
}

void text_null(struct text *t)
{
    literal(t, "null");
}

void text_flag(struct text *t, bool value)
{
    literal(t, value ? "true" : "false");
}

/* The last digits before `end`, at least `least` of them; returns the first. */
static char *digits(char *end, uint64_t value, int least)
{
    for (; value > 0 || least > 0; value /= 10, least--)
        *--end = (char)('0' + value % 10);
    return end;
}

void text_integer(struct text *t, int64_t value)
{
    char buffer[24], *const end = buffer + sizeof buffer;
    char *first = digits(end, value < 0 ? -(uint64_t)value : (uint64_t)value, 1);
    if (value < 0)
        *--first = '-';
    separate(t);
    text_bytes(t, first, (size_t)(end - first));
}

/* As jansson writes it, which knows every case. */
static void by_jansson(struct text *t, const json_t *value)
{
    char *to = NULL;
    size_t n = value ? json_dumpb(value, NULL, 0, FLAGS) : 0;
    separate(t);
    if (n > 0)
        to = room(t, n);
    if (to)
        t->n += json_dumpb(value, to, n, FLAGS);
    else
        t->failed = true;
}

static void odd_real(struct text *t, double value)
{
    json_t *real = json_real(value);
    by_jansson(t, real);
    json_decref(real);
}

/*
 * A number of at most six decimals is the double nearest to a whole number of millionths: no other text of up to 15 digits
 * is read as the same double, so these digits are those of %.15g.
 */
void text_real(struct text *t, double value)
{
    const double millionths = rint(value * PER_UNIT);
    const bool small = fabs(value) < EXPONENT_BELOW && (value != 0 || signbit(value));
    if (!(fabs(millionths) < DIGITS_MAX) || millionths / PER_UNIT != value || small) {
        odd_real(t, value);
        return;
    }
    char buffer[32], *end = buffer + sizeof buffer;
    const uint64_t all = (uint64_t)fabs(millionths), whole = all / (uint64_t)PER_UNIT;
    char *point = digits(end, all % (uint64_t)PER_UNIT, DECIMALS);
    while (end > point + 1 && end[-1] == '0')
        end--;
    *--point = '.';
    char *first = digits(point, whole, 1);
    if (value < 0)
        *--first = '-';
    separate(t);
    text_bytes(t, first, (size_t)(end - first));
}

static bool is_plain(const char *s, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (s[i] < 0x20 || s[i] > 0x7e || s[i] == '"' || s[i] == '\\')
            return false;
    return true;
}

static void key(struct text *t, const char *name)
{
    if (is_plain(name, strlen(name))) {
        text_name(t, name);
        return;
    }
    json_t *string = json_string(name);
    by_jansson(t, string);
    json_decref(string);
    text_bytes(t, ":", 1);
}

static void string(struct text *t, const json_t *value)
{
    const char *s = json_string_value(value);
    const size_t n = json_string_length(value);
    if (is_plain(s, n))
        quoted(t, s, n, '\0');
    else
        by_jansson(t, value);
}

static void object(struct text *t, const json_t *value)
{
    json_t *o = (json_t *)(uintptr_t)value; /* jansson's iterators want to change it */
    text_open(t, '{');
    for (void *at = json_object_iter(o); at; at = json_object_iter_next(o, at)) {
        key(t, json_object_iter_key(at));
        text_json(t, json_object_iter_value(at));
    }
    text_close(t, '}');
}

static void array(struct text *t, const json_t *value)
{
    text_open(t, '[');
    for (size_t i = 0; i < json_array_size(value); i++)
        text_json(t, json_array_get(value, i));
    text_close(t, ']');
}

void text_json(struct text *t, const json_t *value)
{
    switch (json_typeof(value)) {
    case JSON_OBJECT:
        object(t, value);
        return;
    case JSON_ARRAY:
        array(t, value);
        return;
    case JSON_STRING:
        string(t, value);
        return;
    case JSON_INTEGER:
        text_integer(t, json_integer_value(value));
        return;
    case JSON_REAL:
        text_real(t, json_real_value(value));
        return;
    case JSON_TRUE:
    case JSON_FALSE:
        text_flag(t, json_is_true(value));
        return;
    default:
        text_null(t);
    }
}
