/* SPDX-License-Identifier: MIT */
/*
 * test_tangents - walls, corners and ghosts: made-up rooms whose lines are known, and a recorded tank whose walls were
 * measured. That recording may not be redistributed and is looked for in ../shared/data.
 */
#include "tests/lib/test.h"

#include "core/fault.h"
#include "grid/geometry.h"
#include "grid/range/extract.h"
#include "grid/sphere/depth_regions.h"
#include "grid/sphere/tangents.h"

#define BEAMS 200
#define WALLS 16

static const struct tangents_conf usual = {.neighbours = 7,
                                           .angle_rad = 8 * GEO_PI / 180,
                                           .offset_m = 0.08,
                                           .reach_m = 0.6,
                                           .least_n = 6,
                                           .straight_m = 0.1};
static struct tangent_point point[BEAMS];
static struct wall wall[WALLS];
static uint32_t of[BEAMS], n_walls;

static void find(void)
{
    n_walls = tangents_walls(&usual, point, BEAMS, wall, WALLS, of);
}

static void set(uint32_t i, double az_rad, double range_m)
{
    point[i] = (struct tangent_point){range_m * cos(az_rad), range_m * sin(az_rad)};
}

/* A room seen from inside: walls at these distances along +x, +y, -x, -y, all turned by `turn`. */
static void room(const double distance_m[4], double turn_rad)
{
    for (uint32_t i = 0; i < BEAMS; i++) {
        const double az = i * GEO_TURN / BEAMS;
        double range = INFINITY;
        for (int w = 0; w < 4; w++) {
            const double c = cos(az - turn_rad - w * GEO_PI / 2);
            if (c > 1e-9)
                range = fmin(range, distance_m[w] / c);
        }
        set(i, az, range);
    }
}

/* A wall along x, its points to either side of angle 0 = pi: one wall, not two. */
TEST(lines_on_both_sides_of_the_seam_of_pi_are_one)
{
    for (uint32_t i = 0; i < BEAMS; i++)
        point[i] = (struct tangent_point){NAN, NAN};
    for (uint32_t i = 0; i < 40; i++)
        point[i] = (struct tangent_point){2 - 0.1 * i, 3 + (i < 20 ? 1e-12 : -1e-12) * i};
    find();
    CHECK_INT(n_walls, 1);
    CHECK_INT(wall[0].points, 40);
    CHECK_NEAR(wall[0].distance_m, 3, 0, 1e-9);
    CHECK_NEAR(wall[0].normal_rad, GEO_PI / 2, 0, 1e-9);
    CHECK_NEAR(wall[0].from_m, -2, 0, 1e-9); /* right, as seen from the scanner, is -x */
    CHECK_NEAR(wall[0].to_m, 1.9, 0, 1e-9);
}

TEST(a_room_at_any_angle_has_four_walls_and_four_corners)
{
    static const double distance_m[4] = {2, 1.5, 1.2, 1.7};
    for (int turn = 0; turn < 90; turn++) {
        int corners = 0;
        room(distance_m, geo_rad(turn + 0.3));
        find();
        CHECK_INT(n_walls, 4);
        for (uint32_t w = 0; w < n_walls; w++) {
            const double side = (geo_wrap(wall[w].normal_rad - geo_rad(turn + 0.3) + 0.1)) / (GEO_PI / 2);
            CHECK_NEAR(wall[w].distance_m, distance_m[(int)side % 4], 0, 0.03);
            for (uint32_t v = 0; v < w; v++) {
                struct tangent_point p;
                corners += tangents_corner(&wall[v], &wall[w], 0.4, 0, &p);
            }
        }
        CHECK_INT(corners, 4);
    }
}

/* Walls reach their corners: no point beside one is lost to its neighbours behind it. */
TEST(walls_of_a_room_hold_all_points_up_to_the_corners)
{
    static const double distance_m[4] = {2, 6, 3, 5};
    room(distance_m, 0.3);
    find();
    CHECK_INT(n_walls, 4);
    for (uint32_t w = 1; w < n_walls; w++)
        CHECK(wall[w].points <= wall[w - 1].points);
    for (uint32_t i = 0; i < BEAMS; i++)
        CHECK(of[i] != TANGENTS_NONE);
}

/*
 * Askew and far away, neighbouring points lie farther apart than any gap in metres: their bearings tell. But a wall
 * that ends at 8 m is not taken to go on to 30 m, which is as little of a bearing: there may be a passage.
 */
TEST(two_walls_meet_by_metres_or_by_bearing)
{
    const struct wall side = {.normal_rad = GEO_PI / 2, .distance_m = 1, .from_m = -8, .to_m = 2},
                      end = {.normal_rad = 0, .distance_m = 10, .from_m = -1, .to_m = 1},
                      beyond = {.normal_rad = 0, .distance_m = 30, .from_m = -1, .to_m = 1};
    struct tangent_point p;
    CHECK(!tangents_corner(&side, &end, 0.5, 0, &p));
    CHECK(!tangents_corner(&side, &end, 0.5, 0.02, &p));
    CHECK(tangents_corner(&side, &end, 0.5, 0.03, &p)); /* atan(1 / 8) - atan(1 / 10) */
    CHECK_NEAR(p.x_m, 10, 1e-9, 0);
    CHECK_NEAR(p.y_m, 1, 1e-9, 0);
    CHECK(tangents_corner(&side, &end, 2.1, 0, &p));
    CHECK(!tangents_corner(&side, &beyond, 0.5, 0.1, &p));
}

