/* SPDX-License-Identifier: MIT */
#include "top_ring.h"

#include <math.h>
#include <string.h>

#define SECTORS_MAX    720
#define RAD_PER_DEG    (3.14159265358979323846 / 180.0)
#define LETTERS_DEG    0.5 /* between looks for letters: finer than a cell of the largest ring */
#define WALL_HALF_DOTS 0.8

enum severity { NOTHING, CLEAR, UNKNOWN, BLOCKED };

struct ring {
    int n;
    struct {
        enum severity severity;
        double range_m, free_to_m;
        double wall_m; /* the nearest obstacle, beyond the distance too; INFINITY: none */
    } sector[SECTORS_MAX];
};

static enum severity severity_of(const char *state)
{
    if (state && strcmp(state, "blocked") == 0)
        return BLOCKED;
    return state && strcmp(state, "clear") == 0 ? CLEAR : UNKNOWN;
}

static void read_ring(struct ring *ring, const json_t *result)
{
    const json_t *list = json_object_get(result, "sectors");
    ring->n = (int)(json_array_size(list) <= SECTORS_MAX ? json_array_size(list) : 0);
    for (int i = 0; i < ring->n; i++) {
        const json_t *sector = json_array_get(list, (size_t)i);
        ring->sector[i].severity = severity_of(json_string_value(json_object_get(sector, "state")));
        ring->sector[i].range_m = json_number_value(json_object_get(sector, "range_m"));
        ring->sector[i].wall_m = ring->sector[i].range_m > 0 ? ring->sector[i].range_m : INFINITY;
        ring->sector[i].free_to_m = json_number_value(json_object_get(sector, "free_to_m"));
    }
}

/* The sector k is centred on k times their width. */
static int sector_at(const struct ring *ring, double azimuth_deg)
{
    const int k = (int)floor(azimuth_deg / 360.0 * ring->n + 0.5);
    return ((k % ring->n) + ring->n) % ring->n;
}

#define DIGIT_MOST_M 10.0

/* A blocked sector says at how many whole metres; + beyond 9. */
static const char *mark_of(const struct ring *ring, enum severity severity, double range_m)
{
    static const char *const digit[] = {"0", "1", "2", "3", "4", "5", "6", "7", "8", "9"};
    if (severity != BLOCKED || ring->n == 0)
        return severity == CLEAR ? "c" : "?";
    return range_m >= 0 && range_m < DIGIT_MOST_M ? digit[(int)range_m] : "+";
}

/* The severest of the sectors that a cell of the edge covers, and of those the nearest. */
static void draw_letters(struct canvas *canvas, const struct ring *ring, int column, int row, int rows)
{
    static const enum canvas_colour colour[] = {
        [CLEAR] = CANVAS_GREEN, [UNKNOWN] = CANVAS_YELLOW, [BLOCKED] = CANVAS_RED};
    unsigned char put[CANVAS_ROWS_MAX][CANVAS_COLUMNS_MAX];
    double nearest_m[CANVAS_ROWS_MAX][CANVAS_COLUMNS_MAX];
    const double radius = (rows - 1) / 2.0;
    memset(put, 0, sizeof put);
    for (double az = 0; az < 360; az += LETTERS_DEG) {
        const int k = ring->n ? sector_at(ring, az) : 0;
        const enum severity severity = ring->n ? ring->sector[k].severity : UNKNOWN;
        const double range_m = ring->n ? ring->sector[k].range_m : 0;
        const int x = column + (int)lround(2 * radius * (1 + sin(az * RAD_PER_DEG)));
        const int y = row + (int)lround(radius * (1 - cos(az * RAD_PER_DEG)));
        if (y < 0 || y >= canvas->rows || x < 0 || x >= canvas->columns || put[y][x] > severity ||
            (put[y][x] == severity && nearest_m[y][x] <= range_m))
            continue;
        put[y][x] = (unsigned char)severity;
        nearest_m[y][x] = range_m;
        canvas_text(canvas, x, y, 1, colour[severity], mark_of(ring, severity, range_m));
    }
}

static void draw_plan(struct canvas *canvas, const struct ring *ring, double range_m, int column, int row,
                      int rows)
{
    const int radius = (rows - 3) * CANVAS_DOTS_Y / 2; /* within the letters */
    const int cx = column * CANVAS_DOTS_X + (rows - 1) * CANVAS_DOTS_X + 1;
    const int cy = row * CANVAS_DOTS_Y + rows * CANVAS_DOTS_Y / 2;
    const double m_per_dot = range_m / radius;
    for (int y = -radius; y <= radius; y++) {
        for (int x = -radius; x <= radius; x++) {
            const double r_dots = hypot(x, y);
            const int k = sector_at(ring, atan2(x, -y) / RAD_PER_DEG);
            const double wall_m = ring->sector[k].wall_m;
            if (r_dots > radius)
                continue;
            if (fabs(r_dots - wall_m / m_per_dot) <= WALL_HALF_DOTS)
                canvas_dot(canvas, cx + x, cy + y, CANVAS_RED);
            else if (r_dots * m_per_dot < fmin(ring->sector[k].free_to_m, wall_m) && (x & 1) == 0 &&
                     ((x + y) & 3) == 0)
                canvas_dot(canvas, cx + x, cy + y, CANVAS_GREEN);
        }
    }
}

void top_ring_draw(struct canvas *canvas, const json_t *sectors, double range_m, int column, int row, int rows)
{
    struct ring ring;
    const int middle = column + rows - 1;
    read_ring(&ring, sectors);
    draw_letters(canvas, &ring, column, row, rows);
    if (ring.n > 0 && range_m > 0 && rows > 4)
        draw_plan(canvas, &ring, range_m, column, row, rows);
    canvas_text(canvas, middle, row + rows / 2, 1, CANVAS_PLAIN, "^");
}
