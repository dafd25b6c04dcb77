/* SPDX-License-Identifier: MIT */
/*
 * own_echo - which echoes are the vehicle's own: its frame, a thruster, a cable, which a turning head hears at the same
 * bearing and range wherever the vehicle goes. Marks such echoes and drops none; where one is missed, the water ends
 * all the same. Knows no samples, no map.
 *
 * A thing in the water that stays at one bearing and range of the head may be the vehicle's own, a thing beside a
 * vehicle that stands still, or a wall that it follows. Only the first turns with the vehicle. So it takes looks in the
 * same direction of the world, from the same place, by another bearing of the head: they see the same side of a thing
 * in the water, and do not see the vehicle's.
 */
#ifndef SONARD_OWN_ECHO_H
#define SONARD_OWN_ECHO_H

#include <stdbool.h>
#include <stdint.h>

#include "grid/echoes.h"

#define OWN_ECHO_ROWS   400 /* of a turn, of the head and of the world */
#define OWN_ECHO_PROOFS 4

/* The last look in a row of the world's directions that showed more than the vehicle itself. */
struct own_echo_look {
    uint64_t t_ns;              /* 0: none yet */
    double place_m[3], axis[3]; /* of the head and the beam, NED */
    double uncertain_m, uncertain_rad, drift_m;
    float az_rad;                   /* of the beam in the sensor frame */
    float heard_from_m, heard_to_m; /* as in struct beam_echoes */
    uint8_t n;
    float range_m[ECHOES_PER_BEAM];
};

/* What may be the vehicle's own at a bearing of the head. */
struct own_echo_row {
    uint64_t proof_ns;              /* of the last proof */
    float axis[OWN_ECHO_PROOFS][3]; /* directions of the world in which it was proved */
    float el_rad;                   /* of the beam in the sensor frame */
    float range_m, near_m, level;   /* of its echo */
    uint8_t proofs, misses;
};

struct own_echo {
    float bin_m;                         /* of the setting that it was learnt under */
    double heading_radps;                /* as in struct pose, of the ping */
    uint64_t discontinuities, withdrawn; /* likewise, of the looks */
    struct own_echo_row row[OWN_ECHO_ROWS];
    struct own_echo_look look[OWN_ECHO_ROWS];
};

/** own_echo_init - nothing is known yet. */
void own_echo_init(struct own_echo *own);

/**
 * own_echo_run - mark the ping's echoes that are the vehicle's own (ECHO_OWN), then keep its beams as looks.
 *
 * An echo within 3 m is its own once four proofs say so. A proof is an echo at the same bearing of the head and the
 * same range (5 cm and a bin) where a look of the last five minutes by a bearing far off (two beam widths and 29
 * degrees) found nothing: in the same direction of the world, from nearly the same place (a quarter of the range), and
 * newer than the last proof. The four are of directions 30 degrees apart. What a look by another bearing (two beam
 * widths off) shows, too, is no proof and begins anew; where it does, an own echo is not marked. Nor is one that is
 * nearer, or by 3 dB louder, than the learnt one, that is saturated, or that has no
 * level. Forgotten where three beams in a row should show it and do not, and before the fourth proof at once: nothing
 * is free behind it in the first two of them.
 *
 * A look proves nothing once the heading may have drifted by half a beam width since, and shows what is beside by as
 * much as it may have. Nothing is learnt or marked without attitude and position (or velocity), or while the heading is
 * adrift.
 * Allocates nothing; O(beams * rows within reach).
 */
void own_echo_run(struct own_echo *own, struct echoes *echoes, const struct mount *mount);

/** own_echo_known - rows of bearing in which an echo is known to be the vehicle's own. */
uint32_t own_echo_known(const struct own_echo *own);

#endif
