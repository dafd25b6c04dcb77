/* SPDX-License-Identifier: MIT */
/*
 * test_speed_bound - a virtual BlueROV2 (rov.h) is steered through manoeuvres; the bound, which knows its pulses and
 * how it is tilted, is never less than it goes. With LONG=1 ten thousand dives. And why there is none by two samples a
 * second: what half a second hides, and what the autopilot may do in it.
 */
#include "client/mavlink/speed_bound.h"
#include "tests/lib/rov.h"
#include "tests/lib/test.h"

#define STEP_S   0.01
#define SAMPLE_S 0.05
#define STEER_S  0.02
#define VOLTS    16.8
#define WINDOWS  6

enum manoeuvre { HOVER, TURN, CREEP, AHEAD, BRAKE, DIVE, STICKS, PITCHED, FREE, MANOEUVRES };

static const char *const names[] = {"hover", "turn in place", "creep ahead", "full ahead",    "ahead and back",
                                    "dive",  "sticks",        "pitched",     "sticks, manual"};

static const double window_s[WINDOWS] = {0.5, 1, 2, 5, 10, 20};

static uint64_t seed;

struct dive {
    struct rov rov;
    struct rov_sticks sticks;
    enum manoeuvre what;
    struct speed_bound bound;
    double next_s;           /* when the pilot does something else */
    double tilt_off[2];      /* of the attitude that is told */
    double may_m[2], went_m; /* allowed for, and what it went in fact */
    int last_us[8];
    double last_down[3], last_yaw_rad;
    bool knows_climb;
    double climb_mps; /* on the average of two seconds */
};

static double draw(struct dive *d, double lo, double hi)
{
    return rov_draw(&d->rov, lo, hi);
}

/* What the pilot does, from time to time. */
static void pilot(struct dive *d, double t_s)
{
    double *axis = d->sticks.axis;
    if (t_s < d->next_s)
        return;
    d->next_s = t_s + draw(d, 0.5, 6);
    memset(axis, 0, 6 * sizeof *axis);
    switch (d->what) {
    case TURN:
        d->sticks.yaw_rad += draw(d, -2, 2);
        break;
    case CREEP:
        axis[4] = draw(d, 0.1, 0.25);
        break;
    case AHEAD:
        axis[4] = draw(d, 0.5, 1);
        break;
    case BRAKE:
        axis[4] = draw(d, -1, 1) < 0 ? -0.8 : 0.8;
        break;
    case DIVE:
        d->sticks.depth_m += draw(d, -3, 3);
        break;
    case STICKS:
    case FREE:
        for (int i = 2; i < 6; i++)
            axis[i] = draw(d, 0, 1) < 0.5 ? draw(d, -1, 1) * draw(d, 0, 1) : 0;
        d->sticks.heads = d->what == STICKS && axis[2] == 0;
        break;
    case PITCHED:
        axis[1] = draw(d, -1, 1);
        axis[4] = draw(d, -0.4, 0.4);
        axis[3] = draw(d, -0.4, 0.4);
        break;
    default:
        break;
    }
}

static void down_of(struct dive *d, double down[3])
{
    double m[3][3];
    rov_axes(&d->rov, m);
    memcpy(down, m[2], 3 * sizeof *down);
    down[0] += d->tilt_off[0];
    down[1] += d->tilt_off[1];
    const double size = sqrt(down[0] * down[0] + down[1] * down[1] + down[2] * down[2]);
    for (int i = 0; i < 3; i++)
        down[i] /= size;
}

static double heading_of(const struct rov *r)
{
    double m[3][3];
    rov_axes(r, m);
    return atan2(m[1][0], m[0][0]);
}

/* A message with the pulses has come: between it and the last one the motors did one or the other. */
static void sample(struct dive *d, double dt_s)
{
    struct speed_bound_push push = {.frame = thrust_frame(d->rov.heavy ? 2 : 1), .tilt_known = true};
    const double yaw_rad = heading_of(&d->rov);
    double ground[3];
    rov_velocity(&d->rov, ground);
    d->climb_mps += (ground[2] + draw(d, -0.02, 0.02) - d->climb_mps) * (1 - exp(-dt_s / 2));
    push.climb_known = d->knows_climb;
    push.climb_mps = fabs(d->climb_mps) + 0.03;
    push.turned_rad = remainder(yaw_rad - d->last_yaw_rad, 6.28318530717958648);
    memcpy(push.down[0], d->last_down, sizeof push.down[0]);
    down_of(d, push.down[1]);
    for (int k = 0; k < push.frame->n; k++) {
        const struct thrust_motor *m = &push.frame->motor[k];
        const struct thrust_range a = thrust_range(m, d->last_us[k], d->rov.direction[k], VOLTS),
                                  b = thrust_range(m, d->rov.pulse_us[k], d->rov.direction[k], VOLTS);
        push.thrust[k] = (struct thrust_range){fmin(a.least_n, b.least_n), fmax(a.most_n, b.most_n)};
    }
    speed_bound_step(&d->bound, &push, dt_s);
    memcpy(d->last_down, push.down[1], sizeof d->last_down);
    d->last_yaw_rad = yaw_rad;
    memcpy(d->last_us, d->rov.pulse_us, sizeof d->last_us);
}

