/* SPDX-License-Identifier: MIT */
/* test_image_method - a turn of a head as rows: at their bearings, as old as they are, and no older than was asked. */
#include "tests/lib/daemon_rig.h"

#define SECOND     1000000000ull
#define TURN_PINGS 144
#define PING_NS    (SECOND / 25)

/* Looks to the right of the vehicle's bow by 30 degrees. */
#define CONF                                                                                                      \
    "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\nrotation = 0 0 30 deg\n"                     \
    "[extract]\nminimum_range = 10 m\nno_echo = range\n"

static bool begin(void)
{
    if (!rig_start(CONF))
        return false;
    for (uint32_t i = 0; i < TURN_PINGS; i++)
        rig_send(&(struct rig_ping){.t_ns = 100 * SECOND + i * PING_NS,
                                    .seq = i + 1,
                                    .new_turn = i == 0,
                                    .head_units = i,
                                    .head_turn = TURN_PINGS,
                                    .az_rad = i * GEO_TURN / TURN_PINGS,
                                    .wide_deg = 3,
                                    .high_deg = 25,
                                    .range_m = i == 100 ? 4 : 0});
    return true;
}

TEST(rows_are_as_old_as_they_are_and_no_older_than_asked)
{
    static const struct {
        double newer_s; /* 0: all */
        size_t rows;
    } ask_for[] = {{0, TURN_PINGS}, {0.99, 25}, {3.99, 100}, {100, TURN_PINGS}};
    if (!begin()) {
        CHECK(false);
        return;
    }
    for (size_t k = 0; k < sizeof ask_for / sizeof ask_for[0]; k++) {
        const double newer_s = ask_for[k].newer_s;
        json_t *a = ask("image", newer_s > 0 ? json_pack("{s:f}", "newer_s", newer_s) : json_object()), *row;
        size_t i;
        CHECK_INT(json_array_size(json_object_get(a, "rows")), ask_for[k].rows);
        json_array_foreach(json_object_get(a, "rows"), i, row)
        {
            const double sent = TURN_PINGS - 1 - number(row, "age_s") * 25, /* which of the pings it is */
                az_deg = geo_deg(geo_wrap(geo_rad(sent * 360 / TURN_PINGS + 30)));
            CHECK_NEAR(sent, round(sent), 0, 0.01);
            CHECK(fabs(geo_wrap_pi(geo_rad(number(row, "azimuth_deg") - az_deg))) < geo_rad(0.1));
            CHECK(newer_s <= 0 || number(row, "age_s") <= newer_s);
            CHECK(json_is_number(json_object_get(row, "echo_m")) == (round(sent) == 100));
        }
        json_decref(a);
    }
    rig_end();
}

int main(void)
{
    RUN(rows_are_as_old_as_they_are_and_no_older_than_asked);
    return test_end();
}
