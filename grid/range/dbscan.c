/* SPDX-License-Identifier: MIT */
/* dbscan - see dbscan.h. The picture is worked on by columns: neighbours in a column are a stretch of rows. */
#include "dbscan.h"

#include <math.h>
#include <string.h>

#define SLACK 1e-9 /* of equal squares that rounding has parted: far below any cell */

/* Working memory; [cols][rows + 1], and [rows][cols] for parent. */
struct field {
    const struct dbscan *conf;
    uint32_t *parent; /* of cores, by raster index: union-find whose roots are the lowest index */
    uint16_t *before; /* points of the column in rows below this one */
    uint16_t *next;   /* the first core of the column from this row on; rows: none */
    uint16_t *chain;  /* at a core: the last core that is reached from it by steps within the column */
};

/* A stretch of rows, both ends included. */
struct stretch {
    uint32_t lo, hi;
};

size_t dbscan_work_size(uint32_t rows, uint32_t cols)
{
    size_t cells = (size_t)rows * cols, columns = (size_t)(rows + 1) * cols;
    return cells * sizeof(uint32_t) + 3 * columns * sizeof(uint16_t);
}

static size_t at(const struct field *f, uint32_t col, uint32_t row)
{
    return (size_t)col * (f->conf->rows + 1) + row;
}

static int reach_of(const struct field *f, uint32_t col, int dx)
{
    const int span = (int)f->conf->span;
    return f->conf->reach[(size_t)col * (2 * f->conf->span + 1) + (size_t)(span + dx)];
}

/* The rows within `reach` of one: one stretch, or two across the seam. */
static int stretches(const struct field *f, uint32_t row, uint32_t reach, struct stretch out[2])
{
    const uint32_t rows = f->conf->rows;
    if (f->conf->wrap && 2 * reach + 1 >= rows) {
        out[0] = (struct stretch){0, rows - 1};
        return 1;
    }
    uint32_t lo = row >= reach ? row - reach : 0, hi = row + reach < rows ? row + reach : rows - 1;
    out[0] = (struct stretch){lo, hi};
    if (f->conf->wrap && row < reach)
        out[1] = (struct stretch){rows + row - reach, rows - 1};
    else if (f->conf->wrap && row + reach >= rows)
        out[1] = (struct stretch){0, row + reach - rows};
    else
        return 1;
    return 2;
}

/* ---- reaches ---- */

static void set_both(int16_t *reach, uint32_t span, uint32_t col, uint32_t dx, int16_t value)
{
    const size_t width = 2 * (size_t)span + 1;
    reach[col * width + span + dx] = value;
    reach[(col + dx) * width + span - dx] = value;
}

/* The most rows whose sin^2(angle/2) is at most s2; up to half a turn, where it is the greatest. */
static int rows_within(double s2, double row_rad, uint32_t rows)
{
    if (s2 < -SLACK)
        return -1;
    if (!(row_rad > 0) || s2 >= 1)
        return (int)rows - 1;
    double n = floor(2 * asin(sqrt(fmax(s2, 0))) / row_rad + SLACK);
    return n < rows - 1 ? (int)n : (int)rows - 1;
}

void dbscan_reach_metric(double eps_m, const struct dbscan_polar *picture, uint32_t span, int16_t *reach)
{
    const double r0_m = picture->r0_m, dr_m = picture->dr_m;
    const uint32_t cols = picture->cols;
    for (uint32_t col = 0; col < cols; col++) {
        const double r1 = fmax(r0_m + (col + 0.5) * dr_m, 1e-6);
        for (uint32_t dx = 0; dx <= span && col + dx < cols; dx++) {
            const double r2 = fmax(r0_m + (col + dx + 0.5) * dr_m, 1e-6);
            const double s2 = (eps_m * eps_m - (r1 - r2) * (r1 - r2)) / (4 * r1 * r2);
            set_both(reach, span, col, dx, (int16_t)rows_within(s2, picture->row_rad, picture->rows));
        }
    }
}

/* ---- cores ---- */

static void count_points(struct field *f, const uint8_t *point)
{
    const uint32_t rows = f->conf->rows, cols = f->conf->cols;
    for (uint32_t col = 0; col < cols; col++) {
        uint16_t n = 0;
        for (uint32_t row = 0; row < rows; row++) {
            f->before[at(f, col, row)] = n;
            n = (uint16_t)(n + (point[(size_t)row * cols + col] != 0));
        }
        f->before[at(f, col, rows)] = n;
    }
}

static bool is_core(const struct field *f, uint32_t row, uint32_t col)
{
    const int span = (int)f->conf->span;
    uint32_t n = 0;
    for (int dx = -span; dx <= span; dx++) {
        const int64_t other = (int64_t)col + dx;
        if (other < 0 || other >= f->conf->cols)
            continue;
        const int reach = reach_of(f, col, dx);
        struct stretch part[2];
        const int parts = reach < 0 ? 0 : stretches(f, row, (uint32_t)reach, part);
        for (int i = 0; i < parts; i++)
            n += (uint32_t)(f->before[at(f, (uint32_t)other, part[i].hi + 1)] -
                            f->before[at(f, (uint32_t)other, part[i].lo)]);
        if (n >= f->conf->min_points)
            return true;
    }
    return false;
}

