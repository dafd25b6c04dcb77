/* SPDX-License-Identifier: MIT */
/*
 * test_dbscan - clusters against a reference table (index distances, with and without the seam), against a
 * brute-force DBSCAN written out here for metric distances, and the pictures that break clustering.
 */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include "grid/range/dbscan.h"

#define MAX_CELLS (64 * 64)

static uint8_t point[MAX_CELLS];
static int32_t label[MAX_CELLS], want[MAX_CELLS];
static int16_t reach[64 * 129];
static uint32_t work[MAX_CELLS * 4];

static uint32_t run(uint32_t rows, uint32_t cols, bool wrap, uint32_t span, uint32_t min_points)
{
    const struct dbscan d = {
        .rows = rows, .cols = cols, .wrap = wrap, .span = span, .reach = reach, .min_points = min_points};
    CHECK(dbscan_work_size(rows, cols) <= sizeof work);
    return dbscan_run(&d, point, work, label);
}

/* The table of reaches for (ky*dy)^2 + (kx*dx)^2 <= eps2 in steps of rows and columns. */
static void reach_steps(uint32_t ky, uint32_t kx, uint32_t eps2, uint32_t rows, uint32_t cols, uint32_t span)
{
    const uint32_t width = 2 * span + 1;
    for (uint32_t dx = 0; dx <= span && dx < cols; dx++) {
        int16_t dy = -1;
        while (dy + 1 < (int)rows && ky * ky * (uint32_t)((dy + 1) * (dy + 1)) + kx * dx * kx * dx <= eps2)
            dy++;
        for (uint32_t col = 0; col + dx < cols; col++) {
            reach[col * width + span + dx] = dy;
            reach[(col + dx) * width + span - dx] = dy;
        }
    }
}

/* ---- the table ---- */

static void read_row(const struct table *t, uint32_t row, uint32_t cols)
{
    char *rest = t->field[11];
    for (uint32_t c = 0; c < cols; c++) {
        point[row * cols + c] = t->field[9][c] == '1';
        want[row * cols + c] = (int32_t)strtol(rest, &rest, 10);
    }
}

TEST(equals_table)
{
    struct table t = table_open("tests/oracles/dbscan.csv");
    int cases = 0;
    while (table_next(&t)) {
        const uint32_t rows = (uint32_t)table_int(&t, 1), cols = (uint32_t)table_int(&t, 2);
        const uint32_t ky = (uint32_t)table_int(&t, 3), kx = (uint32_t)table_int(&t, 4);
        const uint32_t eps2 = (uint32_t)table_int(&t, 5), min_points = (uint32_t)table_int(&t, 6);
        const bool wrap = table_int(&t, 7);
        read_row(&t, 0, cols);
        for (uint32_t row = 1; row < rows && table_next(&t); row++)
            read_row(&t, row, cols);
        uint32_t span = 0;
        while (kx * kx * (span + 1) * (span + 1) <= eps2)
            span++;
        reach_steps(ky, kx, eps2, rows, cols, span);
        run(rows, cols, wrap, span, min_points);
        if (memcmp(label, want, rows * cols * sizeof *label) != 0) {
            printf("case %d differs\n", cases);
            CHECK(false);
        }
        cases++;
    }
    CHECK(cases >= 10);
}

/* ---- brute force ---- */

struct metric {
    double eps, row_rad, r0, dr;
};

static bool near(const struct metric *m, uint32_t rows, uint32_t cols, bool wrap, uint32_t a, uint32_t b)
{
    uint32_t dy = a / cols > b / cols ? a / cols - b / cols : b / cols - a / cols;
    if (wrap && dy > rows - dy)
        dy = rows - dy;
    const double r1 = m->r0 + (a % cols + 0.5) * m->dr, r2 = m->r0 + (b % cols + 0.5) * m->dr;
    const double angle = fmin(dy * m->row_rad, 3.14159265358979323846), s = sin(angle / 2);
    return (r1 - r2) * (r1 - r2) + 4 * r1 * r2 * s * s <= m->eps * m->eps;
}

static void flood(const struct metric *m, uint32_t rows, uint32_t cols, bool wrap, const uint8_t *core,
                  uint32_t from, int32_t number)
{
    static uint32_t stack[MAX_CELLS];
    uint32_t n = 0;
    want[from] = number;
    stack[n++] = from;
    while (n) {
        const uint32_t a = stack[--n];
        for (uint32_t b = 0; b < rows * cols; b++) {
            if (core[b] && want[b] == DBSCAN_NOISE && near(m, rows, cols, wrap, a, b)) {
                want[b] = number;
                stack[n++] = b;
            }
        }
    }
}

