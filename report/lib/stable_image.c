/* SPDX-License-Identifier: MIT */
/* stable_image - cases I: thresholds and image filters on histograms and images that break them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "grid/range/background_learn.h"
#include "grid/range/clahe.h"
#include "grid/range/dbscan.h"
#include "grid/range/median.h"
#include "grid/range/otsu.h"
#include "grid/range/polar.h"
#include "grid/range/turn.h"
#include "tests/water/dice.h"
#include "stable.h"

/* Otsu's two classes as textbooks have them, in floats; NAN without a threshold. */
static float naive_otsu(const uint64_t count[256], float *best)
{
    float n = 0, sum = 0, w0 = 0, s0 = 0, most = -1, at = 0;
    for (int v = 0; v < 256; v++) {
        n += (float)count[v];
        sum += (float)v * (float)count[v];
    }
    for (int t = 0; t < 255; t++) {
        w0 += (float)count[t];
        s0 += (float)t * (float)count[t];
        const float d = s0 / w0 - (sum - s0) / (n - w0), between = w0 / n * (1 - w0 / n) * d * d;
        if (between > most || between != between) {
            most = between;
            at = (float)t;
        }
    }
    *best = most;
    return most == most ? at : NAN;
}

static void degenerate(bool quick, struct stable_found *f)
{
    static const struct {
        uint32_t at[2];
        uint64_t count[2];
        int want; /* -1: none */
    } row[] = {{{0, 0}, {0, 0}, -1}, {{77, 77}, {500, 500}, -1}, {{0, 255}, {9999, 1}, 0}, {{10, 11}, {5, 7}, 10}};

    (void)quick;
    f->naive = f->ours = 0;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint64_t count[256] = {0};
        uint8_t t = 0;
        float most;
        for (int k = 0; k < 2; k++)
            count[row[i].at[k]] = row[i].count[k];
        f->naive += naive_otsu(count, &most) != (float)row[i].want;
        f->ours += otsu_two(count, &t) ? t != row[i].want : row[i].want >= 0;
    }
}

static void two_maxima(bool quick, struct stable_found *f)
{
    uint64_t count[256] = {0};
    uint8_t t = 255;
    float most;
    (void)quick;
    f->naive = f->ours = 0;
    for (unsigned step = 1; step < 128; step++) {
        memset(count, 0, sizeof count);
        count[0] = count[step] = count[2 * step] = 1000003;
        f->naive += naive_otsu(count, &most) != 0;
        f->ours += !otsu_two(count, &t) || t != 0;
    }
}

static void scaled_counts(bool quick, struct stable_found *f)
{
    struct dice dice = dice_of(3, 0);
    (void)quick;
    f->naive = f->ours = 0;
    for (int k = 0; k < 200; k++) {
        uint64_t small[256], large[256], cut[256];
        uint8_t t[2] = {0, 0};
        float most;
        for (int v = 0; v < 256; v++) {
            small[v] = dice_bits(&dice) % 2000;
            large[v] = small[v] << 22;
            cut[v] = (uint32_t)large[v]; /* in counters of 32 bits */
        }
        otsu_two(small, &t[0]);
        otsu_two(large, &t[1]);
        f->ours += t[0] != t[1];
        f->naive += naive_otsu(cut, &most) != (float)t[0];
    }
}

/* The best partition into three by trying all, in long double; zero_weight: what a count of value 0 is taken as. */
static void three_by_hand(const uint64_t count[256], long double zero_weight, uint8_t t[2])
{
    long double w[257] = {0}, s[257] = {0}, most = -1;
    for (int v = 0; v < 256; v++) {
        w[v + 1] = w[v] + (long double)count[v];
        s[v + 1] = s[v] + (v ? (long double)v : zero_weight) * (long double)count[v];
    }
    for (int a = 0; a < 254; a++)
        for (int b = a + 1; b < 255; b++) {
            if (!count[a] || !count[b])
                continue;
            const long double n0 = w[a + 1], n1 = w[b + 1] - n0, n2 = w[256] - w[b + 1];
            const long double s0 = s[a + 1], s1 = s[b + 1] - s0, s2 = s[256] - s[b + 1];
            if (!(n0 > 0 && n1 > 0 && n2 > 0))
                continue;
            const long double j = s0 * s0 / n0 + s1 * s1 / n1 + s2 * s2 / n2;
            if (j > most) {
                most = j;
                t[0] = (uint8_t)a;
                t[1] = (uint8_t)b;
            }
        }
}

