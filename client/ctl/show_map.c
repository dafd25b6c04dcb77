/* SPDX-License-Identifier: MIT */
/* show_map - see show_map.h. */
#include "show_map.h"

#include <math.h>
#include <string.h>

#include "page.h"

#define SVG_SIDE   640.0 /* pixels of the picture's longer side */
#define MARGIN     44.0
#define SLICE_MAX  1024 /* rows and columns that are drawn */
#define GRID_LINES 8    /* at most, each way */
#define FAR_M      1e9

static double number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

/* Printable as it is, on any terminal. */
static void print_text(FILE *out, const json_t *object, const char *key)
{
    const char *s = json_string_value(json_object_get(object, key));
    for (; s && *s; s++)
        fputc((unsigned char)*s < 0x20 || (unsigned char)*s >= 0x7f ? '?' : *s, out);
}

/* ---- answers and state ---- */

void show_map_place(FILE *out, const json_t *result, bool colour)
{
    const char *state = json_string_value(json_object_get(result, "state"));
    const json_t *first = json_object_get(result, "first"), *position = json_object_get(first, "position_m");
    const char *code = !state                           ? ""
                       : strcmp(state, "free") == 0     ? "\033[32m"
                       : strcmp(state, "occupied") == 0 ? "\033[31m"
                                                        : "\033[33m";
    fputs(colour ? code : "", out);
    print_text(out, result, "state");
    fputs(colour ? "\033[0m\n" : "\n", out);
    if (json_array_size(position) == 3) {
        fputs("  first    ", out);
        print_text(out, first, "state");
        fprintf(out, " at north %.2f, east %.2f, down %.2f m", json_number_value(json_array_get(position, 0)),
                json_number_value(json_array_get(position, 1)), json_number_value(json_array_get(position, 2)));
        if (!isnan(number(first, "along_m")))
            fprintf(out, ", %.2f m along the path", number(first, "along_m"));
        fputc('\n', out);
    }
    if (!isnan(number(result, "unknown_share")))
        fprintf(out, "  unknown  %.1f %% of the voxels\n", 100 * number(result, "unknown_share"));
    fputs("  because  ", out);
    print_text(out, result, "reason");
    fputc('\n', out);
    page_target(&(struct page){.out = out}, result);
}

/* A count with what it is of; one that is 0 and tells of losses is left out. */
static void show_count(FILE *out, const json_t *result, const char *key, const char *what, bool loss)
{
    const json_int_t n = json_integer_value(json_object_get(result, key));
    if (json_is_integer(json_object_get(result, key)) && (n > 0 || !loss))
        fprintf(out, "%-12s %lld %s\n", loss ? "unknown" : "", (long long)n, what);
}

static void show_job(FILE *out, const json_t *result, const char *key)
{
    const json_t *job = json_object_get(result, key);
    if (!json_is_object(job))
        return;
    fprintf(out, "%-12s ", key);
    print_text(out, job, "what");
    fputs(": ", out);
    print_text(out, job, "state");
    fputs(", ", out);
    print_text(out, job, "message");
    fputc('\n', out);
}

void show_map_state(FILE *out, const json_t *result)
{
    static const struct {
        const char *key, *what;
        bool loss;
    } counts[] = {{"pings", "pings entered", false},
                  {"submaps", "submaps in memory", false},
                  {"begun", "submaps started in total", false},
                  {"not_entered", "pings not entered: no pose that places them", true},
                  {"clipped", "beams cut at the edge of their submap", true},
                  {"starved", "runs of voxels dropped, memory full", true},
                  {"dropped", "submaps dropped, memory full", true},
                  {"saved", "... of them saved before", false},
                  {"save_errors", "failed saves of a submap", true}};

    fputs("map          ", out);
    print_text(out, result, "state");
    fputc('\n', out);
    if (!isnan(number(result, "voxel_m")))
        fprintf(out, "voxel        %g m\n", number(result, "voxel_m"));
    if (!isnan(number(result, "memory_bytes")))
        fprintf(out, "memory       %.1f of %.1f MiB\n", number(result, "used_bytes") / 1048576,
                number(result, "memory_bytes") / 1048576);
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++)
        show_count(out, result, counts[i].key, counts[i].what, counts[i].loss);
    show_job(out, result, "job");
    show_job(out, result, "kept");
}

/* ---- a slice ---- */

