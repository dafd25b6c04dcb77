/* SPDX-License-Identifier: MIT */
/* test_json_out - JSON as it goes out against jansson's, byte for byte:
 * the cases at the edges, and values by chance. */
#include "daemon/rpc/json_out.h"

#include "tests/lib/test.h"

#define FLAGS (JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(15))

/* Takes value over. */
static void check_same(json_t *value)
{
    struct json_out t = {0};
    char *want = json_dumps(value, FLAGS);
    json_out_value(&t, value);
    json_out_bytes(&t, "", 1);
    CHECK(want && !t.failed);
    if (want && !t.failed)
        CHECK_STR(t.bytes, want);
    free(want);
    free(t.bytes);
    json_decref(value);
}

TEST(edges_read_as_by_jansson)
{
    static const double reals[] = {0.0,
                                   -0.0,
                                   1,
                                   -1,
                                   0.1,
                                   -0.1,
                                   1e-4,
                                   9.9e-5,
                                   0.000001,
                                   1e-300,
                                   123456.78,
                                   0.1 + 0.2,
                                   1.0 / 3,
                                   999999999.9,
                                   1e9,
                                   -1e9,
                                   1e15,
                                   1e16,
                                   1e300,
                                   1710345016.25,
                                   5e-324,
                                   999999.9999995,
                                   0.0001234567,
                                   1e-6,
                                   123456789.123456,
                                   360,
                                   89.9999};
    static const json_int_t integers[] = {0, -1, 1, 10, INT64_MAX, INT64_MIN};
    static const char *const strings[] = {"", "plain", "a \"b\" \\ /", "\n\t\x01\x7f", "\xc3\xa9\xe2\x80\xa8"};
    for (size_t i = 0; i < sizeof reals / sizeof *reals; i++)
        check_same(json_real(reals[i]));
    for (size_t i = 0; i < sizeof integers / sizeof *integers; i++)
        check_same(json_integer(integers[i]));
    for (size_t i = 0; i < sizeof strings / sizeof *strings; i++) {
        check_same(json_string(strings[i]));
        check_same(json_pack("{s:i, s:[s]}", strings[i], 1, "x", strings[i]));
    }
    check_same(json_pack("[b, b, n, [], {}, [[]], {s:{}}]", 1, 0, "a"));
}

/* Numbers as answers have them (few decimals), and any others. */
static json_t *by_chance(uint64_t *random, int depth)
{
    static const double per_unit[] = {1, 10, 1e2, 1e3, 1e4, 1e5, 1e6, 1e9};
    const uint64_t kind = test_random(random) % (depth > 0 ? 7 : 4);
    const double size = pow(10, test_uniform(random) * 12 - 4), digits = per_unit[test_random(random) % 8];
    char name[8];
    uint64_t bits = test_random(random);
    double any;
    switch (kind) {
    case 0:
        return json_integer((json_int_t)(bits >> bits % 64));
    case 1:
    case 2:
        return json_real(round((test_uniform(random) * 2 - 1) * size * digits) / digits);
    case 3:
        memcpy(&any, &bits, sizeof any);
        return json_real(isfinite(any) ? any : 0);
    default:
        break;
    }
    json_t *value = kind == 4 ? json_array() : json_object();
    for (uint64_t n = test_random(random) % 6; n > 0; n--) {
        snprintf(name, sizeof name, "k%d", (int)n);
        if (kind == 4)
            json_array_append_new(value, by_chance(random, depth - 1));
        else
            json_object_set_new(value, name, by_chance(random, depth - 1));
    }
    return value;
}

TEST(values_by_chance_read_as_by_jansson)
{
    uint64_t random = test_seed();
    for (int i = 0; i < 100000 && !test_case_failed; i++)
        check_same(by_chance(&random, 3));
}

static void check_rounded(double value, double per_unit)
{
    struct json_out rounded = {0}, real = {0};
    json_out_rounded(&rounded, value, per_unit);
    json_out_real(&real, round(value * per_unit) / per_unit);
    CHECK_INT(rounded.failed, real.failed);
    CHECK_INT(rounded.n, real.n);
    CHECK(real.failed || (rounded.n == real.n && memcmp(rounded.bytes, real.bytes, real.n) == 0));
    free(rounded.bytes);
    free(real.bytes);
}

TEST(what_is_rounded_reads_as_the_real_it_is_rounded_to)
{
    static const double edges[] = {
        0,           -0.0,      1,        0.00004, -0.00004, 0.00005, 0.99999,          360,  -1e-7,
        12345.67891, 999999999, 1e9,      1e9 + 1, 1e11,     -1e12,   9.99999e14,       1e15, 1e300,
        5e-324,      NAN,       INFINITY, 0.5,     1.5,      2.5,     999999999.999949, 1e13, 1e-4,
        0.1};
    uint64_t random = test_seed();
    for (double per_unit = 1; per_unit <= 1e9; per_unit *= 10)
        for (size_t i = 0; i < sizeof edges / sizeof *edges; i++)
            check_rounded(edges[i], per_unit);
    for (int i = 0; i < 300000 && !test_case_failed; i++) {
        const double size = pow(10, test_uniform(&random) * 20 - 6);
        check_rounded((test_uniform(&random) * 2 - 1) * size, pow(10, (double)(test_random(&random) % 8)));
    }
}

TEST(what_json_does_not_have_fails_until_it_is_cut_away)
{
    struct json_out t = {0};
    json_out_open(&t, '[');
    json_out_integer(&t, 1);
    const size_t good = t.n;
    json_out_real(&t, NAN);
    CHECK(t.failed);
    json_out_cut(&t, good);
    json_out_real(&t, INFINITY);
    CHECK(t.failed);
    json_out_cut(&t, good);
    json_out_null(&t);
    json_out_close(&t, ']');
    json_out_bytes(&t, "", 1);
    CHECK(!t.failed);
    CHECK_STR(t.bytes, "[1,null]");
    free(t.bytes);
}

int main(void)
{
    RUN(edges_read_as_by_jansson);
    RUN(values_by_chance_read_as_by_jansson);
    RUN(what_is_rounded_reads_as_the_real_it_is_rounded_to);
    RUN(what_json_does_not_have_fails_until_it_is_cut_away);
    return test_end();
}
