/* SPDX-License-Identifier: MIT */
/*
 * test_background - templates: medians against a reference table and a naive sort, the rule of motion, what is kept
 * as the vehicle, the mask on pings of the same and of other ranges, and the file.
 */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include <unistd.h>

#include "core/fault.h"
#include "daemon/background/template_file.h"
#include "grid/range/background.h"
#include "grid/range/background_keep.h"
#include "grid/range/background_learn.h"
#include "grid/range/extract.h"

#define BINS 64
#define TURN 400

static uint8_t samples[PING_MAX_BINS];
static struct ping_beam beam;

/* A Ping360-like ping with empty water. */
static struct ping ping_at(uint32_t units, uint32_t bins)
{
    beam = (struct ping_beam){.az_rad = (float)(GEO_TURN * units / TURN)};
    memset(samples, 0, sizeof samples);
    return (struct ping){.kind = PING_PROFILE,
                         .law = AMPLITUDE_SQRT,
                         .sample_bytes = 1,
                         .n_beams = 1,
                         .n_bins = bins,
                         .dr_m = 0.02f,
                         .pulse_m = 0.04f,
                         .az_aperture_rad = 0.035f,
                         .el_aperture_rad = 0.4f,
                         .head_units = units,
                         .head_turn = TURN,
                         .pose = pose_identity,
                         .beam = &beam,
                         .samples = samples};
}

static struct background_learn *learn_new(const struct ping *like, uint32_t pings, bool standing)
{
    struct background_shape shape;
    const struct background_learn_conf conf = {.pings = pings, .standing = standing};
    CHECK(background_shape_of(like, &shape));
    return background_learn_init(malloc(background_learn_size(&shape, pings)), &shape, &conf, &mount_identity);
}

static struct background *finish(struct background_learn *learn, uint32_t least, uint8_t mask)
{
    const struct background_shape *s = background_learn_shape(learn);
    struct background *b = background_init(malloc(background_size(s)), s, mask);
    background_learn_finish(learn, least, b);
    free(learn);
    return b;
}

static struct background_progress progress(const struct background_learn *learn)
{
    struct background_progress p;
    background_learn_progress(learn, &p);
    return p;
}

/* ---- medians ---- */

static void from_hex(const char *hex, uint8_t *out, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        const char digits[3] = {hex[2 * i], hex[2 * i + 1], '\0'};
        out[i] = (uint8_t)strtoul(digits, NULL, 16);
    }
}

/* I10: with K = 1, too */
TEST(median_equals_table)
{
    struct table t = table_open("tests/oracles/median_template.csv");
    struct background_learn *learn = NULL;
    struct background *b;
    int rows = 0;
    while (table_next(&t)) {
        const uint32_t frames = (uint32_t)table_int(&t, 1), cols = (uint32_t)table_int(&t, 3);
        uint8_t want[BINS];
        struct ping p = ping_at(7, cols);
        if (frames > BACKGROUND_LEARNT_MAX)
            continue;
        if (!learn)
            learn = learn_new(&p, frames, true);
        if (strcmp(t.field[5], "result") != 0) {
            from_hex(t.field[6], samples, cols);
            background_learn_take(learn, &p);
            p = ping_at(8, cols); /* another row between: pings in one row on end count once */
            background_learn_take(learn, &p);
            continue;
        }
        b = finish(learn, 1, 255);
        learn = NULL;
        from_hex(t.field[7], want, cols);
        CHECK(memcmp(b->level + 7 * cols, want, cols) == 0);
        CHECK_INT(b->learnt[7], frames);
        free(b);
        rows++;
    }
    CHECK_INT(rows, 32);
}

static int by_value(const void *a, const void *b)
{
    return *(const uint8_t *)a - *(const uint8_t *)b;
}

