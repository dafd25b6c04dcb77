/* SPDX-License-Identifier: MIT */
/* world - see world.h. */
#include "world.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/geometry.h"
#include "report/lib/dice.h"

const char *const pilot_place_name[PILOT_PLACES] = {"open", "harbour", "shaft", "basin", "dead end", "diver"};

/* ---- the truth ---- */

static double box_clearance(const double *p, const double place[3], const struct pilot_hull *hull)
{
    const double x = fmax(fmax(p[0] - place[0], place[0] - p[1]), 0),
                 y = fmax(fmax(p[2] - place[1], place[1] - p[3]), 0);
    const double level = hypot(x, y) - hull->radius_m;
    const double height = fmax(p[4] - place[2], place[2] - p[5]) - hull->half_height_m;
    if (level > 0 && height > 0)
        return hypot(level, height);
    return fmax(level, height);
}

static double solid_clearance(const struct pilot_solid *s, const double place[3], const struct pilot_hull *hull,
                              double t_s)
{
    const double *p = s->p;
    if (!s->upright)
        return box_clearance(p, place, hull);
    return hypot(place[0] - p[0] - p[3] * t_s, place[1] - p[1] - p[4] * t_s) - p[2] - hull->radius_m;
}

double pilot_world_clearance(const struct pilot_world *w, const double place_m[3], const struct pilot_hull *hull,
                             double t_s)
{
    double clear_m = INFINITY;
    for (int axis = 0; w->walled && axis < 3; axis++) {
        const double half_m = axis < 2 ? hull->radius_m : hull->half_height_m;
        clear_m = fmin(clear_m, place_m[axis] - w->room[2 * axis] - half_m);
        clear_m = fmin(clear_m, w->room[2 * axis + 1] - place_m[axis] - half_m);
    }
    for (int i = 0; i < w->solids; i++)
        clear_m = fmin(clear_m, solid_clearance(&w->solid[i], place_m, hull, t_s));
    return clear_m;
}

bool pilot_solid_swims(const struct pilot_solid *s)
{
    return s->upright && (s->p[3] != 0 || s->p[4] != 0);
}

void pilot_world_still(const struct pilot_world *w, struct pilot_world *out)
{
    memset(out, 0, sizeof *out);
    out->walled = w->walled;
    memcpy(out->room, w->room, sizeof out->room);
    memcpy(out->goal_m, w->goal_m, sizeof out->goal_m);
    for (int i = 0; i < w->solids; i++)
        if (!pilot_solid_swims(&w->solid[i]))
            out->solid[out->solids++] = w->solid[i];
}

/* ---- drawing ---- */

struct drawing {
    struct pilot_world *world;
    struct dice dice;
    struct pilot_hull hull;
    double free_m;
};

static double between(struct drawing *d, double lo, double hi)
{
    return lo + (hi - lo) * dice_uniform(&d->dice);
}

/* Not where the vehicle starts or wants to go. */
static void add(struct drawing *d, const struct pilot_solid *s)
{
    const double start[3] = {0}, goal[3] = {d->world->goal_m[0], d->world->goal_m[1], 0};
    if (d->world->solids < PILOT_SOLIDS_MAX && solid_clearance(s, start, &d->hull, 0) > d->free_m &&
        solid_clearance(s, goal, &d->hull, 0) > 0.8)
        d->world->solid[d->world->solids++] = *s;
}

static void add_box(struct drawing *d, const double p[6])
{
    struct pilot_solid s = {.upright = false};
    memcpy(s.p, p, sizeof s.p);
    add(d, &s);
}

static void add_piles(struct drawing *d, int n, double thin_m, double thick_m, double half_m)
{
    for (int i = 0; i < n; i++)
        add(d, &(struct pilot_solid){
                   .upright = true,
                   .p = {between(d, 1, 12), between(d, -half_m, half_m), between(d, thin_m, thick_m)}});
}

/* Across the way, and mostly above or below the level of a sonar. */
static void add_beam(struct drawing *d, double half_m)
{
    const double x = between(d, 0.8, 11), down = between(d, -1.4, 1.4), thick = between(d, 0.1, 0.3);
    add_box(d, (const double[]){x, x + thick, -half_m, between(d, -0.5, half_m), down, down + thick});
}

/* Across, along, or hanging from above with a free edge below. */
static void add_net(struct drawing *d, double half_m)
{
    const double x = between(d, 2, 11), y = between(d, -half_m, half_m - 1), low = between(d, -0.2, 6);
    if (dice_uniform(&d->dice) < 0.5)
        add_box(d, (const double[]){x, x + 0.05, y, y + between(d, 1, 3), -4, low});
    else
        add_box(d, (const double[]){x, x + between(d, 1, 3), y, y + 0.05, -4, low});
}

static void draw_open(struct drawing *d)
{
    add_piles(d, 3, 0.1, 0.4, 5);
}

static void draw_harbour(struct drawing *d)
{
    const double quay_m = between(d, 3.5, 6);
    add_box(d, (const double[]){-30, 40, quay_m, quay_m + 10, -10, 10});
    add_box(d, (const double[]){-30, 40, -30, 30, between(d, 2.2, 4), 10});
    add_piles(d, 8, 0.15, 0.4, 5);
    for (int i = 0; i < 3; i++)
        add_beam(d, 2.5);
    for (int i = 0; i < 2; i++)
        add_net(d, 4);
}

