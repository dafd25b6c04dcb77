/* SPDX-License-Identifier: MIT */
/*
 * test_shape - which tiles a question asks, how far, and what their free water means for it: against points that the
 * question has free, of which none may be left out, and against what is known of thin tiles.
 */
#include "tests/lib/random.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/question.h"

#define TRIALS 400

static uint64_t seed;
static struct ask_question question;
static struct question_shape shape;

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

static void any_direction(double v[3])
{
    geo_direction(between(0, GEO_TURN), asin(between(-1, 1)), v);
}

static void add(double p[3], double t, const double v[3])
{
    for (int k = 0; k < 3; k++)
        p[k] += t * v[k];
}

/* Mostly one end or the other. */
static double extreme(double lo, double hi)
{
    const double at = between(-1, 2);
    return at < 0 ? lo : at > 1 ? hi : lo + at * (hi - lo);
}

/* A vector across the unit vector v, of a length up to 1. */
static void any_across(const double v[3], double out[3])
{
    const double wanted = extreme(0, 1);
    any_direction(out);
    add(out, -geo_dot(out, v), v);
    const double factor = wanted / geo_length(out);
    for (int k = 0; k < 3; k++)
        out[k] *= factor;
}

/* Turned about any axis by up to that. */
static void turn(double p[3], double most_rad)
{
    double across[3], size = geo_length(p), v[3] = {p[0] / size, p[1] / size, p[2] / size};
    any_across(v, across);
    add(v, tan(most_rad * geo_length(across)) / fmax(geo_length(across), 1e-9), across);
    for (int k = 0; k < 3; k++)
        p[k] = size * v[k] / geo_length(v);
}

/* ---- points of questions: from the vehicle, and how far the question must reach to have them ---- */

static double point_of_cone(double p[3])
{
    const double range_m = between(question.near_m, question.to_m);
    memcpy(p, question.axis, sizeof question.axis);
    turn(p, question.half_rad);
    for (int k = 0; k < 3; k++)
        p[k] *= range_m;
    return range_m;
}

static double point_of_corridor(double p[3])
{
    const double way_m = between(0, question.to_m);
    double aside[3];
    any_across(question.axis, aside);
    memset(p, 0, 3 * sizeof *p);
    add(p, way_m, question.axis);
    add(p, question.radius_m, aside);
    return way_m;
}

/* The foremost part of the cylinder with its margin. */
static double front_m(void)
{
    const struct ask_body *b = &question.body;
    const double slope = geo_dot(b->up, question.axis);
    return fabs(slope) * b->half_height_m + sqrt(1 - slope * slope) * b->radius_m + b->margin_m;
}

/* No farther than its margin from the cylinder, wherever that is on its way. */
static double point_of_move(double p[3])
{
    const struct ask_body *b = &question.body;
    const double way_m = between(0, question.to_m - front_m()), carried = extreme(0, 1);
    double aside[3];
    any_across(b->up, aside);
    memset(p, 0, 3 * sizeof *p);
    add(p, way_m, question.axis);
    add(p, b->radius_m, aside);
    add(p, b->half_height_m * extreme(-1, 1), b->up);
    add(p, carried, b->drift_m);
    add(p, -carried * geo_dot(b->drift_m, question.axis), question.axis);
    any_direction(aside);
    add(p, b->margin_m * extreme(0, 1), aside);
    return way_m + front_m();
}

static double point_of_stay(double p[3])
{
    const struct ask_body *b = &question.body;
    const double more_m = between(0, question.to_m);
    double aside[3];
    any_across(b->up, aside);
    memset(p, 0, 3 * sizeof *p);
    add(p, b->radius_m + more_m, aside);
    add(p, (b->half_height_m + more_m) * extreme(-1, 1), b->up);
    const double up_m = fabs(geo_dot(p, b->up));
    return fmax(up_m - b->half_height_m, sqrt(fmax(geo_dot(p, p) - up_m * up_m, 0)) - b->radius_m);
}

