/* SPDX-License-Identifier: MIT */
/*
 * sea - pings of a made-up sea whose truth is known: shapes in the water, speckle, reverberation, noise, ring-down,
 * bursts of other sound, the vehicle's own frame. The same bytes for the same numbers. Knows no detector and no map.
 *
 * A surface answers with exponential power (many scatterers of random phase) that the pulse correlates, and so do
 * noise and reverberation. Levels are dB of power against a full count of the Ping360-like head, which hears 12 m in
 * 600 bins; the Micron-like head hears all of them 25 dB lower, 10 m in 400 bins. A reflector at r is heard from r to
 * r + pulse.
 */
#ifndef SONARD_SOUND_SEA_H
#define SONARD_SOUND_SEA_H

#include <stdbool.h>
#include <stdint.h>

#include "sound.h"

#define SEA_BEAMS      40 /* of one scan, 0.9 degrees apart, around straight ahead */
#define SEA_MAX_BINS   600
#define SEA_MAX_SCENES 24

struct sea_scene {
    const char *name, *what; /* for tables, for people */
    const char *shapes;      /* as tests/water/scene.h; "": open water */
    double surface_db;       /* of a wall that fills the beam, at 0 m; 0.4 dB/m less farther away */
    double tail_m;           /* the surface's echo decays over so much (soft bottom); 0: it is sharp */
    double floor_db;         /* noise; -INFINITY: counts of zero, and stray ones in one bin of a thousand */
    double reverb_db;        /* of the volume at 1 m, falling with the third power of range */
    double ring_m;           /* the transducer rings at full scale so far, then 2.5 dB less per centimetre */
    double raised_share;     /* of the pings, whose floor is 18 dB higher */
    double burst_share;      /* of the pings, with 1 to 3 m of other sound at -18 dB */
    double frame_m;          /* the vehicle's own frame in a quarter of the beams; 0: none. No part of the truth */
};

extern const struct sea_scene sea_scenes[];
extern const unsigned sea_scenes_n;

/* What of a beam is really there. */
struct sea_met {
    double skirt_m;    /* nearest surface that any ray meets: an echo there is no ghost */
    double nearest_m;  /* nearest within the half-power aperture; INFINITY: none */
    double farthest_m; /* ... and the surface on the axis, or the farthest in the aperture where that meets none */
};

/* One ping with what is really there. Large; points into itself, so it is not copied. */
struct sea_ping {
    struct ping ping;
    struct ping_beam axis;
    uint8_t samples[SEA_MAX_BINS];
    struct sea_met met; /* beyond the range: nothing */
};

struct place;

/* How surfaces sound. A wall that fills the beam at 0 m answers with surface_db, 0.4 dB/m less farther away. */
struct sea_sound {
    double surface_db, tail_m; /* as in struct sea_scene */
    double rough;              /* so much of what it returns square on a surface returns at any angle */
    double bounce_db[2]; /* of what comes back from twice a surface's range, and from where place.h has its ghost;
                                * 0: nothing */
    double
        square_on; /* so much of the cosine of incidence throws sound back and forth; 0: its eighth power does */
    int rays_az, rays_el;
    enum sound_spread spread;
};

/** sea_surfaces - adds to the mean power by bin what a head at `from` hears along attitude's x in a place. */
struct sea_met sea_surfaces(const struct sea_sound *sound, const struct place *place, const double from[3],
                            const double attitude[4], double t_s, const struct ping *head, double *mean);

/** sea_hear - adds to the mean power of surfaces by bin what else there is, in a framed beam the frame, too, and makes
 * the counts of one ping of it: speckle, the pulse, the ring-down, stray counts. */
void sea_hear(const struct sea_scene *scene, enum sound_head head, bool framed, struct dice *dice, double *mean,
              uint8_t *samples);

/** sea_ping_of - a ping of this head without direction, time and samples. */
struct ping sea_ping_of(enum sound_head head);

/** sea_turn - ping i of the Ping360-like head, which turns at a place's origin in the quiet of open water, on a vehicle
 * of this yaw; bins and pulse are so much `longer`. It has no time yet. */
void sea_turn(const struct sea_sound *sound, const struct place *place, double yaw_rad, double longer, uint32_t i,
              struct dice *dice, struct sea_ping *out);

/** sea_listen - beam 0 .. SEA_BEAMS - 1 of the scan `seed` of a scene. */
void sea_listen(const struct sea_scene *scene, enum sound_head head, uint64_t seed, unsigned beam,
                struct sea_ping *out);

#endif
