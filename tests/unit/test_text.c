/* SPDX-License-Identifier: MIT */
/* test_text - JSON as it goes out against jansson's, byte for byte: the cases at the edges, and values by chance. */
#include "../../daemon/text.h"

#include "../lib/test.h"

#define FLAGS (JSON_COMPACT | JSON_ENCODE_ANY | JSON_REAL_PRECISION(15))

/* Takes value over. */
static void check_same(json_t *value)
{
    struct text t = {0};
    char *want = json_dumps(value, FLAGS);
    text_json(&t, value);
    text_bytes(&t, "", 1);
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

TEST(what_json_does_not_have_fails_until_it_is_cut_away)
{
    struct text t = {0};
    text_open(&t, '[');
    text_integer(&t, 1);
    const size_t good = t.n;
    text_real(&t, NAN);
    CHECK(t.failed);
    text_cut(&t, good);
    text_real(&t, INFINITY);
    CHECK(t.failed);
    text_cut(&t, good);
    text_null(&t);
    text_close(&t, ']');
    text_bytes(&t, "", 1);
    CHECK(!t.failed);
    CHECK_STR(t.bytes, "[1,null]");
    free(t.bytes);
}

int main(void)
{
    RUN(edges_read_as_by_jansson);
    RUN(values_by_chance_read_as_by_jansson);
    RUN(what_json_does_not_have_fails_until_it_is_cut_away);
    return test_end();
}
