/* SPDX-License-Identifier: MIT */
/*
 * median - the k x k median of one row of a polar image. Knows rows and bins, no sonar; the caller says which rows
 * are neighbours.
 */
#ifndef SONARD_MEDIAN_H
#define SONARD_MEDIAN_H

#include <stddef.h>
#include <stdint.h>

#define MEDIAN_MAX_SIZE 5

struct median_row {
    const uint8_t *bin; /* [n]; NULL: the row is missing */
    int32_t shift;      /* its bin i lies where bin i + shift of the middle row does */
};

/** median_work_size - bytes of working memory for rows of up to n bins. */
size_t median_work_size(uint32_t n);

/**
 * median_filter - out[i] = the median of the bins i - k/2 .. i + k/2 of the k rows row[0 .. k), row[k/2] being the
 * middle one.
 * k: 3 or 5. Beyond its ends a row goes on with its last bin. Where rows are missing the lower median of what is
 * there is taken (the element (c - 1) / 2 of c sorted ones); row[k/2] is there. out is none of the rows.
 * The same steps whatever the values: no branch depends on the data.
 */
void median_filter(unsigned k, const struct median_row *row, uint32_t n, void *work, uint8_t *out);

#endif
