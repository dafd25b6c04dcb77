/* SPDX-License-Identifier: MIT */
/*
 * autopilot - a loop that tells sonard where the vehicle is, asks how fast it may go, and never goes faster. Whatever
 * goes wrong, a daemon that is gone included, ends in speed 0.
 *
 *   cc -o autopilot autopilot.c $(pkg-config --cflags --libs libsonard)
 *   ./autopilot [SOCKET [TURNS]]
 *
 * From the source tree, before `make install`, beside libsonard as `make` leaves it:
 *
 *   cc -o autopilot examples/autopilot.c -Iclient/lib build/libsonard.so.0 -Wl,-rpath,$PWD/build
 */
#include <math.h>
#include <sonard.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define TURN_S    0.2
#define PATIENCE  0.1 /* seconds that an answer may take: what comes later is of no use to this turn */
#define AHEAD_M   5.0
#define OPENING   10.0 /* degrees to each side */
#define ALL_TURNS 1000000000

static const double wanted_mps[3] = {1.0, 0, 0}; /* forward, right, down: the pilot's stick */

/* Put the vehicle's own attitude, depth and velocity here: they are its navigation's. */
static struct sonard_pose measure(void)
{
    return (struct sonard_pose){.has = SONARD_POSE_QUATERNION | SONARD_POSE_DEPTH | SONARD_POSE_VELOCITY,
                                .quaternion = {1, 0, 0, 0},
                                .depth_m = 3.0};
}

/* And the motors here. */
static void fly(const double velocity_mps[3], const char *why)
{
    printf("fly %.2f %.2f %.2f: %s\n", velocity_mps[0], velocity_mps[1], velocity_mps[2], why);
    fflush(stdout);
}

/* One turn with a daemon that is there; false: *error says what went wrong, and the vehicle was not told anything. */
static bool turn(struct sonard_client *sonard, struct sonard_error *error)
{
    static const char *const states[] = {"unknown", "blocked", "clear"};
    const struct sonard_pose pose = measure();
    struct sonard_blocked ahead;
    struct sonard_limit limit;
    char why[SONARD_REASON_SIZE + 100];
    if (!sonard_pose(sonard, &pose, error))
        return false;
    if (!sonard_blocked(sonard, SONARD_BODY, &(struct sonard_cone){0, 0, OPENING, AHEAD_M}, &ahead, error) ||
        !sonard_limit(sonard, SONARD_BODY, wanted_mps, &limit, error))
        return false;
    snprintf(why, sizeof why, "%s ahead, limited by %s, %.1f m are free", states[ahead.state],
             limit.limited_by == SONARD_CLEAR ? "nothing" : states[limit.limited_by], limit.free_m);
    fly(limit.velocity_mps, why);
    return true;
}

int main(int argc, char **argv)
{
    const char *path = argc > 1 ? argv[1] : NULL;
    const struct timespec pause = {.tv_nsec = (long)(TURN_S * 1e9)};
    struct sonard_client *sonard = NULL;
    int turns = argc > 2 ? atoi(argv[2]) : ALL_TURNS;
    if (argc > 3 || (path && path[0] == '-')) {
        fputs("usage: autopilot [SOCKET [TURNS]]\n", stderr);
        return 1;
    }
    for (; turns > 0; turns--) {
        struct sonard_error error = {0};
        if (!sonard)
            sonard = sonard_connect(path, PATIENCE, &error);
        if (!sonard || !turn(sonard, &error)) {
            fly((const double[3]){0, 0, 0}, error.message);
            if (error.status == SONARD_LOST) {
                sonard_disconnect(sonard);
                sonard = NULL;
            }
        }
        nanosleep(&pause, NULL);
    }
    sonard_disconnect(sonard);
    return 0;
}