/* Marks the cores in `next` and links each with the last that steps within the column lead to. */
static void find_cores(struct field *f, const uint8_t *point)
{
    const uint32_t rows = f->conf->rows, cols = f->conf->cols;
    for (uint32_t col = 0; col < cols; col++) {
        const int step = reach_of(f, col, 0);
        uint32_t next = rows;
        f->next[at(f, col, rows)] = (uint16_t)rows;
        for (uint32_t row = rows; row-- > 0;) {
            if (point[(size_t)row * cols + col] && is_core(f, row, col)) {
                const bool joined = next < rows && (int)(next - row) <= step;
                f->chain[at(f, col, row)] = joined ? f->chain[at(f, col, next)] : (uint16_t)row;
                f->parent[(size_t)row * cols + col] = (uint32_t)((size_t)row * cols + col);
                next = row;
            }
            f->next[at(f, col, row)] = (uint16_t)next;
        }
    }
}

/* ---- clusters ---- */

static uint32_t root_of(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

static void join_clusters(uint32_t *parent, uint32_t a, uint32_t b)
{
    a = root_of(parent, a);
    b = root_of(parent, b);
    if (a < b)
        parent[b] = a;
    else
        parent[a] = b;
}

/* Joins a core with the cores of a stretch of a column: one of each chain is enough, the chain joins itself. */
static void join_stretch(struct field *f, uint32_t core, uint32_t col, struct stretch part)
{
    for (uint32_t row = f->next[at(f, col, part.lo)]; row <= part.hi;
         row = f->next[at(f, col, f->chain[at(f, col, row)] + 1u)])
        join_clusters(f->parent, core, row * f->conf->cols + col);
}

static void join_core(struct field *f, uint32_t row, uint32_t col)
{
    const uint32_t cols = f->conf->cols, core = row * cols + col;
    for (uint32_t dx = 0; dx <= f->conf->span && col + dx < cols; dx++) {
        const int reach = reach_of(f, col, (int)dx);
        struct stretch part[2];
        const int parts = reach < 0 ? 0 : stretches(f, row, (uint32_t)reach, part);
        for (int i = 0; i < parts; i++)
            join_stretch(f, core, col + dx, part[i]);
    }
}

/* Cores of a column are joined with the one below them, so that a chain is one cluster. */
static void join_all(struct field *f)
{
    const uint32_t rows = f->conf->rows, cols = f->conf->cols;
    for (uint32_t col = 0; col < cols; col++) {
        uint32_t row = f->next[at(f, col, 0)];
        while (row < rows) {
            const uint32_t next = f->next[at(f, col, row + 1)];
            if (next <= f->chain[at(f, col, row)])
                join_clusters(f->parent, row * cols + col, next * cols + col);
            row = next;
        }
    }
    for (uint32_t col = 0; col < cols; col++)
        for (uint32_t row = f->next[at(f, col, 0)]; row < rows; row = f->next[at(f, col, row + 1)])
            join_core(f, row, col);
}

static bool marked(const struct field *f, uint32_t row, uint32_t col)
{
    return f->next[at(f, col, row)] == row;
}

/* The lowest number among the cores around a point; all cores of a chain have the same. */
static int32_t border_label(const struct field *f, uint32_t row, uint32_t col, const int32_t *label)
{
    const int span = (int)f->conf->span;
    int32_t lowest = DBSCAN_NOISE;
    for (int dx = -span; dx <= span; dx++) {
        const int64_t other = (int64_t)col + dx;
        if (other < 0 || other >= f->conf->cols)
            continue;
        const int reach = reach_of(f, col, dx);
        struct stretch part[2];
        const int parts = reach < 0 ? 0 : stretches(f, row, (uint32_t)reach, part);
        for (int i = 0; i < parts; i++) {
            const uint32_t c = (uint32_t)other;
            for (uint32_t r = f->next[at(f, c, part[i].lo)]; r <= part[i].hi;
                 r = f->next[at(f, c, f->chain[at(f, c, r)] + 1u)]) {
                const int32_t found = label[(size_t)r * f->conf->cols + c];
                lowest = lowest < 0 || found < lowest ? found : lowest;
            }
        }
    }
    return lowest;
}

static uint32_t number_clusters(struct field *f, const uint8_t *point, int32_t *label)
{
    const uint32_t rows = f->conf->rows, cols = f->conf->cols;
    int32_t n = 0;
    for (uint32_t row = 0; row < rows; row++) {
        for (uint32_t col = 0; col < cols; col++) {
            const uint32_t i = row * cols + col;
            label[i] = point[i] ? DBSCAN_NOISE : DBSCAN_NO_POINT;
            if (!marked(f, row, col))
                continue;
            const uint32_t root = root_of(f->parent, i);
            label[i] = root == i ? n++ : label[root];
        }
    }
    for (uint32_t row = 0; row < rows; row++)
        for (uint32_t col = 0; col < cols; col++)
            if (point[(size_t)row * cols + col] && !marked(f, row, col))
                label[(size_t)row * cols + col] = border_label(f, row, col, label);
    return (uint32_t)n;
}

uint32_t dbscan_run(const struct dbscan *dbscan, const uint8_t *point, void *work, int32_t *label)
{
    const size_t columns = (size_t)(dbscan->rows + 1) * dbscan->cols;
    struct field f = {.conf = dbscan, .parent = work};
    f.before = (uint16_t *)(f.parent + (size_t)dbscan->rows * dbscan->cols);
    f.next = f.before + columns;
    f.chain = f.next + columns;
    count_points(&f, point);
    find_cores(&f, point);
    join_all(&f);
    return number_clusters(&f, point, label);
}
