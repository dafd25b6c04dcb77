/* SPDX-License-Identifier: MIT */
/*
 * plot - see plot.h. The disc is drawn in tenths of a unit around its centre, so that coordinates are short whole
 * numbers: a turn of a sonar has some 200 000 samples, and the file should stay near a megabyte.
 */
#include "plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "polar.h"

#define PI 3.14159265358979323846

#define DISC         3300 /* radius, in tenths */
#define RING_IN      3400
#define RING_OUT     3620
#define LABELS       3780
#define CENTRE_X     450
#define CENTRE_Y     478
#define LABEL_ACROSS 300 /* half of what a range's label needs */
#define LABEL_UP     140
#define SECTORS_MAX  720
/* Vermilion and blue, which those who do not tell red from green tell apart, and greys too: light, dark, hatched. */
#define BLOCKED   "#d8501f"
#define CLEAR     "#0a5ea8"
#define UNKNOWN   "url(#unknown)"
#define NEAREST   "#ff9a6b"
#define NOT_HEARD "#3d4454" /* where there are no samples */

/* From near black over blue and teal to pale yellow, each step about equally lighter than the one before. */
static void print_colour(FILE *out, double v)
{
    static const double stop[6][3] = {{8, 12, 24},    {24, 44, 104},   {20, 96, 148},
                                      {38, 156, 148}, {150, 206, 104}, {254, 246, 190}};
    const double x = fmin(fmax(v, 0), 1) * 5;
    const int i = x < 5 ? (int)x : 4;
    int rgb[3];
    for (int k = 0; k < 3; k++)
        rgb[k] = (int)lround(stop[i][k] + (x - i) * (stop[i + 1][k] - stop[i][k]));
    fprintf(out, "#%02x%02x%02x", (unsigned)rgb[0], (unsigned)rgb[1], (unsigned)rgb[2]);
}

static void print_escaped(FILE *out, const char *s)
{
    for (; *s; s++) {
        switch (*s) {
        case '&':
            fputs("&amp;", out);
            break;
        case '<':
            fputs("&lt;", out);
            break;
        case '>':
            fputs("&gt;", out);
            break;
        case '"':
            fputs("&quot;", out);
            break;
        default:
            fputc((unsigned char)*s < 0x20 || *s == 0x7f ? '?' : *s, out);
        }
    }
}

static int tenth_x(double r, double az_deg)
{
    return (int)lround(r * sin(az_deg * PI / 180));
}

static int tenth_y(double r, double az_deg)
{
    return (int)lround(-r * cos(az_deg * PI / 180));
}

/* Path data of an annular sector; radii in tenths. Arcs flatter than half a tenth are straight. */
static void annular_sector(FILE *out, double r0, double r1, double lo_deg, double hi_deg)
{
    const bool straight = r1 * (1 - cos((hi_deg - lo_deg) * PI / 360)) < 0.5;
    const int wide = hi_deg - lo_deg > 180;
    fprintf(out, "M%d %dL%d %d", tenth_x(r0, lo_deg), tenth_y(r0, lo_deg), tenth_x(r1, lo_deg),
            tenth_y(r1, lo_deg));
    if (straight)
        fprintf(out, "L%d %d %d %dz", tenth_x(r1, hi_deg), tenth_y(r1, hi_deg), tenth_x(r0, hi_deg),
                tenth_y(r0, hi_deg));
    else
        fprintf(out, "A%.0f %.0f 0 %d 1 %d %dL%d %dA%.0f %.0f 0 %d 0 %d %dz", r1, r1, wide, tenth_x(r1, hi_deg),
                tenth_y(r1, hi_deg), tenth_x(r0, hi_deg), tenth_y(r0, hi_deg), r0, r0, wide, tenth_x(r0, lo_deg),
                tenth_y(r0, lo_deg));
}