static void a_million_zeros(bool quick, struct stable_found *f)
{
    struct dice dice = dice_of(4, 0);
    f->naive = f->ours = 0;
    for (int k = 0; k < (quick ? 3 : 30); k++) {
        uint64_t count[256] = {1000000};
        uint8_t t[2] = {0, 0}, want[2] = {0, 0}, wrong[2] = {0, 0};
        for (int n = 0; n < 700; n++)
            count[1 + dice_bits(&dice) % 40]++;
        three_by_hand(count, 0, want);
        three_by_hand(count, 1, wrong);
        f->ours += !otsu_three(count, t) || t[0] != want[0] || t[1] != want[1];
        f->naive += wrong[0] != want[0] || wrong[1] != want[1];
    }
}

#define ROWS    64
#define COLUMNS 48

static uint8_t image[ROWS * COLUMNS], filtered[ROWS * COLUMNS], turned[ROWS * COLUMNS], back[ROWS * COLUMNS];
static clahe_table tables[CLAHE_MAX_TILES * CLAHE_MAX_TILES];

/* Constant images must come out constant, whatever the limit; grids that cannot be must be refused. */
static void flat_images(bool quick, struct stable_found *f)
{
    static const uint8_t level[] = {0, 1, 77, 254, 255};
    static const uint32_t clip[] = {0, 1, 200, CLAHE_MAX_CLIP};
    (void)quick;
    f->ours = 0;
    for (size_t l = 0; l < sizeof level; l++)
        for (size_t c = 0; c < sizeof clip / sizeof clip[0]; c++) {
            const struct clahe_grid g = {ROWS, COLUMNS, 1 + (uint32_t)(l % 2) * 4, 4, clip[c], false, true, true};
            memset(image, level[l], sizeof image);
            clahe_image(&g, image, tables, filtered);
            for (size_t i = 1; i < sizeof filtered; i++)
                f->ours += filtered[i] != filtered[0];
            f->ours += (level[l] == 0 && filtered[0] != 0) + (level[l] == 255 && filtered[0] != 255);
        }
    f->ours += clahe_grid_ok(&(struct clahe_grid){.rows = 3, .columns = 48, .tiles_y = 8, .tiles_x = 8});
    f->naive = 0; /* tiles of ceil(rows / tiles): empty ones, whose mean count is 0/0 */
    for (int rows = 3; rows <= ROWS; rows++)
        for (int t = 0, size = (rows + 7) / 8; t < 8; t++)
            f->naive += t * size >= rows;
}

static void mirror(const uint8_t *in, uint8_t *out)
{
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < COLUMNS; c++)
            out[r * COLUMNS + c] = in[(ROWS - 1 - r) * COLUMNS + c];
}

static double unlike_mirrored(bool corner)
{
    const struct clahe_grid g = {ROWS, COLUMNS, 4, 4, 200, corner, false, false};
    double unlike = 0;
    clahe_image(&g, image, tables, filtered);
    mirror(image, turned);
    clahe_image(&g, turned, tables, back);
    mirror(back, turned);
    for (size_t i = 0; i < sizeof filtered; i++)
        unlike += filtered[i] != turned[i];
    return unlike;
}

static void mirrored_images(bool quick, struct stable_found *f)
{
    struct dice dice = dice_of(6, 0);
    (void)quick;
    for (size_t i = 0; i < sizeof image; i++)
        image[i] = (uint8_t)(dice_bits(&dice) % 200 * (i % 7) / 7);
    f->naive = unlike_mirrored(true);
    f->ours = unlike_mirrored(false);
}

