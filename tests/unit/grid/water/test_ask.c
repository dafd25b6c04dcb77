/* SPDX-License-Identifier: MIT */
/*
 * test_ask - what is said to be free, against every ping by itself: a sonar on a vehicle that moves, turns and tilts
 * pings in made-up water, its pings become records, and points in what a question calls free are looked up in all of
 * the pings, from the newest to the oldest, in plain double arithmetic that knows nothing of records and tiles.
 */
#include "tests/lib/ask_free.h"
#include "tests/lib/test.h"

#include "grid/geometry.h"
#include "grid/water/store.h"

#define PINGS   800
#define BEAMS   96
#define RANGE_M 12.0
#define NEAR_M  0.4
#define FADE    0.8 /* the edge of a beam detects so much less far, where nothing echoes */

static uint64_t seed;

/* In the gate one world of each kind. */
static bool is_long(void)
{
    return getenv("LONG") != NULL;
}

static double uniform(double low, double high)
{
    return low + (high - low) * test_uniform(&seed);
}

/* ---- the water ---- */

struct post {
    double north, east, radius;
};
static struct post post[16];
static int posts;
static double seen_share; /* of the pings, in which a rope echoes */

static void furnish(void)
{
    posts = 0;
    for (int i = 0; i < 12; i++) {
        const double az = uniform(0, GEO_TURN), away = uniform(3, 11);
        post[posts++] = (struct post){away * cos(az), away * sin(az), i % 3 ? uniform(0.05, 0.3) : 0.02};
    }
}

static bool in_post(const double p[3])
{
    for (int i = 0; i < posts; i++)
        if (hypot(p[0] - post[i].north, p[1] - post[i].east) < post[i].radius)
            return true;
    return false;
}

/* How far a ray from p goes; RANGE_M: farther. */
static double cast(const double p[3], const double u[3], uint32_t unseen)
{
    const double level2 = u[0] * u[0] + u[1] * u[1];
    double nearest = RANGE_M;
    for (int i = 0; i < posts && level2 > 0; i++) {
        const double x = post[i].north - p[0], y = post[i].east - p[1], along = x * u[0] + y * u[1];
        const double root2 = along * along - level2 * (x * x + y * y - post[i].radius * post[i].radius);
        if (!(unseen >> i & 1) && root2 > 0 && along > sqrt(root2))
            nearest = fmin(nearest, (along - sqrt(root2)) / level2);
    }
    return nearest;
}

/* ---- pings ---- */

struct sonar {
    const char *name;
    int beams;       /* of a ping */
    double step_deg; /* between its beams, or a head's pings */
    double wide_deg, high_deg;
    bool turns;
    double mps, yaw_dps, tilt_deg;
};

struct beam {
    double az, axis_m, side_m, edge_m;
    bool echo;
};
static struct ping {
    double place[3], attitude[4], axis[3][3]; /* ahead, right, down in NED */
    double path_m;
    double half_az, half_el;
    int n;
    struct beam beam[BEAMS];
} ping[PINGS];
static int pings;

static void to_frame(const double place[3], const double axis[3][3], const double p[3], double v[3])
{
    const double w[3] = {p[0] - place[0], p[1] - place[1], p[2] - place[2]};
    for (int k = 0; k < 3; k++)
        v[k] = geo_dot(w, axis[k]);
}

/* The nearest that a beam of the ping may hear in all of its opening. */
static double heard_by(const struct ping *p, double az, uint32_t unseen)
{
    double nearest = RANGE_M;
    for (int j = -2; j <= 2; j++)
        for (int i = -6; i <= 6; i++) {
            double v[3], u[3];
            geo_direction(az + i * p->half_az / 6, j * p->half_el / 2, v);
            for (int k = 0; k < 3; k++)
                u[k] = v[0] * p->axis[0][k] + v[1] * p->axis[1][k] + v[2] * p->axis[2][k];
            nearest = fmin(nearest, cast(p->place, u, unseen));
        }
    return nearest;
}

static void sound(const struct sonar *s, struct ping *p, double turned)
{
    uint32_t unseen = 0;
    for (int i = 0; i < posts; i++)
        unseen |= (uint32_t)(post[i].radius < 0.03 && uniform(0, 1) >= seen_share) << i;
    p->half_az = geo_rad(s->wide_deg / 2);
    p->half_el = geo_rad(s->high_deg / 2);
    p->n = s->beams;
    for (int i = 0; i < s->beams; i++) {
        const double az = s->turns ? turned : (i - (s->beams - 1) / 2.0) * geo_rad(s->step_deg);
        const double range = heard_by(p, az, unseen);
        const bool echo = range < RANGE_M;
        const double to = echo ? range - uniform(0.02, 0.08) : RANGE_M;
        p->beam[i] = (struct beam){az, to, fmin(to, RANGE_M * 0.9), fmin(to, RANGE_M * FADE), echo};
    }
}