TEST(a_ghost_lies_a_tank_length_behind_its_wall)
{
    static const double distance_m[4] = {2, 1.5, 1.2, 1.7};
    room(distance_m, 0);
    find();
    const double ghost_m = distance_m[0] + (distance_m[0] + distance_m[2]);
    const uint32_t w = tangents_ghost(wall, n_walls, 0, ghost_m, 0.3, 0.1);
    CHECK(w != TANGENTS_NONE);
    CHECK_NEAR(wall[w % WALLS].distance_m, 2, 0, 0.03);
    CHECK(tangents_ghost(wall, n_walls, 0.2, ghost_m / cos(0.2), 0.3, 0.1) == w);
    CHECK(tangents_ghost(wall, n_walls, 0, 4.0, 0.3, 0.1) == w); /* by the vehicle */
    CHECK(tangents_ghost(wall, n_walls, 0, 2.0, 0.3, 0.1) == TANGENTS_NONE);
    CHECK(tangents_ghost(wall, n_walls, 0, 4.6, 0.3, 0.1) == TANGENTS_NONE);
    CHECK(tangents_ghost(wall, n_walls, 0.5, ghost_m / cos(0.5), 0.3, 0.1) == TANGENTS_NONE);
    CHECK(tangents_ghost(wall, 0, 0, ghost_m, 0.3, 0.1) == TANGENTS_NONE);
}

TEST(a_wall_alone_in_the_water_has_no_opposite_and_a_post_is_no_wall)
{
    for (uint32_t i = 0; i < BEAMS; i++) {
        point[i] = (struct tangent_point){NAN, NAN};
        if (i < 30)
            set(i, i * GEO_TURN / BEAMS, 2 / cos(i * GEO_TURN / BEAMS));
        if (i > 100 && i < 104)
            set(i, i * GEO_TURN / BEAMS, 2);
    }
    find();
    CHECK_INT(n_walls, 1);
    CHECK_INT(of[102], TANGENTS_NONE);
    CHECK(tangents_ghost(wall, n_walls, 0, 6, 0.3, 0.1) == TANGENTS_NONE);
}

/* ---- the tank ---- */

#define TANK "../shared/data/micron-tank-rosbag/static_sonar.csv"
#define BINS 396
/* Nearer the recording holds ring-down and its reverberation. */
#define RINGS_M  0.8
#define STRENGTH 6.3 /* over the threshold, power ratio: side lobes are weaker */
#define OFF_DEG  12.0
#define WITHIN_M 0.16
#define SECOND_M 0.25 /* an echo so near a known ghost's range is that ghost */

/* One look all around: the echoes of each bearing. */
static struct beam_echoes heard[BEAMS];

static bool read_ping(FILE *file, struct extract *extract)
{
    static char line[1 << 14];
    static uint8_t sample[BINS];
    struct ping_beam axis = {.az_rad = 0};
    do {
        if (!fgets(line, sizeof line, file))
            return false;
    } while (line[0] == '#');
    char *at = line;
    strtod(at, &at);
    const double bearing_deg = strtod(at + 1, &at), range_m = strtod(at + 1, &at);
    strtoul(at + 1, &at, 10);
    for (int i = 0; i < BINS; i++)
        sample[i] = (uint8_t)strtoul(at + 1, &at, 10);
    const struct ping ping = {.kind = PING_PROFILE,
                              .law = AMPLITUDE_LOG,
                              .sample_bytes = 1,
                              .n_beams = 1,
                              .n_bins = BINS,
                              .db_per_count = (float)(80.0 / 255.0),
                              .dr_m = (float)(range_m / BINS),
                              .pulse_m = 0.05f,
                              .beam = &axis,
                              .samples = sample};
    struct echoes out = {.max_beams = 1, .beam = &heard[lround(bearing_deg / 1.8) % BEAMS]};
    extract_run(extract, &ping, NULL, &out);
    return true;
}

static double first_m(const struct beam_echoes *b)
{
    for (int k = 0; k < b->n; k++)
        if ((double)b->echo[k].range_m > RINGS_M && (double)b->echo[k].strength > STRENGTH)
            return (double)b->echo[k].range_m;
    return NAN;
}

/*
 * Walls as fitted to the recording (normal, distance), where their ghosts were read from the picture, and how many
 * echoes of these are suspected at least: W's in the first look lie at the edge of what the walls' distances allow, so
 * that a centimetre decides.
 */
static const struct {
    const char *name;
    double normal_deg[2], distance_m[2], ghost_m;
    int least_suspected[2];
} known[] = {{"E", {81, 92}, {1.01, 0.94}, 3.99, {11, 13}}, {"W", {265, 264}, {2.21, 2.22}, 5.25, {0, 12}}};

