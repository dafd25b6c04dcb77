/* SPDX-License-Identifier: MIT */
/*
 * report_paper - the experiments of Auran and Silven 1996 on made-up scenes of lines and arcs: figure 6, a path through
 * a geometric model with a 2.5 degree sonar; figure 8, a vessel that lies still in a harbour with a 6.5 degree cone.
 * Rays are traced in the level plane (the scene's cross-section is the same at all depths), one per beam, with the
 * noise of eq. (1): normal in range and in angle.
 *
 *   report_paper cells SCENE        CSV: class (of log-odds), z, x and y of the four corners of an occupied cell
 *   report_paper echoes SCENE       CSV: x, y of all echoes as they were entered
 *   report_paper path SCENE         CSV: x, y, number of the places scanned from
 *   report_paper model SCENE        CSV: piece, x, y of the true surfaces
 *   report_paper surfaces       CSV: scene, seed, true_m, shown_m, shown_share, false_m, false_share, cells, clusters
 *
 * x is east, y north, z upward, metres.
 */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../grid/ping.h"
#include "../../grid/sphere/clusters.h"
#include "lib/dice.h"

#define SEEDS            5
#define MAX_CELLS        65536
#define ECHOES           8192
#define POINTS           100000
#define PIECE_RAD        0.05   /* arcs are drawn and graded in pieces */
#define HALF_POWER_TO_SD 2.3548 /* a normal distribution's width at half power */

/* A line from a to b; or an arc around a with the radius b[0], from b[1] to b[2] in degrees counted from x to y. */
struct edge {
    enum { END, LINE, ARC } kind;
    double a[2], b[3];
};

struct scene {
    const char *name;
    double opening_deg, range_m, layer_m;
    double range_error;     /* deviation as a share of range */
    unsigned places, tilts; /* scanned from; elevations of each scan, an opening apart */
    double from[2], to[2];
    double swing_m; /* of the path, in depth */
    double yaw_deg; /* the vessel turns by so much in the middle of a scan, unnoticed */
    struct edge edge[16];
};

static const struct scene scenes[] = {
    {.name = "model",
     .opening_deg = 2.5,
     .range_m = 260,
     .layer_m = 2,
     .range_error = 0.003,
     .places = 10,
     .tilts = 1,
     .from = {20, 40},
     .to = {480, 330},
     .swing_m = 30,
     .edge = {{LINE, {-60, -60}, {600, -60}},
              {LINE, {600, -60}, {600, 260}},
              {ARC, {480, 260}, {120, 0, 90}},
              {LINE, {480, 380}, {60, 520}},
              {LINE, {60, 520}, {-60, 300}},
              {LINE, {-60, 300}, {-60, -60}},
              {LINE, {180, 20}, {300, 20}},
              {LINE, {300, 20}, {340, 110}},
              {LINE, {340, 110}, {220, 110}},
              {LINE, {220, 110}, {180, 20}},
              {ARC, {150, 300}, {50, 0, 360}}}},
    {.name = "harbour",
     .opening_deg = 6.5,
     .range_m = 25,
     .layer_m = 0.25,
     .range_error = 0.01,
     .places = 1,
     .tilts = 3,
     .yaw_deg = 5,
     .edge = {{LINE, {-6, -20}, {-6, 9}},
              {LINE, {-6, 9}, {-2, 13}},
              {LINE, {-2, 13}, {7, 13}},
              {LINE, {7, 13}, {7, -4}},
              {LINE, {7, -4}, {16, -4}},
              {ARC, {2, -15}, {1.5, 0, 360}}}},
};
#define SCENES (sizeof scenes / sizeof scenes[0])

static double echo_at[ECHOES][2];
static unsigned echoes_n;

/* ---- the truth ---- */

/* Nearest crossing of the ray from p along unit vector u with the edge; INFINITY: none. */
static double crossing(const struct edge *e, const double p[2], const double u[2])
{
    const double ax = e->a[0] - p[0], ay = e->a[1] - p[1];
    if (e->kind == LINE) {
        const double dx = e->b[0] - e->a[0], dy = e->b[1] - e->a[1], cross = u[0] * dy - u[1] * dx;
        const double r = (ax * dy - ay * dx) / cross, s = (ax * u[1] - ay * u[0]) / cross;
        return cross != 0 && r > 0 && s >= 0 && s <= 1 ? r : INFINITY;
    }
    const double along = ax * u[0] + ay * u[1], under = along * along - ax * ax - ay * ay + e->b[0] * e->b[0];
    for (int side = -1; under >= 0 && side <= 1; side += 2) {
        const double r = along + side * sqrt(under);
        const double angle = geo_wrap(atan2(p[1] + r * u[1] - e->a[1], p[0] + r * u[0] - e->a[0]));
        if (r > 0 && angle >= geo_rad(e->b[1]) && angle <= geo_rad(e->b[2]))
            return r;
    }
    return INFINITY;
}

