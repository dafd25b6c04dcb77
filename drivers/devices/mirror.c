/* SPDX-License-Identifier: MIT */
/*
 * mirror - see mirror.h.
 */
#include "mirror.h"

void mirror_ping(struct ping *ping)
{
    for (uint16_t i = 0; i < ping->n_beams; i++)
        ping->beam[i].az_rad = -ping->beam[i].az_rad;
    if (ping->head_turn)
        ping->head_units = (ping->head_turn - ping->head_units % ping->head_turn) % ping->head_turn;
}

void mirror_arc(double *from_rad, double *to_rad)
{
    const double from = *from_rad;
    *from_rad = -*to_rad;
    *to_rad = -from;
}
