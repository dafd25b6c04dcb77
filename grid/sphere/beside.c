/* SPDX-License-Identifier: MIT */
#include "beside.h"

#include <math.h>

#define LAST_NS    2000000000u /* what a head did longer ago is another sweep */
#define SAME_SHARE 0.02        /* of half a beam's width: so near, an axis is the same */

/* From a head's last beam to this one; 0: not known. While it does not turn the last step counts. */
static double step_of(const struct beam *b, const struct beside_last *last)
{
    const struct echoes *e = b->ping;
    if (!last->t_ns || last->t_ns > e->t_ns || e->t_ns - last->t_ns > LAST_NS)
        return 0;
    const double axis[3] = {(double)last->axis[0], (double)last->axis[1], (double)last->axis[2]};
    const double gap_rad = fabs(atan2(geo_dot(axis, b->side), geo_dot(axis, b->axis)));
    return gap_rad < SAME_SHARE * (double)e->az_aperture_rad / 2 ? (double)last->gap_rad : gap_rad;
}

/* To the farther one of the two beams beside it in the ping, or the only one; 0: there is none. */
static double gap_of(const struct echoes *e, uint16_t index)
{
    const double az_rad = (double)e->beam[index].az_rad;
    const double before = index > 0 ? fabs(geo_wrap_pi(az_rad - (double)e->beam[index - 1].az_rad)) : 0,
                 behind =
                     index + 1 < e->n_beams ? fabs(geo_wrap_pi((double)e->beam[index + 1].az_rad - az_rad)) : 0;
    return fmax(before, behind);
}

struct beam_row beside_row(const struct beam *b, uint16_t index, const struct beside_last *last)
{
    const struct echoes *e = b->ping;
    const float seam_rad = (float)((e->n_beams > 1 ? gap_of(e, index) : step_of(b, last)) / 2);
    return (struct beam_row){.half_az_rad = e->az_aperture_rad / 2,
                             .half_el_rad = e->el_aperture_rad / 2,
                             .left_rad = seam_rad,
                             .right_rad = seam_rad,
                             .seam_rad = seam_rad};
}

void beside_keep(struct beside_last *last, const struct beam *b)
{
    *last = (struct beside_last){.t_ns = b->ping->t_ns, .gap_rad = (float)step_of(b, last)};
    for (int i = 0; i < 3; i++)
        last->axis[i] = (float)b->axis[i];
}
