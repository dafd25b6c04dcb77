/* SPDX-License-Identifier: MIT */
/* test_submap - tiles.h and submap.h: counting, what is saturated, clipping, memory, ageing, the body, and false-free
 * water in rooms. */
#include <sys/mman.h>

#include "grid/voxel/submap.h"

#include "core/fault.h"
#include "grid/geometry.h"
#include "tests/lib/test.h"

#define VOXEL_M 0.1

static const struct lattice_place origin = {{0, 0, 0}, {0.5, 0.5, 0.5}};
static const double level[4] = {1, 0, 0, 0};
static const struct voxel_rule rule = {.threshold = 2, .echo_weight = 4};

/* A map with a pool of its own. */
struct rig {
    struct tiles tiles;
    struct submap map;
    void *pool, *directory;
};

static struct rig *rig_new(uint32_t side, uint32_t n_tiles, uint32_t height, uint32_t planes)
{
    struct rig *r = malloc(sizeof *r);
    if (!r || !(r->pool = malloc(tiles_bytes(n_tiles, height, planes))) ||
        !(r->directory = malloc(submap_bytes(side, height))))
        exit(1);
    tiles_init(&r->tiles, r->pool, n_tiles, height, planes);
    submap_init(&r->map, r->directory, side, &r->tiles, &origin);
    return r;
}

static void rig_free(struct rig *r)
{
    free(r->pool);
    free(r->directory);
    free(r);
}

static struct cast_opening opening(enum cast_shape shape, double az_deg, double el_deg, double tolerance_m)
{
    struct cast_opening o;
    struct fault fault;
    if (!cast_opening_init(&o, shape, geo_rad(az_deg) / 2, geo_rad(el_deg) / 2, tolerance_m, &fault)) {
        printf("%s\n", fault.text);
        exit(1);
    }
    return o;
}

static struct cast_beam beam(const struct cast_opening *o, double az_deg, double near_m, double far_m)
{
    struct cast_beam b;
    if (!cast_aim(&b, o,
                  &(struct cast_look){.apex = &origin,
                                      .attitude = level,
                                      .az_rad = geo_rad(az_deg),
                                      .near_m = near_m,
                                      .far_m = far_m,
                                      .voxel_m = VOXEL_M}))
        exit(1);
    return b;
}

/* Sum of one plane's counts, and its greatest. */
static uint64_t sum(const struct submap *m, enum submap_plane plane, unsigned *greatest)
{
    uint64_t total = 0;
    unsigned most = 0;
    int64_t cell[3];
    for (int32_t i = 0; i < m->box.size[0]; i++)
        for (int32_t j = 0; j < m->box.size[1]; j++)
            for (int32_t k = 0; k < m->box.size[2]; k++) {
                const int32_t at[3] = {i, j, k};
                for (int a = 0; a < 3; a++)
                    cell[a] = m->box.first[a] + at[a];
                unsigned c = submap_count(m, plane, cell);
                total += c;
                most = c > most ? c : most;
            }
    if (greatest)
        *greatest = most;
    return total;
}

TEST(boxes_lie_on_whole_tiles_around_their_base)
{
    struct rig *r = rig_new(3, 1, 20, 1);
    for (int64_t at = -100000000040; at < -100000000000; at++) {
        struct lattice_place base = {{at, -at, at / 3}, {0, 0, 0}};
        submap_init(&r->map, r->directory, 3, &r->tiles, &base);
        for (int a = 0; a < 2; a++) {
            CHECK_INT(r->map.box.first[a] % TILE_SIDE, 0);
            int64_t before = base.cell[a] - r->map.box.first[a];
            CHECK(before >= 16 && before < 32);
        }
        CHECK(lattice_holds(&r->map.box, base.cell));
    }
    rig_free(r);
}

