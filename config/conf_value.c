/* SPDX-License-Identifier: MIT */
/*
 * conf_value - reading and writing of single values. Units are a table: what one of them is in SI stands there as
 * mul / div, because a division by 1000 gives the double nearest to 0.35 where a product with 0.001 does not.
 */
#include "conf_value.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NUMBERS_MAX 3 /* in one value */

struct unit {
    char dimension; /* units of one letter stand for the same thing; the first of them is the SI unit */
    const char *name;
    double mul, div;
};

static const struct unit units[] = {
    {'l', "m", 1, 1},
    {'l', "cm", 1, 100},
    {'l', "mm", 1, 1000},
    {'l', "km", 1000, 1},
    {'a', "rad", 1, 1},
    {'a', "deg", M_PI / 180, 1},
    {'a', "grad", M_PI / 200, 1},
    {'t', "s", 1, 1},
    {'t', "ms", 1, 1000},
    {'t', "min", 60, 1},
    {'t', "h", 3600, 1},
    {'f', "Hz", 1, 1},
    {'f', "kHz", 1000, 1},
    {'f', "MHz", 1000000, 1},
    {'v', "m/s", 1, 1},
    {'d', "dB", 1, 1},
    {'b', "B", 1, 1},
    {'b', "KiB", 1024, 1},
    {'b', "MiB", 1048576, 1},
    {'b', "GiB", 1073741824, 1},
    {'p', "Pa", 1, 1},
    {'p', "mbar", 100, 1},
    {'p', "kPa", 1000, 1},
    {'p', "bar", 100000, 1},
    {'r', "kg/m3", 1, 1},
    {'g', "m/s2", 1, 1},
    {'w', "rad/s", 1, 1},
    {'w', "deg/s", M_PI / 180, 1},
    {'w', "deg/h", M_PI / 180, 3600},
};

#define N_UNITS (sizeof units / sizeof units[0])

static const struct unit *unit_find(const char *name)
{
    for (size_t i = 0; i < N_UNITS; i++)
        if (strcmp(units[i].name, name) == 0)
            return &units[i];
    return NULL;
}

static const struct unit *unit_si(const struct unit *unit)
{
    for (size_t i = 0;; i++)
        if (units[i].dimension == unit->dimension)
            return &units[i];
}

static double to_si(double number, const struct unit *unit)
{
    return unit ? number * unit->mul / unit->div : number;
}

static double from_si(double value, const struct unit *unit)
{
    return unit ? value * unit->div / unit->mul : value;
}

static const char *skip_blanks(const char *s)
{
    return s + strspn(s, " \t");
}

/* One decimal number at *s; *s moves behind it. No hexadecimal, no infinity, no NaN: strtod would take them. */
static bool number_read(const char **s, double *number)
{
    char *end;
    size_t decimal = strspn(*s, "+-.0123456789eE");
    *number = strtod(*s, &end);
    if (end == *s || end > *s + decimal)
        return false;
    *s = end;
    return true;
}

static bool is_unit_of(const struct conf_key *key, const struct unit *unit)
{
    return unit->dimension == unit_find(key->unit)->dimension || (key->also && strcmp(unit->name, key->also) == 0);
}

static bool unit_read(const struct conf_key *key, const char *text, const struct unit **unit, struct fault *fault)
{
    *unit = NULL;
    if (!key->unit)
        return *text == '\0' || fault_set(fault, "'%s' after a number without a unit", text);
    if (*text == '\0')
        return fault_set(fault, "the unit is missing");
    *unit = unit_find(text);
    if (!*unit || !is_unit_of(key, *unit))
        return fault_set(fault, "unknown unit '%s'", text);
    return true;
}

/* "number ... number unit" */
static bool quantity_read(const struct conf_key *key, const char *text, double *out, struct fault *fault)
{
    double number[NUMBERS_MAX];
    const struct unit *unit, *own = key->unit ? unit_find(key->unit) : NULL;
    for (int i = 0; i < key->n; i++) {
        if (!number_read(&text, &number[i])) {
            if (i > 0 && *text != '\0')
                return fault_set(fault, "%d of %d numbers before '%s'", i, key->n, text);
            if (i > 0)
                return fault_set(fault, "%d of %d numbers", i, key->n);
            return fault_set(fault, "'%s' is not a number", text);
        }
        text = skip_blanks(text);
    }
    if (*text != '\0' && strchr("+-.0123456789", *text))
        return fault_set(fault, "more than %d number%s", key->n, key->n == 1 ? "" : "s");
    if (!unit_read(key, text, &unit, fault))
        return false;
    for (int i = 0; i < key->n; i++) {
        number[i] = to_si(number[i], unit) + 0.0; /* no negative zero */
        if (!(number[i] >= to_si(key->lo, own) && number[i] <= to_si(key->hi, own)))
            return fault_set(fault, "out of range");
    }
    memcpy(out, number, (size_t)key->n * sizeof *out);
    return true;
}

