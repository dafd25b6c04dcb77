/* SPDX-License-Identifier: MIT */
/*
 * protocol - the methods of the socket as data: a row per method with its parameters and the fields of its result. The
 * daemon's parser, the schema, the manual page and the shells' completion go by it. Knows no socket,
 * no JSON library and no daemon.
 */
#ifndef SONARD_PROTOCOL_H
#define SONARD_PROTOCOL_H

#include <stdbool.h>
#include <stddef.h>

/* The first line of a file of settings that sonard-web writes: the daemon starts without what is wrong in it. */
#define PROTOCOL_PAGE_FILE "# Written by sonard-web; a change by hand is lost."

/* Limits that size arrays in the daemon. */
#define PROTOCOL_SECTORS_MAX    720
#define PROTOCOL_CLUSTERS_MAX   256
#define PROTOCOL_NEXT_LOOK_MAX  64
#define PROTOCOL_EXPLAIN_MAX    64
#define PROTOCOL_LEARN_MAX      64
#define PROTOCOL_PATH_MAX       256
#define PROTOCOL_SLICE_MAX      400
#define PROTOCOL_SURFACE_MAX    1024
#define PROTOCOL_CELLS_MAX      1024
#define PROTOCOL_PARAM_DEFAULTS 3 /* elements of an array that has defaults */

enum protocol_type {
    PROTOCOL_NUMBER,
    PROTOCOL_INTEGER,
    PROTOCOL_NUMBERS, /* an array of `count` numbers */
    PROTOCOL_BAND,    /* two numbers, the first below the second */
    PROTOCOL_PLACES,  /* an array of 1 to `count` arrays of 3 numbers */
    PROTOCOL_WORD,    /* one of `words` */
    PROTOCOL_FLAG,
    PROTOCOL_TEXT,
    PROTOCOL_GRID,   /* the name of a grid, */
    PROTOCOL_SENSOR, /* of a sonar, */
    PROTOCOL_MAP,    /* of a map's file, without its ending, */
    PROTOCOL_METHOD, /* of a method */
    PROTOCOL_CURSOR, /* what a page before gave, or null */
    PROTOCOL_OBJECT,
};

enum protocol_need { PROTOCOL_OPTIONAL, PROTOCOL_DEFAULT, PROTOCOL_REQUIRED };

struct protocol_param {
    const char *name; /* NULL ends the list */
    enum protocol_type type;
    unsigned count;           /* elements of an array */
    const char *unit;         /* "": none */
    double lo, hi;            /* of every number in it, both included */
    const char *const *words; /* NULL ends them */
    enum protocol_need need;
    double initial[PROTOCOL_PARAM_DEFAULTS]; /* PROTOCOL_DEFAULT: the numbers, the index in words, 0 or 1 */
    const char *absent;                      /* PROTOCOL_OPTIONAL: what holds without it; "": nothing does */
    const char *instead_of;                  /* a parameter that may not be given beside it, or NULL */
    const char *help;
};

enum protocol_right {
    PROTOCOL_ASKS = 0,
    PROTOCOL_CHANGES = 1, /* something in the daemon or on its disk: not for everybody, and cannot be watched */
};

/* Of a result, or of an object in one; shapes.def says what a type is. */
struct protocol_field {
    const char *name; /* NULL ends the list */
    const char *type, *help;
    bool maybe; /* it is not always there */
};

struct protocol_shape {
    const char *name; /* NULL ends the table */
    const struct protocol_field *fields;
};

struct protocol_method {
    const char *name; /* NULL ends the table */
    enum protocol_right right;
    const char *help;
    const struct protocol_param *params; /* a name NULL ends them */
    const char *result_of;               /* the type of its result, or NULL: */
    const struct protocol_field *result;
};

/* The index of every method in protocol_methods. */
enum protocol_index {
#define METHOD(name, ...) PROTOCOL_##name,
#define SERVER_METHOD     METHOD
#define CHECKING_METHOD   METHOD
#include "methods.def"
    PROTOCOL_METHODS, /* how many there are */
};

extern const struct protocol_method protocol_methods[];
extern const struct protocol_shape protocol_shapes[];

/** protocol_find - the row of a method, or NULL. */
const struct protocol_method *protocol_find(const char *name);

/** protocol_without - what holds without a parameter, for people: "7.5", "-5,5", "main"; "" when nothing does. */
void protocol_without(const struct protocol_param *param, char *text, size_t size);

#endif