TEST(V4_counts_once_per_beam_and_stops_at_255)
{
    struct rig *r = rig_new(6, 36, 64, 1);
    struct cast_opening o = opening(CAST_WEDGE, 20, 35, 0);
    struct cast_beam b = beam(&o, 30, 0, 3);
    unsigned most;
    submap_cast(&r->map, &b, SUBMAP_VACANCY);
    uint64_t cells = sum(&r->map, SUBMAP_VACANCY, &most);
    CHECK(cells > 500);
    CHECK_INT(most, 1);
    submap_cast(&r->map, &b, SUBMAP_VACANCY);
    CHECK_INT(sum(&r->map, SUBMAP_VACANCY, &most), 2 * cells);
    for (int n = 2; n < 300; n++)
        submap_cast(&r->map, &b, SUBMAP_VACANCY);
    CHECK_INT(sum(&r->map, SUBMAP_VACANCY, &most), 255 * cells);
    CHECK_INT(most, 255);
    CHECK_INT(r->map.stats.clipped, 0);
    CHECK_INT(r->map.stats.starved, 0);
    rig_free(r);
}

TEST(counts_exactly_what_the_definition_says)
{
    uint64_t seed = test_seed();
    struct rig *r = rig_new(4, 16, 50, 2);
    for (int n = 0; n < 60; n++) {
        struct cast_opening o = opening((enum cast_shape)(n % 3), 1 + 100 * test_uniform(&seed),
                                        1 + 100 * test_uniform(&seed), n % 2 * 0.05);
        struct cast_beam b;
        double q[4];
        quat_from_rpy(test_uniform(&seed), test_uniform(&seed), 6 * test_uniform(&seed), q);
        enum submap_plane plane = n % 4 ? SUBMAP_VACANCY : SUBMAP_ECHOES;
        CHECK(cast_aim(&b, &o,
                       &(struct cast_look){.apex = &origin,
                                           .attitude = q,
                                           .near_m = n % 5 ? 0 : 1,
                                           .far_m = 1 + 3 * test_uniform(&seed),
                                           .voxel_m = VOXEL_M}));
        submap_cast(&r->map, &b, plane);
        int64_t wrong = 0, cell[3];
        for (cell[0] = -40; cell[0] < 40; cell[0]++)
            for (cell[1] = -40; cell[1] < 40; cell[1]++)
                for (cell[2] = -30; cell[2] < 30; cell[2]++) {
                    bool in = lattice_holds(&r->map.box, cell) && cast_slack(&b, cell) >= 0;
                    wrong += submap_count(&r->map, plane, cell) != in;
                    wrong += submap_count(&r->map, !plane, cell) != 0;
                }
        CHECK_INT(wrong, 0);
        submap_clear(&r->map);
    }
    CHECK_INT(r->tiles.n_free, 16);
    rig_free(r);
}

/* Every tile is taken; its columns are near 255, some all at it. */
static void nearly_saturate(struct rig *r, uint64_t *seed)
{
    const size_t entries = (size_t)(r->map.box.size[0] / TILE_SIDE * r->map.box.size[1] / TILE_SIDE);
    for (size_t e = 0; e < entries; e++) {
        if (r->map.tile[e] == TILE_NONE)
            r->map.tile[e] = tiles_take(&r->tiles);
        uint8_t *count = tiles_column(&r->tiles, r->map.tile[e], 0, 0);
        const bool full = test_uniform(seed) < 0.3;
        for (size_t c = 0; c < r->tiles.tile_bytes; c += r->tiles.height) {
            const double mixed = full ? 0 : floor(3 * test_uniform(seed)) / 2;
            for (size_t k = 0; k < r->tiles.height; k++)
                count[c + k] = (uint8_t)(test_uniform(seed) < mixed ? 253 + 3 * test_uniform(seed) : 255);
        }
    }
}

/* When a tile was last marked. */
static uint64_t newest_stamp(const struct submap *m, size_t entry)
{
    uint64_t newest = 0;
    for (uint32_t s = 0; s < m->slices; s++)
        newest = m->written[entry * m->slices + s] > newest ? m->written[entry * m->slices + s] : newest;
    return newest;
}

/* Cells where a beam does not leave what a slow one would: those that it covers a count higher, up to 255. Sets which
 * slices of tiles it changed. */