TEST(median_equals_sort)
{
    uint64_t seed = test_seed();
    for (uint32_t k = 1; k <= BACKGROUND_LEARNT_MAX; k++) {
        static uint8_t seen[BINS][BACKGROUND_LEARNT_MAX];
        struct ping p = ping_at(3, BINS), other = ping_at(4, BINS);
        struct background_learn *learn = learn_new(&p, k, true);
        for (uint32_t n = 0; n < k; n++) {
            p = ping_at(3, BINS);
            for (uint32_t i = 0; i < BINS; i++)
                samples[i] = seen[i][n] = (uint8_t)(test_random(&seed) >> (i % 8 + 56));
            background_learn_take(learn, &p);
            background_learn_take(learn, &other);
        }
        struct background *b = finish(learn, 1, 255);
        for (uint32_t i = 0; i < BINS; i++) {
            qsort(seen[i], k, 1, by_value);
            CHECK_INT(b->level[3 * BINS + i], seen[i][(k - 1) / 2]);
        }
        free(b);
    }
}

/* I10: a target in fewer than half of the pings disappears, in more than half it stays; all 255 stays 255. */
TEST(majority_decides)
{
    for (uint32_t with = 0; with <= 5; with++) {
        struct ping p = ping_at(0, BINS);
        struct background_learn *learn = learn_new(&p, 5, true);
        for (uint32_t n = 0; n < 5; n++) {
            p = ping_at(0, BINS);
            samples[20] = n < with ? 200 : 10;
            samples[30] = 255;
            background_learn_take(learn, &p);
            p = ping_at(1, BINS);
            background_learn_take(learn, &p);
        }
        struct background *b = finish(learn, 1, 64);
        CHECK_INT(b->level[20], with >= 3 ? 200 : 10);
        CHECK_INT(b->level[30], 255);
        free(b);
    }
}

/* ---- when learning goes on, and ends ---- */

TEST(done_when_a_turn_has_come_round)
{
    struct ping p = ping_at(0, BINS);
    struct background_learn *learn = learn_new(&p, 3, true);
    uint32_t taken = 0;
    for (; taken < 10 * TURN && !progress(learn).done; taken++) {
        p = ping_at(taken * 2 % TURN, BINS);
        background_learn_take(learn, &p);
    }
    CHECK_INT(taken, 3 * TURN / 2 + 1);
    CHECK_INT(progress(learn).rows_full, TURN / 2);
    CHECK_INT(progress(learn).least, 3);
    /* the head steps over every other angle, which lies within the beam all the same */
    struct background *b = finish(learn, 3, 64);
    CHECK_INT(b->learnt[0], 3);
    CHECK_INT(b->learnt[1], 1);
    free(b);
}

/* Angles that come once, in error, are not waited for, as long as they are few; what they heard is no template. */
TEST(done_although_few_angles_came_once_only)
{
    for (uint32_t strays = 24; strays <= 26; strays++) {
        struct ping p = ping_at(0, BINS);
        struct background_learn *learn = learn_new(&p, 3, true);
        for (uint32_t i = 0; i < strays; i++) {
            p = ping_at(TURN - 1 - i, BINS);
            background_learn_take(learn, &p);
        }
        for (uint32_t taken = 0; taken < 10 * (TURN - strays); taken++) {
            p = ping_at(taken % (TURN - strays), BINS);
            background_learn_take(learn, &p);
        }
        CHECK_INT(progress(learn).rows_seen, TURN);
        CHECK_INT(progress(learn).done, strays <= TURN / BACKGROUND_STRAY);
        struct background *b = finish(learn, 3, 64);
        CHECK_INT(b->learnt[TURN - 1 - strays], 3);
        CHECK_INT(b->learnt[TURN - strays / 2], 0);
        free(b);
    }
}

struct motion {
    const char *name;
    unsigned has;
    double north_m, yaw_rad;
    bool standing;
    uint64_t taken;
};

static const struct motion motions[] = {
    {"stands still", POSE_POSITION | POSE_ATTITUDE, 0, 0, false, 1},
    {"stands still, asked to take it", POSE_POSITION | POSE_ATTITUDE, 0, 0, true, 10},
    {"moves a little less than 4 bins", POSE_POSITION, 0.0799, 0, false, 5},
    {"moves 4 bins", POSE_POSITION, 0.0801, 0, false, 10},
    {"turns a little", POSE_ATTITUDE, 0, 0.0699, false, 5},
    {"turns 2 beam widths", POSE_ATTITUDE, 0, 0.0702, false, 10},
    {"moves, but nobody says so", POSE_ATTITUDE, 1, 0, false, 1},
    {"depth alone says nothing", POSE_DEPTH, 1, 0, false, 10},
};

