/* SPDX-License-Identifier: MIT */
/*
 * bench_paper_layout - the sphere's pool of cells beside the paper's own structure, given the same echoes: nanoseconds
 * to find or make the cell of an echo and to count it there, to visit a cell in a sweep over all, and bytes per cell.
 * Directions of 2 degrees (paper: by theta and phi of a uniform grid, 16 200). Median of rounds.
 */
#include <stdio.h>
#include <time.h>

#include "grid/sphere/cells.h"
#include "tests/water/dice.h"
#include "paper_layout.h"

#define THETAS     180u
#define PHIS       90u
#define DIRECTIONS (THETAS * PHIS)
#define ROUNDS     5

static double clock_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *v)
{
    qsort(v, ROUNDS, sizeof *v, ascending);
    return v[ROUNDS / 2];
}

/* The next echo of a scene that fills up to n cells: any direction, layers that fill alike. */
static void next_echo(struct dice *dice, uint32_t n, uint32_t *direction, uint16_t *layer)
{
    const uint64_t r = dice_bits(dice);
    *direction = (uint32_t)(r % DIRECTIONS);
    *layer = (uint16_t)((r >> 32) % (n / DIRECTIONS + 1));
}

static uint64_t seen; /* so that no visit is left out */

static void pool_round(struct cells *cells, uint32_t n, uint64_t seed, double *echo_ns, double *visit_ns)
{
    struct dice dice = dice_of(seed, 0);
    uint32_t direction, evicted;
    uint16_t layer;
    double began = clock_ns();
    for (uint32_t i = 0; i < n; i++) {
        next_echo(&dice, n, &direction, &layer);
        cells->cell[cells_take(cells, direction, layer, &evicted)].echoes++;
    }
    *echo_ns = (clock_ns() - began) / n;
    began = clock_ns();
    CELLS_EACH (cells, i)
        seen += cells->cell[i].echoes;
    *visit_ns = (clock_ns() - began) / cells->used;
}

static void paper_round(struct paper_grid *paper, uint32_t n, uint64_t seed, double *echo_ns, double *visit_ns)
{
    struct dice dice = dice_of(seed, 0);
    uint32_t direction;
    uint16_t layer;
    double began = clock_ns();
    for (uint32_t i = 0; i < n; i++) {
        next_echo(&dice, n, &direction, &layer);
        paper_take(paper, direction / PHIS, direction % PHIS, layer)->echoes++;
    }
    *echo_ns = (clock_ns() - began) / n;
    began = clock_ns();
    for (struct paper_cell *c = paper->head; c; c = c->after)
        seen += c->echoes;
    *visit_ns = (clock_ns() - began) / paper->cells;
}

static void measure(uint32_t n)
{
    const uint32_t room = n / DIRECTIONS * DIRECTIONS + DIRECTIONS; /* for all that can come: nothing makes room */
    double echo[ROUNDS], paper_echo[ROUNDS], visit[ROUNDS], paper_visit[ROUNDS];
    const size_t bytes = cells_bytes(room, DIRECTIONS);
    void *memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    struct paper_grid paper = paper_grid(THETAS, PHIS);
    struct cells cells;
    if (!memory)
        exit(1);
    cells_init(&cells, memory, room, DIRECTIONS);
    for (int round = 0; round < ROUNDS; round++) {
        pool_round(&cells, n, (uint64_t)round, &echo[round], &visit[round]);
        paper_round(&paper, n, (uint64_t)round, &paper_echo[round], &paper_visit[round]);
    }
    printf("%9u %10.1f %10.1f %10.2f %10.2f %10.0f %10.0f\n", cells.used, median(echo), median(paper_echo),
           median(visit), median(paper_visit), (double)bytes / cells.used, (double)paper.bytes / paper.cells);
    if (cells.used != paper.cells)
        printf("the two differ: %u and %u cells\n", cells.used, paper.cells);
    paper_free(&paper);
    free(memory);
}

/* The most cells may be given. */
int main(int argc, char **argv)
{
    const unsigned long most = argc > 1 ? strtoul(argv[1], NULL, 10) : 1000000;
    printf("%9s %10s %10s %10s %10s %10s %10s\n", "cells", "echo ns", "paper's", "visit ns", "paper's",
           "bytes/cell", "paper's");
    for (uint32_t n = 1000; n <= most; n *= 10)
        measure(n);
    return seen == 0;
}
