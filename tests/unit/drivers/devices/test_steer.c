/* SPDX-License-Identifier: MIT */
/* test_steer - when a head may leave its plain scan, and when it has been all around. */
#include "tests/lib/test.h"

#include "drivers/devices/steer.h"

#define MS 1000000ull

/* A circle of `turn` plain pings and as many passes as there is time for; returns how long it takes. */
static uint64_t drive(struct steer *s, unsigned pass, unsigned turn, unsigned ping_ms, uint64_t *now_ns,
                      unsigned *passes)
{
    const uint64_t begun_ns = *now_ns;
    unsigned plain = 0;
    steer_begin(s, *now_ns);
    *passes = 0;
    for (unsigned at = 0; at < turn; at++) {
        *now_ns += ping_ms * MS;
        steer_ping(s);
        plain++;
        if (!steer_has_time(s, plain, pass, turn, *now_ns))
            continue;
        for (unsigned i = 0; i < pass; i++) {
            *now_ns += ping_ms * MS;
            steer_ping(s);
        }
        plain = 0;
        ++*passes;
    }
    return *now_ns - begun_ns;
}

TEST(a_circle_with_its_passes_takes_no_longer_than_it_shall)
{
    static const unsigned pass[] = {5, 12, 30};
    for (size_t i = 0; i < sizeof pass / sizeof *pass; i++) {
        struct steer s = {.circle_ns = 15000 * MS};
        uint64_t now_ns = 1000 * MS;
        unsigned passes;
        for (int circle = 0; circle < 4; circle++) {
            const uint64_t took_ns = drive(&s, pass[i], 200, 50, &now_ns, &passes);
            CHECK(took_ns <= 15000 * MS);
            if (circle > 0)
                CHECK(took_ns >
                      (15000 - 3 * 50 * pass[i]) * MS); /* and hardly less: all but two passes were made */
        }
    }
}

TEST(a_circle_that_has_no_time_to_spare_has_no_pass)
{
    struct steer s = {.circle_ns = 10200 * MS};
    uint64_t now_ns = 0;
    unsigned passes;
    for (int circle = 0; circle < 3; circle++) {
        drive(&s, 10, 200, 50, &now_ns, &passes);
        CHECK_INT(passes, 0);
    }
}

TEST(without_such_a_time_half_of_the_pings_are_passes)
{
    struct steer s = {.circle_ns = 0};
    CHECK(!steer_has_time(&s, 9, 10, 200, 0));
    CHECK(steer_has_time(&s, 10, 10, 200, 0));
    s.circle_ns = 1000000 * MS;
    CHECK(!steer_has_time(&s, 100, 10, 200, 5000 * MS)); /* before a ping nobody knows the pace */
    steer_ping(&s);
    CHECK(!steer_has_time(&s, 9, 10, 200, 50 * MS));
    CHECK(steer_has_time(&s, 10, 10, 200, 50 * MS));
}

/* Every arc counts once, in any order; what is behind the last whole arc belongs to it. */
TEST(a_turn_is_seen_when_every_arc_was)
{
    static const unsigned step[] = {1, 3, 7};
    const unsigned turn = 400;
    for (size_t i = 0; i < sizeof step / sizeof *step; i++) {
        struct steer_seen seen = {0};
        const unsigned arcs = turn / step[i];
        for (int again = 0; again < 3; again++) {
            CHECK_INT(steer_seen_add(&seen, turn - 1, step[i], turn), again > 0);
            for (unsigned k = 1; k < arcs; k++) {
                CHECK_INT(seen.n, k);
                CHECK(!steer_seen_add(&seen, turn - 1, step[i], turn));
                CHECK(!steer_seen_add(&seen, (k * 11 + arcs - 1) % arcs * step[i], step[i], turn));
            }
        }
    }
}

int main(void)
{
    RUN(a_circle_with_its_passes_takes_no_longer_than_it_shall);
    RUN(a_circle_that_has_no_time_to_spare_has_no_pass);
    RUN(without_such_a_time_half_of_the_pings_are_passes);
    RUN(a_turn_is_seen_when_every_arc_was);
    return test_end();
}
