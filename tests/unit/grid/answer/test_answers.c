/* SPDX-License-Identifier: MIT */
/* test_answers - libsonard's typed answers: what the daemon says becomes a struct; what is no answer is never clear. */
#include "client/lib/sonard.h"

#include "tests/lib/test.h"

#define BLOCKED(state)                                                                                            \
    "{\"state\":" state ",\"range_m\":3.5,\"confidence\":0.5,\"age_s\":null,\"reason\":\"heard\"}"

TEST(a_direction)
{
    struct sonard_blocked b;
    CHECK(sonard_read_blocked(BLOCKED("\"blocked\""), &b));
    CHECK(b.state == SONARD_BLOCKED && b.range_m == 3.5 && b.confidence == 0.5);
    CHECK(isnan(b.age_s) && isnan(b.free_to_m));
    CHECK_STR(b.reason, "heard");
    CHECK(sonard_read_blocked(BLOCKED("\"clear\""), &b) && b.state == SONARD_CLEAR);
    CHECK(sonard_read_blocked(BLOCKED("\"unknown\""), &b) && b.state == SONARD_UNKNOWN);
}

static const char *const nonsense[] = {
    "",
    "null",
    "[]",
    "{",
    "{}",
    BLOCKED("\"CLEAR\""),
    BLOCKED("1"),
    BLOCKED("null"),
    "{\"state\":\"clear\",\"state\":\"clear\"}",
    "{\"limited_by\":\"nothing\",\"speed_mps\":1}",
    "{\"limited_by\":\"nothing\",\"speed_mps\":1,\"velocity_mps\":[1,0]}",
    "{\"limited_by\":\"nothing\",\"speed_mps\":1,\"velocity_mps\":[1,0,\"0\"]}",
    "{\"limited_by\":\"clear\",\"speed_mps\":1,\"velocity_mps\":[1,0,0]}",
    "{\"frame\":\"body\",\"sectors\":[]}",
    "{\"frame\":\"body\",\"sectors\":[{\"state\":\"clear\"}]}",
    "{\"frame\":\"x\",\"sectors\":[{\"state\":\"clear\",\"azimuth_deg\":0}]}",
    "{\"frame\":\"ned\",\"sectors\":[{\"state\":\"clear\",\"azimuth_deg\":0},{\"state\":\"\",\"azimuth_deg\":5}]}",
};

/* Whatever stood in the struct before: nothing of it may be left. */
TEST(no_answer_is_never_clear)
{
    static struct sonard_sectors s;
    for (size_t i = 0; i < sizeof nonsense / sizeof *nonsense; i++) {
        struct sonard_blocked b = {.state = SONARD_CLEAR, .free_to_m = 9};
        struct sonard_limit l = {.limited_by = SONARD_CLEAR, .speed_mps = 9, .velocity_mps = {9, 9, 9}};
        struct sonard_collision c = {.state = SONARD_CLEAR};
        s = (struct sonard_sectors){.count = 1, .sector = {{.state = SONARD_CLEAR}}};
        CHECK(!sonard_read_blocked(nonsense[i], &b) && b.state == SONARD_UNKNOWN && b.free_to_m == 0);
        CHECK(!sonard_read_limit(nonsense[i], &l) && l.speed_mps == 0 && l.velocity_mps[0] == 0);
        CHECK(!sonard_read_collision(nonsense[i], &c) && c.state == SONARD_UNKNOWN);
        CHECK(!sonard_read_sectors(nonsense[i], &s) && s.count == 0 && s.sector[0].state == SONARD_UNKNOWN);
    }
}

TEST(a_limit_and_a_collision)
{
    struct sonard_limit l;
    struct sonard_collision c;
    CHECK(sonard_read_limit("{\"velocity_mps\":[0.5,0,-0.25],\"speed_mps\":0.56,\"limited_by\":\"unknown\","
                            "\"stop_m\":1,\"blocked_m\":null,\"free_m\":2,\"age_s\":3,\"reason\":\"r\"}",
                            &l));
    CHECK(l.limited_by == SONARD_UNKNOWN && l.velocity_mps[2] == -0.25 && isnan(l.blocked_m) && l.free_m == 2);
    CHECK(sonard_read_collision("{\"state\":\"blocked\",\"time_s\":4,\"unknown_after_s\":null}", &c));
    CHECK(c.state == SONARD_BLOCKED && c.time_s == 4 && isnan(c.unknown_after_s));
}

/* n sectors of half a degree, blocked and clear in turn. */
static const char *ring_of(int n)
{
    static char json[SONARD_SECTORS_MAX * 100 + 200];
    int k = snprintf(json, sizeof json,
                     "{\"frame\":\"ned\",\"t_unix\":1.5,\"pose_age_s\":null,\"near_m\":1.5,\"sectors\":[");

    for (int i = 0; i < n; i++)
        k += snprintf(json + k, sizeof json - (size_t)k,
                      "%s{\"azimuth_deg\":%g,\"width_deg\":0.5,\"state\":\"%s\"}", i ? "," : "", i / 2.0,
                      i % 2 ? "clear" : "blocked");
    snprintf(json + k, sizeof json - (size_t)k, "]}");
    return json;
}

TEST(a_ring)
{
    static struct sonard_sectors s;
    CHECK(sonard_read_sectors(ring_of(SONARD_SECTORS_MAX), &s));
    CHECK_INT(s.count, SONARD_SECTORS_MAX);
    CHECK(s.frame == SONARD_NED && s.t_unix == 1.5 && isnan(s.pose_age_s) && s.near_m == 1.5);
    CHECK(s.sector[719].state == SONARD_CLEAR && s.sector[719].azimuth_deg == 359.5 && isnan(s.sector[0].range_m));
    CHECK(!sonard_read_sectors(ring_of(SONARD_SECTORS_MAX + 1), &s) && s.count == 0);
}

int main(void)
{
    RUN(a_direction);
    RUN(no_answer_is_never_clear);
    RUN(a_limit_and_a_collision);
    RUN(a_ring);
    return test_end();
}
