/* SPDX-License-Identifier: MIT */
/*
 * conf_print - the table of keys for people: effective values, the commented default file, the man page's table.
 */
#include <ini.h>
#include <string.h>

#include "conf.h"
#include "conf_source.h"
#include "conf_value.h"

/* Hands each line of a text to `put`, without newline. */
static void each_line(const char *text, FILE *out, void (*put)(const char *line, int n, FILE *out))
{
    while (*text) {
        size_t n = strcspn(text, "\n");
        put(text, (int)n, out);
        text += n + (text[n] == '\n');
    }
}

/* "FILE:LINE", an option, or "default": in ASCII, because the output has to load wherever the file lies. */
static void origin_text(const struct conf_source *source, int sonar, const struct conf_key *key, char *text,
                        size_t size)
{
    static const struct conf_origin standard = {0};
    const struct conf_origin *origin = source ? &source->origin[sonar][key - conf_keys] : &standard;
    if (origin->given)
        snprintf(text, size, "%s", origin->given);
    else if (origin->line == 0 || origin->bad)
        snprintf(text, size, "default");
    else
        snprintf(text, size, "%s:%u", source->file[origin->file].name, origin->line);
    for (char *c = text; *c; c++)
        if (*c < 0x20 || *c > 0x7e)
            *c = '?';
}

static void print_key(const struct conf_source *source, int sonar, const struct conf_key *key, const void *base,
                      FILE *out)
{
    char value[CONF_VALUE_MAX], from[4200], line[sizeof value + sizeof from];
    conf_value_write(key, base, value, sizeof value);
    origin_text(source, sonar, key, from, sizeof from);
    int before = snprintf(line, sizeof line, "%s = %s", key->name, value);
    int n = before < 40 ? 40 : before;
    n = snprintf(line, sizeof line, "%s = %-*s ; %s", key->name, n - before + (int)strlen(value), value, from);
    if (n <= INI_MAX_LINE - 3)
        fprintf(out, "%s\n", line);
    else
        fprintf(out, "; %s\n%.*s\n", from, before, line);
}

static void print_section(const char *section, const struct conf_source *source, int sonar, const void *base,
                          FILE *out)
{
    for (const struct conf_key *key = conf_keys; key->name; key++)
        if (strcmp(key->section, section) == 0 && !(source && source->origin[sonar][key - conf_keys].unused))
            print_key(source, sonar, key, base, out);
}

void conf_print(const struct conf *conf, const struct conf_source *source, FILE *out)
{
    locale_t outside = conf_locale_enter();
    for (int i = 0; i < conf->n_sonars; i++) {
        fprintf(out, "%s[sonar %s]\n", i > 0 ? "\n" : "", conf->sonar[i].name);
        print_section("sonar", source, i, &conf->sonar[i], out);
    }
    for (const struct conf_section *section = conf_sections; section->name; section++) {
        if (strcmp(section->name, "sonar") == 0)
            continue;
        fprintf(out, "\n[%s]\n", section->name);
        print_section(section->name, source, 0, conf, out);
        for (int i = 0; strcmp(section->name, "grid") == 0 && i < conf->n_more_grids; i++) {
            fprintf(out, "\n[grid %s]\n", conf->more_grid[i].name);
            print_section("grid", source, i + 1,
                          (const char *)conf + conf_base(conf_key_find("grid", "range"), i + 1), out);
        }
    }
    conf_locale_leave(outside);
}

const char *conf_target_text(const struct conf_extract *extract, char text[CONF_TARGET_SIZE])
{
    const struct conf_named *named = conf_key_find("extract", "target")->named;
    while (named->word && named->value != extract->target_db)
        named++;
    if (named->word)
        snprintf(text, CONF_TARGET_SIZE, "%s", named->word);
    else
        snprintf(text, CONF_TARGET_SIZE, "%.6g dB below a wall", extract->target_db);
    return text;
}

static void put_comment(const char *line, int n, FILE *out)
{
    fprintf(out, "# %.*s\n", n, line);
}

/* "ping360, micron" where not every device has the key; empty where all have it. */
static void users_text(const struct conf_checks *checks, const struct conf_key *key, char *text, size_t size)
{
    text[0] = '\0';
    if (key->of_device && checks && checks->users)
        checks->users(key->name, text, size);
}

