/* SPDX-License-Identifier: MIT */
/*
 * conf_table - every section and key of the configuration, one row each. Whoever adds a key adds a field to
 * struct conf and a row here; parser, --check, --print, the default file and the man page follow.
 */
#ifndef SONARD_CONF_TABLE_H
#define SONARD_CONF_TABLE_H

#include <stdbool.h>
#include <stddef.h>

#define CONF_KEYS_MAX 160

enum conf_kind {
    CONF_QUANTITY, /* n doubles, with a unit or plain */
    CONF_INTEGER,  /* int */
    CONF_WORD,     /* int: index into words */
    CONF_OCTAL,    /* int: permission bits */
    CONF_TEXT,     /* char[size], begins with a letter */
    CONF_PATH,     /* char[size], absolute */
    CONF_NAME,     /* char[size], letters, digits, - and _ */
    CONF_NAMES,    /* char[size], names with blanks or commas between */
};

struct conf_named {
    const char *word;
    double value; /* in SI */
};

struct conf_section {
    const char *name; /* "sonar" stands for every [sonar NAME] */
    const char *help; /* one paragraph, lines of at most 100 columns */
};

struct conf_key {
    const char *section, *name;
    enum conf_kind kind;
    int n;                    /* CONF_QUANTITY: how many numbers */
    const char *unit;         /* CONF_QUANTITY: the key's own unit, also of lo and hi; NULL: plain numbers */
    const char *also;         /* a unit of another kind whose numbers mean the same; NULL: none */
    double lo, hi;            /* closed range */
    const char *standard;     /* the default as it would stand in a file; NULL: the key is required ... */
    const char *example;      /* ... and the sample has this */
    const char *const *words; /* CONF_WORD: NULL-terminated */
    const char *form;         /* CONF_TEXT, CONF_PATH, CONF_NAME and CONF_NAMES: what is allowed, in words */
    const char *instead;      /* a word that may stand instead of the value, or NULL ... */
    double instead_value;     /* ... and what the field holds then; a text is empty then */
    bool live;                /* can be changed while the daemon runs, ... */
    bool of_head;             /* ... [sonar NAME]: where its device can, see conf_checks.retunes */
    bool of_device;           /* [sonar NAME]: not every device has a use for it, see conf_checks.uses */
    size_t offset, size;      /* of the field in struct conf, or in struct conf_sonar for section sonar */
    const char *help;         /* what it is and why one would change it; lines of at most 100 columns */

    /* CONF_QUANTITY of one number: words for some of its values, the last with word NULL; or NULL */
    const struct conf_named *named;
};

extern const struct conf_section conf_sections[]; /* ends with name NULL; in the order of the sample */
extern const struct conf_key conf_keys[];         /* ends with name NULL; sections in the order of conf_sections */

/** conf_key_find - the row of a key, or NULL. */
const struct conf_key *conf_key_find(const char *section, const char *name);

/** conf_section_find - the row of a section, or NULL. */
const struct conf_section *conf_section_find(const char *name);

/**
 * conf_base - where in struct conf key->offset counts from: `which` is the sonar's number, or the grid's, 0 being the
 * plain one.
 */
size_t conf_base(const struct conf_key *key, int which);

/** conf_key_is_sonar - is the key one of a [sonar NAME] section? */
bool conf_key_is_sonar(const struct conf_key *key);

#endif
