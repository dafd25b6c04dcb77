/* SPDX-License-Identifier: MIT */
/*
 * report_ghost - multipath in a tank: second echoes at twice a wall's range (wall, head, wall) and at a wall's range
 * plus the tank's length (between two walls), heard, extracted, marked and entered as shipped. Which of them are found,
 * which are suspected, and which true echoes are suspected too.
 *
 *   report_ghost [quick]   CSV: bounce_db, seeds, kind, beams, found, marked_share, marked_low, marked_high,
 *                          true_echoes, true_marked, clusters, clusters_suspected
 *
 * beams: in which such a ghost sounds, square on to its wall. found: an echo behind the first lies there. true_marked:
 * echoes of surfaces with a ghost's mark. clusters: of the grid, beyond the tank's walls;
 * suspected: by shapes_ghost_of.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/range/extract.h"
#include "grid/range/marks.h"
#include "grid/sphere/shapes.h"
#include "grid/sphere/sphere.h"
#include "tests/water/scene.h"
#include "tests/water/dice.h"
#include "tests/sound/sea.h"

#define SEEDS     5
#define TURNS     3
#define BEAMS     400 /* of a turn */
#define PING_NS   50000000u
#define SQUARE_ON 0.995 /* cosine of incidence: farther off a wall throws nothing back and forth */
#define NEAR_M    0.25  /* an echo so near to where a ghost or a surface is, is of it */
#define RANGE_M   12.0
#define MAX_CELLS 16384

/* Two lengths, so that all four walls have ghosts of their own; a pile, behind which a wall is a second, true echo. */
static const char tank[] = "box -1.9 3.6 -1.2 1.9 -3 3\ncylinder 1.5 1 0.1";

static const double origin[3] = {0, 0, 0};

enum kind { TWICE, LENGTH, KINDS };
static const char *const kind_name[KINDS] = {"twice the wall's range", "the wall's range and the tank's length"};

struct tally {
    unsigned beams[KINDS], found[KINDS], marked[KINDS], true_echoes, true_marked, clusters, suspected;
};

/* What a whole tank needs of the chain, anew for every seed. */
struct rig {
    struct place scene;
    struct extract *extract;
    struct marks marks;
    struct sphere *grid;
    struct clusters *clusters;
    void *memory[3];
};

static void *room(size_t bytes)
{
    void *p = bytes ? aligned_alloc(64, (bytes + 63) / 64 * 64) : NULL;
    if (!p) {
        fprintf(stderr, "report_ghost: no memory\n");
        exit(1);
    }
    return p;
}

