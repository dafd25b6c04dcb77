/* SPDX-License-Identifier: MIT */
#include "pose_log.h"

#include <math.h>
#include <string.h>

static const unsigned parts[POSE_TRACKS] = {POSE_ATTITUDE, POSE_POSITION, POSE_DEPTH, POSE_VELOCITY,
                                            POSE_ALTITUDE};

void pose_log_init(struct pose_log *log, uint64_t max_age_ns)
{
    memset(log, 0, sizeof *log);
    log->max_age_ns = max_age_ns;
    discontinuity_init(&log->turns, geo_rad(POSE_LOG_JUMP_DEG));
}

void pose_log_set_max_age(struct pose_log *log, uint64_t max_age_ns)
{
    log->max_age_ns = max_age_ns;
}

void pose_log_set_most(struct pose_log *log, double most_mps, double most_radps)
{
    log->most_mps = most_mps;
    log->most_radps = most_radps;
}

void pose_log_set_delay(struct pose_log *log, uint64_t delay_ns, uint64_t doubt_ns)
{
    log->delay_ns = delay_ns;
    log->doubt_ns = doubt_ns;
}

uint64_t pose_log_dated(const struct pose_log *log, uint64_t t_ns)
{
    return t_ns > log->delay_ns ? t_ns - log->delay_ns : 0;
}

/* ---- drift ---- */

/* What of a part's samples is the drift up to them. */
static const int drift_at[POSE_TRACKS] = {[POSE_TRACK_PLACE] = 2, [POSE_TRACK_DEPTH] = 1};

static double unseen_m(const struct pose_log *log, int part, uint64_t t_ns)
{
    double m[DRIFT_WAYS];
    drift_log_at(&log->unseen, t_ns, m);
    return m[part == POSE_TRACK_DEPTH ? DRIFT_VERTICAL : DRIFT_LEVEL];
}

void pose_log_set_drift(struct pose_log *log, uint64_t now_ns, const struct pose_drift *drift)
{
    drift_log_set(&log->unseen, now_ns, drift);
}

/* ---- one track ---- */

static const struct pose_sample *at(const struct pose_track *track, uint32_t i)
{
    return &track->sample[(track->first + i) % POSE_LOG_SAMPLES];
}

static const struct pose_sample *last(const struct pose_track *track)
{
    return track->n ? at(track, track->n - 1) : NULL;
}

/* How old a sample of that part may be. */
static uint64_t max_age_of(const struct pose_log *log, int part)
{
    const uint64_t usual_ns = log->track[part].usual_ns, most_ns = POSE_LOG_AUTO_MOST_NS;
    if (log->max_age_ns != POSE_LOG_AUTO)
        return log->max_age_ns;
    if (log->most_mps <= 0 || log->most_radps <= 0 || usual_ns < POSE_LOG_AUTO_LEAST_NS / POSE_LOG_AUTO_GAPS)
        return POSE_LOG_AUTO_LEAST_NS;
    return usual_ns < most_ns / POSE_LOG_AUTO_GAPS ? POSE_LOG_AUTO_GAPS * usual_ns : most_ns;
}

uint64_t pose_log_max_age_ns(const struct pose_log *log, unsigned part)
{
    int track = 0;
    while (parts[track] != part)
        track++;
    return max_age_of(log, track);
}

/* The drift of a part up to its newest sample, or until t_ns where there is none. */
static double drift_of(const struct pose_log *log, int part, uint64_t t_ns)
{
    const struct pose_sample *newest = last(&log->track[part]);
    return newest ? newest->v[drift_at[part]] : unseen_m(log, part, t_ns);
}

static void add_gap(struct pose_track *track, uint64_t gap_ns)
{
    uint64_t sorted[POSE_LOG_GAPS];
    track->gap_ns[track->n_gaps++ % POSE_LOG_GAPS] = gap_ns;
    if (track->n_gaps < POSE_LOG_GAPS)
        return;
    for (int i = 0; i < POSE_LOG_GAPS; i++) {
        int k = i;
        for (; k > 0 && sorted[k - 1] > track->gap_ns[i]; k--)
            sorted[k] = sorted[k - 1];
        sorted[k] = track->gap_ns[i];
    }
    track->usual_ns = sorted[POSE_LOG_GAPS / 2];
}