TEST(takes_only_after_motion)
{
    for (size_t m = 0; m < sizeof motions / sizeof motions[0]; m++) {
        struct ping p = ping_at(0, BINS);
        struct background_learn *learn = learn_new(&p, 10, motions[m].standing);
        for (int n = 0; n < 10; n++) {
            p = ping_at(0, BINS);
            p.pose.has = motions[m].has;
            p.pose.position_m[0] = n * motions[m].north_m;
            quat_from_rpy(0, 0, n * motions[m].yaw_rad, p.pose.attitude);
            background_learn_take(learn, &p);
            struct ping between = ping_at(200, BINS);
            between.pose = p.pose;
            background_learn_take(learn, &between);
        }
        const uint64_t taken = progress(learn).taken / 2;
        if (taken != motions[m].taken)
            printf("%s: ", motions[m].name);
        CHECK_INT(taken, motions[m].taken);
        CHECK_INT(progress(learn).no_pose, motions[m].has & (POSE_POSITION | POSE_ATTITUDE) ? 0 : 20);
        free(learn);
    }
}

TEST(other_bins_are_not_mixed_in)
{
    struct ping p = ping_at(0, BINS);
    struct background_learn *learn = learn_new(&p, 3, true);
    background_learn_take(learn, &p);
    p = ping_at(10, BINS - 1);
    background_learn_take(learn, &p);
    p = ping_at(10, BINS);
    p.dr_m = 0.03f;
    background_learn_take(learn, &p);
    p = ping_at(10, BINS);
    p.law = AMPLITUDE_LINEAR;
    background_learn_take(learn, &p);
    CHECK_INT(progress(learn).other_bins, 3);
    CHECK_INT(progress(learn).taken, 1);
    free(learn);
}

/* ---- angles between those that were learnt ---- */

/* A template of rows 10 and 10 + apart, one loud in bin 5 and the other in bin 6, both in bin 7; beams of 2.2 rows. */
static struct background *with_a_gap(uint32_t apart)
{
    struct ping p = ping_at(10, BINS);
    struct background_learn *learn = learn_new(&p, 1, true);
    for (int last = 0; last < 2; last++) {
        p = ping_at(last ? 10 + apart : 10, BINS);
        samples[last ? 6 : 5] = 90;
        samples[7] = last ? 120 : 60;
        background_learn_take(learn, &p);
    }
    return finish(learn, 1, 64);
}

TEST(a_gap_is_filled_from_both_sides_as_far_as_a_beam_is_wide)
{
    for (uint32_t apart = 2; apart <= 7; apart++) {
        struct background *b = with_a_gap(apart);
        for (uint32_t row = 0; row < 30; row++) {
            const uint8_t *level = b->level + row * BINS;
            const bool first = row + 2 >= 10 && row <= 12 && row < 10 + apart;
            const bool last = row + 2 >= 10 + apart && row <= 12 + apart && row > 10;
            const bool both = row != 10 + apart && first && last && row != 10;
            CHECK_INT(b->learnt[row], first || last);
            CHECK_INT(level[5], first || both ? 90 : 0);
            CHECK_INT(level[6], last || both ? 90 : 0);
            CHECK_INT(level[7], last ? 120 : first ? 60 : 0);
            if (test_case_failed) {
                printf("(%u apart, row %u)\n", apart, row);
                break;
            }
        }
        free(b);
    }
}

