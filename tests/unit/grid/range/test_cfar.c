/* SPDX-License-Identifier: MIT */
/*
 * test_cfar - factors against tables worked out with 50 digits, masks against exact integer masks and against a
 * brute-force detector written out here, and the inputs that break detectors (C1 to C12: the catalogue of such).
 */
#include "tests/lib/detectors.h"
#include "tests/lib/test.h"

#include "grid/range/amplitude.h"
#include "grid/range/cfar.h"
#include "grid/range/u128.h"

#define MAX_CELLS 2048

static uint64_t work[3 * (MAX_CELLS + 1)];

static struct cfar_profile profile_of(const uint64_t *x, uint32_t n)
{
    return (struct cfar_profile){.x = x, .n = n, .work = work};
}

/* ---- tables ---- */

TEST(factor_equals_table)
{
    struct table t = table_open("tests/oracles/cfar_alpha.csv");
    double worst = 0.0;
    int rows = 0;
    while (table_next(&t)) {
        double alpha = NAN;
        CHECK(cfar_alpha(table_detector(&t, 0), table_count(&t, 1), table_count(&t, 2), table_count(&t, 3),
                         table_real(&t, 4), &alpha));
        CHECK_NEAR(alpha, table_real(&t, 5), 1e-11, 0);
        worst = fmax(worst, fabs(alpha / table_real(&t, 5) - 1.0));
        rows++;
    }
    CHECK(rows > 1000);
    printf("# %d factors, worst relative error %.1e\n", rows, worst);
}

TEST(probability_equals_table)
{
    struct table t = table_open("tests/oracles/cfar_pfa.csv");
    int rows = 0;
    while (table_next(&t)) {
        double ln_pfa = NAN;
        CHECK(cfar_ln_pfa(table_detector(&t, 0), table_count(&t, 1), table_count(&t, 2), table_count(&t, 3),
                          table_real(&t, 4), &ln_pfa));
        CHECK_NEAR(ln_pfa, table_real(&t, 5), 1e-11, 2e-12);
        rows++;
    }
    CHECK(rows > 300);
}

/* ---- masks ---- */

static int hex_digit(char c)
{
    return c <= '9' ? c - '0' : c - 'a' + 10;
}

TEST(masks_equal_table_bit_for_bit)
{
    struct table t = table_open("tests/oracles/soca_beams.csv");
    int rows = 0, wrong = 0;
    while (table_next(&t)) {
        const uint32_t n = table_count(&t, 3);
        const uint64_t alpha = (uint64_t)table_int(&t, 7);
        const struct cfar cfar = {
            .detector = table_detector(&t, 2),
            .edge = !strcmp(t.field[8], "shrink") ? CFAR_SHRINK
                    : !strcmp(t.field[8], "full") ? CFAR_FULL
                                                  : CFAR_BOTH,
            .n_side = table_count(&t, 4),
            .guard = table_count(&t, 5),
            .rank = table_count(&t, 6),
            .alpha_q16 = alpha,
            .alpha_one_q16 = alpha,
            .x_min = table_count(&t, 9),
        };
        uint64_t x[MAX_CELLS];
        uint8_t mask[MAX_CELLS];
        for (uint32_t i = 0; i < n; i++)
            x[i] = (uint64_t)(hex_digit(t.field[10][2 * i]) * 16 + hex_digit(t.field[10][2 * i + 1]));
        cfar_run(&cfar, &(struct cfar_profile){.x = x, .n = n, .work = work}, mask);
        CHECK(strlen(t.field[11]) == n);
        for (uint32_t i = 0; i < n; i++)
            wrong += mask[i] != t.field[11][i] - '0';
        rows++;
    }
    CHECK_INT(wrong, 0);
    CHECK(rows > 500);
}