static double point_of_band(double p[3], size_t *part)
{
    const struct ask_band *b = &question.band;
    const double range_m = between(question.near_m, question.to_m), el_rad = between(b->lo_rad, b->hi_rad);
    *part = (size_t)between(0, (double)b->parts);
    const double wide = (b->width_rad > 0 ? b->width_rad : GEO_TURN) / (double)b->parts, k = (double)*part;
    const double from_rad = b->width_rad > 0 ? b->from_rad + k * wide : (k - 0.5) * wide;
    geo_direction(from_rad + between(0, wide), el_rad, p);
    quat_rotate(b->attitude, p, p);
    for (int i = 0; i < 3; i++)
        p[i] *= range_m;
    return range_m;
}

static void draw_question(enum ask_kind kind)
{
    question = (struct ask_question){.kind = kind, .near_m = between(0, 1) < 0.3 ? 0.01 : between(0.1, 1)};
    question.to_m = between(1.5, 9);
    question.loose_rad = between(0, 1) < 0.5 ? 0 : between(0, 0.1);
    question.half_rad = between(0, 1) < 0.2 ? between(0, 2.5) : between(0, 0.3);
    question.radius_m = between(0.02, 0.8);
    any_direction(question.axis);
    struct ask_body *b = &question.body;
    any_direction(b->up);
    b->radius_m = between(0.1, 0.4);
    b->half_height_m = between(0.1, 0.4);
    b->margin_m = between(0, 0.2);
    for (int k = 0; k < 3; k++)
        b->drift_m[k] = between(0, 1) < 0.5 ? 0 : between(-0.4, 0.4);
    if (kind == ASK_STAY)
        question.near_m = 0;
    struct ask_band *band = &question.band;
    double axis[3];
    any_direction(axis);
    const double half = between(0, 1) < 0.5 ? 0 : between(0, 0.4);
    band->attitude[0] = cos(half);
    for (int k = 0; k < 3; k++)
        band->attitude[k + 1] = sin(half) * axis[k];
    band->lo_rad = between(-0.6, 0.3);
    band->hi_rad = band->lo_rad + between(0.01, 0.5);
    band->parts = between(0, 1) < 0.3 ? 1 : (size_t)between(2, 80);
    band->from_rad = between(0, GEO_TURN);
    band->width_rad = between(0, 1) < 0.5 ? 0 : fmin(between(0.05, 8), 6.283);
}

static double draw_point(double p[3], size_t *part)
{
    *part = 0;
    return question.kind == ASK_CONE       ? point_of_cone(p)
           : question.kind == ASK_CORRIDOR ? point_of_corridor(p)
           : question.kind == ASK_MOVE     ? point_of_move(p)
           : question.kind == ASK_STAY     ? point_of_stay(p)
                                           : point_of_band(p, part);
}

/* Where the body is already, or behind it while it moves. */
static bool is_own(const double p[3])
{
    const struct ask_body *b = &question.body;
    const double up_m = geo_dot(p, b->up);
    if (question.kind == ASK_MOVE)
        return geo_dot(p, question.axis) <= 0;
    return question.kind == ASK_STAY && fabs(up_m) <= b->half_height_m &&
           geo_dot(p, p) - up_m * up_m <= b->radius_m * b->radius_m;
}

/* Is the root in which the tile lies among those that the question touches? */
static bool is_root_asked(const double v[3])
{
    const struct tile_index root = tiles_at(v, 0);
    uint32_t n;
    const uint32_t first = question_columns(&shape, root.row, &n), columns = tiles_columns(root.row);
    return (root.column + columns - first) % columns < n;
}

static bool is_part_asked(const struct water_tile *tile, size_t part)
{
    const struct question_run run = question_run(&shape, tile);
    return run.n > 0 && (part + shape.parts - run.at) % shape.parts < run.n;
}

