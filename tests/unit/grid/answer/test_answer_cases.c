/* SPDX-License-Identifier: MIT */
/*
 * test_answer_cases - extreme questions to the grid: obstacles at the body, at the poles and on the seam (Q2), and that
 * asking for more never turns blocked into clear, whatever grows (Q6).
 */
#include <float.h>

#include "tests/lib/sphere_rig.h"

#include "grid/answer/corridor.h"

static const struct sphere_conf usual = {.angular_step_rad = 3 * GEO_PI / 180,
                                         .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                         .max_cells = 20000,
                                         .forget_s = 160,
                                         .blocked_above = 0.6,
                                         .recentre_m = 0.1};

static void start(void)
{
    rig_sphere(&usual);
    now = (struct answer_now){.now_ns = 1000 * SECOND, .pose = pose_identity};
}

/* One beam with an echo at range_m, or with free water only (0), up to free_m. */
static void ping(double az_rad, double el_rad, double range_m, double free_m, double opening_deg)
{
    struct beam_echoes beam = {.az_rad = (float)az_rad,
                               .el_rad = (float)el_rad,
                               .blind_m = 0.05f,
                               .free_to_m = (float)(range_m > 0 ? range_m - 0.02 : free_m),
                               .state = (uint8_t)(range_m > 0 ? BEAM_ECHO : BEAM_SILENT),
                               .n = range_m > 0};
    beam.echo[0] = (struct echo){
        .range_m = (float)range_m, .near_m = (float)range_m - 0.02f, .sd_m = 0.01f, .confidence = 0.9f};
    struct echoes e = {.t_ns = now.now_ns,
                       .n_beams = 1,
                       .range_max_m = 20,
                       .az_aperture_rad = (float)geo_rad(opening_deg),
                       .el_aperture_rad = (float)geo_rad(opening_deg),
                       .pose = now.pose,
                       .max_beams = 1,
                       .beam = &beam};
    sphere_enter(sphere, &e, &mount_identity);
}

static void free_all_around(double free_m)
{
    for (double el_deg = -90; el_deg <= 90; el_deg += 4)
        for (double az_deg = 0; az_deg < 360; az_deg += 4)
            ping(geo_rad(az_deg), geo_rad(el_deg), 0, free_m, 12);
}

struct question {
    double az_rad, el_rad, distance_m, radius_m, half_height_m, margin_m, half_angle_rad, age_s;
};

static enum answer_state by_corridor(const struct question *q)
{
    const struct corridor_body body = {
        .radius_m = q->radius_m, .half_height_m = q->half_height_m, .margin_m = q->margin_m, .near_m = 0.5};
    struct corridor_query query = {.most_m = q->distance_m};
    struct corridor corridor;
    struct answer_now then = now;
    then.now_ns += (uint64_t)(q->age_s * 1e9);
    geo_direction(q->az_rad, q->el_rad, query.direction);
    corridor_look(sphere_picture(sphere), &limits, &then, &body, &query, &corridor);
    if (isfinite(corridor.blocked_m))
        return ANSWER_BLOCKED;
    return corridor.known_m >= q->distance_m - 1e-9 ? ANSWER_CLEAR : ANSWER_UNKNOWN;
}

static enum answer_state by_direction(const struct question *q, bool corridor)
{
    const struct answer_query query = {.az_rad = q->az_rad,
                                       .el_rad = q->el_rad,
                                       .distance_m = q->distance_m,
                                       .corridor = corridor,
                                       .radius_m = q->radius_m + q->margin_m,
                                       .half_angle_rad = q->half_angle_rad};
    struct answer_now then = now;
    struct answer a;
    then.now_ns += (uint64_t)(q->age_s * 1e9);
    answer_direction(sphere_picture(sphere), &limits, &then, &query, &a);
    return a.state;
}

static enum answer_state ask_as(const struct question *q, int way)
{
    return way == 0 ? by_corridor(q) : by_direction(q, way == 1);
}

/* A question for no less: each of the sizes grows or stays. */
static struct question more(const struct question *q, uint64_t *seed)
{
    struct question m = *q;
    double *const size[] = {&m.distance_m, &m.radius_m,       &m.half_height_m,
                            &m.margin_m,   &m.half_angle_rad, &m.age_s};
    static const double step[] = {2, 0.4, 0.3, 0.3, 0.15, 60};
    const uint64_t which = test_random(seed) % 63 + 1;
    for (int i = 0; i < 6; i++)
        if (which >> i & 1)
            *size[i] += step[i] * test_uniform(seed);
    return m;
}

TEST(q6_whatever_grows_blocked_never_becomes_clear)
{
    uint64_t seed = test_seed();
    unsigned states[3] = {0}, bad = 0, worse = 0;
    for (int scene = 0; scene < 3; scene++) {
        start();
        free_all_around(7);
        for (int i = 0; i < 60; i++) {
            now.now_ns += SECOND / 4;
            ping(GEO_TURN * test_uniform(&seed), asin(2 * test_uniform(&seed) - 1),
                 test_uniform(&seed) < 0.7 ? 0.5 + 6 * test_uniform(&seed) : 0, 9 * test_uniform(&seed), 8);
        }
        for (int i = 0; i < 1000; i++) {
            struct question q = {.az_rad = GEO_TURN * test_uniform(&seed),
                                 .el_rad = (test_uniform(&seed) - 0.5) * GEO_PI,
                                 .distance_m = 0.8 + 5 * test_uniform(&seed),
                                 .radius_m = 0.05 + 0.4 * test_uniform(&seed),
                                 .half_height_m = 0.3 * test_uniform(&seed),
                                 .margin_m = 0.3 * test_uniform(&seed),
                                 .half_angle_rad = 0.1 * test_uniform(&seed),
                                 .age_s = 10 * test_uniform(&seed)};
            const int way = i % 3;
            enum answer_state before = ask_as(&q, way);
            for (int step = 0; step < 5; step++) {
                q = more(&q, &seed);
                const enum answer_state state = ask_as(&q, way);
                states[state]++;
                bad += before == ANSWER_BLOCKED && state == ANSWER_CLEAR;
                worse += before == ANSWER_UNKNOWN && state == ANSWER_CLEAR;
                before = state;
            }
        }
    }
    printf("# clear %u, blocked %u, unknown %u; blocked to clear %u, unknown to clear %u\n", states[ANSWER_CLEAR],
           states[ANSWER_BLOCKED], states[ANSWER_UNKNOWN], bad, worse);
    CHECK(states[ANSWER_CLEAR] > 500 && states[ANSWER_BLOCKED] > 500);
    CHECK_INT(bad, 0);
    CHECK_INT(worse, 0);
}