static int64_t off_reference(const struct rig *r, const struct cast_beam *b, enum submap_plane plane,
                             const uint8_t *before, bool *changed)
{
    const struct submap *m = &r->map;
    int64_t wrong = 0;
    for (int32_t i = 0; i < m->box.size[0]; i++)
        for (int32_t j = 0; j < m->box.size[1]; j++)
            for (int32_t k = 0; k < m->box.size[2]; k++) {
                const size_t entry = submap_entry(m, i, j);
                const uint8_t *now = tiles_column(&r->tiles, m->tile[entry], submap_column(i, j), plane) + k;
                const uint8_t was = before[now - r->tiles.bytes];
                const int64_t cell[3] = {m->box.first[0] + i, m->box.first[1] + j, m->box.first[2] + k};
                const bool rises = was < 255 && cast_slack(b, cell) >= 0;
                wrong += *now != was + rises;
                changed[entry * m->slices + submap_slice(m, k)] |= rises;
            }
    return wrong;
}

/* Whatever is saturated, counts are those of a slow map, and a tile is marked exactly when one of its counts changed:
 * in every slice where one did. */
TEST(what_is_saturated_neither_changes_nor_marks)
{
    enum { SIDE = 4, TILES = SIDE * SIDE, HEIGHT = 70, SLICES = 3 };
    uint64_t seed = test_seed();
    struct rig *r = rig_new(SIDE, TILES, HEIGHT, 2);
    const size_t bytes = TILES * r->tiles.tile_bytes;
    uint8_t *before = malloc(bytes);
    int marked = 0, spared = 0;
    for (uint64_t n = 1; n <= 30; n++) {
        const enum submap_plane plane = n % 3 ? SUBMAP_VACANCY : SUBMAP_ECHOES;
        struct cast_opening o = opening((enum cast_shape)(n % 2 * 2), 5 + 60 * test_uniform(&seed), 60, 0);
        struct cast_beam b = beam(&o, 360 * test_uniform(&seed), n % 5 ? 0 : 1, 1 + 3 * test_uniform(&seed));
        bool changed[TILES * SLICES] = {false};
        uint64_t stamps[TILES * SLICES];
        nearly_saturate(r, &seed);
        memcpy(before, r->tiles.bytes, bytes);
        memcpy(stamps, r->map.written, sizeof stamps);
        r->map.now = n;
        submap_cast(&r->map, &b, plane);
        CHECK_INT(r->map.slices, SLICES);
        CHECK_INT(off_reference(r, &b, plane, before, changed), 0);
        for (int t = 0; t < TILES; t++) {
            bool any = false;
            for (int s = t * SLICES; s < (t + 1) * SLICES; s++) {
                any |= changed[s];
                CHECK(!changed[s] || r->map.written[s] == n);
            }
            for (int s = t * SLICES; !any && s < (t + 1) * SLICES; s++)
                CHECK_INT(r->map.written[s], stamps[s]);
            marked += any;
            spared += !any;
        }
        for (size_t at = 0; at < bytes; at++) /* the other plane */
            if (at / r->tiles.plane_bytes % 2 != plane && before[at] != r->tiles.bytes[at])
                CHECK_INT(at, -1);
    }
    CHECK(marked > 50 && spared > 50);
    free(before);
    rig_free(r);
}