TEST(every_point_of_a_question_is_asked_about)
{
    int left_out = 0, too_far = 0, points = 0;
    seed = test_seed();
    for (int i = 0; i < TRIALS; i++)
        for (enum ask_kind kind = ASK_CONE; kind <= ASK_AROUND; kind++) {
            draw_question(kind);
            question_begin(&shape, &question);
            for (int k = 0; k < 12; k++) {
                double p[3];
                size_t part;
                const double measure_m = draw_point(p, &part), range_m = geo_length(p);
                if (range_m <= question.near_m || is_own(p))
                    continue;
                turn(p, question.loose_rad); /* its axes may be turned */
                const double v[3] = {p[0] / range_m, p[1] / range_m, p[2] / range_m};
                const struct tile_index index = tiles_at(v, k % TILES_LEVELS);
                const struct water_tile tile = tiles_cone(&index);
                struct ask_stretch s = {0, 0};
                const bool asked = question_stretch(&shape, &tile, question.to_m, &s);
                points++;
                left_out += !is_root_asked(v) || !is_part_asked(&tile, part) || !asked ||
                            range_m < s.from_m - 1e-9 || range_m > s.to_m + 1e-9;
                too_far += question_measure(&shape, &tile, range_m) > measure_m + 1e-9;
                const struct water_tile ray = {{v[0], v[1], v[2]}, 0};
                too_far += question_measure(&shape, &ray, range_m) > measure_m + 1e-7;
            }
        }
    CHECK_INT(left_out, 0);
    CHECK_INT(too_far, 0);
    CHECK(points > 40 * TRIALS);
}

/* ---- thin tiles, of which it is known how far they are asked ---- */

static struct water_tile thin(double az_deg, double el_deg)
{
    struct water_tile tile = {.half_rad = 0};
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), tile.v);
    return tile;
}

/* Asked from there to there; 0 to 0: not at all. */
#define CHECK_STRETCH(az_deg, el_deg, begin_m, end_m)                                                             \
    do {                                                                                                          \
        const struct water_tile thin_ = thin(az_deg, el_deg);                                                     \
        struct ask_stretch s_ = {0, 0};                                                                           \
        const bool asked_ =                                                                                       \
            question_run(&shape, &thin_).n && question_stretch(&shape, &thin_, question.to_m, &s_);               \
        CHECK(asked_ == ((end_m) > 0));                                                                           \
        CHECK_NEAR(asked_ ? s_.from_m : 0, begin_m, 1e-6, 1e-6);                                                  \
        CHECK_NEAR(asked_ ? s_.to_m : 0, end_m, 1e-6, 1e-6);                                                      \
    } while (0)

static double measure(double az_deg, double el_deg, double free_m)
{
    const struct water_tile tile = thin(az_deg, el_deg);
    return question_measure(&shape, &tile, free_m);
}

static void begin(enum ask_kind kind, double near_m, double to_m)
{
    question = (struct ask_question){.kind = kind, .near_m = near_m, .to_m = to_m, .axis = {1, 0, 0}};
    question.body = (struct ask_body){.up = {0, 0, -1}, .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1};
    question.band = (struct ask_band){.attitude = {1, 0, 0, 0}, .parts = 1};
}

static void go(void)
{
    question_begin(&shape, &question);
}

TEST(a_corridor_is_asked_up_to_its_wall)
{
    const double corner_deg = geo_deg(atan(0.1));
    begin(ASK_CORRIDOR, 0.5, 5);
    question.radius_m = 0.5;
    go();
    for (int side = -1; side <= 1; side += 2) {
        CHECK_STRETCH(side * 3, 0, 0.5, 5 / cos(geo_rad(3)));
        CHECK_STRETCH(0, side * corner_deg, 0.5, hypot(0.5, 5));
        CHECK_STRETCH(side * 30, 0, 0.5, 1);
        CHECK_STRETCH(0, side * 89, 0.5, 0.5 / sin(geo_rad(89)));
        CHECK_STRETCH(side * 91, 0, 0, 0);
        CHECK_NEAR(measure(side * 3, 0, 4), 4 * cos(geo_rad(3)), 1e-6, 0);
        CHECK_NEAR(measure(side * 30, 0, 1.5), sqrt(2.25 - 0.25), 1e-6,
                   0); /* no nearer along it: the wall is there */
        CHECK_NEAR(measure(side * 30, 0, 0.4), 0.4 * cos(geo_rad(30)), 1e-6, 0);
    }
    question.near_m = 1; /* no tile that is farther from the axis reaches so far */
    go();
    CHECK_STRETCH(29, 0, 1, 0.5 / sin(geo_rad(29)));
    CHECK_STRETCH(31, 0, 0, 0);
}