static void start(struct rig *rig)
{
    const struct sphere_conf conf = {.angular_step_rad = 2 * GEO_PI / 180,
                                     .level = true,
                                     .level_half_rad = 7.5 * GEO_PI / 180,
                                     .layers = {.r_max_m = 20, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                     .max_cells = MAX_CELLS,
                                     .forget_s = 160,
                                     .blocked_above = 0.6,
                                     .recentre_m = 0.1};
    struct extract_conf extract;
    struct fault fault;
    extract_defaults(&extract);
    rig->memory[0] = room(extract_size(SEA_MAX_BINS));
    rig->extract = extract_init(rig->memory[0], &extract, SEA_MAX_BINS, &fault);
    marks_init(&rig->marks, 1500.0);
    rig->memory[1] = room(sphere_bytes(&conf, &fault));
    rig->grid = sphere_init(rig->memory[1], &conf);
    const struct picture *picture = sphere_picture(rig->grid);
    rig->memory[2] = room(clusters_bytes(picture->rings, MAX_CELLS));
    rig->clusters = clusters_init(rig->memory[2], picture->rings, MAX_CELLS, (double)picture->blocked_logodds);
    if (!rig->extract || !scene_parse(&rig->scene, "tank", tank, &fault)) {
        fprintf(stderr, "report_ghost: %s\n", fault.text);
        exit(1);
    }
}

static bool shows(const struct beam_echoes *b, double range_m, bool *marked)
{
    for (unsigned k = 1; k < b->n; k++)
        if (fabs((double)b->echo[k].range_m - range_m) <= NEAR_M) {
            *marked = b->echo[k].flags & ECHO_GHOST;
            return true;
        }
    return false;
}

/* Whether a surface is at a range anywhere in the beam's height, which its skirt included is twice the aperture. */
static bool is_surface(const struct place *scene, double az_rad, double range_m)
{
    for (int k = -10; k <= 10; k++)
        for (int side = -1; side <= 1; side++) {
            struct place_hit hit;
            double d[3];
            geo_direction(az_rad + side * geo_rad(2),
                          k / 10.0 * (double)sea_ping_of(SOUND_PING360).el_aperture_rad, d);
            if (place_cast(scene, origin, d, 0, &hit) && fabs(hit.range_m - range_m) <= NEAR_M)
                return true;
        }
    return false;
}

static void tally_beam(const struct place *scene, const struct beam_echoes *b, struct tally *t)
{
    struct place_hit hit;
    double d[3];
    for (unsigned k = 0; k < b->n; k++)
        if (is_surface(scene, (double)b->az_rad, (double)b->echo[k].range_m)) {
            t->true_echoes++;
            t->true_marked += (b->echo[k].flags & ECHO_GHOST) != 0;
        }
    geo_direction((double)b->az_rad, 0, d);
    if (!place_cast(scene, origin, d, 0, &hit) || hit.cos_incidence < SQUARE_ON)
        return;
    const double at_m[KINDS] = {2 * hit.range_m, hit.ghost_m};
    for (int kind = 0; kind < KINDS; kind++) {
        bool marked = false;
        if (at_m[kind] > RANGE_M - NEAR_M || is_surface(scene, (double)b->az_rad, at_m[kind]))
            continue;
        t->beams[kind]++;
        t->found[kind] += shows(b, at_m[kind], &marked);
        t->marked[kind] += marked;
    }
}

/* Clusters that lie where no water is. */
static void tally_clusters(struct rig *rig, uint64_t t_ns, struct tally *t)
{
    static struct shapes shapes;
    const struct cluster *list;
    uint32_t all;
    shapes_look(&shapes, sphere_picture(rig->grid), t_ns);
    const uint32_t n = clusters_look(rig->clusters, rig->grid, t_ns, &list, &all);
    for (uint32_t k = 0; k < n; k++) {
        struct place_hit hit;
        double d[3];
        geo_direction(atan2(list[k].nearest_m[1], list[k].nearest_m[0]), 0, d);
        if (!place_cast(&rig->scene, origin, d, 0, &hit) || list[k].near_m < hit.range_m + 2 * NEAR_M)
            continue;
        t->clusters++;
        t->suspected += shapes_ghost_of(&shapes, &list[k]) != TANGENTS_NONE;
    }
}

static void hear(unsigned seed, double bounce_db, unsigned turns, struct tally *t)
{
    const struct sea_sound sound = {.surface_db = -6,
                                    .bounce_db = {bounce_db, bounce_db},
                                    .square_on = SQUARE_ON,
                                    .rays_az = 1,
                                    .rays_el = 31};
    static struct sea_ping sea;
    struct rig rig = {0};
    uint64_t t_ns = 0;
    start(&rig);
    for (unsigned i = 0; i < turns * BEAMS; i++) {
        struct dice dice = dice_of(seed, i);
        struct beam_echoes beam;
        struct echoes e = {.max_beams = 1, .beam = &beam};
        sea_turn(&sound, &rig.scene, 0, 1, i, &dice, &sea);
        sea.ping.t_ns = t_ns = (i + 1) * (uint64_t)PING_NS;
        extract_run(rig.extract, &sea.ping, NULL, &e);
        marks_run(&rig.marks, &e);
        sphere_enter(rig.grid, &e, &mount_identity);
        if (i >= BEAMS) /* the first turn knows of no opposite wall */
            tally_beam(&rig.scene, &beam, t);
    }
    tally_clusters(&rig, t_ns, t);
    for (int k = 0; k < 3; k++)
        free(rig.memory[k]);
}

static void row(double bounce_db, unsigned seeds, unsigned turns)
{
    struct tally all = {0};
    double low[KINDS] = {1, 1}, high[KINDS] = {0};
    for (unsigned seed = 1; seed <= seeds; seed++) {
        struct tally t = {0};
        hear(seed, bounce_db, turns, &t);
        for (int k = 0; k < KINDS; k++) {
            const double share = t.found[k] ? (double)t.marked[k] / t.found[k] : 0;
            low[k] = fmin(low[k], share);
            high[k] = fmax(high[k], share);
            all.beams[k] += t.beams[k];
            all.found[k] += t.found[k];
            all.marked[k] += t.marked[k];
        }
        all.true_echoes += t.true_echoes;
        all.true_marked += t.true_marked;
        all.clusters += t.clusters;
        all.suspected += t.suspected;
    }
    for (int k = 0; k < KINDS; k++)
        printf("%g,%u,%s,%u,%u,%.3g,%.3g,%.3g,%u,%u,%u,%u\n", bounce_db, seeds, kind_name[k], all.beams[k],
               all.found[k], (double)all.marked[k] / fmax(all.found[k], 1), low[k], high[k], all.true_echoes,
               all.true_marked, all.clusters, all.suspected);
}

int main(int argc, char **argv)
{
    static const double bounce_db[] = {-3, -9, -15, -21};
    const bool quick = argc > 1 && strcmp(argv[1], "quick") == 0;
    printf("bounce_db,seeds,kind,beams,found,marked_share,marked_low,marked_high,true_echoes,true_marked,clusters,"
           "clusters_suspected\n");
    for (int k = 0; k < 4; k += quick ? 2 : 1)
        row(bounce_db[k], quick ? 2 : SEEDS, quick ? 2 : TURNS);
    return 0;
}