/* A store would end the test: the memory may only be read. */
TEST(what_is_saturated_is_not_written_to)
{
    const uint32_t heights[] = {20, 32, 33, 64, 100};
    for (size_t h = 0; h < sizeof heights / sizeof heights[0]; h++) {
        struct rig *r = rig_new(4, 16, heights[h], 2);
        const size_t bytes = tiles_bytes(16, heights[h], 2);
        void *pool = mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        CHECK(pool != MAP_FAILED);
        tiles_init(&r->tiles, pool, 16, heights[h], 2);
        for (int e = 0; e < 16; e++)
            r->map.tile[e] = tiles_take(&r->tiles);
        memset(r->tiles.bytes, 255, 16 * r->tiles.tile_bytes);
        CHECK(mprotect(pool, bytes, PROT_READ) == 0);
        r->map.now = 1;
        for (int n = 0; n < 30; n++) {
            struct cast_opening o = opening((enum cast_shape)(n % 3), 3 + n, 35 + n, 0);
            struct cast_beam b = beam(&o, 12 * n, 0, 3);
            submap_cast(&r->map, &b, n % 2 ? SUBMAP_VACANCY : SUBMAP_ECHOES);
        }
        submap_body(&r->map, &origin, &origin, 5, 200);
        for (size_t e = 0; e < 16; e++)
            CHECK_INT(newest_stamp(&r->map, e), 0);
        munmap(pool, bytes);
        rig_free(r);
    }
}

TEST(V6_clipped_and_counted)
{
    struct rig *r = rig_new(2, 4, 16, 1); /* 3.2 x 3.2 x 1.6 m */
    struct cast_opening o = opening(CAST_WEDGE, 3, 35, 0);
    struct cast_beam b = beam(&o, 0, 0, 0.5);
    submap_cast(&r->map, &b, SUBMAP_VACANCY);
    CHECK_INT(r->map.stats.clipped, 0);
    b = beam(&o, 0, 0, 50);
    submap_cast(&r->map, &b, SUBMAP_VACANCY);
    CHECK_INT(r->map.stats.clipped, 1);
    b.apex.cell[2] = 1000000;
    uint64_t before = sum(&r->map, SUBMAP_VACANCY, NULL);
    submap_cast(&r->map, &b, SUBMAP_VACANCY);
    CHECK_INT(r->map.stats.clipped, 2);
    CHECK_INT(sum(&r->map, SUBMAP_VACANCY, NULL), before);
    rig_free(r);
}

TEST(an_exhausted_pool_is_counted_and_shared)
{
    struct rig *r = rig_new(8, 2, 64, 1);
    struct cast_opening o = opening(CAST_WEDGE, 60, 35, 0);
    struct cast_beam b = beam(&o, 0, 0, 5);
    submap_cast(&r->map, &b, SUBMAP_VACANCY);
    CHECK(r->map.stats.starved > 0);
    CHECK_INT(r->map.n_tiles, 2);
    CHECK_INT(r->tiles.n_free, 0);
    CHECK(sum(&r->map, SUBMAP_VACANCY, NULL) > 0);
    submap_clear(&r->map);
    CHECK_INT(r->tiles.n_free, 2);
    CHECK_INT(sum(&r->map, SUBMAP_VACANCY, NULL), 0);
    b = beam(&o, 180, 0, 0.3);
    submap_cast(&r->map, &b, SUBMAP_VACANCY); /* taken again: empty */
    unsigned most;
    CHECK(sum(&r->map, SUBMAP_VACANCY, &most) > 0);
    CHECK_INT(most, 1);
    rig_free(r);
}

TEST(sizes_are_checked)
{
    CHECK_INT(tiles_bytes(0, 10, 1), 0);
    CHECK_INT(tiles_bytes(10, 0, 1), 0);
    CHECK_INT(tiles_bytes(10, 10, 3), 0);
    CHECK_INT(tiles_bytes(UINT32_MAX, 1, 1), 0);
    CHECK_INT(tiles_bytes(1u << 31, 1u << 20, 2), 0);
    CHECK(tiles_bytes(10, 10, 2) >= 10 * 256 * 10 * 2);
    CHECK_INT(submap_bytes(0, 10), 0);
    CHECK_INT(submap_bytes(4097, 10), 0);
    CHECK_INT(submap_bytes(10, 0), 0);
    CHECK_INT(submap_bytes(10, (1u << 20) + 1), 0);
}