/* A head's frame turns with the head: its beam has azimuth 0. */
static void sail(const struct sonar *s)
{
    double place[3] = {0, 0, 0}, path = 0, way = uniform(0, GEO_TURN), yaw = uniform(0, GEO_TURN), turned = 0;
    const double phase = uniform(0, GEO_TURN);
    for (pings = 0; pings < PINGS; pings++) {
        struct ping *p = &ping[pings];
        const double t = pings * 0.05;
        memcpy(p->place, place, sizeof place);
        p->path_m = path;
        quat_from_rpy(geo_rad(s->tilt_deg) * cos(0.7 * t), geo_rad(s->tilt_deg) * sin(0.9 * t + phase),
                      yaw + (s->turns ? turned : 0), p->attitude);
        quat_axes(p->attitude, p->axis);
        sound(s, p, 0);
        turned += s->turns ? geo_rad(s->step_deg) : 0;
        way += 0.02 * sin(t / 5 + phase);
        yaw += geo_rad(s->yaw_dps) * 0.05 * sin(t / 4);
        place[0] += 0.05 * s->mps * cos(way);
        place[1] += 0.05 * s->mps * sin(way);
        path += 0.05 * s->mps;
    }
}

/* ---- the oracle: every ping by itself ---- */

enum says { NOTHING, FREE, ENDED };

/* Half of the way to another beam's axis, as this one sees it; its own edge where that is farther away. */
static double halfway(const struct ping *p, double az, const double ahead[3])
{
    const double other = atan2(geo_dot(ahead, p->axis[1]), geo_dot(ahead, p->axis[0])) - az;
    const double away = fabs(geo_wrap_pi(other));
    return away > 2 * p->half_az ? p->half_az : away / 2;
}

/* Which beam of the ping has the place, and where; false: none. own: in the part alone that is nearer to its axis than
 * to its neighbours'. */
static bool holds(const struct sonar *s, int which, const double at[3], bool own, const struct beam **beam,
                  double v[3])
{
    const struct ping *p = &ping[which];
    to_frame(p->place, p->axis, at, v);
    const double az = atan2(v[1], v[0]);
    if (fabs(atan2(-v[2], hypot(v[0], v[1]))) > p->half_el)
        return false;
    for (int i = 0; i < p->n; i++) {
        const double off = geo_wrap_pi(az - p->beam[i].az);
        const int other = off < 0 ? which - 1 : which + 1; /* heads turn clockwise */
        double side = p->half_az;
        *beam = &p->beam[i];
        if (s->turns && own && other >= 0 && other < pings)
            side = halfway(p, p->beam[i].az, ping[other].axis[0]);
        if (!s->turns && (off < 0 ? i > 0 : i + 1 < p->n))
            side = geo_rad(s->step_deg / 2);
        if (fabs(off) <= fmin(side, p->half_az))
            return true;
    }
    return false;
}

static bool is_between(const struct sonar *s, int which, const double at[3])
{
    const struct beam *beam;
    double v[3];
    for (int k = which - 1; k <= which + 1; k++)
        if (k >= 0 && k < pings && holds(s, k, at, true, &beam, v))
            return false;
    return s->turns && holds(s, which, at, false, &beam, v);
}

/* Beams of a head are sent from different places: between the own parts of two slivers are left, which lie in both. */
static enum says ping_says(const struct sonar *s, int which, const double at[3])
{
    const struct ping *p = &ping[which];
    const struct beam *beam;
    double v[3];
    if (!holds(s, which, at, true, &beam, v) &&
        !(is_between(s, which, at) && holds(s, which, at, false, &beam, v)))
        return NOTHING;
    const double range = geo_length(v), share = fabs(atan2(-v[2], hypot(v[0], v[1]))) / p->half_el;
    const double to = share <= 0.25 ? beam->axis_m : share <= 0.5 ? beam->side_m : beam->edge_m;
    return range < NEAR_M ? NOTHING : range <= to ? FREE : beam->echo && range > beam->axis_m ? ENDED : NOTHING;
}

static enum says truth(const struct sonar *s, const double at[3])
{
    enum says said = NOTHING;
    for (int k = pings - 1; k >= 0 && said == NOTHING; k--)
        said = ping_says(s, k, at);
    return said;
}

/* ---- records ---- */

static const struct store_conf conf = {.beams = {BEAMS}, .spare = 1};
static struct store *store;
static struct water_view view[ASK_RECORDS];
static int records;

