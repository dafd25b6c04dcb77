/* SPDX-License-Identifier: MIT */
/* test_median - the k x k median against the reference table and against sorting, with missing and shifted rows. */
#include "tests/lib/table.h"
#include "tests/lib/test.h"

#include "grid/range/median.h"

#define MAX_ROWS 64
#define MAX_BINS 300

struct image {
    uint32_t rows, bins;
    uint8_t in[MAX_ROWS][MAX_BINS], out[MAX_ROWS][MAX_BINS];
};

static _Alignas(16) uint8_t work[8192];

static uint32_t read_hex(const char *text, uint8_t *to)
{
    uint32_t n = 0;
    for (; text[2 * n] && text[2 * n + 1]; n++) {
        const char digits[3] = {text[2 * n], text[2 * n + 1], '\0'};
        to[n] = (uint8_t)strtoul(digits, NULL, 16);
    }
    return n;
}

static void check_image(const struct image *image, unsigned k, bool wrap, const char *name)
{
    uint8_t got[MAX_BINS];
    for (uint32_t y = 0; y < image->rows; y++) {
        struct median_row row[MEDIAN_MAX_SIZE];
        for (unsigned r = 0; r < k; r++) {
            const int64_t at = (int64_t)y + r - k / 2, rows = image->rows;
            const int64_t index = wrap ? (at % rows + rows) % rows : at < 0 ? 0 : at >= rows ? rows - 1 : at;
            row[r] = (struct median_row){.bin = image->in[index]};
        }
        median_filter(k, row, image->bins, work, got);
        if (memcmp(got, image->out[y], image->bins) != 0) {
            printf("%s, %u x %u, wrap %d, row %u\n", name, k, k, wrap, y);
            test_case_failed = true;
        }
    }
}

TEST(images_equal_the_table)
{
    struct table t = table_open("tests/oracles/median_filter.csv");
    static struct image image;
    char name[32] = "";
    long number = -1, k = 0, wrap = 0;
    int images = 0;
    for (bool more = true; more;) {
        more = table_next(&t);
        if (image.rows && (!more || table_int(&t, 0) != number || table_int(&t, 4) == 0)) {
            check_image(&image, (unsigned)k, wrap, name);
            image.rows = 0;
            images++;
        }
        if (!more)
            break;
        number = table_int(&t, 0);
        snprintf(name, sizeof name, "%s", t.field[1]);
        k = table_int(&t, 2);
        wrap = table_int(&t, 3);
        image.bins = read_hex(t.field[5], image.in[image.rows]);
        CHECK_INT(read_hex(t.field[6], image.out[image.rows]), image.bins);
        image.rows++;
    }
    CHECK(images >= 40);
}

/* ---- against sorting ---- */

static int by_value(const void *a, const void *b)
{
    return *(const uint8_t *)a - *(const uint8_t *)b;
}

static uint8_t sorted_median(unsigned k, const struct median_row *row, uint32_t n, uint32_t at)
{
    uint8_t v[25];
    size_t c = 0;
    for (unsigned r = 0; r < k; r++)
        for (int64_t x = (int64_t)at - k / 2; row[r].bin && x <= (int64_t)at + k / 2; x++) {
            /* edges of the middle row first, then where that bin of it lies in the other row */
            const int64_t from = x - row[r].shift;
            v[c++] = row[r].bin[from < 0 ? 0 : from >= (int64_t)n ? n - 1 : from];
        }
    qsort(v, c, 1, by_value);
    return v[(c - 1) / 2];
}

/* I7 among them: rows of one and two bins, which the window is larger than */
TEST(random_rows_missing_and_shifted_equal_sorting)
{
    uint64_t random = test_seed();
    static uint8_t bin[5][MAX_BINS];
    uint8_t got[MAX_BINS];
    for (int round = 0; round < 4000; round++) {
        const unsigned k = round & 1 ? 5 : 3;
        const uint32_t n = 1 + (uint32_t)(test_random(&random) % (round % 3 ? 20 : MAX_BINS));
        const unsigned levels = 1 + (unsigned)(test_random(&random) % 256);
        struct median_row row[5] = {{0}};
        for (unsigned r = 0; r < k; r++) {
            for (uint32_t i = 0; i < n; i++)
                bin[r][i] = (uint8_t)(test_random(&random) % levels + 256 - levels);
            const bool there = r == k / 2 || test_random(&random) % 3;
            const int32_t shift = test_random(&random) % 2 ? (int32_t)(test_random(&random) % 2000) - 1000 : 0;
            row[r] = (struct median_row){there ? bin[r] : NULL, r == k / 2 ? 0 : shift % (int32_t)(2 * n)};
        }
        memset(got, 0xaa, sizeof got);
        median_filter(k, row, n, work, got);
        for (uint32_t i = 0; i < n; i++)
            if (got[i] != sorted_median(k, row, n, i)) {
                printf("round %d: k %u, n %u, bin %u: %u, expected %u\n", round, k, n, i, got[i],
                       sorted_median(k, row, n, i));
                test_case_failed = true;
                return;
            }
        CHECK(n == MAX_BINS || got[n] == 0xaa);
    }
    CHECK(median_work_size(MAX_BINS) <= sizeof work);
}

/* I7 */
TEST(a_single_spike_disappears_and_a_wall_stays)
{
    uint8_t row[5][40] = {{0}}, out[40];
    struct median_row rows[5];
    for (unsigned k = 3; k <= 5; k += 2) {
        memset(row, 10, sizeof row);
        row[k / 2][20] = 250;
        for (unsigned r = 0; r < k; r++) {
            memset(row[r] + 30, 200, 10);
            rows[r] = (struct median_row){.bin = row[r]};
        }
        median_filter(k, rows, 40, work, out);
        for (int i = 0; i < 40; i++)
            CHECK_INT(out[i], i < 30 ? 10 : 200);
    }
}

/* I7: nothing but the row itself */
TEST(an_image_of_one_beam_is_filtered_along_the_beam)
{
    const uint8_t bin[6] = {9, 1, 8, 2, 7, 3}, want[6] = {9, 8, 2, 7, 3, 3};
    struct median_row rows[3] = {{0}, {.bin = bin}, {0}};
    uint8_t out[6];
    median_filter(3, rows, 6, work, out);
    CHECK(memcmp(out, want, 6) == 0);
}

int main(void)
{
    RUN(images_equal_the_table);
    RUN(random_rows_missing_and_shifted_equal_sorting);
    RUN(a_single_spike_disappears_and_a_wall_stays);
    RUN(an_image_of_one_beam_is_filtered_along_the_beam);
    return test_end();
}
