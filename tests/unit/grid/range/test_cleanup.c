/* SPDX-License-Identifier: MIT */
/*
 * test_cleanup - the chain, ping by ping, against a slow one that looks at all pings so far; what is held back, and
 * what comes out when the head changes its ways.
 */
#include "tests/lib/test.h"

#include "core/fault.h"
#include "grid/range/clahe.h"
#include "grid/range/cleanup.h"
#include "grid/range/otsu.h"
#include "grid/range/survivors.h"

#define MAX_BINS 64
#define TURN     40
#define PINGS    600

static struct cleanup *cleanup;
static void *memory;

static void set_up(const struct cleanup_conf *conf)
{
    struct fault fault = {""};
    free(memory);
    memory = aligned_alloc(64, (cleanup_size(conf, MAX_BINS) + 63) / 64 * 64);
    cleanup = memory ? cleanup_init(memory, conf, &mount_identity, MAX_BINS, &fault) : NULL;
    if (!cleanup) {
        printf("cleanup_init: %s\n", fault.text);
        exit(1);
    }
}

/* A ping of the tests, all that was sent of it. */
struct shot {
    struct ping ping;
    struct ping_beam beam;
    uint8_t bin[MAX_BINS], background[MAX_BINS], blind[MAX_BINS];
};

static void shot_init(struct shot *s, uint32_t seq, uint32_t units, uint32_t bins)
{
    *s = (struct shot){.ping = {.t_ns = 1000000000 + seq * UINT64_C(50000000),
                                .seq = seq,
                                .sample_bytes = 1,
                                .n_beams = 1,
                                .n_bins = bins,
                                .dr_m = 0.1f,
                                .head_units = units,
                                .head_turn = TURN,
                                .pose = pose_identity}};
}

static bool put(struct shot *s)
{
    s->ping.beam = &s->beam;
    s->ping.samples = s->bin;
    return cleanup_put(cleanup, &s->ping, NULL, NULL, NULL);
}

/* ---- the slow chain ---- */

static struct shot shots[PINGS];
static uint8_t smooth_of[PINGS][MAX_BINS], cut_of[PINGS][MAX_BINS]; /* what the stages made of each ping */

static int by_value(const void *a, const void *b)
{
    return *(const uint8_t *)a - *(const uint8_t *)b;
}

/* Newest of the shots first .. last in a row, or -1. */
static int newest_in_row(int first, int last, uint32_t row)
{
    for (int i = last; i >= first; i--)
        if (shots[i].ping.head_units == row)
            return i;
    return -1;
}

static uint8_t less_background(const struct shot *s, int64_t i)
{
    const int64_t n = s->ping.n_bins, at = i < 0 ? 0 : i >= n ? n - 1 : i;
    return (uint8_t)(s->bin[at] > s->background[at] ? s->bin[at] - s->background[at] : 0);
}

/* Shot i of an image that began with shot `first`, when `last` is the newest. */
static void slow_median(int k, int first, int i, int last)
{
    const struct shot *s = &shots[i];
    for (int64_t x = 0; x < s->ping.n_bins; x++) {
        uint8_t v[25];
        size_t c = 0;
        for (int dy = -k / 2; dy <= k / 2; dy++) {
            const uint32_t row = (s->ping.head_units + TURN + (uint32_t)dy) % TURN;
            const int at = dy ? newest_in_row(first, last, row) : i;
            if (at < 0 || last - at > TURN + TURN / 2)
                continue;
            for (int64_t dx = -k / 2; dx <= k / 2; dx++)
                v[c++] = less_background(&shots[at], x + dx);
        }
        qsort(v, c, 1, by_value);
        smooth_of[i][x] = v[(c - 1) / 2];
    }
}

/* Histogram over the newest row at every angle, not older than a turn and a half. */
static void slow_histogram(uint8_t image[][MAX_BINS], int first, int last, uint64_t count[256])
{
    memset(count, 0, 256 * sizeof *count);
    for (uint32_t row = 0; row < TURN; row++) {
        const int at = newest_in_row(first, last, row);
        if (at < 0 || last - at >= TURN + TURN / 2)
            continue;
        for (uint32_t x = 0; x < shots[at].ping.n_bins; x++)
            count[image[at][x]]++;
    }
}

