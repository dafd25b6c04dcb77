/* SPDX-License-Identifier: MIT */
/* test_cast - cast.h against reference tables and against its own definition, cell by cell; cases V1 to V6. */
#include "grid/voxel/cast.h"

#include "core/fault.h"
#include "grid/geometry.h"
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#define SIDE 36 /* cells of the box of most tests */

static const struct lattice_box box = {.size = {SIDE, SIDE, SIDE}};

/* How often each cell was covered. */
struct cover {
    const struct lattice_box *box;
    uint8_t *times;
    size_t cells;
    bool outside;
};

static void take(void *context, const struct cast_spans *spans)
{
    struct cover *c = context;
    const int32_t *size = c->box->size;
    for (int s = 0; s < spans->runs; s++) {
        int32_t i = spans->i[s], j = spans->j[s], k = spans->k[s], n = spans->n[s];
        if (n <= 0)
            continue;
        if (i < 0 || i >= size[0] || j < 0 || j >= size[1] || k < 0 || n > size[2] - k) {
            c->outside = true;
            continue;
        }
        c->cells += (size_t)n;
        for (; n > 0; n--, k++)
            c->times[((size_t)i * (size_t)size[1] + (size_t)j) * (size_t)size[2] + (size_t)k]++;
    }
}

static struct cover cover_of(const struct cast_beam *b, const struct lattice_box *in)
{
    struct cover c = {.box = in};
    c.times = calloc((size_t)in->size[0] * (size_t)in->size[1] * (size_t)in->size[2], 1);
    if (!c.times)
        exit(1);
    cast_run(b, in, take, &c);
    return c;
}

/* Cells whose cover is not what the definition says. */
static size_t wrong_cells(const struct cover *c, const struct cast_beam *b)
{
    const int32_t *size = c->box->size;
    size_t wrong = c->outside;
    for (int32_t i = 0; i < size[0]; i++)
        for (int32_t j = 0; j < size[1]; j++)
            for (int32_t k = 0; k < size[2]; k++) {
                int64_t cell[3] = {c->box->first[0] + i, c->box->first[1] + j, c->box->first[2] + k};
                size_t at = ((size_t)i * (size_t)size[1] + (size_t)j) * (size_t)size[2] + (size_t)k;
                wrong += c->times[at] != (cast_slack(b, cell) >= 0);
            }
    return wrong;
}

