/* SPDX-License-Identifier: MIT */
/*
 * extract - from a ping to its echoes: blanks the ring-down, converts counts to power, runs the CFAR detector with
 * windows given in metres, groups what stands out into reflections, and says how far the water before them is free.
 * Each ping by itself; knows no earlier ping, no map, no device. docs/extract.md has the measurements behind it.
 */
#ifndef SONARD_EXTRACT_H
#define SONARD_EXTRACT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"
#include "grid/echoes.h"
#include "grid/ping.h"
#include "cfar_factor.h"
#include "hearing.h"
#include "law_check.h"
#include "free_water.h"

#define EXTRACT_LAW_OF_PING (-1)

/* What the detector runs on where the pipeline hands in a cleaned image. */
enum extract_order {
    EXTRACT_SAFE,  /* on the raw power; an echo must also lie above the lowest class of the cleaned image */
    EXTRACT_PAPER, /* on the cleaned image, as the paper has it: the false-alarm rate is then not defined */
};

struct extract_conf {
    enum cfar_detector detector;
    enum extract_order order;
    double false_alarm;     /* per cell, [1e-12, 0.1] */
    double window_m;        /* reference on each side, (0, 100]; at least 8 resolution cells are taken */
    double guard_m;         /* left out on each side, [0, 10]; at least the pulse is taken */
    double rank;            /* OS: the order statistic as a share of the cells, (0, 1] */
    uint32_t floor_counts;  /* [0, 65535] the receiver's own noise: a quieter reference is taken as this loud */
    double min_contrast_db; /* [0, 100] an echo's peak rises at least so much (power) above its reference */
    enum extract_no_echo no_echo;
    double
        target_db; /* [0, 60] how much less than a wall the weakest obstacle returns that free water is without */
    double bottom_db;       /* the same of a bottom, whose echo has no edge; < 0: not looked for */
    double minimum_range_m; /* [0, 1000] */
    double ring_down_m;     /* end of the ring-down, <= 100; < 0: found in every beam */
    bool learn_ring_down;   /* found ones that end later than usual end where they usually do */
    int law;                /* enum amplitude_law in place of the ping's; EXTRACT_LAW_OF_PING: the ping's */
    double db_per_count;    /* with law AMPLITUDE_LOG */
};

/* What earlier stages know of the ping's cells. Arrays are [n_beams][n_bins] of the ping; NULL: stage left out. */
struct extract_aid {
    /* 1: masked by the background template: no echo here, in no reference window, and no free water through it
     * unless an echo behind shows that sound passed. */
    const uint8_t *blind;
    /* 8-bit counts of the vehicle's own echoes, which are promised to be nothing else; in the law of the ping, for
     * 8-bit pings only. What rings no louder than that near the head hides nothing that the mask does not hide. */
    const uint8_t *own;
    /* 8-bit counts of the cleaned image (template subtracted, median, Otsu, CLAHE), in the law of the ping; with
     * EXTRACT_PAPER of 8-bit pings only. */
    const uint8_t *clean;
    int lowest; /* counts of `clean` up to this are of the lowest class; -1: no class step */
    /* The class step with EXTRACT_PAPER, in place of `lowest`: of what the detector leaves, by which it changes; NULL:
     * none. For pings of one beam. */
    struct survivors *survivors;
};

/* What an obstacle must return to be detected with a probability of 0.99 whatever its range: see free_water.h. */
struct extract_reference {
    double level_db; /* of a resolution cell, against full scale: < 0 */
    uint64_t counts; /* of each of its bins, where all are alike: at least */
    uint64_t shown;  /* 1: it follows from the sonar's own echoes; 0: from the device's prior */
    uint64_t
        noisy; /* 1: at every range the baseline is as loud as the bottom that is looked for: nothing is free */
};

struct extract;
struct survivors;

/** extract_defaults - the configuration that the measurements in docs/extract.md were made with. */
void extract_defaults(struct extract_conf *conf);