/* A turning head has no first angle; beams of a fan have. */
TEST(gaps_wrap_around_a_turn_and_not_around_a_fan)
{
    struct ping p = ping_at(TURN - 1, BINS);
    struct background_learn *learn = learn_new(&p, 1, true);
    samples[5] = 90;
    background_learn_take(learn, &p);
    struct background *b = finish(learn, 1, 64);
    CHECK_INT(b->learnt[0], 1);
    CHECK_INT(b->learnt[1], 1);
    CHECK_INT(b->learnt[2], 0);
    CHECK_INT(b->level[BINS + 5], 90);
    free(b);

    static struct ping_beam fan[8];
    static uint8_t image[8 * BINS];
    struct background_shape shape;
    for (int i = 0; i < 8; i++)
        fan[i] = (struct ping_beam){.az_rad = 0.02f * (float)i};
    image[7 * BINS + 5] = 90;
    p = ping_at(0, BINS);
    p.n_beams = 8;
    p.head_turn = 0;
    p.beam = fan;
    p.samples = image;
    CHECK(background_shape_of(&p, &shape));
    b = background_init(malloc(background_size(&shape)), &shape, 64);
    b->learnt[7] = 1;
    memcpy(b->level, image, sizeof image);
    learn = learn_new(&p, 2, true);
    background_learn_take(learn, &p); /* one ping of two: too few, but the beams' width is known */
    background_learn_finish(learn, 2, b);
    free(learn);
    CHECK_INT(b->learnt[6], 1);
    CHECK_INT(b->learnt[5], 0);
    CHECK_INT(b->learnt[0], 0);
    free(b);
}

/* ---- what is the vehicle ---- */

static const struct background_rule rule = {.neighbour_m = 0.15,
                                            .min_points = 6,
                                            .min_level = 80,
                                            .extent_m = 0.5,
                                            .reach_m = 2,
                                            .share = 0.25,
                                            .ring_m = 0.2};

static struct background *drawn(uint32_t bins)
{
    const struct ping p = ping_at(0, bins);
    struct background_shape s;
    CHECK(background_shape_of(&p, &s));
    struct background *b = background_init(malloc(background_size(&s)), &s, 64);
    memset(b->learnt, 9, s.rows);
    return b;
}

/* counts at rows and bins, both ends included; rows beyond the turn go on at its beginning */
static void paint(struct background *b, uint32_t row0, uint32_t row1, uint32_t bin0, uint32_t bin1, uint8_t level)
{
    for (uint32_t row = row0; row <= row1; row++)
        for (uint32_t i = bin0; i <= bin1; i++)
            b->level[(size_t)(row % TURN) * b->shape.bins + i] = level;
}

struct thing {
    const char *name;
    uint32_t row0, row1, bin0, bin1;
    uint8_t level;
    bool kept;
};

static const struct thing things[] = {
    {"frame 0.7 m away", 30, 50, 35, 42, 200, true},
    {"frame across the seam", 390, 410, 35, 42, 200, true},
    {"too quiet", 30, 50, 35, 42, 70, false},
    {"a bar that is too long", 30, 50, 35, 65, 200, false},
    {"a bar as long as may be", 30, 50, 40, 64, 200, true},
    {"a bar that is a bin longer", 30, 50, 40, 65, 200, false},
    {"a frame as far as may be", 30, 50, 92, 99, 200, true},
    {"a frame that is a bin farther", 30, 50, 93, 100, 200, false},
    {"as loud as need be", 30, 50, 35, 42, 80, true},
    {"a count too quiet", 30, 50, 35, 42, 79, false},
    {"over as many bearings as may be", 30, 129, 35, 42, 200, true},
    {"over one bearing more", 30, 130, 35, 42, 200, false},
    {"a wall 4 m away", 30, 50, 200, 205, 200, false},
    {"a wall all around at 1 m", 0, 399, 50, 55, 200, false},
    {"a wall over a third of all bearings, across the seam", 340, 460, 50, 55, 200, false},
    {"the ring", 0, 399, 0, 8, 255, true},
    {"a single cell", 30, 30, 40, 40, 255, false},
};

