/* SPDX-License-Identifier: MIT */
/* route - see route.h. */
#include "route.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define STEP_M 0.2
#define COLS   120 /* to the north */
#define ROWS   90
#define NODES  (COLS * ROWS)

static const double corner_m[2] = {-6, -9}; /* of the chart */

struct chart {
    bool open[NODES], done[NODES];
    double cost[NODES];
    int from[NODES];
};

static void node_place(int node, double place[3])
{
    place[0] = corner_m[0] + node % COLS * STEP_M;
    place[1] = corner_m[1] + node / COLS * STEP_M;
    place[2] = 0;
}

static int node_at(const double place[2])
{
    const int col = (int)((place[0] - corner_m[0]) / STEP_M + 0.5),
              row = (int)((place[1] - corner_m[1]) / STEP_M + 0.5);
    return row * COLS + col;
}

static int nearest_undone(const struct chart *c)
{
    int best = -1;
    for (int i = 0; i < NODES; i++)
        if (!c->done[i] && c->cost[i] < INFINITY && (best < 0 || c->cost[i] < c->cost[best]))
            best = i;
    return best;
}

static void relax(struct chart *c, int node)
{
    for (int dy = -1; dy <= 1; dy++)
        for (int dx = -1; dx <= 1; dx++) {
            const int x = node % COLS + dx, y = node / COLS + dy, next = y * COLS + x;
            const double cost = c->cost[node] + hypot(dx, dy);
            if (x < 0 || x >= COLS || y < 0 || y >= ROWS || !c->open[next] || cost >= c->cost[next])
                continue;
            c->cost[next] = cost;
            c->from[next] = node;
        }
}

static void read_chart(struct chart *c, const struct place *w, const struct place_hull *hull, double off_m)
{
    const struct place still = place_still(w);
    for (int i = 0; i < NODES; i++) {
        double place[3];
        node_place(i, place);
        c->open[i] = place_clearance(&still, place, hull, 0) > off_m;
        c->done[i] = false;
        c->cost[i] = INFINITY;
    }
}

static bool sees(const struct chart *c, int a, int b)
{
    const int steps = 2 * (abs(a % COLS - b % COLS) + abs(a / COLS - b / COLS)) + 1;
    for (int i = 0; i <= steps; i++) {
        const double s = (double)i / steps;
        const int x = (int)(a % COLS + s * (b % COLS - a % COLS) + 0.5),
                  y = (int)(a / COLS + s * (b / COLS - a / COLS) + 0.5);
        if (!c->open[y * COLS + x])
            return false;
    }
    return true;
}

int pilot_route(const struct place *w, const struct place_hull *hull, double off_m,
                double route_m[PILOT_ROUTE_MAX][2])
{
    static struct chart chart; /* too large for a stack */
    struct chart *c = &chart;
    const double start_m[2] = {0, 0};
    const int goal = node_at(w->to), start = node_at(start_m);
    int n = 0, at = start;
    read_chart(c, w, hull, off_m);
    c->open[start] = true;
    c->cost[goal] = 0; /* from the goal, so that the way comes out in its order */
    for (int node = goal; c->open[goal] && node >= 0 && node != start; node = nearest_undone(c)) {
        c->done[node] = true;
        relax(c, node);
    }
    if (!(c->cost[start] < INFINITY))
        return 0;
    while (at != goal && n < PILOT_ROUTE_MAX) { /* a string pulled tight */
        int next = c->from[at];
        for (int k = next; k != goal; next = sees(c, at, k) ? k : next)
            k = c->from[k];
        double place[3];
        at = next;
        node_place(at, place);
        memcpy(route_m[n++], place, sizeof route_m[0]);
    }
    return n;
}
