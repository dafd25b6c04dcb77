/* SPDX-License-Identifier: MIT */
/*
 * fuzz_nmea2000 - any frames for the NMEA 2000 device: see drive_can.h. The first byte chooses the configuration.
 */
#include "drive_can.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 1)
        return 0;
    const struct device_conf conf = {.range_m = 50,
                                     .sound_speed_mps = 1500,
                                     .gain = -1,
                                     .node = data[0] & 1 ? 42 : -1,
                                     .sensor_id = data[0] & 2 ? 3 : -1,
                                     .listen_only = data[0] & 4};
    drive_can(&device_nmea2000, &conf, data + 1, size - 1);
    return 0;
}
