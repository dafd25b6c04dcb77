/* SPDX-License-Identifier: MIT */
/* Parameters of a URL as those of a method. */
#include "tests/lib/test.h"
#include "web/web_query.h"

/* The parameters as JSON text, or the fault's sentence. The caller frees it. */
static char *added(const char *method, const char *const *parts)
{
    json_t *params = json_object();
    struct fault fault = {""};
    bool good = true;
    char *text;
    for (; *parts && good; parts++)
        good = web_query_add(web_query_method(method), params, *parts, strlen(*parts), &fault);
    text = good ? json_dumps(params, JSON_COMPACT | JSON_SORT_KEYS) : strdup(fault.text);
    json_decref(params);
    return text;
}

static void check(const char *method, const char *one, const char *two, const char *want)
{
    const char *const parts[] = {one, two, NULL};
    char *text = added(method, parts);
    CHECK_STR(text, want);
    free(text);
}

TEST(only_what_asks)
{
    CHECK(web_query_method("blocked") && web_query_method("stats") && web_query_method("map_slice"));
    CHECK(!web_query_method("pose") && !web_query_method("reload") && !web_query_method("map_forget"));
    CHECK(!web_query_method("grid_lock") && !web_query_method("background_learn"));
    CHECK(!web_query_method("watch") && !web_query_method("unwatch"));
    CHECK(!web_query_method("") && !web_query_method("../etc/passwd") && !web_query_method("blocked/"));
}

TEST(values)
{
    check("blocked", "azimuth_deg=-30.5", "distance_m=1e1", "{\"azimuth_deg\":-30.5,\"distance_m\":10.0}");
    check("blocked", "frame=ned", "grid=far", "{\"frame\":\"ned\",\"grid\":\"far\"}");
    check("sectors", "count=72", "elevation_deg=-5,5", "{\"count\":72,\"elevation_deg\":[-5.0,5.0]}");
    check("limit", "velocity_mps=1,-0.5,0", NULL, "{\"velocity_mps\":[1.0,-0.5,0.0]}");
    check("path", "points_m=[[1,2,3],[4,5,6]]", "radius_m=0.4",
          "{\"points_m\":[[1,2,3],[4,5,6]],\"radius_m\":0.40000000000000002}");
    check("background", "picture=yes", NULL, "{\"picture\":\"yes\"}");
}

TEST(what_is_wrong)
{
    check("blocked", "azimut_deg=1", NULL, "blocked has no parameter 'azimut_deg'; see /api/openapi.json");
    check("blocked", "azimuth_deg", NULL, "azimuth_deg: expected azimuth_deg=..., at most 8192 bytes");
    check("blocked", "azimuth_deg=", NULL, "azimuth_deg=: expected a number");
    check("blocked", "azimuth_deg=1x", NULL, "azimuth_deg=1x: expected a number");
    check("blocked", "azimuth_deg=nan", NULL, "azimuth_deg=nan: expected a number");
    check("blocked", "azimuth_deg=inf", NULL, "azimuth_deg=inf: expected a number");
    check("blocked", "azimuth_deg=0x10", NULL, "azimuth_deg=0x10: expected a number");
    check("blocked", "azimuth_deg= 1", NULL, "azimuth_deg= 1: expected a number");
    check("blocked", "azimuth_deg=1", "azimuth_deg=2", "azimuth_deg is given twice");
    check("sectors", "count=7.5", NULL, "count=7.5: expected a whole number");
    check("limit", "velocity_mps=1,,0", NULL, "velocity_mps=1,,0: expected numbers separated by commas");
    check("limit", "velocity_mps=1;2;3", NULL, "velocity_mps=1;2;3: expected numbers separated by commas");
    check("path", "points_m=1,2,3", NULL, "points_m=1,2,3: expected a JSON array of places, [[1,2,3],[4,5,6]]");
    check("blocked", "frame=\xff", NULL, "frame=?: expected text in UTF-8");
}

TEST(a_value_with_a_nul)
{
    json_t *params = json_object();
    struct fault fault;
    CHECK(!web_query_add(web_query_method("blocked"), params, "frame=a\0b", 9, &fault));
    CHECK_INT(json_object_size(params), 0);
    json_decref(params);
}

TEST(a_value_that_is_too_long)
{
    static char text[WEB_QUERY_VALUE_MAX + 100] = "frame=";
    json_t *params = json_object();
    struct fault fault;
    memset(text + 6, 'a', WEB_QUERY_VALUE_MAX + 1);
    CHECK(!web_query_add(web_query_method("blocked"), params, text, 6 + WEB_QUERY_VALUE_MAX + 1, &fault));
    CHECK(web_query_add(web_query_method("blocked"), params, text, 6 + WEB_QUERY_VALUE_MAX, &fault));
    json_decref(params);
}

/* What is not named as cheap costs: a new method does until somebody thinks of it. */
TEST(only_named_methods_are_cheap)
{
    unsigned cheap = 0;
    for (const struct protocol_method *m = protocol_methods; m->name; m++)
        cheap += web_query_is_cheap(m);
    CHECK_INT(cheap, 11);
    CHECK(web_query_is_cheap(protocol_find("blocked")));
    CHECK(!web_query_is_cheap(protocol_find("next_look")));
}

int main(void)
{
    RUN(only_named_methods_are_cheap);
    RUN(only_what_asks);
    RUN(values);
    RUN(what_is_wrong);
    RUN(a_value_with_a_nul);
    RUN(a_value_that_is_too_long);
    return test_end();
}