static void start(struct dive *d, enum manoeuvre what, uint64_t of)
{
    *d = (struct dive){.what = what};
    rov_start(&d->rov, of, what == PITCHED || (of >> 20 & 1), (of >> 21 & 1) ? 0.05 : 0.3);
    d->rov.place_m[2] = d->sticks.depth_m = 10;
    d->sticks.levels = what != FREE && what != PITCHED;
    d->sticks.heads = d->sticks.levels;
    d->sticks.deep = d->sticks.levels && what != STICKS;
    d->knows_climb = of >> 22 & 1;
    const double off = draw(d, 0, 1.8 / 57.3), to = draw(d, 0, 6.3);
    d->tilt_off[0] = off * cos(to);
    d->tilt_off[1] = off * sin(to);
    for (int k = 0; k < 8; k++)
        d->last_us[k] = 1500;
    down_of(d, d->last_down);
    speed_bound_start(&d->bound, &(struct speed_bound_conf){0});
}

/* Rests until the bound no longer remembers the start. */
#define REST_S  25
#define DIVE_S  60
#define SAMPLES ((REST_S + DIVE_S) * 20)

/* Where it was at each sample, and what was allowed for by then. */
static double place[SAMPLES][3], may_m[SAMPLES][2];

static bool is_beyond(int from, int to)
{
    const double level_m = hypot(place[to][0] - place[from][0], place[to][1] - place[from][1]);
    return level_m > may_m[to][0] - may_m[from][0] + 1e-9 ||
           fabs(place[to][2] - place[from][2]) > may_m[to][1] - may_m[from][1] + 1e-9;
}

/* How much more was allowed for than it went, after the rest; 0: it went farther than allowed, once. */
static double ratio_of(enum manoeuvre what, uint64_t of)
{
    static struct dive d;
    double before[2], went_m = 0, t_s = 0;
    const int rest = REST_S * 20;
    start(&d, what, of);
    speed_bound_mps(&d.bound, before);
    for (int n = 0; n < SAMPLES; n++) {
        for (int i = 0; i < (int)lround(SAMPLE_S / STEP_S); i++, t_s += STEP_S) {
            if (fmod(t_s + 1e-9, STEER_S) < STEP_S && t_s >= REST_S - 15) {
                if (t_s > REST_S)
                    pilot(&d, t_s);
                rov_steer(&d.rov, &d.sticks);
            }
            rov_step(&d.rov, STEP_S);
        }
        sample(&d, SAMPLE_S);
        double mps[2];
        speed_bound_mps(&d.bound, mps);
        for (int k = 0; k < 2; k++) {
            d.may_m[k] += (fmax(mps[k], before[k]) + (k == 0 ? d.rov.most_current_mps : 0)) * SAMPLE_S;
            before[k] = mps[k];
            may_m[n][k] = d.may_m[k];
        }
        memcpy(place[n], d.rov.place_m, sizeof place[n]);
        if (n > rest)
            went_m += hypot(place[n][0] - place[n - 1][0], place[n][1] - place[n - 1][1]);
        for (int w = 0; w < WINDOWS; w++) {
            const int from = n - (int)(window_s[w] / SAMPLE_S);
            if (from >= 0 && is_beyond(from, n)) {
                printf("%s, dive %" PRIu64 ": at %.2f s beyond the bound over %g s\n", names[what], of, t_s,
                       window_s[w]);
                return 0;
            }
        }
    }
    return (may_m[SAMPLES - 1][0] - may_m[rest][0]) / fmax(went_m, 1e-3);
}

