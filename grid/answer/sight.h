/* SPDX-License-Identifier: MIT */
/*
 * sight - what stands in one direction of a picture, as seen from where the vehicle is now: shared by the answers.
 * Knows no question and no free water.
 */
#ifndef SONARD_SIGHT_H
#define SONARD_SIGHT_H

#include <math.h>
#include <string.h>

#include "answer.h"
#include "grid/picture/picture.h"

/* Where the vehicle is now, as far as the picture is concerned. */
struct sight_place {
    double offset_m[3]; /* from the grid's centre, in the grid's axes */
    double uncertain_m; /* pose uncertainty: how far from there it may be */
    double moved_m;     /* from the grid's centre, at most */
    double turned_rad;  /* the body's axes may be turned so far from what its attitude says */
    double adrift_rad; /* its heading may have drifted so far since what was observed: turned about the vertical */
    double adrift_cos, adrift_sin;
};

/* What stands in one direction, as seen from there. Everything may be nearer by as much as the vehicle has moved. */
struct sight {
    const struct picture_obstacle *obstacle; /* nearest that still counts, in the entry; NULL: none */
    double near_m, logodds;
    double hint_m; /* near edge of the nearest evidence that is left, however weak; INFINITY: none */
};

/*
 * An answer reads many directions. While the picture changes under it, an obstacle could hop from one not yet read to
 * one already read: then it is read again, some times at most, for each direction is whole in any case. What was read
 * while the axes turned is never used: the same direction is another one then. Use:
 *   struct sight_reading r = {.picture = p};
 *   while (sight_reads(&r)) read_all();
 */
struct sight_reading {
    struct picture *picture;
    uint64_t number;
    double axes_rad;
    int tries;
};

bool sight_reads(struct sight_reading *r);

/** sight_seconds - from t_ns to now_ns; 0 when that is not later. */
static inline double sight_seconds(uint64_t now_ns, uint64_t t_ns)
{
    return now_ns > t_ns ? (double)(int64_t)(now_ns - t_ns) * 1e-9 : 0;
}

/** sight_possible - false when nothing can be said about any direction, with the reason: also where the pose or what is
 * uncertain of it is no finite number. */
bool sight_possible(const struct picture_frame *frame, const struct answer_now *now, bool ned,
                    enum answer_reason *reason);

/** sight_locate - the vehicle's place against the grid's centre, for what is no older than conf says. */
void sight_locate(const struct picture_frame *frame, const struct answer_conf *conf, const struct answer_now *now,
                  struct sight_place *place);

/** sight_swing - turns v about the vertical towards `to`, both in the grid's axes, by adrift_rad or until it is
 * abreast: of all places where v may lie the one nearest to `to`. */
void sight_swing(const struct sight_place *place, const double to[3], double v[3]);

/* As fmin and fmax, without a call, for directions by the thousand. */
static inline double sight_less(double a, double b)
{
    return a < b ? a : b;
}

static inline double sight_more(double a, double b)
{
    return a > b ? a : b;
}

/* How much of an obstacle's log-odds is left of those that held at a time. */
struct sight_fade {
    uint64_t t_ref_ns;
    double share;
    bool known;
};

/* Who looks, when, and from where. */
struct sight_observer {
    const struct answer_now *now;
    const struct sight_place *place;
    struct sight_fade *fade; /* of one picture and one time, kept from look to look; NULL: worked out each time */
};

/**
 * sight_look - what a direction says. An obstacle that has faded blocks no more, but is evidence that is left.
 * e: room for what v->obstacle is in.
 */
void sight_look(struct picture *p, uint32_t direction, const struct sight_observer *by, struct picture_entry *e,
                struct sight *v);

/* One of the two floats of a word. */
static inline float sight_half(uint64_t word, unsigned which)
{
    float half;
    memcpy(&half, (const char *)&word + which * sizeof half, sizeof half);
    return half;
}

/* Nearer than so many times what the vehicle has moved, no cone or sector is answered:
 * that bounds what lies beside. */
#define SIGHT_BESIDE 3.0

/**
 * sight_aside_rad - by what angle a thing that is range_m away, from the centre or from the vehicle, may lie beside
 * where the other sees it. At most that of SIGHT_BESIDE.
 */
double sight_aside_rad(const struct sight_place *place, double range_m);

/** sight_cell_reach - how far the corners of a ring's cells lie from their middles: next to a pole more than half a
 * diagonal. */
double sight_cell_reach(const struct rings *rings, uint32_t ring);

/** sight_tilt - angle between the vehicle's and the world's vertical. */
double sight_tilt(const double attitude[4]);

/** sight_attitude - of the body (or of NED) in the grid's axes; false, q untouched: they are the same. */
bool sight_attitude(const struct picture_frame *frame, const struct answer_now *now, bool ned, double q[4]);

/** sight_to_grid - turns a vector of the body (or of NED) into the grid's axes; sight_from_grid - the way back. */
void sight_to_grid(const struct picture_frame *frame, const struct answer_now *now, bool ned, double v[3]);
void sight_from_grid(const struct picture_frame *frame, const struct answer_now *now, bool ned, double v[3]);

/** sight_keeps - does the grid hold the whole band of elevations? One that keeps a level row only does not know of
 * above and below. */
bool sight_keeps(const struct rings *rings, double lo_rad, double hi_rad);

#endif