static double trace(const struct scene *s, const double p[2], double angle)
{
    const double u[2] = {cos(angle), sin(angle)};
    double r = INFINITY;
    for (const struct edge *e = s->edge; e->kind != END; e++)
        r = fmin(r, crossing(e, p, u));
    return r;
}

static double edge_length(const struct edge *e)
{
    return e->kind == LINE ? hypot(e->b[0] - e->a[0], e->b[1] - e->a[1]) : e->b[0] * geo_rad(e->b[2] - e->b[1]);
}

/* The point at a share t of the edge. */
static void edge_point(const struct edge *e, double t, double out[2])
{
    const double angle = geo_rad(e->b[1] + t * (e->b[2] - e->b[1]));
    for (int i = 0; i < 2; i++)
        out[i] = e->kind == LINE ? e->a[i] + t * (e->b[i] - e->a[i])
                                 : e->a[i] + e->b[0] * (i ? sin(angle) : cos(angle));
}

static void place_of(const struct scene *s, unsigned k, double out[2])
{
    const double t = s->places > 1 ? (double)k / (s->places - 1) : 0;
    for (int i = 0; i < 2; i++)
        out[i] = s->from[i] + t * (s->to[i] - s->from[i]);
}

/* ---- sound ---- */

static double normal(struct dice *dice)
{
    return creal(dice_normal(dice)) * sqrt(2);
}

/* One scan all around: north is y, the grid's first axis. */
static void scan(struct sphere *grid, const struct scene *s, unsigned k, struct dice *dice)
{
    const unsigned beams = (unsigned)ceil(360 / s->opening_deg);
    const double opening = geo_rad(s->opening_deg);
    static uint64_t t_ns;
    static uint32_t seq;
    double at[2];
    place_of(s, k, at);
    const double depth_m = s->swing_m * (sin(1.3 * k) + 0.2 * normal(dice));
    for (unsigned i = 0; i < beams * s->tilts; i++) {
        const double az = (i % beams) * opening, tilt = -(double)(i / beams) * opening;
        const double yaw = i % beams > beams / 2 ? geo_rad(s->yaw_deg) : 0;
        const double heard_az = az + yaw + opening / HALF_POWER_TO_SD * normal(dice) / 2;
        double r = trace(s, at, GEO_PI / 2 - heard_az) / cos(tilt);
        const double sd_m = fmax(s->layer_m / 4, s->range_error * r);
        r += sd_m * normal(dice);
        const bool heard = r < s->range_m;
        struct beam_echoes beam = {.az_rad = (float)az,
                                   .el_rad = (float)tilt,
                                   .blind_m = (float)s->layer_m,
                                   .free_to_m = (float)(heard ? r - 2 * sd_m : s->range_m),
                                   .state = heard ? BEAM_ECHO : BEAM_SILENT,
                                   .n = heard};
        beam.echo[0] = (struct echo){
            .range_m = (float)r, .near_m = (float)(r - 2 * sd_m), .sd_m = (float)sd_m, .confidence = 0.9f};
        struct echoes ping = {.t_ns = t_ns += 100000000,
                              .seq = ++seq,
                              .n_beams = 1,
                              .flags = i == 0 ? PING_NEW_TURN : 0,
                              .range_max_m = (float)s->range_m,
                              .az_aperture_rad = (float)opening,
                              .el_aperture_rad = (float)opening,
                              .pose = pose_identity,
                              .beam = &beam};
        ping.pose.has = POSE_ATTITUDE | POSE_POSITION;
        ping.pose.position_m[0] = at[1];
        ping.pose.position_m[1] = at[0];
        ping.pose.position_m[2] = depth_m;
        if (heard && echoes_n < ECHOES) {
            echo_at[echoes_n][0] = at[0] + r * cos(tilt) * sin(az);
            echo_at[echoes_n++][1] = at[1] + r * cos(tilt) * cos(az);
        }
        sphere_enter(grid, &ping, &mount_identity);
    }
}

struct run {
    const struct scene *scene;
    struct sphere *grid;
    void *memory;
    struct rings rings;
    struct picture_frame frame;
};