TEST(ageing_halves)
{
    struct rig *r = rig_new(4, 16, 32, 2);
    struct cast_opening o = opening(CAST_WEDGE, 20, 35, 0);
    struct cast_beam b = beam(&o, 30, 0, 1.5);
    int64_t cell[3] = {5, 3, 0};
    for (int n = 0; n < 7; n++) {
        submap_cast(&r->map, &b, SUBMAP_VACANCY);
        submap_cast(&r->map, &b, SUBMAP_ECHOES);
    }
    for (int want = 7; want > 0; want /= 2) {
        CHECK_INT(submap_count(&r->map, SUBMAP_VACANCY, cell), want);
        CHECK_INT(submap_count(&r->map, SUBMAP_ECHOES, cell), want < 7 ? want + 1 : 7); /* 7, 4, 2: rounded up */
        submap_halve(&r->map);
    }
    CHECK_INT(sum(&r->map, SUBMAP_VACANCY, NULL), 0);
    CHECK_INT(submap_count(&r->map, SUBMAP_ECHOES, cell), 1);
    rig_free(r);
}

TEST(free_unknown_and_occupied)
{
    static const struct {
        const char *name;
        uint32_t vacancy, echoes;
        enum voxel_state want;
    } row[] = {
        {"never looked at", 0, 0, VOXEL_UNKNOWN},
        {"at the threshold", 2, 0, VOXEL_UNKNOWN},
        {"above the threshold", 3, 0, VOXEL_FREE},
        {"heard", 0, 1, VOXEL_OCCUPIED},
        {"one echo in six sweeps", 6, 1, VOXEL_OCCUPIED},
        {"one echo in seven sweeps", 7, 1, VOXEL_FREE},
        {"a line heard each turn", 255, 80, VOXEL_OCCUPIED},
        {"merged, saturated", 65535, 65535, VOXEL_OCCUPIED},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        CHECK_INT(voxel_judge(&rule, row[i].vacancy, row[i].echoes), row[i].want);
        if (test_case_failed)
            printf("(%s)\n", row[i].name);
    }
    struct rig *r = rig_new(2, 4, 16, 1);
    CHECK_INT(submap_count(&r->map, SUBMAP_VACANCY, (const int64_t[3]){0, 0, 0}), 0);
    CHECK_INT(submap_count(&r->map, SUBMAP_VACANCY, (const int64_t[3]){INT64_MAX, INT64_MIN, 0}), 0);
    rig_free(r);
}

TEST(the_body_is_free)
{
    struct rig *r = rig_new(4, 16, 32, 1);
    struct lattice_place stern = {{-6, 1, 0}, {0.2, 0.5, 0.5}}, bow = {{6, -1, 2}, {0.9, 0.5, 0.5}};
    double d[3], from[3];
    for (int a = 0; a < 3; a++) {
        from[a] = (double)stern.cell[a] + stern.offset[a];
        d[a] = (double)bow.cell[a] + bow.offset[a] - from[a];
    }
    r->map.now = 7;
    submap_body(&r->map, &stern, &bow, 3, 200);
    int64_t cell[3];
    int inside = 0, wrong = 0;
    for (cell[0] = -30; cell[0] < 30; cell[0]++)
        for (cell[1] = -30; cell[1] < 30; cell[1]++)
            for (cell[2] = -16; cell[2] < 16; cell[2]++) {
                double least = INFINITY;
                for (int n = 0; n <= 20000 && least > 8.9; n += n < 20000 ? 100 : 1) {
                    double square = 0;
                    for (int a = 0; a < 3; a++) {
                        double v = (double)cell[a] + 0.5 - from[a] - n * 5e-5 * d[a];
                        square += v * v;
                    }
                    least = fmin(least, square);
                }
                int got = submap_count(&r->map, SUBMAP_VACANCY, cell);
                wrong += least <= 8.9 && got != 200;
                wrong += least > 9.1 && got != 0;
                inside += got == 200;
            }
    CHECK_INT(wrong, 0);
    CHECK(inside > 300);
    CHECK_INT(r->map.stats.clipped, 0);
    r->map.now = 8;
    submap_body(&r->map, &stern, &bow, 2, 100); /* never lowers */
    CHECK_INT(submap_count(&r->map, SUBMAP_VACANCY, (const int64_t[3]){0, 0, 0}), 200);
    for (size_t e = 0; e < 16; e++)
        CHECK_INT(newest_stamp(&r->map, e), r->map.tile[e] == TILE_NONE ? 0 : 7);
    submap_body(&r->map, &stern, &bow, 1000, 1);
    CHECK_INT(r->map.stats.clipped, 1);
    submap_body(&r->map, &stern, &bow, NAN, 1);
    rig_free(r);
}