static void draw_intensities(FILE *out, const struct polar *polar)
{
    const double cell = (double)DISC / POLAR_CELLS;
    fprintf(out, "<g shape-rendering=\"crispEdges\">\n<path fill=\"");
    print_colour(out, 0);
    fprintf(out, "\" d=\"");
    for (size_t i = 0; i < polar->n_beams; i++) {
        const struct polar_beam *beam = &polar->beam[i];
        const double r1_m = fmin(beam->r1_m, polar->range_m);
        if (beam->n_samples > 0 && beam->r0_m < r1_m)
            annular_sector(out, beam->r0_m / polar->range_m * DISC, r1_m / polar->range_m * DISC, beam->lo_deg,
                           beam->hi_deg);
    }
    fprintf(out, "\"/>\n");
    for (int level = 1; level <= POLAR_LEVELS; level++) {
        fprintf(out, "<path fill=\"");
        print_colour(out, (double)level / POLAR_LEVELS);
        fprintf(out, "\" d=\"");
        for (size_t i = 0; i < polar->n_beams; i++) {
            const struct polar_beam *beam = &polar->beam[i];
            for (int c = 0, end; c < POLAR_CELLS; c = end) {
                end = polar_run_end(beam, c);
                if (beam->cell[c] == level)
                    annular_sector(out, c * cell, end * cell, beam->lo_deg, beam->hi_deg);
            }
        }
        fprintf(out, "\"/>\n");
    }
    fprintf(out, "</g>\n");
}

static void draw_echoes(FILE *out, const struct polar *polar)
{
    fprintf(out, "<g fill=\"#ffffff\" stroke=\"#b3123f\" stroke-width=\"9\">\n");
    for (size_t i = 0; i < polar->n_beams; i++) {
        const struct polar_beam *beam = &polar->beam[i];
        if (beam->echo_m <= polar->range_m) {
            const double r = beam->echo_m / polar->range_m * DISC;
            fprintf(out, "<circle cx=\"%d\" cy=\"%d\" r=\"14\"%s/>\n", tenth_x(r, beam->az_deg),
                    tenth_y(r, beam->az_deg), beam->echo_marked ? " stroke=\"#8a93a6\"" : "");
        }
    }
    fprintf(out, "</g>\n");
}

static const char *state_fill(const char *state)
{
    return strcmp(state, "blocked") == 0 ? BLOCKED : strcmp(state, "clear") == 0 ? CLEAR : UNKNOWN;
}

static void draw_sectors(FILE *out, const struct polar *polar, const json_t *sectors)
{
    const json_t *list = json_object_get(sectors, "sectors");
    for (size_t i = 0; i < json_array_size(list) && i < SECTORS_MAX; i++) {
        const json_t *sector = json_array_get(list, i);
        const char *state = polar_text(sector, "state", "unknown");
        double az, width = 0, range, gap;
        if (!polar_number(sector, "azimuth_deg", -360, 360, &az) ||
            !polar_number(sector, "width_deg", 0.01, 360, &width))
            continue;
        width = fmin(width, 359.9);
        gap = fmin(0.25, width / 10);
        fprintf(out, "<path fill=\"%s\" d=\"", state_fill(state));
        annular_sector(out, RING_IN, RING_OUT, az - width / 2 + gap, az + width / 2 - gap);
        fprintf(out, "\"/>\n");
        if (polar_number(sector, "range_m", 0, polar->range_m, &range)) {
            const double r = range / polar->range_m * DISC;
            fprintf(out, "<path fill=\"" NEAREST "\" d=\"");
            annular_sector(out, fmax(r - 8, 0), r + 8, az - width / 2, az + width / 2);
            fprintf(out, "\"/>\n");
        }
    }
}

/* 1, 2 or 5 times a power of ten, so that three to six rings fit */
static double ring_step(double range_m)
{
    const double rough = range_m / 6, power = pow(10, floor(log10(rough))), x = rough / power;
    return power * (x <= 1 ? 1 : x <= 2 ? 2 : x <= 5 ? 5 : 10);
}

/* Degrees from one azimuth to another, 0 to 180. */
static double apart(double a_deg, double b_deg)
{
    return fabs(remainder(a_deg - b_deg, 360));
}

/* How many first echoes a label at that place would cover, or nearly. */
static size_t echoes_at(const struct polar *polar, int x, int y)
{
    size_t echoes = 0;
    for (size_t i = 0; i < polar->n_beams; i++) {
        const struct polar_beam *beam = &polar->beam[i];
        const double r = beam->echo_m / polar->range_m * DISC;
        echoes += r <= DISC && abs(tenth_x(r, beam->az_deg) - x) < LABEL_ACROSS &&
                  abs(tenth_y(r, beam->az_deg) - y) < LABEL_UP;
    }
    return echoes;
}

