/* SPDX-License-Identifier: MIT */
#include "json_out.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FLAGS          (JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(15))
#define START_BYTES    512
#define PER_UNIT       1e6
#define DIGITS_MAX     1e15 /* so many digits are told of a real */
#define EXPONENT_BELOW 1e-4

static void grow(struct json_out *t, size_t n)
{
    size_t size = t->size ? t->size : START_BYTES;
    while (size - t->n < n)
        size *= 2;
    char *bytes = realloc(t->bytes, size);
    t->failed = !bytes;
    if (!bytes)
        return;
    t->bytes = bytes;
    t->size = size;
}

/* Room for n > 0 more; NULL when there is none. */
static inline char *room(struct json_out *t, size_t n)
{
    if (!t->failed && t->size - t->n < n)
        grow(t, n);
    return t->failed ? NULL : t->bytes + t->n;
}

void json_out_bytes(struct json_out *t, const char *bytes, size_t n)
{
    char *to = room(t, n);
    if (!to)
        return;
    memcpy(to, bytes, n);
    t->n += n;
}

void json_out_put(struct json_out *t, const char *characters)
{
    json_out_bytes(t, characters, strlen(characters));
}

void json_out_cut(struct json_out *t, size_t n)
{
    t->n = n;
    t->failed = false;
}

/* Room for a value of n characters, behind a comma where one is wanted; NULL when there is none. */
static inline char *value_room(struct json_out *t, size_t n)
{
    char *to = room(t, n + 1);
    if (!to)
        return NULL;
    const char before = t->n > 0 ? to[-1] : '[';
    if (before != '[' && before != '{' && before != ':' && before != ',') {
        *to++ = ',';
        t->n++;
    }
    return to;
}

static void value_bytes(struct json_out *t, const char *bytes, size_t n)
{
    char *to = value_room(t, n);
    if (!to)
        return;
    memcpy(to, bytes, n);
    t->n += n;
}

void json_out_part(struct json_out *t, const struct json_out *values)
{
    t->failed |= values->failed;
    if (values->n > 0)
        value_bytes(t, values->bytes, values->n);
}

void json_out_open(struct json_out *t, char bracket)
{
    value_bytes(t, &bracket, 1);
}

void json_out_close(struct json_out *t, char bracket)
{
    json_out_bytes(t, &bracket, 1);
}

static void quoted(struct json_out *t, const char *word, size_t n, char after)
{
    char *to = value_room(t, n + 3);
    if (!to)
        return;
    to[0] = '"';
    memcpy(to + 1, word, n);
    to[n + 1] = '"';
    to[n + 2] = after;
    t->n += n + (after ? 3 : 2);
}

void json_out_name(struct json_out *t, const char *name)
{
    quoted(t, name, strlen(name), ':');
}

void json_out_word(struct json_out *t, const char *word)
{
    quoted(t, word, strlen(word), '\0');
}

static void literal(struct json_out *t, const char *name)
{
    value_bytes(t, name, strlen(name));
}

void json_out_null(struct json_out *t)
{
    literal(t, "null");
}

void json_out_flag(struct json_out *t, bool value)
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

void json_out_integer(struct json_out *t, int64_t value)
{
    char buffer[24], *const end = buffer + sizeof buffer;
    char *first = digits(end, value < 0 ? -(uint64_t)value : (uint64_t)value, 1);
    if (value < 0)
        *--first = '-';
    value_bytes(t, first, (size_t)(end - first));
}

/* As jansson writes it, which knows every case. */
static void by_jansson(struct json_out *t, const json_t *value)
{
    char *to = NULL;
    size_t n = value ? json_dumpb(value, NULL, 0, FLAGS) : 0;
    if (n > 0)
        to = value_room(t, n);
    if (to)
        t->n += json_dumpb(value, to, n, FLAGS);
    else
        t->failed = true;
}

static void odd_real(struct json_out *t, double value)
{
    json_t *real = json_real(value);
    by_jansson(t, real);
    json_decref(real);
}

