/* SPDX-License-Identifier: MIT */
/*
 * honest.h - a vehicle moves and turns in a world of points while its sonars ping and its pose comes late, seldom or
 * not; at random moments everything is asked that a client may ask, through the daemon's own methods, and held against
 * where the points are at that moment.
 *
 * Assumed: a sonar hears the nearest point in its opening up to its range; a ping's range is off by at most its bin;
 * the vehicle goes and turns no faster than the configuration says; where that does not say it, smoothly. Poses are
 * exact as of their own time and nothing but the vehicle moves; where a trial has it otherwise,
 * it says how far a clear may be wrong. Nothing stands nearer than `near` out of the sonars' sight; a clear that is
 * wrong for such a point alone is excused.
 */
#ifndef SONARD_TEST_HONEST_H
#define SONARD_TEST_HONEST_H

#include "daemon_rig.h"
#include "sanitized.h"
#include "test.h"

#include <stdarg.h>

#define SECOND     1000000000ull
#define RANGE_M    10.0
#define RANGE_SD_M 0.01
#define POINTS     60000
#define WORLD_S    25.0
#define THINGS     20
#define WAVE_S     5.0
#define TURN_PINGS 144

/* What of the beams: how many, between which azimuths, and how wide and high each. */
struct head {
    int beams;
    double from_deg, to_deg, wide_deg, high_deg;
    uint64_t period_ns;
    bool turns; /* one beam, another one each time */
};

#define HEADS  3
#define OUT_S  3.0 /* a sonar drops out for so long, once in every world */
#define SELDOM 4   /* so much longer between two questions, but with LONG=1: they cost most of the time */
struct vehicle {
    const char *conf;
    struct head head[HEADS];
    int heads;
    double pace;      /* 1: up to 0.6 m/s and 30 degrees a second */
    double tilt_deg;  /* rolls and pitches so far */
    double wave_deg;  /* and beside that so far in waves of WAVE_S */
    double ahead_deg; /* directions are asked about so far to each side of ahead; 0: all */
    double high_deg;  /* cones are asked about so far up and down; 0: level ones alone */
    bool stays;       /* keeps its place and only turns */
};

#define CONF_HEARD "[extract]\nminimum_range = 10 m\nno_echo = range\n"

/* Keeps its place but for a little drift, and knows of it from one level head. Nothing else is set, but how far off the
 * fan has opened as far as the body is high, and a corridor of its radius. */
static const struct vehicle hovering = {
    .conf =
        "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n" CONF_HEARD "[vehicle]\nnear = 3.3 m\n",
    .head = {{1, 0, 360, 3, 25, SECOND / 25, true}},
    .heads = 1,
    .pace = 0.05,
    .tilt_deg = 1};

#define CONF_MOVING                                                                                               \
    "[grid]\nclear_for = 20 s\nforget = 60 s\n[pose]\nmax_age = 2 s\n"                                            \
    "[vehicle]\nnear = 1.8 m\nunknown = stop\n"
#define CONF_THREE                                                                                                \
    "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\nmount = 0.3 0.1 -0.2 m\n"                    \
    "[sonar fan]\ndevice = surveyor\nport = udp:10.0.0.2:62312\nrange = 10 m\nmount = 0.4 0 0.1 m\n"              \
    "[sonar low]\ndevice = echolist\nport = can:can0\nrange = 10 m\nmount = -0.2 -0.2 0.2 m\n"                    \
    "rotation = 0 -20 150 deg\n" CONF_HEARD CONF_MOVING

/* One that looks almost everywhere, and one whose three sonars hang off its middle and hear a level band. */
#define THREE(turning_deg, fan_deg)                                                                               \
    .head = {{1, 0, 360, 3, turning_deg, SECOND / 25, true},                                                      \
             {24, -48, 48, 4, fan_deg, SECOND / 8, false},                                                        \
             {1, 0, 0, 25, 25, SECOND / 10, false}},                                                              \
    .heads = 3, .pace = 1, .tilt_deg = 4
static const struct vehicle bounded[] = {
    {.conf = CONF_THREE "max_speed = 0.6 m/s\nmax_turn = 30 deg\n", THREE(165, 60)},
    {.conf = CONF_THREE "max_speed = 0.6 m/s\nmax_turn = 30 deg\n", THREE(25, 20)}};
static const struct vehicle told[] = {{.conf = CONF_THREE, THREE(165, 60)}, {.conf = CONF_THREE, THREE(25, 20)}};

/* Fast, and what it looked at lies behind it when it is asked. */
static const struct vehicle fast = {
    .conf = "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n" CONF_HEARD CONF_MOVING
            "max_speed = 1.6 m/s\nmax_turn = 60 deg\n",
    .head = {{1, 0, 360, 3, 165, SECOND / 25, true}},
    .heads = 1,
    .pace = 2,
    .tilt_deg = 1};

/* Slow in a basin, with one level sonar: a head that turns in 6 s, or a fan ahead, about which alone it asks. */
#define CONF_SLOW(turn_deg)                                                                                       \
    CONF_HEARD "[grid]\nclear_for = 20 s\nforget = 60 s\n[pose]\nmax_age = 2 s\n"                                 \
               "[vehicle]\nnear = 3.3 m\nunknown = stop\nmax_speed = 0.6 m/s\nmax_turn = " turn_deg " deg\n"
static const struct vehicle slow_head = {
    .conf = "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n" CONF_SLOW("30"),
    .head = {{1, 0, 360, 3, 25, SECOND / 25, true}},
    .heads = 1,
    .pace = 0.5,
    .tilt_deg = 2};
static const struct vehicle slow_fan = {
    .conf = "[sonar fan]\ndevice = surveyor\nport = udp:10.0.0.2:62312\nrange = 10 m\n" CONF_SLOW("30"),
    .head = {{32, -48, 48, 3, 25, SECOND / 8, false}},
    .heads = 1,
    .pace = 0.5,
    .tilt_deg = 2,
    .ahead_deg = 40};

/* What is tried: poses are sent so often, come so late, and so many of them do not come. */
struct trial {
    const struct vehicle *vehicle;
    uint64_t period_ns, late_ns;
    double lost;
    bool early; /* asked from the first pings on, not after 8 s */
    bool basin; /* walls all around; distances are what a pilot asks for, not what is nearly false */
    /* nothing stands in so much of the middle: `near` is a promise that nothing is nearer unheard */
    double hollow_m;
    double off_m, off_deg;      /* what poses say is off by no more, along and about each axis */
    double excuse_m;            /* and for that no clear is wrong by more */
    bool often;                 /* asked as often as with LONG=1, on which this world's questions depend */
    double drift_mps;           /* balls and poles go so fast, at most */
    double north_deg;           /* now and then their north turns by at least so much; 0: never */
    double heading_dps;         /* their north turns so far every second, and their positions are reckoned by it */
    bool provokes;              /* poses are worse than the configuration says: something clear will be false */
    unsigned untold;            /* parts that poses do not tell */
    double delay_s, delay_by_s; /* readings come so late, give or take as much, which is all that sonard knows */
    double doubt_s;             /* the time of poses is off by no more, either way */
    double
        water_mps; /* > 0: with each pose comes a bound of the speed, without the water, which goes so fast at most */
};