static void small_medians(bool quick, struct stable_found *f)
{
    static uint8_t bin[5] = {9, 200, 9, 9, 9}, out[8];
    void *work = stable_memory(median_work_size(5));
    (void)quick;
    f->naive = f->ours = 0;
    for (unsigned k = 3; k <= 5; k += 2)
        for (uint32_t n = 1; n <= 5; n++) {
            struct median_row row[5] = {{0}};
            row[k / 2].bin = bin; /* the only beam */
            memset(out, 0xee, sizeof out);
            median_filter(k, row, n, work, out);
            for (uint32_t i = 0; i < n; i++) {
                unsigned above = 0;
                for (int d = -(int)k / 2; d <= (int)k / 2; d++) {
                    const int at = (int)i + d;
                    f->naive += at < 0 || at >= (int)n; /* what a loop without ends reads */
                    above += bin[at < 0 ? 0 : at >= (int)n ? (int)n - 1 : at] > 9;
                }
                f->ours += out[i] != (above > k / 2 ? 200 : 9);
            }
            for (uint32_t i = n; i < sizeof out; i++)
                f->ours += out[i] != 0xee;
        }
    free(work);
}

/* Rows that are taken for neighbours and are none: of a scan that reverses, loses beams, and changes its step. */
static void reversing_scan(bool quick, struct stable_found *f)
{
    static struct polar polar;
    static uint32_t last_step;
    uint32_t u = 1000, t = 0;
    (void)quick;
    f->naive = f->ours = 0;
    polar_init(&polar);
    last_step = 8;
    for (int k = 0; k < 3000; k++) {
        const uint32_t step = k < 2000 ? 8 : 5;
        const bool lost = k % 37 == 0, backward = k / 50 % 2;
        const uint32_t before = u;
        u = (u + (backward ? 400 - step : step)) % 400;
        if (lost)
            continue;
        const struct ping ping = {.t_ns = 1 + (uint64_t)++t * 50000000u,
                                  .n_beams = 1,
                                  .n_bins = 100,
                                  .dr_m = 0.1f,
                                  .head_units = u,
                                  .head_turn = 400};
        const uint32_t row = polar_place(&polar, &ping);
        /* Naive: the row of the last step, and its neighbour is what came before. */
        f->naive += (u + 400 - before) % 400 != last_step;
        for (int offset = -1; offset <= 1; offset += 2) {
            const struct polar_row *n = polar_neighbour(&polar, row, offset);
            const uint32_t there = (row + polar.rows + (uint32_t)offset) % polar.rows;
            f->ours += n && (polar_index(&polar, n) != there || n->ping == 0 || n->ping > polar.pings);
        }
    }
}

static void long_histograms(bool quick, struct stable_found *f)
{
    enum { BINS = 4 };
    const unsigned beams = quick ? 100000 : 10000000;
    static uint8_t rows[200][BINS];
    struct dice dice = dice_of(9, 1);
    struct turn turn;
    uint64_t pixels;
    float faded[256] = {0};
    void *memory = stable_memory(turn_size(200, BINS, 1));
    turn_init(&turn, memory, 200, BINS, 1);
    turn_begin(&turn, 200, BINS, 1, 1);
    for (unsigned k = 0; k < beams; k++) {
        uint8_t *row = rows[k % 200];
        const uint64_t bits = dice_bits(&dice);
        for (int i = 0; i < BINS; i++)
            row[i] = (uint8_t)(bits >> 8 * i);
        turn_put(&turn, k % 200, row);
        for (int i = 0; i < BINS; i++) /* naive: one in, a share of all out */
            faded[row[i]] += 1 - faded[row[i]] / 800;
    }
    const uint32_t *got = turn_histogram(&turn, 0, 0, &pixels);
    uint32_t want[256] = {0};
    for (int r = 0; r < 200; r++)
        for (int i = 0; i < BINS; i++)
            want[rows[r][i]]++;
    f->naive = f->ours = 0;
    for (int v = 0; v < 256; v++) {
        f->ours += fabs((double)got[v] - want[v]);
        f->naive += fabs((double)faded[v] - want[v]);
    }
    free(memory);
}

/* What a template learns of one cell from k frames; the vehicle stands, and frames count all the same. */
static uint8_t learnt_of(const uint8_t *frame, uint32_t k)
{
    static uint8_t samples[8];
    struct ping_beam beam = {0};
    struct ping ping = {.kind = PING_PROFILE,
                        .law = AMPLITUDE_SQRT,
                        .sample_bytes = 1,
                        .n_beams = 1,
                        .n_bins = sizeof samples,
                        .dr_m = 0.02f,
                        .pulse_m = 0.04f,
                        .az_aperture_rad = 0.035f,
                        .pose = pose_identity,
                        .beam = &beam,
                        .samples = samples};
    const struct background_learn_conf conf = {.pings = k, .standing = true};
    struct background_shape shape;
    if (!background_shape_of(&ping, &shape))
        return 0;
    struct background_learn *learn =
        background_learn_init(stable_memory(background_learn_size(&shape, k)), &shape, &conf, &mount_identity);
    for (uint32_t i = 0; i < k; i++) {
        memset(samples, frame[i], sizeof samples);
        background_learn_take(learn, &ping);
    }
    struct background *b = background_init(stable_memory(background_size(&shape)), &shape, 40);
    background_learn_finish(learn, 1, b);
    const uint8_t level = b->level[3];
    free(b);
    free(learn);
    return level;
}

