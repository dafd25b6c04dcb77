/* SPDX-License-Identifier: MIT */
/* knob - rows of settings, named by what they run; see knob.h. */
#include "knob.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/conf_table.h"
#include "config/conf_value.h"
#include "daemon/settings.h"

#define BASIS "[sonar a]\ndevice = ping360\nport = serial:/dev/null:115200\nrange = 12 m\n"

static void print_fault(void *ctx, const char *message)
{
    fprintf(stderr, "%s: %s\n", (const char *)ctx, message);
    exit(1);
}

static const char *base_lines = "";

void knob_base(const char *lines)
{
    base_lines = lines;
}

static const struct conf_key *key_of(const struct knob *knob)
{
    const struct conf_key *key = knob->section ? conf_key_find(knob->section, knob->name) : NULL;
    if (knob->section && !key)
        print_fault((void *)knob->name, "no such key");
    return key;
}

static void set_own_key(const struct knob *knob, struct conf *conf)
{
    const struct conf_key *key = key_of(knob);
    struct fault fault;
    if (key && knob->value && !conf_value_read(key, knob->value, (char *)conf + conf_base(key, 0), &fault))
        print_fault((void *)knob->name, fault.text);
}

void knob_conf(const struct knob *knob, struct conf *conf)
{
    static const struct knob none = {.name = "knob"};
    const struct knob *const of = knob ? knob : &none;
    struct conf_source *source;
    char text[2048];
    const int n = snprintf(text, sizeof text, "%s%s%s", BASIS, base_lines, of->more ? of->more : "");
    if (n < 0 || (size_t)n >= sizeof text)
        print_fault((void *)of->name, "the row is too long");
    conf_load_text(conf, &source, &(struct conf_text){"basis", text, (size_t)n}, &settings_checks, print_fault,
                   (void *)of->name);
    set_own_key(of, conf);
    conf_check_together(conf, source, &settings_checks, print_fault, (void *)of->name);
    conf_source_free(source);
}

static const char *base_of(const struct conf *conf, const struct conf_key *key)
{
    return (const char *)conf + conf_base(key, 0);
}

__attribute__((format(printf, 2, 3))) static void append(char text[KNOB_TEXT_MAX], const char *form, ...)
{
    const size_t n = strlen(text);
    va_list ap;
    va_start(ap, form);
    vsnprintf(text + n, KNOB_TEXT_MAX - n, form, ap);
    va_end(ap);
}

static void append_key(const struct conf *conf, const struct conf_key *key, char text[KNOB_TEXT_MAX])
{
    char value[CONF_VALUE_MAX];
    conf_value_write(key, base_of(conf, key), value, sizeof value);
    append(text, "%s[%s] %s = %s", *text ? "; " : "", key->section, key->name, value);
}

static bool differs(const struct conf *a, const struct conf *b, const struct conf_key *key)
{
    return memcmp(base_of(a, key) + key->offset, base_of(b, key) + key->offset, key->size) != 0;
}

void knob_configuration(const struct knob *knob, char text[KNOB_TEXT_MAX])
{
    const struct conf_key *own = key_of(knob);
    struct conf conf, shipped;
    knob_conf(knob, &conf);
    knob_conf(NULL, &shipped);
    *text = '\0';
    if (own)
        append_key(&conf, own, text);
    for (const struct conf_key *key = conf_keys; key->name; key++)
        if (key != own && differs(&conf, &shipped, key))
            append_key(&conf, key, text);
    if (knob->beside)
        append(text, "%s%s", *text ? "; " : "", knob->beside);
    if (!*text)
        append(text, "as shipped");
}

bool knob_is_default(const struct knob *knob)
{
    struct conf conf, shipped;
    knob_conf(knob, &conf);
    knob_conf(NULL, &shipped);
    for (const struct conf_key *key = conf_keys; key->name; key++)
        if (differs(&conf, &shipped, key))
            return false;
    return !knob->beside;
}

void knob_check(const struct knob *knob, size_t n)
{
    char one[KNOB_TEXT_MAX], other[KNOB_TEXT_MAX];
    for (size_t i = 0; i < n; i++) {
        knob_configuration(&knob[i], one);
        for (size_t k = 0; k < i; k++) {
            if (strcmp(knob[i].name, knob[k].name) != 0)
                continue;
            knob_configuration(&knob[k], other);
            if (strcmp(one, other) == 0) {
                fprintf(stderr, "%s: two rows run the same: %s\n", knob[i].name, one);
                exit(1);
            }
        }
    }
}

void knob_value(const struct knob *knob, char text[KNOB_TEXT_MAX])
{
    const struct conf_key *own = key_of(knob);
    struct conf conf;
    *text = '\0';
    if (!own) {
        append(text, "%s", knob->label);
        return;
    }
    knob_conf(knob, &conf);
    conf_value_write(own, base_of(&conf, own), text, KNOB_TEXT_MAX);
}

void knob_print(const struct knob *knob)
{
    char value[KNOB_TEXT_MAX], configuration[KNOB_TEXT_MAX];
    knob_value(knob, value);
    knob_configuration(knob, configuration);
    printf("%s,\"%s\",%d,\"%s\"", knob->name, value, knob_is_default(knob), configuration);
}
