/* SPDX-License-Identifier: MIT */
#include "vanish.h"
#include "view.h"

#include <math.h>

#include "grid/geometry.h"

enum vanish_why vanish_why(const struct sphere *s, const double place_m[3], uint64_t t_echo_ns, uint64_t now_ns,
                           double member_logodds, double blocked_logodds)
{
    const double range_m = sqrt(place_m[0] * place_m[0] + place_m[1] * place_m[1] + place_m[2] * place_m[2]);
    struct sphere_cell cell;
    const uint32_t d = sphere_holding(s, place_m);
    if (d == RINGS_NONE || range_m > sphere_reach(s))
        return VANISH_FAR;
    bool hidden = false;
    for (uint32_t k = 0; sphere_cell(s, d, k, now_ns, &cell); k++) {
        const double thick_m = cell.to_m - cell.from_m;
        if (cell.logodds > member_logodds && range_m > cell.from_m - thick_m && range_m < cell.to_m + thick_m)
            return VANISH_NOT;
        hidden |= cell.logodds > blocked_logodds && cell.to_m < range_m && cell.t_echo_ns > t_echo_ns;
    }
    if (hidden)
        return VANISH_HIDDEN;
    return sphere_passed(s, d, range_m) > t_echo_ns ? VANISH_SEEN : VANISH_AGED;
}

const char *vanish_word(enum vanish_why why)
{
    static const char *const words[] = {[VANISH_NOT] = "still there",
                                        [VANISH_SEEN] = "seen through",
                                        [VANISH_HIDDEN] = "behind something nearer",
                                        [VANISH_FAR] = "out of reach",
                                        [VANISH_AGED] = "not observed for long"};
    return words[why];
}