static void brute(const struct metric *m, uint32_t rows, uint32_t cols, bool wrap, uint32_t min_points)
{
    static uint8_t core[MAX_CELLS];
    const uint32_t cells = rows * cols;
    int32_t number = 0;
    for (uint32_t a = 0; a < cells; a++) {
        uint32_t n = 0;
        for (uint32_t b = 0; b < cells && point[a]; b++)
            n += point[b] && near(m, rows, cols, wrap, a, b);
        core[a] = point[a] && n >= min_points;
        want[a] = point[a] ? DBSCAN_NOISE : DBSCAN_NO_POINT;
    }
    for (uint32_t a = 0; a < cells; a++)
        if (core[a] && want[a] == DBSCAN_NOISE)
            flood(m, rows, cols, wrap, core, a, number++);
    for (uint32_t a = 0; a < cells; a++) {
        if (!point[a] || core[a])
            continue;
        for (uint32_t b = 0; b < cells; b++)
            if (core[b] && near(m, rows, cols, wrap, a, b) && (want[a] < 0 || want[b] < want[a]))
                want[a] = want[b];
    }
}

TEST(metric_equals_brute_force)
{
    uint64_t seed = test_seed();
    for (int trial = 0; trial < 400; trial++) {
        const uint32_t rows = 1 + (uint32_t)(test_uniform(&seed) * 30),
                       cols = 1 + (uint32_t)(test_uniform(&seed) * 24);
        const bool wrap = test_uniform(&seed) < 0.5;
        const double turn = 6.283185307179586;
        const struct metric m = {.eps = 0.02 + 0.5 * test_uniform(&seed),
                                 .row_rad = wrap ? turn / rows : 0.05 + 0.1 * test_uniform(&seed),
                                 .r0 = test_uniform(&seed) < 0.3 ? 0 : test_uniform(&seed),
                                 .dr = 0.03 + 0.1 * test_uniform(&seed)};
        const double density = test_uniform(&seed);
        const uint32_t min_points = 1 + (uint32_t)(test_uniform(&seed) * 8), span = (uint32_t)(m.eps / m.dr) + 1;
        for (uint32_t i = 0; i < rows * cols; i++)
            point[i] = test_uniform(&seed) < density;
        dbscan_reach_metric(m.eps, &(struct dbscan_polar){m.row_rad, m.r0, m.dr, rows, cols}, span, reach);
        run(rows, cols, wrap, span, min_points);
        brute(&m, rows, cols, wrap, min_points);
        if (memcmp(label, want, rows * cols * sizeof *label) != 0) {
            printf("trial %d: %u x %u, wrap %d, min_points %u\n", trial, rows, cols, wrap, min_points);
            CHECK(false);
            return;
        }
    }
}

TEST(reach_is_symmetric)
{
    const uint32_t cols = 40, span = 12;
    dbscan_reach_metric(0.31, &(struct dbscan_polar){0.05, 0.0, 0.027, 50, cols}, span, reach);
    for (uint32_t c = 0; c < cols; c++)
        for (uint32_t dx = 0; dx <= span && c + dx < cols; dx++)
            CHECK_INT(reach[c * (2 * span + 1) + span + dx], reach[(c + dx) * (2 * span + 1) + span - dx]);
}

/* ---- pictures that break clustering ---- */

/* I11: all ones, none, a single point, min_pts 1 */
TEST(extreme_pictures)
{
    reach_steps(1, 1, 2, 8, 8, 1);
    memset(point, 1, 64);
    CHECK_INT(run(8, 8, true, 1, 9), 1);
    CHECK_INT(label[0], DBSCAN_NOISE + 1); /* a border in the corner still belongs */
    memset(point, 0, 64);
    CHECK_INT(run(8, 8, true, 1, 1), 0);
    CHECK_INT(label[63], DBSCAN_NO_POINT);
    point[27] = 1;
    CHECK_INT(run(8, 8, true, 1, 2), 0);
    CHECK_INT(label[27], DBSCAN_NOISE);
    CHECK_INT(run(8, 8, true, 1, 1), 1);
    CHECK_INT(label[27], 0);
}

/* I11 */
TEST(seam_joins_only_with_wrap)
{
    reach_steps(1, 1, 1, 8, 8, 1);
    memset(point, 0, 64);
    point[3] = point[7 * 8 + 3] = 1;
    CHECK_INT(run(8, 8, true, 1, 2), 1);
    CHECK_INT(run(8, 8, false, 1, 2), 0);
}

/* I11 */
TEST(border_takes_the_lower_of_two_clusters)
{
    /* columns 0..2 and 4..6 dense, 3 between them with one neighbour on either side only */
    static const char *const rows[] = {"1100011", "1101011", "1100011"};
    reach_steps(1, 1, 4, 3, 7, 2);
    for (int y = 0; y < 3; y++)
        for (int x = 0; x < 7; x++)
            point[y * 7 + x] = rows[y][x] == '1';
    CHECK_INT(run(3, 7, false, 2, 6), 2);
    CHECK_INT(label[7 + 3], 0);
    CHECK_INT(label[7 + 5], 1);
}

int main(void)
{
    RUN(equals_table);
    RUN(metric_equals_brute_force);
    RUN(reach_is_symmetric);
    RUN(extreme_pictures);
    RUN(seam_joins_only_with_wrap);
    RUN(border_takes_the_lower_of_two_clusters);
    return test_end();
}