static struct pose pose_of(const struct ping *p)
{
    struct pose pose = {.path_m = p->path_m, .has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH};
    memcpy(pose.position_m, p->place, sizeof pose.position_m);
    memcpy(pose.attitude, p->attitude, sizeof pose.attitude);
    return pose;
}

static void enter(const struct ping *p, uint32_t seq)
{
    static struct beam_echoes beam[BEAMS];
    struct echoes e = {.t_ns = seq * UINT64_C(50000000),
                       .seq = seq,
                       .n_beams = (uint16_t)p->n,
                       .az_aperture_rad = (float)(2 * p->half_az),
                       .el_aperture_rad = (float)(2 * p->half_el),
                       .pose = pose_of(p),
                       .beam = beam};
    for (int i = 0; i < p->n; i++)
        beam[i] = (struct beam_echoes){.az_rad = (float)p->beam[i].az,
                                       .blind_m = (float)NEAR_M,
                                       .free_to_m = (float)p->beam[i].axis_m,
                                       .off_axis = true,
                                       .side_to_m = (float)p->beam[i].side_m,
                                       .edge_from_m = (float)NEAR_M,
                                       .edge_to_m = (float)p->beam[i].edge_m,
                                       .n = p->beam[i].echo};
    store_enter(store, &e, &mount_identity);
}

static void keep_all(void)
{
    static void *memory;
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    for (int i = 0; i < pings; i++)
        enter(&ping[i], (uint32_t)i + 1);
}

static void look_from(const double from[3], const struct ping *last)
{
    struct pose pose = pose_of(last);
    const struct store_now now = {
        .now_ns = (uint64_t)pings * 50000000, .pose = &pose, .clear_for_s = 100, .move_limit_m = 100};
    memcpy(pose.position_m, from, sizeof pose.position_m);
    records = store_view(store, &now, view);
}

/* ---- tests ---- */

struct score {
    long points, wrong, in_post;
    double said_m, free_m;
};

static void in_cone(const struct ask_question *q, double u[3])
{
    do
        geo_direction(uniform(0, GEO_TURN), asin(uniform(-1, 1)), u);
    while (geo_dot(u, q->axis) < cos(q->half_rad));
}

/* How far the least of some rays is free. */
static double least_free(const struct sonar *s, const double from[3], const struct ask_question *q)
{
    double least = q->to_m;
    for (int i = 0; i < 12; i++) {
        double u[3], p[3], far = q->near_m;
        in_cone(q, u);
        for (; far < least; far += 0.1) {
            for (int j = 0; j < 3; j++)
                p[j] = from[j] + far * u[j];
            if (truth(s, p) != FREE)
                break;
        }
        least = fmin(least, far);
    }
    return least;
}

static void judge(const struct sonar *s, const double from[3], const struct ask_question *q, double to_m,
                  struct score *score)
{
    for (int i = 0; i < 60 && to_m > q->near_m; i++) {
        double u[3], p[3];
        const double t = uniform(q->near_m, to_m);
        in_cone(q, u);
        for (int j = 0; j < 3; j++)
            p[j] = from[j] + t * u[j];
        score->points++;
        score->wrong += truth(s, p) != FREE;
        score->in_post += in_post(p);
    }
    score->free_m += least_free(s, from, q) - q->near_m;
    score->said_m += to_m - q->near_m;
}

static struct score sail_and_ask(const struct sonar *s, int questions)
{
    struct score score = {0};
    furnish();
    sail(s);
    keep_all();
    const struct ping *last = &ping[pings - 1];
    double from[3];
    for (int k = 0; k < 3; k++)
        from[k] = last->place[k] + uniform(-0.03, 0.03);
    look_from(from, last);
    for (int i = 0; i < questions; i++) {
        const double half = geo_rad(uniform(0.5, 5)), to_m = uniform(3, 10);
        struct ask_question q = {.half_rad = half, .near_m = 0.5, .to_m = to_m};
        /* mostly of what a fan has before it */
        const double ahead = atan2(last->axis[0][1], last->axis[0][0]);
        geo_direction(s->turns || i % 4 == 0 ? uniform(0, GEO_TURN) : ahead + uniform(-0.8, 0.8),
                      geo_rad(uniform(-5, 5)), q.axis);
        judge(s, from, &q, ask_free(view, records, &q).free_to_m, &score);
    }
    return score;
}