struct slice {
    const json_t *rows;
    size_t n_rows, n_columns;
    double north_m, east_m, step_m, depth_m; /* middle of the first row's first cell */
    double vehicle_m[2], heading_deg;        /* NAN: not known */
};

static bool slice_of(const json_t *result, struct slice *s)
{
    const json_t *vehicle = json_object_get(result, "vehicle_m");
    *s = (struct slice){.rows = json_object_get(result, "rows"),
                        .north_m = number(result, "north_m"),
                        .east_m = number(result, "east_m"),
                        .step_m = number(result, "step_m"),
                        .depth_m = number(result, "depth_m"),
                        .heading_deg = number(result, "heading_deg"),
                        .vehicle_m = {NAN, NAN}};
    s->n_rows = json_array_size(s->rows);
    s->n_columns = s->n_rows ? json_string_length(json_array_get(s->rows, 0)) : 0;
    for (size_t a = 0; a < 2 && json_array_size(vehicle) == 3; a++)
        s->vehicle_m[a] = json_number_value(json_array_get(vehicle, a));
    return s->n_rows && s->n_columns && s->n_rows <= SLICE_MAX && s->n_columns <= SLICE_MAX && s->step_m > 0 &&
           fabs(s->north_m) < FAR_M && fabs(s->east_m) < FAR_M;
}

static char cell_of(const struct slice *s, size_t row, size_t column)
{
    const json_t *line = json_array_get(s->rows, row);
    return column < json_string_length(line) ? json_string_value(line)[column] : ' ';
}

/* Of a place, in cells from the first one's middle. */
static double row_of(const struct slice *s, double north_m)
{
    return (s->north_m - north_m) / s->step_m;
}

static double column_of(const struct slice *s, double east_m)
{
    return (east_m - s->east_m) / s->step_m;
}

void show_map_draw(FILE *out, const json_t *result)
{
    struct slice s;
    if (!slice_of(result, &s)) {
        fputs("nothing to draw\n", out);
        return;
    }
    const double row = round(row_of(&s, s.vehicle_m[0])), column = round(column_of(&s, s.vehicle_m[1]));

    for (size_t i = 0; i < s.n_rows; i++) {
        for (size_t j = 0; j < s.n_columns; j++) {
            const char c = (double)i == row && (double)j == column ? '@' : cell_of(&s, i, j);
            fputc(c, out); /* twice: a character is about twice as high as wide */
            fputc(c, out);
        }
        fputc('\n', out);
    }
    fprintf(out, "depth %.2f m, %g m a cell, north up; . free, # occupied, @ the vehicle, blank unknown\n",
            s.depth_m, s.step_m);
}

static const char *colour_of(char c)
{
    return c == '.' ? "#7cc4e8" : c == '#' ? "#b3261e" : NULL;
}

/* One rectangle per run of equal cells; unknown is the ground. */
static void svg_cells(FILE *out, const struct slice *s, double pixels)
{
    for (size_t i = 0; i < s->n_rows; i++)
        for (size_t j = 0, n; j < s->n_columns; j += n) {
            const char c = cell_of(s, i, j);
            for (n = 1; j + n < s->n_columns && cell_of(s, i, j + n) == c; n++) {
            }
            if (colour_of(c))
                fprintf(out, "<rect x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" fill=\"%s\"/>\n",
                        MARGIN + (double)j * pixels, MARGIN + (double)i * pixels, (double)n * pixels, pixels,
                        colour_of(c));
        }
}

static double nice_spacing(double extent_m)
{
    double spacing = 1e-3;
    static const double factor[] = {2, 2.5, 2};
    for (int i = 0; extent_m / spacing > GRID_LINES && i < 60; i++)
        spacing *= factor[i % 3];
    return spacing;
}