static bool append(struct pose_track *track, const struct pose_sample *sample)
{
    if (track->n && sample->t_ns <= last(track)->t_ns)
        return false;
    if (track->n == POSE_LOG_SAMPLES) {
        track->first = (track->first + 1) % POSE_LOG_SAMPLES;
        track->n--;
    }
    track->sample[(track->first + track->n) % POSE_LOG_SAMPLES] = *sample;
    track->n++;
    if (sample->given && track->t_given_ns)
        add_gap(track, sample->t_ns - track->t_given_ns);
    if (sample->given)
        track->t_given_ns = sample->t_ns;
    return true;
}

/* a at u = 0, b at u = 1, and on. */
static void mix(int part, const struct pose_sample *a, const struct pose_sample *b, double u, double v[4])
{
    if (part == POSE_TRACK_ATTITUDE) {
        quat_slerp(a->v, b->v, u, v);
        return;
    }
    for (int i = 0; i < 4; i++)
        v[i] = a->v[i] + (b->v[i] - a->v[i]) * u;
}

/*
 * Behind the last sample: as between the last two, where these belong together, but not far; a velocity and an altitude
 * stay as they were told. Returns what is left of the time.
 */
static uint64_t go_on(const struct pose_log *log, int part, uint64_t t_ns, double v[4])
{
    const struct pose_track *track = &log->track[part];
    const struct pose_sample *b = last(track), *a = track->n > 1 ? at(track, track->n - 2) : b;
    uint64_t gap_ns = b->t_ns - a->t_ns, ahead_ns = t_ns - b->t_ns;
    uint64_t most_ns = gap_ns < POSE_LOG_AHEAD_NS ? gap_ns : POSE_LOG_AHEAD_NS, left_ns = 0;
    if (ahead_ns > most_ns) {
        left_ns = ahead_ns - most_ns;
        ahead_ns = most_ns;
    }
    if (gap_ns == 0 || gap_ns > max_age_of(log, part) || a->discontinuities != b->discontinuities ||
        part >= POSE_TRACK_VELOCITY) {
        memcpy(v, b->v, sizeof b->v);
        return t_ns - b->t_ns;
    }
    mix(part, a, b, 1.0 + (double)ahead_ns / (double)gap_ns, v);
    return left_ns;
}

/* What the log knows of one part at a time. */
struct part_then {
    double v[4];
    bool good;         /* somebody gave it, and it is fresh */
    uint64_t since_ns; /* for so long nobody knows how it went on */
    uint64_t discontinuities;
};

