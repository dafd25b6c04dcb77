/* SPDX-License-Identifier: MIT */
/*
 * picture - the grid's answer to the commonest questions, direction by direction, readable from any thread while the
 * maps' owner goes on writing. One writer; any number of readers; nobody ever waits for the other: there are two sides.
 * Readers have the one in front; the writer works on the other, turns them round, and brings the one that is now behind
 * up to date. A reader who was in the midst of it reads again, from the side that has just become whole.
 */
#ifndef SONARD_PICTURE_H
#define SONARD_PICTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "../sphere/claim.h"
#include "../sphere/rings.h"
#include "seqlock.h"

#define PICTURE_OBSTACLES 2

struct picture_obstacle {
    uint64_t t_ref_ns;  /* time at which logodds held */
    uint64_t t_echo_ns; /* its last echo */
    float logodds;      /* fades with the grid's time constant; 0: no obstacle here */
    float near_m;       /* its near edge, from the grid's centre */
    float range_m;      /* of the reflection */
    float sd_m;
};

/* One direction. */
struct picture_entry {
    struct claim claim[CLAIMS];                          /* free water; no time in CLAIM_NOW: never pinged */
    struct picture_obstacle obstacle[PICTURE_OBSTACLES]; /* nearest first */
};

#define PICTURE_WORDS (sizeof(struct picture_entry) / 8)
_Static_assert(sizeof(struct picture_entry) == CLAIMS * 32 + PICTURE_OBSTACLES * 32,
               "picture entries are whole words");

/* The same for all directions. */
struct picture_frame {
    double centre_m[3]; /* NED place of the grid's centre when the pings carried positions */
    double range_max_m; /* farthest that any sonar listened */
    uint64_t pings;     /* entered so far */
    uint64_t t_ping_ns; /* of the newest */
    double recentre_m;  /* the centre lies at most so far from the vehicle at its last ping */
    uint64_t ned;       /* 1: the axes are fixed in the world; 0: they are the body's */
    uint64_t jumps;     /* of the attitude, until the newest ping: no claim is from before them */
    double axes_rad;    /* azimuth, in NED, of the grid's azimuth 0: not 0 only where the axes follow the course */
};

#define PICTURE_FRAME_WORDS (sizeof(struct picture_frame) / 8)

struct picture_side {
    seqlock_word frame[PICTURE_FRAME_WORDS];
    seqlock_word *word; /* [n][PICTURE_WORDS] */
};

struct picture {
    _Atomic uint64_t number; /* of times it was published; the side of its parity is in front */
    uint32_t n;              /* directions; constant */
    const struct rings *rings;
    const double (*axis)[3]; /* [n] unit vectors of the directions' centres, in the grid's axes */
    double fade_s;           /* time constant of the obstacles' log-odds */
    float blocked_logodds;   /* above: an obstacle */
    struct picture_side side[2];
    uint32_t *changed, n_changed; /* the writer's: directions set since picture_begin; n of them: maybe all */
};

/** picture_bytes - memory for picture_init. */
size_t picture_bytes(uint32_t n);

/** picture_init - all directions never pinged. axis: [rings->n]; memory: picture_bytes(rings->n), 8-aligned. */
void picture_init(struct picture *p, const struct rings *rings, const double (*axis)[3], double fade_s,
                  double blocked_logodds, void *memory);

/* Writer. Entries and frame may be set only between begin and end, at which they are all published at once. */
void picture_begin(struct picture *p);
void picture_set(struct picture *p, uint32_t direction, const struct picture_entry *entry);
void picture_set_frame(struct picture *p, const struct picture_frame *frame);
void picture_end(struct picture *p);

/* Readers. picture_still: what was read since picture_now gave this number is of one picture. */
static inline uint64_t picture_now(struct picture *p)
{
    return atomic_load_explicit(&p->number, memory_order_acquire);
}

static inline bool picture_still(struct picture *p, uint64_t number)
{
    return atomic_load_explicit(&p->number, memory_order_relaxed) == number;
}

/* Readers: a consistent copy of one entry, or of the frame. */
void picture_get(struct picture *p, uint32_t direction, struct picture_entry *entry);
void picture_get_frame(struct picture *p, struct picture_frame *frame);

/* Where in an entry the time of a claim is, and the log-odds of an obstacle with its near edge behind. */
#define PICTURE_TIME(k) (offsetof(struct picture_entry, claim) + (k) * sizeof(struct claim))
#define PICTURE_ODDS(k)                                                                                           \
    (offsetof(struct picture_entry, obstacle) + (k) * sizeof(struct picture_obstacle) +                           \
     offsetof(struct picture_obstacle, logodds))
_Static_assert(offsetof(struct claim, t_ping_ns) == 0 && PICTURE_ODDS(0) % 8 == 0 &&
                   offsetof(struct picture_obstacle, near_m) == offsetof(struct picture_obstacle, logodds) + 4,
               "a claim's time is a word, an obstacle's log-odds and near edge are one");

/* The word of a direction's entry that begins at that byte. */
static inline uint64_t picture_word(const struct picture_side *side, uint32_t direction, size_t byte)
{
    return atomic_load_explicit(&side->word[(size_t)direction * PICTURE_WORDS + byte / 8], memory_order_acquire);
}

/**
 * picture_blank - readers: no ping has looked there yet and nothing is heard there, so its entry says nothing. Much cheaper
 * than to get it: most directions of most grids are so.
 */
static inline bool picture_blank(struct picture *p, uint32_t direction)
{
    uint64_t number, any;
    do {
        number = picture_now(p);
        const struct picture_side *side = &p->side[number & 1];
        any = picture_word(side, direction, PICTURE_TIME(CLAIM_NOW)) |
              picture_word(side, direction, PICTURE_TIME(CLAIM_BEFORE)) |
              picture_word(side, direction, PICTURE_ODDS(0));
    } while (!picture_still(p, number));
    return any == 0;
}

/** picture_edge_m - readers: no obstacle of that direction begins nearer to the grid's centre; INFINITY: there is none. */
double picture_edge_m(struct picture *p, uint32_t direction);

/** picture_logodds - of an obstacle at now_ns: exact exponential fading, none before t_ref. */
double picture_logodds(const struct picture *p, const struct picture_obstacle *o, uint64_t now_ns);

#endif