static struct run run_of(const struct scene *s, unsigned seed)
{
    const struct sphere_conf conf = {.angular_step_rad = geo_rad(s->opening_deg),
                                     .layers = {.r_max_m = 4 * s->range_m,
                                                .dr_m = s->layer_m,
                                                .n_const = 25,
                                                .growth = 1 + geo_rad(s->opening_deg)},
                                     .max_cells = MAX_CELLS,
                                     .forget_s = 1e6,
                                     .blocked_above = 0.6,
                                     .recentre_m = s->layer_m,
                                     .model = SPHERE_GAUSS,
                                     .range_error = s->range_error};
    struct run run = {.scene = s};
    struct dice dice = dice_of(seed, 0);
    char err[200];
    const size_t bytes = sphere_bytes(&conf, err, sizeof err);
    run.memory = bytes ? aligned_alloc(64, (bytes + 63) / 64 * 64) : NULL;
    if (!run.memory) {
        fprintf(stderr, "report_paper: no grid: %s\n", err);
        exit(1);
    }
    run.grid = sphere_init(run.memory, &conf);
    rings_full(&run.rings, conf.angular_step_rad);
    echoes_n = 0;
    for (unsigned k = 0; k < s->places; k++)
        scan(run.grid, s, k, &dice);
    picture_get_frame(sphere_picture(run.grid), &run.frame);
    return run;
}

/* ---- what the grid shows ---- */

struct shown {
    double at[2];   /* of its echo */
    double size_m;  /* half the diagonal of the cell, in the level plane */
    double width_m; /* across the direction */
};

/* Calls use for every occupied cell; returns how many. */
static unsigned each_cell(const struct run *run,
                          void (*use)(const struct run *, uint32_t, const struct sphere_cell *, void *),
                          void *data)
{
    unsigned n = 0;
    struct sphere_cell cell;
    for (uint32_t d = 0; d < run->rings.n; d++)
        for (uint32_t k = 0; sphere_cell(run->grid, d, k, run->frame.t_ping_ns, &cell); k++)
            if (cell.logodds > log(0.6 / 0.4)) {
                use(run, d, &cell, data);
                n++;
            }
    return n;
}

static void draw(const struct run *run, uint32_t d, const struct sphere_cell *c, void *unused)
{
    double az, el;
    const double half = rings_width(&run->rings, rings_ring(&run->rings, d)) / 2, *o = run->frame.centre_m;
    (void)unused;
    rings_centre(&run->rings, d, &az, &el);
    printf("%d,%.3f", c->logodds > 3 ? 3 : c->logodds > 1.5 ? 2 : 1, c->to_m * sin(el) - o[2]);
    for (int corner = 0; corner < 4; corner++) {
        const double r = corner == 1 || corner == 2 ? c->to_m : c->from_m, a = az + (corner >= 2 ? half : -half);
        printf(",%.3f,%.3f", o[1] + r * cos(el) * sin(a), o[0] + r * cos(el) * cos(a));
    }
    printf("\n");
}

static void collect(const struct run *run, uint32_t d, const struct sphere_cell *c, void *data)
{
    struct shown **to = data;
    double az, el;
    rings_centre(&run->rings, d, &az, &el);
    const double width = rings_width(&run->rings, rings_ring(&run->rings, d)) * cos(el);
    *(*to)++ = (struct shown){
        .at = {run->frame.centre_m[1] + c->point_m[1], run->frame.centre_m[0] + c->point_m[0]},
        .width_m = c->to_m * width,
        .size_m = hypot(c->to_m - c->from_m, c->to_m * width) / 2 + 2 * c->ball_m,
    };
}

/* Could any of the scans hear this point of a surface? */
static bool was_heard(const struct scene *s, const double at[2])
{
    for (unsigned k = 0; k < s->places; k++) {
        double from[2];
        place_of(s, k, from);
        const double dx = at[0] - from[0], dy = at[1] - from[1], r = hypot(dx, dy);
        if (r < s->range_m && trace(s, from, atan2(dy, dx)) > r - 1e-3 * s->range_m)
            return true;
    }
    return false;
}

static bool near_a_cell(const struct shown *cell, unsigned n, const double at[2])
{
    for (unsigned i = 0; i < n; i++)
        if (hypot(cell[i].at[0] - at[0], cell[i].at[1] - at[1]) <= cell[i].size_m)
            return true;
    return false;
}

