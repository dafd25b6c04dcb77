/* SPDX-License-Identifier: MIT */
/* test_push - the way that a vehicle is pushed: the average, what holds it in place is none, and what is over. */
#include "tests/lib/test.h"

#include <math.h>

#include "daemon/input/push.h"

#define SECOND 1000000000ull

static struct push push;
static uint64_t now_ns;

static void pushes(double forward_n, double right_n, double s)
{
    for (int i = 0; i < lround(s * 20); i++)
        push_put(&push, now_ns += SECOND / 20, (const double[2]){forward_n, right_n});
}

static void start(void)
{
    push = (struct push){0};
    now_ns = 100 * SECOND;
}

TEST(the_way_follows_the_push)
{
    double way[3] = {9, 9, 9};
    start();
    CHECK(!push_way(&push, now_ns, way));
    CHECK(!push_way(&push, SECOND, way)); /* the clock has just begun */
    pushes(4, 0, 1);
    CHECK(push_way(&push, now_ns, way));
    CHECK(way[0] > 3.9 && way[1] == 0 && way[2] == 0);
    pushes(0, -4, 5);
    CHECK(push_way(&push, now_ns, way));
    CHECK_NEAR(atan2(way[1], way[0]), -1.5707963, 0, 0.05);
}

TEST(to_and_fro_is_no_way)
{
    double way[3];
    start();
    for (int i = 0; i < 100; i++)
        pushes(i % 2 ? 3 : -3, i % 3 - 1.0, 0.1);
    now_ns += 4 * SECOND;
    CHECK(!push_way(&push, now_ns, way));
    pushes(0.8, 0, 10);
    CHECK(!push_way(&push, now_ns, way));
}

TEST(it_is_over_after_a_while)
{
    double way[3];
    start();
    pushes(10, 0, 2);
    CHECK(push_way(&push, now_ns + 2900000000u, way));
    CHECK(!push_way(&push, now_ns + 3100000000u, way));
    pushes(0, 0, 7); /* the average falls below a newton after 2.3 s */
    CHECK(!push_way(&push, now_ns, way));
    push_put(&push, now_ns - SECOND, (const double[2]){50, 0}); /* an old one */
    CHECK(!push_way(&push, now_ns, way));
    push_put(&push, now_ns + 60 * SECOND, (const double[2]){0, 5}); /* what was a minute ago does not count */
    CHECK(push_way(&push, now_ns + 60 * SECOND, way));
    CHECK_NEAR(way[1], 5, 0, 0);
}

int main(void)
{
    RUN(the_way_follows_the_push);
    RUN(to_and_fro_is_no_way);
    RUN(it_is_over_after_a_while);
    return test_end();
}
