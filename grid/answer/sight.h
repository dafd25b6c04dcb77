/* SPDX-License-Identifier: MIT */
/*
 * sight - what one direction of a picture says, as seen from where the vehicle is now: shared by the answers. Knows no
 * question.
 */
#ifndef SONARD_SIGHT_H
#define SONARD_SIGHT_H

#include <math.h>
#include <string.h>

#include "answer.h"
#include "bottom.h"

/* Where the vehicle is now, as far as the picture is concerned. */
struct sight_place {
    double offset_m[3]; /* from the grid's centre, in the grid's axes */
    double uncertain_m; /* pose uncertainty: how far from there it may be */
    double moved_m;     /* from the grid's centre, at most */
    double turned_rad;  /* the body's axes may be turned so far from what its attitude says */
    double adrift_rad; /* its heading may have drifted so far since what was observed: turned about the vertical */
    double adrift_cos, adrift_sin;
    /* no ping since it moved farther than a place may in one step, or jumped: nothing that was clear is so from here */
    bool away;
    struct bottom bottom; /* as seen from the grid's centre */
};

/* What one direction says, as seen from there. */
struct sight {
    enum answer_reason reason; /* why not clear to clear_m; ANSWER_HEARD: it is */
    double clear_m, blind_m;
    double age_s; /* of the oldest ping of what is asked about; negative: never pinged */
    bool showed;  /* that ping showed water, though the vehicle may have drifted out of it since */
    const struct picture_obstacle *obstacle; /* nearest that still counts, in the entry; NULL: none */
    double near_m, logodds;
    double hint_m;   /* near edge of the nearest evidence that is left, however weak; INFINITY: none */
    double bottom_m; /* from here on there may be the bottom, whatever was observed; INFINITY: there is not */
};

/* Of a direction that was never pinged. */
extern const struct sight sight_never;

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

/** sight_beyond - why the water of a direction ends at clear_m: ANSWER_BOTTOM or ANSWER_BEYOND. */
static inline enum answer_reason sight_beyond(const struct sight *v)
{
    return v->bottom_m <= v->clear_m ? ANSWER_BOTTOM : ANSWER_BEYOND;
}

/** sight_possible - false when nothing can be said about any direction, with the reason: also where the pose or what is
 * uncertain of it is no finite number. */
bool sight_possible(const struct picture_frame *frame, const struct answer_now *now, bool ned,
                    enum answer_reason *reason);

/** sight_locate - the vehicle's place against the grid's centre, for water that is no older than conf says, and how far
 * the bottom is from there. */
void sight_locate(const struct picture *p, const struct picture_frame *frame, const struct answer_conf *conf,
                  const struct answer_now *now, struct sight_place *place);

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

/* Who looks: by which limits, when, from where, and at what. */
struct sight_observer {
    const struct answer_conf *conf;
    const struct answer_now *now;
    const struct sight_place *place;
    double from_m, to_m;     /* the water that is asked about: no other makes the answer old */
    struct sight_fade *fade; /* of one picture and one time, kept from look to look; NULL: worked out each time */
};

/** sight_bottom_m - how far from there the bottom is in a direction, at least. */
static inline double sight_bottom_m(const struct picture *p, uint32_t direction, const struct sight_place *place)
{
    if (place->bottom.least_m == INFINITY)
        return INFINITY;
    return sight_more(0, bottom_reach_m(&place->bottom, p->axis[direction][2]) - place->moved_m);
}

/**
 * sight_water - the longest run of an entry's free water that still counts, as of the oldest ping of what is asked
 * about, or of all of it where none of that is in it. *reason: ANSWER_HEARD, or why none counts: then it is what the
 * last ping freed; t_ping_ns = 0: there was none. Ranges are from the grid's centre.
 */
struct free_interval sight_water(const struct picture_entry *e, const struct sight_observer *by,
                                 enum answer_reason *reason);