static void slow_cut(int first, int i)
{
    uint64_t count[256];
    uint8_t t = 0;
    slow_histogram(smooth_of, first, i, count);
    const bool found = otsu_two(count, &t);
    for (uint32_t x = 0; x < MAX_BINS; x++)
        cut_of[i][x] = !found || smooth_of[i][x] > t ? smooth_of[i][x] : 0;
}

static int slow_lowest(int first, int i)
{
    uint64_t count[256];
    uint8_t t[2];
    slow_histogram(cut_of, first, i, count);
    return otsu_three(count, t) ? t[0] : otsu_two(count, t) ? t[0] : -1;
}

/* A head that sweeps, reverses, loses beams and stays where it is; the second shot is next to the first. */
static void make_shots(uint64_t *random)
{
    int way = 1;
    uint32_t units = 5;
    for (uint32_t i = 0; i < PINGS; i++) {
        struct shot *s = &shots[i];
        shot_init(s, i + 1, units, 33);
        for (uint32_t x = 0; x < 33; x++) {
            s->bin[x] = (uint8_t)(test_random(random) >> (test_random(random) & 7));
            s->background[x] = x % 5 ? 0 : (uint8_t)test_random(random);
            s->blind[x] = test_random(random) % 3 == 0;
        }
        if (i > 2 && test_random(random) % 50 == 0)
            way = -way;
        const uint32_t steps =
            i > 2 ? (uint32_t)(test_random(random) % 10 == 0) + (test_random(random) % 15 != 0) : 1;
        units = (units + TURN + (way > 0 ? steps : TURN - steps)) % TURN;
    }
}

/* The first shot's image ends with the second, which tells the step. */
static void compare(unsigned k, uint64_t *random)
{
    const int delay = (int)k / 2;
    int out = 0;
    set_up(&(struct cleanup_conf){.median = k, .otsu = true, .classes = true, .clip = 2});
    make_shots(random);
    for (int i = 0; i < PINGS; i++) {
        struct extract_aid aid;
        struct shot *s = &shots[i];
        s->ping.beam = &s->beam;
        s->ping.samples = s->bin;
        CHECK(cleanup_put(cleanup, &s->ping, s->background, i % 7 ? s->blind : NULL, NULL));
        for (const struct ping *p; (p = cleanup_next(cleanup, &aid)); out++) {
            const int first = out ? 1 : 0, last = out ? i : 0;
            const struct shot *want = &shots[out];
            if (k)
                slow_median((int)k, first, out, last);
            else
                for (uint32_t x = 0; x < 33; x++)
                    smooth_of[out][x] = less_background(want, x);
            slow_cut(first, out);
            CHECK_INT(p->seq, want->ping.seq);
            CHECK_INT(p->t_ns, want->ping.t_ns);
            CHECK(memcmp(p->samples, want->bin, 33) == 0);
            CHECK(memcmp(aid.clean, cut_of[out], 33) == 0);
            CHECK_INT(aid.lowest, slow_lowest(first, out));
            CHECK((aid.blind != NULL) == (out % 7 != 0));
            CHECK(!aid.blind || memcmp(aid.blind, want->blind, 33) == 0);
        }
        CHECK_INT(cleanup_held(cleanup), i + 1 - out);
        CHECK(i == 0 || (int)cleanup_held(cleanup) == (i < delay + 1 ? i : delay) || !delay);
        if (test_case_failed) {
            printf("median %u, ping %d\n", k, i);
            return;
        }
    }
    CHECK_INT(out, PINGS - delay);
}

TEST(beam_by_beam_equals_the_slow_chain)
{
    uint64_t random = test_seed();
    for (unsigned round = 0; round < 3; round++) {
        compare(0, &random);
        compare(3, &random);
        compare(5, &random);
    }
}

