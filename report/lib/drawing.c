/* SPDX-License-Identifier: MIT */
#include "drawing.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "grid/geometry.h"

#define NUMBERS_MAX 5

/* Words with a number each: where it goes, and what is allowed. */
static const struct setting {
    const char *word;
    size_t offset;
    double least, most, standard;
    bool whole;
} settings[] = {
    {"opening", offsetof(struct drawing, opening_deg), 0.1, 30, 2.5, false},
    {"range", offsetof(struct drawing, range_m), 1e-3, 1e5, 100, false},
    {"layer", offsetof(struct drawing, layer_m), 1e-3, 1e3, 1, false},
    {"range_error", offsetof(struct drawing, range_error), 0, 0.1, 0.003, false},
    {"places", offsetof(struct drawing, places), 1, 1000, 1, true},
    {"tilts", offsetof(struct drawing, tilts), 1, 20, 1, true},
    {"swing", offsetof(struct drawing, swing_m), 0, 1e4, 0, false},
    {"yaw", offsetof(struct drawing, yaw_deg), -180, 180, 0, false},
};
#define SETTINGS (sizeof settings / sizeof settings[0])

static double *field(struct drawing *d, const struct setting *s)
{
    return (double *)(void *)((char *)d + s->offset);
}

/* The numbers behind the word; -1: something else stands there, or too many do. */
static int numbers(char *text, double out[NUMBERS_MAX])
{
    int n = 0;
    for (char *rest = NULL, *word = strtok_r(text, " \t\n", &rest); word; word = strtok_r(NULL, " \t\n", &rest)) {
        char *end;
        if (n == NUMBERS_MAX)
            return -1;
        out[n] = strtod(word, &end);
        if (*end || !(fabs(out[n++]) <= 1e6))
            return -1;
    }
    return n;
}

static bool add_edge(struct drawing *d, enum drawing_kind kind, const double *v)
{
    if (d->edges == DRAWING_EDGES)
        return false;
    struct drawing_edge *e = &d->edge[d->edges++];
    *e = (struct drawing_edge){.kind = kind, .a = {v[0], v[1]}, .b = {v[2], v[3]}};
    if (kind == DRAWING_LINE)
        return hypot(v[2] - v[0], v[3] - v[1]) > 0;
    e->b[2] = v[4];
    return v[2] > 0 && v[3] >= 0 && v[3] < v[4] && v[4] <= 360;
}

static bool take(struct drawing *d, const char *word, const double *v, int n)
{
    if (!strcmp(word, "line"))
        return n == 4 && add_edge(d, DRAWING_LINE, v);
    if (!strcmp(word, "arc"))
        return n == 5 && add_edge(d, DRAWING_ARC, v);
    if (!strcmp(word, "path")) {
        memcpy(d->path, v, sizeof d->path);
        return n == 4;
    }
    for (size_t i = 0; i < SETTINGS; i++)
        if (!strcmp(word, settings[i].word)) {
            *field(d, &settings[i]) = v[0];
            return n == 1 && v[0] >= settings[i].least && v[0] <= settings[i].most &&
                   (!settings[i].whole || v[0] == floor(v[0]));
        }
    return false;
}

/* One line of the file, without its comment. */
static bool take_line(struct drawing *d, char *line)
{
    double v[NUMBERS_MAX] = {0};
    char *rest = NULL;
    line[strcspn(line, "#")] = '\0';
    const char *word = strtok_r(line, " \t\n", &rest);
    if (!word)
        return true;
    const int n = numbers(rest, v);
    return n >= 0 && take(d, word, v, n);
}

bool drawing_read(const char *path, struct drawing *out, struct fault *fault)
{
    char line[256];
    int number = 0;
    bool good = true;
    FILE *f = fopen(path, "r");
    if (!f)
        return fault_set(fault, "%s: no such scene", path);
    *out = (struct drawing){0};
    for (size_t i = 0; i < SETTINGS; i++)
        *field(out, &settings[i]) = settings[i].standard;
    while (good && fgets(line, sizeof line, f)) {
        number++;
        good = take_line(out, line);
    }
    fclose(f);
    if (!good)
        return fault_set(fault, "%s:%d: no line of a scene, or a number out of range", path, number);
    return out->edges > 0 || fault_set(fault, "%s: a scene without lines and arcs", path);
}

/* Nearest crossing of the ray from p along unit vector u with the edge; INFINITY: none. */
static double crossing(const struct drawing_edge *e, const double p[2], const double u[2])
{
    const double ax = e->a[0] - p[0], ay = e->a[1] - p[1];
    if (e->kind == DRAWING_LINE) {
        const double dx = e->b[0] - e->a[0], dy = e->b[1] - e->a[1], cross = u[0] * dy - u[1] * dx;
        const double r = (ax * dy - ay * dx) / cross, s = (ax * u[1] - ay * u[0]) / cross;
        return cross != 0 && r > 0 && s >= 0 && s <= 1 ? r : INFINITY;
    }
    const double along = ax * u[0] + ay * u[1], under = along * along - ax * ax - ay * ay + e->b[0] * e->b[0];
    for (int side = -1; under >= 0 && side <= 1; side += 2) {
        const double r = along + side * sqrt(under);
        const double angle = geo_wrap(atan2(p[1] + r * u[1] - e->a[1], p[0] + r * u[0] - e->a[0]));
        if (r > 0 && angle >= geo_rad(e->b[1]) && angle <= geo_rad(e->b[2]))
            return r;
    }
    return INFINITY;
}

double drawing_ray(const struct drawing *d, const double p[2], double angle)
{
    const double u[2] = {cos(angle), sin(angle)};
    double r = INFINITY;
    for (unsigned i = 0; i < d->edges; i++)
        r = fmin(r, crossing(&d->edge[i], p, u));
    return r;
}

double drawing_length(const struct drawing_edge *e)
{
    return e->kind == DRAWING_LINE ? hypot(e->b[0] - e->a[0], e->b[1] - e->a[1])
                                   : e->b[0] * geo_rad(e->b[2] - e->b[1]);
}

void drawing_point(const struct drawing_edge *e, double t, double out[2])
{
    const double angle = geo_rad(e->b[1] + t * (e->b[2] - e->b[1]));
    for (int i = 0; i < 2; i++)
        out[i] = e->kind == DRAWING_LINE ? e->a[i] + t * (e->b[i] - e->a[i])
                                         : e->a[i] + e->b[0] * (i ? sin(angle) : cos(angle));
}