TEST(keeps_the_vehicle_only)
{
    for (size_t k = 0; k < sizeof things / sizeof things[0]; k++) {
        const struct thing *t = &things[k];
        struct background *b = drawn(300);
        struct background_kept kept;
        void *work = malloc(background_keep_size(&b->shape));
        paint(b, t->row0, t->row1, t->bin0, t->bin1, t->level);
        background_keep(b, &rule, work, &kept);
        const uint32_t cells = (t->row1 - t->row0 + 1) * (t->bin1 - t->bin0 + 1);
        if ((kept.blind == cells) != t->kept)
            printf("%s: ", t->name);
        CHECK_INT(kept.blind, t->kept ? cells : 0);
        CHECK_INT(kept.removed, t->kept ? 0 : cells);
        free(work);
        free(b);
    }
}

/* The ring leads to a frame beside it: the frame must not be taken for a part of a full circle. */
TEST(ring_and_frame_are_told_apart)
{
    struct background *b = drawn(300);
    struct background_kept kept;
    void *work = malloc(background_keep_size(&b->shape));
    paint(b, 0, 399, 0, 9, 255);
    paint(b, 100, 120, 10, 20, 200);
    background_keep(b, &rule, work, &kept);
    CHECK_INT(kept.removed, 0);
    CHECK_INT(kept.blind, 400 * 10 + 21 * 11);
    free(work);
    free(b);
}

/* ---- on pings ---- */

static uint8_t view_level[PING_MAX_BINS], view_blind[PING_MAX_BINS];
static const struct background_view view = {view_level, view_blind};

TEST(view_of_the_same_range)
{
    struct background *b = drawn(BINS);
    struct ping p = ping_at(5, BINS);
    bool any;
    paint(b, 5, 5, 10, 12, 65);
    paint(b, 5, 5, 20, 20, 64);
    CHECK(background_view(b, &p, &view, &any) && any);
    for (uint32_t i = 0; i < BINS; i++) {
        CHECK_INT(view_blind[i], i >= 8 && i <= 14); /* a pulse is 2 bins */
        CHECK_INT(view_level[i], i >= 10 && i <= 12 ? 65 : i == 20 ? 64 : 0);
    }
    p = ping_at(6, BINS);
    CHECK(background_view(b, &p, &view, &any) && !any);
    free(b);
}

TEST(mask_is_a_pulse_wider)
{
    uint64_t seed = test_seed();
    for (int trial = 0; trial < 200; trial++) {
        struct background *b = drawn(BINS);
        struct ping p = ping_at(5, BINS);
        bool any;
        p.pulse_m = (float)(0.02 * floor(8 * test_uniform(&seed)));
        const int by = (int)ceil((double)p.pulse_m / (double)p.dr_m);
        const double density = 0.3 * test_uniform(&seed);
        for (uint32_t i = 0; i < BINS; i++)
            b->level[5 * BINS + i] = test_uniform(&seed) < density ? 200 : 0;
        background_view(b, &p, &view, &any);
        for (int i = 0; i < BINS; i++) {
            bool want = false;
            for (int k = i - by; k <= i + by; k++)
                want |= k >= 0 && k < BINS && b->level[5 * BINS + k];
            CHECK_INT(view_blind[i], want);
        }
        free(b);
    }
}

/* A blind cell stays blind whatever the bins: each covers the loudest of what it touches. */
TEST(view_of_another_range_hides_nothing)
{
    uint64_t seed = test_seed();
    for (int trial = 0; trial < 300; trial++) {
        struct background *b = drawn(BINS);
        struct ping p = ping_at(5, 1 + (uint32_t)(test_uniform(&seed) * 200));
        bool any;
        for (uint32_t i = 0; i < BINS; i++)
            b->level[5 * BINS + i] = test_uniform(&seed) < 0.2 ? 200 : 0;
        p.r0_m = (float)(0.5 * test_uniform(&seed));
        p.dr_m = (float)(0.002 + 0.1 * test_uniform(&seed));
        CHECK_INT(background_fit(&b->shape, &p), BACKGROUND_RESAMPLED);
        CHECK(background_view(b, &p, &view, &any));
        for (uint32_t i = 0; i < p.n_bins; i++) {
            const double lo = (double)p.r0_m + i * (double)p.dr_m, hi = lo + (double)p.dr_m;
            bool want = false;
            for (uint32_t k = 0; k < BINS; k++)
                want |= b->level[5 * BINS + k] && (k + 1) * 0.02 > lo + 1e-6 && k * 0.02 < hi - 1e-6;
            CHECK(!want || view_blind[i]);
        }
        free(b);
    }
}

