/* SPDX-License-Identifier: MIT */
#include "witness.h"

#include <math.h>

size_t witness_bytes(uint32_t n)
{
    return n * sizeof(struct witness);
}

void witness_init(struct witnesses *w, void *memory, uint32_t n)
{
    *w = (struct witnesses){.beam = memory, .n = n};
}

static void turned(const double turn[4], double az_rad, double el_rad, float out[3])
{
    double v[3];
    geo_direction(az_rad, el_rad, v);
    quat_rotate(turn, v, v);
    for (int i = 0; i < 3; i++)
        out[i] = (float)v[i];
}

static void take_echo(struct witness *out, const struct echoes *e, const struct echo *echo)
{
    const double bin = e->bin_m > 0 ? ((double)echo->range_m - (double)e->bin0_m) / (double)e->bin_m : -1;
    out->range_m = echo->range_m;
    out->range_sd_m = echo->sd_m;
    out->near_m = echo->near_m;
    out->confidence = echo->confidence;
    out->own = (echo->flags & ECHO_OWN) != 0;
    out->bin = bin >= 0 ? (int32_t)bin : -1;
}

void witness_take(struct witnesses *w, const struct echoes *e, const struct mount *mount)
{
    const bool ned = (e->pose.has & POSE_ATTITUDE) != 0;
    double turn[4] = {mount->attitude[0], mount->attitude[1], mount->attitude[2], mount->attitude[3]};
    if (ned)
        quat_multiply(e->pose.attitude, mount->attitude, turn);
    for (uint16_t b = 0; b < e->n_beams; b++) {
        const struct beam_echoes *heard = &e->beam[b];
        struct witness *out = &w->beam[w->taken++ % w->n];
        *out = (struct witness){.t_ns = e->t_ns,
                                .seq = e->seq,
                                .sensor = e->sensor,
                                .state = heard->state,
                                .ned = ned,
                                .az_rad = heard->az_rad,
                                .el_rad = heard->el_rad,
                                .half_az_rad = e->az_aperture_rad / 2,
                                .half_el_rad = e->el_aperture_rad / 2,
                                .blind_m = heard->blind_m,
                                .free_to_m = heard->free_to_m,
                                .bin = -1};
        turned(turn, (double)heard->az_rad, (double)heard->el_rad, out->axis);
        turned(turn, (double)heard->az_rad, (double)heard->el_rad + GEO_PI / 2, out->up);
        if (heard->n)
            take_echo(out, e, &heard->echo[0]);
    }
}

const struct witness *witness_look(const struct witnesses *w, uint64_t k)
{
    return k < w->taken && k < w->n ? &w->beam[(w->taken - 1 - k) % w->n] : NULL;
}

static double dot(const float a[3], const double b[3])
{
    return (double)a[0] * b[0] + (double)a[1] * b[1] + (double)a[2] * b[2];
}

bool witness_sees(const struct witness *beam, const double axis[3], double half_rad)
{
    const float *a = beam->axis, *u = beam->up;
    const float side[3] = {a[1] * u[2] - a[2] * u[1], a[2] * u[0] - a[0] * u[2], a[0] * u[1] - a[1] * u[0]};
    const double ahead = dot(a, axis), aside = dot(side, axis), upward = dot(u, axis);
    const double off_az = fabs(atan2(aside, ahead)), off_el = fabs(atan2(upward, hypot(ahead, aside)));
    return off_az <= (double)beam->half_az_rad + half_rad && off_el <= (double)beam->half_el_rad + half_rad;
}
