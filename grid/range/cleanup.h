/* SPDX-License-Identifier: MIT */
/*
 * cleanup - the image clean-up of Oliveira, Ferreira and Cruz 2023 (section III A and the class
 * step of III B), beam by beam:
 *
 *     template subtracted -> median -> Otsu -> CLAHE -> three classes
 *
 * each stage only if it is asked for. The thresholds and the tables are those of the last turn: of the newest row at
 * every head angle. Knows no detector; what comes out goes into struct extract_aid.
 *
 * The median needs rows that come later, so it holds pings back: one with 3 x 3, two with 5 x 5. They come out with
 * their own time and pose when later ones come in; while a sonar is silent the last ones wait.
 */
#ifndef SONARD_CLEANUP_H
#define SONARD_CLEANUP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "extract.h"

struct cleanup_conf {
    unsigned median; /* 0: none, 3 or 5 */
    bool otsu;       /* what is at or below the threshold becomes 0 */
    bool clahe;      /* 0 stays 0 */
    double clip;     /* of CLAHE, times the mean of a histogram's bins, [1, 100] */
    bool classes;    /* find the lowest of three classes: of all counts ... */
    bool survivors;  /* ... or of those that the detector leaves on the cleaned image (EXTRACT_PAPER) */
};

/* What was last used, for people. */
struct cleanup_state {
    uint32_t rows;     /* of the image: of a full turn; 0: nothing came yet */
    uint32_t held;     /* pings that wait for later ones */
    uint64_t restarts; /* the head or its settings changed and the image was started anew */
    uint64_t passed;   /* pings that are no image of one head (several beams, 16 bits, ranges): not cleaned */
    int otsu;          /* threshold of the last turn; -1: none, everything is kept */
    int lowest;        /* upper end of the lowest class of the last turn; -1: none */
};

struct cleanup;

/** cleanup_wanted - is there a stage at all? */
bool cleanup_wanted(const struct cleanup_conf *conf);

/** cleanup_delay - pings of a turning head that are held back: 0, 1 or 2. */
unsigned cleanup_delay(const struct cleanup_conf *conf);

/** cleanup_size - bytes of memory for beams of up to max_bins. */
size_t cleanup_size(const struct cleanup_conf *conf, uint32_t max_bins);

/**
 * cleanup_init - in mem (cleanup_size bytes, aligned to max_align_t; the caller keeps it). mount: of the sonar. NULL
 * with a sentence in fault when *conf is out of range.
 */
struct cleanup *cleanup_init(void *mem, const struct cleanup_conf *conf, const struct mount *mount,
                             uint32_t max_bins, struct fault *fault);

/**
 * cleanup_put - take a ping in. background[n_bins]: counts that are subtracted, not below 0 (NULL: none);
 * blind[n_bins], own[n_bins]: as in struct extract_aid, go with the ping (NULL: none). Everything is copied.
 * Call cleanup_next until it gives NULL before the next one.
 *
 * False when the ping is no 8-bit profile of one beam that fits in: it was not taken. What waited comes out then, and
 * the caller goes on with the ping as it is.
 */
bool cleanup_put(struct cleanup *c, const struct ping *ping, const uint8_t *background, const uint8_t *blind,
                 const uint8_t *own);

/**
 * cleanup_next - the next ping that is ready, oldest first, as it came; NULL: none. *aid is filled: blind and own as
 * they were handed in, clean, lowest (0 with Otsu and without classes: what was taken away);
 * with conf->survivors the class step is survivors, which the extractor of this ping fills.
 * Both are valid until the next cleanup_put.
 *
 * The median looks at rows not older than a turn and a half, shifted by the distance that the vehicle has travelled
 * along the beam in between (where position or velocity are known). CLAHE's tables are those of a tile's last complete
 * pass; where there is none yet, counts stay as they are. With fewer than two different counts there is no threshold;
 * with two, the lower one is the lowest class.
 */
const struct ping *cleanup_next(struct cleanup *c, struct extract_aid *aid);

/** cleanup_held - pings that wait for later ones. */
unsigned cleanup_held(const struct cleanup *c);

void cleanup_state(const struct cleanup *c, struct cleanup_state *out);

#endif