static bool equals_definition(const struct cast_beam *b, const struct lattice_box *in, size_t *cells)
{
    struct cover c = cover_of(b, in);
    size_t wrong = wrong_cells(&c, b);
    if (cells)
        *cells += c.cells;
    free(c.times);
    if (wrong)
        printf(
            "%zu cells wrong: shape %d, halves %g %g, near %g far %g tolerance %g, axis %g %g %g, apex %g %g %g\n",
            wrong, b->opening->shape, geo_deg(b->opening->half_az_rad), geo_deg(b->opening->half_el_rad), b->near,
            b->far, b->tolerance, b->axis[0][0], b->axis[0][1], b->axis[0][2],
            (double)b->apex.cell[0] + b->apex.offset[0], (double)b->apex.cell[1] + b->apex.offset[1],
            (double)b->apex.cell[2] + b->apex.offset[2]);
    return wrong == 0;
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

static void random_attitude(uint64_t *seed, double q[4])
{
    quat_from_rpy(GEO_TURN * test_uniform(seed), GEO_PI * (test_uniform(seed) - 0.5),
                  GEO_TURN * test_uniform(seed), q);
}

static const double level[4] = {1, 0, 0, 0};

TEST(openings_are_checked)
{
    static const struct {
        enum cast_shape shape;
        double az_deg, el_deg, tolerance_m;
        bool good;
    } row[] = {
        {CAST_WEDGE, 3, 35, 0, true},      {CAST_WEDGE, 360, 180, 0, true},   {CAST_WEDGE, 361, 35, 0, false},
        {CAST_WEDGE, 3, 181, 0, false},    {CAST_WEDGE, 0, 35, 0, false},     {CAST_WEDGE, NAN, 35, 0, false},
        {CAST_PYRAMID, 180, 35, 0, false}, {CAST_PYRAMID, 170, 170, 0, true}, {CAST_CONE, 360, 0, 0, true},
        {CAST_CONE, -1, 35, 0, false},     {CAST_WEDGE, 3, 35, -0.1, false},  {CAST_WEDGE, 3, 35, NAN, false},
    };
    for (size_t r = 0; r < sizeof row / sizeof row[0]; r++) {
        struct cast_opening o;
        struct fault fault = {""};
        CHECK_INT(cast_opening_init(&o, row[r].shape, geo_rad(row[r].az_deg) / 2, geo_rad(row[r].el_deg) / 2,
                                    row[r].tolerance_m, &fault),
                  row[r].good);
        CHECK_INT(fault.text[0] != '\0', !row[r].good);
    }
}

TEST(V1_nothing_free_is_nothing_cast)
{
    static const double ranges[][2] = {{0, 0}, {0, -1}, {2, 1}, {0, NAN}, {NAN, NAN}, {0, INFINITY}, {0, 1e9}};
    struct cast_opening o = opening(CAST_WEDGE, 3, 35, 0);
    struct lattice_place apex = {{0}, {0.5, 0.5, 0.5}};
    struct cast_beam b;
    for (size_t r = 0; r < sizeof ranges / sizeof ranges[0]; r++)
        CHECK(!cast_aim(
            &b, &o,
            &(struct cast_look){
                .apex = &apex, .attitude = level, .near_m = ranges[r][0], .far_m = ranges[r][1], .voxel_m = 0.1}));
    CHECK(!cast_aim(
        &b, &o, &(struct cast_look){.apex = &apex, .attitude = level, .az_rad = NAN, .far_m = 1, .voxel_m = 0.1}));
    CHECK(!cast_aim(
        &b, &o,
        &(struct cast_look){.apex = &apex, .attitude = level, .el_rad = INFINITY, .far_m = 1, .voxel_m = 0.1}));
    CHECK(cast_aim(&b, &o, &(struct cast_look){.apex = &apex, .attitude = level, .far_m = 1, .voxel_m = 0.1}));
}

TEST(V2_apertures)
{
    static const double az_deg[] = {0.1, 1, 3, 35, 90, 179.9, 180, 270, 359.9, 360};
    static const double el_deg[] = {35, 100, 180};
    static const double rpy_deg[][3] = {{0, 0, 0},   {0, 0, 33}, {10, -8, 120},
                                        {90, 0, 45}, {0, 90, 0}, {0, 45, 10}};
    size_t cells = 0;
    for (size_t a = 0; a < sizeof az_deg / sizeof az_deg[0]; a++)
        for (size_t e = 0; e < sizeof el_deg / sizeof el_deg[0]; e++)
            for (size_t p = 0; p < sizeof rpy_deg / sizeof rpy_deg[0]; p++)
                for (int t = 0; t < 2; t++) {
                    struct cast_opening o = opening(CAST_WEDGE, az_deg[a], el_deg[e], t * 0.05);
                    struct lattice_place apex = {{18, 17, 18}, {0.3, 0.9, 0.51}};
                    struct cast_beam b;
                    double q[4];
                    quat_from_rpy(geo_rad(rpy_deg[p][0]), geo_rad(rpy_deg[p][1]), geo_rad(rpy_deg[p][2]), q);
                    CHECK(cast_aim(
                        &b, &o, &(struct cast_look){.apex = &apex, .attitude = q, .far_m = 2.2, .voxel_m = 0.1}));
                    CHECK(equals_definition(&b, &box, &cells));
                }
    CHECK(cells > 500000);
}

TEST(V2_volume_of_a_wedge)
{
    static const struct lattice_box large = {.size = {160, 160, 160}};
    static const double az_deg[] = {35, 90, 179.9, 180, 270, 359.9, 360};
    for (size_t a = 0; a < sizeof az_deg / sizeof az_deg[0]; a++) {
        struct cast_opening o = opening(CAST_WEDGE, az_deg[a], 35, 0);
        struct lattice_place apex = {{80, 80, 80}, {0.4, 0.2, 0.7}};
        struct cast_beam b;
        CHECK(cast_aim(
            &b, &o,
            &(struct cast_look){.apex = &apex, .attitude = level, .az_rad = 0.3, .far_m = 7.5, .voxel_m = 0.1}));
        struct cover c = cover_of(&b, &large);
        double want = 4.0 / 3 * o.half_az_rad * sin(o.half_el_rad) * 75 * 75 * 75;
        CHECK_NEAR(c.cells, want, 0.02, 0);
        free(c.times);
    }
}

TEST(V3_along_the_axes_from_corners_edges_and_centres)
{
    static const double offset[] = {0, 0.5, 1};
    static const double way[6][2] = {{0, 0}, {90, 0}, {180, 0}, {270, 0}, {0, 90}, {0, -90}};
    static const enum cast_shape shape[] = {CAST_WEDGE, CAST_PYRAMID, CAST_CONE};
    size_t cells = 0;
    for (int s = 0; s < 3; s++)
        for (int w = 0; w < 6; w++)
            for (int at = 0; at < 27; at++)
                for (int width = 0; width < 2; width++) {
                    struct cast_opening o = opening(shape[s], width ? 90 : 3, width ? 90 : 35, 0);
                    struct lattice_place apex = {{18, 18, 18},
                                                 {offset[at % 3], offset[at / 3 % 3], offset[at / 9]}};
                    struct cast_beam b;
                    CHECK(cast_aim(&b, &o,
                                   &(struct cast_look){.apex = &apex,
                                                       .attitude = level,
                                                       .az_rad = geo_rad(way[w][0]),
                                                       .el_rad = geo_rad(way[w][1]),
                                                       .far_m = 2,
                                                       .voxel_m = 0.1}));
                    CHECK(equals_definition(&b, &box, &cells));
                }
    CHECK(cells > 100000);
}

TEST(V5_far_away_is_the_same)
{
    static const int64_t step[3] = {100000000, -99999999, 31415926535};
    uint64_t seed = test_seed();
    size_t cells = 0;
    for (int n = 0; n < 50; n++) {
        struct cast_opening o = opening(CAST_WEDGE, 30 * test_uniform(&seed) + 0.5, 35, 0);
        struct lattice_place apex = {{18, 18, 18},
                                     {test_uniform(&seed), test_uniform(&seed), test_uniform(&seed)}};
        struct lattice_box far_box = box;
        struct cast_beam b;
        double q[4];
        random_attitude(&seed, q);
        CHECK(cast_aim(&b, &o, &(struct cast_look){.apex = &apex, .attitude = q, .far_m = 2.3, .voxel_m = 0.1}));
        struct cover here = cover_of(&b, &box);
        for (int a = 0; a < 3; a++) {
            b.apex.cell[a] += step[a];
            far_box.first[a] += step[a];
        }
        struct cover there = cover_of(&b, &far_box);
        cells += here.cells;
        CHECK(memcmp(here.times, there.times, SIDE * SIDE * SIDE) == 0);
        free(here.times);
        free(there.times);
    }
    CHECK(cells > 1000);
}

TEST(V5_positions_in_metres)
{
    struct lattice_place p;
    CHECK(lattice_place((const double[3]){1e7 + 0.3125, -1e7 - 0.0625, 0}, 0.125, &p));
    CHECK_INT(p.cell[0], 80000002);
    CHECK_NEAR(p.offset[0], 0.5, 0, 1e-7);
    CHECK_INT(p.cell[1], -80000001);
    CHECK_NEAR(p.offset[1], 0.5, 0, 1e-7);
    CHECK(!lattice_place((const double[3]){NAN, 0, 0}, 0.1, &p));
    CHECK(!lattice_place((const double[3]){0, 0, 1e300}, 0.1, &p));
}

TEST(V6_clipped_at_the_box)
{
    uint64_t seed = test_seed();
    static const struct lattice_box thin[] = {
        {.size = {1, SIDE, SIDE}}, {.size = {SIDE, 1, SIDE}}, {.size = {SIDE, SIDE, 1}}, {.size = {5, 6, 7}}};
    size_t within = 0, beyond = 0;
    for (int n = 0; n < 400; n++) {
        struct cast_opening o = opening((enum cast_shape)(n % 3), 1 + 60 * test_uniform(&seed), 35, 0);
        struct lattice_place apex = {{(int64_t)(90 * test_uniform(&seed)) - 20,
                                      (int64_t)(90 * test_uniform(&seed)) - 20,
                                      (int64_t)(56 * test_uniform(&seed)) - 10},
                                     {test_uniform(&seed), test_uniform(&seed), test_uniform(&seed)}};
        struct cast_beam b;
        double q[4], far_m = 2 * test_uniform(&seed) + 0.1;
        if (n % 4 <
            2) { /* short beams from the middle, and long ones from a corner: 80 lie within, most of 80 beyond */
            for (int a = 0; a < 3; a++)
                apex.cell[a] = n % 4 ? SIDE - 1 : SIDE / 2;
            far_m = n % 4 ? 1 + test_uniform(&seed) : 0.1 + test_uniform(&seed);
        }
        random_attitude(&seed, q);
        CHECK(cast_aim(&b, &o, &(struct cast_look){.apex = &apex, .attitude = q, .far_m = far_m, .voxel_m = 0.1}));
        const struct lattice_box *in = n % 5 ? &box : &thin[n / 5 % 4];
        struct cover c = cover_of(&b, in);
        CHECK(wrong_cells(&c, &b) == 0);
        if (in == &box) { /* said to lie within: then nothing is missing of it in a larger box */
            static const struct lattice_box larger = {.first = {-60, -60, -60}, .size = {170, 170, 170}};
            bool all = cast_run(&b, &box, take, &(struct cover){.box = &box, .times = c.times});
            struct cover whole = {.box = &larger, .times = calloc(170 * 170, 170)};
            cast_run(&b, &larger, take, &whole);
            CHECK(!all || whole.cells == c.cells);
            within += all;
            beyond += !all && whole.cells > c.cells;
            free(whole.times);
        }
        free(c.times);
    }
    printf("# %zu within the box, %zu beyond it\n", within, beyond);
    CHECK(within >= 80 && beyond > 20);
}

/* Any beam, anywhere, with any tolerance and blind ball: exactly the definition. */
TEST(equals_the_definition)
{
    uint64_t seed = test_seed();
    size_t cells = 0;
    for (int n = 0; n < 900; n++) {
        enum cast_shape shape = (enum cast_shape)(n % 3);
        double most = shape == CAST_PYRAMID ? 175 : n % 2 ? 40 : 359;
        double tolerance_m = n / 3 % 3 * 0.05;
        struct cast_opening o = opening(shape, 0.2 + most * test_uniform(&seed),
                                        n % 7 ? 0.5 + 60 * test_uniform(&seed) : 175, tolerance_m);
        struct lattice_place apex = {{(int64_t)(SIDE * test_uniform(&seed)), (int64_t)(SIDE * test_uniform(&seed)),
                                      (int64_t)(SIDE * test_uniform(&seed))},
                                     {test_uniform(&seed), test_uniform(&seed), test_uniform(&seed)}};
        double far_m = 0.05 + 4 * test_uniform(&seed), near_m = n % 4 ? 0 : far_m * test_uniform(&seed);
        struct cast_beam b;
        double q[4];
        random_attitude(&seed, q);
        if (n % 5 == 0) /* level, or nearly */
            quat_from_rpy(n % 10 ? 0 : 1e-6, 0, GEO_TURN * test_uniform(&seed), q);
        if (n % 11 == 0) /* the faces of a 35 degree opening upright, or nearly */
            quat_from_rpy(0, geo_rad(72.5 + 1e-5 * (n % 2)), GEO_TURN * test_uniform(&seed), q);
        CHECK(cast_aim(&b, &o,
                       &(struct cast_look){.apex = &apex,
                                           .attitude = q,
                                           .az_rad = GEO_TURN * test_uniform(&seed),
                                           .near_m = near_m,
                                           .far_m = far_m,
                                           .voxel_m = 0.1}));
        CHECK(equals_definition(&b, &box, &cells));
    }
    CHECK(cells > 1000000);
}

/* A head on its side, or nearly: the ends of its opening are upright. */
TEST(on_its_side)
{
    uint64_t seed = test_seed();
    size_t cells = 0;
    for (int n = 0; n < 600; n++) {
        struct cast_opening o =
            opening(CAST_WEDGE, 0.2 + 10 * test_uniform(&seed), 0.5 + 70 * test_uniform(&seed), 0);
        struct lattice_place apex = {{(int64_t)(SIDE * test_uniform(&seed)), (int64_t)(SIDE * test_uniform(&seed)),
                                      (int64_t)(SIDE * test_uniform(&seed))},
                                     {test_uniform(&seed), test_uniform(&seed), test_uniform(&seed)}};
        double far_m = 0.05 + 4 * test_uniform(&seed), near_m = n % 4 ? 0 : far_m * test_uniform(&seed);
        double off_deg = pow(10, -6 + 7 * test_uniform(&seed));
        struct cast_beam b;
        double q[4];
        quat_from_rpy(geo_rad((n % 2 ? 90 : -90) + off_deg), n % 3 ? 0 : geo_rad(off_deg),
                      GEO_TURN * test_uniform(&seed), q);
        CHECK(cast_aim(
            &b, &o,
            &(struct cast_look){.apex = &apex, .attitude = q, .near_m = near_m, .far_m = far_m, .voxel_m = 0.1}));
        CHECK(equals_definition(&b, &box, &cells));
    }
    CHECK(cells > 20000);
}

/* An echo's shell: thin, curved, two runs in most columns. */
TEST(shells)
{
    uint64_t seed = test_seed();
    for (int n = 0; n < 100; n++) {
        struct cast_opening o = opening((enum cast_shape)(n % 3), 3 + 20 * test_uniform(&seed), 35, 0);
        struct lattice_place apex = {{8, 9, 18}, {test_uniform(&seed), test_uniform(&seed), test_uniform(&seed)}};
        double q[4], range_m = 3 * test_uniform(&seed);
        struct cast_beam b;
        quat_from_rpy(0.3 * test_uniform(&seed), 0.3 * test_uniform(&seed), test_uniform(&seed), q);
        CHECK(cast_aim(
            &b, &o,
            &(struct cast_look){
                .apex = &apex, .attitude = q, .near_m = range_m, .far_m = range_m + 0.15, .voxel_m = 0.1}));
        CHECK(equals_definition(&b, &box, NULL));
    }
}

/* Columns of which only the sphere's rim is left, to within rounding:
 * it is no nearer than the column, or a touch farther. */
TEST(rims)
{
    uint64_t seed = test_seed();
    size_t cells = 0;
    for (int n = 0; n < 300; n++) {
        struct lattice_place apex = {{18, 18, 18}, {0.5, 0.5, 0.5}};
        struct cast_opening o = opening((enum cast_shape)(n % 2), 10 + 20 * test_uniform(&seed), 35, 0);
        double i = floor(18 * test_uniform(&seed)), j = floor(18 * test_uniform(&seed)), k = n % 3, q[4];
        double far = sqrt(i * i + j * j + k * k) * (1 + 1e-7 * (2 * test_uniform(&seed) - 1));
        struct cast_beam b;
        quat_from_rpy(0, n % 4 ? 0 : 0.1, atan2(j, i), q);
        if (far > 0 &&
            cast_aim(&b, &o,
                     &(struct cast_look){
                         .apex = &apex, .attitude = q, .near_m = n % 5 ? 0 : far - 2, .far_m = far, .voxel_m = 1}))
            CHECK(equals_definition(&b, &box, &cells));
    }
    CHECK(cells > 20000);
}

static void beam_of_row(const struct table *t, int first, enum cast_shape shape, double near_m, double far_m,
                        double voxel_m, double tolerance_m, struct cast_opening *o, struct cast_beam *b)
{
    double at_m[3], q[4];
    for (int a = 0; a < 3; a++)
        at_m[a] = table_real(t, first + 2 + a);
    for (int a = 0; a < 4; a++)
        q[a] = table_real(t, first + 5 + a);
    *o = opening(shape, table_real(t, first), table_real(t, first + 1), tolerance_m);
    struct lattice_place apex;
    CHECK(lattice_place(at_m, voxel_m, &apex));
    /* The table moves all faces by the tolerance; here the range is what is said. */
    CHECK(cast_aim(b, o,
                   &(struct cast_look){.apex = &apex,
                                       .attitude = q,
                                       .near_m = near_m > 0 ? near_m - tolerance_m : 0,
                                       .far_m = far_m + tolerance_m,
                                       .voxel_m = voxel_m}));
}

TEST(oracle_membership)
{
    struct table t = table_open("tests/oracles/beam_membership.csv");
    int rows = 0, inside = 0;
    while (table_next(&t)) {
        double voxel_m = table_real(&t, 12);
        bool far_off = fabs(table_real(&t, 3)) > 1e5 || fabs(table_real(&t, 4)) > 1e5;
        for (int model = 0; model < 2; model++) {
            int column = 17 + 2 * model;
            bool pyramid_too_wide = model == 1 && (table_real(&t, 1) >= 180 || table_real(&t, 2) >= 180);
            if (t.field[column][0] == '\0' || pyramid_too_wide)
                continue;
            double slack_m = table_real(&t, column + 1);
            struct cast_opening o;
            struct cast_beam b;
            beam_of_row(&t, 1, model ? CAST_PYRAMID : CAST_WEDGE, table_real(&t, 10), table_real(&t, 11), voxel_m,
                        table_real(&t, 13), &o, &b);
            int64_t cell[3] = {table_int(&t, 14), table_int(&t, 15), table_int(&t, 16)};
            double got_m = cast_slack(&b, cell) * voxel_m;
            CHECK_NEAR(got_m, slack_m, 1e-7, far_off ? 1e-8 : 1e-9);
            if (fabs(slack_m) < (far_off ? 1e-8 : 1e-9))
                continue;
            CHECK_INT(got_m >= 0, table_int(&t, column));
            rows++;
            inside += got_m >= 0;
        }
    }
    printf("# %d rows, %d inside\n", rows, inside);
    CHECK(rows > 1000 && inside > 100);
}

/* The table's runs go along i; ours along k: compare cells. Rows that it does not have are empty. */
static void mark_runs(const char *runs, long j, long k, int n, uint8_t *cells)
{
    while (*runs) {
        char *end;
        long from = strtol(runs, &end, 10), to = strtol(end + 1, &end, 10);
        for (long i = from; i <= to; i++)
            cells[(i * n + j) * n + k] = 1;
        runs = end + (*end != '\0');
    }
}

TEST(oracle_spans)
{
    static uint8_t want[2][128 * 128 * 128], doubtful[128 * 128];
    static struct cast_opening o[2];
    struct table t = table_open("tests/oracles/beam_spans.csv");
    struct cast_beam b[2];
    long open_case = -1, rows = 0, cases = 0;
    int n = 0;
    bool has[2] = {false, false};
    for (;;) {
        int more = table_next(&t);
        if (open_case >= 0 && (!more || table_int(&t, 0) != open_case)) {
            struct lattice_box cube = {.size = {n, n, n}};
            for (int model = 0; model < 2; model++) {
                if (!has[model])
                    continue;
                struct cover c = cover_of(&b[model], &cube);
                size_t wrong = 0;
                for (int at = 0; at < n * n * n; at++)
                    wrong += !doubtful[at % (n * n)] && c.times[at] != want[model][at];
                CHECK_INT(wrong, 0);
                free(c.times);
            }
            cases++;
        }
        if (!more)
            break;
        double far_m = table_real(&t, 10), voxel_m = table_real(&t, 12), tolerance_m = table_real(&t, 13);
        if (table_int(&t, 0) != open_case) {
            open_case = table_int(&t, 0);
            n = (int)table_int(&t, 11);
            if (n > 128)
                exit(1);
            memset(want, 0, sizeof want);
            memset(doubtful, 0, sizeof doubtful);
            has[0] = true;
            has[1] = table_real(&t, 1) < 180 && table_real(&t, 2) < 180;
            for (int model = 0; model < 2; model++)
                if (has[model])
                    beam_of_row(&t, 1, model ? CAST_PYRAMID : CAST_WEDGE, 0, far_m, voxel_m, tolerance_m,
                                &o[model], &b[model]);
        }
        long j = table_int(&t, 14), k = table_int(&t, 15);
        doubtful[j * n + k] = table_real(&t, 18) < 1e-9;
        mark_runs(t.field[16], j, k, n, want[0]);
        mark_runs(t.field[17], j, k, n, want[1]);
        rows++;
    }
    printf("# %ld cases, %ld rows\n", cases, rows);
    CHECK(cases == 6 && rows > 400);
}

int main(void)
{
    RUN(openings_are_checked);
    RUN(V1_nothing_free_is_nothing_cast);
    RUN(V2_apertures);
    RUN(V2_volume_of_a_wedge);
    RUN(V3_along_the_axes_from_corners_edges_and_centres);
    RUN(V5_far_away_is_the_same);
    RUN(V5_positions_in_metres);
    RUN(V6_clipped_at_the_box);
    RUN(equals_the_definition);
    RUN(on_its_side);
    RUN(shells);
    RUN(rims);
    RUN(oracle_membership);
    RUN(oracle_spans);
    return test_end();
}