/* ---- rooms ---- */

/* A box room, turned about the vertical; the sonar sits at its origin. */
struct room {
    double lo[3], hi[3], cos_turn, sin_turn;
};

static struct room random_room(uint64_t *seed)
{
    double turn = 7 * test_uniform(seed);
    struct room r = {.cos_turn = cos(turn), .sin_turn = sin(turn)};
    for (int a = 0; a < 3; a++) {
        r.lo[a] = -(0.6 + 2 * test_uniform(seed));
        r.hi[a] = 0.6 + 2 * test_uniform(seed);
    }
    return r;
}

/* How far the wall stands from a place (m): positive in the room. */
static double room_depth(const struct room *r, const double p[3])
{
    double q[3] = {r->cos_turn * p[0] + r->sin_turn * p[1], r->cos_turn * p[1] - r->sin_turn * p[0], p[2]};
    double depth = INFINITY;
    for (int a = 0; a < 3; a++)
        depth = fmin(depth, fmin(q[a] - r->lo[a], r->hi[a] - q[a]));
    return depth;
}

/* No point of the beam that is nearer than this is behind a wall: per wall its distance over the cosine of the least
 * angle that any ray of the beam, which lies in a cone around its axis, can have to its normal. */
static double first_wall(const struct room *r, const struct cast_beam *b)
{
    const struct cast_opening *o = b->opening;
    double least = INFINITY;
    double cos_half = cos(o->half_el_rad) * cos(o->half_az_rad);
    for (int wall = 0; wall < 6; wall++) {
        double s = wall % 2 ? 1 : -1, n[3] = {0};
        double away = wall % 2 ? r->hi[wall / 2] : -r->lo[wall / 2];
        if (wall / 2 == 0)
            n[0] = s * r->cos_turn, n[1] = s * r->sin_turn;
        else if (wall / 2 == 1)
            n[0] = -s * r->sin_turn, n[1] = s * r->cos_turn;
        else
            n[2] = s;
        double along = b->axis[0][0] * n[0] + b->axis[0][1] * n[1] + b->axis[0][2] * n[2];
        double angle = acos(fmax(-1, fmin(1, along))) - acos(cos_half); /* at least this far from its normal */
        double cos_least = angle <= 0 ? 1 : cos(angle);
        if (cos_least > 1e-9)
            least = fmin(least, away / cos_least);
    }
    return least;
}

static void sweep(struct submap *m, const struct room *room, const struct cast_opening *o, uint64_t *seed,
                  int pings, double noise_m)
{
    for (int n = 0; n < pings; n++) {
        struct cast_beam b;
        double q[4];
        quat_from_rpy(0.4 * (test_uniform(seed) - 0.5), 0.4 * (test_uniform(seed) - 0.5), GEO_TURN * n / pings, q);
        cast_aim(&b, o, &(struct cast_look){.apex = &origin, .attitude = q, .far_m = 1, .voxel_m = VOXEL_M});
        double range_m = first_wall(room, &b) + noise_m * (2 * test_uniform(seed) - 1);
        if (cast_aim(&b, o,
                     &(struct cast_look){.apex = &origin, .attitude = q, .far_m = range_m, .voxel_m = VOXEL_M}))
            submap_cast(m, &b, SUBMAP_VACANCY);
    }
}

