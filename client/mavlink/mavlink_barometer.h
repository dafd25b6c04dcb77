/* SPDX-License-Identifier: MIT */
/*
 * mavlink_barometer - which of an autopilot's barometers is in the water. SCALED_PRESSURE, 2 and 3 say what each reads
 * and not where it is; one in the hull reads the air of the surface at any depth, and would make every depth zero. So a
 * barometer counts only when it is named, when it reads more than a hull holds, when it follows the autopilot's own
 * altitude by the law of water, or when ArduSub says that it is its depth sensor: at its start it sets BARO_PRIMARY
 * (GND_PRIMARY before 4.1) to the first barometer whose driver is one for water, and to 0 where there is none, so that
 * 1 and 2 name one and 0 says nothing. Until then there is no depth, nor once the one that was used sends nothing any
 * more, unless another is in the water. Pure: pressures, altitudes and the time of their arrival
 * (CLOCK_MONOTONIC nanoseconds) go in.
 */
#ifndef SONARD_MAVLINK_BAROMETER_H
#define SONARD_MAVLINK_BAROMETER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MAVLINK_BAROMETERS    3
#define MAVLINK_BAROMETER_ANY 0 /* no number of one */

#define MAVLINK_BAROMETER_NAME 48

/* So often a depth without a position has to come: how far the vehicle may have gone since the last one is pose
 * uncertainty. It makes free water smaller, and a ping that is uncertain by more than 0.1 m takes no obstacle away. */
#define MAVLINK_BAROMETER_HZ 6

/* Where an altitude is from; each is compared with itself only, since each has a zero of its own. */
enum mavlink_altitude {
    MAVLINK_ALTITUDE_VFR_HUD,
    MAVLINK_ALTITUDE_GLOBAL_POSITION,
    MAVLINK_ALTITUDE_AHRS2,
    MAVLINK_ALTITUDES
};

struct mavlink_barometer {
    double hpa;                          /* last reading */
    double first_hpa;                    /* 0: none yet */
    uint64_t t_ns;                       /* of the last reading; 0: none */
    unsigned in_second;                  /* readings since mavlink_barometers_slow was asked last */
    uint64_t deep_ns;                    /* since when all readings are higher than a hull's; 0: the last is not */
    unsigned follows[MAVLINK_ALTITUDES]; /* changes of that altitude in a row that it followed */
    bool wet;                            /* it is in the water, by what it has read */
};

/* An altitude and what the barometers read then. */
struct mavlink_altitude_mark {
    uint64_t t_ns; /* 0: none yet */
    double altitude_m;
    double hpa[MAVLINK_BAROMETERS]; /* 0: nothing, just then */
};

struct mavlink_barometers {
    int named; /* 1 .. MAVLINK_BAROMETERS by configuration, or MAVLINK_BAROMETER_ANY */
    double m_per_hpa;
    struct mavlink_barometer of[MAVLINK_BAROMETERS]; /* of number 1, 2, 3 */
    struct mavlink_altitude_mark mark[MAVLINK_ALTITUDES];
    int primary;       /* number of the autopilot's depth sensor; MAVLINK_BAROMETER_ANY: it did not say */
    bool answered;     /* it was asked for that, and answered */
    unsigned asks;     /* times that the name of a parameter was asked for */
    int used;          /* number; MAVLINK_BAROMETER_ANY: not known yet, or it has gone silent */
    int against;       /* another that is in the water and reads another depth, or MAVLINK_BAROMETER_ANY */
    uint64_t begin_ns; /* of the first reading; 0: none yet */
    int silent;        /* it was used until it sent nothing any more, and that is not said yet */
    bool told_none;
    int told_used, told_against;
};

/** mavlink_barometers_init - `named` as in the struct; m_per_hpa: metres of water per hPa. */
void mavlink_barometers_init(struct mavlink_barometers *b, int named, double m_per_hpa);

/** mavlink_barometers_forget - another vehicle's from now on. What each read first is kept: it was at the surface. */
void mavlink_barometers_forget(struct mavlink_barometers *b);

/** mavlink_barometers_pressure - barometer `number` (1 .. MAVLINK_BAROMETERS) reads hpa (> 0 and finite). */
void mavlink_barometers_pressure(struct mavlink_barometers *b, int number, double hpa, uint64_t now_ns);

/** mavlink_barometers_altitude - the autopilot's altitude, m upward from anywhere; ignored when it is not finite. */
void mavlink_barometers_altitude(struct mavlink_barometers *b, enum mavlink_altitude from, double altitude_m,
                                 uint64_t now_ns);

/** mavlink_barometers_primary - a submarine's BARO_PRIMARY, as it is: counted from 0. */
void mavlink_barometers_primary(struct mavlink_barometers *b, int primary);

/** mavlink_barometers_unsay - the vehicle was gone, and may have started without it: it has to say so again. */
void mavlink_barometers_unsay(struct mavlink_barometers *b);

/**
 * mavlink_barometers_ask - once a second: the name of a parameter to ask a submarine for now; NULL: none. Asked again
 * now and then, for it may have started anew.
 */
const char *mavlink_barometers_ask(struct mavlink_barometers *b);

/** mavlink_barometers_is_primary - is that the name of such a parameter? */
bool mavlink_barometers_is_primary(const char *name);

/**
 * mavlink_barometers_depth - number of the barometer to take the depth from; MAVLINK_BAROMETER_ANY: none, since it is
 * not known which, or two in the water disagree and none is named.
 */
int mavlink_barometers_depth(const struct mavlink_barometers *b);

/** mavlink_barometers_slow - once a second: the number of the one that gives the depth, if it read less often in that
 * second than MAVLINK_BAROMETER_HZ; MAVLINK_BAROMETER_ANY: there is none, or it reads often enough. */
int mavlink_barometers_slow(struct mavlink_barometers *b);

/**
 * mavlink_barometers_surface_hpa - what barometer `number` read first, as the pressure at the surface; 0: no air has
 * that pressure, it was under water or broken, or there is no reading yet.
 */
double mavlink_barometers_surface_hpa(const struct mavlink_barometers *b, int number);

/** mavlink_barometers_name - "SCALED_PRESSURE2 (1016 hPa)", by its last reading. Returns out. */
const char *mavlink_barometers_name(const struct mavlink_barometers *b, int number,
                                    char out[MAVLINK_BAROMETER_NAME]);

/**
 * mavlink_barometers_news - is there something to say that was not said yet? True with one sentence in text: which one
 * is used and why, that it has gone silent, which two disagree, or, ten seconds after the first reading, why there is
 * no depth yet.
 */
bool mavlink_barometers_news(struct mavlink_barometers *b, uint64_t now_ns, char *text, size_t size);

#endif
