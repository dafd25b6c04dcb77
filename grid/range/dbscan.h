/* SPDX-License-Identifier: MIT */
/*
 * dbscan - groups the points of a polar picture that lie close together (density-based clustering, Ester et al.
 * 1996). Exact, and independent of any order. Which points are neighbours stands in a table of reaches, made for index
 * units or for metres; knows no intensities and no sonar.
 */
#ifndef SONARD_DBSCAN_H
#define SONARD_DBSCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define DBSCAN_ROWS_MAX 4096
#define DBSCAN_SPAN_MAX 255

enum dbscan_label { DBSCAN_NOISE = -1, DBSCAN_NO_POINT = -2 };

/*
 * reach[c * (2 * span + 1) + span + dx]: two points, one in column c and one in column c + dx, are neighbours when
 * their rows differ by at most this; -1: never. Symmetric: the entry of c and dx is that of c + dx and -dx.
 */
struct dbscan {
    uint32_t rows, cols;  /* 1..DBSCAN_ROWS_MAX; 1..PING_MAX_BINS */
    bool wrap;            /* the last row is next to the first */
    uint32_t span;        /* columns on each side that a reach is known of, 0..DBSCAN_SPAN_MAX */
    const int16_t *reach; /* [cols][2 * span + 1] */
    uint32_t min_points;  /* in a neighbourhood, the point itself counted, that make its centre a core; >= 1 */
};

/* Where the cells of a polar picture are: rows are bearings, column c is at r0_m + (c + 1/2) * dr_m. */
struct dbscan_polar {
    double row_rad; /* between two rows; 0: all at the same place */
    double r0_m, dr_m;
    uint32_t rows, cols;
};

/**
 * dbscan_reach_metric - the table for a distance of at most eps_m between the centres of cells:
 * (r1-r2)^2 + 4 r1 r2 sin^2(angle/2) <= eps^2. Columns beyond span are no neighbours.
 */
void dbscan_reach_metric(double eps_m, const struct dbscan_polar *picture, uint32_t span, int16_t *reach);

/** dbscan_work_size - bytes of working memory, aligned to uint32_t. */
size_t dbscan_work_size(uint32_t rows, uint32_t cols);

/**
 * dbscan_run - label[rows][cols] of point[rows][cols] (not 0: a point): enum dbscan_label or the cluster's number.
 * Clusters are numbered from 0 by their first core in raster order; a point that is no core takes the lowest number
 * among the cores it neighbours. Returns the number of clusters. O(cells + points * span) but for thin chains. Pure.
 */
uint32_t dbscan_run(const struct dbscan *dbscan, const uint8_t *point, void *work, int32_t *label);

#endif