/* Cells counted, and those of them whose centre lies more than allowed_m behind a wall. */
static int behind_walls(const struct submap *m, const struct room *room, double allowed_m, int *counted)
{
    int behind = 0;
    int64_t cell[3];
    *counted = 0;
    for (cell[0] = -40; cell[0] < 40; cell[0]++)
        for (cell[1] = -40; cell[1] < 40; cell[1]++)
            for (cell[2] = -32; cell[2] < 32; cell[2]++) {
                if (!submap_count(m, SUBMAP_VACANCY, cell))
                    continue;
                double p[3] = {(double)cell[0] * VOXEL_M, (double)cell[1] * VOXEL_M, (double)cell[2] * VOXEL_M};
                ++*counted;
                behind += room_depth(room, p) < -1e-9 - allowed_m;
            }
    return behind;
}

TEST(V11_no_water_behind_walls)
{
    uint64_t seed = test_seed();
    struct rig *r = rig_new(6, 36, 64, 1);
    for (int n = 0; n < 40; n++) {
        struct room room = random_room(&seed);
        enum cast_shape shape = n % 4 == 3 ? CAST_CONE : CAST_WEDGE;
        struct cast_opening o = opening(shape, 2 + 20 * test_uniform(&seed), shape == CAST_CONE ? 1 : 35, 0);
        int counted;
        if (shape == CAST_CONE)
            o.half_el_rad = 0;
        sweep(&r->map, &room, &o, &seed, 100, 0);
        CHECK_INT(behind_walls(&r->map, &room, 0, &counted), 0);
        CHECK(counted > 300);
        submap_clear(&r->map);
    }
    rig_free(r);
}

TEST(V11_noise_goes_no_deeper_than_itself)
{
    uint64_t seed = test_seed();
    struct rig *r = rig_new(6, 36, 64, 1);
    int at_all = 0;
    for (int n = 0; n < 20; n++) {
        struct room room = random_room(&seed);
        struct cast_opening o = opening(CAST_WEDGE, 3, 35, 0);
        int counted;
        sweep(&r->map, &room, &o, &seed, 200, 0.1);
        CHECK_INT(behind_walls(&r->map, &room, 0.1, &counted), 0);
        at_all += behind_walls(&r->map, &room, 0, &counted);
        submap_clear(&r->map);
    }
    CHECK(at_all > 0); /* else the test could not fail */
    rig_free(r);
}

TEST(V12_without_echo_free_to_what_was_said)
{
    struct rig *r = rig_new(6, 36, 64, 1);
    struct cast_opening o = opening(CAST_WEDGE, 3, 35, 0);
    for (int n = 0; n < 200; n++) {
        struct cast_beam b = beam(&o, n * 1.8, 0, 1);
        submap_cast(&r->map, &b, SUBMAP_VACANCY);
    }
    int64_t cell[3];
    int beyond = 0, within = 0;
    for (cell[0] = -40; cell[0] < 40; cell[0]++)
        for (cell[1] = -40; cell[1] < 40; cell[1]++)
            for (cell[2] = -32; cell[2] < 32; cell[2]++) {
                double r2 = (double)(cell[0] * cell[0] + cell[1] * cell[1] + cell[2] * cell[2]);
                bool counted = submap_count(&r->map, SUBMAP_VACANCY, cell);
                beyond += counted && r2 > 100;
                within += counted;
            }
    CHECK_INT(beyond, 0);
    CHECK(within > 1000);
    rig_free(r);
}

int main(void)
{
    RUN(boxes_lie_on_whole_tiles_around_their_base);
    RUN(V4_counts_once_per_beam_and_stops_at_255);
    RUN(counts_exactly_what_the_definition_says);
    RUN(what_is_saturated_neither_changes_nor_marks);
    RUN(what_is_saturated_is_not_written_to);
    RUN(V6_clipped_and_counted);
    RUN(an_exhausted_pool_is_counted_and_shared);
    RUN(sizes_are_checked);
    RUN(ageing_halves);
    RUN(free_unknown_and_occupied);
    RUN(the_body_is_free);
    RUN(V11_no_water_behind_walls);
    RUN(V11_noise_goes_no_deeper_than_itself);
    RUN(V12_without_echo_free_to_what_was_said);
    return test_end();
}
