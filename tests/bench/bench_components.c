/* SPDX-License-Identifier: MIT */
/*
 * bench_components - connected components of the spherical grid: nanoseconds for each cell put into an empty structure,
 * for each cell of a turn that replaces a hundredth of them and settles, and milliseconds for one recomputation from
 * nothing. Cells are wavy sheets, one behind the other, over a full sphere of 1 degree. Median of rounds.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "grid/geometry.h"
#include "grid/sphere/components.h"
#include "bench.h"

#define ROUNDS       5
#define SHEET_LAYERS 8 /* from one sheet to the next */

static struct rings rings;
static struct components components;

/* Layer of cell i: waves that neighbours follow. */
static uint16_t layer_of(uint32_t i)
{
    double az, el;
    rings_centre(&rings, i % rings.n, &az, &el);
    return (uint16_t)(i / rings.n * SHEET_LAYERS + 3 + lround(2 * sin(5 * el) * cos(el)));
}

static double fill(void *memory, uint32_t cells)
{
    components_init(&components, memory, &rings, cells);
    const double start = cpu_ns();
    for (uint32_t i = 0; i < cells; i++)
        components_put(&components, i % rings.n, layer_of(i), true, 0);
    return (cpu_ns() - start) / cells;
}

/* A hundredth of the cells goes, is settled, and comes again. */
static double one_turn(uint32_t cells)
{
    const uint32_t changed = cells / 100;
    const double start = cpu_ns();
    for (uint32_t i = 0; i < changed; i++)
        components_remove(&components, i * 97 % cells % rings.n, layer_of(i * 97 % cells));
    components_settle(&components, 0);
    for (uint32_t i = 0; i < changed; i++)
        components_put(&components, i * 97 % cells % rings.n, layer_of(i * 97 % cells), true, 0);
    return (cpu_ns() - start) / changed;
}

/* The most cells may be given. */
int main(int argc, char **argv)
{
    const unsigned long most = argc > 1 ? strtoul(argv[1], NULL, 10) : 1000000;
    rings_full(&rings, geo_rad(1));
    printf("%9s %12s %16s %14s %12s %10s\n", "cells", "put ns/cell", "turn ns/change", "fill ms", "components",
           "bytes/cell");
    for (uint32_t cells = 1000; cells <= most; cells *= 10) {
        double put_ns[ROUNDS], turn_ns[ROUNDS];
        uint32_t n = 0;
        void *memory = malloc(components_bytes(cells));
        if (!memory)
            return 1;
        for (int r = 0; r < ROUNDS; r++) {
            put_ns[r] = fill(memory, cells);
            turn_ns[r] = one_turn(cells);
        }
        COMPONENTS_EACH(&components, root)
        n++;
        const double put = median(put_ns, ROUNDS);
        printf("%9u %12.0f %16.0f %14.2f %12u %10.0f\n", cells, put, median(turn_ns, ROUNDS), put * cells * 1e-6,
               n, (double)components_bytes(cells) / cells);
        free(memory);
    }
    return 0;
}