TEST(a_body_is_asked_about_as_far_as_it_sweeps)
{
    begin(ASK_MOVE, 0.5, 5);
    go();
    CHECK_NEAR(shape.front_m, 0.4, 1e-9, 0);
    CHECK_STRETCH(0, 0, 0.5, 5);
    for (int side = -1; side <= 1; side += 2) {
        CHECK_STRETCH(side * 30, 0, 0.5, 0.4 / sin(geo_rad(30)));
        CHECK_STRETCH(0, side * 30, 0.5, 0.3 / sin(geo_rad(30)));
        /* its front is round: what is to the side is as far behind it */
        const double side_m = 0.6 * sin(geo_rad(20)), behind_m = 0.4 - sqrt(0.16 - side_m * side_m);
        CHECK_NEAR(measure(side * 20, 0, 0.6), 0.6 * cos(geo_rad(20)) + behind_m, 1e-6, 0);
        CHECK_NEAR(measure(0, side * 20, 0.6), 0.6 * cos(geo_rad(20)), 1e-6, 0);
    }
    question.body.drift_m[1] = 0.2; /* to the right, and down */
    question.body.drift_m[2] = 0.15;
    question.body.drift_m[0] = 9;
    go();
    CHECK_STRETCH(30, 0, 0.5, 0.6 / sin(geo_rad(30)));
    CHECK_STRETCH(-30, 0, 0.5, 0.4 / sin(geo_rad(30)));
    CHECK_STRETCH(0, -30, 0.5, 0.45 / sin(geo_rad(30)));
    CHECK_STRETCH(0, 30, 0.5, 0.3 / sin(geo_rad(30)));
    CHECK_NEAR(measure(20, 0, 0.5), 0.5 * cos(geo_rad(20)), 1e-6,
               0); /* 0.17 m to the side it may be as far ahead */
    begin(ASK_MOVE, 0, 5);
    go();
    CHECK_STRETCH(0, 0, 0.4, 5); /* but for its own place */
    CHECK_STRETCH(10, 0, 0.4 / cos(geo_rad(10)), 0.4 / sin(geo_rad(10)));
    begin(ASK_MOVE, 0.5, 5); /* upward: it is round on all sides */
    memcpy(question.axis, (double[3]){0, 0, -1}, sizeof question.axis);
    go();
    CHECK_NEAR(shape.front_m, 0.3, 1e-9, 0);
    CHECK_STRETCH(90, 60, 0.5, 0.4 / sin(geo_rad(30)));
    CHECK_NEAR(measure(45, 80, 2), 2 * sin(geo_rad(80)), 1e-6, 0);
}

TEST(a_body_that_stays_is_asked_about_around_it)
{
    begin(ASK_STAY, 0, 1);
    go();
    CHECK_STRETCH(77, 0, 0.3, 1.3);
    CHECK_STRETCH(77, 90, 0.2, 1.2);
    CHECK_STRETCH(77, -20, 0.3 / cos(geo_rad(20)), 1.3 / cos(geo_rad(20)));
    CHECK_STRETCH(77, 70, 0.2 / sin(geo_rad(70)), 1.2 / sin(geo_rad(70)));
    CHECK_STRETCH(77, geo_deg(atan2(1.2, 1.3)), 0.2 / sin(atan2(1.2, 1.3)), hypot(1.2, 1.3));
    CHECK_NEAR(measure(5, 20, 1), cos(geo_rad(20)) - 0.3, 1e-6, 0);
    CHECK_NEAR(measure(5, 80, 1), sin(geo_rad(80)) - 0.2, 1e-6, 0);
    CHECK_NEAR(measure(5, 0, 0.1), 0, 0, 0);
    question.near_m = 0.5;
    go();
    CHECK_STRETCH(77, 0, 0.5, 1.3);
}

TEST(a_cone_and_a_band_are_asked_within_their_rims)
{
    begin(ASK_CONE, 0.5, 5);
    question.half_rad = geo_rad(10);
    go();
    for (int side = -1; side <= 1; side += 2) {
        CHECK_STRETCH(side * 9.9, 0, 0.5, 5);
        CHECK_STRETCH(0, side * 10.1, 0, 0);
    }
    CHECK_NEAR(measure(9, 0, 3), 3, 0, 0);
    question.loose_rad = geo_rad(2);
    go();
    CHECK_STRETCH(11.9, 0, 0.5, 5);
    CHECK_STRETCH(12.1, 0, 0, 0);
    begin(ASK_AROUND, 0.5, 5);
    question.band.lo_rad = geo_rad(-5);
    question.band.hi_rad = geo_rad(10);
    for (int half = 0; half < 2; half++) {
        question.band.width_rad = half ? geo_rad(90) : 0;
        question.band.from_rad = geo_rad(300);
        go();
        CHECK_STRETCH(320, 9.9, 0.5, 5);
        CHECK_STRETCH(29, -4.9, 0.5, 5);
        CHECK_STRETCH(320, 10.1, 0, 0);
        CHECK_STRETCH(29, -5.1, 0, 0);
        CHECK_STRETCH(31, 0, half ? 0 : 0.5, half ? 0 : 5);
        CHECK_STRETCH(299, 0, half ? 0 : 0.5, half ? 0 : 5);
    }
}