/** extract_size - bytes of memory for beams of up to max_bins (at most PING_MAX_BINS are used). */
size_t extract_size(uint32_t max_bins);

/**
 * extract_init - make an extractor in mem (extract_size bytes, aligned to max_align_t; the caller keeps it).
 * Solves the detection factors: some milliseconds. NULL with a sentence in fault when *conf is out of range.
 */
struct extract *extract_init(void *mem, const struct extract_conf *conf, uint32_t max_bins, struct fault *fault);

/**
 * extract_run - fill *out (except max_beams and beam, its room) from *ping, with what earlier stages know of it (NULL:
 * nothing).
 *
 * An echo is a group of detected cells with gaps of at most the guard, whose peak has the contrast. range_m: the
 * group's strongest cell, interpolated. near_m: near edge of the group's first cell, which begins half a pulse
 * before the reflection at the latest. sd_m: of a reflector anywhere in the stretch that is at least half as strong
 * as the peak; that covers devices that count from the beginning of their transmission and not from its middle.
 * strength: peak over threshold. confidence: rises with how far the peak stands above its reference, 0.5 at 13 dB and
 * 0.9 at 22.6 dB, whatever the threshold is. level: of the strongest cell over what the weakest wall exceeds at the
 * ping's gain, whatever conf.target_db is and the sonar has shown.
 * Saturated bins beyond the ring-down are echoes. Beams without geometry, without samples, too short, saturated
 * or zero throughout are BEAM_BLIND.
 *
 * The water from blind_m to free_to_m is free: an obstacle of the reference strength (conf.target_db) would have been
 * detected there. It ends at the first echo, at a group that lacks up to 1.5 dB of the contrast of one, at what is as
 * loud as the reference or stands out of the baseline, where the mean of the next window is as loud as a bottom
 * (conf.bottom_db), and by the no_echo rule. Nothing is free in the first 16 beams
 * of a range axis and gain, while the baseline is not known (except under EXTRACT_RANGE), nor where the ring-down is
 * louder than usual: something near may hide the rest. Nothing is free in a ping that does not show that its receiver
 * hears (hearing.h): its beams with an echo keep it, and the others are BEAM_BLIND.
 *
 * Likewise what stands off the axis of the beam, as far as side_to_m and edge_to_m: see free_water_aside. Pings with
 * ready ranges have none of it.
 *
 * Pings that are PING_UNHEARD are BEAM_BLIND. Pings with ready ranges: range > 0 becomes one echo with the device's own
 * deviation and confidence, 0 is silence, and anything else BEAM_BLIND; entries of the same direction become one beam,
 * whose ECHOES_PER_BEAM nearest echoes are kept. Their beams come out in order (order.h), whatever order the entries
 * have. Where deaf_m is known, a first echo nearer than twice the blind range frees nothing.
 *
 * Pings with a choice: likewise, but the water is free only as far as the profile shows it (choice.h), and the profile
 * of the ping before showed it, too: the first ping frees nothing. An earlier echo that is as strong as the chosen one
 * is an echo, too; a weaker one is ECHO_FAINT. So is the profile's own where the device has chosen none: of confidence
 * 0, and behind conf.minimum_range_m it frees water only where the ping before has it as well.
 * Allocates nothing; O(bins).
 */
void extract_run(struct extract *extract, const struct ping *ping, const struct extract_aid *aid,
                 struct echoes *out);

/** extract_reference - of the last ping with a beam that could be judged. False, *out zero: there was none. */
bool extract_reference(const struct extract *extract, struct extract_reference *out);

/** extract_hearing_doubt - why the last pings do not show that their receiver hears; HEARING_HEARS: they do. */
enum hearing_doubt extract_hearing_doubt(const struct extract *extract);

/** extract_law_doubt - what the pings so far say against the amplitude law that they are taken under. */
enum law_doubt extract_law_doubt(const struct extract *extract);

#endif