TEST(view_of_a_foreign_ping_says_nothing)
{
    struct background *b = drawn(BINS);
    bool any = true;
    paint(b, 0, 399, 0, BINS - 1, 200);
    struct ping p = ping_at(0, BINS);
    p.head_turn = 6400;
    CHECK(!background_view(b, &p, &view, &any) && !any);
    p = ping_at(0, BINS);
    p.law = AMPLITUDE_LOG;
    p.db_per_count = 0.3f;
    CHECK(!background_view(b, &p, &view, &any));
    p = ping_at(0, BINS);
    p.kind = PING_RANGES;
    CHECK(!background_view(b, &p, &view, &any));
    p = ping_at(0, BINS);
    memset(b->learnt, 0, TURN);
    CHECK(!background_view(b, &p, &view, &any));
    free(b);
}

TEST(rows_of_heads)
{
    struct background_shape s;
    struct ping p = ping_at(399, BINS);
    CHECK(background_shape_of(&p, &s));
    CHECK_INT(background_row(&s, &p, 0), 399);
    CHECK_NEAR(s.az0_rad, 0, 0, 1e-6);
    p.head_units = 400 + 7;
    CHECK_INT(background_row(&s, &p, 0), 7);
    p.head_turn = 6400;
    p.head_units = 6399;
    CHECK(background_shape_of(&p, &s));
    CHECK_INT(s.rows, BACKGROUND_ROWS_FINE);
    CHECK_INT(background_row(&s, &p, 0), 399);
    p.n_beams = 2;
    CHECK(!background_shape_of(&p, &s));
    p = ping_at(0, 0);
    CHECK(!background_shape_of(&p, &s));
}

/* ---- end to end: what the detector makes of it ---- */

static float first_echo(const struct background *b, uint8_t *state, float *free_to)
{
    static struct extract *extract;
    static struct beam_echoes heard;
    struct extract_conf conf;
    struct echoes out = {.max_beams = 1, .beam = &heard};
    struct ping p = ping_at(0, 600);
    bool any = false;
    struct fault fault;
    extract_defaults(&conf);
    conf.no_echo = EXTRACT_HEARD;
    if (!extract)
        extract = extract_init(malloc(extract_size(600)), &conf, 600, &fault);
    uint64_t seed = 4;
    for (uint32_t i = 0; i < 600; i++)
        samples[i] = (uint8_t)(20 + test_uniform(&seed) * 10);
    memset(samples + 45, 220, 8);  /* the frame, 0.9 m */
    memset(samples + 300, 220, 5); /* a pile behind it, 6 m */
    if (b)
        CHECK(background_view(b, &p, &view, &any) && any);
    const struct extract_aid aid = {.blind = view_blind, .lowest = -1};
    extract_run(extract, &p, b ? &aid : NULL, &out);
    *state = heard.state;
    *free_to = heard.free_to_m;
    return heard.n ? heard.echo[0].range_m : -1;
}

TEST(frame_is_no_echo_and_the_pile_behind_is)
{
    struct background *b = drawn(600);
    uint8_t state;
    float free_to;
    paint(b, 0, 0, 45, 52, 200);
    CHECK_NEAR(first_echo(NULL, &state, &free_to), 0.98, 0, 0.1);
    CHECK_NEAR(first_echo(b, &state, &free_to), 6.05, 0, 0.1);
    CHECK_INT(state, BEAM_ECHO);
    free(b);
}

/* ---- the file ---- */

static bool same(const struct background *a, const struct background *b)
{
    size_t na, nb;
    uint8_t *x = template_encode(a, &na), *y = template_encode(b, &nb);
    const bool equal = na == nb && memcmp(x, y, na) == 0;
    free(x);
    free(y);
    return equal;
}