static void svg_grid(FILE *out, const struct slice *s, double pixels)
{
    const double width = (double)s->n_columns * pixels, height = (double)s->n_rows * pixels;
    const double spacing = nice_spacing(s->step_m * (double)(s->n_rows > s->n_columns ? s->n_rows : s->n_columns));
    const double south_m = s->north_m - ((double)s->n_rows - 0.5) * s->step_m;
    const double west_m = s->east_m - 0.5 * s->step_m;
    double m;
    for (m = ceil(west_m / spacing) * spacing; column_of(s, m) < (double)s->n_columns - 0.5; m += spacing) {
        const double x = MARGIN + (column_of(s, m) + 0.5) * pixels;
        fprintf(out, "<path d=\"M%.2f %.2fv%.2f\"/><text x=\"%.2f\" y=\"%.2f\" text-anchor=\"middle\">%g</text>\n",
                x, MARGIN, height, x, MARGIN + height + 16, m);
    }
    for (m = ceil(south_m / spacing) * spacing; row_of(s, m) > -0.5; m += spacing) {
        const double y = MARGIN + (row_of(s, m) + 0.5) * pixels;
        fprintf(out, "<path d=\"M%.2f %.2fh%.2f\"/><text x=\"%.2f\" y=\"%.2f\" text-anchor=\"end\">%g</text>\n",
                MARGIN, y, width, MARGIN - 5, y + 4, m);
    }
}

static void svg_vehicle(FILE *out, const struct slice *s, double pixels)
{
    const double x = MARGIN + (column_of(s, s->vehicle_m[1]) + 0.5) * pixels;
    const double y = MARGIN + (row_of(s, s->vehicle_m[0]) + 0.5) * pixels;
    if (!(x >= MARGIN && y >= MARGIN && x <= 2 * SVG_SIDE && y <= 2 * SVG_SIDE))
        return;
    if (isnan(s->heading_deg))
        fprintf(out, "<circle cx=\"%.2f\" cy=\"%.2f\" r=\"6\" fill=\"#1a1a1a\"/>\n", x, y);
    else
        fprintf(
            out,
            "<path transform=\"translate(%.2f %.2f) rotate(%.1f)\" d=\"M0 -11L7 8L0 4L-7 8Z\" fill=\"#1a1a1a\" "
            "stroke=\"#fff\" stroke-width=\"1.2\"/>\n",
            x, y, s->heading_deg);
}

static void svg_legend(FILE *out, const struct slice *s, double width)
{
    static const struct {
        const char *colour, *word;
    } entries[] = {{"#7cc4e8", "free"}, {"#b3261e", "occupied"}, {"#d9d9d6", "unknown"}};
    double x = MARGIN + width;

    fprintf(out, "<text x=\"%.0f\" y=\"28\" font-size=\"15\">depth %.2f m</text>\n", MARGIN, s->depth_m);
    for (size_t i = sizeof entries / sizeof *entries; i-- > 0;) {
        x -= 24 + 8 * (double)strlen(entries[i].word);
        fprintf(
            out,
            "<rect x=\"%.0f\" y=\"17\" width=\"13\" height=\"13\" fill=\"%s\" stroke=\"#777\"/><text x=\"%.0f\" "
            "y=\"28\">%s</text>\n",
            x, entries[i].colour, x + 17, entries[i].word);
    }
}

bool show_map_svg(FILE *out, const json_t *result)
{
    struct slice s;
    const bool any = slice_of(result, &s);
    const double longer = any ? (double)(s.n_rows > s.n_columns ? s.n_rows : s.n_columns) : 1;
    const double pixels = (SVG_SIDE - 2 * MARGIN) / longer;
    const double width = any ? (double)s.n_columns * pixels : 300, height = any ? (double)s.n_rows * pixels : 60;
    fprintf(out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" font-family=\"sans-serif\" "
            "font-size=\"12\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
            width + 2 * MARGIN, height + 2 * MARGIN);
    fprintf(out, "<rect x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" fill=\"#d9d9d6\"/>\n", MARGIN, MARGIN,
            width, height);
    if (any) {
        fputs("<g shape-rendering=\"crispEdges\">\n", out);
        svg_cells(out, &s, pixels);
        fputs("</g>\n<g fill=\"#444\" stroke-width=\"0\"><g stroke=\"#000\" stroke-opacity=\"0.15\" "
              "stroke-width=\"1\">\n",
              out);
        svg_grid(out, &s, pixels);
        fputs("</g></g>\n", out);
        svg_vehicle(out, &s, pixels);
        svg_legend(out, &s, width);
        fprintf(out, "<text x=\"%.0f\" y=\"%.0f\" text-anchor=\"end\">east, m; north up</text>\n", MARGIN + width,
                MARGIN + height + 32);
    } else {
        fprintf(out, "<text x=\"%.0f\" y=\"%.0f\">nothing is in the map here</text>\n", MARGIN + 12, MARGIN + 34);
    }
    fputs("</svg>\n", out);
    return fflush(out) == 0 && !ferror(out);
}