TEST(q2_what_is_at_the_body_at_the_poles_and_on_the_seam_blocks)
{
    static const struct {
        const char *name;
        double az_deg, el_deg, range_m;
    } row[] = {
        {"within the radius", 20, 0, 0.2},     {"at the radius", 20, 0, 0.4},
        {"almost at the centre", 20, 0, 0.06}, {"on the seam", 0, 0, 3},
        {"just before it", 359.999, 0, 3},     {"straight up", 0, 90, 3},
        {"straight up, askew", 77, 90, 3},     {"straight down", 0, -90, 3},
        {"nearly down", 200, -89.9, 3},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start();
        free_all_around(7);
        for (int k = 0; k < 3; k++)
            ping(geo_rad(row[i].az_deg), geo_rad(row[i].el_deg), row[i].range_m, 0, 4);
        struct question q = {.az_rad = geo_rad(row[i].az_deg),
                             .el_rad = geo_rad(row[i].el_deg),
                             .distance_m = 4,
                             .radius_m = 0.4,
                             .half_angle_rad = geo_rad(2)};
        for (int way = 0; way < 3; way++)
            if (ask_as(&q, way) != ANSWER_BLOCKED) {
                printf("%s: asked in way %d\n", row[i].name, way);
                CHECK(false);
            }
    }
}

/* What is uncertain of the vehicle since all was observed, one thing at a time; none of it ever falls. */
enum doubt { PLACE, TURN, DRIFT, SUNK, HEADING, DOUBTS };

static const char *const doubt_name[DOUBTS] = {"place", "attitude", "drift", "depth", "heading"};
static const struct pose posed = {.attitude = {1, 0, 0, 0}, .has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH};

static void doubt_by(enum doubt what, double much)
{
    struct pose *pose = &now.pose;
    double *const part[DOUBTS] = {&pose->uncertain_m, &pose->uncertain_rad, &pose->drift_m[0], &pose->drift_m[1],
                                  &pose->heading_radps};
    *pose = posed;
    *part[what] = much;
}

/* More never makes clear what less did not; what is infinite or no number gives nothing clear, nor does a place that
 * may be anywhere. Of a vehicle that is turned anyhow it is clear all around where it is in all directions. */
TEST(whatever_is_uncertain_at_its_extremes_gives_nothing_clear)
{
    static const double much[] = {0, 5e-324, 1e-9, 0.01, 0.2, 1, 4, 100, 1e9, DBL_MAX, INFINITY};
    static const double distance_m[] = {0.5, 1, 3, 6.5};
    unsigned clear = 0;
    start();
    now.pose = posed;
    now.pose_fresh = true;
    free_all_around(7);
    for (int i = 0; i < 3; i++)
        ping(geo_rad(40), 0, 3, 0, 4);
    now.now_ns += 5 * SECOND; /* so that a heading has drifted */
    for (int what = 0; what < DOUBTS; what++)
        for (size_t d = 0; d < sizeof distance_m / sizeof *distance_m; d++)
            for (int way = 0; way < 3; way++)
                for (int az_deg = 0; az_deg < 360; az_deg += 40) {
                    const struct question q = {.az_rad = geo_rad(az_deg),
                                               .distance_m = distance_m[d],
                                               .radius_m = 0.3,
                                               .half_height_m = 0.2,
                                               .half_angle_rad = 0.02};
                    enum answer_state before = ANSWER_CLEAR;
                    for (size_t i = 0; i < sizeof much / sizeof *much; i++) {
                        doubt_by((enum doubt)what, much[i]);
                        const enum answer_state state = ask_as(&q, way);
                        clear += state == ANSWER_CLEAR;
                        const bool none = isinf(much[i]) || (much[i] >= 100 && (what == PLACE || what == DRIFT));
                        if (state == ANSWER_CLEAR && (before != ANSWER_CLEAR || none)) {
                            printf("%s %g, %d deg, %g m, way %d: clear\n", doubt_name[what], much[i], az_deg,
                                   distance_m[d], way);
                            CHECK(false);
                        }
                        before = state;
                    }
                    doubt_by((enum doubt)what, NAN);
                    if (ask_as(&q, way) == ANSWER_CLEAR) {
                        printf("%s not a number, %d deg, %g m, way %d: clear\n", doubt_name[what], az_deg,
                               distance_m[d], way);
                        CHECK(false);
                    }
                }
    CHECK(clear > 1000);
}

int main(void)
{
    RUN(whatever_is_uncertain_at_its_extremes_gives_nothing_clear);
    RUN(q6_whatever_grows_blocked_never_becomes_clear);
    RUN(q2_what_is_at_the_body_at_the_poles_and_on_the_seam_blocks);
    return test_end();
}
