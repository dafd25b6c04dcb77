/* SPDX-License-Identifier: MIT */
/*
 * ping360_scan - see ping360_scan.h.
 */
#include "ping360_scan.h"

#include <math.h>
#include <stdlib.h>

#include "grid/geometry.h"

#define OWN_STEP_MAX 10 /* gradians, of the head's own scan */

static long gradians(double rad)
{
    return lround(rad * (PING360_TURN / GEO_TURN));
}

void ping360_scan_init(struct ping360_scan *scan, double start_rad, double end_rad, double step_rad)
{
    const double same_rad = 1e-9; /* 360 degrees are a turn, whatever their factor made of them */
    double span_rad = fmod(end_rad - start_rad, GEO_TURN);
    if (span_rad < 0.0)
        span_rad += GEO_TURN;
    long first = (gradians(start_rad) + PING360_AHEAD) % PING360_TURN;
    if (first < 0)
        first += PING360_TURN;
    long span = gradians(span_rad), step = gradians(step_rad);
    if (step < 1)
        step = 1;
    bool circle = span_rad < same_rad || span >= PING360_TURN;

    *scan = (struct ping360_scan){.first = (uint16_t)first, .step = (uint16_t)step};
    if (circle) {
        scan->sweep.stop = PING360_TURN - 1;
    } else {
        scan->positions = (uint16_t)(span / step + 1);
        scan->sweep.start = (uint16_t)first;
        scan->sweep.stop = (uint16_t)((first + span) % PING360_TURN);
    }
    scan->by_itself = step <= OWN_STEP_MAX && scan->sweep.start <= scan->sweep.stop;
    scan->sweep.step = (uint8_t)(scan->by_itself ? step : 0);
}

/* Of an azimuth in the sensor frame. */
static uint16_t angle_of(double az_rad)
{
    long angle = (gradians(fmod(az_rad, GEO_TURN)) + PING360_AHEAD) % PING360_TURN;
    return (uint16_t)(angle < 0 ? angle + PING360_TURN : angle);
}

static uint16_t plain_angle(const struct ping360_scan *scan)
{
    unsigned ahead = scan->positions ? (unsigned)scan->at * scan->step : scan->at;
    return (uint16_t)((scan->first + ahead) % PING360_TURN);
}

uint16_t ping360_scan_angle(const struct ping360_scan *scan)
{
    return scan->pass_left ? scan->pass_angle : plain_angle(scan);
}

static void advance_plain(struct ping360_scan *scan)
{
    if (scan->positions == 0) {
        scan->at = (uint16_t)((scan->at + scan->step) % PING360_TURN);
    } else if (scan->positions > 1) {
        if (scan->at == (scan->backward ? 0 : scan->positions - 1))
            scan->backward = !scan->backward;
        scan->at = (uint16_t)(scan->backward ? scan->at - 1 : scan->at + 1);
    }
}

static void begin_pass(struct ping360_scan *scan, uint16_t from)
{
    const uint16_t last = (uint16_t)((scan->steer_first + (scan->steer_n - 1) * scan->step) % PING360_TURN);
    scan->pass_backward = abs(ping360_angle_to(from, last)) < abs(ping360_angle_to(from, scan->steer_first));
    scan->pass_angle = scan->pass_backward ? last : scan->steer_first;
    scan->pass_left = scan->steer_n;
    scan->plain = 0;
}

void ping360_scan_advance(struct ping360_scan *scan, uint64_t now_ns)
{
    steer_ping(&scan->steer);
    if (scan->pass_left) {
        const int step = scan->pass_backward ? PING360_TURN - scan->step : scan->step;
        const uint16_t was = scan->pass_angle;
        scan->pass_angle = (uint16_t)((was + step) % PING360_TURN);
        scan->pass_left--;
        if (!scan->pass_left && scan->only && scan->steer_n)
            begin_pass(scan, was);
        return;
    }
    const uint16_t from = plain_angle(scan), was_at = scan->at;
    advance_plain(scan);
    scan->plain++;
    if (!scan->positions && scan->at < was_at)
        steer_begin(&scan->steer, now_ns);
    if (scan->steer_n && (scan->only || steer_has_time(&scan->steer, scan->plain, scan->steer_n,
                                                       (unsigned)PING360_TURN / scan->step, now_ns)))
        begin_pass(scan, from);
}

bool ping360_scan_is_alone(const struct ping360_scan *scan)
{
    return scan->only && scan->pass_left;
}

void ping360_scan_steer(struct ping360_scan *scan, double from_rad, double to_rad, bool only)
{
    const long span = gradians(geo_wrap(to_rad - from_rad));
    if (scan->positions)
        return;
    scan->only = only;
    scan->steer_first = angle_of(from_rad);
    scan->steer_n = (uint16_t)(span > 0 && span < PING360_TURN ? span / scan->step + 1 : 0);
}

int ping360_angle_to(uint16_t from, uint16_t to)
{
    int clockwise = (to + PING360_TURN - from) % PING360_TURN;
    return clockwise > PING360_TURN / 2 ? clockwise - PING360_TURN : clockwise;
}

void ping360_track_reset(struct ping360_track *track)
{
    *track = (struct ping360_track){.head = PING360_ANGLE_UNKNOWN};
}

static bool same_sweep(const struct ping360_sweep *a, const struct ping360_sweep *b)
{
    return a->step == b->step && a->start == b->start && a->stop == b->stop;
}

/* Pings left out between the last angle and this one, `turned` gradians on. */
static unsigned missing_pings(const struct ping360_track *track, const struct ping360_data *data, int turned,
                              bool reversed)
{
    const struct ping360_sweep *sweep = &data->sweep;
    if (!data->automatic || sweep->step == 0 || !same_sweep(sweep, &track->sweep))
        return 0;

    int pings = abs(turned) / sweep->step;
    if (reversed) { /* at the end of the sector: count the way there and back */
        uint16_t end = track->travel > 0 ? sweep->stop : sweep->start;
        pings = abs(ping360_angle_to(track->head, end)) / sweep->step +
                abs(ping360_angle_to(end, data->set.angle)) / sweep->step;
    }
    return pings > 0 ? (unsigned)pings - 1 : 0;
}

bool ping360_track_follow(struct ping360_track *track, const struct ping360_data *data, unsigned *missing)
{
    bool new_sweep = false;
    *missing = 0;
    if (track->head != PING360_ANGLE_UNKNOWN) {
        int turned = ping360_angle_to(track->head, data->set.angle);
        int onward = track->travel > 0 ? turned : -turned;
        /* In the head's own sector scan the same angle twice means that it turned round in between. */
        bool own_sector = data->automatic && !(data->sweep.start == 0 && data->sweep.stop == PING360_TURN - 1);
        bool reversed = track->travel != 0 && (onward < 0 || (onward == 0 && own_sector));
        *missing = missing_pings(track, data, turned, reversed && own_sector);
        track->travel = reversed ? turned : track->travel + turned;
        new_sweep = reversed || abs(track->travel) >= PING360_TURN;
        track->travel %= PING360_TURN;
    }
    track->head = data->set.angle;
    track->sweep = data->automatic ? data->sweep : (struct ping360_sweep){0};
    return new_sweep;
}