static bool near_a_surface(const struct scene *s, const struct shown *cell)
{
    for (const struct edge *e = s->edge; e->kind != END; e++) {
        const unsigned n = (unsigned)ceil(edge_length(e) / s->layer_m);
        for (unsigned i = 0; i <= n; i++) {
            double at[2];
            edge_point(e, (double)i / n, at);
            if (hypot(cell->at[0] - at[0], cell->at[1] - at[1]) <= cell->size_m + s->layer_m)
                return true;
        }
    }
    return false;
}

/* Lengths of surfaces: true and heard, shown of these, and shown where there is none. */
static void grade(const struct scene *s, unsigned seed)
{
    static struct shown cell[POINTS];
    struct shown *end = cell;
    struct run run = run_of(s, seed);
    const unsigned n = each_cell(&run, collect, &end);
    double true_m = 0, shown_m = 0, false_m = 0, all_m = 0;
    for (const struct edge *e = s->edge; e->kind != END; e++) {
        const unsigned pieces = (unsigned)ceil(edge_length(e) / s->layer_m);
        for (unsigned i = 0; i < pieces; i++) {
            double at[2];
            edge_point(e, (i + 0.5) / pieces, at);
            if (!was_heard(s, at))
                continue;
            true_m += edge_length(e) / pieces;
            shown_m += near_a_cell(cell, n, at) ? edge_length(e) / pieces : 0;
        }
    }
    for (unsigned i = 0; i < n; i++) {
        all_m += cell[i].width_m;
        false_m += near_a_surface(s, &cell[i]) ? 0 : cell[i].width_m;
    }
    const struct cluster *list;
    uint32_t clusters;
    void *memory = aligned_alloc(64, (clusters_bytes(&run.rings, MAX_CELLS) + 63) / 64 * 64);
    if (!memory)
        exit(1);
    clusters_look(clusters_init(memory, &run.rings, MAX_CELLS, log(0.6 / 0.4)), run.grid, run.frame.t_ping_ns,
                  &list, &clusters);
    printf("%s,%u,%.4g,%.4g,%.4f,%.4g,%.4f,%u,%u\n", s->name, seed, true_m, shown_m, shown_m / true_m, false_m,
           false_m / all_m, n, clusters);
    free(memory);
    free(run.memory);
}

static void model(const struct scene *s)
{
    printf("piece,x,y\n");
    for (const struct edge *e = s->edge; e->kind != END; e++) {
        const unsigned n = e->kind == LINE ? 1 : (unsigned)ceil(geo_rad(e->b[2] - e->b[1]) / PIECE_RAD);
        for (unsigned i = 0; i <= n; i++) {
            double at[2];
            edge_point(e, (double)i / n, at);
            printf("%d,%.3f,%.3f\n", (int)(e - s->edge), at[0], at[1]);
        }
    }
}

static void path(const struct scene *s)
{
    printf("x,y,number\n");
    for (unsigned k = 0; k < s->places; k++) {
        double at[2];
        place_of(s, k, at);
        printf("%.3f,%.3f,%u\n", at[0], at[1], k + 1);
    }
}

static void cells(const struct scene *s)
{
    struct run run = run_of(s, 1);
    printf("class,z,x1,y1,x2,y2,x3,y3,x4,y4\n");
    each_cell(&run, draw, NULL);
    free(run.memory);
}

static void echoes(const struct scene *s)
{
    free(run_of(s, 1).memory);
    printf("x,y\n");
    for (unsigned i = 0; i < echoes_n; i++)
        printf("%.3f,%.3f\n", echo_at[i][0], echo_at[i][1]);
}

static const struct part {
    const char *name;
    void (*show)(const struct scene *s);
} parts[] = {{"cells", cells}, {"echoes", echoes}, {"path", path}, {"model", model}};

static bool show(const char *part, const char *scene)
{
    for (size_t p = 0; p < sizeof parts / sizeof parts[0]; p++)
        for (size_t i = 0; i < SCENES; i++)
            if (strcmp(part, parts[p].name) == 0 && strcmp(scene, scenes[i].name) == 0) {
                parts[p].show(&scenes[i]);
                return true;
            }
    return false;
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[argc - 1], "quick") == 0;
    if (strcmp(what, "surfaces") == 0) {
        printf("scene,seed,true_m,shown_m,shown_share,false_m,false_share,cells,clusters\n");
        for (size_t i = 0; i < SCENES; i++)
            for (unsigned seed = 1; seed <= (quick ? 1u : SEEDS); seed++)
                grade(&scenes[i], seed);
        return 0;
    }
    if (argc > 2 && show(what, argv[2]))
        return 0;
    fprintf(stderr, "usage: report_paper surfaces [quick], report_paper cells|echoes|path|model model|harbour\n");
    return 2;
}