/* Of many sectors a thin tile is in one, a wide one in those that it reaches, and the last one is beside the first. */
TEST(a_tile_is_in_the_sectors_that_it_touches)
{
    begin(ASK_AROUND, 0.5, 5);
    question.band.lo_rad = geo_rad(-10);
    question.band.hi_rad = geo_rad(10);
    question.band.parts = 36;
    go();
    for (int az = 0; az < 360; az++) {
        struct water_tile tile = thin(az + 0.5, 0);
        CHECK_INT(question_run(&shape, &tile).n, 1);
        CHECK_INT(question_run(&shape, &tile).at, (az + 5) / 10 % 36);
        tile.half_rad = geo_rad(6);
        const struct question_run wide = question_run(&shape, &tile);
        CHECK(wide.n == 2 || (wide.n == 3 && (az % 10 == 0 || az % 10 == 9)));
        CHECK((wide.at + wide.n + 36 - (size_t)(az + 5) / 10 % 36) % 36 <= wide.n);
    }
    question.band.width_rad = geo_rad(72);
    question.band.from_rad = geo_rad(324);
    go();
    for (int az = 324; az < 396; az++) {
        const struct water_tile tile = thin(az + 0.5, 0);
        CHECK_INT(question_run(&shape, &tile).n, 1);
        CHECK_INT(question_run(&shape, &tile).at, (az - 324) / 2);
    }
}

/* Tiles are asked from where their part of the horizon says, if that is nearer; and what stands upright there is
 * farther along a ray that is not level. */
TEST(a_tile_is_asked_from_the_range_of_its_part_of_the_horizon)
{
    static double level_m[ASK_LEVEL];
    const double part_deg = 360.0 / ASK_LEVEL;
    for (int k = 0; k < ASK_LEVEL; k++)
        level_m[k] = k % 2 ? 0.1 : 0.9;
    begin(ASK_CONE, 0.5, 5);
    question.half_rad = GEO_PI;
    question.level_m = level_m;
    go();
    for (int az = 0; az < 360; az += 90) {
        CHECK_STRETCH(az + 0.5 * part_deg, 0, 0.5, 5);
        CHECK_STRETCH(az + 1.5 * part_deg, 0, 0.1, 5);
        CHECK_STRETCH(az - 0.5 * part_deg, 0, 0.1, 5);
        CHECK_STRETCH(az + 1.5 * part_deg, 60, 0.2, 5);
        CHECK_STRETCH(az + 1.5 * part_deg, -85, 0.5, 5);
        CHECK_STRETCH(az + 0.5 * part_deg, 60, 0.5, 5);
    }
    struct water_tile tile = thin(0.5 * part_deg, 1);
    struct ask_stretch s;
    tile.half_rad = geo_rad(1.1); /* it reaches the horizon, and the part beside it */
    CHECK(question_stretch(&shape, &tile, 5, &s) && s.from_m <= 0.1);
    level_m[3] = 0.9;
    for (int side = 0; side < 2; side++) { /* on either side, and by axes that may be turned */
        tile = thin((side ? 2.5 : 0.5) * part_deg, 1);
        question.loose_rad = 0;
        go();
        CHECK(question_stretch(&shape, &tile, 5, &s) && s.from_m >= 0.5);
        question.loose_rad = geo_rad(1.1);
        go();
        CHECK(question_stretch(&shape, &tile, 5, &s) && s.from_m <= 0.1);
    }
    level_m[3] = 0.1;
    begin(ASK_CORRIDOR, 2, 5); /* and tiles farther to the side reach that */
    question.radius_m = 0.5;
    question.level_m = level_m;
    go();
    CHECK(shape.bound_rad >= GEO_PI / 2);
}