/* ---- what is held ---- */

static int drained(void)
{
    struct extract_aid aid;
    int n = 0;
    while (cleanup_next(cleanup, &aid))
        n++;
    return n;
}

/* What waits keeps its own direction, and not that of the one that came last. */
TEST(beams_come_out_with_their_own_direction)
{
    for (unsigned median = 0; median <= 5; median += median ? 2 : 3) {
        uint32_t out = 0;
        set_up(&(struct cleanup_conf){.median = median, .otsu = true, .clip = 2});
        for (uint32_t u = 0; u < 20; u++) {
            struct extract_aid aid;
            struct shot s;
            shot_init(&s, u + 1, u, 20);
            s.beam.az_rad = 0.1f * (float)u;
            s.beam.el_rad = 0.01f * (float)u;
            put(&s);
            for (const struct ping *p; (p = cleanup_next(cleanup, &aid)); out++) {
                CHECK_NEAR(p->beam[0].az_rad, 0.1 * out, 1e-6, 0);
                CHECK_NEAR(p->beam[0].el_rad, 0.01 * out, 1e-6, 0);
            }
        }
        CHECK(out >= 18);
    }
}

TEST(delay_is_as_stated)
{
    static const struct {
        unsigned median, delay;
    } row[] = {{0, 0}, {3, 1}, {5, 2}};

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const struct cleanup_conf conf = {.median = row[i].median, .otsu = true, .clahe = true, .clip = 2};
        CHECK_INT(cleanup_delay(&conf), row[i].delay);
        set_up(&conf);
        uint32_t in = 0, out = 0;
        for (uint32_t u = 0; u < TURN; u++) {
            struct shot s;
            shot_init(&s, u + 1, u, 20);
            in += put(&s);
            out += (uint32_t)drained();
            CHECK(u < row[i].delay || in - out == row[i].delay);
        }
    }
}

TEST(a_head_that_does_not_turn_waits_for_nothing)
{
    set_up(&(struct cleanup_conf){.median = 5, .clip = 2});
    for (uint32_t i = 1; i < 5; i++) {
        struct shot s;
        shot_init(&s, i, 0, 20);
        s.ping.head_turn = 0;
        CHECK(put(&s));
        CHECK_INT(drained(), 1);
    }
}

/* I8 */
TEST(another_range_lets_the_old_beams_go_and_mixes_nothing)
{
    struct extract_aid aid;
    struct shot s;
    set_up(&(struct cleanup_conf){.median = 5, .otsu = true, .classes = true, .clip = 2});
    for (uint32_t u = 0; u < 10; u++) {
        shot_init(&s, u + 1, u, 40);
        memset(s.bin, 200, 40);
        put(&s);
        drained();
    }
    for (uint32_t u = 10; u < 14; u++) {
        shot_init(&s, u + 1, u, 20);
        memset(s.bin, u == 10 ? 1 : 3, 20);
        put(&s);
        const struct ping *p = cleanup_next(cleanup, &aid);
        CHECK(u != 10 || (p && p->seq == 9 && p->n_bins == 40 && aid.clean[39] == 200));
        p = u == 10 ? cleanup_next(cleanup, &aid) : p;
        CHECK(u != 10 || (p && p->seq == 10));
        CHECK(u < 13 || (p && p->n_bins == 20 && aid.clean[19] <= 3));
        drained();
    }
    struct cleanup_state state;
    cleanup_state(cleanup, &state);
    CHECK_INT(state.restarts, 1);
    CHECK(state.otsu <= 3 && state.lowest <= 3);
}

