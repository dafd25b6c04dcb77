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
 *   report_paper clusters SCENE     CSV: cluster (1 has the most cells), z, x and y of the corners of each of its cells
 *   report_paper relaxed SCENE      the same of the relaxed grid
 *   report_paper surfaces           CSV: scene, seed, true_m, shown_m, shown_share, false_m, false_share, cells,
 *                                   clusters, relaxed: clusters of the relaxed grid
 *
 * SCENE is a name of report/scenes/ or the path of such a file (report/lib/drawing.h).
 *
 * x is east, y north, z upward, metres.
 */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/ping.h"
#include "grid/sphere/clusters.h"
#include "grid/sphere/relax.h"
#include "grid/sphere/view.h"
#include "tests/water/dice.h"
#include "report/lib/drawing.h"

#define SEEDS            8
#define MAX_CELLS        65536
#define ECHOES           8192
#define POINTS           100000
#define PIECE_RAD        0.05   /* arcs are drawn and graded in pieces */
#define HALF_POWER_TO_SD 2.3548 /* a normal distribution's width at half power, in deviations */
#define RELAXED          0.5    /* mu of the clusters of the relaxed grid */
#define BLOCKED          log(0.6 / 0.4)

static const char *const scenes[] = {"model", "harbour"};
#define SCENES (sizeof scenes / sizeof scenes[0])

struct scene {
    const char *name;
    struct drawing d;
};

static double echo_at[ECHOES][2];
static unsigned echoes_n;

/* A word is one of report/scenes/, a path a file. */
static struct scene scene_of(const char *name)
{
    struct scene s = {.name = name};
    struct fault fault;
    char path[256];
    snprintf(path, sizeof path, strchr(name, '/') ? "%s" : "report/scenes/%s.scene", name);
    if (!drawing_read(path, &s.d, &fault)) {
        fprintf(stderr, "report_paper: %s\n", fault.text);
        exit(2);
    }
    return s;
}

static void place_of(const struct scene *s, unsigned k, double out[2])
{
    const double t = s->d.places > 1 ? k / (s->d.places - 1) : 0;
    for (int i = 0; i < 2; i++)
        out[i] = s->d.path[i] + t * (s->d.path[2 + i] - s->d.path[i]);
}

/* ---- sound ---- */

