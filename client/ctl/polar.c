/* SPDX-License-Identifier: MIT */
#include "polar.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BEAMS_MAX 4096
#define RUNS_MAX  30000 /* more, and the picture is made coarser along the range */

bool polar_number(const json_t *object, const char *key, double lo, double hi, double *out)
{
    const json_t *value = json_object_get(object, key);
    const double v = json_number_value(value);
    if (!json_is_number(value) || !(v >= lo && v <= hi))
        return false;
    *out = v;
    return true;
}

const char *polar_text(const json_t *object, const char *key, const char *absent)
{
    const char *s = json_string_value(json_object_get(object, key));
    return s ? s : absent;
}

static int by_azimuth(const void *a, const void *b)
{
    const double x = ((const struct polar_beam *)a)->az_deg, y = ((const struct polar_beam *)b)->az_deg;
    return (x > y) - (x < y);
}

static bool read_beam(const json_t *row, struct polar_beam *beam)
{
    beam->width_deg = 1.0;
    beam->echo_m = NAN;
    if (!polar_number(row, "azimuth_deg", -360, 360, &beam->az_deg))
        return false;
    beam->az_deg -= 360.0 * floor(beam->az_deg / 360.0);
    polar_number(row, "width_deg", 0.01, 180, &beam->width_deg);
    polar_number(row, "echo_m", 0, POLAR_RANGE_MAX_M, &beam->echo_m);
    const json_t *first = json_array_get(json_object_get(row, "echoes"), 0);
    beam->echo_marked = json_array_size(json_object_get(first, "marks")) > 0;
    beam->samples = polar_text(row, "samples", "");
    beam->n_samples = strlen(beam->samples) / 2;
    if (!polar_number(row, "r0_m", 0, POLAR_RANGE_MAX_M, &beam->r0_m) ||
        !polar_number(row, "r1_m", 0, POLAR_RANGE_MAX_M, &beam->r1_m) || beam->r1_m <= beam->r0_m)
        beam->n_samples = 0;
    return true;
}

/* A beam is drawn as wide as it is, but not beyond the middle to its neighbours. */
static void set_edges(struct polar_beam *beam, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const double before = i ? beam[i - 1].az_deg : beam[n - 1].az_deg - 360.0;
        const double after = i + 1 < n ? beam[i + 1].az_deg : beam[0].az_deg + 360.0;
        beam[i].lo_deg = beam[i].az_deg - fmin(beam[i].width_deg, beam[i].az_deg - before) / 2;
        beam[i].hi_deg = beam[i].az_deg + fmin(beam[i].width_deg, after - beam[i].az_deg) / 2;
    }
}

static bool read_beams(struct polar *polar, const json_t *image)
{
    const json_t *rows = json_object_get(image, "rows");
    size_t n = json_array_size(rows) < BEAMS_MAX ? json_array_size(rows) : BEAMS_MAX;
    polar->beam = calloc(n + 1, sizeof *polar->beam);
    if (!polar->beam)
        return false;
    for (size_t i = 0; i < n; i++)
        if (read_beam(json_array_get(rows, i), &polar->beam[polar->n_beams]))
            polar->n_beams++;
    qsort(polar->beam, polar->n_beams, sizeof *polar->beam, by_azimuth);
    set_edges(polar->beam, polar->n_beams);
    return true;
}

static void find_range(struct polar *polar, const json_t *sectors, double range_m)
{
    const json_t *list = json_object_get(sectors, "sectors");
    double heard_m = 0, free_m = 0, r = 0;
    for (size_t i = 0; i < polar->n_beams; i++)
        if (polar->beam[i].n_samples > 0)
            heard_m = fmax(heard_m, polar->beam[i].r1_m);
    for (size_t i = 0; i < json_array_size(list); i++)
        if (polar_number(json_array_get(list, i), "free_to_m", 0, POLAR_RANGE_MAX_M, &r))
            free_m = fmax(free_m, r);
    polar->range_m = range_m > 0 ? range_m : heard_m > 0 ? heard_m : free_m > 0 ? 1.1 * free_m : 10.0;
    polar->range_m = fmax(polar->range_m, 0.01);
}