static bool integer_read(const struct conf_key *key, const char *text, int *out, struct fault *fault)
{
    char *end;
    size_t digits = strspn(text, "+-0123456789");
    bool octal = key->kind == CONF_OCTAL;
    long value = strtol(text, &end, octal ? 8 : 10);
    if (end == text || *end != '\0' || end != text + digits)
        return fault_set(fault, "'%s' is not %s", text, octal ? "an octal number" : "a whole number");
    if (!((double)value >= key->lo && (double)value <= key->hi))
        return fault_set(fault, "out of range");
    *out = (int)value;
    return true;
}

static bool word_read(const struct conf_key *key, const char *text, int *out, struct fault *fault)
{
    for (int i = 0; key->words[i]; i++) {
        if (strcmp(key->words[i], text) == 0) {
            *out = i;
            return true;
        }
    }
    return fault_set(fault, "'%s' is not one of the words", text);
}

#define NAME_LETTERS "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_"

static bool text_read(const struct conf_key *key, const char *text, char *out, struct fault *fault)
{
    bool letter = (*text >= 'a' && *text <= 'z') || (*text >= 'A' && *text <= 'Z');
    if (key->kind == CONF_TEXT && *text == '/' && key->form && strncmp(key->form, "KIND:", 5) == 0)
        return fault_set(fault, "no kind of port before the file");
    if (key->kind == CONF_TEXT && !letter)
        return fault_set(fault, "does not begin with a letter");
    if (key->kind == CONF_PATH && *text != '/')
        return fault_set(fault, "does not begin with a slash");
    size_t name = strspn(text, NAME_LETTERS), names = strspn(text, NAME_LETTERS ".$@, \t");
    if (key->kind == CONF_NAME && text[name] != '\0')
        return fault_set(fault, "'%s' is not allowed in a name", text + name);
    if (key->kind == CONF_NAMES && text[names] != '\0')
        return fault_set(fault, "'%s' is not allowed in a name", text + names);
    if (strlen(text) >= key->size)
        return fault_set(fault, "%zu bytes, more than the %zu there is room for", strlen(text), key->size - 1);
    memset(out, 0, key->size);
    strcpy(out, text);
    return true;
}

/* The word that stands for no number or no text. */
static void instead_read(const struct conf_key *key, void *field)
{
    if (key->kind == CONF_QUANTITY)
        *(double *)field = key->instead_value;
    else if (key->kind == CONF_INTEGER)
        *(int *)field = (int)key->instead_value;
    else
        memset(field, 0, key->size);
}

static bool named_read(const struct conf_key *key, const char *text, double *field)
{
    for (const struct conf_named *named = key->named; named && named->word; named++)
        if (strcmp(named->word, text) == 0) {
            *field = named->value;
            return true;
        }
    return false;
}

bool conf_value_read(const struct conf_key *key, const char *text, void *base, struct fault *fault)
{
    void *field = (char *)base + key->offset;
    if (*text == '\0')
        return fault_set(fault, "no value after =");
    if (key->instead && strcmp(text, key->instead) == 0) {
        instead_read(key, field);
        return true;
    }
    switch (key->kind) {
    case CONF_QUANTITY:
        return named_read(key, text, field) || quantity_read(key, text, field, fault);
    case CONF_INTEGER:
    case CONF_OCTAL:
        return integer_read(key, text, field, fault);
    case CONF_WORD:
        return word_read(key, text, field, fault);
    case CONF_TEXT:
    case CONF_PATH:
    case CONF_NAME:
    case CONF_NAMES:
        break;
    }
    return text_read(key, text, field, fault);
}

#define DIGITS_SHORT 6 /* %g drops zeros; with fewer it would write 20 as 2e+01 */
#define DIGITS_MOST  17

/* The fewest digits that read back to value; false: none up to so many do. */
static bool number_write(double value, const struct unit *unit, int most, char *text, size_t size)
{
    for (int digits = DIGITS_SHORT; digits <= most; digits++) {
        snprintf(text, size, "%.*g", digits, from_si(value, unit));
        if (to_si(strtod(text, NULL), unit) == value)
            return true;
    }
    return false;
}

/* False: with so many digits it is not exact. */
static bool quantity_write_in(const struct conf_key *key, const double *value, const struct unit *unit, int most,
                              char *text, size_t size)
{
    size_t used = 0;
    bool exact = true;
    for (int i = 0; i < key->n; i++) {
        char number[32];
        exact = number_write(value[i], unit, most, number, sizeof number) && exact;
        used += (size_t)snprintf(text + used, size - used, "%s%s", i > 0 ? " " : "", number);
    }
    if (unit)
        snprintf(text + used, size - used, " %s", unit->name);
    return exact;
}

