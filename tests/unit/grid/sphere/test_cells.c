/* SPDX-License-Identifier: MIT */
/*
 * test_cells - the pool's invariants after any sequence of taking, releasing, losing and moving, full or not.
 */
#include "tests/lib/test.h"

#include "grid/sphere/cells.h"
#include "tests/bench/paper_layout.h"

#define ROOM       300
#define DIRECTIONS 40
#define LAYERS     30

static struct cells cells;
static void *memory;

static void start(void)
{
    free(memory);
    size_t n = (cells_bytes(ROOM, DIRECTIONS) + 63) / 64 * 64;
    memory = aligned_alloc(64, n);
    memset(memory, 0xa5, n);
    cells_init(&cells, memory, ROOM, DIRECTIONS);
}

static uint32_t length(uint32_t i, enum cell_state from, enum cell_state to)
{
    uint32_t n = 0;
    for (; i != CELLS_NONE && n <= ROOM; i = cells.cell[i].next, n++)
        CHECK(cells.cell[i].state >= from && cells.cell[i].state <= to);
    return n;
}

/* Every cell in one list, directions in order of range, none in the wrong place. */
static void check_all(void)
{
    uint32_t live = 0;
    for (uint32_t d = 0; d < DIRECTIONS; d++) {
        int before = -1;
        live += length(cells.first[d], CELL_LIVE, CELL_LOCKED);
        for (uint32_t i = cells.first[d]; i != CELLS_NONE; i = cells.cell[i].next) {
            CHECK(cells.cell[i].layer > before && cells.cell[i].direction == d);
            before = cells.cell[i].layer;
        }
    }
    uint32_t visited = 0, held = 0;
    CELLS_EACH (&cells, i) {
        CHECK(cells.cell[i].state >= CELL_LIVE);
        visited++;
    }
    CELLS_DIRECTIONS(&cells, d)
    {
        CHECK(cells.first[d] != CELLS_NONE);
        held += length(cells.first[d], CELL_LIVE, CELL_LOCKED);
    }
    CHECK_INT(held, cells.used);
    CHECK_INT(live, cells.used);
    CHECK_INT(visited, cells.used);
    CHECK_INT(live + length(cells.free, CELL_FREE, CELL_FREE) + length(cells.gone, CELL_GONE, CELL_GONE), ROOM);
}

TEST(any_sequence_leaves_every_cell_in_one_list)
{
    uint64_t seed = test_seed();
    for (int crowd = 0; crowd < 2; crowd++) { /* seldom full; always full */
        start();
        uint64_t evictions = 0;
        for (int i = 0; i < 100000; i++) {
            uint32_t evicted, d = (uint32_t)(test_random(&seed) % DIRECTIONS), at = cells.first[d];
            uint16_t layer = (uint16_t)(test_random(&seed) % LAYERS);
            switch (test_random(&seed) % (crowd ? 12 : 4)) {
            case 0:
                if (at != CELLS_NONE)
                    cells_release(&cells, at);
                break;
            case 1:
                if (at != CELLS_NONE) {
                    cells.cell[at].sensor = test_random(&seed) % 3 & 3u;
                    cells_lose(&cells, at);
                }
                break;
            case 2:
                cells_forget_gone(&cells, (uint32_t)(test_random(&seed) % 3));
                break;
            default:
                at = cells_take(&cells, d, layer, &evicted);
                CHECK(at != CELLS_NONE && cells.cell[at].direction == d && cells.cell[at].layer == layer);
                cells.cell[at].t_ref_ns = (uint64_t)i;
                evictions += evicted != RINGS_NONE;
            }
            if (i % 100 == 0)
                check_all();
        }
        check_all();
        CHECK(crowd ? evictions > 100 : cells.used > 10);
    }
}

TEST(a_cell_is_found_again_and_comes_without_evidence_after_release)
{
    uint32_t evicted;
    start();
    uint32_t a = cells_take(&cells, 3, 7, &evicted);
    cells.cell[a].echoes = 9;
    CHECK_INT(cells_take(&cells, 3, 7, &evicted), a);
    cells_release(&cells, a);
    CHECK_INT(cells.cell[cells_take(&cells, 3, 7, &evicted)].echoes, 0);
}

TEST(locked_cells_make_no_room)
{
    uint32_t evicted;
    start();
    for (uint32_t i = 0; i < ROOM; i++)
        cells.cell[cells_take(&cells, i % DIRECTIONS, (uint16_t)(i / DIRECTIONS), &evicted)].state = CELL_LOCKED;
    for (int k = 0; k < 20; k++)
        CHECK_INT(cells_take(&cells, 0, 20, &evicted), CELLS_NONE);
    CHECK_INT(evicted, RINGS_NONE);
    check_all();
    cells.cell[cells.first[5]].state = CELL_LIVE;
    uint32_t tries = 1;
    while (cells_take(&cells, 0, 20, &evicted) == CELLS_NONE && tries < 10)
        tries++;
    CHECK_INT(evicted, 5);
    check_all();
}

/* The paper's own structure, with pointers, is the reference: the same cells in the same order after any sequence. */
TEST(any_sequence_leaves_what_the_papers_structure_holds)
{
    uint64_t seed = test_seed();
    start();
    struct paper_grid paper = paper_grid(1, cells.directions);
    for (int step = 0; step < 20000; step++) {
        uint32_t evicted, d = (uint32_t)(test_random(&seed) % cells.directions);
        uint16_t layer = (uint16_t)(test_random(&seed) % 9);
        if (test_uniform(&seed) < 0.5 && cells.used + 1 < cells.room) {
            cells.cell[cells_take(&cells, d, layer, &evicted)].echoes++;
            paper_take(&paper, 0, d, layer)->echoes++;
        } else if (cells.first[d] != CELLS_NONE) {
            cells_release(&cells, cells.first[d]);
            paper_release(&paper, paper.theta[0].first[d]);
        }
        CHECK_INT(cells.used, paper.cells);
        uint32_t i = cells.first[d];
        struct paper_cell *c = paper.theta[0].first ? paper.theta[0].first[d] : NULL;
        for (; i != CELLS_NONE && c; i = cells.cell[i].next, c = c->farther) {
            CHECK_INT(cells.cell[i].layer, c->layer);
            CHECK_INT(cells.cell[i].echoes, c->echoes);
        }
        CHECK(i == CELLS_NONE && !c);
    }
    paper_free(&paper);
}

int main(void)
{
    RUN(any_sequence_leaves_what_the_papers_structure_holds);
    RUN(any_sequence_leaves_every_cell_in_one_list);
    RUN(a_cell_is_found_again_and_comes_without_evidence_after_release);
    RUN(locked_cells_make_no_room);
    free(memory);
    return test_end();
}