static const struct trial *trial;
static const struct vehicle *vehicle;
static uint64_t seed;
static double point[POINTS][3], seen[POINTS][3];
static int n_points, thing[POINTS];
static bool shown[POINTS]; /* it was in a beam */
static struct {
    double reach_m[2], hz, phase;
} drift[THINGS]; /* to and fro; the first stays */
static int n_things;

static double uniform(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

/* ---- the world ---- */

static void add_point(double north, double east, double down)
{
    if (n_points < POINTS &&
        hypot(north, east) > fmax(3.0, trial->hollow_m)) { /* the vehicle's own water, by far */
        thing[n_points] = n_things - 1;
        point[n_points][0] = north;
        point[n_points][1] = east;
        point[n_points++][2] = down;
    }
}

/* What is added from now on goes to and fro, so fast at most. */
static void begin_thing(double mps)
{
    memset(&drift[n_things], 0, sizeof drift[0]);
    if (mps > 0) {
        const double to = uniform(0, GEO_TURN), far_m = uniform(0.2, 0.8);
        drift[n_things].reach_m[0] = far_m * cos(to);
        drift[n_things].reach_m[1] = far_m * sin(to);
        drift[n_things].hz = mps / far_m;
        drift[n_things].phase = uniform(0, GEO_TURN);
    }
    n_things++;
}

static void add_wall(double normal_rad, double far_m, double half_m)
{
    for (double along = -half_m; along < half_m; along += 0.2)
        for (double down = -4; down < 4; down += 0.2)
            add_point(far_m * cos(normal_rad) - along * sin(normal_rad),
                      far_m * sin(normal_rad) + along * cos(normal_rad), down + uniform(-0.05, 0.05));
}

static void add_ball(double north, double east, double down, double radius_m)
{
    begin_thing(trial->drift_mps);
    for (int i = 0; i < 300; i++) {
        double v[3];
        const double el = asin(uniform(-1, 1)), az = uniform(0, GEO_TURN);
        geo_direction(az, el, v);
        add_point(north + radius_m * v[0], east + radius_m * v[1], down + radius_m * v[2]);
    }
}

static void add_pole(double north, double east)
{
    begin_thing(trial->drift_mps);
    for (double down = -4; down < 4; down += 0.1)
        add_point(north, east, down);
}

/* Drawn one after the other: in which order a call evaluates what it is given is the compiler's to choose. */
static void draw_pole(double far_m)
{
    const double east = uniform(-far_m, far_m), north = uniform(-far_m, far_m);
    add_pole(north, east);
}

static void draw_wall(void)
{
    const double half_m = uniform(1, 6), far_m = uniform(4, 9), normal_rad = uniform(0, GEO_TURN);
    add_wall(normal_rad, far_m, half_m);
}

static void draw_ball(void)
{
    const double radius_m = uniform(0.1, 0.8), down = uniform(-1.5, 1.5), east = uniform(-8, 8),
                 north = uniform(-8, 8);
    add_ball(north, east, down, radius_m);
}

static void make_basin(void)
{
    for (int i = 0; i < 4; i++)
        add_wall(i * GEO_PI / 2, uniform(5, 8), 8);
    for (int i = 0; i < 4; i++)
        draw_pole(7);
}

static void make_world(void)
{
    n_points = n_things = 0;
    memset(shown, 0, sizeof shown);
    begin_thing(0);
    if (trial->basin) {
        make_basin();
        return;
    }
    for (int i = 1 + (int)uniform(0, 4); i > 0; i--)
        draw_wall();
    for (int i = 3 + (int)uniform(0, 6); i > 0; i--)
        draw_ball();
    for (int i = 3 + (int)uniform(0, 6); i > 0; i--)
        draw_pole(8);
}

/* ---- the vehicle ---- */

static double way_phase, way_hz[4];

/* On a smooth way near the middle. */
static void truth(double t_s, struct pose *p)
{
    const double t = vehicle->pace * t_s, s = t + 0.5 * sin(0.7 * t + way_phase);
    const double ds = vehicle->pace * (1 + 0.35 * cos(0.7 * t + way_phase)), tilt = geo_rad(vehicle->tilt_deg);
    const double w[4] = {GEO_TURN * way_hz[0], GEO_TURN * way_hz[1], GEO_TURN * way_hz[2], GEO_TURN * way_hz[3]};
    *p = pose_identity;
    p->t_ns = (uint64_t)(t_s * 1e9);
    p->has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH | POSE_VELOCITY;
    p->position_m[0] = 1.2 * sin(w[0] * s);
    p->position_m[1] = 1.2 * sin(w[1] * s + way_phase);
    p->position_m[2] = 0.3 * sin(w[2] * s);
    p->velocity_mps[0] = 1.2 * w[0] * cos(w[0] * s) * ds;
    p->velocity_mps[1] = 1.2 * w[1] * cos(w[1] * s + way_phase) * ds;
    p->velocity_mps[2] = 0.3 * w[2] * cos(w[2] * s) * ds;
    for (int k = 0; vehicle->stays && k < 3; k++)
        p->position_m[k] = p->velocity_mps[k] = 0;
    const double wave = geo_rad(vehicle->wave_deg), at = GEO_TURN * t_s / WAVE_S;
    quat_from_rpy(tilt * sin(w[2] * s) + wave * sin(at), tilt * sin(w[1] * s) + wave * cos(0.8 * at),
                  0.8 * sin(w[3] * s) + 0.1 * t, p->attitude);
}

/* So far is the middle of the world below the surface. */
#define DEPTH_M 10.0

/* Poses as they are told. */
static void be_off(struct pose *p)
{
    const double off = geo_rad(trial->off_deg);
    double turn[4];
    if (trial->off_m <= 0 && off <= 0)
        return;
    for (int k = 0; k < 3; k++)
        p->position_m[k] += uniform(-trial->off_m, trial->off_m);
    const double yaw = uniform(-off, off), pitch = uniform(-off, off), roll = uniform(-off, off);
    quat_from_rpy(roll, pitch, yaw, turn);
    quat_multiply(p->attitude, turn, p->attitude);
}

static void leave_out(struct pose *p)
{
    p->has &= ~trial->untold;
    p->position_m[2] += DEPTH_M;
    for (int k = 0; k < 3; k++) {
        p->position_m[k] = p->has & (k < 2 ? POSE_POSITION : POSE_DEPTH) ? p->position_m[k] : 0;
        p->velocity_mps[k] = p->has & POSE_VELOCITY ? p->velocity_mps[k] : 0;
    }
    if (!(p->has & POSE_ATTITUDE))
        memcpy(p->attitude, pose_identity.attitude, sizeof p->attitude);
}

/* By how much the navigation's north has turned, where it then was, truly and as told, and until when that stays. */
static struct {
    double turn[4], true_m[3], told_m[3];
    uint64_t until_ns;
    double radps; /* it goes on turning */
    uint64_t t_ns;
} north;

static void begin_true(uint64_t now_ns)
{
    memset(&north, 0, sizeof north);
    north.turn[0] = 1;
    north.until_ns = now_ns + 8 * SECOND;
    north.t_ns = now_ns;
    if (trial->heading_dps > 0)
        north.radps = geo_rad(uniform(0, 1) < 0.5 ? trial->heading_dps : -trial->heading_dps);
}

/* From here on dead reckoning goes in a direction that is turned by so much more. */
static void turn_by(double rad, const double true_m[3], const double told_m[3])
{
    double by[4];
    quat_from_rpy(0, 0, rad, by);
    quat_multiply(by, north.turn, north.turn);
    memcpy(north.true_m, true_m, sizeof north.true_m);
    memcpy(north.told_m, told_m, sizeof north.told_m);
}

/* What the navigation makes of the truth: its dead reckoning goes on from where it was, in another direction. */
static void turn_north(struct pose *p)
{
    double true_m[3], way_m[3];
    memcpy(true_m, p->position_m, sizeof true_m);
    for (int k = 0; k < 3; k++)
        way_m[k] = true_m[k] - north.true_m[k];
    quat_rotate(north.turn, way_m, way_m);
    for (int k = 0; k < 3; k++)
        p->position_m[k] = north.told_m[k] + way_m[k];
    if (trial->north_deg > 0 && p->t_ns > north.until_ns) {
        turn_by(geo_rad(uniform(trial->north_deg, 360 - trial->north_deg)), true_m, p->position_m);
        north.until_ns = p->t_ns + (uint64_t)(uniform(1, 12) * 1e9);
    }
    if (trial->heading_dps > 0)
        turn_by(north.radps * (double)(p->t_ns - north.t_ns) * 1e-9, true_m, p->position_m);
    north.t_ns = p->t_ns;
    quat_multiply(north.turn, p->attitude, p->attitude);
    quat_rotate(north.turn, p->velocity_mps, p->velocity_mps);
}

/* From the body's axes to those of something at `mount` of it. */
static void to_mount(const struct mount *mount, const double body[3], double v[3])
{
    for (int k = 0; k < 3; k++)
        v[k] = body[k] - mount->position_m[k];
    quat_rotate_inverse(mount->attitude, v, v);
}

/* All points as seen by something at `mount` of the body. */
static void look_from(const struct pose *p, const struct mount *mount)
{
    for (int i = 0; i < n_points; i++) {
        double v[3];
        for (int k = 0; k < 3; k++)
            v[k] = point[i][k] - p->position_m[k];
        for (int k = 0; k < 2 && thing[i]; k++)
            v[k] += drift[thing[i]].reach_m[k] *
                    sin(drift[thing[i]].hz * (double)p->t_ns * 1e-9 + drift[thing[i]].phase);
        quat_rotate_inverse(p->attitude, v, v);
        to_mount(mount, v, seen[i]);
    }
}

/* ---- what happens ---- */

/* Is it in range, and as high and low as the beams are? */
static bool is_level(const struct head *h, const double v[3])
{
    const double level = hypot(v[0], v[1]);
    return hypot(level, v[2]) <= RANGE_M && fabs(v[2]) <= level * tan(geo_rad(h->high_deg / 2));
}

static bool is_abreast(const struct head *h, double az_rad, double beam_rad)
{
    return fabs(geo_wrap_pi(az_rad - beam_rad)) <= geo_rad(h->wide_deg / 2);
}

static double bearing_rad(const struct head *h, uint32_t ping, int beam)
{
    return geo_rad(h->turns       ? ping % TURN_PINGS * (360.0 / TURN_PINGS)
                   : h->beams > 1 ? h->from_deg + (beam + 0.5) * (h->to_deg - h->from_deg) / h->beams
                                  : 0);
}

/* A sonar has had the point in a beam, or has it where it looks and may yet show it. */
static bool is_in_sight(int i)
{
    for (int which = 0; which < vehicle->heads && !shown[i]; which++) {
        const struct head *h = &vehicle->head[which];
        double v[3];
        to_mount(&d.mount[which], seen[i], v);
        for (int b = 0; b < h->beams && is_level(h, v); b++)
            if (h->turns || is_abreast(h, atan2(v[1], v[0]), bearing_rad(h, 0, b)))
                return true;
    }
    return shown[i];
}

static void hear(int which, struct ping *ping)
{
    const struct head *h = &vehicle->head[which];
    for (int i = 0; i < n_points; i++) {
        const double *v = seen[i], range = hypot(hypot(v[0], v[1]), v[2]);
        if (!is_level(h, v))
            continue;
        const double az = atan2(v[1], v[0]);
        for (uint16_t b = 0; b < ping->n_beams; b++) {
            if (!is_abreast(h, az, (double)ping->beam[b].az_rad))
                continue;
            shown[i] = true;
            if (ping->beam[b].range_m <= 0 || range < (double)ping->beam[b].range_m)
                ping->beam[b].range_m = (float)range;
        }
    }
    for (uint16_t b = 0; b < ping->n_beams; b++)
        if (ping->beam[b].range_m > 0)
            ping->beam[b].range_m += (float)uniform(-RANGE_SD_M, RANGE_SD_M);
}

/* Where the beams of the pings of a world looked, and how far. */
#define PINGS      2000
#define PING_BEAMS 32
static struct {
    struct pose from;
    int which, beams;
    float az_rad[PING_BEAMS], range_m[PING_BEAMS];
} heard[PINGS];
static int n_heard;

static void note_ping(int which, const struct pose *from, const struct ping *ping)
{
    if (n_heard == PINGS || ping->n_beams > PING_BEAMS)
        return;
    heard[n_heard].from = *from;
    heard[n_heard].which = which;
    heard[n_heard].beams = ping->n_beams;
    for (int b = 0; b < ping->n_beams; b++) {
        heard[n_heard].az_rad[b] = ping->beam[b].az_rad;
        heard[n_heard].range_m[b] = ping->beam[b].range_m > 0 ? ping->beam[b].range_m : (float)RANGE_M;
    }
    n_heard++;
}

/* Did a ping have the place in a beam, before its echo? It counts no longer than answers do. */
static bool was_heard(const double at[3], uint64_t now_ns)
{
    const double last_s = grid_limits(pipeline_grid(d.pipeline, 0)).clear_for_s;
    for (int i = n_heard; i-- > 0 && (double)(now_ns - heard[i].from.t_ns) * 1e-9 <= last_s;) {
        const struct head *h = &vehicle->head[heard[i].which];
        double v[3] = {at[0] - heard[i].from.position_m[0], at[1] - heard[i].from.position_m[1],
                       at[2] - heard[i].from.position_m[2]};
        quat_rotate_inverse(heard[i].from.attitude, v, v);
        to_mount(&d.mount[heard[i].which], v, v);
        for (int b = 0; b < heard[i].beams; b++)
            if (is_abreast(h, atan2(v[1], v[0]), (double)heard[i].az_rad[b]) &&
                hypot(v[0], v[1]) < (double)heard[i].range_m[b])
                return true;
    }
    return false;
}

#define PLACES_M 0.05

/* Has a beam been at all places of a level way that are nearer than `near`, but for the vehicle's own? What stands at
 * the others reaches through the beams' height. */
static bool was_way_heard(const double axis[3], double way_m)
{
    const double radius_m = d.conf.vehicle.radius_m, near_m = d.conf.vehicle.near_m;
    const uint64_t now_ns = loop_now(d.loop);
    struct pose p;
    truth((double)now_ns * 1e-9, &p);
    for (double x = 0; x <= fmin(way_m + radius_m, near_m); x += PLACES_M)
        for (double y = -radius_m; y <= radius_m; y += PLACES_M) {
            const double away_m = hypot(x, y);
            double at[3] = {x * axis[0] - y * axis[1], x * axis[1] + y * axis[0], 0};
            quat_rotate(p.attitude, at, at);
            for (int k = 0; k < 3; k++)
                at[k] = p.position_m[k] + (k < 2 ? at[k] : 0);
            if (away_m > radius_m + PLACES_M && away_m < near_m && hypot(fmax(x - way_m, 0), y) <= radius_m &&
                !was_heard(at, now_ns))
                return false;
        }
    return true;
}

/* Sent at t_ns; its reading has just come, so much later. */
static void send_ping(int which, uint64_t t_ns, uint64_t late_ns, uint32_t number)
{
    const struct head *h = &vehicle->head[which];
    struct ping *ping = pipeline_begin(d.pipeline);
    struct pose p;
    truth((double)t_ns * 1e-9, &p);
    look_from(&p, &d.mount[which]);
    ping->t_in_ns = t_ns + late_ns;
    ping->t_ns = ping->t_in_ns - (uint64_t)(trial->delay_s * 1e9);
    ping->kind = PING_RANGES;
    ping->seq = number;
    ping->sensor = (uint16_t)which;
    ping->head_turn = h->turns ? TURN_PINGS : 0;
    ping->flags = !h->turns || number % TURN_PINGS == 0 ? PING_NEW_TURN : 0;
    CHECK(h->beams <= (int)ping->max_beams);
    ping->n_beams = (uint16_t)h->beams;
    ping->n_bins = 1000;
    ping->dr_m = (float)(RANGE_M / 1000);
    ping->az_aperture_rad = (float)geo_rad(h->wide_deg);
    ping->el_aperture_rad = (float)geo_rad(h->high_deg);
    for (int b = 0; b < h->beams; b++)
        ping->beam[b] = (struct ping_beam){.az_rad = (float)geo_wrap(bearing_rad(h, number, b)),
                                           .range_sd_m = (float)RANGE_SD_M,
                                           .confidence = 0.95f};
    hear(which, ping);
    note_ping(which, &p, ping);
    pose_log_blurred(&d.poses, ping->t_ns, (uint64_t)(trial->delay_by_s * 1e9), &ping->pose);
    ping->pose.blur_any_m += geo_length(d.mount[which].position_m) * ping->pose.blur_rad;
    pipeline_submit(d.pipeline, ping);
}

/* ---- asking ---- */

enum question { CONE, CORRIDOR, SECTORS, NEAREST, COLLISION, LIMIT, FREE_TO, RECORDS, QUESTIONS };
static const char *const names[] = {"cone",  "corridor",  "sectors", "nearest", "time_to_collision",
                                    "limit", "free_to_m", "records"};
/* Amply clear: no point is within so much of what was asked, nor so much behind it. Of a way, what is not said counts
 * where beams have been at all of it that is nearer than `near`: else a lost ping may have passed over what is
 * there. */
#define AMPLE_M 0.5

#define WHYS (ANSWER_NO_DATA + 1)
static struct {
    long asked, clear, false_clear, excused, truly_clear, held_back;
    long amply_clear, amply_held_back, blocked,
        why[WHYS]; /* of the latter: said to be blocked, or unknown and why */
} count[QUESTIONS];
static void judge_amply(enum question q, const json_t *answer, bool clear, bool amply)
{
    count[q].amply_clear += amply;
    if (!amply || clear)
        return;
    const char *reason = json_string_value(json_object_get(answer, "reason"));
    count[q].amply_held_back++;
    count[q].blocked += says(answer, "blocked");
    for (int i = 0; i < WHYS && reason && !says(answer, "blocked"); i++) {
        const char *part =
            i == ANSWER_STALE ? "last scan of this direction is" : answer_reason_text((enum answer_reason)i);
        count[q].why[i] += strstr(reason, part) != NULL;
    }
}

/* How far an answer may be wrong: by what its poses are off, and by the way that something went since the looks. What
 * is not clear tells no age of its water; older than clear_for it is not. */
static double excuse_m(const json_t *answer)
{
    const double age_s =
        says(answer, "clear") ? number(answer, "age_s") : grid_limits(pipeline_grid(d.pipeline, 0)).clear_for_s;
    return trial->excuse_m + trial->drift_mps * age_s;
}

/* truly: is it, as of now? excused: but for what the trial allows. */
static void judge(enum question q, bool clear, bool truly, bool excused, const char *what)
{
    count[q].asked++;
    count[q].clear += clear;
    count[q].truly_clear += truly;
    count[q].held_back += truly && !clear;
    count[q].excused += clear && !truly && excused;
    if (!clear || truly || excused)
        return;
    if (count[q].false_clear++ < 5 && !trial->provokes)
        printf("at %.3f s %s is said to be clear: %s\n", (double)loop_now(d.loop) * 1e-9, names[q], what);
}

/* Which points an answer speaks of: none nearer than from_m, and up to near_m those in sight alone. For what else
 * stands there breaks the promise of `near`. */
struct spoken {
    double from_m, near_m;
};

static bool is_spoken_of(int i, double r, const struct spoken *of)
{
    return r >= of->from_m && (r >= of->near_m || is_in_sight(i));
}

/* How far the cone is free of them, points being balls of spare_m; INFINITY: all the way. */
static double free_cone_of(const double axis[3], double half_rad, struct spoken of, double spare_m)
{
    double first_m = INFINITY;
    for (int i = 0; i < n_points; i++) {
        const double *v = seen[i], r = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        const double along = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
        const double half = fmin(GEO_PI, half_rad + asin(fmax(-1, fmin(1, spare_m / r))));
        if (half >= 0 && r < first_m && along >= r * cos(half) && is_spoken_of(i, r, &of))
            first_m = r;
    }
    return first_m;
}

/* The same of all points from from_m on. */
static double free_cone(const double axis[3], double half_rad, double from_m, double spare_m)
{
    return free_cone_of(axis, half_rad, (struct spoken){from_m, 0}, spare_m);
}

/* How far a corridor is free along its line. */
static double free_corridor_of(const double axis[3], double radius_m, struct spoken of)
{
    double first_m = INFINITY;
    for (int i = 0; i < n_points; i++) {
        const double *v = seen[i], r2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        const double along = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
        if (radius_m >= 0 && along >= 0 && along < first_m && r2 - along * along <= radius_m * radius_m &&
            is_spoken_of(i, sqrt(r2), &of))
            first_m = along;
    }
    return first_m;
}

static double free_corridor(const double axis[3], double radius_m, double from_m)
{
    return free_corridor_of(axis, radius_m, (struct spoken){from_m, 0});
}

/* How far an upright cylinder around the vehicle may move along a level line; near_m: up to there only points in sight
 * count, for what else stands there breaks the promise of `near`. */
static double free_sweep(const double axis[3], double radius_m, double half_height_m, double near_m)
{
    double first_m = INFINITY;
    for (int i = 0; i < n_points; i++) {
        const double *v = seen[i], along = v[0] * axis[0] + v[1] * axis[1];
        const double aside2 = v[0] * v[0] + v[1] * v[1] - along * along;
        if (radius_m >= 0 && fabs(v[2]) <= half_height_m && along >= 0 && aside2 <= radius_m * radius_m &&
            (geo_length(v) >= near_m || is_in_sight(i)))
            first_m = fmin(first_m, along - sqrt(radius_m * radius_m - aside2));
    }
    return fmax(0, first_m);
}

/* How far a question goes whose water is free to free_m: mostly a little more or less than that. */
static double as_far_as(double free_m)
{
    const double any_m = trial->basin ? uniform(2.5, 6) : uniform(0, 1) < 0.05 ? RANGE_M : uniform(1.2, 9);
    if (trial->basin)
        return any_m;
    return uniform(0, 1) < 0.3 || free_m > 9
               ? any_m
               : fmax(1.2, free_m + (uniform(0, 1) < 0.5 ? uniform(0, 0.1) : -uniform(0, 2)));
}

static const char *words(const char *form, ...)
{
    static char text[200];
    va_list ap;
    va_start(ap, form);
    vsnprintf(text, sizeof text, form, ap);
    va_end(ap);
    return text;
}

/* Nearer than this nothing stands, and nothing is asked. */
#define FROM_M 1.0

static double any_azimuth(void)
{
    const double most = vehicle->ahead_deg > 0 ? geo_rad(vehicle->ahead_deg) : GEO_PI;
    return geo_wrap(uniform(-most, most));
}

/* The cone once more, of the records of pings: what they call free is held to the same. */
static void ask_records(const double axis[3], double half, double to_m, const json_t *of_grid)
{
    double az, el;
    geo_angles(axis, &az, &el);
    json_t *a =
        ask("explain", json_pack("{s:f, s:f, s:f, s:f, s:i}", "azimuth_deg", geo_deg(az), "elevation_deg",
                                 geo_deg(el), "distance_m", to_m, "half_angle_deg", geo_deg(half), "count", 1));
    const json_t *water = json_object_get(a, "water");
    const bool any = json_is_object(water);
    const double from_m = any ? number(water, "free_from_m") : 0, known_m = any ? number(water, "free_to_m") : 0;
    const double truly_m = free_cone(axis, half, from_m, 0), off_m = excuse_m(of_grid);
    judge(RECORDS, known_m > from_m, truly_m > known_m,
          off_m > 0 && free_cone(axis, half, from_m + off_m, -off_m) > known_m - off_m,
          words("azimuth %.1f, elevation %.1f, half %.1f: from %.2f, free to %.4f of %.2f m, truly to %.4f",
                geo_deg(az), geo_deg(el), geo_deg(half), from_m, known_m, to_m, truly_m));
    json_decref(a);
}

static void ask_cone(void)
{
    const double az = any_azimuth(), most_el = fmax(0.03, geo_rad(vehicle->high_deg)),
                 el = uniform(-most_el, most_el), half = geo_rad(trial->basin ? 7.5 : uniform(0, 7.5));
    double axis[3];
    geo_direction(az, el, axis);
    const double free_m = free_cone(axis, half, FROM_M, 0), to_m = as_far_as(free_m);
    json_t *a = ask("blocked", json_pack("{s:f, s:f, s:f, s:f}", "azimuth_deg", geo_deg(az), "elevation_deg",
                                         geo_deg(el), "distance_m", to_m, "half_angle_deg", geo_deg(half)));
    const double from_m = fmax(FROM_M, number(a, "blind_to_m")), known_m = fmin(to_m, number(a, "free_to_m"));
    const char *what = words("azimuth %.1f, half %.1f, to %.2f m: from %.2f, free to %.4f, truly to %.4f",
                             geo_deg(az), geo_deg(half), to_m, from_m, known_m, free_m);
    const double off_m = excuse_m(a);
    const struct spoken of = {FROM_M, says(a, "clear") ? from_m : 0}, excused = {FROM_M, from_m + off_m};
    judge(CONE, says(a, "clear"), free_cone_of(axis, half, of, 0) > to_m,
          off_m > 0 && free_cone_of(axis, half, excused, -off_m) > to_m - off_m, what);
    judge_amply(CONE, a, says(a, "clear"), free_cone(axis, half, FROM_M, AMPLE_M) > to_m + AMPLE_M);
    judge(FREE_TO, known_m > from_m, free_cone(axis, half, from_m, 0) > known_m,
          off_m > 0 && free_cone(axis, half, from_m + off_m, -off_m) > known_m - off_m, what);
    ask_records(axis, half, to_m, a);
    json_decref(a);
}

static void ask_corridor(void)
{
    const double az = any_azimuth(), radius_m = trial->basin ? d.conf.vehicle.radius_m : uniform(0, 0.4);
    double axis[3];
    geo_direction(az, 0, axis);
    const double free_m = free_corridor(axis, radius_m, FROM_M), to_m = as_far_as(free_m);
    json_t *a = ask("blocked", json_pack("{s:f, s:f, s:f}", "azimuth_deg", geo_deg(az), "distance_m", to_m,
                                         "radius_m", radius_m));
    const double from_m = says(a, "clear") ? fmax(FROM_M, number(a, "blind_to_m")) : FROM_M;
    const double off_m = excuse_m(a);
    const struct spoken of = {FROM_M, from_m}, excused = {FROM_M, from_m + off_m};
    judge(CORRIDOR, says(a, "clear"), free_corridor_of(axis, radius_m, of) > to_m,
          off_m > 0 && free_corridor_of(axis, radius_m - off_m, excused) > to_m - off_m,
          words("azimuth %.1f, radius %.2f, to %.2f m, truly to %.2f", geo_deg(az), radius_m, to_m, free_m));
    judge_amply(CORRIDOR, a, says(a, "clear"), free_corridor(axis, radius_m + AMPLE_M, FROM_M) > to_m + AMPLE_M);
    json_decref(a);
}

/* A point ends what is amply clear in the sectors that it is near to. */
static void spare_sectors(int n, const double v[3], double *amply_m)
{
    const double az = atan2(v[1], v[0]), level = hypot(v[0], v[1]), width = GEO_TURN / n;
    const double aside = level > AMPLE_M ? asin(AMPLE_M / level) : GEO_PI / 2;
    const int from = (int)floor((az - aside) / width + 0.5), to = (int)floor((az + aside) / width + 0.5);
    for (int k = from; k <= to; k++)
        amply_m[(k + n) % n] = fmin(amply_m[(k + n) % n], hypot(level, v[2]));
}

/* How far sector k of n is free, away from its edges. */
static double free_sector_of(int k, int n, double half_el, struct spoken of, double away_m)
{
    double first_m = INFINITY;
    for (int i = 0; i < n_points; i++) {
        const double *v = seen[i], level = hypot(v[0], v[1]), r = hypot(level, v[2]);
        const double aside = GEO_PI / n - fabs(geo_wrap_pi(atan2(v[1], v[0]) - k * GEO_TURN / n));
        if (fabs(v[2]) <= level * tan(half_el) - away_m && sin(fmin(aside, GEO_PI / 2)) * level >= away_m &&
            is_spoken_of(i, r, &of))
            first_m = fmin(first_m, r);
    }
    return first_m;
}

static double free_sector(int k, int n, double half_el, double from_m, double away_m)
{
    return free_sector_of(k, n, half_el, (struct spoken){from_m, 0}, away_m);
}

static void ask_sectors(void)
{
    const int n = (int)uniform(4, 73);
    const double half_el = geo_rad(uniform(1, 6));
    double free_m[72], amply_m[72];
    for (int k = 0; k < n; k++)
        amply_m[k] = free_m[k] = INFINITY;
    for (int i = 0; i < n_points; i++) {
        const double *v = seen[i], level = hypot(v[0], v[1]);
        double *m = &free_m[(int)(geo_wrap(atan2(v[1], v[0])) / GEO_TURN * n + 0.5) % n];
        if (fabs(v[2]) <= level * tan(half_el))
            *m = fmin(*m, hypot(level, v[2]));
        if (fabs(v[2]) <= level * tan(half_el) + AMPLE_M)
            spare_sectors(n, v, amply_m);
    }
    const double to_m = as_far_as(free_m[(int)uniform(0, n)]);
    json_t *a = ask("sectors", json_pack("{s:i, s:f, s:[f, f]}", "count", n, "distance_m", to_m, "elevation_deg",
                                         -geo_deg(half_el), geo_deg(half_el)));
    for (int k = 0; k < n; k++) {
        const double farthest = fabs(geo_wrap_pi(k * GEO_TURN / n)) + GEO_PI / n;
        if (vehicle->ahead_deg > 0 && farthest > geo_rad(vehicle->ahead_deg))
            continue;
        const json_t *sector = json_array_get(json_object_get(a, "sectors"), (size_t)k);
        /* as of a cone: what is nearer than blind_to_m is not spoken of */
        const double known_m = fmin(to_m, number(sector, "free_to_m"));
        const double from_m = fmax(FROM_M, number(sector, "blind_to_m"));
        const double free_beyond_m = free_sector(k, n, half_el, from_m, 0);
        const char *what = words("%d of %d to %.2f m, %.1f high: from %.2f, free to %.4f, truly to %.4f", k, n,
                                 to_m, geo_deg(half_el), from_m, known_m, free_beyond_m);
        /* blocked at any range: what is asked for may be free all the same */
        judge_amply(SECTORS, sector, says(sector, "clear") || known_m >= to_m, amply_m[k] > to_m + AMPLE_M);
        const double off_m = excuse_m(sector);
        const double within_m =
            off_m > 0 && free_m[k] <= to_m ? free_sector(k, n, half_el, from_m + off_m, off_m) : 0;
        const bool clear = says(sector, "clear") || (known_m >= to_m && from_m < to_m);
        const struct spoken of = {FROM_M, from_m}, excused = {FROM_M, from_m + off_m};
        const bool said = says(sector, "clear");
        const double spoken_m = said ? free_sector_of(k, n, half_el, of, 0) : free_beyond_m,
                     excused_m = said && off_m > 0 ? free_sector_of(k, n, half_el, excused, off_m) : within_m;
        judge(SECTORS, clear, (clear ? spoken_m : free_m[k]) > to_m, excused_m > to_m - off_m, what);
        judge(FREE_TO, known_m > from_m, free_beyond_m > known_m, within_m > known_m - off_m, what);
    }
    json_decref(a);
}

/* The directions that `nearest` is asked for. */
struct around {
    double half_el, middle_rad, half_az; /* half_az: pi, all around */
};

/* How far the water is free in them, away from their edges; negative: and beside them. */
static double free_around(const struct around *w, double from_m, double away_m)
{
    double free_m = INFINITY;
    for (int i = 0; i < n_points; i++) {
        const double *v = seen[i], level = hypot(v[0], v[1]), r = hypot(level, v[2]);
        const double inside = w->half_az - fabs(geo_wrap_pi(atan2(v[1], v[0]) - w->middle_rad));
        const double within = fmax(-GEO_PI / 2, fmin(inside, GEO_PI / 2));
        if (r >= from_m && fabs(v[2]) <= level * tan(w->half_el) - fmax(away_m, 0) &&
            (w->half_az >= GEO_PI || level * sin(within) >= away_m))
            free_m = fmin(free_m, r);
    }
    return free_m;
}

/* Draws that leave those of the other questions as they are. */
static uint64_t own_dice(void)
{
    return seed ^ 0x9e3779b97f4a7c15;
}

/* A fan is asked for what it sees. */
static struct around any_around(double half_el)
{
    const double most = vehicle->ahead_deg > 0 ? vehicle->ahead_deg : 180, half = uniform(2, most);
    const bool all = vehicle->ahead_deg <= 0 && uniform(0, 1) < 0.5;
    return (struct around){.half_el = half_el,
                           .middle_rad = geo_rad(uniform(half - most, most - half)),
                           .half_az = all ? GEO_PI : geo_rad(half)};
}

static void ask_nearest(void)
{
    const double half_el = geo_rad(uniform(1, 6));
    double to_m = as_far_as(free_around(&(struct around){half_el, 0, GEO_PI}, 0, 0));
    const uint64_t rest = seed;
    seed = own_dice();
    const struct around w = any_around(half_el);
    const double free_m = free_around(&w, 0, 0);
    if (w.half_az < GEO_PI)
        to_m = as_far_as(free_m);
    seed = rest;
    const double from = w.half_az >= GEO_PI ? 0 : geo_deg(w.middle_rad - w.half_az),
                 to = w.half_az >= GEO_PI ? 0 : geo_deg(w.middle_rad + w.half_az);
    json_t *a = ask("nearest", json_pack("{s:f, s:[f, f], s:[f, f]}", "distance_m", to_m, "azimuth_deg", from, to,
                                         "elevation_deg", -geo_deg(w.half_el), geo_deg(w.half_el)));
    const double off_m = excuse_m(a);
    judge(NEAREST, says(a, "clear"), free_m > to_m,
          off_m > 0 && free_around(&w, FROM_M + off_m, off_m) > to_m - off_m,
          words("%.1f to %.1f degrees, to %.2f m, %.1f high, truly to %.2f", from, to, to_m, geo_deg(w.half_el),
                free_m));
    judge_amply(NEAREST, a, says(a, "clear"), free_around(&w, 0, -AMPLE_M) > to_m + AMPLE_M);
    json_decref(a);
}

static void ask_motion(void)
{
    const double az = any_azimuth(), speed = uniform(0.2, 1);
    const struct conf_vehicle *c = &d.conf.vehicle;
    double axis[3];
    geo_direction(az, 0, axis);
    const double touch_m = free_sweep(axis, c->radius_m, c->height_m / 2, 0),
                 ahead_s = fmax(0.2, (as_far_as(touch_m + c->radius_m) - c->radius_m) / speed);
    json_t *a = ask("time_to_collision", json_pack("{s:[f, f, f], s:f}", "velocity_mps", speed * axis[0],
                                                   speed * axis[1], 0.0, "ahead_s", ahead_s));
    const double off_m = excuse_m(a);
    judge(
        COLLISION, says(a, "clear"), touch_m > speed * ahead_s,
        free_sweep(axis, c->radius_m - off_m, c->height_m / 2 - off_m, c->near_m) > speed * ahead_s - off_m,
        words("azimuth %.1f, %.2f m/s for %.1f s, truly for %.2f", geo_deg(az), speed, ahead_s, touch_m / speed));
    const bool clear = says(a, "clear");
    judge_amply(COLLISION, a, clear,
                free_sweep(axis, c->radius_m + AMPLE_M, c->height_m / 2 + AMPLE_M, 0) > speed * ahead_s &&
                    (clear || was_way_heard(axis, speed * ahead_s)));
    json_decref(a);
    a = ask("limit", json_pack("{s:[f, f, f]}", "velocity_mps", speed * axis[0], speed * axis[1], 0.0));
    const double free_m = free_sweep(axis, c->radius_m + c->margin_m, c->height_m / 2 + c->margin_m, 0),
                 known_m = fmin(number(a, "free_m"), number(a, "stop_m"));
    const double wide_m = c->margin_m - excuse_m(a);
    judge(LIMIT, known_m > 0, free_m > known_m,
          free_sweep(axis, c->radius_m + wide_m, c->height_m / 2 + wide_m, c->near_m) > known_m - excuse_m(a),
          words("azimuth %.1f, %.2f m/s: %.2f m, truly %.2f", geo_deg(az), speed, known_m, free_m));
    json_decref(a);
}

/* What asking for more of the same must not do. */
static void never_clear(const char *more, const json_t *before, json_t *after)
{
    if (says(before, "blocked") && says(after, "clear")) {
        printf("at %.3f s blocked, and clear with more %s\n", (double)loop_now(d.loop) * 1e-9, more);
        test_case_failed = true;
    }
    json_decref(after);
}

static json_t *cone(double az_deg, double to_m, const char *wide, double how_wide)
{
    return ask("blocked", json_pack("{s:f, s:f, s:f}", "azimuth_deg", az_deg, "distance_m", to_m, wide, how_wide));
}

/* Nor asking for less of what is clear. */
static void stays_clear(const json_t *before, double to_m, json_t *after)
{
    if (says(before, "clear") && !says(after, "clear")) {
        printf("at %.3f s clear, and not so to %.2f m: %s\n", (double)loop_now(d.loop) * 1e-9, to_m,
               json_string_value(json_object_get(after, "reason")));
        test_case_failed = true;
    }
    json_decref(after);
}

static json_t *sectors(double to_m, double half_el_deg)
{
    return ask("sectors", json_pack("{s:i, s:f, s:[f, f]}", "count", 24, "distance_m", to_m, "elevation_deg",
                                    -half_el_deg, half_el_deg));
}

/* Each sector, to a part of the distance; and what is blocked in one is so in the cone that holds it. */
static void ask_for_less_around(double to_m, double less_m)
{
    json_t *far_ones = sectors(to_m, 5), *near_ones = sectors(less_m, 5);
    for (size_t k = 0; k < 24; k++) {
        const json_t *far_one = json_array_get(json_object_get(far_ones, "sectors"), k);
        json_t *near_one = json_array_get(json_object_get(near_ones, "sectors"), k);
        if (k % 6 == 0 && says(far_one, "clear"))
            stays_clear(far_one, to_m, cone((double)k * 15, to_m, "half_angle_deg", 2));
        stays_clear(far_one, less_m, json_incref(near_one));
    }
    json_decref(near_ones);
    json_decref(far_ones);
}

static json_t *collision(double az_deg, double ahead_s)
{
    const double az = geo_rad(az_deg);
    return ask("time_to_collision", json_pack("{s:[f, f, f], s:f}", "velocity_mps", 0.5 * cos(az), 0.5 * sin(az),
                                              0.0, "ahead_s", ahead_s));
}

static json_t *limit(double az_deg)
{
    const double az = geo_rad(az_deg);
    return ask("limit", json_pack("{s:[f, f, f]}", "velocity_mps", cos(az), sin(az), 0.0));
}

/* half_deg: of the azimuths, about the bow; 180: all around. */
static json_t *nearest(double to_m, double half_deg, double half_el_deg)
{
    return ask("nearest", json_pack("{s:f, s:[f, f], s:[f, f]}", "distance_m", to_m, "azimuth_deg", -half_deg,
                                    half_deg, "elevation_deg", -half_el_deg, half_el_deg));
}

static void ask_for_more_around(void)
{
    const double to_m = uniform(1, 9), half_el = uniform(1, 10);
    uint64_t dice = own_dice();
    const double half = 5 + 165 * test_uniform(&dice), wider = half + (180 - half) * test_uniform(&dice);
    json_t *a = nearest(to_m, half, half_el);
    never_clear("distance around", a, nearest(to_m + uniform(0, 3), half, half_el));
    never_clear("height around", a, nearest(to_m, half, half_el + uniform(0, 30)));
    never_clear("bearings around", a, nearest(to_m, wider, half_el));
    never_clear("all bearings", a, nearest(to_m, 180, half_el));
    json_decref(a);
}

static void ask_for_more(void)
{
    const double az = uniform(0, 360), to_m = uniform(1, 9), half = uniform(0, 10), radius_m = uniform(0, 0.6);
    uint64_t dice = own_dice();
    const double less_m = to_m * (0.1 + 0.9 * test_uniform(&dice));
    struct conf_vehicle *c = &d.conf.vehicle;
    const struct conf_vehicle was = *c;
    json_t *a = cone(az, to_m, "half_angle_deg", half);
    never_clear("angle", a, cone(az, to_m, "half_angle_deg", half + uniform(0, 30)));
    never_clear("distance", a, cone(az, to_m + uniform(0, 3), "half_angle_deg", half));
    stays_clear(a, less_m, cone(az, less_m, "half_angle_deg", half));
    json_decref(a);
    ask_for_less_around(to_m, less_m);
    a = cone(az, to_m, "radius_m", radius_m);
    stays_clear(a, less_m, cone(az, less_m, "radius_m", radius_m));
    never_clear("radius", a, cone(az, to_m, "radius_m", radius_m + uniform(0, 1)));
    json_decref(a);
    a = collision(az, to_m);
    never_clear("time", a, collision(az, to_m + uniform(0, 3)));
    json_t *slow = limit(az);
    c->radius_m += uniform(0, 0.3);
    c->margin_m += uniform(0, 0.3);
    never_clear("body", a, collision(az, to_m));
    json_t *slower = limit(az);
    CHECK(number(slower, "speed_mps") <= number(slow, "speed_mps") + 1e-6);
    *c = was;
    json_decref(slower);
    json_decref(slow);
    json_decref(a);
}

/* Nobody pings and nobody tells a pose any more. */
static void grow_old(void)
{
    const double az = uniform(0, 360), to_m = uniform(1, 9);
    const uint64_t now_ns = loop_now(d.loop);
    json_t *narrow = cone(az, to_m, "half_angle_deg", 3), *wide = cone(az, to_m, "radius_m", 0.3),
           *ahead = collision(az, to_m);
    for (int i = 1; i < 30; i++) {
        loop_advance(d.loop, now_ns + (unsigned)i * (SECOND / 10));
        never_clear("age", narrow, cone(az, to_m, "half_angle_deg", 3));
        never_clear("age", wide, cone(az, to_m, "radius_m", 0.3));
        never_clear("age", ahead, collision(az, to_m));
    }
    json_decref(narrow);
    json_decref(wide);
    json_decref(ahead);
}

static void ask_everything(uint64_t now_ns)
{
    struct pose p;
    truth((double)now_ns * 1e-9, &p);
    look_from(&p, &mount_identity);
    for (int i = 0; i < 8; i++) {
        ask_cone();
        ask_corridor();
        ask_motion();
    }
    for (int i = 0; i < 2; i++)
        ask_sectors();
    for (int i = 0; i < (trial->basin ? 8 : 2); i++)
        ask_nearest();
    ask_for_more();
    ask_for_more_around();
}

/* As fast as it went since the last pose, but for what the water did of it. */
static void tell_bound(uint64_t t_ns, double off_s)
{
    double mps[DRIFT_WAYS] = {0};
    for (int i = 0; i <= 10; i++) {
        struct pose p;
        truth((double)(t_ns - trial->period_ns / 10 * (uint64_t)i) * 1e-9 - off_s, &p);
        mps[DRIFT_LEVEL] = fmax(mps[DRIFT_LEVEL], hypot(p.velocity_mps[0], p.velocity_mps[1]) + 1e-3);
        mps[DRIFT_VERTICAL] = fmax(mps[DRIFT_VERTICAL], fabs(p.velocity_mps[2]) + 1e-3);
    }
    for (int k = 0; k < DRIFT_WAYS; k++)
        mps[k] = fmax(mps[k] - trial->water_mps, 0);
    if (uniform(0, 1) < 0.98)
        pose_log_bound(&d.poses, t_ns, mps);
}

/* ---- a run ---- */

/* The gate runs a part of the worlds, and LONG=1 all of them. */
static inline bool is_long(void)
{
    return getenv("LONG") != NULL;
}

static void run_world(void)
{
    const uint64_t started_ns = 100 * SECOND, end_ns = started_ns + (uint64_t)(WORLD_S * 1e9);
    uint64_t next_pose = started_ns, next_ping[HEADS];
    uint64_t next_ask = started_ns + (trial->early ? SECOND + SECOND / 5 : 8 * SECOND);
    uint32_t pings[HEADS] = {0};
    uint64_t late_ns[HEADS];
    const double pose_off_s = trial->doubt_s > 0 ? uniform(-trial->doubt_s, trial->doubt_s) : 0;
    for (int i = 0; i < HEADS; i++) {
        const double by_s = trial->delay_by_s > 0 ? uniform(-trial->delay_by_s, trial->delay_by_s) : 0;
        late_ns[i] = (uint64_t)((trial->delay_s + by_s) * 1e9);
    }
    pose_log_set_delay(&d.poses, 0, (uint64_t)(trial->doubt_s * 1e9));
    const uint64_t out_ns = started_ns + (uint64_t)(uniform(5, WORLD_S - OUT_S) * 1e9);
    n_heard = 0;
    make_world();
    begin_true(started_ns);
    way_phase = uniform(0, GEO_TURN);
    for (int i = 0; i < 4; i++)
        way_hz[i] = uniform(0.01, 0.055);
    for (int i = 0; i < vehicle->heads; i++)
        next_ping[i] = started_ns + SECOND + (uint64_t)(uniform(0, 1) * 1e8);
    for (uint64_t t = started_ns; t < end_ns; t += SECOND / 200) {
        loop_advance(d.loop, t);
        for (; next_pose + trial->late_ns <= t; next_pose += trial->period_ns) {
            struct pose p;
            truth((double)next_pose * 1e-9 - pose_off_s, &p);
            p.t_ns = next_pose;
            be_off(&p);
            turn_north(&p);
            leave_out(&p);
            if (uniform(0, 1) >= trial->lost && p.has && pose_log_put(&d.poses, &p))
                pose_taken(&d, &p);
            if (trial->water_mps > 0)
                tell_bound(next_pose, pose_off_s);
        }
        for (int i = 0; i < vehicle->heads; i++)
            for (; next_ping[i] + late_ns[i] + SECOND / 50 <= t; next_ping[i] += vehicle->head[i].period_ns) {
                pings[i]++;
                if (uniform(0, 1) >= 0.05 &&
                    (next_ping[i] < out_ns || next_ping[i] > out_ns + (uint64_t)(OUT_S * 1e9)))
                    send_ping(i, next_ping[i], late_ns[i], pings[i]);
            }
        if (t >= next_ask) {
            ask_everything(t);
            next_ask = t + (uint64_t)(uniform(0.2, 1.2) * (is_long() || trial->often ? 1 : SELDOM) * 1e9);
        }
    }
}

static void tell(void)
{
    static const char *const whys[WHYS] = {[ANSWER_BEYOND] = "beyond",
                                           [ANSWER_BLIND] = "blind",
                                           [ANSWER_MOVED] = "moved",
                                           [ANSWER_STALE] = "old",
                                           [ANSWER_NEVER] = "never"};
    printf("# %-18s %8s %8s %8s %8s %8s %10s %8s %10s  %s\n", "question", "asked", "clear", "false", "excused",
           "truly", "not said", "amply", "not said", "reasons");
    for (int q = 0; q < QUESTIONS; q++) {
        printf("# %-18s %8ld %8ld %8ld %8ld %8ld %8.0f %% %8ld %8.0f %%  blocked %ld", names[q], count[q].asked,
               count[q].clear, count[q].false_clear, count[q].excused, count[q].truly_clear,
               100.0 * (double)count[q].held_back / fmax(1, (double)count[q].truly_clear), count[q].amply_clear,
               100.0 * (double)count[q].amply_held_back / fmax(1, (double)count[q].amply_clear), count[q].blocked);
        for (int i = 0; i < WHYS; i++)
            if (count[q].why[i])
                printf(", %s %ld", whys[i] ? whys[i] : answer_reason_text((enum answer_reason)i), count[q].why[i]);
        printf("\n");
    }
}

/*
 * A vehicle must be able to go somewhere, so that enough of what is clear must be said. How much that is depends on the
 * worlds: it is held to in those of every day alone, while nothing false may be said in any.
 */
#define USEFUL(what) CHECK(sanitized() || getenv("SONARD_SEED") || (what))

/* So many worlds, with one vehicle after the other; half as many under a sanitizer: each takes twenty times as long. */
static void run_with(const struct trial *t, int vehicles, int worlds)
{
    if (sanitized())
        worlds = (worlds + 1) / 2;
    memset(count, 0, sizeof count);
    trial = t;
    for (int i = 0; i < worlds; i++) {
        vehicle = &t->vehicle[i % vehicles];
        if (!rig_start(vehicle->conf)) {
            printf("cannot start\n");
            test_case_failed = true;
            return;
        }
        run_world();
        grow_old();
        rig_end();
    }
    tell();
    long false_clear = 0;
    for (int q = 0; q < QUESTIONS; q++) {
        false_clear += count[q].false_clear;
        CHECK(trial->provokes || count[q].false_clear == 0);
        CHECK(count[q].asked > 0);
    }
    USEFUL(!trial->provokes || false_clear > 0);
}

/* One, if not all of them. */
static inline int worlds(int all)
{
    return is_long() ? all : 1;
}

/* The share of what is amply clear that is said. */
static double amply_told_share(enum question q)
{
    return 1 - (double)count[q].amply_held_back / fmax(1, (double)count[q].amply_clear);
}

#endif