/* One scan all around: north is y, the grid's first axis. */
static void scan(struct sphere *grid, const struct scene *s, unsigned k, struct dice *dice)
{
    const unsigned beams = (unsigned)ceil(360 / s->d.opening_deg);
    const double opening = geo_rad(s->d.opening_deg);
    static uint64_t t_ns;
    static uint32_t seq;
    double at[2];
    place_of(s, k, at);
    const double depth_m = s->d.swing_m * (sin(1.3 * k) + 0.2 * dice_gauss(dice));
    for (unsigned i = 0; i < beams * (unsigned)s->d.tilts; i++) {
        const double az = (i % beams) * opening, tilt = -(double)(i / beams) * opening;
        const double yaw = i % beams > beams / 2 ? geo_rad(s->d.yaw_deg) : 0;
        const double heard_az = az + yaw + opening / HALF_POWER_TO_SD * dice_gauss(dice);
        double r = drawing_ray(&s->d, at, GEO_PI / 2 - heard_az) / cos(tilt);
        const double sd_m = fmax(s->d.layer_m / 4, s->d.range_error * r);
        r += sd_m * dice_gauss(dice);
        const bool heard = r < s->d.range_m;
        struct beam_echoes beam = {.az_rad = (float)az,
                                   .el_rad = (float)tilt,
                                   .blind_m = (float)s->d.layer_m,
                                   .free_to_m = (float)(heard ? r - 2 * sd_m : s->d.range_m),
                                   .state = heard ? BEAM_ECHO : BEAM_SILENT,
                                   .n = heard};
        beam.echo[0] = (struct echo){
            .range_m = (float)r, .near_m = (float)(r - 2 * sd_m), .sd_m = (float)sd_m, .confidence = 0.9f};
        struct echoes ping = {.t_ns = t_ns += 100000000,
                              .seq = ++seq,
                              .n_beams = 1,
                              .flags = i == 0 ? PING_NEW_TURN : 0,
                              .range_max_m = (float)s->d.range_m,
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
    double mu; /* of the clusters */
    struct sphere *grid;
    void *memory;
    struct rings rings;
    struct picture_frame frame;
};

static struct run run_of(const struct scene *s, unsigned seed, double mu)
{
    const struct sphere_conf conf = {.angular_step_rad = geo_rad(s->d.opening_deg),
                                     .layers = {.r_max_m = 4 * s->d.range_m,
                                                .dr_m = s->d.layer_m,
                                                .n_const = 25,
                                                .growth = 1 + geo_rad(s->d.opening_deg)},
                                     .max_cells = MAX_CELLS,
                                     .forget_s = 1e6,
                                     .blocked_above = 0.6,
                                     .recentre_m = s->d.layer_m,
                                     .model = SPHERE_GAUSS,
                                     .range_error = s->d.range_error,
                                     .cluster_relaxation = mu};
    struct run run = {.scene = s, .mu = mu};
    struct dice dice = dice_of(seed, 0);
    struct fault fault;
    const size_t bytes = sphere_bytes(&conf, &fault);
    run.memory = bytes ? aligned_alloc(64, (bytes + 63) / 64 * 64) : NULL;
    if (!run.memory) {
        fprintf(stderr, "report_paper: no grid: %s\n", fault.text);
        exit(1);
    }
    run.grid = sphere_init(run.memory, &conf);
    rings_full(&run.rings, conf.angular_step_rad);
    echoes_n = 0;
    for (unsigned k = 0; k < s->d.places; k++)
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
            if (cell.logodds > BLOCKED) {
                use(run, d, &cell, data);
                n++;
            }
    return n;
}

/* A number, the height, and the corners in the level plane. */
static void draw_cell(const struct run *run, unsigned class, uint32_t d, const struct sphere_cell *c)
{
    double az, el;
    const double half = rings_width(&run->rings, rings_ring(&run->rings, d)) / 2, *o = run->frame.centre_m;
    rings_centre(&run->rings, d, &az, &el);
    printf("%u,%.3f", class, c->to_m * sin(el) - o[2]);
    for (int corner = 0; corner < 4; corner++) {
        const double r = corner == 1 || corner == 2 ? c->to_m : c->from_m, a = az + (corner >= 2 ? half : -half);
        printf(",%.3f,%.3f", o[1] + r * cos(el) * sin(a), o[0] + r * cos(el) * cos(a));
    }
    printf("\n");
}

static void draw(const struct run *run, uint32_t d, const struct sphere_cell *c, void *unused)
{
    (void)unused;
    draw_cell(run, c->logodds > 3 ? 3 : c->logodds > 1.5 ? 2 : 1, d, c);
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
    for (unsigned k = 0; k < s->d.places; k++) {
        double from[2];
        place_of(s, k, from);
        const double dx = at[0] - from[0], dy = at[1] - from[1], r = hypot(dx, dy);
        if (r < s->d.range_m && drawing_ray(&s->d, from, atan2(dy, dx)) > r - 1e-3 * s->d.range_m)
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
    for (const struct drawing_edge *e = s->d.edge; e < s->d.edge + s->d.edges; e++) {
        const unsigned n = (unsigned)ceil(drawing_length(e) / s->d.layer_m);
        for (unsigned i = 0; i <= n; i++) {
            double at[2];
            drawing_point(e, (double)i / n, at);
            if (hypot(cell->at[0] - at[0], cell->at[1] - at[1]) <= cell->size_m + s->d.layer_m)
                return true;
        }
    }
    return false;
}

static unsigned clusters_of(const struct run *run)
{
    const struct cluster *list;
    uint32_t all;
    void *memory = aligned_alloc(64, (clusters_bytes(&run->rings, MAX_CELLS) + 63) / 64 * 64);
    if (!memory)
        exit(1);
    clusters_look(clusters_init(memory, &run->rings, MAX_CELLS, BLOCKED), run->grid, run->frame.t_ping_ns, &list,
                  &all);
    free(memory);
    return all;
}

/* Lengths of surfaces: true and heard, shown of these, and shown where there is none. */
static void grade(const struct scene *s, unsigned seed)
{
    static struct shown cell[POINTS];
    struct shown *end = cell;
    struct run run = run_of(s, seed, 0);
    const unsigned n = each_cell(&run, collect, &end);
    double true_m = 0, shown_m = 0, false_m = 0, all_m = 0;
    for (const struct drawing_edge *e = s->d.edge; e < s->d.edge + s->d.edges; e++) {
        const unsigned pieces = (unsigned)ceil(drawing_length(e) / s->d.layer_m);
        for (unsigned i = 0; i < pieces; i++) {
            double at[2];
            drawing_point(e, (i + 0.5) / pieces, at);
            if (!was_heard(s, at))
                continue;
            true_m += drawing_length(e) / pieces;
            shown_m += near_a_cell(cell, n, at) ? drawing_length(e) / pieces : 0;
        }
    }
    for (unsigned i = 0; i < n; i++) {
        all_m += cell[i].width_m;
        false_m += near_a_surface(s, &cell[i]) ? 0 : cell[i].width_m;
    }
    const unsigned plain = clusters_of(&run);
    free(run.memory);
    run = run_of(s, seed, RELAXED);
    printf("%s,%u,%.4g,%.4g,%.4f,%.4g,%.4f,%u,%u,%u\n", s->name, seed, true_m, shown_m, shown_m / true_m, false_m,
           false_m / all_m, n, plain, clusters_of(&run));
    free(run.memory);
}

static void model(const struct scene *s)
{
    printf("piece,x,y\n");
    for (const struct drawing_edge *e = s->d.edge; e < s->d.edge + s->d.edges; e++) {
        const unsigned n = e->kind == DRAWING_LINE ? 1 : (unsigned)ceil(geo_rad(e->b[2] - e->b[1]) / PIECE_RAD);
        for (unsigned i = 0; i <= n; i++) {
            double at[2];
            drawing_point(e, (double)i / n, at);
            printf("%d,%.3f,%.3f\n", (int)(e - s->d.edge), at[0], at[1]);
        }
    }
}

static void path(const struct scene *s)
{
    printf("x,y,number\n");
    for (unsigned k = 0; k < s->d.places; k++) {
        double at[2];
        place_of(s, k, at);
        printf("%.3f,%.3f,%u\n", at[0], at[1], k + 1);
    }
}

static void cells(const struct scene *s)
{
    struct run run = run_of(s, 1, 0);
    printf("class,z,x1,y1,x2,y2,x3,y3,x4,y4\n");
    each_cell(&run, draw, NULL);
    free(run.memory);
}

static void echoes(const struct scene *s)
{
    free(run_of(s, 1, 0).memory);
    printf("x,y\n");
    for (unsigned i = 0; i < echoes_n; i++)
        printf("%.3f,%.3f\n", echo_at[i][0], echo_at[i][1]);
}

/* ---- clusters ---- */

#define ROOM (2 * MAX_CELLS)

/* Members of clusters, as the module takes them, and to which component each belongs. */
struct members {
    const struct run *run;
    struct components components;
    uint32_t direction;
    struct sphere_cell cell[ROOM];
};

static void put_member(void *context, const struct sphere_cell *cell)
{
    struct members *m = context;
    if (cell->logodds <= BLOCKED / 2)
        return;
    const uint32_t i = components_put(&m->components, m->direction, cell->layer, cell->logodds > BLOCKED,
                                      m->run->frame.t_ping_ns);
    if (i != COMPONENTS_NONE)
        m->cell[i] = *cell;
}

/* The place of a component among all by its cells: 1 has the most. */
static unsigned rank_of(struct members *m, uint32_t i)
{
    const struct component *own = components_of(&m->components, i);
    unsigned rank = 1;
    COMPONENTS_EACH(&m->components, root)
    {
        const struct component *other = components_of(&m->components, root);
        rank += other->seeds &&
                (other->cells > own->cells || (other->cells == own->cells && other->label < own->label));
    }
    return rank;
}

static void draw_clusters(struct run *run)
{
    static struct members m;
    struct sphere_cell cell;
    void *memory = aligned_alloc(64, (components_bytes(ROOM) + 63) / 64 * 64);
    if (!memory)
        exit(1);
    m.run = run;
    components_init(&m.components, memory, &run->rings, ROOM);
    components_begin(&m.components);
    for (m.direction = 0; m.direction < run->rings.n; m.direction++) {
        if (run->mu > 0)
            relax_cells(run->grid, m.direction, run->mu, run->frame.t_ping_ns, put_member, &m);
        for (uint32_t k = 0; !(run->mu > 0) && sphere_cell(run->grid, m.direction, k, run->frame.t_ping_ns, &cell);
             k++)
            put_member(&m, &cell);
    }
    components_end(&m.components, run->frame.t_ping_ns);
    printf("cluster,z,x1,y1,x2,y2,x3,y3,x4,y4\n");
    COMPONENTS_EACH(&m.components, root)
    {
        if (!components_of(&m.components, root)->seeds)
            continue;
        const unsigned rank = rank_of(&m, root);
        uint32_t i = root;
        do {
            draw_cell(run, rank, m.components.cell[i].direction, &m.cell[i]);
            i = m.components.cell[i].next;
        } while (i != root);
    }
    free(memory);
}

static void plain_clusters(const struct scene *s)
{
    struct run run = run_of(s, 1, 0);
    draw_clusters(&run);
    free(run.memory);
}

static void relaxed_clusters(const struct scene *s)
{
    struct run run = run_of(s, 1, RELAXED);
    draw_clusters(&run);
    free(run.memory);
}

static const struct part {
    const char *name;
    void (*show)(const struct scene *s);
} parts[] = {{"cells", cells}, {"echoes", echoes},           {"path", path},
             {"model", model}, {"clusters", plain_clusters}, {"relaxed", relaxed_clusters}};

static bool show(const char *part, const char *scene)
{
    for (size_t p = 0; p < sizeof parts / sizeof parts[0]; p++)
        if (strcmp(part, parts[p].name) == 0) {
            const struct scene s = scene_of(scene);
            parts[p].show(&s);
            return true;
        }
    return false;
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[argc - 1], "quick") == 0;
    if (strcmp(what, "surfaces") == 0) {
        printf("scene,seed,true_m,shown_m,shown_share,false_m,false_share,cells,clusters,relaxed\n");
        for (size_t i = 0; i < SCENES; i++) {
            const struct scene s = scene_of(scenes[i]);
            for (unsigned seed = 1; seed <= (quick ? 1u : SEEDS); seed++)
                grade(&s, seed);
        }
        return 0;
    }
    if (argc > 2 && show(what, argv[2]))
        return 0;
    fprintf(stderr,
            "usage: report_paper surfaces [quick], report_paper cells|echoes|path|model|clusters|relaxed SCENE\n");
    return 2;
}
