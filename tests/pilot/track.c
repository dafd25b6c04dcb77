/* SPDX-License-Identifier: MIT */
/* track - see track.h. */
#include "track.h"

#include <stdarg.h>
#include <stdio.h>

#define SCALE   40.0 /* pixels of a metre */
#define WEST_M  (-8.0)
#define SOUTH_M (-4.0)
#define WIDE_M  16.0
#define HIGH_M  20.0
#define LINE_Y  20.0

static const char *const colour[] = {
    [PILOT_GOING] = "#2a9d5c", [PILOT_UNKNOWN] = "#e09f1f", [PILOT_BLOCKED] = "#c8352b"};

static double x_of(double east_m)
{
    return (east_m - WEST_M) * SCALE;
}

static double y_of(double north_m)
{
    return (SOUTH_M + HIGH_M - north_m) * SCALE;
}

static void circle(FILE *f, double north_m, double east_m, double radius_m, const char *style)
{
    fprintf(f, "<circle cx='%.1f' cy='%.1f' r='%.1f' %s/>\n", x_of(east_m), y_of(north_m), radius_m * SCALE,
            style);
}

static void box(FILE *f, const double *p, const char *style)
{
    fprintf(f, "<rect x='%.1f' y='%.1f' width='%.1f' height='%.1f' %s/>\n", x_of(p[2]), y_of(p[1]),
            (p[3] - p[2]) * SCALE, (p[1] - p[0]) * SCALE, style);
}

/* Hatched: the vehicle passes above or below it. */
static void solid(FILE *f, const struct place_shape *s, double end_s)
{
    const double *p = s->p, *v = s->v;
    if (s->kind == PLACE_BOX) {
        const bool apart = p[4] > pilot_hull.half_height_m || p[5] < -pilot_hull.half_height_m;
        box(f, p,
            s->water ? "fill='none' stroke='#56657a' stroke-width='4'"
            : apart  ? "fill='#8aa4c0' fill-opacity='0.25' stroke='#8aa4c0'"
                     : "fill='#56657a'");
        return;
    }
    circle(f, p[0], p[1], p[2], "fill='#56657a'");
    if (!place_moves(s))
        return;
    fprintf(f, "<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f' stroke='#56657a' stroke-dasharray='4'/>\n",
            x_of(p[1]), y_of(p[0]), x_of(p[1] + v[1] * end_s), y_of(p[0] + v[0] * end_s));
}

static void way(FILE *f, const struct pilot_track *t)
{
    for (int i = 1; i < t->n; i++)
        fprintf(f,
                "<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f' stroke='%s' stroke-width='3' "
                "stroke-linecap='round'/>\n",
                x_of((double)t->at[i - 1].y_m), y_of((double)t->at[i - 1].x_m), x_of((double)t->at[i].y_m),
                y_of((double)t->at[i].x_m), colour[t->at[i].held]);
}

static void line(FILE *f, int number, const char *form, ...)
{
    va_list ap;
    fprintf(f, "<text x='8' y='%.0f'>", number * LINE_Y);
    va_start(ap, form);
    vfprintf(f, form, ap);
    va_end(ap);
    fprintf(f, "</text>\n");
}

static void words(FILE *f, const struct pilot_case *c, const struct pilot_result *r)
{
    char name[PILOT_NAME_SIZE];
    line(f, 1, "%s", pilot_name(c, name));
    line(f, 2, "%s after %.0f s, with a chart of all %.0f s; least clearance %.2f m",
         r->arrived ? "arrived" : "under way", r->time_s, r->known_s, r->nearest_m);
    line(f, 3, "held by unknown water %.0f %% of the time, by obstacles %.0f %%", 100 * r->share[PILOT_UNKNOWN],
         100 * r->share[PILOT_BLOCKED]);
    line(f, 4, "green: at half of the speed wanted or more; yellow: held by unknown water; red: by an obstacle");
}

bool track_write(const char *path, const struct pilot_case *c, const struct pilot_result *result,
                 const struct pilot_track *track)
{
    struct place w;
    FILE *f = fopen(path, "w");
    if (!f)
        return false;
    w = place_of_pilot(c->place, c->seed, &pilot_hull, pilot_free_m(c));
    fprintf(f,
            "<svg xmlns='http://www.w3.org/2000/svg' width='%.0f' height='%.0f' font-family='sans-serif' "
            "font-size='13'>\n<rect width='100%%' height='100%%' fill='#eef4fa'/>\n",
            WIDE_M * SCALE, HIGH_M * SCALE);
    for (const struct place_shape *s = w.shape; s->kind != PLACE_END; s++)
        solid(f, s, result->end_s);
    for (int i = 0; i < track->n; i += 25)
        circle(f, (double)track->at[i].x_m, (double)track->at[i].y_m, pilot_hull.radius_m,
               "fill='none' stroke='#9ab' stroke-width='1'");
    way(f, track);
    circle(f, w.to[0], w.to[1], 0.15, "fill='none' stroke='#225' stroke-width='3'");
    words(f, c, result);
    fprintf(f, "</svg>\n");
    return fclose(f) == 0;
}
