/* SPDX-License-Identifier: MIT */
/* looks_rig.h - a picture made by hand, and at which bearings sonars look, as `near` has it. */
#ifndef SONARD_TEST_LOOKS_RIG_H
#define SONARD_TEST_LOOKS_RIG_H

#include "picture_rig.h"

/* Heads look at these bearings, 10 degrees up and down. */
static inline void looks_at(uint64_t bearings, double gap_deg, bool first_turns)
{
    struct picture_frame frame;
    picture_get_frame(&picture, &frame);
    frame.looks = (struct bearings_looks){.bearings = {bearings},
                                          .t_ns = NOW,
                                          .hears = {bearings},
                                          .last_ns = {NOW},
                                          .level_rad = {geo_rad(10)},
                                          .gap_rad = {geo_rad(gap_deg)},
                                          .first_turns = first_turns};
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
}

/* In beams of sonars that do not turn: so many degrees about the bow, or about that bearing and the opposite one. */
static inline void open_still(struct bearings_looks *looks, double bearing_deg, double wide_deg)
{
    looks->still[0].low_rad = geo_rad(-10);
    looks->still[0].high_rad = geo_rad(10);
    looks->still[0].mount = mount_identity;
    for (int k = 0; k < BEARINGS_FINE; k++)
        if (fabs(geo_deg(geo_wrap_pi((k + 0.5) * GEO_TURN / BEARINGS_FINE - geo_rad(bearing_deg)))) < wide_deg / 2)
            looks->still[0].opens[k / 64] |= UINT64_C(1) << k % 64;
}

/* A sonar that does not turn: beams of 1.5 degrees side by side, from -wide_deg / 2 to wide_deg / 2 of its own. */
struct still_fan {
    double wide_deg, high_deg;
    double roll_deg, pitch_deg; /* of its mount */
    double mount_m[3];
};

/* What the sonars have looked at, to the picture; the last turns of the first two took so long. */
static inline void tell_looks(const struct bearings *b, uint32_t turn_s)
{
    const uint32_t turn_ms[BEARINGS_SENSORS] = {turn_s * 1000, turn_s * 1000};
    struct picture_frame frame;
    picture_get_frame(&picture, &frame);
    bearings_tell(b, turn_ms, &frame.looks);
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
}

static inline void look_with(struct bearings *b, const struct still_fan *fan)
{
    struct beam_echoes beam[128];
    struct mount mount = {.position_m = {fan->mount_m[0], fan->mount_m[1], fan->mount_m[2]}};
    struct echoes e = {.n_beams = (uint16_t)(fan->wide_deg / 1.5 + 0.5),
                       .az_aperture_rad = (float)geo_rad(1.5),
                       .el_aperture_rad = (float)geo_rad(fan->high_deg),
                       .t_ns = NOW,
                       .beam = beam};
    quat_from_rpy(geo_rad(fan->roll_deg), geo_rad(fan->pitch_deg), 0, mount.attitude);
    for (int i = 0; i < e.n_beams; i++)
        beam[i] = (struct beam_echoes){.az_rad = (float)geo_rad(1.5 * (i + 0.5) - fan->wide_deg / 2)};
    bearings_enter(b, &e, &mount);
    tell_looks(b, 0);
}

#endif
