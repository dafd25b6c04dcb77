/* SPDX-License-Identifier: MIT */
/*
 * report_stability - the catalogue of stiff and extreme inputs against the product's modules, a naive method beside.
 *
 *   report_stability [quick]   CSV: case, about, input, naive_method, naive, naive_is, measure, bound, measured,
 *                              verdict
 *
 * Ends with status 1 when a case exceeds its bound, or when one of the catalogue has no row.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report/lib/stable.h"

/* What must be there: letter, and how many cases. */
static const struct {
    char letter;
    int n;
} catalogue[] = {{'C', 12}, {'I', 11}, {'G', 22}, {'V', 12}, {'Q', 6}, {'P', 6}, {'E', 3}, {'L', 4}};

static const struct {
    const char *about;
    const struct stable_case *cases;
} lists[] = {
    {"detectors", stable_cfar},  {"images", stable_image},       {"cells", stable_cells},
    {"evidence", stable_grid},   {"shapes", stable_shapes},      {"voxel map", stable_voxel},
    {"questions", stable_asked}, {"poses, clocks", stable_time}, {"all together", stable_whole},
};
#define LISTS (sizeof lists / sizeof lists[0])

static bool has_row(const char *id)
{
    for (size_t l = 0; l < LISTS; l++)
        for (const struct stable_case *c = lists[l].cases; c->id; c++)
            if (strcmp(c->id, id) == 0)
                return true;
    return false;
}

static int missing(void)
{
    int n = 0;
    for (size_t k = 0; k < sizeof catalogue / sizeof catalogue[0]; k++)
        for (int i = 1; i <= catalogue[k].n; i++) {
            char id[16];
            snprintf(id, sizeof id, "%c%d", catalogue[k].letter, i);
            if (has_row(id))
                continue;
            fprintf(stderr, "case %s of the catalogue has no row\n", id);
            n++;
        }
    return n;
}

static const char *words(double value, char text[32])
{
    if (isnan(value))
        return "no number";
    if (isinf(value))
        return "no end";
    snprintf(text, 32, "%.3g", value);
    return text;
}

int main(int argc, char **argv)
{
    const bool quick = argc > 1 && strcmp(argv[1], "quick") == 0;
    int failed = missing();
    char text[3][32];
    printf("case,about,input,naive_method,naive,naive_is,measure,bound,measured,verdict\n");
    for (size_t l = 0; l < LISTS; l++)
        for (const struct stable_case *c = lists[l].cases; c->id; c++) {
            struct stable_found found = {.naive = NAN, .ours = NAN};
            c->run(quick, &found);
            const bool holds = found.ours <= c->bound;
            printf("%s,\"%s\",\"%s\",\"%s\",%s,%s,\"%s\",%s,%s,%s\n", c->id, lists[l].about, c->input,
                   c->naive_method, words(found.naive, text[0]), found.derived ? "derived" : "run", c->measure,
                   words(c->bound, text[1]), words(found.ours, text[2]), holds ? "pass" : "FAIL");
            fflush(stdout);
            if (!holds)
                fprintf(stderr, "case %s: %s: %s, bound %g\n", c->id, c->measure, words(found.ours, text[2]),
                        c->bound);
            failed += !holds;
        }
    return failed > 0;
}
