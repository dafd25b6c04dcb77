/* SPDX-License-Identifier: MIT */
/* Which Host and Origin headers are accepted: no name that another site can choose. */
#include "tests/lib/test.h"
#include "web/web_guard.h"

static const struct web_guard guard = {
    .machine = "rov", .names = "blueos.local,sub.example", .origins = "https://app.foxglove.dev"};

TEST(host)
{
    static const struct {
        const char *host;
        bool good;
    } row[] = {
        {"127.0.0.1:9360", true},
        {"192.168.2.2", true},
        {"[::1]:9360", true},
        {"[fd00::1]", true},
        {"localhost:9360", true},
        {"LocalHost", true},
        {"rov", true},
        {"rov.local:9360", true},
        {"BlueOS.local", true},
        {"sub.example:80", true},
        {"evil.example", false},
        {"rov.evil.example", false},
        {"localhost.evil.example", false},
        {"evil.local", false},
        {"127.0.0.1.evil.example", false},
        {"127.0.0.1:9360.evil.example", false},
        {"1.2.3", false},
        {"blueos.local,sub.example", false},
        {"blueos", false},
        {"::1", false},
        {"[127.0.0.1]", false},
        {"[::1", false},
        {"[localhost]", false},
        {"localhost:80x", false},
        {"", false},
        {":80", false},
        {",", false},
    };

    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        if (web_guard_host(&guard, row[i].host) != row[i].good) {
            printf("Host %s\n", row[i].host);
            CHECK(false);
        }
}

TEST(a_long_host)
{
    char host[400];
    memset(host, 'a', sizeof host);
    host[sizeof host - 1] = '\0';
    CHECK(!web_guard_host(&guard, host));
}

TEST(origin)
{
    CHECK(web_guard_origin(&guard, NULL, "rov:9360"));
    CHECK(web_guard_origin(&guard, "http://rov:9360", "rov:9360"));
    CHECK(web_guard_origin(&guard, "https://ROV:9360", "rov:9360"));
    CHECK(web_guard_origin(&guard, "https://app.foxglove.dev", "rov:9360"));
    CHECK(!web_guard_origin(&guard, "http://rov:80", "rov:9360"));
    CHECK(!web_guard_origin(&guard, "http://evil.example", "rov:9360"));
    CHECK(!web_guard_origin(&guard, "http://rov:9360.evil.example", "rov:9360"));
    CHECK(!web_guard_origin(&guard, "http://app.foxglove.dev", "rov:9360"));
    CHECK(!web_guard_origin(&guard, "null", "rov:9360"));
    CHECK(!web_guard_origin(&guard, "", "rov:9360"));
}

int main(void)
{
    RUN(host);
    RUN(a_long_host);
    RUN(origin);
    return test_end();
}