#define FRACTION_ROOM 32

/* whole / unit, with as many decimals as it has, one at least; unit: 10, 100, ... */
static void fraction(struct json_out *t, bool negative, uint64_t whole, uint64_t unit)
{
    char buffer[FRACTION_ROOM], *end = buffer + sizeof buffer;
    char *point = digits(end, unit + whole % unit, 1); /* the 1 of the unit is where the point will be */
    while (end > point + 2 && end[-1] == '0')
        end--;
    *point = '.';
    char *first = digits(point, whole / unit, 1);
    if (negative)
        *--first = '-';
    const size_t n = (size_t)(end - first);
    char *to = value_room(t, n);
    if (!to)
        return;
    for (size_t i = 0; i < n; i++)
        to[i] = first[i];
    t->n += n;
}

/*
 * A number of at most six decimals is the double nearest to a whole number of millionths: no other text of up to 15
 * digits is read as the same double, so these digits are those of %.15g.
 */
void json_out_real(struct json_out *t, double value)
{
    const double millionths = rint(value * PER_UNIT);
    const bool small = fabs(value) < EXPONENT_BELOW && (value != 0 || signbit(value));
    if (!(fabs(millionths) < DIGITS_MAX) || millionths / PER_UNIT != value || small)
        odd_real(t, value);
    else
        fraction(t, value < 0, (uint64_t)fabs(millionths), (uint64_t)PER_UNIT);
}

/* Its millionths are those of json_out_real, and end in zeros. */
void json_out_rounded(struct json_out *t, double value, double per_unit)
{
    const double whole = round(value * per_unit);
    const bool usual =
        per_unit > 1 && per_unit * EXPONENT_BELOW <= 1 && fabs(whole) * (PER_UNIT / per_unit) < DIGITS_MAX;
    if (!usual || (whole == 0 && signbit(whole)))
        json_out_real(t, whole / per_unit);
    else
        fraction(t, whole < 0, (uint64_t)fabs(whole), (uint64_t)per_unit);
}

static bool is_plain(const char *s, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (s[i] < 0x20 || s[i] > 0x7e || s[i] == '"' || s[i] == '\\')
            return false;
    return true;
}

void json_out_text(struct json_out *t, const char *text)
{
    if (is_plain(text, strlen(text))) {
        json_out_word(t, text);
        return;
    }
    json_t *string = json_string(text);
    by_jansson(t, string);
    json_decref(string);
}

static void key(struct json_out *t, const char *name)
{
    if (is_plain(name, strlen(name))) {
        json_out_name(t, name);
        return;
    }
    json_t *string = json_string(name);
    by_jansson(t, string);
    json_decref(string);
    json_out_bytes(t, ":", 1);
}

static void string(struct json_out *t, const json_t *value)
{
    const char *s = json_string_value(value);
    const size_t n = json_string_length(value);
    if (is_plain(s, n))
        quoted(t, s, n, '\0');
    else
        by_jansson(t, value);
}

static void object(struct json_out *t, const json_t *value)
{
    json_t *o = (json_t *)(uintptr_t)value; /* jansson's iterators want to change it */
    json_out_open(t, '{');
    for (void *at = json_object_iter(o); at; at = json_object_iter_next(o, at)) {
        key(t, json_object_iter_key(at));
        json_out_value(t, json_object_iter_value(at));
    }
    json_out_close(t, '}');
}

static void array(struct json_out *t, const json_t *value)
{
    json_out_open(t, '[');
    for (size_t i = 0; i < json_array_size(value); i++)
        json_out_value(t, json_array_get(value, i));
    json_out_close(t, ']');
}

void json_out_value(struct json_out *t, const json_t *value)
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
        json_out_integer(t, json_integer_value(value));
        return;
    case JSON_REAL:
        json_out_real(t, json_real_value(value));
        return;
    case JSON_TRUE:
    case JSON_FALSE:
        json_out_flag(t, json_is_true(value));
        return;
    default:
        json_out_null(t);
    }
}