/* With survivors the class step is the extractor's, row by row; a ping of an image that has ended has none. */
TEST(survivors_are_of_the_image_that_the_ping_is_of)
{
    static uint8_t all[MAX_BINS];
    struct extract_aid aid;
    struct cleanup_state state;
    struct shot s;
    memset(all, 1, sizeof all);
    set_up(&(struct cleanup_conf){.median = 5, .classes = true, .survivors = true, .clip = 2});
    for (uint32_t u = 0; u < 10; u++) {
        shot_init(&s, u + 1, u, 40);
        memset(s.bin, 100 + 50 * (int)(u / 5), 40);
        put(&s);
        for (const struct ping *p; (p = cleanup_next(cleanup, &aid)) != NULL;) {
            CHECK_INT(aid.lowest, -1);
            CHECK((aid.survivors != NULL) == (p->seq > 1)); /* the first is an image of its own */
            if (aid.survivors) {
                CHECK_INT(aid.survivors->row, p->head_units);
                survivors_lowest(aid.survivors, aid.clean, all);
            }
        }
    }
    cleanup_state(cleanup, &state);
    CHECK_INT(state.lowest, 100);
    shot_init(&s, 11, 10, 20);
    put(&s);
    for (int n = 0; n < 2; n++) /* those that waited in the old image, whose rows are no more */
        CHECK(cleanup_next(cleanup, &aid) != NULL && aid.survivors == NULL);
    cleanup_state(cleanup, &state);
    CHECK_INT(state.lowest, -1);
}

TEST(pings_that_are_no_image_pass_after_those_that_wait)
{
    static uint8_t many[4 * MAX_BINS];
    for (int what = 0; what < 6; what++) {
        struct shot s;
        set_up(&(struct cleanup_conf){.median = 3, .clip = 2});
        for (uint32_t u = 0; u < 4; u++) {
            shot_init(&s, u + 1, u, 20);
            put(&s);
            drained();
        }
        CHECK_INT(cleanup_held(cleanup), 1);
        shot_init(&s, 5, 4, 20);
        struct ping_beam beams[2] = {{0}};
        struct ping p = s.ping;
        p.beam = beams;
        p.samples = many;
        if (what == 0)
            p.n_beams = 2;
        if (what == 1)
            p.sample_bytes = 2;
        if (what == 2)
            p.kind = PING_RANGES;
        if (what == 3)
            p.n_bins = 0;
        if (what == 4)
            p.n_bins = MAX_BINS + 1;
        if (what == 5)
            p.flags = PING_UNHEARD;
        CHECK(!cleanup_put(cleanup, &p, NULL, NULL, NULL));
        CHECK_INT(drained(), 1);
        CHECK_INT(cleanup_held(cleanup), 0);
        struct cleanup_state state;
        cleanup_state(cleanup, &state);
        CHECK_INT(state.passed, 1);
    }
}

/* ---- a vehicle that moves ---- */

/* A wall two bins thick, the vehicle drives towards it by two bins from ping to ping. */
TEST(neighbours_are_shifted_by_the_way_made)
{
    for (int known = 0; known < 3; known++) {
        struct extract_aid aid = {0};
        set_up(&(struct cleanup_conf){.median = 3, .clip = 2});
        for (uint32_t u = 0; u < 10; u++) {
            struct shot s;
            shot_init(&s, u + 1, u, 40);
            s.bin[30 - 2 * u] = 200;
            s.bin[31 - 2 * u] = 200;
            struct pose *pose = &s.ping.pose;
            pose->has = known ? POSE_ATTITUDE | (known == 1 ? POSE_POSITION : POSE_VELOCITY) : 0;
            pose->position_m[0] = known == 1 ? 0.2 * u : 0;
            pose->velocity_mps[0] = known == 2 ? 0.2 / 0.05 : 0;
            put(&s);
            const struct ping *p = cleanup_next(cleanup, &aid);
            if (u > 2 && p) {
                const uint32_t v = p->head_units;
                CHECK_INT(aid.clean[30 - 2 * v], known ? 200 : 0);
                CHECK_INT(aid.clean[29 - 2 * v], 0);
            }
        }
    }
}

/* ---- odd images ---- */

