/* SPDX-License-Identifier: MIT */
/* surface - see surface.h. */
#include "surface.h"

#include <math.h>
#include <stdlib.h>

#include "cost.h"

/* Looks in growing cubes. */
double surface_to_marked(const struct lattice_box *box, const uint8_t *mark, double voxel_m,
                         const struct lattice_place *at)
{
    const int32_t most = (int32_t)(SURFACE_SEARCH_M / voxel_m);
    double best = SURFACE_SEARCH_M;
    for (int32_t shell = 0; shell <= most && (shell - 1) * voxel_m < best; shell++)
        for (int32_t i = -shell; i <= shell; i++)
            for (int32_t j = -shell; j <= shell; j++)
                for (int32_t k = -shell; k <= shell;
                     k += abs(i) == shell || abs(j) == shell || shell == 0 ? 1 : 2 * shell) {
                    const int64_t cell[3] = {at->cell[0] + i, at->cell[1] + j, at->cell[2] + k};
                    const int32_t step[3] = {i, j, k};
                    double d2 = 0;
                    if (!lattice_holds(box, cell) || !mark[surface_index(box, cell)])
                        continue;
                    for (int a = 0; a < 3; a++)
                        d2 += (step[a] + 0.5 - at->offset[a]) * (step[a] + 0.5 - at->offset[a]);
                    best = fmin(best, sqrt(d2) * voxel_m);
                }
    return best;
}

struct surface_spread surface_spread_of(double *d, size_t n)
{
    double sum = 0;
    for (size_t i = 0; i < n; i++)
        sum += d[i];
    cost_sort(d, (unsigned)n);
    return (struct surface_spread){n > 0 ? sum / (double)n : 0, cost_quantile(d, (unsigned)n, 0.95),
                                   cost_quantile(d, (unsigned)n, 1)};
}
