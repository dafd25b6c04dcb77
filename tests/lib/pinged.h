/* SPDX-License-Identifier: MIT */
/*
 * pinged.h - a sonar on a vehicle that moves, turns and tilts pings in made-up water; its pings become records, and any
 * point can be looked up in all of the pings, from the newest to the oldest, in plain double arithmetic that knows
 * nothing of records and tiles.
 */
#ifndef SONARD_TEST_PINGED_H
#define SONARD_TEST_PINGED_H

#include "test.h"

#include "grid/geometry.h"
#include "grid/water/store.h"

#define PINGS   800
#define BEAMS   96
#define RANGE_M 12.0
#define NEAR_M  0.4
#define FADE    0.8 /* the edge of a beam detects so much less far, where nothing echoes */

static uint64_t seed;

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

static inline bool in_post(const double p[3])
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
        for (int i = -3; i <= 3; i++) {
            double v[3], u[3];
            geo_direction(az + i * p->half_az / 3, j * p->half_el / 2, v);
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
    const double to = share <= 0.25 ? beam->axis_m : share <= 0.7 ? beam->side_m : beam->edge_m;
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

/* What one ping of a fan of 512 beams says, ahead at a depth of nothing, with a rope of 2 cm in it. Until the next. */
static inline const struct water_record *fan_with_rope(double az, double range)
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
    for (int k = 0; k < 512; k++) {
        const double at = (k - 255.5) * width;
        const bool hit = fabs(at - az) * range <= 0.01 + range * width / 2;
        const double to = hit ? range - 0.03 : 20;
        beam[k] = (struct row_beam){at, to, to, to, 0, 0, hit ? to : (double)INFINITY, 0, 0, 0, false};
    }
    row_write(&record, &room, &shape, beam, 512);
    return &record;
}

#endif
