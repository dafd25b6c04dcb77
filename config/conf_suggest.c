/* SPDX-License-Identifier: MIT */
/*
 * conf_suggest - the nearest known word, by the number of letters that differ.
 */
#include "conf_suggest.h"

#include <stdio.h>
#include <string.h>

#include "conf_table.h"
#include "word.h"

/* [sonar] is written with a name. */
static const char *name_part(const char *section)
{
    return strcmp(section, "sonar") == 0 ? " NAME" : "";
}

void conf_suggest_key(const char *section, const char *name, char *text, size_t size)
{
    const char *nearest = NULL;
    char elsewhere[200] = "";
    size_t best = WORD_FAR, in = 0;
    size_t used = (size_t)snprintf(text, size, "expected one of ");
    const char *separator = "";
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        if (strcmp(key->section, section) == 0) {
            if (used < size)
                used += (size_t)snprintf(text + used, size - used, "%s%s", separator, key->name);
            separator = ", ";
            if (word_is_nearest(name, key->name, &best))
                nearest = key->name;
        } else if (strcmp(key->name, name) == 0 && in < sizeof elsewhere) {
            in += (size_t)snprintf(elsewhere + in, sizeof elsewhere - in, "%s[%s%s]", in ? " or " : "",
                                   key->section, name_part(key->section));
        }
    }
    if (in > 0)
        snprintf(text, size, "it belongs in %s", elsewhere);
    else if (nearest)
        snprintf(text, size, "did you mean %s?", nearest);
}

void conf_suggest_section(const char *name, char *text, size_t size)
{
    const char *nearest = NULL;
    size_t best = WORD_FAR;
    size_t used = (size_t)snprintf(text, size, "expected one of ");
    const char *separator = "";
    for (const struct conf_section *section = conf_sections; section->name; section++) {
        if (used < size)
            used += (size_t)snprintf(text + used, size - used, "%s[%s%s]", separator, section->name,
                                     name_part(section->name));
        separator = ", ";
        if (word_is_nearest(name, section->name, &best))
            nearest = section->name;
    }
    if (nearest)
        snprintf(text, size, "did you mean [%s%s]?", nearest, name_part(nearest));
}