static const struct sonar sonars[] = {
    {"fan, still", 96, 1.25, 1.25, 25, false, 0, 0, 0},
    {"fan, 0.3 m/s, turning", 96, 1.25, 1.25, 25, false, 0.3, 15, 2},
    {"fan with overlap, 0.1 m/s", 60, 1.5, 2.5, 25, false, 0.1, 10, 1},
    {"fan with gaps", 30, 3, 2.5, 25, false, 0.1, 5, 1},
    {"head, still", 1, 2.4, 2.5, 25, true, 0, 0, 0},
    {"head, 0.1 m/s", 1, 1, 2.5, 25, true, 0.1, 0, 1},
    {"head, 0.3 m/s, turning", 1, 1.8, 3, 35, true, 0.3, 3, 1.5},
};

TEST(what_is_said_to_be_free_was_free_in_the_newest_ping_that_knows)
{
    for (int share = 0; share < 2; share++)
        for (size_t i = 0; i < sizeof sonars / sizeof *sonars; i++) {
            struct score sum = {0};
            seen_share = share ? 0.1 : 1;
            for (int world = 0; world < (is_long() ? 20 : 1); world++) {
                const struct score one = sail_and_ask(&sonars[i], is_long() ? 40 : 12);
                sum.points += one.points;
                sum.wrong += one.wrong;
                sum.in_post += one.in_post;
                sum.said_m += one.said_m;
                sum.free_m += one.free_m;
            }
            printf("# %-28s %ld points, %ld wrong, %ld in a post; said %.0f %% of the free metres; %d records\n",
                   sonars[i].name, sum.points, sum.wrong, sum.in_post, 100 * sum.said_m / fmax(sum.free_m, 1e-9),
                   records);
            CHECK_INT(sum.wrong, 0);
            CHECK(sum.points > 100 || sonars[i].step_deg > sonars[i].wide_deg);
        }
}

/* More of the same never turns what was not free into free water: less of it, or not as far. */
TEST(less_of_a_question_is_free_at_least_as_far)
{
    seen_share = 1;
    furnish();
    sail(&sonars[6]);
    keep_all();
    look_from(ping[pings - 1].place, &ping[pings - 1]);
    int free_m = 0;
    for (int i = 0; i < 60; i++) {
        const double half = geo_rad(uniform(0, 8)), to_m = uniform(1, 10);
        struct ask_question q = {.half_rad = half, .near_m = 0.5, .to_m = to_m};
        geo_direction(uniform(0, GEO_TURN), geo_rad(uniform(-6, 6)), q.axis);
        const double all_m = ask_free(view, records, &q).free_to_m;
        struct ask_question less = q;
        less.half_rad *= uniform(0, 1);
        CHECK(ask_free(view, records, &less).free_to_m >= all_m);
        less = q;
        less.to_m = uniform(0.6, q.to_m);
        CHECK(ask_free(view, records, &less).free_to_m >= fmin(all_m, less.to_m));
        free_m += all_m > 1;
    }
    CHECK(free_m > 10);
}

/* A rope of 2 cm before one ping of 512 beams: thin rays half a degree apart pass it in one of six trials. */
TEST(no_rope_is_passed_by_tiles)
{
    static struct row_beam beam[512];
    static struct row_room room;
    static struct water_record record = {.axis = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const double width = geo_rad(120.0 / 512);
    const struct row_shape shape = {.half_az_rad = width / 2,
                                    .half_el_rad = geo_rad(12.5),
                                    .from_rad = -geo_rad(60),
                                    .to_rad = geo_rad(60),
                                    .outer_rad = {-geo_rad(60), geo_rad(60)}};
    int passed = 0, free_before = 0;
    for (int i = 0; i < 2000; i++) {
        const double az = geo_rad(uniform(-30, 30)), range = uniform(4, 9);
        for (int k = 0; k < 512; k++) {
            const double at = (k - 255.5) * width;
            const bool hit = fabs(at - az) * range <= 0.01 + range * width / 2;
            const double to = hit ? range - 0.03 : 20;
            beam[k] = (struct row_beam){at, to, to, to, hit ? to : (double)INFINITY, false};
        }
        row_write(&record, &room, &shape, beam, 512);
        const struct water_view seen = {.record = &record};
        struct ask_question q = {.half_rad = geo_rad(uniform(0.1, 5)), .near_m = 0.5, .to_m = 10};
        geo_direction(az + q.half_rad * uniform(-0.99, 0.99), 0, q.axis);
        const double free_m = ask_free(&seen, 1, &q).free_to_m;
        passed += free_m > range;
        free_before += free_m > range - 0.3;
    }
    CHECK_INT(passed, 0);
    CHECK(free_before > 1900);
}

int main(void)
{
    seed = test_seed();
    RUN(what_is_said_to_be_free_was_free_in_the_newest_ping_that_knows);
    RUN(less_of_a_question_is_free_at_least_as_far);
    RUN(no_rope_is_passed_by_tiles);
    return test_end();
}