/* A target in fewer than half of the frames is gone from the template, in more it stays; k = 1 and all 255 too. */
static void template_of_frames(bool quick, struct stable_found *f)
{
    (void)quick;
    f->naive = f->ours = 0;
    for (uint32_t k = 1; k <= 33; k += 2)
        for (uint32_t seen = 0; seen <= k; seen++) {
            uint8_t frame[33];
            double mean = 0;
            for (uint32_t i = 0; i < k; i++) {
                frame[i] = i < seen ? 255 : 10;
                mean += frame[i] / (double)k;
            }
            const uint8_t want = 2 * seen > k ? 255 : 10;
            f->ours += learnt_of(frame, k) != want;
            f->naive += fabs(mean - want) > 1;
        }
}

static void clusters(bool quick, struct stable_found *f)
{
    enum { R = 12, C = 10, SPAN = 1 };
    static uint8_t point[R * C];
    static int32_t label[R * C];
    int16_t reach[C * 3];
    void *work = stable_memory(dbscan_work_size(R, C));

    (void)quick;
    for (int i = 0; i < C * 3; i++)
        reach[i] = 1;
    struct dbscan d = {R, C, true, SPAN, reach, 3};
    memset(point, 0, sizeof point);
    f->ours = dbscan_run(&d, point, work, label) != 0;
    memset(point, 1, sizeof point);
    f->ours += dbscan_run(&d, point, work, label) != 1;
    memset(point, 0, sizeof point);
    point[5 * C + 5] = 1;
    f->ours += dbscan_run(&d, point, work, label) != 0 || label[5 * C + 5] != DBSCAN_NOISE;
    d.min_points = 1;
    f->ours += dbscan_run(&d, point, work, label) != 1;
    d.min_points = 3;
    memset(point, 0, sizeof point);
    point[3] = point[C + 3] = point[(R - 1) * C + 3] = 1; /* across the seam */
    f->ours += dbscan_run(&d, point, work, label) != 1;
    d.wrap = false;
    f->naive = dbscan_run(&d, point, work, label) != 1;
    free(work);
}

const struct stable_case stable_image[] = {
    {"I1", "histograms: empty, one bin, 9999 to 1, two adjacent bins", "wrong thresholds",
     "textbook Otsu in float", 0, degenerate},
    {"I2", "three equal bins: two exact maxima, 127 times", "not the smaller one", "textbook Otsu in float", 0,
     two_maxima},
    {"I3", "200 histograms times 2^22", "thresholds that move", "32-bit counts", 0, scaled_counts},
    {"I4", "a million zeros, 700 others, three classes", "histograms cut wrongly", "value 0 weighed as 1", 0,
     a_million_zeros},
    {"I5", "CLAHE of constant images, any limit; more tiles than rows", "pixels that differ, grids accepted",
     "tiles of ceil(rows / 8): empty ones", 0, flat_images},
    {"I6", "CLAHE of a mirrored image", "pixels that differ", "pixels at their corners", 0, mirrored_images},
    {"I7", "medians larger than the image", "wrong pixels, reads outside", "no ends", 0, small_medians},
    {"I8", "a scan that reverses, loses beams, changes its step", "wrong neighbours",
     "the beam before is the neighbour", 0, reversing_scan},
    {"I9", "a histogram kept up over 1e7 beams", "counts off the recount", "a fading histogram", 0,
     long_histograms},
    {"I10", "templates of 1 to 33 frames, a target in some of them", "wrong templates", "the mean of the frames",
     0, template_of_frames},
    {"I11", "clusters: none, all, single, across the seam", "wrong answers", "no seam", 0, clusters},
    {0},
};