static int by_size(const void *a, const void *b)
{
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* What a cell is compared with as it is written down, with nothing shared between cells. */
static struct cfar_reference brute_reference(const struct cfar *c, const uint64_t *x, const uint8_t *excluded,
                                             int64_t n, int64_t i)
{
    uint64_t cell[2][MAX_CELLS];
    int64_t count[2] = {0, 0};
    const int64_t reach = (int64_t)c->guard + c->n_side;
    const bool cut[2] = {i < reach, i + reach >= n};
    for (int64_t d = (int64_t)c->guard + 1; d <= reach; d++) {
        if (i - d >= 0 && !(excluded && excluded[i - d]))
            cell[0][count[0]++] = x[i - d];
        if (i + d < n && !(excluded && excluded[i + d]))
            cell[1][count[1]++] = x[i + d];
    }
    for (int side = 0; side < 2; side++)
        if ((c->edge == CFAR_FULL && cut[side]) || (c->edge == CFAR_BOTH && (cut[0] || cut[1])))
            count[side] = 0;
    int64_t cells = count[0] + count[1];
    const bool one = !count[0] || !count[1];
    if (cells == 0)
        return (struct cfar_reference){.one_sided = c->detector != CFAR_OS};

    uint64_t sum[2] = {0, 0}, s;
    for (int side = 0; side < 2; side++)
        for (int64_t k = 0; k < count[side]; k++)
            sum[side] += cell[side][k];
    const struct u128 lead = u128_product(sum[0], (uint64_t)count[1]),
                      lag = u128_product(sum[1], (uint64_t)count[0]);
    if (c->detector == CFAR_OS) {
        memmove(cell[0] + count[0], cell[1], (size_t)count[1] * sizeof cell[0][0]);
        qsort(cell[0], (size_t)cells, sizeof cell[0][0], by_size);
        int64_t k = (c->rank * cells + 2 * c->n_side - 1) / (2 * c->n_side);
        k = k < 1 ? 1 : k > cells ? cells : k;
        s = cell[0][k - 1];
        cells = 1;
    } else if (c->detector == CFAR_CA || one) {
        s = sum[0] + sum[1];
    } else {
        const int side = c->detector == CFAR_SOCA ? u128_less(lag, lead) : u128_less(lead, lag);
        s = sum[side];
        cells = count[side];
    }
    if (s < c->reference_min * (uint64_t)cells)
        s = c->reference_min * (uint64_t)cells;
    return (struct cfar_reference){s, (uint32_t)cells, one};
}

/* The mask rule as it is written down. */
static bool brute_force(const struct cfar *c, const uint64_t *x, const uint8_t *excluded, int64_t n, int64_t i)
{
    const struct cfar_reference ref = brute_reference(c, x, excluded, n, i);
    return ref.cells > 0 && x[i] >= c->x_min && !(excluded && excluded[i]) &&
           u128_less(u128_product(ref.one_sided ? c->alpha_one_q16 : c->alpha_q16, ref.sum),
                     u128_product(x[i], (uint64_t)ref.cells * 65536));
}

/* A beam of one of several characters: what breaks one detector leaves another alone. */
static void random_beam(uint64_t *seed, uint64_t *x, uint32_t n)
{
    const uint64_t kind = test_random(seed) % 5;
    for (uint32_t i = 0; i < n; i++) {
        const double u = test_uniform(seed);
        switch (kind) {
        case 0: /* noise */
            x[i] = (uint64_t)(-1000.0 * log(1.0 - u));
            break;
        case 1: /* many zeros */
            x[i] = u < 0.9 ? 0 : test_random(seed) % 256;
            break;
        case 2: /* few levels: ties */
            x[i] = test_random(seed) % 3;
            break;
        case 3: /* decibels: eight decades */
            x[i] = amplitude_from_db(80.0 * u);
            break;
        default: /* as large as is allowed */
            x[i] = CFAR_MAX_SUM / n - test_random(seed) % 4;
        }
    }
}

/* Stretches of 0 and of 1, some of them as long as a window. */
static void random_stretches(uint64_t *seed, uint8_t *out, uint32_t n)
{
    const uint64_t longest = 1 + test_random(seed) % 100;
    uint8_t value = test_random(seed) % 2;
    for (uint32_t i = 0; i < n; value = !value)
        for (uint64_t left = 1 + test_random(seed) % longest; left > 0 && i < n; left--)
            out[i++] = value;
}

/* C9 */
TEST(a_million_random_cells_equal_brute_force)
{
    uint64_t seed = test_seed();
    static uint64_t x[MAX_CELLS];
    static uint8_t mask[MAX_CELLS], excluded[MAX_CELLS];
    long cells = 0, wrong = 0, hits = 0, wrong_references = 0;
    while (cells < 1000000) {
        const uint32_t n = (uint32_t)(test_random(&seed) % 400);
        const uint32_t side = 1 + (uint32_t)(test_random(&seed) % (test_random(&seed) % 8 ? 12 : 500));
        const struct cfar cfar = {
            .detector = (enum cfar_detector)(test_random(&seed) % 4),
            .edge = (enum cfar_edge)(test_random(&seed) % 3),
            .n_side = side,
            .guard = (uint32_t)(test_random(&seed) % 6),
            .rank = 1 + (uint32_t)(test_random(&seed) % (2 * side)),
            .alpha_q16 = (uint64_t)(65536 * (0.5 + 8 * test_uniform(&seed))),
            .alpha_one_q16 = (uint64_t)(65536 * (0.5 + 8 * test_uniform(&seed))),
            .x_min = test_random(&seed) % 4,
            .reference_min = test_random(&seed) % 3,
        };
        random_beam(&seed, x, n);
        struct cfar_profile profile = profile_of(x, n);
        if (test_random(&seed) % 2) {
            random_stretches(&seed, excluded, n);
            profile.excluded = excluded;
        }
        cfar_run(&cfar, &profile, mask);
        for (uint32_t i = 0; i < n; i++) {
            wrong += mask[i] != brute_force(&cfar, x, profile.excluded, n, i);
            hits += mask[i];
        }
        for (uint32_t k = 0; n > 0 && k < 10; k++) { /* asked for in any order */
            const uint32_t i = (uint32_t)(test_random(&seed) % n);
            const struct cfar_reference ref = cfar_reference_at(&cfar, &profile, i);
            const struct cfar_reference want = brute_reference(&cfar, x, profile.excluded, n, i);
            wrong_references += ref.sum != want.sum || ref.cells != want.cells || ref.one_sided != want.one_sided;
        }
        cells += n;
    }
    CHECK_INT(wrong, 0);
    CHECK_INT(wrong_references, 0);
    CHECK(hits > cells / 100 && hits < cells / 2);
}

/* ---- inputs that break detectors ---- */

static struct cfar plain(enum cfar_detector detector, double alpha)
{
    const uint64_t q16 = (uint64_t)(alpha * 65536);
    return (struct cfar){
        .detector = detector, .n_side = 8, .guard = 2, .rank = 12, .alpha_q16 = q16, .alpha_one_q16 = q16};
}

static uint32_t hits_in(const struct cfar *cfar, const uint64_t *x, uint32_t n)
{
    uint8_t mask[MAX_CELLS];
    uint32_t hits = 0;
    cfar_run(cfar, &(struct cfar_profile){.x = x, .n = n, .work = work}, mask);
    for (uint32_t i = 0; i < n; i++)
        hits += mask[i];
    return hits;
}

/* C1, C2, C10 */
TEST(flat_beams_hold_no_detection)
{
    for (int detector = CFAR_CA; detector <= CFAR_OS; detector++)
        for (uint64_t level = 0; level <= 255; level++) {
            uint64_t x[100];
            for (int i = 0; i < 100; i++)
                x[i] = level * level;
            const struct cfar above = plain((enum cfar_detector)detector, 1.0);
            const struct cfar below = plain((enum cfar_detector)detector, 0.99);
            CHECK_INT(hits_in(&above, x, 100), 0);
            CHECK_INT(hits_in(&below, x, 100), level ? 100 : 0);
        }
}

/* C3 */
TEST(one_count_over_a_floor_of_zeros)
{
    uint64_t x[100] = {0};
    x[50] = 1;
    struct cfar cfar = plain(CFAR_SOCA, 3.0);
    CHECK_INT(hits_in(&cfar, x, 100), 1);
    cfar.x_min = 2;
    CHECK_INT(hits_in(&cfar, x, 100), 0);
    cfar.x_min = 0;
    cfar.reference_min = 1;
    CHECK_INT(hits_in(&cfar, x, 100), 0);
}

/* C4, C5 */
TEST(beams_shorter_than_the_window)
{
    static const uint32_t length[] = {0, 1, 2, 5, 6, 21};
    static const uint32_t want_cells[] = {0, 0, 0, 2, 3, 8};
    const struct cfar cfar = plain(CFAR_CA, 3.0);
    uint64_t x[21];
    uint8_t mask[22];
    for (int i = 0; i < 21; i++)
        x[i] = 7;
    for (int k = 0; k < 6; k++) {
        const struct cfar_profile profile = profile_of(x, length[k]);
        memset(mask, 0xff, sizeof mask);
        cfar_run(&cfar, &profile, mask);
        if (length[k] > 0)
            CHECK_INT(cfar_reference_at(&cfar, &profile, 0).cells, want_cells[k]);
        CHECK_INT(mask[length[k]], 0xff); /* nothing written behind the end */
    }
}

/* C6 */
TEST(tiny_probabilities_are_solved)
{
    double alpha, ln_pfa;
    CHECK(cfar_alpha(CFAR_SOCA, 1, 1, 0, 1e-12, &alpha));
    CHECK_NEAR(alpha, 2e12 - 2, 1e-11, 0);
    CHECK(cfar_alpha(CFAR_SOCA, 512, 512, 0, 1e-12, &alpha));
    CHECK_NEAR(alpha, 28.9, 1e-2, 0);
    static const enum cfar_detector all[] = {CFAR_CA, CFAR_GOCA, CFAR_SOCA, CFAR_OS};
    for (int d = 0; d < 4; d++)
        for (uint32_t n = 8; n <= 2048; n *= 4) {
            CHECK(cfar_alpha(all[d], n, n, n + n / 2, 1e-300, &alpha));
            CHECK(isfinite(alpha) && alpha > 0.0);
            CHECK(cfar_ln_pfa(all[d], n, n, n + n / 2, alpha, &ln_pfa));
            CHECK_NEAR(ln_pfa, log(1e-300), 1e-12, 0);
        }
}

/* C7 */
TEST(wrong_arguments_are_refused)
{
    double out = 5.0;
    CHECK(!cfar_alpha(CFAR_SOCA, 8, 8, 0, 0.0, &out));
    CHECK(!cfar_alpha(CFAR_SOCA, 8, 8, 0, 1.0, &out));
    CHECK(!cfar_alpha(CFAR_SOCA, 8, 8, 0, -1.0, &out));
    CHECK(!cfar_alpha(CFAR_SOCA, 8, 8, 0, NAN, &out));
    CHECK(!cfar_alpha(CFAR_SOCA, 0, 0, 0, 0.1, &out));
    CHECK(!cfar_alpha(CFAR_OS, 8, 8, 0, 0.1, &out));
    CHECK(!cfar_alpha(CFAR_OS, 8, 8, 17, 0.1, &out));
    CHECK(!cfar_alpha(CFAR_CA, CFAR_MAX_CELLS + 1, 8, 0, 0.1, &out));
    CHECK(!cfar_ln_pfa(CFAR_CA, 8, 8, 0, -1.0, &out));
    CHECK(!cfar_ln_pfa(CFAR_CA, 8, 8, 0, NAN, &out));
    CHECK(!cfar_ln_pfa(CFAR_CA, 8, 8, 0, INFINITY, &out));
    CHECK(!cfar_ln_pfa((enum cfar_detector)9, 8, 8, 0, 1.0, &out));
    CHECK_NEAR(out, 5.0, 0, 0);
}

TEST(greater_and_smaller_share_their_sum)
{
    double go, so;
    for (uint32_t n1 = 1; n1 <= 40; n1 += 3)
        for (uint32_t n2 = 1; n2 <= 40; n2 += 5) {
            const double alpha = 3.0;
            CHECK(cfar_ln_pfa(CFAR_GOCA, n1, n2, 0, alpha, &go));
            CHECK(cfar_ln_pfa(CFAR_SOCA, n1, n2, 0, alpha, &so));
            CHECK_NEAR(exp(go) + exp(so), pow(1 + alpha / n1, -(double)n1) + pow(1 + alpha / n2, -(double)n2),
                       1e-13, 0);
        }
}

/* C8 */
TEST(a_loud_cell_leaves_nothing_behind)
{
    uint64_t x[200];
    for (int i = 0; i < 200; i++)
        x[i] = i == 20 ? amplitude_from_db(80.0) : (uint64_t)(i % 2) + 1;
    const struct cfar cfar = plain(CFAR_CA, 3.0);
    uint8_t mask[200];
    const struct cfar_profile profile = profile_of(x, 200);
    cfar_run(&cfar, &profile, mask);
    for (uint32_t i = 40; i < 190; i++)
        CHECK_INT(cfar_reference_at(&cfar, &profile, i).sum, 24);
}

/* C12 */
TEST(the_integer_limit_is_wide_enough)
{
    /* alpha 2^24, sums 2^45 and beyond: the products need 128 bits */
    uint64_t x[40];
    for (int i = 0; i < 40; i++)
        x[i] = (uint64_t)1 << 18;
    struct cfar cfar = plain(CFAR_CA, 16777216.0);
    x[20] = (uint64_t)1 << 42;
    CHECK_INT(hits_in(&cfar, x, 40), 0); /* exactly at the threshold */
    x[20] += 1;
    CHECK_INT(hits_in(&cfar, x, 40), 1);

    /* alpha_q16 2^40, sum 2^45: their product would be 2^85, and is not 2^21 */
    for (int i = 0; i < 40; i++)
        x[i] = (uint64_t)1 << 41;
    x[20] = (uint64_t)1 << 50;
    CHECK_INT(hits_in(&cfar, x, 40), 0);
}

/* Exponential clutter in, design rate of false alarms out; the same clutter as decibels gives none at all. */
TEST(false_alarm_rate_is_the_design_rate)
{
    uint64_t seed = test_seed();
    static uint64_t x[MAX_CELLS], db[MAX_CELLS];
    static const char *const name[] = {"ca", "goca", "soca", "os"};
    for (int d = CFAR_CA; d <= CFAR_OS; d++) {
        struct cfar cfar = {
            .detector = (enum cfar_detector)d, .n_side = 16, .guard = 2, .rank = 24, .edge = CFAR_FULL};
        double both = 0, one = 0;
        CHECK(cfar_alpha(cfar.detector, 16, 16, 24, 1e-2, &both) &&
              cfar_alpha(cfar.detector, 16, 0, 12, 1e-2, &one));
        cfar.alpha_q16 = (uint64_t)(both * 65536);
        cfar.alpha_one_q16 = (uint64_t)(one * 65536);
        long hits = 0, db_hits = 0, cells = 0;
        for (int beam = 0; beam < 200; beam++) {
            for (int i = 0; i < MAX_CELLS; i++) {
                const double power = -1e6 * log(1.0 - test_uniform(&seed));
                x[i] = (uint64_t)power;
                db[i] = (uint64_t)fmax(0.0, 10.0 * log10(power + 1.0) * 255.0 / 80.0);
            }
            hits += hits_in(&cfar, x, MAX_CELLS);
            db_hits += hits_in(&cfar, db, MAX_CELLS);
            cells += MAX_CELLS;
        }
        printf("# %s: %.5f false alarms per cell for a design of 0.01\n", name[d], (double)hits / (double)cells);
        CHECK_NEAR((double)hits / (double)cells, 1e-2, 0.05, 0);
        CHECK_INT(db_hits, 0);
    }
}

int main(void)
{
    RUN(factor_equals_table);
    RUN(probability_equals_table);
    RUN(masks_equal_table_bit_for_bit);
    RUN(a_million_random_cells_equal_brute_force);
    RUN(flat_beams_hold_no_detection);
    RUN(one_count_over_a_floor_of_zeros);
    RUN(beams_shorter_than_the_window);
    RUN(tiny_probabilities_are_solved);
    RUN(wrong_arguments_are_refused);
    RUN(greater_and_smaller_share_their_sum);
    RUN(a_loud_cell_leaves_nothing_behind);
    RUN(the_integer_limit_is_wide_enough);
    RUN(false_alarm_rate_is_the_design_rate);
    return test_end();
}
