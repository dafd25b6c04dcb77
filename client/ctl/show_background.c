/* SPDX-License-Identifier: MIT */
/* show_background - see show_background.h. */
#include "show_background.h"

#include <math.h>
#include <string.h>

#include "plot.h"
#include "polar.h"

#define LINES        31 /* of the drawing; odd, so that the vehicle is in the middle of one */
#define COLUMNS      61
#define ROWS_MAX     512
#define SMALLEST_RIM 1.0 /* m */
#define RANGE_MAX_M  10000.0
#define DEG          57.29577951308232

static long long whole(const json_t *object, const char *key)
{
    return (long long)json_integer_value(json_object_get(object, key));
}

static void print_text(FILE *out, const char *text)
{
    for (; *text; text++)
        fputc((unsigned char)*text < 0x20 || *text == 0x7f ? '?' : *text, out);
}

static void print_line(FILE *out, const char *name, const char *text)
{
    fprintf(out, "%-10s ", name);
    print_text(out, text);
    fputc('\n', out);
}

void show_background_progress(FILE *out, const json_t *result)
{
    const json_t *l = json_object_get(result, "learning");
    double progress = 0;
    polar_number(l, "progress", 0, 1, &progress);
    fprintf(out, "%3.0f %%: %lld of %lld rows have their %lld pings; ", 100 * progress, whole(l, "rows_full"),
            whole(l, "rows_seen"), whole(l, "pings"));
    print_text(out, polar_text(l, "motion", "-"));
}

void show_background_state(FILE *out, const json_t *result)
{
    const json_t *t = json_object_get(result, "template"), *l = json_object_get(result, "learning");
    double r1_m = 0;
    print_line(out, "sonar", polar_text(result, "sensor", "-"));
    print_line(out, "state", polar_text(result, "state", "-"));
    print_line(out, "file", polar_text(result, "file", "none configured"));
    if (json_is_object(t)) {
        polar_number(t, "r1_m", 0, RANGE_MAX_M, &r1_m);
        fprintf(out, "template   %lld of %lld rows, %lld bins to %.2f m, %s\n", whole(t, "rows_learnt"),
                whole(t, "rows"), whole(t, "bins"), r1_m,
                json_is_true(json_object_get(t, "saved")) ? "saved" : "not saved");
        fprintf(out, "blind      %lld cells above %lld counts\n", whole(t, "blind_cells"), whole(t, "mask"));
        print_line(out, "fits", polar_text(t, "fits", "-"));
    }
    if (json_is_object(l)) {
        fprintf(out, "learning   ");
        show_background_progress(out, result);
        fputc('\n', out);
    }
    const char *happened = polar_text(result, "happened", "-");
    print_line(out, "happened", *happened ? happened : "nothing yet");
}

/* ---- the drawing ---- */

struct row {
    double az_deg, width_deg;
    const json_t *blind;
};

static size_t read_rows(const json_t *result, struct row *row)
{
    const json_t *rows = json_object_get(result, "rows");
    size_t n = 0;
    for (size_t i = 0; i < json_array_size(rows) && n < ROWS_MAX; i++) {
        const json_t *j = json_array_get(rows, i);
        row[n].blind = json_object_get(j, "blind");
        n += polar_number(j, "azimuth_deg", -360, 720, &row[n].az_deg) &&
             polar_number(j, "width_deg", 0, 360, &row[n].width_deg);
    }
    return n;
}

static double edge(const json_t *stretch, size_t i)
{
    const double r = json_number_value(json_array_get(stretch, i));
    return r >= 0 && r <= RANGE_MAX_M ? r : 0;
}

/* A fifth beyond the farthest blind cell. */
static double rim_of(const struct row *row, size_t n)
{
    double far_m = SMALLEST_RIM;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < json_array_size(row[i].blind); k++)
            far_m = fmax(far_m, 1.2 * edge(json_array_get(row[i].blind, k), 1));
    return far_m;
}

static double apart_deg(double a, double b)
{
    return fabs(remainder(a - b, 360));
}

static char cell_char(const struct row *row, size_t n, double az_deg, double r_m, double half_m)
{
    /* one cell may lie over several rows: blind where any of them is */
    const double reach_deg = r_m > 0 ? DEG * half_m / r_m : 180;
    bool learnt = false;
    for (size_t i = 0; i < n; i++) {
        if (apart_deg(row[i].az_deg, az_deg) > fmax(row[i].width_deg / 2, reach_deg))
            continue;
        learnt = true;
        for (size_t k = 0; k < json_array_size(row[i].blind); k++) {
            const json_t *stretch = json_array_get(row[i].blind, k);
            if (edge(stretch, 0) <= r_m + half_m && edge(stretch, 1) >= r_m - half_m)
                return '#';
        }
    }
    return learnt ? '.' : ' ';
}

void show_background_draw(FILE *out, const json_t *result)
{
    struct row row[ROWS_MAX];
    const size_t n = read_rows(result, row);
    const double rim_m = rim_of(row, n), cell_m = 2 * rim_m / LINES;
    if (n == 0) {
        fprintf(out, "no template is in force: nothing to draw\n");
        return;
    }
    for (int y = 0; y < LINES; y++) {
        for (int x = 0; x < COLUMNS; x++) {
            const double ahead = (LINES / 2 - y) * cell_m, right = (x - COLUMNS / 2) * cell_m / 2;
            const double r = hypot(ahead, right);
            const bool middle = y == LINES / 2 && x == COLUMNS / 2;
            fputc(middle      ? '+'
                  : r > rim_m ? ' '
                              : cell_char(row, n, DEG * atan2(right, ahead), r, cell_m / 2),
                  out);
        }
        fputc('\n', out);
    }
    fprintf(out, "forward is up, the rim is %.2f m; # blind, . open, blank not learnt\n", rim_m);
}

bool show_background_svg(FILE *out, json_t *result)
{
    struct row row[ROWS_MAX];
    const struct plot_conf conf = {.title = "the vehicle's own echoes",
                                   .range_m = rim_of(row, read_rows(result, row))};
    return plot_svg(out, result, NULL, &conf);
}
