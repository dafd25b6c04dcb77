/* SPDX-License-Identifier: MIT */
/*
 * geometry - frames, poses and directions. Pure: no clock, no heap, no state.
 *
 * World: local NED (north, east, down). Body: FRD (forward, right, down). Sensor: FRD of its own, beam axis at head
 * angle 0 along x, the head turning about z. Azimuth is clockwise seen from above (x towards y); elevation is
 * positive upward (against z). Metres, radians, Hamilton quaternions (w, x, y, z) that turn body vectors into world
 * vectors.
 */
#ifndef SONARD_GEOMETRY_H
#define SONARD_GEOMETRY_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define GEO_PI   3.14159265358979323846
#define GEO_TURN (2.0 * GEO_PI)

/** radians(), degrees() - the one place where the factor stands. */
static inline double geo_rad(double deg)
{
    return deg * (GEO_PI / 180.0);
}

static inline double geo_deg(double rad)
{
    return rad * (180.0 / GEO_PI);
}

enum pose_part {
    POSE_ATTITUDE = 1,  /* attitude is valid */
    POSE_POSITION = 2,  /* north and east are valid */
    POSE_DEPTH = 4,     /* down is valid */
    POSE_VELOCITY = 8,  /* velocity is valid */
    POSE_ALTITUDE = 16, /* altitude_m is valid */
};

/* Where the body is at one time. Parts that are not in `has` hold the identity or zero. */
struct pose {
    uint64_t t_ns;            /* monotonic */
    double position_m[3];     /* NED */
    double attitude[4];       /* unit quaternion, body to NED */
    double velocity_mps[3];   /* NED */
    double altitude_m;        /* down to the bottom, >= 0: no more than that, wherever the body may be by now */
    double path_m;            /* distance travelled since start; never falls */
    uint64_t discontinuities; /* its attitude had made: what lay where before one, nobody knows */
    uint64_t withdrawn;   /* so often all poses were withdrawn before: a grid turned by earlier ones starts anew */
    double uncertain_m;   /* pose uncertainty, a bound: how far from position_m the body may be by now */
    double uncertain_rad; /* likewise: how far from attitude it may be turned */
    /* Of a ping whose time is uncertain. Wherever within it the ping was sent, the body was on the line from
     * position_m - blur_m to position_m + blur_m (NED), or no farther than blur_any_m from there. */
    double blur_m[3], blur_any_m;
    double blur_rad; /* and turned no farther than this from attitude */
    /* How far the vehicle has drifted since start, at most, level and in depth: between two poses it has gone no
     * farther beside what their positions say than the difference. Neither falls. */
    double drift_m[2];
    double drift_mps;    /* it grows so fast now; > 0: poses have no position */
    bool heading_adrift; /* poses have no attitude, and the vehicle may turn */
    double
        heading_radps; /* the heading of attitudes goes wrong so fast, at most: what was observed t_s ago lies up to
                             heading_radps * t_s beside where they have it */
    unsigned has;      /* set of enum pose_part */
};

/*
 * The place of the vehicle is known to this share of the way travelled since. All of it counts, however small the steps
 * are: an error in scale does not average out.
 */
#define POSE_WAY_ERROR 0.01

/* A place that is farther away at once has jumped: nobody knows where what was observed from the old one lies. */
#define POSE_STEP_MOST_M 1.0

/* How far off a beam may be for the blur of its pose: along it, and across. */
struct pose_blur {
    double along_m, across_m;
};

/** pose_blur_of - seen along all directions up to spread_rad from unit vector axis, in the frame of blur_m. */
struct pose_blur pose_blur_of(const double blur_m[3], const double axis[3], double spread_rad);

/* A sensor's place in the body. */
struct mount {
    double position_m[3]; /* forward, right, down */
    double attitude[4];   /* unit quaternion, sensor to body */
};

extern const struct pose pose_identity;
extern const struct mount mount_identity;

/** geo_direction - unit vector (FRD or NED alike) of an azimuth and elevation in radians. */
void geo_direction(double az_rad, double el_rad, double v[3]);

/** geo_angles - azimuth [0, 2pi) and elevation [-pi/2, pi/2] of v != 0; straight up or down has azimuth 0. */
void geo_angles(const double v[3], double *az_rad, double *el_rad);

#define GEO_ROUGH_RAD 1e-6 /* more than geo_rough_angle is ever wrong: 4.3e-7 */

/**
 * geo_rough_angle - atan2(y, x), nearly, by arithmetic alone: atan(a) / a for a in [0, 1] is interpolated in a^2 at
 * seven Chebyshev nodes. NaN for 0, 0.
 */
static inline double geo_rough_angle(double y, double x)
{
    const double along = fabs(x), aside = fabs(y);
    const double a = aside > along ? along / aside : aside / along, s = a * a;
    const double low = 0.9999992256 + s * (-0.3332567804 + s * 0.1987204027);
    const double high = -0.1344786406 + s * (0.083126453 + s * (-0.0363604309 + s * 0.0076483539));
    double angle = a * (low + s * s * s * high);
    angle = aside > along ? GEO_PI / 2 - angle : angle;
    angle = x < 0 ? GEO_PI - angle : angle;
    return y < 0 ? -angle : angle;
}

/** geo_wrap - the angle in [0, 2pi); exact turns and -1e-17 give 0, never 2pi. */
double geo_wrap(double a_rad);

/** geo_dot - a . b. */
static inline double geo_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** geo_length - of a vector, in its unit. */
static inline double geo_length(const double v[3])
{
    return sqrt(geo_dot(v, v));
}

/** geo_wrap_pi - the angle in [-pi, pi). */
double geo_wrap_pi(double a_rad);

void quat_rotate(const double q[4], const double v[3], double out[3]);         /* out = q v q*; out may be v */
void quat_rotate_inverse(const double q[4], const double v[3], double out[3]); /* out = q* v q */
void quat_multiply(const double a[4], const double b[4], double out[4]);       /* out = a b; out may be a or b */

/** quat_axes - where q turns the x, y and z axes: axis[a] is q e_a q*. */
void quat_axes(const double q[4], double axis[3][3]);

/** quat_from_rpy - attitude of roll, pitch, yaw in radians (yaw first, then pitch, then roll: aerospace ZYX). */
void quat_from_rpy(double roll, double pitch, double yaw, double q[4]);

/** quat_to_rpy - the inverse; pitch in [-pi/2, pi/2], roll and yaw in [-pi, pi]. */
void quat_to_rpy(const double q[4], double *roll, double *pitch, double *yaw);

/** quat_normalise - scale q to length 1. False, q untouched, when |q| is outside [0.9, 1.1] or not finite. */
bool quat_normalise(double q[4]);

/** quat_slerp - shortest way from a (t = 0) to b (t = 1); t outside continues. Result has length 1. */
void quat_slerp(const double a[4], const double b[4], double t, double out[4]);

#endif