TEST(an_image_without_contrast_is_kept)
{
    struct extract_aid aid;
    struct cleanup_state state;
    set_up(&(struct cleanup_conf){.otsu = true, .classes = true, .clip = 2});
    for (uint32_t u = 0; u < 10; u++) {
        struct shot s;
        shot_init(&s, u + 1, u, 20);
        memset(s.bin, 77, 20);
        put(&s);
        CHECK(cleanup_next(cleanup, &aid) && aid.clean[7] == 77);
        CHECK_INT(aid.lowest, -1);
    }
    cleanup_state(cleanup, &state);
    CHECK_INT(state.otsu, -1);
    CHECK_INT(state.lowest, -1);
}

/* Without classes what Otsu took away is the lowest class. */
TEST(otsu_alone_rules_out_what_it_took_away)
{
    struct extract_aid aid;
    set_up(&(struct cleanup_conf){.otsu = true, .clip = 2});
    for (uint32_t u = 0; u < 5; u++) {
        struct shot s;
        shot_init(&s, u + 1, u, 20);
        memset(s.bin, 20, 20);
        s.bin[9] = 180;
        put(&s);
        CHECK(cleanup_next(cleanup, &aid) && aid.clean[8] == 0 && aid.clean[9] == 180);
        CHECK_INT(aid.lowest, 0);
    }
}

/* The lowest class without a threshold is none: nothing is ruled out, not even what is 0. */
TEST(without_a_threshold_nothing_is_ruled_out)
{
    static const struct cleanup_conf conf[] = {
        {.otsu = true, .clip = 2}, {.classes = true, .clip = 2}, {.otsu = true, .classes = true, .clip = 2}};
    for (size_t i = 0; i < sizeof conf / sizeof conf[0]; i++)
        for (int level = 0; level < 256; level += 51) {
            struct extract_aid aid;
            struct shot s;
            set_up(&conf[i]);
            shot_init(&s, 1, 0, 20);
            memset(s.bin, level, 20);
            put(&s);
            CHECK(cleanup_next(cleanup, &aid));
            CHECK_INT(aid.lowest, -1);
        }
}

/* Two different counts make two classes, of which the lower one is the lowest. */
TEST(two_counts_make_a_lowest_class)
{
    struct extract_aid aid;
    struct shot s;
    set_up(&(struct cleanup_conf){.classes = true, .clip = 2});
    shot_init(&s, 1, 0, 20);
    memset(s.bin, 20, 20);
    s.bin[9] = 180;
    put(&s);
    CHECK(cleanup_next(cleanup, &aid));
    CHECK_INT(aid.lowest, 20);
}

TEST(wrong_settings_are_refused)
{
    static const struct cleanup_conf bad[] = {{.median = 4, .clip = 2},
                                              {.median = 7, .clip = 2},
                                              {.clahe = true},
                                              {.clahe = true, .clip = 101},
                                              {.clahe = true, .clip = NAN}};
    static _Alignas(16) char room[64];
    struct fault fault;

    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        fault.text[0] = '\0';
        CHECK(!cleanup_init(room, &bad[i], &mount_identity, MAX_BINS, &fault));
        CHECK(strstr(fault.text, "allowed"));
    }
    CHECK(!cleanup_wanted(&(struct cleanup_conf){.clip = 2}));
    CHECK(cleanup_wanted(&(struct cleanup_conf){.classes = true}));
}

int main(void)
{
    RUN(beam_by_beam_equals_the_slow_chain);
    RUN(beams_come_out_with_their_own_direction);
    RUN(delay_is_as_stated);
    RUN(a_head_that_does_not_turn_waits_for_nothing);
    RUN(another_range_lets_the_old_beams_go_and_mixes_nothing);
    RUN(survivors_are_of_the_image_that_the_ping_is_of);
    RUN(pings_that_are_no_image_pass_after_those_that_wait);
    RUN(neighbours_are_shifted_by_the_way_made);
    RUN(an_image_without_contrast_is_kept);
    RUN(otsu_alone_rules_out_what_it_took_away);
    RUN(without_a_threshold_nothing_is_ruled_out);
    RUN(two_counts_make_a_lowest_class);
    RUN(wrong_settings_are_refused);
    free(memory);
    return test_end();
}
