/* SPDX-License-Identifier: MIT */
/* test_cells_file - cells of a grid as CSV and as a point cloud, against rows and bytes written by hand. */
#include "tests/lib/test.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "client/ctl/cells_file.h"
#include "drivers/capture/mcap.h"

/* North 1, east 2, down 3; one that nobody has an age of. */
static const char text[] =
    "[{\"azimuth_deg\":63.5,\"elevation_deg\":-20,\"from_m\":3.5,\"to_m\":4,\"near_m\":3.25,"
    "\"position_m\":[1.0,2.0,3.0],\"position_sd_m\":0.5,\"confidence\":0.75,\"blocks\":true,\"echoes\":300,"
    "\"first_echo_age_s\":12.5,\"last_echo_age_s\":0.25,\"misses\":2,\"turn\":\"appeared\",\"locked\":false,"
    "\"sensor\":\"front\"},"
    "{\"azimuth_deg\":0,\"elevation_deg\":0,\"from_m\":1,\"to_m\":2,\"near_m\":1,\"position_m\":[-1,0,0],"
    "\"position_sd_m\":0,\"confidence\":0.5,\"blocks\":false,\"echoes\":1,\"first_echo_age_s\":null,"
    "\"last_echo_age_s\":null,\"misses\":0,\"turn\":\"missed\",\"locked\":true,\"sensor\":\"?\"}]";

TEST(a_row_for_each_cell)
{
    char *out = NULL;
    size_t size;
    json_t *cells = json_loads(text, 0, NULL);
    FILE *file = open_memstream(&out, &size);
    cells_csv_head(file, true);
    cells_csv_row(file, json_array_get(cells, 0), 1500000000.125);
    cells_csv_row(file, json_array_get(cells, 1), 1500000000.125);
    cells_csv_head(file, false);
    fclose(file);
    CHECK_STR(out, "t_unix,north_m,east_m,down_m,position_sd_m,azimuth_deg,elevation_deg,from_m,to_m,near_m,"
                   "confidence,blocks,first_echo_age_s,last_echo_age_s,echoes,misses,turn,locked,sensor\n"
                   "1500000000.125,1,2,3,0.5,63.5,-20,3.5,4,3.25,0.75,1,12.5,0.25,300,2,appeared,0,front\n"
                   "1500000000.125,-1,0,0,0,0,0,1,2,1,0.5,0,,,1,0,missed,1,?\n"
                   "t_unix,forward_m,right_m,down_m,position_sd_m,azimuth_deg,elevation_deg,from_m,to_m,near_m,"
                   "confidence,blocks,first_echo_age_s,last_echo_age_s,echoes,misses,turn,locked,sensor\n");
    free(out);
    json_decref(cells);
}

/* The points of the one message, decoded; *n of them. */
static uint8_t *points_of(bool ned, char *frame, size_t *n)
{
    char path[] = "/tmp/sonard-cells-XXXXXX";
    json_t *cells = json_loads(text, 0, NULL);
    struct fault fault = {""};
    struct mcap_message m;
    uint8_t *points = NULL;
    const int fd = mkstemp(path);
    CHECK(fd >= 0 && cells_capture(cells, ned, 1500000000.125, fd, &fault));
    struct mcap_reader *file = mcap_open(path, NULL, NULL, &fault);
    CHECK(file && mcap_next(file, &m));
    if (!test_case_failed) {
        CHECK_STR(m.channel->topic, "/grid/cells");
        CHECK_INT((long long)m.log_ns, 1500000000125000000);
        json_t *cloud = json_loadb((const char *)m.data, m.size, 0, NULL);
        const char *data = json_string_value(json_object_get(cloud, "data"));
        static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        const size_t length = data ? strlen(data) : 0;
        points = calloc(1, length + 4);
        for (size_t i = 0; i < length && data[i] != '='; i++)
            for (int bit = 0; bit < 6; bit++)
                if ((strchr(digits, data[i]) - digits) >> (5 - bit) & 1)
                    points[(6 * i + (size_t)bit) / 8] |= (uint8_t)(0x80 >> (6 * i + (size_t)bit) % 8);
        *n = (length / 4 * 3) / 44;
        snprintf(frame, 16, "%s", json_string_value(json_object_get(cloud, "frame_id")));
        CHECK_INT(json_integer_value(json_object_get(cloud, "point_stride")), 44);
        json_decref(cloud);
    }
    mcap_close(file);
    unlink(path);
    json_decref(cells);
    return points;
}

static double as_double(const uint8_t *at)
{
    double v;
    memcpy(&v, at, sizeof v);
    return v;
}

static float as_float(const uint8_t *at)
{
    float v;
    memcpy(&v, at, sizeof v);
    return v;
}

TEST(a_point_for_each_cell_in_the_axes_of_the_tools)
{
    static const double want[2][3] = {{1, -2, -3}, {2, 1, -3}}; /* forward, left, up; east, north, up */
    for (int ned = 0; ned < 2; ned++) {
        char frame[16] = "";
        size_t n = 0;
        uint8_t *p = points_of(ned, frame, &n);
        CHECK_STR(frame, ned ? "map" : "vehicle");
        CHECK_INT(n, 2);
        for (int a = 0; p && a < 3; a++)
            CHECK_NEAR(as_double(p + 8 * a), want[ned][a], 0, 0);
        if (p) {
            CHECK_NEAR(as_float(p + 24), 0.5, 0, 0);
            CHECK_NEAR(as_float(p + 28), 3.25, 0, 0);
            CHECK_NEAR(as_float(p + 32), 0.75, 0, 0);
            CHECK_NEAR(as_float(p + 36), 0.25, 0, 0);
            CHECK_INT(p[40] + 256 * p[41], 300);
            CHECK_INT(p[42], 1);
            CHECK_INT(p[43], 0);
            CHECK_INT(p[44 + 42], 0);
            CHECK_INT(p[44 + 43], 1);
        }
        free(p);
    }
}

int main(void)
{
    RUN(a_row_for_each_cell);
    RUN(a_point_for_each_cell_in_the_axes_of_the_tools);
    return test_end();
}