static const struct wall *wall_near(double normal_deg, double distance_m)
{
    for (uint32_t w = 0; w < n_walls; w++)
        if (fabs(geo_wrap_pi(wall[w].normal_rad - geo_rad(normal_deg))) < geo_rad(6) &&
            fabs(wall[w].distance_m - distance_m) < 0.1)
            return &wall[w];
    return NULL;
}

static bool mirrors(const struct wall *w, const double *range_m)
{
    struct depth_region region[64];
    const uint32_t n = depth_regions(range_m, BEAMS, 0.06, 5, region, 64);
    for (uint32_t k = 0; k < n && k < 64; k++) {
        const double middle = (region[k].first + (region[k].n - 1) / 2.0) * GEO_TURN / BEAMS;
        if (fabs(geo_wrap_pi(middle - w->normal_rad)) < geo_rad(15) && region[k].least_m < w->distance_m + 0.15 &&
            region[k].most_m > w->distance_m - 0.15)
            return true;
    }
    return false;
}

struct count {
    int walls, walls_marked, ghosts, ghosts_marked;
};

/* Echoes around the normal of a wall: of the wall itself, and of its ghost. */
static void count_marks(const struct wall *w, double ghost_m, struct count *c)
{
    for (uint32_t i = 0; i < BEAMS; i++) {
        const double az = i * GEO_TURN / BEAMS, off = geo_wrap_pi(az - w->normal_rad);
        if (fabs(off) > geo_rad(OFF_DEG))
            continue;
        for (int k = 0; k < heard[i].n; k++) {
            const double range = (double)heard[i].echo[k].range_m, across = range * cos(off);
            const bool marked =
                tangents_ghost(wall, n_walls, az, range, geo_rad(OFF_DEG), WITHIN_M) != TANGENTS_NONE;
            const bool is_wall = fabs(across - w->distance_m) < SECOND_M,
                       is_ghost = fabs(across - ghost_m) < SECOND_M;
            c->walls += is_wall;
            c->walls_marked += is_wall && marked;
            c->ghosts += is_ghost;
            c->ghosts_marked += is_ghost && marked;
        }
    }
}

/*
 * Walls E and W are found in both looks. Of S, the farthest, the line is bent in the second by louder echoes before
 * it. The fourth, N, lies 0.19 m away in the ring-down: what is heard of it is its ghost at 4.26 m, the first echo
 * there, and nothing in the scan tells that from a wall.
 */
TEST(walls_and_ghosts_of_a_tank)
{
    static _Alignas(16) unsigned char memory[1 << 19];
    struct extract_conf conf;
    struct fault fault;
    FILE *file = fopen(TANK, "r");
    extract_defaults(&conf);
    struct extract *extract = extract_init(memory, &conf, BINS, &fault);
    CHECK(extract_size(BINS) <= sizeof memory && extract && file);
    for (int look = 0; look < 2; look++) {
        double range_m[BEAMS];
        for (int i = 0; i < BEAMS; i++)
            CHECK(read_ping(file, extract));
        for (uint32_t i = 0; i < BEAMS; i++) {
            range_m[i] = first_m(&heard[i]);
            set(i, i * GEO_TURN / BEAMS, range_m[i]);
        }
        find();
        for (uint32_t w = 0; w < n_walls; w++)
            printf("# tank, look %d: wall %3.0f deg %.2f m, %u echoes, rms %.3f m, %s\n", look + 1,
                   geo_deg(wall[w].normal_rad), wall[w].distance_m, wall[w].points, wall[w].rms_m,
                   mirrors(&wall[w], range_m) ? "constant depth about its normal" : "no constant depth there");
        for (int k = 0; k < 2; k++) {
            const struct wall *w = wall_near(known[k].normal_deg[look], known[k].distance_m[look]);
            struct count c = {0};
            CHECK(w);
            if (!w)
                continue;
            count_marks(w, known[k].ghost_m, &c);
            printf("# tank, look %d, %s: %d of %d echoes of its ghost suspected, %d of %d of the wall\n", look + 1,
                   known[k].name, c.ghosts_marked, c.ghosts, c.walls_marked, c.walls);
            CHECK(mirrors(w, range_m));
            CHECK_INT(c.walls_marked, 0);
            CHECK(c.ghosts_marked >= known[k].least_suspected[look]);
        }
        CHECK(wall_near(352, 4.26));
    }
    if (file)
        fclose(file);
}

int main(void)
{
    RUN(lines_on_both_sides_of_the_seam_of_pi_are_one);
    RUN(a_room_at_any_angle_has_four_walls_and_four_corners);
    RUN(walls_of_a_room_hold_all_points_up_to_the_corners);
    RUN(two_walls_meet_by_metres_or_by_bearing);
    RUN(a_ghost_lies_a_tank_length_behind_its_wall);
    RUN(a_wall_alone_in_the_water_has_no_opposite_and_a_post_is_no_wall);
    RUN_WITH(TANK, walls_and_ghosts_of_a_tank);
    return test_end();
}
