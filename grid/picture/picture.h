/* SPDX-License-Identifier: MIT */
/*
 * picture - the grid's answer to the commonest questions, direction by direction, readable from any thread while the
 * maps' owner goes on writing. Published as core/snapshot.h has it: one writer, any number of readers, and neither
 * waits for the other. The writer sets what changed on the side behind, turns the sides round, and brings the one that
 * is now behind up to date. A reader that was overtaken every time of SNAPSHOT_TRIES has what
 * says nothing: no ping came.
 */
#ifndef SONARD_PICTURE_H
#define SONARD_PICTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/snapshot.h"
#include "bearings.h"
#include "rings.h"

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
    uint64_t t_look_ns; /* a ping looked in this direction last; 0: never. Advice on where to look, and no more */
    /* nearest first; the last one blocks for as long as any behind it that there is no room for */
    struct picture_obstacle obstacle[PICTURE_OBSTACLES];
    float hint_m; /* near edge of the nearest echo that is too little to block, > 0; 0: none */
    uint32_t reserved;
};

#define PICTURE_WORDS (sizeof(struct picture_entry) / 8)
_Static_assert(sizeof(struct picture_entry) == 8 + PICTURE_OBSTACLES * 32 + 8, "picture entries are whole words");

/* The same for all directions. */
struct picture_frame {
    double centre_m[3];       /* NED place of the grid's centre when the pings carried positions */
    double range_max_m;       /* farthest that any sonar listened */
    double reach_m;           /* obstacles farther than this from the centre are not kept */
    uint64_t pings;           /* entered so far */
    uint64_t t_ping_ns;       /* of the newest */
    double path_m;            /* distance travelled by then */
    double recentre_m;        /* the centre lies at most so far from the vehicle at its last ping */
    uint64_t ned;             /* 1: the axes are fixed in the world; 0: they are the body's */
    uint64_t discontinuities; /* of the attitude, until the newest ping */
    uint64_t withdrawn;       /* so often poses had been withdrawn, until the newest ping */
    double drift_m[2];        /* of the vehicle, level and in depth, by which every reported distance is less */
    double turn_s;            /* longest that a turn of a sonar took; 0: none is over yet */
    double axes_rad; /* azimuth, in NED, of the grid's azimuth 0: not 0 only where the axes follow the course */
    struct bearings_looks looks; /* bearings of the body */
};

#define PICTURE_FRAME_WORDS (sizeof(struct picture_frame) / 8)
_Static_assert(sizeof(struct picture_frame) % 8 == 0, "a frame is whole words");

struct picture_side {
    snapshot_word frame[PICTURE_FRAME_WORDS];
    snapshot_word *word;  /* [n][PICTURE_WORDS] */
    snapshot_word *holds; /* [n / 64, rounded up]: a bit for each direction that holds an obstacle */
};

struct picture {
    struct snapshot turn;
    uint32_t n; /* directions; constant */
    const struct rings *rings;
    const double (*axis)[3]; /* [n] unit vectors of the directions' centres, in the grid's axes */
    _Atomic double fade_s;   /* time constant of the obstacles' log-odds; any thread reads it */
    float blocked_logodds;   /* above: an obstacle */
    struct picture_side side[2];
    uint32_t *changed, n_changed; /* the writer's: directions set since picture_begin; n of them: maybe all */
};

/** picture_bytes - memory for picture_init. */
size_t picture_bytes(uint32_t n);

/** picture_init - all directions never pinged. axis: [rings->n]; memory: picture_bytes(rings->n), 8-aligned. */
void picture_init(struct picture *p, const struct rings *rings, const double (*axis)[3], double fade_s,
                  double blocked_logodds, void *memory);

/** picture_set_fade - writer: from now on log-odds fade with this time constant, those of earlier entries, too. */
void picture_set_fade(struct picture *p, double fade_s);

/* Writer. Entries and frame may be set only between begin and end, at which they are all published at once. */
void picture_begin(struct picture *p);
void picture_set(struct picture *p, uint32_t direction, const struct picture_entry *entry);
void picture_set_frame(struct picture *p, const struct picture_frame *frame);
void picture_end(struct picture *p);

/* Readers. picture_still: what was read since picture_now gave this number is of one picture. */
static inline uint64_t picture_now(struct picture *p)
{
    return snapshot_now(&p->turn);
}

static inline bool picture_still(struct picture *p, uint64_t number)
{
    return snapshot_still(&p->turn, number);
}

/* Readers: a consistent copy of one entry, or of the frame. */
void picture_get(struct picture *p, uint32_t direction, struct picture_entry *entry);
void picture_get_frame(struct picture *p, struct picture_frame *frame);

/**
 * picture_holding - readers: of directions 64 k to 64 k + 63 those that hold an obstacle, however weak, a bit each; all
 * where that is not known. Much cheaper than to get their entries: most directions of most grids hold none.
 */
static inline uint64_t picture_holding(struct picture *p, uint32_t k)
{
    const snapshot_word *const side[2] = {p->side[0].holds + k, p->side[1].holds + k};
    uint64_t holding;
    return snapshot_copy(&p->turn, &holding, side, 1) ? holding : UINT64_MAX;
}

/* Where in an entry the log-odds of an obstacle are, with its near edge behind. */
#define PICTURE_ODDS(k)                                                                                           \
    (offsetof(struct picture_entry, obstacle) + (k) * sizeof(struct picture_obstacle) +                           \
     offsetof(struct picture_obstacle, logodds))
_Static_assert(PICTURE_ODDS(0) % 8 == 0 &&
                   offsetof(struct picture_obstacle, near_m) == offsetof(struct picture_obstacle, logodds) + 4,
               "an obstacle's log-odds and near edge are one word");

/* The word of a direction's entry that begins at that byte. */
static inline uint64_t picture_word(const struct picture_side *side, uint32_t direction, size_t byte)
{
    return atomic_load_explicit(&side->word[(size_t)direction * PICTURE_WORDS + byte / 8], memory_order_acquire);
}

/** picture_told_m - readers: no obstacle of that direction, nor an echo that is too little to block, begins nearer to
 * the grid's centre; INFINITY: there is none. 0 where it is not known. */
double picture_told_m(struct picture *p, uint32_t direction);

/** picture_logodds - of an obstacle at now_ns: exact exponential fading, none before t_ref. */
double picture_logodds(const struct picture *p, const struct picture_obstacle *o, uint64_t now_ns);

#endif