/* By its name; else in the key's own unit, unless only another one takes few digits: 36 deg/h is no round number of
 * deg/s. */
static void quantity_write(const struct conf_key *key, const double *value, char *text, size_t size)
{
    const struct unit *own = key->unit ? unit_find(key->unit) : NULL;
    for (const struct conf_named *named = key->named; named && named->word; named++)
        if (named->value == *value) {
            snprintf(text, size, "%s", named->word);
            return;
        }
    if (quantity_write_in(key, value, own, DIGITS_SHORT, text, size))
        return;
    for (size_t i = 0; own && i < N_UNITS; i++)
        if (units[i].dimension == own->dimension &&
            quantity_write_in(key, value, &units[i], DIGITS_SHORT, text, size))
            return;
    if (!quantity_write_in(key, value, own, DIGITS_MOST, text, size) && own)
        quantity_write_in(key, value, unit_si(own), DIGITS_MOST, text, size);
}

static bool is_instead(const struct conf_key *key, const void *field)
{
    if (!key->instead)
        return false;
    if (key->kind == CONF_QUANTITY)
        return *(const double *)field == key->instead_value;
    if (key->kind == CONF_INTEGER)
        return *(const int *)field == (int)key->instead_value;
    return *(const char *)field == '\0';
}

void conf_value_write(const struct conf_key *key, const void *base, char *text, size_t size)
{
    const void *field = (const char *)base + key->offset;
    if (is_instead(key, field)) {
        snprintf(text, size, "%s", key->instead);
        return;
    }
    switch (key->kind) {
    case CONF_QUANTITY:
        quantity_write(key, field, text, size);
        return;
    case CONF_INTEGER:
        snprintf(text, size, "%d", *(const int *)field);
        return;
    case CONF_OCTAL:
        snprintf(text, size, "%04o", (unsigned)*(const int *)field);
        return;
    case CONF_WORD:
        snprintf(text, size, "%s", key->words[*(const int *)field]);
        return;
    case CONF_TEXT:
    case CONF_PATH:
    case CONF_NAME:
    case CONF_NAMES:
        snprintf(text, size, "%s", (const char *)field);
        return;
    }
}

static size_t append(char *text, size_t size, size_t used, const char *fmt, ...)
    __attribute__((format(printf, 4, 5)));
static size_t append(char *text, size_t size, size_t used, const char *fmt, ...)
{
    va_list args;
    va_start(args, fmt);
    int n = vsnprintf(text + used, size - used, fmt, args);
    va_end(args);
    return used + (size_t)n < size ? used + (size_t)n : size - 1;
}

/* "deg (rad, deg, grad)"; the list only where there is a choice. */
static size_t append_units(char *text, size_t size, size_t used, const char *own)
{
    char dimension = unit_find(own)->dimension, list[64] = "";
    size_t n = 0, length = 0;
    for (size_t i = 0; i < N_UNITS; i++)
        if (units[i].dimension == dimension)
            length = append(list, sizeof list, length, "%s%s", n++ > 0 ? ", " : "", units[i].name);
    used = append(text, size, used, " %s", own);
    return n > 1 ? append(text, size, used, " (%s)", list) : used;
}

void conf_value_allowed(const struct conf_key *key, char *text, size_t size)
{
    size_t used = 0;
    switch (key->kind) {
    case CONF_QUANTITY:
        for (const struct conf_named *named = key->named; named && named->word; named++)
            used = append(text, size, used, "%s, ", named->word);
        if (key->named)
            used = append(text, size, used, "or ");
        if (key->n > 1)
            used = append(text, size, used, "%d numbers and one unit, each ", key->n);
        used = append(text, size, used, "%.9g to %.9g", key->lo, key->hi);
        if (key->unit)
            used = append_units(text, size, used, key->unit);
        if (key->also)
            used = append(text, size, used, ", or as many %s", key->also);
        break;
    case CONF_INTEGER:
        used = append(text, size, used, "%d to %d", (int)key->lo, (int)key->hi);
        break;
    case CONF_OCTAL:
        used = append(text, size, used, "%04o to %04o", (unsigned)key->lo, (unsigned)key->hi);
        break;
    case CONF_WORD:
        for (int i = 0; key->words[i]; i++)
            used = append(text, size, used, "%s%s",
                          i == 0              ? ""
                          : key->words[i + 1] ? ", "
                                              : " or ",
                          key->words[i]);
        break;
    case CONF_TEXT:
    case CONF_PATH:
    case CONF_NAME:
    case CONF_NAMES:
        used = append(text, size, used, "%s", key->form);
        break;
    }
    if (key->instead)
        append(text, size, used, ", or %s", key->instead);
}

locale_t conf_locale_enter(void)
{
    return uselocale(newlocale(LC_ALL_MASK, "C", (locale_t)0));
}

void conf_locale_leave(locale_t outside)
{
    freelocale(uselocale(outside));
}
