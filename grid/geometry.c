/* SPDX-License-Identifier: MIT */
#include "geometry.h"

#include <math.h>

const struct pose pose_identity = {.attitude = {1, 0, 0, 0}};
const struct mount mount_identity = {.attitude = {1, 0, 0, 0}};

void geo_direction(double az_rad, double el_rad, double v[3])
{
    double c = cos(el_rad);
    v[0] = c * cos(az_rad);
    v[1] = c * sin(az_rad);
    v[2] = -sin(el_rad);
}

void geo_angles(const double v[3], double *az_rad, double *el_rad)
{
    double level = hypot(v[0], v[1]);
    *el_rad = atan2(-v[2], level);
    *az_rad = level > 0 ? geo_wrap(atan2(v[1], v[0])) : 0.0;
}

double geo_wrap(double a_rad)
{
    double a = fmod(a_rad, GEO_TURN);
    if (a < 0)
        a += GEO_TURN;
    return a >= GEO_TURN ? 0.0 : a + 0.0; /* -1e-17 + 2pi rounds to 2pi; + 0.0 turns -0 into 0 */
}

double geo_wrap_pi(double a_rad)
{
    double a = geo_wrap(a_rad);
    return a >= GEO_PI ? a - GEO_TURN : a;
}

struct pose_blur pose_blur_of(const double blur_m[3], const double axis[3], double spread_rad)
{
    const double length_m = geo_length(blur_m);
    if (!(length_m > 0))
        return (struct pose_blur){0, 0};
    const double off_rad = acos(fmin(fabs(geo_dot(blur_m, axis)) / length_m, 1));
    return (struct pose_blur){length_m * cos(fmax(off_rad - spread_rad, 0)),
                              length_m * sin(fmin(off_rad + spread_rad, GEO_PI / 2))};
}

void quat_multiply(const double a[4], const double b[4], double out[4])
{
    double w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    double x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    double y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    double z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
    out[0] = w;
    out[1] = x;
    out[2] = y;
    out[3] = z;
}

/* v + 2w(u x v) + 2u x (u x v), u the vector part: 30 operations instead of two full products */
void quat_rotate(const double q[4], const double v[3], double out[3])
{
    double tx = 2 * (q[2] * v[2] - q[3] * v[1]);
    double ty = 2 * (q[3] * v[0] - q[1] * v[2]);
    double tz = 2 * (q[1] * v[1] - q[2] * v[0]);
    double x = v[0] + q[0] * tx + q[2] * tz - q[3] * ty;
    double y = v[1] + q[0] * ty + q[3] * tx - q[1] * tz;
    double z = v[2] + q[0] * tz + q[1] * ty - q[2] * tx;
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

void quat_rotate_inverse(const double q[4], const double v[3], double out[3])
{
    const double conjugate[4] = {q[0], -q[1], -q[2], -q[3]};
    quat_rotate(conjugate, v, out);
}

void quat_axes(const double q[4], double axis[3][3])
{
    double x2 = 2 * q[1], y2 = 2 * q[2], z2 = 2 * q[3];
    double xx = x2 * q[1], xy = x2 * q[2], xz = x2 * q[3], yy = y2 * q[2], yz = y2 * q[3], zz = z2 * q[3];
    double wx = x2 * q[0], wy = y2 * q[0], wz = z2 * q[0];
    axis[0][0] = 1 - (yy + zz);
    axis[0][1] = xy + wz;
    axis[0][2] = xz - wy;
    axis[1][0] = xy - wz;
    axis[1][1] = 1 - (xx + zz);
    axis[1][2] = yz + wx;
    axis[2][0] = xz + wy;
    axis[2][1] = yz - wx;
    axis[2][2] = 1 - (xx + yy);
}

void quat_from_rpy(double roll, double pitch, double yaw, double q[4])
{
    double cr = cos(roll / 2), sr = sin(roll / 2);
    double cp = cos(pitch / 2), sp = sin(pitch / 2);
    double cy = cos(yaw / 2), sy = sin(yaw / 2);
    q[0] = cr * cp * cy + sr * sp * sy;
    q[1] = sr * cp * cy - cr * sp * sy;
    q[2] = cr * sp * cy + sr * cp * sy;
    q[3] = cr * cp * sy - sr * sp * cy;
}

void quat_to_rpy(const double q[4], double *roll, double *pitch, double *yaw)
{
    double s = 2 * (q[0] * q[2] - q[3] * q[1]);
    *roll = atan2(2 * (q[0] * q[1] + q[2] * q[3]), 1 - 2 * (q[1] * q[1] + q[2] * q[2]));
    *pitch = asin(s > 1 ? 1 : s < -1 ? -1 : s);
    *yaw = atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
}

bool quat_normalise(double q[4])
{
    double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(n >= 0.9 && n <= 1.1)) /* written so that NaN fails */
        return false;
    for (int i = 0; i < 4; i++)
        q[i] /= n;
    return true;
}

/* The angle from the chord, not from acos of the product, which loses half the digits near 0. */
void quat_slerp(const double a[4], const double b[4], double t, double out[4])
{
    double dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    double sign = dot < 0 ? -1.0 : 1.0;
    double minus = 0, plus = 0;
    for (int i = 0; i < 4; i++) {
        minus += (a[i] - sign * b[i]) * (a[i] - sign * b[i]);
        plus += (a[i] + sign * b[i]) * (a[i] + sign * b[i]);
    }
    double w = 2 * atan2(sqrt(minus), sqrt(plus));
    double wa = 1 - t, wb = t;
    if (w >= 1e-8) {
        wa = sin((1 - t) * w) / sin(w);
        wb = sin(t * w) / sin(w);
    }
    double n = 0;
    for (int i = 0; i < 4; i++) {
        out[i] = wa * a[i] + wb * sign * b[i];
        n += out[i] * out[i];
    }
    for (int i = 0; i < 4; i++)
        out[i] /= sqrt(n);
}