TEST(every_bit_of_the_file_counts)
{
    struct background *b = drawn(5);
    enum template_fault kind;
    struct fault fault;
    size_t size;
    paint(b, 3, 5, 1, 3, 99);
    uint8_t *bytes = template_encode(b, &size);
    struct background *again = template_decode(bytes, size, 64, &kind, &fault);
    CHECK(again && kind == TEMPLATE_GOOD && same(b, again));
    free(again);
    for (size_t bit = 0; bit < size * 8; bit += 7) {
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        again = template_decode(bytes, size, 64, &kind, &fault);
        CHECK(!again && kind == (bit < 12 * 8 ? TEMPLATE_FOREIGN : TEMPLATE_DAMAGED));
        free(again);
        bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    for (size_t n = 0; n < size; n++) {
        again = template_decode(bytes, n, 64, &kind, &fault);
        CHECK(!again);
        free(again);
    }
    free(bytes);
    free(b);
}

static void put(const char *path, const char *text)
{
    FILE *f = fopen(path, "w");
    fputs(text, f);
    fclose(f);
}

static bool save(const struct background *b, const char *path, struct fault *fault)
{
    size_t size;
    uint8_t *bytes = template_encode(b, &size);
    const bool good = template_write(bytes, size, path, fault);
    free(bytes);
    return good;
}

TEST(files_are_replaced_whole_or_set_aside)
{
    char folder[] = "/tmp/sonard-template-XXXXXX", path[64], aside[80];
    struct fault fault;
    enum template_fault kind;
    CHECK(mkdtemp(folder) != NULL);
    snprintf(path, sizeof path, "%s/front.bg", folder);
    snprintf(aside, sizeof aside, "%s.damaged", path);
    struct background *b = drawn(5);
    CHECK(!template_load(path, 64, &kind, &fault) && kind == TEMPLATE_MISSING);
    CHECK(save(b, path, &fault));
    CHECK(save(b, path, &fault));
    struct background *again = template_load(path, 64, &kind, &fault);
    CHECK(again && same(b, again));
    free(again);
    CHECK_INT(truncate(path, 100), 0);
    CHECK(!template_load(path, 64, &kind, &fault) && kind == TEMPLATE_DAMAGED);
    CHECK(access(path, F_OK) != 0 && access(aside, F_OK) == 0 && strstr(fault.text, aside));
    put(path, "[sonar head]\n");
    CHECK(!template_load(path, 64, &kind, &fault) && kind == TEMPLATE_FOREIGN);
    CHECK(access(path, F_OK) == 0);
    CHECK(!save(b, path, &fault));
    unlink(path);
    unlink(aside);
    CHECK_INT(rmdir(folder), 0); /* nothing is left beside */
    CHECK(!save(b, path, &fault));
    CHECK(!template_load("/dev/zero", 64, &kind, &fault) && kind == TEMPLATE_UNREAD);
    free(b);
}

int main(void)
{
    RUN(median_equals_table);
    RUN(median_equals_sort);
    RUN(majority_decides);
    RUN(done_when_a_turn_has_come_round);
    RUN(done_although_few_angles_came_once_only);
    RUN(takes_only_after_motion);
    RUN(other_bins_are_not_mixed_in);
    RUN(a_gap_is_filled_from_both_sides_as_far_as_a_beam_is_wide);
    RUN(gaps_wrap_around_a_turn_and_not_around_a_fan);
    RUN(keeps_the_vehicle_only);
    RUN(ring_and_frame_are_told_apart);
    RUN(view_of_the_same_range);
    RUN(mask_is_a_pulse_wider);
    RUN(view_of_another_range_hides_nothing);
    RUN(view_of_a_foreign_ping_says_nothing);
    RUN(rows_of_heads);
    RUN(frame_is_no_echo_and_the_pile_behind_is);
    RUN(every_bit_of_the_file_counts);
    RUN(files_are_replaced_whole_or_set_aside);
    return test_end();
}