static int hex_digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : 0;
}

/* The samples on the disc's radial cells; a cell holds its loudest. */
static void resample(struct polar *polar, struct polar_beam *beam)
{
    const double cell_m = polar->range_m / POLAR_CELLS;
    const double bin_m = (beam->r1_m - beam->r0_m) / (double)beam->n_samples;
    for (int c = 0; c < POLAR_CELLS; c++) {
        const double from = (c * cell_m - beam->r0_m) / bin_m, to = ((c + 1) * cell_m - beam->r0_m) / bin_m;
        if (!(to > 0 && from < (double)beam->n_samples))
            continue;

        size_t i = from > 0 ? (size_t)from : 0;

        do {
            const int v = hex_digit(beam->samples[2 * i]) * 16 + hex_digit(beam->samples[2 * i + 1]);
            if (v > beam->cell[c])
                beam->cell[c] = (uint8_t)v;
        } while (++i < beam->n_samples && (double)i < to);
    }
}

/* The brightest colour stands for what only one cell in 250 passes: a few loud ones must not darken the rest. */
static void find_white(struct polar *polar)
{
    size_t count[256] = {0}, loud = 0;
    const size_t limit = polar->n_beams * POLAR_CELLS / 250;
    for (size_t i = 0; i < polar->n_beams; i++)
        for (int c = 0; c < POLAR_CELLS; c++)
            count[polar->beam[i].cell[c]]++;
    for (polar->white = 255; polar->white > 16; polar->white--) {
        loud += count[polar->white];
        if (loud > limit)
            break;
    }
}

int polar_run_end(const struct polar_beam *beam, int c)
{
    const int start = c;
    while (c < POLAR_CELLS && beam->cell[c] == beam->cell[start])
        c++;
    return c;
}

static size_t count_runs(const struct polar *polar)
{
    size_t n = 0;
    for (size_t i = 0; i < polar->n_beams; i++)
        for (int c = 0; c < POLAR_CELLS; c = polar_run_end(&polar->beam[i], c))
            n += polar->beam[i].cell[c] > 0;
    return n;
}

/* Groups of `group` cells get the loudest of their levels. */
static void coarsen(struct polar *polar, int group)
{
    for (size_t i = 0; i < polar->n_beams; i++) {
        for (int c = 0; c < POLAR_CELLS; c += group) {
            uint8_t *cell = &polar->beam[i].cell[c], most = 0;
            for (int k = 0; k < group; k++)
                most = cell[k] > most ? cell[k] : most;
            memset(cell, most, (size_t)group);
        }
    }
}

static void make_levels(struct polar *polar)
{
    for (size_t i = 0; i < polar->n_beams; i++)
        if (polar->beam[i].n_samples > 0)
            resample(polar, &polar->beam[i]);
    find_white(polar);
    for (size_t i = 0; i < polar->n_beams; i++) {
        for (int c = 0; c < POLAR_CELLS; c++) {
            const int level = (polar->beam[i].cell[c] * POLAR_LEVELS + polar->white / 2) / polar->white;
            polar->beam[i].cell[c] = (uint8_t)(level < POLAR_LEVELS ? level : POLAR_LEVELS);
        }
    }
    for (int group = 2; group <= 16 && count_runs(polar) > RUNS_MAX; group *= 2)
        coarsen(polar, group);
}

bool polar_read(struct polar *polar, const json_t *image, const json_t *sectors, double range_m)
{
    *polar = (struct polar){0};
    if (!read_beams(polar, image))
        return false;
    find_range(polar, sectors, range_m);
    make_levels(polar);
    return true;
}

void polar_free(struct polar *polar)
{
    free(polar->beam);
}