/**
 * sight_look - what a direction says. Everything may be nearer by as much as the vehicle has moved. An obstacle that
 * has faded blocks no more, but the water from it on is not clear either: only beams that pass it make it so.
 * e: room for what v->obstacle is in.
 */
void sight_look(struct picture *p, uint32_t direction, const struct sight_observer *by, struct picture_entry *e,
                struct sight *v);

/** sight_look_told - the same of a direction whose entry says something (picture_block.told). */
void sight_look_told(struct picture *p, uint32_t direction, const struct sight_observer *by,
                     struct picture_entry *e, struct sight *v);

/** sight_against - what stands against a free interval; ANSWER_HEARD: nothing. */
static inline enum answer_reason sight_against(const struct free_interval *c, const struct sight_observer *by)
{
    const struct sight_place *place = by->place;
    if (!c->t_ping_ns)
        return ANSWER_NEVER;
    if (c->sensors & by->now->lost)
        return ANSWER_SILENT;
    if (sight_seconds(by->now->now_ns, c->t_ping_ns) > by->conf->clear_for_s)
        return ANSWER_STALE;
    if (place->away || by->now->pose.path_m + place->uncertain_m - c->path_m > by->conf->move_limit_m)
        return ANSWER_MOVED;
    return ANSWER_HEARD;
}

static inline uint64_t sight_word(const snapshot_word *entry, size_t byte)
{
    return atomic_load_explicit(&entry[byte / 8], memory_order_acquire);
}

/* One of the two floats of a word. */
static inline float sight_half(uint64_t word, unsigned which)
{
    float half;
    memcpy(&half, (const char *)&word + which * sizeof half, sizeof half);
    return half;
}

/**
 * sight_glance - of a direction's look reason, clear_m, blind_m, age_s and bottom_m, and in near_m what no obstacle of
 * it is nearer than; the rest of *v stays. False where only a look tells these: *v is undefined. It is a fraction of a
 * look, and most directions of a wide question add nothing to what others said.
 */
__attribute__((always_inline)) static inline bool sight_glance(struct picture *p, uint32_t direction,
                                                               const struct sight_observer *by, struct sight *v)
{
    const uint64_t number = picture_now(p);
    const snapshot_word *w = p->side[number & 1].word + (size_t)direction * PICTURE_WORDS;
    const double moved_m = by->place->moved_m;
    struct free_interval c;
    snapshot_load(&c, w, sizeof c / 8);
    const uint64_t later = sight_word(w, sizeof c) | sight_word(w, 2 * sizeof c) | sight_word(w, 3 * sizeof c);
    const uint64_t first = sight_word(w, PICTURE_ODDS(0)), second = sight_word(w, PICTURE_ODDS(1));
    if (later || !picture_still(p, number) ||
        (sight_half(second, 0) > 0 && sight_half(second, 1) < sight_half(first, 1)))
        return false;
    const double edge_m = sight_half(first, 0) > 0 ? (double)sight_half(first, 1) : INFINITY;
    v->near_m = sight_more(0, edge_m - moved_m);
    v->age_s = c.t_ping_ns ? sight_seconds(by->now->now_ns, c.t_ping_ns) : -1;
    v->reason = sight_against(&c, by);
    v->bottom_m = sight_bottom_m(p, direction, by->place);
    v->blind_m = v->clear_m = 0;
    if (v->reason != ANSWER_HEARD)
        return true;
    v->blind_m = (double)c.from_m + moved_m;
    v->clear_m = sight_more(0, sight_less((double)c.to_m, edge_m) - moved_m);
    v->clear_m = sight_less(v->clear_m, v->bottom_m);
    return true;
}
_Static_assert(FREE_INTERVALS == 4 && PICTURE_OBSTACLES == 2 && offsetof(struct free_interval, t_ping_ns) == 0 &&
                   offsetof(struct picture_entry, free) == 0,
               "a glance takes in all that an entry may hold");

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
