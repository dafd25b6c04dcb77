/* SPDX-License-Identifier: MIT */
/*
 * test_amplitude - counts to power under every law, 8 and 16 bit.
 */
#include "tests/lib/test.h"

#include "grid/range/amplitude.h"

TEST(decibels_equal_table)
{
    FILE *file = fopen("tests/oracles/log_lut.csv", "r");
    char line[256];
    int rows = 0;
    CHECK(file && fgets(line, sizeof line, file));
    while (file && fgets(line, sizeof line, file)) {
        double span, low, v;
        long long want = -1;
        CHECK(sscanf(line, "%lf,%lf,%lf,%*[^,],%*[^,],%lld", &span, &low, &v, &want) == 4);
        CHECK_INT(amplitude_from_db(low + v * span / 255.0), want);
        rows++;
    }
    if (file)
        fclose(file);
    CHECK_INT(rows, 768);
}

TEST(bytes_under_each_law)
{
    static const struct {
        enum amplitude_law law;
        uint32_t count;
        uint64_t want;
    } row[] = {
        {AMPLITUDE_LINEAR, 0, 0},          {AMPLITUDE_LINEAR, 255, 65025},    {AMPLITUDE_POWER, 200, 200},
        {AMPLITUDE_SQRT, 3, 81},           {AMPLITUDE_SQRT, 255, 4228250625}, {AMPLITUDE_LOG, 0, 256},
        {AMPLITUDE_LOG, 255, 25600000000}, {AMPLITUDE_LINEAR, 300, 65025},
    };

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct amplitude a;
        CHECK(amplitude_init(&a, row[i].law, 1, 80.0 / 255.0));
        CHECK_INT(amplitude_of(&a, row[i].count), row[i].want);
    }
}

TEST(words_under_each_law)
{
    for (int law = AMPLITUDE_LINEAR; law <= AMPLITUDE_LOG; law++) {
        struct amplitude a;
        uint64_t last = 0;
        CHECK(amplitude_init(&a, (enum amplitude_law)law, 2, 100.0 / 65535.0));
        for (uint32_t v = 0; v <= 65535; v++) {
            const uint64_t power = amplitude_of(&a, v);
            double want = 0.0, slack = 0.0;
            switch (law) {
            case AMPLITUDE_LINEAR:
                want = (double)v * v;
                break;
            case AMPLITUDE_POWER:
                want = v;
                break;
            case AMPLITUDE_SQRT:
                want = (double)v * v * v * v / 65536.0;
                slack = 0.5;
                break;
            default:
                want = 256.0 * pow(10.0, v * 100.0 / 655350.0);
                slack = 0.5;
            }
            if (!(fabs((double)power - want) <= slack + 1e-12 * want) || power < last ||
                power >= AMPLITUDE_LIMIT) {
                CHECK_NEAR((double)power, want, 1e-12, slack);
                CHECK(power >= last && power < AMPLITUDE_LIMIT);
                break;
            }
            last = power;
        }
    }
}

/* Every power of every scale that devices are known for, on any CPU and with any library. */
TEST(decibels_are_the_same_bits_everywhere)
{
    static const struct {
        unsigned bytes;
        double db_per_count;
    } row[] = {{1, 80.0 / 255.0}, {1, 0.4}, {1, 0.1}, {2, 100.0 / 65535.0}, {2, 0.001}};
    uint64_t hash = 14695981039346656037u;

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct amplitude a;
        CHECK(amplitude_init(&a, AMPLITUDE_LOG, row[i].bytes, row[i].db_per_count));
        for (uint32_t v = 0; v <= a.max_count; v++)
            hash = (hash ^ amplitude_of(&a, v)) * 1099511628211u;
    }
    CHECK(hash == 13939192738038728796u);
}

TEST(a_row_equals_its_samples)
{
    static const uint8_t bytes[] = {0, 1, 7, 128, 255};
    static const uint16_t words[] = {0, 1, 300, 40000, 65535};
    struct amplitude a;
    uint64_t sum[6];
    CHECK(amplitude_init(&a, AMPLITUDE_SQRT, 1, 0));
    amplitude_sums(&a, bytes, 5, sum);
    for (int i = 0; i < 5; i++)
        CHECK_INT(sum[i + 1] - sum[i], amplitude_of(&a, bytes[i]));
    CHECK(amplitude_init(&a, AMPLITUDE_LOG, 2, 0.001));
    amplitude_sums(&a, words, 5, sum);
    for (int i = 0; i < 5; i++)
        CHECK_INT(sum[i + 1] - sum[i], amplitude_of(&a, words[i]));
}

TEST(wrong_arguments_are_refused)
{
    struct amplitude a = {.sample_bytes = 77};
    CHECK(!amplitude_init(&a, AMPLITUDE_LINEAR, 0, 0));
    CHECK(!amplitude_init(&a, AMPLITUDE_LINEAR, 3, 0));
    CHECK(!amplitude_init(&a, (enum amplitude_law)4, 1, 0));
    CHECK(!amplitude_init(&a, AMPLITUDE_LOG, 1, 0));
    CHECK(!amplitude_init(&a, AMPLITUDE_LOG, 1, -0.3));
    CHECK(!amplitude_init(&a, AMPLITUDE_LOG, 1, NAN));
    CHECK(!amplitude_init(&a, AMPLITUDE_LOG, 1, 0.5));
    CHECK(!amplitude_init(&a, AMPLITUDE_LOG, 2, 0.3));
    CHECK_INT(a.sample_bytes, 77);
}

int main(void)
{
    RUN(decibels_equal_table);
    RUN(bytes_under_each_law);
    RUN(words_under_each_law);
    RUN(decibels_are_the_same_bits_everywhere);
    RUN(a_row_equals_its_samples);
    RUN(wrong_arguments_are_refused);
    return test_end();
}
