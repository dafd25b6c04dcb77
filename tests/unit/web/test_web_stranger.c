/* SPDX-License-Identifier: MIT */
/* A page for an unknown name says what to type, and nothing of the name is markup. */
#include "tests/lib/test.h"
#include "web/web_stranger.h"

static bool has(const char *host, const char *words)
{
    char *page = web_stranger_page(host, "192.0.2.1:9360");
    const bool found = page && strstr(page, words);
    free(page);
    return found;
}

TEST(says_what_to_type)
{
    CHECK(has("rov.lan:9360", "href=\"http://192.0.2.1:9360/\""));
    CHECK(has("rov.lan:9360", "sonard-web --names rov.lan<"));
    CHECK(has("", "192.0.2.1"));
    CHECK(has(NULL, "192.0.2.1"));
}

TEST(no_markup)
{
    CHECK(!has("<script>alert(1)</script>", "<script"));
    CHECK(!has("a\"onload=\"b", "\"onload"));
    CHECK(!has("a&lt;b", "&lt;"));
    CHECK(has("<b>\xff", "names ?b?"));
}

int main(void)
{
    RUN(says_what_to_type);
    RUN(no_markup);
    return test_end();
}