/* Where the ranges are written: the spoke on which they cover the fewest echoes, of equal ones the first from 60 on. */
static int quiet_spoke(const struct polar *polar, double step)
{
    size_t fewest = SIZE_MAX;
    int best = 60;
    for (int k = 0; k < 12; k++) {
        const int az = (60 + 30 * k) % 360;
        size_t echoes = 0;
        for (double r = step; r < polar->range_m * 0.96; r += step)
            echoes +=
                echoes_at(polar, tenth_x(r / polar->range_m * DISC, az), tenth_y(r / polar->range_m * DISC, az));
        if (echoes < fewest) {
            fewest = echoes;
            best = az;
        }
    }
    return best;
}

static void draw_rings(FILE *out, const struct polar *polar)
{
    const double step = ring_step(polar->range_m);
    const int spoke_deg = quiet_spoke(polar, step);
    fprintf(out, "<g fill=\"none\" stroke=\"#ffffff\" stroke-opacity=\"0.28\" stroke-width=\"7\">\n");
    for (double r = step; r < polar->range_m * 0.96; r += step)
        fprintf(out, "<circle r=\"%.0f\"/>\n", r / polar->range_m * DISC);
    for (int az = 0; az < 360; az += 30)
        fprintf(out, "<path d=\"M%d %dL%d %d\"/>\n", tenth_x(160, az), tenth_y(160, az), tenth_x(DISC, az),
                tenth_y(DISC, az));
    fprintf(out, "</g>\n<g class=\"range\">\n");
    for (double r = step; r < polar->range_m * 0.96; r += step) {
        const double tenths = r / polar->range_m * DISC;
        fprintf(out, "<text x=\"%d\" y=\"%d\">%g m</text>\n", tenth_x(tenths, spoke_deg),
                tenth_y(tenths, spoke_deg) + 45, r);
    }
    fprintf(out, "</g>\n<circle r=\"%d\" fill=\"none\" stroke=\"#8a94a6\" stroke-width=\"12\"/>\n", DISC);
}

/* The bearings around, and north in the place of one that it would lie on. */
static void draw_bearings(FILE *out, const double *heading_deg)
{
    fprintf(out, "<g class=\"bearing\">\n");
    for (int az = 0; az < 360; az += 30)
        if (!heading_deg || apart(az, -*heading_deg) > 8)
            fprintf(out, "<text x=\"%d\" y=\"%d\">%03d°</text>\n", tenth_x(LABELS + (az % 180 ? 60 : 0), az),
                    tenth_y(LABELS, az) + 50, az);
    fprintf(out, "</g>\n");
    if (!heading_deg)
        return;
    const double north = -*heading_deg;
    fprintf(out, "<path class=\"north\" d=\"M%d %dL%d %dL%d %dz\"/>\n", tenth_x(RING_IN, north),
            tenth_y(RING_IN, north), tenth_x(DISC - 60, north - 2), tenth_y(DISC - 60, north - 2),
            tenth_x(DISC - 60, north + 2), tenth_y(DISC - 60, north + 2));
    fprintf(out, "<text class=\"north\" x=\"%d\" y=\"%d\">N</text>\n", tenth_x(LABELS, north),
            tenth_y(LABELS, north) + 60);
}

static void draw_vehicle(FILE *out)
{
    fprintf(out,
            "<path d=\"M0 -110L70 90L0 50L-70 90z\" fill=\"#f4f6fa\" stroke=\"#10151f\" stroke-width=\"14\"/>\n");
}

static void draw_legend(FILE *out, const struct polar *polar)
{
    static const struct {
        const char *fill, *label;
    } rows[] = {{BLOCKED, "blocked"}, {CLEAR, "clear"}, {UNKNOWN, "unknown"}, {NOT_HEARD, "no samples"}};

    for (int i = 0; i < 4; i++)
        fprintf(out,
                "<g transform=\"translate(24 %d) scale(.1)\"><rect width=\"220\" height=\"130\" fill=\"%s\"/></g>"
                "<text x=\"54\" y=\"%d\">%s</text>\n",
                782 + 20 * i, rows[i].fill, 793 + 20 * i, rows[i].label);
    fprintf(out,
            "<path d=\"M24 886h22\" stroke=\"" NEAREST "\" stroke-width=\"1.8\"/><text x=\"54\" y=\"891\">nearest "
            "obstacle of a sector</text>\n"
            "<circle cx=\"35\" cy=\"868\" r=\"3.2\" fill=\"#ffffff\" stroke=\"#b3123f\" stroke-width=\"1.8\"/>"
            "<text x=\"54\" y=\"873\">first echo of a beam, grey if marked</text>\n");
    for (int i = 0; i <= POLAR_LEVELS; i++) {
        fprintf(out, "<rect x=\"%d\" y=\"848\" width=\"8\" height=\"13\" fill=\"", 712 + 8 * i);
        print_colour(out, (double)i / POLAR_LEVELS);
        fprintf(out, "\"/>");
    }
    fprintf(out,
            "\n<text x=\"712\" y=\"840\">echo intensity, counts</text><text x=\"712\" y=\"877\">0</text>"
            "<text x=\"880\" y=\"877\" text-anchor=\"end\">%s%d</text>\n",
            polar->white < 255 ? "≥ " : "", polar->white);
}