TEST(no_vehicle_is_faster)
{
    const int dives = getenv("LONG") ? 10000 / MANOEUVRES + 1 : 22;
    for (int what = 0; what < MANOEUVRES; what++) {
        double sum = 0, bound = 0;
        for (int i = 0; i < dives; i++) {
            const uint64_t of = test_random(&seed);
            const double ratio = ratio_of((enum manoeuvre)what, of);
            CHECK(ratio > 0);
            sum += ratio;
            bound += (may_m[SAMPLES - 1][0] - may_m[REST_S * 20][0]) / DIVE_S;
        }
        printf("%-16s %d dives: %.1f times as far as it went, %.2f m/s\n", names[what], dives, sum / dives,
               bound / dives);
    }
}

/* ---- two samples a second ---- */

#define HALF_MPS 0.75 /* half of a stock vehicle's max_speed: a bound above that is of no use */

/* The bound of a level vehicle that does not climb, once the autopilot's loops alone have long held heading and depth
 * with these shares of all thrust: as hard as that they may push at any time between two samples. */
static double held_mps(bool heavy, double yaw, double up)
{
    static const int turn[4] = {1, -1, -1, 1};
    struct speed_bound bound;
    struct speed_bound_push push = {.frame = thrust_frame(heavy ? 2 : 1),
                                    .tilt_known = true,
                                    .down = {{0, 0, 1}, {0, 0, 1}},
                                    .climb_known = true,
                                    .climb_mps = 0.03};
    double mps[2];
    for (int k = 0; k < push.frame->n; k++) {
        const double effort = k < 4 ? yaw * turn[k] : -up;
        push.thrust[k] =
            thrust_range(&push.frame->motor[k], THRUST_PULSE_MID + (int)lround(400 * effort), 1, VOLTS);
    }
    speed_bound_start(&bound, &(struct speed_bound_conf){0});
    for (int n = 0; n < 1200; n++)
        speed_bound_step(&bound, &push, SAMPLE_S);
    speed_bound_mps(&bound, mps);
    return mps[0];
}

TEST(what_the_autopilot_may_do_in_between_is_too_much)
{
    for (int heavy = 0; heavy < 2; heavy++) {
        const double idle_mps = held_mps(heavy, 0, 0), third_mps = held_mps(heavy, 0.3, 0);
        printf("frame %d: idle %.2f, heading held with 0.3 of all thrust %.2f, with all %.2f, depth with all %.2f "
               "m/s\n",
               heavy + 1, idle_mps, third_mps, held_mps(heavy, 1, 0), held_mps(heavy, 0, 1));
        CHECK(idle_mps < 0.15);
        CHECK(third_mps > HALF_MPS);
    }
}

static void steer(struct rov *r, const struct rov_sticks *sticks, double for_s)
{
    for (int n = 0; n < (int)lround(for_s / STEP_S); n++) {
        rov_steer(r, sticks);
        rov_step(r, STEP_S);
    }
}

/* Both samples, before and behind, find the thrusters idle. */
TEST(two_samples_a_second_miss_what_matters)
{
    const int dives = getenv("LONG") ? 2000 : 20;
    const double idle_mps = held_mps(false, 0, 0);
    double least_mps = INFINITY, most_mps = 0;
    int beyond = 0;
    for (int i = 0; i < dives; i++) {
        struct rov full, tap;
        const struct rov_sticks rest = {.levels = true}, ahead = {.axis = {0, 0, 0, 0, 1, 0}, .levels = true},
                                touch = {.axis = {0, 0, 0, 0, 0.3, 0}, .levels = true};
        rov_start(&full, test_random(&seed), i % 2, 0);
        tap = full;
        steer(&full, &ahead, 0.5);
        const double mps = full.momentum[0] / full.mass[0];
        least_mps = fmin(least_mps, mps);
        most_mps = fmax(most_mps, mps);
        steer(&tap, &touch, 0.4);
        const double from_m = tap.place_m[0];
        steer(&tap, &rest, 1);
        beyond += tap.place_m[0] - from_m > idle_mps;
    }
    printf("full ahead for 0.5 s: %.2f to %.2f m/s; a touch of the stick for 0.4 s: %d of %d dives beyond\n",
           least_mps, most_mps, beyond, dives);
    CHECK(most_mps > HALF_MPS);
    CHECK(2 * beyond > dives);
}

int main(void)
{
    seed = test_seed();
    RUN(no_vehicle_is_faster);
    RUN(what_the_autopilot_may_do_in_between_is_too_much);
    RUN(two_samples_a_second_miss_what_matters);
    return test_end();
}