/* The first sample after t_ns. */
static uint32_t first_after(const struct pose_track *track, uint64_t t_ns)
{
    uint32_t lo = 0, hi = track->n; /* samples before lo are at or before t_ns */
    while (lo < hi) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (at(track, mid)->t_ns <= t_ns)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

/* False: the part was never known until then. */
static bool look_up(const struct pose_log *log, int part, uint64_t t_ns, struct part_then *out)
{
    const struct pose_track *track = &log->track[part];
    const uint32_t lo = first_after(track, t_ns);
    if (lo == 0)
        return false;
    const struct pose_sample *a = at(track, lo - 1), *b = lo < track->n ? at(track, lo) : NULL;
    const uint64_t max_age_ns = max_age_of(log, part);
    bool between = b && b->discontinuities == a->discontinuities && b->t_ns - a->t_ns <= max_age_ns;
    uint64_t since_ns = 0;
    out->good = a->given && (between || t_ns - a->t_ns <= max_age_ns);
    if (between)
        mix(part, a, b, (double)(t_ns - a->t_ns) / (double)(b->t_ns - a->t_ns), out->v);
    else if (b) {
        memcpy(out->v, a->v, sizeof a->v);
        since_ns = t_ns - a->t_ns;
    } else {
        since_ns = go_on(log, part, t_ns, out->v);
        if (drift_at[part])
            out->v[drift_at[part]] = a->v[drift_at[part]];
    }
    out->discontinuities = a->discontinuities;
    out->since_ns = since_ns;
    return true;
}

/* ---- taking ---- */

static bool fresh(const struct pose_log *log, int part, uint64_t t_ns)
{
    uint64_t given_ns = log->track[part].t_given_ns;
    return given_ns && (t_ns <= given_ns || t_ns - given_ns <= max_age_of(log, part));
}

/*
 * What is towed follows on the straight line to the vehicle, and its way is counted: between any two moments the
 * vehicle is nowhere farther from where it was than that way and two lines. `first`: what somebody says for the first
 * time is a place to start from, not a distance travelled.
 */
static void add_way(struct pose_log *log, bool first)
{
    const struct pose_sample *place = last(&log->track[POSE_TRACK_PLACE]);
    const struct pose_sample *depth = last(&log->track[POSE_TRACK_DEPTH]);
    const double now_m[3] = {place ? place->v[0] : 0, place ? place->v[1] : 0, depth ? depth->v[0] : 0};
    if (first) {
        memcpy(log->towed_m, now_m, sizeof now_m);
        return;
    }
    double line_m[3];
    for (int i = 0; i < 3; i++)
        line_m[i] = now_m[i] - log->towed_m[i];
    const double off_m = geo_length(line_m), way_m = off_m - POSE_LOG_LINE_M;
    if (!(way_m > 0))
        return;
    log->path_m += way_m;
    for (int i = 0; i < 3; i++)
        log->towed_m[i] += line_m[i] * (way_m / off_m);
}

/* How much farther off a part of the place is for having been carried for dt_s by a velocity of now, not by that of
 * before (NULL: none was given). */
static double carried_off_m(const struct pose_log *log, int part, const double now[3], const double *before,
                            double dt_s)
{
    const int from = part == POSE_TRACK_DEPTH ? 2 : 0, to = part == POSE_TRACK_DEPTH ? 3 : 2;
    double mps2 = 0, change2 = 0;
    for (int i = from; i < to; i++) {
        mps2 += now[i] * now[i];
        change2 += before ? (now[i] - before[i]) * (now[i] - before[i]) : 0;
    }
    if (dt_s > (double)max_age_of(log, POSE_TRACK_VELOCITY) * 1e-9)
        return (fmax(log->most_mps, log->unseen.set.mps) + sqrt(mps2)) * dt_s;
    return (POSE_LOG_VELOCITY_SHARE * sqrt(mps2) + POSE_LOG_VELOCITY_MPS + sqrt(change2) / 2) * dt_s;
}

/* What the velocity has done to a part of the place since its last sample; told: the velocity before. */
static void carry(struct pose_log *log, int part, const struct pose_sample *velocity, const double *told)
{
    const struct pose_sample *before = last(&log->track[part]);
    struct pose_sample s = {.t_ns = velocity->t_ns};
    if (fresh(log, part, velocity->t_ns) || (before && before->t_ns >= velocity->t_ns))
        return;
    s.v[drift_at[part]] = drift_of(log, part, velocity->t_ns);
    if (before) {
        double dt_s = (double)(velocity->t_ns - before->t_ns) * 1e-9;
        const double *v = part == POSE_TRACK_DEPTH ? &velocity->v[2] : velocity->v;
        for (int i = 0; i < (part == POSE_TRACK_DEPTH ? 1 : 2); i++)
            s.v[i] = before->v[i] + v[i] * dt_s;
        s.v[drift_at[part]] += carried_off_m(log, part, velocity->v, told, dt_s);
    }
    append(&log->track[part], &s);
}

static void copy_part(int part, const struct pose *given, double v[4])
{
    switch (part) {
    case POSE_TRACK_ATTITUDE:
        memcpy(v, given->attitude, sizeof given->attitude);
        break;
    case POSE_TRACK_PLACE:
        memcpy(v, given->position_m, 2 * sizeof *v);
        break;
    case POSE_TRACK_DEPTH:
        v[0] = given->position_m[2];
        break;
    case POSE_TRACK_ALTITUDE:
        v[0] = given->altitude_m;
        break;
    default:
        memcpy(v, given->velocity_mps, sizeof given->velocity_mps);
    }
}

/* Counts the attitude's jumps alone: what a place that jumps means for the view is the grid's to see. */
static void count_discontinuities(struct pose_log *log, const struct pose *given)
{
    struct pose attitude = *given;
    struct jump jump;
    attitude.has &= POSE_ATTITUDE;
    log->discontinuities += discontinuity_take(&log->turns, &attitude, log->most_mps, log->most_radps, &jump);
}

static void begin(struct pose_log *log, uint64_t t_ns)
{
    log->t_first_ns = t_ns;
    drift_log_begin(&log->unseen, t_ns);
}

void pose_log_moves(struct pose_log *log, uint64_t t_ns)
{
    if (!log->t_first_ns)
        begin(log, t_ns);
}

bool pose_log_bound(struct pose_log *log, uint64_t t_ns, const double mps[DRIFT_WAYS])
{
    pose_log_moves(log, t_ns);
    const bool newer = drift_log_bound(&log->unseen, t_ns, mps);
    log->taken += newer;
    log->refused += !newer;
    return newer;
}

bool pose_log_put(struct pose_log *log, const struct pose *given)
{
    bool any = false, first = false;
    double velocity[4];
    const struct pose_sample *told = last(&log->track[POSE_TRACK_VELOCITY]);
    if (told)
        memcpy(velocity, told->v, sizeof velocity);
    count_discontinuities(log, given);
    for (int part = 0; part < POSE_TRACKS; part++) {
        struct pose_sample s = {.t_ns = given->t_ns, .given = true};
        if (!(given->has & parts[part]))
            continue;
        first |= (parts[part] & (POSE_POSITION | POSE_DEPTH)) && !log->track[part].t_given_ns;
        s.discontinuities = part == POSE_TRACK_ATTITUDE ? log->discontinuities : 0;
        copy_part(part, given, s.v);
        if (drift_at[part])
            s.v[drift_at[part]] = drift_of(log, part, given->t_ns);
        if (!append(&log->track[part], &s))
            continue;
        any = true;
        if (part == POSE_TRACK_VELOCITY) {
            carry(log, POSE_TRACK_PLACE, &s, told ? velocity : NULL);
            carry(log, POSE_TRACK_DEPTH, &s, told ? velocity : NULL);
        }
    }
    if (!any) {
        log->refused++;
        return false;
    }
    add_way(log, first);
    if (!log->t_first_ns && given->has != POSE_ALTITUDE)
        begin(log, given->t_ns);
    if (given->t_ns > log->t_newest_ns)
        log->t_newest_ns = given->t_ns;
    log->taken++;
    return true;
}

void pose_log_withdraw(struct pose_log *log, uint64_t now_ns)
{
    const double m[DRIFT_WAYS] = {drift_of(log, POSE_TRACK_PLACE, now_ns),
                                  drift_of(log, POSE_TRACK_DEPTH, now_ns)};
    drift_log_withdraw(&log->unseen, now_ns, m);
    log->t_first_ns = 0;
    for (int part = 0; part < POSE_TRACKS; part++) {
        log->track[part].n = log->track[part].n_gaps = 0;
        log->track[part].t_given_ns = log->track[part].usual_ns = 0;
        log->sender[part] = NULL;
    }
    log->withdrawn++;
}

void pose_log_sent_by(struct pose_log *log, unsigned of_parts, const char *sender)
{
    for (int part = 0; part < POSE_TRACKS; part++)
        if (of_parts & parts[part])
            log->sender[part] = sender;
}

/* ---- asking ---- */

static void put_part(int part, const double v[4], struct pose *out)
{
    switch (part) {
    case POSE_TRACK_ATTITUDE:
        memcpy(out->attitude, v, sizeof out->attitude);
        break;
    case POSE_TRACK_PLACE:
        memcpy(out->position_m, v, 2 * sizeof *v);
        break;
    case POSE_TRACK_DEPTH:
        out->position_m[2] = v[0];
        break;
    case POSE_TRACK_ALTITUDE:
        out->altitude_m = fmax(v[0], 0);
        break;
    default:
        memcpy(out->velocity_mps, v, sizeof out->velocity_mps);
    }
}

/* How far apart two samples of a part are; radians of an attitude. */
static double apart(int part, const struct pose_sample *a, const struct pose_sample *b)
{
    if (part == POSE_TRACK_ATTITUDE) {
        double half = 0;
        for (int i = 0; i < 4; i++)
            half += a->v[i] * b->v[i];
        return 2 * acos(fmin(1, fabs(half)));
    }
    return geo_length((const double[3]){a->v[0] - b->v[0], a->v[1] - b->v[1], a->v[2] - b->v[2]});
}

/* How fast a part changed lately; 0 from a single sample. Not from samples close together: noise is no speed. */
static double rate(const struct pose_log *log, int part)
{
    const struct pose_track *track = &log->track[part];
    const struct pose_sample *b = last(track), *a = b;
    for (uint32_t i = track->n; i > 0 && b->t_ns - a->t_ns < POSE_LOG_AHEAD_NS; i--)
        a = at(track, i - 1);
    return b->t_ns > a->t_ns ? apart(part, a, b) / ((double)(b->t_ns - a->t_ns) * 1e-9) : 0;
}

/* So far the vehicle may have gone in the last since_ns: as fast as it was reported to be, or as it ever is, but no
 * farther than bounds of its speed say. */
static double way_since_m(const struct pose_log *log, uint64_t since_ns, double reported_mps, double bounded_m)
{
    const double since_s = (double)since_ns * 1e-9;
    return fmax(reported_mps * since_s, fmin(log->most_mps * since_s, bounded_m));
}

/* How far the vehicle may be from what the parts say. */
static void loosen(const struct pose_log *log, uint64_t t_ns, const bool known[], const struct part_then then[],
                   struct pose *p)
{
    const double *v = p->velocity_mps;
    const bool told = p->has & POSE_VELOCITY;
    double way_m[DRIFT_WAYS] = {0}, bounded_m[DRIFT_WAYS];
    for (int part = POSE_TRACK_PLACE; part <= POSE_TRACK_DEPTH; part++) {
        const uint64_t since_ns = known[part] ? then[part].since_ns : 0;
        const int way = part - POSE_TRACK_PLACE;
        if (since_ns == 0)
            continue;
        const double mps = !told ? rate(log, part) : part == POSE_TRACK_DEPTH ? fabs(v[2]) : hypot(v[0], v[1]);
        drift_log_gone(&log->unseen, t_ns - since_ns, t_ns, bounded_m);
        way_m[way] = way_since_m(log, since_ns, mps, bounded_m[way]);
    }
    p->uncertain_m = hypot(way_m[0], way_m[1]);
    if (known[POSE_TRACK_ATTITUDE])
        p->uncertain_rad = fmax(log->most_radps, rate(log, POSE_TRACK_ATTITUDE)) *
                           (double)then[POSE_TRACK_ATTITUDE].since_ns * 1e-9;
}

/* How much nearer the bottom may be than the altitude says. The way over ground counts as well: the bottom rises. */
static void sink(const struct pose_log *log, uint64_t t_ns, const struct part_then *altitude, struct pose *p)
{
    double bounded_m[DRIFT_WAYS];
    if (!(p->has & POSE_ALTITUDE) || altitude->since_ns == 0)
        return;
    const double mps = p->has & POSE_VELOCITY ? geo_length(p->velocity_mps) : rate(log, POSE_TRACK_ALTITUDE);
    drift_log_gone(&log->unseen, t_ns - altitude->since_ns, t_ns, bounded_m);
    const double way_m =
        way_since_m(log, altitude->since_ns, mps, hypot(bounded_m[DRIFT_LEVEL], bounded_m[DRIFT_VERTICAL]));
    p->altitude_m = fmax(p->altitude_m - way_m, 0);
}

/* How fast a part of the place drifts off: not at all where it is given, else by the error of the velocity or as an
 * unseen vehicle does. */
static double drifts_mps(const struct pose_log *log, const struct part_then *place, const struct pose *p)
{
    if (place->good)
        return 0;
    if (p->has & POSE_VELOCITY)
        return POSE_LOG_VELOCITY_SHARE * geo_length(p->velocity_mps) + POSE_LOG_VELOCITY_MPS;
    return log->unseen.set.from_pose && !log->t_first_ns ? 0 : log->unseen.set.mps;
}

static void take_drift(const struct pose_log *log, uint64_t t_ns, const bool known[],
                       const struct part_then then[], struct pose *p)
{
    bool unseen = false;
    for (int k = 0; k < DRIFT_WAYS; k++) {
        const int part = POSE_TRACK_PLACE + k;
        p->drift_m[k] = known[part] ? then[part].v[drift_at[part]] : unseen_m(log, part, t_ns);
        unseen |= !known[part];
    }
    if (unseen)
        p->uncertain_m += drift_log_uncertain_m(&log->unseen, t_ns);
    p->drift_mps = hypot(drifts_mps(log, &then[POSE_TRACK_PLACE], p), drifts_mps(log, &then[POSE_TRACK_DEPTH], p));
    p->heading_adrift = p->drift_mps > 0 && !log->unseen.set.keeps_heading && !known[POSE_TRACK_ATTITUDE];
    p->heading_radps = known[POSE_TRACK_ATTITUDE] ? log->unseen.set.heading_radps : 0;
}

void pose_log_drift(const struct pose_log *log, uint64_t t_ns, double m[DRIFT_WAYS])
{
    struct pose pose;
    pose_log_at(log, t_ns, &pose);
    memcpy(m, pose.drift_m, sizeof pose.drift_m);
}

/* The pose at t_ns, if the samples' times are true. */
static bool pose_then(const struct pose_log *log, uint64_t t_ns, struct pose *out)
{
    bool any = false, known[POSE_TRACKS];
    struct part_then then[POSE_TRACKS] = {{.good = false}};
    struct pose p = pose_identity;
    for (int part = 0; part < POSE_TRACKS; part++) {
        known[part] = look_up(log, part, t_ns, &then[part]);
        if (!known[part])
            continue;
        if (then[part].good)
            p.has |= parts[part];
        if (then[part].good || part == POSE_TRACK_PLACE || part == POSE_TRACK_DEPTH)
            put_part(part, then[part].v, &p);
        any |= then[part].good && part != POSE_TRACK_ALTITUDE;
    }
    loosen(log, t_ns, known, then, &p);
    sink(log, t_ns, &then[POSE_TRACK_ALTITUDE], &p);
    p.path_m = log->path_m;
    p.discontinuities = known[POSE_TRACK_ATTITUDE] ? then[POSE_TRACK_ATTITUDE].discontinuities : 0;
    *out = any ? p : pose_identity;
    take_drift(log, t_ns, known, then, out);
    out->t_ns = t_ns;
    out->withdrawn = log->withdrawn;
    return any;
}

/* How far `other` is turned from p. */
static double turned_rad(const struct pose *p, const struct pose *other)
{
    double half = 0;
    for (int i = 0; i < 4; i++)
        half += other->attitude[i] * p->attitude[i];
    return 2 * acos(fmin(1, fabs(half)));
}

static void way_to(const struct pose *p, const struct pose *other, double way_m[3])
{
    for (int i = 0; i < 3; i++)
        way_m[i] = other->position_m[i] - p->position_m[i];
}

typedef void other_pose_fn(struct pose *p, const struct pose *other);

/* All that the log knows of the time between: at the samples, and at the end. */
static void each_between(const struct pose_log *log, uint64_t from_ns, uint64_t to_ns, other_pose_fn *take,
                         struct pose *p)
{
    struct pose other;
    for (int part = 0; part < POSE_TRACKS; part++) {
        const struct pose_track *track = &log->track[part];
        for (uint32_t i = first_after(track, from_ns); i < track->n && at(track, i)->t_ns < to_ns; i++) {
            pose_then(log, at(track, i)->t_ns, &other);
            take(p, &other);
        }
    }
    pose_then(log, to_ns, &other);
    take(p, &other);
}

/* The vehicle may as well be as in the other pose. */
static void cover(struct pose *p, const struct pose *other)
{
    double way_m[3];
    way_to(p, other, way_m);
    p->has &= other->has;
    p->uncertain_m = fmax(p->uncertain_m, geo_length(way_m) + other->uncertain_m);
    p->uncertain_rad = fmax(p->uncertain_rad, turned_rad(p, other) + other->uncertain_rad);
    p->altitude_m = fmin(p->altitude_m, other->altitude_m);
}

static uint64_t earlier(uint64_t t_ns, uint64_t by_ns)
{
    return t_ns > by_ns ? t_ns - by_ns : 0;
}

bool pose_log_within(const struct pose_log *log, uint64_t from_ns, uint64_t to_ns, struct pose *out)
{
    const bool any = pose_then(log, from_ns, out);
    struct pose first;
    if (log->doubt_ns && pose_then(log, earlier(from_ns, log->doubt_ns), &first))
        cover(out, &first);
    each_between(log, earlier(from_ns, log->doubt_ns), to_ns + log->doubt_ns, cover, out);
    return any;
}

bool pose_log_at(const struct pose_log *log, uint64_t t_ns, struct pose *out)
{
    return log->doubt_ns ? pose_log_within(log, t_ns, t_ns, out) : pose_then(log, t_ns, out);
}

/* The line grows to where the other pose is along it, and what that is off it counts in all directions. */
static void blur(struct pose *p, const struct pose *other)
{
    double way_m[3];
    const double line_m = geo_length(p->blur_m);
    way_to(p, other, way_m);
    const double along_m = line_m > 0 ? fabs(geo_dot(way_m, p->blur_m)) / line_m : 0;
    const double off_m = sqrt(fmax(geo_dot(way_m, way_m) - along_m * along_m, 0));
    if (along_m > line_m)
        for (int i = 0; i < 3; i++)
            p->blur_m[i] *= along_m / line_m;
    p->has &= other->has;
    p->blur_any_m = fmax(p->blur_any_m, off_m + fmax(other->uncertain_m - p->uncertain_m, 0));
    p->blur_rad = fmax(p->blur_rad, turned_rad(p, other) + fmax(other->uncertain_rad - p->uncertain_rad, 0));
}

bool pose_log_blurred(const struct pose_log *log, uint64_t t_ns, uint64_t by_ns, struct pose *out)
{
    const uint64_t most_ns = by_ns + log->doubt_ns, from_ns = earlier(t_ns, most_ns), to_ns = t_ns + most_ns;
    const bool any = pose_log_at(log, t_ns, out);
    struct pose first, last;
    if (by_ns == 0)
        return any;
    pose_then(log, from_ns, &first);
    pose_then(log, to_ns, &last);
    way_to(&first, &last, out->blur_m);
    for (int i = 0; i < 3; i++)
        out->blur_m[i] /= 2;
    blur(out, &first);
    each_between(log, from_ns, to_ns, blur, out);
    memcpy(out->drift_m, first.drift_m, sizeof out->drift_m);
    return any;
}

bool pose_log_newest(const struct pose_log *log, struct pose *out)
{
    *out = pose_identity;
    out->t_ns = log->t_newest_ns;
    out->path_m = log->path_m;
    for (int part = 0; part < POSE_TRACKS; part++) {
        const struct pose_sample *s = last(&log->track[part]);
        if (s)
            put_part(part, s->v, out);
        if (s && fresh(log, part, log->t_newest_ns))
            out->has |= parts[part];
    }
    return log->taken > 0;
}

uint64_t pose_log_last_ns(const struct pose_log *log, unsigned of_parts)
{
    uint64_t oldest_ns = UINT64_MAX;
    for (int part = 0; part < POSE_TRACKS; part++) {
        const struct pose_sample *s = last(&log->track[part]);
        const uint64_t t_ns = s ? s->t_ns : 0;
        if ((of_parts & parts[part]) && t_ns < oldest_ns)
            oldest_ns = t_ns;
    }
    return oldest_ns;
}

/* The part that is missing for a fresh pose; POSE_TRACKS: none. A velocity stands for place and depth. */
static int missing(const struct pose_log *log, uint64_t now_ns)
{
    const bool carried = fresh(log, POSE_TRACK_VELOCITY, now_ns);
    if (!fresh(log, POSE_TRACK_ATTITUDE, now_ns))
        return POSE_TRACK_ATTITUDE;
    if (!carried && log->track[POSE_TRACK_PLACE].t_given_ns && !fresh(log, POSE_TRACK_PLACE, now_ns))
        return POSE_TRACK_PLACE;
    if (!carried && log->track[POSE_TRACK_DEPTH].t_given_ns && !fresh(log, POSE_TRACK_DEPTH, now_ns))
        return POSE_TRACK_DEPTH;
    if (!carried && log->track[POSE_TRACK_VELOCITY].t_given_ns && !fresh(log, POSE_TRACK_PLACE, now_ns))
        return POSE_TRACK_VELOCITY;
    return POSE_TRACKS;
}

bool pose_log_fresh(const struct pose_log *log, uint64_t now_ns)
{
    return missing(log, now_ns) == POSE_TRACKS;
}

unsigned pose_log_missing(const struct pose_log *log, uint64_t now_ns, double *age_s, const char **sender)
{
    const int part = missing(log, now_ns);
    *age_s = -1;
    *sender = NULL;
    if (part == POSE_TRACKS)
        return 0;
    const uint64_t given_ns = log->track[part].t_given_ns;
    *age_s = !given_ns ? -1 : now_ns > given_ns ? (double)(now_ns - given_ns) * 1e-9 : 0;
    *sender = log->sender[part];
    return parts[part];
}

#define SPARSE_OF 8 /* samples looked at */

bool pose_log_sparse(const struct pose_log *log)
{
    const struct pose_track *track = &log->track[POSE_TRACK_ATTITUDE];
    if (track->n < SPARSE_OF)
        return false;
    const uint64_t span_ns = last(track)->t_ns - at(track, track->n - SPARSE_OF)->t_ns;
    return span_ns / (SPARSE_OF - 1) > max_age_of(log, POSE_TRACK_ATTITUDE);
}