/* Whether a reload takes it, as a sentence; empty: it does not. */
static void reload_text(const struct conf_checks *checks, const struct conf_key *key, char *text, size_t size)
{
    char retuners[CONF_VALUE_MAX] = "";
    text[0] = '\0';
    if (key->of_head && checks && checks->retuners)
        checks->retuners(key->name, retuners, sizeof retuners);
    if (key->live)
        snprintf(text, size, "Can be reloaded%s%s.", *retuners ? " for " : "", retuners);
}

/* The example sonar stands in the file; all else is commented out and shows the default. */
static void sample_key(const struct conf_checks *checks, const struct conf_key *key, FILE *out)
{
    char allowed[CONF_VALUE_MAX], users[CONF_VALUE_MAX], reload[CONF_VALUE_MAX + 32];
    conf_value_allowed(key, allowed, sizeof allowed);
    users_text(checks, key, users, sizeof users);
    reload_text(checks, key, reload, sizeof reload);
    fprintf(out, "\n");
    each_line(key->help, out, put_comment);
    if (*users)
        fprintf(out, "# Only for %s.\n", users);
    fprintf(out, "# Allowed: %s.%s%s\n", allowed, *reload ? " " : "", reload);
    if (key->standard)
        fprintf(out, "#%s = %s\n", key->name, key->standard);
    else
        fprintf(out, "%s = %s\n", key->name, key->example);
}

void conf_sample(const struct conf_checks *checks, FILE *out)
{
    locale_t outside = conf_locale_enter();
    fputs(
        "# Configuration of sonard(8); the manual is sonard.conf(5).\n"
        "#\n"
        "# Every key is listed. A key after # shows its default; remove the # to change it. Numbers have a unit.\n"
        "# A comment after a value starts with ;. Check a changed file with: sonard --check FILE\n",
        out);
    for (const struct conf_section *section = conf_sections; section->name; section++) {
        bool sonar = strcmp(section->name, "sonar") == 0;
        fprintf(out, "\n");
        each_line(section->help, out, put_comment);
        fprintf(out, "[%s]\n", sonar ? "sonar front" : section->name);
        for (const struct conf_key *key = conf_keys; key->name; key++)
            if (strcmp(key->section, section->name) == 0)
                sample_key(checks, key, out);
    }
    conf_locale_leave(outside);
}

/* A line of text in man(7): no character of it may act as a macro or an escape. */
static void put_roff(const char *line, int n, FILE *out)
{
    if (n > 0 && (*line == '.' || *line == '\''))
        fputs("\\&", out);
    for (int i = 0; i < n; i++) {
        if (line[i] == '\\')
            fputs("\\e", out);
        else if (line[i] == '-')
            fputs("\\-", out);
        else
            fputc(line[i], out);
    }
    fputc('\n', out);
}

static void man_key(const struct conf_checks *checks, const struct conf_key *key, FILE *out)
{
    char text[CONF_VALUE_MAX + 32], allowed[CONF_VALUE_MAX], users[CONF_VALUE_MAX];
    conf_value_allowed(key, allowed, sizeof allowed);
    users_text(checks, key, users, sizeof users);
    fprintf(out, ".TP\n.B %s\n", key->name);
    each_line(key->help, out, put_roff);
    fprintf(out, ".br\n");
    if (*users) {
        snprintf(text, sizeof text, "Only for %s.", users);
        each_line(text, out, put_roff);
    }
    snprintf(text, sizeof text, "Allowed: %s.", allowed);
    each_line(text, out, put_roff);
    if (key->standard)
        snprintf(text, sizeof text, "Default: %s.", key->standard);
    else
        snprintf(text, sizeof text, "Required.");
    each_line(text, out, put_roff);
    reload_text(checks, key, text, sizeof text);
    if (*text)
        each_line(text, out, put_roff);
}

void conf_table_man(const struct conf_checks *checks, FILE *out)
{
    locale_t outside = conf_locale_enter();
    for (const struct conf_section *section = conf_sections; section->name; section++) {
        fprintf(out, ".SS [%s%s]\n", section->name, strcmp(section->name, "sonar") == 0 ? " NAME" : "");
        each_line(section->help, out, put_roff);
        for (const struct conf_key *key = conf_keys; key->name; key++)
            if (strcmp(key->section, section->name) == 0)
                man_key(checks, key, out);
    }
    conf_locale_leave(outside);
}
