/* SPDX-License-Identifier: MIT */
#include "micron_scan.h"

#include <math.h>
#include <stdlib.h>

#include "micron.h"

void micron_scan_init(struct micron_scan *scan, unsigned step, uint64_t circle_ns)
{
    *scan = (struct micron_scan){.steer = {.circle_ns = circle_ns}, .step = step};
}

void micron_scan_steer(struct micron_scan *scan, double from_rad, double to_rad, bool only)
{
    const double units = MICRON_TURN / GEO_TURN;
    const unsigned span = (unsigned)lround(geo_wrap(to_rad - from_rad) * units) % MICRON_TURN;
    const unsigned from = ((unsigned)lround(geo_wrap(from_rad) * units) + MICRON_AHEAD) % MICRON_TURN;
    scan->only = only;
    scan->steer_first = from - from % scan->step;
    scan->steer_n = span ? span / scan->step + 1 : 0;
}

static void begin_stretch(struct micron_scan *scan, bool pass)
{
    scan->pass = pass;
    scan->left = pass ? scan->steer_first : scan->at;
    scan->n = scan->steer_n;
    scan->pings = 0;
    scan->plain = pass ? 0 : scan->plain;
    scan->saw_left = scan->saw_right = false;
}

/* The plain scan goes on behind the stretch that is done. */
static void go_on(struct micron_scan *scan, uint64_t now_ns)
{
    const unsigned units = scan->n * scan->step;
    scan->at = (scan->at + units) % MICRON_TURN;
    scan->at -= scan->at % scan->step;
    scan->done += units;
    scan->plain += scan->n;
    if (scan->done >= MICRON_TURN) {
        scan->done -= MICRON_TURN;
        steer_begin(&scan->steer, now_ns);
    }
}

/* Both ends were reached; a head that never comes there is not waited for. */
static bool is_done(struct micron_scan *scan, unsigned bearing)
{
    const unsigned right = scan->left + (scan->n - 1) * scan->step;
    scan->saw_left |= (unsigned)abs(micron_angle_to(bearing, scan->left % MICRON_TURN)) < scan->step;
    scan->saw_right |= (unsigned)abs(micron_angle_to(bearing, right % MICRON_TURN)) < scan->step;
    return (scan->saw_left && scan->saw_right) || ++scan->pings > 2 * scan->n + 2;
}

bool micron_scan_ping(struct micron_scan *scan, unsigned bearing, uint64_t now_ns)
{
    steer_ping(&scan->steer);
    if (!scan->n) {
        if (!scan->steer_n)
            return false;
        scan->at = (bearing + scan->step) % MICRON_TURN;
        scan->at -= scan->at % scan->step;
        scan->done = 0;
        steer_begin(&scan->steer, now_ns);
        begin_stretch(scan, false);
        return true;
    }
    if (!is_done(scan, bearing))
        return false;
    if (!scan->pass)
        go_on(scan, now_ns);
    /* a stretch that begins within the limits is run through twice */
    const bool pass = scan->steer_n &&
                      (scan->only || (!scan->pass && steer_has_time(&scan->steer, scan->plain, 2 * scan->steer_n,
                                                                    MICRON_TURN / scan->step, now_ns)));
    begin_stretch(scan, pass);
    return true;
}

bool micron_scan_limits(const struct micron_scan *scan, unsigned *left, unsigned *right)
{
    *left = scan->left;
    *right = (scan->left + (scan->n ? scan->n - 1 : 0) * scan->step) % MICRON_TURN;
    return scan->n != 0;
}