/* And not many more: what is far from it is left out at once. */
TEST(roots_that_are_far_from_a_question_are_not_asked)
{
    seed = test_seed();
    for (int i = 0; i < 60; i++) {
        draw_question(i % 3 == 0 ? ASK_CONE : i % 3 == 1 ? ASK_CORRIDOR : ASK_AROUND);
        question.half_rad = fmin(question.half_rad, 0.3);
        question.near_m = 2;
        question.band.width_rad = between(0.1, 0.4);
        question.band.hi_rad = question.band.lo_rad + 0.2;
        go();
        int far = 0, asked = 0;
        const double cone_rad = i % 3 == 1 ? asin(question.radius_m / 2) : i % 3 == 0 ? question.half_rad : 0.3;
        for (uint32_t row = 0; row < TILES_ROWS; row++)
            for (uint32_t column = 0; column < tiles_columns(row); column++) {
                const struct tile_index index = {0, (uint16_t)row, (uint16_t)column};
                const struct water_tile tile = tiles_cone(&index);
                const double off_rad = acos(fmin(1, geo_dot(tile.v, shape.asked.axis)));
                const bool is_asked = is_root_asked(tile.v);
                asked += is_asked;
                far += is_asked && off_rad > 1.5 * (cone_rad + question.loose_rad) + 4 * tile.half_rad;
            }
        CHECK(asked > 0);
        CHECK(far == 0 || fabs(shape.el_rad) > 0.9);
    }
}

/* The first directions to be asked are the question's middle and its rim, within it. */
TEST(what_is_asked_first_is_in_the_question)
{
    seed = test_seed();
    for (int i = 0; i < 50; i++)
        for (enum ask_kind kind = ASK_CONE; kind <= ASK_AROUND; kind++) {
            double v[3], sum[3] = {0};
            size_t n = 0;
            draw_question(kind);
            question.half_rad = fmin(question.half_rad, 1);
            go();
            for (; question_probe(&shape, n, v); n++) {
                const struct water_tile tile = {{v[0], v[1], v[2]}, 1e-6};
                CHECK_NEAR(geo_length(v), 1, 1e-9, 0);
                CHECK(is_part_asked(&tile, kind == ASK_AROUND ? n / 3 : 0));
                if (kind == ASK_CONE)
                    CHECK_NEAR(geo_dot(v, question.axis), n ? cos(question.half_rad) : 1, 0, 1e-9);
                for (int k = 0; k < 3; k++)
                    sum[k] += n ? v[k] : 0;
                const struct ask_band *band = &question.band;
                double body[3], az, el;
                quat_rotate_inverse(band->attitude, v, body);
                geo_angles(body, &az, &el);
                if (kind != ASK_AROUND)
                    continue;
                const double wide = (band->width_rad > 0 ? band->width_rad : GEO_TURN) / (double)band->parts;
                const double first = band->width_rad > 0 ? band->from_rad + wide / 2 : 0;
                CHECK_NEAR(el, band->lo_rad + (double)(n % 3) / 2 * (band->hi_rad - band->lo_rad), 0, 1e-9);
                CHECK_NEAR(geo_wrap_pi(az - first - (double)(n / 3) * wide), 0, 0, 1e-6);
            }
            if (kind == ASK_CONE) /* the rim's are opposite to each other */
                CHECK_NEAR(geo_length(sum), 4 * cos(question.half_rad), 0, 1e-9);
            CHECK_INT(n, kind == ASK_CONE ? 5 : kind == ASK_STAY ? 0 : kind == ASK_AROUND ? 3 * shape.parts : 1);
        }
}

int main(void)
{
    RUN(every_point_of_a_question_is_asked_about);
    RUN(a_corridor_is_asked_up_to_its_wall);
    RUN(a_body_is_asked_about_as_far_as_it_sweeps);
    RUN(a_body_that_stays_is_asked_about_around_it);
    RUN(a_cone_and_a_band_are_asked_within_their_rims);
    RUN(a_tile_is_in_the_sectors_that_it_touches);
    RUN(a_tile_is_asked_from_the_range_of_its_part_of_the_horizon);
    RUN(roots_that_are_far_from_a_question_are_not_asked);
    RUN(what_is_asked_first_is_in_the_question);
    return test_end();
}
