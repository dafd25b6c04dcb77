/* SPDX-License-Identifier: MIT */
/* test_drawing - scenes of lines and arcs: what a file may say, what it may not, and where rays end. */
#include "report/lib/drawing.h"

#include <unistd.h>

#include "grid/geometry.h"
#include "tests/lib/test.h"

static struct drawing drawing;
static struct fault fault;

static bool read_text(const char *text)
{
    char path[] = "/tmp/drawing.XXXXXX";
    const int fd = mkstemp(path);
    CHECK(fd >= 0 && write(fd, text, strlen(text)) == (ssize_t)strlen(text));
    close(fd);
    fault.text[0] = '\0';
    const bool good = drawing_read(path, &drawing, &fault);
    unlink(path);
    return good;
}

TEST(both_scenes_of_the_report_are_read)
{
    CHECK(drawing_read("report/scenes/model.scene", &drawing, &fault));
    CHECK_INT(drawing.edges, 11);
    CHECK_INT(drawing.places, 10);
    CHECK(drawing_read("report/scenes/harbour.scene", &drawing, &fault));
    CHECK_INT(drawing.edges, 6);
    CHECK_NEAR(drawing.yaw_deg, 5, 0, 0);
}

TEST(wrong_lines_are_refused_by_number)
{
    static const char *const bad[] = {"\n\nline 0 0 1",     "\n\nline 0 0 1 1 1",  "\n\nline 2 2 2 2",
                                      "\n\narc 0 0 0 0 90", "\n\narc 0 0 1 90 90", "\n\narc 0 0 1 0 361",
                                      "\n\nopening 0",      "\n\nplaces 2.5",      "\n\nrange x",
                                      "\n\ncircle 0 0 1",   "\n\nrange nan",       "\n\nrange 1 2",
                                      "\n\nline 0 0 1e9 0"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        CHECK(!read_text(bad[i]));
        CHECK(strstr(fault.text, ":3:"));
    }
    CHECK(!read_text("# nothing\nrange 5 # metres\n"));
    CHECK(strstr(fault.text, "without lines"));
    CHECK(!drawing_read("/nowhere/x.scene", &drawing, &fault));
    char crowd[20 * (DRAWING_EDGES + 1) + 1] = "";
    for (int i = 0; i <= DRAWING_EDGES; i++)
        strcat(crowd, "line 0 0 1 1\n");
    CHECK(!read_text(crowd));
}

TEST(rays_end_at_the_nearest_edge)
{
    CHECK(read_text("line 5 -1 5 1\nline 8 -9 8 9\narc 0 0 3 90 180\narc -20 0 2 0 360\n"));
    const double at[2] = {0, 0};
    CHECK_NEAR(drawing_ray(&drawing, at, 0), 5, 1e-12, 0);
    CHECK_NEAR(drawing_ray(&drawing, at, geo_rad(30)), 8 / cos(geo_rad(30)), 1e-12, 0);
    CHECK_NEAR(drawing_ray(&drawing, at, geo_rad(100)), 3, 1e-12, 0);
    CHECK_NEAR(drawing_ray(&drawing, at, geo_rad(179.9)), 3, 1e-12, 0);
    CHECK_NEAR(drawing_ray(&drawing, at, geo_rad(181)),
               20 * cos(geo_rad(1)) - sqrt(4 - pow(20 * sin(geo_rad(1)), 2)), 1e-9, 0);
    CHECK(isinf(drawing_ray(&drawing, at, geo_rad(-100))));
    CHECK_NEAR(drawing_length(&drawing.edge[2]), 3 * GEO_PI / 2, 1e-12, 0);
    double p[2];
    drawing_point(&drawing.edge[2], 1, p);
    CHECK_NEAR(p[0], -3, 1e-12, 0);
    CHECK_NEAR(p[1], 0, 0, 1e-12);
}

int main(void)
{
    RUN(both_scenes_of_the_report_are_read);
    RUN(wrong_lines_are_refused_by_number);
    RUN(rays_end_at_the_nearest_edge);
    return test_end();
}