static void draw_walls(struct drawing *d, double half_m)
{
    const double room[6] = {-3, 15, -half_m, half_m, -between(d, 2, 4), between(d, 2, 4)};
    d->world->walled = true;
    memcpy(d->world->room, room, sizeof room);
}

static void draw_shaft(struct drawing *d)
{
    const double half_m = between(d, 2.2, 3.5);
    draw_walls(d, half_m);
    for (int i = 0; i < 4; i++) {
        const double x = between(d, 1, 12), out_m = between(d, 0.3, half_m - 0.8);
        if (i % 2)
            add_box(d, (const double[]){x, x + 0.5, half_m - out_m, half_m, -4, 4});
        else
            add_box(d, (const double[]){x, x + 0.5, -half_m, -half_m + out_m, -4, 4});
    }
    add_beam(d, half_m);
}

static void draw_basin(struct drawing *d)
{
    draw_walls(d, between(d, 4, 7));
    add_piles(d, 7, 0.05, 0.12, 5);
    for (int i = 0; i < 2; i++) {
        const double x = between(d, 2, 11), y = between(d, -4, 3);
        if (dice_uniform(&d->dice) < 0.5)
            add_box(d, (const double[]){x, x + 0.05, y, y + 3, -4, 4});
        else
            add_box(d, (const double[]){x, x + 3, y, y + 0.05, -4, 4});
    }
}

static void draw_dead_end(struct drawing *d)
{
    const double half_m = between(d, 1.5, 2.5), from_m = between(d, 2, 4), to_m = between(d, 6.5, 8.4);
    add_box(d, (const double[]){from_m, to_m, half_m, half_m + 0.3, -5, 5});
    add_box(d, (const double[]){from_m, to_m, -half_m - 0.3, -half_m, -5, 5});
    add_box(d, (const double[]){to_m, to_m + 0.3, -half_m - 0.3, half_m + 0.3, -5, 5});
    add_piles(d, 2, 0.1, 0.3, 6);
}

static void draw_diver(struct drawing *d)
{
    const double side = dice_uniform(&d->dice) < 0.5 ? -1 : 1;
    add_piles(d, 3, 0.1, 0.4, 5);
    add(d, &(struct pilot_solid){.upright = true,
                                 .p = {between(d, 3, 8), -side * between(d, 6, 14), 0.3, between(d, -0.05, 0.05),
                                       side * between(d, 0.15, 0.35)}});
}

/* What the sonars hear. */
static void make_scene(struct pilot_world *w)
{
    char text[4096];
    size_t used = 0;
    struct fault fault = {""};
    text[0] = '\0';
    if (w->walled)
        used += (size_t)snprintf(text, sizeof text, "box %.4f %.4f %.4f %.4f %.4f %.4f\n", w->room[0], w->room[1],
                                 w->room[2], w->room[3], w->room[4], w->room[5]);
    for (int i = 0; i < w->solids; i++) {
        const double *p = w->solid[i].p;
        if (w->solid[i].upright)
            used += (size_t)snprintf(text + used, sizeof text - used, "pile %.4f %.4f %.4f %.4f %.4f\n", p[0],
                                     p[1], p[2], p[3], p[4]);
        else
            used += (size_t)snprintf(text + used, sizeof text - used, "box %.4f %.4f %.4f %.4f %.4f %.4f\n", p[0],
                                     p[1], p[2], p[3], p[4], p[5]);
    }
    if (!scene_parse(&w->scene, "pilot", text, &fault)) {
        fprintf(stderr, "%s\n%s", fault.text, text);
        abort();
    }
}

void pilot_world_draw(struct pilot_world *w, enum pilot_place place, uint64_t seed, const struct pilot_hull *hull,
                      double free_m)
{
    static void (*const draw[PILOT_PLACES])(struct drawing *) = {
        [PILOT_OPEN] = draw_open,   [PILOT_HARBOUR] = draw_harbour,   [PILOT_SHAFT] = draw_shaft,
        [PILOT_BASIN] = draw_basin, [PILOT_DEAD_END] = draw_dead_end, [PILOT_DIVER] = draw_diver};
    struct drawing d = {.world = w, .dice = dice_of(seed, place), .hull = *hull, .free_m = free_m};
    memset(w, 0, sizeof *w);
    w->goal_m[0] = between(&d, 10, 13);
    w->goal_m[1] = between(&d, -1, 1);
    draw[place](&d);
    make_scene(w);
}

/* ---- the way of somebody with a chart ---- */

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

static void place_of(int node, double place[3])
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

static void read_chart(struct chart *c, const struct pilot_world *w, const struct pilot_hull *hull, double off_m)
{
    struct pilot_world still;
    pilot_world_still(w, &still);
    for (int i = 0; i < NODES; i++) {
        double place[3];
        place_of(i, place);
        c->open[i] = pilot_world_clearance(&still, place, hull, 0) > off_m;
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

int pilot_world_route(const struct pilot_world *w, const struct pilot_hull *hull, double off_m,
                      double route_m[PILOT_ROUTE_MAX][2])
{
    static struct chart chart; /* too large for a stack */
    struct chart *c = &chart;
    const double start_m[2] = {0, 0};
    const int goal = node_at(w->goal_m), start = node_at(start_m);
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
        place_of(at, place);
        memcpy(route_m[n++], place, sizeof route_m[0]);
    }
    return n;
}