static void draw_title(FILE *out, const struct polar *polar, const json_t *image, const json_t *sectors,
                       const struct plot_conf *conf)
{
    double t_unix;
    char when[64] = "";
    struct tm tm;
    if (polar_number(sectors, "t_unix", 0, 1e11, &t_unix) || polar_number(image, "t_unix", 0, 1e11, &t_unix)) {
        const time_t t = (time_t)t_unix;
        if (gmtime_r(&t, &tm))
            strftime(when, sizeof when, "%Y-%m-%d %H:%M:%S UTC", &tm);
    }
    fprintf(out, "<text class=\"title\" x=\"24\" y=\"42\">");
    print_escaped(out, conf->title ? conf->title : "sonar ");
    if (!conf->title)
        print_escaped(out, polar_text(image, "sensor", ""));
    fprintf(out, "</text>\n<text x=\"24\" y=\"64\">%s</text>\n", when);
    fprintf(out,
            "<text x=\"876\" y=\"42\" text-anchor=\"end\">0° is forward, clockwise</text>\n"
            "<text x=\"876\" y=\"64\" text-anchor=\"end\">rim at %.4g m</text>\n",
            polar->range_m);
    if (conf->heading_deg)
        fprintf(out, "<text x=\"876\" y=\"86\" text-anchor=\"end\">heading %03.0f°, N is north</text>\n",
                fmod(round(*conf->heading_deg) + 360, 360));
}

static void draw_head(FILE *out)
{
    fprintf(out,
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 900 900\" width=\"900\" height=\"900\">\n"
            "<style>text{font-family:'DejaVu Sans',Helvetica,Arial,sans-serif;font-size:13px;fill:#1c2533}"
            ".title{font-size:20px;font-weight:bold}"
            ".bearing text{font-size:135px;text-anchor:middle;fill:#3b4658}"
            ".north{font-size:160px;font-weight:bold;text-anchor:middle;fill:#10151f}"
            ".range text{font-size:125px;text-anchor:middle;fill:#fff;stroke:#080c18;stroke-width:34px;"
            "stroke-linejoin:round;paint-order:stroke}</style>\n"
            "<defs><pattern id=\"unknown\" width=\"60\" height=\"60\" patternUnits=\"userSpaceOnUse\" "
            "patternTransform=\"rotate(45)\"><rect width=\"60\" height=\"60\" fill=\"#d5d9e0\"/>"
            "<rect width=\"24\" height=\"60\" fill=\"#9aa3b2\"/></pattern></defs>\n"
            "<rect width=\"900\" height=\"900\" fill=\"#ffffff\"/>\n");
}

bool plot_svg(FILE *out, json_t *image, json_t *sectors, const struct plot_conf *conf)
{
    struct polar polar;
    if (!polar_read(&polar, image, sectors, conf->range_m))
        return false;
    draw_head(out);
    draw_title(out, &polar, image, sectors, conf);
    fprintf(out, "<g transform=\"translate(%d %d) scale(.1)\">\n<circle r=\"%d\" fill=\"" NOT_HEARD "\"/>\n",
            CENTRE_X, CENTRE_Y, DISC);
    draw_intensities(out, &polar);
    draw_rings(out, &polar);
    draw_sectors(out, &polar, sectors);
    draw_echoes(out, &polar);
    draw_bearings(out, conf->heading_deg);
    draw_vehicle(out);
    fprintf(out, "</g>\n");
    draw_legend(out, &polar);
    fprintf(out, "</svg>\n");
    polar_free(&polar);
    return !ferror(out);
}
